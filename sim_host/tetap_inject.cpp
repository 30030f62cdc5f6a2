// SPDX-License-Identifier: Apache-2.0
// tetap-inject: puts one fault into a candump log, recorded or simulated, and writes the log that results.
#include "sim_host/doctor/bus_time.hpp"
#include "sim_host/matrix/cell.hpp"
#include "sim_host/play/arguments.hpp"
#include "sim_host/play/log_file.hpp"
#include "sim_host/play/play.hpp"
#include "sim_host/replay/candump.hpp"
#include "sim_host/replay/log.hpp"
#include "sim_host/replay/node_link.hpp"
#include "sim_host/robots.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

using namespace tetap;

const char* const kHelp =
    "usage: tetap-inject LOG OUT --fault \"SENSOR AXIS KIND\" --at S [OPTION]...\n\n"
    "Writes LOG with one fault to OUT, or nothing where no frame has that fault. Robot time is that of In_Sync,\n"
    "else of Est_Epoch, else the time of reception.\n\n"
    "  --at S          begin of the fault: seconds of robot time after the log's begin\n"
    "  --for S         its duration (default: that of its kind in the fault matrix)\n"
    "  --size X        rad/s, m/s2, m/s, m, uT, Pa, rad; s of stamps and delays; the factor of a scale (default 0)\n"
    "  --velocity X    m/s, beside the position's --size of gnss_both (default 0)\n"
    "  --robot NAME    whose mounting and wheels these are (default rover)\n"
    "  --base ID       first id of the node's block (default 0x300)\n"
    "  --dbc FILE      default config/tetap.dbc\n";

void print_help() {
  std::printf("%s\nsensors and their axes:\n", kHelp);
  for (const sim::FaultSensor& one : sim::kFaultSensors)
    std::printf("  %-16s %s\n", std::string(one.name).c_str(), std::string(one.axes).c_str());
  std::printf("kinds (a spike with its number of samples: spike2): %s\nkinds of frames: %s\nrobots: %s\n",
              std::string(sim::kValueKinds).c_str(), std::string(sim::kFrameKinds).c_str(), sim::robot_names().c_str());
}

sim::FrameFault fault_of(const std::string& given) {
  sim::FrameFault fault;
  std::istringstream words(given);
  std::string kind, left;
  if (!(words >> fault.sensor >> fault.axis >> kind) || words >> left)
    throw sim::UsageError("--fault needs \"SENSOR AXIS KIND\", not '" + given + "' (--help lists them)");
  sim::set_kind(fault, kind);
  sim::require_known(fault);
  return fault;
}

std::vector<sim::TimedFrame> frames_of(const std::string& path, std::uint32_t base) {
  sim::LogFile log(path, {.interface = {}, .base = base});
  std::vector<sim::TimedFrame> frames;
  bool inputs = false;
  for (sim::TimedFrame one; log.next(one);) {
    inputs = inputs || sim::is_counted_input(one.frame, base);
    frames.push_back(one);
  }
  if (frames.empty()) throw std::runtime_error(path + ": " + sim::no_data_frame(log.report()));
  if (!inputs) throw std::runtime_error(path + ": no input frames of this id base");
  sim::warn_about(log.report(), "tetap-inject");
  return frames;
}

/// Robot time of each frame. It never goes back, so frames keep their order.
class RobotTime {
 public:
  RobotTime(const std::vector<sim::TimedFrame>& frames, std::uint32_t base) : frames_(frames) {
    bool steps = false, syncs = false, epochs = false;
    for (const sim::TimedFrame& f : frames) {
      const auto offset = sim::offset_in_block(f.frame, base);
      epochs = epochs || offset == bus::EstEpoch::kOffset;
      if (offset != bus::InSync::kOffset) continue;
      const auto sync = bus::decode<bus::InSync>(bus::payload(f.frame));
      syncs = syncs || sync.has_value();
      steps = steps || (sync && sync->kind == bus::SyncKind::kStep);
    }
    const auto source = syncs    ? doctor::ClockSource::kSync
                        : epochs ? doctor::ClockSource::kEpochs
                                 : doctor::ClockSource::kLog;
    clock_ = syncs ? "In_Sync" : epochs ? "Est_Epoch" : "the time of reception";
    doctor::BusTime clock(source, base, steps);
    std::size_t unknown = 0;
    for (const sim::TimedFrame& f : frames) {
      clock.add(f.time, f.frame);
      unknown += clock.known() ? 0 : 1;
      if (times_.size() > unknown) note_return(times_.back(), clock.now());
      times_.push_back(times_.size() > unknown ? std::max(times_.back(), clock.now()) : clock.now());
    }
    for (std::size_t i = 0; i < unknown && unknown < times_.size(); ++i) times_[i] = times_[unknown];
  }

  [[nodiscard]] base::Micros begin() const { return times_.front(); }
  [[nodiscard]] base::Micros end() const { return times_.back(); }
  [[nodiscard]] const char* clock() const { return clock_; }
  /// The longest way back of the clock, as of a node that began anew, and the robot time before it.
  [[nodiscard]] base::Micros longest_return() const { return longest_return_; }
  [[nodiscard]] base::Micros return_begin() const { return return_begin_; }
  [[nodiscard]] std::vector<sim::TimedFrame> frames() const {
    std::vector<sim::TimedFrame> moved = frames_;
    for (std::size_t i = 0; i < moved.size(); ++i) moved[i].time = times_[i];
    return moved;
  }
  /// Time of reception at a robot time: of the frame itself, or of one that was delayed to between two others.
  [[nodiscard]] base::Micros received(std::size_t origin, base::Micros time) const {
    if (time == times_[origin]) return frames_[origin].time;
    const auto behind = std::upper_bound(times_.begin(), times_.end(), time);
    if (behind == times_.end()) return frames_.back().time + (time - times_.back());
    const auto k = static_cast<std::size_t>(behind - times_.begin());
    const base::Micros at = frames_[k].time - (times_[k] - time);
    return k > 0 ? std::max(at, frames_[k - 1].time) : at;
  }

 private:
  void note_return(base::Micros before, base::Micros now) {
    if (before - now <= longest_return_) return;
    longest_return_ = before - now;
    return_begin_ = before;
  }

  const std::vector<sim::TimedFrame>& frames_;
  std::vector<base::Micros> times_;
  base::Micros longest_return_, return_begin_;
  const char* clock_ = "";
};

void write(const std::string& path, const sim::Faulted& faulted, const RobotTime& time) {
  sim::OutFile out(path);
  try {
    sim::Line line;
    for (std::size_t i = 0; i < faulted.frames.size(); ++i) {
      const sim::TimedFrame& f = faulted.frames[i];
      line.clear();
      sim::append_log_line(line, time.received(faulted.origins[i], f.time), "vcan0", f.frame);
      out.write(line.view());
    }
    out.close();
  } catch (...) {
    out.discard();
    throw;
  }
}

/// Robot time stands still in a second run until it is where the first ended: a fault that lasts until then has all of
/// it.
void refuse_second_run(const std::string& log, const RobotTime& time, const sim::FrameFault& fault) {
  constexpr base::Micros kStep{1'000'000};  // a smaller way back is a step of one clock
  if (time.longest_return() <= kStep) return;
  const std::string found = log + ": " + time.clock() + " goes back by " + sim::in_seconds(time.longest_return()) +
                            " at " + sim::in_seconds(time.return_begin() - time.begin()) +
                            " after the begin. The log may hold two runs. ";
  if (fault.start + fault.duration > time.return_begin())
    throw std::runtime_error(found + "The fault would last until the second one; split the log");
  std::fprintf(stderr, "tetap-inject: warning: %sThe fault is in the first one\n", found.c_str());
}

int run(sim::Arguments& arguments) {
  const std::string robot = arguments.text("--robot").value_or("rover");
  const auto given = arguments.text("--fault");
  const double at_s = arguments.real("--at", -1, 0, 1e7);
  const double for_s = arguments.real("--for", 0, 0.001, 1e6);
  const double size = arguments.real("--size", 0, -1e9, 1e9);
  const double velocity_mps = arguments.real("--velocity", 0, -1e3, 1e3);
  const std::uint32_t first_id = arguments.base("--base", 0x300);
  const std::string dbc_name = arguments.text("--dbc").value_or("config/tetap.dbc");
  const auto log_name = arguments.positional();
  const auto out_name = arguments.positional();
  arguments.finish();
  if (!log_name || !out_name) throw sim::UsageError("LOG and OUT are needed (--help says more)");
  if (!given || at_s < 0)
    throw sim::UsageError(std::string(given ? "--at" : "--fault") + " is missing (--help says more)");
  sim::FrameFault fault = fault_of(*given);
  fault.size = size;
  fault.velocity_mps = velocity_mps;
  if (fault.kind == sim::FaultKind::kDelayed && size <= 0) throw sim::UsageError("a delay needs --size, in s");
  if (for_s > 0) fault.duration = {static_cast<std::int64_t>(for_s * 1e6)};
  sim::CleanLog about;
  about.parameters = sim::parameters_of(robot);
  sim::FrameGeometry geometry = sim::geometry_of(about);
  geometry.base = first_id;
  const sim::BusDatabase dbc(dbc_name);

  const std::vector<sim::TimedFrame> frames = frames_of(*log_name, first_id);
  const RobotTime time(frames, first_id);
  fault.start = time.begin() + base::Micros{static_cast<std::int64_t>(at_s * 1e6)};
  if (fault.start > time.end())
    throw std::runtime_error("--at is " + sim::in_seconds(fault.start - time.begin()) + ": " + *log_name + " ends " +
                             sim::in_seconds(time.end() - time.begin()) + " after its begin, by " + time.clock());
  refuse_second_run(*log_name, time, fault);
  for (const sim::TimedFrame& f : frames)
    if (const auto* message = dbc.at(f.frame.id - first_id); message != nullptr && message->name == "In_GnssLat")
      geometry.latitude_deg = message->find("GnssLat_Lat")->value(f.frame);
  const sim::Faulted faulted = sim::put_fault(time.frames(), fault, geometry, dbc);
  if (faulted.changed == 0) {
    const base::Micros from = fault.start - time.begin();
    std::fprintf(stderr, "tetap-inject: %s: no frame has '%s' from %s to %s; nothing is written\n", log_name->c_str(),
                 given->c_str(), sim::in_seconds(from).c_str(), sim::in_seconds(from + fault.duration).c_str());
    return 1;
  }
  write(*out_name, faulted, time);
  std::printf("%llu frames changed\n", static_cast<unsigned long long>(faulted.changed));
  return 0;
}

}  // namespace

int main(int argc, char** argv) try {
  sim::Arguments arguments(argc, argv);
  if (arguments.flag("--help") || arguments.flag("-h")) return print_help(), 0;
  return run(arguments);
} catch (const std::exception& error) {
  std::fprintf(stderr, "tetap-inject: %s\n", error.what());
  return 2;
}
