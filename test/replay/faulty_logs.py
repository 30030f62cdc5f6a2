#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Logs with one fault put in, replayed: faulty_logs.py PROGRAMS OUT.

Wheels that are wired wrongly are named within ten seconds of driving (of turning, where only a turn shows it). Counters that begin anew cost no
way. Frames that a gateway holds leave the estimate within its own 3 sigma of that of the clean log. Frames that come late for a while leave that of
the log without them. Both are counted.
The faults are put in by tetap.can.faulty_log, which knows the DBC and nothing of the node.
"""
import csv
import math
import os
import subprocess
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))
sys.dont_write_bytecode = True
sys.path.insert(0, os.path.join(ROOT, "tools", "python"))
from tetap.can import faulty_log  # noqa: E402

REJECTING, TOO_LATE, WHEEL_SLIP = 1 << 1, 1 << 3, 1 << 8
BEGIN_S = 34.0  # in the first curve
SENSORS = {
    "all": None,
    "fixes": ["In_GnssLat", "In_GnssLon", "In_GnssAlt", "In_GnssAcc", "In_GnssVelEN", "In_GnssVelU"],
    "IMU": ["In_Imu0Gyro", "In_Imu0Accel", "In_Imu0Time"],
    "wheels": ["In_WheelCounts"],
}


def table(folder, name):
    with open(os.path.join(folder, name), encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


class Robot:
    """A robot's drive in the simulated world, and replays of it with faults."""

    def __init__(self, programs, out, name, seconds):
        self.programs, self.out, self.name = programs, os.path.join(out, name), name
        self.run("tetap-world", "--memory", "--robot", name, "--duration", str(seconds), "--raw", "--out", self.out, "--quiet")
        self.frames = faulty_log.in_bus_time(faulty_log.read(os.path.join(self.out, "raw.log")))
        self.truth = table(self.out, "truth.csv")

    def run(self, program, *words):
        done = subprocess.run([os.path.join(self.programs, program), *words], capture_output=True, text=True)
        if done.returncode != 0:
            sys.exit(f"{program} {' '.join(words)} failed:\n{done.stdout}{done.stderr}")

    def replayed(self, frames, what):
        folder = os.path.join(self.out, what.replace(" ", "_"))
        os.makedirs(folder, exist_ok=True)
        log = folder + ".log"
        faulty_log.write(frames, log)
        self.run("tetap-play", log, "--memory", "--lockstep", "--robot", self.name, "--out", folder, "--quiet")
        return folder

    def first(self, holds):
        """Time of the first row of the truth that `holds`, given the first row."""
        value = lambda row, key: float(row[key])  # noqa: E731
        begin = self.truth[0]
        return next(value(row, "time_s") for row in self.truth if holds(lambda key: value(row, key) - value(begin, key)))


def named_at(folder, mask):
    return next((float(row["time_s"]) for row in table(folder, "status.csv") if int(row["faults"]) & mask), math.inf)


def estimates(folder, estimator):
    """Time -> (x, y, 3 sigma): the sigma is the last that was stated."""
    rows, sigma = {}, math.inf
    for row in table(folder, "estimates.csv"):
        if row["estimator"] != str(estimator):
            continue
        if row["std_x_m"]:
            sigma = 3 * max(float(row["std_x_m"]), float(row["std_y_m"]))
        rows[row["time_s"]] = (float(row["x_m"]), float(row["y_m"]), sigma)
    return rows


def apart(one, other, since_s=0.0):
    """Largest distance, and largest distance over the first one's 3 sigma, of estimates of equal time."""
    both = [(one[t], other[t]) for t in one if t in other and float(t) > since_s]
    distances = [(math.hypot(a[0] - b[0], a[1] - b[1]), a[2]) for a, b in both]
    return max(d for d, _ in distances), max(d / s for d, s in distances)


class Checks:
    def __init__(self):
        self.wrong = []

    def bound(self, what, value, high):
        ok = value <= high
        print(f"  {what:58} {value:8.3f}   .. {high:.3f}   {'ok' if ok else 'WRONG'}", flush=True)
        if not ok:
            self.wrong.append(what)


def wheels(robot, checks):
    drives = robot.first(lambda moved: math.hypot(moved("x_m"), moved("y_m")) > 0.05)
    turns = robot.first(lambda moved: abs(moved("yaw_rad")) > 0.3)
    clean = named_at(robot.replayed(robot.frames, "clean"), WHEEL_SLIP | REJECTING)
    checks.bound(f"{robot.name}: faults without a fault", float(clean < math.inf), 0)
    for fault in faulty_log.WHEELS:
        since = turns if fault in ("swapped", "both_reversed") else drives
        named = named_at(robot.replayed(faulty_log.with_wheels(robot.frames, fault), fault), WHEEL_SLIP | REJECTING)
        checks.bound(f"{robot.name}: {fault} named after [s]", named - since, 10)


def restarts(robot, checks):
    clean = estimates(robot.replayed(robot.frames, "clean"), 0)
    for at_s in (20, 36, 51):
        for sides in (("Left", "Right"), ("Left",), ("Right",)):
            what = f"{'_'.join(sides)} at {at_s}"
            folder = robot.replayed(faulty_log.counters_restarted(robot.frames, at_s * 1_000_000, sides), what)
            metres, _ = apart(estimates(folder, 0), clean)
            checks.bound(f"{robot.name}: counters anew, {what}: odometry off by [m]", metres, 0.1)
            refused = [row for row in table(folder, "innovations.csv")
                       if row["sensor"] == "WheelCounts" and row["verdict"] == "Rejected" and row["failed"] == "Value"]
            checks.bound(f"{robot.name}: counters anew, {what}: not said", float(not refused), 0)


def delays(robot, checks):
    clean = estimates(robot.replayed(robot.frames, "clean"), 2)
    begin_us = int(BEGIN_S * 1e6)
    end_us = begin_us + 6_000_000
    lost = {name: estimates(robot.replayed(faulty_log.lost(robot.frames, begin_us, end_us, messages), f"{name} lost"), 2)
            for name, messages in SENSORS.items()}
    for delay_s in (0.9, 1.04, 2.1):
        by_us = round(delay_s * 1e6)
        what = f"held for {delay_s} s"
        folder = robot.replayed(faulty_log.held(robot.frames, by_us, begin_us), what)
        _, sigmas = apart(estimates(folder, 2), clean, BEGIN_S)
        checks.bound(f"{robot.name}: {what}: error over 3 sigma", sigmas, 1)
        checks.bound(f"{robot.name}: {what}: TooLate after [s]", named_at(folder, TOO_LATE) - BEGIN_S, delay_s + 1)
        for name, messages in SENSORS.items():
            what = f"{name} late by {delay_s} s for 6 s"
            folder = robot.replayed(faulty_log.delayed(robot.frames, by_us, begin_us, end_us, messages), what)
            metres, _ = apart(estimates(folder, 2), lost[name], BEGIN_S)
            checks.bound(f"{robot.name}: {what}: from the run without them [m]", metres, 0.01)
            checks.bound(f"{robot.name}: {what}: TooLate after [s]", named_at(folder, TOO_LATE) - BEGIN_S, delay_s + 1)


def main():
    programs, out = sys.argv[1:3]
    os.makedirs(out, exist_ok=True)
    checks = Checks()
    rover = Robot(programs, out, "rover", 70)
    wheels(rover, checks)
    restarts(rover, checks)
    delays(rover, checks)
    wheels(Robot(programs, out, "rover_landmarks", 70), checks)
    if checks.wrong:
        sys.exit("outside their bounds: " + ", ".join(checks.wrong))


if __name__ == "__main__":
    main()
