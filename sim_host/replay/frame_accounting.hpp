// SPDX-License-Identifier: Apache-2.0
// Double-entry book-keeping of a run. Frames sent are held against frames that the node counted as consumed
// (Est_StateCrc.InCount). Frames that the node counted as sent (Frames, Epoch) are held against frames that arrived.
#pragma once

#include "sim_host/replay/protocol.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>

namespace tetap::sim {

struct Counts {
  std::uint64_t inputs = 0;        ///< frames sent for the node to consume
  std::uint64_t syncs = 0;         ///< sync frames sent
  std::uint64_t outputs = 0;       ///< frames of the node that arrived in its epochs
  std::uint64_t epochs = 0;        ///< epochs that arrived to their last frame
  std::uint64_t lost_inputs = 0;   ///< sent and never consumed, sync frames included
  std::uint64_t extra_inputs = 0;  ///< consumed and never sent (by us): a duplicate, or another sender
  std::uint64_t lost_outputs =
      0;  ///< sent by the node and never arrived; an epoch without its last frame counts as one
  std::uint64_t extra_outputs = 0;  ///< arrived more often than sent
  std::uint64_t overflows = 0;      ///< lost_outputs that our own socket dropped, as far as known

  [[nodiscard]] std::uint64_t lost() const { return lost_inputs + lost_outputs; }
  [[nodiscard]] std::uint64_t extra() const { return extra_inputs + extra_outputs; }
};

/// Common part of both ways of playing: the frames within one epoch, and epochs missing in between.
inline void account_frames(const NodeEpoch& epoch, Counts& counts) {
  counts.outputs += epoch.received;
  ++counts.epochs;
  if (epoch.received < epoch.tail.frames) counts.lost_outputs += epoch.tail.frames - epoch.received;
  if (epoch.received > epoch.tail.frames) counts.extra_outputs += epoch.received - epoch.tail.frames;
}

/// For lockstep: every tick that was asked for is waited for.
class LockstepFrameAccounting {
 public:
  explicit LockstepFrameAccounting(Counts& counts) : counts_(counts) {}

  /// The node starts anew: its counters begin at 0, or where its state was taken.
  void begin(std::uint64_t inputs = 0, std::uint32_t epoch = 0) {
    asked_.clear();
    sent_ = inputs;
    deficit_ = 0;
    last_epoch_ = static_cast<std::uint8_t>(epoch);
    any_ = false;
  }
  void asked(std::size_t inputs, base::Micros time) {
    counts_.inputs += inputs;
    ++counts_.syncs;
    sent_ += inputs;
    asked_.push_back({time, sent_});
  }
  [[nodiscard]] std::size_t in_flight() const { return asked_.size(); }
  [[nodiscard]] base::Micros oldest() const { return asked_.front().time; }

  /// Returns the time of the tick this epoch answers; nothing when it answers none of ours.
  std::optional<base::Micros> answered(const NodeEpoch& epoch) {
    const auto ahead = static_cast<std::uint8_t>(epoch.tail.epoch - last_epoch_);
    if (any_ && ahead == 0) return counts_.extra_outputs += epoch.received, std::nullopt;
    const auto place = find(epoch, ahead);
    if (!place) {  // from before we began, unless we have an answer already: then somebody else drives the node too
      if (any_) counts_.extra_outputs += epoch.received;
      return std::nullopt;
    }
    // Ticks passed over: either the node made them and their frames were lost, or it never got the sync frame.
    const std::size_t made = ahead == 0 ? 0 : std::min<std::size_t>(*place, ahead - 1U);
    counts_.lost_outputs += made;
    counts_.lost_inputs += *place - made;
    account_frames(epoch, counts_);
    const Asked asked = asked_[*place];
    asked_.erase(asked_.begin(), asked_.begin() + static_cast<std::ptrdiff_t>(*place) + 1);
    account_inputs(asked, epoch.tail.in_count);
    last_epoch_ = epoch.tail.epoch;
    any_ = true;
    return asked.time;
  }

 private:
  struct Asked {
    base::Micros time;
    std::uint64_t inputs;  ///< sent since the node's start, up to this tick
  };

  [[nodiscard]] std::optional<std::size_t> find(const NodeEpoch& epoch, std::uint8_t ahead) const {
    std::optional<std::size_t> place;
    for (std::size_t i = 0; i < asked_.size() && epoch.head && !place; ++i)
      if (same_bus_time(epoch.head->time_us, asked_[i].time)) place = i;
    // By its number when the first frame is missing, or when last and first frames of two epochs are.
    const bool by_number = ahead >= 1 && ahead <= asked_.size();
    if (by_number && (!epoch.head || (place && *place + 1U < ahead))) place = ahead - 1U;
    return place;
  }
  void account_inputs(const Asked& asked, std::uint16_t in_count) {
    const auto deficit = static_cast<std::int16_t>(static_cast<std::uint16_t>(asked.inputs) - in_count);
    if (deficit > deficit_) counts_.lost_inputs += static_cast<std::uint64_t>(deficit - deficit_);
    if (deficit < deficit_) counts_.extra_inputs += static_cast<std::uint64_t>(deficit_ - deficit);
    deficit_ = deficit;
  }

  Counts& counts_;
  std::deque<Asked> asked_;
  std::uint64_t sent_ = 0;
  int deficit_ = 0;
  std::uint8_t last_epoch_ = 0;
  bool any_ = false;
};

/// For a node that ticks on its own: totals are compared at the end.
class RealtimeFrameAccounting {
 public:
  explicit RealtimeFrameAccounting(Counts& counts) : counts_(counts) {}

  /// `started`: the node began at 0 with a Begin frame; else the first epoch is where counting starts.
  void begin(bool started) {
    known_ = started;
    last_ = {};
    consumed_ = 0;
  }
  void answered(const NodeEpoch& epoch) {
    const auto ahead = static_cast<std::uint8_t>(epoch.tail.epoch - last_.epoch);
    if (known_ && ahead == 0) return void(counts_.extra_outputs += epoch.received);
    if (known_) {
      counts_.lost_outputs += ahead - 1U;
      consumed_ += static_cast<std::uint16_t>(epoch.tail.in_count - last_.in_count);
    }
    account_frames(epoch, counts_);
    last_ = epoch.tail;
    known_ = true;
  }
  [[nodiscard]] bool known() const { return known_; }
  [[nodiscard]] std::uint64_t consumed() const { return consumed_; }
  void close() {
    if (consumed_ < counts_.inputs) counts_.lost_inputs += counts_.inputs - consumed_;
    if (consumed_ > counts_.inputs) counts_.extra_inputs += consumed_ - counts_.inputs;
  }

 private:
  Counts& counts_;
  bus::EstStateCrc last_;
  std::uint64_t consumed_ = 0;
  bool known_ = false;
};

}  // namespace tetap::sim
