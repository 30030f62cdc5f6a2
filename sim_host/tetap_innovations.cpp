// SPDX-License-Identifier: Apache-2.0
// tetap-innovations: plays logs to a robot in this process, again for each line of settings on its input, and writes
// the innovations of every update. It sees what a build with TETAP_VIEWS shows; the estimates are those of the robot.
#include "sim_host/parameter_settings.hpp"
#include "sim_host/replay/complaint.hpp"
#include "sim_host/replay/line.hpp"
#include "sim_host/replay/lockstep.hpp"
#include "sim_host/replay/memory_node.hpp"
#include "sim_host/replay/survey.hpp"
#include "sim_host/robots.hpp"
#include "sim_host/tune/innovation_log.hpp"
#include "version.hpp"

#include <bit>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <exception>
#include <fstream>
#include <iostream>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

namespace {

using namespace tetap;

std::string help() {
  return "usage: tetap-innovations LOG... [OPTION]...\n\n"
         "For each line on its input, `path=value` words over the robot's parameters, each LOG is played to the "
         "robot.\n"
         "Output for a log: a line of JSON (models, terms, state_crc, epochs; or why it was refused), then so many "
         "terms:\n"
         "int32 time [ms]; float NIS, gate, ln d, e; 4 bytes model, verdict, component, components. nu and S in "
         "sequence:\n"
         "S = L D L^T, e = L^-1 nu.\n\n"
         "  --robot NAME       (default rover): " +
         sim::robot_names() + "\n" + std::string(sim::kParameterHelp);
}

struct Input {
  std::string name;
  std::vector<sim::TimedFrame> frames;
  bool has_ticks = false;
};

Input read(const std::string& name, const sim::ScriptOptions& script) {
  std::ifstream file(name, std::ios::binary);
  std::ostringstream text;
  if (!file || !(text << file.rdbuf())) throw sim::UsageError(name + ": " + std::strerror(errno));
  sim::Log log = sim::parse_log(text.view(), name, {.interface = {}, .base = script.log_base});
  if (log.failure) throw sim::UsageError(log.failure->text);
  Input input{.name = name, .frames = std::move(log.frames)};
  sim::FramesInMemory frames(input.frames);
  const auto survey = sim::survey_of(frames, name, sim::PlayMode::kLockstep, script);
  if (!survey) throw sim::UsageError(survey.failure().text);
  if (survey->ticks == 0) throw sim::UsageError(name + ": no input frames of this id base");
  input.has_ticks = survey->has_ticks;
  return input;
}

/// Gives each update its time.
struct Listener {
  void restarted() {}
  void sent(const base::CanFrame&) {}
  void received(const base::CanFrame&) {}
  void epoch(const sim::NodeEpoch& epoch, base::Micros time) {
    if (!first) first = time;
    log.next(time - *first);
    state_crc = epoch.tail.crc;
  }

  sim::InnovationLog log;
  std::optional<base::Micros> first;
  std::uint32_t state_crc = 0;
};

void put(const std::string& line, const std::vector<sim::InnovationTerm>& terms) {
  static_assert(std::endian::native == std::endian::little);
  std::fputs((line + "\n").c_str(), stdout);
  std::fwrite(terms.data(), sizeof terms[0], terms.size(), stdout);
  if (std::fflush(stdout) != 0) throw std::runtime_error(std::string("the output: ") + std::strerror(errno));
}

void play(const Input& input, const sim::Robot& robot, const param::Parameters& parameters,
          const sim::ScriptOptions& script) {
  sim::FramesInMemory frames(input.frames);
  sim::LogTicks ticks(frames, script, input.has_ticks);
  sim::MemoryNode node(robot, parameters, version());
  const sim::LockstepOptions options{.base = script.base, .window = 1};  // so that the time of an update is known
  sim::Counts counts;
  Listener heard;
  const auto played = sim::play_lockstep(node.link(), ticks, heard, options, counts);
  if (!played) throw std::runtime_error(input.name + ": " + played.failure().text);
  if (const std::string wrong = sim::complaint(counts, nullptr); !wrong.empty())
    throw std::runtime_error(input.name + ": " + wrong);
  std::string models;
  for (const std::string& model : heard.log.models()) models += (models.empty() ? "\"" : ", \"") + model + "\"";
  put("{\"models\": [" + models + "], \"terms\": " + std::to_string(heard.log.terms().size()) + ", \"state_crc\": " +
          std::to_string(heard.state_crc) + ", \"epochs\": " + std::to_string(counts.epochs) + "}",
      heard.log.terms());
}

}  // namespace

int main(int argc, char** argv) try {
  sim::Arguments arguments(argc, argv);
  if (arguments.flag("--help") || arguments.flag("-h")) return std::fputs(help().c_str(), stdout), 0;
  if (!filter::kViewsUpdates) throw std::runtime_error("this build's filters show no updates; make tune builds one");
  const std::string name = arguments.text("--robot").value_or("rover");
  const sim::ParameterSettings given(arguments);
  const sim::Robot& robot = sim::robot_named(name);
  const param::Parameters begun = sim::parameters_of(name, given);
  const sim::ScriptOptions script{
      .base = begun.can_base, .log_base = begun.can_base, .map_inputs = robot.takes.map_inputs()};
  std::vector<Input> inputs;
  while (const auto log = arguments.positional()) inputs.push_back(read(*log, script));
  arguments.finish();
  if (inputs.empty()) throw sim::UsageError("no LOG given (--help says more)");

  for (std::string line; std::getline(std::cin, line);) {
    param::Parameters parameters = begun;
    try {
      sim::ParameterSettings settings;
      std::istringstream words(line);
      for (std::string word; words >> word;) settings.set(word, word);
      parameters = settings.over(begun);
    } catch (const sim::UsageError& error) {
      for (std::size_t i = 0; i < inputs.size(); ++i) put("{\"refused\": " + sim::quoted(error.what()) + "}", {});
      continue;
    }
    parameters = sim::MemoryNode::for_player(parameters, begun.can_base);
    for (const Input& input : inputs) play(input, robot, parameters, script);
  }
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "tetap-innovations: %s\n", error.what());
  return 2;
}
