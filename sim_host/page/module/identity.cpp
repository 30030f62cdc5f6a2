// SPDX-License-Identifier: Apache-2.0
#include "sim_host/page/module/identity.hpp"

#include "sim_host/page/module/browser_log.hpp"
#include "sim_host/page/module/json.hpp"
#include "sim_host/replay/names.hpp"
#include "sim_host/replay/protocol.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <utility>

namespace tetap::page {

namespace {

constexpr std::uint64_t kEnough = 400'000;  ///< frames: minutes of any bus

struct Block {
  std::uint64_t frames = 0;
  std::array<std::uint64_t, bus::kBlock + bus::kMapBlock> offsets{};
  std::optional<std::uint32_t> config;
  std::optional<std::uint64_t> first_us, last_us;  ///< times of its Sync frames, which are the node's own

  /// A log may have been written faster than it was driven: the node's time counts, where there is one.
  [[nodiscard]] double duration_s(base::Micros of_log) const {
    const bool known = first_us && *last_us > *first_us;
    return static_cast<double>(known ? static_cast<std::int64_t>(*last_us - *first_us) : of_log.us) * 1e-6;
  }
  /// Ids of maps, scans and images follow the node's first ones.
  void take(Block& following) {
    frames += following.frames;
    std::copy_n(following.offsets.begin(), bus::kMapBlock, offsets.begin() + bus::kBlock);
    following = {};
  }
};

/// The frame that each sample of a sensor has one of.
struct FrameOf {
  sensor::Sensor sensor;
  std::uint32_t offset;
};
constexpr auto kFrames = std::to_array<FrameOf>({{sensor::Sensor::kImu, bus::ImuGyro::kOffset},
                                                 {sensor::Sensor::kWheelCounts, bus::InWheelCounts::kOffset},
                                                 {sensor::Sensor::kWheelSpeed, bus::InWheelSpeed::kOffset},
                                                 {sensor::Sensor::kBodySpeed, bus::InBodySpeed::kOffset},
                                                 {sensor::Sensor::kRangeBearing, bus::InRangeBearing::kOffset},
                                                 {sensor::Sensor::kGnssPosition, bus::InGnssLat::kOffset},
                                                 {sensor::Sensor::kGnssVelocity, bus::InGnssVelEN::kOffset},
                                                 {sensor::Sensor::kMagnetometer, bus::InMag::kOffset},
                                                 {sensor::Sensor::kBarometer, bus::InBaro::kOffset},
                                                 {sensor::Sensor::kHeading, bus::InHeading::kOffset},
                                                 {sensor::Sensor::kScan, bus::InScanHead::kOffset},
                                                 {sensor::Sensor::kFeature, bus::InImage::kOffset}});

void put_inputs(Json& json, const Block& block, double duration_s) {
  json.key("inputs").begin('[');
  for (const FrameOf& one : kFrames) {
    const std::uint64_t samples = block.offsets[one.offset];
    if (samples == 0) continue;
    json.begin('{').member("sensor", sim::name(one.sensor)).member("samples", samples);
    if (duration_s > 0) json.member("rate_hz", static_cast<double>(samples) / duration_s);
    json.end('}');
  }
  json.end(']');
}

}  // namespace

sim::Result<std::string> identity_of_log() {
  BrowserLog log("log", {.interface = {}, .keep_going = true, .base = 0x300});
  std::array<Block, 0x800 / bus::kBlock> blocks{};
  std::uint64_t seen = 0;
  base::Micros first{}, last{};
  for (sim::TimedFrame entry; seen < kEnough && log.next(entry); ++seen) {
    const base::CanFrame& frame = entry.frame;
    if (frame.extended || frame.id >= 0x800 || frame.size != 8) continue;
    Block& block = blocks[frame.id / bus::kBlock];
    if (seen == 0) first = entry.time;
    last = entry.time;
    ++block.frames;
    ++block.offsets[frame.id % bus::kBlock];
    if (frame.id % bus::kBlock == bus::InSync::kOffset) {
      if (const auto sync = bus::decode<bus::InSync>(bus::payload(frame))) {
        if (!block.first_us) block.first_us = sync->time_us;
        block.last_us = sync->time_us;
      }
    }
    if (frame.id % bus::kBlock == bus::EstVersion::kOffset)
      if (const auto version = bus::decode<bus::EstVersion>(bus::payload(frame))) block.config = version->config;
  }
  if (log.failure()) return *log.failure();
  if (seen == 0) return sim::Failure{"no CAN data frame in the log"};
  for (std::size_t i = 0; i + 1 < blocks.size(); i += 2)
    if (blocks[i].frames > 0 && !blocks[i + 1].config) blocks[i].take(blocks[i + 1]);
  // A node that speaks is the log's, however much else the bus carries.
  const auto most = std::max_element(blocks.begin(), blocks.end(), [](const Block& a, const Block& b) {
    return std::pair(a.config.has_value(), a.frames) < std::pair(b.config.has_value(), b.frames);
  });
  Json json;
  json.begin('{').member("base", static_cast<std::uint32_t>(most - blocks.begin()) * bus::kBlock);
  if (most->config) json.member("config", *most->config);
  const double duration_s = most->duration_s(last - first);
  json.member("duration_s", duration_s).member("frames", most->frames);
  put_inputs(json, *most, duration_s);
  return json.end('}').text();
}

}  // namespace tetap::page
