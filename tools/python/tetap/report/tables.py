# SPDX-License-Identifier: Apache-2.0
"""The recorder's CSV files in little memory: read in blocks, kept as whole multiples of powers of ten, given out as the very floats of the text.

A run of eight hours has three million rows of each large table. As floats they fill gigabytes; as the few digits that the text has, a tenth."""
import contextlib
import warnings

import numpy as np

from tetap.can import bus_writer
from tetap.can.bus_writer import BadInput

ENUMERATIONS = {"failed": "Check", "state": "SourceState", "kind": "EstimatorKind", "sensor": "Sensor", "verdict": "Verdict", "mode": "Mode", "reset_cause": "ResetCause",
                "landmark_state": "LandmarkState", "graph_status": "GraphStatus"}
BLOCK = 1 << 20  # bytes of text at once
MOST_DECIMALS = 9
LONGEST_NAME = 40


class Column:
    """Numbers in as few bytes as they need. A value that is no multiple of a small power of ten stays a float."""

    def __init__(self):
        self._parts = []  # (numbers, decimals; None: as they are)
        self._rows = 0
        self._decimals = 0  # decimals of the last part: the next one is likely to have as many

    def add(self, values):
        self._parts.append(self._packed(values))
        self._rows += len(values)

    def array(self):
        values = np.empty(self._rows)
        end = 0
        for numbers, decimals in self._parts:
            begin, end = end, end + len(numbers)
            if decimals is None:
                values[begin:end] = numbers
                continue
            least = np.iinfo(numbers.dtype).min
            np.divide(numbers, 10.0 ** decimals, out=values[begin:end])
            values[begin:end][numbers == least] = np.nan
            values[begin:end][numbers == least + 1] = -0.0
        return values

    def _packed(self, values):
        finite = np.isfinite(values)
        known = values[finite]
        if np.isinf(values).any():
            return values.copy(), None
        for decimals in sorted(range(MOST_DECIMALS + 1), key=lambda one: one != self._decimals):
            with np.errstate(over="ignore"):
                scaled = np.rint(known * 10.0 ** decimals)
            most = np.abs(scaled).max(initial=0)
            if most < np.iinfo(np.int32).max - 1 and (scaled / 10.0 ** decimals == known).all():
                break
        else:
            return values.copy(), None
        self._decimals = decimals
        kind = next(one for one in (np.int8, np.int16, np.int32) if most < np.iinfo(one).max - 1)
        least = np.iinfo(kind).min  # stands for NaN, least + 1 for minus zero
        numbers = np.full(len(values), least, dtype=kind)
        numbers[finite] = np.where((known == 0) & np.signbit(known), least + 1, scaled)
        return numbers, decimals


class Table:
    """Columns by name, each an array of floats made when it is asked for."""

    def __init__(self, columns, index=None, start=None):
        self._columns, self._index, self._start = columns, index, start

    def __contains__(self, name):
        return name in self._columns

    def names(self):
        return list(self._columns)

    def __getitem__(self, name):
        values = self._columns[name].array()
        values = values if self._index is None else values[self._index]
        return values if self._start is None or name != "time_s" else values - self._start

    def with_columns(self, **columns):
        """The same, whole, with other values in these columns."""
        if self._index is not None:
            raise ValueError("of a whole table alone")
        changed = dict(self._columns)
        for name, values in columns.items():
            changed[name] = Column()
            changed[name].add(values)
        return Table(changed, None, self._start)

    def without(self, name):
        """The same, whole, without this column."""
        if self._index is not None:
            raise ValueError("of a whole table alone")
        return Table({one: column for one, column in self._columns.items() if one != name}, None, self._start)

    def where(self, mask):
        """The rows for which `mask` holds."""
        index = np.flatnonzero(mask)
        return Table(self._columns, index if self._index is None else self._index[index], self._start)

    def since(self, start):
        """The same, with times counted from `start` [s]."""
        return Table(self._columns, self._index, start)


def empty_table(columns):
    return Table({name: Column() for name in columns})


def joined(first, second):
    """Rows of the one, then of the other, which has the same columns."""
    columns = {name: Column() for name in second.names()}
    for name, column in columns.items():
        for table in (first, second):
            column.add(table[name])
    return Table(columns)


def read_table(path, columns, also=(), keep=None):
    """Columns of a CSV file by name, and those of `also` that it has. Empty: NaN. Names of the bus's enumerations stand for their numbers. `keep`: mask
    of the rows to keep, from a block of them by column."""
    with _opened(path) as file:
        names, blocks = _read(file, path, columns, also)
        found = {name: Column() for name in names}
        for block in blocks:
            rows = slice(None) if keep is None else np.flatnonzero(keep(block))
            for name, column in found.items():
                column.add(block[name][rows])
        return Table(found)


def read_parts(path, columns, also=(), span=None):
    """(number, table) of each `span` of epochs, in order: epoch // span is the number. Only one of them is in memory."""
    with _opened(path) as file:
        names, blocks = _read(file, path, columns, also)
        number, found = 0, {name: Column() for name in names}
        for block in blocks:
            # A row without an epoch, or with an earlier one, goes with those before it.
            numbers = np.maximum.accumulate(np.maximum(np.nan_to_num(block["epoch"]) // span, number).astype(int))
            for rows in np.split(np.arange(len(numbers)), np.flatnonzero(np.diff(numbers)) + 1):
                if len(rows) and numbers[rows[0]] != number:
                    yield number, Table(found)
                    number, found = int(numbers[rows[0]]), {name: Column() for name in names}
                for name, column in found.items():
                    column.add(block[name][rows])
        yield number, Table(found)


@contextlib.contextmanager
def _opened(path):
    try:
        with open(path, "rb") as file:
            yield file
    except OSError as error:
        raise BadInput(f"{path}: {error.strerror}") from None


def _read(file, path, columns, also):
    """(names of the columns that are there, blocks of rows by column)."""
    header, line = file.readline(), 1
    while header.startswith(b"#"):
        header, line = file.readline(), line + 1
    names = [name.strip() for name in header.decode("utf-8", "replace").split(",")]
    missing = [name for name in columns if name not in names]
    if missing:
        raise BadInput(f"{path}:{line}: no column {missing[0]!r}")
    found = [name for name in [*columns, *also] if name in names]
    tables = bus_writer.default_dbc().tables
    codes = [tables.get(ENUMERATIONS.get(name), {}) for name in names]
    return found, _rows(file, path, line + 1, names, found, codes)


def _rows(file, path, line, names, found, codes):
    for body in _blocks(file):
        values = _parse(body, codes)
        if values is None:
            values = _parse_names(body, codes, path, line)
        yield {name: values[:, names.index(name)] for name in found}
        line += body.count(b"\n")


def _blocks(file):
    """Whole lines, some megabytes at once; none of a file that has nothing but blanks."""
    blank, any_line = b"", False
    while True:
        block = (file.read(BLOCK) + file.readline()).replace(b"\r\n", b"\n")
        if not block and not (blank and any_line):
            return
        last, block, blank = not block, blank + block, b""
        if not last and not block.strip():  # the next part decides whether these are lines without columns
            blank = block
            continue
        any_line = True
        yield block if block.endswith(b"\n") else block + b"\n"
        if last:
            return


def _parse(body, codes):
    """All fields as numbers at once, or None when something is not a number or a line has another number of fields."""
    width = len(codes)
    octets = np.frombuffer(body, dtype=np.uint8).copy()
    separators = np.flatnonzero((octets == ord(",")) | (octets == ord("\n")))
    if len(separators) % width != 0:
        return None
    ends = separators.reshape(-1, width)
    if not (octets[ends[:, -1]] == ord("\n")).all() or (octets[ends[:, :-1]] == ord("\n")).any():
        return None
    for i, names in enumerate(codes):
        if names:
            begins = ends[:, i - 1] + 1 if i > 0 else np.concatenate([[0], ends[:-1, -1] + 1])
            _write_codes(octets, begins, ends[:, i], names)
    octets[ends[:, -1]] = ord(",")
    flat = octets[:-1].tobytes()
    while b",," in flat:
        flat = flat.replace(b",,", b",nan,")
    if flat.startswith(b","):
        flat = b"nan" + flat
    if flat.endswith(b","):
        flat += b"nan"
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            values = np.fromstring(flat, sep=",")
        except (DeprecationWarning, ValueError):
            return None
    return values.reshape(-1, width) if len(values) == len(separators) else None


def _write_codes(octets, begins, ends, codes):
    """The number of each name in its place, where there is room; what is no name stays."""
    longest = int((ends - begins).max())
    if not 0 < longest <= LONGEST_NAME:
        return
    at = begins[:, None] + np.arange(longest)
    letters = np.where(at < ends[:, None], octets[np.minimum(at, len(octets) - 1)], 0).astype(np.uint8)
    words, which = np.unique(letters.view(f"S{longest}").ravel(), return_inverse=True)
    for i, word in enumerate(words):
        code = codes.get(word.decode("utf-8", "replace").strip())
        number = b"" if code is None else str(code).encode()
        if 0 < len(number) <= len(word):
            rows = begins[which == i]
            octets[rows[:, None] + np.arange(len(word))] = np.frombuffer(number.ljust(len(word)), dtype=np.uint8)


def _parse_names(body, codes, path, first_line):
    """The slow way, which names the wrong line."""
    rows = []
    for number, line in enumerate(body.decode("utf-8", "replace").splitlines(), first_line):
        fields = [field.strip() for field in line.split(",")]
        if len(fields) != len(codes):
            raise BadInput(f"{path}:{number}: {len(fields)} columns, expected {len(codes)}")
        try:
            rows.append([code[field] if field in code else float(field or "nan") for field, code in zip(fields, codes)])
        except ValueError as error:
            raise BadInput(f"{path}:{number}: {error}") from None
    return np.array(rows, dtype=np.float64)
