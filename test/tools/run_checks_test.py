#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""tools/proof/run_checks: what is run again and what is not, by a table of small steps; which failures are judged on a busy machine."""
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))
TOOL = os.path.join(ROOT, "tools", "proof", "run_checks")
sys.dont_write_bytecode = True
sys.path.insert(0, os.path.join(ROOT, "tools", "python"))
from tetap.proof import checks, stamps  # noqa: E402
from tetap.proof.steps import Table, TableError  # noqa: E402

IDENTITY = ("test/replay/r5_identity.sh", "test/replay/free_run.sh", "test/replay/host_identity.sh")


def differs(log):
    return checks.bytes_differ(log)


def said_by_cmp(a, b):
    with tempfile.TemporaryDirectory() as folder:
        for name, content in (("a", a), ("b", b)):
            with open(os.path.join(folder, name), "w", encoding="utf-8") as file:
                file.write(content)
        done = subprocess.run(["cmp", "a", "b"], cwd=folder, capture_output=True, text=True, check=False)
    return done.stdout + done.stderr


def source(path):
    with open(os.path.join(ROOT, path), encoding="utf-8") as file:
        return file.read()


class Retry(unittest.TestCase):
    def test_what_cmp_says_is_never_tried_again(self):
        for a, b in (("one\ntwo\n", "one\nTwo\n"), ("one\ntwo\n", "one\n"), ("one\n", "one\ntwo\n"), ("one\n", "")):
            self.assertTrue(differs("provide_vcan: user-mode-linux\n" + said_by_cmp(a, b)), said_by_cmp(a, b))

    def test_every_verdict_of_the_identity_tests_is_never_tried_again(self):
        verdicts = set()
        for path in IDENTITY:
            text = source(path)
            verdicts |= {v.strip('"') for v in re.findall(r'verdict=("[^"]*"|\w+)', text)} - {"equal"}
            verdicts |= set(re.findall(r'echo "(  one flipped bit[^"]* leaves [^"]*|the desk replay [^"]*)"', text))
            verdicts |= set(re.findall(r'"(the run is the same [^"]*)"', text))
        self.assertGreaterEqual(len(verdicts), 8, verdicts)
        for verdict in verdicts:
            self.assertTrue(differs(f"  mrclam1_mrclam         2000 epochs, moves   3.97 m, state CRC E09152E8: {verdict}\n"), verdict)

    def test_a_player_that_finds_another_epoch(self):
        words = source("sim_host/replay/complaint.cpp")
        self.assertIn(" epochs differ from the recording; first ", words)
        self.assertTrue(differs("tetap-play: 3 of 2094 epochs differ from the recording; first epoch 7 at 0.070 s: recorded 321#00, now 321#01\n"))
        self.assertTrue(differs("  linux mrclam: at the desk 2116 epochs compared, different 3\n"))
        self.assertIn("came back as", source("test/hal/can_echo_peer.cpp"))
        self.assertTrue(differs("can_echo_peer: frame 7: sent 00000123, came back as 00000124 or with other data\n"))

    def test_processes_that_missed_each_other_may_be_tried_again(self):
        for log in ("tetap-play: no node with id base 0x300 answers on this bus: sent Begin for 15.084 s\n",
                    "tetap-play: 12 frames lost (2 to the node, 10 from it, of these 0 in our own socket)\n",
                    "tetap-play: no answer to the tick at 4.200 s within 2.000 s: no frame of the epoch came; 420 epochs before it, 0 frames lost so far\n",
                    "provide_vcan: user-mode-linux ended early (status 1): it did not start within 60 s\n",
                    "  busy: the emulated receiver lost 3 frames, so the record is not what the node consumed\n",
                    "  linux mrclam: at the desk 2116 epochs compared, different 0\n  too few epochs compared\n",
                    "  mrclam1_mrclam         2000 epochs, moves   3.97 m, state CRC E09152E8: equal\n"
                    "  one flipped bit in mrclam1_mrclam on the host: 1369 state CRCs are others\n"):
            self.assertFalse(differs(log), log)


TABLE = """
[form.test]
length = "20"
[form.proof]
length = "120"

[group]
lib = ["src/*.hpp"]

[[step]]
name = "build"
command = "mkdir -p build && cat src/main.cpp src/part.hpp > build/program && printf 'tetap-git:\\\\0\\\\0%s' $(cat commit) >> build/program"
stamp = false

[[step]]
name = "of_program"
command = "echo $length >> ran/of_program"
inputs = ["build/program"]
after = ["build"]

[[step]]
name = "of_source"
command = "echo $item >> ran/of_source; [ ! -e fail ]"
each = ["src/*.cpp"]
inputs = ["$item"]
part_of = "sources"

[[step]]
name = "of_read"
command = "echo >> ran/of_read; echo $PWD/src/part.hpp > $TETAP_READS"
inputs = ["src/main.cpp"]
part_of = "sources"

[[step]]
name = "of_tool"
command = "tool/script.py >> ran/of_tool"
inputs = ["tool/**"]

[[step]]
name = "of_data"
command = "[ -e $TETAP_DATA/set/a.csv ] || { echo no data; exit 77; }; echo >> ran/of_data"
data = ["set/**"]

[[step]]
name = "of_compiler"
command = "echo >> ran/of_compiler"
tools = ["fakecc"]

[[step]]
name = "makes"
command = "echo >> ran/makes; mkdir -p out; cat src/part.hpp > out/made"
inputs = ["@lib"]
makes = ["out/made"]

[[step]]
name = "of_made"
command = "echo >> ran/of_made"
inputs = ["out/made"]
after = ["makes"]

[[step]]
name = "of_proof"
command = "echo >> ran/of_proof; [ ! -e fail ]"
form = "proof"
"""
ALL = ["of_program", "of_source", "of_read", "of_tool", "of_data", "of_compiler", "makes", "of_made"]


class Tree(unittest.TestCase):
    """A small repository with a table of its own, and which of its steps have run since last asked."""

    def setUp(self):
        self.root = os.path.realpath(tempfile.mkdtemp(prefix="tetap-run-checks."))
        self.addCleanup(shutil.rmtree, self.root)
        self.data = os.path.join(self.root, "data")
        for path, text in (("src/main.cpp", "int main"), ("src/other.cpp", "other"), ("src/part.hpp", "part"), ("commit", "1234"), ("tool/script.py", "#!/bin/sh\necho\n"),
                           ("tool/fakecc", "#!/bin/sh\necho fakecc 12.2\n"), ("data/set/a.csv", "1,2"), ("table.toml", TABLE), ("ran/none", "")):
            self.write(path, text)
        for path in ("tool/script.py", "tool/fakecc"):
            os.chmod(os.path.join(self.root, path), 0o755)
        self.variables = dict(os.environ, TETAP_DATA=self.data, PATH=f"{self.root}/tool:{os.environ['PATH']}")
        self.variables.pop("TETAP_FRESH", None)

    def write(self, path, text, keep_time=False):
        path = os.path.join(self.root, path)
        os.makedirs(os.path.dirname(path), exist_ok=True)
        before = os.stat(path) if keep_time else None
        with open(path, "w", encoding="utf-8") as file:
            file.write(text)
        if keep_time:
            os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns))

    def run_all(self, *words, form="test", status=0, **variables):
        done = subprocess.run([TOOL, form, "--root", self.root, "--table", os.path.join(self.root, "table.toml"), *words], env=dict(self.variables, **variables),
                              capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, status, done.stdout + done.stderr)
        self.said = done.stdout + done.stderr
        self.assertNotIn("Traceback", self.said)
        ran = set(os.listdir(os.path.join(self.root, "ran"))) - {"none"}
        for name in ran:
            os.remove(os.path.join(self.root, "ran", name))
        return ran


class Unchanged(Tree):
    def setUp(self):
        super().setUp()
        self.assertEqual(self.run_all(), set(ALL))

    def test_nothing_is_run_again_and_each_says_so(self):
        self.assertEqual(self.run_all(), set())
        for name in ALL:
            self.assertRegex(self.said, rf"(?m)^{name} +ok \(unchanged")
        self.assertEqual(self.said.splitlines()[-1], "9 passed, 0 failed, 0 skipped")

    def test_fresh_ignores_every_stamp(self):
        self.assertEqual(self.run_all(TETAP_FRESH="1"), set(ALL))

    def test_one_byte_re_runs_what_depends_on_it_and_nothing_else(self):
        for path, text, again in (("src/main.cpp", "int mein", {"of_program", "of_source", "of_read"}), ("src/other.cpp", "othex", {"of_source"}),
                                  ("src/part.hpp", "pert", {"of_program", "of_read", "makes", "of_made"}), ("tool/script.py", "#!/bin/sh\necho \n", {"of_tool"}),
                                  ("data/set/a.csv", "1,3", {"of_data"}), ("tool/fakecc", "#!/bin/sh\necho fakecc 12.3\n", {"of_compiler", "of_tool"})):
            with self.subTest(path):
                self.write(path, text)
                self.assertEqual(self.run_all(), again)
                self.assertEqual(self.run_all(), set())

    def test_of_a_step_with_parts_only_the_part_is_run(self):
        self.write("src/other.cpp", "othex")
        self.run_all()
        self.assertRegex(self.said, r"(?m)^of_source +ok .*\(1 of 2 unchanged\)")

    def test_a_byte_whose_time_was_put_back_is_seen(self):
        import time
        time.sleep(2.1)  # so that the time of change itself is believed
        self.assertEqual(self.run_all(), set())
        self.write("src/other.cpp", "othex", keep_time=True)
        self.assertEqual(self.run_all(), {"of_source"})

    def test_a_new_file_in_a_pattern_a_setting_and_another_command_re_run(self):
        self.write("tool/more.py", "")
        self.assertEqual(self.run_all(), {"of_tool"})
        self.assertEqual(self.run_all(TETAP_PROGRAMS="/elsewhere"), set(ALL))
        self.write("table.toml", TABLE.replace("echo >> ran/makes", "echo 1 >> ran/makes"))
        self.run_all()
        self.assertEqual(self.run_all(), set())
        self.write("table.toml", TABLE.replace("echo >> ran/makes", "echo 2 >> ran/makes"))
        self.assertEqual(self.run_all(), {"makes"})

    def test_the_commit_in_a_program_is_no_change(self):
        self.write("commit", "5678")
        self.assertEqual(self.run_all(), set())

    def test_what_a_step_made_has_to_be_there(self):
        os.remove(os.path.join(self.root, "out/made"))
        self.assertEqual(self.run_all(), {"makes"})

    def test_a_failure_is_no_stamp(self):
        self.write("src/main.cpp", "int mein")
        self.write("fail", "")
        self.assertIn("of_source", self.run_all(status=1))
        self.assertRegex(self.said, r"(?m)^of_source +FAILED")
        self.assertEqual(self.said.splitlines()[-1], "8 passed, 1 failed, 0 skipped")
        self.assertEqual(self.run_all(status=1), {"of_source"})
        os.remove(os.path.join(self.root, "fail"))
        self.assertEqual(self.run_all(), {"of_source"})
        self.assertEqual(self.run_all(), set())


class Forms(Tree):
    def test_steps_by_name_and_by_what_they_are_part_of_bring_what_they_come_after(self):
        self.assertEqual(self.run_all("sources"), {"of_source", "of_read"})
        self.assertEqual(self.run_all("of_made"), {"makes", "of_made"})
        self.assertEqual(self.said.splitlines()[-1], "2 passed, 0 failed, 0 skipped")
        self.run_all("nothing", status=2)
        self.assertRegex(self.said, "no step 'nothing'; there are: .*sources")
        self.run_all(form="everything", status=2)

    def test_a_skipped_step_says_why_and_is_asked_again(self):
        shutil.rmtree(self.data)
        self.run_all()
        self.assertRegex(self.said, r"(?m)^of_data +skipped: no data")
        self.assertEqual(self.said.splitlines()[-1], "8 passed, 0 failed, 1 skipped")
        self.write("data/set/a.csv", "1,2")
        self.assertEqual(self.run_all(), {"of_data"})

    def test_after_a_failed_build_nothing_that_needs_it_is_run(self):
        os.remove(os.path.join(self.root, "commit"))
        self.write("table.toml", TABLE.replace("mkdir -p build &&", "cat commit && mkdir -p build &&"))
        self.assertNotIn("of_program", self.run_all(status=1))
        self.assertRegex(self.said, r"(?m)^of_program +not run: needs build$")
        self.assertRegex(self.said, r"(?m)^failed: build$")
        self.assertEqual(self.said.splitlines()[-1], "7 passed, 1 failed, 0 skipped, 1 not run")
        self.write("commit", "1234")
        self.assertEqual(self.run_all(), {"of_program"})  # goes on where the first call stopped

    def test_a_step_without_what_a_failed_one_makes_is_not_run_and_what_needs_it_neither(self):
        self.write("table.toml", TABLE.replace("mkdir -p out;", "exit 3;") + '[[step]]\nname = "last"\ncommand = "true"\ninputs = ["out/none"]\nafter = ["of_made"]\n')
        self.assertNotIn("of_made", self.run_all(status=1))
        self.assertRegex(self.said, r"(?m)^makes +FAILED")
        self.assertRegex(self.said, r"(?m)^of_made +not run: needs makes$")
        self.assertRegex(self.said, r"(?m)^last +not run: needs of_made$")
        self.assertIn("1 failed, 0 skipped, 2 not run", self.said)

    def test_an_interrupted_proof_goes_on_and_a_finished_one_begins_anew(self):
        self.run_all()
        self.write("fail", "")
        ran = self.run_all(form="proof", status=1)
        self.assertEqual(ran, {*ALL, "of_proof"})  # whatever the test has passed
        os.remove(os.path.join(self.root, "fail"))
        self.assertEqual(self.run_all(form="proof"), {"of_source", "of_proof"})
        self.assertEqual(self.run_all(form="proof"), {*ALL, "of_proof"})

    def test_wall_and_cpu_time_stand_in_the_table(self):
        self.run_all()
        with open(os.path.join(self.root, "out/prove/times.tsv"), encoding="utf-8") as file:
            rows = [line.rstrip("\n").split("\t") for line in file]
        self.assertEqual(rows[0], ["step", "wall_s", "cpu_s", "status"])
        self.assertEqual({row[0] for row in rows[1:]}, {*ALL, "build"})
        self.assertTrue(all(float(row[1]) >= 0 and float(row[2]) > 0 for row in rows[1:]))


class Limits(Tree):
    TABLE = "[form.test]\n[limit.test]\nsilence_s = 1\ncpu_s = %d\n[[step]]\nname = 'step'\nstamp = false\ncommand = '%s'\n"

    def step(self, command, cpu_s=60, status=0):
        self.write("table.toml", self.TABLE % (cpu_s, command))
        self.run_all(status=status)

    def test_no_clock_ends_a_step_that_works_or_writes(self):
        self.step("end=$((SECONDS + 3)); while [ $SECONDS -lt $end ]; do :; done")
        self.step("for one in 1 2 3 4 5 6; do echo $one; sleep 0.5; done")

    def test_a_silent_step_is_ended_and_the_reason_is_said(self):
        self.step("echo begun; sleep 60; echo never", status=1)
        self.assertRegex(self.said, r"step: status 124: silent for 1 s: it wrote nothing and used no CPU")
        self.step("trap : TERM; while :; do sleep 60; done", status=1)  # killed at last
        self.assertIn("silent for 1 s", self.said)

    def test_a_step_that_never_ends_is_ended_by_its_cpu_time_that_of_its_children_included(self):
        self.step("sh -c \"while :; do :; done\" & wait", cpu_s=1, status=1)
        self.assertIn("used more than 1 s of CPU", self.said)


class RealTime(Tree):
    STEP = '[form.test]\n[[step]]\nname = "meets"\nrealtime = true\ncommand = "echo >> ran/meets; %s"\n'

    def judged(self, command, foreign):
        self.write("table.toml", self.STEP % command)
        table, said = Table(self.root, os.path.join(self.root, "table.toml")), []
        runner = checks.Runner(table, "test", table.chosen("test", []), stamps.Stamps(self.root, os.path.join(self.root, "out/stamps"), self.variables),
                               os.path.join(self.root, "out"), say=said.append)
        # Others take that share of the processors: the clock of all work runs by so much beside the step's own.
        real, start = checks.busy_s, checks.time.monotonic()
        checks.busy_s = lambda: (checks.time.monotonic() - start) * foreign * runner.processors
        try:
            good = runner.all()
        finally:
            checks.busy_s = real
        with open(os.path.join(self.root, "ran/meets"), encoding="utf-8") as file:
            tries = len(file.readlines())
        os.remove(os.path.join(self.root, "ran/meets"))
        return good, tries, "\n".join(said)

    def test_a_failure_on_a_machine_of_its_own_is_one(self):
        good, tries, said = self.judged("sleep 0.2; exit 1", 0.0)
        self.assertEqual((good, tries), (False, 2))
        self.assertIn("0 passed, 1 failed, 0 skipped", said)

    def test_where_others_take_the_processors_it_is_not_judged_and_says_the_figure(self):
        good, tries, said = self.judged("sleep 0.2; exit 1", 0.9)
        self.assertEqual((good, tries), (True, 2))
        self.assertRegex(said, r"meets +skipped: not judged: machine too slow \(others took \d\d % of the \d+ processors")
        self.assertIn("0 passed, 0 failed, 1 skipped", said)

    def test_a_step_that_names_the_figure_of_a_slow_machine_is_tried_twice_and_not_judged(self):
        good, tries, said = self.judged("echo 900 of 2000 ticks; exit 75", 0.0)
        self.assertEqual((good, tries), (True, 2))
        self.assertRegex(said, r"meets +skipped: not judged: machine too slow \(900 of 2000 ticks; ")
        good, tries, _ = self.judged("echo every state CRC differs, 900 of 2000 ticks; exit 75", 0.0)
        self.assertEqual((good, tries), (False, 1))

    def test_bytes_that_differ_are_a_failure_on_any_machine(self):
        good, tries, _ = self.judged("echo board DIFFERS; exit 1", 0.9)
        self.assertEqual((good, tries), (False, 1))

    def test_what_passes_alone_has_passed(self):
        good, tries, said = self.judged("[ $(wc -l < ran/meets) = 2 ]", 0.9)
        self.assertEqual((good, tries), (True, 2))
        self.assertIn("at the second try", said)


class TheTable(Tree):
    def test_of_this_repository_is_read_and_its_steps_are_named(self):
        table = Table(ROOT, os.path.join(ROOT, "tools/proof/steps.toml"))
        names = [step.name for step in table.chosen("test", [])]
        self.assertLess({"unit_tests", "tidy", "bits", "fuzz", "count", "r5_identity"}, set(names))
        self.assertLess(set(names), {step.name for step in table.chosen("proof", [])})
        self.assertLess({"format", "layers", "tidy"}, {step.name for step in table.chosen("test", ["check"])})

    def test_what_is_wrong_in_a_table_is_one_line(self):
        for text, why in (('[[step]]\nname = "a"\ncommand = "true"\ninputs = ["nowhere/*"]', "a: no file is like nowhere"),
                          ('[[step]]\nname = "a"\ncommand = "true"\ninputs = ["{table.toml,nowhere}"]', "a: no file is like nowhere"),
                          ('[[step]]\nname = "a"\ncommand = "true"\nafter = ["b"]', "a comes after b, which is no step"),
                          ('[[step]]\nname = "a"', "a: command is missing"), ('[[step]]\nname = "a"\ncommand = "true"\nimputs = []', "a: imputs = "),
                          ('[[step]]\nname = "a"\ncommand = "true"\ninputs = ["@b"]', "a: there is no group @b"), ("[[step", "table.toml: ")):
            self.write("table.toml", "[form.test]\n" + text)
            with self.assertRaisesRegex(TableError, re.escape(why)):
                Table(self.root, os.path.join(self.root, "table.toml"))


if __name__ == "__main__":
    unittest.main()
