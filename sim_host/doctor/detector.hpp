// SPDX-License-Identifier: Apache-2.0
// Detector that compares data of a log: it sees frames, whole samples and windows of a second, and at the end states
// its findings. Its memory does not grow with the log.
#pragma once

#include "sim_host/doctor/finding.hpp"
#include "sim_host/doctor/window.hpp"
#include "tetap/base/can_frame.hpp"
#include "tetap/sensor/sample.hpp"

#include <cstdint>

namespace tetap::doctor {

/// An input frame of the node.
struct SeenFrame {
  base::Micros time;  ///< on the bus's clock
  std::uint32_t offset;
  const base::CanFrame& frame;
};

class Detector {
 public:
  Detector() = default;
  Detector(const Detector&) = delete;
  Detector& operator=(const Detector&) = delete;
  virtual ~Detector() = default;

  virtual void frame(const SeenFrame&) {}
  virtual void sample(base::Micros /*time*/, const sensor::Sample&) {}
  virtual void window(const Window&) {}
  virtual void finish(Findings& findings) = 0;
};

}  // namespace tetap::doctor
