// SPDX-License-Identifier: Apache-2.0
// bxCAN: three transmit mailboxes, two receive FIFOs of three frames, filters, error states, bus-off and its recovery.
// RM0402 chapter "Controller area network (bxCAN)".
#pragma once

#include "sim_host/emulator/can_filters.hpp"
#include "sim_host/emulator/can_line.hpp"
#include "sim_host/emulator/gpio.hpp"
#include "sim_host/emulator/peripheral.hpp"

#include <array>
#include <cstdint>
#include <deque>
#include <functional>

namespace tetap::board {

class Can final : public Peripheral, public CanController {
 public:
  Can(Surroundings around, const Pins& pins, std::function<std::int64_t()> clock_hz);

  std::uint32_t read(std::uint32_t offset) override;
  void write(std::uint32_t offset, std::uint32_t value, std::uint32_t mask) override;
  void reset() override;

  CanLine line;

  // CanController
  [[nodiscard]] bool on_bus() const override { return mode_ == Mode::kNormal && !bus_off_; }
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
  static constexpr int kMailboxes = 3;
  static constexpr std::size_t kFifoDepth = 3;
  static constexpr Pin kTx{'A', 12}, kRx{'A', 11};

  enum class Mode : std::uint8_t { kSleep, kInitialisation, kNormal };
  struct Mailbox {
    std::uint32_t ir = 0, dtr = 0, dlr = 0, dhr = 0;
    bool pending = false, abort = false;
    std::uint64_t order = 0;   ///< order of the requests, for TXFP = 1
    std::uint32_t result = 0;  ///< RQCP, TXOK, ALST, TERR
  };
  struct Stored {
    CanOffer frame;
    int match = 0;  ///< FMI
  };
  struct Fifo {
    std::deque<Stored> frames;
    bool full = false, overrun = false;
  };

  [[nodiscard]] std::uint32_t msr() const;
  [[nodiscard]] std::uint32_t tsr() const;
  [[nodiscard]] std::uint32_t esr() const;
  [[nodiscard]] std::uint32_t read_fifo(int fifo, std::uint32_t word) const;
  [[nodiscard]] std::uint32_t read_mailbox(std::uint32_t offset) const;
  void write_mailbox(std::uint32_t offset, std::uint32_t value, std::uint32_t mask);
  void write_mcr(std::uint32_t value);
  void write_tsr(std::uint32_t value);
  void write_fifo(Fifo& fifo, std::uint32_t value);
  void request(Mailbox& mailbox);
  void complete(Mailbox& mailbox, std::uint32_t result);
  [[nodiscard]] int next_mailbox() const;
  [[nodiscard]] int lowest_priority() const;
  [[nodiscard]] static CanOffer frame_of(const Mailbox& mailbox);
  void store(const CanOffer& frame);
  void change_mode();
  void mode_reached();
  void enter_bus_off();
  void recovered();
  void wait_for_recovery();
  void set_error(std::uint32_t code);
  void update();
  [[nodiscard]] bool loop_back() const;
  [[nodiscard]] bool silent() const;

  const Pins& pins_;
  std::function<std::int64_t()> clock_hz_;
  Alarm mode_change_, recovery_, loop_;
  Mode mode_ = Mode::kSleep;
  std::uint32_t mcr_ = 0, ier_ = 0, btr_ = 0, lec_ = 0;
  bool erri_ = false, error_seen_ = false;
  std::array<Mailbox, kMailboxes> mailboxes_{};
  int sending_ = -1;
  std::uint64_t requests_ = 0;
  std::array<Fifo, 2> fifos_{};
  CanFilters filters_;
  int tec_ = 0, rec_ = 0;
  bool bus_off_ = false;
  bool recovers_ = false;  ///< initialisation mode was left since bus-off
};

}  // namespace tetap::board
