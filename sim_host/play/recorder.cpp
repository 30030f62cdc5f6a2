// SPDX-License-Identifier: Apache-2.0
#include "sim_host/play/recorder.hpp"

#include "hal/board/linux/clock.hpp"
#include "sim_host/replay/candump.hpp"

#include <utility>

namespace tetap::sim {

namespace {

template <std::size_t... I>
std::array<OutFile, sizeof...(I)> files_in(const std::string& folder, std::index_sequence<I...>) {
  make_folder(folder);
  return {OutFile(folder + "/" + std::string(kTableNames[I]))...};
}

}  // namespace

Recorder::Files::Files(const std::string& folder)
    : of(files_in(folder, std::make_index_sequence<kTableNames.size()>{})) {}

Recorder::Recorder(const RecorderOptions& options)
    : options_(options), files_(options.folder), tables_(options.base, files_) {
  if (options.raw) raw_.emplace(options.folder + "/raw.log");
}

void Recorder::raw_line(const base::CanFrame& frame, base::Micros time) {
  line_.clear();
  append_log_line(line_, time, options_.interface, frame);
  raw_->write(line_.view());
}

void Recorder::sent(const base::CanFrame& frame) {
  tables_.sent(frame);
  if (raw_) raw_line(frame, hal::wall_clock());
}

void Recorder::received(const base::CanFrame& frame, std::optional<base::Micros> arrival) {
  tables_.received(frame);
  if (raw_) raw_line(frame, arrival ? *arrival : hal::wall_clock());
}

void Recorder::flush() {
  for (OutFile& file : files_.of) file.flush();
  if (raw_) raw_->flush();
}

const Recorder::Totals& Recorder::end() {
  for (OutFile& file : files_.of) file.end();
  if (raw_) raw_->end();
  return tables_.end();
}

// A node that makes no map has no tables of one.
void Recorder::Files::publish() {
  for (std::size_t i = 0; i < of.size(); ++i) {
    const bool of_map = i >= static_cast<std::size_t>(Table::kMap);
    if (of_map && writes_[i] <= 1)
      of[i].withdraw();
    else
      of[i].publish();
  }
}

void Recorder::publish() {
  files_.publish();
  if (raw_) raw_->publish();
}

const Recorder::Totals& Recorder::finish() {
  end();
  publish();
  return totals();
}

}  // namespace tetap::sim
