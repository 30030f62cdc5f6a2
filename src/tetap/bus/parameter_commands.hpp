// SPDX-License-Identifier: Apache-2.0
// Parameters of a running node over the bus: Cmd_Param in, Est_Param out. A Get or a Set is answered with a row; an
// Apply, a Restore or a Restart acts at the next tick and is answered with the set's CRC. A Restart needs a node that
// rests. One frame goes out a tick. After a power-on and each change, and each ten seconds, every word that is not as
// compiled follows: a log has the parameters of each epoch. A node without a key takes its first one within a minute of
// power-on.
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/bus/codec.hpp"
#include "tetap/bus/counters.hpp"
#include "tetap/bus/e2e.hpp"
#include "tetap/bus/messages.hpp"
#include "tetap/param/staged.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>

namespace tetap::bus {

class ParameterCommands {
 public:
  /// An estimate that is faster moves, and a save or a restart is refused.
  static constexpr float kStill_mps = 0.05F, kStill_radps = 0.05F;

  explicit ParameterCommands(const param::Parameters& compiled) : staged_(compiled) { begin_claims(); }

  [[nodiscard]] static constexpr bool takes(std::uint8_t offset) { return offset == CmdParamSet::kOffset; }
  [[nodiscard]] const param::Parameters& active(const param::Parameters&) const { return staged_.active(); }

  [[nodiscard]] const param::StagedParameters& sets() const { return staged_; }

  /// A Save that may act, for the firmware around the node: what becomes of it does not follow from the frames.
  struct Save {
    std::uint32_t before = 0;
    std::uint8_t counter = 0;
    bool asked = false;
  };
  [[nodiscard]] std::optional<Save> take_save() {
    const Save save = std::exchange(save_, {});
    return save.asked ? std::optional(save) : std::nullopt;
  }
  [[nodiscard]] EstParamSet answer_to(const Save& save, ParamAnswer is) const {
    return told({.page = CmdParamSave::kPage, .counter = save.counter, .is = is}, staged_.active_crc());
  }
  /// As param::StagedParameters has it; power_on() follows.
  template <class Each, class Refused>
  [[nodiscard]] bool load(Each&& each_word, Refused&& refused) {
    return staged_.load(each_word, refused);
  }

  /// Rows that waited for a restart are active.
  void power_on() {
    staged_.restart();
    size_ = still_ticks_ = next_row_ = next_word_ = 0;
    pause_ticks_ = 0;
    asked_.reset();
    save_ = {};
    answer({.page = EstParamSet::kSetPageIdNotAvailable});
  }
  void hide_secrets() { staged_.hide_secrets(); }
  /// None is hashed: Est_Param has the CRC of what is active, and what was only asked for acts on nothing.
  static constexpr auto members(auto& self) {
    return base::members(base::unhashed(self.staged_), base::unhashed(self.asked_), base::unhashed(self.save_),
                         base::unhashed(self.answers_), base::unhashed(self.size_), base::unhashed(self.still_ticks_),
                         base::unhashed(self.claim_ticks_), base::unhashed(self.pause_ticks_),
                         base::unhashed(self.next_row_), base::unhashed(self.next_word_));
  }

  /// A command; `admitted`: the node's protection lets it act. `takes_key`: the node can judge tags.
  void on_frame(const base::CanFrame& frame, bool admitted, bool takes_key, Counters& counters);
  /// A first key is taken for a minute from here on: the board's power-on, not a Begin.
  void begin_claims() { claim_ticks_ = static_cast<std::uint32_t>(kClaim_us / staged_.active().loop.period_us); }
  void end_claims() {
    claim_ticks_ = 0;
    staged_.withdraw_claim();
  }

  /// At the begin of a tick: what is asked for is refused, or take_over() has to follow.
  enum class Change : std::uint8_t { kNone, kLive, kRestart };
  [[nodiscard]] Change accepts() { return asked_ ? judge() : Change::kNone; }
  /// kRestart: the estimators have to begin anew.
  void take_over(Change change);

  /// Each tick; `speed_mps` and `yaw_rate_radps` of each estimate that has a velocity.
  void note_motion(float speed_mps, float yaw_rate_radps) {
    const auto within = [](float value, float limit) { return value <= limit && value >= -limit; };
    if (!within(speed_mps, kStill_mps) || !within(yaw_rate_radps, kStill_radps)) still_ticks_ = 0;
  }
  /// No estimate has shown motion for a second.
  [[nodiscard]] bool rests() const { return still_ticks_ >= kRest_us / staged_.active().loop.period_us; }

  /// The CRC of the active set, as `config`; take(message) for the frame of this tick.
  template <class Take>
  void publish(std::uint32_t config, Take&& take);

 private:
  static constexpr std::size_t kAnswers = 8;             ///< between two ticks
  static constexpr std::size_t kRowsPerTick = 8;         ///< looked at for one that is not as compiled
  static constexpr std::int32_t kClaim_us = 60'000'000;  ///< from power-on, for the first key
  static constexpr std::int32_t kRest_us = 1'000'000;
  static constexpr std::int32_t kRepeat_us = 10'000'000;  ///< from the last word that is not as compiled to the first

  struct Answer {
    std::uint8_t page = 0;  ///< page of the command; not available: a power-on
    std::uint8_t counter = EstParamSet::kSetCtrNotAvailable;
    ParamAnswer is = ParamAnswer::kDone;
    param::Source source = param::Source::kActive;
    std::uint8_t word = 0;
    std::uint16_t row = 0;
  };
  struct Asked {
    std::uint8_t page = 0;
    std::uint8_t counter = 0;
    std::uint32_t before = 0, after = 0;
  };

  void answer(const Answer& answer) {
    if (size_ < answers_.size()) answers_[size_++] = answer;
  }
  [[nodiscard]] EstParamSet told(const Answer& of, std::uint32_t config) const;
  [[nodiscard]] Change judge();
  void get(const CmdParamGet& command);
  void set(const CmdParamSet& command, bool admitted, bool takes_key, Counters& counters);
  /// One at a tick.
  void ask(const Asked& asked) {
    if (asked_) return answer({.page = asked.page, .counter = asked.counter, .is = ParamAnswer::kBusy});
    asked_ = asked;
  }
  template <class Take>
  void send(const Answer& of, std::uint32_t config, Take& take) const;

  param::StagedParameters staged_;
  std::optional<Asked> asked_;
  Save save_;
  std::array<Answer, kAnswers> answers_{};
  std::uint16_t size_ = 0;         ///< answers that wait
  std::uint16_t still_ticks_ = 0;  ///< ticks since an estimate showed motion
  std::uint32_t claim_ticks_ = 0;  ///< left for a first key
  std::uint32_t pause_ticks_ = 0;  ///< left until all words are sent again; 0: none was sent
  std::uint16_t next_row_ = 0;     ///< row that is looked at next; behind the last one: all words are sent
  std::uint16_t next_word_ = 0;    // no padding follows: a node's next member would lie in it
};

/// In place of it, in robots that take no parameters from the bus.
class NoParameterCommands {
 public:
  explicit NoParameterCommands(const param::Parameters&) {}
  [[nodiscard]] static constexpr bool takes(std::uint8_t) { return false; }
  [[nodiscard]] static const param::Parameters& active(const param::Parameters& compiled) { return compiled; }
  void power_on() {}
  void hide_secrets() {}
  static constexpr auto members(auto&) { return base::members(); }
};

[[gnu::cold]] inline void ParameterCommands::on_frame(const base::CanFrame& frame, bool admitted, bool takes_key,
                                                      Counters& counters) {
  const auto bytes = payload(frame);
  if (!e2e_valid(CmdParamSet::kOffset, bytes)) return void(++counters.command_refused);
  if (size_ == answers_.size()) return void(++counters.command_rate);
  if (const auto command = decode<CmdParamGet>(bytes)) return get(*command);
  if (const auto command = decode<CmdParamSet>(bytes)) return set(*command, admitted, takes_key, counters);
  const auto refuse = [&](std::uint8_t page, std::uint8_t counter, ParamAnswer why) {
    answer({.page = page, .counter = counter, .is = why});
  };
  if (const auto command = decode<CmdParamSave>(bytes)) {
    if (!admitted) return refuse(CmdParamSave::kPage, command->ctr, ParamAnswer::kRefused);
    return void(save_ = {command->save_before_crc, command->ctr, true});
  }
  if (const auto command = decode<CmdParamApply>(bytes)) {
    if (!admitted) return refuse(CmdParamApply::kPage, command->ctr, ParamAnswer::kRefused);
    return ask({CmdParamApply::kPage, command->ctr, command->apply_before_crc, command->apply_after_crc});
  }
  if (const auto command = decode<CmdParamRestart>(bytes)) {
    if (!admitted) return refuse(CmdParamRestart::kPage, command->ctr, ParamAnswer::kRefused);
    return ask({CmdParamRestart::kPage, command->ctr, command->restart_before_crc, command->restart_after_crc});
  }
  if (const auto command = decode<CmdParamRestore>(bytes)) {
    if (!admitted) return refuse(CmdParamRestore::kPage, command->ctr, ParamAnswer::kRefused);
    return ask({CmdParamRestore::kPage, command->ctr, command->restore_before_crc, 0});
  }
  ++counters.malformed;
}

inline void ParameterCommands::get(const CmdParamGet& command) {
  const auto source = static_cast<param::Source>(command.get_source);
  const bool known = source <= param::Source::kCompiled && staged_.has(command.get_row_id, command.get_word);
  answer({.page = CmdParamGet::kPage,
          .counter = command.ctr,
          .is = known ? ParamAnswer::kDone : ParamAnswer::kUnknown,
          .source = source,
          .word = command.get_word,
          .row = command.get_row_id});
}

inline void ParameterCommands::set(const CmdParamSet& command, bool admitted, bool takes_key, Counters& counters) {
  const bool claims = takes_key && claim_ticks_ != 0 && param::StagedParameters::is_key(command.set_row_id);
  const param::Answer told = !admitted ? param::Answer::kRefused
                             : claims  ? staged_.claim(command.set_word, command.set_value)
                                       : staged_.set(command.set_row_id, command.set_word, command.set_value);
  if (told == param::Answer::kRefused) ++counters.command_refused;
  const auto is = static_cast<ParamAnswer>(told);
  answer({.page = CmdParamSet::kPage,
          .counter = command.ctr,
          .is = is,
          .source = param::Source::kStaged,
          .word = command.set_word,
          .row = command.set_row_id});
}

[[gnu::cold]] inline ParameterCommands::Change ParameterCommands::judge() {
  const Asked asked = *asked_;
  asked_.reset();
  const bool restarts = asked.page == CmdParamRestart::kPage;
  auto is = ParamAnswer::kBusy;
  if (!restarts || rests())
    is = static_cast<ParamAnswer>(restarts                             ? staged_.judge_all(asked.before, asked.after)
                                  : asked.page == CmdParamApply::kPage ? staged_.judge(asked.before, asked.after)
                                                                       : staged_.restore(asked.before));
  answer({.page = asked.page, .counter = asked.counter, .is = is});
  return is != ParamAnswer::kDone ? Change::kNone : restarts ? Change::kRestart : Change::kLive;
}

[[gnu::cold]] inline void ParameterCommands::take_over(Change change) {
  if (change == Change::kRestart) {
    staged_.take_over_all();
    still_ticks_ = 0;
  } else {
    staged_.take_over();
  }
  next_row_ = next_word_ = 0;
  pause_ticks_ = 0;
}

inline EstParamSet ParameterCommands::told(const Answer& of, std::uint32_t config) const {
  const auto most = [](std::size_t count) { return static_cast<std::uint8_t>(count > 254 ? 254 : count); };
  return {.set_page_id = of.page,
          .set_answer = of.is,
          .set_ctr = of.counter,
          .set_pending = most(staged_.pending()),
          .set_changed = most(staged_.changed()),
          .set_config = config};
}

template <class Take>
void ParameterCommands::send(const Answer& of, std::uint32_t config, Take& take) const {
  if (of.page == CmdParamGet::kPage || of.page == CmdParamSet::kPage) {
    take(EstParamRow{.row_source = static_cast<ParamSource>(of.source),
                     .row_word = of.word,
                     .row_id = of.row,
                     .row_answer = of.is,
                     .row_ctr = of.counter,
                     .row_value = staged_.value(of.source, of.row, of.word)});
    return;
  }
  take(told(of, config));
}

template <class Take>
void ParameterCommands::publish(std::uint32_t config, Take&& take) {
  if (claim_ticks_ != 0 && --claim_ticks_ == 0) end_claims();
  if (still_ticks_ != std::numeric_limits<std::uint16_t>::max()) ++still_ticks_;
  if (size_ != 0) {
    send(answers_[0], config, take);
    --size_;
    for (std::size_t i = 0; i < size_; ++i) answers_[i] = answers_[i + 1];
    return;
  }
  for (std::size_t looked = 0; looked < kRowsPerTick && next_row_ < param::kStoredRows.size(); ++looked) {
    const param::StoredRow& row = param::kStoredRows[next_row_];
    while (next_word_ < row.words) {
      const auto word = static_cast<std::uint8_t>(next_word_++);
      if (!staged_.is_changed(next_row_, word)) continue;
      send({.page = CmdParamGet::kPage, .word = word, .row = row.index}, config, take);
      pause_ticks_ = static_cast<std::uint32_t>(kRepeat_us / staged_.active().loop.period_us);
      return;
    }
    ++next_row_, next_word_ = 0;
  }
  const bool all_sent = next_row_ == param::kStoredRows.size();
  if (all_sent && pause_ticks_ != 0 && --pause_ticks_ == 0) next_row_ = next_word_ = 0;
}

}  // namespace tetap::bus
