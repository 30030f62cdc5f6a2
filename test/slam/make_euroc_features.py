#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Features that a camera on EuRoC's V1_01 would have seen in a room of boxes: make_euroc_features.py DATA OUT [--seed N]

DATA has truth.csv, imu0.csv.xz and cam0_sensor.yaml. The truth is interpolated by SciPy's splines (position with its speed, rotation). Points lie on the walls of
a room of 8 x 8 x 4 m and on 20 boxes that stand away from the path and hide what is behind them. cam0 sees 40 of them at 10 Hz, without its distortion, with
1 px of noise and for 2 s at most; a twentieth of the sightings are another point's. Writes OUT.imu.csv (us, rad/s, m/s2), OUT.truth.csv (us, position, quaternion
w x y z, velocity, at each image, in level axes) and OUT.features.csv (image, identity, quarter pixels). OUT.recognised.csv
has the same of each point in 25 that is in sight: its identity lasts."""
import argparse
import lzma
import os
import re

import numpy as np
from scipy.interpolate import CubicHermiteSpline
from scipy.spatial.transform import Rotation, RotationSpline

WALLS, ON_BOXES, BOXES, FEATURES, MOST_SIGHTINGS, LASTING = 1500, 1000, 20, 40, 20, 25
PERIOD_US, SIGMA_PX, WRONG, NEAREST_M, CLEAR_M = 100_000, 1.0, 0.05, 0.3, 0.5
ROOM_M, ALONG_M = np.array([8.0, 8.0, 4.0]), 0.05


def on_surface(generator, low, high, count):
    """Points on the faces of an axis-parallel box, by their area."""
    size = high - low
    area = np.array([size[1] * size[2], size[2] * size[0], size[0] * size[1]])
    axis = generator.choice(3, size=count, p=area / area.sum())
    points = low + generator.uniform(size=(count, 3)) * size
    points[np.arange(count), axis] = np.where(generator.uniform(size=count) < 0.5, low[axis], high[axis])
    return points


def boxes_off(generator, path, low, high):
    """Boxes on the floor, farther than CLEAR_M from each place of the path."""
    found = []
    while len(found) < BOXES:
        size = generator.uniform([0.3, 0.3, 0.3], [0.8, 0.8, 1.6])
        corner = np.append(generator.uniform(low[:2], high[:2] - size[:2]), low[2])
        off = np.maximum(np.maximum(corner - path, path - corner - size), 0)
        if np.linalg.norm(off, axis=1).min() > CLEAR_M:
            found.append((corner, corner + size))
    return found


def hidden(eye, points, boxes):
    """Which points have a box before them."""
    way = points - eye
    way = np.where(np.abs(way) < 1e-12, 1e-12, way)
    result = np.zeros(len(points), bool)
    for low, high in boxes:
        one, two = (low - eye) / way, (high - eye) / way
        enters, leaves = np.minimum(one, two).max(1), np.maximum(one, two).min(1)
        result |= (enters < leaves) & (enters > 0) & (enters < 1 - ALONG_M / np.linalg.norm(way, axis=1))
    return result


def camera_of(path):
    """Intrinsics, image size, camera in body (rotation, place)."""
    with open(path, encoding="utf-8") as file:
        text = file.read()
    found = {name: [float(word) for word in values.split(",")] for name, values in re.findall(r"(\w+): \[([^]]*)\]", text)}
    mounting = np.reshape(found["data"], (4, 4))
    return found["intrinsics"], found["resolution"], mounting[:3, :3], mounting[:3, 3]


def quarters(pixel):
    return np.clip(np.rint(4 * pixel), 0, 8191).astype(int)


def level_of(truth, imu):
    """Turn from the truth's axes to level ones, by what the sensor shows over spans of 2 s, and gravity (m/s2). V1_01's truth is 4 mrad off."""
    pulls = []
    t_s, at_s = (truth[:, 0] - truth[0, 0]) * 1e-9, (imu[:, 0] - truth[0, 0]) * 1e-9
    for begin in range(100, len(truth) - 140, 40):
        rotation, gained = Rotation.from_quat(truth[begin, [5, 6, 7, 4]]), np.zeros(3)
        for i in range(*np.searchsorted(at_s, t_s[[begin, begin + 40]] - 1e-4)):
            step_s = at_s[i + 1] - at_s[i]
            rate, force = (imu[i:i + 2].mean(0)[1:] - truth[begin, 11:17]).reshape(2, 3)
            gained += (rotation * Rotation.from_rotvec(rate * step_s / 2)).apply(force) * step_s
            rotation *= Rotation.from_rotvec(rate * step_s)
        pulls.append((gained - truth[begin + 40, 8:11] + truth[begin, 8:11]) / (t_s[begin + 40] - t_s[begin]))
    pull = np.mean(pulls, axis=0)
    return Rotation.from_rotvec(np.cross(pull, [0, 0, 1]) / np.linalg.norm(pull)), np.linalg.norm(pull)  # small


def run(data, out, seed):
    generator = np.random.default_rng(seed)
    truth = np.loadtxt(os.path.join(data, "truth.csv"), delimiter=",")
    with lzma.open(os.path.join(data, "imu0.csv.xz")) as file:
        imu = np.loadtxt(file, delimiter=",")
    level, gravity = level_of(truth, imu)
    print(f"truth off the plumb line by {level.magnitude() * 1e3:.2f} mrad, gravity {gravity:.4f} m/s2")
    start_ns = truth[0, 0]
    t_us = (truth[:, 0] - start_ns) / 1e3
    place = CubicHermiteSpline(t_us, truth[:, 1:4], truth[:, 8:11] * 1e-6)
    turn = RotationSpline(t_us, Rotation.from_quat(truth[:, [5, 6, 7, 4]]))
    (fu, fv, cu, cv), (width, height), r_bc, p_bc = camera_of(os.path.join(data, "cam0_sensor.yaml"))

    middle = (truth[:, 1:4].min(0) + truth[:, 1:4].max(0)) / 2
    low = np.array([middle[0], middle[1], ROOM_M[2] / 2]) - ROOM_M / 2
    boxes = boxes_off(generator, truth[::10, 1:4], low, low + ROOM_M)
    points = np.vstack([on_surface(generator, low, low + ROOM_M, WALLS)] + [on_surface(generator, *box, ON_BOXES // BOXES) for box in boxes])

    stamps = np.arange(PERIOD_US, int(t_us[-1]) - PERIOD_US, PERIOD_US)
    tracks, next_id, rows, known = {}, 0, [], []  # point: [identity, sightings]
    for image, stamp in enumerate(stamps):
        r_nb, p_n = turn(stamp).as_matrix(), place(stamp)
        eye = p_n + r_nb @ p_bc
        seen = (points - eye) @ (r_nb @ r_bc)
        with np.errstate(divide="ignore", invalid="ignore"):
            pixel = np.column_stack([fu * seen[:, 0] / seen[:, 2] + cu, fv * seen[:, 1] / seen[:, 2] + cv])
        inside = np.flatnonzero((seen[:, 2] > NEAREST_M) & (pixel[:, 0] > 4) & (pixel[:, 0] < width - 4) & (pixel[:, 1] > 4) & (pixel[:, 1] < height - 4))
        inside = inside[~hidden(eye, points[inside], boxes)]
        tracks = {p: [i, n + 1] for p, (i, n) in tracks.items() if n < MOST_SIGHTINGS and p in set(inside)}
        for point in generator.permutation(inside):
            if len(tracks) >= FEATURES:
                break
            if point not in tracks:
                tracks[point] = [next_id % 4096, 1]
                next_id += 1
        for point, (identity, _) in tracks.items():
            shown = generator.choice(inside) if generator.uniform() < WRONG else point
            at = pixel[shown] + generator.normal(size=2) * SIGMA_PX
            rows.append((image, identity, *quarters(at)))
        for point in inside[inside % LASTING == 0]:
            shown = generator.choice(inside) if generator.uniform() < WRONG else point
            known.append((image, point, *quarters(pixel[shown] + generator.normal(size=2) * SIGMA_PX)))
    imu[:, 0] = (imu[:, 0] - start_ns) / 1e3
    np.savetxt(out + ".imu.csv", imu, "%.0f" + " %.9g" * 6)
    quaternions = (level * turn(stamps)).as_quat()[:, [3, 0, 1, 2]]
    path = np.column_stack([stamps, level.apply(place(stamps)), quaternions, level.apply(place(stamps, 1)) * 1e6])
    np.savetxt(out + ".truth.csv", path, "%.0f" + " %.9g" * 10)
    np.savetxt(out + ".features.csv", rows, "%d")
    np.savetxt(out + ".recognised.csv", known, "%d")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data")
    parser.add_argument("out")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    run(options.data, options.out, options.seed)


if __name__ == "__main__":
    main()
