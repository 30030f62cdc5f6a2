#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The attitude filters on recorded data with optical truth: attitude_test.py ATTITUDE_LOG (found through $TETAP_DATA, status 77 without).

Bounds on the trials that the filter's numbers were chosen on (folder `dev`): BROAD with one configuration, mean total RMSE <= 2.2 degrees and
every trial below Madgwick's published figure. On the trials that came later (folder `more`) each figure may not grow: they are worse than the
bar, and docs/validation/shortfalls.md has them. The metric is judged by the published figures of Mahony's filter, which this repository has too."""
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


@unittest.skipUnless(have("broad"), "no BROAD")
class Broad(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.trials = attitude.load("broad", "dev")
        cls.results = attitude.evaluate(PROGRAM, cls.trials, ["tetap9", "tetap6", "mahony9"], [])
        cls.madgwick, cls.mahony = attitude.published("madgwick"), attitude.published("mahony")

    def test_the_mean_is_what_was_asked_for(self):
        self.assertLessEqual(np.mean([self.results[t.name, "tetap9"]["total"] for t in self.trials]), 2.2)

    def test_every_trial_is_better_than_madgwick(self):
        for trial in self.trials:
            self.assertLess(self.results[trial.name, "tetap9"]["total"], self.madgwick[trial.name]["total"], trial.name)

    def test_inclination_alone_is_no_worse_without_magnetometer(self):
        for trial in self.trials:
            self.assertAlmostEqual(self.results[trial.name, "tetap6"]["inclination"], self.results[trial.name, "tetap9"]["inclination"], 3)

    def test_the_metric_gives_mahonys_published_figures(self):
        # The published run started otherwise; what remains of that, and of float, is below 2 %.
        for trial in self.trials:
            for part, published in self.mahony[trial.name].items():
                found = self.results[trial.name, "mahony9"][part]
                self.assertLess(abs(found - published), 0.02 * published + 0.12, f"{trial.name} {part}: {found} {published}")


@unittest.skipUnless(have("repoimu"), "no RepoIMU")
class RepoImu(unittest.TestCase):
    def test_every_trial_is_better_than_mahony(self):
        trials = attitude.load("repoimu", "dev")
        results = attitude.evaluate(PROGRAM, trials, ["tetap9", "mahony9"], [])
        for trial in trials:
            self.assertLess(results[trial.name, "tetap9"]["total"], results[trial.name, "mahony9"]["total"], trial.name)


class MoreTrials(unittest.TestCase):
    """Total RMSE [deg] as recorded; a figure above it is a regression, one below half of it has another cause than a better filter."""
    RECORDED = {"broad": {"03": 1.91, "06": 4.09, "26": 2.15, "29": 1.53, "33": 4.28, "36": 3.61},
                "repoimu": {"Test03": 1.88, "Test06": 8.25, "Test07": 15.23, "Test10": 32.44}}

    def test_no_trial_is_worse_than_recorded(self):
        for dataset, recorded in self.RECORDED.items():
            trials = attitude.load(dataset, "more") if have(dataset) else []
            results = attitude.evaluate(PROGRAM, trials, ["tetap9"], []) if trials else {}
            for trial in trials:
                bound = next((value for name, value in recorded.items() if name in trial.name.replace("TStick_", "")), None)
                if bound is not None:
                    found = results[trial.name, "tetap9"]["total"]
                    self.assertLess(found, 1.05 * bound, trial.name)
                    self.assertGreater(found, 0.5 * bound, trial.name)


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit("attitude_test.py ATTITUDE_LOG")
    PROGRAM = sys.argv.pop(1)
    missing = [name for name in ("broad", "repoimu") if not have(name)]
    passed = unittest.main(exit=False).result.wasSuccessful()
    if passed and missing:
        print(f"skipped: no {' and no '.join(missing)} in {attitude.data_folder()} (set TETAP_DATA)")
    sys.exit(1 if not passed else 77 if missing else 0)
