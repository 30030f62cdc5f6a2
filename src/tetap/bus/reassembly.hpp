// SPDX-License-Identifier: Apache-2.0
// Samples that come in several frames: halves wait here for the rest, and are never mixed with those of another sample.
#pragma once

#include "tetap/bus/counters.hpp"
#include "tetap/sensor/sample.hpp"

#include <array>
#include <cstdint>

namespace tetap::bus {

class Reassembly {
 public:
  /// A sample of which some frames are there. missing: a bit per frame still to come; 0: the slot is free.
  struct Partial {
    sensor::Sample sample;
    std::uint8_t missing = 0;
    base::Micros since;
  };

  void power_on() {
    for (Partial& partial : partials_) partial.missing = 0;
    last_ = 0;
  }
  /// Halves older than `patience`, or from a time still to come, are given up and counted.
  void expire(base::Micros now, base::Micros patience, Counters& counters) {
    for (Partial& partial : partials_)
      if (partial.missing != 0 && (now - partial.since > patience || partial.since > now)) give_up(partial, counters);
  }
  /// Time has jumped: whatever is half belongs to another time.
  void discard(Counters& counters) {
    for (Partial& partial : partials_)
      if (partial.missing != 0) give_up(partial, counters);
  }

  /// The place where this frame's sample is put together: the half that waits for it, or a fresh one (the oldest makes
  /// room).
  Partial& slot(sensor::Sensor sensor, std::uint8_t instance, std::uint8_t sequence, std::uint8_t frames,
                base::Micros reference, Counters& counters);
  /// One frame of it is there; the whole sample goes to out.sample().
  template <class Out>
  void complete(Partial& partial, std::uint8_t frame_bit, std::uint32_t bits, Counters& counters, Out& out);

 private:
  static void give_up(Partial& partial, Counters& counters) {
    partial.missing = 0;
    ++counters.incomplete;
  }
  /// This place is the last one.
  [[nodiscard]] Partial& at(Partial& partial) {
    last_ = static_cast<std::uint8_t>(&partial - partials_.data());
    return partial;
  }
  static constexpr base::Micros kImuPatience{50'000};

  std::array<Partial, 8> partials_{};
  std::uint8_t last_ = 0;  ///< place of the last frame's sample
};

inline Reassembly::Partial& Reassembly::slot(sensor::Sensor sensor, std::uint8_t instance, std::uint8_t sequence,
                                             std::uint8_t frames, base::Micros reference, Counters& counters) {
  // Most frames continue the sample of the frame before; a new sample looks through all halves.
  Partial& last = partials_[last_];
  const bool fresh = sensor != sensor::Sensor::kImu || reference - last.since <= kImuPatience;
  if (last.missing != 0 && last.sample.sequence == sequence && last.sample.sensor == sensor &&
      last.sample.instance == instance && fresh)
    return last;
  Partial* chosen = &partials_[0];
  for (Partial& partial : partials_) {
    const sensor::Sample& s = partial.sample;
    const bool same = partial.missing != 0 && s.sensor == sensor && s.instance == instance;
    // IMU frames but one have no stamp, and their sequence comes round in 16 samples. A half that is four or more
    // samples behind has lost a frame for good: frames are not reordered that far. Such a half must not meet the frames
    // that come when its number comes again. An old half must not meet them either.
    if (same && sensor == sensor::Sensor::kImu) {
      const int behind = (sequence - s.sequence) & 0x0F;
      if ((behind >= 4 && behind <= 12) || reference - partial.since > kImuPatience) {
        give_up(partial, counters);
      } else if (behind == 0) {
        return at(partial);
      }
    } else if (same && s.sequence == sequence) {
      return at(partial);
    }
    const bool better = chosen->missing != 0 && (partial.missing == 0 || partial.since < chosen->since);
    if (better) chosen = &partial;
  }
  if (chosen->missing != 0) ++counters.incomplete;
  chosen->missing = frames;
  chosen->since = reference;
  chosen->sample.stamp = {};
  chosen->sample.sensor = sensor;
  chosen->sample.instance = instance;
  chosen->sample.sequence = sequence;
  chosen->sample.bits = 0;
  return at(*chosen);
}

template <class Out>
void Reassembly::complete(Partial& partial, std::uint8_t frame_bit, std::uint32_t bits, Counters& counters, Out& out) {
  if ((partial.missing & frame_bit) == 0) {
    ++counters.duplicate;
    return;
  }
  partial.missing = static_cast<std::uint8_t>(partial.missing & ~frame_bit);
  partial.sample.bits += bits;
  if (partial.missing == 0) out.sample(partial.sample);
}

}  // namespace tetap::bus
