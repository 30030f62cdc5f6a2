// SPDX-License-Identifier: Apache-2.0
#include "sim_host/page/module/identity.hpp"

#include "sim_host/page/module/browser_log.hpp"
#include "sim_host/page/module/json.hpp"
#include "sim_host/replay/protocol.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>

namespace tetap::page {

namespace {

constexpr std::uint64_t kEnough = 400'000;  ///< frames: minutes of any bus

struct Block {
  std::uint64_t frames = 0;
  std::array<bool, bus::kBlock> offsets{};
  std::optional<std::uint32_t> config;
};

template <class... Message>
bool any(const Block& block) {
  return (block.offsets[Message::kOffset] || ...);
}

void put_inputs(Json& json, const Block& block) {
  json.key("inputs").begin('[');
  if (any<bus::ImuGyro>(block)) json.value("Imu");
  if (any<bus::InWheelCounts>(block)) json.value("WheelCounts");
  if (any<bus::InGnssLat>(block)) json.value("GnssPosition");
  json.end(']');
}

}  // namespace

sim::Result<std::string> identity_of_log() {
  BrowserLog log("log", {.interface = {}, .keep_going = true, .base = 0x300});
  std::array<Block, 0x800 / bus::kBlock> blocks{};
  std::uint64_t seen = 0;
  for (sim::TimedFrame entry; seen < kEnough && log.next(entry); ++seen) {
    const base::CanFrame& frame = entry.frame;
    if (frame.extended || frame.id >= 0x800 || frame.size != 8) continue;
    Block& block = blocks[frame.id / bus::kBlock];
    ++block.frames;
    block.offsets[frame.id % bus::kBlock] = true;
    if (frame.id % bus::kBlock == bus::EstVersion::kOffset)
      if (const auto version = bus::decode<bus::EstVersion>(bus::payload(frame))) block.config = version->config;
  }
  if (log.failure()) return *log.failure();
  if (seen == 0) return sim::Failure{"no CAN data frame in the log"};
  const auto most = std::max_element(blocks.begin(), blocks.end(),
                                     [](const Block& a, const Block& b) { return a.frames < b.frames; });
  Json json;
  json.begin('{').member("base", static_cast<std::uint32_t>(most - blocks.begin()) * bus::kBlock);
  if (most->config) json.member("config", *most->config);
  put_inputs(json, *most);
  return json.end('}').text();
}

}  // namespace tetap::page
