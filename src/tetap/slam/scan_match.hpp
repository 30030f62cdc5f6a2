// SPDX-License-Identifier: Apache-2.0
// The pose of a scan relative to the newest of several keyframes, as a job cut in units of work: point-to-line matching
// (Censi, ICRA 2008) by Gauss-Newton with Cauchy's weight, after a coarse search over turns. Odometry is the prior, so
// a direction in which the walls hold nothing keeps odometry's variance.
#pragma once

#include "tetap/slam/graph_edge.hpp"
#include "tetap/slam/scan_keyframes.hpp"
#include "tetap/slam/scan_match_result.hpp"

#include <span>

namespace tetap::slam {

template <int kBeams, int kFrames>
class ScanMatch {
 public:
  using Keyframes = ScanKeyframes<kBeams, kFrames>;
  using Motion = UncertainDisplacement<float>;

  explicit ScanMatch(const ScanMatchOptions& options = {}) : options_(options), lines_(options.lines) {}

  /// Begins with a scan that work() reads, and the prior of its pose as seen from the newest keyframe (the covariance
  /// as in the result). False, and nothing has changed but a job given up, when the geometry is none or the prior's
  /// covariance not positive definite.
  [[nodiscard]] bool begin(const ScanGeometry& geometry, const ScanMotion& motion, const Motion& prior) {
    phase_ = Phase::kIdle;
    std::array<float, 6> whitening{};
    if (!prior.mean.valid() || !whitening_of(prior.covariance, whitening)) return false;
    if (!scan_.begin(geometry, motion)) return false;
    prior_ = prior;
    information_ = square_of(whitening);
    lines_.begin();
    result_ = {.pose = prior};
    cursor_ = 0;
    phase_ = Phase::kPoints;
    return true;
  }
  [[nodiscard]] bool busy() const { return phase_ != Phase::kIdle; }
  /// Whether the next unit still reads a range.
  [[nodiscard]] bool reads_ranges() const { return phase_ == Phase::kPoints; }
  /// `units` of the job, a unit being the work for one beam: its point, its line, its score in one turn, or its
  /// partner in one keyframe. The result is the same however the units are dealt. `ranges` (5 mm, 0: none) are
  /// those of the first call while reads_ranges(), and the keyframes until the job has ended.
  void work(int units, std::span<const std::uint16_t> ranges, const Keyframes& keyframes) {
    for (; units > 0 && phase_ != Phase::kIdle; --units) step(ranges, keyframes);
  }
  /// Forgets the job.
  void cancel() { phase_ = Phase::kIdle; }
  /// The latest job that ended.
  [[nodiscard]] const ScanMatchResult& result() const { return result_; }
  /// Points and normals of that scan.
  [[nodiscard]] const Scan<kBeams>& scan() const { return scan_; }
  [[nodiscard]] const ScanMatchCounters& counters() const { return count_; }

 private:
  enum class Phase : std::uint8_t { kIdle, kPoints, kLines, kCoarse, kPairs };
  static constexpr std::size_t at(int i) { return static_cast<std::size_t>(i); }
  static constexpr float kMetre = 0.001F;  ///< a point's unit
  static constexpr int kCoarseEvery = 2;   ///< points that the coarse search leaves out

  void step(std::span<const std::uint16_t> ranges, const Keyframes& keyframes) {
    switch (phase_) {
      case Phase::kIdle:
        return;
      case Phase::kPoints:
        scan_.place(cursor_, at(cursor_) < ranges.size() ? ranges[at(cursor_)] : std::uint16_t{0});
        if (++cursor_ == scan_.beams) cursor_ = 0, phase_ = Phase::kLines;
        return;
      case Phase::kLines:
        lines_.take(scan_, cursor_);
        if (++cursor_ == scan_.beams) lines_.end(scan_), begin_coarse(keyframes);
        return;
      case Phase::kCoarse:
        score(keyframes);
        return;
      case Phase::kPairs:
        pair(keyframes);
        return;
    }
  }

  void begin_coarse(const Keyframes& keyframes) {
    if (keyframes.count() == 0) return end(ScanFate::kFirst);
    pose_ = prior_.mean;
    const float three_sigma = 3.0F * base::sqrt(prior_.covariance(2, 2));
    const float half = base::min(options_.coarse_half_rad, three_sigma) / options_.coarse_step_rad;
    turns_ = half < 64.0F ? static_cast<int>(half) : 64;  // on either side
    if (turns_ == 0) return begin_iterations(keyframes);
    turn_ = -turns_;
    best_score_ = -1.0F;
    best_yaw_ = pose_.yaw;
    phase_ = Phase::kCoarse;
    begin_turn();
  }
  void begin_turn() {
    cursor_ = 0;
    score_ = 0.0F;
    scored_ = 0;
    tried_ = prior_.mean.yaw + Heading<float>::from_radians(static_cast<float>(turn_) * options_.coarse_step_rad);
    const auto direction = tried_.direction();
    c_ = direction.cos, s_ = direction.sin;
  }
  /// Implements docs/explanation/scan_matching.md (3).
  /// One beam of one turn: how near the point lies to what the newest keyframe has in its direction.
  void score(const Keyframes& keyframes) {
    constexpr float kNear = 1.0F / (0.3F * 0.3F);  // 1/m^2
    const ScanPoint& p = scan_.point[at(cursor_)];
    if (p.known()) {
      const Scan<kBeams>& frame = keyframes.scan(0);
      const float px = kMetre * static_cast<float>(p.x_mm), py = kMetre * static_cast<float>(p.y_mm);
      const float x = pose_.x_m + c_ * px - s_ * py, y = pose_.y_m + s_ * px + c_ * py;
      const int k = frame.wrapped(frame.beam_towards(x, y));
      if (k >= 0 && frame.point[at(k)].known()) {
        const float dx = x - kMetre * static_cast<float>(frame.point[at(k)].x_mm);
        const float dy = y - kMetre * static_cast<float>(frame.point[at(k)].y_mm);
        const float far = (dx * dx + dy * dy) * kNear;
        if (far < 1.0F) score_ += 1.0F - far;
        ++scored_;
      }
    }
    cursor_ += kCoarseEvery;
    if (cursor_ >= scan_.beams) end_turn(keyframes);
  }
  void end_turn(const Keyframes& keyframes) {
    constexpr float kTurnCost = 0.02F;  // 1/rad: of equals the smaller turn
    float total = 0.0F;
    if (scored_ >= options_.least_pairs) {
      const float share = static_cast<float>(4 * scored_) / static_cast<float>(scan_.beams);
      total = score_ / static_cast<float>(scored_) * base::min(1.0F, share) -
              kTurnCost * base::abs(static_cast<float>(turn_) * options_.coarse_step_rad);
    }
    if (total > best_score_) best_score_ = total, best_yaw_ = tried_;
    if (++turn_ <= turns_) return begin_turn();
    pose_.yaw = best_yaw_;
    begin_iterations(keyframes);
  }

  void begin_iterations(const Keyframes& keyframes) {
    iteration_ = 0;
    reach_m_ = options_.reach_first_m;
    phase_ = Phase::kPairs;
    begin_iteration(keyframes);
  }
  void begin_iteration(const Keyframes& keyframes) {
    hessian_ = {};
    gradient_ = {};
    squares_ = weights_ = 0.0F;
    pairs_ = 0;
    begin_frame(keyframes, 0);
  }
  void begin_frame(const Keyframes& keyframes, int frame) {
    frame_ = frame;
    cursor_ = 0;
    const Displacement<float> newest = keyframes.pose(0).minus(keyframes.pose(frame));
    const auto turn = newest.yaw.direction(), whole = (newest.yaw + pose_.yaw).direction();
    frame_c_ = turn.cos, frame_s_ = turn.sin;
    c_ = whole.cos, s_ = whole.sin;
    x_m_ = newest.x_m + frame_c_ * pose_.x_m - frame_s_ * pose_.y_m;
    y_m_ = newest.y_m + frame_s_ * pose_.x_m + frame_c_ * pose_.y_m;
  }
  /// The nearest point of the frame within reach, or -1. In integers: the first of equals is the same everywhere.
  [[nodiscard]] int partner(const Scan<kBeams>& frame, float x_m, float y_m) const {
    const std::int32_t x = nearest(1000.0F * x_m), y = nearest(1000.0F * y_m), reach = nearest(1000.0F * reach_m_);
    // Farther beams than these cannot be within reach; two more for the bearing and the motion during a sweep.
    const float beams = reach_m_ / (base::max(base::abs(x_m), base::abs(y_m)) * base::abs(frame.step_rad)) + 2.0F;
    const int window = beams < static_cast<float>(options_.window) ? static_cast<int>(beams) : options_.window;
    const int first = frame.beam_towards(x_m, y_m) - window;
    std::int64_t least = std::int64_t{reach} * reach;
    int best = -1;
    for (int k = first; k <= first + 2 * window; ++k) {
      int beam = k;
      if (k < 0 || k >= frame.beams) beam = frame.wrapped(k);
      if (beam < 0) continue;
      const ScanPoint& q = frame.point[at(beam)];  // one without a place lies far off, and has no normal
      const std::int64_t dx = x - q.x_mm, dy = y - q.y_mm;
      const std::int64_t squared = dx * dx + dy * dy;
      if (squared < least) least = squared, best = beam;
    }
    return best;
  }
  /// Implements docs/explanation/scan_matching.md (4) to (5).
  /// One point against one keyframe: its row of the normal equations.
  void pair(const Keyframes& keyframes) {
    const ScanPoint& p = scan_.point[at(cursor_)];
    if (p.known()) {
      const Scan<kBeams>& frame = keyframes.scan(frame_);
      const float px = kMetre * static_cast<float>(p.x_mm), py = kMetre * static_cast<float>(p.y_mm);
      const float lever_x = c_ * px - s_ * py, lever_y = s_ * px + c_ * py;
      const float x = x_m_ + lever_x, y = y_m_ + lever_y;
      const int k = partner(frame, x, y);
      if (k >= 0 && frame.point[at(k)].has_normal() && faces(p, frame.point[at(k)]))
        add_row(frame.point[at(k)], x, y, lever_x, lever_y);
    }
    cursor_ += options_.every;
    if (cursor_ < scan_.beams) return;
    if (frame_ + 1 < keyframes.count()) return begin_frame(keyframes, frame_ + 1);
    solve(keyframes);
  }
  [[nodiscard]] bool faces(const ScanPoint& p, const ScanPoint& q) const {
    if (!p.has_normal()) return true;
    const auto nx = static_cast<float>(p.nx), ny = static_cast<float>(p.ny);
    const float cosine =
        (c_ * nx - s_ * ny) * static_cast<float>(q.nx) + (s_ * nx + c_ * ny) * static_cast<float>(q.ny);
    return cosine * ScanPoint::kNormal * ScanPoint::kNormal > options_.facing;
  }
  void add_row(const ScanPoint& q, float x, float y, float lever_x, float lever_y) {
    const float nx = ScanPoint::kNormal * static_cast<float>(q.nx), ny = ScanPoint::kNormal * static_cast<float>(q.ny);
    const float e = nx * (x - kMetre * static_cast<float>(q.x_mm)) + ny * (y - kMetre * static_cast<float>(q.y_mm));
    const float width = 0.5F * reach_m_, w = 1.0F / (1.0F + e * e / (width * width));
    // The normal along the newest keyframe's axes; the turn acts on the lever from the scan's place.
    const float jx = frame_c_ * nx + frame_s_ * ny, jy = frame_c_ * ny - frame_s_ * nx;
    const float jyaw = ny * lever_x - nx * lever_y;
    hessian_(0, 0) += w * jx * jx;
    hessian_(0, 1) += w * jx * jy;
    hessian_(1, 1) += w * jy * jy;
    hessian_(0, 2) += w * jx * jyaw;
    hessian_(1, 2) += w * jy * jyaw;
    hessian_(2, 2) += w * jyaw * jyaw;
    gradient_[0] -= w * jx * e;
    gradient_[1] -= w * jy * e;
    gradient_[2] -= w * jyaw * e;
    squares_ += w * e * e;
    weights_ += w;
    ++pairs_;
  }

  /// The inverse of hessian / variance + the prior's information, by its factor; false when there is none.
  [[nodiscard]] bool invert(float variance, std::array<float, 6>& factor) const {
    filter::Symmetric<float, 3> a = information_;
    const float scale = 1.0F / variance;
    for (int c = 0; c < 3; ++c)
      for (int r = 0; r <= c; ++r) a(r, c) += scale * hessian_(r, c);
    return whitening_of(a, factor);
  }
  /// Implements docs/explanation/scan_matching.md (6) to (7).
  void solve(const Keyframes& keyframes) {
    ++iteration_;
    const float share = options_.least_share * static_cast<float>(scan_.known) / static_cast<float>(options_.every);
    if (pairs_ < options_.least_pairs || static_cast<float>(pairs_) < share) return end(ScanFate::kFewPairs);
    const float variance = options_.sigma_m * options_.sigma_m;
    std::array<float, 6> w{};
    if (!invert(variance, w)) return end(ScanFate::kSingular);
    const filter::Symmetric<float, 3> inverse = square_of(w);
    const std::array<float, 3> off{prior_.mean.x_m - pose_.x_m, prior_.mean.y_m - pose_.y_m,
                                   (prior_.mean.yaw - pose_.yaw).radians()};
    std::array<float, 3> g{}, dx{};
    for (int r = 0; r < 3; ++r) {
      g[at(r)] = gradient_[at(r)] / variance;
      for (int c = 0; c < 3; ++c) g[at(r)] += information_(r, c) * off[at(c)];
    }
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) dx[at(r)] += inverse(r, c) * g[at(c)];
    pose_ = {pose_.x_m + dx[0], pose_.y_m + dx[1], pose_.yaw + Heading<float>::from_radians(dx[2])};
    if (!pose_.valid()) return end(ScanFate::kSingular);
    const bool still = base::abs(dx[0]) + base::abs(dx[1]) < 5e-4F && base::abs(dx[2]) < 2e-4F;
    if ((still && reach_m_ <= options_.reach_last_m) || iteration_ >= options_.iterations)
      return end(ScanFate::kMatched);
    reach_m_ = base::max(0.75F * reach_m_, options_.reach_last_m);
    begin_iteration(keyframes);
  }

  void end(ScanFate fate) {
    phase_ = Phase::kIdle;
    result_.iterations = fate == ScanFate::kFirst ? 0 : iteration_;
    result_.pairs = fate == ScanFate::kFirst ? 0 : pairs_;
    if (fate == ScanFate::kMatched) {
      // Residuals above the stated noise widen the covariance.
      const float squared = weights_ > 0.0F ? squares_ / weights_ : 0.0F;
      result_.residual_m = base::sqrt(squared);
      std::array<float, 6> w{};
      if (invert(base::max(options_.sigma_m * options_.sigma_m, squared), w))
        result_.pose = {.mean = pose_, .covariance = square_of(w)};
      else
        fate = ScanFate::kSingular;
    }
    result_.fate = fate;
    count_.matched += fate == ScanFate::kMatched ? 1U : 0U;
    count_.few_pairs += fate == ScanFate::kFewPairs ? 1U : 0U;
    count_.singular += fate == ScanFate::kSingular ? 1U : 0U;
  }

  ScanMatchOptions options_;
  ScanLines<kBeams> lines_;
  Scan<kBeams> scan_{};
  Motion prior_{};
  filter::Symmetric<float, 3> information_{}, hessian_{};
  std::array<float, 3> gradient_{};
  ScanMatchResult result_;
  ScanMatchCounters count_;

  Phase phase_ = Phase::kIdle;
  int cursor_ = 0, frame_ = 0, iteration_ = 0, pairs_ = 0;
  int turn_ = 0, turns_ = 0, scored_ = 0;
  float score_ = 0, best_score_ = 0, reach_m_ = 0, squares_ = 0, weights_ = 0;
  Heading<float> tried_{}, best_yaw_{};
  Displacement<float> pose_{};
  float c_ = 1, s_ = 0, x_m_ = 0, y_m_ = 0;  ///< the scan's pose in the frame at hand
  float frame_c_ = 1, frame_s_ = 0;          ///< turn from the newest keyframe to that frame
};

}  // namespace tetap::slam
