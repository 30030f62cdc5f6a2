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
ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))
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
VALUES = {"ImuState": names("Diag_ImuState"), "GnssState": names("Diag_GnssState"), "BootCause": names("Diag_BootCause"), "Mode": names("Status_Mode")}


class Run:
    """What one run left: pages of diagnosis, status, frames, the comparison with its repetition."""

    def __init__(self, folder, replayed):
        self.replayed = replayed
        with open(os.path.join(folder, "board.json"), encoding="utf-8") as file:
            self.board = json.load(file)
        with open(os.path.join(folder, "run.json"), encoding="utf-8") as file:
            self.replay = json.load(file)
        self.pages, self.status, self.count = [], [], {}
        with open(os.path.join(folder, "raw.log"), encoding="ascii") as log:
            for line in log:
                found = LINE.match(line)
                if found:
                    self.take(float(found[1]), int(found[2], 16), int.from_bytes(bytes.fromhex(found[3]), "little"))

    def take(self, time_s, identifier, payload):
        self.count[identifier] = self.count.get(identifier, 0) + 1
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


def seen(pairs):
    return {value for _, value in pairs}


# Each case: options of tetap-board, whether its log can be repeated to its end, and (what is asserted, of a Run). The world starts at 1 s.
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
        "fixes come again": lambda r: r.count[0x30A] > 18}),
    "gnss_at_another_rate": (["--seconds", "4", "--gnss-baud", "9600"], True, {
        "it is found and set right": lambda r: r.last("Wired", "GnssState") == "Running" and r.board["gnss_baud"] == 115_200}),
    "gnss_of_generation_8": (["--seconds", "6", "--gnss-generation", "8"], True, {
        "it is set by the older messages": lambda r: r.last("Wired", "GnssState") == "Running" and r.board["gnss_baud"] == 115_200,
        "fixes come": lambda r: r.count[0x30A] > 8}),
    "gnss_unplugged": (["--seconds", "11", "--fault", "gnss_unplugged@2+4"], True, {
        "the search is on": lambda r: "Search" in seen(r.values("Wired", "GnssState", 5)),
        "it runs again": lambda r: r.last("Wired", "GnssState") == "Running"}),
    "encoder_jumps": (["--seconds", "4", "--fault", "encoder_jump@2"], True, {
        "the jump is counted": lambda r: r.last("Wired", "EncoderJumps") >= 1}),
    "foreign_frames": (["--seconds", "5", "--fault", "foreign_frames@1+3"], True, {
        "they are on the bus": lambda r: r.count[0x31D] > 800}),
    "clock_jumps": (["--seconds", "5", "--fault", "clock_jump@1.5+1"], True, {}),
    "bus_off": (["--seconds", "5", "--fault", "bus_disturbed@2+0.5"], False, {
        "the node goes on": lambda r: r.status[-1][0] > 4.5,
        "what was not sent is marked": lambda r: r.states("Unlogged")[-1][1] == 1,
        "no reset": lambda r: r.board["resets"] == 0}),
    "no_partner": (["--seconds", "5", "--fault", "no_partner@2+1"], False, {
        "what was not sent is marked": lambda r: r.states("Unlogged")[-1][1] == 1}),
    "no_crystal": (["--seconds", "4", "--no-crystal"], True, {
        "the fallback is on the bus": lambda r: r.last("Boot", "Fallback") == 1,
        "the IMU runs": lambda r: r.last("Imu", "ImuState") == "Running"}),
    "slow_core": (["--seconds", "4", "--cpi", "2"], True, {"the IMU runs": lambda r: r.last("Imu", "ImuState") == "Running"}),
    "fast_core": (["--seconds", "4", "--cpi", "1"], True, {"the IMU runs": lambda r: r.last("Imu", "ImuState") == "Running"}),
}
SHORT = ["healthy", "no_imu", "fifo_overflows", "watchdog", "gnss_at_another_rate", "foreign_frames", "bus_off"]


def judge(case, programs, image, folder):
    """What is wrong with a case, as a list of sentences."""
    board, play = programs
    options, whole, claims = CASES[case]
    done = subprocess.run([board, "--robot", "rover", "--imu-clock-ppm", "3000", "--out", folder, *options, image], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        return [f"status {done.returncode}: {done.stderr.strip()[-600:]}"]
    replayed = subprocess.run([play, os.path.join(folder, "raw.log"), "--memory", "--robot", "rover", "--out", folder, "--quiet"], capture_output=True, text=True,
                              check=False)
    if replayed.returncode > 1:
        return [f"cannot be repeated: {replayed.stderr.strip()[-300:]}"]
    run = Run(folder, replayed)
    wrong = []
    if run.replay.get("epochs_different") != 0 or run.replay.get("epochs_compared", 0) < 100:
        wrong.append(f"{run.replay.get('epochs_different')} of {run.replay.get('epochs_compared')} epochs differ: {run.replay.get('first_difference')}")
    if whole and replayed.returncode != 0:
        wrong.append(f"not repeated to its end: {replayed.stderr.strip()[-300:]}")
    if not whole and not run.replay.get("hole"):
        wrong.append("a log with a hole was repeated without a word")
    for claim, holds in claims.items():
        if not holds(run):
            wrong.append(f"not so: {claim}")
    return wrong


def main():
    board, play, image, *rest = sys.argv[1:]
    if not os.access(board, os.X_OK):
        print(f"image_faults_test: skipped: no {board} (libunicorn-dev)", file=sys.stderr)
        return 77
    cases = list(CASES) if "--whole" in rest else [one for one in rest if one] or SHORT
    failed = 0
    for case in cases:
        with tempfile.TemporaryDirectory() as folder:
            wrong = judge(case, (board, play), image, folder)
        failed += bool(wrong)
        print(f"{case:24} {'ok' if not wrong else 'WRONG: ' + '; '.join(wrong)}", flush=True)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
