// SPDX-License-Identifier: Apache-2.0
// Instructions of every tick of inertial navigation over a log, from the start: a rover's, a car's, a multirotor's.
// Arguments: rover, watched (the rover with its bank of faults), car or iris, and a candump log with sync frames.
#include "config/car.hpp"
#include "config/iris.hpp"
#include "config/rover.hpp"
#include "hal/board/mps2/board.hpp"
#include "markers.hpp"
#include "navigator.hpp"

#include <string_view>

namespace {

using namespace tetap;

/// True when the whole log was read and navigated.
template <class Workload, class Estimator = estimators::Inertial>
[[gnu::noinline]] bool count_ticks(hal::mps2::Board& board, const param::Parameters& parameters) {
  static count::Navigator<Estimator> navigator{parameters};
  const std::uint32_t sync_id = parameters.can_base + bus::InSync::kOffset;
  while (const auto frame = board.can.receive()) {
    const auto sync = frame->id == sync_id ? bus::decode<bus::InSync>(bus::payload(*frame)) : std::nullopt;
    if (!sync) {
      navigator.on_frame(*frame);
      continue;
    }
    const base::Micros time{static_cast<std::int64_t>(sync->time_us)};
    if (sync->kind == bus::SyncKind::kBegin) {
      navigator.begin(time);
    } else {
      const count::Region<Workload> region;
      navigator.tick(time);
    }
  }
  count::opaque(navigator);
  return board.can.faults().rx_overflow == 0 && navigator.valid() &&
         navigator.accepted(sensor::Sensor::kGnssPosition) > 10;
}

}  // namespace

int main() {
  static hal::mps2::Board board;
  static hal::mps2::semihosting::CommandLine<512> arguments;
  const auto words = arguments.words<3>();
  if (words[1] == nullptr || words[2] == nullptr || !board.can.open(words[2], nullptr)) {
    board.print("count_ins_log: cannot open the log\n");
    return 1;
  }
  count::calibrate();
  const std::string_view robot = words[1];
  const param::Parameters& rover = robot::rover::parameters;
  const bool navigated = robot == "rover" ? count_ticks<struct ins_tick_rover>(board, rover)
                         : robot == "watched"
                             ? count_ticks<struct fault_bank, estimators::WatchedInertial>(board, rover)
                         : robot == "car" ? count_ticks<struct ins_tick_car>(board, robot::car::parameters)
                                          : count_ticks<struct ins_tick_iris>(board, robot::iris::parameters);
  if (!navigated) {
    board.print("count_ins_log: the log was not navigated\n");
    return 1;
  }
  count::finish();
  return 0;
}
