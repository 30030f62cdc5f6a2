// SPDX-License-Identifier: Apache-2.0
// Latitude, longitude, height to the local level plane (east, north, up) of an origin and back, by way of ECEF.
#pragma once

#include "tetap/base/math.hpp"
#include "tetap/base/members.hpp"
#include "tetap/base/wgs84.hpp"
#include "tetap/nav/local_level.hpp"

#include <cstdint>
#include <optional>

namespace tetap::nav {

/// Relative to an origin, integer micrometres. Not valid: further than 1000 km from the origin, or not a place on
/// Earth.
struct Local {
  std::int64_t east_um = 0;
  std::int64_t north_um = 0;
  std::int64_t up_um = 0;
  bool valid = false;
};

class LocalFrame {
 public:
  constexpr LocalFrame() = default;
  constexpr LocalFrame(std::int64_t latitude_2ndeg, std::int64_t longitude_2ndeg, float height_m)
      : latitude_2ndeg_(latitude_2ndeg),
        longitude_2ndeg_(longitude_2ndeg),
        height_m_(height_m),
        level_(latitude_2ndeg, longitude_2ndeg),
        origin_m_(base::ecef_m(level_, static_cast<double>(height_m))),
        curvature_(level_, static_cast<double>(height_m)) {}

  [[nodiscard]] constexpr std::int64_t latitude_2ndeg() const { return latitude_2ndeg_; }
  [[nodiscard]] constexpr std::int64_t longitude_2ndeg() const { return longitude_2ndeg_; }
  [[nodiscard]] constexpr float height_m() const { return height_m_; }
  [[nodiscard]] constexpr const Curvature& curvature() const { return curvature_; }

  /// A height that is not available counts as the origin's.
  [[nodiscard]] constexpr Local to_local(std::int64_t latitude_2ndeg, std::int64_t longitude_2ndeg,
                                         float height_m) const {
    constexpr std::int64_t kQuarterTurn = 45'000'000'000;
    if (latitude_2ndeg > kQuarterTurn || latitude_2ndeg < -kQuarterTurn || longitude_2ndeg > 4 * kQuarterTurn ||
        longitude_2ndeg < -4 * kQuarterTurn) {
      return {};
    }
    const double height = base::is_finite(height_m) ? static_cast<double>(height_m) : static_cast<double>(height_m_);
    const auto p = base::ecef_m(base::Level(latitude_2ndeg, longitude_2ndeg), height);
    const auto [east, north, up] = level_.to_enu({p.x - origin_m_.x, p.y - origin_m_.y, p.z - origin_m_.z});
    if (!near(east) || !near(north) || !near(up)) return {};
    return {.east_um = micrometres(east), .north_um = micrometres(north), .up_um = micrometres(up), .valid = true};
  }

  /// Longitude in [-180, 180] deg; at a pole any. The latitude and longitude are rounded to the bus's 2e-9 deg, a tenth
  /// of a millimetre each. Empty: not valid, further than 1000 km from the origin, or more than 350 km underground.
  [[nodiscard]] constexpr std::optional<base::Geodetic> to_geodetic(const Local& at) const {
    const base::Enu d{.east = metres(at.east_um), .north = metres(at.north_um), .up = metres(at.up_um)};
    if (!at.valid || !near(d.east) || !near(d.north) || !near(d.up)) return {};
    const base::Ecef p = level_.to_ecef(d);
    return base::geodetic_of({origin_m_.x + p.x, origin_m_.y + p.y, origin_m_.z + p.z});
  }
  static constexpr auto members(auto& self) {
    return base::members(self.latitude_2ndeg_, self.longitude_2ndeg_, self.height_m_, self.level_, self.origin_m_,
                         self.curvature_);
  }

 private:
  static constexpr bool near(double m) { return m > -1e6 && m < 1e6; }
  static constexpr std::int64_t micrometres(double m) {
    return static_cast<std::int64_t>(m * 1e6 + (m < 0 ? -0.5 : 0.5));
  }
  static constexpr double metres(std::int64_t um) { return static_cast<double>(um) * 1e-6; }

  std::int64_t latitude_2ndeg_ = 0;
  std::int64_t longitude_2ndeg_ = 0;
  float height_m_ = 0;
  base::Level level_{};
  base::Ecef origin_m_{};
  Curvature curvature_{};
};

/// East minus west, the short way round the Earth; both in [-180, 180] deg.
[[nodiscard]] constexpr std::int64_t longitude_difference_2ndeg(std::int64_t east_2ndeg, std::int64_t west_2ndeg) {
  constexpr std::int64_t kTurn = 180'000'000'000;
  const std::int64_t d = east_2ndeg - west_2ndeg;
  return d > kTurn / 2 ? d - kTurn : d < -kTurn / 2 ? d + kTurn : d;
}

}  // namespace tetap::nav
