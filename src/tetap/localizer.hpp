// SPDX-License-Identifier: Apache-2.0
// The door of the library: measurements with their stamps in; the estimate, and what became of each measurement, out.
// No heap, no clock, no bus, no thread: sizeof(Localizer) is all that it uses.
//
//   namespace e = tetap::estimators;
//   constexpr tetap::param::Parameters kParameters = tetap::param::checked({...});      // the robot's numbers
//   static tetap::Localizer<tetap::node::Estimators<e::Odometry, e::Inertial>> robot(kParameters);
//   robot.add(tetap::sensor::WheelCounts{.left = 12, .right = 13}, stamp);  // in any order; late ones within the
//   window robot.advance(now);                                                     // every kParameters.loop.period_us
//   robot.estimate().pose, robot.records()
//
// The same calls give the same bits as a node on the bus with the same samples. One object belongs to one thread.
// Cost: add() a search from the window's end, advance() the tick of docs/validation/cost.md without its frames.
#pragma once

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wmissing-field-initializers"  // as in estimators.cpp

#include "tetap/node/node.hpp"
#include "tetap/param/limits.hpp"
#include "tetap/sensor/sample_of.hpp"
#include "tetap/version.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace tetap {

/// Fate of a measurement in add().
enum class Admission : std::uint8_t {
  kTaken,
  kNotUsed,     ///< taken, and no estimator of this robot takes this kind
  kTooLate,     ///< before the window (LoopParameters::window_us)
  kTooEarly,    ///< further ahead than LoopParameters::ahead_us
  kDuplicate,   ///< stamp, kind, instance and sequence of one that is there
  kOutOfRange,  ///< not a number, or of a size that no sensor can mean (sensor/plausibility.hpp)
  kFull,        ///< the window has no place left
  kOverload     ///< beyond what one advance() may work on
};

using Record = node::Record;

/// Output of the robot's last estimator, at the time of the last advance(). Frames: n is the level plane of the map's
/// origin, x east, y north, z up; b is the body, x forward, y left, z up.
struct Localization : estimators::Estimate {
  /// Attitude, height and velocity in space, with covariances; where an estimator of this robot gives them.
  struct Space {
    bool valid = false;           ///< height, velocity and the covariances
    bool attitude_valid = false;  ///< q_nb; its heading is free where heading_valid is false
    bool heading_valid = false;
    filter::Quaternion q_nb;  ///< rotates b into n
    base::Anchored z;         ///< above the origin
    std::array<float, 3> v_n_mps{};
    filter::Symmetric<float, 3> position_m2, velocity_m2ps2, attitude_rad2;  ///< in n; attitude: a rotation about n
  };

  estimators::MotionVariance motion;  ///< variance of forward_mps and yaw_rate_radps
  Space space;
  sensor::Mode mode = sensor::Mode::kBoot;
  std::uint16_t faults = 0;  ///< a bit for each sensor::Fault that the estimators see
  std::uint8_t resets = 0;   ///< restarts and own steps since the start, modulo 256
  sensor::ResetCause reset_cause = sensor::ResetCause::kPowerOn;  ///< cause of the last one
};

/// `Estimators`: node::Estimators<...>, the last of which estimate() speaks of. `kRecords`: records kept for an
/// advance.
template <class Estimators, std::size_t kRecords = 32>
class Localizer {
 public:
  /// The parameters outlive the object.
  explicit Localizer(const param::Parameters& parameters) : node_(parameters, {}) { start({}); }
  explicit Localizer(const param::Parameters&& parameters) = delete;
  Localizer(const Localizer&) = delete;
  Localizer& operator=(const Localizer&) = delete;

  /// Forgets everything and begins after time t, as a new object does after 0. The first advance() may be at any time.
  void start(base::Micros t) { node_.power_on(t.us != 0 ? t : base::Micros{-1}); }  // 0 means no time to a node
  /// A measurement that was true at `stamp`. `instance` separates sensors of one kind, `sequence` samples of one
  /// sensor that have the same stamp.
  template <sensor::Measurement Payload>
  Admission add(const Payload& payload, base::Micros stamp, std::uint8_t instance = 0, std::uint8_t sequence = 0) {
    const bus::Counters before = node_.counters();
    node_.sample(sensor::sample_of(payload, stamp, instance, sequence));
    const Admission fate = since(before);
    return fate == Admission::kTaken && !Estimators::template kTakes<Payload> ? Admission::kNotUsed : fate;
  }
  /// Fuses what was true until t, and brings the estimate there. A step back or of more than 0.5 s is a jump of time:
  /// the estimators begin anew (ResetCause::kTimeJump).
  void advance(base::Micros t) { node_.tick(t, {}, Receive{estimate_}); }
  [[nodiscard]] const Localization& estimate() const { return estimate_; }
  /// Records that the last advance() made: one for each measurement and each estimator that takes it, in the order of
  /// the stamps. A delayed estimator's come a window late. First come those of the add() calls before it that were too
  /// late.
  [[nodiscard]] std::span<const Record> records() const { return node_.output().records(); }
  /// Records for which there was no room.
  [[nodiscard]] std::size_t records_lost() const { return node_.output().lost(); }

  /// A known landmark, for robots that localise by a map. It counts from the next advance().
  void add_landmark(const estimators::MapEntry& landmark) { node_.map_entry(landmark); }
  /// The pose is known from elsewhere. It counts from the next advance().
  void set_pose(const model::PlanarPose& pose, float sigma_position_m, float sigma_yaw_rad) {
    counter_ = static_cast<std::uint8_t>((counter_ + 1) & 0x0F);
    node_.set_pose(
        {.pose = pose, .sigma_position_m = sigma_position_m, .sigma_yaw_rad = sigma_yaw_rad, .counter = counter_});
  }
  /// Origin of n, and where it comes from.
  [[nodiscard]] const estimators::MapFrame& map_frame() const { return node_.map_frame(); }
  /// Hash of the estimators and their window, to compare two machines or two runs.
  [[nodiscard]] std::uint32_t state_crc() const { return node_.window_crc(); }

 private:
  /// Sink of an epoch of the node.
  struct Receive {
    Localization& to;

    void estimate(std::size_t instance, const estimators::Estimate& e, const estimators::MotionVariance& motion) const {
      if (instance == 0) to.space = {};
      static_cast<estimators::Estimate&>(to) = e;
      to.motion = motion;
    }
    void inertial(std::size_t, const estimators::InertialEstimate& e) const {
      if (!e.valid) return;
      using State = nav::InsState;
      const auto block = [&e](int first) { return nav::predicted_block(e.p, e.ahead, first); };
      const State& x = e.state;
      attitude(0, estimators::attitude_of(x, true));
      to.space.valid = true;
      to.space.z = x.z;
      to.space.v_n_mps = {x.v_n_mps(0), x.v_n_mps(1), x.v_n_mps(2)};
      to.space.position_m2 = block(State::kPosition);
      to.space.velocity_m2ps2 = block(State::kVelocity);
      to.space.attitude_rad2 = block(State::kAttitude);
    }
    void attitude(std::size_t, const estimators::AttitudeEstimate& e) const {
      if (!e.valid || to.space.valid) return;
      to.space.attitude_valid = true;
      to.space.heading_valid = e.heading_valid;
      to.space.q_nb = e.q_nb;
    }
    void status(const bus::Summary& s) const {
      to.mode = s.mode;
      to.faults = s.faults;
      to.resets = s.resets;
      to.reset_cause = s.cause;
    }
  };

  [[nodiscard]] Admission since(const bus::Counters& before) const {
    const bus::Counters& now = node_.counters();
    if (now.too_late != before.too_late) return Admission::kTooLate;
    if (now.too_early != before.too_early) return Admission::kTooEarly;
    if (now.duplicate != before.duplicate) return Admission::kDuplicate;
    if (now.out_of_range != before.out_of_range) return Admission::kOutOfRange;
    if (now.timeline_full != before.timeline_full) return Admission::kFull;
    if (now.overload != before.overload) return Admission::kOverload;
    return Admission::kTaken;
  }

  node::Node<node::WithoutBus<Estimators, kRecords>> node_;
  Localization estimate_;
  std::uint8_t counter_ = 0;  ///< number of the last set_pose()
};

}  // namespace tetap

#pragma GCC diagnostic pop
