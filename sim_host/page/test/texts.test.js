// SPDX-License-Identifier: Apache-2.0
import { test } from "node:test";
import assert from "node:assert/strict";
import { readFileSync, readdirSync } from "node:fs";
import { TEXTS } from "../web/texts.js";

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
  for (const on of names("../module/play.cpp", /return "(\w+)";/g)) assert.ok(`on.${on}` in TEXTS.en, on);
});
