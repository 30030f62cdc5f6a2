// SPDX-License-Identifier: Apache-2.0
// One row of the parameter table: path, stable index, unit, limits, and access to the member without its type.
#pragma once

#include "tetap/param/parameters.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <utility>

namespace tetap::param {

/// When a changed value takes effect.
enum class Effect : std::uint8_t { kLive, kRestart };

/// How a member stores a value; kSteps are whole numbers of a fraction of the unit.
enum class Storage : std::uint8_t { kFloat, kWhole, kSteps };

/// Values are doubles in `unit`: every stored type fits. Rows are for compilers and host programs: a flash image keeps
/// no string of them.
struct Row {
  std::uint16_t index;   ///< stable for ever: object 0x2000 + index on CANopen
  const char* path;      ///< structs and member, with dots between
  const char* unit;      ///< "" without one
  double minimum;        ///< least plausible value of each element
  double maximum;        ///< greatest plausible value of each element
  Effect effect;         ///< whether a change needs a restart
  const char* text;      ///< one sentence for the reference
  Storage storage;       ///< how an element is stored
  std::size_t elements;  ///< 1, or the length of a vector or of a matrix, row by row
  std::size_t offset;    ///< place of the member in Parameters, in bytes
  std::size_t size;      ///< size of the member in bytes, a multiple of 4
  double (*get)(const Parameters& parameters, std::size_t element);
  void (*set)(Parameters& parameters, std::size_t element, double value);  ///< `value` is within the limits
};

/// Whether a value lies within the limits as its member stores it; false for NaN.
[[nodiscard]] constexpr bool within(const Row& row, double value) {
  constexpr double kRounding = 1.0 / (1 << 23);  // a limit's nearest float may lie outside of it
  const auto slack = [&row](double limit) {
    return row.storage != Storage::kFloat ? 0 : (limit < 0 ? -limit : limit) * kRounding;
  };
  return value >= row.minimum - slack(row.minimum) && value <= row.maximum + slack(row.maximum);
}

namespace detail {

template <class T>
inline constexpr std::size_t kElements = 1;
template <class T, std::size_t n>
inline constexpr std::size_t kElements<std::array<T, n>> = n;

template <class T>
constexpr auto& element(T& member, std::size_t i) {
  constexpr bool kList = kElements<std::remove_const_t<T>> != 1;
  if constexpr (kList)
    return member[i];
  else
    return member;
}

/// `Member` is a function object from Parameters to its member; an element stores value * per_unit.
template <std::int64_t per_unit, class Member>
constexpr Row row(std::uint16_t index, const char* path, Member /*member*/, std::size_t offset, const char* unit,
                  double minimum, double maximum, Effect effect, const char* text) {
  using Type = std::remove_reference_t<decltype(Member{}(std::declval<Parameters&>()))>;
  using Element = std::remove_reference_t<decltype(element(std::declval<Type&>(), 0))>;
  constexpr double kPerUnit = static_cast<double>(per_unit);
  constexpr Storage kStorage = std::is_floating_point_v<Element> ? Storage::kFloat
                               : per_unit == 1                   ? Storage::kWhole
                                                                 : Storage::kSteps;
  return {.index = index,
          .path = path,
          .unit = unit,
          .minimum = minimum,
          .maximum = maximum,
          .effect = effect,
          .text = text,
          .storage = kStorage,
          .elements = kElements<Type>,
          .offset = offset,
          .size = sizeof(Type),
          .get = [](const Parameters& p, std::size_t i) -> double {
            const auto value = static_cast<double>(element(Member{}(p), i));
            if constexpr (kStorage == Storage::kSteps)
              return value / kPerUnit;
            else
              return value;
          },
          .set =
              [](Parameters& p, std::size_t i, double value) {
                if constexpr (kStorage == Storage::kSteps) value = value * kPerUnit + (value < 0 ? -0.5 : 0.5);
                element(Member{}(p), i) = static_cast<Element>(value);
              }};
}

}  // namespace detail
}  // namespace tetap::param
