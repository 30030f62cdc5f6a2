// SPDX-License-Identifier: Apache-2.0
// Judgement of a cell of the fault matrix, worked out by hand: errors in three sigma, seconds beyond, and the return.
#include "sim_host/matrix/cell.hpp"
#include "sim_host/matrix/dbc.hpp"
#include "sim_host/matrix/published.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <sstream>
#include <stdexcept>

namespace {

using namespace tetap;
using sim::Quantity;

constexpr auto kPosition = static_cast<std::size_t>(Quantity::kPosition);
constexpr auto kVelocity = static_cast<std::size_t>(Quantity::kVelocity);
constexpr auto kHeading = static_cast<std::size_t>(Quantity::kHeading);
constexpr auto kTilt = static_cast<std::size_t>(Quantity::kTilt);
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

/// A robot at rest at the origin, level, looking along `yaw_rad`.
sim::CleanLog at_rest(double yaw_rad) {
  sim::CleanLog log;
  log.origin = {.latitude_deg = 48, .longitude_deg = 11, .height_m = 500};
  log.truth.assign(10, sim::Truth{.yaw_rad = yaw_rad});
  return log;
}

sim::PublishedState exact(double yaw_rad) {
  sim::PublishedState s{.tick = 5};
  s.std_position_m = {1, 1, 1};
  s.std_velocity_mps = {0.1, 0.1, 0.1};
  s.yaw_rad = yaw_rad;
  s.std_yaw_rad = 0.02;
  s.q_nb = {std::cos(yaw_rad / 2), 0, 0, std::sin(yaw_rad / 2)};
  s.std_tilt_rad = {0.01, 0.01};
  s.valid = {true, true, true, true};
  return s;
}

sim::Judged judged(const sim::PublishedState& state, double yaw_rad) {
  const sim::CleanLog log = at_rest(yaw_rad);
  return sim::judged({&state, 1}, log, log.origin).front();
}

TEST(Judged, an_exact_estimate_has_no_error) {
  const sim::Judged j = judged(exact(1.2), 1.2);
  for (std::size_t q = 0; q < sim::kQuantities; ++q) EXPECT_NEAR(j.ratio[q], 0, 1e-6);
}

TEST(Judged, the_worst_component_over_three_of_its_own_sigma_counts) {
  sim::PublishedState s = exact(0);
  s.position_m = {3, -12, 0};
  s.std_position_m = {1, 2, 1};
  s.velocity_mps = {0, 0, 0.6};
  const sim::Judged j = judged(s, 0);
  EXPECT_NEAR(j.ratio[kPosition], 2, 1e-6);
  EXPECT_NEAR(j.error[kPosition], std::sqrt(153.0), 1e-6);
  EXPECT_NEAR(j.ratio[kVelocity], 2, 1e-6);
}

TEST(Judged, a_heading_is_compared_across_the_cut_and_a_turn_is_no_tilt) {
  const sim::Judged j = judged(exact(-3.13), 3.13);
  EXPECT_NEAR(j.error[kHeading], 2 * (3.14159265 - 3.13), 1e-6);
  EXPECT_NEAR(j.ratio[kTilt], 0, 1e-6);
}

TEST(Judged, a_tilt_about_east_is_one_whatever_the_heading) {
  for (const double yaw_rad : {0.0, 1.0, -2.5}) {
    sim::PublishedState s = exact(yaw_rad);
    const double half = 0.03;  // q of 0.06 rad about east, before the heading
    s.q_nb = {std::cos(half) * s.q_nb[0], std::sin(half) * s.q_nb[0], -std::sin(half) * s.q_nb[3],
              std::cos(half) * s.q_nb[3]};
    EXPECT_NEAR(judged(s, yaw_rad).error[kTilt], 0.06, 1e-6);
    EXPECT_NEAR(judged(s, yaw_rad).ratio[kTilt], 2, 1e-4);
  }
}

TEST(Judged, what_is_not_published_is_not_judged) {
  sim::PublishedState s = exact(0);
  s.position_m = {1, 1, kNone};
  s.velocity_mps.fill(kNone);
  const sim::Judged j = judged(s, 0);
  EXPECT_NEAR(j.error[kPosition], std::sqrt(2.0), 1e-6);
  EXPECT_TRUE(std::isnan(j.ratio[kVelocity]));
}

/// Every tenth of a second for 20 s from tick 100 on; errors are ratios.
template <class Ratio>
std::vector<sim::Judged> series(Ratio&& ratio, bool valid = true) {
  std::vector<sim::Judged> all;
  for (std::size_t tick = 100; tick < 2100; tick += 10) {
    sim::Judged j{.tick = tick};
    j.ratio.fill(ratio(0.01 * static_cast<double>(tick - 100)));
    j.error = j.ratio;
    j.valid.fill(valid);
    all.push_back(j);
  }
  return all;
}

constexpr std::size_t kEnd = 600;  // a fault of 5 s
const auto kClean = series([](double) { return 0.5; });

sim::Figures compared(const std::vector<sim::Judged>& run, const std::vector<sim::Judged>& clean = kClean) {
  return sim::compare(run, clean, kEnd)[kHeading];
}

TEST(Compare, a_run_like_the_clean_one_has_nothing_to_show) {
  const sim::Figures f = compared(kClean);
  EXPECT_EQ(f.beyond_s, 0);
  EXPECT_EQ(f.valid_while_out_s, 0);
  EXPECT_EQ(f.inside_after_s, 0);
  EXPECT_NEAR(f.worst_ratio, f.clean_ratio, 1e-12);
}

TEST(Compare, seconds_beyond_and_the_return_are_counted) {
  const sim::Figures f = compared(series([](double t) {
    return t >= 2 && t < 5 ? 11.0 : t >= 5 && t < 8 ? 1.2 : 0.5;
  }));
  EXPECT_NEAR(f.beyond_s, 3, 1e-9);
  EXPECT_NEAR(f.valid_while_out_s, 3, 1e-9);
  EXPECT_NEAR(*f.inside_after_s, 3, 0.11);
  EXPECT_NEAR(f.worst_ratio, 11, 1e-12);
}

TEST(Compare, an_error_that_stays_never_returns) {
  EXPECT_FALSE(compared(series([](double t) { return t < 2 ? 0.5 : 1.1; })).inside_after_s.has_value());
}

TEST(Compare, an_error_below_twice_the_clean_one_is_not_the_faults) {
  const auto clean = series([](double) { return 6.0; });
  const sim::Figures f = compared(series([](double) { return 11.9; }), clean);
  EXPECT_EQ(f.beyond_s, 0);
  EXPECT_EQ(f.valid_while_out_s, 0);
  EXPECT_EQ(f.inside_after_s, 0);
  EXPECT_GT(compared(series([](double) { return 12.1; }), clean).beyond_s, 19);
}

TEST(Compare, an_estimate_that_is_withdrawn_is_not_beyond_and_not_back) {
  const sim::Figures f = compared(series([](double) { return 30.0; }, false));
  EXPECT_EQ(f.beyond_s, 0);
  EXPECT_EQ(f.valid_while_out_s, 0);
  EXPECT_FALSE(f.inside_after_s.has_value());
}

TEST(Dbc, a_line_that_cannot_be_read_is_named) {
  for (const char* const text :
       {" SG_ X : 0|8@1+ (1,0) [0|1] \"\" A\n", "BO_ 768 In_A: 8 H\n SG_ X : 0|8@0+ (1,0) [0|1] \"\" A\n",
        "BO_ 768 In_A: 8 H\n SG_ X : 60|8@1+ (1,0) [0|1] \"\" A\n", ""}) {
    std::istringstream dbc(text);
    EXPECT_THROW(sim::BusDatabase{dbc}, std::runtime_error) << text;
  }
}

TEST(CellFacts, a_receiver_without_a_fix_talks_and_is_of_no_use) {
  std::istringstream text(
      "BO_ 780 In_GnssAlt: 8 H\n SG_ GnssAlt_Fix : 50|4@1+ (1,0) [0|15] \"\" A\n"
      "BO_ 782 In_GnssVelEN: 8 H\n SG_ GnssVelEN_East : 26|19@1- (0.001,0) [-262.143|262.143] \"m/s\" A\n"
      "BO_ 784 In_Mag: 8 H\n SG_ Mag_FluxX : 0|16@1- (0.1,0) [-3276.7|3276.7] \"uT\" A\n");
  const sim::BusDatabase dbc(text);
  sim::CleanLog log = at_rest(0);
  log.truth.assign(1'700, log.truth.front());
  const auto put = [&](const char* message, const char* signal, std::int64_t raw) {
    base::CanFrame frame{.id = log.parameters.can_base + dbc.message(message).offset};
    dbc.signal(message, signal).set_raw(frame, raw);
    log.frames.push_back({log.ticks.back(), frame});
  };
  for (int tick = 0; tick < 1'600; ++tick) {
    log.ticks.push_back(base::Micros{10'000 * tick});
    log.first.push_back(log.frames.size());
    if (tick % 20 != 0) continue;
    put("In_GnssAlt", "GnssAlt_Fix", tick < 350 ? 1 : 2);  // the time alone, then a fix without a height
    put("In_GnssVelEN", "GnssVelEN_East", tick < 450 ? -262'144 : 0);
    put("In_Mag", "Mag_FluxX", -32'768);
  }
  log.first.push_back(log.frames.size());
  const sim::CellFacts facts = sim::facts_of(log, 100, exact(0), dbc);
  for (const char* const device : {"gnss", "gnss_velocity", "magnetometer"})
    EXPECT_NEAR(facts.period_s.at(device), 0.2, 1e-9) << device;
  EXPECT_NEAR(facts.usable_after_s.at("gnss"), 2.6, 1e-9);
  EXPECT_NEAR(facts.usable_after_s.at("gnss_velocity"), 3.6, 1e-9);
  EXPECT_FALSE(facts.usable_after_s.contains("magnetometer"));
}

TEST(CellRequest, a_line_is_a_cell_or_an_error) {
  const sim::CellRequest request("curve gyro z spike10 0.1g");
  EXPECT_EQ(request.fault.samples, 10);
  EXPECT_EQ(request.fault.kind, sim::FaultKind::kSpike);
  for (const char* const line : {"curve gyro z spike2", "curve gyro z wild 1g", "curve gyro z spikeX 1g", ""})
    EXPECT_THROW(sim::CellRequest{line}, std::runtime_error) << line;
}

}  // namespace
