// SPDX-License-Identifier: Apache-2.0
// The fake ICM-42688-P's faults and the rules it watches: each shows on the bus as its name says, and nothing else
// does.
#include "support/fakes/icm42688_host.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <ostream>
#include <set>

namespace tetap::fakes {
namespace {

using namespace icm42688;

// --- Rules

struct RuleCase {
  Rule rule;
  std::function<void(PlainHost&)> breaks;
};
void PrintTo(const RuleCase& one, std::ostream* out) { *out << name(one.rule); }

class Icm42688Rules : public ::testing::TestWithParam<RuleCase> {};

TEST_P(Icm42688Rules, ABrokenRuleIsCountedUnderItsNameAlone) {
  PlainHost host;
  GetParam().breaks(host);
  EXPECT_EQ(host.chip.broken(GetParam().rule), 1) << name(GetParam().rule);
  EXPECT_EQ(host.chip.broken_rules(), 1) << host.chip.broken_rules_in_words();
}

INSTANTIATE_TEST_SUITE_P(
    All, Icm42688Rules,
    ::testing::Values(RuleCase{Rule::kNoAccessDuringReset,
                               [](PlainHost& h) {
                                 h.write(kDeviceConfig, 0x01);
                                 h.wait_us(500);
                                 (void)h.read(kWhoAmI);
                               }},
                      RuleCase{Rule::kNoWriteInQuietTime,
                               [](PlainHost& h) {
                                 h.write(kPwrMgmt0, 0x03);
                                 h.wait_us(100);
                                 h.write(kGyroConfig0, 0x26);
                               }},
                      RuleCase{Rule::kGyroOnFor45ms,
                               [](PlainHost& h) {
                                 h.write(kPwrMgmt0, 0x0C);
                                 h.wait_us(44'000);
                                 h.write(kPwrMgmt0, 0x00);
                               }},
                      RuleCase{Rule::kNoChangeWhileRunning,
                               [](PlainHost& h) {
                                 h.start();
                                 h.write(kGyroAccelConfig0, 0x44);
                               }},
                      RuleCase{Rule::kSingleWrites,
                               [](PlainHost& h) {
                                 const std::array<std::uint8_t, 3> two_values{kFifoConfig2, 0x10, 0x01};
                                 (void)h.chip.transfer(two_values, {});
                                 EXPECT_EQ(h.read(kFifoConfig2), 0x10);
                                 EXPECT_EQ(h.read(kFifoConfig3), 0x00);
                               }},
                      RuleCase{Rule::kReservedBitsKept, [](PlainHost& h) { h.write(kIntfConfig1, 0x01); }},
                      RuleCase{Rule::kNoReservedValue, [](PlainHost& h) { h.write(kGyroConfig0, 0x00); }},
                      RuleCase{Rule::kNoReservedValue, [](PlainHost& h) { h.write(kRegBankSel, 0x05); }},
                      RuleCase{Rule::kRegisterExists,
                               [](PlainHost& h) {
                                 h.bank(1);
                                 h.write(kPwrMgmt0, 0x0F);
                                 EXPECT_EQ(h.chip.peek(0, kPwrMgmt0), 0x00);
                               }},
                      RuleCase{Rule::kReadOnlyNotWritten, [](PlainHost& h) { h.write(kWhoAmI, 0x12); }},
                      RuleCase{Rule::kRateFitsMode,
                               [](PlainHost& h) {
                                 h.write(kPwrMgmt0, 0x02);  // low power at 1 kHz
                                 h.wait_us(50'000);
                                 EXPECT_EQ(h.chip.counters().accel_samples, 0);
                               }},
                      RuleCase{Rule::kWatermarkNotZero, [](PlainHost& h) { h.write(kIntSource0, 0x14); }}));

TEST(Icm42688RuleNames, AreOnePerRuleAndPerFault) {
  std::set<std::string_view> names;
  for (std::size_t i = 0; i < index(Rule::kCount); ++i) names.insert(name(static_cast<Rule>(i)));
  for (std::size_t i = 0; i < index(Fault::kCount); ++i) names.insert(name(static_cast<Fault>(i)));
  EXPECT_EQ(names.size(), index(Rule::kCount) + index(Fault::kCount));
}

TEST(Icm42688Rules, AHostThatKeepsToTheSheetBreaksNone) {
  PlainHost host;
  host.start();
  host.wait_us(100'000);
  host.write(kGyroConfig0, 0x27);
  host.write(kPwrMgmt0, 0x00);
  host.write(kGyroAccelConfig0, 0x44);
  EXPECT_EQ(host.chip.broken_rules(), 0) << host.chip.broken_rules_in_words();
}

TEST(Icm42688Rules, SwitchingTheSerialInterfaceOffLeavesADeadBusUntilPowerReturns) {
  for (const auto& [address, value] : {std::pair{kIntfConfig0, 0x32}, std::pair{kDeviceConfig, 0x10}}) {
    PlainHost host;
    host.write(address, static_cast<std::uint8_t>(value));
    EXPECT_EQ(host.read(kWhoAmI), 0xFF);
    host.write(kDeviceConfig, 0x01);
    host.wait_us(2'000);
    EXPECT_EQ(host.read(kWhoAmI), 0xFF);
    host.chip.inject(Fault::kBrownOut);
    host.wait_us(1'000);
    EXPECT_EQ(host.read(kWhoAmI), kIdentity);
  }
}

TEST(Icm42688Rules, StoppedClocksStopTheSamples) {
  for (const std::uint8_t clocks : bytes_of(0x93, 0x95)) {  // CLKSEL 3; RTC_MODE with no external clock
    PlainHost host;
    host.write(kIntfConfig1, clocks);
    host.start();
    EXPECT_EQ(host.count(), 0);
  }
}

TEST(Icm42688Rules, AfterAnyTrafficABrownOutBringsBackAWorkingChip) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    PlainHost host;
    base::Random random{seed};
    for (int i = 0; i < 2'000; ++i) {
      const auto byte = [&] { return static_cast<std::uint8_t>(random.next()); };
      std::vector<std::uint8_t> out(1 + random.next() % 3);
      for (std::uint8_t& b : out) b = byte();
      std::vector<std::uint8_t> in(random.next() % 80);
      (void)host.chip.transfer(out, in);
      host.wait_us(random.next() % 300);
    }
    host.chip.inject(Fault::kBrownOut);
    host.wait_us(1'000);
    for (const Register& r : kRegisters) EXPECT_EQ(host.chip.peek(r.bank, r.address), r.reset);
    host.start_clean();
    host.wait_us(5'000);
    EXPECT_EQ(host.count(), 5);
    EXPECT_EQ(packet_3(host.read(kFifoData, 16)).accel, (std::array<int, 3>{0, 0, 2048}));
  }
}

// --- Faults

TEST(Icm42688Faults, ADeadBusSaysSoFromTheChosenTransferForAsManyAsChosen) {
  PlainHost host;
  host.chip.inject(Fault::kBusDead, {.after_transfers = 3, .transfers = 2});
  std::array<std::uint8_t, 1> in{};
  const std::array<std::uint8_t, 1> out{0x80 | kWhoAmI};
  std::vector<bool> ok;
  for (int i = 0; i < 7; ++i) ok.push_back(host.chip.transfer(out, in));
  EXPECT_EQ(ok, (std::vector<bool>{true, true, true, false, false, true, true}));
}

TEST(Icm42688Faults, AStuckBusReadsItsLevelAndTakesNoWrite) {
  for (const auto& [fault, level] : {std::pair{Fault::kBusStuckLow, 0x00}, std::pair{Fault::kBusStuckHigh, 0xFF}}) {
    PlainHost host;
    host.chip.inject(fault);
    EXPECT_EQ(host.read(kWhoAmI), level);
    host.write(kFifoConfig2, 0x20);
    EXPECT_EQ(host.read(kFifoData, 3), std::vector<std::uint8_t>(3, static_cast<std::uint8_t>(level)));
    host.chip.clear(fault);
    EXPECT_EQ(host.read(kFifoConfig2), 0x00);
  }
}

TEST(Icm42688Faults, BitsFlipAtTheirRateAndTheSameWayForASeed) {
  const auto flips = [](std::uint64_t seed, double rate) {
    PlainHost host;
    host.chip.inject(Fault::kBitFlips, {.rate = rate, .seed = seed});
    std::vector<std::uint8_t> all;
    for (int i = 0; i < 20'000; ++i) all.push_back(host.read(kWhoAmI) ^ kIdentity);
    return all;
  };
  const auto first = flips(3, 0.01);
  int bits = 0;
  for (const std::uint8_t byte : first) bits += std::popcount(byte);
  EXPECT_NEAR(bits, 1600, 5 * 40);
  EXPECT_EQ(first, flips(3, 0.01));
  EXPECT_NE(first, flips(4, 0.01));
}

TEST(Icm42688Faults, WrittenBitsFlipOnTheirWayIn) {
  PlainHost host;
  host.chip.inject(Fault::kWrittenBitFlips, {.rate = 0.02, .seed = 5});
  for (int i = 0; i < 300; ++i) host.write(kFifoConfig2, 0x20);
  host.chip.clear(Fault::kWrittenBitFlips);
  int changed = 0;
  for (const Register& r : kRegisters) changed += host.chip.peek(r.bank, r.address) != r.reset ? 1 : 0;
  EXPECT_GT(changed, 1);
}

TEST(Icm42688Faults, AWrongIdentityIsAllThatChanges) {
  PlainHost host;
  host.chip.inject(Fault::kWrongIdentity);
  EXPECT_EQ(host.read(kWhoAmI), 0x44);
  host.start_clean();
  host.wait_us(3'000);
  EXPECT_EQ(host.count(), 3);
}

TEST(Icm42688Faults, ARefusingRegisterKeepsItsValueWhileTheOthersTakeTheirs) {
  PlainHost host;
  host.chip.inject(Fault::kRegisterRefuses, {.address = kAccelConfig0});
  host.write(kAccelConfig0, 0x26);
  host.write(kGyroConfig0, 0x26);
  EXPECT_EQ(host.read(kAccelConfig0), 0x06);
  EXPECT_EQ(host.read(kGyroConfig0), 0x26);
}

TEST(Icm42688Faults, AChangedRegisterChangesWhatTheChipDoes) {
  PlainHost host;
  host.chip.set_motion({.rate_radps = {1.0, 0.0, 0.0}});
  host.start();
  const int before = host.word(kGyroDataX1);
  host.chip.inject(Fault::kRegisterChanges, {.address = kGyroConfig0, .value = 0x26});
  host.wait_us(2'000);
  EXPECT_NEAR(host.word(kGyroDataX1), 2 * before, 2);
}

TEST(Icm42688Faults, ABrownOutLeavesASleepingChipThatReportsAReset) {
  PlainHost host;
  host.start();
  (void)host.read(kIntStatus);
  host.chip.inject(Fault::kBrownOut);
  host.wait_us(20'000);
  EXPECT_EQ(host.read(kIntStatus), kResetDone);
  EXPECT_EQ(host.read(kPwrMgmt0), 0x00);
  EXPECT_EQ(host.count(), 0);
  EXPECT_EQ(host.chip.broken(Rule::kNoAccessDuringReset), 0);
}

TEST(Icm42688Faults, AStuckFifoGivesTheSamePacketsForEver) {
  PlainHost host;
  host.start_clean();
  host.wait_us(3'000);
  host.chip.inject(Fault::kFifoStuck);
  EXPECT_EQ(host.count(), 3);
  const auto first = host.read(kFifoData, 48);
  host.wait_us(10'000);
  EXPECT_EQ(host.count(), 3);
  EXPECT_EQ(host.read(kFifoData, 48), first);
}

TEST(Icm42688Faults, AStuckAxisKeepsItsValueWhileTheOthersMove) {
  for (int axis = 0; axis < 6; ++axis) {
    PlainHost host;
    host.chip.set_motion([](double s) {
      return Motion{.rate_radps = {s, s, s}, .specific_force_mps2 = {10 * s, 10 * s, 10 * s}};
    });
    host.start_clean();
    host.chip.inject(Fault::kAxisStuck, {.axis = axis});
    host.wait_us(100'000);
    const auto bytes = host.read(kFifoData, 100 * 16);
    const Packet3 first = packet_3(bytes);
    const Packet3 last = packet_3(bytes, 99 * 16);
    for (int i = 0; i < 3; ++i) {
      const auto k = static_cast<std::size_t>(i);
      EXPECT_EQ(first.gyro[k] == last.gyro[k], axis == i);
      EXPECT_EQ(first.accel[k] == last.accel[k], axis == i + 3);
    }
  }
}

TEST(Icm42688Faults, AStampClockThatIsOffLeavesTheSampleTimesAlone) {
  PlainHost host;
  host.chip.inject(Fault::kStampClockOff, {.ppm = 50'000});
  host.start_clean();
  host.wait_us(100'000);
  EXPECT_EQ(host.count(), 100);
  const auto bytes = host.read(kFifoData, 1600);
  const int counts = (packet_3(bytes, 50 * 16).stamp - packet_3(bytes).stamp) & 0xFFFF;
  EXPECT_NEAR(counts * 32.0 / 30.0, 50e3 * 1.05, 2.0);
}

TEST(Icm42688Faults, ALostSampleIsAGapInTheStampsThatNoCounterTells) {
  PlainHost host;
  host.start_clean();
  host.chip.inject(Fault::kSamplesLost, {.every = 10});
  host.wait_us(100'000);
  EXPECT_EQ(host.count(), 90);
  EXPECT_EQ(host.read(kFifoLostPkt0), 0);
  const auto bytes = host.read(kFifoData, 90 * 16);
  int gaps = 0;
  for (std::size_t i = 1; i < 90; ++i) {
    const int step = (packet_3(bytes, 16 * i).stamp - packet_3(bytes, 16 * (i - 1)).stamp) & 0xFFFF;
    EXPECT_TRUE(step == 937 || step == 938 || step == 1875);
    gaps += step == 1875 ? 1 : 0;
  }
  EXPECT_EQ(gaps, 9);
}

TEST(Icm42688Faults, AFailingSelfTestIsWeakOnItsAxisAlone) {
  for (int axis = 0; axis < 6; ++axis) {
    PlainHost host;
    host.chip.inject(Fault::kSelfTestFails, {.axis = axis});
    host.write(kGyroConfig0, 0x66);
    host.write(kAccelConfig0, 0x66);
    host.chip.set_motion({.specific_force_mps2 = {0.0, 0.0, 0.0}});
    host.write(kPwrMgmt0, 0x0F);
    host.wait_us(60'000);
    host.write(kSelfTestConfig, 0x7F);
    host.wait_us(250'000);
    for (int i = 0; i < 6; ++i) {
      const int bank = i < 3 ? 1 : 2;
      const int code = host.chip.peek(static_cast<std::uint8_t>(bank),
                                      static_cast<std::uint8_t>(i < 3 ? kXgStData + i : kXaStData + i - 3));
      const int response = host.word(static_cast<std::uint8_t>(i < 3 ? kGyroDataX1 + 2 * i : kAccelDataX1 + 2 * i - 6));
      const double ratio = response / (2620.0 * std::pow(1.01, code - 1));
      EXPECT_NEAR(ratio, i == axis ? 0.2 : 1.0, 0.02);
    }
  }
}

}  // namespace
}  // namespace tetap::fakes
