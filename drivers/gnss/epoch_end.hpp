// SPDX-License-Identifier: Apache-2.0
// Learns which message is the last of an epoch, so that an epoch is handed on with it and not with the next one. The
// last message of the epoch before is expected to be the last of this one.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace tetap::drivers::gnss {

template <std::size_t Kinds>
class EpochEnd {
 public:
  constexpr void begin() {
    expected_ = last_;
    last_ = {};
    counts_ = {};
  }

  /// True: nothing more is expected in this epoch.
  constexpr bool arrived(std::size_t kind) {
    if (counts_[kind] < 0xFF) ++counts_[kind];
    last_ = {static_cast<std::uint8_t>(kind + 1), counts_[kind]};
    return last_ == expected_;
  }

 private:
  struct Message {
    std::uint8_t kind = 0;  ///< from 1; 0: none yet
    std::uint8_t nth = 0;   ///< GSA comes once per constellation
    friend constexpr bool operator==(Message, Message) = default;
  };
  Message expected_{}, last_{};
  std::array<std::uint8_t, Kinds> counts_{};
};

}  // namespace tetap::drivers::gnss
