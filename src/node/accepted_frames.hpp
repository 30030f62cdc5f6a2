// SPDX-License-Identifier: Apache-2.0
// The frames that a node receives: its block of 64 ids, with inputs and own outputs. The own outputs show a second node
// of the same ids. A robot that makes a map receives the block behind it, too. A port's acceptance filter is made of
// this.
#pragma once

#include "bus/messages.hpp"
#include "hal/can_bus.hpp"
#include "param/parameters.hpp"

#include <cstdint>

namespace tetap::node {

/// can_base is a multiple of 64; that of a robot that makes a map, of 128.
template <class Estimators>
[[nodiscard]] constexpr hal::Acceptance accepted_by(const param::Parameters& parameters) {
  constexpr std::uint32_t kIds = Estimators::kMakesMap ? 2 * bus::kBlock : bus::kBlock;
  return {.id = parameters.can_base, .mask = 0x7FFU & ~(kIds - 1U)};
}

}  // namespace tetap::node
