// SPDX-License-Identifier: Apache-2.0
// A bad bus, from a seed: frames delayed, dropped, doubled, in another order. Every frame takes the same number of
// draws whatever the options, so that switching one effect on does not move the others.
#pragma once

#include "sim_host/replay/log.hpp"

#include <cstdint>
#include <span>
#include <vector>

namespace tetap::sim {

struct Perturbation {
  std::uint64_t seed = 1;
  double jitter_ms = 0;  ///< each frame late by 0 to this, uniformly
  double drop = 0;       ///< probabilities per frame
  double duplicate = 0;  ///< sent twice; the second copy late by 0 to jitter, at least 1 ms
  double reorder = 0;    ///< changes places with the frame after it

  [[nodiscard]] bool any() const { return jitter_ms > 0 || drop > 0 || duplicate > 0 || reorder > 0; }
};

struct Perturbed {
  std::vector<TimedFrame> frames;  ///< in the order of sending
  std::uint64_t dropped = 0;
  std::uint64_t duplicated = 0;
  std::uint64_t reordered = 0;
};

[[nodiscard]] Perturbed perturb(std::span<const TimedFrame> frames, const Perturbation& how);

}  // namespace tetap::sim
