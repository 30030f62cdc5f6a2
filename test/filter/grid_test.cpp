// SPDX-License-Identifier: Apache-2.0
// Laws of the Bayes filter on a grid, and the MRCLAM robots found on a grid of poses.
#include "tetap/filter/grid.hpp"
#include "support/mrclam.hpp"

#include <gtest/gtest.h>
#include <algorithm>
#include <cmath>
#include <limits>

namespace tetap::filter {
namespace {

constexpr std::uint32_t kAll = 1'000'000;

template <class G>
double mass_of(const G& grid) {
  double mass = 0;
  for (const float c : grid.cells()) mass += static_cast<double>(c);
  return mass;
}

TEST(GridKernel, HasTheMeanAndTheVarianceItIsAskedFor) {
  for (float mean = -3.0F; mean < 3.0F; mean += 0.037F)
    for (const float variance : {0.25F, 0.3F, 0.5F, 0.75F}) {
      const GridKernel k = GridKernel::of(mean, variance);
      double sum = 0, first = 0, second = 0;
      for (int i = 0; i < 3; ++i) {
        const auto w = static_cast<double>(k.weight[static_cast<std::size_t>(i)]);
        EXPECT_GE(w, -1e-6);
        sum += w, first += w * (k.shift + i - 1),
            second += w * std::pow(k.shift + i - 1 - static_cast<double>(mean), 2);
      }
      EXPECT_NEAR(sum, 1, 1e-6);
      EXPECT_NEAR(first, static_cast<double>(mean), 1e-5);
      EXPECT_NEAR(second, static_cast<double>(variance), 1e-5);
    }
}

TEST(Grid, MassIsOne) {
  Grid<24, 20, 16> grid(0, 0, 0.5F);
  EXPECT_NEAR(mass_of(grid), 1, 1e-6);
  for (int k = 0; k < 40; ++k) {  // far enough to meet the border
    ASSERT_TRUE(
        grid.begin({.forward_m = 0.6F, .turn_rad = 0.2F, .variance_forward = 0.2F, .variance_turn = 0.3F}, k % 2 == 0));
    grid.work(kAll, [](const GridPose& p) { return base::exp(-(p.x_m - 4.0F) * (p.x_m - 4.0F)); });
    ASSERT_TRUE(grid.done());
    EXPECT_NEAR(mass_of(grid), 1, 2e-6);
    for (const float c : grid.cells()) EXPECT_GE(c, 0.0F);
  }
}

TEST(Grid, PredictionMovesMeanAndVarianceAlongALine) {
  Grid<200> line(0, 0, 0.1F);
  line.fill([](const GridPose& p) { return p.x_m > 5.0F && p.x_m < 5.1F ? 1.0F : 0.0F; });
  for (int k = 0; k < 10; ++k) {
    ASSERT_TRUE(line.begin({.forward_m = 0.33F, .variance_forward = 0.02F}, false));
    line.work(kAll);
  }
  const double mean = static_cast<double>(line.mean().x_m);
  EXPECT_NEAR(mean, 5.05 + 3.3, 1e-3);
  double variance = 0;
  for (int x = 0; x < 200; ++x)
    variance += static_cast<double>(line.mass(x)) * std::pow(static_cast<double>(line.at(x).x_m) - mean, 2);
  EXPECT_NEAR(variance, 0.2, 0.002);
}

TEST(Grid, PosesMoveWhereTheyLook) {
  for (int yaw = 0; yaw < 36; yaw += 5) {
    Grid<60, 60, 36> grid(0, 0, 0.25F);
    const float heading = static_cast<float>(yaw) * 0.17453293F;
    grid.fill([&](const GridPose& p) {
      return base::abs(p.x_m - 7.6F) < 0.2F && base::abs(p.y_m - 7.6F) < 0.2F && base::abs(p.yaw_rad - heading) < 0.05F
                 ? 1.0F
                 : 0.0F;
    });
    const GridPose from = grid.mean();
    ASSERT_TRUE(
        grid.begin({.forward_m = 3.0F, .turn_rad = 0.6F, .variance_forward = 0.01F, .variance_turn = 0.01F}, false));
    grid.work(kAll);
    const GridPose to = grid.mean();
    EXPECT_NEAR(to.x_m - from.x_m, 2.9552F * std::cos(heading + 0.3F), 0.03F) << yaw;
    EXPECT_NEAR(to.y_m - from.y_m, 2.9552F * std::sin(heading + 0.3F), 0.03F) << yaw;
    EXPECT_NEAR(std::remainder(to.yaw_rad - from.yaw_rad - 0.6F, 2 * M_PI), 0, 0.01) << yaw;
  }
}

TEST(Grid, ReadOutsAgreeOnAGaussianAndDifferOnTwoModes) {
  Grid<81, 61> plane(0, 0, 0.25F);
  const auto bell = [](float x, float y, float x0, float y0) {
    return base::exp(-0.5F * ((x - x0) * (x - x0) + (y - y0) * (y - y0)) / (1.5F * 1.5F));
  };
  ASSERT_TRUE(plane.begin({}, true));
  plane.work(kAll, [&](const GridPose& p) { return bell(p.x_m, p.y_m, 10.125F, 7.625F); });
  for (const GridPose& pose : {plane.maximum_likelihood(), plane.maximum_a_posteriori(), plane.mean()}) {
    EXPECT_NEAR(pose.x_m, 10.125F, 1e-3F);
    EXPECT_NEAR(pose.y_m, 7.625F, 1e-3F);
  }
  // A prior at 4 m, and a measurement that fits best at 16 m and second best near the prior.
  plane.fill([&](const GridPose& p) { return bell(p.x_m, p.y_m, 4.125F, 7.625F) + 1e-3F; });
  ASSERT_TRUE(plane.begin({}, true));
  plane.work(kAll, [&](const GridPose& p) {
    return bell(p.x_m, p.y_m, 16.125F, 7.625F) + 0.01F * bell(p.x_m, p.y_m, 4.125F, 7.625F);
  });
  EXPECT_NEAR(plane.maximum_likelihood().x_m, 16.125F, 1e-3F);
  EXPECT_NEAR(plane.maximum_a_posteriori().x_m, 4.125F, 0.3F);
  EXPECT_GT(plane.mean().x_m, 5.0F);
  EXPECT_LT(plane.mean().x_m, 15.0F);
}

TEST(Grid, WorkInPiecesLeavesTheSameBits) {
  using Small = Grid<17, 13, 12>;
  const auto likelihood = [](const GridPose& p) {
    return base::exp(-base::abs(p.x_m - 3.0F) - base::abs(p.y_m) + base::cos(p.yaw_rad));
  };
  const auto run = [&](std::uint32_t units) {
    Small grid(0, 0, 0.5F);
    for (int k = 0; k < 6; ++k) {
      EXPECT_TRUE(
          grid.begin({.forward_m = 0.7F, .turn_rad = -0.4F, .variance_forward = 0.3F, .variance_turn = 0.2F}, true));
      EXPECT_FALSE(grid.begin({}, true));  // one step at a time
      for (int calls = 0; !grid.done() && calls < 100'000; ++calls) grid.work(units, likelihood);
      EXPECT_TRUE(grid.done());
    }
    return grid;
  };
  const Small whole = run(kAll);
  for (const std::uint32_t units : {1U, 4U, 7U, 100U}) EXPECT_EQ(run(units).cells(), whole.cells()) << units;
}

TEST(Grid, NothingMakesACellThatIsNoNumber) {
  const float hostile[] = {base::kNan, base::kInfinity, -base::kInfinity, std::numeric_limits<float>::max(), -1.0F,
                           0.0F};
  for (const float value : hostile) {
    Grid<16, 16, 8> grid(0, 0, 0.5F);
    ASSERT_TRUE(grid.begin({}, true));
    grid.work(kAll, [&](const GridPose& p) { return p.x_m > 4.0F ? value : 1.0F; });
    EXPECT_NEAR(mass_of(grid), 1, 2e-6) << value;
    const auto before = grid.cells();
    ASSERT_TRUE(grid.begin({}, true));
    grid.work(kAll, [&](const GridPose&) { return value; });
    EXPECT_TRUE(grid.done());
    EXPECT_EQ(grid.refused(), 1U);
    for (std::size_t i = 0; i < before.size(); ++i) EXPECT_NEAR(grid.cells()[i], before[i], 1e-6F);
    EXPECT_FALSE(grid.fill([&](const GridPose&) { return value; }));
    EXPECT_NEAR(mass_of(grid), 1, 1e-6);
    if (value > 0.0F && value < 1.0F) continue;
    if (!base::is_finite(value) || value < 0.0F) {
      EXPECT_FALSE(grid.begin({.variance_forward = value}, false));
    }
    if (!base::is_finite(value)) {
      EXPECT_FALSE(grid.begin({.forward_m = value}, false));
      EXPECT_FALSE(grid.begin({.turn_rad = value}, false));
      EXPECT_FALSE(grid.begin({.variance_turn = value}, false));
    }
  }
}

/// A bell of place and heading, in two parts.
struct Bell {
  float x_m, y_m, yaw_rad;
  [[nodiscard]] auto at(float x, float y) const {
    const float d = (x - x_m) * (x - x_m) + (y - y_m) * (y - y_m);
    return [d, centre = yaw_rad](float yaw) {
      const float off = base::wrap_angle(yaw - centre);
      return base::exp(-0.5F * d - 2.0F * off * off);
    };
  }
};
static_assert(LikelihoodByPlace<Bell>);

TEST(Grid, ALikelihoodInTwoPartsGivesTheSameBitsAndUnitsAreTheLines) {
  Grid<17, 13, 12> whole(0, 0, 0.5F), parts(0, 0, 0.5F);
  const Bell bell{4, 3, -0.4F};
  for (int k = 0; k < 3; ++k) {
    const GridMotion motion{.forward_m = k == 1 ? 0.0F : 0.7F, .carried_share = 0.01F};
    ASSERT_TRUE(whole.begin(motion, true));
    whole.work(kAll, [&](const GridPose& p) { return bell.at(p.x_m, p.y_m)(p.yaw_rad); });
    ASSERT_TRUE(parts.begin(motion, true));
    std::uint32_t units = 0;
    for (; !parts.done(); ++units) parts.work(1, bell);
    EXPECT_EQ(units, parts.units());
    EXPECT_EQ(units, k == 1 ? 2U * 17 * 13 : 13U * 12 + 17 * 12 + 3 * 17 * 13);
    EXPECT_EQ(whole.cells(), parts.cells());
    EXPECT_NEAR(mass_of(parts), 1, 2e-6);
  }
  ASSERT_TRUE(parts.begin({}, false));
  EXPECT_TRUE(parts.done());  // neither motion nor update
}

TEST(Grid, ARobotThatMayBeCarriedOffIsFoundAgain) {
  for (const float share : {0.0F, 1e-4F}) {
    Grid<20, 20, 12> grid(0, 0, 0.5F);
    grid.fill([](const GridPose& p) { return p.x_m < 1.0F && p.y_m < 1.0F && p.yaw_rad < 0.1F ? 1.0F : 0.0F; });
    for (int k = 0; k < 12; ++k) {
      ASSERT_TRUE(grid.begin({.carried_share = share}, true));
      grid.work(kAll, Bell{8.25F, 7.25F, 1.5707963F});
      EXPECT_NEAR(mass_of(grid), 1, 2e-6);
    }
    const GridPose best = grid.peak();
    EXPECT_EQ(best.x_m > 8.0F && best.y_m > 7.0F, share > 0.0F);
    EXPECT_EQ(best.x_m, grid.maximum_a_posteriori().x_m);
  }
}

TEST(Grid, TheRegionAboutThePeakHasItsMomentsInDouble) {
  Grid<40, 30, 24> grid(-3, 2, 0.25F);
  ASSERT_TRUE(grid.begin({}, true));
  grid.work(kAll, Bell{1.3F, 5.1F, 3.0F});  // across the heading of half a turn
  constexpr int kPlaces = 6, kHeadings = 4;
  const GridPose peak = grid.peak();
  double mass = 0, first[3] = {}, second[3] = {}, xy = 0;
  for (int yaw = 0; yaw < 24; ++yaw)
    for (int y = 0; y < 30; ++y)
      for (int x = 0; x < 40; ++x) {
        const GridPose p = grid.at(x, y, yaw);
        const double d[3] = {static_cast<double>(p.x_m - peak.x_m), static_cast<double>(p.y_m - peak.y_m),
                             std::remainder(static_cast<double>(p.yaw_rad - peak.yaw_rad), 2 * M_PI)};
        if (std::abs(d[0]) > 0.26 * kPlaces || std::abs(d[1]) > 0.26 * kPlaces || std::abs(d[2]) > 0.27 * kHeadings)
          continue;
        const auto m = static_cast<double>(grid.mass(x, y, yaw));
        mass += m;
        xy += m * d[0] * d[1];
        for (int i = 0; i < 3; ++i) first[i] += m * d[i], second[i] += m * d[i] * d[i];
      }
  const GridRegion region = grid.around_peak(kPlaces, kHeadings);
  EXPECT_NEAR(static_cast<double>(region.mass), mass, 1e-5);
  EXPECT_LT(region.mass, 1);
  const double width[3] = {0.25, 0.25, 2 * M_PI / 24};
  for (int i = 0; i < 3; ++i) {
    first[i] /= mass;
    EXPECT_NEAR(static_cast<double>(region.p(i, i)), second[i] / mass - first[i] * first[i] + width[i] * width[i] / 12,
                1e-4);
  }
  EXPECT_NEAR(static_cast<double>(region.p(0, 1)), xy / mass - first[0] * first[1], 1e-4);
  EXPECT_NEAR(static_cast<double>(region.mean.x_m), static_cast<double>(peak.x_m) + first[0], 1e-4);
  EXPECT_NEAR(std::remainder(static_cast<double>(region.mean.yaw_rad) - 3.0, 2 * M_PI), 0, 0.02);
}

// --- MRCLAM: 6 m x 12 m, cells of 0.25 m and 10 degrees, nothing known of the start.

struct Search {
  double found_s = -1;  ///< begin of the time in which the error stayed below half a metre for ten seconds
};

Search search(const test::Mrclam& run) {
  static Grid<24, 48, 36> grid(-1, -6, 0.25F);
  grid.fill([](const GridPose&) { return 1.0F; });
  GridMotion gathered;
  double since = -1;
  Search result;
  run.drive(
      run.start().t_s + 120,
      [&](const test::Mrclam::Command& command, double dt_s) {
        const double turn = std::abs(command.yaw_rate_radps), speed = std::abs(command.forward_mps);
        gathered.forward_m += static_cast<float>(command.forward_mps * dt_s);
        gathered.turn_rad += static_cast<float>(command.yaw_rate_radps * dt_s);
        gathered.variance_forward += static_cast<float>(0.002 * dt_s);
        gathered.variance_turn += static_cast<float>((0.0005 + 0.01 * turn + 0.0005 * speed) * dt_s);
      },
      [&](const std::vector<test::Mrclam::Sighting>& seen) {
        ASSERT_TRUE(grid.begin(gathered, true));
        gathered = {};
        grid.work(kAll, [&](const GridPose& pose) {
          float d = 0.0F;
          for (const auto& one : seen) {
            const auto& landmark = run.landmarks.at(one.barcode);
            const float dx = static_cast<float>(landmark[0]) - pose.x_m,
                        dy = static_cast<float>(landmark[1]) - pose.y_m;
            const float range = base::sqrt(dx * dx + dy * dy) + 1e-3F;
            const float sigma_range = 0.17F + 0.05F * range, sigma_bearing = 0.07F + 0.07F / range;
            const float r = (static_cast<float>(one.range_m) - range) / sigma_range;
            const float b = base::wrap_angle(static_cast<float>(one.bearing_rad) - base::atan2(dy, dx) + pose.yaw_rad) /
                            sigma_bearing;
            d += base::min(r * r + b * b, 13.8F);
          }
          return base::exp(-0.25F * d);
        });
      },
      [&](double t_s) {
        test::Mrclam::Pose truth{};
        if (!run.truth_at(t_s, truth)) return;
        const GridPose best = grid.maximum_a_posteriori();
        const GridPose pose = grid.mean([&](const GridPose& p) {
          return base::abs(p.x_m - best.x_m) < 0.8F && base::abs(p.y_m - best.y_m) < 0.8F;
        });
        const double error =
            std::hypot(static_cast<double>(pose.x_m) - truth.x_m, static_cast<double>(pose.y_m) - truth.y_m);
        if (error > 0.5) since = -1;
        if (error <= 0.5 && since < 0) since = t_s;
        if (result.found_s < 0 && since >= 0 && t_s - since >= 10) result.found_s = since - run.start().t_s;
      });
  return result;
}

TEST(Grid, FindsTheMrclamRobotsFromAnUnknownStart) {
  const std::string folder = test::recorded_folder("mrclam/MRCLAM_Dataset7");
  if (folder.empty()) GTEST_SKIP() << "no mrclam/MRCLAM_Dataset7 in $TETAP_DATA";
  for (int robot = 1; robot <= 5; ++robot) {
    const Search result = search(test::Mrclam(folder, robot));
    std::printf("grid, robot %d: found after %.1f s\n", robot, result.found_s);
    EXPECT_GE(result.found_s, 0) << "robot " << robot;
    EXPECT_LE(result.found_s, 60) << "robot " << robot;
  }
}

}  // namespace
}  // namespace tetap::filter
