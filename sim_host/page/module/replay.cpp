// SPDX-License-Identifier: Apache-2.0
#include "sim_host/page/module/replay.hpp"

#include "sim_host/page/module/browser.hpp"
#include "sim_host/page/module/json.hpp"
#include "sim_host/page/module/observer.hpp"
#include "sim_host/replay/complaint.hpp"
#include "sim_host/replay/lockstep.hpp"
#include "sim_host/replay/memory_node.hpp"
#include "version.hpp"

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

void put_begun(const BrowserLog& log, const char* mode, std::uint64_t ticks) {
  Json json;
  json.begin('{').member("mode", mode).member("ticks", ticks);
  put_report(json, log.report());
  write(Channel::kBegun, json.end('}').text());
}

}  // namespace

sim::Result<> replay(const sim::Robot& robot, const param::Parameters& parameters, const ReplayOptions& options) {
  BrowserLog log(kName, {.interface = {}, .keep_going = options.keep_going, .base = options.base});
  const sim::ScriptOptions script{
      .base = options.base, .log_base = options.base, .map_inputs = robot.takes.map_inputs()};
  const auto survey = sim::survey_of(log, kName, options.mode, script);
  if (!survey) return survey.failure();
  if (log.report().data == 0) return sim::Failure{"no CAN data frame in the log"};
  const sim::PlayMode mode = survey->settled(options.mode);
  const bool repeats = mode == sim::PlayMode::kAsRecorded;
  if (repeats && !survey->recording) return sim::Failure{survey->refusal};
  if (!repeats && survey->ticks == 0) return sim::Failure{"no input frames of this id base in the log"};
  put_begun(log, repeats ? "as-recorded" : "lockstep", repeats ? survey->recording->epochs : survey->ticks);

  const param::Parameters of_node = sim::MemoryNode::for_player(parameters, options.base);
  sim::MemoryNode node(robot, of_node, version());
  const sim::LockstepOptions lockstep{.base = options.base};
  if (repeats) {
    sim::RecordedTicks ticks(log, *survey->recording, script);
    sim::Comparison comparison(ticks, *survey->recording, script);
    Observer run(options.base, &comparison);
    put_result(run, sim::play_lockstep(node.link(), ticks, run, lockstep, run.counts), &comparison);
  } else {
    sim::LogTicks ticks(log, script, survey->has_ticks);
    Observer run(options.base);
    put_result(run, sim::play_lockstep(node.link(), ticks, run, lockstep, run.counts), nullptr);
  }
  if (log.failure()) return *log.failure();
  return {};
}

}  // namespace tetap::page
