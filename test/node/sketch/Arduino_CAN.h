// SPDX-License-Identifier: Apache-2.0
// What the sketch needs of Arduino's core (ArduinoCore-API: HardwareCAN.h, CanMsg.h), with the bus and the clock in the
// test's hands.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <deque>
#include <vector>

struct CanMsg {
  CanMsg(std::uint32_t identifier, std::uint8_t length, const std::uint8_t* bytes)
      : id(identifier), data_length(length) {
    std::memcpy(data, bytes, length);
  }
  [[nodiscard]] bool isStandardId() const { return (id & 0x80000000U) == 0; }
  [[nodiscard]] std::uint32_t getStandardId() const { return id & 0x7FFU; }
  [[nodiscard]] std::uint32_t getExtendedId() const { return id & 0x1FFFFFFFU; }
  std::uint32_t id;
  std::uint8_t data_length;
  std::uint8_t data[8];
};
inline std::uint32_t CanStandardId(std::uint32_t id) { return id; }
enum class CanBitRate : int { BR_500k = 500000 };

inline struct {
  int bit_rate = 0;
  std::size_t room = ~std::size_t{0};
  std::deque<CanMsg> received;
  std::vector<CanMsg> sent;
  bool begin(CanBitRate rate) { return bit_rate = static_cast<int>(rate), true; }
  int write(const CanMsg& message) { return sent.size() < room ? (sent.push_back(message), 1) : -1; }
  std::size_t available() const { return received.size(); }
  CanMsg read() {
    const CanMsg first = received.front();
    received.pop_front();
    return first;
  }
} CAN;

inline std::uint32_t clock_us = 0;
inline std::uint32_t micros() { return clock_us; }
