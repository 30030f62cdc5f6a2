// SPDX-License-Identifier: Apache-2.0
// What a page's module has: a rover's node and the whole replay of a log's text.
#include "host/text_replay.hpp"

#include "config/rover.hpp"
#include "sim_host/robot_of.hpp"

namespace tetap::sim {

void replay_rover(std::string_view log, test::TextReplay& out) {
  test::replay_text(log, "log", robot_of<tetap::robot::rover::Estimators>("rover", tetap::robot::rover::parameters),
                    out);
}

}  // namespace tetap::sim
