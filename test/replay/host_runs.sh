#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# host_runs.sh: what a folder of a run holds, whatever happens to the run: files of one run, each whole, and no summary of another one.
set -u
. "$(dirname "$0")/../../tools/run/node_session.sh"
cd "$root" || exit 2
work=$(mktemp -d "${TMPDIR:-/tmp}/tetap-runs.XXXXXX") || exit 2
trap 'rm -rf "$work"' EXIT
failed=0
wrong() { echo "WRONG  $*"; failed=$((failed + 1)); }
is() { [ "$2" = "$3" ] || wrong "$1: '$2' instead of '$3'"; }

world() { "$programs/tetap-world" --memory --quiet --robot rover "$@"; }
long_run() { exec "$programs/tetap-world" --memory --quiet --robot rover --realtime --duration 60 --raw --out "$work/run"; }
key() { sed -n "s/^  \"$1\": //p" "$work/$2/run.json" | sed 's/,$//' | tr -d '"'; }
sums() { (cd "$work/$1" && sha256sum -- *.csv *.log *.json | sort -k2); }
# The pid of a long run into $work/run that has written for a second.
begin() { (long_run) 2>"$work/stderr" & run=$!; sleep 1.5; }

world --duration 3 --raw --out "$work/run" >/dev/null || wrong "a run"
echo '{}' >"$work/run/summary.json"
before=$(sums run)

# A run that is killed leaves all of the one before it; what it wrote lies aside.
begin; kill -KILL $run; wait $run 2>/dev/null
is "a folder after a killed run" "$(sums run)" "$before"
[ -s "$work/run/raw.log.part" ] || [ -e "$work/run/raw.log.part" ] || wrong "a killed run leaves nothing of its own"

# Two runs into one folder: the second is refused, in one line, and a report as well.
begin
second=$(world --duration 1 --out "$work/run" 2>&1); status=$?
is "status of a second run into one folder" "$status" 2
is "what it prints" "$second" "tetap-world: $work/run: another run writes here; give this one another folder"
report=$(tools/report/write_report "$work/run" --no-pictures 2>&1) && wrong "a report of a folder in which a run writes"
case $report in *"a run writes here"*) ;; *) wrong "the report's refusal: $report" ;; esac
is "a folder while a run writes" "$(sums run)" "$before"

# TERM and INT finish the files, and the summary of the run before is gone.
for signal in TERM INT; do
  [ $signal = TERM ] || begin
  kill -s $signal $run; wait $run; status=$?
  is "status after $signal" "$status" $((128 + $(kill -l $signal)))
  is "parts after $signal" "$(find "$work/run" -name '*.part')" ""
  [ ! -e "$work/run/summary.json" ] || wrong "the old summary beside the data of a run that $signal ended"
  case $(key error run) in *"$signal"*epochs) ;; *) wrong "run.json after $signal: $(key error run)" ;; esac
  for file in estimates.csv status.csv; do
    columns=$(awk -F, 'NR == 1 { n = NF } NF != n { bad = 1 } END { print (bad ? "uneven" : NR > 5 ? "even" : "too few rows") }' "$work/run/$file")
    is "rows of $file after $signal" "$columns" even
    is "last byte of $file after $signal" "$(tail -c 1 "$work/run/$file" | od -An -c | tr -d ' ')" '\n'
  done
  is "epochs after $signal" "$(key epochs run)" "$(grep -c ' 321#' "$work/run/estimates.log")"
  [ -s "$work/run/truth.csv" ] || wrong "no truth after $signal"
  echo '{}' >"$work/run/summary.json"
done

report=$(tools/report/write_report "$work/run" --no-pictures 2>&1) && grep -q '"version"' "$work/run/summary.json" || wrong "the report of an ended run: $report"

# A player that stands still for longer than lockstep lasts goes on as if nothing had been.
world --imu-hz 1000 --out "$work/straight" >/dev/null || wrong "a whole run"
(exec "$programs/tetap-world" --memory --quiet --robot rover --imu-hz 1000 --out "$work/stopped") >/dev/null & run=$!
until [ -s "$work/stopped/estimates.log.part" ] || [ -e "$work/stopped/run.json" ]; do sleep 0.01; done
kill -STOP $run; [ ! -e "$work/stopped/run.json" ] || wrong "the run had ended before it was stopped: this test shows nothing"
sleep 3; kill -CONT $run; wait $run || wrong "a run that stood still for 3 s"
is "estimates of a run that stood still" "$(key estimates_sha256 stopped)" "$(key estimates_sha256 straight)"

# The version: the commit, and whether the tree differs from it.
made() { rm -rf "$work/made"; mkdir "$work/made"; cmake -DSOURCE="$1" -DOUTPUT="$work/made" -P toolchain/version.cmake && grep -o '0x[0-9a-f]*' "$work/made/version.cpp"; }
mkdir "$work/none" "$work/tree"
is "version outside of a repository" "$(GIT_CEILING_DIRECTORIES=$work made "$work/none")" 0x00000000
repository() { git -C "$work/tree" -c user.name=a -c user.email=b "$@"; }
repository init -q && echo one >"$work/tree/file" && repository add file && repository commit -qm one || wrong "no repository could be made"
commit=$(repository rev-parse HEAD | cut -c1-7)
is "version of a clean tree" "$(made "$work/tree")" "0x${commit}0"
echo two >"$work/tree/file"
is "version of a changed tree" "$(made "$work/tree")" "0x${commit}1"
repository checkout -q file; echo new >"$work/tree/other"
is "version of a tree with a new file" "$(made "$work/tree")" "0x${commit}1"
# Programs name it alike: run.json, and on the bus.
world --duration 3 --raw --out "$work/version" >/dev/null || wrong "a run"
bus=$(grep ' 326#' "$work/version/raw.log" | head -1 | sed 's/.*326#\(..\)\(..\)\(..\)\(..\).*/\4\3\2\1/' | tr A-F a-f)
case $bus in *0) bus=${bus%?} ;; *1) bus=${bus%?}-dirty ;; esac
is "version in run.json" "$(key version version)" "$bus"

[ $failed = 0 ] && echo "host runs: whole files, one run a folder, named versions"
exit $((failed > 0))
