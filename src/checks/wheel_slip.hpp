// SPDX-License-Identifier: Apache-2.0
// Which of two wheels rolls, and which only turns: each against what the gyroscope and the filter's velocity say its
// rim should do, and both against GNSS velocity, which is of the ground. Encoders against what other sensors say of the
// body: Ward and Iagnemma 2008, IEEE T-RO 24(4).
#pragma once

#include "base/time.hpp"
#include "param/parameters.hpp"

#include <cstdint>

namespace tetap::checks {

class WheelSlip {
 public:
  enum class Slip : std::uint8_t { kNone, kLeft, kRight, kBoth };

  struct Wheels {
    float left_mps = 0;
    float right_mps = 0;
  };
  /// Of the middle of the axle, from anything but these wheels.
  struct Motion {
    float forward_mps = 0;
    float sigma_mps = 0;
    float turn_mps = 0;  ///< yaw rate times track: how much faster the right rim has to be than the left
  };

  Slip hear(const Wheels& w, const Motion& m, base::Micros stamp, const param::InertialParameters& n) {
    if (!(n.slip_mps > 0)) return Slip::kNone;
    const base::Micros since = stamp - heard_;
    heard_ = stamp;
    const float dt_s = since.us > 0 && since < kGap ? base::seconds(since) : 0.0F;
    const float share = dt_s / (kSmooth_s + dt_s);
    off_left_mps_ += share * (w.left_mps - m.forward_mps + 0.5F * m.turn_mps - off_left_mps_);
    off_right_mps_ += share * (w.right_mps - m.forward_mps - 0.5F * m.turn_mps - off_right_mps_);

    const float most = allowed(m.forward_mps, n), more = most + 3.0F * m.sigma_mps;
    const float apart = magnitude(off_right_mps_ - off_left_mps_);
    const float both = 0.5F * magnitude(off_right_mps_ + off_left_mps_);
    if (apart > most || both > more) {
      slip_ = which(apart > most, more);
      seen_ = stamp;
    } else if (ground_ >= kTwice) {
      slip_ = Slip::kBoth;
      seen_ = stamp;
    } else if (apart > 0.5F * most || both > 0.5F * more) {
      seen_ = stamp;  // not over yet, if there was any
    } else if (stamp - seen_ > kClear) {
      slip_ = Slip::kNone;
    }
    return slip_;
  }

  /// What GNSS says the speed is, and what wheels said last. True when from now on it contradicts them, so that what
  /// was taken from them is as doubtful as they are: that is, for the second time in a row.
  bool ground(float forward_mps, float rolled_mps, float sigma_mps, base::Micros stamp,
              const param::InertialParameters& n) {
    if (!(n.slip_mps > 0) || stamp - heard_ > kGap) return false;
    const bool off = magnitude(rolled_mps - forward_mps) > allowed(forward_mps, n) + 3.0F * sigma_mps;
    if (!off || stamp - grounded_ > kGroundGap) ground_ = 0;
    grounded_ = stamp;
    if (!off || ground_ >= kTwice) return false;
    return ++ground_ == kTwice && slip_ == Slip::kNone;
  }

  [[nodiscard]] Slip slip() const { return slip_; }
  /// Begins anew: what was off is what the filter had wrong.
  void forget() { *this = {}; }

  template <class Sink>
  void hash_state(Sink&& sink) const {
    sink(off_left_mps_);
    sink(off_right_mps_);
    for (const base::Micros at : {heard_, seen_, grounded_}) sink(at.us);
    sink(static_cast<std::uint32_t>(static_cast<unsigned>(slip_) | static_cast<unsigned>(ground_) << 8U));
  }

 private:
  static constexpr base::Micros kGap{500'000}, kClear{300'000}, kGroundGap{2'500'000};
  static constexpr float kSmooth_s = 0.1F;
  static constexpr std::uint8_t kTwice = 2;

  static float magnitude(float x) { return x < 0 ? -x : x; }
  /// What wheels may be off: a fixed part, and four sigma of the slip they always have.
  static float allowed(float forward_mps, const param::InertialParameters& n) {
    return n.slip_mps + 4.0F * n.slip_share * magnitude(forward_mps);
  }
  /// The wheel that is farther off; both, if the other is not where it should be either, or they do not differ.
  [[nodiscard]] Slip which(bool differ, float most) const {
    const float left = magnitude(off_left_mps_), right = magnitude(off_right_mps_);
    if (!differ || (left > most && right > most)) return Slip::kBoth;
    return left > right ? Slip::kLeft : Slip::kRight;
  }

  float off_left_mps_ = 0, off_right_mps_ = 0;
  base::Micros heard_, seen_, grounded_;
  Slip slip_ = Slip::kNone;
  std::uint8_t ground_ = 0;  ///< times in a row that GNSS contradicted
};

}  // namespace tetap::checks
