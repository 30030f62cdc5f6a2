// SPDX-License-Identifier: Apache-2.0
// A quadrature encoder on a timer's counter: total counts through any number of wraps, and speed at every speed. Fast:
// counts per time of the tick. Slow: counts over the time between the edges that were counted (the M/T method: Ohmae et
// al., IEEE Trans. Ind. Electron. IE-29(3), 1982). No edge: at most one count in the time since the last, towards zero.
#pragma once

#include "hal/encoder_counter.hpp"
#include "tetap/base/math.hpp"
#include "tetap/base/time.hpp"

#include <array>
#include <cstdint>
#include <string_view>
#include <type_traits>

namespace tetap::drivers {

struct QuadratureSettings {
  float most_counts_per_s = 200'000;    ///< faster than the wheel can turn: a jump
  base::Micros standstill{500'000};     ///< time without an edge after which the speed is zero
  std::int32_t edge_timing_below = 32;  ///< counts between two updates; from there on the tick is the better clock
  bool inverted = false;                ///< counts down when the wheel rolls forward
};

enum class EncoderReason : std::uint8_t {
  kJump,       ///< more counts than can be, or a reading that follows such a jump: refused, the total stands
  kRebased,    ///< the count stayed where it had jumped to: counted on from there, the jump is lost
  kAmbiguous,  ///< updates too far apart for the counter's width: whole turns of it may be missing from the total
  kBadEdge,    ///< an edge from the future or from before the last: its time was not used
  kCount
};

[[nodiscard]] constexpr std::string_view name(EncoderReason reason) {
  constexpr std::array<std::string_view, 4> kNames = {"jump refused", "rebased after a jump", "updates too rare",
                                                      "bad edge time"};
  return reason < EncoderReason::kCount ? kNames[static_cast<std::size_t>(reason)] : std::string_view{"?"};
}

struct EncoderHealth {
  std::array<std::uint16_t, static_cast<std::size_t>(EncoderReason::kCount)> counts{};  ///< saturating

  [[nodiscard]] constexpr std::uint16_t of(EncoderReason reason) const {
    return counts[static_cast<std::size_t>(reason)];
  }
  constexpr void add(EncoderReason reason) {
    auto& count = counts[static_cast<std::size_t>(reason)];
    if (count < 0xFFFF) ++count;
  }
};

template <class Counter>
class Quadrature {
 public:
  using Difference = std::make_signed_t<Counter>;

  explicit constexpr Quadrature(const QuadratureSettings& settings = {}) : settings_(settings) {}

  /// `reading` was taken at `now`. Called at the pace of the loop, more often than half a turn of the counter.
  constexpr void update(const hal::EncoderReading<Counter>& reading, base::Micros now) {
    if (!started_) {
      started_ = true;
      return rebase(reading, now);
    }
    const base::Micros elapsed = now - taken_;
    if (elapsed.us <= 0) return;
    const float most = settings_.most_counts_per_s * base::seconds(elapsed) + 2.0F;
    if (!(most < kHalfTurn)) {
      health_.add(EncoderReason::kAmbiguous);
      return rebase(reading, now);
    }
    // The difference modulo the counter's width is right for every wrap, as long as it is below half a turn.
    const auto raw = static_cast<Difference>(static_cast<Counter>(reading.count - count_));
    const std::int64_t moved = settings_.inverted ? -std::int64_t{raw} : std::int64_t{raw};
    if (suspects_ > 0 ? !returns(reading, moved, elapsed, now) : beyond(moved, most)) return refuse(reading, now);
    suspects_ = 0;
    measure(static_cast<std::int32_t>(moved), elapsed, reading.last_edge, now);
    total_ += moved;
    count_ = reading.count;
    taken_ = now;
  }

  /// Counts since the first update.
  [[nodiscard]] constexpr std::int64_t counts() const { return total_; }
  [[nodiscard]] constexpr float counts_per_s() const { return speed_; }
  [[nodiscard]] constexpr const EncoderHealth& health() const { return health_; }

 private:
  static constexpr float kHalfTurn = static_cast<float>(std::uint64_t{1} << (8 * sizeof(Counter) - 1));
  static constexpr int kSuspects = 5;

  /// `most` is below half a turn, so it fits the integer.
  [[nodiscard]] static constexpr bool beyond(std::int64_t moved, float most) {
    return (moved < 0 ? -moved : moved) > static_cast<std::int32_t>(most);
  }

  constexpr void rebase(const hal::EncoderReading<Counter>& reading, base::Micros now) {
    count_ = reading.count;
    taken_ = edge_ = now;
    edge_timed_ = false;
    direction_ = 0;
    suspects_ = 0;
    speed_ = 0;
  }

  [[nodiscard]] constexpr std::int64_t since_suspect(Counter count) const {
    const auto raw = static_cast<Difference>(static_cast<Counter>(count - suspect_));
    return settings_.inverted ? -std::int64_t{raw} : std::int64_t{raw};
  }

  /// Counts that can be passed since the last update, which was refused.
  [[nodiscard]] constexpr float most_since_suspect(base::Micros now) const {
    return settings_.most_counts_per_s * base::seconds(now - suspected_) + 2.0F;
  }

  /// After a jump: whether this reading is where the wheel went on at its speed, and nearer there than to the jump. The
  /// time since the last good reading alone would let every jump pass as motion some updates later.
  [[nodiscard]] constexpr bool returns(const hal::EncoderReading<Counter>& reading, std::int64_t moved,
                                       base::Micros elapsed, base::Micros now) const {
    const float most = settings_.most_counts_per_s * base::seconds(elapsed) + 2.0F;
    const float way = base::min(base::max(speed_ * base::seconds(elapsed), -most), most);
    const std::int64_t off = moved - static_cast<std::int32_t>(way), step = since_suspect(reading.count);
    const std::int64_t off_size = off < 0 ? -off : off, step_size = step < 0 ? -step : step;
    return !beyond(moved, most) && !beyond(off, most_since_suspect(now)) && off_size < step_size;
  }

  /// One wrong reading is forgotten; a counter that stays away and moves plausibly there was set to something else.
  constexpr void refuse(const hal::EncoderReading<Counter>& reading, base::Micros now) {
    health_.add(EncoderReason::kJump);
    const float most = most_since_suspect(now);
    const bool follows = suspects_ > 0 && most < kHalfTurn && !beyond(since_suspect(reading.count), most);
    suspects_ = follows ? suspects_ + 1 : 1;
    suspect_ = reading.count;
    suspected_ = now;
    if (suspects_ < kSuspects) return;
    health_.add(EncoderReason::kRebased);
    rebase(reading, now);
  }

  constexpr void measure(std::int32_t moved, base::Micros elapsed, std::optional<base::Micros> edge, base::Micros now) {
    if (moved == 0) return decay(now);
    const std::int32_t size = moved < 0 ? -moved : moved;
    const int direction = moved < 0 ? -1 : 1;
    const base::Micros seen = edge.value_or(now);
    const bool timed = edge.has_value() && seen <= now && seen > edge_;
    if (edge.has_value() && !timed) health_.add(EncoderReason::kBadEdge);
    const bool turned = direction_ != 0 && direction != direction_;
    if (timed && edge_timed_ && size < settings_.edge_timing_below) {
      // The first edge after turning is the last one before it, seen from the other side: between them nothing moved.
      speed_ = static_cast<float>(turned ? moved - direction : moved) / base::seconds(seen - edge_);
    } else {
      speed_ = static_cast<float>(moved) / base::seconds(elapsed);
    }
    direction_ = direction;
    edge_timed_ = timed;
    edge_ = timed ? seen : now;
  }

  constexpr void decay(base::Micros now) {
    const base::Micros quiet = now - edge_;
    if (quiet >= settings_.standstill) {
      speed_ = 0;
    } else if (quiet.us > 0) {
      const float most = 1.0F / base::seconds(quiet);
      speed_ = speed_ > most ? most : speed_ < -most ? -most : speed_;
    }
  }

  QuadratureSettings settings_;
  std::int64_t total_ = 0;
  base::Micros taken_{};      ///< the last update that counted
  base::Micros edge_{};       ///< the last edge; the update that saw it, where edges are not timed
  base::Micros suspected_{};  ///< the last update that was refused
  float speed_ = 0;
  Counter count_ = 0, suspect_ = 0;
  int direction_ = 0;
  int suspects_ = 0;
  bool started_ = false;
  bool edge_timed_ = false;
  EncoderHealth health_{};
};

}  // namespace tetap::drivers
