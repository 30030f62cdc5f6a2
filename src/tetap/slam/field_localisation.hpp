// SPDX-License-Identifier: Apache-2.0
// Monte Carlo localisation of a scanner on a likelihood field (Dellaert, Fox, Burgard, Thrun 1999; the field: Thrun,
// Burgard, Fox 2005, sec. 6.4), as jobs in units of work. A search over the whole map places the particles at the
// start, and again whenever their scans do not fit. The pose is valid when the particles are at one place for some way.
#pragma once

#include "tetap/filter/pose_cloud.hpp"
#include "tetap/slam/field_search.hpp"

#include <array>

namespace tetap::slam {

struct FieldOptions {
  float temper = 0.1F;     ///< power of the likelihood: neighbouring beams and errors of the map are not independent
  float sigma_m = 0.15F;   ///< noise of a point's distance from the wall of the map
  float any = 0.1F;        ///< share of points that may be anywhere
  float unknown = 0.4F;    ///< likelihood of a point where the map saw nothing; 0 while the pose is not valid
  float weigh_m = 0.15F;   ///< a scan is weighed after so much way
  float weigh_rad = 0.1F;  ///< or so much turn
  float fits_m = 0.1F, fits_cells = 1.5F;  ///< a point within this distance of a wall fits
  float clean = 0.85F;     ///< share of the points on seen ground that fit, from which the pose is confirmed
  float lost = 0.5F;       ///< the same share, below which the pose is given up
  float holds = 0.55F;     ///< share of all points that fit, from which one place is kept, and the map not searched
  float one = 0.95F;       ///< share of the weight that is at one place
  float confirm_m = 4.0F;  ///< way over which the particles are at one place
  float most_sigma_m = 0.25F, most_sigma_rad = 0.06F;  ///< widest spread at one place
  float search_m = 4.0F;                   ///< way without a valid pose after which the map is searched anew
  float place_m = 0.02F, per_way = 0.05F;  ///< errors of the odometry between two scans that are weighed
  float turn_rad = 0.005F, per_turn = 0.05F;
};

/// A displacement of the body with independent errors along, aside and in heading.
struct ParticleDisplacement {
  static constexpr int kNormals = 3;
  float x_m = 0, y_m = 0, yaw_rad = 0;
  float sigma_m = 0, sigma_rad = 0;

  [[nodiscard]] constexpr bool valid() const {
    return base::abs(x_m) + base::abs(y_m) < 1e4F && base::abs(yaw_rad) < 1e3F && sigma_m < 1e3F && sigma_rad < 1e2F;
  }
  [[nodiscard]] constexpr filter::ParticlePose sample(const filter::ParticlePose& from,
                                                      const std::array<float, 3>& normal) const {
    const base::SinCos turn = base::sincos(yaw_rad + sigma_rad * normal[2]);
    const float x = x_m + sigma_m * normal[0], y = y_m + sigma_m * normal[1];
    return {.x_m = from.x_m + from.cos_yaw * x - from.sin_yaw * y,
            .y_m = from.y_m + from.sin_yaw * x + from.cos_yaw * y,
            .cos_yaw = from.cos_yaw * turn.cos - from.sin_yaw * turn.sin,
            .sin_yaw = from.sin_yaw * turn.cos + from.cos_yaw * turn.sin};
  }
};

template <std::size_t kMost>
class FieldLocalisation {
 public:
  static constexpr int kBest = 48;
  using Estimate = typename filter::PoseCloud<kMost>::Estimate;

  FieldOptions options;

  FieldLocalisation() { cloud_.options.least = kMost / 2; }
  void set_key(base::PhiloxKey key) { cloud_.cloud.set_key(key); }
  /// Begins at a pose, which counts as valid until scans contradict it.
  void start(const filter::ParticlePose& pose, float sigma_m, float sigma_yaw_rad) {
    cancel();
    cloud_.start(kMost, pose, sigma_m, sigma_yaw_rad);
    started_ = valid_ = true;
    fit_ = clean_ = 1.0F;
    confirmed_m_ = options.confirm_m;
    estimate_ = cloud_.estimate();
    fresh_ = true;
  }
  /// Begins anywhere on the map.
  void start_anywhere() {
    cancel();
    started_ = valid_ = holds_ = false;
    unlocated_m_ = options.search_m;
  }
  /// The body moved; between two calls a scan may be weighed.
  void move(const Displacement<float>& d) {
    const float way = base::sqrt(d.x_m * d.x_m + d.y_m * d.y_m);
    since_weighed_ = then(since_weighed_, d);
    way_m_ += way;
    turn_rad_ += base::abs(d.yaw.radians());
    if (search_.busy()) since_search_ = then(since_search_, d);
    if (!valid_ && !holds_) unlocated_m_ += way;
  }
  /// The scan at the latest move. True: its weighing begins.
  bool see(const ScanBeams& beams, const LikelihoodField& field) {
    if (!valid_ && !search_.busy() && unlocated_m_ >= options.search_m) {
      search_.begin(beams, field);
      since_search_ = {};
      unlocated_m_ = 0.0F;
    }
    const bool due = fresh_ || way_m_ >= options.weigh_m || turn_rad_ >= options.weigh_rad;
    if (!started_ || weighing_ || !due || beams.count < 8) return false;
    predict();
    beams_ = beams;
    cursor_ = 0;
    make_table(field);
    weighing_ = true;
    fresh_ = false;
    return true;
  }
  /// A unit is ten points of a particle or of a pose of the search. True: estimate() is of the scan that was weighed.
  bool work(int units, const LikelihoodField& field) {
    if (weighing_) {
      for (; units > 0 && cursor_ < cloud_.cloud.size(); units -= kUnits) weigh_next(field);
      if (cursor_ < cloud_.cloud.size()) return false;
      judge(field);
      return true;
    }
    if (search_.busy() && search_.work(units, field)) place();
    return false;
  }
  /// Forgets what is under way; a search begins anew with the next scan.
  void cancel() {
    if (search_.busy()) unlocated_m_ = options.search_m;
    search_.cancel();
    weighing_ = false;
  }
  [[nodiscard]] bool busy() const { return weighing_ || search_.busy(); }
  [[nodiscard]] bool started() const { return started_; }
  [[nodiscard]] bool valid() const { return valid_; }
  /// Low-passed share of points that fit, of all, and of those where the map saw something.
  [[nodiscard]] float fit() const { return fit_; }
  [[nodiscard]] float clean() const { return clean_; }
  /// The pose at the scan that was weighed last.
  [[nodiscard]] const Estimate& estimate() const { return estimate_; }
  [[nodiscard]] const auto& particles() const { return cloud_.cloud; }
  [[nodiscard]] int searches() const { return searches_; }

 private:
  static constexpr int kUnits = ScanBeams::kMost / 10;

  static Displacement<float> then(const Displacement<float>& a, const Displacement<float>& b) {
    const auto turn = a.yaw.direction();
    return {a.x_m + turn.cos * b.x_m - turn.sin * b.y_m, a.y_m + turn.sin * b.x_m + turn.cos * b.y_m, a.yaw + b.yaw};
  }
  void predict() {
    static_cast<void>(
        cloud_.cloud.predict(ParticleDisplacement{.x_m = since_weighed_.x_m,
                                                  .y_m = since_weighed_.y_m,
                                                  .yaw_rad = since_weighed_.yaw.radians(),
                                                  .sigma_m = options.place_m + options.per_way * way_m_,
                                                  .sigma_rad = options.turn_rad + options.per_turn * turn_rad_}));
    weighed_m_ = way_m_;
    since_weighed_ = {};
    way_m_ = turn_rad_ = 0.0F;
  }
  /// Implements docs/explanation/scan_matching.md (10).
  /// Logarithm of a point's likelihood by its level, the largest being 0.
  void make_table(const LikelihoodField& field) {
    const float largest = base::log(1.0F + options.any);
    for (int level = 0; level < field.kLevels; ++level) {
      const float d = static_cast<float>(level) * field.step_m / options.sigma_m;
      const float hit = level == field.kUnknown ? (valid_ ? options.unknown : 0.0F)
                        : level == field.kFar   ? 0.0F
                                                : base::exp(-0.5F * d * d);
      table_[static_cast<std::size_t>(level)] = options.temper * (base::log(hit + options.any) - largest);
    }
  }
  void weigh_next(const LikelihoodField& field) {
    float sum = 0.0F;
    beams_.each_level(cloud_.cloud[cursor_], field, [&](int level) { sum += table_[static_cast<std::size_t>(level)]; });
    log_likelihood_[cursor_++] = sum;
  }
  void judge(const LikelihoodField& field) {
    weighing_ = false;
    std::size_t i = 0;  // weigh() asks in the order of the particles
    static_cast<void>(cloud_.cloud.weigh([&](const filter::ParticlePose&) { return log_likelihood_[i++]; }));
    estimate_ = cloud_.estimate();
    const float fits_m = options.fits_m + options.fits_cells * field.cell_m;
    int near = 0, known = 0;
    beams_.each_level(estimate_.pose, field, [&](int level) {
      known += level != field.kUnknown ? 1 : 0;
      near += level < field.kFar && static_cast<float>(level) * field.step_m <= fits_m ? 1 : 0;
    });
    const auto fitting = static_cast<float>(near), all = static_cast<float>(beams_.count);
    fit_ += 0.2F * (fitting / all - fit_);
    clean_ += 0.2F * (fitting - clean_ * static_cast<float>(known)) / all;
    const auto& p = estimate_.p;
    const bool one_place = estimate_.share > options.one &&
                           p(0, 0) + p(1, 1) < options.most_sigma_m * options.most_sigma_m &&
                           p(2, 2) < options.most_sigma_rad * options.most_sigma_rad;
    holds_ = one_place && fit_ >= options.holds;
    confirmed_m_ = holds_ && clean_ >= options.clean ? confirmed_m_ + weighed_m_ : 0.0F;
    if (!valid_ && confirmed_m_ >= options.confirm_m) valid_ = true;
    if (valid_ && (clean_ < options.lost || estimate_.share < 0.5F)) {
      valid_ = holds_ = false;
      unlocated_m_ = options.search_m;
    }
    const auto size = static_cast<float>(static_cast<std::int32_t>(cloud_.cloud.size()));
    if (cloud_.cloud.effective() < 0.5F * size) cloud_.resample(one_place ? cloud_.wanted() : kMost, one_place);
  }
  /// Particles at the places that the search found, carried on by the way since its scan.
  void place() {
    ++searches_;
    const auto found = search_.found();
    if (found.empty() || valid_ || holds_) return;
    const ParticleDisplacement way{.x_m = since_search_.x_m,
                                   .y_m = since_search_.y_m,
                                   .yaw_rad = since_search_.yaw.radians(),
                                   .sigma_m = 0.1F,
                                   .sigma_rad = 0.03F};
    cloud_.cloud.fill(kMost, [&](const filter::Draw& draw) {
      const auto k = static_cast<std::size_t>((std::uint64_t{draw.words[3]} * found.size()) >> 32);
      return way.sample(found[k].pose, {draw.normal(0), draw.normal(1), draw.normal(2)});
    });
    started_ = fresh_ = true;
    holds_ = false;
    fit_ = clean_ = 0.5F;
    confirmed_m_ = 0.0F;
    since_weighed_ = {};
    way_m_ = turn_rad_ = 0.0F;
  }

  filter::PoseCloud<kMost> cloud_;
  FieldSearch<kBest> search_;
  ScanBeams beams_;
  std::array<float, kMost> log_likelihood_{};
  std::array<float, LikelihoodField::kLevels> table_{};
  Estimate estimate_{};
  Displacement<float> since_weighed_{}, since_search_{};
  std::size_t cursor_ = 0;
  float way_m_ = 0, turn_rad_ = 0, weighed_m_ = 0, confirmed_m_ = 0, unlocated_m_ = 0, fit_ = 0, clean_ = 0;
  int searches_ = 0;
  bool started_ = false, valid_ = false, holds_ = false, weighing_ = false, fresh_ = false;
};

}  // namespace tetap::slam
