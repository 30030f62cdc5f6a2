// SPDX-License-Identifier: Apache-2.0
// Command lines of the host programs: --name VALUE, --flag and plain words; anything else is one clear error.
#pragma once

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <initializer_list>
#include <map>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace tetap::sim {

class Options {
 public:
  /// Prints `help` and leaves with status 0 on --help. Throws std::runtime_error on what is not known or lacks its
  /// value.
  Options(int argc, char** argv, std::initializer_list<std::string_view> valued,
          std::initializer_list<std::string_view> flags, const char* help) {
    for (int i = 1; i < argc; ++i) {
      const std::string_view word = argv[i];
      if (word == "--help" || word == "-h") {
        std::fputs(help, stdout);
        std::exit(0);
      }
      if (!word.starts_with("--")) {
        words_.emplace_back(word);
        continue;
      }
      const std::string name(word.substr(2));
      const auto is = [&name](std::initializer_list<std::string_view> names) {
        for (const std::string_view n : names)
          if (n == name) return true;
        return false;
      };
      if (is(flags)) {
        values_[name].emplace_back();
      } else if (!is(valued)) {
        throw std::runtime_error("unknown option --" + name + " (--help lists them)");
      } else if (i + 1 == argc) {
        throw std::runtime_error("--" + name + " needs a value");
      } else {
        values_[name].emplace_back(argv[++i]);
      }
    }
  }

  [[nodiscard]] bool has(const std::string& name) const { return values_.contains(name); }
  [[nodiscard]] std::string text(const std::string& name, const std::string& otherwise) const {
    return has(name) ? values_.at(name).back() : otherwise;
  }
  [[nodiscard]] std::vector<std::string> all(const std::string& name) const {
    return has(name) ? values_.at(name) : std::vector<std::string>{};
  }
  [[nodiscard]] const std::vector<std::string>& words() const { return words_; }
  [[nodiscard]] double number(const std::string& name, double otherwise) const {
    if (!has(name)) return otherwise;
    const std::string& value = values_.at(name).back();
    char* end = nullptr;
    const double parsed = std::strtod(value.c_str(), &end);
    if (value.empty() || *end != '\0') throw std::runtime_error("--" + name + " " + value + ": not a number");
    return parsed;
  }
  /// A node's id base: a multiple of 64 whose block is within 11 bits.
  [[nodiscard]] std::uint32_t base(const std::string& name = "base") const {
    const std::string value = text(name, "0x300");
    char* end = nullptr;
    const unsigned long parsed = std::strtoul(value.c_str(), &end, 0);
    if (value.empty() || *end != '\0' || parsed % 64 != 0 || parsed > 0x7C0)
      throw std::runtime_error("--" + name + " " + value + ": must be a multiple of 0x40 up to 0x7C0");
    return static_cast<std::uint32_t>(parsed);
  }

 private:
  std::map<std::string, std::vector<std::string>> values_;
  std::vector<std::string> words_;
};

}  // namespace tetap::sim
