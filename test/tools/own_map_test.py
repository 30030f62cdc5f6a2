#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Figures of mappers (tetap.report.own_map) on made-up maps whose errors are known, and the importer's logs without a map."""
import json
import os
import subprocess
import sys
import tempfile
import unittest

import numpy as np

sys.dont_write_bytecode = True
ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))
sys.path.insert(0, os.path.join(ROOT, "tools", "python"))
from tetap.report import own_map  # noqa: E402

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
