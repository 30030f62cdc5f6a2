// SPDX-License-Identifier: Apache-2.0
// Charts over time (uPlot), tied to one view.
import { colour } from "./dom.js";
import { at } from "./run.js";
import { decimal, say } from "./texts.js";

const base = (view, title, height) => ({
  title,
  height,
  scales: { x: { time: false, range: () => wideEnough(view.span) } },
  cursor: { drag: { x: true, y: false, setScale: false }, sync: { key: "t" } },
  legend: { live: true },
  hooks: {},
});

const ticks = (_, all) => all.map((v) => (v == null ? "" : decimal(String(+v.toPrecision(6)))));
/** What a chart shows of its values: all, but for a few (1 % at each end) that would make a hairline of the others. */
export function shownRange(values) {
  const all = values.filter((v) => v != null && Number.isFinite(v)).sort((a, b) => a - b), n = all.length;
  if (n === 0) return [-1, 1];
  let [low, high] = [all[0], all[n - 1]];
  const [first, last] = [all[Math.floor(0.01 * n)], all[Math.ceil(0.99 * n) - 1]];
  if (last > first && high - low > 4 * (last - first)) [low, high] = [first, last];
  const space = 0.06 * (high - low) || Math.abs(high) * 0.01 || 1;
  return wideEnough([low - space, high + space]);
}
/** A range that a scale can be divided in: at least 1e-9 of its values, which have 16 digits, and at most 1e12 beside 0. */
export function wideEnough([low, high]) {
  const bound = (v) => Math.min(Math.max(v, -1e12), 1e12), [first, last] = [bound(low), bound(high)];
  const least = 1e-9 * Math.max(Math.abs(first), Math.abs(last), 1e-6);
  return last - first >= least ? [first, last] : [first - least, last + least];
}
const axis = (more = {}) => ({ stroke: () => colour("faint"), grid: { stroke: () => colour("grid"), width: 1 }, ticks: { stroke: () => colour("grid") }, ...more });

export class Chart {
  constructor(parent, view, { title, height = 200, series, bands = [], scales = {}, data, values = ticks, labels = [], hooks = {}, onClick }) {
    this.view = view;
    const options = { ...base(view, title, height), bands, width: parent.clientWidth || 320 };
    options.padding = [null, 24, null, null];
    options.scales = { ...options.scales, y: { range: (plot) => shownRange(this.seen(plot)) }, ...scales };
    const label = (text) => (text ? { label: text, labelSize: 18, labelGap: 0, labelFont: "12px system-ui, sans-serif" } : {});
    options.axes = [axis({ values: ticks, size: 30, ...label(labels[0]) }), axis({ values, size: 60, space: 24, ...label(labels[1]) })];
    options.series = [{ label: "t [s]", value: (_, t) => (t == null ? "–" : decimal(t.toFixed(2))) }, ...series.map((one) => ({ value: (_, v) => (v == null ? "–" : decimal(String(+v.toPrecision(7)))), ...one }))];
    options.hooks = {
      ...hooks,
      setCursor: [({ cursor, posToVal }) => cursor.left >= 0 && !this.told && view.point(posToVal(cursor.left, "x"))],
      setSelect: [(plot) => {
        const { left, width } = plot.select;
        if (width < 4) return;
        view.show([plot.posToVal(left, "x"), plot.posToVal(left + width, "x")]);
        plot.setSelect({ left: 0, width: 0, top: 0, height: 0 }, false);
      }],
    };
    this.plot = new uPlot(options, data, parent);
    this.plot.over.addEventListener("dblclick", () => view.show(view.whole));
    this.plot.over.addEventListener("wheel", (event) => {
      if (!event.ctrlKey) return; // without it the page scrolls
      event.preventDefault();
      view.zoom(event.deltaY < 0 ? 0.8 : 1.25, this.plot.posToVal(event.offsetX, "x"));
    }, { passive: false });
    if (onClick) this.plot.over.addEventListener("click", () => onClick(this.plot));
    view.on((what) => this.follow(what));
    addEventListener("resize", (this.resized = () => this.plot.setSize({ width: parent.clientWidth, height })));
  }
  follow(what) {
    if (what === "span") this.plot.setScale("x", { min: this.view.span[0], max: this.view.span[1] });
    if (what !== "cursor" || this.view.cursor === null) return;
    this.told = true;
    this.plot.setCursor({ left: this.plot.valToPos(this.view.cursor, "x"), top: 10 }, false);
    this.told = false;
  }
  /** Values of all series in the shown span; of many some. */
  seen({ data }) {
    const [t, ...all] = data ?? [[]], [begin, end] = this.view.span, rows = [];
    for (let i = 0; i < t.length; i++) if (t[i] >= begin && t[i] <= end) rows.push(i);
    const step = Math.ceil(rows.length / 4000);
    return all.flatMap((values) => rows.filter((_, k) => k % step === 0).map((i) => values[i]));
  }
  destroy() {
    removeEventListener("resize", this.resized);
    this.plot.destroy();
  }
}

/** A value with its band of 3 sigma, of one run or of two. */
export function bandChart(parent, view, title, runs) {
  const series = [], bands = [], tables = [];
  for (const { run, colour: ink, name, value, sigma, label } of runs) {
    const [t, v] = run.series(value), [ts, s] = sigma ? run.series(sigma) : [[], []];
    tables.push([t, v]);
    series.push({ label: label ?? name, stroke: ink, width: 1.5, spanGaps: true });
    if (ts.length === 0) continue;
    const held = heldAt(t, v, ts);
    tables.push([ts, s.map((x, i) => held[i] + 3 * x)], [ts, s.map((x, i) => held[i] - 3 * x)]);
    const thin = { stroke: `${ink}66`, width: 0.5, spanGaps: true, points: { show: false } };
    series.push({ ...thin, label: "+3σ" }, { ...thin, label: "−3σ" });
    bands.push({ series: [series.length - 1, series.length], fill: `${ink}22` });
  }
  return new Chart(parent, view, { title: "", labels: [say("axis.time"), title], series, bands, data: uPlot.join(tables) });
}

function heldAt(t, v, wanted) {
  let i = 0;
  return wanted.map((time) => {
    while (i + 1 < t.length && t[i + 1] <= time) i++;
    return v[i];
  });
}

const TRUTH = { x_m: "x", y_m: "y", yaw_rad: "yaw" };
/** [times, error, 3 sigma] of a state against `truth` {t, x, y, yaw}, where sigma is published and the pose is valid; null where the truth does not have that state. */
export function errorsOf({ t, columns }, truth, name) {
  const known = truth?.[TRUTH[name]], sigma = columns[`std_${name}`], [times, error, band] = [[], [], []];
  if (!known) return null;
  t.forEach((time, i) => {
    const k = at(truth.t, time + 1e-6), d = columns[name][i] - known[k];
    if (!(columns.pos_valid[i] > 0) || Number.isNaN(sigma[i]) || Number.isNaN(d) || Math.abs(truth.t[k] - time) > 0.005) return;
    times.push(time), error.push(name === "yaw_rad" ? d - 2 * Math.PI * Math.round(d / (2 * Math.PI)) : d), band.push(3 * sigma[i]);
  });
  return [times, error, band];
}

/** The error of a state in its band of 3 sigma. */
export function errorChart(parent, view, title, [t, error, band]) {
  const thin = { stroke: colour("first"), width: 1, points: { show: false } };
  return new Chart(parent, view, { title: "", labels: [say("axis.time"), title], data: [t, error, band, band.map((x) => -x)], bands: [{ series: [2, 3], fill: `${colour("first")}22` }],
    series: [{ label: title, stroke: colour("ink"), width: 1.5, points: { show: false } }, { ...thin, label: "+3σ" }, { ...thin, label: "−3σ" }] });
}

/** Innovations over their gates, a point each, of one source or (null) of all: above 1 is beyond it. `onPoint` gets the one that was clicked. */
export function innovationChart(parent, view, run, only, inks, onPoint) {
  const names = only === null ? [...run.sources.keys()] : [only], least = 0.01;
  const points = { show: true, size: 4 }, paths = () => null;
  const tables = names.map((name) => {
    const all = run.sources.get(name);
    return [all.map(({ time }) => time), all.map(({ ratio }) => Math.max(least, ratio))];
  });
  const series = names.map((name, i) => ({ label: say(`source.${name}`), stroke: inks[i % inks.length], paths, points: { ...points, fill: inks[i % inks.length] } }));
  if (names.length === 0) return null;
  const top = Math.max(10, ...run.refusals.filter(({ source }) => names.includes(source)).map(({ ratio }) => ratio).filter(Number.isFinite).slice(0, 10000));
  const gate = (plot) => {
    const y = Math.round(plot.valToPos(1, "y", true)), { ctx, bbox } = plot;
    ctx.save();
    ctx.strokeStyle = colour("bad");
    ctx.setLineDash([6, 4]);
    ctx.beginPath();
    ctx.moveTo(bbox.left, y), ctx.lineTo(bbox.left + bbox.width, y);
    ctx.stroke();
    ctx.restore();
  };
  return new Chart(parent, view, {
    title: "", labels: [say("axis.time"), say("innovation.axis")], series, height: 300, data: tables.length === 1 ? tables[0] : uPlot.join(tables),
    scales: { y: { distr: 3, range: () => [least, 10 ** Math.ceil(Math.log10(top))] } },
    values: ticks,
    hooks: { draw: [gate] },
    onClick: (plot) => {
      const time = plot.posToVal(plot.cursor.left, "x"), ratio = plot.posToVal(plot.cursor.top, "y");
      onPoint(nearest(plot, names.flatMap((name) => run.sources.get(name)), time, ratio));
    },
  });
}

function nearest(plot, all, time, ratio) {
  let best = 20 ** 2, found = null;
  const [x, y] = [plot.valToPos(time, "x"), plot.valToPos(ratio, "y")];
  for (const one of all) {
    const d = (plot.valToPos(one.time, "x") - x) ** 2 + (plot.valToPos(Math.max(0.01, one.ratio), "y") - y) ** 2;
    if (d < best) [best, found] = [d, one];
  }
  return found;
}
