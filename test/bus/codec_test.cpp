// SPDX-License-Identifier: Apache-2.0
// Laws that hold for every message of the DBC, then ids, pages and a few frames by hand.
#include "tetap/bus/codec.hpp"
#include "tetap/bus/messages.hpp"

#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <iomanip>
#include <limits>
#include <optional>
#include <random>
#include <set>
#include <span>
#include <sstream>
#include <string>
#include <type_traits>
#include <vector>

#include <gtest/gtest.h>

namespace tetap::bus {
namespace {

/// One signal of a message: its layout, and its field in the struct.
struct FieldRow {
  enum class Kind : std::uint8_t { kFloat, kInteger, kOther };
  Signal signal;
  Kind kind;
  std::size_t at;                                                      ///< offset of the field in the struct, bytes
  std::size_t size;                                                    ///< size of the field, bytes
  std::int64_t least, most;                                            ///< range of an integer field's type
  std::int64_t (*wrong_steps)(std::int64_t first, std::int64_t last);  ///< steps that decoding and encoding change
};

/// One message or page as data, so that each law below is compiled once and not once a message.
struct MessageRow {
  std::uint32_t offset;
  std::int64_t page;  ///< -1: not paged
  Signal mux;         ///< where the page stands
  std::vector<FieldRow> fields;
  std::optional<std::uint64_t> (*again)(
      std::span<const std::uint8_t> payload);                       ///< decoded and encoded; nothing: refused
  std::uint64_t (*with)(const FieldRow& field, const void* value);  ///< a message with this in a field, encoded

  [[nodiscard]] std::uint64_t used() const {
    std::uint64_t bits = page >= 0 ? mux.mask() << mux.start : 0;
    for (const FieldRow& field : fields) bits |= field.signal.mask() << field.signal.start;
    return bits;
  }
  [[nodiscard]] std::uint64_t on_page(std::uint64_t any) const {
    return page >= 0 ? (any & ~(mux.mask() << mux.start)) | mux.put(page) : any;
  }
  [[nodiscard]] std::optional<std::uint64_t> again_of(std::uint64_t bits) const { return again(bytes(bits)); }
};

template <Signal kSignal, class Field>
std::int64_t wrong_steps(std::int64_t first, std::int64_t last) {
  std::int64_t wrong = 0;
  for (std::int64_t steps = first; steps <= last; ++steps) {
    const auto value = from_steps<kSignal, Field>(steps);
    if (to_steps<kSignal>(value) != steps) ++wrong;
    if constexpr (std::is_same_v<Field, float>) {
      if (std::isnan(value) != (steps == kSignal.gap()) || std::isinf(value)) ++wrong;
    }
  }
  return wrong;
}

template <class M>
std::optional<std::uint64_t> again(std::span<const std::uint8_t> payload) {
  const auto message = decode<M>(payload);
  if (!message) return std::nullopt;
  return word(encode(*message));
}

template <class M>
std::uint64_t with(const FieldRow& field, const void* value) {
  M message;
  std::memcpy(reinterpret_cast<std::byte*>(&message) + field.at, value, field.size);
  return word(encode(message));
}

template <class M>
MessageRow message_row() {
  MessageRow row{.offset = M::kOffset, .page = -1, .mux = {}, .fields = {}, .again = again<M>, .with = with<M>};
  if constexpr (Paged<M>) row.page = M::kPage, row.mux = M::kMux;
  M message;
  M::each(message, [&]<Signal kSignal>(At<kSignal>, auto& field) {
    using Field = std::remove_cvref_t<decltype(field)>;
    const auto at = reinterpret_cast<const std::byte*>(&field) - reinterpret_cast<const std::byte*>(&message);
    FieldRow one{kSignal, FieldRow::Kind::kOther,     static_cast<std::size_t>(at), sizeof(Field), 0,
                 0,       wrong_steps<kSignal, Field>};
    if constexpr (std::is_same_v<Field, float>) {
      one.kind = FieldRow::Kind::kFloat;
    } else if constexpr (std::is_integral_v<Field> && !std::is_same_v<Field, bool>) {
      one.kind = FieldRow::Kind::kInteger;
      one.least = std::numeric_limits<Field>::min();
      one.most = static_cast<std::int64_t>(std::numeric_limits<Field>::max());
    }
    row.fields.push_back(one);
  });
  return row;
}

template <class... Ms>
struct Rows {
  static std::vector<MessageRow> all() { return {message_row<Ms>()...}; }
};

class EveryMessage : public testing::TestWithParam<MessageRow> {};
INSTANTIATE_TEST_SUITE_P(OfTheDbc, EveryMessage, testing::ValuesIn(AllMessages<Rows>::all()), [](const auto& row) {
  std::ostringstream name;
  name << "at" << std::hex << std::uppercase << std::setw(2) << std::setfill('0') << row.param.offset;
  if (row.param.page >= 0) name << "page" << std::dec << row.param.page;
  return name.str();
});

TEST_P(EveryMessage, SurvivesDecodeThenEncodeForRandomBits) {
  const MessageRow& row = GetParam();
  std::mt19937_64 random(row.offset);
  const std::uint64_t used = row.used();
  for (int i = 0; i < 20'000; ++i) {
    std::uint64_t bits = random();
    if (i % 4 == 1) bits |= random() | random();  // all ones, the unsigned codes for not available, are tried too
    if (i % 4 == 2) bits &= random() & random();
    if (i == 0) bits = ~std::uint64_t{0};
    const std::uint64_t sent = row.on_page(bits);
    const auto again = row.again_of(sent);
    ASSERT_TRUE(again.has_value());
    ASSERT_EQ(*again, sent & used) << std::hex << sent;
  }
}

TEST_P(EveryMessage, SurvivesAtEveryStepOfEverySignal) {
  for (const FieldRow& field : GetParam().fields) {
    const Signal& signal = field.signal;
    if (signal.length > 24) continue;
    const std::int64_t last = signal.gap() > 0 ? static_cast<std::int64_t>(signal.mask()) : signal.highest();
    EXPECT_EQ(field.wrong_steps(signal.is_signed ? signal.gap() : 0, last), 0) << "signal at bit " << int{signal.start};
  }
}

TEST_P(EveryMessage, SaturatesAndNeverWraps) {
  const MessageRow& row = GetParam();
  using Limits = std::numeric_limits<float>;
  for (const FieldRow& field : row.fields) {
    const Signal& signal = field.signal;
    SCOPED_TRACE("signal at bit " + std::to_string(signal.start));
    const auto sent = [&](auto value) { return signal.get(row.with(field, &value)); };
    if (field.kind == FieldRow::Kind::kFloat) {
      const float per_unit = static_cast<float>(signal.per_unit);
      const float top = static_cast<float>(signal.highest()) / per_unit;
      const float bottom = static_cast<float>(signal.lowest()) / per_unit;
      for (const float value :
           {top, std::nextafter(top, Limits::max()), top + 0.6F / per_unit, top + 1 / per_unit, top + 1, 2 * top + 2,
            65536 * (top + 1), 4.3e9F, 9.3e18F, Limits::max(), Limits::infinity()}) {
        EXPECT_EQ(sent(value), signal.highest()) << value;
      }
      for (const float value : {bottom, std::nextafter(bottom, Limits::lowest()), bottom - 0.6F / per_unit,
                                bottom - 1 / per_unit, bottom - 1, 2 * bottom - 2, 65536 * (bottom - 1), -4.3e9F,
                                -9.3e18F, Limits::lowest(), -Limits::infinity()}) {
        EXPECT_EQ(sent(value), signal.lowest()) << value;
      }
      EXPECT_EQ(sent(Limits::quiet_NaN()), signal.gap());
      EXPECT_EQ(sent(-Limits::signaling_NaN()), signal.gap());
      EXPECT_EQ(sent(-0.0F), 0);
      EXPECT_EQ(sent(Limits::denorm_min()), 0);
    } else if (field.kind == FieldRow::Kind::kInteger && !signal.wraps) {
      // A type that is no wider than its signal cannot hold a value out of range. The low bytes of a wide integer are
      // the narrow one.
      EXPECT_EQ(sent(field.most - (signal.has_gap && !signal.is_signed ? 1 : 0)), signal.highest());
      EXPECT_EQ(sent(field.least + (signal.has_gap && signal.is_signed ? 1 : 0)), signal.lowest());
      EXPECT_EQ(sent(signal.highest()), signal.highest());
      EXPECT_EQ(sent(signal.lowest()), signal.lowest());
      if (signal.has_gap) {
        EXPECT_EQ(sent(signal.is_signed ? field.least : field.most), signal.gap());
      }
    }
  }
}

TEST_P(EveryMessage, LeavesUnusedBitsZeroAndIgnoresThem) {
  const MessageRow& row = GetParam();
  const std::uint64_t used = row.used();
  std::mt19937_64 random(7);
  for (int i = 0; i < 1000; ++i) {
    const std::uint64_t bits = row.on_page(random());
    const auto clean = row.again_of(bits & used);
    const auto dirty = row.again_of(bits | ~used);
    ASSERT_TRUE(clean && dirty);
    ASSERT_EQ(*clean, *dirty);
    ASSERT_EQ(*dirty & ~used, 0U);
  }
}

TEST_P(EveryMessage, IsRefusedWithAnyOtherLength) {
  const std::array<std::uint8_t, 12> room{};
  for (std::size_t size = 0; size <= room.size(); ++size) {
    EXPECT_EQ(GetParam().again(std::span(room).first(size)).has_value(), size == 8 && GetParam().page <= 0) << size;
  }
}

TEST_P(EveryMessage, IsRefusedOnAnyOtherPage) {
  const MessageRow& row = GetParam();
  if (row.page < 0) return;
  for (std::int64_t page = 0; page <= static_cast<std::int64_t>(row.mux.mask()); ++page)
    EXPECT_EQ(row.again_of(row.mux.put(page)).has_value(), page == row.page);
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
  EXPECT_LT(*all.rbegin(), kBlock + kMapBlock);
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
// 1 m = 200, none = 0, the farthest = 8190 = 0x1FFE, 5 mm = 1; -3 rad = -6000, -0.0175 rad = -1750, modulo 2^14.
static_assert(encode(InScan{.seq = 5, .block = 2, .range0_m = 1, .range1_m = 0, .range2_m = 99, .range3_m = 0.005F}) ==
              Payload{0x25, 0x80, 0x0C, 0x00, 0x80, 0xFF, 0x0F, 0x00});
static_assert(encode(InScanHead{
                  .stamp_us = 0x12345, .seq = 3, .inst = 1, .count = 360, .first_rad = -3, .step_rad = -0.0175F}) ==
              Payload{0x45, 0x23, 0x31, 0xA1, 0x05, 0x89, 0xAA, 0xE4});
static_assert(encode(InMapEntry{.id = 7, .x_raw = 1, .y_raw = -1}) == Payload{7, 1, 0, 0, 0xF0, 0xFF, 0xFF, 0xFF});

}  // namespace
}  // namespace tetap::bus
