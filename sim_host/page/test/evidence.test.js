// SPDX-License-Identifier: Apache-2.0
// Curves of the evidence against motions whose turn rate and velocity are known.
import { test } from "node:test";
import assert from "node:assert/strict";
import { courseTurn, evidenceOf, fixVelocity } from "../web/evidence.js";

const t = Array.from({ length: 40 }, (_, i) => 10.5 + i), rate = 0.3;
const circle = { t, east: t.map((time) => 2 * Math.cos(rate * time)), north: t.map((time) => 2 * Math.sin(rate * time)) };

test("the course of a circle turns at its rate, also past half a turn; a slow one and a pause have none", () => {
  const found = courseTurn(circle);
  assert.equal(found[0], null);
  for (const one of found.slice(1)) assert.ok(Math.abs(one - rate) < 1e-9);
  assert.ok(courseTurn({ ...circle, east: circle.east.map((v) => v / 10), north: circle.north.map((v) => v / 10) }).every((one) => one === null));
  assert.equal(courseTurn({ t: [1, 5], east: [1, 0], north: [0, 1] })[1], null);
});

test("fixes on a line have its velocity; across a hole there is none", () => {
  const fixes = Array.from({ length: 100 }, (_, i) => ({ stamp: 0.2 * i, x: 0.6 * i, y: -0.2 * i }));
  const { t: times, east, north } = fixVelocity(fixes);
  assert.ok(times.length > 10 && times.length < 20);
  for (let i = 0; i < times.length; i++) assert.ok(Math.abs(east[i] - 3) < 1e-9 && Math.abs(north[i] + 1) < 1e-9);
  assert.equal(fixVelocity([fixes[0], { stamp: 60, x: 0, y: 0 }]).t.length, 0);
});

test("a finding has the curves of the devices that it compares, and none where one alone speaks", () => {
  const silent = t.map(() => null), one = (code, evidence = "") => ({ code, evidence });
  const seconds = { ...circle, turn: t.map(() => -rate), wheel_turn: t.map(() => rate), wheel_speed: t.map(() => 2), force_x: silent, force_y: silent, force_z: silent, turn_x: circle.t, turn_y: circle.t, turn_z: silent, sensor_x: silent, sensor_y: circle.t, sensor_z: circle.t };
  assert.deepEqual(evidenceOf(one("gyro_sign"), seconds, []).curves.map(({ name }) => name), ["gyroscope", "wheels", "course"]);
  assert.deepEqual(evidenceOf(one("wheel_scale"), seconds, []).curves.map(({ v }) => v[7]), [2, Math.hypot(circle.east[7], circle.north[7])]);
  assert.equal(evidenceOf(one("imu_upside_down"), seconds, []), null, "gravity alone is no comparison");
  assert.deepEqual(evidenceOf(one("dead_axis", "Z of In_Imu0Gyro kept one value"), seconds, []).curves.map(({ name }) => name), ["x", "y"]);
  assert.deepEqual(evidenceOf(one("dead_axis", "X of In_Imu0Accel kept one value"), seconds, []).curves.map(({ name }) => name), ["y", "z"]);
  assert.deepEqual([evidenceOf(one("stamps_in_ms"), seconds, []), evidenceOf(one("gyro_sign"), undefined, [])], [null, null]);
});
