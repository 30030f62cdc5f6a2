// SPDX-License-Identifier: Apache-2.0
// A robot with a camera, as frames in and frames out, on the simulated road of slam/visual_world.hpp: the laws of an
// image on its way to the window filter.
#include "node/bench.hpp"
#include "slam/visual_world.hpp"
#include "tetap/bus/encoder.hpp"
#include "tetap/estimators/visual/visual_odometry.hpp"

#include <gtest/gtest.h>
#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <numeric>

namespace tetap::test {
namespace {

using Visual = estimators::VisualOdometry6;
using Robot = node::Estimators<estimators::Odometry, Visual>;
using Slam = estimators::VisualSlam64;
using Mapper = node::Estimators<estimators::Odometry, Slam>;
static_assert(Mapper::kMakesMap && estimators::MapsLandmarks<Slam> && !estimators::MakesMap<Visual>);
static_assert(sizeof(Slam) <= 160 * 1024);
static_assert(Robot::kNeedsMapIds && !Robot::kMakesMap && node::WorksInJobs<Visual> && node::RecordsLater<Visual> &&
              estimators::SeesImages<Visual>);
static_assert(sizeof(Visual) <= 16 * 1024 && sizeof(estimators::VisualOdometry4) <= 8 * 1024);

/// An image on its way: its frames, and how much later than its stamp they come.
struct Sent {
  Frames frames;
  std::int64_t late_us = 0;
};
using Fault = std::function<void(std::size_t image, Sent& sent)>;

template <class Robot>
class RoadOf {
 public:
  explicit RoadOf(std::int32_t work_units = 4'000, int images = 60) : world_({.images = images}), numbers_(kNumbers) {
    const VisualWorldOptions o;
    const Drive& drive = world_.drive();
    numbers_.loop.work_units = work_units;
    numbers_.wheels.noise = {.speed = o.noise.position_walk_m * o.noise.position_walk_m, .yaw_rate = 0.1F};
    numbers_.gyro = {.use = 1, .noise = o.noise.angle_walk_rad * o.noise.angle_walk_rad};
    numbers_.camera.fu_px = drive.camera.fu_px;
    numbers_.camera.fv_px = drive.camera.fv_px;
    numbers_.camera.cu_px = drive.camera.cu_px;
    numbers_.camera.cv_px = drive.camera.cv_px;
    for (int i = 0; i < 3; ++i) numbers_.camera.position_b_m[static_cast<std::size_t>(i)] = drive.mounting.lever_b_m(i);
    numbers_.camera.sigma_px = static_cast<float>(o.sigma_px);
    numbers_.publish.diagnostics_every = 1;
    numbers_.publish.event_every = 1;
    numbers_.publish.side_every = 1;
  }

  void drive(const Fault& fault = {}) {
    bench_ = std::make_unique<BenchOf<Robot>>(numbers_);
    const auto& images = world_.drive().images;
    struct Due {
      std::int64_t at_us;
      Frames frames;
    };
    std::vector<Due> due;
    const auto at = [](const DriveImage& image) {
      return BenchOf<Robot>::kStart_us + std::llround((image.time_s - 0.9) * 1e6);
    };
    for (std::size_t k = 0; k < images.size(); ++k) {
      const std::int64_t now_us = at(images[k]);
      due.push_back({now_us, motion(images[k], now_us, k)});
      Sent sent;
      bus::encode_image({}, images[k].features, bus::SampleHead::of({now_us}, static_cast<std::uint8_t>(k), 0),
                        [&](const auto& message) { sent.frames.push_back(in(message)); });
      if (fault) fault(k, sent);
      due.push_back({now_us + sent.late_us, sent.frames});
      if (recognised_every == 0) continue;
      std::vector<model::ImageFeature> known;
      for (const auto& feature : images[k].features)
        if (feature.id % recognised_every == 0) known.push_back(feature);
      sent = {};
      bus::encode_image({}, known, bus::SampleHead::of({now_us}, static_cast<std::uint8_t>(k), 3),
                        [&](const auto& message) { sent.frames.push_back(in(message)); });
      if (fault_of_recognised) fault_of_recognised(k, sent);
      due.push_back({now_us + sent.late_us, sent.frames});
    }
    std::stable_sort(due.begin(), due.end(), [](const Due& a, const Due& b) { return a.at_us < b.at_us; });
    last_us_ = at(images.back());
    std::size_t next = 0;
    for (const std::int64_t end_us = last_us_ + 600'000; bench_->now_us < end_us;) {
      Frames frames;
      for (; next < due.size() && due[next].at_us <= bench_->now_us + 10'000; ++next)
        frames.insert(frames.end(), due[next].frames.begin(), due[next].frames.end());
      note(bench_->epoch(frames));
    }
  }

  [[nodiscard]] double error_m(std::size_t estimator) const {
    const DriveImage& end = world_.drive().images.back();
    const Eigen::Vector3d odometry = end.p_n_m;
    return std::hypot(x_m[estimator] - odometry(0), y_m[estimator] - odometry(1));
  }
  /// The same road through the window filter itself, whole images and motions at once.
  [[nodiscard]] double apart_from_the_filter_m() const {
    Drive drive = world_.drive();
    for (DriveImage& image : drive.images) image.speed_b_mps.tail<2>().setZero();  // a bus has the forward speed alone
    slam::VisualOptions options = world_.options();
    const auto window = std::make_unique<slam::VisualWindow<slam::SpeedCore, 6, 40>>(options);
    run_drive(*window, drive, 0, drive.images.size() - 1);
    const auto at = [&](int i) {
      return 1e-6 * static_cast<double>(window->origin_um()[static_cast<std::size_t>(i)]) +
             static_cast<double>(window->pose().p_n_m(i));
    };
    return std::hypot(x_m[1] - at(0), y_m[1] - at(1));
  }
  [[nodiscard]] std::uint16_t incomplete() const { return bench_->node.counters().incomplete; }
  [[nodiscard]] const bus::Counters& counters() const { return bench_->node.counters(); }

  unsigned recognised_every = 0;  ///< features whose identities are multiples of it are recognised as well; 0: none
  Fault fault_of_recognised;
  std::vector<bus::EstVisual> visual;
  std::vector<bus::EstInnov> records;
  std::vector<bus::EstLandmark> landmarks;
  std::array<double, 2> x_m{}, y_m{};
  std::uint32_t crc = 0;

 private:
  static Frames motion(const DriveImage& image, std::int64_t now_us, std::size_t k) {
    Frames frames;
    const auto put = [&](const auto& message, std::size_t instance = 0) { frames.push_back(in(message, instance)); };
    const bool first = k == 0;
    for (const int half : {1, 0}) {
      sensor::ImuSample imu{.temperature_degC = base::kNan, .interval_us = 50'000};
      for (int i = 0; i < 3 && !first; ++i)
        imu.dangle_b_rad[static_cast<std::size_t>(i)] = static_cast<float>(0.05 * image.rate_b_radps(i));
      bus::encode_sample(imu,
                         bus::SampleHead::of({now_us - half * 50'000},
                                             static_cast<std::uint8_t>(2 * k + 1 - static_cast<std::size_t>(half)), 0),
                         put);
    }
    bus::encode_sample(sensor::BodySpeed{.forward_mps = first ? 0.0F : static_cast<float>(image.speed_b_mps(0)),
                                         .yaw_rate_radps = base::kNan},
                       bus::SampleHead::of({now_us}, static_cast<std::uint8_t>(k), 0), put);
    return frames;
  }
  void note(const Frames& out) {
    for (const auto& one : all<bus::EstVisual>(out)) visual.push_back(one);
    for (const auto& one : all<bus::EstInnov>(out))
      if (one.sensor == sensor::Sensor::kFeature) records.push_back(one);
    for (const auto& one : all<bus::EstLandmark>(out)) landmarks.push_back(one);
    for (std::size_t i = 0; i < 2 && bench_->now_us <= last_us_; ++i)
      if (const auto pos = last<bus::EstPos>(out, i)) x_m[i] = 1e-3 * pos->x_raw, y_m[i] = 1e-3 * pos->y_raw;
    crc = last<bus::EstStateCrc>(out)->crc;
  }

  VisualWorld world_;
  param::Parameters numbers_;
  std::unique_ptr<BenchOf<Robot>> bench_;
  std::int64_t last_us_ = 0;  ///< stamp of the last image
};

using Road = RoadOf<Robot>;

TEST(VisualNode, FollowsTheFilterFedByHandAndTellsOfEachImage) {
  Road road;
  road.drive();
  EXPECT_EQ(road.incomplete(), 0);
  ASSERT_EQ(road.visual.size(), 60U) << "one report an image";
  int used = 0;
  for (std::size_t k = 0; k < road.visual.size(); ++k) {
    EXPECT_EQ(road.visual[k].seq, k & 15);
    used += road.visual[k].used;
  }
  EXPECT_GT(used, 60);
  const auto accepted = std::count_if(road.records.begin(), road.records.end(),
                                      [](const bus::EstInnov& r) { return r.verdict == sensor::Verdict::kAccepted; });
  EXPECT_EQ(accepted, used) << "and one record a track";
  const double apart_m = road.apart_from_the_filter_m();
  std::printf("after 48 m: %.2f m from the truth, %.3f m from the window filter fed by hand\n", road.error_m(1),
              apart_m);
  EXPECT_LT(apart_m, 0.1);
}

TEST(VisualNode, AnImageThatIsLateByLessThanTheWindowLeavesTheBits) {
  Road on_time, late;
  on_time.drive();
  late.drive([](std::size_t k, Sent& sent) { sent.late_us = k % 3 == 1 ? 150'000 : k % 3 == 2 ? 40'000 : 0; });
  EXPECT_EQ(late.visual.size(), on_time.visual.size());
  EXPECT_EQ(late.counters().too_late, 0);
  EXPECT_EQ(on_time.crc, late.crc);
  Road too_late;
  too_late.drive([](std::size_t k, Sent& sent) { sent.late_us = k == 30 ? 250'000 : 0; });
  EXPECT_EQ(too_late.counters().too_late, 1);
  EXPECT_NE(on_time.crc, too_late.crc);
}

TEST(VisualNode, TheOrderOfFeaturesLeavesTheBits) {
  Road sorted, mixed;
  sorted.drive();
  std::mt19937 random(5);
  mixed.drive([&](std::size_t, Sent& sent) { std::shuffle(sent.frames.begin(), sent.frames.end() - 1, random); });
  EXPECT_EQ(sorted.crc, mixed.crc);
}

TEST(VisualNode, AnImageWithoutItsEndOrAFeatureIsAsIfItHadNotCome) {
  Road absent, endless, torn;
  absent.drive([](std::size_t k, Sent& sent) {
    if (k == 30) sent.frames.clear();
  });
  endless.drive([](std::size_t k, Sent& sent) {
    if (k == 30) sent.frames.pop_back();
  });
  torn.drive([](std::size_t k, Sent& sent) {
    if (k == 30) sent.frames.erase(sent.frames.begin());
  });
  EXPECT_EQ(absent.visual.size(), 59U);
  EXPECT_EQ(absent.crc, endless.crc);
  EXPECT_EQ(absent.crc, torn.crc);
  EXPECT_EQ(absent.incomplete(), 0);
  EXPECT_EQ(endless.incomplete(), 1);
  EXPECT_EQ(torn.incomplete(), 1);
}

TEST(VisualNode, AFullPoolAndAJobThatIsTooLongLoseImagesAndNoMore) {
  Road flooded;
  flooded.drive([](std::size_t k, Sent& sent) {  // five more images of the moment: more than the pool has places
    if (k != 30) return;
    const Frames one = sent.frames;
    for (int copy = 1; copy <= 5; ++copy)
      for (base::CanFrame frame : one) {
        frame.data[2] = static_cast<std::uint8_t>((frame.data[2] & 0x0F) | ((30 + copy) << 4 & 0xF0));
        sent.frames.push_back(frame);
      }
  });
  EXPECT_GE(flooded.counters().timeline_full, 2);
  EXPECT_LT(flooded.error_m(1), 0.03 * 48);
  Road slow(50);  // a job lasts longer than the window: later images find no place
  slow.drive();
  EXPECT_LT(slow.visual.size(), 50U);
  EXPECT_GE(slow.visual.size() + slow.counters().timeline_full, 55U) << "each is done or counted";
  EXPECT_LT(slow.error_m(1), 0.03 * 48);
}

TEST(VisualNode, WhatIsRecognisedBecomesAMapOnTheBus) {
  RoadOf<Mapper> road(30'000);
  road.recognised_every = 4;
  road.drive();
  EXPECT_EQ(road.incomplete(), 0);
  EXPECT_EQ(road.counters().not_used, 0);
  EXPECT_EQ(road.visual.size(), 60U) << "one report an image, none of the recogniser's";
  std::array<int, 16> verdicts{};
  for (const bus::EstInnov& one : road.records)
    if (one.id != 0xFF) ++verdicts[static_cast<std::size_t>(one.verdict)];
  EXPECT_GT(verdicts[static_cast<std::size_t>(sensor::Verdict::kNewLandmark)], 3);
  EXPECT_GT(verdicts[static_cast<std::size_t>(sensor::Verdict::kAccepted)], 20);
  ASSERT_FALSE(road.landmarks.empty());
  for (const bus::EstLandmark& one : road.landmarks) EXPECT_TRUE(one.id % 4 == 0 || one.id == 0xFF) << int{one.id};
  EXPECT_LT(road.error_m(1), 0.03 * 48);
  Road blind;
  blind.recognised_every = 4;
  blind.drive();
  EXPECT_GT(blind.counters().not_used, 60) << "a robot without a map counts them and uses none";
  Road plain;
  plain.drive();
  EXPECT_EQ(plain.x_m, blind.x_m);
}

TEST(VisualNode, WhatIsRecognisedLateOrInAnotherOrderLeavesTheBits) {
  RoadOf<Mapper> on_time(30'000), late(30'000);
  on_time.recognised_every = late.recognised_every = 4;
  std::mt19937 random(5);
  late.fault_of_recognised = [&](std::size_t k, Sent& sent) {
    sent.late_us = k % 3 == 1 ? 120'000 : 0;
    std::shuffle(sent.frames.begin(), sent.frames.end() - 1, random);
  };
  on_time.drive();
  late.drive();
  EXPECT_EQ(late.counters().too_late, 0);
  EXPECT_EQ(on_time.crc, late.crc);
}

}  // namespace
}  // namespace tetap::test
