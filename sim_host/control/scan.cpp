// SPDX-License-Identifier: Apache-2.0
#include "sim_host/control/scan.hpp"

#include "tetap/bus/codec.hpp"
#include "tetap/bus/e2e.hpp"
#include "tetap/param/table.hpp"

#include <array>

namespace tetap::sim {
namespace {

constexpr base::Micros kListening{4'500'000};  ///< a version comes at least as often, at the slowest tick
constexpr base::Micros kPatience{300'000};
constexpr int kAttempts = 3;
constexpr std::size_t kBlocks = 0x800 / bus::kBlock;

struct Heard {
  std::optional<std::uint64_t> time_us;
  int later = 0;  ///< epochs that came after their time's predecessor
  std::optional<bus::EstVersion> version;
};

}  // namespace

std::vector<FoundNode> scan(const ParameterClient::Send& send, const ParameterClient::Receive& receive,
                            const ParameterClient::Clock& now) {
  std::array<Heard, kBlocks> blocks;
  const auto each = [&](base::Micros duration, auto&& take) {
    const base::Micros until = now() + duration;
    for (base::Micros left = duration; left.us > 0; left = until - now()) {
      const auto frame = receive(left);
      if (frame && !frame->extended && frame->id < 0x800 && take(*frame)) return;
    }
  };
  each(kListening, [&](const base::CanFrame& frame) {
    Heard& heard = blocks[frame.id / bus::kBlock];
    const std::uint32_t offset = frame.id % bus::kBlock;
    if (offset == bus::EstEpoch::kOffset) {
      if (const auto epoch = bus::decode<bus::EstEpoch>(bus::payload(frame))) {
        heard.later += heard.time_us && epoch->time_us > *heard.time_us ? 1 : 0;
        heard.time_us = epoch->time_us;
      }
    } else if (offset == bus::EstVersion::kOffset) {
      if (const auto version = bus::decode<bus::EstVersion>(bus::payload(frame))) heard.version = version;
    }
    return false;
  });
  std::vector<FoundNode> found;
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    if (blocks[i].later < 2) continue;
    FoundNode node{.can_base = static_cast<std::uint32_t>(i) * bus::kBlock, .version = blocks[i].version};
    for (int attempt = 0; attempt < kAttempts && !node.parameters && node.can_base % 128 == 0; ++attempt) {
      const bus::CmdParamGet get{.ctr = static_cast<std::uint8_t>(attempt), .get_row_id = param::kTable[0].index};
      send(bus::frame(node.can_base, bus::protect(get)));
      each(kPatience, [&](const base::CanFrame& frame) {
        if (frame.id != node.can_base + bus::EstParamRow::kOffset) return false;
        const auto told = bus::decode<bus::EstParamRow>(bus::payload(frame));
        return node.parameters = told && told->row_id == get.get_row_id && told->row_value == node.can_base;
      });
    }
    found.push_back(node);
  }
  return found;
}

}  // namespace tetap::sim
