// SPDX-License-Identifier: Apache-2.0
#include "sim_host/page/module/replay.hpp"

#include "sim_host/kept_words.hpp"
#include "sim_host/page/module/browser.hpp"
#include "sim_host/page/module/json.hpp"
#include "sim_host/page/module/observer.hpp"
#include "sim_host/page/module/updates.hpp"
#include "sim_host/parameter_word.hpp"
#include "sim_host/replay/complaint.hpp"
#include "sim_host/replay/lockstep.hpp"
#include "sim_host/replay/memory_node.hpp"
#include "tetap/param/table.hpp"
#include "version.hpp"

#include <cstddef>
#include <iterator>
#include <optional>
#include <string>

namespace tetap::page {

namespace {

constexpr const char* kName = "log";  ///< name of the log in messages

void put_report(Json& json, const sim::LogReport& report) {
  json.member("malformed_lines", report.malformed)
      .member("first_malformed", report.first_malformed)
      .member("frames_not_data", report.not_data)
      .member("frames_back_in_time", report.back_in_time)
      .member("frames_of_wrong_length", report.wrong_length)
      .member("first_wrong_length", report.first_wrong_length)
      .member("gaps", report.gaps)
      .member("first_gap", report.first_gap)
      .member("cut_off", report.cut_off);
}

void put_result(Observer& run, const sim::Result<>& played, const sim::Comparison* comparison) {
  const sim::Tables::Totals& totals = run.end();
  sim::Line crc;
  crc.hex(totals.state_crc, 8);
  Json json;
  json.begin('{')
      .member("epochs", totals.epochs)
      .member("duration_s", static_cast<double>((totals.last - totals.first).us) * 1e-6)
      .member("frames_in", run.counts.inputs)
      .member("frames_lost", run.counts.lost())
      .member("estimates_sha256", totals.estimates_sha256)
      .member("state_crc_last", crc.view())
      .member("wrong", played ? sim::complaint(run.counts, comparison) : played.failure().text);
  put_origin(json, run.origin());
  if (comparison != nullptr) {
    const auto& hole = comparison->recording().hole;
    json.member("epochs_compared", comparison->compared())
        .member("epochs_different", comparison->different())
        .member("first_difference", comparison->first_difference())
        .member("other_numbers", comparison->other_numbers())
        .member("unlogged", comparison->recording().unlogged)
        .member("hole", hole ? hole->why : std::string());
    if (hole) json.member("hole_s", static_cast<double>(hole->time.us) * 1e-6);
  }
  write(Channel::kResult, json.end('}').text());
}

void put_begun(const sim::LogReport& report, const char* mode, std::uint64_t ticks,
               const std::optional<sim::Begun>& begun) {
  Json json;
  json.begin('{').member("mode", mode).member("ticks", ticks).key("began_with").begin('[');
  for (std::size_t i = 0; begun && i < std::size(param::kTable); ++i) {
    const param::Row& row = param::kTable[i];
    bool same = true;
    for (std::size_t word = 0; word < row.size / 4; ++word)
      same = same && sim::word_of(begun->built, row, word) == sim::word_of(begun->active, row, word);
    if (same) continue;
    json.begin('{').member("path", row.path).key("values").begin('[');
    for (std::size_t k = 0; k < row.elements; ++k) json.value(row.get(begun->active, k));
    json.end(']').end('}');
  }
  json.end(']').member("began_exact", !begun || begun->exact);
  put_report(json, report);
  write(Channel::kBegun, json.end('}').text());
}

/// Looks at the updates up to an epoch, then ends the run.
class UpdatesUntil {
 public:
  UpdatesUntil(base::Micros time, base::Micros span) : time_(time), span_(span) { over_ = false; }

  void restarted() {}
  void sent(const base::CanFrame&) {}
  void received(const base::CanFrame&) {}
  void epoch(const sim::NodeEpoch&, base::Micros time) {
    over_ = over_ || time >= time_;
    log_.takes = !over_ && time >= time_ - span_;
    if (!over_) log_.next(time, time_ - span_);
  }
  [[nodiscard]] static std::string interrupted() { return over_ ? "over" : ""; }
  [[nodiscard]] static bool over() { return over_; }
  [[nodiscard]] std::string json() const { return log_.json(); }

 private:
  static inline bool over_ = false;
  base::Micros time_, span_;
  UpdateLog log_;
};

/// A log that has been read once, and the way it is played.
struct Prepared {
  sim::LogSurvey survey;
  bool repeats = false;
};

sim::Result<Prepared> prepared(BrowserLog& log, const ReplayOptions& options, const sim::ScriptOptions& script) {
  const auto survey = sim::survey_of(log, kName, options.mode, script);
  if (!survey) return survey.failure();
  if (log.report().data == 0) return sim::Failure{"no CAN data frame in the log"};
  const bool repeats = survey->settled(options.mode) == sim::PlayMode::kAsRecorded;
  if (repeats && !survey->recording) return sim::Failure{survey->refusal};
  if (!repeats && survey->ticks == 0) return sim::Failure{"no input frames of this id base in the log"};
  return Prepared{*survey, repeats};
}

/// Parameters with which the log's node began, for the node that repeats it.
sim::Result<> take(const std::optional<sim::Begun>& begun, sim::MemoryNode& node) {
  return begun ? sim::make_active(node.link(), begun->from, begun->to) : sim::Result<>{};
}

sim::ScriptOptions script_of(const sim::Robot& robot, const ReplayOptions& options) {
  return {.base = options.base, .log_base = options.base, .map_inputs = robot.takes.map_inputs()};
}

}  // namespace

sim::Result<> replay(const sim::Robot& robot, const param::Parameters& parameters, const ReplayOptions& options) {
  BrowserLog log(kName, {.interface = {}, .keep_going = options.keep_going, .base = options.base});
  const sim::ScriptOptions script = script_of(robot, options);
  const auto ready = prepared(log, options, script);
  if (!ready) return ready.failure();
  const auto& recording = ready->survey.recording;
  const param::Parameters of_node = sim::MemoryNode::for_player(parameters, options.base);
  const sim::LogReport report = log.report();
  const auto begun = sim::begun_of(log, options.base, robot, of_node);
  put_begun(report, ready->repeats ? "as-recorded" : "lockstep",
            ready->repeats ? recording->epochs : ready->survey.ticks, begun);

  sim::MemoryNode node(robot, of_node, version());
  if (auto taken = take(begun, node); !taken) return taken;
  const sim::LockstepOptions lockstep{.base = options.base};
  if (ready->repeats) {
    sim::RecordedTicks ticks(log, *recording, script);
    sim::Comparison comparison(ticks, *recording, script);
    Observer run(options.base, &comparison);
    put_result(run, sim::play_lockstep(node.link(), ticks, run, lockstep, run.counts), &comparison);
  } else {
    sim::LogTicks ticks(log, script, ready->survey.has_ticks);
    Observer run(options.base);
    put_result(run, sim::play_lockstep(node.link(), ticks, run, lockstep, run.counts), nullptr);
  }
  if (log.failure()) return *log.failure();
  return {};
}

sim::Result<> updates_until(const sim::Robot& robot, const param::Parameters& parameters, const ReplayOptions& options,
                            base::Micros time, base::Micros span) {
  BrowserLog log(kName, {.interface = {}, .keep_going = options.keep_going, .base = options.base});
  const sim::ScriptOptions script = script_of(robot, options);
  const auto ready = prepared(log, options, script);
  if (!ready) return ready.failure();
  const param::Parameters of_node = sim::MemoryNode::for_player(parameters, options.base);
  sim::MemoryNode node(robot, of_node, version());
  if (auto taken = take(sim::begun_of(log, options.base, robot, of_node), node); !taken) return taken;
  const sim::LockstepOptions lockstep{.base = options.base, .window = 1, .interrupted = &UpdatesUntil::interrupted};
  UpdatesUntil run(time, span);
  sim::Counts counts;
  const auto play = [&](auto&& ticks) { return sim::play_lockstep(node.link(), ticks, run, lockstep, counts); };
  const auto played = ready->repeats ? play(sim::RecordedTicks(log, *ready->survey.recording, script))
                                     : play(sim::LogTicks(log, script, ready->survey.has_ticks));
  if (!played && !UpdatesUntil::over()) return played;
  write(Channel::kUpdates, run.json());
  return {};
}

}  // namespace tetap::page
