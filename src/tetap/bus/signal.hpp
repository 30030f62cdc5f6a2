// SPDX-License-Identifier: Apache-2.0
// One signal of a classic CAN frame: where its bits are, and how a field of a message struct becomes those bits and
// back. Little-endian (DBC "Intel"). Values out of range saturate, never wrap; NaN is the not-available code. The same
// bits on every target: one correctly rounded division decodes, one product encodes, and no float becomes an integer
// before its range is known.
#pragma once

#include <array>
#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <type_traits>
#include <utility>

namespace tetap::bus {

using Payload = std::array<std::uint8_t, 8>;

struct Signal {
  std::uint8_t start = 0;
  std::uint8_t length = 1;
  bool is_signed = false;
  bool wraps = false;          ///< counters, stamps, masks: the low bits are the meaning
  bool has_gap = false;        ///< the code beyond the range means "not available"
  std::uint32_t per_unit = 1;  ///< steps per unit: 1 / the scale of the DBC

  [[nodiscard]] constexpr std::uint64_t mask() const { return ~std::uint64_t{0} >> (64U - length); }
  /// Code for a value that is not available: all ones, or the most negative.
  [[nodiscard]] constexpr std::int64_t gap() const {
    return is_signed ? -(std::int64_t{1} << (length - 1)) : static_cast<std::int64_t>(mask());
  }
  [[nodiscard]] constexpr std::int64_t lowest() const { return is_signed ? gap() + (has_gap ? 1 : 0) : 0; }
  [[nodiscard]] constexpr std::int64_t highest() const {
    return static_cast<std::int64_t>(mask() >> (is_signed ? 1U : 0U)) - (has_gap && !is_signed ? 1 : 0);
  }

  /// The signal's steps in a frame taken as one little-endian word.
  [[nodiscard]] constexpr std::int64_t get(std::uint64_t word) const {
    const std::uint64_t bits = (word >> start) & mask();
    const std::uint64_t sign = is_signed ? std::uint64_t{1} << (length - 1U) : 0U;
    return static_cast<std::int64_t>((bits ^ sign) - sign);
  }
  /// Word that holds `steps` in this signal's bits; its other bits are 0.
  [[nodiscard]] constexpr std::uint64_t put(std::int64_t steps) const {
    return (static_cast<std::uint64_t>(steps) & mask()) << start;
  }
};

/// A signal as a type, so that all its numbers are constants where it is packed.
template <Signal kSignal>
struct At {};

/// Rounds to nearest, halves away from zero. For |value| < 2^24 (the caller has checked).
[[nodiscard]] constexpr std::int32_t nearest(float value) {
  const auto whole = static_cast<std::int32_t>(value);
  const float rest = value - static_cast<float>(whole);
  return whole + (rest >= 0.5F ? 1 : 0) - (rest <= -0.5F ? 1 : 0);
}

/// Physical value to steps. The range is compared in units, where infinity and the largest float are ordinary numbers.
template <Signal kSignal>
[[nodiscard]] constexpr std::int64_t to_steps(float value) {
  static_assert(kSignal.has_gap && kSignal.highest() < (1 << 24) && kSignal.lowest() > -(1 << 24));
  constexpr auto kPerUnit = static_cast<float>(kSignal.per_unit);
  constexpr float kLowest = static_cast<float>(kSignal.lowest()) / kPerUnit;
  constexpr float kHighest = static_cast<float>(kSignal.highest()) / kPerUnit;
  if (value > kLowest && value < kHighest) {
    const std::int32_t steps = nearest(value * kPerUnit);
    if constexpr (kSignal.length > 22) {  // the product's own rounding can reach half a step and lead to a neighbour
      if (static_cast<float>(steps - 1) / kPerUnit >= value) return steps - 1;
      if (static_cast<float>(steps + 1) / kPerUnit <= value) return steps + 1;
    }
    return steps;
  }
  if (value >= kHighest) return kSignal.highest();
  if (value <= kLowest) return kSignal.lowest();
  return kSignal.gap();  // NaN
}

/// Integer, flag or enum to steps. An integer's own not-available code is the largest (unsigned) or smallest (signed)
/// of its type.
template <Signal kSignal, class T>
requires std::integral<T> || std::is_enum_v<T>
[[nodiscard]] constexpr std::int64_t to_steps(T value) {
  if constexpr (std::is_enum_v<T>) {
    return to_steps<kSignal>(static_cast<std::underlying_type_t<T>>(value));
  } else if constexpr (std::is_same_v<T, bool>) {
    return value ? 1 : 0;
  } else {
    if constexpr (kSignal.wraps) return static_cast<std::int64_t>(value);
    if constexpr (kSignal.has_gap) {
      constexpr T kGap = kSignal.is_signed ? std::numeric_limits<T>::min() : std::numeric_limits<T>::max();
      if (value == kGap) return kSignal.gap();
    }
    if (std::cmp_greater(value, kSignal.highest())) return kSignal.highest();
    if (std::cmp_less(value, kSignal.lowest())) return kSignal.lowest();
    return static_cast<std::int64_t>(value);
  }
}

/// Steps to the field's type.
template <Signal kSignal, class T>
[[nodiscard]] constexpr T from_steps(std::int64_t steps) {
  if constexpr (std::is_same_v<T, float>) {
    if (steps == kSignal.gap()) return std::numeric_limits<float>::quiet_NaN();
    return static_cast<float>(static_cast<std::int32_t>(steps)) / static_cast<float>(kSignal.per_unit);
  } else {
    if constexpr (kSignal.has_gap) {
      if (steps == kSignal.gap())
        return kSignal.is_signed ? std::numeric_limits<T>::min() : std::numeric_limits<T>::max();
    }
    return static_cast<T>(steps);
  }
}

static_assert(std::endian::native == std::endian::little, "a payload is a word as it lies in memory");
/// A payload as one little-endian word, and back. Missing bytes are 0.
[[nodiscard]] constexpr std::uint64_t word(std::span<const std::uint8_t> bytes) {
  Payload payload{};
  for (std::size_t i = 0; i < bytes.size() && i < payload.size(); ++i) payload[i] = bytes[i];
  return std::bit_cast<std::uint64_t>(payload);
}
[[nodiscard]] constexpr Payload bytes(std::uint64_t value) { return std::bit_cast<Payload>(value); }

}  // namespace tetap::bus
