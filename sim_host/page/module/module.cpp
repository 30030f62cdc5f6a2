// SPDX-License-Identifier: Apache-2.0
// The module's interface: what web/engine.js calls. A function returns 0, or 1 where it has written a refusal.
#include "sim_host/doctor/diagnosis.hpp"
#include "sim_host/page/module/browser.hpp"
#include "sim_host/page/module/description.hpp"
#include "sim_host/page/module/identity.hpp"
#include "sim_host/page/module/json.hpp"
#include "sim_host/page/module/play.hpp"
#include "sim_host/page/module/replay.hpp"
#include "sim_host/page/module/robots.hpp"
#include "sim_host/parameter_refusal.hpp"
#include "tetap/param/limits.hpp"

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

std::uint32_t refuse(std::string_view why) {
  page::write(page::Channel::kRefusal, why);
  return 1;
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
  const auto played =
      page::replay(*chosen.robot, chosen.parameters,
                   {.base = base, .mode = static_cast<sim::PlayMode>(mode), .keep_going = keep_going != 0});
  return played ? 0 : refuse(played.failure().text);
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
  for (const doctor::Finding& one : found->findings)
    json.begin('{')
        .member("code", doctor::row(one.code).name)
        .member("cause", doctor::row(one.code).cause)
        .member("evidence", one.evidence)
        .member("change", one.change)
        .end('}');
  page::write(page::Channel::kDiagnosis, json.end(']').end('}').text());
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
  const auto done = in_play->advance(ticks);
  return done ? 0 : refuse(done.failure().text);
}

TETAP_EXPORT(inject) std::uint32_t inject(std::uint32_t fault, std::uint32_t duration_ms) {
  if (!in_play) return refuse("nothing is played");
  const auto done = in_play->inject(fault, {std::int64_t{1'000} * duration_ms});
  return done ? 0 : refuse(done.failure().text);
}

/// The play up to now, as a script.
TETAP_EXPORT(script) std::uint32_t script() {
  if (!in_play) return refuse("nothing is played");
  in_play->script();
  return 0;
}
