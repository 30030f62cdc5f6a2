// SPDX-License-Identifier: Apache-2.0
// Inertial navigation as an error-state Kalman filter (Sola 2017, sec. 5-7; Groves 2013, ch. 14): state prediction per
// increment, covariance prediction whenever the caller wants one, measurements through the update all filters share.
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/base/trig.hpp"
#include "tetap/filter/sparse_update.hpp"
#include "tetap/filter/state.hpp"
#include "tetap/nav/gyro_scale_consider.hpp"
#include "tetap/nav/ins_covariance.hpp"
#include "tetap/nav/strapdown.hpp"

#include <algorithm>

namespace tetap::nav {

/// One sigma of what drives the errors. A time constant of zero makes the bias a random walk.
struct InsNoise {
  float gyro_radps_rthz = 5e-5F;        ///< angle random walk, rad/s/sqrt(Hz)
  float accel_mps2_rthz = 7e-4F;        ///< velocity random walk, m/s^2/sqrt(Hz)
  float gyro_bias_radps2_rthz = 1e-6F;  ///< bias random walk, rad/s^2/sqrt(Hz)
  float accel_bias_mps3_rthz = 1e-4F;   ///< m/s^3/sqrt(Hz)
  float gyro_bias_time_s = 0;
  float accel_bias_time_s = 0;
  float gyro_scale = 0;    ///< how wrong the gyroscope's scale may be, as a share of every turn
  float motion_sigma = 3;  ///< sigmas of the accelerometer's noise beyond which its readings are motion
};

/// Corrections of the velocity by measurements, summed, and the variances of that sum: of both level axes, and along
/// up. Corrections are independent of each other, and each has the variance that its measurement takes out of P
/// (Kailath 1968).
struct VelocityCorrection {
  float east_mps = 0, north_mps = 0, up_mps = 0;
  float level_m2ps2 = 0, up_m2ps2 = 0;

  /// Square of the sum in the level plane [m2/s2].
  [[nodiscard]] float level2() const { return east_mps * east_mps + north_mps * north_mps; }
  void clear_level() { east_mps = north_mps = level_m2ps2 = 0; }
  void clear_up() { up_mps = up_m2ps2 = 0; }
  /// Keeps a share of the sums, and its square of their variances.
  void fade(float keep) {
    east_mps *= keep;
    north_mps *= keep;
    level_m2ps2 *= keep * keep;
    up_mps *= keep;
    up_m2ps2 *= keep * keep;
  }
};

/// Hypotheses that go along with the filter's errors: none. Others move with every step and turn as P does, and watch
/// every update.
struct NoFaults {
  [[gnu::always_inline]] static void predict(const InsCovarianceStep<float>&) {}
  [[gnu::always_inline]] static void turn_tilt(float) {}
  template <class Measurement>
  [[gnu::always_inline]] static filter::Unwatched pass(const Measurement&, const auto&) {
    return {};
  }
};

struct InsCounters {
  std::uint16_t held = 0;         ///< time for which the velocity is held in the body, in 0.1 ms
  std::uint16_t conditioned = 0;  ///< times that the covariance had to be put right
};

class Ins {
 public:
  static constexpr int kErrors = InsState::kErrors;
  using Covariance = filter::Symmetric<float, kErrors>;

  InsState x{};
  Covariance p = Covariance::diagonal({1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1});
  InsNoise noise{};
  Earth earth{};
  float vibration = 1;  ///< scales the noise density of gyroscope and accelerometer
  /// Known to stand: what its accelerometer shows beside gravity is no motion, however much it trembles.
  bool stands = false;
  /// By the last increment, for what is true a little later than the state; none where there was none.
  Vector3 accel_n_mps2 = Vector3::Zero();

  /// Corrections of late: whoever tests them lets them fade.
  VelocityCorrection corrected{};

  /// Part of the state's time that the covariance does not have yet.
  [[nodiscard]] float pending_s() const { return pending_.dt_s; }

  /// Moves the state; the covariance waits for predict_covariance(). Whatever is not accepted changes nothing: the
  /// caller has a gap in time, to be bridged with predict_without_imu().
  [[nodiscard]] ImuVerdict predict(const ImuIncrement& imu) {
    const ImuVerdict verdict = imu.check();
    if (verdict != ImuVerdict::kAccepted) return verdict;
    if (!(x.v_n_mps.squaredNorm() < kMostSpeed_mps * kMostSpeed_mps)) return ImuVerdict::kDiverged;
    const StrapdownStep step = strapdown(x, imu, earth);
    pending_.dt_s += step.dt_s;
    pending_.dv_n_mps += step.dv_n_mps;
    pending_.r_dt += step.r_nb * step.dt_s;
    pending_.shown_rad += step.r_nb.row(2).dot(imu.dtheta_b_rad);
    accel_n_mps2 = step.dv_n_mps / step.dt_s;
    accel_n_mps2 -= earth.gravity_mps2 * earth.up_n;
    return verdict;
  }

  /// Brings the covariance to the state's time: after every increment, or once for several (up to some 50 ms; the
  /// measurement that comes needs it).
  template <class Faults = NoFaults>
  void predict_covariance(Faults&& faults = {}) {
    if (!(pending_.dt_s > 0.0F)) return;
    InsCovarianceStep<float> step =
        noise_over(pending_, pending_.dt_s, turned_.turn(pending_turn_rad(), noise.gyro_scale));
    if (step.keep_b_a < 1.0F) x.b_a_mps2 *= step.keep_b_a;
    if (step.keep_b_g < 1.0F) x.b_g_radps *= step.keep_b_g;
    if (noise.motion_sigma > 0.0F) shrink_motion(step);
    const auto passed = static_cast<std::uint16_t>(pending_.dt_s < 1.0F ? pending_.dt_s * kHeldPerS : kHeld);
    counters_.held = counters_.held > passed ? static_cast<std::uint16_t>(counters_.held - passed) : std::uint16_t{0};
    inflate_vertical_bias(step.dt_s);
    nav::predict_covariance(p, step);
    faults.predict(step);
    pending_ = {};
    maintain();
  }

  /// The step that would bring the covariance to the time of `present`, a state carried on from x by ahead_s. The step
  /// is in the navigation frame, turned about as `present` is. Noise of the sensor counts as motion here (see
  /// motion_sigma).
  [[nodiscard, gnu::always_inline]] InsCovarianceStep<float> step_to(const InsState& present, float ahead_s) const {
    // Twice the vertical part of present q_nb times x.q_nb's inverse: x was carried there, so their signs agree.
    const Quaternion &to = present.q_nb, &from = x.q_nb;
    const float half_rad = (to.z * from.w - to.w * from.z) + (to.y * from.x - to.x * from.y);
    InsCovarianceStep<float> step = noise_over(
        pending_, pending_.dt_s + ahead_s, turned_.would_add(pending_turn_rad() + 2.0F * half_rad, noise.gyro_scale));
    step.dv_n_mps += present.v_n_mps - x.v_n_mps;
    step.dv_n_mps += (earth.gravity_mps2 * ahead_s) * earth.up_n;
    step.r_dt += present.q_nb.matrix() * ahead_s;
    return step;
  }

  /// Sets the position in the plane (1 sigma per axis, metres), which is then correlated with nothing; all other
  /// states stay.
  void place(const base::Anchored& east, const base::Anchored& north, float sigma_m) {
    x.x = east, x.y = north;
    for (const int i : {InsState::kPosition, InsState::kPosition + 1}) reset(i, sigma_m * sigma_m);
    condition(p, condition_monitor_);
  }

  /// A gap in the increments: the velocity is kept, and the noise is that of a robot that may have done anything of
  /// this size.
  template <class Faults = NoFaults>
  void predict_without_imu(base::Micros gap, float sigma_mps2, float sigma_radps, Faults&& faults = {}) {
    predict_covariance(faults);
    for (std::int64_t left_us = gap.us < kMostGap_us ? gap.us : kMostGap_us; left_us > 0; left_us -= kGapStep_us) {
      const float dt_s = base::seconds({left_us < kGapStep_us ? left_us : kGapStep_us});
      move(x.x, x.v_n_mps(0) * dt_s);
      move(x.y, x.v_n_mps(1) * dt_s);
      move(x.z, x.v_n_mps(2) * dt_s);
      const InsCovarianceStep<float> step{.dt_s = dt_s,
                                          .dv_n_mps = pending_.dv_n_mps,
                                          .var_v = sigma_mps2 * sigma_mps2 * dt_s * kGapStep_s,
                                          .var_theta = sigma_radps * sigma_radps * dt_s * kGapStep_s};
      nav::predict_covariance(p, step);
      faults.predict(step);
      pending_.dv_n_mps = Vector3::Zero();
    }
    accel_n_mps2 = Vector3::Zero();
    // A few lost samples add little: the watch over P, which goes on at every step, is enough.
    const bool usual = sigma_mps2 * sigma_mps2 <= kUsualGap && sigma_radps * sigma_radps <= kUsualGap;
    if (gap.us > kShortGap_us || !usual) condition(p, condition_monitor_);
  }
  /// Turn of the body in such a gap, if something else shows it; in the navigation frame.
  void turn_without_imu(const Quaternion& turn) {
    x.q_nb = (turn * x.q_nb).renormalised();
    const Vector3 v_n_mps = turn.rotate(x.v_n_mps);
    move_errors(v_n_mps - x.v_n_mps);
    x.v_n_mps = v_n_mps;
  }

  /// Joint gate, then sequential scalar updates; a measurement that is not accepted changes nothing. The covariance is
  /// brought up to date first.
  template <filter::MeasurementModel<InsState> Measurement, class Faults = NoFaults>
  [[nodiscard]] filter::Innovation<float, Measurement::kDimension> update(const Measurement& measurement, float gate,
                                                                          Faults&& faults = {}) {
    if (pending_.dt_s > 0.0F) predict_covariance(faults);
    return update_now(measurement, gate, faults);
  }

  /// Begins anew; whatever was pending is forgotten. False, and nothing has changed, when the state is no number; a
  /// covariance is put right.
  bool start(const InsState& at, const Covariance& covariance) {
    if (!at.finite()) return false;
    p = covariance;
    return start_with_p(at);
  }
  /// Starts with independent errors; nothing of the covariance's size passes over the stack.
  bool start(const InsState& at, const std::array<float, InsState::kErrors>& variances) {
    if (!at.finite()) return false;
    for (int c = 0; c < InsState::kErrors; ++c) {
      for (int r = 0; r < c; ++r) p(r, c) = 0;
      p(c, c) = variances[static_cast<std::size_t>(c)];
    }
    return start_with_p(at);
  }

  /// One error may be larger than the covariance has it, by this variance.
  void inflate(int error, float variance) { p(error, error) += variance; }
  /// Three errors from `first` on: that along the plumb line (of the attitude, the heading) has so much more variance.
  void inflate_up(int first, float variance) {
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j <= i; ++j) p(first + i, first + j) += variance * earth.up_n(i) * earth.up_n(j);
  }
  /// One cause may have moved position, velocity and attitude by `by`, 1 sigma: P += by by^T over these nine.
  void inflate_along(const std::array<float, 9>& by) {
    for (int i = 0; i < 9; ++i)
      for (int j = 0; j <= i; ++j) p(i, j) += by[static_cast<std::size_t>(i)] * by[static_cast<std::size_t>(j)];
  }
  /// One error is no longer correlated with anything, and has this variance; recondition() after the last one.
  void reset(int error, float variance) {
    for (int j = 0; j < kErrors; ++j) p(error, j) = 0.0F;
    p(error, error) = variance;
  }
  void recondition() { condition(p, condition_monitor_); }
  /// The state takes a correction that its covariance has already, and the latter is looked at from end to end.
  void take(const InsState::Error& dx) {
    x.correct(dx);
    condition(p, condition_monitor_);
  }

  /// Update by the gyroscope's mean over a standstill whose noise is also in the heading. `shared` is the covariance of
  /// the two per axis of the bias. `wander` is the variance of each bias's walk since the mean (Bar-Shalom, Li,
  /// Kirubarajan 2001, sec. 8.3). The covariance is up to date.
  template <filter::MeasurementModel<InsState> Measurement, class Faults = NoFaults>
  [[nodiscard]] filter::Innovation<float, Measurement::kDimension> update_shared_noise(
      const Measurement& measurement, float gate, const Vector3& shared, const Vector3& wander, Faults&& faults = {}) {
    constexpr int kYaw = InsState::kAttitude + 2, kBias = InsState::kGyroBias;
    for (int i = 0; i < 3; ++i) {
      p(kBias + i, kBias + i) -= wander(i);
      p(kYaw, kBias + i) -= shared(i);
    }
    auto result = update(measurement, gate, faults);
    for (int i = 0; i < 3; ++i) {
      p(kYaw, kBias + i) += shared(i);
      p(kBias + i, kBias + i) += wander(i);
    }
    return result;
  }

  static constexpr auto members(auto& self) {
    return base::members(self.x, base::in_turns_of<2>(self.p), base::in_turns(self.noise), base::in_turns(self.earth),
                         self.vibration, self.stands, self.accel_n_mps2, self.corrected, self.pending_, self.turned_,
                         self.condition_monitor_, self.counters_);
  }

  /// Variance of the velocity in the level plane, of both axes [m2/s2].
  [[nodiscard]] float level_m2ps2() const {
    constexpr int kEast = InsState::kVelocity, kNorth = kEast + 1;
    return p(kEast, kEast) + p(kNorth, kNorth);
  }
  /// How often the covariance had to be put right (see condition()).
  [[nodiscard]] std::uint32_t conditioned() const { return counters_.conditioned; }

 private:
  /// Apart from the prediction, so that the two are not on the stack together.
  template <class Measurement, class Faults>
  [[gnu::noinline]] filter::Innovation<float, Measurement::kDimension> update_now(const Measurement& measurement,
                                                                                  float gate, Faults& faults) {
    constexpr int kM = Measurement::kDimension, kYaw = InsState::kAttitude + 2;
    [[maybe_unused]] const float yaw_rad2 = p(kYaw, kYaw);
    corrected.up_m2ps2 += p(InsState::kVelocityUp, InsState::kVelocityUp);
    corrected.level_m2ps2 += level_m2ps2();  // not kept beside: this path is the deepest on the stack
    filter::SparseUpdate<float, kErrors, kM> result;
    constexpr int kColumns = static_cast<int>(Measurement::kTouches.size());
    bool rest = !filter::Direct<Measurement> || kColumns > kM;
    if constexpr (requires { measurement.has_rest(); }) rest = measurement.has_rest();
    if (rest) {
      filter::Linearised<float, kM, kColumns> at;
      if constexpr (requires { measurement.linearised(x); }) {
        at = measurement.linearised(x);
      } else {
        at = {.z_hat = measurement.predict(x), .h = measurement.jacobian(x)};
      }
      auto watch = faults.pass(measurement, at.h);
      filter::sparse_update<Measurement>(p, at.h, measurement.residual(at.z_hat), measurement.noise(), gate, result,
                                         watch);
    } else if constexpr (filter::Direct<Measurement>) {
      direct_update(measurement, gate, result, faults);
    }
    corrected.level_m2ps2 -= level_m2ps2();
    corrected.up_m2ps2 -= p(InsState::kVelocityUp, InsState::kVelocityUp);
    if (result.innovation.verdict != filter::Verdict::kAccepted) return result.innovation;
    // Measurements of biases alone leave the scale's share in the heading; measurements in the body show no heading.
    constexpr bool kObservesHeading = std::any_of(Measurement::kTouches.begin(), Measurement::kTouches.end(),
                                                  [](int touched) { return touched < InsState::kAccelBias; });
    constexpr bool kInBody = requires { measurement.moves; };
    if constexpr (kObservesHeading) turned_.heading_measured(p(kYaw, kYaw) / yaw_rad2);
    bool turned = false;
    if constexpr (kObservesHeading && !kInBody) turned = turn_tilt(result.dx, faults);
    x.correct(result.dx);
    corrected.east_mps += result.dx(InsState::kVelocity);
    corrected.north_mps += result.dx(InsState::kVelocity + 1);
    corrected.up_mps += result.dx(InsState::kVelocityUp);
    if constexpr (kInBody)
      if (measurement.moves) counters_.held = kHeld;
    if (counters_.held > 0) move_errors(result.dx.template segment<3>(InsState::kVelocity));
    if ((result.sharp || turned) && !condition(p, condition_monitor_)) note_conditioned();
    return result.innovation;
  }

  /// Apart from the update with a lever arm, so that the two are not on the stack together.
  template <class Measurement, class Faults>
  [[gnu::noinline]] void direct_update(const Measurement& measurement, float gate,
                                       filter::SparseUpdate<float, kErrors, Measurement::kDimension>& result,
                                       Faults& faults) {
    auto watch = faults.pass(measurement, filter::IdentityJacobian{});
    filter::group_update<Measurement>(p, measurement.residual(measurement.predict(x)), measurement.noise(), gate,
                                      result, watch);
  }

  bool start_with_p(const InsState& at) {
    x = at;
    condition(p, condition_monitor_);
    pending_ = {};
    turned_ = {};
    stands = false;
    counters_.held = 0;
    corrected = {};
    accel_n_mps2 = Vector3::Zero();
    return true;
  }
  static constexpr float kMostSpeed_mps = 1000.0F;
  /// Turns below kLeastTurn_rad leave the tilt; below kSmallTurn_rad rounding is small; above kMostTurn_rad is no
  /// angle.
  static constexpr float kLeastTurn_rad = 5e-4F, kSmallTurn_rad = 0.05F, kMostTurn_rad = 10.0F;
  static constexpr std::int64_t kGapStep_us = 100'000, kMostGap_us = 60'000'000;
  static constexpr float kGapStep_s = 0.1F;
  static constexpr std::int64_t kShortGap_us = 60'000;
  static constexpr float kUsualGap = 1e4F;  ///< square of the largest sigma of a gap that a robot's parameters may have

  /// Motion of the state since the covariance was last predicted.
  struct Pending {
    float dt_s = 0;
    Vector3 dv_n_mps = Vector3::Zero();
    Matrix3 r_dt = Matrix3::Zero();
    float shown_rad = 0;  ///< turn about the vertical, by a gyroscope with its bias
  };

  [[nodiscard]] float pending_turn_rad() const { return pending_.shown_rad - pending_.r_dt.row(2).dot(x.b_g_radps); }

  /// With what drives the errors over dt_s.
  [[nodiscard, gnu::always_inline]] InsCovarianceStep<float> noise_over(const Pending& way, float dt_s,
                                                                        float var_yaw) const {
    const auto variance = [dt_s](float density) { return density * density * dt_s; };
    const auto keep = [dt_s](float time_s) { return time_s > dt_s ? 1.0F - dt_s / time_s : 1.0F; };
    const float more = vibration > 1.0F && vibration < 1e4F ? vibration : 1.0F;
    return {.dt_s = dt_s,
            .dv_n_mps = way.dv_n_mps,
            .r_dt = way.r_dt,
            .var_v = variance(more * noise.accel_mps2_rthz),
            .var_theta = variance(more * noise.gyro_radps_rthz),
            .var_b_a = variance(noise.accel_bias_mps3_rthz),
            .var_b_g = variance(noise.gyro_bias_radps2_rthz),
            .var_yaw = var_yaw,
            .keep_b_a = keep(noise.accel_bias_time_s),
            .keep_b_g = keep(noise.gyro_bias_time_s)};
  }

  /// Measurements in the body show no heading: turned as a whole, the robot's way looks the same. The filter sees it so
  /// as long as its errors of v move with all changes of v, by the IMU and by measurements alike. The error is that of
  /// an invariant filter (Barrau & Bonnabel 2017), the rule that of Huang, Mourikis, Roumeliotis 2010. A leap does not
  /// move them: it is more than float can carry through P. Implements docs/explanation/equations.md (14).
  void move_errors(const Vector3& dv_n_mps) {
    if (dv_n_mps.squaredNorm() < kMostLeap_mps * kMostLeap_mps) pending_.dv_n_mps += dv_n_mps;
  }

  /// Sensor noise taken for acceleration would let the filter see its heading at standstill. Every noisy sample looks
  /// like a known push whose direction was then observed: v gains theta x (dv + noise). The horizontal part of dv in F
  /// shrinks by the share of its energy that noise explains (James & Stein 1961). It does not shrink while v is held in
  /// the body. There the noise is taken back, and every single sample of a gentle curve passes for noise.
  void shrink_motion(InsCovarianceStep<float>& step) const {
    if (counters_.held > 0 && !stands) return;
    const Vector3 rest = (earth.gravity_mps2 * step.dt_s) * earth.up_n;
    const float east = step.dv_n_mps(0) - rest(0), north = step.dv_n_mps(1) - rest(1),
                energy = east * east + north * north;
    const float explained = noise.motion_sigma * noise.motion_sigma * step.var_v;
    const float share = !stands && energy > explained ? 1.0F - explained / energy : 0.0F;
    step.dv_n_mps(0) = rest(0) + share * east;
    step.dv_n_mps(1) = rest(1) + share * north;
    if (stands) step.dv_n_mps(2) = rest(2);
  }

  /// Looks after the condition of P a little at every step: a round takes 121 of them, so what goes wrong is found
  /// within 242. Only when it fails the whole is done at once.
  void maintain() {
    if (condition_monitor_.idle()) return condition_monitor_.begin(p);
    if (condition_monitor_.advance(3) != InsFactor::Progress::kBad) return;
    condition(p, condition_monitor_);
    note_conditioned();
  }

  void note_conditioned() {
    if (counters_.conditioned < 0xFFFF) ++counters_.conditioned;
  }

  /// Tilt and the accelerometer's bias belong together in the body, whatever the heading. The product g x tilt is what
  /// the bias shows, to a thousandth of either. When the heading is corrected, the errors of the tilt turn with it, and
  /// a correction of the tilt is that of before. Otherwise the bias would be seen from two sides that are none, as if
  /// the robot had turned. True where rounding may have cost P its definiteness.
  /// Implements docs/explanation/equations.md (16).
  template <class Faults>
  [[nodiscard]] bool turn_tilt(InsState::Error& dx, Faults& faults) {
    constexpr int kEast = InsState::kAttitude, kNorth = kEast + 1;
    const float up_rad = dx(kNorth + 1), size_rad = base::abs(up_rad), east = dx(kEast);
    if (!(size_rad > kLeastTurn_rad && size_rad < kMostTurn_rad)) return false;
    dx(kEast) -= 0.5F * up_rad * dx(kNorth);  // Exp(up) Exp(tilt), to second order
    dx(kNorth) += 0.5F * up_rad * east;
    faults.turn_tilt(up_rad);
    const bool far = size_rad > kSmallTurn_rad;
    if (far) {
      turn_tilt_far(up_rad);
    } else {
      turn_tilt_near(up_rad);
    }
    return far;
  }
  /// By two shears: the turn, but for half its square, in two thirds of the instructions.
  [[gnu::noinline]] void turn_tilt_near(float up_rad) {
    constexpr int kEast = InsState::kAttitude, kNorth = kEast + 1;
    filter::unroll<0, kErrors>([&](auto j) __attribute__((always_inline)) {
      if constexpr (j != kEast && j != kNorth) {
        p(kNorth, j) += up_rad * p(kEast, j);
        p(kEast, j) -= up_rad * p(kNorth, j);
      }
    });
    const float before = p(kEast, kNorth), between = before + up_rad * p(kEast, kEast);
    p(kNorth, kNorth) += up_rad * (before + between);
    p(kEast, kNorth) = between - up_rad * p(kNorth, kNorth);
    p(kEast, kEast) -= up_rad * (between + p(kEast, kNorth));
  }
  [[gnu::noinline]] void turn_tilt_far(float up_rad) {
    constexpr int kEast = InsState::kAttitude, kNorth = kEast + 1;
    const base::SinCos by = base::sincos(up_rad);
    const float ee = p(kEast, kEast), en = p(kEast, kNorth), nn = p(kNorth, kNorth);
    for (int j = 0; j < kErrors; ++j) {
      const float e = p(kEast, j), n = p(kNorth, j);
      p(kEast, j) = by.cos * e - by.sin * n;
      p(kNorth, j) = by.cos * n + by.sin * e;
    }
    const float s2 = by.sin * by.sin, c2 = by.cos * by.cos, sc = by.sin * by.cos;
    p(kEast, kEast) = c2 * ee - 2.0F * sc * en + s2 * nn;
    p(kNorth, kNorth) = c2 * nn + 2.0F * sc * en + s2 * ee;
    p(kEast, kNorth) = (c2 - s2) * en + sc * (ee - nn);
  }

  /// Second-order effect of a tilt error, which F leaves out. A body levelled by an accelerometer leans by that
  /// sensor's error. Specific force of g/2 (theta_x^2 + theta_y^2) upward passes for bias for as long as the lean
  /// lasts. The mean square, g^2 / 2 (P_xx + P_yy)^2 for like axes, is added every 1.5 s. The time was chosen on
  /// simulated seeds: the filter forgets about as fast as it would learn the lean. Above ten times that nothing is
  /// added, so that a bias that is long unobserved does not walk on. Up is the body's: where the body leans far, the
  /// variance is added in the wrong axis. Implements docs/explanation/equations.md (15).
  void inflate_vertical_bias(float dt_s) {
    constexpr float kMost_rad2 = 0.02F;  // beyond no tilt is small
    constexpr float kOff_mps2 = 6.934F;  // sqrt(g^2 / 2), per rad^2
    constexpr float kBelow = 10, kOver_s = 1.5F;
    constexpr int kTilt = InsState::kAttitude, kUp = InsState::kAccelBias + 2;
    const float tilt_rad2 = p(kTilt, kTilt) + p(kTilt + 1, kTilt + 1);
    const float small = tilt_rad2 < kMost_rad2 ? tilt_rad2 : kMost_rad2;
    const float most = kBelow * kOff_mps2 * kOff_mps2 * (small * small);
    if (p(kUp, kUp) < most) p(kUp, kUp) += most * (dt_s * (1.0F / (kBelow * kOver_s)));
  }

  Pending pending_{};
  GyroScaleConsider turned_{};
  InsFactor condition_monitor_{};
  /// InsCounters::held after a measurement in the body while moving, in 0.1 ms: wheels may slip for a while.
  static constexpr float kHeldPerS = 10'000.0F, kMostLeap_mps = 30;
  static constexpr std::uint16_t kHeld = 50'000;
  InsCounters counters_;
};

}  // namespace tetap::nav
