// SPDX-License-Identifier: Apache-2.0
// The chip and its bus fail in named ways: the driver says what it was, delivers nothing false, and comes back.
#include <gtest/gtest.h>

#include <cmath>

#include "drivers/imu/icm42688_bench.hpp"

namespace tetap::drivers::icm42688 {
namespace {

using fakes::Fault;

/// No reading may be further from the motion at its stamp than filter, clock and count explain.
int false_readings(const Bench& bench) {
  int wrong = 0;
  for (const ImuReading& r : bench.readings) {
    const auto truth = Bench::living()(1e-6 * static_cast<double>(r.stamp.us));
    for (std::size_t i = 0; i < 3; ++i) {
      wrong += std::abs(static_cast<double>(r.rate_b_radps[i]) - truth.rate_radps[i]) > 0.1;
      wrong += std::abs(static_cast<double>(r.force_b_mps2[i]) - truth.specific_force_mps2[i]) > 0.2;
    }
  }
  return wrong;
}

TEST(Icm42688Fault, AStrangersIdentityIsNamedAndNeverConfigured) {
  Bench bench;
  bench.chip.inject(Fault::kWrongIdentity);
  bench.run(1'000'000);
  EXPECT_FALSE(bench.driver.running());
  EXPECT_GT(bench.of(Reason::kWrongIdentity), 2);
  EXPECT_EQ(bench.chip.peek(0, 0x16), 0);
  bench.chip.clear(Fault::kWrongIdentity);
  bench.run(300'000);
  EXPECT_TRUE(bench.driver.running());
}

// A sister part would take the same registers and count another scale: nothing but its name tells.
TEST(Icm42688Fault, AnIdentityThatChangesWhileRunningEndsTheSamplesUntilItIsTheOwnAgain) {
  Bench bench;
  ASSERT_TRUE(bench.start());
  bench.run(1'000'000);
  ASSERT_EQ(bench.troubles(), 0) << "its own identity is no change";
  bench.chip.inject(Fault::kWrongIdentity);
  for (std::size_t ms = 0; ms <= 5 * (kFieldCount + 1) && bench.driver.running(); ++ms) bench.run(1'000);  // a round
  EXPECT_FALSE(bench.driver.running());
  EXPECT_EQ(bench.of(Reason::kConfigChanged), 1);
  EXPECT_EQ(bench.of(Reason::kWrongIdentity), 0) << "that is said of one that answers the start";
  bench.readings.clear();
  bench.run(1'000'000);
  EXPECT_TRUE(bench.readings.empty());
  EXPECT_EQ(bench.of(Reason::kConfigChanged), 1);
  EXPECT_GT(bench.of(Reason::kWrongIdentity), 2) << "asked again and again";
  bench.chip.clear(Fault::kWrongIdentity);
  bench.run(500'000);
  EXPECT_TRUE(bench.driver.running());
  EXPECT_EQ(false_readings(bench), 0);
  EXPECT_GT(bench.readings.back().stamp.us, bench.now_us - 5000);
}

TEST(Icm42688Fault, ADeadOrStuckBusAtTheStartIsSaidAndOutlived) {
  for (const Fault fault : {Fault::kBusDead, Fault::kBusStuckLow, Fault::kBusStuckHigh}) {
    Bench bench;
    bench.chip.inject(fault);
    bench.run(1'000'000);
    EXPECT_FALSE(bench.driver.running());
    EXPECT_GT(bench.troubles(), 2) << name(fault);
    bench.chip.clear(fault);
    bench.run(400'000);
    EXPECT_TRUE(bench.driver.running()) << name(fault);
  }
}

TEST(Icm42688Fault, ABusThatDiesWhileRunningDeliversNothingFalseAndComesBack) {
  for (const Fault fault : {Fault::kBusDead, Fault::kBusStuckLow, Fault::kBusStuckHigh}) {
    for (const std::int64_t outage_us : {2'000, 30'000, 300'000}) {
      Bench bench;
      ASSERT_TRUE(bench.start());
      bench.run(3'000'000);
      bench.chip.inject(fault);
      bench.run(outage_us);
      bench.chip.clear(fault);
      bench.run(500'000);
      EXPECT_TRUE(bench.driver.running()) << name(fault);
      EXPECT_EQ(false_readings(bench), 0) << name(fault) << ' ' << outage_us;
      if (fault != Fault::kBusStuckLow) {
        EXPECT_GT(bench.troubles(), 0) << name(fault);
      }
      EXPECT_GT(bench.readings.back().stamp.us, bench.now_us - 5000);
    }
  }
}

TEST(Icm42688Fault, EveryTransferMayFailOnce) {
  for (int nth = 0; nth < 400; ++nth) {
    Bench bench;
    bench.chip.inject(Fault::kBusDead, {.after_transfers = nth, .transfers = 1});
    bench.run(1'000'000);
    ASSERT_TRUE(bench.driver.running()) << nth;
    ASSERT_EQ(bench.of(Reason::kBusFault), 1) << nth;
    ASSERT_GT(bench.readings.size(), 500U) << nth;
  }
}

TEST(Icm42688Fault, ARegisterThatRefusesItsValueIsFoundBeforeAnySample) {
  for (const Field& field : fields(Settings{})) {
    Bench probe;
    ASSERT_TRUE(probe.start());
    const std::uint8_t wanted = probe.chip.peek(field.where.bank, field.where.address);
    const auto* known = fakes::icm42688::find_register(field.where.bank, field.where.address);
    if (known->reset == wanted || field.where == kPwrMgmt0) continue;  // refusing changes nothing, or starts nothing
    Bench bench;
    bench.chip.inject(Fault::kRegisterRefuses, {.bank = field.where.bank, .address = field.where.address});
    bench.run(1'000'000);
    EXPECT_FALSE(bench.driver.running()) << known->section;
    EXPECT_GT(bench.of(Reason::kConfigRefused), 2) << known->section;
    EXPECT_TRUE(bench.readings.empty());
  }
}

TEST(Icm42688Fault, SensorsThatDoNotSwitchOnAreSaid) {
  Bench bench;
  bench.chip.inject(Fault::kRegisterRefuses, {.bank = 0, .address = 0x4E});
  bench.run(1'000'000);
  EXPECT_GT(bench.of(Reason::kConfigChanged) + bench.of(Reason::kStale), 0);
  EXPECT_TRUE(bench.readings.empty());
}

TEST(Icm42688Fault, EveryConfiguredRegisterThatChangesIsFoundAndPutRightWithinASecond) {
  for (const Field& field : fields(Settings{})) {
    for (const std::uint8_t mask : {field.mask, static_cast<std::uint8_t>(field.mask & -field.mask)}) {
      Bench bench;
      ASSERT_TRUE(bench.start());
      bench.run(500'000);
      const std::uint8_t before = bench.chip.peek(field.where.bank, field.where.address);
      const auto changed = static_cast<std::uint8_t>(before ^ mask);
      if (field.where == kIntfConfig0 && (changed & 0x03) == 0x02) continue;  // SPI off: only power heals that
      bench.chip.inject(Fault::kRegisterChanges,
                        {.bank = field.where.bank, .address = field.where.address, .value = changed});
      bench.run(1'000'000);
      EXPECT_GT(bench.of(Reason::kConfigChanged) + bench.of(Reason::kStale) + bench.of(Reason::kBadHeader), 0)
          << "bank " << int{field.where.bank} << " address " << int{field.where.address};
      EXPECT_GT(bench.driver.health().restarts, 0U);
      EXPECT_TRUE(bench.driver.running());
      EXPECT_EQ(bench.chip.peek(field.where.bank, field.where.address), before);
    }
  }
}

TEST(Icm42688Fault, AnotherBankThanSelectedIsNoticedAndNothingIsWrittenToTheWrongOne) {
  for (std::uint8_t bank = 1; bank <= 4; ++bank) {
    Bench bench;
    ASSERT_TRUE(bench.start());
    bench.run(3'000'000);
    bench.readings.clear();
    bench.chip.inject(Fault::kRegisterChanges, {.bank = 0, .address = 0x76, .value = bank});
    bench.run(500'000);
    EXPECT_TRUE(bench.driver.running());
    EXPECT_GT(bench.troubles(), 0);
    EXPECT_EQ(bench.chip.broken(fakes::Rule::kRegisterExists), 0);
    EXPECT_EQ(false_readings(bench), 0);
    EXPECT_GT(bench.readings.size(), 300U);
  }
}

TEST(Icm42688Fault, ABrownOutIsFoundAndConfiguredAnew) {
  Bench bench;
  ASSERT_TRUE(bench.start());
  bench.run(3'000'000);
  bench.chip.inject(Fault::kBrownOut);
  bench.run(400'000);
  EXPECT_TRUE(bench.driver.running());
  EXPECT_GT(bench.driver.health().restarts, 0U);
  EXPECT_EQ(false_readings(bench), 0);
  EXPECT_GT(bench.readings.back().stamp.us, bench.now_us - 5000);
}

TEST(Icm42688Fault, AFifoThatRepeatsItselfIsNotNewData) {
  Bench bench;
  ASSERT_TRUE(bench.start());
  bench.run(500'000, 3000);
  bench.chip.inject(Fault::kFifoStuck);
  const std::size_t before = bench.readings.size();
  bench.run(300'000, 3000);
  EXPECT_LE(bench.readings.size(), before + 4);
  EXPECT_GT(bench.of(Reason::kStale), 0);
  bench.chip.clear(Fault::kFifoStuck);
  bench.run(500'000, 3000);
  EXPECT_TRUE(bench.driver.running());
  EXPECT_GT(bench.readings.back().stamp.us, bench.now_us - 10'000);
}

TEST(Icm42688Fault, AnAxisThatNeverMovesIsFoundOnEveryAxis) {
  for (int axis = 0; axis < 6; ++axis) {
    Bench bench{{.stuck_gyro_samples = 300}};
    ASSERT_TRUE(bench.start());
    bench.run(1'000'000);
    EXPECT_EQ(bench.of(Reason::kStuckGyro) + bench.of(Reason::kStuckAccel), 0);
    bench.chip.inject(Fault::kAxisStuck, {.axis = axis});
    bench.run(400'000);
    bench.readings.clear();
    bench.run(100'000);
    EXPECT_GT(bench.of(axis < 3 ? Reason::kStuckGyro : Reason::kStuckAccel), 0) << axis;
    EXPECT_TRUE(bench.readings.empty());
    bench.chip.clear(Fault::kAxisStuck);
    bench.run(100'000);
    ASSERT_GT(bench.readings.size(), 90U);
    EXPECT_TRUE(bench.readings.front().after_gap);
  }
}

TEST(Icm42688Fault, ASampleThatIsMissingIsAGapAndCounted) {
  Bench bench;
  ASSERT_TRUE(bench.start());
  bench.run(2'000'000);
  bench.readings.clear();
  bench.chip.inject(Fault::kSamplesLost, {.every = 10});
  bench.run(1'000'000);
  EXPECT_NEAR(bench.of(Reason::kLostSamples), 100, 2);
  int gaps = 0;
  for (const ImuReading& r : bench.readings) {
    gaps += r.after_gap ? 1 : 0;
    ASSERT_NEAR(static_cast<double>(r.interval.us), 1000, 20);
  }
  EXPECT_NEAR(gaps, 100, 2);
  EXPECT_EQ(false_readings(bench), 0);
}

TEST(Icm42688Fault, MarkersForNoDataAreNotSamples) {
  for (const Resolution resolution : {Resolution::k16bit, Resolution::k20bit}) {
    Bench bench{{.resolution = resolution}};
    ASSERT_TRUE(bench.start());
    bench.run(100'000);
    // SENSOR_CONFIG0 (15.1) switches one axis off, until the driver finds it.
    bench.chip.inject(Fault::kRegisterChanges, {.bank = 1, .address = 0x03, .value = 0x90});
    bench.readings.clear();
    for (int i = 0; i < 1000 && bench.driver.health().restarts == 0; ++i) bench.run(1000);
    EXPECT_EQ(bench.driver.health().restarts, 1U);
    EXPECT_TRUE(bench.readings.empty());
    EXPECT_GT(bench.of(Reason::kInvalidSample), 3);
    EXPECT_LT(bench.of(Reason::kInvalidSample), 250);
  }
}

TEST(Icm42688Fault, StampsThatRunFastAreLearnedLikeAClock) {
  Bench bench;
  ASSERT_TRUE(bench.start());
  bench.chip.inject(Fault::kStampClockOff, {.ppm = 20'000});
  bench.run(10'000'000, 990);
  bench.readings.clear();
  bench.run(1'000'000, 990);
  EXPECT_EQ(false_readings(bench), 0);
  EXPECT_NEAR(bench.driver.clock_error_ppm(), -19'600, 400);
}

TEST(Icm42688Fault, AClockFurtherOffThanAnyChipsIsSaid) {
  Bench bench;
  ASSERT_TRUE(bench.start());
  bench.chip.set_clock_error(120'000);
  bench.run(5'000'000);
  EXPECT_GT(bench.of(Reason::kClockOff), 0);
}

// Flipped bits in values cannot be told from values; but they must not stop the driver, nor move time.
TEST(Icm42688Fault, FlippedBitsNeverStopItNorTurnTimeBack) {
  int healed = 0;
  for (const Fault fault : {Fault::kBitFlips, Fault::kWrittenBitFlips}) {
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
      Bench bench;
      bench.chip.inject(fault, {.rate = 1e-3, .seed = seed});
      bench.run(5'000'000);
      for (std::size_t i = 1; i < bench.readings.size(); ++i) {
        ASSERT_LE(bench.readings[i].stamp.us, bench.now_us);
        ASSERT_GT(bench.readings[i].interval.us, 0);
        for (const float value : bench.readings[i].rate_b_radps) ASSERT_LT(std::abs(value), 35.0F);
      }
      EXPECT_GT(bench.troubles(), 0);
      bench.chip.clear(fault);
      bench.run(8'000'000);
      // A bit in what was sent may have switched SPI off or to another mode: only power heals that.
      if ((bench.chip.peek(0, 0x4C) & 0x03) == 0x02 || (bench.chip.peek(0, 0x11) & 0x10) != 0) continue;
      ++healed;
      EXPECT_TRUE(bench.driver.running()) << name(fault) << ' ' << seed;
      bench.readings.clear();
      bench.run(2'000'000, 990);
      EXPECT_GT(bench.readings.size(), 1900U) << name(fault) << ' ' << seed;
      EXPECT_NEAR(static_cast<double>(bench.readings.back().stamp.us + group_delay_us(Settings{})),
                  1e6 * bench.chip.last_sample_s(), 300)
          << name(fault) << ' ' << seed;
    }
  }
  EXPECT_GT(healed, 35);
}

/// Not a chip at all: any bytes, any failures, now and then what a chip would say.
struct Nonsense {
  bool transfer(std::span<const std::uint8_t> out, std::span<std::uint8_t> in) {
    for (std::uint8_t& byte : in) {
      byte = static_cast<std::uint8_t>(random.next() >> 24);
      if (random.next() % 4 == 0) byte = 0x68;
    }
    if (in.size() == 1 && random.next() % 500 != 0) in[0] = expected(out[0] & 0x7F);
    if (in.size() == 3) in[1] = static_cast<std::uint8_t>(random.next() % 9);
    if ((out[0] & 0x80) == 0 && out.size() > 1) memory[bank & 7][out[0]] = out[1];
    if ((out[0] & 0x80) == 0 && out[0] == 0x76) bank = out[1];
    return random.next() % 2000 != 0;
  }
  [[nodiscard]] std::uint8_t expected(int address) const {
    if (address == 0x75) return 0x47;
    if (address == 0x2D) return 0x18;
    if (address == 0x76) return bank;
    return memory[bank & 7][static_cast<std::size_t>(address)];
  }
  base::Random random{1};
  std::array<std::array<std::uint8_t, 128>, 8> memory{};
  std::uint8_t bank = 0;
};

TEST(Icm42688Fault, AnythingOnTheBusIsSurvivedAndTimeNeverRunsBack) {
  std::uint32_t samples = 0;
  for (std::uint32_t seed = 1; seed <= 20; ++seed) {
    Nonsense bus{.random = base::Random{seed}};
    Driver<Nonsense> driver(bus, {.resolution = seed % 2 == 0 ? Resolution::k20bit : Resolution::k16bit});
    ImuReading last{.stamp = {-1'000'000}};
    std::int64_t now_us = 0;
    for (int i = 0; i < 20'000; ++i) {
      now_us += 1000;
      if (i % 5000 == 4000) static_cast<void>(driver.request_self_test({now_us}));
      driver.poll({now_us}, [&](const ImuReading& r) {
        EXPECT_GT(r.stamp, last.stamp);
        EXPECT_LE(r.stamp.us, now_us);
        EXPECT_GT(r.interval.us, 0);
        for (std::size_t k = 0; k < 3; ++k)
          EXPECT_TRUE(std::isfinite(r.rate_b_radps[k]) && std::isfinite(r.force_b_mps2[k]));
        last = r;
      });
    }
    samples += driver.health().samples;
  }
  EXPECT_GT(samples, 0U) << "or it was no test of samples";
}

TEST(Icm42688Fault, EveryReasonHasItsOwnWords) {
  for (std::size_t i = 0; i < kReasons; ++i) {
    EXPECT_FALSE(name(static_cast<Reason>(i)).empty());
    for (std::size_t j = 0; j < i; ++j) EXPECT_NE(name(static_cast<Reason>(i)), name(static_cast<Reason>(j)));
  }
}

}  // namespace
}  // namespace tetap::drivers::icm42688
