# SPDX-License-Identifier: Apache-2.0
"""A log with one fault put in, frame by frame: wheels that are wired wrongly, frames that come late, a clock that jumps.

A log is a list of Frame in order of arrival. Layouts come from the DBC, so that nothing here shares code with the node. Times are in
microseconds; a fault acts on frames that were sent in [begin_us, end_us).
"""
import re
from typing import NamedTuple

from tetap.can.bus_writer import DBC_BASE, STAMP_MASK, BadInput, Dbc

_LINE = re.compile(r"\((\d+)\.(\d{6})\) (\S+) ([0-9A-F]{3})#([0-9A-F]{16})\s*$")
INPUTS = range(DBC_BASE, DBC_BASE + 0x20)  # identifiers that a node receives
_LONGEST_us = 1 << 62


class Frame(NamedTuple):
    """One frame: arrival, identifier, and its eight bytes as one little-endian number."""
    time_us: int
    identifier: int
    payload: int


class Fields:
    """Raw signals of the input messages by name, read and written in place."""

    def __init__(self, dbc=None):
        self.dbc = dbc or Dbc()
        self.identifier = {name: message.identifier for name, message in self.dbc.messages.items()}

    def _signal(self, message, name):
        return self.dbc.messages[message].signals[name]

    def get(self, payload, message, name):
        """Raw value, with its sign."""
        signal = self._signal(message, name)
        raw = payload >> signal.start & ((1 << signal.length) - 1)
        return raw - (1 << signal.length) if signal.signed and raw >> (signal.length - 1) else raw

    def put(self, payload, message, name, raw):
        """Payload with another raw value; what does not fit wraps."""
        signal = self._signal(message, name)
        mask = ((1 << signal.length) - 1) << signal.start
        return payload & ~mask | (raw << signal.start) & mask


def read(path):
    """Input frames of a `candump -L` log."""
    frames = []
    with open(path, encoding="ascii") as file:
        for number, line in enumerate(file, 1):
            found = _LINE.match(line)
            if not found:
                raise BadInput(f"{path}:{number}: no frame of eight bytes: {line.strip()[:60]}")
            identifier = int(found[4], 16)
            if identifier in INPUTS:
                payload = int.from_bytes(bytes.fromhex(found[5]), "little")
                frames.append(Frame(int(found[1]) * 1_000_000 + int(found[2]), identifier, payload))
    return frames


def in_bus_time(frames):
    """Frames of a run in lockstep, at the time of the tick that took them. The record of such a run has the times at which it was computed."""
    fields, waiting, out = Fields(), [], []
    kinds = fields.dbc.tables["SyncKind"]
    for frame in frames:
        kind = fields.get(frame.payload, "In_Sync", "Kind") if frame.identifier == fields.identifier["In_Sync"] else None
        if kind is None:
            waiting.append(frame)
        elif kind in (kinds["Tick"], kinds["Step"]):
            time_us = fields.get(frame.payload, "In_Sync", "Time")
            out += [f._replace(time_us=time_us) for f in (*waiting, frame)]
            waiting = []
    return out


def write(frames, path, channel="vcan0"):
    """Frames in order of arrival; of one arrival, in the order of the list."""
    with open(path, "w", encoding="ascii") as file:
        for frame in sorted(frames, key=lambda f: f.time_us):
            seconds, micros = divmod(frame.time_us, 1_000_000)
            data = frame.payload.to_bytes(8, "little").hex().upper()
            file.write(f"({seconds:010d}.{micros:06d}) {channel} {frame.identifier:03X}#{data}\n")


def _counts(frames, fields, step):
    """Counters whose steps are those of `step(left, right)`; the first reading stays."""
    message = "In_WheelCounts"
    wrapped = lambda difference: (difference + 0x8000) % 0x10000 - 0x8000  # noqa: E731
    last, now, out = None, None, []
    for frame in frames:
        if frame.identifier == fields.identifier[message]:
            raw = [fields.get(frame.payload, message, side) for side in ("Left", "Right")]
            if last is None:
                now = list(raw)
            else:
                moved = step(*(wrapped(a - b) for a, b in zip(raw, last)))
                now = [a + b for a, b in zip(now, moved)]
            last = raw
            payload = frame.payload
            for side, value in zip(("Left", "Right"), now):
                payload = fields.put(payload, message, side, round(value) % 0x10000)
            frame = frame._replace(payload=payload)
        out.append(frame)
    return out


def _speeds(frames, fields, message, names, change):
    out = []
    for frame in frames:
        if frame.identifier == fields.identifier[message]:
            signals = [fields.dbc.messages[message].signals[name] for name in names]
            raw = [fields.get(frame.payload, message, name) for name in names]
            payload = frame.payload
            for signal, name, before, value in zip(signals, names, raw, change(*raw)):
                if before != signal.not_available:
                    payload = fields.put(payload, message, name, min(max(round(value), signal.raw_min), signal.raw_max))
            frame = frame._replace(payload=payload)
        out.append(frame)
    return out


WHEELS = {
    "swapped": lambda left, right: (right, left),
    "left_reversed": lambda left, right: (-left, right),
    "right_reversed": lambda left, right: (left, -right),
    "both_reversed": lambda left, right: (-left, -right),
    "tenfold": lambda left, right: (10 * left, 10 * right),
    "tenth": lambda left, right: (left / 10, right / 10),
}
BODY = {
    "turn_reversed": lambda forward, turn: (forward, -turn),
    "both_reversed": lambda forward, turn: (-forward, -turn),
    "tenfold": lambda forward, turn: (10 * forward, 10 * turn),
    "tenth": lambda forward, turn: (forward / 10, turn / 10),
}


def with_wheels(frames, fault):
    """Wheels (counts and speeds) or body speeds as `fault` of WHEELS or BODY wires them."""
    fields = Fields()
    if fault in WHEELS:
        frames = _counts(frames, fields, WHEELS[fault])
        frames = _speeds(frames, fields, "In_WheelSpeed", ("Left", "Right"), WHEELS[fault])
    if fault in BODY:
        frames = _speeds(frames, fields, "In_BodySpeed", ("Forward", "YawRate"), BODY[fault])
    return frames


def counters_restarted(frames, at_us, sides=("Left", "Right")):
    """The counters of `sides` begin at 0 again at `at_us`."""
    fields, message, first, out = Fields(), "In_WheelCounts", {}, []
    for frame in frames:
        if frame.identifier == fields.identifier[message] and frame.time_us >= at_us:
            payload = frame.payload
            for side in sides:
                raw = fields.get(payload, message, side)
                payload = fields.put(payload, message, side, raw - first.setdefault(side, raw))
            frame = frame._replace(payload=payload)
        out.append(frame)
    return out


def delayed(frames, by_us, begin_us=0, end_us=_LONGEST_us, messages=None):
    """Each frame comes `by_us` later, its stamp unchanged. messages: names; None: every sensor's."""
    identifiers = _sensors(messages)
    return [f._replace(time_us=f.time_us + by_us) if f.identifier in identifiers and begin_us <= f.time_us < end_us else f for f in frames]


def lost(frames, begin_us=0, end_us=_LONGEST_us, messages=None):
    """Frames that never come."""
    identifiers = _sensors(messages)
    return [f for f in frames if not (f.identifier in identifiers and begin_us <= f.time_us < end_us)]


def held(frames, for_us, begin_us, messages=None):
    """Frames wait from `begin_us` on for `for_us`, and then come all at once."""
    identifiers, end_us = _sensors(messages), begin_us + for_us
    return [f._replace(time_us=max(f.time_us, end_us)) if f.identifier in identifiers and f.time_us >= begin_us else f for f in frames]


def clock_jumped(frames, by_us, at_us, messages=None):
    """From `at_us` on the clock that senders stamp by is `by_us` ahead: stamps, In_Sync and, with it, the log's own times."""
    fields, out = Fields(), []
    stamped = {m.identifier: m.name for m in fields.dbc.messages.values()
               if m.identifier in INPUTS and "Stamp" in m.signals and (messages is None or m.name in messages)}
    sync = fields.identifier["In_Sync"] if messages is None else None
    for frame in frames:
        if frame.time_us >= at_us:
            payload = frame.payload
            if frame.identifier in stamped:
                name = stamped[frame.identifier]
                payload = fields.put(payload, name, "Stamp", fields.get(payload, name, "Stamp") + by_us & STAMP_MASK)
            elif frame.identifier == sync:
                payload = fields.put(payload, "In_Sync", "Time", fields.get(payload, "In_Sync", "Time") + by_us)
            frame = frame._replace(payload=payload, time_us=frame.time_us + (by_us if messages is None else 0))
        out.append(frame)
    return out


def _sensors(messages):
    """Identifiers of the named messages, or of every message of a sensor."""
    dbc = Dbc()
    if messages is None:
        messages = [name for name in dbc.messages if name.startswith("In_") and name not in ("In_Sync", "In_MapEntry")]
    return {dbc.messages[name].identifier for name in messages}
