#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""What a wrong delay or mounting costs the robot `all_round`: mounting_costs.py PROGRAMS OUT SEEDS. The simulated robot is built as its parameters say, and
the node is told one of them wrong. The receiver is out for the last 60 s of a run. A table of errors over the seeds, also in OUT/mounting_costs.json."""
import json
import os
import sys

import numpy as np

sys.dont_write_bytecode = True
sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
from all_round_runs import judged  # noqa: E402
from menu_runs import run  # noqa: E402

SETTLED_S, OUTAGE_S, END_S = 20, 130, 190  # after the start of the drive
CASES = (
    ("nothing", ()),
    ("scanner's stamp 20 ms", ("lidar.delay_us=20000",)),
    ("scanner's stamp 100 ms", ("lidar.delay_us=100000",)),
    ("receiver's stamp 20 ms", ("gnss.delay_us=20000",)),
    ("receiver's stamp 100 ms", ("gnss.delay_us=100000",)),
    ("wheels' stamp 20 ms", ("wheels.delay_us=20000",)),
    ("scanner's yaw 20 mrad", ("lidar.yaw_rad=0.02",)),
    ("scanner 0.1 m to the left", ("lidar.y_b_m=0.1",)),
    ("scanner 0.1 m ahead", ("lidar.x_b_m=0.3",)),
    ("antenna 0.2 m to the left", ("gnss.antenna_y_b_m=0.2",)),
    ("radii of the wheels 1 %", ("wheels.drive.left_radius_m=0.101", "wheels.drive.right_radius_m=0.101")),
    ("track of the wheels 2 %", ("wheels.drive.track_m=0.51",)),
    ("IMU's yaw 20 mrad", ("inertial.mounting_bs=0.9998,-0.02,0,0.02,0.9998,0,0,0,1",)),
    ("IMU's roll 20 mrad", ("inertial.mounting_bs=1,0,0,0,0.9998,-0.02,0,0.02,0.9998",)),
)


def costs(programs, out, seed, told):
    """RMS of position [m] and heading [rad] with the receiver, position error at the end without it [m], mean NEES of 3 of all."""
    settings = [word for one in told for word in ("--set", one)]
    run(os.path.join(programs, "tetap-world"), "--memory", "--quiet", "--robot", "all_round", "--seed", str(seed), "--duration", str(END_S), *settings,
        "--fault", f"gnss_outage@{OUTAGE_S}+{END_S - OUTAGE_S}", "--out", out)
    time_s, off, _, nees = judged(out)
    first, outage, last = np.searchsorted(time_s, (SETTLED_S, OUTAGE_S, END_S))
    if not first < outage < last:
        raise SystemExit(f"mounting_costs: seed {seed}, {told}: no valid pose with and without the receiver")
    square = off[first:outage] ** 2
    return square[:, :2].sum(axis=1).mean(), square[:, 2].mean(), (off[last - 1, :2] ** 2).sum(), nees[first:last].mean()


def main():
    if len(sys.argv) != 4 or not sys.argv[3].isdigit() or int(sys.argv[3]) < 1:
        raise SystemExit(__doc__)
    programs, out, count = sys.argv[1:]
    os.makedirs(out, exist_ok=True)
    table = {}
    print("| told wrong | position [m] | heading [mrad] | end of 60 s without receiver [m] | NEES of 3 |\n|---|---|---|---|---|")
    for name, told in CASES:
        runs = np.array([costs(programs, os.path.join(out, "run"), seed, told) for seed in range(1, int(count) + 1)]).mean(axis=0)
        position, heading, end = np.sqrt(runs[:3])
        table[name] = {"told": told, "position_m": position, "heading_rad": heading, "end_m": end, "nees": runs[3]}
        print(f"| {name} | {position:.2f} | {1e3 * heading:.1f} | {end:.2f} | {runs[3]:.1f} |", flush=True)
    with open(os.path.join(out, "mounting_costs.json"), "w", encoding="utf-8") as file:
        json.dump(table, file, indent=2)


if __name__ == "__main__":
    main()
