// SPDX-License-Identifier: Apache-2.0
// A log that the page holds: read in blocks, so that its size is that of a disk and not of a memory.
#pragma once

#include "sim_host/replay/log.hpp"

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace tetap::page {

class BrowserLog final : public sim::Frames {
 public:
  BrowserLog(const std::string& name, const sim::LogOptions& options)
      : name_(name), options_(options), parser_(name, options), block_(kBlock) {}

  bool next(sim::TimedFrame& frame) override;
  void rewind() override;
  [[nodiscard]] const std::optional<sim::Failure>& failure() const override { return failure_; }
  /// Report of the lines read since the last rewind.
  [[nodiscard]] const sim::LogReport& report() const { return parser_.report(); }

 private:
  static constexpr std::size_t kBlock = 1 << 18;
  static_assert(kBlock > 2 * sim::kLongestLine);

  struct TextLine {
    std::string_view text;
    bool ended = true;  ///< by a newline
  };
  bool next_line(TextLine& line);
  bool read_block();

  std::string name_;
  sim::LogOptions options_;
  sim::LogParser parser_;
  std::vector<char> block_;
  std::size_t begin_ = 0, end_ = 0;  ///< unread part of block_
  double offset_ = 0;                ///< bytes read up to now
  std::optional<sim::Failure> failure_;
};

}  // namespace tetap::page
