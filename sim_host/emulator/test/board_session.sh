# SPDX-License-Identifier: Apache-2.0
# What the tests of a flash image on an emulated board share: they skip without the emulator, write into $out, and end with one line. To be sourced; needs bash.
. "$(dirname "${BASH_SOURCE[0]}")/../../../tools/run/node_session.sh"
cd "$root"
[ -x "$programs/emulator/tetap-board" ] || { echo "$(basename "$0" .sh): skipped: no $programs/emulator/tetap-board (libunicorn-dev)" >&2; exit 77; }
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT
fail() { echo "$(basename "$0" .sh): $*" >&2; exit 1; }
