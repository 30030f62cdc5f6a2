#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""tools/dataset/import_g2o: what is on the bus is what the file has, in g2o's and in TORO's order, as canmatrix reads it; bad files are refused
with line and cause."""
import os
import sys
import tempfile
import unittest

import numpy as np

sys.dont_write_bytecode = True
sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
from import_test import decode, judge, read_log, run, text_of  # noqa: E402

INFORMATION = np.array([[400.0, 30.0, -20.0], [30.0, 300.0, 10.0], [-20.0, 10.0, 900.0]])
EDGES = [(0, 1, 1.0, 0.1, 0.5), (1, 2, 1.1, -0.2, 1.0), (2, 3, 0.9, 0.05, 3.1), (3, 4, 1.0, 0.0, -3.1), (4, 0, -0.4, 0.3, 2.0), (1, 3, 1.2, 0.9, -2.2)]


def g2o(edges=EDGES, tag="EDGE_SE2", order=((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))):
    numbers = " ".join(f"{INFORMATION[k]:.9g}" for k in order)
    return "".join(f"{tag} {i} {j} {x} {y} {yaw} {numbers}\n" for i, j, x, y, yaw in edges)


def toro(edges=EDGES):
    return g2o(edges, "EDGE2", ((0, 0), (0, 1), (1, 1), (2, 2), (0, 2), (1, 2)))


class ImportGraph(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.file, self.out = (os.path.join(self.folder.name, name) for name in ("graph.g2o", "graph"))

    def imported(self, text, *options):
        with open(self.file, "w") as file:
            file.write(text)
        return run("import_g2o", self.file, self.out, *options)

    def edges(self):
        """(from, to, x, y, yaw, covariance) of the log, as canmatrix reads the frames."""
        matrix, pages = judge(), []
        for time_us, identifier, data in read_log(f"{self.out}.log"):
            name, values = decode(matrix, identifier, data)
            if name == "In_Closure":
                pages.append((time_us, {key: value.phys_value for key, value in values.items()}))
        self.assertEqual(len(pages) % 4, 0)
        found = []
        for k in range(0, len(pages), 4):
            self.assertEqual([int(page["Page"]) for _, page in pages[k:k + 4]], [0, 1, 2, 3])
            self.assertEqual(len({page["Seq"] for _, page in pages[k:k + 4]}), 1)
            one = {key: float(value) for _, page in pages[k:k + 4] for key, value in page.items() if key != "Page"}
            sigma = np.array([one["StdX"], one["StdY"], one["StdYaw"]])
            rho = np.array([[1, one["CorrXY"], one["CorrXYaw"]], [one["CorrXY"], 1, one["CorrYYaw"]], [one["CorrXYaw"], one["CorrYYaw"], 1]])
            found.append((int(one["FromId"]), int(one["ToId"]), one["X"], one["Y"], one["Yaw"], rho * np.outer(sigma, sigma)))
        return found

    def test_the_log_has_the_edges_of_the_file_in_the_order_of_their_later_pose(self):
        for text in (g2o(), toro(), "\ufeff" + g2o(), "# a comment\nFIX 0\n" + "".join(f"VERTEX_SE2 {k} 0 0 0\n" for k in range(5)) + g2o()):
            self.assertEqual(self.imported(text).returncode, 0)
            found = self.edges()
            self.assertEqual([edge[:2] for edge in found], [(0, 1), (1, 2), (2, 3), (1, 3), (3, 4), (4, 0)])
            of_file = {edge[:2]: edge for edge in EDGES}
            for i, j, x, y, yaw, covariance in found:
                np.testing.assert_allclose((x, y, yaw), of_file[i, j][2:], atol=0.5001e-4)
                c, s = np.cos(of_file[i, j][4]), np.sin(of_file[i, j][4])
                turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])  # the file's information is in axes turned by the measured yaw
                np.testing.assert_allclose(covariance, turn @ np.linalg.inv(INFORMATION) @ turn.T, rtol=3e-3, atol=1e-6)

    def test_odometry_that_stands_backwards_is_turned_round(self):
        backwards = [(1, 0, -1.0, 0.2, 0.3), *EDGES[1:]]
        self.assertEqual(self.imported(g2o(backwards)).returncode, 0)
        i, j, x, y, yaw, _ = self.edges()[0]
        c, s = np.cos(0.3), np.sin(0.3)
        self.assertEqual((i, j), (0, 1))
        np.testing.assert_allclose((x, y, yaw), (c * 1.0 - s * 0.2, -s * 1.0 - c * 0.2, -0.3), atol=1e-4)

    def test_false_closures_are_added_and_counted(self):
        self.assertEqual(self.imported(g2o(), "--false", "7", "--seed", "3").returncode, 0)
        self.assertEqual(len(self.edges()), len(EDGES) + 7)
        self.assertIn('"false_closures": 7', text_of(f"{self.out}.json"))

    def test_every_spelling_of_a_planar_edge_is_taken_and_other_lines_are_counted(self):
        toro_order = ((0, 0), (0, 1), (1, 1), (2, 2), (0, 2), (1, 2))
        more = "".join(f"{line.split(' ', 3)[0]} {' '.join(line.split(' ')[1:3])} 77 {line.split(' ', 3)[3]}\n"
                       for line in g2o(tag="EDGE_SE2_SWITCHABLE").splitlines())
        others = ("EQUIV 0 1\nBR 0 9 0.1 2 1 1\nEDGE_SE2_XY 0 8 1 1 1 0 1\nEDGE_PRIOR_SE2 0 0 0 0 1 0 0 1 0 1\nPARAMS_SE2OFFSET 0 0 0 0\n"
                  "VERTEX_XY 8 1 1\nFIX 0\nFIX 1\n")
        self.assertEqual(self.imported(g2o()).returncode, 0)
        expected = self.edges()
        for text in (g2o(tag="EDGE2", order=toro_order), g2o(tag="ODOMETRY", order=toro_order), more, others + g2o()):
            self.assertEqual(self.imported(text).returncode, 0)
            self.assertEqual(str(self.edges()), str(expected))
        for tag, count in (("EQUIV", 1), ("BR", 1), ("FIX", 2), ("PARAMS_SE2OFFSET", 1), ("EDGE_PRIOR_SE2", 1)):
            self.assertRegex(text_of(f"{self.out}.json"), f'"{tag}": {count}')

    def test_an_edge_between_sensors_is_one_between_their_poses(self):
        """By drawn errors: 40 000 measurements Z exp(e), each taken to the poses by products of matrices."""
        def matrix(x, y, yaw):
            return np.array([[np.cos(yaw), -np.sin(yaw), x], [np.sin(yaw), np.cos(yaw), y], [0, 0, 1]])
        of_first, of_second, z, six = (0.4, -0.3, 0.7), (-0.2, 0.5, -1.9), (1.5, 0.6, 2.4), "900 20 10 1600 -30 2500"
        params = "".join(f"PARAMS_SE2OFFSET {k} {' '.join(map(str, place))}\n" for k, place in ((3, of_first), (5, of_second)))
        edge = f"EDGE_SE2_OFFSET 0 1 3 5 {' '.join(map(str, z))} {six}\n"
        self.assertEqual(self.imported(edge + params).returncode, 0)
        ((i, j, *found, covariance),) = self.edges()
        information = np.array([[900, 20, 10], [20, 1600, -30], [10, -30, 2500]])
        drawn = np.random.default_rng(3).multivariate_normal(np.zeros(3), np.linalg.inv(information), 40_000)
        poses = matrix(*of_first) @ matrix(*z) @ np.array([matrix(*e) for e in drawn]) @ np.linalg.inv(matrix(*of_second))
        exact = matrix(*of_first) @ matrix(*z) @ np.linalg.inv(matrix(*of_second))
        yaw = np.arctan2(poses[:, 1, 0], poses[:, 0, 0]) - np.arctan2(exact[1, 0], exact[0, 0])
        expected = np.cov(np.stack([poses[:, 0, 2], poses[:, 1, 2], np.remainder(yaw + np.pi, 2 * np.pi) - np.pi]))
        np.testing.assert_allclose(found, (exact[0, 2], exact[1, 2], np.arctan2(exact[1, 0], exact[0, 0])), atol=1e-3)
        np.testing.assert_allclose(covariance, expected, atol=0.03 * expected.max())
        self.assertIn(":1: no PARAMS_SE2OFFSET line states the offset 3", self.imported(edge).stderr)
        self.assertIn("9 numbers, expected 13", self.imported(params + f"EDGE_SE2_OFFSET 0 1 1 2 3 {' '.join(six.split()[:4])}\n").stderr)

    def test_information_in_the_other_order_is_seen_by_what_is_positive_definite(self):
        shape = "100 0 0 100 0 400", "100 0 100 400 0 0"  # g2o's and TORO's order of one matrix
        for tag in ("EDGE_SE2", "EDGE2"):
            for six in shape:
                self.assertEqual(self.imported(f"{tag} 0 1 1 0 1.5708 {six}\n").returncode, 0)
                np.testing.assert_allclose(self.edges()[0][5], np.diag((0.01, 0.01, 0.0025)), atol=1e-6)

    def test_ids_are_names_with_any_gaps(self):
        self.assertEqual(self.imported(g2o()).returncode, 0)
        expected = self.edges()
        for of in (lambda k: k + 1, lambda k: 7 * k + 3, lambda k: (ord("a") << 56) + k, lambda k: (ord("x") << 56) + 5 * k, lambda k: 90 - k):
            self.assertEqual(self.imported(g2o([(of(i), of(j), *rest) for i, j, *rest in EDGES])).returncode, 0)
            found = self.edges()
            if of(1) > of(0):
                self.assertEqual(str(found), str(expected))
            else:  # by number the poses run backwards
                self.assertEqual({frozenset(edge[:2]) for edge in found}, {frozenset((4 - i, 4 - j)) for i, j, *_ in EDGES})
        shuffled = {0: 4, 1: 2, 2: 9, 3: 0, 4: 5}  # no edge joins 0 and 2: the order is that of the edges
        self.assertEqual(self.imported(g2o([(shuffled[i], shuffled[j], *rest) for i, j, *rest in EDGES])).returncode, 0)
        self.assertEqual(str(self.edges()), str(expected))

    def test_a_bad_file_is_refused_with_line_and_cause(self):
        bad = {"EDGE_SE3:QUAT 0 1 1 2 3\n": ("no planar edge in it", "1 of EDGE_SE3:QUAT"),
               g2o() + "0 3 1 0 0 1 0 0 1 0 1\n": (":7:", "no tag"),
               g2o() + "EDGE_SE2 0 1 1 0 0 1 0 0\n": (":7:", "8 numbers, expected 11"),
               g2o() + "EDGE_SE2 2 2 1 0 0 1 0 0 1 0 1\n": (":7:", "to itself"),
               g2o() + "EDGE_SE2 0 3 1 0 0 1 0 0 -1 0 1\n": (":7:", "not positive definite"),
               g2o() + "EDGE_SE2 0 3 nan 0 0 1 0 0 1 0 1\n": (":7:", "column 4 is not a finite number"),
               g2o() + "EDGE_SE2 0 x 1 0 0 1 0 0 1 0 1\n": (":7:", "not an id"),
               g2o() + "EDGE_SE2 0 -3 1 0 0 1 0 0 1 0 1\n": (":7:", "below zero"),
               "VERTEX_SE2 0 0 0 0\nVERTEX_SE2 0 0 0 0\n" + g2o(): (":2:", "twice"),
               g2o(EDGES[:1] + EDGES[2:]): ("from pose 1 to pose 2",),
               g2o() + "EDGE_SE2 2 9 1 0 0 1 0 0 1 0 1\n": ("from pose 4 to pose 9",),
               g2o() + "EDGE_SE2 0 3 200 0 0 1 0 0 1 0 1\n": ("longer than the bus",),
               g2o() + "EDGE_SE2 0 3 1 0 0 1e-4 0 0 1e-4 0 1\n": ("sigma above",),
               "# nothing\n": ("no planar edge in it",)}
        for text, words in bad.items():
            result = self.imported(text)
            self.assertEqual(result.returncode, 1, text)
            self.assertEqual(len(result.stderr.splitlines()), 1, result.stderr)
            for word in ("graph.g2o", *words):
                self.assertIn(word, result.stderr)
            self.assertFalse(os.path.exists(f"{self.out}.log"))
        result = run("import_g2o", os.path.join(self.folder.name, "none.g2o"), self.out)
        self.assertIn("No such file", result.stderr)


if __name__ == "__main__":
    unittest.main()
