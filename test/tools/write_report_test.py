#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""tools/report/write_report: metrics against laws and brute force, files it writes, bad input."""
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import tracemalloc
import unittest
import unittest.mock

import numpy as np

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
TOOLS = os.path.join(ROOT, "tools")
sys.path.insert(0, os.path.join(TOOLS, "python"))
sys.dont_write_bytecode = True

from tetap.can import bus_writer  # noqa: E402
from tetap.report import attitude, events, ground_truth, metrics, normalised_error, own_map, recorded_run, tables  # noqa: E402

RUN = {"frames_in": 1234, "frames_lost": 0, "estimates_out": 777, "times_realtime": 12.5, "bus_load_percent": 9.25, "estimates_sha256": "ab" * 32,
       "state_crc_last": "0x12345678", "bus": "memory", "way": "one process", "robot": "rover", "mode": "lockstep", "duration_s": 10.0, "seed": 7,
       "fault": "none"}


def round_all(value):
    """Sums of parts differ in the last digits."""
    if isinstance(value, dict):
        return {key: round_all(one) for key, one in value.items()}
    if isinstance(value, list):
        return [round_all(one) for one in value]
    return float(f"{value:.10g}") if isinstance(value, float) else value


def text_of(path):
    with open(path, encoding="utf-8") as file:
        return file.read()


class Case(unittest.TestCase):
    def setUp(self):
        self.directory = tempfile.mkdtemp()
        self.addCleanup(shutil.rmtree, self.directory, ignore_errors=True)

    def path(self, name):
        return os.path.join(self.directory, name)

    def write(self, name, text):
        with open(self.path(name), "w", encoding="utf-8") as file:
            file.write(text)

    def write_rows(self, name, columns, rows):
        def field(value):
            return "" if value is None or value != value else f"{value:.12g}"
        self.write(name, ",".join(columns) + "\n" + "".join(",".join(field(value) for value in row) + "\n" for row in rows))

    def truth(self, time_s, x, y, yaw=None, about=None):
        yaw = [None] * len(time_s) if yaw is None else yaw
        self.write_rows("t.truth.csv", ground_truth.TRUTH, zip(time_s, x, y, yaw))
        if about is not None:
            self.write("t.json", json.dumps(about))
        return self.path("t.truth.csv")

    def estimates(self, time_s, x, y, yaw, estimator=1, std=None, corr=None, valid=None, more=()):
        """One row per time; `std` and `corr` are rows of three, or None for rows without."""
        rows = list(more)
        for n, t in enumerate(time_s):
            s = [None] * 3 if std is None or std[n] is None else std[n]
            c = [None] * 3 if corr is None or std[n] is None else corr[n]
            ok = 1 if valid is None else valid[n]
            rows.append([n, t, estimator, 1 + estimator, x[n], y[n], yaw[n], 0.5, 0.1, *s, *c, ok, ok, 0.05, 0.02])
        self.write_rows("estimates.csv", recorded_run.ESTIMATES, rows)
        self.write("run.json", json.dumps(RUN))
        return rows

    def report(self, *arguments):
        return subprocess.run([os.path.join(TOOLS, "report", "write_report"), self.directory, *arguments], capture_output=True, text=True, timeout=120)

    def summary(self, *arguments):
        result = self.report("--no-pictures", *arguments)
        self.assertEqual(result.returncode, 0, result.stderr)
        return json.loads(text_of(self.path("summary.json")))


class Errors(Case):
    time_s = 1 + 0.01 * np.arange(500)

    def test_an_estimate_that_is_the_truth_has_no_error_also_between_its_rows_and_where_yaw_wraps(self):
        yaw = 3.0 + 0.1 * (self.time_s - 1)  # through +pi
        truth_t = 1 + 0.03 * np.arange(170)
        truth = self.truth(truth_t, 2 * truth_t, -truth_t, attitude.wrapped(3.0 + 0.1 * (truth_t - 1)))
        self.estimates(self.time_s, 2 * self.time_s, -self.time_s, attitude.wrapped(yaw))
        fused = self.summary("--truth", truth)["fused"]
        for key in ("position_rmse_m", "final_error_m", "max_error_m", "heading_rmse_deg"):
            self.assertLess(fused[key], 1e-6, key)
        self.assertEqual(fused["epochs_with_truth"], 500)

    def test_a_known_error_is_found_in_every_figure_and_at_the_top(self):
        zero = np.zeros(500)
        truth = self.truth(self.time_s, zero, zero, zero)
        x = np.where(np.arange(500) == 499, 0.5, 0.3)
        self.estimates(self.time_s, x, zero + 0.4, zero - 0.02)
        summary = self.summary("--truth", truth)
        fused = summary["fused"]
        self.assertAlmostEqual(fused["position_rmse_m"], np.sqrt((499 * 0.25 + 0.41) / 500), places=9)
        self.assertAlmostEqual(fused["final_error_m"], np.sqrt(0.41), places=9)
        self.assertAlmostEqual(fused["max_error_m"], np.sqrt(0.41), places=9)
        self.assertAlmostEqual(fused["heading_rmse_deg"], np.degrees(0.02), places=9)
        self.assertAlmostEqual(fused["final_heading_error_deg"], -np.degrees(0.02), places=9)
        self.assertEqual((summary["position_rmse_m"], summary["heading_rmse_deg"]), (fused["position_rmse_m"], fused["heading_rmse_deg"]))

    def test_a_heading_across_the_wrap_is_near_and_not_a_turn_away(self):
        zero = np.zeros(500)
        truth = self.truth(self.time_s, zero, zero, zero + 3.13)
        self.estimates(self.time_s, zero, zero, zero - 3.13)
        self.assertAlmostEqual(self.summary("--truth", truth)["heading_rmse_deg"], np.degrees(2 * np.pi - 6.26), places=6)

    def test_odometry_and_fused_are_told_apart(self):
        zero = np.zeros(500)
        truth = self.truth(self.time_s, zero, zero, zero)
        odometry = self.estimates(self.time_s, zero + 3, zero + 4, zero, estimator=0)
        self.estimates(self.time_s, zero + 1, zero, zero, more=odometry)
        summary = self.summary("--truth", truth)
        self.assertAlmostEqual(summary["odometry"]["position_rmse_m"], 5.0)
        self.assertAlmostEqual(summary["fused"]["position_rmse_m"], 1.0)
        self.assertAlmostEqual(summary["position_rmse_m"], 1.0)
        self.assertEqual((summary["odometry"]["kind"], summary["fused"]["kind"]), ("Odometry", "Ekf"))

    def test_nothing_is_compared_in_gaps_of_the_truth_nor_outside_of_it(self):
        known = (self.time_s < 2.0) | (self.time_s > 2.5)
        zero = np.zeros(500)
        inside = known & (self.time_s > 1.4995) & (self.time_s < 5.0005)
        truth = self.truth(self.time_s[inside], zero[inside], zero[inside], zero[inside])
        x = np.where(inside, 0.1, 99.0)
        self.estimates(self.time_s, x, zero, zero)
        fused = self.summary("--truth", truth)["fused"]
        self.assertAlmostEqual(fused["max_error_m"], 0.1)
        self.assertEqual(fused["epochs_with_truth"], int(inside.sum()))
        self.assertAlmostEqual(self.summary("--truth", truth, "--max-gap", "1.0")["fused"]["max_error_m"], 99.0)

    def test_estimates_that_are_not_valid_are_counted_and_not_compared(self):
        zero = np.zeros(500)
        truth = self.truth(self.time_s, zero, zero, zero)
        valid = (np.arange(500) >= 20).astype(int)
        self.estimates(self.time_s, np.where(valid, 0.2, 50.0), zero, zero, valid=valid)
        fused = self.summary("--truth", truth)["fused"]
        self.assertEqual((fused["epochs"], fused["epochs_not_valid"]), (500, 20))
        self.assertAlmostEqual(fused["max_error_m"], 0.2)

    def test_without_truth_there_are_no_errors_and_no_failure(self):
        zero = np.zeros(500)
        self.estimates(self.time_s, zero, zero, zero)
        summary = self.summary()
        self.assertIsNone(summary["truth"])
        self.assertIsNone(summary["position_rmse_m"])

    def test_what_the_player_wrote_is_at_the_top_of_the_summary(self):
        zero = np.zeros(500)
        self.estimates(self.time_s, zero, zero, zero)
        summary = self.summary()
        for key, value in RUN.items():
            self.assertEqual(summary[key], value, key)


class Nees(Case):
    def matched(self, yaw_known, count=4000, scale=1.0):
        """Errors drawn from the covariance published every second epoch; those in between are absurd and must not count."""
        generator = np.random.default_rng(3)
        time_s = 1 + 0.01 * np.arange(count)
        std = generator.uniform(0.02, 0.3, (count, 3))
        mix = np.array([[1.0, 0.0, 0.0], [0.6, 0.8, 0.0], [-0.5, 0.3, np.sqrt(1 - 0.34)]])
        r = mix @ mix.T
        error = (generator.normal(size=(count, 3)) @ mix.T) * std * scale
        published = [None if n % 2 else std[n] for n in range(count)]
        error[1::2] = 100.0
        zero = np.zeros(count)
        truth = self.truth(time_s, zero, zero, zero if yaw_known else None)
        self.estimates(time_s, error[:, 0], error[:, 1], attitude.wrapped(error[:, 2]), std=published, corr=[(r[0, 1], r[0, 2], r[1, 2])] * count)
        brute = []
        for n in range(0, count, 2):
            p = np.outer(std[n], std[n]) * r
            e = np.array([*error[n, :2], attitude.wrapped(error[n, 2])])
            d = 3 if yaw_known else 2
            brute.append(e[:d] @ np.linalg.inv(p[:d, :d]) @ e[:d])
        return truth, np.array(brute)

    def test_errors_drawn_from_the_published_covariance_are_consistent(self):
        for yaw_known, dof in ((True, 3), (False, 2)):
            truth, brute = self.matched(yaw_known)
            fused = self.summary("--truth", truth)["fused"]
            self.assertEqual((fused["nees_dof"], fused["nees_epochs"]), (dof, 2000))
            self.assertAlmostEqual(fused["nees_mean"], brute.mean(), places=6)
            # 2000 independent draws: mean within 4 sigma (variance 2 dof), shares within 4 sigma (binomial)
            self.assertLess(abs(fused["nees_mean"] - dof), 4 * np.sqrt(2 * dof / 2000))
            self.assertLess(abs(fused["nees_inside_95"] - 0.95), 0.02)
            self.assertLess(abs(fused["nees_inside_two_sided_95"] - 0.95), 0.02)

    def test_an_overconfident_estimate_is_seen_as_such(self):
        truth, _ = self.matched(True, scale=2.0)
        fused = self.summary("--truth", truth)["fused"]
        self.assertGreater(fused["nees_mean"], 10.0)
        self.assertLess(fused["nees_inside_95"], 0.7)

    def test_a_timid_estimate_is_outside_of_the_two_sided_interval(self):
        truth, _ = self.matched(True, scale=0.1)
        fused = self.summary("--truth", truth)["fused"]
        self.assertGreater(fused["nees_inside_95"], 0.999)
        self.assertLess(fused["nees_inside_two_sided_95"], 0.1)

    def test_a_covariance_that_is_none_is_counted_and_left_out(self):
        time_s, zero = 1 + 0.01 * np.arange(4), np.zeros(4)
        truth = self.truth(time_s, zero, zero, zero)
        std = [(0.1, 0.1, 0.1), (0.0, 0.1, 0.1), (0.1, 0.1, 0.1), None]
        self.estimates(time_s, zero + 0.1, zero, zero, std=std, corr=[(0, 0, 0), (0, 0, 0), (1.0, 0, 0), (0, 0, 0)])
        fused = self.summary("--truth", truth)["fused"]
        self.assertEqual((fused["nees_epochs"], fused["nees_covariances_not_usable"]), (1, 2))
        self.assertAlmostEqual(fused["nees_mean"], 1.0)


class Innovations(Case):
    def test_verdicts_are_counted_by_sensor_and_nis_is_the_mean_of_the_accepted(self):
        time_s, zero = 1 + 0.01 * np.arange(10), np.zeros(10)
        self.estimates(time_s, zero, zero, zero)
        rows = [[0, 1, 1, 4, 0, 0, 2, 1.0, 0.1, 5, 7], [1, 1, 1, 4, 0, 0, 2, 3.0, 0.1, 5, 7], [2, 1, 1, 4, 0, 1, 2, 20.0, 2.0, 5, 7],
                [3, 1, 1, 4, 0, 4, 2, None, None, 5, 99], [4, 1, 1, 5, 0, 3, 2, None, None, 500, None], [5, 1, 0, 4, 0, 0, 2, 9.0, 1, 5, 7]]
        self.write_rows("innovations.csv", recorded_run.INNOVATIONS, rows)
        measured = self.summary()["fused"]["measurements"]
        landmarks = measured["RangeBearing"]
        self.assertEqual((landmarks["accepted"], landmarks["rejected"], landmarks["other"]), (2, 1, 1))
        self.assertEqual(landmarks["verdicts"], {"Accepted": 2, "Rejected": 1, "UnknownLandmark": 1})
        self.assertAlmostEqual(landmarks["nis_mean"], 2.0)
        self.assertAlmostEqual(landmarks["nis_mean_with_rejected"], 8.0)
        self.assertAlmostEqual(landmarks["nis_inside_95"], 2 / 3)
        self.assertEqual(measured["GnssPosition"], {"accepted": 0, "rejected": 0, "other": 1, "verdicts": {"TooLate": 1}})
        table = self.report("--no-pictures").stdout
        for line in (r"RangeBearing accepted / rejected +2 / 1\n", r"RangeBearing of no landmark on the map +1\n", r"GnssPosition too late +1\n",
                     r"RangeBearing NIS mean, accepted \(2 expected\) .* 2\.00", r"RangeBearing NIS mean, with rejected .* 8\.00"):
            self.assertRegex(table, line)

    def test_names_of_the_bus_s_enumerations_stand_for_their_numbers(self):
        time_s, zero = 1 + 0.01 * np.arange(10), np.zeros(10)
        self.estimates(time_s, zero, zero, zero)
        header = ",".join(recorded_run.INNOVATIONS)
        self.write("innovations.csv", f"{header}\n0,1,1,RangeBearing,0,NotFinite,2,,,5,7\n0,1,1,RangeBearing,0,Accepted,2,1.5,0.1,5,7\n")
        measured = self.summary()["fused"]["measurements"]
        self.assertEqual(measured["RangeBearing"]["verdicts"], {"Accepted": 1, "NotFinite": 1})


class Warnings(Case):
    time_s, zero = 1 + 0.01 * np.arange(40), np.zeros(40)

    def run_with(self, rejected, error_m=0.0, estimator=1, about=RUN):
        truth = self.truth(self.time_s, self.zero, self.zero, self.zero)
        self.estimates(self.time_s, self.zero + error_m, self.zero, self.zero, estimator=estimator, std=[(0.1, 0.1, 0.1)] * 40,
                       corr=[(0, 0, 0)] * 40)
        self.write("run.json", json.dumps(about))
        self.write_rows("innovations.csv", recorded_run.INNOVATIONS,
                        [[n, t, estimator, 4, 0, int(n < rejected), 2, 1.0, 0.1, 5, 7] for n, t in enumerate(self.time_s[:30])])
        result = self.report("--no-pictures", "--truth", truth)
        self.assertEqual(result.returncode, 0, result.stderr)
        lines = [line for line in result.stdout.splitlines() if line.startswith("warning:")]
        self.assertEqual(["warning: " + one for one in json.loads(text_of(self.path("summary.json")))["warnings"]], lines)
        return lines

    def test_more_than_a_third_rejected_is_one_warning_and_a_third_is_none(self):
        self.assertEqual(self.run_with(rejected=10), [])
        self.assertEqual(self.run_with(rejected=11),
                         ["warning: fused rejected 11 of 30 RangeBearing measurements (is rover the robot of this log?)"])

    def test_what_is_wrong_with_the_log_is_told_first(self):
        counts = {"malformed_lines": 0, "frames_not_data": 1, "frames_back_in_time": 15000, "frames_of_wrong_length": 2}
        self.assertEqual(self.run_with(rejected=0, about={**RUN, **counts}),
                         ["warning: 1 remote, error or CAN FD frames skipped", "warning: 15000 frames are earlier than one before them",
                          "warning: 2 input frames have not 8 bytes"])

    def test_an_estimate_far_outside_of_what_it_says_is_warned_of_on_the_same_line(self):
        self.assertEqual(self.run_with(0, error_m=0.99), [])  # NEES 98
        self.assertEqual(self.run_with(0, error_m=1.01), ["warning: NEES mean of fused is 102, not 3 (is rover the robot of this log?)"])
        self.assertEqual(len(self.run_with(11, error_m=1.01)), 1)

    def test_odometry_may_drift_and_a_known_fault_is_named_instead_of_the_robot(self):
        self.assertEqual(self.run_with(0, error_m=2.0, estimator=0), [])
        self.assertIn("(fault kidnapped at 20 s)", self.run_with(0, error_m=2.0, about={**RUN, "fault": "kidnapped@20+0"})[0])

    def test_a_robot_that_never_knew_where_it_is_may_be_the_wrong_one(self):
        self.estimates(self.time_s, self.zero, self.zero, self.zero, valid=[0] * 40)
        self.assertIn("warning: fused never had a valid position (is rover the robot of this log?)\n", self.report("--no-pictures").stdout)

    def test_a_robot_without_a_position_is_named_with_the_mode_in_which_it_stayed(self):
        self.estimates(self.time_s, self.zero, self.zero, self.zero, valid=[0] * 40)
        mode = {word: number for number, word in recorded_run.code_names()["Mode"].items()}
        self.write_rows("status.csv", recorded_run.STATUS, [[n, self.time_s[n], mode["Boot" if n < 10 else "Aligning"], 0, 0, 0, 0] for n in range(40)])
        self.assertIn(f"fused never had a valid position: its mode was Aligning for the last {self.time_s[-1] - self.time_s[10]:.0f} s (is rover the robot of this log?)",
                      self.report("--no-pictures").stdout)

    def counted(self, accepted, estimator=1, sensor="WheelCounts"):
        code = {word: number for number, word in recorded_run.code_names()["Sensor"].items()}[sensor]
        self.write_rows("sensors.csv", recorded_run.SENSORS, [[n, self.time_s[n], estimator, code, 0, accepted * (n + 1) // 40, 0, None, 0] for n in range(40)])
        return code

    def test_measurements_that_are_only_counted_are_not_reported_as_none(self):
        """Accepted wheel counts have no frame each; one that was too late has."""
        self.estimates(self.time_s, self.zero, self.zero, self.zero)
        self.write_rows("innovations.csv", recorded_run.INNOVATIONS, [[0, 1.0, 1, self.counted(1197), 0, 3, 0, None, None, 0, None]])
        said = self.report("--no-pictures").stdout
        self.assertRegex(said, r"WheelCounts accepted / rejected +1197 / 0\n")
        self.assertRegex(said, r"WheelCounts too late +1\n")
        self.assertNotIn("WheelCounts NIS", said)

    def test_wheels_that_are_used_without_noise_are_named_in_one_sentence(self):
        self.estimates(self.time_s, self.zero, self.zero, self.zero)
        parameters = {"wheels.drive.noise_left": 0, "wheels.drive.noise_right": 0, "wheels.wheel_speed_noise": 0, "wheels.noise.speed": 0, "wheels.noise.speed_per_speed": 0.002}

        def warned(accepted, sensor, **changed):
            self.counted(accepted, sensor=sensor)
            self.write("run.json", json.dumps({**RUN, "parameters": {**parameters, **changed}}))
            return [line for line in self.report("--no-pictures").stdout.splitlines() if line.startswith("warning")]
        self.assertEqual(warned(100, "WheelCounts"), ["warning: WheelCounts are used, but wheels.drive.noise_left and wheels.drive.noise_right are 0: the covariance does not "
                                                      "grow with the way (docs/tutorial/your_robot.md has usual values)"])
        self.assertIn("but wheels.drive.noise_right is 0", warned(100, "WheelCounts", **{"wheels.drive.noise_left": 0.002})[0])
        self.assertEqual(warned(100, "WheelCounts", **{"wheels.drive.noise_left": 0.002, "wheels.drive.noise_right": 0.002}), [])
        self.assertEqual(warned(0, "WheelCounts"), [])
        self.assertEqual(warned(100, "BodySpeed"), [])
        one = warned(100, "BodySpeed", **{"wheels.noise.speed_per_speed": 0})
        self.assertEqual([line.split(", but")[0] for line in one], ["warning: BodySpeed is used"])
        self.assertEqual(len(warned(100, "WheelSpeed")), 1)
        self.assertEqual(warned(100, "WheelSpeed", **{"wheels.wheel_speed_noise": 1e-5}), [])

    def test_a_fault_after_the_end_did_not_happen(self):
        lines = self.run_with(0, about={**RUN, "fault": "kidnapped@20+0,imu_stuck@0.1+3"})
        self.assertEqual(lines, ["warning: fault kidnapped at 20 s, after the end of the run (0 s): it did not happen"])

    def test_the_likeliest_fault_is_one_line(self):
        self.estimates(self.time_s, self.zero, self.zero, self.zero)
        self.assertNotIn("likeliest", self.report("--no-pictures").stdout)
        words = "GnssEast 99.8 m, 1 sigma 0.4 m, probability 0.998, 31.2 s after the start"
        self.write("run.json", json.dumps({**RUN, "likeliest_fault": words}))
        self.assertIn(f"\nlikeliest fault: {words}\n", self.report("--no-pictures").stdout)

    def test_what_a_repeated_log_was_compared_by_is_one_line(self):
        self.estimates(self.time_s, self.zero, self.zero, self.zero)
        self.assertNotIn("repeated", self.report("--no-pictures").stdout)
        self.write("run.json", json.dumps({**RUN, "epochs_compared": 21368, "epochs_different": 0}))
        said = self.report("--no-pictures").stdout
        self.assertIn("\nrepeated: 21368 epochs compared with the log's own, byte for byte, 0 different\n", said)
        self.assertNotIn("hole:", said)
        self.write("run.json", json.dumps({**RUN, "epochs_compared": 900, "epochs_different": 0, "unlogged": 12, "hole_s": 9.01, "hole": "Unlogged"}))
        self.assertIn("\nhole: Unlogged; 12 epochs behind it are not repeated\n", self.report("--no-pictures").stdout)
        summary = json.loads(text_of(self.path("summary.json")))
        self.assertEqual([summary[key] for key in ("epochs_compared", "epochs_different", "unlogged")], [900, 0, 12])


class Faults(Case):
    def test_fault_times_are_told_by_epoch_also_when_the_clock_of_the_run_jumps(self):
        time_s = np.where(np.arange(300) >= 200, 4.0, 1.0) + 0.01 * np.arange(300)
        zero = np.zeros(300)
        self.estimates(time_s, zero, zero, zero)  # epoch n is at time_s[n]
        self.write("run.json", json.dumps({**RUN, "fault": "clock_jump@1+1.5,kidnapped@0.5+0,gnss_jump"}))
        run = recorded_run.Run(self.directory)
        spans = recorded_run.fault_spans(run)
        self.assertEqual([name for name, _, _ in spans], ["clock_jump", "kidnapped"])
        np.testing.assert_allclose([span[1:] for span in spans], [(2.0, 6.5), (1.5, 1.5)], atol=1e-9)
        self.assertEqual([one.words for one in recorded_run.faults(run)], ["clock_jump at 1 s for 1.5 s", "kidnapped at 0.5 s", "gnss_jump"])
        result = self.report()
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("fault: clock_jump at 1 s for 1.5 s, kidnapped at 0.5 s, gnss_jump\n", result.stdout)

    def test_pictures_and_words_count_from_the_start_of_the_worlds_run_as_its_faults_do(self):
        """The node's clock begins the run at 1 s: a fault at 1 s is one of its second 2."""
        time_s, zero = 1 + 0.01 * np.arange(300), np.zeros(300)  # epoch n at 1 s + n ticks
        truth = self.truth(time_s, zero, zero, zero)
        self.estimates(time_s, zero, zero, zero, std=[(0.1, 0.1, 0.1)] * 300, corr=[(0, 0, 0)] * 300)
        epochs = np.arange(10, 300, 10)
        self.write_rows("status.csv", recorded_run.STATUS, [[n, 1 + 0.01 * n, 4 if 100 <= n < 200 else 3, 1, 2 if 100 <= n < 200 else 0, 0, 0] for n in epochs])
        about = {**RUN, "fault": "gnss_jump@1+1"}
        self.write("run.json", json.dumps(about))
        run = recorded_run.Run(self.directory)
        shown = run.since(recorded_run.start_s(run))
        self.assertEqual(recorded_run.start_s(run), 1.0)
        np.testing.assert_allclose(recorded_run.fault_spans(shown)[0][1:], (1.0, 2.0), atol=1e-9)
        np.testing.assert_array_equal(shown.of(1)["x_m"], run.of(1)["x_m"])
        self.assertEqual(self.report("--truth", truth).returncode, 0)
        self.assertIn('<td>1.0 s</td><td class="text">fault Rejecting, for 1.0 s</td>', text_of(self.path("report.html")))
        self.assertIn('<td>1.0 s</td><td class="text">the world: gnss_jump, for 1.0 s</td>', text_of(self.path("report.html")))
        # A log that no world was asked for has the node's time only.
        del about["seed"]
        self.write("run.json", json.dumps(about))
        self.assertEqual(recorded_run.start_s(recorded_run.Run(self.directory)), 0.0)

    def test_a_board_that_ticked_before_the_world_began_counts_from_the_worlds_start(self):
        time_s, zero = 0.3 + 0.01 * np.arange(500), np.zeros(500)
        self.estimates(time_s, zero, zero, zero)
        self.write("run.json", json.dumps({**RUN, "fault": "gnss_jump@1+1", "world_start_s": 1.5}))
        run = recorded_run.Run(self.directory)
        self.assertEqual(recorded_run.start_s(run), 1.5)
        np.testing.assert_allclose(recorded_run.fault_spans(run)[0][1:], (2.5, 3.5), atol=1e-9)
        np.testing.assert_allclose(recorded_run.fault_spans(run.since(1.5))[0][1:], (1.0, 2.0), atol=1e-9)

    def test_a_log_with_stamps_of_the_calendar_is_shown_from_its_first_estimate_and_says_which_that_is(self):
        time_s, zero = 1763900000.25 + 0.01 * np.arange(300), np.zeros(300)
        self.estimates(time_s, zero, zero, zero)
        self.write_rows("status.csv", recorded_run.STATUS, [[n, time_s[n], 4 if 100 <= n < 200 else 3, 1, 2 if 100 <= n < 200 else 0, 0, 0] for n in range(10, 300, 10)])
        self.write("run.json", json.dumps({key: value for key, value in RUN.items() if key != "seed"}))
        self.assertEqual(self.report().returncode, 0)
        page = text_of(self.path("report.html"))
        self.assertIn('<td>1.0 s</td><td class="text">fault Rejecting, for 1.0 s</td>', page)
        self.assertIn("1763900000.250000 s on the log", page)

    def test_a_truth_of_another_clock_is_an_error_that_names_both(self):
        time_s, zero = 1 + 0.01 * np.arange(300), np.zeros(300)
        self.estimates(time_s, zero, zero, zero)
        done = self.report("--no-pictures", "--truth", self.truth(1763900000 + time_s, zero, zero, zero))
        self.assertEqual((done.returncode, done.stdout), (1, ""))
        self.assertIn("no row meets an estimate: the truth is of 1763900001.000000 to", done.stderr)

    def test_a_part_of_a_worlds_log_is_compared_by_time_and_a_clock_that_jumps_by_epoch(self):
        epoch, zero = np.arange(600), np.zeros(600)
        self.write_rows("t.truth.csv", [*ground_truth.TRUTH, "epoch"], zip(1 + 0.01 * epoch, 0.01 * epoch, zero, zero, epoch))
        for since, jump_s in ((300, 0), (0, 3)):
            time_s = 1 + 0.01 * epoch[since:] + jump_s * (epoch[since:] > 450)
            self.estimates(time_s, 0.01 * epoch[since:], zero[since:], zero[since:])
            self.write("run.json", json.dumps({key: value for key, value in RUN.items() if key != "seed"}))
            self.assertEqual(self.report("--no-pictures", "--truth", self.path("t.truth.csv")).returncode, 0)
            with open(self.path("summary.json"), encoding="utf-8") as file:
                self.assertLess(json.load(file)["position_rmse_m"], 1e-6, since)

    def test_no_fault_is_no_line(self):
        zero = np.zeros(20)
        for none in ("", "none"):
            self.estimates(1 + 0.01 * np.arange(20), zero, zero, zero)
            self.write("run.json", json.dumps({**RUN, "fault": none}))
            self.assertNotIn("fault:", self.report("--no-pictures").stdout)


class Axes(Case):
    def errors_picture(self, jump_m):
        from tetap.report import pictures
        n = 400
        time_s, zero = 1 + 0.01 * np.arange(n), np.zeros(n)
        truth = ground_truth.Truth(self.truth(time_s, zero, zero, zero))
        self.estimates(time_s, np.where(np.arange(n) == 200, jump_m, 0.01), zero, zero, std=[(0.1, 0.1, 0.1)] * n, corr=[(0, 0, 0)] * n)
        self.write("run.json", json.dumps({**RUN, "fault": "kidnapped@2+1"}))
        return pictures.errors(recorded_run.Run(self.directory), truth, 1, "t").axes

    def test_a_jump_leaves_the_band_visible_and_is_visible_itself(self):
        x, y = self.errors_picture(8.0)[:2]
        self.assertEqual((x.get_yscale(), y.get_yscale()), ("symlog", "linear"))
        at = x.transAxes.inverted().transform(x.transData.transform([(0, 0.0), (0, 0.3), (0, 8.0)]))[:, 1]
        self.assertGreater(at[1] - at[0], 0.15)  # 3 sigma above the middle, as a share of the height
        self.assertLess(at[2], 1.0)
        self.assertGreater(at[2] - at[1], 0.1)

    def test_without_a_jump_the_axis_is_linear(self):
        self.assertEqual(self.errors_picture(0.4)[0].get_yscale(), "linear")

    def test_the_largest_value_of_the_bus_is_marked_as_so_much_or_more(self):
        from tetap.report import pictures
        zero = np.zeros(20)
        self.estimates(1 + 0.01 * np.arange(20), zero, zero, zero)
        smallest, largest = recorded_run.limits("Est_Innov", "Nis")
        self.assertEqual(smallest, 0.1)
        for nis, marked in ((largest, 1), (largest - 1, 0)):
            self.write_rows("innovations.csv", recorded_run.INNOVATIONS,
                            [[n, 1 + n, 1, 4, 0, int(n == 3), 2, nis if n == 3 else 1.0, 0.1, 5, 7] for n in range(10)])
            axes = pictures.nis(recorded_run.Run(self.directory), 1, recorded_run.code_names(), "t").axes[0]
            points = {line.get_marker(): len(line.get_xdata()) for line in axes.lines if line.get_linestyle() == "None"}
            self.assertEqual((points["^"], points["x"]), (marked, 1 - marked))
            self.assertEqual("819 or more" in [text.get_text() for text in axes.get_legend().get_texts()], bool(marked))


class Pictures(Case):
    def run_with_everything(self, about=None, yaw=True):
        time_s = 1 + 0.01 * np.arange(300)
        x, y = np.cos(time_s), np.sin(time_s)
        heading = attitude.wrapped(time_s + np.pi / 2)
        truth = self.truth(time_s, x, y, heading if yaw else None, about)
        std = [None if n % 5 else (0.1, 0.1, 0.05) for n in range(300)]
        odometry = self.estimates(time_s, x + 0.1 * (time_s - 1), y, heading, estimator=0, std=std, corr=[(0.1, 0, 0)] * 300)
        self.estimates(time_s, x + 0.02, y, heading, std=std, corr=[(0.1, 0, 0)] * 300, more=odometry)
        self.write_rows("innovations.csv", recorded_run.INNOVATIONS,
                        [[n, t, 1, 4, 0, int(n % 50 == 0), 2, 15.0 if n % 50 == 0 else 1.0, 0.1, 5, 7] for n, t in enumerate(time_s)])
        self.write_rows("status.csv", recorded_run.STATUS, [[n, t, 3 if n > 50 else 1, 24, n // 250, n // 280, 2] for n, t in enumerate(time_s)])
        return truth

    def test_the_page_is_one_file_that_needs_no_network_and_shows_every_picture(self):
        truth = self.run_with_everything({"truth": "vicon", "landmarks": [{"id": 7, "x_m": 2.0, "y_m": 1.0}]})
        result = self.report("--truth", truth, "--title", "a <run> & its title")
        self.assertEqual(result.returncode, 0, result.stderr)
        page = text_of(self.path("report.html"))
        sources = re.findall(r'(?:src|href)="([^"]{0,30})', page)
        self.assertEqual(len(sources), 4)
        self.assertTrue(all(source.startswith("data:image/png;base64,") for source in sources))
        self.assertNotIn("http", re.sub(r"base64,[^\"]*", "", page))
        self.assertIn("a &lt;run&gt; &amp; its title", page)
        for name in ("path", "errors", "nis", "timeline"):
            with open(self.path(f"{name}.png"), "rb") as file:
                head = file.read(24)
            self.assertEqual(head[:8], b"\x89PNG\r\n\x1a\n")
            self.assertGreater(int.from_bytes(head[16:20], "big"), 800)
        for text in ("position RMSE", "fused", "odometry", "RangeBearing accepted / rejected",
                     "RangeBearing NIS mean, with rejected", "NisMean on the bus"):
            self.assertIn(text, page)
            self.assertIn(text, result.stdout)

    def mapped_run(self):
        """A robot on a circle among three landmarks that it maps without identities; one of its sightings is given to a wrong landmark."""
        time_s = 1 + 0.01 * np.arange(300)
        heading = attitude.wrapped(time_s + np.pi / 2)
        marks = [{"id": 1, "x_m": 3.0, "y_m": 0.0}, {"id": 2, "x_m": -3.0, "y_m": 1.0}, {"id": 3, "x_m": 0.0, "y_m": 4.0}]
        truth = self.truth(time_s, np.cos(time_s), np.sin(time_s), heading, {"truth": "vicon", "landmarks": marks})
        std = [None if n % 5 else (0.1, 0.1, 0.05) for n in range(300)]
        self.estimates(time_s, np.cos(time_s) + 0.02, np.sin(time_s), heading, std=std, corr=[(0.1, 0, 0)] * 300)
        kind = recorded_run.ESTIMATES.index("kind")
        lines = [line.split(",") for line in text_of(self.path("estimates.csv")).splitlines()]
        self.write("estimates.csv", "\n".join(",".join(field if i != kind or not number else "EkfSlam" for i, field in enumerate(line)) for number, line in enumerate(lines)) + "\n")
        seen = [(n, t, 1 + n // 20 % 3) for n, t in enumerate(time_s) if n % 20 == 0]
        self.write_rows("t.sightings.csv", own_map.SIGHTINGS, [(t - 0.1, landmark if n != 100 else 255) for n, t, landmark in seen])
        self.write_rows("innovations.csv", recorded_run.INNOVATIONS, [self.innovation(n, t, 255 - landmark) for n, t, landmark in seen])
        self.write_rows("map.csv", own_map.MAP, [[n, t, 254 - n // 10 % 3, marks[n // 10 % 3]["x_m"] + 0.1, marks[n // 10 % 3]["y_m"], 0.1, 0.2, 0.0, 9, 1, 1]
                                                 for n, t in enumerate(time_s) if n % 10 == 0])
        self.write_rows("status.csv", recorded_run.STATUS, [[n, t, 3, 24, 0, 0, 2] for n, t in enumerate(time_s)])
        return truth

    @staticmethod
    def innovation(n, time_s, landmark):
        values = dict.fromkeys(recorded_run.INNOVATIONS, 0.0) | {"epoch": n, "time_s": time_s, "estimator": 1, "sensor": 4, "dof": 2, "nis": 1.0, "age_ms": 100.0, "landmark": landmark}
        return [values[name] for name in recorded_run.INNOVATIONS]

    def test_a_robot_that_maps_has_pictures_of_its_map_and_figures_of_both(self):
        truth = self.mapped_run()
        result = self.report("--truth", truth)
        self.assertEqual(result.returncode, 0, result.stderr)
        for name in ("map", "map_nees"):
            self.assertTrue(os.path.getsize(self.path(f"{name}.png")) > 10_000, name)
        found = json.loads(text_of(self.path("summary.json")))
        # Two of the 15 were seen before their landmark was first published.
        self.assertEqual((found["wrong_associations"], found["fused"]["associations_judged"]), (1, 13))
        self.assertAlmostEqual(found["map_rmse_m"], 0, 6)  # shifted as a whole
        self.assertAlmostEqual(found["fused"]["landmark_nees_mean"], 1, 6)  # by one sigma of x
        self.assertIn("Consistency of pose and map", text_of(self.path("report.html")))

    def test_the_page_begins_with_one_sentence_and_the_long_table_follows_the_pictures(self):
        truth = self.run_with_everything()
        self.assertEqual(self.report("--truth", truth).returncode, 0)
        page = text_of(self.path("report.html"))
        fused = json.loads(text_of(self.path("summary.json")))["fused"]
        sentence = re.search(r'<p class="headline">(.*?)</p>', page)[1]
        self.assertIn(f"was within {fused['position_rmse_m']:.2f} m", sentence)
        self.assertIn(f"at worst {fused['max_error_m']:.2f} m", sentence)
        self.assertLess(page.index('class="headline"'), page.index("<img"))
        self.assertLess(page.rindex("<img"), page.index("position RMSE"))

    def test_the_sentences_of_the_page_are_those_of_the_documents(self):
        from tetap.docs import language
        truth = self.run_with_everything()
        self.write("run.json", json.dumps({**RUN, "fault": "kidnapped@0.1+0.1"}))
        self.assertEqual(self.report("--truth", truth).returncode, 0)
        page = text_of(self.path("report.html"))
        prose = [re.sub(r"<[^>]+>", "", one) for one in re.findall(r"<p[^>]*>(.*?)</p>", page, re.S)]
        self.assertGreater(len(prose), 5)
        self.assertEqual([one for text in prose for one in language.findings("report", text)], [])

    def test_a_fault_of_the_world_is_named_once_and_in_no_title(self):
        truth = self.run_with_everything()
        self.write("run.json", json.dumps({**RUN, "fault": "kidnapped@0.1+0.1"}))
        self.assertEqual(self.report("--truth", truth).returncode, 0)
        page = text_of(self.path("report.html"))
        self.assertEqual(len(re.findall(r"<p>[^<]*kidnapped at 0.1 s for 0.1 s[^<]*</p>", page)), 1)
        for title in re.findall(r"<(?:h1|h2|title)>(.*?)</", page):
            self.assertNotIn("kidnapped", title)

    def test_a_band_of_ten_times_the_error_is_explained_and_a_narrow_one_is_not(self):
        from tetap.report import pictures
        error, sigma = np.full(50, 0.1), np.full(50, 0.4)
        words = pictures.wide_bands([("east", error, sigma), ("north", error, sigma / 4)])
        self.assertIn("east (12 times)", words)
        self.assertNotIn("north", words)
        self.assertEqual(pictures.wide_bands([("north", error, sigma / 4)]), "")

    def test_raw_fixes_lie_where_their_degrees_are(self):
        from tetap.report import fixes
        # A minute of arc of a meridian is a nautical mile, 1 852 m, at 45 deg north.
        north, east = fixes.metres_per_degree(45.0)
        self.assertAlmostEqual(north / 60, 1852.2, delta=0.2)
        self.assertAlmostEqual(fixes.metres_per_degree(0.0)[1], 111319.49, delta=0.01)
        self.assertLess(east, north)
        self.assertIsNone(fixes.raw_fixes(self.directory))

    def encoded(self, *lines):
        return subprocess.run([os.path.join(TOOLS, "can", "encode_frame"), "-"], input="\n".join(lines) + "\n", capture_output=True, text=True, check=True).stdout

    def test_fixes_lie_about_the_origin_that_the_node_published_also_of_two_receivers(self):
        """A thousandth of a degree north at 45 deg north is 111.13 m (WGS84: 111 131.7 m a degree of latitude there)."""
        from tetap.report import fixes
        own = self.encoded("In_GnssLat Inst=0 Seq=1 Lat=45.001 --time 1.0", "In_GnssLat Inst=1 Seq=1 Lat=45.002 --time 1.0", "In_GnssLon Inst=0 Seq=1 Lon=11 --time 1.0",
                           "In_GnssLon Inst=1 Seq=1 Lon=11.001 --time 1.0", "In_GnssLon Inst=0 Seq=2 Lon=11 --time 1.1")
        self.write("raw.log", own)
        self.assertIsNone(fixes.raw_fixes(self.directory))
        self.write("raw.log", own + self.encoded("Est_Origin Sel=Lat Source=Configured Lat=45 --time 1.0", "Est_Origin Sel=Lon Source=Configured Lon=11 --time 1.1"))
        east, north = fixes.raw_fixes(self.directory)
        np.testing.assert_allclose(north, [111.1317, 222.2634], atol=0.01)
        np.testing.assert_allclose(east, [0.0, 78.8468], atol=0.01)

    def test_a_truth_of_another_origin_is_turned_into_the_map_of_the_node(self):
        """Places by latitude and longitude, put into the plane of each origin through degrees alone (from_enu, whose inverse is another function)."""
        from tetap.dataset import inertial
        time_s = 1 + 0.1 * np.arange(60)
        of, to = (48.0, 11.0, 500.0), (48.05, 11.1, 512.0)  # 9 km apart
        x, y = 40.0 * np.cos(time_s), 30.0 * np.sin(time_s)
        lat, lon, height = inertial.from_enu(np.stack([x, y, np.zeros(60)]), of)
        east, north, _ = inertial.to_enu(*(np.concatenate([[first], rest]) for first, rest in zip(to, (lat, lon, height))))[:, 1:]
        # Meridians converge northwards: the north of an origin 0.1 deg further west leans to the east.
        convergence = np.radians(0.1) * np.sin(np.radians(48.025))
        truth = self.truth(time_s, x, y, np.full(60, 0.3), {"truth_origin": dict(zip(("lat_deg", "lon_deg", "height_m"), of))})
        self.estimates(time_s, east, north, np.full(60, 0.3 - convergence))
        self.assertIn("does not have", self.report("--truth", truth).stderr)
        self.write("raw.log", self.encoded(*(f"Est_Origin Sel={page} Source=FirstFix {page}={value} --time 1.0" for page, value in zip(("Lat", "Lon", "Height"), to))))
        fused = self.summary("--truth", truth)["fused"]
        self.assertLess(fused["max_error_m"], 0.002)
        self.assertLess(fused["heading_rmse_deg"], 0.01)
        self.assertIn("the truth was turned into the map of Est_Origin, 930", self.report("--truth", truth, "--no-pictures").stdout)
        self.write("t.json", json.dumps({"truth_origin": {"lat_deg": 48}}))
        self.assertIn("truth_origin is not {lat_deg, lon_deg, height_m} in numbers", self.report("--truth", truth).stderr)
        self.write("t.json", "{}")  # without the word the truth stays where it is
        self.assertGreater(self.summary("--truth", truth)["fused"]["max_error_m"], 9000)

    def test_without_pictures_only_the_summary_is_written(self):
        truth = self.run_with_everything()
        before = set(os.listdir(self.directory))
        self.assertEqual(self.report("--truth", truth, "--no-pictures").returncode, 0)
        self.assertEqual(set(os.listdir(self.directory)) - before, {"summary.json"})

    def test_a_gps_track_is_called_a_reference_and_nothing_is_said_of_consistency(self):
        truth = self.run_with_everything({"truth": "gps track"}, yaw=False)
        result = self.report("--truth", truth)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("end-point difference", result.stdout)
        for word in ("RMSE", "NEES"):
            self.assertNotIn(word, result.stdout)
        summary = json.loads(text_of(self.path("summary.json")))
        self.assertTrue(summary["truth"]["is_reference"])
        self.assertIsNone(summary["fused"]["nees_mean"])
        self.assertAlmostEqual(summary["odometry"]["final_error_m"], 0.1 * 2.99, places=6)
        self.assertIn("not truth", text_of(self.path("report.html")))

    def test_pictures_are_drawn_without_truth_innovations_or_any_valid_estimate(self):
        time_s, zero = 1 + 0.01 * np.arange(20), np.zeros(20)
        self.estimates(time_s, zero, zero, zero, valid=np.zeros(20))
        result = self.report()
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertTrue(os.path.exists(self.path("path.png")))

    def test_no_file_is_written_through_a_link(self):
        time_s, zero = 1 + 0.01 * np.arange(20), np.zeros(20)
        self.estimates(time_s, zero, zero, zero)
        names = ("path.png", "summary.json", "report.html")
        for name in names:
            os.symlink(self.path(f"elsewhere.{name}"), self.path(name))
        self.assertEqual(self.report().returncode, 0)
        for name in names:
            self.assertFalse(os.path.exists(self.path(f"elsewhere.{name}")), name)
            self.assertFalse(os.path.islink(self.path(name)), name)

    def test_parameters_that_are_set_take_a_few_lines_of_the_terminal(self):
        def shown(count):
            self.estimates(1 + 0.01 * np.arange(20), *[np.zeros(20)] * 3)
            self.write("run.json", json.dumps({**RUN, "numbers": ", ".join(f"wheels.drive.part{n} {n}.5" for n in range(count))}))
            said = self.report("--no-pictures").stdout
            self.assertLessEqual(max(map(len, said.splitlines())), 200)
            return said[said.index("parameters that are set: "):].splitlines()
        self.assertEqual(shown(2)[0], "parameters that are set: wheels.drive.part0 0.5, wheels.drive.part1 1.5")
        many = shown(200)
        self.assertLessEqual(max(map(len, many[:4])), 110)
        self.assertEqual(many[3], "  ... the rest is in run.json")

    def test_numbers_that_are_none_are_null_in_the_summary(self):
        truth = self.run_with_everything(yaw=False)
        self.report("--truth", truth, "--no-pictures")
        text = text_of(self.path("summary.json"))
        self.assertNotIn("NaN", text)
        self.assertIsNone(json.loads(text)["heading_rmse_deg"])


class BadInput(Case):
    def refused(self, *words, truth=None):
        result = self.report("--no-pictures", *(["--truth", truth] if truth else []))
        self.assertEqual(result.returncode, 1, result.stderr)
        self.assertEqual(result.stderr.count("\n"), 1, result.stderr)
        for word in words:
            self.assertIn(word, result.stderr)
        self.assertFalse(os.path.exists(self.path("summary.json")))

    def test_file_line_and_reason_are_named(self):
        time_s, zero = 1 + 0.01 * np.arange(5), np.zeros(5)
        self.estimates(time_s, zero, zero, zero)
        good = text_of(self.path("estimates.csv"))
        lines = good.splitlines()
        for text, words in ((good.replace("pos_valid", "valid", 1), ("estimates.csv:1", "no column 'pos_valid'")),
                            ("\n".join(lines[:3] + [lines[3] + ",1"] + lines[4:]) + "\n", ("estimates.csv:4", "20 columns, expected 19")),
                            ("\n".join(lines[:3] + [lines[3].replace("1.02,", "later,")] + lines[4:]) + "\n", ("estimates.csv:4", "later")),
                            ("\n".join(lines[:3] + [lines[3][:20]]), ("estimates.csv:4", "columns")),
                            (lines[0] + "\n", ("estimates.csv", "no estimate in it")),
                            ("", ("estimates.csv:1", "no column"))):
            with self.subTest(words=words):
                self.write("estimates.csv", text)
                self.refused(*words)

    def test_missing_or_broken_files_are_named(self):
        self.refused("run.json", "No such file")
        time_s, zero = 1 + 0.01 * np.arange(5), np.zeros(5)
        self.estimates(time_s, zero, zero, zero)
        self.write("run.json", "{\n  \"a\": ,\n}")
        self.refused("run.json:2", "not JSON")
        self.write("run.json", "[1]")
        self.refused("run.json:1", "not a JSON object")
        self.write("run.json", "{}")
        self.refused("nowhere.csv", "No such file", truth=self.path("nowhere.csv"))

    def test_a_truth_that_goes_back_or_has_no_position_is_refused(self):
        time_s, zero = 1 + 0.01 * np.arange(5), np.zeros(5)
        self.estimates(time_s, zero, zero, zero)
        self.refused("t.truth.csv", "row 3: time goes back", truth=self.truth([1, 2, 1.5], [0] * 3, [0] * 3))
        self.refused("t.truth.csv", "row 2 has no x_m", truth=self.truth([1, 2, 3], [0, None, 0], [0] * 3))
        self.refused("t.truth.csv", "fewer than two rows", truth=self.truth([1], [0], [0]))


class Tables(Case):
    """Read in blocks and kept in few bytes, a table still says what its text says."""
    columns = ["epoch", "time_s", "kind", "x_m", "y_m", "verdict"]

    def setUp(self):
        super().setUp()
        block = tables.BLOCK
        self.addCleanup(setattr, tables, "BLOCK", block)

    def rows(self, count):
        random = np.random.default_rng(4)
        odd = ["-0.000", "0.1", "1e300", "-2.5e-7", "", "123456789.125", "-32.768", "2147483.648", "12", "nan", "0.30000000000000004"]
        for n in range(count):
            time_s = f"{1763900000 + 0.01 * n:.6f}" if n < count // 2 else f"{0.01 * n:.6f}"
            y = odd[random.integers(len(odd))] if n > count // 3 else f"{random.normal(0, 20):.3f}"
            yield [str(n), time_s, ["Odometry", "Ekf", "3", ""][n % 4], f"{random.normal(0, 1):.4f}" if n % 3 else "", y, ["Rejected", "Accepted", " Stale "][n % 3]]

    def test_every_number_is_the_float_of_its_text_whatever_the_blocks(self):
        codes = bus_writer.Dbc().tables
        names = {"kind": codes["EstimatorKind"], "verdict": codes["Verdict"]}
        rows = list(self.rows(700))
        text = "# a comment\n" + ",".join(self.columns) + "\n" + "".join(",".join(row) + "\n" for row in rows)
        expected = {name: [float(names.get(name, {}).get(row[i].strip(), row[i].strip()) if row[i] else "nan") for row in rows]
                    for i, name in enumerate(self.columns)}
        for ends, last in (("\n", True), ("\r\n", True), ("\n", False)):
            with open(self.path("a.csv"), "w", encoding="utf-8", newline="") as file:
                file.write(text.replace("\n", ends) if last else text[:-1])
            for tables.BLOCK in (1, 37, 1000, 1 << 22):
                table = tables.read_table(self.path("a.csv"), self.columns)
                for name, values in expected.items():
                    # Bits, not values: minus zero is another number than zero.
                    np.testing.assert_array_equal(table[name].view(np.int64), np.array(values).view(np.int64), f"{name}, blocks of {tables.BLOCK}")

    def test_a_part_of_a_table_is_its_rows_and_keeps_its_time(self):
        self.write("a.csv", "time_s,x_m\n" + "".join(f"{n}.5,{n}\n" for n in range(10)))
        later = tables.read_table(self.path("a.csv"), ["time_s", "x_m"]).since(2.0)
        odd = later.where(later["x_m"] % 2 == 1)
        some = odd.where(odd["x_m"] > 4)
        np.testing.assert_array_equal(some["x_m"], [5, 7, 9])
        np.testing.assert_array_equal(some["time_s"], [3.5, 5.5, 7.5])
        self.assertIn("x_m", some)
        self.assertNotIn("y_m", some)

    def test_a_wrong_line_in_a_later_block_is_named_as_in_the_first(self):
        good = "".join(f"{n},{n}.5\n" for n in range(100))
        for wrong, words in (("7,later\n", "a.csv:102: .*later"), ("7\n", "a.csv:102: 1 columns, expected 2"), ("7,1,2\n", "a.csv:102: 3 columns, expected 2"),
                             ("\n", "a.csv:102: 1 columns, expected 2"), ("Ekf,1\n", "a.csv:102: .*Ekf")):
            for after in ("", "8,1\n"):
                self.write("a.csv", "epoch,time_s\n" + good + wrong + after)
                for tables.BLOCK in (10, 1 << 22):
                    with self.subTest(wrong=wrong, after=after, block=tables.BLOCK), self.assertRaisesRegex(tables.BadInput, words):
                        tables.read_table(self.path("a.csv"), ["epoch", "time_s"])

    def test_lines_without_anything_are_no_rows(self):
        for text in ("", "\n", " \n\n\n"):
            self.write("a.csv", "epoch,time_s\n" + text)
            for tables.BLOCK in (1, 1 << 22):
                self.assertEqual(len(tables.read_table(self.path("a.csv"), ["epoch"])["epoch"]), 0)

    def test_a_long_table_takes_a_third_of_its_floats_and_its_reading_not_much_more(self):
        count = 30_000
        random = np.random.default_rng(8)
        self.write("a.csv", ",".join(recorded_run.ESTIMATES) + "\n" + "".join(
            f"{n},{1 + 0.01 * n:.6f},2,Inertial,{x:.3f},{y:.3f},{yaw:.4f},{x / 9:.3f},{y / 9:.4f},,,,,,,1,1,,\n"
            for n, (x, y, yaw) in enumerate(random.uniform(-3, 3, (count, 3)))))
        tables.BLOCK = 1 << 16
        tracemalloc.start()
        self.addCleanup(tracemalloc.stop)
        table = tables.read_table(self.path("a.csv"), recorded_run.ESTIMATES)
        held, most = tracemalloc.get_traced_memory()
        floats = count * len(recorded_run.ESTIMATES) * 8
        self.assertLess(held, floats / 3)
        self.assertLess(most, floats / 2)
        self.assertEqual(len(table["x_m"]), count)


class Inertial(Case):
    """What is said of all fifteen states, against draws and closed forms."""
    count = 4000
    std = {"position": 0.3, "velocity": 0.05, "attitude": 0.01, "gyro bias": 2e-4, "acc bias": 0.02}
    # Of first and second, first and third, second and third.
    corr = {"position": (0.9, 0.3, 0.2), "velocity": (-0.95, 0.3, -0.2), "attitude": (0.2, -0.6, 0.5), "gyro bias": (0.7, 0.1, 0.6), "acc bias": (0, 0, 0.98)}

    def test_two_attitudes_that_come_in_different_epochs_are_compared_at_the_same_time(self):
        """A turn of 1 rad/s: 50 ms apart the same attitude is 2.9 deg apart, unless one is brought to the other's time."""
        def yawed(epoch):
            half = 0.5 * recorded_run.TICK_S * np.asarray(epoch, dtype=float)  # 1 rad/s
            return np.stack([np.cos(half), 0 * half, 0 * half, np.sin(half)], axis=1)
        one, other = 10.0 * np.arange(80) + 3, 10.0 * np.arange(80) + 8
        tilt, heading = attitude.apart(yawed(other), attitude.attitudes_at(one, yawed(one), other, 20))
        self.assertEqual(int(np.isfinite(heading).sum()), 79)  # none behind the last
        self.assertLess(np.degrees(np.nanmax(np.abs(heading))), 0.01)
        self.assertLess(np.degrees(np.nanmax(tilt)), 0.01)
        gap = np.delete(one, slice(40, 44))
        self.assertEqual(int(np.isfinite(attitude.attitudes_at(gap, yawed(gap), other, 20)[:, 0]).sum()), 79 - 5)
        negated = yawed(one) * np.where(np.arange(80) % 2, -1.0, 1.0)[:, None]  # q and -q are one attitude
        self.assertLess(np.degrees(np.nanmax(np.abs(attitude.apart(yawed(other), attitude.attitudes_at(one, negated, other, 20))[1]))), 0.01)

    def inertial(self, scale=1.0, turn=0.0, between=1.0):
        """A robot at rest at the origin whose estimate errs as it says, times `scale`; `turn`: by how much it is off about the vertical too;
        `between`: how much larger its velocity's error is in every second epoch, which says no covariance of it."""
        random = np.random.default_rng(5)
        n = self.count
        epoch = 1.0 + np.arange(n)
        time_s = 0.01 * epoch
        draw = {}
        for name, sigma in self.std.items():
            a, b, c = self.corr[name]
            draw[name] = random.multivariate_normal([0, 0, 0], (scale * sigma) ** 2 * np.array([[1, a, b], [a, 1, c], [b, c, 1]]), n)
        draw["velocity"][1::2] *= between
        position = draw["position"]
        rows = [[epoch[i], time_s[i], 2, 6, *position[i, :2], 0, 0, 0, 0.3, 0.3, self.std["attitude"], 0.9, 0, 0, 1, 1, 0.05, 0.02] for i in range(n)]
        self.write_rows("estimates.csv", recorded_run.ESTIMATES, rows)
        angle = draw["attitude"] + [0, 0, turn]
        length = np.linalg.norm(angle, axis=1, keepdims=True)
        q = np.hstack([np.cos(length / 2), angle / length * np.sin(length / 2)])
        sigmas = {"velocity": self.std["velocity"], "gyro bias": self.std["gyro bias"], "acc bias": self.std["acc bias"]}
        self.write_rows("states.csv", recorded_run.STATES, [
            [epoch[i], time_s[i], 2, *q[i], *draw["velocity"][i], position[i, 2], 0.3, *draw["acc bias"][i], *draw["gyro bias"][i],
             *[sigmas["velocity"]] * 3, *[self.std["attitude"]] * 2, *[sigmas["acc bias"]] * 3, *[sigmas["gyro bias"]] * 3, *[None] * 9,
             *self.corr["position"][1:], *(self.corr["velocity"] if i % 2 == 0 or between == 1.0 else [None] * 3), *self.corr["attitude"],
             *self.corr["acc bias"], *self.corr["gyro bias"]] for i in range(n)])
        self.write("run.json", json.dumps(RUN))
        self.write_rows("t.truth.csv", [*ground_truth.TRUTH, "epoch", *ground_truth.TRUTH_MORE],
                        [[time_s[i], 0, 0, 0, epoch[i], *[0] * len(ground_truth.TRUTH_MORE)] for i in range(n)])
        return self.path("t.truth.csv")

    def test_honest_errors_of_every_block_have_a_nees_of_three(self):
        fused = self.summary("--truth", self.inertial())["fused"]
        self.assertEqual(fused["kind"], "Inertial")
        for name in normalised_error.BLOCKS:
            self.assertAlmostEqual(fused["blocks"][name]["nees_mean"], 3.0, delta=0.25, msg=name)
            self.assertAlmostEqual(fused["blocks"][name]["nees_inside_two_sided_95"], 0.95, delta=0.015, msg=name)
            self.assertGreater(fused["blocks"][name]["inside_3_sigma"], 0.98, name)

    def test_errors_twice_as_large_as_said_have_four_times_the_nees(self):
        fused = self.summary("--truth", self.inertial(2.0))["fused"]
        for name in normalised_error.BLOCKS:
            self.assertAlmostEqual(fused["blocks"][name]["nees_mean"], 12.0, delta=1.0, msg=name)
            self.assertLess(fused["blocks"][name]["inside_3_sigma"], 0.75, name)

    def test_a_long_run_that_is_judged_in_parts_has_the_figures_of_the_whole(self):
        path = self.inertial(between=10.0)
        # Sigmas come once in 50 epochs and hold on, across the parts too.
        header, *rows = [line.split(",") for line in text_of(self.path("states.csv")).splitlines()]
        for n, row in enumerate(rows):
            for at, name in enumerate(header):
                if name.startswith("std_") and n % 50:
                    row[at] = ""
        self.write("states.csv", "".join(",".join(row) + "\n" for row in [header, *rows]))

        def figures():
            run = recorded_run.Run(self.directory)
            truth = ground_truth.Truth(path, None, run.every).paired_with(run)
            return run, metrics.summary(run, truth)["fused"]
        _, whole = figures()
        size = os.path.getsize(self.path("estimates.csv"))
        for span in (731, 1000, 100_000):
            with unittest.mock.patch.multiple(recorded_run, LONG=size - 1, SPAN=span):
                run, parts = figures()
            self.assertEqual(run.every, 5)
            self.assertLess(len(run.estimates["epoch"]), self.count / 4)  # for pictures: whole seconds, each with its pages
            self.assertGreater(len(run.estimates["epoch"]), self.count / 8)
            self.assertEqual(json.dumps(round_all(parts)), json.dumps(round_all(whole)), span)

    def test_the_first_ten_right_seconds_are_found_in_parts_too(self):
        random = np.random.default_rng(3)
        for _ in range(300):
            right = np.repeat(random.random(12) < 0.6, random.integers(1, 9, 12))
            time_s, distance = 2.0 * np.arange(len(right)), np.where(right, 0.1, 3.0)
            distance[random.random(len(right)) < 0.1] = np.nan
            known = np.flatnonzero(np.isfinite(distance))
            # By brute force: from each known time on, all right until the last one or ten seconds later.
            expected = None
            for i in known:
                before = known[known < i]
                after = known[known >= i]
                wrong = after[distance[after] > metrics.RECOVERED_M]
                end = time_s[wrong[0]] if len(wrong) else time_s[known[-1]]
                starts = distance[i] <= metrics.RECOVERED_M and (len(before) == 0 or distance[before[-1]] > metrics.RECOVERED_M)
                if expected is None and starts and end - time_s[i] >= metrics.RECOVERED_S:
                    expected = time_s[i] - time_s[known[0]]
            for cut in (len(right), 1, 7):
                found = metrics.Recovery()
                for first in range(0, len(right), cut):
                    part = slice(first, first + cut)
                    found.add(time_s[part], distance[part], np.ones(len(time_s[part]), dtype=bool))
                self.assertEqual(found.value(), expected)

    def test_an_error_is_judged_by_the_covariance_of_its_own_epoch(self):
        blocks = self.summary("--truth", self.inertial(between=10.0))["fused"]["blocks"]
        self.assertAlmostEqual(blocks["velocity"]["nees_mean"], 3.0, delta=0.25)
        self.assertLess(blocks["velocity"]["inside_3_sigma"], 0.8)  # of every epoch

    def test_a_turn_about_the_vertical_is_heading_and_no_tilt(self):
        fused = self.summary("--truth", self.inertial(1e-6, turn=0.3))["fused"]
        self.assertAlmostEqual(fused["attitude_heading_rmse_deg"], np.degrees(0.3), places=3)
        self.assertLess(fused["tilt_rmse_deg"], 1e-3)

    def test_turns_compose_as_rotations_do_and_the_vertical_is_the_last_axis(self):
        random = np.random.default_rng(9)
        roll, pitch, yaw = random.uniform(-1, 1, (3, 500))
        q = attitude.quaternion(roll, pitch, yaw)
        small = random.normal(0, 0.1, (500, 3))
        angle = np.linalg.norm(small, axis=1, keepdims=True)
        turned = attitude.product(np.hstack([np.cos(angle / 2), small / angle * np.sin(angle / 2)]), q)
        np.testing.assert_allclose(attitude.turns(turned, q), small, atol=1e-12)
        np.testing.assert_allclose(attitude.turns(-turned, q), small, atol=1e-12)  # the same attitude
        # R_nb of yaw alone takes forward to (cos, sin, 0).
        w, _, _, z = attitude.quaternion(np.zeros(1), np.zeros(1), np.array([0.7]))[0]
        self.assertAlmostEqual(w * w - z * z, np.cos(0.7))
        self.assertAlmostEqual(2 * w * z, np.sin(0.7))

    def test_tilt_and_heading_apart_are_those_of_the_firmware(self):
        one = np.array([[1.0, 0, 0, 0]])
        tilted = np.array([[np.cos(0.1), np.sin(0.1), 0, 0]])
        headed = np.array([[np.cos(0.2), 0, 0, np.sin(0.2)]])
        for q, expected in ((one, (0, 0)), (tilted, (0.2, 0)), (headed, (0, 0.4)), (attitude.product(tilted, headed), (0.2, 0.4))):
            tilt, heading = attitude.apart(q, one)
            self.assertAlmostEqual(tilt[0], expected[0])
            self.assertAlmostEqual(heading[0], expected[1])

    def test_a_page_counts_until_it_is_too_old(self):
        held = recorded_run.held_at(np.array([1.0, 5, 9, 30]), np.array([0.1, np.nan, 0.3, np.nan]), np.array([0.0, 1, 8, 9, 19, 20]), 10)
        np.testing.assert_array_equal(held, [np.nan, 0.1, 0.1, 0.3, 0.3, np.nan])

    def test_the_best_is_called_fused_whatever_its_place(self):
        self.assertEqual(recorded_run.names_of({0: "Odometry", 1: "Attitude", 2: "Inertial"}), {0: "odometry", 1: "attitude", 2: "fused"})
        self.assertEqual(recorded_run.names_of({0: "Odometry", 1: "Ekf"}), {0: "odometry", 1: "fused"})
        self.assertEqual(recorded_run.names_of({0: "Odometry", 1: "Ekf", 2: "Inertial"}), {0: "odometry", 1: "estimator1", 2: "fused"})
        self.assertEqual(recorded_run.names_of({0: "Odometry"}), {0: "odometry"})

    def test_counters_that_wrap_go_on(self):
        self.assertEqual(metrics.unwrapped(np.array([65000.0, 65500, 400, 1000]), 65536), 66536)

    def test_each_instance_of_a_sensor_has_its_own_counters(self):
        sensors = {"inst": np.array([0.0, 1, 0, 1, 0, 1]), "accepted": np.array([60.0, 40, 65530, 70, 20, 100]), "rejected": np.array([1.0, 3, 4095, 5, 2, 8])}
        self.assertEqual(metrics.counted(sensors, np.arange(6)), (65536 + 20 + 100, 4096 + 2 + 8))
        self.assertEqual(metrics.counted(sensors, np.array([0, 2])), (65530, 4095))

    def test_what_happened_is_told_in_words_and_in_order(self):
        self.inertial()
        row = [100, 1.0, 2, 5, 0, 1, 3, 99.0, 8.0, 100, None]
        self.write_rows("innovations.csv", recorded_run.INNOVATIONS, [[100 + i, 1.0 + 0.2 * i, *row[2:]] for i in range(5)] + [[900, 9.0, *row[2:]]])
        self.write_rows("status.csv", recorded_run.STATUS, [[i * 10, 0.1 * i, 5 if 12 <= i < 20 else 3, 0 if 40 <= i < 55 else 32, 2 if 12 <= i < 20 else 0, int(i >= 30), 6]
                                                       for i in range(1, 60)])
        self.write_rows("states.csv", recorded_run.STATES, [[310, 3.1, 2, *[None] * 26, 99.5, -0.25, 0.01, *[None] * 5, 3.5, *[None] * 14]])
        run = recorded_run.Run(self.directory)
        run.about["fault"] = "wheel_spin@1+2,kidnapped@4+0,gnss_jump"
        told = events.events(run)
        words = [text for _, text in told]
        self.assertEqual([t for t, _ in told], sorted(t for t, _ in told))
        self.assertIn("GnssPosition Rejected, 5 times until 1.8 s", words)
        self.assertIn("GnssPosition Rejected", words)
        self.assertIn("mode Degraded", words)
        self.assertIn("GnssPosition gives nothing that is used, for 1.5 s", words)
        self.assertIn("fault Rejecting, for 0.8 s", words)
        self.assertIn("reset: PositionJump, position moved by 99.50 m east, -0.25 m north, 3.50 m up", words)
        self.assertIn("the world: wheel_spin, for 2.0 s", words)
        self.assertIn("the world: kidnapped", words)
        # The height of a jump is in another frame, here of an epoch later, or never said.
        there = [310, 3.1, 2, *[None] * 26, 99.5, -0.25, 0.01, *[None] * 20]
        for rows, up in (([there, [314, 3.14, 2, *[None] * 34, 3.5, *[None] * 14]], ", 3.50 m up"), ([there], "")):
            self.write_rows("states.csv", recorded_run.STATES, rows)
            self.assertIn("reset: PositionJump, position moved by 99.50 m east, -0.25 m north" + up, [text for _, text in events.events(recorded_run.Run(self.directory))])
        self.assertFalse([one for one in words if "gnss_jump" in one])  # nobody knows when

    def test_the_pictures_of_an_inertial_run_are_drawn(self):
        truth = self.inertial()
        result = self.report("--truth", truth)
        self.assertEqual(result.returncode, 0, result.stderr)
        for name in ("errors", "biases", "path"):
            with open(self.path(name + ".png"), "rb") as picture:
                self.assertEqual(picture.read(8), b"\x89PNG\r\n\x1a\n")
        self.assertIn("Biases of the IMU", text_of(self.path("report.html")))


if __name__ == "__main__":
    unittest.main()
