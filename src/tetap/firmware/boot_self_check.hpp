// SPDX-License-Identifier: Apache-2.0
// A run of the node on made-up input with everything that happens to a node. It gets outliers, late, early, doubled and
// broken frames, half samples, resets and jumps of time. Its hash covers every deterministic byte sent, the state CRCs
// among them. It is the same wherever the arithmetic is the same: `make bits` compares it across compilers and cores.
// An image prints a short form at boot.
#pragma once

#include "tetap/bus/frame_sink.hpp"
#include "tetap/node/node.hpp"

#include <cstdint>

namespace tetap::firmware {

/// Integers for stimuli: Marsaglia's xorshift32 (J. Stat. Software 8(14), 2003). Not for statistics.
class Dice {
 public:
  explicit constexpr Dice(std::uint32_t seed) : state_(seed | 1U) {}
  constexpr std::uint32_t roll() {
    state_ ^= state_ << 13;
    state_ ^= state_ >> 17;
    state_ ^= state_ << 5;
    return state_;
  }
  constexpr std::uint32_t below(std::uint32_t n) { return roll() % n; }
  constexpr bool one_in(std::uint32_t n) { return below(n) == 0; }
  /// In [-1, 1), 2^16 values.
  constexpr float spread() {
    return (static_cast<float>(static_cast<std::int32_t>(below(65536))) - 32768.0F) * (1.0F / 32768.0F);
  }

 private:
  std::uint32_t state_;
};

template <class Node>
class BootSelfCheck {
 public:
  BootSelfCheck(Node& node, std::uint32_t can_base, std::uint32_t seed) : node_(node), base_(can_base), dice_(seed) {}

  /// Powers the node on and runs so many epochs. Gives the hash of what it sent.
  std::uint32_t run(std::uint32_t epochs) {
    bus::FrameHash hash(base_);
    run(epochs, hash);
    return hash.value();
  }
  /// Runs the check into an outlet that hashes.
  template <class Send>
  void run(std::uint32_t epochs, Send& send) {
    node_.power_on({kStart_us});
    now_us_ = kStart_us;
    for (std::uint32_t k = 0; k < epochs; ++k) {
      now_us_ += 10'000;
      if (dice_.one_in(5000)) now_us_ += dice_.one_in(2) ? 3'000'000 : -1'000'000;
      feed(k);
      node_.tick({now_us_}, {}, send);
    }
  }

 private:
  static constexpr std::int64_t kStart_us = 1'000'000;

  /// Mostly between the last tick and this one; sometimes late, too late, or ahead.
  std::uint32_t stamp() {
    std::int64_t back_us = dice_.below(10'000);
    if (dice_.one_in(10)) back_us += dice_.below(150'000);
    if (dice_.one_in(200)) back_us += 300'000;
    if (dice_.one_in(300)) back_us -= 400'000;
    return static_cast<std::uint32_t>(static_cast<std::uint64_t>(now_us_ - back_us) & 0xFFFFF);
  }
  template <class Message>
  [[gnu::cold]] void put(const Message& message, std::size_t instance = 0) {
    base::CanFrame frame = bus::frame(base_, message, instance);
    if (dice_.one_in(100)) return;  // lost
    if (dice_.one_in(200)) frame.data[dice_.below(8)] ^= static_cast<std::uint8_t>(1U << dice_.below(8));
    if (dice_.one_in(500)) frame.size = static_cast<std::uint8_t>(dice_.below(8));
    node_.on_frame(frame);
    if (dice_.one_in(100)) node_.on_frame(frame);
  }
  [[gnu::cold]] void feed(std::uint32_t k) {
    const auto seq = static_cast<std::uint8_t>(k & 15);
    if (k % 900 == 0) introduce();
    if (dice_.one_in(1500))
      put(bus::protect(bus::CmdReset{.ctr = seq, .what = static_cast<bus::ResetWhat>(dice_.below(3))}));
    left_ += 40 + dice_.below(20) - dice_.below(20);
    right_ += 42 + dice_.below(20) - dice_.below(20);
    put(bus::InWheelCounts{.stamp_us = stamp(),
                           .seq = seq,
                           .left = static_cast<std::uint16_t>(left_),
                           .right = static_cast<std::uint16_t>(right_)});
    if (dice_.one_in(3))
      put(bus::InBodySpeed{
          .stamp_us = stamp(), .seq = seq, .forward_mps = 1.0F + dice_.spread(), .yaw_rate_radps = dice_.spread()});
    if (dice_.one_in(4))
      put(bus::InWheelSpeed{
          .stamp_us = stamp(), .seq = seq, .left_mps = 1.0F + dice_.spread(), .right_mps = 1.0F + dice_.spread()});
    const std::uint32_t imu_stamp = stamp();
    put(bus::ImuGyro{.ang_x_rad = 1e-3F * dice_.spread(),
                     .ang_y_rad = 1e-3F * dice_.spread(),
                     .ang_z_rad = 5e-3F * dice_.spread(),
                     .seq = seq});
    put(bus::ImuAccel{
        .vel_x_mps = 0.01F * dice_.spread(), .vel_y_mps = 0.01F * dice_.spread(), .vel_z_mps = 0.098F, .seq = seq});
    put(bus::ImuTime{.stamp_us = imu_stamp, .interval_us = 10'000, .seq = seq});
    for (std::uint32_t i = dice_.below(3); i > 0; --i) {
      const float wild = dice_.one_in(20) ? 20.0F : 1.0F;
      put(bus::InRangeBearing{.stamp_us = stamp(),
                              .seq = static_cast<std::uint8_t>((seq + i) & 15),
                              .id = static_cast<std::uint8_t>(dice_.below(10)),
                              .range_m = dice_.one_in(9) ? base::kNan : 6.0F + 5.0F * wild * dice_.spread(),
                              .bearing_rad = dice_.one_in(9) ? base::kNan : 3.2F * dice_.spread()});
    }
    if (k % 20 == 7) {
      const std::uint32_t t = stamp();
      const std::int64_t jump = dice_.one_in(20) ? 500'000 : 5'000;
      put(bus::InGnssLat{
          .stamp_us = t, .seq = seq, .lat_raw = 24'131'000'000 + jump * static_cast<std::int32_t>(dice_.below(10))});
      put(bus::InGnssLon{
          .stamp_us = t, .seq = seq, .lon_raw = 5'834'000'000 - jump * static_cast<std::int32_t>(dice_.below(10))});
      put(bus::InGnssAlt{.stamp_us = t,
                         .seq = seq,
                         .height_m = 500.0F + dice_.spread(),
                         .fix = static_cast<bus::GnssFix>(dice_.below(7)),
                         .num_sv = 9});
      put(bus::InGnssAcc{.stamp_us = t, .seq = seq, .hor_m = 1.5F + dice_.spread(), .ver_m = 3.0F});
    }
  }
  [[gnu::cold]] void introduce() {
    for (std::uint8_t id = 0; id < 8; ++id)
      put(bus::InMapEntry{.id = id,
                          .x_raw = static_cast<std::int32_t>(dice_.below(20'000)) - 10'000,
                          .y_raw = static_cast<std::int32_t>(dice_.below(20'000)) - 10'000});
    const auto ctr = static_cast<std::uint8_t>(dice_.below(16));
    put(bus::protect(bus::CmdSetPos{.ctr = ctr, .x_raw = static_cast<std::int32_t>(dice_.below(4'000)), .y_raw = 0}));
    put(bus::protect(
        bus::CmdSetYaw{.ctr = ctr, .yaw_rad = 3.0F * dice_.spread(), .std_pos_m = 0.5F, .std_yaw_rad = 0.2F}));
  }

  Node& node_;
  std::uint32_t base_;
  Dice dice_;
  std::int64_t now_us_ = 0;
  std::uint32_t left_ = 0;
  std::uint32_t right_ = 0;
};

}  // namespace tetap::firmware
