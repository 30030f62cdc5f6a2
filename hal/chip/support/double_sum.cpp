// SPDX-License-Identifier: Apache-2.0
// Takes the place of libgcc's sum and difference (the linker's --wrap): ARM run-time ABI, section 4.1.2, table 2. Their
// doubles travel in core registers, as these integers do.

#include "hal/chip/support/double_sum.hpp"

extern "C" {
// NOLINTBEGIN(bugprone-reserved-identifier): the linker makes these names
std::uint64_t __wrap___aeabi_dadd(std::uint64_t a, std::uint64_t b);
std::uint64_t __wrap___aeabi_dsub(std::uint64_t a, std::uint64_t b);
std::uint64_t __wrap___aeabi_drsub(std::uint64_t a, std::uint64_t b);
std::uint64_t __wrap___aeabi_dadd(std::uint64_t a, std::uint64_t b) { return tetap::hal::double_sum(a, b); }
std::uint64_t __wrap___aeabi_dsub(std::uint64_t a, std::uint64_t b) { return tetap::hal::double_difference(a, b); }
std::uint64_t __wrap___aeabi_drsub(std::uint64_t a, std::uint64_t b) { return tetap::hal::double_difference(b, a); }
// NOLINTEND(bugprone-reserved-identifier)
}
