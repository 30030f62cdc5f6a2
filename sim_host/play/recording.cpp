// SPDX-License-Identifier: Apache-2.0
#include "sim_host/play/recording.hpp"

#include "bus/decoder.hpp"
#include "sim_host/play/names.hpp"
#include "sim_host/play/node_link.hpp"

#include <algorithm>
#include <stdexcept>

namespace tetap::sim {

namespace {

constexpr std::size_t kEnough = 32;  ///< epochs, with 16 bits of CRC each, that fix where a node's consumption begins

}  // namespace

void RecordReader::refuse(const std::string& why) const {
  throw std::runtime_error(name_ + ": cannot be repeated exactly: " + why);
}

RecordReader::Found RecordReader::add(const TimedFrame& entry) {
  const base::CanFrame& frame = entry.frame;
  Found found;
  const auto offset = offset_in_block(frame, log_base_);
  if (!offset) return found;
  if (is_counted_input(frame, log_base_)) {
    ++inputs_;
    found.input = true;
    return found;
  }
  if (*offset == bus::InSync::kOffset) {
    const auto sync = bus::decode<bus::InSync>(bus::payload(frame));
    if (sync && sync->kind == bus::SyncKind::kBegin)
      pending_ = Begin{extend_bus_time(sync->time_us, entry.time), inputs_};
    return found;
  }
  if (pending_ && collector_.is_begin_response(frame)) {
    found.new_life = std::exchange(pending_, std::nullopt);
    begun_ = true;
    skips_ = false;
    number_ = 0;
  }
  if (*offset == bus::EstEpoch::kOffset) {
    if (!collector_.idle() && collector_.head() && !skips_)
      refuse("the epoch before " + in_seconds(entry.time) + " lacks its last frame");
    inputs_before_ = inputs_;
  }
  if (const auto epoch = collector_.add(frame); epoch && to_be_repeated(*epoch, entry.time)) found.epoch = epoch;
  return found;
}

bool RecordReader::to_be_repeated(const NodeEpoch& epoch, base::Micros logged) {
  const bool next_one = epoch.tail.epoch == static_cast<std::uint8_t>(number_ + 1);
  if (number_ == 0 && !begun_ && (!next_one || !epoch.head)) skips_ = true;
  if (skips_) return ++skipped_epochs_, false;
  if (!epoch.head) refuse("the epoch at " + in_seconds(logged) + " lacks its first frame");
  if (!next_one) refuse("epochs are missing before " + in_seconds(logged));
  ++number_;
  return true;
}

void RecordSurvey::note_version(const base::CanFrame& frame) {
  if (frame.id == log_base_ + bus::EstVersion::kOffset)
    if (const auto version = bus::decode<bus::EstVersion>(bus::payload(frame))) result_.config = version->config;
  if (frame.id == log_base_ + bus::EstDiagBus::kOffset)
    if (const auto diagnosis = bus::decode<bus::EstDiagBus>(bus::payload(frame)))
      result_.rx_overflow = diagnosis->rx_overflow;
}

void RecordSurvey::add(const TimedFrame& entry) {
  const RecordReader::Found found = reader_.add(entry);
  if (found.input)
    crcs_.push_back(bus::frame_crc(static_cast<std::uint8_t>(entry.frame.id - log_base_), entry.frame));
  else if (!entry.frame.extended)
    note_version(entry.frame);
  if (found.new_life) start_life(*found.new_life);
  if (reader_.skips()) drop_before(reader_.pending() ? reader_.pending()->inputs : reader_.inputs());
  if (found.epoch) add_epoch(*found.epoch);
  // A Begin frame that is not answered yet may end this life: inputs behind it are left for the next one.
  if (!waiting_.empty()) follow_until(reader_.pending() ? reader_.pending()->inputs : reader_.inputs(), false);
}

void RecordSurvey::drop_before(std::uint64_t input) {
  for (; first_crc_ < input; ++first_crc_) crcs_.pop_front();
}

void RecordSurvey::start_life(const RecordReader::Begin& begin) {
  close_life(begin.inputs);
  drop_before(begin.inputs);
  begin_ = begin.time;
  life_inputs_ = begin.inputs;
  best_.reset();
  started_ = differs_ = has_entries_ = false;
  tally_ = {};
}

void RecordSurvey::add_epoch(const NodeEpoch& epoch) {
  if (epoch.received < epoch.tail.frames) result_.missing_outputs += epoch.tail.frames - epoch.received;
  waiting_.push_back({.time = {static_cast<std::int64_t>(epoch.head->time_us)},
                      .in_count = epoch.tail.in_count,
                      .in_crc = epoch.head->in_crc});
  if (std::exchange(has_entries_, true)) return;
  const std::uint64_t before = reader_.inputs_before();
  if (begin_ || epoch.tail.in_count > before)
    start_at(life_inputs_);
  else
    best_ = before - epoch.tail.in_count;
}

void RecordSurvey::start_at(std::uint64_t input) {
  drop_before(input);
  result_.lives.push_back({.begin = begin_, .first_input = input});
  started_ = true;
}

/// Whether the node's tally of its first epochs is that of the inputs from `start` on, none of them behind `end`.
bool RecordSurvey::match_begin(std::size_t start, std::size_t end) const {
  bus::InputCrc tally;
  for (std::size_t e = 0; e < waiting_.size() && e < kEnough; ++e) {
    while (static_cast<std::uint16_t>(tally.count()) != waiting_[e].in_count) {
      if (start == end) return false;
      tally.add(crcs_[start++]);
    }
    tally.close_epoch();
    if (static_cast<std::uint16_t>(tally.running()) != waiting_[e].in_crc) return false;
  }
  return true;
}

/// Where in the log the node's consumption begins. With a Begin frame that is known; a node that was switched on while
/// frames were flowing took some of those before its first epoch, and its own CRC of them shows which.
void RecordSurvey::find_start(std::uint64_t end, bool power_cycle_ended) {
  if (!power_cycle_ended) {
    if (waiting_.size() < kEnough) return;
    std::uint64_t needed = *best_;
    std::uint16_t count = 0;
    for (std::size_t e = 0; e < kEnough; ++e)
      needed += static_cast<std::uint16_t>(waiting_[e].in_count - std::exchange(count, waiting_[e].in_count));
    if (needed > end) return;
  }
  for (std::size_t start = *best_ + 1; start-- > 0;)
    if (match_begin(start, end)) return start_at(start);
  start_at(*best_);
}

/// Takes every input before `end` that a waiting epoch counted as consumed.
void RecordSurvey::follow_until(std::uint64_t end, bool power_cycle_ended) {
  if (!started_) find_start(end, power_cycle_ended);
  if (!started_) return;
  for (; !waiting_.empty(); waiting_.pop_front()) {
    const Entry& entry = waiting_.front();
    while (static_cast<std::uint16_t>(tally_.count()) != entry.in_count) {
      if (first_crc_ == end) return;
      tally_.add(crcs_.front());
      crcs_.pop_front();
      ++first_crc_;
    }
    tally_.close_epoch();
    ++result_.epochs;
    if (differs_ || static_cast<std::uint16_t>(tally_.running()) == entry.in_crc) continue;
    differs_ = true;
    if (!result_.inputs_differ_at) result_.inputs_differ_at = entry.time;
  }
}

void RecordSurvey::close_life(std::uint64_t end) {
  if (waiting_.empty()) return;
  follow_until(end, true);
  if (waiting_.empty()) return;
  if (end == life_inputs_ && result_.epochs == 0)
    throw std::runtime_error(result_.name + ": no input frames in this log, only what a node said");
  reader_.refuse("the node consumed more input frames until " + in_seconds(waiting_.front().time) +
                 " than the log holds");
}

Recording RecordSurvey::finish() {
  close_life(reader_.inputs());
  result_.skipped_epochs = reader_.skipped_epochs();
  if (result_.epochs == 0 && result_.skipped_epochs > 0)
    reader_.refuse("it begins after the node's start: no Begin frame, and its first epoch is not the node's first");
  if (result_.epochs == 0) reader_.refuse("no whole epoch of a node in it");
  return result_;
}

Recording recording_of(Frames& log, const std::string& name, const ScriptOptions& options) {
  RecordSurvey survey(name, options.log_base);
  log.rewind();
  for (TimedFrame entry; log.next(entry);) survey.add(entry);
  return survey.finish();
}

void RecordedTicks::read(const TimedFrame& entry) {
  const RecordReader::Found found = reader_.add(entry);
  if (found.input && reader_.inputs() > consumed_) {
    inputs_.push_back(entry.frame);
    inputs_.back().id = entry.frame.id - options_.log_base + options_.base;
  }
  if (found.new_life) in_life_ = false;
  if (!found.epoch) return;
  if (!std::exchange(in_life_, true)) ++read_lives_;
  std::size_t count = 0;
  for (const base::CanFrame& frame : found.epoch->frames) {
    if (!is_deterministic(frame, options_.log_base)) continue;
    outputs_.push_back(frame);
    ++count;
  }
  entries_.push_back({.time = {static_cast<std::int64_t>(found.epoch->head->time_us)},
                      .in_count = found.epoch->tail.in_count,
                      .life = read_lives_,
                      .outputs = count});
}

/// The next epoch's node has started before any of its inputs.
void RecordedTicks::start_life() {
  const std::uint64_t first = recording_.lives[played_lives_++].first_input;
  const auto passed = static_cast<std::ptrdiff_t>(std::min<std::uint64_t>(first - consumed_, inputs_.size()));
  inputs_.erase(inputs_.begin(), inputs_.begin() + passed);
  consumed_ = first;
  in_count_ = 0;
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
  if (begins) start_life();
  const std::size_t wanted = static_cast<std::uint16_t>(entry.in_count - in_count_);
  while (inputs_.size() < wanted) {
    if (!log_.next(frame)) return false;
    read(frame);
  }
  const auto end = inputs_.begin() + static_cast<std::ptrdiff_t>(wanted);
  tick_.assign(inputs_.begin(), end);
  inputs_.erase(inputs_.begin(), end);
  consumed_ += wanted;
  in_count_ = entry.in_count;
  entries_.pop_front();
  answers_.push_back(entry);
  ++given_;
  tick = {.time = entry.time, .inputs = tick_, .begin = {}};
  if (begins) tick.begin = recording_.lives[entry.life - 1].begin.value_or(base::Micros{});
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
  for (const base::CanFrame& frame : epoch.frames) {
    if (!is_deterministic(frame, base_)) continue;
    const base::CanFrame* recorded = at < expected->frames.size() ? &expected->frames[at] : nullptr;
    ++at;
    const bool same = recorded != nullptr && recorded->size == frame.size && recorded->data == frame.data &&
                      recorded->id - log_base_ == frame.id - base_;
    if (!same) return differs(recorded, &frame);
  }
  if (at < expected->frames.size()) differs(&expected->frames[at], nullptr);
}

}  // namespace tetap::sim
