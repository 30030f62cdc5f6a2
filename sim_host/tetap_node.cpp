// SPDX-License-Identifier: Apache-2.0
// tetap-node: the firmware as a Linux program on SocketCAN. It stands in for the board.
#include "hal/board/linux/memory_can.hpp"
#include "hal/board/linux/socket_can.hpp"
#include "hal/chip/support/boot_line.hpp"
#include "node/accepted_frames.hpp"
#include "sim_host/play/arguments.hpp"
#include "sim_host/robot_firmware.hpp"
#include "sim_host/robots.hpp"
#include "version.hpp"

#include <csignal>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <memory>
#include <string>

namespace {

volatile std::sig_atomic_t stop_requested = 0;
void request_stop(int) { stop_requested = 1; }

std::string help() {
  return R"(usage: tetap-node [OPTION]...

The firmware as a Linux program on SocketCAN. Ends on INT or TERM with status 0.

  --can IFACE    the interface (default vcan0)
  --robot NAME   what it is (default rover):
                 )" +
         tetap::sim::kRobotNames + R"(
  --base ID      first id of the node's block of 64 (default: can_base of the parameters)
)" + std::string(tetap::sim::kParameterHelp) +
         R"(
  --list-robots  print the names of the robots, nothing else
  --boot-line    print what a flash image of this robot says of its core at boot, nothing else
)";
}

template <class Estimators>
void run(const std::string& robot, const std::string& interface, const tetap::param::Parameters& parameters) {
  tetap::hal::SocketCan bus(interface, {.accept = tetap::node::accepted_by<Estimators>(parameters)});
  std::fprintf(stderr, "tetap-node: robot %s on %s, ids %03X to %03X, version %s\n", robot.c_str(), interface.c_str(),
               parameters.can_base, parameters.can_base + 0x3F, tetap::hal::version_text(tetap::version()).c_str());
  tetap::sim::CanAdapter can(bus);
  tetap::sim::HostBoard board(can);
  const auto firmware = tetap::sim::make_firmware<Estimators>(board, parameters, tetap::version());
  while (stop_requested == 0) {
    firmware->poll();
    bus.wait(tetap::base::Micros{500});
  }
}

/// Prints as a board does.
struct Console {
  static void print(const char* text) { std::fputs(text, stdout); }
};

template <class Estimators>
void print_boot_line(const std::string& robot, const tetap::param::Parameters& parameters) {
  tetap::hal::MemoryBus bus;
  tetap::hal::MemoryCan end = bus.node_end();
  tetap::sim::CanAdapter can(end);
  tetap::sim::HostBoard board(can);
  const auto firmware = tetap::sim::make_firmware<Estimators>(board, parameters, tetap::bus::Version{});
  tetap::hal::print_boot_line(Console{}, robot.c_str(), *firmware);
}

}  // namespace

int main(int argc, char** argv) try {
  tetap::sim::Arguments arguments(argc, argv);
  if (arguments.flag("--help") || arguments.flag("-h")) return std::fputs(help().c_str(), stdout), 0;
  const bool list_robots = arguments.flag("--list-robots");
  const std::string interface = arguments.text("--can").value_or("vcan0");
  const std::string robot = arguments.text("--robot").value_or("rover");
  const tetap::sim::ParameterSettings settings(arguments);
  const std::uint32_t base = arguments.base("--base", settings.can_base());
  const bool boot_line = arguments.flag("--boot-line");
  arguments.finish();
  if (list_robots) return std::printf("%s\n", tetap::sim::kRobotNames.c_str()), 0;
  std::signal(SIGINT, request_stop);
  std::signal(SIGTERM, request_stop);
  tetap::sim::for_robot(robot, settings,
                        [&]<class Estimators>(std::type_identity<Estimators>, tetap::param::Parameters parameters) {
                          if (boot_line) return print_boot_line<Estimators>(robot, parameters);
                          parameters.can_base = base;
                          tetap::sim::require_map_ids<Estimators>(robot, base);
                          run<Estimators>(robot, interface, parameters);
                        });
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "tetap-node: %s\n", error.what());
  return 2;
}
