// SPDX-License-Identifier: Apache-2.0
// tetap-node: the firmware as a Linux program on SocketCAN. It stands in for the board.
#include "hal/board/linux/memory_can.hpp"
#include "hal/board/linux/socket_can.hpp"
#include "hal/chip/support/boot_line.hpp"
#include "sim_host/play/arguments.hpp"
#include "sim_host/robot_firmware.hpp"
#include "sim_host/robots.hpp"
#include "tetap/firmware/accepted_frames.hpp"
#include "tetap/firmware/canopen/ids.hpp"
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
         tetap::sim::robot_names() + R"(
  --base ID      first id of the node's block of 64 (default: can_base of the parameters)
)" + std::string(tetap::sim::kParameterHelp) +
         R"(
  --canopen ID   speak SDO (CiA 301) as CANopen node ID, for robots that take parameters from the bus
  --list-robots  print the names of the robots, nothing else
  --boot-line    print what a flash image of this robot says of its core at boot, nothing else
)";
}

void run(const tetap::sim::Robot& robot, const std::string& interface, const tetap::param::Parameters& parameters,
         std::uint8_t node_id) {
  tetap::hal::SocketCan bus(interface,
                            {.accept = tetap::firmware::with_requests(
                                 tetap::firmware::accepted_by(robot.takes.needs_map_ids(), parameters), node_id)});
  std::fprintf(stderr, "tetap-node: robot %s on %s, ids %03X to %03X, version %s\n", robot.name, interface.c_str(),
               parameters.can_base, parameters.can_base + 0x3F, tetap::hal::version_text(tetap::version()).c_str());
  tetap::sim::CanAdapter can(bus);
  tetap::sim::HostBoard board(can);
  board.node_id = node_id;
  const auto firmware = robot.make_firmware(board, parameters, tetap::version());
  while (stop_requested == 0) {
    firmware->poll();
    bus.wait(tetap::base::Micros{500});
  }
}

void require_canopen(const tetap::sim::Robot& robot, std::uint8_t node_id, std::uint32_t base) {
  if (node_id == 0) return;
  if (!robot.takes.parameters)
    throw tetap::sim::UsageError(std::string("--canopen: robot ") + robot.name + " takes no parameters from the bus");
  if (!tetap::firmware::canopen::is_node_id(node_id, base))
    throw tetap::sim::UsageError(std::string("--canopen has to be ") + tetap::firmware::canopen::kNodeIdRule);
}

/// Prints as a board does.
struct Console {
  static void print(const char* text) { std::fputs(text, stdout); }
};

void print_boot_line(const tetap::sim::Robot& robot, const tetap::param::Parameters& parameters) {
  tetap::hal::MemoryBus bus;
  tetap::hal::MemoryCan end = bus.node_end();
  tetap::sim::CanAdapter can(end);
  tetap::sim::HostBoard board(can);
  const auto firmware = robot.make_firmware(board, parameters, tetap::bus::Version{});
  tetap::hal::print_boot_line(Console{}, robot.name, *firmware);
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
  const auto node_id =
      static_cast<std::uint8_t>(arguments.integer("--canopen", 0, 1, tetap::firmware::canopen::kMostNodeId));
  arguments.finish();
  if (list_robots) return std::printf("%s\n", tetap::sim::robot_names().c_str()), 0;
  std::signal(SIGINT, request_stop);
  std::signal(SIGTERM, request_stop);
  const tetap::sim::Robot& chosen = tetap::sim::robot_named(robot);
  tetap::param::Parameters parameters = tetap::sim::parameters_of(robot, settings);
  if (boot_line) return print_boot_line(chosen, parameters), 0;
  parameters.can_base = base;
  tetap::sim::require_map_ids(chosen, base);
  require_canopen(chosen, node_id, base);
  run(chosen, interface, parameters, node_id);
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "tetap-node: %s\n", error.what());
  return 2;
}
