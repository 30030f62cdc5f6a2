// SPDX-License-Identifier: Apache-2.0
// A robot of the page's module at the far end of an slcan adapter: its node has the flashed code, and drives in the simulated world.
import { readFileSync } from "node:fs";
import { gunzipSync } from "node:zlib";
import "./globals.mjs";
import { Tasks } from "../web/worker.js";

globalThis.FileReaderSync ??= class {};

/** The module of a packed page, or of a file .wasm. */
export function moduleOf(path) {
  const bytes = readFileSync(path);
  if (path.endsWith(".wasm")) return new WebAssembly.Module(bytes);
  return new WebAssembly.Module(gunzipSync(Buffer.from(bytes.toString("latin1").match(/id="module">([^<]*)</)[1], "base64")));
}

/** `lose(line)` says of a frame "ID#DATA", in either direction, whether it is lost. */
export class Bench {
  constructor(module, robot, { lose = () => false } = {}) {
    Object.assign(this, { lose, said: [], sent: [], tasks: Object.assign(new Tasks(), { module }) });
    this.about = this.tasks.describe();
    this.robot = this.about.robots.findIndex(({ name }) => name === robot);
    this.restart();
    this.port = { open: async () => {}, close: async () => {} };
    this.port.readable = new ReadableStream({ start: (controller) => (this.input = controller) });
    this.port.writable = new WritableStream({ write: (chunk) => new TextDecoder().decode(chunk).split("\r").filter(Boolean).forEach((command) => this.command(command)) });
  }
  /** The robot stands at its start, and its node was switched on. */
  restart() {
    this.time_ms = 0;
    this.tasks.begin({ robot: this.robot, seed: 1 });
  }
  /** What the adapter is told. */
  command(command) {
    this.said.push(command);
    this.input?.enqueue(new TextEncoder().encode(command[0] === "t" ? "z\r" : "\r"));
    if (command[0] !== "t") return;
    const id = command.slice(1, 4), data = command.slice(5), half = (at) => parseInt(data.slice(at, at + 8).match(/../g).reverse().join(""), 16);
    this.sent.push(`${id}#${data}`);
    if (!this.lose(`${id}#${data}`)) this.tasks.play.engine.call("hand", parseInt(id, 16), half(0), half(8));
  }
  /** So many ticks of 10 ms; what is on the bus then, as lines "ID#DATA". */
  advance(ticks) {
    this.time_ms += 10 * ticks;
    const { frames } = this.tasks.advance({ ticks }), decoder = new TextDecoder();
    return frames.map((bytes) => decoder.decode(bytes)).join("").trimEnd().split("\n").map((line) => line.split(" ")[2]).filter(Boolean);
  }
  /** Into the adapter, and from it into the page. */
  feed(lines) {
    const heard = lines.filter((line) => !this.lose(line)).map((line) => line.split("#")).map(([id, data]) => `t${id}${data.length / 2}${data}\r`);
    this.input?.enqueue(new TextEncoder().encode(heard.join("")));
    return heard.length;
  }
  /** The bus goes on: seven ticks behind frames that were sent, which is time for the answers to six; slowly else. */
  run() {
    let sent = 0, calls = 0;
    this.timer = setInterval(() => {
      const asked = this.sent.length > sent;
      sent = this.sent.length;
      if (asked || ++calls % 20 === 0) this.feed(this.advance(asked ? 7 : 1));
    }, 1);
  }
  stop() {
    clearInterval(this.timer);
  }
}
