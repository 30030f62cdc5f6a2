// SPDX-License-Identifier: Apache-2.0
// A table in text: columns parted by comma, semicolon, tab or blanks, names in its first line, names and cells perhaps
// in quotes. Lines that begin with # are remarks; the last of them has the names where no other line has.
#pragma once

#include "sim_host/replay/result.hpp"

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace tetap::csv {

class Table {
 public:
  /// Reads the names. The text outlives the table. A failure names the file.
  static sim::Result<Table> open(const std::string& name, std::string_view text);

  [[nodiscard]] const std::string& name() const { return name_; }
  /// Name without folder and extension: "Gyroscope".
  [[nodiscard]] std::string_view stem() const;
  [[nodiscard]] const std::vector<std::string>& columns() const { return columns_; }
  /// Before the fraction of a number.
  [[nodiscard]] char point() const { return point_; }

  /// The next row's cells without blanks around them; false: no more, or a failure.
  bool next(std::vector<std::string_view>& cells);
  [[nodiscard]] const sim::Failure* failure() const { return failed_ ? &failure_ : nullptr; }
  /// Number of the row's line, from 1.
  [[nodiscard]] std::uint64_t line() const { return line_; }
  /// A last line that ends within a row and is left out.
  [[nodiscard]] bool cut_off() const { return cut_off_; }

  /// "FILE:LINE: column 3 'x': 'abc' REASON".
  [[nodiscard]] sim::Failure refuse(std::size_t column, std::string_view cell, std::string_view reason) const;

 private:
  Table(const std::string& name, std::string_view text) : name_(name), left_(text) {}
  void split(std::string_view line, std::vector<std::string_view>& cells) const;
  /// The next line that is no remark; false: no more.
  bool next_line(std::string_view& text, bool& ended);

  std::string name_;
  std::string_view left_;
  std::vector<std::string> columns_;
  std::uint64_t line_ = 0;
  char separator_ = ',', point_ = '.';
  bool cut_off_ = false, failed_ = false;
  sim::Failure failure_;
};

/// Printable part of text from a file.
[[nodiscard]] std::string excerpt(std::string_view text);

}  // namespace tetap::csv
