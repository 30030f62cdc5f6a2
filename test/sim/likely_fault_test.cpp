// SPDX-License-Identifier: Apache-2.0
// The words of a node in the simulated world about a fault that the world put in: the page of the likeliest fault, and
// the mode with its bits.
#include "config/rover.hpp"
#include "config/rover_landmarks.hpp"
#include "sim_host/world_source.hpp"
#include "tetap/node/node.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <optional>
#include <vector>

namespace tetap::sim {
namespace {

using bus::EstOriginFault, bus::FaultRow, bus::FaultUnit;

struct FaultPage {
  double time_s = 0;
  EstOriginFault fault;
};
struct NodeWords {
  std::vector<FaultPage> pages;
  int degraded = 0, unnamed = 0;  ///< statuses; those without a fault bit
};

/// 45 s of a robot; the fault, if there is one, lasts from 30 s on.
template <class Estimators>
NodeWords words_of(const param::Parameters& parameters, std::optional<Fault> fault, std::uint64_t seed) {
  World::Options options;
  if (fault) options.faults = {{*fault, base::Micros{30'000'000}, base::Micros{15'000'000}}};
  WorldSource source(World(options, seed), parameters.can_base, base::Micros{10'000}, base::Micros{45'000'000});
  const auto node = std::make_unique<node::Node<Estimators>>(parameters, bus::Version{});
  NodeWords words;
  Tick tick;
  for (int k = 0; source.next(tick); ++k) {
    if (tick.begin) node->power_on(*tick.begin);
    for (const base::CanFrame& frame : tick.inputs) node->on_frame(frame);
    node->tick(tick.time, {}, [&](const base::CanFrame& frame) {
      const auto payload = bus::payload(frame);
      if (frame.id == parameters.can_base + EstOriginFault::kOffset)
        if (const auto page = bus::decode<EstOriginFault>(payload)) words.pages.push_back({0.01 * k, *page});
      if (frame.id != parameters.can_base + bus::EstStatus::kOffset) return;
      const auto status = bus::decode<bus::EstStatus>(payload);
      if (!status || status->mode != sensor::Mode::kDegraded) return;
      ++words.degraded;
      words.unnamed += status->faults == 0 ? 1 : 0;
    });
  }
  return words;
}

/// A jump of the fixes, which gates refuse, and a gyroscope's bias below every gate. A refused value counts as much as
/// a gate, so the size of the jump stays below the truth.
TEST(likely_fault, the_page_names_the_broken_device) {
  for (const std::uint64_t seed : {1U, 2U, 3U, 4U, 5U}) {
    SCOPED_TRACE(seed);
    const auto last = [seed](Fault fault) {
      return words_of<robot::rover::Estimators>(robot::rover::parameters, fault, seed).pages.back().fault;
    };
    const EstOriginFault jump = last(Fault::kGnssJump);  // 100 m to the east
    EXPECT_EQ(jump.fault_row, FaultRow::kGnssEast);
    EXPECT_EQ(jump.fault_unit, FaultUnit::kM);
    EXPECT_GT(jump.fault_prob, 0.99F);
    EXPECT_GT(jump.fault_size, 10 * jump.fault_std);
    EXPECT_LT(jump.fault_size, 100 + 3 * jump.fault_std);
    const EstOriginFault bias = last(Fault::kGyroBiasStep);  // 0.02 rad/s about the vertical
    EXPECT_EQ(bias.fault_row, FaultRow::kImuGyroZ);
    EXPECT_EQ(bias.fault_unit, FaultUnit::kRadPerS);
    EXPECT_GT(bias.fault_prob, 0.99F);
    EXPECT_NEAR(bias.fault_size, 0.02F, 4 * bias.fault_std);
  }
}

/// A rover that is Degraded says by a bit of Faults why.
TEST(likely_fault, degraded_has_a_fault_bit) {
  int inertial = 0, planar = 0;
  for (const Fault fault : {Fault::kGnssJump, Fault::kGnssWrongHeight, Fault::kImuStuck, Fault::kGyroBiasStep,
                            Fault::kWheelSpin, Fault::kWheelStuck, Fault::kLandmarkWrongId, Fault::kKidnapped}) {
    const NodeWords a = words_of<robot::rover::Estimators>(robot::rover::parameters, fault, 1);
    const NodeWords b = words_of<robot::rover_landmarks::Estimators>(robot::rover_landmarks::parameters, fault, 1);
    EXPECT_EQ(a.unnamed, 0) << static_cast<int>(fault) << ", inertial, of " << a.degraded;
    EXPECT_EQ(b.unnamed, 0) << static_cast<int>(fault) << ", planar, of " << b.degraded;
    inertial += a.degraded, planar += b.degraded;
  }
  EXPECT_GT(inertial, 100);
  EXPECT_GT(planar, 100);
}

}  // namespace
}  // namespace tetap::sim
