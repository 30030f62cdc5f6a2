// SPDX-License-Identifier: Apache-2.0
// Registers of the ICM-42688-P that the driver touches. Numbers behind the names: sections of the data sheet
// DS-000347 revision 1.8. Reserved bits keep their reset values (section 13.5), so fields are masks, not whole bytes.
#pragma once

#include <cstdint>

namespace tetap::drivers::icm42688 {

struct Register {
  std::uint8_t bank;
  std::uint8_t address;

  friend constexpr bool operator==(Register, Register) = default;
};

inline constexpr std::uint8_t kReadBit = 0x80;     // 9.6: first bit 1 reads, 0 writes
inline constexpr std::uint8_t kBankSelect = 0x76;  // 14.59: answers in every bank; 0..4 in bits 2:0
inline constexpr std::uint8_t kBankMask = 0x07;

// Bank 0
inline constexpr Register kDeviceConfig{0, 0x11};  // 14.1
inline constexpr std::uint8_t kSoftReset = 0x01;

inline constexpr Register kDriveConfig{0, 0x13};  // 14.2, values for SPI in 12.3
inline constexpr std::uint8_t kSlewRates = 0x3F, kSlewRatesSpi = 0x05;

inline constexpr Register kIntConfig{0, 0x14};  // 14.3
inline constexpr std::uint8_t kInt1Fields = 0x07, kInt1PushPullActiveHigh = 0x03;

inline constexpr Register kFifoConfig{0, 0x16};  // 14.4
inline constexpr std::uint8_t kFifoMode = 0xC0, kFifoStream = 0x40;

inline constexpr Register kAccelDataX1{0, 0x1F};  // 14.7 to 14.12: x, y, z, two bytes each; the gyroscope's follow
inline constexpr Register kIntStatus{0, 0x2D};    // 14.21; 14.22 and 14.23, the count of the FIFO, follow at once
inline constexpr std::uint8_t kResetDone = 0x10, kDataReady = 0x08, kFifoFull = 0x02;
inline constexpr Register kFifoData{0, 0x30};  // 14.24: the address does not move on

inline constexpr Register kSignalPathReset{0, 0x4B};  // 14.33
inline constexpr std::uint8_t kFifoFlush = 0x02;

inline constexpr Register kIntfConfig0{0, 0x4C};  // 14.34
inline constexpr std::uint8_t kIntfFields = 0xF3;
/// Invalid samples marked, the FIFO counted in bytes, everything big-endian, I2C off.
inline constexpr std::uint8_t kIntfMarkBytesBigSpi = 0x33;

inline constexpr Register kIntfConfig1{0, 0x4D};  // 14.35
inline constexpr std::uint8_t kRtcMode = 0x04, kClockSelect = 0x03, kClockPll = 0x01;
/// Not in the sheet, where these bits are reserved. With 10, as after a reset, the chip changes its range by itself.
/// The gyroscope then repeats a value for 1 to 2 ms beyond 100 deg/s. 01 turns this off (ArduPilot 25025 and 25332,
/// with the maker's answer; betaflight 12970).
inline constexpr std::uint8_t kRangeSwitch = 0xC0, kRangeSwitchOff = 0x40;

inline constexpr Register kPwrMgmt0{0, 0x4E};  // 14.36
inline constexpr std::uint8_t kPowerFields = 0x3F, kBothLowNoise = 0x0F, kBothOff = 0x00;

inline constexpr Register kGyroConfig0{0, 0x4F};   // 14.37
inline constexpr Register kAccelConfig0{0, 0x50};  // 14.38
inline constexpr std::uint8_t kRangeAndRate = 0xEF;
inline constexpr int kRangeShift = 5;

inline constexpr Register kGyroConfig1{0, 0x51};  // 14.39
inline constexpr std::uint8_t kGyroFilterOrder = 0x0C;
inline constexpr int kGyroFilterOrderShift = 2;
inline constexpr Register kGyroAccelConfig0{0, 0x52};  // 14.40
inline constexpr int kAccelBandwidthShift = 4;
inline constexpr Register kAccelConfig1{0, 0x53};  // 14.41
inline constexpr std::uint8_t kAccelFilterOrder = 0x18;
inline constexpr int kAccelFilterOrderShift = 3;

inline constexpr Register kTmstConfig{0, 0x54};  // 14.42
inline constexpr std::uint8_t kTmstFields = 0x1F, kTmstEnable = 0x01, kTmstCoarse = 0x08;

inline constexpr Register kFifoConfig1{0, 0x5F};  // 14.45
inline constexpr std::uint8_t kFifoFields = 0x7F, kFifoPartialRead = 0x40, kFifoWatermarkEach = 0x20, kFifoHires = 0x10,
                              kFifoTempGyroAccel = 0x07;
inline constexpr Register kFifoConfig2{0, 0x60};  // 14.46: watermark, low byte
inline constexpr Register kFifoConfig3{0, 0x61};  // 14.47: watermark, bits 11:8
inline constexpr std::uint8_t kWatermarkHigh = 0x0F;

inline constexpr Register kIntConfig0{0, 0x63};  // 14.49
inline constexpr std::uint8_t kIntClearFields = 0x3F, kThresholdClearsOnFifoRead = 0x08;
inline constexpr Register kIntConfig1{0, 0x64};  // 14.50, 12.6: INT_ASYNC_RESET has to be cleared
inline constexpr std::uint8_t kIntTiming = 0x70, kIntFastPulse = 0x60;
inline constexpr Register kIntSource0{0, 0x65};  // 14.51
inline constexpr std::uint8_t kIntSources = 0x7F, kThresholdToInt1 = 0x04;

inline constexpr Register kSelfTestConfig{0, 0x70};  // 14.57
inline constexpr std::uint8_t kSelfTestFields = 0x7F, kSelfTestGyro = 0x07, kSelfTestAccel = 0x78;
inline constexpr Register kWhoAmI{0, 0x75};  // 14.58
inline constexpr std::uint8_t kIdentity = 0x47;

// Bank 1
inline constexpr Register kSensorConfig0{1, 0x03};  // 15.1
inline constexpr std::uint8_t kAxesOff = 0x3F;
inline constexpr Register kGyroConfigStatic2{1, 0x0B};  // 15.2
inline constexpr std::uint8_t kGyroFilters = 0x03, kGyroAntiAliasOff = 0x02;
inline constexpr Register kGyroConfigStatic3{1, 0x0C};  // 15.3, 5.3
inline constexpr std::uint8_t kGyroDelt = 0x3F;
inline constexpr Register kGyroConfigStatic4{1, 0x0D};  // 15.4
inline constexpr Register kGyroConfigStatic5{1, 0x0E};  // 15.5
inline constexpr Register kXgStData{1, 0x5F};           // 15.11 to 15.13: factory codes of x, y, z
inline constexpr Register kIntfConfig5{1, 0x7B};        // 15.18
inline constexpr std::uint8_t kPin9Function = 0x06, kPin9ClockIn = 0x04;

// Bank 2
inline constexpr Register kAccelConfigStatic2{2, 0x03};  // 16.1
inline constexpr std::uint8_t kAccelFilters = 0x7F, kAccelAntiAliasOff = 0x01;
inline constexpr Register kAccelConfigStatic3{2, 0x04};  // 16.2
inline constexpr Register kAccelConfigStatic4{2, 0x05};  // 16.3
inline constexpr Register kXaStData{2, 0x3B};            // 16.4 to 16.6

// Bank 4
inline constexpr Register kOffsetUser0{4, 0x77};  // 18.18 to 18.26, 5.4

}  // namespace tetap::drivers::icm42688
