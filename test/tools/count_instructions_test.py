#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
# tools/proof/count_instructions against code whose instructions are known, and its budgets in both directions.
import json
import os
import sys
import unittest

sys.dont_write_bytecode = True
sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from small_image import ImageTest  # noqa: E402

# loop3 is 3 n + 1 instructions; two more around it: the argument and the call.
PROGRAM = """
#include "test/count/markers.hpp"
#include <initializer_list>
using tetap::count::Region;
struct inner;  // used twice below: one workload
extern "C" [[gnu::noinline, gnu::naked]] void loop3(unsigned) { asm volatile("1: nop\\n subs r0,#1\\n bne 1b\\n bx lr"); }
void work() {
  tetap::count::calibrate();
  for (unsigned n : {1U, 10U, 100U, 1000U}) {
    const Region<struct loop> region;
    loop3(n);
  }
  { const Region<struct nothing> region; }
  {
    const Region<struct outer> region;
    { const Region<struct inner> one; loop3(5); }
    { const Region<struct inner> two; loop3(5); }
  }
  tetap::count::finish();
}
"""


class CountTest(ImageTest):
    def count(self, *arguments, budgets=None):
        path = self.path("budgets.json")
        if budgets is not None:
            self.path("budgets.json", json.dumps({"instructions": budgets}))
        elif not os.path.exists(path):
            self.path("budgets.json", json.dumps({"instructions": {"tolerance": 0.02}, "stack_bytes": {"x": 1}}))
        return self.run_tool("count_instructions", "--budgets", path, *arguments)

    def test_counts_are_exact_on_every_core_and_the_markers_cost_nothing(self):
        images = [f"{core}={self.image(PROGRAM.replace('subs r0', 'subs r0,r0') if core == 'r5' else PROGRAM, core)}" for core in ("m7", "m4f", "r5")]
        status, text = self.count("--update", *images)
        self.assertEqual(status, 0, text)
        for core, found in self.json("count.json").items():
            with self.subTest(core):
                self.assertEqual(found["loop"], 3 * 1000 + 1 + 2)
                self.assertEqual(found["loop_mean"], round(sum(3 * n + 3 for n in (1, 10, 100, 1000)) / 4, 1))
                self.assertEqual(found["nothing"], 0)
                self.assertEqual(found["inner"], 18)
                self.assertEqual(found["inner_mean"], 18)
                self.assertEqual(found["outer"], 36)
                self.assertNotIn("outer_mean", found)

    def test_an_operation_more_for_each_multiply_accumulate(self):
        accumulated = PROGRAM.replace("loop3(n);", 'loop3(n);\n    asm volatile("vmla.f32 s0, s0, s0\\n vmls.f32 s0, s0, s0\\n vmul.f32 s0, s0, s0" ::: "s0");')
        self.assertNotEqual(accumulated, PROGRAM)
        status, text = self.count("--update", f"m7={self.image(accumulated)}")
        self.assertEqual(status, 0, text)
        found = self.json("count.json")["m7"]
        self.assertEqual(found["loop"], 3003 + 3)
        self.assertEqual(found["loop_operations"], 3003 + 3 + 2)
        self.assertEqual(found["inner_operations"], found["inner"])
        self.assertEqual(found["outer_operations"], found["outer"])

    def test_two_runs_give_the_same_numbers(self):
        elf = self.image(PROGRAM)
        self.assertEqual(self.count("--update", f"m7={elf}")[0], 0)
        first = self.json("count.json")
        self.assertEqual(self.count("--strict", f"m7={elf}")[0], 0)
        self.assertEqual(self.json("count.json"), first)

    def test_budgets_hold_in_both_directions(self):
        elf = self.image(PROGRAM)
        exact = {"loop": 3003, "loop_mean": 836.2, "nothing": 0, "inner": 18, "inner_mean": 18, "outer": 36}
        for figures, arguments, status, message in (
                (exact, [], 0, "ok"),
                (dict(exact, loop=2945), [], 0, "ok +2.0%"),
                (dict(exact, loop=2940), [], 1, "FAIL m7 loop: 3003 instructions, 63 above the budget of 2940"),
                (dict(exact, loop=3100), [], 0, "lower the budget: -3.1%"),
                (dict(exact, loop=3100), ["--strict"], 1, "the budget of 3100 is too high"),
                (dict(exact, loop_mean=800), [], 1, "FAIL m7 loop_mean"),
                (dict(exact, gone=5), [], 1, "m7 gone: has a budget but was not run"),
                ({k: v for k, v in exact.items() if k != "outer"}, [], 1, "no budget in tools/budgets.json for outer")):
            with self.subTest(message):
                found, text = self.count(*arguments, f"m7={elf}", budgets={"tolerance": 0.02, "m7": figures})
                self.assertEqual(found, status, text)
                self.assertIn(message, text)

    def test_a_limit_holds_whatever_the_tolerance_and_update_does_not_go_beyond_it(self):
        elf = self.image(PROGRAM)
        exact = {"loop": 3003, "loop_mean": 836.2, "nothing": 0, "inner": 18, "inner_mean": 18, "outer": 36}
        for limit, arguments, status, message in (
                ({"loop": 3003}, [], 0, "3 003   3 003  3 003  ok"),
                ({"loop": 3002}, [], 1, "FAIL m7 loop: 3003 instructions, above its limit of 3002"),
                ({"loop_mean": 836}, [], 1, "FAIL m7 loop_mean: 836.2 instructions, above its limit of 836"),
                ({"gone": 5}, [], 1, "m7 gone: has a limit but was not run"),
                ({"loop": 3002}, ["--update"], 2, "is not written: m7 loop: 3003 instructions, above its limit of 3002")):
            with self.subTest(message):
                budgets = {"tolerance": 0.02, "limit": {"m7": limit, "r5": {"loop": 1}}, "m7": exact}
                found, text = self.count(*arguments, f"m7={elf}", budgets=budgets)
                self.assertEqual(found, status, text)
                self.assertIn(message, text)
                self.assertEqual(self.json("budgets.json")["instructions"], budgets)

    def test_update_keeps_the_other_budgets(self):
        elf = self.image(PROGRAM)
        self.count(f"m7={elf}", budgets={"tolerance": 0.02, "limit": {"m7": {"loop": 5000}}, "m4f": {"kept": 7}, "m7": {"old": 1}})
        self.assertEqual(self.count("--update", f"m7={elf}")[0], 0)
        budgets = self.json("budgets.json")["instructions"]
        self.assertEqual(budgets["m4f"], {"kept": 7})
        self.assertEqual(budgets["limit"], {"m7": {"loop": 5000}})
        self.assertNotIn("old", budgets["m7"])
        self.assertEqual(budgets["m7"]["loop"], 3003)

    def test_the_deepest_stack_write_is_found(self):
        program = PROGRAM.replace("tetap::count::finish();",
                                  "volatile int array[500]; array[0] = 1; array[499] = 2; tetap::count::finish();")
        status, text = self.count("--update", "--stack", f"m7={self.image(program)}")
        self.assertEqual(status, 0, text)
        used = int(text.split("deepest stack write ")[1].split()[0])
        self.assertTrue(2000 <= used < 2100, text)

    def test_what_is_wrong_with_an_image_is_said(self):
        begin, end = "tetap::count::begin<struct a>();", "tetap::count::end<struct a>();"
        head = '#include "test/count/markers.hpp"\nvoid work() { tetap::count::calibrate(); %s tetap::count::finish(); }'
        for program, message in (
                ("void work() {}", "has no tetap::count::finish()"),
                ('#include "test/count/markers.hpp"\nvoid work() { tetap::count::finish(); }', "does not call tetap::count::calibrate()"),
                (head % begin, "workload a has no end"),
                (head % (begin + begin + end), "a begins twice without an end"),
                (head % (end + begin + end), "a ends without a begin"),
                (head % (begin + end + begin), "a never ends"),
                (head % "{ struct a; tetap::count::Region<a> r; } { struct a; tetap::count::Region<a> r; }", "two workloads are called a"),
                (head % 'asm volatile("b tetap_vector");', "took longer than 2 s")):
            with self.subTest(message):
                status, text = self.count("--timeout", "2", f"m7={self.image(program)}")
                self.assertEqual(status, 2, text)
                self.assertIn(message, text)
        for arguments, message in ((["m8=x.elf"], "expected BOARD=IMAGE"), (["m7=/nowhere.elf"], "No such file"), (["--all", "--cores", "m7,m8"], "--cores: no core 'm8'; there are: m7, m4f, r5"),
                                   (["r5=" + self.image(PROGRAM, "m7"), "--", "argument"], "takes no arguments")):
            status, text = self.count(*arguments)
            self.assertEqual(status, 2)
            self.assertIn(message, text)


if __name__ == "__main__":
    unittest.main()
