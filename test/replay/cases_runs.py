#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Inputs on which a node or a tool went wrong: cases_runs.py PROGRAMS OUT. Public reports of others, rebuilt, recorded data with a fault, attacks.

  node      held against its truth: where PosValid is set the position stays within 3 sigma but for the spans named here, and the end is inside.
            What has to be announced is looked for in the status.
  security  a node that takes no commands keeps its estimate.
  tools     a motor's field is refused, a CAN FD frame is none of ours, a line of 40 000 digits is refused at once.
Inputs of drivers and of the attitude filter: test/drivers/gnss/cases_test.py, test/replay/attitude_test.py.
Data: $TETAP_CASES (default ../shared/cases), $TETAP_DATA (default ../shared/data). Exit status 77 (skipped) where the cases are missing."""
import bisect
import csv
import math
import os
import resource
import subprocess
import sys

sys.dont_write_bytecode = True
ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))
sys.path.insert(0, os.path.join(ROOT, "tools", "python"))
from tetap.can import faulty_log  # noqa: E402
from tetap.report.metrics import code_names  # noqa: E402

CASES = os.environ.get("TETAP_CASES", os.path.join(ROOT, os.pardir, "shared", "cases"))
DATA = os.environ.get("TETAP_DATA", os.path.join(ROOT, os.pardir, "shared", "data"))
STEP_m = 1e-3  # of the published position


class Result:
    """A replay beside its truth."""

    def __init__(self, folder, truth):
        self.folder = folder
        rows = self.table("estimates.csv")
        last = max(int(row["estimator"]) for row in rows)
        self.epochs = [row for row in rows if int(row["estimator"]) == last and row["pos_valid"] == "1"]
        self.errors = list(self._errors(truth)) if truth else []

    def table(self, name):
        with open(os.path.join(self.folder, name), encoding="utf-8", newline="") as file:
            return list(csv.DictReader(file))

    def said(self):
        """Names of all faults in the status."""
        names, bits = code_names()["Fault"], 0
        for row in self.table("status.csv"):
            bits |= int(row["faults"] or 0)
        return {name for bit, name in names.items() if bits >> bit & 1}

    def _errors(self, truth):
        """(time, error of the position [m], in units of 3 sigma, error of the heading in units of 3 sigma)."""
        with open(truth, encoding="utf-8", newline="") as file:
            rows = [(float(r["time_s"]), float(r["x_m"]), float(r["y_m"]), float(r.get("yaw_rad") or "nan"))
                    for r in csv.DictReader(file) if r["x_m"] and r.get("pos_valid", "1") == "1"]
        times = [row[0] for row in rows]
        for row in self.epochs:
            if not row["std_x_m"]:
                continue
            time_s = float(row["time_s"])
            i = bisect.bisect_left(times, time_s)
            if i == 0 or i == len(times) or times[i] - times[i - 1] > 2.5:
                continue
            part = (time_s - times[i - 1]) / (times[i] - times[i - 1])
            x, y = (rows[i - 1][k] + part * (rows[i][k] - rows[i - 1][k]) for k in (1, 2))
            yaw = rows[i - 1][3] + part * math.remainder(rows[i][3] - rows[i - 1][3], 2 * math.pi)
            error = math.hypot(float(row["x_m"]) - x, float(row["y_m"]) - y)
            sigma = math.hypot(float(row["std_x_m"]), float(row["std_y_m"]))
            turn = abs(math.remainder(float(row["yaw_rad"]) - yaw, 2 * math.pi))
            yield time_s, error, error / (3 * sigma + STEP_m), turn / (3 * float(row["std_yaw_rad"] or "nan"))

    def beyond_s(self, quantity=2):
        """Longest span beyond 3 sigma of the position (2) or the heading (3)."""
        longest, since = 0.0, None
        for time_s, ratio in ((error[0], error[quantity]) for error in self.errors):
            since = None if ratio <= 1 else time_s if since is None else since
            longest = max(longest, time_s - since if since is not None else 0.0)
        return longest


class Runs:
    def __init__(self, programs, out):
        self.programs, self.out, self.failures = programs, out, []
        os.makedirs(out, exist_ok=True)

    def play(self, name, log, robot, truth, *words):
        folder = os.path.join(self.out, name)
        done = subprocess.run([os.path.join(self.programs, "tetap-play"), log, "--memory", "--robot", robot, "--out", folder, "--quiet", *words],
                              capture_output=True, text=True, check=False)
        if done.returncode:
            sys.exit(f"{name}: status {done.returncode}\n{done.stdout}{done.stderr}")
        return Result(folder, truth)

    def judge(self, name, result, allowed_s, *expected):
        """`expected`: (what, whether it is so)."""
        worst = max(result.errors, key=lambda e: e[2], default=(0, 0, 0, 0))
        print(f"{name:24} {len(result.epochs):6} valid  worst {worst[1]:8.2f} m {worst[2]:6.2f} x 3 sigma  beyond {result.beyond_s():5.2f} s  "
              f"end {result.errors[-1][1] if result.errors else math.nan:6.2f} m  {' '.join(sorted(result.said()))}", flush=True)
        wanted = [(f"beyond 3 sigma for {result.beyond_s():.2f} s, {worst[2]:.2f} times", result.beyond_s() <= allowed_s),
                  ("no valid position beside the truth", bool(result.errors)), ("the end is outside", bool(result.errors) and result.errors[-1][2] <= 1), *expected]
        self.failures += [f"{name}: {what}" for what, holds in wanted if not holds]


def own_log(name):
    return os.path.join(CASES, "node", name + ".log")


def own_truth(name):
    return os.path.join(CASES, "node", name + ".truth.csv")


def of_rover(runs):
    for name, words in (("lat48_28km_east", ("--lockstep",)), ("n1_rest_gnss_velocity_2mps_two_samples", ()), ("n1_drive_gnss_velocity_2mps_3s", ())):
        runs.judge(name, runs.play(name, own_log(name), "rover", own_truth(name), *words), 0.5)
    name = "n2_gyro_z_dead"
    result = runs.play(name, own_log(name), "rover", own_truth(name))
    beyond_s = result.beyond_s(3)  # it takes half a second to tell a dead axis from one at rest
    runs.judge(name, result, 0.5, (f"the heading is beyond 3 sigma for {beyond_s:.2f} s", beyond_s <= 1.0), ("no word of the stuck axis", "SensorStuck" in result.said()))


def impulses(runs):
    """One IMU frame of 52 rad/s, and the same log with one of 53 g in its place."""
    name = "one_imu_frame_gyro"
    truth = own_truth("one_imu_frame")
    runs.judge(name, runs.play(name, own_log(name), "rover", truth, "--lockstep"), 2.0)
    changed = os.path.join(runs.out, "one_imu_frame_accel.log")
    fields = faulty_log.Fields()
    frames = faulty_log.read(own_log(name))
    gyro, accel = (fields.identifier[f"In_Imu0{part}"] for part in ("Gyro", "Accel"))
    at = max((i for i, f in enumerate(frames) if f.identifier == gyro), key=lambda i: max(abs(fields.get(frames[i].payload, "In_Imu0Gyro", f"Ang{a}")) for a in "XYZ"))
    before = max(i for i, f in enumerate(frames[:at]) if f.identifier == gyro)
    for axis in ("AngX", "AngY", "AngZ"):
        usual = fields.get(frames[before].payload, "In_Imu0Gyro", axis)
        frames[at] = frames[at]._replace(payload=fields.put(frames[at].payload, "In_Imu0Gyro", axis, usual))
    signal = fields.dbc.messages["In_Imu0Accel"].signals["VelX"]
    i = next(i for i in range(at - 3, at + 4) if frames[i].identifier == accel)
    frames[i] = frames[i]._replace(payload=fields.put(frames[i].payload, "In_Imu0Accel", "VelX", min(round(53 * 9.81 * 0.01 / signal.scale), signal.raw_max)))
    faulty_log.write(frames, changed)
    runs.judge("one_imu_frame_accel", runs.play("one_imu_frame_accel", changed, "rover", truth, "--lockstep"), 2.0)


def of_places(runs):
    """An origin far away, a first fix at 0/0, and the meridian of 180 deg."""
    name = "n4_origin_other_continent"
    fixed = runs.play(name, own_log(name), "rover", None, "--set", "gnss.origin_configured=1")
    runs.failures += [] if not fixed.epochs and "OriginOutOfRange" in fixed.said() else [f"{name}: a fixed origin is not named: {sorted(fixed.said())}, {len(fixed.epochs)} valid"]
    print(f"{name:24} origin fixed: {len(fixed.epochs)} valid, {' '.join(sorted(fixed.said()))}")
    free = runs.play(name + "_free", own_log(name), "rover", None)
    print(f"{name:24} origin free: {len(free.epochs)} valid, {' '.join(sorted(free.said()))}")
    runs.failures += [] if free.epochs else [f"{name}: the rover as it ships never gets a valid position"]
    for name in ("n5_first_fix_null_island", "n8_start_on_the_date_line"):
        result = runs.play(name, own_log(name), "iris", own_truth(name))
        first_s = float(result.epochs[0]["time_s"]) if result.epochs else math.inf
        runs.judge(name, result, 0.5, (f"valid from {first_s} s on only", first_s < 15))


def of_odometry(runs):
    """Both counters begin anew: odometry makes no leap that no wheel can do."""
    name = "n6_encoder_restart_odometry"
    result = runs.play(name, own_log(name), "rover", own_truth(name))
    rows = [row for row in result.table("estimates.csv") if row["estimator"] == "0" and row["x_m"]]
    truth = list(csv.DictReader(open(own_truth(name), encoding="utf-8")))
    fastest = max(math.hypot(float(b["x_m"]) - float(a["x_m"]), float(b["y_m"]) - float(a["y_m"])) / (float(b["time_s"]) - float(a["time_s"]))
                  for a, b in zip(truth, truth[1:]))
    leap = max(math.hypot(float(b["x_m"]) - float(a["x_m"]), float(b["y_m"]) - float(a["y_m"])) - fastest * (float(b["time_s"]) - float(a["time_s"]))
               for a, b in zip(rows, rows[1:]))
    runs.judge(name, result, 0.5, (f"odometry leaps by {leap:.2f} m", leap < 0.05))


def of_car(runs):
    """Two gyroscope samples of 20 rad/s in a minute and a half of Skog's drive. The same span without them is the truth: both begin at the same fix."""
    name = "car_two_wild_gyro_samples"
    data, prefix = os.path.join(DATA, "skog_gnss_ins"), os.path.join(runs.out, "skog")
    if not os.path.exists(data):
        return print(f"{name}: no data in {data}")
    done = subprocess.run([os.path.join(ROOT, "tools/dataset/import_skog"), data, prefix], capture_output=True, text=True, check=False)
    if done.returncode:
        sys.exit(done.stderr)
    wild = faulty_log.read(own_log(name))
    span = [f for f in faulty_log.read(prefix + ".log") if wild[0].time_us <= f.time_us <= wild[-1].time_us]
    faulty_log.write(span, prefix + ".span.log")
    runs.play("skog_span", prefix + ".span.log", "car", None)
    return runs.judge(name, runs.play(name, own_log(name), "car", os.path.join(runs.out, "skog_span", "estimates.csv")), 5.0)


def of_security(runs):
    """Two frames that set another pose, 500 m off, in the drive of one_imu_frame. A robot that obeys refuses their counter, which is not the next."""
    log = os.path.join(CASES, "security", "spoof_setpose.log")
    for commands, name in (("0", "spoof_setpose_open"), ("2", "spoof_setpose_closed")):
        result = runs.play(name, log, "rover", own_truth("one_imu_frame"), "--lockstep", "--set", f"bus.commands={commands}")
        runs.judge(name, result, 0.5, ("no word of the refused commands", "CommandRefused" in result.said()))


def of_tools(runs):
    def processor_s():
        used = resource.getrusage(resource.RUSAGE_CHILDREN)
        return used.ru_utime + used.ru_stime

    def ran(name, *words):
        """(status, what it said, processor time in s); five minutes of that end a program."""
        begin = processor_s()
        done = subprocess.run([os.path.join(ROOT, words[0]), *words[1:]], capture_output=True, text=True, check=False,
                              preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (300, 300)))
        took_s = processor_s() - begin
        print(f"{name:24} status {done.returncode}, {took_s:.1f} s: {(done.stderr or done.stdout or 'nothing').strip().splitlines()[-1][:110]}")
        return done.returncode, done.stdout + done.stderr, took_s

    tools = os.path.join(CASES, "tools")
    status, text, short_s = ran("d1_candump_view_fd", "tools/can/decode_log", os.path.join(tools, "d1_candump_view_fd.txt"))
    runs.failures += [] if status == 0 and "CAN FD" in text and "In_" not in text else [f"d1_candump_view_fd: {text}"]
    status, text, long_s = ran("redos_40000", "tools/can/decode_log", os.path.join(tools, "redos_40000.log"))
    runs.failures += [] if status == 1 and "redos_40000.log:1:" in text else [f"redos_40000: {text[:200]}"]
    runs.failures += [] if long_s < 10 * short_s else [f"redos_40000: {long_s:.1f} s for a line, {short_s:.1f} s for a log of 80 bytes"]
    status, text, _ = ran("c2_mag_motor", "tools/calibrate/calibrate_robot", os.path.join(tools, "c2_mag_motor_half_the_time.log"), "--robot", "iris",
                       "--parts", "mag", "--out", os.path.join(runs.out, "c2"))
    runs.failures += [] if status == 1 and "field" in text else [f"c2_mag_motor: a field that moves is not refused: {text[-300:]}"]


def cases_runs():
    if not os.path.isdir(os.path.join(CASES, "node")):
        print(f"cases_runs: no cases in {CASES}")
        sys.exit(77)
    runs = Runs(*sys.argv[1:3])
    for part in (of_rover, impulses, of_places, of_odometry, of_car, of_security, of_tools):
        part(runs)
    print("\n".join(runs.failures) or "cases_runs: all cases end right")
    sys.exit(1 if runs.failures else 0)


cases_runs()
