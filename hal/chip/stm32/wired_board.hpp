// SPDX-License-Identifier: Apache-2.0
// A board with an STM32: the blocks of the chip that the node uses, started in order, and their interrupts. IMU on
// SPI1, encoders on TIM2 and TIM3, GNSS on USART1, console on USART2, one CAN controller.
#pragma once

#include "hal/board.hpp"
#include "hal/chip/arm/cortex_m4.hpp"
#include "hal/chip/arm/interrupt_lock.hpp"
#include "hal/chip/arm/nvic.hpp"
#include "hal/chip/arm/stored_fault.hpp"
#include "hal/chip/arm/systick_clock.hpp"
#include "hal/chip/stm32/boot_cause.hpp"
#include "hal/chip/stm32/can_state.hpp"
#include "hal/chip/stm32/can_timing.hpp"
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

#include <algorithm>
#include <array>
#include <cstdint>

namespace tetap::hal::stm32 {

/// 136 ms with the fastest oscillator, 377 ms with the slowest.
inline constexpr WatchdogTime kWatchdogTime = watchdog_time(200'000);
/// A poll with a tick in it, as GnssBoard allows.
inline constexpr std::uint32_t kLongestPoll_us = 20'000;
static_assert(kWatchdogTime.shortest_us() / 2 >= kLongestPoll_us, "kicked twice before the fastest oscillator is due");

inline constexpr std::uint32_t kConsoleBaud = 115'200;
/// Until a driver sets another one; the rate of new u-blox receivers.
inline constexpr std::uint32_t kGnssBaud = 38'400;
inline constexpr std::uint32_t kGnssRing_bytes = 2048, kGnssMessage_bytes = 256;
static_assert(kGnssRing_bytes >= 921'600 / 10 * kLongestPoll_us / 1'000'000,
              "the ring outlasts a poll at every baud rate");

/// `Wiring` names the board's chip, pins, clock and rates, and shows its state; `Wiring::Chip` is F4Chip or G4Chip.
template <class Wiring>
struct WiredBoard {
  using Chip = typename Wiring::Chip;
  using Storage = typename Chip::Storage;
  using GnssPort =
      SerialPort<Mmio, InterruptLock, kGnssRing_bytes, kGnssMessage_bytes, typename Chip::Dma, typename Chip::Usart>;
  static_assert(pins_distinct(Wiring::kPins) && Wiring::kPll.valid());

  static constexpr Mmio kSystem{cortex_m4::kSystemControlSpace};
  /// Interrupts that the board uses; on_interrupt() serves them.
  static constexpr std::array kInterrupts{Chip::kCanTransmit, Chip::kCanReceive, Chip::kGnssErrors, Chip::kGnssDma};
  static constexpr int kLastInterrupt = std::ranges::max(kInterrupts);
  /// At APB1's clock with the PLL, and at the internal oscillator's without.
  static constexpr CanBitTiming kCanTiming =
      can_bit_timing(Wiring::kPll.apb1_hz(), Wiring::kCanBitRate, Chip::kCanTimingLimits);
  static constexpr CanBitTiming kSlowCanTiming =
      can_bit_timing(Wiring::kPll.kInternal_hz, Wiring::kCanBitRate, Chip::kCanTimingLimits);

  /// Everything but the bus and the receiver, which start_sensors() starts. `stored`: what a fault handler may have
  /// left; `filter`: the frames that the node takes.
  [[gnu::noinline]] WiredBoard(StoredFault& stored, const Acceptance& filter) : filter_{filter} {
    static_assert(SensorBoard<WiredBoard> && IdleBoard<WiredBoard> && WatchdogBoard<WiredBoard> &&
                  ReportingBoard<WiredBoard> && ImuBoard<WiredBoard> && EncoderBoard<WiredBoard> &&
                  StorageBoard<WiredBoard> && GnssBoard<WiredBoard> && hal::SerialPort<GnssPort>);
    running = this;
    boot_.cause = take_boot_cause(Mmio{Chip::kRcc}, Chip::kResetFlags);
    if (const auto fault = stored.take(); fault && boot_.cause == BootCause::kSoftware) {
      boot_.cause = BootCause::kCpuFault;
      boot_.fault = *fault;
    }
    clocks_ = ClockTree<Mmio>{Mmio{Chip::kRcc}, Mmio{Chip::kPwr}, Mmio{Chip::kFlash}}.start(Wiring::kPll);
    boot_.fallback_clock = clocks_.source != ClockSource::kCrystal;
    Chip::power_blocks();
    for (const PinSetup& pin : Wiring::kPins) set_up(Mmio{pin.pin.port}, pin);
    Wiring::show_start(true);
    Nvic<Mmio>{kSystem}.set_up_exceptions();
    time_.start(clocks_.core_hz);
    console_.start(clocks_.apb1_hz, kConsoleBaud);
    imu.start(clocks_.apb2_hz, Wiring::kMostImuClock_hz);
    left_encoder.start();
    right_encoder.start();
    print_start();
  }
  WiredBoard(const WiredBoard&) = delete;  // handlers hold its address
  WiredBoard& operator=(const WiredBoard&) = delete;

  /// Joins the bus and opens the receiver's line: not before the self-check, which outlasts their rings.
  void start_sensors() {
    console_.finish();
    gnss.start(clocks_.apb2_hz, kGnssBaud);
    const bool slow = clocks_.source == ClockSource::kInternalDirect;
    can.start({.timing = slow ? kSlowCanTiming : kCanTiming, .filter = {.id = filter_.id, .mask = filter_.mask}});
    for (const int interrupt : kInterrupts) Nvic<Mmio>{kSystem}.enable(interrupt);
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
    if (!watchdog_.start(kWatchdogTime)) print("tetap: the watchdog did not take its time\n");
  }
  void kick() const { watchdog_.kick(); }

  static Storage storage() { return Chip::storage(); }
  void begin_storing() {
    // Each as four times the data sheet's longest: a worn sector is slow.
    constexpr WatchdogTime kTime = watchdog_time_above(2 * 4 * Storage::kLongestErase_us);
    static_assert(kTime.shortest_us() >= 2 * 4 * Storage::kLongestErase_us);
    if (!watchdog_.start(kTime)) print("tetap: the watchdog did not take its time\n");
  }
  void end_storing() { start_watchdog(); }

  [[nodiscard]] const BootReport& boot() const { return boot_; }
  [[nodiscard]] static StackUse stack() { return stack_use(); }
  void print(const char* text) const { console_.print(text); }

  /// SysTick and the interrupts of kInterrupts, by the exception's number.
  void on_interrupt(std::uint32_t exception) {
    constexpr int kFirst = 16, kSysTick = 15;
    switch (static_cast<int>(exception)) {
      case kSysTick:
        return time_.on_interrupt();
      case kFirst + Chip::kCanTransmit:
        return can.on_transmit_interrupt();
      case kFirst + Chip::kCanReceive:
        return can.on_receive_interrupt();
      case kFirst + Chip::kGnssErrors:
        return gnss.on_error_interrupt();
      case kFirst + Chip::kGnssDma:
        return gnss.on_dma_interrupt();
      default:
        return;
    }
  }

  static inline constinit WiredBoard* running = nullptr;  ///< the one whose interrupts are on

 private:
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

  /// A light blinks once a second while the node is on the bus, and the board shows otherwise that it is not; a change
  /// is one line, and so is a bus that cannot be joined.
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
    const bool passive = on_bus && can.error_passive();
    if (passive && !was_passive_) print("tetap: can: nobody acknowledges, or the bus is disturbed\n");
    was_passive_ = passive;
  }

  Acceptance filter_;
  BootReport boot_{};
  Clocks clocks_{};
  bool was_on_bus_ = false;
  std::uint32_t failures_shown_ = 0;  ///< count of base::CanFaults::bus_off
  bool light_ = false;
  bool was_passive_ = false;
  base::Micros next_blink_{};
  SysTickClock<Mmio> time_{kSystem};
  mutable SerialOutput<Mmio, 512, typename Chip::Usart> console_{Mmio{Chip::kUsart2}};  ///< text on its way is no state
  Watchdog<Mmio> watchdog_{Mmio{Chip::kIwdg}};

 public:
  typename Chip::Can can = Chip::can(time_);
  SpiMaster<Mmio, Pin, typename Chip::SpiData> imu{Mmio{Chip::kSpi1}, Wiring::kImuSelect};
  EncoderTimer<Mmio, std::uint32_t> left_encoder{Mmio{Chip::kTim2}};
  EncoderTimer<Mmio, std::uint16_t> right_encoder{Mmio{Chip::kTim3}};
  GnssPort gnss{Mmio{Chip::kUsart1}, Chip::kUsart1, Chip::kGnssReceive, Chip::kGnssTransmit};
};

}  // namespace tetap::hal::stm32
