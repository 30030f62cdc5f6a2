# SPDX-License-Identifier: Apache-2.0
# Small Cortex-M and Cortex-R5F images for the tests of the proving tools: the product's linker script, a start of a few lines that
# paints the stack, and a program given as text.
import json
import os
import shutil
import subprocess
import tempfile
import unittest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
TOOLS = os.path.join(ROOT, "tools")
PROOF = os.path.join(TOOLS, "proof")
CORES = {
    "m7": ["-mcpu=cortex-m7", "-mfpu=fpv5-d16", "-mfloat-abi=hard", "-mthumb"],
    "m4f": ["-mcpu=cortex-m4", "-mfpu=fpv4-sp-d16", "-mfloat-abi=hard", "-mthumb"],
    "r5": ["-mcpu=cortex-r5", "-mfpu=vfpv3-d16", "-mfloat-abi=hard", "-marm"],
}
FLAGS = ["-std=c++20", "-O2", "-ffp-contract=off", "-fno-math-errno", "-ffunction-sections", "-fdata-sections", "-fno-exceptions",
         "-fno-rtti", "-fno-threadsafe-statics", "-fno-use-cxa-atexit", "-fno-unwind-tables", "-fno-asynchronous-unwind-tables",
         "-DEIGEN_DONT_VECTORIZE", "-DEIGEN_NO_MALLOC", "-DEIGEN_CACHEFRIENDLY_PRODUCT_THRESHOLD=64", "-DEIGEN_NO_DEBUG",
         "-isystem", "/usr/include/eigen3", "-I" + ROOT, "-I" + os.path.join(ROOT, "src"), "-fstack-usage", "-fcallgraph-info=su"]

# libgcc's divisions refer to the unwinder, as in hal/chip/support/runtime.cpp.
START = {"m": """
#include <cstdint>
extern "C" void __aeabi_unwind_cpp_pr0();
[[gnu::weak]] void __aeabi_unwind_cpp_pr0() {}
extern "C" std::uint32_t __stack_bottom[], __stack_top[], __data_start[], __data_end[], __data_load[], __bss_start[], __bss_end[];
void work();
extern "C" void print_stack() {
  unsigned clean = 0, size = static_cast<unsigned>(__stack_top - __stack_bottom);
  while (clean < size && *const_cast<volatile std::uint32_t*>(__stack_bottom + clean) == 0xA5A5A5A5) ++clean;
  static char line[40] = "stack 00000 of 00000\\n";
  const unsigned numbers[] = {(size - clean) * 4, size * 4};
  for (int n = 0; n < 2; ++n) {
    unsigned value = numbers[n];
    for (int i = 4; i >= 0; --i, value /= 10) line[(n ? 15 : 6) + i] = static_cast<char>('0' + value % 10);
  }
  register int r0 asm("r0") = 4;
  register const char* r1 asm("r1") = line;
  asm volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
}
extern "C" int main() {
  for (auto *from = __data_load, *to = __data_start; to < __data_end;) *to++ = *from++;
  work();
  print_stack();
  return 0;
}
extern "C" [[gnu::naked]] void tetap_vector() { asm volatile("b ."); }
extern "C" [[gnu::naked, gnu::used]] void tetap_reset() {
  asm volatile("ldr r0,=0xE000ED88\\n ldr r1,[r0]\\n orr r1,#0xF00000\\n str r1,[r0]\\n dsb\\n isb\\n"
               "ldr r0,=__stack_bottom\\n ldr r1,=__stack_top\\n ldr r2,=0xA5A5A5A5\\n 1: str r2,[r0],#4\\n cmp r0,r1\\n blo 1b\\n"
               "bl main\\n mov r0,#0x18\\n ldr r1,=0x20026\\n bkpt 0xab\\n b .\\n .ltorg");
}
struct Vectors { const void* top; void (*reset)(); void (*others[14])(); };
[[gnu::used, gnu::section(".vectors")]] constinit const Vectors vectors{__stack_top, tetap_reset, {tetap_vector, tetap_vector}};
""", "r": """
extern "C" void __aeabi_unwind_cpp_pr0();
[[gnu::weak]] void __aeabi_unwind_cpp_pr0() {}
void work();
extern "C" int main() { work(); return 0; }
extern "C" [[gnu::naked, gnu::used, gnu::section(".vectors")]] void _start() { asm volatile("b reset\\n b .\\n b .\\n b .\\n b .\\n"); }
extern "C" [[gnu::naked, gnu::used]] void reset() { asm volatile("cps #0x1F\\n ldr sp,=__stack_top\\n mrc p15,0,r0,c1,c0,2\\n"
  "orr r0,r0,#(0xF<<20)\\n mcr p15,0,r0,c1,c0,2\\n isb\\n mov r0,#(1<<30)\\n vmsr fpexc,r0\\n"
  "ldr r0,=__stack_bottom\\n ldr r1,=__stack_top\\n ldr r2,=0xA5A5A5A5\\n 1: str r2,[r0],#4\\n cmp r0,r1\\n blo 1b\\n bl main\\n b .\\n .ltorg"); }
"""}


class ImageTest(unittest.TestCase):
    """A folder for images, gone after each test."""

    def setUp(self):
        self.folder = tempfile.mkdtemp(prefix="tetap-tools-test.")
        self.addCleanup(shutil.rmtree, self.folder)

    def path(self, name, text=None):
        path = os.path.join(self.folder, name)
        if text is not None:
            with open(path, "w", encoding="utf-8") as file:
                file.write(text)
        return path

    def build(self, command):
        done = subprocess.run(command, capture_output=True, text=True)
        self.assertEqual((done.returncode, done.stderr), (0, ""))

    def image(self, program, core="m7", name="image", flags=(), link=()):
        """Path of the image of a program whose work() is called."""
        folder = tempfile.mkdtemp(prefix=f"{name}-{core}-", dir=self.folder)
        objects = []
        for file, text in ((f"{name}.cpp", program), ("start.cpp", START[core[0]])):
            source = os.path.join(folder, file)
            with open(source, "w", encoding="utf-8") as out:
                out.write(text)
            objects.append(source.replace(".cpp", ".obj"))
            self.build(["arm-none-eabi-g++"] + FLAGS + CORES[core] + list(flags) + ["-c", source, "-o", objects[-1]])
        script = os.path.join(ROOT, "hal", "board", "zynqmp_r5" if core == "r5" else "mps2", "link.ld")
        elf = os.path.join(folder, name + ".elf")
        self.build(["arm-none-eabi-g++"] + CORES[core] + ["-nostdlib", "-nostartfiles", "-T", script, "-Wl,--gc-sections",
                        "-Wl,-Map=" + elf.replace(".elf", ".map"), "-Wl,--defsym=_stack_size=8192", "-o", elf] + objects + list(link) +
                       ["-Wl,--start-group", "-lc", "-lgcc", "-Wl,--end-group"])
        return elf

    def run_tool(self, tool, *arguments):
        """(status, everything printed) of a tool; JSON goes to the test's folder."""
        out = [] if tool == "check_layers" else ["--out", self.folder]
        done = subprocess.run([os.path.join(PROOF, tool)] + out + list(arguments), capture_output=True, text=True)
        self.assertNotIn("Traceback", done.stderr)
        return done.returncode, done.stdout + done.stderr

    def json(self, name):
        with open(self.path(name), encoding="utf-8") as file:
            return json.load(file)
