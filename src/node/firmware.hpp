// SPDX-License-Identifier: Apache-2.0
// The product: one object, one poll(). A port's main() is this object and a loop.
#pragma once

#include "bus/frame_sink.hpp"
#include "hal/board.hpp"
#include "node/boot_self_check.hpp"
#include "node/node.hpp"
#include "node/pacer.hpp"

#include <cstdint>

namespace tetap::node {

template <hal::Board Board, class Estimators>
class Firmware {
 public:
  Firmware(Board& board, const param::Parameters& parameters, const bus::Version& version)
      : board_(board),
        parameters_(parameters),
        node_(parameters, version),
        pacer_(base::Micros{parameters.loop.period_us}) {}

  /// Runs the exercise on this very node, then powers it on anew. For boot: the hash shows whether this core computes
  /// as all others do.
  [[nodiscard]] std::uint32_t self_check(std::uint32_t epochs) {
    bus::FrameHash hash(parameters_.can_base);
    bus::FrameSink frame_sink(board_.can, hash);
    BootSelfCheck(node_, parameters_.can_base, 1).run(epochs, frame_sink);
    node_.power_on({});
    return hash.value();
  }

  /// Takes what has arrived, ticks when it is time, hands on what is to be sent. Call it in a loop, as often as you
  /// like.
  void poll() {
    // As much as two full receivers: a bus that is never quiet must not keep the tick from its time.
    for (int i = 0; i < kMostPerPoll; ++i) {
      const auto frame = board_.can.receive();
      if (!frame) break;
      on_frame(*frame);
    }
    if (const auto t = pacer_.on_poll(board_.now(), health_)) tick(*t);
    board_.can.flush();
  }

 private:
  static constexpr int kMostPerPoll = 128;
  static constexpr std::uint32_t kInputs = 0x20;  ///< offsets below are inputs

  void on_frame(const base::CanFrame& frame) {
    if (frame.extended || frame.id < parameters_.can_base || frame.id >= parameters_.can_base + kInputs) return;
    if (frame.id != parameters_.can_base + bus::InSync::kOffset) return node_.on_frame(frame);
    const auto sync = bus::decode<bus::InSync>(bus::payload(frame));
    if (!sync) return void(++health_.sync_bad);
    count_sync(*sync);
    const base::Micros time{static_cast<std::int64_t>(sync->time_us)};
    if (sync->kind == bus::SyncKind::kBegin) {
      node_.power_on(time);
      bus::FrameSink frame_sink(board_.can);
      node_.send_version(frame_sink);
    }
    if (const auto t = pacer_.on_sync(sync->kind, time, board_.now(), health_)) tick(*t);
  }

  /// Counts sync frames that the counter skipped, modulo 256. A repeated frame is no gap, nor is one out of its order:
  /// its time is not later.
  void count_sync(const bus::InSync& sync) {
    const auto step = static_cast<std::uint8_t>(sync.ctr - sync_counter_);
    const bool anew = !counts_sync_ || sync.kind == bus::SyncKind::kBegin;
    if (!anew && (step == 0 || (step >= 0x80 && sync.time_us <= sync_time_us_))) return;
    if (!anew) health_.sync_gap = static_cast<std::uint16_t>(health_.sync_gap + step - 1);
    sync_counter_ = sync.ctr;
    sync_time_us_ = sync.time_us;
    counts_sync_ = true;
  }

  void tick(base::Micros t) {
    const base::Micros began = board_.now();
    health_.sync = pacer_.state();
    health_.bus = board_.can.faults();
    bus::FrameSink frame_sink(board_.can);
    node_.tick(t, health_, frame_sink);
    const std::int64_t took_us = (board_.now() - began).us;
    const auto us = static_cast<std::uint32_t>(took_us < 0 ? 0 : took_us > 1'000'000 ? 1'000'000 : took_us);
    if (us > health_.longest_us) health_.longest_us = us;
    if (took_us > parameters_.loop.period_us) ++health_.ticks_late;
    health_.mean_us += (static_cast<float>(us) - health_.mean_us) * 0.01F;
  }

  Board& board_;
  const param::Parameters& parameters_;
  Node<Estimators> node_;
  Pacer pacer_;
  bus::LoopHealth health_;
  std::uint64_t sync_time_us_ = 0;
  std::uint8_t sync_counter_ = 0;
  bool counts_sync_ = false;  ///< a sync frame has been there
};

}  // namespace tetap::node
