// SPDX-License-Identifier: Apache-2.0
// A sensor that shows to the last bit what it showed before, again and again: stuck. One whose noise spans the steps of
// the bus does that a few times by chance, and not fifty; one that is finer does it at rest.
#pragma once

#include "base/time.hpp"

#include <array>
#include <cstddef>
#include <cstdint>

namespace tetap::checks {

template <std::size_t kSize>
class StuckValue {
 public:
  /// Finite readings. True when this one is the n-th repetition or beyond; n = 0: never.
  bool hear(const std::array<float, kSize>& now, std::int32_t n, base::Micros stamp) {
    bool same = true;
    for (std::size_t i = 0; i < kSize; ++i) same = same && now[i] <= last_[i] && now[i] >= last_[i];
    last_ = now;
    heard_ = stamp;
    times_ = same ? static_cast<std::uint8_t>(times_ < 255 ? times_ + 1 : 255) : std::uint8_t{0};
    stuck_ = n > 0 && times_ >= n;
    return stuck_;
  }
  /// The last that was heard, of late, was so.
  [[nodiscard]] bool stuck(base::Micros at) const { return stuck_ && at - heard_ < base::Micros{2'000'000}; }
  template <class Sink>
  void hash_state(Sink&& sink) const {
    sink(heard_.us);
    for (const float v : last_) sink(v);
    sink(static_cast<std::uint32_t>(times_ | (stuck_ ? 256U : 0U)));
  }

 private:
  base::Micros heard_;
  std::array<float, kSize> last_{};
  std::uint8_t times_ = 0;
  bool stuck_ = false;
};

}  // namespace tetap::checks
