// SPDX-License-Identifier: Apache-2.0
// From estimates, records and counters to frames: what goes out in which epoch. The schedule is counted in epochs, so
// it is the same in every replay.
#pragma once

#include "tetap/base/math.hpp"
#include "tetap/base/members.hpp"
#include "tetap/bus/codec.hpp"
#include "tetap/bus/counters.hpp"
#include "tetap/bus/e2e.hpp"
#include "tetap/bus/event_queue.hpp"
#include "tetap/bus/fault_hold.hpp"
#include "tetap/bus/input_crc.hpp"
#include "tetap/bus/multiplexed.hpp"
#include "tetap/bus/version.hpp"
#include "tetap/estimators/attitude_disagreement.hpp"
#include "tetap/estimators/context.hpp"
#include "tetap/estimators/estimate.hpp"
#include "tetap/estimators/map_frame.hpp"
#include "tetap/estimators/own_map.hpp"
#include "tetap/estimators/sensor_statistics.hpp"
#include "tetap/estimators/visual/visual_report.hpp"
#include "tetap/param/crc.hpp"
#include "tetap/sensor/sample.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>

namespace tetap::bus {

/// Content of Est_Status.
struct Summary {
  sensor::Mode mode = sensor::Mode::kBoot;
  bool position_valid = false;
  bool heading_valid = false;
  bool velocity_valid = false;
  bool origin_known = false;
  std::uint16_t used = 0;  ///< a bit per sensor kind accepted within the last second
  bool rejecting = false;
  std::uint16_t faults = 0;     ///< bits of sensor::Fault that estimators see
  std::uint8_t map_faults = 0;  ///< bits of MapFault
  std::uint8_t resets = 0;
  sensor::ResetCause cause = sensor::ResetCause::kPowerOn;
  bool restarted = false;  ///< within the last second, by ourselves
};

// Epochs in which a node looks at more than its primary estimator. They decide when a side estimator that is not finite
// begins anew, on a bus and without one.
[[nodiscard]] constexpr bool one_of(std::uint32_t epoch, std::int32_t ticks, std::int32_t phase) {
  return ticks > 0 && (epoch + static_cast<std::uint32_t>(phase)) % static_cast<std::uint32_t>(ticks) == 0;
}
/// Phase that spreads the estimators' slow frames over the epochs.
[[nodiscard]] constexpr std::int32_t side_phase(std::size_t instance) {
  return static_cast<std::int32_t>(3 * instance);
}
[[nodiscard]] constexpr bool side_published(std::uint32_t epoch, std::int32_t side_every, std::size_t instance) {
  return one_of(epoch, side_every, side_phase(instance));
}
/// Phase of the difference between two attitudes.
inline constexpr std::int32_t kCompared = 1;
/// True in the epochs that compare two attitudes: one in four, and those that publish the difference.
[[nodiscard]] constexpr bool attitudes_compared(std::uint32_t epoch, std::int32_t side_every) {
  return epoch % 4 == 1 || one_of(epoch, side_every, kCompared);
}

template <std::size_t EstimatorCount>
class Publisher {
 public:
  Publisher(const param::Parameters& parameters, const Version& version)
      : parameters_(parameters), version_(version), config_(param::crc(parameters)) {}

  void power_on() {
    base::clear(*this);
    show_wired();
  }

  /// Notes until end() come in the order of the samples' stamps, not of their arrival.
  void tick_begins() { events_.tick_begins(); }
  /// First frame of the epoch.
  template <class Send>
  void begin(base::Micros now, const InputCrc& tally, Send& send) {
    ++epoch_;
    frames_ = 0;
    now_ = now;
    put(bus::EstEpoch{.time_us = static_cast<std::uint64_t>(now.us) & 0xFFFFFFFFFFFFU,
                      .in_crc = static_cast<std::uint16_t>(tally.running())},
        send);
  }

  /// Last frame of the epoch.
  template <class Send>
  void end(std::uint32_t state_crc, const InputCrc& tally, Send& send) {
    put(bus::EstStateCrc{.crc = state_crc,
                         .in_count = static_cast<std::uint16_t>(tally.count()),
                         .epoch = static_cast<std::uint8_t>(epoch_),
                         .frames = static_cast<std::uint8_t>(frames_ + 1)},
        send);
    events_.tick_ends();
  }

  /// True when this estimator's 1 sigma go out in this epoch: the motion's variance is needed then.
  [[nodiscard]] bool publishes_sigma(std::size_t instance, bool primary) const {
    const param::PublishParameters& p = parameters_.publish;
    return primary ? every(p.std_every, kTogether) : publishes(instance);
  }
  /// True when this estimator's estimate goes out in this epoch, where it is not the primary one.
  [[nodiscard]] bool publishes(std::size_t instance) const {
    return side_published(epoch_, parameters_.publish.side_every, instance);
  }
  [[nodiscard]] bool compares_attitudes() const { return attitudes_compared(epoch_, parameters_.publish.side_every); }
  template <class Send>
  void estimate(std::size_t instance, sensor::EstimatorKind kind, bool primary, const estimators::Estimate& e,
                const estimators::MotionVariance& motion, Send& send);
  /// `inertial` gives the estimate and `sources` the states of its sources, when they are asked for.
  template <class Inertial, class Sources, class Send>
  void inertial(std::size_t instance, Inertial&& inertial, Sources&& sources, Send& send);
  /// `attitude` gives the estimate when it is asked for.
  template <class Attitude, class Send>
  void attitude(std::size_t instance, Attitude&& attitude, const estimators::Disagreement& from_primary, Send& send);
  /// One landmark of the estimator's own map, and in its turn the page about the map.
  template <estimators::MakesMap Estimator, class Send>
  void own_map(const Estimator& estimator, Send& send);
  /// A match that ended in this tick.
  template <class Send>
  void scan_match(const estimators::ScanMatchReport& match, base::Micros now, Send& send) {
    if (match.ended != now) return;
    static_assert(static_cast<int>(bus::ScanFate::kNoGeometry) == static_cast<int>(estimators::ScanEnd::kNoGeometry) &&
                  static_cast<int>(bus::ScanFate::kFewPairs) == static_cast<int>(estimators::ScanEnd::kFewPairs));
    put(bus::EstScanMatch{.epoch = tag(),
                          .seq = match.sequence,
                          .inst = match.instance,
                          .fate = static_cast<bus::ScanFate>(match.end),
                          .iterations = static_cast<std::uint8_t>(match.iterations),
                          .pairs = static_cast<std::uint16_t>(match.pairs),
                          .closure_id = bus::EstScanMatch::kClosureIdNotAvailable,
                          .std_most_m = match.sigma_m,
                          .std_yaw_rad = match.sigma_yaw_rad},
        send);
  }
  /// Fates of the tracks of an image that ended in this tick, and in its turn the height.
  template <estimators::SeesImages Estimator, class Send>
  void visual(std::size_t instance, const Estimator& estimator, const estimators::Context& ctx, Send& send);
  /// `summary` gives the content of the status when it is asked for.
  template <class GiveSummary, class Send>
  void status(GiveSummary&& summary, const LoopHealth& loop, Send& send);
  template <class Slots, class Send>
  void statistics(const Slots& slots, base::Micros now, Send& send);
  template <class Send>
  void diagnostics(const Counters& counters, const LoopHealth& loop, std::uint16_t timeline_high, Send& send);
  /// Counts of refusals; `guard_page()` gives that of guards and tags, where the node has them.
  template <class Send, class GuardPage>
  void refusals(const Counters& counters, const LoopHealth& loop, GuardPage&& guard_page, Send& send);
  /// Version and origin; `likeliest()` gives the likeliest fault, where the node has hypotheses of faults.
  template <class Likeliest, class Send>
  void identity(const estimators::MapFrame& map_frame, Likeliest&& likeliest, Send& send);
  template <class Send>
  void events(Send& send);
  template <class Send>
  void send_version(Send& send) {
    put(bus::EstVersion{.dirty = version_.dirty, .git = version_.git, .config = config_}, send);
  }

  /// The parameters are others now.
  void renew_config() { config_ = param::crc(parameters_); }
  /// The frame of this tick about parameters, if there is one.
  template <class Commands, class Send>
  void parameters(Commands& commands, Send& send) {
    commands.publish(config_, [&](const auto& message) { put(message, send); });
  }

  [[nodiscard]] std::uint32_t epoch() const { return epoch_; }
  /// The next page of diagnostics is the one with the wired sensors.
  void show_wired() {
    if (parameters_.wired.any()) page_ = kWiredPage;
  }
  /// All but parameters and version, which stay its own.
  static constexpr auto members(auto& self) {
    return base::members(base::reference(self.parameters_), base::own(self.version_), base::own(self.config_),
                         self.epoch_, self.frames_, self.now_, self.status_counter_, self.page_, self.identity_,
                         self.statistic_, self.events_, self.troubles_);
  }

  /// Queues the record of a measurement.
  void event(const estimators::Innovation& innovation, const sensor::Sample& sample, std::size_t instance,
             base::Micros now, Counters& counters) {
    events_.add(innovation, sample, instance, now, counters);
  }

 private:
  static constexpr std::uint32_t kKeyframeIds = 0x3FFF;  ///< identities go round
  template <estimators::MapsLandmarks Estimator, class Send>
  void put_landmark(const Estimator& estimator, std::uint32_t size, Send& send);
  template <estimators::MapsKeyframes Estimator, class Send>
  void put_graph(const Estimator& estimator, std::uint32_t size, Send& send);
  template <class Message, class Send>
  void put(const Message& message, Send& send, std::size_t instance = 0) {
    ++frames_;
    send(bus::frame(parameters_.can_base, message, instance));
  }
  /// A node that only repeats a recording has nothing wired, and sends the page without its content.
  template <class Send>
  [[gnu::cold, gnu::noinline]] void put_wired_page(std::uint32_t page, const LoopHealth& l, Send& send) {
    ++frames_;
    base::CanFrame frame{.id = parameters_.can_base + EstDiagLoop::kOffset, .size = EstDiagLoop::kSize};
    frame.data[0] = static_cast<std::uint8_t>(page);
    if (l.pages != nullptr) frame.data = (*l.pages)[page - kPages];
    send(frame);
  }
  /// Pages of Est_Diag of every node, and of one with wired sensors; the page that names these.
  static constexpr std::uint32_t kPages = 9, kAllPages = 12, kWiredPage = 10;
  [[nodiscard]] bool every(std::int32_t ticks, std::int32_t phase = 0) const { return one_of(epoch_, ticks, phase); }
  /// Phase of what is to be of one epoch: attitude, velocity, sigmas, pages of the primary estimator.
  static constexpr std::int32_t kTogether = 2;
  /// n / 1000 for n below 2^41, in two divisions of 32 bits: a core of 32 bits has no other.
  [[nodiscard]] static constexpr std::uint32_t thousandth(std::uint64_t n) {
    const auto high = static_cast<std::uint32_t>(n >> 16), low = static_cast<std::uint32_t>(n & 0xFFFF);
    return (high / 1000 << 16) + ((high % 1000 << 16) + low) / 1000;
  }
  /// A coordinate in steps of the bus; not available rather than at the signal's end.
  [[nodiscard]] static std::int32_t millimetres(const base::Anchored& a) {
    constexpr std::int64_t kMost_um = 134'217'727'000;
    const std::int64_t um = a.um();
    if (um > kMost_um || um < -kMost_um) return std::numeric_limits<std::int32_t>::min();
    const auto rounded = static_cast<std::uint64_t>((um < 0 ? -um : um) + 500);
    const std::uint32_t mm = thousandth(rounded);
    return um < 0 ? -static_cast<std::int32_t>(mm) : static_cast<std::int32_t>(mm);
  }
  [[nodiscard]] std::uint8_t tag() const { return static_cast<std::uint8_t>(epoch_ & 0x0F); }

  const param::Parameters& parameters_;
  Version version_;
  std::uint32_t config_ = 0;
  std::uint32_t epoch_ = 0;
  std::uint32_t frames_ = 0;
  base::Micros now_;
  std::uint32_t status_counter_ = 0;
  std::uint32_t page_ = 0;
  std::uint32_t identity_ = 0;
  std::uint32_t statistic_ = 0;
  EventQueue events_;
  FaultHold troubles_;
};

template <std::size_t N>
template <class Send>
void Publisher<N>::estimate(std::size_t instance, sensor::EstimatorKind kind, bool primary,
                            const estimators::Estimate& e, const estimators::MotionVariance& motion, Send& send) {
  const param::PublishParameters& p = parameters_.publish;
  if (every(primary ? p.pose_every : p.side_every, side_phase(instance))) {
    put(bus::EstPos{.x_raw = millimetres(e.pose.x), .y_raw = millimetres(e.pose.y), .epoch = tag(), .kind = kind}, send,
        instance);
    put(bus::EstMotion{.yaw_rad = e.pose.yaw_rad,
                       .speed_mps = e.forward_mps,
                       .yaw_rate_radps = e.yaw_rate_radps,
                       .epoch = tag(),
                       .pos_valid = e.position_valid,
                       .hdg_valid = e.heading_valid,
                       .vel_valid = e.velocity_valid},
        send, instance);
  }
  if (publishes_sigma(instance, primary)) {
    const float x = base::sqrt(e.p(0, 0));
    const float y = base::sqrt(e.p(1, 1));
    const float yaw = base::sqrt(e.p(2, 2));
    put(bus::EstStdPose{.epoch = tag(), .std_x_m = x, .std_y_m = y, .std_yaw_rad = yaw, .corr_xy = e.p(0, 1) / (x * y)},
        send, instance);
    put(bus::EstStdMore{.epoch = tag(),
                        .corr_x_yaw = e.p(0, 2) / (x * yaw),
                        .corr_y_yaw = e.p(1, 2) / (y * yaw),
                        .std_speed_mps = base::sqrt(motion.forward_m2ps2),
                        .std_yaw_rate_radps = base::sqrt(motion.yaw_rate_rad2ps2)},
        send, instance);
  }
}

/// Attitude and velocity, and the pages of the state, one at a time. A page goes out in an epoch that has these and
/// Est_Std too (param/limits.hpp). A robot that turns and accelerates is to be judged by the covariance of its own
/// time.
template <std::size_t N>
template <class Inertial, class Sources, class Send>
void Publisher<N>::inertial(std::size_t instance, Inertial&& inertial, Sources&& sources, Send& send) {
  const bool motion = every(parameters_.publish.attitude_every, kTogether);
  const bool page = every(parameters_.publish.state_every, kTogether);
  if (!motion && !page) return;
  // By the epoch, not by the number of pages sent: the same in every run, whenever its filter began.
  const std::uint32_t turn = (epoch_ + kTogether) / static_cast<std::uint32_t>(parameters_.publish.state_every);
  const auto put_here = [&](const auto& message) { put(message, send, instance); };
  if (page && is_turn_of_sources(turn)) put_sources(sources(), tag(), put_here);  // also while there is no estimate
  const estimators::InertialEstimate e = inertial();
  if (!e.valid) return;
  const nav::InsState& x = e.state;
  if (motion) {
    put(bus::EstAtt{.w = x.q_nb.w, .x = x.q_nb.x, .y = x.q_nb.y, .z = x.q_nb.z, .epoch = tag()}, send, instance);
    put(bus::EstVel{.east_mps = x.v_n_mps(0), .north_mps = x.v_n_mps(1), .up_mps = x.v_n_mps(2), .epoch = tag()}, send,
        instance);
  }
  if (page) put_state_page(turn, e, tag(), put_here);
}

/// Attitude, and how far it is from the primary estimator's.
template <std::size_t N>
template <class Attitude, class Send>
void Publisher<N>::attitude(std::size_t instance, Attitude&& attitude, const estimators::Disagreement& from_primary,
                            Send& send) {
  const param::PublishParameters& p = parameters_.publish;
  const bool published = every(p.attitude_every, 7), compared = every(p.side_every, kCompared);
  if (!published && !compared) return;
  const estimators::AttitudeEstimate e = attitude();
  if (!e.valid) return;
  if (published)
    put(bus::EstAtt{.w = e.q_nb.w, .x = e.q_nb.x, .y = e.q_nb.y, .z = e.q_nb.z, .epoch = tag()}, send, instance);
  if (compared)
    put(
        bus::EstStateDisagreement{
            .epoch = tag(), .disagree_tilt_rad = from_primary.tilt_rad, .disagree_yaw_rad = from_primary.heading_rad},
        send, instance);
}

template <std::size_t N>
template <estimators::SeesImages Estimator, class Send>
void Publisher<N>::visual(std::size_t instance, const Estimator& estimator, const estimators::Context& ctx,
                          Send& send) {
  const auto most = [](std::uint32_t n) { return static_cast<std::uint8_t>(std::min<std::uint32_t>(n, 63)); };
  if (const auto report = estimator.new_report())
    put(bus::EstVisual{.epoch = tag(),
                       .seq = report->number,
                       .used = most(report->used),
                       .gated = most(report->gated),
                       .no_depth = most(report->no_depth),
                       .left = most(report->left),
                       .nis = report->nis,
                       .direction_y_rad = report->direction_y_rad,
                       .direction_z_rad = report->direction_z_rad},
        send);
  if (!every(parameters_.publish.state_every, kTogether)) return;
  const estimators::Height height = estimator.height(ctx);
  put(bus::EstStateHeight{.epoch = tag(), .height_m = height.height_m, .std_height_m = height.sigma_m}, send, instance);
}

template <std::size_t N>
template <estimators::MakesMap Estimator, class Send>
void Publisher<N>::own_map(const Estimator& estimator, Send& send) {
  const bool page = every(8 * parameters_.publish.diagnostics_every, 9);
  const bool landmark = every(parameters_.mapping.publish_every, 4);
  if (!page && !landmark && !estimators::MapsKeyframes<Estimator>) return;
  const estimators::MapReport map = estimator.own_map();
  if (page)
    put(bus::EstDiagMapper{.map_size = static_cast<std::uint16_t>(std::min<std::uint32_t>(map.size, 0xFFFF)),
                           .map_refused = static_cast<std::uint16_t>(map.refused & 0x7FFU),
                           .ambiguous = static_cast<std::uint16_t>(map.ambiguous & 0x7FFU),
                           .work_left = static_cast<std::uint16_t>(std::min<std::uint32_t>(map.work_left, 0xFFFF)),
                           .jobs_aborted = static_cast<std::uint8_t>(map.jobs_aborted)},
        send);
  if constexpr (estimators::MapsKeyframes<Estimator>) put_graph(estimator, map.size, send);
  if constexpr (estimators::MapsLandmarks<Estimator>) {
    if (landmark && map.size > 0) put_landmark(estimator, map.size, send);
  }
}

template <std::size_t N>
template <estimators::MapsLandmarks Estimator, class Send>
void Publisher<N>::put_landmark(const Estimator& estimator, std::uint32_t size, Send& send) {
  const auto turn = epoch_ / static_cast<std::uint32_t>(parameters_.mapping.publish_every);
  const estimators::MappedLandmark m = estimator.own_landmark(turn % size);
  put(bus::EstLandmark{.id = m.id, .x_raw = millimetres(m.place.x), .y_raw = millimetres(m.place.y)}, send);
  const float x = base::sqrt(m.xx_m2), y = base::sqrt(m.yy_m2);
  put(bus::EstLandmarkStd{.id = m.id,
                          .std_x_m = x,
                          .std_y_m = y,
                          .corr_xy = m.xy_m2 / (x * y),
                          .hits = static_cast<std::uint8_t>(m.hits < 255 ? m.hits : 255),
                          .age_s = static_cast<std::uint8_t>(m.age.us < 255'000'000 ? m.age.us / 1'000'000 : 255),
                          .state = m.confirmed ? bus::LandmarkState::kKept : bus::LandmarkState::kTentative,
                          .epoch = tag()},
      send);
}

/// New keyframes at once, those of the graph in turn, and the graph's state.
template <std::size_t N>
template <estimators::MapsKeyframes Estimator, class Send>
void Publisher<N>::put_graph(const Estimator& estimator, std::uint32_t size, Send& send) {
  estimator.new_keyframes([&](const estimators::NewKeyframe& k) {
    put(bus::EstKeyframe{.id = static_cast<std::uint16_t>(k.id & kKeyframeIds),
                         .stamp_us = static_cast<std::uint32_t>(static_cast<std::uint64_t>(k.stamp.us) & 0xFFFFF),
                         .step_x_m = k.step_x_m,
                         .step_y_m = k.step_y_m},
        send);
  });
  if (every(parameters_.mapping.publish_every, 4) && size > 0) {
    const auto turn = epoch_ / static_cast<std::uint32_t>(parameters_.mapping.publish_every);
    const estimators::GraphKeyframe k = estimator.own_keyframe(turn % size);
    put(bus::EstKeyframePose{.id = static_cast<std::uint16_t>(k.id & kKeyframeIds),
                             .x_m = k.pose.x.minus({}),
                             .y_m = k.pose.y.minus({}),
                             .yaw_rad = k.pose.yaw_rad},
        send);
  }
  if (!every(parameters_.publish.diagnostics_every, 10)) return;
  const estimators::GraphReport g = estimator.graph();
  const double steps = g.chi2 / bus::EstGraph::kChi2Scale;
  const bool shown = g.end != estimators::GraphEnd::kNone && steps < 1e12;  // false for NaN
  put(bus::EstGraph{.chi2_raw = shown ? static_cast<std::uint64_t>((static_cast<std::int64_t>(2 * steps) + 1) / 2)
                                      : bus::EstGraph::kChi2NotAvailable,
                    .status = static_cast<bus::GraphStatus>(g.end),
                    .closures = static_cast<std::uint16_t>(std::min<std::uint32_t>(g.closures, 8191)),
                    .jobs = static_cast<std::uint8_t>(g.jobs)},
      send);
}

template <std::size_t N>
template <class GiveSummary, class Send>
void Publisher<N>::status(GiveSummary&& summary, const LoopHealth& loop, Send& send) {
  if (!every(parameters_.publish.status_every, 1)) return;
  const Summary s = summary();
  FaultSet faults = troubles_.faults(epoch_);
  faults.bits = static_cast<std::uint16_t>(faults.bits | s.faults);
  faults.raise(sensor::Fault::kInputStale, !s.velocity_valid);
  faults.raise(sensor::Fault::kRejecting, s.rejecting);
  faults.raise(sensor::Fault::kRestarted, s.restarted);
  faults.raise(sensor::Fault::kIdConflict, loop.id_conflict);
  put(bus::protect(bus::EstStatus{.ctr = static_cast<std::uint8_t>(status_counter_++ & 0x0F),
                                  .mode = s.mode,
                                  .pos_valid = s.position_valid,
                                  .hdg_valid = s.heading_valid,
                                  .vel_valid = s.velocity_valid,
                                  .origin = s.origin_known,
                                  .used = s.used,
                                  .faults = faults.bits,
                                  .reset_ctr = s.resets,
                                  .reset_cause = s.cause,
                                  .unlogged = loop.unlogged,
                                  .map_faults = s.map_faults}),
      send);
}

/// One active sensor of one estimator at a time.
template <std::size_t N>
template <class Slots, class Send>
void Publisher<N>::statistics(const Slots& slots, base::Micros now, Send& send) {
  if (!every(parameters_.publish.statistics_every, 5)) return;
  for (std::size_t tried = 0; tried < estimators::kStatistics * N; ++tried) {
    const std::size_t index = statistic_++ % (estimators::kStatistics * N);
    const std::size_t estimator = index / estimators::kStatistics;
    const estimators::SensorStatistics* stat = nullptr;
    std::size_t slot_index = 0;
    std::apply(
        [&](const auto&... slot) {
          ((slot_index++ == estimator ? void(stat = &slot.statistics()[index % estimators::kStatistics]) : void()),
           ...);
        },
        slots);
    if (stat == nullptr || (stat->accepted == 0 && stat->rejected == 0)) continue;
    const float age_s = base::seconds(now - stat->last_accepted);
    put(bus::EstSensorStat{.sensor = stat->sensor,
                           .inst = stat->instance,
                           .estimator = static_cast<std::uint8_t>(estimator),
                           .accepted = stat->accepted,
                           .rejected = static_cast<std::uint16_t>(stat->rejected & 0xFFFU),
                           .nis_mean = stat->compared ? stat->nis_mean : base::kNan,
                           .age_s = stat->accepted > 0 ? age_s : base::kNan,
                           .epoch = tag()},
        send);
    return;
  }
}

/// One page at a time; all of them within about a second.
template <std::size_t N>
template <class Send>
void Publisher<N>::diagnostics(const Counters& c, const LoopHealth& l, std::uint16_t timeline_high, Send& send) {
  troubles_.note(c, epoch_, static_cast<std::uint32_t>(1'000'000 / parameters_.loop.period_us));
  if (!every(parameters_.publish.diagnostics_every, 3)) return;
  const std::uint32_t page = page_++ % (parameters_.wired.any() ? kAllPages : kPages);
  if (page < kPages)
    return put_diagnostics(page, c, l, timeline_high, [&](const auto& message) { put(message, send); });
  put_wired_page(page, l, send);
}

/// Apart from the other pages, whose cycle a refusal does not lengthen: each about once a second.
template <std::size_t N>
template <class Send, class GuardPage>
void Publisher<N>::refusals(const Counters& c, const LoopHealth& l, GuardPage&& guard_page, Send& send) {
  const std::int32_t period = 8 * parameters_.publish.diagnostics_every;
  if (every(period, 6)) put(limits_page(c, l), send);
  // A node without guards and tags sends the page, too: a node with them repeats its recording frame by frame.
  if (!every(period, 54)) return;
  if constexpr (requires { guard_page(); }) {
    put(guard_page(), send);
  } else {
    put(EstDiagGuard{}, send);
  }
}

template <std::size_t N>
template <class Likeliest, class Send>
[[gnu::cold]] void Publisher<N>::identity(const estimators::MapFrame& map_frame, Likeliest&& likeliest, Send& send) {
  if (!every(parameters_.publish.identity_every, 7)) return;
  constexpr bool kHasFaults = requires { likeliest(); };
  switch (identity_++ % (kHasFaults ? 5 : 4)) {
    case 0:
      send_version(send);
      break;
    case 1:
      put(bus::EstOriginLat{.source = map_frame.origin, .lat_raw = map_frame.frame.latitude_2ndeg()}, send);
      break;
    case 2:
      put(bus::EstOriginLon{.source = map_frame.origin, .lon_raw = map_frame.frame.longitude_2ndeg()}, send);
      break;
    case 4:
      if constexpr (kHasFaults) put(fault_page(likeliest(), map_frame.origin, tag()), send);
      break;
    default:
      put(bus::EstOriginHeight{.source = map_frame.origin, .height_m = map_frame.frame.height_m()}, send);
      break;
  }
}

template <std::size_t N>
template <class Send>
void Publisher<N>::events(Send& send) {
  if (events_.empty() || !every(parameters_.publish.event_every)) return;
  bus::EstInnov event = events_.take(parameters_.loop.period_us);
  event.epoch = tag();
  put(event, send);
}

}  // namespace tetap::bus
