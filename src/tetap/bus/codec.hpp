// SPDX-License-Identifier: Apache-2.0
// Message structs to payloads and frames, and back; also in constant expressions. A message struct
// (config/messages.hpp) has
//   kOffset      its id within the node's block; kStride: the id distance of its instances, if there are several
//   each()       calls visit(At<signal>, field) for every field
//   kMux, kPage  where the page number is and which it is, if the struct is one page of a multiplexed message
#pragma once

#include "tetap/base/can_frame.hpp"
#include "tetap/bus/signal.hpp"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

namespace tetap::bus {

template <class M>
concept Paged = requires {
  M::kMux;
  M::kPage;
};
template <class M>
concept Repeated = requires {
  M::kStride;
};

template <class M>
[[nodiscard]] constexpr Payload encode(const M& message) {
  std::uint64_t packed = 0;
  if constexpr (Paged<M>) packed = M::kMux.put(M::kPage);
  M::each(message, [&packed]<Signal kSignal>(At<kSignal>, const auto& field) {
    packed |= kSignal.put(to_steps<kSignal>(field));
  });
  return bytes(packed);
}

/// Empty: wrong length, or another page. Unused bits are ignored. An enum may hold a value that has no enumerator.
template <class M>
[[nodiscard]] constexpr std::optional<M> decode(std::span<const std::uint8_t> payload) {
  if (payload.size() != M::kSize) return std::nullopt;
  const std::uint64_t packed = word(payload);
  if constexpr (Paged<M>) {
    if (M::kMux.get(packed) != M::kPage) return std::nullopt;
  }
  M message;
  M::each(message, [packed]<Signal kSignal>(At<kSignal>, auto& field) {
    field = from_steps<kSignal, std::remove_cvref_t<decltype(field)>>(kSignal.get(packed));
  });
  return message;
}

/// The bytes in use, whatever `size` claims.
[[nodiscard]] constexpr std::span<const std::uint8_t> payload(const base::CanFrame& frame) {
  return std::span(frame.data).first(frame.size < frame.data.size() ? frame.size : frame.data.size());
}

/// Id of a message within a node's block.
template <class M>
[[nodiscard]] constexpr std::uint32_t offset_of(std::size_t instance = 0) {
  if constexpr (Repeated<M>) {
    return static_cast<std::uint32_t>(M::kOffset + M::kStride * instance);
  } else {
    return M::kOffset;
  }
}

/// The message as the node with id base `base` sends it. `instance` counts for repeated messages only.
template <class M>
[[nodiscard]] constexpr base::CanFrame frame(std::uint32_t base, const M& message, std::size_t instance = 0) {
  return {.id = base + offset_of<M>(instance), .extended = false, .size = M::kSize, .data = encode(message)};
}

}  // namespace tetap::bus
