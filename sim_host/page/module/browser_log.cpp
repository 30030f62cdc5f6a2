// SPDX-License-Identifier: Apache-2.0
#include "sim_host/page/module/browser_log.hpp"

#include "sim_host/page/module/browser.hpp"

#include <cstddef>
#include <cstdint>

namespace tetap::page {

bool BrowserLog::next(sim::TimedFrame& frame) {
  const auto read = [this](char* to, std::size_t size) {
    const std::size_t got = tetap_read(offset_, to, static_cast<std::uint32_t>(size));
    offset_ += static_cast<double>(got);
    return got;
  };
  sim::TextLine line;
  while (!failure_ && lines_.next(line, read)) {
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
  lines_.clear();
  offset_ = 0;
}

}  // namespace tetap::page
