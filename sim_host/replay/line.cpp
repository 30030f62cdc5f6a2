// SPDX-License-Identifier: Apache-2.0
#include "sim_host/replay/line.hpp"

#include <charconv>
#include <cmath>

namespace tetap::sim {

Line& Line::integer(std::int64_t value, int width) {
  std::array<char, 24> digits{};
  const bool negative = value < 0;
  const std::uint64_t magnitude = negative ? ~static_cast<std::uint64_t>(value) + 1 : static_cast<std::uint64_t>(value);
  const char* end = std::to_chars(digits.data(), digits.data() + digits.size(), magnitude).ptr;
  if (negative) put('-');
  for (auto n = static_cast<int>(end - digits.data()); n < width; ++n) put('0');
  return text({digits.data(), end});
}

Line& Line::fixed(std::int64_t value, int decimals) {
  std::int64_t unit = 1;
  for (int i = 0; i < decimals; ++i) unit *= 10;
  if (value < 0) put('-');
  const std::int64_t whole = value / unit, part = value % unit;
  integer(whole < 0 ? -whole : whole);
  return decimals > 0 ? put('.').integer(part < 0 ? -part : part, decimals) : *this;
}

Line& Line::real(double value, int decimals) {
  static constexpr std::array<double, 8> kUnit{1, 10, 100, 1e3, 1e4, 1e5, 1e6, 1e7};
  const double scaled = value * kUnit[static_cast<std::size_t>(decimals) % kUnit.size()];
  if (!(std::fabs(scaled) < 1e15)) return *this;
  return fixed(std::llround(scaled), decimals);
}

Line& Line::hex(std::uint32_t value, int digits) {
  for (int shift = 4 * (digits - 1); shift >= 0; shift -= 4) put("0123456789ABCDEF"[value >> shift & 0xF]);
  return *this;
}

std::string quoted(std::string_view text) {
  std::string out = "\"";
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') out += '\\';
    if (byte >= 0x20) {
      out += c;
    } else {
      Line escape;
      escape.text("\\u").hex(byte, 4);
      out += escape.view();
    }
  }
  return out + '"';
}

}  // namespace tetap::sim
