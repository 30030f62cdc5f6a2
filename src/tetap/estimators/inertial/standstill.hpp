// SPDX-License-Identifier: Apache-2.0
// Standstill: encoders that have not turned for half a second. Without them, it is an IMU that shows nothing but its
// own noise while GNSS velocity is none in the mean. Then the velocity is zero (zero-velocity update), and the
// gyroscope shows its bias (zero-rate update). Errors of a standstill may be the same all the time. The velocity is
// therefore fused only while the filter knows less. Each mean of the gyroscope has samples of its own.
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/checks/persistence.hpp"
#include "tetap/estimators/inertial/filter_view.hpp"
#include "tetap/estimators/inertial/work_budget.hpp"
#include "tetap/model/zero_rate.hpp"
#include "tetap/model/zero_velocity.hpp"

#include <utility>

namespace tetap::estimators {

class Standstill {
 public:
  static constexpr base::Micros kEvery{100'000};  ///< period of zero-velocity updates
  static constexpr float kGateScale = 4.0F;

  /// One sample of the gyroscope.
  void update_rate(const nav::Vector3& rate_b_radps, float dt_s) {
    mean_.s += dt_s;
    mean_.rate_radps += (rate_b_radps - mean_.rate_radps) * (dt_s / (mean_.s > dt_s ? mean_.s : dt_s));
  }
  /// GNSS velocity, averaged while the IMU is calm.
  void update_ground(const nav::Vector3& v_n_mps) {
    if (!calm_.holds()) return;
    if (grounds_ < kMeanOf) ++grounds_;
    const auto share = 1.0F / static_cast<float>(grounds_);
    ground_mps_ += (v_n_mps - ground_mps_) * share;
  }
  /// IMU samples are missing: means begin anew.
  void interrupt() {
    restart_means();
    calm_.reset();
  }
  void restart_means() { mean_.s = waiting_.s = 0; }

  /// True: the robot stands at the filter's time.
  [[nodiscard]] bool detect(const FilterView& filter, bool calm) {
    const param::InertialParameters& n = filter.parameters().inertial;
    pending_ = false;
    calm_.update(calm && !filter.imu_missing(), filter.stamp());
    if (calm_.count() == 1) grounds_ = 0;
    const bool quiet = filter.encoders_count() ? filter.encoders_rest() : rests(filter);
    const bool stands = quiet && filter.turn_b_radps().squaredNorm() <= n.still_radps * n.still_radps;
    if (!stands) {
      restart_means();
      velocity_at_ = filter.stamp() - kEvery;
    }
    return stands;
  }
  /// 1 sigma of a standstill's velocity.
  [[nodiscard]] static float sigma_mps(const FilterView& filter) {
    const param::InertialParameters& n = filter.parameters().inertial;
    return filter.encoders_count() ? n.still_mps : n.still_gnss_mps;
  }
  /// A zero-velocity update is due and fits into the tick.
  [[nodiscard]] bool velocity_due(const FilterView& filter, const WorkBudget& budget) {
    const base::Micros since = filter.stamp() - velocity_at_;
    if (since < kEvery) return false;
    const float sigma = sigma_mps(filter), least = sigma * sigma;
    const nav::Ins::Covariance& p = filter.p();
    const bool news = p(nav::InsState::kVelocity, nav::InsState::kVelocity) > least ||
                      p(nav::InsState::kVelocityNorth, nav::InsState::kVelocityNorth) > least ||
                      p(nav::InsState::kVelocityUp, nav::InsState::kVelocityUp) > least;
    if (news && !budget.allows_due(since, kEvery)) {
      pending_ = true;
      return false;
    }
    velocity_at_ = filter.stamp();
    return news;
  }
  /// A zero-rate update is due and fits into the tick. A turn of less than one count is not seen at once, so a mean is
  /// fused when standing has lasted a little longer.
  [[nodiscard]] bool rate_due(const FilterView& filter, const WorkBudget& budget) {
    constexpr float kMean_s = 0.5F, kLonger_s = 0.25F;
    if (mean_.s < kLonger_s || filter.imu_missing()) return false;
    if (waiting_.s > 0.0F) {
      if (budget.allows(WorkBudget::kMeasurement) || mean_.s >= kMean_s) return true;
      pending_ = true;
      return false;
    }
    if (mean_.s >= kMean_s) waiting_ = std::exchange(mean_, {});
    return false;
  }
  struct ZeroRateUpdate {
    model::ZeroRate model;
    nav::Vector3 shared;  ///< covariance of the mean's noise with the heading's, per bias
    nav::Vector3 wander;  ///< variance of the biases' walk since the mean
  };
  [[nodiscard]] ZeroRateUpdate take_rate(const nav::Ins& ins, const param::InertialParameters& n);
  /// An update is due and waits for the next tick.
  [[nodiscard]] bool pending() const { return pending_; }

  static constexpr auto members(auto& self) {
    return base::members(self.mean_, self.waiting_, self.calm_, self.velocity_at_, self.ground_mps_, self.grounds_,
                         self.pending_);
  }

 private:
  struct Mean {
    nav::Vector3 rate_radps = nav::Vector3::Zero();
    float s = 0;  ///< over so much standing
  };

  /// The IMU has been calm for a second, as at constant velocity, and the mean of GNSS velocities since is none.
  [[nodiscard]] bool rests(const FilterView& filter) const {
    const float most = filter.parameters().inertial.still_gnss_mps;
    constexpr base::Micros kLong{1'000'000};
    return calm_.held_for(filter.stamp()) > kLong && grounds_ >= 5 && filter.velocity_recent() &&
           ground_mps_.squaredNorm() < most * most;
  }

  static constexpr std::uint8_t kMeanOf = 25;  ///< velocities whose mean shows a standstill

  Mean mean_;                                       ///< mean of the gyroscope since the last one
  Mean waiting_;                                    ///< last mean, kept until it is known that the robot still stands
  checks::Persistence calm_;                        ///< IMU samples in a row without motion
  base::Micros velocity_at_;                        ///< last zero-velocity update; while moving, such that it is due
  nav::Vector3 ground_mps_ = nav::Vector3::Zero();  ///< mean GNSS velocity while calm
  std::uint8_t grounds_ = 0;                        ///< velocities in that mean
  bool pending_ = false;                            ///< an update is due and waits for the next tick
};

/// The mean is the gyroscope's bias and its noise, and by the same noise the heading is wrong by now. The two are
/// correlated: Bar-Shalom, Li, Kirubarajan 2001, sec. 8.3, measurement noise correlated with process noise. The update
/// turns the heading back to what it was, and an hour at rest costs it next to nothing. The accelerometer has seen part
/// of the tilt from that noise already: there the measurement counts for less instead. The mean is of some time ago.
/// The walk of the bias since is in its variance, and not in the mean. The part of the heading that came of that walk
/// is left out: it is smaller by a thousand.
[[gnu::noinline]] inline Standstill::ZeroRateUpdate Standstill::take_rate(const nav::Ins& ins,
                                                                          const param::InertialParameters& n) {
  const float density = n.gyro_radps_rthz * n.gyro_radps_rthz;
  const nav::Vector3 up_b = ins.x.q_nb.z_seen();
  // Unless another measurement knows the heading so well that the noise is not in it any more.
  const float shared = ins.p(nav::InsState::kYaw, nav::InsState::kYaw) > 4.0F * density * waiting_.s ? density : 0.0F;
  const float walk = n.gyro_bias_radps2_rthz * n.gyro_bias_radps2_rthz * (0.5F * waiting_.s + mean_.s);
  ZeroRateUpdate due;
  nav::Vector3 growth;
  for (int i = 0; i < 3; ++i) {
    const float half = 0.5F * ins.p(nav::InsState::kGyroBias + i, nav::InsState::kGyroBias + i);
    due.wander(i) = walk < half ? walk : half;
    due.shared(i) = shared * up_b(i);
    growth(i) = 4.0F - 3.0F * up_b(i) * up_b(i);
  }
  // A robot that stands turns with the Earth.
  const nav::Vector3 still_b = waiting_.rate_radps - ins.x.q_nb.conjugate().rotate(ins.earth.rate_n_radps);
  due.model = {.gyro_b_radps = still_b, .sigma_radps = base::sqrt(density / waiting_.s), .variance_factor = growth};
  waiting_.s = 0;
  return due;
}

}  // namespace tetap::estimators
