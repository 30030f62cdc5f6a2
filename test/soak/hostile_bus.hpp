// SPDX-License-Identifier: Apache-2.0
// Harm that a bus may do to a node: damage to the frames of honest sensors, and frames of a sender that is not honest.
// The messages that config/tetap.dbc makes give the places of the signals.
#pragma once

#include "tetap/base/can_frame.hpp"
#include "tetap/base/time.hpp"
#include "tetap/bus/e2e.hpp"
#include "tetap/bus/guard.hpp"
#include "tetap/bus/messages.hpp"
#include "tetap/bus/signal.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <random>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

namespace tetap::soak {

struct SignalPlace {
  std::uint32_t offset = 0;
  bus::Signal signal;
};

/// Every signal of every input message, and of each instance.
template <class... Messages>
struct InputSignals {
  static std::vector<SignalPlace> list() {
    std::vector<SignalPlace> places;
    (add<Messages>(places), ...);
    return places;
  }

 private:
  template <class M>
  static void add(std::vector<SignalPlace>& places) {
    std::uint32_t instances = 1;
    if constexpr (bus::Repeated<M>) instances = M::kCount;
    for (std::uint32_t i = 0; i < instances; ++i) {
      const std::uint32_t offset = bus::offset_of<M>(i);
      if (offset >= bus::EstEpoch::kOffset) return;
      M message;
      M::each(message, [&]<bus::Signal kSignal>(bus::At<kSignal>, auto&) { places.push_back({offset, kSignal}); });
    }
  }
};

enum class Attack : std::uint8_t {
  kNone,
  // damage
  kDrop,
  kFlip,
  kSize,
  kExtreme,
  kStamps,
  kReorder,
  kRepeat,
  kHalves,
  // frames of another sender
  kRandom,
  kLate,
  kMap,
  kPoses,
  kResets,
  kSyncs,
  kGuards,
};
inline constexpr std::array<std::string_view, 16> kAttackNames{
    "none",   "drop",   "flip", "size", "extreme", "stamps", "reorder", "repeat",
    "halves", "random", "late", "map",  "poses",   "resets", "syncs",   "guards"};
inline constexpr bool is_damage(Attack attack) { return attack >= Attack::kDrop && attack <= Attack::kHalves; }

class HostileBus {
 public:
  HostileBus(Attack attack, std::uint32_t can_base, std::uint64_t seed)
      : attack_(attack), base_(can_base), random_(seed), signals_(bus::AllMessages<InputSignals>::list()) {
    rate_ = std::uniform_real_distribution<double>(0.002, 0.3)(random_);
    per_tick_ = 1 + below(40);
  }

  /// The frames that arrive before the tick at `t`, of an honest epoch and of the other sender.
  void pass(const std::vector<base::CanFrame>& honest, base::Micros t, std::vector<base::CanFrame>& arrives) {
    arrives.clear();
    std::erase_if(delayed_,
                  [&](const auto& held) { return held.first <= t && (arrives.push_back(held.second), true); });
    for (const base::CanFrame& frame : honest) damage(frame, t, arrives);
    if (!is_damage(attack_) && attack_ != Attack::kNone)
      for (std::uint64_t k = 0; k < per_tick_; ++k) foreign(t, arrives);
  }
  [[nodiscard]] std::uint64_t hostile() const { return hostile_; }

 private:
  std::uint64_t below(std::uint64_t n) { return random_() % n; }
  bool now_and_then() { return std::uniform_real_distribution<double>(0, 1)(random_) < rate_; }
  static std::uint64_t word(const base::CanFrame& frame) { return bus::word(bus::payload(frame)); }
  static void put(base::CanFrame& frame, std::uint64_t word) { frame.data = bus::bytes(word); }

  void damage(base::CanFrame frame, base::Micros t, std::vector<base::CanFrame>& arrives) {
    if (!is_damage(attack_) || !now_and_then()) return arrives.push_back(frame);
    ++hostile_;
    const auto offset = static_cast<std::uint8_t>(frame.id - base_);
    switch (attack_) {
      case Attack::kDrop:
        return;
      case Attack::kFlip:
        for (std::uint64_t n = 1 + below(4); n > 0; --n)
          frame.data[below(8)] ^= static_cast<std::uint8_t>(1U << below(8));
        if (below(8) == 0) frame.id ^= 1U << below(11);
        break;
      case Attack::kSize:
        frame.size = static_cast<std::uint8_t>(below(9));
        break;
      case Attack::kExtreme:
        set_extreme(offset, frame);
        break;
      case Attack::kStamps:
        put(frame, (word(frame) & ~0xFFFFFULL) | ((word(frame) + below(1 << 20)) & 0xFFFFF));
        break;
      case Attack::kReorder:
        delayed_.emplace_back(t + base::Micros{static_cast<std::int64_t>(below(3'000'000))}, frame);
        return;
      case Attack::kHalves:
        if (offset >= bus::ImuGyro::kOffset) put(frame, word(frame) + ((1 + below(15)) << 60));
        break;
      default:
        arrives.push_back(frame);
        break;
    }
    arrives.push_back(frame);
  }

  /// A signal at an end of its range, next to it, or not available.
  void set_extreme(std::uint8_t offset, base::CanFrame& frame) {
    std::vector<bus::Signal> of;
    for (const SignalPlace& place : signals_)
      if (place.offset == offset) of.push_back(place.signal);
    if (of.empty()) return;
    const bus::Signal signal = of[below(of.size())];
    const std::uint64_t mask = signal.mask();
    const std::array<std::uint64_t, 7> values{0, 1, mask, mask - 1, mask >> 1, (mask >> 1) + 1, (mask >> 1) + 2};
    put(frame, (word(frame) & ~(mask << signal.start)) | (values[below(values.size())] & mask) << signal.start);
    if (offset >= bus::CmdReset::kOffset && offset <= bus::CmdSetYaw::kOffset)
      frame.data[0] = bus::e2e_crc(offset, frame.data);
  }

  base::CanFrame made(std::uint32_t offset, std::uint64_t word) {
    base::CanFrame frame{.id = base_ + offset, .size = 8};
    put(frame, word);
    return frame;
  }
  base::CanFrame command(std::uint32_t offset, std::uint64_t word) {
    base::CanFrame frame = made(offset, word);
    frame.data[0] = bus::e2e_crc(static_cast<std::uint8_t>(offset), frame.data);
    return frame;
  }
  /// Any sample with a stamp up to so long ago.
  base::CanFrame sample(base::Micros t, std::int64_t ago_us) {
    constexpr std::uint32_t kFirst = bus::InWheelCounts::kOffset, kEnd = bus::EstEpoch::kOffset;
    const auto stamp =
        static_cast<std::uint64_t>(t.us - static_cast<std::int64_t>(below(static_cast<std::uint64_t>(ago_us))));
    const std::uint32_t offset = kFirst + static_cast<std::uint32_t>(below(kEnd - kFirst));
    const bool unstamped = offset >= bus::ImuGyro::kOffset && offset < bus::InMag::kOffset &&
                           (offset - bus::ImuGyro::kOffset) % bus::ImuGyro::kStride != 2;
    return made(offset, unstamped ? random_() : (random_() & ~0xFFFFFULL) | (stamp & 0xFFFFF));
  }

  void foreign(base::Micros t, std::vector<base::CanFrame>& arrives) {
    ++hostile_;
    const auto time = static_cast<std::uint64_t>(t.us);
    switch (attack_) {
      case Attack::kRandom:
        arrives.push_back(made(static_cast<std::uint32_t>(1 + below(31)), random_()));
        if (below(10) == 0) arrives.back().size = static_cast<std::uint8_t>(below(9));
        return;
      case Attack::kLate:
        return arrives.push_back(sample(t, 199'000));
      case Attack::kMap:
        return arrives.push_back(made(bus::InMapEntry::kOffset, random_()));
      case Attack::kPoses: {
        const std::uint64_t counter = ++counter_ & 15U;
        arrives.push_back(command(bus::CmdSetPos::kOffset, (random_() & ~0xFFFULL) | counter << 8));
        return arrives.push_back(command(bus::CmdSetYaw::kOffset, (random_() & ~0xFFFULL) | counter << 8));
      }
      case Attack::kResets:
        return arrives.push_back(command(bus::CmdReset::kOffset, (++counter_ & 15U) << 8 | below(4) << 12));
      case Attack::kSyncs: {
        // Never three Tick or Clock frames that agree: these would be another clock, not noise.
        const std::uint64_t kind = below(4);
        const bool near = kind != static_cast<std::uint64_t>(bus::SyncKind::kClock) && below(2) == 0;
        const std::uint64_t at = near ? time + 30'000 * below(66) - 1'000'000 : random_();
        return arrives.push_back(made(bus::InSync::kOffset, (at & 0xFFFFFFFFFFFFULL) | below(256) << 48 | kind << 56));
      }
      default:
        return arrives.push_back(made(bus::InGuardTag::kOffset, random_()));
    }
  }

  Attack attack_;
  std::uint32_t base_;
  std::mt19937_64 random_;
  std::vector<SignalPlace> signals_;
  double rate_ = 0;             ///< share of honest frames that are damaged
  std::uint64_t per_tick_ = 0;  ///< frames of the other sender
  std::uint64_t counter_ = 0, hostile_ = 0;
  std::deque<std::pair<base::Micros, base::CanFrame>> delayed_;
};

}  // namespace tetap::soak
