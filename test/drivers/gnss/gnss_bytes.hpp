// SPDX-License-Identifier: Apache-2.0
// Frames of a GNSS receiver, written byte by byte, and everything that the receiver's driver makes of them.
#pragma once

#include "drivers/gnss/receiver.hpp"
#include "hal/byte_stream.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cstdio>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace tetap::drivers::gnss {

using Bytes = std::vector<std::uint8_t>;

inline Bytes ubx_frame(std::uint8_t message_class, std::uint8_t id, const Bytes& payload) {
  Bytes out{0xB5,
            0x62,
            message_class,
            id,
            static_cast<std::uint8_t>(payload.size() & 0xFF),
            static_cast<std::uint8_t>(payload.size() >> 8)};
  for (const std::uint8_t byte : payload) out.push_back(byte);
  unsigned a = 0, b = 0;
  for (std::size_t i = 2; i < out.size(); ++i) b += a += out[i];
  out.push_back(static_cast<std::uint8_t>(a));
  out.push_back(static_cast<std::uint8_t>(b));
  return out;
}

inline Bytes sentence(const std::string& text) {
  unsigned sum = 0;
  for (const char c : text) sum ^= static_cast<unsigned char>(c);
  char end[8];
  std::snprintf(end, sizeof end, "*%02X\r\n", sum);
  const std::string whole = "$" + text + end;
  return {whole.begin(), whole.end()};
}

inline void put(Bytes& p, std::size_t at, std::int64_t value, std::size_t size) {
  for (std::size_t i = 0; i < size; ++i) p[at + i] = static_cast<std::uint8_t>(value >> (8 * i));
}
inline void put_float(Bytes& p, std::size_t at, float value) { put(p, at, std::bit_cast<std::uint32_t>(value), 4); }

/// NAV-PVT with another value in every field.
inline Bytes pvt(std::uint32_t itow = 100'000, std::size_t length = 92) {
  Bytes p(length, 0);
  put(p, 0, itow, 4);
  put(p, 4, 2024, 2);
  put(p, 6, 2, 1), put(p, 7, 29, 1), put(p, 8, 23, 1), put(p, 9, 59, 1), put(p, 10, 60, 1);
  put(p, 11, 0x07, 1);
  put(p, 16, -123'456, 4);
  put(p, 20, 3, 1), put(p, 21, 0x01, 1), put(p, 23, 17, 1);
  put(p, 24, -1'213'142'468, 4), put(p, 28, 440'690'105, 4);
  put(p, 32, 1'125'900, 4), put(p, 36, 1'147'200, 4);
  put(p, 40, 1'234, 4), put(p, 44, 2'345, 4);
  put(p, 48, -1'500, 4), put(p, 52, 2'000, 4), put(p, 56, 250, 4);
  put(p, 60, 2'500, 4), put(p, 64, 12'687'000, 4), put(p, 68, 321, 4), put(p, 72, 45'000, 4);
  put(p, 76, 156, 2);
  return p;
}

inline Bytes operator+(Bytes a, const Bytes& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

struct Received {
  std::vector<Report> reports;
  std::vector<Baseline> baselines;
  std::vector<ubx::Acknowledge> acknowledgements;
  int identified = 0;
  Health health;
};

inline Received receive(const Bytes& bytes, const ReceiverSettings& settings) {
  Received received;
  GnssReceiver<> receiver(settings);
  struct {
    Received& received;
    void operator()(const Report& r) { received.reports.push_back(r); }
    void operator()(const Baseline& b) { received.baselines.push_back(b); }
    void operator()(const ubx::Acknowledge& a) { received.acknowledgements.push_back(a); }
    void operator()(const ubx::Identified&) { ++received.identified; }
  } handler{received};
  receiver.on_bytes(bytes, handler);
  receiver.finish(handler);
  received.health = receiver.health();
  return received;
}
inline Received receive(const Bytes& bytes, bool checksum_required = true) {
  return receive(bytes, ReceiverSettings{.nmea_checksum_required = checksum_required});
}
inline Report only(const Bytes& bytes) {
  const Received received = receive(bytes);
  EXPECT_EQ(received.reports.size(), 1U);
  return received.reports.empty() ? Report{} : received.reports[0];
}

/// A line on which prepared bytes come at their times.
struct Line {
  std::vector<std::pair<std::int64_t, std::uint8_t>> bytes;
  std::int64_t now_us = 0;
  std::size_t at = 0;

  void say(std::int64_t at_us, const Bytes& some) {
    for (const std::uint8_t byte : some) bytes.emplace_back(at_us, byte);
    std::stable_sort(bytes.begin(), bytes.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  }
  [[nodiscard]] hal::SerialFaults faults() const { return {}; }
  std::size_t read(std::span<std::uint8_t> in) {
    std::size_t n = 0;
    for (; n < in.size() && at < bytes.size() && bytes[at].first <= now_us; ++at) in[n++] = bytes[at].second;
    return n;
  }
  std::size_t write(std::span<const std::uint8_t> out) { return out.size(); }
};

}  // namespace tetap::drivers::gnss
