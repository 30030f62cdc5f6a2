// SPDX-License-Identifier: Apache-2.0
// A scope in which no interrupt runs. ARM DDI 0403E.e B1.4.3: PRIMASK.
#pragma once

#include <cstdint>

namespace tetap::hal {

class InterruptLock {
 public:
  InterruptLock() { asm volatile("mrs %0, primask\ncpsid i" : "=r"(before_)::"memory"); }
  ~InterruptLock() { asm volatile("msr primask, %0" ::"r"(before_) : "memory"); }
  InterruptLock(const InterruptLock&) = delete;
  InterruptLock& operator=(const InterruptLock&) = delete;

 private:
  std::uint32_t before_;  ///< a lock inside a lock changes nothing
};

}  // namespace tetap::hal
