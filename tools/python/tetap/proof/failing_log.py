# SPDX-License-Identifier: Apache-2.0
"""A failing log in fewer frames. Structure goes first: the end, ticks, whole kinds of sensors, the way before the failure, single units, single frames.

A unit has the frames of one sensor that came together. Contiguous IMU samples are joined: increments and intervals are summed. A late start has the
first fixes, which set the map's origin, then the samples that level, then a given pose. A twin of a frame is that frame in a log without some faults."""
import functools
import itertools
import time
from typing import NamedTuple

import numpy as np

from tetap.can.bus_writer import crc8
from tetap.can.faulty_log import Frame
from tetap.proof import swarm

MOST_INTERVAL_us = 65_535  # of one IMU sample on the bus
LEVEL_us = 1_100_000       # of samples before a given pose: gravity is looked at for a second
ORIGIN_FIXES = 5           # param/parameters.hpp: confirm_fixes
POSE_SIGMA_M, POSE_SIGMA_RAD = 0.1, 0.02  # of a given pose
AFTER_S = 5.0  # kept behind the begin of the failure at first
BEFORE_S = (0.5, 1, 1.5, 2, 2.5, 3, 3.5, 4, 5, 6, 8, 10, 12, 15, 18, 20, 22, 24, 27, 30, 40)  # of a late start before the failure
STARTS = 3  # late starts that are shrunk further, each for an equal share of the time


class Unit(NamedTuple):
    """Frames of one sensor, or of one command, that came together."""
    kind: str
    time_us: int
    frames: tuple


def kind_of(name):
    """Sensor or command of a message."""
    what = name.split("_", 1)[1]
    if name.startswith("Cmd_Set"):
        return "Pose"
    return next((start for start in ("Gnss", "Imu0", "Imu1", "Imu2", "Imu3") if what.startswith(start)), what)


def units(frames, fields):
    """Units of a log, in its order."""
    kinds = {identifier: kind_of(name) for name, identifier in fields.identifier.items()}
    found, last = [], {}
    for frame in frames:
        kind = kinds[frame.identifier]
        if kind not in last or found[last[kind]][1] != frame.time_us:
            last[kind] = len(found)
            found.append((kind, frame.time_us, []))
        found[last[kind]][2].append(frame)
    return [Unit(kind, time_us, tuple(some)) for kind, time_us, some in found]


def joined(parts, fields):
    """The same, contiguous IMU samples in units of as many as one sample of the bus can span."""
    out, last, spans = [], {}, {}
    for one in parts:
        if not one.kind.startswith("Imu"):
            out.append(one)
            continue
        span, before = _span(one, fields), last.get(one.kind)
        if before is not None and span > 0 and span + spans[one.kind] <= MOST_INTERVAL_us and one.time_us - out[before].time_us <= 1.5 * span:
            out[before] = one._replace(frames=out[before].frames + one.frames)
            spans[one.kind] += span
        else:
            last[one.kind], spans[one.kind] = len(out), span
            out.append(one)
    return out


def _span(one, fields):
    message = f"In_{one.kind}Time"
    return sum(fields.get(frame.payload, message, "Interval") for frame in one.frames if frame.identifier == fields.identifier[message])


def pose_command(at_us, pose, count, fields):
    """The commands that give a pose (x [m], y [m], yaw [rad]) at a time."""
    given = dict(zip(("X", "Y", "Yaw", "StdPos", "StdYaw"), (*pose, POSE_SIGMA_M, POSE_SIGMA_RAD)))
    frames = []
    for message in ("Cmd_SetPos", "Cmd_SetYaw"):
        payload = fields.put(0, message, "Ctr", count)
        for name, signal in fields.dbc.messages[message].signals.items():
            if name in given:
                payload = fields.put(payload, message, name, round(given[name] / signal.scale))
        identifier = fields.identifier[message]
        crc = int(crc8(identifier & 0x3F, np.array([payload], dtype=np.uint64))[0])
        frames.append(Frame(at_us, identifier, fields.put(payload, message, "Crc", crc)))
    return Unit("Pose", at_us, tuple(frames))


def late(parts, at_us, pose, fields):
    """The same, started at `at_us` with a pose. What sets the origin is of the kind of the fixes: without these nothing needs it."""
    poses = [one._replace(kind="Gnss") for one in parts if one.kind == "Pose" and one.time_us < at_us]
    velocity = [fields.identifier[name] for name in ("In_GnssVelEN", "In_GnssVelU")]
    fixes = [one._replace(frames=tuple(frame for frame in one.frames if frame.identifier not in velocity)) for one in parts if one.kind == "Gnss"]
    fixes = [one for one in fixes if one.frames and one.time_us <= at_us - LEVEL_us][:ORIGIN_FIXES]
    command = pose_command(at_us, pose, len(poses) + 1, fields)
    window = [one for one in parts if one.kind != "Pose" and at_us - LEVEL_us < one.time_us]
    return poses + fixes + [one for one in window if one.time_us <= at_us] + [command] + [one for one in window if one.time_us > at_us]


@functools.lru_cache(maxsize=1 << 17)
def written(one, fields, twin=None):
    """Frames of a unit, or their twins; of several IMU samples their sum."""
    frames = [frame for frame in map(twin, one.frames) if frame is not None] if twin else list(one.frames)
    if not one.kind.startswith("Imu"):
        return frames
    out = []
    for message in (f"In_{one.kind}{part}" for part in ("Gyro", "Accel", "Time")):
        some = [frame for frame in frames if frame.identifier == fields.identifier[message]]
        if not some:
            continue
        payload = some[-1].payload
        for name, signal in fields.dbc.messages[message].signals.items():
            if len(some) > 1 and name.startswith(("Ang", "Vel", "Interval", "Clip")):
                total = sum(fields.get(frame.payload, message, name) for frame in some)
                payload = fields.put(payload, message, name, min(max(total, signal.raw_min), signal.raw_max))
        out.append(some[-1]._replace(payload=payload))
    return out


def size_of(parts):
    """How many frames these units are written as."""
    return sum(min(len(one.frames), 3) if one.kind.startswith("Imu") else len(one.frames) for one in parts)


def frames_of(parts, fields, twin=None):
    return [frame for one in parts for frame in written(one, fields, twin)]


def twin_in(frames, fields):
    """Finds the twin of a frame in another log; commands are their own."""
    by_key = {(frame.time_us, frame.identifier): frame for frame in frames}
    own = [fields.identifier[name] for name in ("Cmd_SetPos", "Cmd_SetYaw")]
    return lambda frame: frame if frame.identifier in own else by_key.get((frame.time_us, frame.identifier))


def right_share(failing, clean):
    """Of the epochs in which the failing log's estimate is known: the share in which the clean log's is inside 3 sigma. Each: (times, ratios)."""
    (at, ratio), (clean_at, clean_ratio) = failing, clean
    inside = set(np.rint(clean_at[clean_ratio <= 1] / swarm.TICK_S).astype(int))
    known = np.rint(at[np.isfinite(ratio)] / swarm.TICK_S).astype(int)
    return float(np.mean([one in inside for one in known])) if len(known) else 0.0


def begin_of(whole):
    """Where a failure begins [s]: where the estimate left its uncertainty, or where it had to be right again."""
    verdict, judged, _ = whole
    if verdict == "unsafe" and judged["astray_at_s"] is not None:
        return judged["astray_at_s"]
    return swarm.FAULTS_UNTIL_S + swarm.SETTLED_S


class Failure:
    """What a part of a log has to show: the verdict of the whole, at about the same time, of an estimate that was right before. The same frames without any
    fault keep the estimate inside 3 sigma, and without one of the needed faults they do not have the verdict.

    look(frames, truth): (verdict, judged, (times, ratios)), or None. `clean` and each of `without`: (twin, truth)."""

    def __init__(self, look, fields, whole, truth, clean, without):
        self._look, self._fields, self._truth, self._clean, self._without = look, fields, truth, clean, without
        self._whole, self._verdict, self.tries = whole, whole[0], 0

    def holds(self, parts):
        self.tries += 1
        found = self._look(frames_of(parts, self._fields), self._truth)
        if found is None or found[0] != self._verdict or not self._begins_right(found):
            return False
        twin, truth = self._clean
        clean = self._look(frames_of(parts, self._fields, twin), truth)
        if clean is None or clean[0] == self._verdict or right_share(found[2], clean[2]) < swarm.INSIDE_SHARE:
            return False
        return not any(self._fails_alike(parts, twin, truth) for twin, truth in self._without)

    def _begins_right(self, found):
        at, ratio = found[2]
        if self._verdict != "unsafe":  # silent: outside in the end
            return bool((ratio <= 1).any())
        astray = [one[1]["astray_at_s"] is not None for one in (found, self._whole)]
        if not all(astray):
            return not any(astray)
        begin_s = begin_of(found)
        return abs(begin_s - begin_of(self._whole)) <= swarm.HURT_S and bool((ratio[at < begin_s] <= 1).any())

    def _fails_alike(self, parts, twin, truth):
        found = self._look(frames_of(parts, self._fields, twin), truth)
        return found is not None and found[0] == self._verdict


def shrunk(parts, fields, fails, pose_at, begin_us, seconds, clock=time.monotonic):
    """Fewer units that fails(units) holds for. pose_at(time_us): the true pose. begin_us: where the failure begins."""
    end = clock() + seconds

    def first_that_fails(candidates, otherwise):
        return next((some for some in candidates if clock() < end and fails(some)), otherwise)

    parts = first_that_fails([[one for one in parts if one.kind != "Sync"]], parts)
    parts = first_that_fails([[one for one in parts if one.time_us <= begin_us + round(AFTER_S * 1e6)]], parts)
    parts = first_that_fails([joined(parts, fields)], parts)
    starts = [parts] + [late(parts, at_us, pose_at(at_us), fields) for at_us in (begin_us - round(before * 1e6) for before in BEFORE_S)
                        if at_us - LEVEL_us > parts[0].time_us]
    optional = sorted({one.kind for one in parts if not one.kind.startswith("Imu") and one.kind != "Pose"})
    candidates = [[one for one in some if one.kind not in left_out] for some in starts
                  for number in range(len(optional) + 1) for left_out in itertools.combinations(optional, number)]
    best = parts
    found = itertools.islice((some for some in sorted(candidates, key=size_of) if clock() < end and fails(some)), STARTS)
    for number, some in enumerate(found):
        few = swarm.shrunk(some, fails, (end - clock()) / (STARTS - number + 1), clock)
        best = min(best, few, key=size_of)
    singles = [piece for one in best for piece in ([one] if one.kind.startswith("Imu") else [one._replace(frames=(frame,)) for frame in one.frames])]
    return swarm.shrunk(singles, fails, end - clock(), clock)
