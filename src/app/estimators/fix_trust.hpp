// SPDX-License-Identifier: Apache-2.0
// Whom to believe when GNSS fixes and the filter disagree: what is refused becomes true only by persisting. Errors of a
// receiver last (multipath, atmosphere), and a receiver can repeat itself. Nothing of the filter is in here.
#pragma once

#include "app/samples.hpp"
#include "base/exp_log.hpp"
#include "base/math.hpp"
#include "base/time.hpp"

#include <array>
#include <bit>
#include <cstdint>

namespace tetap::app {

inline constexpr float kChiSquare999Of2 = 13.816F;  ///< chi-square, 2 degrees of freedom, 99.9 %

/// What fixes that are not taken say: "you are off by this much", since when, and how often they said it. The filter
/// goes on without them meanwhile, so they say the same only if they move as it does.
class Claim {
 public:
  /// One more fix: by how much the filter is off, the variance of the fix on one axis, and that of the filter on two
  /// (what it grows by while it goes on alone is what a claim may move by). What contradicts the claim so far is left
  /// out; so many in a row are a new one.
  [[gnu::noinline]] void hear(base::Micros stamp, float east_m, float north_m, float fix_m2, float filter_m2) {
    const float d_east_m = east_m - east_m_, d_north_m = north_m - north_m_;
    const float grown_m2 = filter_m2 > begun_m2_ ? filter_m2 - begun_m2_ : 0.0F;
    const bool same = d_east_m * d_east_m + d_north_m * d_north_m <= kChiSquare999Of2 * (2.0F * fix_m2 + grown_m2);
    if (fixes_ == 0 || (!same && ++against_ >= kAgainst)) {
      *this = {};
      since_ = stamp;
      east_m_ = east_m;
      north_m_ = north_m;
      begun_m2_ = filter_m2;
    } else if (!same) {
      return;
    }
    against_ = 0;
    if (fixes_ < kMost) ++fixes_;
    last_ = stamp;
    const float share = 1.0F / static_cast<float>(fixes_);
    east_m_ += share * (east_m - east_m_);
    north_m_ += share * (north_m - north_m_);
  }
  void forget() { *this = {}; }

  [[nodiscard]] bool confirmed(std::int32_t fixes) const { return fixes_ >= fixes; }
  [[nodiscard]] bool persisted(std::int32_t for_us, std::int32_t fixes) const {
    return fixes_ >= fixes && last_ - since_ >= base::Micros{for_us};
  }
  /// Whether they say what (east, north) says.
  [[nodiscard]] bool says(float east_m, float north_m, float variance_m2) const {
    const float d_east_m = east_m_ - east_m, d_north_m = north_m_ - north_m;
    return d_east_m * d_east_m + d_north_m * d_north_m <= kChiSquare999Of2 * variance_m2;
  }
  /// The mean of what they said.
  [[nodiscard]] float east_m() const { return east_m_; }
  [[nodiscard]] float north_m() const { return north_m_; }

  template <class Sink>
  void each_bit(Sink&& sink) const {
    sink(since_.us);
    sink(last_.us);
    sink(east_m_);
    sink(north_m_);
    sink(begun_m2_);
    sink(fixes_);
    sink(static_cast<std::uint32_t>(against_));
  }

 private:
  static constexpr std::uint8_t kAgainst = 5;
  static constexpr std::int32_t kMost = 1'000'000;

  base::Micros since_, last_;
  float east_m_ = 0, north_m_ = 0;
  float begun_m2_ = 0;
  std::int32_t fixes_ = 0;
  std::uint8_t against_ = 0;
};

/// Notices fixes that stay where they are, to the last digit, while the filter moves on.
class FrozenFix {
 public:
  /// By how much the filter is off, as this fix says: of the same fix, it changes by what the filter moves.
  bool hear(const GnssPosition& fix, float east_m, float north_m, float limit_m) {
    const std::uint32_t coordinates = static_cast<std::uint32_t>(fix.latitude_2ndeg) +
                                      2'654'435'761U * static_cast<std::uint32_t>(fix.longitude_2ndeg) +
                                      40'503U * std::bit_cast<std::uint32_t>(fix.height_m);
    if (coordinates != coordinates_) {
      *this = {};
      coordinates_ = coordinates;
      east_m_ = east_m;
      north_m_ = north_m;
    }
    const float d_east_m = east_m - east_m_, d_north_m = north_m - north_m_;
    frozen_ = frozen_ || d_east_m * d_east_m + d_north_m * d_north_m > limit_m * limit_m;
    return frozen_;
  }
  [[nodiscard]] bool frozen() const { return frozen_; }

  template <class Sink>
  void each_bit(Sink&& sink) const {
    sink(coordinates_);
    sink(east_m_);
    sink(north_m_);
    sink(static_cast<std::uint32_t>(frozen_));
  }

 private:
  std::uint32_t coordinates_ = 0;
  float east_m_ = 0, north_m_ = 0;
  bool frozen_ = false;
};

/// Notices fixes that drift away while the receiver's own velocity goes along with the filter: the mean of what the
/// last ten or so say the filter is off by, less that of the last thirty. Each of them alone may be inside its gate (a
/// ramp, spoofing); what stays where it is, as a filter's own error does, leaves both means alike. Exponentially
/// weighted means as in Roberts 1959 (control charts); innovations averaged against a slow fault: Diesel & Luu 1995.
class DriftingFixes {
 public:
  void hear(float east_m, float north_m) {
    follow(soon_m_, kSoon, east_m, north_m);
    follow(late_m_, kLate, east_m, north_m);
  }
  /// The difference of both means, squared and normalised (2 degrees of freedom), of fixes whose errors are new with
  /// each. What the filter does not know of where the antenna is (variances to east and north) counts in full.
  [[nodiscard]] float nis(float fix_m2, float east_m2, float north_m2) const {
    const float d_east_m = soon_m_[0] - late_m_[0], d_north_m = soon_m_[1] - late_m_[1];
    const float of_fixes_m2 = kShare * fix_m2;
    return d_east_m * d_east_m / (of_fixes_m2 + east_m2) + d_north_m * d_north_m / (of_fixes_m2 + north_m2);
  }
  /// Whether the receiver's velocity was what the filter expects: it vouches for the next few fixes, for they may come
  /// more often.
  [[nodiscard]] bool vouched_for() {
    if (vouches_ == 0) return false;
    --vouches_;
    return true;
  }
  void velocity(bool agrees) { vouches_ = agrees ? kFixesOfAVelocity : std::uint8_t{0}; }
  void forget() { *this = {}; }

  template <class Sink>
  void each_bit(Sink&& sink) const {
    sink(soon_m_[0]);
    sink(soon_m_[1]);
    sink(late_m_[0]);
    sink(late_m_[1]);
    sink(static_cast<std::uint32_t>(vouches_));
  }

 private:
  using Mean = std::array<float, 2>;
  static constexpr std::uint8_t kFixesOfAVelocity = 10;  ///< a receiver that says one a second
  static constexpr float kSoon = 0.1F, kLate = 0.03F;    ///< what the newest counts for
  /// Variance of the difference, of the variance of one: that of a mean is w / (2 - w), what two have in common
  /// v w / (v + w - v w).
  static constexpr float kShare =
      kSoon / (2 - kSoon) + kLate / (2 - kLate) - 2 * kSoon * kLate / (kSoon + kLate - kSoon * kLate);
  static void follow(Mean& mean_m, float weight, float east_m, float north_m) {
    mean_m = {mean_m[0] + weight * (east_m - mean_m[0]), mean_m[1] + weight * (north_m - mean_m[1])};
  }

  Mean soon_m_{}, late_m_{};
  std::uint8_t vouches_ = 0;
};

/// Before there is a filter: fixes count when so many in a row follow each other no faster than anything drives. A
/// first fix that is a glitch begins nothing.
class FirstFixes {
 public:
  [[gnu::noinline]] bool hear(const GnssPosition& fix, base::Micros stamp, std::int32_t needed) {
    const float sigma_m = base::is_finite(fix.horizontal_acc_m) ? fix.horizontal_acc_m : 10.0F;
    const float far_m = 4.0F * sigma_m + kFastest_mps * base::seconds(stamp - last_);
    const float north_m = metres(fix.latitude_2ndeg - latitude_2ndeg_);
    const std::int64_t latitude_2udeg = fix.latitude_2ndeg / 1'000;
    const float latitude_rad = static_cast<float>(latitude_2udeg) * (2e-6F * 0.0174532925F);
    const float east_m = metres(fix.longitude_2ndeg - longitude_2ndeg_) * base::cos(latitude_rad);
    const bool follows = fixes_ > 0 && stamp > last_ && east_m * east_m + north_m * north_m <= far_m * far_m;
    fixes_ = follows ? (fixes_ < needed ? fixes_ + 1 : needed) : 1;
    latitude_2ndeg_ = fix.latitude_2ndeg;
    longitude_2ndeg_ = fix.longitude_2ndeg;
    last_ = stamp;
    return fixes_ >= needed;
  }
  void forget() { *this = {}; }

  template <class Sink>
  void each_bit(Sink&& sink) const {
    sink(latitude_2ndeg_);
    sink(longitude_2ndeg_);
    sink(last_.us);
    sink(fixes_);
  }

 private:
  static constexpr float kFastest_mps = 60;
  static float metres(std::int64_t d_2ndeg) { return static_cast<float>(d_2ndeg) * (2e-9F * 111'320.0F); }

  std::int64_t latitude_2ndeg_ = 0, longitude_2ndeg_ = 0;
  base::Micros last_;
  std::int32_t fixes_ = 0;
};

/// A filter that cannot look back gives the first of many such fixes the weight of two (the best weights share it with
/// the last): its variance is up to a fifth above what the sum of their information promises.
inline constexpr float kNoLookingBack = 1.22F;

/// 1 sigma of the place where it begins (with a pose: of the height), in the accuracy figure of that moment: the fixes
/// that follow hardly correct it, so a figure that is too small stays for minutes. That it is off by a fifth (1 sigma,
/// from half to twice) is assumed, as of the simulated receiver; none was measured. Then 99.73 % of all errors are
/// inside 3.68 times the figure, which is to be 3 sigma.
inline constexpr float kFirstOfMany = 1.23F;

/// By how much the variance of a fix whose error lasts for `correlation_s` grows when the one before was `since_s` ago:
/// with phi = exp(-t / tau), z_k - phi z_(k-1) has a white error of variance (1 - phi^2) r and sees (1 - phi) of the
/// position: (1 + phi) / (1 - phi) (Bryson & Henrikson 1968, measurement differencing). A fix after a long silence
/// counts in full, and many in a row together as much as one every 2 tau.
[[nodiscard]] constexpr float repeated(float since_s, float correlation_s) {
  if (!(correlation_s > 0.0F) || !(since_s < 10.0F * correlation_s)) return 1.0F;
  const float phi = base::exp(-(since_s > 1e-3F ? since_s : 1e-3F) / correlation_s);
  return (1.0F + phi) / (1.0F - phi);
}

}  // namespace tetap::app
