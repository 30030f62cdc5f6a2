#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""A robot and a board of one's own, made with the lines of docs/tutorial/your_robot.md in a copy of the tree (under names that nobody's tree has): CMake takes them,
and what is named wrongly is told in one sentence. In the whole form (form=whole) its `make` lines run, too: the robot drives in the simulated
world, `make firmware` proves its image, and in the emulator that says at boot what the program says."""
import json
import os
import re
import shutil
import subprocess
import tempfile
import unittest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))
WHOLE = os.environ.get("form") == "whole"
ROBOT, BOARD = "robot9_of_test", "board9_of_test"


class YourOwn(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.tree = os.path.join(self.folder.name, "tetap")
        shutil.copytree(ROOT, self.tree, symlinks=True, ignore=lambda folder, _: {"build", "out", ".git"} if folder == ROOT else ())
        with open(os.path.join(ROOT, "docs/tutorial/your_robot.md"), encoding="utf-8") as file:
            section = file.read()
        self.section = re.sub(r"\bmyboard\b", BOARD, re.sub(r"\bmine\b", ROBOT, section))

    def run_here(self, *command, status=0):
        environment = {name: value for name, value in os.environ.items() if name not in ("TETAP_PROGRAMS", "MAKEFLAGS", "MAKELEVEL")}
        done = subprocess.run(command, cwd=self.tree, env=environment, capture_output=True, text=True)
        self.assertEqual(done.returncode, status, done.stdout[-3000:] + done.stderr[-3000:])
        return done.stdout + done.stderr

    def line(self, pattern):
        """The one line of the page that is like this."""
        lines = re.findall(rf"^({pattern}),?$", self.section, re.M)
        self.assertEqual(len(lines), 1, pattern)
        return lines[0]

    def copy(self, what):
        self.run_here("bash", "-c", self.line(f"cp .*{what}.*"))

    def robots(self):
        with open(os.path.join(self.tree, "build/host/sim_host/generated/configured_robots.hpp"), encoding="utf-8") as file:
            return re.search(r'kConfiguredRobots = "(.*)"', file.read())[1].split()

    def test_a_robot_is_a_file_in_config(self):
        self.run_here("bash", "-c", self.line("for at in config.*"))
        self.run_here("cmake", "--preset", "host")
        self.assertIn(ROBOT, self.robots())
        self.assertIn(f" {ROBOT} ", self.run_here("make", "help"))
        sim = self.line(f"make sim .*ROBOT={ROBOT}.*")
        if WHOLE:
            said = self.run_here("bash", "-c", f"{sim} BUS=memory WORLD='--duration 20' REPORT=--no-pictures")
            self.assertIn(f"robot {ROBOT} on", said)

    def test_a_copy_with_the_name_of_another_is_told(self):
        shutil.copy(os.path.join(self.tree, "config/rover.hpp"), os.path.join(self.tree, f"config/{ROBOT}.hpp"))
        said = self.run_here("tools/run/build_preset", "host", status=1)
        self.assertIn(f"config/{ROBOT}.hpp: a robot's file has one line 'namespace tetap::robot::{ROBOT} {{', as the file is named", " ".join(said.split()))
        self.assertLess(len(said.splitlines()), 7)

    def test_a_name_that_no_namespace_can_have_is_told(self):
        shutil.copy(os.path.join(self.tree, "config/rover.hpp"), os.path.join(self.tree, "config/rover.old.hpp"))
        self.assertIn("config/rover.old.hpp: a robot's name has letters", " ".join(self.run_here("tools/run/build_preset", "host", status=1).split()))

    def test_a_board_is_a_folder_and_a_preset(self):
        self.run_here("bash", "-c", self.line("for at in config.*"))
        self.copy(f"hal/board/{BOARD}")
        self.assertEqual("", self.run_here("grep", "-r", "ark_cannode", f"hal/board/{BOARD}", status=1))
        preset = self.line(rf'\{{ "name": "{BOARD}".*\}}')
        presets = os.path.join(self.tree, "CMakePresets.json")
        with open(presets, encoding="utf-8") as file:
            text = file.read()
        with open(presets, "w", encoding="utf-8") as file:
            file.write(text.replace('    { "name": "m7"', f'    {preset},\n    {{ "name": "m7"', 1))
        self.run_here("cmake", "--preset", BOARD)
        self.assertIn(f"tetap-{BOARD}-{ROBOT}:", self.run_here("cmake", "--build", f"build/{BOARD}", "--target", "help"))
        # Its flags are made at the first configure: another core in that folder is refused.
        said = self.run_here("cmake", "--preset", BOARD, "-DTETAP_CORE=m7", status=1)
        self.assertIn("was configured for core m4f, the preset says m7", " ".join(said.split()))
        self.run_here("cmake", "--preset", BOARD, "-DTETAP_CORE=m4f")
        budgets = os.path.join(self.tree, "tools/budgets.json")
        with open(budgets, encoding="utf-8") as file:
            limits = json.load(file)
        limits["size_bytes"] = {f"tetap-{BOARD}*": limits["size_bytes"]["tetap-ark_cannode*"], **limits["size_bytes"]}  # the first name that fits counts
        with open(budgets, "w", encoding="utf-8") as file:
            json.dump(limits, file)
        firmware = self.line(f"make firmware .*BOARD={BOARD}.*")
        if WHOLE:
            said = self.run_here("bash", "-c", firmware)
            self.assertRegex(said, f"tetap-{BOARD}-{ROBOT}: ok, .* symbols")  # no heap
            self.assertRegex(said, f"tetap-{BOARD}-{ROBOT}: bound [0-9]+ of ")
            self.run_here("tools/run/build_preset", "host:tetap-node,tetap-board")
            boot = self.run_here("build/host/sim_host/tetap-node", "--boot-line", "--robot", ROBOT).strip()
            image = f"build/{BOARD}/hal/board/tetap-{BOARD}-{ROBOT}.elf"
            self.assertIn(boot, self.run_here("build/host/sim_host/emulator/tetap-board", "--seconds", "3", image).splitlines())

    def test_a_list_of_presets_that_is_none_is_told(self):
        with open(os.path.join(self.tree, "CMakePresets.json"), "a", encoding="utf-8") as file:
            file.write(",")
        said = self.run_here("env", "BOARD=zynqmp_r5", "tools/run/build_firmware", status=2)
        self.assertRegex(said, r"\Afirmware: CMakePresets.json: .*line [0-9]+.*\n\Z")

    def test_a_board_without_a_folder_is_told(self):
        said = self.run_here("cmake", "--preset", "r5", "-DTETAP_BOARD=arduino", status=1)
        self.assertIn("TETAP_BOARD is 'arduino': there is no hal/board/arduino with a link.ld", " ".join(said.split()))

    def test_a_core_that_is_not_its_board_s_is_told(self):
        said = self.run_here("cmake", "--preset", "m7", "-DTETAP_CORE=m4f", status=1)
        self.assertIn("TETAP_BOARD is 'mps2_m7', but TETAP_CORE is 'm4f'", " ".join(said.split()))


if __name__ == "__main__":
    unittest.main()
