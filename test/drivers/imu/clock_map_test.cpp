// SPDX-License-Identifier: Apache-2.0
#include "drivers/imu/clock_map.hpp"

#include <gtest/gtest.h>

#include "tetap/base/random.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace tetap::drivers {
namespace {

constexpr std::int64_t kNominal = (std::int64_t{1} << 32) * 32 / 30;

struct Followed {
  double worst_us = 0;       ///< error of the line against the truth, once settled
  double worst_step_us = 0;  ///< error of the distance between two samples against the true one
  std::int32_t ppm = 0;
};

/// A clock `ppm` fast, a sample each millisecond of it, read up to `jitter_us` after it exists.
Followed follow(double ppm, std::uint32_t jitter_us, int seconds) {
  ClockMap map(kNominal);
  base::Random random(7);
  Followed run;
  std::int64_t before = 0;
  for (int k = 0; k < seconds * 1000; ++k) {
    const double true_us = 5e6 + 1000.0 * k / (1 + ppm * 1e-6);
    const auto ticks = static_cast<std::int64_t>(std::floor(937.5 * k));
    const auto read_us =
        static_cast<std::int64_t>(std::ceil(true_us)) + static_cast<std::int64_t>(random.next() % (jitter_us + 1));
    if (!map.running()) map.start(ticks, {read_us});
    EXPECT_TRUE(map.observe(ticks, {read_us}));
    const std::int64_t stamp = map.time(ticks).us;
    EXPECT_LE(stamp, read_us);
    if (k > seconds * 500) {
      run.worst_us = std::max(run.worst_us, std::abs(static_cast<double>(stamp) - true_us));
      run.worst_step_us =
          std::max(run.worst_step_us, std::abs(static_cast<double>(stamp - before) - 1000 / (1 + ppm * 1e-6)));
    }
    before = stamp;
  }
  run.ppm = map.rate_error_ppm();
  return run;
}

TEST(ClockMap, FindsRateAndOffsetOfAClockThatIsOff) {
  for (const double ppm : {-40'000.0, -15'000.0, -50.0, 0.0, 50.0, 15'000.0, 40'000.0}) {
    const Followed run = follow(ppm, 300, 30);
    EXPECT_LT(run.worst_us, 60) << ppm;
    EXPECT_LT(run.worst_step_us, 50) << ppm;
    EXPECT_NEAR(run.ppm, -1e6 * ppm / (1e6 + ppm), 60) << ppm;
  }
}

TEST(ClockMap, IsAsGoodAsItsLuckiestReadings) {
  EXPECT_LT(follow(10'000, 0, 20).worst_us, 4);
  EXPECT_LT(follow(10'000, 900, 20).worst_us, 150);
}

/// Largest error of the rate after `after_s`, of a chip at 1 kHz that a loop of `every_us` looks at: readings meet
/// samples once in a beat of both clocks.
double worst_rate_ppm(std::int64_t every_us, double after_s) {
  double worst = 0;
  for (const double ppm :
       {-9'000.0, -6'000.0, -3'000.0, -1'000.0, -200.0, -20.0, 20.0, 200.0, 1'000.0, 3'000.0, 6'000.0}) {
    for (const double phase_us : {0.0, 300.0, 700.0}) {
      ClockMap map(kNominal);
      base::Random random(7);
      for (std::int64_t t_us = 1'000; static_cast<double>(t_us) < after_s * 1e6; t_us += every_us) {
        const auto read_us = t_us + static_cast<std::int64_t>(random.next() % 20);
        const double sample = std::floor((static_cast<double>(read_us) - phase_us) * (1 + ppm * 1e-6) / 1'000);
        const auto ticks = static_cast<std::int64_t>(std::floor(937.5 * sample));
        if (!map.running()) map.start(ticks, {read_us});
        map.observe(ticks, {read_us});
      }
      worst = std::max(worst, std::abs(map.rate_error_ppm() + 1e6 * ppm / (1e6 + ppm)));
    }
  }
  return worst;
}

TEST(ClockMap, FindsTheRateInSecondsWhereReadingsBeatWithSamples) {
  for (const std::int64_t every_us : {1'000, 2'000, 10'000}) {
    EXPECT_LT(worst_rate_ppm(every_us, 5), 1'000) << every_us;
    EXPECT_LT(worst_rate_ppm(every_us, 10), 200) << every_us;
    EXPECT_LT(worst_rate_ppm(every_us, 30), 200) << every_us;
  }
}

TEST(ClockMap, ARestartWithinTheFirstSecondsLearnsFromItsOwnTicks) {
  ClockMap map(kNominal);
  for (std::int64_t ms = 0; ms < 8'000; ++ms) {
    if (ms == 0 || ms == 2'500) {
      map.stop();
      map.start(0, {ms * 1'000});
    }
    const std::int64_t since_ms = ms < 2'500 ? ms : ms - 2'500;
    map.observe(since_ms * 937 + since_ms / 2, {ms * 1'000});
  }
  EXPECT_NEAR(map.rate_error_ppm(), 0, 50);
}

TEST(ClockMap, AReadingThatPulledTheLineDownIsForgottenWithinSeconds) {
  ClockMap map(kNominal);
  const auto ticks = [](std::int64_t ms) { return ms * 15 / 16 * 1000; };
  map.start(0, {0});
  for (std::int64_t ms = 0; ms < 16'000; ms += 16) EXPECT_TRUE(map.observe(ticks(ms), {ms * 1000}));
  EXPECT_TRUE(map.observe(ticks(16'000), {16'000'000 - 900}));
  EXPECT_EQ(map.time(ticks(16'000)).us, 16'000'000 - 900);
  for (std::int64_t ms = 16'016; ms < 26'000; ms += 16) {
    EXPECT_TRUE(map.observe(ticks(ms), {ms * 1000}));
    if (ms > 22'000) {
      EXPECT_NEAR(static_cast<double>(map.time(ticks(ms)).us), static_cast<double>(ms * 1000), 150);
    }
  }
}

TEST(ClockMap, TicksIsTheInverseOfTime) {
  ClockMap map(kNominal);
  map.start(123'456, {777'000});
  for (std::int64_t us = -5'000'000; us < 5'000'000; us += 9'973) {
    EXPECT_LE(std::abs(map.time(map.ticks({us})).us - us), 2);
  }
}

TEST(ClockMap, ASampleFromTheFutureIsRefusedAndMovesNothing) {
  ClockMap map(kNominal);
  map.start(0, {1'000'000});
  const std::int64_t before = map.time(10'000).us;
  EXPECT_FALSE(map.observe(60'000, {1'001'000}));
  EXPECT_EQ(map.time(10'000).us, before);
}

TEST(ClockMap, NeverLeavesWhatAnOscillatorCanDo) {
  const Followed run = follow(150'000, 100, 10);
  EXPECT_LE(std::abs(run.ppm), 62'500);
}

}  // namespace
}  // namespace tetap::drivers
