// SPDX-License-Identifier: Apache-2.0
// One estimator in the firmware, with its statistics, in one of two ways.
// A plain one has its current state and its state at the far end of the window. A late sample is fused at its own time
// by starting again from `past` and repeating the samples since. The result is the one that would have been had the
// sample been on time. Costs: twice the estimator's memory; a burst only when something is late that this estimator
// takes. A repetition too long for one tick is caught up over several. The far end moves towards the present by a
// tick's share at a time, takes the late sample on its way, and stays there.
// A delayed one (kDelayed) has its state at the far end of the window only. Samples reach it in their order when they
// leave the window, each once. The present is that state carried over what the window holds. Costs: that carrying in
// every tick, never a burst. Due work may also wait for the next tick, and records are late by the window.
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/estimators/context.hpp"
#include "tetap/estimators/estimate.hpp"
#include "tetap/estimators/own_map.hpp"
#include "tetap/estimators/sensor_statistics.hpp"
#include "tetap/estimators/visual/visual_report.hpp"
#include "tetap/sensor/sample.hpp"
#include "tetap/sensor/window.hpp"

#include <array>
#include <concepts>
#include <cstdint>
#include <limits>
#include <type_traits>

namespace tetap::node {

/// advance() carries the estimate to time t. A delayed estimator is given the samples behind its window, too.
template <class E>
concept Advances = requires(E& e, base::Micros t, const estimators::Context& ctx, const sensor::Window& window) {
  e.advance(t, ctx);
}
|| requires(E& e, base::Micros t, const estimators::Context& ctx, const sensor::Window& window) {
  requires E::kDelayed;
  e.advance(t, ctx, window);
};

template <class E>
concept Estimator = Advances<E> &&
    requires(E& e, const E& view, base::Micros t, const estimators::Context& ctx, const estimators::SetPose& pose) {
  { E::kKind } -> std::convertible_to<sensor::EstimatorKind>;
  { e.restart(t, ctx) } -> std::same_as<void>;
  { e.set_pose(t, pose, ctx) } -> std::same_as<void>;
  { view.estimate(ctx) } -> std::same_as<estimators::Estimate>;
  { view.mode(ctx) } -> std::same_as<sensor::Mode>;
};

template <class E>
inline constexpr bool kIsDelayed = requires {
  requires E::kDelayed;
};

/// An estimator that judges samples together: fuse() gives the verdict Pending, and late_records(sink) hands out the
/// records (estimators::LateRecord) when they are there.
template <class E>
concept RecordsLater = requires(E& e) {
  e.late_records([](const estimators::LateRecord&) {});
};

/// An estimator with jobs longer than a tick: work() does so many units of the one under way, once a tick.
template <class E>
concept WorksInJobs = requires(E& e, std::uint32_t units, const estimators::Context& ctx) {
  e.work(units, ctx);
  e.abort_job();
};

template <Estimator E>
class EstimatorSlot {
 public:
  using Type = E;
  static constexpr bool kDelayed = kIsDelayed<E>;
  static constexpr bool kSharesOut = requires(E & e) { e.grant_share(); };
  static_assert(!WorksInJobs<E> || kDelayed, "a plain estimator repeats its window, and would repeat its jobs");
  /// An estimator that distinguishes sensors of one kind is given the instance, too.
  template <class Payload>
  static constexpr bool kTakesInstance = requires(E& e, const Payload& payload, base::Micros stamp,
                                                  std::uint8_t instance, const estimators::Context& ctx) {
    e.fuse(payload, stamp, instance, ctx);
  };
  template <class Payload>
  static constexpr bool kTakes = kTakesInstance<Payload> || requires(E& e, const Payload& payload, base::Micros stamp,
                                                                     const estimators::Context& ctx) {
    e.fuse(payload, stamp, ctx);
  };

  void restart(base::Micros t, const estimators::Context& ctx) {
    now_.restart(t, ctx);
    close();
    if constexpr (!kDelayed) replay_.until = {std::numeric_limits<std::int64_t>::min()};
  }
  void set_pose(base::Micros t, const estimators::SetPose& pose, const estimators::Context& ctx) {
    now_.set_pose(t, pose, ctx);
    close();
  }

  /// Whether this kind of sample means anything to the estimator.
  [[nodiscard]] static bool takes(const sensor::Sample& sample) {
    return (kTaken >> static_cast<unsigned>(sample.sensor) & 1U) != 0;
  }
  /// Fuses into the current state and gives the record for the bus.
  estimators::Innovation fuse(const sensor::Sample& sample, const estimators::Context& ctx) {
    return fuse_into(now_, sample, ctx);
  }
  /// The far end takes the sample, which leaves the window or is caught up with.
  estimators::Innovation retire(const sensor::Sample& sample, const estimators::Context& ctx) requires(!kDelayed) {
    return fuse_into(past_, sample, ctx);
  }
  /// Back to the far end of the window.
  void rewind() requires(!kDelayed) {
    now_ = past_;
    replay_.due = false;
  }
  /// Makes the current state final: late samples no longer change it.
  void close() {
    if constexpr (!kDelayed) {
      past_ = now_;
      replay_.due = false;
    }
  }
  /// The same up to this stamp, of which the window still holds samples for other estimators.
  void close_until(base::Micros stamp) {
    close();
    if constexpr (!kDelayed) replay_.until = stamp;
  }
  /// The far end has this sample of the window, or is beyond it.
  [[nodiscard]] bool past_has(const sensor::Sample& sample) const requires(!kDelayed) {
    return sample.stamp <= replay_.until;
  }
  /// The far end has caught up to this stamp.
  void catch_up_to(base::Micros stamp) requires(!kDelayed) { replay_.until = stamp; }
  /// Something is late in the window, and the present does not have it yet.
  void note_late() requires(!kDelayed) { replay_.due = true; }
  [[nodiscard]] bool replay_due() const {
    if constexpr (kDelayed) {
      return false;
    } else {
      return replay_.due;
    }
  }

  /// A sample is new in the window.
  void arrived(const sensor::Sample& sample, const estimators::Context& ctx) requires kDelayed {
    if constexpr (requires { now_.arrived(sample, ctx); }) now_.arrived(sample, ctx);
  }
  /// A delayed estimator has done enough in this tick: the sample, true long enough ago, waits for the next.
  [[nodiscard]] bool defers(const sensor::Sample& sample, const estimators::Context& ctx) {
    if constexpr (requires { now_.defers(sample, ctx); }) return takes(sample) && now_.defers(sample, ctx);
    return false;
  }

  /// More of the horizon's work in this tick: the window is about to end.
  void grant_share() {
    if constexpr (kSharesOut) now_.grant_share();
  }

  /// `window` is what the estimators have of the samples in the window, in order.
  void advance(base::Micros t, const estimators::Context& ctx, const sensor::Window& window) {
    if constexpr (kDelayed) {
      now_.advance(t, ctx, window);
    } else {
      now_.advance(t, ctx);
    }
  }
  [[nodiscard]] estimators::Estimate estimate(const estimators::Context& ctx) const { return now_.estimate(ctx); }
  [[nodiscard]] estimators::MotionVariance motion_variance(const estimators::Context& ctx) const {
    if constexpr (requires { now_.motion_variance(ctx); }) return now_.motion_variance(ctx);
    return {};
  }
  [[nodiscard]] estimators::InertialEstimate inertial(const estimators::Context& ctx) const requires
      requires(const E& e) {
    e.inertial(ctx);
  }
  { return now_.inertial(ctx); }
  /// The likeliest fault of a sensor (trust::LikelyFault), of an estimator with hypotheses of faults.
  [[nodiscard]] auto likeliest_fault() const requires requires(const E& e) { e.likeliest_fault(); }
  { return now_.likeliest_fault(); }
  [[nodiscard]] estimators::AttitudeEstimate inertial_attitude() const requires requires(const E& e) {
    e.inertial_attitude();
  }
  { return now_.inertial_attitude(); }
  [[nodiscard]] estimators::SourceStates sources(const estimators::Context& ctx) const {
    if constexpr (requires { now_.sources(ctx); }) return now_.sources(ctx);
    return {};
  }
  [[nodiscard]] estimators::AttitudeEstimate attitude(const estimators::Context& ctx) const requires
      requires(const E& e) {
    e.attitude(ctx);
  }
  { return now_.attitude(ctx); }
  /// The estimator's level plane of the place, in the map; null: it has none.
  [[nodiscard]] const nav::LocalLevel* level() const {
    if constexpr (requires { now_.level(); }) return &now_.level();
    return nullptr;
  }
  /// Last step that the estimator itself made in its state, for the status.
  [[nodiscard]] estimators::Jump jump() const {
    if constexpr (requires { now_.jump(); }) return now_.jump();
    return {};
  }
  /// Bits of sensor::Fault that the estimator sees.
  [[nodiscard]] std::uint16_t faults() const {
    if constexpr (requires { now_.faults(); }) return now_.faults();
    return 0;
  }
  [[nodiscard]] sensor::Mode mode(const estimators::Context& ctx) const { return now_.mode(ctx); }
  /// Calls sink(sample, innovation) for records later than fuse(); of the sample stamp, sensor and instance are there.
  template <class Sink>
  void late_records(Sink&& sink) requires RecordsLater<E> {
    now_.late_records([&](const estimators::LateRecord& record) {
      sensor::Sample sample;
      sample.stamp = record.stamp;
      sample.sensor = record.sensor;
      sample.instance = record.instance;
      account(sample, record.innovation);
      sink(sample, record.innovation);
    });
  }
  void work(std::uint32_t units, const estimators::Context& ctx) requires WorksInJobs<E> { now_.work(units, ctx); }
  /// The window is closed: a job under way is given up.
  void abort_job() requires WorksInJobs<E> { now_.abort_job(); }
  /// The window is closed: what waits for others of its stamp is judged now.
  void close_batch(const estimators::Context& ctx) requires RecordsLater<E> { now_.close_batch(ctx); }
  [[nodiscard]] estimators::ScanMatchReport scan_match() const requires estimators::MatchesScans<E> {
    return now_.scan_match();
  }
  [[nodiscard]] const E& eyes() const requires estimators::SeesImages<E> { return now_; }
  [[nodiscard]] const E& map_maker() const requires estimators::MakesMap<E> { return now_; }
  void reset_own_map() requires estimators::MakesMap<E> { now_.reset_own_map(); }

  void account(const sensor::Sample& sample, const estimators::Innovation& innovation) {
    estimators::SensorStatistics& s = statistics(sample.sensor, sample.instance);
    if (innovation.verdict == sensor::Verdict::kAccepted) {
      ++s.accepted;
      s.refused_in_a_row = 0;
      s.last_accepted = sample.stamp;
    } else if (innovation.verdict == sensor::Verdict::kRejected) {
      ++s.rejected;
      if (s.refused_in_a_row < 255) ++s.refused_in_a_row;
    }
    if (innovation.dof > 0) {
      const float nis = innovation.nis / static_cast<float>(innovation.dof);
      s.nis_mean = s.compared ? s.nis_mean + (nis - s.nis_mean) * 0.02F : nis;
      s.compared = true;
    }
  }
  [[nodiscard]] estimators::SensorStatistics& statistics(sensor::Sensor sensor, std::uint8_t instance) {
    std::size_t i = 0;
    while (i + 1 < estimators::kStatistics && statistics_[i].sensor != sensor::Sensor::kNotAvailable &&
           (statistics_[i].sensor != sensor || statistics_[i].instance != instance))
      ++i;
    statistics_[i].sensor = sensor;
    statistics_[i].instance = instance;
    return statistics_[i];
  }
  [[nodiscard]] const std::array<estimators::SensorStatistics, estimators::kStatistics>& statistics() const {
    return statistics_;
  }
  void clear_statistics() {
    for (estimators::SensorStatistics& s : statistics_) s = {};
  }

  /// The parameters are others now: what the estimator keeps of them is taken anew.
  void configure(const estimators::Context& ctx) {
    if constexpr (requires { now_.configure(ctx); }) {
      now_.configure(ctx);
      close();
    }
  }

  /// The statistics sum in the order of arrival, and go out in Est_Stat.
  static constexpr auto members(auto& self) {
    return base::members(self.now_, base::in_turns(self.past_), self.replay_, base::unhashed(self.statistics_));
  }

 private:
  static estimators::Innovation fuse_into(E& estimator, const sensor::Sample& sample, const estimators::Context& ctx) {
    estimators::Innovation innovation;
    if (sample.sensor == sensor::Sensor::kImu && sample.instance != ctx.parameters.inertial.imu) return innovation;
    visit(sample, [&](const auto& payload) {
      using Payload = std::remove_cvref_t<decltype(payload)>;
      if constexpr (kTakesInstance<Payload>) {
        innovation = estimator.fuse(payload, sample.stamp, sample.instance, ctx);
      } else if constexpr (kTakes<Payload>) {
        innovation = estimator.fuse(payload, sample.stamp, ctx);
      }
    });
    return innovation;
  }

  /// A bit for each kind of sample whose payload, as sensor::visit() gives it, the estimator takes.
  static constexpr std::uint32_t kTaken = [] {
    std::uint32_t taken = 0;
    for (unsigned kind = 0; kind < static_cast<unsigned>(sensor::Sensor::kNotAvailable); ++kind) {
      sensor::Sample sample;
      sample.sensor = static_cast<sensor::Sensor>(kind);
      sensor::visit(sample, [&]<class Payload>(const Payload&) { taken |= kTakes<Payload> ? 1U << kind : 0U; });
    }
    return taken;
  }();

  struct Nothing {};
  struct Replay {
    base::Micros until{std::numeric_limits<std::int64_t>::min()};  ///< stamp to which past_ has caught up
    bool due = false;                                              ///< a late sample is not in now_ yet
  };

  E now_;  ///< state now; the far end's where the estimator is delayed
  [[no_unique_address]] std::conditional_t<kDelayed, Nothing, E> past_;
  [[no_unique_address]] std::conditional_t<kDelayed, std::array<Nothing, 0>, Replay> replay_;
  std::array<estimators::SensorStatistics, estimators::kStatistics> statistics_{};
};

}  // namespace tetap::node
