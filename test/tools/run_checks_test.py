#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Which failures tools/proof/run_checks may try again: processes that missed each other, never bytes that differ."""
import os
import re
import subprocess
import tempfile
import unittest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))
IDENTITY = ("test/replay/r5_identity.sh", "test/replay/free_run.sh", "test/replay/host_identity.sh")


def differs(log):
    with tempfile.NamedTemporaryFile("w", suffix=".log") as file:
        file.write(log)
        file.flush()
        done = subprocess.run(["bash", "-c", '. tools/run/node_session.sh; bytes_differ "$1"', "bash", file.name], cwd=ROOT, check=False)
    return {0: True, 1: False}[done.returncode]


def said_by_cmp(a, b):
    with tempfile.TemporaryDirectory() as folder:
        for name, content in (("a", a), ("b", b)):
            with open(os.path.join(folder, name), "w", encoding="utf-8") as file:
                file.write(content)
        done = subprocess.run(["cmp", "a", "b"], cwd=folder, capture_output=True, text=True, check=False)
    return done.stdout + done.stderr


def source(path):
    with open(os.path.join(ROOT, path), encoding="utf-8") as file:
        return file.read()


class Retry(unittest.TestCase):
    def test_what_cmp_says_is_never_tried_again(self):
        for a, b in (("one\ntwo\n", "one\nTwo\n"), ("one\ntwo\n", "one\n"), ("one\n", "one\ntwo\n"), ("one\n", "")):
            self.assertTrue(differs("provide_vcan: user-mode-linux\n" + said_by_cmp(a, b)), said_by_cmp(a, b))

    def test_every_verdict_of_the_identity_tests_is_never_tried_again(self):
        verdicts = set()
        for path in IDENTITY:
            text = source(path)
            verdicts |= {v.strip('"') for v in re.findall(r'verdict=("[^"]*"|\w+)', text)} - {"equal"}
            verdicts |= set(re.findall(r'echo "(  one flipped bit[^"]* leaves [^"]*|the desk replay [^"]*)"', text))
            verdicts |= set(re.findall(r'"(the run is the same [^"]*)"', text))
        self.assertGreaterEqual(len(verdicts), 8, verdicts)
        for verdict in verdicts:
            self.assertTrue(differs(f"  mrclam1_mrclam         2000 epochs, moves   3.97 m, state CRC E09152E8: {verdict}\n"), verdict)

    def test_a_player_that_finds_another_epoch(self):
        words = source("sim_host/play/session.cpp")
        self.assertIn(" epochs differ from the recording; first ", words)
        self.assertTrue(differs("tetap-play: 3 of 2094 epochs differ from the recording; first epoch 7 at 0.070 s: recorded 321#00, now 321#01\n"))
        self.assertTrue(differs("  linux mrclam: at the desk 2116 epochs compared, different 3\n"))
        self.assertIn("came back as", source("test/hal/can_echo_peer.cpp"))
        self.assertTrue(differs("can_echo_peer: frame 7: sent 00000123, came back as 00000124 or with other data\n"))

    def test_processes_that_missed_each_other_may_be_tried_again(self):
        for log in ("tetap-play: no node with id base 0x300 answers on this bus: sent Begin for 15.084 s\n",
                    "tetap-play: 12 frames lost (2 to the node, 10 from it, of these 0 in our own socket)\n",
                    "tetap-play: no answer to the tick at 4.200 s within 2.000 s: no frame of the epoch came; 420 epochs before it, 0 frames lost so far\n",
                    "provide_vcan: user-mode-linux ended early (status 1): it did not start within 60 s\n",
                    "  busy: the emulated receiver lost 3 frames, so the record is not what the node consumed\n",
                    "  linux mrclam: at the desk 2116 epochs compared, different 0\n  too few epochs compared\n",
                    "  mrclam1_mrclam         2000 epochs, moves   3.97 m, state CRC E09152E8: equal\n"
                    "  one flipped bit in mrclam1_mrclam on the host: 1369 state CRCs are others\n"):
            self.assertFalse(differs(log), log)

    def test_prove_asks(self):
        self.assertRegex(source("tools/proof/run_checks"), r'\$status != 77 \] && ! bytes_differ "\$log" \|\| break')


if __name__ == "__main__":
    unittest.main()
