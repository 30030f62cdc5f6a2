// SPDX-License-Identifier: Apache-2.0
#include "hal/chip/zynqmp/can_encoding.hpp"

#include <gtest/gtest.h>
#include <linux/can.h>

#include <cstring>
#include <random>

namespace tetap::hal::zynqmp_r5 {
namespace {

constexpr Machine kMachines[] = {Machine::kSilicon, Machine::kEmulated};

base::CanFrame random_frame(std::mt19937& random) {
  base::CanFrame frame;
  frame.extended = (random() & 1U) != 0;
  frame.id = static_cast<std::uint32_t>(random()) & (frame.extended ? 0x1FFF'FFFFU : 0x7FFU);
  frame.size = static_cast<std::uint8_t>(random() % 9);
  for (std::size_t i = 0; i < frame.size; ++i) frame.data[i] = static_cast<std::uint8_t>(random());
  return frame;
}

TEST(CanEncoding, EveryStandardIdentifierComesBack) {
  for (const Machine machine : kMachines) {
    for (std::uint32_t id = 0; id <= 0x7FF; ++id) {
      const base::CanFrame frame{.id = id, .size = 1, .data = {0x5A}};
      EXPECT_EQ(to_frame(machine, to_words(machine, frame)), frame);
    }
  }
}

TEST(CanEncoding, RandomFramesOfEveryKindAndSizeComeBack) {
  std::mt19937 random{1};
  for (const Machine machine : kMachines) {
    for (int i = 0; i < 100'000; ++i) {
      const base::CanFrame frame = random_frame(random);
      EXPECT_EQ(to_frame(machine, to_words(machine, frame)), frame);
    }
  }
}

TEST(CanEncoding, SiliconPutsTheFieldsWhereTheDataSheetHasThem) {
  // UG1085 table 20-3: IDH 31:21, SRRRTR 20, IDE 19, IDL 18:1, RTR 0; DLC 31:28; DB0 31:24 .. DB3 7:0, DB4 31:24 .. DB7
  // 7:0.
  const base::CanFrame standard{.id = 0x123, .size = 5, .data = {0x11, 0x22, 0x33, 0x44, 0x55}};
  EXPECT_EQ(to_words(Machine::kSilicon, standard),
            (CanWords{.id = 0x2460'0000, .dlc = 0x5000'0000, .data1 = 0x1122'3344, .data2 = 0x5500'0000}));
  const base::CanFrame all_ones{.id = 0x1FFF'FFFF, .extended = true, .size = 8, .data = {1, 2, 3, 4, 5, 6, 7, 8}};
  EXPECT_EQ(to_words(Machine::kSilicon, all_ones),
            (CanWords{.id = 0xFFFF'FFFE, .dlc = 0x8000'0000, .data1 = 0x0102'0304, .data2 = 0x0506'0708}));
  // The eleven bits sent first are the upper ones of the 29: 0x48D, then SRR and IDE, then the lower eighteen: 0x05678.
  const base::CanFrame extended{.id = 0x1234'5678, .extended = true};
  EXPECT_EQ(to_words(Machine::kSilicon, extended).id, 0x48DU << 21 | 1U << 20 | 1U << 19 | 0x5678U << 1);
  static_assert(silicon::id_word({.id = 0x7FF, .remote = true}) == 0xFFF0'0000);
  static_assert(silicon::id_word({.id = 0, .extended = true, .remote = true}) == 0x0018'0001);
}

TEST(CanEncoding, TheEmulatorsWordsAreLinuxsFrameInMemory) {
  std::mt19937 random{2};
  for (int i = 0; i < 10'000; ++i) {
    const base::CanFrame frame = random_frame(random);
    const CanWords words = to_words(Machine::kEmulated, frame);
    can_frame linux_frame{};
    linux_frame.can_id = frame.id | (frame.extended ? CAN_EFF_FLAG : 0U);
    std::memcpy(linux_frame.data, frame.data.data(), frame.size);
    std::uint32_t data[2];
    std::memcpy(data, linux_frame.data, sizeof data);
    EXPECT_EQ(
        words,
        (CanWords{
            .id = linux_frame.can_id, .dlc = std::uint32_t{frame.size} << 28, .data1 = data[0], .data2 = data[1]}));
  }
}

TEST(CanEncoding, WhatIsNotADataFrameIsNotDelivered) {
  EXPECT_FALSE(to_frame(Machine::kSilicon, {.id = silicon::id_word({.id = 0x123, .remote = true})}));
  EXPECT_FALSE(to_frame(Machine::kSilicon, {.id = silicon::id_word({.id = 0x123, .extended = true, .remote = true})}));
  EXPECT_FALSE(to_frame(Machine::kEmulated, {.id = 0x123 | CAN_RTR_FLAG}));
  EXPECT_FALSE(to_frame(Machine::kEmulated, {.id = 0x123 | CAN_EFF_FLAG | CAN_RTR_FLAG}));
  EXPECT_FALSE(to_frame(Machine::kEmulated, {.id = 0x40U | CAN_ERR_FLAG}));
}

TEST(CanEncoding, ReceptionTimeIsIgnoredAndLengthCodesAboveEightMeanEight) {
  for (const Machine machine : kMachines) {
    const base::CanFrame frame{.id = 0x40, .size = 8, .data = {8, 7, 6, 5, 4, 3, 2, 1}};
    CanWords words = to_words(machine, frame);
    words.dlc |= 0xFFFF;
    EXPECT_EQ(to_frame(machine, words), frame);
    for (std::uint32_t dlc = 9; dlc < 16; ++dlc) {
      words.dlc = dlc << 28;
      EXPECT_EQ(to_frame(machine, words), frame);
    }
  }
}

TEST(CanEncoding, BytesBeyondTheSizeAreNeitherSentNorDelivered) {
  for (const Machine machine : kMachines) {
    const base::CanFrame frame{.id = 1, .size = 2, .data = {1, 2, 0xFF, 0xFF, 0xFF}};
    CanWords words = to_words(machine, frame);
    EXPECT_EQ(words.data2, 0U);
    EXPECT_EQ(words.data1, (to_words(machine, {.id = 1, .size = 2, .data = {1, 2}}).data1));
    words.data1 = words.data2 = ~0U;
    EXPECT_EQ(to_frame(machine, words), (base::CanFrame{.id = 1, .size = 2, .data = {0xFF, 0xFF}}));
  }
}

TEST(CanEncoding, AFilterPassesExactlyTheDataFramesItNames) {
  std::mt19937 random{3};
  for (const Machine machine : kMachines) {
    for (int i = 0; i < 100'000; ++i) {
      const bool extended = (random() & 1U) != 0;
      const std::uint32_t all = extended ? 0x1FFF'FFFFU : 0x7FFU;
      // Sparse masks, so that about half of the frames pass.
      const AcceptanceFilter filter{
          .id = static_cast<std::uint32_t>(random()) & all, .mask = 1U << random() % 11, .extended = extended};
      const CanIdentifier from{.id = static_cast<std::uint32_t>(random()) & all,
                               .extended = random() % 4 != 0 ? extended : !extended,
                               .remote = random() % 4 == 0};
      const std::uint32_t id = from.id & (from.extended ? 0x1FFF'FFFFU : 0x7FFU);
      const bool wanted = from.extended == extended && !from.remote && ((id ^ filter.id) & filter.mask) == 0;
      const AcceptanceWords words = to_words(machine, filter);
      EXPECT_EQ(((id_word(machine, from) ^ words.id) & words.mask) == 0, wanted);
    }
  }
}

}  // namespace
}  // namespace tetap::hal::zynqmp_r5
