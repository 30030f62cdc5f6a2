#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""logs_test.py GNSS_LOG [--verbose]: real receivers' logs through the driver (GNSS_LOG prints its reports), against gpsd's expected results
beside them (.log.chk) and against gpsdecode on the same bytes. Data: $TETAP_DATA/gpsd and its folders; without it or gpsdecode exit 77: skipped.

Equal means, with half a unit of the last digit printed on either side: a fix of ours has the judge's time of day, latitude and longitude,
and every other field that both give: also the date (gpsd moves old ones on by 1024 weeks, so modulo those) and errors as GST and UBX
estimate them. gpsd prints a TPV whenever it learnt something, also with fields of the epoch before; therefore a fix is compared with all
its TPVs of one time and must agree with one of them, field by field. Dilution of precision has no time with gpsd: what its SKYs say has
to be in our reports, in the same order.
What differs is listed in EXPECTED with its reason and exact count; any other number, also a smaller one, fails. A log that is not listed has to have none."""
import datetime
import glob
import json
import math
import os
import shutil
import subprocess
import sys

# Kinds of difference:
#   last     our fix of the last epoch in the file: gpsd reports an epoch with the sentence that it has learnt to be the last, or never
#   first    our fix of the first epoch: gpsd has not learnt yet which sentence is the last of an epoch
#   undated  our fix before the first date: gpsd prints no time of day without a date, or no TPV
#   extra    another fix of ours at a time the judge does not have
#   untimed  the judge's position without a time that is none of ours
#   missing  the judge's position at a time that is none of ours
#   place, or a field's name: at the same time, but not equal
#   dilution the judge's, not in our reports
RMC = "gpsd's last word is RMC's place, which has a digit less than GGA's"
FROZEN = ("gpsd keeps the first epoch's latitude, longitude and speed, while the ECEF fields of its TPV go on: judged by those, of 1 cm")

# Log: what differs from .chk, what from gpsdecode, why (where the kinds above do not say it).
EXPECTED = {
    "neo-m8n.log": ({"last": 1, "untimed": 1}, {"last": 1},
        "gpsd's first TPV, of GGA alone, has no time"),
    "ublox-lea-4t.log": ({"first": 1, "missing": 1}, {"first": 1, "missing": 1},
        "before NAV-TIMEGPS says 15 leap seconds gpsd takes today's 18 for the first epoch; ours is NAV-TIMEUTC's"),
    "ublox-neo-m8n.log": ({"dilution": 5}, {"dilution": 5},
        "without NAV-DOP gpsd computes all three from the satellites' places; ours is NAV-PVT's pDOP"),
    "ublox-lea-5h.log": ({"extra": 1}, {"first": 1, "extra": 1},
        "two recordings in one file: gpsd drops the epoch at the seam"),
    "GPSmap-76S.log": ({"untimed": 2}, {},
        "GGA quality 8, simulator: no fix for us, one for gpsd"),
    "april6_2019.log": ({"untimed": 1}, {"last": 1},
        "a date of '2208-1': gpsd takes the rest of the sentence, we nothing"),
    "bt451.log": ({"extra": 1, "day": 1, "last": 1, "untimed": 1}, {"extra": 1, "day": 1, "last": 1},
        "several recordings in one file: gpsd drops the epoch at a seam and takes the earlier time after it for the next day's; "
        "its TPV without a time is of GLL"),
    "foretrex-201.log": ({"missing": 3}, {"first": 1, "missing": 3},
        "GGA of quality 2 with 0 satellites: no fix for us, one for gpsd"),
    "garmin-geko201.log": ({"untimed": 3}, {},
        "GGA quality 8, simulator: no fix for us, one for gpsd"),
    "garmin38.log": ({"untimed": 2}, {},
        "gpsd uses GLL, which comes before the first GGA"),
    "garmin48.log": ({"missing": 6}, {"first": 1, "missing": 6},
        "gpsd uses GLL, which here has a time of its own"),
    "gp-320fw-2019-03-28.log": ({}, {"extra": 1},
        "gpsd drops an epoch in which a sentence comes that did not come in the one before"),
    "gp-320fw-2019-04-06-overflow.log": ({"extra": 1}, {"extra": 1},
        "gpsd drops an epoch in which a sentence comes that did not come in the one before"),
    "gr601-w.log": ({"untimed": 1}, {},
        "gpsd uses GLL, which comes before the first GGA"),
    "hemi.log": ({"speed": 5}, {"speed": 5},
        "gpsd reports at GGA, before VTG comes, and makes a speed from two positions"),
    "humminbird-M37.log": ({"extra": 1}, {"first": 1, "extra": 1, "missing": 7},
        "GGA, RMC and GLL take turns, each second another: gpsd uses GLL too and drops the first RMC"),
    "mtk-3301.log": ({"untimed": 1}, {"untimed": 1},
        "GGA quality empty or 0 and RMC marked V, with a place: no fix for us, one for gpsd by GSA"),
    "myguide-3100.log": ({"untimed": 2, "dilution": 1}, {"untimed": 2, "dilution": 1},
        "GGA quality empty and RMC marked V, with a place: no fix for us, one for gpsd by GSA; the first GSA comes before any time"),
    "rst39.log": ({"extra": 1}, {"first": 1, "extra": 1},
        "gpsd drops the second epoch, the first without RMC"),
    "tn204.log": ({"extra": 1}, {"first": 1, "extra": 1},
        "gpsd drops the second epoch, the first with GLL"),
    "tr737A+.log": ({"untimed": 1}, {"untimed": 1},
        "GGA quality 0 with a place: no fix for us, one for gpsd by GSA"),
}
for log in """ublox-8.log ait250.log ch-4701.log gps-360.log isync.log pharos-360.log venus634lp.log""".split():
    EXPECTED[log] = ({"last": 1}, {"first": 1, "last": 1}, "")
for log in """ac12.log ac12_binary.log bt-q818.log bu353-glonass.log bu353s4.log ch-4711.log com-1289.log eXplorist210.log et-332.log
        firefly-II.log garmin-10x.log garmin17n.log gp-320fw-2019-04-07-coldboot.log gpslim236.log gr8013-w.log hab-gpspi.log
        hp58534a.log iTrek.log magellan-ec10.log magellan315.log mr-350p.log mt3339.log mtk-3329.log navika-100-fix.log
        nd-1005.log nl2008u.log nl402u.log nokia-ld-4w.log oncore.log polarx2.log saab-r4.log sirfstarv-nmea.log skytraq-dgps.log
        skytraq-fix.log skytraq-fixB.log telit-he910.log tomtom-mkII.log triton400.log ublox-lea-4s.log""".split():
    EXPECTED[log] = ({}, {"first": 1}, "")
for log in """tcp-test.log udp-test.log""".split():
    EXPECTED[log] = ({}, {"last": 1}, "")
EXPECTED["tcp-torture.log"] = ({"dilution": 1}, {"last": 1, "dilution": 1}, "the first GGA is broken, so GSA comes before any time")
for log in """ublox-zed-f9p_hpg1.11.log""".split():
    EXPECTED[log] = ({"first": 1}, {"first": 1}, "")

# Without a difference: beidou-bd beidou-gb blumax-gps009 bn-9015 eXplorist110 garmin25lp geos-1m haicom-305N holux-gm-210 motorola-t805
# nl551e rgm3800 rx210 skytraq sl869 tn200-all tn200 ublox-neo-m8t ublox-zed-f9p-hp.

# Logs without a sentence or message that we make a fix of.
NOT_SPOKEN = {}
for what, names in (
    ("SiRF binary", """bu303-moving bu303-nofix bu303-stillfix bu303b-nofix sirfstarv ublox-sirf1"""),
    ("Garmin binary", """garmin18x-bin"""),
    ("GeoStar binary", """geostar-geos1m-binary"""),
    ("iTalk binary", """italk-binary"""),
    ("NavCom binary", """navcom"""),
    ("SkyTraq binary", """skytraq-bin"""),
    ("SuperStar binary", """superstar2"""),
    ("Rockwell Zodiac binary", """zodiac"""),
    ("Trimble TSIP", """trimble-lassen_iq-3dfix trimble-lassen_iq-playacar trimble-lassen_iq trimble-lasseniq-bin2d trimble-smt-360
         trimble-smtx"""),
    ("RTCM only", """naujoks-rtcm2 rtcm2.bend rtcm2 rtcm3.2 rtcm3.bndm rtcm3"""),
    ("no receiver: text", """naujoks-ntrip ntrip_sourcetable passthrough"""),
    ("GLL only", """sounder"""),
    ("a compass", """tnt-revolution"""),
    ("faults of a maker's own sentences only", """skytraq-err"""),
):
    NOT_SPOKEN.update((name + ".log", what) for name in names.split())
# Other angles than the unit of the last digit, deg.
COARSE = {
    "ac12.log": (8.5e-7, RMC), "ac12_binary.log": (8.5e-7, RMC), "tcp-test.log": (8.5e-7, RMC), "tcp-torture.log": (8.5e-7, RMC),
    "udp-test.log": (8.5e-7, RMC),
    "ublox-zed-f9p-hp.log": (6e-8, "gpsd's TPVs are of NAV-PVT, of 1e-7 deg, or of NAV-HPPOSLLH; cases_test.py compares the latter"),
    "ublox-neo-m8t.log": (2e-7, FROZEN), "ublox-lea-4t.log": (2e-7, FROZEN),
}
# field of ours, field of a TPV, tolerance in the unit
FIELDS = (("msl", "altMSL", 0.0011), ("height", "altHAE", 0.0011), ("speed", "speed", 0.00101), ("course", "track", 0.0002),
          ("north", "velN", 0.0011),
          ("east", "velE", 0.0011), ("down", "velD", 0.0011), ("day", "day", 0.1), ("gst_h", "gst_h", 0.0011), ("gst_v", "gst_v", 0.0011),
          ("hacc", "eph", 0.0011), ("vacc", "epv", 0.0011), ("sacc", "eps", 0.0051))
MODELLED = ("eph", "epv", "eps")  # where the receiver does not say them gpsd makes a model of its errors
ANGLE = 2.1e-9  # deg: our unit is 2e-9, gpsd prints 1e-9; velocities in n only from UBX: those of NMEA are speed and course


def lines_of(text):
    out = []
    for line in text.splitlines():
        if line.startswith("{"):
            try:
                out.append(json.loads(line))
            except ValueError:
                pass
    return out


def day(date):
    """Modulo 1024 weeks, as a GPS receiver knows it."""
    return datetime.date.fromisoformat(date).toordinal() % (7 * 1024)


def time_of_day(tpv):
    if "time" not in tpv:
        return None
    h, m, s = tpv["time"][11:-1].split(":")
    return int(h) * 3600 + int(m) * 60 + float(s)


def same_time(a, b):
    return a is None or b is None or abs((a - b + 43200) % 86400 - 43200) < 0.0011


def geodetic(x, y, z):
    """WGS84 latitude, longitude in deg and height in m, by fixed-point iteration."""
    a, f = 6378137.0, 1 / 298.257223563
    e2, p = f * (2 - f), math.hypot(x, y)
    latitude, n = math.atan2(z, p * (1 - e2)), a
    for _ in range(20):
        n = a / math.sqrt(1 - e2 * math.sin(latitude) ** 2)
        latitude = math.atan2(z + e2 * n * math.sin(latitude), p)
    height = p * math.cos(latitude) + z * math.sin(latitude) - a * a / n
    return math.degrees(latitude), math.degrees(math.atan2(y, x)), height


def tpvs_of(text, from_ecef):
    out, lines = [], lines_of(text)
    errors = {t["time"]: t for t in lines if t.get("class") == "GST" and {"time", "lat", "lon", "alt"} <= t.keys()}
    for t in lines:
        if t.get("class") != "TPV" or t.get("mode", 0) < 2 or "lat" not in t or "lon" not in t:
            continue
        if "time" in t:
            t["day"] = day(t["time"][:10])
        if t.get("time") in errors:
            gst = errors[t["time"]]
            t["gst_h"], t["gst_v"] = math.sqrt((gst["lat"] ** 2 + gst["lon"] ** 2) / 2), gst["alt"]
        if from_ecef:
            t["lat"], t["lon"], t["altHAE"] = geodetic(t["ecefx"], t["ecefy"], t["ecefz"])
            for field in ("altMSL", "speed", "track") + MODELLED:
                t.pop(field, None)
            if "ecefvx" in t:
                v = (t["ecefvx"], t["ecefvy"], t["ecefvz"])
                b, a = math.radians(t["lat"]), math.radians(t["lon"])
                out_v = math.cos(a) * v[0] + math.sin(a) * v[1]
                t["velE"] = math.cos(a) * v[1] - math.sin(a) * v[0]
                t["velN"] = math.cos(b) * v[2] - math.sin(b) * out_v
                t["velD"] = -math.cos(b) * out_v - math.sin(b) * v[2]
        out.append((time_of_day(t), t))
    return out


def compare(ours, tpvs, angle):
    """Counts of (equal, what differs: list of texts)."""
    def same_angle(a, b):
        return abs(a - b) < angle

    different, equal = [], 0
    for mine in ours:
        at = mine.get("tod_s")
        same = [t for time, t in tpvs if same_time(time, at)]
        here = [t for t in same if same_angle(t["lat"], mine["lat"]) and same_angle(t["lon"], mine["lon"])]
        if not here and all("time" not in t for t in same):
            kind = "last" if mine is ours[-1] else "first" if mine is ours[0] else "extra" if "date" in mine else "undated"
            different.append(f"{kind}: {at} not among the judge's times")
            continue
        if not here:
            different.append(f"place: {at} {mine['lat']} {mine['lon']} judge {same[-1]['lat']} {same[-1]['lon']}")
            continue
        wrong = []
        for field, theirs, tolerance in FIELDS:
            values = [t[theirs] for t in here if theirs in t]
            if field in mine and values:
                error = min(abs((v - mine[field] + 180) % 360 - 180) if field == "course" else abs(v - mine[field]) for v in values)
                if error > (0.02 if field == "height" and angle > 1e-7 else tolerance) + 1e-6 * abs(mine[field]):
                    wrong.append(f"{field}: {at} {mine[field]} judge {values}")
        different += wrong
        equal += not wrong
    for at, t in tpvs:
        if not any(same_time(at, m.get("tod_s")) and same_angle(t["lat"], m["lat"]) and same_angle(t["lon"], m["lon"]) for m in ours):
            different.append(f"{'untimed' if at is None else 'missing'}: {at} {t['lat']} {t['lon']} mode {t['mode']}")
    return equal, different


def compare_dilution(reports, text):
    """What the judge's SKYs say of it, without those that we did not say, later than the one before or with it."""
    different, at, skies = [], 0, 0
    for sky in lines_of(text):
        values = {name: sky[name] for name in ("pdop", "hdop", "vdop") if name in sky}
        if sky.get("class") != "SKY" or not values:
            continue
        skies += 1
        for number in range(at, len(reports)):
            both = [name for name in values if name in reports[number]]
            if both and all(abs(reports[number][name] - values[name]) < 0.0051 for name in both):
                at = number
                break
        else:
            different.append(f"dilution: {values} not in our reports")
    return skies, different


def main():
    verbose = "--verbose" in sys.argv
    args = [a for a in sys.argv[1:] if not a.startswith("--")]
    root = os.path.dirname(os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__)))))
    data = os.path.join(os.environ.get("TETAP_DATA", os.path.join(root, "..", "shared", "data")), "gpsd")
    if not os.path.isdir(data):
        print(f"no {data}: skipped")
        return 77
    logs = sorted(path for path in glob.glob(os.path.join(glob.escape(data), "**", "*.log"), recursive=True) if os.path.exists(path + ".chk"))
    if not logs:
        print(f"no log with its .log.chk in {data}: skipped")
        return 77
    if shutil.which("gpsdecode") is None:
        print("no gpsdecode (Debian's gpsd-clients): skipped")
        return 77
    failures, totals = [], {"chk": [0] * 5, "gpsdecode": [0] * 5}
    spoken, fixes = 0, 0
    for path in logs:
        name = os.path.basename(path)
        if len(args) > 1 and name not in args[1:]:
            continue
        out = lines_of(subprocess.run([args[0], path], capture_output=True, text=True, check=True).stdout)
        ours = [r for r in out[:-1] if r.get("fix", 0) >= 2 and "lat" in r]  # a line without a fix is a heading
        for r in ours:
            if "date" in r:
                r["day"] = day(r["date"])
            if "up" in r:
                r["down"] = -r["up"]
            if r["protocol"] == "NMEA":
                for axis in ("north", "east"):
                    r.pop(axis, None)
                for ours_is, field in (("hacc", "gst_h"), ("vacc", "gst_v")):
                    if ours_is in r:
                        r[field] = r.pop(ours_is)
            elif abs(math.hypot(r["north"], r["east"]) - r["speed"]) > 0.01:
                failures.append(f"{name}: speed {r['speed']} is not that of the velocity")
        if len(out) == 1:
            if name not in NOT_SPOKEN:
                failures.append(f"{name}: no report")
            print(f"{name}: neither UBX nor NMEA fixes: {NOT_SPOKEN.get(name)}")
            continue
        if name in NOT_SPOKEN:
            failures.append(f"{name}: {len(out) - 1} reports, but is listed as without")
        with open(path, "rb") as log:
            decoded = subprocess.run(["gpsdecode"], stdin=log, capture_output=True, timeout=60, check=False).stdout.decode(errors="replace")
        angle, why = COARSE.get(name, (ANGLE, ""))
        with open(path + ".chk", errors="replace") as chk:
            judges = {"chk": chk.read(), "gpsdecode": decoded}
        spoken, fixes = spoken + 1, fixes + len(ours)
        expected = EXPECTED.get(name, ({}, {}, ""))
        row = []
        for number, (judge, text) in enumerate(judges.items()):
            equal, different = compare(ours, tpvs_of(text, why == FROZEN), angle)
            skies, dilution = compare_dilution(out[:-1], text)
            different += dilution
            kinds = {}
            for text in different:
                kind = text.split(":")[0]
                kinds[kind] = kinds.get(kind, 0) + 1
            totals[judge][0] += equal
            totals[judge][1] += len(ours) - equal
            totals[judge][2] += sum(n for kind, n in kinds.items() if kind in ("missing", "untimed"))
            totals[judge][3] += skies
            totals[judge][4] += len(dilution)
            row.append(f"{judge} {equal} of {len(ours)} equal{' ' + str(kinds) if kinds else ''}")
            if kinds != expected[number]:
                failures.append(f"{name}: {judge}: {kinds}, expected {expected[number]}")
                different = different[:10]
                failures += ["    " + text for text in different]
            if verbose:
                print("\n".join(f"   {judge} {t}" for t in different))
        reason = "; ".join(r for r in (expected[2], why) if r)
        print(f"{name}: " + "; ".join(row) + (f" ({reason})" if reason else ""))
    for judge, (equal, different, missing, skies, unlike) in totals.items():
        print(f"{judge}: {spoken} logs, {fixes} fixes: {equal} equal, {different} different, {missing} that are none of ours; "
              f"{skies} of its dilutions, {unlike} different")
    print("\n".join(failures))
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
