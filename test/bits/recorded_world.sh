#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# recorded_world.sh HEADER GENERATED: writes the header with the simulated world's frames, made with this machine's own compiler, unless it is newer
# than what it is made of. Builds for several cores share it.
set -eu
root=$(cd "$(dirname "$0")/../.." && pwd)
header=$1 generated=$2
mkdir -p "$(dirname "$header")"
exec 9>"$header.lock"
flock 9
if [ -e "$header" ] && [ -z "$(find "$root"/{sim_host/world,src/tetap/base,src/tetap/bus,src/tetap/sensor,config,test/bits}/ "$root"/sim_host/*.hpp -newer "$header" -name '*.?pp' -print -quit)" ]; then
  exit 0
fi
g++ -std=c++20 -O1 -ffp-contract=off -I "$generated" -I "$root/src" -I "$root" -isystem /usr/include/eigen3 -o "$header.program" "$root/test/bits/record_world.cpp" "$root"/sim_host/world/*.cpp
"$header.program" >"$header.new"
mv "$header.new" "$header"
