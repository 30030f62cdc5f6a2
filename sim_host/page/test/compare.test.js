// SPDX-License-Identifier: Apache-2.0
// Figures of every estimator: on tracks whose errors are drawn from their own covariance the laws hold.
import { test } from "node:test";
import assert from "node:assert/strict";
import { Table } from "../web/columns.js";
import { mapAt } from "../web/earth.js";
import { contestants, distinct, lines, ranked, withTruth } from "../web/compare.js";
import { gaussian } from "../web/lesson.js";

const HEADS = { estimates: "time_s,estimator,x_m,y_m,std_x_m,std_y_m,corr_xy,pos_valid", innovations: "estimator,nis,dof,verdict", fixes: "stamp_s,lat_deg,lon_deg,height_m,std_m" };
function tables(rows) {
  return Object.fromEntries(Object.entries(HEADS).map(([name, head]) => {
    const table = new Table();
    table.add(new TextEncoder().encode([head, ...rows[name].map((row) => row.join(",")), ""].join("\n")));
    return [name, table];
  }));
}
const ORIGIN = [48, 11, 500];

/** A robot at rest whose estimate errs by `sigma`, which it states as `said`; fixes err by 2 m. */
function run(sigma, said, seed) {
  const draw = gaussian(seed), estimates = [], fixes = [], truth = { t: [], x: [], y: [] }, degree = 1 / 111e3, local = mapAt(ORIGIN);
  const [[ex], [, ny]] = [local([48, 11 + degree, 500]), local([48 + degree, 11, 500])];
  for (let i = 0; i < 4000; i++) {
    const t = 1 + i / 10;
    truth.t.push(t), truth.x.push(3), truth.y.push(-4);
    // Correlated: y has 0.6 of x's error.
    const a = draw(), b = draw();
    estimates.push([t.toFixed(3), 0, (3 + sigma * a).toFixed(6), (-4 + sigma * (0.6 * a + 0.8 * b)).toFixed(6), said.toFixed(4), said.toFixed(4), 0.6, 1]);
    fixes.push([(t + 0.001).toFixed(3), (48 + ((-4 + 2 * draw()) / ny) * degree).toFixed(9), (11 + ((3 + 2 * draw()) / ex) * degree).toFixed(9), 500, 2]);
  }
  const innovations = Array.from({ length: 500 }, (_, i) => [0, 3, 3, i % 10 === 0 ? "Rejected" : "Accepted"]);
  return lines({ result: { origin: ORIGIN, estimates_sha256: "" }, tables: tables({ estimates, innovations, fixes }) }, { name: "r", estimators: [{ kind: "Ekf", bytes: 100 }] }, truth, { Ekf: 42 })[0];
}

test("NEES is 2, NIS is 2, and the likelihood is that of the normal distribution", () => {
  const right = run(0.5, 0.5, 3), bold = run(0.5, 0.25, 3), shy = run(0.5, 2, 3);
  assert.ok(Math.abs(right.truth.nees - 2) < 0.3, String(right.truth.nees)); // 400 of 2 degrees: 0.1 is one sigma
  assert.ok(Math.abs(right.truth.rms_m - 0.5 * Math.SQRT2) < 0.04);
  assert.ok(Math.abs(bold.truth.nees - 8) < 1.2 && shy.truth.nees < 0.3);
  assert.ok(Math.abs(right.fixes.nis - 2) < 0.15, String(right.fixes.nis));
  const det = 4.25 ** 2 - 0.15 ** 2, expected = -1 - 0.5 * Math.log(det) - Math.log(2 * Math.PI);
  assert.ok(Math.abs(right.fixes.likelihood - expected) < 0.08, `${right.fixes.likelihood} ${expected}`);
  assert.ok(shy.fixes.likelihood < right.fixes.likelihood);
  assert.deepEqual([right.records.nis, right.records.refused, right.instructions, right.bytes], [1, 0.1, 42, 100]);
});

test("errors that their correlation explains weigh less", () => {
  const one = { t: [1], x: [1], y: [1], sx: [1], sy: [1], rho: [0.6] }, truth = { t: [1], x: [0], y: [0] };
  assert.ok(Math.abs(withTruth(one, truth).nees - 2 / 1.6) < 1e-12);
  assert.ok(Math.abs(withTruth({ ...one, y: [-1] }, truth).nees - 2 / 0.4) < 1e-12);
});

test("each list of estimators runs once, the log's own first, and none that has nothing to go on", () => {
  const robot = (kinds, takes, needsImu = false) => ({ estimators: kinds.map((kind) => ({ kind, bytes: 8 })), takes, needs_imu: needsImu });
  const robots = [robot(["Ekf"], ["BodySpeed", "RangeBearing"]), robot(["Inertial"], ["Imu", "GnssPosition"], true), robot(["Ekf"], ["BodySpeed", "RangeBearing"]), robot(["Ukf"], ["BodySpeed"])];
  assert.deepEqual(contestants(robots, 2, [{ sensor: "BodySpeed" }]), [2, 3]);
  assert.deepEqual(contestants(robots, 1, [{ sensor: "Imu" }, { sensor: "BodySpeed" }]), [1, 0, 3]);
});

test("robots that share an estimator have one line of it", () => {
  const one = { robot: "a", kind: "Odometry", bytes: 8, truth: { rms_m: 1 }, fixes: null, records: null };
  assert.deepEqual(distinct([one, { ...one, robot: "b" }, { ...one, truth: { rms_m: 2 } }, { ...one, bytes: 9 }]).map(({ robots, bytes, truth }) => [robots.join(), bytes, truth.rms_m]), [["a,b", 8, 1], ["a", 8, 2], ["a", 9, 1]]);
  assert.equal(distinct([one, { ...one, robot: "b", truth: { rms_m: 1.00001 } }]).length, 1, "what reads the same is the same");
});

test("the best is first", () => {
  const one = (rms, likelihood) => ({ truth: rms === null ? null : { rms_m: rms }, fixes: { likelihood } });
  assert.deepEqual(ranked([one(2, 0), one(1, -9)]).map(({ truth }) => truth.rms_m), [1, 2]);
  assert.deepEqual(ranked([one(null, -3), one(null, -2)]).map(({ fixes }) => fixes.likelihood), [-2, -3]);
});
