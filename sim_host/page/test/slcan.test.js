// SPDX-License-Identifier: Apache-2.0
// The cable on a port that is none: what an adapter writes comes back as frames, all of them, and nothing is sent unasked.
import { test } from "node:test";
import assert from "node:assert/strict";
import { setFlagsFromString } from "node:v8";
import { runInNewContext } from "node:vm";
import "./globals.mjs";
import { Cable, SlcanReader } from "../web/slcan.js";

setFlagsFromString("--expose-gc");
const bytes = (text) => new TextEncoder().encode(text);

/** A port whose adapter answers commands; `feed(port)` writes what comes over the bus. */
function fakePort({ listens = true } = {}) {
  const port = { said: [], open: async (options) => (port.options = options), close: async () => (port.closed = true) };
  port.readable = new ReadableStream({ start: (controller) => (port.input = controller) });
  port.writable = new WritableStream({ write: (chunk) => {
    for (const command of new TextDecoder().decode(chunk).split("\r").filter(Boolean)) {
      port.said.push(command);
      port.input.enqueue(bytes(command === "L" && !listens ? "\x07" : command[0] === "t" ? "z\r" : "\r"));
    }
  } });
  return port;
}

test("frames of all kinds, split anywhere, are lines of a log; what is broken is counted", () => {
  const text = "t3200\rt3218DEADBEEF00112233\rT1ABCDEF02A1b2\rr1238\rt12\rt32x1AA\rt32190011\rt3201AA1234\rz\r\x07V1013\r", want = [];
  for (const size of [1, 2, 3, 7, 64]) {
    const lines = [], answers = [], reader = new SlcanReader((line) => lines.push(line), (ok) => answers.push(ok));
    for (let at = 0; at < text.length; at += size) reader.take(bytes(text.slice(at, at + size)), 1_700_000_000_123_456);
    assert.deepEqual(lines.map((line) => line.trim().split(" ")[2]), ["320#", "321#DEADBEEF00112233", "1ABCDEF0#A1B2", "320#AA"]);
    assert.deepEqual([reader.frames, reader.bad, reader.skipped], [4, 3, 1]);
    assert.deepEqual(answers, [true, false, true]);
    assert.equal(lines[0], "(1700000000.123456) slcan0 320#\n");
    want.push(lines.join());
  }
  assert.equal(new Set(want).size, 1);
});

test("it listens only, until it is asked; then one frame goes out", async () => {
  const port = fakePort(), cable = new Cable(port);
  await cable.open("S6");
  assert.deepEqual(port.said, ["C", "S6", "L"]);
  assert.ok(cable.listening && cable.refused === null);
  assert.equal(await cable.send("302#0123456789ABCDEF"), true);
  assert.deepEqual(port.said, ["C", "S6", "L", "C", "S6", "O", "t30280123456789ABCDEF"]);
  assert.equal(cable.listening, false);
  await cable.close();
  assert.equal(port.said.at(-1), "C");
  assert.ok(port.closed && cable.over);
});

test("an adapter without a listen-only mode is not opened in another one by itself", async () => {
  const port = fakePort({ listens: false }), cable = new Cable(port);
  await cable.open("S8");
  assert.equal(cable.refused, "L");
  assert.ok(!port.said.includes("O"));
  await cable.close();
});

test("commands that meet wait for each other's answers", async () => {
  const port = fakePort({ listens: false }), cable = new Cable(port);
  await cable.open();
  assert.deepEqual(await Promise.all([cable.tell("L"), cable.tell("O"), cable.tell("L")]), [false, true, false]);
  await cable.close();
});

test("an adapter that is pulled out leaves what was recorded", async () => {
  const port = fakePort(), cable = new Cable(port);
  await cable.open();
  port.input.enqueue(bytes("t3201AA\r"));
  port.input.error(new Error("The device has been lost."));
  await cable.done;
  assert.ok(cable.over);
  assert.match(await cable.recording.file("a.log").text(), /slcan0 320#AA\n$/);
});

test("8 000 frames a second for a minute of the bus: none is lost, and the heap stays", async () => {
  const port = fakePort(), cable = new Cable(port, { now: () => 0 }), count = 480_000, collect = runInNewContext("gc");
  await cable.open();
  collect();
  const before = process.memoryUsage().heapUsed;
  let pending = "", highest = 0;
  for (let i = 0; i < count; i++) {
    pending += `t${(0x300 + (i % 64)).toString(16).toUpperCase()}8${i.toString(16).toUpperCase().padStart(16, "0")}\r`;
    if (pending.length < 4093) continue;
    port.input.enqueue(bytes(pending.slice(0, 4093)));
    pending = pending.slice(4093);
    await new Promise((done) => setImmediate(done));
    if (i % 48_000 < 200) collect(), (highest = Math.max(highest, process.memoryUsage().heapUsed - before));
  }
  port.input.enqueue(bytes(pending));
  await new Promise((done) => setTimeout(done, 20));
  await cable.close();
  assert.deepEqual([cable.reader.frames, cable.reader.bad], [count, 0]);
  const lines = (await cable.recording.file("b.log").text()).trimEnd().split("\n");
  assert.equal(lines.length, count);
  for (let i = 0; i < count; i += 997) assert.equal(lines[i].split("#")[1], i.toString(16).toUpperCase().padStart(16, "0"));
  assert.ok(highest < 5e6, `${highest} bytes of heap`);
});
