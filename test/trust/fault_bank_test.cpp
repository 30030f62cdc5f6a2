// SPDX-License-Identifier: Apache-2.0
// The bank beside a small filter: position, velocity and the bias of an accelerometer, with fixes and a speedometer.
#include "tetap/trust/fault_bank.hpp"

#include "tetap/filter/sparse_update.hpp"

#include <gtest/gtest.h>
#include <algorithm>
#include <cmath>
#include <optional>
#include <random>

namespace tetap {
namespace {

using trust::Device;
using trust::FaultRow;
using trust::Suspicion;

template <int kState>
struct Seen {
  static constexpr int kDimension = 1;
  static constexpr std::array<int, 1> kTouches{kState};
};
using Fix = Seen<0>;
using Speed = Seen<1>;

constexpr FaultRow kBias{.device = Device::kImu, .code = 0, .jumps = 2, .largest = 3};
constexpr FaultRow kFix{.device = Device::kReceiver, .code = 1, .largest = 20, .wander_rts = 0.5F};
constexpr FaultRow kSpeed{.device = Device::kWheels, .code = 2, .largest = 5, .wander_rts = 0.5F};

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

struct Nothing : filter::Unwatched {};

/// The robot rests at 0; the filter does not know. Whatever the sensors show beside noise is the fault.
template <class T>
struct Bench {
  trust::FaultBank<T> bank;
  filter::Vector<float, 3> x = filter::Vector<float, 3>::Zero();
  filter::Symmetric<float, 3> p = filter::Symmetric<float, 3>::diagonal({1, 0.01F, 0.0025F});
  std::mt19937 random;
  float time_s = 0;
  bool watched = true;
  explicit Bench(unsigned seed) : random(seed) {}

  float noise(float sigma) { return sigma * std::normal_distribution<float>()(random); }
  std::size_t row(Device device) const {
    std::size_t at = 0;
    while (T::kRows[at].device != device) ++at;
    return at;
  }
  template <class Z>
  void fuse(const Z& z, float value, float sigma) {
    filter::SparseUpdate<float, 3, 1> result;
    filter::Matrix<float, 1, 1> h;
    h(0, 0) = 1;
    const filter::Vector<float, 1> nu{value - x(Z::kTouches[0])}, r{sigma * sigma};
    if (watched) {
      typename trust::FaultBank<T>::template Pass<1> pass(bank, z, h);
      filter::sparse_update<Z>(p, h, nu, r, 10.8F, result, pass);
    } else {
      Nothing pass;
      filter::sparse_update<Z>(p, h, nu, r, 10.8F, result, pass);
    }
    if (result.innovation.verdict == filter::Verdict::kAccepted) x += result.dx;
  }
  /// 0.1 s: the IMU, both measurements, and the judgement. `off`: what each device shows beside the truth.
  std::optional<Suspicion> step(const std::array<float, 3>& off) {
    constexpr float kStep_s = 0.1F;
    time_s += kStep_s;
    x(0) += kStep_s * x(1);
    x(1) += kStep_s * (off[0] + noise(0.3F) - x(2));
    filter::Matrix<float, 3, 3> f = filter::Matrix<float, 3, 3>::Identity();
    f(0, 1) = kStep_s, f(1, 2) = -kStep_s;
    p = filter::propagate(p, f, filter::Symmetric<float, 3>::diagonal({0, 0.0009F, 1e-8F}));
    if (watched) bank.predict(kStep_s);
    const auto size = [this](Device device) { return watched ? bank.size(row(device)) : 0.0F; };
    fuse(Fix{}, off[1] + noise(0.5F) - size(Device::kReceiver), 0.5F);
    fuse(Speed{}, off[2] + noise(0.1F) - size(Device::kWheels), 0.1F);
    if (!watched) return {};
    const Suspicion found = bank.judge(kStep_s);
    take(bank.follow(kStep_s, p));
    if (!found.decided()) return {};
    take(found.device == Device::kImu ? bank.fold(found.device, p) : bank.decide(found.row));
    return found;
  }
  void take(const std::array<float, 3>& dx) {
    for (int n = 0; n < 3; ++n) x(n) += dx[static_cast<std::size_t>(n)];
  }
};

/// Sizes some four gates large: bias, fix, speed.
std::array<float, 3> fault(Device device) {
  return device == Device::kImu        ? std::array{1.0F, 0.0F, 0.0F}
         : device == Device::kReceiver ? std::array{0.0F, 6.0F, 0.0F}
                                       : std::array{0.0F, 0.0F, 1.2F};
}

TEST(fault_bank, names_the_device_its_size_and_takes_the_harm_back) {
  for (const Device device : {Device::kImu, Device::kReceiver, Device::kWheels}) {
    for (unsigned seed = 1; seed <= 10; ++seed) {
      Bench<Table> run(seed);
      while (run.time_s < 20) ASSERT_FALSE(run.step({}));
      std::optional<Suspicion> first;
      while (run.time_s < 40) {
        const auto found = run.step(fault(device));
        if (found && !first) {
          first = found;
          EXPECT_LT(run.time_s, 24);
        }
      }
      ASSERT_TRUE(first);
      EXPECT_EQ(first->device, device) << seed;
      const auto at = static_cast<std::size_t>(device);
      EXPECT_NEAR(first->size, fault(device)[at], 4 * first->sigma);
      if (device != Device::kImu) EXPECT_TRUE(run.bank.decided(device));
      filter::Symmetric<float, 3> p = run.p;
      run.bank.widen(p);
      const float imu = device == Device::kImu ? fault(device)[0] : 0.0F;
      EXPECT_LT(std::abs(run.x(0)), 4 * std::sqrt(p(0, 0)));
      EXPECT_LT(std::abs(run.x(1)), 4 * std::sqrt(p(1, 1)));
      EXPECT_LT(std::abs(run.x(2) - imu), 4 * std::sqrt(p(2, 2)));
      while (run.time_s < 60) static_cast<void>(run.step({}));
      EXPECT_FALSE(run.bank.decided(device)) << "right again";
      EXPECT_LT(std::abs(run.x(0)), 4 * std::sqrt(run.p(0, 0)));
      EXPECT_LT(std::abs(run.x(1)), 4 * std::sqrt(run.p(1, 1)));
      EXPECT_LT(run.p(0, 0), 0.2F);
    }
  }
}

TEST(fault_bank, decides_nothing_in_clean_hours_and_changes_no_bit) {
  for (unsigned seed = 1; seed <= 4; ++seed) {
    Bench<Table> run(seed), alone(seed);
    alone.watched = false;
    for (int k = 0; k < 36'000; ++k) {
      ASSERT_FALSE(run.step({})) << run.time_s;
      static_cast<void>(alone.step({}));
    }
    EXPECT_EQ(run.x, alone.x);
    EXPECT_EQ(run.p.packed(), alone.p.packed());
  }
}

TEST(fault_bank, a_permuted_table_gives_the_same_bits) {
  for (const Device device : {Device::kImu, Device::kReceiver, Device::kWheels}) {
    Bench<Table> run(5);
    Bench<Permuted> other(5);
    for (int k = 0; k < 600; ++k) {
      const bool lasts = k > 200 && k < 400;
      const auto off = lasts ? fault(device) : std::array<float, 3>{};
      const auto a = run.step(off);
      const auto b = other.step(off);
      ASSERT_EQ(a.has_value(), b.has_value());
      if (a) EXPECT_EQ(a->probability, b->probability);
      filter::Symmetric<float, 3> p = run.p, q = other.p;
      run.bank.widen(p), other.bank.widen(q);
      ASSERT_EQ(p.packed(), q.packed());
      ASSERT_EQ(run.x, other.x);
    }
  }
}

TEST(fault_bank, one_wild_value_is_no_fault) {
  for (const float wild : {10.0F, 1e3F, 1e6F}) {
    Bench<Table> run(1);
    while (run.time_s < 20) static_cast<void>(run.step({}));
    EXPECT_FALSE(run.step({0, wild, 0}));
    for (int k = 0; k < 100; ++k) EXPECT_FALSE(run.step({}));
  }
}

TEST(fault_bank, suspicion_widens_what_is_published_before_a_decision) {
  Bench<Table> run(2);
  while (run.time_s < 20) static_cast<void>(run.step({}));
  filter::Symmetric<float, 3> p = run.p;
  run.bank.widen(p);
  EXPECT_LT(p(1, 1), 1.05F * run.p(1, 1)) << "clean";
  float widest = 1;
  while (!run.step(fault(Device::kImu))) {
    p = run.p;
    run.bank.widen(p);
    widest = std::max(widest, p(1, 1) / run.p(1, 1));
  }
  EXPECT_GT(widest, 1.3F);
}

/// One decided row: x and P become those of the filter with the fault as a state (Friedland 1969, eq. 30).
TEST(fault_bank, a_fold_adds_the_size_and_its_variance) {
  Bench<Table> run(3);
  for (int k = 0; k < 10; ++k) run.bank.predict(0.1F);
  const filter::Matrix<float, 1, 1> h{1.0F};
  typename trust::FaultBank<Table>::template Pass<1> pass(run.bank, Speed{}, h);
  filter::Innovation<float, 1> record;
  record.nis = 900, record.gate = 1e9F;
  const auto l = filter::Symmetric<float, 1>::diagonal({10.0F});
  pass.innovation(l, filter::Vector<float, 1>{-30.0F}, record);
  pass.gains(filter::detail::Gains<float, 3, 1>{});
  const auto bias = run.bank.best(0);
  static_cast<void>(run.bank.judge(0.1F));
  const filter::Symmetric<float, 3> before = run.p;
  const auto dx = run.bank.fold(Device::kImu, run.p);
  for (int r = 0; r < 3; ++r) {
    EXPECT_NEAR(dx[static_cast<std::size_t>(r)], bias.size() * bias.phi[static_cast<std::size_t>(r)], 1e-4F);
    for (int c = 0; c < 3; ++c)
      EXPECT_NEAR(run.p(r, c) - before(r, c),
                  bias.variance() * bias.phi[static_cast<std::size_t>(r)] * bias.phi[static_cast<std::size_t>(c)],
                  1e-4F);
  }
  EXPECT_EQ(run.bank.best(0).weighted, 0.0F) << "begins anew";
}

TEST(fault_bank, a_state_set_from_outside_is_no_row_s_work) {
  Bench<Table> run(4);
  for (int k = 0; k < 10; ++k) run.bank.predict(0.1F);
  ASSERT_LT(run.bank.best(0).phi[1], -0.9F);
  run.bank.forget_error(1);
  EXPECT_EQ(run.bank.best(0).phi[1], 0.0F);
  EXPECT_EQ(run.bank.best(0).phi[2], 1.0F);
  run.bank.carry([](auto& phi) { phi[0] += 2 * phi[2]; });
  EXPECT_NEAR(run.bank.best(0).phi[0], 2.0F - 0.45F, 1e-5F);
  run.bank.begin();
  EXPECT_EQ(run.bank.best(0).phi[0], 0.0F);
}

}  // namespace
}  // namespace tetap
