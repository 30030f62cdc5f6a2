#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""logs_test.py GNSS_LOG [--verbose]: real receivers' logs through the driver (GNSS_LOG prints its reports), against gpsd's expected results
beside them (.log.chk) and against gpsdecode on the same bytes. Data: $TETAP_DATA/gpsd; without it or gpsdecode exit 77: skipped.

Equal means, with half a unit of the last digit printed on either side: a fix of ours has the judge's time of day, latitude and longitude,
and every other field that both give. gpsd prints a TPV whenever it learnt something, also with fields of the epoch before; therefore a
fix is compared with all its TPVs of one time and must agree with one of them, field by field.
What differs is listed in EXPECTED with its reason and exact count; any other number, also a smaller one, fails."""
import json
import os
import subprocess
import sys

EXPECTED = {}
NOT_SPOKEN = {}
# field of ours, field of a TPV, tolerance in the unit
FIELDS = (("msl", "altMSL", 0.0011), ("height", "altHAE", 0.0011), ("speed", "speed", 0.00101), ("course", "track", 0.0002),
          ("up", "climb", 0.0011), ("north", "velN", 0.0011), ("east", "velE", 0.0011))
ANGLE = 2.1e-9  # deg: our unit is 2e-9, gpsd prints 1e-9


def lines_of(text):
    out = []
    for line in text.splitlines():
        if line.startswith("{"):
            try:
                out.append(json.loads(line))
            except ValueError:
                pass
    return out


def time_of_day(tpv):
    if "time" not in tpv:
        return None
    h, m, s = tpv["time"][11:-1].split(":")
    return int(h) * 3600 + int(m) * 60 + float(s)


def same_time(a, b):
    return a is None or b is None or abs((a - b + 43200) % 86400 - 43200) < 0.0011


def same_angle(a, b):
    return abs(a - b) < ANGLE


def tpvs_of(text):
    return [(time_of_day(t), t) for t in lines_of(text) if t.get("class") == "TPV" and t.get("mode", 0) >= 2 and "lat" in t and "lon" in t]


def compare(ours, tpvs):
    """Counts of (equal, what differs: list of texts)."""
    different, equal = [], 0
    for mine in ours:
        at = mine.get("tod_s")
        same = [t for time, t in tpvs if same_time(time, at)]
        if not same:
            different.append(f"extra: {at} not among the judge's times")
            continue
        here = [t for t in same if same_angle(t["lat"], mine["lat"]) and same_angle(t["lon"], mine["lon"])]
        if not here:
            different.append(f"place: {at} {mine['lat']} {mine['lon']} judge {same[-1]['lat']} {same[-1]['lon']}")
            continue
        wrong = []
        for field, theirs, tolerance in FIELDS:
            values = [t[theirs] for t in here if theirs in t]
            if field in mine and values:
                error = min(abs((v - mine[field] + 180) % 360 - 180) if field == "course" else abs(v - mine[field]) for v in values)
                if error > tolerance + 1e-6 * abs(mine[field]):
                    wrong.append(f"{field}: {at} {mine[field]} judge {values}")
        different += wrong
        equal += not wrong
    for at, t in tpvs:
        if not any(same_time(at, m.get("tod_s")) and same_angle(t["lat"], m["lat"]) and same_angle(t["lon"], m["lon"]) for m in ours):
            different.append(f"missing: {at} {t['lat']} {t['lon']} mode {t['mode']}")
    return equal, different


def main():
    verbose = "--verbose" in sys.argv
    args = [a for a in sys.argv[1:] if not a.startswith("--")]
    root = os.path.dirname(os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__)))))
    data = os.path.join(os.environ.get("TETAP_DATA", os.path.join(root, "..", "shared", "data")), "gpsd")
    if not os.path.isdir(data):
        print(f"no {data}: skipped")
        return 77
    logs = sorted(os.path.join(data, d, f) for d in ("dev", "other") for f in os.listdir(os.path.join(data, d)) if f.endswith(".log"))
    failures, totals = [], {"chk": [0, 0], "gpsdecode": [0, 0]}
    for path in logs:
        name = os.path.basename(path)
        if len(args) > 1 and name not in args[1:]:
            continue
        out = lines_of(subprocess.run([args[0], path], capture_output=True, text=True, check=True).stdout)
        ours = [r for r in out[:-1] if r["fix"] >= 2 and "lat" in r]
        with open(path, "rb") as log:
            decoded = subprocess.run(["gpsdecode"], stdin=log, capture_output=True, timeout=60, check=False).stdout.decode(errors="replace")
        with open(path + ".chk", errors="replace") as chk:
            judges = {"chk": tpvs_of(chk.read()), "gpsdecode": tpvs_of(decoded)}
        row = []
        for judge, tpvs in judges.items():
            equal, different = compare(ours, tpvs)
            kinds = {}
            for text in different:
                kind = text.split(":")[0]
                kinds[kind] = kinds.get(kind, 0) + 1
            totals[judge][0] += equal
            totals[judge][1] += len(different)
            row.append(f"{judge} {equal}/{len(ours)} {kinds or ''} of {len(tpvs)} TPV")
            if verbose:
                print("\n".join(f"   {judge} {t}" for t in different[:6]))
        print(f"{name}: reports {len(out) - 1} fixes {len(ours)}; " + "; ".join(row))
    print(totals)
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
