// SPDX-License-Identifier: Apache-2.0
// Dates of the Gregorian calendar as seconds since 1970, without a zone.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

namespace tetap::sim {

inline constexpr std::size_t kDateAndTime = 19;  ///< length of "2026-11-28T10:00:00"

/// Days since 1970-01-01. Years are counted from March, so that the leap day ends them.
constexpr std::int64_t days_since_1970(std::int64_t year, int month, int day) {
  year -= month <= 2 ? 1 : 0;
  const std::int64_t month_from_march = (month + 9) % 12;
  return 365 * year + year / 4 - year / 100 + year / 400 + (153 * month_from_march + 2) / 5 + day - 1 - 719'468;
}

/// Seconds since 1970 of the text's first 19 characters, "2026-11-28 10:00:00" with a blank or a T; nothing for others.
constexpr std::optional<std::int64_t> calendar_seconds(std::string_view text) {
  constexpr std::string_view kForm = "dddd-dd-dd dd:dd:dd";
  if (text.size() < kForm.size()) return std::nullopt;
  for (std::size_t i = 0; i < kForm.size(); ++i) {
    const char c = text[i];
    const bool right = kForm[i] == 'd' ? c >= '0' && c <= '9' : c == kForm[i] || (kForm[i] == ' ' && c == 'T');
    if (!right) return std::nullopt;
  }
  const auto two = [text](std::size_t at) { return (text[at] - '0') * 10 + text[at + 1] - '0'; };
  const int year = two(0) * 100 + two(2), month = two(5), day = two(8);
  const int hour = two(11), minute = two(14), second = two(17);
  if (year < 1970 || month < 1 || month > 12 || day < 1 || day > 31 || hour > 24 || minute > 59 || second > 60)
    return std::nullopt;
  return days_since_1970(year, month, day) * 86'400 + hour * 3600 + minute * 60 + second;
}
static_assert(calendar_seconds("1970-01-01 00:00:00") == 0 && calendar_seconds("2000-02-29T23:59:59") == 951'868'799);

}  // namespace tetap::sim
