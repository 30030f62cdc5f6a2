// SPDX-License-Identifier: Apache-2.0
// The elementary functions over inputs of every kind, as one hash each: equal hashes mean that two machines compute the
// same bits.
#pragma once

#include "tetap/base/math.hpp"
#include "tetap/base/math_double.hpp"
#include "tetap/base/random.hpp"

#include <bit>
#include <cstdint>

namespace tetap::base {

/// The mixing steps of MurmurHash3 (A. Appleby, 2011, public domain) over 32-bit words. Each step is a bijection of the
/// state, so one word that differs always changes the hash. It is cheaper than a CRC, which matters for 2^24 values on
/// an emulated core.
class WordHash {
 public:
  constexpr void operator()(std::uint32_t word) {
    word = std::rotl(word * 0xCC9E2D51U, 15) * 0x1B873593U;
    state_ = std::rotl(state_ ^ word, 13) * 5U + 0xE6546B64U;
  }
  constexpr void operator()(std::int32_t word) { (*this)(static_cast<std::uint32_t>(word)); }
  constexpr void operator()(float number) { (*this)(bits(number)); }
  constexpr void operator()(std::uint64_t word) {
    (*this)(static_cast<std::uint32_t>(word));
    (*this)(static_cast<std::uint32_t>(word >> 32));
  }
  constexpr void operator()(std::int64_t word) { (*this)(static_cast<std::uint64_t>(word)); }
  constexpr void operator()(double number) { (*this)(std::bit_cast<std::uint64_t>(number)); }
  [[nodiscard]] constexpr std::uint32_t value() const { return state_; }

 private:
  std::uint32_t state_ = 0;
};

/// f(hash, x) for n floats. Multiples of an odd number modulo 2^32 (here 2^32 over the golden ratio) are all different.
/// They lie evenly over the encodings: subnormals, infinities' neighbours and NaNs of both kinds have their share.
template <class F>
[[nodiscard]] constexpr std::uint32_t hash_of_floats(std::uint32_t n, F&& f) {
  WordHash hash;
  for (std::uint32_t i = 0; i < n; ++i) f(hash, from_bits(i * 0x9E3779B9U));
  return hash.value();
}

/// f(hash, y, x). Two arbitrary encodings are seldom of one size; every other pair has exponents at most 7 apart.
template <class F>
[[nodiscard]] constexpr std::uint32_t hash_of_pairs(std::uint32_t n, F&& f) {
  constexpr std::uint32_t kHighExponent = 0x7C00'0000U;
  WordHash hash;
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint32_t y = i * 0x9E3779B9U;
    const std::uint32_t other = i * 0x85EBCA6BU + 0x27D4EB2FU;
    f(hash, from_bits(y), from_bits(i % 2 == 0 ? other : (other & ~kHighExponent) | (y & kHighExponent)));
  }
  return hash.value();
}

/// The same for double, all encodings of 64 bits.
template <class F>
[[nodiscard]] constexpr std::uint32_t hash_of_doubles(std::uint32_t n, F&& f) {
  WordHash hash;
  for (std::uint32_t i = 0; i < n; ++i) f(hash, std::bit_cast<double>(i * std::uint64_t{0x9E37'79B9'7F4A'7C15U}));
  return hash.value();
}

/// report(name, hash) for every function of base/math.hpp on n inputs, and for n draws of the random generator.
/// Functions in double, which a core may compute in software, get n/64 inputs.
template <class Report>
void check_functions(std::uint32_t n, Report&& report) {
  report("sin", hash_of_floats(n, [](WordHash& h, float x) { h(sin(x)); }));
  report("cos", hash_of_floats(n, [](WordHash& h, float x) { h(cos(x)); }));
  report("sincos", hash_of_floats(n, [](WordHash& h, float x) {
           const SinCos both = sincos(x);
           h(both.sin);
           h(both.cos);
         }));
  report("atan2", hash_of_pairs(n, [](WordHash& h, float y, float x) { h(atan2(y, x)); }));
  report("exp", hash_of_floats(n, [](WordHash& h, float x) { h(exp(x)); }));
  report("log", hash_of_floats(n, [](WordHash& h, float x) { h(log(x)); }));
  report("sqrt", hash_of_floats(n, [](WordHash& h, float x) { h(sqrt(x)); }));
  report("wrap_angle", hash_of_floats(n, [](WordHash& h, float x) { h(wrap_angle(x)); }));

  Random random{2026};
  const auto draw = [&](auto&& one) {
    WordHash hash;
    for (std::uint32_t i = 0; i < n; ++i) hash(one());
    return hash.value();
  };
  report("random_words", draw([&] { return random.next(); }));
  report("random_uniform", draw([&] { return random.uniform(); }));
  report("random_normal", draw([&] { return random.normal(); }));

  const std::uint32_t few = n / 64;
  report("sincos_double", hash_of_doubles(few, [](WordHash& h, double x) {
           const SinCosDouble both = sincos(x);
           h(both.sin);
           h(both.cos);
         }));
  report("atan2_double", hash_of_doubles(few, [](WordHash& h, double y) {
           const auto u = std::bit_cast<std::uint64_t>(y);  // the other one: its fraction stirred, its exponent near
           h(atan2(y, std::bit_cast<double>(u ^ (u << 31 & 0x80FF'FFFF'FFFF'FFFFU))));
         }));
  report("exp_double", hash_of_doubles(few, [](WordHash& h, double x) { h(exp(x)); }));
  report("log_double", hash_of_doubles(few, [](WordHash& h, double x) { h(log(x)); }));
  report("sqrt_double", hash_of_doubles(few, [](WordHash& h, double x) { h(sqrt(x)); }));
}

}  // namespace tetap::base
