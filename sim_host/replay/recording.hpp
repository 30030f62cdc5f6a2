// SPDX-License-Identifier: Apache-2.0
// A log that holds a node's own frames is the record of a run. It shows what the node consumed before each tick
// (DESIGN.md 4.2). The run can be played again exactly, and its answers can be compared byte for byte. The log is read
// twice, by RecordSurvey and by RecordedTicks. It is held in memory only as far as a node lags behind its inputs.
#pragma once

#include "sim_host/replay/own_inputs.hpp"
#include "sim_host/replay/protocol.hpp"
#include "sim_host/replay/script.hpp"
#include "sim_host/replay/snapshot.hpp"
#include "tetap/bus/input_crc.hpp"

#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace tetap::sim {

/// Facts of a log that have to be known before its inputs can be sorted by their sender.
struct LogFacts {
  std::optional<bus::EstDiagWired> wired;  ///< first page with the sensors that are wired to the node
  std::optional<Snapshot> snapshot;        ///< the first one of a log that begins after the node's start
  MapInputs map_inputs;                    ///< those of the robot
};

/// Reads the begin of a log until the page is there, or so many epochs that it never comes. A log that begins after the
/// node's start is read until its snapshot is whole.
[[nodiscard]] LogFacts facts_of(Frames& log, const ScriptOptions& options);

/// Place where a record ends before its log does, and why.
struct Hole {
  base::Micros time;  ///< time of the first epoch that cannot be repeated, or of the last whole one
  std::string why;
};

/// Result of the survey.
struct Recording {
  /// Actions of a node between one start and the next; only of those whose epochs can be repeated.
  struct Life {
    std::optional<base::Micros> begin;
    bool from_snapshot = false;     ///< the life begins with the snapshot of the log
    std::uint64_t first_input = 0;  ///< first input of others that it consumed, of all in the log
    std::uint64_t first_own = 0;    ///< first input that it sent itself, of all in the log
    std::uint64_t epochs = 0;       ///< epochs that can be repeated
  };
  std::string name;  ///< name of the log
  std::vector<Life> lives;
  std::uint64_t epochs = 0;
  std::uint64_t skipped_epochs = 0;   ///< epochs of a node that was running already and was restarted later in the log
  std::uint64_t unlogged = 0;         ///< epochs behind a hole, up to the end or to the node's next start
  std::optional<Hole> hole;           ///< the first one
  std::uint64_t missing_outputs = 0;  ///< frames that the node counted as sent and the log does not hold
  /// Time at which the inputs in the log first differ from those that the node consumed (Est_Epoch.InCrc). A frame was
  /// lost between them.
  std::optional<base::Micros> inputs_differ_at;
  std::uint16_t rx_overflow = 0;        ///< frames that the recorded node's receiver lost, by its last count
  std::optional<std::uint32_t> config;  ///< hash of the node's numbers, as last published
  LogFacts facts;
};

/// The node's frames of a log as lives and epochs.
class RecordReader {
 public:
  RecordReader(std::string name, std::uint32_t log_base, const LogFacts& facts)
      : name_(std::move(name)),
        log_base_(log_base),
        map_inputs_(facts.map_inputs),
        collector_(log_base),
        own_inputs_(log_base, facts.wired),
        snapshot_(facts.snapshot ? &*facts.snapshot : nullptr) {}

  struct Begin {
    base::Micros time;
    std::uint64_t inputs;  ///< in the log before it
  };
  struct NewLife {
    std::optional<base::Micros> begin;   ///< by a Begin frame; empty: the node was switched on, or reset itself
    const Snapshot* snapshot = nullptr;  ///< the life begins with this state
    std::uint64_t until = 0;             ///< inputs of others that the life before may have consumed
    std::uint64_t first_own = 0;         ///< inputs of its own before its start
  };
  struct Found {
    bool input = false;               ///< this frame is one
    bool own = false;                 ///< an input that the node sent itself
    std::optional<NewLife> new_life;  ///< frames before this one belong to the life before; comes before the epoch
    std::optional<NodeEpoch> epoch;   ///< to be repeated; valid until the next frame
  };
  Found add(const TimedFrame& entry);

  /// Inputs of others, and of the node itself.
  [[nodiscard]] std::uint64_t inputs() const { return inputs_; }
  [[nodiscard]] std::uint64_t own() const { return own_; }
  /// In the log before the first frame of the last epoch.
  [[nodiscard]] std::uint64_t inputs_before() const { return inputs_before_; }
  [[nodiscard]] std::uint64_t own_before() const { return own_before_; }
  /// The log begins in the middle of this life: what the node knew by then is unknown.
  [[nodiscard]] bool skips() const { return skips_; }
  [[nodiscard]] std::uint64_t skipped_epochs() const { return skipped_epochs_; }
  [[nodiscard]] std::uint64_t unlogged() const { return unlogged_; }
  [[nodiscard]] const std::optional<Hole>& hole() const { return hole_; }
  /// A Begin frame that the node has not answered.
  [[nodiscard]] const std::optional<Begin>& pending() const { return pending_; }

  [[nodiscard]] Failure refusal(const std::string& why) const;

 private:
  [[nodiscard]] bool to_be_repeated(const NodeEpoch& epoch, base::Micros logged, Found& found);
  [[nodiscard]] bool takes_snapshot(const NodeEpoch& epoch) const;
  void begin_life(std::uint64_t number);
  void end(const std::string& why);

  std::string name_;
  std::uint32_t log_base_;
  MapInputs map_inputs_;
  EpochCollector collector_;
  OwnInputs own_inputs_;
  const Snapshot* snapshot_;
  std::optional<Begin> pending_;
  bool begun_ = false;  ///< this life, with a Begin frame in the log
  bool skips_ = false;
  bool ended_ = false;        ///< behind a hole
  std::uint64_t number_ = 0;  ///< number of the last epoch in this life
  base::Micros last_;         ///< time of the last epoch to be repeated
  std::uint64_t inputs_ = 0, inputs_before_ = 0, own_ = 0, own_before_ = 0, skipped_epochs_ = 0, unlogged_ = 0;
  std::optional<Hole> hole_;
};

/// The first reading: where each life begins, how far it can be repeated, and what is worth a warning.
class RecordSurvey {
 public:
  RecordSurvey(const std::string& name, std::uint32_t log_base, LogFacts facts)
      : facts_(std::move(facts)), reader_(name, log_base, facts_), log_base_(log_base) {
    result_.name = name;
  }
  RecordSurvey(const RecordSurvey&) = delete;  // the reader looks at the facts
  RecordSurvey& operator=(const RecordSurvey&) = delete;

  /// Both fail when nothing can be repeated: the node's start is not in the log.
  Result<> add(const TimedFrame& entry);
  Result<Recording> finish();

 private:
  struct Entry {
    base::Micros time;
    std::uint16_t in_count = 0;
    std::uint16_t in_crc = 0;
    std::uint64_t own_until = 0;  ///< own inputs in the log before it
  };
  /// Inputs of the log that have been consumed.
  struct Place {
    bus::InputCrc tally;
    std::uint64_t input = 0;  ///< next input of others, of all in the log
    std::uint64_t own = 0;    ///< next own input
  };
  enum class Step : std::uint8_t { kDone, kLacksInputs };

  void note_node(const base::CanFrame& frame);
  void drop_before(std::uint64_t input);
  void drop_own_before(std::uint64_t own);
  Result<> start_life(const RecordReader::NewLife& life);
  void start_at(std::uint64_t input);
  void add_epoch(const NodeEpoch& epoch);
  [[nodiscard]] Step consume(const Entry& entry, std::uint64_t end, Place& place) const;
  [[nodiscard]] bool match_begin(std::uint64_t start, std::uint64_t end) const;
  void find_start(std::uint64_t end, bool power_cycle_ended);
  void follow_until(std::uint64_t end, bool power_cycle_ended);
  Result<> close_life(std::uint64_t end);
  void end_life(base::Micros time, const std::string& why);
  [[nodiscard]] std::string reason_of_difference() const;

  LogFacts facts_;
  RecordReader reader_;
  std::uint32_t log_base_;
  Recording result_;

  // State of this life. Inputs are counted from the begin of the log.
  RecordReader::NewLife life_;
  bool has_entries_ = false;
  bool started_ = false;               ///< the life's first input is known
  bool over_ = false;                  ///< behind a hole
  std::optional<std::uint64_t> best_;  ///< the latest first input that its first epoch allows
  std::deque<std::uint32_t> crcs_;     ///< CRCs of others' inputs that it has not consumed
  std::deque<std::uint32_t> own_crcs_;
  std::uint64_t first_crc_ = 0, first_own_crc_ = 0;  ///< the inputs of crcs_[0] and own_crcs_[0]
  std::deque<Entry> waiting_;                        ///< epochs that have not consumed their inputs
  Place place_;
  bool differs_first_ = false;                          ///< the first hole is a difference of the inputs
  bool unlogged_seen_ = false, conflict_seen_ = false;  ///< bits of Est_Status, anywhere in the log
};

/// Reads the whole log. Fails as RecordSurvey and the log do.
Result<Recording> recording_of(Frames& log, const std::string& name, const ScriptOptions& options);

/// The second reading: every tick with what the node consumed before it, and what it answered. Inputs that the node
/// sent itself stand in the log before the epoch that consumed them, because one queue holds both. The node's count
/// beyond these is the number of others' inputs that were consumed.
class RecordedTicks {
 public:
  RecordedTicks(Frames& log, const Recording& recording, const ScriptOptions& options)
      : log_(log),
        recording_(recording),
        options_(options),
        reader_(recording.name, options.log_base, recording.facts),
        consumed_(recording.lives.front().first_input),
        own_consumed_(recording.lives.front().first_own) {
    log_.rewind();
  }

  bool next(Tick& tick);

  struct Answer {
    std::uint64_t number;                    ///< number of the epoch in the recording, from 1
    std::span<const base::CanFrame> frames;  ///< the deterministic ones; valid until the next answer
  };
  /// Answer of the recorded node to the tick of this time, which next() has given; earlier answers are dropped.
  [[nodiscard]] std::optional<Answer> answer(base::Micros time);

 private:
  struct Entry {
    base::Micros time;
    std::uint16_t in_count = 0;
    std::uint64_t own_until = 0;  ///< own inputs in the log before it
    std::size_t life = 0;
    std::size_t outputs = 0;
  };

  void read(const TimedFrame& entry);
  void start_life();

  Frames& log_;
  const Recording& recording_;
  ScriptOptions options_;
  RecordReader reader_;

  std::size_t read_lives_ = 0;      ///< lives with epochs, so far
  bool in_life_ = false;            ///< the life has epochs
  std::uint64_t life_epochs_ = 0;   ///< read of this life
  std::size_t played_lives_ = 0;    ///< begun
  std::uint64_t consumed_ = 0;      ///< inputs of others, or left behind
  std::uint64_t own_consumed_ = 0;  ///< inputs of the node's own, or left behind
  std::uint16_t in_count_ = 0;      ///< count of inputs as the node counts them
  std::uint64_t given_ = 0;         ///< ticks
  std::deque<base::CanFrame> inputs_, own_inputs_;
  std::deque<Entry> entries_;             ///< to be given as ticks
  std::deque<Entry> answers_;             ///< entries of ticks that were given
  std::deque<base::CanFrame> outputs_;    ///< outputs of answers_, then of entries_
  std::vector<base::CanFrame> tick_;      ///< inputs of the last tick
  std::vector<base::CanFrame> answered_;  ///< the last answer
  std::uint64_t number_ = 0;              ///< number of the last answer
};

static_assert(Source<RecordedTicks>);

/// A sink's part: holds each epoch against the recorded one.
class Comparison {
 public:
  Comparison(RecordedTicks& ticks, const Recording& recording, const ScriptOptions& options)
      : ticks_(ticks), recording_(recording), base_(options.base), log_base_(options.log_base) {}

  void epoch(const NodeEpoch& epoch, base::Micros time);

  [[nodiscard]] std::uint64_t compared() const { return compared_; }
  [[nodiscard]] std::uint64_t different() const { return different_; }
  [[nodiscard]] std::uint64_t missing() const { return recording_.epochs - compared_; }
  [[nodiscard]] const std::string& first_difference() const { return first_difference_; }
  /// Whether this node publishes another hash of its numbers than the recorded one did.
  [[nodiscard]] bool other_numbers() const { return config_ && recording_.config && *config_ != *recording_.config; }
  [[nodiscard]] const Recording& recording() const { return recording_; }

 private:
  RecordedTicks& ticks_;
  const Recording& recording_;
  std::uint32_t base_, log_base_;
  std::uint64_t compared_ = 0;
  std::uint64_t different_ = 0;
  std::string first_difference_;
  std::optional<std::uint32_t> config_;
};

}  // namespace tetap::sim
