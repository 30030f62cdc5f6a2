// SPDX-License-Identifier: Apache-2.0
// A serial line on a USART, 8N1: received by a circular DMA stream that never stops, sent by another one message at a
// time. RM0402 chapters "Universal synchronous receiver transmitter (USART)", "DMA controller (DMA)".
#pragma once

#include "hal/byte_stream.hpp"
#include "hal/chip/stm32/dma_ring_index.hpp"
#include "hal/chip/stm32/registers_stm32f412.hpp"
#include "hal/chip/stm32/usart_registers.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace tetap::hal::stm32 {

namespace dma = stm32f412::dma;

enum class DmaDirection : std::uint8_t { kFromPeripheral = 0, kToPeripheral = 1 };

/// One stream of a DMA controller, and the channel that it serves.
template <class Registers>
class DmaStream {
 public:
  constexpr DmaStream(Registers registers, std::uint32_t number, std::uint32_t channel)
      : registers_{registers}, number_{number}, channel_{channel} {}

  /// Bytes between the peripheral's data register and memory, `count` of them, again and again when `circular`.
  void start(DmaDirection direction, std::uint32_t peripheral, std::uint32_t memory, std::uint32_t count,
             bool circular) const {
    stop();
    write(dma::sxpar::kOffset, peripheral);
    write(dma::sxm0ar::kOffset, memory);
    write(dma::sxndtr::kOffset, count);
    write(dma::sxfcr::kOffset, 0);  // direct mode: a byte is in memory as soon as it is there
    constexpr std::uint32_t kHighPriority = 2;
    const std::uint32_t setup = dma::sxcr::kChsel(channel_) | dma::sxcr::kPl(kHighPriority) | dma::sxcr::kMinc.mask() |
                                dma::sxcr::kDir(static_cast<std::uint32_t>(direction)) |
                                (circular ? dma::sxcr::kCirc.mask() | dma::sxcr::kTcie.mask() : 0);
    write(dma::sxcr::kOffset, setup);
    write(dma::sxcr::kOffset, setup | dma::sxcr::kEn.mask());
  }

  /// EN reads 1 until the transfer that is under way has ended; then the flags of the last one go.
  void stop() const {
    write(dma::sxcr::kOffset, 0);
    for (int i = 0; i < kPatience && dma::sxcr::kEn.of(read(dma::sxcr::kOffset)) != 0; ++i) {
    }
    clear_flags(kAllFlags);
  }

  [[nodiscard]] std::uint32_t left() const { return dma::sxndtr::kNdt.of(read(dma::sxndtr::kOffset)); }
  [[nodiscard]] bool completed() const { return (flags() & kCompleted) != 0; }
  void clear_completed() const { clear_flags(kCompleted); }

 private:
  static constexpr int kPatience = 1000;
  // Flags of stream 0 in LISR; streams 1 to 3 lie 6, 16 and 22 bits higher, 4 to 7 so in HISR.
  static constexpr std::uint32_t kCompleted = dma::lisr::kTcif0.mask();
  static constexpr std::uint32_t kAllFlags = dma::lisr::kFeif0.mask() | dma::lisr::kDmeif0.mask() |
                                             dma::lisr::kTeif0.mask() | dma::lisr::kHtif0.mask() | kCompleted;

  [[nodiscard]] constexpr std::uint32_t shift() const {
    constexpr std::array<std::uint32_t, 4> kShifts{dma::lisr::kFeif0.lsb, dma::lisr::kFeif1.lsb, dma::lisr::kFeif2.lsb,
                                                   dma::lisr::kFeif3.lsb};
    return kShifts[number_ % 4];
  }
  [[nodiscard]] std::uint32_t flags() const {
    return registers_.read(number_ < 4 ? dma::lisr::kOffset : dma::hisr::kOffset) >> shift();
  }
  void clear_flags(std::uint32_t flags) const {
    registers_.write(number_ < 4 ? dma::lifcr::kOffset : dma::hifcr::kOffset, flags << shift());
  }
  [[nodiscard]] std::uint32_t read(std::uint32_t offset) const {
    return registers_.read(offset + number_ * dma::sxcr::kStride);
  }
  void write(std::uint32_t offset, std::uint32_t value) const {
    registers_.write(offset + number_ * dma::sxcr::kStride, value);
  }

  Registers registers_;
  std::uint32_t number_;
  std::uint32_t channel_;
};

/// `ReceiveSize`: bytes of the ring; more than that between two reads are counted as lapped.
template <class Registers, class Lock, std::size_t ReceiveSize, std::size_t TransmitSize,
          class Stream = DmaStream<Registers>, class Usart = UsartOfF4>
class SerialPort {
 public:
  /// `address`: that of the USART, as DMA sees it.
  constexpr SerialPort(Registers registers, std::uint32_t address, Stream receive, Stream transmit)
      : registers_{registers}, address_{address}, receive_{receive}, transmit_{transmit} {}

  void start(std::uint32_t clock_hz, std::uint32_t baud) {
    clock_hz_ = clock_hz;
    registers_.write(Usart::kControl1, 0);
    registers_.write(Usart::kControl2, 0);
    registers_.write(Usart::kBaudRate, divider(baud));
    registers_.write(Usart::kControl1, Usart::kEnable | usart::cr1::kTe.mask() | usart::cr1::kRe.mask());
    registers_.write(Usart::kControl3, usart::cr3::kDmar.mask() | usart::cr3::kDmat.mask() | usart::cr3::kEie.mask());
    begin_receiving();
  }

  [[nodiscard]] std::size_t read(std::span<std::uint8_t> in) {
    serve();
    const std::uint32_t written = bytes_written();
    std::uint32_t waiting = written - taken_;
    if (waiting > ReceiveSize) {
      // The old bytes are being overwritten: all of them are lost, and a frame begins anew behind them.
      lapped_ += waiting;
      taken_ = written;
      waiting = 0;
    }
    const std::size_t count = waiting < in.size() ? waiting : in.size();
    for (std::size_t i = 0; i < count; ++i) in[i] = ring_[(taken_ + i) % ReceiveSize];
    taken_ += static_cast<std::uint32_t>(count);
    return count;
  }

  /// One message is on its way at a time; while it is, there is no room.
  [[nodiscard]] std::size_t write(std::span<const std::uint8_t> out) {
    serve();
    if (sending_ || new_baud_ != 0 || out.empty()) return 0;
    const std::size_t count = out.size() < TransmitSize ? out.size() : TransmitSize;
    for (std::size_t i = 0; i < count; ++i) message_[i] = out[i];
    // TC is cleared: from here on it stands for this message's last bit.
    Usart::clear_completed(registers_);
    transmit_.start(DmaDirection::kToPeripheral, address_ + Usart::kTransmitData, address_of(message_.data()),
                    static_cast<std::uint32_t>(count), false);
    sending_ = true;
    return count;
  }

  /// Takes effect when what was written is out.
  void set_baud(std::uint32_t baud) {
    new_baud_ = baud;
    serve();
  }

  [[nodiscard]] SerialFaults faults() const { return {.overrun = overruns_, .framing = damaged_, .lapped = lapped_}; }

  /// The receive stream's interrupt: a round of the ring is full.
  void on_dma_interrupt() {
    if (!receive_.completed()) return;
    receive_.clear_completed();
    rounds_ = rounds_ + 1;
  }

  /// The USART's interrupt, of errors alone, which are cleared once DMA has taken the byte.
  void on_error_interrupt() {
    const std::uint32_t status = registers_.read(Usart::kStatus);
    for (int i = 0; i < kPatience && usart::sr::kRxne.of(registers_.read(Usart::kStatus)) != 0; ++i) {
    }
    Usart::clear_errors(registers_);
    if (usart::sr::kOre.of(status) != 0) overruns_ = overruns_ + 1;
    if ((status & (usart::sr::kFe.mask() | usart::sr::kNf.mask())) != 0) damaged_ = damaged_ + 1;
  }

 private:
  static constexpr int kPatience = 100;  ///< reads in which DMA must have served a request

  /// Sixteen samples a bit: BRR is the clock divided by the baud rate, with four fractional bits of the mantissa.
  [[nodiscard]] constexpr std::uint32_t divider(std::uint32_t baud) const { return (clock_hz_ + baud / 2) / baud; }
  [[nodiscard]] static std::uint32_t address_of(const std::uint8_t* memory) {
    return static_cast<std::uint32_t>(reinterpret_cast<std::uintptr_t>(memory));
  }

  /// A round that ends between the two reads makes this look again: rounds last 22 ms or more.
  [[nodiscard]] std::uint32_t bytes_written() {
    for (;;) {
      const std::uint32_t rounds = rounds_;
      const std::uint32_t left = receive_.left();
      if (rounds == rounds_) return index_.update(rounds, left);
    }
  }

  void begin_receiving() {
    const Lock lock;
    receive_.start(DmaDirection::kFromPeripheral, address_ + Usart::kReceiveData, address_of(ring_.data()), ReceiveSize,
                   true);
    rounds_ = 0;
    taken_ = 0;
    index_.restart();
  }

  /// Ends a message whose last bit is out, and changes the baud rate between two messages.
  void serve() {
    if (sending_ && transmit_.completed() && usart::sr::kTc.of(registers_.read(Usart::kStatus)) != 0) {
      transmit_.stop();
      sending_ = false;
    }
    if (sending_ || new_baud_ == 0) return;
    registers_.write(Usart::kControl1, 0);
    registers_.write(Usart::kBaudRate, divider(new_baud_));
    registers_.write(Usart::kControl1, Usart::kEnable | usart::cr1::kTe.mask() | usart::cr1::kRe.mask());
    new_baud_ = 0;
    begin_receiving();
  }

  Registers registers_;
  std::uint32_t address_;
  Stream receive_;
  Stream transmit_;
  std::uint32_t clock_hz_ = 0;
  std::uint32_t new_baud_ = 0;  ///< 0: no change is waiting
  bool sending_ = false;
  DmaRingIndex<ReceiveSize> index_{};
  std::uint32_t taken_ = 0;   ///< bytes that read() gave, modulo 2^32
  std::uint32_t lapped_ = 0;  ///< bytes lost in the ring
  volatile std::uint32_t rounds_ = 0;
  volatile std::uint32_t overruns_ = 0;
  volatile std::uint32_t damaged_ = 0;
  std::array<std::uint8_t, ReceiveSize> ring_{};
  std::array<std::uint8_t, TransmitSize> message_{};
};

}  // namespace tetap::hal::stm32
