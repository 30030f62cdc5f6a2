// SPDX-License-Identifier: Apache-2.0
// Runs one filter over the inputs on stdin and prints its state and covariance after each step, for reference_test.py.
// Usage: filter_reference SCENARIO FILTER SCALAR. A line of input is a step, numbers as the scenario's `step` takes
// them.
#include "support/euler_pose.hpp"
#include "tetap/filter/iterated_ekf.hpp"
#include "tetap/filter/joseph.hpp"
#include "tetap/filter/kalman.hpp"
#include "tetap/filter/sequential.hpp"
#include "tetap/filter/square_root.hpp"
#include "tetap/filter/structured_kalman.hpp"
#include "tetap/filter/ud.hpp"
#include "tetap/filter/ukf.hpp"
#include "tetap/filter/ukf_sqrt.hpp"
#include "tetap/model/constant_velocity.hpp"
#include "tetap/model/radar.hpp"
#include "tetap/model/target_position.hpp"

#include <array>
#include <cstdio>
#include <iostream>
#include <string_view>

namespace {

using namespace tetap;

template <class Filter, int N>
void set_covariance(Filter& filter, const filter::Symmetric<typename Filter::Scalar, N>& p) {
  if constexpr (requires { filter.set_covariance(p); }) {
    filter.set_covariance(p);
  } else {
    filter.p = p;
  }
}

template <class Scalar, std::size_t K>
bool read(std::array<Scalar, K>& numbers) {
  for (Scalar& n : numbers) {
    double value = 0;
    if (!(std::cin >> value)) return false;
    n = static_cast<Scalar>(value);
  }
  return true;
}
template <class Filter>
void print(const Filter& filter) {
  const auto p = [&] {
    if constexpr (requires { filter.covariance(); }) {
      return filter.covariance();
    } else {
      return filter.p;
    }
  }();
  for (int i = 0; i < Filter::kErrors; ++i) std::printf("%.17g ", static_cast<double>(filter.x.value(i)));
  for (int c = 0; c < Filter::kErrors; ++c)
    for (int r = 0; r <= c; ++r) std::printf("%.17g ", static_cast<double>(p(r, c)));
  std::printf("\n");
}
template <class Innovation>
bool accepted(const Innovation& innovation) {
  return innovation.verdict == filter::Verdict::kAccepted;
}

/// z_x z_y: constant velocity, dt 0.1, acceleration variance 0.5, R 0.25.
template <class Scalar>
struct Linear {
  using State = filter::VectorState<Scalar, 4>;
  template <class Filter>
  static bool run(Filter filter) {
    set_covariance<Filter, 4>(filter, filter::Symmetric<Scalar, 4>::diagonal({10, 5, 10, 5}));
    for (std::array<Scalar, 2> in; read(in); print(filter)) {
      if (!filter.predict(model::ConstantVelocity<Scalar>{.dt_s = static_cast<Scalar>(0.1),
                                                          .acceleration_variance = static_cast<Scalar>(0.5)}))
        return false;
      const filter::DirectMeasurement<Scalar, 4, 0, 2> z{.z = {in[0], in[1]},
                                                         .variance = {Scalar(0.25F), Scalar(0.25F)}};
      if (!accepted(filter.update(z, Scalar(1e9F)))) return false;
    }
    return true;
  }
};

/// ds dyaw range bearing: the unicycle with a landmark at (60, 20).
template <class Scalar>
struct Planar {
  using State = filter::VectorState<Scalar, 3>;
  template <class Filter>
  static bool run(Filter filter) {
    set_covariance<Filter, 3>(filter,
                              filter::Symmetric<Scalar, 3>::diagonal(
                                  {static_cast<Scalar>(0.1), static_cast<Scalar>(0.1), static_cast<Scalar>(0.05)}));
    for (std::array<Scalar, 4> in; read(in); print(filter)) {
      const test::EulerUnicycle<Scalar> motion{
          .ds_m = in[0],
          .dyaw_rad = in[1],
          .variance = {static_cast<Scalar>(1e-3), static_cast<Scalar>(1e-3), static_cast<Scalar>(1e-4)}};
      const test::EulerSight<Scalar> sight{
          .range_m = in[2], .bearing_rad = in[3], .variance = {static_cast<Scalar>(0.01), static_cast<Scalar>(4e-4)}};
      if (!filter.predict(motion) || !accepted(filter.update(sight, Scalar(1e9F)))) return false;
    }
    return true;
  }
};

/// kind a b c: kind 0 is lidar x y, 1 is radar range bearing rate; CTRV with augmented noise, dt 0.05.
template <class Scalar>
struct Turning {
  using State = model::CtrvState<Scalar>;
  template <class Filter>
  static bool run(Filter filter) {
    set_covariance<Filter, 5>(filter, filter::Symmetric<Scalar, 5>::diagonal(
                                          {Scalar(0.5F), Scalar(0.5F), 1, Scalar(0.125F), Scalar(0.125F)}));
    filter.x.value << 1, 2, 4, Scalar(0.5F), Scalar(0.5F);
    for (std::array<Scalar, 4> in; read(in); print(filter)) {
      if (!filter.predict(model::Ctrv<Scalar>{.dt_s = static_cast<Scalar>(0.05),
                                              .acceleration_variance = 1,
                                              .yaw_acceleration_variance = Scalar(0.25F)}))
        return false;
      const model::TargetPosition<State> lidar{.x_m = in[1], .y_m = in[2], .sigma_m = static_cast<Scalar>(0.15)};
      const model::Radar<State> radar{.range_m = in[1],
                                      .bearing_rad = in[2],
                                      .range_rate_mps = in[3],
                                      .sigma_range_m = static_cast<Scalar>(0.3),
                                      .sigma_bearing_rad = static_cast<Scalar>(0.03),
                                      .sigma_range_rate_mps = static_cast<Scalar>(0.3)};
      if (!(in[0] > Scalar(0.5F) ? accepted(filter.update(radar, Scalar(1e9F)))
                                 : accepted(filter.update(lidar, Scalar(1e9F)))))
        return false;
    }
    return true;
  }
};

template <class Scenario, class Scalar>
bool run_jacobian_filters(std::string_view name) {
  using State = typename Scenario::State;
  if (name == "ekf") return Scenario::run(filter::Ekf<State>{});
  if (name == "joseph") return Scenario::run(filter::JosephKalman<State>{});
  if (name == "sequential") return Scenario::run(filter::SequentialKalman<State>{});
  if (name == "ud") return Scenario::run(filter::UdKalman<State>{});
  if (name == "square_root") return Scenario::run(filter::SquareRootKalman<State>{});
  if (name == "structured") return Scenario::run(filter::StructuredKalman<State>{});
  if (name == "iterated") return Scenario::run(filter::IteratedEkf<State, 2>{});
  return false;
}
template <class Scenario, class Scalar>
bool run_unscented_filters(std::string_view name) {
  using State = typename Scenario::State;
  if (name == "ukf") return Scenario::run(filter::Ukf<State>{});
  if (name == "ukf_sqrt") return Scenario::run(filter::UkfSqrt<State>{});
  filter::Ukf<State, filter::RuntimeScaling> half;
  static_cast<void>(half.set_scaling({.kAlpha = 0.5F}));
  if (name == "ukf_half") return Scenario::run(half);
  filter::UkfSqrt<State, filter::RuntimeScaling> small;
  static_cast<void>(small.set_scaling({.kAlpha = 0.0625F}));
  if (name == "ukf_sqrt_small") return Scenario::run(small);
  return false;
}

template <class Scalar>
bool run(std::string_view scenario, std::string_view name) {
  const bool unscented = name.substr(0, 3) == "ukf";
  if (scenario == "linear") {
    return unscented ? run_unscented_filters<Linear<Scalar>, Scalar>(name)
                     : run_jacobian_filters<Linear<Scalar>, Scalar>(name);
  }
  if (scenario == "planar") {
    return unscented ? run_unscented_filters<Planar<Scalar>, Scalar>(name)
                     : run_jacobian_filters<Planar<Scalar>, Scalar>(name);
  }
  return scenario == "turning" && unscented && run_unscented_filters<Turning<Scalar>, Scalar>(name);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) {
    std::fprintf(stderr, "filter_reference SCENARIO FILTER float|double < STEPS\n");
    return 2;
  }
  const bool done = std::string_view(argv[3]) == "float" ? run<float>(argv[1], argv[2]) : run<double>(argv[1], argv[2]);
  if (!done) std::fprintf(stderr, "%s %s: unknown, or a step was refused\n", argv[1], argv[2]);
  return done ? 0 : 1;
}
