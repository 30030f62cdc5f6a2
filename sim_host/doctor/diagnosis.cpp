// SPDX-License-Identifier: Apache-2.0
#include "sim_host/doctor/diagnosis.hpp"

#include "sim_host/doctor/antenna.hpp"
#include "sim_host/doctor/axes.hpp"
#include "sim_host/doctor/bus_time.hpp"
#include "sim_host/doctor/camera.hpp"
#include "sim_host/doctor/dead_axis.hpp"
#include "sim_host/doctor/fixes.hpp"
#include "sim_host/doctor/force.hpp"
#include "sim_host/doctor/forward.hpp"
#include "sim_host/doctor/gyro_reference.hpp"
#include "sim_host/doctor/halves.hpp"
#include "sim_host/doctor/lateness.hpp"
#include "sim_host/doctor/origin.hpp"
#include "sim_host/doctor/path.hpp"
#include "sim_host/doctor/scans.hpp"
#include "sim_host/doctor/sequence.hpp"
#include "sim_host/doctor/speed_vote.hpp"
#include "sim_host/doctor/stamps.hpp"
#include "sim_host/doctor/turn.hpp"
#include "sim_host/doctor/turn_scale.hpp"
#include "sim_host/doctor/wheel_speed.hpp"
#include "sim_host/replay/protocol.hpp"
#include "tetap/bus/decoder.hpp"

#include <algorithm>
#include <array>
#include <tuple>
#include <utility>

namespace tetap::doctor {
namespace {

constexpr base::Micros kPatience{200'000};  ///< for the rest of a sample of several frames
constexpr std::int64_t kMostPause_us = 60'000'000;

/// The first reading: which clock the log has.
struct Survey {
  std::uint64_t inputs = 0, syncs = 0, steps = 0, epochs = 0;

  void add(const base::CanFrame& frame, std::uint32_t base) {
    const auto offset = sim::offset_in_block(frame, base);
    if (!offset) return;
    if (sim::is_counted_input(frame, base)) ++inputs;
    if (*offset == bus::EstEpoch::kOffset) ++epochs;
    if (*offset != bus::InSync::kOffset) return;
    const auto sync = bus::decode<bus::InSync>(bus::payload(frame));
    if (!sync) return;
    ++syncs;
    if (sync->kind == bus::SyncKind::kStep) ++steps;
  }
  [[nodiscard]] ClockSource clock() const {
    return syncs > 0 ? ClockSource::kSync : epochs > 0 ? ClockSource::kEpochs : ClockSource::kLog;
  }
};

/// All detectors, and what puts frames together for them.
class Examination {
 public:
  Examination(const RobotFacts& robot, ClockSource clock)
      : windows_(robot),
        stamps_(clock, base::Micros{robot.parameters.loop.window_us}),
        force_(robot),
        turn_(robot),
        forward_(robot),
        course_(robot.imu),
        field_(robot),
        velocity_(course_, path_),
        path_(robot, windows_),
        lateness_(path_),
        wheel_speed_(robot),
        speed_vote_({.velocity_by_wheels = wheel_speed_, .fixes_by_wheels = path_, .fixes_by_velocity = velocity_}),
        antenna_(robot),
        scans_(robot, windows_),
        origin_(robot),
        dead_axis_(robot),
        axes_(robot, {.turn = turn_, .course = course_, .field = field_, .force = force_, .forward = forward_}),
        turn_scale_({.turn = turn_, .course = course_, .field = field_, .force = force_, .forward = forward_}),
        camera_(robot, path_) {
    decoder_.power_on();
  }

  void frame(const SeenFrame& seen) {
    // Features share one Seq within an image: only their own comparison knows that.
    if (sim::is_map_input(seen.offset)) return camera_.frame(seen);
    for (Detector* one : all_) one->frame(seen);
    time_ = seen.time;
    decoder_.expire(seen.time, kPatience, counters_);
    decoder_.on_frame(static_cast<std::uint8_t>(seen.offset), seen.frame, seen.time, counters_, *this);
  }
  /// A frame of a scan, which is no counted input of every robot.
  void scan_frame(const SeenFrame& seen) { scans_.scan_frame(seen); }
  Findings finish() {
    Findings findings;
    for (Detector* one : all_) one->finish(findings);
    return findings;
  }

  [[nodiscard]] std::optional<std::string> untold() const { return lateness_.untold(); }
  [[nodiscard]] const std::vector<Window>& seconds() const { return seconds_.all(); }

  // The decoder hands these over.
  void sample(const sensor::Sample& sample) {
    if (const auto window = windows_.add(time_, sample)) {
      seconds_.add(*window);
      for (Detector* one : all_) one->window(*window);
    }
    for (Detector* one : all_) one->sample(time_, sample);
  }
  void map_entry(const estimators::MapEntry&) {}
  void set_pose(const auto&) {}
  void reset(auto) {}

 private:
  bus::Decoder decoder_;
  bus::Counters counters_;
  base::Micros time_;
  Windows windows_;
  KeptWindows seconds_;
  HalvesDetector halves_;
  SequenceDetector sequence_;
  StampDetector stamps_;
  ForceDetector force_;
  TurnDetector turn_;
  ForwardDetector forward_;
  CourseDetector course_;
  FieldDetector field_;
  VelocityDetector velocity_;
  PathDetector path_;
  LatenessDetector lateness_;
  WheelSpeedDetector wheel_speed_;
  SpeedVoteDetector speed_vote_;
  AntennaDetector antenna_;
  ScanDetector scans_;
  OriginDetector origin_;
  DeadAxisDetector dead_axis_;
  AxesDetector axes_;
  TurnScaleDetector turn_scale_;
  CameraDetector camera_;
  std::array<Detector*, 20> all_{&halves_, &sequence_, &stamps_,    &force_,    &turn_,        &forward_,    &course_,
                                 &field_,  &velocity_, &path_,      &lateness_, &wheel_speed_, &speed_vote_, &antenna_,
                                 &scans_,  &origin_,   &dead_axis_, &axes_,     &turn_scale_,  &camera_};
};

/// Codes of one comparison of several devices, which may not show whose axes are wrong.
bool is_gnss_axes(Code code) { return code >= Code::kLatLonSwapped && code <= Code::kVelocityAxes; }

}  // namespace

void KeptWindows::add(const Window& window) {
  if (seen_++ % every_ != 0) return;
  all_.push_back(window);
  if (all_.size() < kMost) return;
  for (std::size_t i = 0; i < kMost / 2; ++i) all_[i] = all_[2 * i];
  all_.resize(kMost / 2);
  every_ *= 2;
}

Findings ranked(Findings findings) {
  // A finding beside another code follows it; the axes of GNSS stand at one place.
  const auto place = [](const Finding& one) {
    const Code code = one.beside ? std::max(*one.beside, one.code) : one.code;
    return std::tuple(is_gnss_axes(code) ? Code::kLatLonSwapped : code, one.beside.has_value(), -one.certainty);
  };
  std::stable_sort(findings.begin(), findings.end(),
                   [&](const Finding& a, const Finding& b) { return place(a) < place(b); });
  Findings kept;
  const auto spoils = [](const Finding& one) { return one.spoils != 0 ? one.spoils : row(one.code).spoils; };
  const auto spoiled = [&](const Finding& one, bool by_axes) {
    return std::any_of(kept.begin(), kept.end(), [&](const Finding& k) {
      // The fixes are a third device: they show the velocity's axes.
      const bool stays = k.code == one.beside && k.code != Code::kVelocityAxes;
      return !stays && is_gnss_axes(k.code) == by_axes && (spoils(k) & one.uses) != 0;
    });
  };
  // A path shows a mirror, and not which of two axes it reverses: the velocity does.
  std::vector<Code> by_velocity;
  for (const Finding& one : findings)
    if (is_gnss_axes(one.code) && one.code != Code::kVelocityAxes && (one.uses & kGnssVelocity) != 0)
      by_velocity.push_back(one.code);
  const auto other_mirror = [&](const Finding& one) {
    return is_gnss_axes(one.code) && (one.uses & kWheels) != 0 && !by_velocity.empty() &&
           std::find(by_velocity.begin(), by_velocity.end(), one.code) == by_velocity.end();
  };
  bool wrong_stamps = false;  // which show no delay
  bool placed = false;        // by the robot's origin, which leaves no second reading of the axes
  for (Finding& one : findings) {
    const bool axes = is_gnss_axes(one.code);
    if (other_mirror(one) || (one.code == Code::kReceiverLate && wrong_stamps)) continue;
    if (spoiled(one, false) || (!axes && spoiled(one, true)) || (axes && placed)) continue;
    const auto same = std::find_if(kept.begin(), kept.end(), [&](const Finding& k) { return k.code == one.code; });
    if (same != kept.end()) {
      if (same->evidence.size() + one.evidence.size() < 600) same->evidence += " " + one.evidence;
      continue;
    }
    placed |= axes && one.uses == kNoDevice;
    wrong_stamps |= one.code >= Code::kStampsInMs && one.code <= Code::kNoInSync;
    if (one.change.empty()) one.change = row(one.code).change;
    kept.push_back(std::move(one));
  }
  return kept;
}

sim::Result<Diagnosis> diagnose(sim::Frames& log, const std::string& name, std::uint32_t base,
                                const RobotFacts& robot) {
  Survey survey;
  bool any = false;
  for (sim::TimedFrame entry; log.next(entry); any = true) survey.add(entry.frame, base);
  if (log.failure()) return *log.failure();
  if (!any) return sim::Failure{name + ": no CAN data frame in it"};
  if (survey.inputs == 0) return sim::Failure{name + ": no input frames of this id base"};
  log.rewind();
  BusTime clock(survey.clock(), base, survey.steps > 0);
  Examination examination(robot, survey.clock());
  Diagnosis found{.findings = {}, .untold = {}, .inputs = survey.inputs, .duration_s = 0, .seconds = {}};
  base::Micros last;
  bool begun = false;
  for (sim::TimedFrame entry; log.next(entry);) {
    clock.add(entry.time, entry.frame);
    if (!clock.known()) continue;
    if (const auto offset = sim::offset_in_block(entry.frame, base);
        offset && *offset <= 0xFF && bus::ScanAssembly::takes(static_cast<std::uint8_t>(*offset)))
      examination.scan_frame({.time = clock.now(), .offset = *offset, .frame = entry.frame});
    if (!sim::is_counted_input(entry.frame, base, {.images = true})) continue;
    const base::Micros now = clock.now();
    if (begun && now > last && (now - last).us < kMostPause_us)
      found.duration_s += static_cast<double>((now - last).us) * 1e-6;
    begun = true;
    last = now;
    examination.frame({.time = now, .offset = entry.frame.id - base, .frame = entry.frame});
  }
  found.findings = ranked(examination.finish());
  found.untold = examination.untold();
  found.seconds = examination.seconds();
  return found;
}

}  // namespace tetap::doctor
