// SPDX-License-Identifier: Apache-2.0
// The bank: every row of a robot's table as a signature beside one filter. Likelihoods compare the rows: there is no
// order of arrival and no vote. Suspicion is published as a mixture (Maybeck 1982, sec. 10.8) and leaves the filter
// alone: a false alarm leaves no scar.
#pragma once

#include "tetap/base/math.hpp"
#include "tetap/base/members.hpp"
#include "tetap/base/multiply_add.hpp"
#include "tetap/filter/fault_signature.hpp"
#include "tetap/filter/sparse_update.hpp"
#include "tetap/trust/fault_row.hpp"

#include <cstdint>
#include <type_traits>

namespace tetap::trust {

/// Rows of a table that show in a measurement: the component m shows the row of the code first + m.
struct Shown {
  int first = 0, count = 0;
};

/// S = L L^T, as filter/sparse_update.hpp has it.
template <std::size_t M>
using Factor = filter::Symmetric<float, static_cast<int>(M)>;

/// A measurement as every signature sees it: H by columns.
template <std::size_t M>
struct Seen {
  const float* h;
  const int* touches;
  std::size_t columns;
  Shown shown;
  Factor<M> l{};
  std::array<float, M> y{};
};
template <std::size_t M>
inline constexpr std::array<float, M * M> kIdentity = [] {
  std::array<float, M * M> h{};
  for (std::size_t m = 0; m < M; ++m) h[m * M + m] = 1;
  return h;
}();

/// `Table` has kErrors, kRows, predict(row, phi, step), which is phi <- F phi + Gamma for a step of its filter, and
/// shown_by<Measurement>(): the rows of the measurement's own faults.
template <class Table>
class FaultBank {
 public:
  static constexpr int kErrors = Table::kErrors;
  static constexpr std::size_t kRows = Table::kRows.size();
  using Signature = filter::FaultSignature<float, kErrors>;
  using Errors = typename Signature::Errors;
  using Covariance = filter::Symmetric<float, kErrors>;

  FaultBank() { begin(); }

  /// The filter begins anew, or was set from outside, and with it every row.
  void begin() {
    for (std::size_t i = 0; i < kRows; ++i) {
      signatures_[i].begin(row(i).jumps, row(i).largest);
      weights_[i] = 0;
    }
  }
  /// Every signature that `f` changes as the filter changes its errors.
  template <class F>
  void carry(const F& f) {
    for (Signature& one : signatures_) f(one.phi);
  }
  template <class Step>
  [[gnu::noinline]] void predict(const Step& given) {
    const Step step = given;  // no signature can be part of it: read once for all rows
    for (std::size_t i = 0; i < kRows; ++i) Table::predict(row(i), signatures_[i].phi, step);
  }

  /// One measurement of M components on its way through an update (filter/sparse_update.hpp). H outlasts it.
  template <std::size_t M>
  class Pass {
   public:
    template <class Measurement, class Jacobian>
    Pass(FaultBank& bank, const Measurement&, const Jacobian& h)
        : bank_(bank),
          seen_{.h = entries(h),
                .touches = Measurement::kTouches.data(),
                .columns = Measurement::kTouches.size(),
                .shown = Table::template shown_by<Measurement>()} {
      if constexpr (std::is_same_v<Jacobian, filter::IdentityJacobian>) seen_.columns = M;
    }
    /// Before the verdict: y = L^-1 nu, and S = L L^T. A measurement that the gate refuses counts as much as a gate.
    template <class Vector>
    void innovation(const Factor<M>& l, const Vector& y, const filter::Innovation<float, static_cast<int>(M)>& record) {
      constexpr float kMost = filter::chi_square_99(static_cast<int>(M));
      seen_.l = l;
      for (std::size_t m = 0; m < M; ++m) seen_.y[m] = y(static_cast<int>(m));
      if (!(record.nis <= record.gate))
        bank_.template take<M>(seen_, record.nis > kMost ? kMost / record.nis : 1.0F, nullptr);
    }
    /// The measurement is used: G = P H^T L^-T.
    template <class Gains>
    void gains(const Gains& g) {
      bank_.template take<M>(seen_, 1.0F, g.value.data());
    }

   private:
    [[nodiscard]] static const float* entries(const filter::IdentityJacobian&) { return kIdentity<M>.data(); }
    template <class Matrix>
    [[nodiscard]] static const float* entries(const Matrix& h) {
      return h.data();
    }
    FaultBank& bank_;
    Seen<M> seen_;
  };

  /// After dt_s more: a signature without evidence begins anew at its age, and the rest are weighed.
  [[gnu::noinline]] void judge(float dt_s) {
    std::array<float, kRows> j{};
    float most = 0;
    for (std::size_t i = 0; i < kRows; ++i) {
      Signature& one = signatures_[i];
      one.age_s += dt_s;
      j[i] = evidence(i);
      if (one.age_s >= kAge_s && !(j[i] >= 0.0F)) {
        one.begin(row(i).jumps, row(i).largest);
        j[i] = evidence(i);
      }
      if (j[i] > most) most = j[i];
    }
    float sum = base::exp(-0.5F * most);
    for (const std::size_t i : kOrder) {
      weights_[i] = base::exp(0.5F * (j[i] - most));
      sum += weights_[i];
    }
    for (float& weight : weights_) weight /= sum;
  }
  /// Some row is likely enough to be in the mixture.
  [[nodiscard]] bool suspects() const {
    for (const float weight : weights_)
      if (weight >= kLeastWeight) return true;
    return false;
  }
  /// P of the mixture about the filter's own estimate: "no fault" and every row that is likely.
  [[gnu::noinline]] void widen(Covariance& p) const {
    for (const std::size_t i : kOrder) {
      if (!(weights_[i] >= kLeastWeight)) continue;
      const float f = signatures_[i].size();
      filter::add_outer(p, signatures_[i].phi, weights_[i] * (f * f + signatures_[i].variance()));
    }
  }
  /// The likeliest device, where some row is in the mixture.
  [[nodiscard, gnu::noinline]] LikelyFault likeliest() const {
    LikelyFault best;
    if (!suspects()) return best;
    std::array<float, kRows> device{};
    for (const std::size_t i : kOrder) device[row(i).device] += weights_[i];
    std::size_t at = kOrder[0];
    for (const std::size_t i : kOrder) {
      const float more = device[row(i).device] - device[row(at).device];
      if (more > 0.0F || (!(more < 0.0F) && weights_[i] > weights_[at])) at = i;
    }
    const Signature& one = signatures_[at];
    best = {row(at).code, device[row(at).device], one.size(), base::sqrt(one.variance())};
    return best;
  }
  [[nodiscard]] float weight(std::size_t i) const { return weights_[i]; }
  [[nodiscard]] const Signature& signature(std::size_t i) const { return signatures_[i]; }
  /// J, prior odds included: the fault begins within the time after which its row begins anew.
  [[nodiscard]] float evidence(std::size_t i) const { return signatures_[i].evidence(row(i).largest) + kPriorOdds[i]; }
  static constexpr auto members(auto& self) {
    return base::members(base::in_turns(self.signatures_), base::in_turns(self.weights_));
  }

  static constexpr float kAge_s = 3;            ///< a signature without evidence begins anew at this age
  static constexpr float kLeastWeight = 0.01F;  ///< less likely rows are in no mixture

 private:
  /// Every signature sees the innovation, and is moved by the gains of a measurement that is used. Rows go together: an
  /// entry of H and a gain are read once for as many as the registers hold.
  template <std::size_t M>
  [[gnu::noinline]] void take(const Seen<M>& z, float share, const float* gains) {
    constexpr std::size_t kTogether = M < 3 ? 4 : 2, kLast = kRows / kTogether * kTogether;
    for (std::size_t first = 0; first < kLast; first += kTogether) take_rows<kTogether>(first, z, share, gains);
    if constexpr (kLast < kRows) take_rows<kRows - kLast>(kLast, z, share, gains);
  }
  template <std::size_t Count, std::size_t M>
  [[gnu::always_inline]] void take_rows(std::size_t first, const Seen<M>& z, float share, const float* gains) {
    std::array<std::array<float, M>, Count> w;  // L^-1 (H phi + d)
#pragma GCC unroll 4
    for (std::size_t i = 0; i < Count; ++i) {
      const int own = row(first + i).code - z.shown.first;
#pragma GCC unroll 4
      for (std::size_t m = 0; m < M; ++m) w[i][m] = own == static_cast<int>(m) && own < z.shown.count ? 1.0F : 0.0F;
    }
    for (std::size_t k = 0; k < z.columns; ++k) {
      std::array<float, M> h;
#pragma GCC unroll 4
      for (std::size_t m = 0; m < M; ++m) h[m] = z.h[k * M + m];
#pragma GCC unroll 4
      for (std::size_t i = 0; i < Count; ++i) {
        const float phi = signatures_[first + i].phi[static_cast<std::size_t>(z.touches[k])];
#pragma GCC unroll 4
        for (std::size_t m = 0; m < M; ++m) w[i][m] = base::add_product(w[i][m], h[m], phi);
      }
    }
#pragma GCC unroll 4
    for (std::size_t i = 0; i < Count; ++i) {
      filter::whiten(z.l, w[i]);
      signatures_[first + i].score(w[i], z.y, share);
    }
    if (gains == nullptr) return;
    filter::correct(&signatures_[first], w, [gains](int n, int m) { return gains[n * static_cast<int>(M) + m]; });
  }

  [[nodiscard]] static constexpr const FaultRow& row(std::size_t i) { return Table::kRows[i]; }

  static constexpr std::array<std::uint8_t, kRows> kOrder = by_code(Table::kRows);
  /// Twice the logarithm.
  static constexpr std::array<float, kRows> kPriorOdds = [] {
    std::array<float, kRows> odds{};
    for (std::size_t i = 0; i < kRows; ++i) odds[i] = 2.0F * base::log(Table::kRows[i].per_hour * (kAge_s / 3600.0F));
    return odds;
  }();

  std::array<Signature, kRows> signatures_;
  std::array<float, kRows> weights_{};  ///< probability of each row
};

}  // namespace tetap::trust
