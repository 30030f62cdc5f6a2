// SPDX-License-Identifier: Apache-2.0
// CANopen around a node, as bytes on the bus: CiA 301's transfers, rows of the table as objects, and what strangers do.
#include "tetap/firmware/accepted_frames.hpp"
#include "tetap/firmware/firmware.hpp"

#include "bench.hpp"
#include "queued_can.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <memory>
#include <random>
#include <string>

namespace tetap::test {
namespace {

using Bytes = std::array<std::uint8_t, 8>;
constexpr std::uint8_t kId = 0x0A;
using Robot =
    node::WithBusProtection<node::WithBusParameters<node::Estimators<estimators::Odometry, estimators::PoseEkf>>>;

struct Board {
  QueuedCan can;
  base::Micros time{1'000'000};
  std::uint8_t id = kId;
  [[nodiscard]] base::Micros now() const { return time; }
  static constexpr const char* kHardware = "bench";
  [[nodiscard]] std::uint8_t canopen_id() const { return id; }
};

struct Bench {
  explicit Bench(const param::Parameters& p = kNumbers, std::uint8_t id = kId) : parameters(p) {
    board.id = id;
    firmware = std::make_unique<firmware::Firmware<Board, Robot>>(board, parameters, bus::Version{0x1234567, true});
  }
  void poll_for(std::int64_t us) {
    for (const base::Micros until = board.time + base::Micros{us}; board.time < until; board.time += base::Micros{250})
      firmware->poll();
  }
  void send(const Bytes& request) { board.can.to_node.push_back({.id = 0x600U + kId, .size = 8, .data = request}); }
  /// The answers to what waits.
  std::vector<Bytes> answers(std::int64_t us = 30'000) {
    const std::size_t before = board.can.sent.size();
    poll_for(us);
    std::vector<Bytes> all;
    for (std::size_t i = before; i < board.can.sent.size(); ++i)
      if (board.can.sent[i].id == 0x580U + kId) all.push_back(board.can.sent[i].data);
    return all;
  }
  Bytes ask(const Bytes& request) {
    send(request);
    const auto all = answers();
    EXPECT_EQ(all.size(), 1U);
    return all.empty() ? Bytes{} : all[0];
  }
  static Bytes frame(std::uint8_t command, unsigned index, unsigned sub, std::uint32_t value = 0) {
    Bytes b{command, static_cast<std::uint8_t>(index), static_cast<std::uint8_t>(index >> 8),
            static_cast<std::uint8_t>(sub)};
    std::memcpy(&b[4], &value, 4);
    return b;
  }
  static std::uint32_t word(const Bytes& b) {
    std::uint32_t value = 0;
    std::memcpy(&value, &b[4], 4);
    return value;
  }
  /// A value of four bytes.
  std::uint32_t read(unsigned index, unsigned sub) {
    const Bytes b = ask(frame(0x40, index, sub));
    EXPECT_EQ(b[0], 0x43) << std::hex << index << ':' << sub << ' ' << word(b);
    return word(b);
  }
  /// Code of the abort; 0: it was done.
  std::uint32_t write(unsigned index, unsigned sub, std::uint32_t value) {
    const Bytes b = ask(frame(0x23, index, sub, value));
    EXPECT_EQ(Bytes(frame(b[0], index, sub, word(b))), b) << "another object";
    EXPECT_TRUE(b[0] == 0x60 || b[0] == 0x80);
    return b[0] == 0x60 ? 0 : word(b);
  }
  std::uint32_t apply() { return write(0x5F00, 1, read(0x5F00, 1)); }

  Board board;
  param::Parameters parameters;
  std::unique_ptr<firmware::Firmware<Board, Robot>> firmware;
};

unsigned object_of(const std::string& path) {
  for (const param::Row& row : param::kTable)
    if (path == row.path) return 0x2000U + row.index;
  ADD_FAILURE() << path;
  return 0;
}
std::uint32_t bits(float value) { return std::bit_cast<std::uint32_t>(value); }

TEST(Canopen, TellsWhoItIs) {
  Bench bench;
  EXPECT_EQ(bench.ask({0x40, 0x00, 0x10, 0}), (Bytes{0x43, 0x00, 0x10, 0, 0, 0, 0, 0}));
  EXPECT_EQ(bench.ask({0x40, 0x01, 0x10, 0}), (Bytes{0x4F, 0x01, 0x10, 0, 0, 0, 0, 0}));
  EXPECT_EQ(bench.ask({0x40, 0x18, 0x10, 0}), (Bytes{0x4F, 0x18, 0x10, 0, 4, 0, 0, 0}));
  EXPECT_EQ(bench.read(0x1018, 1), 0U) << "no vendor id";
  EXPECT_EQ(bench.read(0x1018, 3), 0x1234567U);
  EXPECT_EQ(bench.read(0x1014, 0), 0x8AU);
  EXPECT_EQ(bench.ask({0x40, 0x17, 0x10, 0}), (Bytes{0x4B, 0x17, 0x10, 0, 0xE8, 3, 0, 0}));
  // 13 characters take two segments.
  EXPECT_EQ(bench.ask({0x40, 0x0A, 0x10, 0}), (Bytes{0x41, 0x0A, 0x10, 0, 13, 0, 0, 0}));
  EXPECT_EQ(bench.ask({0x60}), (Bytes{0x00, '1', '2', '3', '4', '5', '6', '7'}));
  EXPECT_EQ(bench.ask({0x70}), (Bytes{0x13, '-', 'd', 'i', 'r', 't', 'y', 0}));
  EXPECT_EQ(bench.ask({0x40, 0x08, 0x10, 0}), (Bytes{0x41, 0x08, 0x10, 0, 5, 0, 0, 0}));
  EXPECT_EQ(bench.ask({0x60}), (Bytes{0x05, 't', 'e', 't', 'a', 'p', 0, 0}));
}

TEST(Canopen, RefusesWithTheCodeThatSaysWhy) {
  Bench bench;
  const auto refusal = [&](const Bytes& request) {
    const Bytes b = bench.ask(request);
    EXPECT_EQ(b[0], 0x80);
    return Bench::word(b);
  };
  const unsigned gate = object_of("landmark.gate_scale"), up = object_of("gyro.up_s"), key = object_of("bus.key");
  EXPECT_EQ(refusal(Bench::frame(0x40, 0x2FFF, 0)), 0x06020000U);
  EXPECT_EQ(refusal(Bench::frame(0x40, 0x6000, 0)), 0x06020000U);
  EXPECT_EQ(refusal(Bench::frame(0x40, gate, 1)), 0x06090011U);
  EXPECT_EQ(refusal(Bench::frame(0x40, up, 4)), 0x06090011U);
  EXPECT_EQ(refusal(Bench::frame(0x23, 0x1000, 0)), 0x06010002U);
  EXPECT_EQ(refusal(Bench::frame(0x23, gate + 0x1000, 0)), 0x06010002U) << "what is active";
  EXPECT_EQ(refusal(Bench::frame(0x23, up, 0)), 0x06010002U) << "number of elements";
  EXPECT_EQ(refusal(Bench::frame(0x2B, gate, 0)), 0x06070013U) << "two bytes";
  EXPECT_EQ(refusal(Bench::frame(0x23, gate, 0, bits(1e6F))), 0x06090031U);
  EXPECT_EQ(refusal(Bench::frame(0x23, gate, 0, bits(1e-3F))), 0x06090032U);
  EXPECT_EQ(refusal(Bench::frame(0x23, gate, 0, 0x7FC00000)), 0x06090030U) << "no number";
  EXPECT_EQ(refusal(Bench::frame(0xC0, gate, 0)), 0x05040001U) << "block download";
  EXPECT_EQ(refusal(Bench::frame(0xA0, gate, 0)), 0x05040001U) << "block upload";
  EXPECT_EQ(refusal({0x60}), 0x05040001U) << "a segment of nothing";
  EXPECT_EQ(refusal({0x00}), 0x05040001U);
  EXPECT_EQ(refusal(Bench::frame(0x23, 0x1010, 1, 0x12345678)), 0x08000020U) << "a wrong signature";
  EXPECT_EQ(refusal(Bench::frame(0x23, 0x1010, 1, 0x65766173)), 0x08000022U) << "no board keeps parameters";
  EXPECT_EQ(refusal(Bench::frame(0x23, 0x1011, 1, 0x65766173)), 0x08000020U);
  for (unsigned element = 0; element <= 4; ++element) {
    EXPECT_EQ(refusal(Bench::frame(0x40, key, element)), 0x06010000U);
    EXPECT_EQ(refusal(Bench::frame(0x40, key + 0x2000, element)), 0x06010000U);
    EXPECT_EQ(refusal(Bench::frame(0x23, key, element, 1)), 0x06010000U);
  }
}

TEST(Canopen, HasEveryRowAndStagesIt) {
  Bench bench;
  param::Parameters wanted = kNumbers;
  std::size_t written = 0;
  for (const param::Row& row : param::kTable) {
    const param::StoredRow& stored = param::kStoredRows[static_cast<std::size_t>(&row - param::kTable.data())];
    if (stored.secret || stored.kind == param::StoredRow::Kind::kLong) continue;
    if (row.elements > 1) {
      EXPECT_EQ(bench.ask(Bench::frame(0x40, 0x2000U + row.index, 0))[4], row.elements) << row.path;
    }
    for (std::size_t element = 0; element < row.elements; ++element) {
      const unsigned sub = row.elements == 1 ? 0 : static_cast<unsigned>(element) + 1;
      for (const unsigned set : {0x2000U, 0x3000U, 0x4000U}) {
        std::uint32_t value = bench.read(set + row.index, sub);
        param::Parameters told = kNumbers;
        std::memcpy(reinterpret_cast<char*>(&told) + row.offset + 4 * element, &value, 4);
        EXPECT_EQ(row.get(told, element), row.get(kNumbers, element)) << row.path;
      }
      row.set(wanted, element, row.get(kNumbers, element) < row.maximum ? row.maximum : row.minimum);
      std::uint32_t other = 0;
      std::memcpy(&other, reinterpret_cast<const char*>(&wanted) + row.offset + 4 * element, 4);
      EXPECT_EQ(bench.write(0x2000U + row.index, sub, other), stored.access ? 0x06010002U : 0U) << row.path;
      if (stored.access) continue;
      EXPECT_EQ(bench.read(0x2000U + row.index, sub), other) << row.path;
      ++written;
    }
  }
  EXPECT_GT(written, 200U);
  EXPECT_EQ(bench.read(0x5F00, 2), param::crc(kNumbers)) << "it is staged only";
}

TEST(Canopen, AppliesWhatItsClientHasRead) {
  Bench bench;
  const unsigned gate = object_of("landmark.gate_scale"), radius = object_of("wheels.drive.left_radius_m");
  EXPECT_EQ(bench.write(gate, 0, bits(2.5F)), 0U);
  EXPECT_EQ(bench.write(radius, 0, bits(0.11F)), 0U);
  const std::uint32_t meant = bench.read(0x5F00, 1);
  EXPECT_EQ(bench.write(object_of("landmark.sigma_range_m"), 0, bits(5.0F)), 0U);  // somebody else's
  EXPECT_EQ(bench.write(0x5F00, 1, meant), 0x08000022U);
  EXPECT_EQ(bench.read(gate + 0x1000, 0), bits(kNumbers.landmark.gate_scale)) << "nothing is applied in part";
  EXPECT_EQ(bench.apply(), 0U);
  EXPECT_EQ(bench.read(gate + 0x1000, 0), bits(2.5F));
  EXPECT_EQ(bench.read(radius + 0x1000, 0), bits(kNumbers.wheels.drive.left_radius_m)) << "it waits for a restart";
  EXPECT_EQ(bench.read(0x5F00, 3), 1U);
  EXPECT_EQ(bench.write(object_of("publish.state_every"), 0, 7), 0U);
  EXPECT_EQ(bench.apply(), 0x06040043U) << "a rule between rows";
  EXPECT_EQ(bench.write(0x1011, 1, 0x64616F6C), 0U);
  EXPECT_EQ(bench.read(0x5F00, 2), param::crc(kNumbers));
  EXPECT_EQ(bench.read(0x5F00, 4), 0U);
}

TEST(Canopen, TakesEightBytesInSegments) {
  Bench bench;
  const unsigned latitude = object_of("gnss.origin_latitude_deg");
  const auto size = [&](std::uint32_t bytes) { return Bench::frame(0x21, latitude, 0, bytes); };
  const auto staged = [&] { return bench.read(0x5F00, 1); };
  const std::uint32_t before = staged();
  const Bytes done = Bench::frame(0x60, latitude, 0);
  // 50 degrees are 25e9 steps: 0x5D21DBA00. A wrong toggle ends the transfer.
  EXPECT_EQ(bench.ask(size(8)), done);
  EXPECT_EQ(bench.ask({0x10, 0x00, 0xBA, 0x1D, 0xD2, 0x05, 0, 0}), Bench::frame(0x80, latitude, 0, 0x05030000));
  EXPECT_EQ(bench.ask({0x1D, 0}), Bench::frame(0x80, latitude, 0, 0x05040001));
  // Fewer bytes than announced, and more than there can be.
  EXPECT_EQ(bench.ask(size(8)), done);
  EXPECT_EQ(bench.ask({0x01, 0x00, 0xBA, 0x1D, 0xD2, 0x05, 0, 0}), Bench::frame(0x80, latitude, 0, 0x06070013));
  EXPECT_EQ(bench.ask(size(100)), Bench::frame(0x80, latitude, 0, 0x06070012));
  EXPECT_EQ(bench.ask(Bench::frame(0x23, latitude, 0, 1)), Bench::frame(0x80, latitude, 0, 0x06070013));
  // Its client goes away, and its client aborts.
  EXPECT_EQ(bench.ask(size(8)), done);
  EXPECT_EQ(bench.answers(1'100'000), std::vector{Bench::frame(0x80, latitude, 0, 0x05040000)});
  EXPECT_EQ(bench.ask(size(8)), done);
  bench.send(Bench::frame(0x80, latitude, 0, 0x08000000));
  EXPECT_TRUE(bench.answers().empty());
  EXPECT_EQ(bench.ask({0x00})[0], 0x80);
  EXPECT_EQ(staged(), before) << "nothing is staged in part";
  EXPECT_EQ(bench.ask(size(8)), done);
  EXPECT_EQ(bench.ask({0x00, 0x00, 0xBA, 0x1D, 0xD2, 0x05, 0, 0}), (Bytes{0x20}));
  EXPECT_EQ(bench.ask({0x1D, 0}), (Bytes{0x30}));
  EXPECT_EQ(bench.ask(Bench::frame(0x40, latitude, 0)), Bench::frame(0x41, latitude, 0, 8));
  EXPECT_EQ(bench.ask({0x60}), (Bytes{0x00, 0x00, 0xBA, 0x1D, 0xD2, 0x05, 0, 0}));
  EXPECT_EQ(bench.ask({0x70}), (Bytes{0x1D, 0}));
}

TEST(Canopen, TwoClientsHinderEachOtherAndHalveNothing) {
  Bench bench;
  const unsigned latitude = object_of("gnss.origin_latitude_deg"), gate = object_of("landmark.gate_scale");
  const std::uint32_t before = bench.read(0x5F00, 1);
  EXPECT_EQ(bench.ask(Bench::frame(0x21, latitude, 0, 8))[0], 0x60);
  bench.send(Bench::frame(0x40, gate, 0));
  EXPECT_EQ(bench.answers(), (std::vector{Bench::frame(0x80, latitude, 0, 0x08000022),
                                          Bench::frame(0x43, gate, 0, bits(kNumbers.landmark.gate_scale))}));
  EXPECT_EQ(bench.ask({0x00, 1, 2, 3, 4, 5, 6, 7})[0], 0x80);
  EXPECT_EQ(bench.read(0x5F00, 1), before);
  // Requests of several clients at once are answered in their order.
  bench.send(Bench::frame(0x23, gate, 0, bits(2.0F)));
  bench.send(Bench::frame(0x23, gate, 0, bits(3.0F)));
  bench.send(Bench::frame(0x40, gate, 0));
  EXPECT_EQ(bench.answers(60'000), (std::vector{Bench::frame(0x60, gate, 0), Bench::frame(0x60, gate, 0),
                                                Bench::frame(0x43, gate, 0, bits(3.0F))}));
}

TEST(Canopen, NeedsATagWhereCommandsNeedOne) {
  param::Parameters locked = kNumbers;
  locked.loop.lockstep = param::Lockstep::kAuthenticated;
  locked.bus.commands = param::CommandAccess::kAuthenticated;
  locked.bus.key = {1, 2, 3, 4};
  Bench bench(locked);
  const unsigned gate = object_of("landmark.gate_scale");
  EXPECT_EQ(bench.write(gate, 0, bits(2.0F)), 0U) << "it stages only";
  EXPECT_EQ(bench.apply(), 0x08000021U);
  EXPECT_EQ(bench.write(0x1011, 1, 0x64616F6C), 0x08000021U);
  EXPECT_EQ(bench.write(0x1010, 1, 0x65766173), 0x08000021U);
  EXPECT_EQ(bench.read(gate + 0x1000, 0), bits(locked.landmark.gate_scale));
  param::Parameters closed = kNumbers;
  closed.bus.commands = param::CommandAccess::kNone;
  Bench none(closed);
  EXPECT_EQ(none.write(gate, 0, bits(2.0F)), 0x08000021U);
}

/// The estimates alone: no version, no frame on inputs, parameters or the loop, nothing of CANopen.
Frames estimates(const Frames& sent) {
  Frames kept;
  for (const base::CanFrame& frame : sent) {
    const std::uint32_t offset = frame.id - 0x300;
    if (offset < 0x80 && offset != bus::EstParamRow::kOffset && offset != bus::CmdParamSet::kOffset &&
        offset != bus::EstVersion::kOffset && offset != bus::EstEpoch::kOffset && offset != bus::EstDiagLoop::kOffset)
      kept.push_back(frame);
    // Beside the CRC of the state it has the number of inputs.
    if (offset == bus::EstStateCrc::kOffset)
      kept.back() = in(bus::EstStateCrc{.crc = bus::decode<bus::EstStateCrc>(bus::payload(frame))->crc});
  }
  return kept;
}

/// Three seconds in steps of 250 us, with frames to the node at some of them: what the node estimated. `commands` gets
/// the frames of Cmd_Param that went out.
using Timed = std::vector<std::pair<int, base::CanFrame>>;
Frames drive(Bench& bench, const Timed& frames, Timed* commands = nullptr) {
  bench.board.can.to_node.push_back(body_speed(1'005'000, 0.5F, 0.1F));
  std::size_t seen = 0;
  for (int step = 0; step < 12'000; ++step) {
    for (const auto& [at, frame] : frames)
      if (at == step) bench.board.can.to_node.push_back(frame);
    bench.poll_for(250);
    for (; seen < bench.board.can.sent.size(); ++seen)
      if (commands != nullptr && bench.board.can.sent[seen].id == 0x300U + bus::CmdParamSet::kOffset)
        commands->emplace_back(step, bench.board.can.sent[seen]);
  }
  return estimates(bench.board.can.sent);
}

TEST(Canopen, TheLogOfTheBusNeedsNoSdoForItsReplay) {
  param::Parameters wanted = kNumbers;
  wanted.wheels.timeout_noise = 50;
  const auto request = [](const Bytes& b) { return base::CanFrame{.id = 0x600U + kId, .size = 8, .data = b}; };
  Bench bench, without(kNumbers, 0), replay(kNumbers, 0);
  Timed commands;
  const Frames told = drive(bench,
                            {{100, request(Bench::frame(0x23, object_of("wheels.timeout_noise"), 0, bits(50)))},
                             {400, request(Bench::frame(0x23, 0x5F00, 1, param::crc(wanted)))}},
                            &commands);
  EXPECT_EQ(commands.size(), 2U);
  EXPECT_EQ(drive(replay, commands), told);
  EXPECT_NE(drive(without, {}), told);
}

TEST(Canopen, AMillionForgedFramesChangeNothing) {
  Bench bench, untouched;
  std::mt19937 random{1};
  const std::array<std::uint8_t, 12> commands{0x40, 0x23, 0x2F, 0x21, 0x00, 0x10, 0x01, 0x11, 0x60, 0x70, 0x80, 0xC0};
  constexpr std::size_t kFrames = 1'000'000;
  std::size_t answered = 0;
  for (std::size_t sent = 0; sent < kFrames;) {
    bench.board.can.sent.clear();
    untouched.board.can.sent.clear();
    for (int i = 0; i < 4; ++i, ++sent) {
      Bytes b{};
      for (auto& byte : b) byte = static_cast<std::uint8_t>(random());
      // Three of four are nearly right: a command and an object that there are.
      if (random() % 4 != 0) {
        b[0] = commands[random() % commands.size()];
        const std::array<unsigned, 5> fixed{0x1010, 0x1011, 0x5F00, 0x1018, 0x1008};
        const unsigned index = random() % 8 == 0 ? fixed[random() % fixed.size()]
                                                 : 0x2000U + param::kTable[random() % param::kTable.size()].index;
        b[1] = static_cast<std::uint8_t>(index), b[2] = static_cast<std::uint8_t>(index >> 8), b[3] = random() % 4 == 0;
        if (index == 0x1010) std::memcpy(&b[4], "save", 4);
      }
      const std::uint8_t size = random() % 16 == 0 ? static_cast<std::uint8_t>(random() % 8) : std::uint8_t{8};
      bench.board.can.to_node.push_back({.id = 0x600U + kId, .size = size, .data = b});
    }
    for (Bench* one : {&bench, &untouched})
      for (int i = 0; i < 4; ++i, one->board.time += base::Micros{2'500}) one->firmware->poll();
    for (const auto& frame : bench.board.can.sent) answered += frame.id == 0x580U + kId;
    ASSERT_EQ(estimates(bench.board.can.sent), estimates(untouched.board.can.sent)) << "after " << sent;
  }
  EXPECT_GT(answered, kFrames / 2);
  bench.answers(2'000'000);
  EXPECT_EQ(bench.read(0x5F00, 2), param::crc(kNumbers));
  EXPECT_EQ(bench.read(0x5F00, 3), 0U);
}

TEST(Canopen, BeatsAndTellsOfErrorsTenTimesASecondAtMost) {
  Bench bench;
  bench.poll_for(5'100'000);
  std::vector<int> states;
  for (const auto& frame : bench.board.can.sent)
    if (frame.id == 0x700U + kId && frame.size == 1) states.push_back(frame.data[0]);
  EXPECT_EQ(states, (std::vector{0, 5, 5, 5, 5, 5}));
  bench.board.can.sent.clear();
  bench.board.can.to_node.push_back({.id = 0x300U + bus::EstEpoch::kOffset, .size = 8});
  std::vector<std::pair<std::int64_t, base::CanFrame>> told;
  std::size_t seen = 0;
  for (int k = 0; k < 12'000; ++k) {
    if (k < 4'000 && k % 10 == 0) ++bench.board.can.counted.rx_overflow, bench.board.can.counted.bus_off += k % 20 == 0;
    bench.poll_for(250);
    for (; seen < bench.board.can.sent.size(); ++seen)
      if (bench.board.can.sent[seen].id == 0x80U + kId)
        told.emplace_back(bench.board.time.us, bench.board.can.sent[seen]);
  }
  std::vector<int> codes;
  for (std::size_t i = 0; i < told.size(); ++i) {
    codes.push_back(told[i].second.data[0] | told[i].second.data[1] << 8);
    if (i > 0) {
      EXPECT_GE(told[i].first - told[i - 1].first, 100'000);
    }
  }
  std::sort(codes.begin(), codes.end());
  EXPECT_EQ(codes, (std::vector{0, 0x8110, 0x8140, 0x8150}));
  EXPECT_EQ(told.back().second.data, (Bytes{})) << "error reset";
  EXPECT_EQ(bench.ask({0x40, 0x01, 0x10, 0}), (Bytes{0x4F, 0x01, 0x10, 0, 0, 0, 0, 0}));
}

TEST(Canopen, NodeIdsKeepOffTheNodesOwnIdentifiers) {
  using firmware::canopen::is_node_id;
  EXPECT_TRUE(is_node_id(1, 0x300) && is_node_id(127, 0x300));
  EXPECT_FALSE(is_node_id(0, 0x300) || is_node_id(128, 0x300));
  EXPECT_FALSE(is_node_id(1, 0x580) || is_node_id(5, 0x600) || is_node_id(127, 0x700) || is_node_id(3, 0x080));
  EXPECT_TRUE(is_node_id(1, 0x680)) << "0x601 lies below, 0x701 above";
  for (const std::uint8_t id : std::array<std::uint8_t, 3>{1, 0x2A, 127}) {
    const hal::Acceptance filter = firmware::with_requests(firmware::accepted_by(true, kNumbers), id);
    EXPECT_TRUE(filter.takes({.id = 0x600U + id}) && filter.takes({.id = 0x300}) && filter.takes({.id = 0x37F}));
  }
  Bench silent(kNumbers, 0);
  silent.send(Bench::frame(0x40, 0x1000, 0));
  EXPECT_TRUE(silent.answers(1'500'000).empty());
  for (const auto& frame : silent.board.can.sent) EXPECT_LT(frame.id - 0x300U, 0x80U);
}

}  // namespace
}  // namespace tetap::test
