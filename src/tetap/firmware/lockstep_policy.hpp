// SPDX-License-Identifier: Apache-2.0
// Senders that may stop the node's own timer. A Begin or Step frame does so, and has to prove that it is meant. One
// that is taken for another sender's or a damaged frame costs the robot its estimate.
#pragma once

#include "tetap/base/time.hpp"
#include "tetap/bus/messages.hpp"
#include "tetap/firmware/pacer.hpp"
#include "tetap/param/parameters.hpp"

namespace tetap::firmware {

/// Evidence that a sync frame is meant.
struct SyncProof {
  bool guarded = false;        ///< checksum of the frame, in a frame of its own
  bool authenticated = false;  ///< a tag
};

class LockstepPolicy {
 public:
  /// Whether a Begin or Step frame is obeyed. In lockstep a Step needs no proof; taking the node over needs one, and
  /// happens once in Pacer::kLockstepPatience at most.
  [[nodiscard]] constexpr bool admits(bus::SyncKind kind, SyncProof proof, param::Lockstep allowed,
                                      bus::SyncState state, base::Micros now) {
    const bool proved = proof.authenticated || allowed == param::Lockstep::kPlain ||
                        (allowed == param::Lockstep::kGuarded && proof.guarded);
    if (state == bus::SyncState::kLockstep) return proved || kind == bus::SyncKind::kStep;
    if (!proved || (taken_over_ && now - taken_over_at_ < Pacer::kLockstepPatience)) return false;
    taken_over_ = true;
    taken_over_at_ = now;
    return true;
  }

 private:
  base::Micros taken_over_at_;
  bool taken_over_ = false;
};

}  // namespace tetap::firmware
