#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""tetap.shards on this machine: the same results from any number of workers, a killed worker's shard again, and what is played again after a change.

GNU parallel and slurm are judged by test/engines/judge, which needs their packages."""
import contextlib
import os
import signal
import subprocess
import sys
import tempfile
import types
import unittest

sys.dont_write_bytecode = True
ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))
sys.path.insert(0, os.path.join(ROOT, "tools", "python"))
from tetap import shards  # noqa: E402
from tetap.can.bus_writer import BadInput  # noqa: E402


def squared(job):
    """A shard of these tests; each call leaves a line in job["calls"]."""
    os.write(1, b"\n")  # no reply
    with open(job["calls"], "a", encoding="ascii") as file:
        file.write(f"{job['number']}\n")
    with contextlib.suppress(KeyError, FileExistsError), open(job["dies"], "x", encoding="ascii"):  # one of two that begin at once
        os.kill(os.getpid(), signal.SIGKILL)
    if job.get("always"):
        os.kill(os.getpid(), signal.SIGKILL)
    if job["number"] < 0:
        raise BadInput(f"number {job['number']}: below 0")
    return job["number"] ** 2


def by_local(jobs):
    return types.SimpleNamespace(engine="local", jobs=jobs, nodes=None)


class Runs(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.calls, self.input = (os.path.join(self.folder.name, name) for name in ("calls", "input"))
        self.write(self.input, "one")

    @staticmethod
    def write(path, text):
        with open(path, "w", encoding="ascii") as file:
            file.write(text)

    def called(self):
        with open(self.calls, encoding="ascii") as file:
            return sorted(map(int, file.read().split()))

    def squares(self, numbers, workers=2, fresh=False, **more):
        plays = shards.Shards(squared, [self.input], by_local(workers), self.folder.name, shards.Progress("test", quiet=True), fresh)
        try:
            return list(plays.run([{"number": number, "calls": self.calls, **more} for number in numbers]))
        finally:
            plays.close(keep=True)

    def test_results_are_in_the_order_of_the_jobs_and_each_job_is_played_once(self):
        self.assertEqual(self.squares([3, 1, 2, 3], workers=3), [9, 1, 4, 9])
        self.assertEqual(self.called(), [1, 2, 3])

    def test_a_run_goes_on_where_it_was_and_begins_anew_with_another_input(self):
        self.squares([1, 2])
        self.assertEqual(self.squares([1, 2, 3]), [1, 4, 9])
        self.assertEqual(self.called(), [1, 2, 3])
        self.write(self.input, "two")
        self.assertEqual(self.squares([1, 2]), [1, 4])
        self.assertEqual(self.called(), [1, 1, 2, 2, 3])
        self.assertEqual(self.squares([1], fresh=True), [1])
        self.assertEqual(self.called(), [1, 1, 1, 2, 2, 3])

    def test_a_result_of_which_half_is_on_the_disk_is_made_again(self):
        self.squares([5, 6])
        for where, _, names in os.walk(os.path.join(self.folder.name, "shards")):
            for name in names:
                if len(name) == 64:
                    os.truncate(os.path.join(where, name), 9)
        self.assertEqual(self.squares([5, 6]), [25, 36])

    def test_the_shard_of_a_killed_worker_is_played_again(self):
        self.assertEqual(self.squares([1, 2, 3, 4], dies=os.path.join(self.folder.name, "died")), [1, 4, 9, 16])
        self.assertEqual(len(self.called()), 5)

    def test_a_shard_that_kills_each_worker_is_named(self):
        with self.assertRaisesRegex(BadInput, r'1 shards were given out 3 times and left no result; the first: \{"number": 7'):
            self.squares([7], always=True)
        self.assertEqual(self.called(), [7, 7, 7])

    def test_a_refused_job_is_said_once_and_not_kept(self):
        for _ in range(2):
            with self.assertRaisesRegex(BadInput, "number -1: below 0"):
                self.squares([-1])
        self.assertEqual(self.called(), [-1, -1])

    def test_two_runs_in_one_folder_are_refused(self):
        plays = shards.Shards(squared, [], by_local(1), self.folder.name)
        with self.assertRaisesRegex(BadInput, "another run is at work here"):
            shards.Shards(squared, [], by_local(1), self.folder.name)
        plays.close(keep=False)
        self.assertEqual(os.listdir(self.folder.name), ["input"])

    def test_an_engine_that_is_not_installed_is_named(self):
        options = types.SimpleNamespace(engine="parallel", jobs=1, nodes=None)
        plays = shards.Shards(squared, [], options, self.folder.name, shards.Progress("test", quiet=True))
        path, os.environ["PATH"] = os.environ["PATH"], self.folder.name
        try:
            with self.assertRaisesRegex(BadInput, "--engine parallel: no program 'parallel'"):
                list(plays.run([{"number": 1, "calls": self.calls}]))
        finally:
            os.environ["PATH"] = path
            plays.close(keep=False)

    def test_batches_hold_all_jobs_and_an_array_of_slurm_has_room_for_them(self):
        plays = shards.Shards(squared, [], by_local(1), self.folder.name)
        self.addCleanup(plays.close, keep=False)
        for count, places in ((1, 2), (37, 2), (5000, 3), (20_001, 2)):
            numbers = plays._batches([(str(i), f"{i}\n") for i in range(count)], places)
            self.assertLessEqual(len(numbers), shards.MOST_BATCHES)
            self.assertGreaterEqual(len(numbers), min(count, 8 * places))
            lines = []
            for number in numbers:
                with open(os.path.join(plays.folder, "batches", str(number)), encoding="ascii") as file:
                    lines += file.read().split()
            self.assertEqual(lines, [str(i) for i in range(count)])


class Words(unittest.TestCase):
    def test_of_engines_are_no_part_of_a_command(self):
        self.assertEqual(shards.words_of(["--seeds", "3", "--engine", "slurm", "--jobs=4", "--nodes", "file", "--out", "x"]), ["--seeds", "3", "--out", "x"])

    def test_bad_numbers_are_refused_in_a_sentence(self):
        program = "import argparse, sys; sys.path.insert(0, sys.argv[1]); from tetap import shards; p = argparse.ArgumentParser(); shards.add_options(p); p.parse_args(sys.argv[2:])"
        for words, said in ((["--jobs", "0"], "'0' must be 1 or more"), (["--engine", "cloud"], "invalid choice: 'cloud'")):
            done = subprocess.run([sys.executable, "-c", program, os.path.join(ROOT, "tools", "python"), *words], capture_output=True, text=True, check=False)
            self.assertEqual(done.returncode, 2)
            self.assertIn(said, done.stderr)


if __name__ == "__main__":
    unittest.main()
