// SPDX-License-Identifier: Apache-2.0
#include "sim_host/page/module/browser_log.hpp"

#include "sim_host/page/module/browser.hpp"

#include <cstring>

namespace tetap::page {

/// Moves what is left to the front and reads on behind it; false: nothing more.
bool BrowserLog::read_block() {
  std::memmove(block_.data(), block_.data() + begin_, end_ - begin_);
  end_ -= begin_;
  begin_ = 0;
  const std::size_t got = tetap_read(offset_, block_.data() + end_, static_cast<std::uint32_t>(block_.size() - end_));
  end_ += got;
  offset_ += static_cast<double>(got);
  return got > 0;
}

bool BrowserLog::next_line(TextLine& line) {
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
    const bool too_long = searched > sim::kLongestLine;  // refused by the parser
    if (!too_long && read_block()) continue;
    line = {std::string_view(block_.data() + begin_, end_ - begin_), false};
    begin_ = end_;
    return !line.text.empty();
  }
}

bool BrowserLog::next(sim::TimedFrame& frame) {
  TextLine line;
  while (!failure_ && next_line(line)) {
    const auto found = parser_.add(line.text, line.ended);
    if (!found) return failure_ = found.failure(), false;
    if (!*found) continue;
    frame = **found;
    return true;
  }
  return false;
}

void BrowserLog::rewind() {
  parser_ = sim::LogParser(name_, options_);
  failure_.reset();
  begin_ = end_ = 0;
  offset_ = 0;
}

}  // namespace tetap::page
