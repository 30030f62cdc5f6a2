// SPDX-License-Identifier: Apache-2.0
// FDCAN of the STM32G4 with classic frames: transmit FIFO or queue of three, two receive FIFOs of three, event FIFO,
// error states, and a bus-off that stays until software clears INIT. RM0440 chapter "FD controller area network
// (FDCAN)".
#pragma once

#include "sim_host/emulator/can_line.hpp"
#include "sim_host/emulator/fdcan_ram.hpp"
#include "sim_host/emulator/gpio.hpp"
#include "sim_host/emulator/peripheral.hpp"

#include <array>
#include <cstdint>
#include <functional>

namespace tetap::board {

class Fdcan final : public Peripheral, public CanController {
 public:
  struct Wiring {
    Pin tx, rx;  ///< pins that the board connects
  };
  /// `kernel_hz`: clock that RCC_CCIPR.FDCANSEL selects, 0: none; `bus_hz`: clock of the APB.
  Fdcan(Surroundings around, FdcanRam& ram, const Pins& pins, Wiring wiring, std::function<std::int64_t()> kernel_hz,
        std::function<std::int64_t()> bus_hz);

  std::uint32_t read(std::uint32_t offset) override;
  void write(std::uint32_t offset, std::uint32_t value, std::uint32_t mask) override;
  void reset() override;

  CanLine line;

  // CanController
  [[nodiscard]] bool on_bus() const override { return state_ == State::kActive; }
  [[nodiscard]] std::optional<CanOffer> offer() override;
  void sent() override;
  void lost_arbitration() override;
  void failed(CanError error) override;
  void received(const CanOffer& frame) override;
  void receive_error(CanError error) override;
  [[nodiscard]] std::int64_t bit_rate() const override;
  [[nodiscard]] double rate_tolerance() const override;
  [[nodiscard]] bool error_passive() const override { return tec_ > 127 || rec_ > 127; }
  void released() override;

 private:
  static constexpr std::uint32_t kDepth = fdcan_ram::kDepth;
  /// INIT = 1; waiting for eleven recessive bits; recovering from bus-off; taking part.
  enum class State : std::uint8_t { kInitialisation, kSynchronising, kRecovering, kActive };
  /// Indices of a FIFO in the message RAM.
  struct Fifo {
    std::uint32_t get = 0, fill = 0;
    [[nodiscard]] std::uint32_t put() const { return (get + fill) % kDepth; }
    [[nodiscard]] bool holds(std::uint32_t index) const { return (index + kDepth - get) % kDepth < fill; }
  };

  // Initialisation and modes
  [[nodiscard]] bool initialising() const;
  [[nodiscard]] bool configurable() const;
  void write_cccr(std::uint32_t value);
  void write_init(bool init);
  void init_reached();
  void leave_initialisation();
  void check_start() const;
  void joined();
  void wait_for_bus();
  void enter_bus_off();
  void clear_by_cce();
  [[nodiscard]] bool write_protected(std::uint32_t offset, std::uint32_t value);
  void check_timing() const;

  // Transmission
  [[nodiscard]] bool queue_mode() const;
  [[nodiscard]] std::uint32_t txfqs() const;
  [[nodiscard]] int next_buffer() const;
  [[nodiscard]] CanOffer frame_of(std::uint32_t buffer) const;
  void request(std::uint32_t bits);
  void request_one(std::uint32_t buffer);
  void cancel(std::uint32_t bits);
  void finish(std::uint32_t buffer, bool transmitted);
  void store_event(std::uint32_t buffer);

  // Reception
  void store(const CanOffer& frame);
  void put_element(std::uint32_t base, const CanOffer& frame, const FdcanMatch& match);
  [[nodiscard]] std::uint32_t status_of(const Fifo& fifo, std::uint32_t lost_flag) const;
  void acknowledge(Fifo& fifo, std::uint32_t index, const char* name);
  [[nodiscard]] const char* wrong_access(std::uint32_t word, bool write) const;

  // Errors, interrupts, time
  [[nodiscard]] std::uint32_t read_traffic(std::uint32_t offset) const;
  [[nodiscard]] std::uint32_t psr() const;
  [[nodiscard]] std::uint32_t ecr() const;
  void set_error(std::uint32_t code);
  void update_errors();
  void raise(std::uint32_t flags);
  void update();
  [[nodiscard]] std::uint32_t timestamp(Picoseconds time) const;
  [[nodiscard]] std::uint32_t start_stamp(const CanOffer& frame) const;

  FdcanRam& ram_;
  const Pins& pins_;
  Wiring wiring_;
  std::function<std::int64_t()> kernel_hz_, bus_hz_;
  Alarm init_change_, join_;
  State state_ = State::kInitialisation;
  bool wanted_init_ = true;
  std::uint32_t cccr_ = 1, nbtp_ = 0, dbtp_ = 0, rxgfc_ = 0, xidam_ = 0, tscc_ = 0, ckdiv_ = 0, txbc_ = 0;
  std::uint32_t ir_ = 0, ie_ = 0, ils_ = 0, ile_ = 0, hpms_ = 0;
  std::uint32_t txbrp_ = 0, txbto_ = 0, txbcf_ = 0, txbtie_ = 0, txbcie_ = 0, cancelled_ = 0;
  std::uint32_t lec_ = 7, errors_logged_ = 0;
  std::array<Fifo, 2> rx_{};
  Fifo tx_, events_;
  int sending_ = -1;
  int tec_ = 0, rec_ = 0;
  bool bus_off_ = false, passive_seen_ = false, warning_seen_ = false;
  Picoseconds stamp_zero_ = 0, recovery_since_ = 0;
};

}  // namespace tetap::board
