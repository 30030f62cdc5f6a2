# SPDX-License-Identifier: Apache-2.0
# What sim, replay and the proofs share: where the programs are, a node on an interface, its end. To be sourced; needs bash.
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
programs=${TETAP_PROGRAMS:-$root/build/host/sim_host}
node='' player=''

# What $PARAMS (a file) and $SET (path=value words) set over the robot's compiled parameters, as options of the host programs.
settings=(${PARAMS:+--params "$PARAMS"})
for setting in ${SET:-}; do settings+=(--set "$setting"); done
# settings_known BOARD: an image has its parameters compiled in.
settings_known() {
  [ "$1" = linux ] || [ ${#settings[@]} = 0 ] ||
    { echo "PARAMS= and SET= are for the host's programs; an image on $1 has the parameters of config/ROBOT.hpp" >&2; return 2; }
}

# board_known BOARD: so that a wrong name is said before anything boots.
board_known() {
  case $1 in
    linux | zynqmp_r5) ;;
    ark_cannode | nucleo_g474re) echo "no board '$1' here; there are: linux zynqmp_r5; the simulated world on its emulated chip: make board BOARD=$1" >&2; return 2 ;;
    *) echo "no board '$1'; there are: linux zynqmp_r5" >&2; return 2 ;;
  esac
}

# preset_of BOARD: the preset of CMakePresets.json whose TETAP_BOARD names that board.
preset_of() { /usr/bin/python3 -B "$root/tools/python/tetap/presets.py" "$root" "$1"; }

one_of() { local name=$1 one; shift; for one; do [ "$one" != "$name" ] || return 0; done; return 1; }
# robot_known ROBOT: to the programs; image_known ROBOT: there is a flash image of it.
robot_known() {
  local robots
  robots=$("$programs/tetap-node" --list-robots) || return 2
  # shellcheck disable=SC2086  # words
  one_of "$1" $robots || { echo "no robot '$1'; there are: $robots" >&2; return 2; }
}
image_known() {
  local robots
  robots=$("$root/tools/run/list_robots" | tr ' ' '\n' | grep -vx graph | xargs)  # graph: of the host alone (hal/board/CMakeLists.txt)
  # shellcheck disable=SC2086
  one_of "$1" $robots || { echo "no image of robot '$1'; there are: $robots" >&2; return 2; }
}

# node_ready BOARD ROBOT: what is wrong with the names is said before anything boots, and the image that will boot is built.
node_ready() {
  board_known "$1" && robot_known "$2" || return 2
  [ "$1" != linux ] && [ -z "${TETAP_IMAGE:-}" ] || return 0
  image_known "$2" && "$root/tools/run/build_preset" "r5:tetap-$1-$2"
}

# node_start BOARD ROBOT IFACE [BASE]: starts a node; its process id is in $node, what it prints in $node_log.
node_start() {
  local board=$1 robot=$2 iface=$3 base=${4:-}
  board_known "$board" || return 2
  node_log=$(mktemp "${TMPDIR:-/tmp}/tetap-node.XXXXXX")
  case $board in
    linux) "$programs/tetap-node" --can "$iface" --robot "$robot" ${base:+--base "$base"} "${settings[@]}" >"$node_log" 2>&1 & ;;
    zynqmp_r5)
      local image=${TETAP_IMAGE:-$root/build/r5/hal/board/tetap-zynqmp_r5-$robot.elf}
      "$root/tools/run/emulate_r5" "$image" --can "$iface" >"$node_log" 2>&1 & ;;
  esac
  node=$!
}

# player_options BOARD: how a player has to treat a node on that board. An emulated controller has 64 receive buffers and no time of its own.
player_options() { [ "$1" = linux ] || echo "--window 1 --emulated"; }


# node_said: what it printed, without the line that says what runs.
node_said() { grep -vE '^(emulate_r5: running |tetap-node: robot [A-Za-z0-9_]+ on )' "$node_log"; }

# with_node COMMAND...: a player's run and its status; when the node ends first, so does the player, and what the node said is the error.
with_node() {
  local status ended said
  [ -n "${node:-}" ] || return 1
  "$@" &
  player=$!
  wait -n -p ended "$node" "$player"
  status=$?
  [ "$ended" = "$node" ] || { player=; return $status; }
  said=$(node_said)
  node_stop 0
  sed "s/^/node ended (status $status): /" <<<"${said:-it said nothing}" >&2
  return 1
}

node_stop() {
  [ -n "${node:-}" ] || return 0
  kill -TERM "$node" ${player:+"$player"} 2>/dev/null
  wait "$node" ${player:+"$player"} 2>/dev/null
  player=
  [ "${1:-0}" = 0 ] || node_said | sed 's/^/node: /' >&2
  rm -f "$node_log"
  node=
}

# likeliest_cause LOG DIR: a mistake that the log's own devices show, in a few lines and in DIR/doctor.json; nothing where they agree.
likeliest_cause() {
  [ -x "$programs/tetap-doctor" ] || return 0
  "$programs/tetap-doctor" "$1" --robot "$ROBOT" "${settings[@]}" --keep-going --brief --json "$2/doctor.json" 2>/dev/null || true
}

# files_are_in DIR: the last line of a run.
files_are_in() { echo "files: $1 (the next run to there overwrites them; OUT=DIR: another place)"; }
