// SPDX-License-Identifier: Apache-2.0
// SocketCAN on a real vcan: run it under `tools/run/provide_vcan -i vcan0 -i vcan1`, as root (it takes interfaces
// down).
#include "hal/board/linux/socket_can.hpp"

#include "hal/board/linux/clock.hpp"
#include "host/stand_in_node.hpp"
#include "sim_host/replay/lockstep.hpp"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>

#include <cstdio>
#include <cstdlib>
#include <stdexcept>
#include <string>

namespace tetap::hal {
namespace {

base::CanFrame numbered(std::uint32_t n) {
  return {
      .id = 0x100 + n % 0x100,
      .extended = n % 3 == 0,
      .size = 8,
      .data = {static_cast<std::uint8_t>(n), static_cast<std::uint8_t>(n >> 8), static_cast<std::uint8_t>(n >> 16)}};
}

std::string refusal(const std::string& interface) {
  try {
    SocketCan can(interface);
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "";
}

int shell(const std::string& command) { return std::system(command.c_str()); }

/// The next frame, waiting a second at most.
std::optional<base::CanFrame> next(SocketCan& can) {
  const base::Micros began = monotonic_clock();
  while (monotonic_clock() - began < base::Micros{1'000'000}) {
    if (const auto frame = can.receive()) return frame;
    can.wait({50'000});
  }
  return std::nullopt;
}

TEST(SocketCan, AnAcceptanceFilterLetsThroughTheInputsOfANodeAlone) {
  SocketCan a("vcan0"), b("vcan0", {.accept = Acceptance{.id = 0x340, .mask = 0x7E0}});
  for (const base::CanFrame& frame :
       {base::CanFrame{.id = 0x33F}, base::CanFrame{.id = 0x340}, base::CanFrame{.id = 0x340, .extended = true},
        base::CanFrame{.id = 0x35F}, base::CanFrame{.id = 0x360}, base::CanFrame{.id = 0x341}})
    ASSERT_TRUE(a.send(frame));
  a.flush();
  for (const std::uint32_t expected : {0x340U, 0x35FU, 0x341U}) EXPECT_EQ(next(b)->id, expected);
  EXPECT_EQ(b.receive(), std::nullopt);
}

TEST(SocketCan, FramesGoBothWaysAndNobodyHearsHimself) {
  SocketCan a("vcan0"), b("vcan0");
  for (std::uint8_t size = 0; size <= 8; ++size) {
    const base::CanFrame there{.id = 0x7FF, .size = size, .data = {}},
        back{.id = 0x1FFFFFFF, .extended = true, .size = size, .data = {}};
    ASSERT_TRUE(a.send(there));
    a.flush();
    EXPECT_EQ(next(b), there);
    ASSERT_TRUE(b.send(back));
    b.flush();
    EXPECT_EQ(next(a), back);
  }
  EXPECT_FALSE(a.receive());
  EXPECT_FALSE(b.receive());
}

TEST(SocketCan, TwoInterfacesAreTwoBuses) {
  SocketCan a("vcan0"), b("vcan1");
  ASSERT_TRUE(a.send(numbered(1)));
  a.flush();
  b.wait({50'000});
  EXPECT_FALSE(b.receive());
}

TEST(SocketCan, ABatchOfTwentyThousandArrivesWholeAndInOrder) {
  SocketCan a("vcan0"), b("vcan0");
  constexpr std::uint32_t kCount = 20'000;
  const base::Micros began = monotonic_clock();
  for (std::uint32_t n = 0; n < kCount; ++n) ASSERT_TRUE(a.send(numbered(n)));
  a.flush();
  const base::Micros sent = monotonic_clock();
  for (std::uint32_t n = 0; n < kCount; ++n) {
    const auto frame = next(b);
    ASSERT_TRUE(frame) << n << " arrived, " << b.faults().rx_overflow << " lost in the buffer";
    ASSERT_EQ(*frame, numbered(n));
  }
  const base::Micros received = monotonic_clock();
  EXPECT_EQ(b.faults().rx_overflow, 0U);
  std::printf("%.0f frames/s sent, %.0f frames/s received\n", kCount * 1e6 / static_cast<double>((sent - began).us),
              kCount * 1e6 / static_cast<double>((received - sent).us));
}

TEST(SocketCan, FramesTheKernelHadToDropAreCountedExactly) {
  SocketCan a("vcan0"), b("vcan0", {.receive_buffer_bytes = 20'000});
  constexpr std::uint32_t kCount = 3000;
  for (std::uint32_t n = 0; n < kCount; ++n) ASSERT_TRUE(a.send(numbered(n)));
  a.flush();
  std::uint32_t got = 0;
  while (b.receive()) ++got;
  ASSERT_TRUE(a.send(numbered(0)));  // the count comes with the next frame
  a.flush();
  EXPECT_TRUE(next(b));
  EXPECT_LT(got, kCount);
  EXPECT_EQ(got + b.faults().rx_overflow, kCount);
}

TEST(SocketCan, RemoteFramesAreCountedNotDelivered) {
  SocketCan a("vcan0");
  ASSERT_EQ(shell("cansend vcan0 123#R && cansend vcan0 124#55"), 0);
  const auto frame = next(a);
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->id, 0x124U);
  EXPECT_EQ(a.ignored(), 1U);
}

TEST(SocketCan, ArrivalTimesAreTheKernels) {
  SocketCan a("vcan0"), b("vcan0", {.arrival_times = true});
  const base::Micros before = wall_clock();
  ASSERT_TRUE(a.send(numbered(0)));
  a.flush();
  const base::Micros after = wall_clock();
  sleep_for({100'000});
  ASSERT_TRUE(next(b));
  EXPECT_GE(b.last_arrival().us, before.us - 20'000);
  EXPECT_LE(b.last_arrival().us, after.us + 20'000);
}

TEST(SocketCan, ReceivingNeverWaitsAndWaitingEnds) {
  SocketCan a("vcan0");
  EXPECT_FALSE(a.receive());
  const base::Micros began = monotonic_clock();
  a.wait({30'000});
  EXPECT_GE((monotonic_clock() - began).us, 25'000) << "the processor is not burnt";
}

TEST(SocketCan, AnInterfaceThatIsMissingDownOrNoneIsNamedWithTheCommandThatHelps) {
  EXPECT_EQ(
      refusal("vcan77"),
      "CAN interface vcan77 does not exist; make it with: ip link add dev vcan77 type vcan && ip link set up vcan77");
  EXPECT_NE(refusal("lo").find("interface lo is not a CAN interface"), std::string::npos) << refusal("lo");
  EXPECT_NE(refusal("").find("not a name for an interface"), std::string::npos);
  EXPECT_NE(refusal("a-name-that-is-too-long").find("not a name for an interface"), std::string::npos);
  ASSERT_EQ(shell("ip link add dev vcan5 type vcan"), 0);
  EXPECT_EQ(refusal("vcan5"), "CAN interface vcan5 is down; start it with: ip link set up vcan5");
  EXPECT_EQ(shell("ip link del vcan5"), 0);
}

TEST(SocketCan, ServiceGoesOnAfterTheInterfaceWasDown) {
  SocketCan a("vcan1"), b("vcan1");
  ASSERT_EQ(shell("ip link set down vcan1"), 0);
  EXPECT_FALSE(b.receive());
  static_cast<void>(a.send(numbered(1)));
  a.flush();
  EXPECT_EQ(a.faults().bus_off, 1U);
  EXPECT_EQ(b.faults().bus_off, 1U);
  EXPECT_EQ(a.faults().tx_full, 1U);
  ASSERT_EQ(shell("ip link set up vcan1"), 0);
  static_cast<void>(a.send(numbered(2)));
  a.flush();
  EXPECT_EQ(next(b), numbered(2));
  EXPECT_EQ(a.faults().bus_off, 1U);
}

TEST(SocketCan, ServiceGoesOnAfterTheInterfaceWasRemoved) {
  ASSERT_EQ(shell("ip link add dev vcan6 type vcan && ip link set up vcan6"), 0);
  SocketCan a("vcan6"), b("vcan6");
  ASSERT_EQ(shell("ip link del vcan6"), 0);
  a.wait({1000});
  EXPECT_FALSE(a.receive());
  static_cast<void>(a.send(numbered(1)));
  a.flush();
  EXPECT_FALSE(b.receive());
  EXPECT_GE(a.faults().bus_off, 1U);
  ASSERT_EQ(shell("ip link add dev vcan6 type vcan && ip link set up vcan6"), 0);
  sleep_for({150'000});
  a.wait({1000});
  b.wait({1000});
  ASSERT_TRUE(a.send(numbered(3)));
  a.flush();
  EXPECT_EQ(next(b), numbered(3));
  EXPECT_EQ(shell("ip link del vcan6"), 0);
}

/// A node in a process of its own on the bus; the player's throughput with it, printed.
class Throughput : public testing::TestWithParam<std::size_t> {};
INSTANTIATE_TEST_SUITE_P(Windows, Throughput, testing::Values(1U, 8U, 16U));

TEST_P(Throughput, LockstepOverVcanLosesNothing) {
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    SocketCan can("vcan0");
    test::StandInNode node(can, 0x300);
    for (;;) {
      node.poll();
      can.wait({500'000});
    }
  }
  constexpr int kTicks = 3000;
  sim::Script script;
  for (int i = 0; i < kTicks; ++i) {
    script.add_input({.id = 0x308, .size = 8, .data = {static_cast<std::uint8_t>(i)}});
    script.add_input({.id = 0x309, .size = 8, .data = {static_cast<std::uint8_t>(i)}});
    script.add_tick({(i + 1) * 10'000}, i == 0 ? std::optional(base::Micros{0}) : std::nullopt);
  }
  SocketCan can("vcan0");
  test::KeepAll sink;
  sim::Counts counts;
  const base::Micros began = monotonic_clock();
  ASSERT_TRUE(sim::play_lockstep(can, script, sink, {.base = 0x300, .window = GetParam()}, counts));
  const double wall_s = static_cast<double>((monotonic_clock() - began).us) * 1e-6;
  kill(child, SIGTERM);
  waitpid(child, nullptr, 0);
  EXPECT_EQ(counts.lost() + counts.extra(), 0U);
  EXPECT_EQ(counts.epochs, static_cast<std::uint64_t>(kTicks));
  std::printf("window %zu: %.0f epochs/s, %.1f x real time, %.0f frames/s\n", GetParam(), kTicks / wall_s,
              kTicks * 0.01 / wall_s,
              static_cast<double>(sink.sent_frames.size() + sink.received_frames.size()) / wall_s);
}

}  // namespace
}  // namespace tetap::hal
