// SPDX-License-Identifier: Apache-2.0
// Timers in encoder mode: counts of both widths over their wraps, direction, mistakes of the configuration. RM0402
// chapter "General-purpose timers".
#include "sim_host/emulator/test/driven_chip.hpp"

namespace tetap::board {
namespace {

namespace tim = reg::tim;

class Wheels : public DrivenChip {
 public:
  Wheels()
      : DrivenChip({}, {.left_edges = [this](Picoseconds) { return edges; },
                        .right_edges = [this](Picoseconds) { return edges; }}) {
    start_clocks();
    alternate({'A', 0}, 1);
    alternate({'A', 1}, 1);
    alternate({'B', 4}, 2);
    alternate({'B', 5}, 2);
  }
  void start(std::uint32_t timer, std::uint32_t sms = 3) {
    put(timer, tim::smcr::kOffset, tim::smcr::kSms(sms));
    put(timer, tim::ccmr1_input::kOffset, tim::ccmr1_input::kCc1s(1) | tim::ccmr1_input::kCc2s(1));
    put(timer, tim::cr1::kOffset, tim::cr1::kCen(1));
  }
  [[nodiscard]] std::uint32_t count(std::uint32_t timer) { return get(timer, tim::cnt::kOffset); }
  std::int64_t edges = 0;
};

TEST(Encoder, CountsBothWaysOverThreeWraps) {
  Wheels board;
  board.start(tim::kTim2);
  board.start(tim::kTim3);
  for (const std::int64_t at : {1, 5, 70'000, 200'000, 130'000, -70'000, -200'000, 3}) {
    board.edges = at;
    EXPECT_EQ(board.count(tim::kTim2), static_cast<std::uint32_t>(at)) << at;
    EXPECT_EQ(board.count(tim::kTim3), static_cast<std::uint32_t>(at) & 0xFFFF) << at;
  }
  EXPECT_NO_COMPLAINTS(board);
}

TEST(Encoder, DirectionIsThatOfTheLastEdgeNotOfTheWrap) {
  Wheels board;
  board.start(tim::kTim3);
  board.edges = 65'536 + 2;  // wrapped upwards
  EXPECT_EQ(board.count(tim::kTim3), 2U);
  board.edges -= 1;
  (void)board.count(tim::kTim3);
  EXPECT_NE(board.get(tim::kTim3, tim::cr1::kOffset) & tim::cr1::kDir.mask(), 0U);
  EXPECT_NE(board.get(tim::kTim3, tim::sr::kOffset) & tim::sr::kUif.mask(), 0U);
  board.put(tim::kTim3, tim::sr::kOffset, 0);
  EXPECT_EQ(board.get(tim::kTim3, tim::sr::kOffset), 0U);
}

TEST(Encoder, ReloadBelowFullWidthCountsReloadPlusOne) {
  Wheels board;
  board.put(tim::kTim3, tim::arr::kOffset, 99);
  board.start(tim::kTim3);
  EXPECT_TRUE(board.complained("TIM3", "ARR below full width"));
  board.edges = 100;
  EXPECT_EQ(board.count(tim::kTim3), 0U);
  board.edges = 99;
  EXPECT_EQ(board.count(tim::kTim3), 99U);
}

TEST(Encoder, OneLineModeCountsHalf) {
  for (const std::uint32_t sms : {1U, 2U}) {
    Wheels board;
    board.start(tim::kTim2, sms);
    board.edges = 1000;
    EXPECT_EQ(board.count(tim::kTim2), 500U);
    EXPECT_TRUE(board.complained("TIM2", "half of the edges"));
  }
}

TEST(Encoder, PrescalerIsNoticed) {
  Wheels board;
  board.put(tim::kTim2, tim::psc::kOffset, 1);
  board.start(tim::kTim2);
  EXPECT_TRUE(board.complained("TIM2", "PSC other than 0"));
}

TEST(Encoder, PolarityTurnsTheDirection) {
  Wheels board;
  board.put(tim::kTim2, tim::ccer::kOffset, tim::ccer::kCc1p(1));
  board.start(tim::kTim2);
  board.edges = 10;
  EXPECT_EQ(board.count(tim::kTim2), 0xFFFF'FFF6U);
}

TEST(Encoder, PinLeftToTheDebugPortCountsBackAndForth) {
  Wheels board;
  board.alternate({'B', 4}, 0);  // NJTRST
  board.start(tim::kTim3);
  EXPECT_TRUE(board.complained("TIM3", "PB4 is alternate function 0"));
  board.edges = 1000;
  EXPECT_LT(board.count(tim::kTim3), 3U);
}

TEST(Encoder, OneEdgeToAndFroLeavesTheCount) {
  Wheels board;
  board.start(tim::kTim2);
  for (int i = 0; i < 100; ++i) {
    board.edges = 50 + i % 2;
    EXPECT_EQ(board.count(tim::kTim2), 50U + static_cast<std::uint32_t>(i % 2));
  }
}

TEST(Encoder, UnpluggedLinesStandStill) {
  Wheels board;
  board.start(tim::kTim2);
  board.edges = 7;
  EXPECT_EQ(board.count(tim::kTim2), 7U);
  board.plug_encoders(false);
  board.edges = 70;
  EXPECT_EQ(board.count(tim::kTim2), 7U);
  board.plug_encoders(true);
  EXPECT_EQ(board.count(tim::kTim2), 7U) << "edges of that time are lost";
  board.edges = 75;
  EXPECT_EQ(board.count(tim::kTim2), 12U);
}

}  // namespace
}  // namespace tetap::board
