// SPDX-License-Identifier: Apache-2.0
// A loop whose index is a constant: what is indexed by it stays in registers, and conditions on it cost nothing.
// `#pragma GCC unroll` gives up on larger bodies; this does not.
#pragma once

#include <type_traits>
#include <utility>

namespace tetap::filter {

/// body(std::integral_constant<int, i>) for i = Begin ... End - 1.
template <int Begin, int End, class Body>
[[gnu::always_inline]] constexpr void unroll(const Body& body) {
  [&]<int... kOffset>(std::integer_sequence<int, kOffset...>) __attribute__((always_inline)) {
    (body(std::integral_constant<int, Begin + kOffset>{}), ...);
  }
  (std::make_integer_sequence<int, End - Begin>{});
}

}  // namespace tetap::filter
