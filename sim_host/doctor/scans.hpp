// SPDX-License-Identifier: Apache-2.0
// The motion between two scans, by the scans alone, against wheels and gyroscope: a mirrored scanner turns the other
// way, a turned one goes ahead in another direction, and a late one fits a motion before its stamp.
#pragma once

#include "sim_host/doctor/detector.hpp"
#include "sim_host/doctor/moments.hpp"
#include "sim_host/doctor/moved.hpp"
#include "sim_host/doctor/robot_facts.hpp"
#include "tetap/bus/scan_assembly.hpp"
#include "tetap/slam/scan_match.hpp"

#include <array>
#include <complex>
#include <cstddef>
#include <deque>
#include <optional>

namespace tetap::doctor {

class ScanDetector : public Detector {
 public:
  ScanDetector(const RobotFacts& robot, const Windows& windows)
      : robot_(robot), scale_(wheel_scale(robot)), windows_(windows), match_(options()) {
    assembly_.power_on();
  }
  /// In_ScanHead or In_Scan.
  void scan_frame(const SeenFrame& seen);
  void sample(base::Micros time, const sensor::Sample& sample) override;
  void window(const Window& w) override;
  void finish(Findings& findings) override;

 private:
  static constexpr double kStep_s = 0.02;
  static constexpr int kAhead = 5;            ///< steps behind the stamp
  static constexpr std::size_t kDelays = 31;  ///< -0.1 to 0.5 s
  enum Reference : std::size_t { kByWheels, kByGyroscope, kReferences };
  using Turns = std::array<Moments<2>, kDelays>;  ///< by scans and by the reference [rad], a place a delay

  struct Pair {
    double from_s = 0, to_s = 0;
    std::complex<double> moved_m;  ///< along the scanner's axes
    double turn_rad = 0;
    bool placed = false;  ///< walls on two sides hold the scan
  };
  /// The delay that fits best, and the correlation there; nothing where the robot hardly turns.
  struct Fit {
    double late_s = 0, correlation = 0, at_stamp = 0, pairs = 0;
    double likelier = 0;  ///< logarithm of the likelihood over that of no delay
    [[nodiscard]] bool follows() const;
  };

  [[nodiscard]] static slam::ScanMatchOptions options();
  void scan(const sensor::Sample& sample);
  void roll(double time_s, const sensor::Sample& sample);
  void hold(const Pair& pair);
  [[nodiscard]] std::optional<Fit> fit(Reference reference) const;
  /// Code of the wheels, where the course by GNSS decides against them: the scans are right then.
  std::optional<Code> judge_sense(const std::optional<Fit>& wheels, const std::optional<Fit>& gyroscope,
                                  Findings& findings) const;
  /// Correlation of the wheels' turn with that of the course by GNSS; 0 where nothing is known.
  [[nodiscard]] double wheels_by_course() const;
  void judge_direction(bool mirrored, Findings& findings) const;
  void judge_delay(const std::optional<Fit>& by, const char* device, Devices uses, Findings& findings) const;
  /// Direction in which the robot drives ahead by its scans, from the stated one; 0 where nothing is known.
  [[nodiscard]] double direction_rad(bool mirrored) const;

  const RobotFacts& robot_;
  WheelScale scale_;
  const Windows& windows_;
  bus::ScanAssembly assembly_;
  bus::Counters counters_;
  slam::ScanMatch<sensor::Scans::kMostBeams, 1> match_;
  slam::ScanMatch<sensor::Scans::kMostBeams, 1>::Keyframes keyframe_;
  double keyframe_s_ = 0;
  Moved wheels_, gyroscope_;
  std::optional<sensor::WheelCounts> counts_;
  double wheels_s_ = 0;
  std::deque<Pair> waiting_;
  std::array<Turns, kReferences> turns_;
  std::optional<Window> before_;
  Moments<2> course_;             ///< turn rate by the wheels and by the course of the GNSS velocity [rad/s]
  std::complex<double> ahead_m_;  ///< sum of what the scans move while the wheels drive straight ahead
  double straight_m_ = 0;         ///< sum of the lengths of it
  int straights_ = 0;
};

}  // namespace tetap::doctor
