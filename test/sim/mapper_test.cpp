// SPDX-License-Identifier: Apache-2.0
// A robot that maps landmarks without identities, in the simulated world. Its uncertainty is honest in the world that
// the filter models. Clutter, moving obstacles and unmodelled errors do not lead it astray without a word.
#include "config/mapper.hpp"
#include "sim_host/matched_rover.hpp"
#include "sim_host/simulated_robot.hpp"
#include "sim_host/world_source.hpp"

#include "test/sim/published_pose.hpp"
#include "test/sim/support.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <memory>
#include <vector>

namespace tetap::sim {
namespace {

constexpr std::size_t kMapper = 1;
constexpr double kBeyond = 14.16;         // chi-square with 3 degrees of freedom, 99.73 %
constexpr double kSame_m = 1;             // a landmark of the map is what stands nearer than this
constexpr base::Micros kSaid{5'000'000};  // an ambiguous sighting excuses the error for so long

struct Scored {
  double nees = 0;    ///< mean of the pose, 3 expected
  double beyond = 0;  ///< share of the epochs beyond 3 sigma
  double silent = 0;  ///< the same without an ambiguous sighting
  double rmse_m = 0;
  int wrong = 0, judged = 0;  ///< associations
  int mapped = 0;             ///< landmarks in the map at the end that stand within kSame_m of a true one
  int strays = 0;             ///< confirmed landmarks that do not
  double map_rmse_m = 0;
};

World::Options loop_world(double loop_m, int laps, int landmarks) {
  World::Options options{.map_given = false};
  options.parameters.camera.identities = false;
  options.course = loop_course(loop_m, laps, landmarks);
  return options;
}

/// The nearest true landmark and its distance.
std::pair<int, double> nearest(const World& world, double x_m, double y_m) {
  std::pair<int, double> found{-1, std::numeric_limits<double>::infinity()};
  for (const Landmark& mark : world.map())
    if (const double d = std::hypot(mark.x_m - x_m, mark.y_m - y_m); d < found.second) found = {mark.id, d};
  return found;
}

class Mapping {
 public:
  Mapping(const World::Options& options, const param::Parameters& parameters, std::uint64_t seed)
      : parameters_{parameters},
        source_{World(options, seed), parameters.can_base, base::Micros{10'000}, base::Micros{600'000'000}},
        node_{std::make_unique<Node>(parameters_, bus::Version{})} {}

  Scored run() {
    Tick tick;
    while (source_.next(tick)) {
      if (tick.begin) node_->power_on(*tick.begin);
      for (const base::CanFrame& frame : tick.inputs) node_->on_frame(frame);
      Published published;
      node_->tick(tick.time, {}, [&](const base::CanFrame& frame) {
        const std::uint32_t offset = frame.id - parameters_.can_base;
        published.take(offset, bus::payload(frame), kMapper);
        take(offset, bus::payload(frame), tick.time);
      });
      if (const auto nees = published.nees(source_.truth())) judge(*nees, *published.position, tick.time);
    }
    finish();
    return scored_;
  }

 private:
  using Node = node::Node<robot::mapper::Estimators>;
  struct Place {
    double x_m, y_m;
    int hits = 0;
  };

  void take(std::uint32_t offset, std::span<const std::uint8_t> payload, base::Micros now) {
    if (offset == bus::EstLandmark::kOffset)
      if (const auto one = bus::decode<bus::EstLandmark>(payload))
        map_[one->id] = {one->x_raw * bus::EstLandmark::kXScale, one->y_raw * bus::EstLandmark::kYScale};
    if (offset == bus::EstLandmarkStd::kOffset)
      if (const auto one = bus::decode<bus::EstLandmarkStd>(payload)) map_[one->id].hits = one->hits;
    if (offset != bus::EstInnov::kOffset) return;
    const auto record = bus::decode<bus::EstInnov>(payload);
    if (!record || record->estimator != kMapper || record->sensor != sensor::Sensor::kRangeBearing) return;
    if (record->verdict == sensor::Verdict::kAmbiguous) ambiguous_ = now;
    if (record->verdict == sensor::Verdict::kAccepted) judge_association(record->id, stamp_of(*record, now).us);
  }
  /// The age counts from the epoch of the record, which may have waited for its frame.
  [[nodiscard]] base::Micros stamp_of(const bus::EstInnov& record, base::Micros now) const {
    const std::int64_t waited = (static_cast<std::int64_t>(node_->epoch()) - record.epoch) & 15;
    return now - base::Micros{10'000 * waited + static_cast<std::int64_t>(1e6 * static_cast<double>(record.age_s))};
  }
  /// Wrong where what stands at the map's landmark was not among what was seen at the stamp. Clutter and moving
  /// obstacles stand nowhere.
  void judge_association(std::uint8_t id, std::int64_t stamp_us) {
    const auto found = map_.find(id);
    if (found == map_.end()) return;
    const auto [at, distance_m] = nearest(source_.world(), found->second.x_m, found->second.y_m);
    const int landmark = distance_m < kSame_m ? at : Camera::kNoLandmark;
    bool known = false, seen = false;
    const auto sightings = source_.world().sightings();
    for (std::size_t i = sightings.size(); i-- > 0 && sightings[i].stamp.us > stamp_us - 1500;)
      if (std::abs(sightings[i].stamp.us - stamp_us) <= 1500)
        known = true, seen = seen || sightings[i].landmark == landmark;
    if (!known) return;
    ++scored_.judged;
    scored_.wrong += seen ? 0 : 1;
  }
  void judge(double nees, const bus::EstPos& position, base::Micros now) {
    const Truth& truth = source_.truth();
    sum_ += nees;
    square_ += std::pow(bus::EstPos::kXScale * position.x_raw - truth.x_m, 2) +
               std::pow(bus::EstPos::kYScale * position.y_raw - truth.y_m, 2);
    ++epochs_;
    if (nees < kBeyond) return;
    scored_.beyond += 1;
    scored_.silent += now - ambiguous_ > kSaid ? 1 : 0;
  }
  void finish() {
    scored_.nees = sum_ / epochs_;
    scored_.rmse_m = std::sqrt(square_ / epochs_);
    scored_.beyond /= epochs_, scored_.silent /= epochs_;
    double square = 0;
    for (const auto& [id, place] : map_) {
      const double d = nearest(source_.world(), place.x_m, place.y_m).second;
      if (place.hits < 3) continue;
      ++(d < kSame_m ? scored_.mapped : scored_.strays);
      square += d < kSame_m ? d * d : 0;
    }
    scored_.map_rmse_m = std::sqrt(square / std::max(scored_.mapped, 1));
  }

  param::Parameters parameters_;
  WorldSource source_;
  std::unique_ptr<Node> node_;
  Scored scored_;
  std::map<std::uint8_t, Place> map_;
  base::Micros ambiguous_{-kSaid.us};
  double sum_ = 0, square_ = 0, epochs_ = 0;
};

struct Campaign {
  std::vector<double> nees;
  Scored mean;
};
Campaign campaign(const char* name, const World::Options& options, const param::Parameters& parameters, int seeds) {
  Campaign all;
  for (int seed = 1; seed <= seeds; ++seed) {
    const Scored one = Mapping(options, parameters, static_cast<std::uint64_t>(seed)).run();
    all.nees.push_back(one.nees);
    all.mean.beyond += one.beyond / seeds, all.mean.silent += one.silent / seeds, all.mean.rmse_m += one.rmse_m / seeds;
    all.mean.map_rmse_m += one.map_rmse_m / seeds;
    all.mean.wrong += one.wrong, all.mean.judged += one.judged;
    all.mean.mapped += one.mapped, all.mean.strays += one.strays;
  }
  all.mean.nees = statistics(all.nees).mean;
  const Scored& m = all.mean;
  std::printf(
      "%s, %d seeds: NEES %.2f of 3 (s %.2f), beyond 3 sigma %.2f %%, silent %.2f %%, wrong %d of %d, RMSE %.3f m, map "
      "%.3f m, mapped %.1f, strays %.1f\n",
      name, seeds, m.nees, std::sqrt(statistics(all.nees).variance), 100 * m.beyond, 100 * m.silent, m.wrong, m.judged,
      m.rmse_m, m.map_rmse_m, static_cast<double>(m.mapped) / seeds, static_cast<double>(m.strays) / seeds);
  return all;
}

/// The world that the filter models, from a start that is known to a few millimetres. An error of the start lasts for
/// the whole run: a NEES would be one draw and no mean.
World::Options modelled_world(double gyro_noise = 1, double wheel_noise = 1) {
  World::Options options = loop_world(60, 2, 24);
  options.parameters = matched(options.parameters);
  options.parameters.imu.gyro_noise *= gyro_noise;
  options.parameters.wheels.noise_m *= wheel_noise;
  options.parameters.vehicle.start_m = 0.002;
  options.parameters.vehicle.start_rad = 0.001;
  return options;
}

/// The mapper told exactly the noise of a world whose only errors are matched()'s.
param::Parameters told(const World::Options& options) {
  param::Parameters n = matched_landmarks_rover(options);
  n.mapping = robot::mapper::parameters.mapping;
  n.landmark.gate_scale = robot::mapper::parameters.landmark.gate_scale;
  n.publish = robot::mapper::parameters.publish;
  return n;
}

TEST(Mapper, is_honest_in_the_world_that_it_models) {
  constexpr int kSeeds = 30;
  // A gyroscope as good as its data sheet, and one 20 times as noisy with wheels to match.
  for (const World::Options& options : {modelled_world(), modelled_world(20, 10)}) {
    const Campaign all = campaign("matched", options, told(options), kSeeds);
    const double scatter = 2.7564 * std::sqrt(statistics(all.nees).variance / kSeeds);  // Student, 99 %
    EXPECT_LE(std::abs(all.mean.nees - 3), scatter);
    EXPECT_LT(scatter, 1);
    EXPECT_LE(all.mean.silent, 0.01);
    EXPECT_GT(all.mean.judged, 1000 * kSeeds);
    EXPECT_EQ(all.mean.wrong, 0);
    EXPECT_EQ(all.mean.strays, 0);
  }
}

TEST(Mapper, a_noise_that_is_told_wrong_by_three_shows) {
  const World::Options options = modelled_world();
  param::Parameters wrong = told(options);
  wrong.landmark.sigma_range_m /= 3, wrong.landmark.sigma_bearing_rad /= 3;
  wrong.landmark.gate_scale = 15;
  EXPECT_GT(campaign("R too small", options, wrong, 4).mean.nees, 6);
}

TEST(Mapper, clutter_and_moving_obstacles_lead_it_astray_seldom_and_never_silently) {
  World::Options options = loop_world(60, 2, 24);
  options.parameters.vehicle.start_m = 0.002;
  options.parameters.vehicle.start_rad = 0.001;
  simulate(robot::mapper::parameters, {.landmarks = true, .own_map = true, .nameless = true}, options);
  options.parameters.camera.clutter = 0.3;
  options.parameters.camera.movers = 2;
  const Campaign all = campaign("clutter", options, robot::mapper::parameters, 10);
  EXPECT_LE(all.mean.silent, 0.01);
  EXPECT_GT(all.mean.judged, 1000 * 10);
  EXPECT_LT(all.mean.wrong, 0.03 * all.mean.judged);
  EXPECT_GT(all.mean.nees, 0.3);
  EXPECT_LT(all.mean.nees, 4.5);
}

/// One rim runs 2 m/s faster than it rolls, for 3 s: 3 m of way that there was not.
TEST(Mapper, a_wheel_that_spins_does_not_lead_it_astray) {
  World::Options options = loop_world(60, 2, 24);
  simulate(robot::mapper::parameters, {.landmarks = true, .own_map = true, .nameless = true}, options);
  options.faults = {{.fault = Fault::kWheelSpin, .start = {45'000'000}, .duration = {3'000'000}}};
  const Campaign all = campaign("wheel spin", options, robot::mapper::parameters, 10);
  EXPECT_LT(all.mean.rmse_m, 0.5);
  EXPECT_GT(all.mean.rmse_m, 0.05);
  EXPECT_LE(all.mean.silent, 0.01);
  EXPECT_GT(all.mean.nees, 0.3);
  EXPECT_LT(all.mean.nees, 4.5);
  EXPECT_GT(all.mean.judged, 700 * 10);
  EXPECT_LT(all.mean.wrong, 0.01 * all.mean.judged);
}

TEST(Mapper, a_loop_longer_than_its_map_ends_where_it_began) {
  World::Options options = loop_world(200, 1, 60);
  simulate(robot::mapper::parameters, {.landmarks = true, .own_map = true, .nameless = true}, options);
  const Campaign all = campaign("full", options, robot::mapper::parameters, 3);
  EXPECT_LE(all.mean.silent, 0.01);
  EXPECT_LT(all.mean.rmse_m, 3);
}

}  // namespace
}  // namespace tetap::sim
