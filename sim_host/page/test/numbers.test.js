// SPDX-License-Identifier: Apache-2.0
import { test } from "node:test";
import assert from "node:assert/strict";
import { Numbers, shortest, typed } from "../web/numbers.js";

test("a stored float is written with the fewest digits that read back as its bits", () => {
  for (const [text, value] of [["0.1", Math.fround(0.1)], ["1e-7", Math.fround(1e-7)], ["0.33333334", Math.fround(1 / 3)], ["-2.5", -2.5], ["0", 0]])
    assert.equal(shortest(value, "float"), text);
  let bits = new Uint32Array([1]), float = new Float32Array(bits.buffer);
  for (let i = 0; i < 20000; i++) {
    bits[0] = (Math.imul(bits[0], 1664525) + 1013904223) >>> 0;
    if (Number.isFinite(float[0])) assert.equal(Math.fround(Number(shortest(float[0], "float"))), float[0]);
  }
  assert.equal(shortest(48.262700002, "steps"), "48.262700002");
});

test("a value that is the robot's own is no change, and another is one", () => {
  let calls = 0;
  const numbers = new Numbers([{ path: "a.b", storage: "float" }, { path: "c", storage: "whole" }], () => calls++);
  numbers.of({ name: "rover", values: [[Math.fround(0.1)], [3, 4]] });
  numbers.take(0, { value: "0.1" });
  assert.deepEqual(numbers.settings(), []);
  numbers.take(1, { value: "3, 5" });
  assert.deepEqual(numbers.settings(), [[1, 0, 3], [1, 1, 5]]);
  assert.equal(numbers.file(), "# rover\nc = 3 5\n");
  const other = new Numbers(numbers.rows, () => {});
  other.of(numbers.robot);
  other.takeNamed({ "a.b": [1, 2] });
  assert.deepEqual(other.settings(), []);
  other.takeNamed({ ...numbers.named(), "a.b": ["1"], unknown: [1], __proto__: [2] });
  assert.deepEqual(other.settings(), numbers.settings());
  other.takeNamed({ "a.b": [2] });
  assert.deepEqual(other.settings(), [[0, 0, 2]], "settings replace what was changed");
  const input = { value: "fast" };
  assert.match(numbers.take(0, input), /a\.b: 1 number.*; 0 given/);
  assert.match(numbers.take(1, { value: "1 2 3" }), /c: 2 number.*; 3 given/);
  assert.deepEqual(numbers.settings(), [[1, 0, 3], [1, 1, 5]], "what is not understood changes nothing");
  assert.equal(calls, 2);
});

test("a comma is a decimal point where it separates nothing", () => {
  for (const [text, count, wanted] of [["0,002", 1, [0.002]], ["0 -1 0", 3, [0, -1, 0]], ["1, 2, 3", 3, [1, 2, 3]], ["1,2,3", 3, [1, 2, 3]], ["0,5 1 2,5", 3, [0.5, 1, 2.5]], ["1 x", 2, [1, NaN]], ["", 1, [NaN]], ["1e-3", 1, [0.001]]])
    assert.deepEqual(typed(text, count), wanted, text);
});
