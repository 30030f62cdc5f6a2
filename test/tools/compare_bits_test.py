#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
# tools/proof/compare_bits with programs that are not what they should be: every way in which a comparison could pass for the wrong reason.
import contextlib
import importlib.machinery
import importlib.util
import io
import json
import os
import subprocess
import sys
import tempfile
import unittest

sys.dont_write_bytecode = True
TOOL = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "tools", "proof", "compare_bits")
SETUP = os.path.join(os.path.dirname(TOOL), "..", "run", "install_packages")


def load():
    loader = importlib.machinery.SourceFileLoader("bits", TOOL)
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader("bits", loader))
    loader.exec_module(module)
    return module


bits = load()
GOOD = "bits: begin short\nbits: sin 00000001\nbits: boot_rover 00000002\nbits: end short\n"


class BitsTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name
        bits.BUILDS = {"one": ("host", {}, None), "two": ("host", {}, None)}
        bits.WHOLE = {"three": ("host", {}, None)}
        bits.REFERENCE, bits.RED, bits.TIMEOUT_S = "one", {"red": ("host", {}, None)}, {"short": 1, "whole": 1}
        self.fetched = 0

        def fetch():
            self.fetched += 1
        bits.fetch = fetch
        bits.build = lambda name: os.path.join(self.folder, name)

    def compare(self, one, two, red=None, after="", three=None):
        for name, text in (("one", one), ("two", two), ("three", three or ""), ("red", red or "")):
            path = os.path.join(self.folder, name)
            with open(path, "w", encoding="utf-8") as file:
                file.write(f"#!/bin/sh\ncat <<'END'\n{text}END\n{after}\n")
            os.chmod(path, 0o755)
        said = io.StringIO()
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(io.StringIO()):
            status = bits.show_red(self.folder) if red else bits.compare("whole" if three else "short", self.folder)
        return status, said.getvalue()

    def test_equal_hashes_pass_and_are_written(self):
        status, said = self.compare(GOOD, GOOD)
        self.assertEqual(status, 0, said)
        self.assertIn("tetap: robot rover, bits 00000002", said)
        with open(os.path.join(self.folder, "bits.json"), encoding="utf-8") as file:
            self.assertEqual(json.load(file)["sin"], {"one": "00000001", "two": "00000001"})

    def test_one_hash_that_differs_fails_by_name(self):
        status, said = self.compare(GOOD, GOOD.replace("00000001", "00000003"))
        self.assertEqual(status, 1)
        self.assertIn("FAIL sin: differs on two", said)

    def test_a_line_missing_on_either_side_fails(self):
        fewer = GOOD.replace("bits: sin 00000001\n", "")
        for one, two in ((GOOD, fewer), (fewer, GOOD)):
            status, said = self.compare(one, two)
            self.assertEqual(status, 1)
            self.assertIn("FAIL sin", said)

    def test_a_program_that_ends_early_is_an_error(self):
        with self.assertRaisesRegex(bits.BitsError, "two: ended before 'bits: end short'"):
            self.compare(GOOD, GOOD.replace("bits: end short\n", ""))

    def test_a_program_that_hangs_is_stopped(self):
        with self.assertRaisesRegex(bits.BitsError, "two: was stopped after 1 s"):
            self.compare(GOOD, GOOD.replace("bits: end short\n", ""), after="exec sleep 60")

    def test_nothing_printed_is_not_equality(self):
        empty = "bits: begin short\nbits: end short\n"
        with self.assertRaisesRegex(bits.BitsError, "printed no hash"):
            self.compare(empty, empty)

    def test_one_name_twice_is_an_error(self):
        with self.assertRaisesRegex(bits.BitsError, "two lines are called sin"):
            self.compare(GOOD, GOOD.replace("bits: boot_rover", "bits: sin"))

    def test_what_comes_after_the_form_is_not_read(self):
        status, said = self.compare(GOOD, GOOD + "bits: begin whole\nbits: sin 00000009\n", after="exec sleep 60")
        self.assertEqual(status, 0, said)

    def test_show_red_fails_when_nothing_turns_red(self):
        self.assertEqual(self.compare(GOOD, GOOD, red=GOOD)[0], 1)
        self.assertEqual(self.compare(GOOD, GOOD, red=GOOD.replace("00000001", "00000003"))[0], 0)

    def test_machines_of_the_whole_form_are_fetched_and_compared_there_alone(self):
        whole = GOOD.replace("short", "whole")
        self.assertEqual(self.compare(whole, whole, three=whole)[0], 0)
        self.assertEqual(self.fetched, 1)
        status, said = self.compare(whole, whole, three=whole.replace("00000001", "00000003"))
        self.assertEqual(status, 1)
        self.assertIn("FAIL sin: differs on three", said)
        self.fetched = 0
        self.assertEqual(self.compare(GOOD, GOOD)[0], 0)
        self.assertEqual(self.fetched, 0, "the short form installs nothing")


class PackagesTest(unittest.TestCase):
    def test_packages_that_are_missing_stop_the_whole_form_before_it_builds(self):
        with tempfile.TemporaryDirectory() as folder:
            asked, setup = os.path.join(folder, "asked"), os.path.join(folder, "run", "install_packages")
            os.mkdir(os.path.dirname(setup))
            with open(setup, "w", encoding="utf-8") as file:
                file.write(f"#!/bin/sh\necho \"$@\" >{asked}\nexit 1\n")
            os.chmod(setup, 0o755)
            fresh = load()
            fresh.TOOLS = folder
            fresh.all_hashes = lambda *_: self.fail("it builds")
            with self.assertRaisesRegex(fresh.BitsError, "packages of aarch64 and riscv64 are missing"):
                fresh.compare("whole", folder)
            with open(asked, encoding="utf-8") as file:
                self.assertEqual(file.read().split(), list(fresh.FETCHED))

    def test_setup_names_what_is_missing_of_the_packages_it_is_given(self):
        done = subprocess.run([SETUP, "--check", "python3", "no-such-package"], capture_output=True, text=True, check=False)
        self.assertEqual((done.returncode, done.stdout, done.stderr), (1, "setup: missing: no-such-package\n", ""))
        self.assertEqual(subprocess.run([SETUP, "--check", "python3"], capture_output=True, check=False).returncode, 0)

    def test_anybody_but_root_is_given_the_one_command(self):
        words = [SETUP, "no-such-package"] if os.getuid() else ["setpriv", "--reuid=65534", "--clear-groups", "sh", SETUP, "no-such-package"]
        done = subprocess.run(words, capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 1)
        self.assertIn("sudo apt-get install -y --no-install-recommends no-such-package\n", done.stderr)


if __name__ == "__main__":
    unittest.main()
