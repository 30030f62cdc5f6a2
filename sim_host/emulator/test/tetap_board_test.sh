#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# tetap_board_test.sh TETAP-BOARD PROGRAMS: the program's three exit statuses, its log, and the same run twice to the byte.
set -eu
board=$1 programs=$2
[ -x "$board" ] || { echo "tetap_board_test: skipped: no $board (libunicorn-dev)" >&2; exit 77; }
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT
fail() { echo "tetap_board_test: $*" >&2; exit 1; }

[ "$("$board" --seconds 0.1 "$programs/hello.elf" 2>"$out/err")" = "hello from 96 MHz" ] || fail "no line on the console: $(cat "$out/err")"
"$board" --seconds 0.5 --log "$out/a.log" "$programs/sensors.elf" >/dev/null 2>"$out/err" || fail "complaints: $(cat "$out/err")"
"$board" --seconds 0.5 --log "$out/b.log" "$programs/sensors.elf" >/dev/null 2>&1
[ -s "$out/a.log" ] || fail "the log is empty"
cmp "$out/a.log" "$out/b.log" || fail "two runs differ"
grep -qE '^\([0-9]+\.[0-9]{6}\) can0 [0-9A-F]{3}#[0-9A-F]*$' "$out/a.log" || fail "not a line of candump: $(head -1 "$out/a.log")"
status=0; "$board" --seconds 0.3 --no-imu "$programs/sensors.elf" >/dev/null 2>"$out/err" || status=$?
[ $status = 0 ] || fail "no IMU is no complaint of the models: $(cat "$out/err")"
status=0; "$board" "$out/none.elf" >/dev/null 2>"$out/err" || status=$?
[ $status = 2 ] && grep -q 'none.elf: cannot be opened' "$out/err" || fail "a missing image: status $status, $(cat "$out/err")"
status=0; "$board" "$0" >/dev/null 2>"$out/err" || status=$?
[ $status = 2 ] && grep -q 'not an ELF file' "$out/err" || fail "a script as image: status $status, $(cat "$out/err")"
status=0; "$board" --cpi 9 "$programs/hello.elf" >/dev/null 2>"$out/err" || status=$?
[ $status = 2 ] || fail "--cpi 9 is out of range: status $status"
# A lost supply starts the program anew, and a file keeps the flash: words that a program wrote, and not what it may not write.
[ "$("$board" --seconds 0.4 --power-cycle 0.1 "$programs/hello.elf" 2>"$out/err")" = $'hello from 96 MHz\nhello from 96 MHz' ] || fail "--power-cycle: $(cat "$out/err")"
"$board" --seconds 0.1 --flash "$out/flash" "$programs/flash.elf" >/dev/null 2>"$out/err" || true  # it stores without PG, too
[ "$(od -An -tx4 -j 0x20000 -N 16 "$out/flash" | tr -d ' ')" = 01010101222222223333333344444444 ] || fail "--flash: $(od -An -tx4 -j 0x20000 -N 16 "$out/flash")"
"$board" --seconds 0.1 --flash "$out/flash" "$programs/hello.elf" >/dev/null 2>"$out/err" || fail "--flash again: $(cat "$out/err")"
[ "$(od -An -tx4 -j 0x20004 -N 4 "$out/flash" | tr -d ' ')" = 22222222 ] || fail "an image that is flashed keeps what it does not cover"
truncate -s 1000 "$out/flash"
status=0; "$board" --flash "$out/flash" "$programs/hello.elf" >/dev/null 2>"$out/err" || status=$?
[ $status = 2 ] && grep -q '1000 bytes are no flash of 1048576 bytes' "$out/err" || fail "a cut flash file: status $status, $(cat "$out/err")"
# A board is named by the option or by the image's file name.
[ "$("$board" --board nucleo_g474re --seconds 0.1 "$programs/nucleo.elf" 2>"$out/err")" = "hello from 160 MHz" ] || fail "--board: $(cat "$out/err")"
cp "$programs/nucleo.elf" "$out/tetap-nucleo_g474re-rover.elf"
[ "$("$board" --seconds 0.1 "$out/tetap-nucleo_g474re-rover.elf" 2>"$out/err")" = "hello from 160 MHz" ] || fail "board by file name: $(cat "$out/err")"
status=0; "$board" --seconds 0.1 "$programs/nucleo.elf" >/dev/null 2>"$out/err" || status=$?
[ $status = 1 ] || fail "an image for another chip: status $status, $(cat "$out/err")"
for wrong in "--board disco" "--power-cycle 0" "--power-cycle 1,," "--power-cycle x" "--flash-time never" "--board nucleo_g474re --lsi 17000"; do
  status=0; "$board" $wrong "$programs/nucleo.elf" >/dev/null 2>"$out/err" || status=$?
  [ $status = 2 ] || fail "$wrong: status $status"
done
