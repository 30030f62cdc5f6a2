# SPDX-License-Identifier: Apache-2.0
"""What a recorded run says about its estimators: reading the recorder's tables, comparing with truth.

NEES and its bounds: Bar-Shalom, Li, Kirubarajan, "Estimation with Applications to Tracking and Navigation", section 5.4. The covariance is the
published one (1-sigma and correlations of Est<k>_Std and Est<k>_State), so what is judged is what a user of the bus gets; by block of three, in
the epochs that say the block's covariance whole.
"""
import copy
import json
import os

import numpy as np
from scipy.special import chdtri

from tetap.can import bus_writer
from tetap.can.bus_writer import BadInput
from tetap.report import graph, own_map
from tetap.report.tables import empty_table, read_table

TICK_S = 0.01  # of the simulated world
MOST_NEES = 100.0  # above this mean, or with more than this share of a sensor rejected, the report warns: no tuning is so far off
MOST_FRAMED = 1.5  # a sensor with so many more measurements than frames about them is judged by the node's own counts
MOST_REJECTED, LEAST_TESTED = 1.0 / 3.0, 10
HELD_S = 1.5  # a page of an inertial estimate comes once a second: its numbers count for no longer than this
LEAST_GAP_S = 0.2  # truth rows further apart than this, or than 2.5 times their usual distance, are not interpolated between

ESTIMATES = ["epoch", "time_s", "estimator", "kind", "x_m", "y_m", "yaw_rad", "speed_mps", "yaw_rate_radps", "std_x_m", "std_y_m",
             "std_yaw_rad", "corr_xy", "corr_x_yaw", "corr_y_yaw", "pos_valid", "hdg_valid",
             "std_speed_mps", "std_yaw_rate_radps"]
INNOVATIONS = ["epoch", "time_s", "estimator", "sensor", "inst", "verdict", "dof", "nis", "ratio", "age_ms", "landmark"]
STATUS = ["epoch", "time_s", "mode", "used", "faults", "reset_ctr", "reset_cause"]
SENSORS = ["epoch", "time_s", "estimator", "sensor", "inst", "accepted", "rejected", "nis_mean", "age_s"]
Q, VELOCITY, AXES = ["q_w", "q_x", "q_y", "q_z"], ["v_east_mps", "v_north_mps", "v_up_mps"], "xyz"
ACC_BIAS, GYRO_BIAS = [f"acc_bias_{a}_mps2" for a in AXES], [f"gyro_bias_{a}_radps" for a in AXES]
STD_TILT = ["std_tilt_east_rad", "std_tilt_north_rad"]
# Of the first and second of the three, first and third, second and third.
CORRELATIONS = {"position": ["corr_xy", "corr_xz", "corr_yz"], "velocity": ["corr_v_en", "corr_v_eu", "corr_v_nu"],
                "attitude": ["corr_tilt_en", "corr_tilt_e_yaw", "corr_tilt_n_yaw"],
                "gyro bias": [f"corr_gyro_bias_{pair}" for pair in ("xy", "xz", "yz")], "acc bias": [f"corr_acc_bias_{pair}" for pair in ("xy", "xz", "yz")]}
STATES = ["epoch", "time_s", "estimator", *Q, *VELOCITY, "height_m", "std_height_m", *ACC_BIAS, *GYRO_BIAS, *(f"std_{v}" for v in VELOCITY), *STD_TILT,
          *(f"std_{b}" for b in ACC_BIAS), *(f"std_{b}" for b in GYRO_BIAS), "jump_x_m", "jump_y_m", "jump_yaw_rad",
          "disagree_tilt_rad", "disagree_yaw_rad", "vib_accel_mps2", "vib_gyro_radps", "clipped", "jump_z_m",
          *CORRELATIONS["position"][1:], *(name for block in ("velocity", "attitude", "acc bias", "gyro bias") for name in CORRELATIONS[block])]
TRUTH = ["time_s", "x_m", "y_m", "yaw_rad"]  # and perhaps "epoch" and these
TRUTH_MORE = ["z_m", "roll_rad", "pitch_rad", *VELOCITY, *GYRO_BIAS, *ACC_BIAS]
BLOCKS = ["position", "velocity", "attitude", "gyro bias", "acc bias"]
STEPS = {"position": ("Est2_Std", "StdX"), "velocity": ("Est2_State", "StdVelEast"), "attitude": ("Est2_State", "StdTiltEast"),
         "gyro bias": ("Est2_State", "StdGyroBiasX"), "acc bias": ("Est2_State", "StdAccBiasX")}
# Of the values: what they were rounded by is no error of the estimate. Twice that of a quaternion's component is an angle.
VALUE_STEPS = {"position": [("Est2_Pos", "X", 1), ("Est2_Pos", "Y", 1), ("Est2_State", "Height", 1)], "velocity": [("Est2_Vel", "East", 1)],
               "attitude": [("Est2_Att", "X", 2)], "gyro bias": [("Est2_State", "GyroBiasX", 1)], "acc bias": [("Est2_State", "AccBiasX", 1)]}
UNITS = {"position": "m", "velocity": "m/s", "attitude": "rad", "gyro bias": "rad/s", "acc bias": "m/s2"}


def chi_square(share, dof):
    """Point below which `share` of a chi-square variable with `dof` degrees of freedom falls."""
    return float(chdtri(dof, 1.0 - share))


def wrapped(angle_rad):
    return np.mod(angle_rad + np.pi, 2 * np.pi) - np.pi


def code_names():
    """Names of the bus's enumerations, by table and number, as the DBC has them."""
    return {table: {code: name for name, code in codes.items()} for table, codes in bus_writer.Dbc().tables.items()}


def limits(message, signal):
    """(step, largest) value that a signal of the bus can say."""
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
    """What pictures and words count from: the start of a simulated world's run on the node's clock; the first estimate where a log's stamps are
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


class Run:
    """The recorder's directory: run.json, estimates, innovations, status."""

    def __init__(self, directory):
        self.start_s = 0.0  # zero of all times
        path = os.path.join(directory, "run.json")
        self.about = read_json(path)
        self.estimates = read_table(os.path.join(directory, "estimates.csv"), ESTIMATES)
        if len(self.estimates["time_s"]) == 0:
            raise BadInput(f"{directory}/estimates.csv: no estimate in it")
        self.innovations = self._optional(directory, "innovations.csv", INNOVATIONS)
        self.status = self._optional(directory, "status.csv", STATUS, ["map_faults"])
        self.states = self._optional(directory, "states.csv", STATES)
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
    def _optional(directory, name, columns, also=()):
        path = os.path.join(directory, name)
        if os.path.exists(path):
            return read_table(path, columns, also)
        return empty_table(columns)

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
        """The estimator's attitudes, one row each, and beside them what was said last of everything else, where that is not too old; None
        where it publishes none."""
        states = States(self.states.where(self.states["estimator"] == estimator), self.of(estimator))
        return states if len(states["epoch"]) > 0 else None


class States:
    """Columns by name, a row for every attitude; "new NAME": whether that was said in this very epoch."""
    POSE = ("x_m", "y_m", "std_x_m", "std_y_m", "std_yaw_rad", "corr_xy", "pos_valid", "hdg_valid")

    def __init__(self, rows, pose):
        self._rows, self._pose = rows, pose
        self._at = np.flatnonzero(np.isfinite(rows["q_w"]))

    def __getitem__(self, name):
        if name in ("epoch", "time_s", *Q):
            return self._rows[name][self._at]
        source = self._pose if name.removeprefix("new ") in self.POSE else self._rows
        if not name.startswith("new "):
            return held_at(source["epoch"], source[name], self["epoch"], HELD_S / TICK_S)
        known = np.isfinite(source[name.removeprefix("new ")])
        return known[self._at] if source is self._rows else np.isin(self["epoch"], source["epoch"][known])


def names_of(kinds):
    """What the estimators are called: odometry, attitude, and fused for the best of the others: an inertial one before any other."""
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


class Truth:
    """Where the robot was, by time. `about` is the JSON beside NAME.truth.csv, when there is one.

    A simulated world says for each row which of the node's epochs it belongs to: then the rows are paired by epoch, because a fault may have
    made the clock of the bus jump, which the truth does not."""

    def __init__(self, path, max_gap_s=None):
        self.path = path
        self._rows = read_table(path, TRUTH, ["epoch", *TRUTH_MORE])
        self.has_more = all(name in self._rows for name in ("epoch", *TRUTH_MORE))
        epoch, time_s = self.epoch, self.time_s
        if epoch is not None and not (np.diff(epoch) > 0).all():
            raise BadInput(f"{path}: row {int(np.argmin(np.diff(epoch) > 0)) + 2}: epoch does not grow")
        if len(time_s) < 2:
            raise BadInput(f"{path}: fewer than two rows")
        for name in ("time_s", "x_m", "y_m"):
            known = np.isfinite(self._rows[name])
            if not known.all():
                raise BadInput(f"{path}: row {int(np.argmin(known)) + 1} has no {name}")
        steps = np.diff(time_s)
        if (steps < 0).any():
            raise BadInput(f"{path}: row {int(np.argmax(steps < 0)) + 2}: time goes back")
        self.max_gap_s = max(LEAST_GAP_S, 2.5 * float(np.median(steps))) if max_gap_s is None else max_gap_s
        self.has_yaw = bool(np.isfinite(self.yaw_rad).any())
        beside = path[:-len(".truth.csv")] + ".json" if path.endswith(".truth.csv") else ""
        self.about = read_json(beside) if beside and os.path.exists(beside) else {}
        self.is_reference = self.about.get("truth") == "gps track"

    def since(self, start):
        """The same, with times counted from `start` [s]."""
        later = copy.copy(self)
        later._rows = self._rows.since(start)
        return later

    def with_poses(self, x_m, y_m, yaw_rad):
        """The same with other poses in its rows."""
        other = copy.copy(self)
        other._rows = self._rows.with_columns(x_m=x_m, y_m=y_m, yaw_rad=yaw_rad)
        return other

    epoch = property(lambda self: self._rows["epoch"] if "epoch" in self._rows else None)
    time_s = property(lambda self: self._rows["time_s"])
    x_m = property(lambda self: self._rows["x_m"])
    y_m = property(lambda self: self._rows["y_m"])
    yaw_rad = property(lambda self: self._rows["yaw_rad"])

    def _in_epochs(self, epochs, names):
        """These columns by name, in these epochs; NaN where there is no row."""
        epoch = self.epoch
        found = np.clip(np.searchsorted(epoch, epochs), 0, len(epoch) - 1)
        known = epoch[found] == epochs
        return {name: np.where(known, self._rows[name][found], np.nan) for name in names}

    def of(self, rows):
        """x, y, yaw for rows of estimates."""
        if self.epoch is None:
            return self.at(rows["time_s"])
        return tuple(self._in_epochs(rows["epoch"], TRUTH[1:]).values())

    def more_of(self, epochs):
        """All that a simulated world says, for these epochs; None where the truth says only a pose."""
        return self._in_epochs(epochs, [*TRUTH[1:], *TRUTH_MORE]) if self.has_more else None

    def at(self, time_s):
        """x, y, yaw at the times given, linear in between; NaN outside of the truth and in its gaps."""
        known = self.time_s
        after = np.clip(np.searchsorted(known, time_s), 1, len(known) - 1)
        before = after - 1
        span = known[after] - known[before]
        with np.errstate(invalid="ignore", divide="ignore"):
            part = np.where(span > 0, (time_s - known[before]) / span, 0.0)
        inside = (time_s >= known[0]) & (time_s <= known[-1]) & ((span <= self.max_gap_s + 1e-9) | (part == 1.0))
        part = np.where(inside, part, np.nan)
        x, y, yaw = self.x_m, self.y_m, self.yaw_rad
        return (x[before] + part * (x[after] - x[before]), y[before] + part * (y[after] - y[before]),
                wrapped(yaw[before] + part * wrapped(yaw[after] - yaw[before])))


def errors(rows, truth):
    """Estimate minus truth of one estimator's rows: dx, dy, dyaw; NaN where there is no truth or the estimate is not valid."""
    dx, dy, dyaw = truth.of(rows)
    position, heading = rows["pos_valid"] == 1, rows["hdg_valid"] == 1
    for name, error, known in (("x_m", dx, position), ("y_m", dy, position), ("yaw_rad", dyaw, position & heading)):
        np.subtract(rows[name], error, out=error)
        error[~known] = np.nan
    return dx, dy, wrapped(dyaw)


def product(p, q):
    """Of quaternions, (w, x, y, z) in rows."""
    (a, b, c, d), (w, x, y, z) = p.T, q.T
    return np.stack([a * w - b * x - c * y - d * z, a * x + b * w + c * z - d * y, a * y - b * z + c * w + d * x, a * z + b * y - c * x + d * w], axis=1)


def turns(q, reference):
    """The turn from `reference` to `q` about east, north and up: rotation vectors of q reference*."""
    d = product(q, reference * [1, -1, -1, -1])
    d = d * np.where(d[:, :1] < 0, -1.0, 1.0) / np.linalg.norm(d, axis=1, keepdims=True)
    length = np.linalg.norm(d[:, 1:], axis=1, keepdims=True)
    with np.errstate(invalid="ignore", divide="ignore"):
        return d[:, 1:] * np.where(length > 1e-9, 2 * np.arctan2(length, d[:, :1]) / length, 2.0)


def quaternion(roll, pitch, yaw):
    """Rz(yaw) Ry(pitch) Rx(roll), as the world has it."""
    def about(axis, angle):
        q = np.zeros((len(angle), 4))
        q[:, 0], q[:, 1 + axis] = np.cos(angle / 2), np.sin(angle / 2)
        return q
    return product(product(about(2, yaw), about(1, pitch)), about(0, roll))


def correlation_matrices(of_01, of_02, of_12):
    """One 3 x 3 matrix a row, of the columns of its three correlations."""
    matrix = np.tile(np.eye(3), (len(of_01), 1, 1))
    for (i, j), column in {(0, 1): of_01, (0, 2): of_02, (1, 2): of_12}.items():
        matrix[:, i, j] = matrix[:, j, i] = column
    return matrix


def squares(error, sigma, correlation):
    """Normalised squared error of each row: of errors and their sigmas, with a matrix of correlations each."""
    scaled = (error / sigma)[:, :, None]
    return (scaled * np.linalg.solve(correlation, scaled)).sum(axis=(1, 2))


def three(source, names):
    return np.stack([source[name] for name in names], axis=1)


class Blocks:
    """Errors of an inertial estimate by block, and the sigmas it published: `error[name]` and `sigma[name]` with three columns and a row for
    every attitude; position east, north, up; attitude about east, north and up."""

    def __init__(self, states, true):
        self._states = states
        self.epoch, self.time_s = states["epoch"], states["time_s"]
        self.error = {"position": three(states, ["x_m", "y_m", "height_m"]) - three(true, ["x_m", "y_m", "z_m"])}
        self.sigma = {"position": three(states, ["std_x_m", "std_y_m", "std_height_m"])}
        self.error["attitude"] = turns(three(states, Q), quaternion(true["roll_rad"], true["pitch_rad"], true["yaw_rad"]))
        self.sigma["attitude"] = three(states, [*STD_TILT, "std_yaw_rad"])
        for name, columns in (("velocity", VELOCITY), ("gyro bias", GYRO_BIAS), ("acc bias", ACC_BIAS)):
            self.error[name] = three(states, columns) - three(true, columns)
            self.sigma[name] = three(states, [f"std_{one}" for one in columns])
        # A sigma of 0 is one below half a step of the bus.
        for name, (message, signal) in STEPS.items():
            self.sigma[name] = np.maximum(self.sigma[name], 0.5 * limits(message, signal)[0])
        # All of it was said in this very epoch: what turns and accelerates has another covariance a second later.
        self._whole = {name: np.all([states[f"new {column}"] for column in columns], axis=0) for name, columns in CORRELATIONS.items()}
        invalid = states["pos_valid"] != 1
        for error in self.error.values():
            error[invalid] = np.nan

    def white(self, name):
        """Errors in their own sigmas and without correlations, by the factor L of the covariance L L^T: independent with variance 1 where the
        estimate is what it says. NaN in rows in whose epoch the whole covariance was not said, and where something of it is not known."""
        # The estimate itself is rounded, too. That is independent: it is in the variances, and not in what two of them share.
        rounded = np.array([times * limits(*value)[0] / np.sqrt(12.0) for *value, times in VALUE_STEPS[name]])
        judged, correlation = np.hypot(self.sigma[name], rounded), three(self._states, CORRELATIONS[name])
        use = np.flatnonzero(self._whole[name] & np.isfinite(self.error[name] + judged + correlation).all(axis=1))
        a, b, c = (self.sigma[name][use] / judged[use]).T
        matrix = correlation_matrices(*(correlation[use].T * [a * b, a * c, b * c]))
        # Correlations are rounded, too: below their step nothing is told from none.
        least = limits(*(("Est2_Std", "CorrXY") if name == "position" else ("Est2_State", "CorrVelEN")))[0]
        short = np.maximum(0.0, least - np.linalg.eigvalsh(matrix)[:, 0]) if len(use) else np.empty(0)
        matrix += short[:, None, None] * np.eye(3)
        values = np.full((len(self.epoch), 3), np.nan)
        values[use] = np.linalg.solve(np.linalg.cholesky(matrix), (self.error[name][use] / judged[use])[:, :, None])[:, :, 0]
        return values

    def nees(self, name):
        """Of every row; NaN where white() is."""
        return (self.white(name) ** 2).sum(axis=1)

    def outside(self, name, sigmas=3.0):
        """Rows with an error beyond that many of its published sigmas, in any of the three."""
        with np.errstate(invalid="ignore"):
            return (np.abs(self.error[name]) > sigmas * self.sigma[name]).any(axis=1)


def blocks(run, estimator, truth):
    """None where the estimator or the truth says no more than a pose."""
    states = run.states_of(estimator) if run.kinds[estimator] != "Attitude" else None
    true = truth.more_of(states["epoch"]) if truth is not None and states is not None else None
    return None if true is None else Blocks(states, true)


def attitude_errors(run, estimator, truth):
    """(time, epoch, tilt, heading) of whoever publishes an attitude: the angle between true and estimated up, and the turn about the vertical, as
    `disagreement` of the firmware has them; None without."""
    states = run.states_of(estimator)
    true = truth.more_of(states["epoch"]) if truth is not None and states is not None else None
    if true is None:
        return None
    q = np.stack([states[name] for name in Q], axis=1)
    return states["time_s"], states["epoch"], *apart(q, quaternion(true["roll_rad"], true["pitch_rad"], true["yaw_rad"]))


def apart(q, reference):
    """(tilt, heading) from `reference` to `q`."""
    d = product(q, reference * [1, -1, -1, -1])
    tilt = 2 * np.arctan2(np.hypot(d[:, 1], d[:, 2]), np.hypot(d[:, 0], d[:, 3]))
    return tilt, wrapped(2 * np.arctan2(d[:, 3], d[:, 0]))


PART = 1 << 14  # epochs that are worked on at once


def disagreement(run):
    """(time, tilt, heading) between the attitude filter and the best estimate, where both publish an attitude at the same epoch; None else."""
    other = next((k for k in run.estimators if run.kinds[k] == "Attitude"), None)
    a, b = (None, None) if other is None else (run.states_of(other), run.states_of(run.best))
    if a is None or b is None:
        return None
    # They come in different epochs, and a robot that turns with 1 rad/s turns by 3 deg in the 50 ms between: the one is brought to the other's time.
    q, epochs, own = three(a, Q), b["epoch"], [b[name] for name in Q]
    tilt, heading = np.empty(len(epochs)), np.empty(len(epochs))
    for first in range(0, len(epochs), PART):  # in parts: a log of hours does not fit several times
        part = slice(first, first + PART)
        tilt[part], heading[part] = apart(np.stack([one[part] for one in own], axis=1), attitudes_at(a["epoch"], q, epochs[part], 0.2 / TICK_S))
    return b["time_s"], tilt, wrapped(-heading)


def attitudes_at(epoch, q, at, longest):
    """Quaternions between those before and after each of `at`, along the chord; NaN outside of them and where they are more than `longest` apart."""
    if len(epoch) < 2:
        return np.full((len(at), 4), np.nan)
    after = np.clip(np.searchsorted(epoch, at), 1, len(epoch) - 1)
    before = after - 1
    span = epoch[after] - epoch[before]
    part = ((at - epoch[before]) / span)[:, None]
    first, last = q[before], q[after]
    last = last * np.where((first * last).sum(axis=1, keepdims=True) < 0, -1.0, 1.0)
    between = (1 - part) * first + part * last
    inside = (at >= epoch[0]) & (at <= epoch[-1]) & (span <= longest)
    return np.where(inside[:, None], between / np.linalg.norm(between, axis=1, keepdims=True), np.nan)

def nees_by_row(rows, dx, dy, dyaw, dof):
    """Normalised squared error of each row; NaN without a published covariance or a known error. And how many covariances were of no use."""
    sigmas, errors_, correlations = ["std_x_m", "std_y_m", "std_yaw_rad"][:dof], [dx, dy, dyaw][:dof], ["corr_xy", "corr_x_yaw", "corr_y_yaw"]
    all_known = np.ones(len(dx), dtype=bool)
    for column in [*(rows[name] for name in [*sigmas, *correlations[:2 * dof - 3]]), *errors_]:
        all_known &= np.isfinite(column)
    known = np.flatnonzero(all_known)
    std, error = np.stack([rows[name][known] for name in sigmas], axis=1), np.stack([column[known] for column in errors_], axis=1)
    correlation = correlation_matrices(*(rows[name][known] for name in correlations))[:, :dof, :dof]
    positive = (std > 0).all(axis=1)
    if len(known):
        positive &= np.linalg.eigvalsh(correlation)[:, 0] > 1e-6
    values = np.full(len(dx), np.nan)
    values[known[positive]] = squares(error[positive], std[positive], correlation[positive])
    return values, int(np.count_nonzero(~positive))


def nees(rows, dx, dy, dyaw, dof):
    """The same of the rows that have one."""
    values, unusable = nees_by_row(rows, dx, dy, dyaw, dof)
    return values[np.isfinite(values)], unusable


def rms(values):
    values = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(values ** 2))) if len(values) else None


def bus_nis(run, estimator, names):
    """Of each sensor the bus's own mean NIS per degree of freedom over the run, 1 expected, and its counts at the end."""
    result = {}
    mine = run.sensors["estimator"] == estimator
    for sensor in np.unique(run.sensors["sensor"][mine]):
        rows = np.flatnonzero(mine & (run.sensors["sensor"] == sensor))
        nis = run.sensors["nis_mean"][rows]
        result[names["Sensor"].get(int(sensor), str(int(sensor)))] = {
            "nis_per_dof": float(np.nanmean(nis)) if np.isfinite(nis).any() else None,
            "accepted": unwrapped(run.sensors["accepted"][rows], 65536), "rejected": unwrapped(run.sensors["rejected"][rows], 4096)}
    return result


def unwrapped(counts, modulus):
    """How far a counter came that starts at 0 and wraps."""
    return int(np.mod(np.diff(np.concatenate([[0], counts])), modulus).sum())


def degrees(value):
    return None if value is None else float(np.degrees(value))


def measurements(innovations, estimator, names):
    """By sensor: accepted, rejected, other, and the innovations' NIS, as published in Est_Innov."""
    result = {}
    mine = innovations["estimator"] == estimator
    for sensor in np.unique(innovations["sensor"][mine]):
        rows = mine & (innovations["sensor"] == sensor)
        verdict = innovations["verdict"][rows]
        accepted, rejected = verdict == 0, verdict == 1
        nis, dof = innovations["nis"][rows], innovations["dof"][rows]
        tested = (accepted | rejected) & np.isfinite(nis)
        one = {"accepted": int(accepted.sum()), "rejected": int(rejected.sum()), "other": int((~accepted & ~rejected).sum())}
        one["verdicts"] = {names["Verdict"].get(int(v), str(int(v))): int((verdict == v).sum()) for v in np.unique(verdict)}
        if tested.any():
            bound = np.array([chi_square(0.95, max(int(d), 1)) for d in np.unique(dof[tested])])[np.searchsorted(np.unique(dof[tested]), dof[tested])]
            use = accepted & np.isfinite(nis)
            one["nis_mean"] = float(nis[use].mean()) if use.any() else None
            one["nis_mean_with_rejected"] = float(nis[tested].mean())
            one["nis_expected"] = float(dof[tested].mean())
            one["nis_inside_95"] = float((nis[tested] <= bound).mean())
        result[names["Sensor"].get(int(sensor), str(int(sensor)))] = one
    return result


def judge(run, estimator, truth, names):
    """The metrics of one estimator. Without truth: what can be said without."""
    rows = run.of(estimator)
    valid = rows["pos_valid"] == 1
    result = {"name": run.names[estimator], "kind": run.kinds[estimator],
              "epochs": int(len(valid)), "epochs_not_valid": int((~valid).sum()),
              "measurements": measurements(run.innovations, estimator, names)}
    for sensor, counts in bus_nis(run, estimator, names).items():
        if counts["nis_per_dof"] is not None or sensor in result["measurements"]:
            one = result["measurements"].setdefault(sensor, {"accepted": 0, "rejected": 0, "other": 0, "verdicts": {}})
            if counts["nis_per_dof"] is not None:
                one["bus_nis_per_dof"] = counts["nis_per_dof"]
            if counts["accepted"] + counts["rejected"] > MOST_FRAMED * (one["accepted"] + one["rejected"]):
                one.update(accepted=counts["accepted"], rejected=counts["rejected"], counted="by the node: too fast for a frame each")
    if valid.any():
        last = np.flatnonzero(valid)[-1]
        result["end"] = {"time_s": float(rows["time_s"][last]), "x_m": float(rows["x_m"][last]), "y_m": float(rows["y_m"][last]),
                         "yaw_rad": float(rows["yaw_rad"][last])}
    empty = dict.fromkeys(["position_rmse_m", "heading_rmse_deg", "final_error_m", "max_error_m", "nees_mean", "nees_inside_95",
                           "nees_inside_two_sided_95", "recovered_after_s"])
    result.update(empty, epochs_with_truth=0)
    result.update(graph.figures(run, estimator, names))
    if truth is None:
        return result
    attitude = attitude_errors(run, estimator, truth)
    if attitude is not None:
        _, _, tilt, turn = attitude
        result.update(tilt_rmse_deg=degrees(rms(tilt)), attitude_heading_rmse_deg=degrees(rms(turn)))
    dx, dy, dyaw = errors(rows, truth)
    distance = np.hypot(dx, dy)
    known = np.flatnonzero(np.isfinite(distance))
    result["epochs_with_truth"] = len(known)
    if len(known) == 0:
        return result
    heading = rms(dyaw)
    result.update(position_rmse_m=rms(distance), heading_rmse_deg=None if heading is None else float(np.degrees(heading)),
                  final_error_m=float(distance[known[-1]]), max_error_m=float(distance[known].max()))
    if np.isfinite(dyaw).any():
        result["final_heading_error_deg"] = float(np.degrees(dyaw[np.isfinite(dyaw)][-1]))
    result["recovered_after_s"] = recovered_after_s(rows["time_s"], distance, valid)
    if truth.is_reference:  # the reference is fused itself and has errors of its own: consistency with it says nothing
        return result
    dof = 3 if truth.has_yaw else 2
    values, unusable = nees(rows, dx, dy, dyaw, dof)
    result.update(own_map.figures(run, estimator, truth, dx, dy))
    del dx, dy, dyaw, distance, known, valid  # of millions of rows, and the blocks need as much
    found = blocks(run, estimator, truth)
    if found is not None:
        result["blocks"] = {name: block_figures(found, name) for name in BLOCKS}
    result.update(nees_dof=dof, nees_epochs=len(values), nees_covariances_not_usable=unusable)
    if len(values):
        low, high = chi_square(0.025, dof), chi_square(0.975, dof)
        result.update(nees_mean=float(values.mean()), nees_inside_95=float((values <= chi_square(0.95, dof)).mean()),
                      nees_inside_two_sided_95=float(((values >= low) & (values <= high)).mean()))
    return result


RECOVERED_M, RECOVERED_S = 0.5, 10.0  # a robot is found when its valid estimate stays so near to the truth for so long


def recovered_after_s(time_s, distance_m, valid):
    """Begin of the first span of RECOVERED_S in which every estimate is valid and right, from the begin of the truth; None without one."""
    known = np.flatnonzero(np.isfinite(distance_m))
    time_s, right = time_s[known], (distance_m[known] <= RECOVERED_M) & valid[known]
    begins = np.flatnonzero(right & ~np.concatenate([[False], right[:-1]]))
    for begin in begins:
        wrong = np.flatnonzero(~right[begin:])
        end = time_s[begin + wrong[0]] if len(wrong) else time_s[-1]
        if end - time_s[begin] >= RECOVERED_S:
            return float(time_s[begin] - time_s[0])
    return None


def block_figures(found, name):
    """RMSE of each of the three, NEES (3 expected), and the share of times at which all three are inside 3 sigma."""
    values = found.nees(name)
    known, both = np.isfinite(values), np.isfinite(found.error[name] + found.sigma[name]).all(axis=1)
    low, high = chi_square(0.025, 3), chi_square(0.975, 3)
    return {"unit": UNITS[name], "rmse": [rms(column) for column in found.error[name].T],
            "nees_mean": float(values[known].mean()) if known.any() else None,
            "nees_inside_two_sided_95": float(((values[known] >= low) & (values[known] <= high)).mean()) if known.any() else None,
            "inside_3_sigma": float(1 - found.outside(name)[both].mean()) if both.any() else None}


QUIET_S = 2.0  # rejections less than this apart are told as one
MISSED_S = 1.0  # a sensor is missed after so long
RESET_WORDS = {"PositionJump": "position moved by", "HeadingWrong": "heading turned by"}


def story(run):
    """What happened, in words: (time, text), from what the node said of itself, what its best estimate refused, and what the world did to it."""
    names = code_names()
    told = [(start, f"the world: {name}" + (f", for {end - start:.1f} s" if end > start else "")) for name, start, end in fault_spans(run)]
    status = run.status
    at = status["time_s"]
    for i in np.flatnonzero(np.diff(status["mode"], prepend=np.nan) != 0) if len(at) else []:
        told.append((at[i], f"mode {names['Mode'].get(int(status['mode'][i]), int(status['mode'][i]))}"))
    for column, table, bit in [("faults", "Fault", bit) for bit in range(16)] + [("map_faults", "MapFault", bit) for bit in range(3) if "map_faults" in status]:
        on = np.nan_to_num(status[column]).astype(np.int64) >> bit & 1
        edges = np.flatnonzero(np.diff(on, prepend=0, append=0))
        spans = [[at[a], at[min(b, len(at) - 1)]] for a, b in zip(edges[::2], edges[1::2])]
        for start, end in joined(spans, QUIET_S):
            told.append((start, f"fault {names[table].get(bit, f'bit {bit}')}, for {end - start:.1f} s"))
    for bit, sensor in names["Sensor"].items():
        used = np.nan_to_num(status["used"]).astype(np.int64) >> bit & 1
        if not used.any():
            continue
        first = int(np.argmax(used))
        edges = first + np.flatnonzero(np.diff(used[first:]) != 0)  # down, up, down, ...
        edges = np.append(edges, len(at) - 1) if len(edges) % 2 else edges
        for a, b in zip(edges[::2], edges[1::2]):
            if at[b] - at[a] > MISSED_S:
                told.append((at[a + 1], f"{sensor} gives nothing that is used, for {at[b] - at[a]:.1f} s"))
    for i in np.flatnonzero(np.diff(status["reset_ctr"]) != 0) + 1 if len(at) else []:
        cause = names["ResetCause"].get(int(status["reset_cause"][i]), "?")
        told.append((at[i], f"reset: {cause}{jump_words(run, at[i], cause)}"))
    rows = run.innovations
    for sensor in np.unique(rows["sensor"][rows["estimator"] == run.best]):
        for verdict in np.unique(rows["verdict"]):
            mine = (rows["estimator"] == run.best) & (rows["sensor"] == sensor) & (rows["verdict"] == verdict)
            if verdict == 0 or not mine.any():
                continue
            times = rows["time_s"][mine]
            word = names["Verdict"].get(int(verdict), "?")
            for start, end in joined([[t, t] for t in times], QUIET_S):
                count = int(((times >= start) & (times <= end)).sum())
                what = f"{names['Sensor'].get(int(sensor), int(sensor))} {word}"
                told.append((start, f"{what}, {count} times until {end:.1f} s" if count > 1 else what))
    return sorted(told, key=lambda one: one[0])


def joined(spans, apart_s):
    """Spans (start, end) in order of time, those less than `apart_s` apart as one."""
    result = []
    for start, end in spans:
        if result and start - result[-1][1] < apart_s:
            result[-1][1] = end
        else:
            result.append([start, end])
    return result


def jump_words(run, time_s, cause):
    """How large the step was that came with a reset, as the page says that follows it."""
    rows = run.states
    after = np.flatnonzero((rows["estimator"] == run.best) & (rows["time_s"] >= time_s) & np.isfinite(rows["jump_x_m"]))
    if len(after) == 0 or cause not in RESET_WORDS:
        return ""
    i = after[0]
    if cause == "HeadingWrong":
        return f", {RESET_WORDS[cause]} {np.degrees(rows['jump_yaw_rad'][i]):.1f} deg"
    # Its height is in another frame, which may be that of an epoch later.
    later = np.flatnonzero((rows["estimator"] == run.best) & (rows["time_s"] >= time_s) & np.isfinite(rows["jump_z_m"]))
    up = f", {rows['jump_z_m'][later[0]]:.2f} m up" if len(later) else ""
    return f", {RESET_WORDS[cause]} {rows['jump_x_m'][i]:.2f} m east, {rows['jump_y_m'][i]:.2f} m north{up}"


OF_THE_LOG = {"malformed_lines": "malformed lines skipped", "frames_not_data": "remote, error or CAN FD frames skipped",
              "frames_back_in_time": "frames are earlier than one before them", "frames_of_wrong_length": "input frames have not 8 bytes"}


def warnings_of(run, judged):
    """What makes the numbers of the run doubtful as a whole, its log first. Odometry is left out: it drifts, and nothing tests it."""
    log = [f"{run.about[count]} {words}" for count, words in OF_THE_LOG.items() if run.about.get(count)]
    cause = f"fault {', '.join(one.words for one in faults(run))}" if faults(run) else (
        f"is {run.about['robot']} the robot of this log?" if run.about.get("robot") else "the wrong robot for this log?")
    found = []
    for one in judged:
        if one["kind"] == "Odometry":
            continue
        for sensor, counts in one["measurements"].items():
            tested = counts["accepted"] + counts["rejected"]
            if tested >= LEAST_TESTED and counts["rejected"] > MOST_REJECTED * tested:
                found.append(f"{one['name']} rejected {counts['rejected']} of {tested} {sensor} measurements")
        if one["nees_mean"] is not None and one["nees_mean"] > MOST_NEES:
            found.append(f"NEES mean of {one['name']} is {one['nees_mean']:.0f}, not {one['nees_dof']}")
        if one.get("converged") is False:
            state = "is under way at the end" if one["graph"]["optimisation_under_way"] else f"ended with {one['graph']['status']}"
            found.append(f"the graph of {one['name']} did not converge: its last optimisation {state}")
        if one["kind"] != "Attitude" and one["epochs"] == one["epochs_not_valid"]:
            found.append(f"{one['name']} never had a valid position" + (last_mode(run) if one["name"] == run.names[run.best] else ""))
    length_s = float(run.estimates["time_s"][-1] - run.estimates["time_s"][0])
    late = [f"{one.words}, after the end of the run ({length_s:.0f} s)" for one in faults(run) if one.start_s is not None and one.start_s > length_s]
    return (log + ([f"{'; '.join(found)} ({cause})"] if found else []) + [f"fault {one}: it did not happen" for one in late]
            + wheels_without_noise(run))


def last_mode(run):
    """The mode in which the node stayed, and for how long; nothing without a status."""
    mode, time_s = run.status["mode"], run.status["time_s"]
    if not len(mode):
        return ""
    since = int(np.flatnonzero(mode != mode[-1])[-1]) + 1 if (mode != mode[-1]).any() else 0
    word = code_names()["Mode"].get(int(mode[-1]), int(mode[-1]))
    return f": its mode was {word} for the last {time_s[-1] - time_s[since]:.0f} s"


# Sensor: parameters that make its noise, one of each group above 0.
WHEEL_NOISE = {"WheelCounts": [["wheels.drive.noise_left"], ["wheels.drive.noise_right"]],
               "WheelSpeed": [["wheels.wheel_speed_noise", "wheels.drive.noise_left"], ["wheels.wheel_speed_noise", "wheels.drive.noise_right"]],
               "BodySpeed": [["wheels.noise.speed", "wheels.noise.speed_per_speed"]]}


def wheels_without_noise(run):
    """A sentence for each wheel sensor that is used while its noise is 0: the covariance of dead reckoning then does not grow with the way."""
    parameters, names = run.about.get("parameters"), code_names()["Sensor"]
    if not isinstance(parameters, dict):
        return []
    used = set()
    for estimator, sensor in {(int(k), int(s)) for k, s in zip(*(run.sensors[name][run.sensors["accepted"] > 0] for name in ("estimator", "sensor")))}:
        if run.kinds.get(estimator) != "Inertial" or names.get(sensor) == "WheelCounts":  # inertial navigation has parameters of its own for speeds
            used.add(names.get(sensor))
    found = []
    for sensor in sorted(used & set(WHEEL_NOISE)):
        zero = sorted({path for group in WHEEL_NOISE[sensor] if not any(parameters.get(path, 1) > 0 for path in group) for path in group})
        if zero:
            found.append(f"{sensor} are used, but {' and '.join(zero)} {'is' if len(zero) == 1 else 'are'} 0: the covariance does not grow with the way "
                         "(docs/tutorial/your_robot.md has usual values)")
    return found


def summary(run, truth):
    """All of summary.json: what the player wrote, then what was computed here."""
    names = code_names()
    result = dict(run.about)
    result["truth"] = None if truth is None else {
        "file": os.path.basename(truth.path), "kind": truth.about.get("truth", "truth"), "is_reference": truth.is_reference,
        "has_yaw": truth.has_yaw, "max_gap_s": truth.max_gap_s}
    judged = [judge(run, estimator, truth, names) for estimator in run.estimators]
    result.update({one["name"]: one for one in judged})
    result["warnings"] = warnings_of(run, judged)
    best = result[run.names[run.best]]
    for name in ("position_rmse_m", "heading_rmse_deg", "recovered_after_s"):
        result[name] = best[name]
    for name in ("trajectory_rmse_aligned_m", "map_rmse_m", "wrong_associations"):
        if name in best:
            result[name] = best[name]
            result["pose_nees_mean"] = best["nees_mean"]
    result.update({name: best[name] for name in ("chi2", "converged", "poses", "edges_refused") if name in best})
    return result
