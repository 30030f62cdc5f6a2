// SPDX-License-Identifier: Apache-2.0
// Input frames of a log that its node sent itself: samples of the sensors wired to it, as Est_Diag page 10 names them,
// and their guards.
#pragma once

#include "sim_host/replay/protocol.hpp"
#include "tetap/bus/e2e.hpp"
#include "tetap/bus/guard.hpp"

#include <cstdint>
#include <optional>

namespace tetap::sim {

/// Goes along with a log. Samples are the node's own until a page shows them switched off, and again from the
/// command that switches them on; in lockstep none are.
class OwnInputs {
 public:
  /// `first`: the first page of the log, which holds for what stands before it.
  OwnInputs(std::uint32_t base, const std::optional<bus::EstDiagWired>& first) : base_(base) {
    if (first) apply(*first);
  }

  /// Every frame of the log; true: an input that the node sent.
  bool add(const base::CanFrame& frame) {
    const auto offset = offset_in_block(frame, base_);
    if (!offset) return false;
    const auto bytes = bus::payload(frame);
    switch (*offset) {
      case bus::EstDiagWired::kOffset:
        if (const auto page = bus::decode<bus::EstDiagWired>(bytes)) apply(*page);
        return false;
      case bus::InSync::kOffset:
        if (const auto sync = bus::decode<bus::InSync>(bytes)) on_sync(sync->kind, guard_.covers(frame));
        return false;
      case bus::InGuardSample::kOffset:
        if (bus::is_sync_guard(*offset, frame)) guard_.announce(frame);
        if (const auto guard = bus::decode<bus::InGuardSample>(bytes)) return on_ && owns(*guard);
        return false;
      case bus::CmdReset::kOffset:
        if (const auto reset = bus::decode<bus::CmdReset>(bytes);
            reset && bus::e2e_valid(bus::CmdReset::kOffset, bytes))
          on_command(reset->what);
        return false;
      default:
        return on_ && owns(*offset);
    }
  }

  /// The node took up a Begin frame.
  void begin() {
    lockstep_ = true;
    on_ = false;
  }

 private:
  /// A line that is read without a receiver is a scanner's.
  [[nodiscard]] bool wired_lidar() const {
    return !wired_.wired_gnss && wired_.gnss_state == bus::GnssState::kReadOnly;
  }
  [[nodiscard]] bool owns(std::uint32_t offset) const {
    const std::uint32_t imu = bus::ImuGyro::kOffset + wired_.wired_inst * bus::ImuGyro::kStride;
    return (wired_.wired_imu && offset >= imu && offset < imu + bus::ImuGyro::kStride) ||
           (wired_.wired_encoders && offset == bus::InWheelCounts::kOffset) ||
           (wired_.wired_gnss && offset >= bus::InGnssLat::kOffset && offset <= bus::InGnssVelU::kOffset) ||
           (wired_lidar() && (offset == bus::InScanHead::kOffset || offset == bus::InScan::kOffset));
  }
  [[nodiscard]] bool owns(const bus::InGuardSample& guard) const {
    switch (guard.sensor) {
      case sensor::Sensor::kImu:
        return wired_.wired_imu && guard.sample_inst == wired_.wired_inst;
      case sensor::Sensor::kWheelCounts:
        return wired_.wired_encoders;
      case sensor::Sensor::kGnssPosition:
      case sensor::Sensor::kGnssVelocity:
        return wired_.wired_gnss;
      case sensor::Sensor::kScan:
        return wired_lidar();
      default:
        return false;
    }
  }
  void apply(const bus::EstDiagWired& page) {
    wired_ = page;
    on_ = !page.wired_off;
  }
  void on_sync(bus::SyncKind kind, bool guarded) {
    // A node refuses a Step out of lockstep that nobody vouches for.
    if (kind == bus::SyncKind::kStep) return lockstep_ || guarded ? begin() : void();
    if (kind == bus::SyncKind::kBegin) return;  // until the node answers
    if (lockstep_ && !commanded_off_) on_ = true;
    lockstep_ = false;
  }
  void on_command(bus::ResetWhat what) {
    if (what == bus::ResetWhat::kWiredOff) commanded_off_ = true;
    if (what != bus::ResetWhat::kWiredOn) return;
    commanded_off_ = false;
    on_ = !lockstep_;
  }

  std::uint32_t base_;
  bus::SyncGuard guard_;
  bus::EstDiagWired wired_;  ///< wired sensors, by the last page
  bool on_ = false;
  bool commanded_off_ = false;
  bool lockstep_ = false;
};

}  // namespace tetap::sim
