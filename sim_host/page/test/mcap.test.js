// SPDX-License-Identifier: Apache-2.0
// The log in an MCAP file: of tools/can/export_log's writer, whose files npm's reader judges (test/export/judge), and in files that are none.
import { test } from "node:test";
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import "./globals.mjs";
import { logOfMcap } from "../web/mcap.js";

const ROOT = dirname(dirname(dirname(dirname(fileURLToPath(import.meta.url)))));
const LOG = Array.from({ length: 3000 }, (_, i) => `(${(1 + i * 0.01).toFixed(6)}) can0 320#00000000000000${(i % 256).toString(16).padStart(2, "0")}\n`).join("");
const WRITE = `import gzip, sys
import numpy as np
sys.path.insert(0, sys.argv[1] + "/tools/python")
from tetap.export import mcap
log = sys.stdin.buffer.read()
file = mcap.File("tetap", {}, [("picture.png", "image/png", b"..."), ("run.log.gz", "application/gzip", gzip.compress(log))] if log else [])
file.add(file.channel("/a", "std_msgs/msg/Bool", "bool data"), np.arange(9000), np.zeros((9000, 200), np.uint8))
open(sys.argv[2], "wb").write(bytes(file))`;

function written(log) {
  const folder = mkdtempSync(join(tmpdir(), "tetap-mcap-")), path = join(folder, "a.mcap");
  execFileSync("/usr/bin/python3", ["-c", WRITE, ROOT, path], { input: log });
  const bytes = new Uint8Array(readFileSync(path));
  rmSync(folder, { recursive: true });
  return bytes;
}

test("the log comes out as it was recorded", async () => {
  const log = await logOfMcap(new File([written(LOG)], "run.mcap"));
  assert.equal(log.name, "run.log");
  assert.equal(await log.text(), LOG);
});

test("a file that is no MCAP is left to others, and one without a log is refused with what to do", async () => {
  assert.equal(await logOfMcap(new File([LOG], "run.log")), null);
  assert.equal(await logOfMcap(new File([""], "empty")), null);
  await assert.rejects(logOfMcap(new File([written("")], "ros.mcap")), /ros\.mcap: no log is attached; .*make export/);
});

test("cut off or bent anywhere, it is one clear line or the log", async () => {
  const whole = written(LOG), refused = new Set();
  const opened = (bytes) => logOfMcap(new File([bytes], "b.mcap")).then((log) => log?.text(), (error) => (refused.add(error.message.replace(/^b\.mcap: (run\.log\.gz: )?/, "").slice(0, 12)), null));
  for (let size = 8; size < 1200; size += 7) assert.equal(await opened(whole.slice(0, size)), null);
  for (let at = 8; at < 600; at++) {
    const bent = whole.slice();
    bent[at] ^= 0xff;
    await opened(bent);
  }
  for (const reason of ["is cut off", "no log is at", "cannot be un", "an attachmen"]) assert.ok([...refused].some((one) => reason.startsWith(one.slice(0, 10))), `${reason} of ${[...refused]}`);
});
