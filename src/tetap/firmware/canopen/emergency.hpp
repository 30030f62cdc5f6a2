// SPDX-License-Identifier: Apache-2.0
// Signs of life of a CANopen node: a boot-up message, a heartbeat a second, and emergency messages of CiA 301 on what
// the loop counts, ten a second at most.
#pragma once

#include "tetap/base/can_frame.hpp"
#include "tetap/base/time.hpp"
#include "tetap/bus/counters.hpp"
#include "tetap/firmware/canopen/ids.hpp"

#include <array>
#include <cstddef>
#include <cstdint>

namespace tetap::firmware::canopen {

class Heartbeat {
 public:
  template <class Send>
  void poll(base::Micros now, std::uint8_t node_id, base::Micros period, Send&& send) {
    if (begun_ && now < next_) return;
    base::CanFrame frame{.id = kHeartbeatIds + node_id, .size = 1};
    frame.data[0] = begun_ ? kOperational : kBootUp;
    if (!send(frame)) return;
    next_ = now + period;
    begun_ = true;
  }

 private:
  static constexpr std::uint8_t kBootUp = 0, kOperational = 5;
  base::Micros next_;
  bool begun_ = false;
};

/// An error lasts while its count has grown within the last second. Each begin is one message; the end of the last
/// one is the message "error reset".
class Emergency {
 public:
  [[nodiscard]] std::uint8_t error_register() const { return active_ == 0 ? 0 : active_ == kLateBit ? 0x01 : 0x11; }

  void note(const bus::LoopHealth& health, base::Micros now) {
    const std::array<std::uint32_t, kErrors> counts{health.bus.rx_overflow, health.bus.bus_off,
                                                    health.id_conflict ? counts_[2] + 1 : counts_[2],
                                                    health.ticks_late};
    for (std::size_t i = 0; i < kErrors; ++i) {
      if (counts[i] != counts_[i]) grown_[i] = now, active_ |= 1U << i;
      if ((active_ >> i & 1U) != 0 && now - grown_[i] > kLasts) active_ &= ~(1U << i);
    }
    counts_ = counts;
  }
  /// One message at most; an error that began while none might go out follows later, if it still lasts.
  template <class Send>
  void poll(base::Micros now, std::uint8_t node_id, Send&& send) {
    if (active_ == told_ || (sent_ && now - sent_at_ < kEach)) return;
    const std::uint32_t begun = active_ & ~told_;
    std::size_t first = 0;
    while (begun != 0 && (begun >> first & 1U) == 0) ++first;
    if (begun == 0 && active_ != 0) return void(told_ = active_);
    const std::uint16_t code = begun == 0 ? 0 : kCodes[first];
    const std::uint32_t count = begun == 0 ? 0 : counts_[first];
    base::CanFrame frame{.id = kEmergencyIds + node_id, .size = 8};
    frame.data = {static_cast<std::uint8_t>(code),
                  static_cast<std::uint8_t>(code >> 8),
                  error_register(),
                  static_cast<std::uint8_t>(active_),
                  static_cast<std::uint8_t>(count),
                  static_cast<std::uint8_t>(count >> 8),
                  static_cast<std::uint8_t>(count >> 16),
                  static_cast<std::uint8_t>(count >> 24)};
    if (!send(frame)) return;
    told_ = begun == 0 ? 0 : (told_ & active_) | 1U << first;
    sent_at_ = now;
    sent_ = true;
  }

 private:
  static constexpr std::size_t kErrors = 4;
  /// Frames lost by the receiver, recovered from bus off, another node's identifiers, the tick is late.
  static constexpr std::array<std::uint16_t, kErrors> kCodes{0x8110, 0x8140, 0x8150, 0x6100};
  static constexpr std::uint32_t kLateBit = 1U << 3;
  static constexpr base::Micros kLasts{1'000'000}, kEach{100'000};

  std::array<std::uint32_t, kErrors> counts_{};
  std::array<base::Micros, kErrors> grown_{};
  std::uint32_t active_ = 0, told_ = 0;  ///< bit of each error
  base::Micros sent_at_;
  bool sent_ = false;
};

}  // namespace tetap::firmware::canopen
