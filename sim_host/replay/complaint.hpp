// SPDX-License-Identifier: Apache-2.0
// What is wrong with a run that has ended, as one sentence for people.
#pragma once

#include "sim_host/replay/frame_accounting.hpp"
#include "sim_host/replay/recording.hpp"

#include <string>

namespace tetap::sim {

/// Frames lost or too many, then what the comparison with the record shows (null: there is none). Empty where all is
/// right.
[[nodiscard]] std::string complaint(const Counts& counts, const Comparison* comparison);

}  // namespace tetap::sim
