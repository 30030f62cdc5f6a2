# SPDX-License-Identifier: Apache-2.0
"""The cells of the fault matrix: every sensor that a robot is sent, with every kind of fault in every size, in every situation."""
import hashlib

from tetap.proof import matrix_promise

ROBOTS = ("rover", "car", "iris", "husky_inertial")
OWN_TABLE = ("rover_landmarks",)  # a planar filter: its promises are counted apart
SITUATIONS = ("standing", "straight", "curve", "start", "outage")

SIZES = ("0.1g", "1g", "2g", "5g", "30g", "max")
SIZED = ("offset", "spike1", "spike2", "spike10", "step", "ramp")
SCALES = ("x0.5", "x0.9", "x1.1", "x2", "x10")
SHIFTS = ("s0.001", "s0.01", "s0.1", "s0.5", "s-0.1")
DELAYS = ("s0.1", "s0.5", "s0.9", "s1.04", "s2.1")
PLAIN = ("sign", "dead", "stuck", "not_available")

# Sensor: (message that brings it, axes, kinds that it does not have).
SENSORS = {
    "gyro": ("In_Imu0Gyro", ("x", "y", "z"), ()),
    "accel": ("In_Imu0Accel", ("x", "y", "z"), ()),
    "wheels": ("In_WheelCounts", ("left", "right", "both"), ("not_available",)),  # every code of a counter is a count
    "speed": ("In_BodySpeed", ("forward", "yaw"), ()),
    "gnss_position": ("In_GnssLat", ("east", "north", "up"), ("scale",)),  # a place has no scale
    "gnss_velocity": ("In_GnssVelEN", ("east", "north", "up"), ()),
    "gnss_both": ("In_GnssVelEN", ("east", "north"), ("scale", "sign", "dead", "not_available")),
    "magnetometer": ("In_Mag", ("x", "y", "z"), ()),
    "barometer": ("In_Baro", ("pressure",), ("sign",)),  # no code of the frame is a negative pressure
    "heading": ("In_Heading", ("angle",), ()),
    "landmarks": ("In_RangeBearing", ("range", "bearing"), ()),
}
ACCURACIES = {"gnss_accuracy": ("In_GnssAcc", ("horizontal", "velocity", "all")), "heading_accuracy": ("In_Heading", ("angle",))}
DEVICES = {"imu": "In_Imu0Time", "wheels": "In_WheelCounts In_BodySpeed In_WheelSpeed", "gnss": "In_GnssLat", "magnetometer": "In_Mag",
           "barometer": "In_Baro", "heading": "In_Heading", "landmarks": "In_RangeBearing"}

# Recorded drives: (robot, importer, its arguments below $TETAP_DATA and beside it). One fault at each of ten places: a wild sample, a dead axis, a
# velocity that is off, a fix that is off, a landmark that is off.
RECORDED = {"skog": ("car", "import_skog", "skog_gnss_ins"), "px4": ("iris", "import_px4", "px4_ecl", "iris_gps"),
            "husky": ("husky_inertial", "import_husky", "husky"), "mrclam": ("mrclam", "import_mrclam", "mrclam/MRCLAM_Dataset7", "1")}
PLACES = tuple(f"place{k}" for k in range(1, 11))
RECORDED_FAULTS = (("gyro", "x", "spike1", "max"), ("gyro", "z", "spike2", "30g"), ("accel", "y", "spike1", "max"), ("gyro", "z", "dead", "-"),
                   ("accel", "x", "dead", "-"), ("gnss_velocity", "east", "offset", "5g"), ("gnss_position", "north", "offset", "5g"),
                   ("speed", "forward", "offset", "5g"), ("speed", "forward", "offset", "0.1g"), ("speed", "forward", "dead", "-"),
                   ("landmarks", "range", "offset", "5g"), ("landmarks", "bearing", "spike1", "max"))


def recorded(messages, planar):
    """(sensor, axis, kind, size) of the faults of a recorded drive."""
    return [one for one in RECORDED_FAULTS if SENSORS[one[0]][0] in messages and matrix_promise.hurt(one[0], one[1], planar)]


def of_values(missing):
    """(kind, size) of a sensor that measures."""
    kinds = [(kind, size) for kind in SIZED for size in SIZES]
    kinds += [("scale", size) for size in SCALES] + [(kind, "-") for kind in PLAIN]
    return [one for one in kinds if one[0] not in missing]


def faults(messages, planar):
    """(sensor, axis, kind, size) of every fault of a robot that is sent these messages; none that hurts nothing."""
    found = []
    for sensor, (message, axes, missing) in SENSORS.items():
        found += [(sensor, axis, *one) for axis in axes for one in of_values(missing) if message in messages]
    for sensor, (message, axes) in ACCURACIES.items():
        kinds = [("scale", "x0.1"), ("scale", "x10"), ("stuck", "-"), ("dead", "-"), ("not_available", "-")]
        found += [(sensor, axis, *one) for axis in axes for one in kinds if message in messages]
    for device, names in DEVICES.items():
        if not any(name in messages for name in names.split()):
            continue
        found += [("stamps", device, kind, size) for kind in SIZED for size in SHIFTS] + [("stamps", device, "stuck", "-")]
        found += [("frames", device, "delayed", size) for size in DELAYS]
        found += [("frames", device, kind, "-") for kind in ("repeated", "lost", "not_available")]
    return [one for one in found if matrix_promise.hurt(one[0], one[1], planar)]


def rank(name):
    """A number that depends on the name alone: the first N of this order are a sample of all."""
    return hashlib.sha256(name.encode()).hexdigest()


def cells(about, seeds):
    """Names "ROBOT SITUATION SENSOR AXIS KIND SIZE SEED" in the order in which they are to be run: every cell with the first seed, in an order like
    chance, then with the next. `about`: robot to (messages, planar)."""
    plain = [" ".join((robot, situation, *one)) for robot, (messages, planar) in about.items() for one in faults(messages, planar)
             for situation in SITUATIONS if not (situation == "outage" and matrix_promise.device_of(one[0], one[1]) == "gnss")]
    plain.sort(key=rank)
    return [f"{name} {seed}" for seed in seeds for name in plain]
