// SPDX-License-Identifier: Apache-2.0
// The size of the turn: gyroscope, wheels over their track, and course or magnetic field as the third. Two devices
// show that one is wrong, the third shows which.
#pragma once

#include "sim_host/doctor/axes.hpp"
#include "sim_host/doctor/detector.hpp"

#include <optional>

namespace tetap::doctor {

class TurnScaleDetector : public Detector {
 public:
  explicit TurnScaleDetector(const AxisWitnesses& witnesses) : by_(witnesses) {}
  void window(const Window& w) override;
  void finish(Findings& findings) override;

 private:
  [[nodiscard]] std::optional<TurnRatio> by_field() const;
  void name_gyroscope(const TurnRatio& ratio, std::optional<Code> beside, Findings& findings) const;
  void name_track(const TurnRatio& ratio, const TurnRatio* third, Findings& findings) const;

  AxisWitnesses by_;
  double share_sum_ = 0, windows_ = 0;  ///< share of the IMU's samples that came
};

}  // namespace tetap::doctor
