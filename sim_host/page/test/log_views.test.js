// SPDX-License-Identifier: Apache-2.0
// What the page says of findings, verdicts and ratios, and what its charts show of their values.
import { test } from "node:test";
import assert from "node:assert/strict";
import { followable, verdictOf } from "../web/log_views.js";
import { errorsOf, shownRange } from "../web/charts.js";
import { Run, times } from "../web/run.js";

test("a factor that is rounded to nothing gives way to the code's own advice", () => {
  const codes = [{ name: "wheel_scale", change: "Correct the radii." }], one = { code: "wheel_scale", cause: "c", evidence: "The robot drives 0.00 times as fast.", change: "Multiply the radii by 0.000." };
  assert.deepEqual(followable(one, codes), { code: "wheel_scale", cause: "c", evidence: "", change: "Correct the radii.", remedies: [] });
  const good = { ...one, evidence: "The robot drives 1.05 times as fast.", change: "Multiply the radii by 1.050 or divide." };
  assert.deepEqual(followable(good, codes), { ...good, remedies: [] });
  assert.equal(followable({ ...good, change: "Move it by 0.005 m." }, codes).change, "Move it by 0.005 m.");
});

test("a ratio at the ceiling of its frame is at least that", () => {
  assert.deepEqual([times(40.92), times(40.9), times(1.25, 2)], ["≥ 40.9", "40.9", "1.25"]);
});

test("a refusal has one reason", () => {
  assert.equal(verdictOf({ verdict: "Stale", failed: "Time" }), "refused");
  assert.equal(verdictOf({ verdict: "Stale", failed: "None" }), "refused: the sensor repeats itself");
  assert.equal(verdictOf({ verdict: "TooLate", failed: "Time" }), "too late for the window of the fusion");
});

test("a chart shows all of its values, but for a few that would make a hairline of the others", () => {
  const calm = Array.from({ length: 1000 }, (_, i) => Math.sin(i / 9));
  const [low, high] = shownRange(calm);
  assert.ok(low < -0.999 && low > -1.3 && high > 0.999 && high < 1.3);
  const [under, over] = shownRange([100, -100, null, ...calm]);
  assert.ok(under < -0.99 && under > -1.3 && over > 0.99 && over < 1.3);
  const excursion = shownRange([...calm, ...Array.from({ length: 30 }, () => 21)]);
  assert.ok(excursion[1] > 21, "3 % of the time is no few");
  assert.deepEqual(shownRange([]), [-1, 1]);
  for (const values of [[1e20, 1e20 + 16384], [1e300, -1e300], [3, 3 + 5e-16], [5e-324, 0]]) {
    const [least, most] = shownRange(values); // a chart divides it: a step has to change the sum
    assert.ok(Number.isFinite(most - least) && least + (most - least) / 1e4 > least, values);
  }
  const still = shownRange([5, 5, 5]);
  assert.ok(still[0] < 5 && still[1] > 5);
});

test("errors are against the truth of the same epoch, in their band, with no jump at pi", () => {
  const run = { t: [1, 1.01, 1.02, 1.03], columns: { x_m: [1, 2, 3, 4], std_x_m: [0.1, 0.2, NaN, 0.4], yaw_rad: [3.1, 3.1, 3.1, 3.1], std_yaw_rad: [0.1, 0.1, 0.1, 0.1], pos_valid: [1, 1, 1, 0] } };
  const truth = { t: [1.01, 1.02, 1.03], x: [1.5, 3, 3], yaw: [-3.1, -3.1, -3.1] };
  const [t, error, band] = errorsOf(run, truth, "x_m");
  assert.deepEqual([t, error], [[1.01], [0.5]]);
  assert.ok(Math.abs(band[0] - 0.6) < 1e-12);
  for (const one of errorsOf(run, truth, "yaw_rad")[1]) assert.ok(Math.abs(one - (6.2 - 2 * Math.PI)) < 1e-9);
  assert.deepEqual([errorsOf(run, truth, "height_m"), errorsOf(run, null, "x_m")], [null, null]);
});

test("a source is named where more than outliers of it are refused, the worst first", () => {
  const of = (refused, all) => Array.from({ length: all }, (_, i) => ({ refused: i < refused }));
  const named = (...sources) => Run.prototype.mostlyRefused.call({ sources: new Map(sources) });
  // 88 of 767 landmarks are refused in a good log of the Husky, 1345 of 1500 magnetic headings where the IMU is turned by 90 deg.
  assert.deepEqual(named(["RangeBearing", of(88, 767)], ["GnssVelocity", of(7, 12)], ["GnssPosition", of(0, 0)]), []);
  assert.deepEqual(named(["GnssPosition", of(40, 100)], ["Magnetometer", of(1345, 1500)]), [{ source: "Magnetometer", refused: 1345, all: 1500 }, { source: "GnssPosition", refused: 40, all: 100 }]);
});
