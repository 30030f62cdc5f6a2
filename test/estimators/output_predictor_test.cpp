// SPDX-License-Identifier: Apache-2.0
// The present carried over the window, and how the work at its far end is shared out among ticks.
#include "tetap/estimators/inertial/output_predictor.hpp"
#include "tetap/base/state_words.hpp"

#include "tetap/estimators/inertial/inertial.hpp"
#include "tetap/node/fusion_window.hpp"

#include <gtest/gtest.h>
#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <random>
#include <vector>

namespace tetap::estimators {
namespace {

constexpr std::int64_t kImu_us = 5'000, kTick_us = 10'000, kWindow_us = 200'000;

sensor::Sample imu_sample(std::int64_t us, const nav::Vector3& w_b_radps, const nav::Vector3& f_b_mps2,
                          std::int64_t dt_us = kImu_us) {
  const auto shown = nav::ImuIncrement::constant(w_b_radps, f_b_mps2, {dt_us});
  sensor::Sample s;
  s.stamp = {us};
  s.sensor = sensor::Sensor::kImu;
  const auto& a = shown.dtheta_b_rad;
  const auto& v = shown.dv_b_mps;
  s.payload.imu = {.dangle_b_rad = {a(0), a(1), a(2)},
                   .dvelocity_b_mps = {v(0), v(1), v(2)},
                   .interval_us = static_cast<std::uint16_t>(dt_us)};
  return s;
}

std::vector<std::uint32_t> bits_of(const nav::InsState& x) {
  std::vector<std::uint32_t> all;
  const auto sink = [&](std::uint32_t word) { all.push_back(word); };
  base::each_word(x, sink);
  return all;
}

/// A window into which samples come, late ones too, and which they leave.
class Feed {
 public:
  explicit Feed(unsigned seed, bool wild) : random_(seed), wild_(wild) {}

  void tick() {
    now_us += kTick_us;
    for (std::int64_t us = now_us - kTick_us + kImu_us; us <= now_us; us += kImu_us) produce(us);
    for (auto it = waiting_.begin(); it != waiting_.end();) {
      if (one_in(3)) {
        put(*it);
        it = waiting_.erase(it);
      } else {
        ++it;
      }
    }
    std::size_t gone = 0;
    while (gone < window.size() && window[gone].stamp.us <= now_us - kWindow_us) {
      if (window[gone].sensor == sensor::Sensor::kImu) {
        far.last = window[gone].stamp;
        static_cast<void>(far.classifier.repeated(window[gone].payload.imu, 10));
      }
      ++gone;
    }
    window.erase(window.begin(), window.begin() + static_cast<std::ptrdiff_t>(gone));
    far.reached = far.last;
  }
  [[nodiscard]] bool one_in(int n) { return std::uniform_int_distribution<int>(1, n)(random_) == 1; }
  [[nodiscard]] float normal() { return std::normal_distribution<float>()(random_); }

  std::vector<sensor::Sample> window;
  std::vector<std::int64_t> arrived_us;
  OutputPredictor::Place far;
  std::int64_t now_us = 7'000'000;

 private:
  void put(const sensor::Sample& s) {
    if (s.stamp.us <= now_us - kWindow_us) return;
    const auto at = std::find_if(window.begin(), window.end(), [&](const sensor::Sample& w) { return w.order(s) > 0; });
    window.insert(at, s);
    arrived_us.push_back(s.stamp.us);
  }
  void produce(std::int64_t us) {
    if (wild_ && one_in(60)) fast_ = !fast_;
    const nav::Vector3 w = (fast_ ? 8.0F : 0.5F) * nav::Vector3(normal(), normal(), normal());
    sensor::Sample s =
        imu_sample(us + (wild_ ? static_cast<std::int64_t>(40 * normal()) : 0), w, {normal(), normal(), 9.8F});
    if (wild_) {
      if (one_in(80)) return;  // lost
      if (one_in(90)) s.payload.imu.dangle_b_rad[1] = std::nanf("");
      if (one_in(90)) s.payload.imu.clipped_gyro = 1;
      if (one_in(90)) s.payload.imu.clipped_accel = 1;
      if (one_in(90)) s.payload.imu.interval_us = static_cast<std::uint16_t>(one_in(2) ? 0 : 12'000);
      if (one_in(40)) repeating_ = 14;
      if (repeating_ > 0 && !window.empty()) {
        --repeating_;
        s.payload.imu = last_;
      }
      last_ = s.payload.imu;
      if (one_in(25)) {
        sensor::Sample other = s;
        other.sensor = sensor::Sensor::kWheelCounts;
        put(other);
      }
      if (one_in(50)) return waiting_.push_back(s);
    }
    put(s);
  }

  std::mt19937 random_;
  bool wild_, fast_ = false;
  int repeating_ = 0;
  sensor::ImuSample last_;
  std::vector<sensor::Sample> waiting_;
};

OutputPredictor::Inputs inputs(const param::InertialParameters& n, const nav::Earth& earth, bool turn_known = true) {
  return {.parameters = n, .earth = earth, .turn_known = turn_known, .wheel_turn_radps = 0.1F};
}

/// Lost, late, repeated, clipped, broken samples, tumbling and calm. Cells that grew sample by sample over the ticks
/// have the bits of cells made at once of the same window.
TEST(OutputPredictor, ItsCellsAreNoMoreThanACache) {
  const param::InertialParameters n;
  const nav::Earth earth;
  for (unsigned seed = 1; seed <= 20; ++seed) {
    Feed feed(seed, true);
    OutputPredictor grown;
    for (int i = 0; i < 400; ++i) {
      feed.tick();
      for (const std::int64_t us : feed.arrived_us) static_cast<void>(grown.note_arrival({us}));
      feed.arrived_us.clear();
      const bool turn_known = !feed.one_in(4);
      if (feed.one_in(3)) {
        grown.extend(feed.window, inputs(n, earth, turn_known));
        continue;
      }
      grown.rebuild(feed.far, feed.window, inputs(n, earth, turn_known));
      OutputPredictor fresh;
      fresh.rebuild(feed.far, feed.window, inputs(n, earth, turn_known));
      ASSERT_EQ(bits_of(grown.place().x), bits_of(fresh.place().x)) << seed << ' ' << i;
      ASSERT_EQ(grown.place().reached, fresh.place().reached);
      ASSERT_EQ(grown.place().last, fresh.place().last);
      ASSERT_EQ(grown.place().unseen_s, fresh.place().unseen_s);
      ASSERT_EQ(grown.place().unseen_turn_s, fresh.place().unseen_turn_s);
    }
  }
}

/// The same worlds, against every sample looked at by itself. The place that was reached, and by which sample, is
/// exactly the same. The sums differ by rounding and by what second order leaves of a wild turn.
TEST(OutputPredictor, ItsCellsSayWhatTheirSamplesSay) {
  const param::InertialParameters n;
  const nav::Earth earth;
  int updates = 0;
  for (unsigned seed = 1; seed <= 20; ++seed) {
    Feed feed(seed, true);
    for (int i = 0; i < 200; ++i) {
      feed.tick();
      const bool turn_known = !feed.one_in(4);
      OutputPredictor cells, each;
      cells.rebuild(feed.far, feed.window, inputs(n, earth, turn_known));
      each.rebuild(feed.far, std::vector<sensor::Sample>{}, inputs(n, earth, turn_known));
      each.extend(feed.window, inputs(n, earth, turn_known));
      ASSERT_EQ(cells.place().reached, each.place().reached) << seed << ' ' << i;
      ASSERT_EQ(cells.place().last, each.place().last);
      ASSERT_EQ(cells.place().unseen_s, each.place().unseen_s) << "lost or clipped";
      ASSERT_EQ(cells.place().unseen_turn_s, each.place().unseen_turn_s);
      ASSERT_EQ(cells.last_seen(), each.last_seen());
      ASSERT_EQ(cells.place().rate_b_radps, each.place().rate_b_radps);
      const auto bits = [](const checks::ImuClassifier& r) {
        std::vector<std::uint32_t> all;
        const auto sink = [&](std::uint32_t word) { all.push_back(word); };
        base::each_word(r, sink);
        return all;
      };
      ASSERT_EQ(bits(cells.place().classifier), bits(each.place().classifier));
      ASSERT_LT(cells.place().x.minus(each.place().x).norm(), 0.05F);
      if (cells.place().reached.us > feed.far.reached.us) ++updates;
    }
  }
  EXPECT_GT(updates, 3000);
}

/// Over cells, or on from tick to tick: where every sample by itself leads.
TEST(OutputPredictor, LeadsWhereSampleBySampleStrapdownLeads) {
  const param::InertialParameters n;
  const nav::Earth earth;
  Feed feed(3, false);
  for (int i = 0; i < 25; ++i) feed.tick();
  OutputPredictor anew, on;
  on.rebuild(feed.far, feed.window, inputs(n, earth));
  for (int i = 0; i < 10; ++i) {
    feed.tick();
    on.extend(feed.window, inputs(n, earth));
  }
  // Both from where the window began.
  nav::InsState each;
  Feed again(3, false);
  for (int i = 0; i < 25; ++i) again.tick();
  for (const sensor::Sample& s : again.window) nav::strapdown(each, checks::increment_of(s.payload.imu), earth);
  for (const sensor::Sample& s : feed.window)
    if (s.stamp > again.window.back().stamp) nav::strapdown(each, checks::increment_of(s.payload.imu), earth);
  const auto off = on.at({feed.now_us}, inputs(n, earth)).minus(each);
  EXPECT_LT(off.head<3>().norm(), 2e-3F);
  EXPECT_LT(off.segment<3>(3).norm(), 1e-3F);
  EXPECT_LT(off.segment<3>(6).norm(), 1e-4F);

  anew.rebuild(feed.far, feed.window, inputs(n, earth));
  each = {};
  for (const sensor::Sample& s : feed.window) nav::strapdown(each, checks::increment_of(s.payload.imu), earth);
  const auto off_anew = anew.place().x.minus(each);
  EXPECT_LT(off_anew.head<3>().norm(), 2e-3F);
  EXPECT_LT(off_anew.segment<3>(3).norm(), 1e-3F);
  EXPECT_LT(off_anew.segment<3>(6).norm(), 1e-4F);
}

TEST(OutputPredictor, SaysWhenASampleComesThatItWentOnWithout) {
  const param::InertialParameters n;
  const nav::Earth earth;
  OutputPredictor ahead;
  std::vector<sensor::Sample> window{imu_sample(105'000, {0, 0, 1}, {0, 0, 9.8F}),
                                     imu_sample(115'000, {0, 0, 1}, {0, 0, 9.8F})};
  for (const sensor::Sample& s : window) EXPECT_FALSE(ahead.note_arrival(s.stamp));
  ahead.rebuild({.reached = {100'000}, .last = {100'000}}, window, inputs(n, earth));
  EXPECT_FALSE(ahead.note_arrival({120'000}));
  EXPECT_TRUE(ahead.note_arrival({110'000}));
}

/// Half of the samples of a fast IMU are lost, in a curve. The sums of a cell and the missing samples between them lead
/// where all samples lead. The time without samples is that of the lost ones.
TEST(OutputPredictor, BridgesTheHolesOfAFastImuCellByCell) {
  const param::InertialParameters n;
  const nav::Earth earth;
  constexpr std::int64_t kFast_us = 2'500, kBegin_us = 100'000;
  std::mt19937 random(5);
  std::normal_distribution<float> normal;
  nav::InsState each;
  each.v_n_mps = {2, 0, 0};
  const nav::InsState begin = each;
  std::vector<sensor::Sample> window;
  int lost = 0;
  for (int k = 1; k <= 192; ++k) {
    const nav::Vector3 noise{normal(random), normal(random), normal(random)};
    const sensor::Sample s = imu_sample(kBegin_us + k * kFast_us, nav::Vector3{0, 0, 0.2F} + 1e-3F * noise,
                                        nav::Vector3{0, 0.4F, earth.gravity_mps2} + 1e-2F * noise, kFast_us);
    static_cast<void>(nav::strapdown(each, checks::increment_of(s.payload.imu), earth));
    if (k % 2 == 0 || k < 3) {
      window.push_back(s);
    } else {
      ++lost;
    }
  }
  OutputPredictor ahead;
  ahead.rebuild({.x = begin, .reached = {kBegin_us}, .last = {kBegin_us}}, window, inputs(n, earth));
  EXPECT_EQ(ahead.place().reached.us, kBegin_us + 192 * kFast_us);
  EXPECT_NEAR(ahead.place().unseen_s, static_cast<float>(lost) * 2.5e-3F, 1e-4F);
  const auto off = ahead.place().x.minus(each);
  EXPECT_LT(off.head<3>().norm(), 5e-3F);
  EXPECT_LT(off.segment<3>(3).norm(), 0.01F);
  EXPECT_LT(off.segment<3>(6).norm(), 1e-3F);
}

/// Missing samples at the end are bridged: the turn is kept for a few samples, then the wheels' word taken.
TEST(OutputPredictor, GoesOnStraightThroughWhatIsMissing) {
  param::InertialParameters n;
  nav::Earth earth;
  OutputPredictor ahead;
  nav::InsState x;
  x.v_n_mps = {2, 0, 0};
  const std::vector<sensor::Sample> window{imu_sample(105'000, {0, 0, 1}, {0, 2, earth.gravity_mps2})};
  ahead.rebuild({.x = x, .reached = {100'000}, .last = {100'000}}, window, inputs(n, earth));
  const auto after = [&](std::int64_t us, bool known) { return ahead.at({105'000 + us}, inputs(n, earth, known)); };
  EXPECT_NEAR(nav::euler(after(50'000, false).q_nb).yaw_rad, 0.055F, 1e-4F);
  EXPECT_NEAR(after(50'000, false).v_n_mps.norm(), 2.0F, 1e-3F);
  EXPECT_NEAR(nav::euler(after(400'000, true).q_nb).yaw_rad, 0.005F + 0.04F, 1e-4F);
  EXPECT_NEAR(nav::euler(after(400'000, false).q_nb).yaw_rad, 0.005F, 1e-4F);
  EXPECT_NEAR(after(400'000, false).v_n_mps.norm(), 2.0F, 1e-3F);
  // The driven way turns with it.
  for (const nav::InsState& at : {after(50'000, false), after(400'000, true), after(400'000, false)})
    EXPECT_NEAR(at.q_nb.conjugate().rotate(at.v_n_mps)(1), 0.0F, 5e-3F);
}

/// The node's part between inbox and publisher, driving straight at 1 m/s.
class Ticks {
 public:
  explicit Ticks(const param::Parameters& of) : n_(of) {
    map_frame_.frame = nav::LocalFrame(24'131'350'000, 5'834'150'000, 500.0F);
    map_frame_.origin = sensor::OriginSource::kConfigured;
    history_.power_on({us_}, context());
    history_.each_slot([&](auto& slot) {
      slot.set_pose({us_}, {.pose = {}, .sigma_position_m = 0.1F, .sigma_yaw_rad = 0.01F}, context());
    });
  }
  bool imu = true, speeds = false, stuck = false;
  std::int64_t unused_us = 0;  ///< a magnetometer that is not used
  /// Measurements taken in the tick.
  int tick(std::int64_t imu_us, std::int64_t wheels_us, std::int64_t gnss_us) {
    const std::int64_t end = us_ + kTick_us;
    for (us_ += 1'000; us_ <= end; us_ += 1'000) {
      const float t_s = 1e-6F * static_cast<float>(us_ - kBegin_us);
      if (imu && us_ % imu_us == 0) {
        if (!stuck) last_ = imu_sample(us_, {shake(), shake(), shake()}, {shake(), shake(), 9.806F + shake()}, imu_us);
        insert(last_);
      }
      if (unused_us > 0 && us_ % unused_us == 0) {
        sensor::Sample s;
        s.sensor = sensor::Sensor::kMagnetometer;
        s.payload.magnetic = {.flux_b_uT = {20, 0, -40}};
        insert(s);
      }
      if (speeds && us_ % wheels_us == 0) {
        sensor::Sample s;
        s.sensor = sensor::Sensor::kWheelSpeed;
        s.payload.wheel_speeds = {.left_mps = 1, .right_mps = 1};
        insert(s);
      }
      if (!speeds && us_ % wheels_us == 0) {
        sensor::Sample s;
        s.sensor = sensor::Sensor::kWheelCounts;
        const auto count = static_cast<std::uint16_t>(std::lround(t_s / (6.2831853F * 0.1F) * 2000.0F));
        s.payload.counts = {.left = count, .right = count};
        insert(s);
      }
      if (us_ % gnss_us == 0) {
        sensor::Sample s;
        s.sensor = sensor::Sensor::kGnssVelocity;
        s.payload.gnss_velocity = {.v_n_mps = {1, 0, 0}, .acc_mps = 0.1F};
        insert(s);
      }
    }
    us_ = end;
    int taken = 0;
    const auto note = [&](std::size_t, const sensor::Sample& s, const Innovation& record) {
      late_us = std::max(late_us, us_ - kWindow_us - s.stamp.us);
      if (record.dof > 0) ++taken, ++fused[s.sensor];
    };
    static_cast<void>(history_.consume(
        {us_}, context(), [](const sensor::Sample&) {}, note));
    history_.advance({us_}, context());
    history_.retire_until({us_ - kWindow_us}, context(), note);
    return taken;
  }
  [[nodiscard]] Estimate now() const { return history_.primary().estimate(context()); }
  [[nodiscard]] float sigma_mps() const {
    return base::sqrt(history_.primary().motion_variance(context()).forward_m2ps2);
  }
  std::int64_t late_us = 0;  ///< delay of the last output behind the end of the window, at most
  std::map<sensor::Sensor, int> fused;

 private:
  static constexpr std::int64_t kBegin_us = 10'000'000;
  void insert(sensor::Sample s) {
    s.stamp = {us_};
    s.sequence = static_cast<std::uint8_t>(us_ / 1000);
    static_cast<void>(history_.insert(s, context(), [](std::size_t, const sensor::Sample&, const Innovation&) {}));
  }
  sensor::Sample last_;
  float shake() { return 0.01F * std::normal_distribution<float>()(random_); }
  [[nodiscard]] Context context() const { return {n_, map_frame_}; }

  param::Parameters n_;
  MapFrame map_frame_;
  node::FusionWindow<node::Estimators<Inertial>, 200> history_;
  std::int64_t us_ = kBegin_us;
  std::mt19937 random_{1};
};

param::Parameters rover_like() {
  param::Parameters n;
  n.wheels.drive = {.left_radius_m = 0.1F, .right_radius_m = 0.1F, .track_m = 0.5F, .counts_per_turn = 2000};
  return n;
}

/// Wheels and GNSS at the same moments: a tick takes one, none is lost, and the far end does not fall behind.
TEST(InertialWork, ATickTakesOneMeasurement) {
  Ticks ticks(rover_like());
  int most = 0, ahead = 0;
  for (int i = 0; i < 200; ++i) ticks.tick(5'000, 10'000, 200'000);  // the start, and standing until it moved
  ticks.fused.clear();
  ticks.late_us = 0;
  for (int i = 0; i < 1000; ++i) most = std::max(most, ticks.tick(5'000, 10'000, 200'000));
  ahead = ticks.fused[sensor::Sensor::kWheelCounts];
  EXPECT_EQ(most, 1);
  EXPECT_NEAR(ticks.fused[sensor::Sensor::kGnssVelocity], 50, 1);
  EXPECT_NEAR(ahead, 500, 2);  // of 1000: a difference over two
  EXPECT_LT(ticks.late_us, 50'000);
}

/// More than a tick takes: two then, and it stays within what is allowed.
TEST(InertialWork, WhatIsFarBehindIsCaughtUpWith) {
  param::Parameters n = rover_like();
  n.inertial.wheels_every_us = 0;
  Ticks ticks(n);
  for (int i = 0; i < 200; ++i) ticks.tick(2'000, 10'000, 50'000);
  ticks.fused.clear();
  ticks.late_us = 0;
  for (int i = 0; i < 1000; ++i) ticks.tick(2'000, 10'000, 50'000);
  EXPECT_NEAR(ticks.fused[sensor::Sensor::kWheelCounts], 1000, 8);
  EXPECT_NEAR(ticks.fused[sensor::Sensor::kGnssVelocity], 200, 3);
  EXPECT_LT(ticks.late_us, 110'000);
}

TEST(InertialWork, SpeedsAtAHighRateAreThinnedNotQueued) {
  Ticks ticks(rover_like());
  ticks.speeds = true;
  for (int i = 0; i < 200; ++i) ticks.tick(5'000, 5'000, 100'000);
  ticks.late_us = 0;
  for (int i = 0; i < 1000; ++i) ticks.tick(5'000, 5'000, 100'000);
  EXPECT_LT(ticks.late_us, 70'000);
}

TEST(InertialWork, WhatIsNotUsedCostsNothing) {
  Ticks ticks(rover_like());
  ticks.unused_us = 10'000;
  for (int i = 0; i < 200; ++i) ticks.tick(5'000, 20'000, 200'000);
  ticks.late_us = 0;
  for (int i = 0; i < 1000; ++i) ticks.tick(5'000, 20'000, 200'000);
  EXPECT_LT(ticks.late_us, 40'000);
}

/// Back after 150 ms, the IMU does not say what happened meanwhile: until wheels have told the far end that lies
/// behind.
TEST(InertialWork, AHoleInTheWindowIsDoubtedUntilTheFarEndHasCrossedIt) {
  Ticks ticks(rover_like());
  for (int i = 0; i < 300; ++i) ticks.tick(5'000, 10'000, 200'000);
  const float before = ticks.sigma_mps();
  ticks.imu = false;
  for (int i = 0; i < 15; ++i) ticks.tick(5'000, 10'000, 200'000);
  EXPECT_GT(ticks.sigma_mps(), 5.0F * before);
  ticks.imu = true;
  for (int i = 0; i < 15; ++i) {
    ticks.tick(5'000, 10'000, 200'000);
    EXPECT_GT(ticks.sigma_mps(), 5.0F * before) << i;
  }
  for (int i = 0; i < 200; ++i) ticks.tick(5'000, 10'000, 200'000);
  EXPECT_LT(ticks.sigma_mps(), 1.5F * before);
}

/// An IMU that dies or repeats itself, with measurements waiting. The filter goes on without it, and is no less sure
/// than wheels and GNSS make it.
TEST(InertialWork, AnImuThatDiesIsGoneOnWithout) {
  for (const bool stuck : {false, true}) {
    param::Parameters n = rover_like();
    n.inertial.wheels_every_us = 0;
    Ticks ticks(n);
    ticks.speeds = true;
    for (int i = 0; i < 300; ++i) ticks.tick(5'000, 10'000, 50'000);
    ticks.stuck = stuck;
    ticks.imu = stuck;
    for (int i = 0; i < 600; ++i) ticks.tick(5'000, 10'000, 50'000);
    const Estimate e = ticks.now();
    EXPECT_NEAR(e.pose.x.minus({}), 8.0F, 0.1F) << stuck;  // the first of nine seconds it levels
    EXPECT_NEAR(e.forward_mps, 1.0F, 0.05F) << stuck;
    EXPECT_LT(e.p(0, 0), 1.0F) << stuck;
  }
}

}  // namespace
}  // namespace tetap::estimators
