// SPDX-License-Identifier: Apache-2.0
// A JSON text as it is written.
#pragma once

#include "sim_host/replay/line.hpp"

#include <charconv>
#include <concepts>
#include <cstdio>
#include <string>
#include <string_view>

namespace tetap::page {

class Json {
 public:
  Json& begin(char bracket) {
    separate();
    text_ += bracket;
    first_ = true;
    return *this;
  }
  Json& end(char bracket) {
    text_ += bracket;
    first_ = false;
    return *this;
  }
  Json& key(std::string_view name) {
    separate();
    text_ += sim::quoted(name) + ':';
    first_ = true;
    return *this;
  }
  Json& value(std::string_view text) { return put(sim::quoted(text)); }
  Json& value(const char* text) { return value(std::string_view(text)); }
  template <std::same_as<bool> B>
  Json& value(B yes) {
    return put(yes ? "true" : "false");
  }
  template <std::integral N>
  requires(!std::same_as<N, bool>) Json& value(N number) { return put(std::to_string(number)); }
  Json& nothing() { return put("null"); }
  /// Reads back as the same bits.
  Json& value(double number) {
    char digits[32];
    std::snprintf(digits, sizeof digits, "%.17g", number);
    return put(digits);
  }
  template <class T>
  Json& member(std::string_view name, const T& of) {
    return key(name).value(of);
  }

  [[nodiscard]] const std::string& text() const { return text_; }

 private:
  Json& put(std::string_view text) {
    separate();
    text_ += text;
    return *this;
  }
  void separate() {
    if (!first_) text_ += ',';
    first_ = false;
  }

  std::string text_;
  bool first_ = true;
};

}  // namespace tetap::page
