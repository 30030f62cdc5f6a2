#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The fault matrix: promises and verdicts worked out by hand, the cells, faults in frames as canmatrix reads them, and runs of the real programs."""
import contextlib
import decimal
import functools
import io
import json
import logging
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
TOOLS = os.path.join(ROOT, "tools")
sys.path.insert(0, os.path.join(TOOLS, "python"))
sys.dont_write_bytecode = True

from tetap.proof import matrix_cells, matrix_promise, matrix_tables  # noqa: E402

PROGRAMS = os.environ.get("TETAP_PROGRAMS", os.path.join(ROOT, "build/host/sim_host"))
INJECT, MATRIX, RUN = os.path.join(PROGRAMS, "tetap-inject"), os.path.join(PROGRAMS, "tetap-matrix"), os.path.join(TOOLS, "proof/run_matrix")
DBC = os.path.join(ROOT, "config/tetap.dbc")


def facts(devices, speed=2.0, turn=True, planar=False, sigma_heading=0.05, gnss_velocity=0.05):
    return {"period_s": dict(devices), "wheels_turn": turn, "planar": planar, "speed_mps": speed, "sigma_heading_rad": sigma_heading,
            "gnss_velocity_mps": gnss_velocity}


ROVER = {"imu": 0.01, "wheels": 0.01, "gnss": 0.2, "gnss_velocity": 0.2}
CAR = {"imu": 0.01, "wheels": 0.1, "gnss": 1.0, "gnss_velocity": 1.0}
IRIS = {"imu": 0.01, "gnss": 0.2, "gnss_velocity": 0.2, "magnetometer": 0.05, "barometer": 0.1}
HUSKY = {"imu": 0.01, "wheels": 0.1, "gnss": 0.2, "gnss_velocity": 0.2, "heading": 0.2}
PLANAR = {"imu": 0.01, "wheels": 0.01, "gnss": 0.2, "gnss_velocity": 0.2, "landmarks": 0.1}

# Worked out by hand from the issue: (robot's devices, fact changes, sensor, axis, situation, gates, witnesses, promise).
PROMISES = [
    # The receiver lies about position and velocity: wheels and IMU are two devices that contradict it.
    (ROVER, {}, "gnss_both", "east", "straight", 5, ["imu", "wheels"], "held"),
    (ROVER, {}, "gnss_position", "north", "curve", 5, ["imu", "wheels"], "held"),
    (ROVER, {}, "gnss_velocity", "east", "standing", 1.5, ["imu", "wheels"], "held"),
    (ROVER, {}, "gnss_velocity", "east", "standing", 1.49, ["imu", "wheels"], "noticed"),  # below 1.5 gates
    (ROVER, {}, "gnss_velocity", "east", "standing", None, ["imu", "wheels"], "held"),  # a kind without a size
    # A height that is off: wheels see none.
    (ROVER, {}, "gnss_position", "up", "straight", 5, ["imu"], "noticed"),
    (IRIS, {}, "gnss_position", "up", "straight", 5, ["barometer", "imu"], "held"),
    (ROVER, {}, "accel", "z", "straight", 5, ["gnss"], "noticed"),
    (ROVER, {}, "accel", "z", "outage", 5, [], "blind"),
    (IRIS, {}, "accel", "z", "straight", 5, ["barometer", "gnss"], "held"),
    (IRIS, {}, "gnss_velocity", "up", "curve", 5, ["barometer", "imu"], "held"),
    # Without wheels the IMU alone contradicts the receiver.
    (IRIS, {}, "gnss_velocity", "east", "curve", 30, ["imu"], "noticed"),
    (IRIS, {}, "barometer", "pressure", "straight", 5, ["gnss", "imu"], "held"),
    (IRIS, {}, "barometer", "pressure", "outage", 5, ["imu"], "noticed"),
    # Wheels against receiver and IMU; without a receiver the IMU alone.
    (ROVER, {}, "wheels", "both", "straight", 5, ["gnss", "imu"], "held"),
    (ROVER, {}, "wheels", "both", "outage", 5, ["imu"], "noticed"),
    # At the start nothing can be integrated from: neither the IMU nor the wheels know a place.
    (ROVER, {}, "gnss_position", "east", "start", 5, [], "blind"),
    (ROVER, {}, "wheels", "both", "start", 5, ["gnss"], "noticed"),
    (ROVER, {}, "gnss_velocity", "east", "start", 5, ["wheels"], "noticed"),
    # Tilt and velocity: the receiver's velocity and the wheels.
    (ROVER, {}, "gyro", "x", "straight", 5, ["gnss", "wheels"], "held"),
    (ROVER, {}, "accel", "y", "curve", 5, ["gnss", "wheels"], "held"),
    (IRIS, {}, "gyro", "y", "straight", 5, ["gnss"], "noticed"),
    (ROVER, {}, "gyro", "x", "outage", 5, ["wheels"], "noticed"),
    (IRIS, {}, "gyro", "x", "outage", 5, [], "blind"),
    # Heading: wheels that turn; the course only where 0.05 / 2 = 0.025 rad is below the heading's sigma.
    (ROVER, {}, "gyro", "z", "straight", 5, ["gnss", "wheels"], "held"),
    (ROVER, {"sigma_heading": 0.02}, "gyro", "z", "straight", 5, ["wheels"], "noticed"),
    (ROVER, {"speed": 0.0}, "gyro", "z", "standing", 5, ["wheels"], "noticed"),
    (CAR, {"turn": False, "speed": 10.0}, "gyro", "z", "straight", 5, ["gnss"], "noticed"),
    (CAR, {"turn": False, "speed": 0.0}, "gyro", "z", "standing", 5, [], "blind"),
    (IRIS, {}, "magnetometer", "x", "straight", 5, ["gnss", "imu"], "held"),
    (IRIS, {"speed": 0.01}, "magnetometer", "x", "standing", 5, ["imu"], "noticed"),
    (HUSKY, {"speed": 0.0}, "heading", "angle", "standing", 5, ["imu", "wheels"], "held"),
    (HUSKY, {"speed": 0.0}, "gyro", "z", "standing", 5, ["heading", "wheels"], "held"),
    # One wheel hurts velocity and heading: the quantity that fewest see decides.
    (ROVER, {"speed": 0.0}, "wheels", "left", "standing", 5, ["imu"], "noticed"),
    # Whole frames and stamps of a device hurt all that it gives.
    (ROVER, {}, "frames", "gnss", "straight", None, ["imu", "wheels"], "held"),
    (CAR, {"turn": False, "speed": 0.0}, "stamps", "imu", "standing", 3, [], "blind"),
    # A planar filter has neither tilt nor velocity.
    (PLANAR, {"planar": True}, "wheels", "both", "straight", 5, ["gnss", "landmarks"], "held"),
    (PLANAR, {"planar": True}, "landmarks", "range", "curve", 5, ["imu", "wheels"], "held"),
    (PLANAR, {"planar": True, "speed": 0.0}, "landmarks", "bearing", "standing", 5, ["imu", "wheels"], "held"),
]


class Promise(unittest.TestCase):
    def test_promises_worked_out_by_hand(self):
        for devices, changes, sensor, axis, situation, gates, found, promised in PROMISES:
            with self.subTest(sensor=sensor, axis=axis, situation=situation, gates=gates, devices=sorted(devices)):
                about = facts(devices, **changes)
                self.assertEqual(matrix_promise.promise(sensor, axis, situation, gates, about), promised)
                if sensor != "landmarks":  # position and heading are seen by as many
                    self.assertEqual(matrix_promise.witnesses(sensor, axis, situation, about), found)

    def test_the_grace_follows_the_slowest_device_that_vouches(self):
        self.assertAlmostEqual(matrix_promise.allowed_s(["imu", "wheels"], facts(CAR)), 2.3)
        self.assertAlmostEqual(matrix_promise.allowed_s(["gnss", "wheels"], facts(CAR)), 5.0)
        self.assertAlmostEqual(matrix_promise.allowed_s([], facts(CAR)), 2.0)


class Usable(unittest.TestCase):
    """The mended promise, worked out by hand: the rover's receiver sends at 5 Hz, and a fault of the gyroscope lasts 3 s."""

    def seen(self, gnss, velocity, lasts=3.0, sensor="gyro", axis="x"):
        after = {"imu": 0.0, "wheels": 0.0, "gnss": gnss, "gnss_velocity": velocity}
        about = {**facts(ROVER), "lasts_s": lasts, "usable_after_s": {device: s for device, s in after.items() if s is not None}}
        return matrix_promise.witnesses(sensor, axis, "straight", about), matrix_promise.promise(sensor, axis, "straight", 5, about)

    def test_a_witness_that_sent_nothing_usable_in_the_time_of_the_fault_has_seen_nothing(self):
        self.assertEqual(self.seen(0.1, 3.0), (["gnss", "wheels"], "held"))
        self.assertEqual(self.seen(0.1, 3.1), (["wheels"], "noticed"), "a tilt shows in the velocity")
        self.assertEqual(self.seen(0.1, None), (["wheels"], "noticed"))
        self.assertEqual(self.seen(None, 0.1), (["gnss", "wheels"], "held"))
        self.assertEqual(self.seen(None, 0.1, sensor="wheels", axis="both"), (["gnss", "imu"], "held"))

    def test_a_spike_is_seen_by_the_next_three_samples(self):
        self.assertEqual(self.seen(0.1, 0.6, lasts=0.01), (["gnss", "wheels"], "held"))
        self.assertEqual(self.seen(0.1, 0.61, lasts=0.01), (["wheels"], "noticed"))

    def test_a_word_is_due_from_when_a_test_could_speak(self):
        about = {**facts(ROVER), "lasts_s": 10.0, "usable_after_s": {"wheels": 0.5, "gnss": 4.0}}
        self.assertAlmostEqual(matrix_promise.speaks_s("offset", 5, ["wheels", "gnss"], about), 0.5)
        self.assertAlmostEqual(matrix_promise.speaks_s("ramp", 5, ["wheels"], about), 2.0)
        self.assertAlmostEqual(matrix_promise.speaks_s("ramp", 0.5, ["wheels"], about), 10.0, msg="it never reaches its gate")
        self.assertAlmostEqual(matrix_promise.speaks_s("ramp", 5, ["gnss"], about), 4.0)
        self.assertAlmostEqual(matrix_promise.speaks_s("ramp", 5, ["wheels"], facts(ROVER)), 0.0, msg="by wiring alone")

    def test_a_row_has_both_promises_and_the_floor(self):
        def quantities(error, beyond=0.0):
            return figures(worst_error=error, worst_ratio=3 * error, beyond_s=beyond)
        about = {**facts(ROVER), "usable_after_s": {"imu": 0.0, "wheels": 0.0, "gnss": 0.0, "gnss_velocity": 4.0}}
        one = {**dict.fromkeys(("robot", "size", "situation"), "straight"), "sensor": "gyro", "axis": "x", "kind": "ramp", "seed": 1, "gates": 2.0, "size_value": 1.0,
               "lasts_s": 3.0, "facts": about, "said": {"Degraded": 11.4}, "quantities": quantities(2.0, 9.0), "oracle": quantities(0.5)}
        judged = matrix_promise.judged(one)
        self.assertEqual((judged["promise"], judged["witnesses"], judged["broken"]), ("noticed", ["wheels"], []), "the word is due 11.5 s after the begin")
        self.assertEqual(judged["wired"], {"promise": "held", "broken": ["beyond"]})
        self.assertNotIn("over_oracle", judged)
        about["usable_after_s"]["gnss_velocity"] = 0.1
        judged = matrix_promise.judged(one)
        self.assertEqual((judged["promise"], judged["broken"], judged["oracle_broken"]), ("held", ["beyond"], []))
        self.assertAlmostEqual(judged["over_oracle"]["position"], 4.0)
        del one["oracle"]
        self.assertNotIn("oracle_broken", matrix_promise.judged(one))


def figures(**changes):
    good = {"worst_ratio": 0.5, "worst_error": 0.5, "clean_ratio": 0.4, "clean_error": 0.4, "beyond_s": 0.0, "inside_after_s": 0.0, "valid_while_out_s": 0.0}
    return {"position": {**good, **changes}, "heading": good}


class Verdict(unittest.TestCase):
    def verdict(self, promised, said=None, **changes):
        return matrix_promise.broken(promised, figures(**changes), said or {}, 2.6)

    def test_held(self):
        self.assertEqual(self.verdict("held"), ())
        self.assertEqual(self.verdict("held", beyond_s=2.6), ())
        self.assertEqual(self.verdict("held", beyond_s=2.61), ("beyond",))
        self.assertEqual(self.verdict("held", inside_after_s=10.0), ())
        self.assertEqual(self.verdict("held", inside_after_s=10.1), ("outside",))
        self.assertEqual(self.verdict("held", inside_after_s=None), ("outside",))
        self.assertEqual(self.verdict("held", beyond_s=9.0, said={"Degraded": 1.0}), ("beyond",), "a word does not hold an estimate")

    def test_noticed(self):
        self.assertEqual(self.verdict("noticed", worst_ratio=3.0, worst_error=9.0), ())
        self.assertEqual(self.verdict("noticed", worst_ratio=3.1, worst_error=9.0), ("silent",))
        self.assertEqual(self.verdict("noticed", worst_ratio=3.1, worst_error=0.8), (), "no more than twice the clean run's")
        self.assertEqual(self.verdict("noticed", worst_ratio=30.0, worst_error=9.0, said={"Degraded": 9.9}), ())
        self.assertEqual(self.verdict("noticed", worst_ratio=30.0, worst_error=9.0, said={"Degraded": 10.1}), ("silent",))
        self.assertEqual(self.verdict("noticed", beyond_s=9.0), ())

    def test_a_valid_flag_far_out_breaks_what_is_held_and_noticed(self):
        for promised in ("held", "noticed"):
            self.assertEqual(self.verdict(promised, valid_while_out_s=2.6), ())
            self.assertEqual(self.verdict(promised, valid_while_out_s=2.7), ("valid",))

    def test_blind_is_not_judged(self):
        self.assertEqual(self.verdict("blind", worst_ratio=99.0, worst_error=99.0, beyond_s=20.0, inside_after_s=None, valid_while_out_s=20.0), ())


class Cells(unittest.TestCase):
    ABOUT = {"a": ({"In_Imu0Gyro", "In_Imu0Accel", "In_Imu0Time", "In_GnssLat", "In_GnssAcc", "In_GnssVelEN", "In_WheelCounts"}, False),
             "b": ({"In_Imu0Gyro", "In_Imu0Accel", "In_Imu0Time", "In_WheelCounts", "In_RangeBearing"}, True)}

    def test_every_kind_of_the_issue_is_there(self):
        found = {(sensor, kind) for sensor, _, kind, _ in matrix_cells.faults(self.ABOUT["a"][0], False)}
        for kind in ("offset", "spike1", "spike2", "spike10", "step", "ramp", "scale", "sign", "dead", "stuck", "not_available"):
            self.assertIn(("gyro", kind), found)
        for kind in ("delayed", "repeated", "lost", "not_available"):
            self.assertIn(("frames", kind), found)
        self.assertIn(("gnss_accuracy", "all", "scale", "x0.1"), matrix_cells.faults(self.ABOUT["a"][0], False))
        delays = [size for sensor, axis, kind, size in matrix_cells.faults(self.ABOUT["a"][0], False) if (sensor, axis, kind) == ("frames", "imu", "delayed")]
        self.assertEqual((min(delays), max(delays)), ("s0.1", "s2.1"))

    def test_a_robot_has_faults_of_what_it_is_sent_and_estimates(self):
        found = {(sensor, axis) for sensor, axis, *_ in matrix_cells.faults(self.ABOUT["b"][0], True)}
        self.assertEqual({axis for sensor, axis in found if sensor == "gyro"}, {"z"})
        self.assertFalse({sensor for sensor, _ in found} & {"accel", "gnss_position", "magnetometer"})
        self.assertIn(("landmarks", "bearing"), found)

    def test_more_cells_begin_with_the_fewer_and_are_mixed(self):
        once, twice = matrix_cells.cells(self.ABOUT, ["1"]), matrix_cells.cells(self.ABOUT, ["1", "2"])
        self.assertEqual(twice[:len(once)], once)
        self.assertEqual(len(twice), 2 * len(set(once)))
        first = once[:60]
        self.assertEqual({name.split()[0] for name in first}, {"a", "b"})
        self.assertEqual({name.split()[1] for name in first}, set(matrix_cells.SITUATIONS))

    def test_a_receiver_without_power_has_no_fault(self):
        self.assertFalse([name for name in matrix_cells.cells(self.ABOUT, ["1"]) if " outage gnss" in name or " outage frames gnss " in name])


def row(kind, broken, promise="held", size="2g", robot="rover", ratio=2.0):
    return {"robot": robot, "sensor": "gyro", "axis": "z", "kind": kind, "size": size, "situation": "curve", "seed": 1, "promise": promise, "worst_ratio": ratio,
            "broken": ["beyond"] if broken else [], "quantity": "heading"}


class Tables(unittest.TestCase):
    def test_blind_cells_do_not_count_and_spikes_are_one_kind(self):
        rows = [row("spike1", True), row("spike10", False), row("spike2", False, "blind"), row("step", False)]
        cells = {tuple(cell[:2]): cell for cell in matrix_tables.kind_rows(rows)}
        self.assertEqual(cells["gyro", "spike"][2:4], ["2", "1"])
        self.assertEqual(cells["gyro", "spike"][6], "50.0")
        self.assertEqual(cells["gyro", "spike"][9], "1")
        self.assertEqual(matrix_tables.worst_kinds(rows)[0][0], ("gyro", "spike"))

    def test_the_example_is_the_smallest_that_breaks(self):
        rows = [row("step", True, size="max"), row("step", True, size="5g", ratio=9), row("step", False, size="1g")]
        self.assertEqual(matrix_tables.smallest(rows)["size"], "5g")
        self.assertIn('--cell "rover curve gyro z step 5g 1"', matrix_tables.command(matrix_tables.smallest(rows)))

    def test_cells_that_left_held_and_the_floor_are_counted(self):
        def beside(kind, broken, oracle, over, promise="held"):
            more = {"oracle_broken": ["beyond"] if oracle else [], "over_oracle": {"position": over, "velocity": 1.0, "heading": 2.0}} if promise == "held" else {}
            return {**row(kind, broken, promise), "wired": {"promise": "held", "broken": ["outside"]}, **more}
        rows = [beside("step", True, True, 1.1), beside("step", True, False, 9.0), beside("step", False, False, 1.3), beside("ramp", False, False, 5.0, "noticed")]
        self.assertIn("1 of 4 held cells (25.0 %)", matrix_tables.left_held(rows))
        self.assertEqual(matrix_tables.of_floor(rows)[0], ["all", "3", "2", "1", "1", "1.30", "1.30", "1.00", "2.00"])
        self.assertEqual(matrix_tables.of_whole(matrix_tables.by_wiring(rows), lambda one: one["robot"])[0][:3], ["all", "4", "4"])
        for text in (matrix_tables.text(rows), matrix_tables.page(rows)):
            self.assertIn("1 of 4 held cells (25.0 %)", text)
            self.assertIn("oracle", text)
        self.assertNotIn("oracle", matrix_tables.text([row("step", True)]))

    def test_the_page_has_the_shares_and_the_smallest_example_of_the_matrix_and_the_shares_alone_of_recorded_drives(self):
        rows = [row("step", True, size="5g", ratio=9), row("step", False, size="1g"), row("spike1", False)]
        page = matrix_tables.page(rows)
        self.assertIn("33.3 % of the cells are broken", page)
        self.assertIn('--cell "rover curve gyro z step 5g 1"', page)
        recorded = matrix_tables.page(rows, recorded=True)
        self.assertTrue(recorded.startswith("# Recorded drives with one fault"))
        self.assertIn("33.3 % of the cells are broken", recorded)
        self.assertNotIn("--cell", recorded)


def database():
    logging.disable(logging.CRITICAL)  # canmatrix names the formats it has no reader for
    with contextlib.redirect_stdout(io.StringIO()):
        import canmatrix.formats
        return {frame.name: frame for frame in canmatrix.formats.loadp_flat(DBC).frames}


@unittest.skipUnless(os.access(INJECT, os.X_OK), "tetap-inject is not built")
class FaultsInFrames(unittest.TestCase):
    """A log written and read by canmatrix, which shares nothing with the program."""

    BEGIN_S, AT_S, TICKS = 1000.0, 1.0, 300

    @classmethod
    def setUpClass(cls):
        cls.frames = database()
        cls.by_id = {frame.arbitration_id.id: frame for frame in cls.frames.values()}
        cls.folder = tempfile.mkdtemp()
        cls.log = os.path.join(cls.folder, "clean.log")
        lines = []
        for i in range(cls.TICKS):
            at = cls.BEGIN_S + 0.01 * i
            stamp, seq = int(round(at * 1e6)) % (1 << 20), i % 16

            def put(name, **values):
                frame = cls.frames["In_" + name]
                signals = {signal.name: signal for signal in frame.signals}
                data = frame.encode({f"{name}_{key}": signals[f"{name}_{key}"].phys2raw(decimal.Decimal(repr(value))) for key, value in values.items()})
                lines.append(f"({at:017.6f}) vcan0 {frame.arbitration_id.id:03X}#{bytes(data).hex().upper()}\n")
            put("Imu0Gyro", AngX=0.001, AngY=-0.002, AngZ=0.0005 * (i % 3), Seq=seq)
            put("Imu0Accel", VelX=0.01, VelY=0.0, VelZ=0.098, Seq=seq)
            put("Imu0Time", Stamp=stamp, Interval=10_000, ClipGyro=0, ClipAccel=0, Temp=25, Seq=seq)
            put("WheelCounts", Stamp=stamp, Seq=seq, Inst=0, Left=(65_500 + 10 * i) % 65_536, Right=20 * i)
            if i % 20 == 0:
                put("GnssLat", Stamp=stamp, Seq=seq, Inst=0, Lat=48.0)
                put("GnssLon", Stamp=stamp, Seq=seq, Inst=0, Lon=11.0)
                put("GnssVelEN", Stamp=stamp, Seq=seq, Inst=0, East=1.5, North=-0.5)
                put("GnssAcc", Stamp=stamp, Seq=seq, Inst=0, Hor=2.0, Ver=3.0)
        with open(cls.log, "w", encoding="ascii") as file:
            file.write("".join(lines))
        cls.clean = lines

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder)

    def inject(self, fault, *more, status=0):
        out = os.path.join(self.folder, "out.log")
        done = subprocess.run([INJECT, self.log, out, "--fault", fault, "--at", str(self.AT_S), "--dbc", DBC, *more], capture_output=True, text=True)
        self.assertEqual(done.returncode, status, done.stderr)
        if status:
            return done.stderr
        with open(out, encoding="ascii") as file:
            return file.readlines()

    def read(self, lines, signal):
        """[(time, physical value or None)] of a signal."""
        message = "In_" + signal.split("_")[0]
        found = []
        for line in lines:
            at, identifier, data = re.match(r"\((\S+)\) vcan0 (\w+)#(\w*)", line).groups()
            if self.by_id[int(identifier, 16)].name != message:
                continue
            found.append((float(at) - self.BEGIN_S, self.decoded(identifier, data, signal)))
        return found

    @classmethod
    @functools.cache
    def decoded(cls, identifier, data, name):
        """None: not available."""
        frame = cls.by_id[int(identifier, 16)]
        value = frame.decode(bytes.fromhex(data))[name]
        gap = next((raw for raw, text in value.signal.values.items() if text == "NotAvailable"), None)
        return None if value.raw_value == gap else float(value.phys_value)

    def changes(self, lines, signal):
        """{time: value after minus value before} where they differ."""
        return {round(t, 3): round(after - before, 9) for (t, before), (_, after) in zip(self.read(self.clean, signal), self.read(lines, signal)) if after != before}

    def test_an_offset_of_a_rate_is_one_of_its_increments_and_of_nothing_else(self):
        lines = self.inject("gyro z offset", "--size", "0.1", "--for", "0.5")
        found = self.changes(lines, "Imu0Gyro_AngZ")
        self.assertEqual((min(found), max(found), len(found)), (1.0, 1.49, 50))
        self.assertEqual(set(found.values()), {0.001})
        others = [line for line in lines if "310#" not in line]
        self.assertTrue(others == [line for line in self.clean if "310#" not in line], "bytes of other frames")
        self.assertFalse(self.changes(lines, "Imu0Gyro_AngX"))

    def test_a_spike_has_so_many_samples(self):
        for samples in (1, 2, 10):
            found = self.changes(self.inject(f"accel x spike{samples}", "--size", "50"), "Imu0Accel_VelX")
            self.assertEqual(list(found.values()), [0.5] * samples)
        self.assertEqual(list(self.changes(self.inject("gnss_velocity east spike2", "--size", "2"), "GnssVelEN_East")), [1.0, 1.2])

    def test_a_ramp_grows_and_a_step_stays(self):
        found = self.changes(self.inject("gnss_velocity north ramp", "--size", "1", "--for", "2"), "GnssVelEN_North")
        self.assertEqual([found[round(1 + 0.2 * k, 3)] for k in (1, 5, 9)], [0.1, 0.5, 0.9])
        found = self.changes(self.inject("gnss_velocity north step", "--size", "1"), "GnssVelEN_North")
        self.assertEqual((len(found), set(found.values())), (10, {1.0}))  # to the end of the log

    def test_metres_are_degrees_of_the_place(self):
        north = self.changes(self.inject("gnss_position north offset", "--size", "100"), "GnssLat_Lat")
        self.assertAlmostEqual(next(iter(north.values())) * 111_194.9, 100, delta=1)  # 6371 km pi / 180
        east = self.changes(self.inject("gnss_position east offset", "--size", "100"), "GnssLon_Lon")
        self.assertAlmostEqual(next(iter(east.values())) * 74_403.4, 100, delta=1)  # times cos 48 deg

    def test_scale_sign_dead_stuck_and_not_available(self):
        def after(kind, *more):
            lines = self.inject(f"gyro z {kind}", "--for", "0.5", *more)
            return [value for t, value in self.read(lines, "Imu0Gyro_AngZ") if 1 <= round(t, 3) < 1.5]
        clean = [value for t, value in self.read(self.clean, "Imu0Gyro_AngZ") if 1 <= round(t, 3) < 1.5]
        for got, factor in ((after("scale", "--size", "10"), 10), (after("sign"), -1), (after("dead"), 0)):
            for one, before in zip(got, clean):
                self.assertAlmostEqual(one, factor * before, 9)
        self.assertEqual(set(after("stuck")), {clean[0]})
        self.assertEqual(set(after("not_available")), {None})

    def test_the_largest_is_what_the_frame_can_say(self):
        lines = self.inject("gyro x step", "--size", "1e6")
        self.assertEqual(max(value for _, value in self.read(lines, "Imu0Gyro_AngX")), 0.524287)

    def ways(self, lines, signal):
        counts = [int(value) for _, value in self.read(lines, signal)]
        return [(b - a + 32_768) % 65_536 - 32_768 for a, b in zip(counts, counts[1:])]

    def test_a_counter_goes_on_from_what_the_fault_has_added(self):
        around = 2 * 3.14159265 * 0.1 / 2000  # the rover's wheel
        ways = self.ways(self.inject("wheels left offset", "--size", str(100 * 5 * around), "--for", "1"), "WheelCounts_Left")
        self.assertEqual(ways[:99] + ways[200:], [10] * (99 + len(ways) - 200))
        self.assertEqual(set(ways[100:199]), {15})
        self.assertEqual(set(self.ways(self.inject("wheels both sign", "--for", "1"), "WheelCounts_Right")[100:198]), {-20})
        self.assertEqual(set(self.ways(self.inject("wheels right stuck", "--for", "1"), "WheelCounts_Right")[100:198]), {0})
        spike = self.ways(self.inject("wheels left spike1", "--size", str(100 * 7 * around)), "WheelCounts_Left")
        self.assertEqual(spike[98:102], [10, 17, 3, 10])

    def test_stamps_move_and_frames_do_not(self):
        found = self.changes(self.inject("stamps gnss offset", "--size", "0.1"), "GnssVelEN_Stamp")
        self.assertEqual({value % (1 << 20) for value in found.values()}, {100_000})
        found = self.changes(self.inject("stamps imu spike1", "--size", "-0.5"), "Imu0Time_Stamp")
        self.assertEqual([value % (1 << 20) for value in found.values()], [(1 << 20) - 500_000])

    def test_whole_frames_are_delayed_doubled_and_lost(self):
        lines = self.inject("frames imu delayed", "--size", "0.9", "--for", "0.5")
        stamps = self.read(lines, "Imu0Time_Stamp")
        self.assertEqual(len(lines), len(self.clean))
        times = [float(line[1:line.index(")")]) for line in lines]
        self.assertTrue(times == sorted(times), "in the order of their times")
        self.assertFalse([t for t, _ in stamps if 1.0 <= round(t, 3) < 1.5], "nothing comes in its own time")
        found = [(t, stamp) for t, stamp in stamps if 1.9 <= round(t, 3) < 2.4]
        late = [1 for t, stamp in found if abs((self.BEGIN_S + t) * 1e6 - stamp - 900_000 + 10) % (1 << 20) < 20]
        self.assertEqual((len(found), len(late)), (100, 50), "with those that are on time")
        self.assertEqual(len(self.inject("frames gnss repeated", "--for", "1")), len(self.clean) + 5 * 4)
        self.assertEqual(len(self.inject("frames gnss lost", "--for", "1")), len(self.clean) - 5 * 4)
        lines = self.inject("frames gnss not_available", "--for", "1")
        self.assertEqual({value for t, value in self.read(lines, "GnssVelEN_East") if 1 <= round(t, 3) < 2}, {None})
        empty = os.path.join(self.folder, "empty.log")
        with open(empty, "w", encoding="ascii") as file:
            file.writelines(lines)
        again = subprocess.run([INJECT, empty, empty + ".out", "--fault", "frames gnss not_available", "--at", "1", "--for", "1", "--dbc", DBC],
                               capture_output=True, text=True)
        self.assertEqual((again.returncode, "no frame has" in again.stderr), (1, True), "frames that carry nothing already do not count")

    def test_an_accuracy_that_is_too_good(self):
        lines = self.inject("gnss_accuracy all scale", "--size", "0.1", "--for", "1")
        self.assertEqual({value for t, value in self.read(lines, "GnssAcc_Hor") if 1 <= round(t, 3) < 2}, {0.2})

    def test_what_cannot_be_is_one_clear_error(self):
        for fault, text, *more in (("gyro w offset", "gyro: no axis 'w'; there are: x y z"), ("gyro z wild", "no kind of fault 'wild'; there are: offset spike "),
                                   ("gyro z", "--fault needs \"SENSOR AXIS KIND\", not 'gyro z'"), ("gyro z spike", "as in spike2"), ("gyro z spikes", "as in spike2"),
                                   ("radar z dead", "no sensor 'radar'; there are: gyro accel "), ("frames radar lost", "frames: no device 'radar'; there are: imu wheels "),
                                   ("frames imu delayed", "a delay needs --size, in s"),
                                   ("frames imu offset", "frames: no kind 'offset'; there are: delayed "), ("gyro z lost", "gyro: no kind 'lost'; there are: offset "),
                                   ("gyro z dead", "no robot 'tank'; there are: all_round car ", "--robot", "tank"),
                                   ("gyro z dead", "--at is 3.500 s: " + self.log + " ends 2.990 s after its begin", "--at", "3.5"),
                                   ("gyro z dead", self.log + ": no input frames of this id base", "--base", "0x400")):
            message = self.inject(fault, *more, status=2)
            self.assertTrue(message.startswith("tetap-inject: " + text) or text in message, message)
            self.assertEqual(message.count("\n"), 1)
        message = self.inject("barometer pressure offset", status=1)
        self.assertIn(f"{self.log}: no frame has 'barometer pressure offset' from 1.000 s to 4.000 s; nothing is written", message)

    def test_what_fails_leaves_no_file(self):
        out = os.path.join(self.folder, "none.log")
        for words in (["--fault", "barometer pressure offset", "--at", "1"], ["--fault", "gyro z dead", "--at", "9"], ["--fault", "gyro z wild", "--at", "1"]):
            self.assertNotEqual(subprocess.run([INJECT, self.log, out, "--dbc", DBC, *words], capture_output=True).returncode, 0)
            self.assertEqual([name for name in os.listdir(self.folder) if name.startswith("none")], [])
        # A disk that is full: the shell's limit on the size of a file.
        with open(out, "w", encoding="ascii") as file:
            file.write("old")
        limited = ["bash", "-c", 'trap "" XFSZ; ulimit -f 10; exec "$@"', "bash", INJECT, self.log, out, "--dbc", DBC, "--fault", "gyro z dead", "--at", "1"]
        done = subprocess.run(limited, capture_output=True, text=True)
        self.assertEqual((done.returncode, done.stderr), (2, f"tetap-inject: {out}: cannot be written: File too large\n"))
        self.assertEqual([name for name in os.listdir(self.folder) if name.startswith("none")], ["none.log"])
        with open(out, encoding="ascii") as file:
            self.assertEqual(file.read(), "old")
        os.remove(out)

    def test_every_sensor_axis_and_kind_of_the_help_is_known(self):
        text = subprocess.run([INJECT, "--help"], capture_output=True, text=True, check=True).stdout
        sensors = re.findall(r"^  (\w+) +([a-z ]+)$", text.split("sensors and their axes:\n")[1], re.M)
        values, frames = (re.search(start + r".*: ([a-z_ ]+)$", text, re.M)[1].split() for start in (r"kinds \(", "kinds of frames"))
        self.assertEqual((len(sensors), len(values), len(frames)), (15, 9, 4))
        for sensor, axes in sensors:
            for axis in axes.split():
                for kind in frames if sensor == "frames" else values:
                    kind = "spike2" if kind == "spike" else kind
                    done = subprocess.run([INJECT, self.log, "/dev/null", "--fault", f"{sensor} {axis} {kind}", "--at", "1", "--size", "0.5", "--dbc", DBC], capture_output=True, text=True)
                    self.assertIn(done.returncode, (0, 1), done.stderr)

    def test_the_time_is_that_of_the_robot_from_the_begin_on(self):
        """A log in lockstep is received faster than the robot's time; In_Sync gives it, and it does not begin at 0."""
        path, out = os.path.join(self.folder, "fast.log"), os.path.join(self.folder, "fast_out.log")
        lines, received = [], 5_000_000.0
        for line in self.clean:
            at = float(line[1:line.index(")")])
            if "310#" in line:  # the first frame of a tick
                time_us = round(at * 1e6) - round(self.BEGIN_S * 1e6) + 77_000_000
                lines.append(f"({received:017.6f}) vcan0 300#{(time_us | 1 << 56).to_bytes(8, 'little').hex().upper()}\n")
            received += 1e-6
            lines.append(f"({received:017.6f}) {line.split(' ', 1)[1]}")
        with open(path, "w", encoding="ascii") as file:
            file.writelines(lines)

        def changed(*words):
            done = subprocess.run([INJECT, path, out, "--dbc", DBC, *words], capture_output=True, text=True)
            self.assertEqual(done.returncode, 0, done.stderr)
            with open(out, encoding="ascii") as file:
                return file.readlines()
        after = changed("--fault", "gyro z offset", "--size", "0.1", "--at", "1", "--for", "0.5")
        differ = [k for k, (a, b) in enumerate(zip(lines, after)) if a != b]
        gyro = [k for k, line in enumerate(lines) if " 310#" in line]
        self.assertEqual((len(after), differ), (len(lines), gyro[100:150]))
        late = changed("--fault", "frames imu delayed", "--size", "0.5", "--at", "1", "--for", "0.01")
        self.assertEqual(sorted(line.split()[2] for line in late), sorted(line.split()[2] for line in lines))
        times = [line.split()[0] for line in late]
        self.assertEqual(times, sorted(times))
        stamps = [k for k, line in enumerate(lines) if " 312#" in line]  # each of its own
        moved = [line.split()[2] for line in late].index(lines[stamps[100]].split()[2])
        self.assertLess(abs(late.index(lines[stamps[150]]) - moved), 8)
        done = subprocess.run([INJECT, path, out, "--dbc", DBC, "--fault", "gyro z dead", "--at", "77"], capture_output=True, text=True)
        self.assertEqual((done.returncode, done.stderr), (2, f"tetap-inject: --at is 77.000 s: {path} ends 2.990 s after its begin, by In_Sync\n"))

    def test_two_runs_in_one_log_are_named(self):
        """A node that began anew: its epochs go back, and the second run has no robot time of its own."""
        path, out = os.path.join(self.folder, "two.log"), os.path.join(self.folder, "two_out.log")
        epoch = self.frames["Est_Epoch"].arbitration_id.id
        lines = []
        for run in range(2):
            for line in self.clean:
                at = float(line[1:line.index(")")]) + 5 * run
                if "310#" in line:
                    lines.append(f"({at:017.6f}) vcan0 {epoch:03X}#{round((at - 5 * run - self.BEGIN_S + 7) * 1e6).to_bytes(8, 'little').hex().upper()}\n")
                lines.append(f"({at:017.6f}) {line.split(' ', 1)[1]}")
        with open(path, "w", encoding="ascii") as file:
            file.writelines(lines)

        def injected(*words):
            return subprocess.run([INJECT, path, out, "--fault", "gyro z offset", "--size", "0.1", "--dbc", DBC, *words], capture_output=True, text=True)
        done = injected("--at", "1", "--for", "0.5")
        named = f"{path}: Est_Epoch goes back by 2.990 s at 2.990 s after the begin. The log may hold two runs. "
        self.assertEqual((done.returncode, done.stderr), (0, f"tetap-inject: warning: {named}The fault is in the first one\n"))
        with open(out, encoding="ascii") as file:
            after = file.readlines()
        gyro = [k for k, line in enumerate(lines) if " 310#" in line]
        self.assertEqual([k for k, (a, b) in enumerate(zip(lines, after)) if a != b], gyro[100:150])
        os.remove(out)
        done = injected("--at", "2.5", "--for", "5")
        self.assertEqual((done.returncode, done.stderr), (2, f"tetap-inject: {named}The fault would last until the second one; split the log\n"))
        self.assertFalse(os.path.exists(out))

    def test_a_last_line_without_newline_is_taken_whole_or_named(self):
        path, out = os.path.join(self.folder, "cut.log"), os.path.join(self.folder, "cut_out.log")
        text = "".join(self.clean)
        for cut, said in ((1, ""), (5, f"tetap-inject: warning: {path}:{len(self.clean)}: the last line is cut off and left out: ")):
            with open(path, "w", encoding="ascii") as file:
                file.write(text[:-cut])
            done = subprocess.run([INJECT, path, out, "--fault", "gyro x offset", "--size", "1", "--at", "1", "--dbc", DBC], capture_output=True, text=True)
            self.assertEqual((done.returncode, done.stderr[:len(said)], done.stderr.count("\n")), (0, said, bool(said)))
            with open(out, encoding="ascii") as file:
                self.assertEqual(len(file.readlines()), len(self.clean) - bool(said))


@unittest.skipUnless(os.access(MATRIX, os.X_OK), "tetap-matrix is not built")
class Runs(unittest.TestCase):
    def setUp(self):
        self.out = tempfile.mkdtemp()

    def tearDown(self):
        shutil.rmtree(self.out)

    def run_matrix(self, *more, status=0):
        done = subprocess.run([sys.executable, RUN, "--out", self.out, "--robots", "rover", "--jobs", "2", *more], capture_output=True, text=True)
        self.assertEqual(done.returncode, status, done.stdout + done.stderr)
        return done

    def test_a_cell_without_an_effect_is_the_clean_run(self):
        """Frames that come twice are the clean run to the bit; a cell from the fork sees the same drive."""
        cells = "start frames gnss repeated -\nstart frames imu repeated -\nstart gnss_velocity east step 30g\n"
        done = subprocess.run([MATRIX, "--dbc", DBC], input=cells, capture_output=True, text=True, check=True)
        rows = {(row["axis"], row["kind"]): row for row in map(json.loads, done.stdout.splitlines())}
        for axis in ("gnss", "imu"):
            row = rows[axis, "repeated"]
            self.assertGreater(row["changed"], 0)
            for quantity in row["quantities"].values():
                self.assertGreater(quantity["worst_ratio"], 0)
                self.assertLessEqual(quantity["worst_error"], quantity["clean_error"])
        step = rows["east", "step"]
        self.assertAlmostEqual(step["gates"], 30, delta=0.2)
        self.assertNotEqual(step["quantities"]["velocity"]["worst_error"], step["quantities"]["velocity"]["clean_error"])

    def test_the_oracle_of_a_device_that_is_silent_is_the_cell_itself(self):
        cells = "start frames gnss lost -\nstart gnss_velocity east step 30g\n"
        done = subprocess.run([MATRIX, "--dbc", DBC, "--oracle"], input=cells, capture_output=True, text=True, check=True)
        lost, step = sorted(map(json.loads, done.stdout.splitlines()), key=lambda row: row["sensor"])
        self.assertGreater(lost["changed"], 0)
        self.assertEqual(lost["quantities"], lost["oracle"])
        self.assertNotEqual(step["quantities"], step["oracle"])
        self.assertEqual(sorted(step["facts"]["usable_after_s"]), sorted(step["facts"]["period_s"]), "the rover's receiver has a fix at its start")

    def test_seeds_have_so_many_cells_each(self):
        self.run_matrix("--only", "start", "--seeds", "6", "8", "--cells", "2", "--oracle")
        with open(os.path.join(self.out, "matrix.json"), encoding="utf-8") as file:
            rows = json.load(file)
        self.assertEqual([row["seed"] for row in rows], [6, 6, 8, 8])
        self.assertEqual([row["axis"] for row in rows[:2]], [row["axis"] for row in rows[2:]])
        self.assertTrue(all(("oracle_broken" in row) == (row["promise"] == "held") for row in rows))

    def test_a_run_goes_on_where_it_was(self):
        self.run_matrix("--only", "start", "--cells", "4")
        def results():
            return {os.path.join(where, name): os.stat(os.path.join(where, name)).st_mtime_ns for where, _, names in os.walk(os.path.join(self.out, "shards")) for name in names if len(name) == 64}

        made = results()
        self.assertEqual(len(made), 1)
        self.run_matrix("--only", "start", "--cells", "40")
        self.assertEqual(len(results()), 4, "a shard of four cells, and three of forty")
        self.assertLessEqual(made.items(), results().items())
        self.run_matrix("--only", "start", "--cells", "4")
        with open(os.path.join(self.out, "matrix.json"), encoding="utf-8") as file:
            rows = json.load(file)
        for key in "robot sensor axis kind size situation seed promise worst_ratio beyond_s clean_ratio inside_after_s valid_while_out_s said".split():
            self.assertIn(key, rows[0])
        self.assertTrue(os.path.getsize(os.path.join(self.out, "matrix.png")) > 10_000)

    def test_a_list_of_broken_cells_holds_from_both_sides(self):
        listed = os.path.join(self.out, "broken.txt")
        with open(listed, "w", encoding="utf-8") as file:
            file.write("rover curve gyro z step 99g 1\n")
        done = self.run_matrix("--only", "start", "--cells", "3", "--expect", listed, status=1)
        self.assertIn("keeps its promise: rover curve gyro z step 99g 1", done.stdout)
        self.run_matrix("--only", "start", "--cells", "3", "--expect", listed, "--accept")
        with open(listed, encoding="utf-8") as file:
            self.assertNotIn("99g", file.read())


if __name__ == "__main__":
    unittest.main()
