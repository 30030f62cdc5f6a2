// SPDX-License-Identifier: Apache-2.0
// Tables of a long log in bounded memory: of each kind of rows every n-th one, n a power of two, and all that a reader would miss.
import { Table } from "./columns.js";

/** Verdicts that refuse nothing. */
export const NO_REFUSAL = new Set(["Accepted", "NotUsed", "NewLandmark", "Pending"]);

/** By table: its most rows, the columns that part it into kinds (`parts`: and which of its cells are filled, as sigmas come at every tenth row), and the rows that stay: refusals, and those where one of `changes` changes. */
const FORMS = {
  estimates: { most: 1 << 17, kinds: ["estimator"], parts: true },
  states: { most: 1 << 16, kinds: ["estimator"], parts: true },
  innovations: { most: 1 << 16, kinds: ["estimator", "sensor"], refusals: true },
  sensors: { most: 1 << 16, kinds: ["sensor", "estimator"] },
  status: { most: 1 << 16, kinds: [], changes: ["mode", "faults"] },
  sources: { most: 1 << 16, kinds: ["estimator", "source"], changes: ["state", "failed"] },
};

/** A row that stays has no ordinal. */
const STAYS = -1;

export class ThinnedTable extends Table {
  constructor({ most, kinds, parts = false, changes = [], refusals = false }) {
    super();
    Object.assign(this, { most: most - 1, kinds, parts, changes, refusals, every: 1, seen: new Map(), ordinals: new Float64Array(most), found: null });
  }
  addLine(bytes, begin) {
    const end = super.addLine(bytes, begin), row = this.rows - 1, ordinal = this.ordinal(row);
    if (ordinal !== STAYS && ordinal % this.every !== 0) this.rows--;
    else {
      if (row >= this.ordinals.length) this.ordinals = wider(this.ordinals);
      this.ordinals[row] = ordinal;
      if (this.rows >= this.most) this.thin();
    }
    return end;
  }
  /** Columns by name, looked up once: the first line names them all. */
  watched() {
    const all = (names) => names.map((name) => this.column(name));
    return (this.found ??= { kinds: all(this.kinds), changes: all(this.changes), verdict: this.refusals ? this.column("verdict") : null });
  }
  /** Of a row among those of its kind. */
  ordinal(row) {
    const { kinds, changes, verdict } = this.watched(), value = (column) => column?.values[row] ?? NaN;
    const filled = this.parts ? this.columns.reduce((bits, { values }) => 2 * bits + (Number.isNaN(values[row]) ? 0 : 1), 0) : 0;
    const kind = kinds.reduce((key, column) => 4096 * key + value(column), filled), now = changes.map(value);
    const before = this.seen.get(kind) ?? { rows: 0, values: null };
    const changed = changes.length > 0 && !before.values?.every((value, i) => value === now[i]);
    this.seen.set(kind, { rows: before.rows + 1, values: now });
    return changed || (verdict && !NO_REFUSAL.has(verdict.words?.[value(verdict)] ?? "")) ? STAYS : before.rows;
  }
  /** Twice as far apart. What stays may be more than half of the room: then there has to be more. */
  thin() {
    this.every *= 2;
    let kept = 0;
    for (let row = 0; row < this.rows; row++) {
      if (this.ordinals[row] !== STAYS && this.ordinals[row] % this.every !== 0) continue;
      for (const { values } of this.columns) values[kept] = values[row];
      this.ordinals[kept++] = this.ordinals[row];
    }
    this.rows = kept;
    if (kept > 0.75 * this.most) this.most *= 2;
  }
  packed() {
    return { ...super.packed(), every: this.every };
  }
}

function wider(values) {
  const twice = new Float64Array(2 * values.length);
  twice.set(values);
  return twice;
}

/** The table of that name for a log of any length. */
export const tableOf = (name) => (FORMS[name] ? new ThinnedTable(FORMS[name]) : new Table());

/** A log of this size is shown from its beginning before it is played as a whole. */
export const LONG_BYTES = 64e6;
const BEGINNING_BYTES = 12e6, LONGEST_LINE = 4096;

/** Whole lines from the beginning of a log; of a short one all. */
export async function beginningOf(log) {
  if (log.size <= BEGINNING_BYTES) return log;
  const tail = new Uint8Array(await log.slice(BEGINNING_BYTES - LONGEST_LINE, BEGINNING_BYTES).arrayBuffer());
  return log.slice(0, BEGINNING_BYTES - LONGEST_LINE + tail.lastIndexOf(10) + 1);
}
