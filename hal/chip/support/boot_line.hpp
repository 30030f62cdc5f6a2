// SPDX-License-Identifier: Apache-2.0
// The lines that an image prints about itself. At boot: its version, the robot and the hashes of the self-check, the
// same on every target. Anybody with a board can compare them with `make bits`. Later: the stack's high-water mark.
#pragma once

#include "hal/chip/support/text.hpp"

#include <cstdint>

namespace tetap::hal {

/// Epochs of the self-check at boot: 5 s of a robot's life, some tens of milliseconds of a core's.
inline constexpr std::uint32_t kBootEpochs = 500;

/// Apart, so that its text is not on the stack while the firmware runs.
template <class Board>
[[gnu::noinline]] void print_bits(const Board& board, const char* robot, std::uint32_t bits) {
  board.print(Text<>{}.add("tetap: robot ").add(robot).add(", bits ").hex(bits).add('\n').c_str());
}

/// "8a2d5ae", or "8a2d5ae-dirty" of a changed tree, as git describe writes it.
template <class Version>
[[nodiscard]] Text<16> version_text(const Version& version) {
  Text<16> text;
  text.hex(version.git, 7);
  return version.dirty ? text.add("-dirty") : text;
}

template <class Board, class Version>
[[gnu::noinline]] void print_version_line(const Board& board, const Version& version) {
  board.print(Text<>{}.add("tetap: version ").add(version_text(version).c_str()).add('\n').c_str());
}

template <class Board, class Firmware>
[[gnu::noinline]] void print_boot_line(const Board& board, const char* robot, Firmware& firmware) {
  const std::uint32_t bits = firmware.self_check(kBootEpochs);
  print_bits(board, robot, bits);
}

template <class Board>
[[gnu::noinline]] void print_stack_line(const Board& board) {
  const auto stack = Board::stack();
  board.print(Text<>{}.add("tetap: stack ").dec(stack.used).add(" of ").dec(stack.reserved).add('\n').c_str());
}

}  // namespace tetap::hal
