// SPDX-License-Identifier: Apache-2.0
// Between the bus and the decoder: which commands, map entries and samples get through (param::BusParameters).
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/bus/authentication.hpp"
#include "tetap/bus/guard.hpp"
#include "tetap/bus/messages.hpp"
#include "tetap/param/parameters.hpp"

#include <cstdint>

namespace tetap::bus {

/// Reset, the halves of set pose, and map entries.
[[nodiscard]] constexpr bool is_command(std::uint8_t offset) {
  static_assert(CmdReset::kOffset == 2 && CmdSetYaw::kOffset == 4 && InMapEntry::kOffset == 5);
  return offset >= CmdReset::kOffset && offset <= InMapEntry::kOffset;
}

/// A frame of Cmd_Param that acts on the active set or on what is kept: it needs what other commands need. A Get acts
/// on nothing, and a Set on the staged copy alone.
[[nodiscard]] constexpr bool acts_on_parameters(const base::CanFrame& frame) {
  const auto bytes = payload(frame);
  return !decode<CmdParamGet>(bytes) && !decode<CmdParamSet>(bytes);
}

/// For robots that name no protection: commands are obeyed where they are open to all, and samples are used as they
/// come.
class NoProtection {
 public:
  explicit NoProtection(const param::Parameters& parameters) : parameters_(parameters) {}

  void power_on() {}
  void hide_secrets() {}
  void resume(const NoProtection&) {}
  void tick(base::Micros, Counters&) {}
  [[nodiscard]] std::uint32_t nonce() const { return 0; }
  /// Whether the decoder gets the frame.
  template <class Out>
  [[nodiscard]] bool admits(std::uint8_t offset, const base::CanFrame& frame, base::Micros, Counters& counters, Out&&) {
    if (is_command(offset) && parameters_.bus.commands != param::CommandAccess::kOpen)
      return ++counters.command_refused, false;
    return !is_guard(offset, frame);
  }
  [[nodiscard]] bool admits_sync(const base::CanFrame&, Counters&) { return false; }
  [[nodiscard]] bool admits_parameters(const base::CanFrame&, Counters&) const {
    return parameters_.bus.commands == param::CommandAccess::kOpen;
  }
  template <class Out>
  void sample(const sensor::Sample& sample, base::Micros, Counters&, Out&& out) {
    out(sample);
  }
  template <class F>
  static void each_waiting(F&&) {}

 private:
  const param::Parameters& parameters_;
};

/// Tags and guards, as the parameters ask for them.
class Protection {
 public:
  explicit Protection(const param::Parameters& parameters) : parameters_(parameters), authentication_(parameters) {}

  static constexpr auto members(auto& self) {
    return base::members(base::reference(self.parameters_), self.authentication_, self.samples_, self.entries_);
  }
  void power_on() { base::clear(*this); }
  /// Right behind a tick: nothing is left from which the key could be computed. For a copy that others get.
  void hide_secrets() { authentication_.hide_secrets(); }
  /// All but the parameters, from a state whose secrets may be hidden.
  void resume(const Protection& other) { base::resume(*this, other); }
  void tick(base::Micros now, Counters& counters) {
    if (authenticates()) authentication_.tick(now);
    samples_.expire(now, counters);
  }
  [[nodiscard]] std::uint32_t nonce() const { return authentication_.nonce(); }

  template <class Out>
  [[nodiscard]] bool admits(std::uint8_t offset, const base::CanFrame& frame, base::Micros now, Counters& counters,
                            Out&& out) {
    if (authenticates()) authentication_.input(frame);
    if (is_guard(offset, frame)) return guard(frame, now, counters, out), false;
    if (!is_command(offset)) {
      if (guards() && frame.size == 8) samples_.frame(offset, frame, now, counters);
      return true;
    }
    if (parameters_.bus.commands == param::CommandAccess::kNone) return ++counters.command_refused, false;
    if (authenticates()) return authentication_.admits(offset, frame, counters);
    if (!guards() || offset != InMapEntry::kOffset || entries_.admits(frame, now)) return true;
    return ++counters.guard_bad, false;
  }
  /// Whether a tag vouches for a sync frame.
  [[nodiscard]] bool admits_sync(const base::CanFrame& frame, Counters& counters) {
    return authenticates() && authentication_.waits_for(InSync::kOffset) &&
           authentication_.admits(InSync::kOffset, frame, counters);
  }
  /// Whether a frame of Cmd_Param may do what it asks for.
  [[nodiscard]] bool admits_parameters(const base::CanFrame& frame, Counters& counters) {
    if (authenticates()) authentication_.input(frame);
    if (parameters_.bus.commands == param::CommandAccess::kNone) return false;
    return !authenticates() || !acts_on_parameters(frame) ||
           authentication_.admits(CmdParamSet::kOffset, frame, counters);
  }
  template <class Out>
  void sample(const sensor::Sample& sample, base::Micros now, Counters& counters, Out&& out) {
    if (!guards()) return out(sample);
    samples_.sample(sample, now, counters, out);
  }
  /// Every whole sample that waits for its guard.
  template <class F>
  void each_waiting(F&& f) const {
    samples_.each_waiting(f);
  }

 private:
  [[nodiscard]] bool authenticates() const { return parameters_.bus.commands == param::CommandAccess::kAuthenticated; }
  [[nodiscard]] bool guards() const { return parameters_.bus.guard != 0; }

  template <class Out>
  void guard(const base::CanFrame& frame, base::Micros now, Counters& counters, Out& out) {
    const auto bytes = payload(frame);
    if (const auto tag = decode<InGuardTag>(bytes)) return authentication_.announce(*tag, counters);
    if (const auto entry = decode<InGuardEntry>(bytes)) return entries_.announce(*entry);
    const auto sample = decode<InGuardSample>(bytes);
    if (sample && guards()) samples_.guard(*sample, now, counters, out);
  }

  const param::Parameters& parameters_;
  Authentication authentication_;
  SampleGuard samples_;
  EntryGuard entries_;
};

}  // namespace tetap::bus
