// SPDX-License-Identifier: Apache-2.0
// A replay as the pictures want it: the main estimator's path and states, innovations by source, modes, refusals.
import { Table } from "./columns.js";
import { mapAt } from "./earth.js";
import { NO_REFUSAL } from "./thinning.js";

/** Rows of a table for which `keep(row)` holds. */
function rowsOf(table, keep) {
  const rows = [];
  for (let row = 0; row < table.rows; row++) if (keep(row)) rows.push(row);
  return rows;
}
const pick = (values, rows) => Float64Array.from(rows, (row) => values[row]);

/** Last index with sorted[index] <= value, at least 0. */
export function at(sorted, value) {
  let low = 0, high = sorted.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (sorted[middle] <= value) low = middle + 1;
    else high = middle;
  }
  return Math.max(0, low - 1);
}

/** Spans of time with one word: [{begin, end, word}]. */
function spans(times, words, end) {
  const found = [];
  times.forEach((time, i) => {
    const last = found.at(-1);
    if (last?.word === words[i]) return void (last.end = time);
    if (last) last.end = time;
    found.push({ begin: time, end: time, word: words[i] });
  });
  if (found.length > 0) found.at(-1).end = Math.max(end, found.at(-1).end);
  return found;
}

/** Refusals of a source from which they are a sign of a mistake: so many, and more than this share. */
const LEAST_REFUSED = 20, MOST_REFUSED = 0.25;
/** A node sends one landmark of at most 254 each 0.1 s. */
const ROUND_S = 30;
/** Largest ratio that a frame of Est_Innov can say. */
const MOST_RATIO = 40.92;
/** A ratio in words: at the ceiling of its frame it may be anything above. */
export const times = (ratio, digits = 1) => (ratio >= MOST_RATIO - 0.005 ? "≥ 40.9" : ratio.toFixed(digits));

export class Run {
  constructor({ result, tables }) {
    this.result = result;
    this.tables = Object.fromEntries(Object.entries(tables).map(([name, table]) => [name, table instanceof Table ? table : Table.unpacked(table)]));
    this.every = Math.max(1, ...Object.values(tables).map(({ every }) => every ?? 1)); // of a long log
    this.chooseEstimator();
    this.span = this.t.length > 0 ? [this.t[0], this.t.at(-1)] : [0, 1];
    this.readInnovations();
    this.readFixes();
    this.readModes();
  }

  /** The last estimator of those with the most rows: a node's main one. */
  chooseEstimator() {
    const table = this.tables.estimates, numbers = table.values("estimator"), counts = new Map();
    for (const number of numbers) counts.set(number, (counts.get(number) ?? 0) + 1);
    const most = Math.max(0, ...counts.values());
    this.estimator = Math.max(-1, ...[...counts].filter(([, count]) => count === most).map(([number]) => number));
    const rows = rowsOf(table, (row) => numbers[row] === this.estimator);
    this.kind = rows.length > 0 ? table.word("kind", rows[0]) : "";
    this.t = pick(table.values("time_s"), rows);
    this.columns = {};
    for (const { name } of table.columns.slice(4)) this.columns[name] = pick(table.values(name), rows);
    this.x = this.columns.x_m ?? new Float64Array(0);
    this.y = this.columns.y_m ?? new Float64Array(0);
  }

  /** [times, values] of a column where it is known: of the estimates, else of the states. */
  series(name) {
    const known = this.columns[name];
    if (known) return filtered(this.t, known, () => true);
    const table = this.tables.states, numbers = table.values("estimator");
    return filtered(table.values("time_s"), table.values(name), (row) => numbers[row] === this.estimator);
  }

  readInnovations() {
    const table = this.tables.innovations, estimator = table.values("estimator"), time = table.values("time_s");
    const ratio = table.values("ratio"), age = table.values("age_ms"), dof = table.values("dof"), nis = table.values("nis");
    this.sources = new Map();
    this.refusals = [];
    for (let row = 0; row < table.rows; row++) {
      if (estimator[row] !== this.estimator) continue;
      const source = table.word("sensor", row), verdict = table.word("verdict", row);
      const one = { time: time[row], stamp: time[row] - age[row] / 1000, ratio: ratio[row], dof: dof[row], nis: nis[row], source, verdict, failed: table.word("failed", row) };
      one.refused = !NO_REFUSAL.has(verdict);
      if (!this.sources.has(source)) this.sources.set(source, []);
      this.sources.get(source).push(one);
      if (one.refused) this.refusals.push(one);
    }
  }

  /** Fixes in the axes of the map, each with its innovation where one was published. */
  readFixes() {
    const { origin } = this.result, table = this.tables.fixes;
    this.fixes = [];
    if (!origin) return;
    const local = mapAt(origin), [stamp, latitude, longitude, height, sigma] = ["stamp_s", "lat_deg", "lon_deg", "height_m", "std_m"].map((name) => table.values(name));
    // The age is in whole milliseconds.
    const known = new Map((this.sources.get("GnssPosition") ?? []).map((one) => [Math.round(one.stamp * 100), one]));
    for (let row = 0; row < table.rows; row++) {
      const [x, y] = local([latitude[row], longitude[row], Number.isNaN(height[row]) ? origin[2] : height[row]]);
      const key = Math.round(stamp[row] * 100);
      this.fixes.push({ x, y, sigma: sigma[row], stamp: stamp[row], innovation: known.get(key) ?? known.get(key - 1) ?? known.get(key + 1) ?? null });
    }
  }

  readModes() {
    const status = this.tables.status, time = Array.from(status.values("time_s")), end = this.span[1];
    this.modes = spans(time, time.map((_, row) => status.word("mode", row)), end);
    const table = this.tables.sources, estimator = table.values("estimator"), times = table.values("time_s");
    const by = new Map();
    for (let row = 0; row < table.rows; row++) {
      if (estimator[row] !== this.estimator) continue;
      const source = table.word("source", row);
      if (!by.has(source)) by.set(source, [[], []]);
      by.get(source)[0].push(times[row]);
      by.get(source)[1].push(table.word("state", row));
    }
    this.states = new Map([...by].map(([source, [t, words]]) => [source, spans(t, words, end)]));
  }

  /** The node's map at a moment: {landmarks: [{x, y, sx, sy, correlation}], keyframes: [{x, y}]}, each as it was sent last. */
  mapAt(time) {
    const { map, keyframes } = this.tables;
    return {
      landmarks: lastOf(map, "landmark", time, ["x_m", "y_m", "std_x_m", "std_y_m", "corr_xy"]).map(([x, y, sx, sy, correlation]) => ({ x, y, sx, sy, correlation })),
      keyframes: lastOf(keyframes, "keyframe", time, ["x_m", "y_m"]).map(([x, y]) => ({ x, y })),
    };
  }
  hasMap() {
    return [this.tables.map, this.tables.keyframes].some((table) => table?.rows > 0);
  }
  /** The measurement whose record is nearest to a moment. */
  measurementAt(time) {
    let best = null;
    for (const all of this.sources.values()) for (const one of all) if (best === null || Math.abs(one.time - time) < Math.abs(best.time - time)) best = one;
    return best;
  }
  /** [refused, all] of its measurements. */
  refusedOf() {
    return [this.refusals.length, [...this.sources.values()].reduce((sum, all) => sum + all.length, 0)];
  }
  /** Sources of which more than outliers are refused, the worst first: [{source, refused, all}]. */
  mostlyRefused() {
    const counted = [...this.sources].map(([source, all]) => ({ source, refused: all.filter((one) => one.refused).length, all: all.length }));
    return counted.filter(({ refused, all }) => refused >= LEAST_REFUSED && refused > MOST_REFUSED * all).sort((a, b) => b.refused / b.all - a.refused / a.all);
  }
  /** Bits of Est_Status.Faults at a moment. */
  faults(time) {
    const status = this.tables.status;
    return status.rows > 0 ? status.values("faults")[at(status.values("time_s"), time)] : 0;
  }
  mode(time) {
    return this.modes.findLast(({ begin }) => begin <= time)?.word ?? "";
  }
}

/** The last row of each `id` up to a moment, of those that were sent within a round before it. */
function lastOf(table, id, time, names) {
  if (!table || table.rows === 0) return [];
  const times = table.values("time_s").subarray(0, table.rows), ids = table.values(id), columns = names.map((name) => table.values(name)), found = new Map();
  for (let row = at(times, time); row >= 0 && times[row] >= time - ROUND_S; row--) if (!found.has(ids[row]) && times[row] <= time) found.set(ids[row], columns.map((values) => values[row]));
  return [...found.values()];
}

function filtered(times, values, keep) {
  const t = [], v = [];
  for (let row = 0; row < values.length; row++) {
    if (Number.isNaN(values[row]) || !keep(row)) continue;
    t.push(times[row]);
    v.push(values[row]);
  }
  return [t, v];
}
