#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""test/drivers/seeded_bugs: what it says of a bug that is caught, survives, does not compile or hangs, and of a table that does not fit."""
import contextlib
import importlib.machinery
import importlib.util
import io
import os
import sys
import tempfile
import unittest

sys.dont_write_bytecode = True
ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))
LOADER = importlib.machinery.SourceFileLoader("seeded_bugs", os.path.join(ROOT, "test", "drivers", "seeded_bugs"))
seeded_bugs = importlib.util.module_from_spec(importlib.util.spec_from_loader("seeded_bugs", LOADER))
LOADER.exec_module(seeded_bugs)

OLD = "    for (std::size_t i = 0; i < 3; ++i) {\n      v_b[i] ="
TEST = """#include "drivers/imu/mounting.hpp"
#include <gtest/gtest.h>
TEST(Small, Turns) {
  const tetap::drivers::Mounting mounting{};
  EXPECT_EQ(mounting.to_body({1, 2, 3})[1], 2.0F);
}
"""


def bug(name, new, old=OLD, file="drivers/imu/mounting.hpp"):
    lines = [f"== {name}", "What was done wrong.", file] + ["-" + line for line in old.split("\n")] + ["+" + line for line in new.split("\n")]
    return "\n".join(lines) + "\n\n"


class SeededBugs(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        work = tempfile.TemporaryDirectory()
        cls.addClassCleanup(work.cleanup)
        seeded_bugs.WORK, seeded_bugs.COMMON = work.name, ["gtest/gtest.h"]
        seeded_bugs.prepare()
        seeded_bugs.prepare = lambda: None  # once is enough

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name
        self.test = os.path.join(self.folder, "small_test.cpp")
        self.write(self.test, TEST)
        for name, value in (("TABLES", self.folder), ("LEAST", 1), ("PATIENCE_S", 3)):
            self.addCleanup(setattr, seeded_bugs, name, getattr(seeded_bugs, name))
            setattr(seeded_bugs, name, value)

    @staticmethod
    def write(path, text):
        with open(path, "w", encoding="utf-8") as out:
            out.write(text)

    def run_on(self, *bugs, args=(), head=None):
        self.write(os.path.join(self.folder, "small.bugs"), (head or f"# a remark\ntests: {self.test}\n\n") + "".join(bugs))
        out, err = io.StringIO(), io.StringIO()
        before, sys.argv = sys.argv, ["seeded_bugs", *args]
        try:
            with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
                status = seeded_bugs.main()
        finally:
            sys.argv = before
        return status, out.getvalue(), err.getvalue()

    def test_each_outcome_has_its_words(self):
        status, out, _ = self.run_on(bug("wrong", OLD.replace("v_b[i] =", "v_b[0] =")), bug("harmless", OLD.replace("i < 3", "i <= 2")),
                                     bug("broken", OLD.replace("v_b", "v_c")), bug("endless", OLD.replace("++i", "i += 0")))
        self.assertEqual(status, 1)
        lines = {line.split()[1]: line for line in out.splitlines() if line.startswith("  small")}
        self.assertRegex(lines["wrong"], r" Small\.Turns$")
        self.assertIn("SURVIVED: What was done wrong.", lines["harmless"])
        self.assertIn("does not compile: drivers/imu/mounting.hpp:", lines["broken"])
        self.assertRegex(lines["endless"], r" Small\.Turns \(did not end in 3 s\)")
        self.assertIn("4 bugs, 2 caught, 2 not", out)

    def test_all_caught_is_status_0_and_tests_that_fail_anyway_prove_nothing(self):
        wrong = bug("wrong", OLD.replace("v_b[i] =", "v_b[0] ="))
        self.assertEqual(self.run_on(wrong)[0], 0)
        self.write(self.test, TEST.replace("2.0F", "7.0F"))
        status, out, err = self.run_on(wrong)
        self.assertEqual((status, out), (1, ""))
        self.assertIn("without any bug", err)
        self.assertIn("Small.Turns", err)

    def test_a_test_that_does_not_count_does_not(self):
        head = f"tests: {self.test}\nwithout: Small.Turns\n\n"
        self.assertIn("SURVIVED", self.run_on(bug("wrong", OLD.replace("v_b[i] =", "v_b[0] =")), head=head)[1])

    def test_a_table_that_does_not_fit_the_sources_is_an_error_of_its_own(self):
        good = bug("good", "x")
        for bugs, words in (((good, bug("gone", "x", old="no such line")), "gone: the text occurs 0 times in drivers/imu/mounting.hpp, not once: no such"),
                            ((bug("many", "x", old="std::size_t"),), "many: the text occurs"),
                            ((bug("same", OLD),), "same: nothing is changed"),
                            ((bug("lost", "x", file="drivers/imu/no_such.hpp"),), "drivers/imu/no_such.hpp: No such file"),
                            ((good, good), "two bugs are called good"),
                            ((good, "== bare\nWords.\n\n"), "bare: wants words, a file"),
                            ((good.replace("+x", "*x"),), "not a line of a table: *x")):
            status, out, err = self.run_on(*bugs, args=["--texts"])
            self.assertEqual((status, out), (2, ""), words)
            self.assertIn(words, err)
            self.assertEqual(len(err.splitlines()), 1)
        self.assertIn("no table 'big'; there are: small", self.run_on(good, args=["big"])[2])
        self.assertIn("no bug 'bad'", self.run_on(good, args=["small:bad"])[2])
        seeded_bugs.LEAST = 10
        self.assertIn("1 bugs, 10 are the least", self.run_on(good, args=["--texts"])[2])
        self.assertIn("no test file", self.run_on(*(bug(f"b{i}", "x") for i in range(10)), head="tests: test/none.cpp\n", args=["--texts"])[2])

    def test_the_repositorys_tables_fit(self):
        seeded_bugs.TABLES, seeded_bugs.LEAST = os.path.join(ROOT, "test", "drivers", "bugs"), 10
        status, out, err = self.run_on(bug("good", "x"), args=["--texts"])
        self.assertEqual((status, err), (0, ""))
        for table in ("encoder", "gnss", "icm42688"):
            self.assertRegex(out, rf"{table}: \d\d bugs")


if __name__ == "__main__":
    unittest.main()
