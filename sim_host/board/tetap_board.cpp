// SPDX-License-Identifier: Apache-2.0
// tetap-board: executes a flash image on the emulated ARK CANnode in virtual time; the bus goes to a log, the console
// to the standard output. Any complaint of a model fails the run.
#include "sim_host/board/ark_cannode.hpp"
#include "sim_host/board/machine.hpp"
#include "sim_host/play/arguments.hpp"
#include "sim_host/play/candump.hpp"
#include "sim_host/play/out_file.hpp"

#include <cmath>
#include <cstdio>
#include <exception>
#include <memory>
#include <string>

namespace {

using namespace tetap;

constexpr const char* kHelp =
    "usage: tetap-board [OPTION]... IMAGE.elf\n\nExecutes the machine code of IMAGE on an emulated ARK CANnode.\n\n"
    "  --seconds S        virtual time (default 10)\n"
    "  --log FILE         frames of the bus, as candump -L writes them\n"
    "  --cpi C            cycles of an instruction, 1.0 to 4.0 (default 1.5)\n"
    "  --lsi HZ           oscillator of the watchdog, 17000 to 47000 (default 32000)\n"
    "  --imu-clock-ppm P  error of the IMU's clock (default 0)\n"
    "  --no-crystal       HSE never starts\n"
    "  --no-imu           nothing answers on SPI1\n"
    "  --no-partner       no other node acknowledges\n"
    "  --check-alignment  looks at every instruction for accesses that must be aligned; slow\n\n"
    "Exit status: 0; 1 the models complain or the core locked up; 2 the command line or a file is wrong.\n";

struct Options {
  board::BoardOptions board;
  board::MachineOptions machine;
  double seconds = 10;
  std::string log, image;
  bool partner = true;
};

Options parse(sim::Arguments& arguments) {
  Options options;
  options.seconds = arguments.real("--seconds", 10, 0.001, 1e6);
  options.log = arguments.text("--log").value_or("");
  options.machine.cpi_percent = static_cast<int>(std::lround(100 * arguments.real("--cpi", 1.5, 1, 4)));
  options.board.oscillators.lsi_hz = static_cast<std::int64_t>(arguments.integer("--lsi", 32'000, 17'000, 47'000));
  options.board.imu.clock_error = 1e-6 * arguments.real("--imu-clock-ppm", 0, -50'000, 50'000);
  options.board.oscillators.crystal = !arguments.flag("--no-crystal");
  options.board.imu_present = !arguments.flag("--no-imu");
  options.partner = !arguments.flag("--no-partner");
  options.machine.check_alignment = arguments.flag("--check-alignment");
  const auto image = arguments.positional();
  arguments.finish();
  if (!image) throw sim::UsageError("no image is named (--help)");
  options.image = *image;
  return options;
}

// An encoder per wheel that stands, an IMU that lies level, no receiver.
board::SensorWorld world_at_rest() {
  board::SensorWorld world;
  world.imu = [](board::Picoseconds) { return board::ImuTruth{.force_mps2 = {0, 0, 9.80665}}; };
  world.left_edges = world.right_edges = [](board::Picoseconds) { return std::int64_t{0}; };
  return world;
}

int run(const Options& options) {
  board::ArkCannode node(options.board, world_at_rest());
  node.chip.can1.line.partner = options.partner;
  std::unique_ptr<sim::OutFile> log;
  if (!options.log.empty()) log = std::make_unique<sim::OutFile>(options.log);
  std::uint64_t frames = 0;
  node.chip.can1.line.on_frame = [&](board::Picoseconds time, const board::CanOffer& frame, bool) {
    ++frames;
    if (!log || frame.remote) return;
    sim::Line line;
    sim::append_log_line(line, {time / board::kMicrosecond}, "can0", frame.frame);
    log->write(line.view());
  };
  board::Machine machine(node.chip, options.machine);
  const std::string wrong = machine.load_elf(options.image);
  if (!wrong.empty()) throw sim::UsageError(wrong);
  machine.run(static_cast<board::Picoseconds>(options.seconds * static_cast<double>(board::kSecond)));
  if (log) log->close();
  std::fputs(node.console.c_str(), stdout);
  std::fprintf(stderr, "tetap-board: %.3f s, %llu instructions, %llu frames, %llu exceptions, %d resets\n",
               options.seconds, static_cast<unsigned long long>(machine.instructions()),
               static_cast<unsigned long long>(frames), static_cast<unsigned long long>(machine.exceptions()),
               machine.resets());
  std::fputs(node.chip.complaints.text().c_str(), stderr);
  return node.chip.complaints.empty() && !machine.locked_up() ? 0 : 1;
}

}  // namespace

int main(int count, char** values) try {
  sim::Arguments arguments(count, values);
  if (arguments.flag("--help")) {
    std::fputs(kHelp, stdout);
    return 0;
  }
  return run(parse(arguments));
} catch (const std::exception& error) {
  std::fprintf(stderr, "tetap-board: %s\n", error.what());
  return 2;
}
