// SPDX-License-Identifier: Apache-2.0
// The register map of the ICM-42688-P as its data sheet gives it (TDK DS-000347 revision 1.8, sections 13 to 18). It
// holds reset values, the bits that a user may set, and the effect of a read or a write. It uses no driver: the fake is
// judged against it.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

namespace tetap::fakes::icm42688 {

enum class Access : std::uint8_t { kReadWrite, kReadOnly, kClearOnRead, kCommand };

struct Register {
  std::uint8_t bank;
  std::uint8_t address;
  std::uint8_t reset;
  std::uint8_t settable;  ///< bits that are not reserved; section 13: "Reserved must not be modified by the user"
  Access access;
  const char* section;
};

// Bank 0, the addresses the fake acts on.
inline constexpr std::uint8_t kDeviceConfig = 0x11;
inline constexpr std::uint8_t kFifoConfig = 0x16;
inline constexpr std::uint8_t kTempData1 = 0x1D;
inline constexpr std::uint8_t kAccelDataX1 = 0x1F;
inline constexpr std::uint8_t kGyroDataX1 = 0x25;
inline constexpr std::uint8_t kIntStatus = 0x2D;
inline constexpr std::uint8_t kFifoCountH = 0x2E;
inline constexpr std::uint8_t kFifoCountL = 0x2F;
inline constexpr std::uint8_t kFifoData = 0x30;
inline constexpr std::uint8_t kSignalPathReset = 0x4B;
inline constexpr std::uint8_t kIntfConfig0 = 0x4C;
inline constexpr std::uint8_t kIntfConfig1 = 0x4D;
inline constexpr std::uint8_t kPwrMgmt0 = 0x4E;
inline constexpr std::uint8_t kGyroConfig0 = 0x4F;
inline constexpr std::uint8_t kAccelConfig0 = 0x50;
inline constexpr std::uint8_t kGyroConfig1 = 0x51;
inline constexpr std::uint8_t kGyroAccelConfig0 = 0x52;
inline constexpr std::uint8_t kAccelConfig1 = 0x53;
inline constexpr std::uint8_t kTmstConfig = 0x54;
inline constexpr std::uint8_t kFifoConfig1 = 0x5F;
inline constexpr std::uint8_t kFifoConfig2 = 0x60;
inline constexpr std::uint8_t kFifoConfig3 = 0x61;
inline constexpr std::uint8_t kIntConfig1 = 0x64;
inline constexpr std::uint8_t kIntSource0 = 0x65;
inline constexpr std::uint8_t kFifoLostPkt0 = 0x6C;
inline constexpr std::uint8_t kFifoLostPkt1 = 0x6D;
inline constexpr std::uint8_t kSelfTestConfig = 0x70;
inline constexpr std::uint8_t kWhoAmI = 0x75;
inline constexpr std::uint8_t kRegBankSel = 0x76;
// Bank 1
inline constexpr std::uint8_t kSensorConfig0 = 0x03;
inline constexpr std::uint8_t kXgStData = 0x5F;
inline constexpr std::uint8_t kTmstVal0 = 0x62;
inline constexpr std::uint8_t kIntfConfig4 = 0x7A;
inline constexpr std::uint8_t kIntfConfig5 = 0x7B;
// Bank 2 and bank 4
inline constexpr std::uint8_t kXaStData = 0x3B;
inline constexpr std::uint8_t kOffsetUser0 = 0x77;

inline constexpr std::uint8_t kIdentity = 0x47;

// INT_STATUS, 14.21
inline constexpr std::uint8_t kResetDone = 0x10;
inline constexpr std::uint8_t kDataReady = 0x08;
inline constexpr std::uint8_t kFifoThreshold = 0x04;
inline constexpr std::uint8_t kFifoFull = 0x02;

namespace detail {
inline constexpr auto kRw = Access::kReadWrite;
inline constexpr auto kRo = Access::kReadOnly;
}  // namespace detail

/// Sections 14 to 18. Factory-trimmed values (notch filter, self-test codes, CLKDIV) are an example part's.
inline constexpr auto kRegisters = std::to_array<Register>({
    {0, 0x11, 0x00, 0x11, detail::kRw, "14.1"},            // DEVICE_CONFIG
    {0, 0x13, 0x05, 0x3F, detail::kRw, "14.2"},            // DRIVE_CONFIG
    {0, 0x14, 0x00, 0x3F, detail::kRw, "14.3"},            // INT_CONFIG
    {0, 0x16, 0x00, 0xC0, detail::kRw, "14.4"},            // FIFO_CONFIG
    {0, 0x1D, 0x80, 0x00, detail::kRo, "14.5"},            // TEMP_DATA1, then TEMP_DATA0
    {0, 0x1E, 0x00, 0x00, detail::kRo, "14.6"},            //
    {0, 0x1F, 0x80, 0x00, detail::kRo, "14.7"},            // ACCEL_DATA_X1 to Z0
    {0, 0x20, 0x00, 0x00, detail::kRo, "14.8"},            //
    {0, 0x21, 0x80, 0x00, detail::kRo, "14.9"},            //
    {0, 0x22, 0x00, 0x00, detail::kRo, "14.10"},           //
    {0, 0x23, 0x80, 0x00, detail::kRo, "14.11"},           //
    {0, 0x24, 0x00, 0x00, detail::kRo, "14.12"},           //
    {0, 0x25, 0x80, 0x00, detail::kRo, "14.13"},           // GYRO_DATA_X1 to Z0
    {0, 0x26, 0x00, 0x00, detail::kRo, "14.14"},           //
    {0, 0x27, 0x80, 0x00, detail::kRo, "14.15"},           //
    {0, 0x28, 0x00, 0x00, detail::kRo, "14.16"},           //
    {0, 0x29, 0x80, 0x00, detail::kRo, "14.17"},           //
    {0, 0x2A, 0x00, 0x00, detail::kRo, "14.18"},           //
    {0, 0x2B, 0x00, 0x00, detail::kRo, "14.19"},           // TMST_FSYNCH
    {0, 0x2C, 0x00, 0x00, detail::kRo, "14.20"},           // TMST_FSYNCL
    {0, 0x2D, 0x10, 0x00, Access::kClearOnRead, "14.21"},  // INT_STATUS
    {0, 0x2E, 0x00, 0x00, detail::kRo, "14.22"},           // FIFO_COUNTH
    {0, 0x2F, 0x00, 0x00, detail::kRo, "14.23"},           // FIFO_COUNTL
    {0, 0x30, 0xFF, 0x00, detail::kRo, "14.24"},           // FIFO_DATA
    {0, 0x31, 0x00, 0x00, detail::kRo, "14.25"},           // APEX_DATA0 to 5
    {0, 0x32, 0x00, 0x00, detail::kRo, "14.26"},           //
    {0, 0x33, 0x00, 0x00, detail::kRo, "14.27"},           //
    {0, 0x34, 0x04, 0x00, detail::kRo, "14.28"},           //
    {0, 0x35, 0x00, 0x00, detail::kRo, "14.29"},           //
    {0, 0x36, 0x00, 0x00, detail::kRo, "14.30"},           //
    {0, 0x37, 0x00, 0x00, Access::kClearOnRead, "14.31"},  // INT_STATUS2
    {0, 0x38, 0x00, 0x00, Access::kClearOnRead, "14.32"},  // INT_STATUS3
    {0, 0x4B, 0x00, 0x6E, Access::kCommand, "14.33"},      // SIGNAL_PATH_RESET
    {0, 0x4C, 0x30, 0xF3, detail::kRw, "14.34"},           // INTF_CONFIG0
    {0, 0x4D, 0x91, 0xCF, detail::kRw, "14.35"},           // INTF_CONFIG1; 7:6 reserved but for ArduPilot 25332
    {0, 0x4E, 0x00, 0x3F, detail::kRw, "14.36"},           // PWR_MGMT0
    {0, 0x4F, 0x06, 0xEF, detail::kRw, "14.37"},           // GYRO_CONFIG0
    {0, 0x50, 0x06, 0xEF, detail::kRw, "14.38"},           // ACCEL_CONFIG0
    {0, 0x51, 0x16, 0xEF, detail::kRw, "14.39"},           // GYRO_CONFIG1
    {0, 0x52, 0x11, 0xFF, detail::kRw, "14.40"},           // GYRO_ACCEL_CONFIG0
    {0, 0x53, 0x0D, 0x1E, detail::kRw, "14.41"},           // ACCEL_CONFIG1
    {0, 0x54, 0x23, 0x1F, detail::kRw, "14.42"},           // TMST_CONFIG
    {0, 0x56, 0x82, 0xFB, detail::kRw, "14.43"},           // APEX_CONFIG0
    {0, 0x57, 0x00, 0x0F, detail::kRw, "14.44"},           // SMD_CONFIG
    {0, 0x5F, 0x00, 0x7F, detail::kRw, "14.45"},           // FIFO_CONFIG1
    {0, 0x60, 0x00, 0xFF, detail::kRw, "14.46"},           // FIFO_CONFIG2
    {0, 0x61, 0x00, 0x0F, detail::kRw, "14.47"},           // FIFO_CONFIG3
    {0, 0x62, 0x10, 0x73, detail::kRw, "14.48"},           // FSYNC_CONFIG
    {0, 0x63, 0x00, 0x3F, detail::kRw, "14.49"},           // INT_CONFIG0
    {0, 0x64, 0x10, 0x70, detail::kRw, "14.50"},           // INT_CONFIG1
    {0, 0x65, 0x10, 0x7F, detail::kRw, "14.51"},           // INT_SOURCE0
    {0, 0x66, 0x00, 0x4F, detail::kRw, "14.52"},           // INT_SOURCE1
    {0, 0x68, 0x00, 0x7F, detail::kRw, "14.53"},           // INT_SOURCE3
    {0, 0x69, 0x00, 0x4F, detail::kRw, "14.54"},           // INT_SOURCE4
    {0, 0x6C, 0x00, 0x00, detail::kRo, "14.55"},           // FIFO_LOST_PKT0
    {0, 0x6D, 0x00, 0x00, detail::kRo, "14.56"},           // FIFO_LOST_PKT1
    {0, 0x70, 0x00, 0x7F, detail::kRw, "14.57"},           // SELF_TEST_CONFIG
    {0, 0x75, kIdentity, 0x00, detail::kRo, "14.58"},      // WHO_AM_I
    {0, 0x76, 0x00, 0x07, detail::kRw, "14.59"},           // REG_BANK_SEL, in every bank
    {1, 0x03, 0x80, 0x3F, detail::kRw, "15.1"},            // SENSOR_CONFIG0
    {1, 0x0B, 0xA0, 0x03, detail::kRw, "15.2"},            // GYRO_CONFIG_STATIC2 to 10
    {1, 0x0C, 0x0D, 0x3F, detail::kRw, "15.3"},            //
    {1, 0x0D, 0xAA, 0xFF, detail::kRw, "15.4"},            //
    {1, 0x0E, 0x80, 0xFF, detail::kRw, "15.5"},            //
    {1, 0x0F, 0x52, 0xFF, detail::kRw, "15.6"},            //
    {1, 0x10, 0x61, 0xFF, detail::kRw, "15.7"},            //
    {1, 0x11, 0x4B, 0xFF, detail::kRw, "15.8"},            //
    {1, 0x12, 0x38, 0x3F, detail::kRw, "15.9"},            //
    {1, 0x13, 0x11, 0x70, detail::kRw, "15.10"},           //
    {1, 0x5F, 140, 0xFF, detail::kRw, "15.11"},            // XG_ST_DATA, YG, ZG
    {1, 0x60, 145, 0xFF, detail::kRw, "15.12"},            //
    {1, 0x61, 150, 0xFF, detail::kRw, "15.13"},            //
    {1, 0x62, 0x00, 0x00, detail::kRo, "15.14"},           // TMSTVAL0 to 2
    {1, 0x63, 0x00, 0x00, detail::kRo, "15.15"},           //
    {1, 0x64, 0x00, 0x00, detail::kRo, "15.16"},           //
    {1, 0x7A, 0x83, 0x42, detail::kRw, "15.17"},           // INTF_CONFIG4
    {1, 0x7B, 0x00, 0x06, detail::kRw, "15.18"},           // INTF_CONFIG5
    {1, 0x7C, 0x5F, 0x9F, detail::kRw, "15.19"},           // INTF_CONFIG6
    {2, 0x03, 0x30, 0x7F, detail::kRw, "16.1"},            // ACCEL_CONFIG_STATIC2 to 4
    {2, 0x04, 0x40, 0xFF, detail::kRw, "16.2"},            //
    {2, 0x05, 0x62, 0xFF, detail::kRw, "16.3"},            //
    {2, 0x3B, 110, 0xFF, detail::kRw, "16.4"},             // XA_ST_DATA, YA, ZA
    {2, 0x3C, 115, 0xFF, detail::kRw, "16.5"},             //
    {2, 0x3D, 120, 0xFF, detail::kRw, "16.6"},             //
    {3, 0x2A, 0x47, 0x00, detail::kRo, "17.1"},            // CLKDIV
    {4, 0x40, 0xA2, 0xFF, detail::kRw, "18.1"},            // APEX_CONFIG1 to 9
    {4, 0x41, 0x85, 0xFF, detail::kRw, "18.2"},            //
    {4, 0x42, 0x51, 0xFF, detail::kRw, "18.3"},            //
    {4, 0x43, 0xA4, 0xF8, detail::kRw, "18.4"},            //
    {4, 0x44, 0x8C, 0x07, detail::kRw, "18.5"},            //
    {4, 0x45, 0x5C, 0x07, detail::kRw, "18.6"},            //
    {4, 0x46, 0x45, 0xFF, detail::kRw, "18.7"},            //
    {4, 0x47, 0x5B, 0x7F, detail::kRw, "18.8"},            //
    {4, 0x48, 0x00, 0x01, detail::kRw, "18.9"},            //
    {4, 0x4A, 0x00, 0xFF, detail::kRw, "18.10"},           // ACCEL_WOM_X_THR, Y, Z
    {4, 0x4B, 0x00, 0xFF, detail::kRw, "18.11"},           //
    {4, 0x4C, 0x00, 0xFF, detail::kRw, "18.12"},           //
    {4, 0x4D, 0x00, 0x3F, detail::kRw, "18.13"},           // INT_SOURCE6 to 10
    {4, 0x4E, 0x00, 0x3F, detail::kRw, "18.14"},           //
    {4, 0x4F, 0x00, 0x3F, detail::kRw, "18.15"},           //
    {4, 0x50, 0x00, 0x9E, detail::kRw, "18.16"},           //
    {4, 0x51, 0x00, 0x3F, detail::kRw, "18.17"},           //
    {4, 0x77, 0x00, 0xFF, detail::kRw, "18.18"},           // OFFSET_USER0 to 8
    {4, 0x78, 0x00, 0xFF, detail::kRw, "18.19"},           //
    {4, 0x79, 0x00, 0xFF, detail::kRw, "18.20"},           //
    {4, 0x7A, 0x00, 0xFF, detail::kRw, "18.21"},           //
    {4, 0x7B, 0x00, 0xFF, detail::kRw, "18.22"},           //
    {4, 0x7C, 0x00, 0xFF, detail::kRw, "18.23"},           //
    {4, 0x7D, 0x00, 0xFF, detail::kRw, "18.24"},           //
    {4, 0x7E, 0x00, 0xFF, detail::kRw, "18.25"},           //
    {4, 0x7F, 0x00, 0xFF, detail::kRw, "18.26"},           //
});

/// The register at this place, or nullptr. REG_BANK_SEL "is accessible from all register banks" (14.59).
[[nodiscard]] constexpr const Register* find_register(std::uint8_t bank, std::uint8_t address) {
  const std::uint8_t home = address == kRegBankSel ? std::uint8_t{0} : bank;
  const auto* found = std::find_if(kRegisters.begin(), kRegisters.end(),
                                   [&](const Register& r) { return r.bank == home && r.address == address; });
  return found == kRegisters.end() ? nullptr : found;
}

/// The stored bytes of the five banks, every one readable at any time.
class RegisterFile {
 public:
  static constexpr std::uint8_t kBanks = 5;

  RegisterFile() { reset(); }
  void reset() {
    for (const Register& r : kRegisters) at(r.bank, r.address) = r.reset;
  }
  [[nodiscard]] std::uint8_t& at(std::uint8_t bank, std::uint8_t address) { return bytes_[bank][address]; }
  [[nodiscard]] std::uint8_t at(std::uint8_t bank, std::uint8_t address) const { return bytes_[bank][address]; }
  [[nodiscard]] std::uint8_t& operator[](std::uint8_t address) { return bytes_[0][address]; }
  [[nodiscard]] std::uint8_t operator[](std::uint8_t address) const { return bytes_[0][address]; }

 private:
  std::array<std::array<std::uint8_t, 128>, kBanks> bytes_{};
};

}  // namespace tetap::fakes::icm42688
