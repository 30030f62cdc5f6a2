// SPDX-License-Identifier: Apache-2.0
#include "sim_host/board/ark_cannode.hpp"

#include <algorithm>
#include <utility>

namespace tetap::board {

ArkCannode::ArkCannode(const BoardOptions& options, SensorWorld world)
    : chip(options.oscillators),
      imu(chip.scheduler, chip.complaints, options.imu),
      world_(std::move(world)),
      gnss_(chip.scheduler, [this] { poll_gnss(); }) {
  imu.world = world_.imu;
  if (options.imu_present) {
    imu.on_int1 = [this](bool level) { chip.pins.drive(kImuReady, level); };
    chip.spi1.connect(imu, kImuSelect, chip.pins);
  }
  left_.world = world_.left_edges;
  right_.world = world_.right_edges;
  if (left_.world) chip.tim2.position = [this](Picoseconds time) { return left_.at(time); };
  if (right_.world) chip.tim3.position = [this](Picoseconds time) { return right_.at(time); };
  chip.usart2.on_sent = [this](std::uint8_t byte, std::int64_t) { console += static_cast<char>(byte); };
  chip.usart1.on_sent = [this](std::uint8_t byte, std::int64_t baud) {
    to_gnss += static_cast<char>(byte);
    if (gnss_plugged_ && world_.to_gnss) world_.to_gnss(chip.scheduler.now(), byte, baud);
  };
  chip.can1.line.transceiver_on = [this] { return !chip.pins.level(kCanSilent); };
  if (world_.next_gnss_byte) gnss_.set(0);
}

void ArkCannode::Shaft::plug(bool in, Picoseconds time) {
  if (!world || in == plugged) return;
  if (in) lost = world(time) - held;
  if (!in) held = at(time);
  plugged = in;
}

void ArkCannode::plug_encoders(bool in) {
  left_.plug(in, chip.scheduler.now());
  right_.plug(in, chip.scheduler.now());
}

// Either a byte begins now, or the receiver is asked for the next one.
void ArkCannode::poll_gnss() {
  const Picoseconds now = chip.scheduler.now();
  if (next_.begin == now) {
    if (gnss_plugged_) chip.usart1.arrive(next_.byte, next_.baud);
    gnss_.set(now + periods(10, next_.baud));
    next_.begin = kNever;
    return;
  }
  next_ = world_.next_gnss_byte(now);
  if (next_.begin != kNever) {
    next_.begin = std::max(next_.begin, now);
    gnss_.set(next_.begin);
  } else if (next_.again != kNever) {
    gnss_.set(next_.again);
  }
}

}  // namespace tetap::board
