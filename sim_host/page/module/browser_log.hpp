// SPDX-License-Identifier: Apache-2.0
// A log that the page holds: read in blocks, so that its size is that of a disk and not of a memory.
#pragma once

#include "sim_host/replay/line_blocks.hpp"
#include "sim_host/replay/log.hpp"

#include <optional>
#include <string>

namespace tetap::page {

class BrowserLog final : public sim::Frames {
 public:
  BrowserLog(const std::string& name, const sim::LogOptions& options)
      : name_(name), options_(options), parser_(name, options) {}

  bool next(sim::TimedFrame& frame) override;
  void rewind() override;
  [[nodiscard]] const std::optional<sim::Failure>& failure() const override { return failure_; }
  /// Report of the lines read since the last rewind.
  [[nodiscard]] const sim::LogReport& report() const { return parser_.report(); }

 private:
  std::string name_;
  sim::LogOptions options_;
  sim::LogParser parser_;
  sim::LineBlocks lines_;
  double offset_ = 0;  ///< bytes read up to now
  std::optional<sim::Failure> failure_;
};

}  // namespace tetap::page
