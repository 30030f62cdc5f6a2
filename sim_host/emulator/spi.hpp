// SPDX-License-Identifier: Apache-2.0
// SPI master, full duplex, 8 or 16 bits, polled, by interrupt or by DMA. RM0402 chapter "Serial peripheral
// interface/ inter-IC sound".
#pragma once

#include "sim_host/emulator/dma.hpp"
#include "sim_host/emulator/gpio.hpp"
#include "sim_host/emulator/peripheral.hpp"

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

namespace tetap::board {

/// A chip on an SPI bus.
class SpiDevice {
 public:
  virtual ~SpiDevice() = default;
  virtual void select() = 0;
  virtual void deselect() = 0;
  /// One byte in and out while selected.
  virtual std::uint8_t exchange(std::uint8_t out) = 0;
  /// Clock modes 0 to 3 (2 CPOL + CPHA) that it understands, as a bit mask, and its fastest clock.
  [[nodiscard]] virtual unsigned modes() const = 0;
  [[nodiscard]] virtual std::int64_t limit_hz() const = 0;
};

class Spi : public Peripheral {
 public:
  struct Wiring {
    Signal sck_signal, miso_signal, mosi_signal;
    Pin sck, miso, mosi;
    int interrupt;
    DmaRequest tx_request, rx_request;
  };
  Spi(Surroundings around, std::string name, std::uint32_t base, const Pins& pins, Wiring wiring,
      std::function<std::int64_t()> clock_hz, std::function<bool(DmaRequest)> dma);

  std::uint32_t read(std::uint32_t offset) override;
  void write(std::uint32_t offset, std::uint32_t value, std::uint32_t mask) override;
  void reset() override;

  /// Connects a chip with its select line (active low).
  void connect(SpiDevice& device, Pin select, Pins& pins);
  /// Fault of the wiring: the MISO line is stuck at a level; empty: it is whole.
  std::optional<bool> stuck_miso;
  [[nodiscard]] std::int64_t clock_rate_hz() const;
  virtual void raise_requests();

 protected:
  struct Connected {
    SpiDevice* device;
    Pin select;
    bool selected = false;
  };
  virtual void start();
  virtual void finished();
  std::uint32_t exchange(std::uint32_t out);
  std::uint8_t exchange_byte(std::uint8_t out);
  void select_changed(std::size_t index, bool level);
  void write_cr1(std::uint32_t value);
  virtual void check_shape();
  [[nodiscard]] virtual bool busy() const { return finished_.pending(); }
  void update_line(std::uint32_t status);
  void check_lines();
  virtual void update();
  /// Bits of a frame.
  [[nodiscard]] virtual int bits() const;
  [[nodiscard]] std::uint32_t status() const;

  const Pins& pins_;
  Wiring wiring_;
  std::function<std::int64_t()> clock_hz_;
  std::function<bool(DmaRequest)> dma_;
  Alarm finished_;
  std::vector<Connected> devices_;
  std::uint32_t cr1_ = 0, cr2_ = 0, sr_ = 2;
  std::uint32_t shift_ = 0, received_ = 0;
  std::optional<std::uint32_t> waiting_;
  bool data_read_ = false;  ///< DR was read while OVR: a read of SR clears it
  bool serving_ = false;
};

}  // namespace tetap::board
