#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""tetap-doctor names mistakes and finds none in good logs: the mistakes are made here, in the frames of good logs, by the signals of
config/tetap.dbc. Good logs: the simulated world, and the recorded sets below $TETAP_DATA (each one is left out where it is missing).

The short form has a sample of logs and mistakes; form=whole has each mistake in three logs or more, and every good log.
SEEDS=101-148 looks at the whole course of five robots at each of these seeds (240 logs, 150 s of CPU); form=whole takes the first of them."""
import json
import os
import re
import subprocess
import sys
import tempfile
import unittest

import numpy as np

sys.dont_write_bytecode = True
ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))
sys.path.insert(0, os.path.join(ROOT, "tools", "python"))
from tetap.can import bus_writer  # noqa: E402

import doctor_camera_test  # noqa: E402

PROGRAMS = os.environ.get("TETAP_PROGRAMS", os.path.join(ROOT, "build/host/sim_host"))
DATA = os.environ.get("TETAP_DATA") or os.path.join(ROOT, "..", "shared", "data")
WHOLE = os.environ.get("form") == "whole" or "--whole" in sys.argv
DBC = bus_writer.Dbc()
MASK = (1 << 20) - 1
SCANS = [DBC.messages[name].identifier for name in ("In_ScanHead", "In_Scan")]
GYRO, ACCEL, TIME = "In_Imu0Gyro", "In_Imu0Accel", "In_Imu0Time"
ANGLES, VELOCITIES = ("AngX", "AngY", "AngZ"), ("VelX", "VelY", "VelZ")
HUSKY_TRACK_M = 0.545
NAMED_SHARE = 0.9  # of all mistakes, first or second
SEEDED = ("rover", "car", "iris", "husky_inertial", "scanner")  # robots whose good logs are drawn by seeds, of the default course


# ---- frames
class Frames:
    """Input and sync frames of a candump log, and those of scans, in numpy: time [us], identifier, payload."""

    def __init__(self, time_us, identifier, payload):
        self.time_us, self.identifier, self.payload = time_us, identifier, payload

    @classmethod
    def read(cls, path):
        with open(path, encoding="ascii") as file:
            lines = [line for line in file.read().split("\n") if line]
        identifier = np.array([int(line.split(" ", 3)[2][:3], 16) for line in lines])
        keep = np.flatnonzero(((identifier >= 0x300) & (identifier < 0x320)) | np.isin(identifier, SCANS))
        time_us = np.array([int(line[1:11]) * 1_000_000 + int(line[12:18]) for line in lines], dtype=np.int64)
        payload = np.array([int.from_bytes(bytes.fromhex(line.split("#", 1)[1]).ljust(8, b"\0"), "little") for line in lines], dtype=np.uint64)
        return cls(time_us[keep], identifier[keep], payload[keep])

    def copy(self):
        return Frames(self.time_us.copy(), self.identifier.copy(), self.payload.copy())

    def where(self, name):
        return np.flatnonzero(self.identifier == DBC.messages[name].identifier)

    def has(self, name):
        return len(self.where(name)) > 0

    def get(self, name, signal):
        s = DBC.messages[name].signals[signal]
        raw = ((self.payload[self.where(name)] >> np.uint64(s.start)) & np.uint64((1 << s.length) - 1)).astype(np.int64)
        raw = np.where(raw >= 1 << (s.length - 1), raw - (1 << s.length), raw) if s.signed else raw
        return np.where(raw == s.not_available, np.nan, raw * s.scale) if s.not_available is not None else raw * s.scale

    def set(self, name, **values):
        """Limited to what the signal can say, as a sender with saturation would."""
        rows = self.where(name)
        for signal, value in values.items():
            s = DBC.messages[name].signals[signal]
            bits, _ = s.pack(np.clip(np.asarray(value, dtype=float), s.raw_min * s.scale, s.raw_max * s.scale), signal)
            hole = np.uint64(((1 << s.length) - 1) << s.start)
            self.payload[rows] = (self.payload[rows] & ~hole) | bits

    def without(self, *names):
        gone = np.isin(self.identifier, [DBC.messages[name].identifier for name in names])
        return Frames(self.time_us[~gone], self.identifier[~gone], self.payload[~gone])

    def bus_us(self):
        """Time of the bus at each frame: the last In_Sync, or the log's own time."""
        sync = self.identifier == DBC.messages["In_Sync"].identifier
        if not sync.any():
            return self.time_us.copy()
        at = np.flatnonzero(sync)
        times = (self.payload[at] & np.uint64((1 << 48) - 1)).astype(np.int64)
        return times[np.maximum(np.searchsorted(at, np.arange(len(sync)), side="right") - 1, 0)]

    def valid_us(self, name):
        """Full times of the stamps of a message."""
        reference = self.bus_us()[self.where(name)]
        stamp = np.rint(self.get(name, "Stamp")).astype(np.int64)
        return reference + ((stamp - reference + (1 << 19)) & MASK) - (1 << 19)

    def stamped(self):
        return [name for name, message in DBC.messages.items() if "Stamp" in message.signals and self.has(name)]

    def write(self, path):
        order = np.argsort(self.time_us, kind="stable")
        with open(path, "w", encoding="ascii") as file:
            for t, i, p in zip(self.time_us[order].tolist(), self.identifier[order].tolist(), self.payload[order].tolist()):
                file.write(f"({t // 1_000_000:010d}.{t % 1_000_000:06d}) vcan0 {i:03X}#{p.to_bytes(8, 'little').hex().upper()}\n")


# ---- mistakes, each a function of Frames
def vectors(frames, name, signals):
    return np.stack([frames.get(name, one) for one in signals], axis=1)


def turn_imu(frames, matrix):
    for name, signals in ((GYRO, ANGLES), (ACCEL, VELOCITIES)):
        turned = vectors(frames, name, signals) @ np.asarray(matrix, dtype=float).T
        frames.set(name, **dict(zip(signals, turned.T)))
    return frames


def part(frames, begin_s, end_s):
    """A log that begins and ends within the drive."""
    at_s = (frames.bus_us() - frames.bus_us()[0]) / 1e6
    kept = np.flatnonzero((at_s >= begin_s) & (at_s < end_s))
    return Frames(frames.time_us[kept], frames.identifier[kept], frames.payload[kept])


def about(axis, angle_deg):
    """The sensor's axes turned about one of them: 2 is up on most robots, 1 on the Husky."""
    c, s, i, j = np.cos(np.radians(angle_deg)), np.sin(np.radians(angle_deg)), (axis + 1) % 3, (axis + 2) % 3
    matrix = np.eye(3)
    matrix[i, i], matrix[i, j], matrix[j, i], matrix[j, j] = c, s, -s, c
    return matrix


def scale_imu(frames, gyro, accel):
    for name, signals, factor in ((GYRO, ANGLES, gyro), (ACCEL, VELOCITIES, accel)):
        frames.set(name, **{one: frames.get(name, one) * factor for one in signals})
    return frames


def swap_wheels(frames):
    if frames.has("In_WheelCounts"):
        frames.set("In_WheelCounts", Left=frames.get("In_WheelCounts", "Right"), Right=frames.get("In_WheelCounts", "Left"))
    if frames.has("In_BodySpeed"):
        frames.set("In_BodySpeed", YawRate=-frames.get("In_BodySpeed", "YawRate"))
    return frames


def reverse_wheel(frames, side):
    if frames.has("In_WheelCounts"):
        frames.set("In_WheelCounts", **{side: np.mod(-frames.get("In_WheelCounts", side), 65536)})
    if frames.has("In_BodySpeed"):
        forward, yaw_rate = frames.get("In_BodySpeed", "Forward"), frames.get("In_BodySpeed", "YawRate")
        left, right = forward - yaw_rate * HUSKY_TRACK_M / 2, forward + yaw_rate * HUSKY_TRACK_M / 2
        left, right = (-left, right) if side == "Left" else (left, -right)
        frames.set("In_BodySpeed", Forward=(left + right) / 2, YawRate=(right - left) / HUSKY_TRACK_M)
    return frames


def counts_of(frames, side):
    """First count, and the change from each to the next."""
    counts = frames.get("In_WheelCounts", side)
    return counts[0], np.mod(np.diff(counts) + 32768, 65536) - 32768


def set_counts(frames, side, first, steps):
    frames.set("In_WheelCounts", **{side: np.mod(np.rint(first + np.concatenate([[0], np.cumsum(steps)])), 65536)})


def scale_wheel(frames, side, factor):
    if frames.has("In_WheelCounts"):
        first, steps = counts_of(frames, side)
        set_counts(frames, side, first, factor * steps)
    if frames.has("In_BodySpeed"):
        forward, yaw_rate = frames.get("In_BodySpeed", "Forward"), frames.get("In_BodySpeed", "YawRate")
        left, right = forward - yaw_rate * HUSKY_TRACK_M / 2, forward + yaw_rate * HUSKY_TRACK_M / 2
        left, right = (left * factor, right) if side == "Left" else (left, right * factor)
        frames.set("In_BodySpeed", Forward=(left + right) / 2, YawRate=(right - left) / HUSKY_TRACK_M)
    return frames


def scale_turn(frames, factor):
    """The turn by the wheels, as of another track: their mean stays."""
    if frames.has("In_WheelCounts"):
        (left, left_steps), (right, right_steps) = counts_of(frames, "Left"), counts_of(frames, "Right")
        mean, half = (left_steps + right_steps) / 2, factor * (right_steps - left_steps) / 2
        set_counts(frames, "Left", left, mean - half)
        set_counts(frames, "Right", right, mean + half)
    if frames.has("In_BodySpeed"):
        frames.set("In_BodySpeed", YawRate=frames.get("In_BodySpeed", "YawRate") * factor)
    return frames


def scale_wheels(frames, factor):
    if frames.has("In_WheelCounts"):
        for side in ("Left", "Right"):
            first, steps = counts_of(frames, side)
            set_counts(frames, side, first, factor * steps)
    if frames.has("In_BodySpeed"):
        frames.set("In_BodySpeed", Forward=frames.get("In_BodySpeed", "Forward") * factor, YawRate=frames.get("In_BodySpeed", "YawRate") * factor)
    return frames


def rates(frames):
    interval_s = frames.get(TIME, "Interval") * 1e-6
    count = min(len(frames.where(one)) for one in (GYRO, ACCEL, TIME))
    for name, signals in ((GYRO, ANGLES), (ACCEL, VELOCITIES)):
        span = np.resize(interval_s[:count], len(frames.where(name)))
        frames.set(name, **{one: frames.get(name, one) / span for one in signals})
    return frames


def stamps(frames, per_us, names=None, interval=True):
    for name in names or frames.stamped():
        frames.set(name, Stamp=(frames.valid_us(name) // per_us) & MASK)
        if interval and name == TIME:
            frames.set(name, Interval=frames.get(name, "Interval") // per_us)
    return frames


def other_clock(frames, names, offset_s, ppm):
    for name in names:
        valid = frames.valid_us(name)
        moved = valid + np.rint(offset_s * 1e6 + ppm * 1e-6 * (valid - valid[0])).astype(np.int64)
        frames.set(name, Stamp=moved & MASK)
    return frames


def no_sync(frames, offset_s):
    frames.time_us = frames.bus_us() + round(offset_s * 1e6)
    return frames.without("In_Sync")


def swap_angles(frames):
    lat, lon = frames.get("In_GnssLat", "Lat"), frames.get("In_GnssLon", "Lon")
    count = min(len(lat), len(lon))
    lat[:count], lon[:count] = lon[:count].copy(), lat[:count].copy()
    frames.set("In_GnssLat", Lat=lat)
    frames.set("In_GnssLon", Lon=lon)
    return frames


def map_signal(name, signal, function):
    def apply(frames):
        frames.set(name, **{signal: function(frames.get(name, signal))})
        return frames
    return apply


def reverse_wheels(frames):
    if frames.has("In_WheelCounts"):
        frames = reverse_wheel(reverse_wheel(frames, "Left"), "Right")
    if frames.has("In_BodySpeed"):
        frames.set("In_BodySpeed", Forward=-frames.get("In_BodySpeed", "Forward"), YawRate=-frames.get("In_BodySpeed", "YawRate"))
    return frames


def scale_velocity(factor):
    def apply(frames):
        frames.set("In_GnssVelEN", **{axis: factor * frames.get("In_GnssVelEN", axis) for axis in ("East", "North")})
        frames.set("In_GnssVelU", Up=factor * frames.get("In_GnssVelU", "Up"))
        return frames
    return apply


def write_places(function):
    """Degrees written in another way: a function of their part behind the point."""
    def apply(frames):
        for name, signal in (("In_GnssLat", "Lat"), ("In_GnssLon", "Lon")):
            value = frames.get(name, signal)
            frames.set(name, **{signal: np.trunc(value) + function(value - np.trunc(value))})
        return frames
    return apply


def decimals_as_minutes(part):
    return part * 100 / 60


def minutes_as_decimals(part):
    return part * 60 / 100


def late(seconds):
    """The receiver's samples come that much later, with stamps of then."""
    def apply(frames):
        for name in RECEIVER:
            if frames.has(name):
                frames.set(name, Stamp=(frames.valid_us(name) + round(seconds * 1e6)) & MASK)
        of_receiver = np.isin(frames.identifier, [DBC.messages[name].identifier for name in RECEIVER])
        bus_us = frames.bus_us()
        at = bus_us + np.where(of_receiver, round(seconds * 1e6), 0)
        order = np.argsort(at, kind="stable")
        order = order[at[order] <= bus_us[-1]]
        return Frames(at[order], frames.identifier[order], frames.payload[order])
    return apply


def mirror_scans(frames):
    frames.set("In_ScanHead", First=-frames.get("In_ScanHead", "First"), Step=-frames.get("In_ScanHead", "Step"))
    return frames


def turn_scans(angle_deg):
    """Beams count from another place, as on a mount that is turned."""
    return map_signal("In_ScanHead", "First", lambda first: np.remainder(first + np.radians(angle_deg) + np.pi, 2 * np.pi) - np.pi)


def late_scans(frames):
    frames.set("In_ScanHead", Stamp=(frames.valid_us("In_ScanHead") + 100_000) & MASK)
    return frames


def swap_velocity(frames):
    frames.set("In_GnssVelEN", East=frames.get("In_GnssVelEN", "North"), North=frames.get("In_GnssVelEN", "East"))
    return frames


def second_sender(frames, names, later_us, counter, **values):
    """A second source of the same identifiers: a copy, later, with its own counter and values."""
    rows = np.flatnonzero(np.isin(frames.identifier, [DBC.messages[name].identifier for name in names]))
    other = Frames(frames.time_us[rows] + later_us, frames.identifier[rows].copy(), frames.payload[rows].copy())
    for name in names:
        other.set(name, Seq=np.mod(other.get(name, "Seq") + counter, 16))
        here = {key: value for key, value in values.items() if key in DBC.messages[name].signals}
        other.set(name, **here)
    # In the frames' own order: a sync frame that was sent later in the log stays behind.
    order = np.argsort(np.concatenate([np.arange(len(frames.time_us)), rows + 0.5]), kind="stable")
    both = [np.concatenate([a, b])[order] for a, b in zip((frames.time_us, frames.identifier, frames.payload), (other.time_us, other.identifier, other.payload))]
    both[0] = np.maximum.accumulate(both[0])
    return Frames(*both)


def reverse_axis(message, signal):
    return map_signal(message, signal, np.negative)


def stop_axis(message, signal, value=0):
    """An axis that reads one value, as a register that nobody fills."""
    return map_signal(message, signal, lambda x: x * 0 + value)


def scale_gyro(factor):
    return lambda f: scale_imu(f, factor, 1)


def scale_accel(factor):
    return lambda f: scale_imu(f, 1, factor)


ABOUT_X, ABOUT_Z, Y_FOR_Z = np.diag([1, -1, -1]), [[0, -1, 0], [1, 0, 0], [0, 0, 1]], [[1, 0, 0], [0, 0, 1], [0, -1, 0]]
RECEIVER = ["In_GnssLat", "In_GnssLon", "In_GnssAlt", "In_GnssAcc", "In_GnssVelEN", "In_GnssVelU"]
FIX = ["In_GnssLat", "In_GnssLon", "In_GnssAlt", "In_GnssAcc"]
DEGREE = 180 / np.pi
IMU_FRAMES = [GYRO, ACCEL, TIME]

# (code, log, mistake, further arguments): those with a star make the short form.
MISTAKES = [
    ("wheels_swapped", "*yard", swap_wheels), ("wheels_swapped", "road", swap_wheels), ("wheels_swapped", "*husky", swap_wheels),
    ("wheels_swapped", "husky_sim", swap_wheels),
    ("wheel_reversed", "*yard", lambda f: reverse_wheel(f, "Left")), ("wheel_reversed", "road", lambda f: reverse_wheel(f, "Right")),
    ("wheel_reversed", "husky", lambda f: reverse_wheel(f, "Left")), ("wheel_reversed", "husky_sim", lambda f: reverse_wheel(f, "Right")),
    ("imu_upside_down", "*yard", lambda f: turn_imu(f, ABOUT_X)), ("imu_upside_down", "skog", lambda f: turn_imu(f, ABOUT_X)),
    ("imu_upside_down", "*iris_gps", lambda f: turn_imu(f, ABOUT_X)), ("imu_upside_down", "husky", lambda f: turn_imu(f, np.diag([-1, -1, 1]))),
    ("imu_axes", "*yard", lambda f: turn_imu(f, ABOUT_Z)), ("imu_axes", "skog", lambda f: turn_imu(f, np.transpose(ABOUT_Z))),
    ("imu_axes", "skog", lambda f: turn_imu(f, np.diag([-1, -1, 1]))), ("imu_axes", "*husky", lambda f: turn_imu(f, Y_FOR_Z)),
    ("imu_axes", "iris", lambda f: turn_imu(f, Y_FOR_Z)), ("imu_axes", "car", lambda f: turn_imu(f, ABOUT_Z)),
    ("imu_axes", "road", lambda f: turn_imu(f, np.diag([-1, -1, 1]))),
    ("imu_axes", "*yard", lambda f: turn_imu(f, about(2, 45))), ("imu_axes", "skog", lambda f: turn_imu(f, about(2, -30))), ("imu_axes", "*yard", lambda f: turn_imu(f, about(2, -120))), ("imu_axes", "husky_sim", lambda f: turn_imu(f, about(1, 135))),
    ("rates_for_increments", "yard", rates), ("rates_for_increments", "*skog", rates), ("rates_for_increments", "iris_gps", rates),
    ("rates_for_increments", "husky", rates),
    ("g_for_mps2", "yard", lambda f: scale_imu(f, 1, 1 / 9.80665)), ("g_for_mps2", "*skog", lambda f: scale_imu(f, 1, 1 / 9.80665)),
    ("g_for_mps2", "iris_gps", lambda f: scale_imu(f, 1, 1 / 9.80665)), ("g_for_mps2", "husky", lambda f: scale_imu(f, 1, 1 / 9.80665)),
    ("deg_for_rad", "*yard", lambda f: scale_imu(f, DEGREE, 1)), ("deg_for_rad", "car", lambda f: scale_imu(f, DEGREE, 1)),
    ("deg_for_rad", "husky", lambda f: scale_imu(f, DEGREE, 1)), ("deg_for_rad", "iris", lambda f: scale_imu(f, DEGREE, 1)),
    ("deg_for_rad", "road", lambda f: scale_imu(f, 1 / DEGREE, 1)),
    ("deg_for_rad", "skog", lambda f: scale_imu(f, DEGREE, 1)),
    ("stamps_in_ms", "*yard", lambda f: stamps(f, 1000)), ("stamps_in_ms", "*mrclam1", lambda f: stamps(f, 1000)),
    ("stamps_in_ms", "skog", lambda f: stamps(f, 1000, FIX)), ("stamps_in_ms", "iris_gps", lambda f: stamps(f, 1000, [TIME], False)),
    ("stamps_in_s", "road", lambda f: stamps(f, 1_000_000)), ("stamps_in_s", "*husky", lambda f: stamps(f, 1_000_000, FIX)),
    ("stamps_in_s", "labyrinth", lambda f: stamps(f, 1_000_000)),
    ("two_clocks", "*yard", lambda f: other_clock(f, [TIME], -0.45, 0)), ("two_clocks", "skog", lambda f: other_clock(f, ["In_BodySpeed"], 0.03, 300)),
    ("two_clocks", "husky", lambda f: other_clock(f, FIX, 0.4, 0)), ("two_clocks", "mrclam2", lambda f: other_clock(f, ["In_RangeBearing"], -0.6, 20)),
    ("two_clocks", "iris_gps", lambda f: other_clock(f, ["In_Mag"], 0, -400)),
    ("no_in_sync", "*yard", lambda f: no_sync(f, 1.764e9 + 0.35)), ("no_in_sync", "skog", lambda f: no_sync(f, 86400.3)),
    ("no_in_sync", "mrclam3", lambda f: no_sync(f, 1.7e9 + 0.55)), ("no_in_sync", "iris_gps", lambda f: no_sync(f, 12345.25)),
    ("lat_lon_swapped", "*yard", swap_angles), ("lat_lon_swapped", "skog", swap_angles), ("lat_lon_swapped", "*iris", swap_angles),
    ("lat_lon_swapped", "husky", swap_angles), ("lat_lon_swapped", "husky_sim", swap_angles),
    ("latitude_sign", "*yard", map_signal("In_GnssLat", "Lat", np.negative)), ("latitude_sign", "skog", map_signal("In_GnssLat", "Lat", np.negative)),
    ("latitude_sign", "iris", map_signal("In_GnssLat", "Lat", np.negative)), ("latitude_sign", "husky", map_signal("In_GnssLat", "Lat", np.negative)),
    ("longitude_sign", "yard", map_signal("In_GnssLon", "Lon", np.negative)), ("longitude_sign", "*skog", map_signal("In_GnssLon", "Lon", np.negative)),
    ("longitude_sign", "iris", map_signal("In_GnssLon", "Lon", np.negative)), ("longitude_sign", "husky", map_signal("In_GnssLon", "Lon", np.negative)),
    ("velocity_axes", "*yard", swap_velocity), ("velocity_axes", "road", swap_velocity), ("velocity_axes", "iris", swap_velocity), ("velocity_axes", "road", map_signal("In_GnssVelEN", "North", np.negative)),
    ("wheels_reversed", "*yard", reverse_wheels), ("wheels_reversed", "road", reverse_wheels), ("wheels_reversed", "*husky", reverse_wheels),
    ("wheels_reversed", "husky_sim", reverse_wheels), ("wheels_reversed", "car", reverse_wheels),
    ("receiver_late", "*tour", late(0.4)), ("receiver_late", "road", late(1.2)), ("receiver_late", "husky_sim", late(0.2)), ("receiver_late", "car", late(1.0)),
    ("velocity_unit", "*yard", scale_velocity(1 / 0.514444)), ("velocity_unit", "road", scale_velocity(3.6)), ("velocity_unit", "yard", scale_velocity(0.514444)),
    ("velocity_unit", "iris", scale_velocity(1 / 0.514444)), ("velocity_unit", "husky_sim", scale_velocity(1 / 0.44704)),
    ("fix_unit", "*yard", write_places(decimals_as_minutes)), ("fix_unit", "road", write_places(minutes_as_decimals)), ("fix_unit", "iris", write_places(minutes_as_decimals)),
    ("fix_unit", "husky", write_places(minutes_as_decimals)), ("fix_unit", "skog", write_places(decimals_as_minutes)),
    ("fix_unit", "husky_sim", write_places(decimals_as_minutes)),
    ("wheel_scale", "*yard", lambda f: scale_wheels(f, 1.3)), ("wheel_scale", "road", lambda f: scale_wheels(f, 0.5)),
    ("wheel_scale", "husky", lambda f: scale_wheels(f, 2)), ("wheel_scale", "skog", lambda f: scale_wheels(f, 1 / 3.6)),
    ("origin_far", "*yard", map_signal("In_GnssLat", "Lat", lambda lat: lat - 82.1)), ("origin_far", "road", map_signal("In_GnssLon", "Lon", lambda lon: lon + 30)),
    ("wheel_scale", "husky_sim", lambda f: f, "--set", "wheels.speed_scale=1.4"),
    ("imu_upside_down", "car", lambda f: f, "--set", "inertial.mounting_bs=1,0,0,0,-1,0,0,0,-1"),
    ("imu_axes", "iris_gps", lambda f: f, "--set", "inertial.mounting_bs=0,0,1,1,0,0,0,1,0"),
    ("wheel_scale", "yard", lambda f: f, "--set", "wheels.drive.counts_per_turn=500"),
    ("origin_far", "iris_gps", lambda f: f, "--set", "gnss.origin_configured=1", "--set", "gnss.origin_latitude_deg=48.2627", "--set", "gnss.origin_longitude_deg=11.6683"),
    ("dead_axis", "*yard", stop_axis(GYRO, "AngZ")), ("dead_axis", "skog", stop_axis(ACCEL, "VelY", 0.01)), ("dead_axis", "husky", stop_axis(GYRO, "AngY")),
    ("dead_axis", "*iris_gps", stop_axis(ACCEL, "VelX")), ("dead_axis", "iris", stop_axis(GYRO, "AngX", 0.0001)), ("dead_axis", "road", stop_axis(ACCEL, "VelZ")),
    ("accel_scale", "*yard", scale_accel(0.5)), ("accel_scale", "skog", scale_accel(1.15)), ("accel_scale", "*husky", scale_accel(2)),
    ("accel_scale", "iris_gps", scale_accel(0.25)), ("accel_scale", "road", scale_accel(8)), ("accel_scale", "iris", scale_accel(0.85)),
    ("gyro_scale", "*yard", scale_gyro(0.5)), ("gyro_scale", "road", scale_gyro(2)), ("gyro_scale", "husky", scale_gyro(2)), ("gyro_scale", "*skog", scale_gyro(4)),
    ("gyro_scale", "iris", scale_gyro(0.5)), ("gyro_scale", "car", scale_gyro(2)), ("gyro_scale", "husky_sim", scale_gyro(1.5)),
    ("gyro_sign", "*yard", reverse_axis(GYRO, "AngZ")), ("gyro_sign", "road", reverse_axis(GYRO, "AngZ")), ("gyro_sign", "skog", reverse_axis(GYRO, "AngZ")),
    ("gyro_sign", "husky", reverse_axis(GYRO, "AngY")), ("gyro_sign", "*iris", reverse_axis(GYRO, "AngX")), ("gyro_sign", "iris", reverse_axis(GYRO, "AngY")),
    ("accel_sign", "*yard", reverse_axis(ACCEL, "VelZ")), ("accel_sign", "yard", reverse_axis(ACCEL, "VelX")), ("accel_sign", "skog", reverse_axis(ACCEL, "VelX")),
    ("accel_sign", "skog", reverse_axis(ACCEL, "VelY")), ("accel_sign", "skog", reverse_axis(ACCEL, "VelZ")), ("accel_sign", "husky", reverse_axis(ACCEL, "VelY")),
    ("accel_sign", "road", reverse_axis(ACCEL, "VelY")), ("accel_sign", "iris", reverse_axis(ACCEL, "VelZ")),
    ("accel_sign", "*yard", lambda f: scale_imu(f, 1, -1)), ("accel_sign", "road", lambda f: scale_imu(f, 1, -1)), ("accel_sign", "skog", lambda f: scale_imu(f, 1, -1)),
    ("track_width", "*yard", lambda f: scale_turn(f, 1.5)), ("track_width", "husky_sim", lambda f: scale_turn(f, 0.5)), ("track_width", "*husky", lambda f: scale_turn(f, 2)),
    ("track_width", "husky_sim", lambda f: f, "--set", "wheels.yaw_rate_scale=0.6"), ("track_width", "yard", lambda f: f, "--set", "wheels.drive.track_m=0.35"),
    ("wheels_unequal", "*yard", lambda f: scale_wheel(f, "Left", 1.2)), ("wheels_unequal", "husky_sim", lambda f: scale_wheel(f, "Right", 0.85)),
    ("wheels_unequal", "husky", lambda f: scale_wheel(f, "Right", 1.3)), ("wheels_unequal", "yard", lambda f: scale_wheel(f, "Right", 0)),
    ("wheels_unequal", "yard", lambda f: scale_wheel(f, "Left", 4)), ("wheels_unequal", "yard", lambda f: scale_wheel(f, "Right", 8)),
    ("wheels_unequal", "yard", lambda f: scale_wheel(f, "Left", 0.1)), ("wheels_unequal", "husky", lambda f: scale_wheel(f, "Left", 0.25)),
    ("wheels_unequal", "yard", lambda f: f, "--set", "wheels.drive.right_radius_m=0.15"),
    ("antenna_arm", "*yard", lambda f: f, "--set", "gnss.antenna_y_b_m=2"), ("antenna_arm", "road", lambda f: f, "--set", "gnss.antenna_x_b_m=3"),
    ("antenna_arm", "husky_sim", lambda f: f, "--set", "gnss.antenna_y_b_m=-1.5"), ("antenna_arm", "yard", lambda f: f, "--set", "gnss.antenna_x_b_m=-1.5"),
    *[(code, log, mistake) for log in ("*lab", "lab_again", "lab_third") for code, mistake in (
        ("scan_mirrored", mirror_scans), ("scan_turned", turn_scans(90)), ("scan_late", late_scans))],
    *[("scan_mirrored", log, lambda f: f) for log in ("*lab_upside_down", "lab_again_upside_down", "lab_third_upside_down")],
    ("scan_turned", "lab", turn_scans(-90)),
    ("message_missing", "*yard", lambda f: f.without("In_GnssLon")), ("message_missing", "skog", lambda f: f.without(TIME)),
    ("message_missing", "iris_gps", lambda f: f.without("In_GnssVelU")), ("message_missing", "husky", lambda f: f.without("In_GnssAcc")),
    ("two_senders", "*yard", lambda f: second_sender(f, ["In_WheelCounts"], 1, 7, Left=1000, Right=2000)),
    ("two_senders", "skog", lambda f: second_sender(f, ["In_BodySpeed"], 100, 5, Forward=0)),
    ("two_senders", "husky", lambda f: second_sender(f, IMU_FRAMES, 300, 3, AngZ=0.001)),
    ("two_senders", "mrclam1", lambda f: second_sender(f, ["In_BodySpeed"], 50, 0, Forward=0.05)),
]

SHORT_S = "90"
# name: robot, and how the log is made: arguments of tetap-world, or an importer with its arguments ({DATA} is the folder of the sets)
WORLDS = {"yard": ("rover", []), "road": ("rover", ["--course", "road"]), "car": ("car", []), "iris": ("iris", []),
          "husky_sim": ("husky_inertial", []),
          "lab": ("scanner", []), "lab_again": ("scanner", ["--seed", "12"]), "lab_third": ("scanner", ["--seed", "13"]), "lab_long": ("scanner", ["--duration", "150"]),
          "lab_turned": ("scanner", ["--duration", "150", "--built", "--set", "lidar.yaw_rad=0.6"]),
          "tour": ("rover", []), "husky_tour": ("husky_inertial", ["--seed", "77"]), "stand": ("rover", ["--course", "stand", "--duration", SHORT_S]),
          "usual": ("rover", ["--seed", "2", "--fault", "wheel_spin@45+3,gnss_outage@80+30,gnss_jump@150+2"])}
SETS = {"skog": ("car", "import_skog", "skog_gnss_ins"), "husky": ("husky_inertial", "import_husky", "husky"),
        "iris_gps": ("iris", "import_px4", "px4_ecl", "iris_gps"),
        "labyrinth": ("labyrinth", "import_labyrinth", "tuc_labyrinth/Indoor_UWB"),
        **{f"mrclam{i}": ("mrclam", "import_mrclam", "mrclam/MRCLAM_Dataset7", str(i)) for i in range(1, 6)}}
UPSIDE_DOWN = {f"{name}_upside_down": (WORLDS[name][0], [*WORLDS[name][1], "--fault", "lidar_mirrored@0+9999"]) for name in ("lab", "lab_again", "lab_third")}
SHORT_GOOD = ("yard", "lab", "skog", "husky", "iris_gps", "mrclam1", "labyrinth")
LONG = ("tour", "husky_tour")  # of their whole length in the short form, too: changes of speed and chords enough come late


class Logs:
    """The good logs, made when they are asked for."""

    def __init__(self, folder):
        self.folder, self.made = folder, {}

    def available(self, name):
        return name in WORLDS or name in UPSIDE_DOWN or os.path.exists(os.path.join(DATA, SETS[name][2]))

    @staticmethod
    def robot(name):
        return (WORLDS.get(name) or UPSIDE_DOWN.get(name) or SETS[name])[0]

    def frames(self, name):
        if name not in self.made:
            self.made[name] = self._recorded(name) if name in SETS else self._simulated(name)
        return self.made[name].copy()

    def _simulated(self, name):
        robot, arguments = WORLDS.get(name) or UPSIDE_DOWN[name]
        out = os.path.join(self.folder, name)
        run(os.path.join(PROGRAMS, "tetap-world"), "--memory", "--raw", "--quiet", "--robot", robot, "--out", out, *arguments, *([] if WHOLE or name in LONG or "--duration" in arguments else ["--duration", SHORT_S]))
        return Frames.read(os.path.join(out, "raw.log"))

    def _recorded(self, name):
        _, importer, data, *arguments = SETS[name]
        out = os.path.join(self.folder, name)
        run(os.path.join(ROOT, "tools/dataset", importer), os.path.join(DATA, data), *arguments, out)
        return Frames.read(out + ".log")


def run(*words):
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True)
    if done.returncode != 0:
        raise AssertionError(f"{' '.join(words)}: {done.stdout}{done.stderr}")
    return done.stdout


class Doctor(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.directory = tempfile.TemporaryDirectory()
        cls.logs = Logs(cls.directory.name)

    @classmethod
    def tearDownClass(cls):
        cls.directory.cleanup()

    def examine(self, frames, robot, *arguments):
        log, answer = (os.path.join(self.directory.name, one) for one in ("made.log", "doctor.json"))
        frames.write(log)
        said = run(os.path.join(PROGRAMS, "tetap-doctor"), log, *(["--robot", robot] if robot else []), "--json", answer, *arguments)
        with open(answer, encoding="utf-8") as file:
            self.answer = json.load(file)
        found = self.answer["findings"]
        for rank, one in enumerate(found, 1):
            self.assertEqual(one["rank"], rank)
            self.assertIn(one["evidence"], said)
            self.assertIn(one["change"], said)
        return found

    def test_each_mistake_is_named_first_or_second(self):
        missed, first, tried = [], 0, 0
        for number, (code, where, mistake, *arguments) in enumerate(MISTAKES):
            short, name = where.startswith("*"), where.lstrip("*")
            if not (short or WHOLE) or not self.logs.available(name):
                continue
            found = [one["code"] for one in self.examine(mistake(self.logs.frames(name)), self.logs.robot(name), *arguments)]
            tried += 1
            first += found[:1] == [code]
            if code not in found[:2]:
                missed.append(f"{code} in {name} (row {number}): {found or 'nothing'}")
        print(f"{tried} mistakes: {first} named first, {tried - len(missed)} first or second" + "".join(f"\n  missed: {one}" for one in missed))
        self.assertGreater(tried, 15)
        self.assertGreaterEqual(tried - len(missed), NAMED_SHARE * tried, missed)

    def test_the_table_of_codes_is_that_of_the_mistakes(self):
        """Each code of the program is made up here, in three logs or more, and stands on the page."""
        page = run(os.path.join(PROGRAMS, "tetap-doctor"), "--markdown")
        codes = [code for code in re.findall(r"^\| `(\w+)` \|", page, re.M) if code not in doctor_camera_test.MISTAKES]
        self.assertGreater(len(doctor_camera_test.MISTAKES), 2)
        made = [code for code, *_ in MISTAKES]
        self.assertEqual(sorted(codes), sorted(set(made)))
        self.assertGreaterEqual(min(len({where.lstrip("*") for one, where, *_ in MISTAKES if one == code}) for code in codes), 3)
        with open(os.path.join(ROOT, "docs/reference/diagnoses.md"), encoding="utf-8") as file:
            self.assertEqual(file.read(), page)

    def test_memory_does_not_grow_with_the_log(self):
        frames = self.logs.frames("yard")
        frames.time_us = frames.bus_us()
        frames = frames.without("In_Sync")
        least = []  # address space [kB] in which the program runs, in steps of 512
        for times in (1, 8):
            span = int(frames.time_us[-1] - frames.time_us[0]) // (1 << 20) * (1 << 20) + 2 * (1 << 20)  # stamps fit again after a wrap
            many = Frames(np.concatenate([frames.time_us + k * span for k in range(times)]), np.tile(frames.identifier, times), np.tile(frames.payload, times))
            path = os.path.join(self.directory.name, "long.log")
            many.write(path)
            command = ["bash", "-c", 'ulimit -v "$1"; exec "$2" "$3" --robot rover --brief', "bash"]
            least.append(next(limit for limit in range(4096, 65536, 512)
                              if subprocess.run([*command, str(limit), os.path.join(PROGRAMS, "tetap-doctor"), path], capture_output=True).returncode == 0))
        self.assertLessEqual(least[1] - least[0], 512)

    def test_the_findings_of_make_doctor_stand_in_its_folder(self):
        log = os.path.join(self.directory.name, "swapped.log")
        swap_wheels(self.logs.frames("yard")).write(log)
        out = os.path.join(self.directory.name, "made", "here")
        done = subprocess.run([os.path.join(ROOT, "tools/run/diagnose_log"), "rover"], capture_output=True, text=True, env={**os.environ, "LOG": log, "OUT": out, "PARAMS": "", "SET": ""})
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        with open(os.path.join(out, "doctor.json"), encoding="utf-8") as file:
            answer = json.load(file)
        self.assertEqual([one["code"] for one in answer["findings"]], ["wheels_swapped"])
        self.assertEqual(sorted(answer["findings"][0]), ["change", "code", "evidence", "rank", "try"])
        factor = re.search(r"by (-?\d+\.\d+) times the gyroscope's yaw rate over (\d+) s", answer["findings"][0]["evidence"])
        self.assertAlmostEqual(float(factor[1]), -1, delta=0.25)
        self.assertGreater(int(factor[2]), 60)

    def test_without_a_robot_one_cause_is_named_where_a_third_device_shows_it(self):
        for name, mistake, code, words in (
                ("yard", swap_wheels, "wheels_swapped", r"^The wheels turn the robot against the gyroscope's yaw rate over \d+ s \(correlation -0\.9\d\)\.$"),
                ("husky_sim", swap_wheels, "wheels_swapped", r"by -1\.\d\d times the gyroscope's yaw rate"),
                ("yard", reverse_axis(GYRO, "AngZ"), "gyro_sign", r"against the wheels \(-0\.9\d\), the sideways force in curves \(-0\.\d\d\)"),
                ("road", swap_velocity, "velocity_axes", r"East and North swapped")):
            found = self.examine(mistake(self.logs.frames(name)), "")
            self.assertEqual([one["code"] for one in found], [code], f"{code} in {name}")
            self.assertRegex(found[0]["evidence"], words)

    def test_a_late_receiver_is_measured_where_the_log_can_tell(self):
        for name, seconds in (("tour", 0.13), ("tour", 1.45)) + ((("road", 0.5), ("husky_sim", 0.7)) if WHOLE else ()):
            found = self.examine(late(seconds)(self.logs.frames(name)), self.logs.robot(name))
            self.assertEqual([one["code"] for one in found], ["receiver_late"])
            self.assertAlmostEqual(int(re.search(r"speed (\d+) ms before its stamp", found[0]["evidence"])[1]), 1e3 * seconds, delta=50)
            self.assertNotIn("cannot_tell", self.answer)
        for name, velocities in (("iris", 0), ("stand", 100)):  # no wheels; no change of speed
            self.assertEqual(self.examine(late(0.7)(self.logs.frames(name)), self.logs.robot(name)), [])
            said = re.fullmatch(r"whether the receiver is late: .* 2 changes of speed by 1 m/s \(0 seen, (\d+) velocities\)", self.answer["cannot_tell"])
            self.assertGreaterEqual(int(said[1]), velocities)

    def test_of_three_devices_only_the_wrong_one_gets_a_remedy(self):
        for name in ("yard", "husky_sim"):
            for code, mistake, change in (("velocity_unit", scale_velocity(1 / 0.514444), r"by 0\.5\d* in"), ("fix_unit", write_places(minutes_as_decimals), "ddmm"),
                                          ("wheel_scale", lambda f: scale_wheels(f, 0.5), r"by (1\.9|2\.[01])\d*")):
                found = self.examine(mistake(self.logs.frames(name)), self.logs.robot(name))
                self.assertEqual([one["code"] for one in found], [code], name)
                self.assertRegex(found[0]["change"], change)

    def test_the_course_by_gnss_decides_between_scans_and_wheels(self):
        for name, yaw_rad in (("lab_long", 0), ("lab_turned", 0.6)):
            for mistake, code in ((mirror_scans, "scan_mirrored"), (swap_wheels, "wheels_swapped")):
                found = self.examine(mistake(self.logs.frames(name)), "scanner", "--set", f"lidar.yaw_rad={yaw_rad}")
                self.assertEqual(found[0]["code"], code)
                self.assertIn("The course by GNSS turns", found[0]["evidence"])
                if yaw_rad == 0 or code != "scan_mirrored":  # mirrored scans of a turned scanner point elsewhere, too
                    self.assertEqual(len(found), 1, found)

    def test_a_mistake_gets_the_remedies_of_its_own_devices_alone(self):
        reversed_imu = [("accel_sign", "VelX, VelY and VelZ"), ("gyro_sign", "AngX, AngY and AngZ")]
        for name, mistake, remedies in (
                ("yard", scale_accel(0.01), [("accel_scale", r"by (9[5-9]|10[0-5])\.")]),
                ("yard", lambda f: scale_imu(f, -1, -1), reversed_imu), ("car", lambda f: scale_imu(f, -1, -1), reversed_imu), ("iris", lambda f: scale_imu(f, -1, -1), reversed_imu),
                ("yard", lambda f: turn_imu(f, np.diag([-1, 1, -1])), [("imu_upside_down", "Axes forward, right")]), ("iris", lambda f: turn_imu(f, ABOUT_X), [("imu_upside_down", "Axes")]),
                ("husky_tour", map_signal("In_GnssLat", "Lat", np.negative), [("latitude_sign", "north as positive")]),
                ("husky_tour", map_signal("In_GnssLon", "Lon", np.negative), [("longitude_sign", "east as positive")]),
                ("husky_tour", map_signal("In_GnssVelEN", "East", np.negative), [("velocity_axes", "East and North")])):
            with self.subTest(f"{name}: {remedies[0][0]}"):
                found = self.examine(mistake(self.logs.frames(name)), self.logs.robot(name))
                self.assertEqual([one["code"] for one in found], [code for code, _ in remedies], found)
                for one, (_, change) in zip(found, remedies):
                    self.assertRegex(one["change"], change)

    def test_a_reversed_accelerometer_is_named_wherever_the_log_begins(self):
        for begin_s in (21, 42):  # the speed hardly changes, the wheels alone show the turn
            found = self.examine(scale_imu(part(self.logs.frames("yard"), begin_s, begin_s + 42), 1, -1), "rover")
            self.assertEqual([one["code"] for one in found], ["accel_sign"], begin_s)
            self.assertIn("Negate VelX, VelY and VelZ", found[0]["change"])

    def test_a_remedy_with_numbers_ends_its_finding(self):
        set_antenna = ["--set", "gnss.antenna_y_b_m=2"]
        for code, mistake, arguments in (("wheel_scale", lambda f: scale_wheels(f, 1.3), []), ("track_width", lambda f: scale_turn(f, 1.5), []),
                                         ("wheels_unequal", lambda f: scale_wheel(f, "Left", 1.2), []), ("imu_upside_down", lambda f: turn_imu(f, ABOUT_X), []),
                                         ("imu_axes", lambda f: turn_imu(f, about(2, 45)), []), ("imu_axes", lambda f: turn_imu(f, about(1, 50)), []),
                                         ("antenna_arm", lambda f: f, set_antenna), ("receiver_late", late(0.4), [])):
            with self.subTest(code):
                frames = mistake(self.logs.frames("tour" if code == "receiver_late" else "yard"))
                remedies = next(one["try"] for one in self.examine(frames, "rover", *arguments) if one["code"] == code)
                self.assertIn(len(remedies), (1, 2))
                left = []
                for remedy in remedies:
                    settings = [word for path, values in remedy.items() for word in ("--set", f"{path}={','.join(map(str, values))}")]
                    left.append([one["code"] for one in self.examine(frames, "rover", *arguments, *settings)])
                self.assertIn([], left, remedies)

    def test_a_last_line_that_is_cut_off_is_named(self):
        log = os.path.join(self.directory.name, "cut.log")
        self.logs.frames("yard").write(log)
        with open(log, "rb") as file:
            text = file.read()
        for kept, said in ((text[:-1], ""), (text[:-5], f"tetap-doctor: warning: {log}:{text.count(bytes([10]))}: the last line is cut off and left out: ")):
            with open(log, "wb") as file:
                file.write(kept)
            done = subprocess.run([os.path.join(PROGRAMS, "tetap-doctor"), log], capture_output=True, text=True)
            self.assertEqual((done.returncode, done.stderr.count("\n")), (0, 1 if said else 0))
            self.assertTrue(done.stderr.startswith(said))

    @unittest.skipUnless(WHOLE, "plays a whole log: whole form alone")
    def test_a_replay_ends_with_the_likeliest_cause(self):
        log, out = (os.path.join(self.directory.name, one) for one in ("played.log", "played"))
        settings = {**os.environ, "LOG": log, "OUT": out, "ROBOT": "rover", "BOARD": "linux", "BUS": "memory", "REPORT": "--no-pictures", "PLAY": "--quiet --lockstep",
                    "PARAMS": "", "SET": "", "TRUTH": ""}
        for mistake, words in ((swap_wheels, "likeliest cause: Left and right wheel are swapped. (wheels_swapped)"), (lambda f: f, None)):
            mistake(self.logs.frames("yard")).write(log)
            done = subprocess.run([os.path.join(ROOT, "tools/run/replay_log")], capture_output=True, text=True, env=settings)
            self.assertEqual(done.returncode, 0, done.stderr)
            last = done.stdout.splitlines()[-4:]
            self.assertEqual(words in last if words else "likeliest" not in done.stdout, True, done.stdout)
            self.assertTrue(os.path.exists(os.path.join(out, "doctor.json")))

    def test_nothing_is_found_in_good_logs(self):
        names = [name for name in (list(WORLDS) + list(SETS) if WHOLE else SHORT_GOOD) if self.logs.available(name)]
        found = {}
        for name in names:
            for robot in [self.logs.robot(name)] + (["husky"] if name == "husky" else []) + [""]:
                codes = self.examine(self.logs.frames(name), robot)
                if codes:
                    found[f"{name} as {robot or 'no robot'}"] = codes
        self.assertEqual(found, {})
        print(f"{len(names)} good logs, each with its robot and without: nothing found")

    @unittest.skipUnless(WHOLE or "SEEDS" in os.environ, "whole courses: whole form, or SEEDS=")
    def test_nothing_is_found_whatever_the_seed(self):
        first, last = (int(seed) for seed in os.environ.get("SEEDS", "101-101").split("-"))
        out, answer = (os.path.join(self.directory.name, one) for one in ("seeded", "seeded.json"))
        found, looked = {}, 0
        for robot in SEEDED:
            for seed in range(first, last + 1):
                run(os.path.join(PROGRAMS, "tetap-world"), "--memory", "--raw", "--quiet", "--robot", robot, "--seed", str(seed), "--out", out)
                looked += 1
                for of in (["--robot", robot], []):
                    run(os.path.join(PROGRAMS, "tetap-doctor"), os.path.join(out, "raw.log"), *of, "--json", answer)
                    with open(answer, encoding="utf-8") as file:
                        codes = [one["code"] for one in json.load(file)["findings"]]
                    if codes:
                        found[f"{robot} seed {seed} as {' '.join(of) or 'no robot'}"] = codes
        self.assertEqual(found, {})
        print(f"{looked} good logs of {len(SEEDED)} robots, seeds {first} to {last}: nothing found")


if __name__ == "__main__":
    sys.argv = [one for one in sys.argv if one != "--whole"]
    unittest.main()
