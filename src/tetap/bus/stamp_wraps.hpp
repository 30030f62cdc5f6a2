// SPDX-License-Identifier: Apache-2.0
// Whole wraps in the delay of a sample. A stamp of 20 bits repeats after 1.05 s, so a sample that was held for about as
// long looks fresh. Stamp and sequence of a sensor advance together, in steps of its period: they reveal the wraps.
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/base/reinitialise.hpp"
#include "tetap/checks/persistence.hpp"
#include "tetap/sensor/sample.hpp"

#include <array>
#include <cstdint>

namespace tetap::bus {

class StampWraps {
 public:
  void power_on() { base::reinitialise(*this); }

  /// Stamp of a sample that comes at `now` and whose stamp was extended around that time: the same, or whole wraps
  /// before it. A hold begins with silence, so a sensor that never pauses costs a comparison. Small rather than fast.
  [[nodiscard, gnu::cold, gnu::noinline]] base::Micros place(const sensor::Sample& sample, base::Micros now) {
    Stream& s = streams_[static_cast<std::size_t>(sample.sensor)];
    const bool silent = now - s.arrived > kSilence;
    if (silent && s.arrived.us == 0) s.instance = sample.instance;
    if (s.instance != sample.instance) return sample.stamp;
    const base::Micros stamp =
        s.held_at.us > 0 || (silent && s.arrived.us > 0) ? resolve(s, sample, now) : sample.stamp;
    const base::Micros step = stamp - s.stamp;
    const base::Micros most = s.period_us > 0 ? base::Micros{2 * s.period_us} : kLongest;
    if (((sample.sequence - s.sequence) & 0x0F) == 1 && step.us > 0 && step < most) {
      const auto step_us = static_cast<std::int32_t>(step.us);
      s.period_us += s.period_us > 0 ? (step_us - s.period_us) / 8 : step_us;
    }
    s.stamp = stamp;
    s.note_chain(sample.sequence, step.us <= 0);
    s.arrived = now;
    return stamp;
  }
  /// Two senders number the samples of this sensor: two chains of its sequence cross, and their stamps interleave.
  [[nodiscard]] bool two_senders(const sensor::Sample& sample) const {
    const Stream& s = streams_[static_cast<std::size_t>(sample.sensor)];
    return s.crosses() && s.instance == sample.instance;
  }
  /// The same of a sample that comes at no fixed rate: sightings and commands. Its sequence does not count time, so it
  /// is placed as the sample of another sensor was that came just before.
  [[nodiscard]] base::Micros place_beside(const sensor::Sample& sample, base::Micros now) const {
    return sample.stamp - base::Micros{checks::recent(held_at_, now, kAround) ? wraps_ * kWrap_us : 0};
  }
  static constexpr auto members(auto& self) {
    return base::members(base::in_turns(self.streams_), base::in_turns(self.held_at_), base::in_turns(self.held_since_),
                         base::in_turns(self.wraps_));
  }

 private:
  static constexpr std::int32_t kWrap_us = 1 << 20;
  static constexpr base::Micros kSilence{kWrap_us / 2 - 20'000};  ///< a longer hold may be taken for no hold
  static constexpr base::Micros kAround{100'000};                 ///< a sighting so soon after a held sample was held
  static constexpr base::Micros kLongest{3'000'000};              ///< longest hold that is looked for
  static constexpr base::Micros kMost{60'000'000};                ///< a hold that lasts longer was none
  static constexpr std::int32_t kJitter_us = 5'000;

  /// One sensor of a kind: the first that speaks.
  struct Stream {
    base::Micros stamp, arrived;       ///< last stamp, and when it came; 0: none
    base::Micros held_stamp, held_at;  ///< the same of the last held sample
    std::int32_t period_us = 0;
    std::uint8_t sequence = 0, held_sequence = 0, instance = 0;
    std::uint8_t chains = 0;  ///< the last sequence but one, and sixteen times the crossings of two chains of late

    [[nodiscard]] bool crosses() const { return chains >> 4U == kMostCrossings; }
    /// A sample goes on with the last one, or with the last but one, where two chains cross. One crossing is worth
    /// three samples in order. A sample no younger than the last one came late or beside it, and shows no chain.
    void note_chain(std::uint8_t next, bool late) {
      const auto follows = [next](unsigned of) { return ((next - of) & 0x0FU) == 1; };
      unsigned crossings = chains >> 4U;
      if (late) {
        crossings = 0;
      } else if (follows(sequence)) {
        crossings -= crossings > 0 ? 1U : 0U;
      } else if (follows(chains)) {
        crossings = crossings + 3 < kMostCrossings ? crossings + 3 : kMostCrossings;
      }
      chains = static_cast<std::uint8_t>(crossings << 4U | (sequence & 0x0FU));
      sequence = next;
    }
    static constexpr unsigned kMostCrossings = 15;
  };

  /// A span of as many periods as the sequence counts: `least` to eight, or so modulo 16.
  [[nodiscard, gnu::cold, gnu::noinline]] static bool fits(base::Micros span, int steps, std::int32_t period_us,
                                                           std::int32_t least) {
    constexpr std::int64_t kFarthest = 2'000'000'000;
    if (span.us > kFarthest || span.us < -kFarthest) return false;
    const auto span_us = static_cast<std::int32_t>(span.us);
    const std::int32_t back = span_us < 0 ? -1 : 1, n = back * ((back * span_us + period_us / 2) / period_us);
    const std::int32_t off_us = back * (span_us - n * period_us);
    if (off_us >= kJitter_us || -off_us >= kJitter_us || ((n - steps) & 0x0F) != 0) return false;
    return least == kModulo || (n >= least && n <= 8);
  }
  static constexpr std::int32_t kModulo = -100;

  [[nodiscard]] base::Micros resolve(Stream& s, const sensor::Sample& sample, base::Micros now) {
    if (!checks::recent(held_at_, now, kLongest)) held_since_ = now;
    const bool lately = checks::recent(s.held_at, now, kLongest);
    if (!lately) s.held_at = {};
    if (s.period_us == 0 || now - held_since_ > kMost) return sample.stamp;
    if (!lately && fits(sample.stamp - s.stamp, sample.sequence - s.sequence, s.period_us, kModulo))
      return sample.stamp;
    // A held sample follows the last one that was held, or begins a hold right after the last of all.
    const base::Micros last = lately ? s.held_stamp : s.stamp;
    const int steps = sample.sequence - (lately ? s.held_sequence : s.sequence);
    base::Micros stamp = sample.stamp;
    for (std::int32_t wraps = 1; wraps <= kLongest.us / kWrap_us; ++wraps) {
      stamp = stamp - base::Micros{kWrap_us};
      if (!fits(stamp - last, steps, s.period_us, lately ? -2 : 1)) continue;
      s.held_at = held_at_ = now;
      s.held_stamp = stamp;
      s.held_sequence = sample.sequence;
      wraps_ = wraps;
      return stamp;
    }
    return sample.stamp;
  }

  std::array<Stream, 10> streams_{};
  base::Micros held_at_;     ///< arrival of the last held sample of any sensor; 0: none
  base::Micros held_since_;  ///< arrival of the first of those that follow each other
  std::int32_t wraps_ = 0;   ///< wraps of the last held sample
};

}  // namespace tetap::bus
