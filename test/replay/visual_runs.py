#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The robot `visual` as firmware on four drives of KITTI, in one process: visual_runs.py PROGRAMS OUT. The start pose is the truth's, what a camera's
front end saw comes as In_Feature and In_Image. An error is the mean over time of the root mean square of three axes, as the published figures are.
Bounds are two-sided: a result much better than its bound is as suspicious as a worse one. Needs $TETAP_DATA (default ../shared/data); without it
the status is 77. OUT/visual.json holds the figures."""
import os
import sys

import numpy as np
from scipy.spatial.transform import Rotation

sys.dont_write_bytecode = True
sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
from menu_runs import DATA, run, run_campaign  # noqa: E402

FOLDER = os.path.join(DATA, "kitti_klt")
DRIVES = {"0001": (97, 0.24), "0036": (238, 0.48), "0051": (113, 0.42), "0095": (138, 0.76)}  # last image, bar [m]
MEAN_M, ROTATION_RAD = 0.46, 0.010
NEES = (1.0, 6.7)  # of four: the two thirds of [1.5, 10] of six
SETTLED = 4  # the drives begin in motion, and the first speed is known with the second image
LEAST_SHARE = 0.4
ESTIMATOR = 1


def table(path, columns):
    """Rows of the window filter that hold all of these columns."""
    rows = np.genfromtxt(path, delimiter=",", names=True, usecols=("time_s", "estimator", *columns))
    rows = rows[rows["estimator"] == ESTIMATOR]
    return rows[np.all([np.isfinite(rows[name]) for name in columns], axis=0)]


def at_times(time_s, rows, columns):
    return np.column_stack([np.interp(time_s, rows["time_s"], rows[name]) for name in columns])


def judge(out, truth, last):
    """Errors [m] and [rad] at the images from 1 to `last`; mean NEES of (x, y, yaw, height) from the settled one on."""
    truth = truth[1:last + 1]
    plane = table(os.path.join(out, "estimates.csv"), ("x_m", "y_m", "yaw_rad"))
    plane["yaw_rad"] = np.unwrap(plane["yaw_rad"])
    sigmas = table(os.path.join(out, "estimates.csv"), ("std_x_m", "std_y_m", "std_yaw_rad", "corr_xy", "corr_x_yaw", "corr_y_yaw"))
    heights = table(os.path.join(out, "states.csv"), ("height_m", "std_height_m"))
    turns = table(os.path.join(out, "states.csv"), ("q_w", "q_x", "q_y", "q_z"))
    time_s = truth["time_s"]
    x_y_yaw, height = at_times(time_s, plane, ("x_m", "y_m", "yaw_rad")), at_times(time_s, heights, ("height_m", "std_height_m"))
    place = np.column_stack([truth["x_m"], truth["y_m"], truth["z_m"]])
    # An attitude between two rows is that of the nearer one, turned on by the yaw since then.
    nearest = np.abs(turns["time_s"][:, None] - time_s).argmin(axis=0)
    attitude = Rotation.from_quat(np.column_stack([turns[name][nearest] for name in ("q_x", "q_y", "q_z", "q_w")]))
    since = x_y_yaw[:, 2] - np.interp(turns["time_s"][nearest], plane["time_s"], plane["yaw_rad"])
    attitude = attitude * Rotation.from_rotvec(np.column_stack([0 * since, 0 * since, since]))
    true_attitude = Rotation.from_quat(np.column_stack([truth[name] for name in ("qx", "qy", "qz", "qw")]))
    rotation_rad = np.linalg.norm((true_attitude * attitude.inv()).as_rotvec(), axis=1) / 3 ** 0.5
    miss = np.column_stack([x_y_yaw[:, :2], height[:, :1]]) - place
    yaw = (x_y_yaw[:, 2] - truth["yaw_rad"] + np.pi) % (2 * np.pi) - np.pi
    error = np.column_stack([miss[:, :2], yaw])
    std = at_times(time_s, sigmas, ("std_x_m", "std_y_m", "std_yaw_rad"))
    corr = at_times(time_s, sigmas, ("corr_xy", "corr_x_yaw", "corr_y_yaw"))
    p = np.zeros((len(error), 3, 3))
    for i in range(3):
        p[:, i, i] = 1
    for k, (i, j) in enumerate(((0, 1), (0, 2), (1, 2))):
        p[:, i, j] = p[:, j, i] = corr[:, k]
    scaled = error / std
    nees = np.einsum("ki,kij,kj->k", scaled, np.linalg.inv(p), scaled) + (miss[:, 2] / height[:, 1]) ** 2
    return np.linalg.norm(miss, axis=1).mean() / 3 ** 0.5, rotation_rad.mean(), nees[SETTLED:].mean()


def drive(runs, name):
    """What a drive came to."""
    log = runs.imported(name, "import_kitti_klt", os.path.join(FOLDER, f"2011_09_26_drive_{name}_sync_KLT.mat"))
    out = runs.path(f"{name}_visual")
    run(os.path.join(runs.programs, "tetap-play"), runs.path(f"{log}.log"), "--memory", "--robot", "visual", "--params", runs.path(f"{log}.params"),
        "--out", out, "--quiet")
    return judge(out, np.genfromtxt(runs.path(f"{log}.truth.csv"), delimiter=",", names=True), DRIVES[name][0])


def campaign(runs, bounds, pool, whole):
    found = dict(zip(DRIVES, pool.map(lambda name: drive(runs, name), DRIVES)))
    for name, (position_m, rotation_rad, nees) in found.items():
        bounds.check(f"drive {name}: position, three axes [m]", position_m, LEAST_SHARE * DRIVES[name][1], DRIVES[name][1])
        bounds.check(f"drive {name}: rotation [rad]", rotation_rad, 0.0005, ROTATION_RAD)
        bounds.check(f"drive {name}: NEES (4 expected)", nees, *NEES)
    bounds.check("mean of the drives: position [m]", sum(one[0] for one in found.values()) / len(found), 0.3, MEAN_M)


if __name__ == "__main__":
    run_campaign(FOLDER, "visual.json", campaign)
