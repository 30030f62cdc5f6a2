// SPDX-License-Identifier: Apache-2.0
#include "sim_host/emulator/iwdg.hpp"

#include "hal/chip/stm32/registers_stm32f412.hpp"

#include <algorithm>
#include <utility>

namespace tetap::board {

namespace reg = hal::stm32f412::iwdg;

namespace {
constexpr std::uint32_t kReload = 0xAAAA, kUnlock = 0x5555, kStart = 0xCCCC;  // RM0402, IWDG_KR
constexpr std::uint32_t kWindow = 0x10, kNoWindow = 0xFFF;                    // RM0440, IWDG_WINR and its reset value
constexpr std::int64_t kUpdateCycles = 5;                                     // RM0402, IWDG_SR: up to 5 cycles
}  // namespace

Iwdg::Iwdg(Surroundings around, std::uint32_t base, std::function<std::int64_t()> lsi_hz)
    : Peripheral(around, "IWDG", base, kHalfWords),
      lsi_hz_(std::move(lsi_hz)),
      expires_(around.scheduler, [this] { on_expired(); }),
      prescaler_set_(around.scheduler, [this] { pr_ = next_pr_; }),
      reload_set_(around.scheduler, [this] { rlr_ = next_rlr_; }) {}

void Iwdg::reset() {
  expires_.clear();
  prescaler_set_.clear();
  reload_set_.clear();
  pr_ = next_pr_ = 0;
  rlr_ = next_rlr_ = 0xFFF;
  unlocked_ = started_ = false;
}

std::uint32_t Iwdg::read(std::uint32_t offset) {
  switch (offset) {
    case reg::pr::kOffset:
      return next_pr_;
    case reg::rlr::kOffset:
      return next_rlr_;
    case reg::sr::kOffset:
      return reg::sr::kPvu(prescaler_set_.pending() ? 1 : 0) | reg::sr::kRvu(reload_set_.pending() ? 1 : 0);
    default:
      return 0;
  }
}

void Iwdg::write(std::uint32_t offset, std::uint32_t value, std::uint32_t) {
  if (offset == reg::kr::kOffset) {
    unlocked_ = value == kUnlock;
    if (value == kStart && !started_) {
      started_ = true;
      last_reload_ = now();
      reload();
    }
    if (value == kReload) {
      if (started_) longest_gap_ = std::max(longest_gap_, now() - last_reload_);
      last_reload_ = now();
      if (started_) reload();
    }
    return;
  }
  if (offset == kWindow && value != kNoWindow) return complain("the window is not modelled");
  const bool prescaler = offset == reg::pr::kOffset;
  if (!prescaler && offset != reg::rlr::kOffset) return;
  if (!unlocked_) return complain("PR or RLR written without the key 0x5555: ignored");
  Alarm& alarm = prescaler ? prescaler_set_ : reload_set_;
  if (alarm.pending()) return complain("PR or RLR written while PVU or RVU is set");
  if (prescaler) {
    next_pr_ = reg::pr::kPr.of(value);
  } else {
    next_rlr_ = reg::rlr::kRl.of(value);
  }
  alarm.set(now() + periods(kUpdateCycles, lsi_hz_()));
}

// RM0402, table "Min/max IWDG timeout": (RL + 1) times 4 * 2^PR cycles, PR of 6 and 7 alike.
void Iwdg::reload() {
  const std::int64_t cycles = (std::int64_t{rlr_} + 1) << (2 + std::min<std::uint32_t>(pr_, 6));
  expires_.set(now() + periods(cycles, lsi_hz_()));
}

}  // namespace tetap::board
