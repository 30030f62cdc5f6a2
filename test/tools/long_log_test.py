#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""A log of eight hours is replayed and reported in less than 1 GB: the growth of memory between two lengths, carried on to eight hours.

TETAP_PROGRAMS: where tetap-world and tetap-play are (default build/host/sim_host)."""
import os
import subprocess
import tempfile
import unittest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))
PROGRAMS = os.environ.get("TETAP_PROGRAMS") or os.path.join(ROOT, "build", "host", "sim_host")
SHORT_S, LONG_S, DAY_S = 60, 420, 8 * 3600
MOST_B = 1_000_000_000


def largest_memory_b(*words):
    """Largest resident memory of a process; it has to end with status 0."""
    with subprocess.Popen(words, cwd=ROOT, stdout=subprocess.DEVNULL) as process:
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode != 0:
        raise AssertionError(f"{' '.join(words)}: status {process.returncode}")
    return 1024 * usage.ru_maxrss


class LongLog(unittest.TestCase):
    def test_eight_hours_in_a_gigabyte(self):
        with tempfile.TemporaryDirectory() as folder:
            found = {"replay": [], "report": []}
            for length_s in (SHORT_S, LONG_S):
                made, played = os.path.join(folder, f"made{length_s}"), os.path.join(folder, f"played{length_s}")
                subprocess.run([os.path.join(PROGRAMS, "tetap-world"), "--memory", "--laps", "3", "--duration", str(length_s), "--out", made],
                               cwd=ROOT, check=True, stdout=subprocess.DEVNULL)
                log = os.path.join(made, "raw.log")
                found["replay"].append(largest_memory_b(os.path.join(PROGRAMS, "tetap-play"), log, "--memory", "--robot", "rover", "--out", played))
                found["report"].append(largest_memory_b(os.path.join(ROOT, "tools", "report", "write_report"), played, "--truth", os.path.join(made, "truth.csv")))
            for what, (short_b, long_b) in found.items():
                day_b = short_b + (long_b - short_b) * (DAY_S - SHORT_S) / (LONG_S - SHORT_S)
                print(f"{what}: {short_b / 1e6:.0f} MB for {SHORT_S} s, {long_b / 1e6:.0f} MB for {LONG_S} s, {day_b / 1e6:.0f} MB for 8 hours")
                self.assertLess(day_b, MOST_B, what)


if __name__ == "__main__":
    unittest.main()
