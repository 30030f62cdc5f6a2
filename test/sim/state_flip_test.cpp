// SPDX-License-Identifier: Apache-2.0
// Every byte of a node is flipped in turn, in the middle of a run with every sensor. The state CRC differs within ten
// epochs. A flip that it does not show leaves no trace in a frame or in the state: the byte was written before it was
// read, or is padding. Bytes beside are those that members() lists as unhashed.
#include "config/rover.hpp"
#include "sim_host/world_source.hpp"
#include "tetap/base/state_words.hpp"
#include "tetap/estimators/attitude.hpp"
#include "tetap/estimators/inertial/inertial.hpp"
#include "tetap/node/node.hpp"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <memory>
#include <vector>

namespace tetap::sim {
namespace {

using Robot =
    node::WithBusProtection<node::Estimators<estimators::Odometry, estimators::Attitude, estimators::Inertial>>;
using Node = node::Node<Robot>;
constexpr base::Micros kPeriod{10'000};
constexpr std::size_t kEpochs = base::kTurns;
/// A sample of the window shows when it is fused, at the latest so many epochs later.
constexpr std::size_t kWindowEpochs = kEpochs + 20;

param::Parameters parameters() {
  param::Parameters n = robot::rover::parameters;
  n.bus.commands = param::CommandAccess::kAuthenticated;
  return n;
}
const param::Parameters kParameters = parameters();

struct Epoch {
  std::vector<base::CanFrame> inputs;
  base::Micros time;
};
using Frames = std::vector<base::CanFrame>;

std::vector<Epoch> drive(int seconds) {
  WorldSource source(World({.inertial = true}, 7), kParameters.can_base, kPeriod, base::Micros{1'000'000LL * seconds});
  std::vector<Epoch> epochs;
  Tick tick;
  while (source.next(tick)) epochs.push_back({{tick.inputs.begin(), tick.inputs.end()}, tick.time});
  return epochs;
}
Frames run(Node& node, const Epoch& epoch) {
  Frames sent;
  for (const base::CanFrame& frame : epoch.inputs) node.on_frame(frame);
  node.tick(epoch.time, {}, [&](const base::CanFrame& frame) { sent.push_back(frame); });
  return sent;
}
/// The state CRC goes out last.
std::uint32_t crc_of(const Frames& sent) { return bus::decode<bus::EstStateCrc>(bus::payload(sent.back()))->crc; }

enum class Byte : std::uint8_t { kIdle, kHashed, kIndex, kUnhashed };

/// Kind of each byte, by members().
struct Map {
  const Node& node;
  std::vector<Byte> bytes = std::vector<Byte>(sizeof(Node), Byte::kIdle);

  void operator()(std::uint32_t) const {}
  void mark(const void* at, std::size_t size) { put(at, size, Byte::kHashed); }
  void mark_index(const void* at, std::size_t size) { put(at, size, Byte::kIndex); }
  void mark_unhashed(const void* at, std::size_t size) { put(at, size, Byte::kUnhashed); }
  void put(const void* at, std::size_t size, Byte is) {
    const auto from = static_cast<const std::byte*>(at) - reinterpret_cast<const std::byte*>(&node);
    ASSERT_GE(from, 0);
    ASSERT_LE(static_cast<std::size_t>(from) + size, sizeof(Node));
    for (std::size_t i = 0; i < size; ++i) bytes[static_cast<std::size_t>(from) + i] = is;
  }
};

class Flips : public ::testing::TestWithParam<int> {};

TEST_P(Flips, OfAnyByteShowInTheStateCrcWithinTenEpochs) {
  const std::vector<Epoch> epochs = drive(GetParam() + 1);
  const auto begin = static_cast<std::size_t>(GetParam()) * 100;
  const auto straight = std::make_unique<Node>(kParameters, bus::Version{});
  for (std::size_t k = 0; k < begin; ++k) run(*straight, epochs[k]);

  const auto node = std::make_unique<Node>(kParameters, bus::Version{});
  auto* const bytes = reinterpret_cast<unsigned char*>(node.get());
  std::vector<Frames> sent;
  node->resume(*straight);
  for (std::size_t k = 0; k < kWindowEpochs; ++k) sent.push_back(run(*node, epochs[begin + k]));
  const auto words = [](const Node& of) {
    std::vector<std::uint32_t> all;
    const auto sink = [&all](std::uint32_t word) { all.push_back(word); };
    base::each_word(of, sink);
    return all;
  };
  const std::vector<std::uint32_t> before = words(*straight);

  Map map{*straight};
  base::each_word(*straight, map);
  const param::Parameters* const given = &kParameters;  // a reference is a pointer to them
  for (std::size_t i = 0; i + sizeof given <= sizeof(Node); i += alignof(const void*))
    if (std::memcmp(bytes + i, &given, sizeof given) == 0)
      map.put(reinterpret_cast<const std::byte*>(straight.get()) + i, sizeof given, Byte::kUnhashed);
  const std::vector<std::uint32_t> after = words(*node);
  std::size_t found = 0, unhashed = 0, without_effect = 0, latest = 0, after_a_frame = 0, gone = 0, late = 0;
  std::vector<std::size_t> unseen;
  for (std::size_t i = 0; i < sizeof(Node); ++i) {
    if (map.bytes[i] == Byte::kUnhashed) {
      ++unhashed;
      continue;
    }
    node->resume(*straight);
    bytes[i] ^= 1;
    bool seen = false, felt = false;
    if (map.bytes[i] == Byte::kIndex) {  // an index out of its range cannot be run with
      seen = words(*node) != before;
      bytes[i] ^= 1;
    } else {
      for (std::size_t k = 0; k < kWindowEpochs && !seen; ++k) {
        const Frames now = run(*node, epochs[begin + k]);
        seen = crc_of(now) != crc_of(sent[k]);
        felt = felt || (!seen && now != sent[k]);
        if (seen && k > latest) latest = k;
        if (seen && k >= kEpochs) ++late;
      }
      if (seen && felt) ++after_a_frame;
      // Written before it is read, out of use, or padding; or read once, for a frame, and written anew before the hash.
      if (!seen && words(*node) == after) {
        ++(felt ? gone : without_effect);
        continue;
      }
    }
    if (seen) {
      ++found;
    } else {
      unseen.push_back(i);
    }
  }
  EXPECT_TRUE(unseen.empty()) << unseen.size() << " bytes, the first at " << unseen.front();
  // One byte in a thousand: that of a sample which slow state alone has, as it is fused or before it leaves the window.
  EXPECT_LE(late, sizeof(Node) / 1'000) << "bytes that show as their sample is fused";
  EXPECT_LE(gone, sizeof(Node) / 1'000) << "bytes that show in a frame alone";
  EXPECT_GT(found, sizeof(Node) / 3);
  std::printf("of %zu bytes %zu are seen, the latest after %zu epochs, %zu of them after another frame; ", sizeof(Node),
              found, latest + 1, after_a_frame);
  std::printf("%zu without effect, %zu not hashed\n", without_effect, unhashed);
}

// While it levels, drives, and stands.
INSTANTIATE_TEST_SUITE_P(Seconds, Flips, ::testing::Values(2, 20, 33));

}  // namespace
}  // namespace tetap::sim
