#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""A replay in memory needs as much memory for twenty minutes as for seven: its growth, carried on to eight hours, stays below 100 MB.

TETAP_PROGRAMS: where tetap-world and tetap-play are (default build/host/sim_host)."""
import os
import subprocess
import tempfile
import unittest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))
PROGRAMS = os.environ.get("TETAP_PROGRAMS") or os.path.join(ROOT, "build", "host", "sim_host")
SHORT_S, LONG_S, DAY_S = 420, 1240, 8 * 3600
MOST_B = 100e6


def largest_memory_b(*words):
    """Largest resident memory of a process; it has to end with status 0."""
    with subprocess.Popen(words, cwd=ROOT, stdout=subprocess.DEVNULL) as process:
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode != 0:
        raise AssertionError(f"{' '.join(words)}: status {process.returncode}")
    return 1024 * usage.ru_maxrss


class LongLog(unittest.TestCase):
    def test_a_replay_does_not_grow_with_its_log(self):
        with tempfile.TemporaryDirectory() as folder:
            found = []
            for length_s in (SHORT_S, LONG_S):
                made = os.path.join(folder, f"made{length_s}")
                subprocess.run([os.path.join(PROGRAMS, "tetap-world"), "--memory", "--raw", "--laps", "9", "--duration", str(length_s), "--out", made],
                               cwd=ROOT, check=True, stdout=subprocess.DEVNULL)
                found.append(largest_memory_b(os.path.join(PROGRAMS, "tetap-play"), os.path.join(made, "raw.log"), "--memory", "--robot", "rover", "--out",
                                              os.path.join(folder, f"played{length_s}")))
            short_b, long_b = found
            day_b = short_b + (long_b - short_b) * (DAY_S - SHORT_S) / (LONG_S - SHORT_S)
            print(f"{short_b / 1e6:.0f} MB for {SHORT_S} s, {long_b / 1e6:.0f} MB for {LONG_S} s, {day_b / 1e6:.0f} MB for 8 hours")
            self.assertLess(day_b, MOST_B)


if __name__ == "__main__":
    unittest.main()
