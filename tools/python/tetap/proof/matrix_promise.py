# SPDX-License-Identifier: Apache-2.0
"""The node's promise for a cell of the fault matrix, and whether it was kept.

The promise follows from the number of other devices that see what the fault hurts: two or more `held`, one `noticed`, none `blind`. A receiver
with position and velocity is one device, and so are the wheels (or speedometer), the IMU, and each source of a heading. A device that sent
nothing usable while the fault lasted has seen nothing. A word counts from when a 3-sigma test of a witness could have spoken.
"""
QUANTITIES = ("position", "velocity", "heading", "tilt")
LEAST_GATES = 1.5     # below, a fault is at most noticed: no gate can separate it from noise
GRACE_S = 2.0         # for how long an error may be too large, beside
PERIODS = 3           # number of samples of the slowest device that vouches
INSIDE_AFTER_S = 10.0  # from the end of a fault until the error is inside three sigma again
NOTICED_RATIO = 3.0   # times three sigma: the most that is allowed without a word
WORD_S = 10.0         # in which a word has to come
LEAST_ERROR = 1e-3    # m, m/s or rad: less is no error that an oracle is held against
CLEAN_TIMES = 2.0     # an error is the fault's only above so many times that of the clean run

DEVICE_OF = {"gyro": "imu", "accel": "imu", "wheels": "wheels", "speed": "wheels", "gnss_position": "gnss", "gnss_velocity": "gnss", "gnss_both": "gnss",
             "gnss_accuracy": "gnss", "magnetometer": "magnetometer", "barometer": "barometer", "heading": "heading", "heading_accuracy": "heading",
             "landmarks": "landmarks"}
GIVES = {"imu": ("velocity", "heading", "tilt"), "wheels": ("velocity",), "gnss": ("position", "velocity"), "magnetometer": ("heading",),
         "barometer": ("position",), "heading": ("heading",), "landmarks": ("position", "heading")}
PLANAR_GIVES = {"imu": ("heading",), "wheels": ("position", "heading"), "gnss": ("position",), "landmarks": ("position", "heading")}


def device_of(sensor, axis):
    """The device whose fault it is; stamps and whole frames name it as their axis."""
    return axis if sensor in ("stamps", "frames") else DEVICE_OF[sensor]


def hurt(sensor, axis, planar):
    """The quantities that a sensor's fault leads astray at first; () where it has no part in the estimate."""
    if sensor in ("stamps", "frames"):
        return (PLANAR_GIVES if planar else GIVES).get(axis, ())
    if sensor == "gyro":
        return ("heading",) if axis == "z" else () if planar else ("tilt",)
    if sensor == "accel":
        return () if planar else ("velocity",) if axis == "z" else ("velocity", "tilt")
    if sensor in ("wheels", "speed"):
        along = "position" if planar else "velocity"
        return {"both": (along,), "forward": (along,), "yaw": ("heading",)}.get(axis, (along, "heading"))
    if sensor == "gnss_position":
        return () if planar and axis == "up" else ("position",)
    if sensor == "gnss_velocity":
        return () if planar else ("velocity",)
    if sensor in ("gnss_both", "gnss_accuracy"):
        return ("position",) if planar else ("position", "velocity")
    return (PLANAR_GIVES if planar else GIVES).get(device_of(sensor, axis), ())


def is_vertical(sensor, axis):
    """Whether the fault affects a height or a climb."""
    return axis in ("up", "pressure") or (sensor, axis) == ("accel", "z")


def sees(device, quantity, upward, situation, facts):
    """Whether a device that works would contradict a wrong `quantity`. A fault that shows by a change needs a state to start from. That a robot
    does not leave the ground is a constraint and no device: wheels see no climb."""
    start = situation == "start"
    if device == "gnss":
        if situation == "outage":
            return False
        if quantity == "heading":  # the course, where it is better than what is known
            return facts["speed_mps"] > 0 and facts["gnss_velocity_mps"] / facts["speed_mps"] < facts["sigma_heading_rad"]
        return quantity == "position" or not facts["planar"]  # a tilt leads the velocity astray
    if device == "wheels":
        if quantity == "heading":
            return facts["wheels_turn"] and not start
        return not upward and (quantity in ("velocity", "tilt") or not start)
    if device == "imu":
        if facts["planar"]:
            return quantity == "heading" and not start
        return quantity == "tilt" or not start
    if device == "barometer":
        return quantity in ("position", "velocity") and upward
    return quantity in ("position", "heading") if device == "landmarks" else quantity == "heading"


def sent(device, quantity, facts):
    """Whether the device sent anything usable in the time of the fault, or in that of three of its samples where this is longer. Facts without
    `usable_after_s` say that whoever is wired did."""
    if "usable_after_s" not in facts:
        return True
    velocity = device == "gnss" and quantity != "position" and not facts["planar"] and "gnss_velocity" in facts["period_s"]
    of = "gnss_velocity" if velocity else device
    after_s = facts["usable_after_s"].get(of)
    return after_s is not None and after_s <= max(facts["lasts_s"], PERIODS * facts["period_s"][of])


def witnesses(sensor, axis, situation, facts):
    """The other devices that see the hurt quantity; of several, those of the one that fewest see. None: the fault hurts nothing."""
    quantities = hurt(sensor, axis, facts["planar"])
    devices = [device for device in facts["period_s"] if device != "gnss_velocity" and device != device_of(sensor, axis)]
    each = [sorted(device for device in devices if sees(device, quantity, is_vertical(sensor, axis), situation, facts)
                   and sent(device, quantity, facts)) for quantity in quantities]
    return min(each, key=len) if each else None


def promise(sensor, axis, situation, gates, facts):
    """`gates`: the largest change of a value in units of its gate; None where the kind has no size."""
    found = witnesses(sensor, axis, situation, facts)
    if not found:
        return "blind"
    return "held" if len(found) >= 2 and (gates is None or gates >= LEAST_GATES) else "noticed"


def allowed_s(found, facts):
    """For how long an error may be too large: the grace, and some samples of the slowest device that vouches."""
    return GRACE_S + PERIODS * max((facts["period_s"][device] for device in found), default=0)


def speaks_s(kind, gates, found, facts):
    """From when on a 3-sigma test could speak, after the fault's begin: a ramp is as large as its gate, and a witness has sent a sample."""
    if "usable_after_s" not in facts:
        return 0.0
    first_s = min((facts["usable_after_s"].get(device, facts["lasts_s"]) for device in found), default=0.0)
    return max(first_s, facts["lasts_s"] / max(gates, 1.0) if kind == "ramp" and gates else 0.0)


def broken(promised, quantities, said, allowed, word_s=WORD_S):
    """The words for what was not kept; () where the promise held. `said`: word to seconds after the fault's begin; one is due after word_s."""
    if promised == "blind":
        return ()
    found = []
    if promised == "held":
        if any(one["beyond_s"] > allowed for one in quantities.values()):
            found.append("beyond")
        if any(one["inside_after_s"] is None or one["inside_after_s"] > INSIDE_AFTER_S for one in quantities.values()):
            found.append("outside")
    elif all(after > word_s for after in said.values()) and any(
            one["worst_ratio"] > NOTICED_RATIO and one["worst_error"] > CLEAN_TIMES * one["clean_error"] for one in quantities.values()):
        found.append("silent")
    if any(one["valid_while_out_s"] > allowed for one in quantities.values()):
        found.append("valid")
    return tuple(found)


def held_against(row, facts, quantities):
    """The promise by these facts, who vouches for it, and the words for what was not kept."""
    found = witnesses(row["sensor"], row["axis"], row["situation"], facts) or []
    promised = promise(row["sensor"], row["axis"], row["situation"], row["gates"], facts)
    word_s = WORD_S + speaks_s(row["kind"], row["gates"], found, facts)
    return promised, found, list(broken(promised, quantities, row["said"], allowed_s(found, facts), word_s))


def floor(row, facts):
    """Of a held cell: whether the oracle breaks the promise as well, and the largest error of each quantity over the oracle's."""
    if "oracle" not in row:
        return {}
    over = {name: one["worst_error"] / max(row["oracle"][name]["worst_error"], LEAST_ERROR) for name, one in row["quantities"].items()}
    return {"oracle_broken": held_against(row, facts, row["oracle"])[2], "over_oracle": over}


def judged(row):
    """The row of out/matrix.json for a row of tetap-matrix. Promise and verdict by wiring alone stand beside, as `wired`."""
    quantities, facts = row["quantities"], {**row["facts"], "lasts_s": row["lasts_s"]}
    promised, found, words = held_against(row, facts, quantities)
    wired = held_against(row, {key: value for key, value in facts.items() if key != "usable_after_s"}, quantities)
    worst = max(quantities, key=lambda name: quantities[name]["worst_ratio"])
    late = [one["inside_after_s"] for one in quantities.values()]
    return {**{key: row[key] for key in ("robot", "sensor", "axis", "kind", "size", "situation", "seed")}, "promise": promised,
            "worst_ratio": quantities[worst]["worst_ratio"], "beyond_s": max(one["beyond_s"] for one in quantities.values()),
            "clean_ratio": quantities[worst]["clean_ratio"], "inside_after_s": None if None in late else max(late),
            "valid_while_out_s": max(one["valid_while_out_s"] for one in quantities.values()), "said": sorted(row["said"], key=row["said"].get),
            "quantity": worst, "worst_error": quantities[worst]["worst_error"], "clean_error": quantities[worst]["clean_error"],
            "gates": row["gates"], "size_value": row["size_value"], "witnesses": found, "broken": words,
            "wired": {"promise": wired[0], "broken": wired[2]}, **(floor(row, facts) if promised == "held" else {})}
