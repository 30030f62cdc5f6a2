// SPDX-License-Identifier: Apache-2.0
// A module that traps ends its task with the trap's name, and the worker goes on.
import { test } from "node:test";
import assert from "node:assert/strict";
import { Tasks } from "../web/worker.js";

// (module (memory (export "memory") 1) (func (export "identify") (result i32) unreachable))
const TRAP = Uint8Array.from([0, 97, 115, 109, 1, 0, 0, 0, 1, 5, 1, 96, 0, 1, 127, 3, 2, 1, 0, 5, 3, 1, 0, 1, 7, 21, 2, 6, ...Buffer.from("memory"), 2, 0, 8, ...Buffer.from("identify"), 0, 0, 10, 5, 1, 3, 0, 0, 11]);

test("a trap is named, and is no refusal", async () => {
  const said = [], tasks = new Tasks();
  globalThis.postMessage = (message) => said.push(message);
  globalThis.FileReaderSync = class {};
  await tasks.task({ module: new WebAssembly.Module(TRAP) });
  for (const id of [1, 2]) await tasks.task({ id, name: "open", log: new Blob([]) });
  await tasks.task({ id: 3, name: "no such task" });
  assert.deepEqual(said.map(({ id, trapped, refused }) => [id, trapped, refused]), [[1, true, false], [2, true, false], [3, false, false]]);
  assert.match(said[0].failed, /unreachable/);
});
