// SPDX-License-Identifier: Apache-2.0
// A node for tests of the player. It answers Begin and each Step or Tick as the firmware does, from a CRC over its
// inputs instead of an estimate. It loses or doubles frames on demand.
#pragma once

#include "hal/can_bus.hpp"
#include "sim_host/replay/protocol.hpp"
#include "tetap/bus/decoder.hpp"
#include "tetap/bus/publisher.hpp"

#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

namespace tetap::test {

struct Sabotage {
  /// How many times frame number n (counted from 0 within its direction) gets through; default: once.
  std::function<int(std::uint64_t n, const base::CanFrame&)> into, out_of;
};

template <hal::CanBus Bus>
class StandInNode {
 public:
  StandInNode(Bus& bus, std::uint32_t base, Sabotage sabotage = {})
      : bus_(bus), base_(base), sabotage_(std::move(sabotage)) {}

  void poll() {
    while (const auto frame = bus_.receive()) {
      const int times = sabotage_.into ? sabotage_.into(frames_in_++, *frame) : 1;
      for (int i = 0; i < times; ++i) on_frame(*frame);
    }
    bus_.flush();
  }
  void tick(std::int64_t time_us) {
    input_crc_.close_epoch();
    ++epoch_;
    frames_ = 0;
    send(bus::EstEpoch{.time_us = static_cast<std::uint64_t>(time_us),
                       .in_crc = static_cast<std::uint16_t>(input_crc_.running())});
    send(bus::EstPos{.x_raw = static_cast<std::int32_t>(input_crc_.count()),
                     .y_raw = -static_cast<std::int32_t>(epoch_),
                     .epoch = static_cast<std::uint8_t>(epoch_ & 0xF),
                     .kind = sensor::EstimatorKind::kOdometry},
         0);
    send(bus::EstMotion{.yaw_rad = 0.5F, .speed_mps = -1.25F, .yaw_rate_radps = 0.0F, .epoch = 0, .pos_valid = true},
         0);
    if (epoch_ % 5 == 0)
      send(bus::EstStdPose{.epoch = 0, .std_x_m = 0.25F, .std_y_m = 0.5F, .std_yaw_rad = 0.1F, .corr_xy = -0.5F}, 0);
    if (epoch_ % 10 == 0) send(bus::EstDiagLoop{.loop_max_us = loop_time_us, .loop_mean_us = 3});
    send(bus::EstStateCrc{.crc = input_crc_.running() ^ state_flaw,
                          .in_count = static_cast<std::uint16_t>(input_crc_.count()),
                          .epoch = static_cast<std::uint8_t>(epoch_),
                          .frames = static_cast<std::uint8_t>(frames_ + 1)});
  }
  [[nodiscard]] std::uint64_t consumed() const { return input_crc_.count(); }

  std::uint32_t loop_time_us = 7;
  std::uint32_t state_flaw = 0;  ///< a node that computes something else
  bool silent = false;

 private:
  void on_frame(const base::CanFrame& frame) {
    if (sim::is_counted_input(frame, base_)) {
      input_crc_.add(bus::frame_crc(static_cast<std::uint8_t>(frame.id - base_), frame));
    } else if (frame.id == base_) {
      const auto sync = bus::decode<bus::InSync>(bus::payload(frame));
      if (!sync || silent) return;
      if (sync->kind == bus::SyncKind::kBegin) {
        input_crc_ = {};
        epoch_ = 0;
        send(bus::EstVersion{.git = 1, .config = 2});
      } else if (sync->kind != bus::SyncKind::kClock) {
        tick(static_cast<std::int64_t>(sync->time_us));
      }
    }
  }
  template <class M>
  void send(const M& message, std::size_t instance = 0) {
    ++frames_;
    const base::CanFrame frame = bus::frame(base_, message, instance);
    const int times = sabotage_.out_of ? sabotage_.out_of(frames_out_++, frame) : 1;
    for (int i = 0; i < times; ++i) static_cast<void>(bus_.send(frame));
  }

  Bus& bus_;
  std::uint32_t base_;
  Sabotage sabotage_;
  bus::InputCrc input_crc_;
  std::uint32_t epoch_ = 0;
  std::uint32_t frames_ = 0;
  std::uint64_t frames_in_ = 0;
  std::uint64_t frames_out_ = 0;
};

/// A sink that keeps everything.
struct KeepAll {
  std::vector<base::CanFrame> sent_frames, received_frames;
  std::vector<base::Micros> times;
  std::vector<bus::EstStateCrc> tails;
  int restarts = 0;

  void restarted() { ++restarts; }
  void sent(const base::CanFrame& f) { sent_frames.push_back(f); }
  void received(const base::CanFrame& f) { received_frames.push_back(f); }
  void epoch(const sim::NodeEpoch& e, base::Micros t) {
    times.push_back(t);
    tails.push_back(e.tail);
  }
};

}  // namespace tetap::test
