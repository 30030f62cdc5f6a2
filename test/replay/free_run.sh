#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# free_run.sh BOARD ROBOT LOG SECONDS: a node on its own timer, its sensors' frames sent in real time with jitter, drops, duplicates and
# reordering, everything on the bus recorded; then the record is played to the host program at the desk, which must give the same
# bytes in every frame it has in common with the record.
set -u
. "$(dirname "$0")/../../tools/run_lib.sh"
cd "$root" || exit 2
board=$1 robot=$2 log=$3 seconds=$4
out=out/free/$board-$robot
record=$out/record.log

if [ "${5:-}" = --inside ]; then
  candump -L -r 16000000 vcan0 >"$record" &
  recorder=$!
  sleep 0.3
  node_start "$board" "$robot" vcan0 || exit 2
  # shellcheck disable=SC2046
  "$programs/tetap-play" "$out/input.log" --can vcan0 --robot "$robot" --out "$out/live" --quiet --realtime --sync clock --jitter-ms 15 --drop 0.01 \
    --duplicate 0.01 --reorder 0.02 --seed 1 $(player_options "$board" | sed 's/--window 1//')
  status=$?
  node_stop $status
  kill "$recorder"; wait "$recorder" 2>/dev/null
  exit 0  # frames dropped on purpose make the live run's own accounts complain; the replay is the judge
fi

rm -rf "$out"; mkdir -p "$out"
awk -v s="$seconds" 'substr($1, 2) + 0 <= s + 1' "$log" >"$out/input.log"
tools/with-vcan --private -t $((seconds * 4 + 120)) "$0" "$board" "$robot" "$log" "$seconds" --inside || exit 1
"$programs/tetap-play" "$record" --as-recorded --memory --robot "$robot" --out "$out/desk" --quiet || { echo "the desk replay differs from the run"; exit 1; }
json() { grep -o "\"$1\": [^,]*" "$out/$2/run.json" | head -1 | cut -d' ' -f2; }
compared=$(json epochs_compared desk)
echo "  $board $robot: live $(json epochs live) epochs, dropped $(json frames_dropped live), doubled $(json frames_duplicated live), reordered $(json frames_reordered live); desk compared ${compared:-?} epochs, different $(json epochs_different desk)"
[ "${compared:-0}" -gt $((seconds * 80)) ] || { echo "too few epochs compared"; exit 1; }
