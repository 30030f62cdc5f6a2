// SPDX-License-Identifier: Apache-2.0
// The scanner's bytes, by its manual and from a scanner, become scans in the robot's axes; damage costs what it hit.
#include "drivers/lidar/ld19/driver.hpp"

#include "tetap/bus/scan_assembly.hpp"
#include "tetap/firmware/wired_lidar.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <numbers>
#include <random>
#include <vector>

namespace tetap::drivers::ld19 {
namespace {

using Bytes = std::vector<std::uint8_t>;
using std::numbers::pi;

// LD19 development manual, sec. 3.3.
const Bytes kManual{0x54, 0x2C, 0x68, 0x08, 0xAB, 0x7E, 0xE0, 0x00, 0xE4, 0xDC, 0x00, 0xE2, 0xD9, 0x00, 0xE5, 0xD5,
                    0x00, 0xE3, 0xD3, 0x00, 0xE4, 0xD0, 0x00, 0xE9, 0xCD, 0x00, 0xE4, 0xCA, 0x00, 0xE2, 0xC7, 0x00,
                    0xE9, 0xC5, 0x00, 0xE5, 0xC2, 0x00, 0xE5, 0xC0, 0x00, 0xE5, 0xBE, 0x82, 0x3A, 0x1A, 0x50};
// From a scanner at 6 turns a second without a return; printed in a public course report on the LD19.
const Bytes kRecorded{0x54, 0x2C, 0x74, 0x08, 0xB0, 0x86, 0x00, 0x00, 0xD4, 0x00, 0x00, 0xD4, 0x00, 0x00, 0xD4, 0x00,
                      0x00, 0xD4, 0x00, 0x00, 0xD4, 0x00, 0x00, 0xD5, 0x00, 0x00, 0xD5, 0x00, 0x00, 0x49, 0x00, 0x00,
                      0x5F, 0x00, 0x00, 0xB0, 0x00, 0x00, 0xD2, 0x00, 0x00, 0xD4, 0x02, 0x89, 0x1E, 0x09, 0x1F};

struct Line {
  std::deque<std::uint8_t> waiting;
  std::size_t read(std::span<std::uint8_t> in) {
    const std::size_t n = std::min(in.size(), waiting.size());
    std::copy_n(waiting.begin(), n, in.begin());
    waiting.erase(waiting.begin(), waiting.begin() + static_cast<std::ptrdiff_t>(n));
    return n;
  }
  static std::size_t write(std::span<const std::uint8_t>) { return 0; }
  static hal::SerialFaults faults() { return {}; }
};

std::vector<Packet> packets(const Bytes& bytes, Health& health) {
  Framer framer;
  std::vector<Packet> all;
  for (const std::uint8_t byte : bytes)
    if (const auto packet = framer.on_byte(byte, health)) all.push_back(*packet);
  return all;
}

/// Packets of a scanner that stands: 4 500 points a second, distance [m] by the bearing in the robot's axes [rad].
template <class Room>
std::vector<Bytes> spin(double turns_per_s, double seconds, Room&& room) {
  std::vector<Bytes> sent;
  const double step_deg = 360 * turns_per_s / 4500;
  for (int point = 0; point < static_cast<int>(4500 * seconds); point += 12) {
    Bytes b{0x54, 0x2C};
    const auto word = [&b](double value) {
      b.push_back(static_cast<std::uint8_t>(std::lround(value) & 0xFF));
      b.push_back(static_cast<std::uint8_t>(std::lround(value) >> 8));
    };
    const auto clockwise_deg = [&](int k) { return std::fmod(step_deg * (point + k) + 123.4, 360); };
    const auto angle = [&](int k) { return std::fmod(std::round(100 * clockwise_deg(k)), 36'000); };
    word(360 * turns_per_s);
    word(angle(0));
    for (int k = 0; k < 12; ++k) {
      word(1000 * room(-clockwise_deg(k) * pi / 180));
      b.push_back(200);
    }
    word(angle(11));
    word(std::fmod((point + 11) / 4.5, 30'000));
    b.push_back(crc8(b));
    sent.push_back(b);
  }
  return sent;
}

/// An L: 6 m by 4 m with the scanner 1 m from the left wall, and the corner ahead on the right filled. No mirror axis.
double ell(double bearing_rad) {
  const double c = std::cos(bearing_rad), s = std::sin(bearing_rad);
  double nearest = 99;
  const auto wall = [&](double x0, double y0, double x1, double y1) {  // ray against segment, by Cramer's rule
    const double ex = x1 - x0, ey = y1 - y0, det = ex * s - ey * c;
    if (std::abs(det) < 1e-12) return;
    const double range = (ex * y0 - ey * x0) / det, along = (c * y0 - s * x0) / det;
    if (range > 0 && along >= 0 && along <= 1) nearest = std::min(nearest, range);
  };
  wall(4, 1, -2, 1), wall(-2, 1, -2, -3), wall(-2, -3, 2, -3), wall(2, -3, 2, -1), wall(2, -1, 4, -1),
      wall(4, -1, 4, 1);
  return nearest;
}

struct Scan {
  sensor::Sample sample;
  std::vector<std::uint16_t> ranges;
  [[nodiscard]] double bearing(std::size_t beam) const {
    const auto& scan = sample.payload.scan;
    return static_cast<double>(scan.first_rad) + static_cast<double>(scan.step_rad) * static_cast<double>(beam);
  }
};

/// Bytes at the line's rate, as frames of the bus, through the node's assembly.
std::vector<Scan> scans(const std::vector<Bytes>& sent, base::Micros poll_every) {
  struct Node {
    bus::ScanAssembly assembly;
    std::vector<Scan> all;
    void sample(const sensor::Sample& s) {
      const auto ranges = assembly.pool().ranges(s.payload.scan);
      all.push_back({s, {ranges.begin(), ranges.end()}});
    }
  } node;
  Line line;
  firmware::WiredLidar<Line> lidar(line);
  bus::Counters counters;
  node.assembly.power_on();
  std::size_t next = 0, byte = 0;
  for (std::int64_t now = 0; next < sent.size(); now += poll_every.us) {
    // A packet goes out after its last point; a byte takes 43.4 us.
    while (next < sent.size()) {
      const double at = (12.0 * static_cast<double>(next) + 11) / 4500e-6 + 43.403 * static_cast<double>(byte + 1);
      if (at > static_cast<double>(now)) break;
      line.waiting.push_back(sent[next][byte++]);
      if (byte == sent[next].size()) ++next, byte = 0;
    }
    lidar.poll({now}, {}, [&](const auto& message) {
      const base::CanFrame frame = bus::frame(0x300, message);
      node.assembly.on_frame(static_cast<std::uint8_t>(frame.id - 0x300), frame, 0, {now}, counters, node);
    });
  }
  EXPECT_EQ(counters.incomplete + counters.out_of_range + counters.malformed, 0U);
  return node.all;
}

TEST(Ld19, reads_the_packet_of_the_manual_and_one_of_a_scanner) {
  // Entries of the manual's table of the CRC.
  for (const auto& [byte, crc] :
       {std::pair{1, 0x4D}, {2, 0x9A}, {16, 0xA9}, {32, 0x1F}, {64, 0x3E}, {128, 0x7C}, {192, 0x42}})
    EXPECT_EQ(crc8(std::array{static_cast<std::uint8_t>(byte)}), crc);
  Health health;
  Bytes both = kManual;
  both.insert(both.end(), kRecorded.begin(), kRecorded.end());
  const auto read = packets(both, health);
  ASSERT_EQ(read.size(), 2U);
  EXPECT_EQ(read[0].speed_degps, 2152);
  EXPECT_EQ(read[0].angle_cdeg(0), 32427);
  EXPECT_EQ(read[0].angle_cdeg(11), 33470);
  EXPECT_NEAR(read[0].angle_cdeg(5), 32427 + 1043 * 5 / 11.0, 0.6);
  EXPECT_EQ(read[0].distance_mm,
            (std::array<std::uint16_t, 12>{224, 220, 217, 213, 211, 208, 205, 202, 199, 197, 194, 192}));
  EXPECT_EQ(read[1].speed_degps, 2164);
  EXPECT_EQ(read[1].angle_cdeg(11), 35074);
  EXPECT_EQ(read[1].distance_mm, (std::array<std::uint16_t, 12>{}));
  EXPECT_EQ(health.noise + health.crc + health.out_of_range, 0U);
  Bytes wide = kManual;  // 40 degrees between the first point and the last one
  wide[42] = (32427 + 4000 - 36000) & 0xFF, wide[43] = (32427 + 4000 - 36000) >> 8;
  wide[46] = crc8(std::span(wide).first(46));
  EXPECT_TRUE(packets(wide, health).empty());
  EXPECT_EQ(health.out_of_range, 1U);
}

TEST(Ld19, damage_costs_the_packets_that_it_hit_and_no_other) {
  std::mt19937 random(1);
  const auto draw = [&](std::uint32_t below) { return static_cast<std::uint32_t>(random() % below); };
  const auto sent = spin(10, 0.1, ell);
  for (int trial = 0; trial < 3000; ++trial) {
    Bytes line;
    std::uint32_t hit = 0;
    for (const Bytes& whole : sent) {
      Bytes b = whole;
      const bool damaged = draw(4) == 0;
      hit += damaged ? 1 : 0;
      if (damaged && draw(2) == 0)
        b[draw(47)] ^= static_cast<std::uint8_t>(1 + draw(255));
      else if (damaged)
        b.erase(b.begin() + draw(47));
      // Noise between packets, headers among it.
      for (std::uint32_t n = draw(3) == 0 ? draw(60) : 0; n > 0; --n)
        line.push_back(draw(4) == 0 ? kHeader : draw(4) == 0 ? kForm : static_cast<std::uint8_t>(draw(256)));
      line.insert(line.end(), b.begin(), b.end());
    }
    line.insert(line.end(), kPacketBytes, 0);  // so that the last packet is judged whatever came before it
    Health health;
    const auto read = packets(line, health);
    // A sum of 8 bits lets one false packet in 256 pass, which may begin within the noise and swallow the next one.
    EXPECT_GE(read.size() + 2, sent.size() - hit) << trial;
    EXPECT_LE(health.packets, sent.size() - hit + 2) << trial;
    EXPECT_EQ(health.packets * kPacketBytes + health.noise, line.size()) << "every byte is used or counted";
  }
}

TEST(Ld19, any_bytes_are_read_without_harm) {
  std::mt19937 random(2);
  Line line;
  Driver<Line> driver(line);
  std::int64_t turns = 0;
  for (int k = 0; k < 20'000; ++k) {
    Bytes b = kManual;  // well-formed packets of any content, and bytes that are none
    for (std::size_t i = 2; i < 46; ++i) b[i] = static_cast<std::uint8_t>(random());
    b[46] = crc8(std::span(b).first(46));
    if (k % 3 == 0) b[random() % 47] = static_cast<std::uint8_t>(random());
    line.waiting.insert(line.waiting.end(), b.begin(), b.end());
    driver.poll({static_cast<std::int64_t>(random() % 100'000) + 3'000 * k}, [&](auto ranges, base::Micros) {
      ++turns;
      for (const std::uint16_t range : ranges) ASSERT_LE(range, 8'190);
    });
  }
  EXPECT_GT(driver.health().out_of_range, 1'000U);
  EXPECT_GT(driver.health().packets, 13'000U);
}

TEST(Ld19, an_asymmetric_room_comes_out_as_it_is_and_not_mirrored) {
  for (const double turns_per_s : {6.0, 10.0, 13.0}) {
    const auto all = scans(spin(turns_per_s, 1.5, ell), base::Micros{500});
    ASSERT_NEAR(static_cast<double>(all.size()), 1.5 * turns_per_s - 1.5, 1);
    int returns = 0, off = 0, mirrored_off = 0;
    for (std::size_t i = 0; i < 360; ++i) {
      const auto& scan = all.back();
      if (scan.ranges[i] == 0) continue;
      ++returns;
      // The nearest of the bin: between the ranges at its edges, with 0.1 deg of rounding.
      const auto within = [&](double bearing) {
        double least = 99, most = 0;
        for (int k = -7; k <= 7; ++k) {
          const double range = ell(bearing + k * 0.1 * pi / 180);
          least = std::min(least, range), most = std::max(most, range);
        }
        return 0.005 * scan.ranges[i] > least - 0.004 && 0.005 * scan.ranges[i] < most + 0.004;
      };
      off += within(scan.bearing(i)) ? 0 : 1;
      mirrored_off += within(-scan.bearing(i)) ? 0 : 1;
    }
    EXPECT_GE(returns, turns_per_s > 12 ? 340 : 360) << "at 13 turns a second 346 points reach 360 bins";
    EXPECT_EQ(off, 0);
    EXPECT_GT(mirrored_off, 200);
    // The first beam is at the front: 123.4 deg is the first point's angle.
    for (const Scan& scan : all) {
      const double turns = static_cast<double>(scan.sample.stamp.us) * 1e-6 * turns_per_s + 123.4 / 360;
      EXPECT_NEAR(std::remainder(turns, 1) / turns_per_s, 0, 0.7e-3);
    }
  }
}

TEST(Ld19, a_bin_holds_its_nearest_return_and_0_without_one) {
  Turn turn;
  for (const int mm : {0, 3'000, 1'502, 1'503, 0, 9'000}) turn.add(Turn::bin(12'349), mm);
  turn.add(Turn::bin(35'950), 40'950), turn.add(Turn::bin(100), 40'953);
  EXPECT_EQ(turn.ranges()[123], 300);
  EXPECT_EQ(turn.ranges()[0], 8'190) << "359.5 degrees is the front's";
  EXPECT_EQ(turn.ranges()[1], 0) << "beyond the bus's range";
}

TEST(Ld19, a_turn_in_which_the_line_was_quiet_is_given_up) {
  auto sent = spin(10, 1, ell);
  Line line;
  Driver<Line> driver(line);
  std::vector<base::Micros> stamps;
  for (std::size_t k = 0; k < sent.size(); ++k) {
    if (k >= 190 && k < 230) continue;  // 107 ms: more than a turn
    line.waiting.insert(line.waiting.end(), sent[k].begin(), sent[k].end());
    driver.poll({static_cast<std::int64_t>(2'667 * k)}, [&](auto, base::Micros first) { stamps.push_back(first); });
  }
  EXPECT_EQ(driver.health().turns_cut, 1U);
  EXPECT_EQ(stamps.size(), 7U) << "of ten: two are cut at the ends, and the gap takes one";
}

}  // namespace
}  // namespace tetap::drivers::ld19
