#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
# tools/proof/check_stack against reality: the bound of small images holds and is close to the painted mark, and each way to escape it fails.
import os
import subprocess
import sys
import unittest

sys.dont_write_bytecode = True
sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from small_image import TOOLS, ImageTest  # noqa: E402

EIGEN = """
#include <Eigen/Core>
static Eigen::Matrix<float, 15, 15> P;
static Eigen::Matrix<float, 15, 1> x;
[[gnu::noinline]] void predict(float dt) {
  Eigen::Matrix<float, 15, 15> F = Eigen::Matrix<float, 15, 15>::Identity(), T;
  for (int i = 0; i < 12; ++i) F(i, i + 3) = dt;
  T = F.lazyProduct(P);
  P = T.lazyProduct(F.transpose());
}
[[gnu::noinline]] void update(int i, float z) {
  Eigen::Matrix<float, 15, 1> g = P.col(i);
  const float k = 1.0F / (P(i, i) + 0.1F);
  x += g * (k * (z - x(i)));
  P -= (g * k) * g.transpose();
}
void work() { predict(0.01F); update(1, 2.0F); }
"""

# Structs by value are stored from registers below the frame that GCC reports; memcpy is a library call; the switch is a jump table.
DEEP = """
struct Big { unsigned char b[300]; };
volatile int sink, which = 5;
[[gnu::noinline]] int leaf(Big b, int n) { Big c = b; asm volatile("" : "+m"(c)); return c.b[n]; }
[[gnu::noinline]] int middle(Big b, Big e, int n) { b.b[1] = e.b[2]; asm volatile("" : "+m"(b)); return leaf(b, n) + leaf(e, n); }
template <int N> [[gnu::noinline]] int down(int n) {
  int a[N * 8 + 8];
  asm volatile("" : "=m"(a));
  int r = 0;
  if constexpr (N > 0) { r = down<N - 1>(n + 1); } else { Big b{}; b.b[0] = static_cast<unsigned char>(n); r = middle(b, b, 1); }
  asm volatile("" : "+m"(a));
  return r + a[0];
}
[[gnu::noinline]] int choose(int k) {
  switch (k) {
    case 0: return down<1>(k);
    case 1: return down<2>(k) + 1;
    case 2: return 17;
    case 3: return down<3>(k) + 3;
    case 4: return 5 * sink;
    case 5: return down<6>(k) + 9;
    case 6: return down<4>(k);
    default: return 0;
  }
}
void work() { sink = choose(which); }
"""

POINTER = """
volatile int sink, which;
[[gnu::noinline]] static int small(int n) { volatile int a[4] = {n}; return a[0]; }
[[gnu::noinline]] static int large(int n) { volatile int a[200]; a[0] = n; a[150] = n; return a[n & 127]; }
int (*const table[2])(int) = {small, large};
[[gnu::noinline]] int dispatch(int i) { return table[i & 1](i) + 1; }
void work() { sink = dispatch(which); sink = dispatch(which + 1); }
"""


class StackTest(ImageTest):
    def measure(self, elf, core):
        done = subprocess.run([os.path.join(TOOLS, "run", "emulate_mps2"), "--cpu", core, elf], capture_output=True, text=True, check=True)
        return self.path("run.log", done.stdout + done.stderr)  # semihosting writes to stderr

    def stack(self, *arguments):
        return self.run_tool("check_stack", "--no-budget", *arguments)

    def test_the_bound_holds_and_is_close_to_the_painted_mark(self):
        for name, program in (("eigen", EIGEN), ("deep", DEEP)):
            for core in ("m7", "m4f"):
                with self.subTest(name, core=core):
                    elf = self.image(program, core, name)
                    status, text = self.stack(f"{elf}={self.measure(elf, core)}")
                    self.assertEqual(status, 0, text)
                    found = self.json("stack.json")[name]
                    # Above the mark lie only the frame of an exception and a word or two that the deepest function did not write.
                    self.assertLessEqual(found["measured"], found["bound"])
                    self.assertLessEqual(found["bound"] - found["measured"], 108 + 24, text)
                    self.assertEqual(found["reservation"], 8192)

    def test_optimisation_does_not_matter(self):
        for level in ("-O0", "-Os", "-O3"):
            with self.subTest(level):
                elf = self.image(DEEP, "m7", "deep" + level, [level])
                status, text = self.stack(f"{elf}={self.measure(elf, 'm7')}")
                self.assertEqual(status, 0, text)

    def test_a_cortex_r5f_image_is_bounded_too(self):
        elf = self.image(DEEP, "r5", "deep")
        status, text = self.stack(elf)
        self.assertEqual(status, 0, text)
        self.assertGreater(self.json("stack.json")["deep"]["bound"], 1500)

    def test_a_measurement_above_the_bound_fails(self):
        elf = self.image(EIGEN)
        status, text = self.stack(f"{elf}=8000")
        self.assertEqual(status, 1)
        self.assertIn("above the bound", text)

    def test_a_measurement_far_below_the_bound_needs_an_explanation(self):
        elf = self.image(EIGEN)
        status, text = self.stack(f"{elf}=500")
        self.assertEqual(status, 1)
        self.assertIn("below 60%", text)
        bounds = self.path("bounds.txt", "measured im* the run of this test is short\nlibrary memset 16 x\nlibrary memcpy 16 x\n")
        status, text = self.stack("--bounds", bounds, f"{elf}=500")
        self.assertEqual(status, 0, text)
        self.assertIn("the run of this test is short", text)

    def test_the_log_of_another_image_is_refused(self):
        elf = self.image(EIGEN)
        status, text = self.stack(f"{elf}={self.path('other.log', 'tetap: stack 1000 of 4096')}")
        self.assertEqual(status, 2)
        self.assertIn("another image's log", text)

    def test_a_call_through_a_pointer_must_be_listed(self):
        elf = self.image(POINTER)
        status, text = self.stack(elf)
        self.assertEqual(status, 1)
        self.assertIn("unlisted indirect call", text)
        self.assertIn("dispatch", text)
        bounds = self.path("bounds.txt", "library memset 16 x\nlibrary memcpy 16 x\ncall _Z8dispatchi -> _ZL5smalli, _ZL5largei  the table\n")
        status, text = self.stack("--bounds", bounds, f"{elf}={self.measure(elf, 'm7')}")
        self.assertEqual(status, 0, text)
        self.assertGreater(self.json("stack.json")["image"]["bound"], 800)

    def test_a_listed_target_that_is_too_few_is_noticed_by_the_run(self):
        elf = self.image(POINTER)
        bounds = self.path("bounds.txt", "library memset 16 x\nlibrary memcpy 16 x\ncall _Z8dispatchi -> _ZL5smalli  forgot one\n")
        status, text = self.stack("--bounds", bounds, f"{elf}={self.measure(elf, 'm7')}")
        self.assertEqual(status, 1)
        self.assertIn("the proof has a hole", text)

    def test_a_library_call_must_be_listed_with_enough_bytes(self):
        elf = self.image("unsigned long long volatile v = 9; void work() { v = v / (v - 2); }")
        bounds = self.path("bounds.txt", "library memset 16 x\n")
        status, text = self.stack("--bounds", bounds, elf)
        self.assertEqual(status, 1)
        self.assertIn("unlisted library call", text)
        self.assertIn("calls __aeabi_uldivmod", text)
        bounds = self.path("bounds.txt", "library __aeabi_uldivmod 8 too few\n")
        status, text = self.stack("--bounds", bounds, elf)
        self.assertEqual(status, 1)
        self.assertIn("its machine code needs", text)

    def test_recursion_fails(self):
        elf = self.image("volatile int s; [[gnu::noinline]] int odd(int n); [[gnu::noinline]] int even(int n) { return n ? odd(n - 1) + 1 : 1; }"
                         "int odd(int n) { return n ? even(n - 1) + 2 : 0; } void work() { s = even(5); }")
        status, text = self.stack(elf)
        self.assertEqual(status, 1)
        self.assertIn("recursion: even(int) -> odd(int) -> even(int)", text)

    def test_a_frame_that_depends_on_data_fails(self):
        elf = self.image("volatile int s, n = 30; [[gnu::noinline]] int f(int k) { volatile char* p = (char*)__builtin_alloca(k); p[0] = 1;"
                         "p[k - 1] = 2; return p[0] + p[k - 1]; } void work() { s = f(n); }")
        status, text = self.stack(elf)
        self.assertEqual(status, 1)
        self.assertIn("depends on data", text)

    def test_assembly_that_calls_behind_the_compiler_fails(self):
        elf = self.image('volatile int s; extern "C" [[gnu::noinline, gnu::used]] int hidden(int n) { volatile int a[300]; a[1] = n; return a[1]; }'
                         '[[gnu::noinline]] int f(int n) { register int r asm("r0") = n; asm volatile("bl hidden" : "+r"(r) : : "r1", "r2",'
                         '"r3", "ip", "lr", "memory"); return r; } void work() { s = f(3); }')
        status, text = self.stack(elf)
        self.assertEqual(status, 1)
        self.assertIn("calls hidden, GCC's graph has no such call", text)

    def test_room_is_what_a_frame_grows_by_until_it_no_longer_fits(self):
        def frame_of(words):
            return self.image(f"volatile int s; [[gnu::noinline]] int f(int n) {{ volatile int a[{words}]; a[n] = n; return a[7]; }} void work() {{ s = f(3); }}")

        self.assertEqual(self.stack(frame_of(400))[0], 0)
        found = self.json("stack.json")["image"]
        room = found["reservation"] - found["bound"]
        self.assertEqual(self.stack(frame_of(400 + room // 8 * 2))[0], 0)
        self.assertEqual(self.json("stack.json")["image"]["bound"], found["bound"] + room // 8 * 8)
        self.assertEqual(self.stack(frame_of(400 + room // 8 * 2 + 2))[0], 1)
        elf = frame_of(400)
        self.assertEqual(self.stack("--room", str(room), elf)[0], 0)
        status, text = self.stack("--room", str(room + 1), elf)
        self.assertEqual(status, 1)
        self.assertIn(f"no room: with {room + 1} bytes more in one frame", text)

    def test_a_bound_above_the_reservation_fails(self):
        elf = self.image("volatile int s; [[gnu::noinline]] int f(int n) { volatile int a[3000]; a[n] = n; return a[7]; } void work() { s = f(3); }")
        status, text = self.stack(elf)
        self.assertEqual(status, 1)
        self.assertIn("above the reservation of 8192", text)

    def test_a_source_without_call_graph_fails(self):
        elf = self.image(EIGEN)
        os.remove(elf.replace(".elf", ".ci"))
        status, text = self.stack(elf)
        self.assertEqual(status, 2)
        self.assertIn("no call graph", text)

    def test_an_image_without_budget_fails(self):
        status, text = self.run_tool("check_stack", self.image(EIGEN, name="unheard_of"))
        self.assertEqual(status, 1)
        self.assertIn("no stack budget", text)

    def test_bad_input_is_one_message(self):
        for arguments, message in ((["/nowhere.elf"], "/nowhere.elf: No such file"), ([__file__], "not a 32-bit"),
                                   (["--bounds", self.path("b.txt", "nonsense\n"), "x.elf"], "b.txt:1: expected")):
            status, text = self.stack(*arguments)
            self.assertEqual(status, 2)
            self.assertIn(message, text)
            self.assertEqual(text.count("\n"), 1, text)


if __name__ == "__main__":
    unittest.main()
