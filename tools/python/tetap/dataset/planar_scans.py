# SPDX-License-Identifier: Apache-2.0
"""Planar scans of a log (In_ScanHead, In_Scan), and where a node that maps by scans had their keyframes at the end of it."""
import numpy as np

from tetap.can.bus_writer import BadInput
from tetap.dataset import occupancy

STEP_M, MAX_M = 0.005, 40.95  # of In_Scan's ranges


def of_log(messages):
    """In_ScanHead and the ranges of each [m]: 0 where there was no echo, NaN where the frame is missing."""
    head, block = messages["In_ScanHead"], messages["In_Scan"]
    ranges = [np.full(count, np.nan) for count in head.Count.tolist()]
    begun = np.searchsorted(head.at, block.at) - 1
    for i, (of, at) in enumerate(zip(begun.tolist(), (4 * block.Block).tolist())):
        if of >= 0 and head.Seq[of] == block.Seq[i]:
            space = ranges[of][at:at + 4]
            space[:] = [block[f"Range{k}"][i] for k in range(len(space))]
    return head, ranges


def keyframes(messages, path):
    """(pose, first bearing, step, ranges) of each keyframe that the node held at the end, and how many others there were."""
    head, ranges = of_log(messages)
    keyframe, pose, match = messages["Est_Keyframe"], messages["Est_KeyframePose"], messages["Est_ScanMatch"]
    mine = np.flatnonzero(head.Inst == 0)
    stamps = {}
    for number, at, stamp in zip(keyframe.Id.tolist(), keyframe.at.tolist(), keyframe.Stamp.tolist()):
        matched = np.searchsorted(match.at, at) - 1  # the scan that became it; its stamp is within the scan, not always at its first beam
        same = head.Seq[mine] == match.Seq[matched] if matched >= 0 else head.Stamp[mine] == stamp
        before = mine[(head.at[mine] < at) & same]
        if len(before):
            stamps[number] = before[-1]  # stamps and Seq come again: the newest counts
    last = {}
    for number, x, y, yaw in zip(pose.Id[::-1].tolist(), pose.X[::-1], pose.Y[::-1], pose.Yaw[::-1]):  # one round, backwards
        if number in last:
            break
        last[number] = float(x), float(y), float(yaw)
    drawn = [(last[k], head.First[stamps[k]], head.Step[stamps[k]], ranges[stamps[k]]) for k in sorted(last) if k in stamps]
    if not drawn:
        raise BadInput(f"{path}: no keyframe with its scan; expected the log of a node that maps by scans")
    return drawn, len(stamps) - len(drawn)


def seen(drawn, mounting, least, most):
    """Poses of the scanner and the points it saw. `mounting`: the scanner on the robot as x, y, yaw (m, m, rad)."""
    for pose, first, step, ranges in drawn:
        bearing = first + step * np.arange(len(ranges))
        good = (ranges >= max(least, STEP_M)) & (ranges <= most)
        yield occupancy.placed(mounting, pose), np.column_stack([np.cos(bearing), np.sin(bearing)])[good] * ranges[good, None]
