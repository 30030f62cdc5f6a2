// SPDX-License-Identifier: Apache-2.0
// Turn of the wheels against the gyroscope's, as every planar estimator judges its dead reckoning: a leap names swapped
// or reversed wheels, a difference that lasts makes heading and position uncertain.
#pragma once

#include "tetap/base/math.hpp"
#include "tetap/checks/turn_residual.hpp"
#include "tetap/checks/wheel_turn.hpp"
#include "tetap/estimators/planar/dead_reckoning.hpp"
#include "tetap/filter/update.hpp"

#include <cstdint>

namespace tetap::estimators {

struct TurnCheck {
  checks::WheelTurn wheel_turn;
  checks::TurnResidual residual;

  /// At each sample of the wheels. Returns the variance of the heading by which the two contradict each other [rad^2].
  template <class Motion>
  float update(const Motion& motion, base::Micros stamp, const param::Parameters& n) {
    if (n.gyro.use == 0) return 0.0F;
    wheel_turn.update(motion.wheels_turn_radps(n), motion.gyro_turn_radps(), stamp, n.disagreement);
    const float track_m = n.wheels.drive.track_m;
    if (!(track_m > 0) || !motion.gyro_shows(stamp, n)) return residual.reset();
    const float per_m2 = (n.wheels.drive.noise_left + n.wheels.drive.noise_right) / (track_m * track_m);
    const float variance = per_m2 * base::abs(motion.wheels_forward_mps()) + n.gyro.noise;
    return residual.update(motion.gyro_turn_radps() - motion.wheels_turn_radps(n), variance,
                           n.landmark.gate_scale * filter::chi_square_99(1), stamp);
  }
  /// Variance of the way where one wheel alone made a turn of this variance [m^2].
  [[nodiscard]] static float place_m2(float turned_rad2, const param::Parameters& n) {
    const float track_m = n.wheels.drive.track_m;
    return 0.25F * track_m * track_m * turned_rad2;
  }
  /// Bits of sensor::Fault: wheels that turn otherwise than the gyroscope.
  [[nodiscard]] std::uint16_t faults() const {
    return wheel_turn.refuted() ? 1U << static_cast<unsigned>(sensor::Fault::kWheelSlip) : 0U;
  }
};

}  // namespace tetap::estimators
