// SPDX-License-Identifier: Apache-2.0
#include "hal/chip/arm/systick_clock.hpp"

#include <gtest/gtest.h>

#include <random>

namespace tetap::hal {
namespace {

// SysTick as ARM DDI 0403E.e B3.3 has it. Time in cycles of the core passes with every access, and the exception is
// taken when the program lets it be. Offsets are those of the manual, not those of the driver's header.
class FakeSysTick {
 public:
  std::uint64_t cycle = 0;
  std::uint32_t cost = 3;  ///< cycles of an access
  SysTickClock<struct TickRegisters>* clock = nullptr;
  bool masked = false;  ///< as in a handler of the same priority
  std::uint32_t reload = 0, control = 0;

  void pass(std::uint64_t cycles) {
    for (; cycles > 0; --cycles) {
      ++cycle;
      if ((control & 1U) == 0) continue;
      value_ = value_ == 0 ? reload : value_ - 1;
      if (value_ == 0) pending_ = (control & 2U) != 0;
      take_exception();
    }
  }
  void take_exception();
  std::uint32_t read(std::uint32_t offset) {
    const std::uint32_t result = offset == 0x018 ? value_ : offset == 0xD04 ? (pending_ ? 1U << 26 : 0U) : 0U;
    pass(cost);
    return result;
  }
  void write(std::uint32_t offset, std::uint32_t value) {
    if (offset == 0x010) control = value;
    if (offset == 0x014) reload = value & 0xFF'FFFF;
    if (offset == 0x018) value_ = 0;
  }

 private:
  std::uint32_t value_ = 0;
  bool pending_ = false;
};
struct TickRegisters {
  FakeSysTick* chip;
  [[nodiscard]] std::uint32_t read(std::uint32_t offset) const { return chip->read(offset); }
  void write(std::uint32_t offset, std::uint32_t value) const { chip->write(offset, value); }
};
void FakeSysTick::take_exception() {
  if (!pending_ || masked) return;
  pending_ = false;
  clock->on_interrupt();
}

class SysTickClockTest : public testing::Test {
 protected:
  SysTickClockTest() {
    chip.clock = &clock;
    clock.start(96'000'000);
  }
  FakeSysTick chip{};
  SysTickClock<TickRegisters> clock{TickRegisters{&chip}};
};

TEST_F(SysTickClockTest, IsTheCoresTimeWhereverTheTickFalls) {
  EXPECT_EQ(chip.reload, 95'999U);
  std::mt19937 random{7};
  base::Micros last{};
  for (int i = 0; i < 40'000; ++i) {
    chip.cost = static_cast<std::uint32_t>(1 + random() % 20);
    // Most looks fall near a tick, where a wrong one is off by a whole millisecond.
    const std::uint64_t to_tick = 96'000 - chip.cycle % 96'000;
    chip.pass(random() % 4 == 0 ? random() % 5'000 : to_tick > 60 ? to_tick - 60 + random() % 40 : random() % 60);
    // In a handler of the same priority the tick stays pending.
    chip.masked = random() % 2 == 0;
    const auto before = static_cast<std::int64_t>(chip.cycle / 96);
    const base::Micros now = clock.now();
    const auto after = static_cast<std::int64_t>(chip.cycle / 96);
    chip.masked = false;
    chip.take_exception();
    ASSERT_GE(now.us, before - 1) << i;  // the first cycle reloads
    ASSERT_LE(now.us, after) << i;
    ASSERT_GE(now, last) << i;
    last = now;
  }
  EXPECT_GT(last.us, 5'000'000);
}

TEST_F(SysTickClockTest, GoesOnWhere32BitsOfMillisecondsWrap) {
  constexpr std::uint64_t kNearWrap = (std::uint64_t{1} << 32) - 3;
  clock.set_ticks(kNearWrap);
  base::Micros last = clock.now();
  EXPECT_EQ(last.us / 1000, static_cast<std::int64_t>(kNearWrap));
  const base::Micros begin = last;
  for (int i = 0; i < 2'000; ++i) {
    chip.pass(301);
    const base::Micros now = clock.now();
    ASSERT_GE(now, last);
    ASSERT_LE((now - last).us, 5);
    last = now;
  }
  EXPECT_GT((last - begin).us, 6'000);
  EXPECT_GT(last.us, std::int64_t{1'000} << 32);
}

}  // namespace
}  // namespace tetap::hal
