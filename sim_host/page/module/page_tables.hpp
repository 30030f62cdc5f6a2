// SPDX-License-Identifier: Apache-2.0
// The tables of a run on their way to the page, in blocks of whole lines.
#pragma once

#include "sim_host/page/module/browser.hpp"
#include "sim_host/replay/tables.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>

namespace tetap::page {

class PageTables final : public sim::TableSink {
 public:
  void write(sim::Table table, std::string_view lines) override {
    if (table == sim::Table::kEstimatesLog) return;  // the page needs its hash alone
    std::string& text = texts_[static_cast<std::size_t>(table)];
    text += lines;
    if (text.size() >= kBlock) hand_over(table);
  }
  void flush() {
    for (std::size_t i = 0; i < texts_.size(); ++i) hand_over(static_cast<sim::Table>(i));
  }

 private:
  static constexpr std::size_t kBlock = 1 << 16;

  void hand_over(sim::Table table) {
    std::string& text = texts_[static_cast<std::size_t>(table)];
    if (!text.empty()) page::write(static_cast<std::uint32_t>(table), text);
    text.clear();
  }

  std::array<std::string, sim::kTableNames.size()> texts_;
};

}  // namespace tetap::page
