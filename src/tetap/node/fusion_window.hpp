// SPDX-License-Identifier: Apache-2.0
// The rule of order and lateness. Samples are consumed in the order in which they were true, late ones at their own
// time. A sample that left the window is final. Holds the estimators and the samples of the window.
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/bus/counters.hpp"
#include "tetap/node/estimator_slot.hpp"
#include "tetap/node/timeline.hpp"
#include "tetap/node/work_limit.hpp"

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
  using Slots = std::tuple<EstimatorSlot<E>...>;
  static constexpr std::size_t kCount = sizeof...(E);
  template <class Payload>
  static constexpr bool kTakes = (EstimatorSlot<E>::template kTakes<Payload> || ...);
  static constexpr bool kUsesMap = (estimators::UsesMap<E> || ...);
  static constexpr bool kMakesMap = (estimators::MakesMap<E> || ...);
  /// Some frames of the robot have identifiers of the map's block.
  static constexpr bool kNeedsMapIds =
      kMakesMap || kTakes<sensor::PlanarScan> || kTakes<sensor::CameraImage> || kTakes<sensor::RelativePose>;
  /// Places for the samples of the window: 200 ms of an IMU at 200 Hz with wheels at 100 Hz and GNSS need 64.
  static constexpr std::size_t kSamples = 88;
  /// Samples that plain estimators repeat in a tick when one came late; what is more is spread over several ticks. A
  /// delayed estimator beside them needs much of the tick for itself.
  static constexpr bool kSpares = (EstimatorSlot<E>::kDelayed || ...);
  /// Some estimator shares the work of a window that ends out among ticks.
  static constexpr bool kSharesOut = (EstimatorSlot<E>::kSharesOut || ...);
  static constexpr std::size_t kReplayed = kSpares ? 20 : 56;
  /// Fewer by so many for each IMU sample of the tick beyond the first: every estimator pays for those.
  static constexpr std::size_t kReplayedLess = kSpares ? 4 : 12, kLeastReplayed = kSpares ? 2 : 8;
};

/// A robot whose scanner is given a map: it names the field as its kField.
template <class Estimators>
inline constexpr bool kHasField = requires {
  Estimators::kField;
};

/// A window with another number of places, for a faster IMU or a longer window (DESIGN.md, 4.3).
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
    closed_until_ = t;
    each_slot([&](auto& slot) {
      slot.restart(t, ctx);
      slot.clear_statistics();
    });
  }
  void restart(base::Micros t, const estimators::Context& ctx) {
    each_slot([&](auto& slot) { slot.restart(t, ctx); });
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
  /// stays, and all that follow it; so do those beyond the share of a tick.
  template <class Note>
  void retire_until(base::Micros t, const estimators::Context& ctx, Note&& note) {
    leave_until(t, Past::kFollows, ctx, note);
  }
  /// Closes the window at once: nothing from before t is fused any more, and plain estimators' past is their present.
  template <class Note>
  void close_window(base::Micros t, const estimators::Context& ctx, Note&& note) {
    finish_replays(ctx, note);
    leave_until(t, Past::kIsNow, ctx, note);
    each_slot([&](auto& slot) {
      if constexpr (requires { slot.close_batch(ctx); }) slot.close_batch(ctx);
      if constexpr (requires { slot.abort_job(); }) slot.abort_job();
      slot.close();
    });
    late_records(note);
  }

  /// A tick's share of what close_window() would do. Whether all of it is done: nothing is left until t.
  template <class Note>
  [[nodiscard]] bool drain(base::Micros t, const estimators::Context& ctx, Note&& note);

  /// Brings every estimator to t.
  void advance(base::Micros t, const estimators::Context& ctx) {
    const sensor::Window window = timeline_.window(timeline_.until(t));
    each_slot([&](auto& slot) { slot.advance(t, ctx, window); });
  }
  /// The tick's share of jobs that are longer.
  void work(std::uint32_t units, const estimators::Context& ctx) {
    each_slot([&](auto& slot) {
      if constexpr (requires { slot.work(units, ctx); }) slot.work(units, ctx);
    });
  }
  /// Notes the records that came later than fuse().
  template <class Note>
  void late_records(Note&& note) {
    std::size_t instance = 0;
    each_slot([&](auto& slot) {
      if constexpr (RecordsLater<typename std::remove_cvref_t<decltype(slot)>::Type>)
        slot.late_records([&](const sensor::Sample& sample, const estimators::Innovation& innovation) {
          note(instance, sample, innovation);
        });
      ++instance;
    });
  }

  using Estimates = std::array<estimators::Estimate, kCount>;
  /// The estimates of the instances that are due; others keep what they are.
  template <class Due>
  void estimate(const estimators::Context& ctx, const Due& due, Estimates& estimates) const {
    std::size_t instance = 0;
    each_slot([&](const auto& slot) {
      if (due(instance)) estimates[instance] = slot.estimate(ctx);
      ++instance;
    });
  }
  template <class F>
  void each_slot(F&& f) {
    std::apply([&](auto&... slot) { (f(slot), ...); }, slots_);
  }
  template <class F>
  void each_slot(F&& f) const {
    std::apply([&](const auto&... slot) { (f(slot), ...); }, slots_);
  }
  [[nodiscard]] const auto& slots() const { return slots_; }
  [[nodiscard]] const auto& primary() const { return std::get<kPrimary>(slots_); }
  [[nodiscard]] std::uint16_t high_water() const { return timeline_.high_water(); }
  /// Every sample in the window.
  template <class F>
  void each_sample(F&& f) const {
    for (std::size_t i = 0; i < timeline_.size(); ++i) f(timeline_[i]);
  }

  /// The limit of the tick's work depends on the order of arrival.
  static constexpr auto members(auto& self) {
    return base::members(self.slots_, self.timeline_, base::unhashed(self.limit_), self.closed_until_);
  }

 private:
  /// Way in which a plain estimator's far end follows: by the samples that leave, or at once, as a copy of its present.
  enum class Past : std::uint8_t { kFollows, kIsNow };

  template <class Note>
  void leave_until(base::Micros t, Past past, const estimators::Context& ctx, Note& note);
  template <class Note>
  void leave(std::size_t i, Past past, const estimators::Context& ctx, Note& note);
  [[nodiscard]] bool defers(const sensor::Sample& sample, const estimators::Context& ctx);
  template <class EstimatorSlot>
  [[nodiscard]] std::size_t late_before(const EstimatorSlot& slot, std::size_t due) const;
  [[nodiscard]] std::size_t replay_share(std::size_t due) const;
  template <class EstimatorSlot>
  [[nodiscard]] std::size_t replay_size(const EstimatorSlot& slot, std::size_t due, std::size_t most) const;
  template <class EstimatorSlot, class Note>
  void catch_up(EstimatorSlot& slot, std::size_t instance, std::size_t due, std::size_t share,
                const estimators::Context& ctx, Note& note);
  template <class Note>
  void finish_replays(const estimators::Context& ctx, Note& note);
  /// Accounts for and notes the innovation of a sample that came late.
  template <class EstimatorSlot, class Note>
  void record_awaited(EstimatorSlot& slot, std::size_t instance, std::size_t i,
                      const estimators::Innovation& innovation, Note& note) {
    if (!timeline_.take_awaited(i, instance)) return;
    slot.account(timeline_[i], innovation);
    note(instance, timeline_[i], innovation);
  }

  /// Samples that leave in a tick: plain estimators take each of them once more. What is more stays for the next tick.
  /// A window of 20 ticks that is full leaves half as many.
  static constexpr std::size_t kMostLeaving = Capacity / 11;
  /// Fewer of a window of more ticks, by as much as its samples are closer together.
  [[nodiscard]] static std::size_t most_leaving(const param::LoopParameters& loop) {
    constexpr std::uint32_t kTicks = 20;
    const auto ticks = static_cast<std::uint32_t>(loop.window_us / loop.period_us);
    return ticks > kTicks ? kMostLeaving * kTicks / ticks + 1 : kMostLeaving;
  }

  typename Estimators::Slots slots_;
  Timeline<Capacity> timeline_;
  WorkLimit<Capacity> limit_;
  base::Micros closed_until_;
};

template <class Estimators, std::size_t Capacity>
template <class Note>
Insert FusionWindow<Estimators, Capacity>::insert(const sensor::Sample& sample, const estimators::Context& ctx,
                                                  Note&& note) {
  std::size_t moves = limit_.moves();
  const Insert result = timeline_.insert(sample, moves);
  if (result == Insert::kTooMuch) limit_.refuse();
  if (result == Insert::kTaken) limit_.spend_moves(moves);
  // A sample older than all of them came too late for so small a window.
  if (result != Insert::kFull || !timeline_.consumed(0) || sample.order(timeline_[0]) < 0) return result;
  if (!limit_.admits_room()) return Insert::kTooMuch;
  leave(0, Past::kFollows, ctx, note);
  timeline_.drop_front(1);
  const Insert again = timeline_.insert(sample);
  return again == Insert::kTaken ? Insert::kMadeRoom : again;
}

template <class Estimators, std::size_t Capacity>
template <class Note>
void FusionWindow<Estimators, Capacity>::leave_until(base::Micros t, Past past, const estimators::Context& ctx,
                                                     Note& note) {
  std::size_t count = 0;
  const std::size_t most = most_leaving(ctx.parameters.loop);
  while (count < timeline_.size() && timeline_.consumed(count) && timeline_[count].stamp <= t) {
    if (past == Past::kFollows && (count == most || defers(timeline_[count], ctx))) break;
    leave(count++, past, ctx, note);
  }
  timeline_.drop_front(count);
  if (t > closed_until_) closed_until_ = t;
}

template <class Estimators, std::size_t Capacity>
template <class Note>
bool FusionWindow<Estimators, Capacity>::drain(base::Micros t, const estimators::Context& ctx, Note&& note) {
  if constexpr (!Estimators::kSharesOut) return true;
  finish_replays(ctx, note);
  each_slot([t](auto& slot) {
    slot.grant_share();
    slot.close_until(t);
  });
  const auto due = [&](std::size_t i) {
    return i < timeline_.size() && timeline_.consumed(i) && timeline_[i].stamp <= t;
  };
  std::size_t count = 0;
  while (due(count) && count < 2 * kMostLeaving && !defers(timeline_[count], ctx))
    leave(count++, Past::kFollows, ctx, note);
  const bool done = !due(count);
  timeline_.drop_front(count);
  return done;
}

template <class Estimators, std::size_t Capacity>
template <class Note>
void FusionWindow<Estimators, Capacity>::leave(std::size_t i, Past past, const estimators::Context& ctx, Note& note) {
  const sensor::Sample& sample = timeline_[i];
  std::size_t instance = 0;
  each_slot([&](auto& slot) {
    if constexpr (std::remove_cvref_t<decltype(slot)>::kDelayed) {
      const estimators::Innovation innovation = slot.fuse(sample, ctx);
      if constexpr (RecordsLater<typename std::remove_cvref_t<decltype(slot)>::Type>) {
        if (innovation.verdict == sensor::Verdict::kPending) return void(++instance);
      }
      slot.account(sample, innovation);
      note(instance, sample, innovation);
    } else if (past == Past::kFollows && !slot.past_has(sample)) {
      record_awaited(slot, instance, i, slot.retire(sample, ctx), note);
    }
    ++instance;
  });
  if (sample.stamp > closed_until_) closed_until_ = sample.stamp;
}

template <class Estimators, std::size_t Capacity>
bool FusionWindow<Estimators, Capacity>::defers(const sensor::Sample& sample, const estimators::Context& ctx) {
  bool deferred = false;
  each_slot([&](auto& slot) { deferred = slot.defers(sample, ctx) || deferred; });
  return deferred;
}

/// Index of the last sample that the slot has fused already, when something new belongs before it; otherwise 0.
template <class Estimators, std::size_t Capacity>
template <class EstimatorSlot>
std::size_t FusionWindow<Estimators, Capacity>::late_before(const EstimatorSlot& slot, std::size_t due) const {
  if (!slot.replay_due() && !timeline_.any_late()) return 0;
  std::size_t last = due;
  do {
    if (last == 0) return 0;
    --last;
  } while (!timeline_.consumed(last) || !EstimatorSlot::takes(timeline_[last]));
  if (slot.replay_due()) return last;
  for (std::size_t i = timeline_.known(); i < last; ++i)
    if (!timeline_.consumed(i) && EstimatorSlot::takes(timeline_[i]) && !slot.past_has(timeline_[i])) return last;
  return 0;
}

/// Samples that this tick may repeat.
template <class Estimators, std::size_t Capacity>
std::size_t FusionWindow<Estimators, Capacity>::replay_share(std::size_t due) const {
  std::size_t imu = 0, first = due;
  for (std::size_t i = timeline_.known(); i < due; ++i)
    if (timeline_[i].sensor == sensor::Sensor::kImu && !timeline_.consumed(i)) {
      ++imu;
      if (i < first) first = i;
    }
  // A prediction begins anew behind the first of them. A tick of a full window whose samples are all late has none.
  if constexpr (Estimators::kSpares) imu += (due - first) / 8;
  imu = std::max(imu, due / (Estimators::kSpares ? 16 : 64));
  const std::size_t less = imu > 1 ? (imu - 1) * Estimators::kReplayedLess : 0;
  constexpr std::size_t kMost = Estimators::kReplayed, kLeast = Estimators::kLeastReplayed;
  return less + kLeast < kMost ? kMost - less : kLeast;
}

/// Samples between the far end of the slot and the present; `most` + 1 when there are more.
template <class Estimators, std::size_t Capacity>
template <class EstimatorSlot>
std::size_t FusionWindow<Estimators, Capacity>::replay_size(const EstimatorSlot& slot, std::size_t due,
                                                            std::size_t most) const {
  std::size_t size = 0;
  for (std::size_t i = due; i > 0 && size <= most && !slot.past_has(timeline_[i - 1]); --i)
    if (EstimatorSlot::takes(timeline_[i - 1])) ++size;
  return size;
}

/// Moves the slot's far end by `share` samples, and on to the end of the last one's stamp.
template <class Estimators, std::size_t Capacity>
template <class EstimatorSlot, class Note>
void FusionWindow<Estimators, Capacity>::catch_up(EstimatorSlot& slot, std::size_t instance, std::size_t due,
                                                  std::size_t share, const estimators::Context& ctx, Note& note) {
  std::size_t i = 0;
  while (i < due && slot.past_has(timeline_[i])) ++i;
  for (std::size_t done = 0; i < due; ++i) {
    const sensor::Sample& sample = timeline_[i];
    if (done >= share && sample.stamp != timeline_[i - 1].stamp) break;
    if (EstimatorSlot::takes(sample)) {
      record_awaited(slot, instance, i, slot.retire(sample, ctx), note);
      ++done;
    }
    if (i + 1 == due || timeline_[i + 1].stamp != sample.stamp) slot.catch_up_to(sample.stamp);
  }
}

/// Replays under way are completed at once.
template <class Estimators, std::size_t Capacity>
template <class Note>
void FusionWindow<Estimators, Capacity>::finish_replays(const estimators::Context& ctx, Note& note) {
  std::size_t instance = 0;
  each_slot([&](auto& slot) {
    if constexpr (!std::remove_cvref_t<decltype(slot)>::kDelayed) {
      if (slot.replay_due()) {
        slot.rewind();
        for (std::size_t i = 0; i < timeline_.size(); ++i)
          if (timeline_.consumed(i) && !slot.past_has(timeline_[i]))
            record_awaited(slot, instance, i, slot.fuse(timeline_[i], ctx), note);
      }
    }
    ++instance;
  });
}

template <class Estimators, std::size_t Capacity>
template <class OnNew, class Note>
std::uint16_t FusionWindow<Estimators, Capacity>::consume(base::Micros t, const estimators::Context& ctx,
                                                          OnNew&& on_new, Note&& note) {
  const std::size_t due = timeline_.until(t);
  std::size_t left = replay_share(due);
  std::array<bool, kCount> again{};
  std::array<std::size_t, kCount> last{};  // samples before it are late
  bool anew = false;
  std::size_t instance = 0;
  each_slot([&](auto& slot) {
    using EstimatorSlot = std::remove_cvref_t<decltype(slot)>;
    if constexpr (!EstimatorSlot::kDelayed) {
      last[instance] = late_before(slot, due);
      if (last[instance] > 0) slot.note_late();
      const std::size_t size = slot.replay_due() ? replay_size(slot, due, left) : 0;
      if (size > 0 && size <= left) {
        left -= size;
        again[instance] = anew = true;
        slot.rewind();
      }
    }
    ++instance;
  });
  const param::LoopParameters& loop = ctx.parameters.loop;
  limit_.begin_tick(static_cast<std::uint32_t>(loop.window_us / loop.period_us));
  std::uint16_t not_used = 0;
  // Every estimator has the samples before known().
  for (std::size_t i = anew ? 0 : timeline_.known(); i < due; ++i) {
    const bool is_new = !timeline_.consumed(i);
    if (!is_new && !anew) continue;
    const sensor::Sample& sample = timeline_[i];
    if (is_new) on_new(sample);
    instance = 0;
    bool taken = false;
    each_slot([&](auto& slot) {
      using EstimatorSlot = std::remove_cvref_t<decltype(slot)>;
      if constexpr (EstimatorSlot::kDelayed) {
        taken = taken || EstimatorSlot::takes(sample);
        if (is_new) slot.arrived(sample, ctx);
      } else if (slot.past_has(sample)) {
        if (is_new && EstimatorSlot::takes(sample)) {
          taken = true;
          note(instance, sample, {.verdict = sensor::Verdict::kTooLate, .failed = sensor::Check::kTime});
        }
      } else if (is_new && !again[instance] && i < last[instance]) {
        taken = taken || EstimatorSlot::takes(sample);
        if (EstimatorSlot::takes(sample)) timeline_.await(i, instance);
      } else if (is_new || again[instance]) {
        const estimators::Innovation innovation = slot.fuse(sample, ctx);
        if (is_new) {
          taken = taken || innovation.verdict != sensor::Verdict::kNotUsed;
          slot.account(sample, innovation);
          note(instance, sample, innovation);
        } else {
          record_awaited(slot, instance, i, innovation, note);
        }
      }
      ++instance;
    });
    if (!is_new) continue;
    if (!taken) ++not_used;
    timeline_.consume(i);
  }
  instance = 0;
  each_slot([&](auto& slot) {
    using EstimatorSlot = std::remove_cvref_t<decltype(slot)>;
    if constexpr (!EstimatorSlot::kDelayed) {
      if (slot.replay_due() && left > 0) {
        catch_up(slot, instance, due, left, ctx, note);
        left = 0;
      }
    }
    ++instance;
  });
  return not_used;
}

}  // namespace tetap::node
