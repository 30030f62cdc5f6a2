// SPDX-License-Identifier: Apache-2.0
// The module's interface: what web/engine.js calls. A function returns 0, or 1 where it has written a refusal.
#include "sim_host/doctor/diagnosis.hpp"
#include "sim_host/page/module/browser.hpp"
#include "sim_host/page/module/description.hpp"
#include "sim_host/page/module/identity.hpp"
#include "sim_host/page/module/json.hpp"
#include "sim_host/page/module/lesson.hpp"
#include "sim_host/page/module/play.hpp"
#include "sim_host/page/module/replay.hpp"
#include "sim_host/page/module/robots.hpp"
#include "sim_host/page/module/seconds.hpp"
#include "sim_host/page/module/tables.hpp"
#include "sim_host/page/module/talk.hpp"
#include "sim_host/parameter_refusal.hpp"
#include "sim_host/replay/candump.hpp"
#include "tetap/bus/codec.hpp"
#include "tetap/bus/e2e.hpp"
#include "tetap/param/limits.hpp"

#include <cmath>
#include <cstdint>
#include <optional>
#include <string>

#define TETAP_EXPORT(name) extern "C" [[clang::export_name(#name)]]

namespace {

using namespace tetap;

struct Chosen {
  const sim::Robot* robot = nullptr;
  param::Parameters parameters;
};
Chosen chosen;
std::optional<page::Play> in_play;
std::optional<page::Lesson> lesson;
std::optional<page::Talk> talk;
page::SensorTables tables;

std::uint32_t refuse(std::string_view why) {
  page::write(page::Channel::kRefusal, why);
  return 1;
}

std::uint32_t ended(const sim::Result<>& done) { return done ? 0 : refuse(done.failure().text); }

base::CanFrame frame_of(std::uint32_t id, std::uint32_t low, std::uint32_t high) {
  base::CanFrame frame{.id = id, .size = 8};
  for (std::size_t i = 0; i < frame.data.size(); ++i)
    frame.data[i] = static_cast<std::uint8_t>((i < 4 ? low : high) >> 8 * (i % 4));
  return frame;
}

}  // namespace

TETAP_EXPORT(describe) void describe() { page::write(page::Channel::kDescription, page::description()); }

/// The robot of that number, with its own parameters.
TETAP_EXPORT(choose) std::uint32_t choose(std::uint32_t robot) {
  if (robot >= page::robots().size()) return refuse("no robot of number " + std::to_string(robot));
  chosen = {page::robots()[robot], *page::robots()[robot]->parameters};
  return 0;
}

/// One element of a parameter, against the limits of its row.
TETAP_EXPORT(set) std::uint32_t set(std::uint32_t number, std::uint32_t element, double value) {
  if (number >= std::size(param::kTable)) return refuse("no parameter of number " + std::to_string(number));
  const param::Row& row = param::kTable[number];
  if (element >= row.elements) return refuse(std::string(row.path) + " has no element " + std::to_string(element));
  if (const std::string why = sim::refusal_of(row, value); !why.empty()) return refuse(why);
  row.set(chosen.parameters, element, value);
  return 0;
}

/// The rules between parameters.
TETAP_EXPORT(check) std::uint32_t check() {
  const param::Rule* const broken = param::broken_rule(chosen.parameters);
  if (broken != nullptr) return refuse(std::string(broken->path) + " has to be " + broken->text);
  if (chosen.robot != nullptr && chosen.robot->takes.needs_map_ids() && !param::has_map_ids(chosen.parameters.can_base))
    return refuse(std::string("can_base has to be ") + param::kMapIdsRule);
  return 0;
}

/// The estimators of another robot, with the numbers that were chosen.
TETAP_EXPORT(borrow) std::uint32_t borrow(std::uint32_t robot) {
  if (robot >= page::robots().size()) return refuse("no robot of number " + std::to_string(robot));
  if (chosen.robot == nullptr) return refuse("no robot is chosen");
  chosen.robot = page::robots()[robot];
  return 0;
}

/// The node whose log it is.
TETAP_EXPORT(identify) std::uint32_t identify() {
  const auto identity = page::identity_of_log();
  if (!identity) return refuse(identity.failure().text);
  page::write(page::Channel::kLog, *identity);
  return 0;
}

/// Plays the log; `mode` is a sim::PlayMode.
TETAP_EXPORT(replay) std::uint32_t replay(std::uint32_t base, std::uint32_t mode, std::uint32_t keep_going) {
  if (chosen.robot == nullptr) return refuse("no robot is chosen");
  return ended(page::replay(*chosen.robot, chosen.parameters,
                            {.base = base, .mode = static_cast<sim::PlayMode>(mode), .keep_going = keep_going != 0}));
}

/// The updates of the node's filters for `span_s` up to the epoch of that time.
TETAP_EXPORT(updates)
std::uint32_t updates(std::uint32_t base, std::uint32_t mode, std::uint32_t keep_going, double time_s, double span_s) {
  if (chosen.robot == nullptr) return refuse("no robot is chosen");
  if (!(time_s > -1e9 && time_s < 1e9 && span_s >= 0 && span_s <= 10)) return refuse("no time");
  const page::ReplayOptions options{
      .base = base, .mode = static_cast<sim::PlayMode>(mode), .keep_going = keep_going != 0};
  return ended(page::updates_until(*chosen.robot, chosen.parameters, options, {std::llround(time_s * 1e6)},
                                   {std::llround(span_s * 1e6)}));
}

/// The doctor's findings; `of_robot` 0: by the log alone.
TETAP_EXPORT(diagnose) std::uint32_t diagnose(std::uint32_t base, std::uint32_t of_robot, std::uint32_t keep_going) {
  page::BrowserLog log("log", {.interface = {}, .keep_going = keep_going != 0, .base = base});
  const bool known = of_robot != 0 && chosen.robot != nullptr;
  const auto facts = known ? doctor::facts_of(chosen.robot->name, chosen.parameters, chosen.robot->takes.inertial)
                           : doctor::RobotFacts{};
  const auto found = doctor::diagnose(log, "log", base, facts);
  if (!found) return refuse(found.failure().text);
  page::Json json;
  json.begin('{').member("inputs", found->inputs).member("duration_s", found->duration_s).key("findings").begin('[');
  for (const doctor::Finding& one : found->findings) {
    json.begin('{')
        .member("code", doctor::row(one.code).name)
        .member("cause", doctor::row(one.code).cause)
        .member("evidence", one.evidence)
        .member("change", one.change)
        .key("remedies")
        .begin('[');
    for (const doctor::Remedy& remedy : one.remedies) {
      json.begin('[');
      for (const doctor::Setting& setting : remedy) {
        json.begin('{').member("path", setting.path).key("values").begin('[');
        for (const double value : setting.values) json.value(value);
        json.end(']').end('}');
      }
      json.end(']');
    }
    json.end(']').end('}');
  }
  json.end(']');
  if (found->untold) json.member("untold", *found->untold);
  if (!found->findings.empty()) page::put_seconds(json, found->seconds, facts);
  page::write(page::Channel::kDiagnosis, json.end('}').text());
  return 0;
}

/// A play of the robot of that number, with its own parameters, from its beginning.
TETAP_EXPORT(play) std::uint32_t play(std::uint32_t robot, std::uint32_t seed) {
  if (robot >= page::robots().size()) return refuse("no robot of number " + std::to_string(robot));
  in_play.emplace(*page::robots()[robot], seed);
  return 0;
}

TETAP_EXPORT(advance) std::uint32_t advance(std::uint32_t ticks) {
  if (!in_play) return refuse("nothing is played");
  return ended(in_play->advance(ticks));
}

TETAP_EXPORT(inject) std::uint32_t inject(std::uint32_t fault, std::uint32_t duration_ms) {
  if (!in_play) return refuse("nothing is played");
  return ended(in_play->inject(fault, {std::int64_t{1'000} * duration_ms}));
}

/// A frame of eight bytes to the robot that is played, at its next tick; `low` has the first four.
TETAP_EXPORT(hand) std::uint32_t hand(std::uint32_t id, std::uint32_t low, std::uint32_t high) {
  if (!in_play) return refuse("nothing is played");
  in_play->hand(frame_of(id, low, high));
  return 0;
}

/// The play up to now, as a script.
TETAP_EXPORT(script) std::uint32_t script() {
  if (!in_play) return refuse("nothing is played");
  in_play->script();
  return 0;
}

/// Room for a text of the page: its place in the memory.
TETAP_EXPORT(room) char* room(std::uint32_t size) { return tables.room(size); }
TETAP_EXPORT(add_table) std::uint32_t add_table() { return ended(tables.add_file()); }
TETAP_EXPORT(name_column) std::uint32_t name_column() { return ended(tables.add_column()); }
TETAP_EXPORT(name_unit) std::uint32_t name_unit() { return ended(tables.add_unit()); }
TETAP_EXPORT(columns) void columns() { page::write(page::Channel::kColumns, tables.columns()); }
TETAP_EXPORT(import_tables) std::uint32_t import_tables(std::uint32_t base) { return ended(tables.import(base)); }

/// The lesson from its beginning.
TETAP_EXPORT(begin_lesson)
std::uint32_t begin_lesson(double dt_s, double p0, double q, double r_m2, double gate) {
  for (const double number : {dt_s, p0, q, r_m2})
    if (!(number >= 0 && number <= 1e6)) return refuse("no number of this lesson: " + std::to_string(number));
  lesson.emplace(page::LessonNumbers{.dt_s = static_cast<float>(dt_s),
                                     .p0 = static_cast<float>(p0),
                                     .q = static_cast<float>(q),
                                     .r_m2 = static_cast<float>(r_m2),
                                     .gate = static_cast<float>(gate)});
  return 0;
}
TETAP_EXPORT(step_lesson) std::uint32_t step_lesson(double z_m) {
  if (!lesson) return refuse("no lesson has begun");
  page::write(page::Channel::kUpdates, lesson->step(static_cast<float>(z_m)));
  return 0;
}

/// Writes the frame that asks a node for its state, as a line of a log.
TETAP_EXPORT(ask_snapshot) std::uint32_t ask_snapshot(std::uint32_t base, std::uint32_t counter) {
  if (base > 0x7C0) return refuse("no id base: " + std::to_string(base));
  sim::Line line;
  sim::append_log_line(line, {}, "page",
                       bus::frame(base, bus::protect(bus::CmdReset{.ctr = static_cast<std::uint8_t>(counter & 0x0FU),
                                                                   .what = bus::ResetWhat::kSnapshot})));
  page::write(page::Channel::kFrames, line.view());
  return 0;
}

/// Parameters of a node at a cable, whose block of identifiers begins at `base`.
TETAP_EXPORT(talk_begin) std::uint32_t talk_begin(std::uint32_t base) {
  if (base > 0x780 || !param::has_map_ids(base)) return refuse("no id base: " + std::to_string(base));
  talk.emplace(base);
  talk->describe();
  return 0;
}
TETAP_EXPORT(talk_get)
std::uint32_t talk_get(std::uint32_t number, std::uint32_t word, std::uint32_t source, std::uint32_t counter) {
  return talk ? ended(talk->get(number, word, source, counter)) : refuse("no talk has begun");
}
TETAP_EXPORT(talk_set) std::uint32_t talk_set(std::uint32_t number, std::uint32_t word, std::uint32_t counter) {
  return talk ? ended(talk->set(number, word, counter)) : refuse("no talk has begun");
}
TETAP_EXPORT(talk_act) std::uint32_t talk_act(std::uint32_t page, std::uint32_t counter) {
  return talk ? ended(talk->act(page, counter)) : refuse("no talk has begun");
}
TETAP_EXPORT(talk_hear) std::uint32_t talk_hear(std::uint32_t id, std::uint32_t low, std::uint32_t high) {
  if (!talk) return refuse("no talk has begun");
  talk->hear(frame_of(id, low, high));
  return 0;
}
TETAP_EXPORT(talk_want_staged) std::uint32_t talk_want_staged() {
  if (!talk) return refuse("no talk has begun");
  talk->want_staged();
  return 0;
}
TETAP_EXPORT(talk_want) std::uint32_t talk_want(std::uint32_t number, std::uint32_t element, double value) {
  return talk ? ended(talk->want(number, element, value)) : refuse("no talk has begun");
}
TETAP_EXPORT(talk_check) std::uint32_t talk_check() {
  return talk ? ended(talk->check()) : refuse("no talk has begun");
}
TETAP_EXPORT(talk_values) std::uint32_t talk_values() {
  if (!talk) return refuse("no talk has begun");
  talk->values();
  return 0;
}
