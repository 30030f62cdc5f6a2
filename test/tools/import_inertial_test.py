#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The importers of inertial sets: round trip against the sets themselves (found through $TETAP_DATA, skipped without), laws of what they share,
and bad input made here."""
import csv
import json
import os
import shutil
import subprocess
import sys
import tempfile
import unittest

import numpy as np
import scipy.io

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
TOOLS = os.path.join(ROOT, "tools")
sys.path.insert(0, os.path.join(TOOLS, "python"))
sys.dont_write_bytecode = True

from tetap.can import bus_writer  # noqa: E402
from tetap.dataset import inertial  # noqa: E402

DATA = os.environ.get("TETAP_DATA") or os.path.join(ROOT, "..", "shared", "data")
START_US = 1_000_000
DBC = bus_writer.Dbc()


def needs(*parts):
    path = os.path.join(DATA, *parts)
    return path, unittest.skipUnless(os.path.exists(path), f"data set {'/'.join(parts)} is not under {DATA}")


SKOG, with_skog = needs("skog_gnss_ins")
PX4, with_px4 = needs("px4_ecl")
HUSKY, with_husky = needs("husky")


def run(tool, *arguments):
    return subprocess.run([os.path.join(TOOLS, "dataset", tool), *map(str, arguments)], capture_output=True, text=True, timeout=120)


def text_of(path):
    with open(path) as file:
        return file.read()


class Log:
    """A candump log by message: arrival times [us] and values; the signals are taken from the frames bit by bit, by the DBC alone."""

    def __init__(self, path):
        with open(path) as file:
            lines = file.read().split("\n")[:-1]
        self.time_us = np.array([int(line[1:11]) * 1_000_000 + int(line[12:18]) for line in lines], dtype=np.int64)
        self.identifier = np.array([int(line[26:29], 16) for line in lines])
        self.payload = np.array([int.from_bytes(bytes.fromhex(line[30:46]), "little") for line in lines], dtype=np.uint64)

    def of(self, name):
        message = DBC.messages[name]
        mine = self.identifier == message.identifier
        values = {key: self.raw(self.payload[mine], signal) * signal.scale for key, signal in message.signals.items()}
        return self.time_us[mine], values

    @staticmethod
    def raw(payload, signal):
        bits = (payload >> np.uint64(signal.start)) & np.uint64((1 << signal.length) - 1)
        values = bits.astype(np.int64)
        return np.where(values >= 1 << (signal.length - 1), values - (1 << signal.length), values) if signal.signed else values

    def valid_us(self, name):
        """Times of validity, from the stamps of 20 bits and the arrival that is at most half a second later."""
        arrival, values = self.of(name)
        return arrival - ((arrival - np.rint(values["Stamp"]).astype(np.int64)) & 0xFFFFF), values


def half_a_step(name, signal):
    return 0.51 * DBC.messages[name].signals[signal].scale


class Imported(unittest.TestCase):
    tool, arguments = None, ()

    @classmethod
    def setUpClass(cls):
        if cls.tool is None:
            raise unittest.SkipTest("base")
        cls.directory = tempfile.mkdtemp()
        cls.out = os.path.join(cls.directory, "run")
        result = run(cls.tool, *cls.arguments, cls.out)
        if result.returncode:
            raise AssertionError(result.stderr)
        cls.log = Log(cls.out + ".log")
        cls.about = json.loads(text_of(cls.out + ".json"))
        cls.truth = np.array([[float(v or "nan") for v in row.values()] for row in csv.DictReader(text_of(cls.out + ".truth.csv").splitlines())])

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(getattr(cls, "directory", ""), ignore_errors=True)

    def common_laws(self):
        self.assertTrue((np.diff(self.log.time_us) >= 0).all())
        self.assertEqual(len(self.log.time_us), self.about["frames"])
        self.assertEqual(self.about["beyond"], {})

    def check(self, name, signal, found, expected):
        np.testing.assert_allclose(found, expected, rtol=0, atol=half_a_step(name, signal) + 1e-9, err_msg=f"{name}.{signal}")

    def check_imu(self, time_us, rate_frd, force_frd):
        """Rows of the source from the second on; time of the source in us."""
        valid, gyro = self.log.valid_us("In_Imu0Time")
        np.testing.assert_array_equal(valid - START_US, time_us[1:])
        dt = np.diff(time_us)
        dt = np.where(dt > inertial.INTERVAL_MAX_US, int(np.median(dt)), dt)
        np.testing.assert_array_equal(np.rint(gyro["Interval"]), dt)
        for name, letters, source in (("In_Imu0Gyro", "Ang", rate_frd), ("In_Imu0Accel", "Vel", force_frd)):
            _, values = self.log.of(name)
            for axis, sign, column in (("X", 1, 0), ("Y", -1, 1), ("Z", -1, 2)):
                self.check(name, letters + axis, values[letters + axis], sign * source[1:, column] * dt * 1e-6)
            np.testing.assert_array_equal(np.rint(values["Seq"]), np.arange(len(dt)) % 16)


@with_skog
class Skog(Imported):
    tool, arguments = "import_skog", (SKOG,)

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        source = scipy.io.loadmat(os.path.join(SKOG, "GNSSaidedINS_data.mat"), squeeze_me=True, struct_as_record=False)["in_data"]
        cls.imu, cls.gnss, cls.speed = source.IMU, source.GNSS, source.SPEEDOMETER

    def test_the_log_keeps_the_laws_of_every_imported_log(self):
        self.common_laws()

    def test_every_imu_sample_comes_back_within_half_a_step_in_forward_left_up(self):
        self.check_imu(np.rint(np.ravel(self.imu.t) * 1e6).astype(np.int64), self.imu.gyro.T, self.imu.acc.T)
        self.assertEqual(self.about["imu_gaps"], 1)

    def test_every_speed_comes_back_and_the_yaw_rate_is_not_available(self):
        valid, values = self.log.valid_us("In_BodySpeed")
        np.testing.assert_array_equal(valid - START_US, np.rint(np.ravel(self.speed.t) * 1e6))
        self.check("In_BodySpeed", "Forward", values["Forward"], self.speed.speed)
        signal = DBC.messages["In_BodySpeed"].signals["YawRate"]
        np.testing.assert_allclose(values["YawRate"], -(1 << (signal.length - 1)) * signal.scale)

    def test_fixes_are_where_the_set_has_them_100_ms_late_with_the_dilutions_accuracy(self):
        valid, lat = self.log.valid_us("In_GnssLat")
        arrival, lon = self.log.of("In_GnssLon")
        _, alt = self.log.of("In_GnssAlt")
        _, acc = self.log.of("In_GnssAcc")
        np.testing.assert_array_equal(valid - START_US, np.rint(np.ravel(self.gnss.t) * 1e6))
        np.testing.assert_array_equal(arrival - valid, 100_000)
        ecef = inertial.to_ecef(lat["Lat"], lon["Lon"], alt["Height"]) - inertial.to_ecef(59.35, 18.07, 30.0)[:, None]
        enu = inertial.east_north_up(59.35, 18.07) @ ecef
        np.testing.assert_allclose(enu, [self.gnss.pos_ned[1], self.gnss.pos_ned[0], -self.gnss.pos_ned[2]], atol=0.0015)
        np.testing.assert_allclose(acc["Hor"], 3 * self.gnss.HDOP / np.sqrt(2), atol=0.0026)
        np.testing.assert_allclose(acc["Ver"], 3 * self.gnss.VDOP, atol=0.0026)

    def test_the_reference_is_the_whole_track_cut_out_parts_included_and_a_cut_removes_fixes_alone(self):
        np.testing.assert_allclose(self.truth[:, 1:3], self.gnss.pos_ned[[1, 0]].T, atol=1e-6)
        cut = os.path.join(self.directory, "cut")
        done = run("import_skog", SKOG, cut, "--cut", "100,30", "--cut", "200,10", "--no-speedometer")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(text_of(cut + ".truth.csv"), text_of(self.out + ".truth.csv"))
        log = Log(cut + ".log")
        t = np.ravel(self.gnss.t)
        kept = (t < 100) | ((t >= 130) & (t < 200)) | (t >= 210)
        self.assertEqual(kept.sum(), len(t) - 40)
        np.testing.assert_array_equal(log.valid_us("In_GnssLat")[0] - START_US, np.rint(t[kept] * 1e6))
        self.assertEqual(len(log.of("In_BodySpeed")[0]), 0)
        np.testing.assert_array_equal(log.of("In_Imu0Gyro")[1]["AngX"], self.log.of("In_Imu0Gyro")[1]["AngX"])


@with_px4
class Px4(Imported):
    tool, arguments = "import_px4", (PX4, "iris_gps")

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        rows = {}
        with open(os.path.join(PX4, "replay_data", "iris_gps.csv")) as file:
            for line in file:
                time, sensor, *values = line.strip().split(",")
                rows.setdefault(sensor, []).append([float(time), *map(float, values)])
        cls.rows = {name: np.array(values) for name, values in rows.items()}
        cls.states = np.loadtxt(os.path.join(PX4, "change_indication", "iris_gps.csv"), delimiter=",", skiprows=1)
        cls.reference = np.loadtxt(cls.out + ".reference.csv", delimiter=",", skiprows=1)

    def test_the_log_keeps_the_laws_of_every_imported_log(self):
        self.common_laws()

    def test_every_imu_sample_comes_back_within_half_a_step_in_forward_left_up(self):
        imu = self.rows["imu"]
        self.check_imu(imu[:, 0].astype(np.int64), imu[:, 4:7], imu[:, 1:4])

    def test_fixes_are_those_of_the_source_valid_110_ms_before_they_arrive(self):
        gps = self.rows["gps"]
        valid, lat = self.log.valid_us("In_GnssLat")
        np.testing.assert_array_equal(valid - START_US, gps[:, 0] - 110_000)
        self.check("In_GnssLat", "Lat", lat["Lat"], gps[:, 3] * 1e-7)
        self.check("In_GnssLon", "Lon", self.log.of("In_GnssLon")[1]["Lon"], gps[:, 2] * 1e-7)
        self.check("In_GnssAlt", "Height", self.log.of("In_GnssAlt")[1]["Height"], gps[:, 1] * 1e-3)
        _, velocity = self.log.of("In_GnssVelEN")
        self.check("In_GnssVelEN", "East", velocity["East"], gps[:, 5])
        self.check("In_GnssVelEN", "North", velocity["North"], gps[:, 4])
        self.check("In_GnssVelU", "Up", self.log.of("In_GnssVelU")[1]["Up"], -gps[:, 6])

    def test_the_field_is_a_sample_of_the_source_in_forward_left_up_at_50_hz_at_most(self):
        valid, flux = self.log.valid_us("In_Mag")
        source = {int(row[0]): row[1:4] for row in self.rows["mag"]}
        expected = np.array([source[t] for t in valid - START_US]) * [100, -100, -100]
        for axis, column in (("FluxX", 0), ("FluxY", 1), ("FluxZ", 2)):
            self.check("In_Mag", axis, flux[axis], expected[:, column])
        self.assertGreater(np.median(np.diff(valid)), 19_000)

    def test_pressures_are_those_of_the_heights_in_the_standard_atmosphere(self):
        valid, baro = self.log.valid_us("In_Baro")
        source = {int(row[0]): row[1] for row in self.rows["baro"]}
        height = 44330.77 * (1 - (baro["Pressure"] / 101325) ** 0.190263)  # ISO 2533, solved for the height
        np.testing.assert_allclose(height, [source[t] for t in valid - START_US], atol=0.05)

    def test_the_reference_is_px4s_state_turned_into_our_axes(self):
        first = np.flatnonzero(np.abs(self.states[:, 5:11]).max(axis=1) > 0)[0]
        states, found = self.states[first:], self.reference
        np.testing.assert_allclose(found[:, 0], states[:, 0] * 1e-6 + 1, atol=1e-6)
        np.testing.assert_allclose(found[:, 1:4], states[:, [9, 8, 10]] * [1, 1, -1], atol=1e-6)
        np.testing.assert_allclose(found[:, 4:7], states[:, [6, 5, 7]] * [1, 1, -1], atol=1e-6)

        def matrix(q):
            w, x, y, z = q.T
            return np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y), 2 * (x * y + w * z), 1 - 2 * (x * x + z * z),
                             2 * (y * z - w * x), 2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)], axis=1).reshape(-1, 3, 3)

        enu_of_ned = np.array([[0, 1, 0], [1, 0, 0], [0, 0, -1]])
        np.testing.assert_allclose(matrix(found[:, 7:11]), enu_of_ned @ matrix(states[:, 1:5]) @ np.diag([1, -1, -1]), atol=1e-5)
        yaw = np.arctan2(matrix(found[:, 7:11])[:, 1, 0], matrix(found[:, 7:11])[:, 0, 0])
        np.testing.assert_allclose(self.truth[:, 3], yaw, atol=1e-5)

    def test_the_origin_is_the_first_fix(self):
        gps = self.rows["gps"][0]
        self.assertEqual(self.about["origin"], {"lat_deg": gps[3] * 1e-7, "lon_deg": gps[2] * 1e-7, "height_m": gps[1] * 1e-3})


@with_husky
class HuskyInTheImusFrame(Imported):
    tool, arguments = "import_husky", (HUSKY, "--imu-frame")

    def test_the_log_keeps_the_laws_of_every_imported_log(self):
        self.common_laws()

    def test_there_are_headings_in_place_of_fixes_and_the_pose_starts_with_the_first(self):
        self.assertEqual(len(self.log.of("In_GnssLat")[0]), 0)
        valid, heading = self.log.valid_us("In_Heading")
        self.assertGreater(len(valid), 1000)
        self.assertAlmostEqual(float(np.median(np.diff(valid))), 333_200, delta=500)
        self.assertAlmostEqual(heading["Angle"][0], self.about["start_pose"]["yaw_rad"], delta=1e-4)
        np.testing.assert_allclose(heading["Acc"], 0.035, atol=1e-4)

    def test_headings_turn_as_the_wheels_do(self):
        # Skidding wheels tell turns to a few percent: over ten seconds that is less than the mistake of a wrong axis.
        valid, heading = self.log.valid_us("In_Heading")
        at, speed = self.log.valid_us("In_BodySpeed")
        turned = np.interp(valid, at[1:], np.cumsum(np.diff(at) * 1e-6 * speed["YawRate"][1:]))
        yaw = np.unwrap(heading["Angle"])
        by_heading, by_wheels = yaw[30:] - yaw[:-30], turned[30:] - turned[:-30]
        self.assertGreater(np.corrcoef(by_heading, by_wheels)[0, 1], 0.95)
        self.assertAlmostEqual(float(np.sum(by_heading * by_wheels) / np.sum(by_wheels ** 2)), 1.0, delta=0.2)


class Geodesy(unittest.TestCase):
    def test_to_the_ellipsoid_and_back_is_the_same_place_to_a_micrometre(self):
        generator = np.random.default_rng(3)
        enu = generator.uniform(-50_000, 50_000, (3, 200))
        enu[2] = generator.uniform(-100, 3000, 200)
        enu[:, 0] = 0
        for origin in ((59.35, 18.07, 30.0), (-33.9, 151.2, 10.0), (0.0, 179.99, 0.0)):
            np.testing.assert_allclose(inertial.to_enu(*inertial.from_enu(enu, origin)), enu, atol=2e-6)

    def test_earth_centred_coordinates_are_those_of_the_ellipsoids_axes(self):
        # WGS84: equatorial radius 6378137 m, polar radius 6356752.3142 m (NIMA TR8350.2, table 3.3).
        np.testing.assert_allclose(inertial.to_ecef(0, 0, 0), [6378137, 0, 0], atol=1e-6)
        np.testing.assert_allclose(inertial.to_ecef(90, 0, 10), [0, 0, 6356762.3142], atol=1e-3)


class BadInput(unittest.TestCase):
    """One clear line on stderr, status 1, nothing written."""

    def setUp(self):
        self.directory = tempfile.mkdtemp()
        self.addCleanup(shutil.rmtree, self.directory, ignore_errors=True)
        self.set = os.path.join(self.directory, "set")
        os.mkdir(self.set)
        self.out = os.path.join(self.directory, "out")

    def refused(self, result, *words):
        self.assertEqual(result.returncode, 1, result.stderr)
        self.assertEqual(result.stderr.count("\n"), 1, result.stderr)
        for word in words:
            self.assertIn(word, result.stderr)
        self.assertEqual(os.listdir(self.directory), ["set"])

    def skog(self, **changes):
        """Ten seconds in which a car stands, or what `changes` makes of them."""
        t, fixes = np.arange(1000) * 0.01, np.arange(10) + 0.1
        parts = {"IMU": {"t": t, "gyro": np.zeros((3, 1000)), "acc": np.outer([0, 0, -9.8], np.ones(1000))},
                 "GNSS": {"t": fixes, "pos_ned": np.zeros((3, 10)), "HDOP": np.ones(10), "VDOP": np.ones(10)},
                 "SPEEDOMETER": {"t": fixes, "speed": np.zeros(10)}}
        for name, value in changes.items():
            part, key = name.split("_", 1)
            if value is None:
                del parts[part][key]
            else:
                parts[part][key] = value
        scipy.io.savemat(os.path.join(self.set, "GNSSaidedINS_data.mat"), {"in_data": parts})
        return run("import_skog", self.set, self.out)

    def test_a_small_set_of_skogs_form_is_imported(self):
        done = self.skog()
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(json.loads(text_of(self.out + ".json"))["messages"]["In_Imu0Gyro"], 999)

    def test_skogs_set_names_table_row_and_reason(self):
        t = np.arange(10) + 0.1
        back, nan = t.copy(), np.zeros((3, 1000))
        back[4] = 1.0
        nan[1, 17] = np.nan
        self.refused(self.skog(GNSS_t=back), "GNSSaidedINS_data.mat", "GNSS row 4", "time goes back")
        self.refused(self.skog(IMU_gyro=nan), "GNSSaidedINS_data.mat", "IMU row 17", "not a finite number")
        self.refused(self.skog(SPEEDOMETER_speed=np.zeros(7)), "not Skog's in_data")
        self.refused(self.skog(GNSS_HDOP=None), "not Skog's in_data", "HDOP")

    def test_skogs_file_that_is_missing_or_no_matlab_file_is_named(self):
        self.refused(run("import_skog", self.set, self.out), "GNSSaidedINS_data.mat", "No such file")
        with open(os.path.join(self.set, "GNSSaidedINS_data.mat"), "w") as file:
            file.write("hello\n" * 40)
        self.refused(run("import_skog", self.set, self.out), "GNSSaidedINS_data.mat", "not Skog's in_data")

    def test_a_cut_that_is_no_span_is_refused(self):
        for text in ("10", "a,b", "10,-5", "nan,5"):
            done = run("import_skog", self.set, self.out, "--cut", text)
            self.assertNotEqual(done.returncode, 0, text)
            self.assertIn("--cut", done.stderr.splitlines()[-1])
            self.assertEqual(os.listdir(self.directory), ["set"])

    def px4(self, replay=None, states=None):
        for folder, text in (("replay_data", replay if replay is not None else self.replay()), ("change_indication", states or self.states())):
            os.makedirs(os.path.join(self.set, folder), exist_ok=True)
            with open(os.path.join(self.set, folder, "log.csv"), "w") as file:
                file.write(text)
        return run("import_px4", self.set, "log", self.out)

    @staticmethod
    def replay():
        rows = [f"{t},imu,0,0,-9.8,0,0,0" for t in range(200_000, 1_200_000, 5_000)]
        rows += [f"{t},gps,488000,85456000,473977000,0,0,0" for t in range(300_000, 1_200_000, 200_000)]
        return "\n".join(rows) + "\n"

    @staticmethod
    def states(moved=0.1):
        header = "Timestamp," + ",".join(f"state[{i}]" for i in range(24))
        return header + "\n" + "".join(f"{t},1,0,0,0,{moved},0,0,{','.join(['0'] * 17)}\n" for t in range(300_000, 1_200_000, 100_000))

    def test_a_small_log_of_px4s_form_is_imported_without_the_sensors_it_lacks(self):
        done = self.px4()
        self.assertEqual(done.returncode, 0, done.stderr)
        messages = json.loads(text_of(self.out + ".json"))["messages"]
        self.assertEqual((messages["In_Imu0Gyro"], messages["In_GnssLat"], "In_Mag" in messages), (199, 5, False))

    def test_what_a_px4_log_has_beside_is_counted_and_left_out(self):
        more = ["200000,range,0.2,100", "200000,flow,0,0,0,0,0,0", "200000,vio,1,2,3", "250000,gps,0,0,0,0,0,0"]
        # PX4's reader lets a comma end the line, and more numbers pass.
        lines = self.replay().replace("205000,imu,0,0,-9.8,0,0,0", "205000,imu,0,0,-9.8,0,0,0,").replace("210000,imu,0,0,-9.8,0,0,0", "210000,imu,0,0,-9.8,0,0,0,7,8").splitlines()
        self.assertEqual(self.px4().returncode, 0)
        expected = text_of(self.out + ".log")
        done = self.px4("\n".join(more[:3] + lines[:200] + more[3:] + lines[200:]) + "\n")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(text_of(self.out + ".log"), expected)
        self.assertEqual(json.loads(text_of(self.out + ".json"))["dropped"],
                         {"rows of range": 1, "rows of flow": 1, "rows of vio": 1, "fixes without a place": 1, "numbers beyond those of imu": 2,
                          "IMU samples without one before them": 1})

    def test_a_px4_log_without_px4s_estimate_is_a_log_without_truth(self):
        self.assertEqual(self.px4().returncode, 0)
        expected = text_of(self.out + ".log")
        os.remove(os.path.join(self.set, "change_indication", "log.csv"))
        done = run("import_px4", self.set, "log", self.out)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("nothing to compare with", done.stdout)
        self.assertIn("truth.csv is not of this log: now", done.stdout)
        self.assertEqual(text_of(self.out + ".log"), expected)
        self.assertEqual(sorted(os.listdir(self.directory)), ["out.json", "out.log", "out.reference.csv.old", "out.truth.csv.old", "set"])

    def test_px4s_log_names_file_line_and_reason(self):
        good = self.replay()
        cases = [(good.replace("205000,imu,0,0,-9.8,0,0,0", "205000,imu,0,0,-9.8,0,0"), "replay_data/log.csv:2", "5 numbers, imu has 6"),
                 (good.replace("205000,imu", "205000,lidar"), "log.csv:2", "no sensor of a replay log"),
                 (good.replace("205000,imu,0", "205000,imu,much"), "log.csv:2", "not a number", "much"),
                 (good.replace("205000,imu,0", "205000,imu,nan"), "log.csv:2", "finite"),
                 (good.replace("205000,imu", "100000,imu"), "log.csv:2", "time goes back"),
                 (good.replace("85456000,473977000", "85456000,950000000", 1), "log.csv:201", "no such place"),
                 (good.split("300000,gps")[0], "no row of gps"), (good.replace("85456000,473977000", "0,0"), "none of its 5 rows of gps has a place"),
                 ("", "no row of imu")]
        for text, *words in cases:
            with self.subTest(words=words):
                self.refused(self.px4(text), *words)

    def test_px4s_states_name_file_line_and_reason(self):
        good = self.states()
        self.refused(self.px4(states=self.states(moved=0)), "change_indication/log.csv", "never aligned")
        self.refused(self.px4(states="Timestamp\n"), "change_indication/log.csv", "no table")
        self.refused(self.px4(states=good.replace("300000,1,", "300000,one,")), "change_indication/log.csv:2", "not a number", "one")
        self.refused(self.px4(states=good + "1200000,1,0\n"), "change_indication/log.csv", "no table of time and 24 states")

    def test_a_log_that_is_not_there_is_named(self):
        self.refused(run("import_px4", self.set, "moon", self.out), "moon.csv", "No such file")

    @with_husky
    def test_an_orientation_that_is_none_is_named(self):
        for file in ("fix.csv", "imu_data.csv", "husky_velocity_controller_odom.csv"):
            lines = text_of(os.path.join(HUSKY, "test1_" + file)).splitlines()[:300]
            if file == "imu_data.csv":
                fields = lines[39].split(",")
                lines[39] = ",".join(fields[:2] + ["0", "0", "0", "0.5"] + fields[6:])
            with open(os.path.join(self.set, "test1_" + file), "w") as out:
                out.write("\n".join(lines) + "\n")
        self.refused(run("import_husky", self.set, self.out, "--imu-frame"), "test1_imu_data.csv:40", "length 0.500")


if __name__ == "__main__":
    unittest.main()
