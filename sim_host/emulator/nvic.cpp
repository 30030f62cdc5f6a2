// SPDX-License-Identifier: Apache-2.0
#include "sim_host/emulator/nvic.hpp"

#include <algorithm>

namespace tetap::board {

void Nvic::reset() {
  std::array<bool, kExceptions> levels{};
  for (std::size_t i = 0; i < states_.size(); ++i) levels[i] = states_[i].level;
  states_.fill({});
  for (std::size_t i = 0; i < states_.size(); ++i) states_[i].level = levels[i];
  for (const int always :
       {exception::kNmi, exception::kHardFault, exception::kSvc, exception::kPendSv, exception::kSysTick}) {
    at(always).enabled = true;
  }
  group_mask_ = 0xFE;
  plan();
}

void Nvic::set_level(int interrupt, bool level) {
  State& state = at(exception::kInterrupt0 + interrupt);
  if (state.level == level) return;
  state.level = level;
  if (!level) return;
  state.pending = true;
  plan();
}

void Nvic::unpend(int number) {
  at(number).pending = at(number).level && !at(number).active;
  plan();
}

int Nvic::priority(int number) const {
  if (number == exception::kNmi) return -2;
  if (number == exception::kHardFault) return -1;
  return at(number).priority;
}

int Nvic::execution_priority(Masks masks) const {
  int priority = active_priority_;
  if (masks.basepri != 0) priority = std::min(priority, group(masks.basepri));
  if (masks.primask) priority = std::min(priority, 0);
  if (masks.faultmask) priority = std::min(priority, -1);
  return priority;
}

int Nvic::next(Masks masks) const {
  return best_ != 0 && group(priority(best_)) < execution_priority(masks) ? best_ : 0;
}

void Nvic::activate(int number) {
  at(number).active = true;
  at(number).pending = false;
  plan();
}

void Nvic::deactivate(int number) {
  State& state = at(number);
  state.active = false;
  if (state.level) state.pending = true;
  plan();
}

int Nvic::active_count() const {
  return static_cast<int>(std::count_if(states_.begin(), states_.end(), [](const State& one) { return one.active; }));
}

// Ties go to the lower number (B1.5.4).
void Nvic::plan() {
  best_ = 0;
  active_priority_ = kLowest;
  for (int i = 1; i < kExceptions; ++i) {
    const State& state = at(i);
    if (state.active) active_priority_ = std::min(active_priority_, group(priority(i)));
    if (state.pending && state.enabled && (best_ == 0 || priority(i) < priority(best_))) best_ = i;
  }
}

}  // namespace tetap::board
