// SPDX-License-Identifier: Apache-2.0
// What a tick costs for inertial navigation alone, over 12 s of the simulated world with 200 IMU samples a second: the
// samples that leave the window fused (two of the IMU, wheels, and now and then a fix with lever arm, gate and record),
// and the state carried over the forty that are in it. Decoding frames before and sending them after are node_tick's.
#include "app/estimators/inertial.hpp"
#include "app/history.hpp"
#include "app/inbox.hpp"
#include "board.hpp"
#include "config/rover.hpp"
#include "markers.hpp"
#include "recorded_world.hpp"

namespace {

using namespace tetap;
using count::opaque;
using count::Region;

constexpr app::Numbers kNumbers = [] {
  app::Numbers n = robot::rover::numbers;
  n.gnss.antenna_x_b_m = 0.3F;
  n.gnss.antenna_z_b_m = 0.8F;
  return n;
}();

/// The node's part between the inbox and the publisher.
class Navigator {
  [[nodiscard]] auto noting() {
    return [this](std::size_t, const app::Sample& sample, const app::Innovation& record) {
      record_ = record;
      if (record.verdict == can::Verdict::kAccepted) ++accepted_[static_cast<std::size_t>(sample.sensor)];
    };
  }

 public:
  void begin(base::Micros t) {
    now_ = t;
    const app::GnssNumbers& g = kNumbers.gnss;
    site_.frame = nav::LocalFrame(g.origin_latitude_2ndeg, g.origin_longitude_2ndeg, g.origin_height_m);
    site_.origin = can::OriginSource::kConfigured;
    inbox_.power_on();
    history_.power_on(t, context());
  }
  void on_frame(const base::CanFrame& frame) {
    inbox_.on_frame(static_cast<std::uint8_t>(frame.id - kNumbers.can_base), frame, now_, counters_, *this);
  }
  // Called by the inbox.
  void sample(const app::Sample& sample) { static_cast<void>(history_.insert(sample, context(), noting())); }
  void map_entry(const app::MapEntry&) {}
  void reset(can::ResetWhat) {}
  void set_pose(const app::SetPose& pose) {
    history_.each_lane([&](auto& lane) { lane.set_pose(now_, pose, context()); });
  }

  void tick(base::Micros t) {
    now_ = t;
    static_cast<void>(history_.consume(
        t, context(), [](const app::Sample&) {}, noting()));
    history_.advance(t, context());
    estimate_ = history_.primary().estimate(context());
    const app::InertialEstimate inertial = history_.primary().inertial(context());
    state_ = inertial.state;
    valid_ = inertial.valid;
    history_.retire_until(t - base::Micros{kNumbers.loop.window_us}, context(), noting());
  }
  [[nodiscard]] std::uint32_t accepted(can::Sensor sensor) const { return accepted_[static_cast<std::size_t>(sensor)]; }
  [[nodiscard]] bool valid() const { return valid_; }

 private:
  [[nodiscard]] app::Context context() const { return {.numbers = kNumbers, .site = site_}; }

  app::History<app::Estimators<app::Inertial>, 96> history_;
  app::Inbox inbox_;
  app::Counters counters_;
  app::Site site_;
  app::Estimate estimate_;
  nav::InsState state_;
  bool valid_ = false;
  app::Innovation record_;
  std::array<std::uint32_t, 16> accepted_{};  ///< by sensor
  base::Micros now_;
};

}  // namespace

int main() {
  static Board board;
  static Navigator navigator;
  count::calibrate();
  navigator.begin({bits::kFastBegin_us});
  const bits::RecordedFrame* next = bits::kFastFrames;
  for (const bits::RecordedTick& tick : bits::kFastTicks) {
    for (std::uint32_t i = 0; i < tick.frames; ++i) navigator.on_frame((next++)->frame(kNumbers.can_base));
    const Region<struct ins_tick> region;
    navigator.tick({tick.time_us});
  }
  opaque(navigator);
  using can::Sensor;
  if (!navigator.valid() || navigator.accepted(Sensor::kImu) < 2'000 ||
      navigator.accepted(Sensor::kWheelCounts) < 800 || navigator.accepted(Sensor::kGnssPosition) < 40) {
    board.print("count: the recorded world was not navigated\n");
    return 1;
  }
  board.print("count: done\n");
  count::finish();
  return 0;
}
