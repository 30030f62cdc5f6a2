// SPDX-License-Identifier: Apache-2.0
#include "sim_host/replay/candump.hpp"

#include "sim_host/replay/calendar.hpp"

#include <array>
#include <cstdint>
#include <initializer_list>
#include <optional>
#include <utility>

namespace tetap::sim {

namespace {

constexpr std::size_t kCalendarDigits = 10;  ///< seconds since 1970 have so many; candump -t z and -t d write three
constexpr std::uint32_t kErrorFlag = 0x20000000;  ///< candump writes error frames as 8-digit ids with this bit

constexpr std::string_view kForm = "expected '(seconds.micros) interface id#data'";

constexpr int digit(char c) { return c >= '0' && c <= '9' ? c - '0' : -1; }
/// A table: digits of data are as good as random, and a processor guesses branches on them wrong.
constexpr std::array<std::int8_t, 256> kHexDigits = [] {
  std::array<std::int8_t, 256> values{};
  values.fill(-1);
  for (std::uint8_t i = 0; i < 10; ++i) values['0' + i] = static_cast<std::int8_t>(i);
  for (std::uint8_t i = 0; i < 6; ++i) values['a' + i] = values['A' + i] = static_cast<std::int8_t>(10 + i);
  return values;
}();
constexpr int hex_digit(char c) { return kHexDigits[static_cast<unsigned char>(c)]; }
constexpr bool blank(char c) { return c == ' ' || c == '\t'; }

/// Rest of the line.
class Cursor {
 public:
  explicit Cursor(std::string_view text) : text_(text) {}

  [[nodiscard]] std::string_view rest() const { return text_; }
  [[nodiscard]] bool empty() const { return text_.empty(); }
  [[nodiscard]] char front() const { return text_.empty() ? '\0' : text_.front(); }
  bool eat(char c) {
    if (front() != c || text_.empty()) return false;
    text_.remove_prefix(1);
    return true;
  }
  bool eat_word(std::string_view word) {
    if (!text_.starts_with(word)) return false;
    text_.remove_prefix(word.size());
    return true;
  }
  void clear() { text_ = {}; }
  bool eat_blanks() {
    const std::size_t before = text_.size();
    while (!text_.empty() && blank(text_.front())) text_.remove_prefix(1);
    return text_.size() != before;
  }
  /// The first characters, which are there.
  std::string_view take_first(std::size_t n) {
    const std::string_view taken = text_.substr(0, n);
    text_.remove_prefix(n);
    return taken;
  }
  /// The longest prefix of characters that `is` accepts.
  template <class Is>
  std::string_view take(Is is) {
    std::size_t n = 0;
    while (n < text_.size() && is(text_[n])) ++n;
    const std::string_view taken = text_.substr(0, n);
    text_.remove_prefix(n);
    return taken;
  }

 private:
  std::string_view text_;
};

std::optional<base::Micros> parse_time(std::string_view whole, std::string_view part) {
  if (whole.empty() || whole.size() > 12 || part.empty() || part.size() > 9) return std::nullopt;
  std::int64_t us = 0;
  for (const char c : whole) us = us * 10 + digit(c);
  for (std::size_t i = 0; i < 6; ++i) us = us * 10 + (i < part.size() ? digit(part[i]) : 0);
  return base::Micros{us};
}

std::string_view parse_id(std::string_view text, bool of_xl, LogLine& line) {
  std::uint32_t id = 0;
  if (text.size() > 8) return "an id has 3 or 8 hexadecimal digits";
  for (const char c : text) id = id << 4 | static_cast<std::uint32_t>(hex_digit(c));
  if (text.size() == 3) {
    if (id > 0x7FF) return "a 3-digit id is at most 7FF";
  } else if (text.size() == 8) {
    if ((id & kErrorFlag) != 0) {
      line.kind = LogLine::Kind::kError;
      id &= ~kErrorFlag;
    }
    if (id > 0x1FFFFFFF) return "an 8-digit id is at most 1FFFFFFF";
    line.frame.extended = true;
  } else if (!of_xl || text.size() != 5) {
    return "an id has 3 or 8 hexadecimal digits";
  }
  line.frame.id = id;
  return {};
}

std::string_view parse_bytes(Cursor& in, std::size_t limit, base::BasicCanFrame<64>& frame) {
  const std::string_view digits = in.take([](char c) { return hex_digit(c) >= 0; });
  if (digits.size() % 2 != 0) return "an odd number of data digits";
  if (digits.size() / 2 > limit) return limit == 8 ? "more than 8 data bytes" : "more than 64 data bytes";
  frame.size = static_cast<std::uint8_t>(digits.size() / 2);
  for (std::size_t i = 0; i < frame.size; ++i)
    frame.data[i] = static_cast<std::uint8_t>(hex_digit(digits[2 * i]) << 4 | hex_digit(digits[2 * i + 1]));
  return {};
}

constexpr std::size_t kLongestInterface = 200;  ///< a serial adapter's path by its names, and its speed (python-can)
constexpr std::size_t kMostXlBytes = 2048;

/// Behind "id#": a raw length code above 8.
std::string_view parse_raw_length(Cursor& in, std::uint8_t size) {
  if (!in.eat('_')) return {};
  const std::string_view code = in.take([](char c) { return hex_digit(c) >= 0; });
  if (code.size() == 1 && hex_digit(code[0]) >= 9 && size == 8) return {};
  return "a raw length code is 9 to F, after 8 bytes";
}

/// CAN XL behind "id##": "#flags:type:acceptance#data". Its frames are no node's.
std::string_view parse_xl(Cursor& in, LogLine& line) {
  line.kind = LogLine::Kind::kXl;
  bool first = true;
  for (const std::size_t digits : {2U, 2U, 8U}) {
    if (!std::exchange(first, false) && !in.eat(':')) return "CAN XL is id###flags:type:field#data";
    if (in.take([](char c) { return hex_digit(c) >= 0; }).size() != digits)
      return "CAN XL is id###flags:type:field#data";
  }
  if (!in.eat('#')) return "CAN XL is id###flags:type:field#data";
  const std::size_t digits = in.take([](char c) { return hex_digit(c) >= 0; }).size();
  return digits % 2 == 0 && digits / 2 <= kMostXlBytes ? "" : "CAN XL has up to 2048 whole bytes";
}

std::string_view parse_payload(Cursor& in, LogLine& line) {
  if (in.eat('#')) {
    if (in.eat('#')) return parse_xl(in, line);
    if (hex_digit(in.front()) < 0) return "CAN FD needs a digit of flags after ##";
    line.fd_flags = static_cast<std::uint8_t>(hex_digit(in.take([n = 0](char) mutable { return n++ == 0; })[0]));
    line.kind = LogLine::Kind::kFd;
    return parse_bytes(in, 64, line.frame);
  }
  if (in.eat('R') || in.eat('r')) {
    line.kind = LogLine::Kind::kRemote;
    const std::string_view length = in.take([](char c) { return digit(c) >= 0; });
    if (length.size() > 1 || (length.size() == 1 && length[0] > '8')) return "a remote frame's length is 0 to 8";
    line.frame.size = length.empty() ? std::uint8_t{0} : static_cast<std::uint8_t>(digit(length[0]));
    return parse_raw_length(in, line.frame.size);
  }
  if (const auto reason = parse_bytes(in, 8, line.frame); !reason.empty()) return reason;
  return parse_raw_length(in, line.frame.size);
}

/// Bytes parted by blanks, `count` of them.
std::string_view parse_spaced_bytes(Cursor& in, std::size_t count, LogLine& line) {
  if (count > line.frame.data.size()) return "more than 64 data bytes";
  line.frame.size = static_cast<std::uint8_t>(count);
  for (std::size_t i = 0; i < count; ++i) {
    in.eat_blanks();
    const std::string_view text = in.take([](char c) { return hex_digit(c) >= 0; });
    if (text.size() != 2) return "fewer data bytes than the line announces";
    line.frame.data[i] = static_cast<std::uint8_t>(hex_digit(text[0]) << 4 | hex_digit(text[1]));
  }
  return {};
}

/// The rest of a line of `candump -t`, behind the id: "[length] bytes", or two digits of length for CAN FD.
std::string_view parse_listed(Cursor& in, LogLine& line) {
  if (!in.eat('[')) return "no '#' after the id";
  const std::string_view length = in.take([](char c) { return digit(c) >= 0; });
  if (length.empty() || length.size() > 2 || !in.eat(']')) return "the length is [0] to [8], or [00] to [64]";
  std::size_t count = 0;
  for (const char c : length) count = count * 10 + static_cast<std::size_t>(digit(c));
  if (length.size() == 2) line.kind = LogLine::Kind::kFd;
  in.eat_blanks();
  if (in.eat_word("remote request")) {
    line.kind = LogLine::Kind::kRemote;
  } else {
    if (length.size() == 1 && count > 8) return "more than 8 data bytes";
    if (const auto reason = parse_spaced_bytes(in, count, line); !reason.empty()) return reason;
    in.eat_blanks();
  }
  if (in.eat_word("ERRORFRAME")) line.kind = LogLine::Kind::kError;
  in.eat_blanks();
  if (in.front() == '\'') in.clear();  // the bytes as text, candump -a
  return {};
}

/// Lines of an .asc that are no frame.
constexpr std::array<std::string_view, 7> kHeadings{
    "date ", "internal events", "no internal events", "// ", "Begin Triggerblock", "Begin TriggerBlock", "End "};

/// A number of an .asc, and nothing where it is none or above `most`.
std::optional<std::uint32_t> parse_number(std::string_view text, bool decimal, std::uint32_t most) {
  std::uint64_t value = 0;
  if (text.empty() || text.size() > 10) return std::nullopt;
  for (const char c : text) {
    const int one = decimal ? digit(c) : hex_digit(c);
    if (one < 0) return std::nullopt;
    value = value * (decimal ? 10 : 16) + static_cast<std::uint64_t>(one);
  }
  return value <= most ? std::optional(static_cast<std::uint32_t>(value)) : std::nullopt;
}

/// "seconds channel id[x] Rx d length bytes"; CAN FD, errors and events are counted alone.
std::variant<LogLine, BadLine> parse_asc(std::string_view text, bool decimal) {
  LogLine line{.clock = LogLine::Clock::kRelative};
  for (const std::string_view heading : kHeadings)
    if (text.starts_with(heading)) return line.kind = LogLine::Kind::kHeading, line;
  if (text.starts_with("base hex") || text.starts_with("base dec")) {
    line.base = {.decimal = text.starts_with("base dec"), .differences = text.find(" relative") != text.npos};
    return line.kind = LogLine::Kind::kHeading, line;
  }
  Cursor in(text);
  const auto is_digit = [](char c) { return digit(c) >= 0; };
  const auto is_word = [](char c) { return !blank(c); };
  const std::string_view whole = in.take(is_digit);
  if (whole.empty() || !in.eat('.')) return BadLine{kForm};
  const auto time = parse_time(whole, in.take(is_digit));
  if (!time || !in.eat_blanks()) return BadLine{kForm};
  line.time = *time;
  line.interface = in.take(is_word);
  if (line.interface == "CANFD") return line.kind = LogLine::Kind::kFd, line;
  for (const std::string_view event : {"Start", "SV:", "CAN"})
    if (line.interface == event) return line.kind = LogLine::Kind::kHeading, line;
  if (line.interface.empty() || digit(line.interface.front()) < 0) return BadLine{kForm};
  in.eat_blanks();
  std::string_view id = in.take(is_word);
  if (id == "ErrorFrame") return line.kind = LogLine::Kind::kError, line;
  if (id == "Statistic:") return line.kind = LogLine::Kind::kHeading, line;
  line.frame.extended = id.ends_with('x');
  if (line.frame.extended) id.remove_suffix(1);
  const auto number = parse_number(id, decimal, line.frame.extended ? 0x1FFFFFFFU : 0x7FFU);
  if (!number) return BadLine{"no such id: extended ones end with x"};
  line.frame.id = *number;
  in.eat_blanks();
  const std::string_view direction = in.take(is_word);
  if (direction != "Rx" && direction != "Tx" && direction != "TxRq") return BadLine{"Rx or Tx is missing after the id"};
  in.eat_blanks();
  if (in.eat('r')) return line.kind = LogLine::Kind::kRemote, line;
  if (!in.eat('d') || !in.eat_blanks()) return BadLine{"d or r is missing after the direction"};
  const auto code = parse_number(in.take(is_word), decimal, 15);
  if (!code) return BadLine{"the length is 0 to 15"};
  line.frame.size = static_cast<std::uint8_t>(*code < 8 ? *code : 8);
  for (std::size_t i = 0; i < line.frame.size; ++i) {
    in.eat_blanks();
    const auto byte = parse_number(in.take(is_word), decimal, 0xFF);
    if (!byte) return BadLine{"fewer data bytes than the line announces"};
    line.frame.data[i] = static_cast<std::uint8_t>(*byte);
  }
  if (in.eat_blanks() || in.empty()) return line;  // Length = ..., BitCount = ... may follow
  return BadLine{"unexpected text after the data"};
}

}  // namespace

std::variant<LogLine, BadLine> parse_log_line(std::string_view text, bool decimal) {
  if (!text.empty() && text.back() == '\r') text.remove_suffix(1);
  Cursor in(text);
  LogLine line;
  const auto is_digit = [](char c) { return digit(c) >= 0; };
  const auto is_hex = [](char c) { return hex_digit(c) >= 0; };
  in.eat_blanks();
  if (!in.eat('(')) return parse_asc(in.rest(), decimal);
  const auto date = calendar_seconds(in.rest());  // candump -t A
  const std::string_view whole = date ? in.take_first(kDateAndTime) : in.take(is_digit);
  if (!in.eat('.')) return BadLine{"the time is not (seconds.micros)"};
  const std::string_view part = in.take(is_digit);
  if (!in.eat(')')) return BadLine{"the time is not (seconds.micros)"};
  const auto time = parse_time(date ? "0" : whole, part);
  if (!time) return BadLine{"the time is not (seconds.micros)"};
  line.time = *time + base::Micros{date.value_or(0) * 1'000'000};
  if (!in.eat_blanks()) return BadLine{"no space after the time"};
  line.interface = in.take([](char c) { return !blank(c) && c != '#'; });
  if (line.interface.empty() || line.interface.size() > kLongestInterface)
    return BadLine{"no name of an interface after the time"};
  if (!in.eat_blanks()) return BadLine{"no space after the interface"};
  if (in.eat_word("RX ") || in.eat_word("TX ")) {  // candump -x: direction, then two flags
    for (int flag = 0; flag < 2; ++flag) in.eat_blanks(), in.take([](char c) { return !blank(c); });
    in.eat_blanks();
  }
  const std::string_view id = in.take(is_hex);
  if (const auto reason = parse_id(id, in.rest().starts_with("###"), line); !reason.empty()) return BadLine{reason};
  const bool listed = in.eat_blanks();
  if (listed) line.clock = whole.size() < kCalendarDigits ? LogLine::Clock::kRelative : LogLine::Clock::kCalendar;
  if (!listed && !in.eat('#')) return BadLine{"no '#' after the id"};
  if (const auto reason = listed ? parse_listed(in, line) : parse_payload(in, line); !reason.empty())
    return BadLine{reason};
  if (in.eat_blanks() && !in.empty()) {
    if (!in.eat('R') && !in.eat('T')) return BadLine{"unexpected text after the data"};
    in.eat_blanks();
  }
  if (!in.empty()) return BadLine{"unexpected text after the data"};
  return line;
}

void append_log_line(Line& out, base::Micros time, std::string_view interface, const base::CanFrame& frame) {
  out.put('(')
      .integer(time.us / 1'000'000, 10)
      .put('.')
      .integer(time.us % 1'000'000, 6)
      .text(") ")
      .text(interface)
      .put(' ');
  out.hex(frame.id, frame.extended ? 8 : 3).put('#');
  for (std::size_t i = 0; i < frame.size && i < frame.data.size(); ++i) out.hex(frame.data[i], 2);
  out.put('\n');
}

}  // namespace tetap::sim
