#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""tools/run/build_preset before a cmake that only speaks: what is shown of a long build and of a short one. The Makefile: what each command builds."""
import os
import pty
import re
import shutil
import subprocess
import tempfile
import unittest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))
CMAKE = """#!/bin/bash
[ "$1" = --build ] || { mkdir -p build/host; touch build/host/build.ninja; exit; }
for i in $(seq %d); do echo "[$i/%d] Building a/folder/whose/name/is/longer/than/a/narrow/line/part$i.cpp"; done
%s
"""


class BuildPreset(unittest.TestCase):
    def setUp(self):
        self.tree = tempfile.mkdtemp(prefix="tetap-build-preset.")
        self.addCleanup(shutil.rmtree, self.tree)
        os.makedirs(os.path.join(self.tree, "bin"))
        shutil.copytree(os.path.join(ROOT, "tools", "run"), os.path.join(self.tree, "tools", "run"))
        shutil.copy(os.path.join(ROOT, "CMakePresets.json"), self.tree)

    def build(self, steps, end="exit 0", status=0, terminal=False):
        path = os.path.join(self.tree, "bin", "cmake")
        with open(path, "w", encoding="utf-8") as file:
            file.write(CMAKE % (steps, steps, end))
        os.chmod(path, 0o755)
        ours, theirs = pty.openpty()
        done = subprocess.run(["tools/run/build_preset", "host:one"], cwd=self.tree, env={**os.environ, "PATH": f"{self.tree}/bin:{os.environ['PATH']}", "COLUMNS": "60"},
                              stdout=subprocess.PIPE, stderr=theirs if terminal else subprocess.PIPE, check=False)
        os.close(theirs)
        said = os.read(ours, 100000).decode() if terminal else done.stderr.decode()
        os.close(ours)
        self.assertEqual((done.returncode, done.stdout), (status, b""), said)
        return said

    def test_a_long_build_says_how_far_it_is_about_ten_times(self):
        said = self.build(200).splitlines()
        self.assertIn("for the first time", said[0])
        self.assertEqual(said[1], "build: host [1/200]")
        self.assertEqual(said[-1], "build: host [200/200]")
        self.assertTrue(10 <= len(said) - 1 <= 12, said)
        self.assertTrue(all(re.fullmatch(r"build: host \[\d+/200\]", line) for line in said[1:]), said)

    def test_a_terminal_gets_one_line_that_rewrites_itself(self):
        self.build(1)
        said = self.build(50, terminal=True)
        self.assertNotIn("\n", said)
        self.assertEqual(said.count("\r\033[K"), 51)  # each step, and the end
        self.assertIn("build: host [50/50] Building a/folder", said)
        self.assertLessEqual(max(len(one) for one in said.split("\r\033[K")), 59)

    def test_a_short_build_is_silent_and_a_failed_one_says_why(self):
        self.build(1)
        self.assertEqual(self.build(9), "")
        said = self.build(3, "echo 'part3.cpp:7: error: no such thing'; exit 1", status=1)
        self.assertIn("part3.cpp:7: error: no such thing", said)
        self.assertIn("build: preset host failed; all of it is in build/host.log", said)


class Commands(unittest.TestCase):
    def make(self, *words, status=0):
        environment = {name: value for name, value in os.environ.items() if name not in ("ROBOT", "BOARD", "BUS", "LOG", "MAKEFLAGS", "MAKELEVEL")}
        done = subprocess.run(["make", "-n", *words], cwd=ROOT, env=environment, capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, status, done.stderr)
        return done.stderr if status else re.search(r"build_preset host:(\S+)", done.stdout)[1].split(",")

    def test_each_builds_what_it_needs(self):
        self.assertEqual(self.make("sim"), ["tetap-world", "tetap-doctor", "robot_rover"])
        self.assertEqual(self.make("sim", "BUS=vcan", "ROBOT=rover_landmarks_matched"), ["tetap-world", "tetap-doctor", "robot_rover_landmarks", "tetap-node"])
        for words in (["BOARD=zynqmp_r5"], ["REALTIME=1"]):  # they need a bus
            self.assertIn("tetap-node", self.make("sim", *words))
        self.assertEqual(self.make("replay", "LOG=run.log", "ROBOT=mrclam"), ["tetap-play", "tetap-doctor", "robot_mrclam"])
        self.assertEqual(self.make("doctor", "LOG=run.log"), ["tetap-doctor"])
        self.assertEqual(self.make("doctor", "LOG=run.log", "ROBOT=car"), ["tetap-doctor", "robot_car"])
        self.assertEqual(self.make("record"), ["tetap-record"])
        self.assertEqual(self.make("programs"), ["programs", "robots"])
        self.assertEqual(self.make("programs", "ROBOT=car"), ["programs", "robot_car"])

    def test_an_unknown_robot_is_refused_with_the_list_before_anything_is_built(self):
        for command in ("sim", "replay", "doctor", "programs", "firmware", "board"):
            said = self.make(command, "LOG=run.log", "ROBOT=tank", status=2)
            self.assertRegex(said, r"no robot 'tank'; there are: all_round car .*\brover\b.* rover_matched\b", command)


if __name__ == "__main__":
    unittest.main()
