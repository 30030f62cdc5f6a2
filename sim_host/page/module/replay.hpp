// SPDX-License-Identifier: Apache-2.0
// One replay of the page's log by a robot's node: tables and their hash, as tetap-play writes them.
#pragma once

#include "sim_host/page/module/browser_log.hpp"
#include "sim_host/replay/survey.hpp"
#include "sim_host/robot.hpp"

#include <cstdint>

namespace tetap::page {

struct ReplayOptions {
  std::uint32_t base = 0x300;  ///< id base of the log and of the node
  sim::PlayMode mode = sim::PlayMode::kAutomatic;
  bool keep_going = false;  ///< count malformed lines instead of stopping at the first
};

/// Reads the log, plays it, and writes kBegun, the tables and kResult. Fails as survey_of(), and where the log is a
/// record that cannot be repeated.
sim::Result<> replay(const sim::Robot& robot, const param::Parameters& parameters, const ReplayOptions& options);

/// Plays the log up to the epoch of that time, and writes kUpdates: the updates of every filter in the `span` before
/// its end. The node is asked tick by tick, so that each update belongs to an epoch.
sim::Result<> updates_until(const sim::Robot& robot, const param::Parameters& parameters, const ReplayOptions& options,
                            base::Micros time, base::Micros span);

}  // namespace tetap::page
