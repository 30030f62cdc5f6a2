#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The tables of docs/validation/recorded.md on recorded inertial data, in Markdown: inertial_tables.py [FILE], of what inertial_runs.py --whole
wrote (default out/inertial.json).

3 sigma is how far the ellipse reaches in the error's own direction that holds as much of the plane (99.73 %) as 3 sigma of one axis.
An error beyond it is in bold."""
import json
import os
import sys

sys.dont_write_bytecode = True
ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))
sys.path.insert(0, os.path.join(ROOT, "tools", "python"))
from tetap.docs.recorded import drive_table, is_whole, nees_table, outage_table  # noqa: E402


def main():
    path = sys.argv[1] if len(sys.argv) > 1 else os.path.join(ROOT, "out", "inertial.json")
    try:
        with open(path, encoding="utf-8") as file:
            result = json.load(file)
    except (OSError, ValueError) as error:
        sys.exit(f"inertial_tables: {path}: {error} (inertial_runs.py --whole writes it)")
    if is_whole(result):
        print(*drive_table(result), "", sep="\n")
    if "car" in result:
        print("Skog's car, GNSS cut: error at the end / 3 sigma, NEES (2 expected)\n")
        print(*outage_table(result["car"]["outages"]), "", sep="\n")
    print("NEES on recorded data\n")
    print(*nees_table(result), sep="\n")


if __name__ == "__main__":
    main()
