#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The tables of docs/validation/recorded.md on recorded inertial data, in Markdown: inertial_tables.py [FILE], of what inertial_runs.py --whole
wrote (default out/inertial.json).

3 sigma is how far the ellipse reaches in the error's own direction that holds as much of the plane (99.73 %) as 3 sigma of one axis.
An error beyond it is in bold."""
import json
import os
import statistics
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))
CASES = [(True, 30), (True, 60), (False, 30), (False, 60)]


def line(cells):
    return "| " + " | ".join(cells) + " |"


def heading(cells):
    return [line(cells), "|" + "---|" * len(cells)]


def mean(values):
    return f"{statistics.fmean(values):.2f}" if values else "-"


def case_of(rows, speedometer, seconds):
    return [row for row in rows if (row["speedometer"], row["seconds"]) == (speedometer, seconds)]


def cell(row):
    text = f"{row['error_m']:.1f} / {'>' if row['sigma_limited'] else ''}{row['three_sigma_m']:.1f} m, {row['nees']:.2f}"
    return f"**{text}**" if row["beyond"] else text


def outage_table(rows):
    """Each place a line: error / 3 sigma, NEES. *: the mounting was taken from there; o: the IMU has a hole in its last minute."""
    cases = [case for case in CASES if case_of(rows, *case)]
    words = [f"{'speedometer' if speedometer else 'constraint alone'}, {seconds} s" for speedometer, seconds in cases]
    yield from heading(["cut from", "driven in 60 s", *words])
    for start in dict.fromkeys(row["start_s"] for row in rows):
        mine = [row for case in cases for row in case_of(rows, *case) if row["start_s"] == start]
        marks = ("*" if mine[-1]["calibrated_on"] else "") + ("o" if mine[-1]["imu_hole"] else "")
        driven = next(row["driven_m"] for row in mine if row["seconds"] == 60)
        yield line([f"{start} s {marks}".strip(), f"{driven:.0f} m", *map(cell, mine)])
    yield line(["median error; beyond 3 sigma", "", *(
        f"{statistics.median(row['error_m'] for row in mine):.1f} m; {sum(row['beyond'] for row in mine)} of {len(mine)}"
        for mine in (case_of(rows, *case) for case in cases))])


def nees_line(what, reference, rows):
    return line([what, reference, "x, y", mean([row["nees"] for row in rows]), mean([row["nees_with_fix"] for row in rows]), "2",
                 f"{sum(row['beyond'] for row in rows)} of {len(rows)}"])


def nees_table(result):
    """Mean of the squared error in the published covariance; a second time with what the reference says of its own error added."""
    yield from heading(["recorded", "compared with", "of", "mean NEES", "with the reference's sigma", "expected", "beyond 3 sigma"])
    rows = result.get("car", {}).get("outages", [])
    for speedometer, seconds in CASES:
        for hole in (False, True):
            mine = [row for row in case_of(rows, speedometer, seconds) if row["imu_hole"] == hole]
            if mine:
                yield nees_line(f"Skog's car, {seconds} s without GNSS, {'speedometer' if speedometer else 'constraint alone'}"
                                f"{', the hole of the IMU in it' if hole else ''}", "the fix withheld", mine)
    for name, one in result.get("px4", {}).items():
        for block, nees in one["nees"].items():
            yield line([f"PX4's log `{name}`", "PX4's EKF2", block, f"{nees:.2f}", "-", "3", "-"])
    husky = result.get("husky", {})
    if husky:
        yield line(["Husky, odometry and IMU, its end", "robot_localization's end", "x, y", f"{husky['end']['nees']:.2f}", "-", "2", f"{int(husky['end']['beyond'])} of 1"])
    if husky.get("outages"):
        yield nees_line("Husky, 60 s without GNSS, odometry and IMU", "the fix withheld", husky["outages"])


def main():
    path = sys.argv[1] if len(sys.argv) > 1 else os.path.join(ROOT, "out", "inertial.json")
    try:
        with open(path, encoding="utf-8") as file:
            result = json.load(file)
    except (OSError, ValueError) as error:
        sys.exit(f"inertial_tables: {path}: {error} (inertial_runs.py --whole writes it)")
    if "car" in result:
        print("Skog's car, GNSS cut: error at the end / 3 sigma, NEES (2 expected)\n")
        print(*outage_table(result["car"]["outages"]), "", sep="\n")
    print("NEES on recorded data\n")
    print(*nees_table(result), sep="\n")


if __name__ == "__main__":
    main()
