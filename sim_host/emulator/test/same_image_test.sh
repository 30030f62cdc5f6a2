#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# same_image_test.sh: two builds of one commit in folders of other names, neither with a compiler cache, give the same bytes: .bin and .hex of the rover
# on the ARK CANnode and on the Nucleo-G474RE.
set -eu
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../../.." && pwd)
cd "$root"
command -v arm-none-eabi-g++ >/dev/null || { echo "same_image_test: skipped: no arm-none-eabi-g++" >&2; exit 77; }
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
export CCACHE_DISABLE=1
for copy in "$work/one" "$work/another/place"; do
  git clone --quiet --shared --no-checkout "$root" "$copy"  # the commit's number is in the image
  git ls-files -z --cached --others --exclude-standard | xargs -0 cp --parents -t "$copy" 2>/dev/null || true  # without files that were removed
  (cd "$copy" && tools/run/build_preset m4f:tetap-ark_cannode-rover,tetap-ark_cannode_at_64k-rover,tetap-nucleo_g474re-rover 2>/dev/null) ||
    { echo "same_image_test: $copy does not build" >&2; exit 1; }
done
for image in m4f/hal/board/tetap-{ark_cannode,ark_cannode_at_64k,nucleo_g474re}-rover; do
  for kind in bin hex; do
    cmp "$work/one/build/$image.$kind" "$work/another/place/build/$image.$kind" || exit 1
  done
  sha256sum "$work/one/build/$image.bin" | awk -v name="$(basename "$image").bin" '{ print name, $1 }'
done
