#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The importer of laser scans, on logs written here and on the Intel set where its data is."""
import gzip
import json
import lzma
import os
import struct
import subprocess
import tempfile
import unittest

import numpy as np

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
DATA = os.environ.get("TETAP_DATA", os.path.join(ROOT, "..", "shared", "data"))
INTEL = os.path.join(DATA, "scans", "intel_gfs.json.xz")
FLASER = "FLASER 3 1.0 2.0 81.8 9 9 9 0.5 -0.25 7.0 {} host 0.1\n"
ROBOT = "ROBOTLASER1 0 -1.0 2.0 1.0 81.9 0.01 0 3 1.0 2.0 3.0 1 7 0.1 0 0 4 5 0.5 0.2 0.1 0.3 0.2 1.1 {} host 0.1\n"


class ImportScansTest(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.out = os.path.join(self.folder.name, "out")

    def file(self, name, data):
        path = os.path.join(self.folder.name, name)
        with open(path, "wb") as file:
            file.write(data if isinstance(data, bytes) else data.encode())
        return path

    def imports(self, data, *options):
        return subprocess.run([os.path.join(ROOT, "tools/dataset/import_scans"), self.file("in", data), self.out, *options],
                              capture_output=True, text=True, timeout=60)

    def rows(self, name):
        with open(self.out + name) as file:
            return [[float(word) for word in line.split()] for line in file if not line.startswith("#")]

    def test_a_front_laser_is_imported_with_the_pose_of_the_odometry(self):
        result = self.imports("# comment\nPARAM a b\nODOM 1 2 3\n" + FLASER.format("100.000002") + FLASER.format("100.5"))
        self.assertEqual(result.returncode, 0, result.stderr)
        rows = self.rows(".scans")
        np.testing.assert_allclose(rows[0], [3, -np.pi / 2, np.pi / 2], atol=1e-8)
        np.testing.assert_allclose(rows[1], [1_000_000, 0.5, -0.25, 7 - 2 * np.pi, 200, 400, 0], atol=1e-6)
        self.assertEqual(rows[2][0], 1_499_998)
        with open(self.out + ".json") as file:
            about = json.load(file)
        self.assertEqual((about["scans"], about["dropped"]), (2, {"lines ODOM": 1, "lines PARAM": 1}))

    def test_angles_come_from_the_line_or_from_the_options(self):
        self.assertEqual(self.imports(ROBOT.format("100.0")).returncode, 0)
        self.assertEqual(self.rows(".scans"), [[3, -1, 1], [1_000_000, 4, 5, 0.5, 200, 400, 600]])
        self.assertEqual(self.imports(ROBOT.format("100.0"), "--first", "180", "--step", "-90").returncode, 0)
        np.testing.assert_allclose(self.rows(".scans")[0], [3, np.pi, -np.pi / 2], atol=1e-8)

    def test_packed_json_and_relations(self):
        scan = {"range": [1.0, 2.0, 3.0], "x": 0.1, "y": 0.2, "theta": 0.3}
        packed = lzma.compress(json.dumps({"map": {"10.000000": scan, "11.0": scan}}).encode())
        relations = self.file("rel", "10.0 10.9990 0.5 -0.5 0 0 0 0.25\n10.0 12.0 1 1 0 0 0 0\n")
        result = self.imports(packed, "--relations", relations)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual(self.rows(".relations"), [[0, 1, 0.5, -0.5, 0.25]])
        self.assertIn("left out: 1 relations", result.stdout)

    def test_bad_input_ends_in_one_line_with_its_place(self):
        good = FLASER.format("100.0")
        scan = '"1.0": {"range": [1, 2, 3], "x": 0, "y": 0, "theta": 0}'
        for data, place, words in (
                (good + "FLASER 3 1 2\n", "in:2", "4 columns"), (good + good.replace("FLASER 3", "FLASER x"), "in:2", "number of beams"),
                (good + FLASER.format("99.0"), "in:2", "before the scan before it"), (good.replace("2.0", "nan"), "in:1", "finite"),
                (good + good.replace("-0.25", "left").replace("100.0", "101"), "in:2", "left"), (FLASER.format("noon"), "in:1", "noon"),
                (good + "FLASER 4 1.0 " + FLASER.format("101.0")[9:], "in:2", "4 beams or angles other"), ("ODOM 1 2 3\n", "in", "no scan"),
                ("FLASER 2 1 2 0 0 0 0 0 0 1.0 h 1\n", "in:1", "2 beams"), (ROBOT.format("1.0").replace(" 1 7 ", " 2 7 "), "in:1", "columns"),
                ('{"map": {\n' + scan + ",\n" + scan.replace("1.0", "2.0").replace('"x"', '"z"') + "}}", "in:3", "'x'"),
                ('{"map": {\n' + scan.replace("range", "r") + "}}", "in:2", "range"), ('{"map":\n[1}', "in:2", "not JSON"), ("{}", "in:1", "map"),
                (b"\xfd7zXZ\0broken", "in", "xz")):
            with self.subTest(data=data):
                result = self.imports(data)
                self.assertEqual((result.returncode, result.stderr.count("\n")), (1, 1), result.stderr)
                self.assertIn(place + ":", result.stderr)
                self.assertIn(words, result.stderr)
                self.assertEqual(os.listdir(self.folder.name), ["in"])

    def test_bad_relations_end_in_one_line_with_their_place(self):
        for text, words in (("1 2 3\n", "rel:1: 3 columns"), ("100 101 x 0 0 0 0 0\n", "rel:1: column 3"), ("1 2 0 0 0 0 0 0\n", "no relation")):
            result = self.imports(FLASER.format("100.0"), "--relations", self.file("rel", text))
            self.assertEqual((result.returncode, result.stderr.count("\n")), (1, 1), result.stderr)
            self.assertIn(words, result.stderr)

    @unittest.skipUnless(os.path.exists(INTEL), "scans is not in $TETAP_DATA")
    @staticmethod
    def rawlog(scan_version=6):
        """A rawlog of two scans of three beams, with a step of odometry between them."""
        def named(name, version):
            return bytes([0x80 + len(name)]) + name + bytes([version])

        def scan(time_s, *ranges):
            pose = named(b"CPose3D", 2) + struct.pack("<7d", 0.2, -0.1, 0.5, 0.5 ** 0.5, 0, 0, 0.5 ** 0.5) + b"\x88"  # turned by 90 deg
            return (named(b"CSensoryFrame", 2) + named(b"CObservation2DRangeScan", scan_version) + struct.pack("<f?f", np.pi, True, 30) + pose
                    + struct.pack("<I3f3B", 3, *ranges, 1, 1, 0) + struct.pack("<fQ", 0.01, (11_644_473_600 + time_s) * 10_000_000) + b"\x88\x88")
        step = (named(b"CActionCollection", 0) + named(b"CActionRobotMovement2D", 6) + struct.pack("<I", 0) + named(b"CPose2D", 1)
                + struct.pack("<3d", 1, 0.5, 0.25) + b"\x88\x88\x88")
        return scan(100, 1, 31, 2) + step + scan(101, 1, 2, 3)

    def test_a_rawlog_brings_its_odometry_mounting_and_truth(self):
        truth = self.file("truth", "100.0 0 0 0\n101.0 1 2 0.5\n102.0 9 9 9\n")
        result = self.imports(gzip.compress(self.rawlog()), "--truth", truth)
        self.assertEqual(result.returncode, 0, result.stderr)
        rows = self.rows(".scans")
        np.testing.assert_allclose(rows[0], [3, -np.pi / 2, np.pi / 2], atol=1e-6)
        np.testing.assert_allclose(rows[1], [1_000_000, 0, 0, 0, 200, 0, 0], atol=1e-6)
        np.testing.assert_allclose(rows[2], [2_000_000, 1, 0.5, 0.25, 200, 400, 0], atol=1e-6)
        self.assertEqual(self.rows(".truth"), [[0, 0, 0], [1, 2, 0.5]])
        with open(self.out + ".json") as file:
            about = json.load(file)
        np.testing.assert_allclose(about["scanner_b"], [0.2, -0.1, np.pi / 2], atol=1e-6)
        self.assertEqual(about["dropped"], {"true poses without a scan": 1})

    def test_a_bad_rawlog_ends_in_one_line(self):
        whole = self.rawlog()
        for data, words in ((gzip.compress(whole)[:-9], "not unpacked by gzip"), (gzip.compress(whole[:-20]), "ends within an object"),
                            (gzip.compress(self.rawlog(7)), "no CObservation2DRangeScan of version 6"), (gzip.compress(b"x"), "no scan in it")):
            result = self.imports(data)
            self.assertEqual(result.returncode, 1)
            self.assertIn(words, result.stderr)
            self.assertEqual(result.stderr.count("\n"), 1, result.stderr)
        result = self.imports(gzip.compress(whole), "--truth", self.file("truth", "100.0 0 0 0\n"))
        self.assertIn("1 poses for 2 scans", result.stderr)

    def test_the_intel_set_is_the_packed_file(self):
        with open(INTEL, "rb") as file:
            data = file.read()
        self.assertEqual(self.imports(data).returncode, 0)
        entries = sorted(json.loads(lzma.decompress(data))["map"].items(), key=lambda entry: float(entry[0]))
        rows = self.rows(".scans")[1:]
        self.assertEqual((len(rows), len(entries)), (910, 910))
        for (time, entry), row in zip(entries, rows):
            np.testing.assert_allclose(row[1:3], [entry["x"], entry["y"]], atol=1e-6)
            ranges = np.array(entry["range"])
            np.testing.assert_allclose(np.array(row[4:])[ranges < 40.9] * 0.005, ranges[ranges < 40.9], atol=1e-9, err_msg=time)


if __name__ == "__main__":
    unittest.main()
