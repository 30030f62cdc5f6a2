// SPDX-License-Identifier: Apache-2.0
// Limits of the work that a bus may give a tick. Counted are samples, places that samples out of their order move
// others by, and samples that push others out of a full window. An honest bus stays below, with room for what a gateway
// held back. The limits are tight for a second after one was reached.
#pragma once

#include "tetap/base/members.hpp"

#include <cstddef>
#include <cstdint>

namespace tetap::node {

/// `Capacity` is that of the timeline: the limits follow from it, as the window does.
template <std::size_t Capacity>
class WorkLimit {
 public:
  void power_on() { *this = {}; }
  /// `periods`: ticks in the length of the window.
  void begin_tick(std::uint32_t periods) {
    if (tight_ > 0) --tight_;
    const std::uint32_t share = tight_ > 0 ? 4 * periods : periods;
    add(moves_, tight_ > 0 ? Capacity : 4 * Capacity, kMoves);
    add(samples_, kSamples / share, kSamples);
    rooms_ = tight_ > 0 ? kRooms / 6 : kRooms;
  }

  /// One more sample.
  [[nodiscard]] bool admits_sample() { return samples_ > 0 ? (--samples_, true) : refuse(); }
  /// Places by which a sample may move those behind it.
  [[nodiscard]] std::size_t moves() const { return moves_; }
  void spend_moves(std::size_t moves) { moves_ = static_cast<std::uint16_t>(moves_ - moves); }
  /// One more sample leaves a full window early.
  [[nodiscard]] bool admits_room() { return rooms_ > 0 ? (--rooms_, true) : refuse(); }
  bool refuse() { return tight_ = kTightTicks, false; }
  static constexpr auto members(auto& self) {
    return base::members(self.moves_, self.samples_, self.rooms_, self.tight_);
  }

 private:
  static constexpr std::uint16_t kMoves = 6 * Capacity, kSamples = 3 * Capacity;
  static constexpr std::uint8_t kRooms = 24, kTightTicks = 100;
  static void add(std::uint16_t& left, std::uint32_t more, std::uint16_t most) {
    left = static_cast<std::uint16_t>(left + more < most ? left + more : most);
  }

  std::uint16_t moves_ = kMoves, samples_ = kSamples;  ///< left
  std::uint8_t rooms_ = kRooms;                        ///< left in this tick
  std::uint8_t tight_ = 0;                             ///< ticks
};

}  // namespace tetap::node
