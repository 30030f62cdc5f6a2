// SPDX-License-Identifier: Apache-2.0
// Bayes filter on a grid (Thrun, Burgard, Fox 2005, sec. 4.1 and 8.2): a line, a plane, or poses x * y * yaw.
// Prediction is by a separable kernel, update by a likelihood, both in place. The work can be cut anywhere between two
// lines of cells and leaves the same bits.
#pragma once

#include "tetap/base/math.hpp"
#include "tetap/filter/symmetric.hpp"

#include <algorithm>
#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>

namespace tetap::filter {

/// Three weights at -1, 0, 1 beside a whole shift. Their mean is exact. Their variance (in cells) is exact as far as
/// three points can have it. The variance is at least |m| (1 - |m|) and at most 1 - m^2, for the mean m that is left
/// beside the shift.
struct GridKernel {
  std::int32_t shift = 0;
  std::array<float, 3> weight{0, 1, 0};

  /// Implements docs/explanation/grid_filter.md (1).
  /// Implements docs/explanation/pose_grid.md (2).
  [[nodiscard]] static constexpr GridKernel of(float mean, float variance) {
    const float nearest = mean < 0.0F ? mean - 0.5F : mean + 0.5F;
    const auto shift = static_cast<std::int32_t>(nearest);
    const float m = mean - static_cast<float>(shift);
    const float size = m < 0.0F ? -m : m;
    const float second = base::clamp(variance + m * m, size, 1.0F);  // second moment
    return {shift, {0.5F * (second - m), 1.0F - second, 0.5F * (second + m)}};
  }
};

/// Motion of a pose on the grid; on a line or a plane without headings, along the first axis.
struct GridMotion {
  float forward_m = 0;
  float turn_rad = 0;
  float variance_forward = 0;  ///< m^2
  float variance_turn = 0;     ///< rad^2
  float carried_share = 0;     ///< probability that it was carried to anywhere before an update

  [[nodiscard]] constexpr bool valid() const {
    return base::abs(forward_m) < 1e4F && base::abs(turn_rad) < 1e3F && variance_forward >= 0.0F &&
           variance_forward < 1e6F && variance_turn >= 0.0F && variance_turn < 1e3F && carried_share >= 0.0F &&
           carried_share <= 1.0F;
  }
};

struct GridPose {
  float x_m = 0;
  float y_m = 0;
  float yaw_rad = 0;
};

/// A likelihood in two parts: what depends on the place is computed once for all its headings.
template <class L>
concept LikelihoodByPlace = requires(const L& likelihood) {
  { likelihood.at(0.0F, 0.0F)(0.0F) } -> std::same_as<float>;
};

/// Mean and covariance of some cells, and the mass in them.
struct GridRegion {
  GridPose mean;
  Symmetric<float, 3> p;  ///< x, y, yaw
  float mass = 0;
};

template <int kX, int kY = 1, int kYaw = 1>
class Grid {
  static_assert(kX >= 2 && kY >= 1 && kYaw >= 1);

 public:
  static constexpr int kCells = kX * kY * kYaw;

  /// Without any mass: reset() comes before all else.
  constexpr Grid() = default;
  constexpr Grid(float low_x_m, float low_y_m, float step_m) : low_x_m_(low_x_m), low_y_m_(low_y_m), step_m_(step_m) {
    fill([](const GridPose&) { return 1.0F; });
  }

  [[nodiscard]] constexpr float mass(int x, int y = 0, int yaw = 0) const { return cells_[index(x, y, yaw)]; }
  [[nodiscard]] constexpr const auto& cells() const { return cells_; }
  /// Centre of a cell.
  [[nodiscard]] constexpr GridPose at(int x, int y = 0, int yaw = 0) const {
    return {low_x_m_ + (static_cast<float>(x) + 0.5F) * step_m_, low_y_m_ + (static_cast<float>(y) + 0.5F) * step_m_,
            static_cast<float>(yaw) * kTurn_rad};
  }

  /// Begins anew in another place, with all cells alike.
  constexpr void reset(float low_x_m, float low_y_m, float step_m) {
    low_x_m_ = low_x_m;
    low_y_m_ = low_y_m;
    step_m_ = step_m;
    for (float& c : cells_) c = 1.0F / static_cast<float>(kCells);
    phase_ = Phase::kDone;
    peak_ = 0;
  }
  [[nodiscard]] constexpr float step_m() const { return step_m_; }
  static constexpr float turn_step_rad() { return kTurn_rad; }

  /// Begins with a density, known up to a factor. False, and all cells alike, where it has no mass.
  template <class Density>
  constexpr bool fill(const Density& density) {
    float sum = 0.0F;
    for (int cell = 0; cell < kCells; ++cell) {
      const float d = usable(density(centre(cell)));
      cells_[static_cast<std::size_t>(cell)] = d;
      sum += d;
    }
    const bool has_mass = sum > kLeastMass && sum < 1e30F;
    for (float& c : cells_) c = has_mass ? c / sum : 1.0F / static_cast<float>(kCells);
    phase_ = Phase::kDone;
    return has_mass;
  }

  /// Begins a step: the motion where there is one, then an update if work() is given a likelihood. False, and nothing
  /// has changed, while a step is under way or when the motion is not valid.
  constexpr bool begin(const GridMotion& motion, bool with_update) {
    if (!done() || !motion.valid()) return false;
    motion_ = motion;
    with_update_ = with_update;
    const float across = motion.forward_m * motion.forward_m * kTurn_rad * kTurn_rad * (kYaw > 1 ? 1.0F / 12.0F : 0.0F);
    const float widest = base::max((motion.variance_forward + across) / (step_m_ * step_m_),
                                   motion.variance_turn / (kTurn_rad * kTurn_rad));
    passes_ = 1 + static_cast<std::int32_t>(base::min(widest / kMostVariance, static_cast<float>(kMostPasses - 1)));
    per_pass_ = 1.0F / static_cast<float>(passes_);
    pass_ = 0;
    if (base::abs(motion.forward_m) + base::abs(motion.turn_rad) + widest > 0.0F) {
      start(Phase::kAlongX);
    } else {
      passes_ = 0;
      start(with_update ? Phase::kSum : Phase::kDone);
    }
    return true;
  }
  [[nodiscard]] constexpr bool done() const { return phase_ == Phase::kDone; }
  /// Lines of the step that begin() began, all of them.
  [[nodiscard]] constexpr std::uint32_t units() const {
    const int motion = lines_of(Phase::kAlongX) + lines_of(Phase::kAlongY) + lines_of(Phase::kAlongYaw);
    const int update = with_update_ ? lines_of(Phase::kSum) + lines_of(Phase::kMultiply) : 0;
    return static_cast<std::uint32_t>(passes_ * motion + update);
  }

  /// Does at most `units` lines of cells of the step that begin() began. likelihood(pose) is the same in all calls of a
  /// step. A value that is no number or below zero counts as zero. An update that leaves no mass is left out.
  template <class Likelihood>
  constexpr void work(std::uint32_t units, const Likelihood& likelihood) {
    for (; units > 0 && !done(); --units) {
      switch (phase_) {
        case Phase::kAlongX:
          shift_line<kX>(index(0, line_ % kY, line_ / kY), 1, kernel_x(line_ / kY), false);
          break;
        case Phase::kAlongY:
          shift_line<kY>(index(line_ % kX, 0, line_ / kX), kX, kernel_y(line_ / kX), false);
          break;
        case Phase::kAlongYaw:
          shift_line<kYaw>(index(line_ % kX, line_ / kX, 0), kX * kY, kernel_yaw(), true);
          break;
        case Phase::kSum:
          sum_line(likelihood);
          break;
        case Phase::kMultiply:
          multiply_line(likelihood);
          break;
        case Phase::kDone:
          break;
      }
      next_line();
    }
  }
  constexpr void work(std::uint32_t units) {
    work(units, [](const GridPose&) { return 1.0F; });
  }
  /// Updates that left no mass.
  [[nodiscard]] constexpr std::uint32_t refused() const { return refused_; }

  /// Implements docs/explanation/grid_filter.md (5).
  /// Maximum likelihood: the cell that the last measurement fits best; the first of equals.
  [[nodiscard]] constexpr GridPose maximum_likelihood() const { return centre(likeliest_); }
  /// Implements docs/explanation/grid_filter.md (6).
  /// Maximum a posteriori: the cell of most mass; the first of equals.
  [[nodiscard]] constexpr GridPose maximum_a_posteriori() const {
    int best = 0;
    for (int cell = 1; cell < kCells; ++cell)
      if (cells_[static_cast<std::size_t>(cell)] > cells_[static_cast<std::size_t>(best)]) best = cell;
    return centre(best);
  }
  /// Cell of most mass after the last update, the first of equals; found by the update itself.
  [[nodiscard]] constexpr GridPose peak() const { return centre(peak_); }
  /// The mode's neighbourhood: cells at most so many places and headings from the peak, the mass of each even over it.
  [[nodiscard]] constexpr GridRegion around_peak(int places, int headings) const;
  /// Implements docs/explanation/grid_filter.md (7).
  /// Least mean squared error: the mean of the cells that `use` picks, of headings by unit vectors.
  template <class Use>
  [[nodiscard]] constexpr GridPose mean(const Use& use) const {
    float sum = 0.0F, x = 0.0F, y = 0.0F, c = 0.0F, s = 0.0F;
    for (int yaw = 0; yaw < kYaw; ++yaw) {
      const base::SinCos heading = base::sincos(static_cast<float>(yaw) * kTurn_rad);
      for (int cell = yaw * kX * kY; cell < (yaw + 1) * kX * kY; ++cell) {
        const GridPose pose = centre(cell);
        if (!use(pose)) continue;
        const float m = cells_[static_cast<std::size_t>(cell)];
        sum += m;
        x += m * pose.x_m;
        y += m * pose.y_m;
        c += m * heading.cos;
        s += m * heading.sin;
      }
    }
    if (!(sum > 0.0F)) return maximum_a_posteriori();
    return {x / sum, y / sum, base::atan2(s, c)};
  }
  [[nodiscard]] constexpr GridPose mean() const {
    return mean([](const GridPose&) { return true; });
  }

 private:
  enum class Phase : std::uint8_t { kAlongX, kAlongY, kAlongYaw, kSum, kMultiply, kDone };
  static constexpr float kTurn_rad = 6.28318531F / static_cast<float>(kYaw);
  static constexpr float kLeastMass = 1e-30F;
  static constexpr float kMostVariance =
      0.5F;  ///< variance of one pass, in cells: a kernel of three points can have it
  static constexpr std::int32_t kMostPasses = 16;

  [[nodiscard]] static constexpr std::size_t index(int x, int y, int yaw) {
    const int cell = (yaw * kY + y) * kX + x;
    return static_cast<std::size_t>(cell);
  }
  [[nodiscard]] constexpr GridPose centre(int cell) const { return at(cell % kX, cell / kX % kY, cell / (kX * kY)); }
  [[nodiscard]] static constexpr float usable(float value) { return value > 0.0F && value < 1e30F ? value : 0.0F; }

  [[nodiscard]] static constexpr int lines_of(Phase phase) {
    if (phase == Phase::kAlongY) return kY > 1 && kYaw > 1 ? kX * kYaw : 0;
    if (phase != Phase::kAlongX && kYaw > 1) return kX * kY;
    if (phase == Phase::kAlongYaw) return 0;
    return kY * kYaw;
  }
  constexpr void start(Phase phase) {
    phase_ = phase;
    line_ = 0;
    if (phase == Phase::kSum) sum_ = 0.0F, lost_ = 0.0F, best_ = -1.0F, likeliest_ = 0;
    if (phase == Phase::kMultiply) most_ = -1.0F;
  }
  constexpr void next_line() {
    if (++line_ < lines_of(phase_)) return;
    if (phase_ == Phase::kAlongX && lines_of(Phase::kAlongY) > 0) return start(Phase::kAlongY);
    if (phase_ <= Phase::kAlongY && lines_of(Phase::kAlongYaw) > 0) return start(Phase::kAlongYaw);
    if (phase_ <= Phase::kAlongYaw && ++pass_ < passes_) return start(Phase::kAlongX);
    if (phase_ <= Phase::kAlongYaw && with_update_) return start(Phase::kSum);
    if (phase_ == Phase::kSum && sum_ > kLeastMass && sum_ < 1e30F) return start(Phase::kMultiply);
    if (phase_ == Phase::kSum) ++refused_;
    phase_ = Phase::kDone;
  }

  /// Mean and variance along an axis for a heading: the path's, and across it what half a cell of heading makes of it.
  [[nodiscard]] constexpr GridKernel kernel(float along, float across) const {
    const float swing = kYaw > 1 ? motion_.forward_m * kTurn_rad : 0.0F;
    const float variance = along * along * motion_.variance_forward + across * across * swing * swing * (1.0F / 12.0F);
    return GridKernel::of(per_pass_ * motion_.forward_m * along / step_m_, per_pass_ * variance / (step_m_ * step_m_));
  }
  [[nodiscard]] constexpr base::SinCos heading(int yaw) const {
    if constexpr (kYaw == 1) return {.sin = 0.0F, .cos = 1.0F};
    return base::sincos(static_cast<float>(yaw) * kTurn_rad + 0.5F * per_pass_ * motion_.turn_rad);
  }
  [[nodiscard]] constexpr GridKernel kernel_x(int yaw) const { return kernel(heading(yaw).cos, heading(yaw).sin); }
  [[nodiscard]] constexpr GridKernel kernel_y(int yaw) const { return kernel(heading(yaw).sin, heading(yaw).cos); }
  [[nodiscard]] constexpr GridKernel kernel_yaw() const {
    return GridKernel::of(per_pass_ * motion_.turn_rad / kTurn_rad,
                          per_pass_ * motion_.variance_turn / (kTurn_rad * kTurn_rad));
  }

  /// Implements docs/explanation/grid_filter.md (2).
  /// Mass that would leave the grid stays in its last cell; headings close to a circle. Implements
  /// docs/explanation/pose_grid.md (1).
  template <int kLength>
  constexpr void shift_line(std::size_t first, int stride, const GridKernel& kernel, bool circle) {
    std::array<float, kLength> from{};
    const auto cell = [&](int i) -> float& { return cells_[first + static_cast<std::size_t>(i * stride)]; };
    for (int i = 0; i < kLength; ++i) from[static_cast<std::size_t>(i)] = cell(i), cell(i) = 0.0F;
    const std::int32_t shift =
        circle ? kernel.shift % kLength : std::clamp<std::int32_t>(kernel.shift, -kLength, kLength);
    for (int i = 0; i < kLength; ++i)
      for (int k = 0; k < 3; ++k) {
        const int to = i + shift + k - 1;
        const int target = circle ? (to + 2 * kLength) % kLength : std::clamp(to, 0, kLength - 1);
        cell(target) += from[static_cast<std::size_t>(i)] * kernel.weight[static_cast<std::size_t>(k)];
      }
  }
  /// use(cell, likelihood) for each cell of a line: the headings of a place, or places where there are none.
  template <class Likelihood, class Use>
  constexpr void weigh_line(const Likelihood& likelihood, const Use& use) const {
    if constexpr (kYaw == 1) {
      for (int cell = line_ * kX; cell < (line_ + 1) * kX; ++cell) use(cell, usable(likelihood(centre(cell))));
    } else if constexpr (LikelihoodByPlace<Likelihood>) {
      const GridPose place = centre(line_);
      const auto here = likelihood.at(place.x_m, place.y_m);
      for (int yaw = 0; yaw < kYaw; ++yaw)
        use(line_ + yaw * kX * kY, usable(here(static_cast<float>(yaw) * kTurn_rad)));
    } else {
      for (int cell = line_; cell < kCells; cell += kX * kY) use(cell, usable(likelihood(centre(cell))));
    }
  }
  /// Mass of a cell before the update. Implements docs/explanation/pose_grid.md (3).
  [[nodiscard]] constexpr float prior(int cell) const {
    const float everywhere = motion_.carried_share / static_cast<float>(kCells);
    return (1.0F - motion_.carried_share) * cells_[static_cast<std::size_t>(cell)] + everywhere;
  }
  /// Implements docs/explanation/grid_filter.md (3).
  template <class Likelihood>
  constexpr void sum_line(const Likelihood& likelihood) {
    float sum = 0.0F;
    weigh_line(likelihood, [&](int cell, float l) {
      sum += prior(cell) * l;
      if (l > best_) best_ = l, likeliest_ = cell;
    });
    const float term = sum - lost_;  // compensated summation (Kahan, CACM 8(1), 1965)
    const float next = sum_ + term;
    lost_ = (next - sum_) - term;
    sum_ = next;
  }
  /// Implements docs/explanation/grid_filter.md (4).
  /// Implements docs/explanation/pose_grid.md (4).
  template <class Likelihood>
  constexpr void multiply_line(const Likelihood& likelihood) {
    const float per_sum = 1.0F / sum_;
    weigh_line(likelihood, [&](int cell, float l) {
      const float mass = prior(cell) * l * per_sum;
      cells_[static_cast<std::size_t>(cell)] = mass;
      if (mass > most_) most_ = mass, peak_ = cell;
    });
  }

  std::array<float, static_cast<std::size_t>(kCells)> cells_{};
  float low_x_m_ = 0, low_y_m_ = 0, step_m_ = 1;
  GridMotion motion_{};
  bool with_update_ = false;
  Phase phase_ = Phase::kDone;
  int line_ = 0;
  std::int32_t pass_ = 0, passes_ = 1;
  float per_pass_ = 1.0F;
  float sum_ = 0.0F, lost_ = 0.0F, best_ = 0.0F, most_ = 0.0F;
  int likeliest_ = 0, peak_ = 0;
  std::uint32_t refused_ = 0;
};

/// Implements docs/explanation/pose_grid.md (7).
template <int kX, int kY, int kYaw>
constexpr GridRegion Grid<kX, kY, kYaw>::around_peak(int places, int headings) const {
  const int x0 = peak_ % kX, y0 = peak_ / kX % kY, yaw0 = peak_ / (kX * kY);
  const int turns = std::min(headings, (kYaw - 1) / 2);
  float mass = 0.0F;
  std::array<float, 3> first{}, second{};
  float xy = 0.0F, x_yaw = 0.0F, y_yaw = 0.0F;
  for (int yaw = -turns; yaw <= turns; ++yaw)
    for (int y = std::max(y0 - places, 0); y <= std::min(y0 + places, kY - 1); ++y)
      for (int x = std::max(x0 - places, 0); x <= std::min(x0 + places, kX - 1); ++x) {
        const float m = cells_[index(x, y, (yaw0 + yaw + kYaw) % kYaw)];
        const std::array<float, 3> d{static_cast<float>(x - x0), static_cast<float>(y - y0), static_cast<float>(yaw)};
        mass += m;
        for (std::size_t i = 0; i < 3; ++i) first[i] += m * d[i], second[i] += m * d[i] * d[i];
        xy += m * d[0] * d[1];
        x_yaw += m * d[0] * d[2];
        y_yaw += m * d[1] * d[2];
      }
  GridRegion region{.mean = centre(peak_), .p = {}, .mass = mass};
  const float per_mass = mass > 0.0F ? 1.0F / mass : 0.0F;
  const std::array<float, 3> size{step_m_, step_m_, kYaw > 1 ? kTurn_rad : 0.0F};
  for (float& f : first) f *= per_mass;
  const auto covariance = [&](std::size_t i, std::size_t j, float sum) {
    return (per_mass * sum - first[i] * first[j] + (i == j ? 1.0F / 12.0F : 0.0F)) * size[i] * size[j];
  };
  for (std::size_t i = 0; i < 3; ++i) region.p(static_cast<int>(i), static_cast<int>(i)) = covariance(i, i, second[i]);
  region.p(0, 1) = covariance(0, 1, xy);
  region.p(0, 2) = covariance(0, 2, x_yaw);
  region.p(1, 2) = covariance(1, 2, y_yaw);
  region.mean.x_m += first[0] * size[0];
  region.mean.y_m += first[1] * size[1];
  region.mean.yaw_rad = base::wrap_angle(region.mean.yaw_rad + first[2] * size[2]);
  return region;
}

}  // namespace tetap::filter
