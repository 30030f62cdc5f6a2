// SPDX-License-Identifier: Apache-2.0
#include "sim_host/page/module/talk.hpp"

#include "sim_host/page/module/browser.hpp"
#include "sim_host/page/module/json.hpp"
#include "sim_host/parameter_refusal.hpp"
#include "sim_host/parameter_word.hpp"
#include "sim_host/replay/candump.hpp"
#include "tetap/bus/codec.hpp"
#include "tetap/bus/e2e.hpp"
#include "tetap/bus/parameter_commands.hpp"
#include "tetap/param/crc.hpp"
#include "tetap/param/limits.hpp"
#include "tetap/param/staged.hpp"
#include "tetap/param/table.hpp"

#include <iterator>
#include <string>

namespace tetap::page {

namespace {

using sim::put_word;
using sim::word_of;

/// The row, where it has such a word and may be read.
const param::Row* row_with(std::uint32_t number, std::uint32_t word) {
  if (number >= std::size(param::kTable)) return nullptr;
  const param::Row& row = param::kTable[number];
  return word < row.size / 4 && !param::is_secret(row) ? &row : nullptr;
}
sim::Failure no_word(std::uint32_t number, std::uint32_t word) {
  return sim::Failure{"no word " + std::to_string(word) + " of parameter " + std::to_string(number)};
}

void put_values(Json& json, const char* name, const param::Parameters& p, const param::Row& row) {
  json.key(name).begin('[');
  for (std::size_t i = 0; i < row.elements; ++i) json.value(param::is_secret(row) ? 0.0 : row.get(p, i));
  json.end(']');
}

bool beyond(float value, float limit) { return value > limit || value < -limit; }

}  // namespace

template <class Message>
void Talk::send(Message message, std::uint32_t counter) const {
  message.ctr = static_cast<std::uint8_t>(counter & 0xFU);
  sim::Line line;
  sim::append_log_line(line, {}, "page", bus::frame(base_, bus::protect(message)));
  write(Channel::kFrames, line.view());
}

void Talk::describe() const {
  Json json;
  json.begin('{').member("answers", base_ + bus::EstParamRow::kOffset).key("motions").begin('[');
  for (std::uint32_t i = 0; i < bus::EstMotion::kCount; ++i)
    json.value(base_ + bus::EstMotion::kOffset + i * bus::EstMotion::kStride);
  json.end(']').key("words").begin('[');
  for (std::uint32_t number = 0; number < std::size(param::kTable); ++number)
    for (std::uint32_t word = 0; row_with(number, word) != nullptr; ++word)
      json.begin('[').value(number).value(word).end(']');
  write(Channel::kTalk, json.end(']').end('}').text());
}

sim::Result<> Talk::get(std::uint32_t number, std::uint32_t word, std::uint32_t source, std::uint32_t counter) const {
  const param::Row* const row = row_with(number, word);
  if (row == nullptr || source >= sets_.size()) return no_word(number, word);
  send(bus::CmdParamGet{.get_word = static_cast<std::uint8_t>(word),
                        .get_row_id = row->index,
                        .get_source = static_cast<bus::ParamSource>(source)},
       counter);
  return {};
}

sim::Result<> Talk::set(std::uint32_t number, std::uint32_t word, std::uint32_t counter) const {
  const param::Row* const row = row_with(number, word);
  if (row == nullptr) return no_word(number, word);
  send(bus::CmdParamSet{.set_word = static_cast<std::uint8_t>(word),
                        .set_row_id = row->index,
                        .set_value = word_of(wanted_, *row, word)},
       counter);
  return {};
}

sim::Result<> Talk::act(std::uint32_t page, std::uint32_t counter) const {
  constexpr std::uint32_t kName = param::StagedParameters::kName;
  const std::uint32_t before = param::crc(set_of(bus::ParamSource::kActive)) & kName;
  switch (page) {
    case bus::CmdParamApply::kPage:
      send(bus::CmdParamApply{.apply_before_crc = before, .apply_after_crc = param::crc(wanted_) & kName}, counter);
      return {};
    case bus::CmdParamSave::kPage:
      send(bus::CmdParamSave{.save_before_crc = before}, counter);
      return {};
    case bus::CmdParamRestore::kPage:
      send(bus::CmdParamRestore{.restore_before_crc = before}, counter);
      return {};
    default:
      return sim::Failure{"no command of page " + std::to_string(page)};
  }
}

void Talk::hear(const base::CanFrame& frame) {
  const auto bytes = bus::payload(frame);
  if (frame.id != base_ + bus::EstParamRow::kOffset) {
    const auto motion = bus::decode<bus::EstMotion>(bytes);
    if (!motion) return;
    const bool moves = motion->vel_valid && (beyond(motion->speed_mps, bus::ParameterCommands::kStill_mps) ||
                                             beyond(motion->yaw_rate_radps, bus::ParameterCommands::kStill_radps));
    return write(Channel::kTalk, moves ? R"({"moves":true})" : R"({"moves":false})");
  }
  if (const auto told = bus::decode<bus::EstParamSet>(bytes)) {
    Json json;
    json.begin('{')
        .member("page", int{told->set_page_id})
        .member("answer", static_cast<int>(told->set_answer))
        .member("counter", told->set_ctr)
        .member("pending", told->set_pending)
        .member("changed", told->set_changed)
        .member("wanted", bool{told->set_config == param::crc(wanted_)})
        .member("config", told->set_config);
    return write(Channel::kTalk, json.end('}').text());
  }
  const auto told = bus::decode<bus::EstParamRow>(bytes);
  if (!told || static_cast<std::size_t>(told->row_source) >= sets_.size()) return;
  for (std::uint32_t number = 0; number < std::size(param::kTable); ++number) {
    if (param::kTable[number].index != told->row_id) continue;
    const param::Row* const row = row_with(number, told->row_word);
    if (row == nullptr) return;
    const bool asked = told->row_ctr != bus::EstParamRow::kRowCtrNotAvailable;
    if (asked && told->row_answer == bus::ParamAnswer::kDone)
      put_word(set_of(told->row_source), *row, told->row_word, told->row_value);
    Json json;
    json.begin('{')
        .member("number", number)
        .member("word", told->row_word)
        .member("source", static_cast<int>(told->row_source))
        .member("answer", static_cast<int>(told->row_answer))
        .member("asked", bool{asked});
    return write(Channel::kTalk, json.end('}').text());
  }
}

sim::Result<> Talk::want(std::uint32_t number, std::uint32_t element, double value) {
  const param::Row* const row = row_with(number, 0);
  if (row == nullptr || element >= row->elements) return no_word(number, element);
  if (std::string why = sim::refusal_of(*row, value); !why.empty()) return sim::Failure{std::move(why)};
  row->set(wanted_, element, value);
  return {};
}

sim::Result<> Talk::check() const {
  param::Parameters whole = wanted_;
  // The node never sends its key: any one keeps the rules.
  whole.bus.key = {whole.bus.commands == param::CommandAccess::kAuthenticated ? 1U : 0U, 0, 0, 0};
  if (const param::Rule* const broken = param::broken_rule(whole); broken != nullptr)
    return sim::Failure{std::string(broken->path) + " has to be " + broken->text};
  Json json;
  json.begin('{').key("words").begin('[');
  for (std::uint32_t number = 0; number < std::size(param::kTable); ++number)
    for (std::uint32_t word = 0; row_with(number, word) != nullptr; ++word)
      if (word_of(wanted_, param::kTable[number], word) !=
          word_of(set_of(bus::ParamSource::kStaged), param::kTable[number], word))
        json.begin('[').value(number).value(word).end(']');
  write(Channel::kTalk, json.end(']').end('}').text());
  return {};
}

void Talk::values() const {
  const param::Parameters& active = set_of(bus::ParamSource::kActive);
  sim::Line config;
  config.hex(param::crc(active), 8);
  Json json;
  json.begin('{').member("config", config.view()).member("access", static_cast<int>(active.bus.commands));
  json.key("rows").begin('[');
  for (std::size_t i = 0; i < std::size(param::kTable); ++i) {
    const param::Row& row = param::kTable[i];
    json.begin('{').member("fixed", bool{param::kStoredRows[i].access});
    put_values(json, "active", active, row);
    put_values(json, "compiled", set_of(bus::ParamSource::kCompiled), row);
    put_values(json, "wanted", wanted_, row);
    json.end('}');
  }
  write(Channel::kTalk, json.end(']').end('}').text());
}

}  // namespace tetap::page
