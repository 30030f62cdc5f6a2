#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# host_identity.sh SECONDS: every recorded run of out/recorded by the g++ program and by the clang++ program, each twice, in memory and
# whole; then the first SECONDS of it over a private vcan. Always the same bytes; and the path moves.
set -u
. "$(dirname "$0")/../../tools/run/node_session.sh"
cd "$root" || exit 2
seconds=${1:-20}
out=out/host
robot_of() { case $1 in mrclam*) echo mrclam ;; *) echo "$1" ;; esac; }
names=()
for log in out/recorded/{mrclam[1-5],husky,labyrinth}.log; do
  [ ! -e "$log" ] || names+=("$(basename "$log" .log)")
done
[ ${#names[@]} -gt 0 ] || { echo "no recorded runs in out/recorded (set TETAP_DATA)"; exit 77; }

if [ "${1:-}" = --inside ]; then
  failed=0 robot=
  for name in "${names[@]}"; do
    if [ "$robot" != "$(robot_of "$name")" ]; then
      node_stop
      robot=$(robot_of "$name")
      node_start linux "$robot" vcan0 || exit 2
    fi
    with_node "$programs/tetap-play" "$out/$name.log" --can vcan0 --robot "$robot" --out "$out/$name.vcan" --quiet || { failed=1; robot=; }
  done
  node_stop
  exit $failed
fi

rm -rf "$out"; mkdir -p "$out"
failed=0
play() { "$1/tetap-play" "$2" --memory --robot "$(robot_of "$name")" --out "$out/$name.$3" --quiet || failed=1; }
for name in "${names[@]}"; do
  for run in 1 2; do
    play "$programs" "out/recorded/$name.log" "g++$run"
    play build/clang/sim_host "out/recorded/$name.log" "clang++$run"
  done
  awk -v s="$seconds" 'NR == 1 { first = substr($1, 2) + 0 } substr($1, 2) + 0 <= first + s + 1' "out/recorded/$name.log" >"$out/$name.log"
  play "$programs" "$out/$name.log" memory
done
tools/run/provide_vcan --private -q -t 3000 "$0" --inside || failed=1

number() { grep -o "\"$2\": [^,]*" "$out/$name.$1/run.json" | head -1 | cut -d' ' -f2; }
for name in "${names[@]}"; do
  verdict=equal
  for run in g++2 clang++1 clang++2; do
    cmp -s "$out/$name.g++1/estimates.log" "$out/$name.$run/estimates.log" || verdict="$run DIFFERS"
  done
  cmp -s "$out/$name.memory/estimates.log" "$out/$name.vcan/estimates.log" || verdict="vcan DIFFERS from memory"
  moves=$(awk -F, 'NR > 1 && $5 != "" { if (!($3 in x)) { x[$3] = $5; y[$3] = $6 } d = ($5 - x[$3]) ^ 2 + ($6 - y[$3]) ^ 2; if (d > m) m = d } END { printf "%.2f", sqrt(m) }' \
    "$out/$name.g++1/estimates.csv")
  epochs=$(number g++1 epochs)
  awk -v m="$moves" -v e="$epochs" 'BEGIN { exit !(m > 0.3 && e > 1000) }' || verdict="$verdict, but it does not move or is too short"
  printf '  %-10s %7d epochs, moves %8s m, x real time: memory %s, vcan %s: %s\n' "$name" "$epochs" "$moves" "$(number g++1 times_realtime)" \
    "$(number vcan times_realtime)" "$verdict"
  [ "$verdict" = equal ] || failed=1
done
exit $failed
