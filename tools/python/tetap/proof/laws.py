# SPDX-License-Identifier: Apache-2.0
"""Laws of a replay that need no truth: a log is changed so that the answer is known from the answer to the log itself.

Metamorphic relations (Chen, Cheung, Yiu, HKUST-CS98-01, 1998). Four leave the answer alone: IMU stamps one microsecond later, one least digit
of one field, another order of the frames of a tick, every frame twice. Four move it by a symmetry of the Earth and of the robot: another
longitude, another time, the mirror image, and a quarter turn (turned_log). A log is a list of faulty_log.Frame; nothing here shares code with the
node.

A mirror swaps left and right of the robot and north and south of the Earth. Polar vectors change the sign of y, axial ones (turn rates, magnetic
flux) those of x and z. The Earth's rotation and gravity are the same in the image, so the law holds for inertial navigation, too.
"""
import csv
import math
import os
import random
import subprocess

import numpy as np

from tetap.can import faulty_log
from tetap.can.bus_writer import STAMP_MASK, BadInput, Dbc, crc8
from tetap.can.faulty_log import Fields
from tetap.proof import turned_log

LONGITUDE_2ndeg = 15_000_000_000   # 30 deg
TIME_us = 3_600_123_457            # no whole wrap of a stamp, no whole tick
COMMANDS = ("Cmd_Reset", "Cmd_SetPos", "Cmd_SetYaw")
POLAR, AXIAL = (1, -1, 1), (-1, 1, -1)

# Raw fields that a mirror negates, and pairs that it swaps.
NEGATED = {
    "Cmd_SetPos": ["Y"], "Cmd_SetYaw": ["Yaw"], "In_MapEntry": ["Y"], "In_BodySpeed": ["YawRate"], "In_RangeBearing": ["Bearing"],
    "In_GnssLat": ["Lat"], "In_GnssVelEN": ["North"], "In_Heading": ["Angle"], "In_Radar": ["Bearing"], "In_Mag": ["FluxX", "FluxZ"],
    **{f"In_Imu{i}Gyro": ["AngX", "AngZ"] for i in range(4)}, **{f"In_Imu{i}Accel": ["VelY"] for i in range(4)},
}
SWAPPED = {"In_WheelCounts": ("Left", "Right"), "In_WheelSpeed": ("Left", "Right")}
# The same of parameters: scalars, signs of vectors, matrices M to S M S, and pairs.
NEGATED_PARAMETERS = ("gnss.antenna_y_b_m", "landmark.mounting.y_b_m", "landmark.mounting.yaw_rad", "start.y_m", "start.yaw_rad",
                      "magnetic.declination_rad", "gnss.origin_latitude_deg")
VECTORS = {"gnss.baseline_b_m": POLAR, "gyro.up_s": POLAR, "imu.accel_bias_mps2": POLAR, "inertial.position_b_m": POLAR, "imu.gyro_bias_radps": AXIAL,
           "imu.gyro_bias_slope_radps_per_degC": AXIAL, "magnetic.hard_iron_uT": AXIAL}
MATRICES = ("imu.accel_matrix", "inertial.mounting_bs", "magnetic.mounting_bs", "magnetic.soft_iron")
PAIRS = (("wheels.drive.left_radius_m", "wheels.drive.right_radius_m"), ("wheels.drive.noise_left", "wheels.drive.noise_right"),
         ("wheels.left_speed_scale", "wheels.right_speed_scale"))


class Changes:
    """The changes of a log, by name. Each returns (frames, parameters) for `frames` and a dictionary of parameters as text."""

    def __init__(self, dbc=None):
        self.fields = Fields(dbc or Dbc())
        self.name = {identifier: name for name, identifier in self.fields.identifier.items()}
        self.commands = {self.fields.identifier[name] for name in COMMANDS}
        self.sync = self.fields.identifier["In_Sync"]

    def _edited(self, frame, edit):
        """The frame with each raw value of `edit` {field: function of the raw value}; a code for "not available" stays."""
        message = self.name[frame.identifier]
        payload = frame.payload
        for field, change in edit.items():
            signal = self.fields.dbc.messages[message].signals[field]
            raw = self.fields.get(frame.payload, message, field)
            if raw != signal.not_available:
                payload = self.fields.put(payload, message, field, change(raw))
        return frame._replace(payload=payload)

    def _sealed(self, frame):
        """A command with the CRC of its new content."""
        if frame.identifier not in self.commands:
            return frame
        crc = int(crc8(frame.identifier & 0x3F, np.array([frame.payload], dtype=np.uint64))[0])
        return frame._replace(payload=self.fields.put(frame.payload, self.name[frame.identifier], "Crc", crc))

    def _stamp(self, delta_us):
        return {"Stamp": lambda raw: raw + delta_us & STAMP_MASK}

    def imu_stamps(self, frames, parameters, _):
        """All stamps of the IMUs one microsecond later."""
        ids = {self.fields.identifier[f"In_Imu{i}Time"] for i in range(4)}
        return [self._edited(f, self._stamp(1)) if f.identifier in ids else f for f in frames], parameters

    def least_digit(self, frames, parameters, seed):
        """One least digit of one measured field of one frame, drawn by the seed."""
        draw = random.Random(seed)
        fixed = ("Stamp", "Seq", "Inst", "Crc", "Ctr", "Id", "Interval", "Fix", "NumSv", "ClipGyro", "ClipAccel", "Time", "Kind", "What", "Temp")
        choice = [i for i, f in enumerate(frames) if f.identifier != self.sync and f.identifier not in self.commands]
        while choice:
            i = draw.choice(choice)
            message = self.fields.dbc.messages[self.name[frames[i].identifier]]
            fields = [name for name in message.signals if name not in fixed]
            if not fields:
                continue
            field = draw.choice(fields)
            signal = message.signals[field]
            edited = self._edited(frames[i], {field: lambda raw: raw + 1 if raw < signal.raw_max else raw - 1})
            if edited.payload != frames[i].payload:
                return [*frames[:i], edited, *frames[i + 1:]], parameters
        return frames, parameters

    def tick_order(self, frames, parameters, seed):
        """The sensors' frames of one arrival in another order; those of one sample keep theirs, and nothing passes a command or a sync frame."""
        draw, out, run = random.Random(seed), [], []

        def family(frame):
            name = self.name.get(frame.identifier, "")
            return name[:7] if name.startswith(("In_Imu", "In_Gnss")) else name

        def flush():
            groups = {}
            for frame in run:
                groups.setdefault(family(frame), []).append(frame)
            order = list(groups.values())
            draw.shuffle(order)
            out.extend(frame for group in order for frame in group)
            run.clear()

        for frame in frames:
            barrier = frame.identifier == self.sync or frame.identifier in self.commands
            if barrier or (run and run[0].time_us != frame.time_us):
                flush()
            if barrier:
                out.append(frame)
            else:
                run.append(frame)
        flush()
        return out, parameters

    def twice(self, frames, parameters, _):
        """Every frame of a sensor sent twice in a row."""
        barrier = {self.sync, *self.commands}
        return [f for frame in frames for f in ([frame] if frame.identifier in barrier else [frame, frame])], parameters

    def longitude(self, frames, parameters, _):
        """The run at a place 30 deg further east."""
        limit = 90_000_000_000  # 180 deg in steps of 2e-9 deg
        east = {"Lon": lambda raw: (raw + LONGITUDE_2ndeg + limit) % (2 * limit) - limit}
        identifier = self.fields.identifier["In_GnssLon"]
        moved = dict(parameters)
        key = "gnss.origin_longitude_deg"
        if key in moved:
            moved[key] = repr((float(moved[key]) + LONGITUDE_2ndeg * 2e-9 + 180) % 360 - 180)
        return [self._edited(f, east) if f.identifier == identifier else f for f in frames], moved

    def time(self, frames, parameters, _):
        """The run an hour later; the clock of the bus and all stamps move alike."""
        moved = []
        for frame in frames:
            message = self.fields.dbc.messages.get(self.name.get(frame.identifier, ""))
            if frame.identifier == self.sync:
                frame = self._edited(frame, {"Time": lambda raw: raw + TIME_us})
            elif message and "Stamp" in message.signals:
                frame = self._edited(frame, self._stamp(TIME_us))
            moved.append(frame._replace(time_us=frame.time_us + TIME_us))
        return moved, parameters

    def mirror(self, frames, parameters, _):
        """The mirror image: left and right, north and south."""
        out = []
        for frame in frames:
            name = self.name.get(frame.identifier, "")
            if name in NEGATED:
                frame = self._edited(frame, {field: lambda raw: -raw for field in NEGATED[name]})
            if name in SWAPPED:
                one, other = SWAPPED[name]
                left, right = (self.fields.get(frame.payload, name, side) for side in (one, other))
                frame = frame._replace(payload=self.fields.put(self.fields.put(frame.payload, name, one, right), name, other, left))
            out.append(self._sealed(frame))
        return out, mirrored(parameters)

    def turn(self, frames, parameters, _):
        """The run turned by 90 deg about the origin."""
        turned = turned_log.TurnedLog(self.fields, self.name, frames, parameters).frames(frames)
        return [self._sealed(frame) for frame in turned], turned_log.turned_parameters(parameters)


def mirrored(parameters):
    """Parameters of the mirror image, by path as text."""
    out = dict(parameters)
    for path in NEGATED_PARAMETERS:
        if path in out:
            out[path] = repr(-float(out[path]))
    for path, signs in VECTORS.items():
        if path in out:
            out[path] = " ".join(repr(sign * float(x)) for sign, x in zip(signs, out[path].split()))
    for path in MATRICES:
        if path in out:
            out[path] = " ".join(repr(POLAR[i // 3] * POLAR[i % 3] * float(x)) for i, x in enumerate(out[path].split()))
    for one, other in PAIRS:
        if one in out:
            out[one], out[other] = out[other], out[one]
    return out


class Replay:
    """Replays of one robot with parameters of its own."""

    def __init__(self, programs, out, robot, settings):
        self.programs, self.out, self.robot = programs, out, robot
        words = [word for setting in settings for word in ("--set", setting)]
        text = self._run("tetap-params", "--robot", robot, *words)
        rows = (line.split("#")[0].partition("=") for line in text.splitlines())
        self.parameters = {path.strip(): value.strip() for path, sign, value in rows if sign}

    def _run(self, program, *words):
        done = subprocess.run([os.path.join(self.programs, program), *words], capture_output=True, text=True, check=False)
        if done.returncode:
            raise BadInput(f"{program} {' '.join(words)}: status {done.returncode}\n{done.stdout}{done.stderr}".rstrip())
        return done.stdout

    def estimates(self, what, frames, parameters):
        folder = os.path.join(self.out, what)
        os.makedirs(folder, exist_ok=True)
        faulty_log.write(frames, folder + ".log")
        with open(folder + ".params", "w", encoding="utf-8") as file:
            file.write("".join(f"{path} = {value}\n" for path, value in parameters.items()))
        self._run("tetap-play", folder + ".log", "--memory", "--lockstep", "--robot", self.robot, "--params", folder + ".params",
                  "--out", folder, "--quiet")
        with open(os.path.join(folder, "estimates.csv"), encoding="utf-8", newline="") as file:
            return list(csv.DictReader(file))


LAWS = ("imu_stamps", "least_digit", "tick_order", "twice", "longitude", "time", "mirror", "turn")
# Where a law asks for it, the image of a pose (x, y, yaw); and parameters that the log itself is replayed with, too.
IMAGES = {"mirror": lambda pose: (pose[0], -pose[1], -pose[2]), "turn": turned_log.turned_pose}
BASES = {"turn": turned_log.SAME_EARTH}
MOST_m, MOST_SIGMA, MOST_rad = 1e-3, 0.05, 1e-6
STEP_m, STEP_rad = 1e-3, 1e-4  # bus steps of the published position and heading


class Difference:
    """Largest difference between the poses of two replays; beyond what the rounding of the bus explains, in sigmas where it is more than 1 mm.
    `late`: epochs at which one of the two took a step of the other a tick later."""

    def __init__(self):
        self.epochs, self.missing, self.late, self.m, self.rad, self.broken, self.sigma, self.at_s = 0, 0, 0, 0.0, 0.0, 0, 0.0, None

    def add(self, pairs, sigma, time_s):
        """`pairs`: ways in which two poses (x, y, yaw; metres, radians) may be the same, each a list of (one, other, steps of rounding) of which all
        have to fit; the first is that of the same epoch. `sigma`: of the first pose, (metres, radians)."""
        self.epochs += 1
        fits = [max((Fit(*pair, *sigma) for pair in way), key=lambda fit: (fit.broken, fit.sigma, fit.m)) for way in pairs]
        best = next((fit for fit in fits if not fit.broken), fits[0])
        self.late += best is not fits[0]
        self.m, self.rad, self.sigma = max(self.m, best.m), max(self.rad, best.rad), max(self.sigma, best.sigma)
        if best.broken:
            self.broken += 1
            self.at_s = time_s if self.at_s is None else self.at_s


class Fit:
    """How far one pose is from another."""

    def __init__(self, one, other, steps, sigma_m, sigma_rad):
        self.m = math.hypot(one[0] - other[0], one[1] - other[1])
        self.rad = abs(math.remainder(one[2] - other[2], 2 * math.pi))
        beyond_m, beyond_rad = max(0.0, self.m - steps * math.sqrt(2) * STEP_m), max(0.0, self.rad - steps * STEP_rad)
        self.sigma = max(beyond_m / sigma_m if sigma_m else 0.0, beyond_rad / sigma_rad if sigma_rad else 0.0)
        self.broken = beyond_m > max(MOST_m, MOST_SIGMA * sigma_m) or beyond_rad > max(MOST_rad, MOST_SIGMA * sigma_rad)


def carried_on(rows, epoch, way=1):
    """The pose at an epoch, if the motion of the tick before it went on (way -1: of the tick after it, backwards); None where a pose is missing. What
    was corrected at this epoch is not in it."""
    before, last = rows.get(epoch - 2 * way), rows.get(epoch - way)
    if before is None or last is None:
        return None
    return tuple(2 * b - a for a, b in zip(before[:2], last[:2])) + (last[2] + math.remainder(last[2] - before[2], 2 * math.pi),)


def ways(mine, theirs, epoch):
    """How two runs may show the same at an epoch: at once, or one makes its step a tick after the other."""
    found = [[(mine[epoch], theirs[epoch], 1)]]
    for early, late in ((mine, theirs), (theirs, mine)):
        before, after = carried_on(early, epoch), carried_on(late, epoch, -1)
        if before is not None and after is not None:
            found.append([(before, late[epoch], 2), (after, early[epoch], 2)])
    return found


def poses(rows, image=lambda pose: pose):
    """Poses of a table of estimates (rows of estimates.csv) by estimator and epoch."""
    found = {}
    for row in rows:
        if row["x_m"] and row.get("pos_valid") == "1":
            found.setdefault(row["estimator"], {})[int(row["epoch"])] = image(tuple(float(row[key] or 0) for key in ("x_m", "y_m", "yaw_rad")))
    return found


def compared(one, other, image, shift_s=0.0):
    """Difference of two tables of estimates (rows of estimates.csv); `image` maps a pose of the first to that expected of the second. A sample that
    passes the end of the fusion window by a microsecond corrects the estimate one tick later; such a step is the same."""
    number = lambda row, key: float(row[key]) if row.get(key) else 0.0  # noqa: E731
    time_s = {(row["epoch"], row["estimator"]): number(row, "time_s") for row in other if row["x_m"] and row.get("pos_valid") == "1"}
    first, second = poses(one, image), poses(other)
    result = Difference()
    sigma = {}
    for row in one:
        if not row["x_m"]:
            continue
        estimator, epoch = row["estimator"], int(row["epoch"])
        if row.get("std_x_m"):
            sigma[estimator] = (math.hypot(number(row, "std_x_m"), number(row, "std_y_m")), number(row, "std_yaw_rad"))
        if row.get("pos_valid") != "1":
            continue
        at_s = time_s.get((row["epoch"], estimator))
        if at_s is None or abs(at_s - number(row, "time_s") - shift_s) > 1e-3:
            result.missing += 1
            continue
        result.add(ways(first[estimator], second[estimator], epoch), sigma.get(estimator, (0.0, 0.0)), number(row, "time_s"))
    return result


def holds(difference):
    """Whether the law holds. One epoch in a thousand may miss its partner: a valid flag may come a tick later."""
    return difference.epochs > 0 and not difference.broken and difference.missing <= max(1, difference.epochs // 1000)
