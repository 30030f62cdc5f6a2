// SPDX-License-Identifier: Apache-2.0
// The samples that the estimators have and that are not final yet, in the order of their stamps: a view into a ring.
#pragma once

#include "tetap/sensor/sample.hpp"

#include <cstddef>

namespace tetap::sensor {

/// Does not own its samples.
class Window {
 public:
  constexpr Window() = default;
  /// `size` samples of a ring of `places`, from place `begin` on.
  constexpr Window(const Sample* ring, std::size_t places, std::size_t begin, std::size_t size)
      : ring_(ring), places_(places), begin_(begin), size_(size) {}
  /// Samples one behind the other: a vector, an array, a span.
  template <class Samples>
  requires requires(const Samples& samples) { samples.data(), samples.size(); }
  constexpr Window(const Samples& samples)  // NOLINT(google-explicit-constructor): a view, as std::span
      : Window(samples.data(), samples.size(), 0, samples.size()) {}

  [[nodiscard]] constexpr std::size_t size() const { return size_; }
  /// Calls f(sample) for each, in order: two straight runs of the ring.
  template <class F>
  [[gnu::always_inline]] constexpr void each(const F& f) const {
    const std::size_t straight = places_ - begin_ < size_ ? places_ - begin_ : size_;
    const Sample* sample = ring_ + begin_;
    const Sample* end = sample + straight;
    std::size_t rest = size_ - straight;
    while (true) {
      for (; sample != end; ++sample) f(*sample);
      if (rest == 0) return;
      sample = ring_;
      end = sample + rest;
      rest = 0;
    }
  }
  [[nodiscard]] constexpr const Sample& operator[](std::size_t i) const {
    const std::size_t at = begin_ + i;
    return ring_[at < places_ ? at : at - places_];
  }

 private:
  const Sample* ring_ = nullptr;
  std::size_t places_ = 0, begin_ = 0, size_ = 0;
};

}  // namespace tetap::sensor
