#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""What the tables on recorded inertial data call beyond 3 sigma, and that they lose no place."""
import math
import os
import sys
import unittest

sys.dont_write_bytecode = True
ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))
sys.path.insert(0, os.path.join(ROOT, "test", "replay"))
import inertial_runs  # noqa: E402
import inertial_tables  # noqa: E402
import numpy as np  # noqa: E402


def row(start_s, seconds, speedometer, error_m, imu_hole=False):
    return {"start_s": start_s, "seconds": seconds, "speedometer": speedometer, "driven_m": 10.0 * seconds, "calibrated_on": start_s < 100, "imu_hole": imu_hole,
            **inertial_runs.judged(np.array(error_m), 2.0, 1.0, 0.0, 1.0)}


class ThreeSigma(unittest.TestCase):
    def test_as_rare_in_the_plane_as_3_sigma_of_one_axis(self):
        errors = np.random.default_rng(1).normal(size=(40_000, 2)) @ np.linalg.cholesky([[4, 1.8], [1.8, 1]]).T
        beyond = np.mean([inertial_runs.judged(one, 2.0, 1.0, 0.9, 0.0)["beyond"] for one in errors])
        self.assertAlmostEqual(beyond, 0.0027, delta=5 * math.sqrt(0.0027 / len(errors)))

    def test_it_reaches_as_far_as_the_covariance_in_the_errors_own_direction(self):
        reach = math.sqrt(inertial_runs.THREE_SIGMA_2)
        for error, sigma in (((5, 0), 2), ((0, 5), 1), ((3, 3), math.sqrt(2 / (1 / 4 + 1)))):
            found = inertial_runs.judged(np.array(error, float), 2.0, 1.0, 0.0, 0.0)
            self.assertAlmostEqual(found["three_sigma_m"], reach * sigma)
            self.assertEqual(found["beyond"], found["error_m"] > found["three_sigma_m"])

    def test_a_sigma_across_the_error_does_not_excuse_it(self):
        self.assertTrue(inertial_runs.judged(np.array([0.0, 5.0]), 100.0, 1.0, 0.0, 0.0)["beyond"])
        self.assertFalse(inertial_runs.judged(np.array([5.0, 0.0]), 100.0, 1.0, 0.0, 0.0)["beyond"])


class Bounds(unittest.TestCase):
    def test_each_has_a_name_of_its_own(self):
        checks = inertial_runs.Checks()
        checks.bound("one", 1, 0, 2)
        checks.bound("other", 3, 0, 2)
        self.assertEqual((list(checks.report), checks.wrong), (["one", "other"], ["other"]))
        self.assertRaisesRegex(ValueError, "'one'", checks.bound, "one", 1, 0, 2)


class Tables(unittest.TestCase):
    def test_every_place_is_a_line_and_what_is_beyond_is_bold_and_counted(self):
        rows = [row(60, 60, True, [0, 5]), row(160, 60, True, [1, 0]), row(60, 60, False, [2, 0]), row(160, 60, False, [0, 1])]
        lines = list(inertial_tables.outage_table(rows))
        self.assertEqual(len({one.count("|") for one in lines}), 1)
        self.assertIn("| 60 s \\* | 600 m | **5.0 / 3.4 m, 25.00** | 2.0 / 6.9 m, 1.00 |", lines)
        self.assertIn("| 160 s | 600 m | 1.0 / 6.9 m, 0.25 | 1.0 / 3.4 m, 1.00 |", lines)
        self.assertIn("| 3.0 m; 1 of 2 | 1.5 m; 0 of 2 |", lines[-1])

    def test_drives_are_told_of_a_file_with_all_cuts_alone(self):
        from tetap.docs import recorded
        rows = [row(start, seconds, speedometer, [0, 5 if start == 60 else 1]) for start in (60, 160) for seconds in (30, 60) for speedometer in (True, False)]
        px4 = {"iris_gps": {"attitude_rms_deg": 0.5, "velocity_rms_mps": 0.25, "position_rms_m": 1.5, "nees": {}}}
        husky = {"end": rows[0], "gnss_rms_m": 2.0, "gnss_sensors": {"GnssPosition": {"nis_per_dof": 0.75}}, "outages": rows[:2]}
        whole = {"car": {"outages": rows}, "px4": px4, "husky": husky}
        self.assertTrue(recorded.is_whole(whole))
        self.assertFalse(recorded.is_whole({**whole, "car": {"outages": [one for one in rows if one["seconds"] == 60]}}))
        self.assertFalse(recorded.is_whole({**whole, "husky": {**husky, "outages": []}}))
        lines = list(recorded.drive_table(whole))
        self.assertEqual(len(lines), 2 + 4 + 1 + 3)
        self.assertIn("median 3.0 m (1.0 m at the 1 positions that gave no mounting); 1 beyond 3 sigma", lines[2])
        self.assertIn("2.00 m; 0.75", lines[8])

    def test_places_with_the_hole_are_told_apart_from_the_others(self):
        rows = [row(60, 60, True, [0, 5], imu_hole=True), row(160, 60, True, [2, 0])]
        lines = list(inertial_tables.nees_table({"car": {"outages": rows}}))
        self.assertEqual(len(lines), 4)
        self.assertIn("| 1.00 | 0.80 | 2 | 0 of 1 |", lines[2])
        self.assertIn("| 25.00 | 12.50 | 2 | 1 of 1 |", lines[3])


if __name__ == "__main__":
    unittest.main()
