// SPDX-License-Identifier: Apache-2.0
// A whole replay by the core alone: a log's text in, tables out. Compiled for WebAssembly too, where there is no file
// and no exception.
#pragma once

#include "sim_host/replay/lockstep.hpp"
#include "sim_host/replay/memory_node.hpp"
#include "sim_host/replay/survey.hpp"
#include "sim_host/replay/tables.hpp"

#include <array>
#include <cstdint>
#include <string>
#include <string_view>

namespace tetap::sim::test {

struct TextReplay final : TableSink {
  void write(Table table, std::string_view lines) override { text[static_cast<std::size_t>(table)] += lines; }

  std::array<std::string, kTableNames.size()> text;  ///< text of each table
  std::string failure;
  Tables::Totals totals;
  Counts counts;
  std::uint64_t compared = 0, different = 0;
};

/// `log`: text of candump; `name`: what messages call it.
inline void replay_text(std::string_view log, const std::string& name, const Robot& robot, TextReplay& out) {
  const ScriptOptions options{.map_inputs = robot.takes.map_inputs()};
  LogText lines(log, name);
  auto survey = survey_of(lines, name, PlayMode::kAutomatic, options);
  if (!survey) return void(out.failure = survey.failure().text);
  const param::Parameters parameters = MemoryNode::for_player(*robot.parameters, options.base);
  MemoryNode node(robot, parameters, bus::Version{});
  Tables tables(options.base, out);
  struct Both {
    Tables& tables;
    Comparison* comparison;
    void restarted() { tables.restarted(); }
    void sent(const base::CanFrame& frame) { tables.sent(frame); }
    void received(const base::CanFrame& frame) { tables.received(frame); }
    void epoch(const NodeEpoch& epoch, base::Micros time) {
      tables.epoch(epoch, time);
      if (comparison != nullptr) comparison->epoch(epoch, time);
    }
  } sink{tables, nullptr};
  Result<> played;
  if (survey->settled(PlayMode::kAutomatic) == PlayMode::kLockstep) {
    LogTicks ticks(lines, options, survey->has_ticks);
    played = play_lockstep(node.link(), ticks, sink, {.base = options.base}, out.counts);
  } else if (survey->recording) {
    RecordedTicks ticks(lines, *survey->recording, options);
    Comparison comparison(ticks, *survey->recording, options);
    sink.comparison = &comparison;
    played = play_lockstep(node.link(), ticks, sink, {.base = options.base}, out.counts);
    out.compared = comparison.compared();
    out.different = comparison.different();
  } else {
    played = Failure{survey->refusal};
  }
  if (!played) out.failure = played.failure().text;
  out.totals = tables.end();
}

}  // namespace tetap::sim::test
