// SPDX-License-Identifier: Apache-2.0
// The fields of an NMEA sentence as numbers, by integers only: no rounding but the last digit's, no library. An empty
// field is not an error; a field that is not what it should be marks the whole sentence. NMEA 0183 v4.1, sec. 5.3
// and 6.
#pragma once

#include "drivers/gnss/calendar.hpp"
#include "tetap/base/float_bits.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

namespace tetap::drivers::gnss::nmea {

using Text = std::span<const std::uint8_t>;

/// A decimal number times 10^decimals, rounded half away from zero. Empty: not a number, or more than 15 digits with
/// the decimals.
[[nodiscard]] constexpr std::optional<std::int64_t> scaled(Text text, int decimals) {
  constexpr std::int64_t kMost = 999'999'999'999'999;
  std::size_t at = 0;
  const bool negative = !text.empty() && text[0] == '-';
  if (!text.empty() && (text[0] == '-' || text[0] == '+')) at = 1;
  std::int64_t value = 0;
  bool point = false, any = false, round_up = false;
  int left = decimals;
  for (; at < text.size(); ++at) {
    const std::uint8_t c = text[at];
    if (c == '.') {
      if (point) return {};
      point = true;
      continue;
    }
    if (c < '0' || c > '9') return {};
    any = true;
    if (!point || left > 0) {
      if (value > kMost / 10) return {};
      value = value * 10 + (c - '0');
      if (point) --left;
    } else if (left == 0) {
      round_up = c >= '5';
      --left;  // the digits after this one change nothing
    }
  }
  if (!any) return {};
  for (; left > 0; --left) {
    if (value > kMost / 10) return {};
    value *= 10;
  }
  value += round_up ? 1 : 0;
  return negative ? -value : value;
}

class Fields {
 public:
  static constexpr std::size_t kMost = 24;  ///< those after it are not looked at

  explicit constexpr Fields(Text text) {
    std::size_t begin = 0;
    for (std::size_t i = 0; i <= text.size() && count_ < kMost; ++i) {
      if (i < text.size() && text[i] != ',') continue;
      fields_[count_] = text.subspan(begin, i - begin);
      ++count_;
      begin = i + 1;
    }
  }

  [[nodiscard]] constexpr std::size_t count() const { return count_; }
  [[nodiscard]] constexpr bool ok() const { return ok_; }
  constexpr void refuse() { ok_ = false; }
  [[nodiscard]] constexpr Text operator[](std::size_t i) const { return i < count_ ? fields_[i] : Text{}; }
  /// The one character of a field; 0: empty.
  constexpr char letter(std::size_t i) {
    const Text t = (*this)[i];
    if (t.size() > 1) ok_ = false;
    return t.size() == 1 ? static_cast<char>(t[0]) : '\0';
  }

  /// Times 10^decimals, within +-limit.
  constexpr std::optional<std::int32_t> integer(std::size_t i, int decimals, std::int32_t limit) {
    const Text t = (*this)[i];
    if (t.empty()) return {};
    const auto value = scaled(t, decimals);
    if (!value || *value > limit || *value < -limit) {
      ok_ = false;
      return {};
    }
    return static_cast<std::int32_t>(*value);
  }

  /// From 0 to `limit`.
  constexpr std::optional<std::int32_t> natural(std::size_t i, std::int32_t limit) {
    const auto value = integer(i, 0, limit);
    if (!value || *value >= 0) return value;
    refuse();
    return {};
  }

  /// With three decimals, or five; NaN: empty.
  constexpr float milli(std::size_t i) { return quotient(i, 3, 1e3F); }
  constexpr float ten_micro(std::size_t i) { return quotient(i, 5, 1e5F); }

  /// dddmm.mmmm and a letter, in units of 2e-9 deg; empty when both are.
  constexpr std::optional<std::int64_t> angle(std::size_t i, char positive, char negative, int most_deg) {
    const Text t = (*this)[i];
    const char side = letter(i + 1);
    if (t.empty()) return {};
    const auto value = scaled(t, 9);  // 1e-9 min; degrees from the hundreds on
    if (!value || *value < 0 || (side != positive && side != negative)) return fail();
    constexpr std::int64_t kMinute = 1'000'000'000;
    const std::int64_t deg = *value / (100 * kMinute), minutes = *value % (100 * kMinute);
    // 1e-9 min is 1/60 of 1e-9 deg, that is 1/120 of 2e-9 deg.
    const std::int64_t units = deg * 500'000'000 + (minutes + 60) / 120;
    if (minutes >= 60 * kMinute || units > most_deg * std::int64_t{500'000'000}) return fail();
    return side == positive ? units : -units;
  }

  /// hhmmss.sss into `out`; false: empty.
  constexpr bool time(std::size_t i, Utc& out) {
    const Text t = (*this)[i];
    if (t.empty()) return false;
    const auto value = scaled(t, 9);
    const bool whole = t.size() >= 6 && (t.size() == 6 || t[6] == '.');
    if (!value || *value < 0 || !whole) return fail().has_value();
    const auto clock = static_cast<std::int32_t>(*value / 1'000'000'000);
    if (!is_time(clock / 10'000, clock / 100 % 100, clock % 100)) return fail().has_value();
    out.hour = static_cast<std::uint8_t>(clock / 10'000);
    out.minute = static_cast<std::uint8_t>(clock / 100 % 100);
    out.second = static_cast<std::uint8_t>(clock % 100);
    out.nano = static_cast<std::int32_t>(*value % 1'000'000'000);
    out.time_valid = true;
    return true;
  }

  constexpr bool date(int day, int month, int year, Utc& out) {
    if (!is_date(year, month, day)) return fail().has_value();
    out.year = static_cast<std::uint16_t>(year);
    out.month = static_cast<std::uint8_t>(month);
    out.day = static_cast<std::uint8_t>(day);
    out.date_valid = true;
    return true;
  }

 private:
  /// Divided, because 1e-3 is no float.
  constexpr float quotient(std::size_t i, int decimals, float per) {
    const auto value = integer(i, decimals, 2'147'483'647);
    return value ? static_cast<float>(*value) / per : base::kNan;
  }
  constexpr std::optional<std::int64_t> fail() {
    ok_ = false;
    return {};
  }

  std::array<Text, kMost> fields_{};
  std::size_t count_ = 0;
  bool ok_ = true;
};

}  // namespace tetap::drivers::gnss::nmea
