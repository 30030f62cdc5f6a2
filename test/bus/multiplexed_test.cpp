// SPDX-License-Identifier: Apache-2.0
// Covariance of an inertial estimator, put together again from the frames as anybody on the bus would.
#include "tetap/bus/multiplexed.hpp"

#include "tetap/bus/codec.hpp"

#include <gtest/gtest.h>
#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <random>
#include <vector>

namespace tetap::bus {
namespace {

using Matrix15 = Eigen::Matrix<double, 15, 15>;
constexpr std::uint32_t kBase = 0x300;
constexpr std::uint8_t kTag = 11;

/// Sizes of a robot that navigates; every error correlated with every other.
Matrix15 covariance(std::mt19937& engine) {
  std::normal_distribution<double> normal;
  Matrix15 a;
  for (int r = 0; r < 15; ++r)
    for (int c = 0; c < 15; ++c) a(r, c) = normal(engine);
  Eigen::Matrix<double, 15, 1> size;
  size << 0.8, 0.6, 1.5, 0.1, 0.2, 0.05, 0.01, 0.02, 0.1, 0.05, 0.04, 0.03, 1e-3, 2e-3, 3e-4;
  const Matrix15 scaled = size.asDiagonal() * a;
  return scaled * scaled.transpose() / 15;
}

struct Pages {
  std::vector<base::CanFrame> frames;
  template <class Page>
  [[nodiscard]] Page only() const {
    std::optional<Page> found;
    for (const base::CanFrame& frame : frames) {
      const auto page = bus::decode<Page>(bus::payload(frame));
      EXPECT_FALSE(found && page) << "twice";
      if (page) found = page;
    }
    EXPECT_TRUE(found.has_value());
    return found.value_or(Page{});
  }
};

Pages pages(const estimators::InertialEstimate& e, std::uint32_t first, std::uint32_t count) {
  Pages result;
  for (std::uint32_t page = first; page < first + count; ++page)
    put_state_page(page, e, kTag, [&](const auto& message) { result.frames.push_back(bus::frame(kBase, message, 2)); });
  return result;
}

Eigen::Matrix3d rebuilt(std::array<float, 3> sigma, std::array<float, 3> corr_01_02_12) {
  const Eigen::Vector3d s = Eigen::Map<Eigen::Vector3f>(sigma.data()).cast<double>();
  const Eigen::Vector3d c = Eigen::Map<Eigen::Vector3f>(corr_01_02_12.data()).cast<double>();
  Eigen::Matrix3d m;
  m << 1, c(0), c(1), c(0), 1, c(2), c(1), c(2), 1;
  return s.asDiagonal() * m * s.asDiagonal();
}

/// Entry by entry, in shares of the two sigmas.
void expect_near(const Eigen::Matrix3d& published, const Eigen::Matrix3d& p, double share, const char* of) {
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c)
      EXPECT_NEAR(published(r, c), p(r, c), share * std::sqrt(p(r, r) * p(c, c))) << of << ' ' << r << ' ' << c;
}

TEST(StatePages, SayTheCovarianceOfThePresentWholeBlockByBlock) {
  std::mt19937 engine(3);
  for (int run = 0; run < 20; ++run) {
    const auto p = filter::Symmetric<float, 15>::upper_of(covariance(engine).cast<float>());
    estimators::InertialEstimate e{.state = {}, .p = p, .ahead = {.dt_s = 0.2F}, .valid = true};
    e.ahead.dv_n_mps = {0.3F, -0.2F, 1.96F};
    e.ahead.r_dt = filter::Matrix<float, 3, 3>::Identity() * 0.2F;
    e.ahead.var_v = 1e-4F;
    e.ahead.var_theta = 1e-6F;
    auto present = p;
    nav::predict_covariance(present, e.ahead);
    const auto block = [&](int first) {
      Eigen::Matrix3d of;
      for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) of(r, c) = static_cast<double>(present(first + r, first + c));
      return of;
    };
    const Pages published = pages(e, 0, 9);
    const auto v = published.only<bus::EstStateStdVel>();
    const auto cv = published.only<bus::EstStateCorrVel>();
    expect_near(rebuilt({v.std_vel_east_mps, v.std_vel_north_mps, v.std_vel_up_mps},
                        {cv.corr_vel_en, cv.corr_vel_eu, cv.corr_vel_nu}),
                block(3), 5e-3, "velocity");
    // 1 sigma of heading, and of east and north, are on Est_Std.
    const auto root = [&](int i) { return base::sqrt(present(i, i)); };
    const auto t = published.only<bus::EstStateStdTilt>();
    const auto ct = published.only<bus::EstStateCorrTilt>();
    expect_near(rebuilt({t.std_tilt_east_rad, t.std_tilt_north_rad, root(8)},
                        {ct.corr_tilt_en, ct.corr_tilt_e_yaw, ct.corr_tilt_n_yaw}),
                block(6), 2e-3, "attitude");
    const auto h = published.only<bus::EstStateHeight>();
    const auto ch = published.only<bus::EstStateCorrPos>();
    expect_near(
        rebuilt({root(0), root(1), h.std_height_m}, {present(0, 1) / (root(0) * root(1)), ch.corr_xz, ch.corr_yz}),
        block(0), 2e-3, "position");
    const auto a = published.only<bus::EstStateStdAccBias>();
    const auto ca = published.only<bus::EstStateCorrAccBias>();
    expect_near(rebuilt({a.std_acc_bias_x_mps2, a.std_acc_bias_y_mps2, a.std_acc_bias_z_mps2},
                        {ca.corr_acc_bias_xy, ca.corr_acc_bias_xz, ca.corr_acc_bias_yz}),
                block(9), 2e-3, "accelerometer bias");
    const auto g = published.only<bus::EstStateStdGyroBias>();
    const auto cg = published.only<bus::EstStateCorrGyroBias>();
    expect_near(rebuilt({g.std_gyro_bias_x_radps, g.std_gyro_bias_y_radps, g.std_gyro_bias_z_radps},
                        {cg.corr_gyro_bias_xy, cg.corr_gyro_bias_xz, cg.corr_gyro_bias_yz}),
                block(12), 2e-3, "gyroscope bias");
    for (const auto tag : {v.epoch, cv.epoch, ct.epoch, ch.epoch, ca.epoch, cg.epoch}) EXPECT_EQ(tag, kTag);
  }
}

/// Half a covariance cannot be judged, nor a bias by the sigma of another time. One turn therefore holds what belongs
/// together, and after nine turns everything was sent.
TEST(StatePages, ValuesSigmasAndTheirCorrelationsComeTogether) {
  const filter::Symmetric<float, 15> p =
      filter::Symmetric<float, 15>::diagonal({1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1});
  const estimators::InertialEstimate e{.state = {}, .p = p, .ahead = {}, .valid = true};
  std::size_t frames = 0;
  for (std::uint32_t page = 0; page < 9; ++page) {
    const Pages one = pages(e, page, 1);
    frames += one.frames.size();
    const auto has = [&]<class Page>(Page) {
      return std::any_of(one.frames.begin(), one.frames.end(),
                         [](const base::CanFrame& f) { return bus::decode<Page>(bus::payload(f)).has_value(); });
    };
    EXPECT_EQ(has(bus::EstStateHeight{}), has(bus::EstStateCorrPos{}));
    EXPECT_EQ(has(bus::EstStateStdVel{}), has(bus::EstStateCorrVel{}));
    EXPECT_EQ(has(bus::EstStateStdTilt{}), has(bus::EstStateCorrTilt{}));
    EXPECT_EQ(has(bus::EstStateAccBias{}), has(bus::EstStateStdAccBias{}));
    EXPECT_EQ(has(bus::EstStateStdAccBias{}), has(bus::EstStateCorrAccBias{}));
    EXPECT_EQ(has(bus::EstStateGyroBias{}), has(bus::EstStateStdGyroBias{}));
    EXPECT_EQ(has(bus::EstStateStdGyroBias{}), has(bus::EstStateCorrGyroBias{}));
  }
  EXPECT_EQ(frames, 14U);
}

}  // namespace
}  // namespace tetap::bus
