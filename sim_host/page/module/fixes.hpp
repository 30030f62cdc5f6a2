// SPDX-License-Identifier: Apache-2.0
// Positions of GNSS receivers in a log as a table, and the origin of the node's map, so that the page can draw them.
#pragma once

#include "sim_host/page/module/browser.hpp"
#include "sim_host/page/module/json.hpp"
#include "sim_host/replay/line.hpp"
#include "tetap/bus/codec.hpp"
#include "tetap/bus/decoder.hpp"
#include "tetap/bus/messages.hpp"
#include "tetap/sensor/sample.hpp"

#include <cstdint>
#include <optional>
#include <string>

namespace tetap::page {

class FixTable {
 public:
  explicit FixTable(std::uint32_t base) : base_(base) {
    decoder_.power_on();
    text_ = "stamp_s,inst,lat_deg,lon_deg,height_m,std_m\n";
  }

  /// Every frame that is sent to the node; the time of the bus is that of the last tick.
  void sent(const base::CanFrame& frame) {
    const std::uint32_t offset = frame.id - base_;
    if (frame.extended || offset < bus::InGnssLat::kOffset || offset > bus::InGnssVelU::kOffset) return;
    decoder_.expire(time_, kPatience, counters_);
    decoder_.on_frame(static_cast<std::uint8_t>(offset), frame, time_, counters_, *this);
  }
  void received(const base::CanFrame& frame) {
    if (frame.id != base_ + bus::EstOriginLat::kOffset || frame.extended) return;
    const auto payload = bus::payload(frame);
    if (const auto page = bus::decode<bus::EstOriginLat>(payload)) latitude_ = *page;
    if (const auto page = bus::decode<bus::EstOriginLon>(payload)) longitude_ = *page;
    if (const auto page = bus::decode<bus::EstOriginHeight>(payload)) height_ = *page;
  }
  void epoch(base::Micros time) { time_ = time; }

  void flush() {
    if (!text_.empty()) write(static_cast<std::uint32_t>(Channel::kFixes), text_);
    text_.clear();
  }

  struct Origin {
    double latitude_deg, longitude_deg, height_m;
  };
  /// As the node published it last; nothing where it has none.
  [[nodiscard]] std::optional<Origin> origin() const {
    if (!latitude_ || !longitude_ || !height_ || height_->source == sensor::OriginSource::kNone) return std::nullopt;
    return Origin{static_cast<double>(latitude_->lat_raw) * bus::EstOriginLat::kLatScale,
                  static_cast<double>(longitude_->lon_raw) * bus::EstOriginLon::kLonScale,
                  static_cast<double>(height_->height_m)};
  }

  // The decoder hands these over.
  void sample(const sensor::Sample& sample) {
    if (sample.sensor != sensor::Sensor::kGnssPosition) return;
    const sensor::GnssPosition& fix = sample.payload.gnss_position;
    line_.clear();
    line_.fixed(sample.stamp.us, 6).put(',').integer(sample.instance);
    // In steps of 2e-9 degrees.
    line_.put(',').fixed(2 * fix.latitude_2ndeg, 9).put(',').fixed(2 * fix.longitude_2ndeg, 9);
    line_.put(',').real(static_cast<double>(fix.height_m), 3);
    line_.put(',').real(static_cast<double>(fix.horizontal_acc_m), 3).put('\n');
    text_ += line_.view();
    if (text_.size() >= kBlock) flush();
  }
  void map_entry(const estimators::MapEntry&) {}
  void set_pose(const auto&) {}
  void reset(auto) {}

 private:
  static constexpr base::Micros kPatience{200'000};  ///< for the rest of a sample of several frames
  static constexpr std::size_t kBlock = 1 << 16;

  std::uint32_t base_;
  bus::Decoder decoder_;
  bus::Counters counters_;
  base::Micros time_;
  sim::Line line_;
  std::string text_;
  std::optional<bus::EstOriginLat> latitude_;
  std::optional<bus::EstOriginLon> longitude_;
  std::optional<bus::EstOriginHeight> height_;
};

/// The member "origin" [deg, deg, m], if the node has one.
inline void put_origin(Json& json, const std::optional<FixTable::Origin>& origin) {
  if (!origin) return;
  json.key("origin")
      .begin('[')
      .value(origin->latitude_deg)
      .value(origin->longitude_deg)
      .value(origin->height_m)
      .end(']');
}

}  // namespace tetap::page
