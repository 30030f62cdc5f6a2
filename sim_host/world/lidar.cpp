// SPDX-License-Identifier: Apache-2.0
#include "sim_host/world/lidar.hpp"

#include <algorithm>

namespace tetap::sim {
namespace {

int steps(double value, int per_unit) { return static_cast<int>(sim::floor(value * per_unit + 0.5)); }

}  // namespace

ScanBlock Lidar::Scan::block(std::size_t number) const {
  ScanBlock block{.block = static_cast<std::uint8_t>(number)};
  for (std::size_t i = 0; i < 4 && 4 * number + i < ranges.size(); ++i) block.ranges[i] = ranges[4 * number + i];
  return block;
}

Lidar::Lidar(const LidarNumbers& parameters, const Surroundings& surroundings, std::uint64_t seed)
    : parameters_{parameters},
      surroundings_{&surroundings},
      chance_{seed, Stream::kLidar},
      step_{steps(2 * kPi / parameters.beams, ScanHead::kStepsPerRadian)} {
  scan_.first = parameters.phase;
  scan_.head = {.count = static_cast<std::uint16_t>(parameters.beams),
                .first = static_cast<std::int16_t>(steps(parameters.first_rad, ScanHead::kFirstStepsPerRadian)),
                .step = static_cast<std::int16_t>(parameters.clockwise ? -step_ : step_)};
}

double Lidar::beam_us(int beam) const {
  const double turn_us = 1e6 / parameters_.rate_hz;
  return turn_us * (beam * step_) / (2 * kPi * ScanHead::kStepsPerRadian);
}

std::optional<Lidar::Scan> Lidar::sense(const Truth& from, const Truth& to, base::Micros before, base::Micros now,
                                        const Faults& faults) {
  std::optional<Scan> whole;
  for (;;) {
    const double at_us = static_cast<double>(scan_.first.us) + beam_us(static_cast<int>(scan_.ranges.size()));
    if (at_us > static_cast<double>(now.us)) return whole;
    const double share = (at_us - static_cast<double>(before.us)) / static_cast<double>((now - before).us);
    const auto between = [share](double a, double b) { return a + share * (b - a); };
    Truth truth = to;
    truth.x_m = between(from.x_m, to.x_m), truth.y_m = between(from.y_m, to.y_m);
    truth.z_m = between(from.z_m, to.z_m);
    truth.roll_rad = between(from.roll_rad, to.roll_rad), truth.pitch_rad = between(from.pitch_rad, to.pitch_rad);
    truth.yaw_rad = from.yaw_rad + share * wrap(to.yaw_rad - from.yaw_rad);
    scan_.ranges.push_back(range(truth, {static_cast<std::int64_t>(at_us)}, faults));
    if (static_cast<int>(scan_.ranges.size()) < parameters_.beams) continue;
    whole = scan_;
    scan_.ranges.clear();
    scan_.first += base::Micros{1'000'000 / parameters_.rate_hz};
  }
}

/// Range of the next beam. The draws are the same for each, whatever it hits.
std::uint16_t Lidar::range(const Truth& truth, base::Micros at, const Faults& faults) {
  const double noise_m = chance_.normal(parameters_.sigma_m);
  const bool dropped = chance_.happens(parameters_.dropout_probability);
  const double glass = chance_.uniform();

  double bearing_rad =
      static_cast<double>(scan_.head.first) / ScanHead::kFirstStepsPerRadian +
      static_cast<double>(scan_.head.step) * static_cast<double>(scan_.ranges.size()) / ScanHead::kStepsPerRadian;
  if (faults.active(Fault::kLidarMirrored, at)) bearing_rad = -bearing_rad;
  if (faults.active(Fault::kLidarTurned, at)) bearing_rad += FaultNumbers::kLidarTurned_rad;
  const Direction d = direction(bearing_rad + parameters_.yaw_rad + parameters_.mount_error_rad);
  const Matrix3 to_n = rotation({truth.roll_rad, truth.pitch_rad, truth.yaw_rad});
  const Ray ray{.from_m = Vector3{truth.x_m, truth.y_m, truth.z_m} +
                          to_n * Vector3{parameters_.x_b_m, parameters_.y_b_m, parameters_.z_b_m},
                .along = to_n * Vector3{d.cos, d.sin, 0}};
  auto hit = surroundings_->nearest(ray, at, false);
  const bool all_glass = faults.active(Fault::kLidarGlass, at);
  if (hit && (hit->surface == Surface::kGlass || all_glass) && hit->incidence_cos < parameters_.glass_square_cos) {
    if (glass >= parameters_.glass_through) return 0;
    // Behind a wall of glass: what is there, or a reflection from as far again where nothing is.
    const auto behind = all_glass ? std::nullopt : surroundings_->nearest(ray, at, true);
    if (behind)
      hit = behind;
    else
      hit->range_m *= 2;
  }
  if (!hit || dropped || faults.active(Fault::kLidarCovered, at)) return 0;
  const double range_m = hit->range_m + noise_m;
  if (hit->incidence_cos < parameters_.grazing_cos || range_m < parameters_.min_m || range_m > parameters_.max_m)
    return 0;
  return static_cast<std::uint16_t>(steps(range_m, ScanBlock::kStepsPerMetre));
}

}  // namespace tetap::sim
