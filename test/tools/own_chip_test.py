#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The two examples of docs/howto/own_chip.md, Arduino's sketch and Zephyr's application: compiled for Cortex-M7 and, with hard and soft float, Cortex-M33, and linked
without any of our ports. library.json and zephyr/module.yml hold their published rules. The tests chip_board_test and zephyr_test run both on the host."""
import glob
import json
import os
import re
import subprocess
import tempfile
import unittest

import yaml

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))
CORES = {"m7": ["-mcpu=cortex-m7", "-mfpu=fpv5-d16", "-mfloat-abi=hard"], "m33 hard": ["-mcpu=cortex-m33", "-mfpu=fpv5-sp-d16", "-mfloat-abi=hard"],
         "m33 soft": ["-mcpu=cortex-m33", "-mfloat-abi=soft"]}
EXAMPLES = {"arduino": (["-x", "c++", "test/node/sketch/sketch.ino"], "test/node/sketch", "int main() { setup(); while (true) loop(); }\n"),
            "zephyr": (["test/node/zephyr/src/main.cpp"], "test/node/zephyr/fake", None)}
SOURCES = ("planar/dead_reckoning.cpp", "planar/pose_clones.cpp", "planar/pose_filter.cpp")
FLAGS = ["-std=c++20", "-O1", "-mthumb", "-ffp-contract=off", "-fno-exceptions", "-fno-rtti", "-fno-threadsafe-statics", "-ffunction-sections", "-fdata-sections", "-Wall", "-Wextra",
         "-Werror", "-Wno-missing-field-initializers", "-DEIGEN_NO_MALLOC", "-DEIGEN_CACHEFRIENDLY_PRODUCT_THRESHOLD=64", "-DEIGEN_NO_DEBUG", "-isystem", "/usr/include/eigen3"]


def read(path):
    with open(os.path.join(ROOT, path), encoding="utf-8") as file:
        return file.read()


class Examples(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = folder.name
        header = os.path.join(cls.folder, "tetap/bus/messages.hpp")
        os.makedirs(os.path.dirname(header))
        cls.run_it(os.path.join(ROOT, "tools/can/generate_messages"), os.path.join(ROOT, "config/tetap.dbc"), "--header", header)

    @staticmethod
    def run_it(*command):
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            raise AssertionError(f"{' '.join(command)}\n{done.stderr[-3000:]}")
        return done.stdout

    def test_compile_for_each_core_and_link_without_a_port_of_ours(self):
        for core, of_core in CORES.items():
            words = ["arm-none-eabi-g++", *of_core, *FLAGS, "-Isrc", "-I.", "-I" + self.folder]
            objects = []
            for source in SOURCES:
                objects.append(os.path.join(self.folder, os.path.basename(source) + ".o"))
                self.run_it(*words, "-c", "src/tetap/estimators/" + source, "-o", objects[-1])
            for name, (source, fake, entry) in EXAMPLES.items():
                with self.subTest(core=core, example=name):
                    made = os.path.join(self.folder, name)
                    text = read(source[-1]) + (entry or "")
                    with open(made + ".cpp", "w", encoding="utf-8") as file:
                        file.write(text)
                    self.run_it(*words, "-I" + fake, "-MMD", "-MF", made + ".d", "-c", made + ".cpp", "-o", made + ".o")
                    with open(made + ".d", encoding="utf-8") as file:
                        ours = sorted(set(re.findall(r"\bhal/[\w/]+\.hpp", file.read())))
                    self.assertEqual([one for one in ours if re.match(r"hal/(chip|board/)", one)], [], "of our ports nothing but the concept of a board is read")
                    self.run_it("arm-none-eabi-g++", *of_core, "-mthumb", "--specs=nosys.specs", "-Wl,--gc-sections", "-Wl,--no-warn-mismatch", made + ".o", *objects, "-o", made + ".elf")
                    attributes = self.run_it("arm-none-eabi-readelf", "-A", made + ".elf")
                    self.assertEqual("Tag_ABI_VFP_args" in attributes, "hard" in core or core == "m7")
                    symbols = self.run_it("arm-none-eabi-nm", "-C", made + ".elf")
                    self.assertNotIn("tetap::hal", symbols)
                    self.assertRegex(symbols, r"tetap::estimators::\w+")


class Manifests(unittest.TestCase):
    """Rules of platformio-core's assets/schema/library.json, and of METADATA_SCHEMA in Zephyr's scripts/zephyr_module.py."""

    def test_of_platformio_has_the_fields_that_its_schema_allows(self):
        manifest = json.loads(read("library.json"))
        texts, lists = {"name": 50, "version": 20, "description": 255, "license": 99, "frameworks": 99, "platforms": 99, "headers": 99}, ("keywords", "authors")
        self.assertEqual(set(manifest) - set(texts) - set(lists) - {"build"}, set())
        for name, most in texts.items():
            self.assertIsInstance(manifest[name], str)
            self.assertLessEqual(len(manifest[name]), most, name)
        self.assertRegex(manifest["name"], r"^[a-z0-9]+(-[a-z0-9]+)*$")
        self.assertTrue(manifest["keywords"])
        for keyword in manifest["keywords"]:
            self.assertRegex(keyword, r"^[a-z0-9]+(-[a-z0-9]+)*$")
        for author in manifest["authors"]:
            self.assertEqual({name: type(value) for name, value in author.items()}, {"name": str, "maintainer": bool})
        self.assertEqual(set(manifest["build"]) - {"flags", "unflags", "includeDir", "srcDir", "srcFilter"}, set())
        for name, value in manifest["build"].items():
            self.assertIsInstance(value, str if name.endswith("Dir") else list, name)
        self.assertEqual(manifest["version"], re.search(r"^project\(tetap VERSION ([\d.]+)", read("CMakeLists.txt"), re.M)[1])
        for path in [manifest["headers"], *(one[2:-1] for one in manifest["build"]["srcFilter"] if one.startswith("+"))]:
            self.assertTrue(os.path.exists(os.path.join(ROOT, manifest["build"]["srcDir"], path)), path)

    def test_of_zephyr_names_files_that_are_there_and_fields_that_its_schema_allows(self):
        module = yaml.safe_load(read("zephyr/module.yml"))
        self.assertEqual(set(module) - {"name", "build", "tests", "samples", "boards", "blobs"}, set())
        self.assertEqual({name: type(value) for name, value in module["build"].items()}, {"cmake": str, "kconfig": str})
        self.assertTrue(os.path.isfile(os.path.join(ROOT, module["build"]["cmake"], "CMakeLists.txt")))
        self.assertTrue(os.path.isfile(os.path.join(ROOT, module["build"]["kconfig"])))
        self.assertEqual(re.findall(r"^config (\w+)", read("zephyr/Kconfig"), re.M), ["TETAP", "TETAP_EIGEN"])
        for name in re.findall(r"CONFIG_(TETAP\w*)", read("zephyr/CMakeLists.txt") + read("test/node/zephyr/prj.conf")):
            self.assertIn(name, ("TETAP", "TETAP_EIGEN"))

    def test_zephyrs_list_gives_its_build_the_headers_the_messages_and_one_source(self):
        """CMake runs the module's list with Zephyr's four commands written down instead of obeyed."""
        with tempfile.TemporaryDirectory() as folder:
            with open(os.path.join(folder, "CMakeLists.txt"), "w", encoding="utf-8") as file:
                file.write('cmake_minimum_required(VERSION 3.20)\nproject(fake NONE)\nset(CONFIG_TETAP y)\nset(CONFIG_TETAP_EIGEN /usr/include/eigen3)\n' + "".join(
                    f'function({name})\n  message(STATUS "{name} ${{ARGN}}")\nendfunction()\n' for name in
                    ("zephyr_include_directories", "zephyr_system_include_directories", "zephyr_library_named", "zephyr_library_sources", "zephyr_library_compile_options"))
                    + f"add_subdirectory({ROOT}/zephyr module)\n")
            said = Examples.run_it("cmake", "-S", folder, "-B", os.path.join(folder, "build"))
            paths = re.search(r"zephyr_include_directories (\S+)", said)[1].split(";")
            self.assertTrue(any(glob.glob(os.path.join(one, "tetap/bus/messages.hpp")) for one in paths))
            self.assertTrue(any(os.path.exists(os.path.join(one, "tetap/localizer.hpp")) for one in paths))
            self.assertTrue(os.path.exists(re.search(r"zephyr_library_sources (\S+)", said)[1]))
            self.assertIn("-ffp-contract=off", said)


if __name__ == "__main__":
    unittest.main()
