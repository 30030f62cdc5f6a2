#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# free_run.sh BOARD ROBOT LOG SECONDS: a node on its own timer, its sensors' frames sent in real time with jitter, drops, duplicates and
# reordering, everything on the bus recorded with candump; then the record is played to the host program at the desk, which must give
# the same bytes in every frame. LOG may be `world`: the simulated world's frames.
set -u
. "$(dirname "$0")/../../tools/run/node_session.sh"
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
  with_node "$programs/tetap-play" "$out/input.log" --can vcan0 --robot "$robot" --out "$out/live" --quiet --realtime --sync clock --jitter-ms 15 --drop 0.01 \
    --duplicate 0.01 --reorder 0.02 --seed 1 $(player_options "$board" | sed 's/--window 1//')
  node_stop $?
  kill "$recorder"; wait "$recorder" 2>/dev/null
  exit 0  # the record is the judge: on a bus where frames are dropped on purpose the player's own accounts do not close
fi

# The world's log has no times of arrival, only its ticks: a period's frames are laid out evenly over that period.
timed_world() {
  "$programs/tetap-world" --memory --duration "$seconds" --raw --quiet --out "$out/world" >/dev/null || return 1
  grep -E ' 3[01][0-9A-F]#' "$out/world/raw.log" | awk '
    function hex(text, at) { return 16 * (index("0123456789ABCDEF", substr(text, at, 1)) - 1) + index("0123456789ABCDEF", substr(text, at + 1, 1)) - 1 }
    $3 !~ /^300#/ { waiting[++n] = $3; next }
    { time = 0; for (i = 5; i >= 0; --i) time = time * 256 + hex($3, 5 + 2 * i)
      for (i = 1; i <= n; ++i) printf "(%.6f) vcan0 %s\n", (time - 9500 + 9000 * i / n) / 1e6, waiting[i]
      n = 0 }'
}

rm -rf "$out"; mkdir -p "$out"
if [ "$log" = world ]; then timed_world >"$out/input.log"; else awk -v s="$seconds" 'substr($1, 2) + 0 <= s + 1' "$log" >"$out/input.log"; fi || exit 1
tools/run/provide_vcan --private -q -t $((seconds * 4 + 120)) "$0" "$board" "$robot" "$log" "$seconds" --inside || exit 1
# What the node itself said of the run in its last diagnostics.
grep ' 325#' "$record" | tail -30 | tools/can/decode_log >"$out/diagnostics.txt"
said() { grep -oE " $1=[^ ]*" "$out/diagnostics.txt" | tail -1 | cut -d= -f2; }
# An emulator that does not get its share of the processor is a receiver that is too slow: the run shows nothing, either way.
lost=$(said RxOverflow)
[ "${lost:-0}" = 0 ] || { echo "  the emulated receiver lost ${lost} frames, so the record is not what the node consumed"; exit 75; }
"$programs/tetap-play" "$record" --as-recorded --memory --robot "$robot" --out "$out/desk" --quiet || { echo "the desk replay differs from the run"; exit 1; }
"$programs/tetap-play" "$out/input.log" --memory --robot "$robot" --out "$out/lockstep" --quiet || exit 1

json() { grep -o "\"$1\": [^,]*" "$out/$2/run.json" | head -1 | cut -d' ' -f2 | tr -d '"'; }
compared=$(json epochs_compared desk)
echo "  $board $robot: dropped $(json frames_dropped live), doubled $(json frames_duplicated live), reordered $(json frames_reordered live);" \
  "the node: $(said Sync), late $(said TooLate), duplicate $(said Duplicate), incomplete $(said Incomplete), ticks late $(said TicksLate);" \
  "at the desk ${compared:-?} epochs compared, different $(json epochs_different desk)"
wrong=0
is() { [ "$1" = yes ] || { echo "  $2"; wrong=1; }; }
# Ticks that came late stand for epochs that are missing; both together show that the node did not stop.
late=$(said TicksLate)
is "$([ $((${compared:-0} + ${late:-0})) -gt $((seconds * 80)) ] && echo yes)" "too few epochs compared"
is "$([ "$(said Sync)" = OwnTimer ] && echo yes)" "the node did not run on its own timer"
is "$([ $(($(said TooLate) + $(said Duplicate) + $(said Incomplete))) -gt 0 ] && echo yes)" "what was done to the frames did not reach the node"
is "$([ "$(json estimates_sha256 desk)" != "$(json estimates_sha256 lockstep)" ] && echo yes)" "the run is the same as the undisturbed one in lockstep"
[ "$wrong" = 0 ] || exit 1
[ "${compared:-0}" -gt $((seconds * 80)) ] || { echo "  ${compared} of $((seconds * 100)) epochs, ${late} ticks late"; exit 75; }
