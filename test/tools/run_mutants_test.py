#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""tools/proof/run_mutants: which numbers of a source are constants, and what a program makes of a mutant."""
import importlib.machinery
import importlib.util
import os
import subprocess
import sys
import tempfile
import unittest

sys.dont_write_bytecode = True
ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))
loader = importlib.machinery.SourceFileLoader("run_mutants", os.path.join(ROOT, "tools", "proof", "run_mutants"))
mutants = importlib.util.module_from_spec(importlib.util.spec_from_loader("run_mutants", loader))
loader.exec_module(mutants)

SOURCE = """// 3.5 things
#pragma once
struct Check {
  static constexpr float kGate = 11.25F, kHalf = 0.5F;  ///< 7.5
  static constexpr int kCount = 25;
  static constexpr int kMask = 0xFF;
  constexpr float share(float x) const { return 0.25F * x + 1.0F + 2.0F * x; }
  float p[3] = {};
  float late() const {
    constexpr float kLocal = 0.75F;
    return kLocal + p[2];
  }
};
"""
MAIN = """#include "check.hpp"
#include <cstdio>
constexpr float kFixed = Check{}.share(4.0F);
int main() {
  float x = 4.0F;
  std::printf("%g %g %d %g %g %g", Check::kGate, Check::kHalf, Check::kCount, Check{}.share(x), kFixed, Check{}.late());
}
"""


class Mutants(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.read = os.path.join(self.folder.name, "read")
        self.constants = mutants.constants_of("src/check.hpp", SOURCE)
        for number, one in enumerate(self.constants):
            one.update(number=number, member=one["line"] < 10)

    def run_with(self, *mutant):
        program = os.path.join(self.folder.name, "program")
        if not os.path.exists(program):
            os.makedirs(os.path.join(self.folder.name, "tetap", "base"))
            for name, text in (("check.hpp", mutants.with_table(SOURCE, self.constants)), ("main.cpp", MAIN)):
                with open(os.path.join(self.folder.name, name), "w", encoding="utf-8") as file:
                    file.write(text)
            with open(os.path.join(ROOT, "test", "mutants", "mutated.hpp"), encoding="utf-8") as source, open(os.path.join(self.folder.name, "tetap", "base", "mutated.hpp"), "w", encoding="utf-8") as file:
                file.write(source.read())
            subprocess.run(["clang++", "-std=c++20", "-Wall", "-Werror", "-I.", "main.cpp", "-o", "program"], cwd=self.folder.name, check=True)
        environment = {**os.environ, **({"TETAP_MUTANT": f"{mutant[0]}:{mutant[1]}", "TETAP_MUTANT_READ": self.read} if mutant else {})}
        return subprocess.run([program], capture_output=True, text=True, check=True, env=environment).stdout

    def test_are_the_numbers_that_a_rule_has(self):
        self.assertEqual([one["literal"] for one in self.constants], ["11.25F", "0.5F", "25", "0.25F", "0.75F"])

    def test_change_what_the_program_does_and_nothing_else(self):
        self.assertEqual(self.run_with(), "11.25 0.5 25 10 10 0.75")
        for number, expected in enumerate(("22.5 0.5 25 10 10 0.75", "11.25 1 25 10 10 0.75", "11.25 0.5 50 10 10 0.75", "11.25 0.5 25 11 10 0.75", "11.25 0.5 25 10 10 1.5")):
            self.assertEqual(self.run_with(number, 2), expected)
        self.assertEqual(self.run_with(2, 0.5), "11.25 0.5 12 10 10 0.75")

    def test_know_which_constants_a_program_reads(self):
        self.constants = [one for one in self.constants if one["literal"] != "25"]
        self.run_with(0, 2)
        with open(self.read, encoding="ascii") as file:
            self.assertEqual([int(line) for line in file], [one["number"] for one in self.constants])

    def test_run_the_tests_alone_that_read_the_constant(self):
        program = os.path.join(self.folder.name, "suite")
        with open(program, "w", encoding="ascii") as file:
            file.write('#!/bin/sh\necho "$@" >> "$0.calls"\n')
        os.chmod(program, 0o755)
        reads = {program: {"A.fast": {3, 4}, "B.fast": {5}, **{f"C.long{i}": set(range(4, 9 + i)) for i in range(5)}}}
        groups = mutants.groups_of(reads, 4)
        self.assertEqual(groups, [(program, ["A.fast", "C.long0", "C.long1"]), (program, ["C.long2", "C.long3", "C.long4"])])
        job = {"number": 4, "factor": 2.0, "groups": groups, "most_s": 60}
        self.assertEqual(mutants.judge(job), (False, ""))
        with open(program + ".calls", encoding="ascii") as file:
            self.assertEqual([line.split("--gtest_filter=")[1].strip() for line in file], ["A.fast:C.long0:C.long1", "C.long2:C.long3:C.long4"])
        self.assertEqual(mutants.groups_of(reads, 60), [])
        with open(program, "a", encoding="ascii") as file:
            file.write('case "$@" in *C.long2*) echo "[  FAILED  ] C.long3 (1 ms)"; exit 1;; esac\n')
        self.assertEqual(mutants.judge(job), (True, "C.long3"))


if __name__ == "__main__":
    unittest.main()
