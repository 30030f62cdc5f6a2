#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
# tools/proof/check_heap and tools/proof/check_size go red on each thing they are there to find, and name who brought it.
import os
import sys
import unittest

sys.dont_write_bytecode = True
sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from small_image import ImageTest  # noqa: E402

SBRK = 'extern "C" void* _sbrk(int n) { static char area[4096]; static int at; at += n; return area + at - n; }\n'


class HeapTest(ImageTest):
    def offending(self, elf):
        status, text = self.run_tool("check_heap", elf)
        found = {o["symbol"]: o for o in self.json("heap.json")["image"]["offending"]}
        self.assertEqual(status, 1 if found else 0, text)
        return found, text

    def test_an_image_without_heap_passes_on_every_core(self):
        for core in ("m7", "m4f", "r5"):
            with self.subTest(core):
                found, text = self.offending(self.image("volatile long long s = 3; void work() { s = s / (s + 1); }", core))
                self.assertEqual(found, {}, text)

    def test_malloc_is_found_with_its_caller(self):
        found, text = self.offending(self.image(
            "#include <cstdlib>\n" + SBRK + "void* volatile keep; [[gnu::noinline]] void caller() { keep = std::malloc(30); } void work() { caller(); }"))
        for name in ("malloc", "_malloc_r", "_sbrk"):
            self.assertIn(name, found)
        self.assertIn("_Z6callerv", found["malloc"]["by"])
        self.assertIn("linked for image.obj", found["malloc"]["by"])

    def test_each_other_way_to_a_heap_is_found(self):
        cases = {
            "operator new(unsigned int)": "[[gnu::noinline]] void* operator new(unsigned n) { asm volatile(\"\"); static char a[64]; return a + n; } int* volatile k; struct S { int a[5]; };"
                                          "[[gnu::noinline]] void* f() { return ::operator new(8); } void work() { k = (int*)f(); }",
            "operator delete(void*, unsigned int)": "[[gnu::noinline]] void operator delete(void*, unsigned) noexcept { asm volatile(\"\"); } int* volatile k; void work() { delete k; }",
            "free": 'extern "C" [[gnu::noinline]] void free(void*) { asm volatile(""); } void* volatile k; void work() { free(k); }',
            "__cxa_atexit": 'extern "C" [[gnu::noinline]] int __cxa_atexit(void (*)(void*), void*, void*) { asm volatile(""); return 0; }'
                            "void work() { __cxa_atexit(nullptr, nullptr, nullptr); }",
            "_Unwind_Resume": 'extern "C" [[gnu::noinline]] void _Unwind_Resume() { asm volatile(""); } void work() { _Unwind_Resume(); }',
            "BlockPool::take(int)": "struct BlockPool { char b[99]; [[gnu::noinline]] void* take(int i) { asm volatile(\"\"); return b + i; } };"
                                    "static BlockPool blocks; void* volatile k; void work() { k = blocks.take(3); }",
            "scratch_arena": "char scratch_arena[100]; char* volatile k; void work() { k = scratch_arena; }",
            "my::allocate(int)": "namespace my { char area[9]; [[gnu::noinline]] void* allocate(int n) { asm volatile(\"\"); return area + n; } }"
                                 "void* volatile k; void work() { k = my::allocate(3); }",
        }
        for symbol, program in cases.items():
            with self.subTest(symbol):
                found, text = self.offending(self.image(program))
                self.assertIn(symbol, found, text)

    def test_a_heap_section_is_found(self):
        found, text = self.offending(self.image('[[gnu::section(".heap"), gnu::used]] char space[64]; void work() { asm volatile("" : : "r"(space)); }'))
        self.assertIn("section .heap", found, text)

    def test_names_that_only_contain_such_words_pass(self):
        found, text = self.offending(self.image(
            "int spool_depth, sheaparound, allocution; template <class T> struct Holder { T t; }; struct std_allocator_tag {};"
            "[[gnu::noinline]] int f(std_allocator_tag, int n) { asm volatile(\"\"); return n; } volatile int k;"
            "void work() { k = f({}, spool_depth + sheaparound + allocution); }", flags=["-fdata-sections"]))
        self.assertEqual(found, {}, text)

    def test_a_stub_of_the_unwinder_that_does_nothing_passes_and_one_that_works_fails(self):
        stub = 'extern "C" [[gnu::used, gnu::noinline]] void __aeabi_unwind_cpp_pr0() { %s } void work() { __aeabi_unwind_cpp_pr0(); }'
        found, text = self.offending(self.image(stub % 'asm volatile("");'))
        self.assertEqual(found, {}, text)
        found, text = self.offending(self.image(stub % 'asm volatile("nop\\n nop\\n wfi");'))
        self.assertIn("__aeabi_unwind_cpp_pr0", found, text)

    def test_bad_input_is_one_message(self):
        status, text = self.run_tool("check_heap", "/nowhere.elf")
        self.assertEqual((status, text), (2, "check_heap: /nowhere.elf: No such file or directory\n"))


class SizeTest(ImageTest):
    def test_sections_are_summed_into_flash_and_ram(self):
        elf = self.image("extern const int constants[100]; const int constants[100] = {1, 2}; volatile int k; volatile int initial[50] = {2}; volatile int zero[200];"
                         "void work() { zero[1] = initial[2] + constants[k]; }")
        status, text = self.run_tool("check_size", "--no-budget", elf)
        self.assertEqual(status, 0, text)
        found = self.json("size.json")["image"]
        self.assertEqual(found["stack"], 8192)
        self.assertGreaterEqual(found["rodata"], 400)
        self.assertGreaterEqual(found["data"], 200)
        self.assertGreaterEqual(found["bss"], 800)
        self.assertEqual(found["flash"], found["text"] + found["rodata"] + found["data"])
        self.assertEqual(found["ram"], found["data"] + found["bss"] + found["stack"])
        self.assertIn("zero", [s["symbol"] for s in found["largest"]])

    def test_an_image_above_its_budget_or_without_one_fails(self):
        elf = self.image("volatile int zero[20000]; void work() { zero[1] = 2; }", name="smoke")
        status, text = self.run_tool("check_size", elf)
        self.assertEqual(status, 1)
        self.assertIn("FAIL smoke: ram", text)
        elf = self.image("void work() {}", name="unheard_of")
        status, text = self.run_tool("check_size", elf)
        self.assertEqual(status, 2)
        self.assertIn("no size budget for unheard_of", text)


if __name__ == "__main__":
    unittest.main()
