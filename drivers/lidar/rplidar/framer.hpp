// SPDX-License-Identifier: Apache-2.0
// Finds measurements in the bytes of a standard scan. They have no start byte and three bits of check. So a measurement
// counts only with the ones after it: each fits by itself, and the angles go on. After damage more of them are asked.
#pragma once

#include "drivers/lidar/rplidar/node.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

namespace tetap::drivers::rplidar {

class Framer {
 public:
  /// Measurements that must fit one after the other: until the first of them counts, and while all went well.
  static constexpr std::size_t kToLock = 8, kToStay = 3;

  constexpr void clear() {
    size_ = 0;
    locked_ = false;
  }
  [[nodiscard]] constexpr bool locked() const { return locked_; }
  /// Bytes that came after the measurement of the last on_byte().
  [[nodiscard]] constexpr std::size_t waiting() const { return size_; }

  /// The oldest measurement that this byte confirms; `noise` counts bytes that belong to none.
  constexpr std::optional<Node> on_byte(std::uint8_t byte, std::uint32_t& noise) {
    buffer_[size_] = byte;
    ++size_;
    // Each turn makes the buffer shorter, or returns.
    while (size_ > 0) {
      const std::size_t wanted = locked_ ? kToStay : kToLock, whole = size_ / kNodeBytes;
      const std::size_t fits = fitting(std::min(whole, wanted));
      if (fits == wanted) {
        const auto node = decode(std::span(buffer_).first(kNodeBytes));
        locked_ = true;
        drop(kNodeBytes);
        return node;
      }
      if (fits == whole) return {};
      locked_ = false;
      ++noise;
      drop(1);
    }
    return {};
  }

 private:
  /// Ours: at 2 000 measurements a second and 2 turns a second the step is 0.4 deg, at 10 turns 1.8 deg. The scanner
  /// corrects angles by the distance, and lost ones leave a gap.
  static constexpr std::int32_t kMostStep_q6 = 15 * 64, kLeastSpan_q6 = 64;

  /// Count of measurements at the front that fit, up to `most`. All of kToLock together turned by a degree at least.
  [[nodiscard]] constexpr std::size_t fitting(std::size_t most) const {
    std::int32_t span_q6 = 0;
    Node last{};
    for (std::size_t i = 0; i < most; ++i) {
      const auto node = decode(std::span(buffer_).subspan(i * kNodeBytes, kNodeBytes));
      if (!node) return i;
      if (i > 0) {
        const std::int32_t step_q6 = (node->angle_q6 - last.angle_q6 + kTurn_q6 * 3 / 2) % kTurn_q6 - kTurn_q6 / 2;
        if (step_q6 > kMostStep_q6 || step_q6 < -kMostStep_q6 || (node->starts_turn && last.starts_turn)) return i;
        span_q6 += step_q6;
      }
      last = *node;
    }
    return most == kToLock && span_q6 < kLeastSpan_q6 ? kToLock - 1 : most;
  }

  constexpr void drop(std::size_t count) {
    std::copy(buffer_.begin() + static_cast<std::ptrdiff_t>(count),
              buffer_.begin() + static_cast<std::ptrdiff_t>(size_), buffer_.begin());
    size_ -= count;
  }

  std::array<std::uint8_t, kToLock * kNodeBytes> buffer_{};
  std::size_t size_ = 0;
  bool locked_ = false;
};

}  // namespace tetap::drivers::rplidar
