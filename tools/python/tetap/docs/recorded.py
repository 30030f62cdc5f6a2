# SPDX-License-Identifier: Apache-2.0
"""Tables on recorded inertial data, of the file that test/replay/inertial_runs.py writes: drives, outages one by one, NEES."""
import statistics

CASES = [(True, 30), (True, 60), (False, 30), (False, 60)]
SENSOR = {True: "speedometer", False: "constraint alone"}


def line(cells):
    return "| " + " | ".join(cells) + " |"


def heading(cells):
    return [line(cells), "|" + "---|" * len(cells)]


def mean(values):
    return f"{statistics.fmean(values):.2f}" if values else "-"


def case_of(rows, speedometer, seconds):
    return [row for row in rows if (row["speedometer"], row["seconds"]) == (speedometer, seconds)]


def is_whole(result):
    """All cuts are in it: those of 30 s, and the Husky's."""
    return all(case_of(result.get("car", {}).get("outages", []), *case) for case in CASES) and bool(result.get("husky", {}).get("outages"))


def cell(row):
    text = f"{row['error_m']:.1f} / {'>' if row['sigma_limited'] else ''}{row['three_sigma_m']:.1f} m, {row['nees']:.2f}"
    return f"**{text}**" if row["beyond"] else text


def outage_table(rows):
    """Each position a line: error / 3 sigma, NEES. *: the mounting was taken from there; o: the IMU has a hole in its last minute."""
    cases = [case for case in CASES if case_of(rows, *case)]
    yield from heading(["cut from", "driven in 60 s", *[f"{SENSOR[speedometer]}, {seconds} s" for speedometer, seconds in cases]])
    for start in dict.fromkeys(row["start_s"] for row in rows):
        mine = [row for case in cases for row in case_of(rows, *case) if row["start_s"] == start]
        marks = ("\\*" if mine[-1]["calibrated_on"] else "") + ("o" if mine[-1]["imu_hole"] else "")
        driven = next(row["driven_m"] for row in mine if row["seconds"] == 60)
        yield line([f"{start} s {marks}".strip(), f"{driven:.0f} m", *map(cell, mine)])
    yield line(["median error; beyond 3 sigma", "", *(
        f"{statistics.median(row['error_m'] for row in mine):.1f} m; {sum(row['beyond'] for row in mine)} of {len(mine)}"
        for mine in (case_of(rows, *case) for case in cases))])


def nees_line(what, reference, rows):
    return line([what, reference, "x, y", mean([row["nees"] for row in rows]), mean([row["nees_with_fix"] for row in rows]), "2",
                 f"{sum(row['beyond'] for row in rows)} of {len(rows)}"])


def nees_table(result):
    """Mean of the squared error in the published covariance; a second time with the reference's own sigma added."""
    yield from heading(["recorded", "compared with", "of", "mean NEES", "with the reference's sigma", "expected", "beyond 3 sigma"])
    rows = result.get("car", {}).get("outages", [])
    for speedometer, seconds in CASES:
        for hole in (False, True):
            mine = [row for row in case_of(rows, speedometer, seconds) if row["imu_hole"] == hole]
            if mine:
                yield nees_line(f"Skog's car, {seconds} s without GNSS, {SENSOR[speedometer]}{', the hole of the IMU in it' if hole else ''}", "the fix withheld", mine)
    for name, one in result.get("px4", {}).items():
        for block, nees in one["nees"].items():
            yield line([f"PX4's log `{name}`", "PX4's EKF2", block, f"{nees:.2f}", "-", "3", "-"])
    husky = result.get("husky", {})
    if husky:
        yield line(["Husky, odometry and IMU, its end", "robot_localization's end", "x, y", f"{husky['end']['nees']:.2f}", "-", "2", f"{int(husky['end']['beyond'])} of 1"])
    if husky.get("outages"):
        yield nees_line("Husky, 60 s without GNSS, odometry and IMU", "the fix withheld", husky["outages"])


def median(rows):
    return statistics.median(row["error_m"] for row in rows)


def drive_table(result):
    """One line a drive and comparison; only of a file with all cuts."""
    yield from heading(["recorded", "what is cut or compared", "result"])
    for speedometer, seconds in sorted(CASES, key=lambda case: (not case[0], -case[1])):
        rows = case_of(result["car"]["outages"], speedometer, seconds)
        others = [row for row in rows if not row["calibrated_on"]]
        yield line(["Skog's car", f"GNSS cut for {seconds} s at {len(rows)} positions, {SENSOR[speedometer]}: error at the end",
                    f"median {median(rows):.1f} m ({median(others):.1f} m at the {len(others)} positions that gave no mounting); {sum(row['beyond'] for row in rows)} beyond 3 sigma"])
    for name, one in result["px4"].items():
        yield line([f"PX4's log `{name}`", "attitude, velocity, position RMS from PX4's own EKF2, from 10 s on",
                    f"{one['attitude_rms_deg']:.2f} deg, {one['velocity_rms_mps']:.3f} m/s, {one['position_rms_m']:.2f} m"])
    husky = result["husky"]
    yield line(["Husky", "end of odometry and IMU, from the end that robot_localization publishes", f"{husky['end']['error_m']:.2f} m after 359 m (its tolerance: 1.05 m)"])
    yield line(["Husky", "RMS from the GPS track, fixes fused; their NIS per degree of freedom",
                f"{husky['gnss_rms_m']:.2f} m; {husky['gnss_sensors']['GnssPosition']['nis_per_dof']:.2f}"])
    rows = husky["outages"]
    yield line(["Husky", f"fixes cut for 60 s at {len(rows)} positions, odometry and IMU: error at the end",
                f"median {median(rows):.1f} m, worst {max(row['error_m'] for row in rows):.1f} m; {sum(row['beyond'] for row in rows)} beyond 3 sigma"])
