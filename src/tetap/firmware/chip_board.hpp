// SPDX-License-Identifier: Apache-2.0
// A board of four functions, for a chip that tetap has no port of: send, receive, now, wait.
#pragma once

#include "hal/board.hpp"

#include <concepts>
#include <cstdint>
#include <optional>

namespace tetap::firmware {

template <class C>
concept Chip = requires(C& chip, const base::CanFrame& frame) {
  /// Takes a frame to be sent, in the order of the calls; false: no room.
  { chip.send(frame) } -> std::same_as<bool>;
  /// The next frame that was received, in order; empty: none now. Never waits.
  { chip.receive() } -> std::same_as<std::optional<base::CanFrame>>;
  /// Microseconds since the start, modulo 2^32.
  { chip.now_us() } -> std::same_as<std::uint32_t>;
  /// Returns within 1 ms.
  { chip.wait() } -> std::same_as<void>;
};

/// hal::Board for firmware::Firmware, whose polls are less than 2^32 us apart. The chip outlives it.
template <Chip C>
class ChipBoard {
  class Can {
   public:
    explicit Can(C& chip) : chip_(chip) {}
    bool send(const base::CanFrame& frame) {
      const bool taken = chip_.send(frame);
      if (!taken) ++faults_.tx_full;
      return taken;
    }
    [[nodiscard]] std::optional<base::CanFrame> receive() { return chip_.receive(); }
    void flush() {}
    [[nodiscard]] base::CanFaults faults() const { return faults_; }

   private:
    C& chip_;
    base::CanFaults faults_;
  };

 public:
  explicit ChipBoard(C& chip) : can(chip), chip_(chip), last_us_(chip.now_us()), time_{last_us_} {}
  ChipBoard(const ChipBoard&) = delete;
  ChipBoard& operator=(const ChipBoard&) = delete;

  [[nodiscard]] base::Micros now() {
    const std::uint32_t us = chip_.now_us();
    time_ += base::Micros{static_cast<std::uint32_t>(us - last_us_)};
    last_us_ = us;
    return time_;
  }
  void idle() { chip_.wait(); }

  Can can;

 private:
  C& chip_;
  std::uint32_t last_us_;
  base::Micros time_;
};

}  // namespace tetap::firmware
