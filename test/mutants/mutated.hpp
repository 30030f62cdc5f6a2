// SPDX-License-Identifier: Apache-2.0
// A constant that the environment may scale: tools/proof/run_mutants writes these into a copy of the sources.
// TETAP_MUTANT=NUMBER:FACTOR names the constant. TETAP_MUTANT_READ=FILE: at its end the program writes the numbers of
// the constants that it read.
#pragma once

#include <bitset>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <type_traits>

namespace tetap::mutants {

struct Choice {
  long number = -1;
  double factor = 1;
};

inline const Choice& choice() {
  static const Choice chosen = [] {
    Choice c;
    const char* const text = std::getenv("TETAP_MUTANT");
    if (text == nullptr) return c;
    char* end = nullptr;
    c.number = std::strtol(text, &end, 10);
    c.factor = *end == ':' ? std::strtod(end + 1, nullptr) : 1;
    return c;
  }();
  return chosen;
}

/// Numbers of the constants that the program read, written to TETAP_MUTANT_READ at its end.
struct ReadConstants {
  std::bitset<1024> numbers;

  ReadConstants() = default;
  ReadConstants(const ReadConstants&) = delete;
  ReadConstants& operator=(const ReadConstants&) = delete;
  ~ReadConstants() {
    const char* const name = std::getenv("TETAP_MUTANT_READ");
    std::FILE* const file = name != nullptr ? std::fopen(name, "w") : nullptr;
    if (file == nullptr) return;
    for (std::size_t number = 0; number < numbers.size(); ++number) {
      if (numbers[number]) std::fprintf(file, "%zu\n", number);
    }
    std::fclose(file);
  }
};

inline ReadConstants& read_constants() {
  static ReadConstants read;
  return read;
}

/// The value in use; never a constant expression.
template <long kNumber, class T>
[[nodiscard]] T scaled(T value) {
  static_assert(kNumber < 1024, "ReadConstants has no room for the number");
  read_constants().numbers[static_cast<std::size_t>(kNumber)] = true;
  const Choice& chosen = choice();
  return chosen.number == kNumber ? static_cast<T>(static_cast<double>(value) * chosen.factor) : value;
}

/// The same in a function that is a constant expression elsewhere: there the value is the original.
template <long kNumber, class T>
[[nodiscard]] constexpr T scaled_at_run_time(T value) {
  return std::is_constant_evaluated() ? value : scaled<kNumber>(value);
}

}  // namespace tetap::mutants
