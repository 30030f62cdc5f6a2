// SPDX-License-Identifier: Apache-2.0
// One track as a measurement of the poses it was seen from: the multi-state constraint (Mourikis & Roumeliotis 2007).
// Work is cut in steps of bounded cost. The point's own error leaves the rows by three Householder reflections, applied
// to the residual, to S = H P H^T from both sides and to G = P H^T. P is multiplied by sparse rows alone.
#pragma once

#include "tetap/filter/big_covariance.hpp"
#include "tetap/slam/point_sighting.hpp"
#include "tetap/slam/triangulate.hpp"

namespace tetap::slam {

enum class TrackFate : std::uint8_t {
  kPending,
  kUsed,
  kGated,     ///< NIS above 99 % of chi-square: nothing changed
  kNoDepth,   ///< its point was not found, or lies behind a view
  kSingular,  ///< S has no factor, or something is no number
  kKept,      ///< used, and its point joined the map
  kNoRoom,    ///< used, and the map had no room for its point
  kAlone      ///< a sighting of the map that no other one of its image bears out, though the pose is uncertain
};

struct TrackRecord {
  std::uint16_t id = 0;
  std::uint8_t sightings = 0, degrees = 0;
  TrackFate fate = TrackFate::kPending;
  float nis = -1.0F;  ///< chi-square with `degrees` when all is well; negative: not reached
};

/// Chi-square at 99 % for 3, 5, ... 29 degrees (Abramowitz & Stegun, table 26.8): a track of n sightings has 2 n - 3.
[[nodiscard]] constexpr float track_gate(int sightings) {
  constexpr std::array<float, 14> kQuantile{11.345F, 15.086F, 18.475F, 21.666F, 24.725F, 27.688F, 30.578F,
                                            33.409F, 36.191F, 38.932F, 41.638F, 44.314F, 46.963F, 49.588F};
  return kQuantile[static_cast<std::size_t>(sightings < 3 ? 0 : sightings > 16 ? 13 : sightings - 3)];
}

/// States 0 to 2 are the camera's rotation, six from View::state on are those of the pose. Of kStates those are used
/// that the covariance has.
template <int kStates, int kClones>
class TrackUpdate {
 public:
  static constexpr int kRows = 2 * kClones, kPoint = 3;
  using Covariance = filter::BigCovariance<float, kStates>;
  using Dx = typename Covariance::States;

  struct View {
    WorldPose pose;
    model::ImagePoint seen;
    std::int32_t state = 0;
  };

  /// `keep`: the point of the track joins the states when its depth is known well.
  void begin(std::uint16_t id, bool keep = false) {
    record_ = {.id = id};
    count_ = 0;
    keep_ = keep;
    step_ = Step::kViews;
    index_ = 0;
  }
  void add(const View& view) { view_[at(count_++)] = view; }
  [[nodiscard]] bool busy() const { return step_ != Step::kNone; }
  [[nodiscard]] const TrackRecord& record() const { return record_; }
  /// Correction of all states: meaningful after an update that was used.
  [[nodiscard]] const Dx& dx() const { return dx_; }
  /// The point at which the update was linearised, and the step from there that its own rows ask for.
  [[nodiscard]] const nav::Vector3& point_n_m() const { return point_n_m_; }
  [[nodiscard]] const nav::Vector3& point_step_m() const { return point_step_m_; }

  /// The next step; its cost in units of about ten floating-point operations. `sigma` is the noise of a direction,
  /// `considered` the scale's state, which no image corrects, negative for none.
  int step(Covariance& p, const model::CameraMounting& camera, float sigma, int considered) {
    switch (step_) {
      case Step::kNone:
        return 0;
      case Step::kViews:
        return relate(camera);
      case Step::kDepth:
        return iterate(camera, sigma);
      case Step::kRows:
        return add_rows(p, camera);
      case Step::kInnovation:
        return add_innovation();
      case Step::kProject:
        return reflect();
      case Step::kGate:
        return gate(p, sigma, considered);
      case Step::kKeep:
        return keep(p, sigma);
      case Step::kGain:
        return gain();
      case Step::kCorrect:
        break;
    }
    return correct(p);
  }

 private:
  enum class Step : std::uint8_t { kNone, kViews, kDepth, kRows, kInnovation, kProject, kGate, kKeep, kGain, kCorrect };
  /// Greatest sigma of an inverse depth, as a share of it, with which a point joins the states: the row then is linear.
  static constexpr float kSharp = 0.1F;
  static constexpr std::size_t at(int i) { return static_cast<std::size_t>(i); }
  [[nodiscard]] int rows() const { return 2 * count_; }

  int end(TrackFate fate, int cost) {
    record_.fate = fate;
    step_ = Step::kNone;
    return cost;
  }
  int next(Step step, int cost) {
    step_ = step;
    index_ = 0;
    return cost;
  }

  int relate(const model::CameraMounting& camera) {
    record_.sightings = static_cast<std::uint8_t>(count_);
    record_.degrees = static_cast<std::uint8_t>(rows() - kPoint);
    if (count_ < 3) return end(TrackFate::kNoDepth, 1);
    const nav::Quaternion q_nc0 = view_[0].pose.q_nb * camera.q_cb.conjugate();
    const nav::Vector3 origin = place(view_[0], camera);
    for (int k = 0; k < count_; ++k) {
      const nav::Quaternion q_cn = camera.q_cb * view_[at(k)].pose.q_nb.conjugate();
      relative_[at(k)] = {.r = (q_cn * q_nc0).matrix(),
                          .d_m = q_cn.rotate(origin - place(view_[at(k)], camera)),
                          .seen = view_[at(k)].seen};
    }
    depth_ = InverseDepth(view_[0].seen);
    return next(Step::kDepth, 15 * count_);
  }
  static nav::Vector3 place(const View& view, const model::CameraMounting& camera) {
    return view.pose.p_n_m + view.pose.q_nb.rotate(camera.lever_b_m);
  }

  int iterate(const model::CameraMounting& camera, float sigma) {
    const int cost = 5 + 12 * count_;
    depth_.iterate({relative_.data(), at(count_)}, sigma);
    if (depth_.fate() == DepthFate::kSought) return cost;
    if (depth_.fate() != DepthFate::kFound) return end(TrackFate::kNoDepth, cost);
    const nav::Quaternion q_nc0 = view_[0].pose.q_nb * camera.q_cb.conjugate();
    point_n_m_ = place(view_[0], camera) + q_nc0.rotate(depth_.point_m());
    return next(Step::kRows, cost);
  }

  /// Two rows of H, of the point's part of it and of the residual, and two columns of G = P H^T.
  int add_rows(const Covariance& p, const model::CameraMounting& camera) {
    const View& view = view_[at(index_)];
    states_ = p.size();
    const PointSighting sighting(view.pose, camera, point_n_m_);
    if (!sighting.at.seen) return end(TrackFate::kNoDepth, 15);
    h_[at(index_)] = sighting.h;
    of_point_[at(2 * index_)] = sighting.of_point[0];
    of_point_[at(2 * index_ + 1)] = sighting.of_point[1];
    nu_[at(2 * index_)] = view.seen.x - sighting.at.at.x;
    nu_[at(2 * index_ + 1)] = view.seen.y - sighting.at.at.y;
    p.template times<2, 3, 6>(h_[at(index_)], view.state, g_, 2 * index_);
    if (++index_ == count_) return next(Step::kInnovation, 15 + 4 * states_);
    return 15 + 4 * states_;
  }

  /// Rows 2 k and 2 k + 1 of H P H^T against all rows up to them.
  int add_innovation() {
    const int k = index_, cost = 8 * (k + 1);
    for (int w = 0; w <= 2 * k + 1; ++w) {
      const auto& row = h_[at(w / 2)][at(w % 2)];
      const int state = view_[at(w / 2)].state;
      for (int q = 2 * k; q < 2 * k + 2; ++q) {
        float sum = 0.0F;
        for (int n = 0; n < 3; ++n) sum += row[at(n)] * g_[at(n)][at(q)];
        for (int n = 0; n < 6; ++n) sum += row[at(3 + n)] * g_[at(state + n)][at(q)];
        s_[at(q)][at(w)] = s_[at(w)][at(q)] = sum;
      }
    }
    if (++index_ == count_) return next(Step::kProject, cost);
    return cost;
  }

  /// One Householder reflection (Golub & Van Loan 2013, alg. 5.1.1): column `index_` of the point's part is zero below.
  int reflect() {
    const int c = index_, m = rows(), cost = (m - c) * (states_ + 2 * m) * 2 / 5;
    std::array<float, kRows> u{};
    float square = 0.0F;
    for (int q = c; q < m; ++q) {
      u[at(q)] = of_point_[at(q)][at(c)];
      square += u[at(q)] * u[at(q)];
    }
    if (!(square > 1e-20F) || !(square < 1e20F)) return end(TrackFate::kSingular, cost);
    const float length = base::sqrt(square);
    const float head = u[at(c)];
    u[at(c)] += head > 0.0F ? length : -length;
    const float scale = 1.0F / (square + length * base::abs(head));  // 2 / u^T u
    const auto turn = [&](auto&& entry) __attribute__((always_inline)) {
      float sum = 0.0F;
      for (int q = c; q < m; ++q) sum += u[at(q)] * entry(q);
      sum *= scale;
      for (int q = c; q < m; ++q) entry(q) -= sum * u[at(q)];
    };
    for (int j = c; j < kPoint; ++j) turn([&](int q) -> float& { return of_point_[at(q)][at(j)]; });
    turn([&](int q) -> float& { return nu_[at(q)]; });
    for (int j = 0; j < m; ++j) turn([&](int q) -> float& { return s_[at(q)][at(j)]; });
    for (int j = 0; j < m; ++j) turn([&](int q) -> float& { return s_[at(j)][at(q)]; });
    for (int n = 0; n < states_; ++n) turn([&](int q) -> float& { return g_[at(n)][at(q)]; });
    if (++index_ == kPoint) return next(Step::kGate, cost);
    return cost;
  }

  /// No image sees the considered scale. Rows see some of it where an estimate moved after its way was driven. Without
  /// that part P H^T and S are those of a known scale, and what P has of the scale stays.
  void leave_scale(const Covariance& p, int considered) {
    if (considered < 0 || !(p(considered, considered) > 0.0F)) return;
    const int m = rows();
    const float inverse = 1.0F / p(considered, considered);
    const auto seen = g_[at(considered)];  // H P_s
    for (int n = 0; n < states_; ++n) {
      const float share = inverse * p(n, considered);
      for (int q = kPoint; q < m; ++q) g_[at(n)][at(q)] -= share * seen[at(q)];
    }
    for (int q = 0; q < m; ++q)
      for (int w = kPoint; w < m; ++w) s_[at(q)][at(w)] -= inverse * seen[at(q)] * seen[at(w)];
    for (int q = kPoint; q < m; ++q) g_[at(considered)][at(q)] = 0.0F;  // without a rounding error
  }

  /// L of S + R in place, nu becomes L^-1 nu; the gate.
  int gate(const Covariance& p, float sigma, int considered) {
    const int m = rows(), cost = m * m * m / 30 + (m - kPoint) * (states_ + m) / 5 + 10;
    leave_scale(p, considered);
    float nis = 0.0F;
    for (int q = kPoint; q < m; ++q) {
      for (int w = kPoint; w < q; ++w) {
        float sum = s_[at(q)][at(w)];
        for (int k = kPoint; k < w; ++k) sum -= s_[at(q)][at(k)] * s_[at(w)][at(k)];
        s_[at(q)][at(w)] = sum * s_[at(w)][at(w)];
      }
      float pivot = s_[at(q)][at(q)] + sigma * sigma, rest = nu_[at(q)];
      for (int k = kPoint; k < q; ++k) {
        pivot -= s_[at(q)][at(k)] * s_[at(q)][at(k)];
        rest -= s_[at(q)][at(k)] * nu_[at(k)];
      }
      if (!(pivot > 0.0F) || !(pivot < 1e20F)) return end(TrackFate::kSingular, cost);
      s_[at(q)][at(q)] = 1.0F / base::sqrt(pivot);
      nu_[at(q)] = rest * s_[at(q)][at(q)];
      nis += nu_[at(q)] * nu_[at(q)];
    }
    if (!(nis < 1e20F)) return end(TrackFate::kSingular, cost);
    record_.nis = nis;
    if (!(nis <= track_gate(count_))) return end(TrackFate::kGated, cost);
    return next(keep_ && depth_.sigma_per_m() < kSharp * depth_.inverse_depth_per_m() ? Step::kKeep : Step::kGain,
                cost);
  }

  /// The three rows that hold the point make it a state: nu_1 = H_1 x + T d + n, so the point steps by T^-1 nu_1 and
  /// then errs by -T^-1 (H_1 x + n). The rows that are left correct it with the others (Li & Mourikis 2012).
  int keep(Covariance& p, float sigma) {
    const int m = rows(), cost = 3 * (states_ + m);
    keep_ = false;
    record_.fate = TrackFate::kNoRoom;
    if (states_ + kPoint > kStates) return next(Step::kGain, cost);
    nav::Matrix3 inverse = nav::Matrix3::Zero();  // of T, which is triangular
    for (int c = 0; c < kPoint; ++c)
      for (int r = c; r >= 0; --r) {
        float sum = r == c ? 1.0F : 0.0F;
        for (int k = r + 1; k <= c; ++k) sum -= of_point_[at(r)][at(k)] * inverse(k, c);
        inverse(r, c) = sum / of_point_[at(r)][at(r)];
      }
    if (!nav::is_finite(nav::Vector3(inverse.rowwise().sum()))) return next(Step::kGain, cost);
    nav::Matrix3 s;
    for (int r = 0; r < kPoint; ++r)
      for (int c = 0; c < kPoint; ++c) s(r, c) = s_[at(r)][at(c)] + (r == c ? sigma * sigma : 0.0F);
    const nav::Matrix3 variance = inverse * s * inverse.transpose();
    point_step_m_ = inverse * nav::Vector3{nu_[0], nu_[1], nu_[2]};
    for (int a = 0; a < kPoint; ++a) {
      const auto of_rows = [&](const auto& row) {
        float sum = 0.0F;
        for (int k = a; k < kPoint; ++k) sum -= inverse(a, k) * row(k);
        return sum;
      };
      for (int n = 0; n < states_; ++n) dx_[at(n)] = of_rows([&](int k) { return g_[at(n)][at(k)]; });
      for (int b = 0; b < a; ++b) dx_[at(states_ + b)] = variance(b, a);
      if (!p.add(dx_, variance(a, a))) return next(Step::kGain, cost);
      for (int q = kPoint; q < m; ++q) g_[at(states_ + a)][at(q)] = of_rows([&](int k) { return s_[at(k)][at(q)]; });
    }
    states_ += kPoint;
    record_.fate = TrackFate::kKept;
    return next(Step::kGain, cost);
  }

  /// G becomes G L^-T, and dx = G nu.
  int gain() {
    const int m = rows();
    for (int n = 0; n < states_; ++n) {
      auto& row = g_[at(n)];
      float sum = 0.0F;
      for (int q = kPoint; q < m; ++q) {
        float value = row[at(q)];
        for (int k = kPoint; k < q; ++k) value = base::subtract_product(value, s_[at(q)][at(k)], row[at(k)]);
        row[at(q)] = value * s_[at(q)][at(q)];
        sum = base::add_product(sum, row[at(q)], nu_[at(q)]);
      }
      dx_[at(n)] = sum;
    }
    return next(Step::kCorrect, states_ * (m - kPoint) * (m - kPoint) / 8);
  }

  int correct(Covariance& p) {
    int rank = rows() - kPoint, first = kPoint;
    const int cost = states_ * states_ * rank / 10;
    for (; rank > 9; rank -= 4, first += 4) p.template subtract<4>(g_, first);
    switch (rank) {
      case 3:
        p.template subtract<3>(g_, first);
        break;
      case 5:
        p.template subtract<5>(g_, first);
        break;
      case 7:
        p.template subtract<7>(g_, first);
        break;
      default:
        p.template subtract<9>(g_, first);
        break;
    }
    return end(record_.fate == TrackFate::kPending ? TrackFate::kUsed : record_.fate, cost);
  }

  std::array<View, kClones> view_{};
  std::array<RelativeView, kClones> relative_{};
  InverseDepth depth_;
  nav::Vector3 point_n_m_ = nav::Vector3::Zero(), point_step_m_ = nav::Vector3::Zero();
  std::array<std::array<std::array<float, 9>, 2>, kClones> h_{};
  std::array<std::array<float, kPoint>, kRows> of_point_{};
  std::array<float, kRows> nu_{};
  std::array<std::array<float, kRows>, kRows> s_{};
  typename Covariance::template Rows<kRows> g_{};
  Dx dx_{};
  TrackRecord record_;
  std::int32_t count_ = 0, index_ = 0, states_ = kStates;
  Step step_ = Step::kNone;
  bool keep_ = false;
};

}  // namespace tetap::slam
