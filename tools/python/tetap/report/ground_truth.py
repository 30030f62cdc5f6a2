# SPDX-License-Identifier: Apache-2.0
"""The true or reference path of a run, by time or by epoch, and the errors of an estimate against it."""
import copy
import os

import numpy as np

from tetap.can.bus_writer import BadInput
from tetap.report import recorded_run
from tetap.report.attitude import wrapped
from tetap.report.recorded_run import ACC_BIAS, GYRO_BIAS, VELOCITY, read_json, seconds
from tetap.report.tables import read_parts, read_table

LEAST_GAP_S = 0.2  # truth rows further apart than this, or than 2.5 times their usual distance, are not interpolated between
MOST_APART_S = 1.0  # between the time of the first common epoch in truth and run: more, and the epochs are those of another run
TRUTH = ["time_s", "x_m", "y_m", "yaw_rad"]  # then optionally "epoch" and TRUTH_MORE
TRUTH_MORE = ["z_m", "roll_rad", "pitch_rad", *VELOCITY, *GYRO_BIAS, *ACC_BIAS]


class Truth:
    """Where the robot was, by time. `about` is the JSON beside NAME.truth.csv, when there is one.

    The truth of a simulated world has the node's epoch in each row. Then the rows are paired by epoch, because a fault may have
    made the clock of the bus jump, which the truth does not."""

    def __init__(self, path, max_gap_s=None, every=1):
        """`every`: that of a long run (recorded_run.Run), of which the truth of a world is a sample too."""
        self.path = path
        beside = path[:-len(".truth.csv")] + ".json" if path.endswith(".truth.csv") else ""
        self.about = read_json(beside) if beside and os.path.exists(beside) else {}
        self._rows = read_table(path, TRUTH, ["epoch", *TRUTH_MORE], seconds(every))
        self.is_sample = every > 1 and "epoch" in self._rows
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
        self.is_reference = self.about.get("truth") == "gps track"

    def paired_with(self, run):
        """The truth as this run is to be compared with it: by epoch, or by time where the log is a part of a world's run, whose epochs begin at
        1 again. BadInput where no estimate has a truth."""
        rows = run.estimates
        if self.epoch is not None and "seed" not in run.about:
            true_s = self._in_epochs(rows["epoch"], ["time_s"])["time_s"]
            known = np.flatnonzero(np.isfinite(true_s))
            # A clock that jumps does so after the start: the first common epoch shows whose run it is.
            if len(known) > 0 and abs(rows["time_s"][known[0]] - true_s[known[0]]) > MOST_APART_S and np.isfinite(self.at(rows["time_s"])[0]).any():
                return self.by_time()
        if not np.isfinite(self.of(rows)[0]).any():
            raise BadInput(f"{self.path}: no row meets an estimate: the truth is of {self.time_s[0]:.6f} to {self.time_s[-1]:.6f} s, the node's time "
                           f"(that of In_Sync, else of the log) of {rows['time_s'].min():.6f} to {rows['time_s'].max():.6f} s")
        return self

    def by_time(self):
        """The same, paired by time alone."""
        other = copy.copy(self)
        other._rows = read_table(self.path, TRUTH) if self.is_sample else self._rows.without("epoch")
        other.has_more = other.is_sample = False
        return other

    def parts(self):
        """(number, the truth with the rows of that part alone), of a sample: the parts of recorded_run.Run.parts."""
        for number, rows in read_parts(self.path, TRUTH, ["epoch", *TRUTH_MORE], recorded_run.SPAN):
            part = copy.copy(self)
            part._rows = rows
            yield number, part

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
        if len(epoch) == 0:
            return {name: np.full(len(epochs), np.nan) for name in names}
        found = np.clip(np.searchsorted(epoch, epochs), 0, len(epoch) - 1)
        known = epoch[found] == epochs
        return {name: np.where(known, self._rows[name][found], np.nan) for name in names}

    def of(self, rows):
        """x, y, yaw for rows of estimates."""
        if self.epoch is None:
            return self.at(rows["time_s"])
        return tuple(self._in_epochs(rows["epoch"], TRUTH[1:]).values())

    def more_of(self, epochs):
        """All columns of a simulated world's truth, for these epochs; None where the truth has only a pose."""
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
