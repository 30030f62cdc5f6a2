#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The header of a flash image: the linker script keeps its place, tools/run/seal_image fills it in all three files, and what is read again is refused after
any damage: each byte changed, each cut, each field forged with a CRC-32 that fits (zlib's)."""
import os
import shutil
import struct
import subprocess
import sys
import tempfile
import unittest
import zlib

sys.dont_write_bytecode = True
ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))
sys.path.insert(0, os.path.join(ROOT, "tools", "python"))

from tetap import image_header  # noqa: E402

PROGRAM = """
struct Vectors { const void* top; void (*reset)(); };
extern "C" const unsigned __stack_top;
extern "C" void tetap_reset() { for (;;) continue; }
[[gnu::used, gnu::section(".vectors")]] const Vectors vectors{&__stack_top, tetap_reset};
[[gnu::used]] int initialised = 42;
struct Commit { char mark[12]; unsigned number; };
extern const Commit commit;
[[gnu::used]] const Commit commit{"tetap-git:", 0xABCDEF11};
"""


class ImageHeader(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.mkdtemp(prefix="tetap-image-header.")
        self.addCleanup(shutil.rmtree, self.folder)
        self.elf, self.bin = (os.path.join(self.folder, f"small.{kind}") for kind in ("elf", "bin"))

    def seal(self, board="ark_cannode", robot="rover"):
        return subprocess.run([os.path.join(ROOT, "tools", "run", "seal_image"), self.elf, "--board", board, "--robot", robot], capture_output=True, text=True,
                              check=False)

    def link(self, board, *options):
        source = os.path.join(self.folder, "small.cpp")
        with open(source, "w", encoding="utf-8") as file:
            file.write(PROGRAM)
        subprocess.run(["arm-none-eabi-g++", "-std=c++20", "-mcpu=cortex-m4", "-mthumb", "-nostdlib", "-nostartfiles", f"-L{ROOT}", "-Wl,--fatal-warnings",
                        "-T", os.path.join(ROOT, "hal", "board", board, "link.ld"), *options, source, "-o", self.elf], check=True)
        subprocess.run(["arm-none-eabi-objcopy", "-O", "binary", self.elf, self.bin], check=True)

    def content(self, path):
        with open(path, "rb") as file:
            return file.read()

    def small(self):
        """A sealed image of 700 bytes without a linker."""
        image = bytearray(i * 7 % 256 for i in range(700))
        image[0x200:0x25C] = struct.pack("<8sIIIII32s32s", b"tetapIMG", 0, 0xABCDEF10, 1, 700, 0x08000000, b"ark_cannode", b"rover")
        return self.with_crc(image)

    def with_crc(self, image):
        image[0x208:0x20C] = b"\xff\xff\xff\xff"
        image[0x208:0x20C] = struct.pack("<I", zlib.crc32(image))
        return bytes(image)

    def refusal(self, file):
        with self.assertRaises(image_header.Refused) as caught:
            image_header.read(file)
        self.assertNotIn("\n", str(caught.exception))
        return str(caught.exception)

    @unittest.skipUnless(shutil.which("arm-none-eabi-g++"), "no arm-none-eabi-g++")
    def test_a_linked_image_is_sealed_in_its_files(self):
        for board, options, address in (("ark_cannode", (), 0x08000000), ("ark_cannode", ("-Wl,--defsym=_flash_offset=0x10000",), 0x08010000),
                                        ("nucleo_g474re", (), 0x08000000)):
            self.link(board, *options)
            self.assertIn("never filled", self.refusal(self.content(self.bin)))
            self.assertEqual(self.seal(board).returncode, 0)
            for path in (self.elf, self.bin):
                header = image_header.read(self.content(path))
                self.assertEqual((header.board, header.robot, header.address, header.length, header.version()),
                                 (board, "rover", address, os.path.getsize(self.bin), "abcdef1-dirty"))
            again = os.path.join(self.folder, "again.bin")
            for fill in ("0", "0xff"):
                subprocess.run(["arm-none-eabi-objcopy", "-O", "binary", "--gap-fill", fill, self.elf, again], check=True)
                self.assertEqual(self.content(again), self.content(self.bin), "a gap between two sections")
            self.assertEqual(self.content(self.bin)[0x208:0x20C], self.with_crc(bytearray(self.content(self.bin)))[0x208:0x20C])
            sizes = subprocess.run(["arm-none-eabi-objdump", "-h", self.elf], capture_output=True, text=True, check=True).stdout
            self.assertRegex(sizes, r"\.image_header .*\n.*READONLY, DATA")

    @unittest.skipUnless(shutil.which("arm-none-eabi-g++"), "no arm-none-eabi-g++")
    def test_what_cannot_be_sealed_is_one_line(self):
        self.link("ark_cannode")
        for board, robot, what in (("a" * 32, "rover", "at most 31"), ("ark_cannode", "Rover", "at most 31")):
            done = self.seal(board, robot)
            self.assertEqual((done.returncode, done.stderr.count("\n")), (1, 1))
            self.assertIn(what, done.stderr)
        with open(self.bin, "ab") as file:
            file.write(b"\0")
        self.assertIn("small.bin is not what small.elf stores", self.seal().stderr)
        os.remove(self.bin)
        self.assertEqual(self.seal().returncode, 2)

    @unittest.skipUnless(shutil.which("arm-none-eabi-g++"), "no arm-none-eabi-g++")
    def test_a_cut_elf_file_is_refused(self):
        self.link("ark_cannode")
        self.seal()
        whole = self.content(self.elf)
        stored = max(offset + size for kind, offset, _, _, size, *_ in
                     (struct.unpack_from("<8I", whole, 52 + 32 * i) for i in range(struct.unpack_from("<H", whole, 44)[0])) if kind == 1)
        for length in (*range(0, 200), *range(200, stored, 37), stored - 1):
            self.refusal(whole[:length])
        image_header.read(whole[:stored])

    def test_every_cut_and_every_changed_byte_is_refused(self):
        whole = self.small()
        self.assertEqual(image_header.read(whole).version(), "abcdef1")
        for length in range(len(whole)):
            self.refusal(whole[:length])
        for at in range(len(whole)):
            for change in (1, 0x80, 0xFF):
                self.refusal(whole[:at] + bytes([whole[at] ^ change]) + whole[at + 1:])
        self.assertEqual(self.refusal(whole + b"\0"), "701 bytes, its header says 700: cut or joined")

    def test_every_forged_field_is_refused_even_with_a_fitting_crc(self):
        for at, content, what in ((0x200, b"tetapIMH", "without an image header"), (0x210, b"\2", "layout 2, known is 1"), (0x214, b"\0\1", "says 256"),
                                  (0x21C, b"\0", "no board"), (0x21C, b"a/../b", "no board"), (0x23B, b"x", "no board"), (0x23C, b"\xff", "robot"),
                                  (0x25B, b"x", "robot")):
            image = bytearray(self.small())
            image[at:at + len(content)] = content
            self.assertIn(what, self.refusal(self.with_crc(image)))
        image = bytearray(self.small())
        image[0x208:0x20C] = bytes(4)
        self.assertIn("its header says 0x00000000", self.refusal(bytes(image)))


if __name__ == "__main__":
    unittest.main()
