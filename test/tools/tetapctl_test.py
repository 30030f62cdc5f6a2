#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""tetapctl over an slcan adapter: a pseudo-terminal, whose other end speaks the protocol of Lawicel's manual and has a node of mrclam behind it, five times as
fast as time. One frame in 300 is lost. A claim, and what is refused."""
import json
import os
import stat
import subprocess
import sys
import tempfile
import threading
import time
import tty
import unittest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
sys.dont_write_bytecode = True
sys.path.insert(0, os.path.join(ROOT, "tools", "python"))
import tetap  # noqa: E402

PROGRAMS = os.environ.get("TETAP_PROGRAMS", os.path.join(ROOT, "build", "host", "sim_host"))
OPEN = {"loop.lockstep": 2}  # a node in this process is a player's


class Adapter(threading.Thread):
    def __init__(self, refuses=""):
        super().__init__(daemon=True)
        self.here, there = os.openpty()
        tty.setraw(there)
        os.set_blocking(self.here, False)
        self.there, self.port, self.refuses = there, os.ttyname(there), refuses
        self.count, self.ends, self.open = 0, False, False

    def lost(self):
        self.count += 1
        return self.count % 300 == 0

    def commands(self, text):
        """Frames of whole lines; each line is answered."""
        frames, answer = [], b""
        for line in text:
            if line[:1] == b"t":
                size = int(line[4:5])
                frames.append((int(line[1:4], 16), bytes.fromhex(line[5:5 + 2 * size].decode())))
                answer += b"z\r"
            elif line:
                self.open = line == b"O" or (self.open and line != b"C")
                answer += b"\a" if line[:1].decode() == self.refuses else b"\r"
        self.write(answer)
        return [frame for frame in frames if not self.lost()]

    def write(self, data):
        while data and not self.ends:
            try:
                data = data[os.write(self.here, data):]
            except BlockingIOError:
                time.sleep(0.001)

    def run(self):
        rest, now_s = b"", 0.0
        with tetap.Node("mrclam", set=OPEN) as node:
            while not self.ends:
                began, frames = time.monotonic(), []
                try:
                    *lines, rest = (rest + os.read(self.here, 65536)).split(b"\r")
                    frames = self.commands(lines)
                except (BlockingIOError, OSError):
                    pass
                now_s += 0.01
                node.push(frames)
                node.tick(now_s)
                sent = node.read()
                out = [(identifier, word.to_bytes(8, "little")) for identifier, word in zip(sent.id.tolist(), sent.word.tolist())]
                stamp = b"%04X" % (int(now_s * 1000) % 60000) if int(now_s) % 2 else b""  # with and without a time
                self.write(b"".join(b"t%03X%d%s%s\r" % (i, len(d), d.hex().upper().encode(), stamp) for i, d in out if self.open and not self.lost()))
                time.sleep(max(0.0, 0.002 - (time.monotonic() - began)))

    def stop(self):
        self.ends = True
        self.join()
        os.close(self.here)
        os.close(self.there)


class Tetapctl(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def path(self, name):
        return os.path.join(self.folder.name, name)

    def adapter(self, refuses=""):
        adapter = Adapter(refuses)
        adapter.start()
        self.addCleanup(adapter.stop)
        return adapter

    def said(self, adapter, *words, status=0, key=None):
        environment = {name: value for name, value in os.environ.items() if name != "TETAP_KEY"}
        done = subprocess.run([os.path.join(PROGRAMS, "tetapctl"), "--slcan", getattr(adapter, "port", adapter), "--json", *words], capture_output=True, text=True, timeout=120,
                              check=False, env=environment | ({"TETAP_KEY": key} if key else {}))
        self.assertEqual(done.returncode, status, (words, done.stdout, done.stderr))
        if status == 0:
            return json.loads(done.stdout)
        self.assertEqual(done.stderr.count("\n"), 1)
        return done.stderr

    def test_a_node_is_claimed_and_then_asks_for_its_key(self):
        adapter, file = self.adapter(), self.path("robot.key")
        self.assertEqual(self.said(adapter, "get", "landmark.gate_scale")[0]["path"], "landmark.gate_scale")
        self.said(adapter, "--key", file, "claim")
        with open(file, encoding="ascii") as key:
            digits = key.read()
        self.assertEqual((len(digits), stat.S_IMODE(os.stat(file).st_mode)), (32, 0o600))
        self.assertIn("key is missing", self.said(adapter, "set", "landmark.gate_scale=2", status=1))

    def test_what_is_wrong_is_named(self):
        self.assertIn("no serial port", self.said("/dev/null", "list", status=1))
        self.assertIn("/nowhere: No such file", self.said("/nowhere", "list", status=1))
        self.assertIn("refuses to open its bus with 500000 bit/s", self.said(self.adapter("S"), "list", status=1))
        self.assertIn("no bitrate of 300000", self.said("/nowhere", "--bitrate", "300000", "list", status=1))
        self.assertIn("TETAP_KEY: a key is 32 hexadecimal digits", self.said("/nowhere", "save", status=2, key="12"))
        self.assertIn("claim needs --key", self.said("/nowhere", "claim", status=2))
        self.assertIn("nokey: No such file", self.said("/nowhere", "--key", self.path("nokey"), "save", status=2))


if __name__ == "__main__":
    unittest.main()
