// SPDX-License-Identifier: Apache-2.0
// The client of parameters against a running node, over a bus that loses frames.
#include "sim_host/control/parameter_client.hpp"
#include "config/rover.hpp"
#include "tetap/param/crc.hpp"
#include "tetap/param/table.hpp"

#include <gtest/gtest.h>

#include <deque>
#include <random>

namespace tetap::sim {
namespace {

/// A node that ticks while its client waits; one frame in `lose_one_in` is lost, in either direction.
struct Bus {
  explicit Bus(unsigned lose_one_in = 0) : lose(lose_one_in) { node.power_on({}); }
  ParameterClient client() {
    return {robot::rover::parameters.can_base,
            [this](const base::CanFrame& frame) {
              if (!lost()) node.on_frame(frame);
            },
            [this](base::Micros patience) -> std::optional<base::CanFrame> {
              for (std::int64_t waited = 0; frames.empty() && waited < patience.us; waited += 10'000) tick();
              if (frames.empty()) return std::nullopt;
              const base::CanFrame frame = frames.front();
              frames.pop_front();
              return frame;
            },
            [this] { return base::Micros{us}; }};
  }
  void tick() {
    us += 10'000;
    node.tick({us}, {}, [this](const base::CanFrame& frame) {
      if (!lost()) frames.push_back(frame);
    });
  }
  bool lost() { return lose != 0 && random() % lose == 0; }

  unsigned lose;
  std::mt19937 random{5};
  node::Node<node::WithBusParameters<robot::rover::Estimators>> node{robot::rover::parameters, {}};
  std::deque<base::CanFrame> frames;
  std::int64_t us = 1'000'000;
};

param::Parameters wanted() {
  param::Parameters p = robot::rover::parameters;
  p.gnss.gate_scale = 2;
  p.wheels.drive.left_radius_m *= 1.01F;
  return p;
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
