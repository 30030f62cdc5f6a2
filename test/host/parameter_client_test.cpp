// SPDX-License-Identifier: Apache-2.0
// The client of parameters against a running node, over a bus that loses frames.
#include "sim_host/control/parameter_client.hpp"
#include "config/rover.hpp"
#include "sim_host/control/scan.hpp"
#include "tetap/bus/codec.hpp"
#include "tetap/bus/e2e.hpp"
#include "tetap/param/crc.hpp"
#include "tetap/param/table.hpp"

#include <gtest/gtest.h>

#include <deque>
#include <map>
#include <random>

namespace tetap::sim {
namespace {

/// A node that ticks while its client waits; one frame in `lose_one_in` is lost, in either direction.
struct Bus {
  explicit Bus(unsigned lose_one_in = 0) : lose(lose_one_in) { node.power_on({}); }
  ParameterClient client() { return {robot::rover::parameters.can_base, send(), receive(), clock()}; }
  ParameterClient::Send send() {
    return [this](const base::CanFrame& frame) {
      ++asked[frame.id];
      if (!lost()) node.on_frame(frame);
    };
  }
  ParameterClient::Receive receive() {
    return [this](base::Micros patience) -> std::optional<base::CanFrame> {
      for (std::int64_t waited = 0; frames.empty() && waited < patience.us; waited += 10'000) tick();
      if (frames.empty()) return std::nullopt;
      const base::CanFrame frame = frames.front();
      frames.pop_front();
      return frame;
    };
  }
  ParameterClient::Clock clock() {
    return [this] { return base::Micros{us}; };
  }
  void tick() {
    us += 10'000;
    node.tick({us}, {}, [this](const base::CanFrame& frame) {
      if (!lost()) frames.push_back(frame);
    });
    auto& commands = node.parameter_commands();
    if (const auto save = commands.take_save())
      frames.push_back(
          bus::frame(robot::rover::parameters.can_base, commands.answer_to(*save, bus::ParamAnswer::kNotKept)));
  }
  bool lost() { return lose != 0 && random() % lose == 0; }

  unsigned lose;
  std::mt19937 random{5};
  node::Node<node::WithBusParameters<node::WithBusProtection<robot::rover::Estimators>>> node{robot::rover::parameters,
                                                                                              {}};
  std::deque<base::CanFrame> frames;
  std::map<std::uint32_t, int> asked;  ///< frames of the client by identifier
  std::int64_t us = 1'000'000;
};

param::Parameters wanted() {
  param::Parameters p = robot::rover::parameters;
  p.gnss.gate_scale = 2;
  p.wheels.drive.left_radius_m *= 1.01F;
  return p;
}

TEST(ParameterClient, RestartsTheEstimatorsWithTheRowsThatWait) {
  for (const unsigned lose : {0U, 20U}) {
    Bus bus(lose);
    ParameterClient client = bus.client();
    const param::Parameters before = client.read(bus::ParamSource::kActive);
    EXPECT_EQ(client.change(before, wanted()).set_pending, 1);
    const bus::EstParamSet set = client.restart(client.read(bus::ParamSource::kActive));
    EXPECT_EQ(set.set_pending, 0);
    EXPECT_EQ(set.set_config, param::crc(wanted()));
    EXPECT_EQ(param::crc(client.read(bus::ParamSource::kActive)), param::crc(wanted()));
    if (lose > 0) continue;  // where an answer is lost, what was asked for counts as done if it is so
    EXPECT_THROW(static_cast<void>(client.restart(before)), ControlError) << "that set is active no longer";
  }
}

TEST(ParameterClient, ReadsAndChangesOverABusThatLosesFrames) {
  for (const unsigned lose : {0U, 20U}) {
    Bus bus(lose);
    ParameterClient client = bus.client();
    const param::Parameters before = client.read(bus::ParamSource::kActive);
    EXPECT_EQ(param::crc(before), param::crc(robot::rover::parameters));
    const bus::EstParamSet set = client.change(before, wanted());
    EXPECT_EQ(set.set_pending, 1);  // the radius
    param::Parameters active = client.read(bus::ParamSource::kActive);
    EXPECT_EQ(active.gnss.gate_scale, 2.0F);
    EXPECT_EQ(active.wheels.drive.left_radius_m, robot::rover::parameters.wheels.drive.left_radius_m);
    bus.node.power_on({bus.us});
    active = client.read(bus::ParamSource::kActive);
    EXPECT_EQ(param::crc(active), param::crc(wanted()));
    EXPECT_EQ(param::crc(client.read(bus::ParamSource::kCompiled)), param::crc(robot::rover::parameters));
    client.restore(active);
    EXPECT_EQ(client.read(bus::ParamSource::kActive).gnss.gate_scale, robot::rover::parameters.gnss.gate_scale);
  }
}

TEST(ParameterClient, SaysWhatTheNodeRefused) {
  Bus bus;
  ParameterClient client = bus.client();
  const param::Parameters before = client.read(bus::ParamSource::kActive);
  param::Parameters other = before;
  other.loop.period_us = 20'000;
  try {
    client.change(before, other);
    FAIL();
  } catch (const ControlError& error) {
    EXPECT_NE(std::string(error.what()).find("loop.period_us"), std::string::npos) << error.what();
  }
  // Another client changes the node meanwhile.
  Bus shared;
  ParameterClient one = shared.client(), two = shared.client();
  const param::Parameters known = one.read(bus::ParamSource::kActive);
  two.change(known, wanted());
  param::Parameters late = known;
  late.gnss.gate_scale = 3;
  EXPECT_THROW(one.change(known, late), ControlError);
  EXPECT_EQ(two.read(bus::ParamSource::kActive).gnss.gate_scale, 2.0F);
}

TEST(ParameterClient, AppliesWhatIsStagedAndSaysThatNothingIsKept) {
  Bus bus;
  ParameterClient client = bus.client();
  const param::Parameters before = client.read(bus::ParamSource::kActive);
  bus::CmdParamSet set{.set_value = 0x40000000};  // 2.0
  for (const param::Row& row : param::kTable)
    if (std::string(row.path) == "gnss.gate_scale") set.set_row_id = row.index;
  bus.send()(bus::frame(robot::rover::parameters.can_base, bus::protect(set)));
  EXPECT_EQ(client.read(bus::ParamSource::kActive).gnss.gate_scale, before.gnss.gate_scale);
  EXPECT_EQ(client.apply(before).set_changed, 1);
  EXPECT_EQ(client.read(bus::ParamSource::kActive).gnss.gate_scale, 2.0F);
  try {
    client.save(before);
    FAIL();
  } catch (const ControlError& error) {
    EXPECT_STREQ(error.what(), "this board keeps no parameters, or its flash has failed");
  }
}

std::string refusal_of(const std::function<void()>& act) {
  try {
    act();
  } catch (const ControlError& error) {
    return error.what();
  }
  return "";
}
constexpr base::SipKey kOwner{0x03020100U, 0x07060504U, 0x0B0A0908U, 0x0F0E0D0CU};

TEST(ParameterClient, ClaimsANodeAndCommandsItByTagsOverABusThatLosesFrames) {
  for (const unsigned lose : {0U, 30U}) {
    Bus bus(lose);
    ParameterClient owner = bus.client(), stranger = bus.client(), thief = bus.client(), second = bus.client();
    owner.use_key(kOwner), second.use_key(kOwner), thief.use_key({1, 2, 3, 4});
    param::Parameters before = owner.read(bus::ParamSource::kActive);
    owner.claim(before);
    EXPECT_NE(refusal_of([&] { thief.claim(before); }).find("no first key"), std::string::npos);
    before = owner.read(bus::ParamSource::kActive);
    EXPECT_EQ(before.bus.commands, param::CommandAccess::kAuthenticated);
    EXPECT_NE(before.bus.key, kOwner) << "it is never read";
    param::Parameters other = before;
    other.gnss.gate_scale = 2;
    EXPECT_NE(refusal_of([&] { stranger.change(before, other); }).find("key is missing"), std::string::npos);
    EXPECT_NE(refusal_of([&] { thief.change(before, other); }).find("another key"), std::string::npos);
    EXPECT_EQ(owner.read(bus::ParamSource::kActive).gnss.gate_scale, before.gnss.gate_scale);
    owner.change(before, other);
    before = second.read(bus::ParamSource::kActive);
    EXPECT_EQ(before.gnss.gate_scale, 2.0F);
    second.restore(before);  // right behind the other client's
    before = second.read(bus::ParamSource::kActive);
    EXPECT_EQ(before.gnss.gate_scale, robot::rover::parameters.gnss.gate_scale);
    EXPECT_EQ(before.bus.commands, param::CommandAccess::kAuthenticated) << "restore keeps access";
    owner.change(before, other);
    EXPECT_EQ(refusal_of([&] { owner.save(other); }), "this board keeps no parameters, or its flash has failed");
  }
}

TEST(ParameterClient, SaysThatAnotherSendersWordIsInTheKey) {
  Bus bus;
  const auto send = [&](const base::CanFrame& frame) {
    const bus::CmdParamSet word{.ctr = 9, .set_word = 2, .set_row_id = param::row_of("bus.key")->index, .set_value = 7};
    if (bus::decode<bus::CmdParamApply>(bus::payload(frame)))
      bus.send()(bus::frame(robot::rover::parameters.can_base, bus::protect(word)));
    bus.send()(frame);
  };
  ParameterClient owner(robot::rover::parameters.can_base, send, bus.receive(), bus.clock());
  owner.use_key(kOwner);
  const param::Parameters before = owner.read(bus::ParamSource::kActive);
  EXPECT_NE(refusal_of([&] { owner.claim(before); }).find("another key"), std::string::npos);
}

TEST(ParameterClient, SaysThatAKeyComesTooLate) {
  Bus bus;
  for (int tick = 0; tick < 6'000; ++tick) bus.tick();
  ParameterClient client = bus.client();
  client.use_key(kOwner);
  const param::Parameters before = client.read(bus::ParamSource::kActive);
  EXPECT_NE(refusal_of([&] { client.claim(before); }).find("a minute ago"), std::string::npos);
  EXPECT_EQ(param::crc(client.read(bus::ParamSource::kStaged)), param::crc(before)) << "nothing is half-done";
}

TEST(Tags, AreByAKeyOf32Digits) {
  EXPECT_EQ(key_of_digits("000102030405060708090a0B0C0d0e0f"), kOwner);
  for (const char* wrong : {"", "00", "000102030405060708090a0B0C0d0e0g", "000102030405060708090a0B0C0d0e0f0",
                            "00000000000000000000000000000000", "+0-0+0-0+0-0+0-0+0-0+0-0+0-0+0-0"})
    EXPECT_EQ(key_of_digits(wrong), std::nullopt) << wrong;
}

TEST(Scan, FindsANodeAndAsksNobodyElse) {
  Bus bus(20);
  // Others' frames on identifiers that would be a node's.
  for (int i = 0; i < 100; ++i)
    for (const std::uint32_t offset : {bus::EstEpoch::kOffset, bus::EstVersion::kOffset})
      bus.frames.push_back({.id = 0x180 + offset, .size = 8, .data = {1, 2, 3, 4, 5, 6, 7, 8}});
  const auto found = scan(bus.send(), bus.receive(), bus.clock());
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].can_base, robot::rover::parameters.can_base);
  EXPECT_EQ(found[0].version->config, param::crc(robot::rover::parameters));
  EXPECT_TRUE(found[0].parameters);
  ASSERT_EQ(bus.asked.size(), 1U);
  EXPECT_EQ(bus.asked.begin()->first, robot::rover::parameters.can_base + bus::CmdParamGet::kOffset);
}

TEST(ParameterClient, GivesUpWithoutANode) {
  std::int64_t us = 0;
  ParameterClient client(
      0x300, [](const base::CanFrame&) {},
      [&](base::Micros patience) {
        us += patience.us;
        return std::nullopt;
      },
      [&] { return base::Micros{us}; });
  EXPECT_THROW(static_cast<void>(client.read(bus::ParamSource::kActive)), ControlError);
}

}  // namespace
}  // namespace tetap::sim
