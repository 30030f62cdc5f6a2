// SPDX-License-Identifier: Apache-2.0
import { test } from "node:test";
import assert from "node:assert/strict";
import { Table } from "../web/columns.js";
import { ThinnedTable, beginningOf, tableOf } from "../web/thinning.js";

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

test("a long table keeps every change and refusal, and of each kind of rows every n-th", () => {
  const table = new ThinnedTable({ most: 1000, kinds: ["estimator", "sensor"], changes: ["state"], refusals: true });
  table.add(bytes("t,estimator,sensor,verdict,state\n"));
  const refused = new Set(), changed = new Set([0, 1, 2]), rows = 60000;
  for (let i = 0; i < rows; i++) {
    const verdict = i % 977 === 3 ? "Rejected" : "Accepted", state = i > 41000 ? "Lost" : "Fusing";
    if (verdict === "Rejected") refused.add(i);
    if (i > 41000 && i <= 41003) changed.add(i);
    table.add(bytes(`${i},2,${["A", "B", "C"][i % 3]},${verdict},${state}\n`));
  }
  assert.ok(table.rows < 1000 && table.rows > 400, `${table.rows} rows`);
  assert.equal(table.every, 128);
  const times = new Set(table.values("t"));
  for (const row of [...refused, ...changed]) assert.ok(times.has(row), `row ${row} stays`);
  for (const sensor of ["A", "B", "C"]) {
    const own = [...table.values("t")].filter((t, row) => table.word("sensor", row) === sensor && !refused.has(t) && !changed.has(t));
    assert.ok(own.every((t) => Math.floor(t / 3) % 128 === 0) && own.length > 150, `${sensor}: ${own.length}`);
  }
  assert.ok(times.has(rows - 96) || [...times].some((t) => t > rows - 400), "up to the end");
});

test("cells that come at every tenth row are a kind of their own", () => {
  const table = new ThinnedTable({ most: 256, kinds: [], parts: true });
  table.add(bytes("t,sigma\n"));
  for (let i = 0; i < 20000; i++) table.add(bytes(`${i},${i % 10 === 7 ? 1 : ""}\n`));
  const filled = [...table.values("sigma")].filter((value) => !Number.isNaN(value)).length;
  assert.ok(filled > 0.05 * table.rows && filled < 0.2 * table.rows, `${filled} of ${table.rows}`);
});

test("what stays may need more room than was given", () => {
  const table = new ThinnedTable({ most: 64, kinds: [], refusals: true });
  table.add(bytes("t,verdict\n"));
  for (let i = 0; i < 500; i++) table.add(bytes(`${i},${i % 2 ? "Rejected" : "Accepted"}\n`));
  const times = new Set(table.values("t"));
  for (let i = 1; i < 500; i += 2) assert.ok(times.has(i));
});

test("a table that is short is kept whole", () => {
  const thinned = tableOf("estimates"), whole = tableOf("map");
  for (const table of [thinned, whole]) table.add(bytes("epoch,estimator,x\n1,2,3\n2,2,4\n3,2,5\n"));
  assert.deepEqual([thinned.values("x"), thinned.packed().every], [whole.values("x"), 1]);
});

test("a log begins with whole lines", async () => {
  const line = "(1.000000) can0 305#0011223344556677\n", log = new Blob([line.repeat(400_000)]), part = await beginningOf(log);
  assert.ok(part.size > 11.9e6 && part.size < 12e6 && part.size % line.length === 0);
});
