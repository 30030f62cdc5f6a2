// SPDX-License-Identifier: Apache-2.0
// A whole node behind fakes of its sensors. Its run is repeated at the desk from the log of its bus alone, bit by bit,
// whatever else is on that bus.
#include "host/wired_bench.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace tetap::test {
namespace {

void expect_equal(const Repetition& r, std::uint64_t epochs) {
  EXPECT_EQ(r.compared, epochs);
  EXPECT_EQ(r.different, 0U) << r.first;
  EXPECT_EQ(r.missing + r.counts.lost() + r.counts.extra(), 0U);
}

TEST(WiredNode, the_log_of_its_bus_repeats_it) {
  WiredRover rover;
  rover.run(20);
  const auto status = rover.said<bus::EstStatus>();
  EXPECT_EQ(status.back().mode, sensor::Mode::kNominal);
  EXPECT_TRUE(status.back().pos_valid && status.back().hdg_valid);
  EXPECT_FALSE(status.back().unlogged);
  const Repetition r = repeat_at_the_desk(rover.wire.log);
  EXPECT_FALSE(r.recording.hole) << r.recording.hole->why;
  expect_equal(r, rover.epochs());
  EXPECT_GT(r.compared, 1'980U);
}

TEST(WiredNode, frames_of_others_between_its_own_leave_no_trace) {
  WiredRover rover;
  rover.foreign_per_s = 300;
  rover.run(20);
  EXPECT_GT(rover.said<bus::InBodySpeed>().size(), 2'500U);
  const Repetition r = repeat_at_the_desk(rover.wire.log);
  EXPECT_FALSE(r.recording.hole) << r.recording.hole->why;
  expect_equal(r, rover.epochs());
}

TEST(WiredNode, sends_guards_of_its_samples_where_samples_need_them) {
  WiredRover rover;
  rover.parameters.bus.guard = 1;
  rover.boot();
  rover.run(20);
  const auto status = rover.said<bus::EstStatus>();
  EXPECT_EQ(status.back().mode, sensor::Mode::kNominal);
  EXPECT_TRUE(status.back().pos_valid && status.back().hdg_valid);
  const std::size_t samples = rover.said<bus::InWheelCounts>().size() + rover.said<bus::ImuTime>().size() +
                              rover.said<bus::InGnssAcc>().size() + rover.said<bus::InGnssVelU>().size();
  EXPECT_GT(samples, 3'000U);
  EXPECT_NEAR(static_cast<double>(rover.said<bus::InGuardSample>().size()), static_cast<double>(samples), 2);
  EXPECT_EQ(rover.said<bus::EstDiagGuard>().back().guard_bad, 0);
  const Repetition r = repeat_at_the_desk(rover.wire.log, rover.parameters);
  EXPECT_FALSE(r.recording.hole) << r.recording.hole->why;
  expect_equal(r, rover.epochs());
  // Others on the bus, whose samples have none, are refused. A Step that nobody vouches for leaves the record whole.
  rover.foreign_per_s = 100;
  rover.wire.foreign(sim::sync_frame(0x300, bus::SyncKind::kStep, {5'000'000}, 77));
  rover.run(5);
  EXPECT_GT(rover.said<bus::EstDiagGuard>().back().guard_bad, 100);
  EXPECT_EQ(rover.said<bus::EstDiagLimits>().back().lock_refused, 1);
  const Repetition both = repeat_at_the_desk(rover.wire.log, rover.parameters);
  EXPECT_FALSE(both.recording.hole) << both.recording.hole->why;
  expect_equal(both, rover.epochs());
}

/// Frames of others come between own frames, and the desk takes these in another order: tags are judged alike.
TEST(WiredNode, a_tagged_command_is_obeyed_at_the_desk_as_it_was_on_the_robot) {
  WiredRover rover;
  rover.foreign_per_s = 300;
  rover.parameters.bus = {.commands = param::CommandAccess::kAuthenticated, .key = {1, 2, 3, 4}};
  rover.parameters.loop.lockstep = param::Lockstep::kAuthenticated;
  rover.boot();
  rover.run(10);
  const std::uint32_t nonce = rover.said<bus::EstDiagGuard>().back().nonce;
  ASSERT_NE(nonce, 0U);
  // Pages come in turns: the nonce may be that of the turn before.
  const std::uint64_t time_us = rover.said<bus::EstEpoch>().back().time_us;
  const auto turn = static_cast<std::uint32_t>(time_us >> 21);
  for (const std::uint32_t of : {turn, turn - 1}) {
    const base::CanFrame command =
        bus::frame(0x300, bus::protect(bus::CmdReset{.ctr = 1, .what = bus::ResetWhat::kEstimators}));
    const bus::TagContext context{.nonce = nonce, .turn = of, .id = command.id, .counter = 7};
    bus::InGuardTag tag{.tag_id = bus::CmdReset::kOffset, .tag_ctr = 7};
    for (const std::span<const std::uint8_t> covered :
         {std::span<const std::uint8_t>{}, std::span<const std::uint8_t>(command.data)}) {
      tag.tag_crc = bus::tag_of(rover.parameters.bus.key, context, covered);
      rover.wire.foreign(bus::frame(0x300, tag));
    }
    rover.wire.foreign(command);
  }
  rover.run(4);
  EXPECT_EQ(rover.said<bus::EstStatus>().back().reset_ctr, 1);
  param::Parameters desk = rover.parameters;
  desk.loop.lockstep = param::Lockstep::kPlain;  // as with_node_in_process() does
  const Repetition r = repeat_at_the_desk(rover.wire.log, desk);
  EXPECT_FALSE(r.recording.hole) << r.recording.hole->why;
  expect_equal(r, rover.epochs());
}

TEST(WiredNode, samples_reach_estimates_in_the_bodys_axes_and_signs) {
  WiredRover rover;
  rover.run(15);
  const auto counts = rover.said<bus::InWheelCounts>();
  const auto travelled = [](std::uint16_t from, std::uint16_t to) { return static_cast<std::int16_t>(to - from); };
  // 10.5 m at 3183 counts a metre: modulo 2^16, both wheels forward, the right one with its sign turned.
  const auto expected =
      static_cast<std::int16_t>(static_cast<std::uint16_t>(std::lround(10.5 * 2000 / (2 * M_PI * 0.1))));
  EXPECT_NEAR(travelled(counts.front().left, counts.back().left), expected, 60);
  EXPECT_NEAR(travelled(counts.front().right, counts.back().right), expected, 60);
  const auto accel = rover.said<bus::ImuAccel>();
  ASSERT_GT(accel.size(), 1'300U) << "100 a second, but for the chip's start";
  EXPECT_NEAR(accel.back().vel_z_mps, 9.80665 * 0.01, 2e-3);
  const auto speed = rover.said<bus::InGnssVelEN>();
  ASSERT_GT(speed.size(), 40U);
  EXPECT_NEAR(speed.back().north_mps, 1.0F, 0.02F);
}

TEST(WiredNode, a_full_queue_ends_the_record_there_and_says_so) {
  WiredRover rover;
  rover.foreign_per_s = 100;
  rover.run(8);
  rover.wire.cut = true;
  rover.run(2);
  rover.wire.cut = false;
  rover.run(4);
  const auto status = rover.said<bus::EstStatus>();
  EXPECT_TRUE(status.back().unlogged);
  EXPECT_FALSE(status.front().unlogged);
  EXPECT_EQ(status.back().mode, sensor::Mode::kNominal) << "the robot drives on";
  const Repetition r = repeat_at_the_desk(rover.wire.log);
  ASSERT_TRUE(r.recording.hole);
  EXPECT_NE(r.recording.hole->why.find("lacks its last frame"), std::string::npos) << r.recording.hole->why;
  EXPECT_NEAR(static_cast<double>(r.compared), 800, 8);
  EXPECT_EQ(r.different, 0U) << r.first;
  EXPECT_GT(r.recording.unlogged, 350U);
}

/// Only a sample is lost and no frame of an epoch: nothing but the count and the sum of the inputs shows it.
TEST(WiredNode, one_sample_that_is_not_in_the_log_is_a_hole) {
  for (const std::int64_t foreign_per_s : {0, 200}) {
    WiredRover rover;
    rover.foreign_per_s = foreign_per_s;
    rover.run(12);
    auto log = rover.wire.log;
    const auto lost = std::find_if(log.begin() + static_cast<std::ptrdiff_t>(log.size() * 3 / 4), log.end(),
                                   [](const auto& entry) { return entry.frame.id == 0x306; });
    ASSERT_NE(lost, log.end());
    log.erase(lost);
    const Repetition r = repeat_at_the_desk(log);
    ASSERT_TRUE(r.recording.hole);
    EXPECT_NEAR(static_cast<double>(r.compared), 900, 30);
    EXPECT_NEAR(static_cast<double>(r.recording.hole->time.us), 1e4 * static_cast<double>(r.compared), 2e4);
    EXPECT_EQ(r.different, 0U) << r.first;
    EXPECT_EQ(r.compared + r.recording.unlogged, rover.epochs());
  }
}

TEST(WiredNode, a_jump_of_the_clock_begins_the_increments_anew) {
  for (const std::int64_t jump_us : {30'000'000LL, -3'000'000LL, 300'000LL, 7'000LL}) {
    WiredRover rover;
    rover.foreign_per_s = 100;
    rover.run(8.0037);
    rover.sync(bus::SyncKind::kClock, rover.now_us + jump_us);
    rover.run(8);
    // Stamps of increments go on from each other by their interval, but at the jump: no increment spans it.
    const auto times = rover.said<bus::ImuTime>();
    int breaks = 0;
    for (std::size_t i = 50; i < times.size(); ++i) {
      const auto step = (times[i].stamp_us - times[i - 1].stamp_us) & 0xFFFFF;
      EXPECT_LE(times[i].interval_us, 10'400) << i;
      const auto gap = static_cast<std::int64_t>(step) - times[i].interval_us;
      breaks += gap > 1'500 || gap < -1'500 ? 1 : 0;
    }
    EXPECT_EQ(breaks, 1) << jump_us;
    const Repetition r = repeat_at_the_desk(rover.wire.log);
    EXPECT_FALSE(r.recording.hole) << r.recording.hole->why;
    expect_equal(r, rover.epochs());
  }
}

TEST(WiredNode, a_snapshot_repeats_a_log_that_begins_in_the_middle) {
  WiredRover rover;
  rover.foreign_per_s = 300;
  rover.run(9);
  const std::size_t cut = rover.wire.log.size();
  rover.run(2);
  rover.command(bus::ResetWhat::kSnapshot);
  const std::int64_t asked_us = rover.now_us;
  rover.run(12);
  const auto late = [&] {
    return std::vector<sim::TimedFrame>(rover.wire.log.begin() + static_cast<std::ptrdiff_t>(cut),
                                        rover.wire.log.end());
  };
  std::size_t pieces = 0;
  sim::SnapshotCollector snapshots(0x300);
  base::Micros last{};
  for (const sim::TimedFrame& entry : late()) {
    pieces += sim::is_snapshot_piece(entry.frame, 0x300) ? 1 : 0;
    if (snapshots.add(entry.frame)) last = entry.time;
  }
  EXPECT_GT(pieces, sizeof(node::Node<robot::rover::Estimators>) / 6);
  EXPECT_LE(last.us - rover.wire.log.front().time.us, asked_us + 10'000'000);
  const Repetition r = repeat_at_the_desk(late());
  EXPECT_FALSE(r.recording.hole) << r.recording.hole->why;
  EXPECT_GT(r.compared, 1'190U);
  EXPECT_EQ(r.different, 0U) << r.first;
  EXPECT_EQ(r.counts.lost() + r.counts.extra(), 0U);
  EXPECT_NEAR(static_cast<double>(r.recording.skipped_epochs), 200, 3);

  // Without the request nothing is sent, and the log is refused.
  WiredRover silent;
  silent.run(4);
  EXPECT_TRUE(silent.said<bus::EstDiagSnapshot>().empty());
  const auto half = silent.wire.log.begin() + static_cast<std::ptrdiff_t>(silent.wire.log.size() / 2);
  EXPECT_NE(repeat_at_the_desk(std::vector<sim::TimedFrame>(half, silent.wire.log.end()))
                .refusal.find("no snapshot is in it"),
            std::string::npos);
}

TEST(WiredNode, is_asked_for_a_snapshot_until_it_answers) {
  WiredRover rover;
  rover.run(1);
  rover.command(bus::ResetWhat::kCounters);  // with counter 1, which is not obeyed twice
  rover.run(1);
  sim::SnapshotRequest request(0x300);
  sim::EpochCollector collector(0x300);
  std::size_t seen = rover.wire.log.size(), asked = 0;
  EXPECT_STREQ(request.outcome(), "not needed") << "nothing is known of the node yet";
  for (int i = 0; i < 1'400; ++i) {
    rover.run(0.01);
    for (; seen < rover.wire.log.size(); ++seen)
      request.note(rover.wire.log[seen].frame, collector.add(rover.wire.log[seen].frame));
    if (const auto command = request.due({rover.now_us}, 0)) {
      rover.wire.foreign(*command);
      ++asked;
      EXPECT_STREQ(request.outcome(), "no answer");
    }
  }
  EXPECT_EQ(asked, 2U);
  EXPECT_STREQ(request.outcome(), "whole");
  EXPECT_EQ(repeat_at_the_desk(rover.wire.log).different, 0U);

  // A node that starts within the log needs none.
  WiredRover fresh;
  sim::SnapshotRequest needless(0x300);
  sim::EpochCollector from_start(0x300);
  fresh.run(1);
  for (const sim::TimedFrame& entry : fresh.wire.log) needless.note(entry.frame, from_start.add(entry.frame));
  EXPECT_FALSE(needless.due({fresh.now_us}, 0));
  EXPECT_STREQ(needless.outcome(), "not needed");
}

TEST(WiredNode, a_reset_in_the_middle_of_a_log_is_a_second_life) {
  WiredRover rover;
  rover.foreign_per_s = 200;
  rover.run(6.0013);
  rover.wire.discard();
  rover.boot();  // a watchdog
  rover.run(8);
  const Repetition r = repeat_at_the_desk(rover.wire.log);
  EXPECT_EQ(r.recording.lives.size(), 2U);
  EXPECT_FALSE(r.recording.hole) << r.recording.hole->why;
  EXPECT_EQ(r.different, 0U) << r.first;
  EXPECT_GE(r.compared + 1, rover.epochs()) << "but for one that the reset cut short";
}

TEST(WiredNode, hardware_in_the_loop_switches_the_wired_sensors_off) {
  WiredRover rover;
  rover.run(5);
  rover.command(bus::ResetWhat::kWiredOff);
  rover.run(0.3);
  ASSERT_TRUE(rover.said<bus::EstDiagWired>().back().wired_off) << "said within 150 ms";
  EXPECT_TRUE(rover.said<bus::EstDiagWired>().back().wired_imu);
  const std::size_t samples = rover.said<bus::InWheelCounts>().size();
  rover.run(0.5);
  EXPECT_EQ(rover.said<bus::InWheelCounts>().size(), samples);
  for (int i = 0; i < 200; ++i) {  // a simulator that feeds the same ids
    const auto stamp = static_cast<std::uint32_t>(rover.now_us & 0xFFFFF);
    rover.wire.foreign(
        bus::frame(0x300, bus::InWheelCounts{.stamp_us = stamp, .seq = static_cast<std::uint8_t>(i & 15)}));
    rover.run(0.01);
  }
  const auto conflict = [](const bus::EstStatus& s) { return (s.faults >> 15 & 1) != 0; };
  EXPECT_FALSE(conflict(rover.said<bus::EstStatus>().back()));
  EXPECT_NE(rover.said<bus::EstStatus>().back().used & 2, 0) << "wheel counts of the simulator are used";
  rover.command(bus::ResetWhat::kWiredOn);
  rover.run(5);
  EXPECT_FALSE(rover.said<bus::EstDiagWired>().back().wired_off);
  const Repetition r = repeat_at_the_desk(rover.wire.log);
  EXPECT_FALSE(r.recording.hole) << r.recording.hole->why;
  expect_equal(r, rover.epochs());
}

TEST(WiredNode, a_second_node_of_its_ids_is_a_conflict) {
  const auto conflict = [](const WiredRover& rover) {
    return (rover.said<bus::EstStatus>().back().faults >> static_cast<unsigned>(sensor::Fault::kIdConflict) & 1) != 0;
  };
  WiredRover rover;
  rover.run(4);
  EXPECT_FALSE(conflict(rover));
  rover.wire.foreign(bus::frame(0x300, bus::EstPos{}, 2));  // an estimate of another node
  rover.run(0.3);
  EXPECT_TRUE(conflict(rover));
  rover.run(2);
  EXPECT_FALSE(conflict(rover)) << "a second without one";
  rover.wire.foreign(bus::frame(0x300, bus::InWheelCounts{.left = 9'999}));  // a sample that is wired here
  rover.run(0.3);
  EXPECT_TRUE(conflict(rover));
  EXPECT_EQ(rover.said<bus::EstStatus>().back().mode, sensor::Mode::kNominal);
  // The log holds one wheel sample more than the node consumed.
  const Repetition r = repeat_at_the_desk(rover.wire.log);
  ASSERT_TRUE(r.recording.hole);
  EXPECT_NE(r.recording.hole->why.find("IdConflict"), std::string::npos) << r.recording.hole->why;
  EXPECT_NEAR(static_cast<double>(r.compared), 630, 4);
  EXPECT_EQ(r.different, 0U) << r.first;
}

TEST(WiredNode, sensors_start_behind_the_self_check_and_the_watchdog_behind_them) {
  WiredRover rover;
  static_cast<void>(rover.firmware->self_check(50));
  EXPECT_FALSE(rover.board.sensors_started || rover.board.watchdog_started);
  EXPECT_EQ(rover.board.imu.counters().transfers, 0);
  rover.firmware->poll();
  EXPECT_TRUE(rover.board.sensors_started && rover.board.watchdog_started);
  EXPECT_EQ(rover.board.kicks, 0U);
  rover.run(1);
  EXPECT_EQ(rover.board.kicks, 4'000U) << "once a poll";
  EXPECT_EQ(rover.board.idles, 4'001U);
}

TEST(WiredNode, its_board_and_drivers_are_on_the_bus) {
  WiredRover rover;
  rover.board.report = {.cause = hal::BootCause::kCpuFault,
                        .fallback_clock = true,
                        .fault = {.fault = hal::CpuFault::kStack, .program_counter = 0x0801'2345}};
  rover.board.stack_use = {.reserved = 3'072, .used = 2'184};
  rover.run(6);
  const bus::EstDiagBoot boot = rover.said<bus::EstDiagBoot>().back();
  EXPECT_EQ(boot.boot_cause, bus::BootCause::kCpuFault);
  EXPECT_EQ(boot.fault, bus::CpuFault::kStack);
  EXPECT_EQ(boot.fault_pc, 0x0801'2345U);
  EXPECT_EQ(boot.stack, 2'184U);
  EXPECT_TRUE(boot.watchdog && boot.fallback);
  bus::EstDiagImu imu = rover.said<bus::EstDiagImu>().back();
  EXPECT_EQ(imu.imu_state, bus::ImuState::kRunning);
  EXPECT_EQ(imu.imu_identity + imu.imu_bus_fault + imu.imu_fifo + imu.imu_stall + imu.imu_restarts, 0);
  bus::EstDiagWired wired = rover.said<bus::EstDiagWired>().back();
  EXPECT_TRUE(wired.wired_imu && wired.wired_encoders && wired.wired_gnss && !wired.wired_off);
  EXPECT_EQ(wired.gnss_state, bus::GnssState::kRunning);
  EXPECT_EQ(wired.gnss_baud, 115'200U) << "found at 38 400 and set";

  rover.board.imu.inject(fakes::Fault::kWrongIdentity);
  rover.board.left_encoder.inject(fakes::EncoderFault::kJump, {.counts = 50'000});
  rover.board.gnss.line_faults = {.overrun = 3, .framing = 300, .lapped = 4};
  rover.run(6);
  imu = rover.said<bus::EstDiagImu>().back();
  EXPECT_GT(imu.imu_identity, 0);
  EXPECT_NE(imu.imu_state, bus::ImuState::kRunning);
  wired = rover.said<bus::EstDiagWired>().back();
  EXPECT_GE(wired.encoder_jumps, 1);
  EXPECT_EQ(wired.gnss_framing, 255) << "saturates";
  EXPECT_EQ(wired.gnss_lost, 7);
}

}  // namespace
}  // namespace tetap::test
