// SPDX-License-Identifier: Apache-2.0
// A board with a program of sim_host/emulator/test/programs in its flash.
#pragma once

#include "sim_host/emulator/ark_cannode.hpp"
#include "sim_host/emulator/machine.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <string>

namespace tetap::board {

inline std::string program_path(const std::string& name) {
  std::string path = TETAP_PROGRAMS;
  path += '/';
  path += name;
  path += ".elf";
  return path;
}

/// Board, machine and the words that a program shares with its test (program.hpp).
class Emulated {
 public:
  Emulated(const std::string& program, std::uint32_t choice, const BoardOptions& options = {},
           const MachineOptions& machine_options = {}, SensorWorld world = {})
      : board(options, std::move(world)), machine(board.chip, machine_options) {
    EXPECT_EQ(machine.load_elf(program_path(program)), "");
    for (std::uint32_t i = 0; i < 64; ++i)
      EXPECT_TRUE(board.chip.memory.write_word(kShared + 4 * i, i == 0 ? choice : 0));
  }

  void run_ms(std::int64_t ms) { machine.run(board.chip.scheduler.now() + ms * kMillisecond); }
  [[nodiscard]] std::uint32_t result(std::uint32_t i) const {
    std::uint32_t word = 0;
    EXPECT_TRUE(board.chip.memory.read_word(kShared + 4 + 4 * i, word));
    return word;
  }
  [[nodiscard]] const Complaints& complaints() const { return board.chip.complaints; }

  ArkCannode board;
  Machine machine;

 private:
  static constexpr std::uint32_t kShared = 0x2002'0000;
};

}  // namespace tetap::board
