// SPDX-License-Identifier: Apache-2.0
// What all pictures share: the span of time that is shown, the moment under the pointer, and what was clicked.
export class View {
  constructor() {
    this.listeners = new Set();
    this.reset([0, 1]);
  }
  reset(whole) {
    this.whole = whole;
    this.span = whole;
    this.cursor = null;
  }
  on(listener) {
    this.listeners.add(listener);
  }
  clear() {
    this.listeners.clear();
  }
  emit(what) {
    for (const listener of this.listeners) listener(what);
  }
  /** Within the whole, and not narrower than 0.1 s. */
  show([begin, end]) {
    const [first, last] = this.whole, least = Math.min(0.1, last - first);
    const width = Math.min(Math.max(end - begin, least), last - first);
    const from = Math.min(Math.max(begin, first), last - width);
    if (from === this.span[0] && from + width === this.span[1]) return;
    this.span = [from, from + width];
    this.emit("span");
  }
  /** Factor below 1: closer, around a moment. */
  zoom(factor, around = (this.span[0] + this.span[1]) / 2) {
    this.show(this.span.map((t) => around + factor * (t - around)));
  }
  pan(share) {
    const by = share * (this.span[1] - this.span[0]);
    this.show(this.span.map((t) => t + by));
  }
  point(time) {
    if (time === this.cursor) return;
    this.cursor = time;
    this.emit("cursor");
  }
}
