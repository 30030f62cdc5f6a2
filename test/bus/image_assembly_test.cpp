// SPDX-License-Identifier: Apache-2.0
// Images as frames: whole or not at all, in a pool whose places the window decides about, with and without a guard.
#include "tetap/bus/image_assembly.hpp"
#include "node/bench.hpp"
#include "tetap/bus/encoder.hpp"
#include "tetap/bus/guard_sender.hpp"

#include <gtest/gtest.h>
#include <algorithm>
#include <random>
#include <vector>

namespace tetap::test {
namespace {

using Features = std::vector<model::ImageFeature>;

Features some(int count, int first = 0) {
  Features features;
  for (int i = first; i < first + count; ++i)
    features.push_back({static_cast<std::uint16_t>((97 * i) & 0xFFF), static_cast<std::uint16_t>((211 * i) % 8191),
                        static_cast<std::uint16_t>((7 * i) % 8191)});
  return features;
}
Frames image(std::int64_t at_us, int seq, const Features& features, int camera = 0) {
  Frames frames;
  bus::encode_image({.tracker_state = 1, .exposure_10us = 250}, features,
                    bus::SampleHead::of({at_us}, static_cast<std::uint8_t>(seq), static_cast<std::uint8_t>(camera)),
                    [&](const auto& message) { frames.push_back(in(message)); });
  return frames;
}

/// Stands for the node: the images that it took are in use until done() says otherwise.
struct Desk {
  bus::ImageAssembly images;
  bus::Counters counters;
  std::vector<sensor::Sample> samples;
  std::size_t done_with = 0;

  void sample(const sensor::Sample& s) { samples.push_back(s); }
  template <class F>
  void each_image(F&& f) const {
    for (std::size_t i = done_with; i < samples.size(); ++i) f(samples[i].payload.image);
  }
  void put(const Frames& frames, std::int64_t reference_us = 10'000'000) {
    for (const base::CanFrame& frame : frames) {
      const auto offset = static_cast<std::uint8_t>(frame.id - 0x300);
      images.on_frame(offset, frame, bus::frame_crc(offset, frame), {reference_us}, counters, *this);
    }
  }
  [[nodiscard]] Features features(std::size_t i) const {
    const auto span = images.pool()->features(samples.at(i).payload.image.place);
    return {span.begin(), span.end()};
  }
};

bool same(const Features& a, const Features& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const auto& x, const auto& y) {
    return x.id == y.id && x.u_quarter_px == y.u_quarter_px && x.v_quarter_px == y.v_quarter_px;
  });
}

TEST(ImageAssembly, AnImageIsOneSampleWithEveryQuarterOfAPixel) {
  Desk desk;
  const Features forty = some(40), none;
  desk.put(image(9'990'123, 7, forty));
  desk.put(image(9'999'000, 8, none));
  ASSERT_EQ(desk.samples.size(), 2U);
  EXPECT_TRUE(same(desk.features(0), forty));
  EXPECT_TRUE(desk.features(1).empty()) << "an image that shows nothing ends every track";
  const sensor::Sample& s = desk.samples[0];
  EXPECT_EQ(s.stamp.us, 9'990'123);
  EXPECT_EQ(s.sensor, sensor::Sensor::kFeature);
  EXPECT_EQ(s.sequence, 7);
  EXPECT_EQ(s.payload.image.features, 40);
  EXPECT_EQ(s.payload.image.exposure_10us, 250);
  EXPECT_EQ(s.payload.image.tracker_state, 1);
  EXPECT_EQ(desk.counters.incomplete, 0);
}

TEST(ImageAssembly, TheOrderOfFeaturesLeavesTheSample) {
  Features features = some(30);
  Desk one, other;
  one.put(image(9'990'000, 1, features));
  std::shuffle(features.begin(), features.end(), std::mt19937(1));
  other.put(image(9'990'000, 1, features));
  EXPECT_EQ(one.samples.at(0).bits, other.samples.at(0).bits) << "it stands for the content in hashes";
}

TEST(ImageAssembly, WhatDoesNotMatchItsCountIsDroppedWholeAndCounted) {
  for (std::size_t lost = 0; lost <= 20; ++lost) {
    Desk desk;
    Frames frames = image(9'990'000, 3, some(20));
    frames.erase(frames.begin() + static_cast<std::ptrdiff_t>(lost));
    desk.put(frames);
    EXPECT_TRUE(desk.samples.empty()) << lost;
    desk.put(image(9'999'000, 4, some(5)));
    ASSERT_EQ(desk.samples.size(), 1U) << lost;
    EXPECT_TRUE(same(desk.features(0), some(5))) << "nothing of the image before is in it";
    EXPECT_EQ(desk.counters.incomplete, 1) << lost << ": without In_Image, too";
  }
  Desk silent;
  Frames frames = image(9'990'000, 3, some(20));
  frames.pop_back();
  silent.put(frames);
  silent.images.expire({10'100'000}, {200'000}, silent.counters);
  EXPECT_EQ(silent.counters.incomplete, 0);
  silent.images.expire({10'200'001}, {200'000}, silent.counters);
  EXPECT_EQ(silent.counters.incomplete, 1) << "nothing comes after it";
}

TEST(ImageAssembly, FramesThatComeTwiceCountOnce) {
  Desk desk;
  for (const base::CanFrame& frame : image(9'990'000, 3, some(20))) desk.put({frame, frame});
  ASSERT_EQ(desk.samples.size(), 1U);
  EXPECT_TRUE(same(desk.features(0), some(20)));
  EXPECT_EQ(desk.counters.duplicate, 21);
  EXPECT_EQ(desk.counters.incomplete, 0);
}

TEST(ImageAssembly, AFullPoolRefusesAndCountsUntilTheWindowLetsGo) {
  Desk desk;
  for (int i = 0; i < 6; ++i) desk.put(image(9'900'000 + i, i, some(10, i)));
  ASSERT_EQ(desk.samples.size(), 4U);
  EXPECT_EQ(desk.counters.timeline_full, 2);
  for (int i = 0; i < 4; ++i) EXPECT_TRUE(same(desk.features(static_cast<std::size_t>(i)), some(10, i))) << i;
  desk.done_with = 2;
  for (int i = 6; i < 9; ++i) desk.put(image(9'900'000 + i, i, some(10, i)));
  ASSERT_EQ(desk.samples.size(), 6U);
  EXPECT_EQ(desk.counters.timeline_full, 3);
  EXPECT_TRUE(same(desk.features(2), some(10, 2))) << "a place in use stays what it is";
  EXPECT_TRUE(same(desk.features(5), some(10, 7)));
  Desk crowd;
  crowd.put(image(9'990'000, 3, some(41)));
  EXPECT_TRUE(crowd.samples.empty()) << "one feature more than an image has room for";
  EXPECT_EQ(crowd.counters.timeline_full, 1);
}

TEST(ImageAssembly, BadFramesAndOtherCamerasAreCounted) {
  Desk desk;
  desk.put(image(9'990'000, 3, some(2), 1));
  EXPECT_EQ(desk.counters.not_used, 3);
  desk.put({in(bus::InFeature{.u = base::kNan, .v = 5.0F}), {.id = 0x34D, .size = 7}});
  EXPECT_EQ(desk.counters.out_of_range, 1);
  EXPECT_EQ(desk.counters.malformed, 1);
  EXPECT_TRUE(desk.samples.empty());
}

TEST(ImageAssembly, AGuardVouchesForAllFramesOfAnImage) {
  for (int damaged = -1; damaged <= 6; ++damaged) {
    Frames frames = image(9'990'000, 3, some(5));
    bus::GuardSender sender;
    std::optional<bus::InGuardSample> guard;
    for (const base::CanFrame& frame : frames) {
      EXPECT_FALSE(guard.has_value()) << "it comes behind In_Image";
      guard = sender.after(static_cast<std::uint8_t>(frame.id - 0x300), frame);
    }
    ASSERT_TRUE(guard.has_value());
    EXPECT_EQ(guard->sensor, sensor::Sensor::kFeature);
    if (damaged >= 0 && damaged < 6) frames[static_cast<std::size_t>(damaged)].data[5] ^= 0x10;
    if (damaged == 6) guard->sample_crc ^= 1U;
    Desk desk;
    bus::SampleGuard guards;
    for (const base::CanFrame& frame : frames)
      guards.frame(static_cast<std::uint8_t>(frame.id - 0x300), frame, {10'000'000}, desk.counters);
    desk.put(frames);
    ASSERT_EQ(desk.samples.size(), 1U) << "the bit is in a value";
    int used = 0, waiting = 0;
    const auto out = [&](const sensor::Sample&) { ++used; };
    guards.sample(desk.samples[0], {10'000'000}, desk.counters, out);
    guards.each_waiting([&](const sensor::Sample& s) { waiting += s.sensor == sensor::Sensor::kFeature ? 1 : 0; });
    EXPECT_EQ(waiting, 1) << "its place in the pool is not free";
    guards.guard(*guard, {10'000'000}, desk.counters, out);
    EXPECT_EQ(used, damaged < 0 ? 1 : 0) << damaged;
    EXPECT_EQ(desk.counters.guard_bad, damaged < 0 ? 0 : 1) << damaged;
  }
}

}  // namespace
}  // namespace tetap::test
