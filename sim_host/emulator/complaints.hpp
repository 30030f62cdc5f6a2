// SPDX-License-Identifier: Apache-2.0
// Complaints of the models: the program asked for what silicon would not do. Any complaint fails a run.
#pragma once

#include "sim_host/emulator/virtual_time.hpp"

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace tetap::board {

struct Complaint {
  Picoseconds first = 0;  ///< time of the first occurrence
  std::string model;      ///< "SPI1", "RCC", "core" ...
  std::string text;
  std::uint32_t count = 0;  ///< occurrences
};

/// Complaints of a run, each text once with its count.
class Complaints {
 public:
  explicit Complaints(const Scheduler& scheduler) : scheduler_(scheduler) {}

  void add(std::string_view model, std::string_view text) {
    std::vector<Complaint>& list = provoked_from_ == model ? provoked_ : list_;
    for (Complaint& one : list) {
      if (one.model == model && one.text == text) {
        ++one.count;
        return;
      }
    }
    list.push_back({scheduler_.now(), std::string(model), std::string(text), 1});
  }
  /// An injected fault makes `model` complain until the next call: such complaints are apart. Empty: no model.
  void expect_from(std::string_view model) { provoked_from_ = model; }
  [[nodiscard]] const std::vector<Complaint>& provoked() const { return provoked_; }
  [[nodiscard]] const std::vector<Complaint>& list() const { return list_; }
  [[nodiscard]] bool empty() const { return list_.empty(); }
  /// Whether a complaint of `model` contains `part`.
  [[nodiscard]] bool has(std::string_view model, std::string_view part) const {
    for (const Complaint& one : list_) {
      if (one.model == model && one.text.find(part) != std::string::npos) return true;
    }
    return false;
  }
  /// One line each: time, model, text, count.
  [[nodiscard]] std::string text() const {
    std::string all;
    for (const Complaint& one : list_) {
      all += std::to_string(one.first / kMicrosecond) + " us: " + one.model + ": " + one.text + " (" +
             std::to_string(one.count) + ")\n";
    }
    return all;
  }
  void clear() { list_.clear(); }

 private:
  const Scheduler& scheduler_;
  std::vector<Complaint> list_, provoked_;
  std::string provoked_from_;
};

}  // namespace tetap::board
