// SPDX-License-Identifier: Apache-2.0
// Play: the simulated robot and the flashed code in one loop, faults on buttons while it drives.
import { element, replace, colour, save } from "./dom.js";
import { Chart } from "./charts.js";
import { Live } from "./live.js";
import { PathView } from "./path_view.js";
import { View } from "./view.js";
import { verdictOf } from "./log_views.js";
import { times } from "./run.js";
import { decimal, say } from "./texts.js";
import { faultText } from "./texts_module.js";

const TICKS_PER_S = 100, MOST_TICKS = 150;
/** A fault that does nothing new for so long: seconds that must be left for it to show. */
const NEEDED_S = { gnss_far: 216 };
/** Above this share without a position nothing is said of the errors of the rest. */
const MOST_UNKNOWN = 0.2;
/** Longest latency of a fix in the simulated world (sim_host/world/numbers.hpp) [ms]. */
const RECEIVER_MS = 120;
const SPEEDS = [1, 2, 5, 10], LINES = 60;
/** States of every robot whose error is drawn. */
const PLANE = ["x_m", "y_m", "yaw_rad"];
const TONE = { Nominal: "good", Fusing: "good", DeadReckoning: "warning", Degraded: "warning", Rejecting: "bad", Distrusted: "bad", Fault: "bad" };
const GROUPS = ["gnss", "wheels", "imu", "magnetometer", "landmarks", "lidar", "features", "any"];

export class Play {
  /** `about` is the module's description; `onLook(file, truth)` gets the run as a log. */
  constructor(parent, tasks, about, onLook) {
    const { robots } = about;
    Object.assign(this, { parent, tasks, about, robots, onLook, robot: 0, seed: 1, speed: 1, error: "x_m", view: new View() });
    this.robot = Math.max(0, robots.findIndex(({ name }) => name === "rover"));
    this.faults = []; // [{name, start_s, end_s}]
    addEventListener("keydown", (event) => this.key(event));
    addEventListener("resize", () => this.path?.draw());
  }

  async begin() {
    this.running = false;
    this.faults = [];
    this.error = PLANE.includes(this.error) ? this.error : PLANE[0];
    this.stage = this.live = this.failed = null;
    try {
      this.stage = await this.tasks.run("begin", { robot: this.robot, seed: this.seed });
      this.live = new Live(this.stage);
    } catch (error) {
      this.failed = error.message;
    }
    this.render();
  }
  async toggle() {
    if (this.running) return void (this.running = false);
    if (!this.live || this.live.played.over) await this.begin();
    if (this.live) await this.drive();
  }
  pause() {
    this.running = false;
  }
  /** Ticks as the clock wants them; what a slow machine cannot keep up with is left out of the speed, never of the run. */
  async drive() {
    this.running = true;
    delete document.body.dataset.played;
    replace(this.parts.keep);
    this.renderControls();
    let before = performance.now(), owed = 0;
    while (this.running) {
      const now = performance.now();
      owed = Math.min(MOST_TICKS, owed + ((now - before) / 1000) * this.speed * TICKS_PER_S);
      before = now;
      const ticks = Math.floor(owed), { live } = this;
      owed -= ticks;
      try {
        if (ticks > 0) live.take(await this.tasks.run("advance", { ticks }));
      } catch (error) {
        return void this.fail(error);
      }
      if (live !== this.live) return;
      if (live.played.over) this.running = false;
      this.renderLive();
      await new Promise((done) => setTimeout(done, Math.max(40, 2 * this.drawn)));
    }
    await this.renderHash();
    this.renderControls();
  }
  /** Whether what is left of the run is too short for a fault. */
  late({ name }) {
    return (NEEDED_S[name] ?? 0) > this.stage.duration_s - this.live.played.time_s;
  }
  /** The robot's window for late samples where it is shorter than the receiver's latency [ms], else null. */
  shortWindow() {
    const row = this.about.parameters.findIndex(({ path }) => path === "loop.window_us"), window_ms = this.robots[this.robot].values[row][0] / 1000;
    return window_ms < RECEIVER_MS && this.stage.faults.some(({ on }) => on === "gnss") ? window_ms : null;
  }
  /** Says which faults have ended, each once. */
  hearEnds() {
    const now = this.live.played.time_s;
    for (const fault of this.faults.filter(({ told, start_s, end_s }) => !told && end_s > start_s && end_s <= now)) {
      fault.told = true;
      if (!this.faults.some(({ name, end_s }) => name === fault.name && end_s > now)) this.live.say(this.live.start + fault.end_s, { kind: "ended", name: fault.name });
    }
  }
  async inject({ number, name, duration_s }) {
    if (!this.live || this.late({ name })) return;
    const { live } = this, fault = await this.tasks.run("inject", { fault: number, seconds: duration_s }).catch((error) => this.fail(error));
    if (!fault || live !== this.live) return;
    this.faults.push(fault);
    this.live.faulted.clear();
    this.live.say(this.live.start + fault.start_s, { kind: "injected", name });
    this.renderLive();
    if (!this.running && !this.live.played.over) this.drive();
  }
  /** A play that has trapped is over; another may begin. */
  fail({ message }) {
    this.running = false;
    this.live = null;
    this.failed = message;
    this.render();
  }
  script() {
    return this.tasks.run("script");
  }
  file() {
    return new File(this.live.frames, `${this.stage.robot}_${this.seed}.log`);
  }

  key(event) {
    const { tagName } = event.target, typing = /^(INPUT|SELECT|TEXTAREA)$/.test(tagName);
    if (typing || (event.key === " " && tagName === "BUTTON") || event.ctrlKey || event.metaKey || event.altKey || !this.live) return;
    const fault = this.stage.faults[Number(event.key) - 1];
    if (event.key !== " " && !fault) return;
    event.preventDefault();
    fault ? this.inject(fault) : this.toggle();
  }

  // Below: what is drawn.
  render() {
    this.parts = Object.fromEntries(["controls", "faults", "words", "chart", "keep"].map((name) => [name, element("div", { class: name })]));
    const path = element("div", { class: "sight" });
    this.summary = element("p", { class: "summary" });
    replace(this.parent, element("h2", {}, say("play.title")), element("p", { class: "note" }, say("play.note")), this.parts.controls,
      this.failed ? element("p", { class: "bad" }, this.failed) : null,
      element("div", { class: "scene" }, path, this.parts.faults, this.parts.words), this.parts.chart, this.summary,
      element("details", { open: true }, element("summary", {}, "σ, gate, outage"), ["sigma", "gate", "outage"].map((word) => element("p", { class: "note" }, say(`play.${word}`)))), this.parts.keep);
    this.renderControls();
    if (!this.live) return;
    this.view.clear();
    this.path = new PathView(path, this.view, () => {}, 20);
    path.append(element("button", { onclick: () => (this.path.fit(), this.path.draw()) }, say("path.all")), element("p", { class: "note" }, say("play.legend")));
    this.path.landmarks = this.stage.landmarks;
    this.path.show([]);
    this.renderFaults();
    this.renderChart();
    this.renderLive();
    this.renderHash();
  }
  renderControls() {
    const { running } = this, over = this.live?.played.over;
    const robot = element("select", { id: "play-robot", "aria-label": say("robot.label"), onchange: () => ((this.robot = Number(robot.value)), this.begin()) },
      this.robots.map(({ name }, i) => element("option", { value: i, selected: i === this.robot }, name)));
    const speed = element("select", { id: "play-speed", "aria-label": say("play.speed"), onchange: () => (this.speed = Number(speed.value)) },
      SPEEDS.map((times) => element("option", { value: times, selected: times === this.speed }, `× ${times}`)));
    const seed = element("input", { id: "play-seed", type: "number", min: 0, max: 4294967295, value: this.seed, "aria-label": say("play.seed"),
      onchange: () => ((this.seed = Math.min(4294967295, Math.max(0, Math.floor(Number(seed.value) || 0)))), this.begin()) });
    const button = element("button", { id: "play-go", class: "go", onclick: () => this.toggle() }, say(running ? "play.pause" : over ? "play.again" : this.live?.played.time_s > 0 ? "play.on" : "play.start"));
    const focused = document.activeElement?.id;
    this.clock = element("span", { class: "clock" });
    replace(this.parts.controls, button, speed, element("button", { id: "play-again", onclick: () => this.begin() }, say("play.again")), robot,
      element("label", {}, `${say("play.seed")} `, seed), this.clock);
    if (focused && this.parts.controls.querySelector(`#${focused}`)) document.getElementById(focused).focus();
    this.renderClock();
  }
  renderClock() {
    if (this.live) this.clock.textContent = say("play.clock", this.live.played.time_s.toFixed(1), this.stage.duration_s.toFixed(0));
  }
  renderFaults() {
    this.buttons = new Map();
    const groups = GROUPS.map((on) => [on, this.stage.faults.filter((fault) => fault.on === on && (NEEDED_S[fault.name] ?? 0) <= this.stage.duration_s)]).filter(([, all]) => all.length > 0);
    this.stage.faults = groups.flatMap(([, all]) => all);
    replace(this.parts.faults, groups.map(([on, all]) => element("fieldset", {}, element("legend", {}, say(`on.${on}`)),
      all.map((fault) => {
        const button = element("button", { "data-fault": fault.name, title: faultText(fault), onclick: ({ currentTarget, detail }) => {
          if (detail > 0) currentTarget.blur(); // Space starts and pauses again
          this.inject(fault);
        } }, say(`inject.${fault.name}`));
        this.buttons.set(fault.name, { button, fault });
        return button;
      }))));
  }
  /** All that moves. */
  renderLive() {
    const began = performance.now();
    this.renderClock();
    for (const [name, { button, fault }] of this.buttons) {
      const left = Math.max(0, ...this.faults.filter((one) => one.name === name).map(({ end_s }) => end_s - this.live.played.time_s));
      button.setAttribute("aria-pressed", left > 0);
      button.disabled = left === 0 && this.late(fault);
      button.title = button.disabled ? say("play.late", NEEDED_S[name], Math.max(0, this.stage.duration_s - this.live.played.time_s).toFixed(0)) : faultText(fault);
      button.textContent = left > 0 ? `${say(`inject.${name}`)} · ${Math.ceil(left)} s` : say(`inject.${name}`);
    }
    this.hearEnds();
    if (this.live.tables.estimates?.rows > 0) {
      const run = this.live.run(), truth = this.live.truth();
      this.view.reset(run.span);
      this.view.cursor = run.span[1];
      this.path.show([{ run, colour: colour("first"), label: say("run.estimate") }], truth, this.path.moved);
      this.renderErrors(run);
    }
    this.renderWords();
    this.drawn = performance.now() - began;
  }
  renderChart() {
    const select = this.states = element("select", { id: "play-error", "aria-label": say("state.label"), onchange: () => ((this.error = select.value), this.renderLive()) },
      (this.hasHeight() ? [...PLANE, "height_m"] : PLANE).map((name) => element("option", { value: name, selected: name === this.error }, say(`state.${name}`))));
    const box = element("div", {});
    replace(this.parts.chart, element("p", {}, `${say("play.error")} `, select), box);
    this.chart?.destroy();
    const thin = { stroke: colour("first"), width: 1, points: { show: false } };
    const view = new View();
    view.reset([0, 10]);
    this.chart = new Chart(box, view, { title: "", height: 170, labels: [say("axis.time")], data: [[], [], [], []], bands: [{ series: [2, 3], fill: `${colour("first")}22` }],
      series: [{ label: say("play.error"), stroke: colour("ink"), width: 1.5, points: { show: false } }, { ...thin, label: "+3σ" }, { ...thin, label: "−3σ" }] });
  }
  /** Whether the node says its height; a robot of the plane has none. */
  hasHeight() {
    return this.live.tables.states?.rows > 0 && this.live.tables.states.values("std_height_m").some((sigma) => sigma > 0);
  }
  renderErrors(run) {
    if (this.states.length === PLANE.length && this.hasHeight()) this.states.append(element("option", { value: "height_m" }, say("state.height_m")));
    const [t, error, band] = this.live.errors(this.error, run);
    this.chart.view.whole = this.chart.view.span = [0, Math.max(10, this.live.played.time_s)];
    this.chart.plot.setData([t, error, band, band.map((x) => -x)]);
    const inside = error.filter((x, i) => Math.abs(x) <= band[i]).length, unknown = this.live.unknown(run);
    const judged = t.length > 0 && unknown <= MOST_UNKNOWN, out = judged && Math.abs(error.at(-1)) > band.at(-1);
    this.summary.textContent = [judged && say("play.inside", ((100 * inside) / t.length).toFixed(1), say(`state.${this.error}`).replace(/ \[.*/, "")), out && say("play.outside"), unknown >= 0.0005 && say("play.unknown", (100 * unknown).toFixed(1))].filter(Boolean).join(" ");
  }
  renderWords() {
    const { mode, said } = this.live, window_ms = this.shortWindow();
    replace(this.parts.words, element("p", { class: `mode ${TONE[mode] ?? "note"}` }, mode ? say("play.mode", say(`word.${mode}`)) : say(this.live?.played.time_s > 0 ? "play.silent" : "play.ready")),
      mode ? element("p", { class: "note" }, say(`mode.${mode}`)) : null,
      window_ms === null ? null : element("p", { class: "note", id: "play-window" }, say("play.window", RECEIVER_MS, window_ms)),
      element("ol", { class: "said", role: "log", "aria-label": say("play.said"), tabindex: "0" }, said.slice(-LINES).reverse().map((one) => this.line(one))));
  }
  line({ time, kind, ...one }) {
    const words = {
      mode: () => `${say("source.mode")}: ${say(`word.${one.word}`)}.`,
      fault: () => say("why.faults", say(`fault.${one.bit}`)),
      source: () => `${say(`source.${one.source}`)}: ${say(`word.${one.word}`)}. ${say(`check.${one.failed}`)}`,
      refusal: () => `${say(`source.${one.source}`)}: ${verdictOf(one)}. ${say(one.verdict === "TooLate" ? "check.Late" : `check.${one.failed}`)}${Number.isNaN(one.ratio) ? "" : ` ${say("why.ratio", times(one.ratio))}`}`,
      injected: () => say("play.injected", say(`inject.${one.name}`)),
      ended: () => say("play.ended", say(`inject.${one.name}`)),
    };
    const ink = kind === "injected" || kind === "ended" ? "own" : kind === "refusal" || kind === "fault" ? "bad" : TONE[one.word] ?? "";
    return element("li", { class: ink, "data-kind": kind }, element("time", {}, `${decimal(time.toFixed(1))} s`), ` ${words[kind]()}`);
  }
  /** What can be kept of the run, once it stands still. */
  async renderHash() {
    if (this.running || !this.live || this.live.played.time_s === 0) return replace(this.parts.keep);
    const { live } = this, script = await this.script();
    if (live !== this.live || this.running) return;
    const name = `${this.stage.robot}_${this.seed}.faults`;
    Object.assign(document.body.dataset, { played: script.estimates_sha256, playedCrc: script.state_crc_last, playedEpochs: script.epochs });
    replace(this.parts.keep,
      element("div", { class: "buttons" },
        element("button", { id: "play-look", onclick: () => this.onLook(this.file(), live.truth()) }, say("play.look")),
        element("button", { id: "play-script", onclick: () => save(name, script.text) }, say("play.script")),
        element("button", { id: "play-log", onclick: () => save(this.file().name, this.file()) }, say("play.log"))),
      element("p", { class: "note" }, say("play.repeat", name)),
      element("p", { class: "hash" }, say("bits.hash", script.estimates_sha256)));
  }
}
