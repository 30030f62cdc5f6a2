// SPDX-License-Identifier: Apache-2.0
// Nested vectored interrupt controller: pending, enabled, active, priorities with four bits. ARM DDI 0403E.e sections
// B1.5 (exception model) and B3.4; RM0402 chapter "Interrupts and events" (97 interrupts) and RM0440 chapter
// "Nested vectored interrupt controller" (102), 16 priorities both.
#pragma once

#include "sim_host/emulator/peripheral.hpp"

#include <array>
#include <cstdint>

namespace tetap::board {

/// Numbers of exceptions; interrupt n of the chip is kInterrupt0 + n.
namespace exception {
inline constexpr int kNmi = 2, kHardFault = 3, kMemManage = 4, kBusFault = 5, kUsageFault = 6, kSvc = 11, kDebug = 12,
                     kPendSv = 14, kSysTick = 15, kInterrupt0 = 16;
}  // namespace exception

/// Masks of the core that decide with the priorities: PRIMASK, FAULTMASK, BASEPRI.
struct Masks {
  bool primask = false, faultmask = false;
  int basepri = 0;
};

class Nvic final : public InterruptLines {
 public:
  static constexpr int kInterrupts = 102, kExceptions = exception::kInterrupt0 + kInterrupts;
  static constexpr int kLowest = 256;  ///< priority of thread mode

  Nvic() { reset(); }
  void reset();

  /// A level that rises pends; a level still high when the handler returns pends again (B3.4.1).
  void set_level(int interrupt, bool level) override;
  [[nodiscard]] bool level(int number) const { return at(number).level; }

  void pend(int number) { at(number).pending = true, plan(); }
  void unpend(int number);
  void enable(int number, bool on) { at(number).enabled = on, plan(); }
  void set_priority(int number, int value) { at(number).priority = value & 0xF0, plan(); }
  void set_group(int prigroup) { group_mask_ = 0xFF << (prigroup + 1) & 0xFF, plan(); }
  [[nodiscard]] bool pending(int number) const { return at(number).pending; }
  [[nodiscard]] bool enabled(int number) const { return at(number).enabled; }
  [[nodiscard]] bool active(int number) const { return at(number).active; }
  [[nodiscard]] int priority(int number) const;

  /// Something waits that would pre-empt but for the masks.
  [[nodiscard]] bool waiting() const { return best_ != 0 && group(priority(best_)) < active_priority_; }
  /// The exception to be taken under `masks`; 0: none.
  [[nodiscard]] int next(Masks masks) const;
  /// WFI wakes: as next(), without PRIMASK (B1.5.19).
  [[nodiscard]] bool wakes(Masks masks) const { return next({false, masks.faultmask, masks.basepri}) != 0; }
  /// Highest pending enabled exception; 0: none.
  [[nodiscard]] int best() const { return best_; }
  /// Priority that the core runs at, masks included (B1.5.4).
  [[nodiscard]] int execution_priority(Masks masks) const;

  void activate(int number);
  void deactivate(int number);
  [[nodiscard]] int active_count() const;

 private:
  struct State {
    bool enabled = false, pending = false, active = false, level = false;
    int priority = 0;
  };
  [[nodiscard]] State& at(int number) { return states_[static_cast<std::size_t>(number)]; }
  [[nodiscard]] const State& at(int number) const { return states_[static_cast<std::size_t>(number)]; }
  [[nodiscard]] int group(int priority) const { return priority < 0 ? priority : priority & group_mask_; }
  void plan();

  std::array<State, kExceptions> states_{};
  int group_mask_ = 0xFE;
  int best_ = 0;                   ///< pending, enabled, of highest priority; 0: none
  int active_priority_ = kLowest;  ///< group priority of what is active
};

}  // namespace tetap::board
