// SPDX-License-Identifier: Apache-2.0
// Inputs for tests of the elementary functions: a function of an index, so that any one can be repeated and threads can
// share them out. The generator is not the one of src/tetap/base, which is under test too: SplitMix64 (Steele, Lea,
// Flood, OOPSLA 2014).
#pragma once

#include <array>
#include <bit>
#include <cstdint>

namespace tetap::test {

[[nodiscard]] constexpr std::uint64_t mixed(std::uint64_t index) {
  std::uint64_t z = (index + 1) * 0x9E37'79B9'7F4A'7C15U;
  z = (z ^ (z >> 30)) * 0xBF58'476D'1CE4'E5B9U;
  z = (z ^ (z >> 27)) * 0x94D0'49BB'1331'11EBU;
  return z ^ (z >> 31);
}

/// Uniform in [0, 1).
[[nodiscard]] constexpr double fraction_of(std::uint64_t word) { return static_cast<double>(word >> 11) * 0x1p-53; }

struct Pair {
  float y = 0, x = 0;
};

/// Pair number `index` for atan2: one of ten kinds in turn, each aimed at a place where a method may fail.
[[nodiscard]] constexpr Pair atan2_pair(std::uint64_t index) {
  const std::uint64_t words = mixed(index);
  const std::uint64_t more = mixed(~index);
  const auto a = static_cast<std::uint32_t>(words);
  const auto b = static_cast<std::uint32_t>(words >> 32);
  const auto below = [more](int n) { return static_cast<int>((more >> 40) % static_cast<unsigned>(n)); };
  const auto number = [](std::uint32_t noise,
                         int exponent) {  // sign and fraction of the noise, this exponent; subnormal below 1
    const int limited = exponent < 0 ? 0 : exponent > 254 ? 254 : exponent;
    return std::bit_cast<float>((noise & 0x807f'ffffU) | static_cast<std::uint32_t>(limited) << 23);
  };
  const auto biased = static_cast<int>(a >> 23 & 0xffU) % 255;
  const bool flip = (more & 1U) != 0;
  const auto either = [flip](float one, float two) { return flip ? Pair{one, two} : Pair{two, one}; };
  switch (index % 10) {
    case 0:
      return {std::bit_cast<float>(a), std::bit_cast<float>(b)};  // any two encodings, NaN and infinity with them
    case 1:
      return {number(a, biased), number(b, biased + below(5) - 2)};  // of one size
    case 2:
      return either(number(a, biased),
                    number(b, biased - 9 - below(9)));  // quotients around 2^-13, where methods change
    case 3: {                                           // results that end among the subnormals, or just above
      const int low = 1 + biased % 100;
      return {number(b, low), number(a, low + 122 + below(32))};
    }
    case 4:
      return either(number(a, 0), number(b, flip ? below(3) : below(30)));  // subnormal operands
    case 5:                                                                 // points in a room
      return {static_cast<float>(200.0 * fraction_of(words) - 100.0),
              static_cast<float>(200.0 * fraction_of(more) - 100.0)};
    case 6:  // points of a grid
      return {static_cast<float>(static_cast<int>(a % 4097U) - 2048),
              static_cast<float>(static_cast<int>(b % 4097U) - 2048)};
    case 7: {  // a few places beside the diagonals
      const float y = number(a, 1 + biased % 253);
      const std::uint32_t beside = std::bit_cast<std::uint32_t>(y) + static_cast<std::uint32_t>(below(33)) - 16U;
      return {y, std::bit_cast<float>(beside ^ (b & 0x8000'0000U))};
    }
    case 8:
      return either(number(a, biased),
                    number(b, biased - 18 - below(14)));  // a last place beside half and quarter turns
    default: {                                            // fractions of long runs of ones or zeros
      const std::uint32_t run_a = (0x007f'ffffU >> (a >> 8 & 23U)) ^ (a & 0x8000'0000U) ^ (flip ? 0x007f'ffffU : 0U);
      const std::uint32_t run_b = (0x007f'ffffU << (b >> 8 & 23U) & 0x007f'ffffU) ^ (b & 0x8000'0000U);
      return {number(run_a, biased), number(run_b, biased + below(25) - 12)};
    }
  }
}

/// NaNs quiet and signalling, of both signs, with payloads small and full.
inline constexpr std::array<float, 8> kNans = [] {
  std::array<float, 8> nans{};
  std::size_t i = 0;
  for (const std::uint32_t u :
       {0x7fc0'0000U, 0xffc0'0000U, 0x7fc0'0001U, 0xffff'ffffU, 0x7fff'ffffU, 0x7f80'0001U, 0xff80'0001U, 0x7fa5'a5a5U})
    nans[i++] = std::bit_cast<float>(u);
  return nans;
}();

}  // namespace tetap::test
