// SPDX-License-Identifier: Apache-2.0
// The updates that the flashed filters make, as JSON: prior, innovation, S, posterior, as filter/viewed.hpp shows them.
#pragma once

#include "tetap/base/time.hpp"
#include "tetap/filter/viewed.hpp"

#include <string>
#include <vector>

namespace tetap::page {

/// While it lives and takes, each update of every filter in this module comes here. One at a time.
class UpdateLog {
 public:
  UpdateLog();
  UpdateLog(const UpdateLog&) = delete;
  UpdateLog& operator=(const UpdateLog&) = delete;
  ~UpdateLog();

  /// Updates from now on belong to the epoch after `time`; those before `keep` are forgotten.
  void next(base::Micros time, base::Micros keep);
  void add(const filter::UpdateView& update);
  /// [{"after_s", "model", "states", "components", "at", "moved", "prior", ...}], in order.
  [[nodiscard]] std::string json() const;

  bool takes = false;

 private:
  struct Entry {
    base::Micros after;
    std::string json;
  };
  base::Micros after_{};
  std::vector<Entry> entries_;
};

}  // namespace tetap::page
