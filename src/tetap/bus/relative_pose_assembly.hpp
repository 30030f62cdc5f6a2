// SPDX-License-Identifier: Apache-2.0
// In_RelativePose and the two pages of In_RelativePoseStd as a sample. They come in their order from one sender. A
// frame that is not the next one ends what was begun, so two displacements are never mixed.
#pragma once

#include "tetap/base/time.hpp"
#include "tetap/bus/codec.hpp"
#include "tetap/bus/counters.hpp"
#include "tetap/bus/decoder.hpp"
#include "tetap/bus/messages.hpp"
#include "tetap/sensor/sample.hpp"

#include <cstdint>

namespace tetap::bus {

class RelativePoseAssembly {
 public:
  void power_on() { next_ = 0; }
  /// At each tick: a half older than `patience`, or from a time still to come, is given up and counted.
  void expire(base::Micros now, base::Micros patience, Counters& counters) {
    if (next_ != 0 && (now - since_ > patience || since_ > now)) give_up(counters);
  }
  /// Time has jumped: a half belongs to another time.
  void discard(Counters& counters) {
    if (next_ != 0) give_up(counters);
  }
  [[nodiscard]] static constexpr bool takes(std::uint8_t offset) {
    return offset == InRelativePose::kOffset || offset == InRelativePoseStdX::kOffset;
  }
  /// A frame of a displacement, with its CRC; a whole one goes to out.sample().
  template <class Out>
  void on_frame(std::uint8_t offset, const base::CanFrame& frame, std::uint32_t bits, base::Micros reference,
                Counters& counters, Out&& out) {
    const auto bytes = payload(frame);
    if (bytes.size() != 8) return void(++counters.malformed);
    if (offset == InRelativePose::kOffset) return begin(*decode<InRelativePose>(bytes), bits, reference, counters);
    sensor::RelativePose& r = sample_.payload.relative;
    bool good = false;
    if (const auto x = decode<InRelativePoseStdX>(bytes)) {
      if (!follows(1, x->seq, x->inst, counters)) return;
      r.sigma[0] = sigma(x->std_x_m, r.kStepsPerMetre);
      r.x_m = base::is_nan(x->std_x_m) ? 0.0F : x->x_m;
      r.correlation[0] = correlation(x->corr_xy, r);
      r.correlation[1] = correlation(x->corr_x_yaw, r);
      good = all_finite(r.x_m, x->corr_xy, x->corr_x_yaw);
    } else if (const auto y = decode<InRelativePoseStdY>(bytes)) {
      if (!follows(2, y->seq, y->inst, counters)) return;
      r.sigma[1] = sigma(y->std_y_m, r.kStepsPerMetre);
      r.y_m = base::is_nan(y->std_y_m) ? 0.0F : y->y_m;
      r.sigma[2] = sigma(y->std_yaw_rad, r.kStepsPerRadian);
      r.correlation[2] = correlation(y->corr_y_yaw, r);
      good = all_finite(r.y_m, y->corr_y_yaw) && !r.unknown(2);
    }
    if (!good) {
      ++counters.out_of_range;
      next_ = 0;
      return;
    }
    sample_.bits += bits;
    next_ = (next_ + 1) % kFrames;
    if (next_ == 0) out.sample(sample_);
  }

 private:
  static constexpr int kFrames = 3;

  /// Steps of the bus, of which the float is a fraction; kFree for NaN.
  [[nodiscard]] static std::uint16_t sigma(float value, float per_unit) {
    if (base::is_nan(value)) return sensor::RelativePose::kFree;
    return static_cast<std::uint16_t>(value * per_unit + 0.5F);
  }
  [[nodiscard]] static std::int16_t correlation(float value, const sensor::RelativePose& of) {
    if (base::is_nan(value)) return 0;
    const float steps = value * of.kCorrelationSteps;
    return static_cast<std::int16_t>(steps < 0.0F ? steps - 0.5F : steps + 0.5F);
  }
  void give_up(Counters& counters) {
    next_ = 0;
    ++counters.incomplete;
  }
  void begin(const InRelativePose& pose, std::uint32_t bits, base::Micros reference, Counters& counters) {
    if (next_ != 0) give_up(counters);
    if (pose.interval_us == 0 || !base::is_finite(pose.yaw_rad)) return void(++counters.out_of_range);
    sample_ = stamped(pose, sensor::Sensor::kRelativePose, bits, reference);
    sample_.payload.relative = {.yaw_rad = pose.yaw_rad, .interval_us = pose.interval_us};
    since_ = reference;
    next_ = 1;
  }
  /// Whether the page continues what was begun; else that is given up, and the page is counted.
  [[nodiscard]] bool follows(int page, std::uint8_t sequence, std::uint8_t instance, Counters& counters) {
    if (next_ == page && sample_.sequence == sequence && sample_.instance == instance) return true;
    give_up(counters);
    return false;
  }

  sensor::Sample sample_;
  base::Micros since_;
  int next_ = 0;  ///< frame that comes next; 0: a new displacement
};

/// For robots none of whose estimators takes displacements between stamps: no memory.
struct NoRelativePoses {
  static void power_on() {}
  static void expire(base::Micros, base::Micros, Counters&) {}
  static void discard(Counters&) {}
};

}  // namespace tetap::bus
