// SPDX-License-Identifier: Apache-2.0
// Settings to register fields: every bit where the data sheet has it, and reserved bits left alone.
#include "drivers/imu/icm42688/settings.hpp"

#include <gtest/gtest.h>

#include <set>

#include "support/fakes/icm42688_registers.hpp"

namespace tetap::drivers::icm42688 {
namespace {

std::uint8_t value_of(const Settings& settings, Register where) {
  std::uint8_t value = 0;
  for (const Field& field : fields(settings)) {
    if (field.where == where) value = field.value;
  }
  return value;
}

TEST(Settings, RangesSitInTheUpperThreeBitsAndRatesInTheLowerFour) {
  for (std::uint8_t range = 0; range < 8; ++range) {
    for (const Rate rate : {Rate::k1kHz, Rate::k500Hz, Rate::k200Hz}) {
      const std::uint8_t value = value_of({.gyro_range = static_cast<GyroRange>(range), .rate = rate}, kGyroConfig0);
      EXPECT_EQ(value >> 5, range);
      EXPECT_EQ(value & 0x0F, static_cast<int>(rate));
      EXPECT_EQ(value & 0x10, 0);
    }
  }
  for (std::uint8_t range = 0; range < 4; ++range) {
    EXPECT_EQ(value_of({.accel_range = static_cast<AccelRange>(range)}, kAccelConfig0) >> 5, range);
  }
}

TEST(Settings, TheWatermarkIsProgrammedInBytesOfThePacketInUse) {
  for (std::uint8_t packets = 1; packets <= 100; ++packets) {
    for (const Resolution resolution : {Resolution::k16bit, Resolution::k20bit}) {
      const Settings settings{.resolution = resolution, .watermark_packets = packets};
      const int programmed = value_of(settings, kFifoConfig2) | value_of(settings, kFifoConfig3) << 8;
      EXPECT_EQ(programmed, packets * (resolution == Resolution::k20bit ? 20 : 16));
    }
  }
}

TEST(Settings, FieldsStayWithinTheBitsThatTheSheetGivesTheUser) {
  for (const Resolution resolution : {Resolution::k16bit, Resolution::k20bit}) {
    for (const AntiAlias filter : {kAntiAliasOff, kAntiAlias42Hz, kAntiAlias1962Hz}) {
      for (const Rate rate : {Rate::k8kHz, Rate::k1kHz, Rate::k50Hz}) {
        const Settings settings{.rate = rate,
                                .order = FilterOrder::kThird,
                                .anti_alias = filter,
                                .resolution = resolution,
                                .external_clock_Hz = 32'768};
        for (const Field& field : fields(settings)) {
          const fakes::icm42688::Register* known =
              fakes::icm42688::find_register(field.where.bank, field.where.address);
          ASSERT_NE(known, nullptr) << "bank " << int{field.where.bank} << " address " << int{field.where.address};
          EXPECT_EQ(field.mask & ~known->settable, 0) << known->section;
          EXPECT_EQ(field.value & ~field.mask, 0) << known->section;
        }
      }
    }
  }
}

TEST(Settings, EveryFieldIsWrittenOnceButThePowerThatIsOffFirstAndOnLast) {
  const auto table = fields(Settings{});
  std::set<std::pair<int, int>> seen;
  for (std::size_t i = 1; i + 1 < table.size(); ++i) {
    EXPECT_TRUE(seen.emplace(table[i].where.bank, table[i].where.address).second);
    EXPECT_NE(table[i].where, kPwrMgmt0);
  }
  EXPECT_EQ(table.front().where, kPwrMgmt0);
  EXPECT_EQ(table.front().value, 0);
  EXPECT_EQ(table.back().where, kPwrMgmt0);
  EXPECT_EQ(table.back().value, 0x0F);
}

TEST(Settings, ATickOfTheStampIsLongerThanItsNameByThirtyTwoThirtieths) {
  const double one = 4294967296.0;
  EXPECT_NEAR(static_cast<double>(Settings{}.tick_q32()) / one, 32.0 / 30.0, 1e-8);
  EXPECT_NEAR(static_cast<double>(Settings{.tick = Tick::k16us}.tick_q32()) / one, 16.0 * 32.0 / 30.0, 1e-7);
  // 12.7, with an external clock of 32 kHz: 976.5 counts a millisecond; 32 in the coarse resolution.
  EXPECT_NEAR(static_cast<double>(Settings{.external_clock_Hz = 32'000}.tick_q32()) / one * 976.5625, 1000.0, 1e-3);
  EXPECT_NEAR(static_cast<double>(Settings{.tick = Tick::k16us, .external_clock_Hz = 32'000}.tick_q32()) / one * 32.0,
              1000.0, 1e-6);
}

TEST(Settings, AnExternalClockScalesTheRates) {
  EXPECT_EQ(Settings{.rate = Rate::k500Hz}.period_ns(), 2'000'000);
  EXPECT_EQ((Settings{.rate = Rate::k500Hz, .external_clock_Hz = 32'768}.period_ns()), 1'953'125);  // 12.5: 512 Hz
}

TEST(Settings, WhatTheChipCannotDoIsInvalid) {
  EXPECT_TRUE(Settings{}.valid());
  EXPECT_TRUE(Settings{.resolution = Resolution::k20bit}.valid());
  EXPECT_FALSE((Settings{.gyro_range = GyroRange::k250dps, .resolution = Resolution::k20bit}.valid()));
  EXPECT_FALSE((Settings{.accel_range = AccelRange::k2g, .resolution = Resolution::k20bit}.valid()));
  EXPECT_FALSE(Settings{.watermark_packets = 0}.valid());
  EXPECT_FALSE(Settings{.watermark_packets = 128}.valid());
  EXPECT_FALSE(Settings{.external_clock_Hz = 60'000}.valid());
  EXPECT_FALSE(Settings{.rate = Rate::k25Hz}.valid()) << "half a turn of the stamp is 35 ms";
  EXPECT_TRUE((Settings{.rate = Rate::k25Hz, .tick = Tick::k16us}.valid()));
  EXPECT_FALSE(Settings{.mounting = Mounting::of(Axis::kPlusX, Axis::kPlusY, Axis::kMinusZ)}.valid()) << "a mirror";
}

TEST(Settings, StrongerFiltersAreLater) {
  for (const Rate rate : {Rate::k1kHz, Rate::k500Hz, Rate::k200Hz, Rate::k100Hz, Rate::k50Hz}) {
    for (std::uint8_t order = 0; order < 3; ++order) {
      for (std::uint8_t bandwidth = 1; bandwidth < 7; ++bandwidth) {
        const Settings wide{
            .rate = rate, .order = static_cast<FilterOrder>(order), .bandwidth = static_cast<Bandwidth>(bandwidth)};
        Settings narrow = wide;
        narrow.bandwidth = static_cast<Bandwidth>(bandwidth + 1);
        EXPECT_LT(group_delay_us(wide), group_delay_us(narrow));
        Settings steeper = wide;
        steeper.order = static_cast<FilterOrder>(order + 1);
        if (order < 2) {
          EXPECT_LT(group_delay_us(wide), group_delay_us(steeper));
        }
      }
    }
  }
}

}  // namespace
}  // namespace tetap::drivers::icm42688
