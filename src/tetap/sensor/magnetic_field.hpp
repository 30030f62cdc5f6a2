// SPDX-License-Identifier: Apache-2.0
// A magnetometer's sample as the field in body axes: calibrated, then turned as the sensor is mounted.
#pragma once

#include "tetap/param/parameters.hpp"
#include "tetap/sensor/row_major.hpp"
#include "tetap/sensor/samples.hpp"

namespace tetap::sensor {

[[nodiscard]] [[gnu::noinline]] inline filter::Vector3 field_b_uT(const MagneticFlux& sample,
                                                                  const param::MagneticParameters& n) {
  const filter::Vector3 free{sample.flux_b_uT[0] - n.hard_iron_uT[0], sample.flux_b_uT[1] - n.hard_iron_uT[1],
                             sample.flux_b_uT[2] - n.hard_iron_uT[2]};
  return times(n.mounting_bs, times(n.soft_iron, free));
}

}  // namespace tetap::sensor
