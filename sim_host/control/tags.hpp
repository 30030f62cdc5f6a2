// SPDX-License-Identifier: Apache-2.0
// Tags of commands for a node with `bus.commands = 1` (SECURITY.md): by the owner's key, and by the numbers that the
// node publishes.
#pragma once

#include "tetap/base/can_frame.hpp"
#include "tetap/base/siphash.hpp"
#include "tetap/base/time.hpp"

#include <array>
#include <cstdint>
#include <optional>
#include <string>

namespace tetap::sim {

/// 32 hexadecimal digits: the bytes of bus.key, least significant first of each word. None where they are not, or all
/// zero.
[[nodiscard]] std::optional<base::SipKey> key_of_digits(const std::string& digits);

class Tags {
 public:
  Tags(const base::SipKey& key, std::uint32_t can_base) : key_(key), can_base_(can_base) {}

  /// Every frame of the bus, in order.
  void on_frame(const base::CanFrame& frame);
  /// The nonce that came since forget(); 0: the node has none yet, it has had too few input frames.
  [[nodiscard]] std::optional<std::uint32_t> nonce() const { return nonce_; }
  void forget() { nonce_.reset(); }
  /// The two frames that go before a frame of Cmd_Param. Their counter is above all that came from here, and from
  /// another client by the same clock; `hurry`: far above, where one by another clock has gone before.
  [[nodiscard]] std::array<base::CanFrame, 2> before(const base::CanFrame& command, base::Micros now, bool hurry);

 private:
  base::SipKey key_;
  std::uint32_t can_base_;
  std::uint32_t counter_ = 0;
  std::uint64_t epoch_us_ = 0;
  std::optional<std::uint32_t> nonce_;
  std::uint32_t turn_ = 0;
};

}  // namespace tetap::sim
