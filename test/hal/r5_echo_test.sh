#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# test/hal/r5_echo_test.sh SMOKE.elf CAN_ECHO_PEER: the smoke image on the emulated Cortex-R5F, on a private vcan0. 200 frames, standard
# and extended, come back complete, in order and unchanged; then the image's own counters, its timer against the computer's clock, its stack
# and the report of an exception are read from what it printed.
# Needs cansend (Debian package can-utils).
set -u
here=$(cd "$(dirname "$0")" && pwd)
tools=$here/../../tools
if [ "${3:-}" != inside ]; then
  [ $# -eq 2 ] || { echo "usage: r5_echo_test.sh SMOKE.elf CAN_ECHO_PEER" >&2; exit 2; }
  exec "$tools/run/provide_vcan" --private -t 120 "$here/r5_echo_test.sh" "$(realpath "$1")" "$(realpath "$2")" inside
fi

work=$(mktemp -d) || exit 2
trap 'rm -rf "$work"' EXIT
fail() { echo "r5_echo_test: $*" >&2; cat "$work/uart" >&2; exit 1; }

now_ms() { echo $(($(date +%s%N) / 1000000)); }
cat >"$work/drive" <<'DRIVE'
if ! "$1" vcan0 20 5 || ! "$1" vcan0 2 50; then exit 1; fi  # 200 frames; fifty at once nearly fill the controller
cansend vcan0 7F0#00; sleep 2; cansend vcan0 7F0#00  # two reports, two seconds apart
cansend vcan0 124#R  # a remote frame is counted, not answered
sleep 0.3; cansend vcan0 7F0#00; sleep 0.3
cansend vcan0 7F1#00; sleep 0.5
DRIVE
began_ms=$(now_ms)
"$tools/run/emulate_r5" "$1" --can vcan0 -t 60 --then /bin/bash "$work/drive" "$2" 2>"$work/uart" || fail "the echo failed"
whole_ms=$(($(now_ms) - began_ms))

mapfile -t reports < <(grep '^smoke: ms' "$work/uart")
[ ${#reports[@]} -eq 3 ] || fail "expected three reports, got ${#reports[@]}"
value() { sed -E "s/.* $1 ([0-9]+).*/\1/" <<<"$2"; }
for counter in rx_overflow tx_full bus_off; do
  [ "$(value $counter "${reports[2]}")" = 0 ] || fail "$counter is not 0"
done
[ "$(value unsupported "${reports[1]}")$(value unsupported "${reports[2]}")" = 01 ] || fail "the remote frame was not counted"
[ "$(value echoed "${reports[2]}")" -ge 200 ] || fail "fewer than 200 frames were echoed"
# The core's clock follows the computer's: two seconds of sleep lie between the reports, and both lie within the whole run.
elapsed_ms=$(($(value ms "${reports[1]}") - $(value ms "${reports[0]}")))
if [ $elapsed_ms -lt 1500 ] || [ $elapsed_ms -gt $whole_ms ]; then fail "two seconds were $elapsed_ms ms (the whole run: $whole_ms)"; fi
used=$(value stack "${reports[2]}")
if [ "$used" -le 64 ] || [ "$used" -ge 4096 ]; then fail "the stack's high-water mark is $used bytes"; fi
grep -q '^tetap: exception: undefined instruction at 0000[0-9a-f]\{4\}$' "$work/uart" || fail "the exception was not reported"
grep -q 'sections are not loaded' "$work/uart" && fail "the sections were not loaded"
echo "r5_echo_test: passed, ${reports[2]}"
