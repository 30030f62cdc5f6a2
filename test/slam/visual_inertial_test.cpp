// SPDX-License-Identifier: Apache-2.0
// The visual-inertial window: its laws, its sigmas in a world whose noise is the filter's, and the inertial sensor of
// EuRoC's V1_01 with features that make_euroc_features.py simulates from its truth. Skipped where the data is missing.
#include "slam/inertial_world.hpp"
#include "tetap/base/state_words.hpp"
#include "tetap/slam/visual_map.hpp"

#include <gtest/gtest.h>
#include <unistd.h>
#include <cstdio>
#include <cstdlib>
#include <filesystem>

namespace tetap {
namespace {

using Eyes = slam::VisualInertial<slam::VisualWindow<slam::InertialCore, 10, 40>>;
using MapEyes = slam::VisualInertial<slam::VisualMap<slam::InertialCore, 10, 40, 64>>;
static_assert(sizeof(Eyes) <= 26 * 1024);

std::vector<std::uint32_t> bits_of(const Eyes& eyes) {
  std::vector<std::uint32_t> words;
  const auto sink = [&](std::uint32_t word) { words.push_back(word); };
  base::each_word(eyes, sink);
  return words;
}
/// A ride and the fates of its tracks.
struct Flight {
  std::unique_ptr<Eyes> eyes;
  test::InertialJudgement judged;
  std::vector<slam::TrackRecord> records;
  double nis = 0, degrees = 0;

  Flight(const test::InertialWorld& world, const slam::VisualOptions& options, const slam::InertialSetup& setup,
         int units = 1'000'000, bool reversed = false)
      : eyes(std::make_unique<Eyes>(options, slam::InertialCore(setup))) {
    test::InertialDrive drive = world.drive();
    if (reversed)
      for (auto& image : drive.camera.images) std::reverse(image.features.begin(), image.features.end());
    judged = test::ride<Eyes>(*eyes, drive, 1.0, units, [&](const Eyes& now, std::size_t) {
      for (const auto& record : now.records()) {
        if (record.fate == slam::TrackFate::kPending) continue;
        records.push_back(record);
        if (record.nis < 0.0F) continue;
        nis += static_cast<double>(record.nis);
        degrees += record.degrees;
      }
    });
  }
  [[nodiscard]] float variance(int state) const { return eyes->covariance()(state, state); }
};

TEST(InertialCore, CovarianceMovesByTheNumericDerivative) {
  constexpr float kStep = 2e-3F, kTime_s = 0.1F;
  constexpr int kN = slam::InertialCore::kErrors;
  slam::InertialSetup setup;
  setup.noise = {.gyro_radps_rthz = 0, .accel_mps2_rthz = 0, .gyro_bias_radps2_rthz = 0, .accel_bias_mps3_rthz = 0};
  slam::InertialCore start(setup);
  start.start(nav::from_euler({0.4F, 0.1F, -0.2F}));
  start.shift({3.0F, -2.0F, 1.0F});
  std::array<float, kN> speed{};
  speed[6] = 1.5F, speed[7] = -0.7F, speed[8] = 0.4F;
  start.correct(speed.data());
  filter::BigCovariance<float, kN> p;
  for (int e = 0; e < kN; ++e) {
    filter::BigCovariance<float, kN>::States unit{};
    unit[static_cast<std::size_t>(e)] = 1.0F;
    const auto moved = [&](float by) {
      slam::InertialCore core = start;
      std::array<float, kN> error{};
      error[static_cast<std::size_t>(e)] = by;
      core.correct(error.data());
      p.begin(unit);
      for (int k = 0; k < 20; ++k)
        core.predict(nav::ImuIncrement::constant({0.5F, -0.8F, 1.1F}, {2.0F, 1.0F, 9.0F}, base::Micros{5000}), p, 0);
      core.predict_covariance(p, 0);
      return core;
    };
    const slam::InertialCore high = moved(kStep), low = moved(-kStep), middle = moved(0.0F);
    const auto error_of = [&](const slam::InertialCore& core) {
      const Eigen::Matrix3d turn = test::in_double(core.pose().q_nb) * test::in_double(middle.pose().q_nb).transpose();
      Eigen::Matrix<double, 9, 1> error;
      error << test::rotation_vector(turn),
          test::in_double(core.pose().p_n_m) - turn * test::in_double(middle.pose().p_n_m),
          test::in_double(core.velocity_n_mps()) - turn * test::in_double(middle.velocity_n_mps());
      return error;
    };
    const Eigen::Matrix<double, 9, 1> slope = (error_of(high) - error_of(low)) / (2 * static_cast<double>(kStep));
    for (int i = 0; i < 9; ++i)  // P of one unit error is F e e^T F^T, and (F e)_e = 1
      EXPECT_NEAR(static_cast<double>(p(e, i)), slope(i), 2e-3 + 0.01 * std::abs(slope(i)))
          << e << ", " << i << " after " << kTime_s << " s";
  }
}

TEST(VisualInertial, DealingOfWorkAndOrderOfFeaturesLeaveTheBits) {
  const test::InertialWorld world({.end_s = 15});
  const auto plain = bits_of(*Flight(world, world.options(), {}).eyes);
  EXPECT_EQ(bits_of(*Flight(world, world.options(), {}, 77, true).eyes), plain);
  EXPECT_EQ(bits_of(*Flight(world, world.options(), {}, 4000).eyes), plain);
}

TEST(VisualInertial, AWorldTurnedAboutThePlumbLineAndMovedGivesTheSameNis) {
  const test::InertialWorld here({.end_s = 20}), there({.end_s = 20, .turn_rad = 2.2, .at_n_m = {40'000, -7'000, 300}});
  const Flight a(here, here.options(), {}), b(there, there.options(), {});
  ASSERT_EQ(a.records.size(), b.records.size());
  ASSERT_GT(a.records.size(), 200U);
  for (std::size_t i = 0; i < a.records.size(); ++i) {
    EXPECT_EQ(a.records[i].fate, b.records[i].fate) << i;
    EXPECT_NEAR(a.records[i].nis, b.records[i].nis, 0.1F + 0.02F * a.records[i].nis) << i;
  }
}

TEST(VisualInertial, AStandstillKeepsThePoseAndTeachesNoHeading) {
  const test::InertialWorld world({.end_s = 30, .reach = 0});
  const Flight flight(world, world.options(), {});
  EXPECT_GT(flight.judged.stood, 230) << "of 290 images";
  EXPECT_LT(flight.judged.rmse_m, 0.02);
  EXPECT_LT(flight.judged.whole.beyond_s, 1.0);
  constexpr int kYaw = Eyes::kCore + 2, kEast = Eyes::kCore + 3;
  EXPECT_GT(flight.variance(kYaw), 1e-6F) << "that of the start, at least";
  EXPECT_GT(flight.variance(kEast), 1e-6F);
  EXPECT_LT(flight.judged.whole.rotation_rad, 0.03) << "a tilt that the accelerometer's bias hides";
}

TEST(VisualInertial, SlowMotionIsNoStandstill) {
  const test::InertialWorld world({.end_s = 30, .reach = 0.1});  // some 6 cm/s
  const Flight flight(world, world.options(), {});
  EXPECT_LT(flight.judged.stood, 60) << "20 of the rest, and turns of a sway";
  EXPECT_LT(flight.judged.whole.end_m, 0.5);
}

TEST(VisualInertial, WhatIsNoRestStartsNothing) {
  Eyes eyes;
  slam::RestMeans rest;
  rest.add(nav::ImuIncrement::constant({0, 0, 0}, {0, 0, 9.8F}, base::Micros{100'000}));
  EXPECT_FALSE(eyes.start_at_rest(rest, 0, 1e-3F, {}, 1e-3F)) << "a tenth of a second";
  rest.add({.dtheta_b_rad = {base::kNan, 0, 0}, .dt = base::Micros{100'000}});
  EXPECT_FALSE(rest.known());
  EXPECT_FALSE(eyes.predict({.dtheta_b_rad = {base::kNan, 0, 0}, .dt = base::Micros{5000}}));
  EXPECT_FALSE(slam::InertialSetup{.sigma_speed_mps = -1.0F}.valid());
  EXPECT_FALSE(slam::InertialSetup{.sigma_time_offset_s = base::kNan}.valid());
  EXPECT_TRUE(slam::InertialSetup{}.valid());
}

/// Over seeds, with the filter's noise off by factors: mean NEES of the pose, NIS for each degree of freedom, time
/// offset's error in sigmas (root mean square).
struct Honesty {
  double nees = 0, nis = 0, offset = 0;
  Honesty(int seeds, float of_pixels, float of_motion) {
    double degrees = 0;
    for (int seed = 1; seed <= seeds; ++seed) {
      const test::InertialWorld world({.seed = static_cast<unsigned>(seed)});
      auto options = world.options();
      options.sigma_px *= of_pixels;
      slam::InertialSetup setup;
      setup.noise.gyro_radps_rthz *= of_motion;
      setup.noise.accel_mps2_rthz *= of_motion;
      const Flight flight(world, options, setup);
      nees += flight.judged.whole.nees / seeds;
      nis += flight.nis, degrees += flight.degrees;
      const double miss = flight.judged.offset_s - world.drive().offset_s;
      offset += miss * miss / static_cast<double>(flight.variance(Eyes::kOffset)) / seeds;
      miss_s += std::abs(miss) / seeds;
    }
    nis /= degrees;
    offset = std::sqrt(offset);
  }
  double miss_s = 0;
};

int seeds_asked(int usual) {
  const char* const asked = std::getenv("TETAP_SEEDS");
  return asked != nullptr ? std::atoi(asked) : usual;
}

TEST(VisualInertialWorld, SigmasAreHonestInAMatchedWorldAndOnlyThere) {
  const int seeds = seeds_asked(20);
  const Honesty matched(seeds, 1, 1), pixels(seeds, 1 / 3.0F, 1), motion(seeds, 1, 1 / 3.0F);
  std::printf(
      "NEES of 6, NIS of 1 over %d seeds: matched %.2f %.2f, R a third %.2f %.2f, Q a third %.2f %.2f; time offset off "
      "by %.2f ms, %.1f sigma\n",
      seeds, matched.nees, matched.nis, pixels.nees, pixels.nis, motion.nees, motion.nis, 1e3 * matched.miss_s,
      matched.offset);
  EXPECT_GT(matched.nees, 4.8);
  EXPECT_LT(matched.nees, 7.2);
  EXPECT_NEAR(matched.nis, 1.0, 0.1);
  EXPECT_LT(matched.miss_s, 3e-3) << "10 ms at the start";
  EXPECT_GT(pixels.nees, 7.2);
  EXPECT_GT(motion.nees, 7.2);
}

std::vector<std::vector<double>> table(const std::string& path, std::size_t columns) {
  std::ifstream file(path);
  if (!file) throw std::runtime_error(path + ": not there");
  std::vector<std::vector<double>> rows;
  std::vector<double> row(columns);
  for (std::size_t i = 0; file >> row[i];) {
    if (++i < columns) continue;
    rows.push_back(row);
    i = 0;
  }
  return rows;
}
/// A drive that make_euroc_features.py wrote, with the numbers of cam0.
test::InertialDrive read_inertial_drive(const std::string& stem) {
  test::InertialDrive drive;
  drive.camera.camera = {.fu_px = 458.654F, .fv_px = 457.296F, .cu_px = 367.215F, .cv_px = 248.375F};
  Eigen::Matrix3d r_bc;
  r_bc << 0.0148655429818, -0.999880929698, 0.00414029679422, 0.999557249008, 0.0149672133247, 0.025715529948,
      -0.0257744366974, 0.00375618835797, 0.999660727178;
  drive.camera.mounting = {.q_cb = test::in_float(r_bc.transpose()),
                           .lever_b_m = {-0.0216401454975F, -0.064676986768F, 0.00981073058949F}};
  for (const auto& row : table(stem + ".imu.csv", 7))
    drive.imu.push_back({std::llround(row[0]), {row[1], row[2], row[3]}, {row[4], row[5], row[6]}});
  for (const auto& row : table(stem + ".truth.csv", 11)) {
    test::DriveImage image;
    image.time_s = row[0] * 1e-6;
    image.p_n_m = {row[1], row[2], row[3]};
    image.r_nb = Eigen::Quaterniond(row[4], row[5], row[6], row[7]).normalized().toRotationMatrix();
    drive.camera.images.push_back(image);
    drive.v_n_mps.push_back({row[8], row[9], row[10]});
  }
  drive.recognised.resize(drive.camera.images.size());
  const auto features = [&](const char* name, auto&& of_image) {
    for (const auto& row : table(stem + name, 4)) {
      const auto of = [&](std::size_t i) { return static_cast<std::uint16_t>(row[i]); };
      of_image(static_cast<std::size_t>(row[0])).push_back({of(1), of(2), of(3)});
    }
  };
  features(
      ".features.csv", [&](std::size_t image) -> auto& { return drive.camera.images.at(image).features; });
  features(
      ".recognised.csv", [&](std::size_t image) -> auto& { return drive.recognised.at(image); });
  return drive;
}

/// Drives of V1_01, made once for each seed of the features.
class VisualInertialData : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    const char* const set = std::getenv("TETAP_DATA");
    const auto data = std::filesystem::path(set != nullptr ? set : TETAP_DEFAULT_DATA) / "euroc_v1_01";
    if (!std::filesystem::exists(data / "truth.csv")) return;
    const auto folder = std::filesystem::path(testing::TempDir()) / ("tetap_euroc_" + std::to_string(::getpid()));
    std::filesystem::create_directories(folder);
    folder_ = folder.string();
    for (int seed = 1; seed <= seeds_asked(1); ++seed) {
      const std::string stem = folder_ + "/" + std::to_string(seed);
      const std::string command = TETAP_SOURCE "/test/slam/make_euroc_features.py '" + data.string() + "' '" + stem +
                                  "' --seed " + std::to_string(seed);
      ASSERT_EQ(std::system(command.c_str()), 0) << command;
      drives_.push_back(read_inertial_drive(stem));
      drives_.back().offset_s = 0.005;
    }
  }
  static void TearDownTestSuite() {
    drives_.clear();
    if (!folder_.empty()) std::filesystem::remove_all(folder_);
  }
  void SetUp() override {
    if (drives_.empty()) GTEST_SKIP() << "no truth.csv in $TETAP_DATA/euroc_v1_01";
  }
  template <class Window>
  static test::InertialJudgement fly(const test::InertialDrive& drive, const char* what) {
    const slam::VisualOptions options{
        .camera = drive.camera.camera, .mounting = drive.camera.mounting, .sigma_px = 1.0F};
    const auto window = std::make_unique<Window>(options, slam::InertialCore(slam::InertialSetup{}));
    const auto out = test::ride<Window>(*window, drive, 2.0);
    const auto& count = window->counters();
    std::printf(
        "%-8s RMSE %.3f m (first 60 s %.3f, last %.3f), end %.3f of %.1f m, NEES %.1f, from 60 s on %.1f, scale %.4f, "
        "tilt %.4f rad, offset %.2f ms, beyond 3 sigma %.1f s; stood %d used %u gated %u no depth %u; %zu bytes\n",
        what, out.rmse_m, out.first_m, out.last_m, out.whole.end_m, out.whole.path_m, out.whole.nees, out.late.nees,
        out.scale, out.tilt_rad, 1e3 * out.offset_s, out.whole.beyond_s, out.stood, count.used, count.gated,
        count.no_depth, sizeof(Window));
    return out;
  }
  static const std::vector<test::InertialDrive>& drives() { return drives_; }

 private:
  static inline std::string folder_;
  static inline std::vector<test::InertialDrive> drives_;
};

TEST_F(VisualInertialData, FromRestScaleAndAttitudeAreFoundAndTheEndIsWithinOnePercent) {
  for (const test::InertialDrive& drive : drives()) {
    const auto out = fly<Eyes>(drive, "eyes");
    EXPECT_LE(out.whole.end_m, 0.01 * out.whole.path_m);
    EXPECT_NEAR(out.whole.path_m, 58.0, 1.0);
    EXPECT_NEAR(out.scale, 1.0, 0.02);
    EXPECT_LT(out.tilt_rad, 0.01);
    EXPECT_LE(out.late.nees, 12.0);
    EXPECT_NEAR(out.offset_s, 0.005, 0.002) << "the truth's stamps are 1 ms off themselves";
  }
}

TEST_F(VisualInertialData, WithIdentitiesTheRoomHoldsThePath) {
  for (const test::InertialDrive& drive : drives()) {
    const auto without = fly<Eyes>(drive, "no map"), out = fly<MapEyes>(drive, "map");
    EXPECT_LE(out.rmse_m, 0.15);
    EXPECT_LE(out.last_m, 1.2 * out.first_m);
    EXPECT_LT(out.last_m, 0.5 * without.last_m);
  }
}

}  // namespace
}  // namespace tetap
