// SPDX-License-Identifier: Apache-2.0
// bxCAN by its registers: order of transmission, FIFOs, filters, error states, bus-off, initialisation. RM0402 chapter
// bxCAN, ISO 11898-1. Frame lengths are held against frames whose stuffing is known by hand.
#include "sim_host/emulator/test/driven_chip.hpp"

#include <vector>

namespace tetap::board {
namespace {

namespace can = reg::can;
constexpr std::uint32_t kCan = can::kCan1;

struct Seen {
  Picoseconds time;
  std::uint32_t id;
  bool own;
};

class Bus : public DrivenChip {
 public:
  explicit Bus(std::uint32_t mcr = can::mcr::kTxfp.mask() | can::mcr::kAbom.mask(), const BoardOptions& options = {})
      : DrivenChip(options), mcr_(mcr) {
    start_clocks();
    alternate({'A', 11}, 9);
    alternate({'A', 12}, 9);
    chip.can1.line.on_frame = [this](Picoseconds time, const CanOffer& frame, bool own) {
      seen.push_back({time, frame.frame.id, own});
    };
  }
  /// 48 MHz / 6 / 16 quanta, sample point at 87.5 %.
  void start() {
    put(kCan, can::mcr::kOffset, mcr_ | can::mcr::kInrq.mask());
    chip.advance_us(20);
    EXPECT_NE(get(kCan, can::msr::kOffset) & can::msr::kInak.mask(), 0U);
    put(kCan, can::btr::kOffset, can::btr::kBrp(5) | can::btr::kTs1(12) | can::btr::kTs2(1));
    put(kCan, can::fxr1::kOffset, 0);
    put(kCan, can::fxr2::kOffset, 0);
    put(kCan, can::fs1r::kOffset, 1);
    put(kCan, can::fa1r::kOffset, 1);
    put(kCan, can::fmr::kOffset, 0);
    put(kCan, can::mcr::kOffset, mcr_);
    chip.advance_us(50);
  }
  [[nodiscard]] bool initialising() { return (get(kCan, can::msr::kOffset) & can::msr::kInak.mask()) != 0; }
  void request(std::uint32_t mailbox, std::uint32_t id, std::uint32_t size = 8) {
    const std::uint32_t at = mailbox * can::tixr::kStride;
    put(kCan, can::tdtxr::kOffset + at, size);
    put(kCan, can::tdlxr::kOffset + at, 0x0403'0201);
    put(kCan, can::tdhxr::kOffset + at, 0x0807'0605);
    put(kCan, can::tixr::kOffset + at, can::tixr::kStid(id) | can::tixr::kTxrq(1));
  }
  void feed(std::uint32_t id, int count = 1) {
    for (int i = 0; i < count; ++i) {
      chip.can1.line.send({.id = id + static_cast<std::uint32_t>(i), .size = 8}, chip.scheduler.now());
    }
  }
  [[nodiscard]] std::uint32_t error(hal::Field field) { return field.of(get(kCan, can::esr::kOffset)); }
  [[nodiscard]] std::uint32_t fifo() { return get(kCan, can::rf0r::kOffset); }
  [[nodiscard]] std::vector<std::uint32_t> ids() const {
    std::vector<std::uint32_t> all;
    for (const Seen& one : seen) all.push_back(one.id);
    return all;
  }

  std::vector<Seen> seen;

 private:
  std::uint32_t mcr_;
};

// Data 0x55 and identifier 0x555 have no run of five; the field between IDE and data length has.
TEST(CanFrames, LengthsCountStuffBits) {
  const base::CanFrame alternating{.id = 0x555, .size = 8, .data = {0x55, 0x55, 0x55, 0x55, 0x55, 0x55, 0x55, 0x55}};
  EXPECT_GE(frame_bits(alternating, false), 1 + 11 + 3 + 4 + 64 + 15 + 10);
  EXPECT_LE(frame_bits(alternating, false), 1 + 11 + 3 + 4 + 64 + 15 + 10 + 4);
  const base::CanFrame zeros{.id = 0, .size = 8};
  // SOF to the last data bit: 82 zeros but for the length's 1, and every fifth is followed by a stuff bit.
  EXPECT_GT(frame_bits(zeros, false), 108 + 15);
  EXPECT_LE(frame_bits(zeros, false), 108 + (34 + 64 - 1) / 4);
  const base::CanFrame extended{.id = 0x1555'5555, .extended = true};
  EXPECT_GE(frame_bits(extended, false), 64);
  EXPECT_LT(arbitration_key({.id = 0x100}, false), arbitration_key({.id = 0x100U << 18, .extended = true}, false));
  EXPECT_LT(arbitration_key({.id = 0x100}, false), arbitration_key({.id = 0x100}, true));
  EXPECT_LT(arbitration_key({.id = 0x100U << 18, .extended = true}, false), arbitration_key({.id = 0x101}, false));
}

TEST(Can, SendsAtTheBitRateAndReportsIt) {
  Bus bus;
  bus.start();
  EXPECT_EQ(bus.chip.can1.bit_rate(), 500'000);
  const Picoseconds begin = bus.chip.scheduler.now();
  bus.request(0, 0x123);
  EXPECT_EQ(bus.get(kCan, can::tsr::kOffset) & can::tsr::kTme0.mask(), 0U);
  bus.chip.advance_us(400);
  ASSERT_EQ(bus.ids(), std::vector<std::uint32_t>{0x123});
  const base::CanFrame frame{.id = 0x123, .size = 8, .data = {1, 2, 3, 4, 5, 6, 7, 8}};
  EXPECT_EQ(bus.seen[0].time - begin, frame_bits(frame, false) * 2 * kMicrosecond);
  EXPECT_TRUE(bus.seen[0].own);
  const std::uint32_t done = can::tsr::kRqcp0.mask() | can::tsr::kTxok0.mask() | can::tsr::kTme0.mask();
  EXPECT_EQ(bus.get(kCan, can::tsr::kOffset) & done, done);
  EXPECT_NO_COMPLAINTS(bus);
}

TEST(Can, ChronologicalOrderNeedsItsBit) {
  for (const bool chronological : {true, false}) {
    Bus bus(chronological ? can::mcr::kTxfp.mask() : 0);
    bus.start();
    bus.request(2, 0x300);
    bus.chip.advance_us(1);
    bus.request(1, 0x200);
    bus.request(0, 0x100);
    bus.chip.advance_us(1'000);
    const std::vector<std::uint32_t> by_time{0x300, 0x200, 0x100}, by_id{0x300, 0x100, 0x200};
    EXPECT_EQ(bus.ids(), chronological ? by_time : by_id) << "the first one is on the wire already";
  }
}

TEST(Can, EqualIdentifiersGoByTheNumberOfTheirMailboxWithoutTheBit) {
  for (const bool chronological : {true, false}) {
    Bus bus(chronological ? can::mcr::kTxfp.mask() : 0);
    bus.start();
    bus.feed(0x050);  // keeps the bus busy while the boxes are filled
    bus.chip.advance_us(10);
    bus.request(2, 0x100, 3);
    bus.request(1, 0x100, 2);
    bus.request(0, 0x100, 1);
    std::vector<std::size_t> sizes;
    bus.chip.can1.line.on_frame = [&](Picoseconds, const CanOffer& frame, bool own) {
      if (own) sizes.push_back(frame.frame.size);
    };
    bus.chip.advance_us(2'000);
    const std::vector<std::size_t> by_time{3, 2, 1}, by_number{1, 2, 3};
    EXPECT_EQ(sizes, chronological ? by_time : by_number);
  }
}

TEST(Can, LowerIdentifierOfAnotherNodeGoesFirst) {
  Bus bus;
  bus.start();
  bus.feed(0x500);
  bus.chip.advance_us(10);
  bus.request(0, 0x200);
  bus.feed(0x100);
  bus.feed(0x300);
  bus.chip.advance_us(2'000);
  EXPECT_EQ(bus.ids(), (std::vector<std::uint32_t>{0x500, 0x100, 0x200, 0x300}));
  EXPECT_NO_COMPLAINTS(bus);
}

TEST(Can, MailboxInUseTakesNothing) {
  Bus bus;
  bus.start();
  bus.request(0, 0x100);
  bus.request(0, 0x200);
  EXPECT_TRUE(bus.complained("CAN1", "written while it is pending"));
  bus.chip.advance_us(1'000);
  EXPECT_EQ(bus.ids(), std::vector<std::uint32_t>{0x100});
}

TEST(Can, AbortTakesAWaitingFrameBack) {
  Bus bus;
  bus.start();
  bus.request(0, 0x100);
  bus.chip.advance_us(5);
  bus.request(1, 0x101);
  bus.put(kCan, can::tsr::kOffset, can::tsr::kAbrq1.mask());
  bus.chip.advance_us(1'000);
  EXPECT_EQ(bus.ids(), std::vector<std::uint32_t>{0x100});
  const std::uint32_t tsr = bus.get(kCan, can::tsr::kOffset);
  EXPECT_NE(tsr & can::tsr::kRqcp1.mask(), 0U);
  EXPECT_EQ(tsr & can::tsr::kTxok1.mask(), 0U);
}

TEST(Can, FifoHoldsThreeAndTheFourthOverruns) {
  Bus bus;
  bus.start();
  bus.feed(0x100, 3);
  bus.chip.advance_us(1'000);
  EXPECT_EQ(can::rf0r::kFmp0.of(bus.fifo()), 3U);
  EXPECT_NE(bus.fifo() & can::rf0r::kFull0.mask(), 0U);
  EXPECT_EQ(bus.fifo() & can::rf0r::kFovr0.mask(), 0U);
  bus.feed(0x110);
  bus.chip.advance_us(1'000);
  EXPECT_NE(bus.fifo() & can::rf0r::kFovr0.mask(), 0U);
  std::vector<std::uint32_t> ids;
  for (int i = 0; i < 3; ++i) {
    ids.push_back(can::rixr::kStid.of(bus.get(kCan, can::rixr::kOffset)));
    bus.put(kCan, can::rf0r::kOffset, can::rf0r::kRfom0.mask());
  }
  EXPECT_EQ(ids, (std::vector<std::uint32_t>{0x100, 0x101, 0x110})) << "RFLM = 0: the newest one overwrites the last";
  EXPECT_EQ(can::rf0r::kFmp0.of(bus.fifo()), 0U);
  EXPECT_NO_COMPLAINTS(bus);
  bus.put(kCan, can::rf0r::kOffset, can::rf0r::kRfom0.mask());
  EXPECT_TRUE(bus.complained("CAN1", "empty FIFO"));
}

TEST(Can, LockedFifoLosesTheNewFrame) {
  Bus bus(can::mcr::kRflm.mask());
  bus.start();
  bus.feed(0x100, 4);
  bus.chip.advance_us(2'000);
  bus.put(kCan, can::rf0r::kOffset, can::rf0r::kRfom0.mask());
  bus.put(kCan, can::rf0r::kOffset, can::rf0r::kRfom0.mask());
  EXPECT_EQ(can::rixr::kStid.of(bus.get(kCan, can::rixr::kOffset)), 0x102U);
}

TEST(Can, ReceiveInterruptFollowsTheFifo) {
  Bus bus;
  bus.start();
  bus.put(kCan, can::ier::kOffset, can::ier::kFmpie0.mask());
  bus.feed(0x100);
  bus.chip.advance_us(500);
  EXPECT_TRUE(bus.chip.nvic.level(exception::kInterrupt0 + reg::interrupt::kCan1Rx0));
  bus.put(kCan, can::rf0r::kOffset, can::rf0r::kRfom0.mask());
  EXPECT_FALSE(bus.chip.nvic.level(exception::kInterrupt0 + reg::interrupt::kCan1Rx0));
}

TEST(Can, TransmitInterruptStaysUntilRequestCompleteIsCleared) {
  Bus bus;
  bus.start();
  bus.put(kCan, can::ier::kOffset, can::ier::kTmeie.mask());
  bus.request(1, 0x77);
  bus.chip.advance_us(500);
  EXPECT_TRUE(bus.chip.nvic.level(exception::kInterrupt0 + reg::interrupt::kCan1Tx));
  bus.put(kCan, can::tsr::kOffset, can::tsr::kRqcp1.mask());
  EXPECT_FALSE(bus.chip.nvic.level(exception::kInterrupt0 + reg::interrupt::kCan1Tx));
}

TEST(Can, FiltersByMaskAndList) {
  Bus bus;
  bus.start();
  bus.put(kCan, can::fmr::kOffset, 1);
  bus.put(kCan, can::fa1r::kOffset, 0);
  bus.put(kCan, can::fs1r::kOffset, 2);  // bank 0 16 bits, bank 1 32 bits
  bus.put(kCan, can::fm1r::kOffset, 2);  // bank 1 a list
  bus.put(kCan, can::ffa1r::kOffset, 2);
  bus.put(kCan, can::fxr1::kOffset, 0x700U << 5 << 16 | 0x300U << 5);  // mask above, identifier below
  bus.put(kCan, can::fxr2::kOffset, 0x7FFU << 5 << 16 | 0x123U << 5);
  bus.put(kCan, can::fxr1::kOffset + 8, 0x456U << 21);
  bus.put(kCan, can::fxr2::kOffset + 8, 0x1ABC'DEF0U << 3 | 4);
  bus.put(kCan, can::fa1r::kOffset, 3);
  bus.put(kCan, can::fmr::kOffset, 0);
  for (const std::uint32_t id : {0x3A5U, 0x123U, 0x124U, 0x456U}) bus.feed(id);
  bus.chip.can1.line.send({.id = 0x1ABC'DEF0, .extended = true, .size = 1}, bus.chip.scheduler.now());
  bus.chip.advance_us(3'000);
  EXPECT_EQ(can::rf0r::kFmp0.of(bus.fifo()), 2U);
  EXPECT_EQ(can::rf1r::kFmp1.of(bus.get(kCan, can::rf1r::kOffset)), 2U);
  EXPECT_EQ(can::rixr::kStid.of(bus.get(kCan, can::rixr::kOffset)), 0x123U) << "lower identifiers win the bus";
  EXPECT_EQ(can::rdtxr::kFmi.of(bus.get(kCan, can::rdtxr::kOffset)), 1U);
  EXPECT_NO_COMPLAINTS(bus);
  bus.put(kCan, can::fxr1::kOffset, 0);
  EXPECT_TRUE(bus.complained("CAN1", "filter bank written while it is active"));
}

TEST(Can, WithoutActiveFilterNothingArrives) {
  Bus bus;
  bus.start();
  bus.put(kCan, can::fa1r::kOffset, 0);
  bus.feed(0x100);
  bus.chip.advance_us(1'000);
  EXPECT_EQ(can::rf0r::kFmp0.of(bus.fifo()), 0U);
}

TEST(Can, WithoutPartnerItIsErrorPassiveAndTriesForEver) {
  Bus bus;
  bus.start();
  bus.chip.can1.line.partner = false;
  bus.request(0, 0x100);
  bus.chip.advance_us(3'000'000);
  EXPECT_EQ(bus.error(can::esr::kTec), 128U);
  EXPECT_EQ(bus.error(can::esr::kEpvf), 1U);
  EXPECT_EQ(bus.error(can::esr::kBoff), 0U);
  EXPECT_EQ(bus.error(can::esr::kLec), 3U) << "acknowledgement error";
  EXPECT_EQ(bus.get(kCan, can::tsr::kOffset) & can::tsr::kTme0.mask(), 0U) << "still waiting";
  EXPECT_TRUE(bus.seen.empty());
  bus.chip.can1.line.partner = true;
  bus.chip.advance_us(1'000);
  EXPECT_EQ(bus.ids(), std::vector<std::uint32_t>{0x100});
}

TEST(Can, BusOffComesAfterThirtyTwoErrorsAndEndsByItself) {
  Bus bus;
  bus.start();
  bus.put(kCan, can::ier::kOffset, can::ier::kBofie.mask() | can::ier::kErrie.mask());
  bus.chip.can1.line.disturb(bus.chip.scheduler.now() + 5 * kMillisecond);
  bus.request(0, 0x100);
  bus.chip.advance_us(4'900);
  EXPECT_EQ(bus.error(can::esr::kBoff), 1U);
  EXPECT_TRUE(bus.chip.nvic.level(exception::kInterrupt0 + reg::interrupt::kCan1Sce));
  // 128 x 11 recessive bits of 2 us begin where the disturbance ends.
  bus.chip.advance_us(100 + 2'800);
  EXPECT_EQ(bus.error(can::esr::kBoff), 1U);
  bus.chip.advance_us(20);
  EXPECT_EQ(bus.error(can::esr::kBoff), 0U);
  EXPECT_EQ(bus.error(can::esr::kTec), 0U);
  bus.chip.advance_us(1'000);
  EXPECT_EQ(bus.ids(), std::vector<std::uint32_t>{0x100}) << "the frame from before is still in its mailbox";
  EXPECT_NO_COMPLAINTS(bus);
}

TEST(Can, BusOffWithoutAbomWaitsForSoftware) {
  Bus bus(can::mcr::kTxfp.mask());
  bus.start();
  bus.chip.can1.line.disturb(bus.chip.scheduler.now() + 3 * kMillisecond);
  bus.request(0, 0x100);
  bus.chip.advance_us(1'000'000);
  EXPECT_EQ(bus.error(can::esr::kBoff), 1U);
  bus.put(kCan, can::mcr::kOffset, can::mcr::kTxfp.mask() | can::mcr::kInrq.mask());
  bus.chip.advance_us(100);
  bus.put(kCan, can::mcr::kOffset, can::mcr::kTxfp.mask());
  bus.chip.advance_us(2'700);
  EXPECT_EQ(bus.error(can::esr::kBoff), 1U);
  bus.chip.advance_us(400);
  EXPECT_EQ(bus.error(can::esr::kBoff), 0U);
}

TEST(Can, InitialisationNeverEndsWithoutItsReceivePin) {
  Bus bus;
  bus.alternate({'A', 11}, 8);
  bus.start();
  bus.chip.advance_us(1'000'000);
  EXPECT_TRUE(bus.initialising());
  EXPECT_TRUE(bus.complained("CAN1", "PA11 is alternate function 8"));
  Bus dominant;
  dominant.chip.can1.line.stuck_dominant = true;
  dominant.start();
  dominant.chip.advance_us(1'000'000);
  EXPECT_TRUE(dominant.initialising());
  EXPECT_NO_COMPLAINTS(dominant);
  // RM0402, "Normal mode": after 11 recessive bits in a row, 22 us at 500 kbit/s.
  dominant.chip.can1.line.release();
  dominant.chip.advance_us(21);
  EXPECT_TRUE(dominant.initialising());
  dominant.chip.advance_us(3);
  EXPECT_FALSE(dominant.initialising());
}

TEST(Can, SilentTransceiverIsBusOff) {
  Bus bus(0);
  bus.start();
  bus.mode({'C', 14}, 1);
  bus.level({'C', 14}, true);
  bus.request(0, 0x100);
  bus.chip.advance_us(100'000);
  EXPECT_TRUE(bus.seen.empty());
  EXPECT_EQ(bus.error(can::esr::kBoff), 1U);
}

// One per cent of error is beyond what a synchronisation jump of one quantum in sixteen corrects.
TEST(Can, HsiAtTheEndOfItsToleranceCannotTalk) {
  for (const std::int64_t hsi : {16'000'000, 16'160'000}) {
    Bus bus(0, {.oscillators = {.crystal = false, .hsi_hz = hsi}});
    // APB1 at the HSI's 16 MHz: BRP 2, 16 quanta.
    bus.put(reg::rcc::kRcc, reg::rcc::cfgr::kOffset, 0);
    bus.put(kCan, can::mcr::kOffset, can::mcr::kInrq.mask());
    bus.chip.advance_us(20);
    bus.put(kCan, can::btr::kOffset, can::btr::kBrp(1) | can::btr::kTs1(12) | can::btr::kTs2(1));
    bus.put(kCan, can::mcr::kOffset, 0);
    bus.chip.advance_us(50);
    bus.request(0, 0x100);
    bus.chip.advance_us(100'000);
    EXPECT_EQ(bus.seen.size(), hsi == 16'000'000 ? 1U : 0U);
    EXPECT_EQ(bus.error(can::esr::kBoff), hsi == 16'000'000 ? 0U : 1U);
  }
}

TEST(Can, BitTimingOutsideOfInitialisationIsIgnored) {
  Bus bus;
  bus.start();
  bus.put(kCan, can::btr::kOffset, 0);
  EXPECT_EQ(bus.chip.can1.bit_rate(), 500'000);
  EXPECT_TRUE(bus.complained("CAN1", "BTR written outside"));
}

TEST(Can, LoopBackReceivesItsOwnFrames) {
  Bus bus;
  bus.put(kCan, can::mcr::kOffset, can::mcr::kInrq.mask());
  bus.chip.advance_us(20);
  bus.put(kCan, can::btr::kOffset,
          can::btr::kBrp(5) | can::btr::kTs1(12) | can::btr::kTs2(1) | can::btr::kLbkm(1) | can::btr::kSilm(1));
  bus.put(kCan, can::fs1r::kOffset, 1);
  bus.put(kCan, can::fa1r::kOffset, 1);
  bus.put(kCan, can::fmr::kOffset, 0);
  bus.put(kCan, can::mcr::kOffset, 0);
  bus.chip.advance_us(50);
  bus.request(0, 0x321);
  bus.chip.advance_us(500);
  EXPECT_EQ(can::rixr::kStid.of(bus.get(kCan, can::rixr::kOffset)), 0x321U);
  EXPECT_TRUE(bus.seen.empty()) << "nothing reaches the bus";
}

}  // namespace
}  // namespace tetap::board
