// SPDX-License-Identifier: Apache-2.0
#include "sim_host/emulator/can_line.hpp"

#include <algorithm>

namespace tetap::board {

namespace {

/// Counts bits of the stuffed part of a frame and computes its CRC-15 (polynomial 0x4599).
class BitCounter {
 public:
  void put(bool bit, bool in_crc = true) {
    ++bits_;
    run_ = bit == last_ ? run_ + 1 : 1;
    last_ = bit;
    if (in_crc) {
      const bool invert = bit != ((crc_ >> 14 & 1) != 0);
      crc_ = crc_ << 1 & 0x7FFF;
      if (invert) crc_ ^= 0x4599;
    }
    if (run_ == 5) {  // a stuff bit of the other value follows and begins a run
      ++bits_;
      last_ = !bit;
      run_ = 1;
    }
  }
  void put_word(std::uint32_t value, int width) {
    for (int i = width - 1; i >= 0; --i) put((value >> i & 1) != 0);
  }
  [[nodiscard]] int finish() {
    const std::uint32_t crc = crc_;
    for (int i = 14; i >= 0; --i) put((crc >> i & 1) != 0, false);
    return bits_;
  }

 private:
  int bits_ = 0, run_ = 0;
  bool last_ = true;
  std::uint32_t crc_ = 0;
};

constexpr int kTail = 10, kIntermission = 3;  // CRC delimiter, ACK slot and delimiter, end of frame of 7 bits
constexpr int kErrorFrame = 6 + 8;            // flag and delimiter
constexpr int kSuspend = 8;                   // an error passive node waits longer
constexpr int kEarlyBitError = 12;            // a bit error shows within the identifier

}  // namespace

int frame_bits(const base::CanFrame& frame, bool remote) {
  BitCounter bits;
  bits.put(false);
  if (frame.extended) {
    bits.put_word(frame.id >> 18, 11);
    bits.put(true);  // SRR
    bits.put(true);  // IDE
    bits.put_word(frame.id & 0x3FFFF, 18);
    bits.put(remote);
    bits.put_word(0, 2);
  } else {
    bits.put_word(frame.id, 11);
    bits.put(remote);
    bits.put_word(0, 2);
  }
  bits.put_word(frame.size, 4);
  for (std::size_t i = 0; !remote && i < frame.size; ++i) bits.put_word(frame.data[i], 8);
  return bits.finish() + kTail;
}

std::uint64_t arbitration_key(const base::CanFrame& frame, bool remote) {
  const std::uint64_t rtr = remote ? 1 : 0;
  if (!frame.extended) return std::uint64_t{frame.id} << 21 | rtr << 20;
  return std::uint64_t{frame.id >> 18} << 21 | 3ULL << 19 | std::uint64_t{frame.id & 0x3FFFF} << 1 | rtr;
}

double rate_tolerance_of(double segment1, double segment2, double jump) {
  const double quanta = 1 + segment1 + segment2;
  return 2 * std::min(jump / (20 * quanta), std::min(segment1, segment2) / (2 * (13 * quanta - segment2)));
}

CanLine::CanLine(Scheduler& scheduler, CanController& controller)
    : scheduler_(scheduler),
      controller_(controller),
      end_(scheduler, [this] { finish(); }),
      start_(scheduler, [this] { arbitrate(); }) {}

void CanLine::send(const base::CanFrame& frame, Picoseconds at) {
  foreign_.push_back({{frame, false}, at});
  poke();
}

void CanLine::release() {
  if (!stuck_dominant) return;
  stuck_dominant = false;
  controller_.released();
  poke();
}

void CanLine::poke() {
  if (end_.pending()) return;
  Picoseconds at = kNever;
  if (controller_.on_bus() && controller_.offer()) at = scheduler_.now();
  for (const Foreign& one : foreign_) at = std::min(at, one.at);
  if (at == kNever) return start_.clear();
  start_.set(std::max({at, free_at_, scheduler_.now()}));
}

std::deque<CanLine::Foreign>::iterator CanLine::best_foreign() {
  auto best = foreign_.end();
  for (auto one = foreign_.begin(); one != foreign_.end(); ++one) {
    if (one->at > scheduler_.now()) continue;
    if (best == foreign_.end() ||
        arbitration_key(one->frame.frame, one->frame.remote) < arbitration_key(best->frame.frame, best->frame.remote)) {
      best = one;
    }
  }
  return best;
}

bool CanLine::rates_match() const {
  const double own = static_cast<double>(controller_.bit_rate()), theirs = static_cast<double>(bit_rate);
  const double difference = own > theirs ? own / theirs - 1 : theirs / own - 1;
  return difference <= controller_.rate_tolerance();
}

void CanLine::arbitrate() {
  const auto own = controller_.on_bus() ? controller_.offer() : std::nullopt;
  const auto other = best_foreign();
  if (!own && other == foreign_.end()) return poke();
  own_ = own && (other == foreign_.end() ||
                 arbitration_key(own->frame, own->remote) <= arbitration_key(other->frame.frame, other->frame.remote));
  if (own && !own_) controller_.lost_arbitration();
  if (own_) {
    current_ = *own;
  } else {
    current_ = other->frame;
    foreign_.erase(other);
  }
  const bool silent = own_ && transceiver_on && !transceiver_on();
  const bool early = disturbed() || silent || (own_ && !rates_match());
  const int bits = early ? kEarlyBitError : frame_bits(current_.frame, current_.remote);
  end_.set(scheduler_.now() + periods(bits, own_ ? controller_.bit_rate() : bit_rate));
}

void CanLine::pause(int bits) { free_at_ = scheduler_.now() + periods(bits, bit_rate); }

void CanLine::finish() {
  if (own_) {
    finish_own();
  } else {
    finish_foreign();
  }
  poke();
}

void CanLine::finish_own() {
  if (!controller_.on_bus()) return pause(kIntermission);  // taken off the bus in the middle
  const int wait = kErrorFrame + kIntermission + (controller_.error_passive() ? kSuspend : 0);
  const bool silent = transceiver_on && !transceiver_on();
  if (disturbed() || silent || stuck_dominant || (partner && !rates_match())) {
    pause(wait);
    return controller_.failed(stuck_dominant ? CanError::kBitRecessive : CanError::kBitDominant);
  }
  if (!partner) {
    pause(wait);
    return controller_.failed(CanError::kAck);
  }
  pause(kIntermission);
  if (on_frame) on_frame(scheduler_.now(), current_, true);
  controller_.sent();
}

void CanLine::finish_foreign() {
  if (disturbed() || !partner) {
    ++destroyed;
    pause(kErrorFrame + kIntermission);
    if (controller_.on_bus() && partner) controller_.receive_error(CanError::kForm);
    return;
  }
  if (controller_.on_bus() && (!rates_match() || stuck_dominant)) {
    ++destroyed;
    pause(kErrorFrame + kIntermission);
    return controller_.receive_error(CanError::kStuff);
  }
  pause(kIntermission);
  if (on_frame) on_frame(scheduler_.now(), current_, false);
  if (controller_.on_bus()) controller_.received(current_);
}

}  // namespace tetap::board
