// SPDX-License-Identifier: Apache-2.0
// A coordinate as integer anchor plus small float offset: the float keeps micrometres however far the origin is, and
// the filter arithmetic stays in float.
#pragma once

#include "tetap/base/float_bits.hpp"

#include <cstdint>

namespace tetap::base {

/// metres() beyond 2147 m, where a core of 32 bits divides in software.
[[nodiscard, gnu::noinline]] constexpr float far_metres(std::int64_t um) {
  constexpr std::int64_t kPerMetre = 1'000'000;
  const std::int64_t whole = um / kPerMetre;
  if (whole > 2'000'000'000 || whole < -2'000'000'000) return whole > 0 ? 2e9F : -2e9F;
  return static_cast<float>(static_cast<std::int32_t>(whole)) +
         static_cast<float>(static_cast<std::int32_t>(um % kPerMetre)) * 1e-6F;
}
/// Micrometres as metres, in two exactly representable parts; |um| up to 2^31 m.
[[nodiscard]] constexpr float metres(std::int64_t um) {
  constexpr std::int32_t kPerMetre = 1'000'000;
  const auto near = static_cast<std::int32_t>(um);
  if (near != um) return far_metres(um);
  const std::int32_t whole = near / kPerMetre;
  return static_cast<float>(whole) + static_cast<float>(near % kPerMetre) * 1e-6F;
}

/// Metres as micrometres, rounded to nearest; saturates at +-2000 m (callers hold offsets below 256 m). NaN gives 0.
[[nodiscard]] constexpr std::int64_t micrometres(float m) {
  const float bounded = m > 2000.0F ? 2000.0F : m < -2000.0F ? -2000.0F : is_nan(m) ? 0.0F : m;
  const float um = bounded * 1e6F;
  return static_cast<std::int32_t>(um < 0.0F ? um - 0.5F : um + 0.5F);
}

/// Axis coordinate. Invariant after settle(): |offset_m| <= 128.
struct Anchored {
  std::int64_t anchor_um = 0;
  float offset_m = 0;

  static constexpr Anchored from_um(std::int64_t um) { return Anchored{.anchor_um = um, .offset_m = 0}; }

  /// The coordinate moved by d metres.
  [[nodiscard]] constexpr Anchored plus(float d_m) const {
    Anchored moved{.anchor_um = anchor_um, .offset_m = offset_m + d_m};
    constexpr float kNear_m = 128.0F;
    const float size_m = moved.offset_m < 0.0F ? -moved.offset_m : moved.offset_m;
    if (!(size_m <= kNear_m)) moved.settle();
    return moved;
  }
  /// Difference from `other`, in metres.
  [[nodiscard]] constexpr float minus(const Anchored& other) const {
    const std::int64_t apart_um = anchor_um - other.anchor_um;
    const float offsets_m = offset_m - other.offset_m;
    return apart_um == 0 ? offsets_m : metres(apart_um) + offsets_m;
  }
  [[nodiscard]] constexpr std::int64_t um() const { return anchor_um + micrometres(offset_m); }

 private:
  /// Moves the anchor so that the offset is small again. The step of 256 m is exact in float and in micrometres.
  /// x - 256 is exact for x in [128, 512] (Sterbenz). No bit of the position is lost. A jump beyond is re-anchored
  /// whole.
  [[gnu::noinline]] constexpr void settle() {
    constexpr float kStep_m = 256.0F;
    constexpr std::int64_t kStep_um = 256'000'000;
    if (offset_m > 384.0F || offset_m < -384.0F) {
      const std::int64_t whole_um = micrometres(offset_m);
      anchor_um += whole_um;
      offset_m = 0.0F;
    } else if (offset_m > 128.0F) {
      anchor_um += kStep_um;
      offset_m -= kStep_m;
    } else if (offset_m < -128.0F) {
      anchor_um -= kStep_um;
      offset_m += kStep_m;
    }
  }
};

}  // namespace tetap::base
