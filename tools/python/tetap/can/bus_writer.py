# SPDX-License-Identifier: Apache-2.0
"""Writes candump logs from message and signal names: the layout comes from the DBC, the packing is done for whole arrays at once.

Little-endian signals in frames of eight bytes, as config/tetap.dbc has them; anything else is refused, not guessed.
CRC-8 of protected messages: AUTOSAR E2E profile, CRC8H2F (polynomial 0x2F, initial value and final xor 0xFF).
"""
import functools
import os
import re
import sys

import numpy as np

ROOT = os.path.abspath(os.path.join(os.path.dirname(os.path.realpath(__file__)), *[os.pardir] * 4))
DEFAULT_DBC = os.path.join(ROOT, "config", "tetap.dbc")
DBC_BASE = 0x300  # the node base the DBC is written for
STAMP_MASK = (1 << 20) - 1


class BadInput(Exception):
    """An error in a file of the user: the text names file, line and reason."""


class Signal:
    """One signal of the DBC: where its bits are and which raw values are values."""

    def __init__(self, start, length, signed, scale, offset, low, high):
        self.start, self.length, self.signed = start, length, signed
        self.scale, self.offset = scale, offset
        bottom, top = (-(1 << (length - 1)), (1 << (length - 1)) - 1) if signed else (0, (1 << length) - 1)
        self.raw_min = max(bottom, round((low - offset) / scale))
        self.raw_max = min(top, round((high - offset) / scale))
        not_available = bottom if signed else top
        in_range = self.raw_min <= not_available <= self.raw_max
        self.not_available = None if in_range else not_available

    def steps(self, values):
        """Physical values in steps of the signal, and which of them are within its range. NaN: not available, and within."""
        steps = np.rint((np.asarray(values, dtype=np.float64) - self.offset) / self.scale)
        return steps, ~((steps < self.raw_min) | (steps > self.raw_max))

    def pack(self, values, name):
        """Raw bits in place for an array of physical values, and which of them are within the signal's range. NaN: not available."""
        steps, inside = self.steps(values)
        missing = np.isnan(steps)
        if missing.any() and self.not_available is None:
            raise ValueError(f"{name} has no code for a value that is not available")
        raw = np.where(inside & ~missing, steps, 0).astype(np.int64)
        if missing.any():
            raw[missing] = self.not_available
        mask = np.uint64((1 << self.length) - 1)
        return (raw.astype(np.uint64) & mask) << np.uint64(self.start), inside


class Message:
    """One message of the DBC; its signals go by the part of their name after `<Message>_`."""

    def __init__(self, name, identifier):
        self.name, self.identifier, self.signals = name, identifier, {}


_BO = re.compile(r"BO_\s+(\d+)\s+(\w+)\s*:\s*(\d+)\s+\w+\s*$")
_NUMBER = r"([-+]?[\d.]+(?:[eE][-+]?\d+)?)"
_SG = re.compile(r"SG_\s+(\w+)\s*(m\d+|M)?\s*:\s*(\d+)\|(\d+)@([01])([-+])\s*\(%s,%s\)\s*\[%s\|%s\]" % ((_NUMBER,) * 4))
_TABLE = re.compile(r"VAL_TABLE_\s+(\w+)\s+(.*);\s*$")


class Dbc:
    """The messages and value tables of a DBC file."""

    def __init__(self, path=DEFAULT_DBC):
        self.messages, self.tables = {}, {}
        message = None
        try:
            with open(path, encoding="utf-8", errors="replace") as file:
                lines = file.read().splitlines()
        except OSError as error:
            raise BadInput(f"{path}: {error.strerror}") from None
        for number, line in enumerate(lines, 1):
            text = line.strip()
            where = f"{path}:{number}"
            if text.startswith("BO_ "):
                found = _BO.match(text)
                if not found:
                    raise BadInput(f"{where}: not a message: {text[:60]}")
                if found[3] != "8":
                    raise BadInput(f"{where}: {found[2]} has {found[3]} bytes, only frames of 8 are handled")
                message = self.messages[found[2]] = Message(found[2], int(found[1]))
            elif text.startswith("SG_ "):
                self._signal(message, text, where)
            elif text.startswith("VAL_TABLE_ "):
                found = _TABLE.match(text)
                if not found:
                    raise BadInput(f"{where}: not a value table: {text[:60]}")
                self.tables[found[1]] = {name: int(code) for code, name in re.findall(r'(\d+)\s+"([^"]*)"', found[2])}
        if not self.messages:
            raise BadInput(f"{path}: no message in it")

    @staticmethod
    def _signal(message, text, where):
        found = _SG.match(text)
        if not found or message is None:
            raise BadInput(f"{where}: not a signal: {text[:60]}")
        name, start, length = found[1], int(found[3]), int(found[4])
        if found[5] != "1":
            raise BadInput(f"{where}: {name} is big-endian, only little-endian is handled")
        if length == 0 or start + length > 64 or float(found[7]) == 0.0:
            raise BadInput(f"{where}: {name} does not fit the frame or has no scale")
        short = name.split("_", 1)[-1]
        message.signals[short] = Signal(start, length, found[6] == "-", *(float(found[i]) for i in (7, 8, 9, 10)))

    def value(self, table, name):
        """Number of a name in a value table."""
        return self.tables[table][name]


@functools.lru_cache(maxsize=1)
def default_dbc():
    """The project's own DBC, read once: not to be changed."""
    return Dbc()


def _crc_table():
    table = np.arange(256, dtype=np.uint16)
    for _ in range(8):
        table = np.where(table & 0x80, (table << 1) ^ 0x2F, table << 1) & 0xFF
    return table.astype(np.uint8)


_CRC8H2F = _crc_table()


def crc8(offset, payloads):
    """CRC-8 H2F over [offset, payload bytes 1 to 7] of each 64-bit payload."""
    data = payloads.astype("<u8").view(np.uint8).reshape(-1, 8)
    crc = np.full(len(data), _CRC8H2F[0xFF ^ offset], dtype=np.uint8)
    for column in range(1, 8):
        crc = _CRC8H2F[crc ^ data[:, column]]
    return crc ^ np.uint8(0xFF)


class Log:
    """Frames with their times of arrival; `write` puts them in order of time (equal times: in the order they were added)."""

    def __init__(self, dbc, base=DBC_BASE, channel="vcan0"):
        self.dbc, self.base, self.channel = dbc, base, channel
        self.counts, self.beyond = {}, {}
        self._parts = []

    def add(self, name, time_us, **values):
        """Appends one frame of message `name` per element of `time_us`. Signals are arrays or single values; those not given are 0.

        Frames with a value beyond its signal's range are left out and counted in `beyond`."""
        message = self.dbc.messages[name]
        time_us = np.atleast_1d(np.asarray(time_us, dtype=np.int64))
        payload = np.zeros(len(time_us), dtype=np.uint64)
        inside = np.ones(len(time_us), dtype=bool)
        for key, value in values.items():
            bits, within = message.signals[key].pack(np.broadcast_to(value, time_us.shape), f"{name}.{key}")
            payload |= bits
            inside &= within
            if not within.all():
                where = f"{name}.{key}"
                self.beyond[where] = self.beyond.get(where, 0) + int(np.count_nonzero(~within))
        time_us, payload = time_us[inside], payload[inside]
        offset = message.identifier - DBC_BASE
        if "Crc" in message.signals and message.signals["Crc"].length == 8:
            payload |= crc8(offset, payload).astype(np.uint64) << np.uint64(message.signals["Crc"].start)
        identifiers = np.full(len(time_us), self.base + offset, dtype=np.int64)
        self._parts.append((time_us, identifiers, payload))
        self.counts[name] = self.counts.get(name, 0) + len(time_us)

    def inside(self, count, **messages):
        """Which of `count` samples are within range in all frames that they take; `messages`: name -> {signal: values}."""
        within = np.ones(count, dtype=bool)
        for name, values in messages.items():
            for key, value in values.items():
                within &= self.dbc.messages[name].signals[key].steps(value)[1]
        return within

    def frames(self):
        """(time_us, identifier, payload as 64-bit words), in order."""
        time_us, identifiers, payload = (np.concatenate(part) for part in zip(*self._parts))
        order = np.argsort(time_us, kind="stable")
        return time_us[order], identifiers[order], payload[order]

    def text(self):
        """The log as candump -L writes it, as bytes."""
        time_us, identifiers, payload = self.frames()
        if time_us[0] < 0 or time_us[-1] >= 10**16 or identifiers.max() > 0x7FF:
            raise ValueError("a time below zero or an identifier of more than 11 bits does not fit a log line")
        before, after = f") {self.channel} ".encode(), b"#"
        width = 1 + 17 + len(before) + 3 + 1 + 16 + 1
        lines = np.empty((len(time_us), width), dtype=np.uint8)
        lines[:, 0] = ord("(")
        lines[:, 11] = ord(".")
        rest = time_us.copy()
        for column in list(range(17, 11, -1)) + list(range(10, 0, -1)):
            rest, digit = np.divmod(rest, 10)
            lines[:, column] = digit + ord("0")
        at = 18
        lines[:, at:at + len(before)] = np.frombuffer(before, dtype=np.uint8)
        at += len(before)
        digits = np.frombuffer(b"0123456789ABCDEF", dtype=np.uint8)
        for shift in (8, 4, 0):
            lines[:, at] = digits[(identifiers >> shift) & 15]
            at += 1
        lines[:, at] = after[0]
        data = payload.astype("<u8").view(np.uint8).reshape(-1, 8)
        lines[:, at + 1:at + 17:2] = digits[data >> 4]
        lines[:, at + 2:at + 18:2] = digits[data & 15]
        lines[:, -1] = ord("\n")
        return lines.tobytes()


def sequence(count, first=0):
    """The 4-bit sample counter of a sensor, for `count` samples."""
    return (np.arange(count) + first) & 15


def main_with_message(run):
    """Runs `run()`; bad input ends in one line on stderr and status 1."""
    try:
        run()
    except BadInput as error:
        print(f"{os.path.basename(sys.argv[0])}: {error}", file=sys.stderr)
        sys.exit(1)
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(1)
