// SPDX-License-Identifier: Apache-2.0
// Construction of an object anew in its own place. No copy of it passes over the stack, and nothing is allocated.
#pragma once

#include <new>
#include <type_traits>

namespace tetap::base {

template <class T, class... Arguments>
requires(std::is_trivially_destructible_v<T>) void reinitialise(T& object, const Arguments&... arguments) {
  ::new (static_cast<void*>(&object)) T(arguments...);
}

/// Begins the life of a union's member in its own place; its numbers are not set.
template <class T>
requires(std::is_trivially_destructible_v<T>) void begin_life(T& member) { ::new (static_cast<void*>(&member)) T; }

}  // namespace tetap::base
