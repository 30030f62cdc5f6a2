// SPDX-License-Identifier: Apache-2.0
// tetap-world: the simulated world's sensors on a CAN bus, and what the node makes of them on record beside the truth.
#include "hal/board/linux/socket_can.hpp"
#include "hal/chip/support/boot_line.hpp"
#include "sim_host/in_process.hpp"
#include "sim_host/node_origin.hpp"
#include "sim_host/play/arguments.hpp"
#include "sim_host/play/interruption.hpp"
#include "sim_host/play/realtime.hpp"
#include "sim_host/play/session.hpp"
#include "sim_host/play/spool.hpp"
#include "sim_host/played_run.hpp"
#include "sim_host/published_sensors.hpp"
#include "sim_host/replay/lockstep.hpp"
#include "sim_host/robots.hpp"
#include "sim_host/truth_file.hpp"
#include "sim_host/world_source.hpp"
#include "version.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <exception>
#include <fstream>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace {

using namespace tetap;

std::string help() {
  return

      std::string(
          "usage: tetap-world [OPTION]...\n\nDrives or flies a simulated robot over its course, sends what its sensors "
          "say, and "
          "records the node's answers.\n\n"
          "  --can IFACE        the interface the node is on (default vcan0)\n"
          "  --memory           run a node in this process instead, without a bus\n"
          "  --robot NAME       what the node is (default rover): " +
          sim::robot_names() +
          "\n"
          "  --out DIR          for the record and truth.csv (default out/sim)\n"
          "  --seed N           every draw follows from it (default 1)\n"
          "  --duration S       at most so long (default: the whole course)\n"
          "  --matched          only errors that the filters model, as large as the robot's parameters say\n"
          "  --lidar            a laser scanner sends its scans, whether the robot takes them or not\n"
          "  --camera           a camera sends the features that it follows, likewise\n"
          "  --recognise        with it: landmarks that it recognises, as features of camera 3\n"
          "  --wrong-ids X      share of its recognitions that name another landmark (default 0; 0.05 for a robot "
          "that\n"
          "                     maps by images)\n"
          "  --landmarks-only   with it: it follows landmarks and nothing else\n"
          "  --people N         people who walk where scanner and camera see them (default 0)\n"
          "  --course NAME      yard, loop (on wheels), road: 1.1 km at 5 m/s, street (of a car), flight (of what "
          "flies),\n"
          "                     lab: corridor, halls and rooms, corridor (both inside, on wheels), or stand: it stays "
          "where it is; default: loop for a robot that makes its map, else "
          "that "
          "of\n"
          "                     the robot's class\n"
          "  --loop-m L         loop: metres of a lap (default 60)\n"
          "  --landmarks N      loop: so many beside the way, 4 to 254 (default 24)\n"
          "  --ids              landmarks name themselves to a robot that could do without\n"
          "  --clutter X        false sightings a look, on average (default 0)\n"
          "  --movers N         moving obstacles that look like landmarks (default 0)\n"
          "  --start LAT,LON,H  where it starts [deg, deg, m above the ellipsoid] (default: the robot's origin, else\n"
          "                     48.2627,11.6683,520)\n"
          "  --origin-distance EAST,NORTH   the start so many metres from the origin, by the origin's axes; with "
          "--start\n"
          "                     the node in memory is given the origin that follows\n"
          "  --east M           the same for M,0\n"
          "  --built            the robot is built as --params and --set say; else they are what the node is told of "
          "it\n"
          "  --laps N           the course so many times (default 1; 2 for gnss_far and on a loop)\n"
          "  --imu-hz N         IMU samples a second (default 100)\n"
          "  --gnss-m S         1 sigma of GNSS positions per horizontal axis (default 0.85 or the robot's floor)\n"
          "  --gnss-hz N        fixes a second (default 5; 1 where the robot expects them seldom)\n"
          "  --no-wheels        the wheels send nothing\n"
          "  --no-pose          the node is not told where it starts\n"
          "  --fault NAME[@START[+DURATION]]   seconds; several with commas:\n") +
      sim::fault_help() +
      "  --script FILE      a run that was played: its robot, seed and length, and its faults beside those of --fault\n"
      "  --list-faults      names of those that act on the robot, and nothing else\n"
      "  --realtime         at the speed of the world, with Tick frames; else lockstep, as fast as the node can\n"
      "  --window N         lockstep: ticks in flight (default 8)\n"
      "  --emulated         the node runs on an emulated core: be patient\n"
      "  --base ID          first id of the node's block (default: can_base of the parameters)\n" +
      std::string(sim::kParameterHelp) +
      "  --raw              also write raw.log\n"
      "  --quiet            no progress line\n";
}

struct Run {
  sim::World::Options world;
  std::uint64_t seed = 1;
  base::Micros limit;
  bool realtime = false;
  bool initial_pose_estimate = true;
  std::string faults;
  sim::ParameterSettings settings;
  sim::SessionOptions session;
  sim::LockstepOptions lockstep;
};

/// The world as it is driven: its truth waits on disk until the frame of the node's map is known.
class Drive {
 public:
  Drive(sim::World world, const Run& run)
      : source_(std::move(world), run.session.base, base::Micros{10'000}, run.limit, run.initial_pose_estimate),
        truth_(run.session.folder) {
    for (const sim::FaultSetting& fault : run.world.faults) source_.inject(fault);
    if (!source_.world().map_given()) sightings_.emplace(run.session.folder);
  }

  bool next(sim::Tick& tick) {
    if (!source_.next(tick)) return false;
    truth_.add(source_.truth());
    const auto seen = source_.take_sightings();
    if (sightings_) sightings_->add(seen);
    return true;
  }

  [[nodiscard]] sim::WorldSource& source() { return source_; }
  /// Hands over the files of the truth.
  void finish(sim::Session& session, sim::TruthTable table) {
    truth_.each([&table](const sim::Truth& row) { table.add(row); });
    session.add(table.end());
    if (sightings_) session.add(sightings_->end());
  }

 private:
  sim::WorldSource source_;
  sim::Spool<sim::Truth> truth_;
  std::optional<sim::SightingTable> sightings_;
};

static_assert(sim::Source<Drive>);

/// Its faults come with the drive.
sim::World calm_world(const Run& run) {
  sim::World::Options options = run.world;
  options.faults.clear();
  return {options, run.seed};
}

template <sim::Link L>
int drive(L& link, const Run& run) {
  sim::World world = calm_world(run);
  auto about = run.session;
  about.ticks = static_cast<std::uint64_t>(std::min(run.limit, world.duration()).us / 10'000);
  sim::Session session(about);
  session.note("seed", std::to_string(run.seed));
  session.note("fault", sim::quoted(run.faults));
  session.note("landmarks", sim::landmarks_json(world));
  session.note("matched", run.world.mismatched ? "false" : "true");
  const param::Parameters parameters = sim::parameters_of(about.robot, run.settings);
  for (const auto& [name, json] : sim::parameter_notes(parameters, run.settings)) session.note(name, json);
  Drive drive(std::move(world), run);
  if (parameters.bus.guard != 0) drive.source().send_guards();
  sim::NodeOrigin node_origin(about.base);
  sim::OriginWatch watch(session, node_origin);
  const auto play = [&]() -> sim::Result<> {
    if (!run.realtime) return sim::play_lockstep(link, drive, watch, run.lockstep, session.counts());
    std::vector<sim::TimedFrame> frames;
    sim::Tick tick;
    while (drive.next(tick))
      for (const auto& frame : tick.inputs) frames.push_back({.time = tick.time, .frame = frame});
    const sim::RealtimeOptions options{.base = about.base, .interrupted = &sim::Interruption::text};
    return sim::play_realtime(link, frames, watch, options, session.counts());
  };
  return session.run(play, [&] {
    // A robot with a map of landmarks keeps to that, wherever its first fix fell.
    const sim::World& driven = drive.source().world();
    const sim::GeodeticOrigin origin =
        run.world.surveyed ? driven.origin() : node_origin.from_fix().value_or(driven.origin());
    drive.finish(session, {about.folder, parameters, driven, origin, !run.realtime});
  });
}

/// From 1 to `most`.
int counted(sim::Arguments& arguments, std::string_view name, int otherwise, int most) {
  return static_cast<int>(
      arguments.integer(name, static_cast<std::uint64_t>(otherwise), 1, static_cast<std::uint64_t>(most)));
}

/// Numbers parted by commas, each within its limits.
template <std::size_t N>
std::array<double, N> numbers(const std::string& text, const char* option, const std::array<double, N>& most) {
  std::array<double, N> all{};
  std::string_view left = text;
  bool right = true;
  for (std::size_t i = 0; i < N; ++i) {
    const std::string_view one = left.substr(0, left.find(','));
    const auto [after, error] = std::from_chars(one.data(), one.data() + one.size(), all[i]);
    right =
        right && error == std::errc{} && after == one.data() + one.size() && all[i] >= -most[i] && all[i] <= most[i];
    right = right && (one.size() == left.size()) == (i + 1 == N);
    left.remove_prefix(std::min(left.size(), one.size() + 1));
  }
  if (right) return all;
  std::string limits;
  for (const double x : most) limits += (limits.empty() ? "+-" : ",+-") + std::to_string(static_cast<long>(x));
  throw sim::UsageError(std::string(option) + " needs " + std::to_string(N) + " numbers with commas between, within " +
                        limits + ", not '" + text + "'");
}

constexpr double kFarthest_m = 120'000;

/// Course, place and origin; the node's part of the origin goes to its settings.
void set_place(sim::Arguments& arguments, const param::GnssParameters& node, bool memory, Run& run) {
  sim::World::Options& world = run.world;
  world.origin = sim::origin_of(node, world.origin);
  std::array<double, 2> distance_m{arguments.real("--east", 0, -60'000, 60'000), 0};
  const auto distance = arguments.text("--origin-distance");
  if (distance) distance_m = numbers<2>(*distance, "--origin-distance", {kFarthest_m, kFarthest_m});
  const bool distant = distance || sim::magnitude(distance_m[0]) > 0;
  const auto given = arguments.text("--start");
  if (!given) {
    if (distant) world.place = sim::place_at(world.origin, distance_m[0], distance_m[1]);
    if (distant && node.origin_configured == 0)
      throw sim::UsageError(
          "--origin-distance: robot " + run.session.robot +
          " takes its origin from the first fix; give it one with --start, or with --set gnss.origin_*");
    return;
  }
  const auto [latitude_deg, longitude_deg, height_m] = numbers<3>(*given, "--start", {90, 180, 10'000});
  world.place = sim::GeodeticOrigin{latitude_deg, longitude_deg, height_m};
  if (!distant) {
    if (node.origin_configured == 0) world.origin = *world.place;
    return;
  }
  if (!memory) throw sim::UsageError("--origin-distance with --start gives a node its origin: that needs --memory");
  world.origin = sim::origin_with(*world.place, distance_m[0], distance_m[1]);
  world.surveyed = true;
  // In the node's own steps, so that both mean the same place.
  const sim::GeodeticPoint origin = sim::Earth{world.origin}.geodetic({});
  world.origin = {static_cast<double>(origin.latitude_2ndeg) * 2e-9, static_cast<double>(origin.longitude_2ndeg) * 2e-9,
                  static_cast<double>(static_cast<float>(world.origin.height_m))};
  const auto set = [&run](const char* path, double value) {
    std::array<char, 64> text{};
    std::snprintf(text.data(), text.size(), "%s=%.9f", path, value);
    run.settings.set(text.data(), "--origin-distance");
  };
  set("gnss.origin_configured", 1);
  set("gnss.origin_latitude_deg", world.origin.latitude_deg);
  set("gnss.origin_longitude_deg", world.origin.longitude_deg);
  set("gnss.origin_height_m", world.origin.height_m);
}

/// `played`: the course is that of the page.
void set_course(sim::Arguments& arguments, const sim::Sent& sent, bool played, sim::World::Options& world) {
  const std::string course = arguments.text("--course").value_or(std::string(sim::usual_course(sent)));
  // Four minutes of one fault, and what comes after it, take two laps.
  const bool far = !played && std::any_of(world.faults.begin(), world.faults.end(),
                                          [](const sim::FaultSetting& s) { return s.fault == sim::Fault::kGnssFar; });
  const int laps = counted(arguments, "--laps", far ? 2 : sim::usual_laps(course), 1000);
  const double loop_m = arguments.real("--loop-m", 0, 20, 10'000);
  const auto landmarks = static_cast<int>(arguments.integer("--landmarks", 0, 4, 254));
  if (course != "loop" && (loop_m > 0 || landmarks > 0))
    throw sim::UsageError("--loop-m and --landmarks are of --course loop; the course is " + course);
  const sim::Loop loop{.length_m = loop_m > 0 ? loop_m : 60, .landmarks = landmarks > 0 ? landmarks : 24};
  if (!sim::set_course(course, sent.kind, laps, loop, world))
    throw std::runtime_error("--course " + course + ": for this robot it is " +
                             std::string(sim::course_names(sent.kind)));
}

void set_camera(sim::Arguments& arguments, const sim::Sent& sent, sim::CameraNumbers& camera) {
  camera.identities = arguments.flag("--ids") || camera.identities;
  camera.clutter = arguments.real("--clutter", 0, 0, 20);
  camera.movers = static_cast<int>(arguments.integer("--movers", 0, 0, 50));
  if ((camera.clutter > 0 || camera.movers > 0) && !sent.landmarks)
    throw sim::UsageError("--clutter and --movers need a robot that sees landmarks");
}

/// A scanner, and a camera that follows features.
void set_sights(sim::Arguments& arguments, const sim::Sent& sent, sim::World::Options& world) {
  sim::Parameters& n = world.parameters;
  if (arguments.flag("--lidar")) n.lidar.rate_hz = 10;
  if (arguments.flag("--camera")) n.features.rate_hz = 10;
  n.features.recognise = arguments.flag("--recognise") || (sent.images_hz > 0 && sent.own_map);
  const double wrong_ids = arguments.real("--wrong-ids", -1, 0, 1);
  if (wrong_ids >= 0) n.features.wrong_id_probability = wrong_ids;
  n.features.landmarks_only = arguments.flag("--landmarks-only");
  n.people.count = static_cast<int>(arguments.integer("--people", 0, 0, 50));
  const bool camera = n.features.rate_hz > 0 || sent.images_hz > 0, scanner = n.lidar.rate_hz > 0 || sent.scans_hz > 0;
  if ((n.features.recognise || n.features.landmarks_only) && !camera)
    throw sim::UsageError("--recognise and --landmarks-only need --camera");
  if (wrong_ids >= 0 && !n.features.recognise) throw sim::UsageError("--wrong-ids needs --recognise");
  if (n.people.count > 0 && !scanner && !camera) throw sim::UsageError("--people needs --lidar or --camera");
}

void set_world(sim::Arguments& arguments, const sim::Sent& sent, bool played, sim::World::Options& world) {
  set_course(arguments, sent, played, world);
  set_camera(arguments, sent, world.parameters.camera);
  set_sights(arguments, sent, world);
  if (arguments.flag("--no-wheels")) world.parameters.wheels.rate_hz = 0;
  world.parameters.gnss.rate_hz = counted(arguments, "--gnss-hz", world.parameters.gnss.rate_hz, 100);
  world.parameters.imu.rate_hz = counted(arguments, "--imu-hz", world.parameters.imu.rate_hz, 2000);
  const double gnss_m = arguments.real("--gnss-m", 0, 0.001, 100);
  if (gnss_m > 0) world.parameters.gnss = sim::with_error(world.parameters.gnss, gnss_m);
}

std::optional<sim::PlayedRun> script_of(sim::Arguments& arguments) {
  const auto name = arguments.text("--script");
  if (!name) return std::nullopt;
  std::ifstream file(*name);
  std::ostringstream text;
  if (!file || !(text << file.rdbuf())) throw sim::UsageError("--script " + *name + ": " + std::strerror(errno));
  const auto run = sim::played_run(text.view(), *name);
  if (!run) throw sim::UsageError(run.failure().text);
  return *run;
}

/// The robot's body is that of its header; parameters of the command line are the node's.
void set_robot(sim::Arguments& arguments, const sim::Sent& sent, Run& run) {
  const std::string& robot = run.session.robot;
  const param::Parameters built =
      sim::parameters_of(robot, arguments.flag("--built") ? run.settings : sim::ParameterSettings{});
  sim::simulate(robot, sent, built, run.world);
}

}  // namespace

int main(int argc, char** argv) try {
  sim::Arguments arguments(argc, argv);
  if (arguments.flag("--help") || arguments.flag("-h")) return std::fputs(help().c_str(), stdout), 0;
  Run run;
  const std::string interface = arguments.text("--can").value_or("vcan0");
  const bool memory = arguments.flag("--memory");
  const std::optional<sim::PlayedRun> script = script_of(arguments);
  const std::string robot = arguments.text("--robot").value_or(script ? script->robot : "rover");
  run.settings = sim::ParameterSettings(arguments);
  const std::uint32_t base = arguments.base("--base", run.settings.can_base());
  run.seed = arguments.integer("--seed", script ? script->seed : 1, 0, ~std::uint64_t{0});
  run.limit = {static_cast<std::int64_t>(arguments.real("--duration", 86'400, 0.01, 1e7) * 1e6)};
  if (script) run.limit = std::min(run.limit, script->duration);
  run.world.mismatched = !arguments.flag("--matched");
  run.initial_pose_estimate = !arguments.flag("--no-pose");
  std::vector<std::string> faults = arguments.texts("--fault");
  if (script && !script->faults.empty()) faults.push_back(sim::fault_words(*script));
  for (const std::string& given : faults) {
    const sim::FaultsParsed parsed = sim::parse_faults(given);
    if (!parsed.error.empty()) throw std::runtime_error(parsed.error);
    run.world.faults.insert(run.world.faults.end(), parsed.settings.begin(), parsed.settings.end());
    run.faults += (run.faults.empty() ? "" : ",") + given;
  }
  run.session.robot = robot;
  const sim::Sent sent = sim::sent_to(robot, run.settings);
  set_robot(arguments, sent, run);
  set_place(arguments, sim::parameters_of(robot, run.settings).gnss, memory, run);
  set_world(arguments, sent, script.has_value(), run.world);
  const std::string refused = sim::cannot_act(run.world, robot);
  sim::send_only(sent, run.world);
  run.realtime = arguments.flag("--realtime");
  run.lockstep.window = arguments.window();
  if (arguments.flag("--emulated")) run.lockstep.patience = sim::kEmulatedPatience;
  run.lockstep.base = base;
  run.lockstep.interrupted = &sim::Interruption::text;
  sim::Interruption::expect();
  run.session = {.program = "tetap-world",
                 .version = hal::version_text(version()).c_str(),
                 .folder = arguments.text("--out").value_or("out/sim"),
                 .base = base,
                 .raw = arguments.flag("--raw"),
                 .mode = run.realtime ? "realtime" : "lockstep",
                 .bus = memory ? "memory" : interface,
                 .robot = robot,
                 .log = "simulated world",
                 .quiet = arguments.flag("--quiet")};
  const bool list = arguments.flag("--list-faults");
  arguments.finish();
  if (!refused.empty()) throw std::runtime_error(refused);
  if (const std::string why = sim::World::refusal(run.world); !why.empty()) throw std::runtime_error(why);
  if (list) return std::printf("%s\n", sim::applicable_faults(run.world).c_str()), 0;
  if (memory) return sim::with_node_in_process(robot, run.settings, base, [&](auto& link) { return drive(link, run); });
  hal::SocketCan can(interface);
  return drive(can, run);
} catch (const std::exception& error) {
  std::fprintf(stderr, "tetap-world: %s\n", error.what());
  return 2;
}
