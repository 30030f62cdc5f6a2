#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The swarm's draws, pairs, verdicts and delta debugging, on cases worked out by hand."""
import os
import sys
import unittest

sys.dont_write_bytecode = True
ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))
sys.path.insert(0, os.path.join(ROOT, "tools", "python"))
from tetap.proof import swarm  # noqa: E402

WORLD = ["gnss_jump", "clock_jump", "kidnapped", "slip_left", "imu_stuck", "moving_start", "gnss_far"]
KINDS = {robot: swarm.kinds_of(WORLD) for robot in swarm.ROBOTS}


class Draws(unittest.TestCase):
    def setUp(self):
        self.draws = [swarm.draw(seed, KINDS, {"kidnapped"}) for seed in range(1, 201)]

    def test_a_seed_gives_the_same_faults_again_and_another_seed_gives_others(self):
        self.assertEqual(self.draws[6], swarm.draw(7, KINDS, {"kidnapped"}))
        self.assertGreater(len({str(one["faults"]) for one in self.draws}), 195)

    def test_all_faults_are_over_when_phase_two_begins(self):
        for one in self.draws:
            for fault in one["faults"]:
                self.assertLessEqual(fault["begin"] + fault["lasts"], swarm.FAULTS_UNTIL_S + 0.011)
                self.assertTrue(fault["begin"] >= swarm.FAULTS_FROM_S or fault["kind"] == "moving_start")
                self.assertIn(fault["kind"], one["exist"])

    def test_each_kind_is_missing_in_about_half_of_the_seeds(self):
        for kind in KINDS["rover"]:
            share = sum(kind in one["exist"] for one in self.draws) / len(self.draws)
            self.assertTrue(0.35 < share < 0.65, f"{kind}: {share}")

    def test_a_kind_that_was_left_out_is_never_drawn(self):
        self.assertFalse(any(fault["kind"] == "gnss_far" for one in self.draws for fault in one["faults"]))

    def test_pairs_that_no_run_can_have_are_not_counted(self):
        reached, possible = swarm.pair_share(self.draws, KINDS)
        world, frames = len(WORLD) - 1, len(swarm.FRAME_KINDS)
        self.assertEqual(possible, (world + frames) * (world + frames - 1) // 2 - frames)
        self.assertEqual(reached, possible)
        self.assertEqual(swarm.pair_share([], KINDS)[0], 0)


class Verdicts(unittest.TestCase):
    def test_of_what_was_judged(self):
        good = {"safe": True, "recovered": True, "words": []}
        for changes, verdict in (({}, "ok"), ({"recovered": False}, "silent"), ({"recovered": False, "words": ["Rejecting"]}, "named"),
                                 ({"safe": False}, "unsafe"), ({"safe": False, "blind": True}, "blind"), ({"words": ["TooLate"]}, "ok")):
            self.assertEqual(swarm.verdict({**good, **changes}), verdict)


    def test_an_error_is_blind_while_two_devices_are_hurt(self):
        faults = [{"kind": "imu offset", "begin": 20, "lasts": 5}, {"kind": "gnss_jump", "begin": 40, "lasts": 5}, {"kind": "stale_stamps", "begin": 70, "lasts": 2}]
        for begin, end, blind in ((22, 23, False), (30, 41, True), (36, 41, False), (71, 71, True), (83, 84, False)):
            self.assertEqual(swarm.is_blind(faults, begin, end), blind, (begin, end))

    def test_the_longest_stretch_has_its_begin(self):
        self.assertEqual(swarm.longest([1, 2, 3, 4, 5, 6], [True, True, False, True, True, True]), (2.0, 4.0))
        self.assertEqual(swarm.longest([1, 2], [False, False]), (0.0, None))


class Shrinking(unittest.TestCase):
    def test_finds_the_parts_that_a_failure_needs(self):
        needed = {3, 500, 777}
        self.assertEqual(swarm.shrunk(list(range(1000)), lambda part: needed <= set(part), 60), sorted(needed))

    def test_keeps_what_fails_when_the_time_is_over(self):
        clock = iter(range(10_000))
        left = swarm.shrunk(list(range(1000)), lambda part: {3, 777} <= set(part), 12, lambda: next(clock))
        self.assertTrue({3, 777} <= set(left) and 2 < len(left) < 1000, len(left))

    def test_keeps_all_of_what_cannot_be_shrunk(self):
        self.assertEqual(swarm.shrunk([1, 2, 3, 4], lambda part: len(part) == 4, 60), [1, 2, 3, 4])


if __name__ == "__main__":
    unittest.main()
