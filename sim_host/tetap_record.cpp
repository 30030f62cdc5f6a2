// SPDX-License-Identifier: Apache-2.0
// tetap-record: writes down everything on a CAN interface (raw.log) and one node's output (estimates.log and CSV
// files) until it is interrupted.
#include "hal/board/linux/socket_can.hpp"
#include "hal/chip/support/boot_line.hpp"
#include "sim_host/play/arguments.hpp"
#include "sim_host/play/interruption.hpp"
#include "sim_host/play/session.hpp"
#include "sim_host/play/snapshot_request.hpp"
#include "version.hpp"

#include <cstdio>
#include <exception>
#include <optional>
#include <string>

namespace {

using namespace tetap;

constexpr const char* kHelp = R"(usage: tetap-record [--can IFACE] [OPTION]...

Records a CAN interface until interrupted (^C, SIGTERM): everything as candump would (raw.log), and what a node says
(estimates.log, estimates.csv, innovations.csv, status.csv, sources.csv, run.json). Until then their names end in .part.

  --can IFACE     (default vcan0)
  --base ID       first id of the node's block (default 0x300)
  --out DIR       (default out/record)
  --duration S    stop by itself after so many seconds
  --snapshot      ask a node that runs already for its state (one Cmd_Reset), so that the log can be repeated from there;
                  without it nothing is sent
  --quiet         no progress line

Exit status: 0; 1 frames were lost; 2 bad usage or no bus.
)";

int record(sim::Arguments& arguments) {
  const std::string interface = arguments.text("--can").value_or("vcan0");
  const sim::SessionOptions about{.program = "tetap-record",
                                  .version = hal::version_text(version()).c_str(),
                                  .folder = arguments.text("--out").value_or("out/record"),
                                  .base = arguments.base(),
                                  .raw = true,
                                  .mode = "record",
                                  .bus = interface,
                                  .quiet = arguments.flag("--quiet")};
  const bool ask = arguments.flag("--snapshot");
  const base::Micros duration{static_cast<std::int64_t>(arguments.real("--duration", 0, 0, 1e7) * 1e6)};
  arguments.finish();
  hal::SocketCan can(interface, {.arrival_times = true});
  sim::Session session(about);
  sim::EpochCollector collector(about.base);
  sim::RealtimeFrameAccounting accounting(session.counts());
  sim::SnapshotRequest snapshot(about.base);
  const auto counter = static_cast<std::uint32_t>(hal::wall_clock().us / 1'000'000 & 0x0F);
  const base::Micros began = hal::monotonic_clock();
  base::Micros written = began;
  while (sim::Interruption::signal() == 0 && (duration.us == 0 || hal::monotonic_clock() - began < duration)) {
    can.wait({100'000});
    while (const auto frame = can.receive()) {
      session.recorder().received(*frame, can.last_arrival());
      if (collector.is_begin_response(*frame)) {  // the node starts anew
        accounting.begin(true);
        session.restarted();
      }
      const auto epoch = collector.add(*frame);
      snapshot.note(*frame, epoch);
      if (epoch) {
        accounting.answered(*epoch);
        session.epoch(*epoch, {epoch->head ? static_cast<std::int64_t>(epoch->head->time_us)
                                           : session.recorder().totals().last.us});
      }
    }
    const base::Micros now = hal::monotonic_clock();
    if (const auto command = ask ? snapshot.due(now, counter) : std::nullopt; command && can.send(*command)) {
      can.flush();
      session.recorder().received(*command, hal::wall_clock());  // no socket shows its own frames
    }
    if (now - written < base::Micros{1'000'000}) continue;
    session.recorder().flush();
    written = now;
  }
  session.counts().overflows = can.faults().rx_overflow;
  if (session.counts().lost_outputs < session.counts().overflows)
    session.counts().lost_outputs = session.counts().overflows;
  if (ask) session.note("snapshot", sim::quoted(snapshot.outcome()));
  session.note("interface_down", std::to_string(can.faults().bus_off));
  return session.finish();
}

}  // namespace

int main(int count, char** values) {
  sim::Interruption::expect();
  try {
    sim::Arguments arguments(count, values);
    if (arguments.flag("--help") || arguments.flag("-h")) return std::fputs(kHelp, stdout), 0;
    return record(arguments);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "tetap-record: %s\n", error.what());
    return 2;
  }
}
