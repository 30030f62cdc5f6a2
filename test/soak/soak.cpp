// SPDX-License-Identifier: Apache-2.0
// soak FIRST COUNT: lives of the rover's firmware on a hostile bus, one line of JSON each. A life is a run of the
// simulated world; the attack, its strength and the node's parameters follow from the life's number. Held against every
// tick: finite states, positive definite covariances, frames that decode, as many ticks as periods. A node that refuses
// all of an attack computes the same bits as one that is left alone. Valid flags are honest where damaged samples have
// guards, and a minute after an attack of any kind.
#include "config/rover.hpp"
#include "hostile_bus.hpp"
#include "sim_host/world_source.hpp"
#include "tetap/base/state_hash.hpp"
#include "tetap/bus/decoder.hpp"
#include "tetap/firmware/firmware.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>
#include <vector>

namespace tetap::soak {
namespace {

/// The first complaint of a life.
struct Complaints {
  std::string first;
  std::uint64_t count = 0;
  void add(const char* what, double time_s) {
    if (count++ > 0) return;
    std::array<char, 96> text{};
    std::snprintf(text.data(), text.size(), "%s at %.2f s", what, time_s);
    first = text.data();
  }
};
Complaints* complaints = nullptr;
double now_s = 0;

/// Cholesky of the correlations, in double.
template <class Covariance>
bool positive_definite(const Covariance& p) {
  constexpr std::size_t kN = nav::InsState::kErrors;
  std::array<std::array<double, kN>, kN> l{};
  const auto entry = [&p](std::size_t i, std::size_t j) {
    return static_cast<double>(p(static_cast<int>(i), static_cast<int>(j)));
  };
  for (std::size_t i = 0; i < kN; ++i)
    for (std::size_t j = 0; j <= i; ++j) {
      double sum = entry(j, i) / std::sqrt(entry(i, i) * entry(j, j));
      for (std::size_t k = 0; k < j; ++k) sum -= l[i][k] * l[j][k];
      if (i == j && !(sum > 0)) return false;
      l[i][j] = i == j ? std::sqrt(sum) : sum / l[j][j];
    }
  return true;
}

/// The rover's inertial estimator, looked at after every tick.
class Watched : public robot::rover::Inertial {
 public:
  void advance(base::Micros t, const estimators::Context& ctx, const sensor::Window& window) {
    robot::rover::Inertial::advance(t, ctx, window);
    const estimators::InertialEstimate e = inertial(ctx);
    if (!e.valid) return;
    const auto& q = e.state.q_nb;
    double norm2 = 0;
    for (const double part :
         {static_cast<double>(q.w), static_cast<double>(q.x), static_cast<double>(q.y), static_cast<double>(q.z)})
      norm2 += part * part;
    if (!e.state.finite()) complaints->add("a state that is not finite", now_s);
    if (!(std::abs(norm2 - 1) < 1e-3)) complaints->add("a quaternion that is no rotation", now_s);
    if (!positive_definite(e.p)) complaints->add("a covariance that is not positive definite", now_s);
  }
};
using Robot = node::WithBusProtection<node::Estimators<estimators::Odometry, robot::rover::Attitude, Watched>>;

template <class... Messages>
struct Every {
  static bool decodes(std::uint32_t offset, std::span<const std::uint8_t> p) {
    return (is<Messages>(offset, p) || ...);
  }

 private:
  template <class M>
  static bool is(std::uint32_t offset, std::span<const std::uint8_t> p) {
    std::uint32_t instances = 1;
    if constexpr (bus::Repeated<M>) instances = M::kCount;
    for (std::uint32_t i = 0; i < instances; ++i)
      if (offset == bus::offset_of<M>(i) && bus::decode<M>(p)) return true;
    return false;
  }
};

/// The bus as the node sees it, and what it says there.
struct Can {
  std::vector<base::CanFrame> to_node;
  std::size_t next = 0;
  std::uint32_t epoch_frames = 0;
  std::uint64_t ticks = 0;
  bool position_valid = false;
  double std_x_m = 1e9, std_y_m = 1e9;
  double x_m = 0, y_m = 0;
  std::uint32_t state = 0;  ///< CRC of the last epoch's state

  bool send(const base::CanFrame& frame) {
    const std::uint32_t offset = frame.id - robot::rover::parameters.can_base;
    const auto bytes = bus::payload(frame);
    if (offset < bus::EstEpoch::kOffset || offset >= bus::kBlock || !bus::AllMessages<Every>::decodes(offset, bytes))
      complaints->add("a frame that does not decode", now_s);
    ++epoch_frames;
    if (offset == bus::EstEpoch::kOffset) epoch_frames = 1, ++ticks;
    constexpr std::uint32_t kPrimary = 2;
    if (offset == bus::offset_of<bus::EstPos>(kPrimary))
      if (const auto pos = bus::decode<bus::EstPos>(bytes)) x_m = pos->x_raw * 1e-3, y_m = pos->y_raw * 1e-3;
    if (offset == bus::offset_of<bus::EstMotion>(kPrimary))
      if (const auto motion = bus::decode<bus::EstMotion>(bytes)) position_valid = motion->pos_valid;
    if (offset == bus::offset_of<bus::EstStdPose>(kPrimary))
      if (const auto std = bus::decode<bus::EstStdPose>(bytes))
        std_x_m = static_cast<double>(std->std_x_m), std_y_m = static_cast<double>(std->std_y_m);
    if (offset == bus::EstStatus::kOffset) {
      const auto status = bus::decode<bus::EstStatus>(bytes);
      if (status->reset_cause == sensor::ResetCause::kNotFinite ||
          status->reset_cause == sensor::ResetCause::kNotPositive)
        complaints->add("a restart because of a state that was none", now_s);
    }
    if (const auto tail = offset == bus::EstStateCrc::kOffset ? bus::decode<bus::EstStateCrc>(bytes) : std::nullopt) {
      state = tail->crc;
      if (tail->frames != (epoch_frames & 0xFFU)) complaints->add("an epoch of another number of frames", now_s);
    }
    return true;
  }
  std::optional<base::CanFrame> receive() {
    if (next == to_node.size()) return std::nullopt;
    return to_node[next++];
  }
  void flush() {}
  [[nodiscard]] base::CanFaults faults() const { return {}; }
  [[nodiscard]] bool empty() const { return next == to_node.size(); }
  void give(const std::vector<base::CanFrame>& frames) { to_node = frames, next = 0; }
};
struct Board {
  Can can;
  base::Micros time;
  [[nodiscard]] base::Micros now() const { return time; }
};

struct Node {
  explicit Node(const param::Parameters& given)
      : parameters(given),
        firmware(std::make_unique<firmware::Firmware<Board, Robot>>(board, parameters, bus::Version{})) {}
  /// Frames, then the board's time: the tick of its own timer.
  void step(const std::vector<base::CanFrame>& frames, base::Micros t) {
    board.can.give(frames);
    while (!board.can.empty()) firmware->poll();
    board.time = t;
    firmware->poll();
  }
  param::Parameters parameters;
  Board board;
  std::unique_ptr<firmware::Firmware<Board, Robot>> firmware;
};

struct Life {
  Attack attack = Attack::kNone;
  bool guarded = false;  ///< samples have their guards
  param::CommandAccess commands = param::CommandAccess::kOpen;
  std::uint64_t seed = 0;
};

Life life_of(std::uint64_t number) {
  return {.attack = static_cast<Attack>(number % kAttackNames.size()),
          .guarded = number / kAttackNames.size() % 2 == 1,
          .commands = static_cast<param::CommandAccess>(number / kAttackNames.size() % 3),
          .seed = number};
}

/// Commands, sync frames and tags that are refused must leave no trace.
bool leaves_no_trace(const Life& life) {
  const bool closed = life.commands != param::CommandAccess::kOpen;
  return life.attack == Attack::kNone || life.attack == Attack::kSyncs ||
         (life.attack == Attack::kGuards && !life.guarded) ||
         (closed && (life.attack == Attack::kMap || life.attack == Attack::kPoses || life.attack == Attack::kResets));
}

void live(std::uint64_t number) {
  constexpr base::Micros kPeriod{10'000}, kFrom{20'000'000}, kUntil{120'000'000}, kCalm{60'000'000};
  const Life life = life_of(number);
  Complaints found;
  complaints = &found;
  param::Parameters parameters = robot::rover::parameters;
  parameters.bus.commands = life.commands;
  parameters.bus.guard = life.guarded ? 1 : 0;
  parameters.bus.key = {static_cast<std::uint32_t>(number), 1, 2, 3};
  Node attacked(parameters), alone(parameters);
  const bool compares = leaves_no_trace(life);
  HostileBus hostile(life.attack, parameters.can_base, number);
  sim::World::Options options;
  options.inertial = true;
  // The fixes give the start: a node that takes no commands has no other.
  sim::WorldSource source(sim::World(options, number), parameters.can_base, kPeriod, {3'600'000'000}, false);
  if (life.guarded) source.send_guards();
  std::vector<base::CanFrame> honest, arrives;
  std::uint64_t ticks = 0, dishonest = 0, valid = 0;
  double worst = 0;
  sim::Tick tick;
  while (source.next(tick)) {
    honest.assign(tick.inputs.begin(), tick.inputs.end());
    // The rover has no use for a landmark map.
    std::erase_if(honest, [&](const auto& f) { return f.id == parameters.can_base + bus::InMapEntry::kOffset; });
    const base::Micros since = tick.time - source.world().start();
    now_s = static_cast<double>(since.us) * 1e-6;
    const bool on = since >= kFrom && since < kUntil;
    if (on) hostile.pass(honest, tick.time, arrives);
    attacked.step(on ? arrives : honest, tick.time);
    if (compares) {
      alone.step(honest, tick.time);
      if (attacked.board.can.state != alone.board.can.state)
        found.add("other bits than a node that was left alone", now_s);
    }
    ++ticks;
    const Can& says = attacked.board.can;
    if (!says.position_valid) continue;
    ++valid;
    const bool judged = (is_damage(life.attack) && life.guarded) || compares || since < kFrom || since > kUntil + kCalm;
    const sim::Truth& truth = source.truth();
    const double ratio =
        std::max(std::abs(says.x_m - truth.x_m) / says.std_x_m, std::abs(says.y_m - truth.y_m) / says.std_y_m) / 3;
    if (!judged) continue;
    worst = std::max(worst, ratio);
    if (ratio > 10) ++dishonest, found.add("valid at ten times its 3 sigma", now_s);
  }
  if (attacked.board.can.ticks < ticks - 2 || attacked.board.can.ticks > ticks + 2)
    found.add("another number of ticks than periods", now_s);
  std::printf(
      "{\"life\": %llu, \"attack\": \"%s\", \"commands\": %d, \"guarded\": %s, \"hostile_frames\": %llu, \"ticks\": "
      "%llu, "
      "\"valid_share\": %.3f, \"worst_ratio\": %.2f, \"complaints\": %llu, \"first\": \"%s\"}\n",
      static_cast<unsigned long long>(number), kAttackNames[static_cast<std::size_t>(life.attack)].data(),
      static_cast<int>(life.commands), life.guarded ? "true" : "false",
      static_cast<unsigned long long>(hostile.hostile()), static_cast<unsigned long long>(ticks),
      static_cast<double>(valid) / static_cast<double>(ticks), worst, static_cast<unsigned long long>(found.count),
      found.first.c_str());
  std::fflush(stdout);
}

}  // namespace
}  // namespace tetap::soak

int main(int argc, char** argv) {
  if (argc != 3) return std::fputs("usage: soak FIRST COUNT\n", stderr), 2;
  const std::uint64_t first = std::strtoull(argv[1], nullptr, 10), count = std::strtoull(argv[2], nullptr, 10);
  for (std::uint64_t life = first; life < first + count; ++life) tetap::soak::live(life);
  return 0;
}
