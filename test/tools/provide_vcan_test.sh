#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# Tests all three ways of tools/run/provide_vcan. The first two (an interface that is up, a network namespace) are tried inside the
# third, user-mode-linux, so that the test is the same whatever kernel it runs on. About 25 s.
# shellcheck disable=SC2016,SC2317 # commands for another shell; functions called by name
set -u
self=$(readlink -f "$0")
with_vcan=$(dirname "$self")/../../tools/run/provide_vcan
with_vcan=$(readlink -f "$with_vcan")

expect() { # NAME EXPECTED ACTUAL
  if [ "$2" = "$3" ]; then
    echo "ok      $1"
    echo passed >>"$work/results"
  else
    echo "FAILED  $1: expected '$2', got '$3'"
    echo failed >>"$work/results"
  fi
}

until_true() { # at most 10 s
  for _ in {1..100}; do
    "$@" && return 0
    sleep 0.1
  done
  return 1
}

listening() { grep -qE '^ +vcan0 ' /proc/net/can/rcvlist_all 2>/dev/null; } # not "(vcan0: no entry)"

# Sends a frame on vcan0 with one program and prints it as another one saw it.
see_frame() { # FRAME; again when the reader was not ready in time, as on a busy machine
  for _ in 1 2 3 4 5; do
    candump -L -n 1 -T 2000 vcan0 >"$work/seen.$$" &
    local reader=$!
    until_true listening
    sleep 0.1
    cansend vcan0 "$1"
    wait $reader
    [ -s "$work/seen.$$" ] && break
  done
  cut -d' ' -f2- "$work/seen.$$"
}

status_of() { "$@" >/dev/null 2>&1; echo $?; }

message_of() { # status, number of lines on standard error, and their text
  local status
  "$@" >/dev/null 2>"$work/message"
  status=$?
  echo "$status $(wc -l <"$work/message") $(cat "$work/message")"
}

arguments=('a b' "it's \"quoted\"" '' '*' '$HOME \ `x`' $'two\nlines')

# What holds for every way: exit status, arguments, environment, directory, output. $@ = the command up to COMMAND.
transparent() { # NAME WAY WITH-VCAN-ARGUMENT...
  local name=$1 way=$2
  shift 2
  expect "$name: a frame that is sent is seen" "vcan0 1A1#CAFE" "$("$@" "$self" --see 1A1#CAFE)"
  expect "$name: status, arguments, environment and directory pass through" \
    "$(printf '<%s>' "${arguments[@]}") two words $way / 7" \
    "$(cd / && WORDS='two words' "$@" bash -c 'printf "<%s>" "$@"; echo -n " $WORDS $WITH_VCAN $PWD"; exit 7' x "${arguments[@]}"
      echo " $?")"
  expect "$name: killed by signal 9 is status 137" 137 "$(status_of "$@" bash -c 'kill -9 $$')"
  expect "$name: over the time limit is status 124" 124 "$(status_of "$@" -t 0.5 sleep 20)"
  expect "$name: 5 MB of output arrive intact" "$(sha256sum <"$work/5MB")" "$("$@" cat "$work/5MB" | sha256sum)"
}

as_nobody() { setpriv --reuid=65534 --regid=65534 --clear-groups "$@"; }

inside() { # runs in user-mode-linux, on a vcan0 of its own
  expect "uml: a frame that is sent is seen" "vcan0 1A0#CAFE" "$(see_frame 1A0#CAFE)"
  expect "uml: memory is reserved beyond what there is" 1 "$(cat /proc/sys/vm/overcommit_memory)"
  candump -L vcan0 >"$work/outside" &
  local outside=$!
  until_true listening

  export WITH_VCAN_SHARED=1
  transparent shared shared "$with_vcan" -q
  expect "shared: says so" "0 1 provide_vcan: using vcan0, up already" "$(message_of "$with_vcan" true)"
  expect "shared: an interface that is not there is one message and status 125" \
    "125 1 provide_vcan: cannot share: no vcan interface vcan7 is up" "$(message_of "$with_vcan" -i vcan7 --way shared true)"

  transparent namespace namespace "$with_vcan" -q --private
  expect "namespace: says so" "0 1 provide_vcan: private vcan0 in a network namespace" "$(message_of "$with_vcan" --private true)"
  expect "namespace: gives every interface asked for" "lo vcan0 vcan1 " \
    "$("$with_vcan" -q --private -i vcan0 -i vcan1 ls /sys/class/net | tr '\n' ' ')"
  expect "namespace: a user without rights has it too, and stays himself" "65534 vcan0 1A3#" \
    "$(as_nobody "$with_vcan" -q --private bash -c 'echo -n "$(id -u) "; exec "$0" --plain 1A3#' "$self")"
  expect "namespace: his /sys shows it, too" "lo vcan0 " \
    "$(as_nobody "$with_vcan" -q --private ls /sys/class/net | tr '\n' ' ')"
  echo 0 >/proc/sys/user/max_user_namespaces
  expect "namespace: refused is one message and status 125" \
    "125 1 provide_vcan: no private vcan in a namespace: no right to a network namespace" \
    "$(message_of as_nobody "$with_vcan" --way namespace true)"

  sleep 0.3
  kill "$outside"
  wait
  expect "private is private: only the shared frame was seen outside" "vcan0 1A1#CAFE" "$(cut -d' ' -f2- "$work/outside" | sort -u)"

  ip link del vcan0
  rmmod vcan
  expect "no vcan and no user-mode-linux is one message and status 125" \
    "125 1 provide_vcan: this kernel has no vcan, and user-mode-linux is not installed (apt-get install user-mode-linux)" \
    "$(WITH_VCAN_UML=/nowhere message_of "$with_vcan" true)"
  cat "$work/5MB" >&3
  exit 7
}

nothing_left() { # of user-mode-linux: neither directories nor processes
  [ -z "$(ls -A "$TMPDIR")" ] && ! grep -qsaF -f "$work/pattern" /proc/[0-9]*/cmdline
}

outside() {
  # A space in the directory must not matter
  work=$(mktemp -d "${TMPDIR:-/tmp}/with vcan.XXXXXX") || exit 1
  # shellcheck disable=SC2064 # the value of now
  trap "rm -rf '$work'" EXIT
  chmod 755 "$work"
  export work
  : >"$work/results"
  head -c 5000000 /dev/urandom >"$work/5MB"
  TMPDIR=$(mktemp -d /tmp/provide-vcan-test.XXXXXX)
  export TMPDIR
  # shellcheck disable=SC2064
  trap "rm -rf '$work' '$TMPDIR'" EXIT
  echo "$TMPDIR/" >"$work/pattern"
  local uml=("$with_vcan" --way uml) running status

  # One boot for most of it
  "${uml[@]}" "$self" --inside 2>"$work/report" >"$work/stdout"
  status=$?
  cat "$work/report"
  expect "uml: status passes through" 7 $status
  expect "uml: 5 MB of output arrive intact" "$(sha256sum <"$work/5MB")" "$(sha256sum <"$work/stdout")"
  g++ -std=c++20 -O1 -pthread "${self%/*}/vector_registers.cpp" -o "$work/vector_registers"
  "${uml[@]}" -q "$work/vector_registers"
  expect "uml: vector registers stay what they are" 0 $?
  expect "uml: says so" "provide_vcan: user-mode-linux (asked for)" "$(head -n 1 "$work/report")"
  expect "uml: arguments, environment and directory pass through, killed by signal 9 is status 137" \
    "$(printf '<%s>' "${arguments[@]}") two words uml / 137" \
    "$(cd / && WORDS='two words' "${uml[@]}" -q bash -c 'printf "<%s>" "$@"; echo -n " $WORDS $WITH_VCAN $PWD"; kill -9 $$' x \
      "${arguments[@]}"; echo " $?")"
  expect "uml: over the time limit is status 124" 124 "$(status_of "${uml[@]}" -t 0.5 sleep 20)"
  expect "uml: a reader that goes away ends the command" 141 \
    "$("${uml[@]}" -q yes | head -n 1 >"$work/y"; echo "${PIPESTATUS[0]}")"
  expect "uml: what the command leaves running ends with it" 5 \
    "$(status_of timeout 20 "${uml[@]}" bash -c 'sleep 100 & setsid sleep 100 & exit 5')"
  expect "uml: not installed is one message and status 125" \
    "125 1 provide_vcan: user-mode-linux is not installed (apt-get install user-mode-linux)" \
    "$(WITH_VCAN_UML=/nowhere message_of "${uml[@]}" true)"

  "${uml[@]}" -q bash -c 'trap "echo heard it; exit 9" TERM; : >"$work/up"; while :; do sleep 0.1; done' >"$work/heard" &
  running=$!
  until_true test -e "$work/up"
  kill -TERM $running
  wait $running
  expect "uml: TERM reaches the command, whose status still counts" "9 heard it" "$? $(cat "$work/heard")"

  "${uml[@]}" -q sleep 50 &
  running=$!
  sleep 0.2 # in the middle of the boot
  kill -TERM $running
  wait $running
  expect "uml: TERM during the boot is not lost" 143 $?
  expect "uml: nothing is left behind" yes "$(nothing_left && echo yes)"

  rm "$work/up"
  "${uml[@]}" -q bash -c ': >"$work/up"; sleep 50' &
  running=$!
  disown
  until_true test -e "$work/up"
  kill -KILL $running
  expect "uml: nothing is left behind after kill -9" yes "$(until_true nothing_left && echo yes)"

  local passed failed
  passed=$(grep -c passed "$work/results")
  failed=$(grep -c failed "$work/results")
  [ $((passed + failed)) -eq 34 ] || failed=$((failed + 1)) # a stage that broke off is a failure, too
  echo "$passed passed, $failed failed"
  [ "$failed" = 0 ]
}

case ${1:-} in
  --inside) exec 3>&1 1>&2 # stdout is for the 5 MB
    inside ;;
  --see) see_frame "$2" ;;
  --plain) # nobody may not write into the directory of the test
    candump -L -n 1 -T 5000 vcan0 | cut -d' ' -f2- &
    until_true listening
    cansend vcan0 "$2"
    wait ;;
  *) outside ;;
esac
