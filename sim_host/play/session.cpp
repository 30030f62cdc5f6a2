// SPDX-License-Identifier: Apache-2.0
#include "sim_host/play/session.hpp"

#include "sim_host/play/interruption.hpp"
#include "sim_host/replay/complaint.hpp"
#include "sim_host/replay/line.hpp"
#include "sim_host/replay/names.hpp"

#include <unistd.h>

#include <cstdio>
#include <filesystem>

namespace tetap::sim {

namespace {

std::string number(double value, int decimals) {
  Line line;
  line.real(value, decimals);
  return line.view().empty() ? "null" : std::string(line.view());
}

/// "GnssEast 99.8 m, 1 sigma 0.4 m, probability 0.998, 31.2 s after the start"
std::string fault_words(const bus::EstOriginFault& fault, base::Micros after) {
  Line line;
  const std::string_view in = unit(fault.fault_unit);
  line.text(name(fault.fault_row)).put(' ').real(static_cast<double>(fault.fault_size), 4).put(' ').text(in);
  line.text(", 1 sigma ").real(static_cast<double>(fault.fault_std), 4).put(' ').text(in);
  line.text(", probability ").real(static_cast<double>(fault.fault_prob), 3);
  line.text(", ").real(static_cast<double>(after.us) * 1e-6, 1).text(" s after the start");
  return std::string(line.view());
}

double to_seconds(base::Micros span) { return static_cast<double>(span.us) * 1e-6; }

}  // namespace

Session::Session(const SessionOptions& options, Comparison* comparison)
    : options_(options),
      lock_(options.folder),
      recorder_({.folder = options.folder,
                 .base = options.base,
                 .raw = options.raw,
                 .interface = options.bus == "memory" ? "vcan0" : options.bus}),
      comparison_(comparison),
      terminal_(isatty(STDERR_FILENO) == 1) {}

void Session::show_progress() {
  const base::Micros now = hal::monotonic_clock();
  if (options_.quiet || now - shown_ < base::Micros{terminal_ ? 250'000 : 5'000'000}) return;
  shown_ = now;
  const Recorder::Totals& t = recorder_.totals();
  const double played = to_seconds(t.last - t.first);
  const double share =
      options_.ticks > 0 ? 100.0 * static_cast<double>(t.epochs) / static_cast<double>(options_.ticks) : 0;
  Line line;
  if (terminal_) line.put('\r');
  line.text(options_.program).text(": ").real(played, 1).text(" s played");
  if (options_.ticks > 0) line.text(", ").real(share, 0).text(" %");
  line.text(", ")
      .real(played / to_seconds(now - began_), 1)
      .text(" x real time, ")
      .integer(static_cast<std::int64_t>(counts_.lost()));
  line.text(" frames lost ").text(terminal_ ? "  " : "\n");
  std::fwrite(line.view().data(), 1, line.view().size(), stderr);
}

int Session::finish() {
  const double wall_s = to_seconds(hal::monotonic_clock() - began_);
  recorder_.end();
  OutFile json(options_.folder + "/run.json");
  write_json(json, wall_s);
  publish(json);
  if (terminal_ && !options_.quiet) std::fputs("\r\033[K", stderr);
  const std::string wrong = error_.empty() ? complaint(counts_, comparison_) : error_;
  const int signal = error_.empty() ? 0 : Interruption::signal();
  // Whoever sends TERM has a reason to print.
  if (!wrong.empty() && signal != SIGTERM) std::fprintf(stderr, "%s: %s\n", options_.program.c_str(), wrong.c_str());
  if (signal != 0) return 128 + signal;
  return wrong.empty() ? 0 : 1;
}

void Session::publish(OutFile& json) {
  // Whatever ends this program in between, there is no summary beside data of another run.
  for (const char* name : {"summary.json", "report.html", "doctor.json", "run.json"})
    std::filesystem::remove(options_.folder + "/" + name);
  recorder_.publish();
  for (OutFile& file : files_) file.publish();
  json.publish();
}

void Session::write_json(OutFile& file, double wall_s) {
  const Recorder::Totals& t = recorder_.totals();
  const double duration_s = t.epochs > 0 ? to_seconds(t.last - t.first) : 0;
  const auto load = [&](std::uint64_t bits) {
    return number(duration_s > 0 ? 100.0 * static_cast<double>(bits) / (duration_s * options_.bitrate) : 0, 2);
  };
  const auto count = [](std::uint64_t n) { return std::to_string(n); };
  Line crc;
  crc.hex(t.state_crc, 8);
  std::vector<std::pair<std::string, std::string>> fields{
      {"version", sim::quoted(options_.version)},
      {"mode", sim::quoted(options_.mode)},
      {"bus", sim::quoted(options_.bus)},
      {"robot", sim::quoted(options_.robot)},
      {"log", sim::quoted(options_.log)},
      {"frames_in", count(counts_.inputs)},
      {"frames_lost", count(counts_.lost())},
      {"frames_lost_in", count(counts_.lost_inputs)},
      {"frames_lost_out", count(counts_.lost_outputs)},
      {"frames_extra", count(counts_.extra())},
      {"frames_out", count(counts_.outputs)},
      {"estimates_out", count(t.estimates)},
      {"epochs", count(t.epochs)},
      {"duration_s", number(duration_s, 3)},
      {"wall_s", number(wall_s, 3)},
      {"times_realtime", number(wall_s > 0 ? duration_s / wall_s : 0, 2)},
      {"bus_load_percent", load(t.bits_sent + t.bits_received)},
      {"node_load_percent", load(t.bits_received)},
      {"estimates_sha256", sim::quoted(t.estimates_sha256)},
      {"state_crc_last", sim::quoted(crc.view())},
  };
  if (t.fault) fields.emplace_back("likeliest_fault", sim::quoted(fault_words(*t.fault, t.fault_time - t.first)));
  if (comparison_ != nullptr) {
    fields.emplace_back("epochs_compared", count(comparison_->compared()));
    fields.emplace_back("epochs_different", count(comparison_->different()));
    fields.emplace_back("unlogged", count(comparison_->recording().unlogged));
    const auto& hole = comparison_->recording().hole;
    fields.emplace_back("hole_s", hole ? number(to_seconds(hole->time), 3) : "null");
    fields.emplace_back("hole", sim::quoted(hole ? hole->why : ""));
    fields.emplace_back("first_difference", sim::quoted(comparison_->first_difference()));
  }
  fields.insert(fields.end(), notes_.begin(), notes_.end());
  if (!error_.empty()) fields.emplace_back("error", sim::quoted(error_));
  file.write("{\n");
  for (std::size_t i = 0; i < fields.size(); ++i)
    file.write("  " + sim::quoted(fields[i].first) + ": " + fields[i].second + (i + 1 < fields.size() ? ",\n" : "\n"));
  file.write("}\n");
  file.end();
}

}  // namespace tetap::sim
