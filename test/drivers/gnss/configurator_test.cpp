// SPDX-License-Identifier: Apache-2.0
// The driver on a line with a fake u-blox receiver. With every generation, baud rate and fault it runs in the end or
// reports why not, after a bounded number of requests.
#include "drivers/gnss/gnss_bench.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace tetap::drivers::gnss {
namespace {

using ubx::Step;

void expect_configured(const Bench& bench) {
  EXPECT_EQ(bench.driver.configurator().state(), ConfigState::kRunning);
  EXPECT_EQ(bench.receiver.baud(), 115'200U);
  EXPECT_EQ(bench.receiver.ram(key("CFG-RATE-MEAS")), 200U);
  EXPECT_EQ(bench.receiver.ram(key("CFG-RATE-NAV")), 1U);
  EXPECT_EQ(bench.receiver.ram(key("CFG-RATE-TIMEREF")), 1U) << "GPS time";
  EXPECT_EQ(bench.receiver.ram(key("CFG-UART1OUTPROT-UBX")), 1U);
  EXPECT_EQ(bench.receiver.ram(key("CFG-UART1OUTPROT-NMEA")), 0U);
  EXPECT_EQ(bench.receiver.ram(key("CFG-NAVSPG-DYNMODEL")), 4U);
  EXPECT_EQ(bench.receiver.stored(), 0U) << "nothing outlives the power, so no memory wears";
  EXPECT_EQ(bench.receiver.broken_rules(), 0);
}

TEST(GnssConfiguration, AReceiverWithKeysIsConfiguredFromEveryBaudRate) {
  for (const std::uint32_t baud : {9600U, 38'400U, 57'600U, 115'200U, 230'400U, 460'800U, 921'600U}) {
    SCOPED_TRACE(baud);
    Bench bench(Generation::kKeys, baud);
    ASSERT_TRUE(bench.until(ConfigState::kRunning, 20));
    expect_configured(bench);
    EXPECT_TRUE(bench.receiver.enabled(0x07));
    EXPECT_TRUE(bench.receiver.enabled(0x36));
    EXPECT_FALSE(bench.driver.configurator().legacy());
    bench.run(1);
    bench.reports.clear();
    bench.run(5);
    EXPECT_NEAR(static_cast<double>(bench.reports.size()), 25, 2);
  }
}

TEST(GnssConfiguration, AReceiverWithoutKeysIsConfiguredByTheOlderMessages) {
  for (const bool silent : {false, true}) {
    Bench bench(Generation::kM8);
    bench.receiver.injected.ignores_unknown = silent;
    ASSERT_TRUE(bench.until(ConfigState::kRunning, 30));
    expect_configured(bench);
    EXPECT_TRUE(bench.driver.configurator().legacy());
    EXPECT_EQ(bench.count(ConfigReason::kLegacy), 1);
    EXPECT_TRUE(bench.receiver.enabled(0x07));
    bench.run(3);
    EXPECT_GT(bench.reports.size(), 10U);
  }
}

TEST(GnssConfiguration, AReceiverWithoutNavPvtIsHeardByItsOlderMessages) {
  Bench bench(Generation::kM6);
  ASSERT_TRUE(bench.until(ConfigState::kRunning, 30));
  expect_configured(bench);
  EXPECT_EQ(bench.count(ConfigReason::kNoPvt), 1);
  for (const auto id : std::to_array<std::uint8_t>({0x02, 0x12, 0x06, 0x04, 0x21}))
    EXPECT_TRUE(bench.receiver.enabled(id)) << int{id};
  bench.run(3);
  ASSERT_GT(bench.reports.size(), 10U);
  EXPECT_EQ(bench.reports.back().fix, sensor::GnssFix::k3d);
}

TEST(GnssConfiguration, ARefusedOptionIsSaidAndTheRestIsConfigured) {
  Bench bench(Generation::kKeys);
  bench.receiver.injected.unknown_keys = {key("CFG-MSGOUT-UBX_NAV_COV_UART1"), key("CFG-NAVSPG-DYNMODEL")};
  ASSERT_TRUE(bench.until(ConfigState::kRunning, 20));
  EXPECT_TRUE(bench.receiver.enabled(0x07));
  EXPECT_EQ(bench.count(ConfigReason::kRefused), 2);
  EXPECT_TRUE(bench.driver.configurator().was_refused(Step::kCov));
  EXPECT_TRUE(bench.driver.configurator().was_refused(Step::kModel));
  EXPECT_FALSE(bench.driver.configurator().was_refused(Step::kPvt));
}

TEST(GnssConfiguration, AReceiverThatRefusesNavPvtIsGivenUpAfterBoundedRounds) {
  Bench bench(Generation::kKeys);
  bench.receiver.injected.unknown_keys = {key("CFG-MSGOUT-UBX_NAV_PVT_UART1")};
  ASSERT_TRUE(bench.until(ConfigState::kGaveUp, 120));
  EXPECT_EQ(bench.count(ConfigReason::kRefused), ubx::Settings{}.rounds);
}

TEST(GnssConfiguration, LostAcknowledgementsAreAskedForAgain) {
  Bench bench(Generation::kKeys, 115'200);
  bench.receiver.injected.swallow_acks = 2;
  ASSERT_TRUE(bench.until(ConfigState::kRunning, 20));
  EXPECT_EQ(bench.count(ConfigReason::kTimeout), 2);
  expect_configured(bench);
}

TEST(GnssConfiguration, AnAnswerToAnEarlierTryIsNotTakenForTheNextStep) {
  Bench bench(Generation::kKeys, 115'200);
  ASSERT_TRUE(bench.until(ConfigState::kApply, 5));
  bench.receiver.injected.delay = base::Micros{500'000};  // the time-out is 387 ms
  // If taken for one step later, another step looks refused.
  bench.receiver.injected.unknown_keys = {key("CFG-MSGOUT-UBX_NAV_COV_UART1")};
  ASSERT_TRUE(bench.until(ConfigState::kRunning, 60));
  expect_configured(bench);
  EXPECT_GT(bench.count(ConfigReason::kTimeout), 0);
  EXPECT_GT(bench.count(ConfigReason::kLateResponse), 0);
  EXPECT_TRUE(bench.driver.configurator().was_refused(Step::kCov));
  EXPECT_FALSE(bench.driver.configurator().was_refused(Step::kModel));
  EXPECT_FALSE(bench.driver.configurator().was_refused(Step::kPvt));
}

TEST(GnssConfiguration, AnAcknowledgementOfAnotherMessageIsNotTaken) {
  Bench bench(Generation::kKeys, 115'200);
  ubx::Configurator<fakes::Ublox> configurator(bench.receiver, {});
  configurator.poll({0});
  configurator.on_identified({1'000});
  for (int i = 0; i < 20; ++i) {
    configurator.on_acknowledge({.message_class = 0x06, .message_id = 0x08, .accepted = true}, {2'000});
    configurator.on_acknowledge({.message_class = 0x13, .message_id = 0x8A, .accepted = true}, {2'000});
    configurator.on_acknowledge({.message_class = 0x06, .message_id = 0x01, .accepted = false}, {2'000});
  }
  EXPECT_EQ(bench.receiver.requests(), 2) << "who is there, and the first step";
  EXPECT_EQ(configurator.state(), ConfigState::kApply);
  EXPECT_FALSE(configurator.legacy());
  configurator.on_acknowledge({.message_class = 0x06, .message_id = 0x8A, .accepted = true}, {3'000});
  EXPECT_EQ(bench.receiver.requests(), 3);
}

TEST(GnssConfiguration, ASilentReceiverIsGivenUpWithBoundedRequestsAndTriedAgainLater) {
  Bench bench(Generation::kKeys);
  bench.receiver.injected.mute = true;
  ASSERT_TRUE(bench.until(ConfigState::kGaveUp, 120));
  EXPECT_EQ(bench.count(ConfigReason::kNoResponse), ubx::Settings{}.rounds);
  const int requests = bench.receiver.requests();
  EXPECT_LT(requests, 20);
  bench.run(5);
  EXPECT_EQ(bench.receiver.requests(), requests) << "it rests";
  bench.receiver.injected.mute = false;
  EXPECT_TRUE(bench.until(ConfigState::kRunning, 40));
}

TEST(GnssConfiguration, AReceiverThatLostItsPowerIsConfiguredAgain) {
  Bench bench(Generation::kKeys);
  ASSERT_TRUE(bench.until(ConfigState::kRunning, 20));
  bench.run(2);
  bench.receiver.power_cycle(38'400);
  bench.run(1);
  ASSERT_TRUE(bench.until(ConfigState::kSearch, 5));
  EXPECT_EQ(bench.count(ConfigReason::kLost), 1);
  ASSERT_TRUE(bench.until(ConfigState::kRunning, 30));
  expect_configured(bench);
}

TEST(GnssConfiguration, ABaudRateAtWhichNothingIsHeardIsNotKept) {
  Bench bench(Generation::kKeys, 9600);
  bench.receiver.injected.deaf_after_baud_change = true;
  ASSERT_FALSE(bench.until(ConfigState::kRunning, 10));
  EXPECT_EQ(bench.count(ConfigReason::kBaudKept), 1);
  // Someone resets it.
  bench.receiver.injected.deaf_after_baud_change = false;
  bench.receiver.power_cycle(9600);
  ASSERT_TRUE(bench.until(ConfigState::kRunning, 40));
  EXPECT_EQ(bench.receiver.baud(), 9600U) << "the rate it was found at stays";
  EXPECT_TRUE(bench.receiver.enabled(0x07));
}

TEST(GnssConfiguration, ALineThatTakesThreeBytesAtATimeIsEnoughAndOneThatTakesNoneIsSaid) {
  Bench bench(Generation::kKeys);
  bench.receiver.injected.write_at_most = 3;
  EXPECT_TRUE(bench.until(ConfigState::kRunning, 20));
  Bench stuck(Generation::kKeys);
  stuck.receiver.injected.write_at_most = 0;
  EXPECT_TRUE(stuck.until(ConfigState::kGaveUp, 120));
  EXPECT_GT(stuck.count(ConfigReason::kNoResponse), 0);
}

TEST(GnssConfiguration, SettingsThatTheLineCannotCarrySendNothing) {
  DriverSettings settings;
  settings.ubx.baud = 9600;
  settings.ubx.period_ms = 100;
  EXPECT_FALSE(ubx::valid(settings.ubx));
  Bench bench(Generation::kKeys, 9600, settings);
  bench.run(3);
  EXPECT_EQ(bench.driver.configurator().state(), ConfigState::kMisconfigured);
  EXPECT_EQ(bench.receiver.requests(), 0);
}

TEST(GnssConfiguration, WithConfigurationOffNothingIsSent) {
  DriverSettings settings;
  settings.configure = false;
  Bench bench(Generation::kKeys, 9600, settings);
  bench.run(5);
  EXPECT_EQ(bench.receiver.requests(), 0);
  EXPECT_GT(bench.driver.health().nmea_frames, 0U);
}

TEST(GnssConfiguration, StatesAndReasonsHaveNames) {
  for (std::size_t i = 0; i < static_cast<std::size_t>(ConfigReason::kCount); ++i)
    EXPECT_GT(name(static_cast<ConfigReason>(i)).size(), 3U);
  EXPECT_EQ(name(ConfigState::kGaveUp), "gave up");
  EXPECT_EQ(name(ConfigReason::kLateResponse), "late answer");
}

TEST(GnssEpochClock, StampsAreAsRegularAsTheReceiverAndNeverLate) {
  EpochClock clock(base::Micros{60'000});
  for (std::int64_t i = 0; i < 500; ++i) {
    const std::int64_t truth_us = 7'000'000 + i * 200'000;
    const std::int64_t wait_us = i * 24'721 % 40'000;
    const std::int64_t at = clock.stamp({i * 200'000}, {truth_us + 60'000 + wait_us}).us;
    EXPECT_GE(at, truth_us);
    EXPECT_LE(at, truth_us + wait_us);
    EXPECT_LE(at - truth_us, i > 32 ? 2'500 : 40'000) << i;
  }
}

TEST(GnssEpochClock, TheEndOfTheWeekAndARestartAreNotTornApart) {
  EpochClock clock(base::Micros{0});
  for (std::int64_t i = 0; i < 50; ++i)
    EXPECT_EQ(clock.stamp({604'790'000'000 + i * 200'000}, {i * 200'000}).us, i * 200'000);
  for (std::int64_t i = 50; i < 99; ++i)
    EXPECT_EQ(clock.stamp({i * 200'000 - 10'000'000}, {i * 200'000}).us, i * 200'000);
}

}  // namespace
}  // namespace tetap::drivers::gnss
