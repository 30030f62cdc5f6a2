// SPDX-License-Identifier: Apache-2.0
// Faults of an inertial robot's sensors: a bias of the IMU that jumps, and offsets of receiver, wheels and headings.
#pragma once

#include "tetap/base/multiply_add.hpp"
#include "tetap/model/direction.hpp"
#include "tetap/model/gnss_fix_3d.hpp"
#include "tetap/model/gnss_velocity_3d.hpp"
#include "tetap/model/wheel_speed.hpp"
#include "tetap/nav/ins_covariance.hpp"
#include "tetap/trust/fault_bank.hpp"

#include <type_traits>

namespace tetap::trust {

struct InertialFaults {
  static constexpr int kErrors = nav::InsState::kErrors;
  enum Device : std::uint8_t { kImu, kReceiver, kWheels, kCompass };
  static constexpr std::size_t kFix = 6, kVelocity = 9, kForward = 12, kHeading = 13;

  /// Largest sizes (rad/s, m/s^2, m, m/s, m/s, rad): what the sensors of these robots show at all. Each fault begins
  /// once an hour.
  static constexpr std::array<FaultRow, 14> kRows = [] {
    std::array<FaultRow, 14> rows;
    const auto three = [&rows](std::size_t first, const FaultRow& like, int jumps) {
      for (std::size_t i = 0; i < 3; ++i) {
        rows[first + i] = like;
        rows[first + i].code = static_cast<std::uint8_t>(first + i);
        rows[first + i].jumps = static_cast<std::int8_t>(jumps < 0 ? -1 : jumps + static_cast<int>(i));
      }
    };
    three(0, {.largest = 0.5F}, nav::InsState::kGyroBias);
    three(3, {.largest = 5}, nav::InsState::kAccelBias);
    three(kFix, {.device = kReceiver, .largest = 20}, -1);
    three(kVelocity, {.device = kReceiver, .largest = 5}, -1);
    rows[kForward] = {.code = kForward, .device = kWheels, .largest = 3};
    rows[kHeading] = {.code = kHeading, .device = kCompass, .largest = 1};
    return rows;
  }();

  template <class Measurement>
  [[nodiscard]] static constexpr Shown shown_by() {
    if constexpr (std::is_same_v<Measurement, model::GnssFix3d>) return {kFix, 3};
    if constexpr (std::is_same_v<Measurement, model::GnssVelocity3d>) return {kVelocity, 3};
    if constexpr (std::is_same_v<Measurement, model::WheelSpeed>) return {kForward, 1};
    if constexpr (std::is_same_v<Measurement, model::DirectionMeasurement>) return {kHeading, 1};
    return {};
  }
  /// phi <- F phi, by the step that moves P (nav/ins_covariance.hpp).
  [[gnu::always_inline]] static void predict(const FaultRow&, std::array<float, kErrors>& phi,
                                             const nav::InsCovarianceStep<float>& step) {
    constexpr std::size_t kV = nav::InsState::kVelocity, kT = nav::InsState::kAttitude, kA = nav::InsState::kAccelBias,
                          kG = nav::InsState::kGyroBias;
    const nav::Matrix3& r_dt = step.r_dt;
    const nav::Vector3& dv = step.dv_n_mps;
    const auto turned = [&](int r, std::size_t from) {
      const float two = base::add_product(r_dt(r, 0) * phi[from], float{r_dt(r, 1)}, phi[from + 1]);
      return base::add_product(two, float{r_dt(r, 2)}, phi[from + 2]);
    };
#pragma GCC unroll 3
    for (std::size_t r = 0; r < 3; ++r) phi[r] = base::add_product(phi[r], step.dt_s, phi[kV + r]);
#pragma GCC unroll 3
    for (std::size_t r = 0; r < 3; ++r) {
      const std::size_t a = r == 2 ? 0 : r + 1, b = r == 0 ? 2 : r - 1;  // theta x dv
      const float by_turn =
          base::subtract_product(phi[kT + a] * dv(static_cast<int>(b)), phi[kT + b], float{dv(static_cast<int>(a))});
      phi[kV + r] += by_turn - turned(static_cast<int>(r), kA);
    }
#pragma GCC unroll 3
    for (std::size_t r = 0; r < 3; ++r) phi[kT + r] -= turned(static_cast<int>(r), kG);
    if (!(step.keep_b_a < 1.0F) && !(step.keep_b_g < 1.0F)) return;
    for (std::size_t r = 0; r < 3; ++r) {
      phi[kA + r] *= step.keep_b_a;
      phi[kG + r] *= step.keep_b_g;
    }
  }
};

/// The bank beside nav::Ins.
class InertialBank : public FaultBank<InertialFaults> {
 public:
  template <class Measurement>
  [[nodiscard]] Pass<static_cast<std::size_t>(Measurement::kDimension)> pass(const Measurement& z, const auto& h) {
    return {*this, z, h};
  }
  /// The tilt errors turn with a corrected heading, as those of P do.
  void turn_tilt(float up_rad) {
    constexpr std::size_t kEast = nav::InsState::kAttitude, kNorth = kEast + 1;
    const base::SinCos by = base::sincos(up_rad);
    carry([&by](Errors& phi) {
      const float east = phi[kEast], north = phi[kNorth];
      phi[kEast] = by.cos * east - by.sin * north;
      phi[kNorth] = by.cos * north + by.sin * east;
    });
  }
};

}  // namespace tetap::trust
