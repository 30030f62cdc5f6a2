// SPDX-License-Identifier: Apache-2.0
// A log whose node began with other parameters than its robot is built with, and a node that repeats it.
#include "sim_host/kept_words.hpp"
#include "sim_host/parameter_settings.hpp"

#include "node/bench.hpp"
#include "tetap/firmware/firmware.hpp"
#include "tetap/param/crc.hpp"

#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <vector>

namespace tetap::sim {
namespace {

using TimedFrames = std::vector<TimedFrame>;
using KeptRobot = node::WithBusParameters<node::Estimators<estimators::Odometry, estimators::PoseEkf>>;

const param::Parameters kBuilt = [] {
  param::Parameters p = test::kNumbers;
  p.loop.lockstep = param::Lockstep::kPlain;
  return p;
}();
const param::Parameters kOther = [] {
  param::Parameters p = kBuilt;
  p.wheels.drive.left_radius_m = 0.11F;  // needs a restart
  p.landmark.gate_scale = 2;
  p.gnss.origin_latitude_2ndeg = -3'625'000'000;  // -7.25 deg, two words
  return p;
}();

/// A node in memory; its clock goes on with each poll.
struct MemoryTwin {
  struct Board {
    hal::MemoryCan can;
    base::Micros time{1'000'000};
    [[nodiscard]] base::Micros now() { return time; }
  };
  hal::MemoryBus bus;
  Board board{bus.node_end()};
  firmware::Firmware<Board, KeptRobot> firmware{board, kBuilt, bus::Version{}};
  InProcessLink link{bus, [this] { board.time += base::Micros{500}, firmware.poll(); }};

  void sync(bus::SyncKind kind, int k) {
    EXPECT_TRUE(link.send(sync_frame(0x300, kind, {5'000'000 + 10'000 * k}, static_cast<std::uint8_t>(k))));
    link.wait({});
  }
  /// Three seconds from a Begin, at rest before the tick `from`; `commands` go before the tick 150.
  TimedFrames drive(const std::vector<base::CanFrame>& commands = {}, int from = 0) {
    TimedFrames log;
    const auto note = [&] {
      while (const auto frame = link.receive()) log.push_back({board.time, *frame});
    };
    while (link.receive()) continue;
    sync(bus::SyncKind::kBegin, 0);
    note();
    for (int k = 1; k < 300; ++k) {
      if (k == 150) {
        for (const auto& frame : commands) EXPECT_TRUE(link.send(frame));
      }
      EXPECT_TRUE(
          link.send(test::body_speed(5'000'000 + 10'000 * k - 1'000, k < from ? 0 : 0.5F, k < from ? 0 : 0.1F, k)));
      sync(bus::SyncKind::kStep, k);
      note();
    }
    return log;
  }
};
std::vector<base::CanFrame> told(const TimedFrames& log) {
  std::vector<base::CanFrame> frames;
  for (const TimedFrame& one : log)
    if (is_deterministic(one.frame, 0x300)) frames.push_back(one.frame);
  return frames;
}

std::optional<KeptWords> kept_in(const TimedFrames& log) {
  FramesInMemory frames(log);
  return kept_words_of(frames, 0x300);
}

TEST(KeptWords, ALogThatBeginsWithThemIsRepeatedToTheBit) {
  MemoryTwin recorded, again, without;
  ASSERT_TRUE(make_active(recorded.link, kBuilt, kOther));
  const TimedFrames log = recorded.drive();
  const auto kept = kept_in(log);
  ASSERT_TRUE(kept);
  EXPECT_EQ(kept->words.size(), 4U);
  EXPECT_EQ(kept->config, param::crc(kOther));
  EXPECT_EQ(param::crc(kept->over(kBuilt)), param::crc(kOther));
  EXPECT_EQ(settings_between(kBuilt, kOther),
            "wheels.drive.left_radius_m=0.11 landmark.gate_scale=2 gnss.origin_latitude_deg=-7.25");
  ASSERT_TRUE(make_active(again.link, kBuilt, kept->over(kBuilt)));
  EXPECT_EQ(told(again.drive()), told(log));
  EXPECT_NE(told(without.drive()), told(log));
}

TEST(KeptWords, AreNotThoseOfALaterChange) {
  MemoryTwin twin;
  const TimedFrames plain = twin.drive();
  EXPECT_FALSE(kept_in(plain));
  param::Parameters later = kBuilt;
  later.landmark.gate_scale = 3;
  const bus::CmdParamSet set{
      .ctr = 1, .set_row_id = param::row_of("landmark.gate_scale")->index, .set_value = 0x40400000};
  constexpr std::uint32_t kName = param::StagedParameters::kName;
  const bus::CmdParamApply apply{
      .ctr = 2, .apply_before_crc = param::crc(kBuilt) & kName, .apply_after_crc = param::crc(later) & kName};
  const TimedFrames changed = twin.drive({test::in(bus::protect(set)), test::in(bus::protect(apply))});
  EXPECT_FALSE(kept_in(changed)) << "the replay makes it from the commands of the log";
  const TimedFrames behind = twin.drive();
  ASSERT_TRUE(kept_in(behind));
}

TEST(KeptWords, ARestartOnTheBusIsRepeatedToTheBit) {
  constexpr std::uint32_t kName = param::StagedParameters::kName;
  param::Parameters later = kBuilt;
  later.wheels.speed_scale = 1.25F;  // needs a restart
  const bus::CmdParamSet set{
      .ctr = 1, .set_row_id = param::row_of("wheels.speed_scale")->index, .set_value = 0x3FA00000};
  const bus::CmdParamRestart restart{
      .ctr = 2, .restart_before_crc = param::crc(kBuilt) & kName, .restart_after_crc = param::crc(later) & kName};
  const std::vector<base::CanFrame> commands{test::in(bus::protect(set)), test::in(bus::protect(restart))};
  const auto answer_in = [](const TimedFrames& log) {
    std::optional<bus::EstParamSet> last;
    for (const TimedFrame& one : log)
      if (one.frame.id == 0x300 + bus::EstParamSet::kOffset)
        if (const auto told = bus::decode<bus::EstParamSet>(bus::payload(one.frame));
            told && told->set_page_id == bus::CmdParamRestart::kPage)
          last = told;
    return last;
  };
  MemoryTwin moving, resting, again;
  const auto refused = answer_in(moving.drive(commands));
  ASSERT_TRUE(refused);
  EXPECT_EQ(refused->set_answer, bus::ParamAnswer::kBusy) << "it drives";
  EXPECT_EQ(refused->set_config, param::crc(kBuilt));
  const TimedFrames log = resting.drive(commands, 160);
  const auto told_to = answer_in(log);
  ASSERT_TRUE(told_to);
  EXPECT_EQ(told_to->set_answer, bus::ParamAnswer::kDone);
  EXPECT_EQ(told_to->set_config, param::crc(later));
  EXPECT_EQ(told_to->set_pending, 0);
  EXPECT_FALSE(kept_in(log)) << "the replay makes it from the commands of the log";
  EXPECT_EQ(told(again.drive(commands, 160)), told(log));
}

TEST(KeptWords, ThatTheNodeRefusesAreNamed) {
  MemoryTwin twin;
  param::Parameters wrong = kOther;
  wrong.landmark.gate_scale = 1e9F;
  const auto refused = make_active(twin.link, kBuilt, wrong);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.failure().text.find("refuses the parameters"), std::string::npos);
  const auto other = make_active(twin.link, kOther, kBuilt);
  ASSERT_FALSE(other) << "the node is not as it is said to be";
}

}  // namespace
}  // namespace tetap::sim
