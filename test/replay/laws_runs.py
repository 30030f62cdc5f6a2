#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Laws that need no truth, on simulated and recorded drives: laws_runs.py PROGRAMS OUT [--whole]. tools/proof/check_laws judges each log. The judge is
judged, too: a mirror image of a mirror image is the log itself, and a robot whose parameters are not mirrored breaks the law. The short form has a
minute of four robots and one MRCLAM drive, the whole one all recorded drives. Needs $TETAP_DATA (default ../shared/data) for the recorded ones."""
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
BROKEN = (("skog", "imu_stamps"),)  # docs/validation/shortfalls.md, "On recorded data"


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
        without = [law for law in laws.LAWS if (name, law) not in BROKEN]
        return (run(os.path.join("tools/dataset", tool), *words, prefix)
                or self.judged("laws_" + name, prefix + ".log", robot, "--laws", ",".join(without)))


def laws_runs():
    words = [word for word in sys.argv[1:] if word != "--whole"]
    whole = "--whole" in sys.argv[1:]
    runs = Runs(*words)
    rover = runs.simulated("rover")
    failures = involution(rover)
    mrclam = os.path.join(DATA, *MRCLAM)
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        jobs = [pool.submit(runs.judged, f"laws_{robot}", rover if robot == "rover" else runs.simulated(robot), robot) for robot in SIMULATED]
        jobs += [pool.submit(runs.recorded, f"mrclam{k}", "import_mrclam", "mrclam", mrclam, str(k)) for k in (range(1, 6) if whole else (2,))]
        if whole:
            jobs += [pool.submit(runs.recorded, "skog", "import_skog", "car", os.path.join(DATA, "skog_gnss_ins")),
                     pool.submit(runs.recorded, "husky", "import_husky", "husky", os.path.join(DATA, "husky"))]
        failures += [failure for job in jobs if (failure := job.result())]
    failures += image_without_parameters(runs)
    print("\n".join(failures) or f"laws_runs: {len(jobs)} logs, all laws hold")
    sys.exit(1 if failures else 0)


laws_runs()
