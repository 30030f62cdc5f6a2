// SPDX-License-Identifier: Apache-2.0
#include "sim_host/played_run.hpp"

#include <gtest/gtest.h>

#include <string>
#include <utility>

namespace tetap::sim {
namespace {

constexpr const char* kWhole = "robot = rover\nseed = 7\nduration = 23.48\n";

TEST(PlayedRun, WhatIsWrittenReadsBackTheSame) {
  PlayedRun run{.robot = "mrclam", .seed = ~std::uint64_t{0}, .duration = {23'480'000}, .faults = {}};
  for (const FaultInfo& row : fault_table())
    run.faults.push_back({row.fault, {12'340'500}, {row.duration_s > 0 ? 1'000'001 : 0}});
  const auto back = played_run(text_of(run), "a");
  ASSERT_TRUE(back) << back.failure().text;
  EXPECT_EQ(back->robot, run.robot);
  EXPECT_EQ(back->seed, run.seed);
  EXPECT_EQ(back->duration, run.duration);
  EXPECT_EQ(fault_words(*back), fault_words(run));
  ASSERT_EQ(parse_faults(fault_words(run)).settings.size(), run.faults.size()) << "as --fault takes them";
}

TEST(PlayedRun, LinesMayBeCommentedAndFaultsOfOneLineBeSeveral) {
  const auto run =
      played_run(std::string("# mine\r\n\n").append(kWhole).append("fault=gnss_jump@5+1,slip_left@7 # both\n"), "a");
  ASSERT_TRUE(run) << run.failure().text;
  EXPECT_EQ(run->duration, base::Micros{23'480'000});
  ASSERT_EQ(run->faults.size(), 2U);
  EXPECT_EQ(run->faults[1].start, base::Micros{7'000'000});
}

TEST(PlayedRun, WhatIsWrongIsSaidWithItsLine) {
  for (const auto& [line, why] : {std::pair{"fault = gnss_jmp@5", "gnss_jmp"},
                                  {"fault =", "NAME@START"},
                                  {"seed = 8", "seed comes twice"},
                                  {"speed = 1", "'speed'"},
                                  {"fault gnss_jump", "'name = value'"}}) {
    const auto run = played_run(std::string(kWhole) + line, "mine.faults");
    ASSERT_FALSE(run) << line;
    EXPECT_NE(run.failure().text.find("mine.faults:4: "), std::string::npos) << run.failure().text;
    EXPECT_NE(run.failure().text.find(why), std::string::npos) << run.failure().text;
  }
  for (const char* const bad : {"robot =\nseed = 1\nduration = 1", "robot = a\nseed = -1\nduration = 1",
                                "robot = a\nseed = 1\nduration = 0.001", "robot = a\nseed = 1x\nduration = 1"})
    EXPECT_FALSE(played_run(bad, "a")) << bad;
  const auto part = played_run("robot = rover\nseed = 7\n", "a");
  ASSERT_FALSE(part);
  EXPECT_NE(part.failure().text.find("duration"), std::string::npos);
}

}  // namespace
}  // namespace tetap::sim
