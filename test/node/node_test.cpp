// SPDX-License-Identifier: Apache-2.0
// Promises that a user of the node relies on. Order and lateness leave no trace, every epoch is accounted for, commands
// mean what their names state.
#include "bench.hpp"

#include <gtest/gtest.h>
#include <algorithm>
#include <cmath>
#include <random>

namespace tetap::test {
namespace {

/// A drive past two landmarks; each epoch has a speed sample, and every fifth a few sightings with a stamp between the
/// ticks.
std::vector<Frames> drive(int epochs) {
  std::vector<Frames> all;
  std::mt19937 random(3);
  std::normal_distribution<float> normal;
  for (int k = 0; k < epochs; ++k) {
    const std::int64_t t = Bench::kStart_us + 10'000 * (k + 1);
    Frames frames;
    if (k == 0) {
      frames = set_pose(1, 0, 0, 0.0F);
      frames.push_back(map_entry(7, 5000, 3000));
      frames.push_back(map_entry(9, -2000, 4000));
    }
    frames.push_back(body_speed(t - 3'000, 0.5F + 0.01F * normal(random), 0.2F, k));
    if (k > 2 && k % 5 == 0)
      for (int i = 0; i < 3; ++i)
        frames.push_back(sighting(t - 7'000 + 1'000 * i, i == 1 ? 9 : 7, 4.0F + 0.1F * normal(random),
                                  0.5F + 0.1F * normal(random), i));
    all.push_back(frames);
  }
  return all;
}

Frames run(Bench& bench, const std::vector<Frames>& epochs) {
  Frames out;
  for (const auto& in : epochs)
    for (const auto& frame : bench.epoch(in)) out.push_back(frame);
  return out;
}

TEST(Node, OrderOfArrivalWithinAnEpochHasNoEffectOnAnyByte) {
  auto epochs = drive(300);
  Bench straight;
  const Frames expected = run(straight, epochs);
  std::mt19937 random(1);
  for (int trial = 0; trial < 5; ++trial) {
    for (auto& frames : epochs) std::shuffle(frames.begin(), frames.end(), random);
    Bench shuffled;
    EXPECT_EQ(run(shuffled, epochs), expected);
  }
}

TEST(Node, ALateSampleEndsInTheSameStateAsOneOnTime) {
  auto on_time = drive(200);
  auto late = on_time;
  for (std::size_t k = 10; k + 12 < late.size(); k += 5) {  // the sightings of an epoch come 110 ms later
    auto& frames = late[k];
    Frames sightings;
    std::erase_if(frames, [&](const auto& f) { return f.id == 0x309 && (sightings.push_back(f), true); });
    auto& then = late[k + 11];
    then.insert(then.end(), sightings.begin(), sightings.end());
  }
  Bench a, b;
  const Frames first = run(a, on_time), second = run(b, late);
  const Frames first_end = a.idle(30), second_end = b.idle(30);  // until the last has come and the window has closed
  EXPECT_EQ(last<bus::EstStateCrc>(first_end)->crc, last<bus::EstStateCrc>(second_end)->crc);
  EXPECT_EQ(last<bus::EstPos>(first_end, 1), last<bus::EstPos>(second_end, 1));
  EXPECT_NE(first, second) << "while it was missing the estimate was another";
}

TEST(Node, BeyondTheWindowASampleIsRefusedCountedAndSaid) {
  Bench bench;
  run(bench, drive(60));
  const Frames out = bench.epoch({sighting(bench.now_us - 300'000, 7, 4.0F, 0.5F)});
  Bench same;
  run(same, drive(60));
  const Frames reference = same.epoch({});
  EXPECT_EQ(last<bus::EstStateCrc>(out)->crc, last<bus::EstStateCrc>(reference)->crc) << "it changed nothing";
  const Frames later = bench.idle(100);
  EXPECT_EQ(last<bus::EstDiagOrder>(later)->too_late, 1);
  const auto events = all<bus::EstInnov>(later);
  EXPECT_EQ(
      std::count_if(events.begin(), events.end(), [](const auto& e) { return e.verdict == sensor::Verdict::kTooLate; }),
      1);
}

TEST(Node, ADuplicateFrameChangesTheTallyAndNothingElse) {
  auto epochs = drive(100);
  Bench a;
  const Frames expected = run(a, epochs);
  for (auto& frames : epochs)
    if (!frames.empty()) frames.push_back(frames.back());
  Bench b;
  const Frames got = run(b, epochs);
  EXPECT_EQ(last<bus::EstStateCrc>(expected)->crc, last<bus::EstStateCrc>(got)->crc);
  EXPECT_EQ(last<bus::EstStateCrc>(got)->in_count - last<bus::EstStateCrc>(expected)->in_count, 100);
  EXPECT_NE(last<bus::EstEpoch>(expected)->in_crc, last<bus::EstEpoch>(got)->in_crc);
}

TEST(Node, EveryInputBitReachesTheTallyAndTheStateCrc) {
  const auto epochs = drive(40);
  Bench plain;
  const Frames expected = run(plain, epochs);
  const Frames expected_later = plain.idle(5);
  int state_changed = 0, flips = 0;
  for (int bit = 26; bit < 64; ++bit) {  // the values of a speed sample
    auto flipped = epochs;
    auto& data = flipped[20].front().data;
    data[static_cast<std::size_t>(bit / 8)] =
        static_cast<std::uint8_t>(data[static_cast<std::size_t>(bit / 8)] ^ (1U << (bit % 8)));
    Bench bench;
    const Frames got = run(bench, flipped);
    EXPECT_NE(last<bus::EstEpoch>(got)->in_crc, last<bus::EstEpoch>(expected)->in_crc) << bit;
    state_changed += last<bus::EstStateCrc>(got)->crc != last<bus::EstStateCrc>(expected)->crc ? 1 : 0;
    ++flips;
  }
  EXPECT_EQ(state_changed, flips);
}

TEST(Node, EveryEpochBeginsAndEndsAndCountsItsFrames) {
  Bench bench;
  std::uint8_t epoch = 0;
  for (const auto& in : drive(120)) {
    const Frames out = bench.epoch(in);
    ASSERT_EQ(out.front().id, 0x320U);
    ASSERT_EQ(out.back().id, 0x321U);
    const auto end = last<bus::EstStateCrc>(out);
    EXPECT_EQ(end->frames, out.size());
    EXPECT_EQ(end->epoch, ++epoch);
    EXPECT_EQ(last<bus::EstEpoch>(out)->time_us, static_cast<std::uint64_t>(bench.now_us));
  }
}

TEST(Node, SendsNoMoreThanSixHundredFramesPerSecond) {
  Bench bench;
  const Frames out = run(bench, drive(1000));
  EXPECT_LE(out.size(), 6000U);
  EXPECT_GE(out.size(), 4500U);
}

TEST(Node, SetPoseMovesTheEstimateAndIsAnnounced) {
  Bench bench;
  bench.idle(20);
  EXPECT_FALSE(last<bus::EstMotion>(bench.idle(1), 1)->pos_valid);
  bench.epoch(set_pose(3, 12'000, -8'000, 1.0F, 0.25F, 0.1F));
  const Frames out = bench.idle(20);
  EXPECT_EQ(last<bus::EstPos>(out, 1)->x_raw, 12'000);
  EXPECT_EQ(last<bus::EstPos>(out, 1)->y_raw, -8'000);
  EXPECT_NEAR(last<bus::EstMotion>(out, 1)->yaw_rad, 1.0F, 1e-4F);
  EXPECT_TRUE(last<bus::EstMotion>(out, 1)->pos_valid);
  EXPECT_NEAR(last<bus::EstStdPose>(out, 1)->std_x_m, 0.25F, 1e-3F);
  EXPECT_EQ(last<bus::EstStatus>(out)->reset_ctr, 1);
  EXPECT_EQ(last<bus::EstStatus>(out)->reset_cause, sensor::ResetCause::kSetPose);
}

TEST(Node, APoseGivenWithAllSigmasZeroIsTakenAndKept) {
  Bench bench;
  bench.idle(5);
  Frames out = bench.epoch(set_pose(1, 2'000, 3'000, 0.5F, 0.0F, 0.0F));
  for (const auto& frame : bench.idle(20)) out.push_back(frame);
  EXPECT_EQ(last<bus::EstStatus>(out)->reset_cause, sensor::ResetCause::kSetPose);
  EXPECT_EQ(last<bus::EstStatus>(out)->reset_ctr, 1);
  EXPECT_EQ(last<bus::EstPos>(out, 1)->x_raw, 2'000);
}

TEST(Node, ACommandWithAWrongCrcOrARepeatedCounterIsRefused) {
  Bench bench;
  auto pose = set_pose(3, 1000, 0, 0.0F);
  pose[0].data[3] ^= 1;
  bench.epoch(pose);
  bench.epoch(set_pose(4, 2000, 0, 0.0F));
  bench.epoch(set_pose(4, 9000, 0, 0.0F));  // heard already
  const Frames out = bench.idle(120);
  EXPECT_EQ(last<bus::EstPos>(out, 1)->x_raw, 2000);
  EXPECT_EQ(last<bus::EstDiagRefused>(out)->cmd_refused,
            4);  // and the good half of the first command, that waited for the other
}

TEST(Node, ResetRestartsTheEstimators) {
  Bench bench;
  run(bench, drive(60));
  const Frames out = bench.epoch({in(bus::protect(bus::CmdReset{.ctr = 2, .what = bus::ResetWhat::kEstimators}))});
  EXPECT_FALSE(last<bus::EstMotion>(out, 1)->pos_valid);
  EXPECT_EQ(last<bus::EstStatus>(bench.idle(12))->reset_cause, sensor::ResetCause::kCommand);
}

TEST(Node, AFullMapRefusesTheHighestIdsWhateverTheOrder) {
  Frames entries;
  for (int id = 0; id < 80; ++id) entries.push_back(map_entry(id, 100 * id, 0));
  std::mt19937 random(1);
  std::optional<std::uint32_t> crc;
  for (int trial = 0; trial < 3; ++trial) {
    Bench bench;
    bench.epoch(entries);
    const Frames out = bench.idle(120);
    EXPECT_EQ(last<bus::EstDiagCapacity>(out)->map_full, 80 - static_cast<int>(estimators::kMapCapacity));
    const auto got = last<bus::EstStateCrc>(out)->crc;
    EXPECT_EQ(crc.value_or(got), got);
    crc = got;
    std::shuffle(entries.begin(), entries.end(), random);
  }
}

TEST(Node, AnUnknownLandmarkIsNamedAndNotUsed) {
  Bench bench;
  run(bench, drive(20));
  bench.epoch({sighting(bench.now_us + 5'000, 33, 2.0F, 0.0F)});
  const auto events = all<bus::EstInnov>(bench.idle(40));
  ASSERT_FALSE(events.empty());
  EXPECT_TRUE(std::any_of(events.begin(), events.end(),
                          [](const auto& e) { return e.id == 33 && e.verdict == sensor::Verdict::kUnknownLandmark; }));
}

TEST(Node, TimeThatGoesBackOrJumpsRestartsAndSaysSo) {
  for (const std::int64_t jump_us : {-1'000'000, 2'000'000}) {
    Bench bench;
    run(bench, drive(60));
    bench.now_us += jump_us;
    const Frames out = bench.idle(15);
    EXPECT_EQ(last<bus::EstStatus>(out)->reset_cause, sensor::ResetCause::kTimeJump);
    EXPECT_EQ(last<bus::EstStatus>(out)->reset_ctr, 2) << "one set pose, one jump";
  }
}

TEST(Node, HalfAnImuSampleIsNeverMixedWithAnother) {
  Bench bench;
  bench.idle(2);
  const auto gyro = [](int seq) { return in(bus::ImuGyro{.seq = static_cast<std::uint8_t>(seq)}); };
  const auto accel = [](int seq) { return in(bus::ImuAccel{.seq = static_cast<std::uint8_t>(seq)}); };
  const auto time = [&](int seq) {
    return in(
        bus::ImuTime{.stamp_us = stamp(bench.now_us), .interval_us = 10'000, .seq = static_cast<std::uint8_t>(seq)});
  };
  bench.epoch({gyro(1), accel(1)});           // the sample's time never comes
  bench.epoch({gyro(2), accel(2), time(2)});  // whole
  bench.epoch({time(3), gyro(3)});            // the sample's acceleration never comes
  const Frames out = bench.idle(150);
  EXPECT_EQ(last<bus::EstDiagFrames>(out)->incomplete, 2);
}

TEST(Node, MalformedFramesAreCountedAndServiceGoesOn) {
  Bench bench;
  auto truncated = body_speed(bench.now_us, 1.0F, 0.0F);
  truncated.size = 5;
  auto unknown = body_speed(bench.now_us, 1.0F, 0.0F);
  unknown.id = 0x301;
  unknown.data[0] = 2;  // a page that is none
  const auto nothing = body_speed(bench.now_us, std::numeric_limits<float>::quiet_NaN(), 0.0F);
  bench.epoch({truncated, unknown, nothing});
  const Frames out = run(bench, drive(120));
  EXPECT_EQ(last<bus::EstDiagFrames>(out)->malformed, 2);
  EXPECT_EQ(last<bus::EstDiagFrames>(out)->out_of_range, 1);
}

TEST(Node, WithoutAnyInputItWaitsAndStaysFinite) {
  Bench bench;
  const Frames out = bench.idle(3000);
  EXPECT_EQ(last<bus::EstStatus>(out)->mode, sensor::Mode::kWaitingForPose);
  EXPECT_EQ(last<bus::EstStatus>(out)->reset_ctr, 0);
}

/// An estimator with a bug: a speed breaks it.
class Fragile {
 public:
  static constexpr sensor::EstimatorKind kKind = sensor::EstimatorKind::kKf;
  static constexpr float kNotFinite_mps = 2, kNotPositive_mps = 3;

  void restart(base::Micros, const estimators::Context&) {
    estimate_ = {.p = filter::Symmetric<float, 3>::diagonal({1, 1, 1})};
  }
  void set_pose(base::Micros, const estimators::SetPose&, const estimators::Context&) {}
  void advance(base::Micros, const estimators::Context&) {}
  estimators::Innovation fuse(const sensor::BodySpeed& speed, base::Micros, const estimators::Context&) {
    estimate_.forward_mps = speed.forward_mps;
    if (speed.forward_mps > kNotPositive_mps - 0.5F) {
      estimate_.p(1, 1) = -1;
    } else if (speed.forward_mps > kNotFinite_mps - 0.5F) {
      estimate_.pose.yaw_rad = base::kNan;
    }
    return {.verdict = sensor::Verdict::kAccepted};
  }
  [[nodiscard]] estimators::Estimate estimate(const estimators::Context&) const { return estimate_; }
  [[nodiscard]] sensor::Mode mode(const estimators::Context&) const { return sensor::Mode::kNominal; }
  static constexpr auto members(auto& self) { return base::members(base::unhashed(self.estimate_)); }

 private:
  estimators::Estimate estimate_;
};

TEST(Node, ABrokenInvariantRestartsTheEstimatorsSaysWhichAndNeverReachesTheBus) {
  for (const auto& [speed_mps, cause] : {std::pair{Fragile::kNotFinite_mps, sensor::ResetCause::kNotFinite},
                                         std::pair{Fragile::kNotPositive_mps, sensor::ResetCause::kNotPositive}}) {
    node::Node<node::Estimators<estimators::Odometry, Fragile>> node(kNumbers, {});
    std::int64_t now_us = Bench::kStart_us;
    node.power_on({now_us});
    const auto epochs = [&](int count, float forward_mps) {
      Frames out;
      for (int k = 0; k < count; ++k) {
        node.on_frame(body_speed(now_us + 5'000, forward_mps, 0, k));
        now_us += 10'000;
        node.tick({now_us}, {}, [&out](const base::CanFrame& frame) { out.push_back(frame); });
      }
      return out;
    };
    EXPECT_EQ(last<bus::EstStatus>(epochs(30, 1))->reset_ctr, 0);
    Frames out = epochs(1, speed_mps);
    EXPECT_TRUE(base::is_finite(last<bus::EstMotion>(out, 1)->yaw_rad));
    EXPECT_NEAR(last<bus::EstMotion>(out, 1)->speed_mps, 0, 1e-3F) << "as it begins";
    out = epochs(20, 1);
    const auto status = last<bus::EstStatus>(out);
    EXPECT_EQ(status->reset_ctr, 1);
    EXPECT_EQ(status->reset_cause, cause);
    EXPECT_NE(status->faults >> static_cast<unsigned>(sensor::Fault::kRestarted) & 1, 0);
    EXPECT_NEAR(last<bus::EstMotion>(out, 1)->speed_mps, 1, 1e-3F) << "it goes on";
  }
}

TEST(Node, CountersThatBeginAnewAreRefusedAndSaid) {
  Bench bench;
  Frames out;
  const auto counts = [&bench](int k, int left, int right) {
    return in(bus::InWheelCounts{.stamp_us = stamp(bench.now_us + 5'000),
                                 .seq = static_cast<std::uint8_t>(k & 15),
                                 .left = static_cast<std::uint16_t>(left),
                                 .right = static_cast<std::uint16_t>(right)});
  };
  for (int k = 0; k < 200; ++k) {
    const int since = k < 100 ? 20'000 + 32 * k : 32 * (k - 100);
    for (const auto& frame : bench.epoch({counts(k, since, since)})) out.push_back(frame);
  }
  int said = 0;
  for (const auto& event : all<bus::EstInnov>(out)) {
    if (event.sensor != sensor::Sensor::kWheelCounts) continue;
    EXPECT_EQ(event.verdict, sensor::Verdict::kRejected);
    EXPECT_EQ(event.check, sensor::Check::kValue);
    ++said;
  }
  EXPECT_EQ(said, 2) << "once for odometry, once for the filter";
  const double way_m = bus::EstPos::kXScale * last<bus::EstPos>(out, 0)->x_raw;
  EXPECT_NEAR(way_m, 200 * 32 * 0.1 * 2 * M_PI / 2000, 0.03);
}

TEST(Node, StatusCarriesAValidCrcAndACounter) {
  Bench bench;
  int expected = 0;
  for (const auto& frame : bench.idle(200)) {
    if (frame.id != 0x322) continue;
    EXPECT_TRUE(bus::e2e_valid(0x22, bus::payload(frame)));
    EXPECT_EQ(bus::decode<bus::EstStatus>(bus::payload(frame))->ctr, expected++ & 15);
  }
  EXPECT_EQ(expected, 20);
}

}  // namespace
}  // namespace tetap::test
