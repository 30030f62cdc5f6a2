// SPDX-License-Identifier: Apache-2.0
// A CAN frame as the four words of the ZynqMP controller's FIFOs, and acceptance filters, which use the same identifier
// word. UG1085 (v2.4) chapter "CAN Controller", section "Message Format", table 20-3; UG1087 CAN registers TXFIFO_ID,
// RXFIFO_ID, AFMR, AFIR.
#pragma once

#include "hal/chip/zynqmp/machine.hpp"
#include "tetap/base/can_frame.hpp"

#include <cstdint>
#include <optional>

namespace tetap::hal::zynqmp_r5 {

struct CanIdentifier {
  std::uint32_t id = 0;
  bool extended = false;
  bool remote = false;  ///< also set for anything else that is not a data frame

  friend constexpr bool operator==(const CanIdentifier&, const CanIdentifier&) = default;
};

/// One message as the FIFO registers hold it, in the order they must be written and read.
struct CanWords {
  std::uint32_t id = 0;
  std::uint32_t dlc = 0;
  std::uint32_t data1 = 0;
  std::uint32_t data2 = 0;

  friend constexpr bool operator==(const CanWords&, const CanWords&) = default;
};

namespace silicon {

inline constexpr unsigned kIdHighShift = 21;  // IDH: standard identifier, or the upper 11 bits of an extended one
inline constexpr std::uint32_t kSrrRtr = 1U << 20;
inline constexpr std::uint32_t kIde = 1U << 19;
inline constexpr unsigned kIdLowShift = 1;  // IDL: the lower 18 bits of an extended identifier
inline constexpr std::uint32_t kIdLowMask = (1U << 18) - 1;
inline constexpr std::uint32_t kRtr = 1U << 0;

[[nodiscard]] constexpr std::uint32_t id_word(CanIdentifier of) {
  if (!of.extended) return (of.id & 0x7FFU) << kIdHighShift | (of.remote ? kSrrRtr : 0);
  // For extended frames SRR is sent recessive (1) whether remote or not.
  return ((of.id >> 18) & 0x7FFU) << kIdHighShift | kSrrRtr | kIde | (of.id & kIdLowMask) << kIdLowShift |
         (of.remote ? kRtr : 0);
}

[[nodiscard]] constexpr CanIdentifier identifier(std::uint32_t word) {
  const std::uint32_t high = word >> kIdHighShift;
  if ((word & kIde) == 0) return {.id = high, .extended = false, .remote = (word & kSrrRtr) != 0};
  return {.id = high << 18 | ((word >> kIdLowShift) & kIdLowMask), .extended = true, .remote = (word & kRtr) != 0};
}

/// Place of byte 0..3 in a data word: the first byte on the wire is the most significant.
[[nodiscard]] constexpr unsigned byte_shift(unsigned byte) { return 24U - 8U * byte; }

}  // namespace silicon

namespace emulated {

// QEMU 7.2 passes Linux's can_id through unchanged (include/uapi/linux/can.h) and the data in memory order.
inline constexpr std::uint32_t kExtended = 1U << 31;
inline constexpr std::uint32_t kRemote = 1U << 30;
inline constexpr std::uint32_t kError = 1U << 29;

[[nodiscard]] constexpr std::uint32_t id_word(CanIdentifier of) {
  return (of.extended ? kExtended | (of.id & 0x1FFF'FFFFU) : of.id & 0x7FFU) | (of.remote ? kRemote : 0);
}

[[nodiscard]] constexpr CanIdentifier identifier(std::uint32_t word) {
  const bool extended = (word & kExtended) != 0;
  return {.id = word & (extended ? 0x1FFF'FFFFU : 0x7FFU),
          .extended = extended,
          .remote = (word & (kRemote | kError)) != 0};
}

[[nodiscard]] constexpr unsigned byte_shift(unsigned byte) { return 8U * byte; }

}  // namespace emulated

[[nodiscard]] constexpr std::uint32_t id_word(Machine machine, CanIdentifier of) {
  return machine == Machine::kSilicon ? silicon::id_word(of) : emulated::id_word(of);
}

[[nodiscard]] constexpr unsigned byte_shift(Machine machine, unsigned byte) {
  return machine == Machine::kSilicon ? silicon::byte_shift(byte) : emulated::byte_shift(byte);
}

inline constexpr unsigned kDlcShift = 28;  // bits 27:0 are reserved, or the time stamp of a received frame
inline constexpr std::uint8_t kMaxSize = 8;

/// Words for TXFIFO_ID, _DLC, _DATA1, _DATA2. Unused data bytes are zero.
[[nodiscard]] constexpr CanWords to_words(Machine machine, const base::CanFrame& frame) {
  const std::uint8_t size = frame.size < kMaxSize ? frame.size : kMaxSize;
  CanWords words{.id = id_word(machine, {.id = frame.id, .extended = frame.extended}),
                 .dlc = std::uint32_t{size} << kDlcShift};
  for (unsigned i = 0; i < size; ++i) {
    (i < 4 ? words.data1 : words.data2) |= std::uint32_t{frame.data[i]} << byte_shift(machine, i % 4);
  }
  return words;
}

/// Frame from the RXFIFO registers; empty for a remote frame, which carries no data.
[[nodiscard]] constexpr std::optional<base::CanFrame> to_frame(Machine machine, const CanWords& words) {
  const CanIdentifier from =
      machine == Machine::kSilicon ? silicon::identifier(words.id) : emulated::identifier(words.id);
  if (from.remote) return std::nullopt;
  base::CanFrame frame{.id = from.id, .extended = from.extended};
  const std::uint32_t dlc = words.dlc >> kDlcShift;  // 9..15 mean eight bytes (ISO 11898-1, classical frames)
  frame.size = static_cast<std::uint8_t>(dlc < kMaxSize ? dlc : kMaxSize);
  for (unsigned i = 0; i < frame.size; ++i) {
    frame.data[i] = static_cast<std::uint8_t>((i < 4 ? words.data1 : words.data2) >> byte_shift(machine, i % 4));
  }
  return frame;
}

/// Lets data frames through whose identifier equals `id` in every bit that is set in `mask`.
struct AcceptanceFilter {
  std::uint32_t id = 0;
  std::uint32_t mask = 0;
  bool extended = false;
};

struct AcceptanceWords {
  std::uint32_t mask = 0;  ///< AFMR: 1 = this bit is compared
  std::uint32_t id = 0;    ///< AFIR

  friend constexpr bool operator==(const AcceptanceWords&, const AcceptanceWords&) = default;
};

[[nodiscard]] constexpr AcceptanceWords to_words(Machine machine, const AcceptanceFilter& filter) {
  const CanIdentifier wanted{.id = filter.id, .extended = filter.extended};
  const std::uint32_t id_bits = id_word(machine, {.id = filter.mask, .extended = filter.extended}) ^
                                id_word(machine, {.id = 0, .extended = filter.extended});
  // Frame size and data-not-remote are always compared; the bits for that are those the identifier word sets for
  // them.
  const std::uint32_t kind_bits = machine == Machine::kEmulated
                                      ? emulated::kExtended | emulated::kRemote | emulated::kError
                                  : filter.extended ? silicon::kIde | silicon::kRtr
                                                    : silicon::kIde | silicon::kSrrRtr;
  return {.mask = id_bits | kind_bits, .id = id_word(machine, wanted)};
}

}  // namespace tetap::hal::zynqmp_r5
