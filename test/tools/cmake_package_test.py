#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""A project of somebody else's on the filters, by find_package(tetap) and by add_subdirectory(): it compiles under its own warnings and its own standard,
and neither flags nor tests nor programs of this tree come with it."""
import json
import os
import re
import shutil
import subprocess
import tempfile
import unittest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))
VERSION = re.search(r"^project\(tetap VERSION ([\d.]+)", open(os.path.join(ROOT, "CMakeLists.txt"), encoding="utf-8").read(), re.M)[1]
FLOORS = ("base", "filter", "nav", "model", "slam")

LISTS = """cmake_minimum_required(VERSION 3.16)
project(theirs LANGUAGES CXX)
set(CMAKE_CXX_STANDARD 23)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
include(CTest)
add_compile_options(-Wall -Wextra -Wpedantic -Wconversion -Wshadow -Werror)
{bring}
add_executable(theirs theirs.cpp)
target_link_libraries(theirs PRIVATE tetap::{floor})
add_test(NAME theirs COMMAND theirs)
message(STATUS "tetap_VERSION is ${{tetap_VERSION}}")
get_directory_property(all DIRECTORY ${{CMAKE_SOURCE_DIR}} BUILDSYSTEM_TARGETS)
message(STATUS "their targets: ${{all}}")
message(STATUS "their standard: ${{CMAKE_CXX_STANDARD}}")
"""

# The worked example of docs/explanation: x = [position, velocity], P- = [[10.101, 1], [1, 10.001]], S = 10.601.
PROGRAM = """#include "tetap/filter/kalman.hpp"
#include "tetap/filter/linear_models.hpp"

#include <cstdio>

int main() {
  using namespace tetap::filter;
  Kalman<double, 2> track;
  track.p = Symmetric<double, 2>::diagonal({10, 10});
  LinearMotion<double, 2> motion;
  motion.f(0, 1) = 0.1;
  motion.q = Symmetric<double, 2>::diagonal({0.001, 0.001});
  track.predict(motion);
  DirectMeasurement<double, 2, 0> seen;
  seen.z(0) = 0.5;
  seen.variance(0) = 0.5;
  const auto record = track.update(seen, 6.6);
  std::printf("%.5f %.5f %.3f\\n", track.x.value(0), track.x.value(1), record.s(0, 0));
}
"""
EVERY_HEADER = """{includes}
int main() {{}}
"""


def run(*command, status=0):
    environment = {name: value for name, value in os.environ.items() if name not in ("MAKEFLAGS", "MAKELEVEL", "CMAKE_PREFIX_PATH")}
    done = subprocess.run(command, env=environment, capture_output=True, text=True)
    if done.returncode != status:
        raise AssertionError(f"{' '.join(command)}: status {done.returncode}\n{done.stdout[-3000:]}{done.stderr[-3000:]}")
    return done.stdout + done.stderr


class Package(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.folder.cleanup)
        made, first = os.path.join(cls.folder.name, "made"), os.path.join(cls.folder.name, "first")
        run("cmake", "-S", ROOT, "-B", made, "-DTETAP_PACKAGE=ON")
        run("cmake", "--install", made, "--prefix", first)
        shutil.rmtree(made)  # an installation needs neither its build folder nor its first place
        cls.prefix = os.path.join(cls.folder.name, "prefix")
        shutil.move(first, cls.prefix)

    def theirs(self, name, bring, floor="filter", program=PROGRAM):
        source = os.path.join(self.folder.name, name)
        os.makedirs(source)
        for file, text in (("CMakeLists.txt", LISTS.format(bring=bring, floor=floor)), ("theirs.cpp", program)):
            with open(os.path.join(source, file), "w", encoding="utf-8") as handle:
                handle.write(text)
        return source, os.path.join(source, "build")

    def configure(self, source, build, status=0):
        return run("cmake", "-S", source, "-B", build, f"-DCMAKE_PREFIX_PATH={self.prefix}", status=status)

    def holds(self, name, bring):
        source, build = self.theirs(name, bring)
        said = self.configure(source, build)
        run("cmake", "--build", build)
        self.assertEqual(run(os.path.join(build, "theirs")), "0.47642 0.04717 10.601\n")
        self.assertEqual(re.findall(r"Test +#\d+: (\S+)", run("ctest", "--test-dir", build, "-N")), ["theirs"])
        self.assertIn("their standard: 23", said)
        self.assertRegex(said, r"their targets: (?:Continuous|Experimental|Nightly|[\w;])*theirs")
        programs = re.findall(r"^\.\.\. (\S+)|^(\S+): phony", run("cmake", "--build", build, "--target", "help"), re.M)
        self.assertEqual([one for pair in programs for one in pair if "tetap" in one or "gtest" in one.lower()], [])
        with open(os.path.join(build, "compile_commands.json"), encoding="utf-8") as file:
            commands = json.load(file)
        self.assertEqual([os.path.basename(one["file"]) for one in commands], ["theirs.cpp"])
        words = commands[0]["command"].split()
        own = {"-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow", "-Werror"}
        self.assertEqual([word for word in words if re.match(r"-[DfWmO]", word) and word not in own], [])
        self.assertEqual([word for word in words if word.startswith("-std=")], ["-std=gnu++23"])
        return said

    def test_find_package(self):
        self.assertIn(f"tetap_VERSION is {VERSION}\n", self.holds("found", f"find_package(tetap {VERSION} REQUIRED)"))

    def test_add_subdirectory(self):
        self.assertIn(f"tetap_VERSION is {VERSION}\n", self.holds("added", f"add_subdirectory({ROOT} tetap)"))

    def test_a_version_that_it_is_not_is_refused(self):
        for wanted in ("99", "0.99"):
            said = self.configure(*self.theirs(f"wants_{wanted}", f"find_package(tetap {wanted} REQUIRED)"), status=1)
            self.assertIn(f'compatible with requested version "{wanted}"', " ".join(said.split()))

    def test_every_header_is_there_and_needs_nothing_else(self):
        """All headers of a floor in one file, with the installed tree alone on the path and every target's own floor."""
        installed = os.path.join(self.prefix, "include", "tetap")
        self.assertEqual(sorted(os.listdir(installed)), sorted(FLOORS))
        for floor in FLOORS:
            there = sorted(os.listdir(os.path.join(ROOT, "src", "tetap", floor)))
            self.assertEqual(sorted(os.listdir(os.path.join(installed, floor))), there)
        program = EVERY_HEADER.format(includes="\n".join(f'#include "tetap/{floor}/{name}"' for floor in FLOORS for name in sorted(os.listdir(os.path.join(installed, floor)))))
        source, build = self.theirs("every", "find_package(tetap REQUIRED)", floor="slam", program=program)
        self.configure(source, build)
        run("cmake", "--build", build)


if __name__ == "__main__":
    unittest.main()
