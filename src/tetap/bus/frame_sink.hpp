// SPDX-License-Identifier: Apache-2.0
// Destination of a node's frames: the bus, or a hash. One type for both, so that a node's tick is in an image once.
#pragma once

#include "tetap/base/can_frame.hpp"
#include "tetap/bus/messages.hpp"

#include <cstddef>
#include <cstdint>

namespace tetap::bus {

/// FNV-1a over what a node sent, diagnostics of real time and version left out.
class FrameHash {
 public:
  explicit constexpr FrameHash(std::uint32_t can_base) : base_(can_base) {}
  constexpr void operator()(const base::CanFrame& frame) {
    const std::uint32_t offset = frame.id - base_;
    if (offset == bus::EstVersion::kOffset || offset == bus::EstDiagLoop::kOffset) return;
    mix(static_cast<std::uint8_t>(offset));
    for (std::size_t i = 0; i < frame.size; ++i) mix(frame.data[i]);
  }
  [[nodiscard]] constexpr std::uint32_t value() const { return hash_; }

 private:
  constexpr void mix(std::uint8_t byte) { hash_ = (hash_ ^ byte) * 16'777'619U; }

  std::uint32_t base_;
  std::uint32_t hash_ = 2'166'136'261U;
};

template <class Can>
class FrameSink {
 public:
  explicit FrameSink(Can& can) : can_(can) {}
  FrameSink(Can& can, FrameHash& hash) : can_(can), hash_(&hash) {}
  /// Once in an image, not once for each kind of frame.
  [[gnu::noinline]] void operator()(const base::CanFrame& frame) const {
    if (hash_ != nullptr) return (*hash_)(frame);
    static_cast<void>(can_.send(frame));  // refused frames: base::CanFaults::tx_full
  }

 private:
  Can& can_;
  FrameHash* hash_ = nullptr;
};

}  // namespace tetap::bus
