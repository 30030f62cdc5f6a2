#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
# tools/proof/check_comments goes red on one comment of each kind, stays green on its look-alikes, and the repository itself is green.
import os
import subprocess
import tempfile
import unittest

TOOL = os.path.join(os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__)))), "tools", "proof", "check_comments")


class Comments(unittest.TestCase):
    def check(self, text, folder="hal"):
        with tempfile.TemporaryDirectory() as root:
            os.makedirs(os.path.join(root, folder))
            with open(os.path.join(root, folder, "a.hpp"), "w", encoding="utf-8") as file:
                file.write(text)
            done = subprocess.run([TOOL, root], capture_output=True, text=True, check=False)
            return done.returncode, done.stdout + done.stderr

    def test_a_member_comment_that_begins_with_a_relative_is_named(self):
        for word in ("of", "that", "what", "which", "and", "so", "since"):
            status, text = self.check(f"struct A {{\n  int a_ = 0;  ///< {word} the robot\n}};\n")
            self.assertEqual(status, 1)
            self.assertIn(f"hal/a.hpp:2: a member's comment begins with '{word}'", text)

    def test_a_block_that_begins_with_a_relative_or_a_pronoun_is_named(self):
        for word in ("What", "Whose", "Of", "And", "It", "They"):
            status, text = self.check(f"int a;\n/// {word} the robot sends.\nint b;\n")
            self.assertEqual(status, 1)
            self.assertIn(f"hal/a.hpp:2: a comment begins with '{word}'", text)

    def test_look_alikes_pass(self):
        self.assertEqual(self.check("/// The state of a robot.\n/// It goes on here.\nint offset;  ///< offset that lasts\nint b;  ///< output; of the far end\n")[0], 0)

    def test_a_folder_with_a_count_stays_green_up_to_it(self):
        line = "int a;\n// It is so.\n"
        self.assertEqual(self.check(line * 3, "drivers")[0], 0)
        status, text = self.check(line * 100, "drivers")
        self.assertEqual(status, 1)
        self.assertIn("drivers: 100 comments", text)

    def test_this_repository_is_clean(self):
        done = subprocess.run([TOOL], capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)


if __name__ == "__main__":
    unittest.main()
