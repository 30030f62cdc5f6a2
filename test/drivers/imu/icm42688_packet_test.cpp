// SPDX-License-Identifier: Apache-2.0
// Bytes of the FIFO to numbers: every value of every field comes back as it was put in.
#include "drivers/imu/icm42688/packet.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace tetap::drivers::icm42688 {
namespace {

using Six = std::array<std::int32_t, 6>;  // accelerometer, gyroscope

std::vector<std::uint8_t> packet16(const Six& v, std::int8_t temperature, std::uint16_t ticks, std::uint8_t header) {
  std::vector<std::uint8_t> bytes{header};
  const auto put = [&](std::int32_t value) {
    bytes.push_back(static_cast<std::uint8_t>(value >> 8));
    bytes.push_back(static_cast<std::uint8_t>(value));
  };
  for (const std::int32_t value : v) put(value);
  bytes.push_back(static_cast<std::uint8_t>(temperature));
  put(ticks);
  return bytes;
}

std::vector<std::uint8_t> packet20(const Six& v, std::int16_t temperature, std::uint16_t ticks, std::uint8_t header) {
  std::vector<std::uint8_t> bytes{header};
  const auto put = [&](std::int32_t value) {
    bytes.push_back(static_cast<std::uint8_t>(value >> 8));
    bytes.push_back(static_cast<std::uint8_t>(value));
  };
  for (const std::int32_t value : v) put(value >> 4);
  put(temperature);
  put(ticks);
  for (std::size_t i = 0; i < 3; ++i) {
    bytes.push_back(static_cast<std::uint8_t>((v[i] & 0xF) << 4 | (v[i + 3] & 0xF)));
  }
  return bytes;
}

TEST(Packet, EveryValueOfSixteenBitsComesBackInEveryField) {
  for (std::int32_t value = -32767; value <= 32767; ++value) {
    const Six v{value, -value, value / 2, value / 3, value, -value};
    const Packet p = parse(packet16(v, 0, 0, 0x68), Resolution::k16bit);
    ASSERT_EQ(p.kind, PacketKind::kSample) << value;
    for (std::size_t i = 0; i < 3; ++i) {
      ASSERT_EQ(p.accel[i], v[i]);
      ASSERT_EQ(p.gyro[i], v[i + 3]);
    }
  }
}

TEST(Packet, EveryValueOfTwentyBitsComesBackInEveryField) {
  for (std::int32_t value = -524'287; value <= 524'287; value += 1) {
    const Six v{value, -value, value / 2, value / 3, value, -value};
    const Packet p = parse(packet20(v, 0, 0, 0x78), Resolution::k20bit);
    ASSERT_EQ(p.kind, PacketKind::kSample) << value;
    for (std::size_t i = 0; i < 3; ++i) {
      ASSERT_EQ(p.accel[i], v[i]);
      ASSERT_EQ(p.gyro[i], v[i + 3]);
    }
  }
}

TEST(Packet, TemperatureKeepsItsSignInEightAndInSixteenBits) {
  const Scales narrow = scales(Settings{});
  const Scales wide = scales(Settings{.resolution = Resolution::k20bit});
  for (int raw = -127; raw <= 127; ++raw) {
    const Packet p = parse(packet16({}, static_cast<std::int8_t>(raw), 0, 0x68), Resolution::k16bit);
    ASSERT_NEAR(temperature_degC(p, Resolution::k16bit, narrow), raw / 2.07 + 25.0, 1e-4) << raw;
  }
  for (int raw = -32'767; raw <= 32'767; ++raw) {
    const Packet p = parse(packet20({}, static_cast<std::int16_t>(raw), 0, 0x78), Resolution::k20bit);
    ASSERT_NEAR(temperature_degC(p, Resolution::k20bit, wide), raw / 132.48 + 25.0, 1e-3) << raw;
  }
}

TEST(Packet, AMarkedTemperatureIsNotANumber) {
  const Packet narrow = parse(packet16({}, -128, 0, 0x68), Resolution::k16bit);
  const Packet wide = parse(packet20({}, -32'768, 0, 0x78), Resolution::k20bit);
  EXPECT_TRUE(base::is_nan(temperature_degC(narrow, Resolution::k16bit, scales(Settings{}))));
  EXPECT_TRUE(
      base::is_nan(temperature_degC(wide, Resolution::k20bit, scales(Settings{.resolution = Resolution::k20bit}))));
}

TEST(Packet, EveryTimeStampComesBack) {
  for (std::uint32_t ticks = 0; ticks <= 0xFFFF; ++ticks) {
    const auto low = static_cast<std::uint16_t>(ticks);
    ASSERT_EQ(parse(packet16({}, 0, low, 0x68), Resolution::k16bit).ticks, low);
    ASSERT_EQ(parse(packet20({}, 0, low, 0x78), Resolution::k20bit).ticks, low);
  }
}

TEST(Packet, TheMarkerInAnyFieldMakesTheSampleInvalid) {
  for (std::size_t i = 0; i < 6; ++i) {
    Six v{};
    v[i] = -32'768;
    EXPECT_EQ(parse(packet16(v, 0, 0, 0x68), Resolution::k16bit).kind, PacketKind::kInvalid) << i;
    v[i] = -32'766;
    EXPECT_EQ(parse(packet16(v, 0, 0, 0x68), Resolution::k16bit).kind, PacketKind::kSample) << i;
    v[i] = -524'288;
    EXPECT_EQ(parse(packet20(v, 0, 0, 0x78), Resolution::k20bit).kind, PacketKind::kInvalid) << i;
    v[i] = -32'768;  // in 20 bits a value like any other
    EXPECT_EQ(parse(packet20(v, 0, 0, 0x78), Resolution::k20bit).kind, PacketKind::kSample) << i;
  }
}

TEST(Packet, OnlyHeadersOfTheConfiguredPacketAreTaken) {
  for (int header = 0; header <= 0xFF; ++header) {
    const auto byte = static_cast<std::uint8_t>(header);
    const PacketKind narrow = parse(packet16({}, 0, 0, byte), Resolution::k16bit).kind;
    const PacketKind wide = parse(packet20({}, 0, 0, byte), Resolution::k20bit).kind;
    const int layout = header & 0xFC;
    const PacketKind otherwise = header >= 0x80 ? PacketKind::kEmpty : PacketKind::kForeign;
    EXPECT_EQ(narrow, layout == 0x68 ? PacketKind::kSample : otherwise) << header;
    EXPECT_EQ(wide, layout == 0x78   ? PacketKind::kSample
                    : layout == 0x68 ? PacketKind::kInvalid  // 6.2: no new extension
                                     : otherwise)
        << header;
  }
}

TEST(Packet, TheHeaderSaysWhenTheRateChanged) {
  EXPECT_FALSE(parse(packet16({}, 0, 0, 0x68), Resolution::k16bit).rate_changed);
  for (std::uint8_t header = 0x69; header <= 0x6B; ++header) {
    EXPECT_TRUE(parse(packet16({}, 0, 0, header), Resolution::k16bit).rate_changed);
  }
}

TEST(Scales, FullScaleIsTheRangeOfEverySetting) {
  const double ranges_dps[] = {2000, 1000, 500, 250, 125, 62.5, 31.25, 15.625};
  for (std::uint8_t i = 0; i < 8; ++i) {
    const double full = 32768.0 * static_cast<double>(scales({.gyro_range = static_cast<GyroRange>(i)}).rate_radps);
    EXPECT_NEAR(full / (ranges_dps[i] * 3.14159265 / 180), 1.0, 2e-3) << int{i};  // the sheet rounds its LSB/dps
  }
  const double ranges_g[] = {16, 8, 4, 2};
  for (std::uint8_t i = 0; i < 4; ++i) {
    const double full = 32768.0 * static_cast<double>(scales({.accel_range = static_cast<AccelRange>(i)}).force_mps2);
    EXPECT_NEAR(full / (ranges_g[i] * 9.80665), 1.0, 1e-6) << int{i};
  }
}

TEST(Scales, BothPacketsMeasureTheSameInTheSameUnit) {
  const Scales narrow = scales(Settings{});
  const Scales wide = scales(Settings{.resolution = Resolution::k20bit});
  EXPECT_NEAR(narrow.rate_radps / wide.rate_radps, 16.0F, 0.04F);  // 16.4 against 16.375 per deg/s
  EXPECT_FLOAT_EQ(narrow.force_mps2 / wide.force_mps2, 16.0F);
}

}  // namespace
}  // namespace tetap::drivers::icm42688
