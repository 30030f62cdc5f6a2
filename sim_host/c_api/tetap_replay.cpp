// SPDX-License-Identifier: Apache-2.0
#include "sim_host/c_api/tetap_replay.h"

#include "sim_host/kept_words.hpp"
#include "sim_host/parameter_settings.hpp"
#include "sim_host/replay/complaint.hpp"
#include "sim_host/replay/lockstep.hpp"
#include "sim_host/replay/memory_node.hpp"
#include "sim_host/replay/survey.hpp"
#include "sim_host/robots.hpp"
#include "version.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace {

using namespace tetap;

constexpr base::Micros kPeriod{10'000};

/// Keeps the frames of each epoch for the reader.
class Frames {
 public:
  void restarted() {}
  void sent(const base::CanFrame&) {}
  void received(const base::CanFrame&) {}
  void epoch(const sim::NodeEpoch& epoch, base::Micros time) {
    for (const base::CanFrame& frame : epoch.frames) {
      tetap_frame& kept = frames_.emplace_back();
      kept.time_us = time.us;
      kept.id = frame.id;
      kept.size = frame.size;
      kept.extended = frame.extended ? 1 : 0;
      std::copy(frame.data.begin(), frame.data.end(), kept.data);
    }
    state_crc_ = epoch.tail.crc;
  }

  void clear() {
    frames_.clear();
    read_ = 0;
  }
  std::size_t read(tetap_frame* to, std::size_t room) {
    const std::size_t there = frames_.size() - read_;
    if (to == nullptr) return there;
    const std::size_t taken = std::min(room, there);
    std::copy_n(frames_.begin() + static_cast<std::ptrdiff_t>(read_), taken, to);
    read_ += taken;
    if (read_ == frames_.size()) clear();
    return taken;
  }
  [[nodiscard]] std::uint32_t state_crc() const { return state_crc_; }

 private:
  std::vector<tetap_frame> frames_;
  std::size_t read_ = 0;
  std::uint32_t state_crc_ = 0;
};

/// The same, with each epoch held against the recorded one.
struct Compared {
  void restarted() {}
  void sent(const base::CanFrame&) {}
  void received(const base::CanFrame&) {}
  void epoch(const sim::NodeEpoch& epoch, base::Micros time) {
    frames.epoch(epoch, time);
    comparison.epoch(epoch, time);
  }

  Frames& frames;
  sim::Comparison& comparison;
};

/// The node of push and tick.
struct Ticked {
  Ticked(const sim::Robot& robot, const param::Parameters& parameters, Frames& frames)
      : options{.base = parameters.can_base},
        node(robot, parameters, version()),
        lockstep(node.link(), frames, options, counts) {}

  sim::LockstepOptions options;
  sim::Counts counts;
  sim::MemoryNode node;
  sim::Lockstep<sim::InProcessLink, Frames> lockstep;
  std::optional<base::Micros> last;
};

std::mutex modules;  ///< guards the reading of robots' modules
thread_local std::string why_not_open;

}  // namespace

struct tetap_replay {
  tetap_replay(const sim::Robot& of, const param::Parameters& numbers)
      : robot(of), stated(numbers), parameters(sim::MemoryNode::for_player(numbers, numbers.can_base)) {}

  [[nodiscard]] std::uint32_t can_base() const { return parameters.can_base; }
  sim::Result<> push(std::span<const tetap_frame> given, int& taken);
  sim::Result<> tick(base::Micros time);
  sim::Result<> play(std::string_view text, const std::string& name, sim::PlayMode mode, tetap_replay_result& result);

  const sim::Robot& robot;
  const param::Parameters stated;
  const param::Parameters parameters;
  Frames frames;
  std::unique_ptr<Ticked> ticked;
  std::vector<base::CanFrame> inputs;  ///< for the next tick
  std::string error, complaint, json, began_with;
};

sim::Result<> tetap_replay::push(std::span<const tetap_frame> given, int& taken) {
  std::vector<base::CanFrame> added;
  for (std::size_t i = 0; i < given.size(); ++i) {
    const tetap_frame& one = given[i];
    const std::uint32_t most = one.extended != 0 ? 0x1FFFFFFF : 0x7FF;
    if (one.size > 8 || one.extended > 1 || one.id > most)
      return sim::Failure{"frame " + std::to_string(i) + ": id " + std::to_string(one.id) + ", size " +
                          std::to_string(one.size) + ", extended " + std::to_string(one.extended) +
                          " is no classic CAN frame"};
    base::CanFrame frame{.id = one.id, .extended = one.extended != 0, .size = one.size};
    std::copy(std::begin(one.data), std::end(one.data), frame.data.begin());
    if (sim::is_counted_input(frame, can_base(), robot.takes.map_inputs())) added.push_back(frame);
  }
  inputs.insert(inputs.end(), added.begin(), added.end());
  taken = static_cast<int>(added.size());
  return {};
}

sim::Result<> tetap_replay::tick(base::Micros time) {
  if (time < kPeriod)
    return sim::Failure{"a tick at " + std::to_string(time.us) + " us; the first is at 10000 or later"};
  if (ticked && ticked->last && time <= *ticked->last)
    return sim::Failure{"a tick at " + std::to_string(time.us) + " us, not later than the one before at " +
                        std::to_string(ticked->last->us) + " us"};
  if (!ticked) ticked = std::make_unique<Ticked>(robot, parameters, frames);
  sim::Tick next{.time = time, .inputs = inputs, .begin = {}};
  if (!ticked->last) next.begin = time - kPeriod;
  auto asked = ticked->lockstep.ask(next);
  inputs.clear();
  if (!asked) return asked;
  ticked->last = time;
  while (ticked->lockstep.in_flight() > 0)
    if (auto answered = ticked->lockstep.answers(); !answered) return answered;
  if (ticked->counts.lost() > 0) return sim::Failure{sim::complaint(ticked->counts, nullptr)};
  return {};
}

sim::Result<> tetap_replay::play(std::string_view text, const std::string& name, sim::PlayMode mode,
                                 tetap_replay_result& result) {
  sim::LogText log(text, name, {.interface = {}, .base = can_base()});
  const sim::ScriptOptions script{
      .base = can_base(), .log_base = can_base(), .map_inputs = robot.takes.map_inputs(), .period = kPeriod};
  const auto survey = sim::survey_of(log, name, mode, script);
  if (!survey) return survey.failure();
  if (log.report().data == 0) return sim::Failure{name + ": no CAN data frame in it"};
  const bool repeats = survey->settled(mode) == sim::PlayMode::kAsRecorded;
  if (repeats && !survey->recording) return sim::Failure{survey->refusal};
  if (!repeats && survey->ticks == 0) return sim::Failure{name + ": no input frames of this id base"};

  const auto begun = sim::begun_of(log, can_base(), robot, parameters);
  frames.clear();
  sim::MemoryNode node(robot, parameters, version());
  if (begun) {
    began_with = sim::settings_between(begun->built, begun->active) + begun->rest();
    if (auto made = sim::make_active(node.link(), begun->from, begun->to); !made)
      return sim::Failure{name + ": its node began with " + began_with + "; " + made.failure().text};
  }
  const sim::LockstepOptions lockstep{.base = can_base()};
  sim::Counts counts;
  const auto finished = [&](const sim::Result<>& played, const sim::Comparison* comparison) -> sim::Result<> {
    if (!played) return played;
    if (log.failure()) return *log.failure();
    complaint = sim::complaint(counts, comparison);
    result = {.epochs = counts.epochs,
              .compared = comparison != nullptr ? comparison->compared() : 0,
              .different = comparison != nullptr ? comparison->different() : 0,
              .frames_in = counts.inputs,
              .frames_lost = counts.lost(),
              .state_crc = frames.state_crc(),
              .recorded = repeats ? 1U : 0U};
    return {};
  };
  if (repeats) {
    sim::RecordedTicks ticks(log, *survey->recording, script);
    sim::Comparison comparison(ticks, *survey->recording, script);
    Compared compared{frames, comparison};
    return finished(sim::play_lockstep(node.link(), ticks, compared, lockstep, counts), &comparison);
  }
  sim::LogTicks ticks(log, script, survey->has_ticks);
  return finished(sim::play_lockstep(node.link(), ticks, frames, lockstep, counts), nullptr);
}

namespace {

/// Runs `work` for a caller in C: 0, or -1 with the reason kept.
template <class Work>
int guarded(tetap_replay* replay, Work&& work) noexcept {
  if (replay == nullptr) return -1;
  try {
    const sim::Result<> done = work();
    replay->error = done ? std::string() : done.failure().text;
    return done ? 0 : -1;
  } catch (const std::exception& error) {
    replay->error = error.what();
  } catch (...) {
    replay->error = "an unknown exception";
  }
  return -1;
}

std::optional<sim::PlayMode> mode_of(int mode) {
  if (mode == TETAP_REPLAY_AUTOMATIC) return sim::PlayMode::kAutomatic;
  if (mode == TETAP_REPLAY_INPUTS) return sim::PlayMode::kLockstep;
  if (mode == TETAP_REPLAY_AS_RECORDED) return sim::PlayMode::kAsRecorded;
  return std::nullopt;
}

}  // namespace

std::uint32_t tetap_replay_api(void) { return TETAP_REPLAY_API; }

const char* tetap_replay_robots(void) {
  try {
    return sim::robot_names().c_str();
  } catch (...) {
    return "";
  }
}

tetap_replay* tetap_replay_open(const char* robot, const char* settings) {
  try {
    why_not_open.clear();
    if (robot == nullptr) return why_not_open = "no robot is named", nullptr;
    sim::ParameterSettings over;
    if (settings != nullptr) over.read(settings, "settings");
    const std::lock_guard guard(modules);
    return new tetap_replay(sim::robot_named(robot), sim::parameters_of(robot, over));
  } catch (const std::exception& error) {
    why_not_open = error.what();
  } catch (...) {
    why_not_open = "an unknown exception";
  }
  return nullptr;
}

void tetap_replay_close(tetap_replay* replay) { delete replay; }

const char* tetap_replay_error(const tetap_replay* replay) {
  return replay == nullptr ? why_not_open.c_str() : replay->error.c_str();
}

const char* tetap_replay_complaint(const tetap_replay* replay) {
  return replay == nullptr ? "" : replay->complaint.c_str();
}

const char* tetap_replay_parameters(tetap_replay* replay) {
  guarded(replay, [replay]() -> sim::Result<> {
    replay->json = sim::parameters_json(replay->stated);
    return {};
  });
  return replay == nullptr ? "" : replay->json.c_str();
}

int tetap_replay_push(tetap_replay* replay, const tetap_frame* frames, std::size_t count) {
  int taken = -1;
  const int done = guarded(replay, [&]() -> sim::Result<> {
    constexpr std::size_t kMost = 1 << 30;
    if ((frames == nullptr && count > 0) || count > kMost)
      return sim::Failure{std::to_string(count) + " frames " + (frames == nullptr ? "at no place" : "at once")};
    return replay->push({frames, count}, taken);
  });
  return done == 0 ? taken : -1;
}

int tetap_replay_tick(tetap_replay* replay, std::int64_t time_us) {
  return guarded(replay, [&] { return replay->tick(base::Micros{time_us}); });
}

int tetap_replay_play(tetap_replay* replay, const char* log, std::size_t size, const char* name, int mode,
                      tetap_replay_result* result) {
  return guarded(replay, [&]() -> sim::Result<> {
    replay->complaint.clear();
    replay->began_with.clear();
    const auto settled = mode_of(mode);
    if (log == nullptr) return sim::Failure{"no log is given"};
    if (!settled) return sim::Failure{"no mode " + std::to_string(mode)};
    tetap_replay_result made{};
    auto played = replay->play({log, size}, name == nullptr ? "log" : name, *settled, made);
    if (played && result != nullptr) *result = made;
    return played;
  });
}

std::size_t tetap_replay_read(tetap_replay* replay, tetap_frame* frames, std::size_t room) {
  return replay == nullptr ? 0 : replay->frames.read(frames, room);
}

const char* tetap_replay_began_with(const tetap_replay* replay) {
  return replay == nullptr ? "" : replay->began_with.c_str();
}
