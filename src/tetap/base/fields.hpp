// SPDX-License-Identifier: Apache-2.0
// The fields of an aggregate, as a tuple of references: a plain struct needs no list of its members.
#pragma once

#include <cstddef>
#include <tuple>
#include <type_traits>
#include <utility>

namespace tetap::base {

inline constexpr std::size_t kMostFields = 20;

namespace detail {

struct AnyField {
  std::size_t place;
  template <class T>
  operator T() const;  // NOLINT(google-explicit-constructor): stands for a field of any type, never called
};
template <class T, std::size_t... kPlace>
constexpr bool begins_with(std::index_sequence<kPlace...>) {
  return requires { T{AnyField{kPlace}...}; };
}
template <class T, std::size_t kCount = kMostFields + 1>
constexpr std::size_t count_fields() {
  if constexpr (kCount == 0 || begins_with<T>(std::make_index_sequence<kCount>())) {
    return kCount;
  } else {
    return count_fields<T, kCount - 1>();
  }
}

}  // namespace detail

/// `t` is an aggregate without base classes and without C arrays, of at most kMostFields fields.
template <class T>
requires(std::is_aggregate_v<std::remove_const_t<T>>) [[gnu::always_inline]] constexpr auto fields(T& t) {
  constexpr std::size_t kCount = detail::count_fields<std::remove_const_t<T>>();
  static_assert(kCount <= kMostFields, "more fields than base::fields() takes apart");
  // clang-format off
  if constexpr (kCount == 0) { return std::tuple<>(); }
  else if constexpr (kCount == 1) { auto& [a] = t; return std::tie(a); }
  else if constexpr (kCount == 2) { auto& [a, b] = t; return std::tie(a, b); }
  else if constexpr (kCount == 3) { auto& [a, b, c] = t; return std::tie(a, b, c); }
  else if constexpr (kCount == 4) { auto& [a, b, c, d] = t; return std::tie(a, b, c, d); }
  else if constexpr (kCount == 5) { auto& [a, b, c, d, e] = t; return std::tie(a, b, c, d, e); }
  else if constexpr (kCount == 6) { auto& [a, b, c, d, e, f] = t; return std::tie(a, b, c, d, e, f); }
  else if constexpr (kCount == 7) { auto& [a, b, c, d, e, f, g] = t; return std::tie(a, b, c, d, e, f, g); }
  else if constexpr (kCount == 8) { auto& [a, b, c, d, e, f, g, h] = t; return std::tie(a, b, c, d, e, f, g, h); }
  else if constexpr (kCount == 9) { auto& [a, b, c, d, e, f, g, h, i] = t; return std::tie(a, b, c, d, e, f, g, h, i); }
  else if constexpr (kCount == 10) {
    auto& [a, b, c, d, e, f, g, h, i, j] = t;
    return std::tie(a, b, c, d, e, f, g, h, i, j);
  } else if constexpr (kCount == 11) {
    auto& [a, b, c, d, e, f, g, h, i, j, k] = t;
    return std::tie(a, b, c, d, e, f, g, h, i, j, k);
  } else if constexpr (kCount == 12) {
    auto& [a, b, c, d, e, f, g, h, i, j, k, l] = t;
    return std::tie(a, b, c, d, e, f, g, h, i, j, k, l);
  } else if constexpr (kCount == 19) {
    auto& [a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s] = t;
    return std::tie(a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s);
  } else {
    static_assert(kCount == 20, "add a line for this number of fields");
    auto& [a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, u] = t;
    return std::tie(a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, u);
  }
  // clang-format on
}

}  // namespace tetap::base
