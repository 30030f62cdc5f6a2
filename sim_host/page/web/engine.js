// SPDX-License-Identifier: Apache-2.0
// The module that holds the flashed code: what it imports, and its functions with words for failures.

/** Channels of module/browser.hpp. Below 16: a table of a run. */
export const CHANNEL = { description: 16, refusal: 17, begun: 18, result: 19, diagnosis: 20, fixes: 21, log: 22, stage: 23, truth: 24, frames: 25, played: 26, injected: 27, script: 28, columns: 29, imported: 30, updates: 31, talk: 32 };
const RAW = new Set([CHANNEL.fixes, CHANNEL.truth, CHANNEL.frames]);
export const MODE = { automatic: 0, lockstep: 1, asRecorded: 3 };

/** What the module refuses: a sentence for people. */
export class Refusal extends Error {}

export class Engine {
  /**
   * @param module a compiled WebAssembly.Module; each engine is an instance with a memory of its own
   * @param read (offset, length) -> Uint8Array of the log, empty behind its end
   * @param onText (channel, Uint8Array that is valid during the call)
   */
  constructor(module, read, onText) {
    const decoder = new TextDecoder();
    const text = (bytes) => decoder.decode(bytes);
    this.refusal = "";
    this.objects = new Map();
    const memory = () => new Uint8Array(this.exports.memory.buffer);
    const imports = {
      tetap: {
        read: (offset, to, length) => {
          const bytes = read(offset, length);
          memory().set(bytes, to);
          return bytes.length;
        },
        write: (channel, from, length) => {
          const bytes = memory().subarray(from, from + length);
          if (channel === CHANNEL.refusal) this.refusal = text(bytes);
          else if (channel < 16 || RAW.has(channel)) onText(channel, bytes);
          else {
            const object = JSON.parse(text(bytes));
            this.objects.set(channel, object);
            onText(channel, object);
          }
        },
      },
      // The module has a clock for one question: whether a node in its own memory has stopped to answer.
      wasi_snapshot_preview1: {
        clock_time_get: (clock, precision, at) => {
          // Asked at every tick; below 2^53 a number in two halves needs no BigInt.
          const words = new DataView(this.exports.memory.buffer), ns = Math.round(performance.now() * 1e6);
          words.setUint32(at, ns % 2 ** 32, true);
          words.setUint32(at + 4, ns / 2 ** 32, true);
          return 0;
        },
        // Linked by the C library and never of use here: no file is open (EBADF), and nobody waits (ENOSYS).
        fd_close: () => 8,
        fd_seek: () => 8,
        fd_write: () => 8,
        poll_oneoff: () => 52,
      },
    };
    this.exports = new WebAssembly.Instance(module, imports).exports;
    this.exports._initialize?.();
  }

  /** Calls a function of the module. @throws Refusal */
  call(name, ...values) {
    this.refusal = "";
    if (this.exports[name](...values)) throw new Refusal(this.refusal);
  }

  describe() {
    this.exports.describe();
    return this.objects.get(CHANNEL.description);
  }

  /** The robot of that number with these settings: [[row, element, value], ...]. @throws Refusal */
  choose(robot, settings = []) {
    this.call("choose", robot);
    for (const [row, element, value] of settings) this.call("set", row, element, value);
    this.call("check");
  }

  /** Id base of the log, hash of its node's parameters, kinds of its frames. @throws Refusal */
  identify() {
    this.call("identify");
    return this.objects.get(CHANNEL.log);
  }

  /** Plays the log; the tables come by onText. @throws Refusal */
  replay(base, mode = MODE.automatic) {
    this.call("replay", base, mode, 1);
    return { ...this.objects.get(CHANNEL.begun), ...this.objects.get(CHANNEL.result) };
  }

  /** The robot of that number in the simulated world, from the beginning: what there is to play with. @throws Refusal */
  play(robot, seed) {
    this.call("play", robot, seed);
    return this.objects.get(CHANNEL.stage);
  }
  /** So many ticks of 10 ms; tables, truth and frames come by onText. @throws Refusal */
  advance(ticks) {
    this.call("advance", ticks);
    return this.objects.get(CHANNEL.played);
  }
  /** A fault from now on. @throws Refusal */
  inject(fault, seconds) {
    this.call("inject", fault, Math.round(1000 * seconds));
    return this.objects.get(CHANNEL.injected);
  }
  /** The run up to now: its script, and the hash of its estimates. @throws Refusal */
  script() {
    this.call("script");
    return this.objects.get(CHANNEL.script);
  }

  /** A text into the module's memory. */
  text(bytes) {
    const from = typeof bytes === "string" ? new TextEncoder().encode(bytes) : bytes, to = this.exports.room(from.length);
    new Uint8Array(this.exports.memory.buffer).set(from, to);
  }
  /** `files` [{name, bytes}], `named` {columns: [[quantity, column]], units: [[quantity, unit]]}. @throws Refusal */
  tables(files, { columns, units }) {
    for (const { name, bytes } of files) this.text(name), this.text(bytes), this.call("add_table");
    for (const [quantity, column] of columns) this.text(quantity), this.text(column), this.call("name_column");
    for (const [quantity, unit] of units) this.text(quantity), this.text(unit), this.call("name_unit");
  }
  columns(files, named) {
    this.tables(files, named);
    this.exports.columns();
    return this.objects.get(CHANNEL.columns);
  }
  /** Tables as a log, whose lines come by onText. @throws Refusal */
  importTables(files, named, base) {
    this.tables(files, named);
    this.call("import_tables", base);
    return this.objects.get(CHANNEL.imported);
  }
  /** Updates of the node's filters in `span_s` before the end of the epoch at `time_s`. @throws Refusal */
  updates(base, mode, time_s, span_s) {
    this.call("updates", base, mode, 1, time_s, span_s);
    return this.objects.get(CHANNEL.updates);
  }
  /** An update of the lesson's filter for each position. @throws Refusal */
  lesson({ dt_s, p0, q, r_m2, gate = 0 }, positions) {
    this.call("begin_lesson", dt_s, p0, q, r_m2, gate);
    return positions.map((z) => (this.call("step_lesson", z), this.objects.get(CHANNEL.updates)[0]));
  }

  /** @throws Refusal */
  diagnose(base, ofRobot) {
    this.call("diagnose", base, ofRobot ? 1 : 0, 1);
    return this.objects.get(CHANNEL.diagnosis);
  }
}
