// SPDX-License-Identifier: Apache-2.0
// From estimates, records and counters to frames: what goes out in which epoch. The schedule is counted in epochs, so
// it is the same in every replay.
#pragma once

#include "app/estimate.hpp"
#include "app/health.hpp"
#include "app/lane.hpp"
#include "app/sample.hpp"
#include "base/bit_crc.hpp"
#include "base/math.hpp"
#include "can/codec.hpp"
#include "can/e2e.hpp"

#include <array>
#include <cstddef>
#include <cstdint>

namespace tetap::app {

/// What ran: the first 32 bits of the commit, and the CRC-32 of all numbers.
struct Version {
  std::uint32_t git = 0;
};

/// Input frames consumed: how many, and a CRC-32 over them. Within an epoch the order of arrival leaves no trace: the
/// frames' own CRCs are summed, and the sum goes into the running CRC.
class InputTally {
 public:
  constexpr void add(std::uint32_t frame_crc) {
    sum_ += frame_crc;
    ++in_epoch_;
    ++count_;
  }
  constexpr void close_epoch() {
    base::BitCrc crc(running_);
    crc(sum_);
    crc(in_epoch_);
    running_ = crc.value();
    sum_ = in_epoch_ = 0;
  }
  [[nodiscard]] constexpr std::uint32_t count() const { return count_; }
  [[nodiscard]] constexpr std::uint32_t running() const { return running_; }

 private:
  std::uint32_t running_ = 0;
  std::uint32_t sum_ = 0;
  std::uint32_t in_epoch_ = 0;
  std::uint32_t count_ = 0;
};

/// What Est_Status says.
struct Summary {
  can::Mode mode = can::Mode::kBoot;
  bool position_valid = false;
  bool heading_valid = false;
  bool velocity_valid = false;
  bool origin_known = false;
  std::uint16_t used = 0;  ///< a bit per sensor kind accepted within the last second
  bool rejecting = false;
  std::uint8_t resets = 0;
  can::ResetCause cause = can::ResetCause::kPowerOn;
  bool restarted = false;  ///< within the last second, by ourselves
};

template <std::size_t EstimatorCount>
class Publisher {
 public:
  Publisher(const Numbers& numbers, const Version& version) : numbers_(numbers), version_(version) {
    base::BitCrc crc;
    each_number(numbers, crc);
    config_ = crc.value();
  }

  void power_on() {
    epoch_ = 0;
    frames_ = status_counter_ = page_ = identity_ = statistic_ = state_page_ = 0;
    events_.size = 0;
    last_second_ = {};
    troubled_until_ = 0;
    troubles_ = 0;
  }

  /// First frame of the epoch.
  template <class Send>
  void begin(base::Micros now, const InputTally& tally, Send& send) {
    ++epoch_;
    frames_ = 0;
    now_ = now;
    put(can::EstEpoch{.time_us = static_cast<std::uint64_t>(now.us) & 0xFFFFFFFFFFFFU,
                      .in_crc = static_cast<std::uint16_t>(tally.running())},
        send);
  }

  /// Last frame of the epoch.
  template <class Send>
  void end(std::uint32_t state_crc, const InputTally& tally, Send& send) {
    put(can::EstStateCrc{.crc = state_crc,
                         .in_count = static_cast<std::uint16_t>(tally.count()),
                         .epoch = static_cast<std::uint8_t>(epoch_),
                         .frames = static_cast<std::uint8_t>(frames_ + 1)},
        send);
  }

  template <class Send>
  void estimate(std::size_t instance, can::EstimatorKind kind, bool primary, const Estimate& e, Send& send);
  template <class Send>
  void inertial(std::size_t instance, const InertialEstimate& e, Send& send);
  template <class Send>
  void status(const Summary& summary, Send& send);
  template <class Lanes, class Send>
  void statistics(const Lanes& lanes, base::Micros now, Send& send);
  template <class Send>
  void diagnostics(const Counters& counters, const LoopHealth& loop, std::uint16_t timeline_high, Send& send);
  template <class Send>
  void identity(const Site& site, Send& send);
  template <class Send>
  void events(Send& send);
  template <class Send>
  void send_version(Send& send) {
    put(can::EstVersion{.git = version_.git, .config = config_}, send);
  }

  /// Queues the record of a measurement. When the queue is full an accepted one makes room for one that was not.
  void event(const Innovation& innovation, const Sample& sample, std::size_t instance, base::Micros now,
             Counters& counters);

 private:
  struct Events {
    std::array<can::EstInnov, 16> queue{};
    std::size_t size = 0;
  };

  template <class Message, class Send>
  void put(const Message& message, Send& send, std::size_t instance = 0) {
    ++frames_;
    send(can::frame(numbers_.can_base, message, instance));
  }
  [[nodiscard]] bool every(std::int32_t ticks, std::int32_t phase = 0) const {
    return ticks > 0 && (epoch_ + static_cast<std::uint32_t>(phase)) % static_cast<std::uint32_t>(ticks) == 0;
  }
  [[nodiscard]] std::uint8_t tag() const { return static_cast<std::uint8_t>(epoch_ & 0x0F); }
  void note_troubles(const Counters& counters);

  const Numbers& numbers_;
  Version version_;
  std::uint32_t config_ = 0;
  std::uint32_t epoch_ = 0;
  std::uint32_t frames_ = 0;
  base::Micros now_;
  std::uint32_t status_counter_ = 0;
  std::uint32_t page_ = 0;
  std::uint32_t identity_ = 0;
  std::uint32_t statistic_ = 0;
  std::uint32_t state_page_ = 0;
  Events events_;
  Counters last_second_;              ///< the counters one to two seconds ago
  std::uint32_t troubled_until_ = 0;  ///< epoch
  std::uint16_t troubles_ = 0;        ///< fault bits raised since
};

template <std::size_t N>
template <class Send>
void Publisher<N>::estimate(std::size_t instance, can::EstimatorKind kind, bool primary, const Estimate& e,
                            Send& send) {
  const PublishNumbers& p = numbers_.publish;
  const auto side = static_cast<std::int32_t>(3 * instance);  // spreads the estimators' slow frames over the epochs
  const auto millimetres = [](const base::Anchored& a) {
    const std::int64_t um = a.um();
    return static_cast<std::int32_t>((um + (um < 0 ? -500 : 500)) / 1000);
  };
  if (every(primary ? p.pose_every : p.side_every, side)) {
    put(can::EstPos{.x_raw = millimetres(e.pose.x), .y_raw = millimetres(e.pose.y), .epoch = tag(), .kind = kind}, send,
        instance);
    put(can::EstMotion{.yaw_rad = e.pose.yaw_rad,
                       .speed_mps = e.forward_mps,
                       .yaw_rate_radps = e.yaw_rate_radps,
                       .epoch = tag(),
                       .pos_valid = e.position_valid,
                       .hdg_valid = e.heading_valid,
                       .vel_valid = e.velocity_valid},
        send, instance);
  }
  if (every(primary ? p.std_every : p.side_every, side)) {
    const float x = base::sqrt(e.p(0, 0));
    const float y = base::sqrt(e.p(1, 1));
    const float yaw = base::sqrt(e.p(2, 2));
    put(can::EstStdPose{.epoch = tag(), .std_x_m = x, .std_y_m = y, .std_yaw_rad = yaw, .corr_xy = e.p(0, 1) / (x * y)},
        send, instance);
    put(can::EstStdMore{.epoch = tag(),
                        .corr_x_yaw = e.p(0, 2) / (x * yaw),
                        .corr_y_yaw = e.p(1, 2) / (y * yaw),
                        .std_speed_mps = base::kNan,
                        .std_yaw_rate_radps = base::kNan},
        send, instance);
  }
}

/// Attitude and velocity; of the rest one page at a time.
template <std::size_t N>
template <class Send>
void Publisher<N>::inertial(std::size_t instance, const InertialEstimate& e, Send& send) {
  if (!e.valid) return;
  const nav::InsState& x = e.state;
  const auto std = [&e](int i) { return base::sqrt(e.p(i, i)); };
  if (every(numbers_.publish.attitude_every, 2)) {
    put(can::EstAtt{.w = x.q_nb.w, .x = x.q_nb.x, .y = x.q_nb.y, .z = x.q_nb.z, .epoch = tag()}, send, instance);
    put(can::EstVel{.east_mps = x.v_n_mps(0), .north_mps = x.v_n_mps(1), .up_mps = x.v_n_mps(2), .epoch = tag()}, send,
        instance);
  }
  if (!every(numbers_.publish.state_every, 4)) return;
  switch (state_page_++ % 7) {
    case 0:
      put(can::EstStateHeight{.epoch = tag(), .height_m = base::metres(x.z.um()), .std_height_m = std(2)}, send,
          instance);
      break;
    case 1:
      put(can::EstStateAccBias{.epoch = tag(),
                               .acc_bias_x_mps2 = x.b_a_mps2(0),
                               .acc_bias_y_mps2 = x.b_a_mps2(1),
                               .acc_bias_z_mps2 = x.b_a_mps2(2)},
          send, instance);
      break;
    case 2:
      put(can::EstStateGyroBias{.epoch = tag(),
                                .gyro_bias_x_radps = x.b_g_radps(0),
                                .gyro_bias_y_radps = x.b_g_radps(1),
                                .gyro_bias_z_radps = x.b_g_radps(2)},
          send, instance);
      break;
    case 3:
      put(
          can::EstStateStdVel{
              .epoch = tag(), .std_vel_east_mps = std(3), .std_vel_north_mps = std(4), .std_vel_up_mps = std(5)},
          send, instance);
      break;
    case 4:
      put(can::EstStateStdTilt{.epoch = tag(), .std_tilt_east_rad = std(6), .std_tilt_north_rad = std(7)}, send,
          instance);
      break;
    case 5:
      put(can::EstStateStdAccBias{.epoch = tag(),
                                  .std_acc_bias_x_mps2 = std(9),
                                  .std_acc_bias_y_mps2 = std(10),
                                  .std_acc_bias_z_mps2 = std(11)},
          send, instance);
      break;
    default:
      put(can::EstStateStdGyroBias{.epoch = tag(),
                                   .std_gyro_bias_x_radps = std(12),
                                   .std_gyro_bias_y_radps = std(13),
                                   .std_gyro_bias_z_radps = std(14)},
          send, instance);
      break;
  }
}

template <std::size_t N>
template <class Send>
void Publisher<N>::status(const Summary& s, Send& send) {
  if (!every(numbers_.publish.status_every, 1)) return;
  std::uint16_t faults = epoch_ < troubled_until_ ? troubles_ : std::uint16_t{0};
  const auto raise = [&faults](can::Fault fault, bool is) {
    faults = static_cast<std::uint16_t>(faults | (is ? 1U << static_cast<unsigned>(fault) : 0U));
  };
  raise(can::Fault::kInputStale, !s.velocity_valid);
  raise(can::Fault::kRejecting, s.rejecting);
  raise(can::Fault::kRestarted, s.restarted);
  put(can::protect(can::EstStatus{.ctr = static_cast<std::uint8_t>(status_counter_++ & 0x0F),
                                  .mode = s.mode,
                                  .pos_valid = s.position_valid,
                                  .hdg_valid = s.heading_valid,
                                  .vel_valid = s.velocity_valid,
                                  .origin = s.origin_known,
                                  .used = s.used,
                                  .faults = faults,
                                  .reset_ctr = s.resets,
                                  .reset_cause = s.cause}),
      send);
}

/// One active sensor of one estimator at a time.
template <std::size_t N>
template <class Lanes, class Send>
void Publisher<N>::statistics(const Lanes& lanes, base::Micros now, Send& send) {
  if (!every(numbers_.publish.statistics_every, 5)) return;
  for (std::size_t tried = 0; tried < kStatistics * N; ++tried) {
    const std::size_t index = statistic_++ % (kStatistics * N);
    const std::size_t estimator = index / kStatistics;
    const SensorStatistics* stat = nullptr;
    std::size_t lane_index = 0;
    std::apply(
        [&](const auto&... lane) {
          ((lane_index++ == estimator ? void(stat = &lane.statistics()[index % kStatistics]) : void()), ...);
        },
        lanes);
    if (stat == nullptr || (stat->accepted == 0 && stat->rejected == 0)) continue;
    const float age_s = base::seconds(now - stat->last_accepted);
    put(can::EstSensorStat{.sensor = stat->sensor,
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

template <std::size_t N>
void Publisher<N>::note_troubles(const Counters& now) {
  const Counters& then = last_second_;
  std::uint16_t raised = 0;
  const auto raise = [&raised](can::Fault fault, bool is) {
    raised = static_cast<std::uint16_t>(raised | (is ? 1U << static_cast<unsigned>(fault) : 0U));
  };
  raise(can::Fault::kIncomplete, now.incomplete != then.incomplete);
  raise(can::Fault::kTooLate, now.too_late != then.too_late);
  raise(can::Fault::kMalformed, now.malformed != then.malformed || now.out_of_range != then.out_of_range ||
                                    now.no_time != then.no_time || now.too_early != then.too_early);
  raise(can::Fault::kCapacity, now.map_full != then.map_full || now.timeline_full != then.timeline_full ||
                                   now.events_dropped != then.events_dropped);
  raise(can::Fault::kCommandRefused, now.command_refused != then.command_refused);
  if (raised != 0) {
    const std::uint32_t second = static_cast<std::uint32_t>(1'000'000 / numbers_.loop.period_us);
    troubles_ = epoch_ < troubled_until_ ? static_cast<std::uint16_t>(troubles_ | raised) : raised;
    troubled_until_ = epoch_ + second;
  }
  last_second_ = now;
}

/// One page at a time; all eight within about a second.
template <std::size_t N>
template <class Send>
void Publisher<N>::diagnostics(const Counters& c, const LoopHealth& l, std::uint16_t timeline_high, Send& send) {
  note_troubles(c);
  if (!every(numbers_.publish.diagnostics_every, 3)) return;
  constexpr std::uint32_t kLongest = 0xFFFFFE;
  switch (page_++ % 8) {
    case 0:
      put(can::EstDiagLoop{.loop_max_us = l.longest_us < kLongest ? l.longest_us : kLongest,
                           .loop_mean_us = static_cast<std::uint16_t>(l.mean_us < 65534.0F ? l.mean_us : 65534.0F),
                           .sync = l.sync},
          send);
      break;
    case 1:
      put(can::EstDiagTicks{.ticks_late = l.ticks_late, .sync_lost = l.sync_lost, .sync_back = l.sync_back}, send);
      break;
    case 2:
      put(
          can::EstDiagQueues{
              .timeline_high = timeline_high, .events_high = c.events_high_water, .events_dropped = c.events_dropped},
          send);
      break;
    case 3:
      put(can::EstDiagOrder{.too_late = c.too_late, .too_early = c.too_early, .duplicate = c.duplicate}, send);
      break;
    case 4:
      put(can::EstDiagFrames{.incomplete = c.incomplete, .malformed = c.malformed, .out_of_range = c.out_of_range},
          send);
      break;
    case 5:
      put(can::EstDiagBus{.rx_overflow = static_cast<std::uint16_t>(l.bus.rx_overflow),
                          .tx_full = static_cast<std::uint16_t>(l.bus.tx_full),
                          .bus_off = static_cast<std::uint16_t>(l.bus.bus_off)},
          send);
      break;
    case 6:
      put(can::EstDiagRefused{.not_used = c.not_used, .no_time = c.no_time, .cmd_refused = c.command_refused}, send);
      break;
    default:
      put(can::EstDiagCapacity{.map_full = c.map_full, .sync_jump = l.sync_jump, .timeline_full = c.timeline_full},
          send);
      break;
  }
}

template <std::size_t N>
template <class Send>
void Publisher<N>::identity(const Site& site, Send& send) {
  if (!every(numbers_.publish.identity_every, 7)) return;
  switch (identity_++ % 4) {
    case 0:
      send_version(send);
      break;
    case 1:
      put(can::EstOriginLat{.source = site.origin, .lat_raw = site.frame.latitude_2ndeg()}, send);
      break;
    case 2:
      put(can::EstOriginLon{.source = site.origin, .lon_raw = site.frame.longitude_2ndeg()}, send);
      break;
    default:
      put(can::EstOriginHeight{.source = site.origin, .height_m = site.frame.height_m()}, send);
      break;
  }
}

template <std::size_t N>
void Publisher<N>::event(const Innovation& innovation, const Sample& sample, std::size_t instance, base::Micros now,
                         Counters& counters) {
  const can::EstInnov message{.estimator = static_cast<std::uint8_t>(instance),
                              .sensor = sample.sensor,
                              .inst = sample.instance,
                              .verdict = innovation.verdict,
                              .dof = innovation.dof,
                              .age_ms = static_cast<float>(base::seconds(now - sample.stamp) * 1000.0F),
                              .nis = innovation.dof > 0 ? innovation.nis : base::kNan,
                              .ratio = innovation.gate > 0.0F ? innovation.nis / innovation.gate : base::kNan,
                              .id = innovation.landmark,
                              .epoch = 0};
  if (events_.size == events_.queue.size()) {
    ++counters.events_dropped;
    if (innovation.verdict == can::Verdict::kAccepted) return;
    std::size_t victim = 0;
    while (victim < events_.size && events_.queue[victim].verdict != can::Verdict::kAccepted) ++victim;
    if (victim == events_.size) return;
    for (std::size_t i = victim + 1; i < events_.size; ++i) events_.queue[i - 1] = events_.queue[i];
    --events_.size;
  }
  events_.queue[events_.size++] = message;
  if (events_.size > counters.events_high_water) counters.events_high_water = static_cast<std::uint16_t>(events_.size);
}

template <std::size_t N>
template <class Send>
void Publisher<N>::events(Send& send) {
  if (events_.size == 0 || !every(numbers_.publish.event_every)) return;
  events_.queue[0].epoch = tag();
  put(events_.queue[0], send);
  for (std::size_t i = 1; i < events_.size; ++i) events_.queue[i - 1] = events_.queue[i];
  --events_.size;
}

}  // namespace tetap::app
