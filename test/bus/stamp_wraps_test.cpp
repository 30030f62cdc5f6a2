// SPDX-License-Identifier: Apache-2.0
// No delay is taken for another one. A sample that was held for longer than half a wrap of its stamp is placed at its
// true time. Otherwise it is at least not placed where it would be fused. A model of a gateway holds it; the true stamp
// is the model's.
#include "tetap/bus/stamp_wraps.hpp"
#include "tetap/bus/fault_hold.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace tetap::bus {
namespace {

constexpr std::int64_t kBegin_us = 40'000'000, kHold_us = 60'000'000, kEnd_us = 90'000'000, kWindow_us = 200'000;

struct Arrival {
  std::int64_t at_us, stamp_us;
  std::uint8_t sequence;
};
struct Sensor {
  const char* name;
  sensor::Sensor kind;
  std::int64_t period_us, latency_us;
  double jitter_us;
};
const std::vector<Sensor> kSensors{{"IMU 200 Hz", sensor::Sensor::kImu, 5'000, 1'000, 20},
                                   {"IMU 100 Hz", sensor::Sensor::kImu, 10'000, 500, 30},
                                   {"wheels 100 Hz", sensor::Sensor::kWheelCounts, 10'000, 1'500, 50},
                                   {"wheels 50 Hz", sensor::Sensor::kWheelSpeed, 20'000, 3'000, 300},
                                   {"wheels 10 Hz", sensor::Sensor::kBodySpeed, 100'000, 8'000, 500},
                                   {"GNSS 5 Hz", sensor::Sensor::kGnssPosition, 200'000, 90'000, 0},
                                   {"GNSS 1 Hz", sensor::Sensor::kGnssVelocity, 1'000'000, 120'000, 0}};

/// The sensor on its own; every sample with its sequence.
std::vector<Arrival> clean(const Sensor& s, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> jitter(0, 1);
  std::vector<Arrival> all;
  for (std::int64_t k = 0; kBegin_us + k * s.period_us < kEnd_us; ++k) {
    const std::int64_t stamp = kBegin_us + k * s.period_us + std::llround(s.jitter_us * jitter(random));
    all.push_back({stamp + s.latency_us, stamp, static_cast<std::uint8_t>(k & 15)});
  }
  return all;
}

struct Judged {
  int twice = 0;    ///< two senders were named
  int wrong = 0;    ///< placed within the window, and not where it was true
  int refused = 0;  ///< true within the window, and placed elsewhere
  int held = 0;     ///< true beyond the window
};
Judged judge(const Sensor& s, std::vector<Arrival> arrivals) {
  std::stable_sort(arrivals.begin(), arrivals.end(), [](const auto& a, const auto& b) { return a.at_us < b.at_us; });
  StampWraps wraps;
  Judged judged;
  for (const Arrival& a : arrivals) {
    const base::Micros now{a.at_us / 10'000 * 10'000};  // the last tick
    sensor::Sample sample;
    sample.sensor = s.kind;
    sample.sequence = a.sequence;
    sample.stamp = base::extend(static_cast<std::uint32_t>(a.stamp_us & 0xFFFFF), 20, now);
    const std::int64_t placed_us = wraps.place(sample, now).us;
    judged.twice += wraps.two_senders(sample) ? 1 : 0;
    const bool fused = placed_us > now.us - kWindow_us && placed_us <= now.us + kWindow_us;
    const bool fresh = a.stamp_us > now.us - kWindow_us;
    judged.wrong += fused && placed_us != a.stamp_us ? 1 : 0;
    judged.refused += fresh && placed_us != a.stamp_us ? 1 : 0;
    judged.held += fresh ? 0 : 1;
  }
  return judged;
}

const std::vector<double> kDelays_s{0.3,   0.5,  0.52, 0.53, 0.6, 0.85, 0.9,  1.0, 1.03, 1.04, 1.048,
                                    1.049, 1.06, 1.2,  1.5,  1.9, 2.08, 2.09, 2.1, 2.2,  2.5};

TEST(StampWraps, WhatAGatewayHeldAndThenSendsAtOnceIsPlacedWhereItWasTrue) {
  for (const Sensor& s : kSensors)
    for (const double delay_s : kDelays_s) {
      auto all = clean(s, 1);
      const std::int64_t end_us = kHold_us + std::llround(1e6 * delay_s);
      for (Arrival& a : all)
        if (a.at_us > kHold_us) a.at_us = std::max(a.at_us, end_us);
      const Judged j = judge(s, all);
      EXPECT_EQ(j.wrong, 0) << s.name << ' ' << delay_s;
      EXPECT_EQ(j.refused, 0) << s.name << ' ' << delay_s;
      if (delay_s > 1.5) {
        EXPECT_GT(j.held, 0) << s.name << ' ' << delay_s;
      }
    }
}

// Ten seconds late, then on time again: for a while late and fresh samples come in turn.
TEST(StampWraps, WhatComesLateForAWhileIsPlacedWhereItWasTrue) {
  for (const Sensor& s : kSensors)
    for (const double delay_s : kDelays_s) {
      auto all = clean(s, 2);
      const std::int64_t delay_us = std::llround(1e6 * delay_s);
      for (Arrival& a : all)
        if (a.at_us > kHold_us && a.at_us < kHold_us + 10'000'000) a.at_us += delay_us;
      const Judged j = judge(s, all);
      EXPECT_EQ(j.wrong, 0) << s.name << ' ' << delay_s;
      EXPECT_LE(j.refused, 2) << s.name << ' ' << delay_s;
      EXPECT_EQ(j.twice, 0) << s.name << ' ' << delay_s;
    }
}

TEST(StampWraps, SamplesThatAreLostForAWhileDoNotMakeTheRestLate) {
  int refused = 0, kinds = 0;
  for (const Sensor& s : kSensors)
    for (double outage_s = 0.3; outage_s < 12; outage_s += 0.0937) {
      auto all = clean(s, 3);
      const std::int64_t end_us = kHold_us + std::llround(1e6 * outage_s);
      std::erase_if(all, [&](const Arrival& a) { return a.at_us > kHold_us && a.at_us < end_us; });
      refused += judge(s, all).refused > 0 ? 1 : 0, ++kinds;
    }
  EXPECT_EQ(refused, 0) << "of " << kinds;
}

// The other sender is as fast or half as fast, and counts by itself. Samples of one sender that are lost, or come in
// another order, name nobody.
TEST(StampWraps, TwoSendersOfOneIdentifierAreNamed) {
  for (const Sensor& s : kSensors)
    for (const int every : {1, 2}) {
      auto all = clean(s, 5);
      std::vector<Arrival> other;
      for (std::size_t k = 0; k < all.size(); k += static_cast<std::size_t>(every)) {
        const auto count = static_cast<std::size_t>(every);
        other.push_back({all[k].at_us + s.period_us / 2, all[k].stamp_us + s.period_us / 2,
                         static_cast<std::uint8_t>((k / count + 5) & 15)});
      }
      const std::size_t both = all.size() + other.size();
      all.insert(all.end(), other.begin(), other.end());
      EXPECT_GT(judge(s, all).twice, static_cast<int>(both / (every == 1 ? 2 : 5))) << s.name << ' ' << every;
    }
  for (const Sensor& s : kSensors) {
    auto all = clean(s, 6);
    std::mt19937 random(7);
    std::erase_if(all, [&random](const Arrival&) { return random() % 3 == 0; });
    EXPECT_EQ(judge(s, all).twice, 0) << s.name;
    if (s.period_us > 500'000) continue;  // a later sample would be half a wrap ahead
    all = clean(s, 8);
    for (std::size_t k = 1; k < all.size(); k += 2 + random() % 3) std::swap(all[k - 1].at_us, all[k].at_us);
    EXPECT_EQ(judge(s, all).twice, 0) << s.name;
  }
  FaultHold faults;
  faults.note({.two_senders = 1}, 1, 10);
  EXPECT_EQ(faults.faults(1).bits, 1U << static_cast<unsigned>(sensor::Fault::kIdConflict)) << "and no other word";
}

// A sensor that pauses and counts on cannot be told from one that is held, where its period happens to fit.
TEST(StampWraps, ASensorThatPausesIsSeldomTakenForLateAndNeverForEver) {
  int late = 0, kinds = 0;
  for (const Sensor& s : kSensors)
    for (double pause_s = 0.3; pause_s < 12; pause_s += 0.0937) {
      auto all = clean(s, 4);
      const std::int64_t by_us = std::llround(1e6 * pause_s) / s.period_us * s.period_us;
      for (Arrival& a : all)
        if (a.at_us > kHold_us) a.at_us += by_us, a.stamp_us += by_us;
      late += judge(s, all).refused > 0 ? 1 : 0, ++kinds;
    }
  EXPECT_LT(late, kinds / 50) << "of " << kinds;
}

}  // namespace
}  // namespace tetap::bus
