#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
# tools/proof/check_layers goes red on one seeded violation of each rule, stays green on its look-alikes, and the repository itself is green.
import os
import re
import shutil
import subprocess
import sys
import unittest

sys.dont_write_bytecode = True
sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from small_image import PROOF, ROOT, ImageTest  # noqa: E402

DESIGN = """# Design
### 4.1 The arrows

Text -> no arrow.

    src/tetap/base      -> (nothing)
    src/tetap/bus       -> src/tetap/base
    src/tetap/filter    -> src/tetap/base, Eigen
    src/tetap/app       -> src/tetap/{base,bus,filter}, hal (concepts),
                     drivers, config/messages.hpp
    hal           -> src/tetap/base                      hal/chip/support -> hal, src/tetap/base
    hal/board/<board> -> hal, hal/chip/support, src/tetap/base
    hal/board/<board>/main.cpp -> hal/board/<board>, src/tetap/app, config/<robot>.hpp
    drivers       -> hal, src/tetap/base, src/tetap/app/samples.hpp
    config/messages.hpp -> src/tetap/bus, src/tetap/base       config/<robot>.hpp -> src/tetap/app
    sim_host      -> everything

### 4.2 Other

    src/tetap/base -> everything
"""
FILES = ["src/tetap/base/math.hpp", "src/tetap/base/time.hpp", "src/tetap/bus/signal.hpp", "src/tetap/filter/ekf.hpp", "src/tetap/app/firmware.hpp", "src/tetap/app/samples.hpp",
         "hal/board.hpp", "hal/chip/support/text.hpp", "hal/board/mps2/board.hpp", "hal/board/mps2/main.cpp", "hal/board/r5/board.hpp",
         "hal/board/linux/clock.hpp", "drivers/imu.hpp", "config/messages.hpp", "config/rover.hpp", "sim_host/world.hpp", "test/x.cpp"]


class LayersTest(ImageTest):
    def setUp(self):
        super().setUp()
        for name in FILES:
            self.put(name, "#pragma once\n")
        self.put("DESIGN.md", DESIGN)

    def put(self, name, text):
        path = os.path.join(self.folder, name)
        os.makedirs(os.path.dirname(path), exist_ok=True)
        with open(path, "w", encoding="utf-8") as file:
            file.write(text)

    def findings(self, name=None, text=None):
        if name:
            self.put(name, text)
        status, output = self.run_tool("check_layers", "--root", self.folder)
        if name and name in FILES:
            self.put(name, "#pragma once\n")
        found = [line for line in output.splitlines() if re.match(r"\S+:\d+: ", line)]
        self.assertEqual(status, 1 if found else 0, output)
        return found

    def test_a_clean_tree_passes(self):
        self.assertEqual(self.findings(), [])

    def test_includes_along_the_arrows_pass(self):
        for name, include in (("src/tetap/bus/signal.hpp", "tetap/base/math.hpp"), ("src/tetap/base/math.hpp", "tetap/base/time.hpp"), ("src/tetap/base/math.hpp", "time.hpp"),
                              ("src/tetap/app/firmware.hpp", "hal/board.hpp"), ("src/tetap/app/firmware.hpp", "config/messages.hpp"),
                              ("src/tetap/app/firmware.hpp", "drivers/imu.hpp"), ("drivers/imu.hpp", "tetap/app/samples.hpp"),
                              ("hal/board/mps2/board.hpp", "hal/chip/support/text.hpp"), ("hal/board/mps2/main.cpp", "hal/board/mps2/board.hpp"),
                              ("hal/board/mps2/main.cpp", "config/rover.hpp"), ("config/rover.hpp", "tetap/app/firmware.hpp"),
                              ("sim_host/world.hpp", "hal/board/linux/clock.hpp"), ("hal/board/mps2/main.cpp", "robot.hpp")):
            with self.subTest(f"{name} includes {include}"):
                self.assertEqual(self.findings(name, f'#include "{include}"\n'), [])
        self.assertEqual(self.findings("src/tetap/filter/ekf.hpp", "#include <Eigen/Core>\n#include <array>\n"), [])

    def test_includes_against_the_arrows_fail_with_file_and_line(self):
        for name, include in (("src/tetap/base/math.hpp", "tetap/bus/signal.hpp"), ("src/tetap/bus/signal.hpp", "tetap/filter/ekf.hpp"), ("src/tetap/filter/ekf.hpp", "tetap/app/firmware.hpp"),
                              ("src/tetap/app/firmware.hpp", "hal/board/mps2/board.hpp"), ("src/tetap/app/firmware.hpp", "config/rover.hpp"),
                              ("src/tetap/filter/ekf.hpp", "config/messages.hpp"), ("hal/board.hpp", "tetap/app/firmware.hpp"),
                              ("hal/board.hpp", "hal/chip/support/text.hpp"), ("drivers/imu.hpp", "tetap/app/firmware.hpp"),
                              ("hal/board/mps2/board.hpp", "hal/board/r5/board.hpp"), ("hal/board/mps2/main.cpp", "hal/board/r5/board.hpp"),
                              ("hal/board/mps2/board.hpp", "tetap/app/firmware.hpp"), ("config/messages.hpp", "tetap/app/firmware.hpp"),
                              ("src/tetap/base/math.hpp", "sim_host/world.hpp"), ("src/tetap/base/math.hpp", "../bus/signal.hpp"),
                              ("src/tetap/base/math.hpp", "tetap/bus/not_yet_generated.hpp"), ("hal/board/linux/clock.hpp", "tetap/app/firmware.hpp")):
            with self.subTest(f"{name} includes {include}"):
                found = self.findings(name, f'#pragma once\n/* two\nlines */\n  # include "{include}"\n')
                self.assertEqual(len(found), 1, found)
                self.assertTrue(found[0].startswith(f"{name}:4: "), found)
                self.assertIn("against the arrows", found[0])

    def test_eigen_only_where_the_table_says(self):
        self.assertIn("may not include Eigen", self.findings("src/tetap/base/math.hpp", "#include <Eigen/Core>\n")[0])

    def test_a_folder_outside_the_table_fails(self):
        self.assertIn("not in the table", self.findings("src/tetap/new_folder/x.hpp", '#include "tetap/base/math.hpp"\n')[0])

    def test_standard_headers_that_need_more_than_a_compiler_fail(self):
        for header in ("cmath", "iostream", "vector", "string", "functional", "memory", "chrono", "thread", "random", "cstdlib", "math.h", "ctime",
                       "map", "cstdio", "stdexcept", "unistd.h"):
            with self.subTest(header):
                self.assertEqual(len(self.findings("src/tetap/filter/ekf.hpp", f"#include <{header}>\n")), 1)
                self.assertEqual(self.findings("hal/board/linux/clock.hpp", f"#include <{header}>\n"), [])

    def test_each_forbidden_word_fails(self):
        for code in ("int* p = new int;", "auto p = new (place) T{};", "delete p;", "delete[] p;", "void* operator new(std::size_t);", "p = malloc(3);", "std::free(p);", "p = alloca(3);",
                     "p = __builtin_alloca(3);", "std::vector<int> v;", "std::string s;", "std::function<void()> f;", "std::unique_ptr<int> p;",
                     "std::map<int, int> m;", "Eigen::MatrixXf m;", "Eigen::VectorXd v;", "Eigen::Matrix<float, Eigen::Dynamic, 1> m;",
                     "throw 3;", "try { f(); }", "} catch (...) {", "dynamic_cast<A*>(b);", "typeid(a);", "virtual void f();", "std::sin(x);",
                     "y = ::cos(x);", "sinf(x);", "y = atan2f(a, b);", "std::sqrt(x);", "std::floor(x);", "y = sin(x);", "y = sqrt(x);", "__builtin_sinf(x);",
                     "std::abs(x) + std::pow(x, 2);", "std::fma(a, b, c);", "__builtin_sqrtf(x);", "std::chrono::seconds s;", "steady_clock::now();",
                     "clock_gettime(0, &t);", "t = time(nullptr);", "t = std::time(nullptr);", "t = board.now();", "const char* d = __DATE__;", "printf(\"x\");",
                     "std::cout << 1;", "std::mt19937 g;", "r = rand();", "std::mutex m;", "thread_local int t;", "long double x;", "setjmp(b);",
                     "std::abort();"):
            with self.subTest(code):
                found = self.findings("src/tetap/filter/ekf.hpp", f"#pragma once\n\n{code}\n")
                self.assertTrue(found and all(f.startswith("src/tetap/filter/ekf.hpp:3: ") for f in found), found or code)
        for place in ("drivers/imu.hpp", "config/rover.hpp", "hal/board.hpp", "hal/board/mps2/board.hpp", "src/tetap/base/math.hpp"):
            self.assertEqual(len(self.findings(place, "virtual void f();\n")), 1)

    def test_look_alikes_pass(self):
        code = """// new delete throw virtual std::vector sinf(x)
/* catch
   malloc(3) */
const char* text = "new int; throw \\" virtual";
const char* raw = R"(try { malloc(1) } )";
char quote = '"'; int after = 1'000'000; char other = '\\'';
A(const A&) = delete; void operator delete(void*) = delete;
float newest = base::sin(x) + base::atan2(y, x) + m.sqrt(); int freely = is_new + renew.delete_all;
float time_s = sample.time(); float exp_ = log_likelihood; clock.stop(); auto t = extend(now, 20); a.free(); timer.clock();
class Time { Time time; }; struct Virtual {}; int throwing, trying, catcher; Matrix<float, 3, 1> v; std::array<int, 3> a;
static_assert(noexcept(f())); std::string_view s; std::optional<int> o; using Vector = Eigen::Matrix<float, 3, 1>;
"""
        self.assertEqual(self.findings("src/tetap/filter/ekf.hpp", code), [])
        self.assertEqual(self.findings("src/tetap/base/math.hpp", "inline float sin(float x); inline float sqrt(float x) { return __builtin_sqrtf(x); }\n"), [])
        self.assertEqual(self.findings("src/tetap/app/firmware.hpp", "const auto t = board.now();\n"), [])
        self.assertEqual(self.findings("hal/board/linux/clock.hpp", "#include <vector>\nstd::vector<int> v; throw 1; clock_gettime(a, b);\n"), [])

    def test_the_table_is_read_from_the_design_and_a_broken_one_is_refused(self):
        self.put("src/tetap/bus/signal.hpp", '#include "tetap/filter/ekf.hpp"\n')
        self.assertEqual(len(self.findings()), 1)
        self.put("DESIGN.md", DESIGN.replace("src/tetap/bus       -> src/tetap/base", "src/tetap/bus       -> src/tetap/base, src/tetap/filter"))
        self.assertEqual(self.findings(), [])
        for broken, message in (("# nothing here\n", "has no table of arrows"), (DESIGN.replace("src/tetap/bus  ", "src/c+an  "), "DESIGN.md:7: 'src/c+an'")):
            self.put("DESIGN.md", broken)
            status, text = self.run_tool("check_layers", "--root", self.folder)
            self.assertEqual(status, 2)
            self.assertIn(message, text)

    def test_an_image_with_libm_or_a_clock_fails(self):
        good = self.image("volatile float x; float sine(float a) { return a * 3; } void work() { x = sine(x); }")
        self.assertEqual(self.run_tool("check_layers", "--image", good)[0], 0)
        bad = self.image('extern "C" float sinf(float); volatile float x; void work() { x = sinf(x); }', name="bad", link=["-lm"])
        status, text = self.run_tool("check_layers", "--image", good, bad)
        self.assertEqual(status, 1)
        self.assertIn("sinf: libm", text)
        self.assertIn("__math_invalidf: libm", text)
        clock = self.image('extern "C" [[gnu::noinline]] long clock() { asm volatile(""); return 3; } volatile long x; void work() { x = clock(); }', name="clock")
        self.assertIn("clock: clock", self.run_tool("check_layers", "--image", clock)[1])
        self.assertEqual(self.run_tool("check_layers", "--image", "/nowhere.elf")[0], 2)

    def test_the_build_of_one_program_or_image_rejects_it_before_anything_is_compiled(self):
        tree = self.path("tree")
        shutil.copytree(ROOT, tree, symlinks=True, ignore=lambda folder, names: (".git", "build", "out") if folder == ROOT else ())
        with open(os.path.join(tree, "src/tetap/base/math.hpp"), "a", encoding="utf-8") as file:
            file.write('#include "tetap/filter/update.hpp"\n')
        for target in ("host:tetap-world", "r5:tetap-zynqmp_r5-rover"):
            with self.subTest(target):
                done = subprocess.run([os.path.join(tree, "tools", "run", "build_preset"), target], capture_output=True, text=True)
                self.assertEqual(done.returncode, 1, done.stderr)
                self.assertRegex(done.stderr, r'src/tetap/base/math.hpp:\d+: #include "tetap/filter/update.hpp": against the arrows: src/tetap/base -> \(nothing\)')
                built = os.path.join(tree, "build", target.split(":")[0])
                objects = [f for top, _, files in os.walk(built) for f in files if f.endswith((".o", ".obj")) and "CompilerId" not in top]
                self.assertEqual(objects, [])

    def test_this_repository_is_clean(self):
        done = subprocess.run([os.path.join(PROOF, "check_layers")], capture_output=True, text=True, cwd=ROOT)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)


if __name__ == "__main__":
    unittest.main()
