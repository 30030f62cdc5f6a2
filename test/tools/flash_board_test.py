#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""tools/run/flash_board with tools that only write down what they were called with: what it prints is what it runs, what is missing is one sentence with
the way to get it, and nothing touches a board before tool, probe and image are there."""
import hashlib
import os
import shutil
import struct
import subprocess
import tempfile
import sys
import unittest

sys.dont_write_bytecode = True
ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))
TOOL = os.path.join(ROOT, "tools", "run", "flash_board")
sys.path.insert(0, os.path.join(ROOT, "tools", "python"))

from tetap import image_header  # noqa: E402


def code(address, board="ark_cannode", robot="rover"):
    """A whole image that does nothing, with its header."""
    header = image_header.Header(0, 0xABCDEF10, 1024, address, board, robot)
    image = bytearray(1024)
    image[0x200:0x25C] = header.packed()
    header.crc = image_header.crc_of(image)
    image[0x200:0x25C] = header.packed()
    return bytes(image)




def elf(address, stored):
    """An ELF file for ARM with one section of code at `address` and one symbol."""
    names, strings = b"\0.text\0.shstrtab\0.symtab\0.strtab\0", b"\0start\0"
    symbols = bytes(16) + struct.pack("<IIIBBH", 1, address, 4, 0x12, 0, 1)
    parts, offset = [], 84
    for content in (stored, names, symbols, strings):
        parts.append((offset, len(content)))
        offset += len(content)
    sections = [(0,) * 10, (1, 1, 6, address, *parts[0], 0, 0, 4, 0), (7, 3, 0, 0, *parts[1], 0, 0, 1, 0), (17, 2, 0, 0, *parts[2], 4, 1, 4, 16),
                (25, 3, 0, 0, *parts[3], 0, 0, 1, 0)]
    start = b"\x7fELF\x01\x01\x01" + bytes(9) + struct.pack("<HHIIIIIHHHHHH", 2, 40, 1, address, 52, offset, 0x05000000, 52, 32, 1, 40, len(sections), 2)
    load = struct.pack("<8I", 1, 84, address, address, len(stored), len(stored), 5, 4)
    return start + load + stored + names + symbols + strings + b"".join(struct.pack("<10I", *section) for section in sections)


class FlashBoard(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.bin = os.path.join(self.folder.name, "bin")
        os.makedirs(self.bin)
        for needed in ("python3", "bash", "arm-none-eabi-objdump", "arm-none-eabi-c++filt"):
            if found := shutil.which(needed):
                os.symlink(found, os.path.join(self.bin, needed))
        self.calls = os.path.join(self.folder.name, "calls")
        self.image = os.path.join(self.folder.name, "robot.elf")
        self.store(0x08000000)

    def store(self, address, board="ark_cannode", image=None):
        self.code = code(address, board) if image is None else image
        with open(self.image, "wb") as file:
            file.write(elf(address, self.code))
        with open(self.image.replace(".elf", ".bin"), "wb") as file:
            file.write(self.code)

    def install(self, tool, prints="", status=0):
        path = os.path.join(self.bin, tool)
        with open(path, "w", encoding="utf-8") as file:
            file.write(f"#!{shutil.which('bash')}\necho {tool} \"$@\" >>{self.calls}\necho '{prints}'\nexit {status}\n")
        os.chmod(path, 0o755)

    def flash(self, *options, status=0, board="ark_cannode", **environment):
        done = subprocess.run([TOOL, "--board", board, "--image", self.image, *options], capture_output=True, text=True, check=False,
                              env={"PATH": self.bin, **environment})
        self.assertEqual(done.returncode, status, done.stdout + done.stderr)
        return done.stdout + done.stderr

    def called(self):
        if not os.path.exists(self.calls):
            return []
        with open(self.calls, encoding="utf-8") as file:
            return file.read().splitlines()

    def test_what_it_prints_is_what_it_runs(self):
        self.install("st-flash")
        self.install("st-info", "Found 1 stlink programmers\n  serial:     0669FF")
        printed = self.flash("--probe", "stlink")
        flashing = f"st-flash --reset write {self.image.replace('.elf', '.bin')} 0x08000000"
        self.assertIn(f"flash: {flashing}\n", printed)
        self.assertIn(f"robot.bin, 1024 bytes, sha256 {hashlib.sha256(self.code).hexdigest()}, to 0x08000000", printed)
        self.assertIn("SWDIO is PA13", printed)
        self.assertEqual(self.called(), ["st-info --probe", flashing])

    def test_an_image_behind_a_boot_loader_goes_where_it_was_linked(self):
        self.store(0x08010000)
        self.install("dfu-util", "Found DFU: [0483:df11] ver=2200")
        printed = self.flash("--probe", "dfu")
        self.assertIn("expect no USB device", printed)
        self.assertIn("-s 0x08010000:leave", self.called()[-1])

    def test_openocd_verifies_and_takes_another_probe(self):
        self.install("openocd")
        self.flash("--probe", "openocd", TETAP_OPENOCD_INTERFACE="interface/cmsis-dap.cfg")
        self.assertEqual(self.called()[0], "openocd -f interface/cmsis-dap.cfg -f target/stm32f4x.cfg -c init; exit")
        self.assertIn(f"program {{{self.image}}} verify reset exit", self.called()[1])

    def test_the_plan_has_size_and_hash_of_the_file_that_is_written(self):
        for probe, ending in (("stlink", ".bin"), ("openocd", ".elf"), ("dfu", ".bin")):
            path = self.image.replace(".elf", ending)
            with open(path, "rb") as file:
                content = file.read()
            planned = self.flash("--probe", probe, "--dry-run")
            self.assertIn(f"robot{ending}, {len(content)} bytes, sha256 {hashlib.sha256(content).hexdigest()}", planned)
            self.assertIn(path, planned.splitlines()[-2])
        os.remove(self.image.replace(".elf", ".bin"))
        self.assertIn("robot.bin: No such file", self.flash("--probe", "dfu", "--dry-run", status=2))

    def test_each_board_has_its_chip_and_its_connector(self):
        self.install("openocd")
        self.store(0x08000000, "nucleo_g474re")
        printed = self.flash("--probe", "openocd", board="nucleo_g474re")
        self.assertIn("onto the Nucleo-G474RE by its USB connector CN1", printed)
        self.assertEqual(self.called()[0], "openocd -f interface/stlink.cfg -f target/stm32g4x.cfg -c init; exit")
        dry = self.flash("--probe", "dfu", "--dry-run", board="nucleo_g474re")
        self.assertIn("PA11 and PA12", dry)
        self.assertIn("dry run, nothing was written", dry)

    def test_what_is_missing_is_named_before_anything_is_written(self):
        self.assertIn("st-flash is not installed: apt-get install stlink-tools", self.flash("--probe", "stlink", status=2))
        self.install("st-flash")
        self.install("st-info", "Found 0 stlink programmers")
        said = self.flash("--probe", "stlink", status=2)
        self.assertIn("no stlink probe with a board on it: st-info --probe: Found 0 stlink programmers; plug the probe", said)
        self.install("openocd", "Error: open failed", 1)
        self.assertIn("Error: open failed", self.flash("--probe", "openocd", status=2))
        self.install("dfu-util", "dfu-util 0.11")
        self.assertIn("no dfu probe", self.flash("--probe", "dfu", status=2))
        self.assertEqual([call for call in self.called() if " write " in call or "program" in call or "-D" in call], [])

    def test_wrong_names_are_one_line(self):
        for options, what in ((("--probe", "jlink"), "no probe 'jlink'; there are: stlink openocd dfu"),
                              (("--probe", "stlink", "--image", "/nowhere.elf", "--dry-run"), "is not there: make firmware BOARD=ark_cannode ROBOT=rover")):
            said = self.flash(*options, status=2)
            self.assertIn(what, said)
            self.assertEqual(said.count("\n"), 1, said)
        self.assertIn("no board 'zynqmp_r5' that can be flashed; there are: ", self.flash(status=2, board="zynqmp_r5"))
        for board in ("", "linux"):  # make without BOARD= passes linux
            said = self.flash(status=2, board=board)
            self.assertEqual(said, "flash: which board? BOARD=NAME, one of: ark_cannode nucleo_g474re\n")

    def test_a_wrong_damaged_or_cut_image_is_refused_in_one_line(self):
        self.install("st-flash")
        self.install("st-info", "serial: 1")
        whole = code(0x08000000)
        flipped = whole[:700] + bytes([whole[700] ^ 1]) + whole[701:]
        for image, what in ((code(0x08000000, "nucleo_g474re"), "for board 'nucleo_g474re', not for 'ark_cannode'"), (flipped, "damaged: CRC-32 "),
                            (whole[:1000], "1000 bytes, its header says 1024: cut or joined"), (bytes(1024), "without an image header"),
                            (code(0x08010000), "for 0x08010000, not for 0x08000000")):
            self.store(0x08000000, image=image)
            for probe in ("stlink", "openocd"):
                said = self.flash("--probe", probe, "--dry-run", status=2)
                if probe == "stlink":
                    self.assertIn(what, said)
                self.assertEqual(said.count("\n"), 1, said)
        self.assertEqual(self.called(), [])

    def test_a_dry_run_is_1_or_nothing(self):
        self.assertIn("dry run, nothing was written", self.flash("--probe", "stlink", DRY_RUN="1"))
        for setting in ("0", "yes", "01"):
            self.assertEqual(self.flash("--probe", "stlink", status=2, DRY_RUN=setting), f"flash: DRY_RUN={setting}: it is 1 or empty\n")

    def test_a_failed_tool_is_a_failure(self):
        self.install("st-info", "serial: 1")
        self.install("st-flash", "Unknown chip", 1)
        self.assertIn("Unknown chip", self.flash("--probe", "stlink", status=1))

    def test_openocds_last_error_is_shown_whatever_it_says_afterwards(self):
        talk = "Error: early\nError: init mode failed (unable to connect to the target)\nin procedure program\n** OpenOCD init failed **\nshutdown command invoked"
        self.install("openocd", talk, 1)
        self.assertIn("-c 'init; exit': Error: init mode failed (unable to connect to the target); plug", self.flash("--probe", "openocd", status=2))
        with open(os.path.join(self.bin, "openocd"), "w", encoding="utf-8") as file:  # the probe is there, the flash is not
            file.write(f"#!{shutil.which('bash')}\ncase \"$*\" in *program*) ;; *) exit 0 ;; esac\necho '{talk.replace('init mode', 'write')}' >&2\nexit 1\n")
        said = self.flash("--probe", "openocd", status=1)
        self.assertIn("Error: early\n", said)
        self.assertTrue(said.endswith("flash: openocd failed: Error: write failed (unable to connect to the target)\n"), said)

    def test_a_dry_run_needs_no_tool_and_touches_nothing(self):
        for probe in ("stlink", "openocd", "dfu"):
            said = self.flash("--probe", probe, "--dry-run")
            self.assertIn("dry run, nothing was written", said)
            self.assertIn("is not installed: apt-get install", said)
        self.install("st-flash")
        self.install("st-info", "serial: 1")
        self.assertIn("st-flash --reset write", self.flash("--probe", "stlink", "--dry-run"))
        self.assertEqual(self.called(), [])


if __name__ == "__main__":
    unittest.main()
