# SPDX-License-Identifier: Apache-2.0
"""Shared parts of the importers of recorded data sets: reading tables with exact times, the time base of a log, writing all outputs or none.

Time base of every imported log: 1.000000 s is the start (the first moment at which odometry and truth both exist). The facts known before
a drive (landmark map, start pose) come in the second before.
"""
import argparse
import hashlib
import json
import math
import os

import numpy as np

from tetap.can import bus_writer
from tetap.can.bus_writer import BadInput

START_US = 1_000_000       # the start, in log time
MAP_FIRST_US = 100_000     # first landmark of the map, the others every MAP_STEP_US
MAP_STEP_US = 2_000
POSE_US = 900_000          # start pose
DISORDER_US = 100_000      # rows out of order by up to this much are sorted and counted, more is an error
JUMP_US = 3_600_000_000    # a gap longer than this is a broken time, not a pause


def microseconds(text):
    """Decimal seconds as integer microseconds, exact to half a microsecond whatever the size of the number."""
    whole, dot, fraction = text.partition(".")
    if dot and fraction.isascii() and fraction.isdigit() and whole.lstrip("+-").isdigit():
        digits = (fraction + "0000000")[:7]
        magnitude = abs(int(whole)) * 1_000_000 + (int(digits) + 5) // 10
        return -magnitude if whole.startswith("-") else magnitude
    seconds = float(text)
    if not math.isfinite(seconds):
        raise ValueError(text)
    return round(seconds * 1e6)


class Table:
    """Rows of numbers with a time: `time_us`, `data` (rows x columns, without the time), `line` (numbers in the file)."""

    def __init__(self, path, time_us, data, line, sorted_rows):
        self.path, self.time_us, self.data, self.line, self.sorted_rows = path, time_us, data, line, sorted_rows

    def __len__(self):
        return len(self.time_us)

    def where(self, row):
        return f"{self.path}:{self.line[row]}"

    def keep(self, mask):
        return Table(self.path, self.time_us[mask], self.data[mask], self.line[mask], self.sorted_rows)


def read_lines(path):
    """(line number, text) of a text file's lines that hold something."""
    try:
        with open(path, encoding="utf-8-sig", errors="replace") as file:
            for number, line in enumerate(file, 1):
                text = line.strip()
                if text and not text.startswith("#"):
                    yield number, text
    except OSError as error:
        raise BadInput(f"{path}: {error.strerror}") from None


def numbers(fields, where, first_column=1):
    """Fields as finite numbers; `first_column`: of the first field in its line."""
    values = []
    for column, field in enumerate(fields, first_column):
        try:
            value = float(field)
        except ValueError:
            raise BadInput(f"{where}: column {column} is not a number: {field[:30]!r}") from None
        if not math.isfinite(value):
            raise BadInput(f"{where}: column {column} is not a finite number: {field[:30]!r}")
        values.append(value)
    return values


def table(path, rows, columns):
    """Rows (line number, list of texts, the time first) as a Table, checked: number of columns, finite numbers, times that go forward."""
    time_us, data, lines = [], [], []
    latest = None
    for line, fields in rows:
        where = f"{path}:{line}"
        if len(fields) != columns:
            raise BadInput(f"{where}: {len(fields)} columns, expected {columns}")
        values = numbers(fields, where)
        t = microseconds(fields[0])
        if latest is not None:
            if t < latest - DISORDER_US:
                raise BadInput(f"{where}: time goes back by {(latest - t) / 1e6:.6f} s")
            if t > latest + JUMP_US:
                raise BadInput(f"{where}: time jumps by {(t - latest) / 1e6:.0f} s")
        latest = t if latest is None else max(latest, t)
        time_us.append(t)
        data.append(values[1:])
        lines.append(line)
    if not time_us:
        raise BadInput(f"{path}: no row in it")
    time_us = np.array(time_us, dtype=np.int64)
    order = np.argsort(time_us, kind="stable")
    sorted_rows = int(np.count_nonzero(np.diff(time_us) < 0))
    return Table(path, time_us[order], np.array(data)[order], np.array(lines)[order], sorted_rows)


def read_table(path, columns):
    """A text file of numbers split at blanks, the time first, '#' comments."""
    return table(path, ((line, text.split()) for line, text in read_lines(path)), columns)


def read_csv(path, names, time_name):
    """A CSV file with a header line of column names, as a Table of the columns `names` (times from `time_name`)."""
    rows = read_lines(path)
    line, header = next(rows, (0, ""))
    header = [name.strip() for name in header.split(",")]
    missing = [name for name in [time_name] + names if name not in header]
    if missing:
        raise BadInput(f"{path}:{max(line, 1)}: no column {missing[0]!r}")
    picks = [header.index(name) for name in [time_name] + names]

    def picked():
        for number, text in rows:
            fields = text.split(",")
            if len(fields) != len(header):
                raise BadInput(f"{path}:{number}: {len(fields)} columns, expected {len(header)}")
            yield number, [fields[i].strip() for i in picks]

    return table(path, picked(), len(picks))


def wrapped(angle_rad):
    """Angle in [-pi, pi)."""
    return np.mod(np.asarray(angle_rad) + np.pi, 2 * np.pi) - np.pi


def heading_of_odometry(time_us, forward_mps, yaw_rate_radps, truth_us, truth_x_m, truth_y_m, distance_m):
    """Heading at time_us[0] that turns the path of the odometry's first `distance_m` best (least squares over rotation and shift) onto the truth's.

    A chord of the truth would do for a robot that drives straight; one that turns while it starts needs its own path for it.
    """
    dt = np.diff(time_us) * 1e-6
    yaw = np.concatenate([[0.0], np.cumsum(yaw_rate_radps[:-1] * dt)])
    steps = forward_mps[:-1] * dt * np.exp(1j * (yaw[:-1] + yaw_rate_radps[:-1] * dt / 2))
    path = np.concatenate([[0.0], np.cumsum(steps)])
    driven = np.concatenate([[0.0], np.cumsum(np.abs(steps))])
    if driven[-1] < distance_m:
        raise BadInput(f"the robot drives {driven[-1]:.2f} m in all, its heading is taken from the first {distance_m:.0f} m")
    until = time_us[np.searchsorted(driven, distance_m)]
    use = (truth_us >= time_us[0]) & (truth_us <= until)
    if np.count_nonzero(use) < 3:
        raise BadInput(f"fewer than three positions of the truth in the first {distance_m:.0f} m")
    odometry = np.interp(truth_us[use], time_us, path.real) + 1j * np.interp(truth_us[use], time_us, path.imag)
    truth = truth_x_m[use] + 1j * truth_y_m[use]
    return float(np.angle(np.sum((truth - truth.mean()) * np.conj(odometry - odometry.mean()))))


class Recording:
    """One imported set: the log being filled, the truth, and the content of OUT.json."""

    def __init__(self, arguments, dataset, start_us):
        self.log = bus_writer.Log(bus_writer.Dbc(arguments.dbc), arguments.base)
        self.start_us = start_us
        self.truth = None
        self._sightings = None
        self.about = {"dataset": dataset, "time_offset_s": (start_us - START_US) / 1e6, "dropped": {}, "notes": []}
        self._files = []

    def log_us(self, source_us):
        """Time of the source in the time base of the log."""
        return np.asarray(source_us) - self.start_us + START_US

    def dropped(self, what, count):
        if count:
            self.about["dropped"][what] = int(count)

    def source(self, path, rows):
        self._files.append({"file": os.path.basename(path), "rows": int(rows), "sha256": sha256(path)})

    def map_entries(self, identifiers, x_m, y_m, sent=True):
        """`sent` False: the places are truth to compare with, and not on the bus."""
        if sent:
            self.log.add("In_MapEntry", MAP_FIRST_US + MAP_STEP_US * np.arange(len(identifiers)), Id=identifiers, X=x_m, Y=y_m)
        self.about["landmarks"] = [{"id": int(i), "x_m": float(x), "y_m": float(y)} for i, x, y in zip(identifiers, x_m, y_m)]

    def true_sightings(self, time_us, identifiers):
        """The landmark that each sighting shows, where the log lacks it or a mapper's association is judged."""
        self._sightings = (self.log_us(time_us), identifiers)

    def start_pose(self, x_m, y_m, yaw_rad, sigma_position_m, sigma_yaw_rad, how, sent=True):
        """`sent` False: the pose is in the description, and not on the bus."""
        if sent:
            self.log.add("Cmd_SetPos", POSE_US, Ctr=1, X=x_m, Y=y_m)
            self.log.add("Cmd_SetYaw", POSE_US + 1_000, Ctr=1, Yaw=yaw_rad, StdPos=sigma_position_m, StdYaw=sigma_yaw_rad)
        self.about["start_pose"] = {"time_s": POSE_US / 1e6, "x_m": float(x_m), "y_m": float(y_m), "yaw_rad": float(yaw_rad),
                                    "sigma_position_m": float(sigma_position_m), "sigma_yaw_rad": float(sigma_yaw_rad), "from": how}

    def sensor(self, name, valid_us, arrival_us=None, **signals):
        """One frame per sample: stamp and sequence are added here."""
        valid_us = self.log_us(valid_us)
        arrival_us = valid_us if arrival_us is None else self.log_us(arrival_us)
        self.log.add(name, arrival_us, Stamp=valid_us & bus_writer.STAMP_MASK, Seq=bus_writer.sequence(len(valid_us)), **signals)

    def set_truth(self, kind, time_us, x_m, y_m, yaw_rad=None):
        """`yaw_rad` None: the truth has no heading."""
        self.truth = (self.log_us(time_us), x_m, y_m, yaw_rad)
        self.about["truth"] = kind
        self.about["truth_rows"] = len(time_us)

    def write(self, out):
        """OUT.log, OUT.truth.csv where there is one, and OUT.json: all of them or, when anything fails, none. An older truth is set aside."""
        log = self.log.text()
        frame_times = self.log.frames()[0]
        self.about.update(messages=dict(sorted(self.log.counts.items())), frames=len(frame_times), beyond=self.log.beyond,
                          duration_s=float(frame_times[-1] - START_US) / 1e6, sources=self._files)
        truth = {} if self.truth is None else {f"{out}.truth.csv": self._truth_text().encode()}
        if self._sightings is not None:
            rows = zip(*self._sightings)
            truth[f"{out}.sightings.csv"] = ("time_s,landmark\n" + "".join(f"{us / 1e6:.6f},{int(k)}\n" for us, k in rows)).encode()
        replace_all({f"{out}.log": log, **truth, f"{out}.json": (json.dumps(self.about, indent=2) + "\n").encode()})
        counts = ", ".join(f"{name} {count}" for name, count in self.about["messages"].items())
        print(f"{out}.log: {len(frame_times)} frames, {self.about['duration_s']:.1f} s ({counts})")
        for what, count in self.about["dropped"].items():
            print(f"  left out: {count} {what}")
        for what, count in self.log.beyond.items():
            print(f"  left out, beyond the signal's range: {count} values of {what}")
        if self.truth is None:
            set_aside(f"{out}.truth.csv")

    def _truth_text(self):
        time_us, x_m, y_m, yaw_rad = self.truth
        seconds, micros = np.divmod(time_us, 1_000_000)
        yaws = [""] * len(time_us) if yaw_rad is None else [f"{yaw:.6f}" for yaw in yaw_rad]
        return "time_s,x_m,y_m,yaw_rad\n" + "".join(
            f"{s}.{us:06d},{x:.6f},{y:.6f},{yaw}\n" for s, us, x, y, yaw in zip(seconds, micros, x_m, y_m, yaws))


def sha256(path):
    with open(path, "rb") as file:
        return hashlib.sha256(file.read()).hexdigest()


def set_aside(path):
    """A file of that name would be taken for this log's. Its content is kept as PATH.old."""
    if not os.path.exists(path):
        return
    try:
        os.replace(path, path + ".old")
    except OSError as error:
        raise BadInput(f"{path}: cannot be renamed to {path}.old: {error.strerror}") from None
    print(f"  {path} is not of this log: now {path}.old")


def replace_all(contents):
    """Writes files beside their final names, then renames them all."""
    temporary = {path: f"{path}.part{os.getpid()}" for path in contents}
    try:
        for path, data in contents.items():
            with open(temporary[path], "wb") as file:
                file.write(data)
        for path in contents:
            os.replace(temporary[path], path)
    except OSError as error:
        raise BadInput(f"{error.filename}: cannot write: {error.strerror}") from None
    finally:
        for path in temporary.values():
            if os.path.exists(path):
                os.remove(path)


def identifier_base(text):
    """A node's base: 64 apart, 11-bit identifiers."""
    base = int(text, 0)
    if base % 64 or not 0 <= base <= 0x7C0:
        raise argparse.ArgumentTypeError("a multiple of 64 from 0 to 0x7C0")
    return base


def arguments_parser(description, what="directory", metavar="DIR", text="directory of the data set"):
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(what, metavar=metavar, help=text)
    parser.add_argument("--dbc", default=bus_writer.DEFAULT_DBC, help="message layout (default: the repository's)")
    parser.add_argument("--base", type=identifier_base, default=bus_writer.DBC_BASE, help="identifier base of the node (default 0x300)")
    return parser
