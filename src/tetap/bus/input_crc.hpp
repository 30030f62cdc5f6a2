// SPDX-License-Identifier: Apache-2.0
// Record of the consumed inputs: a count and a CRC that a replay can be held against.
#pragma once

#include "tetap/base/bit_crc.hpp"
#include "tetap/base/members.hpp"

#include <cstdint>

namespace tetap::bus {

/// Input frames consumed: how many, and a CRC-32 over them. Within an epoch the order of arrival leaves no trace: the
/// frames' own CRCs are summed, and the sum goes into the running CRC.
class InputCrc {
 public:
  constexpr InputCrc() = default;
  /// State of the CRC behind an epoch.
  constexpr InputCrc(std::uint32_t running, std::uint32_t count) : running_(running), count_(count) {}
  constexpr void add(std::uint32_t frame_crc) {
    sum_ += frame_crc;
    ++in_epoch_;
    ++count_;
  }
  constexpr void close_epoch() {
    base::BitCrc crc(running_);
    crc(sum_);
    crc(in_epoch_);
    running_ = crc.value();
    sum_ = in_epoch_ = 0;
  }
  [[nodiscard]] constexpr std::uint32_t count() const { return count_; }
  [[nodiscard]] constexpr std::uint32_t running() const { return running_; }
  static constexpr auto members(auto& self) {
    return base::members(self.running_, self.sum_, self.in_epoch_, self.count_);
  }

 private:
  std::uint32_t running_ = 0;
  std::uint32_t sum_ = 0;
  std::uint32_t in_epoch_ = 0;
  std::uint32_t count_ = 0;
};

}  // namespace tetap::bus
