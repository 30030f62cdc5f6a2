#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Replay from C and Python (sim_host/c_api/tetap_replay.h, tools/python/tetap): the test in C, tetap-play's state to the bit, ticks of one's own, what
is refused, and the examples in a venv without a network."""
import glob
import json
import os
import subprocess
import sys
import tempfile
import unittest

import numpy as np

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
sys.dont_write_bytecode = True
sys.path.insert(0, os.path.join(ROOT, "tools", "python"))
import tetap  # noqa: E402
from tetap.can import columns  # noqa: E402

PROGRAMS = os.environ.get("TETAP_PROGRAMS", os.path.join(ROOT, "build", "host", "sim_host"))
NUMBER = {"gnss.sigma_floor_m": 2.5}


def run(*words, **more):
    return subprocess.run(words, capture_output=True, text=True, timeout=300, check=False, **more)


class ReplayLibraryTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.folder.cleanup)
        out = os.path.join(cls.folder.name, "drive")
        made = run(os.path.join(PROGRAMS, "tetap-world"), "--memory", "--robot", "rover", "--duration", "40", "--raw", "--quiet", "--out", out)
        assert made.returncode == 0, made.stderr
        cls.log = os.path.join(out, "raw.log")

    def played(self, *words):
        """run.json of tetap-play."""
        out = os.path.join(self.folder.name, "play")
        run(os.path.join(PROGRAMS, "tetap-play"), self.log, "--memory", "--robot", "rover", "--quiet", "--out", out, *words)
        with open(os.path.join(out, "run.json"), encoding="utf-8") as file:
            return json.load(file)

    def test_the_interface_from_c11(self):
        program, library = os.path.join(self.folder.name, "replay_test"), os.path.join(PROGRAMS, "c_api")
        built = run("gcc", "-std=c11", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wstrict-prototypes", "-Werror", "-I" + ROOT, "-o", program,
                    os.path.join(ROOT, "test", "c_api", "replay_test.c"), "-L" + library, "-ltetap_replay", "-Wl,-rpath," + library)
        self.assertEqual((built.returncode, built.stderr), (0, ""))
        done = run(program, self.log)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        names = run("nm", "-D", "--defined-only", os.path.join(library, "libtetap_replay.so")).stdout
        self.assertEqual(sorted(line.split()[-1] for line in names.splitlines() if not line.split()[-1].startswith("tetap_replay_")), [])

    def test_a_record_is_repeated_to_the_bit(self):
        again, recorded = tetap.replay(self.log, "rover"), tetap.decode(self.log)
        self.assertEqual((again.recorded, again.different, again.compared, again.complaint), (1, 0, again.epochs, ""))
        self.assertEqual("%08X" % again.state_crc, self.played()["state_crc_last"])
        for name in ("Est0_Pos", "Est2_Pos", "Est2_Motion", "Est2_Att", "Est_Status", "Est_Innov", ("Est2_Std", "Pose"), ("Est2_State", "Height")):
            self.assertGreater(len(again[name]), 10)
            for signal in again[name].signals:
                np.testing.assert_array_equal(again[name][signal.field], recorded[name][signal.field], f"{name} {signal.field}")
        np.testing.assert_array_equal(again["Est_Epoch"].time_s, again["Est_Epoch"].Time * 1e-6)

    def test_another_number_gives_what_tetap_play_gives(self):
        other = tetap.replay(self.log, "rover", set=NUMBER, mode="inputs")
        path, value = next(iter(NUMBER.items()))
        judge = self.played("--lockstep", "--set", f"{path}={value}")
        self.assertEqual(("%08X" % other.state_crc, other.epochs, other.frames_in), (judge["state_crc_last"], judge["epochs"], judge["frames_in"]))
        self.assertNotEqual(other.state_crc, tetap.replay(self.log, "rover").state_crc)
        self.assertEqual(tetap.parameters("rover", NUMBER)[path], value)
        stated = json.loads(run(os.path.join(PROGRAMS, "tetap-params"), "--robot", "rover", "--json").stdout)
        self.assertEqual(tetap.parameters("rover"), {row["path"]: row["value"] for row in stated["parameters"]})

    def test_a_log_says_with_which_parameters_its_node_began(self):
        """A record of a robot that is built with another radius, and the same as of a board that kept this radius: one word is told behind the begin."""
        path, out = "wheels.drive.left_radius_m", os.path.join(self.folder.name, "kept")
        with open(os.path.join(ROOT, "test/param/indices.txt"), encoding="ascii") as file:
            row = int({line.split()[1]: line.split()[0] for line in file if line.startswith("0x")}[path], 16)
        made = run(os.path.join(PROGRAMS, "tetap-world"), "--memory", "--robot", "mrclam", "--duration", "25", "--raw", "--quiet", "--set", path + "=0.05", "--out", out)
        self.assertEqual(made.returncode, 0, made.stderr)
        built = os.path.join(out, "raw.log")
        with open(built, encoding="ascii") as file:
            lines = file.readlines()
        at = next(i for i, line in enumerate(lines) if " 348#1D3E0000" in line)  # Est_Param behind the begin: no word is not as compiled

        def kept(radius):
            log, value = os.path.join(out, f"kept_{radius}.log"), int.from_bytes(np.float32(radius).tobytes(), "little")
            identifier, data = tetap.encode("Est_Param", Kind="Row", RowSource="Active", RowWord=0, RowId=row, RowAnswer="Done", RowCtr="NotAvailable", RowValue=value)
            words = [lines[at].replace("#1D3E0000", "#1D3E0001"), f"{lines[at].split('#')[0][:-3]}{identifier:X}#{data.hex().upper()}\n"]
            with open(log, "w", encoding="ascii") as file:
                file.writelines(lines[:at] + words + lines[at + 1:])
            return log
        again, expected, without = tetap.replay(kept(0.05), "mrclam"), tetap.replay(built, "mrclam", set={path: 0.05}), tetap.replay(built, "mrclam")
        self.assertEqual((again.began_with, expected.began_with, expected.different), (f"{path}=0.05", "", 0))
        np.testing.assert_array_equal(again["Est_StateCrc"].Crc, expected["Est_StateCrc"].Crc)
        self.assertGreater(np.count_nonzero(without["Est_StateCrc"].Crc != expected["Est_StateCrc"].Crc), 1000)
        own = {path: 0.06}  # what the user sets stays
        np.testing.assert_array_equal(tetap.replay(kept(0.05), "mrclam", set=own)["Est_StateCrc"].Crc, tetap.replay(built, "mrclam", set=own)["Est_StateCrc"].Crc)
        with self.assertRaisesRegex(tetap.BadInput, f"kept_500.log: its node began with {path}=500.*; the node refuses the parameters"):
            tetap.replay(kept(500), "mrclam")

    def test_ticks_of_ones_own_make_the_same_states(self):
        recorded, expected = tetap.decode(self.log), tetap.replay(self.log, "rover", mode="inputs")["Est_StateCrc"].Crc
        sync = recorded["In_Sync"]
        ticks = {at: time for at, time, kind in zip(sync.at.tolist(), sync.Time.tolist(), sync.names("Kind")) if kind in ("Tick", "Step")}
        frames, pending = recorded.frames, []
        with tetap.Node("rover") as one, tetap.Node("rover", set=NUMBER) as other:  # two in turn share nothing
            for k, (identifier, word) in enumerate(zip(frames.id.tolist(), frames.word.tolist())):
                pending.append((identifier, word.to_bytes(8, "little")))
                if k in ticks:
                    for node in (one, other):
                        node.push(pending)
                        node.tick(ticks[k] * 1e-6)
                    pending = []
            mine, its = tetap.Messages(one.read()), tetap.Messages(other.read())
        self.assertGreater(len(ticks), 1000)
        np.testing.assert_array_equal(mine["Est_StateCrc"].Crc, expected)
        self.assertNotEqual(its["Est_StateCrc"].Crc[-1], expected[-1])

    def test_what_is_wrong_is_named(self):
        cases = ((lambda: tetap.replay(self.log, "tractor"), "no robot 'tractor'"), (lambda: tetap.replay("nowhere.log", "rover"), "nowhere.log: No such file"),
                 (lambda: tetap.replay(self.log, "rover", set={"gnss.sigma_floor_m": -1}), "gnss.sigma_floor_m is -1 m; it has to be from"),
                 (lambda: tetap.replay(self.log, "rover", mode="backwards"), "no mode 'backwards'"), (lambda: tetap.encode("In_WheelCounts", Left=70000), "Left: 70000 is out of range"),
                 (lambda: tetap.replay(self.log, "rover", set={"can_base": 0x480}), "no input frames of this id base"),
                 (lambda: tetap.Node("rover").push([(0x306, bytes(9))]), "9 bytes"), (lambda: tetap.record(self.folder.name, 1, "nocan0"), "nocan0"))
        for act, message in cases:
            with self.assertRaises(tetap.BadInput) as caught:
                act()
            self.assertIn(message, str(caught.exception))
        node = tetap.Node("rover")
        node.close()
        with self.assertRaisesRegex(tetap.BadInput, "closed"):
            node.tick(1)

    def test_frames_and_findings(self):
        identifier, data = tetap.encode("In_GnssAcc", base=0x340, stamp_s=0.5, Inst=1, Seq=2, Hor=1.5, Ver="NotAvailable")
        frames = np.array([(0, identifier, 8, 0, np.frombuffer(data, np.uint8))], [("time_us", "i8"), ("id", "u4"), ("size", "u1"), ("extended", "u1"), ("data", "u1", 8)])
        found = tetap.Messages(columns.from_array(frames), 0x340)["In_GnssAcc"]
        self.assertEqual((found.Stamp[0], found.Inst[0], found.Hor[0], bool(np.isnan(found.Ver[0]))), (500_000, 1, 1.5, True))
        self.assertEqual(tetap.doctor(self.log, "rover"), [])
        wrong = tetap.doctor(self.log, "rover", set={"wheels.drive.left_radius_m": 0.25, "wheels.drive.right_radius_m": 0.25})
        self.assertEqual([(one["code"], one["rank"]) for one in wrong], [("wheel_scale", 1)])

    def test_examples_run_in_a_venv_without_a_network(self):
        venv = os.path.join(self.folder.name, "venv")
        self.assertEqual(run(sys.executable, "-m", "venv", "--system-site-packages", "--without-pip", venv).returncode, 0)
        python, out = os.path.join(venv, "bin", "python"), os.path.join(self.folder.name, "run.mcap")
        examples = {"sweep": [self.log, "rover", "gnss.sigma_floor_m", "0.5", "2.5"], "refused": [self.log], "own_loop": [],
                    "to_ros": [self.log, "rover", "gnss.sigma_floor_m", "2.5", out]}
        there = {os.path.basename(path)[:-3] for path in glob.glob(os.path.join(ROOT, "tools/python/examples/*.py"))}
        self.assertEqual(there, set(examples))
        for name, words in examples.items():
            done = run(python, os.path.join(ROOT, "tools/python/examples", name + ".py"), *words,
                       env={"PATH": os.environ["PATH"], "PYTHONPATH": os.path.join(ROOT, "tools", "python"), "PYTHONDONTWRITEBYTECODE": "1", "TETAP_PROGRAMS": PROGRAMS})
            self.assertEqual((done.returncode, done.stderr), (0, ""), name)
            self.assertTrue(done.stdout.strip(), name)
            with open(os.path.join(ROOT, "tools/python/examples", name + ".py"), encoding="utf-8") as file:
                self.assertLessEqual(len([line for line in file if line.strip() and not line.startswith(("#", '"""', "import"))]), 10, name)


if __name__ == "__main__":
    unittest.main()
