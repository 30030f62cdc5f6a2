// SPDX-License-Identifier: Apache-2.0
// The concepts of a board: what satisfies them, and what a board without a part is not.
#include "support/fakes/board.hpp"

#include "hal/board/linux/memory_can.hpp"

#include <gtest/gtest.h>

#include <optional>

namespace tetap::fakes {
namespace {

using Full = WiredBoard<hal::MemoryCan>;
static_assert(hal::Board<Full> && hal::IdleBoard<Full> && hal::WatchdogBoard<Full> && hal::ReportingBoard<Full>);
static_assert(hal::ImuBoard<Full> && hal::EncoderBoard<Full> && hal::GnssBoard<Full>);

/// A clock and a bus are a board; a reference stands for a part as the part itself does.
struct Bare {
  [[nodiscard]] base::Micros now() const { return {}; }
  hal::MemoryCan& can;
};
static_assert(hal::Board<Bare>);
static_assert(!hal::IdleBoard<Bare> && !hal::WatchdogBoard<Bare> && !hal::ReportingBoard<Bare>);
static_assert(!hal::ImuBoard<Bare> && !hal::EncoderBoard<Bare> && !hal::GnssBoard<Bare>);

struct OneEncoder : Bare {
  Encoder<std::uint16_t>& left_encoder;
};
struct SilentLine {
  static std::size_t read(std::span<std::uint8_t>) { return 0; }
  static std::size_t write(std::span<const std::uint8_t> out) { return out.size(); }
};
struct UncountedLine : Bare {
  SilentLine gnss;
};
static_assert(!hal::EncoderBoard<OneEncoder>, "a pair has two");
static_assert(!hal::ByteStream<SilentLine> && !hal::GnssBoard<UncountedLine>, "a line counts what it lost");

TEST(WiredBoard, time_passes_for_all_its_parts_together) {
  hal::MemoryBus bus;
  Full board(bus.node_end());
  board.left_encoder.set_speed(1000.0);
  board.advance(base::Micros{1'500'000});
  EXPECT_EQ(board.now().us, 1'500'000);
  EXPECT_NEAR(board.left_encoder.read().count, 1500U, 1);
  std::array<std::uint8_t, 2000> bytes{};
  EXPECT_GT(board.gnss.read(bytes), 0U);
}

}  // namespace
}  // namespace tetap::fakes
