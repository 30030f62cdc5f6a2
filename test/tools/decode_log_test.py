#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""tools/can/decode_log takes the lines that the player takes (test/host/log_lines.txt), and its tables have the numbers of canmatrix."""
import contextlib
import csv
import io
import math
import os
import re
import subprocess
import sys
import tempfile
import unittest

sys.dont_write_bytecode = True
ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))
sys.path.insert(0, os.path.join(ROOT, "tools", "python"))
from tetap.can import decoder  # noqa: E402
with contextlib.redirect_stdout(io.StringIO()):  # canmatrix reports missing optional formats when imported
    import canmatrix.formats

TOOL = os.path.join(ROOT, "tools", "can", "decode_log")
WORDS = {"remote request": "remote", "error frame": "error", "CAN FD": "fd", "CAN XL": "xl"}
FRAMES = """In_GnssLat Inst=0 Seq=3 Lat=48.001106064 --time 1.5
In_WheelCounts Inst=1 Seq=4 Left=65535 Right=7 --time 1.6
In_BodySpeed Inst=0 Seq=5 Forward=-2.5 --time 1.7
Cmd_SetYaw Yaw=-0.5 StdYaw=0.05 --time 1.8
"""


def decode(*arguments, text=""):
    return subprocess.run((TOOL, *arguments), input=text, capture_output=True, text=True, timeout=60)


def log():
    return subprocess.run((os.path.join(ROOT, "tools", "can", "encode_frame"), "-"), input=FRAMES, capture_output=True, text=True, check=True, timeout=60).stdout


def verdict(line):
    try:
        found = decoder.parse(line.encode())
    except decoder.Malformed:
        return "bad"
    if found is None:
        return "heading"
    if found[3] is None:
        return WORDS[found[4].partition(",")[0]]
    return "data %s %s" % (found[2].decode().upper(), found[3].hex().upper())


class Lines(unittest.TestCase):
    def test_the_table_of_lines_holds(self):
        with open(os.path.join(ROOT, "test", "host", "log_lines.txt"), encoding="utf-8") as file:
            cases = [line.rstrip("\n").split("\t", 1) for line in file if not line.startswith("#")]
        self.assertGreaterEqual(len(cases), 85)
        self.assertEqual([(verdict(line), line) for _, line in cases], [(kind, line) for kind, line in cases])

    def test_an_asc_in_base_dec_is_read_after_its_heading(self):
        frame = "   0.250000 1  778             Rx   d 8 9 0 205 0 0 0 0 0\n"
        self.assertIn("30A In_GnssLat", decode(text="base dec  timestamps absolute\n" + frame).stdout)
        self.assertNotIn("In_GnssLat", decode(text=frame).stdout)


class Table(unittest.TestCase):
    def test_every_signal_is_a_row_with_the_value_that_canmatrix_reads(self):
        done = decode("--csv", text=log())
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        rows = list(csv.DictReader(io.StringIO(done.stdout)))
        source = {frame.arbitration_id.id: frame for frame in canmatrix.formats.loadp_flat(os.path.join(ROOT, "config", "tetap.dbc"), dbcImportEncoding="ascii").frames}
        count = 0
        for time, identifier, payload in re.findall(r"\((\d+\.\d+)\) vcan0 (\w+)#(\w+)", log()):
            frame = source[int(identifier, 16)]
            for name, value in frame.decode(bytes.fromhex(payload)).items():
                row = next(r for r in rows if r["id"] == identifier and frame.name.split("_", 1)[1] + "_" + r["signal"] == name)
                self.assertEqual((row["message"], float(row["time_s"]), row["interface"]), (frame.name, float(time), "vcan0"))
                if value.signal.values.get(int(value.raw_value)) == "NotAvailable":
                    self.assertEqual(row["value"], "")
                elif name == "SetYaw_Crc":
                    self.assertEqual(int(row["value"], 16), value.raw_value)
                else:
                    self.assertTrue(math.isclose(float(row["value"]), float(value.phys_value), abs_tol=1e-12), (row, value.phys_value))
                    self.assertEqual(row["unit"], "" if value.signal.unit == "1" else value.signal.unit)
                count += 1
        self.assertEqual(count, len(rows))

    def test_a_message_alone_has_a_row_a_frame(self):
        rows = list(csv.DictReader(io.StringIO(decode("--csv", "--message", "In_BodySpeed", text=log()).stdout)))
        self.assertEqual(len(rows), 1)
        self.assertEqual((rows[0]["Forward [m/s]"], rows[0]["YawRate [rad/s]"], rows[0]["Seq"]), ("-2.5000", "", "5"))

    def test_a_wrong_frame_is_named_and_left_out(self):
        lines = log().splitlines()
        broken = lines[3][:-1] + ("0" if lines[3][-1] != "0" else "1")
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "x.log")
            with open(path, "w", encoding="utf-8") as file:
                file.write("\n".join(lines[:1] + [broken, "(1.9) vcan0 30A#11"]) + "\n")
            done = decode("--csv", path)
        self.assertEqual(done.returncode, 1)
        self.assertRegex(done.stderr, r"x\.log:2: Cmd_SetYaw: its CRC is wrong\n.*x\.log:3: In_GnssLat has 1 bytes, not 8\n$")
        self.assertNotIn("SetYaw", done.stdout)
        self.assertIn("no message 'In_Nothing'; there are: ", decode("--csv", "--message", "In_Nothing").stderr)


if __name__ == "__main__":
    unittest.main()
