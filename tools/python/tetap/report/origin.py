# SPDX-License-Identifier: Apache-2.0
"""A truth in the map of one origin, turned into the map of the origin that the node published (Est_Origin). Both are tangent planes of WGS84."""
import os

import numpy as np

from tetap.can.bus_writer import BadInput
from tetap.dataset.inertial import east_north_up, to_ecef
from tetap.report import fixes

KEYS = ("lat_deg", "lon_deg", "height_m")


def stated(about, path):
    """(latitude, longitude, height) of "truth_origin" in the JSON beside a truth; None where it has none."""
    given = about.get("truth_origin")
    if given is None:
        return None
    try:
        place = tuple(float(given[key]) for key in KEYS)
    except (TypeError, KeyError, ValueError):
        raise BadInput(f"{path}: truth_origin is not {{{', '.join(KEYS)}}} in numbers") from None
    if not (abs(place[0]) <= 90 and abs(place[1]) <= 360 and np.isfinite(place[2])):
        raise BadInput(f"{path}: truth_origin is no place: {place}")
    return place


def turned(x_m, y_m, yaw_rad, of, to):
    """Poses of the plane at origin `of` in the plane at origin `to`; NaN stays NaN."""
    turn = east_north_up(*to[:2]) @ east_north_up(*of[:2]).T
    shift = east_north_up(*to[:2]) @ (to_ecef(*of) - to_ecef(*to))
    east, north, _ = shift[:, None] + turn @ np.stack([x_m, y_m, np.zeros(len(x_m))])
    ahead = turn @ np.stack([np.cos(yaw_rad), np.sin(yaw_rad), np.zeros(len(x_m))])
    return east, north, np.arctan2(ahead[1], ahead[0])


def to_map(truth, directory):
    """The truth in the node's map, and a sentence about it. A truth without "truth_origin" stays as it is."""
    of = stated(truth.about, truth.path)
    if of is None:
        return truth, ""
    path = os.path.join(directory, "raw.log")
    to = fixes.published_origin(path) if os.path.exists(path) else None
    if to is None:
        raise BadInput(f"{truth.path}: its truth_origin asks for the node's Est_Origin, which {path} does not have")
    shift_m = float(np.linalg.norm(to_ecef(*of) - to_ecef(*to)))
    return truth.with_poses(*turned(truth.x_m, truth.y_m, truth.yaw_rad, of, to)), f"the truth was turned into the map of Est_Origin, {shift_m:.2f} m from its own origin"
