// SPDX-License-Identifier: Apache-2.0
// In_Closure, four pages of one sequence number, as a sample. The pages come in their order from one sender. A page
// that is not the next one ends what was begun, so pages of two closures are never mixed.
#pragma once

#include "tetap/base/time.hpp"
#include "tetap/bus/codec.hpp"
#include "tetap/bus/counters.hpp"
#include "tetap/bus/decoder.hpp"
#include "tetap/bus/messages.hpp"
#include "tetap/sensor/sample.hpp"

#include <cstdint>

namespace tetap::bus {

class ClosureAssembly {
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
  [[nodiscard]] static constexpr bool takes(std::uint8_t offset) { return offset == InClosureFrames::kOffset; }
  /// A frame of In_Closure; a whole closure goes to out.sample().
  template <class Out>
  void on_frame(const base::CanFrame& frame, base::Micros reference, Counters& counters, Out&& out) {
    const auto bytes = payload(frame);
    if (bytes.size() != 8) return void(++counters.malformed);
    if (const auto frames = decode<InClosureFrames>(bytes)) return begin(*frames, reference, counters, bits(frame));
    bool good = false;
    if (const auto pose = decode<InClosurePose>(bytes)) {
      if (!follows(1, pose->seq, counters)) return;
      good = all_finite(pose->x_m, pose->y_m, pose->yaw_rad);
      if (good) set_pose(*pose);
    } else if (const auto std = decode<InClosureStd>(bytes)) {
      if (!follows(2, std->seq, counters)) return;
      good = std->std_x_m > 0.0F && std->std_y_m > 0.0F && std->std_yaw_rad > 0.0F;  // false for NaN
      if (good) set_sigmas(*std);
    } else if (const auto corr = decode<InClosureCorr>(bytes)) {
      if (!follows(3, corr->seq, counters)) return;
      good = is_correlation(corr->corr_xy) && is_correlation(corr->corr_x_yaw) && is_correlation(corr->corr_y_yaw);
      if (good) set_correlations(*corr);
    }
    if (!good) {
      ++counters.out_of_range;
      next_ = 0;
      return;
    }
    sample_.bits += bits(frame);
    next_ = (next_ + 1) % kPages;
    if (next_ == 0) out.sample(sample_);
  }

 private:
  static constexpr int kPages = 4;

  [[nodiscard]] static std::uint32_t bits(const base::CanFrame& frame) {
    return frame_crc(InClosureFrames::kOffset, frame);
  }
  [[nodiscard]] static bool is_correlation(float x) { return x < 1.0F && x > -1.0F; }  // false for NaN
  /// The integer on the bus, of which the float is a fraction: below 2^21, so the float has it.
  [[nodiscard]] static std::int32_t steps(float value, std::int64_t per_unit) {
    const float scaled = value * static_cast<float>(per_unit);
    return static_cast<std::int32_t>(scaled < 0.0F ? scaled - 0.5F : scaled + 0.5F);
  }
  void give_up(Counters& counters) {
    next_ = 0;
    ++counters.incomplete;
  }
  void begin(const InClosureFrames& frames, base::Micros reference, Counters& counters, std::uint32_t bits) {
    if (next_ != 0) give_up(counters);
    if (frames.from_id == frames.to_id) return void(++counters.out_of_range);
    sample_ = {};
    sample_.stamp = base::extend(frames.stamp_us, 20, reference);
    sample_.sensor = sensor::Sensor::kClosure;
    sample_.sequence = frames.seq;
    sample_.detail = static_cast<std::uint8_t>(frames.to_id);
    sample_.bits = bits;
    sample_.payload.closure = {.from = frames.from_id, .to = frames.to_id};
    since_ = reference;
    next_ = 1;
  }
  /// Whether the page continues what was begun; else that is given up, and the page is counted.
  [[nodiscard]] bool follows(int page, std::uint8_t sequence, Counters& counters) {
    if (next_ == page && sample_.sequence == sequence) return true;
    give_up(counters);
    return false;
  }
  void set_pose(const InClosurePose& pose) {
    sensor::LoopClosure& closure = sample_.payload.closure;
    closure.x = steps(pose.x_m, closure.kStepsPerMetre);
    closure.y = steps(pose.y_m, closure.kStepsPerMetre);
    closure.yaw = steps(pose.yaw_rad, closure.kStepsPerRadian);
  }
  void set_sigmas(const InClosureStd& std) {
    sensor::LoopClosure& closure = sample_.payload.closure;
    closure.sigmas =
        closure.pack(steps(std.std_x_m, closure.kStepsPerMetre), steps(std.std_y_m, closure.kStepsPerMetre),
                     steps(std.std_yaw_rad, closure.kSigmaStepsPerRadian));
  }
  void set_correlations(const InClosureCorr& corr) {
    sensor::LoopClosure& closure = sample_.payload.closure;
    closure.correlations =
        closure.pack(steps(corr.corr_xy, closure.kCorrelationSteps), steps(corr.corr_x_yaw, closure.kCorrelationSteps),
                     steps(corr.corr_y_yaw, closure.kCorrelationSteps));
  }

  sensor::Sample sample_;
  base::Micros since_;
  int next_ = 0;  ///< page that comes next; 0: a new closure
};

/// For robots none of whose estimators takes closures: no memory.
struct NoClosures {
  static void power_on() {}
  static void expire(base::Micros, base::Micros, Counters&) {}
  static void discard(Counters&) {}
};

}  // namespace tetap::bus
