// SPDX-License-Identifier: Apache-2.0
#include "sim_host/doctor/stamps.hpp"

#include <algorithm>
#include <cmath>

namespace tetap::doctor {
namespace {

constexpr double kWrap_us = 1 << 20;
constexpr double kJitter_us = 20'000;  ///< spread of arrivals on a busy bus or behind a gateway
constexpr double kJitterShare = 0.15;  ///< share of a span
constexpr std::int64_t kLeastSpan_us = 300'000,
                       kMostSpan_us = 1'200'000;  ///< spans that vote; stamps wrap after 1.05 s
constexpr int kLeastVotes = 10;
constexpr double kMajority = 0.8;
constexpr std::int64_t kBlock_us = 5'000'000;
constexpr double kLeastBlocks = 5;
constexpr double kAhead_us = 30'000;  ///< a sample cannot come before it is true; ticks of 10 ms blur the arrival
// Quartz clocks are within 50 ppm of each other. Beyond, two clocks are at work. They are at work too where the age
// moves by 10 ms and far more than it scatters.
constexpr double kDrift_ppm = 50, kDrift_us = 10'000, kDriftScatters = 5;
constexpr double kFresh_us = 60'000;        ///< some device of a robot is read out faster than that
constexpr double kSameOffset_us = 250'000;  ///< ages of devices on one clock differ by their delays, which are less

double wrapped_us(double us) { return us - kWrap_us * std::round(us / kWrap_us); }

/// Streams whose stamp stands for its sample's: of the messages of a fix one.
bool is_device(std::uint32_t offset) {
  if (offset >= bus::ImuGyro::kOffset && offset < bus::ImuGyro::kOffset + 4 * bus::ImuGyro::kStride) return true;
  return offset != bus::InGnssLon::kOffset && offset != bus::InGnssAlt::kOffset && offset != bus::InGnssAcc::kOffset &&
         offset != bus::InGnssVelU::kOffset;
}

}  // namespace

void StampDetector::frame(const SeenFrame& seen) {
  const auto header = header_of(seen.offset, seen.frame);
  if (!header || !header->stamp_us || !is_device(seen.offset)) return;
  Stream& s = streams_[header->stream];
  if (!s.begun) {
    s.message = header->message;
    if (const auto star = s.message.find('*'); star != std::string::npos)
      s.message[star] = static_cast<char>('0' + header->instance);
    if (header->instance > 0 && s.message.find("Imu") == std::string::npos)
      s.message += " of instance " + std::to_string(header->instance);
    s.anchor = s.last = seen.time;
    s.anchor_stamp = *header->stamp_us;
  }
  vote(s, seen.time, *header->stamp_us);
  follow_age(s, seen.time, *header->stamp_us);
  const auto since_us = static_cast<double>((seen.time - s.last).us);
  if (header->interval_us && since_us > 0 && since_us < static_cast<double>(kMostSpan_us)) {
    s.intervals_us += static_cast<double>(*header->interval_us);
    s.elapsed_us += since_us;
  }
  s.last = seen.time;
  s.begun = true;
}

void StampDetector::vote(Stream& s, base::Micros time, std::uint32_t stamp) {
  const std::int64_t span = (time - s.anchor).us;
  if (span >= 0 && span < kLeastSpan_us) return;
  const auto span_us = static_cast<double>(span);
  const double step = wrapped_us(static_cast<double>(stamp) - static_cast<double>(s.anchor_stamp));
  s.anchor = time;
  s.anchor_stamp = stamp;
  if (span < 0 || span > kMostSpan_us) return;
  const double slack = kJitterShare * span_us + kJitter_us;
  const double as_us = std::abs(wrapped_us(step - span_us)) / slack;
  const double as_ms = std::abs(step - 1e-3 * span_us) / (1e-3 * slack);
  const double as_s = std::abs(step - 1e-6 * span_us) / 2;
  Unit unit = as_us <= as_ms ? kMicroseconds : kMilliseconds;
  if (as_s < std::min(as_us, as_ms)) unit = kSeconds;
  if (std::min({as_us, as_ms, as_s}) > 1) unit = kOther;
  ++s.votes[unit];
}

void StampDetector::follow_age(Stream& s, base::Micros time, std::uint32_t stamp) {
  const double age = wrapped_us(static_cast<double>(time.us % (1 << 20)) - static_cast<double>(stamp));
  s.age_us = s.begun ? s.age_us + wrapped_us(age - s.age_us) : age;
  if (!s.begun) s.block_us = time.us;
  if (time.us >= s.block_us + kBlock_us || time.us < s.block_us) {
    close_block(s);
    s.block_us = time.us;
  }
  s.block_sum_us += s.age_us;
  ++s.block_count;
}

void StampDetector::close_block(Stream& s) {
  if (s.block_count > 0) s.blocks.add({static_cast<double>(s.block_us) * 1e-6, s.block_sum_us / s.block_count});
  s.block_sum_us = 0;
  s.block_count = 0;
}

bool StampDetector::name_unit(const Stream& s, Findings& findings) {
  const int all = s.votes[0] + s.votes[1] + s.votes[2] + s.votes[3];
  const auto name_it = [&](Unit unit, std::string evidence) {
    const bool ms = unit == kMilliseconds;
    findings.push_back({.code = ms ? Code::kStampsInMs : Code::kStampsInS,
                        .evidence = std::move(evidence),
                        .change = "Send Stamp and Interval of " + s.message + " in microseconds, modulo 2^20."});
  };
  if (all < kLeastVotes) return false;
  for (const Unit unit : {kMilliseconds, kSeconds}) {
    if (s.votes[unit] < kMajority * all) continue;
    name_it(unit, text("The stamps of %s advance by %s of the time of arrival in %d of %d spans of 0.3 s and more.",
                       s.message.c_str(), unit == kMilliseconds ? "a thousandth" : "a millionth", s.votes[unit], all));
    return true;
  }
  if (s.elapsed_us <= 0 || s.intervals_us <= 0) return false;
  const double covered = s.intervals_us / s.elapsed_us;
  const bool ms = covered > 0.5e-3 && covered < 2e-3;
  if (!ms && covered > 1e-5) return false;
  name_it(ms ? kMilliseconds : kSeconds,
          text("The intervals of %s cover %.4f %% of the time between its samples.", s.message.c_str(), 100 * covered));
  return true;
}

StampDetector::Age StampDetector::age_of(const Stream& s) {
  const double time_s2 = s.blocks.covariance(0, 0), slope = time_s2 > 0 ? s.blocks.covariance(0, 1) / time_s2 : 0;
  const double span_s = kBlock_us * 1e-6 * s.blocks.count();
  const double left = s.blocks.covariance(1, 1) - slope * s.blocks.covariance(0, 1);
  return {.message = s.message,
          .mean_us = wrapped_us(s.blocks.mean(1)),
          .drift_ppm = s.blocks.count() >= kLeastBlocks ? slope : 0,
          .span_s = span_s,
          .scatter_us = std::sqrt(std::max(0.0, left))};
}

bool StampDetector::too_old_or_ahead(const Age& age) const {
  return age.mean_us < -kAhead_us || age.mean_us > window_us_;
}

void StampDetector::finish(Findings& findings) {
  std::vector<Age> ages;
  for (Stream& s : streams_) {
    if (!s.begun) continue;
    close_block(s);
    if (name_unit(s, findings)) continue;
    const int all = s.votes[0] + s.votes[1] + s.votes[2] + s.votes[3];
    if (all < kLeastVotes || s.votes[kMicroseconds] < kMajority * all) continue;
    ages.push_back(age_of(s));
  }
  if (ages.empty()) return;
  judge_ages(ages, findings);
  judge_drifts(ages, findings);
}

void StampDetector::judge_ages(const std::vector<Age>& ages, Findings& findings) const {
  const auto bad = [this](const Age& age) { return too_old_or_ahead(age); };
  const auto together = [&](const Age& age) {
    return std::abs(wrapped_us(age.mean_us - ages.front().mean_us)) < kSameOffset_us;
  };
  const char* clock = source_ == ClockSource::kSync     ? "In_Sync"
                      : source_ == ClockSource::kEpochs ? "the node's own timer"
                                                        : "the log";
  const auto fresh = [](const Age& age) { return std::abs(age.mean_us) < kFresh_us; };
  if (source_ != ClockSource::kSync && std::any_of(ages.begin(), ages.end(), bad) &&
      std::none_of(ages.begin(), ages.end(), fresh) && std::all_of(ages.begin(), ages.end(), together)) {
    findings.push_back(
        {.code = Code::kNoInSync,
         .evidence = text("The log has no In_Sync, and the stamps of all %zu devices are %.0f ms from the time of %s "
                          "(modulo 1049 ms; 0 to %.0f ms are fused).",
                          ages.size(), ages.front().mean_us * 1e-3, clock, window_us_ * 1e-3)});
    return;
  }
  for (const Age& age : ages) {
    if (!bad(age)) continue;
    findings.push_back(
        {.code = Code::kTwoClocks,
         .evidence = text("Samples of %s are %.0f ms old on arrival by the clock of %s (modulo 1049 ms; 0 "
                          "to %.0f ms are fused).",
                          age.message.c_str(), age.mean_us * 1e-3, clock, window_us_ * 1e-3),
         .change = "Stamp " + age.message + " by the clock that In_Sync distributes."});
  }
}

void StampDetector::judge_drifts(const std::vector<Age>& ages, Findings& findings) const {
  std::vector<double> slopes;
  slopes.reserve(ages.size());
  for (const Age& age : ages) slopes.push_back(age.drift_ppm);
  std::nth_element(slopes.begin(), slopes.begin() + static_cast<std::ptrdiff_t>(slopes.size() / 2), slopes.end());
  // Without In_Sync the log's own clock may run otherwise than the bus's: what most devices share is that.
  const double shared = source_ == ClockSource::kSync || ages.size() < 3 ? 0 : slopes[slopes.size() / 2];
  for (const Age& age : ages) {
    const double own = age.drift_ppm - shared;
    const double moved = own * age.span_s;
    if (std::abs(own) < kDrift_ppm || std::abs(moved) < kDrift_us || std::abs(moved) < kDriftScatters * age.scatter_us)
      continue;
    findings.push_back(
        {.code = Code::kTwoClocks,
         .certainty = 0.9,
         .evidence = text("The age of the samples of %s drifts by %.0f us a second: %.0f ms over the log, "
                          "with a scatter of %.1f ms.",
                          age.message.c_str(), own, moved * 1e-3, age.scatter_us * 1e-3),
         .change = "Stamp " + age.message + " by the clock that In_Sync distributes."});
  }
}

}  // namespace tetap::doctor
