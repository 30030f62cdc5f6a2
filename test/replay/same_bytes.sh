#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# same_bytes.sh SECONDS: the world on vcan, in memory, and from clang's program: one estimates.log.
set -u
cd "$(dirname "$0")/../.." || exit 2
seconds=$1
BUS=vcan FAULT=none OUT=out/prove/sim WORLD="--duration $seconds --quiet" REPORT=--no-pictures tools/run/simulate_world || exit 1
build/host/sim_host/tetap-world --memory --duration "$seconds" --quiet --out out/prove/again || exit 1
build/clang/sim_host/tetap-world --memory --duration "$seconds" --quiet --out out/prove/clang || exit 1
for one in again clang; do cmp out/prove/sim/estimates.log out/prove/$one/estimates.log || exit 1; done
[ "$(grep -c ' 320#' out/prove/sim/estimates.log)" -ge $((seconds * 99)) ]
