// SPDX-License-Identifier: Apache-2.0
// A node's block of ids, for the host programs: the frames that are inputs, sync frames, answers. The frames of one
// epoch are collected into one.
#pragma once

#include "tetap/base/can_frame.hpp"
#include "tetap/base/time.hpp"
#include "tetap/bus/codec.hpp"
#include "tetap/bus/guard.hpp"
#include "tetap/bus/messages.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

namespace tetap::sim {

inline constexpr std::uint32_t kInputOffsets =
    0x20;  ///< offsets below are inputs, the others of the block are the node's
inline constexpr std::uint64_t kTimeMask = 0xFFFFFFFFFFFF;

/// Position within the node's block and the map's behind it; nothing when the frame is of neither. If no robot maps,
/// another node may have the map's identifiers for inputs of its own.
[[nodiscard]] constexpr std::optional<std::uint32_t> offset_in_block(const base::CanFrame& frame, std::uint32_t base) {
  if (frame.extended || frame.id < base || frame.id >= base + bus::kBlock + bus::kMapBlock) return std::nullopt;
  return frame.id - base;
}
/// Offsets of inputs behind the map's outputs: parameters, displacements, scans, images, closures and features.
[[nodiscard]] constexpr bool is_map_input(std::uint32_t offset) {
  return offset == bus::CmdParamSet::kOffset ||
         (offset >= bus::InRelativePose::kOffset && offset <= bus::InFeature::kOffset);
}
[[nodiscard]] constexpr bool is_input(std::uint32_t offset) { return offset < kInputOffsets || is_map_input(offset); }
/// Those of them that a robot takes; it counts the others as no inputs.
struct MapInputs {
  bool closures = false;
  bool images = false;
  bool scans = false;
  bool parameters = false;
  bool relatives = false;

  [[nodiscard]] constexpr bool has(std::uint32_t offset) const {
    const bool image = offset == bus::InImage::kOffset || offset == bus::InFeature::kOffset;
    const bool scan = offset == bus::InScanHead::kOffset || offset == bus::InScan::kOffset;
    const bool relative = offset == bus::InRelativePose::kOffset || offset == bus::InRelativePoseStdX::kOffset;
    return (images && image) || (relatives && relative) || (scans && scan) ||
           (closures && offset == bus::InClosureFrames::kOffset) || (parameters && offset == bus::CmdParamSet::kOffset);
  }
};
/// A frame the node consumes and counts: of its inputs, sync frames and their guards excepted.
[[nodiscard]] constexpr bool is_counted_input(const base::CanFrame& frame, std::uint32_t base,
                                              MapInputs map_inputs = {}) {
  const auto offset = offset_in_block(frame, base);
  if (offset && is_map_input(*offset)) return map_inputs.has(*offset);
  return offset && *offset < kInputOffsets && *offset != bus::InSync::kOffset && !bus::is_sync_guard(*offset, frame);
}
/// Frames with real time of loop and controller, and the program's version, differ between runs that are otherwise the
/// same. Everything else must not differ. Deterministic among the diagnostics are counters that follow from the frames
/// (bus::Counters).
[[nodiscard]] constexpr bool is_deterministic(const base::CanFrame& frame, std::uint32_t base) {
  const std::uint32_t offset = frame.id - base;
  if (offset == bus::EstDiagLoop::kOffset) {
    const auto bytes = bus::payload(frame);
    return bus::decode<bus::EstDiagQueues>(bytes) || bus::decode<bus::EstDiagOrder>(bytes) ||
           bus::decode<bus::EstDiagFrames>(bytes) || bus::decode<bus::EstDiagRefused>(bytes) ||
           bus::decode<bus::EstDiagCapacity>(bytes) || bus::decode<bus::EstDiagMapper>(bytes);
  }
  return offset >= kInputOffsets && offset != bus::EstVersion::kOffset;
}

/// A piece of a snapshot: it comes between two epochs, and belongs to none.
[[nodiscard]] constexpr bool is_snapshot_piece(const base::CanFrame& frame, std::uint32_t base) {
  return !frame.extended && frame.id == base + bus::EstDiagSnapshot::kOffset &&
         bus::decode<bus::EstDiagSnapshot>(bus::payload(frame)).has_value();
}
/// The frame without what a repetition cannot know: two bits of Est_Status are about the bus and not about the frames.
[[nodiscard]] constexpr base::CanFrame repeatable(const base::CanFrame& frame, std::uint32_t base) {
  if (frame.id != base + bus::EstStatus::kOffset) return frame;
  auto status = bus::decode<bus::EstStatus>(bus::payload(frame));
  if (!status) return frame;
  status->crc = 0;
  status->unlogged = false;
  status->faults =
      static_cast<std::uint16_t>(status->faults & ~(1U << static_cast<unsigned>(sensor::Fault::kIdConflict)));
  return bus::frame(base, *status);
}

[[nodiscard]] constexpr bus::InSync sync_message(bus::SyncKind kind, base::Micros time, std::uint8_t counter) {
  return {.time_us = static_cast<std::uint64_t>(time.us) & kTimeMask, .ctr = counter, .kind = kind};
}
[[nodiscard]] constexpr base::CanFrame sync_frame(std::uint32_t base, bus::SyncKind kind, base::Micros time,
                                                  std::uint8_t counter) {
  return bus::frame(base, sync_message(kind, time, counter));
}
[[nodiscard]] constexpr bool same_bus_time(std::uint64_t bus_us, base::Micros time) {
  return bus_us == (static_cast<std::uint64_t>(time.us) & kTimeMask);
}
/// The full time nearest to `reference` with these 48 low bits.
[[nodiscard]] constexpr base::Micros extend_bus_time(std::uint64_t bus_us, base::Micros reference) {
  const std::uint64_t ahead = (bus_us - static_cast<std::uint64_t>(reference.us)) & kTimeMask;
  const auto offset =
      static_cast<std::int64_t>(ahead) - (ahead > kTimeMask / 2 ? static_cast<std::int64_t>(kTimeMask) + 1 : 0);
  return {reference.us + offset};
}
/// The first time of the bus in a log: near the log's own clock, or as it stands where the log counts the calendar and
/// the bus counts from its boot.
[[nodiscard]] constexpr base::Micros first_bus_time(std::uint64_t bus_us, base::Micros log_time) {
  constexpr std::int64_t kDay_us = 86'400'000'000;
  const std::int64_t near_us = extend_bus_time(bus_us, log_time).us, apart_us = near_us - log_time.us;
  return {apart_us > -kDay_us && apart_us < kDay_us ? near_us : static_cast<std::int64_t>(bus_us)};
}

/// Everything a node sent for one tick, from Est_Epoch to Est_StateCrc.
struct NodeEpoch {
  std::optional<bus::EstEpoch> head;  ///< missing: its frame was lost
  bus::EstStateCrc tail;
  std::size_t received = 0;                ///< frames, tail included
  std::span<const base::CanFrame> frames;  ///< the first 256 of them, in order of arrival; valid until the next frame
};

class EpochCollector {
 public:
  explicit EpochCollector(std::uint32_t base) : base_(base) {}

  /// Between two epochs: the answer to a Begin frame comes only then.
  [[nodiscard]] bool idle() const { return received_ == 0; }
  [[nodiscard]] bool is_begin_response(const base::CanFrame& frame) const {
    return idle() && frame.id == base_ + bus::EstVersion::kOffset && !frame.extended;
  }

  /// A frame from the bus; the finished epoch when this was its last one. Frames of others are ignored.
  std::optional<NodeEpoch> add(const base::CanFrame& frame) {
    const auto offset = offset_in_block(frame, base_);
    if (!offset || is_input(*offset) || is_begin_response(frame) || is_snapshot_piece(frame, base_))
      return std::nullopt;
    const bool of_map = *offset >= bus::kBlock;
    if (of_map && idle()) return std::nullopt;
    if (*offset == bus::EstEpoch::kOffset) begin(bus::decode<bus::EstEpoch>(bus::payload(frame)));
    if (stored_ < frames_.size()) frames_[stored_++] = frame;
    ++(of_map ? of_map_ : received_);
    if (*offset != bus::EstStateCrc::kOffset) return std::nullopt;
    const auto tail = bus::decode<bus::EstStateCrc>(bus::payload(frame));
    if (!tail) return std::nullopt;
    decide_whose_map(*tail);
    const NodeEpoch done{.head = head_,
                         .tail = *tail,
                         .received = received_ + (maps_ ? of_map_ : 0),
                         .frames = std::span(frames_).first(stored_)};
    reset();
    return done;
  }
  void reset() {
    received_ = of_map_ = stored_ = 0;
    head_.reset();
  }
  /// State of the epoch that is under way.
  [[nodiscard]] const std::optional<bus::EstEpoch>& head() const { return head_; }
  [[nodiscard]] std::size_t received() const { return received_; }

 private:
  void begin(const std::optional<bus::EstEpoch>& head) {
    if (!head || (head_ && head_->time_us == head->time_us)) return;  // a duplicate counts as one frame too many
    reset();
    head_ = head;
  }

  /// Frames with the map's identifiers are the node's when its own count has them; else another node's inputs, and
  /// dropped.
  void decide_whose_map(const bus::EstStateCrc& tail) {
    if (of_map_ == 0 || maps_) return;
    maps_ = tail.frames == static_cast<std::uint8_t>(received_ + of_map_);
    if (maps_) return;
    const auto begin = frames_.begin(), end = begin + static_cast<std::ptrdiff_t>(stored_);
    stored_ = static_cast<std::size_t>(
        std::remove_if(begin, end, [&](const base::CanFrame& f) { return f.id - base_ >= bus::kBlock; }) - begin);
  }

  std::uint32_t base_;
  std::optional<bus::EstEpoch> head_;
  std::size_t received_ = 0;  ///< frames of the node's block in this epoch
  std::size_t of_map_ = 0;    ///< frames of the map's block
  std::size_t stored_ = 0;
  bool maps_ = false;  ///< the node sends a map
  std::array<base::CanFrame, 256> frames_{};
};

}  // namespace tetap::sim
