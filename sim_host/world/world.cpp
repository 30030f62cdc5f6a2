// SPDX-License-Identifier: Apache-2.0
#include "sim_host/world/world.hpp"

#include <algorithm>
#include <cstdlib>
#include <string>
#include <utility>

namespace tetap::sim {
namespace {

constexpr std::uint8_t kRecogniser = 3;  // instance of what a front end recognises

bool due(int rate_hz, base::Micros phase, base::Micros now) {
  if (rate_hz == 0) return false;
  const std::int64_t period_us = 1'000'000 / rate_hz;
  return now.us % period_us == phase.us % period_us;
}

bool later(base::Micros a_arrival, std::uint64_t a_order, base::Micros b_arrival, std::uint64_t b_order) {
  return a_arrival != b_arrival ? a_arrival > b_arrival : a_order > b_order;
}

}  // namespace

Parameters World::effective(const Options& options) {
  if (!refusal(options).empty()) std::abort();
  Parameters n = options.parameters;
  if (!options.mismatched && !options.as_given) n = options.inertial ? matched_inertial(n) : matched(n);
  if (!options.latency) n = without_latency(n);
  return n;
}

std::string World::refusal(const Options& options) {
  const Parameters& n = options.parameters;
  for (const auto& [what, rate_hz] : {std::pair{"IMU", n.imu.rate_hz},
                                      {"wheel", n.wheels.rate_hz},
                                      {"GNSS", n.gnss.rate_hz},
                                      {"landmark", n.camera.rate_hz},
                                      {"magnetometer", n.magnetometer.rate_hz},
                                      {"barometer", n.barometer.rate_hz},
                                      {"scan matcher", n.scan_matcher.rate_hz},
                                      {"LIDAR", n.lidar.rate_hz},
                                      {"image", n.features.rate_hz}})
    if (rate_hz < 0 || (rate_hz > 0 && 2000 % rate_hz != 0))
      return std::string{what} + " rate of " + std::to_string(rate_hz) + " Hz does not divide 2000 Hz";
  if (options.substeps < 1) return "substeps must be 1 or more";
  return Plan::refusal(options.course);
}

World::World(const Options& options, std::uint64_t seed)
    : parameters_{effective(options)},
      start_{options.start},
      faults_{options.faults},
      origin_{options.origin},
      surveyed_{options.surveyed},
      map_given_{options.map_given},
      plan_{std::make_unique<const Plan>(options.course, options.limits)},
      earth_{std::make_unique<const Earth>(options.place.value_or(options.origin))},
      to_map_{*earth_, Earth{options.origin}},
      vehicle_{parameters_.vehicle, *plan_, seed, options.substeps},
      imu_{parameters_.imu, parameters_.vehicle.wheel_radius_m, *earth_, seed},
      wheels_{parameters_.wheels, parameters_.vehicle, seed},
      gnss_{parameters_.gnss, *earth_, seed},
      camera_{parameters_.camera, options.course.landmarks, seed},
      magnetometer_{parameters_.magnetometer, *earth_, seed},
      barometer_{parameters_.barometer, *earth_, seed},
      scan_matcher_{parameters_.scan_matcher, seed},
      imu_latency_{seed, Stream::kImuLatency},
      wheel_latency_{seed, Stream::kWheelLatency},
      gnss_latency_{seed, Stream::kGnssLatency},
      camera_latency_{seed, Stream::kCameraLatency},
      magnetometer_latency_{seed, Stream::kMagnetometerLatency},
      barometer_latency_{seed, Stream::kBarometerLatency},
      scan_matcher_latency_{seed, Stream::kScanMatcherLatency},
      lidar_latency_{seed, Stream::kLidarLatency},
      features_latency_{seed, Stream::kFeatureLatency},
      loss_{seed, Stream::kFaultLoss} {
  const auto& n = parameters_;
  if (n.lidar.rate_hz > 0 || n.features.rate_hz > 0)
    surroundings_ = std::make_unique<const Surroundings>(options.course, *plan_, n.people, seed);
  if (n.lidar.rate_hz > 0) lidar_.emplace(n.lidar, *surroundings_, seed);
  if (n.features.rate_hz > 0) features_.emplace(n.features, *surroundings_, seed);
  for (const Landmark& mark : camera_.map()) {
    const Vector3 at = to_map_.point({mark.x_m, mark.y_m, 0});
    map_.push_back({.id = mark.id, .x_m = at[0], .y_m = at[1]});
  }
}

Truth in_frame(Truth truth, const FrameChange& change) {
  const Vector3 p = change.point({truth.x_m, truth.y_m, truth.z_m});
  const Vector3 a = change.attitude({truth.roll_rad, truth.pitch_rad, truth.yaw_rad});
  truth.x_m = p[0], truth.y_m = p[1], truth.z_m = p[2];
  truth.roll_rad = a[0], truth.pitch_rad = a[1], truth.yaw_rad = wrap(a[2]);
  truth.v_n_mps = change.vector(truth.v_n_mps);
  return truth;
}

Truth World::truth() const { return in_frame(truth_here(), to_map_); }

Truth World::truth_here() const {
  Truth t = vehicle_.truth();
  t.time = start_ + now_;
  t.gyro_bias_b_radps = imu_.gyro_bias_radps();
  t.accel_bias_b_mps2 = imu_.accel_bias_mps2();
  return t;
}

StartPose World::start_pose() const {
  const PathPoint at = plan_->path(0);
  const double yaw_rad = wrap(to_map_.attitude({0, 0, at.yaw_rad})[2]);
  const VehicleParameters& n = parameters_.vehicle;
  if (surveyed_) {
    const Vector3 place = to_map_.point({at.x_m, at.y_m, 0});
    return {.x_m = place[0], .y_m = place[1], .yaw_rad = yaw_rad, .sigma_m = n.start_m, .sigma_yaw_rad = n.start_rad};
  }
  // The antenna stands at the origin, to the resolution of a fix.
  const GnssParameters& g = parameters_.gnss;
  const Vector3 lever = to_level({0, 0, yaw_rad}, g.antenna_b_m);
  return {.x_m = -lever[0],
          .y_m = -lever[1],
          .yaw_rad = yaw_rad,
          .sigma_m = sim::sqrt(g.white_m * g.white_m + g.correlated_m * g.correlated_m),
          .sigma_yaw_rad = n.start_rad};
}

base::Micros World::clock_offset_at(base::Micros since_start) const {
  return {faults_.active(Fault::kClockJump, since_start) ? FaultNumbers::kClockJump_us : 0};
}

void World::kidnap() {
  const double s_m = plan_->at(now_ + vehicle_.ahead()).s_m;
  const base::Micros there = plan_->time_at(std::min(s_m + FaultNumbers::kKidnapped_m, plan_->length_m()));
  vehicle_.set_ahead(there - now_);
  vehicle_.place(plan_->path(plan_->at(there).s_m));
}

void World::emit(Value value, std::uint8_t sequence, base::Micros stamp_late, base::Micros latency,
                 std::uint8_t instance, bool torn) {
  if (faults_.active(Fault::kMovingStart, now_)) return;
  const base::Micros at = start_ + now_;
  base::Micros stamp = at + stamp_late + clock_offset_at(now_);
  if (faults_.active(Fault::kStaleStamps, now_)) stamp = stamp - base::Micros{FaultNumbers::kStale_us};
  if (faults_.active(Fault::kFutureStamps, now_)) stamp = stamp + base::Micros{FaultNumbers::kFuture_us};
  unsigned lost = torn ? 1 : 0;
  if (faults_.active(Fault::kLostFrames, now_))
    for (int part = 0; part < parts(value); ++part) lost |= loss_.happens(FaultNumbers::kLossShare) ? 1U << part : 0U;
  pending_.push_back({Measurement{.stamp = stamp,
                                  .arrival = at + stamp_late + latency,
                                  .instance = instance,
                                  .sequence = sequence,
                                  .lost_parts = static_cast<std::uint8_t>(lost),
                                  .value = value},
                      made_++});
  std::push_heap(pending_.begin(), pending_.end(), [](const Pending& a, const Pending& b) {
    return later(a.measurement.arrival, a.order, b.measurement.arrival, b.order);
  });
}

/// Frames of one scan or image come one by one, as a bus carries them.
void World::emit(const Lidar::Scan& scan) {
  const LidarNumbers& n = parameters_.lidar;
  base::Micros latency = lidar_latency_.between(n.latency_min, n.latency_max);
  base::Micros stamp_late = scan.first - now_ + n.stamp_late;
  if (faults_.active(Fault::kLidarLate, now_)) stamp_late += base::Micros{FaultNumbers::kScanLate_us};
  const std::uint8_t sequence = scan_sequence_++;
  emit(scan.head, sequence, stamp_late, latency - stamp_late);
  for (std::size_t i = 0; i < scan.blocks(); ++i) {
    latency += n.frame;
    emit(scan.block(i), sequence, stamp_late, latency - stamp_late);
  }
}

void World::emit(const FeatureCamera::Image& image, std::uint8_t sequence, base::Micros latency) {
  const FeatureCameraNumbers& n = parameters_.features;
  if (faults_.active(Fault::kImagesLate, now_)) latency += base::Micros{FaultNumbers::kImageLate_us};
  base::Micros stamp_late = n.stamp_late;
  if (faults_.active(Fault::kImageStamps, now_)) stamp_late += base::Micros{FaultNumbers::kImageStamp_us};
  const auto send = [&](const std::vector<ImageFeature>& features, std::uint8_t instance) {
    for (std::size_t i = 0; i < features.size(); ++i, latency += n.frame)
      emit(features[i], sequence, stamp_late, latency - stamp_late, instance, image.torn && i == 0);
    emit(ImageEnd{.count = static_cast<std::uint8_t>(features.size()),
                  .exposure_10us = static_cast<std::uint16_t>(n.exposure.us / 10),
                  .tracking = image.tracking},
         sequence, stamp_late, latency - stamp_late, instance);
    latency += n.frame;
  };
  send(image.features, 0);
  if (n.recognise) send(image.recognised, kRecogniser);
}

void World::step() {
  const base::Micros before = now_;
  now_ += Vehicle::kStep;
  if (faults_.starts(Fault::kKidnapped, before, now_)) kidnap();
  const Truth from = lidar_ ? vehicle_.truth() : Truth{};
  const Motion motion = vehicle_.step();

  const auto& n = parameters_;
  if (n.imu.rate_hz > 0) {
    imu_.sense(motion, motion.shaking_mps, now_, faults_);
    if (due(n.imu.rate_hz, n.imu.phase, now_))
      emit(imu_.sample(now_, faults_), imu_sequence_++, {}, imu_latency_.between(n.imu.latency_min, n.imu.latency_max));
  }
  if (n.wheels.rate_hz > 0) {
    wheels_.sense(motion, now_, faults_);
    if (due(n.wheels.rate_hz, n.wheels.phase, now_)) {
      const base::Micros late = wheel_latency_.between({}, n.wheels.stamp_late_max);
      const base::Micros latency = wheel_latency_.between(n.wheels.latency_min, n.wheels.latency_max);
      const Value value = n.wheels.output == WheelOutput::kCounts        ? Value{wheels_.counts()}
                          : n.wheels.output == WheelOutput::kWheelSpeeds ? Value{wheels_.wheel_speeds()}
                                                                         : Value{wheels_.body_speed()};
      emit(value, wheel_sequence_++, late, latency);
    }
  }
  if (due(n.gnss.rate_hz, n.gnss.phase, now_)) {
    const Gnss::Reading reading = gnss_.sample(truth_here(), now_, faults_);
    const base::Micros latency = gnss_latency_.between(n.gnss.latency_min, n.gnss.latency_max);
    if (reading.position) emit(*reading.position, position_sequence_++, {}, latency);
    if (reading.velocity) emit(*reading.velocity, velocity_sequence_++, {}, latency);
  }
  if (due(n.camera.rate_hz, n.camera.phase, now_)) {
    const base::Micros latency = camera_latency_.between(n.camera.latency_min, n.camera.latency_max);
    for (const Camera::Seen& seen : camera_.sample(truth_here(), now_, faults_)) {
      sightings_.push_back({.stamp = start_ + now_, .landmark = seen.landmark});
      emit(seen.sighting, sighting_sequence_++, {}, latency);
    }
  }
  if (due(n.magnetometer.rate_hz, n.magnetometer.phase, now_))
    emit(magnetometer_.sample(truth_here(), now_, faults_), magnetometer_sequence_++, {},
         magnetometer_latency_.between(n.magnetometer.latency_min, n.magnetometer.latency_max));
  if (due(n.barometer.rate_hz, n.barometer.phase, now_))
    emit(barometer_.sample(truth_here()), barometer_sequence_++, {},
         barometer_latency_.between(n.barometer.latency_min, n.barometer.latency_max));
  if (due(n.scan_matcher.rate_hz, n.scan_matcher.phase, now_)) {
    const base::Micros latency = scan_matcher_latency_.between(n.scan_matcher.latency_min, n.scan_matcher.latency_max);
    for (const sensor::LoopClosure& closure : scan_matcher_.sample(truth_here()))
      emit(closure, closure_sequence_++, {}, latency);
  }
  if (lidar_)
    if (const auto scan = lidar_->sense(from, vehicle_.truth(), before, now_, faults_)) emit(*scan);
  if (features_ && due(n.features.rate_hz, n.features.phase, now_)) {
    const base::Micros latency = features_latency_.between(n.features.latency_min, n.features.latency_max);
    const std::uint8_t sequence = image_sequence_++;
    if (const auto image = features_->sample(truth_here(), now_, faults_)) emit(*image, sequence, latency);
  }
}

void World::advance_to(base::Micros t, std::vector<Measurement>& arrived) {
  while (start_ + now_ + Vehicle::kStep <= t) step();
  const auto by_arrival = [](const Pending& a, const Pending& b) {
    return later(a.measurement.arrival, a.order, b.measurement.arrival, b.order);
  };
  while (!pending_.empty() && pending_.front().measurement.arrival <= t) {
    std::pop_heap(pending_.begin(), pending_.end(), by_arrival);
    arrived.push_back(pending_.back().measurement);
    pending_.pop_back();
  }
}

bool can_act(Fault fault, const World::Options& options) {
  const Parameters& n = options.parameters;
  switch (info(fault).falls_on) {
    case FallsOn::kAny:
      return true;
    case FallsOn::kImu:
      return n.imu.rate_hz > 0;
    case FallsOn::kWheels:
      return n.wheels.rate_hz > 0;
    case FallsOn::kGnss:
      return n.gnss.rate_hz > 0;
    case FallsOn::kLandmarks:
      return n.camera.rate_hz > 0 && !options.course.landmarks.empty();
    case FallsOn::kMagnetometer:
      return n.magnetometer.rate_hz > 0;
    case FallsOn::kLidar:
      return n.lidar.rate_hz > 0;
    case FallsOn::kFeatures:
      return n.features.rate_hz > 0;
  }
  return false;
}

}  // namespace tetap::sim
