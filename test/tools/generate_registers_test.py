#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
# tools/run/generate_registers: what it makes of a small SVD file is what the file says, mistakes are one clear line, and the headers that are checked
# in are what the vendor's SVD files make anew (skipped where $TETAP_DATA/svd is not there).
import os
import re
import subprocess
import tempfile
import unittest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))
TOOL = os.path.join(ROOT, "tools", "run", "generate_registers")
HEADERS = {name: os.path.join(ROOT, "hal", "chip", "stm32", f"registers_{name.lower()}.hpp") for name in ("STM32F412", "STM32G474")}
DATA = os.environ.get("TETAP_DATA", os.path.join(ROOT, "..", "shared", "data"))

REGISTER = ("<register><name>{name}</name><description>text</description><addressOffset>{offset}</addressOffset><resetValue>{reset}</resetValue>"
            "<fields><field><name>AB_cd</name><bitOffset>4</bitOffset><bitWidth>3</bitWidth></field></fields></register>")
SVD = ("<device><name>Small</name><version>1.0</version><peripherals>"
       "<peripheral><name>ONE</name><baseAddress>0x40001000</baseAddress><interrupt><name>ONE_up</name><value>7</value></interrupt><registers>"
       + REGISTER.format(name="CR", offset="0x4", reset="0x12") + "".join(REGISTER.format(name=f"S{i}R", offset=hex(16 + 8 * i), reset="0") for i in range(3))
       + "</registers></peripheral><peripheral derivedFrom='ONE'><name>TWO</name><baseAddress>0X40002000</baseAddress></peripheral></peripherals></device>")
LIST = 'svd = "small.svd"\nnamespace = "x"\ninterrupts = ["ONE_up"]\n[one]\nperipherals = ["ONE", "TWO"]\nCR = "AB_cd"\n"S#R" = ""\n'


class Registers(unittest.TestCase):
    def run_tool(self, svd, wanted, *options):
        with tempfile.TemporaryDirectory() as folder:
            os.makedirs(os.path.join(folder, "svd"))
            for name, text in (("svd/small.svd", svd), ("list.toml", wanted)):
                with open(os.path.join(folder, name), "w", encoding="utf-8") as file:
                    file.write(text)
            done = subprocess.run([TOOL, *options, os.path.join(folder, "list.toml")], env=os.environ | {"TETAP_DATA": folder}, capture_output=True,
                                  text=True, check=False)
            made = os.path.join(folder, "list.hpp")
            if not os.path.exists(made):
                return done.returncode, done.stderr, ""
            with open(made, encoding="utf-8") as file:
                return done.returncode, done.stderr, file.read()

    def test_addresses_fields_series_and_interrupts_are_those_of_the_file(self):
        status, error, text = self.run_tool(SVD, LIST)
        self.assertEqual((status, error), (0, ""))
        for line in ("kOne = 0x40001000;", "kTwo = 0x40002000;", "kOneUp = 7;", "namespace cr {", "kOffset = 0x004;", "kResetValue = 0x00000012;",
                     "kAbCd{4, 3};", "namespace sxr {", "kOffset = 0x010;", "kStride = 0x08, kCount = 3;"):
            self.assertIn(line, text)

    def test_mistakes_are_named(self):
        for wanted, what in ((LIST.replace("AB_cd", "XY"), "ONE.CR has no field XY"), (LIST.replace("CR =", "ZR ="), "ONE has no register ZR"),
                             (LIST.replace('"TWO"', '"SIX"'), "no peripheral SIX"), (LIST.replace("ONE_up", "down"), "no interrupt down"),
                             (LIST.replace("interrupts", "interupts"), "no 'interrupts'"), ("[", "list.toml")):
            status, error, _ = self.run_tool(SVD, wanted)
            self.assertEqual(status, 1, what)
            self.assertIn(what, error)
            self.assertEqual(error.count("\n"), 1, error)
        self.assertIn("not at one distance", self.run_tool(SVD.replace("0x18", "0x1c"), LIST)[1])
        self.assertIn("not XML", self.run_tool("<device>", LIST)[1])

    def test_a_stale_header_is_red_and_a_missing_svd_is_its_own_status(self):
        with tempfile.TemporaryDirectory() as folder:
            done = subprocess.run([TOOL, "--check"], env=os.environ | {"TETAP_DATA": folder}, capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 2)
        self.assertRegex(done.stderr, r"STM32F4\d\d\.svd: No such file")

    @unittest.skipUnless(os.path.exists(os.path.join(DATA, "svd", "STM32F412.svd")), "no $TETAP_DATA/svd")
    def test_the_headers_in_the_repository_are_what_the_vendors_files_make(self):
        self.assertEqual(subprocess.run([TOOL, "--check"], capture_output=True, text=True, check=False).stderr, "")
        with open(os.path.join(DATA, "svd", "SHA256SUMS"), encoding="utf-8") as file:
            sums = {name: value for value, name in (line.split() for line in file)}
        for name, path in HEADERS.items():
            with open(path, encoding="utf-8") as file:
                self.assertEqual(re.search(r"sha256 ([0-9a-f]{64})", file.read())[1], sums[name + ".svd"])
            with open(path.replace(".hpp", ".toml"), encoding="utf-8") as file:
                wanted = file.read()
            with tempfile.TemporaryDirectory() as folder:
                stale = os.path.join(folder, "registers.toml")
                with open(stale, "w", encoding="utf-8") as file:
                    file.write(wanted)
                with open(path, encoding="utf-8") as file, open(stale.replace(".toml", ".hpp"), "w", encoding="utf-8") as out:
                    out.write(file.read().replace("kOffset = 0x008", "kOffset = 0x00C", 1))
                done = subprocess.run([TOOL, "--check", stale], capture_output=True, text=True, check=False)
            self.assertEqual(done.returncode, 1, name)
            self.assertIn("stale", done.stderr)

    def test_a_peripherals_own_name_in_front_of_a_register_is_left_out(self):
        svd = SVD.replace("<name>CR</name>", "<name>ONE_CR</name>")
        status, error, text = self.run_tool(svd, LIST)
        self.assertEqual((status, error), (0, ""))
        self.assertIn("/// ONE.CR: text\nnamespace cr {", text)


if __name__ == "__main__":
    unittest.main()
