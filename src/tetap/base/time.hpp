// SPDX-License-Identifier: Apache-2.0
// Time as data: integer microseconds. Nothing in src/ asks what time it is; every sample and every call carries it.
#pragma once

#include <compare>
#include <cstdint>

namespace tetap::base {

/// A point of time or a span of it, in microseconds. 64 bits: 292 000 years, so no wrap is ever handled.
struct Micros {
  std::int64_t us = 0;

  friend constexpr auto operator<=>(Micros, Micros) = default;
  friend constexpr Micros operator+(Micros a, Micros b) { return {a.us + b.us}; }
  friend constexpr Micros operator-(Micros a, Micros b) { return {a.us - b.us}; }
  constexpr Micros& operator+=(Micros b) { return us += b.us, *this; }
};

/// The span in seconds, for |span| <= 2147 s; longer spans saturate. The conversion from integer stays the hardware's
/// single correctly rounded instruction on every target.
[[nodiscard]] constexpr float seconds(Micros span) {
  constexpr std::int64_t kLimit_us = 2'147'000'000;
  const std::int64_t us = span.us > kLimit_us ? kLimit_us : span.us < -kLimit_us ? -kLimit_us : span.us;
  return static_cast<float>(static_cast<std::int32_t>(us)) * 1e-6F;
}

/// The full time nearest to `reference` whose low `bits` bits are `low`: how a stamp of few bits on the bus becomes
/// absolute. Right as long as the truth is less than half a wrap away from the reference.
[[nodiscard]] constexpr Micros extend(std::uint32_t low, int bits, Micros reference) {
  const std::uint64_t wrap = std::uint64_t{1} << bits;
  const auto ahead = (low - static_cast<std::uint64_t>(reference.us)) & (wrap - 1);
  const auto offset = static_cast<std::int64_t>(ahead) - (ahead >= wrap / 2 ? static_cast<std::int64_t>(wrap) : 0);
  return {reference.us + offset};
}

}  // namespace tetap::base
