// SPDX-License-Identifier: Apache-2.0
// An estimator that takes fewer kinds of samples than it could: what it does not take is in no image.
#pragma once

#include "tetap/estimators/context.hpp"
#include "tetap/estimators/estimate.hpp"

#include <concepts>

namespace tetap::estimators {

/// WithSensors<Inertial, ImuSample, GnssPosition>: of E's fuse() those for the payloads named.
template <class E, class... Payloads>
class WithSensors : public E {
 public:
  template <class Payload>
  requires(std::same_as<Payload, Payloads> || ...) Innovation
      fuse(const Payload& payload, base::Micros stamp, const Context& ctx) {
    return E::fuse(payload, stamp, ctx);
  }
};

}  // namespace tetap::estimators
