// SPDX-License-Identifier: Apache-2.0
// A log whose node began with another radius than its robot is built with: the page's node takes it from the log.
import { test } from "node:test";
import assert from "node:assert/strict";
import { Bench, moduleOf } from "./bench.mjs";
import { Engine } from "../web/engine.js";

const MODULE = process.env.TETAP_PAGE_MODULE, PATH = "wheels.drive.left_radius_m";

test("a kept set is made active before the replay, and is named", { skip: !MODULE }, () => {
  const module = moduleOf(MODULE), bench = new Bench(module, "mrclam");
  const lines = bench.advance(1200).map((line, i) => `(${(1 + i * 1e-4).toFixed(6)}) can0 ${line}\n`);
  // Est_Param behind the begin: no word is not as compiled. As of a board that kept the radius it counts one, and names it.
  const at = lines.findIndex((line) => line.includes(" 348#1D3E0000"));
  assert.ok(at > 0);
  const kept = lines.with(at, lines[at].replace("#1D3E0000", "#1D3E0001") + lines[at].replace(/#.*/, "#0080001FCDCC4C3D"));
  const replay = (log, settings = []) => {
    const bytes = new TextEncoder().encode(log.join("")), engine = new Engine(module, (offset, length) => bytes.subarray(offset, offset + length), () => {});
    engine.choose(bench.robot, settings);
    return engine.replay(0x300);
  };
  const row = bench.about.parameters.findIndex(({ path }) => path === PATH);
  const [built, own, again] = [replay(lines), replay(lines, [[row, 0, 0.05]]), replay(kept)];
  assert.deepEqual([built.epochs_different, built.began_with, own.began_with], [0, [], []]);
  assert.deepEqual(again.began_with, [{ path: PATH, values: [Math.fround(0.05)] }]);
  assert.deepEqual([again.epochs, again.state_crc_last], [own.epochs, own.state_crc_last]);
  assert.notEqual(again.state_crc_last, built.state_crc_last);
});
