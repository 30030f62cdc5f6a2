// SPDX-License-Identifier: Apache-2.0
import { test } from "node:test";
import assert from "node:assert/strict";
import { readFileSync, readdirSync } from "node:fs";
import { TEXTS, decimal, say, speak } from "../web/texts.js";
import { FAULTS_ID, PIECES_ID, ofModule } from "../web/texts_module.js";
import { CODES_ID, ROWS_ID, codeText, rowText } from "../web/texts_rows.js";
import { DOCTOR_ID, WORDS_ID, doctorText } from "../web/texts_doctor.js";

const web = new URL("../web/", import.meta.url);
const names = (file, pattern) => [...readFileSync(new URL(file, import.meta.url), "utf8").matchAll(pattern)].map((found) => found[1]);
const places = (text) => [...text.matchAll(/\{\d\}/g)].map(String).sort();

test("each language has the same keys, with the same places for values", () => {
  for (const [language, texts] of Object.entries(TEXTS)) {
    assert.deepEqual(Object.keys(texts).sort(), Object.keys(TEXTS.en).sort(), language);
    for (const key of Object.keys(texts)) assert.deepEqual(places(texts[key]), places(TEXTS.en[key]), `${language} ${key}`);
  }
});

test("each key that the code names has a text", () => {
  for (const file of readdirSync(web))
    for (const key of names(`../web/${file}`, /\bsay\("([^"]+)"/g)) assert.ok(key in TEXTS.en, `${file}: ${key}`);
});

test("each word of the node has a text", () => {
  const header = "../../replay/names.hpp";
  const list = (type) => {
    const source = readFileSync(new URL(header, import.meta.url), "utf8");
    const body = source.slice(source.indexOf(`name(sensor::${type} value)`));
    return [...body.slice(body.indexOf("kNames{"), body.indexOf("};")).matchAll(/"(\w+)"/g)].map((found) => found[1]);
  };
  for (const [type, prefixes] of [["Mode", ["word", "mode"]], ["SourceState", ["word"]], ["Verdict", ["verdict"]], ["Check", ["check"]], ["Sensor", ["source"]], ["EstimatorKind", ["kind"]]]) {
    assert.ok(list(type).length > 4, type);
    for (const word of list(type)) for (const prefix of prefixes) assert.ok(`${prefix}.${word}` in TEXTS.en, `${prefix}.${word}`);
  }
});

test("each sensor of a table has a text", () => {
  const all = new Set(names("../../csv/quantities.cpp", /\{"(\w+)[.\w]*", Kind::k/g));
  assert.ok(all.size > 10);
  for (const kind of all) assert.ok(`column.${kind}` in TEXTS.en, kind);
});

test("each fault of the world has a text", () => {
  const all = names("../../world/faults.cpp", /FaultInfo\{Fault::k\w+, FallsOn::k\w+, "(\w+)"/g);
  assert.ok(all.length > 30);
  for (const name of all) assert.ok(`inject.${name}` in TEXTS.en, name);
  assert.deepEqual(Object.keys(FAULTS_ID).sort(), [...all].sort(), "and says in Indonesian what it does");
  for (const on of names("../module/play.cpp", /return "(\w+)";/g)) assert.ok(`on.${on}` in TEXTS.en, on);
});

test("the receiver's latency that Play names is the world's", () => {
  const world = readFileSync(new URL("../../world/numbers.hpp", import.meta.url), "utf8"), gnss = world.slice(world.indexOf("struct GnssParameters"));
  const [longest] = gnss.match(/latency_max\{([\d']+)\}/).slice(1).map((us) => Number(us.replaceAll("'", "")) / 1000);
  assert.deepEqual(names("../web/play.js", /RECEIVER_MS = (\d+);/g).map(Number), [longest]);
});

test("each row of the parameter table and each code of the doctor has Indonesian words", () => {
  const rows = [...names("../../../src/tetap/param/table.hpp", /TETAP_ROW\(\s*0x\w+,\s*([a-z][\w.]*),/g), ...names("../../../src/tetap/param/table.hpp", /TETAP_SCALED_ROW\(0x\w+,\s*"([\w.]+)"/g)];
  assert.ok(rows.length > 200);
  assert.deepEqual(Object.keys(ROWS_ID).sort(), rows.filter((path) => path !== "bus.key").sort());
  assert.deepEqual(Object.keys(CODES_ID).sort(), names("../../doctor/codes.hpp", /CodeRow\{\s*Code::k\w+, "(\w+)"/g).sort());
  const row = { path: "gnss.gate_scale", text: "Innovation gate." };
  assert.deepEqual([rowText(row), codeText("wheel_scale", "c")], ["Innovation gate.", { cause: "c", remedy: "" }]);
  speak("id");
  assert.match(rowText(row), /^Gate inovasi/);
  assert.match(codeText("wheel_scale", "c").cause, /^Jari-jari/);
  assert.deepEqual([rowText({ path: "new.row", text: "As it is." }), codeText("new_code", "c")], ["As it is.", { cause: "c", remedy: "" }]);
  speak("en");
});

test("Indonesian has a comma in numbers, and in nothing else", () => {
  speak("id");
  assert.deepEqual(["0.5", "-1.25e-7", "≥ 40.9", "rover.log", "1.2.3", "7"].map(decimal), ["0,5", "-1,25e-7", "≥ 40,9", "rover.log", "1.2.3", "7"]);
  assert.equal(say("numbers.limits", "0.1", "2.5", "m/s"), "Rentang 0,1 sampai 2,5 m/s");
  assert.equal(ofModule("1 gyroscope rows without one before them"), "1 baris giroskop tanpa baris sebelumnya");
  speak("en");
  assert.deepEqual([decimal("0.5"), say("numbers.limits", "0.1", "2.5", "m/s"), ofModule("a [rad/s assumed]")], ["0.5", "Range 0.1 to 2.5 m/s", "a [rad/s assumed]"]);
});

test("each sentence that is put into Indonesian is one of the module", () => {
  const folders = ["../../csv/", "../module/"], code = folders.flatMap((folder) => readdirSync(new URL(folder, import.meta.url)).filter((file) => file.endsWith(".cpp")).map((file) => readFileSync(new URL(folder + file, import.meta.url), "utf8"))).join("");
  for (const [english] of PIECES_ID) assert.ok(code.includes(english), english);
});

/** Literals of the doctor as its sentences have them: # for a number, @ for words. */
const doctor = readdirSync(new URL("../../doctor/", import.meta.url)).filter((file) => /\.[ch]pp$/.test(file)).flatMap((file) => {
  const code = readFileSync(new URL(`../../doctor/${file}`, import.meta.url), "utf8").replace(/\/\/.*$/gm, "").replace(/"\s*\n\s*"/g, "");
  return [...code.matchAll(/"((?:[^"\\\n]|\\.)*)"/g)].map(([, text]) => text.replace(/%[-.\d]*(?:llu|zu|[dfgu])/g, "#").replace(/(?:%[sc])+/g, "@").replaceAll("%%", "%"));
});

test("each sentence of the doctor about a log has Indonesian words, with the same values", () => {
  const all = doctor.join("\n");
  for (const [english, own] of DOCTOR_ID) {
    // Words may be joined to a sentence in pieces.
    for (const piece of english.split("@").map((text) => text.trim())) assert.ok(all.includes(piece), english);
    const values = english.match(/[#@]/g)?.length ?? 0;
    assert.deepEqual([...own.matchAll(/\{(\d)\}/g)].map(([, i]) => Number(i)).sort(), [...Array(values).keys()], english);
  }
  for (const words of Object.keys(WORDS_ID)) assert.ok(all.includes(words) || /^(GNSS|the wheels|against)$/.test(words), words);
  speak("id");
  const sentences = doctor.filter((text) => /^[A-Z][a-z]+ .*[a-z]{3}.*\.$/.test(text) && text.includes("#"));
  assert.ok(sentences.length > 30);
  for (const text of sentences) {
    const filled = [text, text.replace(/@\.$/, ".")].map((one) => one.replaceAll("#", "1.5").replaceAll("@", "left"));
    assert.ok(filled.some((one) => doctorText(one).own), text);
  }
  const said = doctorText("The left wheel stands still for 12.5 s while the other one turns. The magnetic field turns with the gyroscope.");
  assert.deepEqual(said, { text: "Roda kiri diam selama 12,5 s sementara roda lainnya berputar. Medan magnet berputar searah dengan giroskop.", own: true });
  assert.equal(doctorText("The wheels turn the robot by -1.00 times the gyroscope's yaw rate over 169 s (correlation -0.99).").text, "Roda memutar robot -1,00 kali laju yaw giroskop selama 169 s (korelasi -0,99).");
  assert.match(doctorText("The horizontal force follows acceleration and curves by the wheels as an IMU turned by 90 deg about up (98 % of its variance over 168 s; as stated: 0 %).").text, /seperti IMU yang diputar 90 derajat terhadap sumbu tegak/);
  assert.deepEqual(doctorText("Nobody knows this."), { text: "Nobody knows this.", own: false });
  speak("en");
  assert.equal(doctorText("The left wheel").text, "The left wheel");
});
