# SPDX-License-Identifier: Apache-2.0
"""The frames of a log as numpy arrays, and the messages of a node in them as columns of physical values, all of a message at once.

Lines of the form that `candump -L` gives a data frame of eight bytes are read in bulk; every other line goes through can/decoder.py, which is
the reference for what a line is.
"""
import functools
import re

import numpy as np

from tetap.can import bus_database, decoder
from tetap.can.bus_writer import DEFAULT_DBC, BadInput

PLAIN = re.compile(rb"\((\d{1,12})\.(\d{6})\) \S+ ([0-9A-F]{3})#([0-9A-F]{16})\r?\n")
TIME_SPAN = 1 << 48  # of Est_Epoch's time, in us
DAY_US = 86_400_000_000


class Frames:
    """Data frames of eight bytes with identifiers of eleven bits: `time_us` of reception (-1: none), `id`, and `word`, their bytes as one number."""

    def __init__(self, time_us, identifier, word):
        self.time_us, self.id, self.word = time_us, identifier, word

    def __len__(self):
        return len(self.id)


def from_array(frames):
    """Frames of a structured array with fields time_us, id and data (eight bytes), as tetap_read fills it (tetap_replay.h)."""
    return Frames(frames["time_us"].astype(np.int64), frames["id"].astype(np.int64), frames["data"].copy().view("<u8").reshape(-1).astype(np.uint64))


def read(path):
    """The frames of a log. BadInput with file and line for a line that is none; a last line without its newline is left out."""
    try:
        with open(path, "rb") as file:
            text = file.read()
    except OSError as error:
        raise BadInput(f"{path}: {error.strerror}") from None
    parts, at, line, decimal = [], 0, 1, False
    while at < len(text):
        rows, end = _bulk(text, at)
        if rows:
            parts.append(_plain(rows))
            line += len(rows)
            at = end
        if at < len(text):
            end = text.find(b"\n", at) + 1 or len(text)
            found = _single(path, line, text[at:end], decimal)
            if found:
                parts.append(found)
            decimal = decoder.asc_decimal(text[at:end], decimal)
            line, at = line + 1, end
    if not parts:
        return Frames(*(np.zeros(0, kind) for kind in (np.int64, np.int64, np.uint64)))
    return Frames(*(np.concatenate(column) for column in zip(*parts)))


def _bulk(text, at):
    """Fields of the plain lines from `at` up to the first that is another, and where that begins."""
    rows = []
    append = rows.append
    for found in iter(PLAIN.scanner(text, at).match, None):
        append(found.groups())
        at = found.end()
    return rows, at


def _plain(rows):
    seconds, micros, identifiers, data = zip(*rows)
    time_us = np.array(seconds, "S12").astype(np.int64) * 1_000_000 + np.array(micros, "S6").astype(np.int64)
    identifier = np.frombuffer(bytes.fromhex((b"0" + b"0".join(identifiers)).decode()), ">u2")
    return time_us, identifier.astype(np.int64), np.frombuffer(bytes.fromhex(b"".join(data).decode()), "<u8").astype(np.uint64)


def _single(path, number, line, decimal):
    if not line.strip():
        return None
    try:
        found = decoder.parse(line, decimal)
    except decoder.Malformed as reason:
        if not line.endswith(b"\n"):
            return None
        raise BadInput(f"{path}:{number}: {reason}: {decoder.shown(line)}") from None
    if found is None or found[3] is None or len(found[2]) != 3 or len(found[3]) != 8:
        return None
    try:
        time_us = round(float(found[0]) * 1e6)
    except (TypeError, ValueError):
        time_us = -1
    return tuple(np.array([value], kind) for value, kind in ((time_us, np.int64), (int(found[2], 16), np.int64), (int.from_bytes(found[3], "little"), np.uint64)))


def signal(word, one):
    """Values of a signal: floats with NaN where it is not available, else integers; an enum's code for not available is -1."""
    raw = (word >> np.uint64(one.start) & np.uint64((1 << one.length) - 1)).astype(np.int64)
    if one.signed:
        raw -= (raw >> (one.length - 1)) << one.length
    if one.physical:
        return np.where(raw == one.gap_code, np.nan, raw / one.per_unit) if one.gap_code is not None else raw / one.per_unit
    return np.where(raw == one.gap_code, -1, raw) if one.enum and one.gap_code is not None else raw


class Message:
    """All frames of one message, or of one page of it: `at`, their places among the log's frames, `time_s` of reception, and an array for each
    signal by its name in the DBC, without the prefix. Signals are in SI units, angles in rad, codes are integers."""

    def __init__(self, message, page, at, frames):
        self.message, self.at, self.time_s = message, at, frames.time_us[at] * 1e-6
        self.signals = message.page_signals(page)
        word = frames.word[at]
        for one in self.signals:
            setattr(self, one.field, signal(word, one))

    def __len__(self):
        return len(self.at)

    def __getitem__(self, field):
        return getattr(self, field)

    def names(self, field):
        """The names of an enum's codes."""
        one = next(s for s in self.signals if s.field == field)
        return [one.values.get(code, str(code)) for code in self[field].tolist()]


@functools.lru_cache(maxsize=2)
def database(path):
    """The messages of a DBC (bus_database), read once."""
    try:
        return bus_database.read(path)
    except bus_database.Refused as refusal:
        raise BadInput(str(refusal)) from None


class Messages:
    """The messages of one node in a log: `messages["Est0_Pos"]`, `messages["Est0_Std", "More"]` for a page. A message that the log does not
    have is empty; KeyError for one that the DBC does not have."""

    def __init__(self, frames, base=bus_database.BASE, dbc=DEFAULT_DBC):
        self.frames, self.base = frames, base
        known = database(dbc)
        self.tables = known.tables
        self._known = {message.name: message for message in known.messages}
        self._made = {}

    def __iter__(self):
        """Names of the messages that the log has."""
        present = set(np.unique(self.frames.id - self.base).tolist())
        return (name for name, message in self._known.items() if message.offset in present)

    def __contains__(self, name):
        return name in list(self)

    def __getitem__(self, key):
        if key not in self._made:
            name, page = key if isinstance(key, tuple) else (key, None)
            if name not in self._known:
                raise KeyError(f"no message '{name}'; there are: {' '.join(self._known)}")
            self._made[key] = self._make(self._known[name], page)
        return self._made[key]

    def _make(self, message, page):
        at = np.flatnonzero(self.frames.id == self.base + message.offset)
        mux = message.mux
        if mux is None:
            return Message(message, None, at, self.frames)
        pages = dict(zip(message.page_names, message.pages))
        if page is None:
            raise KeyError(f"{message.name} has pages: {' '.join(pages)}")
        if page not in pages:
            raise KeyError(f"{message.name} has no page '{page}'; there are: {' '.join(pages)}")
        at = at[signal(self.frames.word[at], mux) == pages[page]]
        return Message(message, pages[page], at, self.frames)

    def epoch_us(self):
        """(places of Est_Epoch among the frames, its times in us) as the node counts them. A node that counts the calendar has more than the
        frame's 48 bits: these are taken from the time of reception where it is within a day."""
        epoch = self["Est_Epoch"]
        if not len(epoch):
            return epoch.at, np.zeros(0, np.int64)
        time_us, log_us = epoch.Time.astype(np.int64), self.frames.time_us[epoch.at]
        ahead = (time_us - log_us) % TIME_SPAN
        near = log_us + np.where(ahead > TIME_SPAN // 2, ahead - TIME_SPAN, ahead)
        return epoch.at, np.where(abs(near - log_us) < DAY_US, near, time_us) if abs(near[0] - log_us[0]) < DAY_US else time_us
