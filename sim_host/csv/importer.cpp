// SPDX-License-Identifier: Apache-2.0
#include "sim_host/csv/importer.hpp"

#include "sim_host/replay/candump.hpp"
#include "sim_host/replay/line.hpp"

namespace tetap::csv {

bool Importer::complete(const Series& series) const {
  const auto required = [&](std::span<const double> r) {
    switch (series.kind) {
      case Kind::kGyro:
      case Kind::kAccel:
      case Kind::kLinear:
      case Kind::kGravity:
      case Kind::kMag:
        return !std::isnan(r[0]) && !std::isnan(r[1]) && !std::isnan(r[2]);
      case Kind::kVelocity:
        return (!std::isnan(r[0]) && !std::isnan(r[1])) || (!std::isnan(r[2]) && !std::isnan(r[3]));
      case Kind::kFix:
      case Kind::kWheelSpeed:
      case Kind::kWheelCounts:
        return !std::isnan(r[0]) && !std::isnan(r[1]);
      case Kind::kHeading:
        return !std::isnan(r[0]) || !std::isnan(r[1]) || !std::isnan(r[3] + r[4] + r[5] + r[6]);
      case Kind::kSighting:
        return !std::isnan(r[1]) || !std::isnan(r[2]);
      default:
        return !std::isnan(r[0]);
    }
  };
  for (std::size_t i = 0; i < series.size(); ++i)
    if (required(series.row(i))) return true;
  return false;
}

const Series* Importer::pick(Kind kind) {
  const Series* best = nullptr;
  for (const Series& series : tables_.series) {
    if (series.kind != kind) continue;
    if (!complete(series)) {
      tables_.notes.push_back(from(series) + ": no whole " + std::string(kind_name(kind)) + " in it, left out");
    } else if (best == nullptr || series.rank < best->rank) {
      if (best != nullptr) tables_.notes.push_back(from(*best) + ": not used beside " + from(series));
      best = &series;
    } else {
      tables_.notes.push_back(from(series) + ": not used beside " + from(*best));
    }
  }
  return best;
}

/// Times since 1970 and times since a recording's start cannot be put together.
sim::Result<> Importer::check_clocks() const {
  const Series* calendar = nullptr;
  const Series* relative = nullptr;
  for (const Series* series : picked_) {
    if (series == nullptr) continue;
    (series->time_us.front() >= 100'000'000'000'000 ? calendar : relative) = series;
  }
  if (calendar == nullptr || relative == nullptr) return {};
  return sim::Failure{files_[calendar->file].name + " counts time from 1970 and " + files_[relative->file].name +
                          " does not; name the column of one of them, as in --column time=FILE:COLUMN",
                      0};
}

void Importer::note_source(const char* sensor, const std::string& columns, std::span<const std::int64_t> times) {
  const double span_s = times.size() > 1 ? static_cast<double>(times.back() - times.front()) * 1e-6 : 0;
  const double rate_hz = span_s > 0 ? static_cast<double>(times.size() - 1) / span_s : 0;
  result_.sources.push_back({sensor, columns, times.size(), rate_hz});
}

sim::Result<Imported> Importer::run() {
  for (const Named& named : options_.units) {
    if (named.quantity != "quaternion") continue;
    const auto begins = [&](std::string_view word) { return std::string_view(named.text).starts_with(word); };
    quaternion_ = {.inverse = named.text.ends_with("-inverse"), .ned = begins("ned")};
    if (named.text != std::string(quaternion_.ned ? "ned" : "enu") + (quaternion_.inverse ? "-inverse" : ""))
      return sim::Failure{"--unit quaternion=" + named.text + ": there are: enu enu-inverse ned ned-inverse", 0};
  }
  for (std::size_t kind = 1; kind < kKinds; ++kind) picked_[kind] = pick(static_cast<Kind>(kind));
  if (const auto clocks = check_clocks(); !clocks) return clocks.failure();
  std::int64_t begin_us = std::numeric_limits<std::int64_t>::max();
  for (const Series* series : picked_)
    if (series != nullptr) begin_us = std::min(begin_us, series->time_us.front());
  result_.begin_us = begin_us;
  if (const auto done = imu(); !done) return done.failure();
  others();
  if (frames_.empty()) {
    std::string why;
    for (const std::string& note : tables_.notes) why += "; " + note;
    for (const LeftOut& one : tables_.left_out) why += "; " + std::to_string(one.count) + " " + one.what;
    return sim::Failure{files_.front().name + ": no sample for the bus in it" + why, 0};
  }
  std::stable_sort(frames_.begin(), frames_.end(),
                   [](const sim::TimedFrame& a, const sim::TimedFrame& b) { return a.time < b.time; });
  result_.log.reserve(frames_.size() * 52);
  sim::Line line;
  for (const sim::TimedFrame& entry : frames_) {
    sim::append_log_line(line, entry.time, options_.interface, entry.frame);
    result_.log += line.view();
    line.clear();
  }
  result_.frames = frames_.size();
  result_.rows = tables_.rows;
  result_.duration_s = static_cast<double>((frames_.back().time - frames_.front().time).us) * 1e-6;
  result_.left_out = std::move(tables_.left_out);
  result_.notes = std::move(tables_.notes);
  return std::move(result_);
}

}  // namespace tetap::csv
