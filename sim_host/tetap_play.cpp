// SPDX-License-Identifier: Apache-2.0
// tetap-play: plays a candump log to a node, on a CAN interface or in its own process, and records what it answers.
#include "hal/board/linux/socket_can.hpp"
#include "hal/chip/support/boot_line.hpp"
#include "sim_host/in_process.hpp"
#include "sim_host/kept_words.hpp"
#include "sim_host/parameter_settings.hpp"

#include "sim_host/play/play.hpp"
#include "sim_host/robots.hpp"
#include "version.hpp"

#include <cstdio>
#include <exception>
#include <optional>
#include <stdexcept>
#include <string>

namespace {

using namespace tetap;

/// Begin of the log's node; a line on standard error where its parameters are not its robot's own.
std::optional<sim::Begun> begun_of(sim::SurveyedLog& log, sim::PlayOptions& options,
                                   const sim::ParameterSettings& settings) {
  if (options.robot.empty()) return std::nullopt;
  const param::Parameters of_node =
      sim::MemoryNode::for_player(sim::parameters_of(options.robot, settings), options.script.base);
  auto begun = sim::begun_of(log.file, options.script.log_base, sim::robot_named(options.robot), of_node);
  if (!begun) return std::nullopt;
  const std::string words = sim::settings_between(begun->built, begun->active) + begun->rest();
  std::fprintf(stderr, "tetap-play: %s: its node began with %s%s\n", options.log.c_str(), words.c_str(),
               options.memory ? "" : "; the node that it is played to needs them as well (SET=)");
  options.notes.emplace_back("began_with", sim::quoted(words));
  return begun;
}

}  // namespace

int main(int count, char** values) {
  try {
    sim::Arguments arguments(count, values);
    if (arguments.flag("--help") || arguments.flag("-h"))
      return std::fputs(sim::play_help(sim::robot_names()).c_str(), stdout), 0;
    const sim::ParameterSettings settings(arguments);
    sim::PlayOptions options = sim::play_options(arguments, settings.can_base());
    options.version = hal::version_text(version()).c_str();
    if (options.robot.empty() && !settings.words().empty()) throw sim::UsageError("--params and --set need --robot");
    if (!options.robot.empty()) {
      options.notes = sim::parameter_notes(sim::parameters_of(options.robot, settings), settings);
      options.script.map_inputs = sim::robot_named(options.robot).takes.map_inputs();
    }
    sim::Interruption::expect();
    // Before the bus, so that an unreadable log is reported also where there is no bus.
    sim::SurveyedLog log = sim::survey_for(options);
    const auto begun = begun_of(log, options, settings);
    if (options.memory)
      return sim::with_node_in_process(options.robot, settings, options.script.base, [&](auto& link) {
        const sim::Result<> made = begun ? sim::make_active(link, begun->from, begun->to) : sim::Result<>{};
        if (!made) throw std::runtime_error(made.failure().text);
        return sim::play(link, options, log, "memory", "tetap-play");
      });
    hal::SocketCan can(options.interface);
    return sim::play(can, options, log, options.interface, "tetap-play");
  } catch (const std::exception& error) {
    std::fprintf(stderr, "tetap-play: %s\n", error.what());
    return 2;
  }
}
