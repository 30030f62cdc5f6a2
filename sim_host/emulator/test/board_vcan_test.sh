#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# board_vcan_test.sh [SECONDS]: the rover's flash image on vcan0 as `make board BUS=vcan` runs it, in real time: candump beside it sees the board's own log, two frames
# of cansend are on the emulated bus, and that log repeats byte for byte.
set -eu
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../../.." && pwd)
cd "$root"
programs=build/host/sim_host
strangers=(31D#0102030405060708 123#11)
if [ "${1:-}" = --inside ]; then
  # A bus that nobody is on yet takes frames, too: they come when the board has booted.
  (sleep 4; for frame in "${strangers[@]}"; do cansend vcan0 "$frame"; sleep 0.3; done) &
  tools/run/emulate_board --inside
  exit
fi
seconds=${1:-8}
[ -x "$programs/emulator/tetap-board" ] || { echo "board_vcan_test: skipped: no $programs/emulator/tetap-board (libunicorn-dev)" >&2; exit 77; }
command -v candump cansend >/dev/null || { echo "board_vcan_test: skipped: no can-utils" >&2; exit 77; }
out=$(mktemp -d "$root/build/board_vcan.XXXXXX")  # the guest of user-mode-linux has another /tmp
trap 'rm -rf "$out"' EXIT
fail() { echo "board_vcan_test: $*" >&2; exit 1; }

export TETAP_IMAGE=build/m4f/hal/board/tetap-ark_cannode-rover.elf OUT=$out ROBOT=rover BUS=vcan SEED=1 FAULT=none WORLD="--seconds $seconds"
began=$(date +%s%N)
tools/run/provide_vcan --private -q "$0" --inside >"$out/said" 2>&1 || fail "status $?: $(tail -5 "$out/said")"
took_ms=$((($(date +%s%N) - began) / 1000000))
[ "$took_ms" -ge $((seconds * 1000)) ] || fail "$seconds s of life took $took_ms ms"
cmp <(cut -d' ' -f3 "$out/raw.log" | sort) <(cut -d' ' -f3 "$out/candump.log" | sort) || fail "candump saw other frames than the board's log has"
for frame in "${strangers[@]}"; do
  [ "$(grep -c " $frame\$" "$out/raw.log")" = 1 ] || fail "$frame of cansend is not once on the emulated bus"
done
"$programs/tetap-play" "$out/raw.log" --memory --robot rover --out "$out" --quiet || fail "the log does not repeat"
/usr/bin/python3 - "$out" <<'PYTHON' || fail "$(tail -3 "$out/said")"
import json, sys
run, board = (json.load(open(f"{sys.argv[1]}/{name}.json", encoding="utf-8")) for name in ("run", "board"))
print(f"{board['frames_on_bus']} frames on vcan0, {run['epochs_compared']} epochs repeated, {run['epochs_different']} different")
sys.exit(run["epochs_different"] != 0 or run["epochs_compared"] < 100 * (board["board_s"] - 1) or board["complaints"] != 0)
PYTHON
grep -o "in real time, at most .*" "$out/said"
