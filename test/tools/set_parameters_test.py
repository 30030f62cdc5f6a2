#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Parameters without a compiler: --params and --set change what the node runs with, the CRC of its version frame says so, and what is wrong is named
with file and line by every program. No text of the table is in a flash image."""
import json
import math
import os
import re
import subprocess
import tempfile
import unittest

import numpy as np

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))
PROGRAMS = os.environ.get("TETAP_PROGRAMS", os.path.join(ROOT, "build/host/sim_host"))
IMAGE = os.path.join(ROOT, "build/r5/hal/board/tetap-zynqmp_r5-rover.elf")
EST_VERSION = 0x326


def run(program, *options, status=0):
    done = subprocess.run([os.path.join(PROGRAMS, f"tetap-{program}"), *options], capture_output=True, text=True, check=False, timeout=300)
    assert done.returncode == status, (program, options, done.returncode, done.stderr)
    return done.stdout if status == 0 else done.stderr


def table(*options):
    return json.loads(run("params", "--json", *options))


class SetParameters(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def path(self, name, text=None):
        path = os.path.join(self.folder.name, name)
        if text is not None:
            with open(path, "w", encoding="utf-8") as file:
                file.write(text)
        return path

    def world(self, name, *options):
        """run.json and the CRC in the version frames of three seconds of the world."""
        out = self.path(name)
        run("world", "--memory", "--quiet", "--raw", "--duration", "3", "--out", out, *options)
        with open(os.path.join(out, "run.json"), encoding="utf-8") as file:
            about = json.load(file)
        with open(os.path.join(out, "raw.log"), encoding="utf-8") as file:
            data = {bytes.fromhex(line.split("#")[1].split()[0]) for line in file if re.search(r" %03X#" % EST_VERSION, line)}
        self.assertEqual(len(data), 1, "one version frame, again and again")
        return about, int.from_bytes(data.pop()[4:], "little")

    def test_the_node_runs_with_what_is_set_and_its_crc_says_so(self):
        plain, plain_crc = self.world("plain")
        self.assertEqual(plain_crc, table()["crc"])
        self.assertEqual(plain["parameters"], {row["path"]: row["value"] for row in table()["parameters"]})
        self.assertNotIn("set", plain)
        same, same_crc = self.world("same", "--params", self.path("rover.params", run("params")))
        self.assertEqual((same["estimates_sha256"], same_crc), (plain["estimates_sha256"], plain_crc))
        file = self.path("my.params", "# wider\nwheels.drive.track_m = 0.6\ninertial.wheel_mps = 0.1 # rough ground\n")
        options = ("--params", file, "--set", "inertial.wheel_mps=0.2")
        changed, changed_crc = self.world("changed", *options)
        self.assertEqual(changed_crc, table(*options)["crc"])
        self.assertNotEqual(changed_crc, plain_crc)
        self.assertNotEqual(changed["estimates_sha256"], plain["estimates_sha256"])
        different = {path for path, value in changed["parameters"].items() if value != plain["parameters"][path]}
        self.assertEqual(different, {"wheels.drive.track_m", "inertial.wheel_mps"})
        self.assertEqual((changed["parameters"]["wheels.drive.track_m"], changed["parameters"]["inertial.wheel_mps"]), (0.6, 0.2))
        self.assertIn("inertial.wheel_mps 0.2", changed["numbers"])

    def test_a_replay_with_other_parameters_says_so(self):
        self.world("recorded")
        log, out = os.path.join(self.path("recorded"), "raw.log"), self.path("again")
        run("play", log, "--memory", "--robot", "rover", "--quiet", "--out", out)
        said = run("play", log, "--memory", "--robot", "rover", "--quiet", "--out", out, "--set", "inertial.wheel_mps=0.2", status=1)
        self.assertIn("ran with other numbers (Est_Version.Config)", said)

    def test_the_block_of_identifiers_is_a_parameter(self):
        out = self.path("moved")
        run("world", "--memory", "--quiet", "--duration", "1", "--set", "can_base=0x340", "--out", out)
        with open(os.path.join(out, "estimates.log"), encoding="utf-8") as file:
            self.assertTrue(all(0x340 <= int(line.split()[2].split("#")[0], 16) < 0x380 for line in file))

    def test_what_is_wrong_is_named_by_every_program(self):
        file = self.path("wrong.params", "loop.period_us = 10000\n\nwheels.drive.radius = 1\n")
        beyond = self.path("beyond.params", "wheels.drive.track_m = 420\n")
        for program, options in (("params", ()), ("node", ("--boot-line",)), ("world", ("--memory",)), ("play", (__file__, "--memory", "--robot", "rover"))):
            self.assertEqual(run(program, *options, "--params", file, status=2),
                             f"tetap-{program}: {file}:3: no parameter 'wheels.drive.radius' (tetap-params lists them)\n")
            self.assertEqual(run(program, *options, "--params", beyond, status=2),
                             f"tetap-{program}: {beyond}:1: wheels.drive.track_m is 420 m; it has to be from 0 to 10\n")
            self.assertEqual(run(program, *options, "--set", "loop.period_us=10", status=2),
                             f"tetap-{program}: --set loop.period_us=10: loop.period_us is 10 us; it has to be from 1000 to 100000\n")

    def test_every_robot_is_plausible_the_matched_ones_too(self):
        for robot in run("node", "--list-robots").split():
            for row in table("--robot", robot)["parameters"]:
                for value in row["value"] if row["elements"] > 1 else [row["value"]]:
                    slack = 1e-6 * max(abs(row["minimum"]), abs(row["maximum"]))
                    self.assertTrue(row["minimum"] - slack <= value <= row["maximum"] + slack, (robot, row["path"], value))

    def test_the_noise_of_a_data_sheet_is_a_file_of_parameters(self):
        """ICM-42688-P (DS-000347): 2.8 mdps/rtHz, 70 ug/rtHz. White noise of a density N has the Allan deviation N at 1 s (IEEE Std 952)."""
        said = run("params", "--from-datasheet", "gyro-noise=2.8mdps/rtHz", "--from-datasheet", "accel-noise=70 ug/rtHz", "--from-datasheet", "gyro-scale=0.5%")
        value = {line.split(" = ")[0]: float(line.split(" = ")[1].split()[0]) for line in said.splitlines() if not line.startswith("#")}
        self.assertAlmostEqual(value["inertial.gyro_radps_rthz"], math.radians(0.0028), delta=1e-9)
        self.assertAlmostEqual(value["inertial.accel_mps2_rthz"], 70e-6 * 9.80665, delta=1e-8)
        self.assertAlmostEqual(value["inertial.gyro_scale"], 0.005)
        rate = np.random.default_rng(1).normal(0, math.sqrt(value["gyro.noise"] * 100), 400_000).reshape(-1, 100).mean(axis=1)
        allan_dps = math.degrees(math.sqrt(0.5 * np.mean(np.diff(rate) ** 2)))
        self.assertAlmostEqual(allan_dps, 0.0028, delta=0.0002)
        values = {row["path"]: row["value"] for row in table("--params", self.path("imu.params", said))["parameters"]}
        self.assertAlmostEqual(values["gyro.noise"] / value["gyro.noise"], 1, places=5)
        walk = float(run("params", "--from-datasheet", "gyro-instability=5deg/h").splitlines()[1].split(" = ")[1].split()[0])
        # A Markov process of 300 s: its sigma times 0.617 is its largest Allan deviation, at 1.89 of that time.
        self.assertTrue(0.5 < 0.617 * walk * math.sqrt(300 / 2) / math.radians(5 / 3600) < 1.5, walk)

    def test_words_that_no_data_sheet_has_are_named(self):
        for words, reason in (("gyro-noise=2.8furlong", "no unit 'furlong'; there are: rad/s/rtHz dps/rtHz"), ("gyro=1dps", "no such quantity; there are: gyro-noise accel-noise"),
                              ("gyro-noise", "no such quantity"), ("accel-noise=ug/rtHz", "a number above zero"), ("accel-noise=-3ug/rtHz", "a number above zero")):
            said = run("params", "--from-datasheet", words, status=2)
            self.assertEqual(said.count("\n"), 1)
            self.assertIn(f"--from-datasheet {words}: ", said)
            self.assertIn(reason, said)

    def test_the_reference_is_that_of_the_table(self):
        page = run("params", "--markdown")
        for row in table()["parameters"]:
            self.assertIn(f"| `{row['path']}` | 0x{row['index']:03X} | {row['unit']} | ", page)
            self.assertIn(row["text"], page)
        with open(os.path.join(ROOT, "docs/reference/parameters.md"), encoding="utf-8") as file:
            self.assertEqual(file.read(), page, "tetap-params --markdown > docs/reference/parameters.md")

    @unittest.skipUnless(os.path.exists(IMAGE), "no image of the R5")
    def test_no_text_of_the_table_is_in_a_flash_image(self):
        with open(IMAGE, "rb") as file:
            image = file.read()
        self.assertIn(b"tetap: ", image)
        for row in table()["parameters"]:
            for text in (row["text"], row["path"]):
                if len(text) > 8:
                    self.assertNotIn(text.encode(), image)


if __name__ == "__main__":
    unittest.main()
