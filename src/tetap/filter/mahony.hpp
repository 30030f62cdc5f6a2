// SPDX-License-Identifier: Apache-2.0
// Plain Mahony: the explicit complementary filter with proportional and integral correction (Mahony, Hamel, Pflimlin,
// IEEE Trans. Autom. Control 53(5), 2008, eq. 32 to 34). East-north-up; magnetic north is n's second axis.
#pragma once

#include "tetap/filter/quaternion.hpp"

namespace tetap::filter {

class Mahony {
 public:
  /// Gains in rad/s per unit of error, and per second of that.
  float kp = 0.74F, ki = 0.0012F;

  /// One step with gyroscope and accelerometer. Free fall leaves the gyroscope alone to turn. False, and nothing has
  /// changed, for values that no sensor gives and for no time.
  bool step(const Vector3& w_b_radps, const Vector3& f_b, float dt_s) {
    const float f2 = dot(f_b, f_b);
    if (!sane(w_b_radps, f2, dt_s)) return false;
    const Scaled error = vertical_error(f_b, f2);
    turn(w_b_radps, error.v, error.by, dt_s);
    return true;
  }

  /// The same with a magnetometer: the field is expected with its horizontal part to the north, whatever its dip.
  bool step(const Vector3& w_b_radps, const Vector3& f_b, const Vector3& m_b, float dt_s) {
    const float f2 = dot(f_b, f_b);
    if (!sane(w_b_radps, f2, dt_s)) return false;
    const Scaled error = vertical_error(f_b, f2);
    turn(w_b_radps, error.by * error.v + field_error(m_b), 1.0F, dt_s);
    return true;
  }

  void start(const Quaternion& q_nb) { q_nb_ = q_nb, bias_radps_ = Vector3::Zero(); }
  [[nodiscard]] const Quaternion& q_nb() const { return q_nb_; }
  [[nodiscard]] const Vector3& bias_b_radps() const { return bias_radps_; }

 private:
  static constexpr float kLeast2 = 1e-12F, kMost2 = 1e12F;

  /// Numbers that no sensor gives change nothing: the filter stays finite whatever comes.
  [[nodiscard]] static bool sane(const Vector3& w_b_radps, float f2, float dt_s) {
    return dt_s > 0.0F && dt_s <= 0.2F && dot(w_b_radps, w_b_radps) + f2 < kMost2;
  }
  /// v, to be multiplied.
  struct Scaled {
    Vector3 v;
    float by;
  };
  /// Measured x expected direction, in body axes. In line, so that a step runs in registers.
  [[nodiscard, gnu::always_inline]] inline Scaled vertical_error(const Vector3& f_b, float f2) const {
    if (f2 <= kLeast2) return {Vector3::Zero(), 0.0F};
    const Quaternion& q = q_nb_;
    const Vector3 half_up{q.x * q.z - q.w * q.y, q.w * q.x + q.y * q.z, q.w * q.w + q.z * q.z - 0.5F};
    return {cross(f_b, half_up), 2.0F / base::sqrt(f2)};
  }
  [[nodiscard, gnu::always_inline]] inline Vector3 field_error(const Vector3& m_b) const {
    const float m2 = dot(m_b, m_b);
    if (!(m2 > kLeast2 && m2 < kMost2)) return Vector3::Zero();
    const Rows r(q_nb_);
    const float east = dot(r.x, m_b), north = dot(r.y, m_b);
    const float up = dot(r.z, m_b);
    const float horizontal = base::sqrt(east * east + north * north);
    const Vector3 expected_b = horizontal * r.y + up * r.z;
    return (1.0F / m2) * cross(m_b, expected_b);
  }
  [[gnu::always_inline]] inline void turn(const Vector3& w_b_radps, const Vector3& error, float by, float dt_s) {
    bias_radps_ -= (ki * dt_s * by) * error;
    const Vector3 h = (0.5F * dt_s) * (w_b_radps - bias_radps_ + (kp * by) * error);
    const Quaternion q = q_nb_;
    const Quaternion next{q.w - (q.x * h(0) + q.y * h(1) + q.z * h(2)), q.x + (q.w * h(0) + q.y * h(2) - q.z * h(1)),
                          q.y + (q.w * h(1) - q.x * h(2) + q.z * h(0)), q.z + (q.w * h(2) + q.x * h(1) - q.y * h(0))};
    const float n2 = next.norm2();
    q_nb_ = n2 < 1.1F ? next.scaled(1.5F - 0.5F * n2) : next.normalised();  // Newton's step near 1
  }

  Quaternion q_nb_{};
  Vector3 bias_radps_ = Vector3::Zero();
};

}  // namespace tetap::filter
