// SPDX-License-Identifier: Apache-2.0
// Text that keeps up with runs at hundreds of times real time: lines are made by hand in a small buffer.
#pragma once

#include "tetap/base/time.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace tetap::sim {

/// One line of text of bounded length; what does not fit is cut.
class Line {
 public:
  Line& text(std::string_view s) {
    for (const char c : s) put(c);
    return *this;
  }
  Line& put(char c) {
    if (size_ < bytes_.size()) bytes_[size_++] = c;
    return *this;
  }
  Line& integer(std::int64_t value, int width = 1);
  /// value / 10^decimals as a decimal number.
  Line& fixed(std::int64_t value, int decimals);
  /// Rounded to `decimals`; nothing at all for NaN and for numbers beyond 1e15.
  Line& real(double value, int decimals);
  Line& hex(std::uint32_t value, int digits);
  [[nodiscard]] std::string_view view() const { return {bytes_.data(), size_}; }
  void clear() { size_ = 0; }

 private:
  std::array<char, 512> bytes_{};
  std::size_t size_ = 0;
};

/// Text as a JSON string, quotes included.
[[nodiscard]] std::string quoted(std::string_view text);

/// "12.340 s", for messages.
[[nodiscard]] inline std::string in_seconds(base::Micros t) {
  Line text;
  text.fixed(t.us / 1000, 3).text(" s");
  return std::string(text.view());
}

}  // namespace tetap::sim
