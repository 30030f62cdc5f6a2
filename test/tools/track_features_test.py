#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""tools/vision/track_features on images of a room whose points behind the pixels are exact: tracks stay on their points, an identity stays with its
point, and the robots that take images get nearer to the truth than their wheels. Bad input is refused with its cause. Without OpenCV the status is 77.
TETAP_KEEP names a folder that keeps the runs and their picture."""
import os
import subprocess
import sys
import tempfile
import unittest

import numpy as np

sys.dont_write_bytecode = True
HERE = os.path.dirname(os.path.realpath(__file__))
ROOT = os.path.dirname(os.path.dirname(HERE))
sys.path[:0] = [HERE, os.path.join(ROOT, "tools", "python")]
try:
    import cv2
except ImportError:
    print("track_features_test: OpenCV is missing (apt-get install python3-opencv)")
    sys.exit(77)
import rendered_room as room  # noqa: E402
from tetap.can import bus_writer  # noqa: E402

PROGRAMS = os.environ.get("TETAP_PROGRAMS", os.path.join(ROOT, "build/host/sim_host"))
RADIUS_M, SPEED_MPS, RATE_HZ, LAPS = 4.0, 1.0, 10, 2
TURN_RADPS = SPEED_MPS / RADIUS_M
IMAGES = round(LAPS * 2 * np.pi / TURN_RADPS * RATE_HZ) + 1
START_US = 1_000_000
SCALE, GYRO_RAD = 1.01, 0.0022  # of wheels; of a turn in 50 ms, white
CAMERA = {"camera.fu_px": room.FOCAL_PX, "camera.fv_px": room.FOCAL_PX, "camera.cu_px": room.CENTRE_PX[0], "camera.cv_px": room.CENTRE_PX[1]}


def way(time_s):
    """(x, y, yaw) on a circle about the middle of the room."""
    angle = TURN_RADPS * time_s
    return np.stack([RADIUS_M * np.cos(angle), RADIUS_M * np.sin(angle), angle + np.pi / 2], axis=-1)


def drive_log():
    """The robot's wheels and gyroscope, and its start."""
    log, random = bus_writer.Log(bus_writer.Dbc()), np.random.default_rng(7)
    x_m, y_m, yaw_rad = way(0.0)
    log.add("Cmd_SetPos", START_US - 100_000, Ctr=1, X=x_m, Y=y_m)
    log.add("Cmd_SetYaw", START_US - 99_000, Ctr=1, Yaw=yaw_rad, StdPos=0.001, StdYaw=0.001)
    time_us = START_US + np.arange(2 * IMAGES) * 50_000
    angle = np.where(np.arange(len(time_us)) > 0, TURN_RADPS * 0.05 + random.normal(0, GYRO_RAD, len(time_us)), 0)
    seq = bus_writer.sequence(len(time_us))
    log.add("In_Imu0Gyro", time_us, AngX=0 * angle, AngY=0 * angle, AngZ=angle, Seq=seq)
    log.add("In_Imu0Accel", time_us, Seq=seq)
    log.add("In_Imu0Time", time_us, Stamp=time_us & bus_writer.STAMP_MASK, Interval=50_000, Temp=np.nan, Seq=seq)
    time_us = time_us[::2]
    speed = np.where(np.arange(len(time_us)) > 0, SCALE * SPEED_MPS + random.normal(0, 0.02, len(time_us)), 0)
    log.add("In_BodySpeed", time_us, Stamp=time_us & bus_writer.STAMP_MASK, Seq=bus_writer.sequence(len(time_us)), Forward=speed, YawRate=np.nan)
    return log.text()


def tool(*words):
    return subprocess.run([os.path.join(ROOT, "tools/vision/track_features"), *words], capture_output=True, text=True)


def sightings(path, camera):
    """(image, identity, u, v) of a camera's features."""
    rows, dbc = [], bus_writer.Dbc()
    message = dbc.messages["In_Feature"]
    with open(path, encoding="ascii") as file:
        for line in file:
            time, _, frame = line.split()
            if frame.startswith(f"{message.identifier:03X}#"):
                whole = int.from_bytes(bytes.fromhex(frame[4:]), "little")
                one = {name: whole >> at.start & ((1 << at.length) - 1) for name, at in message.signals.items()}
                if one["Inst"] == camera:
                    rows.append((round((float(time[1:-1]) - START_US / 1e6) * RATE_HZ), one["TrackId"], one["U"] / 4, one["V"] / 4))
    return np.array(rows)


class Room(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = os.environ.get("TETAP_KEEP") or cls.enterClassContext(tempfile.TemporaryDirectory())
        os.makedirs(cls.path("images"), exist_ok=True)
        paint, noise = room.paints(1), np.random.default_rng(2)
        cls.truth = way(np.arange(IMAGES) / RATE_HZ)
        for i, (x_m, y_m, yaw_rad) in enumerate(cls.truth):
            cv2.imwrite(cls.path("images", f"{i:04}.png"), room.image(paint, (x_m, y_m), yaw_rad, noise))
        with open(cls.path("drive.log"), "wb") as file:
            file.write(drive_log())
        more = {"camera.position_b_m": " ".join(map(str, room.MOUNT_M)), "wheels.noise.speed": 0.001, "gyro.noise": 1e-4, "wired.imu": 0, "wired.encoders": 0}
        with open(cls.path("room.params"), "w", encoding="utf-8") as file:
            file.writelines(f"{name} = {value}\n" for name, value in (CAMERA | more).items())
        cls.done = tool(cls.path("images"), cls.path("seen.log"), "--params", cls.path("room.params"), "--rate", str(RATE_HZ), "--start", str(START_US / 1e6),
                        "--late", "0", "--recognise", "--with", cls.path("drive.log"))

    @classmethod
    def path(cls, *parts):
        return os.path.join(cls.folder, *parts)

    def points(self, rows):
        """The exact points behind these features."""
        return np.array([room.hits(row[None, 2:], self.truth[int(row[0]), :2], self.truth[int(row[0]), 2])[0][0] for row in rows])

    def test_a_track_stays_on_its_point(self):
        self.assertEqual(self.done.returncode, 0, self.done.stderr)
        rows = sightings(self.path("seen.log"), 0)
        self.assertGreater(len(rows) / IMAGES, 30)
        self.assertLess(np.bincount(rows[:, 0].astype(int)).max(), 41)
        off, lives, begun = [], [], {}
        for row in rows:
            image, identity = int(row[0]), int(row[1])
            first, last, point = begun.get(identity, (None, -2, None))
            if last != image - 1:  # an identity comes again after 4096 others
                first, point = image, self.points([row])[0]
            begun[identity] = (first, image, point)
            if image > first and np.isfinite(point).all():
                off.append(np.abs(room.pixels_of(point[None], self.truth[image, :2], self.truth[image, 2])[0] - row[2:]).max())
                lives.append(image - first)
        self.assertLess(np.nanmedian(off), 0.5)
        self.assertLess(np.nanmean(np.array(off) > 3), 0.05)
        self.assertGreater(np.max(lives), 20)

    def test_an_identity_is_a_place(self):
        rows = sightings(self.path("seen.log"), 3)
        points = self.points(rows)
        lap = (rows[:, 0] > IMAGES / 2).astype(int)
        again, off = 0, []
        for identity in np.unique(rows[:, 1]):
            mine = rows[:, 1] == identity
            off.append(np.linalg.norm(points[mine] - np.nanmedian(points[mine], axis=0), axis=1))
            again += len(set(lap[mine])) == 2
        self.assertGreaterEqual(len(off), 40)
        self.assertGreater(again / len(off), 0.5)
        self.assertLess(np.mean(np.concatenate(off) > 0.5), 0.05)

    def test_the_robots_come_nearer_to_the_truth(self):
        errors, ends = {}, {}
        for robot in ("visual", "visual_slam"):
            out = self.path(robot)
            subprocess.run([os.path.join(PROGRAMS, "tetap-play"), self.path("seen.log"), "--memory", "--robot", robot, "--params", self.path("room.params"),
                            "--out", out, "--quiet"], check=True)
            rows = np.genfromtxt(os.path.join(out, "estimates.csv"), delimiter=",", names=True, usecols=("time_s", "estimator", "x_m", "y_m"))
            rows = rows[np.isfinite(rows["x_m"]) & (rows["time_s"] > START_US / 1e6 + 0.5)]
            true = way(rows["time_s"] - START_US / 1e6)
            off = np.hypot(rows["x_m"] - true[:, 0], rows["y_m"] - true[:, 1])
            for k, name in ((0, "wheels"), (1, robot)):
                mine = rows["estimator"] == k
                errors[name] = np.sqrt(np.mean(off[mine] ** 2))
                ends[name] = np.sqrt(np.mean(off[mine & (rows["time_s"] > rows["time_s"][-1] - 10)] ** 2))
            self.draw(robot, rows, true)
        print("RMSE [m], that of the last 10 s:", {name: (round(errors[name], 3), round(ends[name], 3)) for name in errors})
        self.assertTrue(0.4 < errors["wheels"] < 0.9, errors)
        self.assertTrue(0.05 < errors["visual"] < 0.9 * errors["wheels"], errors)
        self.assertTrue(0.02 < errors["visual_slam"] < 0.5 * errors["wheels"], errors)
        self.assertTrue(0.01 < ends["visual_slam"] < 0.3 * ends["wheels"], ends)

    def draw(self, robot, rows, true):
        if "TETAP_KEEP" not in os.environ:
            return
        import matplotlib
        matplotlib.use("Agg")
        import matplotlib.pyplot as plt
        _, axis = plt.subplots(figsize=(6, 6), layout="constrained")
        axis.plot(true[:, 0], true[:, 1], color="0.75", linewidth=4, label="truth")
        for k, name in ((0, "wheels and gyroscope"), (1, robot)):
            axis.plot(rows["x_m"][rows["estimator"] == k], rows["y_m"][rows["estimator"] == k], linewidth=1, label=name)
        axis.set(aspect="equal", xlabel="east [m]", ylabel="north [m]")
        axis.legend()
        plt.savefig(self.path(f"{robot}.png"), dpi=100)
        plt.close()


class Refused(unittest.TestCase):
    def test_bad_input_names_file_and_cause(self):
        with tempfile.TemporaryDirectory() as folder:
            params, out = os.path.join(folder, "p"), os.path.join(folder, "o.log")
            with open(params, "w", encoding="utf-8") as file:
                file.writelines(f"{name} = {value}\n" for name, value in CAMERA.items())
            half = os.path.join(folder, "half")
            with open(half, "w", encoding="utf-8") as file:
                file.write("camera.fu_px = 10\ncamera.fv_px = ten\n")
            pictures = os.path.join(folder, "pictures")
            os.makedirs(pictures)
            for words, text in (((pictures, out, "--params", params), "0 pictures"), ((pictures, out, "--params", half), "half:2"),
                                ((pictures, out, "--params", os.path.join(folder, "none")), "none"), (("camera:x", out, "--params", params), "no such camera"),
                                (("camera:99", out, "--params", params), "no such camera"),
                                ((pictures, out, "--params", params, "--lens", "1,2"), "--lens"), ((pictures, out, "--params", params, "--rate", "0"), "--rate")):
                done = tool(*words)
                self.assertEqual(done.returncode, 1, (words, done.stderr))
                self.assertIn(text, done.stderr)
                self.assertEqual(done.stderr.count("\n"), 1)
            for name, shape in (("a.png", (48, 64)), ("b.png", (48, 60))):
                cv2.imwrite(os.path.join(pictures, name), np.zeros(shape, np.uint8))
            self.assertIn("'a' is no time", tool(pictures, out, "--params", params).stderr)
            numbered = os.path.join(folder, "numbered")
            os.makedirs(numbered)
            for name in ("0000.png", "0001.png"):
                cv2.imwrite(os.path.join(numbered, name), np.zeros((48, 64), np.uint8))
            self.assertIn("0001.png is not 1 ms after", tool(numbered, out, "--params", params).stderr)
            self.assertIn("60 x 48", tool(pictures, out, "--params", params, "--rate", "10").stderr)
            self.assertFalse(os.path.exists(out))


if __name__ == "__main__":
    unittest.main()
