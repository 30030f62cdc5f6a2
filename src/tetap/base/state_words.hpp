// SPDX-License-Identifier: Apache-2.0
// A state as words for a hash, by the one list of each class's members: all of it, or what an epoch's turn is. Members
// below two bytes share a word. The words are the same where a size has 32 bits and where it has 64.
#pragma once

#include "tetap/base/fields.hpp"
#include "tetap/base/members.hpp"
#include "tetap/base/plain_words.hpp"

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <tuple>
#include <type_traits>
#include <utility>

namespace tetap::base {

namespace detail {

template <class T>
inline constexpr bool kInTurns = false;
template <unsigned kEvery, class T>
inline constexpr bool kInTurns<InTurns<kEvery, T>> = true;

/// Members below T that are hashed in turns: each has a turn of its own, modulo kTurns.
template <class T>
struct TurnsOf;
template <class T>
constexpr unsigned turns_of() {
  return TurnsOf<T>::kCount;
}
template <class E>
constexpr unsigned turns_of_entry() {
  if constexpr (kInTurns<std::remove_cv_t<E>>) {
    return 1;
  } else if constexpr (std::is_lvalue_reference_v<E>) {
    return turns_of<std::remove_cvref_t<E>>();
  } else {
    return 0;
  }
}
template <class T>
struct TurnsOf {
  static constexpr unsigned kCount = [] {
    if constexpr (ListsMembers<T>) {
      return []<class... E>(std::type_identity<std::tuple<E...>>) {
        return (0U + ... + turns_of_entry<E>());
      }(std::type_identity<List<T>>());
    } else {
      return 0U;
    }
  }();
};
template <class... T>
struct TurnsOf<std::tuple<T...>> {
  static constexpr unsigned kCount = (0U + ... + turns_of<T>());
};

template <class T>
inline constexpr bool kIsArray = false;
template <class T, std::size_t kSize>
inline constexpr bool kIsArray<std::array<T, kSize>> = true;
template <class T>
inline constexpr bool kIsTuple = false;
template <class... T>
inline constexpr bool kIsTuple<std::tuple<T...>> = true;
template <class T>
inline constexpr bool kIsOptional = false;
template <class T>
inline constexpr bool kIsOptional<std::optional<T>> = true;
/// Several of them share a word.
template <class T>
inline constexpr bool kSmall = (std::is_integral_v<T> || std::is_enum_v<T>)&&sizeof(T) <= 2;

template <class T>
[[gnu::always_inline]] constexpr std::uint32_t small_bits(T value) {
  if constexpr (std::is_enum_v<T>) {
    return small_bits(static_cast<std::underlying_type_t<T>>(value));
  } else if constexpr (std::is_same_v<T, bool>) {
    return value ? 1U : 0U;
  } else {
    return static_cast<std::make_unsigned_t<T>>(value);
  }
}

/// Feeds state to `out` as words. kAll: all of it, whatever the turn. Out::mark(address, size), if there is one,
/// gets the place of each hashed member; mark_index() that of an index, mark_unhashed() that of a listed, unhashed one.
/// Out::run(address, count), if there is one, gets plain members that lie one behind the other where all is fed: in
/// each epoch a loop over them would cost time.
template <bool kAll, class Out>
struct Words {
  Out& out;
  unsigned turn;
  static constexpr bool kRuns = kAll && requires(Out & o, const void* from) { o.run(from, std::size_t{}); };

  template <class T>
  [[gnu::always_inline]] constexpr void mark(const T& value) const {
    if constexpr (requires { out.mark(&value, sizeof value); }) out.mark(&value, sizeof value);
  }
  [[gnu::always_inline]] constexpr void word(std::uint32_t bits) const { out(bits); }

  template <unsigned kTurn = 0, class T>
  [[gnu::always_inline]] constexpr void add(const T& value) const {
    if constexpr (kRuns && plain_bytes<T>() >= kLeastRun) {
      out.run(&value, sizeof(T) / 4);
    } else if constexpr (std::is_enum_v<T> || kSmall<T>) {
      mark(value);
      word(small_bits(value));
    } else if constexpr (std::is_floating_point_v<T> || std::is_integral_v<T>) {
      static_assert(std::is_same_v<std::size_t, unsigned int> || !std::is_same_v<T, std::size_t>,
                    "base::count() of a size; std::int64_t of 64 bits");
      mark(value);
      if constexpr (sizeof(T) == 4) {
        word(std::bit_cast<std::uint32_t>(value));
      } else {
        const auto bits = std::bit_cast<std::uint64_t>(value);
        word(static_cast<std::uint32_t>(bits));
        word(static_cast<std::uint32_t>(bits >> 32));
      }
    } else if constexpr (kIsTuple<T>) {
      walk<kTurn, 0, 0>(std::apply([](const auto&... element) { return std::tie(element...); }, value), 0U);
    } else if constexpr (kIsOptional<T>) {
      word(value.has_value() ? 1U : 0U);
      if (value) add(*value);
    } else if constexpr (kIsArray<T>) {
      part(value, 0, value.size());
    } else if constexpr (requires { T::SizeAtCompileTime; }) {
      for (int i = 0; i < T::SizeAtCompileTime; ++i) add(value.data()[i]);
    } else if constexpr (requires { value.packed(); }) {
      add(value.packed());
    } else if constexpr (ListsMembers<const T>) {
      static_assert(covers<T>(), "members() has a member too few, or not in the order of declaration");
      walk<kTurn, 0, 0>(T::members(value), 0U);
    } else {
      walk<kTurn, 0, 0>(fields(value), 0U);
    }
  }

  template <class T, std::size_t kSize>
  [[gnu::always_inline]] constexpr void part(const std::array<T, kSize>& all, std::size_t from, std::size_t to) const {
    if constexpr (kSmall<T> && sizeof(T) == 1) {
      std::uint32_t bits = 0;
      for (std::size_t i = from; i < to; ++i) {
        mark(all[i]);
        bits = bits << 8U | small_bits(all[i]);
        if ((i - from) % 4 == 3) word(std::exchange(bits, 0U));
      }
      if ((to - from) % 4 != 0) word(bits);
    } else {
      for (std::size_t i = from; i < to; ++i) add(all[i]);
    }
  }

 private:
  [[nodiscard]] static constexpr std::size_t share(std::size_t size, unsigned every, unsigned turn) {
    return size * turn / every;
  }

  template <unsigned kTurn, class T>
  [[gnu::always_inline]] constexpr void entry(const T& member) const {
    add<kTurn>(member);
  }
  template <unsigned kTurn, unsigned kEvery, class T>
  [[gnu::always_inline]] constexpr void entry(const InTurns<kEvery, T>& in) const {
    if constexpr (requires { in.member.packed(); }) {
      entry<kTurn>(in_turns_of<kEvery>(in.member.packed()));
    } else if constexpr (kAll) {
      add(in.member);
    } else if constexpr (kIsArray<std::remove_const_t<T>>) {  // what is inside it has no turns of its own
      const unsigned now = turn % kEvery;
      Words<true, Out>{out, 0}.part(in.member, share(in.member.size(), kEvery, now),
                                    share(in.member.size(), kEvery, now + 1));
    } else {
      if (turn % kEvery == kTurn % kEvery) Words<true, Out>{out, 0}.add(in.member);
    }
  }
  template <unsigned kTurn, class T, class Index>
  [[gnu::always_inline]] constexpr void entry(const Ring<T, Index>& ring) const {
    const std::size_t places = ring.member.size();
    const std::size_t from = kAll ? 0 : share(places, kTurns, turn),
                      to = kAll ? places : share(places, kTurns, turn + 1);
    for (std::size_t i = from; i < to; ++i)
      if ((i >= ring.begin ? i - ring.begin : i + places - ring.begin) < ring.size)
        Words<true, Out>{out, 0}.add(ring.member[ring.number == nullptr ? i : ring.number[i]]);
  }
  template <unsigned kTurn, class T>
  [[gnu::always_inline]] constexpr void entry(const Count<T>& count) const {
    if constexpr (requires { out.mark_index(&count.member, sizeof(T)); }) out.mark_index(&count.member, sizeof(T));
    std::uint32_t bits = static_cast<std::uint32_t>(count.member);
    if constexpr (sizeof(T) > 4) bits ^= static_cast<std::uint32_t>(static_cast<std::uint64_t>(count.member) >> 32);
    word(bits);
  }
  template <unsigned kTurn, class T, class Union>
  [[gnu::always_inline]] constexpr void entry(const Active<T, Union>& active) const {
    static_cast<void>(visit(active.whole, [this](const auto& in_use) { this->add(in_use); }));
  }
  template <unsigned kTurn, class T>
  [[gnu::always_inline]] constexpr void entry(const Kept<T>& kept) const {
    add<kTurn>(kept.member);
  }
  template <unsigned kTurn, class T>
  [[gnu::always_inline]] constexpr void entry(const Wide<T>& wide) const {
    mark(wide.member);
    word(static_cast<std::uint32_t>(wide.member));
    word(static_cast<std::uint32_t>(wide.member >> 32));
  }
  template <unsigned kTurn, class T>
  [[gnu::always_inline]] constexpr void entry(const Unhashed<T>& entry) const {
    if constexpr (requires { out.mark_unhashed(&entry.member, sizeof(T)); })
      out.mark_unhashed(&entry.member, sizeof(T));
  }
  template <unsigned kTurn, class T>
  [[gnu::always_inline]] constexpr void entry(const Own<T>& entry) const {
    if constexpr (requires { out.mark_unhashed(&entry.member, sizeof(T)); })
      out.mark_unhashed(&entry.member, sizeof(T));
  }
  template <unsigned kTurn, class T>
  [[gnu::always_inline]] constexpr void entry(const Reference<T>&) const {}
  template <unsigned kTurn, std::size_t kSize>
  [[gnu::always_inline]] constexpr void entry(const Beside<kSize>&) const {}

  /// Each member ends where the next one begins; the compiler knows the answer.
  template <std::size_t kAt, class Tuple, std::size_t... kNext>
  [[gnu::always_inline]] static bool adjacent(const Tuple& list, std::index_sequence<kNext...>) {
    return (... && (static_cast<const void*>(&std::get<kAt + kNext>(list) + 1) ==
                    static_cast<const void*>(&std::get<kAt + kNext + 1>(list))));
  }
  template <std::size_t kAt, class Tuple, std::size_t... kNext>
  [[gnu::always_inline]] constexpr void each(const Tuple& list, std::index_sequence<kNext...>) const {
    (add(std::get<kAt + kNext>(list)), ...);
  }
  /// The members from the kAt-th on; `shared` has kBits bits of small ones before it.
  template <unsigned kTurn, std::size_t kAt, unsigned kBits, class Tuple>
  [[gnu::always_inline]] constexpr void walk(const Tuple& list, std::uint32_t shared) const {
    if constexpr (kAt == std::tuple_size_v<Tuple>) {
      if constexpr (kBits > 0) word(shared);
    } else {
      using Member = std::tuple_element_t<kAt, Tuple>;
      const auto& member = std::get<kAt>(list);
      if constexpr (std::is_lvalue_reference_v<Member> && kSmall<std::remove_cvref_t<Member>>) {
        constexpr unsigned kMore = 8 * sizeof(std::remove_cvref_t<Member>);
        mark(member);
        if constexpr (kBits + kMore > 32) {
          word(shared);
          walk<kTurn, kAt + 1, kMore>(list, small_bits(member));
        } else {
          walk<kTurn, kAt + 1, kBits + kMore>(list, shared | small_bits(member) << kBits);
        }
      } else if constexpr (kRuns && run_of<Tuple, kAt>().bytes >= kLeastRun) {
        constexpr Run kRun = run_of<Tuple, kAt>();
        if (adjacent<kAt>(list, std::make_index_sequence<kRun.end - kAt - 1>())) {
          out.run(&member, kRun.bytes / 4);
        } else {
          each<kAt>(list, std::make_index_sequence<kRun.end - kAt>());
        }
        walk<kTurn, kRun.end, kBits>(list, shared);
      } else {
        entry<kTurn>(member);
        walk<(kTurn + turns_of_entry<Member>()) % kTurns, kAt + 1, kBits>(list, shared);
      }
    }
  }
};

}  // namespace detail

/// All of the state, as words.
template <class T, class Out>
constexpr void each_word(const T& object, Out& out) {
  detail::Words<true, Out>{out, 0}.add(object);
}
/// The state that is hashed in every epoch, and that whose turn is in this one; turn < kTurns.
template <class T, class Out>
constexpr void each_word_in_turn(const T& object, unsigned turn, Out& out) {
  detail::Words<false, Out>{out, turn}.add(object);
}

}  // namespace tetap::base
