# SPDX-License-Identifier: Apache-2.0
"""The figures of a run's estimators: summary.json."""
import os

import numpy as np

from tetap.report import graph, own_map
from tetap.report.events import warnings_of
from tetap.report.ground_truth import errors
from tetap.report.normalised_error import BLOCKS, attitude_errors, block_figures, blocks, chi_square, nees, rms
from tetap.report.recorded_run import code_names

MOST_FRAMED = 1.5  # a sensor with so many more measurements than frames about them is judged by the node's own counts


def bus_nis(run, estimator, names):
    """By sensor: the published mean NIS per degree of freedom over the run (1 expected), and the counts at the end."""
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
    """The metrics of one estimator. Without truth: the figures that need none."""
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
    if truth.is_reference:  # the reference is fused itself and has errors of its own: consistency with it means nothing
        return result
    dof = 3 if truth.has_yaw else 2
    values, unusable = nees(rows, dx, dy, dyaw, dof)
    result.update(own_map.figures(run, estimator, truth, dx, dy))
    del dx, dy, dyaw, distance, known, valid  # arrays of millions of rows, and the blocks need as much
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
