// SPDX-License-Identifier: Apache-2.0
// Digest of a state too large to hash in every tick. Inputs and results of each update are hashed at once, the memory
// itself in parts, round-robin. A bit that differs shows with the update that uses it, at the latest after one round.
#pragma once

#include "tetap/base/bit_crc.hpp"
#include "tetap/base/members.hpp"

#include <cstddef>
#include <cstdint>

namespace tetap::base {

class StateDigest {
 public:
  constexpr void restart() { *this = {}; }

  /// Numbers of an update: what was measured, what followed.
  constexpr void update(auto... numbers) {
    BitCrc crc(value_);
    (crc(numbers), ...);
    value_ = crc.value();
  }
  /// The next `count` of `size` elements of the memory; hash_element(index, sink) feeds one to the sink. Once a tick.
  template <class HashElement>
  constexpr void scan(std::size_t size, std::size_t count, const HashElement& hash_element) {
    BitCrc crc(value_);
    for (std::size_t k = 0; k < count && k < size; ++k) {
      if (next_ >= size) next_ = 0;
      hash_element(next_++, crc);
    }
    value_ = crc.value();
  }

  [[nodiscard]] constexpr std::uint32_t value() const { return value_; }
  /// Element of the memory that the next scan() begins with.
  [[nodiscard]] constexpr std::size_t next() const { return next_; }
  static constexpr auto members(auto& self) { return base::members(self.value_, base::count(self.next_)); }

 private:
  std::uint32_t value_ = 0;
  std::size_t next_ = 0;
};

}  // namespace tetap::base
