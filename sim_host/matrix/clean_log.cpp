// SPDX-License-Identifier: Apache-2.0
#include "sim_host/matrix/clean_log.hpp"

#include "sim_host/play/log_file.hpp"
#include "sim_host/published_sensors.hpp"
#include "sim_host/replay/protocol.hpp"
#include "sim_host/robots.hpp"
#include "sim_host/world_source.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <stdexcept>
#include <utility>

namespace tetap::sim {

namespace {

constexpr base::Micros kPeriod{10'000};
constexpr std::size_t kWindow = 500;    ///< ticks over which a situation is judged
constexpr std::size_t kWarmUp = 2'500;  ///< ticks before the first fault, but for the situation "start"
constexpr std::size_t kAfter = 2'600;   ///< ticks that a cell may need from its fault on
constexpr std::size_t kStartTick = 50;
constexpr std::size_t kPlacesBefore = 1'500;  ///< ticks of a recorded log behind the last place
constexpr double kHeadingSigma_rad = 0.035;
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

World world_of(const std::string& robot, std::uint64_t seed, param::Parameters& parameters, Sent& sent) {
  World::Options world;
  parameters = parameters_of(robot);
  sent = sent_to(robot);
  simulate(robot, sent, parameters, world);
  world.origin = origin_of(parameters.gnss, world.origin);
  world.course = sent.kind == VehicleKind::kMulticopter ? flight_course(1)
                 : sent.kind == VehicleKind::kCar       ? street_course(1)
                                                        : default_course(1);
  send_only(sent, world);
  return World(world, seed);
}

/// The robot's own outside heading, as a compass that is calibrated gives it.
class HeadingSensor {
 public:
  HeadingSensor(std::uint32_t base, std::uint64_t seed) : base_(base), chance_(seed, Stream::kMagnetometer) {}

  void sample(const Truth& truth, std::vector<base::CanFrame>& out) {
    const double yaw_rad = std::remainder(truth.yaw_rad + chance_.normal(kHeadingSigma_rad), 2 * kPi);
    const auto head = bus::SampleHead::of(truth.time, sequence_++, 0);
    bus::encode_sample(sensor::OutsideHeading{.yaw_rad = static_cast<float>(yaw_rad),
                                              .acc_rad = static_cast<float>(kHeadingSigma_rad)},
                       head, [&](const auto& message) { out.push_back(bus::frame(base_, message)); });
  }

 private:
  std::uint32_t base_;
  Chance chance_;
  std::uint8_t sequence_ = 0;
};

bool takes_heading(const std::string& robot) {
  const Robot& chosen = robot_named(robot);
  const param::Parameters& n = *chosen.parameters;
  return chosen.takes.heading && n.magnetic.use == 0 && n.inertial.starts_forward == 0;
}

}  // namespace

CleanLog clean_log(const std::string& robot, std::uint64_t seed) {
  CleanLog log;
  Sent sent;
  World world = world_of(robot, seed, log.parameters, sent);
  log.origin = world.origin();
  log.planar = !sent.inertial;
  log.surveyed = sent.landmarks;
  const bool heading = takes_heading(robot);
  HeadingSensor compass(log.parameters.can_base, seed);
  WorldSource source(std::move(world), log.parameters.can_base, kPeriod, base::Micros{86'400'000'000});
  std::vector<base::CanFrame> more;
  for (Tick tick; source.next(tick);) {
    if (tick.begin) log.begin = *tick.begin;
    log.ticks.push_back(tick.time);
    log.truth.push_back(source.truth());
    log.first.push_back(log.frames.size());
    more.clear();
    if (heading && log.ticks.size() % 20 == 0) compass.sample(source.truth(), more);
    for (const base::CanFrame& frame : tick.inputs) log.frames.push_back({tick.time, frame});
    for (const base::CanFrame& frame : more) log.frames.push_back({tick.time, frame});
  }
  log.first.push_back(log.frames.size());
  return log;
}

namespace {

struct TruthRow {
  double time_s, x_m, y_m, yaw_rad;
};

std::vector<std::string> cells_of(const std::string& line) {
  std::vector<std::string> cells(1);
  for (const char c : line) {
    if (c == ',') cells.emplace_back();
    if (c != ',' && c != '\r') cells.back() += c;
  }
  return cells;
}

std::vector<TruthRow> truth_rows(const std::string& path) {
  std::ifstream file(path);
  std::string line;
  if (!std::getline(file, line)) throw std::runtime_error(path + ": cannot be read");
  const std::vector<std::string> names = cells_of(line);
  const auto column = [&](const char* name) {
    return static_cast<std::size_t>(std::find(names.begin(), names.end(), name) - names.begin());
  };
  const std::size_t time = column("time_s"), x = column("x_m"), y = column("y_m"), yaw = column("yaw_rad");
  if (std::max({time, x, y}) >= names.size()) throw std::runtime_error(path + ":1: no column time_s, x_m or y_m");
  std::vector<TruthRow> rows;
  while (std::getline(file, line)) {
    const std::vector<std::string> cells = cells_of(line);
    const auto number = [&](std::size_t i) {
      return i < cells.size() && !cells[i].empty() ? std::strtod(cells[i].c_str(), nullptr) : kNone;
    };
    rows.push_back({number(time), number(x), number(y), number(yaw)});
  }
  if (rows.size() < 2) throw std::runtime_error(path + ": fewer than two rows");
  return rows;
}

/// The truth at each tick; the velocity is that between two rows.
std::vector<Truth> truth_at(const std::vector<base::Micros>& ticks, const std::vector<TruthRow>& rows) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < rows.size(); ++i) steps.push_back(rows[i].time_s - rows[i - 1].time_s);
  std::nth_element(steps.begin(), steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2), steps.end());
  const double longest_s = std::max(0.2, 2.5 * steps[steps.size() / 2]);
  std::vector<Truth> all;
  std::size_t k = 1;
  for (const base::Micros tick : ticks) {
    const double t = static_cast<double>(tick.us) * 1e-6;
    while (k + 1 < rows.size() && rows[k].time_s < t) ++k;
    const TruthRow &a = rows[k - 1], &b = rows[k];
    const double span = b.time_s - a.time_s, part = span > 0 ? (t - a.time_s) / span : 0;
    const bool known = part >= 0 && part <= 1 && span <= longest_s;
    const double turn = std::remainder(b.yaw_rad - a.yaw_rad, 2 * kPi);
    Truth truth{.time = tick,
                .x_m = kNone,
                .y_m = kNone,
                .z_m = kNone,
                .roll_rad = kNone,
                .pitch_rad = kNone,
                .yaw_rad = kNone};
    if (known) {
      truth.x_m = a.x_m + part * (b.x_m - a.x_m);
      truth.y_m = a.y_m + part * (b.y_m - a.y_m);
      truth.yaw_rad = a.yaw_rad + part * turn;
      truth.v_n_mps = {(b.x_m - a.x_m) / span, (b.y_m - a.y_m) / span, 0};
    }
    all.push_back(truth);
  }
  return all;
}

}  // namespace

CleanLog recorded_log(const std::string& robot, const std::string& path, const std::string& truth) {
  CleanLog log;
  log.recorded = true;
  log.parameters = parameters_of(robot);
  log.planar = !sent_to(robot).inertial;
  LogFile file(path, {.interface = {}, .base = log.parameters.can_base});
  for (TimedFrame f; file.next(f);) {
    if (!is_counted_input(f.frame, log.parameters.can_base)) continue;
    const base::Micros due{(f.time.us + kPeriod.us - 1) / kPeriod.us * kPeriod.us};
    if (log.ticks.empty()) {
      log.begin = due - kPeriod;
      log.ticks.push_back(due);
      log.first.push_back(0);
    }
    for (base::Micros tick = log.ticks.back() + kPeriod; tick <= due; tick += kPeriod) {
      log.ticks.push_back(tick);
      log.first.push_back(log.frames.size());
    }
    log.frames.push_back({log.ticks.back(), f.frame});
  }
  if (!file.report().cut_off.empty()) throw std::runtime_error(file.report().cut_off);
  log.first.push_back(log.frames.size());
  log.truth = truth_at(log.ticks, truth_rows(truth));
  return log;
}

Moving moving_at(const CleanLog& log, std::size_t tick) {
  constexpr std::size_t kPart = 50;  // ticks: shaking is no turn
  Moving mean;
  for (std::size_t i = tick; i < tick + kWindow; ++i) {
    const Vector3& v = log.truth[i].v_n_mps;
    mean.speed_mps += std::sqrt(v[0] * v[0] + v[1] * v[1]) / static_cast<double>(kWindow);
  }
  for (std::size_t i = tick; i < tick + kWindow; i += kPart) {
    const double turned_rad = std::remainder(log.truth[i + kPart].yaw_rad - log.truth[i].yaw_rad, 2 * kPi);
    if (std::isfinite(turned_rad)) mean.turn_radps += std::fabs(turned_rad) / (0.01 * static_cast<double>(kWindow));
  }
  return mean;
}

std::size_t tick_of(std::string_view situation, const CleanLog& log) {
  if (situation.starts_with("place") && log.recorded) {
    const int place = std::atoi(std::string(situation.substr(5)).c_str());
    if (place < 1 || place > 10) throw std::runtime_error("places are place1 to place10");
    const std::size_t first = log.ticks.size() / 5;
    if (log.ticks.size() < first + kPlacesBefore) throw std::runtime_error("the drive is too short for a cell");
    return first + (log.ticks.size() - kPlacesBefore - first) * static_cast<std::size_t>(place - 1) / 9;
  }
  if (log.ticks.size() < kWarmUp + kAfter) throw std::runtime_error("the drive is too short for a cell");
  if (situation == "start") return kStartTick;
  const bool standing = situation == "standing", curve = situation == "curve";
  if (!standing && !curve && situation != "straight" && situation != "outage")
    throw std::runtime_error("no situation '" + std::string(situation) + "'; there are: " + std::string(kSituations));
  double fastest = 0;
  for (std::size_t i = kWarmUp; i + kAfter < log.ticks.size(); i += 50)
    fastest = std::max(fastest, moving_at(log, i).speed_mps);
  std::size_t best = kWarmUp;
  double least = 1e9;
  for (std::size_t i = kWarmUp; i + kAfter < log.ticks.size(); i += 50) {
    const Moving m = moving_at(log, i);
    const double share = m.speed_mps / fastest;
    const double badness = standing ? share : curve ? 2 - m.turn_radps : m.turn_radps;
    if (!standing && share < (curve ? 0.3 : 0.6)) continue;
    if (badness < least - 1e-3) least = badness, best = i;
  }
  return best;
}

}  // namespace tetap::sim
