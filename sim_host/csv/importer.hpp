// SPDX-License-Identifier: Apache-2.0
// Series of sensors as frames of the bus.
#pragma once

#include "sim_host/csv/import.hpp"
#include "sim_host/csv/series.hpp"
#include "sim_host/replay/log.hpp"
#include "tetap/bus/encoder.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace tetap::csv {

inline constexpr std::int64_t kStart_us = 1'000'000;  ///< first sample in the time of the log, as in other imports
inline constexpr std::int64_t kLongestInterval_us = 65'534;  ///< longest one of an IMU sample on the bus
inline constexpr std::int64_t kLongestGap_us = 100'000;      ///< between forces that are interpolated
inline constexpr double kPi = std::numbers::pi;
inline constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
inline constexpr double kNoValue = std::numeric_limits<double>::quiet_NaN();

using Vector = std::array<double, 3>;

inline bool finite(double value) { return std::isfinite(value); }

/// The value lies within the signal's range.
template <bus::Signal kSignal>
bool says(double value, double per_unit = kSignal.per_unit) {
  const double steps = value * per_unit;
  return steps > static_cast<double>(kSignal.lowest()) - 0.5 && steps < static_cast<double>(kSignal.highest()) + 0.5;
}
/// The same, or there is no value.
template <bus::Signal kSignal>
bool says_or_none(double value) {
  return std::isnan(value) || says<kSignal>(value);
}

inline double wrapped(double angle_rad) { return std::remainder(angle_rad, 2 * kPi); }

/// Direction of a quaternion, and the axes of the world and the body.
struct QuaternionForm {
  bool inverse = false, ned = false;
};

class Importer {
 public:
  Importer(Tables tables, std::span<const File> files, const Options& options)
      : tables_(std::move(tables)), files_(files), options_(options) {}

  sim::Result<Imported> run();

 private:
  [[nodiscard]] bool complete(const Series& series) const;
  const Series* pick(Kind kind);
  sim::Result<> check_clocks() const;
  sim::Result<> imu();
  /// fill(row, put) returns why it left a row out, or null; put(sample) encodes the row.
  template <class Fill>
  void each(Kind kind, const char* sensor, Fill&& fill);
  void others();
  void leave_out(const std::string& what, std::uint64_t count = 1) { count_left_out(tables_.left_out, what, count); }
  template <class Sample>
  void put(std::int64_t time_us, std::uint64_t number, const Sample& sample);
  void note_source(const char* sensor, const std::string& columns, std::span<const std::int64_t> times);
  [[nodiscard]] std::string from(const Series& series) const {
    return files_[series.file].name + ": " + series.columns;
  }

  Tables tables_;
  std::span<const File> files_;
  const Options& options_;
  QuaternionForm quaternion_;
  std::array<const Series*, kKinds> picked_{};
  std::vector<sim::TimedFrame> frames_;
  Imported result_;
};

template <class Sample>
void Importer::put(std::int64_t time_us, std::uint64_t number, const Sample& sample) {
  const base::Micros time{time_us - result_.begin_us + kStart_us};
  const auto head = bus::SampleHead::of(time, static_cast<std::uint8_t>(number & 0x0F), 0);
  const auto add = [&](const auto& message, std::size_t instance = 0) {
    frames_.push_back({time, bus::frame(options_.base, message, instance)});
  };
  bus::encode_sample(sample, head, add);
}

template <class Fill>
void Importer::each(Kind kind, const char* sensor, Fill&& fill) {
  const Series* series = picked_[static_cast<std::size_t>(kind)];
  if (series == nullptr) return;
  // A receiver's values in a table of a faster sensor are repeated until the next.
  const auto shares = [&](Kind other) {
    const Series* fast = picked_[static_cast<std::size_t>(other)];
    return fast != nullptr && fast->file == series->file && 2 * series->size() > fast->size();
  };
  const bool held = (kind == Kind::kFix || kind == Kind::kVelocity || kind == Kind::kBaro || kind == Kind::kMag) &&
                    (shares(Kind::kGyro) || shares(Kind::kAccel));
  std::uint64_t number = 0;
  std::vector<std::int64_t> times;
  std::optional<std::size_t> before;
  for (std::size_t i = 0; i < series->size(); ++i) {
    const auto row = series->row(i);
    const std::int64_t time_us = series->time_us[i];
    if (before && series->time_us[*before] == time_us) {
      leave_out(std::string(sensor) + " rows with the time of the row before");
      continue;
    }
    const auto equal = [](double a, double b) {
      return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
    };
    if (held && before && std::equal(row.begin(), row.end(), series->row(*before).begin(), equal)) {
      leave_out(std::string(sensor) + " rows that repeat the row before");
      continue;
    }
    before = i;
    const char* const reason = fill(row, [&](const auto& sample) { put(time_us, number, sample); });
    if (reason != nullptr) {
      leave_out(std::string(sensor) + " rows " + reason);
      continue;
    }
    ++number;
    times.push_back(time_us);
  }
  note_source(sensor, from(*series), times);
}

}  // namespace tetap::csv
