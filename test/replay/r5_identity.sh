#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# r5_identity.sh SECONDS: the R5 image in QEMU on a private vcan against the host program in memory, on the first SECONDS of every
# recorded MRCLAM robot that out/recorded holds and of the simulated world, and on half of that of the inertial logs in out/inertial_runs (car,
# PX4, Husky; their images are built here), and in the whole form of the simulated world with an IMU of 200 Hz: the estimate frames and state CRCs
# must be equal, byte for byte, in two runs of each (of the last one in one); the path must move, and one flipped input bit must change the state CRC
# on both.
set -u
. "$(dirname "$0")/../../tools/run/node_session.sh"
cd "$root" || exit 2
seconds=${1:-20}
out=out/r5
mkdir -p $out

# The first SECONDS of a log; with a last argument, bit 5 of the 4th data byte of the 300th BodySpeed or WheelCounts frame flipped.
prefix() { awk -v s="$2" 'substr($1, 2) + 0 <= s + 1' "$1"; }
flip() { awk '$3 ~ /^30[68]#/ && ++n == 300 { d = substr($3, 11, 2); v = index("0123456789ABCDEF", substr(d, 1, 1)) - 1; v = (v % 4 >= 2) ? v - 2 : v + 2
  $3 = substr($3, 1, 10) substr("0123456789ABCDEF", v + 1, 1) substr($3, 12) } { print }' "$1"; }

# A log here is called RUN_ROBOT.log, with - for _ in the robot's name.
robot_of() { local robot=${1##*_}; echo "${robot//-/_}"; }
robots() { find "$out" -maxdepth 1 -name '*_*.log' -printf '%f\n' | sed 's/\.log$//; s/.*_//' | sort -u; }
inertial() { [[ $1 == *_car || $1 == *_iris || $1 == *_husky-inertial ]]; }

if [ "${1:-}" = --inside ]; then
  failed=0
  for robot in $(robots); do
    for log in $out/*_"$robot".log; do
      name=$(basename "$log" .log)
      [ -n "${node:-}" ] || node_start zynqmp_r5 "$(robot_of "$name")" vcan0 || exit 2
      # shellcheck disable=SC2046
      with_node "$programs/tetap-play" "$log" --can vcan0 --robot "$(robot_of "$name")" --out "$out/$name.board" --quiet $(player_options zynqmp_r5) || { failed=1; node_stop 1; }
    done
    node_stop
  done
  exit $failed
fi

rm -rf "${out:?}"/*
images=()
[ -e out/recorded/mrclam1.log ] || echo "  no recorded runs in out/recorded (set TETAP_DATA): the simulated world only"
# The inputs of a simulated run. Times of arrival in memory mean nothing, so its ticks (Step frames) go into the log too.
world() {  # NAME OPTION...
  "$programs/tetap-world" --memory --duration "$seconds" --raw --quiet --out "$out/$1" "${@:2}" >/dev/null || return 1
  grep -E ' 3[01][0-9A-F]#' "$out/$1/raw.log" >"$out/${1}_rover.log"
}
world world || exit 1
[ "$seconds" -le 20 ] || world world200 --imu-hz 200 || exit 1
for truth in out/recorded/mrclam*.truth.csv; do
  [ -e "$truth" ] || continue
  name=$(basename "$truth" .truth.csv)
  prefix "out/recorded/$name.log" "$seconds" >"$out/${name}_mrclam.log"
done
for run in skog_car iris_gps_iris husky_gnss_husky-inertial; do
  log=out/inertial_runs/${run%_*}.log
  [ -e "$log" ] || { echo "  no $log (set TETAP_DATA): left out"; continue; }
  prefix "$log" $((seconds / 2)) >"$out/$run.log"
  images+=("tetap-zynqmp_r5-$(robot_of "$run")")
done
[ ${#images[@]} = 0 ] || tools/run/build_preset "r5:$(IFS=,; echo "${images[*]}")" || exit 1
[ ! -e $out/mrclam1_mrclam.log ] || flip $out/mrclam1_mrclam.log >$out/flipped_mrclam.log
flip $out/world_rover.log >$out/flipped_rover.log
# Second runs: of all where there is time, else of one recorded run and the world.
for log in $out/{mrclam[1-5]_mrclam,world_rover}.log; do
  [ -e "$log" ] || continue
  [ "$seconds" -le 20 ] && [[ $log != */mrclam1_* && $log != */world_* ]] && continue
  name=$(basename "$log" .log)
  cp "$log" "$out/${name%_*}again_${name##*_}.log"
done

for log in $out/*_*.log; do
  name=$(basename "$log" .log)
  "$programs/tetap-play" "$log" --memory --robot "$(robot_of "$name")" --out "$out/$name.host" --quiet || exit 1
done
tools/run/provide_vcan --private -q -t $((seconds * 40 + 300)) "$0" --inside || exit 1

failed=0
for host in "$out"/*.host; do
  name=$(basename "$host" .host)
  epochs=$(grep -c ' 320#' "$host/estimates.log")
  moves=$(awk -F, 'NR > 1 && $5 != "" { if (!($3 in x)) { x[$3] = $5; y[$3] = $6 } d = ($5 - x[$3]) ^ 2 + ($6 - y[$3]) ^ 2; if (d > m) m = d } END { printf "%.2f", sqrt(m) }' "$host/estimates.csv")
  if cmp -s "$host/estimates.log" "$out/$name.board/estimates.log"; then verdict=equal; else verdict=DIFFERENT; failed=1; fi
  first=$out/${name/again_/_}.host
  cmp -s "$host/estimates.log" "$first/estimates.log" || { verdict="$verdict, but DIFFERENT from the run before"; failed=1; }
  least=0.3 length=$seconds
  if inertial "$name"; then
    length=$((seconds / 2))
    lasts=$(sed -n '1p;$p' "$out/$name.log" | awk '{ t = substr($1, 2) + 0; printf "%d\n", t - first; first = t }' | tail -1)
    [ "$lasts" -ge "$length" ] || length=$lasts
    [ "$seconds" -ge 120 ] || least=0                # some begin with a stand
    [[ $name != iris_* ]] || least=${least/0.3/0.1}  # it hovers
  fi
  awk -v m="$moves" -v e="$epochs" -v s="$length" -v l="$least" 'BEGIN { exit !(m >= l && e >= 100 * s - 60) }' || { verdict="$verdict, but it does not move or is too short"; failed=1; }
  printf '  %-20s %6d epochs, moves %6s m, state CRC %s: %s\n' "$name" "$epochs" "$moves" "$(grep -o '"state_crc_last": "[0-9A-F]*"' "$host/run.json" | cut -d'"' -f4)" "$verdict"
done
# The running CRC of the inputs differs at once; what must differ is the state: the first 32 bits of Est_StateCrc.
states() { sed -n 's/.* 321#\(.\{8\}\).*/\1/p' "$1"; }
for pair in "mrclam1_mrclam flipped_mrclam" "world_rover flipped_rover"; do
  read -r plain flipped <<<"$pair"
  for side in host board; do
    [ -e "$out/$plain.$side/estimates.log" ] || continue
    changed=$(comm -3 <(states "$out/$plain.$side/estimates.log" | nl) <(states "$out/$flipped.$side/estimates.log" | nl) | wc -l)
    if [ "$changed" -gt 0 ]; then echo "  one flipped bit in $plain on the $side: $((changed / 2)) state CRCs are others"; continue; fi
    echo "  one flipped bit in $plain leaves every state CRC as it was on the $side"
    failed=1
  done
done
exit $failed
