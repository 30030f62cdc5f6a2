// SPDX-License-Identifier: Apache-2.0
// Blocks of the STM32G474 besides FDCAN: clocks, voltage range and wait states, pins, DMA with its multiplexer, serial
// port, SPI with FIFOs, encoders, watchdog, memory. Numbers: RM0440 and data sheet DS12288.
#include "sim_host/emulator/test/driven_g474.hpp"

#include <string>

namespace tetap::board {
namespace {

namespace rcc = g4::rcc;
namespace dma = g4::dma;
namespace usart = g4::usart;
namespace spi = g4::spi;
namespace tim = g4::tim;

constexpr std::uint32_t kRcc = rcc::kRcc;

TEST(G474Clock, StartsFromTheHsiAndReachesOneHundredAndSixty) {
  DrivenG474 board;
  EXPECT_EQ(board.chip.rcc.hclk_hz(), 16'000'000);
  EXPECT_EQ(board.get(kRcc, rcc::cr::kOffset), 0x500U);
  board.start_clocks();
  EXPECT_EQ(board.chip.rcc.hclk_hz(), 160'000'000);
  EXPECT_EQ(board.chip.clock.hz(), 160'000'000);
  EXPECT_EQ(board.chip.rcc.apb1_timer_hz(), 160'000'000);
  EXPECT_EQ(board.chip.rcc.fdcan_hz(), 160'000'000);
  EXPECT_NO_COMPLAINTS(board);
}

// RM0440, table of the wait states: 34 MHz each in boost, 30 MHz in range 1, 12 MHz in range 2.
TEST(G474Clock, WaitStatesFollowTheVoltageRange) {
  DrivenG474 few;
  few.start_clocks(3);
  EXPECT_TRUE(few.complained("RCC", "HCLK of 160000 kHz with too few flash wait states"));
  DrivenG474 board;
  board.open_gates();
  board.put(g4::flash::kFlash, g4::flash::acr::kOffset, 0x0004'0600);
  EXPECT_NO_COMPLAINTS(board);
  board.put(g4::pwr::kPwr, g4::pwr::cr1::kOffset, 2U << 9);  // range 2: 12 MHz without a wait state, 16 MHz are set
  EXPECT_TRUE(board.complained("RCC", "HCLK of 16000 kHz with too few flash wait states"));
}

TEST(G474Clock, AboveOneHundredAndFiftyNeedsTheBoost) {
  DrivenG474 board;
  board.start_clocks();
  board.put(g4::pwr::kPwr, g4::pwr::cr5::kOffset, g4::pwr::cr5::kR1mode.mask());
  EXPECT_TRUE(board.complained("RCC", "too fast for PWR_CR1.VOS and PWR_CR5.R1MODE"));
}

TEST(G474Clock, HighSpeedIsReachedInTwoSteps) {
  for (const bool early : {false, true}) {
    DrivenG474 board;
    board.open_gates();
    board.put(g4::pwr::kPwr, g4::pwr::cr5::kOffset, 0);
    board.put(g4::flash::kFlash, g4::flash::acr::kOffset, 0x0004'0604);
    board.start_pll();
    if (early) board.put(kRcc, rcc::cfgr::kOffset, rcc::cfgr::kHpre(8) | rcc::cfgr::kSw(3));
    board.put(kRcc, rcc::cfgr::kOffset, rcc::cfgr::kSw(3));
    EXPECT_TRUE(board.complained("RCC", early ? "within 1 us of the switch" : "divide the AHB by two")) << early;
  }
}

TEST(G474Clock, PllHasItsLimitsAndItsOutputsGates) {
  DrivenG474 board;
  board.set(kRcc, rcc::cr::kOffset, rcc::cr::kPllon.mask());
  EXPECT_TRUE(board.complained("RCC", "without a source"));
  board.clear(kRcc, rcc::cr::kOffset, rcc::cr::kPllon.mask());
  board.put(kRcc, rcc::pllcfgr::kOffset, rcc::pllcfgr::kPllsrc(2) | rcc::pllcfgr::kPllm(7) | rcc::pllcfgr::kPlln(20));
  board.set(kRcc, rcc::cr::kOffset, rcc::cr::kPllon.mask());
  EXPECT_TRUE(board.complained("RCC", "PLL input of 2000 kHz"));
  EXPECT_TRUE(board.complained("RCC", "PLL oscillator at 40000 kHz"));
  board.chip.advance_us(100);
  board.put(kRcc, rcc::cfgr::kOffset, rcc::cfgr::kSw(3));
  EXPECT_TRUE(board.complained("RCC", "not ready")) << "PLLREN is off";
  EXPECT_EQ(rcc::cfgr::kSws.of(board.get(kRcc, rcc::cfgr::kOffset)), 1U);
  board.set(kRcc, rcc::pllcfgr::kOffset, rcc::pllcfgr::kPllr(1));
  EXPECT_TRUE(board.complained("RCC", "while the PLL is on"));
}

TEST(G474Clock, DeadCrystalNeverBecomesReady) {
  DrivenG474 board({.oscillators = {.crystal = false}});
  board.set(kRcc, rcc::cr::kOffset, rcc::cr::kHseon.mask());
  board.chip.advance_us(1'000'000);
  EXPECT_EQ(board.get(kRcc, rcc::cr::kOffset) & rcc::cr::kHserdy.mask(), 0U);
  EXPECT_EQ(board.chip.rcc.fdcan_hz(), 0) << "FDCAN hangs on the HSE after reset";
}

TEST(G474Clock, ResetFlagsStayUntilTheyAreRemoved) {
  DrivenG474 board;
  board.chip.system_reset(ResetCause::kWatchdog);
  const std::uint32_t both = rcc::csr::kBorrstf.mask() | rcc::csr::kIwdgrstf.mask();
  EXPECT_EQ(board.get(kRcc, rcc::csr::kOffset) & both, both);
  board.set(kRcc, rcc::csr::kOffset, rcc::csr::kRmvf.mask());
  EXPECT_EQ(board.get(kRcc, rcc::csr::kOffset) & 0xFE00'0000, 0U);
}

TEST(G474Pins, AreAnalogAfterResetButForTheDebugPort) {
  DrivenG474 board;
  EXPECT_EQ(board.chip.pins.port('C').mode(8), GpioPort::Mode::kAnalog);
  EXPECT_EQ(board.chip.pins.port('B').mode(4), GpioPort::Mode::kAlternate);
  board.open_gates();
  board.mode({'C', 8}, 1);
  board.put(g4::gpio::kGpioc, g4::gpio::bsrr::kOffset, 1U << 8);
  EXPECT_TRUE(board.chip.pins.level({'C', 8}));
  board.put(g4::gpio::kGpioc, g4::gpio::brr::kOffset, 1U << 8);
  EXPECT_FALSE(board.chip.pins.level({'C', 8}));
  EXPECT_NO_COMPLAINTS(board);
}

TEST(G474Pins, PortsNeedTheirClockOnAhb2) {
  DrivenG474 board;
  board.mode({'C', 8}, 1);
  EXPECT_TRUE(board.complained("GPIOC", "without clock"));
}

TEST(G474ExternalInterrupt, DataReadyOfTheImuPends) {
  DrivenG474 board;
  board.open_gates();
  board.mode({'B', 0}, 0);
  board.put(g4::syscfg::kSyscfg, g4::syscfg::exticrx::kOffset, 1);
  board.set(g4::exti::kExti, g4::exti::imr1::kOffset, 1);
  board.set(g4::exti::kExti, g4::exti::rtsr1::kOffset, 1);
  board.chip.pins.drive({'B', 0}, true);
  EXPECT_TRUE(board.pending(g4::interrupt::kExti0));
  EXPECT_EQ(board.get(g4::exti::kExti, g4::exti::pr1::kOffset), 1U);
  board.put(g4::exti::kExti, g4::exti::pr1::kOffset, 1);
  EXPECT_FALSE(board.chip.nvic.level(exception::kInterrupt0 + g4::interrupt::kExti0));
  EXPECT_NO_COMPLAINTS(board);
}

constexpr std::uint32_t kPort = usart::kUsart1, kRing = 0x2000'1000;

class Serial : public DrivenG474 {
 public:
  explicit Serial(std::uint32_t function = 7) {
    start_clocks();
    alternate({'C', 4}, function);
    alternate({'C', 5}, function);
    put(kPort, usart::brr::kOffset, 1389);  // 160 MHz / 115 200
    put(kPort, usart::cr1::kOffset, usart::cr1::kUe.mask() | usart::cr1::kTe.mask() | usart::cr1::kRe.mask());
  }
  /// Channel `number` from 0, circular, from the receive data register.
  void start_ring(std::uint32_t size, std::uint32_t request = 24, std::uint32_t address = kRing,
                  std::uint32_t number = 0) {
    const std::uint32_t at = number * dma::ccrx::kStride;
    put(g4::dmamux::kDmamux, 4 * number, request);
    put(dma::kDma1, dma::cparx::kOffset + at, kPort + usart::rdr::kOffset);
    put(dma::kDma1, dma::cmarx::kOffset + at, address);
    put(dma::kDma1, dma::cndtrx::kOffset + at, size);
    put(dma::kDma1, dma::ccrx::kOffset + at,
        dma::ccrx::kMinc(1) | dma::ccrx::kCirc(1) | dma::ccrx::kTcie(1) | dma::ccrx::kEn(1));
    set(kPort, usart::cr3::kOffset, usart::cr3::kDmar.mask());
  }
  void feed(const std::string& bytes, std::int64_t baud = 115'200) {
    for (const char byte : bytes) {
      chip.usart1.arrive(static_cast<std::uint8_t>(byte), baud);
      chip.scheduler.advance(chip.scheduler.now() + periods(10, baud));
    }
  }
  [[nodiscard]] std::uint32_t left() { return get(dma::kDma1, dma::cndtrx::kOffset); }
  [[nodiscard]] std::uint32_t status() { return get(kPort, usart::isr::kOffset); }
  [[nodiscard]] char ring(std::uint32_t i) { return static_cast<char>(chip.memory.ram()[kRing + i - Memory::kRam]); }
};

TEST(G474Usart, RingTakesBytesAndCountsDown) {
  Serial board;
  board.start_ring(8);
  board.feed("abcde");
  EXPECT_EQ(board.left(), 3U);
  EXPECT_NE(board.get(dma::kDma1, dma::isr::kOffset) & dma::isr::kHtif1.mask(), 0U);
  board.feed("fgh");
  EXPECT_EQ(board.left(), 8U);
  EXPECT_TRUE(board.pending(g4::interrupt::kDma1Ch1));
  board.put(dma::kDma1, dma::ifcr::kOffset, 1);
  EXPECT_EQ(board.get(dma::kDma1, dma::isr::kOffset), 0U) << "CGIF1 clears all of the channel";
  board.feed("ijk");
  EXPECT_EQ(board.ring(0), 'i');
  EXPECT_EQ(board.ring(3), 'd');
  EXPECT_NO_COMPLAINTS(board);
}

TEST(G474Usart, OverrunStaysUntilIcrClearsIt) {
  Serial board;
  board.set(kPort, usart::cr1::kOffset, usart::cr1::kRxneie.mask());
  board.feed("xyz");
  EXPECT_TRUE(board.pending(g4::interrupt::kUsart1));
  EXPECT_EQ(board.get(kPort, usart::rdr::kOffset), static_cast<std::uint32_t>('x'));
  EXPECT_NE(board.status() & usart::isr::kOre.mask(), 0U) << "a read of RDR clears RXNE alone";
  EXPECT_TRUE(board.chip.nvic.level(exception::kInterrupt0 + g4::interrupt::kUsart1));
  board.put(kPort, usart::icr::kOffset, usart::icr::kOrecf.mask());
  EXPECT_EQ(board.status() & usart::isr::kOre.mask(), 0U);
  EXPECT_FALSE(board.chip.nvic.level(exception::kInterrupt0 + g4::interrupt::kUsart1));
}

TEST(G474Usart, SendsAtItsRateThroughItsPin) {
  Serial board;
  board.put(kPort, usart::tdr::kOffset, 'u');
  board.put(kPort, usart::tdr::kOffset, 'v');
  EXPECT_EQ(board.status() & usart::isr::kTxe.mask(), 0U);
  board.chip.advance_us(200);
  EXPECT_EQ(board.to_gnss, "uv");
  EXPECT_NE(board.status() & usart::isr::kTc.mask(), 0U);
  EXPECT_NO_COMPLAINTS(board);
}

TEST(G474Usart, MistakesOfItsSettingsAreNoticed) {
  Serial board;
  board.put(kPort, usart::brr::kOffset, 100);
  EXPECT_TRUE(board.complained("USART1", "BRR written while UE = 1"));
  board.put(kPort, usart::isr::kOffset, 0);
  EXPECT_TRUE(board.complained("USART1", "read-only"));
  board.set(kPort, usart::cr1::kOffset, usart::cr1::kFifoen.mask());
  EXPECT_TRUE(board.complained("USART1", "shape changed while UE = 1"));
}

TEST(G474Usart, WrongFunctionOfItsPinsIsNoticed) {
  Serial board(8);
  board.put(kPort, usart::tdr::kOffset, 'u');
  EXPECT_TRUE(board.complained("USART1", "PC4 is alternate function 8"));
  board.feed("a");
  EXPECT_TRUE(board.complained("USART1", "PC5 is alternate function 8"));
  board.chip.advance_us(200);
  EXPECT_EQ(board.to_gnss, "");
}

TEST(G474Dma, WrongRequestIsNoticedAndMovesNothing) {
  for (const std::uint32_t request : {0U, 25U, 26U}) {
    Serial board;
    board.start_ring(8, request);
    EXPECT_TRUE(board.complained("DMA1", request == 0 ? "is no modelled one" : "CPAR is not the register")) << request;
    board.feed("abc");
    EXPECT_EQ(board.left(), 8U);
  }
}

TEST(G474Dma, OneRequestForTwoChannelsIsNoticed) {
  Serial board;
  board.put(g4::dmamux::kDmamux, 0, 24);
  board.put(g4::dmamux::kDmamux, 4, 24);
  EXPECT_TRUE(board.complained("DMAMUX", "goes to two channels"));
}

TEST(G474Dma, MultiplexerNeedsItsClock) {
  Serial board;
  board.start_ring(8);
  board.clear(kRcc, rcc::ahb1enr::kOffset, rcc::ahb1enr::kDmamux1en.mask());
  board.feed("abc");
  EXPECT_EQ(board.left(), 8U);
}

TEST(G474Dma, MemoryThatIsNotThereIsNoticed) {
  for (const std::uint32_t address : {0x2002'0000U, 0x2001'FFFCU, 0x1000'0000U, 0x0800'0000U}) {
    Serial board;
    board.start_ring(8, 24, address);
    EXPECT_TRUE(board.complained("DMA1", "no memory that DMA reaches")) << address;
    EXPECT_NE(board.get(dma::kDma1, dma::isr::kOffset) & dma::isr::kTeif1.mask(), 0U);
    EXPECT_EQ(board.get(dma::kDma1, dma::ccrx::kOffset) & 1, 0U) << "the channel is off";
  }
}

TEST(G474Dma, ChannelThatIsOnTakesNoSettings) {
  Serial board;
  board.start_ring(8);
  board.put(dma::kDma1, dma::cndtrx::kOffset, 4);
  EXPECT_TRUE(board.complained("DMA1", "written while EN = 1"));
  EXPECT_EQ(board.left(), 8U);
}

constexpr std::uint32_t kSpi = spi::kSpi1;

class Imu : public DrivenG474 {
 public:
  explicit Imu(std::uint32_t cr2 = spi::cr2::kDs(7) | spi::cr2::kFrxth(1)) {
    start_clocks();
    for (const int pin : {5, 6, 7}) alternate({'A', pin}, 5);
    level({'A', 4}, true);
    mode({'A', 4}, 1);
    put(kSpi, spi::cr2::kOffset, cr2);
    put(kSpi, spi::cr1::kOffset,
        spi::cr1::kMstr(1) | spi::cr1::kSsm(1) | spi::cr1::kSsi(1) | spi::cr1::kBr(4) | spi::cr1::kCpol(1) |
            spi::cr1::kCpha(1) | spi::cr1::kSpe(1));
    level({'A', 4}, false);
  }
  void write_part(std::uint32_t value, int size) { (void)chip.write(kSpi + spi::dr::kOffset, size, value); }
  [[nodiscard]] std::uint32_t read_part(int size) {
    std::uint32_t value = 0;
    (void)chip.read(kSpi + spi::dr::kOffset, size, value);
    return value;
  }
  [[nodiscard]] std::uint32_t status() { return get(kSpi, spi::sr::kOffset); }
};

TEST(G474Spi, BytesGoInAndOut) {
  Imu board;
  for (const std::uint32_t out : {0x75U | 0x80U, 0U}) board.write_part(out, 1);
  board.chip.advance_us(10);
  EXPECT_EQ(spi::sr::kFrlvl.of(board.status()), 2U);
  (void)board.read_part(1);
  EXPECT_EQ(board.read_part(1), 0x47U) << "WHO_AM_I of the ICM-42688-P";
  EXPECT_EQ(board.status() & (spi::sr::kRxne.mask() | spi::sr::kBsy.mask()), 0U);
  EXPECT_NO_COMPLAINTS(board);
}

TEST(G474Spi, HalfWordAccessIsTwoFrames) {
  Imu board;
  board.write_part(0x0075U | 0x80U, 2);
  board.chip.advance_us(10);
  EXPECT_EQ(board.read_part(2) >> 8, 0x47U) << "the low byte is sent first";
  EXPECT_NO_COMPLAINTS(board);
}

TEST(G474Spi, ThresholdOfAHalfWordHidesASingleByte) {
  Imu board(spi::cr2::kDs(7));
  board.write_part(0xF5, 1);
  board.chip.advance_us(10);
  EXPECT_EQ(board.status() & spi::sr::kRxne.mask(), 0U);
  EXPECT_EQ(spi::sr::kFrlvl.of(board.status()), 1U);
  (void)board.read_part(2);
  EXPECT_TRUE(board.complained("SPI1", "DR read by 16 bits with 8 in the FIFO"));
}

TEST(G474Spi, FifthFrameIsAnOverrun) {
  Imu board;
  for (int i = 0; i < 5; ++i) {
    board.write_part(0xF5, 1);
    board.chip.advance_us(3);
  }
  EXPECT_NE(board.status() & spi::sr::kOvr.mask(), 0U);
  (void)board.read_part(1);
  (void)board.status();
  EXPECT_EQ(board.status() & spi::sr::kOvr.mask(), 0U) << "DR, then SR";
}

TEST(G474Spi, FullTransmitFifoIsNoticed) {
  Imu board;
  for (int i = 0; i < 5; ++i) board.write_part(0xF5, 1);
  EXPECT_TRUE(board.complained("SPI1", "DR written before TXE"));
}

TEST(G474Spi, PinsNeedTheirFunction) {
  Imu board;
  board.alternate({'A', 6}, 6);
  board.write_part(0xF5, 1);
  EXPECT_TRUE(board.complained("SPI1", "PA6 is alternate function 6"));
}

TEST(G474Spi, DmaMovesAPacketBothWays) {
  Imu board;
  const std::uint32_t out = 0x2000'2000, in = 0x2000'3000, second = dma::ccrx::kStride;
  const std::uint32_t words[] = {0xF5};
  EXPECT_TRUE(board.chip.memory.write_word(out, words[0]));
  board.put(g4::dmamux::kDmamux, 0, 10);
  board.put(g4::dmamux::kDmamux, 4, 11);
  for (const std::uint32_t at : {0U, second}) {
    board.put(dma::kDma1, dma::cparx::kOffset + at, kSpi + spi::dr::kOffset);
    board.put(dma::kDma1, dma::cmarx::kOffset + at, at == 0 ? in : out);
    board.put(dma::kDma1, dma::cndtrx::kOffset + at, 2);
    board.put(dma::kDma1, dma::ccrx::kOffset + at, dma::ccrx::kMinc(1) | dma::ccrx::kDir(at == 0 ? 0 : 1) | 1U);
  }
  board.set(kSpi, spi::cr2::kOffset, spi::cr2::kRxdmaen.mask());
  board.set(kSpi, spi::cr2::kOffset, spi::cr2::kTxdmaen.mask());
  board.chip.advance_us(10);
  EXPECT_EQ(std::to_integer<int>(board.chip.memory.ram()[in - Memory::kRam + 1]), 0x47);
  EXPECT_EQ(board.get(dma::kDma1, dma::cndtrx::kOffset), 0U);
  EXPECT_NO_COMPLAINTS(board);
}

class Wheels : public DrivenG474 {
 public:
  explicit Wheels(bool pull_down_off = true)
      : DrivenG474({}, {.left_edges = [this](Picoseconds) { return edges; },
                        .right_edges = [this](Picoseconds) { return edges; }}) {
    start_clocks();
    if (pull_down_off) set(g4::pwr::kPwr, g4::pwr::cr3::kOffset, g4::pwr::cr3::kUcpd1Dbdis.mask());
    for (const int pin : {0, 1}) alternate({'A', pin}, 1);
    for (const int pin : {4, 5}) alternate({'B', pin}, 2);
  }
  void start(std::uint32_t timer, std::uint32_t smcr = 3) {
    put(timer, tim::smcr::kOffset, smcr);
    put(timer, tim::ccmr1::kOffset, tim::ccmr1::kCc1s(1) | tim::ccmr1::kCc2s(1));
    put(timer, tim::cr1::kOffset, 1);
  }
  std::int64_t edges = 0;
};

TEST(G474Encoder, CountsBothWaysInBothWidths) {
  Wheels board;
  board.start(tim::kTim2);
  board.start(g4::tim::kTim3);
  EXPECT_EQ(board.get(g4::tim::kTim3, tim::arr::kOffset), 0xFFFFU);
  for (const std::int64_t at : {1, 70'000, -70'000}) {
    board.edges = at;
    EXPECT_EQ(board.get(tim::kTim2, tim::cnt::kOffset), static_cast<std::uint32_t>(at));
    EXPECT_EQ(board.get(g4::tim::kTim3, tim::cnt::kOffset), static_cast<std::uint32_t>(at) & 0xFFFF);
  }
  EXPECT_NO_COMPLAINTS(board);
}

TEST(G474Encoder, PullDownOfAnUnpoweredPortIsNoticed) {
  Wheels board(false);
  board.start(g4::tim::kTim3);
  EXPECT_TRUE(board.complained("PWR", "UCPD1_DBDIS is 0"));
}

TEST(G474Encoder, NewerModesAreNotTaken) {
  Wheels board;
  board.start(tim::kTim2, tim::smcr::kSms1.mask() | 3);
  EXPECT_TRUE(board.complained("TIM2", "SMCR above bit 15"));
}

TEST(G474Watchdog, ExpiresAtTheTimeThatItsOscillatorSets) {
  DrivenG474 board;
  board.put(g4::iwdg::kIwdg, g4::iwdg::kr::kOffset, 0x5555);
  board.put(g4::iwdg::kIwdg, g4::iwdg::pr::kOffset, 2);
  board.put(g4::iwdg::kIwdg, g4::iwdg::rlr::kOffset, 399);
  board.chip.advance_us(1'000);
  board.put(g4::iwdg::kIwdg, g4::iwdg::kr::kOffset, 0xCCCC);
  board.chip.advance_us(199'990);  // 400 * 16 / 32 kHz
  EXPECT_FALSE(board.chip.pending_reset.has_value());
  board.chip.advance_us(20);
  EXPECT_TRUE(board.chip.pending_reset.has_value());
  EXPECT_NO_COMPLAINTS(board);
}

TEST(G474Memory, CoreSeesTheCcmTwiceAndDmaOnce) {
  DrivenG474 board;
  EXPECT_TRUE(board.chip.memory.write_word(0x1000'0010, 0x1234'5678));
  std::uint32_t word = 0;
  EXPECT_TRUE(board.chip.memory.read_word(0x2001'8010, word));
  EXPECT_EQ(word, 0x1234'5678U);
  EXPECT_FALSE(board.chip.memory.write_word(0x2002'0000, 0));
  EXPECT_FALSE(board.chip.memory.write_word(0x1000'8000, 0));
  EXPECT_TRUE(board.chip.memory.writable(0x1000'0010, 4).empty());
  EXPECT_FALSE(board.chip.memory.readable(0x0807'FFFC, 4).empty());
  EXPECT_TRUE(board.chip.memory.readable(0x0808'0000, 4).empty());
}

}  // namespace
}  // namespace tetap::board
