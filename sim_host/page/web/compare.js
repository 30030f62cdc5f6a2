// SPDX-License-Identifier: Apache-2.0
// Every estimator on one log: which robots' estimators can take it, and the figures of each run.
import { at } from "./run.js";
import { mapAt } from "./earth.js";

const LOG_2PI = Math.log(2 * Math.PI);

/** Robots whose estimators are to be tried: one of each list of estimators, the log's own first; none that takes nothing of the log. */
export function contestants(robots, own, inputs) {
  const there = new Set(inputs.map(({ sensor }) => sensor)), seen = new Set(), found = [];
  for (const number of [own, ...robots.keys()]) {
    const { estimators, takes, needs_imu: needsImu } = robots[number];
    const key = `${estimators.map(({ kind, bytes }) => `${kind}${bytes}`).join()} ${takes.filter((one) => there.has(one)).join()}`;
    if (seen.has(key) || !takes.some((one) => there.has(one)) || (needsImu && !there.has("Imu"))) continue;
    seen.add(key);
    found.push(number);
  }
  return found;
}

/** One estimator's rows of a run: {t, x, y, valid, sx, sy, rho} with the last published sigma held. */
function track(tables, number) {
  const table = tables.estimates, of = table.values("estimator"), names = ["time_s", "x_m", "y_m", "pos_valid", "std_x_m", "std_y_m", "corr_xy"].map((name) => table.values(name));
  const out = { t: [], x: [], y: [], sx: [], sy: [], rho: [] };
  let held = null;
  for (let row = 0; row < table.rows; row++) {
    if (of[row] !== number) continue;
    const [t, x, y, valid, sx, sy, rho] = names.map((values) => values[row]);
    if (!Number.isNaN(sx)) held = [sx, sy, Number.isNaN(rho) ? 0 : rho];
    if (!(valid > 0) || !held) continue;
    out.t.push(t), out.x.push(x), out.y.push(y), out.sx.push(held[0]), out.sy.push(held[1]), out.rho.push(held[2]);
  }
  return out;
}

/** d' C^-1 d and log det C of a 2 x 2 covariance. */
function quadratic(dx, dy, a, b, c) {
  const det = a * c - b * b;
  return [(c * dx * dx - 2 * b * dx * dy + a * dy * dy) / det, Math.log(det)];
}

/** With truth: RMS of the position and the mean NEES of its two components. */
export function withTruth(one, truth) {
  let square = 0, nees = 0, count = 0;
  for (let i = 0; i < one.t.length; i += 10) {
    const k = at(truth.t, one.t[i]);
    if (Math.abs(truth.t[k] - one.t[i]) > 0.006 || Number.isNaN(truth.x[k])) continue;
    const dx = one.x[i] - truth.x[k], dy = one.y[i] - truth.y[k], b = one.rho[i] * one.sx[i] * one.sy[i];
    square += dx * dx + dy * dy;
    nees += quadratic(dx, dy, one.sx[i] ** 2, b, one.sy[i] ** 2)[0];
    count++;
  }
  return count === 0 ? null : { rms_m: Math.sqrt(square / count), nees: nees / count, count };
}

/** Without truth: each fix against the estimate of its moment, which cannot have it yet. Mean log likelihood and NIS a fix. */
export function byFixes(one, fixes, origin) {
  const stamp = fixes.values("stamp_s"), [lat, lon, height, std] = ["lat_deg", "lon_deg", "height_m", "std_m"].map((name) => fixes.values(name));
  if (!origin || one.t.length === 0) return null;
  const local = mapAt(origin);
  let likelihood = 0, nis = 0, square = 0, count = 0;
  for (let row = 0; row < fixes.rows; row++) {
    const i = at(one.t, stamp[row] - 1e-4);
    if (one.t[i] > stamp[row] || stamp[row] - one.t[i] > 0.05 || !(std[row] > 0)) continue;
    const [x, y] = local([lat[row], lon[row], Number.isNaN(height[row]) ? origin[2] : height[row]]), dx = x - one.x[i], dy = y - one.y[i], r = std[row] ** 2;
    const [q, logDet] = quadratic(dx, dy, one.sx[i] ** 2 + r, one.rho[i] * one.sx[i] * one.sy[i], one.sy[i] ** 2 + r);
    likelihood -= 0.5 * (q + logDet + 2 * LOG_2PI), nis += q, square += dx * dx + dy * dy, count++;
  }
  return count === 0 ? null : { likelihood: likelihood / count, nis: nis / count, rms_m: Math.sqrt(square / count), count };
}

/** Mean ratio of NIS to degrees of what the node itself published, and the share that it refused. */
function byRecords(tables, number) {
  const table = tables.innovations, of = table.values("estimator"), nis = table.values("nis"), dof = table.values("dof");
  let sum = 0, count = 0, refused = 0;
  for (let row = 0; row < table.rows; row++) {
    if (of[row] !== number || !(dof[row] > 0) || Number.isNaN(nis[row])) continue;
    const verdict = table.word("verdict", row);
    if (verdict === "Accepted") sum += nis[row] / dof[row], count++;
    else if (verdict === "Rejected") refused++;
  }
  return count === 0 ? null : { nis: sum / count, refused: refused / (count + refused), count: count + refused };
}

/** A line for each estimator of a run that gives a position. `costs` {kind: instructions}; `robot` of the description. */
export function lines({ result, tables }, robot, truth, costs) {
  return robot.estimators.flatMap(({ kind, bytes }, number) => {
    const one = track(tables, number);
    if (one.t.length === 0) return [];
    return [{ robot: robot.name, kind, number, bytes, instructions: costs[kind] ?? null, epochs: one.t.length, truth: truth && withTruth(one, truth), fixes: byFixes(one, tables.fixes, result.origin),
      records: byRecords(tables, number), sha: result.estimates_sha256 }];
  });
}

/** One line for those of one kind and size whose figures read the same, with the names of their `robots`: they share an estimator. */
export function distinct(all) {
  const found = new Map();
  for (const one of all) {
    const { kind, bytes, truth, fixes, records } = one, key = JSON.stringify([kind, bytes, truth, fixes, records], (_, x) => (typeof x === "number" ? +x.toPrecision(4) : x));
    if (found.has(key)) found.get(key).robots.push(one.robot);
    else found.set(key, { ...one, robots: [one.robot] });
  }
  return [...found.values()];
}

/** The best first: by the error where there is truth, else by the likelihood of the fixes, else by the share refused. */
export function ranked(all) {
  const key = ({ truth, fixes, records }) => truth?.rms_m ?? (fixes ? -fixes.likelihood : records ? records.refused : Infinity);
  return [...all].sort((a, b) => key(a) - key(b));
}
