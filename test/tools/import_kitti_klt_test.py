#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""tools/dataset/import_kitti_klt: tables of a made-up drive hold what went in; bad files are refused with file and cause; a real drive's
tables agree with its file ($TETAP_DATA, skipped without)."""
import csv
import json
import os
import sys
import tempfile
import unittest

import numpy as np
import scipy.io
from scipy.spatial.transform import Rotation

sys.dont_write_bytecode = True
sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
from import_test import needs, run, text_of  # noqa: E402

REAL, with_real = needs("kitti_klt", "2011_09_26_drive_0051_sync_KLT.mat")
MOUNTING = np.array([[0.0, -1, 0], [0, 0, -1], [1, 0, 0]])


def made_up(images=5, tracks=4):
    """A drive of constant speed and turn rate, by closed formulas."""
    time = 1317.0 + 0.1 * np.arange(images)
    heading, speed, rate = 0.3 * 0.1 * np.arange(images), 8.0, 0.3
    place = np.array([speed / rate * np.sin(heading), speed / rate * (1 - np.cos(heading)), 0 * heading])
    seen = np.full((4, images, tracks), np.nan)
    for track in range(tracks):
        seen[:, track:, track] = 100.3 + 10 * track + np.arange(images - track)
    return {"t": time[None], "v_vk_vk_i": np.tile([[speed], [0], [0]], images), "w_vk_vk_i": np.tile([[0], [0], [rate]], images), "r_i_vk_i": place,
            "theta_vk_i": np.array([0 * heading, 0 * heading, heading]), "C_c_v": MOUNTING, "rho_v_c_v": np.array([[1.1], [0.2], [0.7]]),
            "fu": 720.0, "fv": 721.0, "cu": 610.0, "cv": 170.0, "b": 0.5, "y_k_j": seen}


class ImportKittiKlt(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.file, self.out = (os.path.join(self.folder.name, name) for name in ("drive.mat", "drive"))

    def imported(self, data):
        scipy.io.savemat(self.file, data)
        return run("import_kitti_klt", self.file, self.out)

    def rows(self, name):
        return [{key: float(value) for key, value in row.items()} for row in csv.DictReader(text_of(f"{self.out}.{name}.csv").splitlines())]

    def test_tables_hold_the_drive(self):
        data = made_up()
        result = self.imported(data)
        self.assertEqual(result.returncode, 0, result.stderr)
        features = {(row["image"], row["id"]): (row["u_quarter_px"], row["v_quarter_px"]) for row in self.rows("features")}
        self.assertEqual(len(features), 5 + 4 + 3 + 2)
        for (image, track), pixels in features.items():
            self.assertEqual(pixels, (round(4 * data["y_k_j"][0, int(image), int(track)]),) * 2)
        motion, truth, camera = self.rows("motion"), self.rows("truth"), self.rows("camera")[0]
        self.assertEqual([row["time_s"] for row in motion], [1.0, 1.1, 1.2, 1.3, 1.4])
        self.assertEqual((motion[2]["vx_mps"], motion[2]["wz_radps"]), (8.0, 0.3))
        for row, k in zip(truth, range(5)):
            np.testing.assert_allclose((row["x_m"], row["y_m"], row["z_m"]), data["r_i_vk_i"][:, k], atol=1e-8)
            # the body's x axis in the world, by the quaternion's own formula
            ahead = (1 - 2 * (row["qy"] ** 2 + row["qz"] ** 2), 2 * (row["qx"] * row["qy"] + row["qw"] * row["qz"]))
            np.testing.assert_allclose(ahead, (np.cos(0.03 * k), np.sin(0.03 * k)), atol=1e-8)
        turn = Rotation.from_quat([camera[key] for key in ("qx", "qy", "qz", "qw")])
        np.testing.assert_allclose(turn.apply([1, 0, 0]), (0, 0, 1), atol=1e-8)  # ahead is the camera's z
        np.testing.assert_allclose(turn.apply([0, 1, 0]), (-1, 0, 0), atol=1e-8)  # left is its -x
        self.assertEqual((camera["fu_px"], camera["cv_px"], camera["x_m"]), (720.0, 170.0, 1.1))
        self.assertEqual(json.loads(text_of(f"{self.out}.json"))["features"], 14)

    def test_features_outside_of_the_bus_are_left_out_and_counted(self):
        data = made_up()
        data["y_k_j"][0, 4, 0] = 2048.0
        result = self.imported(data)
        self.assertIn("left out: 1 features", result.stdout)
        self.assertEqual(len(self.rows("features")), 13)

    def test_bad_files_are_refused_with_file_and_cause_and_nothing_is_written(self):
        def broken(**changes):
            return {**made_up(), **changes}

        backwards, holes = made_up()["t"][:, ::-1], made_up()["v_vk_vk_i"]
        holes[0, 2] = np.nan
        cases = [({key: value for key, value in made_up().items() if key != "t"}, "no array t"), (broken(t=backwards), "time goes back at image 1"),
                 (broken(v_vk_vk_i=holes), "v_vk_vk_i has a value that is not a finite number"), (broken(C_c_v=2 * MOUNTING), "no rotation"),
                 (broken(y_k_j=np.ones((4, 3, 2))), "5 times and 3 images"), (broken(theta_vk_i=-40 * made_up()["theta_vk_i"]), "speeds and truth differ"),
                 (broken(y_k_j=np.ones((4, 5, 256))), "has 256 features, at most 255"), (broken(fu=np.ones((2, 1))), "fu has the shape (2, 1)")]
        for data, cause in cases:
            result = self.imported(data)
            self.assertNotEqual(result.returncode, 0, cause)
            self.assertIn(self.file, result.stderr)
            self.assertIn(cause, result.stderr)
            self.assertEqual(os.listdir(self.folder.name), ["drive.mat"])
        with open(self.file, "w") as file:
            file.write("no MATLAB file")
        self.assertIn("not a MATLAB 5 file", run("import_kitti_klt", self.file, self.out).stderr)
        self.assertIn("No such file", run("import_kitti_klt", self.file + "x", self.out).stderr)

    def test_identities_of_twelve_bits_wrap(self):
        data = made_up(tracks=1)
        seen = np.full((4, 5, 4098), np.nan)
        seen[:, :2, 1], seen[:, 3:, 4097] = 50.0, 60.0
        self.assertEqual(self.imported({**data, "y_k_j": seen}).returncode, 0)
        self.assertEqual([(row["image"], row["id"]) for row in self.rows("features")], [(0, 1), (1, 1), (3, 1), (4, 1)])
        seen[:, 1, 4097] = 60.0
        self.assertIn("same identity", self.imported({**data, "y_k_j": seen}).stderr)

    @with_real
    def test_a_real_drive_reprojects(self):
        """Directions of the tables meet in points: the median distance of a point from its rays is what KLT can do."""
        result = run("import_kitti_klt", REAL, self.out)
        self.assertEqual(result.returncode, 0, result.stderr)
        truth, camera = self.rows("truth"), self.rows("camera")[0]
        q_cb = Rotation.from_quat([camera[key] for key in ("qx", "qy", "qz", "qw")])
        lever = np.array([camera[key] for key in ("x_m", "y_m", "z_m")])
        tracks = {}
        for row in self.rows("features"):
            tracks.setdefault(row["id"], []).append(row)
        errors = []
        for rows in tracks.values():
            if len(rows) < 6:
                continue
            origins, rays, turns = [], [], []
            for row in rows[:6]:
                pose = truth[int(row["image"])]
                q_nb = Rotation.from_quat([pose[key] for key in ("qx", "qy", "qz", "qw")])
                ray = np.array([(row["u_quarter_px"] / 4 - camera["cu_px"]) / camera["fu_px"], (row["v_quarter_px"] / 4 - camera["cv_px"]) / camera["fv_px"], 1])
                turns.append(q_nb * q_cb.inv())
                rays.append(turns[-1].apply(ray / np.linalg.norm(ray)))
                origins.append(np.array([pose["x_m"], pose["y_m"], pose["z_m"]]) + q_nb.apply(lever))
            across = [np.eye(3) - np.outer(ray, ray) for ray in rays]
            if np.linalg.cond(sum(across)) > 1e4:
                continue
            point = np.linalg.solve(sum(across), sum(a @ o for a, o in zip(across, origins)))
            errors += [camera["fu_px"] * np.linalg.norm(a @ (point - o)) / np.linalg.norm(point - o) for a, o in zip(across, origins)]
        self.assertGreater(len(errors), 500)
        self.assertLess(np.median(errors), 1.0)


if __name__ == "__main__":
    unittest.main()
