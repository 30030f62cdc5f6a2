#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Robots that make their map, as firmware on recorded logs, in one process: mapping_runs.py PROGRAMS OUT [--whole]. EKF-SLAM and FastSLAM on
MRCLAM Dataset 7 with one configuration each; a map that was recorded from the bus is the known map of the next robot. Bounds are two-sided: a
result much better than its bound is as suspicious as a worse one. The short form runs two robots and one seed, the whole one all five and eight.
Needs $TETAP_DATA (default ../shared/data); without it the status is 77. OUT/mapping.json holds the figures."""
import csv
import json
import os
import re
import statistics
import sys

import numpy as np

sys.dont_write_bytecode = True
sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
from menu_runs import DATA, run_campaign  # noqa: E402

from tetap.can import bus_writer  # noqa: E402
from tetap.report import own_map  # noqa: E402

FOLDER = os.path.join(DATA, "mrclam", "MRCLAM_Dataset7")
# Trajectory and landmarks after the rigid motion that fits the landmarks [m], and NEES of the pose (3 expected).
EKF_SLAM = {1: (0.38, 0.07, 5), 2: (0.16, 0.05, 5), 3: (0.20, 0.10, 5), 4: (0.40, 0.11, 8), 5: (0.18, 0.085, 5)}
FAST_SLAM_M = {1: 0.30, 2: 0.19, 3: 0.23, 4: 0.42, 5: 0.20}  # mean over the seeds
MAP_LAW = 1.1  # error on a map that a robot made, over the error on the given one
LEAST_SHARE = 0.4
SHORT_ROBOTS, SHORT_SEEDS, SEEDS = (2, 4), (1,), range(1, 9)
OWN_FRAMES = re.compile(r" (303|304|305)#")  # start pose and map of the importer


def ekf_slam(runs, bounds, pool, robots):
    logs = {k: pool.submit(runs.imported, f"slam{k}", "import_mrclam", "--no-map", FOLDER, str(k)) for k in robots}
    found = {k: pool.submit(lambda k=k: runs.replayed(logs[k].result(), "mrclam_slam")) for k in robots}
    for k in robots:
        summary, (trajectory_m, map_m, nees) = found[k].result(), EKF_SLAM[k]
        bounds.check(f"robot {k}: mrclam_slam trajectory, aligned [m]", summary["trajectory_rmse_aligned_m"], LEAST_SHARE * trajectory_m, trajectory_m)
        bounds.check(f"robot {k}: mrclam_slam landmarks, aligned [m]", summary["map_rmse_m"], 0.01, map_m)
        bounds.check(f"robot {k}: mrclam_slam NEES (3 expected)", summary["pose_nees_mean"], 0.5, nees)
        bounds.check(f"robot {k}: mrclam_slam landmarks in the map", summary["fused"]["landmarks_in_map"], 15, 15)
        bounds.check(f"robot {k}: mrclam_slam wrong associations", summary["wrong_associations"], 0, 0)
        bounds.check(f"robot {k}: mrclam_slam frames lost", summary["frames_lost"], 0, 0)


def fast_slam(runs, bounds, pool, robots, seeds):
    found = {(k, seed): pool.submit(runs.replayed, f"slam{k}", "mrclam_fast", f"mapping.seed={seed}", folder=f"slam{k}_fast{seed}")
             for k in robots for seed in seeds}
    for k in robots:
        errors = [found[k, seed].result()["trajectory_rmse_aligned_m"] for seed in seeds]
        mean, limit = statistics.mean(errors), FAST_SLAM_M[k] if len(seeds) == len(SEEDS) else 2 * FAST_SLAM_M[k]
        print(f"  robot {k}: " + " ".join(f"{one:.3f}" for one in errors) + f" m, NEES {found[k, seeds[0]].result()['pose_nees_mean']:.0f}")
        bounds.check(f"robot {k}: mrclam_fast trajectory, mean of {len(seeds)} seeds [m]", mean, LEAST_SHARE * FAST_SLAM_M[k], limit)
        bounds.check(f"robot {k}: mrclam_fast worst seed over the mean", max(errors) / mean, 1, 2)


def recorded_map(folder):
    """Frames of Est_Landmark as last sent, as In_MapEntry: the identifier alone is another."""
    last = {}
    with open(os.path.join(folder, "estimates.log"), encoding="ascii") as file:
        for line in file:
            if " 340#" in line:
                data = line.split("#")[1].strip()
                last[data[:2]] = data
    return [f"(0.{100_000 + 2000 * i:06d}) vcan0 305#{data}\n" for i, data in enumerate(last.values())]


def on_own_map(runs, k):
    """Log and truth of robot k in the frame of the map that robot k made; the name of both."""
    with open(runs.path(f"slam{k}.json"), encoding="utf-8") as file:
        about = json.load(file)
    found = own_map.last_of_each(own_map.read_table(runs.path(f"slam{k}_mrclam_slam/map.csv"), own_map.MAP))
    true = {one["id"]: complex(one["x_m"], one["y_m"]) for one in about["landmarks"]}
    to_map = own_map.Rigid(np.array([true[i] for i in found]), np.array(list(found.values())))
    start = about["start_pose"]
    at = to_map(complex(start["x_m"], start["y_m"]))
    pose = bus_writer.Log(bus_writer.Dbc())
    yaw = (start["yaw_rad"] + to_map.yaw_rad + np.pi) % (2 * np.pi) - np.pi
    pose.add("Cmd_SetPos", 900_000, Ctr=1, X=at.real, Y=at.imag)
    pose.add("Cmd_SetYaw", 901_000, Ctr=1, Yaw=yaw, StdPos=start["sigma_position_m"], StdYaw=start["sigma_yaw_rad"])
    name = f"own{k}"
    with open(runs.path(f"slam{k}.log"), encoding="ascii") as log, open(runs.path(f"{name}.log"), "w", encoding="ascii") as out:
        out.writelines(recorded_map(runs.path(f"slam{k}_mrclam_slam")))
        out.write(pose.text().decode())
        out.writelines(line for line in log if not OWN_FRAMES.search(line))
    with open(runs.path(f"slam{k}.truth.csv"), encoding="utf-8", newline="") as truth, open(runs.path(f"{name}.truth.csv"), "w", encoding="utf-8") as out:
        out.write("time_s,x_m,y_m,yaw_rad\n")
        for row in csv.DictReader(truth):
            place = to_map(complex(float(row["x_m"]), float(row["y_m"])))
            out.write(f"{row['time_s']},{place.real:.6f},{place.imag:.6f},{float(row['yaw_rad']) + to_map.yaw_rad:.6f}\n")
    return name


def map_law(runs, bounds, pool, robots):
    given = {k: pool.submit(lambda k=k: runs.replayed(runs.imported(f"given{k}", "import_mrclam", FOLDER, str(k)), "mrclam")) for k in robots}
    own = {k: pool.submit(lambda k=k: runs.replayed(on_own_map(runs, k), "mrclam")) for k in robots}
    for k in robots:
        on_given, on_own = given[k].result(), own[k].result()
        bounds.check(f"robot {k}: mrclam on the recorded map over the given one", on_own["position_rmse_m"] / on_given["position_rmse_m"], 0.5, MAP_LAW)


def campaign(runs, bounds, pool, whole):
    robots, seeds = (tuple(EKF_SLAM), tuple(SEEDS)) if whole else (SHORT_ROBOTS, SHORT_SEEDS)
    ekf_slam(runs, bounds, pool, robots)
    fast_slam(runs, bounds, pool, robots if whole else robots[:1], seeds)
    map_law(runs, bounds, pool, robots if whole else robots[:1])


if __name__ == "__main__":
    run_campaign(FOLDER, "mapping.json", campaign)
