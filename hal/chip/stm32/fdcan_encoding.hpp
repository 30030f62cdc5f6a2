// SPDX-License-Identifier: Apache-2.0
// A CAN frame as an element of FDCAN's message RAM, its acceptance filter and its bit timing. RM0440 chapter "FD
// controller area network (FDCAN)", sections "Message RAM", "FDCAN Rx FIFO element", "FDCAN Tx buffer element",
// "FDCAN standard message ID filter element", "FDCAN nominal bit timing and prescaler register". The SVD lacks the
// message RAM: its places and fields are written down here.
#pragma once

#include "hal/can_bus.hpp"
#include "hal/chip/stm32/can_timing.hpp"
#include "hal/chip/stm32/registers_stm32g474.hpp"
#include "tetap/base/can_frame.hpp"

#include <cstdint>
#include <optional>

namespace tetap::hal::stm32 {

/// Message RAM of one FDCAN: byte offsets of its parts, which are fixed on the G4, and of the words in an element.
namespace message_ram {
inline constexpr std::uint32_t kStandardFilters = 0x000, kReceiveFifo0 = 0x0B0, kTransmitBuffers = 0x278, kEnd = 0x350;
inline constexpr std::uint32_t kElementBytes = 72, kReceiveElements = 3, kTransmitElements = 3;
inline constexpr std::uint32_t kIdentifier = 0, kControl = 4, kData = 8;
static_assert(kTransmitBuffers + kTransmitElements * kElementBytes == kEnd);

/// Fields of the first word (R0, T0), the second one (R1, T1) and of a standard filter (S0).
inline constexpr Field kExtendedId{0, 29}, kStandardId{18, 11}, kRemote{29}, kIsExtended{30};
inline constexpr Field kLength{16, 4};
inline constexpr Field kFilterMask{0, 11}, kFilterId{16, 11}, kFilterTarget{27, 3}, kFilterKind{30, 2};
}  // namespace message_ram

/// A classic frame's part of an element: no FD format, no bit rate switch, no transmit event.
struct FdcanElement {
  std::uint32_t identifier = 0;
  std::uint32_t control = 0;
  std::uint32_t low = 0;   ///< bytes 0 to 3, the first one lowest
  std::uint32_t high = 0;  ///< bytes 4 to 7

  friend constexpr bool operator==(const FdcanElement&, const FdcanElement&) = default;
};

inline constexpr std::uint8_t kClassicMostBytes = 8;

[[nodiscard]] constexpr FdcanElement to_element(const base::CanFrame& frame) {
  const std::uint8_t size = frame.size < kClassicMostBytes ? frame.size : kClassicMostBytes;
  FdcanElement element{.identifier = frame.extended
                                         ? message_ram::kExtendedId(frame.id) | message_ram::kIsExtended.mask()
                                         : message_ram::kStandardId(frame.id),
                       .control = message_ram::kLength(size)};
  for (unsigned i = 0; i < size; ++i) {
    (i < 4 ? element.low : element.high) |= std::uint32_t{frame.data[i]} << (8 * (i % 4));
  }
  return element;
}

/// Empty for a remote frame, which carries no data.
[[nodiscard]] constexpr std::optional<base::CanFrame> to_frame(const FdcanElement& element) {
  if (message_ram::kRemote.of(element.identifier) != 0) return std::nullopt;
  const bool extended = message_ram::kIsExtended.of(element.identifier) != 0;
  base::CanFrame frame{.id = (extended ? message_ram::kExtendedId : message_ram::kStandardId).of(element.identifier),
                       .extended = extended};
  const std::uint32_t length = message_ram::kLength.of(element.control);  // 9 to 15 mean 8 bytes: ISO 11898-1
  frame.size = static_cast<std::uint8_t>(length < kClassicMostBytes ? length : kClassicMostBytes);
  for (unsigned i = 0; i < frame.size; ++i) {
    frame.data[i] = static_cast<std::uint8_t>((i < 4 ? element.low : element.high) >> (8 * (i % 4)));
  }
  return frame;
}

/// A standard filter element: identifier and mask, into FIFO 0.
[[nodiscard]] constexpr std::uint32_t fdcan_filter_word(const Acceptance& acceptance) {
  constexpr std::uint32_t kIdAndMask = 2, kIntoFifo0 = 1;
  return message_ram::kFilterKind(kIdAndMask) | message_ram::kFilterTarget(kIntoFifo0) |
         message_ram::kFilterId(acceptance.id) | message_ram::kFilterMask(acceptance.mask);
}

/// The fields of NBTP.
inline constexpr CanTimingLimits kFdcanTimingLimits{.prescaler = 1U << stm32g474::fdcan::nbtp::kNbrp.width,
                                                    .segment1 = 1U << stm32g474::fdcan::nbtp::kNtseg1.width,
                                                    .segment2 = 1U << stm32g474::fdcan::nbtp::kNtseg2.width,
                                                    .jump = 1U << stm32g474::fdcan::nbtp::kNsjw.width};

[[nodiscard]] constexpr std::uint32_t nbtp(const CanBitTiming& timing) {
  namespace nbtp = stm32g474::fdcan::nbtp;
  return nbtp::kNbrp(timing.prescaler - 1) | nbtp::kNtseg1(timing.segment1 - 1) | nbtp::kNtseg2(timing.segment2 - 1) |
         nbtp::kNsjw(timing.jump - 1);
}

}  // namespace tetap::hal::stm32
