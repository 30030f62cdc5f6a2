// SPDX-License-Identifier: Apache-2.0
// A bus inside one process: two ends and a queue each way. For campaigns of thousands of runs with the same frames,
// codec and firmware.
#pragma once

#include "hal/can_bus.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>

namespace tetap::hal {

/// Not for two threads: both ends are polled in turn.
class MemoryQueue {
 public:
  static constexpr std::size_t kCapacity = 8192;

  [[nodiscard]] bool push(const base::CanFrame& frame) {
    if (pushed_ - popped_ == kCapacity) return false;
    frames_[pushed_++ % kCapacity] = frame;
    return true;
  }
  [[nodiscard]] std::optional<base::CanFrame> pop() {
    if (pushed_ == popped_) return std::nullopt;
    return frames_[popped_++ % kCapacity];
  }

 private:
  std::array<base::CanFrame, kCapacity> frames_{};
  std::size_t pushed_ = 0;
  std::size_t popped_ = 0;
};

/// One end. The queues outlive it.
class MemoryCan {
 public:
  MemoryCan(MemoryQueue& out, MemoryQueue& in) : out_(&out), in_(&in) {}

  bool send(const base::CanFrame& frame) {
    const bool taken = out_->push(frame);
    faults_.tx_full += taken ? 0 : 1;
    return taken;
  }
  std::optional<base::CanFrame> receive() { return in_->pop(); }
  void flush() {}
  [[nodiscard]] base::CanFaults faults() const { return faults_; }

 private:
  MemoryQueue* out_;
  MemoryQueue* in_;
  base::CanFaults faults_;
};

static_assert(CanBus<MemoryCan>);

struct MemoryBus {
  std::unique_ptr<MemoryQueue> to_node = std::make_unique<MemoryQueue>();
  std::unique_ptr<MemoryQueue> from_node = std::make_unique<MemoryQueue>();

  [[nodiscard]] MemoryCan node_end() { return {*from_node, *to_node}; }
  [[nodiscard]] MemoryCan player_end() { return {*to_node, *from_node}; }
};

}  // namespace tetap::hal
