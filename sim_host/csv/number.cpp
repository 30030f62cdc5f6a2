// SPDX-License-Identifier: Apache-2.0
#include "sim_host/csv/number.hpp"

#include "sim_host/replay/calendar.hpp"

#include <array>
#include <cstdlib>
#include <limits>
#include <string>

namespace tetap::csv {

namespace {

constexpr std::uint64_t kMostDigits = 999'999'999'999'999'999;  ///< one more digit still fits 64 bits

constexpr bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// +-digits * 10^power. `exact`: no digit was dropped.
struct Decimal {
  std::uint64_t digits = 0;
  int power = 0;
  bool negative = false;
  bool exact = true;
};

std::optional<Decimal> parse_decimal(std::string_view text, char point) {
  Decimal number;
  std::size_t i = 0;
  if (i < text.size() && (text[i] == '-' || text[i] == '+')) number.negative = text[i++] == '-';
  bool any = false, fraction = false;
  for (; i < text.size(); ++i) {
    if (text[i] == point && !fraction) {
      fraction = true;
    } else if (!is_digit(text[i])) {
      break;
    } else {
      any = true;
      if (number.digits <= kMostDigits) {
        number.digits = number.digits * 10 + static_cast<std::uint64_t>(text[i] - '0');
        number.power -= fraction ? 1 : 0;
      } else {
        number.exact = number.exact && text[i] == '0';
        number.power += fraction ? 0 : 1;
      }
    }
  }
  if (!any) return std::nullopt;
  if (i == text.size()) return number;
  if (text[i] != 'e' && text[i] != 'E') return std::nullopt;
  ++i;
  bool down = false;
  if (i < text.size() && (text[i] == '-' || text[i] == '+')) down = text[i++] == '-';
  int power = 0;
  if (i == text.size() || text.size() - i > 4) return std::nullopt;
  for (; i < text.size(); ++i) {
    if (!is_digit(text[i])) return std::nullopt;
    power = power * 10 + (text[i] - '0');
  }
  number.power += down ? -power : power;
  return number;
}

}  // namespace

std::optional<double> parse_real(std::string_view text, char point) {
  constexpr std::array<double, 23> kPowers{1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,  1e8,  1e9,  1e10, 1e11,
                                           1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};
  const auto number = parse_decimal(text, point);
  if (!number) {
    const bool negative = text.starts_with('-');
    if (negative || text.starts_with('+')) text.remove_prefix(1);
    const bool infinite = text == "inf" || text == "Inf" || text == "INF" || text == "infinity" || text == "Infinity";
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    return infinite ? std::optional(negative ? -kInfinity : kInfinity) : std::nullopt;
  }
  // Both factors are exact, so that their product or quotient is rounded once.
  if (number->exact && number->digits < (std::uint64_t{1} << 53) && number->power >= -22 && number->power <= 22) {
    const auto digits = static_cast<double>(number->digits);
    const double value = number->power < 0 ? digits / kPowers[static_cast<std::size_t>(-number->power)]
                                           : digits * kPowers[static_cast<std::size_t>(number->power)];
    return number->negative ? -value : value;
  }
  std::array<char, 512> copy{};
  if (text.size() >= copy.size()) return std::nullopt;
  for (std::size_t i = 0; i < text.size(); ++i) copy[i] = text[i] == point ? '.' : text[i];
  return std::strtod(copy.data(), nullptr);
}

std::optional<std::int64_t> parse_whole(std::string_view text, char point, int power) {
  const auto number = parse_decimal(text, point);
  if (!number) return std::nullopt;
  std::uint64_t value = number->digits;
  int shift = number->power + power;
  for (; shift > 0 && value != 0; --shift) {
    if (value > kMostDigits) return std::nullopt;
    value *= 10;
  }
  bool up = false;
  for (; shift < 0 && value != 0; ++shift) {
    up = value % 10 >= 5;
    value /= 10;
  }
  if (shift < 0) up = false;
  value += up ? 1 : 0;
  if (value > 900'000'000'000'000'000) return std::nullopt;
  const auto whole = static_cast<std::int64_t>(value);
  return number->negative ? -whole : whole;
}

std::optional<std::int64_t> parse_calendar(std::string_view text) {
  const auto whole = sim::calendar_seconds(text);
  if (!whole) return std::nullopt;
  std::size_t end = sim::kDateAndTime;
  if (end < text.size() && (text[end] == '.' || text[end] == ','))
    for (++end; end < text.size() && is_digit(text[end]);) ++end;
  const auto part = end == sim::kDateAndTime ? std::optional<std::int64_t>(0)
                                             : parse_whole(text.substr(sim::kDateAndTime, end - sim::kDateAndTime),
                                                           text[sim::kDateAndTime], 6);
  if (!part) return std::nullopt;
  std::string_view zone = text.substr(end);
  if (zone.starts_with(' ')) zone.remove_prefix(1);
  std::int64_t east_s = 0;
  if (!zone.empty() && zone != "Z" && zone != "UTC") {
    const bool colon = zone.size() == 6 && zone[3] == ':';
    if ((zone[0] != '+' && zone[0] != '-') || (!colon && zone.size() != 5)) return std::nullopt;
    const auto digits = std::string(zone.substr(1, 2)) + std::string(zone.substr(colon ? 4 : 3, 2));
    for (const char c : digits)
      if (!is_digit(c)) return std::nullopt;
    const int hours = (digits[0] - '0') * 10 + digits[1] - '0', minutes = (digits[2] - '0') * 10 + digits[3] - '0';
    east_s = (hours * 3600 + minutes * 60) * (zone[0] == '-' ? -1 : 1);
  }
  return (*whole - east_s) * 1'000'000 + *part;
}

bool is_missing(std::string_view text) {
  for (const std::string_view word : {"", "NaN", "nan", "NAN", "NA", "N/A", "null", "NULL", "None", "none", "-"})
    if (text == word) return true;
  return false;
}

}  // namespace tetap::csv
