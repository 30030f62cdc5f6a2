#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Maps of scans as PGM and YAML: a room against its walls, a CAN log of frames written here, files of other hands, and what is refused."""
import os
import subprocess
import sys
import tempfile
import unittest

import numpy as np

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
sys.dont_write_bytecode = True
sys.path.insert(0, os.path.join(ROOT, "tools", "python"))
from tetap.dataset import occupancy  # noqa: E402

LOW, HIGH = np.array([-4.0, -3.0]), np.array([5.0, 2.0])  # corners of a room
PILLAR, RADIUS = np.array([2.5, -1.5]), 0.3
BEAMS, STEP = 720, 0.00873


def box(x, y, yaw, first=-np.pi):
    """Ranges inside of the room: the nearest of the walls ahead along each axis and of the pillar."""
    bearing = yaw + first + STEP * np.arange(BEAMS)
    c, s = np.cos(bearing), np.sin(bearing)
    along, across = (PILLAR[0] - x) * c + (PILLAR[1] - y) * s, (PILLAR[1] - y) * c - (PILLAR[0] - x) * s
    pillar = np.where((along > 0) & (abs(across) < RADIUS), along - np.sqrt(np.maximum(RADIUS ** 2 - across ** 2, 0)), np.inf)
    return np.minimum(pillar, box_alone(x, y, c, s))


def box_alone(x, y, c, s):
    return np.minimum((np.where(c < 0, LOW[0], HIGH[0]) - x) / np.where(c == 0, 1e-9, c), (np.where(s < 0, LOW[1], HIGH[1]) - y) / np.where(s == 0, 1e-9, s))


class ExportMapTest(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.out = os.path.join(self.folder.name, "room")

    def file(self, name, data):
        path = os.path.join(self.folder.name, name)
        with open(path, "wb") as file:
            file.write(data if isinstance(data, bytes) else data.encode())
        return path

    def export(self, *arguments):
        return subprocess.run([os.path.join(ROOT, "tools/dataset/export_map"), *arguments], capture_output=True, text=True, timeout=60)

    def walls(self, grid):
        """Centres of the occupied cells, in m."""
        row, column = np.nonzero(grid.shade == occupancy.OCCUPIED)
        return np.column_stack([grid.origin[0] + (column + 0.5) * grid.resolution, grid.origin[1] + (grid.shade.shape[0] - row - 0.5) * grid.resolution])

    def shade_at(self, grid, x, y):
        return grid.shade[grid.shade.shape[0] - 1 - int((y - grid.origin[1]) // grid.resolution), int((x - grid.origin[0]) // grid.resolution)]

    def check_room(self, grid):
        walls = self.walls(grid)
        from_pillar = abs(np.hypot(*(walls - PILLAR).T) - RADIUS)
        from_wall = np.column_stack([abs(walls - LOW), abs(walls - HIGH), from_pillar]).min(axis=1)
        self.assertGreater((from_pillar < grid.resolution).sum(), 8)
        self.assertLess(from_wall.max(), 1.5 * grid.resolution)
        self.assertGreater(len(walls), 0.8 * 2 * sum(HIGH - LOW) / grid.resolution)
        for at in ((0, 0), (4.5, 1.5), (-3.5, -2.5), (2.5, 0.5), (-1.5, -1.5)):
            self.assertEqual(self.shade_at(grid, *at), occupancy.FREE)
        self.assertEqual(self.shade_at(grid, HIGH[0] + grid.resolution * 1.9, 0), occupancy.UNKNOWN)

    def test_scans_with_their_poses_become_the_room(self):
        poses = [(0, 0, 0), (2, 1, 0.7), (-2.5, -1, 2.0)]
        mounting = (0.3, -0.2, 0.5)
        scans = [f"{BEAMS} {-np.pi} {STEP}"]
        for x, y, yaw in poses:
            c, s = np.cos(yaw), np.sin(yaw)
            ranges = box(x + c * 0.3 + s * 0.2, y + s * 0.3 - c * 0.2, yaw + 0.5)
            scans.append(" ".join(["1000000 0 0 0"] + [str(int(round(r / 0.005))) for r in ranges]))
        result = self.export(self.file("a.scans", "\n".join(scans)), self.out, "--scans", "--poses",
                             self.file("a.truth", "\n".join("%g %g %g" % pose for pose in poses)), "--mounting", *map(str, mounting))
        self.assertEqual(result.returncode, 0, result.stderr)
        grid = occupancy.read(self.out + ".yaml")
        self.check_room(grid)
        x0, y0, turn = poses[1]
        c, s = np.cos(turn), np.sin(turn)
        from_start = [(c * (x - x0) + s * (y - y0), c * (y - y0) - s * (x - x0), yaw - turn) for x, y, yaw in poses]
        result = self.export(self.file("a.scans", "\n".join(scans)), self.out + "3", "--scans", "--poses",
                             self.file("b.truth", "\n".join("%.9g %.9g %.9g" % pose for pose in from_start)), "--mounting", *map(str, mounting),
                             "--start", *map(str, poses[1]))
        self.assertEqual(result.returncode, 0, result.stderr)
        self.check_room(occupancy.read(self.out + "3.yaml"))
        again = self.export(self.out + ".yaml", self.out + "2")
        self.assertEqual(again.returncode, 0, again.stderr)
        for end in (".pgm", ".yaml"):
            with open(self.out + end, "rb") as one, open(self.out + "2" + end, "rb") as two:
                self.assertEqual(one.read().replace(b"room", b"room2"), two.read())

    def test_the_log_of_a_node_is_drawn_where_its_last_round_has_the_keyframes(self):
        for within_us in (0, 400):
            result = self.export(self.file("raw.log", self.mapping_log(within_us)), self.out)
            self.assertEqual(result.returncode, 0, result.stderr)
            self.assertIn("1 keyframes left out", result.stdout)
            self.check_room(occupancy.read(self.out + ".yaml"))

    def mapping_log(self, within_us):
        def frame(offset, value):
            return "(%d.000000) can0 %03X#%s" % (len(lines), 0x300 + offset, (value & (1 << 64) - 1).to_bytes(8, "little").hex().upper())

        def pose(keyframe, x, y, yaw):
            return frame(835 - 768, keyframe | (round(x * 100) & 0x3FFFF) << 14 | (round(y * 100) & 0x3FFFF) << 32 | (round(yaw * 2000) & 0x3FFF) << 50)
        places, lines = [(0, 0, 0), (2, 1, 0.7), (-2.5, -1, 1.5)], []
        for k, place in enumerate(places):
            first = round(-3.14 * 2000)
            lines.append(frame(844 - 768, 1000 * k | k << 20 | BEAMS << 26 | (first & 0x3FFF) << 36 | round(STEP * 1e5) << 50))
            steps = np.round(box(*place, first=first / 2000) / 0.005).astype(int)
            for block in range(BEAMS // 4):
                lines.append(frame(843 - 768, k | block << 4 | sum(int(steps[4 * block + i]) << 12 + 13 * i for i in range(4))))
            if within_us:  # the stamp of a scanner that turns is within the scan: Est_ScanMatch says which one it was
                lines.append(frame(838 - 768, k << 4))
            lines.append(frame(834 - 768, k | 1000 * k + within_us << 14))
        lines += [pose(k, 9, 9, 1) for k in range(3)]                     # before the loop was closed
        lines += [pose(k, *places[k]) for k in (0, 1)] + [pose(0, *places[0]), pose(1, *places[1])]  # 2 was composed away
        return "\n".join(lines)

    def test_files_of_other_hands_are_read(self):
        self.file("m.pgm", "P2\n# made by hand\n3 2\n100\n0 100 80\n100 100 0\n")
        text = "image: m.pgm  # beside it\nresolution: 0.5\norigin: [-1.0, 2.5, 0.0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
        grid = occupancy.read(self.file("m.yaml", text))
        np.testing.assert_array_equal(grid.shade, [[0, 254, 205], [254, 254, 0]])
        np.testing.assert_allclose(self.walls(grid), [[-0.75, 3.25], [0.25, 2.75]])
        negated = self.file("n.yaml", text.replace("negate: 0", "negate: 1"))
        np.testing.assert_array_equal(occupancy.read(negated).shade, [[254, 0, 0], [0, 0, 254]])

    def test_what_is_no_map_is_refused_with_its_place(self):
        self.file("m.pgm", b"P5 2 2 255\n" + bytes(3))
        good = "image: m.pgm\nresolution: 0.5\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
        for text, message in ((good, "m.pgm: 3 cells, expected 4"), (good.replace("0.5", "nan"), "resolution is 'nan'"), (good.replace("0, 0]", "0, 1]"), "yaw of 1"),
                              (good.replace("m.pgm", "gone.pgm"), "gone.pgm: No such file"), ("what\n", "m.yaml:1: expected 'key: value'"),
                              (good + "mode: raw\n", "mode is 'raw'")):
            result = self.export(self.file("m.yaml", text), self.out)
            self.assertEqual(result.returncode, 1, message)
            self.assertIn(message, result.stderr)
            self.assertFalse(os.path.exists(self.out + ".pgm"))
        self.assertIn("no keyframe with its scan", self.export(self.file("empty.log", ""), self.out).stderr)


if __name__ == "__main__":
    unittest.main()
