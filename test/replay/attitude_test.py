#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The attitude filters on recorded data with optical truth: attitude_test.py ATTITUDE_LOG (found through $TETAP_DATA, status 77 without).

The bars are VQF's figures on the same trials: both means below them, no trial above twice its figure and 3 degrees, with one configuration, and as
much for each trial with the numbers that tools/report/choose_attitude chooses on the others. The metric is judged by the published figures of
Mahony's filter, which this repository has too."""
import contextlib
import importlib.machinery
import importlib.util
import io
import os
import subprocess
import sys
import unittest

import numpy as np

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
sys.dont_write_bytecode = True
TOOL = os.path.join(ROOT, "tools", "report", "compare_attitude")
loader = importlib.machinery.SourceFileLoader("attitude", TOOL)
attitude = importlib.util.module_from_spec(importlib.util.spec_from_loader("attitude", loader))
loader.exec_module(attitude)
loader = importlib.machinery.SourceFileLoader("choose_attitude", os.path.join(ROOT, "tools", "report", "choose_attitude"))
choose_attitude = importlib.util.module_from_spec(importlib.util.spec_from_loader("choose_attitude", loader))
loader.exec_module(choose_attitude)
PROGRAM = None


def about(axis, degrees):
    half = np.radians(degrees) / 2
    return np.concatenate([[np.cos(half)], np.sin(half) * np.asarray(axis, float) / np.linalg.norm(axis)])


def have(dataset):
    return os.path.isdir(os.path.join(attitude.data_folder(), dataset))


class Metric(unittest.TestCase):
    def test_a_turn_of_the_world_is_heading_and_a_tilt_is_inclination(self):
        generator = np.random.default_rng(1)
        truth = generator.normal(size=(200, 4))
        truth /= np.linalg.norm(truth, axis=1)[:, None]
        for heading, inclination, azimuth in ((12, 0, 0), (-170, 0, 0), (0, 25, 40), (30, 25, 100), (-90, 60, 200)):
            tilt = about([np.cos(azimuth), np.sin(azimuth), 0], inclination)
            error = attitude.product(about([0, 0, 1], heading), tilt)
            found = attitude.errors(attitude.product(error, -truth), truth)
            np.testing.assert_allclose(found["heading"], heading, atol=1e-6)
            np.testing.assert_allclose(found["inclination"], inclination, atol=1e-6)
            expected = 2 * np.degrees(np.arccos(np.cos(np.radians(heading / 2)) * np.cos(np.radians(inclination / 2))))
            np.testing.assert_allclose(found["total"], expected, atol=1e-6)

    def test_constant_frames_are_found_and_nothing_else_is(self):
        generator = np.random.default_rng(2)
        truth = generator.normal(size=(500, 4))
        truth /= np.linalg.norm(truth, axis=1)[:, None]
        moved = attitude.product(attitude.product(about([1, 2, 3], 50), truth), about([3, -1, 0], 8))
        self.assertLess(np.max(attitude.errors(attitude.without_constant_frames(moved, truth), truth)["total"]), 1e-3)
        wrong = attitude.product(np.array([about(generator.normal(size=3), 10) for _ in truth]), moved)
        left = attitude.errors(attitude.without_constant_frames(wrong, truth), truth)["total"]
        self.assertGreater(np.sqrt(np.mean(left ** 2)), 9)


class Markdown(unittest.TestCase):
    def test_a_column_per_trial_and_the_mean_a_line_per_part(self):
        def trial(name):
            return attitude.Trial(name, [0.01], np.zeros((1, 3)), np.zeros((1, 3)), np.zeros((1, 3)), None, np.array([True]))
        parts = {"total": 2.0, "heading": 1.5, "inclination": 1.0}
        results = {("02_slow", "tetap9"): parts, ("07_fast", "tetap9"): {name: 2 * value for name, value in parts.items()}}
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            attitude.print_markdown([trial("02_slow"), trial("07_fast")], ["tetap9"], results, {"other": {"02_slow": {"total": 7.0}}})
        self.assertEqual(printed.getvalue().splitlines(), [
            "| RMSE [deg], trial | 02 | 07 | mean |", "|---|---|---|---|", "| tetap9, total | 2.00 | 4.00 | 3.00 |", "| tetap9, heading | 1.50 | 3.00 | 2.25 |",
            "| tetap9, inclination | 1.00 | 2.00 | 1.50 |", "| other, total | 7.00 |  | 7.00 |"])


class Tool(unittest.TestCase):
    def run_tool(self, *arguments, data=None):
        environment = dict(os.environ, **({"TETAP_DATA": data} if data else {}))
        return subprocess.run([TOOL, "--program", PROGRAM, *arguments], capture_output=True, text=True, env=environment)

    def test_without_data_it_says_skipped_in_its_last_line(self):
        done = self.run_tool(data="/nonexistent")
        self.assertEqual(done.returncode, 77)
        self.assertTrue(done.stdout.strip().splitlines()[-1].startswith("skipped: "), done.stdout)

    def test_bad_arguments_are_one_line_and_a_status(self):
        for arguments, said in ((["moon"], "no such data set"), (["--program", "/nonexistent"], "not built")):
            done = self.run_tool(*arguments)
            self.assertNotIn(done.returncode, (0, 77))
            self.assertIn(said, done.stderr)
            self.assertEqual(len(done.stderr.strip().splitlines()), 1)

    @unittest.skipUnless(have("broad"), "no BROAD")
    def test_an_unknown_option_is_refused(self):
        done = self.run_tool("broad", "--set", "tau_heading=3")
        self.assertEqual(done.returncode, 1)
        self.assertIn("no such option", done.stderr)


def total(results, trials, which):
    return np.array([results[trial.name, which]["total"] for trial in trials])


class Bars:
    """Of a data set: `published` is the mean that was stated for VQF, `recorded` the mean of this filter that the validation page has."""
    dataset, count, published, recorded = "", 0, 0.0, 0.0

    @classmethod
    def setUpClass(cls):
        cls.trials = attitude.load(cls.dataset)
        cls.results = attitude.evaluate(PROGRAM, cls.trials, ["tetap9", "tetap6", "mahony9"], [])
        cls.judged = [trial for trial in cls.trials if trial.name != choose_attitude.CLIPPED]

    def test_all_trials_are_there(self):
        self.assertEqual(len(self.judged), self.count)
        self.assertAlmostEqual(np.mean([attitude.vqf(trial) for trial in self.judged]), self.published, delta=0.006)

    def test_the_mean_is_below_that_of_vqf_and_is_what_was_recorded(self):
        found = np.mean(total(self.results, self.judged, "tetap9"))
        self.assertLessEqual(found, self.published)
        self.assertLess(abs(found - self.recorded), 0.03 * self.recorded)

    def test_no_trial_is_far_above_vqf(self):
        for trial in self.trials:
            self.assertLessEqual(self.results[trial.name, "tetap9"]["total"], max(2 * attitude.vqf(trial), 3), trial.name)

    def test_every_trial_is_better_than_mahony(self):
        for trial in self.trials:
            self.assertLess(self.results[trial.name, "tetap9"]["total"], self.results[trial.name, "mahony9"]["total"], trial.name)

    def test_inclination_alone_is_no_worse_without_magnetometer(self):
        for trial in self.judged if self.dataset == "broad" else []:
            self.assertAlmostEqual(self.results[trial.name, "tetap6"]["inclination"], self.results[trial.name, "tetap9"]["inclination"], 3)


@unittest.skipUnless(have("broad"), "no BROAD")
class Broad(Bars, unittest.TestCase):
    dataset, count, published, recorded = "broad", 13, 2.32, 1.89

    def test_every_trial_is_better_than_madgwick_or_as_good_as_vqf(self):
        madgwick = attitude.published("madgwick")  # on one fast trial Madgwick's published figure is half of VQF's
        for trial in self.trials:
            self.assertLess(self.results[trial.name, "tetap9"]["total"], max(madgwick[trial.name]["total"], 1.05 * attitude.vqf(trial)), trial.name)

    def test_the_metric_gives_mahonys_published_figures(self):
        # The published run started otherwise; what remains of that, and of float, is below 2 % and 0.12 degrees, on the phone's disturbed trial 0.2.
        mahony = attitude.published("mahony")
        for trial in self.trials:
            for part, published in mahony[trial.name].items():
                found = self.results[trial.name, "mahony9"][part]
                self.assertLess(abs(found - published), 0.02 * published + (0.2 if "_phone_" in trial.name else 0.12), f"{trial.name} {part}: {found} {published}")


@unittest.skipUnless(have("repoimu"), "no RepoIMU")
class RepoImu(Bars, unittest.TestCase):
    dataset, count, published, recorded = "repoimu", 9, 1.72, 1.17

    def test_readings_just_below_the_range_lose_nothing(self):
        """Eleven seconds with readings of 7.2 rad/s, whatever range is stated: VQF has 1.11 deg on the trial."""
        trial = next(trial for trial in self.trials if trial.name == "TStick_Test07_Trial2")
        begin = int(np.argmax(np.cumsum(trial.rows[:, 0]) >= 45))
        part = attitude.Trial("part", trial.rows[begin:begin + 1100, 0], trial.rows[begin:begin + 1100, 1:4], trial.rows[begin:begin + 1100, 4:7],
                              trial.rows[begin:begin + 1100, 7:10], trial.truth[begin:begin + 1100], np.arange(1100) >= 400, True)
        self.assertGreater(np.abs(part.rows[400:, 1:4]).max(), 7.19)
        for gyroscope_range, most in ((34.9, 1.11), (7.35, 1.11), (7.2, 2.22)):
            found = attitude.run_filter(PROGRAM, part, "tetap9", [f"gyroscope_range_radps={gyroscope_range}"])
            self.assertLess(found["total"], most, gyroscope_range)

    def test_a_gyroscope_that_clips_is_bridged(self):
        clipped = next(trial for trial in self.trials if trial.name == choose_attitude.CLIPPED)
        whole = attitude.run_filter(PROGRAM, clipped, "tetap9", ["gyroscope_range_radps=34.9"])["total"]
        self.assertGreater(whole, 50)  # as VQF, which does not know of a range
        self.assertLess(self.results[clipped.name, "tetap9"]["total"], 0.4 * whole)


class LeaveOneOut(unittest.TestCase):
    def test_each_trial_gets_what_is_best_on_the_others(self):
        table = np.array([[1.0, 3.1, 3.1], [2.0, 2.0, 2.0], [9.0, 1.9, 1.0]])
        self.assertEqual(choose_attitude.leave_one_out(table, np.ones(3)), (1, [2, 1, 1]))
        hard = np.array([1.0, 1.0, 100.0])  # the third trial is hard for all
        self.assertEqual(choose_attitude.leave_one_out(table, hard), (1, [2, 0, 1]))

    @unittest.skipUnless(have("broad") and have("repoimu"), "no BROAD or no RepoIMU")
    def test_the_left_out_trials_hold_the_bars(self):
        trials = choose_attitude.Trials()
        grid = ["field_deviation_share=0.1,0.15,0.2", "field_turn_rad=2,5"]
        options = choose_attitude.combinations(grid)
        table = np.array([trials.totals(PROGRAM, combination) for combination in options])
        _, without = choose_attitude.leave_one_out(table, trials.vqf)
        means = trials.means(table[without, range(table.shape[1])])
        self.assertLess(means["broad"], 1.1 * 2.32)
        self.assertLess(means["repoimu"], 1.1 * 1.72)


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit("attitude_test.py ATTITUDE_LOG")
    PROGRAM = sys.argv.pop(1)
    missing = [name for name in ("broad", "repoimu") if not have(name)]
    passed = unittest.main(exit=False).result.wasSuccessful()
    if passed and missing:
        print(f"skipped: no {' and no '.join(missing)} in {attitude.data_folder()} (set TETAP_DATA)")
    sys.exit(1 if not passed else 77 if missing else 0)
