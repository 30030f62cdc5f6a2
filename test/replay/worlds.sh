#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# worlds.sh SEEDS SECONDS: the simulated world from many seeds, and once with every fault it knows, by the g++ and the clang++ program in
# memory: the same bytes, no frame lost, and neither two seeds nor any fault give the bytes of another. No robot sends more than 600 frames/s.
set -u
. "$(dirname "$0")/../../tools/run/node_session.sh"
cd "$root" || exit 2
seeds=$1 seconds=$2
out=out/worlds
rm -rf "$out"; mkdir -p "$out"
failed=0
compilers="host clang"
run() { # NAME OPTION...
  local name=$1 compiler folder lost
  shift
  for compiler in $compilers; do
    folder="$out/$name.$compiler"
    "build/$compiler/sim_host/tetap-world" --memory --quiet --out "$folder" "$@" >/dev/null || { echo "  $name ($compiler) failed"; failed=1; return; }
    lost=$(grep -o '"frames_lost": [0-9]*' "$folder/run.json" | cut -d' ' -f2)
    [ "$lost" = 0 ] || { echo "  $name ($compiler): $lost frames lost"; failed=1; }
  done
  [ "$compilers" = host ] || cmp -s "$out/$name.host/estimates.log" "$out/$name.clang/estimates.log" || { echo "  $name: g++ and clang++ DIFFER"; failed=1; }
  sha256sum <"$out/$name.host/estimates.log" >>"$out/hashes"
  rm -rf "$out/$name.clang"
}
for seed in $(seq 1 "$seeds"); do run "seed$seed" --seed "$seed" --duration "$seconds"; done
faults=$("$programs/tetap-world" --help | sed -n 's/^  \([a-z_]*\) *@[0-9].*/\1/p')
[ "$(wc -w <<<"$faults")" -ge 15 ] || { echo "  tetap-world --help lists fewer than 15 faults"; failed=1; }
robots="rover rover_landmarks iris scanner visual"
declare -A acts
for robot in $robots; do acts[$robot]=$("$programs/tetap-world" --robot "$robot" --list-faults | tr "\n" " "); done
for fault in $faults; do
  robot=
  for one in $robots; do  # the first that has the sensor it falls on
    case " ${acts[$one]} " in *" $fault "*) robot=$one; break ;; esac
  done
  [ -n "$robot" ] || { echo "  $fault acts on none of $robots"; failed=1; continue; }
  # Robots with scanner or camera are compiled by g++ alone; clang++'s nodes of theirs are in `bits`.
  case $robot in scanner|visual) compilers=host ;; *) compilers="host clang" ;; esac
  at=10
  [ "$fault" = gnss_outage ] && at=10+5  # shorter than the outage that gnss_far begins with
  run "$fault" --robot $robot --seed 1 --duration "$seconds" --fault "$fault@$at"
done
for robot in $("$programs/tetap-node" --list-robots | tr " " "\n" | grep -v _matched); do  # those are for judging, not for a bus
  "$programs/tetap-world" --memory --quiet --raw --duration 10 --robot "$robot" --out "$out/load" >/dev/null || { echo "  $robot failed"; failed=1; continue; }
  sent=$(grep -cE ' 3[23][0-9A-F]#' "$out/load/raw.log")
  [ "$sent" -gt 1000 ] && [ "$sent" -le 6000 ] || { echo "  robot $robot sends $sent frames in 10 s: 1000 to 6000 are allowed"; failed=1; }
done
runs=$(wc -l <"$out/hashes")
distinct=$(sort -u "$out/hashes" | wc -l)
echo "  $runs worlds of $seconds s: $seeds seeds, $(wc -w <<<"$faults") faults; $distinct different records"
[ "$distinct" = "$runs" ] || { echo "  two of them are the same"; failed=1; }
exit $failed
