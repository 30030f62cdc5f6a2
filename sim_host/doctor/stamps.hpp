// SPDX-License-Identifier: Apache-2.0
// Stamps against the time of arrival: their unit, and whose clock they come from.
#pragma once

#include "sim_host/doctor/bus_time.hpp"
#include "sim_host/doctor/detector.hpp"
#include "sim_host/doctor/header.hpp"
#include "sim_host/doctor/moments.hpp"

#include <array>
#include <string>
#include <vector>

namespace tetap::doctor {

class StampDetector : public Detector {
 public:
  /// `window`: how old a sample may be and still be fused.
  StampDetector(ClockSource source, base::Micros window)
      : source_(source), window_us_(static_cast<double>(window.us)) {}

  void frame(const SeenFrame& seen) override;
  void finish(Findings& findings) override;

 private:
  enum Unit : std::uint8_t { kMicroseconds, kMilliseconds, kSeconds, kOther };
  struct Stream {
    std::string message;
    bool begun = false;
    base::Micros anchor, last;
    std::uint32_t anchor_stamp = 0;
    std::array<int, 4> votes{};  ///< by Unit
    double intervals_us = 0, elapsed_us = 0;
    // Age on arrival: stamps wrap after 1.05 s, ages are followed through the wraps.
    double age_us = 0, first_age_us = 0;
    std::int64_t block_us = 0;
    double block_sum_us = 0;
    int block_count = 0;
    Moments<2> blocks;  ///< seconds, age in us: means of blocks of 5 s
  };
  /// The age of a device's samples over the log.
  struct Age {
    std::string message;
    double mean_us, drift_ppm, span_s, scatter_us;
  };
  static void vote(Stream& s, base::Micros time, std::uint32_t stamp);
  static void follow_age(Stream& s, base::Micros time, std::uint32_t stamp);
  static void close_block(Stream& s);
  static bool name_unit(const Stream& s, Findings& findings);
  [[nodiscard]] static Age age_of(const Stream& s);
  [[nodiscard]] bool too_old_or_ahead(const Age& age) const;
  void judge_ages(const std::vector<Age>& ages, Findings& findings) const;
  void judge_drifts(const std::vector<Age>& ages, Findings& findings) const;

  ClockSource source_;
  double window_us_;
  std::array<Stream, kStreams> streams_;
};

}  // namespace tetap::doctor
