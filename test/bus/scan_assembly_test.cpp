// SPDX-License-Identifier: Apache-2.0
// Scans put together from their frames: ranges, lost and foreign blocks, halves, heads that mean nothing, the pool.
#include "tetap/bus/scan_assembly.hpp"
#include "support/scan_frames.hpp"

#include <gtest/gtest.h>

namespace tetap::bus {
namespace {

struct Taken {
  std::vector<sensor::Sample> samples;
  void sample(const sensor::Sample& sample) { samples.push_back(sample); }
};
struct Assembling : testing::Test {
  void send(const std::vector<base::CanFrame>& frames) {
    for (const auto& frame : frames) {
      const auto offset = static_cast<std::uint8_t>(frame.id - 0x300);
      assembly.on_frame(offset, frame, frame_crc(offset, frame), {now_us}, counters, taken);
    }
  }
  ScanAssembly assembly;
  Counters counters;
  Taken taken;
  std::int64_t now_us = 5'000'000;
};

TEST_F(Assembling, AScanIsWhatItsFramesSay) {
  const std::vector<std::uint16_t> ranges{7, 0, 8190, 1, 300};
  send(test::scan_frames(now_us - 2'000, 3, ranges, -1.5F, 0.02F));
  ASSERT_EQ(taken.samples.size(), 1U);
  const auto& sample = taken.samples[0];
  EXPECT_EQ(sample.stamp.us, now_us - 2'000);
  EXPECT_EQ(sample.sensor, sensor::Sensor::kScan);
  EXPECT_EQ(sample.sequence, 3);
  const auto read = assembly.pool().ranges(sample.payload.scan);
  EXPECT_EQ(std::vector<std::uint16_t>(read.begin(), read.end()), ranges);
  EXPECT_NEAR(sample.payload.scan.first_rad, -1.5F, 1e-6F);
  EXPECT_NEAR(sample.payload.scan.step_rad, 0.02F, 1e-7F);
}

TEST_F(Assembling, ALostDoubledOrForeignBlockEndsTheScanAndIsCounted) {
  const std::vector<base::CanFrame> whole =
      test::scan_frames(now_us, 1, std::vector<std::uint16_t>(16, 200), 0.0F, 0.02F);
  std::vector<base::CanFrame> lost = whole, doubled = whole, foreign = whole;
  lost.erase(lost.begin() + 2);
  doubled.insert(doubled.begin() + 2, doubled[1]);
  foreign[3] = test::scan_frames(now_us, 2, std::vector<std::uint16_t>(16, 200), 0.0F, 0.02F)[3];
  for (const std::vector<base::CanFrame>& bad : {lost, doubled, foreign}) {
    const auto before = counters.incomplete;
    send(bad);
    EXPECT_TRUE(taken.samples.empty());
    EXPECT_GT(counters.incomplete, before);
  }
  send(whole);
  EXPECT_EQ(taken.samples.size(), 1U) << "the next scan is none the worse";
}

TEST_F(Assembling, AHalfExpiresAndAHeadThatDoesNotFitIsRefused) {
  const std::vector<base::CanFrame> whole =
      test::scan_frames(now_us, 1, std::vector<std::uint16_t>(16, 200), 0.0F, 0.02F);
  send({whole[0], whole[1]});
  assembly.expire({now_us + 100'000}, {100'000}, counters);
  EXPECT_EQ(counters.incomplete, 0U);
  assembly.expire({now_us + 100'001}, {100'000}, counters);
  EXPECT_EQ(counters.incomplete, 1U);
  send({whole.begin() + 2, whole.end()});
  EXPECT_TRUE(taken.samples.empty());
  for (const auto count : std::initializer_list<std::uint16_t>{0, 2, 513, 1023})
    send({frame(0x300, InScanHead{.count = count, .step_rad = 0.01F})});
  send({frame(0x300, InScanHead{.count = 9, .first_rad = base::kNan, .step_rad = 0.01F})});
  EXPECT_EQ(counters.out_of_range, 5U);
}

TEST_F(Assembling, TheNewestTwoScansAreKept) {
  for (int k = 1; k <= 3; ++k)
    send(test::scan_frames(now_us, k, std::vector<std::uint16_t>(512, static_cast<std::uint16_t>(k)), -3.0F, 0.01F));
  ASSERT_EQ(taken.samples.size(), 3U);
  EXPECT_TRUE(assembly.pool().ranges(taken.samples[0].payload.scan).empty());
  for (std::size_t k : {1U, 2U}) {
    const auto ranges = assembly.pool().ranges(taken.samples[k].payload.scan);
    ASSERT_EQ(ranges.size(), 512U);
    EXPECT_EQ(ranges.front(), k + 1);
    EXPECT_EQ(ranges.back(), k + 1);
  }
}

}  // namespace
}  // namespace tetap::bus
