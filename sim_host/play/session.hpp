// SPDX-License-Identifier: Apache-2.0
// One run of a node seen from the host: the sink that records, compares and shows progress. At the end it puts the
// result into run.json, one line and the exit status.
#pragma once

#include "hal/board/linux/clock.hpp"
#include "sim_host/play/out_file.hpp"
#include "sim_host/play/recorder.hpp"
#include "sim_host/replay/frame_accounting.hpp"
#include "sim_host/replay/line.hpp"
#include "sim_host/replay/link.hpp"
#include "sim_host/replay/recording.hpp"

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace tetap::sim {

struct SessionOptions {
  std::string program;  ///< for messages
  std::string version;  ///< version of the program
  std::string folder;
  std::uint32_t base = 0x300;
  bool raw = false;
  std::string mode;  ///< lockstep, realtime, as-recorded
  std::string bus;   ///< interface, or memory
  std::string robot;
  std::string log;           ///< path, or what was simulated
  std::uint64_t ticks = 0;   ///< expected, for the progress line; 0: unknown
  double bitrate = 500'000;  ///< for the bus load
  bool quiet = false;
};

/// The folder is this session's alone. Its files have their names once all of them are whole, run.json last. Results
/// made of the files before them (summary, report) are removed then.
class Session {
 public:
  /// `comparison`: every epoch goes there too; it has to outlive the session. Throws when another run has the folder.
  explicit Session(const SessionOptions& options, Comparison* comparison = nullptr);

  void restarted() { recorder_.restarted(); }
  void sent(const base::CanFrame& frame) { recorder_.sent(frame); }
  void received(const base::CanFrame& frame) { recorder_.received(frame); }
  void epoch(const NodeEpoch& epoch, base::Micros time) {
    recorder_.epoch(epoch, time);
    if (comparison_ != nullptr) comparison_->epoch(epoch, time);
    if (recorder_.totals().epochs % 64 == 0) show_progress();
  }

  [[nodiscard]] Counts& counts() { return counts_; }
  [[nodiscard]] Recorder& recorder() { return recorder_; }
  /// Another line for run.json: `value` is JSON (a number, or a quoted string).
  void note(std::string key, std::string value) { notes_.emplace_back(std::move(key), std::move(value)); }

  /// Another file of this run, which has ended: it gets its name with the others.
  void add(OutFile file) { files_.push_back(std::move(file)); }

  /// Plays with `play()`, whose failure becomes a message; then `complete()` may add files. Returns the exit status:
  /// 0; 1 when frames were lost, came twice, or differ from the recording; 128 and the signal's number when one ended
  /// the run.
  template <class Play, class Complete>
  int run(Play&& play, Complete&& complete) {
    if (const Result<> played = play(); !played) error_ = played.failure().text;
    complete();
    return finish();
  }
  template <class Play>
  int run(Play&& play) {
    return run(std::forward<Play>(play), [] {});
  }
  int finish();

 private:
  void show_progress();
  void write_json(OutFile& file, double wall_s);
  void publish(OutFile& json);

  SessionOptions options_;
  FolderLock lock_;
  Recorder recorder_;
  Comparison* comparison_;
  Counts counts_;
  std::vector<std::pair<std::string, std::string>> notes_;
  std::vector<OutFile> files_;
  std::string error_;
  base::Micros began_ = hal::monotonic_clock();
  base::Micros shown_ = began_;
  bool terminal_ = false;
};

}  // namespace tetap::sim
