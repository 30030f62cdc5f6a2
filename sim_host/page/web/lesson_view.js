// SPDX-License-Identifier: Apache-2.0
// The lesson on the page: a cart, the filter's numbers to move, each update to open, a failure to see, three questions.
import { element, replace, colour } from "./dom.js";
import { Chart } from "./charts.js";
import { View } from "./view.js";
import { GRID, HIDDEN, LESSON, band, drive, figures, gradeBraking, gradeNoise, gradePrediction } from "./lesson.js";
import { renderUpdate, short } from "./update_view.js";
import { decimal, languageNow, say } from "./texts.js";

const SLIDERS = [["q", -6, 1], ["r_m2", -2, 2], ["p0", -3, 3]];

export class LessonView {
  constructor(parent, tasks) {
    Object.assign(this, { parent, tasks, numbers: { dt_s: LESSON.dt_s, p0: LESSON.p0, q: LESSON.q, r_m2: LESSON.r_m2 }, brakes: false, step: 1, open: false, graded: {}, answers: {} });
  }
  filter(numbers, steps) {
    return this.tasks.run("lesson", { numbers, positions: steps.map(({ z }) => z) });
  }
  /** The run that is shown; of several changes at once the last. */
  async refresh() {
    const mine = (this.asked = {}), steps = drive({ seed: LESSON.seed, sigma_m: Math.sqrt(LESSON.r_m2), brakes: this.brakes });
    const updates = await this.filter(this.numbers, steps);
    if (mine !== this.asked) return;
    Object.assign(this, { steps, updates });
    this.renderRun();
  }
  async start() {
    this.open = true;
    this.worked = (await this.filter({ dt_s: LESSON.dt_s, p0: LESSON.p0, q: LESSON.q, r_m2: LESSON.r_m2 }, [{ z: 1 }]))[0];
    this.render();
    await this.refresh();
  }
  render() {
    if (!this.open) return replace(this.parent, element("h2", {}, say("lesson.title")), element("p", { class: "note" }, say("lesson.what")), element("button", { id: "lesson-start", onclick: () => this.start() }, say("lesson.start")));
    this.parts = Object.fromEntries(["chart", "figures", "update"].map((name) => [name, element("div", { class: name })]));
    replace(this.parent, element("h2", {}, say("lesson.title")), element("p", {}, say("lesson.cart")), element("p", {}, say("lesson.model")), this.example(),
      element("h3", {}, say("lesson.move")), element("p", {}, say("lesson.move.note")), element("div", { class: "controls" }, SLIDERS.map((one) => this.slider(one))), this.brakesButton(),
      this.parts.chart, element("p", { class: "note" }, say("lesson.legend")), this.parts.figures,
      element("h3", {}, say("lesson.open")), this.stepSlider(), this.parts.update,
      element("h3", {}, say("lesson.fail")), element("p", {}, say("lesson.fail.note")),
      element("h3", {}, say("lesson.questions")), element("ol", { class: "questions" }, this.questions()));
    this.chart?.destroy();
    this.chart = null;
    if (this.updates) this.renderRun();
  }
  /** The first step with the numbers of the text, as the module has it. */
  example() {
    const { prior, s } = this.worked, digits = (x) => decimal(x.toFixed(3)), k = [prior[0] / s[0], prior[2] / s[0]];
    return element("div", { class: "example", id: "lesson-example" }, element("p", {}, say("lesson.example", short(LESSON.p0), short(LESSON.q), short(LESSON.r_m2), short(LESSON.dt_s))),
      element("ul", {}, [["F P Fᵀ + Q", `(1,1) = ${digits(prior[0])}`], ["S", digits(s[0])], ["K", `(${k.map(digits).join(languageNow() === "id" ? "; " : ", ")})`]].map(([name, value]) => element("li", {}, `${name} `, element("strong", {}, value)))));
  }
  slider([name, least, most]) {
    const shown = element("output", {}, short(this.numbers[name]));
    const input = element("input", { type: "range", min: least, max: most, step: 0.05, value: Math.log10(this.numbers[name]), "data-lesson": name, "aria-label": say(`lesson.${name}`), oninput: () => {
      this.numbers[name] = Number((10 ** Number(input.value)).toPrecision(3));
      shown.textContent = short(this.numbers[name]);
      this.refresh();
    } });
    return element("label", { class: "slide" }, `${say(`lesson.${name}`)} `, input, " ", shown);
  }
  brakesButton() {
    const button = element("button", { id: "lesson-brakes", "aria-pressed": this.brakes, onclick: () => {
      this.brakes = !this.brakes;
      button.setAttribute("aria-pressed", this.brakes);
      this.refresh();
    } }, say("lesson.brakes"));
    return button;
  }
  stepSlider() {
    const input = element("input", { type: "range", min: 1, max: LESSON.steps, value: this.step, id: "lesson-step", "aria-label": say("lesson.step"), oninput: () => ((this.step = Number(input.value)), this.renderStep()) });
    return element("label", { class: "slide" }, `${say("lesson.step")} `, input, " ", (this.stepShown = element("output", {}, this.step)));
  }
  renderRun() {
    const { steps, updates } = this, t = steps.map((one) => one.t), x = updates.map(({ at, moved }) => at[0] + moved[0]), sigma = updates.map(({ posterior }) => 3 * Math.sqrt(posterior[0]));
    const data = [t, steps.map((one) => one.z), steps.map((one) => one.x), x, x.map((v, i) => v + sigma[i]), x.map((v, i) => v - sigma[i])];
    if (this.chart) this.chart.plot.setData(data);
    else {
      const view = new View();
      view.reset([0, t.at(-1)]);
      const thin = { stroke: `${colour("first")}66`, width: 0.5, points: { show: false } };
      this.chart = new Chart(this.parts.chart, view, { title: "", height: 300, labels: [say("axis.time"), say("axis.position")], data, bands: [{ series: [4, 5], fill: `${colour("first")}22` }],
        series: [{ label: "z", stroke: colour("faint"), paths: () => null, points: { show: true, size: 4, fill: colour("faint") } }, { label: say("lesson.truth"), stroke: colour("truth"), width: 1.5, dash: [4, 4], points: { show: false } },
          { label: say("run.estimate"), stroke: colour("first"), width: 2, points: { show: false } }, { ...thin, label: "+3σ" }, { ...thin, label: "−3σ" }] });
      this.chart.plot.over.addEventListener("click", () => this.openAt(this.chart.plot.posToVal(this.chart.plot.cursor.left, "x")));
    }
    const { nis, rms_m, inside } = figures(steps, updates), [low, high] = band(LESSON.steps);
    const right = nis >= low && nis <= high;
    replace(this.parts.figures, element("p", { class: right && inside > 0.97 ? "good" : "bad", id: "lesson-figures" }, say("lesson.figures", nis.toFixed(2), low.toFixed(2), high.toFixed(2), (100 * inside).toFixed(1), rms_m.toFixed(2))));
    this.renderStep();
  }
  openAt(time) {
    this.step = Math.min(LESSON.steps, Math.max(1, Math.round(time / LESSON.dt_s)));
    this.parent.querySelector("#lesson-step").value = this.step;
    this.renderStep();
  }
  renderStep() {
    this.stepShown.textContent = `${this.step} (${decimal((this.step * LESSON.dt_s).toFixed(1))} s)`;
    renderUpdate(this.parts.update, { ...this.updates[this.step - 1], model: "z" });
  }

  questions() {
    return ["prediction", "noise", "braking"].map((name) => {
      const input = element("input", { inputmode: "decimal", id: `answer-${name}`, value: this.answers[name] ?? "", "aria-label": say("lesson.answer"), oninput: () => (this.answers[name] = input.value) });
      const said = element("p", { role: "status", "data-graded": name });
      this.sayGraded(said, name);
      const button = element("button", { id: `grade-${name}`, onclick: async () => {
        this.graded[name] = await this.grade(name, Number(input.value.trim().replace(",", "."))).catch(({ message }) => ({ failed: message }));
        this.sayGraded(said, name);
      } }, say("lesson.grade"));
      return element("li", {}, element("p", {}, say(`lesson.ask.${name}`, short(HIDDEN.prediction.p0), short(LESSON.dt_s), short(LESSON.q))), element("div", { class: "controls" }, input, button), said);
    });
  }
  async grade(name, value) {
    if (!Number.isFinite(value) || value <= 0) return { key: "lesson.nonumber" };
    const base = { dt_s: LESSON.dt_s, p0: LESSON.p0, q: LESSON.q, r_m2: LESSON.r_m2 };
    if (name === "prediction") return gradePrediction(value, (await this.filter({ ...base, ...HIDDEN.prediction }, [{ z: 1 }]))[0]);
    const steps = drive(HIDDEN[name === "noise" ? "noise" : "brake"]);
    if (name === "noise") return gradeNoise(figures(steps, await this.filter({ ...base, r_m2: value }, steps)));
    const of = async (q) => figures(steps, await this.filter({ ...base, q }, steps));
    const grid = [];
    for (const q of GRID) grid.push((await of(q)).rms_m);
    return gradeBraking(await of(value), Math.min(...grid));
  }
  sayGraded(said, name) {
    const one = this.graded[name];
    if (!one) return;
    said.className = one.right ? "good" : "bad";
    const about = { prediction: () => say("lesson.graded.prediction"), noise: () => say("lesson.graded.noise", one.nis.toFixed(2), one.low.toFixed(2), one.high.toFixed(2)),
      braking: () => say("lesson.graded.braking", (100 * one.inside).toFixed(1), one.rms_m.toFixed(2), (1.25 * one.best_m).toFixed(2)) };
    said.textContent = one.key ? say(one.key) : one.failed ?? [say(one.right ? "lesson.right" : "lesson.wrong"), about[name](), one.right ? "" : say(`lesson.hint.${name}`)].join(" ");
  }
}
