// SPDX-License-Identifier: Apache-2.0
// A CAN frame as the four words of a bxCAN mailbox, and acceptance filters, which use the same identifier word. RM0402
// chapter "Controller area network (bxCAN)", sections "Message storage", "Identifier filtering" (32-bit mask mode) and
// the mailbox registers.
#pragma once

#include "hal/chip/stm32/registers_stm32f412.hpp"
#include "tetap/base/can_frame.hpp"

#include <cstdint>
#include <optional>

namespace tetap::hal::stm32 {

/// A mailbox without TXRQ, in the order of its registers TIxR (RIxR), TDTxR, TDLxR, TDHxR.
struct CanMailbox {
  std::uint32_t identifier = 0;
  std::uint32_t length = 0;
  std::uint32_t low = 0;   ///< bytes 0 to 3, the first one lowest
  std::uint32_t high = 0;  ///< bytes 4 to 7

  friend constexpr bool operator==(const CanMailbox&, const CanMailbox&) = default;
};

inline constexpr std::uint8_t kCanMostBytes = 8;

/// STID holds a standard identifier; an extended one has its upper 11 bits there and the other 18 in EXID.
[[nodiscard]] constexpr std::uint32_t can_identifier_word(std::uint32_t id, bool extended) {
  namespace ti = stm32f412::can::tixr;
  if (!extended) return ti::kStid(id);
  return ti::kStid(id >> ti::kExid.width) | ti::kExid(id) | ti::kIde.mask();
}

[[nodiscard]] constexpr CanMailbox to_mailbox(const base::CanFrame& frame) {
  const std::uint8_t size = frame.size < kCanMostBytes ? frame.size : kCanMostBytes;
  CanMailbox box{.identifier = can_identifier_word(frame.id, frame.extended),
                 .length = stm32f412::can::tdtxr::kDlc(size)};
  for (unsigned i = 0; i < size; ++i) (i < 4 ? box.low : box.high) |= std::uint32_t{frame.data[i]} << (8 * (i % 4));
  return box;
}

/// Empty for a remote frame, which carries no data.
[[nodiscard]] constexpr std::optional<base::CanFrame> to_frame(const CanMailbox& box) {
  namespace ri = stm32f412::can::rixr;
  if (ri::kRtr.of(box.identifier) != 0) return std::nullopt;
  const bool extended = ri::kIde.of(box.identifier) != 0;
  const std::uint32_t standard = ri::kStid.of(box.identifier);
  base::CanFrame frame{.id = extended ? standard << ri::kExid.width | ri::kExid.of(box.identifier) : standard,
                       .extended = extended};
  const std::uint32_t length = stm32f412::can::rdtxr::kDlc.of(box.length);  // 9 to 15 mean 8 bytes: ISO 11898-1
  frame.size = static_cast<std::uint8_t>(length < kCanMostBytes ? length : kCanMostBytes);
  for (unsigned i = 0; i < frame.size; ++i) {
    frame.data[i] = static_cast<std::uint8_t>((i < 4 ? box.low : box.high) >> (8 * (i % 4)));
  }
  return frame;
}

/// Passes data frames whose identifier equals `id` in every bit of `mask`.
struct CanFilter {
  std::uint32_t id = 0;
  std::uint32_t mask = 0;
  bool extended = false;

  /// Register 1 of a bank in 32-bit mask mode.
  [[nodiscard]] constexpr std::uint32_t identifier_word() const { return can_identifier_word(id, extended); }
  /// Register 2: a bit that is set is compared. Kind (IDE) and data-not-remote (RTR) always are.
  [[nodiscard]] constexpr std::uint32_t mask_word() const {
    namespace ti = stm32f412::can::tixr;
    return can_identifier_word(mask, extended) | ti::kIde.mask() | ti::kRtr.mask();
  }
};

}  // namespace tetap::hal::stm32
