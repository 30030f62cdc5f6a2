#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The robot `visual_slam` in the simulated world, in one process: visual_slam_runs.py PROGRAMS OUT [--whole]. Laps of 100 m between 24 landmarks that its
camera recognises, and the same laps by the robot `visual`, which has no map. A share of the recognitions names another landmark. An error after a lap is
the root mean square over the lap's last 5 m and over the seeds. --whole takes ten seeds in place of two. OUT/visual_slam.json holds the figures."""
import concurrent.futures
import os
import sys

import numpy as np

sys.dont_write_bytecode = True
sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
from menu_runs import Bounds, Runs, run  # noqa: E402

LAP_M, LAPS, LAST_M = 100.0, 3, 5.0
ESTIMATOR = 1
WRONG = (0.05, 0.1)


def errors(folder):
    """Horizontal errors [m] after each lap, and the longest time [s] beyond 3 sigma of x, y or heading."""
    truth = np.genfromtxt(os.path.join(folder, "truth.csv"), delimiter=",", names=True)
    rows = np.genfromtxt(os.path.join(folder, "estimates.csv"), delimiter=",", names=True,
                         usecols=("time_s", "estimator", "x_m", "y_m", "yaw_rad", "std_x_m", "std_y_m", "std_yaw_rad"))
    rows = rows[(rows["estimator"] == ESTIMATOR) & np.isfinite(rows["x_m"])]
    true_yaw = np.unwrap(truth["yaw_rad"])
    at = {name: np.interp(rows["time_s"], truth["time_s"], values) for name, values in
          (("x_m", truth["x_m"]), ("y_m", truth["y_m"]), ("yaw_rad", true_yaw))}
    miss = {name: rows[name] - at[name] for name in at}
    miss["yaw_rad"] = np.remainder(miss["yaw_rad"] + np.pi, 2 * np.pi) - np.pi
    way_m = np.concatenate(([0.0], np.cumsum(np.hypot(np.diff(truth["x_m"]), np.diff(truth["y_m"])))))
    driven_m = np.interp(rows["time_s"], truth["time_s"], way_m)
    error_m = np.hypot(miss["x_m"], miss["y_m"])
    after = [np.sqrt(np.mean(error_m[(driven_m > lap * LAP_M - LAST_M) & (driven_m < lap * LAP_M)] ** 2)) for lap in range(1, LAPS + 1)]
    longest_s = 0.0
    for name, sigma in (("x_m", "std_x_m"), ("y_m", "std_y_m"), ("yaw_rad", "std_yaw_rad")):
        told = np.isfinite(rows[sigma])
        since = None
        for time_s, beyond in zip(rows["time_s"][told], np.abs(miss[name][told]) > 3 * rows[sigma][told]):
            since = (time_s if since is None else since) if beyond else None
            longest_s = max(longest_s, time_s - since if since is not None else 0.0)
    return np.array(after), longest_s


def lap_run(runs, robot, seed, *words):
    folder = runs.path("_".join((robot, str(seed), *(word.lstrip("-") for word in words))))
    run(os.path.join(runs.programs, "tetap-world"), "--memory", "--robot", robot, "--course", "loop", "--loop-m", str(int(LAP_M)), "--laps", str(LAPS),
        "--seed", str(seed), "--out", folder, "--quiet", *words)
    return errors(folder)


def campaign(runs, bounds, pool, seeds):
    waiting = {"without": [pool.submit(lap_run, runs, "visual", seed) for seed in seeds]}
    for wrong in WRONG:
        waiting[wrong] = [pool.submit(lap_run, runs, "visual_slam", seed, "--wrong-ids", str(wrong)) for seed in seeds]
    found = {name: [one.result() for one in many] for name, many in waiting.items()}
    rms = {name: np.sqrt(np.mean([one[0] ** 2 for one in many], axis=0)) for name, many in found.items()}
    for name, many in found.items():
        print(f"  {name}: after laps " + " ".join(f"{value:.3f}" for value in rms[name]) + " m; beyond 3 sigma "
              + " ".join(f"{one[1]:.1f}" for one in many) + " s")
    for wrong in WRONG:
        what = f"{100 * wrong:.0f} % wrong identities"
        bounds.check(f"{what}: after lap 3 over after lap 1", rms[wrong][2] / rms[wrong][0], 0.2, 1.3)
        bounds.check(f"{what}: after lap 3 over that without the map", rms[wrong][2] / rms["without"][2], 0.01, 0.5)
        bounds.check(f"{what}: longest time beyond 3 sigma [s]", max(one[1] for one in found[wrong]), 0, 2)


def main():
    programs, out, *words = sys.argv[1:]
    bounds, runs = Bounds(), Runs(programs, out)
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        campaign(runs, bounds, pool, range(1, 11) if "--whole" in words else range(1, 3))
    bounds.finish(runs.path("visual_slam.json"))


if __name__ == "__main__":
    main()
