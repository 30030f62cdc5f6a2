// SPDX-License-Identifier: Apache-2.0
// Loop closures that the node finds by itself. The newest keyframe is matched with older ones that lie within three
// sigma of it, nearest first, as a job cut in units of work. A match that passes the checks becomes a closure of the
// graph, which weighs it and may leave it out (keyframe_graph.hpp).
#pragma once

#include "tetap/slam/keyframe_graph.hpp"
#include "tetap/slam/scan_match.hpp"

namespace tetap::slam {

struct ScanClosureOptions {
  float reach_m = 3.0F;           ///< candidates lie as near as this and three sigma
  float most_m = 6.0F;            ///< but never farther
  float turn_rad = 1.6F;          ///< largest difference of heading
  float weight_m_per_rad = 1.0F;  ///< a turn counts as so much distance where candidates are ordered
  int age = 20;                   ///< least number of keyframes between
  int apart = 3;                  ///< keyframes between two candidates
  float share = 0.5F;             ///< least share of the points with a partner
  float residual_m = 0.04F;       ///< largest RMS distance from the lines
  float sigma_m = 0.02F;          ///< largest sigma of the match: no corridors
  float floor_m = 0.02F;          ///< errors that the walls have in common, added to closures and to odometry
  float floor_rad = 0.006F;
  ScanMatchOptions match{.reach_first_m = 1.0F};
};

struct ScanClosureCounters {
  std::uint32_t tried = 0;
  std::uint32_t weak = 0;      ///< no match, or too few partners, too far from the lines, too loose
  std::uint32_t taken = 0;     ///< by the graph
  std::uint32_t refused = 0;   ///< by the graph
  std::uint32_t not_kept = 0;  ///< keyframes whose ranges found no place
};

/// Ranges of up to kScans keyframes, 2 bytes a beam. Of a scan with more than kKept beams each second, third ... one is
/// kept.
template <int kBeams, int kKept, int kScans>
class ScanClosures {
 public:
  static constexpr int kCandidates = 3;  ///< for one keyframe
  using Motion = UncertainDisplacement<float>;

  explicit ScanClosures(const ScanClosureOptions& options = {}) : options_(options), match_(options.match) {}

  /// A displacement by scan matching, with the errors that its covariance leaves out.
  [[nodiscard]] Motion widened(Motion motion) const {
    const float m = options_.floor_m * options_.floor_m, rad = options_.floor_rad * options_.floor_rad;
    motion.covariance.add_diagonal({m, m, rad});
    return motion;
  }
  /// A scan that may become a keyframe: its ranges (5 mm, 0: none) and the motion of the scanner during it.
  void hold(const ScanGeometry& geometry, std::span<const std::uint16_t> ranges, const ScanMotion& motion) {
    held_.motion = motion;
    const auto stride = at(geometry.beams > kKept ? (geometry.beams + kKept - 1) / kKept : 1);
    for (std::size_t i = 0; i < held_.ranges.size(); ++i)
      held_.ranges[i] = i * stride < ranges.size() ? ranges[i * stride] : std::uint16_t{0};
    const ScanGeometry kept = every(geometry, static_cast<int>(stride));
    if (!same(kept, geometry_)) release();  // the kept ranges have other bearings
    geometry_ = kept;
  }
  /// The scan that is held is that of the graph's latest step, a keyframe. `mounting` is the scanner's place on the
  /// body. The search for the keyframe before is given up.
  template <class Graph>
  void add(const Graph& graph, const Scan<kBeams>& scan, const Motion& mounting) {
    match_.cancel();
    newest_.add(scan, {});
    mounting_ = mounting;
    step_ = graph.step();
    chosen_ = 0;
    keep(graph);
    begin_search();
  }
  [[nodiscard]] bool idle() const { return phase_ == Phase::kIdle; }
  /// `units` of the search: a unit is one keyframe that is looked at, or one of ScanMatch. True when a closure was
  /// taken.
  template <class Graph>
  bool work(int units, Graph& graph) {
    const std::uint32_t taken = count_.taken;
    for (; units > 0 && phase_ != Phase::kIdle; --units) {
      if (phase_ == Phase::kSearch)
        look_at_next(graph);
      else
        match_.work(1, slot_[at(trying_)].ranges, newest_);
      if (phase_ == Phase::kMatch && !match_.busy()) end_match(graph);
    }
    return count_.taken != taken;
  }
  /// Gives the search up.
  void cancel() {
    match_.cancel();
    phase_ = Phase::kIdle;
  }
  [[nodiscard]] const ScanClosureCounters& counters() const { return count_; }
  /// The places of scans, for a comparison of whole states.
  static constexpr std::size_t elements() { return kScans; }
  template <class Sink>
  void hash_element(std::size_t i, Sink& sink) const {
    sink(slot_[i].used ? slot_[i].step : ~std::uint32_t{0});
    if (!slot_[i].used) return;
    for (const float v : {slot_[i].motion.forward_mps, slot_[i].motion.left_mps, slot_[i].motion.yaw_rate_radps})
      sink(v);
    for (const std::uint16_t range : slot_[i].ranges) sink(std::uint32_t{range});
  }
  /// Forgets everything but the counters.
  void reset() {
    cancel();
    release();
  }

 private:
  enum class Phase : std::uint8_t { kIdle, kSearch, kMatch };
  struct Kept {
    std::uint32_t step = 0;
    bool used = false;
    ScanMotion motion;
    std::array<std::uint16_t, kKept> ranges{};
  };
  static constexpr float kNone = 1e9F;
  static constexpr std::size_t at(int i) { return static_cast<std::size_t>(i); }
  static float larger_sigma(const filter::Symmetric<float, 3>& c) { return base::sqrt(base::max(c(0, 0), c(1, 1))); }
  static ScanGeometry every(ScanGeometry g, int stride) {
    const int beams = (g.beams + stride - 1) / stride;
    if (g.beams > 1) g.sweep_s *= static_cast<float>((beams - 1) * stride) / static_cast<float>(g.beams - 1);
    g.beams = beams;
    g.step_rad *= static_cast<float>(stride);
    return g;
  }
  static bool same(const ScanGeometry& a, const ScanGeometry& b) {
    return a.beams == b.beams && !(base::abs(a.first_rad - b.first_rad) > 0.0F) &&
           !(base::abs(a.step_rad - b.step_rad) > 0.0F);
  }

  void release() {
    for (Kept& slot : slot_) slot.used = false;
  }
  template <class Graph>
  void keep(const Graph& graph) {
    int free = free_slot();
    if (free < 0) {  // keyframes that the graph has composed away need none
      for (Kept& slot : slot_) slot.used = slot.used && keyframe_of(graph, slot.step) >= 0;
      free = free_slot();
    }
    if (free < 0) return void(++count_.not_kept);
    slot_[at(free)] = held_;
    slot_[at(free)].step = step_;
    slot_[at(free)].used = true;
  }
  [[nodiscard]] int free_slot() const {
    for (int s = 0; s < kScans; ++s)
      if (!slot_[at(s)].used) return s;
    return -1;
  }
  /// Number of the graph's keyframe of a step, or -1. Steps rise with the number.
  template <class Graph>
  [[nodiscard]] static int keyframe_of(const Graph& graph, std::uint32_t step) {
    int low = 0, high = graph.graph().poses() - 1;
    while (low < high) {
      const int middle = (low + high) / 2;
      if (graph.keyframe_step(middle) < step)
        low = middle + 1;
      else
        high = middle;
    }
    return graph.keyframe_step(low) == step ? low : -1;
  }

  void begin_search() {
    phase_ = chosen_ < kCandidates ? Phase::kSearch : Phase::kIdle;
    cursor_ = 0;
    least_ = kNone;
  }
  /// Implements docs/explanation/scan_matching.md (8).
  template <class Graph>
  void look_at_next(const Graph& graph) {
    if (cursor_ >= graph.graph().poses()) {
      phase_ = Phase::kIdle;
      if (least_ < kNone) begin_match(graph);
      return;
    }
    if (cursor_ == 0) {
      here_ = graph.pose();
      radius_m_ = base::min(options_.most_m, options_.reach_m + 3.0F * larger_sigma(graph.covariance()));
    }
    const int k = cursor_++;
    const std::uint32_t step = graph.keyframe_step(k);
    if (step + static_cast<std::uint32_t>(options_.age) > step_) {  // as all that follow
      cursor_ = graph.graph().poses();
      return;
    }
    if (!far_from_chosen(step)) return;
    const auto d = graph.keyframe(k).minus(here_);
    const float away = d.x_m * d.x_m + d.y_m * d.y_m, turn = d.yaw.radians();
    if (!(away < radius_m_ * radius_m_ && base::abs(turn) < options_.turn_rad)) return;
    const float cost = away + turn * turn * options_.weight_m_per_rad * options_.weight_m_per_rad;
    if (cost < least_) least_ = cost, candidate_[at(chosen_)] = step;
  }
  [[nodiscard]] bool far_from_chosen(std::uint32_t step) const {
    for (int c = 0; c < chosen_; ++c) {
      const std::uint32_t other = candidate_[at(c)];
      if ((step > other ? step - other : other - step) < static_cast<std::uint32_t>(options_.apart)) return false;
    }
    return true;
  }

  template <class Graph>
  void begin_match(const Graph& graph) {
    const std::uint32_t step = candidate_[at(chosen_++)];
    const int k = keyframe_of(graph, step);
    trying_ = -1;
    for (int s = 0; s < kScans && k >= 0; ++s)
      if (slot_[at(s)].used && slot_[at(s)].step == step) trying_ = s;
    if (trying_ < 0) return begin_search();
    const auto c = graph.covariance();
    const float m = base::clamp(larger_sigma(c), 0.1F, 0.5F), rad = base::clamp(base::sqrt(c(2, 2)), 0.05F, 0.2F);
    const Motion body{.mean = graph.keyframe(k).minus(graph.pose()),
                      .covariance = filter::Symmetric<float, 3>::diagonal({m * m, m * m, rad * rad})};
    if (!match_.begin(geometry_, slot_[at(trying_)].motion, as_of(body, mounting_))) return begin_search();
    ++count_.tried;
    phase_ = Phase::kMatch;
  }
  template <class Graph>
  void end_match(Graph& graph) {
    begin_search();
    const ScanMatchResult& result = match_.result();
    const float share =
        options_.share * static_cast<float>(match_.scan().known) / static_cast<float>(options_.match.every);
    const bool strong = result.matched() && static_cast<float>(result.pairs) >= share &&
                        result.residual_m <= options_.residual_m &&
                        larger_sigma(result.pose.covariance) <= options_.sigma_m;
    if (!strong) return void(++count_.weak);
    const Motion z = as_of(widened(result.pose), inverse(mounting_));
    if (graph.closure(step_, slot_[at(trying_)].step, z).fate == ClosureFate::kTaken)
      ++count_.taken;
    else
      ++count_.refused;
  }

  ScanClosureOptions options_;
  ScanMatch<kBeams, 1> match_;
  ScanKeyframes<kBeams, 1> newest_;
  ScanGeometry geometry_;
  Motion mounting_;
  ScanClosureCounters count_;
  std::uint32_t step_ = 0;  ///< newest keyframe of the graph
  Phase phase_ = Phase::kIdle;
  int cursor_ = 0;  ///< keyframe that is looked at next
  GraphPose<float> here_;
  float radius_m_ = 0.0F;
  float least_ = kNone;
  int chosen_ = 0;
  std::array<std::uint32_t, kCandidates> candidate_{};
  int trying_ = -1;  ///< slot of the candidate at hand
  Kept held_;
  std::array<Kept, kScans> slot_{};
};

}  // namespace tetap::slam
