#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""qemu_judge CORE.elf: QEMU's Cortex-M4 (netduinoplus2) executes programs/core.cpp. Its faults, masks, priorities and floating-point results are
what machine_test.cpp expects of the emulated board; both stand on the same literal values."""
import os
import subprocess
import sys
import time

SHARED, WORDS = 0x20020000, 64
FORCED = 1 << 30
UNDEFINED, INVALID_STATE, NO_COPROCESSOR, UNALIGNED = 1 << 16, 1 << 17, 1 << 19, 1 << 24

# choice: expected words by index; the numbers of the choices are those of the enumeration in choices.hpp.
EXPECTED = {
    2: {0: 6, 1: 100, 2: 5, 3: 101, 4: 102, 5: 5, 6: 103, 60: 0x600D},
    3: {0: 5, 1: 12, 2: 10, 3: 1000, 4: 11, 5: 200, 60: 0x600D},
    5: {30: 3, 31: UNDEFINED, 32: FORCED},
    7: {30: 3, 31: NO_COPROCESSOR, 32: FORCED},
    8: {30: 3, 31: UNALIGNED, 32: FORCED},
    9: {30: 3, 31: INVALID_STATE, 32: FORCED},
    15: {60: 0x600D},
    16: {1: 11, 2: 400, 60: 0x600D},
    17: {30: 3, 31: UNALIGNED, 32: FORCED},
}


def run(image, choice):
    """The shared words, the choice left out."""
    machine = subprocess.Popen(
        ["qemu-system-arm", "-M", "netduinoplus2", "-display", "none", "-serial", "null", "-monitor", "stdio", "-kernel", image,
         "-device", f"loader,addr={SHARED},data={choice},data-len=4"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    time.sleep(0.4)  # the programs take some thousand instructions, then sleep
    out, _ = machine.communicate(f"xp /{WORDS}wx {SHARED:#x}\nquit\n", timeout=60)
    words = [int(word, 16) for line in out.splitlines() if line[:8].strip("0123456789abcdef") == "" and ": 0x" in line
             for word in line.split(": ")[1].split()]
    return words[1:]


def main():
    if not os.path.exists(sys.argv[1]):
        print(f"qemu_judge: skipped: no {sys.argv[1]}", file=sys.stderr)
        sys.exit(77)
    wrong = []
    for choice, expected in EXPECTED.items():
        words = run(sys.argv[1], choice)
        if len(words) != WORDS - 1:
            sys.exit(f"qemu_judge: choice {choice}: QEMU answered {len(words)} words")
        wrong += [f"choice {choice}: word {i} is {words[i]:#x}, expected {value:#x}" for i, value in expected.items() if words[i] != value]
    if wrong:
        sys.exit("\n".join(wrong))
    print(f"qemu_judge: {len(EXPECTED)} programs, all as expected")


main()
