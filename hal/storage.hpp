// SPDX-License-Identifier: Apache-2.0
// Demands of the firmware on memory that keeps its content without power: two pages of flash. The port owns locks,
// clocks and error flags of the flash controller.
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>

namespace tetap::hal {

/// A page is what one erase sets to 0xFF. A granule is programmed as a whole, once after an erase of its page.
template <class S>
concept Storage = requires(S& s, const S& view, std::size_t page, std::size_t granule, std::span<std::uint8_t> in,
                           std::span<const std::uint8_t> out) {
  requires std::same_as<decltype(S::kPageBytes), const std::size_t>;
  requires std::same_as<decltype(S::kGranuleBytes), const std::size_t>;
  requires S::kGranuleBytes >= 8 && S::kPageBytes % S::kGranuleBytes == 0;
  /// One granule of page 0 or 1 into `in`; false: the memory's own check code refuses it.
  { view.read(page, granule, in) } -> std::same_as<bool>;
  /// Blocks until the granule is programmed; false: it was not blank, or the controller reports an error.
  { s.program(page, granule, out) } -> std::same_as<bool>;
  /// Blocks until the page is blank, as long as the chip's longest erase; false: the controller reports an error.
  { s.erase(page) } -> std::same_as<bool>;
};

}  // namespace tetap::hal
