// SPDX-License-Identifier: Apache-2.0
// node wasi.mjs PROGRAM: runs a WebAssembly program that prints (WASI preview 1, https://nodejs.org/api/wasi.html).
import { readFileSync } from "node:fs";
import { WASI } from "node:wasi";

const wasi = new WASI({ version: "preview1", args: [process.argv[2]] });
const { instance } = await WebAssembly.instantiate(readFileSync(process.argv[2]), {
  wasi_snapshot_preview1: wasi.wasiImport,
});
process.exitCode = wasi.start(instance);
