// SPDX-License-Identifier: Apache-2.0
// Counter, instance and stamp of an input frame, whatever its message.
#pragma once

#include "tetap/base/can_frame.hpp"
#include "tetap/bus/codec.hpp"
#include "tetap/bus/messages.hpp"

#include <cstdint>
#include <optional>
#include <string_view>

namespace tetap::doctor {

/// One counter of samples: a message and an instance.
struct Header {
  std::uint32_t stream = 0;  ///< offset in the block and instance: 4 * offset + instance
  std::string_view message;
  std::uint8_t instance = 0;
  std::uint32_t counter = 0, modulus = 16;
  std::optional<std::uint32_t> stamp_us;
  std::optional<std::uint32_t> interval_us;
};
inline constexpr std::size_t kStreams = 4 * 0x20;

/// Nothing for a frame without a counter, and for one that does not decode.
[[nodiscard]] std::optional<Header> header_of(std::uint32_t offset, const base::CanFrame& frame);

}  // namespace tetap::doctor
