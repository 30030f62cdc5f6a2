// SPDX-License-Identifier: Apache-2.0
// A constant that the environment may scale: tools/proof/run_mutants writes these into a copy of the sources.
// TETAP_MUTANT=NUMBER:FACTOR names the constant. TETAP_MUTANT_REACHED=FILE: the file is made when the program uses it.
#pragma once

#include <cstdio>
#include <cstdlib>
#include <type_traits>

namespace tetap::mutants {

struct Choice {
  long number = -1;
  double factor = 1;
  const char* reached = nullptr;
};

inline const Choice& choice() {
  static const Choice chosen = [] {
    Choice c;
    const char* const text = std::getenv("TETAP_MUTANT");
    if (text == nullptr) return c;
    char* end = nullptr;
    c.number = std::strtol(text, &end, 10);
    c.factor = *end == ':' ? std::strtod(end + 1, nullptr) : 1;
    c.reached = std::getenv("TETAP_MUTANT_REACHED");
    return c;
  }();
  return chosen;
}

/// The value in use; never a constant expression.
template <long kNumber, class T>
[[nodiscard]] T scaled(T value) {
  const Choice& chosen = choice();
  if (chosen.number != kNumber) return value;
  static const bool noted = [&chosen] {
    std::FILE* const file = chosen.reached != nullptr ? std::fopen(chosen.reached, "w") : nullptr;
    return file != nullptr && std::fclose(file) == 0;
  }();
  static_cast<void>(noted);
  return static_cast<T>(static_cast<double>(value) * chosen.factor);
}

/// The same in a function that is a constant expression elsewhere: there the value is the original.
template <long kNumber, class T>
[[nodiscard]] constexpr T scaled_at_run_time(T value) {
  return std::is_constant_evaluated() ? value : scaled<kNumber>(value);
}

}  // namespace tetap::mutants
