// SPDX-License-Identifier: Apache-2.0
// Change a number: rows of the parameter table, what was changed, the parameter file.
import { element, replace, save } from "./dom.js";
import { textOf } from "./settings_text.js";
import { decimal, say } from "./texts.js";
import { rowText } from "./texts_rows.js";

const SHOWN = 8;
/** Rows that a user tries first, in this order. */
const FIRST = ["gnss.sigma_scale", "gnss.gate_scale", "inertial.gyro_radps_rthz", "inertial.accel_mps2_rthz", "wheels.drive.left_radius_m", "wheels.drive.track_m", "inertial.wheel_mps", "gnss.sigma_floor_m"];

/** Decimals that read back as the same stored bits. */
export function shortest(value, storage) {
  if (storage !== "float") return String(value);
  for (let digits = 1; digits < 10; digits++) {
    const text = String(+value.toPrecision(digits));
    if (Math.fround(Number(text)) === Math.fround(value)) return text;
  }
  return String(value);
}

/** What was typed for `count` numbers: spaces lie between them, or commas; of a single one, and beside spaces, a comma is its decimal point. */
export function typed(text, count) {
  const parts = text.trim().split(/[\s;]+/).map((part) => part.replace(/,$/, "")), alone = parts.length === 1 && count > 1;
  return (alone ? parts[0].split(",") : parts.map((part) => part.replace(",", "."))).map((part) => (part === "" ? NaN : Number(part)));
}

export class Numbers {
  /** `onChange` is called after each change; `rows` and `robot.values` are of the module's description. */
  constructor(rows, onChange) {
    this.rows = rows;
    this.onChange = onChange;
    this.changed = new Map(); // row -> [value of each element]
    this.filter = "";
  }
  of(robot) {
    this.robot = robot;
    this.changed.clear();
  }
  value(row) {
    return this.changed.get(row) ?? this.robot.values[row];
  }
  /** For Engine.choose. */
  settings() {
    return [...this.changed].flatMap(([row, values]) => values.map((value, element) => [row, element, value]));
  }
  /** {path: values} of what is changed, and the same taken back in place of what was changed; of what this page does not know nothing. */
  named() {
    return Object.fromEntries([...this.changed].map(([row, values]) => [this.rows[row].path, values]));
  }
  takeNamed(values) {
    this.changed.clear();
    this.rows.forEach(({ path }, row) => {
      const own = this.robot.values[row], given = Object.hasOwn(values, path) ? values[path] : null;
      if (Array.isArray(given) && given.length === own.length && given.every((value) => typeof value === "number")) this.changed.set(row, given);
    });
  }
  /** These rows beside what is changed already, as a finding of the doctor gives them: [{path, values}]. */
  add(remedy) {
    for (const { path, values } of remedy) {
      const row = this.rows.findIndex((one) => one.path === path);
      if (row >= 0 && values.length === this.robot.values[row].length) this.changed.set(row, values);
    }
  }
  text(row) {
    return this.value(row).map((value) => shortest(value, this.rows[row].storage)).join(" ");
  }
  /** `path = value` lines, as tetap-play --params takes them. */
  file() {
    return [`# ${this.robot.name}`, ...[...this.changed.keys()].map((row) => `${this.rows[row].path} = ${this.text(row)}`), ""].join("\n");
  }

  /** `onText(text)` is given settings that the user pastes; its promise says whether they are some. */
  render(parent, message, onText) {
    this.list = element("div", { class: "rows" });
    const find = element("input", { type: "search", value: this.filter, placeholder: say("numbers.find"), "aria-label": say("numbers.find"),
      oninput: () => ((this.filter = find.value), this.renderRows()) });
    const words = [...this.changed.keys()].map((row) => `${this.rows[row].path} = ${this.text(row)}`).join(", ");
    replace(parent, find, this.list,
      this.changed.size > 0 && element("p", { class: "changed" }, say("numbers.changed", words)) || null,
      message && element("p", { class: "effect", id: "effect", role: "status" }, message) || null,
      element("div", { class: "buttons" },
        element("button", { onclick: () => (this.changed.clear(), this.onChange()), disabled: this.changed.size === 0 }, say("numbers.reset")),
        element("button", { onclick: () => save(`${this.robot.name}.params`, this.file()), disabled: this.changed.size === 0 }, say("numbers.save"))), this.exchange(onText));
    this.renderRows();
  }

  /** Settings as text: to copy, and to take. */
  exchange(onText) {
    const said = element("span", { role: "status", class: "note" });
    const text = element("input", { id: "settings", value: textOf(this.robot.name, this.named()), "aria-label": say("numbers.text"), spellcheck: "false",
      onfocus: () => text.select(), onchange: async () => (await onText(text.value)) || (said.textContent = say("numbers.nosettings")) });
    return element("label", { class: "settings" }, `${say("numbers.text")} `, text, said);
  }

  renderRows() {
    const words = this.filter.toLowerCase().split(/\s+/).filter(Boolean);
    const all = this.rows.map((row, i) => i).filter((i) => !this.rows[i].secret);
    const found = words.length === 0
      ? FIRST.map((path) => this.rows.findIndex((row) => row.path === path)).filter((i) => i >= 0)
      : all.filter((i) => words.every((word) => `${this.rows[i].path} ${this.rows[i].text} ${rowText(this.rows[i])}`.toLowerCase().includes(word)));
    const rest = (words.length === 0 ? all.length : found.length) - Math.min(found.length, SHOWN);
    replace(this.list, ...found.slice(0, SHOWN).map((i) => this.row(i)), rest > 0 ? element("p", { class: "note" }, say("numbers.more", rest)) : null);
  }

  row(i) {
    const row = this.rows[i], own = this.robot.values[i];
    const said = element("span", { class: "bad", role: "alert" });
    const input = element("input", { value: this.text(i), inputmode: own.length > 1 ? "text" : "decimal", class: own.length > 3 ? "long" : "", "aria-label": row.path, "data-path": row.path, onchange: () => (said.textContent = this.take(i, input)) });
    const limits = say("numbers.limits", shortest(row.minimum, "float"), shortest(row.maximum, "float"), row.unit).trim();
    return element("label", { class: this.changed.has(i) ? "row is-changed" : "row" },
      element("code", {}, row.path), input, element("span", { class: "unit" }, row.unit),
      element("span", { class: "note" }, `${rowText(row)} ${limits}; ${say("numbers.own", own.map((value) => decimal(shortest(value, row.storage))).join(" "))}${row.live ? "" : `; ${say("numbers.restart")}`}`), said);
  }

  /** Takes what was typed, or says what is wanted. */
  take(i, input) {
    const own = this.robot.values[i], values = typed(input.value, own.length), given = values.filter((value) => !Number.isNaN(value)).length;
    if (values.length !== own.length || given !== own.length) return say("numbers.wanted", this.rows[i].path, own.length, given);
    if (values.every((value, k) => shortest(value, this.rows[i].storage) === shortest(own[k], this.rows[i].storage))) this.changed.delete(i);
    else this.changed.set(i, values);
    this.onChange();
    return "";
  }
}
