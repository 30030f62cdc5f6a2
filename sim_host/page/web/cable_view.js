// SPDX-License-Identifier: Apache-2.0
// The cable: an slcan adapter by Web Serial. It listens; a recording is opened as a log.
import { element, replace } from "./dom.js";
import { BITRATES, Cable } from "./slcan.js";
import { TalkView } from "./talk_view.js";
import { say } from "./texts.js";

export class CableView {
  /** `onLog(file)` gets the recording; `about` is the module's description. */
  constructor(parent, tasks, about, onLog) {
    Object.assign(this, { parent, tasks, onLog, bitrate: "S6", cable: null, failed: null, talk: new TalkView(tasks, about), talking: element("div", { id: "talk" }) });
  }
  async connect() {
    this.failed = null;
    try {
      const port = await navigator.serial.requestPort();
      this.cable = new Cable(port, { onChange: () => this.render() });
      await this.cable.open(this.bitrate);
      this.begun = performance.now();
      this.timer = setInterval(() => this.renderCounts(), 500);
    } catch (error) {
      this.cable = null;
      this.failed = error.name === "NotFoundError" ? say("cable.nothing") : error.message;
    }
    this.render();
  }
  async stop(open) {
    const { cable } = this;
    clearInterval(this.timer);
    this.cable = null;
    this.talk.end();
    await cable.close();
    this.render();
    if (open) await this.onLog(cable.recording.file("cable.log"));
  }
  /** The node's state, so that the recording can be repeated from its middle. */
  async ask() {
    const line = await this.tasks.run("snapshotRequest", { base: 0x300, counter: Math.floor(Date.now() / 1000) % 16 });
    this.asked = (await this.cable.send(line)) !== false;
    this.render();
  }
  render() {
    const { cable } = this;
    if (!navigator.serial) return replace(this.parent, element("h2", {}, say("cable.title")), element("p", { class: "note" }, say("cable.none")));
    const bitrate = element("select", { id: "cable-bitrate", "aria-label": say("cable.bitrate"), onchange: () => (this.bitrate = bitrate.value) }, Object.entries(BITRATES).map(([command, kbit]) => element("option", { value: command, selected: command === this.bitrate }, `${kbit} kbit/s`)));
    this.counts = element("p", { id: "cable-counts" });
    replace(this.parent, element("h2", {}, say("cable.title")), element("p", { class: "note" }, say("cable.note")),
      this.failed ? element("p", { class: "bad" }, this.failed) : null,
      !cable ? element("div", { class: "controls" }, bitrate, element("button", { id: "cable-connect", onclick: () => this.connect() }, say("cable.connect"))) : [
        element("p", { class: cable.refused ? "bad" : cable.listening ? "good" : "warning", id: "cable-state" }, say(cable.refused ? "cable.refused" : cable.over ? "cable.over" : cable.listening ? "cable.listening" : "cable.open")),
        this.counts,
        element("div", { class: "buttons" }, element("button", { id: "cable-look", class: "go", onclick: () => this.stop(true) }, say("cable.look")), element("button", { onclick: () => this.stop(false) }, say("cable.stop")),
          element("button", { id: "cable-ask", title: say("cable.ask.note"), onclick: () => this.ask() }, say("cable.ask"))),
        element("p", { class: "note" }, say("cable.ask.note")), this.asked ? element("p", { class: "note" }, say("cable.asked")) : null, this.talking]);
    this.talk.render(this.talking, cable);
    this.renderCounts();
  }
  renderCounts() {
    if (!this.cable) return;
    const { frames, bad, skipped } = this.cable.reader, rate = frames / Math.max(0.5, (performance.now() - this.begun) / 1000);
    this.counts.textContent = say("cable.counts", frames, rate.toFixed(0), bad, skipped, ((this.cable.recording.size + this.cable.recording.text.length) / 1e6).toFixed(1));
  }
}
