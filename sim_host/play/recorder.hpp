// SPDX-License-Identifier: Apache-2.0
// Writes a node's output (replay/tables.hpp) to the files of a folder. On request raw.log has everything on the bus as
// it came.
#pragma once

#include "sim_host/play/out_file.hpp"
#include "sim_host/replay/tables.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace tetap::sim {

struct RecorderOptions {
  std::string folder;
  std::uint32_t base = 0x300;
  bool raw = false;
  std::string interface = "vcan0";  ///< name written in raw.log
};

class Recorder {
 public:
  using Totals = Tables::Totals;

  /// Makes the folder and the files; throws when that is not possible.
  explicit Recorder(const RecorderOptions& options);

  void restarted() { tables_.restarted(); }
  void sent(const base::CanFrame& frame);
  /// `arrival`: for raw.log; without it now.
  void received(const base::CanFrame& frame, std::optional<base::Micros> arrival = std::nullopt);
  void epoch(const NodeEpoch& epoch, base::Micros time) { tables_.epoch(epoch, time); }
  /// Writes out what is buffered, so that a long recording can be looked at.
  void flush();
  /// Ends all files; throws when one could not be written whole.
  const Totals& end();
  /// Gives the files, which have ended, their names.
  void publish();
  /// end() and publish().
  const Totals& finish();
  [[nodiscard]] const Totals& totals() const { return tables_.totals(); }

 private:
  class Files final : public TableSink {
   public:
    explicit Files(const std::string& folder);
    void write(Table table, std::string_view lines) override {
      of[static_cast<std::size_t>(table)].write(lines);
      ++writes_[static_cast<std::size_t>(table)];
    }
    void publish();
    std::array<OutFile, kTableNames.size()> of;

   private:
    std::array<std::uint64_t, kTableNames.size()> writes_{};  ///< the first is the head of the table
  };
  void raw_line(const base::CanFrame& frame, base::Micros time);

  RecorderOptions options_;
  Files files_;
  Tables tables_;
  std::optional<OutFile> raw_;
  Line line_;
};

}  // namespace tetap::sim
