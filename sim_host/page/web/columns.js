// SPDX-License-Identifier: Apache-2.0
// A table in CSV as it comes, in blocks of whole lines: numbers as Float64Array, words as codes of a dictionary.

const COMMA = 44, NEWLINE = 10, MINUS = 45, POINT = 46, ZERO = 48;
const POWERS = Array.from({ length: 23 }, (_, i) => 10 ** i);

class Column {
  constructor(name) {
    this.name = name;
    this.values = new Float64Array(1024);
    this.words = null; // of a column of text: code -> word
    this.codes = null;
  }
  grow() {
    const wider = new Float64Array(2 * this.values.length);
    wider.set(this.values);
    this.values = wider;
  }
  word(text) {
    this.words ??= [];
    this.codes ??= new Map();
    let code = this.codes.get(text);
    if (code === undefined) {
      code = this.words.push(text) - 1;
      this.codes.set(text, code);
    }
    return code;
  }
}

export class Table {
  constructor() {
    this.columns = [];
    this.rows = 0;
    this.decoder = new TextDecoder();
  }

  /** Whole lines; the first line of all has the names. */
  add(bytes) {
    let at = 0;
    if (this.columns.length === 0) {
      at = bytes.indexOf(NEWLINE) + 1;
      const names = this.decoder.decode(bytes.slice(0, at - 1)).split(",");
      this.columns = names.map((name) => new Column(name));
    }
    while (at < bytes.length) at = this.addLine(bytes, at);
  }

  addLine(bytes, begin) {
    let at = begin;
    // All columns have room for as many rows.
    if (this.rows >= this.columns[0].values.length) this.columns.forEach((column) => column.grow());
    for (const column of this.columns) at = this.addCell(bytes, at, column) + 1;
    this.rows++;
    return at;
  }

  /** An empty cell is NaN. A decimal of up to 15 digits is exact: a whole number over a power of ten. */
  addCell(bytes, begin, column) {
    let at = begin, whole = 0, decimals = -1, digits = 0, byte;
    const negative = bytes[at] === MINUS;
    if (negative) at++;
    for (; (byte = bytes[at]) !== COMMA && byte !== NEWLINE; at++) {
      const digit = byte - ZERO;
      if (digit >= 0 && digit <= 9) {
        whole = 10 * whole + digit;
        digits++;
        if (decimals >= 0) decimals++;
      } else if (byte === POINT && decimals < 0) decimals = 0;
      else return this.addWord(bytes, begin, column);
    }
    if (digits > 15) return this.addLong(bytes, begin, column);
    const size = decimals > 0 ? whole / POWERS[decimals] : whole;
    column.values[this.rows] = digits === 0 ? NaN : negative ? -size : size;
    return at;
  }
  cell(bytes, begin) {
    let end = begin;
    while (bytes[end] !== COMMA && bytes[end] !== NEWLINE) end++;
    return [this.decoder.decode(bytes.slice(begin, end)), end];
  }
  addWord(bytes, begin, column) {
    const [text, end] = this.cell(bytes, begin);
    column.values[this.rows] = column.word(text);
    return end;
  }
  addLong(bytes, begin, column) {
    const [text, end] = this.cell(bytes, begin);
    column.values[this.rows] = Number(text);
    return end;
  }

  column(name) {
    return this.columns.find((column) => column.name === name);
  }
  /** The column's values up to the last row; of a column of words their codes. */
  values(name) {
    return this.column(name)?.values.subarray(0, this.rows) ?? new Float64Array(0);
  }
  /** Word of a row. */
  word(name, row) {
    const column = this.column(name);
    const value = column?.values[row];
    return column?.words?.[value] ?? (Number.isNaN(value) ? "" : String(value));
  }

  /** For another thread, which takes the memory as well. */
  packed() {
    return { rows: this.rows, columns: this.columns.map(({ name, values, words }) => ({ name, values: values.subarray(0, this.rows), words })) };
  }
  /** A copy; the rows are gone from here. */
  taken() {
    const columns = this.columns.map(({ name, values, words }) => ({ name, values: values.slice(0, this.rows), words })), { rows } = this;
    this.rows = 0;
    return { rows, columns };
  }
  /** Further rows, as packed() or taken() has them. */
  append({ rows, columns }) {
    if (this.columns.length === 0) this.columns = columns.map(({ name }) => new Column(name));
    columns.forEach(({ values, words }, i) => {
      const column = this.columns[i];
      while (column.values.length <= this.rows + rows) column.grow();
      const codes = words?.map((word) => column.word(word));
      for (let row = 0; row < rows; row++) column.values[this.rows + row] = codes && !Number.isNaN(values[row]) ? codes[values[row]] : values[row];
    });
    this.rows += rows;
  }
  static unpacked({ rows, columns }) {
    const table = new Table();
    table.rows = rows;
    table.columns = columns.map((one) => Object.assign(new Column(one.name), one));
    return table;
  }
}
