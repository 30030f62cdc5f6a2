// SPDX-License-Identifier: Apache-2.0
// Joint compatibility: the pairing of several sightings with landmarks that pairs most of them. Among equals, the
// pairing that fits best together wins. Neira & Tardos, "Data association in stochastic mapping using the joint
// compatibility test", IEEE Trans. Robotics and Automation 17(6), 2001. Depth first over the sightings, with a bounded
// number of nodes.
#pragma once

#include "tetap/base/math.hpp"
#include "tetap/slam/sighting.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

namespace tetap::slam {

/// Quantile of the chi-square distribution (Wilson & Hilferty 1931), exact to 1 % from two degrees of freedom on.
[[nodiscard]] inline float chi_square_quantile(int degrees, float normal_quantile) {
  const auto n = static_cast<float>(degrees);
  const float a = 2.0F / (9.0F * n);
  const float cube_root = 1.0F - a + normal_quantile * base::sqrt(a);
  return n * cube_root * cube_root * cube_root;
}

using Block2 = std::array<std::array<float, 2>, 2>;

template <int kRows, int kColumns, int kNodes = 400>
class JointCompatibility {
 public:
  static constexpr int kNone = -1;
  struct Result {
    std::array<int, kRows> landmark;  ///< landmark that a sighting belongs to, or kNone
    int pairs = 0;
    float nis = 0;           ///< squared distance of all pairs together
    bool exhausted = false;  ///< the nodes ran out: the result is the best of those looked at
  };

  /// Normal quantile of the joint gate.
  float quantile = 2.326F;

  /// model.allowed(row, column): the pair is possible by itself; model.line(row, column): its SightLine;
  /// model.innovation(row, column): its H P H^T + R; model.cross(row, column, other row, other column): H P H'^T.
  template <class Model>
  [[nodiscard]] Result search(const Model& model, int rows, int columns) {
    rows_ = rows;
    Result best;
    best.landmark.fill(kNone);
    int level = 0, nodes = 0;
    begin(0, 0, 0.0F);
    while (level >= 0) {
      if (level == rows) {
        if (better(levels_[at(level)], best)) take(levels_[at(level)], best);
        --level;
        continue;
      }
      Level& here = levels_[at(level)];
      if (++here.column > columns || !promising(here, level, best)) {
        --level;
        continue;
      }
      if (++nodes > kNodes) {
        best.exhausted = true;
        break;
      }
      if (here.column == columns) {  // without a landmark
        here.paired = false;
        begin(level + 1, here.pairs, here.nis);
        ++level;
      } else if (model.allowed(level, here.column) && !taken(level, here.column) && extend(model, level)) {
        ++level;
      }
    }
    return best;
  }

 private:
  static constexpr std::size_t at(int i) { return static_cast<std::size_t>(i); }
  /// A sighting of the branch: the column that is tried, pairs and NIS of the sightings before, and its rows of the
  /// joint factor.
  struct Level {
    int column = kNone;
    int pairs = 0;
    float nis = 0;
    bool paired = false;
    std::array<Block2, kRows> before;  ///< blocks of L beside the paired sightings before
    Root2 root{Covariance2{1, 0, 1}};  ///< the diagonal block
    std::array<float, 2> y{};          ///< rows of L^-1 nu
  };

  [[nodiscard]] bool taken(int level, int column) const {
    for (int i = 0; i < level; ++i)
      if (levels_[at(i)].paired && levels_[at(i)].column == column) return true;
    return false;
  }
  [[nodiscard]] static bool better(const Level& end, const Result& best) {
    return end.pairs > best.pairs || (end.pairs == best.pairs && best.pairs > 0 && end.nis < best.nis);
  }
  /// Can this branch still be better than the best?
  [[nodiscard]] bool promising(const Level& here, int level, const Result& best) const {
    const int most = here.pairs + rows_ - level;
    return most > best.pairs || (most == best.pairs && here.nis < best.nis);
  }
  void take(const Level& end, Result& best) const {
    best.pairs = end.pairs;
    best.nis = end.nis;
    best.landmark.fill(kNone);
    for (int i = 0; i < rows_; ++i)
      if (levels_[at(i)].paired) best.landmark[at(i)] = levels_[at(i)].column;
  }
  void begin(int level, int pairs, float nis) {
    levels_[at(level)].column = kNone;
    levels_[at(level)].pairs = pairs;
    levels_[at(level)].nis = nis;
    levels_[at(level)].paired = false;
  }
  /// One more pair: its rows of the factor of the joint innovation covariance, and the joint gate.
  template <class Model>
  [[nodiscard]] bool extend(const Model& model, int level) {
    Level& here = levels_[at(level)];
    here.paired = false;
    std::array<float, 2> nu = model.line(level, here.column).nu;
    Covariance2 s = model.innovation(level, here.column);
    for (int i = 0; i < level; ++i) {
      const Level& other = levels_[at(i)];
      if (!other.paired) continue;
      Block2 b = model.cross(level, here.column, i, other.column);
      for (int k = 0; k < i; ++k)
        if (levels_[at(k)].paired) subtract(b, here.before[at(k)], other.before[at(k)]);
      const Block2 l{other.root.solve(b[0]), other.root.solve(b[1])};
      here.before[at(i)] = l;
      s.xx -= l[0][0] * l[0][0] + l[0][1] * l[0][1];
      s.xy -= l[0][0] * l[1][0] + l[0][1] * l[1][1];
      s.yy -= l[1][0] * l[1][0] + l[1][1] * l[1][1];
      nu[0] -= l[0][0] * other.y[0] + l[0][1] * other.y[1];
      nu[1] -= l[1][0] * other.y[0] + l[1][1] * other.y[1];
    }
    here.root = Root2(s);
    if (!here.root.valid) return false;
    here.y = here.root.solve(nu);
    const float nis = here.nis + here.y[0] * here.y[0] + here.y[1] * here.y[1];
    if (!(nis <= chi_square_quantile(2 * (here.pairs + 1), quantile))) return false;
    here.paired = true;
    begin(level + 1, here.pairs + 1, nis);
    return true;
  }
  /// b -= a c^T
  static void subtract(Block2& b, const Block2& a, const Block2& c) {
    for (std::size_t r = 0; r < 2; ++r)
      for (std::size_t k = 0; k < 2; ++k) b[r][k] -= a[r][0] * c[k][0] + a[r][1] * c[k][1];
  }

  int rows_ = 0;
  std::array<Level, kRows + 1> levels_{};
};

}  // namespace tetap::slam
