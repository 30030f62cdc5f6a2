// SPDX-License-Identifier: Apache-2.0
// Parameters that a board keeps: from frames of Cmd_Param through the drivers of both chips' flash to a node that is
// powered on anew.
#include "hal/chip/stm32/flash_storage_f4.hpp"
#include "hal/chip/stm32/flash_storage_g4.hpp"
#include "sim_host/parameter_word.hpp"
#include "tetap/firmware/firmware.hpp"

#include "bench.hpp"
#include "queued_can.hpp"
#include "test/hal/fake_flash.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <map>
#include <memory>
#include <string>

namespace tetap::test {
namespace {

using bus::ParamAnswer;
using KeepingRobot = node::WithBusParameters<node::Estimators<estimators::Odometry, estimators::PoseEkf>>;
using Sector = hal::stm32::FlashStorageF4<FlashRegisters, FlashWords>;
using Pages = hal::stm32::FlashStorageG4<FlashRegisters, FlashWords, FlashTrap>;

/// Any Begin puts it into lockstep.
const param::Parameters kKept = [] {
  param::Parameters p = kNumbers;
  p.loop.lockstep = param::Lockstep::kPlain;
  return p;
}();

template <class Driver>
struct KeepingBoard {
  QueuedCan can;
  using Storage = Driver;
  static inline FakeFlash* flash = nullptr;
  static Storage storage() { return Storage{FlashRegisters{flash}, FlashWords{flash}, 100}; }
  void begin_storing() { flash->done.emplace_back("longer"); }
  void end_storing() { flash->done.emplace_back("shorter"); }
  base::Micros time{1'000'000};
  [[nodiscard]] base::Micros now() const { return time; }
};

/// A board that can be powered on again; its flash stays.
template <class Driver>
struct Keeping {
  using Board = KeepingBoard<Driver>;
  Keeping() { power_cycle(); }
  ~Keeping() { EXPECT_EQ(flash.wrong, std::vector<std::string>{}); }
  void power_cycle() {
    Board::flash = &flash;
    flash.control |= 1U << 31;
    board = std::make_unique<Board>();
    firmware = std::make_unique<firmware::Firmware<Board, KeepingRobot>>(*board, kKept, bus::Version{});
    poll_for(1'200'000);
  }
  void poll_for(std::int64_t us) {
    for (const base::Micros until = board->time + base::Micros{us}; board->time < until;
         board->time += base::Micros{5000})
      firmware->poll();
  }
  /// The answer to a frame of Cmd_Param: page, answer and value.
  template <class Message>
  ParamAnswer ask(Message message) {
    message.ctr = ++counter & 0xF;
    board->can.to_node.push_back(bus::frame(kKept.can_base, bus::protect(message)));
    const std::size_t before = board->can.sent.size();
    poll_for(40'000);
    for (std::size_t i = before; i < board->can.sent.size(); ++i) {
      if (const auto row = said<bus::EstParamRow>(board->can.sent[i]); row && row->row_ctr == (counter & 0xF))
        return value = row->row_value, row->row_answer;
      if (const auto set = said<bus::EstParamSet>(board->can.sent[i]); set && set->set_ctr == (counter & 0xF))
        return told = *set, set->set_answer;
    }
    ADD_FAILURE() << "no answer";
    return ParamAnswer::kUnknown;
  }
  template <class Message>
  static std::optional<Message> said(const base::CanFrame& frame) {
    if (frame.id != kKept.can_base + Message::kOffset) return std::nullopt;
    return bus::decode<Message>(bus::payload(frame));
  }
  ParamAnswer set(std::uint16_t row, std::uint32_t to, std::uint8_t word = 0) {
    return ask(bus::CmdParamSet{.set_word = word, .set_row_id = row, .set_value = to});
  }
  std::uint32_t get(std::uint16_t row, std::uint8_t word = 0) {
    EXPECT_EQ(ask(bus::CmdParamGet{.get_word = word, .get_row_id = row}), ParamAnswer::kDone);
    return value;
  }
  /// As the answers say that the node has it.
  ParamAnswer stage(const param::Row& row, std::uint32_t to, std::uint8_t word = 0) {
    const ParamAnswer is = set(row.index, to, word);
    if (is == ParamAnswer::kDone) sim::put_word(staged, row, word, to);
    return is;
  }
  ParamAnswer apply() {
    const ParamAnswer is = ask(bus::CmdParamApply{.apply_before_crc = param::crc(active) & 0xFFFFFF,
                                                  .apply_after_crc = param::crc(staged) & 0xFFFFFF});
    for (const param::Row& row : param::kTable)
      if (is == ParamAnswer::kDone && row.effect == param::Effect::kLive)
        std::memcpy(reinterpret_cast<char*>(&active) + row.offset, reinterpret_cast<const char*>(&staged) + row.offset,
                    row.size);
    return is;
  }
  ParamAnswer save() { return ask(bus::CmdParamSave{.save_before_crc = param::crc(active) & 0xFFFFFF}); }

  FakeFlash flash{std::is_same_v<Driver, Pages>};
  std::unique_ptr<Board> board;
  std::unique_ptr<firmware::Firmware<Board, KeepingRobot>> firmware;
  bus::EstParamSet told;
  std::uint32_t value = 0;
  std::uint8_t counter = 0;
  param::Parameters staged = kKept, active = kKept;
};

template <class Driver>
struct KeptParametersTest : testing::Test {};
using KeepingDrivers = testing::Types<Sector, Pages>;
TYPED_TEST_SUITE(KeptParametersTest, KeepingDrivers);

const param::Row& row_of(const std::string& path) {
  for (const param::Row& row : param::kTable)
    if (path == row.path) return row;
  throw std::runtime_error(path);
}
constexpr std::uint32_t kTwo = 0x40000000;  ///< 2.0F

TYPED_TEST(KeptParametersTest, EachRowIsSetRefusedOutOfItsLimitsSavedAndThereAfterAPowerCycle) {
  std::size_t kept = 0;
  for (const param::Row& row : param::kTable) {
    if (param::is_secret(row)) continue;
    Keeping<TypeParam> bench;
    const std::uint32_t compiled = bench.get(row.index);
    if (row.storage == param::Storage::kFloat) {
      EXPECT_NE(bench.set(row.index,
                          std::bit_cast<std::uint32_t>(std::nextafter(static_cast<float>(row.maximum), 1e30F) * 2 + 1)),
                ParamAnswer::kDone)
          << row.path;
    }
    // A neighbour that breaks no rule, as the host's table has it.
    param::Parameters wanted = kKept;
    const double span = row.maximum - row.minimum, before = row.get(kKept, 0);
    for (const double other :
         {before * 1.1, before * 0.9, before + 1, before - 1, before + 0.01 * span, row.minimum, row.maximum}) {
      param::Parameters q = kKept;
      row.set(q, 0, other);
      if (param::crc(q) == param::crc(kKept) || !param::within(row, row.get(q, 0)) || param::broken_rule(q) != nullptr)
        continue;
      wanted = q;
      break;
    }
    ParamAnswer is = ParamAnswer::kDone;
    for (std::uint8_t word = 0; word < row.size / 4 && is == ParamAnswer::kDone; ++word)
      if (sim::word_of(wanted, row, word) != sim::word_of(kKept, row, word))
        is = bench.stage(row, sim::word_of(wanted, row, word), word);
    if (is == ParamAnswer::kRefused) continue;
    EXPECT_EQ(is, ParamAnswer::kDone) << row.path;
    EXPECT_EQ(bench.apply(), ParamAnswer::kDone) << row.path;
    EXPECT_EQ(bench.save(), ParamAnswer::kDone) << row.path;
    bench.power_cycle();
    for (std::uint8_t word = 0; word < row.size / 4; ++word)
      EXPECT_EQ(bench.get(row.index, word), sim::word_of(wanted, row, word)) << row.path;
    kept += bench.get(row.index) != compiled || row.size > 4 ? 1U : 0U;
  }
  EXPECT_GE(kept, 190U);
}

TYPED_TEST(KeptParametersTest, ASaveEndsTheStretchAndTheWatchdogWaitsMeanwhile) {
  Keeping<TypeParam> bench;
  EXPECT_EQ(bench.stage(row_of("landmark.gate_scale"), kTwo), ParamAnswer::kDone);
  EXPECT_EQ(bench.apply(), ParamAnswer::kDone);
  bench.flash.done.clear();
  bench.board->can.sent.clear();
  EXPECT_EQ(bench.save(), ParamAnswer::kDone);
  ASSERT_GE(bench.flash.done.size(), 3U);
  EXPECT_EQ(bench.flash.done.front(), "longer");
  EXPECT_EQ(bench.flash.done.back(), "shorter");
  // Epoch 1 follows the answer, which lies between two epochs, and the version.
  std::string order;
  for (const base::CanFrame& frame : bench.board->can.sent) {
    if (const auto set = bench.template said<bus::EstParamSet>(frame);
        set && set->set_page_id == bus::CmdParamSave::kPage)
      order += "s";
    if (const auto end = bench.template said<bus::EstStateCrc>(frame))
      order += end->epoch == 1 ? "1" : end->epoch == 2 ? "2" : "e";
  }
  EXPECT_NE(order.find("es12"), std::string::npos) << order;
  // The same again writes nothing and ends nothing.
  const auto before = bench.flash.done.size();
  EXPECT_EQ(bench.save(), ParamAnswer::kDone);
  EXPECT_EQ(bench.flash.done.size(), before);
  // Another set within the minute waits.
  EXPECT_EQ(bench.stage(row_of("landmark.gate_scale"), 0x40400000), ParamAnswer::kDone);
  EXPECT_EQ(bench.apply(), ParamAnswer::kDone);
  EXPECT_EQ(bench.save(), ParamAnswer::kBusy);
  EXPECT_EQ(bench.flash.done.size(), before);
  bench.poll_for(60'000'000);
  EXPECT_EQ(bench.save(), ParamAnswer::kDone);
  bench.power_cycle();
  EXPECT_EQ(bench.get(row_of("landmark.gate_scale").index), 0x40400000U);
  EXPECT_EQ(bench.ask(bus::CmdParamRestore{.restore_before_crc = param::crc(bench.active) & 0xFFFFFF}),
            ParamAnswer::kDone);
  bench.active = bench.staged = kKept;
  EXPECT_EQ(bench.save(), ParamAnswer::kDone);
  bench.power_cycle();
  EXPECT_EQ(bench.get(row_of("landmark.gate_scale").index), sim::word_of(kKept, row_of("landmark.gate_scale"), 0));
}

TYPED_TEST(KeptParametersTest, AFloodOfSavesWritesOnceAMinute) {
  Keeping<TypeParam> bench;
  int written = 0, waiting = 0;
  const base::Micros begin = bench.board->time;
  for (std::uint32_t k = 0; bench.board->time - begin < base::Micros{130'000'000}; ++k) {
    ASSERT_EQ(bench.stage(row_of("landmark.gate_scale"), kTwo + k), ParamAnswer::kDone);
    ASSERT_EQ(bench.apply(), ParamAnswer::kDone);
    const auto before = bench.flash.done.size();
    const ParamAnswer is = bench.save();
    EXPECT_EQ(bench.flash.done.size() > before, is == ParamAnswer::kDone);
    ++(is == ParamAnswer::kDone ? written : waiting);
  }
  EXPECT_EQ(written, 3) << "at once, and after each minute";
  EXPECT_GT(waiting, 500);
  bench.poll_for(2'000'000);
  int counted = -1, told = 0, above = 0;
  for (const base::CanFrame& frame : bench.board->can.sent) {
    const auto set = bench.template said<bus::EstParamSet>(frame);
    told += set && set->set_page_id == bus::CmdParamSave::kPage && set->set_answer == ParamAnswer::kBusy ? 1 : 0;
    if (const auto limits = bench.template said<bus::EstDiagLimits>(frame)) {
      above += limits->save_refused != counted ? 1 : 0;
      counted = limits->save_refused;
    }
  }
  EXPECT_EQ(told, waiting);
  EXPECT_EQ(counted, waiting % 256) << "on the bus, modulo 256";
  EXPECT_GE(above, 100) << "it shows while the flood is on";
}

TYPED_TEST(KeptParametersTest, NothingIsSavedInMotionInLockstepOrOfAnotherSet) {
  Keeping<TypeParam> bench;
  EXPECT_EQ(bench.stage(row_of("landmark.gate_scale"), kTwo), ParamAnswer::kDone);
  EXPECT_EQ(bench.apply(), ParamAnswer::kDone);
  const auto done = bench.flash.done;
  EXPECT_EQ(bench.ask(bus::CmdParamSave{.save_before_crc = param::crc(kKept) & 0xFFFFFF}), ParamAnswer::kOtherActive);
  const auto drive = [&](float speed_mps, float yaw_rate_radps, int samples) {
    for (int k = 0; k < samples; ++k) {
      bench.board->can.to_node.push_back(body_speed(bench.board->time.us, speed_mps, yaw_rate_radps, k));
      bench.poll_for(10'000);
    }
  };
  for (const auto& [speed_mps, yaw_rate_radps] : {std::pair{-0.2F, 0.0F}, std::pair{0.0F, 0.2F}}) {
    drive(speed_mps, yaw_rate_radps, 50);
    EXPECT_EQ(bench.save(), ParamAnswer::kBusy);
    drive(0, 0, 50);
    EXPECT_EQ(bench.save(), ParamAnswer::kBusy) << "it came to rest half a second ago";
  }
  drive(0, 0, 150);
  const auto step = [&](bus::SyncKind kind, int k) {
    bench.board->can.to_node.push_back(in(bus::InSync{.time_us = static_cast<std::uint64_t>(5'000'000 + 10'000 * k),
                                                      .ctr = static_cast<std::uint8_t>(k),
                                                      .kind = kind}));
  };
  step(bus::SyncKind::kBegin, 0);
  bench.poll_for(5'000);
  bench.board->can.to_node.push_back(bus::frame(
      kKept.can_base, bus::protect(bus::CmdParamSave{.save_before_crc = param::crc(bench.active) & 0xFFFFFF})));
  for (int k = 1; k < 5; ++k) step(bus::SyncKind::kStep, k), bench.poll_for(5'000);
  ParamAnswer last = ParamAnswer::kDone;
  for (const base::CanFrame& frame : bench.board->can.sent)
    if (const auto set = bench.template said<bus::EstParamSet>(frame);
        set && set->set_page_id == bus::CmdParamSave::kPage)
      last = set->set_answer;
  EXPECT_EQ(last, ParamAnswer::kBusy);
  EXPECT_EQ(bench.flash.done, done);
}

struct Entries {
  std::map<std::uint16_t, std::uint32_t> values;
  void each(auto&& take) const {
    for (const auto& [key, value] : values) take(firmware::JournalEntry{key, value});
  }
  [[nodiscard]] std::optional<std::uint32_t> find(std::uint16_t key) const {
    const auto at = values.find(key);
    return at == values.end() ? std::nullopt : std::optional(at->second);
  }
};

TYPED_TEST(KeptParametersTest, WordsThatThisNodeDoesNotTakeAreAsCompiledAndNamed) {
  Keeping<TypeParam> bench;
  const auto key = [](const std::string& path) { return firmware::KeptSet::key(row_of(path).index, 0); };
  const auto keep = [&](const std::map<std::uint16_t, std::uint32_t>& values) {
    auto storage = KeepingBoard<TypeParam>::storage();
    firmware::Journal<TypeParam> journal(storage);
    EXPECT_EQ(journal.save(Entries{values}), firmware::Saved::kDone);
    bench.power_cycle();
    std::map<std::uint16_t, ParamAnswer> named;
    for (const base::CanFrame& frame : bench.board->can.sent)
      if (const auto row = bench.template said<bus::EstParamRow>(frame); row && row->row_answer != ParamAnswer::kDone)
        named[row->row_id] = row->row_answer;
    return named;
  };
  const auto index = [](const std::string& path) { return row_of(path).index; };
  const std::map<std::uint16_t, ParamAnswer> expected{{index("landmark.gate_scale"), ParamAnswer::kOutOfLimits},
                                                      {index("can_base"), ParamAnswer::kRefused}};
  EXPECT_EQ(keep({{0xFFE0, 7},
                  {key("landmark.gate_scale"), 0x7F800000},
                  {key("can_base"), 0x500},
                  {key("landmark.sigma_range_m"), std::bit_cast<std::uint32_t>(0.2F)}}),
            expected);
  EXPECT_EQ(bench.get(index("landmark.gate_scale")), sim::word_of(kKept, row_of("landmark.gate_scale"), 0));
  EXPECT_EQ(bench.get(index("can_base")), 0x300U) << "a node that keeps another identity is off its bus";
  EXPECT_EQ(bench.get(index("landmark.sigma_range_m")), std::bit_cast<std::uint32_t>(0.2F));
  // Wheels without a distance between them.
  EXPECT_TRUE(
      keep({{key("landmark.sigma_range_m"), std::bit_cast<std::uint32_t>(0.2F)}, {key("wheels.drive.track_m"), 0}})
          .empty());
  std::size_t named = 0;
  for (const base::CanFrame& frame : bench.board->can.sent)
    if (const auto set = bench.template said<bus::EstParamSet>(frame);
        set && set->set_answer == ParamAnswer::kNotTogether)
      ++named;
  EXPECT_EQ(named, 1U);
  EXPECT_EQ(bench.get(index("wheels.drive.track_m")), std::bit_cast<std::uint32_t>(0.5F));
  EXPECT_EQ(bench.get(index("landmark.sigma_range_m")), std::bit_cast<std::uint32_t>(0.1F));
}

TYPED_TEST(KeptParametersTest, ASetThatBreaksARuleKeepsItsClaim) {
  Keeping<TypeParam> bench;
  const auto begin_with = [&](std::map<std::uint16_t, std::uint32_t> words) {
    words[firmware::KeptSet::key(row_of("wheels.drive.track_m").index, 0)] = 0;  // breaks a rule
    words[firmware::KeptSet::key(row_of("landmark.gate_scale").index, 0)] = kTwo;
    words[firmware::KeptSet::key(row_of("bus.commands").index, 0)] = 1;
    auto storage = KeepingBoard<TypeParam>::storage();
    firmware::Journal<TypeParam> journal(storage);
    ASSERT_EQ(journal.save(Entries{words}), firmware::Saved::kDone);
    bench.power_cycle();
  };
  const std::uint16_t key = firmware::KeptSet::key(row_of("bus.key").index, 0);
  begin_with({{key, 7}, {static_cast<std::uint16_t>(key + 3), 9}});
  EXPECT_EQ(bench.get(row_of("bus.commands").index), 1U) << "commands still need a tag";
  EXPECT_EQ(bench.get(row_of("landmark.gate_scale").index), sim::word_of(kKept, row_of("landmark.gate_scale"), 0));
  EXPECT_EQ(bench.get(row_of("wheels.drive.track_m").index), std::bit_cast<std::uint32_t>(0.5F));
  EXPECT_EQ(bench.set(row_of("landmark.gate_scale").index, kTwo), ParamAnswer::kRefused);
  std::size_t named = 0;
  for (const base::CanFrame& frame : bench.board->can.sent)
    if (const auto set = bench.template said<bus::EstParamSet>(frame))
      named += set->set_answer == ParamAnswer::kNotTogether ? 1U : 0U;
  EXPECT_EQ(named, 1U);
  // A claim without its key is none: nobody could command the node.
  begin_with({});
  EXPECT_EQ(bench.get(row_of("bus.commands").index), 0U);
}

TYPED_TEST(KeptParametersTest, AFlashThatFailsLeavesTheSetBefore) {
  Keeping<TypeParam> bench;
  EXPECT_EQ(bench.stage(row_of("landmark.gate_scale"), kTwo), ParamAnswer::kDone);
  EXPECT_EQ(bench.apply(), ParamAnswer::kDone);
  EXPECT_EQ(bench.save(), ParamAnswer::kDone);
  EXPECT_EQ(bench.stage(row_of("landmark.gate_scale"), 0x40400000), ParamAnswer::kDone);
  EXPECT_EQ(bench.apply(), ParamAnswer::kDone);
  bench.poll_for(60'000'000);
  bench.flash.shut_for_good = true;
  EXPECT_EQ(bench.save(), ParamAnswer::kNotKept);
  bench.flash.shut_for_good = false;
  bench.power_cycle();
  EXPECT_EQ(bench.get(row_of("landmark.gate_scale").index), kTwo);
}

}  // namespace
}  // namespace tetap::test
