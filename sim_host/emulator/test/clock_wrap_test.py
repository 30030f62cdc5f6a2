#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""clock_wrap_test.py TETAP-BOARD TETAP-PLAY: the rover's flash image while its clock's words wrap.

The image is compiled with a count of SysTick that begins 3 s before 2^32 microseconds (71.6 min after start), and 3 s before 2^32 milliseconds
(49.7 days). Nobody sends the time of the bus, so the node's own time runs through the wrap. Nothing that a user sees may show it."""
import importlib.machinery
import importlib.util
import os
import sys
import tempfile

sys.dont_write_bytecode = True
HERE = os.path.dirname(os.path.realpath(__file__))
ROOT = os.path.dirname(os.path.dirname(os.path.dirname(HERE)))
HEADER = "hal/chip/arm/systick_clock.hpp"
START = "volatile std::uint32_t low_ = 0; "
WRAPS_MS = {"2^32 us": (1 << 32) // 1000, "2^32 ms": 1 << 32}
BEFORE_MS, SECONDS = 3000, 6


def load(name):
    """A script of this folder as a module."""
    loader = importlib.machinery.SourceFileLoader(name.split(".")[0], os.path.join(HERE, name))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader(loader.name, loader))
    loader.exec_module(module)
    return module


def overlay_with(start_ms, folder):
    """A folder of headers in which the count of milliseconds begins at `start_ms`."""
    with open(os.path.join(ROOT, HEADER), encoding="utf-8") as source:
        text = source.read()
    assert text.count(START) == 1, f"{HEADER}: '{START}' occurs {text.count(START)} times"
    path = os.path.join(folder, HEADER)
    os.makedirs(os.path.dirname(path))
    with open(path, "w", encoding="utf-8") as out:
        out.write(text.replace(START, START.replace("0;", f"{start_ms}U;")))
    return folder


def main():
    board, play = sys.argv[1:]
    if not os.access(board, os.X_OK):
        print(f"clock_wrap_test: skipped: no {board} (libunicorn-dev)", file=sys.stderr)
        return 77
    faults, seeded = load("image_faults_test.py"), load("seeded_image")
    faults.CASES["wrap"] = (["--seconds", str(SECONDS), "--no-clock"], True, {
        "no reset": lambda r: r.board["resets"] == 0,
        "no packet of the IMU is lost": lambda r: r.board["imu_packets_lost"] == 0,
        "the drivers count no fault": lambda r: sum(faults.most(r.values("Imu", name)) for name in ("ImuBusFault", "ImuFifo", "ImuStall", "ImuRestarts")) == 0,
        "the drivers run": lambda r: r.last("Imu", "ImuState") == "Running" and r.last("Wired", "GnssState") == "Running",
        "no jump of time, no late sample": lambda r: not faults.fault_flags(r, 2) and r.states("Mode")[-1][1] == "Nominal",
        "ticks come on time": lambda r: faults.longest_pause(r, faults.FIELDS.identifier["Est_StateCrc"]) < 0.015,
        "samples come on time": lambda r: faults.longest_pause(r, 0x306) < 0.025 and faults.longest_pause(r, 0x30A) < 0.5},
        100 * (SECONDS - 1))
    failed = False
    for words, wrap_ms in WRAPS_MS.items():
        with tempfile.TemporaryDirectory() as folder:
            image, error = seeded.build("ark_cannode", overlay_with(wrap_ms - BEFORE_MS, os.path.join(folder, "overlay")), folder)
            if image is None:
                print(f"clock_wrap_test: {words}: does not compile: {error}", file=sys.stderr)
                return 1
            compared, wrong = faults.judge("wrap", (board, play), image, folder)
        failed |= bool(wrong)
        print(f"{words:24} {compared:5} epochs repeated, {'ok' if not wrong else 'WRONG: ' + '; '.join(wrong)}", flush=True)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
