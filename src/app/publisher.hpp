// SPDX-License-Identifier: Apache-2.0
// From estimates, records and counters to frames: what goes out in which epoch. The schedule is counted in epochs, so
// it is the same in every replay.
#pragma once

#include "app/disagreement.hpp"
#include "app/estimate.hpp"
#include "app/event_queue.hpp"
#include "app/health.hpp"
#include "app/lane.hpp"
#include "app/pages.hpp"
#include "app/sample.hpp"
#include "app/tally.hpp"
#include "app/troubles.hpp"
#include "base/bit_crc.hpp"
#include "base/math.hpp"
#include "can/codec.hpp"
#include "can/e2e.hpp"

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

namespace tetap::app {

/// What ran: the first 32 bits of the commit.
struct Version {
  std::uint32_t git = 0;
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
  std::uint16_t faults = 0;  ///< bits of can::Fault that estimators see
  std::uint8_t resets = 0;
  can::ResetCause cause = can::ResetCause::kPowerOn;
  bool restarted = false;  ///< within the last second, by ourselves
};

template <std::size_t EstimatorCount>
class Publisher {
  /// At start only, of more than a hundred numbers: small, not fast.
  struct NumbersCrc {
    base::BitCrc crc;
    [[gnu::noinline]] void operator()(std::uint32_t word) { crc(word); }
    void operator()(std::int32_t word) { (*this)(static_cast<std::uint32_t>(word)); }
    void operator()(float number) { (*this)(std::bit_cast<std::uint32_t>(number)); }
    void operator()(std::int64_t word) {
      (*this)(static_cast<std::uint32_t>(static_cast<std::uint64_t>(word)));
      (*this)(static_cast<std::uint32_t>(static_cast<std::uint64_t>(word) >> 32));
    }
  };

 public:
  Publisher(const Numbers& numbers, const Version& version) : numbers_(numbers), version_(version) {
    NumbersCrc crc;
    each_number(numbers, crc);
    config_ = crc.crc.value();
  }

  void power_on() {
    epoch_ = 0;
    frames_ = status_counter_ = page_ = identity_ = statistic_ = 0;
    events_.power_on();
    troubles_.power_on();
  }

  /// What is noted until end() comes in the order of the samples, and not of their arrival.
  void tick_begins() { events_.tick_begins(); }
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
    events_.tick_ends();
  }

  /// This estimator's 1 sigma go out in this epoch: the motion's variance is needed then.
  [[nodiscard]] bool says_sigma(std::size_t instance, bool primary) const {
    const PublishNumbers& p = numbers_.publish;
    return primary ? every(p.std_every, kTogether) : every(p.side_every, side(instance));
  }
  template <class Send>
  void estimate(std::size_t instance, can::EstimatorKind kind, bool primary, const Estimate& e,
                const MotionVariance& motion, Send& send);
  /// `inertial` gives the estimate when it is asked for.
  template <class Inertial, class Send>
  void inertial(std::size_t instance, Inertial&& inertial, Send& send);
  template <class Send>
  void attitude(std::size_t instance, const AttitudeEstimate& e, const Disagreement& from_primary, Send& send);
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

  /// Queues the record of a measurement.
  void event(const Innovation& innovation, const Sample& sample, std::size_t instance, base::Micros now,
             Counters& counters) {
    events_.add(innovation, sample, instance, now, counters);
  }

 private:
  template <class Message, class Send>
  void put(const Message& message, Send& send, std::size_t instance = 0) {
    ++frames_;
    send(can::frame(numbers_.can_base, message, instance));
  }
  [[nodiscard]] bool every(std::int32_t ticks, std::int32_t phase = 0) const {
    return ticks > 0 && (epoch_ + static_cast<std::uint32_t>(phase)) % static_cast<std::uint32_t>(ticks) == 0;
  }
  /// Phase of what is to be of one epoch: attitude, velocity, sigmas, pages of the primary estimator.
  static constexpr std::int32_t kTogether = 2;
  /// Spreads the estimators' slow frames over the epochs.
  [[nodiscard]] static std::int32_t side(std::size_t instance) { return static_cast<std::int32_t>(3 * instance); }
  [[nodiscard]] std::uint8_t tag() const { return static_cast<std::uint8_t>(epoch_ & 0x0F); }

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
  EventQueue events_;
  Troubles troubles_;
};

template <std::size_t N>
template <class Send>
void Publisher<N>::estimate(std::size_t instance, can::EstimatorKind kind, bool primary, const Estimate& e,
                            const MotionVariance& motion, Send& send) {
  const PublishNumbers& p = numbers_.publish;
  const auto millimetres = [](const base::Anchored& a) {
    const std::int64_t um = a.um();
    return static_cast<std::int32_t>((um + (um < 0 ? -500 : 500)) / 1000);
  };
  if (every(primary ? p.pose_every : p.side_every, side(instance))) {
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
  if (says_sigma(instance, primary)) {
    const float x = base::sqrt(e.p(0, 0));
    const float y = base::sqrt(e.p(1, 1));
    const float yaw = base::sqrt(e.p(2, 2));
    put(can::EstStdPose{.epoch = tag(), .std_x_m = x, .std_y_m = y, .std_yaw_rad = yaw, .corr_xy = e.p(0, 1) / (x * y)},
        send, instance);
    put(can::EstStdMore{.epoch = tag(),
                        .corr_x_yaw = e.p(0, 2) / (x * yaw),
                        .corr_y_yaw = e.p(1, 2) / (y * yaw),
                        .std_speed_mps = base::sqrt(motion.forward_m2ps2),
                        .std_yaw_rate_radps = base::sqrt(motion.yaw_rate_rad2ps2)},
        send, instance);
  }
}

/// Attitude and velocity; of the rest one page at a time, in an epoch that has these and Est_Std too (numbers_check):
/// what turns and accelerates is to be judged by the covariance of its own time.
template <std::size_t N>
template <class Inertial, class Send>
void Publisher<N>::inertial(std::size_t instance, Inertial&& inertial, Send& send) {
  const bool motion = every(numbers_.publish.attitude_every, kTogether);
  const bool page = every(numbers_.publish.state_every, kTogether);
  if (!motion && !page) return;
  const InertialEstimate e = inertial();
  if (!e.valid) return;
  const nav::InsState& x = e.state;
  if (motion) {
    put(can::EstAtt{.w = x.q_nb.w, .x = x.q_nb.x, .y = x.q_nb.y, .z = x.q_nb.z, .epoch = tag()}, send, instance);
    put(can::EstVel{.east_mps = x.v_n_mps(0), .north_mps = x.v_n_mps(1), .up_mps = x.v_n_mps(2), .epoch = tag()}, send,
        instance);
  }
  if (!page) return;
  // By the epoch, not by how often there was something to say: the same in every run, whenever its filter began.
  const std::uint32_t turn = (epoch_ + kTogether) / static_cast<std::uint32_t>(numbers_.publish.state_every);
  put_state_page(turn, e, tag(), [&](const auto& message) { put(message, send, instance); });
}

/// Attitude, and how far it is from the primary estimator's.
template <std::size_t N>
template <class Send>
void Publisher<N>::attitude(std::size_t instance, const AttitudeEstimate& e, const Disagreement& from_primary,
                            Send& send) {
  if (!e.valid) return;
  const PublishNumbers& p = numbers_.publish;
  if (every(p.attitude_every, 7))
    put(can::EstAtt{.w = e.q_nb.w, .x = e.q_nb.x, .y = e.q_nb.y, .z = e.q_nb.z, .epoch = tag()}, send, instance);
  if (every(p.side_every, 1))
    put(
        can::EstStateDisagreement{
            .epoch = tag(), .disagree_tilt_rad = from_primary.tilt_rad, .disagree_yaw_rad = from_primary.heading_rad},
        send, instance);
}

template <std::size_t N>
template <class Send>
void Publisher<N>::status(const Summary& s, Send& send) {
  if (!every(numbers_.publish.status_every, 1)) return;
  FaultSet faults = troubles_.faults(epoch_);
  faults.bits = static_cast<std::uint16_t>(faults.bits | s.faults);
  faults.raise(can::Fault::kInputStale, !s.velocity_valid);
  faults.raise(can::Fault::kRejecting, s.rejecting);
  faults.raise(can::Fault::kRestarted, s.restarted);
  put(can::protect(can::EstStatus{.ctr = static_cast<std::uint8_t>(status_counter_++ & 0x0F),
                                  .mode = s.mode,
                                  .pos_valid = s.position_valid,
                                  .hdg_valid = s.heading_valid,
                                  .vel_valid = s.velocity_valid,
                                  .origin = s.origin_known,
                                  .used = s.used,
                                  .faults = faults.bits,
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

/// One page at a time; all eight within about a second.
template <std::size_t N>
template <class Send>
void Publisher<N>::diagnostics(const Counters& c, const LoopHealth& l, std::uint16_t timeline_high, Send& send) {
  troubles_.note(c, epoch_, static_cast<std::uint32_t>(1'000'000 / numbers_.loop.period_us));
  if (!every(numbers_.publish.diagnostics_every, 3)) return;
  put_diagnostics(page_++, c, l, timeline_high, [&](const auto& page) { put(page, send); });
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
template <class Send>
void Publisher<N>::events(Send& send) {
  if (events_.empty() || !every(numbers_.publish.event_every)) return;
  can::EstInnov event = events_.take();
  event.epoch = tag();
  put(event, send);
}

}  // namespace tetap::app
