// SPDX-License-Identifier: Apache-2.0
import { test } from "node:test";
import assert from "node:assert/strict";
import { Table } from "../web/columns.js";

const bytes = (text) => new TextEncoder().encode(text);

test("numbers are those that JavaScript itself reads", () => {
  const table = new Table(), texts = [];
  let seed = 1;
  const draw = (n) => (seed = (seed * 48271) % 2147483647) % n;
  for (let i = 0; i < 20000; i++) {
    const digits = Array.from({ length: 1 + draw(19) }, () => draw(10)).join("");
    const point = draw(digits.length + 1);
    texts.push((draw(2) ? "-" : "") + (point === 0 || point === digits.length ? digits : `${digits.slice(0, point)}.${digits.slice(point)}`));
  }
  table.add(bytes(`value,empty\n${texts.map((text) => `${text},\n`).join("")}`));
  assert.equal(table.rows, texts.length);
  texts.forEach((text, row) => assert.ok(Object.is(table.values("value")[row] + 0, Number(text) + 0), text));
  assert.ok(table.values("empty").every(Number.isNaN));
});

test("words are kept, over blocks and to another thread", () => {
  const table = new Table();
  table.add(bytes("t,mode\n1,Boot\n2,Nominal\n"));
  table.add(bytes("3,Boot\n"));
  const other = Table.unpacked(structuredClone(table.packed()));
  assert.deepEqual([0, 1, 2].map((row) => other.word("mode", row)), ["Boot", "Nominal", "Boot"]);
  assert.equal(other.values("t")[2], 3);
  assert.equal(other.values("nothing").length, 0);
});

test("a table that grows from parts of another is that table", () => {
  const whole = new Table(), part = new Table(), grown = new Table(), heading = "t,mode,x\n";
  whole.add(bytes(heading));
  part.add(bytes(heading));
  for (let i = 0; i < 5000; i++) {
    const line = bytes(`${i},${["Boot", "", "Nominal"][(i * i) % 3]},${i % 7 ? i / 8 : ""}\n`);
    whole.add(line);
    part.add(line);
    if (i % 900 === 0) grown.append(structuredClone(part.taken()));
  }
  grown.append(part.taken());
  assert.equal(grown.rows, whole.rows);
  assert.deepEqual(grown.values("x"), whole.values("x"));
  for (let row = 0; row < 5000; row++) assert.equal(grown.word("mode", row), whole.word("mode", row));
  const other = new Table();
  other.add(bytes(`${heading}1,Fault,2\n2,Boot,3\n`));
  grown.append(other.packed());
  assert.deepEqual([5000, 5001].map((row) => grown.word("mode", row)), ["Fault", "Boot"]);
});
