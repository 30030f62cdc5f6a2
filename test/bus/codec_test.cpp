// SPDX-License-Identifier: Apache-2.0
// Laws that hold for every message of the DBC, then ids, pages and a few frames by hand.
#include "bus/codec.hpp"
#include "bus/messages.hpp"

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <set>
#include <type_traits>

#include <gtest/gtest.h>

namespace tetap::bus {
namespace {

/// The bits of a frame that message M uses.
template <class M>
std::uint64_t used_bits() {
  std::uint64_t used = 0;
  if constexpr (Paged<M>) used = M::kMux.mask() << M::kMux.start;
  M message;
  M::each(message, [&used]<Signal kSignal>(At<kSignal>, auto&) { used |= kSignal.mask() << kSignal.start; });
  return used;
}

/// A word of M's page.
template <class M>
std::uint64_t on_page(std::uint64_t any) {
  if constexpr (Paged<M>) return (any & ~(M::kMux.mask() << M::kMux.start)) | M::kMux.put(M::kPage);
  return any;
}

template <class M>
class EveryMessage : public testing::Test {};
TYPED_TEST_SUITE(EveryMessage, AllMessages<testing::Types>);

TYPED_TEST(EveryMessage, SurvivesDecodeThenEncodeForRandomBits) {
  std::mt19937_64 random(TypeParam::kOffset);
  const std::uint64_t used = used_bits<TypeParam>();
  for (int i = 0; i < 20'000; ++i) {
    std::uint64_t bits = random();
    if (i % 4 == 1) bits |= random() | random();  // all ones, the unsigned codes for not available, are tried too
    if (i % 4 == 2) bits &= random() & random();
    if (i == 0) bits = ~std::uint64_t{0};
    const std::uint64_t sent = on_page<TypeParam>(bits);
    const auto message = decode<TypeParam>(bytes(sent));
    ASSERT_TRUE(message.has_value());
    ASSERT_EQ(word(encode(*message)), sent & used) << std::hex << sent;
  }
}

TYPED_TEST(EveryMessage, SurvivesAtEveryStepOfEverySignal) {
  TypeParam message;
  TypeParam::each(message, []<Signal kSignal>(At<kSignal>, auto& field) {
    using Field = std::remove_cvref_t<decltype(field)>;
    if constexpr (kSignal.length <= 24) {
      const std::int64_t last = kSignal.gap() > 0 ? static_cast<std::int64_t>(kSignal.mask()) : kSignal.highest();
      std::int64_t wrong = 0;
      for (std::int64_t steps = kSignal.is_signed ? kSignal.gap() : 0; steps <= last; ++steps) {
        const auto value = from_steps<kSignal, Field>(steps);
        if (to_steps<kSignal>(value) != steps) ++wrong;
        if constexpr (std::is_same_v<Field, float>) {
          if (steps != kSignal.gap() && !std::isfinite(value)) ++wrong;
          if (steps == kSignal.gap() && !std::isnan(value)) ++wrong;
        }
      }
      EXPECT_EQ(wrong, 0) << "signal at bit " << int{kSignal.start};
    }
  });
}

TYPED_TEST(EveryMessage, SaturatesAndNeverWraps) {
  TypeParam message;
  TypeParam::each(message, [&message]<Signal kSignal>(At<kSignal>, auto& field) {
    using Field = std::remove_cvref_t<decltype(field)>;
    const auto sent = [&message, &field](Field value) {
      field = value;
      return kSignal.get(word(encode(message)));
    };
    using Limits = std::numeric_limits<float>;
    if constexpr (std::is_same_v<Field, float>) {
      const float per_unit = static_cast<float>(kSignal.per_unit);
      const float top = static_cast<float>(kSignal.highest()) / per_unit;
      const float bottom = static_cast<float>(kSignal.lowest()) / per_unit;
      for (const float value :
           {top, std::nextafter(top, Limits::max()), top + 0.6F / per_unit, top + 1 / per_unit, top + 1, 2 * top + 2,
            65536 * (top + 1), 4.3e9F, 9.3e18F, Limits::max(), Limits::infinity()}) {
        EXPECT_EQ(sent(value), kSignal.highest()) << value;
      }
      for (const float value : {bottom, std::nextafter(bottom, Limits::lowest()), bottom - 0.6F / per_unit,
                                bottom - 1 / per_unit, bottom - 1, 2 * bottom - 2, 65536 * (bottom - 1), -4.3e9F,
                                -9.3e18F, Limits::lowest(), -Limits::infinity()}) {
        EXPECT_EQ(sent(value), kSignal.lowest()) << value;
      }
      EXPECT_EQ(sent(Limits::quiet_NaN()), kSignal.gap());
      EXPECT_EQ(sent(-Limits::signaling_NaN()), kSignal.gap());
      EXPECT_EQ(sent(-0.0F), 0);
      EXPECT_EQ(sent(Limits::denorm_min()), 0);
    } else if constexpr (std::is_integral_v<Field> && !std::is_same_v<Field, bool> && !kSignal.wraps) {
      // A type that is no wider than its signal cannot hold a value out of range.
      constexpr auto kMost = std::numeric_limits<Field>::max();
      constexpr auto kLeast = std::numeric_limits<Field>::min();
      constexpr bool kHasGap = kSignal.has_gap;
      const auto most = static_cast<Field>(kMost - (kHasGap && !kSignal.is_signed ? 1 : 0));
      const auto least = static_cast<Field>(kLeast + (kHasGap && kSignal.is_signed ? 1 : 0));
      EXPECT_EQ(sent(most), kSignal.highest());
      EXPECT_EQ(sent(least), kSignal.lowest());
      EXPECT_EQ(sent(static_cast<Field>(kSignal.highest())), kSignal.highest());
      EXPECT_EQ(sent(static_cast<Field>(kSignal.lowest())), kSignal.lowest());
      if (kHasGap) {
        EXPECT_EQ(sent(kSignal.is_signed ? kLeast : kMost), kSignal.gap());
      }
    }
    field = Field{};
  });
}

TYPED_TEST(EveryMessage, LeavesUnusedBitsZeroAndIgnoresThem) {
  const std::uint64_t used = used_bits<TypeParam>();
  std::mt19937_64 random(7);
  for (int i = 0; i < 1000; ++i) {
    const std::uint64_t bits = on_page<TypeParam>(random());
    const auto clean = decode<TypeParam>(bytes(bits & used));
    const auto dirty = decode<TypeParam>(bytes(bits | ~used));
    ASSERT_TRUE(clean && dirty);
    ASSERT_EQ(encode(*clean), encode(*dirty));
    ASSERT_EQ(word(encode(*dirty)) & ~used, 0U);
  }
}

TYPED_TEST(EveryMessage, IsRefusedWithAnyOtherLength) {
  const std::array<std::uint8_t, 12> room{};
  for (std::size_t size = 0; size <= room.size(); ++size) {
    const bool page_0 = [] {
      if constexpr (Paged<TypeParam>) return TypeParam::kPage == 0;
      return true;
    }();
    EXPECT_EQ(decode<TypeParam>(std::span(room).first(size)).has_value(), size == 8 && page_0) << size;
  }
}

TYPED_TEST(EveryMessage, IsRefusedOnAnyOtherPage) {
  if constexpr (Paged<TypeParam>) {
    for (std::uint64_t page = 0; page <= TypeParam::kMux.mask(); ++page)
      EXPECT_EQ(decode<TypeParam>(bytes(TypeParam::kMux.put(static_cast<std::int64_t>(page)))).has_value(),
                page == TypeParam::kPage);
  }
}

/// Offsets of all messages; pages of one message share theirs.
template <class... Ms>
struct Offsets {
  static constexpr std::size_t kMessages = sizeof...(Ms);
  template <class M>
  static void add(std::multiset<std::uint32_t>& all) {
    if constexpr (Paged<M>) {
      if (M::kPage != 0) return;
    }
    if constexpr (Repeated<M>) {
      for (std::size_t i = 0; i < M::kCount; ++i) all.insert(offset_of<M>(i));
    } else {
      all.insert(offset_of<M>());
    }
  }
  static std::multiset<std::uint32_t> all() {
    std::multiset<std::uint32_t> offsets;
    (add<Ms>(offsets), ...);
    return offsets;
  }
};

TEST(MessageIds, AreWithinOneBlockAndDifferent) {
  const auto all = AllMessages<Offsets>::all();
  EXPECT_EQ(std::set<std::uint32_t>(all.begin(), all.end()).size(), all.size());
  EXPECT_GE(all.size(), 40U);
  EXPECT_LT(*all.rbegin(), kBlock);
}

TEST(MessageIds, OfTwoNodesDoNotMeet) {
  const EstMotion motion{.yaw_rad = 1.0F};
  EXPECT_EQ(frame(0x300, motion, 0).id, 0x329U);
  EXPECT_EQ(frame(0x300, motion, 3).id, 0x33BU);
  EXPECT_EQ(frame(0x340, motion, 0).id, 0x369U);
  EXPECT_EQ(frame(0x340, ImuGyro{}, 2).id, 0x356U);
  EXPECT_EQ(frame(0x340, InSync{}, 2).id, 0x340U) << "a message that is not repeated has one id";
  EXPECT_EQ(frame(0x300, motion).data, frame(0x340, motion).data);
}

TEST(Frames, AreWhatTheLayoutSaysByHand) {
  // yaw 1.0 rad = 10000 = 0x2710; speed -1 m/s = -1000 = 0xFC18; yaw rate not available = 0x8000; epoch 5; position and
  // velocity valid
  const base::CanFrame out = frame(0x300,
                                   EstMotion{.yaw_rad = 1.0F,
                                             .speed_mps = -1.0F,
                                             .yaw_rate_radps = std::numeric_limits<float>::quiet_NaN(),
                                             .epoch = 5,
                                             .pos_valid = true,
                                             .hdg_valid = false,
                                             .vel_valid = true},
                                   1);
  EXPECT_EQ(out.id, 0x32FU);
  EXPECT_EQ(out.size, 8);
  EXPECT_FALSE(out.extended);
  EXPECT_EQ(out.data, (Payload{0x10, 0x27, 0x18, 0xFC, 0x00, 0x80, 0x55, 0x00}));
}

TEST(Frames, OfSensorsCarryTheLowBitsOfTheStamp) {
  const auto sent = decode<InWheelCounts>(
      encode(InWheelCounts{.stamp_us = 0x12345678, .seq = 17, .inst = 1, .left = 65535, .right = 0}));
  EXPECT_EQ(*sent, (InWheelCounts{.stamp_us = 0x45678, .seq = 1, .inst = 1, .left = 65535, .right = 0}));
}

TEST(Frames, ThatClaimMoreBytesThanTheyHaveAreReadNoFurther) {
  base::CanFrame frame;
  frame.size = 200;
  EXPECT_EQ(payload(frame).size(), 8U);
}

// The codec is usable where the compiler needs a constant.
constexpr EstPos kSent{.x_raw = -5, .y_raw = EstPos::kYNotAvailable, .epoch = 3, .kind = sensor::EstimatorKind::kEkf};
static_assert(*decode<EstPos>(payload(frame(0x340, kSent, 1))) == kSent);
static_assert(decode<InRangeBearing>(encode(InRangeBearing{.id = 9, .range_m = 1e30F, .bearing_rad = -0.25F}))
                  ->bearing_rad < -0.2498F);
static_assert(!decode<EstStdPose>(encode(EstStdMore{})));
static_assert(encode(InMapEntry{.id = 7, .x_raw = 1, .y_raw = -1}) == Payload{7, 1, 0, 0, 0xF0, 0xFF, 0xFF, 0xFF});

}  // namespace
}  // namespace tetap::bus
