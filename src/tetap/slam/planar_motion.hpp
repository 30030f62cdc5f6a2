// SPDX-License-Identifier: Apache-2.0
// Places, headings and displacements of a plane for graphs. Coordinates and headings are stored as integers plus a
// small rest. Differences between far poses keep every digit of the scalar. Composition of uncertain displacements:
// Smith, Self & Cheeseman 1990, "Estimating uncertain spatial relationships", sec. 3.
#pragma once

#include "tetap/base/math.hpp"
#include "tetap/base/math_double.hpp"
#include "tetap/filter/symmetric.hpp"

#include <cstdint>
#include <type_traits>

namespace tetap::slam {

namespace detail {

template <class Scalar>
[[nodiscard]] constexpr bool is_number(Scalar x) {
  return x - x <= Scalar{0};  // false for NaN and infinity
}

}  // namespace detail

/// A heading in parts of a turn. Sums and differences wrap by themselves.
template <class Scalar>
struct Heading {
  using Turn = std::conditional_t<sizeof(Scalar) == 8, std::int64_t, std::int32_t>;
  using Unsigned = std::make_unsigned_t<Turn>;
  static constexpr Scalar kTwoPi = static_cast<Scalar>(6.283185307179586476925);
  static constexpr Scalar kHalfTurns =
      sizeof(Scalar) == 8 ? static_cast<Scalar>(0x1p+63) : static_cast<Scalar>(0x1p+31);

  Turn turn = 0;

  /// |rad| up to 10^5; more, or no number, gives 0.
  [[nodiscard]] static constexpr Heading from_radians(Scalar rad) {
    if (!(rad < static_cast<Scalar>(1e5) && rad > static_cast<Scalar>(-1e5))) return {};
    const Scalar turns = rad * (Scalar{1} / kTwoPi);
    const Scalar part = turns - static_cast<Scalar>(static_cast<std::int32_t>(turns));  // in (-1, 1)
    return {static_cast<Turn>(static_cast<Unsigned>(static_cast<Turn>(part * kHalfTurns)) << 1)};
  }
  /// In [-pi, pi].
  [[nodiscard]] constexpr Scalar radians() const { return static_cast<Scalar>(turn) * (kTwoPi / 2 / kHalfTurns); }
  [[nodiscard]] constexpr Heading operator+(Heading other) const {
    return {static_cast<Turn>(static_cast<Unsigned>(turn) + static_cast<Unsigned>(other.turn))};
  }
  [[nodiscard]] constexpr Heading operator-(Heading other) const {
    return {static_cast<Turn>(static_cast<Unsigned>(turn) - static_cast<Unsigned>(other.turn))};
  }
  [[nodiscard]] constexpr auto direction() const { return base::sincos(radians()); }
};

/// A coordinate in units of 2^-10 m and a rest of at most half a unit; |coordinate| up to 2000 km.
template <class Scalar>
struct Coordinate {
  static constexpr Scalar kUnit_m = static_cast<Scalar>(0x1p-10);

  std::int32_t unit = 0;
  Scalar rest_m = 0;

  /// Moved by d metres. The coordinate stays where it is when that is no number or beyond the range.
  [[nodiscard]] constexpr Coordinate plus(Scalar d_m) const {
    const Scalar sum = rest_m + d_m;
    if (!(sum < static_cast<Scalar>(2e6) && sum > static_cast<Scalar>(-2e6))) return *this;
    const Scalar scaled = sum / kUnit_m;
    const auto whole = static_cast<std::int32_t>(scaled < Scalar{0} ? scaled - static_cast<Scalar>(0.5)
                                                                    : scaled + static_cast<Scalar>(0.5));
    const std::int64_t moved = std::int64_t{unit} + whole;
    if (moved > 2'000'000'000 || moved < -2'000'000'000) return *this;
    return {static_cast<std::int32_t>(moved), sum - static_cast<Scalar>(whole) * kUnit_m};
  }
  /// Difference from `other`, in metres.
  [[nodiscard]] constexpr Scalar minus(const Coordinate& other) const {
    return static_cast<Scalar>(std::int64_t{unit} - other.unit) * kUnit_m + (rest_m - other.rest_m);
  }
  [[nodiscard]] constexpr Scalar metres() const { return minus({}); }
};

/// A pose relative to another one, in the other one's frame.
template <class Scalar>
struct Displacement {
  Scalar x_m = 0;
  Scalar y_m = 0;
  Heading<Scalar> yaw;

  [[nodiscard]] constexpr bool valid() const {
    return x_m < static_cast<Scalar>(1e5) && x_m > static_cast<Scalar>(-1e5) && y_m < static_cast<Scalar>(1e5) &&
           y_m > static_cast<Scalar>(-1e5);
  }
};

/// A pose of the graph, in the frame of its first one.
template <class Scalar>
struct GraphPose {
  Coordinate<Scalar> x;
  Coordinate<Scalar> y;
  Heading<Scalar> yaw;

  [[nodiscard]] constexpr GraphPose plus(const Displacement<Scalar>& d) const {
    const auto turn = yaw.direction();
    return {x.plus(turn.cos * d.x_m - turn.sin * d.y_m), y.plus(turn.sin * d.x_m + turn.cos * d.y_m), yaw + d.yaw};
  }
  /// The displacement that leads from `origin` to here.
  [[nodiscard]] constexpr Displacement<Scalar> minus(const GraphPose& origin) const {
    const auto turn = origin.yaw.direction();
    const Scalar dx = x.minus(origin.x);
    const Scalar dy = y.minus(origin.y);
    return {turn.cos * dx + turn.sin * dy, turn.cos * dy - turn.sin * dx, yaw - origin.yaw};
  }
};

/// A displacement with the covariance of (x, y, yaw), in m and rad, in the frame it starts from.
template <class Scalar>
struct UncertainDisplacement {
  Displacement<Scalar> mean;
  filter::Symmetric<Scalar, 3> covariance;
};

namespace detail {

/// J C J^T + other, for J = [c -s jx; s c jy; 0 0 sign].
template <class Scalar>
[[nodiscard]] filter::Symmetric<Scalar, 3> turned(const filter::Symmetric<Scalar, 3>& cov, Scalar c, Scalar s,
                                                  Scalar jx, Scalar jy, Scalar sign,
                                                  const filter::Symmetric<Scalar, 3>& other) {
  filter::Matrix<Scalar, 3, 3> j;
  j << c, -s, jx, s, c, jy, Scalar{0}, Scalar{0}, sign;
  return filter::propagate(cov, j, other);
}

}  // namespace detail

/// First a, then b. Implements docs/explanation/pose_graph.md (6).
template <class Scalar>
[[nodiscard]] UncertainDisplacement<Scalar> compose(const UncertainDisplacement<Scalar>& a,
                                                    const UncertainDisplacement<Scalar>& b) {
  const auto turn = a.mean.yaw.direction();
  const Scalar x = turn.cos * b.mean.x_m - turn.sin * b.mean.y_m;
  const Scalar y = turn.sin * b.mean.x_m + turn.cos * b.mean.y_m;
  const auto of_b = detail::turned(b.covariance, turn.cos, turn.sin, Scalar{0}, Scalar{0}, Scalar{1}, {});
  return {.mean = {a.mean.x_m + x, a.mean.y_m + y, a.mean.yaw + b.mean.yaw},
          .covariance = detail::turned(a.covariance, Scalar{1}, Scalar{0}, -y, x, Scalar{1}, of_b)};
}

/// The way back.
template <class Scalar>
[[nodiscard]] UncertainDisplacement<Scalar> inverse(const UncertainDisplacement<Scalar>& a) {
  const auto turn = a.mean.yaw.direction();
  const Scalar x = -(turn.cos * a.mean.x_m + turn.sin * a.mean.y_m);
  const Scalar y = turn.sin * a.mean.x_m - turn.cos * a.mean.y_m;
  return {.mean = {x, y, Heading<Scalar>{} - a.mean.yaw},
          .covariance = detail::turned(a.covariance, -turn.cos, turn.sin, y, -x, Scalar{-1}, {})};
}

/// A displacement of a body as one of what is mounted there on it.
template <class Scalar>
[[nodiscard]] UncertainDisplacement<Scalar> as_of(const UncertainDisplacement<Scalar>& body,
                                                  const UncertainDisplacement<Scalar>& mounting) {
  return compose(compose(inverse(mounting), body), mounting);
}

}  // namespace tetap::slam
