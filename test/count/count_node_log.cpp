// SPDX-License-Identifier: Apache-2.0
// Instructions of every tick of a robot's node over a recorded log, with a fusion window of any length: the ticks of
// node_tick_faults. Arguments: rover, car, iris or rover_landmarks; the window in ms; a candump log with sync frames.
#include "config/car.hpp"
#include "config/iris.hpp"
#include "config/rover.hpp"
#include "config/rover_landmarks.hpp"
#include "hal/board/mps2/board.hpp"
#include "markers.hpp"
#include "tetap/node/node.hpp"

#include <charconv>
#include <cstring>
#include <string_view>

namespace {

using namespace tetap;

struct node_tick_faults;

/// Places of the fusion window: 500 ms of an IMU of 400 Hz, wheels of 100 Hz, and everything slower.
constexpr std::size_t kPlaces = 320;

/// Ticks of the node over the whole log; 0 when a line of it was no frame.
template <class Estimators>
[[gnu::noinline]] std::uint32_t count_ticks(hal::mps2::Board& board, param::Parameters& parameters,
                                            std::int32_t window_us) {
  static node::Node<Estimators, kPlaces> node{parameters, {}};
  parameters.loop.window_us = window_us;
  const std::uint32_t sync_id = parameters.can_base + bus::InSync::kOffset;
  std::uint32_t ticks = 0;
  base::CanFrame last;
  while (const auto frame = board.can.receive()) {
    const auto sync = frame->id == sync_id ? bus::decode<bus::InSync>(bus::payload(*frame)) : std::nullopt;
    if (!sync) {
      node.on_frame(*frame);
      continue;
    }
    const base::Micros time{static_cast<std::int64_t>(sync->time_us)};
    if (sync->kind == bus::SyncKind::kBegin) {
      node.power_on(time);
    } else {
      const count::Region<node_tick_faults> region;
      node.tick(time, {}, [&](const base::CanFrame& out) { last = out; });
      ++ticks;
    }
  }
  count::opaque(last);
  return board.can.faults().rx_overflow == 0 ? ticks : 0;
}

template <class Estimators>
std::uint32_t count_robot(hal::mps2::Board& board, const param::Parameters& built, std::int32_t window_us) {
  static param::Parameters parameters = built;
  return count_ticks<Estimators>(board, parameters, window_us);
}

}  // namespace

int main() {
  static hal::mps2::Board board;
  static hal::mps2::semihosting::CommandLine<512> arguments;
  const auto words = arguments.words<4>();
  std::int32_t window_ms = 0;
  if (words[2] != nullptr) std::from_chars(words[2], words[2] + std::strlen(words[2]), window_ms);
  if (words[3] == nullptr || window_ms < 10 || window_ms > 500 || !board.can.open(words[3], nullptr)) {
    board.print("count_node_log: ROBOT WINDOW_MS LOG, and the log has to be there\n");
    return 1;
  }
  count::calibrate();
  const std::string_view name = words[1];
  const std::int32_t window_us = window_ms * 1000;
  std::uint32_t ticks = 0;
  if (name == "rover") ticks = count_robot<robot::rover::Estimators>(board, robot::rover::parameters, window_us);
  if (name == "car") ticks = count_robot<robot::car::Estimators>(board, robot::car::parameters, window_us);
  if (name == "iris") ticks = count_robot<robot::iris::Estimators>(board, robot::iris::parameters, window_us);
  if (name == "rover_landmarks")
    ticks = count_robot<robot::rover_landmarks::Estimators>(board, robot::rover_landmarks::parameters, window_us);
  if (ticks < 1000) {
    board.print("count_node_log: no such robot, lines that are no frames, or fewer than 1000 ticks\n");
    return 1;
  }
  count::finish();
  return 0;
}
