// SPDX-License-Identifier: Apache-2.0
// An estimator that takes fewer kinds of samples than it could: what it does not take is in no image.
#pragma once

#include "app/context.hpp"
#include "app/estimate.hpp"

#include <concepts>

namespace tetap::app {

/// Only<Inertial, ImuSample, GnssPosition>: of E's fuse() those for the payloads named.
template <class E, class... Payloads>
class Only : public E {
 public:
  template <class Payload>
  requires(std::same_as<Payload, Payloads> || ...) Innovation
      fuse(const Payload& payload, base::Micros stamp, const Context& with) {
    return E::fuse(payload, stamp, with);
  }
};

}  // namespace tetap::app
