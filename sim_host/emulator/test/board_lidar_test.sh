#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# board_lidar_test.sh SECONDS [BOARD]: robot scanner on BOARD's flash image (default ark_cannode) with an LD19 on its serial port. The model of the scanner
# makes its bytes by the manual. No model complains, the log repeats byte for byte, every turn becomes a scan that is fused, and the pose follows the truth.
# A log without one block of a scan does not repeat.
set -eu
seconds=${1:-40} board=${2:-ark_cannode}
. "$(dirname "${BASH_SOURCE[0]}")/board_session.sh"
image=build/m4f/hal/board/tetap-$board-scanner.elf
TETAP_IMAGE=$image BOARD=$board OUT=$out ROBOT=scanner SEED=1 FAULT=none WORLD="--seconds $seconds" REPORT=--no-pictures tools/run/emulate_board >"$out/said" 2>&1 ||
  fail "status $?: $(tail -5 "$out/said")"
awk '/ 34B#/ && ++blocks == 9001 { next } { print }' "$out/raw.log" >"$out/lost.log"
"$programs/tetap-play" "$out/lost.log" --memory --robot scanner --out "$out/lost" --quiet >"$out/said" 2>&1 &&
  fail "a lost block is not seen"
/usr/bin/python3 - "$out" "$seconds" <<'PYTHON'
import csv, json, os, sys
folder, seconds = sys.argv[1], float(sys.argv[2])
with open(os.path.join(folder, "summary.json"), encoding="utf-8") as file:
    run = json.load(file)
with open(os.path.join(folder, "lost/run.json"), encoding="utf-8") as file:
    lost = json.load(file)
length, wrong = min(seconds, run["board_s"]), []
def must(holds, words):
    if not holds:
        wrong.append(words)
must(run["complaints"] == 0 and run["resets"] == 0, f"{run['resets']} resets, complaints: {run['complaint_texts']}")
must(run["epochs_different"] == 0 and run["unlogged"] == 0, f"{run['epochs_different']} epochs differ, {run['unlogged']} are not in the log")
must(run["epochs_compared"] >= 100 * (length - 2), f"only {run['epochs_compared']} epochs in {length} s")
must(lost["hole"] and lost["epochs_compared"] < run["epochs_compared"] / 2, f"a lost block is no hole: {lost['hole']}")
with open(os.path.join(folder, "raw.log"), encoding="utf-8") as file:
    ids = [line.split()[2].split("#")[0] for line in file]
heads, blocks = ids.count("34C"), ids.count("34B")  # In_ScanHead, In_Scan
must(10 * (length - 1.5) <= heads <= 10 * length, f"{heads} scans in {length} s")
must(90 * (heads - 1) <= blocks <= 90 * heads, f"{blocks} blocks of {heads} scans")
with open(os.path.join(folder, "sensors.csv"), encoding="utf-8", newline="") as file:
    last = [row for row in csv.DictReader(file) if row["sensor"] == "Scan"][-1]
accepted = int(last["accepted"])
must(accepted >= 0.95 * heads - 2, f"{accepted} of {heads} scans fused: {last}")
print(f"  {run['epochs_compared']} epochs, {run['epochs_different']} different, {heads} scans, {accepted} fused, "
      f"{run['fused']['position_rmse_m']:.3f} m, {run['times_realtime']:.1f} times real time")
must(0.001 < run["fused"]["position_rmse_m"] < 0.3, f"position {run['fused']['position_rmse_m']} m")
for words in wrong:
    print(f"board_lidar_test: {words}", file=sys.stderr)
sys.exit(bool(wrong))
PYTHON
