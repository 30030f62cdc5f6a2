#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""cases_test.py GNSS_LOG: inputs on which receivers' drivers went wrong, through ours (GNSS_LOG prints its reports).

  shared/cases/gnss   sentences and messages after public reports; expected values follow from the files' own fields, read here
  NAV-HPPOSLLH        a recorded log of a ZED-F9P, against the places that gpsdecode prints to 1e-9 deg
  NAV-RELPOSNED       frames packed here by the interface description, UBX-22008968 sec. 3.15, against gpsdecode's relN relE relD relH

Data: ../shared/cases/gnss and $TETAP_DATA/gpsd. A part whose input or judge is missing is said; exit 77 (skipped) when all are."""
import glob
import json
import math
import os
import shutil
import struct
import subprocess
import sys
import tempfile

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__)))))
CASES = os.path.join(ROOT, "..", "shared", "cases", "gnss")
DATA = os.path.join(os.environ.get("TETAP_DATA", os.path.join(ROOT, "..", "shared", "data")), "gpsd")
UNIT_DEG = 2e-9
failures, ran = [], 0


def expect(what, good):
    if not good:
        failures.append(what)


def driver(path):
    """Reports, baselines and counts of refusals."""
    out = subprocess.run([sys.argv[1], path], capture_output=True, text=True, check=True).stdout
    lines = [json.loads(line) for line in out.splitlines()]
    return [r for r in lines[:-1] if "protocol" in r], [r for r in lines[:-1] if "baseline" in r], lines[-1]


def sentences(path, kind):
    """Fields of the sentences of this kind whose checksum fits."""
    found = []
    with open(path, "rb") as log:
        for part in log.read().split(b"$")[1:]:
            text, _, rest = part.partition(b"*")
            total = 0
            for byte in text:
                total ^= byte
            if rest[:2].decode(errors="replace").upper() == f"{total:02X}":
                fields = text.decode().split(",")
                if fields[0][2:] == kind:
                    found.append(fields)
    return found


def degrees(value, side):
    whole, minutes = divmod(float(value), 100)
    return (whole + minutes / 60) * (-1 if side in "SW" else 1)


def same_places(name, reports, rows):
    expect(f"{name}: {len(reports)} reports of {len(rows)} GGA", len(reports) == len(rows))
    for r, row in zip(reports, rows):
        same = (abs(r.get("lat", 99) - degrees(row[2], row[3])) < UNIT_DEG and abs(r.get("lon", 999) - degrees(row[4], row[5])) < UNIT_DEG)
        expect(f"{name}: {row} became {r}", same)


def case(name):
    path = os.path.join(CASES, name)
    if not os.path.exists(path):
        print(f"no {path}: skipped")
        return None
    global ran
    ran += 1
    return path


def several_gsa():
    path = case("g1_gsa_mixed_qgis50746.nmea")
    if not path:
        return
    reports, _, health = driver(path)
    same_places("g1", reports, sentences(path, "GGA"))
    modes = [row[2] for row in sentences(path, "GSA")]
    expect(f"g1: fixes {[r['fix'] for r in reports]}, 3 is 3D", all(r["fix"] == 3 for r in reports))
    expect(f"g1: GSA not used {health}", health.get("GSA of lesser mode") == modes.count("1"))


def quality_nine():
    path = case("g2_gga_quality9_novatel.nmea")
    if not path:
        return
    reports, _, _ = driver(path)
    same_places("g2", reports, sentences(path, "GGA"))
    expect("g2: differential", all(r["fix"] == 4 for r in reports))


def status_beside_nmea():
    path = case("g3_ubx_status_beside_nmea.bin")
    if not path:
        return
    reports, _, health = driver(path)
    same_places("g3", [r for r in reports if r["protocol"] == "NMEA"], sentences(path, "GGA"))
    expect(f"g3: {health}", "second protocol" not in health)


def whole_seconds():
    path = case("g5_whole_second_5Hz.nmea")
    if not path:
        return
    reports, _, health = driver(path)
    rows = sentences(path, "GGA")
    same_places("g5", reports, rows)
    expect("g5: the times are doubtful", all(r.get("doubtful") for r in reports) and health.get("doubtful time") == len(rows))


def gpsdecode(path):
    with open(path, "rb") as log:
        out = subprocess.run(["gpsdecode"], stdin=log, capture_output=True, timeout=60, check=False).stdout.decode(errors="replace")
    return [json.loads(line) for line in out.splitlines() if '"class":"TPV"' in line]


def recorded_high_precision():
    """gpsd prints a TPV of NAV-PVT, of 1e-7 deg, and in every other epoch one of NAV-HPPOSLLH."""
    logs = glob.glob(os.path.join(glob.escape(DATA), "**", "ublox-zed-f9p-hp.log"), recursive=True)
    if not logs or not shutil.which("gpsdecode"):
        return print("no ublox-zed-f9p-hp.log or no gpsdecode: skipped")
    global ran
    ran += 1
    fine = [t for t in gpsdecode(logs[0]) if abs(t["lat"] * 1e7 - round(t["lat"] * 1e7)) > 1e-3]
    reports, _, _ = driver(logs[0])
    expect(f"hp: only {len(fine)} places of gpsd's finer than 1e-7 deg", len(fine) >= 10)
    for t in fine:
        at = [r for r in reports if abs(r["lat"] - t["lat"]) < 1.1e-9 + UNIT_DEG / 2 and abs(r["lon"] - t["lon"]) < 1.1e-9 + UNIT_DEG / 2]
        expect(f"hp: none of ours at {t['lat']} {t['lon']}", len(at) == 1)
        if len(at) == 1:
            expect(f"hp: height {at[0]['height']}, {t['altHAE']}", abs(at[0]["height"] - t["altHAE"]) < 0.00051)
            expect(f"hp: accuracy {at[0]['hacc']}, {t['eph']}", abs(at[0]["hacc"] - t["eph"]) < 0.00051)


def ubx(message_class, identity, payload):
    body = bytes([message_class, identity]) + struct.pack("<H", len(payload)) + payload
    a = b = 0
    for byte in body:
        a = (a + byte) & 0xFF
        b = (b + a) & 0xFF
    return b"\xb5\x62" + body + bytes([a, b])


def relposned(itow, north, east, down, heading_deg):
    """Version 1, in 0.1 mm: centimetres and their hundredths."""
    length = round(math.sqrt(north * north + east * east + down * down))
    parts = [divmod(abs(v), 100) for v in (north, east, down, length)]
    signs = [-1 if v < 0 else 1 for v in (north, east, down, length)]
    coarse = [s * p[0] for s, p in zip(signs, parts)]
    fine = [s * p[1] for s, p in zip(signs, parts)]
    return struct.pack("<BBHIiiiii4xbbbbIIIII4xI", 1, 0, 0, itow, *coarse, round(heading_deg * 1e5), *fine, 100, 100, 100, 100, 45000, 0x137)


def pvt(itow):
    """A fix with integer ambiguities, so that gpsd prints a TPV."""
    payload = bytearray(92)
    struct.pack_into("<IHBBBBBB", payload, 0, itow, 2024, 2, 29, 12, itow // 60000 % 60, itow // 1000 % 60, 7)
    struct.pack_into("<BBBB", payload, 20, 3, 0x83, 0, 17)
    struct.pack_into("<iiii", payload, 24, -1213142468, 440690105, 1125900, 1147200)
    return ubx(1, 7, bytes(payload))


def baseline_as_gpsd():
    if not shutil.which("gpsdecode"):
        return print("no gpsdecode: skipped")
    global ran
    ran += 1
    lines = []
    for k in range(24):
        angle = math.radians(15 * k + 1)
        north, east = round(7531 * math.cos(angle)), round(7531 * math.sin(angle))
        lines.append((100000 + 1000 * k, north, east, -123, math.degrees(math.atan2(east, north)) % 360))
    stream = b"".join(pvt(line[0]) + ubx(1, 0x3C, relposned(*line)) + ubx(1, 0x61, struct.pack("<I", line[0])) for line in lines)
    with tempfile.NamedTemporaryFile(suffix=".ubx") as log:
        log.write(stream)
        log.flush()
        _, baselines, health = driver(log.name)
        judged = [t for t in gpsdecode(log.name) if "relH" in t]
    expect(f"baseline: {len(baselines)} of {len(lines)}, {health}", len(baselines) == len(lines) and "baseline without heading" not in health)
    expect(f"baseline: gpsd judges {len(judged)}", len(judged) >= len(lines) // 2)
    for t in judged:
        near = [b for b in baselines if abs(b["course"] - t["relH"]) < 0.00051]
        expect(f"baseline: no course of ours at {t['relH']}", len(near) == 1)
        for b in near:
            for ours, theirs, sign in (("north", "relN", 1), ("east", "relE", 1), ("up", "relD", -1), ("length", "relL", 1)):
                expect(f"baseline: {ours} {b[ours]}, {t[theirs]}", abs(b[ours] - sign * t[theirs]) < 0.00056)
            yaw = math.degrees(math.atan2(t["relN"], t["relE"]))
            expect(f"baseline: yaw {b['yaw']}, {yaw}", abs((b["yaw"] - yaw + 180) % 360 - 180) < 0.08)


def main():
    for part in (several_gsa, quality_nine, status_beside_nmea, whole_seconds, recorded_high_precision, baseline_as_gpsd):
        part()
    print("\n".join(failures) if failures else f"{ran} of 6 parts, no difference")
    return 1 if failures else 77 if ran == 0 else 0


if __name__ == "__main__":
    sys.exit(main())
