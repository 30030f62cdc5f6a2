// SPDX-License-Identifier: Apache-2.0
#include "sim_host/control/parameter_client.hpp"

#include "sim_host/parameter_word.hpp"
#include "tetap/bus/codec.hpp"
#include "tetap/bus/e2e.hpp"
#include "tetap/param/crc.hpp"
#include "tetap/param/limits.hpp"
#include "tetap/param/staged.hpp"
#include "tetap/param/table.hpp"

#include <string>

namespace tetap::sim {
namespace {

constexpr int kAttempts = 5;
constexpr base::Micros kPatience{300'000};         ///< for the answers of one attempt
constexpr base::Micros kSavePatience{10'000'000};  ///< flash may be erased before the answer
constexpr std::size_t kAtOnce = 6;                 ///< a node answers one a tick, and keeps eight
constexpr int kTagAttempts = 3;
constexpr base::Micros kNoncePatience{4'000'000};
constexpr const char* kRowWhy = "the node refuses it: the row is one of access or identity, or it takes no commands";
constexpr const char* kKeyWhy =
    "the node takes no first key: it has one, it was switched on a minute ago or more, another sender has begun it, or "
    "its robot names no WithBusProtection";
constexpr const char* kTagWhy = "the node refuses the tag: it has another key";

std::string why(bus::ParamAnswer answer) {
  switch (answer) {
    case bus::ParamAnswer::kUnknown:
      return "the node has no such row";
    case bus::ParamAnswer::kOutOfLimits:
      return "the node refuses the value: it is out of the row's limits";
    case bus::ParamAnswer::kRefused:
      return kRowWhy;
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
std::uint8_t ParameterClient::send(Message message, bool tagged, bool hurry) {
  message.ctr = counter_++ & 0xF;
  const base::CanFrame frame = bus::frame(can_base_, bus::protect(message));
  if (tagged)
    for (const base::CanFrame& tag : tags_->before(frame, now_(), hurry)) send_(tag);
  send_(frame);
  return message.ctr;
}

std::optional<base::CanFrame> ParameterClient::receive(base::Micros patience) {
  auto frame = receive_(patience);
  if (frame && tags_) tags_->on_frame(*frame);
  return frame;
}

void ParameterClient::await_nonce() {
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    tags_->forget();
    const base::Micros until = now_() + kNoncePatience;
    for (base::Micros left = until - now_(); left.us > 0 && !tags_->nonce(); left = until - now_())
      static_cast<void>(receive(left));
    if (!tags_->nonce()) break;
    if (*tags_->nonce() != 0) return;
    static_cast<void>(read(bus::ParamSource::kActive));  // frames from which the node makes its first nonce
  }
  throw ControlError("the node publishes no number for tags (Est_Diag of page Guard)");
}

std::optional<base::CanFrame> ParameterClient::answer(base::Micros until) {
  for (base::Micros left = until - now_(); left.us > 0; left = until - now_()) {
    const auto frame = receive(left);
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
          if (told->row_answer == bus::ParamAnswer::kRefused && param::is_secret(*open[i]->row))
            throw ControlError(kKeyWhy);
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
  for (const Word& word : words) put_word(p, *word.row, word.word, word.value);
  if (p.bus.commands == param::CommandAccess::kAuthenticated) p.bus.key = {1, 0, 0, 0};
  return p;
}

template <class Message, class Done>
bus::EstParamSet ParameterClient::act(const Message& message, param::CommandAccess access, base::Micros patience,
                                      Done&& done) {
  if (access == param::CommandAccess::kNone) throw ControlError("the node takes no commands: its bus.commands is 2");
  const bool tagged = access == param::CommandAccess::kAuthenticated;
  if (tagged && !tags_) throw ControlError("the node obeys commands with a tag alone: its key is missing");
  int refused = 0;
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    if (tagged) await_nonce();
    const std::uint8_t counter = send(message, tagged, refused > 0);
    const base::Micros until = now_() + patience;
    while (const auto frame = answer(until)) {
      const auto told = bus::decode<bus::EstParamSet>(bus::payload(*frame));
      if (!told || told->set_ctr != counter || told->set_page_id != Message::kPage) continue;
      // A second attempt may follow one that was obeyed, whose answer was lost.
      const bool wrong_tag = tagged && told->set_answer == bus::ParamAnswer::kRefused;
      if (told->set_answer == bus::ParamAnswer::kDone || (attempt > 0 && !wrong_tag && done(*told))) return *told;
      if (!wrong_tag) throw ControlError(why(told->set_answer));
      // A tag was lost, or another client has used a greater counter.
      if (++refused == kTagAttempts) throw ControlError(kTagWhy);
      break;
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
  stage(words);
  return apply(before, wanted);
}

void ParameterClient::stage(std::vector<Word>& words) {
  exchange(words, bus::ParamSource::kStaged, [](const Word& word) {
    return bus::CmdParamSet{.set_word = word.word, .set_row_id = word.row->index, .set_value = word.value};
  });
}

bus::EstParamSet ParameterClient::claim(const param::Parameters& before) {
  if (!key_) throw ControlError("the key is missing");
  if (before.bus.commands != param::CommandAccess::kOpen) throw ControlError(kKeyWhy);
  const param::Parameters staged = read(bus::ParamSource::kStaged);
  std::vector<Word> words;
  for (std::size_t i = 0; i < param::kTable.size(); ++i)
    for (std::uint8_t word = 0; word < param::kTable[i].size / 4; ++word) {
      const param::Row& row = param::kTable[i];
      if (param::is_secret(row))
        words.push_back({&row, word, (*key_)[word]});
      else if (!param::kStoredRows[i].access && word_of(before, row, word) != word_of(staged, row, word))
        words.push_back({&row, word, word_of(before, row, word)});
    }
  stage(words);
  param::Parameters owned = before;
  owned.bus.commands = param::CommandAccess::kAuthenticated;
  const bus::EstParamSet told = apply(before, owned);
  // The CRC does not cover the key: a tag proves that no other sender's words are in it.
  const param::Parameters active = read(bus::ParamSource::kActive);
  apply(active, active);
  return told;
}

bus::EstParamSet ParameterClient::apply(const param::Parameters& before, const param::Parameters& staged) {
  constexpr std::uint32_t kName = param::StagedParameters::kName;
  return act(
      bus::CmdParamApply{.apply_before_crc = param::crc(before) & kName, .apply_after_crc = param::crc(staged) & kName},
      before.bus.commands, kPatience,
      [&](const bus::EstParamSet& told) { return told.set_config == param::crc(staged); });
}

bus::EstParamSet ParameterClient::apply(const param::Parameters& before) {
  return apply(before, read(bus::ParamSource::kStaged));
}

bus::EstParamSet ParameterClient::restart(const param::Parameters& before) {
  constexpr std::uint32_t kName = param::StagedParameters::kName;
  const std::uint32_t staged = param::crc(read(bus::ParamSource::kStaged));
  return act(
      bus::CmdParamRestart{.restart_before_crc = param::crc(before) & kName, .restart_after_crc = staged & kName},
      before.bus.commands, kPatience,
      [&](const bus::EstParamSet& told) { return told.set_config == staged && told.set_pending == 0; });
}

bus::EstParamSet ParameterClient::save(const param::Parameters& before) {
  return act(bus::CmdParamSave{.save_before_crc = param::crc(before) & param::StagedParameters::kName},
             before.bus.commands, kSavePatience, [](const bus::EstParamSet&) { return false; });
}

bus::EstParamSet ParameterClient::restore(const param::Parameters& before) {
  const param::Parameters compiled = read(bus::ParamSource::kCompiled);
  int kept = 0;  // words of access that are not as compiled
  for (std::size_t i = 0; i < param::kTable.size(); ++i)
    for (std::uint8_t word = 0; word < param::kTable[i].size / 4; ++word)
      kept += !param::is_secret(param::kTable[i]) && param::kStoredRows[i].access &&
              word_of(before, param::kTable[i], word) != word_of(compiled, param::kTable[i], word);
  return act(bus::CmdParamRestore{.restore_before_crc = param::crc(before) & param::StagedParameters::kName},
             before.bus.commands, kPatience, [&](const bus::EstParamSet& told) { return told.set_changed == kept; });
}

}  // namespace tetap::sim
