#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The robot `all_round` in the simulated yard: all_round_runs.py PROGRAMS OUT SEEDS. The receiver is out for 60 s; `rover`, the same robot without a
scanner, is IMU and wheels alone. Then each sensor lies in turn. Bounds are two-sided: a result much better is as suspicious as a worse one.
OUT/all_round.json holds the figures."""
import collections
import csv
import os
import sys

import numpy as np

sys.dont_write_bytecode = True
sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
from menu_runs import Bounds, run  # noqa: E402

OUTAGES = (80, 130)  # begin of the receiver's outages, of 60 s each, after the start of the drive [s]
OUTAGE_S, BEGIN_S, EPOCHS_HZ = 60, 1, 100
ESTIMATOR = 1  # number of the inertial filter of all_round
# Name of the fault, its begin and duration, and the source that is to be named.
LIES = (("gnss_jump", 80, 10, "GnssPosition"), ("slip_left", 70, 4, "Wheels"), ("lidar_glass", 60, 20, "Scan"), ("lidar_turned", 60, 30, "Scan"),
        ("gyro_bias_step", 60, 40, "Imu"))
NAMED_S, BEYOND_S = 10, 3


def driven(programs, out, robot, seed, fault):
    run(os.path.join(programs, "tetap-world"), "--memory", "--quiet", "--robot", robot, "--seed", str(seed), "--fault", fault, "--out", out)


def judged(out):
    """Time, errors of x, y, yaw [m, m, rad], their sigmas and NEES, at each estimate that has all of them."""
    path = os.path.join(out, "estimates.csv")
    columns = ("epoch", "x_m", "y_m", "yaw_rad", "std_x_m", "std_y_m", "std_yaw_rad", "corr_xy", "corr_x_yaw", "corr_y_yaw")
    rows = np.genfromtxt(path, delimiter=",", names=True, usecols=(*columns, "pos_valid"))
    inertial = np.genfromtxt(path, delimiter=",", skip_header=1, usecols=3, dtype=str) == "Inertial"
    rows = rows[inertial & (rows["pos_valid"] == 1)]
    rows = rows[np.all([np.isfinite(rows[name]) for name in columns], axis=0)]
    truth = np.genfromtxt(os.path.join(out, "truth.csv"), delimiter=",", names=True)
    at = np.searchsorted(truth["epoch"], rows["epoch"])
    off = np.column_stack([rows[name] - truth[name][at] for name in ("x_m", "y_m", "yaw_rad")])
    off[:, 2] = (off[:, 2] + np.pi) % (2 * np.pi) - np.pi
    std = np.column_stack([rows[name] for name in ("std_x_m", "std_y_m", "std_yaw_rad")])
    correlation = np.tile(np.eye(3), (len(rows), 1, 1))
    for name, i, j in (("corr_xy", 0, 1), ("corr_x_yaw", 0, 2), ("corr_y_yaw", 1, 2)):
        correlation[:, i, j] = correlation[:, j, i] = rows[name]
    scaled = off / std
    nees = np.einsum("ki,kij,kj->k", scaled, np.linalg.inv(correlation), scaled)
    return rows["epoch"] / EPOCHS_HZ, off, std, nees


def outage(programs, out, robot, begin_s, seeds):
    """RMS over the seeds of the error at the outage's end, and of its growth since the begin; mean NEES within it."""
    ends, growths, nees = [], [], []
    for seed in seeds:
        driven(programs, out, robot, seed, f"gnss_outage@{begin_s}+{OUTAGE_S}")
        time_s, off, _, one = judged(out)
        first, last = np.searchsorted(time_s, (begin_s, begin_s + OUTAGE_S))
        ends.append(off[last - 1, :2]), growths.append(off[last - 1, :2] - off[first, :2]), nees.append(one[first:last].mean())
    rms = [float(np.sqrt((np.array(some) ** 2).sum(axis=1).mean())) for some in (ends, growths)]
    return *rms, float(np.mean(nees))


def lie(programs, out, seed, fault, begin_s, duration_s, source):
    """Seconds until the source is named (none: infinity), and the longest time beyond 3 sigma from the fault's begin on."""
    driven(programs, out, "all_round", seed, f"{fault}@{begin_s}+{duration_s}")
    named, refused = [np.inf], 0
    for table, column in (("sources.csv", "source"), ("sensors.csv", "sensor")):
        with open(os.path.join(out, table), encoding="utf-8", newline="") as file:
            for row in csv.DictReader(file):
                after = float(row["time_s"]) - BEGIN_S - begin_s
                if row["estimator"] != str(ESTIMATOR) or row[column] != source:
                    continue
                more = int(row.get("rejected") or 0)
                if after > 0 and (row.get("state") in ("Rejecting", "Distrusted") or more > refused):
                    named.append(after)
                refused = max(refused, more)
    time_s, off, std, _ = judged(out)
    beyond = (np.abs(off) > 3 * std).any(axis=1) & (time_s > begin_s)
    longest = since = 0.0
    for now, before, out_of in zip(time_s[1:], time_s[:-1], beyond[1:]):
        since = since + now - before if out_of else 0.0
        longest = max(longest, since)
    return min(named), longest


def main():
    programs, out, count = sys.argv[1:]
    seeds = range(1, int(count) + 1)
    bounds, folder = Bounds(), os.path.join(out, "run")
    os.makedirs(out, exist_ok=True)
    few = len(seeds) < 10
    for begin_s in OUTAGES[:1] if few else OUTAGES:
        with_scans, without = (outage(programs, folder, robot, begin_s, seeds) for robot in ("all_round", "rover"))
        name = f"receiver out at {begin_s} s, {len(seeds)} seeds: "
        print(f"  {name}with scanner {with_scans[0]:.3f} m, without {without[0]:.3f} m")
        bounds.check(name + "end error over that without scanner", with_scans[0] / without[0], *END[few])
        bounds.check(name + "growth of the error over that without scanner", with_scans[1] / without[1], *GROWTH[few])
        bounds.check(name + "NEES (3 expected)", with_scans[2], *NEES)
    worst = collections.defaultdict(lambda: [0.0, 0.0])
    for seed in list(seeds)[:3]:
        for fault, *when, source in LIES:
            found = lie(programs, folder, seed, fault, *when, source)
            worst[fault] = [max(pair) for pair in zip(worst[fault], found)]
    for fault, (named_s, beyond_s) in worst.items():
        bounds.check(f"{fault}: named after [s]", named_s, 0, NAMED_S)
        bounds.check(f"{fault}: beyond 3 sigma for [s]", beyond_s, 0, BEYOND_S)
    bounds.finish(os.path.join(out, "all_round.json"))


END, GROWTH, NEES = ((0.05, 0.45), (0.05, 0.8)), ((0.05, 0.6), (0.05, 0.9)), (0.8, 5)  # three seeds scatter; the bar of the end error is 0.3

if __name__ == "__main__":
    main()
