# SPDX-License-Identifier: Apache-2.0
"""A recorded run: the recorder's tables, the kinds and names of its estimators, and the faults that its world had."""
import copy
import json
import math
import os

import numpy as np

from tetap.can import bus_writer
from tetap.can.bus_writer import BadInput
from tetap.report import graph, own_map
from tetap.report.tables import empty_table, joined, read_parts, read_table

TICK_S = 0.01  # period of a tick in the simulated world
LONG = 32 << 20  # bytes of estimates.csv, about an hour: a longer run is judged part by part, and its pictures are of a sample
SPAN = 100_000  # epochs of such a part
HELD_S = 1.5  # a page of an inertial estimate comes once a second: its numbers count for no longer than this
ESTIMATES = ["epoch", "time_s", "estimator", "kind", "x_m", "y_m", "yaw_rad", "speed_mps", "yaw_rate_radps", "std_x_m", "std_y_m",
             "std_yaw_rad", "corr_xy", "corr_x_yaw", "corr_y_yaw", "pos_valid", "hdg_valid",
             "std_speed_mps", "std_yaw_rate_radps"]
INNOVATIONS = ["epoch", "time_s", "estimator", "sensor", "inst", "verdict", "dof", "nis", "ratio", "age_ms", "landmark"]
STATUS = ["epoch", "time_s", "mode", "used", "faults", "reset_ctr", "reset_cause"]
SENSORS = ["epoch", "time_s", "estimator", "sensor", "inst", "accepted", "rejected", "nis_mean", "age_s"]
Q, VELOCITY, AXES = ["q_w", "q_x", "q_y", "q_z"], ["v_east_mps", "v_north_mps", "v_up_mps"], "xyz"
ACC_BIAS, GYRO_BIAS = [f"acc_bias_{a}_mps2" for a in AXES], [f"gyro_bias_{a}_radps" for a in AXES]
STD_TILT = ["std_tilt_east_rad", "std_tilt_north_rad"]
# Three correlations a block: of components 1 and 2, 1 and 3, 2 and 3.
CORRELATIONS = {"position": ["corr_xy", "corr_xz", "corr_yz"], "velocity": ["corr_v_en", "corr_v_eu", "corr_v_nu"],
                "attitude": ["corr_tilt_en", "corr_tilt_e_yaw", "corr_tilt_n_yaw"],
                "gyro bias": [f"corr_gyro_bias_{pair}" for pair in ("xy", "xz", "yz")], "acc bias": [f"corr_acc_bias_{pair}" for pair in ("xy", "xz", "yz")]}
STATES = ["epoch", "time_s", "estimator", *Q, *VELOCITY, "height_m", "std_height_m", *ACC_BIAS, *GYRO_BIAS, *(f"std_{v}" for v in VELOCITY), *STD_TILT,
          *(f"std_{b}" for b in ACC_BIAS), *(f"std_{b}" for b in GYRO_BIAS), "jump_x_m", "jump_y_m", "jump_yaw_rad",
          "disagree_tilt_rad", "disagree_yaw_rad", "vib_accel_mps2", "vib_gyro_radps", "clipped", "jump_z_m",
          *CORRELATIONS["position"][1:], *(name for block in ("velocity", "attitude", "acc bias", "gyro bias") for name in CORRELATIONS[block])]


def code_names():
    """Names of the bus's enumerations, by table and number, as the DBC has them."""
    return {table: {code: name for name, code in codes.items()} for table, codes in bus_writer.default_dbc().tables.items()}


def limits(message, signal):
    """(step, largest) value that a signal of the bus can carry."""
    one = bus_writer.Dbc().messages[message].signals[signal]
    return one.scale, one.raw_max * one.scale + one.offset


class Fault:
    """One fault of the simulated world: NAME@START+DURATION in run.json, seconds from the start of the run. Without times only the name."""

    def __init__(self, text):
        self.name, _, when = text.strip().partition("@")
        start, _, duration = when.partition("+")
        try:
            self.start_s, self.duration_s = float(start), float(duration)
        except ValueError:
            self.start_s = self.duration_s = None

    @property
    def words(self):
        if self.start_s is None:
            return self.name
        return f"{self.name} at {self.start_s:g} s" + (f" for {self.duration_s:g} s" if self.duration_s else "")


def faults(run):
    """The faults that the world had, in the order given."""
    text = run.about.get("fault") or ""
    return [Fault(one) for one in text.split(",") if one.strip()] if isinstance(text, str) and text != "none" else []


CALENDAR_S = 1e6  # eleven days: stamps beyond are of the calendar, or of a node that nobody wants to read from its start either


def start_s(run):
    """Time zero of pictures and words: the start of a simulated world's run on the node's clock; the first estimate where a log's stamps are
    seconds since 1970, of which nobody can read the last four digits on an axis; else 0, the node's own time."""
    if "world_start_s" in run.about:  # a board that ticked before the world began
        return float(run.about["world_start_s"])
    first = int(np.argmin(run.estimates["epoch"]))
    time_s = float(run.estimates["time_s"][first])
    if "seed" in run.about:
        return time_s - float(run.estimates["epoch"][first]) * TICK_S
    return time_s if time_s > CALENDAR_S else 0.0


def fault_spans(run):
    """(name, start, end) of the faults on the run's own clock. The world ticks once per epoch and epoch 1 is its first tick, so a fault is
    found by epoch: its own clock may be what jumps."""
    timed = [one for one in faults(run) if one.start_s is not None]
    if not timed:
        return []
    if "world_start_s" in run.about:
        start = start_s(run)
        return [(one.name, start + one.start_s, start + one.start_s + one.duration_s) for one in timed]
    order = np.argsort(run.estimates["epoch"], kind="stable")
    epoch, time_s = run.estimates["epoch"][order], run.estimates["time_s"][order]
    spans = []
    for one in timed:
        ends = [one.start_s / TICK_S, (one.start_s + one.duration_s) / TICK_S]
        start, end = np.interp(ends, epoch, time_s)
        spans.append((one.name, float(start), float(end)))
    return spans


def sample_of(path):
    """How many seconds of a long run stand for one of them: a sample has a quarter of LONG."""
    try:
        size = os.path.getsize(path)
    except OSError as error:
        raise BadInput(f"{path}: {error.strerror}") from None
    return 1 if size <= LONG else math.ceil(4 * size / LONG)


def seconds(every):
    """For read_table: the epochs of one second of so many, the same in each table; None where all count."""
    return None if every == 1 else lambda rows: rows["epoch"] * TICK_S // 1 % every == 0 if "epoch" in rows else np.ones(len(rows["time_s"]), dtype=bool)


class Run:
    """The recorder's directory: run.json, estimates, innovations, status."""

    def __init__(self, directory):
        self._first, self._held = 0, None  # of a part: its first epoch, and its rows with those that hold on
        self.start_s = 0.0  # zero of all times
        self._directory = directory
        self.about = read_json(os.path.join(directory, "run.json"))
        estimates = os.path.join(directory, "estimates.csv")
        # Of a long run the tables of millions of rows are a sample: one second of so many.
        self.every = sample_of(estimates)
        self.estimates = read_table(estimates, ESTIMATES, keep=seconds(self.every))
        if len(self.estimates["time_s"]) == 0:
            raise BadInput(f"{directory}/estimates.csv: no estimate in it")
        self.innovations = self._optional(directory, "innovations.csv", INNOVATIONS)
        self.status = self._optional(directory, "status.csv", STATUS, ["map_faults"])
        self.states = self._optional(directory, "states.csv", STATES, keep=seconds(self.every))
        self.sensors = self._optional(directory, "sensors.csv", SENSORS)
        self.map = self._optional(directory, "map.csv", own_map.MAP)
        self.graph = self._optional(directory, "graph.csv", graph.GRAPH)
        self.estimators = sorted(int(one) for one in np.unique(self.estimates["estimator"]))
        self.kinds = {k: self._kind(k) for k in self.estimators}
        self.names = names_of(self.kinds)
        self.best = max(self.estimators, key=lambda k: (self.names[k] == "fused", k))

    def _kind(self, estimator):
        code = int(self.estimates["kind"][self.estimates["estimator"] == estimator][-1])
        return code_names()["EstimatorKind"].get(code, str(code))

    @staticmethod
    def _optional(directory, name, columns, also=(), keep=None):
        path = os.path.join(directory, name)
        if os.path.exists(path):
            return read_table(path, columns, also, keep)
        return empty_table(columns)

    @property
    def duration_s(self):
        """From the first estimate to the last; of a sample as the player counted it."""
        stated = self.about.get("duration_s")
        if self.every > 1 and isinstance(stated, (int, float)):
            return float(stated)
        return float(self.estimates["time_s"][-1] - self.estimates["time_s"][0])

    def parts(self):
        """(number, the run with the rows of that part alone): itself where it is no sample, else each SPAN of epochs."""
        if self.every == 1:
            yield None, self
            return
        states = read_parts(os.path.join(self._directory, "states.csv"), STATES, span=SPAN)
        held, (state_part, state_rows) = None, next(states)
        for number, rows in read_parts(os.path.join(self._directory, "estimates.csv"), ESTIMATES, span=SPAN):
            while state_part < number:
                state_part, state_rows = next(states, (number + 1, None))
            mine = state_rows if state_part == number else empty_table(STATES)
            part = copy.copy(self)
            part.estimates = rows
            part._first = number * SPAN
            # Values that hold on from the part before.
            part._held = (rows, mine) if held is None else (joined(held[0], rows), joined(held[1], mine))
            yield number, part
            late = (number + 1) * SPAN - HELD_S / TICK_S
            held = tuple(table.where(table["epoch"] >= late) for table in part._held)
            held = tuple(joined(empty_table(table.names()), table) for table in held)

    def since(self, start):
        """The same, with times counted from `start` [s]."""
        later = copy.copy(self)
        later.start_s = start
        for name in ("estimates", "innovations", "status", "states", "sensors", "map"):
            setattr(later, name, getattr(self, name).since(start))
        if "world_start_s" in self.about:
            later.about = {**self.about, "world_start_s": self.about["world_start_s"] - start}
        return later

    def of(self, estimator):
        """Rows of one estimator."""
        return self.estimates.where(self.estimates["estimator"] == estimator)

    def states_of(self, estimator):
        """The estimator's attitudes, one row each, and beside them the last published values of everything else, where that is not too old; None
        where it publishes none."""
        pose, states = self._held or (self.estimates, self.states)
        states = States(states.where(states["estimator"] == estimator), pose.where(pose["estimator"] == estimator), self._first)
        return states if len(states["epoch"]) > 0 else None


class States:
    """Columns by name, a row for every attitude; "new NAME": whether that was published in this very epoch."""
    POSE = ("x_m", "y_m", "std_x_m", "std_y_m", "std_yaw_rad", "corr_xy", "pos_valid", "hdg_valid")

    def __init__(self, rows, pose, first=0):
        self._rows, self._pose = rows, pose
        self._at = np.flatnonzero(np.isfinite(rows["q_w"]) & (rows["epoch"] >= first))

    def __getitem__(self, name):
        if name in ("epoch", "time_s", *Q):
            return self._rows[name][self._at]
        source = self._pose if name.removeprefix("new ") in self.POSE else self._rows
        if not name.startswith("new "):
            return held_at(source["epoch"], source[name], self["epoch"], HELD_S / TICK_S)
        known = np.isfinite(source[name.removeprefix("new ")])
        return known[self._at] if source is self._rows else np.isin(self["epoch"], source["epoch"][known])


def names_of(kinds):
    """Display names of the estimators: odometry, attitude, and fused for the best of the others: an inertial one before any other."""
    others = [k for k, kind in kinds.items() if kind not in ("Odometry", "Attitude")]
    best = max(others, key=lambda k: (kinds[k] == "Inertial", -k), default=None)
    names = {}
    for k, kind in kinds.items():
        wanted = "fused" if k == best else {"Odometry": "odometry", "Attitude": "attitude"}.get(kind, f"estimator{k}")
        names[k] = wanted if wanted not in names.values() else f"estimator{k}"
    return names


def held_at(epoch, values, at, longest):
    """The last known value at or before each of `at`; NaN where it is older than `longest` epochs or there is none."""
    known = np.flatnonzero(np.isfinite(values))
    if len(known) == 0:
        return np.full(len(at), np.nan)
    last = np.searchsorted(epoch[known], at, side="right") - 1
    found = known[np.maximum(last, 0)]
    return np.where((last >= 0) & (at - epoch[found] <= longest), values[found], np.nan)


def read_json(path):
    try:
        with open(path, encoding="utf-8") as file:
            about = json.load(file)
    except OSError as error:
        raise BadInput(f"{path}: {error.strerror}") from None
    except ValueError as error:
        raise BadInput(f"{path}:{getattr(error, 'lineno', 1)}: not JSON: {getattr(error, 'msg', error)}") from None
    if not isinstance(about, dict):
        raise BadInput(f"{path}:1: not a JSON object")
    return about
