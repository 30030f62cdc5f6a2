// SPDX-License-Identifier: Apache-2.0
// Sightings of mapped points in one image as measurements of the pose and of these points. A recogniser takes points
// for others now and then. So each sighting is held against the others first, by its NIS given each of them: the
// largest group that agrees corrects the state (1-point RANSAC with the filter's own covariance; Civera, Grasa,
// Davison, Montiel 2010). Work is cut in steps of bounded cost.
#pragma once

#include "tetap/filter/big_covariance.hpp"
#include "tetap/filter/update.hpp"
#include "tetap/slam/point_map.hpp"
#include "tetap/slam/point_sighting.hpp"
#include "tetap/slam/track_update.hpp"

namespace tetap::slam {

/// States 0 to 2 are the camera's rotation, the next six are those of the present pose, those of the map begin at
/// kFirstPoint. Of an image up to kMost sightings are used.
template <int kStates, int kFirstPoint, int kMost>
class MapSightings {
 public:
  using Covariance = filter::BigCovariance<float, kStates>;
  using Dx = typename Covariance::States;
  static constexpr float kGate = filter::chi_square_99(2);
  static constexpr float kNarrow = 8.0F;  ///< innovation's sigma over a pixel's, up to which a sighting may stand alone

  struct Seen {
    std::uint16_t id = 0;
    std::int32_t point = 0;  ///< in the map
    model::ImagePoint at;
  };

  void begin() {
    count_ = index_ = 0;
    step_ = Step::kNone;
  }
  void add(const Seen& seen) {
    if (count_ == kMost) return;
    seen_[at(count_++)] = seen;
    step_ = Step::kRows;
  }
  [[nodiscard]] int count() const { return count_; }
  [[nodiscard]] bool busy() const { return step_ != Step::kNone; }
  /// Fate of the sighting that the latest step concluded, if it concluded one.
  [[nodiscard]] const TrackRecord* concluded() const { return concluded_ ? &record_ : nullptr; }
  [[nodiscard]] int point() const { return seen_[at(order_[at(index_ - 1)])].point; }  ///< point of that sighting
  /// Correction of all states: meaningful after a sighting whose fate is kUsed.
  [[nodiscard]] const Dx& dx() const { return dx_; }

  /// The next step; its cost in units of about ten floating-point operations. `sigma` is the noise of a direction,
  /// `considered` the scale's state, which no image corrects, negative for none.
  template <class Map>
  int step(Covariance& p, const WorldPose& pose, const model::CameraMounting& camera, const Map& map, float sigma,
           int considered) {
    concluded_ = false;
    switch (step_) {
      case Step::kNone:
        return 0;
      case Step::kRows:
        return relate(p, pose, camera, map, sigma, considered);
      case Step::kAgree:
        return agree(sigma);
      case Step::kGain:
        return gain(p, pose, camera, map, sigma, considered);
      case Step::kCorrect:
        break;
    }
    return correct(p);
  }

 private:
  enum class Step : std::uint8_t { kNone, kRows, kAgree, kGain, kCorrect };
  static constexpr int kHead = 9, kElements = kHead + 3;
  static constexpr std::size_t at(int i) { return static_cast<std::size_t>(i); }
  static constexpr int state_of(int element, int point) {
    return element < kHead ? element : kFirstPoint + 3 * point + element - kHead;
  }
  using Row = std::array<float, static_cast<std::size_t>(kElements)>;
  using Rows = std::array<Row, 2>;
  using Block = std::array<std::array<float, 2>, 2>;
  using Pair = std::array<float, 2>;

  /// Rows of H and the residual; false where the point is behind the camera.
  template <class Map>
  static bool look(const Seen& seen, const WorldPose& pose, const model::CameraMounting& camera, const Map& map,
                   Rows& h, Pair& nu) {
    const MapPoint& point = map[seen.point];
    const PointSighting sighting(pose, camera, point.at_n_m);
    if (!sighting.at.seen) return false;
    for (std::size_t i = 0; i < 2; ++i) {
      const auto& of_point = sighting.of_point[i];
      const nav::Vector3 of_turn = nav::cross({of_point[0], of_point[1], of_point[2]}, point.first_n_m);
      for (std::size_t k = 0; k < 9; ++k) h[i][k] = sighting.h[i][k];
      for (std::size_t k = 0; k < 3; ++k) {
        h[i][3 + k] = of_turn(static_cast<int>(k));
        h[i][9 + k] = of_point[k];
      }
    }
    nu = {seen.at.x - sighting.at.at.x, seen.at.y - sighting.at.at.y};
    return true;
  }
  /// H_i P_s over the root of P_ss: what the rows see of the considered scale s, which is taken out (TrackUpdate).
  [[nodiscard]] Pair seen_scale(const Covariance& p, int i, int considered) const {
    Pair sum{};
    const float variance = considered < 0 ? 0.0F : p(considered, considered);
    if (!(variance > 0.0F)) return sum;
    const float inverse = 1.0F / base::sqrt(variance);
    for (int k = 0; k < kElements; ++k) {
      const float share = inverse * p(state_of(k, seen_[at(i)].point), considered);
      for (std::size_t a = 0; a < 2; ++a) sum[a] += h_[at(i)][a][at(k)] * share;
    }
    return sum;
  }
  /// H_i P H_j^T for a known scale.
  [[nodiscard]] Block across(const Covariance& p, int i, int j) const {
    Block s{};
    for (std::size_t a = 0; a < 2; ++a)
      for (std::size_t b = 0; b < 2; ++b) s[a][b] = -scale_[at(i)][a] * scale_[at(j)][b];
    for (int l = 0; l < kElements; ++l) {
      const int to = state_of(l, seen_[at(j)].point);
      Pair sum{};
      for (int k = 0; k < kElements; ++k) {
        const float covariance = p(state_of(k, seen_[at(i)].point), to);
        for (std::size_t a = 0; a < 2; ++a) sum[a] += h_[at(i)][a][at(k)] * covariance;
      }
      for (std::size_t a = 0; a < 2; ++a)
        for (std::size_t b = 0; b < 2; ++b) s[a][b] += sum[a] * h_[at(j)][b][at(l)];
    }
    return s;
  }
  /// nu^T S^-1 nu; negative where S is no covariance.
  [[nodiscard]] static float statistic(const Block& s, const Pair& nu) {
    const float determinant = s[0][0] * s[1][1] - s[0][1] * s[1][0];
    if (!(determinant > 0.0F) || !(s[0][0] > 0.0F)) return -1.0F;
    const float sum = nu[0] * (s[1][1] * nu[0] - s[0][1] * nu[1]) + nu[1] * (s[0][0] * nu[1] - s[1][0] * nu[0]);
    return sum / determinant;
  }
  [[nodiscard]] static bool fits(float nis) { return nis >= 0.0F && nis <= kGate; }

  template <class Map>
  int relate(const Covariance& p, const WorldPose& pose, const model::CameraMounting& camera, const Map& map,
             float sigma, int considered) {
    const int i = index_;
    nis_[at(i)] = -1.0F;
    in_front_[at(i)] = look(seen_[at(i)], pose, camera, map, h_[at(i)], nu_[at(i)]);
    if (in_front_[at(i)]) {
      scale_[at(i)] = seen_scale(p, i, considered);
      for (int j = 0; j <= i; ++j)
        if (in_front_[at(j)]) s_[at(i)][at(j)] = across(p, i, j);
      for (std::size_t a = 0; a < 2; ++a) s_[at(i)][at(i)][a][a] += sigma * sigma;
      nis_[at(i)] = statistic(s_[at(i)][at(i)], nu_[at(i)]);
    }
    if (++index_ == count_) step_ = Step::kAgree, index_ = 0;
    return 20 + 65 * (i + 1);
  }

  /// NIS of sighting j when sighting i is known.
  [[nodiscard]] float given(int i, int j) const {
    const Block& own = s_[at(i)][at(i)];
    const Block& low = s_[at(i > j ? i : j)][at(i > j ? j : i)];  // H_high P H_low^T
    Block ji{};
    for (std::size_t a = 0; a < 2; ++a)
      for (std::size_t b = 0; b < 2; ++b) ji[a][b] = j > i ? low[a][b] : low[b][a];
    const float determinant = own[0][0] * own[1][1] - own[0][1] * own[1][0];
    if (!(determinant > 0.0F)) return -1.0F;
    const Block inverse{
        {{own[1][1] / determinant, -own[0][1] / determinant}, {-own[1][0] / determinant, own[0][0] / determinant}}};
    Block rest = s_[at(j)][at(j)];
    Pair nu = nu_[at(j)];
    for (std::size_t a = 0; a < 2; ++a) {
      Pair gain{};
      for (std::size_t b = 0; b < 2; ++b) gain[b] = ji[a][0] * inverse[0][b] + ji[a][1] * inverse[1][b];
      nu[a] -= gain[0] * nu_[at(i)][0] + gain[1] * nu_[at(i)][1];
      for (std::size_t b = 0; b < 2; ++b) rest[a][b] -= gain[0] * ji[b][0] + gain[1] * ji[b][1];
    }
    return statistic(rest, nu);
  }
  /// The sighting that most others agree with goes first, then these, those that fit best first; the rest is refused.
  int agree(float sigma) {
    int seed = -1, most = 0;
    for (int i = 0; i < count_; ++i) {
      if (!fits(nis_[at(i)])) continue;
      int support = 0;
      for (int j = 0; j < count_; ++j) support += j != i && fits(nis_[at(j)]) && fits(given(i, j)) ? 1 : 0;
      if (seed >= 0 && (support < most || (support == most && !(nis_[at(i)] < nis_[at(seed)])))) continue;
      seed = i;
      most = support;
    }
    for (int i = 0; i < count_; ++i) {
      const bool singular = in_front_[at(i)] && nis_[at(i)] < 0.0F;
      fate_[at(i)] = singular ? TrackFate::kSingular : TrackFate::kGated;
      if (seed < 0 || !fits(nis_[at(i)]) || (i != seed && !fits(given(seed, i)))) continue;
      fate_[at(i)] = TrackFate::kPending;
    }
    if (seed >= 0 && most == 0) {
      const Block& s = s_[at(seed)][at(seed)];
      if (s[0][0] + s[1][1] > 2.0F * kNarrow * kNarrow * sigma * sigma) fate_[at(seed)] = TrackFate::kAlone;
    }
    for (int i = 0; i < count_; ++i) {  // by insertion: the seed, then by NIS
      int k = i;
      const auto before = [&](int a, int b) { return a == seed || (b != seed && nis_[at(a)] < nis_[at(b)]); };
      for (; k > 0 && before(i, order_[at(k - 1)]); --k) order_[at(k)] = order_[at(k - 1)];
      order_[at(k)] = i;
    }
    step_ = Step::kGain;
    return 6 * count_ * count_ + 5;
  }

  int conclude(TrackFate fate, float nis, int cost) {
    record_ = {.id = seen_[at(order_[at(index_)])].id, .sightings = 1, .degrees = 2, .fate = fate, .nis = nis};
    concluded_ = true;
    step_ = ++index_ == count_ ? Step::kNone : Step::kGain;
    return cost;
  }

  /// G = P H^T at the state as it is by now, S, the gate, L of S, G L^-T and dx.
  template <class Map>
  int gain(const Covariance& p, const WorldPose& pose, const model::CameraMounting& camera, const Map& map, float sigma,
           int considered) {
    const int i = order_[at(index_)];
    if (fate_[at(i)] != TrackFate::kPending) return conclude(fate_[at(i)], nis_[at(i)], 1);
    const int states = p.size(), cost = 5 * states + 40;
    Rows& h = h_[at(i)];
    Pair& nu = nu_[at(i)];
    if (!look(seen_[at(i)], pose, camera, map, h, nu)) return conclude(TrackFate::kGated, -1.0F, 20);
    const int point = seen_[at(i)].point;
    p.template times<2, kHead, 3>(h, kFirstPoint + 3 * point, g_, 0);
    if (considered >= 0 && p(considered, considered) > 0.0F) {
      const float inverse = 1.0F / p(considered, considered);
      const auto of_scale = g_[at(considered)];
      for (int n = 0; n < states; ++n)
        for (std::size_t a = 0; a < 2; ++a) g_[at(n)][a] -= inverse * p(n, considered) * of_scale[a];
      g_[at(considered)] = {};
    }
    Block s{};
    for (int k = 0; k < kElements; ++k)
      for (std::size_t a = 0; a < 2; ++a)
        for (std::size_t b = 0; b < 2; ++b) s[a][b] += h[a][at(k)] * g_[at(state_of(k, point))][b];
    for (std::size_t a = 0; a < 2; ++a) s[a][a] += sigma * sigma;
    const float nis = statistic(s, nu);
    if (!(nis >= 0.0F) || !(nis < 1e20F)) return conclude(TrackFate::kSingular, -1.0F, cost);
    if (!fits(nis)) return conclude(TrackFate::kGated, nis, cost);
    nis_[at(i)] = nis;
    const float first = 1.0F / base::sqrt(s[0][0]), low = s[1][0] * first;
    const float second = 1.0F / base::sqrt(s[1][1] - low * low);
    const float y = nu[0] * first, z = (nu[1] - low * y) * second;
    if (!(second < 1e20F)) return conclude(TrackFate::kSingular, -1.0F, cost);
    for (int n = 0; n < states; ++n) {
      auto& row = g_[at(n)];
      row[0] *= first;
      row[1] = (row[1] - low * row[0]) * second;
      dx_[at(n)] = row[0] * y + row[1] * z;
    }
    step_ = Step::kCorrect;
    return cost;
  }
  int correct(Covariance& p) {
    const int cost = p.size() * p.size() / 5;
    p.template subtract<2>(g_, 0);
    return conclude(TrackFate::kUsed, nis_[at(order_[at(index_)])], cost);
  }

  std::array<Seen, static_cast<std::size_t>(kMost)> seen_{};
  std::array<Rows, static_cast<std::size_t>(kMost)> h_{};
  std::array<Pair, static_cast<std::size_t>(kMost)> nu_{}, scale_{};
  std::array<std::array<Block, static_cast<std::size_t>(kMost)>, static_cast<std::size_t>(kMost)> s_{};
  std::array<float, static_cast<std::size_t>(kMost)> nis_{};
  std::array<TrackFate, static_cast<std::size_t>(kMost)> fate_{};
  std::array<bool, static_cast<std::size_t>(kMost)> in_front_{};
  std::array<std::int32_t, static_cast<std::size_t>(kMost)> order_{};
  typename Covariance::template Rows<2> g_{};
  Dx dx_{};
  TrackRecord record_;
  std::int32_t count_ = 0, index_ = 0;
  Step step_ = Step::kNone;
  bool concluded_ = false;
};

}  // namespace tetap::slam
