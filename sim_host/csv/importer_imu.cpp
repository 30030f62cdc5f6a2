// SPDX-License-Identifier: Apache-2.0
#include "sim_host/csv/importer.hpp"

namespace tetap::csv {

namespace {

/// A force at a time, straight between its neighbours.
std::optional<Vector> interpolated(const Series& series, std::int64_t time_us, std::size_t& next) {
  const auto whole = [&](std::size_t i) { return finite(series.row(i)[0] + series.row(i)[1] + series.row(i)[2]); };
  while (next < series.size() && (series.time_us[next] < time_us || !whole(next))) ++next;
  if (next == series.size()) return std::nullopt;
  const auto at = [&](std::size_t i) {
    const auto row = series.row(i);
    return Vector{row[0], row[1], row[2]};
  };
  if (series.time_us[next] == time_us) return at(next);
  std::size_t before = next;
  while (before > 0 && !whole(before - 1)) --before;
  if (before == 0) return std::nullopt;
  --before;
  const std::int64_t span_us = series.time_us[next] - series.time_us[before];
  if (span_us > kLongestGap_us || series.time_us[before] > time_us) return std::nullopt;
  const double part = static_cast<double>(time_us - series.time_us[before]) / static_cast<double>(span_us);
  Vector value = at(before);
  for (std::size_t i = 0; i < 3; ++i) value[i] += part * (at(next)[i] - value[i]);
  return value;
}

}  // namespace

sim::Result<> Importer::imu() {
  const Series* gyro = picked_[static_cast<std::size_t>(Kind::kGyro)];
  const Series* accel = picked_[static_cast<std::size_t>(Kind::kAccel)];
  const Series* gravity = nullptr;
  if (accel == nullptr) {
    accel = picked_[static_cast<std::size_t>(Kind::kLinear)];
    gravity = picked_[static_cast<std::size_t>(Kind::kGravity)];
    if (accel != nullptr && gravity == nullptr) {
      tables_.notes.push_back(from(*accel) + ": without gravity this is no specific force, left out");
      accel = nullptr;
    }
  }
  if (gyro == nullptr || accel == nullptr) {
    if (gyro != nullptr) tables_.notes.push_back(from(*gyro) + ": no accelerometer beside it, left out");
    if (accel != nullptr) tables_.notes.push_back(from(*accel) + ": no gyroscope beside it, left out");
    return {};
  }
  std::vector<std::size_t> rows;
  for (std::size_t i = 0; i < gyro->size(); ++i) {
    const auto r = gyro->row(i);
    if (!finite(r[0] + r[1] + r[2])) continue;
    if (!rows.empty() && gyro->time_us[i] == gyro->time_us[rows.back()]) {
      leave_out("gyroscope rows with the time of the row before");
      continue;
    }
    rows.push_back(i);
  }
  std::vector<std::int64_t> intervals;
  for (std::size_t i = 1; i < rows.size(); ++i)
    intervals.push_back(gyro->time_us[rows[i]] - gyro->time_us[rows[i - 1]]);
  if (intervals.empty()) return leave_out("gyroscope rows without one before them", rows.size()), sim::Result<>{};
  std::vector<std::int64_t> ordered = intervals;
  std::nth_element(ordered.begin(), ordered.begin() + static_cast<std::ptrdiff_t>(ordered.size() / 2), ordered.end());
  const std::int64_t usual_us = ordered[ordered.size() / 2];
  if (usual_us > kLongestInterval_us)
    return sim::Failure{from(*gyro) + ": a row every " + std::to_string(usual_us / 1000) +
                            " ms; an IMU sample spans 65.5 ms at most, 16 rows a second are needed",
                        0};
  leave_out("gyroscope rows without one before them");
  std::uint64_t number = 0, paused = 0;
  std::size_t next = 0, next_gravity = 0;
  std::vector<std::int64_t> times;
  for (std::size_t i = 1; i < rows.size(); ++i) {
    const std::int64_t time_us = gyro->time_us[rows[i]];
    auto force = interpolated(*accel, time_us, next);
    if (gravity != nullptr) {
      const auto pull = interpolated(*gravity, time_us, next_gravity);
      for (std::size_t k = 0; force && pull && k < 3; ++k) (*force)[k] += (*pull)[k];
      if (!pull) force.reset();
    }
    if (!force) {
      leave_out("gyroscope rows without an accelerometer's within 0.1 s");
      continue;
    }
    const bool pause = intervals[i - 1] > kLongestInterval_us;
    paused += pause ? 1 : 0;
    const std::int64_t interval_us = pause ? usual_us : intervals[i - 1];
    const double dt_s = static_cast<double>(interval_us) * 1e-6;
    const auto rate = gyro->row(rows[i]);
    sensor::ImuSample sample{.interval_us = static_cast<std::uint16_t>(interval_us)};
    bool inside = true;
    for (std::size_t k = 0; k < 3; ++k) {
      const double turn_rad = rate[k] * dt_s, gain_mps = (*force)[k] * dt_s;
      inside = inside && says<bus::ImuGyro::kAngX>(turn_rad) && says<bus::ImuAccel::kVelX>(gain_mps);
      sample.dangle_b_rad[k] = static_cast<float>(turn_rad);
      sample.dvelocity_b_mps[k] = static_cast<float>(gain_mps);
    }
    sample.temperature_degC = says<bus::ImuTime::kTemp>(rate[3]) ? static_cast<float>(rate[3]) : kNone;
    if (!inside) {
      leave_out("IMU samples beyond the range of their signals");
      continue;
    }
    put(time_us, number++, sample);
    times.push_back(time_us);
  }
  if (paused != 0)
    tables_.notes.push_back(std::to_string(paused) + " IMU samples after a pause span the usual " +
                            std::to_string(usual_us) + " us");
  std::string columns = from(*gyro) + "; " + from(*accel);
  if (gravity != nullptr) columns += "; " + from(*gravity);
  note_source("imu", columns, times);
  return {};
}

}  // namespace tetap::csv
