# SPDX-License-Identifier: Apache-2.0
"""The figures of a run's estimators: summary.json."""
import os

import numpy as np

from tetap.report import graph, own_map
from tetap.report.events import warnings_of
from tetap.report.ground_truth import errors
from tetap.report.normalised_error import BLOCKS, UNITS, attitude_errors, blocks, chi_square, nees
from tetap.report.recorded_run import code_names

MOST_FRAMED = 1.5  # a sensor with so many more measurements than frames about them is judged by the node's own counts


def bus_nis(run, estimator, names):
    """By sensor: the published mean NIS per degree of freedom over the run (1 expected), and the counts at the end."""
    result = {}
    mine = run.sensors["estimator"] == estimator
    for sensor in np.unique(run.sensors["sensor"][mine]):
        rows = np.flatnonzero(mine & (run.sensors["sensor"] == sensor))
        nis = run.sensors["nis_mean"][rows]
        accepted, rejected = counted(run.sensors, rows)
        result[names["Sensor"].get(int(sensor), str(int(sensor)))] = {
            "nis_per_dof": float(np.nanmean(nis)) if np.isfinite(nis).any() else None, "accepted": accepted, "rejected": rejected}
    return result


def counted(sensors, rows):
    """(accepted, rejected) of these rows of sensors.csv: each instance has counters of its own."""
    of = [rows[sensors["inst"][rows] == one] for one in np.unique(sensors["inst"][rows])]
    return tuple(sum(unwrapped(sensors[name][one], modulus) for one in of) for name, modulus in (("accepted", 65536), ("rejected", 4096)))


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


class Mean:
    """The mean of values that come in parts; None of none."""

    def __init__(self):
        self._sum, self.count = 0.0, 0

    def add(self, values):
        self._sum, self.count = self._sum + np.add.reduce(values, dtype=np.float64), self.count + len(values)

    def value(self):
        return float(self._sum / self.count) if self.count else None


class MeanSquare(Mean):
    """Of the finite ones."""

    def add(self, values):
        super().add(values[np.isfinite(values)] ** 2)

    def root(self):
        return float(np.sqrt(self._sum / self.count)) if self.count else None


class BlockFigures:
    """RMSE of each of the three, NEES (3 expected), and the share of times at which all three are inside 3 sigma."""

    def __init__(self, name):
        self._name = name
        self._squares, self._nees, self._inside, self._outside = [MeanSquare() for _ in range(3)], Mean(), Mean(), Mean()

    def add(self, found):
        values = found.nees(self._name)
        values = values[np.isfinite(values)]
        both = np.isfinite(found.error[self._name] + found.sigma[self._name]).all(axis=1)
        for square, column in zip(self._squares, found.error[self._name].T):
            square.add(column)
        self._nees.add(values)
        self._inside.add((values >= chi_square(0.025, 3)) & (values <= chi_square(0.975, 3)))
        self._outside.add(found.outside(self._name)[both])

    def figures(self):
        return {"unit": UNITS[self._name], "rmse": [square.root() for square in self._squares], "nees_mean": self._nees.value(),
                "nees_inside_two_sided_95": self._inside.value(), "inside_3_sigma": 1 - self._outside.value() if self._outside.count else None}


RECOVERED_M, RECOVERED_S = 0.5, 10.0  # a robot is found when its valid estimate stays so near to the truth for so long


class Recovery:
    """Begin of the first span of RECOVERED_S in which every estimate is valid and right, from the begin of the truth; None without one."""

    def __init__(self):
        self._start = self._begin = self._last = self._found = None

    def add(self, time_s, distance_m, valid):
        known = np.flatnonzero(np.isfinite(distance_m))
        if len(known) == 0:
            return
        time_s, right = time_s[known], (distance_m[known] <= RECOVERED_M) & valid[known]
        self._start = time_s[0] if self._start is None else self._start
        for edge in np.flatnonzero(np.diff(right, prepend=self._begin is not None)):
            if right[edge]:
                self._begin = time_s[edge]
            else:
                self._close(time_s[edge])
        self._last = time_s[-1]

    def _close(self, end_s):
        if self._found is None and self._begin is not None and end_s - self._begin >= RECOVERED_S:
            self._found = float(self._begin - self._start)
        self._begin = None

    def value(self):
        if self._last is not None:
            self._close(self._last)
        return self._found


class Judgement:
    """The metrics of one estimator, part by part of the run. Without truth: the figures that need none."""

    def __init__(self, run, estimator, truth, names):
        self._run, self._estimator, self._truth, self._names = run, estimator, truth, names
        self._epochs = self._not_valid = self._with_truth = self._unusable = 0
        self._end = self._last_m = self._most_m = self._last_heading = None
        self._tilt, self._turn, self._distance, self._heading = (MeanSquare() for _ in range(4))
        self._recovery = Recovery()
        self._dof = 3 if truth is not None and truth.has_yaw else 2
        self._nees, self._inside, self._two_sided = Mean(), Mean(), Mean()
        self._has_attitude, self._blocks = False, {}

    def add(self, run, truth):
        """A part of the run, and of the truth."""
        rows = run.of(self._estimator)
        valid = rows["pos_valid"] == 1
        self._epochs += int(len(valid))
        self._not_valid += int((~valid).sum())
        if valid.any():
            last = np.flatnonzero(valid)[-1]
            self._end = {"time_s": float(rows["time_s"][last]), "x_m": float(rows["x_m"][last]), "y_m": float(rows["y_m"][last]),
                         "yaw_rad": float(rows["yaw_rad"][last])}
        if truth is not None:
            self._compare(run, rows, valid, truth)

    def _compare(self, run, rows, valid, truth):
        attitude = attitude_errors(run, self._estimator, truth)
        if attitude is not None:
            self._has_attitude = True
            self._tilt.add(attitude[2])
            self._turn.add(attitude[3])
        dx, dy, dyaw = errors(rows, truth)
        distance = np.hypot(dx, dy)
        known = np.isfinite(distance)
        self._with_truth += int(known.sum())
        if not known.any():
            return
        self._distance.add(distance)
        self._heading.add(dyaw)
        self._last_m = float(distance[known][-1])
        self._most_m = max(float(distance[known].max()), self._most_m or 0.0)
        if np.isfinite(dyaw).any():
            self._last_heading = float(np.degrees(dyaw[np.isfinite(dyaw)][-1]))
        self._recovery.add(rows["time_s"], distance, valid)
        if truth.is_reference:  # the reference is fused itself and has errors of its own: consistency with it means nothing
            return
        values, unusable = nees(rows, dx, dy, dyaw, self._dof)
        self._unusable += unusable
        self._nees.add(values)
        low, high = chi_square(0.025, self._dof), chi_square(0.975, self._dof)
        self._inside.add(values <= chi_square(0.95, self._dof))
        self._two_sided.add((values >= low) & (values <= high))
        del dx, dy, dyaw, distance, known, valid  # the blocks need as much again
        found = blocks(run, self._estimator, truth)
        for name in BLOCKS if found is not None else []:
            self._blocks.setdefault(name, BlockFigures(name)).add(found)

    def figures(self):
        """The estimator's part of summary.json."""
        run, estimator, names, truth = self._run, self._estimator, self._names, self._truth
        result = {"name": run.names[estimator], "kind": run.kinds[estimator], "epochs": self._epochs, "epochs_not_valid": self._not_valid,
                  "measurements": measurements(run.innovations, estimator, names)}
        for sensor, counts in bus_nis(run, estimator, names).items():
            if counts["nis_per_dof"] is not None or sensor in result["measurements"]:
                one = result["measurements"].setdefault(sensor, {"accepted": 0, "rejected": 0, "other": 0, "verdicts": {}})
                if counts["nis_per_dof"] is not None:
                    one["bus_nis_per_dof"] = counts["nis_per_dof"]
                if counts["accepted"] + counts["rejected"] > MOST_FRAMED * (one["accepted"] + one["rejected"]):
                    one.update(accepted=counts["accepted"], rejected=counts["rejected"], counted="by the node: too fast for a frame each")
        if self._end is not None:
            result["end"] = self._end
        empty = dict.fromkeys(["position_rmse_m", "heading_rmse_deg", "final_error_m", "max_error_m", "nees_mean", "nees_inside_95",
                               "nees_inside_two_sided_95", "recovered_after_s"])
        result.update(empty, epochs_with_truth=0)
        result.update(graph.figures(run, estimator, names))
        if truth is None:
            return result
        if self._has_attitude:
            result.update(tilt_rmse_deg=degrees(self._tilt.root()), attitude_heading_rmse_deg=degrees(self._turn.root()))
        result["epochs_with_truth"] = self._with_truth
        if self._with_truth == 0:
            return result
        result.update(position_rmse_m=self._distance.root(), heading_rmse_deg=degrees(self._heading.root()),
                      final_error_m=self._last_m, max_error_m=self._most_m)
        if self._last_heading is not None:
            result["final_heading_error_deg"] = self._last_heading
        result["recovered_after_s"] = self._recovery.value()
        if truth.is_reference:
            return result
        dx, dy, _ = errors(run.of(estimator), truth)
        result.update(own_map.figures(run, estimator, truth, dx, dy))
        if self._blocks:
            result["blocks"] = {name: block.figures() for name, block in self._blocks.items()}
        result.update(nees_dof=self._dof, nees_epochs=self._nees.count, nees_covariances_not_usable=self._unusable)
        if self._nees.count:
            result.update(nees_mean=self._nees.value(), nees_inside_95=self._inside.value(), nees_inside_two_sided_95=self._two_sided.value())
        return result


def parts_of(run, truth):
    """(run, truth) of each part."""
    truths = truth.parts() if truth is not None and truth.is_sample else None
    true_number, true = -1, truth
    for number, part in run.parts():
        while truths is not None and true_number is not None and true_number < number:
            true_number, true = next(truths, (None, None))
        yield part, true if truths is None or true_number == number else None


def summary(run, truth):
    """All of summary.json: what the player wrote, then what was computed here."""
    names = code_names()
    result = dict(run.about)
    result["truth"] = None if truth is None else {
        "file": os.path.basename(truth.path), "kind": truth.about.get("truth", "truth"), "is_reference": truth.is_reference,
        "has_yaw": truth.has_yaw, "max_gap_s": truth.max_gap_s}
    judgements = [Judgement(run, estimator, truth, names) for estimator in run.estimators]
    for part, true in parts_of(run, truth):
        for one in judgements:
            one.add(part, true)
    judged = [one.figures() for one in judgements]
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
