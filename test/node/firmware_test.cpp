// SPDX-License-Identifier: Apache-2.0
// The loop on a board whose clock the test turns: what it counts of its own lateness and of the sync frames.
#include "tetap/firmware/firmware.hpp"

#include "bench.hpp"

#include <gtest/gtest.h>

#include <memory>

namespace tetap::test {
namespace {

struct SlowBoard {
  struct Can {
    Frames to_node, sent;
    std::size_t next = 0;
    base::Micros* clock = nullptr;
    base::Micros cost;  ///< duration of the tick, at the epoch's first frame

    bool send(const base::CanFrame& frame) {
      if (frame.id == 0x300 + bus::EstEpoch::kOffset) *clock += cost;
      sent.push_back(frame);
      return true;
    }
    std::optional<base::CanFrame> receive() {
      if (next == to_node.size()) return std::nullopt;
      return to_node[next++];
    }
    void flush() {}
    [[nodiscard]] base::CanFaults faults() const { return {.tx_high = 7}; }
  } can;
  base::Micros time;
  [[nodiscard]] base::Micros now() const { return time; }
};

class Loop : public ::testing::Test {
 protected:
  Loop() { board.can.clock = &board.time; }

  void poll_for(std::int64_t us) {
    for (const base::Micros until = board.time + base::Micros{us}; board.time < until; board.time += base::Micros{250})
      firmware->poll();
  }
  void sync(bus::SyncKind kind, std::int64_t time_us, int counter) {
    const bus::InSync message{
        .time_us = static_cast<std::uint64_t>(time_us), .ctr = static_cast<std::uint8_t>(counter), .kind = kind};
    if (kind == bus::SyncKind::kBegin) board.can.to_node.push_back(in(bus::guard_of_sync(message)));
    board.can.to_node.push_back(in(message));
    firmware->poll();
  }
  template <class Page>
  Page published() const {
    const auto page = last<Page>(board.can.sent);
    EXPECT_TRUE(page.has_value());
    return page.value_or(Page{});
  }
  [[nodiscard]] int ticks() const { return static_cast<int>(all<bus::EstEpoch>(board.can.sent).size()); }

  SlowBoard board;
  std::unique_ptr<firmware::Firmware<SlowBoard, node::Estimators<estimators::Odometry, estimators::PoseEkf>>> firmware =
      std::make_unique<firmware::Firmware<SlowBoard, node::Estimators<estimators::Odometry, estimators::PoseEkf>>>(
          board, kNumbers, bus::Version{});
};

TEST_F(Loop, TicksThatKeepTheirPeriodAreNotLate) {
  board.can.cost = {6'000};
  poll_for(2'000'000);
  EXPECT_GE(ticks(), 195);
  EXPECT_EQ(published<bus::EstDiagTicks>().ticks_late, 0);
  EXPECT_EQ(published<bus::EstDiagLoop>().loop_max_us, 6'000U);
  EXPECT_EQ(published<bus::EstDiagLoop>().tx_high, 7U);
}

TEST_F(Loop, ATickThatOverrunsItsPeriodIsCountedOnItsOwnTimer) {
  int slow = 0;
  for (int k = 0; k < 500; ++k) {
    board.can.cost = {k % 4 == 0 ? 19'000 : 1'000};
    const int before = ticks();
    while (ticks() == before) poll_for(250);
    slow += k % 4 == 0;
  }
  board.can.cost = {1'000};
  poll_for(2'000'000);
  EXPECT_GE(published<bus::EstDiagTicks>().ticks_late, slow);
  EXPECT_LE(published<bus::EstDiagTicks>().ticks_late, slow + slow / 2) << "and the periods it swallowed, if any";
}

TEST_F(Loop, ATickThatOverrunsItsPeriodIsCountedWhenItFollows) {
  std::int64_t time_us = 5'000'000;
  for (int k = 0; k < 400; ++k) {
    board.can.cost = {k >= 100 && k < 150 ? 14'500 : 1'000};
    sync(bus::SyncKind::kTick, time_us += 10'000, k);
    poll_for(9'000);
  }
  EXPECT_EQ(published<bus::EstDiagLoop>().sync, bus::SyncState::kFollowing);
  EXPECT_GE(published<bus::EstDiagTicks>().ticks_late, 50);
}

TEST_F(Loop, SyncFramesThatNeverCameAreCountedByTheirCounter) {
  std::int64_t time_us = 5'000'000;
  sync(bus::SyncKind::kBegin, time_us, 200);
  int counter = 10;  // Begin comes from a new host: no gap
  sync(bus::SyncKind::kBegin, time_us, counter);
  const auto step = [&](int by) { sync(bus::SyncKind::kStep, time_us += 10'000, counter += by); };
  for (int k = 0; k < 300; ++k) step(1);
  EXPECT_EQ(published<bus::EstDiagSync>().sync_gap, 0) << "the counter wraps, nothing is missing";
  step(3);
  sync(bus::SyncKind::kStep, time_us, counter);      // again
  sync(bus::SyncKind::kStep, time_us, counter - 2);  // one that comes late
  step(1);
  step(2);
  for (int k = 0; k < 120; ++k) step(1);
  EXPECT_EQ(published<bus::EstDiagSync>().sync_gap, 3);
}

TEST_F(Loop, ALongLossOfSyncIsCountedAndSoIsAShortOneAfterIt) {
  std::int64_t time_us = 5'000'000;
  int counter = 0;
  sync(bus::SyncKind::kBegin, time_us, counter);
  const auto after = [&](int frames) { sync(bus::SyncKind::kStep, time_us += 10'000 * frames, counter += frames); };
  for (int k = 0; k < 20; ++k) after(1);
  after(201);
  for (int k = 0; k < 120; ++k) after(1);
  EXPECT_EQ(published<bus::EstDiagSync>().sync_gap, 200);
  after(6);
  for (int k = 0; k < 120; ++k) after(1);
  EXPECT_EQ(published<bus::EstDiagSync>().sync_gap, 205);
}

TEST_F(Loop, SyncFramesOfWrongLengthAreCountedAndChangeNothing) {
  std::int64_t time_us = 5'000'000;
  sync(bus::SyncKind::kBegin, time_us, 0);
  for (int k = 1; k <= 120; ++k) {
    sync(bus::SyncKind::kStep, time_us += 10'000, k);
    if (k > 50) continue;
    base::CanFrame half = in(bus::InSync{.time_us = 1, .kind = bus::SyncKind::kStep});
    half.size = 5;
    board.can.to_node.push_back(half);
    firmware->poll();
  }
  EXPECT_EQ(ticks(), 120);
  EXPECT_EQ(published<bus::EstDiagSync>().sync_bad, 50);
  EXPECT_EQ(published<bus::EstDiagSync>().sync_gap, 0);
}

}  // namespace
}  // namespace tetap::test
