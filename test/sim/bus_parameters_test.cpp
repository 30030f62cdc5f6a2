// SPDX-License-Identifier: Apache-2.0
// A rover whose parameters are changed over the bus, against one that was built with them; and what is refused.
#include "config/rover.hpp"
#include "sim_host/world_source.hpp"
#include "tetap/node/node.hpp"
#include "tetap/param/limits.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace tetap::sim {
namespace {

using Robot = node::WithBusProtection<node::WithBusParameters<robot::rover::Estimators>>;
using Node = node::Node<Robot>;
using Frames = std::vector<base::CanFrame>;
using bus::ParamAnswer;
constexpr base::Micros kPeriod{10'000};
const param::Parameters& kCompiled = robot::rover::parameters;
constexpr std::uint32_t kName = param::StagedParameters::kName;

struct Epoch {
  Frames inputs;
  base::Micros time;
};

std::vector<Epoch> drive(int seconds) {
  WorldSource source(World({.inertial = true}, 11), kCompiled.can_base, kPeriod, base::Micros{1'000'000LL * seconds});
  std::vector<Epoch> epochs;
  Tick tick;
  while (source.next(tick)) epochs.push_back({{tick.inputs.begin(), tick.inputs.end()}, tick.time});
  return epochs;
}
const std::vector<Epoch>& half_a_minute() {
  static const std::vector<Epoch> epochs = drive(30);
  return epochs;
}

struct Bench {
  explicit Bench(const param::Parameters& parameters) : node(parameters, {}) { node.power_on({}); }
  Frames epoch(const Epoch& tick, const Frames& commands = {}) {
    Frames sent;
    for (const base::CanFrame& frame : commands) node.on_frame(frame);
    for (const base::CanFrame& frame : tick.inputs) node.on_frame(frame);
    node.tick(tick.time, {}, [&](const base::CanFrame& frame) { sent.push_back(frame); });
    return sent;
  }
  template <class Message>
  [[nodiscard]] base::CanFrame command(Message message) {
    message.ctr = counter++ & 0xF;
    return bus::frame(kCompiled.can_base, bus::protect(message));
  }
  [[nodiscard]] Frames sets(const param::Parameters& wanted) {
    Frames all;
    for (const param::Row& row : param::kTable)
      for (std::size_t word = 0; word < row.size / 4; ++word) {
        const auto of = [&](const param::Parameters& p) {
          std::uint32_t value = 0;
          std::memcpy(&value, reinterpret_cast<const char*>(&p) + row.offset + 4 * word, 4);
          return value;
        };
        if (of(wanted) == of(kCompiled)) continue;
        all.push_back(command(bus::CmdParamSet{
            .set_word = static_cast<std::uint8_t>(word), .set_row_id = row.index, .set_value = of(wanted)}));
      }
    return all;
  }
  [[nodiscard]] Frames change_to(const param::Parameters& wanted) {
    Frames all = sets(wanted);
    all.push_back(command(bus::CmdParamApply{.apply_before_crc = param::crc(kCompiled) & kName,
                                             .apply_after_crc = param::crc(wanted) & kName}));
    return all;
  }
  Node node;
  std::uint8_t counter = 0;
};

/// All but the version and what is about parameters alone.
Frames estimates(const Frames& sent) {
  Frames kept;
  for (const base::CanFrame& frame : sent) {
    const std::uint32_t offset = frame.id - kCompiled.can_base;
    if (offset != bus::EstParamRow::kOffset && offset != bus::EstVersion::kOffset && offset != bus::EstEpoch::kOffset &&
        offset != bus::EstStateCrc::kOffset)
      kept.push_back(frame);
  }
  return kept;
}
/// Position and motion of the rover's third estimate, which is its primary one, without the number of the epoch.
Frames poses(const Frames& sent) {
  Frames kept;
  for (base::CanFrame frame : sent)
    if (const std::uint32_t offset = frame.id - kCompiled.can_base;
        offset == bus::EstPos::kOffset + 2 * bus::EstPos::kStride) {
      frame.data[7] &= 0xF0;
      kept.push_back(frame);
    } else if (offset == bus::EstMotion::kOffset + 2 * bus::EstMotion::kStride) {
      frame.data[6] &= 0xF0;
      kept.push_back(frame);
    }
  return kept;
}
std::uint32_t state_of(const Frames& sent) { return bus::decode<bus::EstStateCrc>(bus::payload(sent.back()))->crc; }
template <class Message>
std::vector<Message> said(const Frames& sent) {
  std::vector<Message> all;
  for (const base::CanFrame& frame : sent)
    if (frame.id == kCompiled.can_base + Message::kOffset)
      if (const auto message = bus::decode<Message>(bus::payload(frame))) all.push_back(*message);
  return all;
}
/// Answer of the node to one frame.
template <class Message>
ParamAnswer answer(Bench& bench, std::size_t& at, const Message& message) {
  Frames sent = bench.epoch(half_a_minute()[at++], {bench.command(message)});
  for (int wait = 0; wait < 3; ++wait) {
    for (const auto& row : said<bus::EstParamRow>(sent))
      if (row.row_ctr == ((bench.counter - 1) & 0xF)) return row.row_answer;
    for (const auto& set : said<bus::EstParamSet>(sent))
      if (set.set_ctr == ((bench.counter - 1) & 0xF)) return set.set_answer;
    sent = bench.epoch(half_a_minute()[at++]);
  }
  return ParamAnswer::kBusy;
}
/// A neighbour of the row's value that breaks no rule; as compiled where there is none.
param::Parameters with_other(const param::Row& row, std::size_t element) {
  const double value = row.get(kCompiled, element), span = row.maximum - row.minimum;
  for (const double other : {value * 1.1, value * 0.9, value + 1, value - 1, value + 0.01 * span, value - 0.01 * span,
                             row.minimum, row.maximum}) {
    param::Parameters q = kCompiled;
    row.set(q, element, other);
    if (param::crc(q) != param::crc(kCompiled) && param::within(row, row.get(q, element)) &&
        param::broken_rule(q) == nullptr)
      return q;
  }
  return kCompiled;
}

/// Groups of which a rover reads no row.
bool is_of_another_robot(std::string_view path) {
  constexpr std::array kGroups{"baro.",    "landmark.",  "lidar.",  "magnetic.",
                               "mapping.", "particles.", "target.", "wheels.noise."};
  return std::any_of(kGroups.begin(), kGroups.end(), [&](const char* group) { return path.starts_with(group); });
}
/// Limits that a tenth more or less does not move across anything within four seconds of this drive.
const std::set<std::string> kLimits{"disagreement.after_us",
                                    "disagreement.heading_rad",
                                    "disagreement.tilt_rad",
                                    "gnss.align_distance_m",
                                    "gnss.heading_stuck_samples",
                                    "gyro.bias_time_s",
                                    "gyro.standstill_mps",
                                    "gnss.sigma_floor_m",
                                    "inertial.calm_mps2",
                                    "inertial.calm_radps",
                                    "inertial.constrain_every_us",
                                    "inertial.gap_mps2",
                                    "inertial.gap_radps",
                                    "inertial.gap_wheels_radps",
                                    "inertial.slip_mps",
                                    "inertial.stale_us",
                                    "inertial.still_gnss_mps",
                                    "inertial.still_mps",
                                    "inertial.still_radps",
                                    "inertial.stuck_samples",
                                    "inertial.vibration_mps2",
                                    "inertial.vibration_radps",
                                    "inertial.wheel_gate_scale",
                                    "inertial.wheels_every_us",
                                    "loop.turn_radps2",
                                    "loop.work_units",
                                    "recovery.after_us",
                                    "recovery.at_least",
                                    "recovery.confirm_fixes",
                                    "recovery.frozen_m",
                                    "recovery.inflate_position_m",
                                    "recovery.inflate_yaw_rad",
                                    "recovery.persist_fixes",
                                    "recovery.persist_us",
                                    "wheels.most_mps",
                                    "wheels.timeout_noise",
                                    "wheels.timeout_us"};

TEST(BusParameters, AppliedBeforeTheFirstSampleAreThoseThatTheRobotIsBuiltWith) {
  const auto& epochs = half_a_minute();
  std::size_t rows = 0;
  for (const param::Row& row : param::kTable) {
    if (row.effect != param::Effect::kLive) continue;
    const param::Parameters wanted = with_other(row, 0);
    ASSERT_NE(param::crc(wanted), param::crc(kCompiled)) << row.path;
    Bench built(wanted), changed(kCompiled);
    for (std::size_t k = 0; k < 500; ++k)
      ASSERT_EQ(estimates(built.epoch(epochs[k])),
                estimates(changed.epoch(epochs[k], k == 0 ? changed.change_to(wanted) : Frames{})))
          << row.path << ", epoch " << k;
    ++rows;
  }
  EXPECT_GE(rows, 100U);
}

TEST(BusParameters, ActFromTheirTickOn) {
  const auto& epochs = half_a_minute();
  constexpr std::size_t kAt = 2000;
  std::set<std::string> idle;
  Bench straight(kCompiled);
  for (std::size_t k = 0; k < kAt; ++k) straight.epoch(epochs[k]);
  std::vector<std::uint32_t> states;
  std::vector<Frames> frames;
  Bench on(kCompiled);
  on.node.resume(straight.node);
  for (std::size_t k = kAt; k < kAt + 400; ++k) {
    const Frames sent = on.epoch(epochs[k], k == kAt ? on.change_to(kCompiled) : Frames{});  // an Apply of nothing
    states.push_back(state_of(sent)), frames.push_back(estimates(sent));
  }
  for (const param::Row& row : param::kTable) {
    if (row.effect != param::Effect::kLive) continue;
    const param::Parameters wanted = with_other(row, 0);
    Bench bench(kCompiled);
    bench.node.resume(straight.node);
    bool acts = false;
    for (std::size_t k = kAt; k < kAt + 400 && !acts; ++k) {
      const Frames sent = bench.epoch(epochs[k], k == kAt ? bench.change_to(wanted) : Frames{});
      acts = state_of(sent) != states[k - kAt] || estimates(sent) != frames[k - kAt];
    }
    if (is_of_another_robot(row.path)) {
      EXPECT_FALSE(acts) << row.path;
    } else if (!acts) {
      idle.insert(row.path);
    }
  }
  EXPECT_EQ(idle, kLimits);
}

TEST(BusParameters, ThatNeedARestartActAsInARobotThatIsBuiltWithThemAndSwitchedOnThen) {
  constexpr std::size_t kAt = 150;
  const auto& epochs = half_a_minute();
  Bench straight(kCompiled);
  for (std::size_t k = 0; k < kAt; ++k) straight.epoch(epochs[k]);
  std::size_t rows = 0;
  for (std::size_t i = 0; i < param::kTable.size(); ++i) {
    const param::Row& row = param::kTable[i];
    if (param::kStoredRows[i].live || param::kStoredRows[i].access) continue;
    const param::Parameters wanted = with_other(row, 0);
    if (param::crc(wanted) == param::crc(kCompiled)) continue;
    Bench changed(kCompiled), built(wanted);
    changed.node.resume(straight.node);
    Frames commands = changed.sets(wanted);
    commands.push_back(changed.command(bus::CmdParamRestart{.restart_before_crc = param::crc(kCompiled) & kName,
                                                            .restart_after_crc = param::crc(wanted) & kName}));
    changed.epoch(epochs[kAt], commands);
    built.node.power_on(epochs[kAt].time);
    built.epoch({{}, epochs[kAt].time});
    ASSERT_EQ(param::crc(changed.node.parameter_sets().active()), param::crc(wanted)) << row.path;
    EXPECT_EQ(changed.node.parameter_sets().pending(), 0U);
    for (std::size_t k = kAt + 1; k < kAt + 300; ++k) {
      const Frames one = changed.epoch(epochs[k]), other = built.epoch(epochs[k]);
      ASSERT_EQ(changed.node.window_crc(), built.node.window_crc()) << row.path << ", epoch " << k;
      ASSERT_EQ(poses(one), poses(other)) << row.path << ", epoch " << k;
    }
    ++rows;
  }
  EXPECT_GE(rows, 70U);
}

TEST(BusParameters, RestartOnlyANodeThatRests) {
  std::size_t at = 0;
  Bench bench(kCompiled);
  const std::uint32_t name = param::crc(kCompiled) & kName;
  const bus::CmdParamRestart restart{.restart_before_crc = name, .restart_after_crc = name};
  EXPECT_EQ(answer(bench, at, restart), ParamAnswer::kBusy) << "not for a second yet";
  while (at < 150) bench.epoch(half_a_minute()[at++]);
  EXPECT_EQ(answer(bench, at, bus::CmdParamRestart{.restart_before_crc = name ^ 1, .restart_after_crc = name}),
            ParamAnswer::kOtherActive);
  EXPECT_EQ(answer(bench, at, bus::CmdParamRestart{.restart_before_crc = name, .restart_after_crc = name ^ 1}),
            ParamAnswer::kOtherStaged);
  bench.node.reset(bus::ResetWhat::kSnapshot);
  EXPECT_EQ(answer(bench, at, restart), ParamAnswer::kDone);
  EXPECT_TRUE(bench.node.take_snapshot_request()) << "asked for in the same tick";
  EXPECT_EQ(answer(bench, at, restart), ParamAnswer::kBusy) << "not for a second after a restart";
  while (at < 2000) bench.epoch(half_a_minute()[at++]);
  EXPECT_EQ(answer(bench, at, restart), ParamAnswer::kBusy) << "it drives";
  param::Parameters locked = kCompiled;
  locked.bus.commands = param::CommandAccess::kAuthenticated;
  locked.bus.key = {1, 2, 3, 4};
  Bench owned(locked);
  for (at = 0; at < 150;) owned.epoch(half_a_minute()[at++]);
  EXPECT_EQ(answer(owned, at, restart), ParamAnswer::kRefused) << "without a tag";
}

TEST(BusParameters, AreToldAfterAChangeAndAfterABegin) {
  const auto& epochs = half_a_minute();
  param::Parameters wanted = kCompiled;
  wanted.inertial.gyro_radps_rthz *= 2;
  wanted.gnss.gate_scale *= 2;
  Bench bench(kCompiled);
  std::map<std::uint16_t, std::uint32_t> told;
  std::vector<bus::EstParamSet> sets;
  for (std::size_t k = 0; k < 200; ++k) {
    const Frames sent = bench.epoch(epochs[k], k == 100 ? bench.change_to(wanted) : Frames{});
    EXPECT_LE(said<bus::EstParamRow>(sent).size() + said<bus::EstParamSet>(sent).size(), 1U);
    for (const auto& row : said<bus::EstParamRow>(sent))
      if (row.row_source == bus::ParamSource::kActive) told[row.row_id] = row.row_value;
    for (const auto& set : said<bus::EstParamSet>(sent)) sets.push_back(set);
  }
  ASSERT_EQ(sets.size(), 2U);  // power-on, Apply
  EXPECT_EQ(sets[0].set_config, param::crc(kCompiled));
  EXPECT_EQ(sets[0].set_changed, 0);
  EXPECT_EQ(sets[1].set_answer, ParamAnswer::kDone);
  EXPECT_EQ(sets[1].set_config, param::crc(wanted));
  EXPECT_EQ(sets[1].set_changed, 2);
  EXPECT_EQ(told.size(), 2U);
  for (const param::Row& row : param::kTable)
    if (const auto it = told.find(row.index); it != told.end()) {
      float value = 0;
      std::memcpy(&value, &it->second, sizeof value);
      EXPECT_EQ(static_cast<double>(value), row.get(wanted, 0)) << row.path;
    }
  told.clear();
  bench.node.power_on({});
  for (std::size_t k = 0; k < 100; ++k)
    for (const auto& row : said<bus::EstParamRow>(bench.epoch(epochs[k]))) told[row.row_id] = row.row_value;
  EXPECT_EQ(told.size(), 2U) << "a Begin frame does not take them back";
}

std::uint16_t index_of(const std::string& path) {
  for (const param::Row& row : param::kTable)
    if (path == row.path) return row.index;
  ADD_FAILURE() << path;
  return 0xFFF;
}
bus::CmdParamSet set_of(const std::string& path, float value) {
  bus::CmdParamSet set{.set_row_id = index_of(path)};
  std::memcpy(&set.set_value, &value, sizeof value);
  return set;
}

TEST(BusParameters, ThatAreWrongChangeNothing) {
  Bench bench(kCompiled), untouched(kCompiled);
  std::size_t at = 0;
  const std::uint32_t before = param::crc(kCompiled) & kName;
  EXPECT_EQ(answer(bench, at, set_of("inertial.gyro_radps_rthz", 1e9F)), ParamAnswer::kOutOfLimits);
  EXPECT_EQ(answer(bench, at, set_of("inertial.gyro_radps_rthz", base::kNan)), ParamAnswer::kOutOfLimits);
  EXPECT_EQ(answer(bench, at, bus::CmdParamSet{.set_row_id = 0xFFE}), ParamAnswer::kUnknown);
  EXPECT_EQ(answer(bench, at, bus::CmdParamSet{.set_word = 15, .set_row_id = index_of("gnss.gate_scale")}),
            ParamAnswer::kUnknown);
  for (const char* path : {"can_base", "bus.commands", "bus.key", "loop.lockstep", "loop.period_us"})
    EXPECT_EQ(answer(bench, at, bus::CmdParamSet{.set_row_id = index_of(path)}), ParamAnswer::kRefused) << path;
  EXPECT_EQ(answer(bench, at, bus::CmdParamGet{.get_row_id = index_of("bus.key")}), ParamAnswer::kUnknown);
  EXPECT_EQ(answer(bench, at, bus::CmdParamSave{}), ParamAnswer::kBusy) << "the firmware around the node answers it";
  EXPECT_TRUE(bench.node.parameter_commands().take_save());
  EXPECT_EQ(answer(bench, at, bus::CmdParamApply{.apply_before_crc = before ^ 1, .apply_after_crc = before}),
            ParamAnswer::kOtherActive);
  // Somebody else's row is staged: the Apply that does not know it fails.
  EXPECT_EQ(answer(bench, at, set_of("gnss.gate_scale", 2)), ParamAnswer::kDone);
  EXPECT_EQ(answer(bench, at, bus::CmdParamApply{.apply_before_crc = before, .apply_after_crc = before}),
            ParamAnswer::kOtherStaged);
  base::CanFrame damaged = bench.command(bus::CmdParamRestore{.restore_before_crc = before});
  damaged.data[3] ^= 1;
  bench.epoch(half_a_minute()[at++], {damaged});
  Frames last, expected;
  for (std::size_t k = at; k < at + 20; ++k) last = bench.epoch(half_a_minute()[k]);
  for (std::size_t k = 0; k < at + 20; ++k) expected = untouched.epoch(half_a_minute()[k]);
  EXPECT_EQ(state_of(last), state_of(expected));
}

TEST(BusParameters, AreRestoredButForThoseOfAccess) {
  Bench bench(kCompiled);
  param::Parameters wanted = kCompiled;
  wanted.gnss.gate_scale *= 2;
  std::size_t at = 0;
  bench.epoch(half_a_minute()[at++], bench.change_to(wanted));
  for (int k = 0; k < 8; ++k) bench.epoch(half_a_minute()[at++]);
  EXPECT_EQ(answer(bench, at, bus::CmdParamRestore{.restore_before_crc = param::crc(wanted) & kName}),
            ParamAnswer::kDone);
  EXPECT_EQ(answer(bench, at, bus::CmdParamRestore{.restore_before_crc = param::crc(kCompiled) & kName}),
            ParamAnswer::kDone);
}

TEST(BusParameters, NeedTheTagWhereCommandsNeedIt) {
  param::Parameters locked = kCompiled;
  locked.bus.commands = param::CommandAccess::kAuthenticated;
  locked.bus.key = {1, 2, 3, 4};
  Bench bench(locked);
  std::size_t at = 0;
  const std::uint32_t before = param::crc(locked) & kName;
  EXPECT_EQ(answer(bench, at, set_of("gnss.gate_scale", 2)), ParamAnswer::kDone) << "it stages only";
  EXPECT_EQ(answer(bench, at, bus::CmdParamRestore{.restore_before_crc = before}), ParamAnswer::kRefused);
  param::Parameters closed = kCompiled;
  closed.bus.commands = param::CommandAccess::kNone;
  Bench none(closed);
  EXPECT_EQ(answer(none, at, set_of("gnss.gate_scale", 2)), ParamAnswer::kRefused);
  EXPECT_EQ(answer(none, at, bus::CmdParamGet{.get_row_id = index_of("gnss.gate_scale")}), ParamAnswer::kDone);
}

}  // namespace
}  // namespace tetap::sim
