// SPDX-License-Identifier: Apache-2.0
// The updates of a Kalman filter as a program on a host may look at them: prior, innovation, posterior. An image has
// none of this: Viewable<Filter> is Filter there, to the bit. A program that looks is compiled with
// TETAP_VIEWS_UPDATES and defines view().
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/filter/state.hpp"
#include "tetap/filter/update.hpp"

#include <array>
#include <cstddef>
#include <span>
#include <string_view>
#include <type_traits>
#include <utility>

namespace tetap::filter {

#ifdef TETAP_VIEWS_UPDATES
inline constexpr bool kViewsUpdates = true;
#else
inline constexpr bool kViewsUpdates = false;
#endif

/// One update in numbers, valid during the call; matrices are whole, row by row. Units are those of states and
/// measurement.
struct UpdateView {
  std::string_view model;            ///< type of the measurement: "GnssFix3d"
  std::span<const float> at;         ///< N: x-, as its difference to a state of zeros
  std::span<const float> moved;      ///< N: x+ minus x-, as the filter stored it
  std::span<const float> prior;      ///< N x N: P-
  std::span<const float> posterior;  ///< N x N: P+
  std::span<const float> h;          ///< M x N
  std::span<const float> noise;      ///< M: variances R
  std::span<const float> nu;         ///< M
  std::span<const float> s;          ///< M x M, the filter's own
  float nis, gate;
  Verdict verdict;
};

/// The program's own.
void view(const UpdateView& update);

namespace detail {

/// Name of a type without its namespaces, as the compiler writes it.
template <class Type>
[[nodiscard]] constexpr std::string_view name_of_type() {
  const std::string_view text = __PRETTY_FUNCTION__;
  std::string_view name = text.substr(text.find("Type = ") + 7);
  name = name.substr(0, name.find_first_of("<];"));
  return name.substr(name.rfind(':') + 1);
}

template <int N>
[[nodiscard]] std::array<float, static_cast<std::size_t>(N) * N> whole(const Symmetric<float, N>& m) {
  std::array<float, static_cast<std::size_t>(N) * N> full;
  for (int r = 0; r < N; ++r)
    for (int c = 0; c < N; ++c) full[static_cast<std::size_t>(r * N + c)] = r <= c ? m(r, c) : m(c, r);
  return full;
}

}  // namespace detail

/// A filter that shows each update: its bits are those of Filter.
template <class Filter>
struct Viewed : Filter {
  template <class Measurement, class... More>
  auto update(const Measurement& z, More&&... more) {
    constexpr int N = Filter::kErrors, M = Measurement::kDimension;
    if constexpr (requires { this->predict_covariance(); }) bring_up_to_date(more...);
    const auto before = this->x;
    const auto at = before.minus({});
    const auto prior = detail::whole<N>(this->p);
    const auto variances = z.noise();
    std::array<float, static_cast<std::size_t>(M) * N> h{};
    const auto jacobian = [&] {
      if constexpr (requires { z.linearised(before); }) {
        return z.linearised(before).h;
      } else {
        return z.jacobian(before);
      }
    }();
    for (int m = 0; m < M; ++m)
      for (std::size_t k = 0; k < Measurement::kTouches.size(); ++k)
        h[static_cast<std::size_t>(m * N + Measurement::kTouches[k])] += jacobian(m, static_cast<int>(k));

    const auto record = Filter::update(z, std::forward<More>(more)...);

    const auto moved = this->x.minus(before);
    const auto posterior = detail::whole<N>(this->p);
    const auto s = detail::whole<M>(record.s);
    view({.model = detail::name_of_type<Measurement>(),
          .at = {at.data(), static_cast<std::size_t>(N)},
          .moved = {moved.data(), static_cast<std::size_t>(N)},
          .prior = prior,
          .posterior = posterior,
          .h = h,
          .noise = {variances.data(), static_cast<std::size_t>(M)},
          .nu = {record.nu.data(), static_cast<std::size_t>(M)},
          .s = s,
          .nis = record.nis,
          .gate = record.gate,
          .verdict = record.verdict});
    return record;
  }
  /// Those of the filter, or its fields.
  static constexpr auto members(auto& self) {
    if constexpr (base::ListsMembers<Filter>) {
      return Filter::members(self);
    } else {
      return base::members(self.x, self.p);
    }
  }

 private:
  /// As the filter would first thing in its update.
  template <class Gate>
  void bring_up_to_date(const Gate&) {
    this->predict_covariance();
  }
  template <class Gate, class Faults>
  void bring_up_to_date(const Gate&, Faults& faults) {
    this->predict_covariance(faults);
  }
};

template <class Filter>
using Viewable = std::conditional_t<kViewsUpdates, Viewed<Filter>, Filter>;

}  // namespace tetap::filter
