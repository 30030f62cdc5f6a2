// SPDX-License-Identifier: Apache-2.0
// The plainest host an ICM-42688-P can have, for tests of the fake itself: one register at a time, no cleverness.
#pragma once

#include "support/fakes/icm42688.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace tetap::fakes {

struct PlainHost {
  Icm42688 chip;
  std::int64_t now_us = 0;

  void wait_us(std::int64_t us) {
    now_us += us;
    chip.advance({now_us});
  }
  std::vector<std::uint8_t> read(std::uint8_t address, std::size_t size) {
    std::vector<std::uint8_t> in(size);
    const std::array<std::uint8_t, 1> out{static_cast<std::uint8_t>(address | 0x80)};
    (void)chip.transfer(out, in);
    return in;
  }
  std::uint8_t read(std::uint8_t address) { return read(address, 1)[0]; }
  void write(std::uint8_t address, std::uint8_t value) {
    const std::array<std::uint8_t, 2> out{address, value};
    (void)chip.transfer(out, {});
  }
  void bank(std::uint8_t bank) { write(icm42688::kRegBankSel, bank); }
  int word(std::uint8_t address) {
    const auto b = read(address, 2);
    return static_cast<std::int16_t>(b[0] << 8 | b[1]);
  }
  int count() {
    const auto b = read(icm42688::kFifoCountH, 2);
    return b[0] << 8 | b[1];
  }
  /// The usual settings, section by section, then both sensors on and their first 50 ms over.
  void start(std::uint8_t content = 0x47, std::uint8_t odr = 0x06, std::uint8_t intf0 = 0x73,
             std::uint8_t mode = 0x40) {
    using namespace icm42688;
    write(kIntfConfig0, intf0);
    write(kFifoConfig1, content);
    write(kFifoConfig2, 0x08);
    write(kGyroConfig0, odr);
    write(kAccelConfig0, odr);
    write(kFifoConfig, mode);
    write(kPwrMgmt0, 0x0F);
    wait_us(50'000);
  }
  /// Starts, then empties the FIFO, so that every packet from here on holds two valid sensors.
  void start_clean(std::uint8_t content = 0x47, std::uint8_t odr = 0x06, std::uint8_t intf0 = 0x73,
                   std::uint8_t mode = 0x40) {
    start(content, odr, intf0, mode);
    write(icm42688::kSignalPathReset, 0x02);
  }
};

template <class... T>
constexpr std::array<std::uint8_t, sizeof...(T)> bytes_of(T... values) {
  return {static_cast<std::uint8_t>(values)...};
}

/// A 16-byte packet 3 in big-endian order (6.1).
struct Packet3 {
  int header;
  std::array<int, 3> accel;
  std::array<int, 3> gyro;
  int temperature;
  int stamp;
};
inline Packet3 packet_3(const std::vector<std::uint8_t>& b, std::size_t at = 0) {
  const auto word = [&](std::size_t i) {
    return static_cast<int>(static_cast<std::int16_t>(b[at + i] << 8 | b[at + i + 1]));
  };
  return {.header = b[at],
          .accel = {word(1), word(3), word(5)},
          .gyro = {word(7), word(9), word(11)},
          .temperature = static_cast<std::int8_t>(b[at + 13]),
          .stamp = b[at + 14] << 8 | b[at + 15]};
}

}  // namespace tetap::fakes
