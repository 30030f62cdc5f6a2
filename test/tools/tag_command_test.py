#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""tools/can/tag_command against OpenSSL's SipHash-2-4, and its refusals."""
import os
import random
import shutil
import subprocess
import tempfile
import unittest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))
TOOL = os.path.join(ROOT, "tools", "can", "tag_command")
KEY = "000102030405060708090a0b0c0d0e0f"


def openssl(key, data):
    """The hash as OpenSSL prints it, least significant byte first."""
    with tempfile.NamedTemporaryFile() as file:
        file.write(data)
        file.flush()
        said = subprocess.run(["openssl", "mac", "-macopt", "hexkey:" + key, "-macopt", "size:8", "-in", file.name, "SIPHASH"],
                              capture_output=True, text=True, check=True)
    return said.stdout.strip()


class TagCommand(unittest.TestCase):
    def said(self, *arguments, key=KEY):
        with tempfile.NamedTemporaryFile("w") as file:
            file.write(key + "\n")
            file.flush()
            return subprocess.run([TOOL, file.name, *arguments], capture_output=True, text=True)

    def test_the_frames_of_a_command(self):
        done = self.said("--nonce", "0xDEADBEEF", "--turn", "1234", "--counter", "77", "303#7901000000000000")
        # openssl 3.0.19 over EFBEADDED2040000030300004D000000, and with 7901000000000000 behind it: DFFA674E5D0AE3D1
        self.assertEqual(done.stdout, "301#384D0000883CCC33\n301#384D0000DFFA674E\n303#7901000000000000\n")

    @unittest.skipUnless(shutil.which("openssl"), "no openssl")
    def test_tags_are_those_of_openssl(self):
        dice = random.Random(4)
        for _ in range(40):
            key = dice.randbytes(16).hex()
            nonce, turn, counter = (dice.randrange(1, 1 << bits) for bits in (32, 32, 24))
            offset, data = dice.choice((0, 2, 3, 4, 5)), dice.randbytes(8)
            can_id = 64 * dice.randrange(0x1F) + offset
            message = b"".join(x.to_bytes(4, "little") for x in (nonce, turn, can_id, counter)) + data
            done = self.said("--nonce", str(nonce), "--turn", str(turn), "--counter", str(counter), "%03X#%s" % (can_id, data.hex()), key=key)
            opening, guard, command = done.stdout.split()
            self.assertEqual(opening[-8:], openssl(key, message[:16])[:8])
            self.assertEqual(guard[-8:], openssl(key, message)[:8])
            self.assertEqual(opening[:12], guard[:12])
            self.assertEqual(command, "%03X#%s" % (can_id, data.hex().upper()))
            self.assertEqual(int(guard[:3], 16), can_id - offset + 1)
            self.assertEqual(int.from_bytes(bytes.fromhex(guard[6:12]), "little"), counter)

    def test_refusals_are_one_line(self):
        good = ["--nonce", "1", "--turn", "1", "--counter", "1", "302#0000000000000000"]
        for arguments, key, word in ((good[:-1] + ["306#0000000000000000"], KEY, "no In_Sync"), (good[:-1] + ["302#00"], KEY, "8 bytes"),
                                     (good, "00", "32 hexadecimal digits"), (["--nonce", "0"] + good[2:], KEY, "--nonce 0"),
                                     (good[:4] + ["--counter", str(1 << 24), good[-1]], KEY, "16777215")):
            done = self.said(*arguments, key=key)
            self.assertNotEqual(done.returncode, 0)
            self.assertIn(word, done.stderr)
            self.assertEqual(done.stderr.count("\n"), 1)


if __name__ == "__main__":
    unittest.main()
