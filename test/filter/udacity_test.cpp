// SPDX-License-Identifier: Apache-2.0
// One target seen by lidar and radar in turn, a set published with truth and with limits. Source: Udacity CarND,
// projects "Extended Kalman Filter" and "Unscented Kalman Filter". One configuration per filter serves both files;
// sensor noise is the course's. Without the data in $TETAP_DATA the tests are skipped.
#include "tetap/filter/ekf.hpp"
#include "tetap/filter/square_root.hpp"
#include "tetap/filter/ukf.hpp"
#include "tetap/filter/ukf_sqrt.hpp"
#include "tetap/model/constant_velocity.hpp"
#include "tetap/model/radar.hpp"
#include "tetap/model/target_position.hpp"

#include <gtest/gtest.h>
#include <array>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

namespace tetap {
namespace {

struct Row {
  bool lidar = false;
  std::array<double, 3> z{};
  std::int64_t time_us = 0;
  std::array<double, 4> truth{};  ///< x, y, vx, vy
};

/// "L x y t truth..." or "R range bearing range_rate t truth...".
std::vector<Row> read(const std::string& name) {
  const char* const data = std::getenv("TETAP_DATA");
  std::ifstream file(std::string(data != nullptr ? data : TETAP_DEFAULT_DATA) + "/udacity_ekf_ukf/" + name);
  std::vector<Row> rows;
  for (std::string line; std::getline(file, line);) {
    std::istringstream words(line);
    char kind = 0;
    Row row;
    words >> kind;
    row.lidar = kind == 'L';
    for (std::size_t i = 0; i < (row.lidar ? 2U : 3U); ++i) words >> row.z[i];
    words >> row.time_us;
    for (double& v : row.truth) words >> v;
    if (words) rows.push_back(row);
  }
  return rows;
}
constexpr const char* kObjPose = "obj_pose-laser-radar-synthetic-input.txt";
constexpr const char* kSample1 = "sample-laser-radar-measurement-data-1.txt";

// Course: lidar 0.15 m; radar 0.3 m, 0.03 rad, 0.3 m/s.
template <class State>
model::TargetPosition<State> lidar(const Row& row) {
  return {.x_m = static_cast<float>(row.z[0]), .y_m = static_cast<float>(row.z[1]), .sigma_m = 0.15F};
}
template <class State>
model::Radar<State> radar(const Row& row) {
  return {.range_m = static_cast<float>(row.z[0]),
          .bearing_rad = static_cast<float>(row.z[1]),
          .range_rate_mps = static_cast<float>(row.z[2]),
          .sigma_range_m = 0.3F,
          .sigma_bearing_rad = 0.03F,
          .sigma_range_rate_mps = 0.3F};
}

/// RMSE of x, y, vx, vy over all rows; the first measurement gives the position, the rest begins at nothing known.
template <class Filter, class Motion>
std::array<double, 4> rmse(const std::vector<Row>& rows, Filter filter, const Motion& motion) {
  using State = typename Filter::State;
  std::array<double, 4> squares{};
  std::int64_t before_us = rows.front().time_us;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Row& row = rows[i];
    if (i == 0) {
      filter.x = State{};
      const double range = row.z[0], bearing = row.z[1];
      filter.x.value(0) = static_cast<float>(row.lidar ? row.z[0] : range * std::cos(bearing));
      filter.x.value(State::kErrors == 4 ? 2 : 1) =
          static_cast<float>(row.lidar ? row.z[1] : range * std::sin(bearing));
    } else {
      EXPECT_TRUE(filter.predict(motion(static_cast<float>(static_cast<double>(row.time_us - before_us) * 1e-6))));
      if (row.lidar) {
        EXPECT_EQ(filter.update(lidar<State>(row), 1e9F).verdict, filter::Verdict::kAccepted);
      } else {
        EXPECT_EQ(filter.update(radar<State>(row), 1e9F).verdict, filter::Verdict::kAccepted);
      }
    }
    before_us = row.time_us;
    const auto k = model::kinematics(filter.x);
    for (int c = 0; c < 4; ++c)
      squares[static_cast<std::size_t>(c)] +=
          std::pow(static_cast<double>(k(c)) - row.truth[static_cast<std::size_t>(c)], 2);
  }
  for (double& s : squares) s = std::sqrt(s / static_cast<double>(rows.size()));
  return squares;
}

void expect_within(const std::array<double, 4>& rmse, const std::array<double, 4>& limit) {
  for (std::size_t i = 0; i < 4; ++i) EXPECT_LE(rmse[i], limit[i]) << "component " << i;
  testing::Test::RecordProperty("rmse", testing::PrintToString(rmse));
  std::cout << "rmse " << testing::PrintToString(rmse) << " limit " << testing::PrintToString(limit) << '\n';
}

using Velocity = model::ConstantVelocity<float>;
const auto kVelocity = [](float dt_s) { return Velocity{.dt_s = dt_s, .acceleration_variance = 9.0F}; };
const auto kTurn = [](float dt_s) {
  return model::Ctrv<float>{
      .dt_s = dt_s, .acceleration_variance = 1.5F * 1.5F, .yaw_acceleration_variance = 0.55F * 0.55F};
};
template <class Filter>
Filter turning() {
  Filter filter;
  const auto p = filter::Symmetric<float, 5>::diagonal({0.0225F, 0.0225F, 25.0F, 1.0F, 0.1F});
  if constexpr (requires { filter.set_covariance(p); }) {
    filter.set_covariance(p);
  } else {
    filter.p = p;
  }
  return filter;
}

TEST(Udacity, ExtendedFilterWithConstantVelocity) {
  for (const auto& [name, limit] : {std::pair<const char*, std::array<double, 4>>{kObjPose, {0.11, 0.11, 0.52, 0.52}},
                                    {kSample1, {0.08, 0.08, 0.60, 0.60}}}) {
    const std::vector<Row> rows = read(name);
    if (rows.empty()) GTEST_SKIP() << name << ": not there (set TETAP_DATA)";
    filter::Ekf<Velocity::State> ekf;
    ekf.p = filter::Symmetric<float, 4>::diagonal({0.09F, 100.0F, 0.09F, 100.0F});
    expect_within(rmse(rows, ekf, kVelocity), limit);
    filter::SquareRootKalman<Velocity::State> root;
    root.set_covariance(ekf.p);
    expect_within(rmse(rows, root, kVelocity), limit);
  }
}

TEST(Udacity, UnscentedFiltersWithConstantTurnRateAndVelocity) {
  for (const auto& [name, limit] : {std::pair<const char*, std::array<double, 4>>{kObjPose, {0.09, 0.10, 0.40, 0.30}},
                                    {kSample1, {0.09, 0.09, 0.65, 0.65}}}) {
    const std::vector<Row> rows = read(name);
    if (rows.empty()) GTEST_SKIP() << name << ": not there (set TETAP_DATA)";
    expect_within(rmse(rows, turning<filter::Ukf<model::CtrvState<float>>>(), kTurn), limit);
    expect_within(rmse(rows, turning<filter::UkfSqrt<model::CtrvState<float>>>(), kTurn), limit);
  }
}

}  // namespace
}  // namespace tetap
