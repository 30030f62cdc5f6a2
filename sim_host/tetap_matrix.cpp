// SPDX-License-Identifier: Apache-2.0
// tetap-matrix: cells of the fault matrix for one robot and one seed. The clean drive is played once. At the begin of a
// fault the process is forked: each cell goes on from the same state of the node.
#include "sim_host/in_process.hpp"
#include "sim_host/matrix/cell.hpp"
#include "sim_host/node_origin.hpp"
#include "sim_host/play/arguments.hpp"
#include "sim_host/replay/node_link.hpp"
#include "sim_host/robots.hpp"

#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <exception>
#include <iostream>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace {

using namespace tetap;

constexpr std::size_t kSettled = 1'200;    ///< ticks judged after the end of a fault
constexpr std::size_t kLongest = 1'000;    ///< ticks of the longest fault
constexpr std::size_t kContext = 100;      ///< ticks of frames before a fault that its counters are taken from
constexpr std::size_t kRecent = 2'000;     ///< ticks before a fault whose words have another cause
constexpr std::size_t kOutageTicks = 500;  ///< the receiver is off for so long before the fault

const char* const kHelp =
    "usage: tetap-matrix [OPTION]... < CELLS\n\nPlays cells of the fault matrix and prints a row of JSON for each. A "
    "cell is a line\n"
    "  SITUATION SENSOR AXIS KIND SIZE     as in: curve gyro z spike2 30g\n\n"
    "  --robot NAME   default rover\n"
    "  --seed N       of the drive (default 1)\n"
    "  --log FILE     a recorded log of that robot instead, whose situations are place1 to place10;\n"
    "  --truth FILE   with this truth\n"
    "  --jobs N       cells at a time (default 1)\n"
    "  --dbc FILE     default config/tetap.dbc\n"
    "  --oracle       beside each cell the same drive without what its faulty device sends meanwhile\n"
    "  --facts        messages and situations of the drive as JSON, instead of cells\n";

/// Sink of the link: keeps the origin that the node publishes.
struct OriginSink {
  sim::NodeOrigin origin;

  void restarted() {}
  void sent(const base::CanFrame&) {}
  void received(const base::CanFrame& frame) { origin.received(frame); }
  void epoch(const sim::NodeEpoch&, base::Micros) {}
};

/// A node in this process, fed tick by tick; it keeps what the node publishes.
class Player {
 public:
  Player(sim::InProcessLink& link, const sim::CleanLog& log)
      : log_(log),
        link_(link),
        sink_{sim::NodeOrigin(log.parameters.can_base)},
        states_(log.parameters.can_base),
        node_(link, sink_, log.parameters.can_base, counts_) {}

  void begin() { require(node_.begin(log_.begin, {})); }
  void play(std::size_t tick, std::span<const sim::TimedFrame> frames) {
    for (const sim::TimedFrame& f : frames) require(node_.send(f.frame));
    require(node_.sync(bus::SyncKind::kStep, log_.ticks[tick]));
    bool done = false;
    for (int polls = 0; !done; ++polls) {
      if (polls > 1000) throw std::runtime_error("no answer to the tick at " + sim::in_seconds(log_.ticks[tick]));
      link_.wait({});
      node_.drain([&](const sim::NodeEpoch& epoch) {
        states_.epoch(epoch, tick);
        done = true;
      });
    }
  }
  /// Ticks [from, to) with these frames; a frame belongs to the first tick at or after its time.
  void play(std::size_t from, std::size_t to, std::span<const sim::TimedFrame> frames) {
    std::size_t next = 0;
    while (next < frames.size() && from > 0 && frames[next].time <= log_.ticks[from - 1]) ++next;
    for (std::size_t tick = from; tick < to; ++tick) {
      std::size_t end = next;
      while (end < frames.size() && frames[end].time <= log_.ticks[tick]) ++end;
      play(tick, frames.subspan(next, end - next));
      next = end;
    }
  }
  [[nodiscard]] sim::PublishedStates& states() { return states_; }
  [[nodiscard]] std::vector<sim::Judged> judged() const {
    const auto from_fix = log_.surveyed ? std::nullopt : sink_.origin.from_fix();
    return sim::judged(states_.states(), log_, from_fix.value_or(log_.origin));
  }

 private:
  static void require(const sim::Result<>& done) {
    if (!done) throw std::runtime_error(done.failure().text);
  }

  const sim::CleanLog& log_;
  sim::InProcessLink& link_;
  OriginSink sink_;
  sim::PublishedStates states_;
  sim::Counts counts_;
  sim::NodeLink<sim::InProcessLink, OriginSink> node_;
};

void write_all(const std::string& text) {
  for (std::size_t at = 0; at < text.size();) {
    const ssize_t n = ::write(STDOUT_FILENO, text.data() + at, text.size() - at);
    if (n <= 0) throw std::runtime_error("the row cannot be written");
    at += static_cast<std::size_t>(n);
  }
}

/// Runs `work` in a process of its own, which begins with all of this one's state.
template <class Work>
pid_t forked(Work&& work) {
  std::fflush(nullptr);
  const pid_t child = ::fork();
  if (child < 0) throw std::runtime_error("fork failed");
  if (child > 0) return child;
  try {
    work();
    std::fflush(nullptr);
    ::_exit(0);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "tetap-matrix: %s\n", error.what());
    ::_exit(1);
  }
}

bool waited(pid_t child) {
  int status = 0;
  return ::waitpid(child, &status, 0) == child && WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

/// Record of a run that others are held against: without the fault, or without the faulty device.
struct Record {
  std::vector<sim::Judged> judged;
  sim::PublishedState first;  ///< the first state with all its sigma
  std::set<std::string> words;
};

struct Options {
  std::string robot;
  std::uint64_t seed = 1;
  std::optional<std::string> log, truth;
  std::size_t jobs = 1;
  bool oracle = false;
};

/// All cells of one situation.
class Group {
 public:
  Group(std::string situation, const sim::CleanLog& log)
      : situation_(std::move(situation)), log_(&log), tick_(sim::tick_of(situation_, log)) {}

  [[nodiscard]] const std::string& situation() const { return situation_; }
  [[nodiscard]] std::size_t tick() const { return tick_; }
  [[nodiscard]] bool outage() const { return situation_ == "outage"; }
  /// Tick at which its own course of events begins.
  [[nodiscard]] std::size_t branch() const { return outage() ? tick_ - kOutageTicks : tick_; }
  void add(const sim::CellRequest& request) { requests_.push_back(request); }

  void run(Player& player, const Options& options, const sim::BusDatabase& dbc) const {
    const auto frames = own_frames(dbc);
    player.play(branch(), tick_, frames);
    std::set<std::string> recent;
    for (const auto& [word, when] : player.states().words())
      if (when.last + kRecent >= tick_) recent.insert(word);
    player.states().forget_words();
    player.states().forget_states();
    Record clean = record(player, frames, {static_cast<std::int64_t>(kLongest) * 10'000});
    clean.words.merge(recent);
    const sim::CellFacts facts = sim::facts_of(*log_, tick_, clean.first, dbc);
    std::map<std::pair<std::string, std::int64_t>, Record> oracles;  // by device and duration
    if (options.oracle)
      for (const sim::CellRequest& request : requests_) {
        double gate = 0;
        const sim::FrameFault fault = sim::sized(request, *log_, tick_, facts, dbc, gate);
        const auto [at, is_new] = oracles.try_emplace({sim::device_of(fault), fault.duration.us});
        if (is_new) at->second = record(player, without(frames, fault, dbc), fault.duration);
      }
    std::size_t running = 0;
    const auto ended = [&running] {
      int status = 0;
      if (::wait(&status) < 0) throw std::runtime_error("situation: a cell's process is gone");
      --running;
      if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) std::fprintf(stderr, "tetap-matrix: a cell failed\n");
    };
    for (const sim::CellRequest& request : requests_) {
      if (running >= options.jobs) ended();
      static_cast<void>(forked([&] { cell(player, request, frames, clean, oracles, facts, options, dbc); }));
      ++running;
    }
    while (running > 0) ended();
  }

 private:
  /// From some ticks before the first that is played on.
  [[nodiscard]] std::vector<sim::TimedFrame> own_frames(const sim::BusDatabase& dbc) const {
    const std::size_t from = branch() > kContext ? branch() - kContext : 0;
    const std::size_t to = std::min(tick_ + kLongest + kSettled + 1, log_->ticks.size());
    const std::span<const sim::TimedFrame> all(log_->frames);
    const auto part = all.subspan(log_->first[from], log_->first[to] - log_->first[from]);
    if (!outage()) return {part.begin(), part.end()};
    sim::FrameFault off;
    off.sensor = "gnss_position";
    off.start = log_->ticks[tick_] - sim::kOutageBefore;
    off.duration = sim::kOutageBefore + sim::kOutageAfter;
    return without(part, off, dbc);
  }

  /// Nothing comes from the fault's device while the fault lasts.
  [[nodiscard]] std::vector<sim::TimedFrame> without(std::span<const sim::TimedFrame> frames,
                                                     const sim::FrameFault& fault, const sim::BusDatabase& dbc) const {
    sim::FrameFault off = fault;
    off.axis = sim::device_of(fault);
    off.sensor = "frames";
    off.kind = sim::FaultKind::kLost;
    return sim::put_fault(frames, off, sim::geometry_of(*log_), dbc).frames;
  }

  [[nodiscard]] std::size_t last_tick(base::Micros lasts) const {
    const std::size_t wanted = tick_ + static_cast<std::size_t>(lasts.us / 10'000) + kSettled;
    return std::min(wanted, log_->ticks.size());
  }

  /// Through a file, because the process that plays it ends.
  [[nodiscard]] Record record(Player& player, std::span<const sim::TimedFrame> frames, base::Micros lasts) const {
    std::FILE* const file = std::tmpfile();
    if (file == nullptr) throw std::runtime_error("no temporary file");
    const bool well = waited(forked([&] {
      player.play(tick_, last_tick(lasts), frames);
      const auto judged = player.judged();
      const sim::PublishedState first = first_whole(player.states().states());
      std::fwrite(&first, sizeof first, 1, file);
      for (const sim::Judged& one : judged) std::fwrite(&one, sizeof one, 1, file);
      std::string words;
      for (const auto& [word, when] : player.states().words()) words += word + "\n";
      const sim::Judged end{};  // of tick 0: behind it stand the words
      std::fwrite(&end, sizeof end, 1, file);
      std::fwrite(words.data(), 1, words.size(), file);
    }));
    Record clean;
    std::rewind(file);
    bool whole = well && std::fread(&clean.first, sizeof clean.first, 1, file) == 1;
    for (sim::Judged one; whole && std::fread(&one, sizeof one, 1, file) == 1 && one.tick != 0;)
      clean.judged.push_back(one);
    std::string word;
    for (int c = std::fgetc(file); whole && c != EOF; c = std::fgetc(file)) {
      if (c != '\n') word += static_cast<char>(c);
      if (c == '\n') clean.words.insert(std::exchange(word, {}));
    }
    std::fclose(file);
    if (!whole || clean.judged.empty())
      throw std::runtime_error("situation " + situation_ + ": a run to hold against failed");
    return clean;
  }

  [[nodiscard]] sim::PublishedState first_whole(const std::vector<sim::PublishedState>& states) const {
    const auto known = [this](const sim::PublishedState& s) {
      return s.std_position_m[0] > 0 && s.std_yaw_rad > 0 &&
             (log_->planar || (s.std_velocity_mps[0] > 0 && s.std_position_m[2] > 0));
    };
    const auto found = std::find_if(states.begin(), states.end(), known);
    if (found == states.end()) throw std::runtime_error("no state with all its sigma");
    return *found;
  }

  void cell(Player& player, const sim::CellRequest& request, std::span<const sim::TimedFrame> frames,
            const Record& clean, const std::map<std::pair<std::string, std::int64_t>, Record>& oracles,
            const sim::CellFacts& facts, const Options& options, const sim::BusDatabase& dbc) const {
    sim::CellResult result;
    const sim::FrameFault fault = sim::sized(request, *log_, tick_, facts, dbc, result.gate);
    const sim::Faulted faulted = sim::put_fault(frames, fault, sim::geometry_of(*log_), dbc);
    const std::size_t end = tick_ + static_cast<std::size_t>(fault.duration.us / 10'000);
    player.play(tick_, last_tick(fault.duration), faulted.frames);
    result.figures = sim::compare(player.judged(), clean.judged, end);
    if (const auto oracle = oracles.find({sim::device_of(fault), fault.duration.us}); oracle != oracles.end())
      result.oracle = sim::compare(oracle->second.judged, clean.judged, end);
    for (const auto& [word, when] : player.states().words())
      if (!clean.words.contains(word)) result.said.emplace_back(word, 0.01 * static_cast<double>(when.first - tick_));
    result.at_s = static_cast<double>((fault.start - log_->begin).us) * 1e-6;
    result.largest = faulted.largest;
    result.changed = faulted.changed;
    write_all(sim::row_of(options.robot, options.seed, request, fault, facts, result));
  }

  std::string situation_;
  const sim::CleanLog* log_;
  std::size_t tick_;
  std::vector<sim::CellRequest> requests_;
};

std::vector<Group> groups_of(std::istream& lines, const sim::CleanLog& log) {
  std::vector<Group> groups;
  for (std::string line; std::getline(lines, line);) {
    if (line.empty()) continue;
    const sim::CellRequest request(line);
    const auto same = [&](const Group& group) { return group.situation() == request.situation; };
    auto found = std::find_if(groups.begin(), groups.end(), same);
    if (found == groups.end()) found = groups.insert(groups.end(), Group(request.situation, log));
    found->add(request);
  }
  std::stable_sort(groups.begin(), groups.end(),
                   [](const Group& a, const Group& b) { return a.branch() < b.branch(); });
  return groups;
}

/// All that can be published, as often as the judge looks; the filter does not see it.
sim::ParameterSettings published_often() {
  sim::ParameterSettings settings;
  for (const char* const one :
       {"publish.pose_every=1", "publish.std_every=2", "publish.attitude_every=2", "publish.state_every=2",
        "publish.status_every=5", "publish.event_every=1", "publish.identity_every=5"})
    settings.set(one, "tetap-matrix");
  return settings;
}

/// Messages that the robot is sent, and where its situations are.
void print_facts(const sim::CleanLog& log, const sim::BusDatabase& dbc) {
  std::set<std::string> messages;
  for (const sim::TimedFrame& f : log.frames)
    if (const auto* const message = dbc.at(f.frame.id - log.parameters.can_base)) messages.insert(message->name);
  std::string names;
  for (const std::string& name : messages) names += (names.empty() ? "\"" : ", \"") + name + "\"";
  std::printf("{\"messages\": [%s], \"planar\": %s, \"situations\": {", names.c_str(), log.planar ? "true" : "false");
  const char* separator = "";
  std::vector<std::string> situations{"standing", "straight", "curve", "start", "outage"};
  if (log.recorded) situations.clear();
  for (int place = 1; log.recorded && place <= 10; ++place) situations.push_back("place" + std::to_string(place));
  for (const std::string& situation : situations) {
    const std::size_t tick = sim::tick_of(situation, log);
    const sim::Moving moving = sim::moving_at(log, tick);
    std::printf("%s\"%s\": {\"at_s\": %.2f, \"speed_mps\": %.3f, \"turn_radps\": %.4f}", std::exchange(separator, ", "),
                situation.c_str(), static_cast<double>((log.ticks[tick] - log.begin).us) * 1e-6, moving.speed_mps,
                moving.turn_radps);
  }
  std::printf("}}\n");
}

int run(const Options& options, const sim::BusDatabase& dbc, bool facts) {
  const sim::CleanLog log = options.log ? sim::recorded_log(options.robot, *options.log, *options.truth)
                                        : sim::clean_log(options.robot, options.seed);
  if (facts) return print_facts(log, dbc), 0;
  const std::vector<Group> groups = groups_of(std::cin, log);
  return sim::with_node_in_process(options.robot, published_often(), log.parameters.can_base, [&](auto& link) {
    Player player(link, log);
    player.begin();
    std::size_t tick = 0;
    bool well = true;
    for (const Group& group : groups) {
      for (; tick < group.branch(); ++tick) player.play(tick, log.of(tick));
      well = waited(forked([&] { group.run(player, options, dbc); })) && well;
    }
    return well ? 0 : 1;
  });
}

}  // namespace

int main(int argc, char** argv) try {
  sim::Arguments arguments(argc, argv);
  if (arguments.flag("--help") || arguments.flag("-h"))
    return std::printf("%srobots: %s\n", kHelp, sim::robot_names().c_str()), 0;
  Options options{.robot = arguments.text("--robot").value_or("rover"),
                  .seed = arguments.integer("--seed", 1, 0, ~0ULL)};
  options.jobs = static_cast<std::size_t>(arguments.integer("--jobs", 1, 1, 256));
  options.log = arguments.text("--log");
  options.truth = arguments.text("--truth");
  if (options.log.has_value() != options.truth.has_value()) throw sim::UsageError("--log and --truth belong together");
  const sim::BusDatabase dbc(arguments.text("--dbc").value_or("config/tetap.dbc"));
  const bool facts = arguments.flag("--facts");
  options.oracle = arguments.flag("--oracle");
  arguments.finish();
  return run(options, dbc, facts);
} catch (const std::exception& error) {
  std::fprintf(stderr, "tetap-matrix: %s\n", error.what());
  return 2;
}
