// SPDX-License-Identifier: Apache-2.0
// The time line: the mode, the state of each source, and a stroke for each refusal.
import { element, sized, colour } from "./dom.js";
import { say } from "./texts.js";

const ROW = 24, LABEL = 118, AXIS = 20;
const INK = { Nominal: "good", Fusing: "good", DeadReckoning: "warn", Degraded: "warn", Confirming: "warn", Rejecting: "bad", Distrusted: "bad", Fault: "bad" };

export class Timeline {
  /** `onRefusal` gets a refusal that was clicked. */
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
    for (let t = Math.ceil(begin / step) * step; t <= end; t += step) context.fillText(`${+t.toPrecision(6)} s`, this.across(t), height - 5);
  }
  listen() {
    const { canvas, view } = this;
    canvas.addEventListener("pointermove", ({ offsetX }) => offsetX > LABEL && view.point(this.time(offsetX)));
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      view.zoom(event.deltaY < 0 ? 0.8 : 1.25, this.time(event.offsetX));
    }, { passive: false });
    canvas.addEventListener("click", ({ offsetX, offsetY }) => {
      const refused = this.rows[Math.floor(offsetY / ROW)]?.[2] ?? [];
      const near = refused.reduce((best, one) => (Math.abs(this.across(one.time) - offsetX) < Math.abs(this.across(best?.time ?? -1e9) - offsetX) ? one : best), null);
      if (near && Math.abs(this.across(near.time) - offsetX) < 12) this.onRefusal(near);
    });
    canvas.addEventListener("keydown", (event) => this.key(event));
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
