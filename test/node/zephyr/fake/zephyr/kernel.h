// SPDX-License-Identifier: Apache-2.0
// What the example needs of Zephyr's kernel, with the clock in the test's hands: a tick is a microsecond, and sleep
// ends the application after a while.
#pragma once

#include <cstdint>

struct k_timeout_t {
  std::int64_t ticks;
};
inline constexpr k_timeout_t K_NO_WAIT{0};

inline std::int64_t fake_uptime_us = 0;
inline void (*fake_slept)() = [] {};
inline std::int64_t k_uptime_ticks() { return fake_uptime_us; }
inline std::uint64_t k_ticks_to_us_floor64(std::uint64_t ticks) { return ticks; }
inline std::int32_t k_usleep(std::int32_t us) {
  fake_uptime_us += us;
  fake_slept();
  return 0;
}
