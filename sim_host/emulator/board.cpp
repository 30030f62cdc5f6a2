// SPDX-License-Identifier: Apache-2.0
#include "sim_host/emulator/board.hpp"

#include <algorithm>
#include <utility>

namespace tetap::board {

Board::Board(std::unique_ptr<Chip> chip, const BoardOptions& options, SensorWorld world)
    : owned_(std::move(chip)),
      processor(*owned_),
      imu(processor.scheduler, processor.complaints, options.imu),
      world_(std::move(world)),
      gnss_(processor.scheduler, [this] { poll_gnss(); }) {
  imu.world = world_.imu;
}

void Board::wire_console(Usart& port) {
  port.on_sent = [this](std::uint8_t byte, std::int64_t) { console += static_cast<char>(byte); };
}

void Board::wire_gnss(Usart& port) {
  gnss_port_ = &port;
  port.on_sent = [this](std::uint8_t byte, std::int64_t baud) {
    to_gnss += static_cast<char>(byte);
    if (gnss_plugged_ && world_.to_gnss) world_.to_gnss(processor.scheduler.now(), byte, baud);
  };
  if (world_.next_gnss_byte) gnss_.set(0);
}

void Board::wire_encoders(EncoderTimer& left, EncoderTimer& right) {
  left_.world = world_.left_edges;
  right_.world = world_.right_edges;
  if (left_.world) left.position = [this](Picoseconds time) { return left_.at(time); };
  if (right_.world) right.position = [this](Picoseconds time) { return right_.at(time); };
}

void Board::Shaft::plug(bool in, Picoseconds time) {
  if (!world || in == plugged) return;
  if (in) lost = world(time) - held;
  if (!in) held = at(time);
  plugged = in;
}

void Board::plug_encoders(bool in) {
  left_.plug(in, processor.scheduler.now());
  right_.plug(in, processor.scheduler.now());
}

// Either a byte begins now, or the receiver is asked for the next one.
void Board::poll_gnss() {
  const Picoseconds now = processor.scheduler.now();
  if (next_.begin == now) {
    if (gnss_plugged_) gnss_port_->arrive(next_.byte, next_.baud);
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
