// SPDX-License-Identifier: Apache-2.0
#include "sim_host/emulator/simulated_sensors.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>
#include <variant>

namespace tetap::board {

using sim::operator+, sim::operator*;

namespace {

constexpr std::uint64_t kVibrationStream = 1'000, kLidarStream = 1'002;  // beyond those of sim::Stream

Picoseconds to_time(base::Micros t) { return t.us * kMicrosecond; }
double share(Picoseconds from, Picoseconds at, Picoseconds to) {
  return std::clamp(static_cast<double>(at - from) / static_cast<double>(to - from), 0.0, 1.0);
}

}  // namespace

SimulatedSensors::SimulatedSensors(sim::World world, const param::Parameters& parameters, const UbloxOptions& options,
                                   std::uint64_t seed)
    : receiver(options), world_(std::move(world)), wired_(parameters.wired), vibration_(seed, kVibrationStream) {
  if (wired_.lidar != 0 && world_.surroundings() != nullptr)
    lidar_.emplace(WiredScanner{parameters.lidar, base::Random(seed, kLidarStream), {}});
  // Before the world starts: the robot stands where it will begin.
  const std::int64_t start_us = world_.start().us;
  sim::Truth standing = world_.truth();
  for (std::int64_t us = 0; us <= start_us; us += kTruth_us) {
    standing.time = {us};
    truth_.push_back(standing);
  }
  step();
  for (std::size_t i = 0; i + 1 < steps_.size(); ++i) {
    steps_[i] = steps_.back();
    steps_[i].end -= static_cast<Picoseconds>(steps_.size() - 1 - i) * kStep_us * kMicrosecond;
  }
}

SensorWorld SimulatedSensors::door() {
  SensorWorld door;
  if (wired_.imu != 0) door.imu = [this](Picoseconds now) { return imu(now); };
  if (wired_.encoders != 0) {
    door.left_edges = [this](Picoseconds now) { return edges(now, 0); };
    door.right_edges = [this](Picoseconds now) { return edges(now, 1) + extra_edges; };
  }
  if (wired_.gnss != 0) {
    door.next_gnss_byte = [this](Picoseconds now) {
      advance(now);
      return receiver.next_byte(now);
    };
    door.to_gnss = [this](Picoseconds now, std::uint8_t byte, std::int64_t baud) { receiver.on_byte(now, byte, baud); };
  } else if (lidar_) {
    door.next_gnss_byte = [this](Picoseconds now) {
      advance(now);
      return lidar_->scanner.next_byte(now);
    };
  }
  return door;
}

// A step's signals are those of its middle: the world runs ahead of the board by up to two steps.
void SimulatedSensors::advance(Picoseconds now) {
  while (steps_.back().end < now + kStep_us * kMicrosecond) step();
}

void SimulatedSensors::step() {
  const Picoseconds end = std::max(steps_.back().end, to_time(world_.start())) + kStep_us * kMicrosecond;
  const base::Micros at{end / kMicrosecond};
  arrived_.clear();
  const sim::Truth before = world_.truth();
  world_.advance_to(at, arrived_);
  if (lidar_) turn_lidar(before, world_.truth());
  std::rotate(steps_.begin(), steps_.begin() + 1, steps_.end());
  steps_.back() = {end, world_.imu_signals(), world_.wheel_shafts()};
  if (at.us % kTruth_us == 0) {
    truth_.push_back(world_.truth());
    truth_.back().time = at + world_.clock_offset();
  }
  sort(arrived_);
}

// The points of one step: between its ends the pose runs straight. A pane returns nothing.
void SimulatedSensors::turn_lidar(const sim::Truth& from, const sim::Truth& to) {
  constexpr double kSigma_m = 0.01, kLeast_m = 0.02, kMost_m = 12;  // the manual's accuracy and range
  auto& [mounting, noise, scanner] = *lidar_;
  const Picoseconds start = to_time(world_.start());
  while (start + scanner.next_point() < to_time(to.time)) {
    const Picoseconds at = start + scanner.next_point();
    const double k = share(to_time(from.time), at, to_time(to.time));
    const auto between = [k](double a, double b) { return a + k * (b - a); };
    const auto turned = [k](double a, double b) { return a + k * std::remainder(b - a, 2 * sim::kPi); };
    const sim::Matrix3 to_n = sim::rotation(
        {turned(from.roll_rad, to.roll_rad), turned(from.pitch_rad, to.pitch_rad), turned(from.yaw_rad, to.yaw_rad)});
    const double clockwise_rad = static_cast<double>(scanner.next_angle_cdeg()) * sim::kPi / 18'000;
    const double bearing_rad = static_cast<double>(mounting.yaw_rad) - clockwise_rad;
    const sim::Vector3 place{between(from.x_m, to.x_m), between(from.y_m, to.y_m), between(from.z_m, to.z_m)};
    const sim::Vector3 arm{static_cast<double>(mounting.x_b_m), static_cast<double>(mounting.y_b_m),
                           world_.parameters().lidar.z_b_m};
    const sim::Ray ray{place + to_n * arm, to_n * sim::Vector3{std::cos(bearing_rad), std::sin(bearing_rad), 0}};
    const auto hit = world_.surroundings()->nearest(ray, {scanner.next_point() / kMicrosecond}, false);
    const double drawn_m = kSigma_m * static_cast<double>(noise.normal());
    const double range_m = hit && hit->surface != sim::Surface::kGlass ? hit->range_m + drawn_m : 0;
    scanner.measure(range_m < kLeast_m || range_m > kMost_m ? 0 : range_m, start);
  }
}

void SimulatedSensors::sort(std::vector<sim::Measurement>& arrived) {
  for (const sim::Measurement& one : arrived) {
    const bool imu = std::holds_alternative<sensor::ImuSample>(one.value);
    const bool wheels = std::holds_alternative<sensor::WheelCounts>(one.value);
    const bool fix = std::holds_alternative<sensor::GnssPosition>(one.value);
    const bool gnss = fix || std::holds_alternative<sensor::GnssVelocity>(one.value);
    const bool scan = lidar_ && (std::holds_alternative<sim::ScanHead>(one.value) ||
                                 std::holds_alternative<sim::ScanBlock>(one.value));
    if (on_wired && ((wheels && wired_.encoders != 0) || (gnss && wired_.gnss != 0) || scan)) on_wired(one);
    if ((imu && wired_.imu != 0) || (wheels && wired_.encoders != 0) || scan) continue;
    if (gnss && wired_.gnss != 0) {
      solve(one);
    } else {
      unwired_.push_back(one);
    }
  }
}

// The world gives a position and, where there is one, the velocity of the same instant right behind it.
void SimulatedSensors::solve(const sim::Measurement& m) {
  constexpr std::int64_t kUnitsPer1e7 = 50;  // 2e-9 deg
  const auto rounded = [](std::int64_t raw) {
    return (raw + (raw < 0 ? -kUnitsPer1e7 : kUnitsPer1e7) / 2) / kUnitsPer1e7;
  };
  const Picoseconds now = to_time(m.arrival);
  if (const auto* position = std::get_if<sensor::GnssPosition>(&m.value)) {
    // A receiver's epochs lie on whole periods of its own time, which nobody has set to that of the bus.
    const sim::GnssParameters& n = world_.parameters().gnss;
    const std::int64_t period_us = 1'000'000 / n.rate_hz;  // longer than any latency
    const std::int64_t epoch = (m.arrival - world_.start() - n.phase).us / period_us;
    solution_ = {.epoch_ms = epoch * period_us / 1000,
                 .fix = position->fix >= sensor::GnssFix::k2d,
                 .differential = position->fix >= sensor::GnssFix::kDifferential,
                 .satellites = position->satellites,
                 .latitude_1e7deg = rounded(position->latitude_2ndeg),
                 .longitude_1e7deg = rounded(position->longitude_2ndeg),
                 .height_m = static_cast<double>(position->height_m),
                 .horizontal_sigma_m = static_cast<double>(position->horizontal_acc_m),
                 .vertical_sigma_m = static_cast<double>(position->vertical_acc_m)};
    if (!solution_.fix) receiver.on_solution(now, solution_);
  } else if (const auto* velocity = std::get_if<sensor::GnssVelocity>(&m.value)) {
    const auto& v = velocity->v_n_mps;
    solution_.velocity_ned_mps = {static_cast<double>(v[1]), static_cast<double>(v[0]), -static_cast<double>(v[2])};
    solution_.velocity_sigma_mps = static_cast<double>(velocity->acc_mps);
    receiver.on_solution(now, solution_);
  }
}

void SimulatedSensors::take_unwired(Picoseconds now, std::vector<sim::Measurement>& arrived) {
  advance(now);
  const auto due = [now](const sim::Measurement& one) { return to_time(one.arrival) <= now; };
  std::copy_if(unwired_.begin(), unwired_.end(), std::back_inserter(arrived), due);
  std::erase_if(unwired_, due);
}

// The robot's parameters name the axes of the chip that point along those of its samples.
std::array<double, 3> SimulatedSensors::to_chip(const sim::Vector3& v_s) const {
  std::array<double, 3> v_c{};
  const std::array axes{wired_.imu_x, wired_.imu_y, wired_.imu_z};
  for (std::size_t i = 0; i < 3; ++i) {
    const auto axis = static_cast<std::size_t>(axes[i]);
    v_c[axis % 3] = axis < 3 ? v_s[i] : -v_s[i];
  }
  return v_c;
}

std::array<double, 3> SimulatedSensors::from_chip(const std::array<double, 3>& v_c) const {
  std::array<double, 3> v_s{};
  const std::array axes{wired_.imu_x, wired_.imu_y, wired_.imu_z};
  for (std::size_t i = 0; i < 3; ++i) {
    const auto axis = static_cast<std::size_t>(axes[i]);
    v_s[i] = axis < 3 ? v_c[axis] : -v_c[axis % 3];
  }
  return v_s;
}

// Between the middles of two steps signals run straight. Broadband vibration is white at the rate of the questions.
ImuTruth SimulatedSensors::imu(Picoseconds now) {
  advance(now);
  const Picoseconds half = kStep_us * kMicrosecond / 2;
  std::size_t i = 1;
  while (i + 1 < steps_.size() && steps_[i].end - half < now) ++i;
  const Step &a = steps_[i - 1], &b = steps_[i];
  const double k = share(a.end - half, now, b.end - half);
  const sim::ImuParameters& n = world_.parameters().imu;
  sim::Vector3 rate = (1 - k) * a.imu.rate_radps + k * b.imu.rate_radps;
  sim::Vector3 force = (1 - k) * a.imu.force_mps2 + k * b.imu.force_mps2;
  const double since_s = last_imu_ < 0 ? 1e-3 : static_cast<double>(now - last_imu_) / static_cast<double>(kSecond);
  const double white = b.imu.vibration_share / std::sqrt(std::max(since_s, 1e-5));
  for (std::size_t axis = 0; axis < 3; ++axis) {
    rate[axis] += n.vibration_gyro_noise * white * static_cast<double>(vibration_.normal());
    force[axis] += n.vibration_noise * white * static_cast<double>(vibration_.normal());
  }
  last_imu_ = now;
  const base::Micros since_start{now / kMicrosecond - world_.start().us};
  return {.rate_radps = to_chip(rate),
          .force_mps2 = to_chip(force),
          .temperature_c = n.temperature_degC,
          .stuck = world_.faults().active(sim::Fault::kImuStuck, since_start)};
}

std::int64_t SimulatedSensors::edges(Picoseconds now, std::size_t wheel) {
  advance(now);
  std::size_t i = 1;
  while (i + 1 < steps_.size() && steps_[i].end < now) ++i;
  const Step &a = steps_[i - 1], &b = steps_[i];
  const double k = share(a.end, now, b.end);
  const auto counts = static_cast<std::int64_t>(std::floor((1 - k) * a.shafts[wheel] + k * b.shafts[wheel]));
  return (wheel == 0 ? wired_.left_inverted : wired_.right_inverted) != 0 ? -counts : counts;
}

}  // namespace tetap::board
