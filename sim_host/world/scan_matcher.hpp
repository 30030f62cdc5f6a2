// SPDX-License-Identifier: Apache-2.0
// The front end of a pose graph: it makes keyframes, measures the displacement from each to the next, and closes a loop
// where the vehicle is back at an earlier one. Identities count from 0 at the start; what the node answers has no
// effect.
#pragma once

#include "sim_host/world/chance.hpp"
#include "sim_host/world/motion.hpp"
#include "sim_host/world/numbers.hpp"
#include "tetap/sensor/samples.hpp"

#include <vector>

namespace tetap::sim {

class ScanMatcher {
 public:
  ScanMatcher(const ScanMatcherNumbers& parameters, std::uint64_t seed)
      : parameters_{parameters}, noise_{seed, Stream::kScanMatcher} {}

  /// Displacements of a keyframe that is due here: odometry first, then a closure. The first look makes keyframe 0.
  [[nodiscard]] std::vector<sensor::LoopClosure> sample(const Truth& truth);

 private:
  struct Keyframe {
    double x_m, y_m, yaw_rad;
  };
  [[nodiscard]] sensor::LoopClosure displacement(std::size_t from, std::size_t to);
  /// The nearest of the earlier keyframes in reach; the latest keyframe where there is none.
  [[nodiscard]] std::size_t revisited() const;

  ScanMatcherNumbers parameters_;
  Chance noise_;
  std::vector<Keyframe> keyframes_;
};

}  // namespace tetap::sim
