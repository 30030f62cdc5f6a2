# SPDX-License-Identifier: Apache-2.0
"""A telephone in a car that waits, then drives circles: recordings as phyphox and Sensor Logger export them.

By the formulas of a circle; nothing of tetap is in it."""
import math
import os
import random
import zipfile

RADIUS_M, SPEED_MPS, WAIT_S, END_S, G = 25.0, 5.0, 20.0, 80.0, 9.80665
LATITUDE, LONGITUDE, HEIGHT_M = 48.26, 11.67, 520.0


def angle_at(t):
    """Angle on the circle, speed and forward acceleration: 2 m/s2 until it is fast enough."""
    t = max(0.0, t - WAIT_S)
    rise = SPEED_MPS / 2.0
    way = t * t if t < rise else rise * rise + SPEED_MPS * (t - rise)
    return way / RADIUS_M, min(SPEED_MPS, 2.0 * t), 2.0 if 0 < t < rise else 0.0


def samples():
    """Rows (t, gyro, specific force) at 100 Hz, and (t, lat, lon, height, speed, course, accuracies) at 1 Hz."""
    chance = random.Random(4)
    inertial, fixes = [], []
    for i in range(int(END_S * 100) + 1):
        t = i / 100
        _, speed, forward = angle_at(t)
        noise = [chance.gauss(0, 1) for _ in range(6)]
        inertial.append((t, [0.001 * noise[0], 0.001 * noise[1], speed / RADIUS_M + 0.001 * noise[2]],
                         [forward + 0.03 * noise[3], speed * speed / RADIUS_M + 0.03 * noise[4], G + 0.03 * noise[5]]))
    for t in range(int(END_S) + 1):
        angle, speed, _ = angle_at(t)
        east, north = RADIUS_M * math.sin(angle), RADIUS_M * (1 - math.cos(angle))
        north, east = north + chance.gauss(0, 1), east + chance.gauss(0, 1)
        place = (LATITUDE + math.degrees(north / 6.371e6), LONGITUDE + math.degrees(east / 6.371e6 / math.cos(math.radians(LATITUDE))))
        fixes.append((float(t), *place, HEIGHT_M, speed, (90 - math.degrees(angle)) % 360, 1.5, 3.0))
    return inertial, fixes


def table(header, rows):
    return "\n".join([",".join(header), *[",".join(repr(cell) if isinstance(cell, float) else str(cell) for cell in row) for row in rows], ""])


def phyphox():
    inertial, fixes = samples()
    def xyz(text, unit):
        return ['"Time (s)"', *['"%s %s (%s)"' % (text, axis, unit) for axis in "xyz"]]
    return {"Accelerometer.csv": table(xyz("Acceleration", "m/s^2"), [(t, *force) for t, _, force in inertial]),
            "Gyroscope.csv": table(xyz("Gyroscope", "rad/s"), [(t, *rate) for t, rate, _ in inertial]),
            "Location.csv": table(['"%s"' % name for name in ("Time (s)", "Latitude (°)", "Longitude (°)", "Height (m)", "Velocity (m/s)", "Direction (°)",
                                                              "Horizontal Accuracy (m)", "Vertical Accuracy (°)")], fixes)}


def sensor_logger():
    """Columns z, y, x; acceleration without gravity beside it; nanoseconds since 1970."""
    inertial, fixes = samples()
    def zyx(at):
        return [(1_700_000_000_000_000_000 + round(t * 1e6) * 1000, t, *reversed(values)) for t, values in at]
    return {"Gyroscope.csv": table(["time", "seconds_elapsed", "z", "y", "x"], zyx((t, rate) for t, rate, _ in inertial)),
            "Accelerometer.csv": table(["time", "seconds_elapsed", "z", "y", "x"], zyx((t, [force[0], force[1], force[2] - G]) for t, _, force in inertial)),
            "Gravity.csv": table(["time", "seconds_elapsed", "z", "y", "x"], zyx((t, [0.0, 0.0, G]) for t, _, _ in inertial)),
            "Location.csv": table(["time", "seconds_elapsed", "bearingAccuracy", "speedAccuracy", "verticalAccuracy", "horizontalAccuracy", "speed", "bearing",
                                   "altitude", "longitude", "latitude"],
                                  [(1_700_000_000_000_000_000 + round(t * 1e6) * 1000, t, 5.0, 0.3, v, h, speed, course, height, lon, lat)
                                   for t, lat, lon, height, speed, course, h, v in fixes]),
            "Metadata.csv": "version,device name\n3,a phone\n"}


def write(files, folder):
    """The tables in a folder, and beside it as the archive that a telephone sends: the paths of both."""
    os.makedirs(folder, exist_ok=True)
    for name, text in files.items():
        with open(os.path.join(folder, name), "w", encoding="utf-8") as file:
            file.write(text)
    with zipfile.ZipFile(folder + ".zip", "w", zipfile.ZIP_DEFLATED) as archive:
        for name in sorted(files):
            archive.writestr(name, files[name])
    return folder, folder + ".zip"
