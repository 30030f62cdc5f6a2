#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The swarm's draws, pairs, verdicts and delta debugging, on cases worked out by hand."""
import os
import sys
import unittest

import numpy as np

sys.dont_write_bytecode = True
ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))
sys.path.insert(0, os.path.join(ROOT, "tools", "python"))
from tetap.can.faulty_log import Fields, Frame  # noqa: E402
from tetap.proof import failing_log, swarm  # noqa: E402

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

    def test_takes_what_only_a_later_chunk_made_free(self):
        self.assertEqual(swarm.shrunk(list(range(8)), lambda part: {3, 6} <= set(part) and (0 in part or 7 not in part), 60), [3, 6])


FIELDS = Fields()


def frame(time_us, message, **values):
    payload = 0
    for name, raw in values.items():
        payload = FIELDS.put(payload, message, name, raw)
    return Frame(time_us, FIELDS.identifier[message], payload)


def imu(number, turn=3):
    """Sample of 10 ms: gyroscope, accelerometer, time."""
    at = 10_000 * number
    return [frame(at, "In_Imu0Gyro", AngZ=turn, Seq=number % 16), frame(at, "In_Imu0Accel", VelZ=-100 * number, Seq=number % 16),
            frame(at, "In_Imu0Time", Stamp=at % (1 << 20), Interval=10_000, ClipGyro=9, Temp=number, Seq=number % 16)]


def log(seconds):
    """IMU at 100 Hz, a fix and a velocity each second, speed and ticks at 10 Hz, a start pose."""
    frames = [frame(10_000, "Cmd_SetPos", Ctr=1), frame(10_000, "Cmd_SetYaw", Ctr=1)]
    for number in range(1, 100 * seconds + 1):
        at = 10_000 * number
        frames += imu(number)
        if number % 10 == 0:
            frames += [frame(at, "In_BodySpeed", Forward=number), frame(at, "In_Sync", Kind=1, Time=at)]
        if number % 100 == 50:
            frames += [frame(at, name) for name in ("In_GnssLat", "In_GnssLon", "In_GnssAlt", "In_GnssAcc", "In_GnssVelEN", "In_GnssVelU")]
    return frames


class Units(unittest.TestCase):
    def test_have_the_frames_of_one_sensor_and_one_time(self):
        parts = failing_log.units(log(1), FIELDS)
        kinds = [one.kind for one in parts]
        self.assertEqual({kind: kinds.count(kind) for kind in kinds}, {"Pose": 1, "Imu0": 100, "BodySpeed": 10, "Sync": 10, "Gnss": 1})
        self.assertEqual(failing_log.frames_of(parts, FIELDS), log(1))

    def test_joined_samples_have_the_sum_of_their_increments_and_intervals(self):
        parts = failing_log.joined(failing_log.units([one for number in range(1, 8) for one in imu(number)], FIELDS), FIELDS)
        self.assertEqual([len(one.frames) for one in parts], [18, 3])
        gyro, accel, at = failing_log.written(parts[0], FIELDS)
        self.assertEqual(FIELDS.get(gyro.payload, "In_Imu0Gyro", "AngZ"), 18)
        self.assertEqual(FIELDS.get(accel.payload, "In_Imu0Accel", "VelZ"), -2100)
        values = [FIELDS.get(at.payload, "In_Imu0Time", name) for name in ("Stamp", "Interval", "ClipGyro", "Temp", "Seq")]
        self.assertEqual(values, [60_000, 60_000, 15, 6, 6])
        self.assertEqual(failing_log.size_of(parts), len(failing_log.frames_of(parts, FIELDS)))

    def test_samples_with_a_hole_between_are_not_joined(self):
        parts = failing_log.joined(failing_log.units([*imu(1), *imu(2), *imu(5)], FIELDS), FIELDS)
        self.assertEqual([len(one.frames) for one in parts], [6, 3])

    def test_a_late_start_has_first_fixes_samples_that_level_and_the_pose(self):
        parts = failing_log.late(failing_log.units(log(20), FIELDS), 15_000_000, (10.0, -4.0, 1.5), FIELDS)
        early = [one for one in parts if one.time_us <= 15_000_000 - failing_log.LEVEL_us]
        self.assertEqual([(one.kind, len(one.frames)) for one in early], [("Gnss", 2)] + [("Gnss", 4)] * 5)
        pose, = [one for one in parts if one.kind == "Pose"]
        position, heading = pose.frames
        self.assertEqual([FIELDS.get(position.payload, "Cmd_SetPos", name) for name in ("Ctr", "X", "Y")], [2, 5000, -2000])
        self.assertEqual([FIELDS.get(heading.payload, "Cmd_SetYaw", name) for name in ("Ctr", "Yaw")], [2, 30_000])
        levelling = [one for one in parts[len(early):parts.index(pose)] if one.kind == "Imu0"]
        self.assertEqual(len(levelling), 110)
        self.assertTrue(all(one.time_us > 15_000_000 for one in parts[parts.index(pose) + 1:]))

    def test_a_twin_is_the_frame_of_that_time_without_the_fault(self):
        faulty, clean = imu(1, turn=77), imu(1)
        part, = failing_log.units(faulty, FIELDS)
        self.assertEqual(failing_log.written(part, FIELDS, failing_log.twin_in(clean, FIELDS)), clean)
        self.assertEqual(failing_log.written(part, FIELDS, failing_log.twin_in([], FIELDS)), [])


class Reasons(unittest.TestCase):
    """A log of speeds. Those of 3 to 4 s are a fault, and the estimate is astray where the log has one of these."""

    def setUp(self):
        self.frames = [frame(100_000 * number, "In_BodySpeed", Forward=500 if 30 <= number < 40 else 5) for number in range(60)]
        self.clean = [one._replace(payload=self.frames[0].payload) for one in self.frames]
        self.parts = failing_log.units(self.frames, FIELDS)
        self.shown = {True: ("unsafe", 3.2, 0.5), False: ("ok", None, 0.5)}  # by fault: verdict, begin of the error, ratio before

    def look(self, frames, _):
        verdict, begin, before = self.shown[any(one.payload != self.frames[0].payload for one in frames)]
        at = np.arange(0, 6, swarm.TICK_S)
        return verdict, {"astray_at_s": begin}, (at, np.where(at >= (begin or 6), 20.0, before))

    def failure(self, without=()):
        return failing_log.Failure(self.look, FIELDS, self.look(self.frames, None), None, (failing_log.twin_in(self.clean, FIELDS), None), without)

    def test_a_part_with_the_fault_fails_alike_and_one_without_does_not(self):
        failure = self.failure()
        self.assertTrue(failure.holds(self.parts[39:41]))
        self.assertFalse(failure.holds(self.parts[:30]))

    def test_a_log_whose_error_begins_elsewhere_or_was_always_there_has_another_reason(self):
        failure = self.failure()
        for begin, before, holds in ((5.0, 0.5, True), (5.0, 2.0, False), (0.0, 0.5, False), (20.0, 0.5, False), (None, 0.5, False)):
            self.shown[True] = ("unsafe", begin, before)
            self.assertEqual(failure.holds(self.parts), holds, (begin, before))

    def test_a_silent_log_was_inside_before_wherever_its_worst_error_begins(self):
        for first, then, before, holds in ((None, None, 0.5, True), (2.0, None, 0.5, True), (None, None, 2.0, False)):
            self.shown[True] = ("silent", first, 0.5)
            failure = self.failure()
            self.shown[True] = ("silent", then, before)
            self.assertEqual(failure.holds(self.parts), holds, (first, then, before))

    def test_a_log_that_errs_without_the_fault_too_has_another_reason(self):
        failure = self.failure()
        for verdict, begin, before, holds in (("ok", 5.9, 0.5, True), ("ok", None, 2.0, False), ("ok", 3.0, 0.5, False), ("unsafe", 5.9, 0.5, False)):
            self.shown[False] = (verdict, begin, before)
            self.assertEqual(failure.holds(self.parts), holds, (verdict, begin, before))

    def test_each_needed_fault_is_still_needed(self):
        still_faulty = failing_log.twin_in(self.frames, FIELDS), None
        self.assertFalse(self.failure([still_faulty]).holds(self.parts))

    def test_shares_of_right_epochs_are_of_those_that_the_failing_log_knows(self):
        at = np.array([1.0, 1.01, 1.02, 1.03])
        failing, clean = (at, np.array([np.nan, 20, 20, 20])), (at[1:], np.array([0.5, 2, np.nan]))
        self.assertAlmostEqual(failing_log.right_share(failing, clean), 1 / 3)
        self.assertEqual(failing_log.right_share((at, np.full(4, np.nan)), clean), 0.0)


class Structure(unittest.TestCase):
    def test_goes_before_single_frames(self):
        parts, tries = failing_log.units(log(30), FIELDS), []

        def fails(some):
            """Speeds of 25.0 to 25.5 s, and levelled samples before."""
            tries.append(len(some))
            frames = failing_log.frames_of(some, FIELDS)
            speeds = [one.time_us for one in frames if one.identifier == FIELDS.identifier["In_BodySpeed"]]
            samples = sum(FIELDS.get(one.payload, "In_Imu0Time", "Interval") for one in frames if one.identifier == FIELDS.identifier["In_Imu0Time"])
            return sum(25_000_000 <= at < 25_500_000 for at in speeds) == 5 and samples >= 1_000_000

        few = failing_log.shrunk(parts, FIELDS, fails, lambda _: (0.0, 0.0, 0.0), 25_500_000, 60)
        self.assertEqual(failing_log.size_of(few), 5 + 3 * 17)
        self.assertLess(max(tries[3:]), len(parts) / 3)


if __name__ == "__main__":
    unittest.main()
