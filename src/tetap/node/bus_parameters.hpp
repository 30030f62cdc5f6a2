// SPDX-License-Identifier: Apache-2.0
// Whether a robot's parameters can be read and changed over the bus: where it names it, `using Estimators =
// node::WithBusParameters<node::Estimators<...>>`. It costs two more copies of param::Parameters in RAM.
#pragma once

#include "tetap/bus/parameter_commands.hpp"
#include "tetap/node/bus_protection.hpp"

#include <type_traits>

namespace tetap::node {

template <class Estimators>
struct WithBusParameters : Estimators {
  static constexpr bool kBusParameters = true;
  static constexpr bool kNeedsMapIds = true;  ///< Cmd_Param and Est_Param have two of them
  /// A first key may come over the bus; a host, which can judge tags for every robot, takes none that its robot
  /// refuses.
  static constexpr bool kTakesKey = kHasBusProtection<Estimators>;
};

template <class Estimators>
inline constexpr bool kHasBusParameters = requires {
  requires Estimators::kBusParameters;
};

template <class Estimators>
using BusParameters =
    std::conditional_t<kHasBusParameters<Estimators>, bus::ParameterCommands, bus::NoParameterCommands>;

}  // namespace tetap::node
