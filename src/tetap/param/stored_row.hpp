// SPDX-License-Identifier: Apache-2.0
// The table as a flash image has it, without strings and doubles: place, limits and effect of each row, in the words of
// 32 bits that its member stores.
#pragma once

#include "tetap/param/limits.hpp"

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string_view>
#include <utility>

namespace tetap::param {

struct StoredRow {
  enum class Kind : std::uint8_t { kFloat, kSigned, kUnsigned, kLong };
  std::uint16_t index;
  std::uint16_t offset;  ///< place of the member in Parameters, bytes
  std::uint8_t words;    ///< 32 bits each; two an element of kLong, low word first
  Kind kind;
  bool live;
  bool access;                ///< identity, and what the firmware around the node reads once: never over the bus
  bool secret;                ///< never sent
  std::uint32_t least, most;  ///< limits as stored; not of kLong

  [[nodiscard]] constexpr bool within(std::uint32_t word) const {
    switch (kind) {
      case Kind::kFloat: {
        const auto value = std::bit_cast<float>(word);
        return value >= std::bit_cast<float>(least) && value <= std::bit_cast<float>(most);
      }
      case Kind::kSigned:
        return static_cast<std::int32_t>(word) >= static_cast<std::int32_t>(least) &&
               static_cast<std::int32_t>(word) <= static_cast<std::int32_t>(most);
      case Kind::kUnsigned:
        return word >= least && word <= most;
      default:
        return true;
    }
  }
};

namespace detail {

/// The outermost float that the row accepts: a limit's nearest float, or a neighbour within its rounding.
constexpr std::uint32_t float_limit(const Row& row, double limit, bool upper) {
  auto bits = std::bit_cast<std::uint32_t>(static_cast<float>(limit));
  if (!(limit < 0 || limit > 0)) return 0;
  const bool outwards = (limit > 0) == upper;
  for (std::uint32_t next = bits; param::within(row, static_cast<double>(std::bit_cast<float>(next)));) {
    bits = next;
    next += outwards ? 1U : ~0U;
  }
  return bits;
}
constexpr StoredRow stored(const Row& row) {
  using Kind = StoredRow::Kind;
  const bool is_long = row.size / row.elements == 8;
  const bool is_unsigned = row.maximum > std::numeric_limits<std::int32_t>::max();
  const Kind kind = row.storage == Storage::kFloat ? Kind::kFloat
                    : is_long                      ? Kind::kLong
                    : is_unsigned                  ? Kind::kUnsigned
                                                   : Kind::kSigned;
  const auto whole = [&](double limit) { return static_cast<std::uint32_t>(static_cast<std::int64_t>(limit)); };
  const std::string_view path(row.path);
  return {.index = row.index,
          .offset = static_cast<std::uint16_t>(row.offset),
          .words = static_cast<std::uint8_t>(row.size / 4),
          .kind = kind,
          .live = row.effect == Effect::kLive,
          .access = path.starts_with("bus.") || path.starts_with("wired.") || path == "can_base" ||
                    path == "loop.lockstep" || path == "loop.period_us",
          .secret = path == "bus.key",
          .least = kind == Kind::kFloat  ? float_limit(row, row.minimum, false)
                   : kind == Kind::kLong ? 0
                                         : whole(row.minimum),
          .most = kind == Kind::kFloat  ? float_limit(row, row.maximum, true)
                  : kind == Kind::kLong ? 0
                                        : whole(row.maximum)};
}

/// A constant, so that the call has one target.
template <std::size_t i>
inline constexpr auto kRuleHolds = kRules[i].holds;
template <std::size_t... i>
[[nodiscard]] constexpr bool rules_hold(const Parameters& p, std::index_sequence<i...>) {
  return (kRuleHolds<i>(p) && ...);  // one by one: an image then has no text of a rule
}

}  // namespace detail

inline constexpr auto kStoredRows = [] {
  std::array<StoredRow, kTable.size()> rows{};
  for (std::size_t i = 0; i < rows.size(); ++i) rows[i] = detail::stored(kTable[i]);
  return rows;
}();

/// Every rule between fields, and the limits of the rows of two words.
[[nodiscard]] inline bool plausible_together(const Parameters& p) {
  const auto degrees = [](std::int64_t steps, std::int64_t most) {
    return steps >= -most * 500'000'000 && steps <= most * 500'000'000;
  };
  return degrees(p.gnss.origin_latitude_2ndeg, 90) && degrees(p.gnss.origin_longitude_2ndeg, 180) &&
         detail::rules_hold(p, std::make_index_sequence<kRules.size()>{});
}

}  // namespace tetap::param
