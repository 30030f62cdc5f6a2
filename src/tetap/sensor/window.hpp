// SPDX-License-Identifier: Apache-2.0
// The samples that the estimators have and that are not final yet, in the order of their stamps: a view into a ring of
// their numbers.
#pragma once

#include "tetap/sensor/sample.hpp"

#include <cstddef>
#include <cstdint>

namespace tetap::sensor {

/// Does not own its samples.
class Window {
 public:
  constexpr Window() = default;
  /// `size` samples whose numbers are in a ring of `places`, from place `begin` on.
  constexpr Window(const Sample* samples, const std::uint16_t* order, std::size_t places, std::size_t begin,
                   std::size_t size)
      : samples_(samples), order_(order), places_(places), begin_(begin), size_(size) {}
  /// Samples one behind the other: a vector, an array, a span.
  template <class Samples>
  requires requires(const Samples& samples) { samples.data(), samples.size(); }
  constexpr Window(const Samples& samples)  // NOLINT(google-explicit-constructor): a view, as std::span
      : Window(samples.data(), nullptr, samples.size(), 0, samples.size()) {}

  [[nodiscard]] constexpr std::size_t size() const { return size_; }
  /// How many samples are not later than t.
  [[nodiscard]] constexpr std::size_t until(base::Micros t) const {
    std::size_t low = 0, high = size_;
    while (low < high) {
      const std::size_t middle = (low + high) / 2;
      if ((*this)[middle].stamp > t) {
        high = middle;
      } else {
        low = middle + 1;
      }
    }
    return low;
  }
  [[nodiscard]] constexpr const Sample& operator[](std::size_t i) const {
    const std::size_t at = begin_ + i;
    return samples_[order_ != nullptr ? order_[at < places_ ? at : at - places_] : at];
  }

 private:
  const Sample* samples_ = nullptr;
  const std::uint16_t* order_ = nullptr;  ///< null: one behind the other
  std::size_t places_ = 0, begin_ = 0, size_ = 0;
};

}  // namespace tetap::sensor
