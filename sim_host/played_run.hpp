// SPDX-License-Identifier: Apache-2.0
// A run that somebody played, as a text that repeats it to the bit: robot, seed, length, and the faults as they were
// injected. Lines of `name = value`; # begins a comment.
#pragma once

#include "sim_host/replay/result.hpp"
#include "sim_host/world/faults.hpp"
#include "tetap/base/time.hpp"

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace tetap::sim {

struct PlayedRun {
  std::string robot;
  std::uint64_t seed = 1;
  base::Micros duration;
  std::vector<FaultSetting> faults;
};

/// The same as `played_run` reads it.
[[nodiscard]] std::string text_of(const PlayedRun& run);

/// `name`: of the file, for messages. Fails with the line for a name that is none, a name that comes twice, a value out
/// of its limits, and a text without robot, seed and duration.
[[nodiscard]] Result<PlayedRun> played_run(std::string_view text, const std::string& name);

/// `fault` lines as an option of tetap-world has them.
[[nodiscard]] std::string fault_words(const PlayedRun& run);

}  // namespace tetap::sim
