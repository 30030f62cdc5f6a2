# SPDX-License-Identifier: Apache-2.0
# What sim, replay and the proofs share: where the programs are, a node on an interface, its end. To be sourced; needs bash.
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
programs=${TETAP_PROGRAMS:-$root/build/host/sim_host}

# board_known BOARD: so that a wrong name is said before anything boots.
board_known() {
  case $1 in
    linux | zynqmp_r5) ;;
    *) echo "no board '$1'; there are: linux zynqmp_r5" >&2; return 2 ;;
  esac
}

# node_start BOARD ROBOT IFACE [BASE]: starts a node and waits until it can hear; its process id is in $node, what it prints in $node_log.
node_start() {
  local board=$1 robot=$2 iface=$3 base=${4:-0x300}
  board_known "$board" || return 2
  node_log=$(mktemp "${TMPDIR:-/tmp}/tetap-node.XXXXXX")
  case $board in
    linux) "$programs/tetap-node" --can "$iface" --robot "$robot" --base "$base" >"$node_log" 2>&1 & ;;
    zynqmp_r5)
      local image=${TETAP_IMAGE:-$root/build/r5/hal/port/tetap-zynqmp_r5-$robot.elf}
      "$root/tools/qemu-r5" "$image" --can "$iface" >"$node_log" 2>&1 & ;;
  esac
  node=$!
}

# player_options BOARD: how a player has to treat a node on that board. An emulated controller has 64 receive buffers and no time of its own.
player_options() { [ "$1" = linux ] || echo "--window 1 --emulated"; }

node_stop() {
  [ -n "${node:-}" ] || return 0
  kill -TERM "$node" 2>/dev/null
  wait "$node" 2>/dev/null
  [ "${1:-0}" = 0 ] || sed 's/^/node: /' "$node_log" >&2
  rm -f "$node_log"
  node=
}
