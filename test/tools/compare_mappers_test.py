#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""tools/report/compare_mappers on made-up runs whose errors are known: a turned and shifted map has none, an offset of known size is its RMSE, a landmark
at another one's place is counted and not averaged, and the times of keyframes survive the stamp's 20 bits."""
import importlib.machinery
import importlib.util
import json
import os
import sys
import tempfile
import unittest

import numpy as np

sys.dont_write_bytecode = True
ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))
LOADER = importlib.machinery.SourceFileLoader("compare_mappers", os.path.join(ROOT, "tools/report/compare_mappers"))
mappers = importlib.util.module_from_spec(importlib.util.spec_from_loader("compare_mappers", LOADER))
LOADER.exec_module(mappers)

TIME_S = 1 + 0.01 * np.arange(4000)
WAY = 10 * np.exp(0.3j * TIME_S)
LANDMARKS = {k: 12 * np.exp(0.1j * k) for k in range(1, 61)}
STD_M, OFF_M = 0.5, 0.03


def write(path, header, rows):
    with open(path, "w", encoding="utf-8") as file:
        file.write(header + "\n" + "".join(",".join(str(one) for one in row) + "\n" for row in rows))


def made_up(folder, estimate, landmarks):
    """A run of a mapper that has that way and these landmarks."""
    yaw = np.angle(WAY) + np.pi / 2
    write(os.path.join(folder, "truth.csv"), "time_s,x_m,y_m,yaw_rad", zip(TIME_S, WAY.real, WAY.imag, yaw))
    write(os.path.join(folder, "estimates.csv"), "time_s,estimator,x_m,y_m,yaw_rad,std_x_m,std_y_m,std_yaw_rad,corr_xy,corr_x_yaw,corr_y_yaw",
          ((t, 1, p.real, p.imag, y, STD_M, STD_M, 0.1, 0, 0, 0) for t, p, y in zip(TIME_S, estimate, yaw)))
    write(os.path.join(folder, "map.csv"), "epoch,time_s,landmark,x_m,y_m,std_x_m,std_y_m,corr_xy,hits,age_s,landmark_state",
          ((i, 40, k, p.real, p.imag, 0.1, 0.1, 0, 9, 0, "Kept") for i, (k, p) in enumerate(list(landmarks.items()) * 2)))
    with open(os.path.join(folder, "run.json"), "w", encoding="utf-8") as file:
        json.dump({"landmarks": [{"id": k, "x_m": p.real, "y_m": p.imag} for k, p in LANDMARKS.items()]}, file)


class Judged(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name

    def test_a_turn_and_a_shift_are_no_error(self):
        turn = np.exp(0.2j)
        made_up(self.folder, turn * WAY + 3, {k: turn * p + 3 for k, p in LANDMARKS.items()})
        found, _ = mappers.judged(self.folder, "mapper")
        self.assertLess(max(found["trajectory_m"], found["map_m"]), 1e-9)
        self.assertEqual((found["points"], found["astray"]), (60, 0))

    def test_errors_are_those_that_were_made(self):
        out = WAY / np.abs(WAY) * OFF_M * np.where(np.arange(len(WAY)) % 2, 1, -1)  # to both sides: no motion takes it away
        landmarks = {k: p + (0.04 if k % 2 else -0.04) * p / abs(p) for k, p in LANDMARKS.items()}
        landmarks[7] = LANDMARKS[37]
        made_up(self.folder, WAY + out, landmarks)
        found, _ = mappers.judged(self.folder, "mapper")
        self.assertAlmostEqual(found["trajectory_m"], OFF_M, places=4)
        self.assertAlmostEqual(found["map_m"], 0.04, places=3)
        self.assertEqual(found["astray"], 1)
        self.assertAlmostEqual(found["nees"], (OFF_M / STD_M) ** 2, places=6)

    def test_a_keyframe_has_the_time_of_its_stamp(self):
        signals = mappers.bus_writer.Dbc().messages["Est_Keyframe"]
        time_us = 5_300_000  # 0.8 s before its frame
        word = 9 << signals.signals["Id"].start | (time_us & ((1 << 20) - 1)) << signals.signals["Stamp"].start
        with open(os.path.join(self.folder, "estimates.log"), "w", encoding="ascii") as file:
            file.write(f"(0000000006.100000) vcan0 {signals.identifier:03X}#{word.to_bytes(8, 'little').hex().upper()}\n")
        self.assertEqual(mappers.keyframes_made(self.folder), {9: 5.3})


if __name__ == "__main__":
    unittest.main()
