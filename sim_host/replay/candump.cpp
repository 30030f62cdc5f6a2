// SPDX-License-Identifier: Apache-2.0
#include "sim_host/replay/candump.hpp"

#include <array>
#include <cstdint>
#include <optional>

namespace tetap::sim {

namespace {

constexpr std::uint32_t kErrorFlag = 0x20000000;  ///< candump writes error frames as 8-digit ids with this bit

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

  [[nodiscard]] bool empty() const { return text_.empty(); }
  [[nodiscard]] char front() const { return text_.empty() ? '\0' : text_.front(); }
  bool eat(char c) {
    if (front() != c || text_.empty()) return false;
    text_.remove_prefix(1);
    return true;
  }
  bool eat_blanks() {
    const std::size_t before = text_.size();
    while (!text_.empty() && blank(text_.front())) text_.remove_prefix(1);
    return text_.size() != before;
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

std::string_view parse_id(std::string_view text, LogLine& line) {
  std::uint32_t id = 0;
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
  } else {
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

bool is_fd_size(std::uint8_t n) {
  return n <= 8 || n == 12 || n == 16 || n == 20 || n == 24 || n == 32 || n == 48 || n == 64;
}

std::string_view parse_payload(Cursor& in, LogLine& line) {
  if (in.eat('#')) {
    if (hex_digit(in.front()) < 0) return "CAN FD needs a digit of flags after ##";
    line.fd_flags = static_cast<std::uint8_t>(hex_digit(in.take([n = 0](char) mutable { return n++ == 0; })[0]));
    line.kind = LogLine::Kind::kFd;
    if (const auto reason = parse_bytes(in, 64, line.frame); !reason.empty()) return reason;
    return is_fd_size(line.frame.size) ? "" : "no CAN FD frame has this many data bytes";
  }
  if (in.eat('R') || in.eat('r')) {
    line.kind = LogLine::Kind::kRemote;
    const std::string_view length = in.take([](char c) { return digit(c) >= 0; });
    if (length.size() > 1 || (length.size() == 1 && length[0] > '8')) return "a remote frame's length is 0 to 8";
    line.frame.size = length.empty() ? std::uint8_t{0} : static_cast<std::uint8_t>(digit(length[0]));
    return {};
  }
  if (const auto reason = parse_bytes(in, 8, line.frame); !reason.empty()) return reason;
  if (in.eat('_')) {  // a raw length code above 8
    const std::string_view code = in.take([](char c) { return hex_digit(c) >= 0; });
    if (code.size() != 1 || hex_digit(code[0]) < 9 || line.frame.size != 8)
      return "a raw length code is 9 to F, after 8 bytes";
  }
  return {};
}

}  // namespace

std::variant<LogLine, BadLine> parse_log_line(std::string_view text) {
  if (!text.empty() && text.back() == '\r') text.remove_suffix(1);
  Cursor in(text);
  LogLine line;
  const auto is_digit = [](char c) { return digit(c) >= 0; };
  in.eat_blanks();
  if (!in.eat('(')) return BadLine{"expected '(seconds.micros) interface id#data'"};
  const std::string_view whole = in.take(is_digit);
  if (!in.eat('.')) return BadLine{"the time is not (seconds.micros)"};
  const std::string_view part = in.take(is_digit);
  if (!in.eat(')')) return BadLine{"the time is not (seconds.micros)"};
  const auto time = parse_time(whole, part);
  if (!time) return BadLine{"the time is not (seconds.micros)"};
  line.time = *time;
  if (!in.eat_blanks()) return BadLine{"no space after the time"};
  line.interface = in.take([](char c) { return !blank(c) && c != '#'; });
  if (line.interface.empty() || line.interface.size() > 15) return BadLine{"no name of an interface after the time"};
  if (!in.eat_blanks()) return BadLine{"no space after the interface"};
  if (const auto reason = parse_id(in.take([](char c) { return hex_digit(c) >= 0; }), line); !reason.empty())
    return BadLine{reason};
  if (!in.eat('#')) return BadLine{"no '#' after the id"};
  if (const auto reason = parse_payload(in, line); !reason.empty()) return BadLine{reason};
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
