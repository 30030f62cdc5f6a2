// SPDX-License-Identifier: Apache-2.0
// "Talk" at the cable: a node's rows, what a change will do before anything of it is sent, and the node's answer in words.
import { element, replace } from "./dom.js";
import { shortest, typed } from "./numbers.js";
import { BITRATES } from "./slcan.js";
import { Talk, TalkRefusal } from "./talk.js";
import { decimal, say } from "./texts.js";
import { ofModule } from "./texts_module.js";
import { rowText } from "./texts_rows.js";

const TALK_ROWS = 8;

export class TalkView {
  /** `about` is the module's description. */
  constructor(tasks, about) {
    Object.assign(this, { tasks, about, base: 0x300, filter: "", talk: null, said: null, busy: "", asks: false });
  }
  end() {
    this.talk?.end();
    Object.assign(this, { talk: null, said: null, busy: "", asks: false });
  }
  /** Runs `work`; its result, a key of texts with its values, or why it was refused is said. */
  async run(busy, work) {
    if (this.busy) return;
    Object.assign(this, { busy, said: null, asks: false });
    this.render();
    try {
      const [key, ...values] = await work();
      this.said = { good: true, key, values };
    } catch (error) {
      this.said = error instanceof TalkRefusal ? { key: error.key, values: error.values } : { key: "module", values: [error.message] };
    }
    this.busy = "";
    this.render();
  }
  read() {
    return this.run("talk.reading", async () => {
      this.talk?.end();
      this.talk = null;
      const talk = new Talk(this.cable, (name, ...values) => this.tasks.run("talk", { function: name, values }), this.about.parameters, { base: this.base });
      await talk.begin();
      await this.cable.channel(this.cable.command, false);
      await talk.read((share) => this.bar && (this.bar.value = share));
      this.talk = talk;
      return ["talk.read", talk.state.config];
    });
  }
  /** Back to listening: nothing is sent any more. */
  async listen() {
    this.end();
    await this.cable.channel(this.cable.command, true);
  }
  change() {
    return this.run("talk.changing", async () => {
      const { pending } = await this.talk.change();
      return [pending > 0 ? "talk.done.pending" : "talk.done", pending];
    });
  }
  save() {
    return this.run("talk.saving", async () => (await this.talk.save(), ["talk.saved"]));
  }
  /** Whether a Restore waits for the user's yes. */
  askRestore(asks) {
    Object.assign(this, { asks, said: null });
    this.render();
    this.parent.querySelector(asks ? "#talk-restore-keep" : "#talk-restore")?.focus({ preventScroll: true });
  }
  restore() {
    this.parent.querySelector("#talk-restore")?.focus({ preventScroll: true });
    return this.run("talk.restoring", async () => ["talk.restored", (await this.talk.restore()).pending]);
  }
  take(number, input) {
    const count = this.talk.state.rows[number].active.length, values = typed(input.value, count), given = values.filter((value) => !Number.isNaN(value)).length;
    return this.run("talk.checking", async () => {
      if (values.length !== count || given !== count) throw new TalkRefusal("wanted", this.about.parameters[number].path, count, given);
      await this.talk.want(number, values);
      return ["talk.wanted"];
    });
  }
  text(values, number) {
    return values.map((value) => shortest(value, this.about.parameters[number].storage)).join(" ");
  }
  /** The node, in words: which one a change is for. */
  device() {
    return say("talk.device", this.talk.base.toString(16).toUpperCase(), BITRATES[this.cable.command], this.talk.state.config);
  }

  render(parent = this.parent, cable = this.cable) {
    Object.assign(this, { parent, cable });
    if (!cable || cable.over) return replace(parent);
    const at = document.activeElement;
    if (parent.contains(at)) this.held = at.id ? `#${at.id}` : `[data-talk="${at.dataset.talk}"]`;
    else if (at !== document.body) this.held = null;
    const base = element("input", { id: "talk-base", value: this.base.toString(16).toUpperCase(), size: 4, spellcheck: "false", "aria-label": say("talk.base"), disabled: Boolean(this.busy), onchange: () => {
      const value = parseInt(base.value, 16);
      if (/^[0-9a-f]{1,3}$/i.test(base.value.trim()) && value % 128 === 0 && value <= 0x780) {
        if (value !== this.base) this.end(); // the rows of another node are read first
        this.base = value;
        this.render();
      } else base.value = this.base.toString(16).toUpperCase();
    } });
    const { said, busy } = this;
    this.bar = busy ? element("progress", { max: 1, "aria-label": say(busy) }) : null;
    replace(parent, element("h3", {}, say("talk.title")), element("p", { class: "note" }, say("talk.note")),
      element("div", { class: "controls" }, element("label", {}, `${say("talk.base")} `, base),
        element("button", { id: "talk-read", disabled: Boolean(busy), onclick: () => this.read() }, say(cable.listening ? "talk.leave" : "talk.again")),
        cable.listening ? null : element("button", { id: "talk-listen", disabled: Boolean(busy), onclick: () => this.listen() }, say("talk.listen"))),
      busy ? element("p", { id: "talk-busy" }, `${say(busy)} `, this.bar) : null,
      element("p", { id: "talk-said", role: "status", class: said?.good ? "good" : "bad" }, said ? this.words(said) : ""),
      this.talk && !cable.listening ? this.form() : null);
    this.renderRows();
    if (this.held) parent.querySelector(this.held)?.focus({ preventScroll: true });
  }
  words({ good, key, values }) {
    if (good) return say(key, ...values);
    return key === "module" ? ofModule(values[0]) : key === "wanted" ? say("numbers.wanted", ...values) : say(`talk.no.${key}`, ...values);
  }
  form() {
    const { busy } = this, changes = this.talk.changes();
    const find = element("input", { id: "talk-find", type: "search", value: this.filter, placeholder: say("numbers.find"), "aria-label": say("numbers.find"), oninput: () => ((this.filter = find.value), this.renderRows()) });
    this.list = element("div", { class: "rows" });
    return [find, this.list,
      changes.length > 0 ? this.listed("talk-changes", "talk.changes", changes) : null,
      element("div", { class: "buttons" },
        element("button", { id: "talk-change", class: "go", disabled: Boolean(busy) || changes.length === 0, onclick: () => this.change() }, say("talk.change")),
        element("button", { id: "talk-save", disabled: Boolean(busy), title: say("talk.save.note"), onclick: () => this.save() }, say("talk.save")),
        element("button", { id: "talk-restore", disabled: Boolean(busy), title: say("talk.restore.note"), onclick: () => this.askRestore(true) }, say("talk.restore"))),
      this.asks ? this.listed("talk-restore-sure", "talk.restore.ask", this.talk.restores(), element("div", { class: "buttons" },
        element("button", { id: "talk-restore-yes", class: "go", disabled: Boolean(busy), onclick: () => this.restore() }, say("talk.restore.yes")),
        element("button", { id: "talk-restore-keep", onclick: () => this.askRestore(false) }, say("talk.restore.keep")))) : null,
      element("p", { class: "note" }, say("talk.save.note"), " ", say("talk.restore.note"))];
  }
  /** Rows that a command will change, on which node. */
  listed(id, key, rows, ...more) {
    return element("div", { id, role: "group", "aria-label": say(key) }, element("p", {}, say(key)), element("p", { class: "note" }, this.device()),
      element("ul", {}, rows.length === 0 ? element("li", {}, say("talk.none")) : rows.map(({ number, old, next }) => element("li", {}, element("code", {}, this.about.parameters[number].path), ` ${decimal(this.text(old, number))} → `, element("strong", {}, `${decimal(this.text(next, number))} ${this.about.parameters[number].unit}`.trim()), this.about.parameters[number].live ? "" : `; ${say("numbers.restart")}`))), ...more);
  }
  /** Rows that differ from the compiled ones first, then those that are looked for. */
  renderRows() {
    if (!this.talk || !this.list) return;
    const { rows } = this.talk.state, all = this.about.parameters, words = this.filter.toLowerCase().split(/\s+/).filter(Boolean);
    const differs = (i) => this.text(rows[i].active, i) !== this.text(rows[i].compiled, i) || this.text(rows[i].wanted, i) !== this.text(rows[i].active, i);
    const found = all.map((_, i) => i).filter((i) => !all[i].secret && words.every((word) => `${all[i].path} ${all[i].text} ${rowText(all[i])}`.toLowerCase().includes(word)));
    found.sort((a, b) => differs(b) - differs(a) || rows[a].fixed - rows[b].fixed || a - b);
    replace(this.list, ...found.slice(0, TALK_ROWS).map((i) => this.row(i, rows[i])), found.length > TALK_ROWS ? element("p", { class: "note" }, say("numbers.more", found.length - TALK_ROWS)) : null);
  }
  row(i, { fixed, active, compiled, wanted }) {
    const row = this.about.parameters[i];
    const input = element("input", { value: this.text(wanted, i), inputmode: active.length > 1 ? "text" : "decimal", class: active.length > 3 ? "long" : "", "aria-label": row.path, "data-talk": row.path, disabled: fixed || Boolean(this.busy), onchange: () => this.take(i, input) });
    const limits = say("numbers.limits", shortest(row.minimum, "float"), shortest(row.maximum, "float"), row.unit).trim();
    return element("label", { class: this.text(active, i) === this.text(wanted, i) ? "row" : "row is-changed" }, element("code", {}, row.path), input, element("span", { class: "unit" }, row.unit),
      element("span", { class: "note" }, `${rowText(row)} ${limits}; ${say("talk.values", decimal(this.text(active, i)), decimal(this.text(compiled, i)))}${row.live ? "" : `; ${say("numbers.restart")}`}${fixed ? `; ${say("talk.fixed")}` : ""}`));
  }
}
