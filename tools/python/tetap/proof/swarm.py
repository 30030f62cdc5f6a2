# SPDX-License-Identifier: Apache-2.0
"""Swarm testing of the node (Groce, Zhang, Eide, Chen, Regehr, "Swarm testing", ISSTA 2012): each seed draws which kinds of faults exist at all,
so that kinds which hide each other are also tried without each other. Pairs of kinds, the judge of a run, and delta debugging (Zeller and
Hildebrandt, "Simplifying and isolating failure-inducing input", IEEE TSE 28(2), 2002), in sweeps."""
import itertools
import random
import time

import numpy as np

from tetap.can.bus_writer import crc8
from tetap.report.ground_truth import errors
from tetap.report.recorded_run import HELD_S, TICK_S, code_names, held_at

ROBOTS = ("rover", "car", "iris", "husky_inertial")
FAULTS_FROM_S, FAULTS_UNTIL_S = 15.0, 80.0  # phase 1
SETTLED_S, LOOK_S = 60.0, 5.0               # phase 2: inside and nominal within this, judged over the seconds behind
DURATION_S = FAULTS_UNTIL_S + SETTLED_S + LOOK_S
LONGEST_S, EXIST = 15.0, 0.5                # of a fault; probability that a seed has a kind at all
MOST_FAULTS = 12
LEFT_OUT = {"gnss_far": "lasts 232 s by definition: longer than a run"}
ALONE = "clock_jump"  # moves the time by which faults of frames are placed: not together with these
VALID_RATIO, VALID_S = 10.0, 2.0            # valid flags never stay beyond ten times 3 sigma for longer
HURT_S = 10.0                               # for so long after its end a fault still counts as one of its device
INSIDE_SHARE = 0.9                          # of the epochs behind phase 2: an honest filter leaves its 3 sigma now and then
FRAME_KINDS = {  # kind: sensor, axis, kind and sizes of tetap-inject
    "imu spike": (("gyro z spike2", (0.5, 5.0)), ("accel x spike2", (5.0, 50.0)), ("gyro x spike10", (0.5, 5.0))),
    "imu offset": (("gyro z offset", (0.02, 0.5)), ("accel x offset", (0.2, 3.0))),
    "imu dead": (("gyro z dead", (0.0,)), ("accel z dead", (0.0,)), ("gyro x dead", (0.0,))),
    "imu lost": (("frames imu lost", (0.0,)),),
    "imu delayed": (("frames imu delayed", (0.1, 0.9, 2.1)),),
    "imu stamps": (("stamps imu offset", (-0.1, 0.1)),),
    "gnss velocity off": (("gnss_velocity east step", (0.5, 2.0, 20.0)), ("gnss_velocity north ramp", (1.0, 5.0))),
    "gnss position off": (("gnss_position east step", (3.0, 30.0)), ("gnss_position north spike1", (10.0, 1e4))),
    "gnss both off": (("gnss_both east step", (5.0, 50.0)),),
    "gnss delayed": (("frames gnss delayed", (0.1, 0.9, 1.04, 2.1)),),
    "gnss repeated": (("frames gnss repeated", (0.0,)),),
    "gnss lost": (("frames gnss lost", (0.0,)),),
}


DEVICE = {"slip_left": "wheels", "slip_right": "wheels", "wheel_stuck": "wheels", "wheel_spin": "wheels", "encoder_dropout": "wheels", "gyro_bias_step": "imu",
          "vibration": "imu", "mag_disturbance": "magnetometer"}
EVERY = "every device"  # of faults that hurt all of them, or that no device shows
# Values of enumerations that no run of the swarm has, and who has them.
EXPLAINED = {
    "BootCause": "boards only: test/hal/stm32_parts_test.cpp", "CpuFault": "boards only: sim_host/emulator/test", "ImuState": "wired sensors: test/host/wired_replay_test.cpp",
    "GnssState": "wired sensors: test/host/wired_replay_test.cpp", "SyncState": "a run of the swarm is in lockstep: test/node/pacer_test.cpp",
    "SyncKind": "a run of the swarm is in lockstep: test/node/bus_trust_test.cpp", "EstimatorKind": "other robots, from recorded logs: test/replay",
    "GraphStatus": "pose graphs: test/node/graph_mapper_test.cpp", "LandmarkState": "test/slam/ekf_mapper_test.cpp", "OriginSource": "test/node/map_origin_test.cpp",
    "MapFault bits": "test/sim/mapper_test.cpp", "Verdict": "maps and numerical failure: test/slam, test/filter/never_nan_test.cpp",
    "Sensor": "sensors of other robots: test/bus/codec_test.cpp", "Sensor bits": "sensors of other robots: test/bus/codec_test.cpp",
    "Fault bits": "test/node/map_origin_test.cpp, test/host/wired_replay_test.cpp", "Mode": "Boot and Fault: test/node/firmware_test.cpp",
    "ResetCause": "broken invariants: test/node/never_nan_test.cpp", "SourceState": "test/estimators/inertial_sources_test.cpp", "Check": "test/estimators/inertial_sources_test.cpp",
}


def device_of(kind):
    """The device that a kind of fault hurts."""
    first = kind.split()[0].split("_")[0]
    return DEVICE.get(kind) or (first if first in ("imu", "gnss") else EVERY)


def is_blind(faults, begin, end):
    """Whether two devices or more were hurt by the time of an error: nobody is left who could outvote both."""
    hurt = {device_of(one["kind"]) for one in faults if one["begin"] <= end and one["begin"] + one["lasts"] + HURT_S >= begin}
    return EVERY in hurt or len(hurt) > 1


def sweep(frames, fields):
    """A clean log in which input enumerations take each of their values: kinds of fixes, resets, and guards of samples."""
    tables, out, last_s, turn = fields.dbc.tables, [], 0, 0
    fixes, resets, sensors = (sorted(tables[name].values()) for name in ("GnssFix", "ResetWhat", "Sensor"))
    for frame in frames:
        second = (frame.time_us - frames[0].time_us) // 1_000_000
        if frame.identifier == fields.identifier["In_GnssAlt"] and second >= 20:
            frame = frame._replace(payload=fields.put(frame.payload, "In_GnssAlt", "Fix", fixes[second // 2 % len(fixes)]))
        out.append(frame)
        if second <= max(last_s, 20):
            continue
        last_s, turn = second, turn + 1
        guard = fields.put(0, "In_Guard", "Sensor", sensors[turn % len(sensors)])
        out.append(frame._replace(identifier=fields.identifier["In_Guard"], payload=guard))
        reset = fields.put(fields.put(0, "Cmd_Reset", "Ctr", turn % 16), "Cmd_Reset", "What", resets[turn % len(resets)])
        identifier = fields.identifier["Cmd_Reset"]
        crc = int(crc8(identifier & 0x3F, np.array([reset], dtype=np.uint64))[0])
        out.append(frame._replace(identifier=identifier, payload=fields.put(reset, "Cmd_Reset", "Crc", crc)))
    return out


def kinds_of(world_faults):
    """Kinds for a robot: those of the world that act on it, and those of frames."""
    return [name for name in world_faults if name not in LEFT_OUT] + sorted(FRAME_KINDS)


def draw(seed, kinds_by_robot, instants):
    """{robot, faults: [{kind, begin, lasts, fault, size}]}: everything follows from the seed."""
    chance = random.Random(f"swarm {seed}")
    robot = chance.choice(ROBOTS)
    exist = [kind for kind in kinds_by_robot[robot] if chance.random() < EXIST]
    chance.shuffle(exist)
    faults, chosen = [], exist[:chance.randint(min(3, MOST_FAULTS), MOST_FAULTS)]
    if ALONE in chosen:
        chosen = [kind for kind in chosen if kind not in FRAME_KINDS]
    for kind in chosen:
        lasts = 0.0 if kind in instants else chance.uniform(1.0, LONGEST_S)
        begin = 0.0 if kind == "moving_start" else chance.uniform(FAULTS_FROM_S, FAULTS_UNTIL_S - lasts)
        one = {"kind": kind, "begin": round(begin, 2), "lasts": round(lasts, 2)}
        if kind in FRAME_KINDS:
            name, sizes = chance.choice(FRAME_KINDS[kind])
            one.update(fault=name, size=chance.choice(sizes))
        faults.append(one)
    return {"seed": seed, "robot": robot, "exist": sorted(exist), "faults": sorted(faults, key=lambda fault: fault["begin"])}


def pairs(kinds):
    return {tuple(sorted(pair)) for pair in itertools.combinations(set(kinds), 2) if not (ALONE in pair and set(pair) & set(FRAME_KINDS))}


def pair_share(draws, kinds_by_robot):
    """(reached, all): pairs of kinds that stood in one run, of those that any robot can have together."""
    possible = set().union(*(pairs(kinds) for kinds in kinds_by_robot.values()))
    reached = set().union(set(), *(pairs(fault["kind"] for fault in one["faults"]) for one in draws))
    return len(reached & possible), len(possible)


def longest(at, on):
    """(seconds, begin) of the longest stretch in which `on` holds throughout."""
    best, first, begin = 0.0, None, None
    for t, one in zip(at, on):
        if not one:
            begin = None
            continue
        begin = t if begin is None else begin
        if first is None or t - begin > best:
            best, first = float(t - begin), float(begin)
    return best, first


def run_times(rows, start_s=None):
    """Seconds of a run for rows of it: by epoch, or by the node's time since `start_s` where a log is only a part of the run."""
    return rows["epoch"] * TICK_S if start_s is None else rows["time_s"] - start_s


def ratios(run, truth, start_s=None):
    """(times, largest error of each epoch in its own 3 sigma; NaN: not valid or not known)."""
    rows = run.of(run.best)
    dx, dy, dyaw = errors(rows, truth)
    held = HELD_S / TICK_S
    sigma = {name: held_at(rows["epoch"], rows[name], rows["epoch"], held) for name in ("std_x_m", "std_y_m", "std_yaw_rad")}
    with np.errstate(invalid="ignore", divide="ignore"):
        ratio = np.fmax(np.fmax(np.abs(dx) / (3 * sigma["std_x_m"]), np.abs(dy) / (3 * sigma["std_y_m"])), np.abs(dyaw) / (3 * sigma["std_yaw_rad"]))
    return run_times(rows, start_s), np.where(np.isfinite(ratio), ratio, np.nan)


def judge(run, truth, faults=(), start_s=None):
    """{safe, recovered, words[], ratio, valid_s}: `safe` is phase 1, `recovered` or `words` is phase 2. `start_s`: as run_times() has it."""
    names = code_names()
    rows = run.of(run.best)
    at, ratio = ratios(run, truth, start_s)
    known = np.isfinite(ratio)
    out = np.where(known, ratio, 0.0) > VALID_RATIO
    valid_s, begin = longest(at, out)
    finite = bool(np.isfinite(rows["x_m"][rows["pos_valid"] == 1]).all())
    last = (at >= FAULTS_UNTIL_S + SETTLED_S) & (at < DURATION_S)
    status = run.status
    late = run_times(status, start_s) >= FAULTS_UNTIL_S + SETTLED_S
    words = set()
    for mode, bits in zip(status["mode"][late], status["faults"][late]):
        words.add(names["Mode"].get(int(mode), f"mode {int(mode)}"))
        words |= {names["Fault"].get(bit, f"fault {bit}") for bit in range(16) if int(bits) >> bit & 1}
    inside = float((ratio[last & known] <= 1).mean()) if (last & known).any() else 0.0
    nominal = "Nominal" in words and not words & {"Degraded", "DeadReckoning", "WaitingForPose", "Fault", "Aligning"}
    return {"safe": finite and valid_s <= VALID_S, "valid_s": round(valid_s, 2), "astray_at_s": begin,
            "blind": begin is not None and is_blind(faults, begin, begin), "ratio": round(float(ratio[known].max()), 2) if known.any() else None,
            "inside": round(inside, 3), "words": sorted(words - {"Nominal"}), "recovered": inside >= INSIDE_SHARE and nominal,
            "ratio_after": round(float(ratio[last & known].max()), 2) if (last & known).any() else None}


def verdict(judged):
    """ok; named: outside or not nominal, and a word for it; blind: astray while two devices were hurt, which is listed and not judged; silent: outside, and
    nothing is known of it; unsafe."""
    if not judged["safe"]:
        return "blind" if judged.get("blind") else "unsafe"
    if judged["recovered"]:
        return "ok"
    return "named" if judged["words"] else "silent"


def shrunk(items, fails, seconds, clock=time.monotonic):
    """Delta debugging in sweeps: a part of `items` that fails(part) still holds for, and from which no single item can be taken. Each sweep goes on behind
    a chunk that was taken, and the next one has chunks of half the size. `fails` is called until `seconds` are over."""
    end, size = clock() + seconds, max(len(items) // 2, 1)
    while len(items) > 1:
        start, before = 0, len(items)
        while start < len(items):
            if clock() >= end:
                return items
            rest = items[:start] + items[start + size:]
            if rest and fails(rest):
                items = rest
            else:
                start += size
        if size == 1 and len(items) == before:
            break
        size = max(size // 2, 1)
    return items
