#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The menu's filters as firmware on logs, in one process: menu_runs.py PROGRAMS OUT [--short] [SET...]. The planar filters are held against the extended
Kalman filter on the same logs; a result much better than it is as suspicious as a worse one. Two receivers: fixes drawn here, with a truth.
Needs $TETAP_DATA (default ../shared/data) for recorded sets; one that is not there is named as skipped. OUT/menu.json holds the figures.
--short takes two robots of MRCLAM in place of five, and OUT/menu_short.json."""
import concurrent.futures
import csv
import json
import math
import os
import statistics
import subprocess
import sys

import numpy as np

sys.dont_write_bytecode = True
ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))
sys.path.insert(0, os.path.join(ROOT, "tools", "python"))
from tetap.can import bus_writer  # noqa: E402
from tetap.report import metrics  # noqa: E402

DATA = os.environ.get("TETAP_DATA") or os.path.join(os.path.dirname(ROOT), "shared", "data")
MRCLAM_ROBOTS = range(1, 6)
SHORT_ROBOTS = (2, 4)  # their starts without ids are found within a minute; robot 1 is left to the whole form
# Error of the start pose: 2.2 m and 1.5 rad, with some centimetres and hundredths of a radian from run to run.
PARTICLE_SEEDS = (1, 2)  # one run by particles scatters by 5 %
WRONG_STARTS = ((2.03, 0.96, 1.47), (1.95, 1.06, 1.55))


def run(*words):
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True)
    if done.returncode != 0:
        raise RuntimeError(f"{' '.join(words)} failed:\n{done.stdout}{done.stderr}")
    return done.stdout


class Runs:
    """Imports and replays below a folder; each replay gives its summary."""

    def __init__(self, programs, out, robots=MRCLAM_ROBOTS):
        self.programs, self.out, self.robots = programs, out, robots
        os.makedirs(out, exist_ok=True)

    def path(self, name):
        return os.path.join(self.out, name)

    def imported(self, name, tool, *words):
        run(f"tools/dataset/{tool}", *words, self.path(name))
        return name

    def replayed(self, log, robot, *settings, folder=None, truth=True):
        folder = self.path(folder or f"{log}_{robot}")
        words = [word for setting in settings for word in ("--set", setting)]
        run(os.path.join(self.programs, "tetap-play"), self.path(f"{log}.log"), "--memory", "--robot", robot, "--out", folder, "--quiet", *words)
        truth = ["--truth", self.path(f"{log}.truth.csv")] if truth else []
        run("tools/report/write_report", folder, *truth, "--no-pictures")
        with open(os.path.join(folder, "summary.json"), encoding="utf-8") as file:
            return json.load(file)


class Bounds:
    def __init__(self):
        self.wrong, self.figures = [], {}

    def check(self, what, value, low, high):
        held = value is not None and low <= value <= high
        shown = "none" if value is None else f"{value:.4f}"
        print(f"  {what:52} {shown:>9}   {low:.3f} .. {high:.3f}   {'ok' if held else 'WRONG'}")
        self.figures[what] = {"value": value, "low": low, "high": high}
        if not held:
            self.wrong.append(what)

    def finish(self, path):
        """Writes the figures; ends the program where one is outside its bounds."""
        with open(path, "w", encoding="utf-8") as file:
            json.dump(self.figures, file, indent=1)
        if self.wrong:
            sys.exit("outside their bounds: " + ", ".join(self.wrong))


def run_campaign(folder, figures, campaign):
    """PROGRAMS OUT [--whole] from the command line: campaign(runs, bounds, pool, whole) on the data in `folder`; status 77 without it."""
    programs, out, *words = sys.argv[1:]
    if not os.path.isdir(folder):
        print(f"  skipped: no {folder} (set TETAP_DATA)")
        sys.exit(77)
    bounds, runs = Bounds(), Runs(programs, out)
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        campaign(runs, bounds, pool, "--whole" in words)
    bounds.finish(runs.path(figures))


def mrclam(runs, bounds, pool):
    folder = os.path.join(DATA, "mrclam", "MRCLAM_Dataset7")
    robots = ("mrclam", "mrclam_ukf", "mrclam_ukf_sqrt", "mrclam_pf")
    logs = {k: pool.submit(runs.imported, f"mrclam{k}", "import_mrclam", folder, str(k)) for k in runs.robots}
    found = {(k, robot): pool.submit(lambda k=k, robot=robot: runs.replayed(logs[k].result(), robot)["fused"]) for k in runs.robots for robot in robots}
    particles = {k: [pool.submit(lambda k=k, seed=seed: runs.replayed(logs[k].result(), "mrclam_pf", f"mapping.seed={seed}", folder=f"mrclam{k}_seed{seed}")["fused"])
                     for seed in PARTICLE_SEEDS[1:]] for k in runs.robots}
    for k in runs.robots:
        of = {robot: found[k, robot].result() for robot in robots}
        ekf_m, ekf_deg = of["mrclam"]["position_rmse_m"], of["mrclam"]["heading_rmse_deg"]
        for robot in ("mrclam_ukf", "mrclam_ukf_sqrt"):
            bounds.check(f"robot {k}: {robot} position RMSE over the EKF's", of[robot]["position_rmse_m"] / ekf_m, 0.9, 1.03)
            bounds.check(f"robot {k}: {robot} heading RMSE over the EKF's", of[robot]["heading_rmse_deg"] / ekf_deg, 0.9, 1.05)
        of_seeds = [one.result() for one in particles[k]] + [of["mrclam_pf"]]
        pf_m, pf_nees = (statistics.mean(one[figure] for one in of_seeds) for figure in ("position_rmse_m", "nees_mean"))
        bounds.check(f"robot {k}: mrclam_pf position RMSE over the EKF's, {len(of_seeds)} seeds", pf_m / ekf_m, 0.7, 1.17)
        bounds.check(f"robot {k}: mrclam_pf NEES (3 expected)", pf_nees, 0.5, 10)
        print(f"  robot {k}: " + ", ".join(f"{robot} {one['position_rmse_m']:.3f} m {one['heading_rmse_deg']:.2f} deg NEES {one['nees_mean']:.1f}" for robot, one in of.items()))


def mrclam_without_ids(runs, bounds, pool):
    """Landmarks seen without their identities: nearest neighbours are enough on robots 2 to 5, and fail on robot 1."""
    robots = {k: "mrclam_pf" if k == 1 else "mrclam" for k in runs.robots}

    def ratio(k, robot):
        with open(runs.path(f"mrclam{k}_{robot}/summary.json"), encoding="utf-8") as file:
            known_m = json.load(file)["position_rmse_m"]
        return runs.replayed(f"mrclam{k}_no_ids", robot)["position_rmse_m"] / known_m

    folder = os.path.join(DATA, "mrclam", "MRCLAM_Dataset7")
    list(pool.map(lambda k: runs.imported(f"mrclam{k}_no_ids", "import_mrclam", "--no-ids", folder, str(k)), robots))
    for (k, robot), found in zip(robots.items(), pool.map(ratio, *zip(*robots.items()))):
        bounds.check(f"robot {k}: {robot} without ids over with ids", found, 0.85, 1.15 if k == 1 else 1.1)


def mrclam_grid(runs, bounds, pool):
    """Nothing is known of the start; the error counts from the moment the robot is found."""
    folder = os.path.join(DATA, "mrclam", "MRCLAM_Dataset7")

    def found(k):
        return runs.replayed(runs.imported(f"mrclam{k}_no_start", "import_mrclam", "--no-start", folder, str(k)), "mrclam_grid")["fused"]

    for k, one in zip(runs.robots, pool.map(found, runs.robots)):
        after_s = found_after_s(runs.path(f"mrclam{k}_no_start.truth.csv"), runs.path(f"mrclam{k}_no_start_mrclam_grid/estimates.csv"))
        bounds.check(f"robot {k}: mrclam_grid, no start: found after [s]", after_s, 0.5, 60)
        bounds.check(f"robot {k}: mrclam_grid position RMSE once valid [m]", one["position_rmse_m"], 0.05, 0.35)
        bounds.check(f"robot {k}: mrclam_grid NEES (3 expected)", one["nees_mean"], 0.3, 6)
        print(f"  robot {k}: mrclam_grid {one['position_rmse_m']:.3f} m {one['heading_rmse_deg']:.2f} deg, largest {one['max_error_m']:.2f} m, "
              f"{one['epochs_not_valid']} of {one['epochs']} epochs not valid")


def mrclam_lost(runs, bounds, pool):
    """A start 2.2 m and 1.5 rad wrong and sure of it."""
    folder = os.path.join(DATA, "mrclam", "MRCLAM_Dataset7")

    def recovered(k, number, error, words):
        name = f"mrclam{k}_wrong{number}" + ("_no_ids" if words else "")
        log = runs.imported(name, "import_mrclam", *words, "--start-error", *(str(v) for v in error), "--until", "90", folder, str(k))
        return runs.replayed(log, "mrclam_pf")["recovered_after_s"]

    starts = len(runs.robots) * len(WRONG_STARTS)
    for words, least_share, median_s in (((), 1, 15), (("--no-ids",), 0.8, 30)):
        waiting = [pool.submit(recovered, k, number, error, words) for k in runs.robots for number, error in enumerate(WRONG_STARTS)]
        after = [one.result() for one in waiting]
        print("  wrong start" + (", ids withheld" if words else "") + ": " + " ".join("none" if t is None else f"{t:.1f}" for t in after) + " s")
        within = sum(t is not None and t <= 60 for t in after)
        what = "ids withheld" if words else "ids known"
        bounds.check(f"wrong start, {what}: found within 60 s of {starts}", within, least_share * starts, starts)
        bounds.check(f"wrong start, {what}: median [s]", statistics.median(90 if t is None else t for t in after), 0.5, median_s)


# RMSE of x, y [m], vx, vy [m/s] that the course asks for, by robot and file.
UDACITY = {("tracker", "obj_pose-laser-radar-synthetic-input"): (0.11, 0.11, 0.52, 0.52), ("tracker", "sample-laser-radar-measurement-data-1"): (0.08, 0.08, 0.60, 0.60),
           ("tracker_ukf", "obj_pose-laser-radar-synthetic-input"): (0.09, 0.10, 0.40, 0.30), ("tracker_ukf", "sample-laser-radar-measurement-data-1"): (0.09, 0.09, 0.65, 0.65)}


def course_rmse(source, estimates):
    """At the times of the measurements, as the course takes it: the estimate of the first tick at or after each."""
    truth = []
    with open(source, encoding="utf-8") as file:
        for line in file:
            words = line.split()
            if words:
                at = 3 if words[0] == "L" else 4
                truth.append([float(v) for v in words[at:at + 5]])
    truth = np.array(truth)
    time_s = (truth[:, 0] - truth[0, 0]) * 1e-6 + 1.0  # the importers' time base
    with open(estimates, encoding="utf-8", newline="") as file:
        rows = [row for row in csv.DictReader(file) if row["x_m"] and row["speed_mps"]]
    at = np.array([float(row["time_s"]) for row in rows])
    next_tick = np.searchsorted(at, time_s - 1e-9)
    inside = next_tick < len(rows)
    found = np.array([[float(rows[i]["x_m"]), float(rows[i]["y_m"]), float(rows[i]["speed_mps"]) * math.cos(float(rows[i]["yaw_rad"])),
                       float(rows[i]["speed_mps"]) * math.sin(float(rows[i]["yaw_rad"]))] for i in next_tick[inside]])
    moved_s = (at[next_tick[inside]] - time_s[inside])[:, None]  # the truth at the tick: less than a tick later
    expected = truth[inside, 1:5] + np.hstack([moved_s * truth[inside, 3:5], np.zeros((inside.sum(), 2))])
    return np.sqrt(((found - expected) ** 2).mean(axis=0)), int(inside.sum()) / len(truth)


def udacity(runs, bounds, pool):
    del pool
    folder = os.path.join(DATA, "udacity_ekf_ukf")
    for (robot, name), limits in UDACITY.items():
        source = os.path.join(folder, f"{name}.txt")
        log = runs.imported(name.split("-")[0] + "_track", "import_udacity_track", source)
        runs.replayed(log, robot)
        rmse, compared = course_rmse(source, os.path.join(runs.path(f"{log}_{robot}"), "estimates.csv"))
        bounds.check(f"{robot}, {name[:8]}: share of the rows compared", compared, 0.98, 1)
        for what, value, limit in zip(("x [m]", "y [m]", "vx [m/s]", "vy [m/s]"), rmse, limits):
            bounds.check(f"{robot}, {name[:8]}: RMSE of {what}", float(value), 0.4 * limit, limit)


def found_after_s(truth_path, estimates_path):
    """Time from the begin of the truth until the robot is found, an epoch without a valid position counting as far away."""
    truth = np.loadtxt(truth_path, delimiter=",", skiprows=1)
    with open(estimates_path, encoding="utf-8", newline="") as file:
        rows = [row for row in csv.DictReader(file) if row["estimator"] == "1" and truth[0, 0] <= float(row["time_s"]) <= truth[-1, 0]]
    time_s = np.array([float(row["time_s"]) for row in rows])
    valid = np.array([row["pos_valid"] == "1" for row in rows])
    found = np.array([[float(row["x_m"] or 0), float(row["y_m"] or 0)] for row in rows])
    error = found - np.column_stack([np.interp(time_s, truth[:, 0], truth[:, i]) for i in (1, 2)])
    recovery = metrics.Recovery()
    recovery.add(time_s, np.hypot(*error.T), valid)
    return recovery.value()


def udacity_particles(runs, bounds, pool):
    """The vehicle of the particle filter project, 100 particles: mean absolute errors, as the project takes them; the mean of four seeds."""
    log = runs.imported("udacity_pf", "import_udacity_pf", os.path.join(DATA, "udacity_pf"))
    seeds = range(1, 5)
    list(pool.map(lambda seed: runs.replayed(log, "udacity_pf", f"mapping.seed={seed}", folder=f"udacity_pf_{seed}"), seeds))
    errors = np.array([mean_errors(runs.path(f"{log}.truth.csv"), runs.path(f"udacity_pf_{seed}/estimates.csv")) for seed in seeds])
    print("  udacity_pf: " + "; ".join(" ".join(f"{value:.5f}" for value in one) for one in errors))
    for what, values, limit in zip(("x [m]", "y [m]", "yaw [rad]"), errors.T, (0.03, 0.03, 0.001)):
        bounds.check(f"udacity_pf, 100 particles: mean error of {what}", float(values.mean()), 0.1 * limit, limit)
        bounds.check(f"udacity_pf, 100 particles: worst seed's of {what}", float(values.max()), 0.1 * limit, 1.2 * limit)


def mean_errors(truth_path, estimates_path):
    """Mean |error| of x, y [m] and yaw [rad] at the times of the truth from the first valid estimate on, by the estimate of that tick."""
    truth = np.loadtxt(truth_path, delimiter=",", skiprows=1)
    with open(estimates_path, encoding="utf-8", newline="") as file:
        rows = [row for row in csv.DictReader(file) if row["estimator"] == "1" and row["pos_valid"] == "1"]
    found = np.array([[float(row[key]) for key in ("time_s", "x_m", "y_m", "yaw_rad")] for row in rows])
    at = np.searchsorted(found[:, 0], truth[:, 0] - 1e-6)
    same = at < len(found)
    same[same] &= np.abs(found[at[same], 0] - truth[same, 0]) < 1e-3
    if same.sum() < 0.99 * len(truth):
        raise RuntimeError(f"{estimates_path}: {same.sum()} valid estimates at the {len(truth)} times of {truth_path}")
    error = found[at[same], 1:] - truth[same, 1:]
    error[:, 2] = np.remainder(error[:, 2] + np.pi, 2 * np.pi) - np.pi
    return np.abs(error).mean(axis=0)


FIXES, SIGMA_M, SHARED_M = 2000, (1.0, 1.5), 0.8  # two receivers at rest: 1 sigma per axis, and of the error that both have


def two_receivers_log(runs, name, shared_m, seed):
    """Fixes of two receivers at one place, five a second, each with its honest sigma; a part of the error may be the same in both."""
    draw = np.random.default_rng(seed)
    log = bus_writer.Log(bus_writer.Dbc())
    time_us = 2_000_000 + 200_000 * np.arange(FIXES)
    latitude, longitude = 48.0, 11.0
    per_latitude_m, per_longitude_m = 111_199.05, 74_631.19  # at this place: WGS 84, 500 m above the ellipsoid
    common = draw.normal(0, shared_m, (FIXES, 2)) if shared_m else np.zeros((FIXES, 2))
    errors = [common + draw.normal(0, np.sqrt(sigma_m**2 - shared_m**2), (FIXES, 2)) for sigma_m in SIGMA_M]
    for instance, (sigma_m, error) in enumerate(zip(SIGMA_M, errors)):
        head = {"Stamp": time_us & bus_writer.STAMP_MASK, "Seq": bus_writer.sequence(FIXES), "Inst": instance}
        log.add("In_GnssLat", time_us, **head, Lat=latitude + error[:, 1] / per_latitude_m)
        log.add("In_GnssLon", time_us, **head, Lon=longitude + error[:, 0] / per_longitude_m)
        log.add("In_GnssAlt", time_us, **head, Height=500.0, Fix=3, NumSv=12)
        log.add("In_GnssAcc", time_us, **head, Hor=sigma_m, Ver=2.0)
    with open(runs.path(f"{name}.log"), "wb") as file:
        file.write(log.text())
    first = errors[0][0]  # the map's origin is the first fix of the first receiver
    with open(runs.path(f"{name}.truth.csv"), "w", encoding="utf-8") as file:
        file.write("time_s,x_m,y_m,yaw_rad\n" + "".join(f"{t:.6f},{-first[0]:.6f},{-first[1]:.6f},\n" for t in time_us * 1e-6))


def two_receivers(runs, bounds, pool):
    """Each rule's NEES (2 expected, +-0.13 are three standard deviations of 2000 fixes), and its error against the best that can be."""
    del pool
    for name, shared_m in (("independent", 0.0), ("shared", SHARED_M)):
        two_receivers_log(runs, f"two_{name}", shared_m, 5)
        summary = runs.replayed(f"two_{name}", "fusion2")
        inverse, intersection = summary["fused"], summary["estimator1"]
        a, b, c = SIGMA_M[0]**2, SIGMA_M[1]**2, shared_m**2
        weight = b / (a + b)
        claimed, true = a * weight, weight**2 * (a - c) + (1 - weight)**2 * (b - c) + c
        bounds.check(f"two receivers, {name}: inverse variance, NEES", inverse["nees_mean"], 0.93 * 2 * true / claimed, 1.07 * 2 * true / claimed)
        bounds.check(f"two receivers, {name}: inverse variance, RMSE [m]", inverse["position_rmse_m"], 0.96 * (2 * true)**0.5, 1.04 * (2 * true)**0.5)
        bounds.check(f"two receivers, {name}: intersection, NEES", intersection["nees_mean"], 1.7, 2.14)


SETS = {"mrclam": ("mrclam", (mrclam, mrclam_without_ids, mrclam_lost, mrclam_grid)), "udacity": ("udacity_ekf_ukf", (udacity,)),
        "udacity_pf": ("udacity_pf", (udacity_particles,)), "two_receivers": ("", (two_receivers,))}


def main():
    programs, out, *wanted = sys.argv[1:]
    short = "--short" in wanted
    wanted = [word for word in wanted if word != "--short"]
    bounds = Bounds()
    runs, there = Runs(programs, out, SHORT_ROBOTS if short else MRCLAM_ROBOTS), False
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        for name, (folder, parts) in SETS.items():
            if wanted and name not in wanted:
                continue
            if not os.path.isdir(os.path.join(DATA, folder)):
                print(f"  {name} skipped: no {os.path.join(DATA, folder)} (set TETAP_DATA)")
                continue
            there = True
            for part in parts:
                part(runs, bounds, pool)
    bounds.finish(runs.path("menu_short.json" if short else "menu.json"))
    if not there:
        sys.exit(77)


if __name__ == "__main__":
    main()
