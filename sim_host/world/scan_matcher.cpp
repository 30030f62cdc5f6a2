// SPDX-License-Identifier: Apache-2.0
#include "sim_host/world/scan_matcher.hpp"

#include "sim_host/world/math.hpp"

#include <cmath>
#include <cstddef>

namespace tetap::sim {

std::vector<sensor::LoopClosure> ScanMatcher::sample(const Truth& truth) {
  const Keyframe here{truth.x_m, truth.y_m, truth.yaw_rad};
  if (keyframes_.empty()) {
    keyframes_.push_back(here);
    return {};
  }
  const Keyframe& last = keyframes_.back();
  const double dx = here.x_m - last.x_m, dy = here.y_m - last.y_m;
  if (sim::sqrt(dx * dx + dy * dy) < parameters_.keyframe_m &&
      magnitude(wrap(here.yaw_rad - last.yaw_rad)) < parameters_.keyframe_rad)
    return {};
  keyframes_.push_back(here);
  const std::size_t latest = keyframes_.size() - 1;
  std::vector<sensor::LoopClosure> found{displacement(latest - 1, latest)};
  if (const std::size_t earlier = revisited(); earlier != latest) found.push_back(displacement(earlier, latest));
  return found;
}

std::size_t ScanMatcher::revisited() const {
  const std::size_t latest = keyframes_.size() - 1;
  const Keyframe& here = keyframes_[latest];
  std::size_t nearest = latest;
  double least_m = parameters_.reach_m;
  for (std::size_t k = 0; k + static_cast<std::size_t>(parameters_.apart) <= latest; ++k) {
    const double dx = here.x_m - keyframes_[k].x_m, dy = here.y_m - keyframes_[k].y_m;
    const double way_m = sim::sqrt(dx * dx + dy * dy);
    if (way_m > least_m || magnitude(wrap(here.yaw_rad - keyframes_[k].yaw_rad)) > parameters_.reach_rad) continue;
    nearest = k;
    least_m = way_m;
  }
  return nearest;
}

sensor::LoopClosure ScanMatcher::displacement(std::size_t from, std::size_t to) {
  using Z = sensor::LoopClosure;
  const Keyframe &a = keyframes_[from], &b = keyframes_[to];
  const Direction d = direction(a.yaw_rad);
  const double dx = b.x_m - a.x_m, dy = b.y_m - a.y_m;
  const auto steps = [](double value, std::int64_t per_unit) {
    return static_cast<std::int32_t>(std::lround(value * static_cast<double>(per_unit)));
  };
  const double x_m = d.cos * dx + d.sin * dy + noise_.normal(parameters_.sigma_m);
  const double y_m = d.cos * dy - d.sin * dx + noise_.normal(parameters_.sigma_m);
  const double yaw_rad = wrap(b.yaw_rad - a.yaw_rad + noise_.normal(parameters_.sigma_rad));
  constexpr std::size_t kIds = 0x4000;  // identities on the bus go round
  const std::int32_t sigma = steps(parameters_.sigma_m, Z::kStepsPerMetre);
  return {.from = static_cast<std::uint16_t>(from % kIds),
          .to = static_cast<std::uint16_t>(to % kIds),
          .x = steps(x_m, Z::kStepsPerMetre),
          .y = steps(y_m, Z::kStepsPerMetre),
          .yaw = steps(yaw_rad, Z::kStepsPerRadian),
          .sigmas = Z::pack(sigma, sigma, steps(parameters_.sigma_rad, Z::kSigmaStepsPerRadian)),
          .correlations = Z::pack(0, 0, 0)};
}

}  // namespace tetap::sim
