// SPDX-License-Identifier: Apache-2.0
// The state of a node between two epochs as bytes on the bus. A log that begins after the node's start can be repeated
// from there. The bytes are those of the node in memory. Only a program with the same layout can read them: the same
// commit, compiled for the same kind of machine.
#pragma once

#include "tetap/base/can_frame.hpp"
#include "tetap/base/crc.hpp"
#include "tetap/base/time.hpp"
#include "tetap/bus/codec.hpp"
#include "tetap/bus/input_crc.hpp"
#include "tetap/bus/messages.hpp"
#include "tetap/bus/version.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <type_traits>

namespace tetap::firmware {

/// First bytes of a snapshot, little-endian as every core that this runs on.
struct SnapshotHeader {
  std::uint32_t length = 0;    ///< bytes of the state that follows
  std::uint32_t crc = 0;       ///< CRC-32 of the state
  std::int64_t time_us = 0;    ///< time of the epoch whose end it is
  std::uint32_t in_count = 0;  ///< inputs consumed by then
  std::uint32_t in_crc = 0;    ///< running CRC of these
  std::uint32_t git = 0;       ///< commit of the program (Est_Version)
  std::uint32_t config = 0;    ///< hash of its parameters
  std::uint32_t epoch = 0;     ///< number of that epoch since the node's start
  std::uint32_t version = 1;   ///< layout of this header
};
static_assert(sizeof(SnapshotHeader) == 40);

inline constexpr std::size_t kSnapshotPiece = 6;  ///< bytes in one frame

[[nodiscard]] inline std::uint32_t snapshot_crc(std::span<const std::byte> state) {
  base::Crc32 crc;
  for (const std::byte byte : state) crc.add(static_cast<std::uint8_t>(byte));
  return crc.value();
}

/// One frozen copy of a node, and how much of it is on the bus.
template <class Node>
class SnapshotSender {
 public:
  SnapshotSender(std::uint32_t can_base, base::Micros period) : can_base_(can_base), period_(period) {}

  /// The node's state now, right behind an epoch. One that was on its way is given up.
  void freeze(const Node& node, const bus::Version& version, std::uint32_t config) {
    static_assert(std::is_trivially_destructible_v<Node>, "its bytes are all of it");
    std::memcpy(state_.data(), static_cast<const void*>(&node), state_.size());
    reinterpret_cast<Node*>(state_.data())->hide_secrets();
    header_ = {.length = sizeof(Node),
               .crc = snapshot_crc(state_),
               .time_us = node.now().us,
               .in_count = node.consumed().count(),
               .in_crc = node.consumed().running(),
               .git = version.git,
               .config = config,
               .epoch = node.epoch()};
    sent_ = 0;
    pieces_ = (sizeof header_ + state_.size() + kSnapshotPiece - 1) / kSnapshotPiece;
  }

  /// Once an epoch, behind its frames: as many pieces as bring all of them out within kDuration. `send` gives false
  /// when the bus takes no more.
  template <class Send>
  void send(Send&& send) {
    if (sent_ == pieces_) return;
    const std::size_t most = pieces_ * static_cast<std::size_t>(period_.us) / kDuration_us + 1;
    for (std::size_t i = 0; i < most && sent_ < pieces_; ++i, ++sent_)
      if (!send(piece(sent_))) return;
  }

  /// A copy that is as large as a node, for whoever takes up a snapshot.
  [[nodiscard]] const Node* load(std::span<const std::byte> state) {
    if (state.size() != state_.size()) return nullptr;
    sent_ = pieces_ = 0;
    std::memcpy(state_.data(), state.data(), state.size());
    return reinterpret_cast<const Node*>(state_.data());
  }

 private:
  static constexpr std::size_t kDuration_us = 8'000'000;  ///< time for all pieces: two seconds less than is promised

  [[nodiscard]] base::CanFrame piece(std::size_t number) const {
    std::array<std::byte, sizeof(SnapshotHeader)> head{};
    std::memcpy(head.data(), &header_, sizeof header_);
    std::uint64_t bytes = 0;
    for (std::size_t i = 0; i < kSnapshotPiece; ++i) {
      const std::size_t at = number * kSnapshotPiece + i;
      const std::byte byte = at < head.size()                   ? head[at]
                             : at < head.size() + state_.size() ? state_[at - head.size()]
                                                                : std::byte{};
      bytes |= std::uint64_t{std::to_integer<std::uint8_t>(byte)} << (8 * i);
    }
    return bus::frame(
        can_base_, bus::EstDiagSnapshot{.snap_piece = static_cast<std::uint16_t>(number & 0xFFF), .snap_bytes = bytes});
  }

  std::uint32_t can_base_;
  base::Micros period_;
  SnapshotHeader header_{};
  std::size_t sent_ = 0, pieces_ = 0;
  alignas(Node) std::array<std::byte, sizeof(Node)> state_;
};

}  // namespace tetap::firmware
