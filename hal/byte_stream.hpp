// SPDX-License-Identifier: Apache-2.0
// What a driver asks of a serial line. Neither call waits; the port owns pins, framing and interrupts.
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>

namespace tetap::hal {

template <class S>
concept ByteStream = requires(S& s, std::span<std::uint8_t> in, std::span<const std::uint8_t> out) {
  /// Puts what has arrived into `in`, in order; the count of it.
  { s.read(in) } -> std::same_as<std::size_t>;
  /// Takes as many bytes as there is room for, in order; the count of them.
  { s.write(out) } -> std::same_as<std::size_t>;
};

/// A line whose baud rate can be changed. What was written before is sent at the old rate first; bytes that arrived at
/// the old rate and were not read are lost.
template <class S>
concept SerialPort = ByteStream<S> && requires(S& s, std::uint32_t baud) {
  { s.set_baud(baud) } -> std::same_as<void>;
};

}  // namespace tetap::hal
