// SPDX-License-Identifier: Apache-2.0
// GNSS velocity. A receiver and a filter that contradict each other in direction: either may be wrong, and the filter
// gives way after a while. In speed, where wheels agree with the filter: the receiver is wrong.
#pragma once

#include "estimators/inertial/filter_view.hpp"
#include "estimators/inertial/refusal.hpp"
#include "model/gnss_velocity_3d.hpp"

namespace tetap::estimators {

struct VelocityMeasurement {
  nav::Vector3 v_n_mps = nav::Vector3::Zero();  ///< at the time of the last IMU sample
  nav::Vector3 v_b_mps = nav::Vector3::Zero();  ///< velocity of the middle of the axle, along the body's axes
  float sigma_mps = 0;                          ///< 1 sigma per axis
  bool has_climb = true;                        ///< else the vertical part is the filter's own

  [[nodiscard]] float level_mps() const { return base::sqrt(v_b_mps(0) * v_b_mps(0) + v_b_mps(1) * v_b_mps(1)); }
};

class GnssVelocitySource {
 public:
  using Measurement = VelocityMeasurement;

  /// A receiver's velocity as it came.
  [[nodiscard]] static VelocityMeasurement measurement(const sensor::GnssVelocity& velocity,
                                                       const param::GnssParameters& n) {
    const nav::Vector3 v_n{velocity.v_n_mps[0], velocity.v_n_mps[1], velocity.v_n_mps[2]};
    const float own = base::is_finite(velocity.acc_mps) ? velocity.acc_mps : 0.5F;
    return {.v_n_mps = v_n,
            .sigma_mps = own > n.sigma_velocity_floor_mps ? own : n.sigma_velocity_floor_mps,
            .has_climb = base::is_finite(v_n(2))};
  }
  /// The receiver does not repeat its positions; a frozen receiver's velocities are as old.
  [[nodiscard]] static bool continuing_conditions(const FilterView& filter) { return !filter.position_frozen(); }
  /// Speed against wheels. The innovation gate follows in the update.
  [[nodiscard]] Assessment assess(const VelocityMeasurement& z, const FilterView& filter) {
    const float own = base::abs(filter.forward_mps());
    if (filter.wheels_agree() && base::abs(z.level_mps() - own) > 4.0F * z.sigma_mps + 0.2F * own + 0.5F)
      refused_.postpone(filter.stamp());
    return {};
  }
  void note(base::Micros stamp) { last_ = stamp; }
  [[nodiscard]] static model::GnssVelocity3d model(const VelocityMeasurement& z, const FilterView& filter) {
    const param::GnssParameters& n = filter.parameters().gnss;
    return {.v_n_mps = z.v_n_mps,
            .sigma_horizontal_mps = z.sigma_mps,
            .sigma_vertical_mps = z.has_climb ? 1.5F * z.sigma_mps : kNoClimb_mps,
            .antenna_b_m = {n.antenna_x_b_m, n.antenna_y_b_m, n.antenna_z_b_m},
            .gyro_b_radps = filter.rate_b_radps()};
  }
  /// Without a climb rate the gate is that of the horizontal part.
  [[nodiscard]] static float gate_scale(const VelocityMeasurement& z, const param::GnssParameters& n) {
    return (z.has_climb ? 1.0F : filter::chi_square_99(2) / filter::chi_square_99(3)) * n.gate_scale;
  }
  /// The update's verdict; nu: the innovation.
  void conclude(Assessment& a, const nav::Vector3& nu, const FilterView& filter) {
    count_refusal(refused_, a, Action::kInflateVelocity, filter);
    if (a.action != Action::kInflateVelocity) return;
    a.remedy.innovation_mps = nu;
    a.remedy.position_refused = filter.position_refused(1);
  }
  void begin() { refused_.reset(); }

  [[nodiscard]] const checks::Persistence& refused() const { return refused_; }
  /// A velocity came within one second.
  [[nodiscard]] bool recent(base::Micros at) const { return checks::recent(last_, at, kFresh); }
  [[nodiscard]] bool came_lately(base::Micros at) const { return !checks::older(last_, at, kFresh); }
  [[nodiscard]] bool timed_out(base::Micros at) const { return checks::older(last_, at, kFresh + kFresh); }
  [[nodiscard]] SourceStatus status(base::Micros at) const {
    return timed_out(at) ? SourceStatus{} : status_of(refused_);
  }
  template <class Sink>
  void hash_state(Sink&& sink) const {
    refused_.hash_state(sink);
    sink(last_.us);
  }

 private:
  static constexpr base::Micros kFresh{1'000'000};
  static constexpr float kNoClimb_mps = 1e3F;  ///< sigma of a climb rate that is not there (NMEA has none)

  checks::Persistence refused_;  ///< velocities in a row that were refused
  base::Micros last_;            ///< stamp of the last velocity; 0: none
};

}  // namespace tetap::estimators
