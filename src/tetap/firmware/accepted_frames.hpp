// SPDX-License-Identifier: Apache-2.0
// The frames that a node receives: its block of 64 ids, with inputs and own outputs. The own outputs show a second node
// of the same ids. A robot that makes a map or takes scans or images receives the block behind it, too. A port's
// acceptance filter is made of this.
#pragma once

#include "hal/can_bus.hpp"
#include "tetap/bus/messages.hpp"
#include "tetap/firmware/canopen/ids.hpp"
#include "tetap/param/parameters.hpp"

#include <cstdint>

namespace tetap::firmware {

/// can_base is a multiple of 64; that of a robot that makes a map or takes scans or images, of 128.
[[nodiscard]] constexpr hal::Acceptance accepted_by(bool needs_map_ids, const param::Parameters& parameters) {
  const std::uint32_t ids = needs_map_ids ? 2 * bus::kBlock : bus::kBlock;
  return {.id = parameters.can_base, .mask = 0x7FFU & ~(ids - 1U)};
}

template <class Estimators>
[[nodiscard]] constexpr hal::Acceptance accepted_by(const param::Parameters& parameters) {
  return accepted_by(Estimators::kNeedsMapIds, parameters);
}

/// The same with the SDO requests to this node. A filter has one identifier and one mask: it takes others, too, which
/// the firmware passes over.
[[nodiscard]] constexpr hal::Acceptance with_requests(hal::Acceptance accepted, std::uint8_t node_id) {
  if (node_id != 0) accepted.mask &= ~(accepted.id ^ (canopen::kRequestIds + node_id));
  return accepted;
}

}  // namespace tetap::firmware
