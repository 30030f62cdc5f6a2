// SPDX-License-Identifier: Apache-2.0
// What a log is of, from its beginning: the id base of its node, and the hash of that node's parameters.
#pragma once

#include "sim_host/replay/result.hpp"

#include <string>

namespace tetap::page {

/// JSON {base, config or null, inputs: [kinds of sensors]}. The node's block of ids is that in which a node speaks,
/// else the one with the most frames of eight bytes. Fails as the log does, and for a log without a data frame.
sim::Result<std::string> identity_of_log();

}  // namespace tetap::page
