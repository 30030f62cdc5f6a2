#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""`make tune` in the matched world, whose numbers are known: tune_runs.py PROGRAMS VIEWED OUT SEEDS SECONDS MINUTES. Each seed begins three times wrong in all rows at once,
up in one row and down in the next. No seed is begun after MINUTES. Gyroscope and wheel of the first four logs together are then held against a grid.
OUT/tune_runs.json holds the figures: found over true in the median, and how many 95 % intervals have the truth. Exit status 1: a median of BOUNDED is 25 % off."""
import json
import os
import statistics
import subprocess
import sys
import time

sys.dont_write_bytecode = True
ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))
sys.path.insert(0, os.path.join(ROOT, "tools", "python"))
from tetap.tune import rows  # noqa: E402

ROBOT, WRONG, IN_GRID = "rover_matched", 3.0, 4
BOUNDED, MOST_OFF = ("gnss.sigma_scale", "inertial.accel_mps2_rthz", "inertial.lateral_mps", "inertial.vertical_mps"), 0.25
FROM_A_GRID = ("inertial.gyro_radps_rthz", "inertial.wheel_mps")


def run(*words):
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"tune_runs: {' '.join(words)}: {done.stderr[-1000:]}")
    return done.stdout


def tuned(logs, start, out, *more):
    sets = [word for path, value in start.items() for word in ("--set", f"{path}={value:.7g}")]
    run(os.path.join(ROOT, "tools/calibrate/tune_robot"), *logs, "--robot", ROBOT, *sets, "--out", out, "--jobs", "1", "--quiet", *more)
    with open(os.path.join(out, "tune.json"), encoding="utf-8") as file:
        return json.load(file)


def judged(runs, truth):
    """{row: (runs with a number, median of found over true, intervals that have the truth)}."""
    found = {}
    for name, true in truth.items():
        some = [one["rows"][name] for one in runs if name in one["rows"] and one["rows"][name]["value"] is not None]
        if some:
            found[name] = len(some), statistics.median(one["value"] / true for one in some), sum(one["low"] <= true <= one["high"] for one in some)
    return found


def main(programs, viewed, out, seeds, seconds, minutes):
    os.environ.update(TETAP_PROGRAMS=programs, TETAP_VIEWED_PROGRAMS=viewed)
    table = {row["path"]: row for row in json.loads(run(os.path.join(programs, "tetap-params"), "--json", "--robot", ROBOT))["parameters"]}
    chosen, end, runs, logs = rows.rows_for(table), time.monotonic() + 60 * float(minutes), [], []
    truth = {row.name: value for row, value, _ in chosen}
    wrong = [{path: min(max(value * WRONG ** (1 if (place + side) % 2 else -1), table[path]["minimum"]), table[path]["maximum"])
              for place, (row, value, _) in enumerate(chosen) for path in row.paths} for side in (0, 1)]
    for seed in range(1, int(seeds) + 1):
        if time.monotonic() > end:
            break
        folder = os.path.join(out, str(seed))
        run(os.path.join(programs, "tetap-world"), "--memory", "--robot", ROBOT, "--matched", "--seed", str(seed), "--duration", seconds, "--raw", "--quiet", "--out", folder)
        logs.append(os.path.join(folder, "raw.log"))
        runs.append(tuned(logs[-1:], wrong[seed % 2], os.path.join(folder, "tune")))
        ratios = [f"{name} {one['value'] / truth[name]:.2f}" for name, one in runs[-1]["rows"].items() if one["value"]]
        print(f"seed {seed}: {', '.join(ratios)}", flush=True)
    grid = []
    if len(logs) > 1:
        truths = [word for log in logs[:IN_GRID] for word in ("--truth", os.path.join(os.path.dirname(log), "truth.csv"))]
        start, names = {name: WRONG * truth[name] for name in FROM_A_GRID}, ",".join(FROM_A_GRID)
        grid = tuned(logs[:IN_GRID], start, os.path.join(out, "grid"), *truths, "--rows", names, "--grid", names)["grid"]
    figures = judged(runs, truth)
    print(f"{len(runs)} seeds of {seconds} s, begun {WRONG:g} times wrong")
    for name, (count, ratio, inside) in figures.items():
        print(f"  {name}: {ratio:.2f} of the world's in the median of {count}; {inside} intervals have it")
    for one in grid:
        print("  " + one["said"])
    with open(os.path.join(out, "tune_runs.json"), "w", encoding="utf-8") as file:
        json.dump({"seeds": len(runs), "seconds": float(seconds), "rows": figures, "grid": grid}, file, indent=1)
    off = [name for name in BOUNDED if name not in figures or abs(figures[name][1] - 1) > MOST_OFF]
    if off:
        sys.exit(f"tune_runs: beyond {100 * MOST_OFF:.0f} % or without a number: {', '.join(off)}")


if __name__ == "__main__":
    if len(sys.argv) != 7:
        sys.exit(__doc__)
    main(*sys.argv[1:])
