// SPDX-License-Identifier: Apache-2.0
// The lesson "the Kalman filter in one dimension": a cart on a rail, and what is right about an answer. Numbers of the filter come from the module.

export const LESSON = { dt_s: 0.1, p0: 10, q: 0.001, r_m2: 0.5, steps: 200, seed: 7 };
/** What the questions are about; nothing of it is shown before the answer. */
export const HIDDEN = { prediction: { p0: 4 }, noise: { seed: 24, sigma_m: Math.sqrt(2) }, brake: { seed: 42, sigma_m: Math.sqrt(0.5), brakes: true } };
export const GRID = [1e-6, 1e-5, 1e-4, 1e-3, 3e-3, 0.01, 0.03, 0.1, 0.3, 1, 10];

/** Numbers of a normal distribution: the same ones for a seed. */
export function gaussian(seed) {
  let state = seed >>> 0;
  const uniform = () => {
    state = (state + 0x6d2b79f5) >>> 0; // mulberry32
    let t = Math.imul(state ^ (state >>> 15), state | 1);
    t = (t + Math.imul(t ^ (t >>> 7), t | 61)) ^ t;
    return (((t ^ (t >>> 14)) >>> 0) + 0.5) / 4294967296;
  };
  return () => Math.sqrt(-2 * Math.log(uniform())) * Math.cos(2 * Math.PI * uniform());
}

/** A cart at 2 m/s that may brake and go back half way; positions are measured. [{t, x, v, z}] */
export function drive({ seed, sigma_m, brakes = false }) {
  const draw = gaussian(seed), steps = [];
  let x = 0, v = 2;
  for (let k = 1; k <= LESSON.steps; k++) {
    if (brakes && k > LESSON.steps / 2) v = Math.max(-1, v - 3 * LESSON.dt_s);
    x += v * LESSON.dt_s;
    steps.push({ t: k * LESSON.dt_s, x, v, z: x + sigma_m * draw() });
  }
  return steps;
}

/** Middle 95 % of the mean of n values of chi-square with `degrees` each (Wilson, Hilferty 1931). */
export function band(n, degrees = 1) {
  const all = n * degrees, at = (z) => (degrees * (1 - 2 / (9 * all) + z * Math.sqrt(2 / (9 * all))) ** 3);
  return [at(-1.96), at(1.96)];
}

/** Figures of a run: mean NIS, mean NEES, RMS of the position, share within 3 sigma. */
export function figures(steps, updates) {
  let nis = 0, nees = 0, square = 0, inside = 0;
  steps.forEach(({ x, v }, k) => {
    const { at, moved, posterior: p, nis: one } = updates[k], dx = at[0] + moved[0] - x, dv = at[1] + moved[1] - v;
    nis += one, square += dx * dx, inside += Math.abs(dx) <= 3 * Math.sqrt(p[0]) ? 1 : 0;
    nees += (p[3] * dx * dx - 2 * p[1] * dx * dv + p[0] * dv * dv) / (p[0] * p[3] - p[1] * p[1]);
  });
  const n = steps.length;
  return { nis: nis / n, nees: nees / n, rms_m: Math.sqrt(square / n), inside: inside / n };
}

/** The first prediction's variance, by number: {right, wanted}. `first` is the module's first update. */
export function gradePrediction(answer, first) {
  const wanted = first.prior[0];
  return { right: Math.abs(answer - wanted) < 0.0005, wanted };
}
/** R of a sensor that nobody has a data sheet of: the mean NIS lies where chi-square puts it. */
export function gradeNoise({ nis }) {
  const [low, high] = band(LESSON.steps);
  return { right: nis >= low && nis <= high, low, high, nis };
}
/** Q for a cart that brakes: the error stays within 3 sigma, and no other Q of the grid would be a quarter better. */
export function gradeBraking({ inside, rms_m }, best_m) {
  return { right: inside >= 0.97 && rms_m <= 1.25 * best_m, inside, rms_m, best_m };
}
