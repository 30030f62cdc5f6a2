// SPDX-License-Identifier: Apache-2.0
// The lesson's laws, by a filter of these lines in double: right answers pass, and wrong ones do not.
import { test } from "node:test";
import assert from "node:assert/strict";
import { byTheBook } from "../web/equations.js";
import { TEXTS } from "../web/texts.js";
import { GRID, HIDDEN, LESSON, band, drive, figures, gaussian, gradeBraking, gradeNoise, gradePrediction } from "../web/lesson.js";

/** Position and speed, F = (1 dt; 0 1), Q = q I: updates as the module gives them. */
function textbook({ dt_s: dt, p0, q, r_m2: r }, steps) {
  let x = [0, 0], p = [p0, 0, 0, p0];
  return steps.map(({ z }) => {
    const at = [x[0] + dt * x[1], x[1]], prior = [p[0] + dt * (p[1] + p[2]) + dt * dt * p[3] + q, p[1] + dt * p[3], p[2] + dt * p[3], p[3] + q];
    const update = { states: 2, components: 1, at, prior, h: [1, 0], noise: [r], nu: [z - at[0]] }, { dx, posterior, nis, s } = byTheBook(update);
    [x, p] = [[at[0] + dx[0], at[1] + dx[1]], posterior];
    return { ...update, moved: dx, posterior, nis, s };
  });
}
const base = { dt_s: LESSON.dt_s, p0: LESSON.p0, q: LESSON.q, r_m2: LESSON.r_m2 };

test("the worked example: 10.101, 10.601, (0.953, 0.094)", () => {
  const [first] = textbook(base, [{ z: 1 }]);
  assert.deepEqual([first.prior[0], first.s[0], first.prior[0] / first.s[0], first.prior[2] / first.s[0]].map((x) => x.toFixed(3)), ["10.101", "10.601", "0.953", "0.094"]);
  for (const right of [10.101, 10.1013]) assert.ok(gradePrediction(right, first).right);
  for (const wrong of [10.001, 10.1, 10, 10.11, 10.601]) assert.ok(!gradePrediction(wrong, first).right, String(wrong));
});

test("the asked prediction is 4.041, and stands nowhere in the lesson", () => {
  const [asked] = textbook({ ...base, ...HIDDEN.prediction }, [{ z: 1 }]), [shown] = textbook(base, [{ z: 1 }]);
  assert.equal(asked.prior[0].toFixed(3), "4.041");
  assert.ok(gradePrediction(4.041, asked).right && !gradePrediction(shown.prior[0], asked).right);
  for (const texts of Object.values(TEXTS)) for (const [key, text] of Object.entries(texts)) assert.ok(!/4[.,]04/.test(text), key);
});

test("the noise of the hidden sensor passes, and others do not", () => {
  const steps = drive(HIDDEN.noise), grade = (r) => gradeNoise(figures(steps, textbook({ ...base, r_m2: r }, steps))).right;
  for (const r of [1.9, 2, 2.1]) assert.ok(grade(r), String(r));
  for (const r of [0.1, 0.5, 1, 1.4, 3, 4, 20]) assert.ok(!grade(r), String(r));
});

test("a Q passes that follows the braking cart and still smooths", () => {
  const steps = drive(HIDDEN.brake), of = (q) => figures(steps, textbook({ ...base, q }, steps)), best = Math.min(...GRID.map((q) => of(q).rms_m));
  const passes = GRID.filter((q) => gradeBraking(of(q), best).right);
  assert.deepEqual(passes, [0.01, 0.03, 0.1]);
  assert.ok(!gradeBraking({ inside: 0.95, rms_m: 1 }, 1).right && gradeBraking({ inside: 0.98, rms_m: 1 }, 1).right);
});

test("the filter fails with the braking cart as the text says, and is as sure as before", () => {
  const calm = drive({ seed: LESSON.seed, sigma_m: Math.sqrt(LESSON.r_m2) }), braking = drive({ seed: LESSON.seed, sigma_m: Math.sqrt(LESSON.r_m2), brakes: true });
  const [right, wrong] = [calm, braking].map((steps) => [figures(steps, textbook(base, steps)), textbook(base, steps).at(-1).posterior]);
  assert.deepEqual([...right[1]], [...wrong[1]]);
  const [low, high] = band(LESSON.steps);
  assert.ok(right[0].inside > 0.97 && right[0].nis > low && right[0].nis < high, JSON.stringify(right[0]));
  assert.ok(wrong[0].inside < 0.9 && wrong[0].nis > high, JSON.stringify(wrong[0]));
});

test("band() has the quantiles of tables: 162.728 and 241.058 of 200 degrees", () => {
  // Abramowitz & Stegun, table 26.8, by its own formula 26.4.17 beyond 100 degrees; R's qchisq gives the digits.
  const [low, high] = band(200);
  assert.ok(Math.abs(200 * low - 162.728) < 0.05 && Math.abs(200 * high - 241.058) < 0.05);
});

test("drawn numbers are normal", () => {
  const draw = gaussian(5), n = 40000, all = Array.from({ length: n }, draw), mean = all.reduce((a, b) => a + b) / n, square = all.reduce((a, b) => a + b * b, 0) / n;
  assert.ok(Math.abs(mean) < 0.02 && Math.abs(square - 1) < 0.03);
});

test("the text on the failure has the figures of the chart", () => {
  const steps = drive({ seed: LESSON.seed, sigma_m: Math.sqrt(LESSON.r_m2), brakes: true }), run = textbook(base, steps), x = run.map(({ at, moved }) => at[0] + moved[0]), apart = x.map((v, i) => Math.abs(v - steps[i].x));
  const turn = (all) => steps[all.indexOf(Math.max(...all))].t, out = steps.filter((_, i) => i > 50 && apart[i] > 3 * Math.sqrt(run[i].posterior[0]));
  const said = { turn: turn(steps.map((one) => one.x)).toFixed(1), later: (turn(x) - turn(steps.map((one) => one.x))).toFixed(1), off: Math.max(...apart.slice(50)).toFixed(1), until: out.at(-1).t.toFixed(1) };
  assert.deepEqual(said, { turn: "10.6", later: "0.6", off: "1.8", until: "15.3" });
  for (const text of [TEXTS.en, TEXTS.id]) for (const figure of Object.values(said)) assert.ok(text["lesson.fail.note"].replaceAll(",", ".").includes(figure), figure);
});
