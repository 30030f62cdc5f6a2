// SPDX-License-Identifier: Apache-2.0
// Every function of base/math.hpp on every float, and atan2 on 10^9 pairs, against the C library in double (its error:
// 2^-29 of our ulp). Prints one line per function: how many inputs, the largest error in ulp, where, the limit. Exit
// status 1 when a limit is exceeded.
#include "support/samples.hpp"
#include "support/ulp.hpp"
#include "tetap/base/math.hpp"

#include <algorithm>
#include <atomic>
#include <charconv>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

namespace tetap {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();
constexpr std::uint64_t kPositives = std::uint64_t{1} << 31;  // encodings without sign, NaNs with them
constexpr std::uint64_t kNear = base::bits(4096.0F) + 1;      // the encodings of 0 to 4096

struct Options {
  std::string functions = "sin,cos,exp,log,sqrt,wrap_angle,atan2";
  std::uint64_t pairs = 1'000'000'000;
  unsigned threads = 2;
  std::uint64_t stride = 1;  ///< every how many-th input is taken
};

/// The error at input number i, for an input and its negative both.
using Check = double (*)(std::uint64_t i);

float positive(std::uint64_t i) { return base::from_bits(static_cast<std::uint32_t>(i)); }
bool same(float a, float b) { return base::bits(a) == base::bits(b); }
float negated(float x) { return base::is_nan(x) ? x : base::from_bits(base::bits(x) ^ base::kSignBit); }

double sin_error(std::uint64_t i) {
  const float x = positive(i);
  const float y = base::sin(x);
  if (!same(base::sin(negated(x)), negated(y)) || !same(base::sincos(x).sin, y) || std::abs(y) > 1.0F) return kNever;
  return test::ulp_error(y, std::sin(static_cast<double>(x)));
}
double cos_error(std::uint64_t i) {
  const float x = positive(i);
  const float y = base::cos(x);
  if (!same(base::cos(negated(x)), y) || !same(base::sincos(x).cos, y) || std::abs(y) > 1.0F) return kNever;
  return test::ulp_error(y, std::cos(static_cast<double>(x)));
}
template <float (*ours)(float), double (*judge)(double)>
double error_of_both_signs(std::uint64_t i) {
  const float x = positive(i);
  const float minus = base::from_bits(base::bits(x) ^ base::kSignBit);
  return std::max(test::ulp_error(ours(x), judge(static_cast<double>(x))),
                  test::ulp_error(ours(minus), judge(static_cast<double>(minus))));
}
double sqrt_error(std::uint64_t i) {  // both ways to it have to be correctly rounded; a root in double rounds to float
                                      // like the exact one
  const float x = positive(i);
  const auto truth = static_cast<float>(std::sqrt(static_cast<double>(x)));
  const float y = base::sqrt(x);
  if (base::is_nan(x) ? !same(y, base::kNan) : !same(y, truth)) return kNever;
  if (i != 0 && i < base::kInfinityBits && !same(base::detail::sqrt_by_integers(base::bits(x)), truth)) return kNever;
  if (!same(base::sqrt(base::from_bits(base::bits(x) ^ base::kSignBit)), i == 0 ? -0.0F : base::kNan)) return kNever;
  return 0.0;
}
double wrap_error(std::uint64_t i) {
  constexpr double kPi = 0x1.921fb54442d18p+1;
  const float x = positive(i);
  const float y = base::wrap_angle(x);
  if (!base::is_finite(x)) return same(y, base::kNan) && same(base::wrap_angle(negated(x)), base::kNan) ? 0.0 : kNever;
  if (!(y > -base::kPi && y <= base::kPi) || !same(base::wrap_angle(y), y)) return kNever;
  if (!same(base::wrap_angle(negated(x)), same(y, base::kPi) ? y : negated(y))) return kNever;
  if (x < base::kPi) return same(x, y) ? 0.0 : kNever;
  double truth = std::atan2(std::sin(static_cast<double>(x)), std::cos(static_cast<double>(x)));
  if (std::abs(static_cast<double>(y) - truth) > kPi)
    truth = std::copysign(2.0 * kPi - std::abs(truth), static_cast<double>(y));
  return test::ulp_error(y, truth);
}
double atan2_error(std::uint64_t i) {
  const test::Pair p = test::atan2_pair(i);
  return test::ulp_error(base::atan2(p.y, p.x), std::atan2(static_cast<double>(p.y), static_cast<double>(p.x)));
}

struct Row {
  const char* function;
  const char* range;
  Check check;
  std::uint64_t first, end;
  unsigned inputs_each;  ///< how many inputs one index stands for
  double limit;
};

test::Worst<std::uint64_t> run(const Row& row, const Options& options) {
  constexpr std::uint64_t kPart = std::uint64_t{1} << 20;
  std::atomic<std::uint64_t> next{row.first};
  std::vector<test::Worst<std::uint64_t>> found(options.threads);
  const auto work = [&](test::Worst<std::uint64_t>& worst) {
    for (std::uint64_t from = next.fetch_add(kPart); from < row.end; from = next.fetch_add(kPart)) {
      const std::uint64_t to = std::min(from + kPart, row.end);
      for (std::uint64_t i = from; i < to; i += options.stride) worst.add(row.check(i), i);
    }
  };
  std::vector<std::thread> threads;
  for (auto& worst : found) threads.emplace_back(work, std::ref(worst));
  for (auto& thread : threads) thread.join();
  test::Worst<std::uint64_t> all;
  for (const auto& worst : found) {
    if (worst.ulp > all.ulp || (worst.count != 0 && !(worst.ulp < all.ulp) && worst.where < all.where))
      all.ulp = worst.ulp, all.where = worst.where;
    all.count += worst.count;
  }
  return all;
}

bool wanted(const Options& options, std::string_view function) {
  return ("," + options.functions + ",").find("," + std::string(function) + ",") != std::string::npos;
}

int report(const Options& options) {
  const std::vector<Row> rows{
      {"sin", "|x| <= 4096", sin_error, 0, kNear, 2, 1.5},
      {"sin", "beyond, inf, NaN", sin_error, kNear, kPositives, 2, 1.5},
      {"cos", "|x| <= 4096", cos_error, 0, kNear, 2, 1.5},
      {"cos", "beyond, inf, NaN", cos_error, kNear, kPositives, 2, 1.5},
      {"exp", "every float", error_of_both_signs<base::exp, std::exp>, 0, kPositives, 2, 1.5},
      {"log", "every float", error_of_both_signs<base::log, std::log>, 0, kPositives, 2, 1.5},
      {"sqrt", "every float", sqrt_error, 0, kPositives, 2, 0.0},
      {"wrap_angle", "every float", wrap_error, 0, kPositives, 2, 1.5},
      {"atan2", "pairs of ten kinds", atan2_error, 0, options.pairs, 1, 1.6},
  };
  std::printf("%-11s %-19s %13s %9s  %-38s %6s %7s\n", "function", "over", "inputs", "max ulp", "at", "limit", "s");
  bool good = true;
  for (const Row& row : rows) {
    if (!wanted(options, row.function)) continue;
    const auto start = std::chrono::steady_clock::now();
    const test::Worst<std::uint64_t> worst = run(row, options);
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
    char where[64];
    if (row.check == atan2_error) {
      const test::Pair p = test::atan2_pair(worst.where);
      std::snprintf(where, sizeof where, "%a, %a", static_cast<double>(p.y), static_cast<double>(p.x));
    } else {
      std::snprintf(where, sizeof where, "+-%a", static_cast<double>(positive(worst.where)));
    }
    const bool within = worst.count != 0 && worst.ulp <= row.limit;
    good = good && within;
    std::printf("%-11s %-19s %13llu %9.4f  %-38s %6.2f %7.1f%s\n", row.function, row.range,
                static_cast<unsigned long long>(worst.count * row.inputs_each), worst.ulp, where, row.limit,
                took.count(), within ? "" : "  EXCEEDED");
    std::fflush(stdout);
  }
  return good ? 0 : 1;
}

[[noreturn]] void refuse(std::string_view what, std::string_view argument) {
  std::fprintf(stderr,
               "math_exhaustive: %.*s: %.*s\nusage: math_exhaustive [--functions "
               "sin,cos,exp,log,sqrt,wrap_angle,atan2] [--pairs N] [--threads N] [--quick]\n",
               static_cast<int>(argument.size()), argument.data(), static_cast<int>(what.size()), what.data());
  std::exit(2);
}

std::uint64_t count_in(std::string_view name, std::string_view text, std::uint64_t most) {
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || value == 0 || value > most)
    refuse("not a count", name);
  return value;
}

Options parsed(const std::vector<std::string_view>& arguments) {
  Options options;
  const Options all;
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    const std::string_view name = arguments[i];
    if (name == "--quick") {  // about ten seconds: a prime, so that every fraction and every kind of pair has its share
      options.stride = 61;
      continue;
    }
    if (name != "--functions" && name != "--pairs" && name != "--threads") refuse("unknown option", name);
    if (++i == arguments.size()) refuse("a value is missing", name);
    if (name == "--pairs") options.pairs = count_in(name, arguments[i], ~std::uint64_t{0} >> 8);
    if (name == "--threads") options.threads = static_cast<unsigned>(count_in(name, arguments[i], 256));
    if (name != "--functions") continue;
    options.functions = arguments[i];
    for (std::size_t from = 0; from <= options.functions.size();) {
      const std::size_t to = std::min(options.functions.find(',', from), options.functions.size());
      const std::string one = options.functions.substr(from, to - from);
      if (one.empty() || !wanted(all, one)) refuse("unknown function", one);
      from = to + 1;
    }
  }
  return options;
}

}  // namespace
}  // namespace tetap

int main(int count, char** arguments) { return tetap::report(tetap::parsed({arguments + 1, arguments + count})); }
