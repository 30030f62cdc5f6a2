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

    def test_one_finding_is_red_in_every_folder_and_none_is_allowed(self):
        for folder in ("src/tetap/estimators", "hal", "drivers", "config", "sim_host/world", "test", "toolchain"):
            status, text = self.check("int a;\n// It is so.\n", folder)
            self.assertEqual(status, 1, folder)
            self.assertIn("check_comments: 1 comments", text)

    def test_data_that_speaks_is_named_in_code_that_ships(self):
        for word in ("says", "told", "hears", "believed", "doubt"):
            for folder in ("src", "hal", "drivers", "config", "sim_host"):
                status, text = self.check(f"int a = 0;  // the receiver {word} it\n", folder)
                self.assertEqual(status, 1)
                self.assertIn(f"{folder}/a.hpp:1: '{word}' of data", text)
        # Strings, names and words that contain the pattern are none of a comment's words.
        for line in ('print("the node says // nothing");\n', "int told = doubt(heard_at_);\n", "int a;  // essay on foretold doubtless\n"):
            self.assertEqual(self.check(line, "src")[0], 0, line)

    def test_this_repository_is_clean(self):
        done = subprocess.run([TOOL], capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)


if __name__ == "__main__":
    unittest.main()
