# SPDX-License-Identifier: Apache-2.0
"""Figures of one run of a campaign, and the averages over the seeds.

NEES and NIS with their intervals: Bar-Shalom, Li, Kirubarajan, "Estimation with Applications to Tracking and Navigation", section 5.4.2.
"""
import numpy as np
from scipy.special import stdtrit

from tetap.report import ground_truth, metrics, normalised_error, recorded_run

SETTLED_S = 10.0  # after the end of a fault: "after" begins
BEFORE_S = 20.0   # words of the status so long before a fault are not an effect of it
TOO_SURE_S = 1.0  # an error beyond 3 sigma for longer than this is one that was not reported
DOF = 3           # x, y, yaw; and of each block
SHARE = 0.95
DRAWS, LEAST_TIMES, LEAST_SEEDS = 200, 20, 30  # numbers of by_chance()


def judged(run, truth, job):
    """The sums and series of one run, small enough to be kept for every seed."""
    result = {"duration_s": float(truth.time_s[-1] - truth.time_s[0]), "estimators": {}}
    names = recorded_run.code_names()
    since_start = truth.time_s - truth.time_s[0]
    for k in run.estimators:
        rows = run.of(k)
        dx, dy, dyaw = ground_truth.errors(rows, truth)
        distance = np.hypot(dx, dy)
        nees, unusable = normalised_error.nees_by_row(rows, dx, dy, dyaw, DOF)
        published = np.isfinite(rows["std_x_m"])
        one = {"position_rmse_m": normalised_error.rms(distance), "heading_rmse_rad": normalised_error.rms(dyaw), "unusable": unusable,
               "epochs": rows["epoch"][published], "nees": nees[published], "valid_share": float(np.isfinite(distance).mean()),
               "sensors": innovations(run.innovations, k, names), "bus": metrics.bus_nis(run, k, names)}
        found, attitude = normalised_error.blocks(run, k, truth), normalised_error.attitude_errors(run, k, truth)
        if attitude is not None:
            one["tilt_rmse_rad"], one["turn_rmse_rad"] = normalised_error.rms(attitude[2]), normalised_error.rms(attitude[3])
        if found is not None:
            one["blocks"] = {}
            for name in normalised_error.BLOCKS:
                white = found.white(name)
                whole = np.isfinite(white).all(axis=1)
                one["blocks"][name] = {"epochs": found.epoch[whole], "white": white[whole], "nees": (white[whole] ** 2).sum(axis=1),
                                       "rmse": normalised_error.rms(np.linalg.norm(found.error[name], axis=1)), "inside_3_sigma": inside(found, name)}
        if job.get("fault_times"):
            at = since_start[rows["epoch"].astype(int) - 1]
            start, end = job["fault_times"]
            during, after = (at >= start) & (at < end + SETTLED_S), at >= end + SETTLED_S
            one["during_max_m"], one["during_max_rad"] = largest(distance[during]), largest(np.abs(dyaw[during]))
            one["after_rmse_m"], one["after_rmse_rad"] = normalised_error.rms(distance[after]), normalised_error.rms(dyaw[after])
            one.update(outage(rows, dx, dy, truth, start, end, since_start))
            one.update(honesty(rows, dx, dy, found, at, start, end))
        result["estimators"][run.names[k]] = one
    if job.get("fault_times"):
        result["said"] = said(run, names, *job["fault_times"])
    return result


def largest(values):
    return float(np.nanmax(values)) if np.isfinite(values).any() else None


def inside(found, name):
    known = np.isfinite(found.error[name] + found.sigma[name]).all(axis=1)
    return float(1 - found.outside(name)[known].mean()) if known.any() else None


def outage(rows, dx, dy, truth, start, end, since_start):
    """How far the estimate went astray from the start of a fault to its end, and how far the robot drove."""
    epochs = np.searchsorted(since_start, [start, end])
    epochs = np.clip(epochs, 0, len(since_start) - 1)
    driven = float(np.hypot(np.diff(truth.x_m[epochs[0]:epochs[1] + 1]), np.diff(truth.y_m[epochs[0]:epochs[1] + 1])).sum())
    first, last = np.searchsorted(rows["epoch"], epochs + 1)
    if last >= len(rows["epoch"]):
        return {"driven_m": driven, "error_at_end_m": None, "astray_m": None}
    astray = np.hypot(dx[last] - dx[first], dy[last] - dy[first])
    at_end = np.hypot(dx[last], dy[last])
    return {"driven_m": driven, "error_at_end_m": float(at_end) if np.isfinite(at_end) else None,
            "astray_m": float(astray) if np.isfinite(astray) else None}


def longest(time_s, on):
    """The longest stretch of time in which `on` holds throughout."""
    best = 0.0
    begin = None
    for t, one in zip(time_s, on):
        if one:
            begin = t if begin is None else begin
            best = max(best, t - begin)
        else:
            begin = None
    return float(best)


def honesty(rows, dx, dy, found, at, start, end):
    """From a fault's start on: is there an error that the published sigmas deny, for how long, and how large are they at most? Axes x and y
    and, for an inertial estimate, the height."""
    sigma_x, sigma_y = (recorded_run.held_at(rows["epoch"], rows[name], rows["epoch"], recorded_run.HELD_S / recorded_run.TICK_S) for name in ("std_x_m", "std_y_m"))
    with np.errstate(invalid="ignore", divide="ignore"):
        ratio = np.fmax(np.abs(dx) / (3 * sigma_x), np.abs(dy) / (3 * sigma_y))
    three_sigma = 3 * np.fmax(sigma_x, sigma_y)
    affected = at >= start
    known = affected & np.isfinite(ratio)
    result = {"three_sigma_m": largest(three_sigma[affected & (at < end + SETTLED_S)]),
              "too_sure_s": longest(at[known], ratio[known] > 1), "worst_ratio": largest(ratio[known])}
    if found is not None:
        seen = found.epoch * recorded_run.TICK_S >= start
        during = seen & (found.epoch * recorded_run.TICK_S < end + SETTLED_S)
        error, sigma = np.abs(found.error["position"][:, 2]), found.sigma["position"][:, 2]
        with np.errstate(invalid="ignore", divide="ignore"):
            up = error / (3 * sigma)
        use = seen & np.isfinite(up)
        result["during_max_height_m"] = largest(error[during])
        result["too_sure_s"] = max(result["too_sure_s"], longest(found.epoch[use] * recorded_run.TICK_S, up[use] > 1))
        result["worst_ratio"] = max((one for one in (result["worst_ratio"], largest(up[use])) if one is not None), default=None)
    return result


def said(run, names, start, end):
    """Words of the node's status from a fault on until it had settled, without those of the time before; and the delay of the first one."""
    status = run.status
    at = status["epoch"] * recorded_run.TICK_S
    words = [set() for _ in at]
    for i, (mode, faults) in enumerate(zip(status["mode"], status["faults"])):
        words[i].add(names["Mode"].get(int(mode), f"mode {int(mode)}"))
        words[i] |= {names["Fault"].get(bit, f"fault {bit}") for bit in range(16) if int(faults) >> bit & 1}
    resets = np.flatnonzero(np.diff(status["reset_ctr"]) != 0) + 1
    for i in resets:
        words[i].add("reset: " + names["ResetCause"].get(int(status["reset_cause"][i]), "?"))
    before = set().union({"Nominal"}, *(one for one, t in zip(words, at) if start - BEFORE_S <= t < start))
    result = {}
    for one, t in zip(words, at):
        if start <= t < end + SETTLED_S:
            for word in one - before:
                result.setdefault(word, float(t - start))
    return result


def innovations(table, estimator, names):
    """By sensor: sums over the compared measurements, whether accepted or not: leaving out the rejected would flatter."""
    sums = {}
    for sensor in np.unique(table["sensor"][table["estimator"] == estimator]):
        rows = (table["estimator"] == estimator) & (table["sensor"] == sensor) & np.isfinite(table["nis"]) & (table["dof"] > 0)
        if rows.any():
            sums[names["Sensor"].get(int(sensor), str(int(sensor)))] = {
                "compared": int(rows.sum()), "rejected": int((table["verdict"][rows] == 1).sum()), "nis": float(table["nis"][rows].sum()),
                "dof": int(table["dof"][rows].sum()),
                "nis_accepted": float(table["nis"][rows & (table["verdict"] == 0)].sum())}
    return sums


def spread(values):
    values = [value for value in values if value is not None]
    return {"median": float(np.median(values)), "worst": float(np.max(values))} if values else None


def interval(dof, count):
    """Two-sided, of the mean of `count` chi-square variables with `dof` degrees of freedom in all."""
    return [normalised_error.chi_square((1 - SHARE) / 2, dof) / count, normalised_error.chi_square((1 + SHARE) / 2, dof) / count]


def anees(runs):
    """Average over the seeds at each time that all of them have; the share of the times inside, above (too sure), below (too modest)."""
    common = sorted(set.intersection(*[set(one["epochs"][np.isfinite(one["nees"])]) for one in runs]))
    if not common:
        return None
    values = np.mean([one["nees"][np.searchsorted(one["epochs"], common)] for one in runs], axis=0)
    low, high = interval(DOF * len(runs), len(runs))
    # The seeds are independent, however long errors last: Student's interval of the mean from each seed's own mean.
    by_seed = [float(np.nanmean(one["nees"])) for one in runs]
    scatter = float(stdtrit(len(runs) - 1, (1 + SHARE) / 2) * np.std(by_seed, ddof=1) / np.sqrt(len(runs))) if len(runs) > 1 else None
    return {"mean": float(values.mean()), "mean_plus_minus": scatter, "expected": DOF, "interval": [low, high], "times": len(common),
            "inside": float(((values >= low) & (values <= high)).mean()), "above": float((values > high).mean()),
            "below": float((values < low).mean())}


def repeated(each):
    """Mean ANEES and share of times inside of campaigns with seeds of their own, each with Student's interval of the mean from the campaigns: what
    lasts within a campaign is chance in its share, and no longer in their mean. None throughout where one of them has no figure (None)."""
    if not all(each):
        figures = ("mean", "mean_plus_minus", "inside", "inside_plus_minus", "inside_least", "inside_most")
        return {"campaigns": len(each), **dict.fromkeys(figures)}

    def plus_minus(key):
        return float(stdtrit(len(each) - 1, (1 + SHARE) / 2) * np.std([one[key] for one in each], ddof=1) / np.sqrt(len(each)))

    inside = [one["inside"] for one in each]
    return {"campaigns": len(each), "mean": float(np.mean([one["mean"] for one in each])), "mean_plus_minus": plus_minus("mean"),
            "inside": float(np.mean(inside)), "inside_plus_minus": plus_minus("inside"), "inside_least": min(inside),
            "inside_most": max(inside)}


def by_chance(runs):
    """The share of times inside that all but 5 % of campaigns with a filter that is right would exceed: errors that last make few independent
    times of many. Such a campaign is drawn by mixing the seeds' own errors: they last as long as these, and their covariance at each time is
    the published one. With few seeds it comes out a little low: chance makes correlations between times, too."""
    common = sorted(set.intersection(*[set(one["epochs"]) for one in runs]))
    if len(common) < LEAST_TIMES or len(runs) < LEAST_SEEDS:
        return None
    white = np.stack([one["white"][np.searchsorted(one["epochs"], common)] for one in runs])  # seed, time, axis
    scatter = np.einsum("sti,stj->tij", white, white)
    even = np.einsum("sti,tji->stj", white, np.linalg.inv(np.linalg.cholesky(scatter)))
    low, high = interval(DOF * len(runs), len(runs))
    random, shares = np.random.default_rng(1), []
    for _ in range(DRAWS):
        drawn = np.tensordot(random.standard_normal((len(runs), len(runs))), even, axes=1)
        values = (drawn ** 2).sum(axis=2).mean(axis=0)
        shares.append(((values >= low) & (values <= high)).mean())
    return {"median": float(np.median(shares)), "least": float(np.quantile(shares, 1 - SHARE))}


def sensors(runs):
    result = {}
    for sensor in sorted({name for one in runs for name in one["sensors"]}):
        mine = [one["sensors"][sensor] for one in runs if sensor in one["sensors"]]
        total = {key: sum(one[key] for one in mine) for key in ("compared", "rejected", "nis", "dof", "nis_accepted")}
        accepted = total["compared"] - total["rejected"]
        result[sensor] = {"compared": total["compared"], "nis_mean": total["nis"] / total["compared"],
                          "nis_expected": total["dof"] / total["compared"], "nis_interval": interval(total["dof"], total["compared"]),
                          "nis_mean_accepted": total["nis_accepted"] / accepted if accepted else None,
                          "rejected_share": total["rejected"] / total["compared"]}
    return result


def bus_sensors(runs):
    """The bus's own statistics, over all seeds: every measurement counts, also of sensors too fast for a frame per innovation."""
    result = {}
    for sensor in sorted({name for one in runs for name in one["bus"]}):
        mine = [one["bus"][sensor] for one in runs if one["bus"].get(sensor, {}).get("nis_per_dof") is not None]
        if mine:
            accepted, rejected = (sum(one[key] for one in mine) for key in ("accepted", "rejected"))
            result[sensor] = {"nis_per_dof": float(np.mean([one["nis_per_dof"] for one in mine])), "accepted": accepted,
                              "rejected_share": rejected / max(accepted + rejected, 1)}
    return result


def averaged(case, runs):
    result = {key: case[key] for key in ("world", "robot", "fault")}
    result.update(seeds=len(runs), duration_s=runs[0]["duration_s"])
    for name in runs[0]["estimators"]:
        mine = [one["estimators"][name] for one in runs]

        def degrees(key):
            return spread([None if one[key] is None else float(np.degrees(one[key])) for one in mine])

        entry = {"position_rmse_m": spread([one["position_rmse_m"] for one in mine]), "heading_rmse_deg": degrees("heading_rmse_rad"),
                 "valid_share": float(np.mean([one["valid_share"] for one in mine])), "anees": anees(mine),
                 "covariances_not_usable": sum(one["unusable"] for one in mine), "sensors": sensors(mine), "bus": bus_sensors(mine)}
        if "tilt_rmse_rad" in mine[0]:
            entry.update(tilt_rmse_deg=degrees("tilt_rmse_rad"), attitude_heading_rmse_deg=degrees("turn_rmse_rad"))
        for sensor, counts in entry["bus"].items():
            framed = entry["sensors"].get(sensor)
            if framed and counts["accepted"] > metrics.MOST_FRAMED * framed["compared"]:
                del entry["sensors"][sensor]  # its frames are about rejected samples alone
        if "blocks" in mine[0]:
            entry["blocks"] = {block: {"anees": anees([one["blocks"][block] for one in mine]), "unit": normalised_error.UNITS[block],
                                       "by_chance": by_chance([one["blocks"][block] for one in mine]),
                                       "rmse": spread([one["blocks"][block]["rmse"] for one in mine]),
                                       "inside_3_sigma": float(np.mean([one["blocks"][block]["inside_3_sigma"] or 0 for one in mine]))}
                               for block in normalised_error.BLOCKS}
        if case.get("fault_times"):
            entry.update(largest_error_m=spread([one["during_max_m"] for one in mine]), largest_heading_error_deg=degrees("during_max_rad"),
                         position_rmse_after_m=spread([one["after_rmse_m"] for one in mine]), heading_rmse_after_deg=degrees("after_rmse_rad"),
                         largest_3_sigma_m=spread([one["three_sigma_m"] for one in mine]),
                         largest_height_error_m=spread([one.get("during_max_height_m") for one in mine]),
                         error_over_3_sigma=spread([one["worst_ratio"] for one in mine]), too_sure_s=spread([one["too_sure_s"] for one in mine]),
                         too_sure_seeds=sum(one["too_sure_s"] > TOO_SURE_S for one in mine), driven_m=spread([one["driven_m"] for one in mine]),
                         error_at_end_m=spread([one["error_at_end_m"] for one in mine]),
                         astray_percent=spread([None if one["astray_m"] is None or one["driven_m"] < 1 else 100 * one["astray_m"] / one["driven_m"]
                                                for one in mine]))
        result[name] = entry
    if case.get("fault_times"):
        result["fault_times_s"] = list(case["fault_times"])
        words = sorted({word for one in runs for word in one["said"]})
        result["said"] = {word: {"seeds": sum(word in one["said"] for one in runs),
                                 "after_s": spread([one["said"].get(word) for one in runs])} for word in words}
        result["said_after_s"] = spread([min(one["said"].values(), default=None) if one["said"] else None for one in runs])
        result["silent_seeds"] = sum(not one["said"] for one in runs)
    return result
