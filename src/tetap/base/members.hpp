// SPDX-License-Identifier: Apache-2.0
// The one list of a class's state: `static constexpr auto members(auto& self)` gives base::members(self.a_, ...) in the
// order of declaration. From it follow what is hashed and when, what a copy takes over, and what power-on clears. The
// list is held against the class's size: a member that is left out does not compile, unless it hides in padding.
// An aggregate without a list has all its fields in it.
#pragma once

#include "tetap/base/reinitialise.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <tuple>
#include <type_traits>
#include <utility>

namespace tetap::base {

/// Epochs in which all state has been hashed once.
inline constexpr unsigned kTurns = 10;

/// Hashed in one of kEvery epochs; an array a part at a time. A member not marked is hashed in every epoch.
template <unsigned kEvery, class T>
struct InTurns {
  T& member;
};
/// The elements of a ring that are in use, a part at a time. Its other places are written before they are read.
/// `number`, if there is one, has the places of the elements in the ring's order.
template <class T, class Index>
struct Ring {
  T& member;
  std::remove_const_t<Index> begin, size;
  const std::uint16_t* number = nullptr;
};
/// An index or a size, which has 32 bits where the host has 64.
template <class T>
struct Count {
  T& member;
};
/// An unsigned number of 64 bits on every machine.
template <class T>
struct Wide {
  T& member;
};
/// Not hashed; the comment beside it has the reason.
template <class T>
struct Unhashed {
  T& member;
};
/// Power-on leaves it.
template <class T>
struct Kept {
  T& member;
};
/// A pointer, or what a secret is made into: each object has its own, which is neither hashed nor copied nor cleared.
template <class T>
struct Own {
  T& member;
};
/// A member that is a reference.
template <class T>
struct Reference {};
/// The member of a union that is in use; visit(whole, f) calls f with it.
template <class T, class Union>
struct Active {
  T& whole;
};
/// Bytes beside the members: a base class's padding, an empty member.
template <std::size_t kSize>
struct Beside {};

template <class... T>
[[gnu::always_inline]] constexpr auto members(T&&... member) {
  return std::tuple<T...>(std::forward<T>(member)...);
}
template <class T>
[[gnu::always_inline]] constexpr InTurns<kTurns, T> in_turns(T& member) {
  return {member};
}
template <unsigned kEvery, class T>
[[gnu::always_inline]] constexpr InTurns<kEvery, T> in_turns_of(T& member) {
  return {member};
}
template <class T, class Index>
[[gnu::always_inline]] constexpr Ring<T, Index> ring(T& member, Index begin, Index size) {
  return {member, begin, size};
}
template <class T, class Index, std::size_t kSize>
[[gnu::always_inline]] constexpr Ring<T, Index> ring(T& member, Index begin, Index size,
                                                     const std::array<std::uint16_t, kSize>& number) {
  return {member, begin, size, number.data()};
}
template <class T, class Index>
[[gnu::always_inline]] constexpr Ring<T, Index> first(T& member, Index size) {
  return {member, 0, size};
}
template <class T>
[[gnu::always_inline]] constexpr Count<T> count(T& member) {
  return {member};
}
template <class T, class Union>
[[gnu::always_inline]] constexpr Active<T, Union> active(T& whole, Union&) {
  return {whole};
}
/// An object as its base class.
template <class Base, class T>
[[gnu::always_inline]] constexpr auto& base_of(T& object) {
  return static_cast<std::conditional_t<std::is_const_v<T>, const Base, Base>&>(object);
}
template <class T>
[[gnu::always_inline]] constexpr Wide<T> wide(T& member) {
  return {member};
}
template <class T>
[[gnu::always_inline]] constexpr Unhashed<T> unhashed(T& member) {
  return {member};
}
template <class T>
[[gnu::always_inline]] constexpr Kept<T> kept(T& member) {
  return {member};
}
template <class T>
[[gnu::always_inline]] constexpr Own<T> own(T& member) {
  return {member};
}
template <class T>
[[gnu::always_inline]] constexpr Reference<T> reference(T&) {
  return {};
}

template <class T>
concept ListsMembers = requires(T& t) {
  std::remove_const_t<T>::members(t);
};

namespace detail {

/// Type of the member that an entry of a list is of.
template <class T>
struct Entry {
  using Type = std::remove_cvref_t<T>;
};
template <unsigned kEvery, class T>
struct Entry<InTurns<kEvery, T>> : Entry<T> {};
template <class T, class Index>
struct Entry<Ring<T, Index>> : Entry<T> {};
template <class T, class Union>
struct Entry<Active<T, Union>> : Entry<Union> {};
template <class T>
struct Entry<Count<T>> : Entry<T> {};
template <class T>
struct Entry<Wide<T>> : Entry<T> {};
template <class T>
struct Entry<Unhashed<T>> : Entry<T> {};
template <class T>
struct Entry<Kept<T>> : Entry<T> {};
template <class T>
struct Entry<Own<T>> : Entry<T> {};
template <class T>
struct Entry<Reference<T>> {
  using Type = T*;
};
template <std::size_t kSize>
struct Entry<Beside<kSize>> {
  using Type = std::array<char, kSize>;
};
template <class T>
using EntryType = typename Entry<std::remove_cv_t<T>>::Type;

template <class T>
using List = decltype(T::members(std::declval<T&>()));

constexpr std::size_t aligned(std::size_t at, std::size_t alignment) {
  return (at + alignment - 1) / alignment * alignment;
}

/// The listed members, laid out one behind the other, take the class's size. An empty one takes a byte or none.
template <class T>
constexpr bool covers() {
  return []<class... E>(std::type_identity<std::tuple<E...>>) {
    const auto size = [](bool empty_has_place) {
      std::size_t end = 0;
      ((end = std::is_empty_v<EntryType<E>> && !empty_has_place
                  ? end
                  : aligned(end, alignof(EntryType<E>)) + sizeof(EntryType<E>)),
       ...);
      return aligned(end == 0 ? 1 : end, alignof(T));
    };
    return size(false) <= sizeof(T) && sizeof(T) <= size(true);
  }(std::type_identity<List<T>>());
}

/// A copy leaves it; power-on leaves it.
template <class T>
inline constexpr bool kStays = false;
template <class T>
inline constexpr bool kStays<Own<T>> = true;
template <class T>
inline constexpr bool kStays<Reference<T>> = true;
template <class T>
inline constexpr bool kIsOwn = kStays<T>;
template <class T>
inline constexpr bool kIsOwn<Kept<T>> = true;

/// Some member, or one of its members, is an object's own.
template <class T>
constexpr bool has_own() {
  if constexpr (ListsMembers<T>) {
    return []<class... E>(std::type_identity<std::tuple<E...>>) {
      return (... || (kIsOwn<std::remove_cv_t<E>> || has_own<EntryType<E>>()));
    }(std::type_identity<List<T>>());
  } else {
    return false;
  }
}

template <class E>
inline constexpr bool kIsTag = !std::is_same_v<EntryType<E>, E>;

template <class F, class... Tuple>
constexpr void each_entry(const F& f, Tuple... list) {
  [&]<std::size_t... kAt>(std::index_sequence<kAt...>) {
    const auto at = [&]<std::size_t kPlace>(std::integral_constant<std::size_t, kPlace>) {
      f(std::get<kPlace>(list)...);
    };
    (at(std::integral_constant<std::size_t, kAt>{}), ...);
  }
  (std::make_index_sequence<std::min({std::tuple_size_v<Tuple>...})>());
}
template <class E>
constexpr void clear_entry(E& entry) {
  if constexpr (kIsOwn<E>) {
  } else if constexpr (kIsTag<E>) {
    clear_entry(entry.member);
  } else if constexpr (requires { entry.power_on(); }) {
    entry.power_on();
  } else if constexpr (has_own<E>()) {
    each_entry([](auto& inner) { clear_entry(inner); }, E::members(entry));
  } else {
    reinitialise(entry);
  }
}
template <class E, class From>
constexpr void resume_entry(E& entry, const From& from) {
  if constexpr (kStays<E>) {
  } else if constexpr (kIsTag<E>) {
    resume_entry(entry.member, from.member);
  } else if constexpr (requires { entry.resume(from); }) {
    entry.resume(from);
  } else if constexpr (has_own<E>()) {
    each_entry([](auto& to, const auto& by) { resume_entry(to, by); }, E::members(entry), E::members(from));
  } else {
    entry = from;
  }
}

}  // namespace detail

/// Every member as its type begins, a number as 0; in place: a fresh object assigned over the old one would pass over
/// the stack.
template <ListsMembers T>
constexpr void clear(T& object) {
  detail::each_entry([](auto& entry) { detail::clear_entry(entry); }, T::members(object));
}

/// Goes on from the state of another object. References and what is its own stay.
template <ListsMembers T>
constexpr void resume(T& object, const T& other) {
  detail::each_entry([](auto& to, const auto& from) { detail::resume_entry(to, from); }, T::members(object),
                     T::members(other));
}

}  // namespace tetap::base
