// SPDX-License-Identifier: Apache-2.0
// The form of a recording in tables: what each column holds, in which unit, and what the recording does not say about its robot.
import { element, replace } from "./dom.js";
import { DESCRIBED, formOf, named, robotsFor } from "./tables.js";
import { shortest } from "./numbers.js";
import { say } from "./texts.js";
import { ofModule } from "./texts_module.js";
import { rowText } from "./texts_rows.js";

export class TablesView {
  /** `onLog(file, {robot, described})` gets the log that was made; `about` is the module's description; `onClose()`: the form was closed. */
  constructor(parent, tasks, about, onLog, onClose) {
    Object.assign(this, { parent, tasks, about, onLog, onClose });
  }
  async show(files) {
    Object.assign(this, { files, made: null, described: new Map(), robot: null });
    const about = await this.tasks.run("columns", { files, named: { columns: [], units: [] } });
    this.columns = about.files;
    this.rows = formOf(about);
    this.wrong = about.files.map(({ wrong }) => wrong).filter(Boolean).join("; ");
    this.order = robotsFor(this.about.robots, [...new Set(this.rows.map(({ sensor }) => sensor))].filter(Boolean).map((sensor) => ({ sensor })));
    this.robot = this.order[0].number;
    this.render();
    this.parent.hidden = false;
    this.parent.scrollIntoView({ block: "nearest" });
  }
  hide() {
    this.files = null;
    this.parent.hidden = true;
  }
  render() {
    if (!this.files || this.robot === null) return; // the columns of new files are still looked at
    const nothing = !this.rows.some(({ sensor }) => sensor);
    const robots = element("select", { id: "tables-robot", "aria-label": say("robot.label"), onchange: () => ((this.robot = Number(robots.value)), this.described.clear(), this.render()) },
      this.order.map(({ number, useless }) => element("option", { value: number, selected: number === this.robot }, `${this.about.robots[number].name}${useless ? ` – ${say("ask.useless")}` : ""}`)));
    replace(this.parent, element("h2", {}, say("tables.title")), element("p", { class: "note" }, say("tables.note", this.files.map(({ name }) => name).join(", "))),
      this.wrong ? element("p", { class: "bad", id: "tables-wrong" }, ofModule(this.wrong)) : nothing ? element("p", { class: "bad", id: "tables-nothing" }, say("tables.nothing")) : null,
      element("div", { class: "form" }, this.rows.filter(({ sensor }) => sensor).map((row) => this.row(row))),
      element("details", {}, element("summary", {}, say("tables.times")), element("div", { class: "form" }, this.rows.filter(({ sensor }) => !sensor).map((row) => this.row(row)))),
      element("h3", {}, say("tables.robot")), element("p", { class: "note" }, say("tables.robot.note")),
      element("div", { class: "form" }, element("label", { class: "field" }, element("span", {}, say("robot.label")), robots), this.fields()),
      element("div", { class: "buttons" }, element("button", { id: "tables-play", class: "go", disabled: nothing, onclick: () => this.play() }, say("tables.play")), element("button", { onclick: () => (this.hide(), this.onClose()) }, say("tables.close"))),
      this.made ? element("div", { id: "tables-made", role: "status" }, this.report()) : null);
  }
  /** A sensor of a file: its columns, and their unit. */
  row(row) {
    const unit = element("select", { "aria-label": say("tables.unit", row.kind), "data-unit": row.kind, onchange: () => (row.unit = unit.value) },
      [...new Set([row.unit, ...row.units])].filter(Boolean).map((name) => element("option", { value: name, selected: name === row.unit }, name)));
    const columns = this.columns.find(({ name }) => name === row.file).columns;
    return element("fieldset", { class: "field" }, element("legend", {}, `${row.file}: ${say(`column.${row.kind}`)}`),
      row.units.length > 1 ? element("label", {}, `${say("tables.in")} `, unit) : null,
      element("details", {}, element("summary", {}, row.fields.map(({ column }) => column).join(", ")), row.fields.map((field) => {
        const select = element("select", { "data-quantity": field.quantity, onchange: () => (field.column = select.value) }, columns.map((name) => element("option", { value: name, selected: name === field.column }, name)));
        return element("label", {}, `${field.quantity.split(".")[1] ?? field.quantity} `, select);
      })));
  }
  /** Numbers of the robot that a recording does not hold, of the sensors that this one has. */
  fields() {
    const there = new Set(this.rows.map(({ sensor }) => sensor)), robot = this.about.robots[this.robot];
    return DESCRIBED.filter(([sensors]) => sensors.some((sensor) => there.has(sensor))).map(([, path]) => {
      const i = this.about.parameters.findIndex((row) => row.path === path);
      if (i < 0) return null;
      const row = this.about.parameters[i], own = shortest(robot.values[i][0], row.storage);
      const input = element("input", { inputmode: "decimal", value: this.described.get(i) ?? own, "data-described": path, title: row.text, onchange: () => {
        const value = Number(input.value.trim().replace(",", "."));
        if (input.value.trim() === "" || Number.isNaN(value)) input.value = this.described.get(i) ?? own;
        else this.described.set(i, value);
      } });
      return element("label", { class: "field described" }, element("span", { class: "note" }, rowText(row)), element("code", {}, path), input, element("span", { class: "unit" }, row.unit));
    });
  }
  async play() {
    const described = [...this.described].map(([row, value]) => [row, 0, value]);
    try {
      if (described.length > 0) await this.tasks.run("check", { robot: this.robot, settings: described });
      const made = await this.tasks.run("importTables", { files: this.files, named: named(this.rows), base: 0x300 });
      this.made = made.about;
      this.wrong = "";
      this.render();
      const name = this.files.length === 1 ? this.files[0].name : `${this.files.length} tables`;
      await this.onLog(new File(made.frames, `${name.replace(/\.\w+$/, "")}.log`), { robot: this.robot, described });
    } catch (error) {
      this.wrong = error.message;
      this.render();
    }
  }
  report() {
    const { frames, rows, duration_s, sources, left_out: left, notes } = this.made;
    return [element("p", { class: "good" }, say("tables.made", frames, duration_s.toFixed(1), rows)),
      element("ul", {}, sources.map(({ sensor, columns, samples, rate_hz }) => element("li", {}, say("tables.source", sensor, samples, rate_hz.toFixed(1), ofModule(columns))))),
      left.length > 0 ? element("p", { class: "warning" }, say("tables.left", left.map(({ what, count }) => `${count} ${ofModule(what)}`).join("; "))) : null,
      notes.length > 0 ? element("p", { class: "note" }, notes.map(ofModule).join("; ")) : null];
  }
}
