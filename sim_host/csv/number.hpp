// SPDX-License-Identifier: Apache-2.0
// Numbers and times of a table's cells, as exact as they are written.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace tetap::csv {

/// A decimal number to the nearest double; `point` stands before its fraction. Nothing for other text; "inf" is a
/// number.
[[nodiscard]] std::optional<double> parse_real(std::string_view text, char point);

/// A decimal number times 10^`power`, rounded to the nearest whole; nothing beyond +-9e17 and for other text. Nineteen
/// digits are exact, as nanoseconds since 1970 need them.
[[nodiscard]] std::optional<std::int64_t> parse_whole(std::string_view text, char point, int power);

/// Microseconds since 1970 of "2026-11-28T10:00:00.123456Z": blank or T between, zone "Z", "+01:00" or none (UTC).
[[nodiscard]] std::optional<std::int64_t> parse_calendar(std::string_view text);

/// An empty cell, or the words of libraries for one without a value: NaN, NA, N/A, null, None.
[[nodiscard]] bool is_missing(std::string_view text);

}  // namespace tetap::csv
