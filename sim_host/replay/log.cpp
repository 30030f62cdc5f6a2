// SPDX-License-Identifier: Apache-2.0
#include "sim_host/replay/log.hpp"

#include "sim_host/replay/candump.hpp"

#include <algorithm>
#include <variant>

namespace tetap::sim {

namespace {

/// Printable part of a line that may be anything.
std::string excerpt(std::string_view text) {
  constexpr std::size_t kLongest = 60;
  std::string shown(text.substr(0, kLongest));
  for (char& c : shown)
    if (c < ' ' || c > '~') c = '?';
  return text.size() > kLongest ? shown + "..." : shown;
}

}  // namespace

/// candump -t z and an .asc count from the log's start, candump -t d from the frame before. A time of less than half of
/// that before it shows differences, and so do times of which a quarter do not grow: their sum so far is near enough.
base::Micros LogParser::since_start(base::Micros relative) {
  constexpr base::Micros kBurst{1'000};  // the first frames of a log may share a microsecond
  falls_ += relative <= relative_ && relative > kBurst ? 1 : 0;
  ++steps_;
  differences_ = differences_ || relative.us < relative_.us / 2 || (falls_ >= 2 && 4 * falls_ >= steps_);
  relative_ = relative;
  sum_ += relative;
  return differences_ ? sum_ : relative;
}

Result<std::optional<TimedFrame>> LogParser::add(std::string_view text, bool ended) {
  constexpr base::Micros kLongGap{60'000'000};
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";  // editors put it before UTF-8
  if (++number_ == 1 && text.starts_with(kByteOrderMark)) text.remove_prefix(kByteOrderMark.size());
  const auto place = [this] { return report_.name + ":" + std::to_string(number_); };
  constexpr std::optional<TimedFrame> kNone;
  const auto cut_off = [&] {
    report_.cut_off = place() + ": the last line is cut off and left out: '" + excerpt(text) + "'";
    return kNone;
  };
  if (text.size() > kLongestLine)
    return Failure{place() + ": a line above " + std::to_string(kLongestLine) + " bytes: '" + excerpt(text) + "'",
                   number_};
  const auto parsed = parse_log_line(text, decimal_);
  const auto* line = std::get_if<LogLine>(&parsed);
  if (line == nullptr) {
    if (text.find_first_not_of(" \t\r") == std::string_view::npos) return kNone;
    if (!ended) return cut_off();
    const std::string message =
        place() + ": " + std::string(std::get<BadLine>(parsed).reason) + ": '" + excerpt(text) + "'";
    if (!options_.keep_going) return Failure{message, number_};
    if (report_.malformed++ == 0) report_.first_malformed = message;
    return kNone;
  }
  if (line->base) {
    decimal_ = line->base->decimal;
    differences_ = line->base->differences;
  }
  if (line->kind == LogLine::Kind::kHeading && (line->base || line->interface.empty())) return kNone;
  const base::Micros time = line->clock == LogLine::Clock::kRelative ? since_start(line->time) : line->time;
  if (line->kind == LogLine::Kind::kHeading) return kNone;
  if (!options_.interface.empty() && line->interface != options_.interface) return ++report_.other_interface, kNone;
  if (line->kind == LogLine::Kind::kXl) ++report_.xl;
  if (line->kind != LogLine::Kind::kData) return ++report_.not_data, kNone;
  const base::CanFrame frame = line->classic();
  // Every message of a node's block has eight bytes.
  if (!ended && frame.size != 8 && !frame.extended && frame.id / 0x40 == options_.base / 0x40) return cut_off();
  if (time < latest_) ++report_.back_in_time;
  if (report_.data++ > 0 && kLongGap < time - latest_ && report_.gaps++ == 0) report_.first_gap = place();
  latest_ = std::max(latest_, time);
  constexpr std::uint32_t kInputs = 0x20;
  const bool input = !frame.extended && frame.id >= options_.base && frame.id < options_.base + kInputs;
  if (input && frame.size != 8 && report_.wrong_length++ == 0) report_.first_wrong_length = place();
  return std::optional(TimedFrame{time, frame});
}

bool LogText::next(TimedFrame& frame) {
  while (!left_.empty() && !failure_) {
    const std::size_t end = left_.find('\n');
    const auto found = parser_.add(left_.substr(0, end), end != std::string_view::npos);
    left_.remove_prefix(end == std::string_view::npos ? left_.size() : end + 1);
    if (!found) return failure_ = found.failure(), false;
    if (!*found) continue;
    frame = **found;
    return true;
  }
  return false;
}

void LogText::rewind() {
  left_ = text_;
  parser_ = LogParser(name_, options_);
  failure_.reset();
}

Log parse_log(std::string_view text, const std::string& name, const LogOptions& options) {
  LogText lines(text, name, options);
  Log log;
  for (TimedFrame frame; lines.next(frame);) log.frames.push_back(frame);
  static_cast<LogReport&>(log) = lines.report();
  log.failure = lines.failure();
  return log;
}

}  // namespace tetap::sim
