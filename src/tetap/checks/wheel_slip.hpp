// SPDX-License-Identifier: Apache-2.0
// Wheel slip: each of two wheels against the rim speed that gyroscope and filter expect, and both against GNSS velocity
// over ground. Encoders against other sensors of the body: Ward and Iagnemma 2008, IEEE T-RO 24(4).
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/checks/persistence.hpp"
#include "tetap/param/parameters.hpp"

#include <cstdint>

namespace tetap::checks {

class WheelSlip {
 public:
  /// kTurn: both turn less than the gyroscope shows, and Motion::still_mps does not allow that. Their mean is good.
  enum class Slip : std::uint8_t { kNone, kLeft, kRight, kBoth, kTurn };

  struct Wheels {
    float left_mps = 0;
    float right_mps = 0;
  };
  /// Motion of the middle of the axle, from anything but these wheels.
  struct Motion {
    float forward_mps = 0;
    float sigma_mps = 0;
    float turn_mps = 0;                 ///< yaw rate times track: how much faster the right rim has to be than the left
    float still_mps = base::kInfinity;  ///< wheels that rest deny a faster turn
  };

  Slip update(const Wheels& w, const Motion& m, base::Micros stamp, const param::InertialParameters& n) {
    const base::Micros since = stamp - last_;
    last_ = stamp;
    if (!(n.slip_mps > 0)) return Slip::kNone;
    const float dt_s = since.us > 0 && since < kGap ? base::seconds(since) : 0.0F;
    const float share = dt_s / (kSmooth_s + dt_s);
    off_left_mps_ += share * (w.left_mps - m.forward_mps + 0.5F * m.turn_mps - off_left_mps_);
    off_right_mps_ += share * (w.right_mps - m.forward_mps - 0.5F * m.turn_mps - off_right_mps_);

    const float most = allowed(m.forward_mps, n), more = most + 3.0F * m.sigma_mps;
    const float apart = magnitude(off_right_mps_ - off_left_mps_);
    const float both = 0.5F * magnitude(off_right_mps_ + off_left_mps_);
    const bool turns = both < kTurning * apart;
    const bool denied = turns && apart > m.still_mps && ground_contradicts_.count() < kTwice;
    if (denied || (turns && apart > most)) turned_m_ += dt_s * (off_right_mps_ - off_left_mps_);
    if (denied || apart > most || both > more) {
      slip_ = denied ? Slip::kTurn : which(apart > most, more);
      seen_ = stamp;
    } else if (ground_contradicts_.count() >= kTwice) {
      slip_ = Slip::kBoth;
      seen_ = stamp;
    } else if (apart > 0.5F * most || both > 0.5F * more) {
      seen_ = stamp;  // hysteresis: a slip is not over yet
    } else if (older(seen_, stamp, kClear)) {
      slip_ = Slip::kNone;
      turned_m_ = 0;
    }
    return slip_;
  }

  /// Compares the wheels' last speed with GNSS velocity. True at the second contradiction in a row, when no slip was
  /// known. The speeds taken from the wheels until now are then as wrong as the wheels.
  bool update_ground(float forward_mps, float wheels_mps, float sigma_mps, base::Micros stamp,
                     const param::InertialParameters& n) {
    if (!(n.slip_mps > 0) || older(last_, stamp, kGap)) return false;
    const bool off = magnitude(wheels_mps - forward_mps) > allowed(forward_mps, n) + 3.0F * sigma_mps;
    ground_contradicts_.update(off, stamp, kGroundGap);
    return ground_contradicts_.count() == kTwice && mean_holds();
  }

  [[nodiscard]] Slip slip() const { return slip_; }
  /// The mean of both wheels is the forward speed.
  [[nodiscard]] bool mean_holds() const { return slip_ == Slip::kNone || slip_ == Slip::kTurn; }
  /// Way of the right rim past the left one that the gyroscope does not show, since that began. Both are off by the
  /// same, one ahead and one behind, as of a robot that turns: a wheel that spins is off alone.
  [[nodiscard]] float turned_m() const { return turned_m_; }
  /// Stamp of the last wheels; 0: none.
  [[nodiscard]] base::Micros last() const { return last_; }
  void reset() { *this = {}; }

  static constexpr auto members(auto& self) {
    return base::members(self.off_left_mps_, self.off_right_mps_, self.last_, self.seen_, self.ground_contradicts_,
                         self.turned_m_, self.slip_);
  }

 private:
  static constexpr base::Micros kGap{500'000}, kClear{300'000}, kGroundGap{2'500'000};
  static constexpr float kSmooth_s = 0.1F;
  static constexpr float kTurning = 0.25F;  ///< one wheel that spins has a half
  static constexpr std::int32_t kTwice = 2;

  static float magnitude(float x) { return x < 0 ? -x : x; }
  /// Allowed difference: a fixed part, and four sigma of the slip that wheels always have.
  static float allowed(float forward_mps, const param::InertialParameters& n) {
    return n.slip_mps + 4.0F * n.slip_share * magnitude(forward_mps);
  }
  /// The wheel that is farther off; both, where the other one is off too, or they do not differ.
  [[nodiscard]] Slip which(bool differ, float most) const {
    const float left = magnitude(off_left_mps_), right = magnitude(off_right_mps_);
    if (!differ || (left > most && right > most)) return Slip::kBoth;
    return left > right ? Slip::kLeft : Slip::kRight;
  }

  float off_left_mps_ = 0, off_right_mps_ = 0;  ///< low-passed differences from the expected rim speed
  base::Micros last_, seen_;                    ///< stamps of the last wheels, and of the last sign of slip; 0: none
  Persistence ground_contradicts_;              ///< GNSS velocities in a row that contradicted the wheels
  float turned_m_ = 0;
  Slip slip_ = Slip::kNone;
};

}  // namespace tetap::checks
