// SPDX-License-Identifier: Apache-2.0
// A visual window beside an inertial sensor: it is started from a rest, knows the camera's time offset with a sigma,
// and takes images in which nothing moves for a standstill (docs/explanation/visual_window.md).
#pragma once

#include "tetap/filter/quaternion.hpp"
#include "tetap/slam/inertial_core.hpp"
#include "tetap/slam/visual_window.hpp"

namespace tetap::slam {

/// Means of an inertial sensor at rest.
class RestMeans {
 public:
  void add(const nav::ImuIncrement& imu) {
    if (imu.check() != nav::ImuVerdict::kAccepted) return;
    turn_rad_ += imu.dtheta_b_rad;
    gain_mps_ += imu.dv_b_mps;
    time_s_ += base::seconds(imu.dt);
  }
  [[nodiscard]] bool known() const { return time_s_ > 0.5F && gain_mps_.squaredNorm() > 0.0F; }
  [[nodiscard]] nav::Vector3 rate_radps() const { return turn_rad_ * (1.0F / time_s_); }
  /// By the least turn that levels the mean force, then one by `turn_rad` about the plumb line.
  [[nodiscard]] nav::Quaternion attitude(float turn_rad) const {
    const filter::Quaternion q = filter::levelled({gain_mps_(0), gain_mps_(1), gain_mps_(2)});
    return nav::exp_quaternion({0.0F, 0.0F, turn_rad}) * nav::Quaternion{q.w, q.x, q.y, q.z};
  }

 private:
  nav::Vector3 turn_rad_ = nav::Vector3::Zero(), gain_mps_ = nav::Vector3::Zero();
  float time_s_ = 0;
};

/// Window: VisualWindow or VisualMap over an InertialCore. Images come when the state is at their moment: the stamp and
/// time_offset_s().
template <class Window>
class VisualInertial : public Window {
  using Root = VisualWindow<typename Window::Core, Window::kClones, Window::kTracks, Window::kPoints>;

 public:
  using Core = typename Window::Core;
  static constexpr int kOffset = Window::kCore + Core::kOffset;
  static_assert(Window::kClones >= 8, "a standstill needs poses that are older than the start they may hide");

  using Window::Window;

  /// At rest, with the means of a rest before. `turn_rad`: see RestMeans. The sigma of the tilt is that of the
  /// accelerometer's bias.
  [[nodiscard]] bool start_at_rest(const RestMeans& rest, float turn_rad, float sigma_turn_rad,
                                   const std::array<std::int64_t, 3>& origin_um, float sigma_place_m) {
    if (!rest.known()) return false;
    const float tilt = base::sqrt(own_core().variance(Core::kAccelBias)) / nav::Earth{}.gravity_mps2;
    Window::start(rest.attitude(turn_rad), nav::Vector3{tilt, tilt, sigma_turn_rad}, origin_um,
                  nav::Vector3::Constant(sigma_place_m));
    own_core().know_gyro_bias(rest.rate_radps());
    stood_ = 0;
    return true;
  }
  [[nodiscard]] float time_offset_s() const { return Root::core().time_offset_s(); }
  /// The latest image was one of a standstill.
  [[nodiscard]] bool stands() const { return stood_ > 0; }

  [[nodiscard]] bool begin_image(std::span<ImageFeature> image) {
    if (this->Root::job_ == Root::kIdle) {
      own_core().predict_covariance(own_covariance(), Window::kCore);
      stood_ = nothing_moves(image) ? stood_ + 1 : 0;
      if (stood_ > 0) hold();
    }
    return Window::begin_image(image);
  }
  /// The clone is of the moment that the offset gives, so an error of the offset moves it along the path.
  [[nodiscard]] bool end_image(std::span<const ImageFeature> image) {
    const int slot = this->Root::slot_;
    if (!Window::end_image(image)) return false;
    if (stands()) return true;
    const nav::Vector3& rate = own_core().rate_n_radps();
    const nav::Vector3 way = known_speed() - nav::cross(rate, Root::pose().p_n_m);
    for (int i = 0; i < 3; ++i) {
      own_covariance().add_share(Root::state_of(slot) + i, rate(i), kOffset);
      own_covariance().add_share(Root::state_of(slot) + 3 + i, way(i), kOffset);
    }
    return true;
  }
  static constexpr auto members(auto& self) { return base::members(base::base_of<Window>(self), self.stood_); }

 private:
  static constexpr int kLeastTracks = 8, kLag = Window::kClones / 2 - 1;
  static constexpr float kMostShift = 25.0F;  ///< squared, in sigmas of a pixel: one in 500 is above
  /// Sigmas of the difference between two poses of a standstill: images do not show less.
  static constexpr float kStillTurn_rad = 3e-4F, kStill_m = 1e-3F;
  static constexpr float kKnown = 9.0F;  ///< squared velocity over the variance of its three axes
  static constexpr float kGate = 16.0F;  ///< NIS of a scalar, at most
  struct Term {
    int state;
    float share;
  };

  [[nodiscard]] Core& own_core() { return this->Root::core_; }
  [[nodiscard]] auto& own_covariance() { return this->Root::p_; }

  /// The velocity, but zero where it is hardly more than its error: a row with the error in it moves the offset astray.
  [[nodiscard]] nav::Vector3 known_speed() {
    constexpr int kSpeed = Window::kCore + Core::kVelocity;
    const nav::Vector3& v = own_core().velocity_n_mps();
    float variance = 0.0F;
    for (int i = 0; i < 3; ++i) variance += own_covariance()(kSpeed + i, kSpeed + i);
    const bool known = v.squaredNorm() > kKnown * variance;
    return known ? v : nav::Vector3(nav::Vector3::Zero());
  }
  /// Features against where they were kLag images ago or before: at rest a shift has the mean square 4 sigma^2 and the
  /// same deviation; wrong matches apart, which are less than a third.
  [[nodiscard]] bool nothing_moves(std::span<const ImageFeature> image) const {
    const float sigma2 = 16.0F * this->Root::options_.sigma_px * this->Root::options_.sigma_px;  // quarter pixels
    int seen = 0, quiet = 0;
    float sum = 0.0F;
    for (int i = 0; i < Window::kTracks; ++i) {
      const auto& track = Root::tracks().track(i);
      if (!track.live || track.count < kLag) continue;
      for (const ImageFeature& feature : image) {
        if (feature.id != track.id) continue;
        const auto& before = track.seen[static_cast<std::size_t>(track.slot(0))];
        const float du = static_cast<float>(feature.u_quarter_px) - static_cast<float>(before[0]);
        const float dv = static_cast<float>(feature.v_quarter_px) - static_cast<float>(before[1]);
        const float square = (du * du + dv * dv) / sigma2;
        ++seen;
        if (square > kMostShift) break;
        ++quiet;
        sum += square;
        break;
      }
    }
    const auto n = static_cast<float>(quiet);
    return quiet >= kLeastTracks && 3 * quiet > 2 * seen && sum < 4.0F * n + 10.0F * base::sqrt(n);
  }
  /// Two poses of half a window ago are one. The latest ones may belong to a start that pixels do not show yet.
  void hold() {
    if (this->Root::live_ < kLag) return;
    const auto at = [&](int ago) { return (this->Root::slot_ + Window::kClones - ago) % Window::kClones; };
    const int late = Root::state_of(at(kLag - 1)), early = Root::state_of(at(kLag));
    const auto& clones = this->Root::clone_;
    const WorldPose before = clones[static_cast<std::size_t>(at(kLag))],
                    after = clones[static_cast<std::size_t>(at(kLag - 1))];
    const nav::Vector3 turn = nav::log_quaternion(before.q_nb * after.q_nb.conjugate());
    const nav::Vector3 shift = before.p_n_m - after.p_n_m, &lever = after.p_n_m;
    typename Window::Covariance::States dx{};
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3, k = (i + 2) % 3;  // rho + theta x p
      take(std::array{Term{late + i, 1.0F}, Term{early + i, -1.0F}}, turn(i), kStillTurn_rad, dx);
      take(std::array{Term{late + 3 + i, 1.0F}, Term{early + 3 + i, -1.0F}, Term{late + j, lever(k)},
                      Term{early + j, -lever(k)}, Term{late + k, -lever(j)}, Term{early + k, lever(j)}},
           shift(i), kStill_m, dx);
    }
    this->Root::correct(dx.data());
  }
  /// One scalar measurement; `dx` collects the correction.
  template <std::size_t kTerms>
  void take(const std::array<Term, kTerms>& h, float z, float sigma, typename Window::Covariance::States& dx) {
    auto& p = own_covariance();
    typename Window::Covariance::template Rows<1> gain{};
    float s = sigma * sigma, nu = z;
    for (const Term& a : h) {
      nu -= a.share * dx[static_cast<std::size_t>(a.state)];
      for (const Term& b : h) s += a.share * b.share * p(a.state, b.state);
    }
    if (!(s > 0.0F) || !(nu * nu < kGate * s)) return;
    const float inverse = 1.0F / base::sqrt(s);
    for (int n = 0; n < p.size(); ++n) {
      float sum = 0.0F;
      for (const Term& a : h) sum += a.share * p(n, a.state);
      gain[static_cast<std::size_t>(n)][0] = sum * inverse;
      dx[static_cast<std::size_t>(n)] += gain[static_cast<std::size_t>(n)][0] * (nu * inverse);
    }
    p.template subtract<1>(gain, 0);
  }

  std::int64_t stood_ = 0;  ///< images of the present standstill
};

}  // namespace tetap::slam
