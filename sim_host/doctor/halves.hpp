// SPDX-License-Identifier: Apache-2.0
// Samples of several messages of which one never comes, or whose parts never carry the same Seq and Stamp.
#pragma once

#include "sim_host/doctor/detector.hpp"

#include <array>

namespace tetap::doctor {

class HalvesDetector : public Detector {
 public:
  void frame(const SeenFrame& seen) override {
    if (seen.offset < frames_.size()) ++frames_[seen.offset];
  }
  void sample(base::Micros time, const sensor::Sample& sample) override;
  void finish(Findings& findings) override;

 private:
  std::array<std::uint64_t, 0x20> frames_{};  ///< by offset
  std::array<std::uint64_t, 4> imus_{};       ///< whole samples by instance
  std::uint64_t positions_ = 0, velocities_ = 0;
};

}  // namespace tetap::doctor
