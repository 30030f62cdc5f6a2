#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The choice of config/mrclam_pf.hpp: particle_noise.py [--seeds N] PROGRAMS OUT [PATH=VALUE,PATH=VALUE...]...

Each further word is a candidate: settings over the compiled numbers of mrclam_pf, parted by commas; `-` stands for the compiled numbers. Each
candidate runs on the five MRCLAM robots: tracking from the true start, and two wrong starts with and without identities. The cost of a robot is
the RMSE over the EKF's, plus the mean times to be found with and without identities over a minute (90 s where the robot was not found). The choice
leaves one robot out in turn: the candidate of the least cost on four robots is judged on the fifth. OUT/particle_noise.json holds the figures.
"""
import argparse
import concurrent.futures
import json
import os
import statistics
import sys

import menu_runs
from menu_runs import MRCLAM_ROBOTS, WRONG_STARTS, Runs

sys.dont_write_bytecode = True
FOLDER = os.path.join(menu_runs.DATA, "mrclam", "MRCLAM_Dataset7")
NOT_FOUND_S = 90.0  # length of a run with a wrong start


def logs_of(runs, robot):
    """Names of the logs: tracking, wrong starts, and wrong starts without identities."""
    def wrong(number, error, words):
        return runs.imported(f"mrclam{robot}_wrong{number}" + ("_no_ids" if words else ""), "import_mrclam", *words, "--start-error",
                             *(str(v) for v in error), "--until", str(NOT_FOUND_S), FOLDER, str(robot))
    return {"track": [runs.imported(f"mrclam{robot}", "import_mrclam", FOLDER, str(robot))],
            "ids": [wrong(k, error, ()) for k, error in enumerate(WRONG_STARTS)],
            "no_ids": [wrong(k, error, ("--no-ids",)) for k, error in enumerate(WRONG_STARTS)]}


def evaluated(runs, logs, candidate, seed):
    """Figures of one candidate on one robot."""
    settings = [] if candidate == "-" else candidate.split(",")
    key = "".join(c if c.isalnum() else "_" for c in candidate)

    def fused(log):
        return runs.replayed(log, "mrclam_pf", f"mapping.seed={seed}", *settings, folder=f"{log}_{key}_{seed}")["fused"]
    found = {case: [fused(log)["recovered_after_s"] for log in logs[case]] for case in ("ids", "no_ids")}
    tracking = fused(logs["track"][0])
    return {"rmse_m": tracking["position_rmse_m"], "nees": tracking["nees_mean"], **found}


def cost(figures, ekf_m):
    """Of one robot: the mean over its seeds."""
    times = [statistics.mean(NOT_FOUND_S if t is None else t for t in one[case]) for one in figures for case in ("ids", "no_ids")]
    return statistics.mean(one["rmse_m"] for one in figures) / ekf_m + 2 * statistics.mean(times) / 60


def printed(candidate, of, ekf_m):
    ratios = [statistics.mean(one["rmse_m"] for one in of[k]) / ekf_m[k] for k in MRCLAM_ROBOTS]
    print(f"  {candidate}\n    RMSE over the EKF's: " + " ".join(f"{r:.3f}" for r in ratios)
          + "   NEES " + " ".join(f"{statistics.mean(one['nees'] for one in of[k]):.1f}" for k in MRCLAM_ROBOTS))
    for case in ("ids", "no_ids"):
        times = [t for k in MRCLAM_ROBOTS for one in of[k] for t in one[case]]
        within = sum(t is not None and t <= 60 for t in times)
        print(f"    {case}: {within} of {len(times)} within 60 s, median {statistics.median(NOT_FOUND_S if t is None else t for t in times):.1f} s: "
              + " ".join("none" if t is None else f"{t:.1f}" for t in times), flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("programs")
    parser.add_argument("out")
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("candidates", nargs="*", default=["-"])
    arguments = parser.parse_args()
    runs = Runs(arguments.programs, arguments.out)
    found = {}
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        logs = dict(zip(MRCLAM_ROBOTS, pool.map(lambda k: logs_of(runs, k), MRCLAM_ROBOTS)))
        ekf_m = dict(zip(MRCLAM_ROBOTS, pool.map(lambda k: runs.replayed(logs[k]["track"][0], "mrclam")["fused"]["position_rmse_m"], MRCLAM_ROBOTS)))
        for candidate in arguments.candidates:
            waiting = {k: [pool.submit(evaluated, runs, logs[k], candidate, seed) for seed in range(1, arguments.seeds + 1)] for k in MRCLAM_ROBOTS}
            found[candidate] = {k: [one.result() for one in of] for k, of in waiting.items()}
            printed(candidate, found[candidate], ekf_m)
    costs = {candidate: {k: cost(of[k], ekf_m[k]) for k in MRCLAM_ROBOTS} for candidate, of in found.items()}
    for left_out in MRCLAM_ROBOTS:
        best = min(costs, key=lambda candidate: sum(costs[candidate][k] for k in MRCLAM_ROBOTS if k != left_out))
        print(f"  without robot {left_out}: {best}, cost on it {costs[best][left_out]:.3f}")
    best = min(costs, key=lambda candidate: sum(costs[candidate].values()))
    print(f"  on all five: {best}")
    with open(runs.path("particle_noise.json"), "w", encoding="utf-8") as file:
        json.dump({"ekf_rmse_m": ekf_m, "candidates": found, "chosen": best}, file, indent=1)


if __name__ == "__main__":
    main()
