// SPDX-License-Identifier: Apache-2.0
// The fake ICM-42688-P held to the data sheet (TDK DS-000347 revision 1.8): what must be true of the chip whatever the
// driver, law by law. Numbers in the comments are its sections.
#include "hal/spi_device.hpp"
#include "support/fakes/icm42688_host.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace tetap::fakes {
namespace {

using namespace icm42688;

static_assert(hal::SpiDevice<Icm42688>);

constexpr double g = kStandardGravity_mps2;

// --- Registers

TEST(Icm42688Registers, EveryRegisterReadsItsResetValueInItsBank) {
  PlainHost host;
  for (const Register& r : kRegisters) {
    if (r.address == kRegBankSel) continue;
    host.bank(r.bank);
    const int read = host.read(r.address);
    EXPECT_EQ(read, r.reset) << "bank " << int{r.bank} << " register " << int{r.address} << ", " << r.section;
  }
  EXPECT_EQ(host.chip.broken_rules(), 0) << host.chip.broken_rules_in_words();
}

TEST(Icm42688Registers, EverySettableBitReadsBackAndDisturbsNoOtherRegister) {
  for (const Register& r : kRegisters) {
    const bool acts = r.bank == 0 && (r.address == kDeviceConfig || r.address == kRegBankSel);
    if (r.access != Access::kReadWrite || acts) continue;
    for (int bit = 0; bit < 8; ++bit) {
      if ((r.settable >> bit & 1) == 0) continue;
      if (r.bank == 1 && r.address == kIntfConfig4 && bit == 1) continue;  // 3-wire mode: nothing to be read any more
      if (r.bank == 0 && r.address == kIntfConfig0 && bit == 1) continue;  // "Disable SPI"
      PlainHost host;
      const auto value = static_cast<std::uint8_t>(r.reset ^ 1 << bit);
      host.bank(r.bank);
      host.write(r.address, value);
      EXPECT_EQ(host.read(r.address), value) << int{r.bank} << " " << int{r.address} << " bit " << bit;
      for (const Register& other : kRegisters) {
        if (&other == &r || other.address == kRegBankSel) continue;
        EXPECT_EQ(host.chip.peek(other.bank, other.address), other.reset);
      }
    }
  }
}

TEST(Icm42688Registers, TheBankSelectsAndIsReachableFromEveryBank) {
  PlainHost host;
  for (const std::uint8_t bank : bytes_of(1, 2, 3, 4, 0)) {
    host.bank(bank);
    EXPECT_EQ(host.read(kRegBankSel), bank);
    EXPECT_EQ(host.read(kWhoAmI) == kIdentity, bank == 0);
  }
}

TEST(Icm42688Registers, ABurstReadIsTheSameBytesAsSingleReads) {
  PlainHost host;
  for (std::uint8_t first = 0; first < 128; ++first) {
    const auto burst = host.read(first, 16);
    for (std::uint8_t i = 0; i < 16 && first + i < 128; ++i) {
      if (first <= kFifoData && first + i >= kIntStatus) break;
      if (first + i == kIntStatus) continue;
      EXPECT_EQ(burst[i], host.read(static_cast<std::uint8_t>(first + i)));
    }
  }
}

TEST(Icm42688Registers, ASoftResetRestoresEverythingAndIsDeafForAMillisecond) {
  PlainHost host;
  host.start();
  host.write(kDeviceConfig, 0x01);
  host.wait_us(999);
  EXPECT_EQ(host.read(kWhoAmI), 0xFF);
  EXPECT_EQ(host.chip.broken(Rule::kNoAccessDuringReset), 1);
  host.wait_us(1);
  EXPECT_EQ(host.read(kIntStatus), kResetDone);
  EXPECT_EQ(host.read(kIntStatus), 0);
  for (const Register& r : kRegisters) {
    if (r.address == kIntStatus) continue;
    EXPECT_EQ(host.chip.peek(r.bank, r.address), r.reset);
  }
  host.wait_us(100'000);
  EXPECT_EQ(host.count(), 0);
}

TEST(Icm42688Registers, AWriteWithin200MicrosecondsOfSwitchingASensorOnIsLost) {
  for (const int after_us : {0, 199, 200}) {
    PlainHost host;
    host.write(kPwrMgmt0, 0x0F);
    host.wait_us(after_us);
    host.write(kGyroConfig0, 0x26);
    EXPECT_EQ(host.read(kGyroConfig0), after_us < 200 ? 0x06 : 0x26);
    EXPECT_EQ(host.chip.broken(Rule::kNoWriteInQuietTime), after_us < 200 ? 1 : 0);
  }
}

// --- Samples

TEST(Icm42688Samples, EveryFullScaleMapsItsRangeOntoSixteenBitsAndSaturatesBeyond) {
  for (int fs = 0; fs < 8; ++fs) {
    const double dps = 2000.0 / (1 << fs);
    for (const double share : {-1.2, -1.0, -0.99, -0.5, -0.01, 0.0, 1e-4, 0.3, 0.999, 1.0, 1.5}) {
      PlainHost host;
      const double accel_g = 16.0 / (1 << (fs % 4));
      host.write(kGyroConfig0, static_cast<std::uint8_t>(fs << 5 | 0x06));
      host.write(kAccelConfig0, static_cast<std::uint8_t>(fs % 4 << 5 | 0x06));
      host.chip.set_motion({.rate_radps = {share * dps * kDegree, 0.0, -share * dps * kDegree},
                            .specific_force_mps2 = {0.0, share * accel_g * g, 0.0}});
      host.write(kPwrMgmt0, 0x0F);
      host.wait_us(50'000);
      const double expected = std::clamp(share * 32768.0, -32766.0, 32767.0);
      EXPECT_NEAR(host.word(kGyroDataX1), expected, 0.5);
      EXPECT_NEAR(host.word(kGyroDataX1 + 4), std::clamp(-share * 32768.0, -32766.0, 32767.0), 0.5);
      EXPECT_NEAR(host.word(kAccelDataX1 + 2), expected, 0.5);
      EXPECT_EQ(host.word(kAccelDataX1), 0);
      // The sheet's own scale factors (3.1, 3.2), which are these rounded.
      if (std::abs(share) < 0.9) {
        EXPECT_NEAR(host.word(kGyroDataX1), share * dps * 16.4 * (1 << fs), 1.0 + 35.0 * std::abs(share));
      }
    }
  }
}

TEST(Icm42688Samples, BeforeItsFirstSampleASensorReadsMinus32768OrZeroWhenTheLastIsHeld) {
  PlainHost host;
  for (const std::uint8_t address : {kTempData1, kAccelDataX1, kGyroDataX1}) EXPECT_EQ(host.word(address), -32768);
  host.write(kIntfConfig0, 0xB0);
  for (const std::uint8_t address : {kTempData1, kAccelDataX1, kGyroDataX1}) EXPECT_EQ(host.word(address), 0);
}

TEST(Icm42688Samples, TheAccelerometerStartsAfter10MillisecondsAndTheGyroscopeAfter30) {
  PlainHost host;
  host.write(kPwrMgmt0, 0x0F);
  host.wait_us(9'999);
  EXPECT_EQ(host.chip.counters().accel_samples, 0);
  host.wait_us(1);
  EXPECT_EQ(host.chip.counters().accel_samples, 1);
  EXPECT_EQ(host.word(kAccelDataX1 + 4), 2048);
  host.wait_us(19'999);
  EXPECT_EQ(host.chip.counters().gyro_samples, 0);
  EXPECT_EQ(host.word(kGyroDataX1), -32768);
  host.wait_us(1);
  EXPECT_EQ(host.chip.counters().gyro_samples, 1);
  EXPECT_EQ(host.word(kGyroDataX1), 0);
}

TEST(Icm42688Samples, EveryOutputDataRateMakesThatManySamplesASecondWhateverTheClockError) {
  constexpr std::array<double, 16> kRates_Hz = {0,   32000, 16000, 8000, 4000, 2000, 1000, 200,
                                                100, 50,    25,    12.5, 0,    0,    0,    500};
  for (std::uint8_t odr = 1; odr < 16; ++odr) {
    for (const int ppm : {-30'000, 0, 15'000}) {
      if (kRates_Hz[odr] < 1.0) continue;
      PlainHost host;
      host.chip.set_clock_error(ppm);
      host.write(kGyroConfig0, odr);
      host.write(kAccelConfig0, odr);
      host.write(kPwrMgmt0, 0x0F);
      host.wait_us(200'000);
      const int before = host.chip.counters().gyro_samples;
      host.wait_us(2'000'000);
      EXPECT_NEAR(host.chip.counters().gyro_samples - before, 2.0 * kRates_Hz[odr] * (1.0 + ppm * 1e-6), 1.0);
    }
  }
}

TEST(Icm42688Samples, TemperatureKeepsBothItsScales) {
  for (const double degC : {-40.0, -10.3, 0.0, 24.9, 25.0, 25.1, 60.0, 85.0}) {
    PlainHost host;
    host.chip.set_motion({.temperature_degC = degC});
    host.start_clean();
    host.wait_us(1'000);
    EXPECT_NEAR(host.word(kTempData1) / 132.48 + 25.0, degC, 0.5 / 132.48 + 1e-9);
    const double from_fifo = packet_3(host.read(kFifoData, 16)).temperature / 2.07 + 25.0;
    EXPECT_NEAR(from_fifo, std::max(degC, 25.0 - 127 / 2.07), 0.5 / 2.07 + 1e-9);
  }
}

TEST(Icm42688Samples, UserOffsetsAreAddedAxisByAxis) {
  PlainHost host;
  host.bank(4);
  const std::array<std::uint8_t, 9> bytes = {0x20, 0xEF, 0xE0, 0x40, 0x10, 0xD0, 0x30, 0xDE, 0x38};
  for (std::uint8_t i = 0; i < 9; ++i) host.write(static_cast<std::uint8_t>(kOffsetUser0 + i), bytes[i]);
  host.bank(0);
  host.write(kPwrMgmt0, 0x0F);
  host.wait_us(50'000);
  EXPECT_NEAR(host.word(kGyroDataX1), (0xF20 - 4096) / 32.0 * 16.384, 0.51);  // -7 dps
  EXPECT_NEAR(host.word(kGyroDataX1 + 2), (0xEE0 - 4096) / 32.0 * 16.384, 0.51);
  EXPECT_NEAR(host.word(kGyroDataX1 + 4), 2.0 * 16.384, 0.51);
  EXPECT_NEAR(host.word(kAccelDataX1), 0.0005 * 0x1D0 * 2048, 0.51);
  EXPECT_NEAR(host.word(kAccelDataX1 + 2), 0.0005 * (0xE30 - 4096) * 2048, 0.51);
  EXPECT_NEAR(host.word(kAccelDataX1 + 4), (1.0 + 0.0005 * (0xD38 - 4096)) * 2048, 0.51);
}

TEST(Icm42688Samples, TheUserFilterDelaysAsItsTableSays) {
  // A ramp through a filter is the ramp, late by the group delay at 0 Hz.
  struct Case {
    std::uint8_t odr, bandwidths, config1;
    double delay_s;
  };
  for (const Case& c :
       {Case{0x06, 0x11, 0x16, 2.1e-3}, Case{0x06, 0x77, 0x1A, 14.1e-3}, Case{0x07, 0x11, 0x16, 5.1e-3},
        Case{0x06, 0xFF, 0x16, 0.2e-3}, Case{0x0F, 0x00, 0x12, 1.1e-3}, Case{0x05, 0x11, 0x16, 0.8e-3}}) {
    PlainHost host;
    host.chip.set_filters(true);
    host.chip.set_motion([](double s) { return Motion{.rate_radps = {30.0 * s, 0.0, 0.0}}; });
    host.write(kGyroConfig0, c.odr);
    host.write(kGyroConfig1, c.config1);
    host.write(kGyroAccelConfig0, c.bandwidths);
    host.write(kPwrMgmt0, 0x0F);
    host.wait_us(1'000'000);
    const double felt_s = host.word(kGyroDataX1) / 32768.0 * 2000.0 * kDegree / 30.0;
    EXPECT_NEAR(host.chip.last_sample_s() - felt_s, c.delay_s, 0.05 * c.delay_s + 0.1e-3);
  }
}

// --- FIFO

TEST(Icm42688Fifo, NothingEntersInBypassOrWithoutContent) {
  for (const auto& [mode, content] : {std::pair{0x00, 0x47}, std::pair{0x40, 0x44}}) {
    PlainHost host;
    host.start(static_cast<std::uint8_t>(content), 0x06, 0x73, static_cast<std::uint8_t>(mode));
    EXPECT_EQ(host.count(), 0);
    EXPECT_EQ(host.read(kFifoData, 4), (std::vector<std::uint8_t>{0xFF, 0xFF, 0xFF, 0xFF}));
  }
}

TEST(Icm42688Fifo, EachContentHasItsPacketSizeAndHeader) {
  struct Case {
    std::uint8_t content;
    int size, header;
  };
  for (const Case& c :
       {Case{0x41, 8, 0x40}, Case{0x42, 8, 0x20}, Case{0x43, 16, 0x68}, Case{0x53, 20, 0x78}, Case{0x50, 20, 0x78}}) {
    PlainHost host;
    host.start_clean(c.content, 0x06, 0x33);
    host.wait_us(7'000);
    EXPECT_EQ(host.count(), 7 * c.size);
    const auto bytes = host.read(kFifoData, static_cast<std::size_t>(7 * c.size + 1));
    for (int i = 0; i < 7; ++i) EXPECT_EQ(bytes[static_cast<std::size_t>(i * c.size)], c.header);
    EXPECT_EQ(bytes.back(), 0xFF);
    EXPECT_EQ(host.chip.counters().fifo_bytes_beyond_end, 1);
  }
}

TEST(Icm42688Fifo, PacketsComeOutInTheOrderTheyWereSampled) {
  PlainHost host;
  // Every axis is its own ramp, so a swapped or dropped byte shows.
  host.chip.set_motion([](double s) {
    return Motion{.rate_radps = {100 * s * kDegree, 200 * s * kDegree, -300 * s * kDegree},
                  .specific_force_mps2 = {s * g, -2 * s * g, 3 * s * g}};
  });
  host.start_clean();
  host.wait_us(40'000);
  const auto bytes = host.read(kFifoData, 40 * 16);
  for (int i = 0; i < 40; ++i) {
    const Packet3 p = packet_3(bytes, static_cast<std::size_t>(16 * i));
    const double s = 0.051 + 0.001 * i;
    EXPECT_NEAR(p.accel[0], s * 2048, 0.51);
    EXPECT_NEAR(p.accel[1], -2 * s * 2048, 0.51);
    EXPECT_NEAR(p.accel[2], 3 * s * 2048, 0.51);
    EXPECT_NEAR(p.gyro[0], 100 * s * 16.384, 0.51);
    EXPECT_NEAR(p.gyro[1], 200 * s * 16.384, 0.51);
    EXPECT_NEAR(p.gyro[2], -300 * s * 16.384, 0.51);
  }
}

TEST(Icm42688Fifo, StampsTimes32Over30AreTheSampleTimesThroughEveryWrap) {
  for (const bool sixteen : {false, true}) {
    for (const int ppm : {0, -12'000}) {
      PlainHost host;
      host.chip.set_clock_error(ppm);
      host.write(kTmstConfig, sixteen ? 0x2B : 0x23);
      host.start_clean();
      const double unit_s = (sixteen ? 16e-6 : 1e-6) * 32.0 / 30.0;
      double total_counts = 0.0;
      int previous = -1;
      int packets = 0;
      std::array<int, 3> seen{};
      for (int round = 0; round < 400; ++round) {
        host.wait_us(10'000);
        const int n = host.count();
        const auto bytes = host.read(kFifoData, static_cast<std::size_t>(16 * n));
        for (int i = 0; i < n; ++i, ++packets) {
          const int stamp = packet_3(bytes, static_cast<std::size_t>(16 * i)).stamp;
          if (previous >= 0) {
            const int step = (stamp - previous) & 0xFFFF;
            total_counts += step;
            const int base = sixteen ? 58 : 937;  // 12.7: "toggles between 937 and 938", "between 58 and 59"
            ASSERT_TRUE(step == base || step == base + 1) << step;
            ++seen[static_cast<std::size_t>(step - base)];
          }
          previous = stamp;
        }
      }
      EXPECT_NEAR(total_counts * unit_s, (packets - 1) * 1e-3, unit_s);
      EXPECT_GT(seen[0], 0);
      EXPECT_GT(seen[1], 0);
      EXPECT_NEAR(packets, 4000 * (1.0 + ppm * 1e-6), 1.0);
    }
  }
}

TEST(Icm42688Fifo, TheLatchedTimeStampIsTheCounterWith20Bits) {
  PlainHost host;
  host.write(kTmstConfig, 0x33);
  host.wait_us(3'000'000);
  host.write(kSignalPathReset, 0x04);
  host.bank(1);
  const auto b = host.read(kTmstVal0, 3);
  EXPECT_EQ(b[0] | b[1] << 8 | b[2] << 16, 3'000'000 * 30 / 32 % (1 << 20));
}

TEST(Icm42688Fifo, CountsAreBytesOrRecordsInEitherByteOrder) {
  for (const std::uint8_t intf0 : bytes_of(0x33, 0x73, 0x13, 0x53)) {
    PlainHost host;
    host.start_clean(0x47, 0x06, intf0);
    host.wait_us(33'000);
    const auto b = host.read(kFifoCountH, 2);
    const int count = (intf0 & 0x20) != 0 ? b[0] << 8 | b[1] : b[1] << 8 | b[0];
    EXPECT_EQ(count, (intf0 & 0x40) != 0 ? 33 : 33 * 16);
  }
}

TEST(Icm42688Fifo, TheLowCountIsStaleUntilTheHighOneIsRead) {
  PlainHost host;
  host.start_clean();
  host.wait_us(5'000);
  EXPECT_EQ(host.count(), 5);
  host.wait_us(5'000);
  EXPECT_EQ(host.read(kFifoCountL), 5);
  EXPECT_EQ(host.read(kFifoCountH), 0);
  EXPECT_EQ(host.read(kFifoCountL), 10);
}

TEST(Icm42688Fifo, CountAndContentsAgreeOverAnyMixOfWaitsAndReads) {
  PlainHost host;
  host.start_clean();
  base::Random random{7};
  int taken = 0;
  const int before = host.chip.counters().packets_written;
  for (int round = 0; round < 500; ++round) {
    host.wait_us(random.next() % 9'000);
    const int available = host.count();
    const int wanted = static_cast<int>(random.next()) & 7;
    const auto bytes = host.read(kFifoData, static_cast<std::size_t>(16 * wanted));
    for (int i = 0; i < wanted; ++i) {
      EXPECT_EQ((bytes[static_cast<std::size_t>(16 * i)] & 0x80) == 0, i < available);
    }
    taken += std::min(available, wanted);
    EXPECT_EQ(host.count(), available - std::min(available, wanted));
    const int in_lost = host.read(kFifoLostPkt0) | host.read(kFifoLostPkt1) << 8;
    EXPECT_EQ(host.chip.counters().packets_written - before, taken + host.count() + in_lost);
  }
}

TEST(Icm42688Fifo, OneBurstFromTheStatusRunsThroughTheCountIntoTheData) {
  PlainHost host;
  host.start_clean();
  host.wait_us(3'000);
  const auto bytes = host.read(kIntStatus, 4 + 3 * 16);  // 2D, 2E, 2F, 30 ...
  EXPECT_EQ(bytes[0] & kDataReady, kDataReady);
  EXPECT_EQ(bytes[2], 3);
  EXPECT_EQ(bytes[3], 0x68);
  EXPECT_EQ(bytes[3 + 32], 0x68);
  EXPECT_EQ(bytes[3 + 48], 0xFF);
  EXPECT_EQ(host.count(), 0);
}

TEST(Icm42688Fifo, FullIsFullAndStreamLosesTheOldestWhileStopOnFullLosesTheNewest) {
  for (const int cache : {0, 1, 2}) {
    for (const bool stream : {true, false}) {
      PlainHost host;
      host.chip.set_read_cache(cache);
      host.chip.set_motion([](double s) { return Motion{.rate_radps = {s, 0.0, 0.0}}; });
      host.start_clean(0x47, 0x06, 0x73, stream ? 0x40 : 0x80);
      const int capacity = 127 + cache;  // 6.3
      host.wait_us(1'000 * (capacity - 1));
      EXPECT_EQ(host.read(kIntStatus) & kFifoFull, 0);
      host.wait_us(1'000);
      EXPECT_EQ(host.read(kIntStatus) & kFifoFull, kFifoFull);
      host.wait_us(30'000);
      EXPECT_EQ(host.count(), capacity);
      EXPECT_EQ(host.read(kFifoLostPkt0), 30);
      const double first_s = packet_3(host.read(kFifoData, 16)).gyro[0] / 32768.0 * 2000.0 * kDegree;
      EXPECT_NEAR(first_s, stream ? 0.081 : 0.051, 1e-3);
    }
  }
}

TEST(Icm42688Fifo, NeverHoldsMoreThanTheSheetsLargestSize) {
  for (const std::uint8_t content : bytes_of(0x41, 0x47, 0x57)) {
    PlainHost host;
    host.start_clean(content, 0x01, 0x33);
    host.wait_us(200'000);
    EXPECT_LE(host.count(), 2080);
    EXPECT_GE(host.count(), 2040);
  }
}

TEST(Icm42688Fifo, AHalfReadIsResumedOrRepeatedAsConfigured) {
  for (const bool resume : {true, false}) {
    PlainHost host;
    host.start_clean(resume ? 0x47 : 0x07);
    host.wait_us(4'000);
    EXPECT_EQ(host.count(), 4);
    const auto first = host.read(kFifoData, 24);
    const auto second = host.read(kFifoData, 40);
    const auto again = host.read(kFifoData, 64);
    if (resume) {
      EXPECT_EQ(second[8], 0x68);  // the rest of the half packet, then a header
      EXPECT_EQ(again[0], 0xFF);
    } else {
      EXPECT_TRUE(std::equal(first.begin(), first.end(), second.begin()));
      EXPECT_TRUE(std::equal(first.begin(), first.end(), again.begin()));
      EXPECT_EQ(host.count(), 0);
    }
  }
}

TEST(Icm42688Fifo, AFlushEmptiesAndTheNextSampleFollows) {
  PlainHost host;
  host.start();
  EXPECT_GT(host.count(), 0);
  host.write(kSignalPathReset, 0x02);
  EXPECT_EQ(host.count(), 0);
  EXPECT_EQ(host.read(kSignalPathReset), 0);
  host.wait_us(2'000);
  EXPECT_EQ(host.count(), 2);
}

TEST(Icm42688Fifo, ASensorWithoutNewSampleIsMarkedOrRepeatsItsLast) {
  for (const bool hold : {false, true}) {
    PlainHost host;
    host.chip.set_motion({.rate_radps = {1.0, 1.0, 1.0}});
    host.write(kIntfConfig0, hold ? 0xF3 : 0x73);
    host.write(kFifoConfig1, 0x47);
    host.write(kFifoConfig, 0x40);
    host.write(kAccelConfig0, 0x07);  // 200 Hz beside 1 kHz
    host.write(kPwrMgmt0, 0x0F);
    host.wait_us(50'000);
    const int n = host.count();
    const auto bytes = host.read(kFifoData, static_cast<std::size_t>(16 * n));
    int accel_new = 0;
    int gyro_new = 0;
    for (int i = 0; i < n; ++i) {
      const Packet3 p = packet_3(bytes, static_cast<std::size_t>(16 * i));
      EXPECT_EQ(p.header, 0x68);
      accel_new += p.accel[2] != -32768 ? 1 : 0;
      gyro_new += p.gyro[0] != -32768 ? 1 : 0;
    }
    // 10, 15 ... 50 ms of accelerometer, then 30, 31 ... 50 ms of gyroscope: 25 instants.
    EXPECT_EQ(n, 4 + 21);
    EXPECT_EQ(accel_new, hold ? n : 9);
    EXPECT_EQ(gyro_new, hold ? n : 21);
    EXPECT_EQ(packet_3(bytes).gyro[0], hold ? 0 : -32768);  // nothing yet to hold
  }
}

TEST(Icm42688Fifo, AnAxisThatIsSwitchedOffIsMarkedAlone) {
  for (int axis = 0; axis < 6; ++axis) {
    PlainHost host;
    host.bank(1);
    host.write(kSensorConfig0, static_cast<std::uint8_t>(0x80 | 1 << axis));
    host.bank(0);
    host.start_clean();
    host.wait_us(1'000);
    const Packet3 p = packet_3(host.read(kFifoData, 16));
    for (int i = 0; i < 6; ++i) {
      const int value = i < 3 ? p.accel[static_cast<std::size_t>(i)] : p.gyro[static_cast<std::size_t>(i - 3)];
      EXPECT_EQ(value == -32768, i == axis);
    }
  }
}

TEST(Icm42688Fifo, AbortAndResetBeginsTheRateAnew) {
  PlainHost host;
  host.start_clean();
  host.wait_us(700);
  host.write(kSignalPathReset, 0x08);
  host.wait_us(999);
  EXPECT_EQ(host.count(), 0);
  host.wait_us(1);
  EXPECT_EQ(host.count(), 1);
}

TEST(Icm42688Fifo, StampsCanBeDeltasOrAbsent) {
  struct Case {
    std::uint8_t tmst;
    int header, low, high;
  };
  for (const Case& c : {Case{0x27, 0x68, 937, 938}, Case{0x22, 0x60, 0, 0}}) {
    PlainHost host;
    host.write(kTmstConfig, c.tmst);
    host.start_clean();
    host.wait_us(10'000);
    const auto bytes = host.read(kFifoData, 160);
    for (std::size_t i = 0; i < 10; ++i) {
      const Packet3 p = packet_3(bytes, 16 * i);
      EXPECT_EQ(p.header, c.header);
      EXPECT_GE(p.stamp, c.low);
      EXPECT_LE(p.stamp, c.high);
    }
  }
}

TEST(Icm42688Fifo, APacketMayArriveBetweenTheCountAndTheData) {
  PlainHost host;
  host.start_clean();
  host.wait_us(4'900);
  host.chip.set_before_transfer([&] { host.wait_us(150); });
  EXPECT_EQ(host.count(), 5);
  const auto bytes = host.read(kFifoData, 80);
  EXPECT_EQ(bytes[64], 0x68);
  host.wait_us(700);
  EXPECT_EQ(host.count(), 1);
}

TEST(Icm42688Fifo, AChangedRateIsAnnouncedInOnePacketHeader) {
  PlainHost host;
  host.start_clean();
  host.wait_us(3'000);
  host.write(kGyroConfig0, 0x0F);
  host.write(kAccelConfig0, 0x0F);
  host.wait_us(6'000);
  const int n = host.count();
  const auto bytes = host.read(kFifoData, static_cast<std::size_t>(16 * n));
  std::vector<int> headers;
  for (int i = 0; i < n; ++i) headers.push_back(bytes[static_cast<std::size_t>(16 * i)]);
  EXPECT_EQ(headers, (std::vector<int>{0x68, 0x68, 0x68, 0x6B, 0x68, 0x68}));
}

TEST(Icm42688Fifo, TwentyBitPacketsKeepFullScaleAndTheirZeroBitsWhateverTheRange) {
  for (const std::uint8_t range :
       bytes_of(0x06, 0x66)) {  // 2000 dps and 16 g, or 250 dps and 2 g: 6.1 says no difference
    PlainHost host;
    host.chip.set_motion({.rate_radps = {100.0 * kDegree, -1500.0 * kDegree, 3000.0 * kDegree},
                          .specific_force_mps2 = {1.0 * g, -15.0 * g, 0.001 * g},
                          .temperature_degC = 31.0});
    host.start_clean(0x57, range);
    host.wait_us(1'000);
    EXPECT_EQ(host.count(), 1);
    const auto b = host.read(kFifoData, 20);
    const auto wide = [&](std::size_t at, int nibble) {
      const int raw = b[at] << 12 | b[at + 1] << 4 | nibble;
      return raw >= 1 << 19 ? raw - (1 << 20) : raw;
    };
    EXPECT_EQ(b[0], 0x78);
    EXPECT_NEAR(wide(1, b[17] >> 4) / 4, 8192, 0.51);
    EXPECT_NEAR(wide(3, b[18] >> 4) / 4, -15 * 8192, 0.51);
    EXPECT_NEAR(wide(5, b[19] >> 4) / 4, 8.192, 0.51);
    EXPECT_NEAR(wide(7, b[17] & 0x0F) / 2, 100 * 131.072, 0.51);
    EXPECT_NEAR(wide(9, b[18] & 0x0F) / 2, -1500 * 131.072, 0.51);
    EXPECT_EQ(wide(11, b[19] & 0x0F), 524286);
    for (std::size_t i = 17; i < 20; ++i) EXPECT_EQ(b[i] & 0x31, 0);
    EXPECT_NEAR(static_cast<std::int16_t>(b[13] << 8 | b[14]) / 132.48 + 25.0, 31.0, 0.01);
  }
}

TEST(Icm42688Fifo, LittleEndianSwapsEveryWordAndNothingElse) {
  PlainHost big;
  PlainHost little;
  for (PlainHost* host : {&big, &little}) {
    host->chip.set_motion({.rate_radps = {1.0, -2.0, 3.0}, .specific_force_mps2 = {1.0, 2.0, -9.0}});
    host->start_clean(0x47, 0x06, host == &big ? 0x73 : 0x63);
    host->wait_us(1'000);
  }
  const auto b = big.read(kFifoData, 16);
  const auto l = little.read(kFifoData, 16);
  for (const std::size_t i : {1U, 3U, 5U, 7U, 9U, 11U, 14U}) {
    EXPECT_EQ(b[i], l[i + 1]);
    EXPECT_EQ(b[i + 1], l[i]);
  }
  EXPECT_EQ(b[0], l[0]);
  EXPECT_EQ(b[13], l[13]);
  EXPECT_EQ(big.read(kAccelDataX1), little.read(kAccelDataX1 + 1));
}

TEST(Icm42688Fifo, AnFsyncEdgeReplacesOneStampByTheTimeSinceIt) {
  PlainHost host;
  host.bank(1);
  host.write(kIntfConfig5, 0x02);
  host.bank(0);
  host.start_clean(0x4F);
  host.wait_us(600);
  host.chip.pulse_fsync();
  host.wait_us(1'400);
  const auto bytes = host.read(kFifoData, 32);
  EXPECT_EQ(bytes[0], 0x6C);
  EXPECT_NEAR(packet_3(bytes).stamp, 400 * 30 / 32, 1);
  EXPECT_EQ(bytes[16], 0x68);
}

// --- Interrupts and self test

TEST(Icm42688Interrupts, TheWatermarkFiresOnceOrAtEveryPacketAndClearsOnRead) {
  for (const bool every : {false, true}) {
    PlainHost host;
    host.start_clean(every ? 0x67 : 0x47);  // watermark 8 records
    (void)host.read(kIntStatus);
    host.wait_us(7'000);
    EXPECT_EQ(host.read(kIntStatus) & kFifoThreshold, 0);
    host.wait_us(1'000);
    EXPECT_EQ(host.read(kIntStatus) & kFifoThreshold, kFifoThreshold);
    EXPECT_EQ(host.read(kIntStatus) & kFifoThreshold, 0);
    host.wait_us(1'000);
    EXPECT_EQ(host.read(kIntStatus) & kFifoThreshold, every ? kFifoThreshold : 0);
    (void)host.read(kFifoData, static_cast<std::size_t>(16 * host.count()));
    host.wait_us(8'000);
    EXPECT_EQ(host.read(kIntStatus) & kFifoThreshold, kFifoThreshold);
  }
}

TEST(Icm42688Interrupts, TheWatermarkCountsInTheUnitOfTheCountAndZeroNeverFires) {
  struct Case {
    std::uint8_t intf0, low, high;
    int fires_at_ms;
  };
  for (const Case& c : {Case{0x73, 5, 0, 5}, Case{0x33, 80, 0, 5}, Case{0x33, 0x40, 1, 20}, Case{0x73, 0, 0, 0}}) {
    PlainHost host;
    host.write(kFifoConfig3, c.high);
    host.write(kIntfConfig0, c.intf0);
    host.write(kFifoConfig1, 0x47);
    host.write(kFifoConfig2, c.low);
    host.write(kFifoConfig, 0x40);
    host.write(kPwrMgmt0, 0x0F);
    host.wait_us(50'000);
    host.write(kSignalPathReset, 0x02);
    (void)host.read(kIntStatus);
    int fired_at_ms = 0;
    for (int ms = 1; ms <= 100 && fired_at_ms == 0; ++ms) {
      host.wait_us(1'000);
      if ((host.read(kIntStatus) & kFifoThreshold) != 0) fired_at_ms = ms;
    }
    EXPECT_EQ(fired_at_ms, c.fires_at_ms);
  }
}

TEST(Icm42688Interrupts, ThePinFollowsTheRoutedSourcesOnceItsAsyncResetIsCleared) {
  for (const bool cleared : {false, true}) {
    PlainHost host;
    host.write(kIntConfig1, cleared ? 0x00 : 0x10);
    host.write(kIntSource0, 0x08);
    host.start();
    EXPECT_EQ(host.chip.int1(), cleared);
    (void)host.read(kIntStatus);
    EXPECT_FALSE(host.chip.int1());
  }
}

TEST(Icm42688SelfTest, TheSettledResponseIsTheFactoryCodesAtEveryRangeAndTheEarlyOneIsNot) {
  for (int fs = 0; fs < 4; ++fs) {
    PlainHost host;
    host.chip.set_self_test_codes({120, 130, 141}, {90, 100, 111});
    host.write(kGyroConfig0, static_cast<std::uint8_t>(fs << 5 | 0x06));
    host.write(kAccelConfig0, static_cast<std::uint8_t>(fs << 5 | 0x06));
    host.write(kPwrMgmt0, 0x0F);
    host.wait_us(60'000);
    const auto all = [&] {
      std::array<int, 6> v{};
      for (std::uint8_t i = 0; i < 3; ++i) {
        v[i] = host.word(static_cast<std::uint8_t>(kGyroDataX1 + 2 * i));
        v[i + 3U] = host.word(static_cast<std::uint8_t>(kAccelDataX1 + 2 * i));
      }
      return v;
    };
    const auto off = all();
    host.write(kSelfTestConfig, 0x7F);
    host.wait_us(2'000);
    const auto early = all();
    host.wait_us(250'000);
    const auto on = all();
    host.bank(1);
    const auto gyro_codes = host.read(kXgStData, 3);
    host.bank(2);
    const auto accel_codes = host.read(kXaStData, 3);
    host.bank(0);
    for (std::size_t i = 0; i < 6; ++i) {
      const int code = i < 3 ? gyro_codes[i] : accel_codes[i - 3];
      const double expected = 2620.0 / (1 << (3 - fs)) * std::pow(1.01, code - 1);
      EXPECT_NEAR(on[i] - off[i], expected, 1.5 + 0.01 * expected);
      EXPECT_LT(early[i] - off[i], 0.5 * expected);
    }
    host.write(kSelfTestConfig, 0x00);
    host.wait_us(400'000);
    EXPECT_EQ(all(), off);
    EXPECT_EQ(host.chip.broken_rules(), 0) << host.chip.broken_rules_in_words();
  }
}

TEST(Icm42688SelfTest, TheAccelerometerNeedsItsSelfTestPower) {
  PlainHost host;
  host.write(kPwrMgmt0, 0x0F);
  host.wait_us(60'000);
  const int off = host.word(kAccelDataX1);
  host.write(kSelfTestConfig, 0x38);
  host.wait_us(100'000);
  EXPECT_EQ(host.word(kAccelDataX1), off);
}

}  // namespace
}  // namespace tetap::fakes
