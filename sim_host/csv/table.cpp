// SPDX-License-Identifier: Apache-2.0
#include "sim_host/csv/table.hpp"

#include "sim_host/csv/number.hpp"

#include <algorithm>
#include <initializer_list>

namespace tetap::csv {

namespace {

constexpr std::size_t kLongestLine = 1 << 16, kMostColumns = 4096;

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && (text.front() == ' ' || text.front() == '\t')) text.remove_prefix(1);
  while (!text.empty() && (text.back() == ' ' || text.back() == '\t' || text.back() == '\r')) text.remove_suffix(1);
  return text;
}

std::string_view unquoted(std::string_view cell) {
  cell = trimmed(cell);
  if (cell.size() >= 2 && cell.front() == '"' && cell.back() == '"') cell = trimmed(cell.substr(1, cell.size() - 2));
  return cell;
}

/// The first of tab, semicolon, comma and blank that stands outside of quotes.
char separator_of(std::string_view line) {
  for (const char one : {'\t', ';', ',', ' '}) {
    bool quoted = false;
    for (const char c : line) {
      if (c == '"') quoted = !quoted;
      if (c == one && !quoted) return one;
    }
  }
  return ',';
}

}  // namespace

std::string excerpt(std::string_view text) {
  constexpr std::size_t kLongest = 40;
  std::string shown(text.substr(0, kLongest));
  for (char& c : shown)
    if (static_cast<unsigned char>(c) < ' ' || c == '\x7F') c = '?';
  return text.size() > kLongest ? shown + "..." : shown;
}

std::string_view Table::stem() const {
  std::string_view stem = name_;
  if (const auto slash = stem.find_last_of("/\\"); slash != std::string_view::npos) stem.remove_prefix(slash + 1);
  return stem.substr(0, stem.rfind('.'));
}

bool Table::next_line(std::string_view& text, bool& ended) {
  while (!left_.empty()) {
    const std::size_t end = left_.find('\n');
    ended = end != std::string_view::npos;
    text = trimmed(left_.substr(0, end));
    left_.remove_prefix(ended ? end + 1 : left_.size());
    ++line_;
    if (!text.empty()) return true;
  }
  return false;
}

void Table::split(std::string_view line, std::vector<std::string_view>& cells) const {
  cells.clear();
  std::size_t begin = 0;
  bool quoted = false;
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (line[i] == '"') quoted = !quoted;
    if (line[i] != separator_ || quoted) continue;
    if (separator_ == ' ' && line[i + 1] == ' ') continue;  // blanks part columns together, and end no line
    cells.push_back(unquoted(line.substr(begin, i - begin)));
    begin = i + 1;
  }
  cells.push_back(unquoted(line.substr(begin)));
}

sim::Result<Table> Table::open(const std::string& name, std::string_view text) {
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  if (text.starts_with("\xFF\xFE") || text.starts_with("\xFE\xFF"))
    return sim::Failure{name + ":1: text in UTF-16; save the table as UTF-8", 1};
  if (text.find('\n') == std::string_view::npos && text.find('\r') != std::string_view::npos)
    return sim::Failure{name + ":1: its lines end with a carriage return alone; save the table with line feeds", 1};
  Table table(name, text);
  std::string_view line, remark, before = table.left_;
  bool ended = false;
  std::uint64_t number = 0;
  while (table.next_line(line, ended)) {
    if (line.size() > kLongestLine)
      return sim::Failure{name + ":" + std::to_string(table.line_) + ": a line of " + std::to_string(line.size()) +
                              " bytes is no row of a table",
                          table.line_};
    if (table.line_ == 1 && line.size() == 5 && line.starts_with("sep=")) {  // a note for a table calculator
      line = {};
      continue;
    }
    if (!line.starts_with('#')) break;
    remark = line.substr(1);
    number = table.line_;
    before = table.left_;
    line = {};
  }
  if (line.empty()) return sim::Failure{name + ": no row in it", 0};
  std::vector<std::string_view> cells, names;
  table.separator_ = separator_of(line);
  table.split(line, cells);
  const char point = table.separator_ == ',' ? '.' : ',';
  const auto is_number = [&](std::string_view cell) {
    return parse_real(cell, '.').has_value() || parse_real(cell, point).has_value();
  };
  if (is_number(cells.front())) {  // a row of numbers: the names stand in the remark, or the columns have numbers
    table.split(remark, names);
    if (names.size() != cells.size()) names.clear();
    table.left_ = before;
    table.line_ = number;
    for (std::size_t i = 0; i < cells.size(); ++i)
      table.columns_.push_back(names.empty() ? std::to_string(i + 1) : std::string(names[i]));
  } else {
    for (const std::string_view cell : cells) table.columns_.emplace_back(cell);
  }
  if (table.columns_.size() > kMostColumns)
    return sim::Failure{name + ":" + std::to_string(table.line_) + ": " + std::to_string(table.columns_.size()) +
                            " columns; a table has up to " + std::to_string(kMostColumns),
                        table.line_};
  // The first comma within a number shows that it stands before fractions.
  if (table.separator_ != ',') {
    const std::string_view some = table.left_.substr(0, kLongestLine);
    const auto rows = some.substr(0, some.rfind('\n'));
    const bool comma = rows.find(',') != std::string_view::npos, dot = rows.find('.') != std::string_view::npos;
    table.point_ = comma && !dot ? ',' : '.';
  }
  return table;
}

bool Table::next(std::vector<std::string_view>& cells) {
  std::string_view line;
  bool ended = false;
  while (next_line(line, ended)) {
    if (line.starts_with('#')) continue;
    split(line, cells);
    while (cells.size() > columns_.size() && cells.back().empty()) cells.pop_back();  // a separator ends the line
    if (cells.size() == columns_.size()) return true;
    if (!ended) return cut_off_ = true, false;
    failed_ = true;
    failure_ = {name_ + ":" + std::to_string(line_) + ": " + std::to_string(cells.size()) + " columns, the table has " +
                    std::to_string(columns_.size()) + ": '" + excerpt(line) + "'",
                line_};
    return false;
  }
  return false;
}

sim::Failure Table::refuse(std::size_t column, std::string_view cell, std::string_view reason) const {
  return {name_ + ":" + std::to_string(line_) + ": column " + std::to_string(column + 1) + " '" +
              excerpt(columns_[column]) + "': '" + excerpt(cell) + "' " + std::string(reason),
          line_};
}

}  // namespace tetap::csv
