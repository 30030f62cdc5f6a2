// SPDX-License-Identifier: Apache-2.0
// The version that a node publishes.
#pragma once

#include <cstdint>

namespace tetap::bus {

struct Version {
  std::uint32_t git = 0;  ///< first 28 bits of the commit; 0: not built from a repository
  bool dirty = false;     ///< the tree differed from that commit
};

}  // namespace tetap::bus
