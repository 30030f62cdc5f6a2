// SPDX-License-Identifier: Apache-2.0
// A u-blox receiver as its UART1 shows it, with all its settings in RAM. It takes configuration by keys (generation 9)
// or by the older messages, and acknowledges them. It sends NAV-PVT, NAV-COV and NMEA at the rates that are set. u-blox
// UBX-18010854 R08 (F9 HPG 1.13 interface description): 3.2 frame, 3.9 ACK, 3.10 CFG, 3.12 MON-VER, 3.15 NAV,
// 6 configuration. Generation 8: UBX-13003221 R19. Bytes that wait are sent at the rate that is set when their turn
// comes, as CFG-PRT warns.
#pragma once

#include "sim_host/emulator/sensor_world.hpp"

#include <array>
#include <cstdint>
#include <deque>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace tetap::board {

/// One solution of the sky. North, east, down at the antenna.
struct GnssSolution {
  std::int64_t epoch_ms = 0;  ///< after the receiver's day began: a whole period of the solutions
  bool fix = false;
  bool differential = false;
  std::uint8_t satellites = 0;
  std::int64_t latitude_1e7deg = 0, longitude_1e7deg = 0;
  double height_m = 0;  ///< above the ellipsoid
  std::array<double, 3> velocity_ned_mps{};
  double horizontal_sigma_m = 0;  ///< per axis
  double vertical_sigma_m = 0;
  double velocity_sigma_mps = 0;  ///< per axis
};

struct UbloxOptions {
  int generation = 9;                          ///< 8 has no CFG-VALSET and no NAV-COV
  std::int64_t baud = 38'400;                  ///< factory setting; generation 8 has 9600
  Picoseconds boot_time = 300 * kMillisecond;  ///< silent after power-on
  std::size_t output_buffer = 2048;            ///< a message that does not fit is left out whole
  std::int64_t first_second = 1'795'608'000;   ///< start of the receiver's day, UTC after 1970: 2026-11-25 12:00:00
};

class UbloxReceiver {
 public:
  explicit UbloxReceiver(const UbloxOptions& options);

  /// The receiver's supply comes back at `now`: settings in RAM are lost.
  void power_on(Picoseconds now);
  void on_solution(Picoseconds now, const GnssSolution& solution);
  /// A byte from the board with the rate it had on the line.
  void on_byte(Picoseconds now, std::uint8_t byte, std::int64_t baud);
  [[nodiscard]] SensorWorld::GnssByte next_byte(Picoseconds now);

  [[nodiscard]] std::int64_t baud() const { return static_cast<std::int64_t>(items_.at(kBaud)); }
  /// Messages from the board that were taken, and refused by UBX-ACK-NAK.
  std::uint32_t accepted = 0, refused = 0;
  std::uint32_t garbage = 0;  ///< bytes at another rate, frames with a wrong checksum
  std::uint32_t epochs = 0;   ///< solutions that went out

 private:
  // Configuration items of UART1 (chapter 6). The size of a value is in bits 30 to 28 of its key.
  static constexpr std::uint32_t kBaud = 0x40520001, kStopBits = 0x20520002, kDataBits = 0x20520003,
                                 kParity = 0x20520004, kEnabled = 0x10520005, kUbxIn = 0x10730001, kNmeaIn = 0x10730002,
                                 kUbxOut = 0x10740001, kNmeaOut = 0x10740002, kMeasurement_ms = 0x30210001,
                                 kNavigation = 0x30210002, kDynamicModel = 0x20110021, kPvt = 0x20910007,
                                 kPosLlh = 0x2091002A, kStatus = 0x2091001B, kVelNed = 0x20910043,
                                 kTimeUtc = 0x2091005C, kDop = 0x20910039, kCov = 0x20910084, kGga = 0x209100BB,
                                 kGll = 0x209100CA, kGsa = 0x209100C0, kRmc = 0x209100AC, kVtg = 0x209100B1;
  using Items = std::map<std::uint32_t, std::uint64_t>;

  void reset_items();
  void on_message(std::uint8_t message_class, std::uint8_t id, std::span<const std::uint8_t> payload);
  [[nodiscard]] bool configure(std::uint8_t id, std::span<const std::uint8_t> payload);
  [[nodiscard]] bool set_values(std::span<const std::uint8_t> payload);
  [[nodiscard]] bool set_port(std::span<const std::uint8_t> payload);
  [[nodiscard]] bool set_message_rate(std::span<const std::uint8_t> payload);
  void send_version();
  void send_pvt(const GnssSolution& solution);
  void send_cov(const GnssSolution& solution);
  void send_nmea(const GnssSolution& solution);
  void send_sentence(const std::string& body);
  void send(std::uint8_t message_class, std::uint8_t id, std::span<const std::uint8_t> payload);
  void put(std::span<const std::uint8_t> bytes);

  UbloxOptions options_;
  Items items_;
  std::deque<std::uint8_t> out_;
  std::vector<std::uint8_t> in_;
  Picoseconds awake_ = 0;
  std::int64_t last_period_ = -1;
};

}  // namespace tetap::board
