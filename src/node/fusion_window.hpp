// SPDX-License-Identifier: Apache-2.0
// The rule of order and lateness: samples are consumed in the order in which they were true, late ones at their own
// time, and what left the window is final. Holds the estimators and the samples of the window.
#pragma once

#include "bus/counters.hpp"
#include "node/estimator_slot.hpp"
#include "node/timeline.hpp"
#include "node/work_limit.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <tuple>
#include <type_traits>
#include <utility>

namespace tetap::node {

/// The estimators a robot runs, in the order of their output instances; the last is the one the status speaks of.
template <Estimator... E>
struct Estimators {
  static_assert(sizeof...(E) >= 1 && sizeof...(E) <= 4, "the bus has four output instances");
  using Lanes = std::tuple<EstimatorSlot<E>...>;
  static constexpr std::size_t kCount = sizeof...(E);
  template <class Payload>
  static constexpr bool kTakes = (EstimatorSlot<E>::template kTakes<Payload> || ...);
  static constexpr bool kUsesMap = (estimators::UsesMap<E> || ...);
  static constexpr bool kMakesMap = (estimators::MakesMap<E> || ...);
  /// Places for the samples of the window: 200 ms of an IMU at 200 Hz with wheels at 100 Hz and GNSS need 64.
  static constexpr std::size_t kSamples = 88;
};

/// The same with another number of places, for a faster IMU or a longer window (DESIGN.md, 4.3).
template <std::size_t kPlaces, Estimator... E>
struct EstimatorsWithPlaces : Estimators<E...> {
  static constexpr std::size_t kSamples = kPlaces;
};

/// `Note` is called with (instance, sample, innovation) for every record.
template <class Estimators, std::size_t Capacity>
class FusionWindow {
 public:
  static constexpr std::size_t kCount = Estimators::kCount;
  static constexpr std::size_t kPrimary = kCount - 1;
  /// Whether any estimator takes this kind of sample.
  template <class Payload>
  static constexpr bool kTakes = Estimators::template kTakes<Payload>;

  void power_on(base::Micros t, const estimators::Context& ctx) {
    timeline_.power_on();
    limit_.power_on();
    owed_ = {};
    consumed_until_ = t;
    turn_ = 0;
    closed_until_ = t;
    each_lane([&](auto& lane) {
      lane.restart(t, ctx);
      lane.clear_statistics();
    });
  }
  void restart(base::Micros t, const estimators::Context& ctx) {
    each_lane([&](auto& lane) { lane.restart(t, ctx); });
  }
  void clear() { timeline_.clear(); }
  /// The window begins after t.
  void open_from(base::Micros t) { closed_until_ = t; }

  /// Whether one more sample is looked at before the next tick.
  [[nodiscard]] bool admits_sample() { return limit_.admits_sample(); }

  /// Samples up to here can no longer be fused.
  [[nodiscard]] base::Micros closed_until() const { return closed_until_; }

  /// Into its place in the window; when that is full the oldest consumed sample makes room.
  template <class Note>
  [[nodiscard]] Insert insert(const sensor::Sample& sample, const estimators::Context& ctx, Note&& note);

  /// Everything true until t goes into the estimators; on_new(sample) comes before a sample's first use. Gives how many
  /// new samples no estimator takes.
  template <class OnNew, class Note>
  std::uint16_t consume(base::Micros t, const estimators::Context& ctx, OnNew&& on_new, Note&& note);

  /// Samples until t leave the window and become final. A sample that a delayed estimator leaves to its next tick
  /// stays, and all that follow it.
  template <class Note>
  void retire_until(base::Micros t, const estimators::Context& ctx, Note&& note) {
    leave_until(t, Past::kFollows, ctx, note);
  }
  /// The same at once: nothing from before t is fused any more, and plain estimators' past is their present.
  template <class Note>
  void close_window(base::Micros t, const estimators::Context& ctx, Note&& note) {
    leave_until(t, Past::kIsNow, ctx, note);
    each_lane([&](auto& lane) {
      if constexpr (requires { lane.close_batch(ctx); }) lane.close_batch(ctx);
      if constexpr (requires { lane.abort_job(); }) lane.abort_job();
      lane.close();
    });
    late_records(note);
  }

  /// Brings every estimator to t.
  void advance(base::Micros t, const estimators::Context& ctx) {
    const sensor::Window window = timeline_.window(timeline_.until(t));
    each_lane([&](auto& lane) { lane.advance(t, ctx, window); });
  }
  /// The tick's share of jobs that are longer.
  void work(std::uint32_t units, const estimators::Context& ctx) {
    each_lane([&](auto& lane) {
      if constexpr (requires { lane.work(units, ctx); }) lane.work(units, ctx);
    });
  }
  /// Notes the records that came later than fuse().
  template <class Note>
  void late_records(Note&& note) {
    std::size_t instance = 0;
    each_lane([&](auto& lane) {
      if constexpr (RecordsLater<typename std::remove_cvref_t<decltype(lane)>::Type>)
        lane.late_records([&](const sensor::Sample& sample, const estimators::Innovation& innovation) {
          note(instance, sample, innovation);
        });
      ++instance;
    });
  }

  using Estimates = std::array<estimators::Estimate, kCount>;
  void estimate(const estimators::Context& ctx, Estimates& estimates) const {
    std::size_t instance = 0;
    each_lane([&](const auto& lane) { estimates[instance++] = lane.estimate(ctx); });
  }
  template <class F>
  void each_lane(F&& f) {
    std::apply([&](auto&... lane) { (f(lane), ...); }, lanes_);
  }
  template <class F>
  void each_lane(F&& f) const {
    std::apply([&](const auto&... lane) { (f(lane), ...); }, lanes_);
  }
  [[nodiscard]] const auto& lanes() const { return lanes_; }
  [[nodiscard]] const auto& primary() const { return std::get<kPrimary>(lanes_); }
  [[nodiscard]] std::uint16_t high_water() const { return timeline_.high_water(); }

  template <class Sink>
  void hash_state(Sink&& sink) const {
    each_lane([&](const auto& lane) { lane.hash_state(sink); });
    sink(timeline_.digest());
  }

 private:
  /// How a plain estimator's far end follows: by the samples that leave, or at once, as a copy of its present.
  enum class Past : std::uint8_t { kFollows, kIsNow };

  template <class Note>
  void leave_until(base::Micros t, Past past, const estimators::Context& ctx, Note& note);
  template <class Note>
  void leave(const sensor::Sample& sample, Past past, const estimators::Context& ctx, Note& note);
  [[nodiscard]] bool rests(const sensor::Sample& sample, const estimators::Context& ctx);
  template <class EstimatorSlot>
  [[nodiscard]] [[gnu::noinline]] bool came_late(std::size_t due) const;

  typename Estimators::Lanes lanes_;
  Timeline<Capacity> timeline_;
  WorkLimit<Capacity> limit_;
  std::array<bool, kCount> owed_{};  ///< a late sample waits until this lane works through the window again
  std::size_t turn_ = 0;             ///< the lane whose turn that is, where limits are tight
  base::Micros closed_until_;
  base::Micros consumed_until_;  ///< time of the last tick
};

template <class Estimators, std::size_t Capacity>
template <class Note>
Insert FusionWindow<Estimators, Capacity>::insert(const sensor::Sample& sample, const estimators::Context& ctx,
                                                  Note&& note) {
  std::size_t moves = limit_.moves();
  const Insert result = timeline_.insert(sample, moves);
  if (result == Insert::kTooMuch) limit_.refuse();
  if (result == Insert::kTaken) limit_.spend_moves(moves, sample.stamp <= consumed_until_);
  // A sample older than all of them came too late for so small a window.
  if (result != Insert::kFull || !timeline_.consumed(0) || sample.order(timeline_[0]) < 0) return result;
  if (!limit_.admits_room()) return Insert::kTooMuch;
  leave(timeline_[0], Past::kFollows, ctx, note);
  timeline_.drop_front(1);
  const Insert again = timeline_.insert(sample);
  return again == Insert::kTaken ? Insert::kMadeRoom : again;
}

template <class Estimators, std::size_t Capacity>
template <class Note>
void FusionWindow<Estimators, Capacity>::leave_until(base::Micros t, Past past, const estimators::Context& ctx,
                                                     Note& note) {
  std::size_t count = 0;
  while (count < timeline_.size() && timeline_.consumed(count) && timeline_[count].stamp <= t) {
    if (past == Past::kFollows && rests(timeline_[count], ctx)) break;
    leave(timeline_[count++], past, ctx, note);
  }
  timeline_.drop_front(count);
  if (t > closed_until_) closed_until_ = t;
}

template <class Estimators, std::size_t Capacity>
template <class Note>
void FusionWindow<Estimators, Capacity>::leave(const sensor::Sample& sample, Past past, const estimators::Context& ctx,
                                               Note& note) {
  std::size_t instance = 0;
  each_lane([&](auto& lane) {
    if constexpr (std::remove_cvref_t<decltype(lane)>::kDelayed) {
      const estimators::Innovation innovation = lane.fuse(sample, ctx);
      if constexpr (RecordsLater<typename std::remove_cvref_t<decltype(lane)>::Type>) {
        if (innovation.verdict == sensor::Verdict::kPending) return void(++instance);
      }
      lane.account(sample, innovation);
      note(instance, sample, innovation);
    } else if (past == Past::kFollows) {
      lane.retire(sample, ctx);
    }
    ++instance;
  });
  if (sample.stamp > closed_until_) closed_until_ = sample.stamp;
}

template <class Estimators, std::size_t Capacity>
bool FusionWindow<Estimators, Capacity>::rests(const sensor::Sample& sample, const estimators::Context& ctx) {
  bool rests = false;
  each_lane([&](auto& lane) { rests = lane.rests(sample, ctx) || rests; });
  return rests;
}

/// Whether something new belongs before something that the lane has fused already.
template <class Estimators, std::size_t Capacity>
template <class EstimatorSlot>
bool FusionWindow<Estimators, Capacity>::came_late(std::size_t due) const {
  if (EstimatorSlot::kDelayed) return false;
  bool is_new = false;
  for (std::size_t i = timeline_.known(); i < due; ++i) {
    if (!EstimatorSlot::takes(timeline_[i])) continue;
    if (!timeline_.consumed(i)) {
      is_new = true;
    } else if (is_new) {
      return true;
    }
  }
  return false;
}

template <class Estimators, std::size_t Capacity>
template <class OnNew, class Note>
std::uint16_t FusionWindow<Estimators, Capacity>::consume(base::Micros t, const estimators::Context& ctx,
                                                          OnNew&& on_new, Note&& note) {
  const std::size_t due = timeline_.until(t);
  std::array<bool, kCount> again{};
  std::size_t instance = 0;
  each_lane([&](auto& lane) {
    using EstimatorSlot = std::remove_cvref_t<decltype(lane)>;
    if constexpr (!EstimatorSlot::kDelayed) {
      owed_[instance] = owed_[instance] || came_late<EstimatorSlot>(due);
      again[instance] = owed_[instance] && limit_.admits_rework(due, instance == turn_);
      if (again[instance]) {
        owed_[instance] = false;
        lane.rewind();
      }
    }
    ++instance;
  });
  turn_ = (turn_ + 1) % kCount;
  consumed_until_ = t;
  const param::LoopParameters& loop = ctx.parameters.loop;
  limit_.begin_tick(static_cast<std::uint32_t>(loop.window_us / loop.period_us));
  // A lane that waits for its turn takes what follows all that it has, and leaves the rest to that turn.
  std::size_t in_order = due;
  while (in_order > 0 && !timeline_.consumed(in_order - 1)) --in_order;
  std::uint16_t not_used = 0;
  // Every estimator has the samples before known().
  const bool anew = std::any_of(again.begin(), again.end(), [](bool a) { return a; });
  for (std::size_t i = anew ? 0 : timeline_.known(); i < due; ++i) {
    const bool is_new = !timeline_.consumed(i);
    if (!is_new && !anew) continue;
    const sensor::Sample& sample = timeline_[i];
    if (is_new) on_new(sample);
    instance = 0;
    bool taken = false;
    each_lane([&](auto& lane) {
      using EstimatorSlot = std::remove_cvref_t<decltype(lane)>;
      if constexpr (EstimatorSlot::kDelayed) {
        taken = taken || EstimatorSlot::takes(sample);
        if (is_new) lane.arrived(sample, ctx);
      } else if (owed_[instance] && i < in_order) {
        taken = true;
      } else if (is_new || again[instance]) {
        const estimators::Innovation innovation = lane.fuse(sample, ctx);
        if (is_new) {
          taken = taken || innovation.verdict != sensor::Verdict::kNotUsed;
          lane.account(sample, innovation);
          note(instance, sample, innovation);
        }
      }
      ++instance;
    });
    if (!is_new) continue;
    if (!taken) ++not_used;
    timeline_.consume(i);
  }
  return not_used;
}

}  // namespace tetap::node
