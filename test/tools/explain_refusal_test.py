#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""A number that makes no sense, or a field that is misspelt, is one line of what and where, whichever compiler refuses it."""
import os
import subprocess
import tempfile
import unittest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))
COMPILERS = ("g++", "clang++")
ROBOT = """#pragma once
#include "param/limits.hpp"
inline constexpr tetap::param::Parameters parameters = tetap::param::checked({
    .gnss = {%s},
});
%s"""


class RefusedNumbers(unittest.TestCase):
    def said(self, compiler, gnss, beside=""):
        with tempfile.TemporaryDirectory() as folder:
            os.mkdir(os.path.join(folder, "config"))
            with open(os.path.join(folder, "config/robot.hpp"), "w", encoding="utf-8") as file:
                file.write(ROBOT % (gnss, beside))
            log = os.path.join(folder, "log")
            with open(log, "w", encoding="utf-8") as file:
                subprocess.run([compiler, "-std=c++20", "-fsyntax-only", f"-I{folder}", f"-I{ROOT}/src", "-isystem", "/usr/include/eigen3", "-x", "c++", "-"],
                               input='#include "config/robot.hpp"\n', text=True, stderr=file, check=False)
            found = subprocess.run([os.path.join(ROOT, "tools/run/explain_refusal"), log], capture_output=True, text=True, check=False)
            self.assertEqual(found.returncode == 0, found.stdout != "")
            return found.stdout

    def test_a_number_that_makes_no_sense_is_named(self):
        for compiler, wrong in (("g++", "-0.3F"), ("clang++", "0.0F"), ("g++", '__builtin_nanf("")')):
            self.assertEqual(self.said(compiler, f".sigma_floor_m = {wrong}"), "config/robot.hpp: gnss.sigma_floor_m: above 0\n", (compiler, wrong))

    def test_a_misspelt_field_is_told_by_its_robot(self):
        self.assertRegex(self.said("g++", ".sigma_flour_m = 0.3F"), r"^config/robot\.hpp:3: a field here is misspelt.*\n$")
        self.assertRegex(self.said("clang++", ".sigma_flour_m = 0.3F"), r"^config/robot\.hpp:4: field designator 'sigma_flour_m' .*\n$")

    def test_other_errors_are_left_to_the_compiler(self):
        for compiler in COMPILERS:
            self.assertEqual(self.said(compiler, ".sigma_floor_m = 0.3F", "int f() { return no_such_name; }"), "", compiler)


if __name__ == "__main__":
    unittest.main()
