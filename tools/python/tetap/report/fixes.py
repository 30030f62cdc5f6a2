# SPDX-License-Identifier: Apache-2.0
"""Raw GNSS fixes of a run, in the plane of its map."""
import os

import numpy as np

from tetap.can import bus_writer

FIRST_ID = 0x300
EQUATOR_M, SQUARED_ECCENTRICITY = 6378137.0, 6.69437999014e-3  # WGS84


def _value(payload, signal):
    raw = int.from_bytes(payload, "little") >> signal.start & (1 << signal.length) - 1
    return (raw - (1 << signal.length) if signal.signed and raw >> signal.length - 1 else raw) * signal.scale + signal.offset


def metres_per_degree(latitude_deg):
    """(north, east) on the ellipsoid: meridian and normal radii of curvature."""
    sine = np.sin(np.radians(latitude_deg))
    w = 1 - SQUARED_ECCENTRICITY * sine ** 2
    return np.radians(EQUATOR_M * (1 - SQUARED_ECCENTRICITY) / w ** 1.5), np.radians(EQUATOR_M / np.sqrt(w) * np.cos(np.radians(latitude_deg)))


def _frames(path, wanted):
    """(message, payload) of each frame of these messages, by the end of their identifiers."""
    ends = {f" {one.identifier:03X}#": one for one in wanted}
    with open(path, encoding="ascii", errors="replace") as file:
        for line in file:
            at = line.find("#")
            message = ends.get(line[at - 4:at + 1])
            if message is not None and len(line.rstrip()) >= at + 17:
                try:
                    yield message, bytes.fromhex(line[at + 1:at + 17])
                except ValueError:
                    continue


def published_origin(path):
    """(latitude, longitude, height) of the map's origin, as published last in that log; None without one. A height that is not available is 0."""
    message, where = bus_writer.Dbc().messages["Est_Origin"], {}
    for _, payload in _frames(path, [message]):
        page = int(_value(payload, message.signals["Sel"]))
        if page in (0, 1, 2) and _value(payload, message.signals["Source"]) > 0:
            where[page] = _value(payload, message.signals[("Lat", "Lon", "Height")[page]])
    if 0 not in where or 1 not in where:
        return None
    height_m = where.get(2, 0.0)
    return where[0], where[1], height_m if abs(height_m) < 16777.2 else 0.0


def raw_fixes(directory):
    """(x, y) in metres east and north of the map's origin, as the node published it last; None without raw.log, fixes or origin."""
    path = os.path.join(directory, "raw.log")
    if not os.path.exists(path):
        return None
    messages = bus_writer.Dbc().messages
    latitude, longitude = messages["In_GnssLat"], messages["In_GnssLon"]
    origin = published_origin(path)
    if origin is None:
        return None
    pairs, waits = [], {}
    for message, payload in _frames(path, [latitude, longitude]):
        key = int(_value(payload, message.signals["Inst"])), int(_value(payload, message.signals["Seq"]))
        if message is latitude:
            waits[key] = _value(payload, message.signals["Lat"])
        elif key in waits:
            pairs.append((waits.pop(key), _value(payload, message.signals["Lon"])))
    if not pairs:
        return None
    fixes = np.array(pairs) - np.array(origin[:2])
    north_m, east_m = metres_per_degree(origin[0])
    return fixes[:, 1] * east_m, fixes[:, 0] * north_m
