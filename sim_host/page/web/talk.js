// SPDX-License-Identifier: Apache-2.0
// Parameters of a running node over a cable: what is asked, how long, and how often again. The module has the frames and the sets.

const ATTEMPTS = 5, PATIENCE = 300, SAVE_PATIENCE = 10_000; // ms; flash may be erased before a save's answer
const AT_ONCE = 6; // a node answers one a tick, and keeps eight
const REST = 1000; // ms without motion before a change, as a node wants before a save
export const SOURCE = { active: 0, staged: 1, compiled: 2 };
export const COMMAND = { apply: 1, save: 2, restore: 3 };
const ACCESS = { open: 0, authenticated: 1 };
const DONE = 0, UNKNOWN = 1, OTHER_ACTIVE = 4;

/** Why something was not done: a key of texts "talk.no.…", with what belongs into it. Text of the module is `key` "module". */
export class TalkRefusal extends Error {
  constructor(key, ...values) {
    super(`${key} ${values.join(" ")}`.trim());
    Object.assign(this, { key, values });
  }
}

export class Talk {
  /**
   * @param cable of slcan.js, open
   * @param ask (name, ...values) -> promise of {told: [objects], lines: ["ID#DATA"]} of the module's function talk_<name>
   * @param rows the module's table of parameters, for their names
   */
  constructor(cable, ask, rows, { now = () => performance.now(), base = 0x300, patience = PATIENCE } = {}) {
    Object.assign(this, { cable, ask, rows, now, base, patience, counter: 0, waiting: [], heard: Promise.resolve(), looked: new Map(), motion_at: -Infinity, moved_at: -Infinity });
  }
  async begin() {
    const { answers, motions, words } = (await this.module("begin", this.base)).told[0];
    Object.assign(this, { words, ids: new Map([[answers, "answer"], ...motions.map((id) => [id, "motion"])]) });
    this.cable.heard = (line) => this.hear(line);
  }
  end() {
    this.cable.heard = null;
  }
  async module(name, ...values) {
    try {
      return await this.ask(name, ...values);
    } catch (error) {
      throw error.refused || error.name === "Refusal" ? new TalkRefusal("module", error.message) : error;
    }
  }
  /** A line of the recording; frames of the node that this is about go to the module, in their order. */
  hear(line) {
    const [id, data] = line.slice(line.lastIndexOf(" ") + 1).trim().split("#"), kind = id.length === 3 ? this.ids.get(parseInt(id, 16)) : undefined;
    if (!kind || data.length !== 16) return;
    // Motion is looked at ten times a second.
    if (kind === "motion" && this.now() - (this.looked.get(id) ?? -Infinity) < 100) return;
    const at = this.now();
    if (kind === "motion") this.looked.set(id, at);
    const half = (at) => parseInt(data.slice(at, at + 8).match(/../g).reverse().join(""), 16);
    this.heard = this.heard.then(() => this.module("hear", parseInt(id, 16), half(0), half(8))).then(({ told }) => told.forEach((one) => this.take(one, at))).catch(() => {});
  }
  /** What the module read in a frame that was heard `at`; motion counts as seen once it could be read. */
  take(told, at) {
    if ("moves" in told) {
      this.motion_at = at;
      if (told.moves) this.moved_at = at;
    } else for (const one of [...this.waiting]) if (one.fits(told)) this.waiting.splice(this.waiting.indexOf(one), 1), one.done(told);
  }
  /** A promise of the answer that `fits`, null after so long. */
  answer(fits, patience) {
    return new Promise((resolve) => {
      const one = { fits, done: (told) => (clearTimeout(timer), resolve(told)) };
      const timer = setTimeout(() => (this.waiting.splice(this.waiting.indexOf(one), 1), resolve(null)), patience);
      this.waiting.push(one);
    });
  }
  /** Nothing is sent before the user has left listen-only. */
  async send(line) {
    if (this.cable.listening) throw new TalkRefusal("listening");
    if (this.cable.over || (await this.cable.send(line)) === false) throw new TalkRefusal("adapter");
  }
  next() {
    return (this.counter = (this.counter + 1) % 16);
  }

  /** Asks for words by `make(number, word)`, and again for those that are not answered. */
  async exchange(words, source, make, progress) {
    for (let first = 0; first < words.length; first += AT_ONCE) {
      let open = words.slice(first, first + AT_ONCE);
      for (let attempt = 0; open.length > 0; attempt++) {
        const path = this.rows[open[0][0]].path;
        if (attempt === ATTEMPTS) throw new TalkRefusal("silent", path);
        const answers = [];
        for (const [number, word] of open) {
          answers.push(this.answer((told) => told.asked && told.number === number && told.word === word && told.source === source, this.patience));
          await this.send((await make(number, word)).lines[0]);
        }
        const told = await Promise.all(answers);
        for (const one of told) if (one && one.answer !== DONE) throw new TalkRefusal(one.answer === UNKNOWN ? "unknown" : `row${one.answer}`, this.rows[one.number].path);
        open = open.filter((_, i) => !told[i]);
      }
      progress?.(Math.min(1, (first + AT_ONCE) / words.length));
    }
  }
  fetch(source, progress) {
    return this.exchange(this.words, source, (number, word) => this.module("get", number, word, source, this.next()), progress);
  }
  /** All sets of the node: {config, access, rows: [{fixed, active, compiled, wanted}]}. `progress(share)` as it goes. */
  async read(progress = () => {}) {
    const all = [SOURCE.active, SOURCE.staged, SOURCE.compiled];
    for (const [i, source] of all.entries()) await this.fetch(source, (share) => progress((i + share) / all.length));
    await this.module("want_staged");
    return this.values();
  }
  async values() {
    return (this.state = (await this.module("values")).told[0]);
  }
  /** Wanted values of a row. @throws TalkRefusal beyond its limits, then nothing of it is wanted */
  async want(number, values) {
    if (this.state.rows[number].fixed) throw new TalkRefusal("row3", this.rows[number].path);
    const before = this.state.rows[number].wanted;
    try {
      for (const [i, value] of values.entries()) await this.module("want", number, i, value);
    } catch (error) {
      for (const [i, value] of before.entries()) await this.module("want", number, i, value);
      const { path, minimum, maximum, unit } = this.rows[number];
      throw values.every((value) => value >= minimum && value <= maximum) ? error : new TalkRefusal("limits", path, minimum, maximum, unit && ` ${unit}`);
    }
    return this.values();
  }
  /** [{number, old, next}] of all that an Apply will change; what others have staged is among it. */
  changes() {
    return this.state.rows.flatMap(({ active, wanted }, number) => (active.some((value, i) => value !== wanted[i]) ? [{ number, old: active, next: wanted }] : []));
  }
  /** [{number, old, next}] of all that a Restore will change. */
  restores() {
    return this.state.rows.flatMap(({ active, compiled }, number) => (active.some((value, i) => value !== compiled[i]) ? [{ number, old: active, next: compiled }] : []));
  }
  /** @throws TalkRefusal where the vehicle moves, or may do so */
  mayChange() {
    if (this.state.access === ACCESS.authenticated) throw new TalkRefusal("key");
    if (this.state.access !== ACCESS.open) throw new TalkRefusal("commands");
    if (this.now() - this.moved_at < REST) throw new TalkRefusal("moves");
    if (this.now() - this.motion_at > REST) throw new TalkRefusal("blind");
  }
  /** The wanted set becomes active, all of it or nothing: the node's answer. */
  async change() {
    this.mayChange();
    const { words } = (await this.module("check")).told[0];
    await this.exchange(words, SOURCE.staged, (number, word) => this.module("set", number, word, this.next()));
    this.mayChange(); // it may have begun to move meanwhile
    const told = await this.act(COMMAND.apply, this.patience, ({ wanted }) => wanted);
    return this.readAgain(told);
  }
  async save() {
    this.mayChange();
    return this.act(COMMAND.save, SAVE_PATIENCE, () => false);
  }
  async restore() {
    this.mayChange();
    return this.readAgain(await this.act(COMMAND.restore, this.patience, () => false));
  }
  async readAgain(told) {
    for (const source of [SOURCE.active, SOURCE.staged]) await this.fetch(source);
    await this.module("want_staged");
    await this.values();
    return told;
  }
  /** `obeyed(answer)`: a refused attempt shows that an earlier one was obeyed, whose answer was lost. */
  async act(page, patience, obeyed) {
    for (let attempt = 0; attempt < ATTEMPTS; attempt++) {
      const counter = this.next(), answer = this.answer((told) => told.page === page && told.counter === counter, patience);
      await this.send((await this.module("act", page, counter)).lines[0]);
      const told = await answer;
      if (!told) continue;
      if (told.answer === DONE || (attempt > 0 && obeyed(told))) return told;
      // An attempt before it may have been obeyed, with rows that wait for a restart.
      throw new TalkRefusal(attempt > 0 && told.answer === OTHER_ACTIVE ? "unanswered" : `set${told.answer}`);
    }
    throw new TalkRefusal("unanswered");
  }
}
