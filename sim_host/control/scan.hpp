// SPDX-License-Identifier: Apache-2.0
// Nodes on a bus, found by what they send: a block whose Est_Epoch goes on in time is a node's.
#pragma once

#include "sim_host/control/parameter_client.hpp"

#include <cstdint>
#include <optional>
#include <vector>

namespace tetap::sim {

struct FoundNode {
  std::uint32_t can_base = 0;
  std::optional<bus::EstVersion> version;
  bool parameters = false;  ///< it answers Cmd_Param
};

/// Listens for as long as a node takes to send its version, then asks the nodes it found, and nobody else.
[[nodiscard]] std::vector<FoundNode> scan(const ParameterClient::Send& send, const ParameterClient::Receive& receive,
                                          const ParameterClient::Clock& now);

}  // namespace tetap::sim
