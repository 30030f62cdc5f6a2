// SPDX-License-Identifier: Apache-2.0
// Innovations of every update of a robot's filters, as the terms of their likelihood. Components of one measurement are
// taken in sequence: S = L D L^T with ones on L's diagonal, then nu^T S^-1 nu is the sum of e^2 / d with e = L^-1 nu.
#pragma once

#include "tetap/base/time.hpp"
#include "tetap/filter/viewed.hpp"

#include <cstdint>
#include <string>
#include <type_traits>
#include <vector>

namespace tetap::sim {

/// One component, as it is written: little endian.
struct InnovationTerm {
  std::int32_t time_ms;  ///< time since the first epoch, of the epoch before
  float nis, gate;       ///< NIS and gate of the whole measurement
  float log_variance;    ///< ln d
  float innovation;      ///< e, in units of the measurement
  std::uint8_t model;    ///< its place among models()
  std::uint8_t verdict;  ///< filter::Verdict
  std::uint8_t component, components;
};
static_assert(sizeof(InnovationTerm) == 24 && std::is_trivially_copyable_v<InnovationTerm>);

/// While it lives, the updates of every filter in this process come here. One at a time.
class InnovationLog {
 public:
  InnovationLog();
  InnovationLog(const InnovationLog&) = delete;
  InnovationLog& operator=(const InnovationLog&) = delete;
  ~InnovationLog();

  /// Updates from now on follow the epoch of that time.
  void next(base::Micros time) { time_ms_ = static_cast<std::int32_t>(time.us / 1000); }
  void add(const filter::UpdateView& update);
  [[nodiscard]] const std::vector<InnovationTerm>& terms() const { return terms_; }
  /// Types of the measurements, in the order in which they came.
  [[nodiscard]] const std::vector<std::string>& models() const { return models_; }

 private:
  [[nodiscard]] std::uint8_t place_of(std::string_view model);

  std::int32_t time_ms_ = 0;
  std::vector<InnovationTerm> terms_;
  std::vector<std::string> models_;
};

}  // namespace tetap::sim
