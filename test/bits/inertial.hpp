// SPDX-License-Identifier: Apache-2.0
// Inertial navigation on made-up driving with outliers, gaps, broken samples and restarts. The filter with its models,
// and the estimator with samples that come late; raw bits are hashed at every step.
#pragma once

#include "config/rover.hpp"
#include "filters.hpp"
#include "tetap/base/selfcheck.hpp"
#include "tetap/base/state_words.hpp"
#include "tetap/model/dual_heading.hpp"
#include "tetap/model/gnss_course.hpp"
#include "tetap/model/gnss_fix_3d.hpp"
#include "tetap/model/gnss_velocity_3d.hpp"
#include "tetap/model/height.hpp"
#include "tetap/model/magnetic_heading.hpp"
#include "tetap/model/wheel_speed.hpp"
#include "tetap/model/zero_rate.hpp"
#include "tetap/model/zero_velocity.hpp"
#include "tetap/nav/imu_gather.hpp"
#include "tetap/nav/ins.hpp"
#include "tetap/node/fusion_window.hpp"

#include <array>
#include <cstdint>

namespace tetap::bits {

[[nodiscard]] inline nav::Vector3 noises(Chance& chance, float sigma) {
  const std::array<float, 3> noise{chance.noise(sigma), chance.noise(sigma), chance.noise(sigma)};
  return {noise[0], noise[1], noise[2]};
}
inline void hash_state(base::WordHash& hash, const nav::InsState& x) {
  for (const base::Anchored* c : {&x.x, &x.y, &x.z}) {
    hash(c->anchor_um);
    hash(c->offset_m);
  }
  for (const nav::Vector3* v : {&x.v_n_mps, &x.b_a_mps2, &x.b_g_radps}) hash_vector<3>(hash, *v);
  for (const float q : {x.q_nb.w, x.q_nb.x, x.q_nb.y, x.q_nb.z}) hash(q);
}

/// The filter itself: an increment at every step, covariance at most of them, one measurement at every fourth.
class InsRun {
 public:
  [[nodiscard]] std::uint32_t run(std::uint32_t steps) {
    for (std::uint32_t k = 0; k < steps; ++k) {
      if (k % 1000 == 0 || chance_.one_in(700)) start();
      drive();
      if (k % 4 == 0) measure();
      hash_state(hash_, ins_.x);
      hash_packed(hash_, ins_);
      if (k % 50 == 49) {
        hash_state(hash_, gathered_);
        gathered_ = ins_.x;
      }
    }
    hash_(ins_.conditioned());
    return hash_.value();
  }

 private:
  void start() {
    truth_ = {.x = {.anchor_um = 50'000'000'000}, .y = {.anchor_um = -30'000'000'000}};
    truth_.q_nb = nav::from_euler({.yaw_rad = 3.0F * chance_.spread(), .pitch_rad = 0.1F});
    ins_.earth.rate_n_radps = chance_.one_in(2) ? nav::Vector3{0, 5e-5F, 5e-5F} : nav::Vector3{0, 0, 0};
    ins_.noise.gyro_bias_time_s = chance_.one_in(2) ? 300.0F : 0.0F;
    nav::InsState begin = truth_;
    begin.v_n_mps = noises(chance_, 0.3F);
    begin.b_g_radps = noises(chance_, 0.01F);
    ins_.start(begin, nav::Ins::Covariance::diagonal(
                          {4, 4, 9, 0.1F, 0.1F, 0.1F, 3e-4F, 3e-4F, 0.01F, 4e-2F, 4e-2F, 4e-2F, 1e-4F, 1e-4F, 1e-4F}));
    gathered_ = ins_.x;
  }
  void drive() {
    const base::Micros dt{5'000 + static_cast<std::int64_t>(chance_.dice.below(1'000))};
    if (chance_.one_in(50)) rate_ = noises(chance_, 0.3F);
    if (chance_.one_in(50)) push_ = noises(chance_, 1.0F);
    const nav::Vector3 up{0, 0, ins_.earth.gravity_mps2};
    const nav::Vector3 force = truth_.q_nb.conjugate().rotate(up + push_ - 0.2F * truth_.v_n_mps);
    nav::strapdown(truth_, nav::ImuIncrement::constant(rate_, force, dt), ins_.earth);
    gyro_ = rate_ + noises(chance_, 0.002F);
    nav::ImuIncrement shown = nav::ImuIncrement::constant(gyro_, force + noises(chance_, 0.05F), dt);
    if (chance_.one_in(300)) shown.dv_b_mps(1) = chance_.one_in(2) ? base::kNan : 900.0F;
    if (chance_.one_in(300)) return ins_.predict_without_imu(dt, 3.0F, 1.0F);
    const nav::ImuVerdict verdict = ins_.predict(shown);
    hash_(static_cast<std::uint32_t>(verdict));
    if (verdict != nav::ImuVerdict::kAccepted) return;
    gather_.add(shown);
    if (gather_.full() || gather_.sum().dt > base::Micros{60'000})
      nav::strapdown(gathered_, gather_.take(), ins_.earth);
    if (!chance_.one_in(3)) {
      ins_.vibration = chance_.one_in(20) ? 10.0F : 1.0F;
      ins_.predict_covariance();
    }
  }
  template <class Model>
  void fuse(const Model& model) {
    const auto record = ins_.update(model, filter::chi_square_99(Model::kDimension));
    hash_innovation(hash_, record);
  }
  /// Once in the program for all models of an angle.
  void angle(const model::DirectionMeasurement& model) { fuse(model); }
  void measure() {
    // A receiver of centimetres now and then: what is that sharp takes the way through condition().
    const float sigma = chance_.one_in(5) ? 0.01F : 1.0F;
    const nav::Vector3 lever = chance_.one_in(2) ? nav::Vector3{0.3F, -0.2F, 1.0F} : nav::Vector3{0, 0, 0};
    const nav::Vector3 noise = noises(chance_, 0.05F);
    const nav::Matrix3 r_bn = truth_.q_nb.matrix().transpose();
    const float yaw_rad = nav::euler(truth_.q_nb).yaw_rad + noise(0);
    switch (chance_.dice.below(8)) {
      case 0:
      case 1:
        return fuse(model::GnssFix3d{.x = truth_.x.plus(sigma * 20.0F * noise(0)),
                                     .y = truth_.y.plus(sigma * 20.0F * noise(1)),
                                     .z = truth_.z.plus(sigma * 20.0F * noise(2)),
                                     .sigma_horizontal_m = sigma,
                                     .sigma_vertical_m = 2.0F * sigma,
                                     .antenna_b_m = lever});
      case 2:
        return fuse(model::GnssVelocity3d{.v_n_mps = truth_.v_n_mps + noise,
                                          .sigma_horizontal_mps = 0.05F,
                                          .sigma_vertical_mps = 0.1F,
                                          .antenna_b_m = lever,
                                          .gyro_b_radps = gyro_});
      case 3:
        return fuse(model::WheelSpeed{.forward_mps = (r_bn * truth_.v_n_mps)(0) + noise(0),
                                      .sigma_forward_mps = 0.05F,
                                      .sigma_lateral_mps = 0.5F,
                                      .sigma_vertical_mps = 0.5F,
                                      .axle_b_m = lever,
                                      .gyro_b_radps = gyro_});
      case 4:
        return angle(model::DualHeading({1, 0, 0}, yaw_rad, 0.05F));
      case 5:
        return angle(model::MagneticHeading(r_bn * nav::Vector3{0, 17, -46}, 0.05F * noise(1), 0.1F));
      case 6:
        return fuse(model::Height{.z = truth_.z.plus(noise(2)), .sigma_m = 0.05F});
      default:
        fuse(model::ZeroRate{.gyro_b_radps = noise, .sigma_radps = 0.05F});
        angle(model::GnssCourse(truth_.v_n_mps(0), truth_.v_n_mps(1), 0.1F, 0.2F));
        return fuse(model::ZeroVelocity{.sigma_mps = 0.5F});
    }
  }

  base::WordHash hash_;
  Chance chance_{.random = base::Random{1, 7}};
  nav::Ins ins_;
  nav::InsState gathered_;
  nav::ImuGather gather_;
  nav::InsState truth_;
  nav::Vector3 rate_ = nav::Vector3::Zero(), push_ = nav::Vector3::Zero(), gyro_ = nav::Vector3::Zero();
};

/// The default robot's inertial estimator between timeline and publisher, with lever arm and without the other
/// estimators. Its state and covariance at the far end of the window and at the present are hashed at every tick.
class InertialRun {
 public:
  [[nodiscard]] std::uint32_t run(std::uint32_t steps) {
    const param::GnssParameters& g = kNumbers.gnss;
    map_frame_ = {};
    map_frame_.frame = nav::LocalFrame(g.origin_latitude_2ndeg, g.origin_longitude_2ndeg, g.origin_height_m);
    map_frame_.origin = sensor::OriginSource::kConfigured;
    now_ = {1'000'000};
    history_.power_on(now_, context());
    for (std::uint32_t k = 0; k < steps; ++k) {
      step_ = k;
      now_ += base::Micros{10'000};
      if (k % 2000 == 0 || chance_.one_in(1500)) restart();
      feed();
      static_cast<void>(history_.consume(
          now_, context(), [](const sensor::Sample&) {}, noting()));
      history_.advance(now_, context());
      history_.each_slot([&](const auto& slot) {
        const estimators::Estimate e = slot.estimate(context());
        hash_(e.pose.x.um());
        hash_(e.pose.y.um());
        hash_(e.pose.yaw_rad);
        for (const float v : e.p.packed()) hash_(v);
        if constexpr (requires { slot.inertial(context()); }) {
          const estimators::InertialEstimate full = slot.inertial(context());
          hash_state(hash_, full.state);
          for (const float v : full.p.packed()) hash_(v);
          filter::unroll<0, nav::InsState::kErrors>([&](auto i) { hash_(full.template covariance<i>()); });
          const estimators::MotionVariance motion = slot.motion_variance(context());
          hash_(motion.forward_m2ps2);
          hash_(motion.yaw_rate_rad2ps2);
        }
      });
      base::each_word(history_, hash_);
      history_.retire_until(now_ - base::Micros{kNumbers.loop.window_us}, context(), noting());
    }
    return hash_.value();
  }

 private:
  static constexpr param::Parameters kNumbers = [] {
    param::Parameters n = robot::rover::parameters;
    n.gnss.antenna_x_b_m = 0.3F;
    n.gnss.antenna_z_b_m = 0.8F;
    return n;
  }();

  [[nodiscard]] estimators::Context context() const { return {.parameters = kNumbers, .map_frame = map_frame_}; }
  struct Noting {
    base::WordHash& hash;
    void operator()(std::size_t, const sensor::Sample& sample, const estimators::Innovation& record) const {
      hash(static_cast<std::uint32_t>(sample.sensor) << 8 | static_cast<std::uint32_t>(record.verdict));
      hash(record.nis);
    }
  };
  [[nodiscard]] Noting noting() { return {hash_}; }

  void restart() {
    history_.close_window(now_, context(), noting());
    history_.restart(now_, context());
    if (chance_.one_in(3)) return;  // then it finds place and heading by itself
    const estimators::SetPose pose{
        .pose = {.yaw_rad = chance_.spread()}, .sigma_position_m = 0.5F, .sigma_yaw_rad = 0.1F};
    history_.each_slot([&](auto& slot) { slot.set_pose(now_, pose, context()); });
  }
  /// Mostly since the last tick; now and then late, or too late.
  [[nodiscard]] sensor::Sample fresh(sensor::Sensor sensor) {
    std::int64_t back_us = chance_.dice.below(10'000);
    if (chance_.one_in(10)) back_us += chance_.dice.below(150'000);
    if (chance_.one_in(300)) back_us += 300'000;
    sensor::Sample sample;
    sample.stamp = now_ - base::Micros{back_us};
    sample.sensor = sensor;
    sample.sequence = static_cast<std::uint8_t>(step_ & 15);
    sample.bits = chance_.dice.roll();
    return sample;
  }
  void offer(const sensor::Sample& sample) {
    if (chance_.one_in(100) || sample.stamp <= history_.closed_until()) return;
    hash_(static_cast<std::uint32_t>(history_.insert(sample, context(), noting())));
  }
  void feed() {
    using sensor::Sensor;
    const nav::Vector3 angle = noises(chance_, 2e-4F), push = noises(chance_, 2e-3F);
    const float turn = (step_ / 500) % 2 == 0 ? 2e-3F : 0.0F;
    sensor::Sample imu = fresh(Sensor::kImu);
    imu.stamp = now_ - base::Micros{chance_.one_in(20) ? 30'000 : 2'000};
    imu.payload.imu = {.dangle_b_rad = {angle(0), angle(1), turn + angle(2)},
                       .dvelocity_b_mps = {push(0), push(1) + 100.0F * turn * 0.01F, 0.0981F + push(2)},
                       .interval_us = 10'000,
                       .clipped_accel = static_cast<std::uint8_t>(chance_.one_in(100) ? 1 : 0)};
    offer(imu);
    if (step_ % 1000 > 150) {
      left_ = static_cast<std::uint16_t>(left_ + 30 + chance_.dice.below(5));
      right_ = static_cast<std::uint16_t>(right_ + 31 + chance_.dice.below(5));
    }
    sensor::Sample wheels = fresh(Sensor::kWheelCounts);
    wheels.payload.counts = {.left = left_, .right = right_};
    offer(wheels);
    if (step_ % 20 != 7) return;
    const nav::Vector3 off = noises(chance_, 1.0F);
    sensor::Sample fix = fresh(Sensor::kGnssPosition);
    fix.payload.gnss_position = {
        .latitude_2ndeg = kNumbers.gnss.origin_latitude_2ndeg + static_cast<std::int32_t>(4'500.0F * off(0)),
        .longitude_2ndeg = kNumbers.gnss.origin_longitude_2ndeg + static_cast<std::int32_t>(6'700.0F * off(1)) +
                           static_cast<std::int32_t>(step_ % 2000) * 67,
        .height_m = chance_.one_in(10) ? base::kNan : 520.0F + off(2),
        .horizontal_acc_m = chance_.one_in(10) ? 0.02F : 1.0F,
        .vertical_acc_m = 2.0F,
        .fix = chance_.one_in(30) ? sensor::GnssFix::kNone : sensor::GnssFix::k3d};
    offer(fix);
    sensor::Sample velocity = fresh(Sensor::kGnssVelocity);
    velocity.payload.gnss_velocity = {.v_n_mps = {1.0F + 0.1F * off(1), 0.1F * off(2), 0.1F * off(0)}, .acc_mps = 0.2F};
    offer(velocity);
  }

  base::WordHash hash_;
  Chance chance_{.random = base::Random{1, 8}};
  node::FusionWindow<node::Estimators<robot::rover::Inertial>, 96> history_;
  estimators::MapFrame map_frame_;
  base::Micros now_;
  std::uint32_t step_ = 0;
  std::uint16_t left_ = 0, right_ = 0;
};

}  // namespace tetap::bits
