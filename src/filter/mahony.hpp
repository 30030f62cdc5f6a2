// SPDX-License-Identifier: Apache-2.0
// Plain Mahony: the explicit complementary filter with proportional and integral correction (Mahony, Hamel, Pflimlin,
// IEEE Trans. Autom. Control 53(5), 2008, eq. 32 to 34). East-north-up; magnetic north is n's second axis.
#pragma once

#include "filter/quaternion.hpp"

namespace tetap::filter {

class Mahony {
 public:
  /// Gains in rad/s per unit of error, and per second of that.
  float kp = 0.74F, ki = 0.0012F;

  /// One step with gyroscope and accelerometer. A sample that is no direction leaves the gyroscope alone to turn.
  void step(const Vector3& w_b_radps, const Vector3& f_b, float dt_s) {
    if (!sane(w_b_radps, dt_s)) return;
    Vector3 error = Vector3::Zero();
    add_vertical(f_b, error);
    turn(w_b_radps, error, dt_s);
  }

  /// The same with a magnetometer: only the direction of its horizontal part counts, so inclination is the
  /// accelerometer's as far as the common gain allows.
  void step(const Vector3& w_b_radps, const Vector3& f_b, const Vector3& m_b, float dt_s) {
    if (!sane(w_b_radps, dt_s)) return;
    Vector3 error = Vector3::Zero();
    add_vertical(f_b, error);
    const float m2 = dot(m_b, m_b);
    if (m2 > kLeast2 && m2 < kMost2) {
      const Rows r(q_nb_);
      const Vector3 m_n = r * m_b;
      // The field as it would be with its horizontal part to the north, in body axes.
      const float north = base::sqrt(m_n(0) * m_n(0) + m_n(1) * m_n(1));
      const Vector3 expected_b = r.y * north + r.z * m_n(2);
      error += (1.0F / m2) * cross(m_b, expected_b);
    }
    turn(w_b_radps, error, dt_s);
  }

  void start(const Quaternion& q_nb) { q_nb_ = q_nb, bias_radps_ = Vector3::Zero(); }
  [[nodiscard]] const Quaternion& q_nb() const { return q_nb_; }
  [[nodiscard]] const Vector3& bias_b_radps() const { return bias_radps_; }

 private:
  static constexpr float kLeast2 = 1e-12F, kMost2 = 1e12F;

  [[nodiscard]] static bool sane(const Vector3& w_b_radps, float dt_s) {
    return dt_s > 0.0F && dt_s <= 0.2F && within(w_b_radps, 100.0F);
  }
  void add_vertical(const Vector3& f_b, Vector3& error) const {
    const float f2 = dot(f_b, f_b);
    if (!(f2 > kLeast2 && f2 < kMost2)) return;
    const Quaternion& q = q_nb_;
    const Vector3 half_up{q.x * q.z - q.w * q.y, q.w * q.x + q.y * q.z, q.w * q.w + q.z * q.z - 0.5F};
    error += (2.0F / base::sqrt(f2)) * cross(f_b, half_up);
  }
  void turn(const Vector3& w_b_radps, const Vector3& error, float dt_s) {
    bias_radps_ -= (ki * dt_s) * error;
    const Vector3 rate = w_b_radps - bias_radps_ + kp * error;
    const Vector3 half = (0.5F * dt_s) * rate;
    q_nb_ = (q_nb_ * Quaternion{1.0F, half(0), half(1), half(2)}).normalised();
  }

  Quaternion q_nb_{};
  Vector3 bias_radps_ = Vector3::Zero();
};

}  // namespace tetap::filter
