// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "drivers/imu/icm42688_bench.hpp"

namespace tetap::drivers::icm42688 {
namespace {

SelfTestResult self_test(Bench& bench) {
  EXPECT_TRUE(bench.start());
  EXPECT_TRUE(bench.driver.request_self_test({bench.now_us}));
  for (int i = 0; i < 20'000 && !bench.driver.running(); ++i) bench.run(1000);
  EXPECT_TRUE(bench.driver.running());
  return bench.driver.self_test_result();
}

TEST(SelfTest, AHealthyPartPassesAtAnyRateOfPollingAndRunsAgain) {
  Bench bench{{.gyro_range = GyroRange::k500dps}};
  bench.chip.set_motion(fakes::icm42688::Motion{});
  const SelfTestResult result = self_test(bench);
  EXPECT_TRUE(result.done && result.passed);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(result.gyro[i].response / result.gyro[i].expected, 1.0F, 0.03F);
    EXPECT_NEAR(result.accel[i].response / result.accel[i].expected, 1.0F, 0.03F);
  }
  EXPECT_EQ(bench.of(Reason::kSelfTestFailed), 0);
  EXPECT_EQ(bench.chip.peek(0, 0x70), 0);
  EXPECT_EQ(bench.chip.peek(0, 0x4F), 0x46);
  bench.chip.set_motion(Bench::living());
  bench.run(100'000);
  EXPECT_GT(bench.readings.size(), 90U);
  EXPECT_EQ(bench.chip.broken(fakes::Rule::kGyroOnFor45ms), 0);
  EXPECT_EQ(bench.chip.broken_rules(), 0) << bench.chip.broken_rules_in_words();
}

TEST(SelfTest, OneWeakAxisFailsAndIsNamed) {
  for (int axis = 0; axis < 6; ++axis) {
    Bench bench;
    bench.chip.set_motion(fakes::icm42688::Motion{});
    bench.chip.inject(fakes::Fault::kSelfTestFails, {.axis = axis});
    const SelfTestResult result = self_test(bench);
    EXPECT_TRUE(result.done);
    EXPECT_FALSE(result.passed);
    for (int i = 0; i < 6; ++i) {
      const auto index = static_cast<std::size_t>(i % 3);
      EXPECT_EQ(i < 3 ? result.gyro[index].passed : result.accel[index].passed, i != axis) << i << " of " << axis;
    }
    EXPECT_EQ(bench.of(Reason::kSelfTestFailed), 1);
  }
}

TEST(SelfTest, APartWithoutFactoryCodesIsJudgedByAbsoluteLimits) {
  Bench bench;
  bench.chip.set_motion(fakes::icm42688::Motion{});
  bench.chip.set_self_test_codes({0, 0, 0}, {0, 0, 0});
  EXPECT_TRUE(self_test(bench).passed);
  Bench weak;
  weak.chip.set_motion(fakes::icm42688::Motion{});
  weak.chip.set_self_test_codes({0, 0, 0}, {0, 0, 0});
  weak.chip.inject(fakes::Fault::kSelfTestFails, {.axis = 1});
  EXPECT_FALSE(self_test(weak).passed);
}

TEST(SelfTest, ARobotThatTurnsFailsAndIsToldWhy) {
  Bench bench;
  bench.chip.set_motion({.rate_radps = {0, 0, 1.0}});
  const SelfTestResult result = self_test(bench);
  EXPECT_TRUE(result.moving);
  EXPECT_FALSE(result.passed);
}

TEST(SelfTest, ABusThatFailsInItEndsItAndTheDriverRecovers) {
  Bench bench;
  ASSERT_TRUE(bench.start());
  ASSERT_TRUE(bench.driver.request_self_test({bench.now_us}));
  bench.run(300'000);
  bench.chip.inject(fakes::Fault::kBusDead, {.transfers = 5});
  bench.run(2'000'000);
  EXPECT_EQ(bench.of(Reason::kSelfTestFailed), 1);
  EXPECT_FALSE(bench.driver.self_test_result().done);
  EXPECT_TRUE(bench.driver.running());
}

TEST(SelfTest, IsRefusedWhileTheDriverDoesNotRun) {
  Bench bench;
  EXPECT_FALSE(bench.driver.request_self_test({0}));
}

TEST(SelfTest, TheFactorysCodeGrowsByOnePercentAStep) {
  EXPECT_FLOAT_EQ(factory_growth(1), 1.0F);
  for (int code = 1; code < 255; ++code) {
    EXPECT_NEAR(factory_growth(static_cast<std::uint8_t>(code + 1)) / factory_growth(static_cast<std::uint8_t>(code)),
                1.01F, 1e-6F);
  }
  EXPECT_NEAR(factory_growth(255), std::pow(1.01, 254), 1e-4);
}

}  // namespace
}  // namespace tetap::drivers::icm42688
