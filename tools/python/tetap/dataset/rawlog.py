# SPDX-License-Identifier: Apache-2.0
"""Planar scans and odometry of an MRPT rawlog whose entries are pairs of actions and observations.

Layout: a gzip stream of objects. An object is 0x80 + the length of its class' name, the name, a byte of version, its fields, 0x88; what it
contains comes in the same form. Only what a planar scan and a planar odometry have is read. Source: MRPT 2.5.8, the functions serializeFrom of
CObservation2DRangeScan (version 6), CActionRobotMovement2D (6), CPose3D (2) and CPose2D (1)."""
import gzip
import math
import struct
import zlib

from tetap.can.bus_writer import BadInput

SCAN, ODOMETRY = b"\x97CObservation2DRangeScan", b"\x96CActionRobotMovement2D"
MAGIC = b"\x1f\x8b"
SINCE_1601_US = 11_644_473_600_000_000


def unpacked(path, data):
    try:
        return gzip.decompress(data)
    except (OSError, EOFError, zlib.error) as error:
        raise BadInput(f"{path}: not unpacked by gzip: {error}") from None


class _Reader:
    def __init__(self, path, data, at):
        self.path, self.data, self.at = path, data, at

    def take(self, form):
        try:
            values = struct.unpack_from("<" + form, self.data, self.at)
        except struct.error:
            raise BadInput(f"{self.path}: byte {self.at} of the unpacked log: it ends within an object") from None
        self.at += struct.calcsize("<" + form)
        return values

    def expect(self, name, version):
        head = bytes([0x80 + len(name)]) + name
        found = self.data[self.at:self.at + len(head) + 1]
        if found != head + bytes([version]):
            raise BadInput(f"{self.path}: byte {self.at} of the unpacked log: no {name.decode()} of version {version}")
        self.at += len(head) + 1


def _scan(reader):
    """Time (us since 1970), (first bearing, step, ranges) counter-clockwise, and (x, y, yaw) of the scanner on the robot."""
    reader.expect(SCAN[1:], 6)
    aperture, counter_clockwise, most_m = reader.take("f?f")
    reader.expect(b"CPose3D", 2)
    x, y, _, w, _, _, z = reader.take("7d")
    reader.take("B")
    beams, = reader.take("I")
    ranges, valid = reader.take(f"{beams}f"), reader.take(f"{beams}B")
    if beams < 3:
        raise BadInput(f"{reader.path}: byte {reader.at} of the unpacked log: a scan of {beams} beams")
    _, stamp = reader.take("fQ")  # 0.1 us since 1601
    turn = 1 if counter_clockwise else -1
    return (stamp // 10 - SINCE_1601_US, (-turn * aperture / 2, turn * aperture / (beams - 1), [r if v and r < most_m else 0.0 for r, v in zip(ranges, valid)]),
            (x, y, 2 * math.atan2(z, w)))


def entries(path, data):
    """For each scan: (time in us, (first bearing, step, ranges), mounting (x, y, yaw), pose by odometry (x, y, yaw))."""
    pose, at = (0.0, 0.0, 0.0), 0
    while True:
        scan, odometry = data.find(SCAN, at), data.find(ODOMETRY, at)
        if scan < 0:
            return
        if 0 <= odometry < scan:
            reader = _Reader(path, data, odometry)
            reader.expect(ODOMETRY[1:], 6)
            if reader.take("I") != (0,):
                raise BadInput(f"{path}: byte {odometry} of the unpacked log: a motion that is not odometry")
            reader.expect(b"CPose2D", 1)
            (dx, dy, turn), (x, y, yaw) = reader.take("3d"), pose
            pose = x + math.cos(yaw) * dx - math.sin(yaw) * dy, y + math.sin(yaw) * dx + math.cos(yaw) * dy, yaw + turn
            at = reader.at
            continue
        reader = _Reader(path, data, scan)
        yield (*_scan(reader), pose)
        at = reader.at
