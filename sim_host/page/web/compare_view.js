// SPDX-License-Identifier: Apache-2.0
// Every estimator on this log, side by side.
import { element, replace } from "./dom.js";
import { contestants, distinct, lines, ranked } from "./compare.js";
import { MODE } from "./engine.js";
import { Run } from "./run.js";
import { decimal, say } from "./texts.js";

const number = (x, digits = 2) => (x == null || Number.isNaN(x) ? "–" : decimal(x.toFixed(digits)));

export class CompareView {
  /** `costs` {kind: {instructions, rows}} of the page. */
  constructor(tasks, about, costs) {
    Object.assign(this, { tasks, about, costs, found: null, at: 0 });
  }
  /** Runs of all, one after another; `task(extra)` of the app. */
  async run(robot, inputs, task, truth, progress) {
    const all = contestants(this.about.robots, robot, inputs), mine = (this.running = {}), found = [];
    this.refused = [];
    const instructions = Object.fromEntries(Object.entries(this.costs).map(([kind, one]) => [kind, one.instructions]));
    for (const [i, borrow] of all.entries()) {
      progress(i / all.length);
      try {
        const played = await this.tasks.run("replay", task({ mode: MODE.lockstep, borrow }));
        if (mine !== this.running) return;
        found.push(...lines({ result: played.result, tables: new Run(played).tables }, this.about.robots[borrow], truth, instructions));
      } catch (error) {
        this.refused.push(`${this.about.robots[borrow].name}: ${error.message}`);
      }
    }
    this.found = ranked(distinct(found));
  }
  forget() {
    this.found = this.running = null;
  }
  render(parent, onRun) {
    const button = element("button", { id: "compare-run", onclick: async () => {
      button.disabled = true;
      await onRun((share) => (button.textContent = say("compare.running", Math.round(100 * share))));
    } }, say("compare.run"));
    if (!this.found) return replace(parent, button);
    const truth = this.found.some((one) => one.truth);
    const heads = [say("compare.estimator"), say("robot.label"), ...(truth ? [say("compare.rms"), say("compare.nees")] : []), say("compare.likelihood"), say("compare.fixes"), say("compare.nis"), say("compare.refused"), say("compare.ram"), say("compare.instructions")];
    replace(parent, element("div", { class: "wide", tabindex: "0", role: "region", "aria-label": say("compare.title") }, element("table", { id: "compare-table" },
      element("thead", {}, element("tr", {}, heads.map((head) => element("th", { scope: "col" }, head)))),
      element("tbody", {}, this.found.map((one) => element("tr", {}, element("th", { scope: "row" }, say(`kind.${one.kind}`)), element("td", { class: "names" }, one.robots.join(", ")),
        truth ? [element("td", {}, number(one.truth?.rms_m, 3)), element("td", {}, number(one.truth?.nees))] : null,
        element("td", {}, number(one.fixes?.likelihood)), element("td", {}, number(one.fixes?.rms_m, 3)), element("td", {}, number(one.records?.nis)), element("td", {}, one.records ? `${number(100 * one.records.refused, 1)} %` : "–"),
        element("td", {}, String(one.bytes)), element("td", { title: this.costs[one.kind]?.rows ?? "" }, one.instructions === null ? "–" : String(one.instructions))))))),
    element("p", { class: "note" }, say(truth ? "compare.note.truth" : "compare.note")), element("p", { class: "note" }, say("compare.same")), element("p", { class: "note" }, say("compare.cost.note")),
    this.refused.length > 0 ? element("p", { class: "warning" }, say("compare.failed", this.refused.join("; "))) : null);
  }
}
