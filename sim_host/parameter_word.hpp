// SPDX-License-Identifier: Apache-2.0
// The words of 32 bits that a row of the table has in the node's memory, on the bus and in flash.
#pragma once

#include "tetap/param/parameters.hpp"

#include <cstddef>
#include <cstdint>
#include <cstring>

namespace tetap::sim {

/// `row` is a param::Row or a param::StoredRow; `word` is one of its words, from 0.
template <class Row>
[[nodiscard]] std::uint32_t word_of(const param::Parameters& parameters, const Row& row, std::size_t word) {
  std::uint32_t value = 0;
  std::memcpy(&value, reinterpret_cast<const char*>(&parameters) + row.offset + 4 * word, sizeof value);
  return value;
}
template <class Row>
void put_word(param::Parameters& parameters, const Row& row, std::size_t word, std::uint32_t value) {
  std::memcpy(reinterpret_cast<char*>(&parameters) + row.offset + 4 * word, &value, sizeof value);
}

}  // namespace tetap::sim
