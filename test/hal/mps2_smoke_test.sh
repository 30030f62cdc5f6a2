#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# test/hal/mps2_smoke_test.sh m7|m4f SMOKE.elf: the smoke image on an emulated Cortex-M with a bus made of files: frames echoed, bad lines
# counted, exit status, missing file and fault reported.
set -u
[ $# -eq 2 ] || { echo "usage: mps2_smoke_test.sh m7|m4f SMOKE.elf" >&2; exit 2; }
run=("$(dirname "$0")/../../tools/run/emulate_mps2" --cpu "$1" -t 60 "$2")
work=$(mktemp -d) || exit 2
trap 'rm -rf "$work"' EXIT
fail() { echo "mps2_smoke_test: $*" >&2; cat "$work/said" >&2; exit 1; }

for ((i = 0; i < 1000; ++i)); do printf '(%d.5) vcan0 %03X#%04X\n(%d.6) vcan0 %08X#%016X\n' $i $((i % 0x7E0)) $i $i $((i * 99991 % 0x1FFFFFF0)) $((i * 7919)); done >"$work/in.log"
for ((i = 0; i < 1000; ++i)); do printf '%03X#%04X\n%08X#%016X\n' $((i % 0x7E0 + 1)) $i $((i * 99991 % 0x1FFFFFF0 + 1)) $((i * 7919)); done >"$work/want"
printf 'not a frame\n(1) vcan0 123#R\n' >>"$work/in.log"
"${run[@]}" "$work/in.log" "$work/out.log" >"$work/said" 2>&1 || fail "status $? instead of 0"
cut -d' ' -f3 "$work/out.log" | cmp - "$work/want" || fail "the echo differs"
grep -q 'echoed 2000 rx_overflow 2 tx_full 0' "$work/said" || fail "the counters differ"
grep -q 'sections are not loaded' "$work/said" && fail "the sections were not loaded"

"${run[@]}" "$work/missing.log" >"$work/said" 2>&1 && fail "a missing file is no error"
grep -q 'cannot open' "$work/said" || fail "a missing file is not named"
echo '(1) vcan0 7F1#' >"$work/in.log"
"${run[@]}" "$work/in.log" >"$work/said" 2>&1
[ $? -eq 120 ] || fail "a fault does not end with status 120"
grep -q '^tetap: exception: HardFault at 0000' "$work/said" || fail "the fault was not reported"
echo "mps2_smoke_test: $1 passed"
