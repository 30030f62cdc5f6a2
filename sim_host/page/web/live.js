// SPDX-License-Identifier: Apache-2.0
// A play as it grows: its tables, its errors against the truth, and what the node said, in order.
import { Table } from "./columns.js";
import { Run } from "./run.js";

/** Of a state: its table, its sigma, and the truth's column. */
const ERRORS = { x_m: ["estimates", "std_x_m", "x_m"], y_m: ["estimates", "std_y_m", "y_m"], yaw_rad: ["estimates", "std_yaw_rad", "yaw_rad"], height_m: ["states", "std_height_m", "z_m"] };
/** A refusal is said again when its source was not refused for so long. */
const QUIET_S = 2;
/** A fault of the node is said again when it was not set for so long, or the user has pressed something meanwhile. */
const CLEAR_S = 5;

const wrapped = (angle) => angle - 2 * Math.PI * Math.round(angle / (2 * Math.PI));

export class Live {
  /** `start_s`: time of the bus when the play begins; all times that are said count from it. */
  constructor({ start_s }) {
    this.start = start_s;
    this.tables = {};
    this.frames = [];
    this.said = [];
    this.played = { time_s: 0, over: false };
    this.mode = "";
    this.faults = 0;
    this.faulted = new Map(); // bit -> time when it was set last
    this.states = new Map(); // source -> word
    this.refused = new Map(); // source -> time of the last refusal
    this.read = { status: 0, sources: 0, innovations: 0 };
  }

  /** What Tasks.advance gives. */
  take({ played, tables, frames }) {
    this.played = played;
    this.frames.push(...frames);
    for (const [name, rows] of Object.entries(tables)) (this.tables[name] ??= new Table()).append(rows);
  }
  /** The run up to now, for the pictures. */
  run() {
    const { truth, ...tables } = this.tables;
    const run = new Run({ result: { origin: this.played.origin }, tables });
    this.hear(run.estimator);
    return run;
  }
  truth() {
    const truth = this.tables.truth;
    return { t: truth.values("time_s"), x: truth.values("x_m"), y: truth.values("y_m"), yaw: truth.values("yaw_rad") };
  }

  /** [times, error, 3 sigma] where sigma is published and the pose is valid; `name` is a key of ERRORS. The truth has a row for each epoch. */
  errors(name, run) {
    const [from, std, real] = ERRORS[name], table = this.tables[from], [epoch, number, value, sigma] = ["epoch", "estimator", name, std].map((column) => table.values(column));
    const valid = from === "estimates" ? table.values("pos_valid") : null, truth = this.tables.truth.values(real), times = this.tables.truth.values("time_s");
    const t = [], error = [], band = [];
    for (let row = 0; row < table.rows; row++) {
      const k = epoch[row] - 1;
      if (number[row] !== run.estimator || (valid && !(valid[row] > 0)) || Number.isNaN(sigma[row]) || Number.isNaN(value[row]) || Number.isNaN(truth[k])) continue;
      const d = value[row] - truth[k];
      t.push(times[k] - this.start), error.push(name === "yaw_rad" ? wrapped(d) : d), band.push(3 * sigma[row]);
    }
    return [t, error, band];
  }

  /** Share of the epochs up to now at which the estimator gave no position. */
  unknown(run) {
    const table = this.tables.estimates, number = table.values("estimator"), valid = table.values("pos_valid");
    let all = 0, none = 0;
    for (let row = 0; row < table.rows; row++) if (number[row] === run.estimator) all++, valid[row] > 0 || none++;
    return all > 0 ? none / all : 1;
  }

  say(time, what) {
    this.said.push({ time: Math.max(0, time - this.start), ...what });
  }
  /** Mode, faults, states of sources and refusals that are new since the last time, each with what has changed. */
  hear(estimator) {
    const begun = this.said.length;
    this.hearStatus();
    this.hearSources(estimator);
    this.hearRefusals(estimator);
    const fresh = this.said.splice(begun).sort((a, b) => a.time - b.time);
    this.said.push(...fresh);
  }
  rows(name, each) {
    const table = this.tables[name];
    for (; this.read[name] < table.rows; this.read[name]++) each(table, this.read[name], table.values("time_s")[this.read[name]]);
  }
  hearStatus() {
    this.rows("status", (table, row, time) => {
      const mode = table.word("mode", row), faults = table.values("faults")[row];
      if (mode !== this.mode) this.say(time, { kind: "mode", word: mode });
      for (let bit = 0; bit < 16; bit++) {
        if (!((faults >> bit) & 1)) continue;
        if (!((this.faults >> bit) & 1) && time - (this.faulted.get(bit) ?? -Infinity) >= CLEAR_S) this.say(time, { kind: "fault", bit });
        this.faulted.set(bit, time);
      }
      this.mode = mode;
      this.faults = faults;
    });
  }
  hearSources(estimator) {
    this.rows("sources", (table, row, time) => {
      if (table.values("estimator")[row] !== estimator) return;
      const source = table.word("source", row), word = table.word("state", row);
      const before = this.states.get(source);
      this.states.set(source, word);
      if (before === word || (before === undefined && word === "Stopped")) return; // a sensor that the robot may not have
      this.say(time, { kind: "source", source, word, failed: table.word("failed", row) });
    });
  }
  hearRefusals(estimator) {
    this.rows("innovations", (table, row, time) => {
      const verdict = table.word("verdict", row), source = table.word("sensor", row);
      if (table.values("estimator")[row] !== estimator || verdict === "Accepted" || verdict === "NotUsed" || verdict === "NewLandmark" || verdict === "Pending") return;
      const again = time - (this.refused.get(source) ?? -Infinity) < QUIET_S;
      this.refused.set(source, time);
      if (!again) this.say(time, { kind: "refusal", source, verdict, ratio: table.values("ratio")[row], failed: table.word("failed", row) });
    });
  }
}
