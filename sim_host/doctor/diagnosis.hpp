// SPDX-License-Identifier: Apache-2.0
// One reading of a log by all detectors, and the ranked list of what they find.
#pragma once

#include "sim_host/doctor/finding.hpp"
#include "sim_host/doctor/robot_facts.hpp"
#include "sim_host/doctor/window.hpp"
#include "sim_host/replay/log.hpp"
#include "sim_host/replay/result.hpp"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace tetap::doctor {

struct Diagnosis {
  Findings findings;                  ///< the likeliest cause first, one a code
  std::optional<std::string> untold;  ///< question that the log leaves open, in words
  std::uint64_t inputs = 0;           ///< input frames of the node
  double duration_s = 0;              ///< on the bus's clock
  std::vector<Window> seconds;        ///< windows of the devices, for a picture of the evidence
};

/// Reads the log twice: for its clock, then for its data. `name` is what messages call it. Fails as the log does, and
/// for a log without an input frame of this id base.
sim::Result<Diagnosis> diagnose(sim::Frames& log, const std::string& name, std::uint32_t base, const RobotFacts& robot);

/// Windows of a log of any length in bounded memory: of more than kMost every second one goes, and again.
class KeptWindows {
 public:
  static constexpr std::size_t kMost = 4096;
  void add(const Window& window);
  [[nodiscard]] const std::vector<Window>& all() const { return all_; }

 private:
  std::vector<Window> all_;
  std::uint64_t seen_ = 0, every_ = 1;
};

/// Orders findings by code, drops those that rest on data which an earlier one spoils, and keeps one a code.
[[nodiscard]] Findings ranked(Findings findings);

}  // namespace tetap::doctor
