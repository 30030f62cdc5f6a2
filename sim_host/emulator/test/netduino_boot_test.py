#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""netduino_boot_test.py TETAP-NODE IMAGE: QEMU's netduinoplus2, which nobody of this project wrote, executes the port's flash image.

The console's boot line is that of this host, and the fallback of a board without a clock tree is reported. Then the running core is made to fault through
QEMU's debugger: the handler stores the kind that silicon has, resets the core, and the image boots again."""
import os
import re
import socket
import struct
import subprocess
import sys
import tempfile
import time

BOOTS_S = 15  # the self-check is long in emulation
CODE = 0x2001FF00  # the end of the SRAM, which no section reaches
CPACR, CFSR = 0xE000ED88, 0xE000ED28
# Half-words of Thumb (ARM DDI 0403E.e A7.7), r0, and CFSR: UNDEFINSTR, UNALIGNED, PRECISERR with BFARVALID, NOCP. r1 is 0.
FAULTS = {
    "undefined instruction": ([0xDE00], 0, 1 << 16),
    "unaligned LDRD": ([0xE9D0, 0x1200], CODE + 2, 1 << 24),
    "read of nothing": ([0x6801], 0x60000000, 1 << 15 | 1 << 9),
    "floating point off": ([0x6001, 0xF3BF, 0x8F6F, 0xEE30, 0x0A00], CPACR, 1 << 19),  # str r1, [r0]; isb; vadd.f32 s0, s0, s0
}


class Debugger:
    """QEMU's gdbstub: memory, registers, one breakpoint. GDB manual, appendix "Remote Serial Protocol"."""

    def __init__(self, path):
        self.line = socket.socket(socket.AF_UNIX)
        self.line.settimeout(BOOTS_S)
        self.line.connect(path)
        self.rest = b""
        self.answer()  # the machine stops for its debugger
        self.ask("qXfer:features:read:target.xml:0,ffb")  # single registers are answered to those who know their names
        self.send("c")

    def send(self, text):
        self.line.sendall(f"${text}#{sum(text.encode()) & 0xFF:02x}".encode())

    def answer(self):
        while True:
            found = re.search(rb"\$([^#]*)#..", self.rest)
            if found:
                self.rest = self.rest[found.end():]
                self.line.sendall(b"+")
                return found[1].decode()
            more = self.line.recv(4096)
            if not more:
                sys.exit("netduino_boot_test: QEMU has gone")
            self.rest += more

    def ask(self, text):
        self.send(text)
        return self.answer()

    def interrupt(self):
        self.line.sendall(b"\x03")
        return self.answer()

    def word(self, address):
        return struct.unpack("<I", bytes.fromhex(self.ask(f"m{address:x},4")))[0]

    def register(self, number):
        return struct.unpack("<I", bytes.fromhex(self.ask(f"p{number:x}")))[0]

    def set_register(self, number, value):
        self.done(f"P{number:x}={struct.pack('<I', value).hex()}")

    def done(self, text):
        answer = self.ask(text)
        assert answer == "OK", f"{text}: {answer}"


def symbols(image):
    done = subprocess.run(["arm-none-eabi-nm", image], capture_output=True, text=True, check=True)
    return {name: int(at, 16) for at, _, name in (line.split() for line in done.stdout.splitlines() if len(line.split()) == 3)}


class Machine:
    def __init__(self, image, folder):
        self.console = os.path.join(folder, "console.txt")
        self.gdb = os.path.join(folder, "gdb")
        self.process = subprocess.Popen(["qemu-system-arm", "-M", "netduinoplus2", "-display", "none", "-monitor", "none", "-serial", "null",
                                         "-serial", f"file:{self.console}", "-gdb", f"unix:{self.gdb},server,nowait", "-kernel", image],
                                        stderr=subprocess.DEVNULL)

    def text(self):
        if not os.path.exists(self.console):
            return ""
        with open(self.console, encoding="ascii", errors="replace") as file:
            return file.read()

    def waits_for(self, words, count=1):
        end = time.monotonic() + BOOTS_S
        while time.monotonic() < end:
            if self.text().count(words) >= count:
                return True
            time.sleep(0.05)
        return False


def provoke(debugger, at, code, r0):
    """The running core goes on at `code`; CFSR as the fault's handler finds it."""
    debugger.interrupt()
    for i, half_word in enumerate([*code, 0xE7FE]):  # b .
        debugger.done(f"M{CODE + 2 * i:x},2:{struct.pack('<H', half_word).hex()}")
    debugger.set_register(0, r0)
    debugger.set_register(1, 0)
    debugger.set_register(15, CODE)
    debugger.done(f"Z0,{at['tetap_fault'] & ~1:x},2")
    debugger.ask("c")
    assert debugger.register(15) == at["tetap_fault"] & ~1
    cfsr = debugger.word(CFSR)
    debugger.done(f"z0,{at['tetap_fault'] & ~1:x},2")
    debugger.send("c")
    return cfsr


def main():
    node, image = sys.argv[1:]
    if not os.path.exists(image):
        print(f"netduino_boot_test: skipped: no {image}", file=sys.stderr)
        return 77
    expected = subprocess.run([node, "--boot-line", "--robot", "rover"], capture_output=True, text=True, check=True).stdout.strip()
    wrong = []
    with tempfile.TemporaryDirectory() as folder:
        machine = Machine(image, folder)
        try:
            if not machine.waits_for("tetap: stack"):
                wrong.append("the image does not boot")
            else:
                debugger, at = Debugger(machine.gdb), symbols(image)
                for number, (name, (code, r0, bits)) in enumerate(FAULTS.items(), 2):
                    cfsr = provoke(debugger, at, code, r0)
                    if cfsr != bits:
                        wrong.append(f"{name}: CFSR is {cfsr:#x}, expected {bits:#x}")
                    if not machine.waits_for("tetap: stack", number):
                        wrong.append(f"{name}: the image does not boot again")
                        break
            said = machine.text()
        finally:
            machine.process.kill()
            machine.process.wait()
    if expected not in said.splitlines():
        wrong.append(f"the boot line is not '{expected}'")
    if "tetap: netduinoplus2 up, no crystal: the internal oscillator" not in said:
        wrong.append("the fallback is not reported")
    if wrong:
        print("\n".join(f"netduino_boot_test: {one}" for one in [*wrong, said.strip()]), file=sys.stderr)
        return 1
    print(f"netduino_boot: '{expected}' as on this host, {len(FAULTS)} faults as on silicon, each with a reset")
    return 0


if __name__ == "__main__":
    sys.exit(main())
