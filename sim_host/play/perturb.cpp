// SPDX-License-Identifier: Apache-2.0
#include "sim_host/play/perturb.hpp"

#include <algorithm>
#include <random>
#include <utility>

namespace tetap::sim {

namespace {

/// std::mt19937_64 is the same everywhere by the standard; the library's distributions are not.
class Draws {
 public:
  explicit Draws(std::uint64_t seed) : engine_(seed) {}
  double uniform() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }

 private:
  std::mt19937_64 engine_;
};

}  // namespace

Perturbed perturb(std::span<const TimedFrame> frames, const Perturbation& how) {
  Perturbed result;
  result.frames.reserve(frames.size());
  Draws draws(how.seed);
  const auto late = [&how](double draw, double least_ms) {
    return base::Micros{static_cast<std::int64_t>(std::max(draw * how.jitter_ms, least_ms) * 1000)};
  };
  std::vector<bool> swap_with_next;
  for (const TimedFrame& entry : frames) {
    const double drop = draws.uniform(), delay = draws.uniform(), twice = draws.uniform(), second = draws.uniform(),
                 swap = draws.uniform();
    if (drop < how.drop) {
      ++result.dropped;
      continue;
    }
    result.frames.push_back({entry.time + late(delay, 0), entry.frame});
    swap_with_next.push_back(swap < how.reorder);
    if (twice >= how.duplicate) continue;
    ++result.duplicated;
    result.frames.push_back({entry.time + late(second, 1), entry.frame});
    swap_with_next.push_back(false);
  }
  for (std::size_t i = 0; i + 1 < result.frames.size(); ++i) {
    if (!swap_with_next[i]) continue;
    std::swap(result.frames[i].frame, result.frames[i + 1].frame);
    ++result.reordered;
    swap_with_next[i + 1] = false;  // each frame moves once
  }
  std::stable_sort(result.frames.begin(), result.frames.end(),
                   [](const TimedFrame& a, const TimedFrame& b) { return a.time < b.time; });
  return result;
}

}  // namespace tetap::sim
