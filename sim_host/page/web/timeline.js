// SPDX-License-Identifier: Apache-2.0
// The time line: the mode, the state of each source, and a stroke for each refusal.
import { element, sized, colour } from "./dom.js";
import { decimal, say } from "./texts.js";

const ROW = 24, LABEL = 118, AXIS = 20;
const INK = { Nominal: "good", Fusing: "good", DeadReckoning: "third", Degraded: "warn", Confirming: "warn", Rejecting: "bad", Distrusted: "bad", Fault: "bad" };

export class Timeline {
  /** `onRefusal` gets a refusal that was clicked, or {time, source, word} of a stretch without one. */
  constructor(parent, view, onRefusal) {
    this.view = view;
    this.onRefusal = onRefusal;
    this.canvas = element("canvas", { tabindex: "0", role: "img", "aria-label": say("timeline.label") });
    parent.append(this.canvas);
    this.listen();
    view.on(() => this.draw());
  }
  show(run) {
    this.run = run;
    this.rows = [["mode", run.modes, []], ...[...run.states].map(([source, spans]) => [source, spans, this.refusals(source)])];
    for (const source of run.sources.keys()) if (!run.states.has(source)) this.rows.push([source, [], this.refusals(source)]);
    this.rows = this.rows.filter(([name, spans, refused]) => name === "mode" || refused.length > 0 || spans.some(({ word }) => word !== "Stopped"));
    this.draw();
  }
  refusals(source) {
    return (this.run.sources.get(source) ?? []).filter(({ refused }) => refused);
  }
  across(time) {
    const [begin, end] = this.view.span;
    return LABEL + ((time - begin) / (end - begin)) * (this.width - LABEL - 4);
  }
  time(px) {
    const [begin, end] = this.view.span;
    return begin + ((px - LABEL) / (this.width - LABEL - 4)) * (end - begin);
  }
  draw() {
    if (!this.run) return;
    const [context, width, height] = sized(this.canvas, this.rows.length * ROW + AXIS);
    this.width = width;
    context.fillStyle = colour("paper");
    context.fillRect(0, 0, width, height);
    context.font = "12px system-ui, sans-serif";
    this.rows.forEach((row, i) => this.drawRow(context, row, i * ROW));
    this.drawAxis(context, height);
    if (this.view.cursor !== null) {
      context.fillStyle = colour("ink");
      context.fillRect(Math.round(this.across(this.view.cursor)), 0, 1, height - AXIS);
    }
  }
  drawRow(context, [name, spans, refused], top) {
    context.save();
    context.beginPath();
    context.rect(LABEL, 0, this.width, 1e4);
    context.clip();
    for (const { begin, end, word } of spans) {
      const left = Math.max(LABEL, this.across(begin)), right = Math.min(this.width, this.across(end));
      if (right <= left) continue;
      context.fillStyle = colour(INK[word] ?? "faint");
      context.globalAlpha = word === "Stopped" ? 0.15 : 0.45;
      context.fillRect(left, top + 3, Math.max(1, right - left), ROW - 6);
      context.globalAlpha = 1;
      const text = say(`word.${word}`), wide = context.measureText(text).width;
      context.fillStyle = colour("ink");
      if (right - left > wide + 8) context.fillText(text, left + 4, top + 16);
    }
    context.fillStyle = colour("bad");
    for (const { time } of refused) context.fillRect(this.across(time), top + 2, 1.5, ROW - 4);
    context.restore();
    context.fillStyle = colour("ink");
    context.fillText(say(`source.${name}`), 2, top + 16, LABEL - 6);
  }
  drawAxis(context, height) {
    const [begin, end] = this.view.span, raw = (end - begin) / 6, power = 10 ** Math.floor(Math.log10(raw));
    const step = [1, 2, 5, 10].map((n) => n * power).find((n) => n >= raw);
    context.fillStyle = colour("faint");
    for (let t = Math.ceil(begin / step) * step; t <= end; t += step) {
      const text = `${decimal(String(+t.toPrecision(6)))} s`;
      context.fillText(text, Math.min(this.across(t), this.width - context.measureText(text).width - 2), height - 5);
    }
  }
  listen() {
    const { canvas, view } = this;
    canvas.addEventListener("pointermove", ({ offsetX }) => offsetX > LABEL && view.point(this.time(offsetX)));
    canvas.addEventListener("wheel", (event) => {
      if (!event.ctrlKey) return; // without it the page scrolls
      event.preventDefault();
      view.zoom(event.deltaY < 0 ? 0.8 : 1.25, this.time(event.offsetX));
    }, { passive: false });
    canvas.addEventListener("click", ({ offsetX, offsetY }) => {
      const one = offsetX > LABEL ? this.clicked(this.rows[Math.floor(offsetY / ROW)], offsetX) : null;
      if (one) this.onRefusal(one);
    });
    canvas.addEventListener("keydown", (event) => this.key(event));
  }
  /** The refusal near a place of a row; else what the row's colour says there, by the nearest refusal of its stretch where there is one. */
  clicked(row, px) {
    if (!row) return null;
    const [source, spans, refused] = row, time = this.time(px), nearest = (all) => all.reduce((best, one) => (best === null || Math.abs(one.time - time) < Math.abs(best.time - time) ? one : best), null);
    const near = nearest(refused), span = spans.findLast(({ begin }) => begin <= time);
    if (near && Math.abs(this.across(near.time) - px) < 12) return near;
    if (!span || span.word === "Nominal" || span.word === "Fusing" || span.word === "Stopped") return null;
    return (source === "mode" ? null : nearest(refused.filter((one) => one.time >= span.begin && one.time <= span.end))) ?? { time, source, word: span.word };
  }
  /** Arrows move, + and - zoom, n and p go to the next refusal and to the one before, u to the measurement at the cursor. */
  key(event) {
    const { view } = this, from = view.cursor ?? view.span[0];
    const jump = (one) => one && (view.point(one.time), this.onRefusal(one));
    const keys = { "+": () => view.zoom(0.8), "=": () => view.zoom(0.8), "-": () => view.zoom(1.25), 0: () => view.show(view.whole),
      ArrowLeft: () => view.pan(-0.2), ArrowRight: () => view.pan(0.2),
      n: () => jump(this.run.refusals.find(({ time }) => time > from)), p: () => jump(this.run.refusals.findLast(({ time }) => time < from)), u: () => jump(this.run.measurementAt(from)) };
    if (!keys[event.key]) return;
    event.preventDefault();
    keys[event.key]();
  }
}
