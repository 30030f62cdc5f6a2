// SPDX-License-Identifier: Apache-2.0
// The worker: holds the compiled module and the log. Each task has an instance of its own, so none leaves anything
// behind for the next.
import { Engine, Refusal, CHANNEL } from "./engine.js";
import { Table } from "./columns.js";
import { tableOf } from "./thinning.js";

const TABLES = ["estimates.log", "estimates", "states", "innovations", "sensors", "status", "sources", "map", "keyframes", "graph"];

export class Tasks {
  constructor() {
    this.log = null;
    this.play = null; // an engine that lasts, with what it wrote since it was asked last
  }

  /** Bytes of a Blob, synchronously; a block is kept, because the module asks for less. */
  reader() {
    const size = 1 << 22, files = new FileReaderSync();
    let begin = 0, block = new Uint8Array(0);
    return (offset, length) => {
      if (offset < begin || offset + length > begin + block.length) {
        begin = offset;
        block = new Uint8Array(files.readAsArrayBuffer(this.log.slice(offset, offset + Math.max(size, length))));
      }
      return block.subarray(offset - begin, offset - begin + length);
    };
  }

  engine(onText = () => {}) {
    const read = this.log ? this.reader() : () => new Uint8Array(0);
    return new Engine(this.module, read, onText);
  }

  describe() {
    return this.engine().describe();
  }
  open({ log }) {
    this.log = log;
    return this.engine().identify();
  }
  diagnose({ robot, base, settings }) {
    const engine = this.engine();
    if (robot !== null) engine.choose(robot, settings);
    return engine.diagnose(base, robot !== null);
  }
  /** Columns of tables as their names and what the user has named show them; `files` [{name, bytes}]. */
  columns({ files, named }) {
    return this.engine().columns(files, named);
  }
  /** The tables as a log: {about, frames}. */
  importTables({ files, named, base }) {
    const frames = [], engine = this.engine((channel, data) => channel === CHANNEL.frames && frames.push(data.slice()));
    return { about: engine.importTables(files, named, base), frames };
  }
  /** Updates of the node's filters up to an epoch. */
  updates({ robot, base, settings, mode, time_s, span_s }) {
    const engine = this.engine();
    engine.choose(robot, settings);
    return engine.updates(base, mode, time_s, span_s);
  }
  /** Updates of the lesson's filter by these positions. */
  lesson({ numbers, positions }) {
    return this.engine().lesson(numbers, positions);
  }
  snapshotRequest({ base, counter }) {
    let line = "";
    this.engine((channel, data) => channel === CHANNEL.frames && (line = new TextDecoder().decode(data))).call("ask_snapshot", base, counter);
    return line.trim().split(" ")[2];
  }
  /** A node at a cable: `name` of the module's functions talk_*, what it says and the frames that it wants sent. "begin" begins anew. */
  talk({ function: name, values }) {
    if (name === "begin") {
      const told = [], lines = [], decoder = new TextDecoder();
      const engine = this.engine((channel, data) => {
        if (channel === CHANNEL.talk) told.push(data);
        else if (channel === CHANNEL.frames) lines.push(decoder.decode(data).trim().split(" ")[2]);
      });
      this.talking = { engine, told, lines };
    }
    const { engine, told, lines } = this.talking;
    engine.call(`talk_${name}`, ...values);
    return { told: told.splice(0), lines: lines.splice(0) };
  }
  check({ robot, settings }) {
    this.engine().choose(robot, settings);
    return true;
  }
  /** Tables and result; `progress(share)` as it goes. */
  replay({ robot, base, settings, mode, borrow = null }, progress) {
    const tables = TABLES.map(tableOf), fixes = new Table();
    let ticks = 0, epochs = 0;
    const engine = this.engine((channel, data) => {
      if (channel === CHANNEL.begun) ticks = data.ticks;
      else if (channel === CHANNEL.fixes) fixes.add(data);
      else if (channel < TABLES.length) {
        tables[channel].add(data);
        if (channel !== 1 || ticks === 0) return;
        const table = tables[1], now = table.rows > 0 ? table.values("epoch")[table.rows - 1] : 0;
        if (now > epochs + ticks / 50) progress((epochs = now) / ticks);
      }
    });
    engine.choose(robot, settings);
    if (borrow !== null) engine.call("borrow", borrow);
    const result = engine.replay(base, mode);
    const packed = { fixes: fixes.packed() };
    TABLES.forEach((name, i) => (packed[name] = tables[i].packed()));
    return { result, tables: packed };
  }

  /** A play from its beginning. */
  begin({ robot, seed }) {
    const tables = TABLES.map(() => new Table()), fixes = new Table(), truth = new Table(), frames = [];
    const engine = new Engine(this.module, () => new Uint8Array(0), (channel, data) => {
      if (channel === CHANNEL.frames) frames.push(data.slice());
      else if (channel === CHANNEL.fixes) fixes.add(data);
      else if (channel === CHANNEL.truth) truth.add(data);
      else if (channel < TABLES.length) tables[channel].add(data);
    });
    this.play = { engine, tables, fixes, truth, frames };
    return engine.play(robot, seed);
  }
  /** Rows and frames of these ticks. */
  advance({ ticks }) {
    const { engine, tables, fixes, truth, frames } = this.play;
    const played = engine.advance(ticks);
    const packed = { fixes: fixes.taken(), truth: truth.taken() };
    TABLES.forEach((name, i) => (packed[name] = tables[i].taken()));
    return { played, tables: packed, frames: frames.splice(0) };
  }
  inject({ fault, seconds }) {
    return this.play.engine.inject(fault, seconds);
  }
  script() {
    return this.play.engine.script();
  }

  async task({ id, name, module, ...values }) {
    if (module) return void (this.module = module);
    try {
      const done = this[name](values, (share) => postMessage({ id, share }));
      postMessage({ id, done }, transfers(done));
    } catch (error) {
      // A trap of the module is an error of WebAssembly: it ends the instance and nothing else.
      postMessage({ id, failed: String(error.message), refused: error instanceof Refusal, trapped: error instanceof WebAssembly.RuntimeError || error instanceof RangeError });
    }
  }
}

function transfers(done) {
  if (!done?.tables) return [];
  return Object.values(done.tables).flatMap(({ columns }) => columns.map(({ values }) => values.buffer));
}

if (typeof WorkerGlobalScope !== "undefined") {
  const worker = new Tasks();
  onmessage = ({ data }) => worker.task(data);
}
