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
  bool flag(std::string_view name) {
    for (std::size_t i = 0; i < left_.size(); ++i) {
      if (left_[i] != name) continue;
      left_.erase(left_.begin() + static_cast<std::ptrdiff_t>(i));
      return true;
    }
    return false;
  }
  /// The text after `--name`, or of `--name=text`.
  std::optional<std::string> text(std::string_view name) {
    for (std::size_t i = 0; i < left_.size(); ++i) {
      const auto at = left_.begin() + static_cast<std::ptrdiff_t>(i);
      if (left_[i].size() > name.size() && left_[i].starts_with(name) && left_[i][name.size()] == '=') {
        std::string value = left_[i].substr(name.size() + 1);
        left_.erase(at);
        return value;
      }
      if (left_[i] != name) continue;
      if (i + 1 == left_.size()) throw UsageError(std::string(name) + " needs a value");
      std::string value = left_[i + 1];
      left_.erase(at, at + 2);
      return value;
    }
    return std::nullopt;
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
    const bool hex = given->starts_with("0x") || given->starts_with("0X");
    const char* first = given->data() + (hex ? 2 : 0);
    const char* last = given->data() + given->size();
    std::uint64_t value = 0;
    const auto [end, error] = std::from_chars(first, last, value, hex ? 16 : 10);
    if (error != std::errc{} || end != last || first == last || value < low || value > high)
      throw UsageError(std::string(name) + " needs a whole number from " + std::to_string(low) + " to " +
                       std::to_string(high) + ", not '" + *given + "'");
    return value;
  }
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
  static std::string plain(double value) {
    std::string text(32, '\0');
    text.resize(
        static_cast<std::size_t>(std::to_chars(text.data(), text.data() + text.size(), value).ptr - text.data()));
    return text;
  }
  std::vector<std::string> left_;
};

/// A node's id base, for every program alike: its whole block within 11 bits.
[[nodiscard]] inline std::uint32_t base_argument(Arguments& arguments, std::string_view name = "--base",
                                                 std::uint32_t otherwise = 0x300) {
  return static_cast<std::uint32_t>(arguments.integer(name, otherwise, 0, 0x7C0));
}

}  // namespace tetap::sim
