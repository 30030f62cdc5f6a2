// SPDX-License-Identifier: Apache-2.0
// Common parts of the implementations of `make bench`. Each one is a shared library of its own with hidden symbols. Two
// of them in one program, compiled with other settings of Eigen, would share each other's functions.
#pragma once

#include <array>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace tetap::bench {

inline constexpr int kSteps = 256;

/// W1: constant velocity in the plane, x = (px, vx, py, vy), a position. One step: a prediction and an update.
struct KalmanInput {
  static constexpr int kStates = 4;
  static constexpr float kDt_s = 0.1F, kAccelerationVariance = 0.1F, kVariance = 0.25F, kStartVariance = 10.0F;
  float x_m = 0, y_m = 0;
};

/// W2: unicycle of one Euler step, x = (px, py, yaw), range and bearing to a landmark. One step: a prediction and an
/// update. Bearings do not wrap on this path.
struct EkfInput {
  static constexpr int kStates = 3;
  static constexpr std::array<float, 3> kQ{1e-3F, 1e-3F, 1e-4F}, kStartVariance{0.1F, 0.1F, 0.05F};
  static constexpr std::array<float, 2> kR{0.01F, 4e-4F};
  static constexpr float kLandmarkX_m = 60.0F, kLandmarkY_m = 20.0F;
  float ds_m = 0, dyaw_rad = 0, range_m = 0, bearing_rad = 0;
};

/// State and covariance, row by row.
struct Outcome {
  std::vector<double> x, p;
};

/// A filter that starts anew and takes a row of steps.
template <class Input>
class Filter {
 public:
  virtual ~Filter() = default;
  virtual void start() = 0;
  virtual void run(std::span<const Input> inputs) = 0;
  [[nodiscard]] virtual Outcome outcome() const = 0;
};
template <class Input>
using Make = std::unique_ptr<Filter<Input>> (*)();

/// A planar pose graph: loaded once, solved from its odometry as often as wanted.
class GraphSolver {
 public:
  virtual ~GraphSolver() = default;
  /// Resets the contestant, outside of the timed work.
  virtual void reset() = 0;
  virtual void solve() = 0;
  /// x, y, yaw of each pose.
  [[nodiscard]] virtual std::vector<std::array<double, 3>> track() const = 0;
};
using MakeGraph = std::unique_ptr<GraphSolver> (*)(const std::string& g2o);

#define TETAP_BENCH_EXPORT __attribute__((visibility("default")))
TETAP_BENCH_EXPORT std::unique_ptr<Filter<KalmanInput>> tetap_kalman_plain();
TETAP_BENCH_EXPORT std::unique_ptr<Filter<KalmanInput>> tetap_kalman_guarded();
TETAP_BENCH_EXPORT std::unique_ptr<Filter<EkfInput>> tetap_ekf_plain();
TETAP_BENCH_EXPORT std::unique_ptr<Filter<EkfInput>> tetap_ekf_guarded();
TETAP_BENCH_EXPORT std::unique_ptr<GraphSolver> tetap_graph(const std::string& g2o);
TETAP_BENCH_EXPORT std::unique_ptr<Filter<KalmanInput>> textbook_kalman();
TETAP_BENCH_EXPORT std::unique_ptr<Filter<EkfInput>> textbook_ekf();
TETAP_BENCH_EXPORT std::unique_ptr<Filter<KalmanInput>> opencv_kalman();
TETAP_BENCH_EXPORT std::unique_ptr<Filter<EkfInput>> opencv_ekf();
TETAP_BENCH_EXPORT std::unique_ptr<Filter<KalmanInput>> bfl_kalman();
TETAP_BENCH_EXPORT std::unique_ptr<Filter<EkfInput>> bfl_ekf();
TETAP_BENCH_EXPORT std::unique_ptr<GraphSolver> ceres_graph(const std::string& g2o);

}  // namespace tetap::bench
