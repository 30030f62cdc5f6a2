// SPDX-License-Identifier: Apache-2.0
// Counts of what the world did to us, each made once where it was noticed. Counters only grow (modulo 2^16) and go out
// in Est_Diag.
#pragma once

#include "tetap/base/can_faults.hpp"
#include "tetap/bus/messages.hpp"

#include <array>
#include <cstdint>

namespace tetap::bus {

/// Counters that follow from the frames and ticks alone: equal in every replay.
struct Counters {
  std::uint16_t too_late = 0;   ///< sample older than the window
  std::uint16_t too_early = 0;  ///< stamp further ahead than a sample may wait
  std::uint16_t duplicate = 0;
  std::uint16_t incomplete = 0;       ///< a sample of several frames of which one never came
  std::uint16_t malformed = 0;        ///< wrong length, or an input id that means nothing
  std::uint16_t out_of_range = 0;     ///< a value that must be there is marked not available
  std::uint16_t not_used = 0;         ///< no estimator takes this kind of sample
  std::uint16_t no_time = 0;          ///< came before the first tick
  std::uint16_t command_refused = 0;  ///< CRC wrong or counter repeated
  std::uint16_t map_full = 0;
  std::uint16_t timeline_full = 0;
  std::uint16_t window_short = 0;  ///< samples that left the window before their time: a newer one needed the room
  std::uint16_t events_dropped = 0;
  std::uint16_t events_high_water = 0;
  std::uint16_t guard_bad = 0;     ///< samples and map entries whose guard was missing, did not fit or came twice
  std::uint16_t auth_bad = 0;      ///< commands and sync frames without a tag, or with a wrong one
  std::uint16_t replayed = 0;      ///< tags whose counter had been used
  std::uint16_t command_rate = 0;  ///< commands that came too fast
  std::uint16_t overload = 0;      ///< samples beyond those that a tick may work on
  std::uint16_t two_senders = 0;   ///< samples while two senders number those of one sensor
};

/// Measurements of real time and the bus: different in each run, and never fed back into an estimate.
struct LoopHealth {
  bus::SyncState sync = bus::SyncState::kOwnTimer;
  std::uint32_t longest_us = 0;  ///< tick, since start
  float mean_us = 0;             ///< running mean
  std::uint16_t ticks_late = 0;  ///< took longer than their period, or could not begin in it
  std::uint16_t sync_lost = 0;
  std::uint16_t sync_back = 0;     ///< sync frames whose time was not after the last tick
  std::uint16_t sync_jump = 0;     ///< sync frames too far ahead
  std::uint16_t sync_gap = 0;      ///< sync frames that were sent, by their counter, and never came
  std::uint16_t sync_bad = 0;      ///< sync frames of wrong length
  std::uint16_t lock_refused = 0;  ///< Begin and Step frames that were refused
  std::uint8_t save_refused = 0;   ///< saves of parameters that were refused
  base::CanFaults bus;
  bool id_conflict = false;  ///< within the last second a frame came whose id is this node's own
  bool unlogged = false;     ///< a wired sample was consumed that the bus did not take
  /// Pages 9 to 11 of Est_Diag; null: nothing is wired, and these pages are empty.
  const std::array<Payload, 3>* pages = nullptr;
};

}  // namespace tetap::bus
