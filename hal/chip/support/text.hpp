// SPDX-License-Identifier: Apache-2.0
// One line of text put together without stdio: for boot messages, fault reports and target tests. Text that does not
// fit is cut.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace tetap::hal {

template <std::size_t Capacity = 120>
class Text {
 public:
  constexpr Text& add(const char* text) {
    for (std::size_t i = 0; i < Capacity && text[i] != '\0'; ++i) add(text[i]);
    return *this;
  }
  constexpr Text& add(char c) {
    if (size_ < Capacity) text_[size_++] = c;
    return *this;
  }
  /// The last `digits` digits, lower case, no prefix.
  constexpr Text& hex(std::uint32_t value, int digits = 8) {
    for (int shift = 4 * (digits - 1); shift >= 0; shift -= 4) add("0123456789abcdef"[(value >> shift) & 15U]);
    return *this;
  }
  constexpr Text& dec(std::uint32_t value) {
    std::array<char, 10> digits{};
    std::size_t n = 0;
    do {
      digits[n++] = static_cast<char>('0' + value % 10);
      value /= 10;
    } while (value != 0);
    while (n > 0) add(digits[--n]);
    return *this;
  }
  [[nodiscard]] constexpr const char* c_str() const { return text_.data(); }
  [[nodiscard]] constexpr std::size_t size() const { return size_; }

 private:
  std::array<char, Capacity + 1> text_{};
  std::size_t size_ = 0;
};

}  // namespace tetap::hal
