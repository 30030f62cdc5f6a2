// SPDX-License-Identifier: Apache-2.0
// Nucleo-G474RE (MB1367): STM32G474RE with an ICM-42688-P, a CAN transceiver, a GNSS receiver and encoders on its
// connectors. Pins: UM2505; alternate functions: data sheet DS12288, table "Alternate function". PB8 is BOOT0, which a
// transceiver would hold high, so CAN is on PA11 and PA12. Nobody has run this port on the board.
#pragma once

#include "hal/board.hpp"
#include "hal/chip/arm/cortex_m4.hpp"
#include "hal/chip/arm/interrupt_lock.hpp"
#include "hal/chip/arm/nvic.hpp"
#include "hal/chip/arm/stored_fault.hpp"
#include "hal/chip/arm/systick_clock.hpp"
#include "hal/chip/stm32/boot_cause.hpp"
#include "hal/chip/stm32/clock_tree_g4.hpp"
#include "hal/chip/stm32/dma_channel.hpp"
#include "hal/chip/stm32/encoder_timer.hpp"
#include "hal/chip/stm32/fdcan_controller.hpp"
#include "hal/chip/stm32/gpio.hpp"
#include "hal/chip/stm32/serial_output.hpp"
#include "hal/chip/stm32/serial_port.hpp"
#include "hal/chip/stm32/spi_master.hpp"
#include "hal/chip/stm32/watchdog.hpp"
#include "hal/chip/support/image.hpp"
#include "hal/chip/support/mmio.hpp"
#include "hal/chip/support/text.hpp"

#include <array>
#include <cstdint>

namespace tetap::hal::nucleo_g474re {

namespace chip = stm32g474;
using stm32::Pin, stm32::PinMode, stm32::PinPull, stm32::PinSpeed, stm32::PinSetup;

// Settings that an owner may want to change.

inline constexpr std::uint32_t kCanBitRate = 500'000;
inline constexpr std::uint32_t kConsoleBaud = 115'200;
/// Until a driver sets another one; the rate of new u-blox receivers.
inline constexpr std::uint32_t kGnssBaud = 38'400;
/// A third of what the sensor takes: it hangs on loose wires.
inline constexpr std::uint32_t kMostImuClock_hz = 8'000'000;

// Pins.

inline constexpr Pin kImuSelect{chip::gpio::kGpioa, 4};
/// A diode of one's own: the board's, LD2, hangs at PA5, which is SCK.
inline constexpr Pin kLed{chip::gpio::kGpioc, 8};

namespace detail {
constexpr Pin pa(std::uint8_t number) { return {chip::gpio::kGpioa, number}; }
constexpr Pin pb(std::uint8_t number) { return {chip::gpio::kGpiob, number}; }
constexpr Pin pc(std::uint8_t number) { return {chip::gpio::kGpioc, number}; }
constexpr PinSetup function(Pin pin, std::uint8_t alternate, PinPull pull = PinPull::kNone) {
  return {.pin = pin, .mode = PinMode::kAlternate, .alternate = alternate, .pull = pull, .speed = PinSpeed::kMedium};
}
constexpr PinSetup output(Pin pin, bool high) { return {.pin = pin, .mode = PinMode::kOutput, .high = high}; }
}  // namespace detail

inline constexpr std::array kPins{
    detail::function(detail::pa(0), 1, PinPull::kUp),   // TIM2_CH1: left encoder, A
    detail::function(detail::pa(1), 1, PinPull::kUp),   // TIM2_CH2: left encoder, B
    detail::function(detail::pb(4), 2, PinPull::kUp),   // TIM3_CH1: right encoder, A
    detail::function(detail::pb(5), 2, PinPull::kUp),   // TIM3_CH2: right encoder, B
    detail::function(detail::pa(2), 7),                 // USART2_TX: console
    detail::output(kImuSelect, true),                   //
    detail::function(detail::pa(5), 5),                 // SPI1_SCK
    detail::function(detail::pa(6), 5, PinPull::kUp),   // SPI1_MISO: 0xFF without a chip
    detail::function(detail::pa(7), 5),                 // SPI1_MOSI
    detail::function(detail::pc(4), 7),                 // USART1_TX: GNSS
    detail::function(detail::pc(5), 7, PinPull::kUp),   // USART1_RX
    detail::function(detail::pa(11), 9, PinPull::kUp),  // FDCAN1_RX
    detail::function(detail::pa(12), 9),                // FDCAN1_TX
    detail::output(kLed, false),                        //
};
static_assert(stm32::pins_distinct(kPins));

// Clocks and times.

inline constexpr stm32::g4::PllPlan kPll{.crystal_hz = 24'000'000, .core_hz = 160'000'000};
static_assert(kPll.valid());

/// At APB1's clock with the PLL, and at the internal oscillator's without.
inline constexpr stm32::CanBitTiming kCanTiming =
    stm32::can_bit_timing(kPll.core_hz, kCanBitRate, stm32::kFdcanTimingLimits);
inline constexpr stm32::CanBitTiming kSlowCanTiming =
    stm32::can_bit_timing(stm32::g4::PllPlan::kInternal_hz, kCanBitRate, stm32::kFdcanTimingLimits);

/// 136 ms with the fastest oscillator, 377 ms with the slowest.
inline constexpr stm32::WatchdogTime kWatchdogTime = stm32::watchdog_time(200'000);
/// A poll with a tick in it, as GnssBoard allows.
inline constexpr std::uint32_t kLongestPoll_us = 20'000;
static_assert(kWatchdogTime.shortest_us() / 2 >= kLongestPoll_us, "kicked twice before the fastest oscillator is due");

using SystemClock = SysTickClock<Mmio>;
using GnssPort = stm32::SerialPort<Mmio, InterruptLock, 2048, 256, stm32::DmaChannel<Mmio>, stm32::UsartOfG4>;
static_assert(2048 >= 921'600 / 10 * kLongestPoll_us / 1'000'000, "the ring outlasts a poll at every baud rate");

inline constexpr Mmio kSystem{cortex_m4::kSystemControlSpace};
/// DMA1: channel 1 receives for USART1, channel 2 sends; the requests of DMAMUX: RM0440, table "DMAMUX: assignment of
/// multiplexer inputs to resources".
inline constexpr std::uint32_t kGnssReceiveChannel = 0, kGnssTransmitChannel = 1;
inline constexpr std::uint32_t kUsart1ReceiveRequest = 24, kUsart1TransmitRequest = 25;

/// Interrupts that the board uses; Board::on_interrupt() serves them.
inline constexpr std::array kInterrupts{chip::interrupt::kFdcan1It0, chip::interrupt::kFdcan1It1,
                                        chip::interrupt::kUsart1, chip::interrupt::kDma1Ch1};
inline constexpr int kLastInterrupt = chip::interrupt::kUsart1;

struct Board {
  /// Everything but the bus and the receiver, which start_sensors() starts. `stored`: what a fault handler may have
  /// left; `filter`: the frames that the node takes.
  [[gnu::noinline]] Board(StoredFault& stored, const Acceptance& filter) : filter_{filter} {
    running = this;
    boot_.cause = stm32::take_boot_cause(Mmio{chip::rcc::kRcc}, stm32::kResetFlagsG4);
    if (const auto fault = stored.take(); fault && boot_.cause == BootCause::kSoftware) {
      boot_.cause = BootCause::kCpuFault;
      boot_.fault = *fault;
    }
    clocks_ =
        stm32::g4::ClockTree<Mmio>{Mmio{chip::rcc::kRcc}, Mmio{chip::pwr::kPwr}, Mmio{chip::flash::kFlash}}.start(kPll);
    boot_.fallback_clock = clocks_.source != stm32::ClockSource::kCrystal;
    power_blocks();
    for (const PinSetup& pin : kPins) stm32::set_up(Mmio{pin.pin.port}, pin);
    kLed.set();
    Nvic<Mmio>{kSystem}.set_up_exceptions();
    time_.start(clocks_.core_hz);
    console_.start(clocks_.apb1_hz, kConsoleBaud);
    imu.start(clocks_.apb2_hz, kMostImuClock_hz);
    left_encoder.start();
    right_encoder.start();
    print_start();
  }
  Board(const Board&) = delete;  // handlers hold its address
  Board& operator=(const Board&) = delete;

  /// Joins the bus and opens the receiver's line: not before the self-check, which outlasts their rings.
  void start_sensors() {
    console_.finish();
    gnss.start(clocks_.apb2_hz, kGnssBaud);
    can.start({.timing = clocks_.source == stm32::ClockSource::kInternalDirect ? kSlowCanTiming : kCanTiming,
               .filter = filter_});
    for (const int interrupt : kInterrupts) Nvic<Mmio>{kSystem}.enable(interrupt);
    kLed.clear();
  }

  [[nodiscard]] base::Micros now() const { return time_.now(); }

  /// Sleeps until an interrupt. One that comes between the look and WFI wakes the core, masked as it is.
  void idle() {
    console_.drain();
    show_state();
    const InterruptLock lock;
    if (!can.has_received()) asm volatile("dsb\nwfi" ::: "memory");
  }

  void start_watchdog() {
    if (!watchdog_.start(kWatchdogTime)) print("tetap: the watchdog did not take its time\n");
  }
  void kick() const { watchdog_.kick(); }

  [[nodiscard]] const BootReport& boot() const { return boot_; }
  [[nodiscard]] static StackUse stack() { return stack_use(); }
  void print(const char* text) const { console_.print(text); }

  /// SysTick and the interrupts of kInterrupts, by the exception's number.
  void on_interrupt(std::uint32_t exception) {
    constexpr int kFirst = 16, kSysTick = 15;
    switch (static_cast<int>(exception)) {
      case kSysTick:
        return time_.on_interrupt();
      case kFirst + chip::interrupt::kFdcan1It0:
        return can.on_receive_interrupt();
      case kFirst + chip::interrupt::kFdcan1It1:
        return can.on_transmit_interrupt();
      case kFirst + chip::interrupt::kUsart1:
        return gnss.on_error_interrupt();
      case kFirst + chip::interrupt::kDma1Ch1:
        return gnss.on_dma_interrupt();
      default:
        return;
    }
  }

  static inline constinit Board* running = nullptr;  ///< the one whose interrupts are on

 private:
  /// Clocks of the blocks in use; each is reset, whatever a boot loader left. SYSCFG stays off: no pin interrupts.
  static void power_blocks() {
    namespace rcc = chip::rcc;
    constexpr Mmio kRcc{rcc::kRcc};
    const auto start = [&kRcc](std::uint32_t enable, std::uint32_t enabled, std::uint32_t reset, std::uint32_t held) {
      set_bits(kRcc, enable, enabled);
      kRcc.write(reset, held);
      kRcc.write(reset, 0);
      static_cast<void>(kRcc.read(reset));  // "delay after an RCC peripheral clock enabling": two clocks of the bus
    };
    set_bits(kRcc, rcc::ahb2enr::kOffset,
             rcc::ahb2enr::kGpioaen.mask() | rcc::ahb2enr::kGpioben.mask() | rcc::ahb2enr::kGpiocen.mask());
    // FDCAN counts the clock of APB1, instead of the crystal's, which may be missing.
    constexpr std::uint32_t kFromApb1 = 2;
    set_bits(kRcc, rcc::ccipr::kOffset, rcc::ccipr::kFdcansel(kFromApb1));
    start(rcc::ahb1enr::kOffset, rcc::ahb1enr::kDma1en.mask() | rcc::ahb1enr::kDmamux1en.mask(), rcc::ahb1rstr::kOffset,
          rcc::ahb1rstr::kDma1rst.mask() | rcc::ahb1rstr::kDmamux1rst.mask());
    start(rcc::apb1enr1::kOffset,
          rcc::apb1enr1::kTim2en.mask() | rcc::apb1enr1::kTim3en.mask() | rcc::apb1enr1::kUsart2en.mask() |
              rcc::apb1enr1::kFdcanen.mask(),
          rcc::apb1rstr1::kOffset,
          rcc::apb1rstr1::kTim2rst.mask() | rcc::apb1rstr1::kTim3rst.mask() | rcc::apb1rstr1::kUsart2rst.mask() |
              rcc::apb1rstr1::kFdcanrst.mask());
    start(rcc::apb2enr::kOffset, rcc::apb2enr::kSpi1en.mask() | rcc::apb2enr::kUsart1en.mask(), rcc::apb2rstr::kOffset,
          rcc::apb2rstr::kSpi1rst.mask() | rcc::apb2rstr::kUsart1rst.mask());
    // After a reset PB4, an encoder's input here, has the pull-down of a USB-C plug. The clock tree has enabled PWR.
    set_bits(Mmio{chip::pwr::kPwr}, chip::pwr::cr3::kOffset, chip::pwr::cr3::kUcpd1Dbdis.mask());
  }

  [[gnu::cold, gnu::noinline]] void print_start() {
    print("tetap: nucleo_g474re up");
    if (boot_.fallback_clock) print(", no crystal: the internal oscillator");
    print("\n");
    if (boot_.cause == BootCause::kWatchdog) print("tetap: the watchdog ended the last run\n");
    if (boot_.cause != BootCause::kCpuFault) return;
    Text<> line;
    line.add("tetap: a fault ended the last run: kind ").dec(static_cast<std::uint32_t>(boot_.fault.fault));
    line.add(" at ").hex(boot_.fault.program_counter).add(", address ").hex(boot_.fault.address);
    print(line.add(", status ").hex(boot_.fault.status).add('\n').c_str());
  }

  /// The diode blinks once a second while the node is on the bus, and lights while it is not; a change is one line, and
  /// so is a bus that cannot be joined.
  void show_state() {
    const bool on_bus = can.state() == stm32::CanState::kOnBus;
    const std::uint32_t failures = can.faults().bus_off;
    if (failures != failures_shown_) print("tetap: can: off the bus\n");
    if (on_bus && !was_on_bus_) print("tetap: can: on the bus\n");
    was_on_bus_ = on_bus;
    failures_shown_ = failures;
    const base::Micros time = now();
    if (time < next_blink_) return;
    next_blink_ = time + base::Micros{500'000};
    light_ = !light_ || !on_bus;
    (light_ ? kLed.set() : kLed.clear());
    const bool passive = on_bus && can.error_passive();
    if (passive && !was_passive_) print("tetap: can: nobody acknowledges, or the bus is disturbed\n");
    was_passive_ = passive;
  }

  Acceptance filter_;
  BootReport boot_{};
  stm32::Clocks clocks_{};
  bool was_on_bus_ = false;
  std::uint32_t failures_shown_ = 0;  ///< count of CanFaults::bus_off
  bool was_passive_ = false;
  bool light_ = false;
  base::Micros next_blink_{};
  SystemClock time_{kSystem};
  mutable stm32::SerialOutput<Mmio, 512, stm32::UsartOfG4> console_{
      Mmio{chip::usart::kUsart2}};  ///< text on its way is no state
  stm32::Watchdog<Mmio> watchdog_{Mmio{chip::iwdg::kIwdg}};

 public:
  stm32::FdcanController<Mmio, SystemClock, InterruptLock> can{Mmio{chip::fdcan::kFdcan1}, Mmio{chip::fdcan::kFdcan},
                                                               time_};
  stm32::SpiMaster<Mmio, Pin, stm32::SpiDataOfG4> imu{Mmio{chip::spi::kSpi1}, kImuSelect};
  stm32::EncoderTimer<Mmio, std::uint32_t> left_encoder{Mmio{chip::tim::kTim2}};
  stm32::EncoderTimer<Mmio, std::uint16_t> right_encoder{Mmio{chip::tim::kTim3}};
  GnssPort gnss{Mmio{chip::usart::kUsart1},
                chip::usart::kUsart1,
                {Mmio{chip::dma::kDma1}, Mmio{chip::dmamux::kDmamux}, kGnssReceiveChannel, kUsart1ReceiveRequest},
                {Mmio{chip::dma::kDma1}, Mmio{chip::dmamux::kDmamux}, kGnssTransmitChannel, kUsart1TransmitRequest}};
};

static_assert(hal::SensorBoard<Board> && hal::IdleBoard<Board> && hal::WatchdogBoard<Board> &&
              hal::ReportingBoard<Board>);
static_assert(hal::ImuBoard<Board> && hal::EncoderBoard<Board> && hal::GnssBoard<Board>);
static_assert(hal::SerialPort<GnssPort>);

}  // namespace tetap::hal::nucleo_g474re
