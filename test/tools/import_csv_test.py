#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""tetap-import: tables as a log, read back by the bits that config/tetap.dbc has and compared with numpy's reading of the tables.

Factors of units are SciPy's, quaternions too. Recorded sets (EuRoC, Husky) where $TETAP_DATA is."""
import csv
import io
import lzma
import os
import re
import subprocess
import sys
import tempfile
import unittest

import numpy as np
import scipy.constants
from scipy.spatial.transform import Rotation

sys.dont_write_bytecode = True
ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))
sys.path.insert(0, os.path.join(ROOT, "tools", "python"))
from tetap.can import bus_writer  # noqa: E402

PROGRAM = os.path.join(ROOT, "build", "host", "sim_host", "tetap-import")
DATA = os.environ.get("TETAP_DATA", os.path.join(ROOT, os.pardir, "shared", "data"))
DBC = bus_writer.default_dbc()
FRAME = re.compile(r"\((\d+)\.(\d{6})\) vcan0 ([0-9A-F]{3})#([0-9A-F]{16})$")
START_US = 1_000_000


class Log:
    """Messages of a log: arrays of time [us] and of each signal; NaN where it is not available."""

    def __init__(self, text):
        self.lines, rows, latest = text.splitlines(), {}, 0
        for line in self.lines:
            found = FRAME.match(line)
            assert found, line
            time = int(found[1]) * 1_000_000 + int(found[2])
            assert time >= latest, line
            latest = time
            rows.setdefault(int(found[3], 16), []).append((time, int.from_bytes(bytes.fromhex(found[4]), "little")))
        names = {message.identifier: message for message in DBC.messages.values()}
        self.messages = {names[i].name: self.decoded(names[i], found) for i, found in rows.items()}

    @staticmethod
    def decoded(message, rows):
        time, word = (np.array(part, dtype=np.uint64) for part in zip(*rows))
        values = {"time_us": time.astype(np.int64)}
        for name, signal in message.signals.items():
            raw = (word >> np.uint64(signal.start)) & np.uint64((1 << signal.length) - 1)
            raw = raw.astype(np.int64)
            if signal.signed:
                raw = np.where(raw >> (signal.length - 1) & 1, raw - (1 << signal.length), raw)
            values[name] = np.where(raw == signal.not_available, np.nan, raw * signal.scale) if signal.not_available is not None else raw * signal.scale
        if "Stamp" in values:
            assert np.array_equal(values["Stamp"].astype(np.int64), values["time_us"] & 0xFFFFF)
        assert np.array_equal(values["Seq"].astype(np.int64), np.arange(len(time)) & 15), message.name
        return values

    def __getitem__(self, name):
        return self.messages[name]


class Case(unittest.TestCase):
    def run_on(self, files, *options):
        """(result, the log where there is one); `files`: name -> text."""
        with tempfile.TemporaryDirectory() as folder:
            paths = []
            for name, text in files.items():
                paths.append(os.path.join(folder, name))
                with open(paths[-1], "w", encoding="utf-8", newline="") as file:
                    file.write(text)
            out = os.path.join(folder, "out.log")
            done = subprocess.run([PROGRAM, *paths, "--out", out, *options], capture_output=True, text=True, timeout=120)
            done.stderr = done.stderr.replace(folder + "/", "")
            done.stdout = done.stdout.replace(folder + "/", "")
            if not os.path.exists(out):
                return done, None
            with open(out, encoding="ascii") as file:
                return done, Log(file.read())

    def imported(self, files, *options):
        done, log = self.run_on(files, *options)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        return log

    def near(self, message, name, found, expected, slack=0.0):
        """Half a step of the signal, and a float's rounding. `slack`: of a value that `expected` is not."""
        step = DBC.messages[message].signals[name].scale
        found, expected = np.asarray(found), np.asarray(expected)
        self.assertEqual(found.shape, expected.shape, (message, name))
        off = np.abs(found - expected) - (0.5001 * step + 2e-7 * np.abs(expected) + slack)
        self.assertTrue(np.all((off <= 0) | (np.isnan(found) & np.isnan(expected))), (message, name, np.nanmax(off)))

    def imu(self, log, time_us, rate, force):
        """IMU samples of rates and forces at the gyroscope's times, from the second row on."""
        interval = np.diff(time_us)
        self.assertTrue(np.array_equal(log["In_Imu0Time"]["Interval"].astype(np.int64), interval))
        self.assertTrue(np.array_equal(np.diff(log["In_Imu0Time"]["time_us"]), np.diff(time_us[1:])))
        for i, axis in enumerate("XYZ"):
            self.near("In_Imu0Gyro", "Ang" + axis, log["In_Imu0Gyro"]["Ang" + axis], rate[1:, i] * interval * 1e-6)
            self.near("In_Imu0Accel", "Vel" + axis, log["In_Imu0Accel"]["Vel" + axis], force[1:, i] * interval * 1e-6)

    def east_north(self, log, speed, course_deg):
        self.near("In_GnssVelEN", "East", log["In_GnssVelEN"]["East"], speed * np.sin(np.radians(course_deg)))
        self.near("In_GnssVelEN", "North", log["In_GnssVelEN"]["North"], speed * np.cos(np.radians(course_deg)))


def table(header, columns, form="%.9f", separator=",", point="."):
    rows = [[form % value if isinstance(value, float) else str(value) for value in row] for row in zip(*[np.asarray(c).tolist() for c in columns])]
    return "\n".join([separator.join(header)] + [separator.join(cell.replace(".", point) for cell in row) for row in rows]) + "\n"


def phone(seed=1, seconds=20):
    """A drive as a telephone records it: each sensor at times of its own."""
    chance = np.random.default_rng(seed)
    def times(rate, first, longer=0):
        count = int((seconds + longer) * rate)
        return np.round(first + np.arange(count) / rate + chance.uniform(-0.1, 0.1, count) / rate, 9)
    gyro_s, accel_s, mag_s, fix_s = times(100, 0.012), times(104, 0.003, 0.1), times(50, 0.02), times(1, 0.7)
    return {"gyro": (gyro_s, chance.normal(0, 0.3, (len(gyro_s), 3))), "accel": (accel_s, chance.normal([0, 0, 9.81], 1, (len(accel_s), 3))),
            "mag": (mag_s, chance.normal(0, 30, (len(mag_s), 3))),
            "fix": (fix_s, 48 + 1e-5 * np.arange(len(fix_s)) + 1e-9, 11 - 2e-5 * np.arange(len(fix_s)), chance.normal(500, 1, len(fix_s)),
                    chance.uniform(0, 30, len(fix_s)), chance.uniform(0, 360, len(fix_s)), chance.uniform(1, 9, len(fix_s)), chance.uniform(2, 20, len(fix_s)))}


def micros(seconds):
    return np.floor(np.asarray(seconds) * 1e6 + 0.5).astype(np.int64)


def phyphox(drive, separator=",", point="."):
    def quoted(*names):
        return ['"%s"' % name for name in names]
    def xyz(text, unit):
        return quoted("Time (s)", *["%s %s (%s)" % (text, axis, unit) for axis in "xyz"])
    def file(header, *columns):
        return table(header, columns, separator=separator, point=point)
    fix = drive["fix"]
    return {"Accelerometer.csv": file(xyz("Acceleration", "m/s^2"), drive["accel"][0], *drive["accel"][1].T),
            "Gyroscope.csv": file(xyz("Gyroscope", "rad/s"), drive["gyro"][0], *drive["gyro"][1].T),
            "Linear Acceleration.csv": file(xyz("Linear Acceleration", "m/s^2"), drive["accel"][0], *drive["accel"][1].T),
            "Magnetometer.csv": file(xyz("Magnetic field", "µT"), drive["mag"][0], *drive["mag"][1].T),
            "Location.csv": file(quoted("Time (s)", "Latitude (°)", "Longitude (°)", "Height (m)", "Velocity (m/s)", "Direction (°)", "Horizontal Accuracy (m)",
                                        "Vertical Accuracy (°)"), *fix)}


class Phones(Case):
    def check(self, log, drive, total=None):
        gyro_s, rate = drive["gyro"]
        accel_s, force = drive["accel"] if total is None else total
        gyro_us, accel_us = micros(gyro_s), micros(accel_s)
        at = np.stack([np.interp(gyro_us, accel_us, force[:, i]) for i in range(3)], axis=1)
        self.imu(log, gyro_us, rate, at)
        begin = min(series[0][0] for series in drive.values())
        for i, axis in enumerate("XYZ"):
            self.near("In_Mag", "Flux" + axis, log["In_Mag"]["Flux" + axis], drive["mag"][1][:, i])
        fix_s, lat, lon, height, speed, course, hor, ver = drive["fix"]
        self.assertTrue(np.array_equal(log["In_GnssLat"]["time_us"], micros(fix_s) - micros(begin) + START_US))
        self.near("In_GnssLat", "Lat", log["In_GnssLat"]["Lat"], lat)
        self.near("In_GnssLon", "Lon", log["In_GnssLon"]["Lon"], lon)
        self.near("In_GnssAlt", "Height", log["In_GnssAlt"]["Height"], height)
        self.near("In_GnssAcc", "Hor", log["In_GnssAcc"]["Hor"], hor)
        self.near("In_GnssAcc", "Ver", log["In_GnssAcc"]["Ver"], ver)
        self.east_north(log, speed, course)

    def test_a_recording_of_phyphox_in_five_files(self):
        drive = phone()
        log = self.imported(phyphox(drive))
        self.check(log, drive)

    def test_phyphox_exports_of_every_separator_are_one_log(self):
        drive = phone(2, 3)
        logs = [self.imported(phyphox(drive, *form)).lines for form in ((",", "."), (";", ","), (";", "."), ("\t", "."), ("\t", ","))]
        windows = self.imported({name: "\ufeff" + text.replace("\n", "\r\n") for name, text in phyphox(drive).items()}).lines
        for log in logs[1:] + [windows]:
            self.assertEqual(log, logs[0])

    def sensor_logger(self, drive, gravity):
        """Files in the order of columns of that application: z, y, x, time in nanoseconds since 1970."""
        def file(time_s, *columns, names):
            ns = ["%d" % (1_700_000_000_000_000_000 + int(micros(t)) * 1000) for t in time_s]
            return table(["time", "seconds_elapsed", *names], [ns, time_s, *columns])
        zyx = lambda values: values[:, ::-1].T  # noqa: E731
        fix_s, lat, lon, height, speed, course, hor, ver = drive["fix"]
        accel_s, force = drive["accel"]
        files = {"Gyroscope.csv": file(drive["gyro"][0], *zyx(drive["gyro"][1]), names="zyx"),
                 "Magnetometer.csv": file(drive["mag"][0], *zyx(drive["mag"][1]), names="zyx"),
                 "Accelerometer.csv": file(accel_s, *zyx(force - gravity), names="zyx"),
                 "Gravity.csv": file(accel_s, *zyx(np.broadcast_to(gravity, force.shape)), names="zyx"),
                 "Location.csv": file(fix_s, course * 0 + 5, speed * 0 + 0.5, ver, hor, speed, course, height, lon, lat,
                                      names=["bearingAccuracy", "speedAccuracy", "verticalAccuracy", "horizontalAccuracy", "speed", "bearing", "altitude", "longitude", "latitude"]),
                 "Barometer.csv": file(fix_s, fix_s * 0, 950 + fix_s, names=["relativeAltitude", "pressure"]),
                 "Orientation.csv": file(fix_s, *[fix_s * 0 + 0.5] * 4, *[fix_s] * 3, names=["qz", "qy", "qx", "qw", "roll", "pitch", "yaw"]),
                 "Metadata.csv": "version,device name,recording time\n3,a phone,2026-11-28_10-00-00\n"}
        return files

    def test_a_recording_of_sensor_logger(self):
        drive, gravity = phone(3), np.array([0.5, -0.2, 9.78])
        files = self.sensor_logger(drive, gravity)
        log = self.imported(files)
        self.check(log, drive)
        self.assertTrue(np.allclose(log["In_GnssVelU"]["Acc"], 0.5, atol=5e-4))
        self.near("In_Baro", "Pressure", log["In_Baro"]["Pressure"], (950 + drive["fix"][0]) * 100)
        self.assertNotIn("In_Heading", log.messages)
        # With its total acceleration the two parts are not needed.
        total = dict(files, **{"TotalAcceleration.csv": files["Accelerometer.csv"].replace("Accelerometer", "Total")})
        log = self.imported(total)
        self.check(log, drive, (drive["accel"][0], drive["accel"][1] - gravity))

    def test_acceleration_without_gravity_is_no_specific_force(self):
        files = self.sensor_logger(phone(4, 2), np.zeros(3))
        del files["Gravity.csv"]
        done, log = self.run_on(files)
        self.assertEqual(done.returncode, 0)
        self.assertNotIn("In_Imu0Gyro", log.messages)
        self.assertIn("Accelerometer.csv: x, y, z: without gravity this is no specific force, left out", done.stdout.replace(" [m/s2 assumed]", ""))

    def test_what_a_telephone_does_not_know_is_left_out(self):
        header = "time,seconds_elapsed,speedAccuracy,horizontalAccuracy,speed,bearing,altitude,longitude,latitude\n"
        rows = ["1,1,1,0,500,11,48", "-1,5,-1,-1,500,11,48", "1,-1,1,0,500,11,48", "1,5,1,0,500,0,0", "1,5,1,-1,500,11,48"]
        text = header + "".join("%d,%d.0,%s\n" % ((1_700_000_000 + i) * 10**9, i, row) for i, row in enumerate(rows))
        log = self.imported({"Location.csv": text.replace("1,1,1,0,500", "1,5,1,0,500")})
        self.assertTrue(np.array_equal(log["In_GnssLat"]["time_us"], START_US + np.array([0, 1, 4]) * 10**6))
        self.assertTrue(np.array_equal(log["In_GnssVelEN"]["time_us"], START_US + np.array([0, 2, 3]) * 10**6))


class Recorded(Case):
    @unittest.skipUnless(os.path.exists(os.path.join(DATA, "euroc_v1_01", "imu0.csv.xz")), "no recorded data")
    def test_euroc_is_what_numpy_reads(self):
        with lzma.open(os.path.join(DATA, "euroc_v1_01", "imu0.csv.xz"), "rt") as file:
            text = file.read()
        rows = [line.split(",") for line in text.splitlines() if not line.startswith("#")]
        values = np.array([row[1:7] for row in rows], dtype=float)
        time_us = np.array([(int(row[0]) + 500) // 1000 for row in rows])
        self.assertGreater(len(rows), 20_000)
        self.imu(self.imported({"imu0.csv": text}), time_us, values[:, :3], values[:, 3:])

    @unittest.skipUnless(os.path.exists(os.path.join(DATA, "husky", "test1_imu_data.csv")), "no recorded data")
    def test_husky_is_what_numpy_reads(self):
        files = {}
        for name in ("test1_imu_data.csv", "test1_fix.csv"):
            with open(os.path.join(DATA, "husky", name), encoding="utf-8") as file:
                files[name] = file.read()
        def column(name, *keys):
            rows = list(csv.DictReader(io.StringIO(files[name].partition("\n")[2])))
            return np.array([[float(row[key]) for key in keys] for row in rows]), np.array([micros_of(row["t_stamp"]) for row in rows])
        def micros_of(text):
            whole, fraction = text.split(".")
            return int(whole) * 10**6 + (int((fraction + "0" * 7)[:7]) + 5) // 10
        log = self.imported(files)
        fixes, time_us = column("test1_fix.csv", "lat_deg", "lon_deg", "alt_m")
        imu, imu_us = column("test1_imu_data.csv", "wx", "wy", "wz", "ax", "ay", "az")
        begin = min(time_us[0], imu_us[0])
        self.assertTrue(np.array_equal(log["In_GnssLat"]["time_us"], time_us - begin + START_US))
        self.near("In_GnssLat", "Lat", log["In_GnssLat"]["Lat"], fixes[:, 0])
        self.near("In_GnssLon", "Lon", log["In_GnssLon"]["Lon"], fixes[:, 1])
        self.assertGreater(len(log["In_Imu0Gyro"]["AngX"]), 0.99 * len(imu))
        self.assertTrue(np.isin(log["In_Imu0Time"]["time_us"], imu_us - begin + START_US).all())


class Units(Case):
    def one(self, header, *values, options=()):
        """The log of rows at 100 Hz."""
        rows = "".join("%.2f,%s\n" % (1 + i / 100, ",".join(row)) for i, row in enumerate(values))
        return self.imported({"table.csv": "time_s,%s\n%s" % (header, rows)}, *options)

    def test_factors_are_those_of_scipy(self):
        c = scipy.constants
        for unit, factor in (("m/s^2", 1), ("m s^-2", 1), ("m/s²", 1), ("g", c.g), ("mg", 1e-3 * c.g), ("-g", -c.g)):
            header = "gyro_x,gyro_y,gyro_z," + ",".join("accel_%s [%s]" % (axis, unit) for axis in "xyz")
            log = self.one(header, *[["0.1"] * 3 + ["0.25", "-0.5", "1"]] * 5)
            self.near("In_Imu0Accel", "VelX", log["In_Imu0Accel"]["VelX"], np.full(4, 0.25 * factor * 0.01))
            self.near("In_Imu0Accel", "VelZ", log["In_Imu0Accel"]["VelZ"], np.full(4, factor * 0.01))
        for unit, factor in (("rad/s", 1), ("rad s^-1", 1), ("deg/s", c.degree), ("°/s", c.degree), ("dps", c.degree), ("rpm", 2 * c.pi / c.minute)):
            header = ",".join("gyro_%s (%s)" % (axis, unit) for axis in "xyz") + ",ax,ay,az"
            log = self.one(header, *[["3", "-2", "1"] + ["0"] * 3] * 5)
            self.near("In_Imu0Gyro", "AngX", log["In_Imu0Gyro"]["AngX"], np.full(4, 3 * factor * 0.01))
        for unit, factor in (("m/s", 1), ("km/h", c.kmh), ("knots", c.knot), ("kn", c.knot), ("mph", c.mph), ("ft/s", c.foot)):
            log = self.one("lat,lon,speed (%s),course" % unit, *[["48", "11", "20", "90"]] * 3)
            self.near("In_GnssVelEN", "East", log["In_GnssVelEN"]["East"], np.full(3, 20 * factor))
        for unit, factor in (("Pa", 1), ("hPa", c.hecto), ("mbar", c.bar / 1000), ("kPa", c.kilo), ("bar", c.bar)):
            log = self.one("pressure (%s)" % unit, *[[repr(98765 / factor)]] * 3)
            self.near("In_Baro", "Pressure", log["In_Baro"]["Pressure"], np.full(3, 98765.0))
        for unit, factor in (("uT", 1), ("µT", 1), ("nT", 1e-3), ("gauss", 100), ("mG", 0.1)):
            log = self.one("mag_x (%s),mag_y (%s),mag_z (%s)" % (unit, unit, unit), *[[repr(20 / factor), "0", "0"]] * 3)
            self.near("In_Mag", "FluxX", log["In_Mag"]["FluxX"], np.full(3, 20.0))

    def test_units_behind_the_name_and_named_by_the_user(self):
        named = self.one("gx,gy,gz,ax,ay,az", *[["3", "-2", "1", "0", "0", "1"]] * 5, options=("--unit", "gyro=deg/s", "--unit", "accel=g"))
        behind = self.one("gyro_x_dps,gyro_y_deg_s,gyroZ_dps,acc_x_g,accY_g,accel_z_g", *[["3", "-2", "1", "0", "0", "1"]] * 5)
        self.assertEqual(named.lines, behind.lines)
        self.near("In_Imu0Gyro", "AngY", named["In_Imu0Gyro"]["AngY"], np.full(4, np.radians(-2) * 0.01))

    def test_places_in_every_unit(self):
        for lat, lon, unit in (("48.5", "-11.25", "deg"), ("485000000", "-112500000", "e7"), (repr(np.radians(48.5)), repr(np.radians(-11.25)), "rad"),
                               ("4830.0", "-1115.0", "ddmm.mmmm")):
            log = self.one("latitude,longitude", *[[lat, lon]] * 2, options=("--unit", "gnss=" + unit))
            self.near("In_GnssLat", "Lat", log["In_GnssLat"]["Lat"], np.full(2, 48.5))
            self.near("In_GnssLon", "Lon", log["In_GnssLon"]["Lon"], np.full(2, -11.25))

    def test_times_in_every_unit(self):
        begins = {"time_s": "12.5 12.501 12.5035", "time_ms": "12500 12501 12503.5", "t_us": "12500000 12501000 12503500", "timestamp_ns": "12500000000 12501000000 12503500000",
                  "time (s)": "12.5 12.501 12.5035", "timestamp [ns]": "12500000000 12501000000 12503500000", "time": "1700000000.5 1700000000.501 1700000000.5035",
                  "timestamp": "1700000000500 1700000000501 1700000000503.5", "unix_time": "1700000000500000 1700000000501000 1700000000503500",
                  "t": "1700000000500000123 1700000000501000123 1700000000503500123",
                  "datetime": "2026-11-28T23:59:59.999Z 2026-11-29T00:00:00.000Z 2026-11-29T00:00:00.0025Z", "date": "2024-02-28T23:59:59.999+01:00 2024-02-28T23:00:00+00:00 2024-02-28T22:00:00.0025-01:00"}
        for name, times in begins.items():
            text = name + ",pressure (Pa)\n" + "".join("%s,%d\n" % (time, 100_000 + i) for i, time in enumerate(times.split()))
            log = self.imported({"baro.csv": text})
            self.assertEqual((log["In_Baro"]["time_us"] - START_US).tolist(), [0, 1000, 3500], name)

    def test_quaternions_either_way(self):
        chance = np.random.default_rng(5)
        turns = Rotation.from_quat(chance.normal(size=(50, 4)))
        body_x = turns.apply([1, 0, 0])
        flat = np.hypot(body_x[:, 0], body_x[:, 1]) > 0.2
        turns, body_x = turns[flat], body_x[flat]
        yaw = np.arctan2(body_x[:, 1], body_x[:, 0])
        swap = Rotation.from_matrix([[0, 1, 0], [1, 0, 0], [0, 0, -1]])  # east north up to north east down
        down = Rotation.from_matrix(np.diag([1, -1, -1]))
        forms = {"enu": turns, "enu-inverse": turns.inv(), "ned": swap * turns * down, "ned-inverse": (swap * turns * down).inv()}
        for form, rotations in forms.items():
            for names in (["qw", "qx", "qy", "qz"], ["qx", "qy", "qz", "qw"]):
                x, y, z, w = rotations.as_quat().T
                values = {"qw": w, "qx": x, "qy": y, "qz": z}
                columns = [name for q in names for name in ("--column", "heading.%s=%s" % (q, q))]
                log = self.imported({"q.csv": table(["time_s", *names], [np.arange(len(w)) / 50.0, *[values[q] for q in names]])}, *columns, "--unit", "quaternion=" + form)
                self.near("In_Heading", "Angle", np.angle(np.exp(1j * (log["In_Heading"]["Angle"] - yaw))), np.zeros(len(yaw)), slack=1e-6)
        log = self.imported({"q.csv": "time_s,c\n0.0,0\n0.1,90\n0.2,200\n"}, "--column", "heading.compass=c", "--unit", "heading.compass=deg")
        self.near("In_Heading", "Angle", log["In_Heading"]["Angle"], np.radians([90, 0, -110]))


class Tables(Case):
    def test_a_value_beyond_its_signal_is_left_out_and_counted(self):
        text = "time_s,mag_x,mag_y,mag_z\n0.0,1,2,3\n0.1,204.8,2,3\n0.2,1,2,-1e9\n0.3,204.7,2,-204.7\n0.4,inf,1,1\n0.5,,1,1\n0.6,nan,1,1\n0.7,7,8,9\n"
        done, log = self.run_on({"m.csv": text})
        self.assertTrue(np.allclose(log["In_Mag"]["FluxX"], [1, 204.7, 7]))
        self.assertIn("left out: 3 mag rows beyond the range of their signals", done.stdout)
        self.assertIn("left out: 2 mag rows without its values", done.stdout)
        text = "time_s,lat,lon,alt,hacc\n0.0,48,11,500,1\n1.0,48,11,16778,1\n2.0,48,11,500,327.7\n3.0,91,11,500,1\n4.0,48,11,500,2\n"
        log = self.imported({"g.csv": text})
        self.assertTrue(np.allclose(log["In_GnssAcc"]["Hor"], [1, 2]))
        text = "time_s,gx,gy,gz,ax,ay,az\n" + "".join("%.3f,%g,0,0,0,0,9.81\n" % (i / 20, 10.6 if i == 3 else 10.4) for i in range(6))
        log = self.imported({"i.csv": text})
        self.assertEqual(log["In_Imu0Time"]["time_us"].tolist(), [START_US + 50_000 * i for i in (1, 2, 4, 5)])
        self.assertTrue(np.allclose(log["In_Imu0Gyro"]["AngX"], 0.52))

    def test_a_table_of_many_sensors_with_empty_and_repeated_cells(self):
        rows = ["time_s,gyro_x,gyro_y,gyro_z,acc_x,acc_y,acc_z,lat,lon,speed_kmh,course,pressure_hPa"]
        for i in range(100):
            fix = ["%.7f" % (48 + i // 20 * 1e-5), "11", "36", "0"]
            rows.append(",".join(["%.2f" % (i / 100), "0.1", "0", "0", "0", "0", "9.8", *fix, "950.5" if i % 10 == 0 else ""]))
        done, log = self.run_on({"all.csv": "\n".join(rows) + "\n"})
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertEqual(log["In_GnssLat"]["time_us"].tolist(), [START_US + 200_000 * i for i in range(5)])
        self.assertEqual(len(log["In_Baro"]["Pressure"]), 10)
        self.assertEqual(len(log["In_Imu0Gyro"]["AngX"]), 99)
        self.assertIn("left out: 95 gnss rows that repeat the row before", done.stdout)

    def test_wheels_counts_body_and_sightings(self):
        log = self.imported({"w.csv": "time_s,left_ticks,right_ticks\n0.0,65535,-1\n0.1,65537,70000\n"})
        self.assertEqual((log["In_WheelCounts"]["Left"].tolist(), log["In_WheelCounts"]["Right"].tolist()), ([65535, 1], [65535, 4464]))
        log = self.imported({"w.csv": "time_s,left_speed_kmh,right_speed_kmh\n0.0,36,-36\n"})
        self.assertTrue(np.allclose([log["In_WheelSpeed"]["Left"][0], log["In_WheelSpeed"]["Right"][0]], [10, -10]))
        log = self.imported({"w.csv": "time_s,speed,yaw_rate_deg_s\n0.0,2.5,90\n"})
        self.assertTrue(np.allclose([log["In_BodySpeed"]["Forward"][0], log["In_BodySpeed"]["YawRate"][0]], [2.5, np.pi / 2], atol=3e-5))
        log = self.imported({"w.csv": "time_s,landmark,range_m,bearing_deg\n0.0,7,12.5,-90\n0.1,,200,0\n"})
        self.assertTrue(np.allclose([log["In_RangeBearing"][k][0] for k in ("Id", "Range", "Bearing")], [7, 12.5, -np.pi / 2], atol=3e-4))
        self.assertEqual(len(log["In_RangeBearing"]["Id"]), 1)

    def test_headers_of_other_loggers(self):
        imu = ["0.1", "-0.2", "0.3", "1", "2", "9.8"]
        expected = self.imported({"a.csv": "time_s,gx,gy,gz,ax,ay,az\n" + "".join("%.2f,%s\n" % (i / 100, ",".join(imu)) for i in range(4))}).lines
        ros = "%time,field.header.seq,field.header.stamp,field.orientation.w,field.angular_velocity.x,field.angular_velocity.y,field.angular_velocity.z," \
              "field.linear_acceleration.x,field.linear_acceleration.y,field.linear_acceleration.z,field.linear_acceleration_covariance0"
        juggler = "__time,/imu/data/angular_velocity/x,/imu/data/angular_velocity/y,/imu/data/angular_velocity/z,/imu/linear_acceleration/x,/imu/linear_acceleration/y,/imu/linear_acceleration/z"
        andro = "ACCELEROMETER X (m/s²);ACCELEROMETER Y (m/s²);ACCELEROMETER Z (m/s²);LINEAR ACCELERATION X (m/s²);GYROSCOPE X (rad/s);GYROSCOPE Y (rad/s);GYROSCOPE Z (rad/s);" \
                "LOCATION Speed ( Kmh);Time since start in ms ;YYYY-MO-DD HH-MI-SS_SSS"
        stamp = [1_700_000_000_000_000_000 + 10_000_000 * i for i in range(4)]
        logs = [ros + "\n" + "".join("%d,%d,%d,1,%s,0.01\n" % (t + 12345678, i, t, ",".join(imu)) for i, t in enumerate(stamp)),
                juggler + "\n" + "".join("%d.%06d,%s\n" % (t // 10**9, t % 10**9 // 1000, ",".join(imu)) for t in stamp),
                andro + "\n" + "".join(";".join(imu[3:] + ["77"] + imu[:3] + ["0", "%d" % (10 * i), "2026-11-28 10:00:00:%03d" % i]) + "\n" for i in range(4))]
        for text in logs:
            log = self.imported({"b.csv": text})
            self.assertEqual([line for line in log.lines if "vcan0 308#" not in line], expected, text[:60])

    def test_exports_of_px4_ardupilot_and_ros(self):
        """Headers as ulog2csv, mavlogdump and rosbag's tools write them; every value once, by hand."""
        imu = "timestamp,gyro_rad[0],gyro_rad[1],gyro_rad[2],gyro_integral_dt,accelerometer_m_s2[0],accelerometer_m_s2[1],accelerometer_m_s2[2]\n"
        gps = "timestamp,time_utc_usec,lat,lon,alt,alt_ellipsoid,s_variance_m_s,eph,epv,vel_m_s,vel_n_m_s,vel_e_m_s,vel_d_m_s,cog_rad,satellites_used\n"
        mag = "timestamp,device_id,magnetometer_ga[0],magnetometer_ga[1],magnetometer_ga[2]\n"
        log = self.imported({"a_imu.csv": imu + "".join("%d,0.1,-0.2,0.3,4000,1,2,-9.8\n" % (10**7 + 5000 * i) for i in range(3)),
                             "a_gps.csv": gps + "10000000,0,-473977420,85455940,488123,535120,0.5,0.9,1.4,5,3,4,-0.5,0.9,17\n",
                             "a_mag.csv": mag + "10000000,1,0.21,-0.01,0.43\n"}, "--unit", "time=us")
        self.near("In_Imu0Gyro", "AngZ", log["In_Imu0Gyro"]["AngZ"], np.full(2, 0.3 * 0.005))
        self.near("In_Imu0Accel", "VelY", log["In_Imu0Accel"]["VelY"], np.full(2, 2 * 0.005))
        for message, name, value in (("In_GnssLat", "Lat", -47.397742), ("In_GnssLon", "Lon", 8.545594), ("In_GnssAlt", "Height", 535.12),
                                     ("In_GnssVelEN", "East", 4), ("In_GnssVelEN", "North", 3), ("In_GnssVelU", "Up", 0.5), ("In_GnssVelU", "Acc", 0.5),
                                     ("In_GnssAcc", "Hor", 0.9), ("In_Mag", "FluxX", 21), ("In_Mag", "FluxY", -1)):
            self.near(message, name, log[message][name], [value])
        # Two IMUs in one table: the rows of one.
        two = "timestamp,TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ\n" + "".join("%.4f,1,%d,%d,0,0,0,0,9\n" % (i / 50 + k / 1000, k, k) for i in range(4) for k in (0, 1))
        done, log = self.run_on({"IMU.csv": two})
        self.assertEqual((log["In_Imu0Gyro"]["AngX"].tolist(), log["In_Imu0Time"]["Interval"].tolist()), ([0] * 3, [20_000] * 3))
        self.assertIn("left out: 4 rows of IMU.csv of another device than I 0", done.stdout)
        # A stamp in two whole numbers.
        for names in ("header.stamp.sec,header.stamp.nanosec", "header.stamp.secs,header.stamp.nsecs"):
            text = names + ",angular_velocity.x,angular_velocity.y,angular_velocity.z,linear_acceleration.x,linear_acceleration.y,linear_acceleration.z\n"
            stamps = ((1_700_000_000, 980_000_000), (1_700_000_000, 990_000_000), (1_700_000_001, 0))
            log = self.imported({"imu.csv": text + "".join("%d,%d,1,0,0,0,0,9\n" % stamp for stamp in stamps)})
            self.assertEqual(log["In_Imu0Time"]["time_us"].tolist(), [START_US + 10_000, START_US + 20_000])
        log = self.imported({"o.csv": "Time,twist.twist.linear.x,twist.twist.linear.y,twist.twist.angular.z\n0.5,1.5,9,0.25\n"})
        self.assertTrue(np.allclose([log["In_BodySpeed"]["Forward"][0], log["In_BodySpeed"]["YawRate"][0]], [1.5, 0.25], atol=3e-5))

    def test_a_column_i_is_a_device_by_its_values(self):
        """Two receivers of like stamps and of stamps between; a row's number, a current, one that switches, and a state that changes twice are none."""
        def rows(values, times=None):
            times = 0.02 * np.arange(len(values)) if times is None else times
            return "time,i,v\n" + "".join("%.3f,%s,%.2f\n" % (time, value, k / 100) for k, (time, value) in enumerate(zip(times, values)))
        chance = np.random.default_rng(5)
        slower = np.arange(80).repeat([2, 1, 1, 1] * 20) / 50 + np.tile([0, 0.01, 0, 0, 0], 20)
        for name, text, taken, devices in (("like stamps", rows([0, 1] * 40, np.repeat(np.arange(40) / 50, 2)), 40, True),
                                           ("stamps between", rows([0, 1, 2] * 30, np.arange(90) / 200), 30, True), ("a slower one", rows([0, 1, 0, 0, 0] * 20, slower), 80, True),
                                           ("row numbers", rows(range(80)), 80, False), ("a current", rows(["0.5", "1.25"] * 40), 80, False),
                                           ("a whole current", rows(chance.integers(0, 3, 200)), 200, False), ("a state", rows([0] * 30 + [1] * 30 + [0] * 30), 90, False),
                                           ("two rows of a second value", rows([0] * 30 + [1] * 2), 32, False)):
            done, log = self.run_on({"wheels.csv": text}, "--column", "body.forward=v")
            self.assertEqual((done.returncode, done.stderr, len(log["In_BodySpeed"]["Forward"])), (0, "", taken), name)
            self.assertEqual("of another device than i 0" in done.stdout, devices, name)

    def test_shapes_of_other_phones_and_tables(self):
        imu = "gx,gy,gz,ax,ay,az\n" + "".join("%.2f,1,0,0,0,0,9.8\n" % (i / 100) for i in range(3))
        expected = self.imported({"a.csv": "time_s," + imu}).lines
        for text in ("sep=;\n" + ("time_s," + imu).replace(",", ";"), ("time_s," + imu).replace(",", "   ")):
            self.assertEqual(self.imported({"b.csv": text}).lines, expected)
        # Physics Toolbox: ax is without gravity, gFx the specific force. SensorLog: a time in words.
        toolbox = "time,gFx,gFy,gFz,ax,ay,az,wx,wy,wz,Bx,By,Bz\n" + "".join("%.2f,0,0,1,7,7,7,1,0,0,20,1,43\n" % (i / 100) for i in range(3))
        words = "loggingTime(txt),accelerometerAccelerationX(G),accelerometerAccelerationY(G),accelerometerAccelerationZ(G),motionRotationRateX(rad/s)," \
                "motionRotationRateY(rad/s),motionRotationRateZ(rad/s)\n" + "".join("2026-11-28 10:00:00.%02d0 +0100,0,0,1,1,0,0\n" % i for i in range(3))
        for text in (toolbox, words):
            log = self.imported({"p.csv": text})
            self.near("In_Imu0Accel", "VelZ", log["In_Imu0Accel"]["VelZ"], np.full(2, 0.0980665))
            self.near("In_Imu0Accel", "VelX", log["In_Imu0Accel"]["VelX"], np.zeros(2))
        # Letters of a place, behind it or in a column of their own; an elevation.
        for text, *options in (("time,lat,lon,elevation\n0.5,48.5S,11.25 W,500\n",), ("time,lat,ns,lon,ew,elevation\n0.5,4830.0,S,1115.0,W,500\n", "--unit", "gnss=nmea"),
                               ("time,lat,ns,lon,ew,elevation\n0.5,-48.5,S,-11.25,W,500\n",)):
            log = self.imported({"g.csv": text}, *options)
            self.near("In_GnssLat", "Lat", log["In_GnssLat"]["Lat"], [-48.5])
            self.near("In_GnssLon", "Lon", log["In_GnssLon"]["Lon"], [-11.25])
            self.near("In_GnssAlt", "Height", log["In_GnssAlt"]["Height"], [500])
        log = self.imported({"m.csv": "time_s,magnetic_field.x,magnetic_field.y,magnetic_field.z\n0.5,2.1e-5,0,-4e-5\n"})  # tesla, as ROS has it
        self.near("In_Mag", "FluxX", log["In_Mag"]["FluxX"], [21])
        for text, reason in ((("time_s," + imu).replace("\n", "\r"), "carriage return alone"), ("time_s,lat,lon\n0.5,48N,S\n", "'S' is no number"),
                             ("stamp.sec,stamp.nanosec,pressure\n1700000000,1e10,1000\n", "is no part of a second")):
            done, log = self.run_on({"b.csv": text})
            self.assertEqual((done.returncode, log, done.stderr.count("\n")), (2, None, 1), done.stderr)
            self.assertIn(reason, done.stderr)

    def test_a_pause_and_rows_out_of_order(self):
        times = [0, 0.01, 0.03, 0.02, 0.04, 5.0, 5.01]
        text = "time_s,gx,gy,gz,ax,ay,az\n" + "".join("%.2f,%g,0,0,0,0,9.8\n" % (t, t) for t in times)
        done, log = self.run_on({"i.csv": text})
        self.assertEqual(log["In_Imu0Time"]["Interval"].tolist(), [10_000] * 6)
        self.near("In_Imu0Gyro", "AngX", log["In_Imu0Gyro"]["AngX"], np.sort(times)[1:] * 0.01)
        self.assertIn("1 rows were out of order", done.stdout)
        self.assertIn("1 IMU samples after a pause", done.stdout)

    def test_columns_that_only_the_user_knows(self):
        text = "1.0 ignored;a;b;c;d\n".replace("1.0 ignored", "when") + "0,0;1;2;3;4\n0,1;1,5;2;3;4\n"
        log = self.imported({"own.csv": text}, "--column", "time=when", "--column", "mag.x=a", "--column", "mag.y=own.csv:b", "--column", "mag.z=d", "--unit", "time=s")
        self.assertTrue(np.allclose(log["In_Mag"]["FluxX"], [1, 1.5]) and np.allclose(log["In_Mag"]["FluxZ"], 4))
        log = self.imported({"bare.csv": "0.0,1,2,3\n0.1,4,5,6\n"}, "--column", "time=1", "--column", "mag.x=2", "--column", "mag.y=3", "--column", "mag.z=4")
        self.assertTrue(np.allclose(log["In_Mag"]["FluxY"], [2, 5]))

    def test_bad_input_is_refused_in_one_line_with_its_place(self):
        head, options = "time_s,gx,gy,gz,ax,ay,az\n0.00,0,0,0,0,0,9.8\n", []
        cases = [({"a.csv": head + "0.01,0,0,abc,0,0,9.8\n"}, r"a\.csv:3: column 4 'gz': 'abc' is no number"),
                 ({"a.csv": head + "0.01,0,0,0,0,9.8\n0,0\n"}, r"a\.csv:3: 6 columns, the table has 7"),
                 ({"a.csv": head + "noon,0,0,0,0,0,9.8\n" * 2}, r"a\.csv:3: column 1 'time_s': 'noon' is no time"),
                 ({"a.csv": head + "0.5,0,0,0,0,0,9\n0.1,0,0,0,0,0,9\n"}, r"a\.csv:4: column 1 'time_s': '0\.1' goes back"),
                 ({"a.csv": head + "5000,0,0,0,0,0,9\n"}, r"a\.csv:3: column 1 'time_s': '5000' is more than an hour later"),
                 ({"a.csv": "t,pressure\n1,1000\n2,1000\n"}, r"a\.csv:1: column 1 't': whole numbers whose unit is not stated.*--unit time=ms"),
                 ({"a.csv": "speed,lat,lon\n1,48,11\n"}, r"a\.csv:1: no column of time"),
                 ({"a.csv": "time_s,height_of_tree\n1.0,2\n"}, r"a\.csv:1: no column of a known name: time_s, height_of_tree; .*--column"),
                 ({"a.csv": "time_s,gyro_x (furlong),gyro_y,gyro_z\n1.0,2,2,2\n"}, r"a\.csv:1: column 2 'gyro_x \(furlong\)': no unit 'furlong' of gyro\.x.*rad/s deg/s"),
                 ({"a.csv": ""}, r"a\.csv: no row in it"), ({"a.csv": head.split("\n")[0] + "\n"}, r"a\.csv: no row in it"),
                 ({"a.csv": "time_s,gx,gy,gz,ax,ay,az\n" + "".join("%d.0,0,0,0,0,0,9.8\n" % i for i in range(5))}, r"a row every 1000 ms; an IMU sample spans 65\.5 ms"),
                 ({"a.csv": "time_s,pressure\n1.0,1000\n", "b.csv": "time,lat,lon\n1700000000000,48,11\n"}, r"b\.csv counts time from 1970 and a\.csv does not"),
                 ({"a.csv": "time_s,mag_x,mag_y,mag_z\n1.0,999,0,0\n"}, r"a\.csv: no sample for the bus in it; 1 mag rows beyond")]
        for files, reason in cases:
            done, log = self.run_on(files)
            self.assertEqual((done.returncode, log, done.stderr.count("\n")), (2, None, 1), (files, done.stderr))
            self.assertRegex(done.stderr, "^tetap-import: .*" + reason)
        for options, reason in ((["--column", "accel.w=ax"], "no such quantity; there are: time gyro.x"), (["--column", "accel.x=nothing"], "no column 'nothing' for accel.x; there are: time_s, gx"),
                                (["--unit", "gyro=furlong"], "no such unit; there are: rad/s deg/s"), (["--unit", "giro=deg/s"], "no such quantity"),
                                (["--unit", "quaternion=xyz"], "there are: enu enu-inverse ned ned-inverse"), (["--column", "accel.x"], "needs QUANTITY=TEXT"), (["--tabel", "x"], "one argument too many|unknown option --tabel")):
            done, log = self.run_on({"a.csv": head + "0.01,0,0,0,0,0,9.8\n"}, *options)
            self.assertEqual((done.returncode, log, done.stderr.count("\n")), (2, None, 1), (options, done.stderr))
            self.assertRegex(done.stderr, reason)

    def test_a_last_line_that_is_cut_off_is_named(self):
        done, log = self.run_on({"a.csv": "time_s,pressure\n1.0,1000\n2.0"})
        self.assertEqual(len(log["In_Baro"]["Pressure"]), 1)
        self.assertIn("a.csv: the last line is cut off and left out", done.stdout)


if __name__ == "__main__":
    unittest.main()
