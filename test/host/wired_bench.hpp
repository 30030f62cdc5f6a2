// SPDX-License-Identifier: Apache-2.0
// A rover whose sensors are wired to its board, on a bus that others use too. One queue of the board's own frames, one
// of the others', one wire, a log of its frames.
#pragma once

#include "config/rover.hpp"
#include "sim_host/play/snapshot_request.hpp"
#include "sim_host/replay/lockstep.hpp"
#include "sim_host/replay/recording.hpp"
#include "support/fakes/board.hpp"
#include "tetap/firmware/firmware.hpp"
#include "tetap/node/bus_protection.hpp"

#include "host/stand_in_node.hpp"

#include <cmath>
#include <cstdint>
#include <deque>
#include <memory>
#include <random>
#include <vector>

namespace tetap::test {

/// 500 kbit/s: 130 bits of a frame with 8 bytes take 260 us.
class Wire {
 public:
  static constexpr std::int64_t kFrame_us = 260;

  void foreign(const base::CanFrame& frame) { others_.push_back(frame); }
  /// Whoever wins the arbitration goes first; nobody acknowledges while it is cut.
  void run(base::Micros now) {
    for (; free_us_ + kFrame_us <= now.us && !cut && !(own_.empty() && others_.empty()); free_us_ += kFrame_us) {
      const bool own = others_.empty() || (!own_.empty() && draw_() % 2 == 0);
      std::deque<base::CanFrame>& queue = own ? own_ : others_;
      log.push_back({{kStart_us + free_us_}, queue.front()});
      if (!own) to_board_.push_back(queue.front());
      queue.pop_front();
    }
    if (cut || (own_.empty() && others_.empty())) free_us_ = std::max(free_us_, now.us - kFrame_us);
  }
  /// The board is reset: what waited in it is lost.
  void discard() { own_.clear(), to_board_.clear(); }

  // The board's end.
  bool send(const base::CanFrame& frame) {
    if (own_.size() == kQueue) return ++faults_.tx_full, false;
    own_.push_back(frame);
    return true;
  }
  std::optional<base::CanFrame> receive() {
    if (to_board_.empty()) return std::nullopt;
    const base::CanFrame frame = to_board_.front();
    to_board_.pop_front();
    return frame;
  }
  [[nodiscard]] base::CanFaults faults() const { return faults_; }

  std::vector<sim::TimedFrame> log;
  bool cut = false;

 private:
  static constexpr std::size_t kQueue = 64;
  static constexpr std::int64_t kStart_us = 1'700'000'000'000'000;  ///< a log has the time of day

  std::deque<base::CanFrame> own_, others_, to_board_;
  std::int64_t free_us_ = 0;
  base::CanFaults faults_;
  std::mt19937_64 draw_{5};
};

struct WireEnd {
  Wire* wire;
  bool send(const base::CanFrame& frame) { return wire->send(frame); }
  std::optional<base::CanFrame> receive() { return wire->receive(); }
  void flush() {}
  [[nodiscard]] base::CanFaults faults() const { return wire->faults(); }
};

struct RoverBoard : fakes::WiredBoard<WireEnd> {
  using fakes::WiredBoard<WireEnd>::WiredBoard;
  static constexpr bool kSnapshots = true;
  void start_sensors() { sensors_started = true; }
  bool sensors_started = false;
};

inline param::Parameters wired_rover() {
  param::Parameters p = robot::rover::parameters;
  p.wired = {.imu = 1, .encoders = 1, .right_inverted = 1, .gnss = 2};
  return p;
}

/// With the code of tags and guards, which the parameters ask for or not.
using ProtectedRover = node::WithBusProtection<robot::rover::Estimators>;

/// Drives north: at rest for 4 s, then at 1 m/s.
class WiredRover {
 public:
  static constexpr firmware::WiredParts kParts{.imu = true, .encoders = true, .gnss = true};
  using Firmware = firmware::Firmware<RoverBoard, ProtectedRover, kParts>;

  WiredRover() {
    board.imu.set_motion([](double t) {
      fakes::icm42688::Motion m;
      for (std::size_t i = 0; i < 3; ++i) {
        m.rate_radps[i] = 2e-3 * std::sin(997.0 * t + static_cast<double>(i));
        m.specific_force_mps2[i] = (i == 2 ? 9.80665 : 0.0) + 0.02 * std::sin(1301.0 * t + static_cast<double>(i));
      }
      m.specific_force_mps2[0] += t > 4 && t < 5 ? 1.0 : 0.0;
      return m;
    });
    board.left_encoder.set_motion([](double t) { return edges(t); });
    board.right_encoder.set_motion([](double t) { return -edges(t); });
    boot();
  }

  void boot() { firmware = std::make_unique<Firmware>(board, parameters, bus::Version{.git = 7}); }
  void run(double seconds) {
    for (const std::int64_t end = now_us + static_cast<std::int64_t>(seconds * 1e6); now_us < end;) {
      now_us += kPoll_us;
      board.advance({now_us});
      if (now_us % 50'000 == 0) solve();
      if (foreign_per_s > 0 && draw() % 1'000'000 < static_cast<std::uint64_t>(foreign_per_s * kPoll_us)) intrude();
      wire.run({now_us});
      firmware->poll();
    }
  }
  void command(bus::ResetWhat what) {
    wire.foreign(bus::frame(0x300, bus::protect(bus::CmdReset{.ctr = ++command_counter, .what = what})));
  }
  void sync(bus::SyncKind kind, std::int64_t time_us) {
    const bus::InSync message = sim::sync_message(kind, {time_us}, ++syncs);
    if (kind == bus::SyncKind::kBegin || kind == bus::SyncKind::kClock)
      wire.foreign(bus::frame(0x300, bus::guard_of_sync(message)));
    wire.foreign(bus::frame(0x300, message));
  }

  template <class Message>
  [[nodiscard]] std::vector<Message> said() const {
    std::vector<Message> found;
    for (const sim::TimedFrame& entry : wire.log)
      if (entry.frame.id == 0x300U + Message::kOffset)
        if (const auto message = bus::decode<Message>(bus::payload(entry.frame))) found.push_back(*message);
    return found;
  }
  [[nodiscard]] std::size_t epochs() const { return said<bus::EstStateCrc>().size(); }

  static constexpr std::int64_t kPoll_us = 250;
  param::Parameters parameters = wired_rover();
  Wire wire;
  RoverBoard board{WireEnd{&wire}};
  std::unique_ptr<Firmware> firmware;
  std::int64_t now_us = 0;
  std::int64_t foreign_per_s = 0;
  std::mt19937_64 draw{17};
  std::uint8_t command_counter = 0, syncs = 0, sequence = 0;

 private:
  static double metres(double t) { return t < 4 ? 0 : t < 5 ? 0.5 * (t - 4) * (t - 4) : t - 4.5; }
  static double edges(double t) { return metres(t) * 2000 / (2 * M_PI * 0.1); }
  void solve() {
    fakes::ublox::Solution s;
    const double t = 1e-6 * static_cast<double>(now_us);
    s.latitude_deg = 48.2627 + metres(t) / 111'200.0;
    s.longitude_deg = 11.6683;
    s.height_m = 520;
    s.v_mps = {0, t < 4 ? 0 : t < 5 ? t - 4 : 1, 0};
    board.gnss.set_solution(s);
  }
  /// Samples of sensors that are not wired, half of them of kinds that this robot does not use.
  void intrude() {
    const auto stamp = static_cast<std::uint32_t>(now_us & 0xFFFFF);
    const auto seq = static_cast<std::uint8_t>(sequence++ & 15);
    if (draw() % 2 == 0)
      return wire.foreign(bus::frame(0x300, bus::InBodySpeed{.stamp_us = stamp,
                                                             .seq = seq,
                                                             .forward_mps = static_cast<float>(draw() % 100) * 0.01F,
                                                             .yaw_rate_radps = 0}));
    wire.foreign(bus::frame(0x300, bus::InWheelSpeed{.stamp_us = stamp,
                                                     .seq = seq,
                                                     .inst = 1,
                                                     .left_mps = static_cast<float>(draw() % 100) * 0.01F,
                                                     .right_mps = 1}));
  }
};

/// The desk: the same robot behind a bus alone.
struct DeskBoard {
  hal::MemoryCan can;
  static constexpr bool kSnapshots = true;
  [[nodiscard]] static base::Micros now() { return {}; }
};

struct Repetition {
  sim::Recording recording;
  sim::Counts counts;
  std::uint64_t compared = 0, different = 0, missing = 0;
  std::string first;
  std::string refusal;  ///< why the log cannot be repeated
};

inline Repetition repeat_at_the_desk(const std::vector<sim::TimedFrame>& log,
                                     const param::Parameters& parameters = wired_rover()) {
  Repetition r;
  sim::FramesInMemory frames(log);
  const auto recording = sim::recording_of(frames, "wired.log", {});
  if (!recording) return r.refusal = recording.failure().text, r;
  r.recording = *recording;
  sim::RecordedTicks ticks(frames, r.recording, {});
  hal::MemoryBus bus;
  DeskBoard board{bus.node_end()};
  using Firmware = firmware::Firmware<DeskBoard, ProtectedRover>;
  const auto firmware = std::make_unique<Firmware>(board, parameters, bus::Version{.git = 7});
  sim::MemoryLink link(bus, [&firmware] { firmware->poll(); });
  link.on_resume([&firmware](std::span<const std::byte> state) { return firmware->resume(state); });
  sim::Comparison comparison(ticks, r.recording, {});
  struct Sink : KeepAll {
    sim::Comparison* comparison = nullptr;
    void epoch(const sim::NodeEpoch& e, base::Micros t) { comparison->epoch(e, t); }
  } sink;
  sink.comparison = &comparison;
  EXPECT_TRUE(sim::play_lockstep(link, ticks, sink, {}, r.counts));
  r.compared = comparison.compared();
  r.different = comparison.different();
  r.missing = comparison.missing();
  r.first = comparison.first_difference();
  return r;
}

}  // namespace tetap::test
