// SPDX-License-Identifier: Apache-2.0
import { test } from "node:test";
import assert from "node:assert/strict";
import { parsed, textOf } from "../web/settings_text.js";

test("settings go there and back, also behind a #", () => {
  const numbers = { "gnss.sigma_scale": [1.5], "gyro.up_s": [0, -1e-7, 1] }, text = textOf("rover", numbers);
  assert.equal(text, "rover;gnss.sigma_scale=1.5;gyro.up_s=0,-1e-7,1");
  for (const form of [text, `#${text}`, `#${encodeURIComponent(text)}`, ` ${text} `]) assert.deepEqual({ ...parsed(form).numbers }, numbers);
  assert.equal(parsed("rover").robot, "rover");
});

test("what is no settings is none", () => {
  for (const text of ["", "#", "Rover", "rover;a", "rover;a=", "rover;a=1,", "rover;a=x", "rover;a=1e999", "rover;__proto__=1", "<img src=x onerror=alert(1)>", "rover;a=1;javascript:alert(1)", "%", "r".repeat(99), `rover;${"a=1;".repeat(9999)}`])
    assert.equal(parsed(text), null, text.slice(0, 40));
  assert.equal(Object.getPrototypeOf(parsed("rover;a=1").numbers), null);
});
