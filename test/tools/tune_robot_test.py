#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""tools/calibrate/tune_robot: a matched world's numbers are found again, what a log does not show is no number, and the replays are the robot's.

TETAP_PROGRAMS: tetap-world, tetap-play, tetap-params; TETAP_VIEWED_PROGRAMS: tetap-innovations (build/host.views).
"""
import json
import os
import subprocess
import sys
import tempfile
import unittest

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
sys.dont_write_bytecode = True
ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))
sys.path.insert(0, os.path.join(ROOT, "tools", "python"))
import numpy as np  # noqa: E402
from scipy.stats import multivariate_normal  # noqa: E402

from tetap.tune import grid, likelihood, outcome, rows, search  # noqa: E402
from tetap.tune.replays import Replays  # noqa: E402

PROGRAMS = os.environ.get("TETAP_PROGRAMS", os.path.join(ROOT, "build/host/sim_host"))
VIEWED = os.path.join(os.environ.get("TETAP_VIEWED_PROGRAMS", os.path.join(ROOT, "build/host.views/sim_host")), "tetap-innovations")
ROBOT = "rover_matched"


def tune(*words):
    return subprocess.run([os.path.join(ROOT, "tools/calibrate/tune_robot"), *words, "--quiet"], capture_output=True, text=True, check=False)


class MatchedWorld(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.log = os.path.join(cls.folder.name, "raw.log")
        subprocess.run([os.path.join(PROGRAMS, "tetap-world"), "--memory", "--robot", ROBOT, "--matched", "--seed", "5", "--duration", "200", "--raw",
                        "--quiet", "--out", cls.folder.name], check=True)

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def test_numbers_begun_three_times_wrong_are_found_again_and_the_rest_is_said(self):
        out = os.path.join(self.folder.name, "tuned")
        done = tune(self.log, "--robot", ROBOT, "--rows", "gnss.sigma_scale,inertial.lateral_mps,baro.sigma_m,inertial.wheel_mps",
                    "--set", "gnss.sigma_scale=3", "--set", "inertial.lateral_mps=0.0017", "--out", out)
        self.assertEqual(done.returncode, 0, done.stderr)
        with open(os.path.join(out, "tune.json"), encoding="utf-8") as file:
            result = json.load(file)
        found = result["rows"]
        # The world draws 1 and 0.005 m/s; 600 fixes of 3 components have 2.4 %, 10000 constraints 1 %.
        for name, truth, margin in (("gnss.sigma_scale", 1, 0.12), ("inertial.lateral_mps", 0.005, 0.08)):
            self.assertAlmostEqual(found[name]["value"] / truth, 1, delta=margin)
            self.assertLess(found[name]["low"], found[name]["value"])
            self.assertGreater(found[name]["high"], found[name]["value"])
            self.assertLess(found[name]["high"] / found[name]["low"], 1.5)
        self.assertEqual((found["baro.sigma_m"]["value"], found["baro.sigma_m"]["why"]), (None, "no effect on these logs"))
        # 1 mm/s beside the 20 mm/s of encoders and of the k of odometry.
        self.assertEqual((found["inertial.wheel_mps"]["value"], found["inertial.wheel_mps"]["why"][:15]), (None, "flat likelihood"))
        self.assertGreater(len(result["held_out"]), 1)
        for fold in result["held_out"]:
            self.assertLess(fold["after"], fold["before"])
        params = os.path.join(out, "tuned.params")
        read = subprocess.run([os.path.join(PROGRAMS, "tetap-params"), "--json", "--robot", ROBOT, "--params", params], capture_output=True, text=True, check=True)
        values = {row["path"]: row["value"] for row in json.loads(read.stdout)["parameters"]}
        self.assertAlmostEqual(values["gnss.sigma_scale"] / found["gnss.sigma_scale"]["value"], 1, delta=1e-4)
        with open(params, encoding="utf-8") as file:
            self.assertIn("# baro.sigma_m: no effect", file.read())

    def test_the_sink_changes_no_bit_and_its_terms_are_the_filters_nis(self):
        into = os.path.join(self.folder.name, "played")
        subprocess.run([os.path.join(PROGRAMS, "tetap-play"), self.log, "--memory", "--robot", ROBOT, "--lockstep", "--quiet", "--out", into], check=True)
        with open(os.path.join(into, "run.json"), encoding="utf-8") as file:
            crc = int(json.load(file)["state_crc_last"], 16)
        with Replays(VIEWED, [self.log], ROBOT, out=self.folder.name) as replays:
            (replay,), = replays.play([{}])
        self.assertEqual(replay.state_crc, crc)
        one = likelihood.Measurements(replay)
        self.assertGreater(len(one.first), 5000)
        nis = np.add.reduceat(one.innovation ** 2 / np.exp(one.log_variance), one.first)
        np.testing.assert_allclose(nis, one.nis, rtol=2e-3, atol=1e-4)

    def test_nees_is_that_of_the_file_and_the_grid_is_its_neighbourhood(self):
        other, out = (os.path.join(self.folder.name, name) for name in ("other", "grid"))
        subprocess.run([os.path.join(PROGRAMS, "tetap-world"), "--memory", "--robot", ROBOT, "--matched", "--seed", "6", "--duration", "120", "--raw", "--quiet", "--out", other], check=True)
        truths = [os.path.join(folder, "truth.csv") for folder in (self.folder.name, other)]
        done = tune(self.log, os.path.join(other, "raw.log"), "--robot", ROBOT, "--rows", "gnss.sigma_scale", "--set", "gnss.sigma_scale=3", "--truth", truths[0], "--truth", truths[1],
                    "--grid", "gnss.sigma_scale", "--out", out)
        self.assertEqual(done.returncode, 0, done.stderr)
        with open(os.path.join(out, "tune.json"), encoding="utf-8") as file:
            result = json.load(file)
        played = os.path.join(out, "played")
        for command in ([os.path.join(PROGRAMS, "tetap-play"), self.log, "--memory", "--robot", ROBOT, "--params", os.path.join(out, "tuned.params"), "--lockstep", "--quiet", "--out", played],
                        [os.path.join(ROOT, "tools/report/write_report"), played, "--truth", truths[0], "--no-pictures"]):
            subprocess.run(command, check=True, capture_output=True)
        with open(os.path.join(played, "summary.json"), encoding="utf-8") as file:
            wanted = json.load(file)["fused"]
        before, after = ([one["fused"] for one in some] for some in result["nees"])
        self.assertAlmostEqual(after[0] / (wanted["nees_mean"] / 3), 1, delta=1e-2)
        self.assertLess(before[0], 0.6 * after[0])  # three times the sigma makes the covariance too large
        mean = np.mean(result["grid"][0]["nees"], axis=0)
        self.assertTrue(np.all(np.diff(mean) < 0), mean)  # a larger sigma, a smaller NEES
        blocks = [block["nees_mean"] / 3 for block in wanted["blocks"].values()]
        self.assertAlmostEqual(result["grid"][0]["nees"][0][len(mean) // 2] / np.mean(blocks), 1, delta=0.1)  # a log by the numbers of the other
        self.assertIn("best at", done.stdout)

    def test_bad_input_is_one_line_that_says_where(self):
        bad = os.path.join(self.folder.name, "bad.log")
        with open(bad, "w", encoding="utf-8") as file:
            file.write("(1.000000) can0 301#0900CDA600000000\nno frame\n")
        for words, said in (([bad], "bad.log:2: "), ([bad + "x"], "bad.logx: no such file"), ([self.log, "--rows", "gnss.sigma"], "--rows gnss.sigma: no noise row"),
                            ([self.log, "--set", "gnss.sigma_scale=0"], "gnss.sigma_scale"), ([self.log, "--robot", "nobody"], "no robot 'nobody'"),
                            ([self.log, "--grid", "gnss.sigma_scale"], "--grid needs two logs"),
                            ([self.log, self.log, "--truth", bad, "--truth", bad, "--grid", "nothing"], "--grid nothing: not among")):
            done = tune("--robot", ROBOT, *words, "--out", os.path.join(self.folder.name, "none"))
            self.assertEqual(done.returncode, 1, words)
            self.assertIn(said, done.stderr)
            self.assertEqual(done.stderr.count("\n"), 1, done.stderr)


class Laws(unittest.TestCase):
    def test_a_used_measurement_costs_its_gaussian_density(self):
        rng = np.random.default_rng(3)
        a = rng.normal(size=(3, 3))
        s, nu = a @ a.T + np.eye(3), rng.normal(size=3)
        nis = nu @ np.linalg.solve(s, nu)
        cost = 0.5 * (np.linalg.slogdet(s)[1] + 3 * likelihood.LN_2PI + likelihood.tail(nis, 1e3))
        self.assertAlmostEqual(float(cost), -multivariate_normal(cov=s).logpdf(nu), places=9)

    def test_refusing_never_pays(self):
        for size, gate in ((1, 6.635), (2, 9.21), (3, 11.345)):
            cost = [0.5 * (-size * np.log(k) + likelihood.tail(gate * 1.001 * k, gate)) for k in (1, 2, 10, 1e3, 1e6)]
            self.assertTrue(np.all(np.diff(cost) > 0), cost)  # S divided by k
            self.assertGreaterEqual(cost[0], 0.5 * gate)

    def test_the_best_factor_is_where_the_mean_nees_is_one_or_nearest_to_it(self):
        factors = np.array(grid.FACTORS)
        best, low, high = grid.optimum(np.array([1.5 * (factors / 0.7) ** -0.5, 0.5 * (factors / 0.7) ** -0.5]))
        self.assertAlmostEqual(best, 0.7, delta=0.02)
        self.assertTrue(low < 0.7 < high)
        self.assertAlmostEqual(grid.optimum(np.array([2 * factors ** -0.2]))[0], 4, delta=1e-9)
        for power, at_the_end in ((-0.2, True), (0.2, True), (-0.5, False)):
            curves = np.array([(2 if at_the_end else 1) * factors ** power])
            self.assertEqual("the grid's end" in grid.words("row", curves, grid.optimum(curves)), at_the_end, power)
        self.assertIsNone(grid.optimum(np.array([1.3 + 0.01 * factors])))

    def test_a_pair_that_is_alike_and_a_flat_row_are_no_numbers(self):
        information = np.array([[900.0, 899.9, 0, 0], [899.9, 900, 0, 0], [0, 0, 5, 0], [0, 0, 0, 400]])
        names = [rows.Row((name,), "") for name in "abcd"]
        objective = search.Objective(None, names, np.ones(4), np.tile([0.01, 100.0], (4, 1)))
        point = search.Point(np.zeros(4), [], None, ())
        why = outcome.judge(objective, point, search.Slopes([information], [], np.zeros(4, bool), np.zeros(4, bool)), names)
        self.assertEqual(sorted(why), [0, 1, 2])
        self.assertIn("separated from b", why[0])
        self.assertIn("flat", why[2])
        short = [np.array([[1.0, 2, 3, 0], [0, 2, 3, 4], [0, 2, 3, 4]]), np.array([[0, 2, 3, 4.0]])]
        why = outcome.judge(objective, point, search.Slopes([information], short, np.zeros(4, bool), np.zeros(4, bool)), names)
        self.assertIn("too short: 1 blocks", why[0])
        self.assertNotIn(3, why)


if __name__ == "__main__":
    unittest.main()
