// SPDX-License-Identifier: Apache-2.0
// Input frames of a log that its node sent itself: samples of the sensors wired to it, as Est_Diag page 10 names them.
#pragma once

#include "bus/e2e.hpp"
#include "sim_host/play/protocol.hpp"

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
        if (const auto sync = bus::decode<bus::InSync>(bytes)) on_sync(sync->kind);
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
  [[nodiscard]] bool owns(std::uint32_t offset) const {
    const std::uint32_t imu = bus::ImuGyro::kOffset + wired_.wired_inst * bus::ImuGyro::kStride;
    return (wired_.wired_imu && offset >= imu && offset < imu + bus::ImuGyro::kStride) ||
           (wired_.wired_encoders && offset == bus::InWheelCounts::kOffset) ||
           (wired_.wired_gnss && offset >= bus::InGnssLat::kOffset && offset <= bus::InGnssVelU::kOffset);
  }
  void apply(const bus::EstDiagWired& page) {
    wired_ = page;
    on_ = !page.wired_off;
  }
  void on_sync(bus::SyncKind kind) {
    if (kind == bus::SyncKind::kStep) return begin();
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
  bus::EstDiagWired wired_;  ///< wired sensors, by the last page
  bool on_ = false;
  bool commanded_off_ = false;
  bool lockstep_ = false;
};

}  // namespace tetap::sim
