// SPDX-License-Identifier: Apache-2.0
// libFuzzer: bytes become frames and ticks for the rover's node and, a second time, for the whole firmware on a made-up
// board. It must not crash or do anything undefined. Every frame sent decodes, and the state stays finite. A node that
// is powered on again answers as a new one does, whatever it went through before.
#include "config/rover.hpp"
#include "tetap/firmware/firmware.hpp"

#include <array>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <new>
#include <span>
#include <vector>

namespace tetap {
namespace {

// All the code that a robot may name; and sync frames without a guard, which no fuzzer would guess.
using Estimators = node::WithBusProtection<robot::rover::Estimators>;
constexpr param::Parameters parameters = [] {
  param::Parameters given = robot::rover::parameters;
  given.loop.lockstep = param::Lockstep::kPlain;
  return given;
}();
using Node = node::Node<Estimators>;

[[noreturn]] void fail(const char* what, const base::CanFrame& frame) {
  std::fprintf(stderr, "fuzz_frames: %s: %03X#", what, static_cast<unsigned>(frame.id));
  for (std::size_t i = 0; i < frame.size && i < frame.data.size(); ++i) std::fprintf(stderr, "%02X", frame.data[i]);
  std::fputc('\n', stderr);
  std::abort();
}

// ---- input: records of ten bytes (the writer is test/fuzz/seeds)
// ------------------------------------------------------
//   0  0x00 .. 0x3F a frame of that offset; 0x80: tick so many ms (bytes 2, 3, signed) after the last one;
//      0x81: tick at the time in bytes 2 .. 7; other values: as their low six bits
//   1  of a frame: low nibble its size (DLC 0 .. 15); 0x40: extended id; 0x80: the CRC of a command is made right
//   2  .. 9 data
constexpr std::size_t kRecord = 10;
constexpr std::uint8_t kTickAfter = 0x80, kTickAt = 0x81;

struct Record {
  const std::uint8_t* bytes;
  [[nodiscard]] std::uint8_t kind() const { return bytes[0]; }
  [[nodiscard]] bool is_tick() const { return kind() == kTickAfter || kind() == kTickAt; }
  [[nodiscard]] base::Micros time(base::Micros last) const {
    std::uint64_t value = 0;
    for (int i = 7; i >= 2; --i) value = value << 8 | bytes[i];
    if (kind() == kTickAt) return {static_cast<std::int64_t>(value)};
    return last + base::Micros{std::int64_t{static_cast<std::int16_t>(value & 0xFFFF)} * 1000};
  }
  [[nodiscard]] base::CanFrame frame() const {
    const auto offset = static_cast<std::uint8_t>(kind() & 0x3F);
    base::CanFrame f{.id = parameters.can_base + offset,
                     .extended = (bytes[1] & 0x40) != 0,
                     .size = static_cast<std::uint8_t>(bytes[1] & 0x0F)};
    std::memcpy(f.data.data(), bytes + 2, f.data.size());
    if ((bytes[1] & 0x80) != 0) f.data[0] = bus::e2e_crc(offset, f.data);
    return f;
  }
};

std::vector<Record> records_of(std::span<const std::uint8_t> bytes) {
  std::vector<Record> records;
  for (std::size_t at = 0; at + kRecord <= bytes.size(); at += kRecord) records.push_back({&bytes[at]});
  return records;
}

// ---- what is held against every frame that is sent
// --------------------------------------------------------------------

/// Whether a message of the DBC has this offset.
template <class M>
constexpr bool has_offset(std::uint32_t offset) {
  if constexpr (requires { M::kStride; }) {
    for (std::uint32_t i = 0; i < M::kCount; ++i) {
      if (offset == M::kOffset + i * M::kStride) return true;
    }
  }
  return offset == M::kOffset;
}

template <class... Messages>
struct Every {
  static bool decodes(std::uint32_t offset, std::span<const std::uint8_t> p) {
    return ((has_offset<Messages>(offset) && bus::decode<Messages>(p).has_value()) || ...);
  }
};

/// Whether a node may send this: every message and page that the DBC has from the estimates on.
bool decodes(std::uint32_t offset, std::span<const std::uint8_t> p) {
  if (offset == bus::EstStatus::kOffset && !bus::e2e_valid(bus::EstStatus::kOffset, p)) return false;
  return offset >= bus::EstEpoch::kOffset && bus::AllMessages<Every>::decodes(offset, p);
}

/// Checks what a node sends and keeps it for comparison.
class Listener {
 public:
  void operator()(const base::CanFrame& frame) {
    const std::uint32_t offset = frame.id - parameters.can_base;
    const auto payload = bus::payload(frame);
    if (frame.extended || frame.id < parameters.can_base || !decodes(offset, payload))
      fail("sent, but not decodable", frame);
    ++in_epoch_;
    if (offset == bus::EstEpoch::kOffset) in_epoch_ = 1;
    if (offset == bus::EstStatus::kOffset) {
      const auto status = bus::decode<bus::EstStatus>(payload);
      if (status->reset_cause == sensor::ResetCause::kNotFinite) fail("the state was not finite", frame);
    }
    if (offset == bus::EstStateCrc::kOffset && bus::decode<bus::EstStateCrc>(payload)->frames != in_epoch_)
      fail("the epoch's frames are not as many as it says", frame);
    sent.push_back(frame);
  }
  std::vector<base::CanFrame> sent;

 private:
  std::uint8_t in_epoch_ = 0;
};

void run_node(Node& node, const std::vector<Record>& records, Listener& listener) {
  base::Micros now{1'000'000};
  node.power_on(now);
  for (const Record& record : records) {
    if (record.is_tick()) {
      now = record.time(now);
      node.tick(now, {}, [&listener](const base::CanFrame& frame) { listener(frame); });
    } else if ((record.kind() & 0x3F) != bus::InSync::kOffset && (record.kind() & 0x20) == 0) {
      node.on_frame(record.frame());  // what Firmware hands on
    }
  }
}

// ---- the whole firmware: the sync frames and the board's own clock come in
// --------------------------------------------

struct MadeUpCan {
  std::vector<base::CanFrame> to_node;
  std::size_t next = 0;
  Listener listener;

  bool send(const base::CanFrame& frame) { return listener(frame), true; }
  std::optional<base::CanFrame> receive() {
    if (next == to_node.size()) return std::nullopt;
    return to_node[next++];
  }
  void flush() {}
  [[nodiscard]] base::CanFaults faults() const { return {}; }
  [[nodiscard]] bool empty() const { return next == to_node.size(); }
};

struct MadeUpBoard {
  MadeUpCan can;
  base::Micros time;
  [[nodiscard]] base::Micros now() const { return time; }
};

void run_firmware(const std::vector<Record>& records) {
  MadeUpBoard board;
  const auto firmware =
      std::make_unique<firmware::Firmware<MadeUpBoard, Estimators>>(board, parameters, bus::Version{});
  for (const Record& record : records) {
    if (!record.is_tick()) {
      base::CanFrame frame = record.frame();
      board.can.to_node.push_back(frame);
      continue;
    }
    const base::Micros later = record.time(board.time);  // a board's clock does not go back
    board.time = later > board.time ? later : board.time + base::Micros{1'000};
    firmware->poll();
  }
  while (!board.can.empty()) firmware->poll();
}

}  // namespace
}  // namespace tetap

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace tetap;
  const auto records = records_of({data, size});
  // One node in memory that was never cleared, so a member that is read before it is written shows as a difference.
  alignas(Node) static std::array<std::byte, sizeof(Node)> memory;
  memory.fill(std::byte{0xA5});
  Node& node = *new (memory.data()) Node(parameters, bus::Version{});
  Listener fresh, again;
  run_node(node, records, fresh);
  run_node(node, records, again);
  node.~Node();
  for (std::size_t i = 0; i < fresh.sent.size(); ++i)
    if (i >= again.sent.size() || fresh.sent[i].data != again.sent[i].data || fresh.sent[i].id != again.sent[i].id)
      fail("another answer after power-on than before", fresh.sent[i]);
  run_firmware(records);
  return 0;
}
