#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# Bad input to every program and tool at the command line: a status that is not 0, and exactly one line on standard error that says
# where and what. The bus that is missing or down is tried on a private vcan.
set -u
. "$(dirname "$0")/../../tools/run/node_session.sh"
cd "$root" || exit 2
self=test/replay/bad_input_test.sh
work=${BAD_INPUT_WORK:-}
unset BUS  # as a user who has set none
failed=0 count=0

# refused NAME PATTERN COMMAND...: the one line has to match the pattern (extended regular expression).
refused() {
  local name=$1 pattern=$2 status lines
  shift 2
  "$@" >"$work/stdout" 2>"$work/stderr" </dev/null
  status=$?
  lines=$(grep -cv '^provide_vcan: ' "$work/stderr")
  count=$((count + 1))
  if [ $status = 0 ] || [ $status -ge 124 ]; then
    echo "WRONG  $name: status $status"
  elif [ "$lines" != 1 ]; then
    echo "WRONG  $name: $lines lines on standard error"
  elif ! grep -qE -- "$pattern" "$work/stderr"; then
    echo "WRONG  $name: the line does not say '$pattern'"
  else
    return 0
  fi
  sed 's/^/         /' "$work/stderr" | head -5
  failed=$((failed + 1))
}

log_with() { printf '%s\n' "(1.000000) vcan0 308#0000000000000000" "(1.010000) vcan0 308#0000000000000000" "$@" >"$work/bad.log"; }

on_the_bus() { # inside a private vcan0
  local node
  refused "a node on a bus that is not there" 'tetap-node: CAN interface nocan0 does not exist' "$programs/tetap-node" --can nocan0
  refused "a player on a bus that is not there" 'tetap-play: CAN interface nocan0 does not exist' "$programs/tetap-play" "$work/good.log" --can nocan0
  ip link set vcan0 down
  refused "a node on a bus that is down" 'tetap-node: CAN interface vcan0 is down' "$programs/tetap-node"
  refused "a player on a bus that is down" 'tetap-play: CAN interface vcan0 is down' "$programs/tetap-play" "$work/good.log" --out "$work/out"
  refused "a world on a bus that is down" 'tetap-world: CAN interface vcan0 is down' "$programs/tetap-world" --can vcan0 --duration 1 --out "$work/out"
  refused "a recorder on a bus that is down" 'tetap-record: CAN interface vcan0 is down' "$programs/tetap-record" --out "$work/out"
  [ ! -e build/r5/hal/board/tetap-zynqmp_r5-rover.elf ] ||
    refused "an image in QEMU on a bus that is down" 'emulate_r5: vcan0: .*down' tools/run/emulate_r5 build/r5/hal/board/tetap-zynqmp_r5-rover.elf --can vcan0
  ip link set vcan0 up
  # A node whose bus goes away and comes back keeps its service.
  "$programs/tetap-node" 2>"$work/node" & node=$!
  sleep 0.3
  ip link set vcan0 down; sleep 0.3; ip link set vcan0 up; sleep 0.3
  count=$((count + 1))
  if ! "$programs/tetap-play" "$work/good.log" --out "$work/out" --quiet 2>"$work/stderr"; then
    echo "WRONG  a node whose bus was down for a moment does not answer afterwards"; cat "$work/node" "$work/stderr"; failed=$((failed + 1))
  fi
  kill $node; wait $node
  # A node that ends is noticed before the player ends, and what it said is shown.
  refused "a node that ends at once" 'node ended .status 2.: emulate_r5: .*nowhere.elf: no such file' timeout 120 env TETAP_IMAGE="$work/nowhere.elf" \
    LOG="$work/good.log" ROBOT=rover BOARD=zynqmp_r5 OUT="$work/out" PLAY=--quiet tools/run/replay_log --inside
  refused "a node that ends at once (sim)" 'node ended .status 2.: emulate_r5: .*nowhere.elf: no such file' timeout 120 env TETAP_IMAGE="$work/nowhere.elf" \
    ROBOT=rover BOARD=zynqmp_r5 OUT="$work/out" WORLD=--quiet tools/run/simulate_world --inside
  # What is wrong with a log is no fault of the node, and the line it began with is no part of it.
  log_with rubbish
  refused "a broken log to a node on the bus" "tetap-play: .*bad.log:3: .*'rubbish'" env LOG="$work/bad.log" ROBOT=mrclam BOARD=linux OUT="$work/out" tools/run/replay_log --inside
}

if [ "${1:-}" = --inside ]; then
  on_the_bus
  echo "$count $failed" >"$work/inside"
  exit 0
fi

work=$(mktemp -d "${TMPDIR:-/tmp}/tetap-bad.XXXXXX") || exit 2
trap 'rm -rf "$work"' EXIT
export BAD_INPUT_WORK=$work
play() { "$programs/tetap-play" "$work/bad.log" --memory --robot mrclam --out "$work/out" --quiet "$@"; }
log_with; cp "$work/bad.log" "$work/good.log"

# Logs
log_with "(1.020000) vcan0 308#00000000000000"; "$programs/tetap-play" "$work/bad.log" --memory --robot mrclam --out "$work/out" --quiet 2>"$work/stderr" &&
  grep -q 'bad.log:3: an input frame that has not 8 bytes' "$work/stderr" || {
  echo "WRONG  a frame that is too short is the node's to count, with a warning"; failed=$((failed + 1)); }
log_with "(1.020000) vcan0 308#0"; refused "half a byte" 'bad.log:3: an odd number of data digits' play
log_with "(1.020000) vcan0 308#000000000000000000"; refused "nine bytes" 'bad.log:3: more than 8 data bytes' play
log_with "" "(1.02) vcan0"; refused "a truncated line" 'bad.log:4: no space after the interface' play
log_with "(abc) vcan0 308#00"; refused "no time" 'bad.log:3: the time is not' play
log_with "(1.020000) vcan0 FFF#00"; refused "an id beyond 11 bits" 'bad.log:3: a 3-digit id' play
log_with $'\x01\x02\xff'; refused "bytes that are no text" "bad.log:3: .*'\?\?\?'" play
: >"$work/bad.log"; refused "an empty log" 'bad.log: no CAN data frame' play
echo "(1.000000) vcan0 123#00" >"$work/bad.log"; refused "a log without the node's inputs" 'bad.log: no input frames' play
"$programs/tetap-world" --memory --quiet --raw --duration 2 --robot rover_landmarks --out "$work/recorded" >"$work/stdout" || failed=$((failed + 1))
refused "a record of a node with other numbers" 'the recorded node was another robot or ran with other numbers .Est_Version.Config.: .* differ.*; --lockstep plays' \
  "$programs/tetap-play" "$work/recorded/raw.log" --memory --robot rover_landmarks_matched --out "$work/out" --quiet
log_with; refused "a log that is no record" 'bad.log: cannot be repeated' play --as-recorded
printf '(1.0) vcan0 308#0000000000000000\n(1.01) vcan0 308#00000000' >"$work/bad.log"
play 2>"$work/stderr" && grep -q 'bad.log:2: the last line is cut off and left out' "$work/stderr" || {
  echo "WRONG  a last line that is cut off is left out and named"; failed=$((failed + 1)); }
refused "no such log" 'nowhere.log: cannot be read: No such file' "$programs/tetap-play" "$work/nowhere.log" --memory --robot mrclam
refused "no such log (over a bus that is none)" 'nowhere.log: cannot be read: No such file' "$programs/tetap-play" "$work/nowhere.log" --can nobus0
doctor() { "$programs/tetap-doctor" "$work/bad.log" --robot rover "$@"; }
log_with rubbish; refused "a broken log (doctor)" "tetap-doctor: .*bad.log:3: .*'rubbish'" doctor
: >"$work/bad.log"; refused "an empty log (doctor)" 'tetap-doctor: .*bad.log: no CAN data frame' doctor
echo "(1.000000) vcan0 123#00" >"$work/bad.log"; refused "a log without the node's inputs (doctor)" 'tetap-doctor: .*bad.log: no input frames' doctor
log_with
refused "no such log (doctor)" 'tetap-doctor: .*nowhere.log: cannot be read: No such file' "$programs/tetap-doctor" "$work/nowhere.log"
refused "no log (doctor)" 'tetap-doctor: no LOG given' "$programs/tetap-doctor" --robot rover
refused "a robot that does not exist (doctor)" "tetap-doctor: no robot 'tank'" "$programs/tetap-doctor" "$work/good.log" --robot tank
refused "parameters of no robot (doctor)" 'tetap-doctor: --params and --set need --robot' "$programs/tetap-doctor" "$work/good.log" --set gnss.sigma_scale=2
refused "no log (make doctor)" 'doctor: which log' env LOG= tools/run/diagnose_log
refused "a log that is not there (make doctor)" 'doctor: nowhere.log: no such file' env LOG=nowhere.log tools/run/diagnose_log rover
refused "a folder for a log" 'cannot be read: Is a directory' "$programs/tetap-play" "$work" --memory --robot mrclam
refused "an output folder that cannot be" "$work/good.log/x" "$programs/tetap-play" "$work/good.log" --memory --robot mrclam --out "$work/good.log/x" --quiet

# Command lines
robots='there are: all_round car .*mrclam .*rover .*rover_matched'
refused "a robot that does not exist (player)" "no robot 'tank'; $robots" "$programs/tetap-play" "$work/good.log" --memory --robot tank
refused "a robot that does not exist (node)" "no robot 'tank'; $robots" "$programs/tetap-node" --robot tank
refused "a robot that does not exist (player, over a bus)" "no robot 'tank'; $robots" "$programs/tetap-play" "$work/good.log" --robot tank
refused "a robot that does not exist (world, over a bus)" "no robot 'tank'; $robots" "$programs/tetap-world" --robot tank --out "$work/out"
refused "a robot that does not exist (world)" "no robot 'tank'; $robots" "$programs/tetap-world" --memory --robot tank --out "$work/out"
for program in play node world record doctor inject; do
  refused "an unknown option (tetap-$program)" "tetap-$program: .*--frobnicate" "$programs/tetap-$program" --frobnicate
done
refused "an option without its value" '--robot' "$programs/tetap-play" "$work/good.log" --memory --robot
refused "a number that is none" '--period' play --period soon
refused "jitter in lockstep" '--realtime' play --jitter-ms 5
refused "an id base off its grid (node)" "tetap-node: --base .*'0x301'" "$programs/tetap-node" --base 0x301
refused "an id base off its grid (player)" "tetap-play: --base .*'0x301'" "$programs/tetap-play" "$work/good.log" --memory --robot mrclam --base 0x301
refused "a log's id base off its grid" "tetap-play: --log-base .*'0x301'" "$programs/tetap-play" "$work/good.log" --memory --robot mrclam --log-base 0x301
refused "an id base off its grid (world)" "tetap-world: --base .*'0x301'" "$programs/tetap-world" --memory --base 0x301 --out "$work/out"
refused "an id base off its grid (recorder)" "tetap-record: --base .*'0x301'" "$programs/tetap-record" --base 0x301
refused "a word that is no option (node)" 'tetap-node: .*vcan1' "$programs/tetap-node" vcan1
refused "a word that is no option (world)" 'tetap-world: .*vcan1' "$programs/tetap-world" --memory vcan1 --out "$work/out"
refused "a second log" 'tetap-play: .*vcan1' play vcan1
refused "an unknown fault" "fault.*'?meteor" "$programs/tetap-world" --memory --fault meteor --out "$work/out"
number() {  # OPTION VALUE...: each is refused with the option and the value named
  local option=$1 value
  shift
  for value in "$@"; do
    refused "$option $value (world)" "tetap-world: $option needs .*'$value'" "$programs/tetap-world" --memory --quiet --out "$work/out" "$option" "$value"
  done
}
number --seed x -1 nan 1e30 1.7 ''
number --duration soon nan inf -5 0 1e30
number --window 0 -3 129 1e9
number --laps 0 1.5 1e30
number --imu-hz 0 nan
number --gnss-hz 0 5.5
number --gnss-m 0 nan
number --east nan 60001
# Every robot that there is stands in every program's help.
every_robot=$({ tools/run/list_robots | tr ' ' '\n'; grep -oE '"[a-z_]+_matched"' sim_host/robots.cpp | tr -d '"'; } | sort | xargs)
listed=$("$programs/tetap-node" --list-robots | tr ' ' '\n' | sort | xargs)
[ "$listed" = "$every_robot" ] && [ "$(wc -w <<<"$listed")" -ge 10 ] || { echo "WRONG  tetap-node lists '$listed', there are '$every_robot'"; failed=$((failed + 1)); }
for robot in $every_robot; do
  "$programs/tetap-node" --boot-line --robot "$robot" >"$work/stdout" || { echo "WRONG  tetap-node does not know $robot"; failed=$((failed + 1)); }
done
for robot in $every_robot; do
  for program in node play world; do
    count=$((count + 1))
    "$programs/tetap-$program" --help | grep -qwF -- "$robot" || { echo "WRONG  tetap-$program --help does not name $robot"; failed=$((failed + 1)); }
  done
done

for robot in $every_robot; do
  count=$((count + 1))
  make --no-print-directory help | grep -E '^  (robots|and in simulation)' | grep -qwF -- "$robot" || { echo "WRONG  make help does not name $robot"; failed=$((failed + 1)); }
done

# Tools
refused "replay without a log" 'replay: which log' env -u LOG tools/run/replay_log
refused "replay of no such log" 'replay: nowhere.log: no such file' env LOG=nowhere.log tools/run/replay_log
refused "replay of a folder" "replay: $work: a folder, not a log" timeout 120 env LOG="$work" tools/run/replay_log
refused "a folder for a log (make doctor)" "doctor: $work: a folder, not a log" env LOG="$work" tools/run/diagnose_log
refused "replay against no such truth" 'replay: nowhere.csv: no such file' env LOG="$work/good.log" TRUTH=nowhere.csv tools/run/replay_log
refused "replay on a bus of another kind" "replay: BUS=lin" env LOG="$work/good.log" BUS=lin tools/run/replay_log
refused "replay of a board in memory" 'BUS=memory' env LOG="$work/good.log" BUS=memory BOARD=zynqmp_r5 tools/run/replay_log
refused "replay for no such robot" "no robot 'tank'" env LOG="$work/good.log" BUS=memory ROBOT=tank OUT="$work/out" tools/run/replay_log
refused "replay for no such robot over a bus" "no robot 'tank'; $robots" timeout 120 env BUS=vcan LOG="$work/good.log" ROBOT=tank OUT="$work/out" tools/run/replay_log
refused "sim for no such robot over a bus" "no robot 'tank'; $robots" timeout 120 env BUS=vcan ROBOT=tank OUT="$work/out" tools/run/simulate_world
refused "sim for no such robot on a board" "no robot 'tank'; $robots" timeout 120 env ROBOT=tank BOARD=zynqmp_r5 OUT="$work/out" tools/run/simulate_world
refused "a misspelt setting" 'no setting FALUT; there are: ROBOT .*FAULT' make -s FALUT=gnss_jump help
refused "sim from seed -1" "--seed .*'-1'" env BUS=memory SEED=-1 OUT="$work/out" tools/run/simulate_world
# An image is built before it is started: a cmake that only notes what it is asked for, and fails.
mkdir "$work/bin"
printf '#!/bin/sh\necho "$@" >>"%s/asked"\n[ "$1" != --build ]\n' "$work" >"$work/bin/cmake"
chmod +x "$work/bin/cmake"
for program in replay_log simulate_world; do
  tool=${program%%_*} tool=${tool/simulate/sim}
  refused "$tool of a robot without an image" "no image of robot 'rover_matched'; there are: .*husky_inertial" \
    timeout 120 env LOG="$work/good.log" ROBOT=rover_matched BOARD=zynqmp_r5 OUT="$work/out" tools/run/$program
  : >"$work/asked"
  refused "$tool of an image that cannot be built" 'build: preset r5 failed' \
    timeout 120 env PATH="$work/bin:$PATH" LOG="$work/good.log" ROBOT=husky BOARD=zynqmp_r5 OUT="$work/out" tools/run/$program
  grep -qE -- '^--build build/r5 (-j [0-9]+ )?--target tetap-zynqmp_r5-husky( -j [0-9]+)?$' "$work/asked" || { echo "WRONG  $tool does not build the image it is to run"; failed=$((failed + 1)); }
done
refused "replay on no such board" "no board 'arduino'" env LOG="$work/good.log" BOARD=arduino OUT="$work/out" tools/run/replay_log
refused "sim on no such board" "no board 'arduino'" env BOARD=arduino OUT="$work/out" tools/run/simulate_world
for board in ark_cannode nucleo_g474re; do
  refused "sim on $board" "no board '$board' here; .*: make board BOARD=$board$" timeout 120 env BOARD=$board OUT="$work/out" tools/run/simulate_world
  refused "replay on $board" "no board '$board' here; .*: make board BOARD=$board$" timeout 120 env LOG="$work/good.log" BOARD=$board OUT="$work/out" tools/run/replay_log
done
refused "sim at a pace that is not 1" 'sim: REALTIME=0: it is 1 or empty' env BUS=memory REALTIME=0 OUT="$work/out" WORLD="--duration 1" tools/run/simulate_world
refused "sim with an unknown fault" 'meteor' env BUS=memory FAULT=meteor OUT="$work/out" tools/run/simulate_world
refused "sim with a fault whose start is no number" "fault 'gnss_jump@soon': START is not" env BUS=memory FAULT=gnss_jump@soon OUT="$work/out" tools/run/simulate_world
refused "sim with an unknown fault over a bus" "fault 'meteor'" timeout 120 env BUS=vcan FAULT=meteor OUT="$work/out" tools/run/simulate_world
refused "sim with a fault of a sensor it has not" "fault 'mag_disturbance': robot rover has no magnetometer; faults that act on it: gnss_jump .*; robots on which it acts: iris" \
  timeout 120 env FAULT=gnss_jump,mag_disturbance OUT="$work/out" tools/run/simulate_world
refused "sim with a fault of landmarks it has not" "fault 'landmark_outlier': robot iris has no landmarks; .* mag_disturbance.*; in this world it acts on none" \
  timeout 120 env ROBOT=iris FAULT=landmark_outlier@20+5 OUT="$work/out" tools/run/simulate_world
refused "a world with a fault of wheels it has not" "fault 'wheel_spin': robot rover has no wheels" \
  "$programs/tetap-world" --memory --no-wheels --fault wheel_spin --out "$work/out"
refused "firmware for no such board" "no board 'arduino'; there are: zynqmp_r5" env BOARD=arduino tools/run/build_firmware
refused "firmware for no such robot" "no image of robot 'tank'; there are: .*mrclam" env BOARD=zynqmp_r5 ROBOT=tank tools/run/build_firmware
# An image that is over its budget, or allocates, is no firmware: in a tree whose tools say yes, but for one.
mkdir -p "$work/tree/config"
cp -r tools CMakePresets.json "$work/tree" && cp -r config/*.hpp config/parameters "$work/tree/config"
for tool in proof/check_{heap,layers,size,stack}; do
  for one in run/build_preset proof/check_{heap,layers,size,stack}; do printf '#!/bin/sh\n' >"$work/tree/tools/$one"; done
  printf '#!/bin/sh\ncase $* in *tetap-zynqmp_r5-husky.elf*) echo "$0: no" >&2; exit 1 ;; esac\n' >"$work/tree/tools/$tool"
  mkdir -p "$work/tree/build/r5/hal/board"
  touch "$work/tree/build/r5/hal/board/tetap-zynqmp_r5-husky".{elf,bin,hex,map}
  refused "firmware that fails its proof ($tool)" "tools/$tool: no" env BOARD=zynqmp_r5 ROBOT=husky "$work/tree/tools/run/build_firmware"
done
refused "a report on nothing" 'nowhere' tools/report/write_report "$work/nowhere"
"$programs/tetap-play" "$work/good.log" --memory --robot mrclam --out "$work/run" --quiet || failed=$((failed + 1))
refused "a report against no such truth" 'nowhere.csv' tools/report/write_report "$work/run" --truth "$work/nowhere.csv" --no-pictures
printf 'time_s,x_m\n1,2\n' >"$work/bad.csv"
refused "a report against a truth without its columns" 'bad.csv' tools/report/write_report "$work/run" --truth "$work/bad.csv" --no-pictures
refused "no such DBC" 'nowhere.dbc' tools/can/generate_messages "$work/nowhere.dbc" --load
sed 's/^ SG_ SetYaw_StdPos : 29|/ SG_ SetYaw_StdPos : 20|/' config/tetap.dbc >"$work/overlap.dbc"
refused "a DBC with overlapping signals" 'overlap.dbc:[0-9]+: .*SetYaw' tools/can/generate_messages "$work/overlap.dbc" --load
refused "a recorded set that is not there (mrclam)" 'nowhere' tools/dataset/import_mrclam "$work/nowhere" 1 "$work/m"
refused "a recorded set that is not there (husky)" 'nowhere' tools/dataset/import_husky "$work/nowhere" "$work/m"
refused "a recorded set that is not there (labyrinth)" 'nowhere' tools/dataset/import_labyrinth "$work/nowhere" "$work/m"
log_with "(1.0) vcan0 3"; refused "decode of a malformed line" ':3: ' bash -c 'tools/can/decode_log <"$0"' "$work/bad.log"
refused "no such preset" "no preset 'nothing'; there are: .*host" tools/run/build_preset nothing
refused "no such image" 'nowhere.elf: no such file' tools/run/emulate_r5 "$work/nowhere.elf"
refused "qemu on a bus that is not there" 'nocan0: no such interface' tools/run/emulate_r5 "$programs/tetap-node" --can nocan0
refused "run which checks?" "no form 'everything'; there are: test proof" tools/proof/run_checks everything

tools/run/provide_vcan --private -q -t 120 $self --inside
read -r bus_count bus_failed <"$work/inside" || { echo "WRONG  the part on the bus did not come to its end"; exit 1; }
echo "$((count + bus_count)) kinds of bad input, $((failed + bus_failed)) not refused as they should be"
[ $((failed + bus_failed)) = 0 ]
