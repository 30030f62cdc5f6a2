// SPDX-License-Identifier: Apache-2.0
// The rover's node on a bus without a gap. The frames are those of a recorded run, and as many others as 500 kbit/s
// have room for in a tick. The others are valid samples from within the window, or pose commands. Counted: the tick,
// and the epoch with its frames.
#include "board.hpp"
#include "config/rover.hpp"
#include "markers.hpp"
#include "recorded_world.hpp"
#include "tetap/node/node.hpp"

#include <algorithm>
#include <array>
#include <cstdint>

namespace {

using namespace tetap;
using count::Region;

/// 500 kbit/s over 135 bits for a frame of 8 bytes, worst case (tools/can/generate_messages), in 10 ms.
constexpr std::uint32_t kFullBus = 37;
constexpr std::uint32_t kBase = robot::rover::parameters.can_base;

class Flood {
 public:
  enum class Kind : std::uint8_t { kCounts, kImu, kFixes, kMixed, kCommands };
  explicit Flood(Kind kind) : kind_(kind) {}

  /// One more frame before a tick that is not before t.
  base::CanFrame frame(std::int64_t t_us) {
    ++made_;
    const std::uint32_t stamp = static_cast<std::uint32_t>(t_us - below(195'000)) & 0xFFFFFU;
    const auto seq = static_cast<std::uint8_t>(made_ & 15U);
    const Kind kind = kind_ == Kind::kMixed ? static_cast<Kind>(below(3)) : kind_;
    if (kind == Kind::kImu) return imu(stamp);
    if (kind == Kind::kFixes) return fix(stamp);
    if (kind == Kind::kCommands) return command();
    return bus::frame(kBase, bus::InWheelCounts{.stamp_us = stamp,
                                                .seq = seq,
                                                .left = static_cast<std::uint16_t>(below(65'536)),
                                                .right = static_cast<std::uint16_t>(below(65'536))});
  }

 private:
  std::uint32_t below(std::uint32_t n) {
    state_ = state_ * 1'664'525U + 1'013'904'223U;
    return (state_ >> 8) % n;
  }
  base::CanFrame imu(std::uint32_t stamp) {
    const auto seq = static_cast<std::uint8_t>(part_ / 3 & 15U);
    switch (part_++ % 3) {
      case 0:
        return bus::frame(kBase, bus::ImuGyro{.ang_z_rad = 1e-6F * static_cast<float>(below(5'000)), .seq = seq});
      case 1:
        return bus::frame(kBase, bus::ImuAccel{.vel_z_mps = 0.098F, .seq = seq});
      default:
        return bus::frame(kBase, bus::ImuTime{.stamp_us = stamp, .interval_us = 10'000, .seq = seq});
    }
  }
  base::CanFrame fix(std::uint32_t stamp) {
    const auto seq = static_cast<std::uint8_t>(part_ / 2 & 15U);
    if (part_ % 2 == 0) stamp_ = stamp;
    if (part_++ % 2 == 0) return bus::frame(kBase, bus::InGnssVelEN{.stamp_us = stamp_, .seq = seq, .east_mps = 1});
    return bus::frame(kBase, bus::InGnssVelU{.stamp_us = stamp_, .seq = seq, .acc_mps = 0.1F});
  }
  base::CanFrame command() {
    const auto ctr = static_cast<std::uint8_t>(part_ / 2 & 15U);
    if (part_++ % 2 == 0) return bus::frame(kBase, bus::protect(bus::CmdSetPos{.ctr = ctr, .x_raw = 1'000}));
    return bus::frame(kBase,
                      bus::protect(bus::CmdSetYaw{.ctr = ctr, .yaw_rad = 1, .std_pos_m = 1, .std_yaw_rad = 0.1F}));
  }

  Kind kind_;
  std::uint32_t state_ = 1, made_ = 0, part_ = 0, stamp_ = 0;
};

template <class Tick, class Epoch>
void flooded(Flood::Kind kind) {
  static node::Node<robot::rover::Estimators> node{robot::rover::parameters, {}};
  node.power_on({bits::kRecordedBegin_us});
  Flood flood(kind);
  base::CanFrame last;
  const bits::RecordedFrame* next = bits::kRecordedFrames;
  std::uint32_t ticks = 0;
  for (const bits::RecordedTick& tick : bits::kRecordedTicks) {
    static std::array<base::CanFrame, bits::kRecordedMostFrames + kFullBus> inputs;
    std::uint32_t size = 0;
    for (; size < tick.frames; ++size) inputs[size] = (next++)->frame(kBase);
    if (++ticks > 400)  // aligned by then
      for (; size < kFullBus; ++size) inputs[size] = flood.frame(tick.time_us);
    const Region<Epoch> epoch;
    for (std::uint32_t i = 0; i < size; ++i) node.on_frame(inputs[i]);
    const Region<Tick> region;
    node.tick({tick.time_us}, {}, [&](const base::CanFrame& frame) { last = frame; });
  }
  count::opaque(last);
}

}  // namespace

struct node_tick_full_bus;
struct node_epoch_full_bus;

int main() {
  static Board board;
  count::calibrate();
  flooded<node_tick_full_bus, node_epoch_full_bus>(Flood::Kind::kCounts);
  flooded<node_tick_full_bus, node_epoch_full_bus>(Flood::Kind::kImu);
  flooded<node_tick_full_bus, node_epoch_full_bus>(Flood::Kind::kFixes);
  flooded<node_tick_full_bus, node_epoch_full_bus>(Flood::Kind::kMixed);
  flooded<struct node_tick_commands, struct node_epoch_commands>(Flood::Kind::kCommands);
  board.print("count_full_bus: done\n");
  count::finish();
  return 0;
}
