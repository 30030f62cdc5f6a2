// SPDX-License-Identifier: Apache-2.0
#include "sim_host/kept_words.hpp"

#include "hal/board/linux/clock.hpp"
#include "sim_host/parameter_word.hpp"
#include "tetap/bus/codec.hpp"
#include "tetap/bus/e2e.hpp"
#include "tetap/param/crc.hpp"
#include "tetap/param/staged.hpp"
#include "tetap/param/stored_row.hpp"

#include <algorithm>

namespace tetap::sim {
namespace {

constexpr int kEpochs = 6'000;      ///< a minute, six times as long as the node pauses between two lists
constexpr std::size_t kAtOnce = 6;  ///< a node keeps eight answers
constexpr base::Micros kPatience{2'000'000};

/// Reads answers until `wanted(frame)` has been true for so many of them, or a command is refused.
template <class Wanted>
Result<> await(InProcessLink& link, std::size_t count, Wanted&& wanted) {
  for (const base::Micros until = hal::monotonic_clock() + kPatience; count > 0;) {
    if (const auto frame = link.receive()) {
      const std::optional<bus::ParamAnswer> answer = wanted(*frame);
      if (answer && *answer != bus::ParamAnswer::kDone)
        return Failure{"the node refuses the parameters with which the node of the log began (Est_Param.Answer " +
                       std::to_string(static_cast<int>(*answer)) + ")"};
      count -= answer.has_value();
    } else if (hal::monotonic_clock() > until) {
      return Failure{"the node gives no answer to the parameters with which the node of the log began"};
    } else {
      link.wait({1'000});
    }
  }
  return {};
}

}  // namespace

param::Parameters KeptWords::over(param::Parameters compiled) const {
  for (const KeptWord& one : words)
    for (const param::StoredRow& row : param::kStoredRows)
      if (row.index == one.row && one.word < row.words && !row.access) put_word(compiled, row, one.word, one.value);
  return compiled;
}

std::optional<KeptWords> kept_words_of(Frames& log, std::uint32_t log_base) {
  KeptWords kept;
  std::optional<std::size_t> missing;  // words that the log has still to name
  log.rewind();
  int epochs = 0;
  for (TimedFrame entry; epochs < kEpochs && missing != 0U && log.next(entry);) {
    epochs += !entry.frame.extended && entry.frame.id == log_base + bus::EstStateCrc::kOffset;
    if (entry.frame.extended || entry.frame.id != log_base + bus::EstParamRow::kOffset) continue;
    if (const auto set = bus::decode<bus::EstParamSet>(bus::payload(entry.frame))) {
      const bool begins = set->set_page_id == bus::EstParamSet::kSetPageIdNotAvailable;
      if (begins && set->set_answer == bus::ParamAnswer::kDone) {
        kept = {.words = {}, .config = set->set_config};
        missing = set->set_changed;
      } else if (set->set_page_id == bus::CmdParamApply::kPage || set->set_page_id == bus::CmdParamRestore::kPage ||
                 set->set_page_id == bus::CmdParamRestart::kPage) {
        if (set->set_answer == bus::ParamAnswer::kDone) break;  // words behind it are of another set
      }
    } else if (const auto row = bus::decode<bus::EstParamRow>(bus::payload(entry.frame));
               row && missing && row->row_answer == bus::ParamAnswer::kDone &&
               row->row_source == bus::ParamSource::kActive && row->row_ctr == bus::EstParamRow::kRowCtrNotAvailable) {
      kept.words.push_back({row->row_id, row->row_word, row->row_value});
      --*missing;
    }
  }
  log.rewind();
  return kept.words.empty() ? std::nullopt : std::optional(std::move(kept));
}

std::optional<Begun> begun_of(Frames& log, std::uint32_t log_base, const Robot& robot,
                              const param::Parameters& of_node) {
  if (!robot.takes.parameters) return std::nullopt;
  const auto kept = kept_words_of(log, log_base);
  if (!kept) return std::nullopt;
  param::Parameters built = *robot.parameters;
  built.can_base = log_base;
  Begun begun{.from = of_node, .to = kept->over(of_node), .built = built, .active = kept->over(built)};
  begun.exact = param::crc(begun.active) == kept->config;
  for (const param::StoredRow& row : param::kStoredRows)
    for (std::size_t word = 0; word < row.words; ++word)
      if (const std::uint32_t own = word_of(of_node, row, word); own != word_of(built, row, word))
        put_word(begun.to, row, word, own);
  return begun;
}

Result<> make_active(InProcessLink& link, const param::Parameters& from, const param::Parameters& to) {
  constexpr std::uint32_t kName = param::StagedParameters::kName;
  std::uint8_t counter = 0;
  std::size_t open = 0;
  const auto row_answer = [&](const base::CanFrame& frame) -> std::optional<bus::ParamAnswer> {
    if (frame.id != from.can_base + bus::EstParamRow::kOffset) return std::nullopt;
    const auto told = bus::decode<bus::EstParamRow>(bus::payload(frame));
    if (!told || told->row_source != bus::ParamSource::kStaged) return std::nullopt;
    return told->row_answer;
  };
  for (const param::StoredRow& row : param::kStoredRows)
    for (std::size_t word = 0; word < row.words; ++word) {
      if (row.secret || word_of(from, row, word) == word_of(to, row, word)) continue;
      static_cast<void>(link.send(
          bus::frame(from.can_base, bus::protect(bus::CmdParamSet{.ctr = static_cast<std::uint8_t>(counter++ & 0xF),
                                                                  .set_word = static_cast<std::uint8_t>(word),
                                                                  .set_row_id = row.index,
                                                                  .set_value = word_of(to, row, word)}))));
      if (++open < kAtOnce) continue;
      if (auto answered = await(link, std::exchange(open, 0), row_answer); !answered) return answered;
    }
  if (auto answered = await(link, open, row_answer); !answered) return answered;
  const std::uint8_t apply = counter & 0xF;
  static_cast<void>(link.send(bus::frame(
      from.can_base,
      bus::protect(bus::CmdParamApply{
          .ctr = apply, .apply_before_crc = param::crc(from) & kName, .apply_after_crc = param::crc(to) & kName}))));
  return await(link, 1, [&](const base::CanFrame& frame) -> std::optional<bus::ParamAnswer> {
    if (frame.id != from.can_base + bus::EstParamRow::kOffset) return std::nullopt;
    const auto told = bus::decode<bus::EstParamSet>(bus::payload(frame));
    if (!told || told->set_page_id != bus::CmdParamApply::kPage || told->set_ctr != apply) return std::nullopt;
    return told->set_answer;
  });
}

}  // namespace tetap::sim
