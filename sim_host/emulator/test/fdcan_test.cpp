// SPDX-License-Identifier: Apache-2.0
// FDCAN of the STM32G474 by its registers and its message RAM: order of transmission, FIFOs and how they are
// acknowledged, filters, protection of the configuration, error states, bus-off that stays. RM0440 chapter FDCAN, ISO
// 11898-1.
#include "sim_host/emulator/test/driven_g474.hpp"

#include <vector>

namespace tetap::board {
namespace {

namespace can = g4::fdcan;
namespace cccr = can::cccr;
namespace ir = can::ir;

constexpr std::uint32_t kCan = can::kFdcan1, kRam = can::kFdcan;
constexpr std::uint32_t kRx0 = 0x0B0, kRx1 = 0x188, kEvents = 0x260, kTx = 0x278, kElement = 72, kEnd = 0x350;
constexpr std::uint32_t kQueue = can::txbc::kTfqm.mask();

class Bus : public DrivenG474 {
 public:
  explicit Bus(std::uint32_t txbc = 0) : txbc_(txbc) {
    start_clocks();
    alternate({'A', 11}, 9);
    alternate({'A', 12}, 9);
    chip.fdcan1.line.on_frame = [this](Picoseconds, const CanOffer& frame, bool own) {
      ids.push_back(frame.frame.id);
      sizes.push_back(frame.frame.size);
      owns.push_back(own);
    };
  }
  /// 160 MHz / 20 / 16 quanta = 500 kbit/s, sample point at 87.5 %; all frames to FIFO 0.
  void configure() {
    put(kCan, cccr::kOffset, cccr::kInit(1) | cccr::kCce(1));
    put(kCan, can::nbtp::kOffset,
        can::nbtp::kNbrp(19) | can::nbtp::kNtseg1(12) | can::nbtp::kNtseg2(1) | can::nbtp::kNsjw(1));
    put(kCan, can::txbc::kOffset, txbc_);
    put(kCan, can::ile::kOffset, can::ile::kEint0(1) | can::ile::kEint1(1));
    put(kCan, can::txbtie::kOffset, 7);
  }
  void leave() {
    put(kCan, cccr::kOffset, 0);
    chip.advance_us(50);
  }
  void start() {
    configure();
    leave();
  }
  void fill(std::uint32_t buffer, std::uint32_t id, std::uint32_t size = 8, std::uint32_t flags = 0) {
    const std::uint32_t at = kTx + buffer * kElement;
    put(kRam, at, id << 18);
    put(kRam, at + 4, size << 16 | flags);
    put(kRam, at + 8, 0x0403'0201);
    put(kRam, at + 12, 0x0807'0605);
  }
  void add(std::uint32_t bits) { put(kCan, can::txbar::kOffset, bits); }
  /// Fills the buffer at the put index and requests it.
  void send(std::uint32_t id, std::uint32_t size = 8, std::uint32_t flags = 0) {
    const std::uint32_t buffer = can::txfqs::kTfqpi.of(fqs());
    fill(buffer, id, size, flags);
    add(1U << buffer);
  }
  void feed(std::uint32_t id, int count = 1) {
    for (int i = 0; i < count; ++i) {
      chip.fdcan1.line.send({.id = id + static_cast<std::uint32_t>(i), .size = 8, .data = {1, 2, 3, 4, 5, 6, 7, 8}},
                            chip.scheduler.now());
    }
  }
  [[nodiscard]] std::uint32_t fqs() { return get(kCan, can::txfqs::kOffset); }
  [[nodiscard]] std::uint32_t status() { return get(kCan, can::rxf0s::kOffset); }
  [[nodiscard]] std::uint32_t level() { return can::rxf0s::kF0fl.of(status()); }
  [[nodiscard]] std::uint32_t flags() { return get(kCan, ir::kOffset); }
  [[nodiscard]] std::uint32_t protocol(hal::Field field) { return field.of(get(kCan, can::psr::kOffset)); }
  [[nodiscard]] bool initialising() { return cccr::kInit.of(get(kCan, cccr::kOffset)) != 0; }
  /// Identifier of the element at the get index of FIFO 0, which is acknowledged then.
  [[nodiscard]] std::uint32_t take() {
    const std::uint32_t index = can::rxf0s::kF0gi.of(status());
    const std::uint32_t id = get(kRam, kRx0 + index * kElement) >> 18 & 0x7FF;
    put(kCan, can::rxf0a::kOffset, index);
    return id;
  }

  std::vector<std::uint32_t> ids;
  std::vector<std::size_t> sizes;
  std::vector<bool> owns;

 private:
  std::uint32_t txbc_;
};

using Ids = std::vector<std::uint32_t>;

TEST(Fdcan, SendsAtTheBitRateAndReportsIt) {
  Bus bus;
  bus.start();
  EXPECT_EQ(bus.chip.fdcan1.bit_rate(), 500'000);
  EXPECT_EQ(can::txfqs::kTffl.of(bus.fqs()), 3U);
  bus.send(0x123);
  EXPECT_EQ(bus.get(kCan, can::txbrp::kOffset), 1U);
  EXPECT_EQ(can::txfqs::kTffl.of(bus.fqs()), 2U);
  EXPECT_EQ(can::txfqs::kTfqpi.of(bus.fqs()), 1U);
  bus.chip.advance_us(400);
  EXPECT_EQ(bus.ids, Ids{0x123});
  EXPECT_EQ(bus.get(kCan, can::txbto::kOffset), 1U);
  EXPECT_EQ(bus.get(kCan, can::txbrp::kOffset), 0U);
  EXPECT_EQ(bus.flags() & (ir::kTc.mask() | ir::kTfe.mask()), ir::kTc.mask() | ir::kTfe.mask());
  EXPECT_EQ(can::txfqs::kTfgi.of(bus.fqs()), 1U);
  EXPECT_NO_COMPLAINTS(bus);
}

TEST(Fdcan, QueueModeTurnsTheOrderIntoThatOfIdentifiers) {
  for (const bool queue : {false, true}) {
    Bus bus(queue ? kQueue : 0);
    bus.start();
    bus.feed(0x050);  // keeps the bus busy while the buffers are filled
    bus.chip.advance_us(10);
    for (const std::uint32_t id : {0x300U, 0x200U, 0x100U}) bus.send(id);
    EXPECT_NE(bus.fqs() & can::txfqs::kTfqf.mask(), 0U);
    EXPECT_EQ(can::txfqs::kTffl.of(bus.fqs()), 0U);
    bus.chip.advance_us(2'000);
    EXPECT_EQ(bus.ids, queue ? (Ids{0x050, 0x100, 0x200, 0x300}) : (Ids{0x050, 0x300, 0x200, 0x100}));
    EXPECT_NO_COMPLAINTS(bus);
  }
}

TEST(Fdcan, EqualIdentifiersOfAQueueGoByTheNumberOfTheirBuffer) {
  for (const bool queue : {false, true}) {
    Bus bus(queue ? kQueue : 0);
    bus.start();
    bus.send(0x050, 0);  // buffer 0 becomes free last
    bus.send(0x100, 1);
    bus.send(0x100, 2);
    bus.chip.advance_us(120);
    ASSERT_EQ(bus.ids, Ids{0x050});
    bus.send(0x100, 3);
    bus.chip.advance_us(2'000);
    // The frame of size 1 is on the wire when buffer 0 is filled anew.
    EXPECT_EQ(bus.sizes, queue ? (std::vector<std::size_t>{0, 1, 3, 2}) : (std::vector<std::size_t>{0, 1, 2, 3}));
  }
}

TEST(Fdcan, RequestBehindThePutIndexIsNoFifo) {
  Bus bus;
  bus.start();
  bus.fill(2, 0x100);
  bus.add(4);
  EXPECT_TRUE(bus.complained("FDCAN1", "not at the put index"));
  bus.chip.advance_us(500);
  EXPECT_TRUE(bus.ids.empty());
}

TEST(Fdcan, PendingBufferTakesNothing) {
  Bus bus;
  bus.start();
  bus.send(0x100);
  bus.fill(0, 0x200);
  EXPECT_TRUE(bus.complained("SRAMCAN", "while its request is pending"));
  bus.chip.complaints.clear();
  bus.add(1);
  EXPECT_TRUE(bus.complained("FDCAN1", "is pending: ignored"));
}

TEST(Fdcan, BufferThatWasNeverWrittenIsNoticed) {
  Bus bus;
  bus.start();
  bus.add(1);
  EXPECT_TRUE(bus.complained("FDCAN1", "never written"));
}

TEST(Fdcan, CancelledHeadMovesTheGetIndexOn) {
  Bus bus;
  bus.start();
  bus.feed(0x050);
  bus.chip.advance_us(10);
  bus.put(kCan, can::txbcie::kOffset, 7);
  bus.send(0x100);
  bus.send(0x200);
  bus.put(kCan, can::txbcr::kOffset, 1);
  EXPECT_EQ(bus.get(kCan, can::txbcf::kOffset), 1U);
  EXPECT_NE(bus.flags() & ir::kTcf.mask(), 0U);
  EXPECT_EQ(can::txfqs::kTfgi.of(bus.fqs()), 1U);
  EXPECT_EQ(can::txfqs::kTffl.of(bus.fqs()), 2U);
  bus.chip.advance_us(1'000);
  EXPECT_EQ(bus.ids, (Ids{0x050, 0x200}));
  EXPECT_EQ(can::txfqs::kTffl.of(bus.fqs()), 3U);
}

TEST(Fdcan, CancelledBufferInTheMiddleIsPassedOver) {
  Bus bus;
  bus.start();
  bus.feed(0x050);
  bus.chip.advance_us(10);
  for (const std::uint32_t id : {0x100U, 0x200U, 0x300U}) bus.send(id);
  bus.put(kCan, can::txbcr::kOffset, 2);
  EXPECT_EQ(can::txfqs::kTfgi.of(bus.fqs()), 0U);
  EXPECT_EQ(can::txfqs::kTffl.of(bus.fqs()), 0U) << "it becomes free when the get index passes";
  bus.chip.advance_us(2'000);
  EXPECT_EQ(bus.ids, (Ids{0x050, 0x100, 0x300}));
  EXPECT_EQ(can::txfqs::kTffl.of(bus.fqs()), 3U);
  EXPECT_NO_COMPLAINTS(bus);
}

TEST(Fdcan, LowerIdentifierOfAnotherNodeGoesFirst) {
  Bus bus;
  bus.start();
  bus.feed(0x500);
  bus.chip.advance_us(10);
  bus.send(0x200);
  bus.feed(0x100);
  bus.feed(0x300);
  bus.chip.advance_us(2'000);
  EXPECT_EQ(bus.ids, (Ids{0x500, 0x100, 0x200, 0x300}));
  EXPECT_NO_COMPLAINTS(bus);
}

TEST(Fdcan, FifoHoldsThreeAndTheFourthIsLost) {
  Bus bus;
  bus.start();
  bus.feed(0x100, 3);
  bus.chip.advance_us(1'000);
  EXPECT_EQ(bus.level(), 3U);
  EXPECT_NE(bus.status() & can::rxf0s::kF0f.mask(), 0U);
  EXPECT_EQ(bus.flags() & ir::kRf0l.mask(), 0U);
  bus.feed(0x110);
  bus.chip.advance_us(1'000);
  EXPECT_NE(bus.flags() & ir::kRf0l.mask(), 0U);
  EXPECT_NE(bus.status() & can::rxf0s::kRf0l.mask(), 0U) << "a copy of the flag";
  bus.put(kCan, ir::kOffset, ir::kRf0l.mask());
  EXPECT_EQ(bus.status() & can::rxf0s::kRf0l.mask(), 0U);
  EXPECT_EQ((Ids{bus.take(), bus.take(), bus.take()}), (Ids{0x100, 0x101, 0x102}));
  EXPECT_EQ(bus.level(), 0U);
  EXPECT_NO_COMPLAINTS(bus);
}

TEST(Fdcan, OverwritingFifoLosesTheOldest) {
  Bus bus;
  bus.configure();
  bus.put(kCan, can::rxgfc::kOffset, can::rxgfc::kF0om(1));
  bus.leave();
  bus.feed(0x100, 4);
  bus.chip.advance_us(2'000);
  EXPECT_EQ((Ids{bus.take(), bus.take(), bus.take()}), (Ids{0x101, 0x102, 0x103}));
  EXPECT_EQ(bus.flags() & ir::kRf0l.mask(), 0U);
}

TEST(Fdcan, AcknowledgedElementFreesThoseBeforeIt) {
  Bus bus;
  bus.start();
  bus.feed(0x100, 3);
  bus.chip.advance_us(1'000);
  bus.put(kCan, can::rxf0a::kOffset, 1);
  EXPECT_EQ(bus.level(), 1U);
  EXPECT_EQ(bus.take(), 0x102U);
  EXPECT_NO_COMPLAINTS(bus);
}

// The index of a FIFO that was acknowledged already, of one that holds nothing, and one that there is not.
TEST(Fdcan, WrongAcknowledgementsAreNoticed) {
  for (const std::uint32_t index : {0U, 2U, 5U}) {
    Bus bus;
    bus.start();
    bus.feed(0x100, 2);
    bus.chip.advance_us(1'000);
    EXPECT_EQ(bus.take(), 0x100U);
    EXPECT_NO_COMPLAINTS(bus);
    bus.put(kCan, can::rxf0a::kOffset, index);
    EXPECT_TRUE(bus.complained("FDCAN1", "which holds nothing")) << index;
    EXPECT_EQ(bus.level(), 1U);
  }
}

TEST(Fdcan, ElementReadAfterItsAcknowledgementIsNoticed) {
  Bus bus;
  bus.start();
  bus.feed(0x100);
  bus.chip.advance_us(500);
  (void)bus.take();
  (void)bus.get(kRam, kRx0);
  EXPECT_TRUE(bus.complained("SRAMCAN", "holds nothing"));
}

TEST(Fdcan, ElementsCarryDataLengthAndTheKindOfTheirMatch) {
  Bus bus;
  bus.start();
  bus.feed(0x321);
  bus.chip.advance_us(500);
  EXPECT_EQ(bus.get(kRam, kRx0), 0x321U << 18);
  EXPECT_EQ(bus.get(kRam, kRx0 + 4) & 0xFFFF'0000, 0x8008'0000U) << "accepted without a filter, 8 bytes";
  EXPECT_EQ(bus.get(kRam, kRx0 + 8), 0x0403'0201U);
  EXPECT_EQ(bus.get(kRam, kRx0 + 12), 0x0807'0605U);
  EXPECT_NO_COMPLAINTS(bus);
}

TEST(Fdcan, FiltersAreLookedAtInOrder) {
  Bus bus;
  bus.configure();
  bus.put(kRam, 0, 0U << 30 | 2U << 27 | 0x200U << 16 | 0x20F);  // range to FIFO 1
  bus.put(kRam, 4, 2U << 30 | 1U << 27 | 0x300U << 16 | 0x7F0);  // identifier and mask to FIFO 0
  bus.put(kRam, 8, 1U << 30 | 3U << 27 | 0x400U << 16 | 0x401);  // two identifiers are rejected
  bus.put(kCan, can::rxgfc::kOffset, can::rxgfc::kLss(3) | can::rxgfc::kAnfs(2));
  bus.leave();
  for (const std::uint32_t id : {0x1FFU, 0x20FU, 0x210U, 0x305U, 0x401U}) bus.feed(id);
  bus.chip.advance_us(3'000);
  EXPECT_EQ(bus.level(), 1U);
  EXPECT_EQ(bus.get(kRam, kRx0 + 4) >> 24, 1U) << "matched by element 1";
  EXPECT_EQ(bus.take(), 0x305U);
  EXPECT_EQ(can::rxf0s::kF0fl.of(bus.get(kCan, can::rxf1s::kOffset)), 1U);
  EXPECT_EQ(bus.get(kRam, kRx1), 0x20FU << 18);
  EXPECT_NO_COMPLAINTS(bus);
}

TEST(Fdcan, ExtendedFiltersUseTheirMask) {
  Bus bus;
  bus.configure();
  bus.put(kRam, 0x70, 1U << 29 | 0x0123'4500);
  bus.put(kRam, 0x74, 2U << 30 | 0x1FFF'FF00);
  bus.put(kCan, can::rxgfc::kOffset, can::rxgfc::kLse(1) | can::rxgfc::kAnfe(2));
  bus.leave();
  for (const std::uint32_t id : {0x0123'4567U, 0x0123'4667U})
    bus.chip.fdcan1.line.send({.id = id, .extended = true, .size = 1}, bus.chip.scheduler.now());
  bus.chip.advance_us(1'000);
  EXPECT_EQ(bus.level(), 1U);
  EXPECT_EQ(bus.get(kRam, kRx0), 1U << 30 | 0x0123'4567U);
}

// XIDAM takes bits out of the identifier before it is compared; a range of type 3 sees all of it.
TEST(Fdcan, ExtendedMaskIsForAllTypesButOne) {
  for (const bool masked : {true, false}) {
    Bus bus;
    bus.configure();
    bus.put(kRam, 0x70, 1U << 29 | 0x0123'4500);
    bus.put(kRam, 0x74, (masked ? 1U : 3U) << 30 | 0x0123'4500);
    bus.put(kCan, can::xidam::kOffset, 0x1FFF'FF00);
    bus.put(kCan, can::rxgfc::kOffset, can::rxgfc::kLse(1) | can::rxgfc::kAnfe(2));
    bus.leave();
    bus.chip.fdcan1.line.send({.id = 0x0123'4567, .extended = true, .size = 1}, bus.chip.scheduler.now());
    bus.chip.advance_us(1'000);
    EXPECT_EQ(bus.level(), masked ? 1U : 0U);
  }
}

TEST(Fdcan, PriorityFilterRaisesItsFlag) {
  Bus bus;
  bus.configure();
  bus.put(kRam, 0, 1U << 30 | 5U << 27 | 0x123U << 16 | 0x123);
  bus.put(kCan, can::rxgfc::kOffset, can::rxgfc::kLss(1));
  bus.leave();
  bus.feed(0x122);
  bus.chip.advance_us(500);
  EXPECT_EQ(bus.flags() & ir::kHpm.mask(), 0U);
  bus.feed(0x123);
  bus.chip.advance_us(500);
  EXPECT_NE(bus.flags() & ir::kHpm.mask(), 0U);
  const std::uint32_t hpms = bus.get(kCan, can::hpms::kOffset);
  EXPECT_EQ(can::hpms::kMsi.of(hpms), 2U) << "stored in FIFO 0";
  EXPECT_EQ(can::hpms::kBidx.of(hpms), 1U);
}

TEST(Fdcan, FiltersThatWereNeverWrittenAreNoticed) {
  Bus bus;
  bus.configure();
  bus.put(kCan, can::rxgfc::kOffset, can::rxgfc::kLss(1));
  bus.leave();
  EXPECT_TRUE(bus.complained("FDCAN1", "never written"));
}

TEST(Fdcan, ConfigurationNeedsInitAndCce) {
  const std::uint32_t offsets[] = {can::nbtp::kOffset, can::rxgfc::kOffset, can::txbc::kOffset,
                                   can::tscc::kOffset, can::xidam::kOffset, can::ckdiv::kOffset};
  for (const std::uint32_t offset : offsets) {
    Bus bus;  // INIT is set after reset, CCE is not
    const std::uint32_t before = bus.get(kCan, offset);
    bus.put(kCan, offset, 1);
    EXPECT_TRUE(bus.complained("FDCAN1", "without INIT and CCE")) << offset;
    EXPECT_EQ(bus.get(kCan, offset), before);
  }
  Bus running;
  running.start();
  running.put(kCan, cccr::kOffset, cccr::kDar(1));
  EXPECT_TRUE(running.complained("FDCAN1", "mode bits of CCCR"));
  EXPECT_EQ(running.get(kCan, cccr::kOffset), 0U);
}

TEST(Fdcan, CceTogetherWithInitComesTooEarly) {
  Bus bus;
  bus.start();
  bus.put(kCan, cccr::kOffset, cccr::kInit(1) | cccr::kCce(1));
  EXPECT_FALSE(bus.initialising()) << "INIT crosses to another clock first";
  EXPECT_TRUE(bus.complained("FDCAN1", "CCE set while INIT reads 0"));
  bus.chip.advance_us(2);
  EXPECT_EQ(bus.get(kCan, cccr::kOffset), cccr::kInit.mask());
}

TEST(Fdcan, InitWrittenTwiceWithoutReadingBackIsNoticed) {
  Bus bus;
  bus.start();
  bus.put(kCan, cccr::kOffset, cccr::kInit(1));
  bus.put(kCan, cccr::kOffset, 0);
  EXPECT_TRUE(bus.complained("FDCAN1", "before its last value is read back"));
}

TEST(Fdcan, CceDropsWhatWaits) {
  Bus bus;
  bus.start();
  bus.chip.fdcan1.line.partner = false;
  bus.send(0x100);
  bus.put(kCan, cccr::kOffset, cccr::kInit(1));
  bus.chip.advance_us(1'000);
  ASSERT_TRUE(bus.initialising());
  EXPECT_EQ(bus.get(kCan, can::txbrp::kOffset), 1U) << "INIT alone keeps requests";
  bus.put(kCan, cccr::kOffset, cccr::kInit(1) | cccr::kCce(1));
  EXPECT_EQ(bus.get(kCan, can::txbrp::kOffset), 0U);
  bus.add(1);
  EXPECT_TRUE(bus.complained("FDCAN1", "with CCE = 1: lost"));
}

TEST(Fdcan, FlagsStayUntilTheyAreWrittenWithOne) {
  Bus bus;
  bus.start();
  bus.put(kCan, can::ie::kOffset, ir::kRf0n.mask());
  bus.feed(0x100);
  bus.chip.advance_us(500);
  EXPECT_TRUE(bus.chip.nvic.level(exception::kInterrupt0 + g4::interrupt::kFdcan1It0));
  (void)bus.take();
  bus.put(kCan, ir::kOffset, 0);
  EXPECT_TRUE(bus.chip.nvic.level(exception::kInterrupt0 + g4::interrupt::kFdcan1It0))
      << "an empty FIFO clears nothing";
  bus.put(kCan, ir::kOffset, ir::kRf0n.mask());
  EXPECT_FALSE(bus.chip.nvic.level(exception::kInterrupt0 + g4::interrupt::kFdcan1It0));
  EXPECT_FALSE(bus.pending(g4::interrupt::kFdcan1It1));
}

TEST(Fdcan, GroupsOfFlagsChooseTheirLine) {
  Bus bus;
  bus.start();
  bus.put(kCan, can::ie::kOffset, ir::kTc.mask() | ir::kRf0n.mask());
  bus.put(kCan, can::ils::kOffset, can::ils::kSmsg.mask());
  bus.send(0x100);
  bus.chip.advance_us(500);
  EXPECT_FALSE(bus.pending(g4::interrupt::kFdcan1It0));
  EXPECT_TRUE(bus.pending(g4::interrupt::kFdcan1It1));
  bus.feed(0x200);
  bus.chip.advance_us(500);
  EXPECT_TRUE(bus.pending(g4::interrupt::kFdcan1It0));
}

TEST(Fdcan, EventFifoNamesWhatWasSent) {
  Bus bus;
  bus.start();
  for (std::uint32_t i = 0; i < 4; ++i) {
    bus.send(0x100 + i, 2, (0x50 + i) << 24 | 1U << 23);
    bus.chip.advance_us(500);
  }
  const std::uint32_t status = bus.get(kCan, can::txefs::kOffset);
  EXPECT_EQ(can::txefs::kEffl.of(status), 3U);
  EXPECT_NE(status & can::txefs::kTefl.mask(), 0U) << "the fourth is lost";
  EXPECT_EQ(bus.get(kRam, kEvents), 0x100U << 18);
  EXPECT_EQ(bus.get(kRam, kEvents + 4) & 0xFFFF'0000, 0x50U << 24 | 1U << 22 | 2U << 16);
  bus.put(kCan, can::txefa::kOffset, 2);
  EXPECT_EQ(can::txefs::kEffl.of(bus.get(kCan, can::txefs::kOffset)), 0U);
  EXPECT_NO_COMPLAINTS(bus);
}

TEST(Fdcan, StampsAreTakenAtTheStartOfAFrameInBitTimes) {
  Bus bus;
  bus.configure();
  bus.put(kCan, can::tscc::kOffset, can::tscc::kTss(1));
  bus.leave();
  bus.put(kCan, can::tscv::kOffset, 0);
  bus.chip.advance_us(1'000);
  EXPECT_EQ(bus.get(kCan, can::tscv::kOffset), 500U);
  bus.feed(0x100);
  bus.chip.advance_us(500);
  EXPECT_NEAR(bus.get(kRam, kRx0 + 4) & 0xFFFF, 500, 1);
}

TEST(Fdcan, MessageRamEndsAtItsSize) {
  Bus bus;
  bus.configure();
  bus.put(kRam, kEnd - 4, 0x1234'5678);
  EXPECT_EQ(bus.get(kRam, kEnd - 4), 0x1234'5678U);
  EXPECT_NO_COMPLAINTS(bus);
  bus.put(kRam, kEnd, 1);
  EXPECT_TRUE(bus.complained("SRAMCAN", "write behind"));
  (void)bus.get(kRam, 0x800);
  EXPECT_TRUE(bus.complained("SRAMCAN", "read behind"));
}

TEST(Fdcan, MessageRamTakesWordsOnly) {
  Bus bus;
  bus.configure();
  std::uint32_t value = 0;
  (void)bus.chip.read(kRam + kTx, 1, value);
  EXPECT_TRUE(bus.complained("SRAMCAN", "do not take this width"));
}

TEST(Fdcan, MissingPartnerMakesItErrorPassiveAndNothingMore) {
  Bus bus;
  bus.start();
  bus.chip.fdcan1.line.partner = false;
  bus.send(0x100);
  bus.chip.advance_us(1'000'000);
  EXPECT_EQ(can::ecr::kTec.of(bus.get(kCan, can::ecr::kOffset)), 128U);
  EXPECT_EQ(bus.flags() & (ir::kEp.mask() | ir::kEw.mask() | ir::kBo.mask()), ir::kEp.mask() | ir::kEw.mask());
  EXPECT_EQ(bus.protocol(can::psr::kLec), 3U);
  bus.chip.fdcan1.line.partner = true;
  bus.chip.fdcan1.line.poke();
  bus.chip.advance_us(1'000);
  EXPECT_EQ(bus.ids, Ids{0x100});
}

TEST(Fdcan, ErrorCodeIsReadOnce) {
  Bus bus;
  bus.start();
  bus.chip.fdcan1.line.partner = false;
  bus.send(0x100);
  bus.chip.advance_us(300);
  EXPECT_EQ(bus.protocol(can::psr::kLec), 3U);
  EXPECT_EQ(bus.protocol(can::psr::kLec), 7U);
}

TEST(Fdcan, BusOffStaysUntilInitIsClearedAndTheBusWasQuiet) {
  Bus bus;
  bus.start();
  bus.chip.fdcan1.line.disturb(bus.chip.scheduler.now() + 20 * kMillisecond);
  bus.send(0x100);
  bus.chip.advance_us(20'000);
  EXPECT_EQ(bus.protocol(can::psr::kBo), 1U);
  EXPECT_NE(bus.flags() & ir::kBo.mask(), 0U);
  EXPECT_TRUE(bus.initialising()) << "hardware sets INIT";
  bus.chip.advance_us(2'000'000);
  EXPECT_EQ(bus.protocol(can::psr::kBo), 1U) << "bus-off stays for as long as software waits";
  bus.put(kCan, ir::kOffset, ir::kBo.mask());
  bus.put(kCan, cccr::kOffset, 0);
  bus.chip.advance_us(2'800);  // 129 times 11 bits of 2 us are 2 838 us
  EXPECT_EQ(bus.protocol(can::psr::kBo), 1U);
  EXPECT_EQ(bus.protocol(can::psr::kLec), 5U) << "recessive bits are seen";
  EXPECT_NEAR(can::ecr::kRec.of(bus.get(kCan, can::ecr::kOffset)), 127, 1);
  EXPECT_TRUE(bus.ids.empty());
  bus.chip.advance_us(50);
  EXPECT_EQ(bus.protocol(can::psr::kBo), 0U);
  EXPECT_NE(bus.flags() & ir::kBo.mask(), 0U) << "the flag tells both changes";
  EXPECT_EQ(bus.get(kCan, can::ecr::kOffset) & 0xFF, 0U);
  bus.chip.advance_us(1'000);
  EXPECT_EQ(bus.ids, Ids{0x100}) << "the request was kept";
  EXPECT_NO_COMPLAINTS(bus);
}

class Off : public Bus {
 public:
  Off() {
    start();
    chip.fdcan1.line.disturb(chip.scheduler.now() + 20 * kMillisecond);
    send(0x100);
    chip.advance_us(20'000);
  }
  void hold(bool on) {
    if (!on) return chip.fdcan1.line.release();
    chip.fdcan1.line.stuck_dominant = true;
  }
  void recover() { put(kCan, cccr::kOffset, 0); }
  [[nodiscard]] bool off() { return protocol(can::psr::kBo) == 1; }
};

TEST(Fdcan, BusOffDoesNotEndOnAHeldBus) {
  Off bus;
  bus.hold(true);
  bus.recover();
  bus.chip.advance_us(50'000);
  EXPECT_TRUE(bus.off());
  bus.hold(false);
  bus.chip.advance_us(2'800);
  EXPECT_TRUE(bus.off()) << "recessive bits count from the release on";
  bus.chip.advance_us(1'100);
  EXPECT_FALSE(bus.off());
}

TEST(Fdcan, BusThatIsHeldDuringTheRecoveryPutsItsEndOff) {
  Off bus;
  bus.recover();
  bus.chip.advance_us(1'000);
  bus.hold(true);
  bus.chip.advance_us(10'000);
  EXPECT_TRUE(bus.off());
  bus.hold(false);
  bus.chip.advance_us(5'000);
  EXPECT_FALSE(bus.off());
}

TEST(Fdcan, DisturbanceDuringTheRecoveryPutsItsEndOff) {
  Off bus;
  bus.recover();
  bus.chip.advance_us(1'000);
  bus.chip.fdcan1.line.disturb(bus.chip.scheduler.now() + kMillisecond);
  bus.chip.advance_us(2'500);
  EXPECT_TRUE(bus.off());
  bus.chip.advance_us(4'000);
  EXPECT_FALSE(bus.off());
}

TEST(Fdcan, PinsNeedTheirFunction) {
  for (const std::uint32_t function : {7U, 8U}) {
    Bus bus;
    bus.alternate({'A', 11}, function);
    bus.alternate({'A', 12}, function);
    bus.start();
    EXPECT_TRUE(bus.complained("FDCAN1", "PA11 is alternate function"));
    EXPECT_TRUE(bus.complained("FDCAN1", "PA12 is alternate function"));
    bus.send(0x100);
    bus.chip.advance_us(5'000);
    EXPECT_TRUE(bus.ids.empty());
  }
}

TEST(Fdcan, KernelClockMustRun) {
  Bus bus;
  bus.put(g4::rcc::kRcc, g4::rcc::ccipr::kOffset, g4::rcc::ccipr::kFdcansel(1));  // PLLQEN is off
  bus.start();
  EXPECT_TRUE(bus.complained("FDCAN1", "FDCANSEL selects does not run"));
  bus.send(0x100);
  bus.chip.advance_us(5'000);
  EXPECT_TRUE(bus.ids.empty());
}

TEST(Fdcan, RegistersNeedTheBusClock) {
  Bus bus;
  bus.clear(g4::rcc::kRcc, g4::rcc::apb1enr1::kOffset, g4::rcc::apb1enr1::kFdcanen.mask());
  EXPECT_EQ(bus.get(kCan, can::endn::kOffset), 0U);
  EXPECT_TRUE(bus.complained("FDCAN1", "without clock"));
  bus.put(kRam, 0, 1);
  EXPECT_TRUE(bus.complained("SRAMCAN", "without clock"));
  bus.set(g4::rcc::kRcc, g4::rcc::apb1enr1::kOffset, g4::rcc::apb1enr1::kFdcanen.mask());
  EXPECT_EQ(bus.get(kCan, can::endn::kOffset), 0x8765'4321U);
}

TEST(Fdcan, WrongRateIsAnErrorOnEveryFrame) {
  Bus bus;
  bus.configure();
  bus.put(kCan, can::nbtp::kOffset,
          can::nbtp::kNbrp(9) | can::nbtp::kNtseg1(12) | can::nbtp::kNtseg2(1) | can::nbtp::kNsjw(1));
  bus.leave();
  bus.feed(0x100);
  bus.chip.advance_us(1'000);
  EXPECT_EQ(bus.level(), 0U);
  EXPECT_GT(can::ecr::kRec.of(bus.get(kCan, can::ecr::kOffset)), 0U);
}

TEST(Fdcan, JumpLongerThanItsSegmentIsNoticed) {
  Bus bus;
  bus.configure();
  bus.put(kCan, can::nbtp::kOffset,
          can::nbtp::kNbrp(19) | can::nbtp::kNtseg1(12) | can::nbtp::kNtseg2(1) | can::nbtp::kNsjw(3));
  bus.leave();
  EXPECT_TRUE(bus.complained("FDCAN1", "longer than segment 2"));
}

}  // namespace
}  // namespace tetap::board
