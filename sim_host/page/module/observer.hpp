// SPDX-License-Identifier: Apache-2.0
// A run as the page sees it: its tables and fixes on their way to the page, and the comparison with a record.
#pragma once

#include "sim_host/page/module/fixes.hpp"
#include "sim_host/page/module/page_tables.hpp"
#include "sim_host/replay/frame_accounting.hpp"
#include "sim_host/replay/recording.hpp"

#include <cstdint>
#include <optional>

namespace tetap::page {

class Observer {
 public:
  explicit Observer(std::uint32_t base, sim::Comparison* comparison = nullptr)
      : tables_(base, files_), fixes_(base), comparison_(comparison) {}

  void restarted() { tables_.restarted(); }
  void sent(const base::CanFrame& frame) {
    tables_.sent(frame);
    fixes_.sent(frame);
  }
  void received(const base::CanFrame& frame) {
    tables_.received(frame);
    fixes_.received(frame);
  }
  void epoch(const sim::NodeEpoch& epoch, base::Micros time) {
    tables_.epoch(epoch, time);
    fixes_.epoch(time);
    if (comparison_ != nullptr) comparison_->epoch(epoch, time);
  }

  /// Hands over what there is, whole lines.
  void flush() {
    files_.flush();
    fixes_.flush();
  }
  const sim::Tables::Totals& end() {
    const sim::Tables::Totals& totals = tables_.end();
    flush();
    return totals;
  }
  [[nodiscard]] sim::Tables::Totals so_far() const { return tables_.so_far(); }
  [[nodiscard]] std::optional<FixTable::Origin> origin() const { return fixes_.origin(); }

  sim::Counts counts;

 private:
  PageTables files_;
  sim::Tables tables_;
  FixTable fixes_;
  sim::Comparison* comparison_;
};

}  // namespace tetap::page
