// SPDX-License-Identifier: Apache-2.0
// Instructions of every tick of a MRCLAM robot's node over a recorded log: IN.log, a candump log with sync frames, is
// the argument.
#include "config/mrclam.hpp"
#include "hal/board/mps2/board.hpp"
#include "markers.hpp"
#include "tetap/node/node.hpp"

int main() {
  using namespace tetap;
  static hal::mps2::Board board;
  static hal::mps2::semihosting::CommandLine<512> arguments;
  const auto words = arguments.words<2>();
  if (words[1] == nullptr || !board.can.open(words[1], nullptr)) {
    board.print("count_log: cannot open the log\n");
    return 1;
  }
  static node::Node<robot::mrclam::Estimators> node{robot::mrclam::parameters, {}};
  const std::uint32_t sync_id = robot::mrclam::parameters.can_base + bus::InSync::kOffset;
  count::calibrate();
  base::CanFrame last;
  while (const auto frame = board.can.receive()) {
    const auto sync = frame->id == sync_id ? bus::decode<bus::InSync>(bus::payload(*frame)) : std::nullopt;
    if (!sync) {
      const count::Region<struct mrclam_frame> region;
      node.on_frame(*frame);
      continue;
    }
    const base::Micros time{static_cast<std::int64_t>(sync->time_us)};
    if (sync->kind == bus::SyncKind::kBegin) {
      node.power_on(time);
    } else {
      const count::Region<struct mrclam_tick> region;
      node.tick(time, {}, [&](const base::CanFrame& out) { last = out; });
    }
  }
  count::opaque(last);
  if (board.can.faults().rx_overflow != 0) {
    board.print("count_log: the log has lines that are not frames\n");
    return 1;
  }
  count::finish();
  return 0;
}
