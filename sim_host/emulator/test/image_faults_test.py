#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""image_faults_test.py TETAP-BOARD TETAP-PLAY IMAGE [--whole | CASE...]: faults of the hardware around the rover's running flash image.

Each run ends in a state that the node names on CAN, its models complain of nothing, and what its log holds is repeated on this host byte for byte.
--whole: every case; else those that are cheap or of their own kind. Pages of Est_Diag are decoded from config/tetap.dbc, not by the node's code."""
import json
import os
import re
import subprocess
import sys
import tempfile

sys.dont_write_bytecode = True
ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__)))))
sys.path.insert(0, os.path.join(ROOT, "tools", "python"))
from tetap.can.faulty_log import Fields  # noqa: E402

FIELDS = Fields()
LINE = re.compile(r"\((\d+\.\d{6})\) \S+ ([0-9A-F]{3})#([0-9A-F]{16})$")


def names(signal):
    """Names of a signal's values, from its VAL_ line."""
    with open(os.path.join(ROOT, "config", "tetap.dbc"), encoding="utf-8") as dbc:
        found = re.search(rf'^VAL_ \d+ {signal} (.*);$', dbc.read(), re.M)
    return {int(number): name for number, name in re.findall(r'(-?\d+) "([^"]*)"', found[1])}


PAGES = {number: name for number, name in names("Diag_Page").items()}
VALUES = {"ImuState": names("Diag_ImuState"), "GnssState": names("Diag_GnssState"), "BootCause": names("Diag_BootCause"),
          "Fault": names("Diag_Fault"), "Mode": names("Status_Mode")}


class Run:
    """What one run left: pages of diagnosis, status, frames, the comparison with its repetition."""

    def __init__(self, folder, replayed):
        self.replayed = replayed
        with open(os.path.join(folder, "board.json"), encoding="utf-8") as file:
            self.board = json.load(file)
        with open(os.path.join(folder, "run.json"), encoding="utf-8") as file:
            self.replay = json.load(file)
        with open(os.path.join(folder, "console.txt"), encoding="ascii") as file:
            self.console = file.read()
        self.pages, self.status, self.count, self.times = [], [], {}, {}
        with open(os.path.join(folder, "raw.log"), encoding="ascii") as log:
            for line in log:
                found = LINE.match(line)
                if found:
                    self.take(float(found[1]), int(found[2], 16), int.from_bytes(bytes.fromhex(found[3]), "little"))

    def take(self, time_s, identifier, payload):
        self.count[identifier] = self.count.get(identifier, 0) + 1
        self.times.setdefault(identifier, []).append(time_s)
        if identifier == FIELDS.identifier["Est_Diag"]:
            self.pages.append((time_s, PAGES.get(payload & 0xF), payload))
        elif identifier == FIELDS.identifier["Est_Status"]:
            self.status.append((time_s, payload))

    def values(self, page, signal, after=0.0):
        """(time, value) of a signal of a page of Est_Diag."""
        return [(t, self.named(signal, FIELDS.get(payload, "Est_Diag", signal))) for t, name, payload in self.pages if name == page and t >= after]

    def states(self, signal, after=0.0):
        return [(t, self.named(signal, FIELDS.get(payload, "Est_Status", signal))) for t, payload in self.status if t >= after]

    @staticmethod
    def named(signal, raw):
        return VALUES[signal][raw] if signal in VALUES else raw

    def last(self, page, signal):
        found = self.values(page, signal)
        assert found, f"no page {page} on the bus"
        return found[-1][1]


def most(pairs):
    return max((value for _, value in pairs), default=0)


def fault_flags(run, after=0.0, before=1e9):
    """Names of the faults in Est_Status."""
    flags = names("Status_Faults")
    return {flags[1 << bit] for time_s, word in run.states("Faults", after) if time_s < before for bit in range(16) if word >> bit & 1}


def longest_pause(run, identifier):
    times = run.times[identifier]
    return max(later - earlier for earlier, later in zip(times, times[1:]))


# RM0402 and RM0440, IWDG: 200 ms at the nominal 32 kHz are 6400 cycles of the oscillator.
WATCHDOG_CYCLES = 6400
# What differs between the boards: limits of the watchdog's oscillator (DS11139 and DS12288), and the cases that run without --whole.
BOARDS = {
    "ark_cannode": {"lsi_hz": (17_000, 32_000, 47_000), "short": [
        "healthy", "no_imu", "fifo_overflows", "watchdog", "gnss_at_another_rate", "foreign_frames", "bus_off", "stack_overflows", "loop_stalled_lsi_17"]},
    "nucleo_g474re": {"lsi_hz": (29_500, 32_000, 34_000), "short": ["no_imu", "watchdog", "bus_off", "bus_never_joined", "stack_overflows", "no_crystal"]},
}
LSI_HZ = sorted({hz for board in BOARDS.values() for hz in board["lsi_hz"]})
KICK_S = 0.012  # a loop comes round at each millisecond, or after a tick


def loop_stalled(lsi_hz):
    return f"loop_stalled_lsi_{lsi_hz // 1000}"


def watchdog_ends_a_stalled_loop(lsi_hz):
    """The loop stands still while interrupts go on: the reset comes at the computed time."""
    due_s = WATCHDOG_CYCLES / lsi_hz
    return ["--seconds", "4", "--lsi", str(lsi_hz), "--fault", "loop_stalled@2"], True, {
        "one reset": lambda r: r.board["resets"] == 1,
        f"at {due_s:.3f} s after the last kick": lambda r: due_s - KICK_S < r.board["reset_times_s"][0] - r.board["upset_s"] <= due_s + 1e-4,
        "kicked twice before the fastest oscillator is due": lambda r: 0 < r.board["watchdog_longest_gap_s"] < WATCHDOG_CYCLES / max(LSI_HZ) / 2,
        "its cause is on the bus": lambda r: r.last("Boot", "BootCause") == "Watchdog",
        "it runs again": lambda r: r.last("Imu", "ImuState") == "Running"}


def fault_of_the_core(name, kind, at=None):
    """A fault's record outlives the reset and goes out; `at`: where the program stood."""
    return ["--seconds", "4", "--fault", f"{name}@2"], True, {
        "one reset, at once": lambda r: r.board["resets"] == 1 and 0 <= r.board["reset_times_s"][0] - r.board["upset_s"] < 0.001,
        "its cause is on the bus": lambda r: r.last("Boot", "BootCause") == "CpuFault",
        "its kind is on the bus": lambda r: r.last("Boot", "Fault") == kind,
        "its place is on the bus": lambda r: at is None or at(r.last("Boot", "FaultPc")),
        "the console names it": lambda r: "a fault ended the last run" in r.console,
        "it runs again": lambda r: r.last("Imu", "ImuState") == "Running" and r.status[-1][0] > 3.9}


def stuck_miso(level):
    return ["--seconds", "6", "--fault", f"miso_{level}@1.5+1.5"], True, {
        "the driver starts anew": lambda r: r.last("Imu", "ImuRestarts") >= 1,
        "it is off meanwhile": lambda r: "Running" not in seen([v for v in r.values("Imu", "ImuState", 2.7) if v[0] < 3.9]),
        "the node says that an input is gone": lambda r: "InputStale" in fault_flags(r, 2.5, 4.0),
        "wheels and fixes go on": lambda r: longest_pause(r, 0x306) < 0.05 and longest_pause(r, 0x30A) < 0.5,
        "it runs again": lambda r: r.last("Imu", "ImuState") == "Running",
        "no reset": lambda r: r.board["resets"] == 0}


def seen(pairs):
    return {value for _, value in pairs}


# Each case: options of tetap-board, whether its log can be repeated to its end, what is asserted of a Run, and how many epochs are repeated at
# least (100). The world starts at 1 s.
CASES = {
    "healthy": (["--seconds", "5"], True, {
        "the IMU runs": lambda r: r.last("Imu", "ImuState") == "Running",
        "its driver found no fault": lambda r: most(r.values("Imu", "ImuBusFault")) + most(r.values("Imu", "ImuFifo")) + most(r.values("Imu", "ImuStall")) == 0,
        "the receiver was set to 115200": lambda r: r.last("Wired", "GnssState") == "Running" and r.last("Wired", "GnssBaud") == 115_200,
        "five fixes a second": lambda r: 3 * 5 <= r.count[0x30A] <= 4 * 5 + 1,
        "power on is the boot's cause": lambda r: r.last("Boot", "BootCause") == "PowerOn",
        "a chip that is 0.3 % fast has the shorter tick": lambda r: -4000 < r.last("Imu", "ImuClock") < -2000}),
    "no_imu": (["--seconds", "4", "--no-imu"], True, {
        "the driver does not get beyond its identity": lambda r: "Running" not in seen(r.values("Imu", "ImuState")),
        "the node waits for an IMU": lambda r: "WaitingForImu" in seen(r.states("Mode")),
        "wheels and fixes go on": lambda r: r.count.get(0x306, 0) > 300 and r.count.get(0x30A, 0) > 8}),
    "wrong_identity": (["--seconds", "3", "--who-am-i", "0x11"], True, {
        "the identity is counted": lambda r: r.last("Imu", "ImuIdentity") > 0,
        "the chip is not used": lambda r: "Running" not in seen(r.values("Imu", "ImuState"))}),
    "imu_dies": (["--seconds", "9", "--fault", "imu_dead@2+1.5"], True, {
        "the driver starts anew": lambda r: r.last("Imu", "ImuRestarts") >= 1,
        "it is off while the chip is": lambda r: "Running" not in seen([v for v in r.values("Imu", "ImuState", 3.8) if v[0] < 4.4]),
        "it runs again": lambda r: r.last("Imu", "ImuState") == "Running"}),
    "imu_power_dips": (["--seconds", "5", "--fault", "imu_power_lost@2"], True, {
        "the driver starts anew": lambda r: r.last("Imu", "ImuRestarts") >= 1,
        "it runs again": lambda r: r.last("Imu", "ImuState") == "Running"}),
    "imu_stalls": (["--seconds", "5", "--fault", "imu_stalled@2+1"], True, {
        "the stall is counted": lambda r: r.last("Imu", "ImuStall") >= 1,
        "it runs again": lambda r: r.last("Imu", "ImuState") == "Running"}),
    "fifo_overflows": (["--seconds", "6", "--fault", "core_stalled@2+0.15"], True, {
        "the FIFO's loss is counted": lambda r: r.last("Imu", "ImuFifo") >= 1,
        "no reset": lambda r: r.board["resets"] == 0,
        "it runs again": lambda r: r.last("Imu", "ImuState") == "Running"}),
    "watchdog": (["--seconds", "5", "--fault", "core_stalled@2+0.5"], True, {
        "one reset": lambda r: r.board["resets"] == 1,
        "its cause is on the bus": lambda r: r.last("Boot", "BootCause") == "Watchdog",
        "it runs again": lambda r: r.last("Imu", "ImuState") == "Running"}),
    "gnss_loses_its_settings": (["--seconds", "8", "--fault", "gnss_power_lost@2"], True, {
        "it is found and set again": lambda r: r.last("Wired", "GnssState") == "Running" and r.board["gnss_baud"] == 115_200,
        # The driver waits 3 s before it takes the receiver for lost, and the search took 1.6 s at the start.
        "fixes come again": lambda r: 3 < longest_pause(r, 0x30A) < 5 and r.times[0x30A][-1] > 7.7}),
    "gnss_at_another_rate": (["--seconds", "4", "--gnss-baud", "9600"], True, {
        "it is found and set right": lambda r: r.last("Wired", "GnssState") == "Running" and r.board["gnss_baud"] == 115_200}),
    "gnss_of_generation_8": (["--seconds", "6", "--gnss-generation", "8"], True, {
        "it is set by the older messages": lambda r: r.last("Wired", "GnssState") == "Running" and r.board["gnss_baud"] == 115_200,
        "fixes come": lambda r: r.count[0x30A] > 8}),
    "gnss_unplugged": (["--seconds", "11", "--fault", "gnss_unplugged@2+4"], True, {
        "the search is on": lambda r: "Search" in seen(r.values("Wired", "GnssState", 5)),
        "it runs again": lambda r: r.last("Wired", "GnssState") == "Running"}),
    "encoders_unplugged": (["--seconds", "20", "--fault", "encoder_unplugged@13+4"], True, {
        "the chip's clock is found": lambda r: abs(r.last("Imu", "ImuClock") + 1e6 * 3e-3 / 1.003) < 200,
        "the wheels are named": lambda r: "WheelSlip" in fault_flags(r, 14, 18),
        "the mode says so": lambda r: "Degraded" in seen(r.states("Mode", 14)),
        "it is over with the fault": lambda r: r.states("Mode")[-1][1] == "Nominal" and not fault_flags(r, 19.5),
        "fixes go on": lambda r: longest_pause(r, 0x30A) < 0.5}),
    "encoder_jumps": (["--seconds", "4", "--fault", "encoder_jump@2"], True, {
        "the jump is counted": lambda r: r.last("Wired", "EncoderJumps") >= 1}),
    "foreign_frames": (["--seconds", "5", "--fault", "foreign_frames@1+3"], True, {
        "they are on the bus": lambda r: r.count[0x31D] > 800}),
    "foreign_burst": (["--seconds", "4", "--fault", "foreign_burst@2"], True, {
        "all of it is on the bus": lambda r: r.count[0x31D] == 128 and r.times[0x31D][-1] - r.times[0x31D][0] < 0.05,
        "nothing is lost": lambda r: r.last("Bus", "RxOverflow") == 0,
        "no tick is late": lambda r: r.last("Ticks", "TicksLate") == 0}),
    "clock_jumps": (["--seconds", "5", "--fault", "clock_jump@1.5+1"], True, {}),
    "bus_off": (["--seconds", "5", "--fault", "bus_disturbed@2+0.5"], False, {
        "the node is on the bus again": lambda r: r.status[-1][0] > 4.9 and r.console.count("can: on the bus") == 2,
        "bus-off is counted": lambda r: r.last("Bus", "BusOff") >= 1,
        "what was not sent is marked": lambda r: r.states("Unlogged")[-1][1] == 1,
        "no reset": lambda r: r.board["resets"] == 0}),
    "no_partner": (["--seconds", "5", "--fault", "no_partner@2+1"], False, {
        "the node is on the bus again": lambda r: r.status[-1][0] > 4.9,
        "it was never off the bus": lambda r: "can: off the bus" not in r.console,
        "the console says that nobody acknowledges": lambda r: r.console.count("can: nobody acknowledges") == 1,
        "what was not sent is marked": lambda r: r.states("Unlogged")[-1][1] == 1}),
    "receive_line_stuck": (["--seconds", "6", "--fault", "bus_stuck@1.5+1.5"], False, {
        "the node is on the bus again": lambda r: r.status[-1][0] > 4.9 and r.console.count("can: on the bus") == 2,
        "bus-off is counted": lambda r: r.last("Bus", "BusOff") == 1,
        "what was not sent is marked": lambda r: r.states("Unlogged")[-1][1] == 1,
        "no reset": lambda r: r.board["resets"] == 0}),
    # INAK stays: the receive line is dominant from power-on to 2 s.
    "bus_never_joined": (["--seconds", "5", "--fault", "bus_stuck@-1+3"], False, {
        "the console says so": lambda r: 0 < r.console.find("can: off the bus") < r.console.find("can: on the bus"),
        "nothing is sent meanwhile": lambda r: r.status[0][0] > 2,
        "the wait is counted": lambda r: r.last("Bus", "BusOff") == 1,
        "what was not sent is marked": lambda r: r.states("Unlogged")[-1][1] == 1,
        "the node has gone on": lambda r: r.states("Mode", 4.5)[-1][1] not in ("Boot", "WaitingForImu"),
        "no reset": lambda r: r.board["resets"] == 0}, 5),
    "miso_low": stuck_miso("low"),
    "miso_high": stuck_miso("high"),
    "stack_overflows": fault_of_the_core("stack_overflow", "Stack"),
    "bad_read": fault_of_the_core("bad_read", "Bus", lambda pc: 0x2000_0000 <= pc < 0x2004_0000),
    "bad_jump": fault_of_the_core("bad_jump", "Bus", lambda pc: pc == 0x6000_0000),
    "undefined_instruction": fault_of_the_core("undefined_instruction", "Usage"),
    "unaligned_access": fault_of_the_core("unaligned_access", "Usage"),
    "floating_point_off": fault_of_the_core("floating_point_off", "Usage"),
    **{loop_stalled(hz): watchdog_ends_a_stalled_loop(hz) for hz in LSI_HZ},
    "no_crystal": (["--seconds", "4", "--no-crystal"], True, {
        "the fallback is on the bus": lambda r: r.last("Boot", "Fallback") == 1,
        "the IMU runs": lambda r: r.last("Imu", "ImuState") == "Running"}),
    "slow_core": (["--seconds", "4", "--cpi", "2"], True, {"the IMU runs": lambda r: r.last("Imu", "ImuState") == "Running"}),
    "fast_core": (["--seconds", "4", "--cpi", "1"], True, {"the IMU runs": lambda r: r.last("Imu", "ImuState") == "Running"}),
}


def cases_of(kind):
    """Every case but the stalled loop with an oscillator of another board."""
    return [case for case in CASES if case not in {loop_stalled(hz) for hz in LSI_HZ if hz not in BOARDS[kind]["lsi_hz"]}]


def judge(case, programs, image, folder):
    """Epochs that were compared, and what is wrong with a case as a list of sentences."""
    board, play = programs
    options, whole, claims, *least = CASES[case]
    done = subprocess.run([board, "--robot", "rover", "--imu-clock-ppm", "3000", "--out", folder, *options, image], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        return 0, [f"status {done.returncode}: {done.stderr.strip()[-600:]}"]
    replayed = subprocess.run([play, os.path.join(folder, "raw.log"), "--memory", "--robot", "rover", "--out", folder, "--quiet"], capture_output=True, text=True,
                              check=False)
    if replayed.returncode > 1:
        return 0, [f"cannot be repeated: {replayed.stderr.strip()[-300:]}"]
    run = Run(folder, replayed)
    wrong = []
    if run.replay.get("epochs_different") != 0 or run.replay.get("epochs_compared", 0) < (least or [100])[0]:
        wrong.append(f"{run.replay.get('epochs_different')} of {run.replay.get('epochs_compared')} epochs differ: {run.replay.get('first_difference')}")
    if whole and replayed.returncode != 0:
        wrong.append(f"not repeated to its end: {replayed.stderr.strip()[-300:]}")
    if not whole and not run.replay.get("hole"):
        wrong.append("a log with a hole was repeated without a word")
    for claim, holds in claims.items():
        if not holds(run):
            wrong.append(f"not so: {claim}")
    return run.replay.get("epochs_compared", 0), wrong


def main():
    board, play, image, *rest = sys.argv[1:]
    if not os.access(board, os.X_OK):
        print(f"image_faults_test: skipped: no {board} (libunicorn-dev)", file=sys.stderr)
        return 77
    kind = next((name for name in BOARDS if name in os.path.basename(image)), "ark_cannode")
    cases = cases_of(kind) if "--whole" in rest else [one for one in rest if one] or BOARDS[kind]["short"]
    failed = 0
    for case in cases:
        with tempfile.TemporaryDirectory() as folder:
            compared, wrong = judge(case, (board, play), image, folder)
        failed += bool(wrong)
        print(f"{case:24} {compared:5} epochs repeated, {'ok' if not wrong else 'WRONG: ' + '; '.join(wrong)}", flush=True)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
