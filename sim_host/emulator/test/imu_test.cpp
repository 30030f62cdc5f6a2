// SPDX-License-Identifier: Apache-2.0
// SPI and the ICM-42688-P behind it, by registers. RM0402 chapter SPI; data sheet DS-000347: scales of its tables 1 and
// 2, packets of section 6, timestamps of section 12.7.
#include "sim_host/emulator/test/driven_chip.hpp"

#include <cmath>
#include <vector>

namespace tetap::board {
namespace {

constexpr std::uint32_t kSpi = reg::spi::kSpi1;
constexpr double kDegree = 3.14159265358979323846 / 180;

class Imu : public DrivenChip {
 public:
  explicit Imu(const BoardOptions& options = {}, std::uint32_t mode = 3) : DrivenChip(options, make_world()) {
    start_clocks();
    imu.world = [this](Picoseconds) { return truth; };
    for (const int pin : {5, 6, 7}) alternate({'A', pin}, 5);
    level({'A', 4}, true);
    this->mode({'A', 4}, 1);
    put(kSpi, reg::spi::cr1::kOffset,
        reg::spi::cr1::kMstr(1) | reg::spi::cr1::kSsm(1) | reg::spi::cr1::kSsi(1) | reg::spi::cr1::kBr(3) |
            reg::spi::cr1::kCpol(mode >> 1) | reg::spi::cr1::kCpha(mode & 1) | reg::spi::cr1::kSpe(1));
  }
  static SensorWorld make_world() { return {}; }
  std::uint8_t exchange(std::uint8_t out) {
    put(kSpi, reg::spi::dr::kOffset, out);
    for (int i = 0; i < 100 && (get(kSpi, reg::spi::sr::kOffset) & reg::spi::sr::kRxne.mask()) == 0; ++i) {
      chip.scheduler.advance(chip.scheduler.now() + 100'000);
    }
    const auto in = static_cast<std::uint8_t>(get(kSpi, reg::spi::dr::kOffset));
    return in;
  }
  std::vector<std::uint8_t> transfer(std::uint8_t address, std::vector<std::uint8_t> out, bool reading) {
    level({'A', 4}, false);
    exchange(reading ? address | 0x80 : address);
    for (auto& byte : out) byte = exchange(byte);
    level({'A', 4}, true);
    return out;
  }
  std::uint8_t read(std::uint8_t address) { return transfer(address, {0}, true)[0]; }
  std::vector<std::uint8_t> read(std::uint8_t address, std::size_t size) {
    return transfer(address, std::vector<std::uint8_t>(size), true);
  }
  void write(std::uint8_t address, std::uint8_t value) { transfer(address, {value}, false); }
  /// 1 kHz, 2000 deg/s, 16 g, FIFO with packet 3, timestamps; AFSR off.
  void start() {
    chip.advance_us(1'000);
    write(0x4D, 0x51);
    write(0x64, 0x00);
    write(0x54, 0x23);
    write(0x5F, 0x0F & ~0x08);
    write(0x16, 0x40);
    write(0x4E, 0x0F);
    chip.advance_us(40'000);
    write(0x4B, 0x02);
  }
  [[nodiscard]] static std::int16_t pair(const std::vector<std::uint8_t>& bytes, std::size_t at) {
    return static_cast<std::int16_t>(bytes[at] << 8 | bytes[at + 1]);
  }
  ImuTruth truth{.rate_radps = {0.1, -0.2, 0.3}, .force_mps2 = {1, -2, 9.80665}, .temperature_c = 35};
};

TEST(Icm42688, AnswersItsIdentityInBothOfItsModes) {
  for (const std::uint32_t mode : {0U, 3U}) {
    Imu board({}, mode);
    board.chip.advance_us(2'000);
    EXPECT_EQ(board.read(0x75), 0x47);
    EXPECT_NO_COMPLAINTS(board);
  }
  Imu wrong({}, 1);
  (void)wrong.read(0x75);
  EXPECT_TRUE(wrong.complained("SPI1", "clock mode 1"));
}

TEST(Icm42688, RegistersAreInUnitsOfTheRange) {
  Imu board;
  board.start();
  board.chip.advance_us(20'000);
  const auto bytes = board.read(0x1D, 14);
  EXPECT_NEAR(Imu::pair(bytes, 0) / 132.48 + 25, 35, 0.01);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(Imu::pair(bytes, 2 + 2 * i) / 2048.0 * 9.80665, board.truth.force_mps2[i], 9.80665 / 2048);
    EXPECT_NEAR(Imu::pair(bytes, 8 + 2 * i) / 16.4 * kDegree, board.truth.rate_radps[i], 0.002);
  }
  EXPECT_NO_COMPLAINTS(board);
}

TEST(Icm42688, PacketsCarryHeaderDataAndTimestamps) {
  Imu board;
  board.start();
  board.chip.advance_us(10'500);
  const auto count = board.read(0x2E, 2);
  EXPECT_EQ(Imu::pair(count, 0), 160);
  const auto bytes = board.read(0x30, 160);
  for (std::size_t at = 0; at < 160; at += 16) {
    if (at > 0) {
      EXPECT_EQ(bytes[at] & 0xFC, 0x68) << at;
    }
    EXPECT_NEAR(Imu::pair(bytes, at + 5) / 2048.0, 1.0, 0.01) << at;
    EXPECT_NEAR(static_cast<std::int8_t>(bytes[at + 13]) / 2.07 + 25, 35, 0.3) << at;
    if (at > 0) {
      const int step = (Imu::pair(bytes, at + 14) - Imu::pair(bytes, at - 2)) & 0xFFFF;
      EXPECT_TRUE(step == 937 || step == 938) << step;
    }
  }
  EXPECT_EQ(board.read(0x30), 0xFF) << "an empty FIFO reads as a header with its message bit";
  EXPECT_NO_COMPLAINTS(board);
}

// 20-bit packets: 131 steps of 19 bits a degree per second, 8192 steps of 18 bits a g, whatever the ranges.
TEST(Icm42688, WidePacketsHaveOneScale) {
  for (const int range : {0, 1, 2}) {
    Imu board;
    board.chip.advance_us(1'000);
    board.write(0x4D, 0x51);
    board.write(0x4F, static_cast<std::uint8_t>(range << 5 | 6));
    board.write(0x50, static_cast<std::uint8_t>(range << 5 | 6));
    board.write(0x5F, 0x17);
    board.write(0x16, 0x40);
    board.write(0x4E, 0x0F);
    board.chip.advance_us(60'500);
    board.write(0x4B, 0x02);
    board.chip.advance_us(3'000);
    EXPECT_EQ(Imu::pair(board.read(0x2E, 2), 0), 60);
    const auto bytes = board.read(0x30, 20);
    EXPECT_EQ(bytes[0] & 0xFC, 0x78);
    for (std::size_t i = 0; i < 3; ++i) {
      const int accel = Imu::pair(bytes, 1 + 2 * i) * 16 + (bytes[17 + i] >> 4);
      const int gyro = Imu::pair(bytes, 7 + 2 * i) * 16 + (bytes[17 + i] & 0xF);
      EXPECT_NEAR(accel / 4.0 / 8192 * 9.80665, board.truth.force_mps2[i], 0.0025) << range;
      EXPECT_NEAR(gyro / 2.0 / 131.072 * kDegree, board.truth.rate_radps[i], 0.00027) << range;
    }
    EXPECT_NEAR(Imu::pair(bytes, 13) / 132.48 + 25, 35, 0.01);
  }
}

TEST(Icm42688, TimeRunsWithTheChipsOwnClock) {
  Imu board({.imu = {.clock_error = 0.01}});
  board.start();
  board.chip.advance_us(100'000);
  const auto count = board.read(0x2E, 2);
  EXPECT_NEAR(Imu::pair(count, 0) / 16, 101, 1);
}

TEST(Icm42688, FullFifoDropsTheOldestAndCountsThem) {
  Imu board;
  board.start();
  board.chip.advance_us(300'500);
  EXPECT_EQ(Imu::pair(board.read(0x2E, 2), 0), 2048);
  const auto lost = board.read(0x6C, 2);
  EXPECT_NEAR(lost[0] | lost[1] << 8, 300 - 128, 1);
}

TEST(Icm42688, PartOfAPacketIsReadAgain) {
  Imu board;
  board.start();
  board.chip.advance_us(5'500);
  (void)board.read(0x30, 16);
  (void)board.read(0x30, 7);
  EXPECT_TRUE(board.complained("ICM-42688-P", "read in part"));
  EXPECT_EQ(board.read(0x30, 16)[0], 0x68);
}

TEST(Icm42688, InvalidUntilTheGyroscopeHasStarted) {
  Imu board;
  board.chip.advance_us(1'000);
  board.write(0x4E, 0x0F);
  board.chip.advance_us(10'000);
  EXPECT_EQ(Imu::pair(board.read(0x25, 2), 0), -32768);
  board.chip.advance_us(25'000);
  EXPECT_NE(Imu::pair(board.read(0x25, 2), 0), -32768);
}

TEST(Icm42688, AdaptiveRangeFreezesTheGyroscopeUnlessItIsOff) {
  for (const bool off : {true, false}) {
    Imu board;
    board.start();
    if (!off) {
      board.write(0x4E, 0);
      board.write(0x4D, 0x91);
      board.write(0x4E, 0x0F);
      board.chip.advance_us(40'000);
    }
    board.write(0x4B, 0x02);
    double rate = 95;
    int repeats = 0;
    std::int16_t last = 0;
    for (int i = 0; i < 20; ++i, rate += 1) {
      board.truth.rate_radps[2] = rate * kDegree;
      board.chip.advance_us(1'000);
      const std::int16_t now = Imu::pair(board.read(0x29, 2), 0);
      repeats += now == last ? 1 : 0;
      last = now;
    }
    if (off) {
      EXPECT_EQ(repeats, 0);
    } else {
      EXPECT_GE(repeats, 1);
      EXPECT_LE(repeats, 2);
    }
  }
}

TEST(Icm42688, ResetTakesAMillisecondAndRestoresEverything) {
  Imu board;
  board.start();
  board.write(0x11, 0x01);
  EXPECT_FALSE(board.complained("ICM-42688-P", "within 1 ms"));
  board.chip.advance_us(1'100);
  EXPECT_EQ(board.read(0x4D), 0x91);
  EXPECT_EQ(board.read(0x2D) & 0x10, 0x10) << "reset done";
  EXPECT_EQ(board.read(0x2D) & 0x10, 0) << "read to clear";
  EXPECT_NO_COMPLAINTS(board);
  board.write(0x11, 0x01);
  (void)board.read(0x75);
  EXPECT_TRUE(board.complained("ICM-42688-P", "within 1 ms"));
}

TEST(Icm42688, ConfigurationWhileItRunsIsNoticed) {
  Imu board;
  board.start();
  board.write(0x52, 0x44);
  EXPECT_TRUE(board.complained("ICM-42688-P", "0x52 of bank 0 written while sensors run"));
  Imu quick;
  quick.chip.advance_us(1'000);
  quick.write(0x4E, 0x0F);
  quick.write(0x4F, 0x06);
  EXPECT_TRUE(quick.complained("ICM-42688-P", "within 200 us"));
}

TEST(Icm42688, BanksAreSeparate) {
  Imu board;
  board.chip.advance_us(1'000);
  board.write(0x76, 1);
  EXPECT_EQ(board.read(0x0B), 0xA0);
  board.write(0x76, 2);
  EXPECT_EQ(board.read(0x03), 0x30);
  EXPECT_EQ(board.read(0x76), 2);
  board.write(0x76, 0);
  EXPECT_EQ(board.read(0x75), 0x47);
}

TEST(Icm42688, DataReadyReachesThePin) {
  Imu board;
  board.chip.advance_us(1'000);
  int edges = 0;
  board.chip.pins.watch({'B', 2}, [&](bool level) { edges += level ? 1 : 0; });
  board.write(0x64, 0x00);
  board.write(0x14, 0x03);  // push-pull, active high, pulses
  board.write(0x65, 0x08);
  board.write(0x4E, 0x0F);
  board.chip.advance_us(10'050);
  EXPECT_EQ(edges, 10);
  EXPECT_NO_COMPLAINTS(board);
}

TEST(Icm42688, NoiseHasTheDensityOfTheDataSheet) {
  Imu board({.imu = {.noise = true}});
  board.truth = {};
  board.start();
  double sum = 0, squares = 0;
  constexpr int kCount = 2000;
  for (int i = 0; i < kCount; ++i) {
    board.chip.advance_us(1'000);
    const double rate = Imu::pair(board.read(0x25, 2), 0) / 16.4;
    sum += rate;
    squares += rate * rate;
  }
  const double deviation = std::sqrt(squares / kCount);
  EXPECT_LT(std::fabs(sum / kCount), 0.02);
  EXPECT_GT(deviation, 0.02);  // 2.8 mdps in 100 Hz: 0.028, and rounding of 0.061
  EXPECT_LT(deviation, 0.08);
}

TEST(Spi, StuckLinesAndAbsentChips) {
  Imu stuck;
  stuck.chip.advance_us(2'000);
  stuck.chip.spi1.stuck_miso = false;
  EXPECT_EQ(stuck.read(0x75), 0x00);
  stuck.chip.spi1.stuck_miso = true;
  EXPECT_EQ(stuck.read(0x75), 0xFF);
  Imu absent({.imu_present = false});
  EXPECT_EQ(absent.read(0x75), 0xFF);
  Imu other({.imu = {.who_am_i = 0x44}});
  other.chip.advance_us(2'000);
  EXPECT_EQ(other.read(0x75), 0x44);
}

TEST(Spi, OverrunLosesTheNewByteUntilBothRegistersWereRead) {
  Imu board;
  board.put(kSpi, reg::spi::dr::kOffset, 1);
  board.chip.advance_us(5);
  board.put(kSpi, reg::spi::dr::kOffset, 2);
  board.chip.advance_us(5);
  EXPECT_NE(board.get(kSpi, reg::spi::sr::kOffset) & reg::spi::sr::kOvr.mask(), 0U);
  (void)board.get(kSpi, reg::spi::dr::kOffset);
  (void)board.get(kSpi, reg::spi::sr::kOffset);
  EXPECT_EQ(board.get(kSpi, reg::spi::sr::kOffset) & reg::spi::sr::kOvr.mask(), 0U);
}

TEST(Spi, EveryMistakeIsNoticed) {
  Imu early;
  for (int i = 0; i < 3; ++i) early.put(kSpi, reg::spi::dr::kOffset, 1);
  EXPECT_TRUE(early.complained("SPI1", "before TXE"));
  Imu released;
  released.level({'A', 4}, false);
  released.put(kSpi, reg::spi::dr::kOffset, 1);
  released.level({'A', 4}, true);
  EXPECT_TRUE(released.complained("SPI1", "select line changed while BSY"));
  Imu pin;
  pin.alternate({'A', 6}, 2);
  pin.chip.advance_us(2'000);
  EXPECT_EQ(pin.read(0x75), 0x00);
  EXPECT_TRUE(pin.complained("SPI1", "PA6 is alternate function 2"));
  Imu off;
  off.put(kSpi, reg::spi::cr1::kOffset, 0);
  off.put(kSpi, reg::spi::dr::kOffset, 1);
  EXPECT_TRUE(off.complained("SPI1", "SPE = 0"));
  Imu fault;
  fault.put(kSpi, reg::spi::cr1::kOffset, 0);
  fault.put(kSpi, reg::spi::cr1::kOffset, reg::spi::cr1::kMstr(1) | reg::spi::cr1::kSsm(1) | reg::spi::cr1::kSpe(1));
  EXPECT_TRUE(fault.complained("SPI1", "mode fault"));
  Imu fast;
  fast.put(kSpi, reg::spi::cr1::kOffset, 0);
  fast.put(kSpi, reg::spi::cr1::kOffset,
           reg::spi::cr1::kMstr(1) | reg::spi::cr1::kSsm(1) | reg::spi::cr1::kSsi(1) | reg::spi::cr1::kCpol(1) |
               reg::spi::cr1::kCpha(1) | reg::spi::cr1::kSpe(1));
  (void)fast.read(0x75);
  EXPECT_TRUE(fast.complained("SPI1", "too fast for the chip"));
}

TEST(Spi, DmaMovesAWholeTransfer) {
  Imu board;
  board.chip.advance_us(2'000);
  constexpr std::uint32_t kOut = 0x2000'2000, kIn = 0x2000'2100;
  (void)board.chip.memory.write_word(kOut, 0x0000'00F5);  // read 0x75
  const auto stream = [&](std::uint32_t number, std::uint32_t address, std::uint32_t dir) {
    const std::uint32_t at = number * reg::dma::sxcr::kStride;
    board.put(reg::dma::kDma2, reg::dma::sxpar::kOffset + at, kSpi + reg::spi::dr::kOffset);
    board.put(reg::dma::kDma2, reg::dma::sxm0ar::kOffset + at, address);
    board.put(reg::dma::kDma2, reg::dma::sxndtr::kOffset + at, 2);
    board.put(
        reg::dma::kDma2, reg::dma::sxcr::kOffset + at,
        reg::dma::sxcr::kChsel(3) | reg::dma::sxcr::kMinc(1) | reg::dma::sxcr::kDir(dir) | reg::dma::sxcr::kEn(1));
  };
  board.level({'A', 4}, false);
  board.set(kSpi, reg::spi::cr2::kOffset, reg::spi::cr2::kRxdmaen.mask());
  stream(2, kIn, 0);
  stream(5, kOut, 1);
  board.set(kSpi, reg::spi::cr2::kOffset, reg::spi::cr2::kTxdmaen.mask());
  board.chip.advance_us(20);
  board.level({'A', 4}, true);
  EXPECT_EQ(std::to_integer<int>(board.chip.memory.ram()[kIn - Memory::kRam + 1]), 0x47);
  EXPECT_NE(board.get(reg::dma::kDma2, reg::dma::lisr::kOffset) & reg::dma::lisr::kTcif2.mask(), 0U);
  EXPECT_NO_COMPLAINTS(board);
}

}  // namespace
}  // namespace tetap::board
