// SPDX-License-Identifier: Apache-2.0
#include "sim_host/matrix/cell.hpp"

#include "sim_host/play/out_file.hpp"
#include "sim_host/simulated_robot.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <string_view>

namespace tetap::sim {

namespace {

constexpr double kTick_s = 0.01;
constexpr std::size_t kPeriodWindow = 1'000;  ///< ticks over which the periods of devices are counted
constexpr base::Micros kOffsetLasts{3'000'000}, kSlowLasts{10'000'000}, kOtherLasts{5'000'000};

base::Micros lasts(const FrameFault& fault) {
  if (fault.kind == FaultKind::kOffset) return kOffsetLasts;
  const bool slow = fault.kind == FaultKind::kStep || fault.kind == FaultKind::kRamp || fault.sensor == "gnss_accuracy";
  return slow ? kSlowLasts : kOtherLasts;
}

double number_of(const std::string& text, std::size_t from, std::size_t behind) {
  double value = 0;
  const char* const last = text.data() + text.size() - behind;
  const auto [end, error] = std::from_chars(text.data() + from, last, value);
  if (error != std::errc{} || end != last)
    throw std::runtime_error("size '" + text + "': it is 0.5g, max, x0.1, s0.9 or -");
  return value;
}

/// A message that brings a sample of a device, and the signal by which a filter can use it or not.
struct Head {
  std::string_view device, message, signal;
  std::int64_t least = std::numeric_limits<std::int64_t>::min();  ///< raw number of a sample that can be used
};
constexpr std::int64_t kFix2d = 2;  // a receiver that lost the sky goes on talking
constexpr std::array kHeads{Head{"imu", "In_Imu0Time", ""},
                            Head{"wheels", "In_WheelCounts", ""},
                            Head{"wheels", "In_WheelSpeed", "WheelSpeed_Left"},
                            Head{"wheels", "In_BodySpeed", "BodySpeed_Forward"},
                            Head{"gnss", "In_GnssAlt", "GnssAlt_Fix", kFix2d},
                            Head{"gnss_velocity", "In_GnssVelEN", "GnssVelEN_East"},
                            Head{"magnetometer", "In_Mag", "Mag_FluxX"},
                            Head{"barometer", "In_Baro", "Baro_Pressure"},
                            Head{"heading", "In_Heading", "Heading_Angle"},
                            Head{"landmarks", "In_RangeBearing", ""}};

bool usable(const Head& head, const DbcMessage& message, const base::CanFrame& frame) {
  const DbcSignal* const signal = message.find(head.signal);
  if (signal == nullptr) return true;
  const std::int64_t raw = signal->raw(frame);
  return raw >= head.least && !(signal->has_not_available() && raw == signal->not_available());
}

std::string real(double value) {
  if (!std::isfinite(value)) return "null";
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.6g", value);
  return text.data();
}

std::string object_of(const std::map<std::string, double>& numbers) {
  std::string text;
  for (const auto& [name, value] : numbers) text += (text.empty() ? "\"" : ", \"") + name + "\": " + real(value);
  return "{" + text + "}";
}

std::string object_of(const std::array<Figures, kQuantities>& figures) {
  std::string text;
  for (std::size_t q = 0; q < kQuantities; ++q) {
    const Figures& f = figures[q];
    text += std::string(q == 0 ? "" : ", ") + "\"" + kQuantityNames[q] +
            "\": {\"worst_ratio\": " + real(f.worst_ratio) + ", \"worst_error\": " + real(f.worst_error) +
            ", \"clean_ratio\": " + real(f.clean_ratio) + ", \"clean_error\": " + real(f.clean_error) +
            ", \"beyond_s\": " + real(f.beyond_s) +
            ", \"inside_after_s\": " + (f.inside_after_s ? real(*f.inside_after_s) : "null") +
            ", \"valid_while_out_s\": " + real(f.valid_while_out_s) + "}";
  }
  return "{" + text + "}";
}

}  // namespace

std::string device_of(const FrameFault& fault) {
  const std::string& s = fault.sensor;
  if (s == "frames" || s == "stamps") return fault.axis;
  if (s == "gyro" || s == "accel") return "imu";
  if (s == "speed") return "wheels";
  if (s.starts_with("gnss")) return "gnss";
  return s == "heading_accuracy" ? "heading" : s;
}

void set_kind(FrameFault& fault, const std::string& kind) {
  const bool spike = kind.starts_with("spike");
  if (spike) {
    const char* const last = kind.data() + kind.size();
    const auto [end, error] = std::from_chars(kind.data() + 5, last, fault.samples);
    if (error != std::errc{} || end != last || fault.samples < 1)
      throw std::runtime_error("kind of fault '" + kind + "': a spike has its number of samples, as in spike2");
  }
  fault.kind = fault_kind(spike ? "spike" : kind);
  fault.duration = lasts(fault);
}

CellRequest::CellRequest(const std::string& line) {
  std::istringstream words(line);
  std::string kind, left;
  if (!(words >> situation >> fault.sensor >> fault.axis >> kind >> size) || words >> left)
    throw std::runtime_error("cell '" + line + "': it is SITUATION SENSOR AXIS KIND SIZE");
  set_kind(fault, kind);
}

FrameGeometry geometry_of(const CleanLog& log) {
  const param::Parameters& n = log.parameters;
  // A robot without a mounting of its own states the vertical alone, if anything.
  const bool inertial = n.inertial.mounting_bs != param::InertialParameters{}.mounting_bs;
  const auto& drive = n.wheels.drive;
  const double around_m = kPi * static_cast<double>(drive.left_radius_m + drive.right_radius_m);
  return {.base = n.can_base,
          .imu = static_cast<unsigned>(n.inertial.imu),
          .mounting_bs = detail::imu_mounting(n, inertial).m,
          .metres_per_count = drive.counts_per_turn > 1 ? around_m / static_cast<double>(drive.counts_per_turn) : 0,
          .latitude_deg = log.origin.latitude_deg};
}

CellFacts facts_of(const CleanLog& log, std::size_t tick, const PublishedState& clean, const BusDatabase& dbc) {
  CellFacts facts{.uncertainty = {.position_m = std::max(clean.std_position_m[0], clean.std_position_m[1]),
                                  .heading_rad = clean.std_yaw_rad},
                  .moving = moving_at(log, tick),
                  .period_s = {}};
  Uncertainty& u = facts.uncertainty;
  facts.planar = log.planar;
  if (!facts.planar) {
    u.velocity_mps = *std::max_element(clean.std_velocity_mps.begin(), clean.std_velocity_mps.end());
    u.height_m = clean.std_position_m[2] > 0 ? clean.std_position_m[2] : u.position_m;
  }
  u.speed_mps = facts.moving.speed_mps;
  std::map<std::string, int> samples;
  const std::size_t until = std::min(tick + kPeriodWindow, log.ticks.size());
  for (std::size_t i = log.first[tick]; i < log.first[until]; ++i) {
    const base::CanFrame& frame = log.frames[i].frame;
    const DbcMessage* const message = dbc.at(frame.id - log.parameters.can_base);
    if (message == nullptr) continue;
    for (const Head& head : kHeads) {
      if (message->name != head.message) continue;
      const std::string device(head.device);
      ++samples[device];
      if (usable(head, *message, frame))
        facts.usable_after_s.try_emplace(device, 1e-6 * static_cast<double>((log.frames[i].time - log.ticks[tick]).us));
    }
    if (message->name == "In_GnssAcc") u.gnss_position_m = message->find("GnssAcc_Hor")->value(frame);
    if (message->name == "In_GnssVelU") u.gnss_velocity_mps = message->find("GnssVelU_Acc")->value(frame);
    const DbcSignal* const turn = message->find("BodySpeed_YawRate");
    facts.wheels_turn = facts.wheels_turn || message->name == "In_WheelCounts" || message->name == "In_WheelSpeed" ||
                        (turn != nullptr && turn->raw(frame) != turn->not_available());
  }
  for (const auto& [device, count] : samples)
    facts.period_s[device] = kTick_s * static_cast<double>(until - tick) / count;
  return facts;
}

FrameFault sized(const CellRequest& request, const CleanLog& log, std::size_t tick, const CellFacts& facts,
                 const BusDatabase& dbc, double& gate) {
  FrameFault fault = request.fault;
  const auto period = facts.period_s.find(device_of(fault));
  const double interval_s = period == facts.period_s.end() ? 0.1 : period->second;
  fault.start = log.ticks[tick];
  gate = gate_of(fault, interval_s, facts.uncertainty, log.parameters, facts.planar);
  if (fault.kind == FaultKind::kSpike)
    fault.duration = base::Micros{static_cast<std::int64_t>(1e6 * interval_s * fault.samples)};
  const std::string& size = request.size;
  const double most = size == "max" || size.ends_with('g') ? largest_size(fault, geometry_of(log), dbc, interval_s) : 0;
  if (size == "max")
    fault.size = most;
  else if (size.ends_with('g'))
    fault.size = std::min(number_of(size, 0, 1) * gate, most);
  else if (size.starts_with('x') || size.starts_with('s'))
    fault.size = number_of(size, 1, 0);
  const double second = velocity_gate(facts.uncertainty, log.parameters);
  fault.velocity_mps = gate > 0 ? std::min(fault.size / gate * second, 262.0) : 0;
  return fault;
}

std::string row_of(const std::string& robot, std::uint64_t seed, const CellRequest& request, const FrameFault& fault,
                   const CellFacts& facts, const CellResult& result) {
  const std::string kind =
      std::string(name(fault.kind)) + (fault.kind == FaultKind::kSpike ? std::to_string(fault.samples) : "");
  std::string text = "{\"robot\": \"" + robot + "\", \"sensor\": \"" + fault.sensor + "\", \"axis\": \"" + fault.axis +
                     "\", \"kind\": \"" + kind + "\", \"size\": \"" + request.size + "\", \"situation\": \"" +
                     request.situation + "\", \"seed\": " + std::to_string(seed);
  const auto field = [&text](const std::string& key, const std::string& json) { text += ", \"" + key + "\": " + json; };
  field("size_value", real(fault.size));
  field("gates", result.gate > 0 && result.largest > 0 ? real(result.largest / result.gate) : "null");
  field("at_s", real(result.at_s));
  field("lasts_s", real(static_cast<double>(fault.duration.us) * 1e-6));
  field("changed", std::to_string(result.changed));
  field("quantities", object_of(result.figures));
  if (result.oracle) field("oracle", object_of(*result.oracle));
  std::string said;
  for (const auto& [word, after_s] : result.said)
    said += (said.empty() ? "\"" : ", \"") + word + "\": " + real(after_s);
  field("said", "{" + said + "}");
  const Uncertainty& u = facts.uncertainty;
  field("facts",
        "{\"period_s\": " + object_of(facts.period_s) + ", \"usable_after_s\": " + object_of(facts.usable_after_s) +
            ", \"wheels_turn\": " + (facts.wheels_turn ? "true" : "false") +
            ", \"planar\": " + (facts.planar ? "true" : "false") + ", \"speed_mps\": " + real(u.speed_mps) +
            ", \"turn_radps\": " + real(facts.moving.turn_radps) + ", \"sigma_heading_rad\": " + real(u.heading_rad) +
            ", \"gnss_velocity_mps\": " + real(u.gnss_velocity_mps) + ", \"gate\": " + real(result.gate) + "}");
  return text + "}\n";
}

}  // namespace tetap::sim
