// SPDX-License-Identifier: Apache-2.0
// One program for every compiler and core. It prints "bits: NAME HASH" for each function and filter, first of a short
// form, then of the whole one. tools/proof/compare_bits compares the lines. An image takes no arguments; whoever has
// read enough ends the emulator.
#include "attitude.hpp"
#include "changes.hpp"
#include "config/husky.hpp"
#include "config/labyrinth.hpp"
#include "config/mrclam.hpp"
#include "config/rover.hpp"
#include "filters.hpp"
#include "hal/chip/support/boot_line.hpp"
#include "hal/chip/support/text.hpp"
#include "inertial.hpp"
#include "recorded_world.hpp"
#include "tetap/base/selfcheck.hpp"
#include "tetap/node/node.hpp"

#include <array>
#include <cstddef>
#include <new>

#if defined(TETAP_BOARD_ZYNQMP_R5)
#include "hal/board/zynqmp_r5/board.hpp"
using Board = tetap::hal::zynqmp_r5::Board;
#elif defined(TETAP_BOARD_MPS2)
#include "hal/board/mps2/board.hpp"
using Board = tetap::hal::mps2::Board;
#else
#include <cstdio>
struct Board {
  void print(const char* text) const {
    std::fputs(text, stdout);
    std::fflush(stdout);
  }
};
#endif

namespace {

using namespace tetap;

/// The recorded run; hashed as Exercise does it: everything that does not depend on real time, the state's CRC in every
/// epoch.
template <class Node>
std::uint32_t recorded(Node& node, std::uint32_t can_base) {
  base::WordHash hash;
  node.power_on({bits::kRecordedBegin_us});
  const bits::RecordedFrame* next = bits::kRecordedFrames;
  for (const bits::RecordedTick& tick : bits::kRecordedTicks) {
    for (std::uint32_t i = 0; i < tick.frames; ++i) node.on_frame((next++)->frame(can_base));
    node.tick({tick.time_us}, {}, [&](const base::CanFrame& frame) {
      const std::uint32_t offset = frame.id - can_base;
      if (offset == bus::EstVersion::kOffset || offset == bus::EstDiagLoop::kOffset) return;
      hash(offset);
      for (std::size_t i = 0; i < frame.size; ++i) hash(std::uint32_t{frame.data[i]});
    });
  }
  return hash.value();
}

struct Length {
  const char* name;
  std::uint32_t values;
  std::uint32_t steps;
};
constexpr Length kShort{.name = "short", .values = 1U << 18, .steps = 2'000};
constexpr Length kWhole{.name = "whole", .values = 1U << 24, .steps = 100'000};

class Program {
 public:
  explicit Program(Board& board) : board_(board) {}

  void run(const Length& length) {
    board_.print(hal::Text<>{}.add("bits: begin ").add(length.name).add('\n').c_str());
    base::check_functions(length.values, [this](const char* name, std::uint32_t hash) { line(name, "", hash); });
    line("kalman_constant_velocity", "", bits::kalman_constant_velocity(length.steps));
    line("kalman_dense", "", bits::kalman_dense(length.steps));
    line("ekf_planar", "", bits::ekf_planar(length.steps));
    line("dead_reckoning", "", bits::dead_reckoning(length.steps));
    line("geodesy", "", bits::geodesy(length.steps));
    line("attitude", "", bits::attitude(length.steps));
    line("ins", "", fresh<bits::InsRun>().run(length.steps));
    line("inertial", "", fresh<bits::InertialRun>().run(length.steps));
    node<robot::rover::Estimators>("rover", robot::rover::parameters, length.steps);
    node<robot::mrclam::Estimators>("mrclam", robot::mrclam::parameters, length.steps);
    node<robot::husky::Estimators>("husky", robot::husky::parameters, length.steps);
    node<robot::labyrinth::Estimators>("labyrinth", robot::labyrinth::parameters, length.steps);
    auto& changing = fresh<node::Node<robot::mrclam::Estimators>>(robot::mrclam::parameters, bus::Version{});
    const bits::ChangedRun changed = bits::changed_run(changing, robot::mrclam::parameters.can_base);
    if (!changed.whole) return board_.print("bits: a change of parameters was not made\n");
    line("changed_", "mrclam", changed.hash);
    auto& rover = fresh<node::Node<robot::rover::Estimators>>(robot::rover::parameters, bus::Version{});
    line("recorded_", "rover", recorded(rover, robot::rover::parameters.can_base));
    board_.print(hal::Text<>{}.add("bits: end ").add(length.name).add('\n').c_str());
  }

 private:
  /// boot_: what a flash image of this robot says of itself at boot.
  template <class Estimators>
  void node(const char* robot, const param::Parameters& parameters, std::uint32_t steps) {
    auto& node = fresh<node::Node<Estimators>>(parameters, bus::Version{});
    line("boot_", robot, firmware::BootSelfCheck(node, parameters.can_base, 1).run(hal::kBootEpochs));
    line("node_", robot, firmware::BootSelfCheck(node, parameters.can_base, 2).run(steps));
  }
  /// One after the other in the same memory: a core that has little holds all of them.
  template <class T, class... Arguments>
  [[nodiscard]] T& fresh(const Arguments&... arguments) {
    static_assert(sizeof(T) <= sizeof memory_ && alignof(T) <= kAlignment);
    return *new (static_cast<void*>(memory_.data())) T{arguments...};
  }
  void line(const char* kind, const char* name, std::uint32_t hash) {
    board_.print(hal::Text<>{}.add("bits: ").add(kind).add(name).add(' ').hex(hash).add('\n').c_str());
  }
  Board& board_;
  static constexpr std::size_t kAlignment = 32;  // what a vectorised Eigen wants, for --show-red
  alignas(kAlignment) std::array<std::byte, 16 * 1024> memory_{};
};

}  // namespace

int main() {
  static Board board;
  static Program program(board);
  program.run(kShort);
  program.run(kWhole);
#if defined(TETAP_BOARD_ZYNQMP_R5)
  for (;;) {
  }
#endif
}
