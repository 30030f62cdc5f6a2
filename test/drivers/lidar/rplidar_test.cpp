// SPDX-License-Identifier: Apache-2.0
// The scanner RPLIDAR A1: a fake of its protocol, written from Slamtec's notes apart from the driver, turns in a room.
// Lost bytes cost what they hit, and a scanner that fails or falls silent is begun again.
#include "drivers/lidar/rplidar/driver.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <functional>
#include <numbers>
#include <random>
#include <vector>

namespace tetap::drivers::rplidar {
namespace {

using Bytes = std::vector<std::uint8_t>;

/// Walls of a room without a mirror axis, by the clockwise angle [deg]; distance [m], 0: no return.
double wall(double clockwise_deg) {
  const double a = clockwise_deg * std::numbers::pi / 180, c = std::cos(a), s = -std::sin(a);
  double nearest = 99;
  const auto plane = [&](double nx, double ny, double d) {
    const double along = c * nx + s * ny;
    if (along > 1e-9) nearest = std::min(nearest, d / along);
  };
  plane(1, 0, 4), plane(-1, 0, 2), plane(0, 1, 1), plane(0, -1, 3);
  return clockwise_deg > 200 && clockwise_deg < 205 ? 0 : nearest;
}

/// The scanner at the other end of the line: 2 000 measurements a second, 5.5 turns a second, 86.8 us a byte.
struct Scanner {
  struct Timed {
    double at_us;
    std::uint8_t byte;
  };
  std::deque<Timed> line;
  std::deque<std::uint8_t> requests;
  std::vector<std::uint8_t> commands;
  double now_us = 0, busy_us = 0, next_us = 0, turns_per_s = 5.5, angle_deg = 321.7;
  std::uint8_t status = 0;
  bool scans = false, mute = false, fails_until_reset = false, spins = true;
  std::vector<double> fronts_us;
  std::function<bool(std::uint8_t&)> passes = [](std::uint8_t&) { return true; };  ///< the line: may lose or change

  void say(const Bytes& bytes) {
    for (std::uint8_t byte : bytes) {
      busy_us = std::max(busy_us, now_us) + 1e7 / 115'200;
      if (!mute && passes(byte)) line.push_back({busy_us, byte});
    }
  }
  void advance(double to_us) {
    while (scans && spins && next_us < to_us) {
      now_us = next_us;
      measure();
      next_us += 500;
    }
    now_us = to_us;
  }
  void measure() {
    const double before_deg = angle_deg;
    angle_deg = std::fmod(angle_deg + 360 * turns_per_s / 2000, 360);
    const bool start = angle_deg < before_deg;
    if (start) fronts_us.push_back(now_us);
    const auto angle = static_cast<unsigned>(std::lround(angle_deg * 64)) % 23'040U;
    const auto range = static_cast<unsigned>(std::lround(wall(angle_deg) * 4000));
    const unsigned quality = range == 0 ? 0 : 15;
    say({static_cast<std::uint8_t>(quality * 4 + (start ? 1 : 2)), static_cast<std::uint8_t>((angle % 128) * 2 + 1),
         static_cast<std::uint8_t>(angle / 128), static_cast<std::uint8_t>(range % 256),
         static_cast<std::uint8_t>(range / 256)});
  }

  std::size_t read(std::span<std::uint8_t> in) {
    std::size_t n = 0;
    for (; n < in.size() && !line.empty() && line.front().at_us <= now_us; line.pop_front())
      in[n++] = line.front().byte;
    return n;
  }
  std::size_t write(std::span<const std::uint8_t> out) {
    requests.insert(requests.end(), out.begin(), out.end());
    for (; requests.size() >= 2; requests.erase(requests.begin(), requests.begin() + 2)) {
      EXPECT_EQ(requests[0], 0xA5);
      command(requests[1]);
    }
    return out.size();
  }
  static hal::SerialFaults faults() { return {}; }

  void command(std::uint8_t code) {
    commands.push_back(code);
    const bool was_scanning = scans;
    scans = false;
    if (code == 0x40) {
      if (fails_until_reset) status = 0;
      say({'R', 'P', ' ', 'L', 'I', 'D', 'A', 'R', 0xA5, 0xA5, '\n'});
    } else if (code == 0x52) {
      EXPECT_FALSE(was_scanning) << "a request within a scan";
      say({0xA5, 0x5A, 3, 0, 0, 0, 6, status, 0x12, 0x34});
    } else if (code == 0x20 && status != 2) {
      say({0xA5, 0x5A, 5, 0, 0, 0x40, 0x81});
      scans = true;
      next_us = now_us + 1000;
    }
  }
};

struct Rig {
  struct Seen {
    std::vector<std::uint16_t> ranges;
    double first_us;
  };
  Scanner scanner;
  Driver<Scanner> driver{scanner};
  std::vector<Seen> turns;
  std::int64_t now_us = 0;

  void run(double seconds, std::int64_t every_us = 5'000) {
    for (const std::int64_t end = now_us + std::llround(seconds * 1e6); now_us < end;) {
      now_us += every_us;
      scanner.advance(static_cast<double>(now_us));
      driver.poll({now_us}, [this](std::span<const std::uint16_t, 360> ranges, base::Micros first) {
        turns.push_back({{ranges.begin(), ranges.end()}, static_cast<double>(first.us)});
      });
    }
  }
  /// Beams nearer or farther than any wall within the bin and its neighbours.
  [[nodiscard]] int wrong() const {
    int count = 0;
    for (const Seen& turn : turns) {
      for (int k = 0; k < 360; ++k) {
        if (turn.ranges[static_cast<std::size_t>(k)] == 0) continue;
        const double range_m = 0.005 * turn.ranges[static_cast<std::size_t>(k)];
        double least = 99, most = 0;
        for (double a = k - 0.51; a <= k + 0.51; a += 0.05) {
          const double at = wall(std::fmod(a + 360, 360));
          if (at > 0) least = std::min(least, at), most = std::max(most, at);
        }
        count += range_m < least - 0.004 || range_m > most + 0.004 ? 1 : 0;
      }
    }
    return count;
  }
  [[nodiscard]] double filled() const {
    double beams = 0;
    for (const Seen& turn : turns)
      beams += 360.0 - static_cast<double>(std::count(turn.ranges.begin(), turn.ranges.end(), 0));
    return turns.empty() ? 0 : beams / static_cast<double>(turns.size());
  }
};

TEST(RplidarNode, FieldsAreThoseOfTheNotes) {
  // Start bit and its inverse, check bit, angle in 1/64 deg, distance in quarters of a millimetre.
  const auto node = decode(Bytes{0x3E, 0x81 | 1, 0x2D, 0x10, 0x27});
  ASSERT_TRUE(node.has_value());
  EXPECT_FALSE(node->starts_turn);
  EXPECT_EQ(node->quality, 15);
  EXPECT_EQ(node->angle_cdeg(), 9'100);
  EXPECT_EQ(node->distance_mm, 2'500);
  EXPECT_TRUE(decode(Bytes{0x3D, 0x81, 0x2D, 0x10, 0x27})->starts_turn);
  EXPECT_FALSE(decode(Bytes{0x3F, 0x81, 0x2D, 0x10, 0x27})) << "start and its inverse are equal";
  EXPECT_FALSE(decode(Bytes{0x3C, 0x81, 0x2D, 0x10, 0x27}));
  EXPECT_FALSE(decode(Bytes{0x3E, 0x80, 0x2D, 0x10, 0x27})) << "the check bit is 0";
  EXPECT_FALSE(decode(Bytes{0x3E, 0x01, 0xB4, 0x10, 0x27})) << "360 deg";
  EXPECT_TRUE(decode(Bytes{0x3E, 0xFF, 0xB3, 0x10, 0x27})) << "the last angle before it";
  EXPECT_FALSE(decode(Bytes{0x3E, 0x81, 0x2D, 0x10})) << "a byte is missing";
}

TEST(RplidarDriver, HealthThenScanThenTurnsOfTheRoom) {
  Rig rig;
  rig.run(4);
  EXPECT_EQ(rig.scanner.commands, (Bytes{0x25, 0x52, 0x20}));
  EXPECT_EQ(rig.driver.health().status, Status::kGood);
  EXPECT_TRUE(rig.driver.scanning());
  ASSERT_GE(rig.turns.size(), 18U);
  EXPECT_LE(rig.turns.size(), 22U);
  EXPECT_EQ(rig.wrong(), 0);
  EXPECT_GT(rig.filled(), 350) << "all but the 5 deg without a return";
  EXPECT_LT(rig.filled(), 357);
  EXPECT_EQ(rig.driver.health().noise + rig.driver.health().turns_cut + rig.driver.health().restarts, 0U);
  for (const auto& turn : rig.turns) {
    double nearest_us = 1e9;
    for (const double front : rig.scanner.fronts_us) nearest_us = std::min(nearest_us, std::abs(front - turn.first_us));
    EXPECT_LT(nearest_us, 5'000 + 500) << "within a poll of the front's time";
  }
}

TEST(RplidarDriver, LostAndDamagedBytesCostWhatTheyHit) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    Rig rig;
    std::mt19937 random(seed);
    rig.run(1);
    int hits = 0;
    rig.scanner.passes = [&](std::uint8_t& byte) {
      const auto draw = random() % 2'000;
      hits += draw < 2 ? 1 : 0;
      if (draw == 1) byte = static_cast<std::uint8_t>(random());
      return draw != 0;
    };
    rig.run(10);
    rig.scanner.passes = [](std::uint8_t&) { return true; };
    ASSERT_GT(hits, 50);
    // A changed distance has no check, which is a hit of five; framing adds few to them.
    EXPECT_LE(rig.wrong(), 2 * hits / 5) << seed << ": of " << hits;
    EXPECT_GT(rig.filled(), 340) << seed;
    EXPECT_EQ(rig.driver.health().restarts, 0U) << seed;
    const std::uint32_t noise = rig.driver.health().noise;
    EXPECT_GT(noise, 0U);
    EXPECT_LT(noise, 15U * static_cast<std::uint32_t>(hits)) << seed;
    rig.turns.clear();
    rig.run(2);
    EXPECT_GE(rig.turns.size(), 9U);
    if (!rig.turns.empty()) rig.turns.erase(rig.turns.begin());  // it began amid the damage
    EXPECT_EQ(rig.wrong(), 0) << "nothing remains of it";
  }
}

/// 75 degrees, 38 ms, are lost around the front: the measurements on both sides date it.
TEST(RplidarDriver, AFrontThatIsLostIsDatedByItsNeighbours) {
  Rig rig;
  rig.run(1);
  rig.turns.clear();
  rig.scanner.passes = [&](std::uint8_t&) { return rig.scanner.angle_deg < 330 && rig.scanner.angle_deg > 45; };
  rig.run(3);
  ASSERT_GE(rig.turns.size(), 14U);
  EXPECT_EQ(rig.driver.health().turns_cut, 0U);
  for (const auto& turn : rig.turns) {
    double nearest_us = 1e9;
    for (const double front : rig.scanner.fronts_us) nearest_us = std::min(nearest_us, std::abs(front - turn.first_us));
    EXPECT_LT(nearest_us, 5'000 + 500) << "within a poll of the front's time";
  }
}

TEST(RplidarDriver, ProtectionStopIsResetAndSilenceBeginsAgain) {
  Rig stopped;
  stopped.scanner.status = 2;
  stopped.scanner.fails_until_reset = true;
  stopped.run(5);
  EXPECT_EQ(stopped.scanner.commands, (Bytes{0x25, 0x52, 0x40, 0x52, 0x20}));
  EXPECT_EQ(stopped.driver.health().errors, 1U);
  EXPECT_GT(stopped.turns.size(), 8U);
  Rig broken;
  broken.scanner.status = 2;
  broken.run(10);
  EXPECT_TRUE(broken.turns.empty());
  EXPECT_EQ(broken.driver.health().status, Status::kError);
  EXPECT_GE(broken.driver.health().errors, 4U);
  EXPECT_LE(broken.driver.health().errors, 6U) << "two seconds for a reset";
  Rig silent;
  silent.run(3);
  const auto before = silent.turns.size();
  silent.scanner.mute = true;
  silent.run(5);
  EXPECT_GE(silent.driver.health().restarts, 2U);
  EXPECT_EQ(silent.driver.health().turns_cut, 1U);
  silent.scanner.mute = false;
  silent.turns.clear();
  silent.run(3);
  EXPECT_GT(silent.turns.size(), 8U);
  EXPECT_EQ(silent.wrong(), 0);
  EXPECT_GT(before, 8U);
}

TEST(RplidarDriver, AMotorThatSpinsUpIsAwaited) {
  Rig rig;
  rig.scanner.spins = false;
  rig.run(4);
  rig.scanner.spins = true;
  rig.scanner.next_us = rig.scanner.now_us;
  rig.run(2);
  EXPECT_EQ(rig.driver.health().restarts, 0U);
  EXPECT_GT(rig.turns.size(), 8U);
}

TEST(RplidarFramer, NoAlignmentOfAConstantWallIsTakenForAnother) {
  // Equal distances make other alignments fit for a while: each distance and each offset into the stream is tried.
  for (unsigned quarters = 0; quarters < 65'536; quarters += 257) {
    Bytes stream;
    for (unsigned k = 0; k < 360; ++k) {
      const unsigned angle = (k * 63) % 23'040;
      for (const unsigned byte :
           {k == 0 ? 0x3DU : 0x3EU, angle % 128 * 2 + 1, angle / 128, quarters % 256, quarters / 256})
        stream.push_back(static_cast<std::uint8_t>(byte));
    }
    for (std::size_t offset = 1; offset < 5; ++offset) {
      Framer framer;
      std::uint32_t noise = 0;
      int good = 0, bad = 0;
      for (std::size_t i = offset; i < stream.size(); ++i) {
        const auto node = framer.on_byte(stream[i], noise);
        if (!node) continue;
        const bool right = node->distance_mm == static_cast<int>((quarters + 2) / 4);
        (right && node->angle_q6 % 63 == 0 ? good : bad) += 1;
      }
      EXPECT_EQ(bad, 0) << quarters << ' ' << offset;
      EXPECT_GT(good, 340) << quarters << ' ' << offset;
    }
  }
}

TEST(RplidarDriver, BytesAtRandomMakeNoTurns) {
  Rig rig;
  rig.run(1);
  std::mt19937 random(7);
  rig.scanner.spins = false;
  rig.run(0.1);
  rig.turns.clear();
  Framer framer;
  std::uint32_t noise = 0, nodes = 0;
  for (int i = 0; i < 2'000'000; ++i) nodes += framer.on_byte(static_cast<std::uint8_t>(random()), noise) ? 1 : 0;
  EXPECT_LE(nodes, 4U);
  EXPECT_GE(noise, 2'000'000U - 60U);
  for (int i = 0; i < 20'000; ++i)
    rig.scanner.line.push_back({rig.scanner.now_us, static_cast<std::uint8_t>(random())});
  rig.run(0.5);
  EXPECT_TRUE(rig.turns.empty());
}

}  // namespace
}  // namespace tetap::drivers::rplidar
