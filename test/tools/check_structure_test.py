#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
# tools/proof/check_structure goes red on one seeded violation of each rule, stays green on its look-alikes, and the repository itself is green.
import os
import subprocess
import sys
import tempfile
import unittest

sys.dont_write_bytecode = True
ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))
TOOL = os.path.join(ROOT, "tools", "proof", "check_structure")


def struct(name, members, before="", after=""):
    return f"{before}class {name} {{\n public:\n  void update(int a, int b) {{\n    if (a) b = 1;\n  }}\n\n private:\n{members}}};\n{after}"


def many(count, kind="int"):
    return "".join(f"  {kind} m{i}_ = 0;\n" for i in range(count))


class Structure(unittest.TestCase):
    def run_tool(self, files, *words):
        with tempfile.TemporaryDirectory() as folder:
            for name, text in files.items():
                path = os.path.normpath(os.path.join(folder, "estimators", "inertial", name))
                os.makedirs(os.path.dirname(path), exist_ok=True)
                with open(path, "w", encoding="utf-8") as file:
                    file.write("// SPDX\nnamespace tetap::estimators {\n" + text + "}  // namespace\n")
            done = subprocess.run([TOOL, os.path.join(folder, "estimators"), *words], capture_output=True, text=True, check=False)
            return done.returncode, done.stdout

    def red(self, files, *said):
        status, output = self.run_tool(files)
        self.assertEqual(status, 1, output)
        self.assertEqual(len(output.strip().splitlines()), 1, output)
        for words in said:
            self.assertIn(words, output)

    def green(self, files):
        status, output = self.run_tool(files)
        self.assertEqual(status, 0, output)

    def test_members(self):
        self.green({"a.hpp": struct("A", many(15))})
        self.red({"a.hpp": struct("A", many(16))}, "A has 16 data members", "a.hpp:3:")
        self.red({"a.hpp": struct("A", many(8) + "  float x = 0, y = 0;\n  std::array<float, 3> a_{}, b_{};\n" + many(4, "nav::Ins"))}, "16")

    def test_members_of_nested_structs_count_through(self):
        nested = "  struct Part {\n    float a = 0;\n    Vector3 b = Vector3::Zero();\n  };\n"
        self.green({"a.hpp": struct("A", many(13) + nested + "  Part part_;\n")})
        self.red({"a.hpp": struct("A", many(12) + nested + "  Part first_, second_;\n")}, "A has 16")
        self.green({"a.hpp": struct("A", many(15) + nested)})
        self.red({"a.hpp": struct("A", many(3) + "  struct Part {\n" + many(16) + "  };\n")}, "A::Part has 16")

    def test_parts_of_the_composition(self):
        ok = {"a.hpp": struct("A", many(1))}
        self.green(ok | {"../../checks/b.hpp": struct("B", many(15)), "../../filter/c.hpp": struct("C", many(30))})
        for part in ("checks", "nav"):
            self.red(ok | {f"../../{part}/b.hpp": struct("B", many(16))}, "B has 16 data members", f"{part}/b.hpp:3:")

    def test_what_is_no_member(self):
        self.green({"a.hpp": struct("A", many(15) + "  static constexpr float kLimit = 4.0F, kOther = 2;\n  using Mean = std::array<float, 2>;\n  enum class E { kA, kB };\n"
                                    "  [[nodiscard]] bool holds(int n = 3) const;\n  template <class T>\n  void f(T&& t);\n  // int commented_ = 0;\n")})

    def test_functions(self):
        body = "".join(f"  a += {i};\n" for i in range(58))
        self.green({"a.hpp": "inline void f(int& a) {\n" + body + "}\n"})
        self.red({"a.hpp": "inline void f(int& a) {\n" + body + "  a += 58;\n}\n"}, "f() has 61 lines")
        self.red({"a.hpp": "int A::f(int& a) const {\n  if (a) {\n" + body + "  }\n  return a;\n}\n"}, "A::f() has 63 lines")

    def test_only_recovery_changes_the_covariance(self):
        for write in ("ins_.p(8, 8) += x", "ins_.p = x", "ins.p += x", "ins.p(3 + i, kYaw) = 0", "p(i, f(j)) *= 2"):
            self.red({"a.hpp": f"inline void f() {{ {write}; }}\n"}, "writes p(r, c)")
        for verb in ("inflate(8, x)", "inflate_up(x)", "inflate_along(d, x)", "reset(0, x)", "start(x, p)", "place(x, y, s)"):
            self.red({"sources/a.hpp": f"inline void f() {{ ins_.{verb}; }}\n"}, "only recovery.hpp")
            self.green({"recovery.hpp": f"inline void f() {{ ins.{verb}; }}\n"})
        self.green({"a.hpp": "inline bool f() { const float x = p(8, 8) + p(0, 1); return x == p(1, 1) && x <= p(2, 2); }  // p(8, 8) = 0\n"})

    def test_sources(self):
        self.red({"sources/a.hpp": '#include "tetap/estimators/inertial/sources/b.hpp"\n'}, "includes the source b", "FilterView")
        self.green({"sources/a.hpp": '#include "tetap/estimators/inertial/filter_view.hpp"\n', "all.hpp": '#include "tetap/estimators/inertial/sources/a.hpp"\n'})

    def test_comments(self):
        self.red({"a.hpp": struct("A", "  int a_ = 0;  ///< that was heard\n")}, "relative")
        self.green({"a.hpp": struct("A", "  int a_ = 0;  ///< offset of the fixes that were refused\n")})

    def test_no_folder(self):
        done = subprocess.run([TOOL, "/nowhere"], capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 1)
        self.assertIn("no folder /nowhere/inertial", done.stderr)

    def test_repository(self):
        done = subprocess.run([TOOL], capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 0, done.stdout)


if __name__ == "__main__":
    unittest.main()
