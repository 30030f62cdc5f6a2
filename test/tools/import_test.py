#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The importers and the log writer, judged by canmatrix and by the data sets themselves (found through $TETAP_DATA, skipped without)."""
import contextlib
import csv
import io
import json
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

import numpy as np

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
TOOLS = os.path.join(ROOT, "tools")
sys.path.insert(0, os.path.join(TOOLS, "python"))
sys.dont_write_bytecode = True

from tetap.can import bus_writer  # noqa: E402
from tetap.dataset import common  # noqa: E402

with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
    import canmatrix.formats  # says on import which formats it lacks

DATA = os.environ.get("TETAP_DATA", os.path.join(ROOT, "..", "shared", "data"))
LINE = re.compile(r"\((\d{10})\.(\d{6})\) vcan0 ([0-9A-F]{3})#([0-9A-F]{16})$")


def judge():
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        return canmatrix.formats.loadp_flat(bus_writer.DEFAULT_DBC)


def read_log(path):
    """(time in us, identifier, payload) of each line."""
    with open(path) as file:
        for line in file:
            seconds, micros, identifier, data = LINE.match(line).groups()
            yield int(seconds) * 1_000_000 + int(micros), int(identifier, 16), bytes.fromhex(data)


def decode(matrix, identifier, data):
    """Name of the message and its signals by short name, as canmatrix reads them; raw and physical."""
    frame = matrix.frame_by_id(canmatrix.ArbitrationId(identifier, extended=False))
    values = frame.decode(data)
    return frame.name, {name.split("_", 1)[1]: value for name, value in values.items()}


def text_of(path):
    with open(path) as file:
        return file.read()


def run(tool, *arguments):
    return subprocess.run([os.path.join(TOOLS, "dataset", tool), *map(str, arguments)], capture_output=True, text=True, timeout=120)


def needs(*parts):
    """Skips a test where the data set is missing."""
    path = os.path.join(DATA, *parts)
    return path, unittest.skipUnless(os.path.exists(path), f"data set {'/'.join(parts)} is not under {DATA}")


MRCLAM, with_mrclam = needs("mrclam", "MRCLAM_Dataset7")
HUSKY, with_husky = needs("husky")
LABYRINTH, with_labyrinth = needs("tuc_labyrinth")


class Writer(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.dbc, cls.matrix = bus_writer.Dbc(), judge()

    def test_every_signal_of_every_input_comes_back_through_canmatrix_within_half_a_step(self):
        generator = np.random.default_rng(1)
        checked = 0
        paged = {frame.name for frame in self.matrix.frames if any(signal.is_multiplexer for signal in frame.signals)}
        for message in self.dbc.messages.values():
            if not message.name.startswith(("In_", "Cmd_")) or message.name in paged:
                continue
            values = {}
            for key, signal in message.signals.items():
                if key != "Crc":
                    raw = generator.integers(signal.raw_min, signal.raw_max, 50, endpoint=True)
                    raw[:2] = signal.raw_min, signal.raw_max
                    values[key] = raw * signal.scale + generator.uniform(-0.4, 0.4, 50) * signal.scale
                    values[key][:2] = raw[:2] * signal.scale
            log = bus_writer.Log(self.dbc)
            log.add(message.name, np.arange(50), **values)
            for row, (identifier, payload) in enumerate(zip(*log.frames()[1:])):
                name, decoded = decode(self.matrix, int(identifier), int(payload).to_bytes(8, "little"))
                self.assertEqual(name, message.name)
                for key, sent in values.items():
                    signal = message.signals[key]
                    self.assertLessEqual(abs(float(decoded[key].phys_value) - sent[row]), 0.51 * signal.scale, f"{name}.{key}")
                    checked += 1
        self.assertGreater(checked, 3000)

    def test_values_beyond_the_range_leave_their_frame_out_and_are_counted(self):
        log = bus_writer.Log(self.dbc)
        log.add("In_BodySpeed", [0, 1, 2, 3, 4], Forward=[1e9, -1e9, 1.0, 26.2143, 26.2144], YawRate=0.5)
        self.assertEqual(log.beyond, {"In_BodySpeed.Forward": 3})
        forward = [float(decode(self.matrix, int(i), int(p).to_bytes(8, "little"))[1]["Forward"].phys_value) for _, i, p in zip(*log.frames())]
        np.testing.assert_allclose(forward, [1.0, 26.2143])
        self.assertEqual(log.inside(3, In_BodySpeed={"Forward": np.array([1, 27, np.nan]), "YawRate": 0.5}).tolist(), [True, False, True])

    def test_not_available_is_the_one_code_outside_the_range(self):
        log = bus_writer.Log(self.dbc)
        log.add("In_RangeBearing", 0, Id=7, Range=np.nan, Bearing=np.nan)
        _, decoded = decode(self.matrix, 0x309, int(log.frames()[2][0]).to_bytes(8, "little"))
        self.assertEqual((decoded["Range"].raw_value, decoded["Bearing"].raw_value), (65535, -8192))

    def test_a_counter_has_no_code_for_not_available(self):
        with self.assertRaisesRegex(ValueError, "In_BodySpeed.Seq"):
            bus_writer.Log(self.dbc).add("In_BodySpeed", 0, Seq=np.nan)

    def test_the_crc_is_the_catalogued_one(self):
        # Check value of CRC8H2F over "123456789" (AUTOSAR CRC library): 0xDF. Nine bytes are more than a frame, hence the second form.
        def slow(data):
            crc = 0xFF
            for byte in data:
                crc ^= byte
                for _ in range(8):
                    crc = ((crc << 1) ^ 0x2F) & 0xFF if crc & 0x80 else crc << 1
            return crc ^ 0xFF
        self.assertEqual(slow(b"123456789"), 0xDF)
        generator = random.Random(2)
        for _ in range(50):
            payload, offset = generator.getrandbits(64), generator.randrange(64)
            data = payload.to_bytes(8, "little")
            self.assertEqual(bus_writer.crc8(offset, np.array([payload], dtype=np.uint64))[0], slow(bytes([offset]) + data[1:]))

    def test_the_base_moves_identifiers_and_leaves_the_crc(self):
        logs = [bus_writer.Log(self.dbc, base) for base in (0x300, 0x440)]
        for log in logs:
            log.add("Cmd_SetPos", 5, Ctr=1, X=1.0, Y=2.0)
        self.assertEqual(logs[0].text().decode(), "(0000000000.000005) vcan0 303#" + logs[0].text().decode()[-17:])
        self.assertEqual(logs[1].text(), logs[0].text().replace(b"303#", b"443#"))

    def test_frames_are_in_order_of_time_and_equal_times_in_the_order_added(self):
        log = bus_writer.Log(self.dbc)
        log.add("In_WheelSpeed", [3, 1], Left=[0.3, 0.1])
        log.add("In_BodySpeed", [1, 2])
        self.assertEqual([(int(t), int(i)) for t, i, _ in zip(*log.frames())], [(1, 0x307), (1, 0x308), (2, 0x308), (3, 0x307)])

    def test_a_broken_dbc_is_named_by_line(self):
        cases = {"BO_ 768 In_X 8 HOST\n": ":1: not a message", "BO_ 768 In_X: 4 HOST\n": ":1: In_X has 4 bytes",
                 "BO_ 768 In_X: 8 HOST\n SG_ X_A : 60|8@1+ (1,0) [0|255] \"\" T\n": ":2: X_A does not fit",
                 "BO_ 768 In_X: 8 HOST\n SG_ X_A : 0|8@0+ (1,0) [0|255] \"\" T\n": ":2: X_A is big-endian", "VERSION \"\"\n": "no message"}
        for text, message in cases.items():
            with tempfile.NamedTemporaryFile("w", suffix=".dbc") as file:
                file.write(text)
                file.flush()
                with self.assertRaisesRegex(bus_writer.BadInput, re.escape(message)):
                    bus_writer.Dbc(file.name)


class Times(unittest.TestCase):
    def test_decimal_seconds_become_microseconds_exactly(self):
        cases = {"1248446188.323": 1248446188323000, "1432235498.0390896": 1432235498039090, "-0.0000015": -2, "0.127943992614746": 127944,
                 "12": 12_000_000, "1e-3": 1000, "9007199254.740993": 9007199254740993}
        for text, expected in cases.items():
            self.assertEqual(common.microseconds(text), expected, text)


class Imported(unittest.TestCase):
    """Shared by the sets: runs the importer once into a directory of its own."""
    tool, arguments = None, ()

    @classmethod
    def setUpClass(cls):
        if cls.tool is None:
            raise unittest.SkipTest("base")
        cls.directory = tempfile.mkdtemp()
        cls.out = os.path.join(cls.directory, "run")
        cls.result = run(cls.tool, *cls.arguments, cls.out)
        if cls.result.returncode:
            raise AssertionError(cls.result.stderr)
        cls.frames = list(read_log(cls.out + ".log"))
        cls.about = json.loads(text_of(cls.out + ".json"))
        cls.truth = list(csv.DictReader(text_of(cls.out + ".truth.csv").splitlines()))
        cls.matrix = judge()

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.directory, ignore_errors=True)

    def of(self, name):
        """(time in us, signals) of each frame of a message; scaled signals by value."""
        identifier = bus_writer.Dbc().messages[name].identifier
        return [(t, {key: float(value.phys_value) for key, value in decode(self.matrix, i, data)[1].items()})
                for t, i, data in self.frames if i == identifier]

    def common_laws(self):
        times = [frame[0] for frame in self.frames]
        self.assertEqual(times, sorted(times))
        self.assertEqual(len(self.frames), self.about["frames"])
        self.assertEqual(sum(self.about["messages"].values()), self.about["frames"])
        self.assertEqual(self.about["beyond"], {})
        self.assertEqual(self.truth[0]["time_s"], "1.000000")
        position, yaw = self.of("Cmd_SetPos"), self.of("Cmd_SetYaw")
        self.assertEqual((len(position), len(yaw)), (1, 1))
        self.assertEqual(position[0][1]["Ctr"], yaw[0][1]["Ctr"])
        self.assertLess(yaw[0][0], 1_000_000)
        pose = self.about["start_pose"]
        self.assertAlmostEqual(position[0][1]["X"], pose["x_m"], delta=0.0011)
        self.assertAlmostEqual(position[0][1]["Y"], pose["y_m"], delta=0.0011)
        self.assertAlmostEqual(yaw[0][1]["Yaw"], pose["yaw_rad"], delta=0.00003)
        self.assertAlmostEqual(yaw[0][1]["StdPos"], pose["sigma_position_m"], delta=0.0006)
        self.assertAlmostEqual(yaw[0][1]["StdYaw"], pose["sigma_yaw_rad"], delta=0.0002)

    def sequence_laws(self, name, shared_stamps=False):
        samples = self.of(name)
        for number, (t, signals) in enumerate(samples):
            self.assertEqual(int(signals["Seq"]), number % 16)
            age = ((t & 0xFFFFF) - int(signals["Stamp"])) & 0xFFFFF
            self.assertLess(age, 500_000)
        return samples


@with_mrclam
class Mrclam(Imported):
    tool, arguments = "import_mrclam", (MRCLAM, 1)

    def test_the_log_keeps_the_laws_of_every_imported_log(self):
        self.common_laws()

    def test_the_map_is_on_the_bus_before_anything_else(self):
        barcodes = dict(map(int, line.split()) for line in text_of(os.path.join(MRCLAM, "Barcodes.dat")).splitlines() if line[0] != "#")
        places = [line.split() for line in text_of(os.path.join(MRCLAM, "Landmark_Groundtruth.dat")).splitlines() if line[0] != "#"]
        expected = sorted((barcodes[int(f[0])], float(f[1]), float(f[2])) for f in places)
        entries = self.of("In_MapEntry")
        self.assertEqual([int(signals["Id"]) for _, signals in entries], [barcode for barcode, _, _ in expected])
        np.testing.assert_allclose([[s["X"], s["Y"]] for _, s in entries], [e[1:] for e in expected], atol=0.0006)
        self.assertEqual([frame[1] for frame in self.frames[:15]], [0x305] * 15)

    def test_every_row_decodes_to_what_the_data_set_says(self):
        offset = round(self.about["time_offset_s"] * 1e6)
        odometry = np.loadtxt(os.path.join(MRCLAM, "Robot1_Odometry.dat"))
        speeds = self.sequence_laws("In_BodySpeed")
        kept = odometry[odometry[:, 0] <= (offset + self.frames[-1][0]) / 1e6 + 0.02][:len(speeds)]
        np.testing.assert_allclose([[s["Forward"], s["YawRate"]] for _, s in speeds], kept[:, 1:], atol=6e-5)
        np.testing.assert_allclose([t for t, _ in speeds[1:]], np.rint(kept[1:, 0] * 1e6) - offset, atol=0.6)
        seen = np.loadtxt(os.path.join(MRCLAM, "Robot1_Measurement.dat"))
        ranges = self.sequence_laws("In_RangeBearing")
        self.assertEqual(len(ranges), len(seen))
        np.testing.assert_array_equal([s["Id"] for _, s in ranges], seen[:, 1])
        np.testing.assert_allclose([s["Range"] for _, s in ranges], seen[:, 2], atol=0.00101)
        np.testing.assert_allclose([s["Bearing"] for _, s in ranges], seen[:, 3], atol=0.000201)
        np.testing.assert_allclose([t for t, _ in ranges], np.rint(seen[:, 0] * 1e6) - offset, atol=0.6)

    def test_detections_of_other_robots_and_misread_barcodes_are_on_the_bus_too(self):
        counts = self.about["detections"]
        self.assertEqual(sum(counts.values()), self.about["messages"]["In_RangeBearing"])
        self.assertTrue(all(count > 0 for count in (counts["landmarks"], counts["other_robots"])))

    def test_the_start_pose_is_the_first_truth(self):
        self.assertAlmostEqual(float(self.truth[0]["x_m"]), self.about["start_pose"]["x_m"], places=5)
        self.assertAlmostEqual(float(self.truth[0]["yaw_rad"]), self.about["start_pose"]["yaw_rad"], places=5)


@with_husky
class Husky(Imported):
    tool, arguments = "import_husky", (HUSKY,)

    def test_the_log_keeps_the_laws_of_every_imported_log(self):
        self.common_laws()
        self.assertEqual(self.about["truth"], "gps track")
        self.assertEqual({row["yaw_rad"] for row in self.truth}, {""})

    def test_increments_over_their_interval_are_the_imu_s_readings(self):
        with open(os.path.join(HUSKY, "test1_imu_data.csv")) as file:
            file.readline()
            rows = {common.microseconds(row["t_stamp"]): row for row in csv.DictReader(file)}
        stamps = sorted(rows)
        offset = round(self.about["time_offset_s"] * 1e6)
        gyro, accel, time = self.of("In_Imu0Gyro"), self.of("In_Imu0Accel"), self.of("In_Imu0Time")
        first = next(i for i, t in enumerate(stamps) if t - offset >= 1_000_000) + 1
        self.assertEqual((len(gyro), len(accel)), (len(time), len(time)))
        for n in range(0, len(time), 97):
            row, dt = rows[stamps[first + n]], (stamps[first + n] - stamps[first + n - 1]) * 1e-6
            self.assertEqual(int(time[n][1]["Stamp"]), (stamps[first + n] - offset) & 0xFFFFF)
            self.assertAlmostEqual(time[n][1]["Interval"] * 1e-6, dt, places=9)
            self.assertEqual({gyro[n][1]["Seq"], accel[n][1]["Seq"], time[n][1]["Seq"]}, {float(n % 16)})
            for axis in "xyz":
                self.assertAlmostEqual(gyro[n][1]["Ang" + axis.upper()], float(row["w" + axis]) * dt, delta=6e-7)
                self.assertAlmostEqual(accel[n][1]["Vel" + axis.upper()], float(row["a" + axis]) * dt, delta=6e-6)
            self.assertGreater(time[n][0], stamps[first + n] - offset)  # it arrives after its time of validity

    def test_a_position_is_four_frames_with_one_stamp_and_sequence_in_order(self):
        offsets = [frame for frame in self.frames if 0x30A <= frame[1] <= 0x30D]
        self.assertEqual([frame[1] for frame in offsets], [0x30A, 0x30B, 0x30C, 0x30D] * (len(offsets) // 4))
        for n in range(0, len(offsets), 4):
            self.assertEqual(len({frame[2][:3] for frame in offsets[n:n + 4]}), 1)
        with open(os.path.join(HUSKY, "test1_fix.csv")) as file:
            file.readline()
            rows = list(csv.DictReader(file))
        lat, lon, alt, acc = (self.of(name) for name in ("In_GnssLat", "In_GnssLon", "In_GnssAlt", "In_GnssAcc"))
        self.assertEqual(len(lat), len(rows))
        for n, row in enumerate(rows):
            self.assertAlmostEqual(lat[n][1]["Lat"], float(row["lat_deg"]), delta=1.1e-9)
            self.assertAlmostEqual(lon[n][1]["Lon"], float(row["lon_deg"]), delta=1.1e-9)
            self.assertAlmostEqual(alt[n][1]["Height"], float(row["alt_m"]), delta=0.0011)
            self.assertAlmostEqual(acc[n][1]["Hor"] ** 2, (float(row["cov_e"]) + float(row["cov_n"])) / 2, delta=0.02)

    def test_the_reference_is_the_gps_track_in_metres(self):
        # A sphere of the mean of the local radii of curvature is good to a part in a thousand.
        lat = [float(s["Lat"]) for _, s in self.of("In_GnssLat")]
        lon = [float(s["Lon"]) for _, s in self.of("In_GnssLon")]
        metres = 111_080.0
        np.testing.assert_allclose([float(row["y_m"]) for row in self.truth], (np.array(lat) - lat[0]) * metres, rtol=2e-3, atol=0.02)
        np.testing.assert_allclose([float(row["x_m"]) for row in self.truth],
                                   (np.array(lon) - lon[0]) * metres * np.cos(np.radians(lat[0])), rtol=4e-3, atol=0.02)

    def test_without_a_start_pose_none_is_sent(self):
        out = os.path.join(self.directory, "bare")
        self.assertEqual(run("import_husky", HUSKY, out, "--no-start-pose").returncode, 0)
        about = json.loads(text_of(out + ".json"))
        self.assertNotIn("Cmd_SetPos", about["messages"])
        self.assertNotIn("start_pose", about)


@with_labyrinth
class Labyrinth(Imported):
    tool, arguments = "import_labyrinth", (LABYRINTH,)

    def test_the_log_keeps_the_laws_of_every_imported_log(self):
        self.common_laws()

    def test_ranges_have_no_bearing_and_their_anchors_are_in_the_map(self):
        anchors = {int(signals["Id"]) for _, signals in self.of("In_MapEntry")}
        ranges = self.sequence_laws("In_RangeBearing")
        self.assertEqual({int(signals["Id"]) for _, signals in ranges}, anchors)
        raws = {decode(self.matrix, i, data)[1]["Bearing"].raw_value for _, i, data in self.frames if i == 0x309}
        self.assertEqual(raws, {-8192})

    def test_the_wheel_speeds_as_imported_lead_along_the_truth(self):
        # What the importer says about the readme's columns: left and right the other way round end metres away.
        speeds = self.sequence_laws("In_WheelSpeed")
        pose, track = self.about["start_pose"], self.about["track_m"]
        truth = np.array([[float(row["x_m"]), float(row["y_m"])] for row in self.truth])

        def largest_error(swap):
            x, y, yaw, worst = pose["x_m"], pose["y_m"], pose["yaw_rad"], 0.0
            for (t0, now), (t1, _), (true_x, true_y) in zip(speeds, speeds[1:], truth[1:]):
                left, right = (now["Right"], now["Left"]) if swap else (now["Left"], now["Right"])
                dt, rate = (t1 - t0) * 1e-6, (right - left) / track
                x += (left + right) / 2 * dt * np.cos(yaw + rate * dt / 2)
                y += (left + right) / 2 * dt * np.sin(yaw + rate * dt / 2)
                yaw += rate * dt
                worst = max(worst, np.hypot(x - true_x, y - true_y))
            return worst

        self.assertLess(largest_error(swap=False), 0.5)
        self.assertGreater(largest_error(swap=True), 1.5)


class BadInput(unittest.TestCase):
    """One clear line on stderr, status 1, nothing written."""

    def setUp(self):
        self.directory = tempfile.mkdtemp()
        self.addCleanup(shutil.rmtree, self.directory, ignore_errors=True)
        self.set = os.path.join(self.directory, "set")
        os.mkdir(self.set)
        self.out = os.path.join(self.directory, "out")

    def write(self, name, text):
        with open(os.path.join(self.set, name), "w") as file:
            file.write(text)

    def mrclam(self):
        self.write("Barcodes.dat", "# subject barcode\n1 5\n6 63\n7 81\n")
        self.write("Landmark_Groundtruth.dat", "6 1.0 2.0 0 0\n7 -1.0 2.0 0 0\n")
        self.write("Robot1_Odometry.dat", "100.0 0.1 0.0\n100.5 0.1 0.1\n101.0 0.1 0.0\n")
        self.write("Robot1_Measurement.dat", "100.2 63 1.5 0.1\n100.2 5 1.0 0.0\n100.9 300 1.0 0.0\n")
        self.write("Robot1_Groundtruth.dat", "99.0 0 0 0\n100.2 0 0 3.2\n101.5 0.1 0 0\n")

    def labyrinth(self):
        self.write("Indoor_UWB_Input.txt", "".join(
            f"range2 {t} 1.5 0.01 0 0 {105 + t % 2} 0\nodom2diff {t} 0.4 0.4 0 0.0785 1e-4 1e-4 1e-4\n" for t in range(10)).replace(
                "0 0 106", "2 0 106"))
        self.write("Indoor_UWB_GT.txt", "".join(f"point2 {t} {0.4 * t} 0 0 0 0 0\n" for t in range(10)))

    def refused(self, result, *words):
        self.assertEqual(result.returncode, 1, result.stderr)
        self.assertEqual(result.stderr.count("\n"), 1, result.stderr)
        for word in words:
            self.assertIn(word, result.stderr)
        self.assertEqual(os.listdir(self.directory), ["set"])

    def test_a_small_set_is_imported_with_what_is_left_out_counted(self):
        self.mrclam()
        result = run("import_mrclam", self.set, 1, self.out)
        self.assertEqual(result.returncode, 0, result.stderr)
        about = json.loads(text_of(self.out + ".json"))
        self.assertEqual(about["dropped"], {"detections of barcodes above 254": 1})
        self.assertEqual(about["detections"], {"landmarks": 1, "other_robots": 1, "unknown": 0})
        frames = list(read_log(self.out + ".log"))
        self.assertEqual([(t, i) for t, i, _ in frames[4:]], [(1_000_000, 0x308), (1_000_000, 0x309), (1_000_000, 0x309),
                                                              (1_300_000, 0x308), (1_800_000, 0x308)])
        self.assertAlmostEqual(about["start_pose"]["yaw_rad"], 3.2 - 2 * np.pi)
        self.assertEqual(sorted(os.listdir(self.directory)), ["out.json", "out.log", "out.truth.csv", "set"])

    def test_mrclam_without_identities_with_a_wrong_start_and_an_end(self):
        self.mrclam()
        result = run("import_mrclam", "--no-ids", "--start-error", "2", "-1", "1.5", "--until", "0.5", self.set, 1, self.out)
        self.assertEqual(result.returncode, 0, result.stderr)
        about = json.loads(text_of(self.out + ".json"))
        self.assertEqual(about["detections"], {"landmarks": 1, "other_robots": 0, "unknown": 0})
        self.assertEqual((about["start_pose"]["x_m"], about["start_pose"]["y_m"]), (2, -1))
        self.assertAlmostEqual(about["start_pose"]["yaw_rad"], 3.2 + 1.5 - 2 * np.pi)
        frames = list(read_log(self.out + ".log"))
        self.assertEqual([(t, i) for t, i, _ in frames[4:]], [(1_000_000, 0x308), (1_000_000, 0x309), (1_300_000, 0x308)])
        seen = decode(judge(), *frames[5][1:])[1]
        self.assertEqual((seen["Id"].raw_value, float(seen["Range"].phys_value)), (255, 1.5))
        os.mkdir(self.directory + "/none")
        self.assertEqual(run("import_mrclam", "--until", "0", self.set, 1, self.directory + "/none/out").returncode, 1)
        self.assertEqual(os.listdir(self.directory + "/none"), [])

    TRACK = "L 3.0 4.0 1000000 3.1 4.1 1 0\nR 5.0 0.9 -1.5 1050000 3.2 4.1 1 0\nR 0 0 0 1100000 3.3 4.1 1 0\n"

    def test_a_track_of_lidar_and_radar_is_imported(self):
        self.write("track.txt", self.TRACK)
        result = run("import_udacity_track", os.path.join(self.set, "track.txt"), self.out)
        self.assertEqual(result.returncode, 0, result.stderr)
        about = json.loads(text_of(self.out + ".json"))
        self.assertEqual(about["dropped"], {"rows in which the sensor saw nothing": 1})
        (t0, i0, lidar), (t1, i1, radar) = read_log(self.out + ".log")
        self.assertEqual((t0, i0, t1, i1), (1_000_000, 0x309, 1_050_000, 0x31F))
        lidar, radar = decode(judge(), i0, lidar)[1], decode(judge(), i1, radar)[1]
        self.assertEqual((lidar["Id"].raw_value, lidar["Inst"].raw_value, radar["Inst"].raw_value), (255, 0, 1))
        self.assertAlmostEqual(float(lidar["Range"].phys_value), 5.0, delta=0.001)
        self.assertAlmostEqual(float(lidar["Bearing"].phys_value), np.arctan2(4, 3), delta=0.0002)
        for key, value, step in (("Range", 5.0, 0.01), ("Bearing", 0.9, 0.0016), ("RangeRate", -1.5, 0.04)):
            self.assertAlmostEqual(float(radar[key].phys_value), value, delta=0.51 * step)
        self.assertEqual(text_of(self.out + ".truth.csv").splitlines()[2], "1.050000,3.200000,4.100000,0.000000")

    def test_two_sensors_share_a_time_and_rows_beyond_the_signals_are_left_out(self):
        self.write("track.txt", "L 3 4 1000000 3 4 1 0\nR 5 0.9 -1.5 1000000 3 4 1 0\nL 120 60 1100000 3 4 1 0\nR 134 0.4 90 1100000 3 4 1 0\n"
                                "R 164 0.4 1 1200000 3 4 1 0\nL 131 2 1200000 3 4 1 0\nR 163.5 0.4 1 1300000 3 4 1 0\n")
        result = run("import_udacity_track", os.path.join(self.set, "track.txt"), self.out)
        self.assertEqual(result.returncode, 0, result.stderr)
        about = json.loads(text_of(self.out + ".json"))
        self.assertEqual(about["dropped"], {"rows beyond what In_RangeBearing can say": 1, "rows beyond what In_Radar can say": 2})
        self.assertEqual(about["beyond"], {})
        self.assertEqual([(t, i) for t, i, _ in read_log(self.out + ".log")],
                         [(1_000_000, 0x309), (1_000_000, 0x31F), (1_200_000, 0x309), (1_300_000, 0x31F)])
        self.assertEqual(len(text_of(self.out + ".truth.csv").splitlines()), 1 + 4)

    def test_a_track_names_file_line_and_reason(self):
        for text, words in (("X 1 2 3 4 5 6 7\n", (":1", "L or R")), ("L 1 2 3 4 5\n", (":1", "6 columns")), ("# nothing\n", ("no measurement",)),
                            (self.TRACK + self.TRACK[:10] + "1000000 0 0 0 0\n", (":4", "time")), ("L 1 nan 5 0 0 0 0\n", (":1", "finite")),
                            ("L 300 4 1000000 3 4 1 0\n", ("beyond what the bus can say",))):
            with self.subTest(text=text):
                self.write("track.txt", text)
                self.refused(run("import_udacity_track", os.path.join(self.set, "track.txt"), self.out), "track.txt", *words)

    def test_mrclam_without_a_start_pose(self):
        self.mrclam()
        self.refused(run("import_mrclam", "--no-start", "--start-error", "1", "0", "0", self.set, 1, self.out), "--no-start")
        self.assertEqual(run("import_mrclam", "--no-start", self.set, 1, self.out).returncode, 0)
        about = json.loads(text_of(self.out + ".json"))
        self.assertNotIn("Cmd_SetPos", about["messages"])
        self.assertEqual(about["start_pose"]["x_m"], 0)

    def kidnapped(self):
        self.write("map_data.txt", "5.0\t-2.0\t7\n-1.5\t3.25\t2\n")
        self.write("control_data.txt", "4.0 0.5\n4.0 62.9\n4.0 0.1\n")
        self.write("gt_data.txt", "1.0 2.0 6.2\n1.4 2.0 6.25\n1.8 2.0 0.02\n")
        self.write("observations.txt", "1 3.0 4.0\n1 -3.0 -4.0\n2 0.0 2.0\n")

    def test_the_kidnapped_vehicle_is_imported(self):
        self.kidnapped()
        result = run("import_udacity_pf", self.set, self.out)
        self.assertEqual(result.returncode, 0, result.stderr)
        about = json.loads(text_of(self.out + ".json"))
        self.assertEqual(about["dropped"], {"steps without observations at the end": 1})
        self.assertEqual(about["messages"], {"Cmd_SetPos": 1, "Cmd_SetYaw": 1, "In_BodySpeed": 2, "In_MapEntry": 2, "In_RangeBearing": 3})
        self.assertEqual([one["id"] for one in about["landmarks"]], [2, 7])
        of = {}
        for t, i, data in read_log(self.out + ".log"):
            name, signals = decode(judge(), i, data)
            of.setdefault(name, []).append((t, {key: float(one.phys_value) if one.raw_value is not None else None for key, one in signals.items()}))
        self.assertEqual([t for t, _ in of["In_RangeBearing"]], [1_000_000, 1_000_000, 1_100_000])
        for (_, seen), (range_m, bearing) in zip(of["In_RangeBearing"], ((5, np.arctan2(4, 3)), (5, np.arctan2(-4, -3)), (2, np.pi / 2))):
            self.assertAlmostEqual(seen["Range"], range_m, delta=0.0011)
            self.assertAlmostEqual(seen["Bearing"], bearing, delta=0.00021)
        # 62.9 rad/s is a turn of 6.29 rad in the step: the heading went from 6.25 to 0.02.
        self.assertAlmostEqual(of["In_BodySpeed"][1][1]["YawRate"], (6.29 - 2 * np.pi) / 0.1, delta=0.001)
        self.assertIn("1 yaw rates had a whole turn too much", " ".join(about["notes"]))
        self.assertEqual(text_of(self.out + ".truth.csv").splitlines()[1:], ["1.000000,1.000000,2.000000,-0.083185", "1.100000,1.400000,2.000000,-0.033185"])

    def test_the_kidnapped_vehicle_names_file_line_and_reason(self):
        cases = [("map_data.txt", "1 2\n", ("map_data.txt:1", "2 columns, expected 3")), ("map_data.txt", "1 2 255\n", ("map_data.txt:1", "identity 255")),
                 ("map_data.txt", "1 2 7\n3 4 7\n", ("map_data.txt:2", "second time")), ("control_data.txt", "4 nan\n", ("control_data.txt:1", "finite")),
                 ("gt_data.txt", "1 2 3\n", ("3 rows of controls and 1 of truth",)), ("observations.txt", "4 1 1\n", ("observations.txt:1", "step 4")),
                 ("observations.txt", "2 1 1\n1 1 1\n", ("observations.txt:2", "step 1 after step 2")),
                 ("observations.txt", "1 1 1\n" * 17, ("step 1 has more than 16",)), ("observations2.txt", "1 1 1\n", ("2 files observations",))]
        for name, text, words in cases:
            with self.subTest(name=name, text=text[:20]):
                self.kidnapped()
                self.write(name, text)
                self.refused(run("import_udacity_pf", self.set, self.out), *words)

    def test_mrclam_names_file_line_and_reason(self):
        cases = [("Robot1_Odometry.dat", "100.0 0.1 0.0\n100.5 0.1\n", ("Robot1_Odometry.dat:2", "2 columns, expected 3")),
                 ("Robot1_Odometry.dat", "100.0 0.1 zero\n", ("Robot1_Odometry.dat:1", "column 3", "not a number", "zero")),
                 ("Robot1_Odometry.dat", "100.0 0.1 nan\n", ("Robot1_Odometry.dat:1", "finite")),
                 ("Robot1_Odometry.dat", "100.0 0.1 0\n99.0 0.1 0\n", ("Robot1_Odometry.dat:2", "goes back by 1.0")),
                 ("Robot1_Odometry.dat", "100.0 0.1 0\n90000.0 0.1 0\n", ("Robot1_Odometry.dat:2", "jumps by 89900 s")),
                 ("Robot1_Odometry.dat", "# nothing\n", ("Robot1_Odometry.dat", "no row")),
                 ("Robot1_Odometry.dat", "500.0 0.1 0\n501.0 0.1 0\n", ("Robot1_Odometry.dat", "no time in common")),
                 ("Robot1_Odometry.dat", "\x00\xff\x01 0.1 0\n", ("Robot1_Odometry.dat:1", "not a number")),
                 ("Robot1_Measurement.dat", "100.3 63.5 1 0\n", ("Robot1_Measurement.dat:1", "barcode 63.5")),
                 ("Barcodes.dat", "1 5\n6 5\n", ("Barcodes.dat:2", "second time")),
                 ("Barcodes.dat", "1 5\n6 255\n", ("Barcodes.dat:2", "barcode 255")),
                 ("Landmark_Groundtruth.dat", "9 1.0 2.0 0 0\n", ("Landmark_Groundtruth.dat:1", "subject 9 has no barcode"))]
        for name, text, words in cases:
            with self.subTest(name=name, text=text):
                self.mrclam()
                self.write(name, text)
                self.refused(run("import_mrclam", self.set, 1, self.out), *words)

    def test_rows_slightly_out_of_order_are_sorted_and_counted(self):
        self.mrclam()
        self.write("Robot1_Odometry.dat", "100.0 0.1 0.0\n100.5 0.1 0.1\n100.45 0.2 0.1\n101.0 0.1 0.0\n")
        self.assertEqual(run("import_mrclam", self.set, 1, self.out).returncode, 0)
        about = json.loads(text_of(self.out + ".json"))
        self.assertEqual(about["dropped"]["rows out of order in Robot1_Odometry.dat, sorted"], 1)

    def test_a_missing_file_is_named(self):
        self.mrclam()
        os.remove(os.path.join(self.set, "Robot1_Groundtruth.dat"))
        self.refused(run("import_mrclam", self.set, 1, self.out), "Robot1_Groundtruth.dat", "No such file")
        self.refused(run("import_husky", self.set, self.out), "test1_", "No such file")
        self.refused(run("import_labyrinth", self.set, self.out), "Indoor_UWB_Input.txt", "No such file")

    def test_an_output_that_cannot_be_written_leaves_nothing_behind(self):
        self.mrclam()
        self.refused(run("import_mrclam", self.set, 1, os.path.join(self.directory, "no", "where", "out")), "cannot write")

    def test_labyrinth_names_file_line_and_reason(self):
        cases = [("range2 0 1.5 0.01 0 0 105 0", "range3 0 1.5 0.01 0 0 105 0", (":1", "'range3'")),
                 ("0 0 106 0\nodom2diff 1 0.4", "0 0 106 0\nodom2diff 1 fast", ("column 2", "'fast'")),
                 ("range2 2 1.5 0.01 0 0 105", "range2 2 1.5 0.01 1 0 105", ("module 105", "somewhere else")),
                 ("0.0785", "0", ("distance between the wheels",))]
        for before, after, words in cases:
            with self.subTest(after=after):
                self.labyrinth()
                path = os.path.join(self.set, "Indoor_UWB_Input.txt")
                text = text_of(path).replace("2 0 106", "0 0 106") if "106" in before else text_of(path)
                self.assertIn(before, text)
                self.write("Indoor_UWB_Input.txt", text.replace(before, after, 1))
                self.refused(run("import_labyrinth", self.set, self.out), "Indoor_UWB_Input.txt", *words)

    @with_husky
    def test_husky_names_file_line_and_reason(self):
        def spoil(name, line, old, new):
            for file in os.listdir(HUSKY):
                if file.endswith(".csv"):
                    lines = text_of(os.path.join(HUSKY, file)).splitlines()[:400]
                    if file.endswith(name):
                        self.assertIn(old, lines[line - 1])
                        lines[line - 1] = lines[line - 1].replace(old, new)
                    self.write(file, "\n".join(lines) + "\n")
            return run("import_husky", self.set, self.out)

        self.refused(spoil("fix.csv", 2, "lat_deg", "latitude"), "test1_fix.csv:2", "no column 'lat_deg'")
        self.refused(spoil("fix.csv", 3, ",42.375812,", ",142.375812,"), "test1_fix.csv:3", "no such place")
        self.refused(spoil("imu_data.csv", 40, ",", ",,"), "test1_imu_data.csv:40", "41 columns, expected 21")
        self.refused(spoil("odom.csv", 40, "14322355", "14322356"), "test1_husky_velocity_controller_odom.csv:41", "goes back by 99.9")


if __name__ == "__main__":
    unittest.main()
