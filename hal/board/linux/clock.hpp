// SPDX-License-Identifier: Apache-2.0
// The machine's clocks as integer microseconds. Only ports and host programs may read them.
#pragma once

#include "tetap/base/time.hpp"

#include <ctime>

namespace tetap::hal {

[[nodiscard]] inline base::Micros read_clock(clockid_t clock) {
  timespec t{};
  clock_gettime(clock, &t);
  return {std::int64_t{t.tv_sec} * 1'000'000 + t.tv_nsec / 1000};
}

/// Time since some fixed moment; never goes back.
[[nodiscard]] inline base::Micros monotonic_clock() { return read_clock(CLOCK_MONOTONIC); }

/// Time since 1970, as candump writes it.
[[nodiscard]] inline base::Micros wall_clock() { return read_clock(CLOCK_REALTIME); }

inline void sleep_for(base::Micros span) {
  if (span.us <= 0) return;
  const timespec t{.tv_sec = static_cast<time_t>(span.us / 1'000'000),
                   .tv_nsec = static_cast<long>(span.us % 1'000'000) * 1000};
  clock_nanosleep(CLOCK_MONOTONIC, 0, &t, nullptr);
}

}  // namespace tetap::hal
