// SPDX-License-Identifier: Apache-2.0
#include "sim_host/csv/importer.hpp"

namespace tetap::csv {

namespace {

constexpr const char* kBeyond = "beyond the range of their signals";
constexpr const char* kWithout = "without its values";

/// East and north of speed and course, or as they stand.
std::optional<std::array<double, 2>> ground_velocity(std::span<const double> row) {
  if (!std::isnan(row[2]) && !std::isnan(row[3])) return std::array{row[2], row[3]};
  if (std::isnan(row[0]) || std::isnan(row[1])) return std::nullopt;
  return std::array{row[0] * std::sin(row[1]), row[0] * std::cos(row[1])};
}

/// Heading of body x, counter-clockwise from east. NaN: the row has none.
double heading_of(std::span<const double> row, const QuaternionForm& form) {
  if (!std::isnan(row[0])) return wrapped(row[0]);
  if (!std::isnan(row[1])) return wrapped(kPi / 2 - row[1]);
  const double w = row[3], side = form.inverse ? -1.0 : 1.0;
  const double x = side * row[4], y = side * row[5], z = side * row[6];
  const double square = w * w + x * x + y * y + z * z;
  if (!(square > 0.9 && square < 1.1)) return kNoValue;
  const double yaw = std::atan2(2 * (w * z + x * y), w * w + x * x - y * y - z * z);
  return form.ned ? wrapped(kPi / 2 - yaw) : yaw;
}

}  // namespace

void Importer::others() {
  each(Kind::kMag, "mag", [](std::span<const double> r, auto&& send) -> const char* {
    sensor::MagneticFlux sample;
    if (std::isnan(r[0] + r[1] + r[2])) return kWithout;
    for (std::size_t k = 0; k < 3; ++k) {
      if (!says<bus::InMag::kFluxX>(r[k])) return kBeyond;
      sample.flux_b_uT[k] = static_cast<float>(r[k]);
    }
    return send(sample), nullptr;
  });
  each(Kind::kBaro, "baro", [](std::span<const double> r, auto&& send) -> const char* {
    if (std::isnan(r[0])) return kWithout;
    if (!says<bus::InBaro::kPressure>(r[0]) || !says_or_none<bus::InBaro::kTemp>(r[1])) return kBeyond;
    return send(sensor::AirPressure{static_cast<float>(r[0]), static_cast<float>(r[1])}), nullptr;
  });
  each(Kind::kFix, "gnss", [](std::span<const double> r, auto&& send) -> const char* {
    constexpr double kPerDegree = 1 / bus::InGnssLat::kLatScale;
    if (std::isnan(r[0]) || std::isnan(r[1])) return kWithout;
    if ((std::abs(r[0]) < 1e-9 && std::abs(r[1]) < 1e-9) || r[3] < 0) return "without a place";
    if (!(std::abs(r[0]) <= 90) || !says<bus::InGnssLon::kLon>(r[1], kPerDegree)) return "off the earth";
    const double vertical = r[4] < 0 ? kNoValue : r[4];
    if (!says_or_none<bus::InGnssAlt::kHeight>(r[2]) || !says_or_none<bus::InGnssAcc::kHor>(r[3]) ||
        !says_or_none<bus::InGnssAcc::kVer>(vertical))
      return kBeyond;
    constexpr std::uint8_t kUnknown = std::numeric_limits<std::uint8_t>::max();
    return send(sensor::GnssPosition{
               .latitude_2ndeg = std::llround(r[0] * kPerDegree),
               .longitude_2ndeg = std::llround(r[1] * kPerDegree),
               .height_m = static_cast<float>(r[2]),
               .horizontal_acc_m = static_cast<float>(r[3]),
               .vertical_acc_m = static_cast<float>(vertical),
               .fix = std::isnan(r[2]) ? sensor::GnssFix::k2d : sensor::GnssFix::k3d,
               .satellites = r[5] >= 0 && r[5] <= 62 ? static_cast<std::uint8_t>(r[5]) : kUnknown}),
           nullptr;
  });
  each(Kind::kVelocity, "velocity", [](std::span<const double> r, auto&& send) -> const char* {
    // Telephones write -1 for a speed, a course or an accuracy that they do not know.
    if (r[0] < 0 || r[5] < 0 || (std::isnan(r[2]) && std::abs(r[1] + kPi / 180) < 1e-9))
      return "whose receiver knew none";
    const auto ground = ground_velocity(r);
    if (!ground) return kWithout;
    const double up = std::isnan(r[4]) ? -r[6] : r[4];
    using Plane = bus::InGnssVelEN;
    using Rest = bus::InGnssVelU;
    if (!says<Plane::kEast>((*ground)[0]) || !says<Plane::kNorth>((*ground)[1]) || !says_or_none<Rest::kUp>(up) ||
        !says_or_none<Rest::kAcc>(r[5]))
      return kBeyond;
    return send(sensor::GnssVelocity{
               .v_n_mps = {static_cast<float>((*ground)[0]), static_cast<float>((*ground)[1]), static_cast<float>(up)},
               .acc_mps = static_cast<float>(r[5])}),
           nullptr;
  });
  each(Kind::kWheelSpeed, "wheels", [](std::span<const double> r, auto&& send) -> const char* {
    if (std::isnan(r[0] + r[1])) return kWithout;
    if (!says<bus::InWheelSpeed::kLeft>(r[0]) || !says<bus::InWheelSpeed::kRight>(r[1])) return kBeyond;
    return send(sensor::WheelSpeeds{static_cast<float>(r[0]), static_cast<float>(r[1])}), nullptr;
  });
  each(Kind::kWheelCounts, "counts", [](std::span<const double> r, auto&& send) -> const char* {
    if (!(std::abs(r[0]) < 9e15 && std::abs(r[1]) < 9e15)) return kWithout;
    const auto wraps = [](double count) { return static_cast<std::uint16_t>(std::llround(count) & 0xFFFF); };
    return send(sensor::WheelCounts{wraps(r[0]), wraps(r[1])}), nullptr;
  });
  each(Kind::kBody, "body", [](std::span<const double> r, auto&& send) -> const char* {
    if (std::isnan(r[0])) return kWithout;
    if (!says<bus::InBodySpeed::kForward>(r[0]) || !says_or_none<bus::InBodySpeed::kYawRate>(r[1])) return kBeyond;
    return send(sensor::BodySpeed{static_cast<float>(r[0]), static_cast<float>(r[1])}), nullptr;
  });
  each(Kind::kHeading, "heading", [this](std::span<const double> r, auto&& send) -> const char* {
    const double heading_rad = heading_of(r, quaternion_);
    if (std::isnan(heading_rad)) return kWithout;
    if (!says_or_none<bus::InHeading::kAcc>(r[2])) return kBeyond;
    return send(sensor::OutsideHeading{static_cast<float>(heading_rad), static_cast<float>(r[2])}), nullptr;
  });
  each(Kind::kSighting, "sighting", [](std::span<const double> r, auto&& send) -> const char* {
    if (std::isnan(r[1]) && std::isnan(r[2])) return kWithout;
    const bool radar = !std::isnan(r[3]);
    sensor::LandmarkSighting sample{.landmark = 0xFF,
                                    .range_m = static_cast<float>(r[1]),
                                    .bearing_rad = static_cast<float>(wrapped(r[2])),
                                    .range_rate_mps = static_cast<float>(r[3])};
    if (radar) {
      if (!says<bus::InRadar::kRange>(r[1]) || std::isnan(r[2]) || !says<bus::InRadar::kRangeRate>(r[3]))
        return kBeyond;
    } else {
      if (!says_or_none<bus::InRangeBearing::kRange>(r[1]) || r[0] < 0 || r[0] > 254) return kBeyond;
      if (!std::isnan(r[0])) sample.landmark = static_cast<std::uint8_t>(r[0]);
    }
    return send(sample), nullptr;
  });
}

}  // namespace tetap::csv
