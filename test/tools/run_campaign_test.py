#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""tools/proof/run_campaign: its averages against drawn errors and published quantiles, pairing by epoch, bad input, and runs of the real program."""
import importlib.machinery
import importlib.util
import json
import os
import shutil
import subprocess
import sys
import tempfile
import unittest

import numpy as np

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
TOOLS = os.path.join(ROOT, "tools")
sys.path.insert(0, os.path.join(TOOLS, "python"))
sys.dont_write_bytecode = True

from tetap.proof import campaign_metrics as judge  # noqa: E402
from tetap.can.bus_writer import BadInput  # noqa: E402
from tetap.report import ground_truth, normalised_error, recorded_run  # noqa: E402

LOADER = importlib.machinery.SourceFileLoader("campaign", os.path.join(TOOLS, "proof", "run_campaign"))
campaign = importlib.util.module_from_spec(importlib.util.spec_from_loader("campaign", LOADER))
LOADER.exec_module(campaign)

PROGRAMS = os.environ.get("TETAP_PROGRAMS", os.path.join(ROOT, "build/host/sim_host"))


def drawn(seeds, times, scale=1.0, source=1):
    """Runs whose poses err as they say, times `scale`."""
    random = np.random.default_rng(source)
    return [{"epochs": np.arange(times) * 5.0, "nees": scale * random.chisquare(judge.DOF, times)} for _ in range(seeds)]


class Averages(unittest.TestCase):
    def test_the_interval_is_the_published_one(self):
        # Abramowitz and Stegun, table 26.8: chi-square of 30 degrees of freedom, 16.7908 and 46.9792.
        low, high = judge.interval(30, 10)
        self.assertAlmostEqual(low, 1.67908, 4)
        self.assertAlmostEqual(high, 4.69792, 4)

    def test_honest_errors_are_inside_at_95_percent_of_the_times(self):
        result = judge.anees(drawn(30, 4000))
        self.assertAlmostEqual(result["inside"], 0.95, delta=0.015)
        self.assertAlmostEqual(result["above"], 0.025, delta=0.01)
        self.assertAlmostEqual(result["below"], 0.025, delta=0.01)
        self.assertLess(abs(result["mean"] - 3), 2 * result["mean_plus_minus"])

    def test_too_sure_is_above_and_too_modest_is_below(self):
        sure, modest = judge.anees(drawn(30, 1000, 2.0)), judge.anees(drawn(30, 1000, 0.5))
        self.assertGreater(sure["above"], 0.95)
        self.assertGreater(modest["below"], 0.95)
        self.assertGreater(sure["mean"] - 3, sure["mean_plus_minus"])
        self.assertLess(modest["mean"] - 3, -modest["mean_plus_minus"])

    def test_errors_that_last_for_the_whole_run_widen_the_interval_of_the_mean(self):
        random = np.random.default_rng(3)
        lasting = [{"epochs": np.arange(1000.0), "nees": np.full(1000, random.chisquare(3))} for _ in range(30)]
        self.assertGreater(judge.anees(lasting)["mean_plus_minus"], 10 * judge.anees(drawn(30, 1000))["mean_plus_minus"])

    def test_the_mean_of_many_campaigns_is_what_a_lasting_error_hides_in_each(self):
        random = np.random.default_rng(5)
        each = [judge.anees([{"epochs": np.arange(20.0), "nees": np.full(20, random.chisquare(3))} for _ in range(10)]) for _ in range(600)]
        all_of_them = judge.repeated(each)
        self.assertEqual((all_of_them["campaigns"], all_of_them["inside_least"], all_of_them["inside_most"]), (600, 0, 1))
        self.assertLess(abs(all_of_them["inside"] - 0.95), all_of_them["inside_plus_minus"])
        self.assertAlmostEqual(all_of_them["inside_plus_minus"], 1.96 * np.sqrt(0.05 * 0.95 / 600), delta=0.005)
        self.assertLess(abs(all_of_them["mean"] - 3), all_of_them["mean_plus_minus"])

    def test_one_table_and_the_json_have_the_same_rows_of_repeated_campaigns(self):
        honest = judge.anees(drawn(10, 100))
        case = {"setting": "matched", "attitude": {"anees": None}, "fused": {"anees": honest, "blocks": {"position": {"anees": honest}, "velocity": {"anees": honest}}}}
        silent = {"setting": "matched", "attitude": {"anees": None}, "fused": {"anees": honest, "blocks": {"position": {"anees": None}, "velocity": {"anees": honest}}}}
        fault = {**case, "setting": "matched, gnss_jump", "said": {}}
        rows = campaign.repeated_rows([case, silent, fault, fault])
        self.assertEqual([(one["setting"], one["block"], one["mean"] is None) for one in rows],
                         [("matched", "pose", False), ("matched", "position", True), ("matched", "velocity", False)])
        self.assertEqual(set(rows[0]), set(rows[1]))
        shown = campaign.repeated_table(rows).splitlines()
        self.assertEqual(len(shown), 4)
        self.assertEqual(shown[2].split(), ["matched", "fused", "position", "2", *["-"] * 5])

    def test_what_chance_leaves_of_a_right_filter_is_less_where_errors_last(self):
        random = np.random.default_rng(4)
        times, seeds = 1000, 30

        def runs(keep, scale=1.0):
            """First-order Gauss-Markov errors of variance scale^2 that keep so much of themselves from one time to the next."""
            white = [random.standard_normal((seeds, 3))]
            while len(white) < times:
                white.append(keep * white[-1] + np.sqrt(1 - keep ** 2) * random.standard_normal((seeds, 3)))
            return [{"epochs": np.arange(times), "white": scale * np.array(white)[:, k]} for k in range(seeds)]
        short, long, sure = judge.by_chance(runs(0.0)), judge.by_chance(runs(0.99)), judge.by_chance(runs(0.99, 2.0))
        self.assertAlmostEqual(short["median"], 0.95, delta=0.01)
        # Thirty seeds show correlations between times that chance made: it comes out a little low.
        self.assertAlmostEqual(short["least"], 0.95 - 1.64 * np.sqrt(0.05 * 0.95 / times), delta=0.03)
        self.assertGreater(long["median"], 0.94)
        self.assertTrue(0.70 < long["least"] < 0.91, long)
        # What a right filter would have does not follow from how large the errors are.
        self.assertAlmostEqual(sure["median"], long["median"], delta=0.02)
        self.assertIsNone(judge.by_chance(runs(0.0)[:29]))

    def test_only_times_that_every_seed_has_are_averaged(self):
        runs = drawn(3, 10)
        runs[1]["nees"][4] = np.nan
        runs[2] = {key: values[:8] for key, values in runs[2].items()}
        result = judge.anees(runs)
        self.assertEqual(result["times"], 7)
        use = [0, 1, 2, 3, 5, 6, 7]
        self.assertAlmostEqual(result["mean"], np.mean([one["nees"][use] for one in runs]))
        runs[0]["nees"][:] = np.nan
        self.assertIsNone(judge.anees(runs))

    def test_nis_counts_what_was_rejected_too(self):
        names = {"Sensor": {4: "RangeBearing", 5: "GnssPosition"}}
        table = {"estimator": np.array([1, 1, 1, 0, 1]), "sensor": np.array([4, 4, 5, 4, 4]), "verdict": np.array([0, 1, 0, 0, 2]),
                 "dof": np.array([2, 2, 2, 2, 0]), "nis": np.array([1.0, 20.0, 3.0, 7.0, np.nan])}
        result = judge.sensors([{"sensors": judge.innovations(table, 1, names)}] * 2)
        self.assertEqual(result["RangeBearing"]["compared"], 4)
        self.assertEqual(result["RangeBearing"]["nis_mean"], 10.5)
        self.assertEqual(result["RangeBearing"]["nis_mean_accepted"], 1.0)
        self.assertEqual(result["RangeBearing"]["rejected_share"], 0.5)
        self.assertEqual(result["GnssPosition"]["nis_expected"], 2.0)

    def test_a_fault_lasts_as_long_as_it_says(self):
        known = {"gnss_jump": (60.0, 10.0)}
        self.assertEqual(campaign.fault_times("gnss_jump", known), (60, 70))
        self.assertEqual(campaign.fault_times("gnss_jump@5", known), (5, 15))
        self.assertEqual(campaign.fault_times("gnss_jump@5+2.5", known), (5, 7.5))
        for wrong in ("nope", "gnss_jump@", "gnss_jump@x", "gnss_jump@1+", "gnss_jump,gnss_jump"):
            self.assertRaises(BadInput, campaign.fault_times, wrong, known)


class Faults(unittest.TestCase):
    """What is said of a fault, from rows made by hand: 10 s before it, 5 s of it, 20 s after."""
    at = np.arange(0, 35, 0.05)
    start, end = 10.0, 15.0

    def rows(self, sigma):
        n = len(self.at)
        return {"epoch": self.at / recorded_run.TICK_S, "std_x_m": np.full(n, sigma), "std_y_m": np.full(n, sigma)}

    def honesty(self, error, sigma=0.1):
        zero = np.zeros(len(self.at))
        return judge.honesty(self.rows(sigma), np.where((self.at >= 11) & (self.at < 14), error, 0.0), zero, None, self.at, self.start, self.end)

    def test_an_error_that_the_sigmas_deny_is_found_with_its_length_and_size(self):
        bad, good = self.honesty(0.9), self.honesty(0.29)
        self.assertAlmostEqual(bad["too_sure_s"], 2.95, places=6)
        self.assertAlmostEqual(bad["worst_ratio"], 3.0)
        self.assertAlmostEqual(bad["three_sigma_m"], 0.3)
        self.assertEqual(good["too_sure_s"], 0.0)
        self.assertEqual(self.honesty(0.9, sigma=0.31)["too_sure_s"], 0.0)

    def test_what_was_wrong_before_the_fault_is_not_held_against_it(self):
        zero = np.zeros(len(self.at))
        result = judge.honesty(self.rows(0.1), np.where(self.at < 9, 5.0, 0.0), zero, None, self.at, self.start, self.end)
        self.assertEqual((result["too_sure_s"], result["worst_ratio"]), (0.0, 0.0))

    def test_words_count_from_the_fault_and_only_those_that_were_not_said_before(self):
        class Status:
            status = {"epoch": self.at / recorded_run.TICK_S, "mode": np.where(self.at >= 12, 4.0, 3.0),
                      "faults": np.where(self.at >= 10.5, 0b11, 0b01).astype(float), "reset_ctr": (self.at >= 14).astype(float),
                      "reset_cause": np.full(len(self.at), 6.0)}
        names = {"Mode": {3: "Nominal", 4: "DeadReckoning"}, "Fault": {0: "Always", 1: "Rejecting"}, "ResetCause": {6: "PositionJump"}}
        words = judge.said(Status, names, self.start, self.end)
        self.assertEqual(set(words), {"Rejecting", "DeadReckoning", "reset: PositionJump"})
        self.assertAlmostEqual(words["Rejecting"], 0.5, places=6)
        self.assertAlmostEqual(words["reset: PositionJump"], 4.0, places=6)

    def test_the_way_driven_and_the_way_astray_are_those_of_the_fault(self):
        class Truth:
            x_m, y_m = 5 * np.arange(0, 35.001, 0.01), np.zeros(3501)
        epochs = np.arange(1, 3502, 5)
        dx = np.where(epochs * 0.01 > 12, 0.4, 0.1)
        result = judge.outage({"epoch": epochs}, dx, np.zeros(len(epochs)), Truth, self.start, self.end, np.arange(0, 35.001, 0.01))
        self.assertAlmostEqual(result["driven_m"], 25.0, places=6)
        self.assertAlmostEqual(result["astray_m"], 0.3)
        self.assertAlmostEqual(result["error_at_end_m"], 0.4)


class WithFiles(unittest.TestCase):
    def setUp(self):
        self.directory = tempfile.mkdtemp()
        self.addCleanup(shutil.rmtree, self.directory, ignore_errors=True)

    def campaign(self, *arguments):
        return subprocess.run([os.path.join(TOOLS, "proof", "run_campaign"), "--out", self.directory, *arguments], capture_output=True, text=True,
                              timeout=300, env={**os.environ, "TETAP_PROGRAMS": PROGRAMS})

    def truth(self, text):
        path = os.path.join(self.directory, "truth.csv")
        with open(path, "w", encoding="utf-8") as file:
            file.write(text)
        return path

    def test_truth_with_epochs_is_paired_by_epoch_whatever_the_clock_says(self):
        truth = ground_truth.Truth(self.truth("time_s,x_m,y_m,yaw_rad,epoch\n1.0,1,10,0.1,1\n1.1,2,20,0.2,2\n1.2,3,30,0.3,3\n"))
        rows = {"epoch": np.array([3.0, 1.0, 9.0]), "time_s": np.array([99.0, 1.2, 1.0])}
        x, y, yaw = truth.of(rows)
        np.testing.assert_array_equal(x, [3, 1, np.nan])
        np.testing.assert_array_equal(y, [30, 10, np.nan])
        np.testing.assert_array_equal(yaw, [0.3, 0.1, np.nan])
        with self.assertRaisesRegex(BadInput, "row 3: epoch does not grow"):
            ground_truth.Truth(self.truth("time_s,x_m,y_m,yaw_rad,epoch\n1.0,1,10,0.1,1\n1.1,2,20,0.2,2\n1.2,3,30,0.3,2\n"))

    @unittest.skipUnless(os.access(os.path.join(PROGRAMS, "tetap-world"), os.X_OK), "tetap-world is not built")
    def test_a_small_campaign_of_the_real_program(self):
        result = self.campaign("--seeds", "3", "--duration", "15")
        self.assertEqual(result.returncode, 0, result.stderr)
        with open(os.path.join(self.directory, "campaign.json"), encoding="utf-8") as file:
            cases = json.load(file)["cases"]
        self.assertEqual([(case["world"], case["robot"]) for case in cases], [("matched", "rover_matched"), ("mismatched", "rover")])
        for case in cases:
            self.assertEqual(case["seeds"], 3)
            for name in ("odometry", "fused"):
                self.assertGreater(case[name]["position_rmse_m"]["median"], 0)
                self.assertGreaterEqual(case[name]["position_rmse_m"]["worst"], case[name]["position_rmse_m"]["median"])
                self.assertGreater(case[name]["anees"]["times"], 60)
            self.assertEqual(set(case["fused"]["sensors"]), {"GnssPosition", "GnssVelocity"})
            self.assertIn("WheelCounts", case["fused"]["bus"])
            self.assertEqual(list(case["fused"]["blocks"]), normalised_error.BLOCKS)
            self.assertLess(case["attitude"]["tilt_rmse_deg"]["worst"], 10)
            self.assertLess(case["fused"]["position_rmse_m"]["worst"], 3)
        self.assertEqual(os.listdir(self.directory), ["campaign.json"])  # the runs' own files are gone

    @unittest.skipUnless(os.access(os.path.join(PROGRAMS, "tetap-world"), os.X_OK), "tetap-world is not built")
    def test_a_campaign_that_is_repeated_has_other_seeds(self):
        def cases(*options):
            result = self.campaign("--duration", "12", "--world", "matched", *options)
            self.assertEqual(result.returncode, 0, result.stderr)
            with open(os.path.join(self.directory, "campaign.json"), encoding="utf-8") as file:
                return json.load(file), result.stdout
        (twice, shown), (four, _) = cases("--seeds", "2", "--repeat", "2"), cases("--seeds", "4")
        self.assertEqual([case["label"] for case in twice["cases"]], ["matched, seeds 1 to 2", "matched, seeds 3 to 4"])
        means = [case["fused"]["blocks"]["velocity"]["anees"]["mean"] for case in [*twice["cases"], *four["cases"]]]
        self.assertAlmostEqual((means[0] + means[1]) / 2, means[2])
        of_velocity = next(one for one in twice["repeated"] if (one["estimator"], one["block"]) == ("fused", "velocity"))
        self.assertAlmostEqual(of_velocity["mean"], means[2])
        self.assertEqual((twice["repeat"], four["repeat"], four["repeated"]), (2, 1, []))
        self.assertEqual({case["setting"] for case in twice["cases"]}, {of_velocity["setting"]})
        self.assertIn("times inside [%], mean", shown)
        later, _ = cases("--seeds", "2", "--first", "3")
        self.assertEqual((later["first"], later["cases"][0]["label"]), (3, "matched, seeds 3 to 4"))
        self.assertAlmostEqual(later["cases"][0]["fused"]["blocks"]["velocity"]["anees"]["mean"], means[1])

    @unittest.skipUnless(os.access(os.path.join(PROGRAMS, "tetap-world"), os.X_OK), "tetap-world is not built")
    def test_the_error_during_a_fault_and_the_error_after_it_are_told_apart(self):
        result = self.campaign("--seeds", "2", "--duration", "50", "--world", "matched", "--fault", "slip_left@15+2")
        self.assertEqual(result.returncode, 0, result.stderr)
        with open(os.path.join(self.directory, "campaign.json"), encoding="utf-8") as file:
            case = json.load(file)["cases"][0]
        fused, odometry = case["fused"], case["odometry"]
        self.assertGreater(fused["largest_error_m"]["median"], fused["position_rmse_after_m"]["worst"])  # fixes bring it back
        self.assertLess(fused["position_rmse_after_m"]["worst"], 0.3)
        self.assertGreater(odometry["largest_error_m"]["median"], 0.5)
        self.assertGreater(odometry["position_rmse_after_m"]["median"], odometry["largest_error_m"]["median"])  # which nothing does

    @unittest.skipUnless(os.access(os.path.join(PROGRAMS, "tetap-world"), os.X_OK), "tetap-world is not built")
    def test_all_faults_are_those_of_sensors_that_the_robot_has(self):
        known = set(campaign.fault_table())
        sights = {"lidar_late", "lidar_mirrored", "lidar_turned", "lidar_covered", "lidar_glass", "images_late", "images_mirrored", "images_turned", "images_lost", "image_stamps",
                  "tracks_swapped", "moving_features", "focal_length", "lorry"}
        self.assertEqual(known - set(campaign.faults_of("rover")), sights | {"landmark_wrong_id", "landmark_outlier", "mag_disturbance"})
        self.assertEqual(known - set(campaign.faults_of("iris")), sights | {"landmark_wrong_id", "landmark_outlier", "wheel_spin", "wheel_stuck", "slip_left", "slip_right", "encoder_dropout"})

    @unittest.skipUnless(os.access(os.path.join(PROGRAMS, "tetap-world"), os.X_OK), "tetap-world is not built")
    def test_bad_input_is_one_line_and_a_status(self):
        for arguments, words in ((["--fault", "nope"], "known are: gnss_jump"), (["--seeds", "0"], "must be 1 or more"), (["--repeat", "0"], "must be 1 or more"),
                                 (["--first", "0"], "must be 1 or more"),
                                 (["--fault", "gnss_jump", "--duration", "20"], "longer --duration"),
                                 (["--robot", "nope", "--seeds", "1", "--duration", "2"], "no robot 'nope'")):
            result = self.campaign(*arguments)
            self.assertNotEqual(result.returncode, 0, arguments)
            self.assertIn(words, result.stderr)
            self.assertNotIn("Traceback", result.stderr)


if __name__ == "__main__":
    unittest.main()
