// SPDX-License-Identifier: Apache-2.0
// The log player as a function of its command line and a link to the node. One program plays over SocketCAN, another to
// a firmware in its own process.
#pragma once

#include "sim_host/play/arguments.hpp"
#include "sim_host/play/interruption.hpp"
#include "sim_host/play/log_file.hpp"
#include "sim_host/play/perturb.hpp"
#include "sim_host/play/realtime.hpp"
#include "sim_host/play/session.hpp"
#include "sim_host/replay/lockstep.hpp"
#include "sim_host/replay/survey.hpp"

#include <cstdint>
#include <cstdio>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace tetap::sim {

struct PlayOptions {
  std::string log;
  std::string interface;
  std::string folder;
  std::string robot;
  std::string version;  ///< version of the program
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

/// A log that was read once, to its end, and is read again as it is played.
struct SurveyedLog : LogSurvey {
  LogFile file;
};

/// Reads the log and settles the mode: a log with the node's own frames in it is a record to be repeated.
[[nodiscard]] SurveyedLog survey_for(PlayOptions& options);

/// Refusal of a log without a data frame, with its other frames counted.
[[nodiscard]] std::string no_data_frame(const LogReport& log);

/// Warnings about the log, one line each.
void warn_about(const LogReport& log, const char* program);

/// Plays what `survey_for` read; returns the exit status. Throws std::runtime_error for what cannot be begun.
template <Link L>
int play(L& link, const PlayOptions& options, SurveyedLog& log, const std::string& bus, const char* program) {
  const LogReport& report = log.file.report();
  warn_about(report, program);
  SessionOptions about{.program = program,
                       .version = options.version,
                       .folder = options.folder,
                       .base = options.script.base,
                       .raw = options.raw,
                       .mode = "lockstep",
                       .bus = bus,
                       .robot = options.robot,
                       .log = options.log,
                       .quiet = options.quiet};
  const auto note_log = [&report, &notes = options.notes](Session& session) {
    session.note("malformed_lines", std::to_string(report.malformed));
    session.note("frames_not_data", std::to_string(report.not_data));
    session.note("frames_back_in_time", std::to_string(report.back_in_time));
    session.note("frames_of_wrong_length", std::to_string(report.wrong_length));
    for (const auto& [name, json] : notes) session.note(name, json);
  };

  if (options.mode == PlayMode::kRealtime) {
    if (log.inputs == 0) throw std::runtime_error(options.log + ": no input frames of this id base");
    const Perturbed sent = perturb(inputs_of(log.file, options.script), options.perturbation);
    about.mode = "realtime";
    Session session(about);
    note_log(session);
    session.note("seed", std::to_string(options.perturbation.seed));
    session.note("frames_dropped", std::to_string(sent.dropped));
    session.note("frames_duplicated", std::to_string(sent.duplicated));
    session.note("frames_reordered", std::to_string(sent.reordered));
    return session.run([&] { return play_realtime(link, sent.frames, session, options.realtime, session.counts()); });
  }

  if (options.mode == PlayMode::kAsRecorded) {
    if (!log.recording) throw std::runtime_error(log.refusal);
    const Recording& recording = *log.recording;
    about.mode = "as-recorded";
    about.ticks = recording.epochs;
    RecordedTicks ticks(log.file, recording, options.script);
    Comparison comparison(ticks, recording, options.script);
    Session session(about, &comparison);
    note_log(session);
    session.note("epochs_before_start", std::to_string(recording.skipped_epochs));
    return session.run([&] { return play_lockstep(link, ticks, session, options.lockstep, session.counts()); });
  }

  if (log.ticks == 0) throw std::runtime_error(options.log + ": no input frames of this id base");
  LogTicks ticks(log.file, options.script, log.has_ticks);
  about.ticks = log.ticks;
  Session session(about);
  note_log(session);
  return session.run([&] { return play_lockstep(link, ticks, session, options.lockstep, session.counts()); });
}

}  // namespace tetap::sim
