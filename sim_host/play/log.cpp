// SPDX-License-Identifier: Apache-2.0
#include "sim_host/play/log.hpp"

#include "sim_host/play/candump.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <variant>

namespace tetap::sim {

namespace {

constexpr std::size_t kBlock = 1 << 18;

/// Printable part of a line that may be anything.
std::string excerpt(std::string_view text) {
  constexpr std::size_t kLongest = 60;
  std::string shown(text.substr(0, kLongest));
  for (char& c : shown)
    if (c < ' ' || c > '~') c = '?';
  return text.size() > kLongest ? shown + "..." : shown;
}

/// A temporary file with the rest of `from`.
std::FILE* copy_of(std::FILE* from) {
  std::FILE* to = std::tmpfile();
  if (to == nullptr) return nullptr;
  std::vector<char> block(kBlock);
  for (std::size_t got = kBlock; got == kBlock;) {
    got = std::fread(block.data(), 1, kBlock, from);
    if (std::fwrite(block.data(), 1, got, to) == got) continue;
    std::fclose(to);
    return nullptr;
  }
  std::rewind(to);
  return to;
}

}  // namespace

std::optional<TimedFrame> LogParser::add(std::string_view text, bool ended) {
  constexpr base::Micros kLongGap{60'000'000};
  ++number_;
  const auto place = [this] { return report_.name + ":" + std::to_string(number_); };
  const auto cut_off = [&] {
    report_.cut_off = place() + ": the last line is cut off and left out: '" + excerpt(text) + "'";
    return std::nullopt;
  };
  const auto parsed = parse_log_line(text);
  const auto* line = std::get_if<LogLine>(&parsed);
  if (line == nullptr) {
    if (text.find_first_not_of(" \t\r") == std::string_view::npos) return std::nullopt;
    if (!ended) return cut_off();
    const std::string message =
        place() + ": " + std::string(std::get<BadLine>(parsed).reason) + ": '" + excerpt(text) + "'";
    if (!options_.keep_going) throw std::runtime_error(message);
    if (report_.malformed++ == 0) report_.first_malformed = message;
    return std::nullopt;
  }
  if (!options_.interface.empty() && line->interface != options_.interface)
    return ++report_.other_interface, std::nullopt;
  if (line->kind != LogLine::Kind::kData) return ++report_.not_data, std::nullopt;
  const base::CanFrame frame = line->classic();
  // Every message of a node's block has eight bytes.
  if (!ended && frame.size != 8 && !frame.extended && frame.id / 0x40 == options_.base / 0x40) return cut_off();
  if (line->time < latest_) ++report_.back_in_time;
  if (report_.data++ > 0 && kLongGap < line->time - latest_ && report_.gaps++ == 0) report_.first_gap = place();
  latest_ = std::max(latest_, line->time);
  constexpr std::uint32_t kInputs = 0x20;
  const bool input = !frame.extended && frame.id >= options_.base && frame.id < options_.base + kInputs;
  if (input && frame.size != 8 && report_.wrong_length++ == 0) report_.first_wrong_length = place();
  return TimedFrame{line->time, frame};
}

LogFile::LogFile(const std::string& path, const LogOptions& options)
    : path_(path), options_(options), file_(std::fopen(path.c_str(), "rb"), &std::fclose), parser_(path, options) {
  if (!file_) refuse(std::string("cannot be read: ") + std::strerror(errno));
  if (std::fseek(file_.get(), 0, SEEK_SET) != 0) {
    std::FILE* copy = copy_of(file_.get());
    if (copy == nullptr) refuse(std::string("cannot be copied into a temporary file: ") + std::strerror(errno));
    file_.reset(copy);
  }
  block_.resize(kBlock);
}

void LogFile::refuse(const std::string& reason) const { throw std::runtime_error(path_ + ": " + reason); }

/// Moves what is left to the front and reads on behind it; false: nothing more.
bool LogFile::read_block() {
  std::memmove(block_.data(), block_.data() + begin_, end_ - begin_);
  end_ -= begin_;
  begin_ = 0;
  if (end_ == block_.size()) block_.resize(2 * block_.size());  // a line may be of any length
  std::size_t wanted = block_.size() - end_;
  if (report_) wanted = static_cast<std::size_t>(std::min<std::uint64_t>(wanted, length_ - bytes_));
  const std::size_t got = std::fread(block_.data() + end_, 1, wanted, file_.get());
  if (std::ferror(file_.get()) != 0) refuse(std::string("cannot be read: ") + std::strerror(errno));
  end_ += got;
  bytes_ += got;
  return got > 0;
}

bool LogFile::next_line(TextLine& line) {
  std::size_t searched = 0;
  for (;;) {
    const std::string_view rest(block_.data() + begin_, end_ - begin_);
    const std::size_t found = rest.find('\n', searched);
    if (found != std::string_view::npos) {
      line = {rest.substr(0, found), true};
      begin_ += found + 1;
      return true;
    }
    searched = rest.size();
    if (read_block()) continue;
    line = {std::string_view(block_.data() + begin_, end_ - begin_), false};
    begin_ = end_;
    return !line.text.empty();
  }
}

bool LogFile::next(TimedFrame& frame) {
  TextLine line;
  while (next_line(line)) {
    const auto found = parser_.add(line.text, line.ended);
    if (!found) continue;
    frame = *found;
    return true;
  }
  if (!report_) {
    report_ = parser_.report();
    length_ = bytes_;
  }
  if (parser_.report().data != report_->data) refuse("has changed while it was played");
  return false;
}

void LogFile::rewind() {
  std::rewind(file_.get());
  parser_ = LogParser(path_, options_);
  begin_ = end_ = 0;
  bytes_ = 0;
}

Log parse_log(std::string_view text, const std::string& name, const LogOptions& options) {
  LogParser parser(name, options);
  Log log;
  while (!text.empty()) {
    const std::size_t end = text.find('\n');
    if (const auto frame = parser.add(text.substr(0, end), end != std::string_view::npos)) log.frames.push_back(*frame);
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
  }
  static_cast<LogReport&>(log) = parser.report();
  return log;
}

}  // namespace tetap::sim
