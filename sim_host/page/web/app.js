// SPDX-License-Identifier: Apache-2.0
// The page: a log is opened, played, and shown.
import { element, replace, colour, save } from "./dom.js";
import { MODE } from "./engine.js";
import { Run, at } from "./run.js";
import { View } from "./view.js";
import { PathView } from "./path_view.js";
import { Timeline } from "./timeline.js";
import { bandChart, errorChart, errorsOf, innovationChart } from "./charts.js";
import { caseFile, savedCase } from "./case_file.js";
import { Numbers } from "./numbers.js";
import { Play } from "./play.js";
import { TablesView } from "./tables_view.js";
import { tablesOf } from "./tables.js";
import { logOfMcap } from "./mcap.js";
import { evidenceChart, evidenceOf } from "./evidence.js";
import { renderBits, renderFindings, renderWhy, sourceLine } from "./log_views.js";
import { renderAsk } from "./ask_view.js";
import { renderUpdate } from "./update_view.js";
import { updateOf } from "./equations.js";
import { CompareView } from "./compare_view.js";
import { LessonView } from "./lesson_view.js";
import { CableView } from "./cable_view.js";
import { parsed } from "./settings_text.js";
import { TaskQueue } from "./tasks.js";
import { LONG_BYTES, beginningOf } from "./thinning.js";
import { say, speak, languageNow } from "./texts.js";
import { ofModule } from "./texts_module.js";

/** The language of the last visit; a page from disk may have no memory. */
const memory = { get: () => { try { return localStorage.getItem("tetap.language"); } catch { return null; } }, set: (name) => { try { localStorage.setItem("tetap.language", name); } catch { /* forgotten */ } } };

const $ = (id) => document.getElementById(id);
const SIGMAS = { x_m: "std_x_m", y_m: "std_y_m", yaw_rad: "std_yaw_rad", speed_mps: "std_speed_mps", yaw_rate_radps: "std_yaw_rate_radps", height_m: "std_height_m",
  v_east_mps: "std_v_east_mps", v_north_mps: "std_v_north_mps", v_up_mps: "std_v_up_mps", gyro_bias_z_radps: "std_gyro_bias_z_radps", acc_bias_x_mps2: "std_acc_bias_x_mps2", std_x_m: null, std_yaw_rad: null };

/** Cards that show the first run alone, also where there is a second. */
const FIRST_RUN = new Set(["findings", "bits", "innovation", "timeline", "why"]);

/** Estimators whose updates are not those of src/tetap/filter/viewed.hpp. */
const BY_OTHER_EQUATIONS = new Set(["Ukf", "Particle", "Grid"]);

/** What a task throws whose log or robot has given way to another: nobody is told of it. */
const OVERTAKEN = new Error("overtaken");

class App {
  constructor() {
    this.view = new View();
    this.turn = 0; // counts what was opened or chosen
    this.maker = -1; // number of the robot that made the log
    this.state = "x_m";
    this.charts = [];
    this.described = []; // numbers of a recording's robot that its form has: [[row, element, value]]
  }
  async start() {
    speak(memory.get());
    this.renderFrame();
    this.tasks = await TaskQueue.start();
    this.about = await this.tasks.run("describe");
    this.numbers = new Numbers(this.about.parameters, () => this.replayChanged());
    this.robot = Math.max(0, this.about.robots.findIndex(({ name }) => name === "rover"));
    this.numbers.of(this.about.robots[this.robot]);
    this.play = new Play($("play"), this.tasks, this.about, (file, truth) => this.open(file, { truth }));
    this.tables = new TablesView($("tables"), this.tasks, this.about, (file, more) => this.open(file, more), () => this.status(() => say("open.ready"), "ready"));
    this.compare = new CompareView(this.tasks, this.about, JSON.parse($("costs").textContent));
    this.lesson = new LessonView($("lesson"), this.tasks);
    this.cable = new CableView($("cable"), this.tasks, this.about, (file) => this.open(file));
    this.renderMore();
    await this.play.begin();
    this.status(() => say("open.ready"), "ready");
    this.renderRobots();
    const saved = await savedCase();
    if (saved) await this.openSaved(saved);
    else if (parsed(location.hash)) await this.takeSettings(location.hash);
  }
  /** Settings as text, of another copy of this page: false where they are none. */
  async takeSettings(text) {
    const given = parsed(text), known = given ? this.about.robots.findIndex(({ name }) => name === given.robot) : -1;
    if (known < 0) return false;
    if (known !== this.robot) await this.chooseRobot(known);
    this.numbers.takeNamed(given.numbers);
    if (this.file) await this.replayChanged();
    else this.given = given; // for the first log
    return true;
  }
  /** The log that lies in the page, with the numbers that were changed. */
  async openSaved({ log, robot, numbers, described }) {
    const known = this.about.robots.findIndex(({ name }) => name === robot);
    await this.open(log, { robot: known < 0 ? null : known, described: described ?? [] });
    if (known < 0) return;
    this.numbers.takeNamed(numbers ?? {});
    if (this.numbers.changed.size > 0) await this.replayChanged();
  }
  async saveCase() {
    save(`${this.file.name.replace(/\.\w+$/, "")}.html`, await caseFile(this.file, this.about.robots[this.robot].name, this.numbers.named(), this.described));
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

  /** Files that were dropped together: a log, or tables of one recording. */
  async openFiles(files) {
    if (files.length === 0) return;
    this.turn++;
    this.status(() => say("open.reading", files[0].name), "busy");
    try {
      const log = files.length === 1 ? await this.still(logOfMcap(files[0])) : null;
      if (log) return await this.open(log);
      const tables = await this.still(tablesOf(files));
      if (!tables) return await this.open(files[0]);
      this.play.pause();
      await this.still(this.tables.show(tables));
      this.forget();
      this.status(() => say("tables.status"), "tables");
    } catch (error) {
      if (error === OVERTAKEN) return;
      this.forget();
      this.fail(error);
    }
  }
  /** {maker, shown, choose()} where a robot of this page made the log, and another is shown; else null. */
  other() {
    const { robots } = this.about, { maker } = this;
    return maker < 0 || this.known ? null : { maker: robots[maker].name, shown: robots[this.robot].name, choose: () => this.chooseRobot(maker) };
  }
  /** Number of the robot that made the log, -1: none of this page. Robots that differ in their estimators alone have the same parameters: it is the one whose epochs come out as recorded. */
  async makerOf(log) {
    const { config, base } = this.identity, fitting = this.about.robots.flatMap((robot, i) => (robot.config === config ? [i] : []));
    if (fitting.length < 2) return fitting[0] ?? -1;
    const part = await this.still(beginningOf(log)), repeats = ({ result }) => result.epochs_compared > 0 && result.epochs_different === 0;
    await this.still(this.tasks.run("open", { log: part }));
    let found = -1;
    for (const robot of fitting) if (found < 0 && (await this.still(this.tasks.run("replay", { robot, base, settings: [], mode: MODE.automatic }).then(repeats, () => false)))) found = robot;
    await this.still(this.tasks.run("open", { log }));
    return found < 0 ? fitting[0] : found;
  }
  /** What `task` resolves to, unless something else has been opened or chosen in the meantime. @throws OVERTAKEN */
  async still(task) {
    const { turn } = this, ended = await task.then((done) => ({ done }), (error) => ({ error }));
    if (turn !== this.turn) throw OVERTAKEN;
    if (ended.error) throw ended.error;
    return ended.done;
  }
  /** What was opened before: nothing of it stays beside other words. */
  forget() {
    this.turn++;
    Object.assign(this, { file: null, identity: null, maker: -1, truth: null, described: [], run: null, second: null, findings: null, why: null, opened: null });
    $("views").hidden = $("ask").hidden = true;
    this.renderRobots();
    this.renderDrop();
  }
  /** `truth` {t, x, y}: of a log that was played here. `robot`: number of the one that the user has named; null: the log's own. */
  async open(file, { truth = null, robot = null, described = [] } = {}) {
    this.play.pause();
    if (robot === null) this.tables.hide();
    this.forget();
    Object.assign(this, { file, truth, described });
    this.compare.forget();
    this.status(() => say("open.reading", file.name), "busy");
    try {
      this.identity = await this.still(this.tasks.run("open", { log: file }));
      this.maker = await this.makerOf(file);
      if (this.maker < 0 && robot === null) return this.ask();
      this.robot = robot ?? this.maker;
      this.known = this.robot === this.maker;
      this.numbers.of(this.describedRobot());
      await this.replayAll();
      await this.takeGiven();
    } catch (error) {
      this.fail(error);
    }
  }
  /** Settings that came before any log. */
  async takeGiven() {
    const { given } = this;
    this.given = null;
    if (given?.robot !== this.about.robots[this.robot].name) return;
    this.numbers.takeNamed(given.numbers);
    await this.replayChanged();
  }
  /** The robot with what a recording's form says of it. */
  describedRobot() {
    const robot = this.about.robots[this.robot], values = robot.values.map((own) => [...own]);
    for (const [row, element, value] of this.described) if (values[row]) values[row][element] = value;
    return { ...robot, values };
  }
  /** The page knows no robot with the log's numbers: which one is to be played is the user's word. */
  ask() {
    $("views").hidden = true;
    renderAsk($("ask"), this.about.robots, this.identity, (robot) => (($("ask").hidden = true), this.chooseRobot(robot)));
    this.status(() => say("ask.status", this.file.name), "asks");
    this.renderRobots();
  }
  fail(error) {
    if (error === OVERTAKEN) return;
    this.run = null;
    $("views").hidden = true;
    this.status(() => (error.trapped ? say("open.trapped", error.message) : say("open.failed", ofModule(error.message))), "failed");
  }
  task(extra = {}) {
    return { robot: this.robot, base: this.identity.base, ...extra, settings: [...this.described, ...(extra.settings ?? [])] };
  }
  async replayAll() {
    this.second = null;
    this.message = this.note = "";
    if (this.file.size > LONG_BYTES) await this.showBeginning();
    const played = await this.replay([]);
    this.run = new Run(played);
    this.view.reset(this.run.span);
    this.render();
    this.status(() => this.title(), "done");
    this.arrive();
    this.findings = await this.still(this.tasks.run("diagnose", this.task()).catch((error) => ({ failed: error.message })));
    this.renderFindings();
    document.body.dataset.diagnosed = "yes";
  }
  /** To what is said of the log, also for the next Tab: the play's buttons lie before it. */
  arrive() {
    $("status").scrollIntoView();
    $("status").focus({ preventScroll: true });
  }
  /** The first picture of a long log; what is refused here is said of the whole log. */
  async showBeginning() {
    const part = await this.still(beginningOf(this.file));
    await this.still(this.tasks.run("open", { log: part }));
    const played = await this.still(this.tasks.run("replay", this.task({ mode: MODE.lockstep })).catch(() => null));
    await this.still(this.tasks.run("open", { log: this.file }));
    if (!played) return;
    this.run = new Run(played);
    this.note = say("open.beginning", (part.size / 1e6).toFixed(0), (this.file.size / 1e6).toFixed(0));
    this.view.reset(this.run.span);
    this.render();
    this.arrive();
    document.body.dataset.beginning = "yes";
    this.note = "";
  }
  /** A log that is no whole record is played by its inputs, and the page says so. */
  async replay(settings) {
    const { turn } = this, progress = (share) => turn === this.turn && this.status(() => say("open.playing", Math.round(100 * share)));
    if (this.lockstep !== this.file) {
      try {
        return await this.still(this.tasks.run("replay", this.task({ settings, mode: MODE.automatic }), progress));
      } catch (error) {
        if (!error.refused || settings.length > 0) throw error;
        this.refusal = error.message;
      }
    }
    const played = await this.still(this.tasks.run("replay", this.task({ settings, mode: MODE.lockstep }), progress));
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
      if (settings.length > 0) await this.still(this.tasks.run("check", this.task({ settings })));
      if (settings.length > 0 && this.run) {
        const second = new Run(await this.replay(settings));
        if (second.result.estimates_sha256 === this.run.result.estimates_sha256) this.message = say("numbers.noeffect");
        else this.message = this.effect((this.second = second));
      }
      this.status(() => this.title(), "done");
    } catch (error) {
      if (error === OVERTAKEN) return;
      this.message = error.message;
      this.status(error.message, "done");
    }
    this.render(true);
  }
  /** Plays the log with what a finding proposes; the figures of before and after are shown where parameters are changed. */
  async tryRemedy(remedy) {
    this.numbers.changed.clear();
    this.numbers.add(remedy);
    await this.replayChanged();
    $("numbers").scrollIntoView();
  }
  effect(second) {
    let most = -1, when = 0;
    for (let i = 0; i < second.t.length; i++) {
      const k = at(this.run.t, second.t[i]), d = Math.hypot(second.x[i] - this.run.x[k], second.y[i] - this.run.y[k]);
      if (second.columns.pos_valid[i] > 0 && this.run.columns.pos_valid[k] > 0 && d > most) [most, when] = [d, second.t[i]];
    }
    return say("numbers.effect", most < 0 ? "–" : most.toFixed(3), when.toFixed(1), this.run.refusedOf()[0], second.refusedOf()[0]);
  }
  async chooseRobot(number) {
    this.turn++;
    Object.assign(this, { robot: number, findings: null, why: null, opened: null });
    this.known = number === this.maker;
    this.numbers.of(this.describedRobot());
    this.compare?.forget();
    this.renderRobots();
    if (!this.file) return;
    this.status(() => say("open.reading", this.file.name), "busy");
    await this.replayAll().catch((error) => this.fail(error));
  }
  /** The update behind a record of an innovation, from the flashed filter itself. */
  async openUpdate(one) {
    const mode = this.lockstep === this.file ? MODE.lockstep : MODE.automatic;
    this.opened = { one, wait: true };
    this.renderUpdate();
    const updates = await this.tasks.run("updates", this.task({ settings: this.numbers.settings(), mode, time_s: one.time, span_s: 1.2 })).catch((error) => error);
    if (this.opened?.one !== one) return;
    this.opened = updates instanceof Error ? { one, failed: updates.message } : { one, update: updateOf(updates, one) };
    this.renderUpdate();
    document.body.dataset.update = this.opened.update ? this.opened.update.model : "none";
  }
  async compareAll(progress) {
    const truth = this.truth && { ...this.truth };
    await this.compare.run(this.robot, this.identity.inputs, (extra) => this.task({ settings: this.numbers.settings(), ...extra }), truth, progress);
    this.renderCompare();
    document.body.dataset.compared = "yes";
  }

  // Below: what is drawn. A change of language draws all of it anew.
  renderFrame() {
    document.documentElement.lang = languageNow();
    $("tag").textContent = say("title.tag");
    if (this.said) this.status(this.said);
    const other = languageNow() === "en" ? "id" : "en";
    replace($("tools"),
      element("button", { id: "open-log", onclick: () => $("file").click() }, say("open.choose")),
      element("button", { id: "language", lang: other, onclick: () => (speak(other), memory.set(other), this.renderFrame(), this.renderMore(), this.play?.render(), this.render(true)) }, say("lang.other")),
      element("button", { id: "theme", onclick: () => this.otherTheme() }, say("theme.other")));
    this.renderDrop();
  }
  /** What stands beside a log. */
  renderMore() {
    if (document.body.dataset.state === "asks") this.ask();
    this.tables?.render();
    this.lesson?.render();
    this.cable?.render();
  }
  renderDrop() {
    const file = element("input", { type: "file", id: "file", multiple: true, onchange: () => this.openFiles([...file.files]) });
    replace($("drop"), element("strong", {}, say("open.drop")), element("label", { class: "button" }, say("open.choose"), file), element("span", { class: "note" }, say("open.formats")),
      this.run && element("button", { id: "save-case", title: say("open.case"), onclick: () => this.saveCase() }, say("open.save")));
  }
  otherTheme() {
    const root = document.documentElement, dark = root.dataset.theme ?? (matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light");
    root.dataset.theme = dark === "dark" ? "light" : "dark";
    this.renderColours();
  }
  /** Charts keep the colours with which they were drawn. */
  renderColours() {
    this.play?.render();
    this.lesson?.render();
    this.render(true);
  }
  renderRobots() {
    if (!this.about) return;
    const select = element("select", { id: "robot", "aria-label": say("robot.label"), onchange: () => this.chooseRobot(Number(select.value)) },
      this.about.robots.map(({ name }, i) => element("option", { value: i, selected: i === this.robot }, name)));
    if (document.body.dataset.state === "asks") return replace($("robots"));
    const name = this.about.robots[this.robot].name;
    const other = this.other(), words = !this.identity ? "" : this.known ? say("robot.known", name) : other ? say("findings.robot", other.maker, name) : say(this.identity.config === undefined ? "robot.silent" : "robot.unknown", name);
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
    this.renderUpdate();
    this.renderCompare();
    this.numbers.render(this.section("numbers"), this.message, (text) => this.takeSettings(text));
  }
  section(name, note) {
    const body = element("div", { class: "body" }), first = this.second && FIRST_RUN.has(name) ? element("span", { class: "mark" }, say("view.first")) : null;
    replace($(name), element("h2", {}, say(`${name}.title`), first), note ? element("p", { class: "note" }, note) : null, body);
    return body;
  }
  runs() {
    const first = { run: this.run, colour: colour("first"), label: this.second ? say("numbers.before") : say("run.estimate") };
    return this.second ? [first, { run: this.second, colour: colour("second"), label: say("numbers.after") }] : [first];
  }
  renderBits() {
    const { result } = this.run;
    renderBits(this.section("bits"), this.run, this.note);
    Object.assign(document.body.dataset, { sha: result.estimates_sha256, crc: result.state_crc_last, different: result.epochs_different ?? "", second: this.second?.result.estimates_sha256 ?? "" });
  }
  renderFindings() {
    const body = this.section("findings"), { findings, run } = this;
    renderFindings(body, findings, run, this.about.codes, this.other(), { onTry: (remedy) => this.tryRemedy(remedy), onShow: (source) => this.showSource(source) });
    const places = body.querySelectorAll(".seen"); // one a finding, also where two have one code
    for (const [i, one] of (findings?.findings ?? []).entries()) {
      const seen = evidenceOf(one, findings.seconds, run.fixes), picture = element("div", { class: "evidence" });
      if (!seen) continue;
      places[i].append(picture);
      this.charts.push(evidenceChart(picture, this.view, seen));
    }
  }
  renderPath(keep) {
    const body = this.section("path", [say("path.legend"), ...(this.truth ? [say("path.truth")] : []), ...(this.run.hasMap() ? [say("path.map")] : []), ...(this.second ? [say("path.second")] : []), say("path.zoom")].join(" ")), before = keep ? this.path : null;
    this.path = new PathView(body, this.view, (one) => this.renderWhy(one));
    if (before?.moved) Object.assign(this.path, { box: before.box, scale: before.scale, moved: true });
    this.path.show(this.runs(), this.truth, Boolean(before?.moved));
    body.append(element("button", { onclick: () => (this.path.fit(), this.view.show(this.view.whole), this.path.draw()) }, say("path.all")));
  }
  renderStates() {
    const body = this.section("state", [say("state.note"), ...(this.run.every > 1 ? [say("state.thinned", this.run.every)] : [])].join(" "));
    const known = Object.keys(SIGMAS).filter((name) => this.run.series(name)[0].length > 0);
    const select = element("select", { id: "state-name", "aria-label": say("state.label"), onchange: () => ((this.state = select.value), this.render(true)) },
      known.map((name) => element("option", { value: name, selected: name === this.state }, say(`state.${name}`))));
    const chart = element("div", {});
    body.append(select, chart);
    if (known.length === 0) return replace(body, element("p", { class: "note" }, say("view.nothing")));
    const name = known.includes(this.state) ? this.state : known[0];
    this.charts.push(bandChart(chart, this.view, say(`state.${name}`), this.runs().map((one) => ({ ...one, value: name, sigma: SIGMAS[name] }))));
    const errors = errorsOf(this.run, this.truth, name), box = element("div", { id: "errors" });
    if (!errors) return;
    body.append(element("p", { class: "note" }, say("play.error")), box);
    this.charts.push(errorChart(box, this.view, say(`state.${name}`), errors));
  }
  showSource(source) {
    this.source = source;
    this.render(true);
    $("innovation").scrollIntoView();
    $("innovation-source").focus({ preventScroll: true });
  }
  renderInnovations() {
    const body = this.section("innovation", say("innovation.note")), names = [...this.run.sources.keys()];
    const only = names.includes(this.source) ? this.source : null;
    const select = element("select", { id: "innovation-source", "aria-label": say("innovation.source"), onchange: () => ((this.source = select.value), this.render(true)) },
      ["", ...names].map((name) => element("option", { value: name, selected: name === (only ?? "") }, name === "" ? say("innovation.all") : sourceLine(this.run, name))));
    if (names.length === 0) return replace(body, element("p", { class: "note" }, say("view.nothing")));
    body.append(select);
    const hidden = (only === null ? names : [only]).flatMap((name) => this.run.sources.get(name)).filter(({ refused, ratio }) => refused && Number.isNaN(ratio)).length;
    if (hidden > 0) body.append(element("p", { class: "note", id: "hidden" }, say("innovation.hidden", hidden)));
    const inks = ["first", "second", "good", "warn", "third"].map(colour);
    this.charts.push(innovationChart(body, this.view, this.run, only, inks, (one) => one && this.renderWhy(one)));
  }
  renderTimeline() {
    const body = this.section("timeline", say("timeline.help"));
    this.timeline = new Timeline(body, this.view, (one) => this.renderWhy(one));
    this.timeline.show(this.run);
    body.append(element("p", { class: "note" }, say("timeline.legend")));
  }
  renderWhy(one) {
    this.why = one;
    if (one) this.view.point(one.time);
    renderWhy(this.section("why"), this.run, one, (which) => this.openUpdate(which));
  }
  renderUpdate() {
    $("update").hidden = !this.opened;
    if (!this.opened) return;
    const { one, update, wait, failed } = this.opened, body = this.section("update", say("update.of", say(`source.${one.source}`), one.time.toFixed(2)));
    if (update) return renderUpdate(body, update);
    replace(body, element("p", { class: failed ? "bad" : "note" }, failed ?? (wait ? say("update.wait") : this.noUpdate(one))));
  }
  /** Why there is none behind a measurement. */
  noUpdate({ refused, failed }) {
    if (BY_OTHER_EQUATIONS.has(this.run.kind)) return say("update.kind", say(`kind.${this.run.kind}`));
    return say(refused ? "update.before" : "update.none", say(`check.${failed}`));
  }
  renderCompare() {
    this.compare.render(this.section("compare", say("compare.what")), (progress) => this.compareAll(progress));
  }
}

const app = new App();
addEventListener("keydown", (event) => {
  if (event.defaultPrevented || event.ctrlKey || event.metaKey || event.altKey || /^(INPUT|SELECT|TEXTAREA)$/.test(event.target.tagName)) return;
  if (app.run && !$("views").hidden && ["n", "p", "u"].includes(event.key)) app.timeline?.key(event);
});
addEventListener("dragover", (event) => event.preventDefault());
addEventListener("drop", (event) => {
  event.preventDefault();
  if (app.play) app.openFiles([...event.dataTransfer.files]);
});
addEventListener("resize", () => app.run && (app.path.resized(), app.timeline.draw()));
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => app.renderColours());
if (navigator.language.startsWith("id")) speak("id");
app.start().catch((error) => app.status(error.message, "failed"));
