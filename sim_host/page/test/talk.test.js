// SPDX-License-Identifier: Apache-2.0
// "Talk" against a running node: the flashed code of robot mrclam, in a module of its own, behind an slcan adapter. The frames that the tests send by themselves
// are coded here, from the text of config/tetap.dbc. The module is $TETAP_PAGE_MODULE, a packed page or a file .wasm, which `make page-test` names.
import { test } from "node:test";
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { Tasks } from "../web/worker.js";
import { Cable } from "../web/slcan.js";
import { SOURCE, Talk } from "../web/talk.js";
import { TEXTS } from "../web/texts.js";
import { Bench, moduleOf } from "./bench.mjs";

const path = process.env.TETAP_PAGE_MODULE, skip = path ? false : "TETAP_PAGE_MODULE names no module";
const module = path ? moduleOf(path) : null;
const CMD = 0x347, EST = "348";

/** CRC-8 of polynomial 0x2F, init and final xor 0xFF, over the id offset and bytes 1 to 7. */
const crc8 = (bytes) => 0xff ^ bytes.reduce((crc, byte) => Array.from({ length: 8 }).reduce((c) => (c & 0x80 ? (c << 1) ^ 0x2f : c << 1) & 0xff, crc ^ byte), 0xff);
function frameOf(page, counter, word, index, value) {
  const data = Buffer.alloc(8);
  data[1] = (page << 4) | counter;
  data.writeUInt16LE((index << 4) | word, 2);
  data.writeUInt32LE(value, 4);
  data[0] = crc8([CMD - 0x300, ...data.subarray(1)]);
  return `${CMD.toString(16)}#${data.toString("hex").toUpperCase()}`;
}
const pageOf = (line) => (parseInt(line.slice(6, 8), 16) >> 4) & 7;
const words = (value) => new Uint32Array(Float32Array.of(value).buffer)[0];

async function bench(options = {}) {
  const made = new Bench(module, "mrclam", options), cable = new Cable(made.port), client = Object.assign(new Tasks(), { module });
  await cable.open("S6");
  const talk = new Talk(cable, async (name, ...values) => client.talk({ function: name, values }), made.about.parameters, { now: () => made.time_ms, patience: 60 });
  const number = (name) => made.about.parameters.findIndex((row) => row.path === name);
  await talk.begin();
  return { made, cable, talk, number, own: made.about.robots[made.robot].values, pages: () => made.sent.map(pageOf), end: () => (made.stop(), cable.close()) };
}
const refused = (key) => (error) => error.key === key && (key === "module" || `talk.no.${key}` in TEXTS.en) && `talk.no.${key}` in TEXTS.id;

test("nothing is sent in listen-only; then every row of the node is read, though frames are lost", { skip }, async () => {
  let frames = 0, lost = 0;
  const { made, cable, talk, own, end } = await bench({ lose: (line) => /^34[78]/.test(line) && ++frames % 23 === 0 && ++lost });
  made.run();
  await assert.rejects(talk.read(), refused("listening"));
  assert.deepEqual([made.said, made.sent], [["C", "S6", "L"], []]);
  await cable.channel("S6", false);
  const shares = [], { rows, access } = await talk.read((share) => shares.push(share));
  assert.equal(access, 0);
  assert.ok(lost > 50, `${lost} frames were lost`);
  assert.ok(shares.at(-1) === 1 && shares.every((share, i) => i === 0 || share >= shares[i - 1]));
  made.about.parameters.forEach(({ path: name, secret }, i) => {
    if (secret) return;
    if (name !== "loop.lockstep") assert.deepEqual(rows[i].compiled, own[i], name);
    assert.deepEqual([rows[i].active, rows[i].wanted], [rows[i].compiled, rows[i].compiled], name);
  });
  assert.deepEqual([...new Set(made.sent.map((line) => line.slice(0, 3)))], ["347"], "the page sends Cmd_Param and nothing else");
  await end();
});

test("a change is listed before it is sent, is active at once or after a restart, and is restored; a save is answered by the board", { skip }, async () => {
  const { made, cable, talk, number, own, pages, end } = await bench();
  made.run();
  await cable.channel("S6", false);
  await talk.read();
  const gate = number("landmark.gate_scale"), radius = number("wheels.drive.left_radius_m"), before = made.sent.length;
  await talk.want(gate, [2]);
  await talk.want(radius, [Math.fround(0.034)]);
  await assert.rejects(talk.want(gate, [1e9]), refused("limits"));
  await assert.rejects(talk.want(number("loop.period_us"), [20000]), refused("row3"));
  assert.deepEqual(talk.changes(), [{ number: radius, old: own[radius], next: [Math.fround(0.034)] }, { number: gate, old: own[gate], next: [2] }].sort((a, b) => a.number - b.number));
  assert.equal(made.sent.length, before, "what is wanted is not sent");
  made.restart();
  made.feed(made.advance(150));
  await new Promise((done) => setTimeout(done, 20));
  const told = await talk.change();
  assert.deepEqual([told.answer, told.pending], [0, 1], "the radius waits for a restart");
  assert.deepEqual(pages().slice(before, before + 3), [0, 0, 1], "two words, one Apply");
  assert.deepEqual([talk.state.rows[gate].active, talk.state.rows[gate].compiled, talk.state.rows[radius].active], [[2], own[gate], own[radius]]);
  await talk.want(radius, own[radius]);
  await assert.rejects(talk.save(), refused("set7"), "this node's board has no flash");
  await talk.restore();
  assert.deepEqual(talk.state.rows[gate].active, own[gate]);
  await end();
});

test("while the vehicle moves, or its motion is not seen, no change and no save is sent", { skip }, async () => {
  const { made, cable, talk, number, pages, end } = await bench();
  made.run();
  await cable.channel("S6", false);
  await talk.read();
  await talk.want(number("landmark.gate_scale"), [2]);
  const settle = () => new Promise((done) => setTimeout(done, 30));
  made.stop();
  while (made.time_ms < 14_000) made.feed(made.advance(20)), await settle();
  for (const act of ["change", "save", "restore"]) await assert.rejects(talk[act](), refused("moves"), act);
  made.time_ms += 1500;
  for (const act of ["change", "save", "restore"]) await assert.rejects(talk[act](), refused("blind"), act);
  assert.ok(pages().every((page) => page === 4), "only Get was ever sent");
  await end();
});

test("what the node refuses is said: limits, access, unknown rows, another's change, a rule", { skip }, async () => {
  const { made, cable, talk, number, end } = await bench();
  made.run();
  await cable.channel("S6", false);
  await talk.read();
  made.restart();
  made.feed(made.advance(150));
  const gate = number("landmark.gate_scale");
  const own = (at, value) => talk.exchange([[at, 0]], SOURCE.staged, async (i) => ({ lines: [frameOf(0, talk.next(), 0, await indexOf(talk, i), value)] }));
  await assert.rejects(own(gate, words(1e9)), refused("row2"));
  await assert.rejects(own(number("loop.period_us"), 20_000), refused("row3"));
  // Another sender's Apply lies at the same tick.
  made.stop();
  made.command(`t${frameOf(1, 7, 0, 0, 0).replace("#", "8")}`);
  const late = assert.rejects(talk.act(1, 1000, () => false), refused("set8"));
  await new Promise((done) => setTimeout(done, 20));
  made.feed(made.advance(3));
  await late;
  made.run();
  // Another sender stages a word behind the client's back: the Apply names another set.
  await talk.want(gate, [2]);
  made.command(`t${frameOf(0, 9, 0, await indexOf(talk, number("gnss.gate_scale")), words(3)).replace("#", "8")}`);
  await assert.rejects(talk.change(), refused("set5"));
  await end();
});

test("a change whose answer is lost is found to be made", { skip }, async () => {
  let lost = 0;
  const isApplied = (line) => line.startsWith(`${EST}#`) && (parseInt(line.slice(4, 6), 16) & 0x1f) === 0x05; // kind Set, page Apply
  const { made, cable, talk, number, pages, end } = await bench({ lose: (line) => isApplied(line) && lost++ === 0 });
  made.run();
  await cable.channel("S6", false);
  await talk.read();
  made.restart();
  made.feed(made.advance(150));
  await talk.want(number("landmark.gate_scale"), [2]);
  await talk.change();
  assert.deepEqual([talk.state.rows[number("landmark.gate_scale")].active, lost, pages().filter((page) => page === 1).length], [[2], 2, 2]);
  await end();
});

test("an answer to another sender is not taken for the page's own", { skip }, async () => {
  const { made, cable, talk, end } = await bench();
  made.run();
  await cable.channel("S6", false);
  await talk.read();
  made.stop();
  const theirs = (talk.counter + 5) % 16;
  made.command(`t${frameOf(1, theirs, 0, 0, 0).replace("#", "8")}`);
  const answers = made.advance(3), own = talk.act(1, 1000, () => false);
  await new Promise((done) => setTimeout(done, 20));
  made.feed(answers);
  await new Promise((done) => setTimeout(done, 20));
  made.feed(made.advance(3));
  assert.equal((await own).answer, 0);
  await end();
});

test("motion counts as seen when it has been read, and as of when it was heard", async () => {
  let time = 5000, read;
  const ask = (name) => (name === "begin" ? Promise.resolve({ told: [{ answers: 0x348, motions: [0x329], words: [] }] }) : new Promise((resolve, reject) => (read = { resolve, reject })));
  const talk = new Talk({}, ask, [], { now: () => time });
  await talk.begin();
  talk.state = { access: 0 };
  const hear = async (moves) => {
    talk.hear("(1.0) can0 329#0000000000000000");
    await new Promise((done) => setTimeout(done));
    assert.throws(() => talk.mayChange(), refused("blind"), "it was not read yet");
    time += 700;
    moves === null ? read.reject(new Error("trap")) : read.resolve({ told: [{ moves }] });
    await talk.heard;
  };
  await hear(null);
  assert.throws(() => talk.mayChange(), refused("blind"), "it could not be read");
  await hear(false);
  talk.mayChange();
  time += 400;
  assert.throws(() => talk.mayChange(), refused("blind"), "1.1 s after it was heard");
  await hear(true);
  assert.throws(() => talk.mayChange(), refused("moves"));
});

test("what a Restore will change is known before: active rows that are not the compiled ones", () => {
  const talk = new Talk({}, null, []);
  talk.state = { rows: [{ active: [1], compiled: [1], wanted: [3] }, { active: [2, 5], compiled: [2, 4], wanted: [2, 5] }] };
  assert.deepEqual(talk.restores(), [{ number: 1, old: [2, 5], next: [2, 4] }]);
});

test("each refusal has its words", () => {
  const source = readFileSync(new URL("../web/talk.js", import.meta.url), "utf8"), keys = [...source.matchAll(/TalkRefusal\("(\w+)"/g)].map((found) => found[1]).filter((key) => key !== "module");
  const dbc = readFileSync(new URL("../../../config/tetap.dbc", import.meta.url), "utf8"), last = Number(dbc.match(/^VAL_TABLE_ ParamAnswer .* (\d+) "\w+" ;/m)[1]);
  assert.ok(keys.includes("moves") && keys.includes("limits") && last >= 8);
  for (const key of keys) for (const texts of Object.values(TEXTS)) assert.ok(`talk.no.${key}` in texts, key);
  for (let answer = 1; answer <= last; answer++) assert.ok(`talk.no.set${answer}` in TEXTS.en, `answer ${answer}`);
});

test("a node that takes no parameters from the bus, and one that is not there, end with one sentence", { skip }, async () => {
  const { made, cable, talk, end } = await bench({ lose: (line) => line.startsWith(EST) });
  made.run();
  await cable.channel("S6", false);
  await assert.rejects(talk.read(), refused("silent"));
  assert.ok(made.sent.length <= 30, "five attempts at six words");
  await end();
});

/** Index of a row on the bus, out of the frame that asks for it. */
async function indexOf(talk, number) {
  const { lines } = await talk.module("get", number, 0, SOURCE.active, 0);
  return Buffer.from(lines[0].slice(4), "hex").readUInt16LE(2) >> 4;
}
