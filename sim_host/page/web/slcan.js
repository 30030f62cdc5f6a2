// SPDX-License-Identifier: Apache-2.0
// CAN over a serial line in the form of Lawicel's CANUSB (its manual, version 2: "t1232AABB\r"), as lines of candump -L.

const CR = 13, BELL = 7;
const HEX = new Int8Array(256).fill(-1);
for (const [i, c] of [..."0123456789ABCDEF"].entries()) HEX[c.charCodeAt(0)] = HEX[c.toLowerCase().charCodeAt(0)] = i;
const SMALL_T = 116, LARGE_T = 84, SMALL_R = 114, LARGE_R = 82;
const PIECE = 1 << 18;
export const BITRATES = { S4: 125, S5: 250, S6: 500, S8: 1000 }; // command: kbit/s

/** Lines of a log as they come, in blobs: outside of the heap of scripts. */
export class Recording {
  constructor() {
    this.pieces = [];
    this.text = "";
    this.size = 0;
  }
  add(line) {
    this.text += line;
    if (this.text.length >= PIECE) this.close();
  }
  close() {
    this.size += this.text.length;
    if (this.text) this.pieces.push(new Blob([this.text]));
    this.text = "";
  }
  file(name) {
    this.close();
    return new File(this.pieces, name);
  }
}

/** Bytes of the adapter, in pieces of any size, as frames. */
export class SlcanReader {
  /** `onLine(text)` gets a line of a log, `onAnswer(ok)` an adapter's answer to a command. */
  constructor(onLine, onAnswer = () => {}) {
    Object.assign(this, { onLine, onAnswer, buffer: new Uint8Array(64), length: 0, frames: 0, bad: 0, skipped: 0 });
  }
  /** `time_us` of their arrival. */
  take(bytes, time_us) {
    const stamp = `(${Math.floor(time_us / 1e6)}.${String(Math.floor(time_us % 1e6)).padStart(6, "0")}) slcan0 `;
    for (const byte of bytes) {
      if (byte === CR) this.end(stamp);
      else if (byte === BELL) (this.length = 0), this.onAnswer(false);
      else if (this.length < this.buffer.length) this.buffer[this.length++] = byte;
    }
  }
  end(stamp) {
    const { buffer, length } = this, kind = buffer[0];
    this.length = 0;
    if (length === 0) return this.onAnswer(true);
    if (kind === SMALL_R || kind === LARGE_R) return void this.skipped++;
    if (kind !== SMALL_T && kind !== LARGE_T) return this.onAnswer(true); // z, V1013, F00: an answer
    const digits = kind === SMALL_T ? 3 : 8, size = HEX[buffer[1 + digits]], data = 2 + digits;
    // Two or four more digits are a time stamp in milliseconds.
    const rest = length - data - 2 * size;
    if (length < data || size < 0 || size > 8 || (rest !== 0 && rest !== 4)) return void this.bad++;
    let text = stamp;
    for (let i = 1; i < data + 2 * size; i++) {
      if (HEX[buffer[i]] < 0) return void this.bad++;
      if (i === 1 + digits) text += "#";
      else text += String.fromCharCode(buffer[i]);
    }
    this.frames++;
    this.onLine(`${text.toUpperCase().replace("SLCAN0", "slcan0")}\n`);
  }
}

/** `heard(line)`, where it is set, gets each line of the recording as well. An adapter at a port of Web Serial ({open, close, readable, writable}): listens and records; sends nothing unless asked. */
export class Cable {
  constructor(port, { onChange = () => {}, now = () => performance.timeOrigin + performance.now() } = {}) {
    Object.assign(this, { port, onChange, now, recording: new Recording(), listening: true, refused: null, over: false });
    this.reader = new SlcanReader((line) => (this.recording.add(line), this.heard?.(line)), (ok) => this.answered?.(ok));
    this.turn = Promise.resolve(); // one command at a time: answers have no names
  }
  async open(command = "S6", listening = true) {
    await this.port.open({ baudRate: 115200, bufferSize: 1 << 20 });
    this.output = this.port.writable.getWriter();
    this.done = this.listen();
    await this.channel(command, listening);
  }
  /** Opens the adapter's channel: "L" listens without acknowledging, "O" takes part. */
  async channel(command, listening) {
    this.command = command;
    await this.tell("C");
    await this.tell(command);
    this.refused = (await this.tell(listening ? "L" : "O")) === false ? (listening ? "L" : "O") : null;
    this.listening = listening;
    this.onChange();
  }
  /** A command, and whether the adapter took it; null: it does not answer. */
  tell(command) {
    const told = this.turn.then(() => this.exchange(command));
    this.turn = told.catch(() => {});
    return told;
  }
  async exchange(command) {
    const answer = new Promise((done) => {
      const wait = setTimeout(() => done(null), 300);
      this.answered = (ok) => (clearTimeout(wait), done(ok));
    });
    await this.output.write(new TextEncoder().encode(`${command}\r`));
    const ok = await answer;
    this.answered = null;
    return ok;
  }
  /** One frame onto the bus: the only thing that this page ever sends. `line` "ID#DATA" of a log. */
  async send(line) {
    if (this.listening) await this.channel(this.command, false);
    if (this.refused) return false;
    const [id, data] = line.split("#");
    const frame = `t${id.padStart(3, "0")}${data.length / 2}${data}`;
    // An adapter that does not answer for its first frame is not waited for again.
    if (this.silent) return (this.turn = this.turn.then(() => this.output.write(new TextEncoder().encode(`${frame}\r`))).then(() => null, () => false));
    const ok = await this.tell(frame);
    this.silent ??= ok === null;
    return ok;
  }
  async listen() {
    this.input = this.port.readable.getReader();
    try {
      for (let next; !(next = await this.input.read()).done; ) this.reader.take(next.value, 1000 * this.now());
    } catch (error) {
      this.failed = error.message;
    }
    this.over = true;
    this.onChange();
  }
  async close() {
    await this.tell("C").catch(() => {});
    await this.input.cancel().catch(() => {});
    await this.done;
    this.input.releaseLock();
    this.output.releaseLock();
    await this.port.close().catch(() => {});
  }
}
