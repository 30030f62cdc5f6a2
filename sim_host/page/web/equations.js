// SPDX-License-Identifier: Apache-2.0
// One update by the textbook's equations, in double, beside what the flashed filter made of it in float.
//   S = H P- H' + R,  K = P- H' S^-1,  dx = K nu,  P+ = P- - K S K'  (Bar-Shalom, Li, Kirubarajan 2001, sec. 5.2.3)

const entry = (m, columns, r, c) => m[r * columns + c];

/** a (n x k) times b (k x m), row by row. */
function product(a, b, n, k, m) {
  const out = new Float64Array(n * m);
  for (let r = 0; r < n; r++) for (let c = 0; c < m; c++) {
    let sum = 0;
    for (let i = 0; i < k; i++) sum += a[r * k + i] * b[i * m + c];
    out[r * m + c] = sum;
  }
  return out;
}
function transposed(a, n, m) {
  const out = new Float64Array(n * m);
  for (let r = 0; r < n; r++) for (let c = 0; c < m; c++) out[c * n + r] = a[r * m + c];
  return out;
}
/** By elimination with the largest pivot of a column; null where there is none. */
function inverse(a, n) {
  const m = Array.from({ length: n }, (_, r) => [...a.slice(r * n, r * n + n), ...Array.from({ length: n }, (_, c) => (c === r ? 1 : 0))]);
  for (let c = 0; c < n; c++) {
    let best = c;
    for (let r = c + 1; r < n; r++) if (Math.abs(m[r][c]) > Math.abs(m[best][c])) best = r;
    if (!(Math.abs(m[best][c]) > 0)) return null;
    [m[c], m[best]] = [m[best], m[c]];
    const pivot = m[c][c];
    m[c] = m[c].map((x) => x / pivot);
    for (let r = 0; r < n; r++) if (r !== c && m[r][c] !== 0) {
      const by = m[r][c];
      m[r] = m[r].map((x, i) => x - by * m[c][i]);
    }
  }
  return Float64Array.from(m.flatMap((row) => row.slice(n)));
}

/** {s, k, dx, posterior, nis} of an update as the module shows it; null where S has no inverse. */
export function byTheBook({ states: n, components: m, prior, h, noise, nu }) {
  const ph = product(prior, transposed(h, m, n), n, n, m), s = product(h, ph, m, n, m);
  for (let i = 0; i < m; i++) s[i * m + i] += noise[i];
  const inverted = inverse(s, m);
  if (!inverted) return null;
  const k = product(ph, inverted, n, m, m), dx = product(k, nu, n, m, 1);
  const taken = product(product(k, s, n, m, m), transposed(k, n, m), n, m, n);
  const posterior = Float64Array.from(prior, (value, i) => value - taken[i]);
  return { s, k, dx, posterior, nis: product(product(nu, inverted, 1, m, m), nu, 1, m, 1)[0] };
}

/** Largest difference of P+ to the book's, in shares of the sigmas that it lies between; and of the correction in sigmas. */
export function apart(update, book) {
  const { states: n, prior, posterior, moved } = update;
  let p = 0, x = 0;
  for (let r = 0; r < n; r++) {
    const sigma = Math.sqrt(entry(prior, n, r, r));
    if (sigma > 0) x = Math.max(x, Math.abs(moved[r] - book.dx[r]) / sigma);
    for (let c = 0; c < n; c++) {
      const scale = sigma * Math.sqrt(entry(prior, n, c, c));
      if (scale > 0) p = Math.max(p, Math.abs(entry(posterior, n, r, c) - entry(book.posterior, n, r, c)) / scale);
    }
  }
  return { p, x };
}

/** Models of measurements by the sensor whose sample becomes one. */
const MODELS = { GnssPosition: ["GnssFix3d", "GnssPosition", "GnssCourse"], GnssVelocity: ["GnssVelocity3d"], GnssHeight: ["Height", "GnssFix3d"], Barometer: ["Height"],
  Magnetometer: ["MagneticHeading"], Heading: ["DualHeading"], RangeBearing: ["RangeBearing", "Range", "Bearing", "TargetPosition", "Radar", "TargetBearing", "TargetRange"],
  WheelCounts: ["WheelSpeed", "BodyVelocity", "ZeroVelocity", "WheelSpeedFlat"], WheelSpeed: ["WheelSpeed", "BodyVelocity", "ZeroVelocity"], BodySpeed: ["BodyVelocity", "ZeroVelocity", "WheelSpeed"] };

/**
 * The update that a record of an innovation is of: the last one of its sensor before the record went out, that of the same NIS where there is one.
 * Null where none is: a test had refused the measurement before the filter saw it.
 */
export function updateOf(updates, { source, verdict, dof, nis, time }) {
  const of = updates.filter((one) => (MODELS[source] ?? []).includes(one.model) && one.after_s < time + 1e-6);
  const same = of.filter((one) => one.components === dof && Math.abs(one.nis - nis) <= 0.051 && one.verdict === verdict);
  return same.at(-1) ?? (verdict === "Accepted" ? of.filter((one) => one.verdict === verdict).at(-1) ?? null : null);
}

const INS = ["east", "north", "up", "v_east", "v_north", "v_up", "tilt_east", "tilt_north", "heading", "ba_x", "ba_y", "ba_z", "bg_x", "bg_y", "bg_z"];
const NAMES = { 2: ["position", "speed"], 3: ["east", "north", "heading"], 4: ["x", "v_x", "y", "v_y"], 15: INS };
/** Keys of the states' names, without "axis."; null for a filter of another size. */
export const stateNames = (n) => NAMES[n] ?? null;
/** Places of east and north among the states, for an ellipse; null where there are none. */
export const plane = (n) => (n === 4 ? [0, 2] : n >= 3 ? [0, 1] : null);

/** Half axes and angle of the ellipse of k sigma of two states. */
export function ellipse(p, n, [i, j], sigmas = 3) {
  const a = entry(p, n, i, i), b = entry(p, n, i, j), c = entry(p, n, j, j), middle = (a + c) / 2, spread = Math.hypot((a - c) / 2, b);
  return { long: sigmas * Math.sqrt(middle + spread), short: sigmas * Math.sqrt(Math.max(0, middle - spread)), angle: 0.5 * Math.atan2(2 * b, a - c) };
}
