// SPDX-License-Identifier: Apache-2.0
// Horizontal forces against the motion of a vehicle on the ground: forward it feels its acceleration a, to the left
// v w in a curve. The eight ways to place two axes on two others are tried; the one stated has to fit best.
#pragma once

#include "sim_host/doctor/detector.hpp"
#include "sim_host/doctor/moments.hpp"
#include "sim_host/doctor/robot_facts.hpp"
#include "sim_host/doctor/turn_ratio.hpp"

#include <optional>

namespace tetap::doctor {

class ForwardDetector : public Detector {
 public:
  explicit ForwardDetector(const RobotFacts& robot) : robot_(robot) {}

  void window(const Window& w) override;
  void finish(Findings& findings) override;
  /// Correlation of the force ahead with the acceleration, and of the force to the left with speed times turn rate; 0
  /// where nothing is known. Without a mounting, ahead is where the force follows the acceleration.
  struct Agreement {
    double ahead = 0, left = 0;
    const char* device = "";
    Devices uses = kNoDevice;
    std::optional<TurnRatio> turn{};  ///< turn by the gyroscope over that of the force to the left
    bool aside =
        false;  ///< the force fits axes turned about up, neither as stated nor backwards, better than one reversed
  };
  [[nodiscard]] Agreement agreement() const;

 private:
  /// One source of the speed.
  struct Source {
    std::optional<double> speed_mps;  ///< in the window before
    Moments<4> moments;               ///< force forward and left, acceleration, speed times turn rate
  };
  void add(Source& source, std::optional<double> speed_mps, const Window& w);
  /// Agreement of level axes whose heading in the robot is not known.
  static void add_seen(const Moments<4>& m, Agreement& found);
  bool judge_backwards(Findings& findings) const;
  void judge(const Source& source, const char* name, Devices device, Findings& findings) const;

  const RobotFacts& robot_;
  std::optional<Window> before_;
  Source wheels_, gnss_;
};

}  // namespace tetap::doctor
