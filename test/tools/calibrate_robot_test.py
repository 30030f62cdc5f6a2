#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""tools/calibrate/calibrate_robot against known truth: logs made here with chosen errors, and the simulated world with its unequal wheels and wide track.

Errors are judged on both sides: normalised by the tool's own 1 sigma and over many seeds their mean square lies in an interval around one
(chi-square, 99.9 %, widened where a sigma holds more than the noise that is drawn), so a sigma too small fails as one too large does.

TETAP_PROGRAMS: where tetap-world is (default build/host/sim_host).
"""
import contextlib
import io
import json
import os
import re
import subprocess
import sys
import tempfile
import unittest

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # the machine is shared, and small matrices gain nothing

import numpy as np  # noqa: E402
from scipy.spatial.transform import Rotation  # noqa: E402
from scipy.stats import chi2  # noqa: E402

sys.dont_write_bytecode = True
ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))
TOOL = os.path.join(ROOT, "tools", "calibrate", "calibrate_robot")
sys.path.insert(0, os.path.join(ROOT, "tools", "python"))
with contextlib.redirect_stdout(io.StringIO()):
    from tetap.can import bus_writer
    from tetap.calibrate import recording
    from tetap.calibrate import magnetometer
    from tetap.calibrate import mounting
    from tetap.calibrate import parameter_table
    from tetap.calibrate import robot_numbers
    from tetap.calibrate import rest
    from tetap.calibrate import wheels
    from tetap.calibrate.robot_numbers import Refusal, Robot
    from tetap.dataset.inertial import from_enu

WORLD = os.path.join(os.environ.get("TETAP_PROGRAMS", os.path.join(ROOT, "build/host/sim_host")), "tetap-world")
WHOLE = bool(os.environ.get("whole"))  # more seeds, in `make proof`
G = 9.80665
FACES = [np.array(v, float) for v in ((1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1))]
PLACE = (48.2, 11.6, 500.0)


def chance(seed):
    return np.random.default_rng(seed)


class Made:
    """A log with sensors added one by one; times in seconds."""

    def __init__(self):
        self.log = bus_writer.Log(bus_writer.Dbc())

    def sensor(self, name, t, **signals):
        us = np.rint(np.asarray(t) * 1e6).astype(np.int64) + 1_000_000
        self.log.add(name, us + 500, Stamp=us & bus_writer.STAMP_MASK, Seq=bus_writer.sequence(len(us)), **signals)

    def imu(self, t, rate, force, temp=np.nan):
        dt = np.diff(t)
        us, seq = np.rint(t[1:] * 1e6).astype(np.int64) + 1_000_000, bus_writer.sequence(len(dt))
        angle, velocity = rate[1:] * dt[:, None], force[1:] * dt[:, None]
        self.log.add("In_Imu0Gyro", us + 300, AngX=angle[:, 0], AngY=angle[:, 1], AngZ=angle[:, 2], Seq=seq)
        self.log.add("In_Imu0Accel", us + 300, VelX=velocity[:, 0], VelY=velocity[:, 1], VelZ=velocity[:, 2], Seq=seq)
        self.log.add("In_Imu0Time", us + 300, Stamp=us & bus_writer.STAMP_MASK, Interval=np.rint(dt * 1e6), Temp=temp, Seq=seq)

    def gnss(self, t, east, north, v_east, v_north, sigma_m, sigma_mps):
        lat, lon, height = from_enu(np.stack([east, north, np.zeros(len(east))]), PLACE)
        self.sensor("In_GnssLat", t, Lat=lat)
        self.sensor("In_GnssLon", t, Lon=lon)
        self.sensor("In_GnssAlt", t, Height=height, Fix=3, NumSv=12)
        self.sensor("In_GnssAcc", t, Hor=sigma_m, Ver=sigma_m)
        self.sensor("In_GnssVelEN", t, East=v_east, North=v_north)
        self.sensor("In_GnssVelU", t, Up=0.0, Acc=sigma_mps)

    def text(self):
        return self.log.text()

    def write(self, directory, name="made.log"):
        path = os.path.join(directory, name)
        with open(path, "wb") as file:
            file.write(self.text())
        return path


def own_epochs(from_us, to_us):
    """Lines of Est_Epoch, 100 a second, of a node that ticks by its own clock."""
    return b"".join(b"(0.5) can0 320#" + int(t).to_bytes(6, "little").hex().upper().encode() + b"0000\n" for t in range(from_us, to_us, 10_000))


def read(made):
    with tempfile.TemporaryDirectory() as directory:
        return recording.Log(made.write(directory), bus_writer.DEFAULT_DBC, 0x300)


def tool(*words, status=None):
    done = subprocess.run((TOOL,) + words, capture_output=True, text=True, timeout=900)
    if status is not None and done.returncode != status:
        raise AssertionError(f"status {done.returncode}, not {status}\n{done.stdout}\n{done.stderr}")
    return done


def held_still(made, random, ups, matrix, bias, gyro_bias, rest_s=4.0, move_s=1.5, rate_hz=100, temp=np.nan, noise=0.02):
    """The sensor laid down with `ups` up, one after the other, turned by hand in between: raw = matrix^-1 true + bias."""
    n_rest, n_move = int(rest_s * rate_hz), int(move_s * rate_hz)
    true, rate = [], []
    for up, after in zip(ups, list(ups[1:]) + [ups[-1]]):
        true.append(np.tile(G * up, (n_rest, 1)))
        rate.append(np.zeros((n_rest, 3)))
        way = np.linspace(0, 1, n_move)[:, None]
        mixed = (1 - way) * up + way * (after if after @ up > -0.9 else np.roll(after, 1) + after)
        true.append(G * mixed / np.linalg.norm(mixed, axis=1, keepdims=True) + random.normal(0, 1.5, (n_move, 3)))
        rate.append(random.normal(0, 1.0, (n_move, 3)))
    true, rate = np.concatenate(true), np.concatenate(rate)
    force = true @ np.linalg.inv(matrix).T + bias + random.normal(0, noise, true.shape)
    t = np.arange(len(true)) / rate_hz
    made.imu(t, rate + gyro_bias + random.normal(0, 1e-3, rate.shape), force, temp if np.isscalar(temp) else temp(t[1:]))
    return made


def accelerometer_truth(random):
    matrix = np.diag(1 + random.normal(0, 0.01, 3))
    matrix[0, 1], matrix[0, 2], matrix[1, 2] = random.normal(0, 0.008, 3)
    return matrix, random.normal(0, 0.15, 3)


def tilted(random, up, degrees):
    return Rotation.from_rotvec(np.radians(random.normal(0, degrees, 3))).apply(up)


class Judged(unittest.TestCase):
    """Normalised errors, judged on both sides."""

    def consistent(self, z, low_factor=1.0, high_factor=1.0, what=""):
        z = np.concatenate([np.ravel(one) for one in z])
        mean_square = (z**2).mean()
        low, high = chi2.ppf([0.0005, 0.9995], len(z)) / len(z)
        self.assertGreater(mean_square, low * low_factor, f"{what}: 1 sigma too large: mean square {mean_square:.2f}, {len(z)} errors")
        self.assertLess(mean_square, high * high_factor, f"{what}: 1 sigma too small: mean square {mean_square:.2f}, {len(z)} errors")

    def refuses(self, words, call):
        with self.assertRaises(Refusal) as caught:
            call()
        for word in words:
            self.assertIn(word, caught.exception.why + " " + caught.exception.record)


class Accelerometer(Judged):
    def fit(self, seed, ups, box=1.0, **how):
        random = chance(seed)
        matrix, bias = accelerometer_truth(random)
        log = read(held_still(Made(), random, [tilted(random, up, 1.0 if box else 0.0) for up in ups], matrix, bias, np.zeros(3), **how))
        return rest.accelerometer(log, rest.find(log), G, 1e-5, box), matrix, bias

    def errors(self, part, matrix, bias):
        z = {}
        for name, truth in (("accelerometer bias", bias), ("accelerometer scale", np.diag(matrix)),
                            ("accelerometer misalignment", matrix[[0, 0, 1], [1, 2, 2]])):
            number = part.number(name)
            z[name] = (number.value - truth) / number.sigma
        return z

    def test_six_faces_give_bias_and_scale_within_their_sigma_over_seeds(self):
        runs = [self.errors(*self.fit(seed, FACES)) for seed in range(12)]
        # The 1 sigma holds the sensor's nonlinearity too (2 mm/s2), which these logs do not have.
        for name in runs[0]:
            self.consistent([run[name] for run in runs], low_factor=0.1, what=name)

    def test_six_faces_are_accurate(self):
        for seed in range(4):
            part, matrix, bias = self.fit(seed, FACES)
            np.testing.assert_allclose(part.number("accelerometer bias").value, bias, atol=0.02)
            np.testing.assert_allclose(part.number("accelerometer scale").value, np.diag(matrix), atol=0.002)

    def test_many_attitudes_give_the_misalignment_without_any_box(self):
        random = chance(5)
        ups = FACES + [v / np.linalg.norm(v) for v in random.normal(size=(14, 3))]
        part, matrix, bias = self.fit(7, ups, box=0.0, rest_s=3.0)
        np.testing.assert_allclose(part.number("accelerometer misalignment").value, matrix[[0, 0, 1], [1, 2, 2]], atol=0.001)
        np.testing.assert_allclose(part.bias, bias, atol=0.005)
        _, before, after, _ = part.residuals[0]
        self.assertLess(after, 0.05 * before)

    def test_a_missing_face_is_named(self):
        for missing, words in ((0, "x up"), (3, "y down"), (5, "z down")):
            ups = [up for k, up in enumerate(FACES) if k != missing]
            self.refuses(["5 rest positions", words, "5 s or more"], lambda: self.fit(1, ups))

    def test_six_positions_in_one_plane_are_not_six_positions(self):
        ups = [np.array([np.cos(a), np.sin(a), 0.0]) for a in np.arange(6) * np.pi / 3]
        self.refuses(["along z", "z up", "z down"], lambda: self.fit(1, ups))

    def test_turning_slowly_by_hand_is_no_rest(self):
        random, made = chance(1), Made()
        t = np.arange(0, 30, 0.01)
        up = np.stack([np.sin(0.3 * t), np.cos(0.3 * t), np.zeros(len(t))], axis=1)
        made.imu(t, np.tile([0, 0, 0.3], (len(t), 1)) + random.normal(0, 1e-3, (len(t), 3)), G * up + random.normal(0, 0.02, up.shape))
        self.assertEqual(rest.find(read(made)), [])


class Gyroscope(Judged):
    SLOPE = np.array([1e-4, -5e-5, 2e-4])

    def warming(self, seed, span_degc, duration_s=120.0):
        random, made = chance(seed), Made()
        bias = random.normal(0, 0.005, 3)
        t = np.arange(0, duration_s, 0.01)
        temp = 25 + span_degc * (1 - np.exp(-3 * t / duration_s)) / (1 - np.exp(-3))
        rate = bias + self.SLOPE * (temp - 25)[:, None] + random.normal(0, 3e-3, (len(t), 3))
        made.imu(t, rate, np.tile([0, 0, G], (len(t), 1)) + random.normal(0, 0.02, (len(t), 3)), temp[1:])
        log = read(made)
        return rest.gyroscope(log, rest.find(log), None), bias

    def test_bias_and_slope_are_within_their_sigma_over_seeds(self):
        slopes, biases = [], []
        for seed in range(12):
            part, bias = self.warming(seed, 20)
            slope, offset, at = (part.number(n) for n in ("gyroscope bias slope", "gyroscope bias", "gyroscope bias holds at"))
            slopes.append((slope.value - self.SLOPE) / slope.sigma)
            biases.append((offset.value - bias - self.SLOPE * (at.value - 25)) / offset.sigma)
            self.assertLess(slope.sigma.max(), 2e-5)
        self.consistent(slopes, low_factor=0.5, high_factor=1.3, what="slope")
        self.consistent(biases, low_factor=0.1, what="bias")  # the Earth's rate is in the sigma, not in these logs

    def test_a_temperature_that_does_not_change_gives_no_slope(self):
        part, _ = self.warming(1, 2)
        self.assertIn("changes by 1.", part.refusals[0][1])
        self.assertEqual([n.name for n in part.numbers], ["gyroscope bias"])

    def test_a_bus_without_temperature_is_told_so(self):
        random = chance(1)
        log = read(held_still(Made(), random, FACES[4:5], np.eye(3), np.zeros(3), np.array([0.01, 0, -0.01]), rest_s=20))
        part = rest.gyroscope(log, rest.find(log), None)
        self.assertIn("not available", part.refusals[0][1])
        np.testing.assert_allclose(part.bias, [0.01, 0, -0.01], atol=2e-4)


class Magnetometer(Judged):
    FIELD = 48.0

    def log(self, seed, directions, noise=0.3, disturbed=0, motor_uT=0.0):
        random, made = chance(seed), Made()
        soft = np.eye(3) + 0.1 * (lambda a: a + a.T)(random.normal(size=(3, 3))) / 2
        soft /= np.linalg.det(soft) ** (1 / 3)
        hard = random.normal(0, 15, 3)
        flux = (self.FIELD * directions) @ np.linalg.inv(soft).T + hard + random.normal(0, noise, directions.shape)
        if disturbed:
            flux[200:200 + disturbed] += [15, -10, 5]
        flux += motor_uT * np.array([0.6, 0.0, 0.8]) * (np.arange(len(flux)) // 250 % 2)[:, None]  # on and off every 5 s
        made.sensor("In_Mag", np.arange(len(flux)) * 0.02, FluxX=flux[:, 0], FluxY=flux[:, 1], FluxZ=flux[:, 2])
        return read(made), hard, soft

    @staticmethod
    def tumbling(seed, count=3000):
        random = chance(100 + seed)
        turns = Rotation.from_rotvec(np.cumsum(random.normal(0, 0.02, (count, 3)), axis=0) * 4)
        return turns.inv().apply([0.4, 0.0, -0.9165])

    def test_hard_and_soft_iron_are_within_their_sigma_over_seeds(self):
        hard_z, soft_z = [], []
        for seed in range(16):
            log, hard, soft = self.log(seed, self.tumbling(seed))
            part = magnetometer.magnetometer(log)
            number, matrix = part.number("hard iron"), part.number("soft iron: m = S (raw - hard)")
            hard_z.append((number.value - hard) / number.sigma)
            soft_z.append((matrix.value - soft.ravel()) / matrix.sigma)
            self.assertLess(np.abs(number.value - hard).max(), 0.6)
            _, before, after, _ = part.residuals[0]
            self.assertLess(after, 0.45)
            self.assertGreater(before, 2.0)
        self.consistent(hard_z, low_factor=0.7, high_factor=1.3, what="hard iron")
        self.consistent([z[[0, 4, 8, 1, 2, 5]] for z in soft_z], low_factor=0.7, high_factor=1.3, what="soft iron")

    def test_a_disturbance_in_passing_does_not_count(self):
        log, hard, _ = self.log(3, self.tumbling(3), disturbed=60)
        np.testing.assert_allclose(magnetometer.magnetometer(log).number("hard iron").value, hard, atol=0.6)

    def test_a_motor_that_runs_half_of_the_time_is_refused_and_a_noisy_sensor_is_not(self):
        for seed in (0, 2, 3):
            for motor_uT in (16, 24):
                self.refuses(["field moves", "motor"], lambda seed=seed, uT=motor_uT: magnetometer.magnetometer(
                    self.log(seed, self.tumbling(seed), motor_uT=uT)[0]))
            log, hard, _ = self.log(seed, self.tumbling(seed), noise=3.0)
            np.testing.assert_allclose(magnetometer.magnetometer(log).number("hard iron").value, hard, atol=3.0)

    def test_turning_on_the_spot_only_is_refused_with_what_to_do(self):
        angle = np.linspace(0, 30, 3000)
        flat = np.stack([0.4 * np.cos(angle), 0.4 * np.sin(angle), np.full(3000, -0.9165)], axis=1)
        tipped = Rotation.from_rotvec(0.1 * np.stack([np.sin(0.9 * angle), np.cos(1.3 * angle), 0 * angle], axis=1)).apply(flat)
        for directions in (flat, tipped):
            self.refuses(["attitudes", "all attitudes"], lambda directions=directions: magnetometer.magnetometer(self.log(1, directions)[0]))

    def test_one_half_of_the_attitudes_is_refused_where_the_rest_would_be_guessed(self):
        random = chance(1)
        directions = random.normal(size=(20000, 3))
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        cap = directions[directions[:, 2] > 0.5][:3000]
        self.refuses(["attitudes", "along z"], lambda: magnetometer.magnetometer(self.log(1, cap)[0]))

    def test_standing_still_is_refused(self):
        self.refuses(["attitudes"], lambda: magnetometer.magnetometer(self.log(1, np.tile([0.4, 0, -0.9], (3000, 1)))[0]))


def drive(seed, rotation, radius=(0.1003, 0.0998), track=0.42, duration_s=240.0, kind="counts", gnss=True, curves=1.0, still_s=12.0, scale=1.0):
    """Made with truth in closed form: a drive with starts, stops and curves; the sensor's axes are `rotation` times the body's."""
    random, made = chance(seed), Made()
    dt = 0.01
    t = np.arange(0, duration_s, dt)
    go = np.clip((t - still_s) / 2, 0, 1) * np.clip((duration_s - 8 - t) / 2, 0, 1)
    v = go * (1.2 + 0.6 * np.sin(0.35 * t) + 0.3 * np.sin(1.1 * t))
    w = curves * go * (0.5 * np.sin(0.13 * t) + 0.25 * np.sin(0.41 * t))
    yaw = 0.7 + np.append(0, np.cumsum(0.5 * (w[1:] + w[:-1]) * dt))
    step = v * np.exp(1j * yaw)
    at = np.append(0, np.cumsum(0.5 * (step[1:] + step[:-1]) * dt))
    a = np.gradient(v, dt)
    body = np.stack([a, v * w, np.full(len(t), G)], axis=1)
    gyro_bias = random.normal(0, 0.002, 3)
    rate = np.stack([0 * t, 0 * t, w], axis=1) @ rotation.T + gyro_bias + random.normal(0, 1e-3, (len(t), 3))
    made.imu(t, rate, body @ rotation.T + random.normal(0, 0.03, body.shape))
    left, right = v - 0.5 * track * w, v + 0.5 * track * w
    if kind == "counts":
        counts = [np.floor(np.append(0, np.cumsum(0.5 * (side[1:] + side[:-1]) * dt)) / (2 * np.pi * r / 2000)).astype(int) + 60000
                  for side, r in zip((left, right), radius)]
        made.sensor("In_WheelCounts", t, Left=counts[0] & 0xFFFF, Right=counts[1] & 0xFFFF)
    elif kind == "body":
        made.sensor("In_BodySpeed", t, Forward=(v + np.append(0, v[:-1])) / 2 / scale, YawRate=(w + np.append(0, w[:-1])) / 2 / scale)
    else:
        made.sensor("In_WheelSpeed", t, Left=(left + np.append(0, left[:-1])) / 2 / scale, Right=(right + np.append(0, right[:-1])) / 2 / scale)
    if gnss:
        rows = np.arange(20, len(t), 20)
        tau = 40.0
        slow = np.zeros((len(rows), 2))
        slow[0] = random.normal(0, 0.6, 2)
        keep = np.exp(-0.2 / tau)
        for k in range(1, len(rows)):
            slow[k] = keep * slow[k - 1] + random.normal(0, 0.6 * np.sqrt(1 - keep**2), 2)
        noise = slow + random.normal(0, 0.3, slow.shape)
        speed = random.normal(0, 0.05, slow.shape)
        made.gnss(t[rows], at[rows].real + noise[:, 0], at[rows].imag + noise[:, 1],
                  step[rows].real + speed[:, 0], step[rows].imag + speed[:, 1], 0.67, 0.05)
    return made


class Mounting(Judged):
    def test_any_mounting_is_found_from_rest_and_from_starts_and_stops(self):
        z = []
        for seed in range(6):
            truth = Rotation.random(random_state=seed).as_matrix()  # body axes to sensor axes
            log = read(drive(seed, truth, duration_s=90, gnss=False))
            part = mounting.mounting(log, rest.find(log), None, 0.5)
            number = part.number("mounting_bs, body axis by sensor axis:")
            found = number.value.reshape(3, 3)
            np.testing.assert_allclose(found @ found.T, np.eye(3), atol=1e-9)
            error = Rotation.from_matrix(found @ truth).as_rotvec()
            self.assertLess(np.degrees(np.abs(error)).max(), 0.6)
            angles = part.number("sensor in the body:")
            z.append(np.degrees(error[2]) / angles.sigma[2])
            np.testing.assert_allclose(part.number("up in sensor axes").value, truth[:, 2], atol=0.005)
        self.consistent([np.array(z)], low_factor=0.1, high_factor=1.5, what="yaw of the mounting")

    def test_swapped_axes_turn_the_numbers_with_them(self):
        turned = np.array([[0, -1, 0], [0, 0, 1], [-1, 0, 0]], float)
        plain, other = (mounting.mounting(log, rest.find(log), None, 0.5).number("mounting_bs, body axis by sensor axis:")
                        .value.reshape(3, 3) for log in (read(drive(1, r, duration_s=90, gnss=False)) for r in (np.eye(3), turned)))
        np.testing.assert_allclose(other, plain @ turned.T, atol=0.01)

    def test_of_several_attitudes_at_rest_the_one_in_which_it_drives_counts(self):
        """Six positions on the bench, longer than any stand of the drive, and then the drive: one log."""
        random, truth = chance(3), Rotation.from_euler("xyz", [170, 20, 75], degrees=True).as_matrix()
        bench = read(held_still(Made(), random, FACES, np.eye(3), np.zeros(3), np.zeros(3), rest_s=20))
        both = read(drive(3, truth, duration_s=90, gnss=False))
        both.imu.t, both.wheels.t = both.imu.t + 200, both.wheels.t + 200
        both.imu = recording.Samples(**{name: np.concatenate([getattr(bench.imu, name), getattr(both.imu, name)]) for name in bench.imu.columns})
        part = mounting.mounting(both, rest.find(both), None, 0.5)
        np.testing.assert_allclose(part.number("up in sensor axes").value, truth[:, 2], atol=0.005)
        self.refuses(["6 attitudes", "--span"], lambda: mounting.mounting(bench, rest.find(bench), None, 0.5))

    def test_without_acceleration_only_up_is_given(self):
        random, made = chance(1), Made()
        t = np.arange(0, 60, 0.01)
        made.imu(t, random.normal(0, 1e-3, (len(t), 3)), np.tile([0, 0, G], (len(t), 1)) + random.normal(0, 0.02, (len(t), 3)))
        made.sensor("In_WheelCounts", t, Left=7, Right=9)
        log = read(made)
        part = mounting.mounting(log, rest.find(log), None, 0.5)
        self.assertEqual([n.name for n in part.numbers], ["up in sensor axes"])
        self.assertIn("accelerates", part.refusals[0][1])


class Wheels(Judged):
    def fit(self, seed, **how):
        log = read(drive(seed, np.eye(3), **how))
        robot = Robot()
        robot.given = {"wheels.drive.counts_per_turn": 2000, "wheels.drive.left_radius_m": 0.1, "wheels.drive.track_m": 0.4}
        return wheels.wheels(log, np.array([0, 0, 1.0]), robot)

    def test_radius_difference_and_track_are_within_their_sigma_over_seeds(self):
        truth = {"left wheel radius": 0.1003, "right wheel radius": 0.0998, "track width": 0.42}
        z = {name: [] for name in truth}
        for seed in range(5 if WHOLE else 2):
            part = self.fit(seed)
            for name, true in truth.items():
                number = part.number(name)
                z[name].append((number.value - true) / number.sigma)
                self.assertLess(abs(number.value[0] / true - 1), 0.006)
                self.assertLess(number.sigma[0] / true, 0.006)
        for name, values in z.items():
            self.consistent(values, low_factor=0.05, high_factor=1.2, what=name)  # gyroscope's scale, slip: in the sigma, not in these logs

    def test_body_speed_gives_the_two_scales(self):
        part = self.fit(1, kind="body", scale=1.05)
        for name in ("true speed over stated speed", "true yaw rate over stated yaw rate"):
            number = part.number(name)
            self.assertLess(abs(number.value[0] - 1.05), 3 * number.sigma[0])
            self.assertLess(number.sigma[0], 0.02)

    def test_wheel_speeds_give_a_track(self):
        number = self.fit(1, kind="speeds").number("track width")
        self.assertLess(abs(number.value[0] - 0.42), 3 * number.sigma[0])

    def test_a_frozen_receiver_and_a_clipped_imu_do_not_shift_the_numbers(self):
        """Faults of the log that a fit would swallow: fixes that repeat for 20 s, and a gyroscope that saturates for a second and a half."""
        log = read(drive(2, np.eye(3)))
        for samples in (log.gnss, log.velocity):
            rows = (samples.t > 100) & (samples.t < 120)
            for name in samples.columns[1:]:
                getattr(samples, name)[rows] = getattr(samples, name)[rows][0]
        shaken = (log.imu.t > 150) & (log.imu.t < 151.5)
        log.imu.angle[shaken] += 0.004
        log.imu.clipped[shaken] = True
        robot = Robot()
        robot.given = {"wheels.drive.counts_per_turn": 2000}
        part = wheels.wheels(log, np.array([0, 0, 1.0]), robot)
        for name, true in (("left wheel radius", 0.1003), ("right wheel radius", 0.0998), ("track width", 0.42)):
            number = part.number(name)
            self.assertLess(abs(number.value[0] - true), 3 * number.sigma[0], name)
            self.assertLess(number.sigma[0] / true, 0.01, name)
        self.assertRegex(" ".join(part.notes), "1(49|50) IMU samples with a clipped axis")

    def test_a_straight_line_gives_a_radius_but_no_track(self):
        part = self.fit(1, curves=0.01)
        self.assertIn("track", [what for what, _, _ in part.refusals])
        self.assertNotIn("track width", [n.name for n in part.numbers])
        self.assertLess(abs(part.number("left wheel radius").value[0] / 0.1003 - 1), 0.01)

    def test_a_few_metres_are_refused(self):
        self.refuses(["too little", "ten minutes"], lambda: self.fit(1, duration_s=34.0))

    def test_swapped_wheels_are_named(self):
        made = drive(1, np.diag([1.0, -1.0, -1.0]))
        self.refuses(["swapped"], lambda: wheels.wheels(read(made), np.array([0, 0, 1.0]), Robot()))


class World(Judged):
    """Its wheels are unequal by 0.5 %, its track is 1 % wider than the drawing, its tyres slip: sim_host/world/numbers.hpp."""

    TRUTH = {"left wheel radius": 0.10025, "right wheel radius": 0.09975, "wheel difference (left - right)/mean": 0.005, "track width": 0.505}
    MOST_SIGMA = {"left wheel radius": 0.0005, "right wheel radius": 0.0005, "wheel difference (left - right)/mean": 0.0016, "track width": 0.010}

    def test_unequal_wheels_and_the_wide_track_are_found_within_three_sigma(self):
        kept = 0
        with tempfile.TemporaryDirectory() as directory:
            for seed in (1, 2, 3, 4) if WHOLE else (1, 2):
                out = os.path.join(directory, str(seed))
                subprocess.run([WORLD, "--memory", "--raw", "--quiet", "--seed", str(seed), "--out", out], check=True, capture_output=True,
                               timeout=900)
                done = tool(os.path.join(out, "raw.log"), "--robot", "rover", "--parts", "wheels", "--out", os.path.join(out, "c"), status=0)
                # Each radius alone may be within two sigma of the drawing's; their difference is not.
                offered = re.search(r"\.left_radius_m = ([\d.]+)F,\n +\.right_radius_m = ([\d.]+)F,", done.stdout)
                self.assertTrue(offered, done.stdout)
                left, right = float(offered[1]), float(offered[2])
                # Their mean is that of the drawing: where it is found so, within two sigma, it is not moved by its own error.
                if "stays in the lines below" in done.stdout:
                    self.assertAlmostEqual((left + right) / 2, 0.1, delta=2e-6)
                    kept += 1
                with open(os.path.join(out, "c.json"), encoding="utf-8") as file:
                    numbers = {n["name"]: n for n in json.load(file)["parts"]["wheels"]["numbers"]}
                difference = numbers["wheel difference (left - right)/mean"]
                self.assertAlmostEqual(2 * (left - right) / (left + right), difference["value"][0], delta=1e-4)  # five digits
                track = numbers.get("track width")
                if track and "stays in the lines below" in done.stdout:  # radii and track as the gyroscope ties them
                    found = sum(numbers[f"{side} wheel radius"]["value"][0] for side in ("left", "right")) / 2
                    self.assertAlmostEqual(track["offered"][0] / 0.1, track["value"][0] / found, delta=1e-3)
                for name, truth in self.TRUTH.items():
                    value, sigma = numbers[name]["value"][0], numbers[name]["sigma"][0]
                    self.assertLess(abs(value - truth), 3 * sigma, f"seed {seed}: {name} {value} +- {sigma}")
                    self.assertLess(sigma, self.MOST_SIGMA[name], f"seed {seed}: {name}: 1 sigma says nothing")
                    self.assertGreater(sigma, 0.05 * self.MOST_SIGMA[name], f"seed {seed}: {name}: 1 sigma too good to be true")
                self.assertTrue(os.path.getsize(os.path.join(out, "c.png")) > 20_000)
        self.assertGreater(kept, 2 if WHOLE else 0, "the mean was right, and was moved")


class Camera(Judged):
    """The world's camera stands some degrees off what the robot says. A matched world has no other error of the mounting."""

    TURNS_DEG = ((3.0, -2.0, 4.0), (-4.0, 3.0, -2.5))
    STATED = np.array([[0, 0, 1.0], [-1, 0, 0], [0, -1, 0]])

    @classmethod
    def setUpClass(cls):
        cls.directory = cls.enterClassContext(tempfile.TemporaryDirectory())

    def drive(self, seed, *words):
        """(log, true mounting) of two laps of 60 m."""
        out = os.path.join(self.directory, str(seed) + "".join(words))
        true = Rotation.from_euler("xyz", self.TURNS_DEG[seed - 1], degrees=True).as_matrix() @ self.STATED
        subprocess.run([WORLD, "--memory", "--robot", "visual", "--course", "loop", "--raw", "--quiet", "--matched", "--built", "--seed", str(seed),
                        "--set", "camera.mounting_bc=" + " ".join(map(str, true.ravel())), "--out", out, *words],
                       check=True, capture_output=True, timeout=900)
        return os.path.join(out, "raw.log"), true

    def found(self, path, status, *words):
        return tool(path, "--robot", "visual", "--parts", "camera", "--out", path + ".c", *words, status=status)

    def test_a_mounting_is_found_to_3_mrad_with_an_honest_sigma(self):
        normalised = []
        for seed in (1, 2):
            path, true = self.drive(seed)
            self.found(path, 0)
            with open(path + ".c.json", encoding="utf-8") as file:
                numbers = {n["field"]: n for n in json.load(file)["parts"]["camera"]["numbers"]}
            rotation = np.reshape(numbers["camera.mounting_bc"]["value"], (3, 3))
            error = Rotation.from_matrix(rotation @ true.T).as_rotvec()
            self.assertLess(np.abs(error).max(), 0.003, error)
            normalised.append(error / np.radians(numbers[None]["sigma"]))
        self.consistent(normalised, low_factor=0.5, high_factor=1.5, what="mounting of the camera")

    def test_what_shows_no_mounting_is_refused(self):
        path, _ = self.drive(1, "--fault", "images_mirrored@0+300")
        self.assertIn("tetap-doctor", self.found(path, 1).stdout)
        path, _ = self.drive(1, "--duration", "12")
        self.assertIn("Record: three minutes of driving", self.found(path, 1).stdout)
        self.assertIn("no camera", tool(path, "--robot", "rover", "--parts", "camera", "--out", path + ".c", status=1).stdout)

    def test_an_image_without_one_of_its_features_is_left_out(self):
        with tempfile.TemporaryDirectory() as directory:
            log = bus_writer.Log(bus_writer.Dbc())
            for k in range(10):
                stamp = 1_000_000 + 100_000 * k
                common = {"Stamp": stamp & bus_writer.STAMP_MASK, "Seq": k & 15, "Inst": 0}
                log.add("In_Feature", np.full(2 if k == 4 else 3, stamp), **common, TrackId=np.arange(3)[:2 if k == 4 else 3], U=100.0, V=50.0)
                log.add("In_Image", stamp, **common, Count=3, Exposure=np.nan, TrackerState=1)
            path = os.path.join(directory, "a.log")
            with open(path, "wb") as file:
                file.write(log.text())
            read_back = recording.Log(path, bus_writer.DEFAULT_DBC, 0x300)
        self.assertEqual((len(read_back.images), read_back.dropped), (9, {"images of which a feature is missing": 1}))
        self.assertEqual(read_back.images.pixel[0].tolist(), [[100.0, 50.0]] * 3)


class Program(unittest.TestCase):
    def setUp(self):
        self.directory = tempfile.TemporaryDirectory()
        self.addCleanup(self.directory.cleanup)
        self.at = self.directory.name

    def file(self, text):
        path = os.path.join(self.at, "a.log")
        with open(path, "wb") as file:
            file.write(text)
        return path

    def one_line(self, words, *arguments):
        done = tool(*arguments)
        self.assertEqual(done.returncode, 1, done.stdout)
        self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
        for word in words:
            self.assertIn(word, done.stderr)

    def test_everything_at_once_with_table_snippet_picture_and_json(self):
        random = chance(2)
        matrix, bias = accelerometer_truth(random)
        path = held_still(Made(), random, FACES, matrix, bias, np.array([0.003, 0, 0])).write(self.at)
        done = tool(path, "--out", os.path.join(self.at, "c"), status=0)
        self.assertIn("accelerometer bias x", done.stdout)
        self.assertIn("For config/ROBOT.hpp", done.stdout)
        self.assertIn("magnetometer: not given: The log has no magnetometer", done.stdout)
        self.assertNotIn("nan", done.stdout.lower())
        with open(os.path.join(self.at, "c.json"), encoding="utf-8") as file:
            result = json.load(file)
        self.assertEqual(set(result["parts"]) | set(result["refused"]), {"accel", "gyro", "mag", "mounting", "wheels"})
        with open(os.path.join(self.at, "c.png"), "rb") as file:
            self.assertEqual(file.read(8), b"\x89PNG\r\n\x1a\n")

    def test_the_snippet_compiles_into_a_robots_numbers(self):
        path = drive(1, np.eye(3), duration_s=120).write(self.at)
        done = tool(path, "--counts-per-turn", "2000", "--out", os.path.join(self.at, "c"), status=0)
        snippet = done.stdout.split("hpp:\n")[1].split("\nwritten")[0]
        self.compiles(snippet, "numbers.wheels.drive.track_m > 0.4F && numbers.inertial.mounting_bs[8] > 0.99F")

    def compiles(self, snippet, assertion):
        source = os.path.join(self.at, "robot.cpp")
        with open(source, "w", encoding="utf-8") as file:
            # The noise of the wheels is the robot's own: no part of the calibration gives it.
            file.write('#include "tetap/param/limits.hpp"\nconstexpr tetap::param::Parameters numbers = tetap::param::checked([] {\n'
                       "tetap::param::Parameters p{\n" + snippet + "\n};\np.wheels.wheel_speed_noise = 0.05F;\nreturn p;\n}());\n"
                       f"static_assert({assertion});\n")
        subprocess.run(["g++", "-std=c++20", "-fsyntax-only", "-Wall", "-Werror", "-I", os.path.join(ROOT, "src"), "-I", ROOT,
                        "-isystem", "/usr/include/eigen3", source], check=True)

    def test_every_number_that_a_part_gives_is_one_that_the_firmware_has(self):
        random = chance(2)
        matrix, bias = accelerometer_truth(random)
        log = read(held_still(Made(), random, FACES, matrix, bias, np.array([0.003, 0, 0])))
        magnetic, hard, _ = Magnetometer("tumbling").log(1, Magnetometer.tumbling(1))
        warm = Gyroscope("warming").warming(1, 20)[0]
        parts = [magnetometer.magnetometer(magnetic), warm, rest.accelerometer(log, rest.find(log), G, 1e-3, 1.0)]
        for kind in ("wheel speeds", "counts"):
            driven = read(drive(1, np.eye(3), duration_s=120, kind=kind))
            parts.append(wheels.wheels(driven, np.array([0.0, 0.0, 1.0]), robot_numbers.Robot("rover"), None))
        self.compiles(robot_numbers.snippet(parts),
                      f"numbers.magnetic.hard_iron_uT[0] * {hard[0]:.3f}F > 0 && numbers.magnetic.norm_uT > 40 && numbers.imu.accel_matrix[0] > 0.9F"
                      " && numbers.imu.gyro_bias_slope_radps_per_degC[2] > 1e-4F && numbers.wheels.left_speed_scale > 0.9F")

    def test_what_a_robot_has_within_two_sigma_is_not_advised(self):
        robot = robot_numbers.Robot("rover")
        part = robot_numbers.Part("mounting", "mounting")
        track = robot.number("wheels.drive.track_m")
        part.add("up", [0.018, 0, 0.99984], [0.01, 0.01, 0.001], "1", "gyro.up_s", tuple("xyz"))
        part.add("track", track + 0.019, 0.01, "m", "wheels.drive.track_m")
        part.add("bias", [0, 0, 0.021], [0.01, 0.01, 0.01], "rad/s", "imu.gyro_bias_radps", tuple("xyz"))
        self.assertEqual([robot.has(number) for number in part.numbers], [True, True, False])
        part.add("right", robot.number("wheels.drive.right_radius_m") + 1e-4, 1e-4, "m", "wheels.drive.right_radius_m", off=True)
        self.assertFalse(robot.has(part.number("right")), "alone it is, together with the left one it is not")
        text = robot_numbers.snippet([part], robot)
        self.assertIn("right_radius_m = 0.1001F", text)
        self.assertIn("gyro_bias_radps = {0.0F, 0.0F, 0.021F}", text)
        self.assertNotIn("up_s", text)
        self.assertNotIn("track", text)
        self.assertIn("track", robot_numbers.snippet([part], robot_numbers.Robot()), "nobody knows what that robot has")

    def test_a_robot_has_what_its_header_takes_from_another_and_the_defaults(self):
        robot = robot_numbers.Robot("husky_inertial")
        self.assertEqual(robot.now("gyro.up_s").tolist(), [0, 1, 0])
        self.assertEqual(robot.now("imu.accel_matrix").tolist(), np.eye(3).ravel().tolist())
        self.assertEqual(robot.number("wheels.drive.counts_per_turn"), 78000)
        self.assertIsNone(robot_numbers.Robot("labyrinth").number("wheels.drive.counts_per_turn"), "a default is no value of the robot's")
        self.assertIsNone(robot_numbers.Robot().now("gyro.up_s"))

    def test_the_settings_are_a_file_of_parameters(self):
        part = robot_numbers.Part("wheels", "wheels")
        part.add("bias", [0.1, -0.2, 0.3], [0.01] * 3, "m/s2", "imu.accel_bias_mps2", tuple("xyz"))
        part.add("left", 0.0825, 1e-4, "m", "wheels.drive.left_radius_m")
        part.add("right", 0.0826, 1e-4, "m", "wheels.drive.right_radius_m")
        part.add("track", 0.42, 1e-3, "m", "wheels.drive.track_m")
        path = os.path.join(self.at, "found.params")
        with open(path, "w", encoding="utf-8") as file:
            file.write(robot_numbers.settings([part]) + "\n")
        done = subprocess.run([parameter_table.program(), "--robot", "rover", "--params", path, "--json"], check=True, capture_output=True, text=True)
        values = {row["path"]: row["value"] for row in json.loads(done.stdout)["parameters"]}
        self.assertEqual([values[f"wheels.drive.{name}"] for name in ("left_radius_m", "right_radius_m", "track_m")], [0.0825, 0.0826, 0.42])
        self.assertEqual(values["imu.accel_bias_mps2"], [0.1, -0.2, 0.3])

    def test_a_number_that_the_firmware_does_not_have_is_an_error(self):
        part = robot_numbers.Part("gyro", "gyroscope")
        part.add("bias", 1.0, 0.1, "rad/s", "gyro.no_such_number")
        with self.assertRaisesRegex(LookupError, "gyro.no_such_number"):
            robot_numbers.snippet([part])

    def test_a_part_asked_for_and_refused_is_a_failure(self):
        path = held_still(Made(), chance(1), FACES[:3], np.eye(3), np.zeros(3), np.zeros(3)).write(self.at)
        done = tool(path, "--parts", "accel", "--out", os.path.join(self.at, "c"), status=1)
        self.assertIn("3 rest positions found, six are needed; missing: y down, z up, z down", done.stdout)

    def test_a_span_chooses_the_positions(self):
        path = held_still(Made(), chance(1), FACES, np.eye(3), np.zeros(3), np.zeros(3)).write(self.at)
        done = tool(path, "--parts", "accel", "--span", "accel:0,10", "--out", os.path.join(self.at, "c"), status=1)
        self.assertIn("2 rest positions", done.stdout)

    def test_bad_input_is_one_line_with_the_place(self):
        good = drive(1, np.eye(3), duration_s=20).text()
        lines = good.split(b"\n")
        self.one_line(["a.log: No such file"], os.path.join(self.at, "a.log"))
        self.one_line(["the log is empty"], self.file(b""))
        self.one_line(["a.log:3: no candump line"], self.file(b"\n".join(lines[:2] + [b"hello"] + lines[2:])))
        self.one_line(["a.log:2:", "bytes"], self.file(lines[0] + b"\n" + lines[0][:-4] + b"\n"))
        self.one_line(["base 0x300", "--base", "7A1"], self.file(b"(1.000000) can0 7A1#0011\n"))
        self.one_line(["no sensor's samples"], self.file(b"(1.000000) can0 300#40420F0000000003\n"))
        self.one_line(["no robot 'nobody'", "rover rover_landmarks"], self.file(good), "--robot", "nobody")
        self.one_line(["--span begins at 500"], self.file(good), "--span", "500,600")
        self.one_line(["cannot write"], self.file(good), "--out", os.path.join(self.at, "no", "c"))
        back = b"(1.000000) can0 300#40420F0000000000\n(1.010000) can0 300#C0E1E40000000000\n(1.020000) can0 300#40420F0000000000\n"
        self.one_line(["a.log:3:", "goes back", "two runs"], self.file(back + good))

    def test_stamps_are_placed_by_the_nodes_time_whatever_the_speed_of_the_recording(self):
        made = drive(3, np.eye(3), duration_s=60)
        made.log.add("In_Sync", np.arange(1_000_000, 61_000_000, 10_000), Time=np.arange(1_000_000, 61_000_000, 10_000), Kind=1)
        text = made.text()
        # Five seconds without a sensor: only the node's time says how often the stamps wrapped meanwhile.
        text = b"\n".join(line for line in text.split(b"\n") if b" 300#" in line or not 21 < float(line[1:18] or 0) < 26) + b"\n"
        slow = recording.Log(self.file(text), bus_writer.DEFAULT_DBC, 0x300)
        lines = [b"(%.6f)" % (1000 + float(line[1:18]) / 500) + line[19:] for line in text.strip().split(b"\n")]
        fast = recording.Log(self.file(b"\n".join(lines) + b"\n"), bus_writer.DEFAULT_DBC, 0x300)
        for name in ("imu", "wheels", "gnss", "velocity"):
            np.testing.assert_array_equal(getattr(slow, name).t, getattr(fast, name).t)
        self.assertAlmostEqual(fast.duration_s, 60.0, delta=0.05)

    def test_what_the_node_said_by_its_own_clock_before_the_run_began_does_not_place_samples(self):
        """A recording on a bus begins with a node that ticks by itself; its clock is not the run's."""
        times = np.arange(1_010_000, 41_000_000, 10_000)
        made = drive(3, np.eye(3), duration_s=40)
        made.log.add("In_Sync", times, Time=times, Kind=1)
        run = made.text()
        alone = recording.Log(self.file(run), bus_writer.DEFAULT_DBC, 0x300)
        begin = b"(0.999000) can0 300#40420F0000000003\n"

        for idle_us in (1_500_000, 2_600_000, 60_000_000):
            log = recording.Log(self.file(own_epochs(idle_us - 500_000, idle_us) + begin + own_epochs(idle_us, idle_us + 10_000) + run), bus_writer.DEFAULT_DBC, 0x300)
            for name in ("imu", "wheels", "gnss", "velocity"):
                np.testing.assert_array_equal(getattr(log, name).t, getattr(alone, name).t)
        self.one_line(["begins anew here", "two runs in one log"], self.file(run + begin + run))
        self.one_line(["node's time goes back from 1.490 s to 0.000 s"], self.file(own_epochs(1_000_000, 1_500_000) + own_epochs(0, 100_000) + run.replace(b" 300#", b" 7A0#")))

    def test_epochs_before_the_first_step_are_left_out_and_named(self):
        times = np.arange(1_010_000, 41_000_000, 10_000)
        made = drive(3, np.eye(3), duration_s=40)
        made.log.add("In_Sync", times, Time=times, Kind=1)
        steps = made.text()
        alone = recording.Log(self.file(steps), bus_writer.DEFAULT_DBC, 0x300)

        early = b"(0.5) can0 308#0000000000000000\n(0.5) can0 308#0000000000000000\n"  # samples of an unknown clock
        for from_us in (0, 3_700_000, 60_000_000):
            path = self.file(own_epochs(from_us, from_us + 300_000) + early + own_epochs(from_us + 300_000, from_us + 500_000) + steps)
            log = recording.Log(path, bus_writer.DEFAULT_DBC, 0x300)
            for name in ("imu", "wheels", "gnss", "velocity"):
                np.testing.assert_array_equal(getattr(log, name).t, getattr(alone, name).t)
            self.assertEqual(log.dropped["frames of sensors before the first In_Sync"], 2)
            self.assertRegex(log.notes[0], r"a\.log:\d+: the first In_Sync gives 1\.010 s; left out: 50 epochs before it by the node's own clock")
        # Epochs that agree with In_Sync are the node's time, too.
        log = recording.Log(self.file(own_epochs(1_000_000, 1_010_000) + steps), bus_writer.DEFAULT_DBC, 0x300)
        self.assertEqual((log.notes, log.dropped), ([], {}))

    def test_a_last_line_without_newline_is_taken_whole_or_named(self):
        good = drive(1, np.eye(3), duration_s=20).text()
        whole = recording.Log(self.file(good), bus_writer.DEFAULT_DBC, 0x300)
        taken = recording.Log(self.file(good[:-1]), bus_writer.DEFAULT_DBC, 0x300)
        self.assertEqual((taken.notes, taken.duration_s, len(taken.wheels)), ([], whole.duration_s, len(whole.wheels)))
        lines = good.count(b"\n")
        for cut in (2, 3, 10, 20, 40):
            log = recording.Log(self.file(good[:-cut]), bus_writer.DEFAULT_DBC, 0x300)
            self.assertEqual(len(log.notes), 1)
            self.assertIn(f"a.log:{lines}: the last line is cut off and left out: ", log.notes[0])

    def test_no_log_makes_it_fall_over_or_print_a_nan(self):
        """Bytes of a good log changed at random: a result, a refusal or one line; nothing else."""
        good = bytearray(drive(1, np.eye(3), duration_s=40).text())
        random = chance(11)
        hexes = b"0123456789ABCDEF"
        for _ in range(5):
            bad = bytearray(good)
            starts = [k for k in random.integers(0, len(bad) // 43, 400) * 43]
            for start in starts:  # digits of the data
                bad[start + 30 + int(random.integers(0, 12))] = hexes[int(random.integers(0, 16))]
            done = tool(self.file(bytes(bad)), "--robot", "rover", "--out", os.path.join(self.at, "c"))
            self.assertIn(done.returncode, (0, 1))
            self.assertNotIn("Traceback", done.stderr)
            self.assertNotIn("Warning", done.stderr)
            self.assertLessEqual(done.stderr.count("\n"), 1)
            self.assertNotIn("nan", done.stdout.lower())


if __name__ == "__main__":
    unittest.main()
