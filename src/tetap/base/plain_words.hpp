// SPDX-License-Identifier: Apache-2.0
// Types whose bytes in memory are the words of their state: numbers of 32 and 64 bits without padding between them.
// Members of such types that lie one behind the other are one run of words.
#pragma once

#include "tetap/base/fields.hpp"
#include "tetap/base/members.hpp"

#include <array>
#include <bit>
#include <cstddef>
#include <optional>
#include <tuple>
#include <type_traits>
#include <utility>

namespace tetap::base::detail {

static_assert(std::endian::native == std::endian::little, "a run has the low word of 64 bits first");

/// Bytes from which on a call for a run is worth it: it costs a dozen instructions and saves twelve bytes a word.
inline constexpr std::size_t kLeastRun = 16;

template <class T>
struct PlainBytes;
/// Size of T where its bytes are the words of its state, else 0.
template <class T>
constexpr std::size_t plain_bytes() {
  return PlainBytes<std::remove_cv_t<T>>::kSize;
}
/// Plain bytes of an entry of a list of members: one with a tag has none.
template <class E>
constexpr std::size_t plain_bytes_of_entry() {
  if constexpr (std::is_lvalue_reference_v<E>) {
    return plain_bytes<std::remove_cvref_t<E>>();
  } else {
    return 0;
  }
}

/// Sum of the entries' sizes, if all are plain and there is no padding in `whole` bytes.
template <class... E>
constexpr std::size_t plain_bytes_of_all(std::type_identity<std::tuple<E...>>, std::size_t whole) {
  const bool plain = (... && (plain_bytes_of_entry<E>() > 0));
  const std::size_t bytes = (std::size_t{0} + ... + plain_bytes_of_entry<E>());
  return plain && bytes == whole ? bytes : 0;
}

template <class T>
struct PlainBytes {
  static constexpr std::size_t kSize = [] {
    std::size_t bytes = 0;
    if constexpr (!(std::is_same_v<T, bool> || std::is_pointer_v<T> || std::is_union_v<T> || std::is_empty_v<T>)) {
      if constexpr (std::is_arithmetic_v<T> || std::is_enum_v<T>) {
        bytes = sizeof(T) == 4 || sizeof(T) == 8 ? sizeof(T) : 0;
      } else if constexpr (requires { T::SizeAtCompileTime; }) {
        constexpr std::size_t kBytes = T::SizeAtCompileTime * plain_bytes<typename T::Scalar>();
        bytes = kBytes == sizeof(T) ? kBytes : 0;
      } else if constexpr (requires(const T& t) { t.packed(); }) {
        constexpr std::size_t kBytes = plain_bytes<std::remove_cvref_t<decltype(std::declval<const T&>().packed())>>();
        bytes = kBytes == sizeof(T) ? kBytes : 0;
      } else if constexpr (ListsMembers<const T>) {
        bytes = plain_bytes_of_all(std::type_identity<List<const T>>(), sizeof(T));
      } else if constexpr (std::is_aggregate_v<T> && requires(const T& t) { fields(t); }) {
        bytes = plain_bytes_of_all(std::type_identity<decltype(fields(std::declval<const T&>()))>(), sizeof(T));
      }
    }
    return bytes;
  }();
};
template <class T, std::size_t kLength>
struct PlainBytes<std::array<T, kLength>> {
  static constexpr std::size_t kSize = kLength * plain_bytes<T>();
};
template <class T>
struct PlainBytes<std::optional<T>> {
  static constexpr std::size_t kSize = 0;
};
template <class... T>
struct PlainBytes<std::tuple<T...>> {
  static constexpr std::size_t kSize = 0;
};

/// Plain members [begin, end) of a list, one behind the other if no padding is between them.
struct Run {
  std::size_t end, bytes;
};
template <class List, std::size_t kBegin>
constexpr Run run_of() {
  return []<class... E>(std::type_identity<std::tuple<E...>>) {
    constexpr std::array<std::size_t, sizeof...(E)> kBytes{plain_bytes_of_entry<E>()...};
    constexpr std::array<std::size_t, sizeof...(E)> kAlignment{alignof(std::remove_cvref_t<E>)...};
    Run run{kBegin, 0};
    while (run.end < sizeof...(E) && kBytes[run.end] > 0 && kAlignment[run.end] <= kAlignment[kBegin] &&
           run.bytes % kAlignment[run.end] == 0)
      run.bytes += kBytes[run.end++];
    return run;
  }(std::type_identity<List>());
}

}  // namespace tetap::base::detail
