// SPDX-License-Identifier: Apache-2.0
// Whether a robot's image has the code of tags and guards: where it names it, `using Estimators =
// node::WithBusProtection<node::Estimators<...>>`.
#pragma once

#include "tetap/bus/protection.hpp"
#include "tetap/param/parameters.hpp"

#include <type_traits>

namespace tetap::node {

template <class Estimators>
struct WithBusProtection : Estimators {
  static constexpr bool kBusProtection = true;
};

template <class Estimators>
inline constexpr bool kHasBusProtection = requires {
  requires Estimators::kBusProtection;
};

template <class Estimators>
using BusProtection = std::conditional_t<kHasBusProtection<Estimators>, bus::Protection, bus::NoProtection>;

/// Whether an image of this robot has what these parameters ask for.
template <class Estimators>
[[nodiscard]] constexpr bool has_protection_for(const param::Parameters& parameters) {
  const bool asks = parameters.bus.commands == param::CommandAccess::kAuthenticated || parameters.bus.guard != 0;
  return !asks || kHasBusProtection<Estimators>;
}

}  // namespace tetap::node
