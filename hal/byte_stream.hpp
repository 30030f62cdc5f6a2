// SPDX-License-Identifier: Apache-2.0
// Demands of a driver on a serial line. Neither call waits; the port owns pins, framing and interrupts.
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>

namespace tetap::hal {

/// Bytes that a line lost or damaged on the receiver's side, counted since start, never reset.
struct SerialFaults {
  std::uint32_t overrun = 0;  ///< bytes that came while the receiver still held the one before
  std::uint32_t framing = 0;  ///< bytes without a stop bit, or with noise on a bit
  std::uint32_t lapped = 0;   ///< bytes that newer ones overwrote before read() took them
};

template <class S>
concept ByteStream = requires(S& s, const S& view, std::span<std::uint8_t> in, std::span<const std::uint8_t> out) {
  /// Puts what has arrived into `in`, in order; the count of it.
  { s.read(in) } -> std::same_as<std::size_t>;
  /// Takes as many bytes as there is room for, in order; the count of them.
  { s.write(out) } -> std::same_as<std::size_t>;
  { view.faults() } -> std::same_as<SerialFaults>;
};

/// A line whose baud rate can be changed. Bytes written before go out at the old rate first. Bytes that arrived at the
/// old rate and were not read are lost.
template <class S>
concept SerialPort = ByteStream<S> && requires(S& s, std::uint32_t baud) {
  { s.set_baud(baud) } -> std::same_as<void>;
};

}  // namespace tetap::hal
