# SPDX-License-Identifier: Apache-2.0
"""Raw GNSS fixes of a run's raw.log, in the plane of its map."""
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


def raw_fixes(directory):
    """(x, y) in metres east and north of the map's origin; None without raw.log, fixes or origin."""
    path = os.path.join(directory, "raw.log")
    if not os.path.exists(path):
        return None
    messages = bus_writer.Dbc().messages
    latitude, longitude, origin = (messages[name] for name in ("In_GnssLat", "In_GnssLon", "Est_Origin"))
    wanted = {f" {one.identifier:03X}#": one for one in (latitude, longitude, origin)}
    where, pairs, waits = {}, [], {}
    with open(path, encoding="ascii", errors="replace") as file:
        for line in file:
            at = line.find("#")
            message = wanted.get(line[at - 4:at + 1])
            if message is None or len(line.rstrip()) != at + 17:
                continue
            payload = bytes.fromhex(line[at + 1:at + 17])
            of = {name: signal for name, signal in message.signals.items()}
            if message is origin:
                page = int(_value(payload, of["Sel"]))
                if page in (0, 1) and _value(payload, of["Source"]) > 0:
                    where[page] = _value(payload, of["Lat" if page == 0 else "Lon"])
            elif message is latitude:
                waits[int(_value(payload, of["Seq"]))] = _value(payload, of["Lat"])
            else:
                north = waits.pop(int(_value(payload, of["Seq"])), None)
                if north is not None:
                    pairs.append((north, _value(payload, of["Lon"])))
    if len(where) < 2 or not pairs:
        return None
    fixes = np.array(pairs) - [where[0], where[1]]
    north_m, east_m = metres_per_degree(where[0])
    return fixes[:, 1] * east_m, fixes[:, 0] * north_m
