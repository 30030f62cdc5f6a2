#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""What the README shows is what happens: its example in C++ compiles and prints what stands below it, and what it points to exists."""
import os
import re
import subprocess
import tempfile
import unittest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))
WORLD = os.path.join(os.environ.get("TETAP_PROGRAMS", os.path.join(ROOT, "build/host/sim_host")), "tetap-world")


def readme():
    with open(os.path.join(ROOT, "README.md"), encoding="utf-8") as file:
        return file.read()


class Readme(unittest.TestCase):
    def test_the_example_compiles_with_both_compilers_and_prints_what_stands_below_it(self):
        command, code, printed = re.search(r"\n    (g\+\+ [^\n]*)\n.*?```cpp\n(.*?)```\n.*?```\n(.*?)```", readme(), re.S).groups()
        self.assertLessEqual(len([line for line in code.splitlines() if line.strip()]), 22)
        with tempfile.TemporaryDirectory() as folder:
            with open(os.path.join(folder, "example.cpp"), "w", encoding="utf-8") as file:
                file.write(code)
            for compiler in ("g++", "clang++"):
                words = command.replace("g++", compiler, 1).replace("example.cpp", f"{folder}/example.cpp").split() + ["-Wall", "-Wextra", "-Werror", "-o", f"{folder}/example"]
                subprocess.run(words, cwd=ROOT, check=True)
                done = subprocess.run([f"{folder}/example"], check=True, capture_output=True, text=True)
                self.assertEqual(done.stdout, printed)

    def test_every_file_it_links_to_exists(self):
        links = re.findall(r"\]\(([^)#:]+)\)", readme())
        self.assertGreater(len(links), 5)
        for link in links:
            self.assertTrue(os.path.exists(os.path.join(ROOT, link)), link)

    @unittest.skipUnless(os.access(WORLD, os.X_OK), "tetap-world is not built")
    def test_the_faults_it_counts_are_those_there_are(self):
        def said(*options):
            return subprocess.run([WORLD, *options], check=True, capture_output=True, text=True).stdout

        every = re.findall(r"^  ([a-z_]+) +@", said("--help"), re.M)
        self.assertEqual(int(re.search(r"--help` lists (\d+) with their times", readme())[1]), len(every))
        section = re.search(r"\n### What it does not do yet\n(.*?)\n## ", readme(), re.S)[1]
        others = re.search(r"in the other (\d+) faults that act on a rover ", section)[1]
        named = {fault for bullet in re.findall(r"^\* .*", section, re.M) for fault in every if f"`{fault}`" in bullet}
        self.assertEqual(int(others), len(set(said("--list-faults").split()) - named))


if __name__ == "__main__":
    unittest.main()
