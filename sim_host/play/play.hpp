// SPDX-License-Identifier: Apache-2.0
// The log player as a function of its command line and a link to the node, so that one program plays over SocketCAN and
// another to a firmware in its own process.
#pragma once

#include "sim_host/play/arguments.hpp"
#include "sim_host/play/lockstep.hpp"
#include "sim_host/play/perturb.hpp"
#include "sim_host/play/realtime.hpp"
#include "sim_host/play/session.hpp"

#include <cstdint>
#include <cstdio>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace tetap::sim {

enum class PlayMode : std::uint8_t { kAutomatic, kLockstep, kRealtime, kAsRecorded };

struct PlayOptions {
  std::string log;
  std::string interface;
  std::string folder;
  std::string robot;
  PlayMode mode = PlayMode::kAutomatic;
  ScriptOptions script;
  LogOptions reading;
  LockstepOptions lockstep;
  RealtimeOptions realtime;
  Perturbation perturbation;
  std::vector<std::pair<std::string, std::string>> notes;  ///< further lines of run.json: name and JSON
  bool memory = false;                                     ///< the node is in this process
  bool raw = false;
  bool quiet = false;
};

/// `robots`: the names that there are.
[[nodiscard]] std::string play_help(std::string_view robots);

/// Takes the player's options out of the command line, LOG included, and refuses what is left; throws UsageError.
/// `can_base` is what --base is without being given.
[[nodiscard]] PlayOptions play_options(Arguments& arguments, std::uint32_t can_base = 0x300);

/// Reads the log and settles the mode: a log with the node's own frames in it is a record to be repeated.
[[nodiscard]] Log load_for(PlayOptions& options);

/// Warnings about the log, one line each.
void warn_about(const Log& log, const char* program);

/// Plays what `load_for` read; returns the exit status. Throws std::runtime_error for what cannot be begun.
template <Link L>
int play(L& link, const PlayOptions& options, const Log& log, const std::string& bus, const char* program) {
  warn_about(log, program);
  SessionOptions about{.program = program,
                       .folder = options.folder,
                       .base = options.script.base,
                       .raw = options.raw,
                       .mode = "lockstep",
                       .bus = bus,
                       .robot = options.robot,
                       .log = options.log,
                       .quiet = options.quiet};
  const auto note_log = [&log, &notes = options.notes](Session& session) {
    session.note("malformed_lines", std::to_string(log.malformed));
    session.note("frames_not_data", std::to_string(log.not_data));
    session.note("frames_back_in_time", std::to_string(log.back_in_time));
    session.note("frames_of_wrong_length", std::to_string(log.wrong_length));
    for (const auto& [name, json] : notes) session.note(name, json);
  };

  if (options.mode == PlayMode::kRealtime) {
    const auto inputs = inputs_of(log.frames, options.script);
    if (inputs.empty()) throw std::runtime_error(options.log + ": no input frames of this id base");
    const Perturbed sent = perturb(inputs, options.perturbation);
    about.mode = "realtime";
    Session session(about);
    note_log(session);
    session.note("seed", std::to_string(options.perturbation.seed));
    session.note("frames_dropped", std::to_string(sent.dropped));
    session.note("frames_duplicated", std::to_string(sent.duplicated));
    session.note("frames_reordered", std::to_string(sent.reordered));
    return session.run([&] { play_realtime(link, sent.frames, session, options.realtime, session.counts()); });
  }

  if (options.mode == PlayMode::kAsRecorded) {
    Recording recording = recording_of(log, options.script);
    if (recording.inputs_differ_at)
      std::fprintf(
          stderr, "%s: %s: from the epoch at %s on the node consumed other input frames than the log holds%s\n",
          program, options.log.c_str(), in_seconds(*recording.inputs_differ_at).c_str(),
          recording.rx_overflow == 0
              ? ""
              : (": its receiver had lost " + std::to_string(recording.rx_overflow) + " (RxOverflow)").c_str());
    about.mode = "as-recorded";
    about.ticks = recording.script.ticks();
    Session session(about, &recording);
    note_log(session);
    session.note("epochs_before_start", std::to_string(recording.skipped_epochs));
    return session.run([&] { play_lockstep(link, recording.script, session, options.lockstep, session.counts()); });
  }

  Script script = script_of(log.frames, options.script);
  if (script.ticks() == 0) throw std::runtime_error(options.log + ": no input frames of this id base");
  about.ticks = script.ticks();
  Session session(about);
  note_log(session);
  return session.run([&] { play_lockstep(link, script, session, options.lockstep, session.counts()); });
}

}  // namespace tetap::sim
