// SPDX-License-Identifier: Apache-2.0
// The page: a log is opened, played, and shown.
import { element, replace, colour, save } from "./dom.js";
import { MODE } from "./engine.js";
import { Run, at } from "./run.js";
import { View } from "./view.js";
import { PathView } from "./path_view.js";
import { Timeline } from "./timeline.js";
import { bandChart, innovationChart } from "./charts.js";
import { caseFile, savedCase } from "./case_file.js";
import { Numbers } from "./numbers.js";
import { Play } from "./play.js";
import { TaskQueue } from "./tasks.js";
import { say, speak, languageNow } from "./texts.js";

const $ = (id) => document.getElementById(id);
const SIGMAS = { x_m: "std_x_m", y_m: "std_y_m", yaw_rad: "std_yaw_rad", speed_mps: "std_speed_mps", yaw_rate_radps: "std_yaw_rate_radps", height_m: "std_height_m",
  v_east_mps: "std_v_east_mps", v_north_mps: "std_v_north_mps", v_up_mps: "std_v_up_mps", gyro_bias_z_radps: "std_gyro_bias_z_radps", acc_bias_x_mps2: "std_acc_bias_x_mps2", std_x_m: null, std_yaw_rad: null };

class App {
  constructor() {
    this.view = new View();
    this.state = "x_m";
    this.charts = [];
  }
  async start() {
    this.renderFrame();
    this.tasks = await TaskQueue.start();
    this.about = await this.tasks.run("describe");
    this.numbers = new Numbers(this.about.parameters, () => this.replayChanged());
    this.robot = Math.max(0, this.about.robots.findIndex(({ name }) => name === "rover"));
    this.numbers.of(this.about.robots[this.robot]);
    this.play = new Play($("play"), this.tasks, this.about.robots, (file, truth) => this.open(file, truth).then(() => $("findings").scrollIntoView({ behavior: "smooth" })));
    await this.play.begin();
    this.status(() => say("open.ready"), "ready");
    this.renderRobots();
    const saved = await savedCase();
    if (saved) await this.openSaved(saved);
  }
  /** The log that lies in the page, with the numbers that were changed. */
  async openSaved({ log, robot, numbers }) {
    await this.open(log);
    const known = this.about.robots.findIndex(({ name }) => name === robot);
    if (known >= 0 && known !== this.robot) await this.chooseRobot(known);
    this.numbers.takeNamed(numbers ?? {});
    if (this.numbers.changed.size > 0) await this.replayChanged();
  }
  async saveCase() {
    save(`${this.file.name.replace(/\.\w+$/, "")}.html`, await caseFile(this.file, this.about.robots[this.robot].name, this.numbers.named()));
  }
  /** `words` is a text of the node or of the module, or gives one in the language of the moment. */
  status(words, state) {
    this.said = words;
    $("status").textContent = typeof words === "function" ? words() : words;
    if (state) document.body.dataset.state = state;
  }

  title() {
    return this.file ? say("open.log", this.file.name, (this.file.size / 1e6).toFixed(1)) : say("open.ready");
  }

  /** `truth` {t, x, y}: of a log that was played here. */
  async open(file, truth = null) {
    this.play.pause();
    this.file = file;
    this.truth = truth;
    this.run = this.second = this.findings = null;
    this.status(() => say("open.reading", file.name), "busy");
    try {
      this.identity = await this.tasks.run("open", { log: file });
      const known = this.about.robots.findIndex(({ config }) => config === this.identity.config);
      if (known >= 0) this.robot = known;
      this.known = known >= 0;
      this.numbers.of(this.about.robots[this.robot]);
      await this.replayAll();
    } catch (error) {
      this.status(say("open.failed", error.message), "failed");
    }
  }
  task(extra = {}) {
    return { robot: this.robot, base: this.identity.base, settings: [], ...extra };
  }
  async replayAll() {
    this.second = null;
    this.message = this.note = "";
    const played = await this.replay([]);
    this.run = new Run(played);
    this.view.reset(this.run.span);
    this.render();
    this.status(() => this.title(), "done");
    this.findings = await this.tasks.run("diagnose", this.task()).catch((error) => ({ failed: error.message }));
    this.renderFindings();
    document.body.dataset.diagnosed = "yes";
  }
  /** A log that is no whole record is played by its inputs, and the page says so. */
  async replay(settings) {
    const progress = (share) => this.status(say("open.playing", Math.round(100 * share)));
    if (this.lockstep !== this.file) {
      try {
        return await this.tasks.run("replay", this.task({ settings, mode: MODE.automatic }), progress);
      } catch (error) {
        if (!error.refused || settings.length > 0) throw error;
        this.refusal = error.message;
      }
    }
    const played = await this.tasks.run("replay", this.task({ settings, mode: MODE.lockstep }), progress);
    this.lockstep = this.file;
    this.note = say("open.partly", this.refusal);
    return played;
  }
  async replayChanged() {
    this.second = null;
    this.message = "";
    document.body.dataset.state = "busy";
    const settings = this.numbers.settings();
    try {
      if (settings.length > 0) await this.tasks.run("check", this.task({ settings }));
      if (settings.length > 0 && this.run) {
        const second = new Run(await this.replay(settings));
        if (second.result.estimates_sha256 === this.run.result.estimates_sha256) this.message = say("numbers.noeffect");
        else this.message = this.effect((this.second = second));
      }
      this.status(() => this.title(), "done");
    } catch (error) {
      this.message = error.message;
      this.status(error.message, "done");
    }
    this.render(true);
  }
  effect(second) {
    let most = -1, when = 0;
    for (let i = 0; i < second.t.length; i++) {
      const k = at(this.run.t, second.t[i]), d = Math.hypot(second.x[i] - this.run.x[k], second.y[i] - this.run.y[k]);
      if (second.columns.pos_valid[i] > 0 && this.run.columns.pos_valid[k] > 0 && d > most) [most, when] = [d, second.t[i]];
    }
    return say("numbers.effect", most < 0 ? "–" : most.toFixed(3), when.toFixed(1));
  }
  async chooseRobot(number) {
    this.robot = number;
    this.known = this.about.robots[number].config === this.identity?.config;
    this.numbers.of(this.about.robots[number]);
    this.renderRobots();
    if (!this.file) return;
    this.status(say("open.reading", this.file.name), "busy");
    await this.replayAll().catch((error) => this.status(say("open.failed", error.message), "failed"));
  }

  // Below: what is drawn. A change of language draws all of it anew.
  renderFrame() {
    document.documentElement.lang = languageNow();
    $("tag").textContent = say("title.tag");
    if (this.said) this.status(this.said);
    const other = languageNow() === "en" ? "id" : "en";
    replace($("tools"),
      element("button", { id: "language", lang: other, onclick: () => (speak(other), this.renderFrame(), this.renderRobots(), this.play?.render(), this.render(true)) }, say("lang.other")),
      element("button", { id: "theme", onclick: () => this.otherTheme() }, say("theme.other")));
    this.renderDrop();
  }
  renderDrop() {
    const file = element("input", { type: "file", id: "file", onchange: () => file.files[0] && this.open(file.files[0]) });
    replace($("drop"), element("strong", {}, say("open.drop")), element("label", { class: "button" }, say("open.choose"), file), element("span", { class: "note" }, say("open.formats")),
      this.run && element("button", { id: "save-case", title: say("open.case"), onclick: () => this.saveCase() }, say("open.save")));
  }
  otherTheme() {
    const root = document.documentElement, dark = root.dataset.theme ?? (matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light");
    root.dataset.theme = dark === "dark" ? "light" : "dark";
    this.play?.render();
    this.render(true);
  }
  renderRobots() {
    if (!this.about) return;
    const select = element("select", { id: "robot", "aria-label": say("robot.label"), onchange: () => this.chooseRobot(Number(select.value)) },
      this.about.robots.map(({ name }, i) => element("option", { value: i, selected: i === this.robot }, name)));
    const name = this.about.robots[this.robot].name;
    const words = !this.identity ? "" : this.known ? say("robot.known", name) : say(this.identity.config === undefined ? "robot.silent" : "robot.unknown", name);
    replace($("robots"), say("robot.label"), " ", select, element("span", { class: this.known || !this.identity ? "note" : "warning" }, ` ${words}`));
  }
  render(keep = false) {
    this.renderRobots();
    if (!this.run) return;
    this.renderDrop();
    this.charts.forEach((chart) => chart?.destroy());
    this.charts = [];
    this.view.clear();
    $("views").hidden = false;
    this.renderBits();
    this.renderFindings();
    this.renderPath(keep);
    this.renderStates();
    this.renderInnovations();
    this.renderTimeline();
    this.renderWhy(this.why ?? null);
    this.numbers.render(this.section("numbers"), this.message);
  }
  section(name, note) {
    const body = element("div", { class: "body" });
    replace($(name), element("h2", {}, say(`${name}.title`)), note ? element("p", { class: "note" }, note) : null, body);
    return body;
  }
  runs() {
    const first = { run: this.run, colour: colour("first"), label: this.second ? say("numbers.before") : say("run.estimate") };
    return this.second ? [first, { run: this.second, colour: colour("second"), label: say("numbers.after") }] : [first];
  }
  renderBits() {
    const { result } = this.run, compared = result.epochs_compared ?? 0;
    const same = compared > 0 && result.epochs_different === 0;
    const verdict = compared === 0 ? say("bits.none") : same ? say("bits.same", compared) : say("bits.differ", result.epochs_different, compared, result.first_difference);
    const warnings = [result.first_malformed, result.cut_off, result.first_gap, result.first_wrong_length].filter(Boolean).join("; ");
    replace(this.section("bits"),
      element("p", { class: same ? "good" : compared === 0 ? "note" : "bad", id: "same" }, verdict),
      result.other_numbers ? element("p", { class: "warning" }, say("bits.numbers")) : null,
      this.note ? element("p", { class: "warning" }, this.note) : null,
      result.wrong && same ? element("p", { class: "warning" }, result.wrong) : null,
      warnings ? element("p", { class: "warning" }, say("open.warnings", warnings)) : null,
      element("p", { class: "hash" }, say("bits.hash", result.estimates_sha256)), element("p", { class: "hash" }, say("bits.crc", result.state_crc_last)));
    Object.assign(document.body.dataset, { sha: result.estimates_sha256, crc: result.state_crc_last, different: result.epochs_different ?? "", second: this.second?.result.estimates_sha256 ?? "" });
  }
  renderFindings() {
    const body = this.section("findings"), found = this.findings;
    if (!found) return replace(body, element("p", { class: "note" }, say("findings.wait")));
    if (found.failed) return replace(body, element("p", { class: "warning" }, say("findings.failed", found.failed)));
    if (found.findings.length === 0) return replace(body, element("p", { class: "good" }, say("findings.none")));
    replace(body, element("ol", {}, found.findings.map(({ code, cause, evidence, change }) =>
      element("li", { "data-code": code }, element("strong", {}, cause), element("p", {}, `${say("findings.evidence")}: ${evidence}`),
        element("p", { class: "change" }, `${say("findings.change")}: ${change}`)))));
  }
  renderPath(keep) {
    const body = this.section("path", say("path.legend")), before = keep ? this.path : null;
    this.path = new PathView(body, this.view, (one) => this.renderWhy(one));
    if (before?.scale) Object.assign(this.path, { box: before.box, scale: before.scale });
    this.path.show(this.runs(), this.truth, Boolean(before?.scale));
    body.append(element("button", { onclick: () => (this.path.fit(), this.view.show(this.view.whole), this.path.draw()) }, say("path.all")));
  }
  renderStates() {
    const body = this.section("state", say("state.note"));
    const known = Object.keys(SIGMAS).filter((name) => this.run.series(name)[0].length > 0);
    const select = element("select", { id: "state-name", "aria-label": say("state.label"), onchange: () => ((this.state = select.value), this.render(true)) },
      known.map((name) => element("option", { value: name, selected: name === this.state }, say(`state.${name}`))));
    const chart = element("div", {});
    body.append(select, chart);
    if (known.length === 0) return;
    const name = known.includes(this.state) ? this.state : known[0];
    this.charts.push(bandChart(chart, this.view, say(`state.${name}`), this.runs().map((one) => ({ ...one, value: name, sigma: SIGMAS[name] }))));
  }
  renderInnovations() {
    const body = this.section("innovation", say("innovation.note"));
    const inks = ["first", "second", "good", "warn", "third"].map(colour);
    this.charts.push(innovationChart(body, this.view, "", this.run, inks, (one) => one && this.renderWhy(one)));
  }
  renderTimeline() {
    const body = this.section("timeline", say("timeline.help"));
    this.timeline = new Timeline(body, this.view, (one) => this.renderWhy(one));
    this.timeline.show(this.run);
  }
  /** In words, what became of one measurement. */
  renderWhy(one) {
    this.why = one;
    const body = this.section("why");
    if (!one) return replace(body, element("p", { class: "note" }, say("why.nothing")));
    this.view.point(one.time);
    const faults = this.run.faults(one.time), named = [...Array(16).keys()].filter((bit) => (faults >> bit) & 1).map((bit) => say(`fault.${bit}`));
    const mode = this.run.mode(one.time);
    replace(body,
      element("p", {}, say("why.when", say(`source.${one.source}`), one.time.toFixed(2), say(`verdict.${one.verdict}`))),
      element("p", {}, say(`check.${one.failed}`)),
      Number.isNaN(one.ratio) ? null : element("p", {}, say("why.ratio", one.ratio.toFixed(2))),
      mode ? element("p", {}, say("why.mode", say(`word.${mode}`), say(`mode.${mode}`))) : null,
      named.length > 0 ? element("p", {}, say("why.faults", named.join(", "))) : null);
  }
}

const app = new App();
addEventListener("dragover", (event) => event.preventDefault());
addEventListener("drop", (event) => {
  event.preventDefault();
  const file = event.dataTransfer.files[0];
  if (file && app.play) app.open(file);
});
addEventListener("resize", () => app.run && (app.path.draw(), app.timeline.draw()));
if (navigator.language.startsWith("id")) speak("id");
app.start().catch((error) => app.status(error.message, "failed"));
