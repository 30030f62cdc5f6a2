#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""An implausible parameter does not compile: it is one sentence with path, value and limits, whichever compiler refuses it. So is a field that is misspelt."""
import os
import subprocess
import tempfile
import unittest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))
COMPILERS = ("g++", "clang++")
ROBOT = """#pragma once
#include "tetap/param/limits.hpp"
inline constexpr tetap::param::Parameters %s = tetap::param::checked({
    %s,
});
%s"""
WHEELS = ".wheels = {.drive = {.left_radius_m = %s, .right_radius_m = 0.1F, .track_m = %s, .noise_left = 1e-3F, .noise_right = 1e-3F}}"
NOISELESS = ".wheels = {.drive = {.left_radius_m = 0.1F, .right_radius_m = 0.1F, .track_m = 0.5F%s}%s}"
NO_WHEEL = "it has to be above 0 with noise_right, or else wheels.noise.speed or wheels.wheel_speed_noise: no wheel is without noise"
ORIGIN = ".gnss = {.origin_configured = 1, .origin_latitude_2ndeg = %s, .origin_longitude_2ndeg = %s}"
AT_SEA = "it has to be a place on land, stored in steps of 2e-9 degrees: this one lies in the sea at 0 N 0 E"
REFUSED = (
    (WHEELS % ("82.5F", "0.42F"), "wheels.drive.left_radius_m is 82.5 m; it has to be from 0 to 2"),
    (WHEELS % ("0.0825F", "420.0F"), "wheels.drive.track_m is 420 m; it has to be from 0 to 10"),
    (WHEELS % ("0.0825F", '__builtin_nanf("")'), "wheels.drive.track_m is nan m; it has to be from 0 to 10"),
    (".loop = {.period_us = 10}", "loop.period_us is 10 us; it has to be from 1000 to 100000"),
    (ORIGIN % ("48", "11"), f"gnss.origin_latitude_deg is 9.6e-08 deg; {AT_SEA}"),
    (ORIGIN % ("482627000", "116683000"), f"gnss.origin_latitude_deg is 0.965254 deg; {AT_SEA}"),
    (ORIGIN % ("48'262'700'000'000", "5'834'150'000"), "gnss.origin_latitude_deg is 96525.4 deg; it has to be from -90 to 90"),
    (".gnss = {.sigma_floor_m = -0.3F}", "gnss.sigma_floor_m is -0.3 m; it has to be from 0.001 to 100"),
    (".loop = {.window_us = 5'000}", "loop.window_us is 5000 us; it has to be at least loop.period_us"),
    (NOISELESS % ("", ""), f"wheels.drive.noise_left is 0 m; {NO_WHEEL}"),
    (NOISELESS % (", .noise_left = 1e-3F", ""), f"wheels.drive.noise_left is 0.001 m; {NO_WHEEL}"),
    (".gyro = {.use = 1}", "gyro.noise is 0 rad^2/s; it has to be above 0 where gyro.use is 1: no gyroscope is without noise"),
    (".inertial = {.mounting_bs = {0, 1, 0, 0, 0, 1, 1, 0, 0.1F}}", "inertial.mounting_bs has to be a rotation"),
)


class RefusedParameters(unittest.TestCase):
    def sentences_of(self, compiler, robots, beside=""):
        """(status of the compiler, sentences) of a file that includes a robot's header for each of these fields."""
        with tempfile.TemporaryDirectory() as folder:
            os.mkdir(os.path.join(folder, "config"))
            for number, fields in enumerate(robots):
                with open(os.path.join(folder, f"config/robot{number}.hpp"), "w", encoding="utf-8") as file:
                    file.write(ROBOT % (f"robot{number}", fields, beside))
            log = os.path.join(folder, "log")
            with open(log, "w", encoding="utf-8") as file:
                compiled = subprocess.run([compiler, "-std=c++20", "-fsyntax-only", f"-I{folder}", f"-I{ROOT}/src", "-isystem", "/usr/include/eigen3", "-x", "c++", "-"],
                                          input="".join(f'#include "config/robot{number}.hpp"\n' for number in range(len(robots))), text=True, stderr=file, check=False)
            found = subprocess.run([os.path.join(ROOT, "tools/run/explain_parameter_error"), log], capture_output=True, text=True, check=False)
            self.assertEqual(found.returncode == 0, found.stdout != "")
            return compiled.returncode, found.stdout.splitlines()

    def test_an_implausible_parameter_is_one_sentence(self):
        for rows in (REFUSED[:8], REFUSED[8:]):  # clang++ stops after 20 errors, two a robot
            sentences = [f"config/robot{number}.hpp: {sentence}" for number, (_, sentence) in enumerate(rows)]
            for compiler in COMPILERS:
                self.assertEqual(self.sentences_of(compiler, [fields for fields, _ in rows]), (1, sentences), compiler)

    def test_plausible_parameters_compile(self):
        for compiler in COMPILERS:
            robots = [WHEELS % ("0.0825F", "0.42F"), NOISELESS % ("", ", .wheel_speed_noise = 1e-5F"), NOISELESS % ("", ", .noise = {.speed = 1e-4F}"), ORIGIN % ("24'131'350'000", "5'834'150'000"), ".inertial = {.gyro_scale = 0.1F}"]
            self.assertEqual(self.sentences_of(compiler, robots), (0, []), compiler)

    def test_a_robot_that_maps_needs_ids_behind_its_block(self):
        for compiler in COMPILERS:
            for base, expected in ((".can_base = 0x340", (1, ["config/robot0.hpp: can_base is 832; it has to be a multiple of 128, for maps and images have ids behind the block of 64"])),
                                   (".can_base = 0x380", (0, []))):
                self.assertEqual(self.sentences_of(compiler, [base], "static_assert(tetap::param::checked_map_ids(true, robot0));"), expected, compiler)
            self.assertEqual(self.sentences_of(compiler, [".can_base = 0x340"], "static_assert(tetap::param::checked_map_ids(false, robot0));"), (0, []), compiler)

    def test_a_misspelt_field_is_told_by_its_robot(self):
        for compiler, words in (("g++", r"^config/robot0\.hpp:3: a field here is misspelt"), ("clang++", r"^config/robot0\.hpp:4: field designator 'sigma_flour_m' ")):
            status, lines = self.sentences_of(compiler, [".gnss = {.sigma_flour_m = 0.3F}"])
            self.assertEqual((status, len(lines)), (1, 1), lines)
            self.assertRegex(lines[0], words)

    def test_a_log_that_cannot_be_read_is_one_error(self):
        found = subprocess.run([os.path.join(ROOT, "tools/run/explain_parameter_error"), ROOT], capture_output=True, text=True, check=False)
        self.assertEqual((found.returncode, found.stdout, found.stderr), (2, "", f"explain_parameter_error: {ROOT}: Is a directory\n"))

    def test_other_errors_are_left_to_the_compiler(self):
        for compiler in COMPILERS:
            self.assertEqual(self.sentences_of(compiler, [".gnss = {.sigma_floor_m = 0.3F}"], "int f() { return no_such_name; }"), (1, []), compiler)


if __name__ == "__main__":
    unittest.main()
