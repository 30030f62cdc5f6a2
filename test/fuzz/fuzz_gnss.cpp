// SPDX-License-Identifier: Apache-2.0
// libFuzzer: bytes of a GNSS receiver. The same reports and the same counts come out, however they are divided, and a
// reported position is one. A driver that configures a receiver made of these bytes sends a bounded number of them.
#include "drivers/gnss/driver.hpp"
#include "hal/byte_stream.hpp"

#include <bit>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <span>
#include <vector>

namespace tetap::drivers::gnss {
namespace {

[[noreturn]] void fail(const char* what) {
  std::fprintf(stderr, "fuzz_gnss: %s\n", what);
  std::abort();
}

using Words = std::vector<std::uint64_t>;

/// Every field, NaN included, and what must hold of it.
void record(const Report& r, Words& out) {
  const auto put = [&](auto x) { out.push_back(static_cast<std::uint64_t>(x)); };
  put(r.protocol), put(r.fix), put(r.satellites), put(r.has_position), put(r.itow_ms.value_or(0)),
      put(r.itow_ms.has_value());
  put(r.utc.year), put(r.utc.month), put(r.utc.day), put(r.utc.hour), put(r.utc.minute), put(r.utc.second),
      put(r.utc.nano);
  put(r.utc.date_valid), put(r.utc.time_valid), put(r.time_uncertain), put(r.latitude_2ndeg), put(r.longitude_2ndeg);
  const auto number = [&](float x) {
    if (!base::is_nan(x) && !base::is_finite(x)) fail("an infinite number");
    put(std::bit_cast<std::uint32_t>(x));
  };
  for (const float x :
       {r.height_m, r.height_msl_m, r.horizontal_acc_m, r.vertical_acc_m, r.v_n_mps[0], r.v_n_mps[1], r.v_n_mps[2],
        r.speed_mps, r.course_rad, r.speed_acc_mps, r.course_acc_rad, r.pdop, r.hdop, r.vdop})
    number(x);
  for (const auto& c : {r.position_cov_m2, r.velocity_cov_m2ps2}) {
    if (!c) continue;
    for (const float x : *c) number(x);
    if (!((*c)[0] > 0 && (*c)[3] > 0 && (*c)[5] > 0)) fail("a variance that is none");
  }
  constexpr std::int64_t kQuarter = 45'000'000'000;
  if (r.latitude_2ndeg > kQuarter || r.latitude_2ndeg < -kQuarter || r.longitude_2ndeg > 2 * kQuarter ||
      r.longitude_2ndeg < -2 * kQuarter)
    fail("a place that is not on Earth");
  if (r.utc.date_valid && !is_date(r.utc.year, r.utc.month, r.utc.day)) fail("a date that does not exist");
  if (r.utc.time_valid && !is_time(r.utc.hour, r.utc.minute, r.utc.second)) fail("a time that does not exist");
  if (const auto p = position_of(r); p && p->fix < sensor::GnssFix::k2d) fail("a position without a fix");
  static_cast<void>(velocity_of(r));
}

void record(const Baseline& b, Words& out) {
  out.push_back(b.itow_ms.value_or(0));
  out.push_back(b.valid ? 1 : 0);
  for (const float x : {b.n_m[0], b.n_m[1], b.n_m[2], b.length_m, b.length_acc_m, b.course_rad, b.course_acc_rad}) {
    if (!base::is_nan(x) && !base::is_finite(x)) fail("an infinite number in a baseline");
    out.push_back(std::bit_cast<std::uint32_t>(x));
  }
  const auto heading = heading_of(b);
  if (heading.has_value() != b.valid) fail("a heading of a line that is none");
  if (heading && !(base::abs(heading->yaw_rad) <= base::kPi)) fail("a heading beyond half a turn");
  if (heading && heading->acc_rad < 0) fail("a negative accuracy");
}

template <std::size_t Capacity>
Words reports_of(std::span<const std::uint8_t> bytes, std::size_t piece, bool checksum, Health& health) {
  Words out;
  GnssReceiver<Capacity> receiver({.nmea_checksum_required = checksum});
  const auto handler = [&](const auto& event) {
    if constexpr (requires { record(event, out); }) record(event, out);
  };
  for (std::size_t at = 0; at < bytes.size(); at += piece)
    receiver.on_bytes(bytes.subspan(at, std::min(piece, bytes.size() - at)), handler);
  receiver.finish(handler);
  health = receiver.health();
  return out;
}

/// Says the bytes a few at a time, whatever it hears.
struct Port {
  std::span<const std::uint8_t> left;
  std::size_t piece;
  std::size_t written = 0;
  std::size_t read(std::span<std::uint8_t> in) {
    const std::size_t n = std::min({in.size(), left.size(), piece});
    std::copy_n(left.begin(), n, in.begin());
    left = left.subspan(n);
    if (n > 0) piece = 0;
    return n;
  }
  std::size_t write(std::span<const std::uint8_t> out) { return written += out.size(), out.size(); }
  [[nodiscard]] hal::SerialFaults faults() const { return {}; }
  void set_baud(std::uint32_t) {}
};

}  // namespace
}  // namespace tetap::drivers::gnss

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace tetap::drivers::gnss;
  if (size < 2) return 0;
  const bool checksum = (data[0] & 1) != 0;
  const std::size_t piece = 1 + (data[0] >> 1);
  const std::span<const std::uint8_t> bytes(data + 1, size - 1);
  Health one, other;
  const Words whole = reports_of<1029>(bytes, bytes.size(), checksum, one);
  for (const std::size_t division : {std::size_t{1}, piece}) {
    if (reports_of<1029>(bytes, division, checksum, other) != whole || !(one == other)) {
      fail("the division of the bytes mattered");
    }
  }
  Health small;
  static_cast<void>(reports_of<kLongestSentence>(bytes, piece, checksum, small));

  Port port{bytes, piece};
  GnssDriver<Port> driver(port);
  tetap::base::Micros now{}, last{};
  for (std::size_t turn = 0; turn < bytes.size() / piece + 20; ++turn) {
    now += tetap::base::Micros{(turn % 8 == 7) ? 300'000 : 20'000};
    port.piece = piece;
    driver.poll(now, [&](const Report&, tetap::base::Micros stamp) {
      if (stamp > now) fail("a stamp from the future");
      last = stamp;
    });
  }
  // At most one request at every turn and one more for each answer of 10 bytes.
  if (port.written > 64 * (bytes.size() / piece + 20 + bytes.size() / 10 + 2)) fail("too many requests");
  return 0;
}
