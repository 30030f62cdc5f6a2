#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Recorded runs against their truth, in one process: recorded_runs.py PROGRAMS OUT. Two-sided: a result better than a share of its bound is
as suspicious as one above it. Needs $TETAP_DATA (default ../shared/data); without it the line says skipped and the status is 77."""
import json
import os
import subprocess
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))
DATA = os.environ.get("TETAP_DATA") or os.path.join(os.path.dirname(ROOT), "shared", "data")
# Position [m] and heading [deg] of a plain EKF on the same set.
MRCLAM = {1: (0.185, 6.8), 2: (0.185, 4.3), 3: (0.256, 8.1), 4: (0.280, 5.7), 5: (0.208, 5.1)}


def run(*words):
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{' '.join(words)} failed:\n{done.stdout}{done.stderr}")
    return done.stdout


def replay(programs, out, name, robot):
    folder = os.path.join(out, name)
    run(os.path.join(programs, "tetap-play"), f"{folder}.log", "--memory", "--robot", robot, "--out", folder, "--quiet")
    run("tools/report/write_report", folder, "--truth", f"{folder}.truth.csv", "--no-pictures")
    with open(os.path.join(folder, "summary.json"), encoding="utf-8") as file:
        return json.load(file)


def summary_numbers(out):
    """Q, R and gates, as the player says them."""
    with open(os.path.join(out, "mrclam1", "run.json"), encoding="utf-8") as file:
        return json.load(file)["numbers"]


def main():
    programs, out = sys.argv[1:3]
    if not os.path.isdir(os.path.join(DATA, "mrclam")):
        print(f"skipped: no {DATA}/mrclam (set TETAP_DATA)")
        sys.exit(77)
    os.makedirs(out, exist_ok=True)
    wrong = []

    def bound(what, value, low, high):
        ok = low <= value <= high
        print(f"  {what:34} {value:8.3f}   {low:.3f} .. {high:.3f}   {'ok' if ok else 'WRONG'}")
        if not ok:
            wrong.append(what)

    for robot, (position, heading) in MRCLAM.items():
        name = f"mrclam{robot}"
        run("tools/dataset/import_mrclam", os.path.join(DATA, "mrclam", "MRCLAM_Dataset7"), str(robot), os.path.join(out, name))
        summary = replay(programs, out, name, "mrclam")
        # The plain EKF took the camera's depth for a range, which is most of its error.
        bound(f"{name} position RMSE [m]", summary["position_rmse_m"], position / 3, 0.8 * position)
        bound(f"{name} NEES (3 expected)", summary["fused"]["nees_mean"], 1, 4.5)
        bound(f"{name} heading RMSE [deg]", summary["heading_rmse_deg"], heading / 2, heading)
        bound(f"{name} frames lost", summary["frames_lost"], 0, 0)
        print(f"  {name} times real time {summary['times_realtime']:.0f} (a benchmark, not a test)")
    print(f"  mrclam, one configuration for all robots: {summary_numbers(out)}")
    run("tools/dataset/import_husky", os.path.join(DATA, "husky"), os.path.join(out, "husky"))
    summary = replay(programs, out, "husky", "husky")
    bound("husky RMS from the GPS track [m]", summary["fused"]["position_rmse_m"] or 0.0, 0.9, 2.5)
    run("tools/dataset/import_labyrinth", os.path.join(DATA, "tuc_labyrinth", "Indoor_UWB"), os.path.join(out, "labyrinth"))
    summary = replay(programs, out, "labyrinth", "labyrinth")
    bound("labyrinth odometry RMSE [m]", summary["odometry"]["position_rmse_m"], 0.1, 0.3)
    bound("labyrinth with ranges RMSE [m]", summary["fused"]["position_rmse_m"], 0.06, 0.18)
    if wrong:
        sys.exit("outside their bounds: " + ", ".join(wrong))


if __name__ == "__main__":
    main()
