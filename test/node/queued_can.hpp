// SPDX-License-Identifier: Apache-2.0
// The CAN controller of a board on the bench: frames to the node wait in a queue, and those it sends are kept.
#pragma once

#include "tetap/base/can_faults.hpp"
#include "tetap/base/can_frame.hpp"

#include <deque>
#include <optional>
#include <vector>

namespace tetap::test {

struct QueuedCan {
  std::deque<base::CanFrame> to_node;
  std::vector<base::CanFrame> sent;
  base::CanFaults counted;
  bool send(const base::CanFrame& frame) { return sent.push_back(frame), true; }
  std::optional<base::CanFrame> receive() {
    if (to_node.empty()) return std::nullopt;
    const base::CanFrame frame = to_node.front();
    return to_node.pop_front(), frame;
  }
  static void flush() {}
  [[nodiscard]] base::CanFaults faults() const { return counted; }
};

}  // namespace tetap::test
