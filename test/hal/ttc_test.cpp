// SPDX-License-Identifier: Apache-2.0
#include "hal/chip/zynqmp/ttc.hpp"

#include <gtest/gtest.h>

#include <map>
#include <random>

namespace tetap::hal::zynqmp_r5 {
namespace {

// The first counter as UG1087 has it or as QEMU 7.2 does: 32 or 16 bits, 100 or 133 MHz, divided by 2^(PS_VAL + 1).
struct FakeTtc {
  Machine machine;
  std::uint64_t time_ns = 0;
  std::map<std::uint32_t, std::uint32_t> written{};

  [[nodiscard]] std::uint32_t mask() const { return machine == Machine::kSilicon ? ~0U : 0xFFFFU; }
  std::uint32_t read(std::uint32_t offset) {
    if (offset != 0x18) return written[offset];
    const unsigned prescale = ((written[0x00] >> 1) & 15U) + 1;
    const std::uint64_t clock_MHz = machine == Machine::kSilicon ? 100 : 133;
    return static_cast<std::uint32_t>((time_ns * clock_MHz / 1000) >> prescale) & mask();
  }
  void write(std::uint32_t offset, std::uint32_t value) { written[offset] = value & mask(); }
};
struct Registers {
  FakeTtc* chip;
  [[nodiscard]] std::uint32_t read(std::uint32_t offset) const { return chip->read(offset); }
  void write(std::uint32_t offset, std::uint32_t value) const { chip->write(offset, value); }
};

class TtcTest : public testing::TestWithParam<Machine> {
 protected:
  TtcTest() { timer.start(GetParam()); }
  FakeTtc chip{GetParam()};
  Ttc<Registers> timer{Registers{&chip}};
};
INSTANTIATE_TEST_SUITE_P(Machines, TtcTest, testing::Values(Machine::kSilicon, Machine::kEmulated),
                         [](const auto& one) { return std::string{name(one.param)}; });

TEST_P(TtcTest, TellsWhichMachineItIs) { EXPECT_EQ(timer.probe(), GetParam()); }

TEST_P(TtcTest, IsRightToItsResolutionHoweverOftenItIsAsked) {
  const double resolution_us = GetParam() == Machine::kSilicon ? 1 : 63;
  EXPECT_LE(resolution_us, 100);
  std::mt19937_64 random{4};
  base::Micros last{};
  for (int i = 0; i < 100'000; ++i) {
    // Pauses from next to nothing to just short of the counter's round.
    chip.time_ns += random() % (1ULL << (random() % 32)) % 4'000'000'000;
    const base::Micros now = timer.now();
    ASSERT_GE(now, last);
    last = now;
    const double late_us = static_cast<double>(chip.time_ns) / 1000 - static_cast<double>(now.us);
    ASSERT_GE(late_us, -0.001) << "after " << chip.time_ns << " ns";
    ASSERT_LE(late_us, resolution_us) << "after " << chip.time_ns << " ns";
  }
  EXPECT_GT(last.us, 3'600'000'000);  // the emulator's counter went round a thousand times, silicon's twenty
}

}  // namespace
}  // namespace tetap::hal::zynqmp_r5
