// SPDX-License-Identifier: Apache-2.0
// A command line taken apart by asking for what is understood; what is left over is an error that names it.
#pragma once

#include <charconv>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace tetap::sim {

struct UsageError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

class Arguments {
 public:
  Arguments(int count, const char* const* values) {
    for (int i = 1; i < count; ++i) left_.emplace_back(values[i]);
  }
  explicit Arguments(std::vector<std::string> values) : left_(std::move(values)) {}

  /// True if `--name` is there.
  bool flag(std::string_view name) { return std::erase(left_, name) > 0; }
  /// The text after each `--name`, or of each `--name=text`.
  std::vector<std::string> texts(std::string_view name) {
    std::vector<std::string> values;
    for (std::size_t i = 0; i < left_.size();) {
      const auto at = left_.begin() + static_cast<std::ptrdiff_t>(i);
      if (left_[i].size() > name.size() && left_[i].starts_with(name) && left_[i][name.size()] == '=') {
        values.push_back(left_[i].substr(name.size() + 1));
        left_.erase(at);
      } else if (left_[i] == name) {
        if (i + 1 == left_.size()) throw UsageError(std::string(name) + " needs a value");
        values.push_back(left_[i + 1]);
        left_.erase(at, at + 2);
      } else {
        ++i;
      }
    }
    return values;
  }
  /// The last of them: what is appended to a command line overrides what a script put there.
  std::optional<std::string> text(std::string_view name) {
    auto values = texts(name);
    if (values.empty()) return std::nullopt;
    return std::move(values.back());
  }
  double real(std::string_view name, double otherwise, double low, double high) {
    const auto given = text(name);
    if (!given) return otherwise;
    double value = 0;
    const auto [end, error] = std::from_chars(given->data(), given->data() + given->size(), value);
    if (error != std::errc{} || end != given->data() + given->size() || !(value >= low && value <= high))
      throw UsageError(std::string(name) + " needs a number from " + plain(low) + " to " + plain(high) + ", not '" +
                       *given + "'");
    return value;
  }
  /// Decimal, or hexadecimal after 0x.
  std::uint64_t integer(std::string_view name, std::uint64_t otherwise, std::uint64_t low, std::uint64_t high) {
    const auto given = text(name);
    if (!given) return otherwise;
    const auto value = whole(*given);
    if (!value || *value < low || *value > high)
      throw UsageError(std::string(name) + " needs a whole number from " + std::to_string(low) + " to " +
                       std::to_string(high) + ", not '" + *given + "'");
    return *value;
  }
  /// A node's id base: its block of 64 on its grid and within 11 bits.
  std::uint32_t base(std::string_view name = "--base", std::uint32_t otherwise = 0x300) {
    const auto given = text(name);
    if (!given) return otherwise;
    const auto value = whole(*given);
    if (!value || *value % 0x40 != 0 || *value > 0x7C0)
      throw UsageError(std::string(name) + " needs a multiple of 0x40 up to 0x7C0, not '" + *given + "'");
    return static_cast<std::uint32_t>(*value);
  }
  /// Ticks in flight in lockstep.
  std::size_t window() { return static_cast<std::size_t>(integer("--window", 8, 1, 128)); }
  /// The next argument that is no option. Ask for it after all options.
  std::optional<std::string> positional() {
    for (std::size_t i = 0; i < left_.size(); ++i) {
      if (left_[i].starts_with("-") && left_[i].size() > 1) continue;
      std::string value = left_[i];
      left_.erase(left_.begin() + static_cast<std::ptrdiff_t>(i));
      return value;
    }
    return std::nullopt;
  }
  /// Throws UsageError if anything was not asked for.
  void finish() const {
    if (left_.empty()) return;
    throw UsageError((left_.front().starts_with("-") ? "unknown option " : "one argument too many: ") + left_.front() +
                     " (--help lists them)");
  }

 private:
  static std::optional<std::uint64_t> whole(const std::string& text) {
    const bool hex = text.starts_with("0x") || text.starts_with("0X");
    const char* first = text.data() + (hex ? 2 : 0);
    const char* last = text.data() + text.size();
    std::uint64_t value = 0;
    const auto [end, error] = std::from_chars(first, last, value, hex ? 16 : 10);
    if (error != std::errc{} || end != last) return std::nullopt;
    return value;
  }
  static std::string plain(double value) {
    std::string text(32, '\0');
    text.resize(
        static_cast<std::size_t>(std::to_chars(text.data(), text.data() + text.size(), value).ptr - text.data()));
    return text;
  }
  std::vector<std::string> left_;
};

}  // namespace tetap::sim
