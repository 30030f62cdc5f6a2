// SPDX-License-Identifier: Apache-2.0
// Asynchronous serial port, 8 data bits. RM0402 chapter "Universal synchronous receiver transmitter" has its status
// flags and how they are cleared, DMA requests, and the baud rate from BRR and OVER8. The flags are overrun, idle line,
// framing and noise.
#pragma once

#include "sim_host/emulator/dma.hpp"
#include "sim_host/emulator/gpio.hpp"
#include "sim_host/emulator/peripheral.hpp"

#include <cstdint>
#include <functional>
#include <optional>

namespace tetap::board {

class Usart : public Peripheral {
 public:
  struct Wiring {
    Signal tx_signal, rx_signal;
    Pin tx_pin, rx_pin;  ///< pins that the board connects
    int interrupt;
    DmaRequest tx_request, rx_request;
  };
  /// `clock_hz`: frequency of the bus that the port hangs on.
  Usart(Surroundings around, std::string name, std::uint32_t base, const Pins& pins, Wiring wiring,
        std::function<std::int64_t()> clock_hz, std::function<bool(DmaRequest)> dma);

  std::uint32_t read(std::uint32_t offset) override;
  void write(std::uint32_t offset, std::uint32_t value, std::uint32_t mask) override;
  void reset() override;

  /// The peer begins to send `byte` at its own rate; peers leave a byte's time between calls.
  void arrive(std::uint8_t byte, std::int64_t baud);
  /// A byte has left the port: its value, and the rate it was sent with.
  std::function<void(std::uint8_t byte, std::int64_t baud)> on_sent;
  [[nodiscard]] virtual std::int64_t baud() const;
  /// Called when a DMA stream was switched on.
  void raise_requests();

 protected:
  [[nodiscard]] virtual bool on() const;
  /// A byte that arrives on top of an unread one takes its place without a word (CR3.OVRDIS of newer ports).
  [[nodiscard]] virtual bool overrun_off() const { return false; }
  void start_sending();
  void put_data(std::uint8_t byte);
  void sent();
  void received();
  void idle();
  void take(std::uint8_t byte, std::uint32_t errors);
  std::uint32_t read_data();
  void update();
  [[nodiscard]] Picoseconds character() const { return periods(10, baud()); }

  const Pins& pins_;
  Wiring wiring_;
  std::function<std::int64_t()> clock_hz_;
  std::function<bool(DmaRequest)> dma_;
  Alarm sent_, received_, idle_;
  std::uint32_t sr_ = 0xC0, brr_ = 0, cr1_ = 0, cr2_ = 0, cr3_ = 0;
  std::uint8_t shift_ = 0;               ///< byte on the line
  std::optional<std::uint8_t> waiting_;  ///< byte in the transmit data register
  std::uint8_t data_ = 0;                ///< received data register
  std::uint8_t arriving_ = 0;
  std::int64_t arriving_baud_ = 0;
  bool status_read_ = false;  ///< SR was read: a read of DR clears the error flags
  bool serving_ = false;
};

}  // namespace tetap::board
