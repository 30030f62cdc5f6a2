// SPDX-License-Identifier: Apache-2.0
// tetap-inject: puts one fault into a candump log, recorded or simulated, and writes the log that results.
#include "sim_host/matrix/cell.hpp"
#include "sim_host/play/arguments.hpp"
#include "sim_host/play/candump.hpp"
#include "sim_host/play/log.hpp"
#include "sim_host/robots.hpp"

#include <cstdio>
#include <exception>
#include <string>
#include <vector>

namespace {

using namespace tetap;

const char* const kHelp =
    "usage: tetap-inject LOG OUT --fault \"SENSOR AXIS KIND\" --at S [OPTION]...\n\n"
    "Writes LOG with one fault to OUT. Sensors, axes and kinds are those of tetap-matrix.\n\n"
    "  --at S          begin of the fault, seconds after the log's first frame\n"
    "  --for S         its duration (default: that of its kind in the fault matrix)\n"
    "  --size X        rad/s, m/s2, m/s, m, uT, Pa, rad; s of stamps and delays; the factor of a scale (default 0)\n"
    "  --velocity X    m/s, beside the position's --size of gnss_both (default 0)\n"
    "  --robot NAME    whose mounting and wheels these are (default rover)\n"
    "  --base ID       first id of the node's block (default 0x300)\n"
    "  --dbc FILE      default config/tetap.dbc\n";

int run(sim::Arguments& arguments) {
  const std::string robot = arguments.text("--robot").value_or("rover");
  const auto given = arguments.text("--fault");
  if (!given) throw sim::UsageError("--fault is missing (--help)");
  sim::FrameFault fault = sim::CellRequest("given " + *given + " -").fault;
  const double at_s = arguments.real("--at", -1, 0, 1e7);
  const double for_s = arguments.real("--for", 0, 0.001, 1e6);
  fault.size = arguments.real("--size", 0, -1e9, 1e9);
  fault.velocity_mps = arguments.real("--velocity", 0, -1e3, 1e3);
  if (for_s > 0) fault.duration = {static_cast<std::int64_t>(for_s * 1e6)};
  sim::CleanLog about;
  about.parameters = sim::parameters_of(robot);
  sim::FrameGeometry geometry = sim::geometry_of(about);
  geometry.base = arguments.base("--base", 0x300);
  const sim::BusDatabase dbc(arguments.text("--dbc").value_or("config/tetap.dbc"));
  const auto log_name = arguments.positional();
  const auto out_name = arguments.positional();
  arguments.finish();
  if (!log_name || !out_name || at_s < 0) throw sim::UsageError("LOG, OUT and --at are needed (--help)");

  sim::LogFile log(*log_name, {.interface = {}, .base = geometry.base});
  std::vector<sim::TimedFrame> frames;
  for (sim::TimedFrame frame; log.next(frame);) frames.push_back(frame);
  if (frames.empty()) throw std::runtime_error(*log_name + ": no frames");
  fault.start = frames.front().time + base::Micros{static_cast<std::int64_t>(at_s * 1e6)};
  for (const sim::TimedFrame& f : frames)
    if (const auto* message = dbc.at(f.frame.id - geometry.base); message != nullptr && message->name == "In_GnssLat")
      geometry.latitude_deg = message->find("GnssLat_Lat")->value(f.frame);
  const sim::Faulted faulted = sim::put_fault(frames, fault, geometry, dbc);
  sim::OutFile out(*out_name);
  sim::Line line;
  for (const sim::TimedFrame& f : faulted.frames) {
    line.clear();
    sim::append_log_line(line, f.time, "vcan0", f.frame);
    out.write(line.view());
  }
  out.close();
  std::printf("%llu frames changed\n", static_cast<unsigned long long>(faulted.changed));
  if (faulted.changed > 0) return 0;
  std::fprintf(stderr, "tetap-inject: no frame of %s has that fault\n", log_name->c_str());
  return 1;
}

}  // namespace

int main(int argc, char** argv) try {
  sim::Arguments arguments(argc, argv);
  if (arguments.flag("--help") || arguments.flag("-h"))
    return std::printf("%srobots: %s\n", kHelp, sim::kRobotNames.c_str()), 0;
  return run(arguments);
} catch (const std::exception& error) {
  std::fprintf(stderr, "tetap-inject: %s\n", error.what());
  return 2;
}
