// SPDX-License-Identifier: Apache-2.0
// One estimator in the firmware, with its statistics, in one of two ways.
// A plain one has its current state and its state at the far end of the window.
// A late sample is fused at its own time by starting again from `past` and repeating what came since: the result is the
// one that would have been had the sample been on time. Costs: twice the estimator's memory; a burst only when
// something is late that this estimator takes.
// A delayed one (kDelayed) has its state at the far end of the window only: samples reach it in their order when they
// leave the window, each once, and the present is that state carried over what the window holds. Costs: that carrying
// in every tick, never a burst (what is due it may also leave for the next tick); its records are late by the window.
#pragma once

#include "app/context.hpp"
#include "app/estimate.hpp"
#include "app/sample.hpp"

#include <array>
#include <concepts>
#include <cstdint>
#include <type_traits>

namespace tetap::app {

template <class E>
concept Estimator = requires(E& e, const E& view, base::Micros t, const Context& with, const SetPose& pose) {
  { E::kKind } -> std::convertible_to<can::EstimatorKind>;
  { e.restart(t, with) } -> std::same_as<void>;
  { e.set_pose(t, pose, with) } -> std::same_as<void>;
  { view.estimate(with) } -> std::same_as<Estimate>;
  { view.mode(with) } -> std::same_as<can::Mode>;
};

template <class E>
inline constexpr bool kIsDelayed = requires {
  requires E::kDelayed;
};

/// What became of one sensor's samples.
struct SensorStatistics {
  can::Sensor sensor = can::Sensor::kNotAvailable;  ///< not available: the entry is free
  std::uint8_t instance = 0;
  std::uint16_t accepted = 0;
  std::uint16_t rejected = 0;
  float nis_mean = 0;  ///< per degree of freedom, over the last 50 or so compared measurements
  std::uint8_t refused_in_a_row = 0;
  bool compared = false;
  base::Micros last_accepted;
};

/// Kinds and instances of sensors that one estimator keeps apart; what comes beyond shares the last entry.
inline constexpr std::size_t kStatistics = 12;

template <Estimator E>
class Lane {
 public:
  using Type = E;
  static constexpr bool kDelayed = kIsDelayed<E>;
  template <class Payload>
  static constexpr bool kTakes = requires(E& e, const Payload& payload, base::Micros stamp, const Context& with) {
    e.fuse(payload, stamp, with);
  };

  void restart(base::Micros t, const Context& with) {
    now_.restart(t, with);
    close();
  }
  void set_pose(base::Micros t, const SetPose& pose, const Context& with) {
    now_.set_pose(t, pose, with);
    close();
  }

  /// Whether this kind of sample means anything to the estimator.
  [[nodiscard]] static bool takes(const Sample& sample) {
    bool taken = false;
    visit(sample, [&]<class Payload>(const Payload&) { taken = kTakes<Payload>; });
    return taken;
  }
  /// Fuses into the current state; the record is what the bus is told.
  Innovation fuse(const Sample& sample, const Context& with) { return fuse_into(now_, sample, with); }
  /// The sample leaves the window: the far end takes it.
  void retire(const Sample& sample, const Context& with) requires(!kDelayed) {
    static_cast<void>(fuse_into(past_, sample, with));
  }
  /// Back to the far end of the window.
  void rewind() requires(!kDelayed) { now_ = past_; }
  /// What is now can no longer be changed by late samples.
  void close() {
    if constexpr (!kDelayed) past_ = now_;
  }

  /// A sample is new in the window.
  void arrived(const Sample& sample, const Context& with) requires kDelayed {
    if constexpr (requires { now_.arrived(sample, with); }) now_.arrived(sample, with);
  }
  /// A delayed estimator has done enough in this tick: the sample, true long enough ago, waits for the next.
  [[nodiscard]] bool rests(const Sample& sample, const Context& with) {
    if constexpr (requires { now_.rests(sample, with); }) return takes(sample) && now_.rests(sample, with);
    return false;
  }

  /// `window` is what the estimators have of the samples in the window, in order.
  template <class Window>
  void advance(base::Micros t, const Context& with, const Window& window) {
    if constexpr (kDelayed) {
      now_.advance(t, with, window);
    } else {
      now_.advance(t, with);
    }
  }
  [[nodiscard]] Estimate estimate(const Context& with) const { return now_.estimate(with); }
  [[nodiscard]] MotionVariance motion_variance(const Context& with) const {
    if constexpr (requires { now_.motion_variance(with); }) return now_.motion_variance(with);
    return {};
  }
  [[nodiscard]] InertialEstimate inertial(const Context& with) const requires requires(const E& e) { e.inertial(with); }
  { return now_.inertial(with); }
  [[nodiscard]] AttitudeEstimate attitude(const Context& with) const requires requires(const E& e) { e.attitude(with); }
  { return now_.attitude(with); }
  /// What the estimator itself did about its state, for the status.
  [[nodiscard]] Jump jump() const {
    if constexpr (requires { now_.jump(); }) return now_.jump();
    return {};
  }
  /// Bits of can::Fault that the estimator sees.
  [[nodiscard]] std::uint16_t faults() const {
    if constexpr (requires { now_.faults(); }) return now_.faults();
    return 0;
  }
  [[nodiscard]] can::Mode mode(const Context& with) const { return now_.mode(with); }

  void account(const Sample& sample, const Innovation& innovation) {
    SensorStatistics& s = statistics(sample.sensor, sample.instance);
    if (innovation.verdict == can::Verdict::kAccepted) {
      ++s.accepted;
      s.refused_in_a_row = 0;
      s.last_accepted = sample.stamp;
    } else if (innovation.verdict == can::Verdict::kRejected) {
      ++s.rejected;
      if (s.refused_in_a_row < 255) ++s.refused_in_a_row;
    }
    if (innovation.dof > 0) {
      const float nis = innovation.nis / static_cast<float>(innovation.dof);
      s.nis_mean = s.compared ? s.nis_mean + (nis - s.nis_mean) * 0.02F : nis;
      s.compared = true;
    }
  }
  [[nodiscard]] SensorStatistics& statistics(can::Sensor sensor, std::uint8_t instance) {
    std::size_t i = 0;
    while (i + 1 < kStatistics && statistics_[i].sensor != can::Sensor::kNotAvailable &&
           (statistics_[i].sensor != sensor || statistics_[i].instance != instance))
      ++i;
    statistics_[i].sensor = sensor;
    statistics_[i].instance = instance;
    return statistics_[i];
  }
  [[nodiscard]] const std::array<SensorStatistics, kStatistics>& statistics() const { return statistics_; }
  void clear_statistics() {
    for (SensorStatistics& s : statistics_) s = {};
  }

  template <class Sink>
  void each_bit(Sink&& sink) const {
    now_.each_bit(sink);
  }

 private:
  static Innovation fuse_into(E& estimator, const Sample& sample, const Context& with) {
    Innovation innovation;
    if (sample.sensor == can::Sensor::kImu && sample.instance != with.numbers.inertial.imu) return innovation;
    visit(sample, [&](const auto& payload) {
      if constexpr (kTakes<std::remove_cvref_t<decltype(payload)>>)
        innovation = estimator.fuse(payload, sample.stamp, with);
    });
    return innovation;
  }

  struct Nothing {};

  E now_;  ///< of a delayed estimator: the far end
  [[no_unique_address]] std::conditional_t<kDelayed, Nothing, E> past_;
  std::array<SensorStatistics, kStatistics> statistics_{};
};

}  // namespace tetap::app
