# SPDX-License-Identifier: Apache-2.0
"""A log of the run that is turned by 90 deg counter-clockwise about the origin: east becomes north, north becomes west.

What the body measures stays. Fixes move to their turned places on WGS84, and a receiver's velocity and heading go with the axes of the place: the
meridian's convergence there is another one. Poses and landmarks given on the bus turn in the map.
The Earth is not the same in all directions: its rotation points north, so a robot that subtracts it (inertial.earth_rate) is judged without that,
in both runs. Its level surfaces are flatter to the north, by 0.5 mm at a kilometre and 5 m at 100 km: the law is meant for runs of some kilometres.
"""
import math
from typing import NamedTuple

import numpy as np

from tetap.dataset.inertial import east_north_up, from_enu, to_ecef

QUARTER_rad = math.pi / 2
PARTS = {"In_GnssLat": "Lat", "In_GnssLon": "Lon", "In_GnssAlt": "Height"}
LONGEST_us = 500_000  # between the frames of one fix: stamps repeat after a second
SAME_EARTH = {"inertial.earth_rate": "0"}
RANGE_m = 100_000  # of a map; a configured origin farther away is not that of the run


class Fix(NamedTuple):
    """Frames of one fix by field, and their places in the log."""
    key: tuple
    time_us: int
    frames: dict


class Place(NamedTuple):
    """Turned latitude, longitude [deg] and height [m], and by how much the place's own axes turned [rad]."""
    values: dict
    turn_rad: float


def turned_pose(pose):
    """Image of (x, y, yaw)."""
    return -pose[1], pose[0], pose[2] + QUARTER_rad


def turned_parameters(parameters):
    """Parameters of the turned run, by path as text."""
    out = {**parameters, **{path: value for path, value in SAME_EARTH.items() if path in parameters}}
    if "start.x_m" in out:
        out["start.x_m"], out["start.y_m"] = repr(-float(parameters["start.y_m"])), parameters["start.x_m"]
    for path, turn_rad in (("start.yaw_rad", QUARTER_rad), ("magnetic.declination_rad", -QUARTER_rad)):
        if path in out:
            out[path] = repr(math.remainder(float(out[path]) + turn_rad, 2 * math.pi))
    return out


class TurnedLog:
    """The turned log of `frames`; fields: faulty_log.Fields, name: identifier to message name."""

    def __init__(self, fields, name, frames, parameters):
        self.fields, self.name = fields, name
        fixes = self._fixes(frames)
        centre = self._centre(fixes, parameters)
        self.place_of = {}  # index of a frame to the place of its fix
        self.places = []    # (arrival, place)
        if centre:
            for fix in fixes:
                self._turn_fix(fix, centre)

    def frames(self, frames):
        """The turned frames, in their order."""
        out, last = [], None
        for i, frame in enumerate(frames):
            name = self.name.get(frame.identifier, "")
            last = self.place_of.get(i, last)
            out.append(frame._replace(payload=self._turned(name, frame.payload, self.place_of.get(i), last)))
        return out

    def _value(self, message, field, payload):
        """Physical value; None where it is not available."""
        signal = self.fields.dbc.messages[message].signals[field]
        raw = self.fields.get(payload, message, field)
        return None if raw == signal.not_available else raw * signal.scale + signal.offset

    def _put(self, message, field, payload, value):
        signal = self.fields.dbc.messages[message].signals[field]
        return self.fields.put(payload, message, field, round((value - signal.offset) / signal.scale))

    def _fixes(self, frames):
        """The fixes of the log: frames of one instance, sequence and stamp that came close together."""
        fixes, last = [], {}
        for i, frame in enumerate(frames):
            name = self.name.get(frame.identifier, "")
            if name not in PARTS:
                continue
            key = tuple(self.fields.get(frame.payload, name, field) for field in ("Inst", "Seq", "Stamp"))
            fix = last.get(key)
            if fix is None or abs(frame.time_us - fix.time_us) > LONGEST_us or PARTS[name] in fix.frames and fix.frames[PARTS[name]][1] != frame.payload:
                fix = last[key] = Fix(key, frame.time_us, {})
                fixes.append(fix)
            indices, _ = fix.frames.get(PARTS[name], ([], 0))
            fix.frames[PARTS[name]] = ([*indices, i], frame.payload)
        return fixes

    def _measured(self, fix):
        """(latitude, longitude, height) of a fix; None where no place is in it. A fix without a height lies at that of the ellipsoid."""
        values = {field: self._value(name, field, fix.frames[field][1]) for name, field in PARTS.items() if field in fix.frames}
        if values.get("Lat") is None or values.get("Lon") is None:
            return None
        return values["Lat"], values["Lon"], values.get("Height") or 0.0

    def _centre(self, fixes, parameters):
        """The configured origin, else the first fix."""
        first = next((place for fix in fixes if (place := self._measured(fix))), None)
        if first is None or not float(parameters.get("gnss.origin_configured", 0)):
            return first
        origin = tuple(float(parameters[f"gnss.origin_{key}"]) for key in ("latitude_deg", "longitude_deg", "height_m"))
        return origin if np.linalg.norm(to_ecef(*origin) - to_ecef(*first)) < RANGE_m else first

    def _turn_fix(self, fix, centre):
        measured = self._measured(fix)
        if measured is None:
            return
        axes = east_north_up(*centre[:2])
        east, north, up = axes @ (to_ecef(*measured) - to_ecef(*centre))
        lat, lon, height = (float(v[0]) for v in from_enu(np.array([[-north], [east], [up]]), centre))
        convergence = [math.atan2(e[1], e[0]) for e in ((axes @ east_north_up(*at).T)[:, 0] for at in (measured[:2], (lat, lon)))]
        place = Place({"Lat": lat, "Lon": lon, "Height": height}, QUARTER_rad + convergence[0] - convergence[1])
        for indices, _ in fix.frames.values():
            self.place_of.update((i, place) for i in indices)

    def _turned(self, name, payload, place, last):
        turn_rad = last.turn_rad if last else QUARTER_rad
        if name in PARTS:
            known = place is not None and self._value(name, PARTS[name], payload) is not None
            return self._put(name, PARTS[name], payload, place.values[PARTS[name]]) if known else payload
        if name == "In_GnssVelEN":
            east, north = (self._value(name, field, payload) for field in ("East", "North"))
            if east is None or north is None:
                return payload
            c, s = math.cos(turn_rad), math.sin(turn_rad)
            return self._put(name, "North", self._put(name, "East", payload, c * east - s * north), s * east + c * north)
        if name in ("In_Heading", "Cmd_SetYaw"):
            field, by_rad = ("Angle", turn_rad) if name == "In_Heading" else ("Yaw", QUARTER_rad)
            angle = self._value(name, field, payload)
            return payload if angle is None else self._put(name, field, payload, math.remainder(angle + by_rad, 2 * math.pi))
        if name in ("Cmd_SetPos", "In_MapEntry"):
            x, y = (self.fields.get(payload, name, field) for field in ("X", "Y"))
            return self.fields.put(self.fields.put(payload, name, "X", -y), name, "Y", x)
        return payload
