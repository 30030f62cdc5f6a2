// SPDX-License-Identifier: Apache-2.0
// A board with an STM32F412 or F405: the blocks of the chip that the node uses, started in order, and their interrupts.
// Both chips have them at the same addresses. IMU on SPI1, encoders on TIM2 and TIM3, GNSS on USART1, console on
// USART2, CAN1.
#pragma once

#include "hal/board.hpp"
#include "hal/chip/arm/cortex_m4.hpp"
#include "hal/chip/arm/interrupt_lock.hpp"
#include "hal/chip/arm/nvic.hpp"
#include "hal/chip/arm/stored_fault.hpp"
#include "hal/chip/arm/systick_clock.hpp"
#include "hal/chip/stm32/boot_cause.hpp"
#include "hal/chip/stm32/can_controller.hpp"
#include "hal/chip/stm32/clock_tree.hpp"
#include "hal/chip/stm32/encoder_timer.hpp"
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

namespace tetap::hal::stm32 {

namespace chip = stm32f412;

/// 136 ms with the fastest oscillator, 377 ms with the slowest.
inline constexpr WatchdogTime kF4WatchdogTime = watchdog_time(200'000);
/// A poll with a tick in it, as GnssBoard allows.
inline constexpr std::uint32_t kF4LongestPoll_us = 20'000;
static_assert(kF4WatchdogTime.shortest_us() / 2 >= kF4LongestPoll_us,
              "kicked twice before the fastest oscillator is due");

using F4Clock = SysTickClock<Mmio>;
using F4GnssPort = SerialPort<Mmio, InterruptLock, 2048, 256>;
static_assert(2048 >= 921'600 / 10 * kF4LongestPoll_us / 1'000'000, "the ring outlasts a poll at every baud rate");

inline constexpr Mmio kF4System{cortex_m4::kSystemControlSpace};
/// DMA2, channel 4: stream 5 receives for USART1, stream 7 sends.
inline constexpr std::uint32_t kF4GnssReceiveStream = 5, kF4GnssTransmitStream = 7, kF4GnssChannel = 4;

/// Interrupts that the board uses; F4Board::on_interrupt() serves them.
inline constexpr std::array kF4Interrupts{chip::interrupt::kCan1Tx, chip::interrupt::kCan1Rx0, chip::interrupt::kUsart1,
                                          chip::interrupt::kDma2Stream5};
inline constexpr int kF4LastInterrupt = chip::interrupt::kDma2Stream5;

/// `Wiring` names the board's pins, clocks and rates, and shows its state.
template <class Wiring>
struct F4Board {
  /// Everything but the bus and the receiver, which start_sensors() starts. `stored`: what a fault handler may have
  /// left; `filter`: the frames that the node takes.
  [[gnu::noinline]] F4Board(StoredFault& stored, const CanFilter& filter) : filter_{filter} {
    running = this;
    boot_.cause = take_boot_cause(Mmio{chip::rcc::kRcc});
    if (const auto fault = stored.take(); fault && boot_.cause == BootCause::kSoftware) {
      boot_.cause = BootCause::kCpuFault;
      boot_.fault = *fault;
    }
    clocks_ =
        ClockTree<Mmio>{Mmio{chip::rcc::kRcc}, Mmio{chip::pwr::kPwr}, Mmio{chip::flash::kFlash}}.start(Wiring::kPll);
    boot_.fallback_clock = clocks_.source != ClockSource::kCrystal;
    power_blocks();
    for (const PinSetup& pin : Wiring::kPins) set_up(Mmio{pin.pin.port}, pin);
    Wiring::show_start(true);
    Nvic<Mmio>{kF4System}.set_up_exceptions();
    time_.start(clocks_.core_hz);
    console_.start(clocks_.apb1_hz, Wiring::kConsoleBaud);
    imu.start(clocks_.apb2_hz, Wiring::kMostImuClock_hz);
    left_encoder.start();
    right_encoder.start();
    print_start();
  }
  F4Board(const F4Board&) = delete;  // handlers hold its address
  F4Board& operator=(const F4Board&) = delete;

  /// Joins the bus and opens the receiver's line: not before the self-check, which outlasts their rings.
  void start_sensors() {
    console_.finish();
    gnss.start(clocks_.apb2_hz, Wiring::kGnssBaud);
    can.start({.timing = clocks_.source == ClockSource::kInternalDirect ? Wiring::kSlowCanTiming : Wiring::kCanTiming,
               .filter = filter_});
    for (const int interrupt : kF4Interrupts) Nvic<Mmio>{kF4System}.enable(interrupt);
    Wiring::show_start(false);
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
    if (!watchdog_.start(kF4WatchdogTime)) print("tetap: the watchdog did not take its time\n");
  }
  void kick() const { watchdog_.kick(); }

  [[nodiscard]] const BootReport& boot() const { return boot_; }
  [[nodiscard]] static StackUse stack() { return stack_use(); }
  void print(const char* text) const { console_.print(text); }

  /// SysTick and the interrupts of kF4Interrupts, by the exception's number.
  void on_interrupt(std::uint32_t exception) {
    constexpr int kFirst = 16, kSysTick = 15;
    switch (static_cast<int>(exception)) {
      case kSysTick:
        return time_.on_interrupt();
      case kFirst + chip::interrupt::kCan1Tx:
        return can.on_transmit_interrupt();
      case kFirst + chip::interrupt::kCan1Rx0:
        return can.on_receive_interrupt();
      case kFirst + chip::interrupt::kUsart1:
        return gnss.on_error_interrupt();
      case kFirst + chip::interrupt::kDma2Stream5:
        return gnss.on_dma_interrupt();
      default:
        return;
    }
  }

  static inline constinit F4Board* running = nullptr;  ///< the one whose interrupts are on

 private:
  /// Clocks of the blocks in use; each is reset, whatever a boot loader left. SYSCFG stays off: no pin interrupts.
  static void power_blocks() {
    namespace rcc = chip::rcc;
    constexpr Mmio kRcc{rcc::kRcc};
    const auto start = [&kRcc](std::uint32_t enable, std::uint32_t enabled, std::uint32_t reset, std::uint32_t held) {
      kRcc.write(enable, kRcc.read(enable) | enabled);
      kRcc.write(reset, held);
      kRcc.write(reset, 0);
      static_cast<void>(kRcc.read(reset));  // "delay after an RCC peripheral clock enabling": two clocks of the bus
    };
    start(rcc::ahb1enr::kOffset,
          rcc::ahb1enr::kGpioaen.mask() | rcc::ahb1enr::kGpioben.mask() | rcc::ahb1enr::kGpiocen.mask() |
              rcc::ahb1enr::kDma2en.mask(),
          rcc::ahb1rstr::kOffset, rcc::ahb1rstr::kDma2rst.mask());
    start(rcc::apb1enr::kOffset,
          rcc::apb1enr::kTim2en.mask() | rcc::apb1enr::kTim3en.mask() | rcc::apb1enr::kUsart2en.mask() |
              rcc::apb1enr::kCan1en.mask(),
          rcc::apb1rstr::kOffset,
          rcc::apb1rstr::kTim2rst.mask() | rcc::apb1rstr::kTim3rst.mask() | rcc::apb1rstr::kUart2rst.mask() |
              rcc::apb1rstr::kCan1rst.mask());
    start(rcc::apb2enr::kOffset, rcc::apb2enr::kSpi1en.mask() | rcc::apb2enr::kUsart1en.mask(), rcc::apb2rstr::kOffset,
          rcc::apb2rstr::kSpi1rst.mask() | rcc::apb2rstr::kUsart1rst.mask());
  }

  [[gnu::cold, gnu::noinline]] void print_start() {
    print(Wiring::kUp);
    if (boot_.fallback_clock) print(", no crystal: the internal oscillator");
    print("\n");
    if (boot_.cause == BootCause::kWatchdog) print("tetap: the watchdog ended the last run\n");
    if (boot_.cause != BootCause::kCpuFault) return;
    Text<> line;
    line.add("tetap: a fault ended the last run: kind ").dec(static_cast<std::uint32_t>(boot_.fault.fault));
    line.add(" at ").hex(boot_.fault.program_counter).add(", address ").hex(boot_.fault.address);
    print(line.add(", status ").hex(boot_.fault.status).add('\n').c_str());
  }

  /// One light blinks once a second while the node is on the bus, another while it is not; a change is one line, and
  /// so is a bus that cannot be joined.
  void show_state() {
    const bool on_bus = can.state() == CanState::kOnBus;
    const std::uint32_t failures = can.faults().bus_off;
    if (failures != failures_shown_) print("tetap: can: off the bus\n");
    if (on_bus && !was_on_bus_) print("tetap: can: on the bus\n");
    was_on_bus_ = on_bus;
    failures_shown_ = failures;
    const base::Micros time = now();
    if (time < next_blink_) return;
    next_blink_ = time + base::Micros{500'000};
    light_ = !light_;
    Wiring::show_bus(light_, on_bus);
  }

  CanFilter filter_;
  BootReport boot_{};
  Clocks clocks_{};
  bool was_on_bus_ = false;
  std::uint32_t failures_shown_ = 0;  ///< count of CanFaults::bus_off
  bool light_ = false;
  base::Micros next_blink_{};
  F4Clock time_{kF4System};
  mutable SerialOutput<Mmio, 512> console_{Mmio{chip::usart::kUsart2}};  ///< text on its way is no state
  Watchdog<Mmio> watchdog_{Mmio{chip::iwdg::kIwdg}};

 public:
  CanController<Mmio, F4Clock, InterruptLock> can{Mmio{chip::can::kCan1}, time_};
  SpiMaster<Mmio, Pin> imu{Mmio{chip::spi::kSpi1}, Wiring::kImuSelect};
  EncoderTimer<Mmio, std::uint32_t> left_encoder{Mmio{chip::tim::kTim2}};
  EncoderTimer<Mmio, std::uint16_t> right_encoder{Mmio{chip::tim::kTim3}};
  F4GnssPort gnss{Mmio{chip::usart::kUsart1},
                  chip::usart::kUsart1,
                  {Mmio{chip::dma::kDma2}, kF4GnssReceiveStream, kF4GnssChannel},
                  {Mmio{chip::dma::kDma2}, kF4GnssTransmitStream, kF4GnssChannel}};
};

}  // namespace tetap::hal::stm32
