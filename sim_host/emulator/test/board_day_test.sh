#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# board_day_test.sh SECONDS [BOARD]: the first SECONDS of the rover's day (at most the whole) on BOARD's flash image (default ark_cannode), as `make board` runs it: no model complains, the log
# repeats byte for byte, and two runs are equal. The estimate is honest, and as good as that of the board's twin: a node of this
# host that gets the same sensors with their noise and delays over CAN, without drivers, lines and machine code.
set -eu
seconds=${1:-40} board=${2:-ark_cannode}
. "$(dirname "${BASH_SOURCE[0]}")/board_session.sh"
image=build/m4f/hal/board/tetap-$board-rover.elf

TETAP_IMAGE=$image BOARD=$board OUT=$out/day ROBOT=rover SEED=1 FAULT=usual WORLD="--seconds $seconds --twin" REPORT=--no-pictures tools/run/emulate_board >"$out/said" 2>&1 ||
  fail "status $?: $(tail -5 "$out/said")"
tools/report/write_report "$out/day/twin" --truth "$out/day/twin/truth.csv" --no-pictures >/dev/null
/usr/bin/python3 - "$out/day/summary.json" "$out/day/twin/summary.json" "$seconds" <<'PYTHON' || exit 1
import csv, json, os, sys
day, twin = (json.load(open(name, encoding="utf-8")) for name in sys.argv[1:3])
seconds = min(float(sys.argv[3]), day["board_s"])
wrong = []
def must(holds, words):
    if not holds:
        wrong.append(words)
must(day["complaints"] == 0, f"complaints: {day['complaint_texts']}")
must(day["epochs_different"] == 0 and day["unlogged"] == 0, f"{day['epochs_different']} epochs differ, {day['unlogged']} are not in the log")
must(day["epochs_compared"] >= 100 * (seconds - 1), f"only {day['epochs_compared']} epochs in {seconds} s")
must(day["resets"] == 0 and day["imu_packets_lost"] == 0, f"{day['resets']} resets, {day['imu_packets_lost']} packets lost")
must(day["gnss_baud"] == 115200 and day["gnss_epochs"] > 3 * (seconds - 40), "the receiver was not configured")
fused, other = day["fused"], twin["fused"]
print(f"board {fused['position_rmse_m']:.3f} m {fused['heading_rmse_deg']:.3f} deg NEES {fused['nees_mean']:.2f}, "
      f"twin {other['position_rmse_m']:.3f} m {other['heading_rmse_deg']:.3f} deg NEES {other['nees_mean']:.2f}, {day['times_realtime']:.1f} times real time")
for key in ("position_rmse_m", "heading_rmse_deg"):
    must(fused[key] < 1.1 * other[key] + 0.002, f"{key} is {fused[key]}, of the twin {other[key]}")
must(0.05 < fused["nees_mean"] < 9, f"NEES is {fused['nees_mean']} of {fused['nees_dof']}")
# Where nobody knew the height, the first fixes confirm each other; then each fix has all three axes.
with open(os.path.join(os.path.dirname(sys.argv[1]), "innovations.csv"), encoding="utf-8") as file:
    dof = [row["dof"] for row in csv.DictReader(file) if row["sensor"] == "GnssPosition" and row["verdict"] == "Accepted"]
must(len(dof) - dof.count("3") <= 0.1 * len(dof) + 5, f"only {dof.count('3')} of {len(dof)} accepted fixes fused their height")
for words in wrong:
    print(f"board_day_test: {words}", file=sys.stderr)
sys.exit(bool(wrong))
PYTHON

for name in one two; do
  "$programs/emulator/tetap-board" --robot rover --seed 2 --seconds 4 --out "$out/$name" "$image" >/dev/null 2>&1 || fail "seed 2"
done
cmp "$out/one/raw.log" "$out/two/raw.log" || fail "two runs differ"
"$programs/emulator/tetap-board" --robot rover --seed 3 --seconds 4 --out "$out/three" "$image" >/dev/null 2>&1 || fail "seed 3"
! cmp -s "$out/one/raw.log" "$out/three/raw.log" || fail "the seed changes nothing"
status=0; "$programs/emulator/tetap-board" --robot rover --fault lost_frames "$image" >/dev/null 2>"$out/err" || status=$?
[ $status = 2 ] && grep -q "of sensors on the bus" "$out/err" || fail "lost_frames of wired sensors: status $status, $(cat "$out/err")"
status=0; "$programs/emulator/tetap-board" --robot rover --fault imu_dead@x "$image" >/dev/null 2>"$out/err" || status=$?
[ $status = 2 ] && grep -q "NAME\[@START\[+DURATION\]\]" "$out/err" || fail "imu_dead@x: status $status, $(cat "$out/err")"
