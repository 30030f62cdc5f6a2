// SPDX-License-Identifier: Apache-2.0
// A node's state as its log holds it: pieces of Est_Diag put together.
#pragma once

#include "sim_host/replay/protocol.hpp"
#include "tetap/firmware/snapshot.hpp"

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <utility>
#include <vector>

namespace tetap::sim {

struct Snapshot {
  firmware::SnapshotHeader header;
  std::vector<std::byte> state;
};

class SnapshotCollector {
 public:
  explicit SnapshotCollector(std::uint32_t base) : base_(base) {}

  /// A frame from the bus; the snapshot when this was its last piece and its CRC holds. A missing piece gives up all.
  std::optional<Snapshot> add(const base::CanFrame& frame) {
    if (!is_snapshot_piece(frame, base_)) return std::nullopt;
    const auto piece = bus::decode<bus::EstDiagSnapshot>(bus::payload(frame));
    if (piece->snap_piece != (pieces_ & 0xFFF)) {
      bytes_.clear();
      pieces_ = 0;
      if (piece->snap_piece != 0) return std::nullopt;
    }
    ++pieces_;
    for (std::size_t i = 0; i < firmware::kSnapshotPiece; ++i)
      bytes_.push_back(static_cast<std::byte>(piece->snap_bytes >> (8 * i) & 0xFF));
    return whole();
  }

 private:
  std::optional<Snapshot> whole() {
    Snapshot snapshot;
    constexpr std::size_t kHead = sizeof snapshot.header;
    if (bytes_.size() < kHead) return std::nullopt;
    std::memcpy(&snapshot.header, bytes_.data(), kHead);
    if (bytes_.size() < kHead + snapshot.header.length) return std::nullopt;
    const auto first = bytes_.begin() + static_cast<std::ptrdiff_t>(kHead);
    snapshot.state.assign(first, first + static_cast<std::ptrdiff_t>(snapshot.header.length));
    bytes_.clear();
    pieces_ = 0;
    if (firmware::snapshot_crc(snapshot.state) != snapshot.header.crc) return std::nullopt;
    return snapshot;
  }

  std::uint32_t base_;
  std::vector<std::byte> bytes_;
  std::size_t pieces_ = 0;
};

}  // namespace tetap::sim
