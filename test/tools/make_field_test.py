#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Likelihood fields of maps: every cell against all walls, the header against the bytes, the finest cell that fits, and what is refused."""
import os
import re
import subprocess
import sys
import tempfile
import unittest

import numpy as np

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
TOOL = os.path.join(ROOT, "tools", "dataset", "make_field")


class MakeFieldTest(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def path(self, name):
        return os.path.join(self.folder.name, name)

    def map(self, occupied, shape, resolution=0.1, origin=(-2.0, 3.0), unseen=0):
        """A free map with these cells occupied, as (row from below, column); the last columns are unknown."""
        shade = np.full(shape, 254, np.uint8)
        shade[:, shape[1] - unseen:] = 205
        for row, column in occupied:
            shade[shape[0] - 1 - row, column] = 0
        with open(self.path("m.pgm"), "wb") as file:
            file.write(b"P5\n%d %d\n255\n" % (shape[1], shape[0]) + shade.tobytes())
        with open(self.path("m.yaml"), "w", encoding="ascii") as file:
            file.write(f"image: m.pgm\nresolution: {resolution}\norigin: [{origin[0]}, {origin[1]}, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n")
        return np.array([[origin[0] + (column + 0.5) * resolution, origin[1] + (row + 0.5) * resolution] for row, column in occupied])

    def make(self, out, *options):
        return subprocess.run([TOOL, self.path("m.yaml"), self.path(out), *options], capture_output=True, text=True, check=False)

    def read(self, name):
        """(cell, step, low corner, levels with rows from below, bytes of index and tiles)."""
        with open(self.path(name), "rb") as file:
            words, data = file.readline().split(), file.read()
        cell, step, x, y = map(float, words[:4])
        columns, rows, tiles = map(int, words[4:])
        self.assertEqual(len(data), columns * rows + 128 * tiles)
        levels = np.zeros((rows * 16, columns * 16), int)
        for number in range(columns * rows):
            row, column = divmod(number, columns)
            body = {0: 14, 255: 15}.get(data[number])
            if body is None:
                at = columns * rows + 128 * (data[number] - 1)
                body = np.frombuffer(data[at:at + 128], np.uint8)
                body = np.column_stack([body & 15, body >> 4]).reshape(16, 16)
            levels[16 * row:16 * row + 16, 16 * column:16 * column + 16] = body
        return cell, step, (x, y), levels, data

    def test_every_cell_has_its_distance(self):
        walls = self.map([(5, c) for c in range(10, 80)] + [(r, 40) for r in range(20, 50)] + [(59, 99)], (60, 100))
        self.assertEqual(self.make("f", "--cell", "0.1").returncode, 0)
        cell, step, low, levels, _ = self.read("f")
        x = low[0] + (np.arange(levels.shape[1]) + 0.5) * cell
        y = low[1] + (np.arange(levels.shape[0]) + 0.5) * cell
        away = np.min(np.hypot(x[None, :, None] - walls[:, 0], y[:, None, None] - walls[:, 1]), axis=2)
        np.testing.assert_array_less(abs(levels[away < 13.4 * step] * step - away[away < 13.4 * step]), 0.51 * step)
        self.assertTrue((levels[away > 14.5 * step] >= 14).all())
        self.assertEqual(levels[away < 0.4 * step].max(), 0)
        self.assertLess(x[0], -2.0), self.assertGreater(y[-1], 9.0)

    def test_what_the_map_never_saw_is_no_free_space(self):
        self.map([(r, 80) for r in range(200)], (200, 300), unseen=150)
        self.assertEqual(self.make("f", "--cell", "0.1").returncode, 0)
        cell, _, low, levels, _ = self.read("f")
        x, y = (corner + (np.arange(count) + 0.5) * cell for corner, count in zip(low, levels.shape[::-1]))
        inside = levels[(y > 3) & (y < 23)]
        for low_x, high_x, level in ((8, 11.4, 14), (14.6, 27, 15)):  # a tile of 1.6 m is one or the other
            self.assertEqual(set(inside[:, (x > low_x) & (x < high_x)].ravel()), {level})

    def test_the_header_has_the_same_bytes(self):
        self.map([(5, c) for c in range(10, 80)], (60, 100))
        self.assertEqual(self.make("f", "--cell", "0.1").returncode, 0)
        self.assertEqual(self.make("small_room.hpp", "--cell", "0.1").returncode, 0)
        with open(self.path("small_room.hpp"), encoding="ascii") as file:
            text = file.read()
        lists = [bytes(int(word) for word in body.split(",") if word.strip()) for body in re.findall(r"k(?:Index|Tiles)\{\n(.*?)\n\};", text, re.S)]
        self.assertEqual(b"".join(lists), self.read("f")[4])
        self.assertIn("kSmallRoom", text)
        self.assertEqual(self.make("9.hpp").returncode, 1)

    def test_the_finest_cell_that_fits_is_taken(self):
        sides = []
        for side in (60, 300, 900):
            ring = [(r, c) for r in range(side) for c in (0, side - 1)] + [(r, c) for c in range(side) for r in (0, side - 1)]
            self.map(ring, (side, side))
            self.assertEqual(self.make("f").returncode, 0)
            cell, _, _, _, data = self.read("f")
            self.assertLessEqual(len(data), 32 * 1024)
            sides.append(cell)
        self.assertEqual(sides, sorted(sides))
        self.assertLess(sides[0], sides[2])

    def test_what_is_no_map_is_refused(self):
        self.map([], (20, 20))
        result = self.make("f")
        self.assertEqual(result.returncode, 1)
        self.assertIn("m.yaml: no occupied cell", result.stderr)
        self.map([(r, c) for r in range(0, 1000, 8) for c in range(0, 1000, 8)], (1000, 1000))
        result = self.make("f", "--cell", "0.05")
        self.assertEqual(result.returncode, 1)
        self.assertIn("expected at most 254 and 32768", result.stderr)
        self.assertIn("--cell is 7.0", self.make("f", "--cell", "7").stderr)
        self.assertFalse(os.path.exists(self.path("f")))


if __name__ == "__main__":
    unittest.main()
