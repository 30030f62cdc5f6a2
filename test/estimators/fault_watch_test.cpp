// SPDX-License-Identifier: Apache-2.0
// The hypotheses of faults beside the inertial filter: they leave it alone, and what is published covers a fault that
// no gate sees.
#include "inertial_drive.hpp"

#include "tetap/base/state_hash.hpp"
#include "tetap/base/state_words.hpp"

#include <set>

namespace tetap::estimators {
namespace {

template <class Estimator>
DriveOf<Estimator> sound(unsigned seed, double speed_mps) {
  auto d = settled<Estimator>(rover_like(), seed);
  d.white_m = 0.3;
  d.speed_mps = speed_mps;
  d.run(20);
  return d;
}

/// By so much the gyroscope about up is off, and the receiver's velocity to the east.
struct Off {
  float gyro_radps = 0, east_mps = 0;
};
void set(auto& d, const Off& off) {
  d.tamper_imu = [off](sensor::ImuSample& s) { s.dangle_b_rad[2] += 0.01F * off.gyro_radps; };
  d.tamper = [off](auto& fix) {
    fix.east_off_mps = off.east_mps;
    return true;
  };
}

/// Error of velocity or heading, in 3 sigma.
double worst(const auto& d) {
  const InertialEstimate now = d.estimator.inertial(d.ctx());
  const double east = static_cast<double>(now.state.v_n_mps(0)) - d.speed_mps * std::cos(d.yaw_rad),
               north = static_cast<double>(now.state.v_n_mps(1)) - d.speed_mps * std::sin(d.yaw_rad);
  return std::max(d.yaw_error_rad() / three_sigma(now, {8}), std::hypot(east, north) / three_sigma(now, {3, 4}));
}

/// The same drive twice, and a fault in the middle: the state is the same to the bit, P is never smaller, and without
/// suspicion it is the same.
TEST(FaultWatch, TheFilterIsTheSameToTheBit) {
  auto plain = sound<Inertial>(1, 1);
  auto watched = sound<WatchedInertial>(1, 1);
  int clean = 0, same = 0, wider = 0;
  for (int k = 0; k < 6'000; ++k) {
    if (k == 3'000) set(plain, {.east_mps = 0.5F}), set(watched, {.east_mps = 0.5F});
    if (k == 3'300) set(plain, {}), set(watched, {});
    plain.run(0.01), watched.run(0.01);
    const InertialEstimate a = plain.estimator.inertial(plain.ctx()), b = watched.estimator.inertial(watched.ctx());
    ASSERT_EQ(a.state.x.um(), b.state.x.um()) << k;
    ASSERT_EQ(a.state.v_n_mps, b.state.v_n_mps) << k;
    ASSERT_EQ(a.state.b_g_radps, b.state.b_g_radps) << k;
    ASSERT_EQ(a.state.q_nb.x, b.state.q_nb.x) << k;
    for (int i = 0; i < nav::Ins::kErrors; ++i) ASSERT_GE(b.p(i, i), a.p(i, i)) << k;
    const bool equal = a.p.packed() == b.p.packed();
    if (k < 3'000) ++clean, same += equal ? 1 : 0;
    if (k >= 3'000 && k < 3'400 && !equal) ++wider;
  }
  EXPECT_GT(same, clean * 9 / 10);
  EXPECT_GT(wider, 50);
}

/// A fault that no gate sees: the filter's own 3 sigma fail for seconds, the published ones for less than half of them.
TEST(FaultWatch, WhatIsPublishedCoversAFaultBelowTheGates) {
  struct Case {
    double speed_mps = 0;
    Off off;
  };
  for (const Case& one : {Case{1, {.east_mps = 0.25F}}, Case{3, {.gyro_radps = 0.08F}}}) {
    double own_s = 0, published_s = 0;
    for (const unsigned seed : {1U, 3U}) {
      auto plain = sound<Inertial>(seed, one.speed_mps);
      auto watched = sound<WatchedInertial>(seed, one.speed_mps);
      set(plain, one.off), set(watched, one.off);
      for (int k = 0; k < 1'300; ++k) {
        if (k == 500) set(plain, {}), set(watched, {});
        plain.run(0.01), watched.run(0.01);
        own_s += worst(plain) > 1 ? 0.01 : 0;
        published_s += worst(watched) > 1 ? 0.01 : 0;
      }
    }
    EXPECT_GT(own_s, 5) << one.speed_mps << " m/s";
    EXPECT_LT(published_s, own_s / 2) << one.speed_mps << " m/s";
  }
}

/// Below every gate, in white noise: after 4 s the faulty device is the likeliest, with its size within 3 sigma. A bias
/// counts from the begin of its row, which is not its own: 4 sigma.
TEST(FaultWatch, TheLikeliestFaultIsTheTrueOneWithItsSize) {
  for (const unsigned seed : {1U, 3U})
    for (const bool gyro : {false, true}) {
      auto d = sound<WatchedInertial>(seed, 3);
      set(d, gyro ? Off{.gyro_radps = 0.08F} : Off{.east_mps = 0.5F});
      d.run(4);
      const trust::LikelyFault found = d.estimator.likeliest_fault();
      EXPECT_EQ(found.code, gyro ? 2U : trust::InertialFaults::kVelocity) << seed;
      EXPECT_GT(found.probability, 0.9F) << seed;
      EXPECT_NEAR(found.size, gyro ? 0.08F : 0.5F, (gyro ? 4 : 3) * found.sigma) << seed;
    }
}

/// Whatever sets the filter from outside begins the rows anew: nothing is suspected, and P is the filter's own.
TEST(FaultWatch, ARestartAGivenPoseAndAResetBeginTheRowsAnew) {
  const auto suspecting = [] {
    auto d = sound<WatchedInertial>(1, 3);
    set(d, {.east_mps = 0.5F});
    for (int k = 0; k < 500 && d.estimator.likeliest_fault().code == trust::LikelyFault::kNone; ++k) d.run(0.01);
    EXPECT_NE(d.estimator.likeliest_fault().code, trust::LikelyFault::kNone);
    return d;
  };
  auto placed = suspecting();
  placed.place();
  EXPECT_EQ(placed.estimator.likeliest_fault().code, trust::LikelyFault::kNone) << "given pose";
  auto restarted = suspecting();
  restarted.estimator.restart({restarted.us}, restarted.ctx());
  EXPECT_EQ(restarted.estimator.likeliest_fault().code, trust::LikelyFault::kNone) << "restart";
  auto carried = suspecting();
  set(carried, {});
  carried.east_m += 200;
  const auto before = carried.estimator.jump().count;
  for (int k = 0; k < 15'000 && carried.estimator.jump().count == before; ++k) carried.run(0.01);
  ASSERT_NE(carried.estimator.jump().count, before);
  EXPECT_EQ(carried.estimator.likeliest_fault().code, trust::LikelyFault::kNone) << "reset of the position";
}

/// Every number of the bank is in the hash.
TEST(FaultWatch, TheHashCoversTheBank) {
  const auto hash = [](const FaultWatch& watch) {
    base::StateHash out;
    for (unsigned turn = 0; turn < base::kTurns; ++turn) base::each_word_in_turn(watch, turn, out);
    return out.value();
  };
  FaultWatch watch;
  std::set<std::uint32_t> seen{hash(watch)};
  watch.judge(0.2F);
  EXPECT_TRUE(seen.insert(hash(watch)).second) << "weights and ages";
  watch.bank().predict(nav::InsCovarianceStep<float>{.dt_s = 0.1F, .r_dt = 0.1F * nav::Matrix3::Identity()});
  EXPECT_TRUE(seen.insert(hash(watch)).second) << "signatures";
  nav::Ins ins;
  static_cast<void>(ins.update(model::WheelSpeed{.forward_mps = 0.3F,
                                                 .sigma_forward_mps = 0.1F,
                                                 .sigma_lateral_mps = 2,
                                                 .sigma_vertical_mps = 2,
                                                 .moves = false},
                               100.0F, watch.bank()));
  EXPECT_TRUE(seen.insert(hash(watch)).second) << "evidence";
}

}  // namespace
}  // namespace tetap::estimators
