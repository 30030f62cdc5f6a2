// SPDX-License-Identifier: Apache-2.0
// The path from above: estimate with ellipses of 3 sigma, fixes that were used and refused, truth, a second run.
import { element, sized, colour } from "./dom.js";
import { at } from "./run.js";
import { decimal, say } from "./texts.js";

const HEIGHT = 420, MARGIN = 24;

export class PathView {
  /** `onFix` gets a fix that was clicked; nothing narrower than `least_m` is shown by itself. */
  constructor(parent, view, onFix, least_m = 2) {
    this.least_m = least_m;
    this.landmarks = []; // [[x, y]]
    this.view = view;
    this.onFix = onFix;
    this.runs = [];
    this.truth = null;
    this.canvas = element("canvas", { tabindex: "0", role: "img", "aria-label": say("path.label") });
    parent.append(this.canvas);
    this.listen();
    view.on(() => this.draw());
  }

  /** [{run, colour}], the first with fixes and ellipses; truth {t, x, y} or null. */
  show(runs, truth = null, keep = false) {
    this.runs = runs;
    this.truth = truth;
    if (!keep) this.fit();
    this.draw();
  }

  fit() {
    let [left, right, low, high] = [Infinity, -Infinity, Infinity, -Infinity];
    const take = (x, y) => {
      left = Math.min(left, x), right = Math.max(right, x), low = Math.min(low, y), high = Math.max(high, y);
    };
    for (const { run } of this.runs) for (let i = 0; i < run.x.length; i += 10) if (run.columns.pos_valid[i] > 0) take(run.x[i], run.y[i]);
    for (let i = 0; this.truth && i < this.truth.x.length; i += 10) if (!Number.isNaN(this.truth.x[i])) take(this.truth.x[i], this.truth.y[i]);
    for (const { run } of this.runs) for (const one of run.mapAt(this.view.whole[1]).landmarks) take(one.x, one.y);
    if (left > right) [left, right, low, high] = [-5, 5, -5, 5];
    this.box = { x: (left + right) / 2, y: (low + high) / 2, width: Math.max(right - left, this.least_m), height: Math.max(high - low, this.least_m) };
    this.scale = null;
    this.moved = false; // by the user
  }

  /** Shows all of it at its new size, unless the user has chosen a part. */
  resized() {
    if (!this.moved) this.scale = null;
    this.draw();
  }

  place() {
    const [context, width, height] = sized(this.canvas, Math.min(HEIGHT, Math.max(280, Math.min(innerHeight * 0.55, innerWidth * 0.8))));
    this.scale ??= Math.min((width - 2 * MARGIN) / this.box.width, (height - 2 * MARGIN) / this.box.height);
    this.across = (x) => width / 2 + (x - this.box.x) * this.scale;
    this.down = (y) => height / 2 - (y - this.box.y) * this.scale;
    return [context, width, height];
  }

  draw() {
    if (!this.box) return;
    const [context, width, height] = this.place();
    context.fillStyle = colour("paper");
    context.fillRect(0, 0, width, height);
    this.drawGrid(context, width, height);
    this.drawLandmarks(context);
    if (this.runs.length === 0) return;
    this.drawMap(context, this.runs[0]);
    this.drawFixes(context);
    for (const { run, colour: ink } of this.runs) this.drawLine(context, run, ink);
    if (this.truth) this.drawLine(context, this.truth, colour("truth"), [3, 6]);
    this.drawEllipses(context, this.runs[0]);
    this.drawCursor(context);
  }

  drawGrid(context, width, height) {
    const raw = 70 / this.scale, power = 10 ** Math.floor(Math.log10(raw));
    const step = [1, 2, 5, 10].map((n) => n * power).find((n) => n >= raw);
    context.strokeStyle = colour("grid");
    context.fillStyle = colour("faint");
    context.font = "11px system-ui, sans-serif";
    context.lineWidth = 1;
    const label = (value) => `${decimal(String(+value.toPrecision(6)))} m`;
    const left = this.box.x - width / 2 / this.scale, low = this.box.y - height / 2 / this.scale;
    context.beginPath();
    for (let x = Math.ceil(left / step) * step; this.across(x) < width; x += step) {
      context.moveTo(this.across(x), 0), context.lineTo(this.across(x), height);
      if (this.across(x) + 3 + context.measureText(label(x)).width < width) context.fillText(label(x), this.across(x) + 3, height - 4);
    }
    for (let y = Math.ceil(low / step) * step; this.down(y) > 0; y += step) {
      context.moveTo(0, this.down(y)), context.lineTo(width, this.down(y));
      if (this.down(y) > 14 && this.down(y) < height - 18) context.fillText(label(y), 3, this.down(y) - 3);
    }
    context.stroke();
  }

  drawLandmarks(context) {
    context.strokeStyle = colour("faint");
    for (const [x, y] of this.landmarks) context.strokeRect(this.across(x) - 3, this.down(y) - 3, 6, 6);
  }

  /** The node's own map at the end of the shown span: landmarks with 3 sigma, keyframes as dots. */
  drawMap(context, { run, colour: ink }) {
    const { landmarks, keyframes } = run.mapAt(this.view.span[1]);
    context.strokeStyle = context.fillStyle = ink;
    context.lineWidth = 1;
    for (const { x, y, sx, sy, correlation } of landmarks) {
      const [px, py] = [this.across(x), this.down(y)];
      context.fillRect(px - 3, py - 3, 6, 6);
      this.ellipse(context, px, py, sx, sy, correlation || 0);
    }
    for (const { x, y } of keyframes) context.strokeRect(this.across(x) - 2, this.down(y) - 2, 4, 4);
  }

  /** The shown span strongly, the rest faintly; no line where the position is not valid. */
  drawLine(context, { t, x, y, columns }, ink, dash = []) {
    const [begin, end] = this.view.span, valid = columns?.pos_valid;
    context.strokeStyle = ink;
    context.lineWidth = 2;
    context.setLineDash(dash);
    for (const shown of [false, true]) {
      context.globalAlpha = shown ? 1 : 0.25;
      const first = shown ? at(t, begin) : 0, last = shown ? at(t, end) : t.length - 1;
      let down = false, lastX = NaN, lastY = NaN;
      context.beginPath();
      for (let i = first; i <= last; i++) {
        if (valid && !(valid[i] > 0)) { down = false; continue; }
        const px = this.across(x[i]), py = this.down(y[i]);
        if (down && Math.abs(px - lastX) + Math.abs(py - lastY) < 0.7) continue;
        down ? context.lineTo(px, py) : context.moveTo(px, py);
        [down, lastX, lastY] = [true, px, py];
      }
      context.stroke();
    }
    context.setLineDash([]);
    context.globalAlpha = 1;
  }

  drawFixes(context) {
    const [begin, end] = this.view.span;
    for (const fix of this.runs[0].run.fixes) {
      if (fix.stamp < begin || fix.stamp > end) continue;
      const px = this.across(fix.x), py = this.down(fix.y);
      if (fix.innovation?.refused) {
        context.strokeStyle = colour("bad");
        context.lineWidth = 1.5;
        context.beginPath();
        context.moveTo(px - 4, py - 4), context.lineTo(px + 4, py + 4);
        context.moveTo(px + 4, py - 4), context.lineTo(px - 4, py + 4);
        context.stroke();
      } else {
        context.fillStyle = colour(fix.innovation ? "fix" : "faint");
        context.fillRect(px - 1.5, py - 1.5, 3, 3);
      }
    }
  }

  /** One each 60 pixels of the path. */
  drawEllipses(context, { run, colour: ink }) {
    const { std_x_m: sx, std_y_m: sy, corr_xy: correlation } = run.columns;
    const [begin, end] = this.view.span, last = at(run.t, end);
    let px = Infinity, py = Infinity;
    context.strokeStyle = ink;
    context.lineWidth = 1;
    context.globalAlpha = 0.6;
    for (let i = at(run.t, begin); i <= last; i++) {
      if (Number.isNaN(sx[i]) || !(run.columns.pos_valid[i] > 0)) continue;
      const x = this.across(run.x[i]), y = this.down(run.y[i]);
      if (Math.hypot(x - px, y - py) < 60) continue;
      [px, py] = [x, y];
      this.ellipse(context, x, y, sx[i], sy[i], correlation[i] || 0);
    }
    context.globalAlpha = 1;
  }
  ellipse(context, px, py, sx, sy, correlation) {
    const a = sx * sx, b = correlation * sx * sy, c = sy * sy, middle = (a + c) / 2, spread = Math.hypot((a - c) / 2, b);
    const long = 3 * Math.sqrt(middle + spread) * this.scale, short = 3 * Math.sqrt(Math.max(0, middle - spread)) * this.scale;
    context.beginPath();
    context.ellipse(px, py, Math.min(long, 1e5), Math.min(short, 1e5), -0.5 * Math.atan2(2 * b, a - c), 0, 2 * Math.PI);
    context.stroke();
  }

  drawCursor(context) {
    const { cursor } = this.view;
    if (cursor === null) return;
    if (this.truth) {
      const i = at(this.truth.t, cursor);
      context.strokeStyle = colour("truth");
      context.lineWidth = 2;
      context.beginPath();
      context.arc(this.across(this.truth.x[i]), this.down(this.truth.y[i]), 6, 0, 2 * Math.PI);
      context.stroke();
    }
    for (const { run, colour: ink } of this.runs) {
      const i = at(run.t, cursor);
      if (!(run.columns.pos_valid[i] > 0)) continue;
      this.drawLastEllipse(context, run, i, ink);
      const px = this.across(run.x[i]), py = this.down(run.y[i]), yaw = run.columns.yaw_rad[i];
      context.fillStyle = ink;
      context.beginPath();
      context.moveTo(px + 11 * Math.cos(yaw), py - 11 * Math.sin(yaw));
      context.lineTo(px + 7 * Math.cos(yaw + 2.5), py - 7 * Math.sin(yaw + 2.5));
      context.lineTo(px + 7 * Math.cos(yaw - 2.5), py - 7 * Math.sin(yaw - 2.5));
      context.fill();
    }
  }

  /** The last that was published up to row `i`. */
  drawLastEllipse(context, { x, y, columns: { std_x_m: sx, std_y_m: sy, corr_xy: correlation } }, i, ink) {
    let k = i;
    while (k > 0 && i - k < 20 && Number.isNaN(sx[k])) k--;
    if (Number.isNaN(sx[k])) return;
    context.strokeStyle = ink;
    context.fillStyle = `${ink}22`;
    context.lineWidth = 1.5;
    this.ellipse(context, this.across(x[i]), this.down(y[i]), sx[k], sy[k], correlation[k] || 0);
    context.fill();
  }

  zoom(factor, px = null, py = null) {
    this.moved = true;
    const width = this.canvas.clientWidth, height = this.canvas.clientHeight;
    const dx = px === null ? 0 : (px - width / 2) / this.scale, dy = py === null ? 0 : (height / 2 - py) / this.scale;
    this.box.x += dx * (1 - 1 / factor);
    this.box.y += dy * (1 - 1 / factor);
    this.scale *= factor;
    this.draw();
  }
  move(px, py) {
    this.moved = true;
    this.box.x -= px / this.scale;
    this.box.y += py / this.scale;
    this.draw();
  }

  listen() {
    const { canvas } = this, fingers = new Map();
    let dragged = 0;
    canvas.addEventListener("wheel", (event) => {
      if (!event.ctrlKey) return; // without it the page scrolls
      event.preventDefault();
      this.zoom(event.deltaY < 0 ? 1.2 : 1 / 1.2, event.offsetX, event.offsetY);
    }, { passive: false });
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      fingers.set(event.pointerId, event);
      dragged = 0;
    });
    canvas.addEventListener("pointermove", (event) => {
      const before = fingers.get(event.pointerId);
      if (!before) return this.hover(event);
      const [dx, dy] = [event.clientX - before.clientX, event.clientY - before.clientY];
      const other = [...fingers].find(([id]) => id !== event.pointerId)?.[1];
      fingers.set(event.pointerId, event);
      dragged += Math.abs(dx) + Math.abs(dy);
      if (!other) return this.move(dx, dy);
      const apart = (one) => Math.hypot(one.clientX - other.clientX, one.clientY - other.clientY) || 1;
      this.zoom(apart(event) / apart(before));
    });
    const release = (event) => {
      fingers.delete(event.pointerId);
      if (event.type === "pointerup" && dragged < 6) this.click(event);
    };
    canvas.addEventListener("pointerup", release);
    canvas.addEventListener("pointercancel", release);
    canvas.addEventListener("keydown", (event) => {
      const keys = { "+": () => this.zoom(1.25), "=": () => this.zoom(1.25), "-": () => this.zoom(0.8), ArrowLeft: () => this.move(40, 0),
        ArrowRight: () => this.move(-40, 0), ArrowUp: () => this.move(0, 40), ArrowDown: () => this.move(0, -40),
        0: () => (this.fit(), this.draw()) };
      if (!keys[event.key]) return;
      event.preventDefault();
      keys[event.key]();
    });
  }

  hover(event) {
    const run = this.runs[0]?.run;
    if (!run) return;
    const [begin, end] = this.view.span, first = at(run.t, begin), last = at(run.t, end);
    let best = 24 ** 2, found = null;
    for (let i = first; i <= last; i += 3) {
      const d = (this.across(run.x[i]) - event.offsetX) ** 2 + (this.down(run.y[i]) - event.offsetY) ** 2;
      if (d < best) [best, found] = [d, run.t[i]];
    }
    if (found !== null) this.view.point(found);
  }
  click(event) {
    let best = 14 ** 2, found = null;
    for (const fix of this.runs[0]?.run.fixes ?? []) {
      const d = (this.across(fix.x) - event.offsetX) ** 2 + (this.down(fix.y) - event.offsetY) ** 2;
      if (fix.innovation && d < best) [best, found] = [d, fix];
    }
    if (found) this.onFix(found.innovation);
  }
}
