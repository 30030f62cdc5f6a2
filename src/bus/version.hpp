// SPDX-License-Identifier: Apache-2.0
// The version that a node publishes.
#pragma once

#include <cstdint>

namespace tetap::bus {

/// First 32 bits of the commit; 0: not built from a repository.
struct Version {
  std::uint32_t git = 0;
};

}  // namespace tetap::bus
