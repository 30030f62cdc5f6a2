// SPDX-License-Identifier: Apache-2.0
// What the replay core returns in place of an exception, so that it is built where there are none.
#pragma once

#include <cstdint>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>

namespace tetap::sim {

/// Why something cannot be done: one sentence for people.
struct Failure {
  std::string text;
  std::uint64_t line = 0;  ///< number of the log's line, from 1; 0: of no line
};

struct Done {};

/// A value, or why there is none.
template <class T = Done>
class [[nodiscard]] Result {
 public:
  Result() requires std::is_same_v<T, Done>
  = default;
  Result(T value) : held_(std::move(value)) {}
  Result(Failure failure) : held_(std::move(failure)) {}

  explicit operator bool() const { return held_.index() == 0; }
  /// Both only where there is a value.
  [[nodiscard]] T& operator*() { return *std::get_if<0>(&held_); }
  [[nodiscard]] const T& operator*() const { return *std::get_if<0>(&held_); }
  [[nodiscard]] T* operator->() { return std::get_if<0>(&held_); }
  [[nodiscard]] const T* operator->() const { return std::get_if<0>(&held_); }
  /// Only where there is none.
  [[nodiscard]] const Failure& failure() const { return *std::get_if<1>(&held_); }

 private:
  std::variant<T, Failure> held_;
};

}  // namespace tetap::sim
