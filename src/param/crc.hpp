// SPDX-License-Identifier: Apache-2.0
// The CRC of the version frame: the stored bits of every row, in the order of the table.
#pragma once

#include "base/bit_crc.hpp"
#include "param/table.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace tetap::param {

namespace detail {
/// Part of a row that a flash image keeps.
struct Place {
  std::uint16_t offset;
  std::uint16_t size;
};
inline constexpr auto kPlaces = [] {
  std::array<Place, kTable.size()> places{};
  for (std::size_t i = 0; i < places.size(); ++i)
    places[i] = {static_cast<std::uint16_t>(kTable[i].offset), static_cast<std::uint16_t>(kTable[i].size)};
  return places;
}();
}  // namespace detail

/// Small rather than fast: it runs once, at the start.
[[nodiscard]] inline std::uint32_t crc(const Parameters& parameters) {
  const auto* bytes = reinterpret_cast<const unsigned char*>(&parameters);
  base::BitCrc sum;
  for (const detail::Place& place : detail::kPlaces)
    for (std::size_t i = 0; i < place.size; i += 4) {
      std::uint32_t word = 0;
      std::memcpy(&word, bytes + place.offset + i, sizeof word);
      sum(word);
    }
  return sum.value();
}

}  // namespace tetap::param
