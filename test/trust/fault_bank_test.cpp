// SPDX-License-Identifier: Apache-2.0
// The bank beside a small filter: position, velocity and the bias of an accelerometer, with fixes and a speedometer.
#include "tetap/trust/fault_bank.hpp"

#include "tetap/filter/sparse_update.hpp"

#include <gtest/gtest.h>
#include <algorithm>
#include <cmath>
#include <random>

namespace tetap {
namespace {

using trust::FaultRow;

template <int kState>
struct Seen {
  static constexpr int kDimension = 1;
  static constexpr std::array<int, 1> kTouches{kState};
};
using Fix = Seen<0>;
using Speed = Seen<1>;

constexpr FaultRow kBias{.code = 0, .jumps = 2, .largest = 3};
constexpr FaultRow kFix{.code = 1, .largest = 20};
constexpr FaultRow kSpeed{.code = 2, .largest = 5};

struct Table {
  static constexpr int kErrors = 3;
  static constexpr std::array<FaultRow, 3> kRows{kBias, kFix, kSpeed};
  template <class Measurement>
  static constexpr trust::Shown shown_by() {
    return {std::is_same_v<Measurement, Fix> ? kFix.code : kSpeed.code, 1};
  }
  static void predict(const FaultRow&, std::array<float, 3>& phi, float dt_s) {
    phi[0] += dt_s * phi[1];
    phi[1] -= dt_s * phi[2];
  }
};
struct Permuted : Table {
  static constexpr std::array<FaultRow, 3> kRows{kSpeed, kBias, kFix};
};

/// The robot rests at 0; the filter does not know. Whatever the sensors show beside noise is the fault.
template <class T>
struct Bench {
  trust::FaultBank<T> bank;
  filter::Vector<float, 3> x = filter::Vector<float, 3>::Zero();
  filter::Symmetric<float, 3> p = filter::Symmetric<float, 3>::diagonal({1, 0.01F, 0.0025F});
  std::mt19937 random;
  float time_s = 0;
  explicit Bench(unsigned seed) : random(seed) {}

  float noise(float sigma) { return sigma * std::normal_distribution<float>()(random); }
  template <class Z>
  void fuse(const Z& z, float value, float sigma) {
    filter::SparseUpdate<float, 3, 1> result;
    filter::Matrix<float, 1, 1> h;
    h(0, 0) = 1;
    const filter::Vector<float, 1> nu{value - x(Z::kTouches[0])}, r{sigma * sigma};
    typename trust::FaultBank<T>::template Pass<1> pass(bank, z, h);
    filter::sparse_update<Z>(p, h, nu, r, 10.8F, result, pass);
    if (result.innovation.verdict == filter::Verdict::kAccepted) x += result.dx;
  }
  /// 0.1 s: the IMU, both measurements, and the judgement. `off`: what each device shows beside the truth.
  void step(const std::array<float, 3>& off) {
    constexpr float kStep_s = 0.1F;
    time_s += kStep_s;
    x(0) += kStep_s * x(1);
    x(1) += kStep_s * (off[0] + noise(0.3F) - x(2));
    filter::Matrix<float, 3, 3> f = filter::Matrix<float, 3, 3>::Identity();
    f(0, 1) = kStep_s, f(1, 2) = -kStep_s;
    p = filter::propagate(p, f, filter::Symmetric<float, 3>::diagonal({0, 0.0009F, 1e-8F}));
    bank.predict(kStep_s);
    fuse(Fix{}, off[1] + noise(0.5F), 0.5F);
    fuse(Speed{}, off[2] + noise(0.1F), 0.1F);
    bank.judge(kStep_s);
  }
  filter::Symmetric<float, 3> published() const {
    filter::Symmetric<float, 3> wide = p;
    bank.widen(wide);
    return wide;
  }
};

/// The rows' faults, some four gates large: bias, fix, speed.
constexpr std::array<std::array<float, 3>, 3> kFaults{{{1, 0, 0}, {0, 6, 0}, {0, 0, 1.2F}}};

/// A bias below every gate leads the filter astray. After two seconds what is published covers it, and the filter's
/// own P does not.
TEST(fault_bank, what_is_published_covers_a_fault_below_the_gates) {
  std::array<int, 4> own{}, published{};
  for (unsigned seed = 1; seed <= 50; ++seed) {
    Bench<Table> run(seed);
    while (run.time_s < 20) run.step({});
    for (std::size_t k = 0; k < 40; ++k) {
      run.step({0.6F, 0, 0});
      const auto beyond = [&run](const filter::Symmetric<float, 3>& p) {
        return std::abs(run.x(1)) > 3 * std::sqrt(p(1, 1)) ? 1 : 0;
      };
      own[k / 10] += beyond(run.p), published[k / 10] += beyond(run.published());
    }
  }
  for (const std::size_t second : {2U, 3U}) {
    EXPECT_GT(own[second], 300) << "of 500";
    EXPECT_LT(published[second], own[second] / 20);
  }
}

/// Six clean minutes of four seeds: a row is likely enough for the mixture only seldom, else P is the filter's own.
TEST(fault_bank, without_evidence_the_filter_s_own_p_is_published_to_the_bit) {
  int wider = 0, steps = 0;
  double ratio = 0;
  for (unsigned seed = 1; seed <= 4; ++seed) {
    Bench<Table> run(seed);
    for (int k = 0; k < 3'600; ++k, ++steps) {
      run.step({});
      const auto p = run.published();
      if (run.bank.suspects())
        ++wider;
      else
        ASSERT_EQ(p.packed(), run.p.packed());
      ratio += std::sqrt(static_cast<double>(p(1, 1) / run.p(1, 1)));
    }
  }
  EXPECT_LT(wider, steps / 10);
  EXPECT_LT(ratio / steps, 1.05);
}

TEST(fault_bank, a_permuted_table_gives_the_same_bits) {
  for (const auto& fault : kFaults) {
    Bench<Table> run(5);
    Bench<Permuted> other(5);
    for (int k = 0; k < 600; ++k) {
      const bool lasts = k > 200 && k < 400;
      const auto off = lasts ? fault : std::array<float, 3>{};
      run.step(off), other.step(off);
      ASSERT_EQ(run.bank.weight(0), other.bank.weight(1));
      ASSERT_EQ(run.published().packed(), other.published().packed());
      ASSERT_EQ(run.x, other.x);
      const trust::LikelyFault a = run.bank.likeliest(), b = other.bank.likeliest();
      ASSERT_EQ(a.code, b.code);
      ASSERT_EQ(a.probability, b.probability);
      if (a.code != trust::LikelyFault::kNone) {
        ASSERT_EQ(a.size, b.size);
      }
    }
  }
}

TEST(fault_bank, one_wild_value_leaves_a_mixture_of_numbers) {
  for (const float wild : {10.0F, 1e3F, 1e6F}) {
    Bench<Table> run(1);
    while (run.time_s < 20) run.step({});
    run.step({0, wild, 0});
    for (int k = 0; k < 100; ++k, run.step({}))
      for (int i = 0; i < 3; ++i) EXPECT_LT(run.published()(i, i), 2 * run.p(i, i)) << wild;
  }
}

TEST(fault_bank, signatures_change_as_the_filter_s_errors_do_and_begin_anew) {
  Bench<Table> run(4);
  for (int k = 0; k < 10; ++k) run.bank.predict(0.1F);
  ASSERT_LT(run.bank.signature(0).phi[1], -0.9F);
  run.bank.carry([](auto& phi) { phi[0] += 2 * phi[2]; });
  EXPECT_NEAR(run.bank.signature(0).phi[0], 2.0F - 0.45F, 1e-5F);
  run.bank.begin();
  EXPECT_EQ(run.bank.signature(0).phi[0], 0.0F);
  EXPECT_EQ(run.bank.signature(0).phi[2], 1.0F);
}

}  // namespace
}  // namespace tetap
