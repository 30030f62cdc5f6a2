// SPDX-License-Identifier: Apache-2.0
// Judge: CartConvert of GeographicLib.
import { test } from "node:test";
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mapAt } from "../web/earth.js";

test("places are where GeographicLib has them, to a micrometre", () => {
  const origins = [[48.2627, 11.6683, 520], [-6.8915, 107.6107, 768], [0, 180, 0], [89.9, -45, 10]];
  const places = [[0, 0, 0], [0.001, -0.002, 30], [-0.5, 0.7, -12], [0.05, 0.05, 1000]];
  for (const origin of origins) {
    const local = mapAt(origin), all = places.map((by) => origin.map((value, i) => value + by[i])).map(([p, l, h]) => [Math.min(p, 90), l, h]);
    const input = all.map((place) => place.map((value) => value.toFixed(12)).join(" ")).join("\n");
    const said = execFileSync("CartConvert", ["-l", ...origin.map(String), "-p", "6"], { input, encoding: "utf8" });
    said.trim().split("\n").forEach((line, k) => {
      const wanted = line.split(" ").map(Number), found = local(all[k]);
      for (let i = 0; i < 3; i++) assert.ok(Math.abs(found[i] - wanted[i]) < 2e-6, `${origin} ${all[k]}: ${found} ${wanted}`);
    });
  }
});
