// SPDX-License-Identifier: Apache-2.0
// Cost of a tick for inertial navigation alone, over 12 s of the simulated world with 200 IMU samples a second. The
// samples that leave the window are fused: two of the IMU, wheels, now and then a fix with lever arm, gate and record.
// The state is carried over the forty samples in the window. Decoding frames before and sending them after are
// node_tick's.
#include "board.hpp"
#include "config/rover.hpp"
#include "markers.hpp"
#include "navigator.hpp"
#include "recorded_world.hpp"

namespace {

using namespace tetap;
using count::opaque;
using count::Region;

constexpr param::Parameters kNumbers = [] {
  param::Parameters n = robot::rover::parameters;
  n.gnss.antenna_x_b_m = 0.3F;
  n.gnss.antenna_z_b_m = 0.8F;
  return n;
}();

}  // namespace

int main() {
  static Board board;
  static count::Navigator<estimators::Inertial> navigator{kNumbers};
  count::calibrate();
  navigator.begin({bits::kFastBegin_us});
  const bits::RecordedFrame* next = bits::kFastFrames;
  for (const bits::RecordedTick& tick : bits::kFastTicks) {
    for (std::uint32_t i = 0; i < tick.frames; ++i) navigator.on_frame((next++)->frame(kNumbers.can_base));
    const Region<struct ins_tick> region;
    navigator.tick({tick.time_us});
  }
  opaque(navigator);
  using sensor::Sensor;
  if (!navigator.valid() || navigator.accepted(Sensor::kImu) < 2'000 ||
      navigator.accepted(Sensor::kWheelCounts) < 800 || navigator.accepted(Sensor::kGnssPosition) < 40) {
    board.print("count: the recorded world was not navigated\n");
    return 1;
  }
  board.print("count: done\n");
  count::finish();
  return 0;
}
