// SPDX-License-Identifier: Apache-2.0
#include "sim_host/replay/survey.hpp"

#include "sim_host/replay/protocol.hpp"

namespace tetap::sim {

namespace {

/// Goes along with one reading.
class Surveyor {
 public:
  Surveyor(const std::string& name, const ScriptOptions& options, bool may_be_record, LogFacts facts)
      : base_(options.log_base),
        map_inputs_(options.map_inputs),
        grid_(options.period),
        record_(name, base_, std::move(facts)),
        surveys_record_(may_be_record) {}

  void add(const TimedFrame& entry) {
    if (is_counted_input(entry.frame, base_, map_inputs_)) {
      ++survey_.inputs;
      if (own_ticks_ == 0)
        while (grid_.due_before(entry.time)) ++grid_ticks_;
    } else if (is_tick(entry.frame, base_)) {
      ++own_ticks_;
    } else if (offset_in_block(entry.frame, base_) == bus::EstStateCrc::kOffset) {
      survey_.has_node_frames = true;
    }
    if (!surveys_record_) return;
    if (const auto added = record_.add(entry); !added) refuse(added.failure());
  }

  LogSurvey finish() {
    survey_.has_ticks = own_ticks_ > 0;
    survey_.ticks = survey_.has_ticks ? own_ticks_ : grid_ticks_ + (grid_.last() ? 1 : 0);
    if (!surveys_record_) return std::move(survey_);
    auto recording = record_.finish();
    if (recording)
      survey_.recording = std::move(*recording);
    else
      refuse(recording.failure());
    return std::move(survey_);
  }

 private:
  /// Matters only when a whole reading finds no worse, and the mode is to repeat.
  void refuse(const Failure& failure) {
    survey_.refusal = failure.text;
    surveys_record_ = false;
  }

  std::uint32_t base_;
  MapInputs map_inputs_;
  TickGrid grid_;
  RecordSurvey record_;
  bool surveys_record_;
  std::uint64_t own_ticks_ = 0, grid_ticks_ = 0;
  LogSurvey survey_;
};

}  // namespace

Result<LogSurvey> survey_of(Frames& log, const std::string& name, PlayMode mode, const ScriptOptions& options) {
  const bool may_be_record = mode == PlayMode::kAutomatic || mode == PlayMode::kAsRecorded;
  Surveyor surveyor(name, options, may_be_record, may_be_record ? facts_of(log, options) : LogFacts{});
  for (TimedFrame entry; log.next(entry);) surveyor.add(entry);
  if (log.failure()) return *log.failure();
  return surveyor.finish();
}

}  // namespace tetap::sim
