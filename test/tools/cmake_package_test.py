#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""A project of somebody else's on the library, by find_package(tetap), add_subdirectory(), pkg-config and -I: it compiles under its own warnings and its own
standard, and neither flags nor tests nor programs of this tree come with it. Every header that docs/reference/api.md names is there and compiles alone."""
import glob
import json
import os
import re
import shutil
import subprocess
import tempfile
import unittest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))
WHOLE = os.environ.get("form") == "whole"
FLOORS = ("base", "filter", "nav", "model", "slam", "param", "sensor", "checks", "estimators", "bus", "node")

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


def read(path):
    with open(os.path.join(ROOT, path), encoding="utf-8") as file:
        return file.read()


VERSION = re.search(r"^project\(tetap VERSION ([\d.]+)", read("CMakeLists.txt"), re.M)[1]
PAGE = read("docs/howto/use_the_library.md")
DRIVE = re.search(r"Save this as `drive.cpp`:\n\n```cpp\n(.*?)```", PAGE, re.S)[1]
PRINTED = re.search(r"The program prints:\n\n```text\n(.*?)```", PAGE, re.S)[1]


def api():
    """The headers that docs/reference/api.md names, as they are included."""
    names = []
    for folder, headers in re.findall(r"^\| [^|]*\| `([\w/]+)` \| (.*) \|$", read("docs/reference/api.md"), re.M):
        found = re.findall(r"`(\w+)`", headers)
        names += [f"{folder}/{name}.hpp" for name in found] if headers != "all" else \
            sorted(os.path.relpath(one, os.path.join(ROOT, "src")) for one in glob.glob(os.path.join(ROOT, "src", folder, "*.hpp")))
    return names


def closure(path, seen=None):
    """Files of this tree that the file includes, itself among them."""
    seen = set() if seen is None else seen
    if path not in seen:
        seen.add(path)
        for name in re.findall(r'^#include "([^"]+)"', read(path), re.M):
            for one in (f"src/{name}", name):  # neither: a generated one
                if os.path.exists(os.path.join(ROOT, one)):
                    closure(one, seen)
    return seen


class Parameters(unittest.TestCase):
    def test_the_numbers_of_a_robot_close_over_few_files_and_none_that_computes(self):
        files = sorted(glob.glob(os.path.join(ROOT, "config/parameters/*.hpp")))
        self.assertGreater(len(files), 10)
        for path in files:
            named = closure(os.path.relpath(path, ROOT))
            self.assertLessEqual(len(named), 40, path)
            self.assertEqual([one for one in named if re.match(r"src/tetap/(node|bus|estimators|firmware|checks|slam)/", one)], [], path)


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

    def configured(self, name, bring, floor, program):
        """The build folder and what CMake printed; nothing but the program's own sources, standard and flags is in the commands."""
        source, build = self.theirs(name, bring, floor, program)
        said = self.configure(source, build)
        self.assertEqual(re.findall(r"Test +#\d+: (\S+)", run("ctest", "--test-dir", build, "-N")), ["theirs"])
        self.assertIn(f"tetap_VERSION is {VERSION}\n", said)
        self.assertIn("their standard: 23", said)
        self.assertRegex(said, r"their targets: (?:Continuous|Experimental|Nightly|[\w;])*theirs")
        programs = re.findall(r"^\.\.\. (\S+)|^(\S+): phony", run("cmake", "--build", build, "--target", "help"), re.M)
        self.assertEqual([one for pair in programs for one in pair if "gtest" in one.lower() or re.match(r"tetap[-_]", one)], [])
        with open(os.path.join(build, "compile_commands.json"), encoding="utf-8") as file:
            commands = json.load(file)
        self.assertEqual(sorted(os.path.basename(one["file"]) for one in commands), ["estimators.cpp"] * (floor == "localizer") + ["theirs.cpp"])
        own = {"-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow", "-Werror"}
        for one in commands:
            words = one["command"].split()
            self.assertEqual([word for word in words if re.match(r"-[DfWmO]", word) and word not in own], [])
            self.assertEqual([word for word in words if word.startswith("-std=")], ["-std=gnu++23"])
        return build

    def holds(self, name, bring, floor="filter", program=PROGRAM, printed="0.47642 0.04717 10.601\n"):
        build = self.configured(name, bring, floor, program)
        run("cmake", "--build", build)
        self.assertEqual(run(os.path.join(build, "theirs")), printed)
        return build

    def test_find_package(self):
        self.holds("found", f"find_package(tetap {VERSION} REQUIRED)")

    def test_add_subdirectory(self):
        self.holds("added", f"add_subdirectory({ROOT} tetap)")

    def test_the_localizer_by_every_way(self):
        """The program of the page compiles by CMake's two; in the whole form by all four, and runs. The library's one source is compiled once, by find_package()."""
        found = self.configured("localizer_found", "find_package(tetap REQUIRED)", "localizer", DRIVE)
        added = self.configured("localizer_added", f"add_subdirectory({ROOT} tetap)", "localizer", DRIVE)
        objects = []
        for build in (found, added):
            run("make", "-C", build, "theirs.o")
            objects += glob.glob(os.path.join(build, "**/theirs.cpp.o"), recursive=True)
        os.environ["PKG_CONFIG_PATH"] = os.path.join(self.prefix, "share/pkgconfig")
        self.assertEqual(run("pkg-config", "--modversion", "tetap").strip(), VERSION)
        library = os.path.join(self.prefix, "include/tetap/estimators.cpp")
        self.assertTrue(os.path.samefile(run("pkg-config", "--variable=sources", "tetap").strip(), library))
        flags = run("pkg-config", "--cflags", "tetap").split()
        self.assertTrue(os.path.samefile(flags[0].removeprefix("-I"), os.path.join(self.prefix, "include")))
        if not WHOLE:
            return
        plain = re.search(r"^g\+\+ (.*) drive.cpp", PAGE, re.M)[1].replace("build/installed", self.prefix).split()
        drive = os.path.join(self.folder.name, "drive.cpp")
        with open(drive, "w", encoding="utf-8") as file:
            file.write(DRIVE)
        for name, words in (("pkg", ["-std=c++20", *flags]), ("plain", [*plain, "-Wall", "-Wextra", "-Werror"])):
            objects.append(os.path.join(self.folder.name, name + ".o"))
            run("g++", *words, "-c", drive, "-o", objects[-1])
        self.assertEqual(len(objects), 4)
        run("cmake", "--build", found)
        compiled = glob.glob(os.path.join(found, "**/estimators.cpp.o"), recursive=True)
        for one in objects:
            run("g++", one, *compiled, "-o", one + ".elf")
            self.assertEqual(run(one + ".elf"), PRINTED, one)
        wanted = run("nm", "-u", *compiled, *objects)
        self.assertIn("printf", wanted)
        self.assertEqual([one for one in wanted.split() if re.search(r"alloc|_Zn[wa]|_Zd[la]|__cxa_throw|(sin|cos|exp|log)f?$", one)], [])

    def test_a_version_that_it_is_not_is_refused(self):
        for wanted in ("99", "0.99"):
            said = self.configure(*self.theirs(f"wants_{wanted}", f"find_package(tetap {wanted} REQUIRED)"), status=1)
            self.assertIn(f'compatible with requested version "{wanted}"', " ".join(said.split()))

    def test_without_the_generator_of_messages_the_rest_is_there_and_the_cause_is_named(self):
        python, made = os.path.join(self.folder.name, "python"), os.path.join(self.folder.name, "less")
        with open(python, "w", encoding="utf-8") as file:
            file.write("#!/bin/sh\nexec /usr/bin/python3 -S \"$@\"\n")  # without Debian's modules
        os.chmod(python, 0o755)
        said = run("cmake", "-S", ROOT, "-B", made, "-DTETAP_PACKAGE=ON", f"-DTETAP_PYTHON={python}")
        self.assertRegex(said, r"(?m)^-- tetap: without tetap::bus, tetap::node and tetap::localizer, .*: ModuleNotFoundError: No module named 'canmatrix'$")
        run("cmake", "--install", made, "--prefix", made + "/there")
        self.assertFalse(os.path.exists(made + "/there/include/tetap/localizer.hpp"))
        self.assertTrue(os.path.exists(made + "/there/include/tetap/estimators/inertial/inertial.hpp"))

    def test_every_header_is_there_and_needs_nothing_else(self):
        """All headers of a floor in one file, with the installed tree alone on the path and every target's own floor."""
        installed, source = os.path.join(self.prefix, "include/tetap"), os.path.join(ROOT, "src/tetap")
        self.assertEqual(sorted(os.listdir(installed)), sorted((*FLOORS, "estimators.cpp", "localizer.hpp", "version.hpp")))
        for floor in FLOORS:
            there, wanted = ({os.path.relpath(one, root) for one in glob.glob(f"{root}/{floor}/**/*.?pp", recursive=True)} for root in (installed, source))
            self.assertEqual(there - wanted, {"bus/messages.hpp"} if floor == "bus" else set())
            self.assertEqual(wanted - there, set())
        headers = [name for floor in FLOORS[:5] for name in sorted(os.listdir(os.path.join(installed, floor)))]
        program = EVERY_HEADER.format(includes="\n".join(f'#include "tetap/{floor}/{name}"' for floor in FLOORS[:5] for name in sorted(os.listdir(os.path.join(installed, floor)))))
        self.assertGreater(len(headers), 100)
        source, build = self.theirs("every", "find_package(tetap REQUIRED)", floor="slam", program=program)
        self.configure(source, build)
        run("cmake", "--build", build)

    def test_the_one_source_has_every_source(self):
        named = re.findall(r'^#include "(.*)"', read("src/tetap/estimators.cpp"), re.M)
        there = [os.path.relpath(one, os.path.join(ROOT, "src")) for one in glob.glob(os.path.join(ROOT, "src/tetap/estimators/**/*.cpp"), recursive=True)]
        self.assertEqual(named, sorted(there))

    def test_every_header_of_the_api_is_installed(self):
        names = api()
        self.assertGreater(len(names), 60)
        self.assertEqual(len(names), len(set(names)))
        self.assertEqual([name for name in names if not os.path.exists(os.path.join(self.prefix, "include", name))], [])

    @unittest.skipUnless(WHOLE, "a compile for each: whole form alone")
    def test_every_header_of_the_api_compiles_alone(self):
        eigen = os.path.join(self.folder.name, "eigen.hpp")  # read once: all of them need it
        with open(eigen, "w", encoding="utf-8") as file:
            file.write("#include <Eigen/Core>\n#include <Eigen/Geometry>\n")
        compiler = ("g++", "-std=c++20", "-isystem", "/usr/include/eigen3", "-x", "c++")
        run(*compiler[:-1], "c++-header", eigen)
        for name in api():
            with self.subTest(name=name):
                run(*compiler, "-fsyntax-only", "-I" + os.path.join(self.prefix, "include"), "-include", eigen, "-include", name, "/dev/null")

    def test_the_version_that_a_program_reads_is_that_of_the_project(self):
        said = run("g++", "-dM", "-E", "-x", "c++", os.path.join(self.prefix, "include/tetap/version.hpp"))
        self.assertEqual(".".join(re.search(rf"TETAP_VERSION_{part} (\d+)", said)[1] for part in ("MAJOR", "MINOR", "PATCH")), VERSION)


if __name__ == "__main__":
    unittest.main()
