// SPDX-License-Identifier: Apache-2.0
#include "sim_host/emulator/live_bus.hpp"

#include "hal/board/linux/clock.hpp"

#include <algorithm>

namespace tetap::board {

LiveBus::LiveBus(const std::string& interface, CanLine& line, Scheduler& scheduler)
    : can_(interface),
      line_(line),
      scheduler_(scheduler),
      step_(scheduler, [this] { pace(); }),
      began_(hal::monotonic_clock()) {
  step_.set(scheduler.now());
}

void LiveBus::came_through(const CanOffer& frame, bool own) {
  if (frame.remote) return;
  const auto same = own ? taken_.end() : std::find(taken_.begin(), taken_.end(), frame.frame);
  if (same != taken_.end()) {
    taken_.erase(same);  // it is on the interface already
  } else {
    static_cast<void>(can_.send(frame.frame));
  }
}

// The board runs a step ahead of the host's clock at most.
void LiveBus::pace() {
  const base::Micros due = began_ + base::Micros{scheduler_.now() / kMicrosecond};
  can_.flush();
  take();
  base::Micros left = due - hal::monotonic_clock();
  latest_ = std::max(latest_, base::Micros{} - left);
  for (; left.us > 0; left = due - hal::monotonic_clock()) {
    can_.wait(left);
    take();
  }
  step_.set(scheduler_.now() + kStep);
}

void LiveBus::take() {
  while (const auto frame = can_.receive()) {
    taken_.push_back(*frame);
    line_.send(*frame, scheduler_.now());
  }
}

}  // namespace tetap::board
