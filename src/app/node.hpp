// SPDX-License-Identifier: Apache-2.0
// The firmware without board and clock: frames and ticks in, frames out. The same sequence of on_frame() and tick()
// calls gives the same bits on every machine; everything that follows from real time stays outside (Pacer, LoopHealth).
#pragma once

#include "app/inbox.hpp"
#include "app/lane.hpp"
#include "app/publisher.hpp"
#include "app/timeline.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <tuple>
#include <type_traits>
#include <utility>

namespace tetap::app {

/// The estimators a robot runs, in the order of their output instances; the last is the one the status speaks of.
template <Estimator... E>
struct Estimators {
  static_assert(sizeof...(E) >= 1 && sizeof...(E) <= 4, "the bus has four output instances");
  using Lanes = std::tuple<Lane<E>...>;
  static constexpr std::size_t kCount = sizeof...(E);
};

template <class Estimators, std::size_t TimelineCapacity = 96>
class Node {
 public:
  Node(const Numbers& numbers, const Version& version) : numbers_(numbers), publisher_(numbers, version) {
    power_on(base::Micros{});
  }

  /// As after power-on, with the given time: what a Begin frame asks for.
  void power_on(base::Micros t);

  /// An input frame of this node's block (sync frames excepted).
  void on_frame(const base::CanFrame& frame);

  /// Consumes what was true until t, brings every estimator there and sends the epoch's frames.
  template <class Send>
  void tick(base::Micros t, const LoopHealth& loop, Send&& send);

  template <class Send>
  void send_version(Send&& send) {
    publisher_.send_version(send);
  }

  /// Called by the inbox.
  void sample(const Sample& sample);
  void map_entry(const MapEntry& entry);
  /// Of two within an epoch the one with the later counter stands, whichever came first.
  void set_pose(const SetPose& pose) {
    if (!pending_pose_ || ((pose.counter - pending_pose_->counter) & 0x0F) < 8) pending_pose_ = pose;
  }
  void reset(can::ResetWhat what) { pending_reset_[static_cast<std::size_t>(what)] = true; }

 private:
  static constexpr std::size_t kCount = Estimators::kCount;
  static constexpr std::size_t kPrimary = kCount - 1;
  static constexpr base::Micros kLongestStep{500'000};
  /// Map entries wait here for their tick, sorted by id, so that the order of arrival has no effect.
  struct PendingMap {
    std::array<MapEntry, kMapCapacity> entries{};
    std::size_t size = 0;
  };

  [[nodiscard]] Context context() const { return {.numbers = numbers_, .site = site_}; }
  template <class F>
  void each_lane(F&& f) {
    std::apply([&](auto&... lane) { (f(lane), ...); }, lanes_);
  }
  void restart(base::Micros t, can::ResetCause cause);
  void advance();
  void close_window(base::Micros t);
  /// How a plain estimator's far end follows: by the samples that leave, or at once, as a copy of its present.
  enum class Past : std::uint8_t { kFollows, kIsNow };
  void retire_until(base::Micros t, Past past = Past::kFollows);
  void retire(const Sample& sample, Past past = Past::kFollows);
  template <class Lane>
  void note(Lane& lane, std::size_t instance, const Sample& sample, const Innovation& innovation);
  void apply_map(base::Micros before);
  void apply_commands();
  void consume(base::Micros t);
  template <class Lane>
  [[nodiscard]] bool came_late(std::size_t due) const;
  void fuse(std::size_t entry, const std::array<bool, kCount>& again);
  void find_origin(const Sample& sample);
  using Estimates = std::array<Estimate, kCount>;
  [[nodiscard]] Estimates estimate() const;
  [[nodiscard]] bool healthy(const Estimates& estimates);
  [[nodiscard]] std::uint32_t state_crc() const;
  [[nodiscard]] Summary summary(const Estimate& estimate) const;

  const Numbers& numbers_;
  typename Estimators::Lanes lanes_;
  Site site_;
  Timeline<TimelineCapacity> timeline_;
  Inbox inbox_;
  Counters counters_;
  Publisher<kCount> publisher_;
  PendingMap pending_map_;
  std::array<bool, 3> pending_reset_{};
  std::optional<SetPose> pending_pose_;

  base::Micros now_;
  base::Micros closed_until_;  ///< samples up to here can no longer be fused
  bool ticked_ = false;
  InputTally tally_;  ///< of the input frames
  std::uint8_t resets_ = 0;
  can::ResetCause reset_cause_ = can::ResetCause::kPowerOn;
  base::Micros restarted_at_;
};

template <class Estimators, std::size_t Capacity>
void Node<Estimators, Capacity>::power_on(base::Micros t) {
  // Cleared in place: a fresh object assigned over the old one would pass over the stack.
  site_.map.clear();
  site_.frame = {};
  site_.origin = can::OriginSource::kNone;
  const GnssNumbers& g = numbers_.gnss;
  if (g.origin_configured != 0) {
    site_.frame = nav::LocalFrame(g.origin_latitude_2ndeg, g.origin_longitude_2ndeg, g.origin_height_m);
    site_.origin = can::OriginSource::kConfigured;
  }
  timeline_.power_on();
  inbox_.power_on();
  counters_ = {};
  publisher_.power_on();
  pending_map_.size = 0;
  pending_reset_ = {};
  pending_pose_.reset();
  now_ = closed_until_ = restarted_at_ = t;
  ticked_ = false;
  tally_ = {};
  resets_ = 0;
  reset_cause_ = can::ResetCause::kPowerOn;
  each_lane([&](auto& lane) {
    lane.restart(t, context());
    lane.clear_statistics();
  });
}

template <class Estimators, std::size_t Capacity>
void Node<Estimators, Capacity>::on_frame(const base::CanFrame& frame) {
  const auto offset = static_cast<std::uint8_t>(frame.id - numbers_.can_base);
  tally_.add(frame_crc(offset, frame));
  inbox_.on_frame(offset, frame, now_, counters_, *this);
}

template <class Estimators, std::size_t Capacity>
void Node<Estimators, Capacity>::sample(const Sample& arrived) {
  Sample sample = arrived;
  if (sample.sensor == can::Sensor::kBodySpeed) sample.stamp += base::Micros{numbers_.wheels.delay_us};
  if (!ticked_ && now_.us == 0) return void(++counters_.no_time);
  if (sample.stamp <= closed_until_) {
    ++counters_.too_late;
    publisher_.event({.verdict = can::Verdict::kTooLate}, sample, kPrimary, now_, counters_);
    return;
  }
  if (sample.stamp > now_ + base::Micros{numbers_.loop.ahead_us}) return void(++counters_.too_early);
  Insert result = timeline_.insert(sample);
  if (result == Insert::kFull && timeline_.consumed(0)) {
    retire(timeline_[0]);
    timeline_.drop_front(1);
    result = timeline_.insert(sample);
  }
  if (result == Insert::kDuplicate) ++counters_.duplicate;
  if (result == Insert::kFull) ++counters_.timeline_full;
}

template <class Estimators, std::size_t Capacity>
void Node<Estimators, Capacity>::map_entry(const MapEntry& entry) {
  PendingMap& pending = pending_map_;
  std::size_t at = pending.size;
  while (at > 0 && pending.entries[at - 1].id >= entry.id) --at;
  if (at < pending.size && pending.entries[at].id == entry.id) {
    MapEntry& there = pending.entries[at];  // of two within an epoch the one further east (or north) stands
    const bool beyond = entry.x_mm != there.x_mm ? entry.x_mm > there.x_mm : entry.y_mm > there.y_mm;
    if (beyond) there = entry;
    return;
  }
  if (pending.size == kMapCapacity) {  // the highest ids are the ones refused, in whatever order they come
    ++counters_.map_full;
    if (at == pending.size) return;
    --pending.size;
  }
  for (std::size_t i = pending.size; i > at; --i) pending.entries[i] = pending.entries[i - 1];
  pending.entries[at] = entry;
  ++pending.size;
}

template <class Estimators, std::size_t Capacity>
template <class Send>
void Node<Estimators, Capacity>::tick(base::Micros t, const LoopHealth& loop, Send&& send) {
  if (!ticked_) {
    restart(t, can::ResetCause::kPowerOn);
    ticked_ = true;
  } else if (t <= now_ || t - now_ > kLongestStep) {
    restart(t, can::ResetCause::kTimeJump);
  }
  const base::Micros before = now_;
  now_ = t;
  tally_.close_epoch();
  inbox_.expire(now_, base::Micros{numbers_.loop.window_us}, counters_);
  apply_map(before);
  consume(now_);
  apply_commands();
  advance();
  Estimates estimates = estimate();
  if (!healthy(estimates)) estimates = estimate();

  publisher_.begin(now_, tally_, send);
  std::size_t instance = 0;
  each_lane([&](const auto& lane) {
    using E = typename std::remove_cvref_t<decltype(lane)>::Type;
    publisher_.estimate(instance, E::kKind, instance == kPrimary, estimates[instance], send);
    if constexpr (requires { lane.inertial(context()); }) publisher_.inertial(instance, lane.inertial(context()), send);
    ++instance;
  });
  publisher_.status(summary(estimates[kPrimary]), send);
  publisher_.statistics(lanes_, now_, send);
  publisher_.diagnostics(counters_, loop, timeline_.high_water(), send);
  publisher_.identity(site_, send);
  publisher_.events(send);
  const base::Micros edge = now_ - base::Micros{numbers_.loop.window_us};
  retire_until(edge);
  if (edge > closed_until_) closed_until_ = edge;
  publisher_.end(state_crc(), tally_, send);
}

template <class Estimators, std::size_t Capacity>
void Node<Estimators, Capacity>::restart(base::Micros t, can::ResetCause cause) {
  if (cause != can::ResetCause::kPowerOn) {
    ++resets_;
    reset_cause_ = cause;
    restarted_at_ = t;
  }
  each_lane([&](auto& lane) { lane.restart(t, context()); });
  if (cause == can::ResetCause::kTimeJump) {
    inbox_.forget(counters_);
    timeline_.clear();
    closed_until_ = t - base::Micros{numbers_.loop.period_us};
  }
  if (cause == can::ResetCause::kPowerOn) closed_until_ = t - base::Micros{numbers_.loop.window_us};
}

template <class Estimators, std::size_t Capacity>
void Node<Estimators, Capacity>::advance() {
  const auto window = [this](auto&& each) {
    for (std::size_t i = 0; i < timeline_.size() && timeline_.consumed(i); ++i) each(timeline_[i]);
  };
  each_lane([&](auto& lane) { lane.advance(now_, context(), window); });
}

/// What was consumed becomes final, and so does the time up to t: nothing from before it is fused any more.
template <class Estimators, std::size_t Capacity>
void Node<Estimators, Capacity>::close_window(base::Micros t) {
  retire_until(t, Past::kIsNow);
  if (t > closed_until_) closed_until_ = t;
}

/// Consumed samples with stamps up to t leave the window.
template <class Estimators, std::size_t Capacity>
void Node<Estimators, Capacity>::retire_until(base::Micros t, Past past) {
  std::size_t count = 0;
  while (count < timeline_.size() && timeline_.consumed(count) && timeline_[count].stamp <= t)
    retire(timeline_[count++], past);
  timeline_.drop_front(count);
  if (past == Past::kIsNow) each_lane([](auto& lane) { lane.close(); });
}

template <class Estimators, std::size_t Capacity>
void Node<Estimators, Capacity>::retire(const Sample& sample, Past past) {
  std::size_t instance = 0;
  each_lane([&](auto& lane) {
    if constexpr (std::remove_cvref_t<decltype(lane)>::kDelayed) {
      note(lane, instance, sample, lane.fuse(sample, context()));
    } else if (past == Past::kFollows) {
      lane.retire(sample, context());
    }
    ++instance;
  });
  if (sample.stamp > closed_until_) closed_until_ = sample.stamp;
}

/// The record goes into the statistics, and out when it says something.
template <class Estimators, std::size_t Capacity>
template <class Lane>
void Node<Estimators, Capacity>::note(Lane& lane, std::size_t instance, const Sample& sample,
                                      const Innovation& innovation) {
  lane.account(sample, innovation);
  // What comes with every tick would drown the rest: of accepted wheels the statistics are enough.
  const bool ordinary = innovation.verdict == can::Verdict::kAccepted && sample.sensor <= can::Sensor::kBodySpeed;
  if ((innovation.dof > 0 && !ordinary) || innovation.verdict > can::Verdict::kNotUsed)
    publisher_.event(innovation, sample, instance, now_, counters_);
}

template <class Estimators, std::size_t Capacity>
void Node<Estimators, Capacity>::apply_map(base::Micros before) {
  if (pending_map_.size == 0) return;
  consume(before);  // what came late belongs to the map as it was
  close_window(before);
  for (std::size_t i = 0; i < pending_map_.size; ++i)
    if (!site_.map.put(pending_map_.entries[i])) ++counters_.map_full;
  pending_map_.size = 0;
}

template <class Estimators, std::size_t Capacity>
void Node<Estimators, Capacity>::apply_commands() {
  using What = can::ResetWhat;
  const auto asked = [this](What what) { return std::exchange(pending_reset_[static_cast<std::size_t>(what)], false); };
  if (asked(What::kLandmarkMap)) site_.map.clear();
  if (asked(What::kCounters)) {
    counters_ = {};
    each_lane([](auto& lane) { lane.clear_statistics(); });
  }
  if (asked(What::kEstimators)) {
    close_window(now_);
    restart(now_, can::ResetCause::kCommand);
  }
  if (pending_pose_) {
    close_window(now_);
    each_lane([&](auto& lane) { lane.set_pose(now_, *pending_pose_, context()); });
    pending_pose_.reset();
    ++resets_;
    reset_cause_ = can::ResetCause::kSetPose;
  }
}

/// Whether something new belongs before something that the lane has fused already.
template <class Estimators, std::size_t Capacity>
template <class Lane>
bool Node<Estimators, Capacity>::came_late(std::size_t due) const {
  if (Lane::kDelayed) return false;
  bool is_new = false;
  for (std::size_t i = 0; i < due; ++i) {
    if (!Lane::takes(timeline_[i])) continue;
    if (!timeline_.consumed(i)) {
      is_new = true;
    } else if (is_new) {
      return true;
    }
  }
  return false;
}

template <class Estimators, std::size_t Capacity>
void Node<Estimators, Capacity>::consume(base::Micros t) {
  const std::size_t due = timeline_.until(t);
  std::array<bool, kCount> again{};
  std::size_t instance = 0;
  each_lane([&](auto& lane) {
    bool& repeat = again[instance++];
    repeat = came_late<std::remove_cvref_t<decltype(lane)>>(due);
    if constexpr (!std::remove_cvref_t<decltype(lane)>::kDelayed) {
      if (repeat) lane.rewind();
    }
  });
  for (std::size_t i = 0; i < due; ++i) fuse(i, again);
}

template <class Estimators, std::size_t Capacity>
void Node<Estimators, Capacity>::fuse(std::size_t i, const std::array<bool, kCount>& again) {
  const Sample& sample = timeline_[i];
  const bool is_new = !timeline_.consumed(i);
  if (is_new) find_origin(sample);
  std::size_t instance = 0;
  bool taken = false;
  each_lane([&](auto& lane) {
    using Lane = std::remove_cvref_t<decltype(lane)>;
    if constexpr (Lane::kDelayed) {
      taken = taken || Lane::takes(sample);
    } else if (is_new || again[instance]) {
      const Innovation innovation = lane.fuse(sample, context());
      if (is_new) {
        taken = taken || innovation.verdict != can::Verdict::kNotUsed;
        note(lane, instance, sample, innovation);
      }
    }
    ++instance;
  });
  if (is_new && !taken) ++counters_.not_used;
  timeline_.consume(i);
}

template <class Estimators, std::size_t Capacity>
void Node<Estimators, Capacity>::find_origin(const Sample& sample) {
  if (site_.origin != can::OriginSource::kNone || sample.sensor != can::Sensor::kGnssPosition) return;
  const GnssPosition& fix = sample.payload.gnss_position;
  if (fix.fix < GnssFix::k2d) return;
  site_.frame =
      nav::LocalFrame(fix.latitude_2ndeg, fix.longitude_2ndeg, base::is_finite(fix.height_m) ? fix.height_m : 0.0F);
  site_.origin = can::OriginSource::kFirstFix;
}

template <class Estimators, std::size_t Capacity>
auto Node<Estimators, Capacity>::estimate() const -> Estimates {
  return std::apply([this](const auto&... lane) { return std::array{lane.estimate(context())...}; }, lanes_);
}

/// A broken invariant (NaN, a covariance that is none) restarts the estimators from their defined start, and says so.
template <class Estimators, std::size_t Capacity>
bool Node<Estimators, Capacity>::healthy(const Estimates& estimates) {
  bool finite = true;
  bool positive = true;
  for (const Estimate& e : estimates) {
    finite = finite && base::is_finite(e.pose.yaw_rad) && base::is_finite(e.pose.x.offset_m) &&
             base::is_finite(e.pose.y.offset_m);
    positive = positive && e.p.positive_definite();
  }
  if (finite && positive) return true;
  close_window(now_);
  restart(now_, finite ? can::ResetCause::kNotPositive : can::ResetCause::kNotFinite);
  advance();
  return false;
}

template <class Estimators, std::size_t Capacity>
std::uint32_t Node<Estimators, Capacity>::state_crc() const {
  base::BitCrc crc;
  std::apply([&](const auto&... lane) { (lane.each_bit(crc), ...); }, lanes_);
  crc(timeline_.digest());
  crc(static_cast<std::uint32_t>(site_.origin));
  site_.map.each_bit(crc);
  return crc.value();
}

template <class Estimators, std::size_t Capacity>
Summary Node<Estimators, Capacity>::summary(const Estimate& estimate) const {
  const auto& primary = std::get<kPrimary>(lanes_);
  Summary s{.mode = primary.mode(context()),
            .position_valid = estimate.position_valid,
            .heading_valid = estimate.heading_valid,
            .velocity_valid = estimate.velocity_valid,
            .origin_known = site_.origin != can::OriginSource::kNone,
            .resets = resets_,
            .cause = reset_cause_,
            .restarted = resets_ > 0 && now_ - restarted_at_ < base::Micros{1'000'000} &&
                         reset_cause_ != can::ResetCause::kSetPose};
  for (const SensorStatistics& stat : primary.statistics()) {
    const bool used = stat.accepted > 0 && now_ - stat.last_accepted < base::Micros{1'000'000};
    if (used) s.used = static_cast<std::uint16_t>(s.used | (1U << static_cast<unsigned>(stat.sensor)));
    s.rejecting = s.rejecting || stat.refused_in_a_row >= 3;
  }
  return s;
}

}  // namespace tetap::app
