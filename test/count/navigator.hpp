// SPDX-License-Identifier: Apache-2.0
// Inertial navigation between the inbox and the publisher, as a node has it: what ins_tick counts.
#pragma once

#include "app/estimators/inertial.hpp"
#include "app/history.hpp"
#include "app/inbox.hpp"

#include <array>
#include <cstddef>
#include <cstdint>

namespace tetap::count {

template <class Inertial>
class Navigator {
  [[nodiscard]] auto noting() {
    return [this](std::size_t, const app::Sample& sample, const app::Innovation& record) {
      record_ = record;
      if (record.verdict == can::Verdict::kAccepted) ++accepted_[static_cast<std::size_t>(sample.sensor)];
    };
  }

 public:
  explicit Navigator(const app::Numbers& numbers) : numbers_(numbers) {}
  void begin(base::Micros t) {
    now_ = t;
    const app::GnssNumbers& g = numbers_.gnss;
    if (g.origin_configured != 0) {
      site_.frame = nav::LocalFrame(g.origin_latitude_2ndeg, g.origin_longitude_2ndeg, g.origin_height_m);
      site_.origin = can::OriginSource::kConfigured;
    }
    inbox_.power_on();
    history_.power_on(t, context());
  }
  void on_frame(const base::CanFrame& frame) {
    inbox_.on_frame(static_cast<std::uint8_t>(frame.id - numbers_.can_base), frame, now_, counters_, *this);
  }
  // Called by the inbox.
  void sample(const app::Sample& sample) {
    if (sample.sensor == can::Sensor::kGnssPosition && site_.origin == can::OriginSource::kNone) {
      const app::GnssPosition& fix = sample.payload.gnss_position;  // the first one, as in Node
      if (fix.fix < app::GnssFix::k3d) return;
      site_.frame = nav::LocalFrame(fix.latitude_2ndeg, fix.longitude_2ndeg, fix.height_m);
      site_.origin = can::OriginSource::kFirstFix;
    }
    static_cast<void>(history_.insert(sample, context(), noting()));
  }
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
    history_.retire_until(t - base::Micros{numbers_.loop.window_us}, context(), noting());
  }
  [[nodiscard]] std::uint32_t accepted(can::Sensor sensor) const { return accepted_[static_cast<std::size_t>(sensor)]; }
  [[nodiscard]] bool valid() const { return valid_; }

 private:
  [[nodiscard]] app::Context context() const { return {.numbers = numbers_, .site = site_}; }

  const app::Numbers& numbers_;
  app::History<app::Estimators<Inertial>, 96> history_;
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

}  // namespace tetap::count
