#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Laws that need no truth, on simulated and recorded drives: laws_runs.py PROGRAMS OUT [--whole]. tools/proof/check_laws judges each log. The judge is
judged, too: a mirror image of a mirror image is the log itself, so are four quarter turns, and a robot whose parameters are not mirrored, or whose
velocities are not turned, breaks the law. The short form has a minute of four robots and one MRCLAM drive, the whole one all recorded drives. Needs $TETAP_DATA (default ../shared/data) for the recorded ones."""
import concurrent.futures
import os
import subprocess
import sys

sys.dont_write_bytecode = True
ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))
sys.path.insert(0, os.path.join(ROOT, "tools", "python"))
from tetap.can import faulty_log  # noqa: E402
from tetap.proof import laws  # noqa: E402

DATA = os.environ.get("TETAP_DATA", os.path.join(ROOT, os.pardir, "shared", "data"))
SIMULATED = ("rover", "car", "iris", "husky_inertial")
MRCLAM = ("mrclam", "MRCLAM_Dataset7")


def run(*words):
    """What a failed command printed; empty where it succeeded."""
    done = subprocess.run(words, capture_output=True, text=True, cwd=ROOT, check=False)
    return f"{' '.join(words)}: status {done.returncode}\n{done.stdout}{done.stderr}" if done.returncode else ""


def involution(log):
    """The mirror image of the mirror image is the log, and no frame of a sensor but wheels with equal counts is its own image."""
    changes = laws.Changes()
    frames = faulty_log.read(log)
    parameters = {"gnss.antenna_y_b_m": "0.25", "gyro.up_s": "0 0.6 0.8", "imu.accel_matrix": "1 2 3 4 5 6 7 8 9",
                  "wheels.drive.left_radius_m": "0.1", "wheels.drive.right_radius_m": "0.2"}
    once, image = changes.mirror(frames, parameters, 0)
    again, back = changes.mirror(once, image, 0)
    numbers = lambda p: {path: [float(x) for x in text.split()] for path, text in p.items()}  # noqa: E731
    wrong = []
    if again != frames or numbers(back) != numbers(parameters):
        wrong.append("a mirror image of a mirror image is not the log")
    if once == frames or numbers(image) == numbers(parameters):
        wrong.append("a mirror image is the log")
    return wrong


def image_without_parameters(runs):
    """A robot whose antenna is half a metre to the left stays so when only its log is mirrored: the judge has to see a metre."""
    setting = "gnss.antenna_y_b_m=0.5"
    log = runs.simulated("rover", "--set", setting)
    replay, changes = laws.Replay(runs.programs, runs.path("one_sided"), "rover", [setting]), laws.Changes()
    frames = faulty_log.in_bus_time(faulty_log.read(log))
    image, _ = changes.mirror(frames, replay.parameters, 0)
    found = laws.compared(replay.estimates("base", frames, replay.parameters), replay.estimates("image", image, replay.parameters),
                          lambda pose: (pose[0], -pose[1], -pose[2]))
    return [] if found.broken and found.m > 0.5 else [f"an antenna on the wrong side goes unseen: {found.m:.3f} m"]


def quarter_turns(log):
    """Four quarter turns are the log to a digit or two, one is not; and a turn that leaves the receiver's velocities out breaks the law."""
    changes = laws.Changes()
    frames = faulty_log.read(log)
    parameters = {"start.x_m": "3.0", "start.y_m": "-4.0", "start.yaw_rad": "0.5", "magnetic.declination_rad": "0.1"}
    turned, image = frames, parameters
    wrong = []
    for quarter in range(4):
        turned, image = changes.turn(turned, image, 0)
        if quarter < 3 and (turned == frames or image == parameters):
            wrong.append(f"{quarter + 1} quarter turns are the log")
    for field, name in (("Lat", "In_GnssLat"), ("Lon", "In_GnssLon"), ("East", "In_GnssVelEN"), ("North", "In_GnssVelEN")):
        value = lambda f: changes.fields.get(f.payload, name, field)  # noqa: E731,B023
        off = max(abs(value(a) - value(b)) for a, b in zip(frames, turned) if a.identifier == changes.fields.identifier[name])
        if off > 4:
            wrong.append(f"four quarter turns move {field} by {off} digits")
    if any(abs(float(parameters[path]) - float(image[path])) > 1e-12 for path in parameters):
        wrong.append(f"four quarter turns leave the parameters {image}")
    return wrong


def turn_without_velocities(runs, log):
    """The judge has to see velocities that do not turn with the fixes."""
    replay, changes = laws.Replay(runs.programs, runs.path("half_turned"), "rover", []), laws.Changes()
    frames = faulty_log.in_bus_time(faulty_log.read(log))
    turned, parameters = changes.turn(frames, replay.parameters, 0)
    velocity = changes.fields.identifier["In_GnssVelEN"]
    half = [a if a.identifier == velocity else b for a, b in zip(frames, turned)]
    found = laws.compared(replay.estimates("base", frames, replay.parameters), replay.estimates("turned", half, parameters), laws.IMAGES["turn"])
    return [] if found.broken or found.missing > found.epochs // 1000 else ["velocities that do not turn go unseen"]


def steps_a_tick_later():
    """The judge excuses a step that comes one tick later, no step that comes two ticks later, and no leap of one tick alone."""
    def table(leaps):
        return [{"epoch": str(k), "estimator": "0", "x_m": f"{0.02 * k + leaps(k):.3f}", "y_m": "0", "yaw_rad": "0", "time_s": f"{k / 100}",
                 "std_x_m": "0.1", "std_y_m": "0.1", "std_yaw_rad": "0.01", "pos_valid": "1"} for k in range(1, 40)]
    step = lambda at: table(lambda k: 0.5 if k >= at else 0.0)  # noqa: E731
    same = lambda pose: pose  # noqa: E731
    wrong = []
    for what, other, broken in (("one tick later", step(21), 0), ("one tick earlier", step(19), 0), ("two ticks later", step(22), 1),
                                ("beside a leap of one tick", table(lambda k: 0.5 * (k >= 20) + 0.5 * (k == 30)), 1), ("that never comes", table(lambda k: 0.0), 20)):
        found = laws.compared(step(20), other, same)
        if found.broken < broken or (broken == 0 and found.broken):
            wrong.append(f"a step {what}: {found.broken} epochs are broken")
    return wrong


class Runs:
    def __init__(self, programs, out):
        self.programs, self.out = programs, out
        os.makedirs(out, exist_ok=True)

    def path(self, name):
        return os.path.join(self.out, name)

    def simulated(self, robot, *words):
        folder = self.path("world_" + "_".join((robot, *words[1:])).replace("=", "_"))
        failure = run(os.path.join(self.programs, "tetap-world"), "--memory", "--robot", robot, "--duration", "60", "--raw", "--out", folder,
                      "--quiet", *words)
        if failure:
            sys.exit(failure)
        return os.path.join(folder, "raw.log")

    def judged(self, name, log, robot, *words):
        return run("tools/proof/check_laws", log, "--robot", robot, "--programs", self.programs, "--out", self.path(name), *words)

    def recorded(self, name, tool, robot, *words):
        """Judges a recorded drive; nothing where its data is missing."""
        if not os.path.exists(words[0]):
            return ""
        prefix = self.path(name)
        return run(os.path.join("tools/dataset", tool), *words, prefix) or self.judged("laws_" + name, prefix + ".log", robot)


def laws_runs():
    words = [word for word in sys.argv[1:] if word != "--whole"]
    whole = "--whole" in sys.argv[1:]
    runs = Runs(*words)
    rover = runs.simulated("rover")
    failures = involution(rover) + quarter_turns(rover) + turn_without_velocities(runs, rover) + steps_a_tick_later()
    mrclam = os.path.join(DATA, *MRCLAM)
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        jobs = [pool.submit(runs.judged, f"laws_{robot}", rover if robot == "rover" else runs.simulated(robot), robot) for robot in SIMULATED]
        jobs += [pool.submit(runs.recorded, f"mrclam{k}", "import_mrclam", "mrclam", mrclam, str(k)) for k in (range(1, 6) if whole else (2,))]
        if whole:
            jobs += [pool.submit(runs.recorded, "skog", "import_skog", "car", os.path.join(DATA, "skog_gnss_ins")),
                     pool.submit(runs.recorded, "px4", "import_px4", "iris", os.path.join(DATA, "px4_ecl"), "iris_gps"),
                     pool.submit(runs.recorded, "husky", "import_husky", "husky", os.path.join(DATA, "husky"))]
        failures += [failure for job in jobs if (failure := job.result())]
    failures += image_without_parameters(runs)
    print("\n".join(failures) or f"laws_runs: {len(jobs)} logs, all laws hold")
    sys.exit(1 if failures else 0)


laws_runs()
