// SPDX-License-Identifier: Apache-2.0
#include "sim_host/play/recording.hpp"

#include "bus/decoder.hpp"
#include "bus/publisher.hpp"
#include "sim_host/play/names.hpp"
#include "sim_host/play/node_link.hpp"

#include <algorithm>
#include <stdexcept>

namespace tetap::sim {

namespace {

/// What a node did between one start and the next.
struct Segment {
  struct Entry {
    bus::EstStateCrc tail;
    std::uint16_t in_crc = 0;
    std::size_t inputs_before = 0;  ///< input frames in the log before this epoch's first frame
    RecordedEpoch epoch;
  };
  std::optional<base::Micros> begin;
  std::vector<base::CanFrame> inputs;
  std::vector<Entry> entries;
  bool skipped = false;  ///< the log begins in the middle of it: what the node knew by then is unknown
};

/// Follows the tally of the node over the first `limit` entries, its first input being inputs[start]; the place of the
/// first disagreement.
std::optional<std::size_t> disagreement(const Segment& segment, std::size_t start, std::uint32_t log_base,
                                        std::size_t limit) {
  bus::InputCrc tally;
  std::size_t next = start;
  for (std::size_t e = 0; e < segment.entries.size() && e < limit; ++e) {
    while (static_cast<std::uint16_t>(tally.count()) != segment.entries[e].tail.in_count) {
      if (next == segment.inputs.size()) return e;
      const base::CanFrame& frame = segment.inputs[next++];
      tally.add(bus::frame_crc(static_cast<std::uint8_t>(frame.id - log_base), frame));
    }
    tally.close_epoch();
    if (static_cast<std::uint16_t>(tally.running()) != segment.entries[e].in_crc) return e;
  }
  return std::nullopt;
}

/// Where in the log the node's consumption begins. With a Begin frame that is known; a node that was switched on while
/// frames were flowing took some of those before its first epoch, and its own CRC of them tells which.
std::size_t find_start(const Segment& segment, std::uint32_t log_base) {
  constexpr std::size_t kEnough = 32;  // epochs; 16 bits of CRC each
  if (segment.begin) return 0;
  const Segment::Entry& first = segment.entries.front();
  if (first.tail.in_count > first.inputs_before) return 0;
  std::size_t best = first.inputs_before - first.tail.in_count;
  for (std::size_t start = best + 1; start-- > 0;)
    if (!disagreement(segment, start, log_base, kEnough)) return start;
  return best;
}

class Builder {
 public:
  Builder(const Log& log, const ScriptOptions& options) : log_(log), options_(options), collector_(options.log_base) {
    result_.base = options.log_base;
  }

  Recording build() {
    for (const TimedFrame& entry : log_.frames) add(entry);
    close_segment();
    if (result_.epochs.empty() && result_.skipped_epochs > 0)
      refuse("it begins after the node's start: no Begin frame, and its first epoch is not the node's first");
    if (result_.epochs.empty()) refuse("no whole epoch of a node in it");
    return std::move(result_);
  }

 private:
  [[noreturn]] void refuse(const std::string& why) const {
    throw std::runtime_error(log_.name + ": cannot be repeated exactly: " + why);
  }

  void add(const TimedFrame& entry) {
    const base::CanFrame& frame = entry.frame;
    const auto offset = offset_in_block(frame, options_.log_base);
    if (!offset) return;
    if (is_counted_input(frame, options_.log_base)) return segment_.inputs.push_back(frame);
    if (*offset == bus::InSync::kOffset) {
      const auto sync = bus::decode<bus::InSync>(bus::payload(frame));
      if (sync && sync->kind == bus::SyncKind::kBegin)
        begin_ = Begin{extend_bus_time(sync->time_us, entry.time), segment_.inputs.size()};
      return;
    }
    if (begin_ && collector_.is_begin_answer(frame)) start_segment();
    if (*offset == bus::EstEpoch::kOffset) {
      if (!collector_.idle() && collector_.head() && !segment_.skipped)
        refuse("the epoch before " + in_seconds(entry.time) + " lacks its last frame");
      inputs_before_ = segment_.inputs.size();
    }
    if (*offset == bus::EstVersion::kOffset)
      if (const auto version = bus::decode<bus::EstVersion>(bus::payload(frame))) result_.config = version->config;
    if (*offset == bus::EstDiagBus::kOffset)
      if (const auto bus = bus::decode<bus::EstDiagBus>(bus::payload(frame))) result_.rx_overflow = bus->rx_overflow;
    if (const auto epoch = collector_.add(frame)) add_epoch(*epoch, entry.time);
  }

  /// The node took up the last Begin frame; what came before it belongs to its life before.
  void start_segment() {
    Segment next;
    next.begin = begin_->time;
    next.inputs.assign(segment_.inputs.begin() + static_cast<std::ptrdiff_t>(begin_->inputs), segment_.inputs.end());
    segment_.inputs.resize(begin_->inputs);
    close_segment();
    segment_ = std::move(next);
    begin_.reset();
  }

  void add_epoch(const NodeEpoch& epoch, base::Micros logged) {
    const std::size_t number = segment_.entries.size() + 1;
    const bool next_one = epoch.tail.epoch == static_cast<std::uint8_t>(number);
    if (number == 1 && !segment_.begin && (!next_one || !epoch.head)) segment_.skipped = true;
    if (segment_.skipped) return void(++result_.skipped_epochs);
    if (!epoch.head) refuse("the epoch at " + in_seconds(logged) + " lacks its first frame");
    if (!next_one) refuse("epochs are missing before " + in_seconds(logged));
    if (epoch.received < epoch.tail.frames) result_.missing_outputs += epoch.tail.frames - epoch.received;
    Segment::Entry entry{
        .tail = epoch.tail, .in_crc = epoch.head->in_crc, .inputs_before = inputs_before_, .epoch = {}};
    entry.epoch.time = {static_cast<std::int64_t>(epoch.head->time_us)};
    entry.epoch.first = result_.outputs.size();
    for (const base::CanFrame& frame : epoch.frames)
      if (is_deterministic(frame, options_.log_base)) result_.outputs.push_back(frame);
    entry.epoch.count = result_.outputs.size() - entry.epoch.first;
    segment_.entries.push_back(entry);
  }

  void close_segment() {
    if (segment_.entries.empty()) return;
    const std::size_t start = find_start(segment_, options_.log_base);
    if (const auto e = disagreement(segment_, start, options_.log_base, segment_.entries.size());
        e && !result_.inputs_differ_at)
      result_.inputs_differ_at = segment_.entries[*e].epoch.time;
    std::size_t next = start;
    std::uint16_t consumed = 0;
    bool first = true;
    for (const Segment::Entry& entry : segment_.entries) {
      for (; consumed != entry.tail.in_count; ++consumed) {
        if (segment_.inputs.empty() && result_.epochs.empty())
          throw std::runtime_error(log_.name + ": no input frames in this log, only what a node said");
        if (next == segment_.inputs.size())
          refuse("the node consumed more input frames until " + in_seconds(entry.epoch.time) + " than the log holds");
        base::CanFrame frame = segment_.inputs[next++];
        frame.id = frame.id - options_.log_base + options_.base;
        result_.script.add_input(frame);
      }
      result_.script.add_tick(entry.epoch.time,
                              first ? std::optional(segment_.begin.value_or(base::Micros{})) : std::nullopt);
      result_.epochs.push_back(entry.epoch);
      first = false;
    }
  }

  struct Begin {
    base::Micros time;
    std::size_t inputs;  ///< in the log before it
  };
  const Log& log_;
  ScriptOptions options_;
  EpochCollector collector_;
  Segment segment_;
  std::optional<Begin> begin_;
  std::size_t inputs_before_ = 0;
  Recording result_;
};

}  // namespace

bool is_recording(std::span<const TimedFrame> log, std::uint32_t log_base) {
  return std::any_of(log.begin(), log.end(), [&](const TimedFrame& e) {
    return offset_in_block(e.frame, log_base) == bus::EstStateCrc::kOffset;
  });
}

Recording recording_of(const Log& log, const ScriptOptions& options) { return Builder(log, options).build(); }

namespace {

std::string text_of(const base::CanFrame* frame, std::uint32_t base) {
  if (frame == nullptr) return "nothing";
  Line line;
  for (std::size_t i = 0; i < frame->size && i < frame->data.size(); ++i) line.hex(frame->data[i], 2);
  return message_name(frame->id - base) + " " + std::string(line.view());
}

}  // namespace

void Comparison::epoch(const NodeEpoch& epoch, base::Micros time) {
  while (next_ < recording_.epochs.size() && recording_.epochs[next_].time != time) ++next_;
  if (next_ == recording_.epochs.size()) return;
  const RecordedEpoch& expected = recording_.epochs[next_];
  const std::size_t number = ++next_;
  ++compared_;
  for (const base::CanFrame& frame : epoch.frames)
    if (frame.id - base_ == bus::EstVersion::kOffset)
      if (const auto version = bus::decode<bus::EstVersion>(bus::payload(frame))) config_ = version->config;
  std::size_t at = 0;
  const auto differs = [&](const base::CanFrame* recorded, const base::CanFrame* now) {
    ++different_;
    if (!first_difference_.empty()) return;
    first_difference_ = "epoch " + std::to_string(number) + " at " + in_seconds(time) + ": recorded " +
                        text_of(recorded, recording_.base) + ", now " + text_of(now, base_);
  };
  for (const base::CanFrame& frame : epoch.frames) {
    if (!is_deterministic(frame, base_)) continue;
    const base::CanFrame* recorded = at < expected.count ? &recording_.outputs[expected.first + at] : nullptr;
    ++at;
    const bool same = recorded != nullptr && recorded->size == frame.size && recorded->data == frame.data &&
                      recorded->id - recording_.base == frame.id - base_;
    if (!same) return differs(recorded, &frame);
  }
  if (at < expected.count) differs(&recording_.outputs[expected.first + at], nullptr);
}

}  // namespace tetap::sim
