#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""tools/proof/count_constants on sources whose constants were counted by hand."""
import json
import os
import shutil
import subprocess
import tempfile
import unittest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))
TOOL = os.path.join(ROOT, "tools", "proof", "count_constants")
FILES = {
    "src/tetap/estimators/inertial/inertial.hpp": """// 17 things: 3.5
#include "tetap/estimators/inertial/inside.hpp"
#include "tetap/param/parameters.hpp"
/* 99 */ constexpr float kGate = 11.34F, kHalf = 0.5F, kTwo = 2, kBig = 1'000'000;
constexpr auto kText = "88 \\" 77";  constexpr char kSeven = '7';  constexpr int kMask = 0xFF, k3 = -3, kExp = 1e-3;
float f(const Parameters& p) { return p.gnss.floor_m * x1 + v2.y3 + 1.0F + 0x1p-2F; }
""",
    "src/tetap/estimators/inertial/inside.hpp": '#pragma GCC unroll 15\n#include "../../base/math.hpp"\n#include "config/messages.hpp"\n#include <array>\nstd::array<float, 4> a{};\n',
    "src/tetap/base/math.hpp": "constexpr double kPi = 3.14159;\n",
    "src/tetap/param/parameters.hpp": "struct Gnss {\n  float floor_m = 0.25F;  ///< m\n  float unread_m = 7;\n};\nstruct Parameters {\n  Gnss gnss;\n};\n",
    "config/messages.hpp": "// Generated from config/tetap.dbc\nconstexpr int kOffset = 0x123;\n",
    "src/tetap/estimators/other.hpp": "constexpr int kNotReached = 42;\n",
}
# 11.34, 1'000'000, 0xFF, 3, 1e-3, 0x1p-2 (a quarter) in the first, 4 in the second, pi; a parameter that is read.
LITERALS = ["0x1p-2F", "0xFF", "1'000'000", "11.34F", "1e-3", "3", "3.14159", "4"]


class Constants(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.mkdtemp()
        self.addCleanup(shutil.rmtree, self.folder)
        for path, text in FILES.items():
            self.write(path, text)

    def write(self, path, text):
        path = os.path.join(self.folder, path)
        os.makedirs(os.path.dirname(path), exist_ok=True)
        with open(path, "w", encoding="utf-8") as file:
            file.write(text)

    def count(self, *words, status=0):
        out = os.path.join(self.folder, "out", "constants.json")
        done = subprocess.run([TOOL, "--root", self.folder, "--out", out, *words], capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, status, done.stderr)
        self.said = done.stdout + done.stderr
        if status == 0:
            with open(out, encoding="utf-8") as file:
                return json.load(file)
        return None

    def test_the_literals_and_parameters_are_those_counted_by_hand(self):
        found = self.count()
        self.assertEqual(sorted(one["literal"] for one in found["list"] if "literal" in one), sorted(LITERALS))
        self.assertEqual([one["parameter"] for one in found["list"] if "parameter" in one], ["floor_m"])
        self.assertEqual((found["constants"], found["literals"], found["parameters"]), (9, 8, 1))
        self.assertEqual(found["generated"], ["config/messages.hpp"])
        self.assertIn("constants: 9 reachable from src/tetap/estimators/inertial/inertial.hpp: 8 literals", self.said)

    def test_each_stands_with_its_place(self):
        places = {one.get("literal"): (one["file"], one["line"]) for one in self.count()["list"]}
        self.assertEqual(places["11.34F"], ("src/tetap/estimators/inertial/inertial.hpp", 4))
        self.assertEqual(places["4"], ("src/tetap/estimators/inertial/inside.hpp", 5))

    def test_one_more_literal_and_one_more_parameter_read_are_two_more(self):
        self.write("src/tetap/base/math.hpp", FILES["src/tetap/base/math.hpp"] + "inline float g(const Gnss& p) { return p.unread_m * 9.81F; }\n")
        self.assertEqual(self.count()["constants"], 11)

    def test_no_such_header_is_one_line(self):
        self.count("--from", "src/nowhere.hpp", status=1)
        self.assertEqual(self.said, "count_constants: no src/nowhere.hpp\n")

    def test_the_estimator_of_this_repository_is_found(self):
        done = subprocess.run([TOOL, "--out", os.path.join(self.folder, "here.json")], capture_output=True, text=True, check=True)
        self.assertRegex(done.stdout, r"constants: \d{3,4} reachable from src/")


if __name__ == "__main__":
    unittest.main()
