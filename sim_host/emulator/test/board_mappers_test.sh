#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# board_mappers_test.sh SECONDS: robots that make their map on their flash images, as `make board ROBOT=mapper` and `ROBOT=graph128` run them. Sightings of
# landmarks and closures of loops come as other nodes' frames over CAN, a wheel spins. No model complains, the log repeats byte for byte, the map grows, and the
# estimate stays within its sigma.
set -eu
seconds=${1:-40}
[ "$seconds" -ge 60 ] || seconds=60
. "$(dirname "${BASH_SOURCE[0]}")/board_session.sh"
for robot in mapper graph128; do
  TETAP_IMAGE=build/m4f/hal/board/tetap-ark_cannode-$robot.elf OUT=$out/$robot ROBOT=$robot SEED=1 FAULT=wheel_spin@35+3 WORLD="--seconds $seconds" \
    REPORT=--no-pictures tools/run/emulate_board >"$out/said" 2>&1 || fail "$robot: status $?: $(tail -5 "$out/said")"
done
/usr/bin/python3 - "$out" "$seconds" <<'PYTHON'
import json, sys
folder, seconds = sys.argv[1], float(sys.argv[2])
wrong = []
for robot in ("mapper", "graph128"):
    with open(f"{folder}/{robot}/summary.json", encoding="utf-8") as file:
        run = json.load(file)
    fused, length = run["fused"], min(seconds, run["board_s"])
    def must(holds, words):
        if not holds:
            wrong.append(f"{robot}: {words}")
    must(run["complaints"] == 0, f"complaints: {run['complaint_texts']}")
    must(run["resets"] == 0, f"{run['resets']} resets")
    must(run["epochs_different"] == 0 and run["unlogged"] == 0, f"{run['epochs_different']} epochs differ, {run['unlogged']} are not in the log")
    must(run["epochs_compared"] >= 100 * (length - 2), f"only {run['epochs_compared']} epochs in {length} s")
    must(0.005 < fused["position_rmse_m"] < 0.6, f"position {fused['position_rmse_m']} m")
    # A share: until the start pose comes, the pose is that of a frame of the robot's own.
    must(fused["nees_inside_95"] > 0.9, f"{100 * fused['nees_inside_95']:.1f} % of the poses within 95 %")
    if robot == "mapper":
        must(8 <= fused["landmarks_in_map"] <= 30, f"{fused['landmarks_in_map']} landmarks")
        must(run["wrong_associations"] == 0, f"{run['wrong_associations']} wrong associations")
    else:
        must(run["poses"] > 60 and run["edges_refused"] == 0, f"{run['poses']} keyframes, {run['edges_refused']} closures refused")
        must(run["chi2"] is not None and run["chi2"] > 1, "no optimisation ended")
    print(f"  {robot:9} {run['epochs_compared']} epochs, {run['epochs_different']} different, {fused['position_rmse_m']:.3f} m, {100 * fused['nees_inside_95']:.1f} % within 95 %, "
          f"{run['times_realtime']:.1f} times real time")
for words in wrong:
    print(f"board_mappers_test: {words}", file=sys.stderr)
sys.exit(bool(wrong))
PYTHON
