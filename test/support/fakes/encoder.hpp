// SPDX-License-Identifier: Apache-2.0
// A fake quadrature encoder on a timer's counter: two square waves a quarter period apart. Every edge of both is
// counted, up or down by the level of the other, with the time of the last counted edge captured. STMicroelectronics
// RM0365, general-purpose timers, Encoder interface mode, table 118 "Counting direction versus encoder signals". Its
// named faults are at the wires, so the counter does what the counting table makes of them.
//
//   Encoder<std::uint16_t> encoder;                                  // satisfies hal::EncoderCounter
//   encoder.set_motion([](double s) { return 4000.0 * s; });         // position in edges, by host time
//   encoder.advance(base::Micros{10'000});
//   encoder.read();                                                  // {40, 10'000 us}
#pragma once

#include "hal/encoder_counter.hpp"
#include "tetap/base/random.hpp"
#include "tetap/base/time.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string_view>
#include <utility>

namespace tetap::fakes {

enum class EncoderFault : std::uint8_t {
  kChannelDead,   ///< wire `channel` (0 A, 1 B) keeps its level: the count dithers by one while the wheel turns
  kStuck,         ///< neither wire moves any more
  kSwapped,       ///< A and B exchanged: everything counts the other way
  kGlitches,      ///< spikes on A, `rate_Hz`: counted up and down again, the edge time moves without the wheel
  kSpurious,      ///< single false counts, either way, `rate_Hz`
  kMissedPulses,  ///< every `every`-th pulse of A is not seen, rise nor fall: four edges less
  kJump,          ///< at once, the count is off by `counts`
  kReset,         ///< at once, the count is 0
  kNoCapture,     ///< the timer gives no edge times
  kCaptureStuck,  ///< the timer counts on and captures no more: the edge time stays what it was
  kCount
};

[[nodiscard]] constexpr std::string_view name(EncoderFault fault) {
  constexpr std::string_view kNames[] = {"channel dead",  "stuck", "swapped", "glitches",   "spurious counts",
                                         "missed pulses", "jump",  "reset",   "no capture", "capture stuck"};
  return kNames[static_cast<std::size_t>(fault)];
}

struct EncoderFaultDetail {
  int channel = 0;
  double rate_Hz = 100.0;
  int every = 10;
  std::int32_t counts = 1000;
  std::uint64_t seed = 1;
};

template <class CounterT = std::uint32_t>
class Encoder {
 public:
  using Counter = CounterT;

  /// The timer's side.
  [[nodiscard]] hal::EncoderReading<Counter> read() {
    ++reads_;
    if (has(EncoderFault::kNoCapture)) return {.count = count_};
    return {.count = count_, .last_edge = last_edge_};
  }

  /// The test's side: host time is now this.
  void advance(base::Micros now) {
    while (host_ < now) {
      const base::Micros step = std::min(now - host_, base::Micros{kStep_us});
      disturb(step);
      follow(step);
      host_ += step;
    }
  }
  /// Position in edges (four to a line of the disc) by host time in seconds. The wires keep their present state, so a
  /// motion may be replaced while it runs if it continues from position().
  template <std::invocable<double> F>
  void set_motion(F position_edges) {
    motion_ = std::move(position_edges);
    position_ = motion_(seconds());
    line_ = static_cast<std::int64_t>(std::floor(position_));
    while (position_ < threshold(line_)) --line_;
    while (position_ >= threshold(line_ + 1)) ++line_;
    wires_ = wires_of(line_);
    seen_ = wires_;
  }
  /// On from the present position at this speed.
  void set_speed(double edges_per_s) {
    const double start_s = seconds();
    const double from = position_;
    motion_ = [=](double s) { return from + edges_per_s * (s - start_s); };
  }
  /// Distance of each of a line's four edges from its place, in edges: discs and detectors are not perfect.
  void set_edge_errors(std::array<double, 4> errors) { edge_errors_ = errors; }
  /// Sets the counter, for a wrap soon.
  void set_count(Counter count) { count_ = count; }

  void inject(EncoderFault fault, const EncoderFaultDetail& detail = {}) {
    const auto i = static_cast<std::size_t>(fault);
    active_[i] = true;
    details_[i] = detail;
    pulses_ = 0;
    noise_ = base::Random{detail.seed};
    if (fault == EncoderFault::kJump) count_ = static_cast<Counter>(count_ + static_cast<Counter>(detail.counts));
    if (fault == EncoderFault::kReset) count_ = 0;
  }
  void clear(EncoderFault fault) { active_[static_cast<std::size_t>(fault)] = false; }

  [[nodiscard]] double position() const { return position_; }
  /// The true number of edges passed, signed.
  [[nodiscard]] std::int64_t line() const { return line_; }
  [[nodiscard]] int reads() const { return reads_; }
  [[nodiscard]] int pulses_missed() const { return pulses_missed_; }
  [[nodiscard]] int disturbances() const { return disturbances_; }

 private:
  static constexpr std::int64_t kStep_us = 20;
  struct Wires {
    bool a = false;
    bool b = false;
  };

  [[nodiscard]] bool has(EncoderFault fault) const { return active_[static_cast<std::size_t>(fault)]; }
  [[nodiscard]] const EncoderFaultDetail& detail(EncoderFault fault) const {
    return details_[static_cast<std::size_t>(fault)];
  }
  [[nodiscard]] double seconds() const { return 1e-6 * static_cast<double>(host_.us); }
  [[nodiscard]] double threshold(std::int64_t line) const {
    return static_cast<double>(line) + edge_errors_[static_cast<std::size_t>(line & 3)];
  }
  /// A leads B when the position grows: A rises, B rises, A falls, B falls.
  [[nodiscard]] static Wires wires_of(std::int64_t line) {
    return {.a = (line & 3) == 1 || (line & 3) == 2, .b = (line & 3) >= 2};
  }

  /// All edges of one step; it is short, so the position between its ends is taken as a straight line.
  void follow(base::Micros step) {
    const double from = position_;
    const double to = motion_(seconds() + 1e-6 * static_cast<double>(step.us));
    const auto when = [&](double place) {
      const double share = std::clamp((place - from) / (to - from), 0.0, 1.0);
      return base::Micros{host_.us + static_cast<std::int64_t>(std::floor(share * static_cast<double>(step.us)))};
    };
    while (to >= threshold(line_ + 1)) {
      ++line_;
      show(wires_of(line_), when(threshold(line_)));
    }
    while (to < threshold(line_)) {
      const base::Micros at = when(threshold(line_));
      --line_;
      show(wires_of(line_), at);
    }
    position_ = to;
  }

  /// The wires have new levels; the timer sees them through the faults.
  void show(Wires wires, base::Micros at) {
    Wires visible = wires;
    if (has(EncoderFault::kMissedPulses)) {
      if (wires.a != wires_.a && !missing_ && ++pulses_ % (2 * detail(EncoderFault::kMissedPulses).every) == 0) {
        missing_ = true;
        ++pulses_missed_;
        returns_at_ = wires_.a;
      } else if (missing_ && wires.a == returns_at_) {
        missing_ = false;
      }
      if (missing_) visible.a = returns_at_;
    }
    wires_ = wires;
    if (has(EncoderFault::kStuck)) return;
    if (has(EncoderFault::kChannelDead)) {
      if (detail(EncoderFault::kChannelDead).channel == 0) visible.a = seen_.a;
      if (detail(EncoderFault::kChannelDead).channel == 1) visible.b = seen_.b;
    }
    if (visible.a != seen_.a) edge(visible.a == seen_.b ? -1 : 1, at);
    seen_.a = visible.a;
    if (visible.b != seen_.b) edge(visible.b == seen_.a ? 1 : -1, at);
    seen_.b = visible.b;
  }

  /// The counting table: A rising with B low is up, B rising with A high is up, and so on round.
  void edge(int direction, base::Micros at) {
    const int way = has(EncoderFault::kSwapped) ? -direction : direction;
    count_ = static_cast<Counter>(count_ + static_cast<Counter>(way));
    if (!has(EncoderFault::kCaptureStuck)) last_edge_ = at;
  }

  void disturb(base::Micros step) {
    const double step_s = 1e-6 * static_cast<double>(step.us);
    if (has(EncoderFault::kGlitches) && drawn(detail(EncoderFault::kGlitches).rate_Hz * step_s)) {
      const int direction = seen_.a == seen_.b ? 1 : -1;  // the direction in which a change of A would count
      edge(direction, host_);
      edge(-direction, host_);
    }
    if (has(EncoderFault::kSpurious) && drawn(detail(EncoderFault::kSpurious).rate_Hz * step_s)) {
      edge((noise_.next() & 1) != 0 ? 1 : -1, host_);
    }
  }
  bool drawn(double probability) {
    const bool hit = static_cast<double>(noise_.next()) < probability * 4294967296.0;
    disturbances_ += hit ? 1 : 0;
    return hit;
  }

  std::function<double(double)> motion_ = [](double) { return 0.0; };
  base::Micros host_{};
  double position_ = 0.0;
  std::int64_t line_ = 0;  ///< the last threshold passed
  std::array<double, 4> edge_errors_{};
  Wires wires_{};
  Wires seen_{};
  Counter count_ = 0;
  std::optional<base::Micros> last_edge_{};
  std::array<bool, static_cast<std::size_t>(EncoderFault::kCount)> active_{};
  std::array<EncoderFaultDetail, static_cast<std::size_t>(EncoderFault::kCount)> details_{};
  base::Random noise_{1};
  int reads_ = 0;
  int pulses_ = 0;
  int pulses_missed_ = 0;
  int disturbances_ = 0;
  bool missing_ = false;
  bool returns_at_ = false;
};

}  // namespace tetap::fakes
