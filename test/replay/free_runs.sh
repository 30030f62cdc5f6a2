#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# free_runs.sh BOARD SECONDS [--whole]: free_run.sh of the simulated world, and of a recorded run where there is one. Without --whole the
# emulated board has the one, the host the other.
set -u
cd "$(dirname "$0")/../.." || exit 2
board=$1 seconds=$2 whole=${3:-} recorded=out/recorded/mrclam2.log
[ -e $recorded ] || recorded=
if [ -n "$whole" ] || [ "$board" != linux ] || [ -z "$recorded" ]; then test/replay/free_run.sh "$board" rover world "$seconds" || exit; fi
if [ -n "$recorded" ] && { [ -n "$whole" ] || [ "$board" = linux ]; }; then test/replay/free_run.sh "$board" mrclam $recorded "$seconds" || exit; fi
