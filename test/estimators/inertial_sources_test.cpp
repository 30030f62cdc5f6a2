// SPDX-License-Identifier: Apache-2.0
// State and failed check of every source as a robot drives: one word a source, and a refusal names its test. The three
// verbs of Recovery on a covariance.
#include "inertial_drive.hpp"

#include <gtest/gtest.h>

#include <utility>

namespace tetap::estimators {
namespace {

using Word = std::pair<SourceState, Check>;

Word word(const Drive& d, sensor::Sensor of) {
  const SourceStates::Entry entry = d.estimator.sources(d.ctx()).of(of);
  return {entry.state, entry.failed};
}
Word height(const Drive& d) {
  const SourceStates::Entry entry = d.estimator.inertial(d.ctx()).gnss_height;
  return {entry.state, entry.failed};
}
constexpr Word kFusing{SourceState::kFusing, Check::kNone}, kStopped{SourceState::kStopped, Check::kNone};

TEST(Sources, StopAndFuseAsTheirMeasurementsDo) {
  Drive d;
  for (const auto of : {sensor::Sensor::kImu, sensor::Sensor::kGnssPosition, sensor::Sensor::kGnssVelocity,
                        sensor::Sensor::kWheelSpeed, sensor::Sensor::kHeading, sensor::Sensor::kMagnetometer})
    EXPECT_EQ(word(d, of), kStopped) << "before the first measurement: " << static_cast<int>(of);
  d.place();
  d.run(30);
  ASSERT_TRUE(d.tracking());
  for (const auto of : {sensor::Sensor::kImu, sensor::Sensor::kGnssPosition, sensor::Sensor::kGnssVelocity,
                        sensor::Sensor::kWheelSpeed, sensor::Sensor::kBodySpeed})
    EXPECT_EQ(word(d, of), kFusing) << static_cast<int>(of);
  EXPECT_EQ(word(d, sensor::Sensor::kBarometer), kStopped) << "there is none";
  d.tamper = [](Drive::Fix&) { return false; };
  d.wheels = false;
  d.run(4);
  EXPECT_EQ(word(d, sensor::Sensor::kGnssPosition), kStopped);
  EXPECT_EQ(word(d, sensor::Sensor::kGnssVelocity), kStopped);
  EXPECT_EQ(word(d, sensor::Sensor::kWheelSpeed), kStopped);
  EXPECT_EQ(word(d, sensor::Sensor::kImu), kFusing);
}

TEST(Sources, FirstFixesConfirmEachOther) {
  Drive d;
  d.run(0.5);
  EXPECT_EQ(word(d, sensor::Sensor::kGnssPosition), (Word{SourceState::kConfirming, Check::kUnconfirmed}));
}

TEST(Sources, AJumpIsRejectedByTheGateAndNamesIt) {
  Drive d = settled();
  d.tamper = [](Drive::Fix& fix) { return fix.east_m += 100, true; };
  d.run(1);
  EXPECT_EQ(word(d, sensor::Sensor::kGnssPosition), (Word{SourceState::kRejecting, Check::kGate}));
  EXPECT_EQ(d.last_fix.failed, Check::kGate);
  EXPECT_GT(d.last_fix.nis, d.last_fix.gate);
  d.tamper = [](Drive::Fix&) { return true; };
  d.run(0.5);
  EXPECT_EQ(word(d, sensor::Sensor::kGnssPosition), kFusing);
  EXPECT_EQ(d.last_fix.failed, Check::kNone);
}

TEST(Sources, AHeightHasAStateOfItsOwnAndStopsWithItsFixes) {
  Drive d = settled();
  EXPECT_EQ(height(d), kFusing);
  d.tamper = [](Drive::Fix& fix) { return fix.up_m += 100, true; };
  d.run(1);
  EXPECT_EQ(height(d), (Word{SourceState::kRejecting, Check::kGate}));
  EXPECT_EQ(word(d, sensor::Sensor::kGnssPosition), kFusing) << "its horizontal part is right";
  d.tamper = [](Drive::Fix&) { return false; };
  d.run(4);
  EXPECT_EQ(height(d), kStopped);
}

// A pose places the filter in the plane. Errors of the receiver last, so each fix moves the height a little: the filter
// stays unsure for minutes, and asks once whether the fixes agree.
TEST(Sources, AHeightThatNobodyKnewIsConfirmedOnce) {
  Drive d(rover_like());
  d.white_m = 0.3;
  d.lasting_m = 0.5;
  d.tamper = [](Drive::Fix&) { return false; };
  d.place();
  d.run(3);
  ASSERT_TRUE(d.tracking());
  d.tamper = [](Drive::Fix&) { return true; };
  int whole = 0, half = 0;
  for (int fix = 0; fix < 100; ++fix) {
    d.run(0.2);
    ++(d.last_fix.dof == 3 ? whole : half);
  }
  EXPECT_GE(whole, 95) << half;
  EXPECT_EQ(height(d), kFusing);
  // One fix that the gate lets through, as unsure as the filter is, and that contradicts the others.
  d.tamper = [](Drive::Fix& fix) { return fix.up_m += 12, true; };
  d.run(0.2);
  EXPECT_EQ(d.last_fix.dof, 2);
  EXPECT_EQ(d.last_fix.failed, Check::kNone) << "its horizontal part is right";
  d.tamper = [](Drive::Fix&) { return true; };
  d.run(0.4);
  EXPECT_EQ(d.last_fix.dof, 3);
}

TEST(Sources, AFrozenReceiverIsDistrusted) {
  Drive d = settled();
  d.tamper = [](Drive::Fix& fix) { return fix.repeated = true; };
  d.run(3);
  const Word frozen{SourceState::kDistrusted, Check::kFrozen};
  EXPECT_EQ(word(d, sensor::Sensor::kGnssPosition), frozen);
  EXPECT_EQ(d.last_velocity.failed, Check::kFrozen);
  d.tamper = [](Drive::Fix&) { return true; };
  d.run(0.5);
  EXPECT_EQ(word(d, sensor::Sensor::kGnssPosition), kFusing);
}

TEST(Sources, AVelocityThatIsOffIsRejectedByItsGate) {
  Drive d = settled();
  d.tamper = [](Drive::Fix& fix) { return fix.east_off_mps = 5, true; };
  d.run(1);
  EXPECT_EQ(word(d, sensor::Sensor::kGnssVelocity), (Word{SourceState::kRejecting, Check::kGate}));
  EXPECT_EQ(word(d, sensor::Sensor::kGnssPosition), kFusing) << "its positions are right";
}

/// A covariance with correlations everywhere.
nav::Ins correlated() {
  nav::Ins ins;
  for (int r = 0; r < nav::Ins::kErrors; ++r)
    for (int c = 0; c <= r; ++c) ins.p(r, c) = r == c ? 2.0F : 0.1F;
  return ins;
}
/// Entries that differ from those of `before`.
std::vector<std::pair<int, int>> changed(const nav::Ins& before, const nav::Ins& now) {
  std::vector<std::pair<int, int>> all;
  for (int r = 0; r < nav::Ins::kErrors; ++r)
    for (int c = 0; c <= r; ++c)
      if (before.p(r, c) < now.p(r, c) || before.p(r, c) > now.p(r, c)) all.emplace_back(r, c);
  return all;
}

TEST(Recovery, InflatingABlockAddsToItsVariancesAndToNothingElse) {
  const nav::Ins before = correlated();
  nav::Ins ins = before;
  Recovery::inflate_motion(ins, 3, 0);
  EXPECT_EQ(changed(before, ins), (std::vector<std::pair<int, int>>{{3, 3}, {4, 4}, {5, 5}}));
  EXPECT_FLOAT_EQ(ins.p(4, 4), 11.0F);
  ins = before;
  Recovery::inflate_heading(ins, 0.5F);
  EXPECT_EQ(changed(before, ins), (std::vector<std::pair<int, int>>{{8, 8}}));
}

TEST(Recovery, ResettingThePositionMovesItAndLeavesItUncorrelated) {
  nav::Ins ins = correlated();
  Recovery recovery;
  Assessment a{.action = Action::kResetPosition};
  a.remedy.step_m = {100, -40, 7};
  a.remedy.variance_m2 = {4, 4, 9};
  EXPECT_TRUE(recovery.apply(a, ins, {5'000'000}, parameters()));
  EXPECT_NEAR(ins.x.x.minus({}), 100, 1e-4);
  EXPECT_NEAR(ins.x.y.minus({}), -40, 1e-4);
  EXPECT_NEAR(ins.x.z.minus({}), 0, 1e-6) << "the height is another block";
  for (int j = 0; j < nav::Ins::kErrors; ++j)
    for (const int i : {0, 1}) EXPECT_NEAR(ins.p(i, j), i == j ? 4.0F : 0.0F, 1e-5F) << i << ' ' << j;
  EXPECT_FLOAT_EQ(ins.p(2, 2), 2.0F);
  EXPECT_TRUE(ins.p.positive_definite());
  EXPECT_EQ(recovery.jump().count, 1);
  EXPECT_EQ(recovery.jump().east_m, 100.0F);
  EXPECT_TRUE(recovery.undoable());
  a.remedy.undoes = true;
  EXPECT_TRUE(recovery.apply(a, ins, {5'000'000}, parameters()));
  EXPECT_FALSE(recovery.undoable()) << "a way back is no way to go";
}

TEST(Recovery, FusingSkippingAndRejectingChangeNothing) {
  const nav::Ins before = correlated();
  for (const Action action : {Action::kFuse, Action::kSkip, Action::kReject}) {
    nav::Ins ins = before;
    Recovery recovery;
    EXPECT_FALSE(recovery.apply({.action = action}, ins, {5'000'000}, parameters()));
    EXPECT_TRUE(changed(before, ins).empty());
    EXPECT_EQ(recovery.jump().count, 0);
  }
}

// S' = S + k nu nu^T, so the normalised square of the same innovation is below 1 / k, whatever its size and
// direction.
TEST(Recovery, AfterAWideningTheSameInnovationIsTaken) {
  for (const float size : {0.5F, 2.0F, 30.0F}) {
    for (const float course : {0.0F, 1.1F, 4.0F}) {
      const nav::Vector3 nu{size * std::cos(course), size * std::sin(course), 0.0F};
      for (const Action action : {Action::kWidenVelocity, Action::kWidenPosition}) {
        nav::Ins ins = correlated();
        const nav::Ins before = ins;
        Recovery recovery;
        Assessment a{.action = action};
        a.remedy.innovation = nu;
        a.remedy.since_s = 2.0F;
        EXPECT_TRUE(recovery.apply(a, ins, {5'000'000}, parameters()));
        const int first = action == Action::kWidenVelocity ? nav::InsState::kVelocity : nav::InsState::kPosition;
        const float c = std::cos(course), s = std::sin(course);
        const float along =
            c * c * ins.p(first, first) + s * s * ins.p(first + 1, first + 1) + 2 * c * s * ins.p(first, first + 1);
        EXPECT_LT(size * size / along, 0.51F) << size << ' ' << course;
        for (int i = nav::InsState::kAccelBias; i < nav::InsState::kErrors; ++i)
          EXPECT_LE(ins.p(i, i), before.p(i, i)) << i;
        EXPECT_TRUE(recovery.widened_lately({14'000'000}));
        EXPECT_FALSE(recovery.widened_lately({16'000'000}));
      }
    }
  }
}

TEST(Recovery, ASecondWideningWithinTenSecondsDoubtsTheBias) {
  nav::Ins ins = correlated();
  Recovery recovery;
  Assessment a{.action = Action::kWidenVelocity};
  a.remedy.innovation = {1.0F, 0.0F, 0.0F};
  a.remedy.since_s = 1.0F;
  const auto bias = [&] { return ins.p(nav::InsState::kAccelBias, nav::InsState::kAccelBias); };
  const float before = bias();
  recovery.apply(a, ins, {5'000'000}, parameters());
  EXPECT_EQ(bias(), before);
  recovery.apply(a, ins, {30'000'000}, parameters());
  EXPECT_EQ(bias(), before) << "long after";
  recovery.apply(a, ins, {35'000'000}, parameters());
  const float most = parameters().inertial.accel_turn_on_mps2;
  EXPECT_NEAR(bias(), before + most * most, 1e-6F);
}

TEST(WorkBudget, TakesOneMeasurementATickAndWhatWaitedForTwiceItsPeriod) {
  WorkBudget budget;
  for (int i = 0; i < 2; ++i) budget.note_arrival();
  budget.begin_tick();
  EXPECT_EQ(budget.left(), 2) << "keeps pace with the IMU";
  EXPECT_FALSE(budget.allows_due({100'000}, {100'000}));
  EXPECT_TRUE(budget.allows_due({200'000}, {100'000}));
  budget.grant(WorkBudget::kMeasurement);
  EXPECT_TRUE(budget.allows_due({100'000}, {100'000}));
  budget.spend(WorkBudget::kMeasurement);
  EXPECT_FALSE(budget.allows(WorkBudget::kMeasurement));
  budget.begin_tick();
  EXPECT_EQ(budget.left(), 0);
}

TEST(RebuildSchedule, RebuildsAfterACorrectionOnceNothingElseIsDueAndAfterThreeTicksWhateverIs) {
  RebuildSchedule schedule;
  base::Micros t{1'000'000};
  const auto tick = [&](bool deferred) { return t += base::Micros{10'000}, schedule.begin_tick(t, deferred); };
  EXPECT_TRUE(tick(false)) << "nothing was ever built";
  EXPECT_FALSE(tick(false));
  schedule.note_correction();
  EXPECT_TRUE(tick(false));
  schedule.note_correction();
  EXPECT_FALSE(tick(true));
  EXPECT_FALSE(tick(true));
  EXPECT_FALSE(tick(true));
  EXPECT_TRUE(tick(true));
  schedule.force_rebuild();
  EXPECT_TRUE(tick(true)) << "the filter is elsewhere at once";
  int ticks = 1;
  while (!tick(false)) ++ticks;
  EXPECT_EQ(ticks, 50) << "twice a second even uncorrected";
}

}  // namespace
}  // namespace tetap::estimators
