// SPDX-License-Identifier: Apache-2.0
// Serial port with circular DMA: traps 9 and 10 of a port, one test each. RM0402 chapters USART and DMA.
#include "sim_host/emulator/test/driven_chip.hpp"

#include <string>

namespace tetap::board {
namespace {

constexpr std::uint32_t kPort = reg::usart::kUsart1, kRing = 0x2000'1000, kStream = 5 * reg::dma::sxcr::kStride;

class Serial : public DrivenChip {
 public:
  explicit Serial(std::uint32_t brr = 833) {  // 96 MHz / 115 200
    start_clocks();
    alternate({'A', 15}, 7);
    alternate({'B', 3}, 7);
    put(kPort, reg::usart::brr::kOffset, brr);
    put(kPort, reg::usart::cr1::kOffset,
        reg::usart::cr1::kUe.mask() | reg::usart::cr1::kTe.mask() | reg::usart::cr1::kRe.mask());
  }
  void start_ring(std::uint32_t size, std::uint32_t address = kRing) {
    put(reg::dma::kDma2, reg::dma::sxpar::kOffset + kStream, kPort + reg::usart::dr::kOffset);
    put(reg::dma::kDma2, reg::dma::sxm0ar::kOffset + kStream, address);
    put(reg::dma::kDma2, reg::dma::sxndtr::kOffset + kStream, size);
    put(reg::dma::kDma2, reg::dma::sxcr::kOffset + kStream,
        reg::dma::sxcr::kChsel(4) | reg::dma::sxcr::kMinc(1) | reg::dma::sxcr::kCirc(1) | reg::dma::sxcr::kTcie(1) |
            reg::dma::sxcr::kEn(1));
    set(kPort, reg::usart::cr3::kOffset, reg::usart::cr3::kDmar.mask());
  }
  /// Bytes one after the other, as a receiver paces them.
  void feed(const std::string& bytes, std::int64_t baud = 115'200) {
    for (const char byte : bytes) {
      chip.usart1.arrive(static_cast<std::uint8_t>(byte), baud);
      chip.scheduler.advance(chip.scheduler.now() + periods(10, baud));
    }
  }
  [[nodiscard]] std::uint32_t left() { return get(reg::dma::kDma2, reg::dma::sxndtr::kOffset + kStream); }
  [[nodiscard]] std::uint32_t status() { return get(kPort, reg::usart::sr::kOffset); }
  [[nodiscard]] char ring(std::uint32_t i) { return static_cast<char>(chip.memory.ram()[kRing + i - Memory::kRam]); }
};

TEST(Usart, RingTakesBytesAndCountsDown) {
  Serial board;
  board.start_ring(8);
  board.feed("abcde");
  EXPECT_EQ(board.left(), 3U);
  board.feed("fgh");
  EXPECT_EQ(board.left(), 8U) << "exactly at the end NDTR is the size again";
  EXPECT_TRUE(board.pending(reg::interrupt::kDma2Stream5));
  board.feed("ijk");
  EXPECT_EQ(board.ring(0), 'i');
  EXPECT_EQ(board.ring(3), 'd');
  EXPECT_EQ(board.left(), 5U);
  EXPECT_NO_COMPLAINTS(board);
}

TEST(Usart, OverrunKeepsTheFirstByteAndStopsInterruptsUntilItIsRead) {
  Serial board;
  board.set(kPort, reg::usart::cr1::kOffset, reg::usart::cr1::kRxneie.mask());
  board.feed("xyz");
  EXPECT_TRUE(board.pending(reg::interrupt::kUsart1));
  EXPECT_NE(board.status() & reg::usart::sr::kOre.mask(), 0U);
  EXPECT_EQ(board.get(kPort, reg::usart::dr::kOffset), static_cast<std::uint32_t>('x'));
  EXPECT_EQ(board.status() & (reg::usart::sr::kOre.mask() | reg::usart::sr::kRxne.mask()), 0U);
}

TEST(Usart, IdleComesACharacterBehindTheLastByteAndReadingItsFlagsEatsAByte) {
  Serial board;
  board.start_ring(16);
  board.feed("ab");
  EXPECT_EQ(board.status() & reg::usart::sr::kIdle.mask(), 0U);
  board.chip.advance_us(90);
  EXPECT_NE(board.status() & reg::usart::sr::kIdle.mask(), 0U);
  (void)board.get(kPort, reg::usart::dr::kOffset);
  EXPECT_EQ(board.status() & reg::usart::sr::kIdle.mask(), 0U);
}

TEST(Usart, WrongRateGivesFramingErrorsAndOtherBytes) {
  Serial board(833);
  int errors = 0, right = 0;
  for (int i = 0; i < 40; ++i) {
    board.feed(std::string(1, static_cast<char>(0x80 + i)), 38'400);
    const std::uint32_t status = board.status();
    if ((status & reg::usart::sr::kFe.mask()) != 0) ++errors;
    if (board.get(kPort, reg::usart::dr::kOffset) == 0x80U + static_cast<std::uint32_t>(i)) ++right;
  }
  EXPECT_GT(errors, 10);
  EXPECT_LT(right, 3);
}

TEST(Usart, RatesWithinTwoPerCentAreUnderstood) {
  for (const std::int64_t baud : {113'000, 115'200, 117'400}) {
    Serial board;
    board.start_ring(16);
    board.feed("Uz\x01\xFE", baud);
    EXPECT_EQ(board.ring(0), 'U') << baud;
    EXPECT_EQ(board.ring(1), 'z') << baud;
    EXPECT_EQ(board.ring(3), '\xFE') << baud;
    EXPECT_EQ(board.status() & reg::usart::sr::kFe.mask(), 0U) << baud;
  }
}

TEST(Usart, SendsAtTheRateOfItsDivider) {
  Serial board;
  const Picoseconds begin = board.chip.scheduler.now();
  std::string sent;
  Picoseconds end = 0;
  board.chip.usart1.on_sent = [&](std::uint8_t byte, std::int64_t baud) {
    sent += static_cast<char>(byte);
    end = board.chip.scheduler.now();
    EXPECT_NEAR(static_cast<double>(baud), 115'200, 60);
  };
  board.put(kPort, reg::usart::dr::kOffset, 'h');
  board.put(kPort, reg::usart::dr::kOffset, 'i');
  EXPECT_EQ(board.status() & reg::usart::sr::kTxe.mask(), 0U);
  board.chip.advance_us(200);
  EXPECT_EQ(sent, "hi");
  EXPECT_NEAR(static_cast<double>(end - begin) / kMicrosecond, 173.5, 0.1);
  EXPECT_NE(board.status() & reg::usart::sr::kTc.mask(), 0U);
  EXPECT_NO_COMPLAINTS(board);
}

TEST(Usart, PinLeftToTheDebugPortIsNoticedOnBothSides) {
  Serial board;
  board.alternate({'B', 3}, 0);
  board.alternate({'A', 15}, 0);
  board.feed("a");
  EXPECT_EQ(board.status() & reg::usart::sr::kRxne.mask(), 0U);
  EXPECT_TRUE(board.complained("USART1", "PB3 is alternate function 0"));
  board.put(kPort, reg::usart::dr::kOffset, 'h');
  EXPECT_TRUE(board.complained("USART1", "PA15 is alternate function 0"));
}

TEST(Dma, RingThatIsNoMemoryIsATransferError) {
  Serial board;
  board.start_ring(8, 0x1000'0000);  // CCM of other chips
  EXPECT_TRUE(board.complained("DMA2", "no memory that DMA reaches"));
  EXPECT_NE(board.get(reg::dma::kDma2, reg::dma::hisr::kOffset) & reg::dma::hisr::kTeif5.mask(), 0U);
}

TEST(Dma, RingBeyondTheEndOfTheSramIsNoticed) {
  Serial board;
  board.start_ring(8, 0x2003'FFFC);
  EXPECT_TRUE(board.complained("DMA2", "no memory that DMA reaches"));
}

TEST(Dma, CountWrittenWhileOnIsIgnoredAndNoticed) {
  Serial board;
  board.start_ring(8);
  board.feed("abc");
  board.put(reg::dma::kDma2, reg::dma::sxndtr::kOffset + kStream, 8);
  EXPECT_EQ(board.left(), 5U);
  EXPECT_TRUE(board.complained("DMA2", "written while EN = 1"));
}

TEST(Dma, FlagsOfTheLastTransferKeepAStreamFromStarting) {
  Serial board;
  board.start_ring(2);
  board.feed("ab");
  board.put(reg::dma::kDma2, reg::dma::sxcr::kOffset + kStream, 0);
  board.start_ring(2);
  EXPECT_TRUE(board.complained("DMA2", "flags of the last transfer"));
  board.put(reg::dma::kDma2, reg::dma::hifcr::kOffset, 0xFFFF'FFFF);
  board.start_ring(2);
  board.feed("c");
  EXPECT_EQ(board.ring(0), 'c');
}

TEST(Dma, RewrittenCountBeginsAtTheFirstAddress) {
  Serial board;
  board.start_ring(8);
  board.feed("abc");
  board.put(reg::dma::kDma2, reg::dma::sxcr::kOffset + kStream, 0);
  board.put(reg::dma::kDma2, reg::dma::hifcr::kOffset, 0xFFFF'FFFF);
  board.start_ring(8);
  board.feed("z");
  EXPECT_EQ(board.ring(0), 'z');
  EXPECT_NO_COMPLAINTS(board);
}

TEST(Dma, WrongChannelMovesNothing) {
  Serial board;
  board.start_ring(8);
  board.put(reg::dma::kDma2, reg::dma::sxcr::kOffset + kStream, 0);
  board.put(reg::dma::kDma2, reg::dma::hifcr::kOffset, 0xFFFF'FFFF);
  board.put(reg::dma::kDma2, reg::dma::sxcr::kOffset + kStream,
            reg::dma::sxcr::kChsel(3) | reg::dma::sxcr::kMinc(1) | reg::dma::sxcr::kEn(1));
  board.feed("ab");
  EXPECT_EQ(board.left(), 8U);
  EXPECT_NE(board.status() & reg::usart::sr::kOre.mask(), 0U);
}

}  // namespace
}  // namespace tetap::board
