// SPDX-License-Identifier: Apache-2.0
// Lines of a text that is read in blocks, so that a log of hours is never held whole.
#pragma once

#include "sim_host/replay/log.hpp"

#include <cstddef>
#include <cstring>
#include <string_view>
#include <vector>

namespace tetap::sim {

struct TextLine {
  std::string_view text;
  bool ended = true;  ///< by a newline
};

class LineBlocks {
 public:
  static constexpr std::size_t kBlock = 1 << 18;
  static_assert(kBlock > 2 * kLongestLine);

  /// The next line, which lasts until the next call; false: no more. read(to, size) puts at most `size` bytes at `to`
  /// and gives their number, 0 behind the end. A line longer than kLongestLine comes in pieces, which the parser
  /// refuses.
  template <class Read>
  bool next(TextLine& line, Read&& read) {
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
      if (searched <= kLongestLine && refill(read)) continue;
      line = {std::string_view(block_.data() + begin_, end_ - begin_), false};
      begin_ = end_;
      return !line.text.empty();
    }
  }
  /// For another reading from the beginning.
  void clear() { begin_ = end_ = 0; }

 private:
  /// Moves what is left to the front and reads on behind it; false: nothing more.
  template <class Read>
  bool refill(Read&& read) {
    std::memmove(block_.data(), block_.data() + begin_, end_ - begin_);
    end_ -= begin_;
    begin_ = 0;
    const std::size_t got = read(block_.data() + end_, block_.size() - end_);
    end_ += got;
    return got > 0;
  }

  std::vector<char> block_ = std::vector<char>(kBlock);
  std::size_t begin_ = 0, end_ = 0;  ///< unread part of block_
};

}  // namespace tetap::sim
