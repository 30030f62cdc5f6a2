#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""A robot and a board of one's own, made with the lines of the README in a copy of the tree: CMake takes them, `make firmware` proves the image,
a file that was not renamed is told in one sentence. In the whole form (form=whole) both are built, and the image's robot is the program's."""
import os
import re
import shutil
import subprocess
import tempfile
import unittest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))
WHOLE = os.environ.get("form") == "whole"


class YourOwn(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.tree = os.path.join(self.folder.name, "tetap")
        shutil.copytree(ROOT, self.tree, ignore=lambda folder, _: {"build", "out", ".git"} if folder == ROOT else ())
        with open(os.path.join(ROOT, "README.md"), encoding="utf-8") as file:
            self.section = re.search(r"\n## Make it yours\n(.*?)\n### ", file.read(), re.S)[1]

    def run_here(self, *command, status=0):
        environment = {name: value for name, value in os.environ.items() if name not in ("TETAP_PROGRAMS", "MAKEFLAGS", "MAKELEVEL")}
        done = subprocess.run(command, cwd=self.tree, env=environment, capture_output=True, text=True)
        self.assertEqual(done.returncode, status, done.stdout[-3000:] + done.stderr[-3000:])
        return done.stdout + done.stderr

    def make(self, what):
        """The README's lines that make a copy, of a robot or of a board."""
        lines = re.findall(rf"^ +(cp .*{what}.*)$", self.section, re.M)
        self.assertEqual(len(lines), 1, what)
        self.run_here("bash", "-c", lines[0])

    def robots(self):
        with open(os.path.join(self.tree, "build/host/sim_host/generated/configured_robots.hpp"), encoding="utf-8") as file:
            return re.search(r'kConfiguredRobots = "(.*)"', file.read())[1].split()

    def test_a_robot_is_a_file_in_config(self):
        self.make("config/mine.hpp")
        self.run_here("cmake", "--preset", "host")
        self.assertIn("mine", self.robots())
        self.assertIn(" mine ", self.run_here("make", "help"))
        if WHOLE:
            self.run_here("tools/build", "host:tetap-node")
            self.assertIn("mine", self.run_here("build/host/sim_host/tetap-node", "--list-robots").split())

    def test_a_copy_with_the_name_of_another_is_told(self):
        shutil.copy(os.path.join(self.tree, "config/rover.hpp"), os.path.join(self.tree, "config/mine.hpp"))
        said = self.run_here("tools/build", "host", status=1)
        self.assertRegex(" ".join(said.split()), "config/mine.hpp: its namespace has to be tetap::robot::mine, as the file is named")
        self.assertLess(len(said.splitlines()), 7)

    def test_a_board_is_a_folder_and_a_preset(self):
        self.make("config/mine.hpp")
        self.make("hal/port/myboard")
        preset = re.search(r'^ +(\{ "name": "myboard".*\}),?$', self.section, re.M)[1]
        presets = os.path.join(self.tree, "CMakePresets.json")
        with open(presets, encoding="utf-8") as file:
            text = file.read()
        with open(presets, "w", encoding="utf-8") as file:
            file.write(text.replace('    { "name": "m7"', f'    {preset},\n    {{ "name": "m7"', 1))
        self.run_here("cmake", "--preset", "myboard")
        targets = self.run_here("cmake", "--build", "build/myboard", "--target", "help")
        self.assertIn("tetap-myboard-mine:", targets)
        if WHOLE:
            said = self.run_here("make", "firmware", "BOARD=myboard", "ROBOT=mine")
            self.assertRegex(said, "tetap-myboard-mine: ok, .* symbols")  # no heap
            self.assertRegex(said, "tetap-myboard-mine: bound [0-9]+ of ")

    def test_a_board_without_a_folder_is_told(self):
        said = self.run_here("cmake", "--preset", "r5", "-DTETAP_BOARD=arduino", status=1)
        self.assertRegex(" ".join(said.split()), "TETAP_BOARD is 'arduino': there is no hal/port/arduino with a link.ld")


if __name__ == "__main__":
    unittest.main()
