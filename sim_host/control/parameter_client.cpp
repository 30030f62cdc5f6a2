// SPDX-License-Identifier: Apache-2.0
#include "sim_host/control/parameter_client.hpp"

#include "tetap/bus/codec.hpp"
#include "tetap/bus/e2e.hpp"
#include "tetap/param/crc.hpp"
#include "tetap/param/limits.hpp"
#include "tetap/param/staged.hpp"
#include "tetap/param/table.hpp"

#include <cstring>
#include <string>

namespace tetap::sim {
namespace {

constexpr int kAttempts = 5;
constexpr base::Micros kPatience{300'000};         ///< for the answers of one attempt
constexpr base::Micros kSavePatience{10'000'000};  ///< flash may be erased before the answer
constexpr std::size_t kAtOnce = 6;                 ///< a node answers one a tick, and keeps eight

std::uint32_t word_of(const param::Parameters& p, const param::Row& row, std::size_t word) {
  std::uint32_t value = 0;
  std::memcpy(&value, reinterpret_cast<const char*>(&p) + row.offset + 4 * word, sizeof value);
  return value;
}
std::string why(bus::ParamAnswer answer) {
  switch (answer) {
    case bus::ParamAnswer::kUnknown:
      return "the node has no such row";
    case bus::ParamAnswer::kOutOfLimits:
      return "the node refuses the value: it is out of the row's limits";
    case bus::ParamAnswer::kRefused:
      return "the node refuses it: the row is one of access or identity, or commands need a tag";
    case bus::ParamAnswer::kOtherActive:
      return "somebody else has changed the node's parameters meanwhile; read them again";
    case bus::ParamAnswer::kOtherStaged:
      return "somebody else has staged a parameter meanwhile; nothing was changed";
    case bus::ParamAnswer::kNotTogether:
      return "a rule between rows is broken; nothing was changed";
    case bus::ParamAnswer::kNotKept:
      return "this board keeps no parameters, or its flash has failed";
    case bus::ParamAnswer::kBusy:
      return "the node is busy with another command; or it moves, is in lockstep, or was saved within the last minute";
    default:
      return "the node gave answer " + std::to_string(static_cast<int>(answer));
  }
}

}  // namespace

template <class Message>
std::uint8_t ParameterClient::send(Message message) {
  message.ctr = counter_++ & 0xF;
  send_(bus::frame(can_base_, bus::protect(message)));
  return message.ctr;
}

std::optional<base::CanFrame> ParameterClient::answer(base::Micros until) {
  for (base::Micros left = until - now_(); left.us > 0; left = until - now_()) {
    const auto frame = receive_(left);
    if (frame && !frame->extended && frame->id == can_base_ + bus::EstParamRow::kOffset) return frame;
  }
  return std::nullopt;
}

template <class Make>
void ParameterClient::exchange(std::vector<Word>& words, bus::ParamSource source, Make&& make) {
  for (std::size_t first = 0; first < words.size(); first += kAtOnce) {
    std::vector<Word*> open;
    for (std::size_t i = first; i < words.size() && i < first + kAtOnce; ++i) open.push_back(&words[i]);
    for (int attempt = 0; !open.empty(); ++attempt) {
      if (attempt == kAttempts)
        throw ControlError(std::string(open[0]->row->path) +
                           ": no answer; is the node running, and does its robot take parameters from the bus?");
      for (const Word* word : open) send(make(*word));
      const base::Micros until = now_() + kPatience;
      while (!open.empty()) {
        const auto frame = answer(until);
        if (!frame) break;
        const auto told = bus::decode<bus::EstParamRow>(bus::payload(*frame));
        if (!told || told->row_source != source || told->row_ctr == bus::EstParamRow::kRowCtrNotAvailable) continue;
        for (std::size_t i = 0; i < open.size(); ++i) {
          if (open[i]->row->index != told->row_id || open[i]->word != told->row_word) continue;
          if (told->row_answer != bus::ParamAnswer::kDone)
            throw ControlError(std::string(open[i]->row->path) + ": " + why(told->row_answer));
          open[i]->value = told->row_value;
          open.erase(open.begin() + static_cast<std::ptrdiff_t>(i));
          break;
        }
      }
    }
  }
}

param::Parameters ParameterClient::read(bus::ParamSource source) {
  std::vector<Word> words;
  for (const param::Row& row : param::kTable)
    for (std::uint8_t word = 0; word < row.size / 4; ++word)
      if (!param::is_secret(row)) words.push_back({&row, word});
  exchange(words, source, [&](const Word& word) {
    return bus::CmdParamGet{.get_word = word.word, .get_row_id = word.row->index, .get_source = source};
  });
  param::Parameters p;
  p.bus.key = {};
  for (const Word& word : words)
    std::memcpy(reinterpret_cast<char*>(&p) + word.row->offset + std::size_t{4} * word.word, &word.value, 4);
  return p;
}

template <class Message, class Done>
bus::EstParamSet ParameterClient::act(const Message& message, base::Micros patience, Done&& done) {
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    const std::uint8_t counter = send(message);
    const base::Micros until = now_() + patience;
    while (const auto frame = answer(until)) {
      const auto told = bus::decode<bus::EstParamSet>(bus::payload(*frame));
      if (!told || told->set_ctr != counter || told->set_page_id != Message::kPage) continue;
      // A second attempt may follow one that was obeyed, whose answer was lost.
      if (told->set_answer == bus::ParamAnswer::kDone || (attempt > 0 && done(*told))) return *told;
      throw ControlError(why(told->set_answer));
    }
  }
  throw ControlError("no answer to the change; read the parameters again to see whether it was made");
}

bus::EstParamSet ParameterClient::change(const param::Parameters& before, const param::Parameters& wanted) {
  if (const param::Rule* const rule = param::broken_rule(wanted)) throw ControlError(rule->text);
  const param::Parameters staged = read(bus::ParamSource::kStaged);
  std::vector<Word> words;
  for (const param::Row& row : param::kTable)
    for (std::uint8_t word = 0; word < row.size / 4; ++word)
      if (!param::is_secret(row) && word_of(wanted, row, word) != word_of(staged, row, word))
        words.push_back({&row, word, word_of(wanted, row, word)});
  exchange(words, bus::ParamSource::kStaged, [](const Word& word) {
    return bus::CmdParamSet{.set_word = word.word, .set_row_id = word.row->index, .set_value = word.value};
  });
  return apply(before, wanted);
}

bus::EstParamSet ParameterClient::apply(const param::Parameters& before, const param::Parameters& staged) {
  constexpr std::uint32_t kName = param::StagedParameters::kName;
  return act(
      bus::CmdParamApply{.apply_before_crc = param::crc(before) & kName, .apply_after_crc = param::crc(staged) & kName},
      kPatience, [&](const bus::EstParamSet& told) { return told.set_config == param::crc(staged); });
}

bus::EstParamSet ParameterClient::apply(const param::Parameters& before) {
  return apply(before, read(bus::ParamSource::kStaged));
}

bus::EstParamSet ParameterClient::save(const param::Parameters& before) {
  return act(bus::CmdParamSave{.save_before_crc = param::crc(before) & param::StagedParameters::kName}, kSavePatience,
             [](const bus::EstParamSet&) { return false; });
}

bus::EstParamSet ParameterClient::restore(const param::Parameters& before) {
  return act(bus::CmdParamRestore{.restore_before_crc = param::crc(before) & param::StagedParameters::kName}, kPatience,
             [](const bus::EstParamSet& told) { return told.set_changed == 0; });
}

}  // namespace tetap::sim
