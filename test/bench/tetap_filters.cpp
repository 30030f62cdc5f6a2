// SPDX-License-Identifier: Apache-2.0
// tetap's own steps, compiled with the flags of the product: no gate and no guard as the others have none, and with
// both.
#include "bench/contestant.hpp"
#include "support/structured_models.hpp"
#include "tetap/filter/kalman.hpp"
#include "tetap/filter/structured_kalman.hpp"

namespace tetap::bench {
namespace {

template <class State>
Outcome outcome_of(const State& x, const filter::Symmetric<float, State::kErrors>& p) {
  Outcome out;
  for (int i = 0; i < State::kErrors; ++i) out.x.push_back(static_cast<double>(x.value(i)));
  for (int r = 0; r < State::kErrors; ++r)
    for (int c = 0; c < State::kErrors; ++c) out.p.push_back(static_cast<double>(r <= c ? p(r, c) : p(c, r)));
  return out;
}

template <filter::Guard kGuard, class Gate>
class Kalman final : public Filter<KalmanInput> {
 public:
  void start() override {
    kf_ = {};
    constexpr float kP = KalmanInput::kStartVariance;
    kf_.p = filter::Symmetric<float, 4>::diagonal({kP, kP, kP, kP});
  }
  void run(std::span<const KalmanInput> inputs) override {
    for (const KalmanInput& in : inputs) {
      kf_.predict(test::StructuredVelocity{.dt_s = KalmanInput::kDt_s,
                                           .acceleration_variance = KalmanInput::kAccelerationVariance});
      kf_.update(
          filter::DirectMeasurement<float, 4, 0, 2>{.z = {in.x_m, in.y_m},
                                                    .variance = {KalmanInput::kVariance, KalmanInput::kVariance}},
          Gate{});
    }
  }
  [[nodiscard]] Outcome outcome() const override { return outcome_of(kf_.x, kf_.p); }

 private:
  filter::StructuredKalman<filter::VectorState<float, 4>, kGuard> kf_;
};

template <filter::Guard kGuard, class Gate>
class Ekf final : public Filter<EkfInput> {
 public:
  void start() override {
    ekf_ = {};
    ekf_.p = filter::Symmetric<float, 3>::diagonal(EkfInput::kStartVariance);
  }
  void run(std::span<const EkfInput> inputs) override {
    for (const EkfInput& in : inputs) {
      ekf_.predict(test::StructuredUnicycle{{.ds_m = in.ds_m, .dyaw_rad = in.dyaw_rad, .variance = EkfInput::kQ}});
      ekf_.update(test::StructuredSight{{.range_m = in.range_m,
                                         .bearing_rad = in.bearing_rad,
                                         .variance = {EkfInput::kR[0], EkfInput::kR[1]},
                                         .landmark_x_m = EkfInput::kLandmarkX_m,
                                         .landmark_y_m = EkfInput::kLandmarkY_m}},
                  Gate{});
    }
  }
  [[nodiscard]] Outcome outcome() const override { return outcome_of(ekf_.x, ekf_.p); }

 private:
  filter::StructuredKalman<filter::VectorState<float, 3>, kGuard> ekf_;
};

/// A gate that computes the NIS and lets every measurement of this run through.
struct OpenGate {
  constexpr operator float() const { return 1e9F; }  // NOLINT(google-explicit-constructor)
};

}  // namespace

std::unique_ptr<Filter<KalmanInput>> tetap_kalman_plain() {
  return std::make_unique<Kalman<filter::Guard::kNone, filter::NoGate>>();
}
std::unique_ptr<Filter<KalmanInput>> tetap_kalman_guarded() {
  return std::make_unique<Kalman<filter::Guard::kVariances, OpenGate>>();
}
std::unique_ptr<Filter<EkfInput>> tetap_ekf_plain() {
  return std::make_unique<Ekf<filter::Guard::kNone, filter::NoGate>>();
}
std::unique_ptr<Filter<EkfInput>> tetap_ekf_guarded() {
  return std::make_unique<Ekf<filter::Guard::kVariances, OpenGate>>();
}

}  // namespace tetap::bench
