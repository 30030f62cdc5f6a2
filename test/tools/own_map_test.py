#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Figures of mappers (tetap.report.own_map) on made-up maps whose errors are known, and the importer's logs without a map."""
import importlib.machinery
import importlib.util
import json
import os
import subprocess
import sys
import tempfile
import types
import unittest

import numpy as np

sys.dont_write_bytecode = True
ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))
sys.path.insert(0, os.path.join(ROOT, "tools", "python"))
from tetap.report import own_map, tables  # noqa: E402

DATA = os.environ.get("TETAP_DATA") or os.path.join(os.path.dirname(ROOT), "shared", "data")
MRCLAM = os.path.join(DATA, "mrclam", "MRCLAM_Dataset7")
TRUE = {1: 0 + 0j, 2: 10 + 0j, 3: 10 + 8j, 4: -2 + 6j, 5: 3 + 14j}


def moved(points, yaw_rad, shift):
    return {k: np.exp(1j * yaw_rad) * at + shift for k, at in points.items()}


class Rigid(unittest.TestCase):
    def test_finds_the_motion_that_was_made(self):
        found = moved(TRUE, 0.7, 5 - 3j)
        fit = own_map.Rigid(np.array(list(found.values())), np.array(list(TRUE.values())))
        self.assertAlmostEqual(fit.yaw_rad, -0.7, 12)
        for k, at in found.items():
            self.assertAlmostEqual(abs(fit(at) - TRUE[k]), 0, 12)

    def test_never_mirrors_or_scales(self):
        mirrored = {k: np.conj(at) for k, at in TRUE.items()}
        fit = own_map.Rigid(np.array(list(mirrored.values())), np.array(list(TRUE.values())))
        left = np.abs(fit(np.array(list(mirrored.values()))) - np.array(list(TRUE.values())))
        self.assertGreater(left.max(), 3)
        doubled = np.array([2 * at for at in TRUE.values()])
        self.assertGreater(np.abs(own_map.Rigid(doubled, np.array(list(TRUE.values())))(doubled) - np.array(list(TRUE.values()))).max(), 3)


class Counterparts(unittest.TestCase):
    def test_are_by_identity_where_there_is_one(self):
        far = {k: at + 1000 for k, at in TRUE.items()}
        self.assertEqual(own_map.counterparts(far, TRUE), {k: k for k in TRUE})

    def test_are_the_nearest_without_identities(self):
        nameless = {254 - i: at for i, at in enumerate(moved(TRUE, 0.1, 0.4 + 0.2j).values())}
        self.assertEqual(own_map.counterparts(nameless, TRUE), {254 - i: k for i, k in enumerate(TRUE)})


class WrongAssociations(unittest.TestCase):
    def judged(self, landmarks, truly):
        innovations = {"verdict": np.zeros(len(landmarks)), "landmark": np.array(landmarks, dtype=float), "nis": np.ones(len(landmarks)),
                       "time_s": np.arange(len(landmarks)) + 0.2, "age_ms": np.full(len(landmarks), 200.0)}
        sightings = {"time_s": np.arange(len(truly)).astype(float), "landmark": np.array(truly, dtype=float)}
        return own_map.wrong_associations(innovations, sightings, {k: k for k in TRUE}, TRUE)

    def test_are_counted_by_the_place_that_was_seen(self):
        self.assertEqual(self.judged([1, 2, 3], [1, 2, 3]), (0, 3))
        self.assertEqual(self.judged([1, 2, 4], [1, 2, 3]), (1, 3))

    def test_without_a_truth_at_the_stamp_nothing_is_judged(self):
        self.assertEqual(self.judged([1, 2], [99, 2]), (0, 1))


    def test_a_landmark_that_is_none_may_have_what_is_none(self):
        found = {250: 0.1 + 0j, 251: 10.1 + 0j, 252: 10 + 8j, 253: 6 + 4j}
        pairs, fit = own_map.fitted(found, own_map.counterparts(found, TRUE), TRUE)
        self.assertEqual((pairs[250], pairs[253]), (1, None))
        self.assertLess(abs(fit(found[252]) - TRUE[3]), 0.2)

    def test_a_sighting_of_clutter_belongs_to_no_landmark(self):
        self.assertEqual(self.judged([1, 2], [255, 2]), (1, 2))


def table(**columns):
    made = {}
    for name, values in columns.items():
        made[name] = tables.Column()
        made[name].add(np.array(values, dtype=float))
    return tables.Table(made)


class MapOverTime(unittest.TestCase):
    def rows(self, landmarks, state=1):
        count = len(landmarks)
        return table(landmark=landmarks, landmark_state=[state] * count, x_m=np.arange(count), y_m=[0] * count, time_s=np.arange(count), hits=[9] * count)

    def test_what_is_no_longer_published_is_not_in_the_map_at_the_end(self):
        rows = self.rows([254, 253, 252] * 5 + [254, 253] * 5)
        self.assertEqual(sorted(own_map.last_of_each(own_map.at_the_end(rows))), [253, 254])

    def test_unconfirmed_landmarks_without_identity_are_not_in_the_map(self):
        self.assertEqual(own_map.last_of_each(own_map.at_the_end(self.rows([254, 253] * 4, state=0))), {})
        self.assertEqual(sorted(own_map.last_of_each(own_map.at_the_end(self.rows([7, 9] * 4, state=0)))), [7, 9])

    def test_a_number_that_was_given_again_counts_from_then_on(self):
        rows = table(landmark=[254, 253] * 4, time_s=np.arange(8), hits=[5, 5, 6, 6, 1, 7, 2, 8], x_m=[50, 10, 50, 10, 0, 10, 0, 10], y_m=[0] * 8, std_x_m=[0.1] * 8,
                     std_y_m=[0.1] * 8, corr_xy=[0] * 8)
        begun = own_map.begins(rows)
        self.assertEqual(begun, {254: 4.0, 253: 1.0})
        elsewhere = table(landmark=[254] * 3, time_s=[0, 1, 2], hits=[1, 2, 3], x_m=[50, 0, 0.1], y_m=[0] * 3)
        self.assertEqual(own_map.begins(elsewhere), {254: 1.0})
        time_s, nees = own_map.landmark_nees(rows, {254: 1, 253: 2}, TRUE)
        self.assertEqual((list(time_s), nees.max()), ([1, 3, 4, 5, 6, 7], 0))
        innovations = {"verdict": np.zeros(2), "landmark": np.array([254.0, 254.0]), "nis": np.ones(2), "time_s": np.array([2.0, 6.0]), "age_ms": np.zeros(2)}
        sightings = {"time_s": np.array([2.0, 6.0]), "landmark": np.array([5.0, 1.0])}
        self.assertEqual(own_map.wrong_associations(innovations, sightings, {254: 1, 253: 2}, TRUE, begun), (0, 1))

    def test_the_nees_of_errors_of_the_published_size_is_two(self):
        draw = np.random.default_rng(3)
        count, corr = 20_000, 0.6
        x, y = np.linalg.cholesky([[0.04, corr * 0.2 * 0.1], [corr * 0.2 * 0.1, 0.01]]) @ draw.standard_normal((2, count))
        rows = table(landmark=[2] * count, x_m=10 + x, y_m=y, std_x_m=[0.2] * count, std_y_m=[0.1] * count, corr_xy=[corr] * count, time_s=np.arange(count), hits=[9] * count)
        _, nees = own_map.landmark_nees(rows, {2: 2}, TRUE)
        self.assertAlmostEqual(float(np.mean(nees)), 2, 1)
        self.assertEqual(len(own_map.landmark_nees(rows, {}, TRUE)[1]), 0)

    def test_the_file_of_sightings_lies_beside_the_truth(self):
        for truth, expected in (("a/run.truth.csv", "a/run.sightings.csv"), ("a/truth.csv", "a/truth.sightings.csv")):
            self.assertEqual(own_map.sightings_file(types.SimpleNamespace(path=truth)), expected)


class ChoiceOfNumbers(unittest.TestCase):
    """tools/report/choose_mapping"""

    @classmethod
    def setUpClass(cls):
        loader = importlib.machinery.SourceFileLoader("choose_mapping", os.path.join(ROOT, "tools", "report", "choose_mapping"))
        cls.choose = importlib.util.module_from_spec(importlib.util.spec_from_loader("choose_mapping", loader))
        loader.exec_module(cls.choose)

    def test_a_log_is_left_out_of_the_choice_of_its_own_numbers(self):
        score = np.array([[0.0, 5.0, 5.0], [1.0, 1.0, 1.0], [2.0, 0.9, 0.9]])  # the first is the best on log 0 alone
        order, without = self.choose.leave_one_out(score)
        self.assertEqual(list(order), [1, 2, 0])
        self.assertEqual(without, [2, 1, 1])

    def test_a_nees_above_its_bound_and_a_bad_seed_cost_and_others_do_not(self):
        table, worst = np.array([[[0.2, 0.1, 5.0]], [[0.2, 0.1, 1.0]], [[0.2, 0.1, 10.0]]]), np.array([[1.9], [1.0], [1.0]])
        first, second, third = self.choose.scores(table, worst, True)[:, 0]
        self.assertEqual(first, second)
        self.assertAlmostEqual(third - first, np.log(2), 12)
        self.assertEqual(self.choose.scores(table, worst, False)[2, 0], first)
        self.assertAlmostEqual(self.choose.scores(table, np.full((3, 1), 4.0), True)[0, 0] - first, np.log(2), 12)

    def test_the_nees_of_errors_of_the_published_size_is_three(self):
        draw, count = np.random.default_rng(5), 20_000
        correlation = np.array([[1, 0.5, -0.2], [0.5, 1, 0.3], [-0.2, 0.3, 1]])
        error = (np.linalg.cholesky(correlation) @ draw.standard_normal((3, count))) * np.array([[0.3], [0.1], [0.02]])
        rows = {"std_x_m": np.full(count, 0.3), "std_y_m": np.full(count, 0.1), "std_yaw_rad": np.full(count, 0.02), "corr_xy": np.full(count, 0.5),
                "corr_x_yaw": np.full(count, -0.2), "corr_y_yaw": np.full(count, 0.3)}
        self.assertAlmostEqual(self.choose.mean_nees(rows, *error), 3, 1)

    def test_a_grid_is_every_combination_and_a_wrong_one_is_named(self):
        self.assertEqual(self.choose.combinations(["a=1,2", "b=3"]), [["a=1", "b=3"], ["a=2", "b=3"]])
        with self.assertRaisesRegex(Exception, "--grid a: PATH=VALUE"):
            self.choose.combinations(["a"])


@unittest.skipUnless(os.path.isdir(MRCLAM), "no mrclam in $TETAP_DATA")
class Importer(unittest.TestCase):
    def imported(self, folder, *words):
        out = os.path.join(folder, "run")
        subprocess.run(["tools/dataset/import_mrclam", *words, "--until", "60", MRCLAM, "2", out], cwd=ROOT, check=True, capture_output=True)
        with open(out + ".log", encoding="ascii") as log, open(out + ".json", encoding="utf-8") as about:
            return log.read(), json.load(about), out

    def test_without_a_map_says_where_the_landmarks_are_and_sends_none(self):
        with tempfile.TemporaryDirectory() as folder:
            log, about, out = self.imported(folder, "--no-map")
            self.assertNotIn(" 305#", log)
            self.assertEqual(len(about["landmarks"]), 15)
            rows = own_map.read_table(out + ".sightings.csv", own_map.SIGHTINGS)
            self.assertEqual(len(rows["time_s"]), log.count(" 309#"))
            self.assertLessEqual(set(rows["landmark"].astype(int)), {one["id"] for one in about["landmarks"]})

    def test_with_a_map_has_no_file_of_sightings(self):
        with tempfile.TemporaryDirectory() as folder:
            log, _, out = self.imported(folder)
            self.assertEqual(log.count(" 305#"), 15)
            self.assertFalse(os.path.exists(out + ".sightings.csv"))


if __name__ == "__main__":
    unittest.main()
