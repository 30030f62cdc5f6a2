// SPDX-License-Identifier: Apache-2.0
// The same work by tetap and by others, in one run: tetap-bench M3500.g2o [Google Benchmark's options].
//
// Before anything is timed, every filter's state and covariance are held against Joseph's form in double. Every solved
// graph is held against its file. A difference is an error, and no time is printed. One `item` is a step or a solution.
#include "bench/contestant.hpp"
#include "slam/g2o.hpp"

#include <benchmark/benchmark.h>
#include <Eigen/Dense>
#include <cmath>
#include <cstdio>
#include <random>

namespace {

using namespace tetap::bench;

std::array<KalmanInput, kSteps> kalman_inputs() {
  std::array<KalmanInput, kSteps> inputs;
  std::mt19937 random(1);
  std::normal_distribution<float> normal;
  for (int k = 0; k < kSteps; ++k) {
    const float t_s = 0.1F * static_cast<float>(k);
    auto& in = inputs[static_cast<std::size_t>(k)];
    in.x_m = t_s + 0.5F * normal(random);
    in.y_m = 0.5F * t_s + 0.5F * normal(random);
  }
  return inputs;
}
std::array<EkfInput, kSteps> ekf_inputs() {
  std::array<EkfInput, kSteps> inputs;
  std::mt19937 random(2);
  std::normal_distribution<double> normal;
  double x = 0, y = 0, yaw = 0;
  for (int k = 0; k < kSteps; ++k) {
    auto& in = inputs[static_cast<std::size_t>(k)];
    in.ds_m = 0.1F;
    in.dyaw_rad = static_cast<float>(0.03 * std::cos(0.05 * k));
    x += 0.1 * std::cos(yaw);
    y += 0.1 * std::sin(yaw);
    yaw += static_cast<double>(in.dyaw_rad);
    const double dx = static_cast<double>(EkfInput::kLandmarkX_m) - x,
                 dy = static_cast<double>(EkfInput::kLandmarkY_m) - y;
    in.range_m = static_cast<float>(std::hypot(dx, dy) + 0.1 * normal(random));
    in.bearing_rad = static_cast<float>(std::atan2(dy, dx) - yaw + 0.02 * normal(random));
  }
  return inputs;
}

/// Joseph's form in double (Bar-Shalom, Li, Kirubarajan 2001, eq. 5.2.3-18).
template <int N>
struct Reference {
  Eigen::Matrix<double, N, 1> x = Eigen::Matrix<double, N, 1>::Zero();
  Eigen::Matrix<double, N, N> p = Eigen::Matrix<double, N, N>::Zero();
  void correct(const Eigen::Matrix<double, 2, N>& h, const Eigen::Vector2d& nu, const Eigen::Matrix2d& r) {
    const Eigen::Matrix2d s = h * p * h.transpose() + r;
    const Eigen::Matrix<double, N, 2> k = p * h.transpose() * s.inverse();
    const Eigen::Matrix<double, N, N> left = Eigen::Matrix<double, N, N>::Identity() - k * h;
    x += k * nu;
    p = (left * p * left.transpose() + k * r * k.transpose()).eval();
  }
};
Reference<4> reference(std::span<const KalmanInput> inputs) {
  const double dt = static_cast<double>(KalmanInput::kDt_s),
               q = static_cast<double>(KalmanInput::kAccelerationVariance);
  Reference<4> kf;
  kf.p = Eigen::Matrix4d::Identity() * static_cast<double>(KalmanInput::kStartVariance);
  Eigen::Matrix4d f = Eigen::Matrix4d::Identity(), noise = Eigen::Matrix4d::Zero();
  Eigen::Matrix<double, 2, 4> h = Eigen::Matrix<double, 2, 4>::Zero();
  for (int i = 0; i < 4; i += 2) {
    f(i, i + 1) = dt;
    noise.block<2, 2>(i, i) << dt * dt * dt * dt / 4, dt * dt * dt / 2, dt * dt * dt / 2, dt * dt;
    h(i / 2, i) = 1;
  }
  for (const KalmanInput& in : inputs) {
    kf.x = f * kf.x;
    kf.p = (f * kf.p * f.transpose() + q * noise).eval();
    const Eigen::Vector2d z(static_cast<double>(in.x_m), static_cast<double>(in.y_m));
    kf.correct(h, z - h * kf.x, Eigen::Matrix2d::Identity() * static_cast<double>(KalmanInput::kVariance));
  }
  return kf;
}
Reference<3> reference(std::span<const EkfInput> inputs) {
  const auto wide = [](const auto& numbers) {
    Eigen::VectorXd out(static_cast<Eigen::Index>(numbers.size()));
    for (std::size_t i = 0; i < numbers.size(); ++i)
      out(static_cast<Eigen::Index>(i)) = static_cast<double>(numbers[i]);
    return out;
  };
  Reference<3> ekf;
  ekf.p = wide(EkfInput::kStartVariance).asDiagonal();
  const Eigen::Matrix3d q = wide(EkfInput::kQ).asDiagonal();
  const Eigen::Matrix2d r = wide(EkfInput::kR).asDiagonal();
  for (const EkfInput& in : inputs) {
    const double ds = static_cast<double>(in.ds_m), s = std::sin(ekf.x(2)), c = std::cos(ekf.x(2));
    Eigen::Matrix3d f = Eigen::Matrix3d::Identity();
    f(0, 2) = -ds * s;
    f(1, 2) = ds * c;
    ekf.x += Eigen::Vector3d(ds * c, ds * s, static_cast<double>(in.dyaw_rad));
    ekf.p = (f * ekf.p * f.transpose() + q).eval();
    const double dx = static_cast<double>(EkfInput::kLandmarkX_m) - ekf.x(0);
    const double dy = static_cast<double>(EkfInput::kLandmarkY_m) - ekf.x(1), range = std::hypot(dx, dy);
    Eigen::Matrix<double, 2, 3> h;
    h << -dx / range, -dy / range, 0, dy / range / range, -dx / range / range, -1;
    const Eigen::Vector2d z_hat(range, std::atan2(dy, dx) - ekf.x(2));
    ekf.correct(h, Eigen::Vector2d(static_cast<double>(in.range_m), static_cast<double>(in.bearing_rad)) - z_hat, r);
  }
  return ekf;
}

struct Difference {
  double state = 0;       ///< in standard deviations
  double covariance = 0;  ///< in sigma_i sigma_j
};
/// A share of these is rounding of float over 256 steps; a filter of another model is beyond by orders of magnitude.
constexpr Difference kMost{.state = 2e-3, .covariance = 1e-3};

template <int N>
Difference difference(const Outcome& found, const Reference<N>& truth) {
  Difference worst;
  for (int r = 0; r < N; ++r) {
    const double sigma = std::sqrt(truth.p(r, r));
    const double off = std::abs(found.x[static_cast<std::size_t>(r)] - truth.x(r)) / sigma;
    worst.state = std::isfinite(off) ? std::max(worst.state, off) : 1e9;
    for (int c = 0; c < N; ++c) {
      const double d =
          std::abs(found.p[static_cast<std::size_t>(r * N + c)] - truth.p(r, c)) / (sigma * std::sqrt(truth.p(c, c)));
      worst.covariance = std::isfinite(d) ? std::max(worst.covariance, d) : 1e9;
    }
  }
  return worst;
}

template <class Input>
void time_steps(benchmark::State& state, Make<Input> make, const std::array<Input, kSteps>& inputs, Difference off) {
  const auto filter = make();
  for (auto _ : state) {
    filter->start();
    filter->run(inputs);
    benchmark::ClobberMemory();
  }
  state.SetItemsProcessed(state.iterations() * kSteps);
  state.counters["state_sigmas"] = off.state;
  state.counters["covariance"] = off.covariance;
}

template <class Input>
struct Entry {
  const char* name;
  Make<Input> make;
};
template <class Input>
bool enter(const char* workload, std::span<const Entry<Input>> entries, const std::array<Input, kSteps>& inputs) {
  const auto truth = reference(std::span<const Input>(inputs));
  bool agree = true;
  for (const Entry<Input>& one : entries) {
    const auto filter = one.make();
    filter->start();
    filter->run(inputs);
    const Difference off = difference(filter->outcome(), truth);
    if (!(off.state <= kMost.state && off.covariance <= kMost.covariance)) {
      std::fprintf(stderr,
                   "tetap-bench: %s of %s: state off by %.2g sigma, covariance by %.2g; at most %.2g and %.2g\n",
                   workload, one.name, off.state, off.covariance, kMost.state, kMost.covariance);
      agree = false;
    }
    benchmark::RegisterBenchmark(
        (std::string(workload) + "/" + one.name).c_str(),
        [&inputs, make = one.make, off](benchmark::State& state) { time_steps<Input>(state, make, inputs, off); });
  }
  return agree;
}

double chi2_of(const tetap::test::G2oGraph& file, const std::vector<std::array<double, 3>>& track) {
  const auto pose = [&](int i) { return Eigen::Vector3d(track[static_cast<std::size_t>(i)].data()); };
  double sum = 0;
  for (const auto& edge : file.edges) sum += tetap::test::g2o_chi2(edge, pose(edge.from), pose(edge.to));
  return sum;
}

bool enter_graphs(const std::string& path) {
  const tetap::test::G2oGraph file = tetap::test::read_g2o(path);
  static constexpr std::array<std::pair<const char*, MakeGraph>, 2> kSolvers{
      {{"tetap", tetap_graph}, {"ceres", ceres_graph}}};
  std::vector<double> found;
  for (const auto& [name, make] : kSolvers) {
    const std::shared_ptr<GraphSolver> solver = make(path);
    solver->reset();
    solver->solve();
    const double chi2 = chi2_of(file, solver->track());
    found.push_back(chi2);
    benchmark::RegisterBenchmark((std::string("pose_graph/") + name).c_str(), [solver, chi2](benchmark::State& state) {
      for (auto _ : state) {
        state.PauseTiming();
        solver->reset();
        state.ResumeTiming();
        solver->solve();
      }
      state.SetItemsProcessed(state.iterations());
      state.counters["chi2"] = chi2;
    });
  }
  if (std::abs(found[0] - found[1]) <= 1e-5 * found[1]) return true;
  std::fprintf(stderr, "tetap-bench: chi2 of the graph: tetap %.9g, Ceres %.9g\n", found[0], found[1]);
  return false;
}

}  // namespace

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (argc != 2) {
    std::fprintf(stderr, "tetap-bench M3500.g2o [--benchmark_...]\n");
    return 2;
  }
  static const auto kalman = kalman_inputs();
  static const auto ekf = ekf_inputs();
  static constexpr std::array<Entry<KalmanInput>, 5> kKalman{{{"tetap", tetap_kalman_plain},
                                                              {"tetap_gate_guard", tetap_kalman_guarded},
                                                              {"textbook", textbook_kalman},
                                                              {"opencv", opencv_kalman},
                                                              {"bfl", bfl_kalman}}};
  static constexpr std::array<Entry<EkfInput>, 5> kEkf{{{"tetap", tetap_ekf_plain},
                                                        {"tetap_gate_guard", tetap_ekf_guarded},
                                                        {"textbook", textbook_ekf},
                                                        {"opencv", opencv_ekf},
                                                        {"bfl", bfl_ekf}}};
  bool agree = enter<KalmanInput>("kalman", kKalman, kalman);
  agree = enter<EkfInput>("ekf", kEkf, ekf) && agree;
  try {
    agree = enter_graphs(argv[1]) && agree;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "tetap-bench: %s: %s\n", argv[1], error.what());
    return 1;
  }
  if (!agree) return 1;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
