// SPDX-License-Identifier: Apache-2.0
// Origin of a node's map, as the node publishes it. A map that begins at the first fix is no place a world could know
// beforehand. Its truth is stated in the node's own frame.
#pragma once

#include "sim_host/replay/link.hpp"
#include "sim_host/world/earth.hpp"
#include "tetap/bus/codec.hpp"
#include "tetap/bus/messages.hpp"

#include <cstdint>
#include <optional>

namespace tetap::sim {

class NodeOrigin {
 public:
  explicit NodeOrigin(std::uint32_t base) : base_{base} {}

  void received(const base::CanFrame& frame) {
    if (frame.id != base_ + bus::offset_of<bus::EstOriginLat>()) return;
    const auto payload = bus::payload(frame);
    if (const auto page = bus::decode<bus::EstOriginLat>(payload)) latitude_ = *page;
    if (const auto page = bus::decode<bus::EstOriginLon>(payload)) longitude_ = *page;
    if (const auto page = bus::decode<bus::EstOriginHeight>(payload)) height_ = *page;
  }

  /// The origin that a fix has made, the last of them; empty where it is configured, or where there is none.
  [[nodiscard]] std::optional<GeodeticOrigin> from_fix() const {
    if (!latitude_ || !longitude_ || !height_) return std::nullopt;
    if (height_->source == sensor::OriginSource::kNone || height_->source == sensor::OriginSource::kConfigured)
      return std::nullopt;
    return GeodeticOrigin{static_cast<double>(latitude_->lat_raw) * bus::EstOriginLat::kLatScale,
                          static_cast<double>(longitude_->lon_raw) * bus::EstOriginLon::kLonScale,
                          static_cast<double>(height_->height_m)};
  }

 private:
  std::uint32_t base_;
  std::optional<bus::EstOriginLat> latitude_;
  std::optional<bus::EstOriginLon> longitude_;
  std::optional<bus::EstOriginHeight> height_;
};

/// A sink that passes everything on and notes the origin.
template <Sink K>
class OriginWatch {
 public:
  OriginWatch(K& sink, NodeOrigin& origin) : sink_{&sink}, origin_{&origin} {}

  void restarted() { sink_->restarted(); }
  void sent(const base::CanFrame& frame) { sink_->sent(frame); }
  void received(const base::CanFrame& frame) {
    origin_->received(frame);
    sink_->received(frame);
  }
  void epoch(const NodeEpoch& epoch, base::Micros time) { sink_->epoch(epoch, time); }

 private:
  K* sink_;
  NodeOrigin* origin_;
};

}  // namespace tetap::sim
