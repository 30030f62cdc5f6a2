#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# two_nodes.sh: two nodes with id bases of their own on one bus, the same world to both: the same bytes but for the ids.
set -u
. "$(dirname "$0")/../../tools/run/node_session.sh"
cd "$root" || exit 2
if [ "${1:-}" = --inside ]; then
  "$programs/tetap-node" --can vcan0 --robot rover --base 0x340 & other=$!
  "$programs/tetap-node" --can vcan0 --robot rover --base 0x300 & one=$!
  "$programs/tetap-world" --can vcan0 --base 0x340 --duration 10 --quiet --out out/prove/two340 & first=$!
  "$programs/tetap-world" --can vcan0 --base 0x300 --duration 10 --quiet --out out/prove/two300; a=$?
  wait $first; b=$?
  kill $one $other
  [ $a = 0 ] && [ $b = 0 ]
  exit
fi
tools/run/provide_vcan --private -t 300 "$0" --inside || exit 1
cmp <(cut -d'#' -f2 out/prove/two300/estimates.log) <(cut -d'#' -f2 out/prove/two340/estimates.log)
