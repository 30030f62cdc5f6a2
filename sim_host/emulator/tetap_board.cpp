// SPDX-License-Identifier: Apache-2.0
// tetap-board: executes a flash image on an emulated board in virtual time; the bus goes to a log, the console to the
// standard output. With --robot the simulated world is behind the pins. Any complaint of a model fails the run.
#include "hal/chip/support/boot_line.hpp"
#include "sim_host/emulator/ark_cannode.hpp"
#include "sim_host/emulator/bus_twin.hpp"
#include "sim_host/emulator/hardware_faults.hpp"
#include "sim_host/emulator/live_bus.hpp"
#include "sim_host/emulator/machine.hpp"
#include "sim_host/emulator/nucleo_g474re.hpp"
#include "sim_host/emulator/simulated_sensors.hpp"
#include "sim_host/encode.hpp"
#include "sim_host/in_process.hpp"
#include "sim_host/node_origin.hpp"
#include "sim_host/play/arguments.hpp"
#include "sim_host/play/out_file.hpp"
#include "sim_host/play/session.hpp"
#include "sim_host/published_sensors.hpp"
#include "sim_host/replay/candump.hpp"
#include "sim_host/replay/lockstep.hpp"
#include "sim_host/robots.hpp"
#include "sim_host/truth_file.hpp"
#include "sim_host/world_source.hpp"
#include "tetap/bus/codec.hpp"
#include "tetap/bus/messages.hpp"
#include "version.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <exception>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace {

using namespace tetap;

std::string help() {
  return "usage: tetap-board [OPTION]... IMAGE.elf\n\nExecutes the machine code of IMAGE on an emulated board.\n\n"
         "  --board NAME       ark_cannode or nucleo_g474re (default: named in IMAGE, else ark_cannode)\n"
         "  --seconds S        virtual time (default 10; with --robot: the whole course)\n"
         "  --log FILE         frames of the bus, as candump -L writes them\n"
         "  --cpi C            cycles of an instruction, 1.0 to 4.0 (default 1.5)\n"
         "  --lsi HZ           oscillator of the watchdog, 17000 to 47000 (default 32000; nucleo_g474re: 29500 to\n"
         "                     34000)\n"
         "  --imu-clock-ppm P  error of the IMU's clock (default 0; with --robot: drawn within its data sheet's 1 %)\n"
         "  --who-am-i N       what the IMU answers for its identity (default 0x47)\n"
         "  --no-crystal       HSE never starts\n"
         "  --no-imu           nothing answers on SPI1\n"
         "  --no-partner       no other node acknowledges\n"
         "  --first-complaint  ends the run with the first complaint\n"
         "  --can IFACE        joins the bus to a CAN interface of this machine, in real time\n"
         "  --power-cycle S[,S...]  the supply is lost at these times of the run, for 0.1 s: RAM is lost, flash stays\n"
         "  --flash FILE       the flash: read where FILE is there, before IMAGE is written; kept there at the end\n"
         "  --flash-time T     of an erase: typical, maximum or fourfold (default: four times the typical one)\n"
         "  --check-alignment  looks at every instruction for accesses that must be aligned; slow\n\n"
         "The simulated world behind the pins:\n"
         "  --robot NAME       whose body and sensors: " +
         sim::robot_names() +
         "\n"
         "  --out DIR          raw.log, truth.csv, board.json, console.txt (default out/board)\n"
         "  --seed N           every draw follows from it (default 1)\n"
         "  --gnss-baud N      rate of the receiver as it comes (default 38400)\n"
         "  --gnss-generation N  8 or 9 of u-blox (default 9)\n"
         "  --twin             beside it a node of this host that gets the same sensors over CAN: DIR/twin\n"
         "  --no-clock         no other node sends the time of the bus\n"
         "  --fault NAME[@START[+DURATION]]   seconds after the world's start; several with commas. Of the "
         "hardware:\n" +
         board::hardware_fault_help() + "  Of the world:\n" + sim::fault_help() +
         "\nExit status: 0; 1 the models complain or the core locked up; 2 the command line or a file is wrong.\n";
}

struct Options {
  board::BoardOptions board;
  board::MachineOptions machine;
  board::UbloxOptions receiver;
  std::optional<double> seconds;
  std::optional<double> imu_clock_ppm;
  std::string log, image, robot, out, faults, can, kind, flash;
  board::FlashController::Pace flash_pace = board::FlashController::Pace::kFourfold;
  std::vector<board::Picoseconds> power_cycles;
  std::vector<board::HardwareFaultSetting> hardware_faults;
  std::vector<sim::FaultSetting> world_faults;
  std::uint64_t seed = 1;
  bool partner = true, time_master = true, first_complaint = false, twin = false;
};

double to_seconds(board::Picoseconds time) { return static_cast<double>(time / board::kMicrosecond) * 1e-6; }

constexpr std::array<std::string_view, 2> kBoards = {"ark_cannode", "nucleo_g474re"};

/// The board that the command line or the image's file name (tetap-BOARD-ROBOT.elf) names.
std::string board_of(const std::string& given, const std::string& image) {
  if (std::find(kBoards.begin(), kBoards.end(), given) != kBoards.end()) return given;
  if (!given.empty()) throw sim::UsageError("--board " + given + ": there are ark_cannode and nucleo_g474re");
  const std::string file = image.substr(image.rfind('/') + 1);
  for (const std::string_view name : kBoards)
    if (file.find(name) != std::string::npos) return std::string(name);
  return std::string(kBoards.front());
}

std::unique_ptr<board::Board> make_board(const Options& options, board::SensorWorld world) {
  if (options.kind == "nucleo_g474re") return std::make_unique<board::NucleoG474re>(options.board, std::move(world));
  return std::make_unique<board::ArkCannode>(options.board, std::move(world));
}

/// Times of a fault as the report reads them.
std::string fault_text(std::string_view name, double start_s, double duration_s) {
  std::array<char, 96> text{};
  std::snprintf(text.data(), text.size(), "%s@%g+%g", std::string(name).c_str(), start_s, duration_s);
  return text.data();
}

void add_world_fault(const std::string& text, Options& options) {
  const sim::FaultsParsed parsed = sim::parse_faults(text);
  if (!parsed.error.empty()) throw sim::UsageError(parsed.error);
  for (const sim::FaultSetting& one : parsed.settings) {
    using enum sim::Fault;
    const std::array refused{kStaleStamps, kFutureStamps, kLostFrames, kMovingStart};
    const std::string_view name = sim::info(one.fault).name;
    if (std::find(refused.begin(), refused.end(), one.fault) != refused.end())
      throw sim::UsageError("fault '" + std::string(name) + "' is one of sensors on the bus, not of wired ones");
    options.world_faults.push_back(one);
    options.faults += (options.faults.empty() ? "" : ",") + fault_text(name, static_cast<double>(one.start.us) * 1e-6,
                                                                       static_cast<double>(one.duration.us) * 1e-6);
  }
}

void add_faults(std::string_view all, Options& options) {
  while (!all.empty()) {
    const std::string one(all.substr(0, all.find(',')));
    all.remove_prefix(std::min(all.size(), one.size() + 1));
    const auto hardware = board::parse_hardware_fault(one);
    if (!hardware) {
      add_world_fault(one, options);
      continue;
    }
    options.hardware_faults.push_back(*hardware);
    options.faults +=
        (options.faults.empty() ? "" : ",") +
        fault_text(one.substr(0, one.find('@')), to_seconds(hardware->start), to_seconds(hardware->duration));
  }
}

void parse_world(sim::Arguments& arguments, Options& options) {
  options.robot = arguments.text("--robot").value_or("");
  options.out = arguments.text("--out").value_or(options.robot.empty() ? "" : "out/board");
  options.seed = arguments.integer("--seed", 1, 0, ~std::uint64_t{0});
  options.receiver.generation = static_cast<int>(arguments.integer("--gnss-generation", 9, 8, 9));
  options.receiver.baud = static_cast<std::int64_t>(
      arguments.integer("--gnss-baud", options.receiver.generation == 8 ? 9'600 : 38'400, 4'800, 921'600));
  options.time_master = !arguments.flag("--no-clock");
  options.twin = arguments.flag("--twin");
  const auto faults = arguments.texts("--fault");
  if (options.robot.empty() && !faults.empty()) throw sim::UsageError("--fault needs --robot");
  if (options.robot.empty() && options.twin) throw sim::UsageError("--twin needs --robot");
  for (const std::string& given : faults) add_faults(given, options);
}

void parse_flash(sim::Arguments& arguments, Options& options) {
  using Pace = board::FlashController::Pace;
  constexpr std::array kPaces{std::pair{"typical", Pace::kTypical}, std::pair{"maximum", Pace::kMaximum},
                              std::pair{"fourfold", Pace::kFourfold}};
  options.flash = arguments.text("--flash").value_or("");
  const std::string pace = arguments.text("--flash-time").value_or("fourfold");
  const auto found = std::find_if(kPaces.begin(), kPaces.end(), [&](const auto& one) { return pace == one.first; });
  if (found == kPaces.end()) throw sim::UsageError("--flash-time " + pace + ": it is typical, maximum or fourfold");
  options.flash_pace = found->second;
  const std::string times = arguments.text("--power-cycle").value_or("");
  const char* at = times.data();
  const char* const end = at + times.size();
  while (at != end) {
    double time_s = 0;
    const auto [next, code] = std::from_chars(at, end, time_s, std::chars_format::fixed);
    if (code != std::errc{} || !(time_s > 0 && time_s <= 1e6) || (next != end && (*next != ',' || next + 1 == end)))
      throw sim::UsageError("--power-cycle " + times + ": times in seconds above 0, with commas between them");
    options.power_cycles.push_back(std::llround(time_s * 1e6) * board::kMicrosecond);
    at = next == end ? end : next + 1;
  }
}

Options parse(sim::Arguments& arguments) {
  Options options;
  if (const double given = arguments.real("--seconds", 0, 0.001, 1e6); given > 0) options.seconds = given;
  options.log = arguments.text("--log").value_or("");
  options.machine.cpi_percent = static_cast<int>(std::lround(100 * arguments.real("--cpi", 1.5, 1, 4)));
  options.board.oscillators.lsi_hz = static_cast<std::int64_t>(arguments.integer("--lsi", 32'000, 17'000, 47'000));
  constexpr double kNotGiven = 1e9;
  const double ppm = arguments.real("--imu-clock-ppm", kNotGiven, -50'000, 50'000);
  if (ppm < kNotGiven) options.imu_clock_ppm = ppm;
  options.board.imu.who_am_i = static_cast<std::uint8_t>(arguments.integer("--who-am-i", 0x47, 0, 0xFF));
  options.board.oscillators.crystal = !arguments.flag("--no-crystal");
  options.board.imu_present = !arguments.flag("--no-imu");
  options.first_complaint = arguments.flag("--first-complaint");
  options.can = arguments.text("--can").value_or("");
  options.partner = !arguments.flag("--no-partner");
  options.machine.check_alignment = arguments.flag("--check-alignment");
  parse_flash(arguments, options);
  parse_world(arguments, options);
  const std::string kind = arguments.text("--board").value_or("");
  const auto image = arguments.positional();
  arguments.finish();
  if (!image) throw sim::UsageError("no image is named (--help)");
  options.image = *image;
  options.kind = board_of(kind, options.image);
  // DS12288, LSI: 29.5 to 34 kHz over temperature; the older chip's range is that of --lsi.
  const std::int64_t lsi_hz = options.board.oscillators.lsi_hz;
  if (options.kind == "nucleo_g474re" && (lsi_hz < 29'500 || lsi_hz > 34'000))
    throw sim::UsageError("--lsi " + std::to_string(lsi_hz) + ": the STM32G474's is 29500 to 34000");
  if (!options.robot.empty() && options.log.empty()) options.log = options.out + "/raw.log";
  return options;
}

// An encoder per wheel that stands, an IMU that lies level, no receiver.
board::SensorWorld world_at_rest() {
  board::SensorWorld world;
  world.imu = [](board::Picoseconds) { return board::ImuTruth{.force_mps2 = {0, 0, 9.80665}}; };
  world.left_edges = world.right_edges = [](board::Picoseconds) { return std::int64_t{0}; };
  return world;
}

/// The world of `options.robot`, on the course of its class.
sim::World world_of(const Options& options, const param::Parameters& parameters) {
  const sim::Sent sent = sim::sent_to(options.robot);
  sim::World::Options world;
  world.faults = options.world_faults;
  sim::simulate(options.robot, sent, parameters, world);
  world.origin = sim::origin_of(parameters.gnss, world.origin);
  const std::string_view course = sim::usual_course(sent);
  static_cast<void>(sim::set_course(course, sent.kind, sim::usual_laps(course), {}, world));
  const std::string refused = sim::cannot_act(world, options.robot);
  if (!refused.empty()) throw sim::UsageError(refused);
  sim::send_only(sent, world);
  return sim::World(world, options.seed);
}

/// Other nodes of the bus: sensors that are not wired to the board, a master of the time, a sender of the start pose.
class OtherNodes {
 public:
  OtherNodes(board::Board& node, board::SimulatedSensors& sensors, std::uint32_t base, bool time_master,
             board::BusTwin* twin)
      : node_(node), sensors_(sensors), twin_(twin), base_(base), poll_(node.processor.scheduler, [this] { poll(); }) {
    if (!time_master) next_clock_ = board::kNever;
    poll_.set(0);
  }

 private:
  void poll() {
    const board::Picoseconds now = node_.processor.scheduler.now();
    poll_.set(now + board::kMillisecond);
    frames_.clear();
    measurements_.clear();
    if (now >= next_clock_) {
      // The master states the time at which its frame will have arrived on a free bus.
      constexpr std::int64_t kOnTheWire_us = 270;
      const base::Micros time =
          base::Micros{now / board::kMicrosecond + kOnTheWire_us} + sensors_.world().clock_offset();
      frames_.push_back(bus::frame(base_, bus::InSync{.time_us = static_cast<std::uint64_t>(time.us),
                                                      .ctr = clock_count_++,
                                                      .kind = bus::SyncKind::kClock}));
      next_clock_ = now + board::kSecond;
    }
    const std::size_t synchronisation = frames_.size();
    if (!introduced_ && now >= sensors_.world().start().us * board::kMicrosecond) {
      introduced_ = true;
      sim::introduce(sensors_.world(), base_, true, frames_);
    }
    sensors_.take_unwired(now, measurements_);
    for (const sim::Measurement& one : measurements_) sim::encode(base_, one, frames_);
    if (twin_ != nullptr) twin_->take(std::span(frames_).subspan(synchronisation));
    for (const base::CanFrame& frame : frames_) node_.processor.can_line().send(frame, now);
  }

  board::Board& node_;
  board::SimulatedSensors& sensors_;
  board::BusTwin* twin_;  ///< null: none listens
  std::uint32_t base_;
  board::Alarm poll_;
  board::Picoseconds next_clock_ = 0;
  std::uint8_t clock_count_ = 0;
  bool introduced_ = false;
  std::vector<base::CanFrame> frames_;
  std::vector<sim::Measurement> measurements_;
};

/// Facts of a run for its judges.
struct Facts {
  std::uint64_t frames = 0;
  double seconds = 0, cpu_s = 0;
};

std::string complaints_json(const std::vector<board::Complaint>& complaints) {
  std::string text;
  for (const board::Complaint& one : complaints)
    text += (text.empty() ? "" : ", ") + sim::quoted(one.model + ": " + one.text);
  return "[" + text + "]";
}

std::string times_json(const std::vector<board::Picoseconds>& times) {
  std::string text;
  for (const board::Picoseconds one : times) text += (text.empty() ? "" : ", ") + std::to_string(to_seconds(one));
  return "[" + text + "]";
}

void write_facts(const Options& options, const board::Board& node, const board::Machine& machine,
                 const board::SimulatedSensors& sensors, const Facts& facts) {
  const auto real = [](double value) {
    std::array<char, 40> text{};
    std::snprintf(text.data(), text.size(), "%.3f", value);
    return std::string(text.data());
  };
  const std::vector<std::pair<std::string, std::string>> fields{
      {"seed", std::to_string(options.seed)},
      {"fault", sim::quoted(options.faults)},
      {"board", sim::quoted(options.kind)},
      {"image", sim::quoted(options.image)},
      {"complaints", std::to_string(node.processor.complaints.list().size())},
      {"complaint_texts", complaints_json(node.processor.complaints.list())},
      {"provoked_complaints", complaints_json(node.processor.complaints.provoked())},
      {"board_s", real(facts.seconds)},
      {"board_cpu_s", real(facts.cpu_s)},
      {"times_realtime", real(facts.cpu_s > 0 ? facts.seconds / facts.cpu_s : 0)},
      {"instructions", std::to_string(machine.instructions())},
      {"exceptions", std::to_string(machine.exceptions())},
      {"resets", std::to_string(machine.resets())},
      {"reset_times_s", times_json(machine.reset_times())},
      {"upset_s", machine.upset_time() == board::kNever ? "null" : real(to_seconds(machine.upset_time()))},
      {"watchdog_longest_gap_s", real(to_seconds(node.processor.watchdog().longest_gap()))},
      {"cpi", real(options.machine.cpi_percent / 100.0)},
      {"frames_on_bus", std::to_string(facts.frames)},
      {"imu_clock_ppm", real(*options.imu_clock_ppm)},
      {"imu_samples", std::to_string(node.imu.samples())},
      {"imu_packets_lost", std::to_string(node.imu.lost_packets())},
      {"gnss_epochs", std::to_string(sensors.receiver.epochs)},
      {"gnss_baud", std::to_string(sensors.receiver.baud())},
      {"gnss_settings_refused", std::to_string(sensors.receiver.refused)},
      {"lidar_packets", std::to_string(sensors.lidar_packets())},
      {"world_start_s", real(static_cast<double>(sensors.world().start().us) * 1e-6)},
      {"matched", "false"},
      {"landmarks", sim::landmarks_json(sensors.world())}};
  sim::OutFile file(options.out + "/board.json");
  file.write("{\n");
  for (std::size_t i = 0; i < fields.size(); ++i)
    file.write("  " + sim::quoted(fields[i].first) + ": " + fields[i].second + (i + 1 < fields.size() ? ",\n" : "\n"));
  file.write("}\n");
  file.close();
}

class Run {
 public:
  explicit Run(Options options) : options_(std::move(options)) {
    if (options_.robot.empty()) return;
    sim::make_folder(options_.out);
    parameters_ = sim::parameters_of(options_.robot);
    sensors_.emplace(world_of(options_, parameters_), parameters_, options_.receiver, options_.seed);
    options_.board.imu.noise = true;
    options_.board.imu.seed = options_.seed;
    // DS-000347 table 4: the internal clock is within 1 % when both sensors run.
    base::Random draw(options_.seed, kClockStream);
    if (!options_.imu_clock_ppm) options_.imu_clock_ppm = 10'000 * (2 * static_cast<double>(draw.uniform()) - 1);
  }

  int operator()() {
    options_.board.imu.clock_error = 1e-6 * options_.imu_clock_ppm.value_or(0);
    const std::unique_ptr<board::Board> made = make_board(options_, sensors_ ? sensors_->door() : world_at_rest());
    board::Board& node = *made;
    node.processor.can_line().partner = options_.partner;
    if (!options_.log.empty()) log_ = std::make_unique<sim::OutFile>(options_.log);
    sim::NodeOrigin origin(parameters_.can_base);
    std::optional<board::LiveBus> live;
    if (!options_.can.empty()) live.emplace(options_.can, node.processor.can_line(), node.processor.scheduler);
    node.processor.can_line().on_frame = [&](board::Picoseconds time, const board::CanOffer& frame, bool own) {
      if (live) live->came_through(frame, own);
      if (sensors_ && !frame.remote) origin.received(frame.frame);
      record(time, frame);
    };
    board::Machine machine(node.processor, options_.machine);
    board::FlashController& flash = node.processor.flash_controller();
    flash.seed = options_.seed;
    flash.pace = options_.flash_pace;
    if (!options_.flash.empty() && std::filesystem::exists(options_.flash)) check(flash.restore(options_.flash));
    check(machine.load_elf(options_.image));
    const auto cycles = power_cycles(node);
    std::optional<OtherNodes> others;
    std::optional<board::BusTwin> twin;
    if (options_.twin) twin.emplace(node, *sensors_, parameters_);
    if (sensors_) others.emplace(node, *sensors_, parameters_.can_base, options_.time_master, twin ? &*twin : nullptr);
    board::HardwareFaults faults(node, machine, sensors_ ? &*sensors_ : nullptr,
                                 parameters_.can_base + bus::InBaro::kOffset);
    for (const auto& one : options_.hardware_faults)
      faults.add(one, sensors_->world().start().us * board::kMicrosecond);
    const std::clock_t began = std::clock();
    facts_.seconds = duration_s();
    run(machine, node.processor.complaints);
    facts_.cpu_s = static_cast<double>(std::clock() - began) / CLOCKS_PER_SEC;
    if (log_) log_->close();
    if (!options_.flash.empty()) check(flash.save(options_.flash));
    if (live)
      std::fprintf(stderr, "tetap-board: on %s in real time, at most %.3f s late\n", options_.can.c_str(),
                   static_cast<double>(live->latest().us) * 1e-6);
    finish(node, machine, origin);
    if (twin && play_twin(*twin) != 0) throw std::runtime_error("the twin's node did not keep up");
    return node.processor.complaints.empty() && !machine.locked_up() ? 0 : 1;
  }

 private:
  static constexpr std::uint64_t kClockStream = 1'001;

  static void check(const std::string& wrong) {
    if (!wrong.empty()) throw sim::UsageError(wrong);
  }
  /// The whole board loses its supply: chip, IMU and receiver start anew.
  [[nodiscard]] std::vector<std::unique_ptr<board::Alarm>> power_cycles(board::Board& node) {
    std::vector<std::unique_ptr<board::Alarm>> alarms;
    for (const board::Picoseconds at : options_.power_cycles) {
      alarms.push_back(std::make_unique<board::Alarm>(node.processor.scheduler, [this, &node] {
        node.processor.lose_power();
        node.imu.dip();
        if (sensors_) sensors_->receiver.power_on(node.processor.scheduler.now());
      }));
      alarms.back()->set(at);
    }
    return alarms;
  }
  [[nodiscard]] double duration_s() const {
    if (!sensors_) return options_.seconds.value_or(10);
    const base::Micros all = sensors_->world().start() + sensors_->world().duration();
    return std::min(options_.seconds.value_or(1e9), static_cast<double>(all.us) * 1e-6);
  }
  void run(board::Machine& machine, const board::Complaints& complaints) {
    const auto end = static_cast<board::Picoseconds>(facts_.seconds * static_cast<double>(board::kSecond));
    if (!options_.first_complaint) return machine.run(end);
    constexpr board::Picoseconds kSlice = 10 * board::kMillisecond;
    board::Picoseconds now = 0;
    while (now < end && complaints.empty()) machine.run(now = std::min(now + kSlice, end));
    facts_.seconds = to_seconds(now);
  }
  void record(board::Picoseconds time, const board::CanOffer& frame) {
    ++facts_.frames;
    if (!log_ || frame.remote) return;
    sim::Line line;
    sim::append_log_line(line, {time / board::kMicrosecond}, "can0", frame.frame);
    log_->write(line.view());
  }
  void finish(const board::Board& node, const board::Machine& machine, const sim::NodeOrigin& origin) const {
    std::fputs(node.console.c_str(), stdout);
    std::fprintf(stderr, "tetap-board: %.3f s, %llu instructions, %llu frames, %llu exceptions, %d resets\n",
                 facts_.seconds, static_cast<unsigned long long>(machine.instructions()),
                 static_cast<unsigned long long>(facts_.frames), static_cast<unsigned long long>(machine.exceptions()),
                 machine.resets());
    std::fputs(node.processor.complaints.text().c_str(), stderr);
    if (!sensors_) return;
    const sim::World& world = sensors_->world();
    // A robot with a map of landmarks keeps to that, wherever its first fix fell.
    const bool surveyed = !world.map().empty() || parameters_.gnss.origin_configured != 0;
    sim::TruthTable truth(options_.out, parameters_, world,
                          surveyed ? world.origin() : origin.from_fix().value_or(world.origin()), false);
    for (const sim::Truth& row : sensors_->truth()) truth.add(row);
    truth.end().publish();
    if (!world.map_given()) {
      sim::SightingTable sightings(options_.out);
      sightings.add(world.sightings());
      sightings.end().publish();
    }
    write_facts(options_, node, machine, *sensors_, facts_);
    sim::OutFile console(options_.out + "/console.txt");
    console.write(node.console);
    console.close();
  }

  /// The same sensors over CAN: a node of this host computes DIR/twin.
  [[nodiscard]] int play_twin(board::BusTwin& twin) const {
    const std::string folder = options_.out + "/twin";
    const std::uint32_t base = parameters_.can_base;
    const std::size_t ticks = twin.script().ticks();
    return sim::with_node_in_process(options_.robot, {}, base, [&](auto& link) {
      sim::Session session({.program = "tetap-board",
                            .version = hal::version_text(version()).c_str(),
                            .folder = folder,
                            .base = base,
                            .mode = "lockstep",
                            .bus = "memory",
                            .robot = options_.robot,
                            .log = "sensors of the emulated board, over CAN",
                            .ticks = ticks,
                            .quiet = true});
      session.note("seed", std::to_string(options_.seed));
      session.note("fault", sim::quoted(options_.faults));
      session.note("landmarks", sim::landmarks_json(sensors_->world()));
      session.note("matched", "false");
      sim::NodeOrigin origin(base);
      sim::OriginWatch watch(session, origin);
      return session.run(
          [&] { return sim::play_lockstep(link, twin.script(), watch, {.base = base}, session.counts()); },
          [&] {
            const sim::World& world = sensors_->world();
            const auto rows = std::span(sensors_->truth()).subspan(twin.first_row());
            sim::TruthTable truth(folder, parameters_, world, origin.from_fix().value_or(world.origin()), true);
            for (const sim::Truth& row : rows.first(std::min(ticks, rows.size()))) truth.add(row);
            session.add(truth.end());
          });
    });
  }

  Options options_;
  param::Parameters parameters_;
  std::optional<board::SimulatedSensors> sensors_;
  std::unique_ptr<sim::OutFile> log_;
  Facts facts_;
};

}  // namespace

int main(int count, char** values) try {
  sim::Arguments arguments(count, values);
  if (arguments.flag("--help")) {
    std::fputs(help().c_str(), stdout);
    return 0;
  }
  return Run(parse(arguments))();
} catch (const std::exception& error) {
  std::fprintf(stderr, "tetap-board: %s\n", error.what());
  return 2;
}
