#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""MRPT's kf-slam_6D_demo as motion and pixels: kf_slam_demo.py RAWLOG LANDMARKS PATH OUT.

The log has 600 steps of odometry and of range, bearing and elevation to points of a room; both truths are in files beside it. Range is left out: the
two angles become the pixel of an ideal camera that looks along x. Layout: MRPT 2.5.8, serializeTo of CPose3DPDFGaussian (version 1), CPose3D (2) and
CObservationBearingRange (3). OUT: q_nb w x y z, position; landmarks {id x y z}; steps {speed, rate in the middle attitude, true position, {id u v}}."""
import gzip
import struct
import sys

import numpy as np
from scipy.spatial.transform import Rotation

FOCAL_px, CENTRE_px = 400.0, 1000.0
POSE, SEEN = b"CPose3DPDFGaussian\x01", b"CObservationBearingRange\x03"
POINT = b"CPose3D\x02"


def entries(data):
    """('motion', pose) and ('seen', [(range, yaw, pitch, id)]) in the log's order."""
    at = 0
    while True:
        motion, seen = data.find(POSE, at), data.find(SEEN, at)
        if motion < 0 and seen < 0:
            return
        if motion >= 0 and (seen < 0 or motion < seen):
            at = data.index(POINT, motion) + len(POINT)
            yield "motion", np.frombuffer(data, "<f8", 7, at)  # x y z, w x y z
        else:
            at = data.index(POINT, seen) + len(POINT) + 7 * 8 + 1 + 8 + 1 + 3 * 4  # pose, end, time, flag, three sigmas
            count, = struct.unpack_from("<I", data, at)
            yield "seen", [struct.unpack_from("<3fi", data, at + 4 + 16 * i) for i in range(count)]


def main(log, landmarks, path, out):
    with gzip.open(log) as file:
        found = list(entries(file.read()))
    motions = [value for kind, value in found if kind == "motion"]
    sightings = [value for kind, value in found if kind == "seen"]
    truth, points = np.loadtxt(path, comments="%"), np.loadtxt(landmarks)
    if not len(truth) == len(sightings) == len(motions):
        sys.exit(f"{log}: {len(sightings)} sightings and {len(motions)} motions, {path} has {len(truth)} poses")
    x, y, z, w = Rotation.from_euler("ZYX", truth[0, 3:]).as_quat()
    with open(out, "w", encoding="ascii") as file:
        print(w, x, y, z, *truth[0, :3], file=file)
        print(len(points), len(sightings), file=file)
        for point in points:
            print(int(point[-1]), *point[:3], file=file)
        for step, seen in enumerate(sightings):
            pose = motions[step - 1] if step else np.array([0, 0, 0, 1.0, 0, 0, 0])
            turn = Rotation.from_quat([*pose[4:], pose[3]]).as_rotvec()
            print(*Rotation.from_rotvec(turn / 2).inv().apply(pose[:3]), *turn, *truth[step, :3], len(seen), file=file)
            for _, yaw, pitch, name in seen:
                right, down = -FOCAL_px * np.tan(yaw), FOCAL_px * np.tan(pitch) / np.cos(yaw)
                print(name, round(4 * (right + CENTRE_px)), round(4 * (down + CENTRE_px)), file=file)


if __name__ == "__main__":
    main(*sys.argv[1:])
