// SPDX-License-Identifier: Apache-2.0
// Inertial navigation between the inbox and the publisher, as a node has it: what ins_tick counts.
#pragma once

#include "tetap/bus/decoder.hpp"
#include "tetap/estimators/inertial/inertial.hpp"
#include "tetap/node/fusion_window.hpp"

#include <array>
#include <cstddef>
#include <cstdint>

namespace tetap::count {

template <class Inertial>
class Navigator {
  [[nodiscard]] auto noting() {
    return [this](std::size_t, const sensor::Sample& sample, const estimators::Innovation& record) {
      record_ = record;
      if (record.verdict == sensor::Verdict::kAccepted) ++accepted_[static_cast<std::size_t>(sample.sensor)];
    };
  }

 public:
  explicit Navigator(const param::Parameters& parameters) : parameters_(parameters) {}
  void begin(base::Micros t) {
    now_ = t;
    const param::GnssParameters& g = parameters_.gnss;
    if (g.origin_configured != 0) {
      map_frame_.frame = nav::LocalFrame(g.origin_latitude_2ndeg, g.origin_longitude_2ndeg, g.origin_height_m);
      map_frame_.origin = sensor::OriginSource::kConfigured;
    }
    inbox_.power_on();
    history_.power_on(t, context());
  }
  void on_frame(const base::CanFrame& frame) {
    inbox_.on_frame(static_cast<std::uint8_t>(frame.id - parameters_.can_base), frame, now_, counters_, *this);
  }
  // Called by the inbox.
  void sample(const sensor::Sample& sample) {
    if (sample.sensor == sensor::Sensor::kGnssPosition && map_frame_.origin == sensor::OriginSource::kNone) {
      const sensor::GnssPosition& fix = sample.payload.gnss_position;  // the first one, as in Node
      if (fix.fix < sensor::GnssFix::k3d) return;
      map_frame_.frame = nav::LocalFrame(fix.latitude_2ndeg, fix.longitude_2ndeg, fix.height_m);
      map_frame_.origin = sensor::OriginSource::kFirstFix;
    }
    static_cast<void>(history_.insert(sample, context(), noting()));
  }
  void map_entry(const estimators::MapEntry&) {}
  void reset(bus::ResetWhat) {}
  void set_pose(const estimators::SetPose& pose) {
    history_.each_slot([&](auto& slot) { slot.set_pose(now_, pose, context()); });
  }

  void tick(base::Micros t) {
    now_ = t;
    static_cast<void>(history_.consume(
        t, context(), [](const sensor::Sample&) {}, noting()));
    history_.advance(t, context());
    estimate_ = history_.primary().estimate(context());
    const estimators::InertialEstimate inertial = history_.primary().inertial(context());
    state_ = inertial.state;
    valid_ = inertial.valid;
    history_.retire_until(t - base::Micros{parameters_.loop.window_us}, context(), noting());
  }
  [[nodiscard]] std::uint32_t accepted(sensor::Sensor sensor) const {
    return accepted_[static_cast<std::size_t>(sensor)];
  }
  [[nodiscard]] bool valid() const { return valid_; }

 private:
  [[nodiscard]] estimators::Context context() const { return {.parameters = parameters_, .map_frame = map_frame_}; }

  const param::Parameters& parameters_;
  node::FusionWindow<node::Estimators<Inertial>, 96> history_;
  bus::Decoder inbox_;
  bus::Counters counters_;
  estimators::MapFrame map_frame_;
  estimators::Estimate estimate_;
  nav::InsState state_;
  bool valid_ = false;
  estimators::Innovation record_;
  std::array<std::uint32_t, 16> accepted_{};  ///< by sensor
  base::Micros now_;
};

}  // namespace tetap::count
