// SPDX-License-Identifier: Apache-2.0
#include "sim_host/replay/recording.hpp"

#include "sim_host/replay/line.hpp"
#include "sim_host/replay/names.hpp"
#include "tetap/bus/decoder.hpp"

#include <algorithm>

namespace tetap::sim {

namespace {

constexpr std::size_t kLeastEpochs =
    32;  ///< epochs, with 16 bits of CRC each, that fix where a node's consumption begins
constexpr std::uint64_t kFirstEpochs = 4096;  ///< a node that has wired sensors names them many times in so many epochs
constexpr std::uint64_t kFirstFrames =
    200'000;                                   ///< frames of a log without an epoch among them: there is no node in it
constexpr std::uint16_t kFirstInputs = 1'000;  ///< more than a bus carries in the first period of a node
constexpr std::uint64_t kInFlight = 4096;      ///< inputs that may be on the bus and are not consumed yet

}  // namespace

Failure RecordReader::refusal(const std::string& why) const { return {name_ + ": cannot be repeated exactly: " + why}; }

LogFacts facts_of(Frames& log, const ScriptOptions& options) {
  const std::uint32_t log_base = options.log_base;
  LogFacts facts;
  facts.map_inputs = options.map_inputs;
  SnapshotCollector snapshots(log_base);
  std::uint64_t epochs = 0;
  bool late = false;  // the log begins after the node's start
  log.rewind();
  const auto more = [&](std::uint64_t frames) {
    if (late) return !facts.snapshot;
    return !facts.wired && epochs < kFirstEpochs && (epochs > 0 || frames < kFirstFrames);
  };
  std::uint64_t frames = 0;
  for (TimedFrame entry; more(++frames) && log.next(entry);) {
    const auto bytes = bus::payload(entry.frame);
    const auto offset = offset_in_block(entry.frame, log_base);
    if (!offset) continue;
    if (*offset == bus::EstStateCrc::kOffset && ++epochs == 1)
      if (const auto tail = bus::decode<bus::EstStateCrc>(bytes)) late = tail->epoch != 1;
    if (*offset == bus::EstDiagWired::kOffset && !facts.wired) facts.wired = bus::decode<bus::EstDiagWired>(bytes);
    if (late) facts.snapshot = snapshots.add(entry.frame);
  }
  log.rewind();
  return facts;
}

RecordReader::Found RecordReader::add(const TimedFrame& entry) {
  const base::CanFrame& frame = entry.frame;
  Found found;
  const auto offset = offset_in_block(frame, log_base_);
  if (!offset) return found;
  const bool own = own_inputs_.add(frame);
  if (is_counted_input(frame, log_base_, map_inputs_)) {
    ++(own ? own_ : inputs_);
    found.input = true;
    found.own = own;
    return found;
  }
  if (*offset == bus::InSync::kOffset) {
    const auto sync = bus::decode<bus::InSync>(bus::payload(frame));
    if (sync && sync->kind == bus::SyncKind::kBegin)
      pending_ = Begin{first_bus_time(sync->time_us, entry.time), inputs_};
    return found;
  }
  if (pending_ && collector_.is_begin_response(frame)) {
    const Begin begin = *std::exchange(pending_, std::nullopt);
    found.new_life = NewLife{.begin = begin.time, .until = begin.inputs, .first_own = own_};
    begin_life(0);
    begun_ = true;
    own_inputs_.begin();
  }
  if (*offset == bus::EstEpoch::kOffset) {
    if (!collector_.idle() && collector_.head() && !skips_)
      end("the epoch before " + in_seconds(entry.time) + " lacks its last frame");
    inputs_before_ = inputs_;
    own_before_ = own_;
  }
  if (const auto epoch = collector_.add(frame); epoch && to_be_repeated(*epoch, entry.time, found)) found.epoch = epoch;
  return found;
}

void RecordReader::begin_life(std::uint64_t number) {
  number_ = number;
  skips_ = ended_ = begun_ = false;
}

/// Nothing behind this can be repeated, until the node starts anew.
void RecordReader::end(const std::string& why) {
  if (std::exchange(ended_, true)) return;
  if (!hole_) hole_ = Hole{last_, why};
}

bool RecordReader::takes_snapshot(const NodeEpoch& epoch) const {
  return snapshot_ != nullptr && epoch.head && same_bus_time(epoch.head->time_us, {snapshot_->header.time_us}) &&
         epoch.tail.in_count == static_cast<std::uint16_t>(snapshot_->header.in_count) &&
         epoch.tail.epoch == static_cast<std::uint8_t>(snapshot_->header.epoch);
}

bool RecordReader::to_be_repeated(const NodeEpoch& epoch, base::Micros logged, Found& found) {
  const bool next_one = epoch.tail.epoch == static_cast<std::uint8_t>(number_ + 1);
  if (number_ == 0 && !begun_ && (!next_one || !epoch.head)) skips_ = true;
  if (skips_ && takes_snapshot(epoch)) {
    begin_life(epoch.tail.epoch);
    found.new_life = NewLife{.begin = base::Micros{snapshot_->header.time_us},
                             .snapshot = snapshot_,
                             .until = inputs_before_,
                             .first_own = own_before_};
    return false;
  }
  if (skips_) return ++skipped_epochs_, false;
  // A node that was reset counts its epochs and its inputs from the start.
  if (!next_one && epoch.head && epoch.tail.epoch == 1 && epoch.tail.in_count < kFirstInputs) {
    begin_life(0);
    found.new_life = NewLife{.begin = {}, .until = inputs_before_, .first_own = own_before_};
  } else if (!ended_ && !epoch.head) {
    end("the epoch at " + in_seconds(logged) + " lacks its first frame");
  } else if (!ended_ && !next_one) {
    end("epochs are missing before " + in_seconds(logged));
  }
  if (ended_) return ++unlogged_, false;
  ++number_;
  last_ = {static_cast<std::int64_t>(epoch.head->time_us)};
  return true;
}

void RecordSurvey::note_node(const base::CanFrame& frame) {
  const auto bytes = bus::payload(frame);
  if (frame.id == log_base_ + bus::EstVersion::kOffset)
    if (const auto version = bus::decode<bus::EstVersion>(bytes)) result_.config = version->config;
  if (frame.id == log_base_ + bus::EstDiagBus::kOffset)
    if (const auto diagnosis = bus::decode<bus::EstDiagBus>(bytes)) result_.rx_overflow = diagnosis->rx_overflow;
  if (frame.id == log_base_ + bus::EstStatus::kOffset)
    if (const auto status = bus::decode<bus::EstStatus>(bytes)) {
      unlogged_seen_ = unlogged_seen_ || status->unlogged;
      conflict_seen_ = conflict_seen_ || (status->faults >> static_cast<unsigned>(sensor::Fault::kIdConflict) & 1) != 0;
    }
}

Result<> RecordSurvey::add(const TimedFrame& entry) {
  const RecordReader::Found found = reader_.add(entry);
  if (found.input)
    (found.own ? own_crcs_ : crcs_)
        .push_back(bus::frame_crc(static_cast<std::uint8_t>(entry.frame.id - log_base_), entry.frame));
  else if (!entry.frame.extended)
    note_node(entry.frame);
  if (found.new_life)
    if (auto started = start_life(*found.new_life); !started) return started;
  if (reader_.skips() || over_) {
    const std::uint64_t bound = reader_.pending() ? reader_.pending()->inputs : reader_.inputs();
    drop_before(bound > kInFlight ? bound - kInFlight : 0);
    drop_own_before(reader_.own_before());
  }
  if (found.epoch) add_epoch(*found.epoch);
  // A Begin frame that is not answered yet may end this life: inputs behind it are left for the next one.
  if (!waiting_.empty()) follow_until(reader_.pending() ? reader_.pending()->inputs : reader_.inputs(), false);
  return {};
}

void RecordSurvey::drop_before(std::uint64_t input) {
  for (; first_crc_ < input && !crcs_.empty(); ++first_crc_) crcs_.pop_front();
}
void RecordSurvey::drop_own_before(std::uint64_t own) {
  for (; first_own_crc_ < own && !own_crcs_.empty(); ++first_own_crc_) own_crcs_.pop_front();
}

Result<> RecordSurvey::start_life(const RecordReader::NewLife& life) {
  if (auto closed = close_life(life.until); !closed) return closed;
  if (life.begin && life.snapshot == nullptr) drop_before(life.until);
  drop_own_before(life.first_own);
  life_ = life;
  best_.reset();
  started_ = has_entries_ = over_ = false;
  waiting_.clear();
  place_ = {.tally = {}, .input = 0, .own = life.first_own};
  if (life.snapshot != nullptr)
    place_.tally = bus::InputCrc(life.snapshot->header.in_crc, life.snapshot->header.in_count);
  return {};
}

void RecordSurvey::add_epoch(const NodeEpoch& epoch) {
  if (over_) return void(++result_.unlogged);
  if (epoch.received < epoch.tail.frames) result_.missing_outputs += epoch.tail.frames - epoch.received;
  waiting_.push_back({.time = {static_cast<std::int64_t>(epoch.head->time_us)},
                      .in_count = epoch.tail.in_count,
                      .in_crc = epoch.head->in_crc,
                      .own_until = reader_.own_before()});
  if (std::exchange(has_entries_, true)) return;
  const std::uint64_t before = reader_.inputs_before() - first_crc_;
  const auto consumed = static_cast<std::uint16_t>(epoch.tail.in_count - place_.tally.count());
  const std::uint64_t own = reader_.own_before() - place_.own;
  const std::uint64_t others = consumed > own ? consumed - own : 0;
  if ((life_.begin && life_.snapshot == nullptr) || others > before)
    start_at(first_crc_);
  else
    best_ = reader_.inputs_before() - others;
}

void RecordSurvey::start_at(std::uint64_t input) {
  drop_before(input);
  place_.input = input;
  result_.lives.push_back({.begin = life_.begin,
                           .from_snapshot = life_.snapshot != nullptr,
                           .first_input = input,
                           .first_own = place_.own});
  started_ = true;
}

/// Takes what this epoch consumed: its own inputs, then as many of others as its count has beyond them.
RecordSurvey::Step RecordSurvey::consume(const Entry& entry, std::uint64_t end, Place& place) const {
  Place next = place;
  for (; next.own < entry.own_until; ++next.own)
    next.tally.add(own_crcs_[static_cast<std::size_t>(next.own - first_own_crc_)]);
  auto others = static_cast<std::uint16_t>(entry.in_count - next.tally.count());
  if (others >= 0x8000) others = 0;  // more of its own than it counted: the sum will not fit
  if (next.input + others > end) return Step::kLacksInputs;
  for (; others > 0; --others) next.tally.add(crcs_[static_cast<std::size_t>(next.input++ - first_crc_)]);
  next.tally.close_epoch();
  place = next;
  return Step::kDone;
}

/// Whether the node's tally of its first epochs is that of the inputs from `start` on, none of them behind `end`.
bool RecordSurvey::match_begin(std::uint64_t start, std::uint64_t end) const {
  Place place = place_;
  place.input = start;
  for (std::size_t e = 0; e < waiting_.size() && e < kLeastEpochs; ++e) {
    if (consume(waiting_[e], end, place) != Step::kDone) return false;
    if (static_cast<std::uint16_t>(place.tally.running()) != waiting_[e].in_crc) return false;
  }
  return true;
}

/// Point in the log where the node's consumption begins. With a Begin frame that is known. A node that was switched on
/// while frames were flowing took some of those before its first epoch. Its own CRC of them shows which.
void RecordSurvey::find_start(std::uint64_t end, bool power_cycle_ended) {
  if (!power_cycle_ended) {
    if (waiting_.size() < kLeastEpochs) return;
    Place place = place_;
    place.input = *best_;
    for (std::size_t e = 0; e < kLeastEpochs; ++e)
      if (consume(waiting_[e], end, place) != Step::kDone) return;
  }
  for (std::uint64_t start = *best_ + 1; start-- > first_crc_;)
    if (match_begin(start, end)) return start_at(start);
  start_at(*best_);
}

/// Takes every input before `end` that a waiting epoch counted as consumed.
void RecordSurvey::follow_until(std::uint64_t end, bool power_cycle_ended) {
  if (!started_) find_start(end, power_cycle_ended);
  if (!started_) return;
  for (; !waiting_.empty(); waiting_.pop_front()) {
    const Entry& entry = waiting_.front();
    if (consume(entry, end, place_) != Step::kDone) return;
    if (static_cast<std::uint16_t>(place_.tally.running()) != entry.in_crc) {
      if (!result_.inputs_differ_at) result_.inputs_differ_at = entry.time;
      differs_first_ = differs_first_ || !result_.hole;
      return end_life(entry.time, "");
    }
    drop_before(place_.input);
    drop_own_before(place_.own);
    ++result_.epochs;
    ++result_.lives.back().epochs;
  }
}

/// The epochs that wait, and all up to the node's next start, cannot be repeated.
void RecordSurvey::end_life(base::Micros time, const std::string& why) {
  over_ = true;
  result_.unlogged += waiting_.size();
  waiting_.clear();
  if (!result_.hole) result_.hole = Hole{time, why};
}

Result<> RecordSurvey::close_life(std::uint64_t end) {
  if (waiting_.empty()) return {};
  follow_until(end, true);
  if (waiting_.empty()) return {};
  if (reader_.inputs() + reader_.own() == 0)
    return Failure{result_.name + ": no input frames in this log, only what a node said"};
  const base::Micros time = waiting_.front().time;
  end_life(time, "the node consumed more input frames until " + in_seconds(time) + " than the log holds" +
                     (unlogged_seen_ ? std::string(": its bus did not take all of its wired samples (Unlogged)") : ""));
  return {};
}

std::string RecordSurvey::reason_of_difference() const {
  std::string other = "from the epoch at " + in_seconds(*result_.inputs_differ_at) +
                      " on the node consumed other input frames than the log holds";
  if (unlogged_seen_) return other + ": its bus did not take all of its wired samples (Unlogged)";
  if (conflict_seen_) return other + ": another node sends the same ids (IdConflict)";
  if (result_.rx_overflow > 0)
    return other + ": its receiver had lost " + std::to_string(result_.rx_overflow) + " (RxOverflow)";
  return other;
}

Result<Recording> RecordSurvey::finish() {
  if (const auto closed = close_life(reader_.inputs()); !closed) return closed.failure();
  result_.skipped_epochs = reader_.skipped_epochs();
  result_.unlogged += reader_.unlogged();
  if (differs_first_) result_.hole->why = reason_of_difference();
  if (reader_.hole() && (!result_.hole || reader_.hole()->time < result_.hole->time)) result_.hole = reader_.hole();
  if (result_.epochs == 0 && result_.hole) return reader_.refusal(result_.hole->why);
  if (result_.epochs == 0 && result_.skipped_epochs > 0)
    return reader_.refusal(
        "it begins after the node's start: no Begin frame, its first epoch is not the node's first, and no "
        "snapshot is in it (make record asks for one)");
  if (result_.epochs == 0) return reader_.refusal("no whole epoch of a node in it");
  result_.facts = std::move(facts_);
  return std::move(result_);
}

Result<Recording> recording_of(Frames& log, const std::string& name, const ScriptOptions& options) {
  RecordSurvey survey(name, options.log_base, facts_of(log, options));
  for (TimedFrame entry; log.next(entry);)
    if (const auto added = survey.add(entry); !added) return added.failure();
  if (log.failure()) return *log.failure();
  return survey.finish();
}

void RecordedTicks::read(const TimedFrame& entry) {
  const RecordReader::Found found = reader_.add(entry);
  const bool used = found.own ? reader_.own() > own_consumed_ : reader_.inputs() > consumed_;
  if (found.input && used) {
    base::CanFrame frame = entry.frame;
    frame.id = entry.frame.id - options_.log_base + options_.base;
    (found.own ? own_inputs_ : inputs_).push_back(frame);
  }
  if (found.new_life) in_life_ = false;
  if (!found.epoch) return;
  if (!std::exchange(in_life_, true)) {
    ++read_lives_;
    life_epochs_ = 0;
  }
  if (life_epochs_++ >= recording_.lives[read_lives_ - 1].epochs) return;  // behind a hole
  std::size_t count = 0;
  for (const base::CanFrame& frame : found.epoch->frames) {
    if (!is_deterministic(frame, options_.log_base)) continue;
    outputs_.push_back(repeatable(frame, options_.log_base));
    ++count;
  }
  entries_.push_back({.time = {static_cast<std::int64_t>(found.epoch->head->time_us)},
                      .in_count = found.epoch->tail.in_count,
                      .own_until = reader_.own_before(),
                      .life = read_lives_,
                      .outputs = count});
}

/// The next epoch's node has started before any of its inputs.
void RecordedTicks::start_life() {
  const Recording::Life& life = recording_.lives[played_lives_++];
  const auto pass = [](std::deque<base::CanFrame>& inputs, std::uint64_t& consumed, std::uint64_t first) {
    const auto passed = static_cast<std::ptrdiff_t>(std::min<std::uint64_t>(first - consumed, inputs.size()));
    inputs.erase(inputs.begin(), inputs.begin() + passed);
    consumed = first;
  };
  pass(inputs_, consumed_, life.first_input);
  pass(own_inputs_, own_consumed_, life.first_own);
  in_count_ =
      life.from_snapshot ? static_cast<std::uint16_t>(recording_.facts.snapshot->header.in_count) : std::uint16_t{0};
}

bool RecordedTicks::next(Tick& tick) {
  if (given_ == recording_.epochs) return false;
  TimedFrame frame;
  while (entries_.empty()) {
    if (!log_.next(frame)) return false;
    read(frame);
  }
  const Entry entry = entries_.front();
  const bool begins = entry.life != played_lives_;
  while (entry.life != played_lives_) start_life();
  const std::uint64_t own = entry.own_until - own_consumed_;
  const std::size_t wanted = static_cast<std::uint16_t>(entry.in_count - in_count_ - own);
  while (inputs_.size() < wanted) {
    if (!log_.next(frame)) return false;
    read(frame);
  }
  const auto own_end = own_inputs_.begin() + static_cast<std::ptrdiff_t>(own);
  tick_.assign(own_inputs_.begin(), own_end);
  own_inputs_.erase(own_inputs_.begin(), own_end);
  own_consumed_ = entry.own_until;
  const auto end = inputs_.begin() + static_cast<std::ptrdiff_t>(wanted);
  tick_.insert(tick_.end(), inputs_.begin(), end);
  inputs_.erase(inputs_.begin(), end);
  consumed_ += wanted;
  in_count_ = entry.in_count;
  entries_.pop_front();
  answers_.push_back(entry);
  ++given_;
  tick = {.time = entry.time, .inputs = tick_, .begin = {}};
  if (begins) {
    const Recording::Life& life = recording_.lives[entry.life - 1];
    tick.begin = life.begin.value_or(base::Micros{});
    if (life.from_snapshot) tick.snapshot = &*recording_.facts.snapshot;
  }
  return true;
}

std::optional<RecordedTicks::Answer> RecordedTicks::answer(base::Micros time) {
  while (!answers_.empty()) {
    const Entry entry = answers_.front();
    answers_.pop_front();
    ++number_;
    const auto end = outputs_.begin() + static_cast<std::ptrdiff_t>(entry.outputs);
    answered_.assign(outputs_.begin(), end);
    outputs_.erase(outputs_.begin(), end);
    if (entry.time == time) return Answer{.number = number_, .frames = answered_};
  }
  return std::nullopt;
}

namespace {

std::string text_of(const base::CanFrame* frame, std::uint32_t base) {
  if (frame == nullptr) return "nothing";
  Line line;
  for (std::size_t i = 0; i < frame->size && i < frame->data.size(); ++i) line.hex(frame->data[i], 2);
  return message_name(frame->id - base) + " " + std::string(line.view());
}

}  // namespace

void Comparison::epoch(const NodeEpoch& epoch, base::Micros time) {
  const auto expected = ticks_.answer(time);
  if (!expected) return;
  ++compared_;
  for (const base::CanFrame& frame : epoch.frames)
    if (frame.id - base_ == bus::EstVersion::kOffset)
      if (const auto version = bus::decode<bus::EstVersion>(bus::payload(frame))) config_ = version->config;
  std::size_t at = 0;
  const auto differs = [&](const base::CanFrame* recorded, const base::CanFrame* now) {
    ++different_;
    if (!first_difference_.empty()) return;
    first_difference_ = "epoch " + std::to_string(expected->number) + " at " + in_seconds(time) + ": recorded " +
                        text_of(recorded, log_base_) + ", now " + text_of(now, base_);
  };
  for (const base::CanFrame& answered : epoch.frames) {
    if (!is_deterministic(answered, base_)) continue;
    const base::CanFrame frame = repeatable(answered, base_);
    const base::CanFrame* recorded = at < expected->frames.size() ? &expected->frames[at] : nullptr;
    ++at;
    const bool same = recorded != nullptr && recorded->size == frame.size && recorded->data == frame.data &&
                      recorded->id - log_base_ == frame.id - base_;
    if (!same) return differs(recorded, &frame);
  }
  if (at < expected->frames.size()) differs(&expected->frames[at], nullptr);
}

}  // namespace tetap::sim
