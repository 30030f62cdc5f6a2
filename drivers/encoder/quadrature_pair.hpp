// SPDX-License-Identifier: Apache-2.0
// Two encoders, left and right, read together: counts and speeds in the form that estimators take.
#pragma once

#include "drivers/encoder/quadrature.hpp"
#include "tetap/sensor/samples.hpp"

namespace tetap::drivers {

template <hal::EncoderCounter Left, hal::EncoderCounter Right = Left>
class QuadraturePair {
 public:
  constexpr QuadraturePair(Left& left, const QuadratureSettings& left_settings, Right& right,
                           const QuadratureSettings& right_settings)
      : left_port_(&left), right_port_(&right), left_(left_settings), right_(right_settings) {}

  constexpr void poll(base::Micros now) {
    left_.update(left_port_->read(), now);
    right_.update(right_port_->read(), now);
  }

  /// The low 16 bits of the totals: only differences mean anything.
  [[nodiscard]] constexpr sensor::WheelCounts counts() const {
    return {static_cast<std::uint16_t>(left_.counts()), static_cast<std::uint16_t>(right_.counts())};
  }

  /// Metres of ground per count, each wheel its own.
  [[nodiscard]] constexpr sensor::WheelSpeeds speeds(float left_m, float right_m) const {
    return {left_.counts_per_s() * left_m, right_.counts_per_s() * right_m};
  }

  [[nodiscard]] constexpr const auto& left() const { return left_; }
  [[nodiscard]] constexpr const auto& right() const { return right_; }

 private:
  Left* left_port_;
  Right* right_port_;
  Quadrature<typename Left::Counter> left_;
  Quadrature<typename Right::Counter> right_;
};

}  // namespace tetap::drivers
