// SPDX-License-Identifier: Apache-2.0
// One reading of a log by all detectors, and the ranked list of what they find.
#pragma once

#include "sim_host/doctor/finding.hpp"
#include "sim_host/doctor/robot_facts.hpp"
#include "sim_host/replay/log.hpp"

#include <cstdint>
#include <string>

namespace tetap::doctor {

struct Diagnosis {
  Findings findings;         ///< the likeliest cause first, one a code
  std::uint64_t inputs = 0;  ///< input frames of the node
  double duration_s = 0;     ///< on the bus's clock
  std::string cut_off;       ///< as in sim::LogReport
};

/// Reads the log twice: for its clock, then for its data. Throws as LogFile does, and std::runtime_error for a log
/// without an input frame of this id base.
[[nodiscard]] Diagnosis diagnose(const std::string& path, const sim::LogOptions& reading, const RobotFacts& robot);

/// Orders findings by code, drops those that rest on data which an earlier one spoils, and keeps one a code.
[[nodiscard]] Findings ranked(Findings findings);

}  // namespace tetap::doctor
