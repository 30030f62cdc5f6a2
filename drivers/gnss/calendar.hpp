// SPDX-License-Identifier: Apache-2.0
// Dates of the Gregorian calendar, GPS week to UTC (IS-GPS-200, sec. 3.3.4: week 0 began on 6 January 1980).
#pragma once

#include "drivers/gnss/report.hpp"

#include <cstdint>

namespace tetap::drivers::gnss {

[[nodiscard]] constexpr bool leap_year(int year) { return year % 4 == 0 && (year % 100 != 0 || year % 400 == 0); }

[[nodiscard]] constexpr int days_in_month(int year, int month) {
  if (month == 2) return leap_year(year) ? 29 : 28;
  return month == 4 || month == 6 || month == 9 || month == 11 ? 30 : 31;
}

[[nodiscard]] constexpr bool is_date(int year, int month, int day) {
  return year >= 1980 && year < 2180 && month >= 1 && month <= 12 && day >= 1 && day <= days_in_month(year, month);
}

/// The second may be 60: a leap second.
[[nodiscard]] constexpr bool is_time(int hour, int minute, int second) {
  return hour >= 0 && hour < 24 && minute >= 0 && minute < 60 && second >= 0 && second <= 60;
}

constexpr void to_next_day(Utc& utc) {
  if (++utc.day <= days_in_month(utc.year, utc.month)) return;
  utc.day = 1;
  if (++utc.month <= 12) return;
  utc.month = 1;
  ++utc.year;
}

/// From GPS week, time of week and leap seconds. Not valid beyond 2180.
[[nodiscard]] constexpr Utc utc_of_gps(int week, std::int64_t tow_ms, int leap_s) {
  constexpr std::int64_t kDay_ms = 86'400'000;
  const std::int64_t since_ms = week * 7 * kDay_ms + tow_ms - std::int64_t{leap_s} * 1000;
  if (week < 0 || since_ms < 0) return {};
  auto days = static_cast<int>(since_ms / kDay_ms) + 5;  // since 1 January 1980
  const auto day_ms = static_cast<std::int32_t>(since_ms % kDay_ms);
  int year = 1980;
  for (; year < 2180 && days >= 365 + (leap_year(year) ? 1 : 0); ++year) days -= 365 + (leap_year(year) ? 1 : 0);
  int month = 1;
  for (; month < 12 && days >= days_in_month(year, month); ++month) days -= days_in_month(year, month);
  const bool valid = is_date(year, month, days + 1);
  return {.year = static_cast<std::uint16_t>(year),
          .month = static_cast<std::uint8_t>(month),
          .day = static_cast<std::uint8_t>(days + 1),
          .hour = static_cast<std::uint8_t>(day_ms / 3'600'000),
          .minute = static_cast<std::uint8_t>(day_ms / 60'000 % 60),
          .second = static_cast<std::uint8_t>(day_ms / 1000 % 60),
          .nano = day_ms % 1000 * 1'000'000,
          .date_valid = valid,
          .time_valid = valid};
}

}  // namespace tetap::drivers::gnss
