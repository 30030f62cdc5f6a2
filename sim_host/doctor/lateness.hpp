// SPDX-License-Identifier: Apache-2.0
// The speed by GNSS against the wheels' speed at each time up to two seconds before the stamp: where the receiver's
// content is older than its stamp, an earlier speed fits better.
#pragma once

#include "sim_host/doctor/detector.hpp"
#include "sim_host/doctor/moments.hpp"
#include "sim_host/doctor/path.hpp"

#include <array>
#include <cstddef>
#include <deque>
#include <optional>
#include <string>

namespace tetap::doctor {

class LatenessDetector : public Detector {
 public:
  /// `path` sees each sample before this detector does.
  explicit LatenessDetector(const PathDetector& path) : path_(path) {}
  void sample(base::Micros time, const sensor::Sample& sample) override;
  void finish(Findings& findings) override;
  /// The question that the log leaves open, in words; nothing where it shows delays or has no receiver.
  [[nodiscard]] std::optional<std::string> untold() const;

 private:
  static constexpr double kStep_s = 0.05;
  static constexpr int kAhead = 2;            ///< steps behind the stamp
  static constexpr std::size_t kDelays = 43;  ///< -0.1 to 2 s
  struct Rolled {
    double time_s, way_m;
  };
  struct Speed {
    double time_s, speed_mps;
  };
  void hold_against(const Speed& gnss);
  /// Mean speed of the wheels over 0.2 s about a time; nothing where the way is not known.
  [[nodiscard]] std::optional<double> wheels_mps(double time_s) const;
  [[nodiscard]] std::optional<double> way_m(double time_s) const;
  void count_change(double speed_mps);
  [[nodiscard]] bool tells() const;

  const PathDetector& path_;
  std::deque<Rolled> rolled_;
  std::deque<Speed> waiting_;
  std::array<Moments<2>, kDelays> speeds_;  ///< by GNSS and by wheels [m/s], a place a delay
  int changes_ = 0;                         ///< changes of speed by 1 m/s
  std::optional<double> first_s_;           ///< arrival of the first velocity by GNSS
  double last_s_ = 0;                       ///< arrival of the last one
  int velocities_ = 0;
  double stamped_s_ = 0;  ///< stamp of the last sample of the wheels
  double level_mps_ = 0;
  bool level_known_ = false, rising_ = true, receiver_ = false;
};

}  // namespace tetap::doctor
