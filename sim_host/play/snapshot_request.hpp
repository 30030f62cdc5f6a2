// SPDX-License-Identifier: Apache-2.0
// Asking a node for its state: once when it ran before the log began, and again while no answer comes.
#pragma once

#include "sim_host/replay/snapshot.hpp"
#include "tetap/bus/e2e.hpp"

#include <cstdint>
#include <optional>

namespace tetap::sim {

class SnapshotRequest {
 public:
  explicit SnapshotRequest(std::uint32_t base) : base_(base), collector_(base) {}

  /// Each frame of the bus, and the epoch that it completes: the first one shows whether the node ran before.
  void note(const base::CanFrame& frame, const std::optional<NodeEpoch>& epoch) {
    if (epoch && !seen_) wanted_ = epoch->tail.epoch != 1;
    seen_ = seen_ || epoch.has_value();
    pieces_ = pieces_ || is_snapshot_piece(frame, base_);
    whole_ = whole_ || collector_.add(frame).has_value();
  }
  /// The command, when it is to be sent. A node refuses a counter that was used last, so each attempt takes the next
  /// one after `counter`.
  std::optional<base::CanFrame> due(base::Micros now, std::uint32_t counter) {
    if (!wanted_ || pieces_ || asked_ == kTries || (asked_ > 0 && now - asked_at_ < kPatience)) return std::nullopt;
    ++asked_;
    asked_at_ = now;
    return bus::frame(base_, bus::protect(bus::CmdReset{.ctr = static_cast<std::uint8_t>((counter + asked_) & 0x0F),
                                                        .what = bus::ResetWhat::kSnapshot}));
  }
  [[nodiscard]] const char* outcome() const {
    return !wanted_ ? "not needed" : whole_ ? "whole" : pieces_ ? "incomplete" : "no answer";
  }

 private:
  static constexpr std::uint32_t kTries = 3;
  static constexpr base::Micros kPatience{2'000'000};

  std::uint32_t base_;
  SnapshotCollector collector_;
  base::Micros asked_at_{};
  std::uint32_t asked_ = 0;
  bool seen_ = false, wanted_ = false, pieces_ = false, whole_ = false;
};

}  // namespace tetap::sim
