// SPDX-License-Identifier: Apache-2.0
#include "sim_host/play/play.hpp"

#include <cmath>
#include <stdexcept>
#include <utility>

namespace tetap::sim {

std::string play_help(std::string_view robots) {
  return R"(usage: tetap-play LOG [OPTION]...

Plays a log to a node and records what it answers.

  LOG                 candump -L log; frames with ids base+0x01 .. base+0x1F are played
  --out DIR           for estimates.log, estimates.csv, innovations.csv, status.csv, sources.csv, run.json (default out/play)
  --can IFACE         the bus (default vcan0)
  --base ID           first id of the node's block (default: can_base of --set, else 0x300)
  --log-base ID       first id of the block in the log (default: as --base)
  --log-interface I   play only frames logged from this interface
  --keep-going        count malformed lines of the log instead of stopping at the first
  --memory            to a node of --robot NAME in this process instead, without a bus
  --robot NAME        with --memory: what the node is; else only written into run.json:
                      )" +
         std::string(robots) + R"(
  --params FILE       with --robot: parameters over the robot's own, `path = value` lines (tetap-params writes one)
  --set PATH=VALUE    one parameter over the robot's own and the file's; may be given more than once
  --raw               also write raw.log: everything on the bus as it came
  --quiet             no progress line

  --lockstep          as fast as the node can; every tick is waited for
  --realtime          every frame at its time
  --as-recorded       the log is the record of a run: repeat it exactly and compare every frame of the node with it
                      (default: --as-recorded when the node speaks in the log, else --lockstep)
  --period MS         between ticks when the log has none (default 10)
  --window N          lockstep: ticks in flight (default 8; 1 for a controller with few receive buffers)
  --burst N           lockstep: send at most N input frames at once ...
  --burst-gap MS      ... then wait so long (default 5)
  --emulated          patience for a node on an emulated core: 20 s for a tick, 120 s for its start

  --sync tick|clock   realtime: a sync frame for each tick, or one at the start and the node on its own timer (default tick)
  --no-begin          realtime: do not restart the node first
  --jitter-ms MS      realtime: delay each frame by 0 to MS
  --drop P            realtime: leave out each frame with probability P
  --duplicate P       realtime: send it twice
  --reorder P         realtime: let it change places with the next
  --seed N            of these four (default 1)

A record is repeated up to the first hole in it (frames that are lost, samples that the bus did not take), from the node's start on
or, with --memory, from a snapshot of its state (make record asks for one).
Exit status: 0; 1: frames were lost, came twice or differ from the record, the record has a hole, or the node does not answer;
2: bad usage, unreadable log, no bus. run.json has the numbers.
)";
}

PlayOptions play_options(Arguments& arguments, std::uint32_t can_base) {
  PlayOptions o;
  o.interface = arguments.text("--can").value_or("vcan0");
  o.memory = arguments.flag("--memory");
  o.robot = arguments.text("--robot").value_or("");
  o.folder = arguments.text("--out").value_or("out/play");
  o.script.base = arguments.base("--base", can_base);
  o.script.log_base = arguments.base("--log-base", o.script.base);
  const auto milliseconds = [&arguments](std::string_view name, double otherwise, double low) {
    return base::Micros{std::llround(arguments.real(name, otherwise, low, 1000) * 1000)};
  };
  o.script.period = milliseconds("--period", 10, 1);
  o.reading.interface = arguments.text("--log-interface").value_or("");
  o.reading.keep_going = arguments.flag("--keep-going");
  o.raw = arguments.flag("--raw");
  o.quiet = arguments.flag("--quiet");

  const bool lockstep = arguments.flag("--lockstep"), realtime = arguments.flag("--realtime"),
             recorded = arguments.flag("--as-recorded");
  if (lockstep + realtime + recorded > 1) throw UsageError("only one of --lockstep, --realtime, --as-recorded");
  o.mode = lockstep   ? PlayMode::kLockstep
           : realtime ? PlayMode::kRealtime
           : recorded ? PlayMode::kAsRecorded
                      : PlayMode::kAutomatic;
  o.lockstep.base = o.realtime.base = o.script.base;
  o.realtime.period = o.script.period;
  o.lockstep.window = arguments.window();
  o.lockstep.burst = static_cast<std::size_t>(arguments.integer("--burst", 0, 1, 10'000));
  o.lockstep.burst_gap = milliseconds("--burst-gap", 5, 0);
  o.lockstep.interrupted = o.realtime.interrupted = &Interruption::text;
  if (arguments.flag("--emulated")) o.lockstep.patience = o.realtime.patience = kEmulatedPatience;

  const std::string sync = arguments.text("--sync").value_or("tick");
  if (sync != "tick" && sync != "clock") throw UsageError("--sync is tick or clock, not '" + sync + "'");
  o.realtime.sync = sync == "clock" ? Sync::kClock : Sync::kTick;
  o.realtime.begin = !arguments.flag("--no-begin");
  o.perturbation.jitter_ms = arguments.real("--jitter-ms", 0, 0, 10'000);
  o.perturbation.drop = arguments.real("--drop", 0, 0, 1);
  o.perturbation.duplicate = arguments.real("--duplicate", 0, 0, 1);
  o.perturbation.reorder = arguments.real("--reorder", 0, 0, 1);
  o.perturbation.seed = arguments.integer("--seed", 1, 0, ~std::uint64_t{0});
  if (o.perturbation.any() && !realtime)
    throw UsageError("--jitter-ms, --drop, --duplicate and --reorder need --realtime");

  const auto log = arguments.positional();
  arguments.finish();
  if (!log) throw UsageError("no LOG given (--help says more)");
  o.log = *log;
  return o;
}

namespace {

/// Frames that no node takes, counted.
std::string skipped(const LogReport& log) {
  return std::to_string(log.not_data) + (log.xl > 0 ? " remote, error, CAN FD or CAN XL" : " remote, error or CAN FD") +
         " frames";
}

}  // namespace

std::string no_data_frame(const LogReport& log) {
  return "no CAN data frame in it" + (log.not_data > 0 ? ", " + skipped(log) : std::string());
}

SurveyedLog survey_for(PlayOptions& options) {
  options.reading.base = options.script.log_base;
  LogFile file(options.log, options.reading);
  auto survey = survey_of(file, options.log, options.mode, options.script);
  if (!survey) throw std::runtime_error(survey.failure().text);
  const LogReport& report = file.report();
  if (report.data == 0)
    throw std::runtime_error(
        options.log + ": " +
        (report.other_interface > 0 ? "no frame of interface " + options.reading.interface : no_data_frame(report)));
  options.mode = survey->settled(options.mode);
  return {std::move(*survey), std::move(file)};
}

void warn_about(const LogReport& log, const char* program) {
  const auto warn = [program](const std::string& text) {
    std::fprintf(stderr, "%s: warning: %s\n", program, text.c_str());
  };
  if (log.malformed > 0)
    warn(std::to_string(log.malformed) + " malformed lines skipped, the first: " + log.first_malformed);
  if (log.not_data > 0) warn(log.name + ": " + skipped(log) + " skipped");
  if (log.back_in_time > 0)
    warn(log.name + ": " + std::to_string(log.back_in_time) + " frames are earlier than one before them");
  if (log.wrong_length > 0)
    warn(log.first_wrong_length + ": an input frame that has not 8 bytes; the node refuses and counts it (Malformed)" +
         (log.wrong_length > 1 ? ", the first of " + std::to_string(log.wrong_length) : std::string()));
  if (!log.cut_off.empty()) warn(log.cut_off);
  if (log.gaps > 0)
    warn(log.first_gap + ": more than a minute after the frame before" +
         (log.gaps > 1 ? ", the first of " + std::to_string(log.gaps) + " such gaps" : std::string()));
}

}  // namespace tetap::sim
