// SPDX-License-Identifier: Apache-2.0
// YawEstimator's steps: own level and yaw at the IMU's rate, the filter ten times a second, the verdicts.
#pragma once

#include "tetap/nav/yaw_estimator.hpp"

namespace tetap::nav {

inline void YawEstimator::restart(const Quaternion& q) {
  restart();
  const Vector3 up{2.0F * (q.x * q.z - q.w * q.y), 2.0F * (q.y * q.z + q.w * q.x),
                   1.0F - 2.0F * (q.x * q.x + q.y * q.y)};
  const float norm2 = q.norm2();
  if (!(norm2 > 0.99F && norm2 < 1.01F)) return;
  up_b_ = up * (1.5F - 0.5F * up.squaredNorm());
  begin(noise.tilt_rad);
}

[[gnu::noinline]] inline void YawEstimator::begin(float tilt_rad) {
  const auto both = [](float sigma) { return 2.0F * square(sigma); };
  filter_.clear();
  filter_.add_noise(kZ, 1.0F);
  filter_.add_noise(kV, both(kFast_mps));
  filter_.add_noise(kW, both(kGravity * tilt_rad));
  filter_.add_noise(kA, both(noise.accel_bias_mps2));
  filter_.add_noise(kR, both(kGravity * noise.gyro_bias_radps));
  filter_.add_noise(kU, both(noise.gyro_bias_radps));
  pending_ = {};
  heading_ = {1.0F, 0.0F};
  bias_b_radps_ = Vector3::Zero();
  rate_radps_ = wheels_s_ = 0;
  refused_ = fixes_ = 0;
  placed_ = false;
}

[[gnu::noinline]] inline ImuVerdict YawEstimator::predict(const ImuIncrement& imu) {
  const ImuVerdict verdict = imu.check();
  if (verdict != ImuVerdict::kAccepted) return verdict;
  const Vector3& f = imu.dv_b_mps;
  const float dt_s = base::seconds(imu.dt);
  if (!(up_b_.squaredNorm() > 0.5F)) {  // the first: the specific force is up
    const float norm = base::sqrt(f.squaredNorm());
    if (norm < 0.3F * kGravity * dt_s) return verdict;
    up_b_ = f / norm;
    begin(kFirstTilt_rad);
  }
  const Vector3 dtheta = imu.dtheta_b_rad - bias_b_radps_ * dt_s;
  // Up at the middle of the span and, from there, at its end.
  const Vector3 half = 0.5F * cross(dtheta, up_b_);
  const Vector3 middle = up_b_ - half;
  const float level2 = 1.0F - middle(0) * middle(0);
  const float turn = (middle(1) * dtheta(1) + middle(2) * dtheta(2)) / level2;
  // The nose points up or down: what is its heading? Or a turn that no series follows.
  if (!(level2 > 0.05F && turn < 0.5F && turn > -0.5F)) {
    give_up();
    up_b_ = Vector3::Zero();
    return verdict;
  }
  // Along the level, forward and left of the body: x_h = (e_x - u_x u) / cos, y_h = u x e_x / cos.
  const float along = up_b_.dot(f);
  const float scale = 1.0F / base::sqrt(1.0F - up_b_(0) * up_b_(0));
  const Complex gained =
      heading_ * Complex{(f(0) - up_b_(0) * along) * scale, (up_b_(2) * f(1) - up_b_(1) * f(2)) * scale};
  pending_.p = pending_.p + pending_.v * dt_s + gained * (0.5F * dt_s);
  pending_.v = pending_.v + gained;
  pending_.turned = pending_.turned + heading_ * dt_s;
  pending_.dt_s += dt_s;
  pending_.turn_rad += turn;
  rate_radps_ = turn / dt_s;
  wheels_s_ += dt_s;
  // Both turn, the level leans; their lengths come back by a Newton step.
  const float turn2 = turn * turn;
  heading_ = heading_ * Complex{1.0F - turn2 * (0.5F - turn2 * (1.0F / 24.0F)), turn * (1.0F - turn2 * (1.0F / 6.0F))};
  heading_ = heading_ * (1.5F - 0.5F * heading_.norm2());
  const Vector3 lean = (f - along * up_b_) / (kGravity * kLean_s);
  up_b_ += lean - 2.0F * half + cross(dtheta, half);
  up_b_ *= 1.5F - 0.5F * up_b_.squaredNorm();
  if (pending_.dt_s >= kStep_s) flush();
  return verdict;
}

[[gnu::noinline]] inline void YawEstimator::flush() {
  const float t = pending_.dt_s;
  if (!(t > 0.0F)) return;
  const float noise_v = 2.0F * square(noise.accel_mps2_rthz) * t;
  filter_.add(kP, {t, 0.0F}, kV);
  filter_.add(kP, pending_.p, kZ);
  filter_.add(kP, {0.5F * t * t, 0.0F}, kW);
  filter_.add(kV, pending_.v, kZ);
  filter_.add(kV, {t, 0.0F}, kW);
  filter_.add(kV, pending_.turned, kA);
  filter_.add(kW, pending_.v * (1.0F / kLean_s), kZ);  // what the leaning level takes off the specific force
  filter_.add(kW, pending_.turned, kR);
  // States in the body's axes turn with z: per unit of z, the best linear guess.
  std::array<Complex, kStates> with_z{};
  const float inverse = 1.0F / (filter_.value(kZ).norm2() + filter_.variance(kZ));
  for (const int k : {kZ, kW, kR, kA, kU})
    with_z[static_cast<std::size_t>(k)] =
        (filter_.value(k) * filter_.value(kZ).conjugate() + filter_.covariance(k, kZ)) * inverse;
  for (const int k : {kR, kA}) filter_.add(k, with_z[static_cast<std::size_t>(k)] * Complex{0.0F, -t}, kU);
  filter_.add(kZ, {0.0F, -t}, kU);
  // Sensor noise taken for motion is a regressor with errors: it would show the heading at standstill. Its apparent
  // information, noise_v / S a step, is taken back. A little more is taken for what is not modelled. It is taken from
  // the heading with all that hangs on it: only their common phase is what nothing else shows.
  const float variance_z = filter_.variance(kZ);
  filter_.spread(with_z, square(variance_z) * (0.25F * noise_v / filter_.variance(kV) + t / kMemory_s));
  // The gyroscope's noise turns the body, not the level's error. A scale error is the same all the way round: per turn
  // as much as it makes in a whole one.
  const float turn = pending_.turn_rad < 0.0F ? -pending_.turn_rad : pending_.turn_rad;
  with_z[kW] = {};
  filter_.spread(with_z, 2.0F * (square(noise.gyro_radps_rthz) * t + 6.28F * square(noise.gyro_scale) * turn));
  filter_.add_noise(kV, noise_v);
  filter_.add_noise(kW, 2.0F * square(kWander_mps2_rts) * t);
  filter_.add_noise(kR, 2.0F * square(kGravity * kBiasWalk_radps_rts) * t);
  filter_.add_noise(kA, 2.0F * square(kAccelWalk_mps2_rts) * t);
  filter_.add_noise(kU, 2.0F * square(kBiasWalk_radps_rts) * t);
  pending_ = {};
  bound();
}

/// Nothing is less known than a heading that may be any: |z|^2 + P_zz stays at 1. Too long without a measurement: anew.
[[gnu::noinline]] inline void YawEstimator::bound() {
  const float energy = filter_.value(kZ).norm2() + filter_.variance(kZ);
  if (!(filter_.variance(kV) < kBlind_m2ps2)) return give_up();
  if (filter_.variance(kZ) < 0.5F || energy < 1.0F) return;
  for (const int k : {kZ, kW, kR, kA, kU}) filter_.scale(k, 1.0F / base::sqrt(energy));
}

[[gnu::noinline]] inline void YawEstimator::predict_without_imu(base::Micros gap) {
  if (gap.us <= 0) return;
  flush();
  const float t = gap.us < 1'000'000 ? base::seconds(gap) : 1.0F;
  filter_.add(kP, {t, 0.0F}, kV);
  filter_.add_noise(kV, 2.0F * square(3.0F * t));
  filter_.add_noise(kZ, 2.0F * square(t));
  filter_.add_noise(kW, 2.0F * square(kGravity * 0.3F * t));
  bound();
}

[[gnu::noinline]] inline float YawEstimator::from(const base::Anchored& a, const base::Anchored& b) {
  return a.minus(b);
}

/// Numbers that a sensor can mean; false for NaN.
[[gnu::noinline]] inline bool YawEstimator::fits(float a, float b, float sigma, Complex lever) {
  bool inside = sigma > 1e-4F && sigma < 1000.0F;
  for (const float x : {a, b, 10.0F * lever.re, 10.0F * lever.im}) inside = inside && x < 1000.0F && x > -1000.0F;
  return inside;
}

[[gnu::noinline]] inline auto YawEstimator::measure(int i, Complex c_b, Complex z, float sigma, float more)
    -> Filter::Verdict {
  flush();
  return filter_.update(i, heading_ * c_b, kZ, z, 2.0F * square(sigma) + more, kGate);
}

inline void YawEstimator::fuse_velocity(float east_mps, float north_mps, float sigma_mps, Complex lever_b_m) {
  if (!fits(east_mps, north_mps, sigma_mps, lever_b_m)) return;
  judge(measure(kV, lever_b_m * Complex{0.0F, rate_radps_}, {east_mps, north_mps}, sigma_mps), true);
}

inline void YawEstimator::fuse_position(const base::Anchored& east, const base::Anchored& north, float sigma_m,
                                        Complex lever_b_m) {
  // The place is counted from the newest fix.
  const Complex moved{from(east, east_), from(north, north_)};
  if (!fits(0.0F, 0.0F, sigma_m, lever_b_m) || !(moved.norm2() < base::kInfinity)) return;
  if (!placed_) filter_.set(kP, moved, kFar_m2);
  placed_ = true;
  const auto verdict = measure(kP, lever_b_m, moved, sigma_m);
  filter_.shift(kP, moved * -1.0F);
  east_ = east;
  north_ = north;
  judge(verdict, true);
}

inline void YawEstimator::fuse_forward_speed(float mps, float sigma_mps, Complex axle_b_m) {
  if (!fits(mps, 0.0F, sigma_mps, axle_b_m) || wheels_s_ < kStep_s) return;
  flush();
  wheels_s_ = 0;
  // A speed below its noise must not look like one that was seen (see flush()). Before the velocity is known, wheels
  // and accelerometer only confirm each other. When they do not (slip, delay), z = 0 would satisfy both.
  const float speed2 = square(mps), explained = 9.0F * square(sigma_mps);
  const bool moves = speed2 > explained;
  if (moves && filter_.variance(kV) > 0.25F * speed2) return;
  const float dropped = moves ? explained / mps : mps;
  const Complex v_b = Complex{mps - dropped, 0.0F} - axle_b_m * Complex{0.0F, rate_radps_};
  judge(measure(kV, v_b * -1.0F, {}, sigma_mps, square(dropped) + square(kWheelShare * mps)), false);
}

[[gnu::noinline]] inline float YawEstimator::yaw_rad() const {
  const Complex z = filter_.value(kZ) * heading_;
  return base::atan2(z.im, z.re);
}

[[gnu::noinline]] inline float YawEstimator::against(float yaw_rad_other, float sigma_rad_other) const {
  const float sigma = sigma_rad();
  if (!ready()) return 0.0F;
  return apart_rad(yaw_rad_other) / base::sqrt(square(sigma) + square(sigma_rad_other));
}

[[gnu::noinline]] inline float YawEstimator::sigma_rad() const {
  constexpr float kAny2 = 3.2898681F;  // pi^2 / 3
  const float length = base::sqrt(filter_.value(kZ).norm2());
  // A length below one by more than two sigma is an error that the covariance does not contain.
  const float lacks2 = square(1.0F - length), variance = filter_.variance(kZ);
  const float extra = lacks2 > 2.0F * variance ? 2.0F * (lacks2 - 2.0F * variance) : 0.0F;
  const float inverse = (variance + extra) / (2.0F * length + 1e-6F);  // 1 / kappa
  const float s2 = inverse * (1.0F + inverse) + square(noise.floor_rad);
  return base::sqrt(s2 < kAny2 ? s2 : kAny2);
}

[[gnu::noinline]] inline void YawEstimator::give_up() {
  begin(kKeptTilt_rad);
  ++restarts_;
}

[[gnu::noinline]] inline void YawEstimator::judge(Filter::Verdict verdict, bool gnss) {
  if (verdict == Filter::Verdict::kRefused) {
    if (gnss && ++refused_ >= kMostRefused) give_up();
    return;
  }
  const float length2 = filter_.value(kZ).norm2();
  const float lacks2 = square(1.0F - base::sqrt(length2)), variance = filter_.variance(kZ);
  // Four sigma of the length, and a scale error beyond all reason, contradict the state.
  const bool denied = lacks2 > 8.0F * variance + 0.1F;
  if (verdict == Filter::Verdict::kSingular || denied) return give_up();
  if (gnss) {
    refused_ = 0;
    if (fixes_ < kFixes) ++fixes_;
  }
  if (!ready()) return;
  // Known errors are taken off at the source, so that the rest stays small.
  const Complex inverse = filter_.value(kZ).conjugate() * (1.0F / length2);
  const Complex drift = filter_.value(kR) * inverse * (1.0F / kGravity);
  const float rest = (filter_.value(kU) * inverse).re;
  const float scale = 1.0F / base::sqrt(1.0F - up_b_(0) * up_b_(0));
  const Complex level = filter_.value(kW) * inverse * heading_.conjugate() * (1.0F / kGravity);
  const Vector3 left_b = Vector3{0.0F, up_b_(2), -up_b_(1)} * scale;
  const Vector3 forward_b = cross(left_b, up_b_);
  bias_b_radps_ += forward_b * drift.im - left_b * drift.re + up_b_ * rest;
  up_b_ -= forward_b * level.re + left_b * level.im;
  up_b_ /= base::sqrt(up_b_.squaredNorm());
  filter_.add(kW, heading_ * level * -kGravity, kZ);
  filter_.add(kR, drift * -kGravity, kZ);
  filter_.add(kU, {-rest, 0.0F}, kZ);
}

}  // namespace tetap::nav
