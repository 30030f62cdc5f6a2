// SPDX-License-Identifier: Apache-2.0
// The parts of the STM32 port on the G4: what it shares with the F4 has the same registers, what differs has a block
// here that behaves as RM0440 has it. Offsets and bits are written down once more.
#include "hal/chip/stm32/boot_cause.hpp"
#include "hal/chip/stm32/clock_tree.hpp"
#include "hal/chip/stm32/dma_channel.hpp"
#include "hal/chip/stm32/pll_plan_g4.hpp"
#include "hal/chip/stm32/serial_output.hpp"
#include "hal/chip/stm32/serial_port.hpp"
#include "hal/chip/stm32/spi_master.hpp"

#include <gtest/gtest.h>

#include <array>
#include <deque>
#include <map>
#include <string>
#include <vector>

namespace tetap::hal::stm32 {
namespace {

namespace f4 = stm32f412;
namespace g474 = stm32g474;

// GPIO, IWDG and the timer's driver take the F4's header on both chips, USART, SPI and clock tree the F4's fields.
constexpr bool same(Field a, Field b) { return a.lsb == b.lsb && a.width == b.width; }
static_assert(f4::gpio::moder::kOffset == g474::gpio::moder::kOffset);
static_assert(f4::gpio::otyper::kOffset == g474::gpio::otyper::kOffset);
static_assert(f4::gpio::ospeedr::kOffset == g474::gpio::ospeedr::kOffset);
static_assert(f4::gpio::pupdr::kOffset == g474::gpio::pupdr::kOffset);
static_assert(f4::gpio::bsrr::kOffset == g474::gpio::bsrr::kOffset);
static_assert(f4::gpio::afrl::kOffset == g474::gpio::afrl::kOffset);
static_assert(f4::gpio::afrh::kOffset == g474::gpio::afrh::kOffset);
static_assert(same(f4::gpio::moder::kModer0, g474::gpio::moder::kModer0));
static_assert(same(f4::gpio::otyper::kOt0, g474::gpio::otyper::kOt0));
static_assert(same(f4::gpio::ospeedr::kOspeedr0, g474::gpio::ospeedr::kOspeedr0));
static_assert(same(f4::gpio::pupdr::kPupdr0, g474::gpio::pupdr::kPupdr0));
static_assert(same(f4::gpio::bsrr::kBr0, g474::gpio::bsrr::kBr0));
static_assert(same(f4::gpio::afrl::kAfrl0, g474::gpio::afrl::kAfrl0));
static_assert(same(f4::gpio::afrh::kAfrh8, g474::gpio::afrh::kAfrh8));
static_assert(f4::iwdg::kr::kOffset == g474::iwdg::kr::kOffset);
static_assert(f4::iwdg::pr::kOffset == g474::iwdg::pr::kOffset);
static_assert(f4::iwdg::rlr::kOffset == g474::iwdg::rlr::kOffset);
static_assert(f4::iwdg::sr::kOffset == g474::iwdg::sr::kOffset);
static_assert(same(f4::iwdg::rlr::kRl, g474::iwdg::rlr::kRl));
static_assert(same(f4::iwdg::sr::kPvu, g474::iwdg::sr::kPvu) && same(f4::iwdg::sr::kRvu, g474::iwdg::sr::kRvu));
static_assert(f4::tim::cr1::kOffset == g474::tim::cr1::kOffset);
static_assert(f4::tim::smcr::kOffset == g474::tim::smcr::kOffset);
static_assert(f4::tim::ccmr1_input::kOffset == g474::tim::ccmr1::kOffset);
static_assert(f4::tim::ccer::kOffset == g474::tim::ccer::kOffset);
static_assert(f4::tim::cnt::kOffset == g474::tim::cnt::kOffset);
static_assert(f4::tim::psc::kOffset == g474::tim::psc::kOffset);
static_assert(f4::tim::arr::kOffset == g474::tim::arr::kOffset);
static_assert(f4::tim::egr::kOffset == g474::tim::egr::kOffset);
static_assert(same(f4::tim::smcr::kSms, g474::tim::smcr::kSms));
static_assert(same(f4::tim::cr1::kCen, g474::tim::cr1::kCen) && same(f4::tim::egr::kUg, g474::tim::egr::kUg));
static_assert(same(f4::tim::ccmr1_input::kCc1s, g474::tim::ccmr1::kCc1s));
static_assert(same(f4::tim::ccmr1_input::kCc2s, g474::tim::ccmr1::kCc2s));
static_assert(same(f4::tim::ccmr1_input::kIc1f, g474::tim::ccmr1::kIc1f));
static_assert(same(f4::tim::ccmr1_input::kIc2f, g474::tim::ccmr1::kIc2f));
static_assert(f4::spi::cr1::kOffset == g474::spi::cr1::kOffset && f4::spi::cr2::kOffset == g474::spi::cr2::kOffset);
static_assert(f4::spi::sr::kOffset == g474::spi::sr::kOffset && f4::spi::dr::kOffset == g474::spi::dr::kOffset);
static_assert(same(f4::spi::cr1::kMstr, g474::spi::cr1::kMstr) && same(f4::spi::cr1::kBr, g474::spi::cr1::kBr));
static_assert(same(f4::spi::cr1::kCpol, g474::spi::cr1::kCpol) && same(f4::spi::cr1::kCpha, g474::spi::cr1::kCpha));
static_assert(same(f4::spi::cr1::kSsm, g474::spi::cr1::kSsm) && same(f4::spi::cr1::kSsi, g474::spi::cr1::kSsi));
static_assert(same(f4::spi::cr1::kSpe, g474::spi::cr1::kSpe) && same(f4::spi::sr::kModf, g474::spi::sr::kModf));
static_assert(same(f4::spi::sr::kRxne, g474::spi::sr::kRxne) && same(f4::spi::sr::kTxe, g474::spi::sr::kTxe));
static_assert(same(f4::spi::sr::kOvr, g474::spi::sr::kOvr) && same(f4::spi::sr::kBsy, g474::spi::sr::kBsy));
static_assert(same(f4::usart::cr1::kTe, g474::usart::cr1::kTe) && same(f4::usart::cr1::kRe, g474::usart::cr1::kRe));
static_assert(same(f4::usart::cr3::kDmar, g474::usart::cr3::kDmar));
static_assert(same(f4::usart::cr3::kDmat, g474::usart::cr3::kDmat));
static_assert(same(f4::usart::cr3::kEie, g474::usart::cr3::kEie));
static_assert(same(f4::usart::sr::kRxne, g474::usart::isr::kRxne) && same(f4::usart::sr::kTc, g474::usart::isr::kTc));
static_assert(same(f4::usart::sr::kTxe, g474::usart::isr::kTxe) && same(f4::usart::sr::kOre, g474::usart::isr::kOre));
static_assert(same(f4::usart::sr::kFe, g474::usart::isr::kFe) && same(f4::usart::sr::kNf, g474::usart::isr::kNf));
static_assert(f4::rcc::cr::kOffset == g474::rcc::cr::kOffset && f4::rcc::cfgr::kOffset == g474::rcc::cfgr::kOffset);
static_assert(same(f4::rcc::cr::kHseon, g474::rcc::cr::kHseon) && same(f4::rcc::cr::kHserdy, g474::rcc::cr::kHserdy));
static_assert(same(f4::rcc::cr::kHsebyp, g474::rcc::cr::kHsebyp) && same(f4::rcc::cr::kCsson, g474::rcc::cr::kCsson));
static_assert(same(f4::rcc::cr::kPllon, g474::rcc::cr::kPllon) && same(f4::rcc::cr::kPllrdy, g474::rcc::cr::kPllrdy));
static_assert(same(f4::rcc::cfgr::kSw, g474::rcc::cfgr::kSw) && same(f4::rcc::cfgr::kSws, g474::rcc::cfgr::kSws));
static_assert(f4::flash::acr::kOffset == g474::flash::acr::kOffset);
static_assert(same(f4::flash::acr::kPrften, g474::flash::acr::kPrften));
static_assert(same(f4::flash::acr::kIcen, g474::flash::acr::kIcen));
static_assert(same(f4::flash::acr::kDcen, g474::flash::acr::kDcen));

// Clocks.

struct Block {
  std::map<std::uint32_t, std::uint32_t> words;
  bool is_rcc = false, is_power = false, crystal = true, locks = true, regulates = true;
  Block *flash = nullptr, *pwr = nullptr;
  struct Switch {
    std::uint32_t wait_states, r1mode, range, divided;
    friend bool operator==(const Switch&, const Switch&) = default;
  };
  std::vector<Switch> onto_pll{};

  std::uint32_t read(std::uint32_t offset) {
    if (is_power && offset == 0x14) return regulates ? 0U : 1U << 10;  // VOSF
    std::uint32_t value = words[offset];
    if (!is_rcc) return value;
    if (offset == 0x00) {
      const bool from_crystal = (words[0x0C] & 3U) == 3U;
      value &= ~(1U << 10 | 1U << 17 | 1U << 25);
      value |= (value & 1U << 8) << 2;
      if (crystal) value |= (value & 1U << 16) << 1;
      if (locks && (!from_crystal || crystal)) value |= (value & 1U << 24) << 1;
    }
    if (offset == 0x08) value |= (value & 3U) << 2;
    return value;
  }
  void write(std::uint32_t offset, std::uint32_t value) {
    if (is_rcc && offset == 0x08 && (value & 3U) == 3U && (words[offset] & 3U) != 3U) {
      onto_pll.push_back({.wait_states = flash->words[0] & 15U,
                          .r1mode = pwr->words[0x80] >> 8 & 1U,
                          .range = pwr->words[0x00] >> 9 & 3U,
                          .divided = value >> 4 & 15U});
    }
    words[offset] = value;
  }
};
struct BlockRegisters {
  Block* block;
  [[nodiscard]] std::uint32_t read(std::uint32_t offset) const { return block->read(offset); }
  void write(std::uint32_t offset, std::uint32_t value) const { block->write(offset, value); }
};

constexpr G4PllPlan kPlan{.crystal_hz = 24'000'000, .core_hz = 160'000'000};
static_assert(kPlan.valid());

struct Chip {
  Block flash{}, pwr{.words = {{0x00, 0x200}, {0x80, 0x100}}, .is_power = true},
      rcc{.words = {{0x00, 0x63}, {0x08, 0x5}, {0x0C, 0x1000}}, .is_rcc = true, .flash = &flash, .pwr = &pwr};
  Clocks start() { return ClockTree<BlockRegisters>{{&rcc}, {&pwr}, {&flash}}.start(kPlan); }
  /// From PLLCFGR, as RM0440 has it: output R, which is enabled apart.
  [[nodiscard]] std::uint32_t pll_hz() {
    const std::uint32_t word = rcc.words[0x0C];
    if ((word >> 24 & 1U) == 0) return 0;
    const std::uint32_t input_hz = (word & 3U) == 3U ? 24'000'000 : (word & 3U) == 2U ? 16'000'000 : 0;
    return input_hz / ((word >> 4 & 15U) + 1) * (word >> 8 & 127U) / (((word >> 25 & 3U) + 1) * 2);
  }
};

TEST(ClockTreeG4, TheCrystalInBoostModeWithWaitStatesAndHalfTheClockAtTheSwitch) {
  Chip chip;
  const Clocks clocks = chip.start();
  EXPECT_EQ(clocks.source, ClockSource::kCrystal);
  EXPECT_EQ(chip.pll_hz(), 160'000'000U);
  EXPECT_EQ(clocks.core_hz, 160'000'000U);
  EXPECT_EQ(clocks.apb1_hz, 160'000'000U);
  EXPECT_EQ(chip.rcc.onto_pll, (std::vector<Block::Switch>{{.wait_states = 4, .r1mode = 0, .range = 1, .divided = 8}}));
  EXPECT_EQ(chip.rcc.words[0x08], 3U);             // the PLL, nothing divided
  EXPECT_NE(chip.rcc.words[0x00] & 1U << 19, 0U);  // the crystal is watched
}

TEST(ClockTreeG4, WithoutACrystalTheInternalOscillatorGivesTheSameClock) {
  Chip chip;
  chip.rcc.crystal = false;
  const Clocks clocks = chip.start();
  EXPECT_EQ(clocks.source, ClockSource::kInternal);
  EXPECT_EQ(chip.pll_hz(), 160'000'000U);
  EXPECT_EQ(clocks.core_hz, 160'000'000U);
  EXPECT_EQ(chip.rcc.words[0x00] & (1U << 16 | 1U << 19), 0U);
}

TEST(ClockTreeG4, APllOrARegulatorThatIsNeverReadyLeavesTheInternalOscillator) {
  for (const bool locks : {false, true}) {
    Chip chip;
    chip.rcc.locks = locks;
    chip.pwr.regulates = !locks;
    const Clocks clocks = chip.start();
    EXPECT_EQ(clocks.source, ClockSource::kInternalDirect);
    EXPECT_EQ(clocks.core_hz, 16'000'000U);
    EXPECT_EQ(chip.rcc.words[0x08] & 3U, 1U);
    EXPECT_TRUE(chip.rcc.onto_pll.empty());
  }
}

TEST(ClockTreeG4, PlansOutsideOfTheDataSheetAreInvalid) {
  EXPECT_TRUE((G4PllPlan{.crystal_hz = 8'000'000, .core_hz = 170'000'000}).valid());
  EXPECT_FALSE((G4PllPlan{.crystal_hz = 24'000'000, .core_hz = 172'000'000}).valid());
  EXPECT_FALSE((G4PllPlan{.crystal_hz = 24'000'000, .core_hz = 96'000'000}).valid());  // other wait states
  EXPECT_FALSE((G4PllPlan{.crystal_hz = 25'000'000, .core_hz = 160'000'000}).valid());
  EXPECT_FALSE((G4PllPlan{.crystal_hz = 52'000'000, .core_hz = 160'000'000}).valid());
}

TEST(BootCauseG4, TheMostParticularFlagDecides) {
  EXPECT_EQ(boot_cause(0x0C00'0000, kResetFlagsG4), BootCause::kPowerOn);   // reset value: BOR, PIN
  EXPECT_EQ(boot_cause(0x2400'0000, kResetFlagsG4), BootCause::kWatchdog);  // IWDG drives the pin, too
  EXPECT_EQ(boot_cause(0x4400'0000, kResetFlagsG4), BootCause::kWatchdog);
  EXPECT_EQ(boot_cause(0x1400'0000, kResetFlagsG4), BootCause::kSoftware);
  EXPECT_EQ(boot_cause(0x8400'0000, kResetFlagsG4), BootCause::kLowPower);
  EXPECT_EQ(boot_cause(0x0400'0000, kResetFlagsG4), BootCause::kPin);
  EXPECT_EQ(boot_cause(0, kResetFlagsG4), BootCause::kUnknown);
  Block block;
  block.words[0x94] = 0x2400'0001;
  EXPECT_EQ(take_boot_cause(BlockRegisters{&block}, kResetFlagsG4), BootCause::kWatchdog);
  EXPECT_EQ(block.words[0x94], 0x2480'0001U);  // RMVF set, the oscillator as it was
}

// An SPI with FIFOs: a byte put is a frame, a word two. RXNE asks for as many bytes as FRXTH says.
struct FifoSpi {
  std::map<std::uint32_t, std::uint32_t> words{{0x04, 0x700}};
  std::deque<std::uint8_t> received;
  std::vector<std::uint8_t> wire;

  void send(std::uint8_t byte) {
    EXPECT_EQ(words[0x04] >> 8 & 15U, 7U) << "eight bits";
    wire.push_back(byte);
    received.push_back(static_cast<std::uint8_t>(~byte));
  }
};
struct FifoSpiRegisters {
  FifoSpi* chip;
  [[nodiscard]] std::uint32_t read(std::uint32_t offset) const {
    const bool by_byte = (chip->words[0x04] >> 12 & 1U) != 0;
    if (offset == 0x08) return 2U | (chip->received.size() >= (by_byte ? 1U : 2U) ? 1U : 0U);
    return chip->words[offset];
  }
  void write(std::uint32_t offset, std::uint32_t value) const {
    if (offset == 0x0C) {
      chip->send(static_cast<std::uint8_t>(value));
      chip->send(static_cast<std::uint8_t>(value >> 8));
    }
    chip->words[offset] = value;
  }
  [[nodiscard]] std::uint8_t read_byte(std::uint32_t) const {
    if (chip->received.empty()) return 0;
    const std::uint8_t byte = chip->received.front();
    chip->received.pop_front();
    return byte;
  }
  void write_byte(std::uint32_t, std::uint8_t value) const { chip->send(value); }
};
struct Select {
  void clear() const {}
  void set() const {}
};

TEST(SpiG4, AByteIsAFrameInBothFifos) {
  FifoSpi chip;
  SpiMaster<FifoSpiRegisters, Select, SpiDataOfG4> spi_device{{&chip}, {}};
  spi_device.start(160'000'000, 8'000'000);
  EXPECT_EQ(160'000'000U >> ((chip.words[0x00] >> 3 & 7U) + 1), 5'000'000U);
  const std::array<std::uint8_t, 2> out{0x75, 0x12};
  std::array<std::uint8_t, 3> in{9, 9, 9};
  EXPECT_TRUE(spi_device.transfer(out, in));
  EXPECT_EQ(chip.wire, (std::vector<std::uint8_t>{0x75, 0x12, 0xFF, 0xFF, 0xFF}));
  EXPECT_EQ(in, (std::array<std::uint8_t, 3>{0, 0, 0}));
  EXPECT_TRUE(chip.received.empty());
}

// A USART with the two channels of DMA1 that DMAMUX gives its requests to.
class FakeLine {
 public:
  std::vector<std::uint8_t> sent;
  std::map<std::uint32_t, std::uint32_t> usart, dma, mux;
  std::uintptr_t memory = 0;  ///< anything near the port: DMA knows 32 bits of an address

  void arrive(std::uint8_t byte) {
    for (std::uint32_t i = 0; i < 8; ++i) {
      if (!serves(i, 24, 6) || (ccr(i) & 0x10U) != 0 || dma[0x10 + 20 * i] != kBase + 0x24) continue;
      *place(i) = byte;
      if (--dma[0x0C + 20 * i] > 0) continue;
      dma[0x0C + 20 * i] = (ccr(i) & 0x20U) != 0 ? sizes_[i] : 0;
      dma[0] |= 7U << 4 * i;
    }
  }
  void transmit() {
    for (std::uint32_t i = 0; i < 8; ++i) {
      if (!serves(i, 25, 7) || (ccr(i) & 0x10U) == 0 || dma[0x10 + 20 * i] != kBase + 0x28) continue;
      if (dma[0x0C + 20 * i] == 0) continue;
      sent.push_back(*place(i));
      if (--dma[0x0C + 20 * i] > 0) continue;
      dma[0] |= 7U << 4 * i;
      usart[0x1C] |= 0x40U;
    }
  }
  [[nodiscard]] bool round_interrupt() { return (dma[0] & 2U) != 0 && (ccr(0) & 2U) != 0; }

  void write(char block, std::uint32_t offset, std::uint32_t value) {
    if (block == 'm') mux[offset] = value;
    if (block == 'u') {
      if (offset == 0x20) usart[0x1C] &= ~(value & 0x4FU);
      usart[offset] = value;
    }
    if (block != 'd') return;
    if (offset == 0x04) {
      dma[0] &= ~value;
      return;
    }
    const std::uint32_t channel = (offset - 8) / 20, part = (offset - 8) % 20;
    if (part == 4) sizes_[channel] = value;
    EXPECT_TRUE(part == 0 || (ccr(channel) & 1U) == 0) << "written while the channel is on";
    dma[offset] = value;
  }
  std::uint32_t read(char block, std::uint32_t offset) { return block == 'u' ? usart[offset] : dma[offset]; }

  static constexpr std::uint32_t kBase = 0x4001'3800;

 private:
  std::uint32_t ccr(std::uint32_t channel) { return dma[8 + 20 * channel]; }
  bool serves(std::uint32_t channel, std::uint32_t request, std::uint32_t enable) {
    return (ccr(channel) & 1U) != 0 && (mux[4 * channel] & 127U) == request && (usart[0x08] >> enable & 1U) != 0 &&
           (usart[0x00] & 1U) != 0;
  }
  /// MINC: the next byte is behind the last one.
  std::uint8_t* place(std::uint32_t channel) {
    const std::uint32_t done = (ccr(channel) & 0x80U) != 0 ? sizes_[channel] - dma[0x0C + 20 * channel] : 0;
    return reinterpret_cast<std::uint8_t*>((memory & ~std::uintptr_t{0xFFFF'FFFF}) | (dma[0x14 + 20 * channel] + done));
  }
  std::map<std::uint32_t, std::uint32_t> sizes_;
};
struct LineRegisters {
  FakeLine* line;
  char block;
  [[nodiscard]] std::uint32_t read(std::uint32_t offset) const { return line->read(block, offset); }
  void write(std::uint32_t offset, std::uint32_t value) const { line->write(block, offset, value); }
};
struct NoLock {
  NoLock() {}
  ~NoLock() {}
};

class SerialPortG4Test : public testing::Test {
 protected:
  using Port = SerialPort<LineRegisters, NoLock, 64, 16, DmaChannel<LineRegisters>, UsartOfG4>;

  SerialPortG4Test() {
    line.memory = reinterpret_cast<std::uintptr_t>(&port);
    port.start(160'000'000, 38'400);
  }
  std::vector<std::uint8_t> read() {
    std::vector<std::uint8_t> bytes(17);
    bytes.resize(port.read(bytes));
    return bytes;
  }

  FakeLine line;
  Port port{{&line, 'u'}, FakeLine::kBase, {{&line, 'd'}, {&line, 'm'}, 0, 24}, {{&line, 'd'}, {&line, 'm'}, 1, 25}};
};

TEST_F(SerialPortG4Test, EveryByteOnceInOrderExactlyAtTheEndOfTheRing) {
  EXPECT_EQ(line.usart[0x0C], 4'167U);
  std::uint8_t next_in = 0, next_out = 0;
  for (int i = 0; i < 1'000; ++i) {
    for (int k = i % 5 == 0 ? 64 : i % 64; k > 0; --k) {
      line.arrive(next_in++);
      if (line.round_interrupt()) port.on_dma_interrupt();
    }
    for (auto bytes = read(); !bytes.empty(); bytes = read()) {
      for (const std::uint8_t byte : bytes) ASSERT_EQ(byte, next_out++);
    }
    ASSERT_EQ(next_out, next_in);
  }
  EXPECT_EQ(port.faults().lapped, 0U);
}

TEST_F(SerialPortG4Test, OneMessageAtATimeAndABaudRateBehindIt) {
  const std::string text = "0123456789abcdefXYZ";
  const std::vector<std::uint8_t> message(text.begin(), text.end());
  EXPECT_EQ(port.write(message), 16U);
  EXPECT_EQ(port.write(std::span(message).subspan(16)), 0U);
  port.set_baud(115'200);
  for (int i = 0; i < 16; ++i) {
    EXPECT_EQ(line.usart[0x0C], 4'167U);
    line.transmit();
  }
  EXPECT_TRUE(read().empty());
  EXPECT_EQ(line.usart[0x0C], 1'389U);
  EXPECT_EQ(port.write(std::span(message).subspan(16)), 3U);
  for (int i = 0; i < 5; ++i) line.transmit();
  EXPECT_EQ(std::string(line.sent.begin(), line.sent.end()), text);
}

// The round's interrupt is still pending when the ring begins anew: it would count a round of the new ring.
TEST_F(SerialPortG4Test, RingBeginsWithoutTheFlagsOfTheLastOne) {
  for (int i = 0; i < 64; ++i) line.arrive(0);
  ASSERT_TRUE(line.round_interrupt());
  port.set_baud(115'200);
  EXPECT_FALSE(line.round_interrupt());
  EXPECT_TRUE(read().empty());
  line.arrive(7);
  EXPECT_EQ(read(), std::vector<std::uint8_t>{7});
}

TEST_F(SerialPortG4Test, DamageIsCountedAndCleared) {
  for (const std::uint32_t bit : {8U, 2U, 4U, 0U}) {
    line.usart[0x1C] |= bit;
    port.on_error_interrupt();
    EXPECT_EQ(line.usart[0x1C] & 15U, 0U) << "a flag that stays keeps the core in the handler";
  }
  EXPECT_EQ(port.faults().overrun, 1U);
  EXPECT_EQ(port.faults().framing, 2U);
}

TEST(SerialOutputG4, WritesTheTransmitRegister) {
  FakeLine line;
  line.usart[0x1C] = 0x80;
  SerialOutput<LineRegisters, 8, UsartOfG4> console{{&line, 'u'}};
  console.start(160'000'000, 115'200);
  EXPECT_EQ(line.usart[0x00], 9U);  // UE and TE
  EXPECT_EQ(line.usart[0x0C], 1'389U);
  console.print("a");
  console.drain();
  EXPECT_EQ(line.usart[0x28], static_cast<std::uint32_t>('a'));
}

}  // namespace
}  // namespace tetap::hal::stm32
