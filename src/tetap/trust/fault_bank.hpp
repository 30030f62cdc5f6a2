// SPDX-License-Identifier: Apache-2.0
// The bank: every row of a robot's table as a signature beside one filter. Likelihoods compare the rows: there is no
// order of arrival and no vote. Suspicion is published as a mixture (Maybeck 1982, sec. 10.8) and leaves the filter
// alone. A device is decided at 99 %; the harm to the state is then taken back exactly.
#pragma once

#include "tetap/base/math.hpp"
#include "tetap/base/members.hpp"
#include "tetap/filter/fault_signature.hpp"
#include "tetap/filter/sparse_update.hpp"
#include "tetap/trust/fault_row.hpp"

#include <cstdint>
#include <type_traits>

namespace tetap::trust {

/// Rows that are not decided yet, as the bank finds them.
struct Suspicion {
  Device device = Device::kImu;  ///< the likeliest one that fails
  float probability = 0;         ///< probability of its failure
  std::size_t row = 0;           ///< its likeliest row
  float size = 0, sigma = 0;     ///< both by that row

  [[nodiscard]] bool decided() const { return probability >= 0.99F; }
};

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

/// `Table` has kErrors, kRows, predict(phi, step), which is phi <- F phi + Gamma for a step of its filter, and
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

  /// The filter begins anew, and with it every row. Nothing is decided.
  void begin() {
    for (std::size_t i = 0; i < kRows; ++i) restore(i);
  }
  /// The error `error` was set from outside, and is no longer what a row made of it.
  void forget_error(int error) {
    for (std::size_t i = 0; i < kRows; ++i)
      for (Signature& one : rows_[i].ages) one.phi[static_cast<std::size_t>(error)] = 0;
  }
  /// Every signature that `f` changes as the filter changes its errors.
  template <class F>
  void carry(const F& f) {
    for (Entry& entry : rows_)
      for (Signature& one : entry.ages) f(one.phi);
  }
  template <class Step>
  [[gnu::noinline]] void predict(const Step& step) {
    for (std::size_t i = 0; i < kRows; ++i)
      for (Signature& one : rows_[i].ages) Table::predict(Table::kRows[i], one.phi, step);
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
    /// Before the verdict: y = L^-1 nu, and S = L L^T. A measurement that the gate refuses counts as much as the gate.
    template <class Vector>
    void innovation(const Factor<M>& l, const Vector& y, const filter::Innovation<float, static_cast<int>(M)>& record) {
      seen_.l = l;
      for (std::size_t m = 0; m < M; ++m) seen_.y[m] = y(static_cast<int>(m));
      if (!(record.nis <= record.gate)) bank_.template take<M>(seen_, record.gate / record.nis, nullptr);
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

  /// After dt_s more: signatures without evidence begin anew at their age, and the rest are weighed.
  [[nodiscard]] Suspicion judge(float dt_s) {
    for (std::size_t i = 0; i < kRows; ++i)
      for (std::size_t age = 0; age < kAges; ++age) {
        Signature& one = rows_[i].ages[age];
        one.age_s += dt_s;
        const bool kept = rows_[i].decided && age == kTracked;
        if (!kept && one.age_s >= kAge_s[age] && !(evidence(i, age) >= 0.0F)) one.begin(row(i).jumps, row(i).largest);
      }
    weigh();
    return likeliest();
  }
  /// P of the mixture about the filter's own estimate: "no fault" and every row that is likely; and what is not known
  /// of decided faults.
  void widen(Covariance& p) const {
    for (const std::size_t i : kOrder) {
      const Entry& entry = rows_[i];
      const Signature& one = best(i);
      const float f = one.size();
      if (entry.decided)
        filter::add_outer(p, entry.ages[kTracked].phi, entry.ages[kTracked].variance());
      else if (entry.weight >= kLeastWeight)
        filter::add_outer(p, one.phi, entry.weight * (f * f + one.variance()));
    }
  }

  /// A device whose rows are jumps of states: the state that they explain. Returns what is to be added to the state,
  /// and adds the moments of the device's rows to P. Every row begins anew.
  [[nodiscard]] Errors fold(Device device, Covariance& p) {
    Errors dx{};
    float all = 0;
    for (const std::size_t i : kOrder)
      if (of(i, device)) all += rows_[i].weight;
    if (!(all > 0.0F)) return dx;
    for (const std::size_t i : kOrder) {
      if (!of(i, device) || !(rows_[i].weight > kLeastWeight * all)) continue;
      const Signature& one = best(i);
      const float share = rows_[i].weight / all, f = one.size();
      filter::add_outer(p, one.phi, share * (f * f + one.variance()));
      for (std::size_t n = 0; n < dx.size(); ++n) dx[n] += share * f * one.phi[n];
    }
    filter::add_outer(p, dx, -1.0F);
    begin_undecided();
    return dx;
  }
  /// A measurement's fault of row i is decided: the measurement is used less its size from now on. Returns what is to
  /// be added to the state. Phi and its information stay.
  [[nodiscard]] Errors decide(std::size_t i) {
    Entry& entry = rows_[i];
    entry.ages[kTracked] = best(i);
    entry.decided = true;
    entry.right_s = 0;
    entry.size = 0;
    const Errors dx = recentre(i);
    entry.found = base::abs(entry.size);
    begin_undecided();
    return dx;
  }
  /// Decided faults, dt_s later: each is followed as it wanders. One that is gone for a second is folded: its variance
  /// goes into P, and the row begins anew. Returns what is to be added to the state.
  [[nodiscard]] Errors follow(float dt_s, Covariance& p) {
    Errors dx{};
    for (const std::size_t i : kOrder) {
      Entry& entry = rows_[i];
      if (!entry.decided) continue;
      const Errors by = recentre(i);
      for (std::size_t n = 0; n < dx.size(); ++n) dx[n] += by[n];
      Signature& one = entry.ages[kTracked];
      const bool gone = entry.size * entry.size < 9.0F * one.variance() && base::abs(entry.size) < kGone * entry.found;
      entry.right_s = gone ? entry.right_s + dt_s : 0.0F;
      if (entry.right_s >= kRight_s) {
        filter::add_outer(p, one.phi, one.variance());
        restore(i);
        continue;
      }
      const Errors before = one.phi;
      filter::add_outer(p, before, one.wander(row(i).wander_rts * row(i).wander_rts * dt_s));
    }
    return dx;
  }
  /// The state took dx from someone else who knows: rows that are not decided begin anew.
  void begin_undecided() {
    for (std::size_t i = 0; i < kRows; ++i)
      if (!rows_[i].decided) restore(i);
  }

  [[nodiscard]] bool decided(std::size_t i) const { return rows_[i].decided; }
  [[nodiscard]] bool decided(Device device) const {
    for (std::size_t i = 0; i < kRows; ++i)
      if (rows_[i].decided && row(i).device == device) return true;
    return false;
  }
  /// Size of a decided fault, which a measurement is used without; 0: none.
  [[nodiscard]] float size(std::size_t i) const { return rows_[i].size; }
  [[nodiscard]] float weight(std::size_t i) const { return rows_[i].weight; }
  /// The older of the row's two signatures.
  [[nodiscard]] const Signature& signature(std::size_t i) const { return rows_[i].ages[kOld]; }
  /// The likelier of the row's two signatures.
  [[nodiscard]] const Signature& best(std::size_t i) const {
    return rows_[i].ages[evidence(i, kYoung) > evidence(i, kOld) ? kYoung : kOld];
  }
  /// J, prior odds included.
  [[nodiscard]] float evidence(std::size_t i, std::size_t age) const {
    return rows_[i].ages[age].evidence(row(i).largest) + 2.0F * base::log(row(i).per_hour * (kAge_s[kYoung] / 3600.0F));
  }
  static constexpr auto members(auto& self) { return base::members(self.rows_); }

  static constexpr std::size_t kYoung = 0, kOld = 1, kAges = 2, kTracked = kOld;
  /// A signature without evidence begins anew at this age.
  static constexpr std::array<float, kAges> kAge_s{1.0F, 6.0F};

 private:
  /// Every signature sees the innovation, and is moved by the gains of a measurement that is used.
  template <std::size_t M>
  [[gnu::noinline]] void take(const Seen<M>& z, float share, const float* gains) {
    for (std::size_t i = 0; i < kRows; ++i) {
      const int own = row(i).code - z.shown.first;
      for (Signature& one : rows_[i].ages) {
        std::array<float, M> w;
        for (std::size_t m = 0; m < M; ++m) w[m] = own == static_cast<int>(m) && own < z.shown.count ? 1.0F : 0.0F;
        for (std::size_t k = 0; k < z.columns; ++k) {
          const float phi = one.phi[static_cast<std::size_t>(z.touches[k])];
          for (std::size_t m = 0; m < M; ++m) w[m] += z.h[k * M + m] * phi;
        }
        filter::whiten(z.l, w);
        one.score(w, z.y, share);
        if (gains != nullptr) one.correct([gains](int n, int m) { return gains[n * static_cast<int>(M) + m]; }, w);
      }
    }
  }

  struct Entry {
    std::array<Signature, kAges> ages;
    float weight = 0;   ///< probability of the row
    float size = 0;     ///< size of a decided fault
    float found = 0;    ///< its size when it was decided
    float right_s = 0;  ///< for so long a decided fault has been gone
    bool decided = false;
    static constexpr auto members(auto& self) {
      return base::members(self.ages, self.weight, self.size, self.found, self.right_s, self.decided);
    }
  };

  [[nodiscard]] static constexpr const FaultRow& row(std::size_t i) { return Table::kRows[i]; }
  [[nodiscard]] bool of(std::size_t i, Device device) const { return !rows_[i].decided && row(i).device == device; }
  void restore(std::size_t i) {
    Entry& entry = rows_[i];
    for (Signature& one : entry.ages) one.begin(row(i).jumps, row(i).largest);
    entry.weight = entry.size = entry.found = entry.right_s = 0;
    entry.decided = false;
  }
  /// The state takes in what is known of the decided fault's size.
  [[nodiscard]] Errors recentre(std::size_t i) {
    Signature& one = rows_[i].ages[kTracked];
    const float f = one.size();
    Errors dx;
    for (std::size_t n = 0; n < dx.size(); ++n) dx[n] = f * one.phi[n];
    rows_[i].size += f;
    one.recentre();
    return dx;
  }
  void weigh() {
    float most = 0;
    std::array<float, kRows> j{};
    for (std::size_t i = 0; i < kRows; ++i) {
      const float young = evidence(i, kYoung), old = evidence(i, kOld);
      j[i] = young > old ? young : old;
      if (!rows_[i].decided && j[i] > most) most = j[i];
    }
    float sum = base::exp(-0.5F * most);
    for (const std::size_t i : kOrder) {
      rows_[i].weight = rows_[i].decided ? 0.0F : base::exp(0.5F * (j[i] - most));
      sum += rows_[i].weight;
    }
    for (Entry& entry : rows_) entry.weight /= sum;
  }
  [[nodiscard]] Suspicion likeliest() const {
    std::array<float, kDevices> each{};
    for (const std::size_t i : kOrder) each[static_cast<std::size_t>(row(i).device)] += rows_[i].weight;
    Suspicion found;
    for (std::size_t d = 0; d < kDevices; ++d)
      if (each[d] > found.probability) found.probability = each[d], found.device = static_cast<Device>(d);
    float most = -1;
    for (const std::size_t i : kOrder)
      if (of(i, found.device) && rows_[i].weight > most) most = rows_[i].weight, found.row = i;
    found.size = best(found.row).size();
    found.sigma = base::sqrt(best(found.row).variance());
    return found;
  }

  static constexpr std::array<std::uint8_t, kRows> kOrder = by_code(Table::kRows);
  static constexpr float kLeastWeight = 0.01F;  ///< less likely rows are in no mixture
  static constexpr float kGone = 0.3F, kRight_s = 1.0F;

  std::array<Entry, kRows> rows_;
};

}  // namespace tetap::trust
