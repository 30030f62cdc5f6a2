// SPDX-License-Identifier: Apache-2.0
// Is the published uncertainty honest? The whole node runs in the matched world, with exactly that world's noise, over
// many seeds. Source: Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001, sec.
// 5.4.2.
//
// ANEES: the normalised squared error of the pose (3 degrees of freedom), averaged over the seeds at each time. It is
// chi-square with 3 N degrees of freedom over N: it lies inside its two-sided 95 % interval at 95 % of the times.
// Errors last, so the times are not independent and the share scatters: 90 % is asked for. Averaged over the times of
// each seed, the seeds are independent whatever lasts. Student's interval of their mean has to hold 3. NIS: innovations
// of a correct filter are white. Their mean over all seeds and times has a chi-square interval of its own. 99 % is
// taken where several things are asked at once.
//
// In the default matched world heading lasts for minutes: its gyroscope is as good as the data sheet's. Neither
// gyroscope nor wheels could be noticed to be wrong there. A second matched world has noises that all matter.
#include "config/rover.hpp"
#include "config/rover_landmarks.hpp"
#include "sim_host/matched_rover.hpp"
#include "sim_host/world_source.hpp"
#include "tetap/node/node.hpp"

#include "test/sim/published_pose.hpp"
#include "test/sim/support.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace tetap::sim {
namespace {

constexpr std::size_t kSeeds = 30;
constexpr base::Micros kLength{120'000'000};
constexpr base::Micros kPeriod{10'000};

World::Options as_made() { return {.mismatched = false}; }
/// A gyroscope 20 times as noisy (0.056 deg/s/sqrt(Hz)) and wheels that err by 1.4 cm per root metre. Information of
/// landmarks is lost within seconds, and the steps of the published 1-sigma are small beside it.
World::Options noisy() {
  Parameters parameters = matched(Parameters{});
  parameters.imu.gyro_noise *= 20;
  parameters.wheels.noise_m = 2e-4;
  return {.parameters = parameters};
}

/// Frames of one seed's world, and where the rover was. Made once: what is judged changes, the world does not.
struct Recorded {
  struct Epoch {
    std::vector<base::CanFrame> inputs;
    base::Micros time;
    Truth truth;
  };
  base::Micros begin;
  std::vector<Epoch> epochs;
};

std::vector<Recorded> record(const World::Options& options) {
  std::vector<Recorded> made;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    WorldSource source(World(options, seed), param::Parameters{}.can_base, kPeriod, kLength);
    Recorded& one = made.emplace_back();
    Tick tick;
    while (source.next(tick)) {
      if (tick.begin) one.begin = *tick.begin;
      one.epochs.push_back({{tick.inputs.begin(), tick.inputs.end()}, tick.time, source.truth()});
    }
  }
  return made;
}

/// Quantile of chi-square by Wilson and Hilferty (1931): to 1e-3 from 30 degrees of freedom on. `z` is the normal one.
double chi_square(double dof, double z) {
  const double c = 2 / (9 * dof);
  return dof * std::pow(1 - c + z * std::sqrt(c), 3);
}

struct Bounds {
  double low = 0, high = 0;
  [[nodiscard]] bool hold(double x) const { return x >= low && x <= high; }
};
constexpr double kTwoSided95 = 1.9600, kTwoSided99 = 2.5758;
constexpr double kStudent99 = 2.7564;  // two-sided, 29 degrees of freedom

/// Interval of the mean of `count` variables with `dof` degrees of freedom in all.
Bounds bounds(double dof, double count, double z) { return {chi_square(dof, -z) / count, chi_square(dof, z) / count}; }

struct Nis {
  double sum = 0, dof = 0, count = 0, rejected = 0;
  void add(const bus::EstInnov& innovation) {
    sum += static_cast<double>(innovation.nis);
    dof += innovation.dof;
    count += 1;
    rejected += innovation.verdict == sensor::Verdict::kRejected ? 1 : 0;
  }
  [[nodiscard]] double mean() const { return sum / count; }
  [[nodiscard]] bool consistent() const { return bounds(dof, count, kTwoSided99).hold(mean()); }
};

struct Judgement {
  double anees = 0;    ///< mean over all seeds and times
  double scatter = 0;  ///< half the width of Student's interval of it, from the seeds' own means
  double inside = 0;   ///< share of the times
  double above = 0;    ///< share of the times that are too sure
  std::size_t times = 0;
  std::map<sensor::Sensor, Nis> nis;

  [[nodiscard]] bool poses_consistent() const { return inside >= 0.90 && std::abs(anees - 3) <= scatter; }
  [[nodiscard]] bool consistent() const {
    return poses_consistent() &&
           std::all_of(nis.begin(), nis.end(), [](const auto& s) { return s.second.consistent(); });
  }
};

constexpr std::size_t kOdometry = 0, kFused = 1;

Judgement judge(const std::vector<Recorded>& runs, const param::Parameters& parameters,
                std::size_t estimator = kFused) {
  using Node = node::Node<robot::rover_landmarks::Estimators>;
  Judgement result;
  std::vector<double> sums(runs.front().epochs.size());  // of the seeds, by epoch
  std::vector<double> means;                             // of the times, by seed
  for (const Recorded& run : runs) {
    const auto node = std::make_unique<Node>(parameters, bus::Version{});
    node->power_on(run.begin);
    double sum = 0;
    std::size_t times = 0;
    for (std::size_t i = 0; i < run.epochs.size(); ++i) {
      const auto& epoch = run.epochs[i];
      for (const base::CanFrame& frame : epoch.inputs) node->on_frame(frame);
      Published published;
      node->tick(epoch.time, {}, [&](const base::CanFrame& frame) {
        const std::uint32_t offset = frame.id - parameters.can_base;
        published.take(offset, bus::payload(frame), estimator);
        if (offset != bus::EstInnov::kOffset) return;
        const auto innovation = bus::decode<bus::EstInnov>(bus::payload(frame));
        if (!innovation || innovation->estimator != estimator || innovation->dof == 0) return;
        result.nis[innovation->sensor].add(*innovation);
      });
      const auto nees = published.nees(epoch.truth);
      if (!nees) continue;
      sums[i] += *nees;
      sum += *nees;
      ++times;
    }
    means.push_back(sum / static_cast<double>(times));
    result.times = times;
  }
  const Bounds allowed = bounds(3.0 * kSeeds, kSeeds, kTwoSided95);
  const double share = 1 / static_cast<double>(result.times);
  for (const double sum : sums) {
    if (!(sum > 0)) continue;  // an epoch without a covariance
    const double anees = sum / kSeeds;
    result.inside += allowed.hold(anees) ? share : 0;
    result.above += anees > allowed.high ? share : 0;
  }
  const Statistics by_seed = statistics(means);
  result.anees = by_seed.mean;
  result.scatter = kStudent99 * std::sqrt(by_seed.variance / kSeeds);
  return result;
}

std::string words(const Judgement& j) {
  char line[160];
  std::snprintf(line, sizeof line, "ANEES %.3f (3 +- %.3f), inside at %.1f %%, above at %.1f %% of %zu times", j.anees,
                j.scatter, 100 * j.inside, 100 * j.above, j.times);
  std::string text = line;
  for (const auto& [sensor, nis] : j.nis) {
    const Bounds b = bounds(nis.dof, nis.count, kTwoSided99);
    std::snprintf(line, sizeof line, "; sensor %d: NIS %.3f (%.3f to %.3f), %.2f %% rejected", static_cast<int>(sensor),
                  nis.mean(), b.low, b.high, 100 * nis.rejected / nis.count);
    text += line;
  }
  return text;
}

void expect_consistent(const Judgement& j, std::size_t sensors) {
  EXPECT_TRUE(j.poses_consistent()) << words(j);
  EXPECT_EQ(j.nis.size(), sensors);
  for (const auto& [sensor, nis] : j.nis) EXPECT_TRUE(nis.consistent()) << words(j);
  EXPECT_GT(j.times, 1000U);
  std::printf("%s\n", words(j).c_str());
}

TEST(Consistency, poses_and_innovations_are_as_uncertain_as_the_node_says) {
  const auto runs = record(as_made());
  expect_consistent(judge(runs, matched_landmarks_rover()), 2);
  expect_consistent(judge(runs, matched_landmarks_rover(), kOdometry), 0);
}

TEST(Consistency, and_so_they_are_where_every_noise_matters) {
  const auto runs = record(noisy());
  expect_consistent(judge(runs, matched_landmarks_rover(noisy())), 2);
  expect_consistent(judge(runs, matched_landmarks_rover(noisy()), kOdometry), 0);
}

TEST(Consistency, a_noise_that_is_half_or_double_is_noticed) {
  struct Case {
    const char* name;
    std::function<void(param::Parameters&, float)> scale;
  };
  const std::array cases{
      Case{"wheels",
           [](param::Parameters& n, float k) { n.wheels.drive.noise_left *= k, n.wheels.drive.noise_right *= k; }},
      Case{"gyro", [](param::Parameters& n, float k) { n.gyro.noise *= k; }},
      Case{"range", [](param::Parameters& n, float k) { n.landmark.sigma_range_m *= k; }},
      Case{"bearing", [](param::Parameters& n, float k) { n.landmark.sigma_bearing_rad *= k; }},
      Case{"gnss", [](param::Parameters& n, float k) { n.gnss.sigma_scale *= k; }},
  };
  const auto runs = record(noisy());
  ASSERT_TRUE(judge(runs, matched_landmarks_rover(noisy())).consistent());
  for (const Case& one : cases)
    for (const float k : {0.5F, 2.0F}) {
      param::Parameters parameters = matched_landmarks_rover(noisy());
      one.scale(parameters, k);
      const Judgement j = judge(runs, parameters);
      std::printf("%-8s x %.1f: %s\n", one.name, static_cast<double>(k), words(j).c_str());
      EXPECT_FALSE(j.consistent()) << one.name << " x " << k << ": " << words(j);
    }
}

}  // namespace
}  // namespace tetap::sim
