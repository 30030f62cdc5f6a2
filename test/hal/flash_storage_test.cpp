// SPDX-License-Identifier: Apache-2.0
// The drivers of both chips' flash against controllers that behave as the manuals have it, and the journal on them.
#include "hal/chip/stm32/flash_storage_f4.hpp"
#include "hal/chip/stm32/flash_storage_g4.hpp"
#include "hal/storage.hpp"

#include "fake_flash.hpp"

#include <gtest/gtest.h>

#include <array>
#include <string>
#include <vector>

namespace tetap::hal::stm32 {
namespace {

using test::FakeFlash;
using F4 = FlashStorageF4<test::FlashRegisters, test::FlashWords>;
using G4 = FlashStorageG4<test::FlashRegisters, test::FlashWords, test::FlashTrap>;
static_assert(Storage<F4> && Storage<G4>);
using Granule = std::array<std::uint8_t, 8>;
using Steps = std::vector<std::string>;
constexpr Granule kRecord{1, 2, 3, 4, 5, 6, 7, 8}, kBlankGranule{255, 255, 255, 255, 255, 255, 255, 255};
constexpr int kFewReads = 100;

template <class Driver>
struct FlashBench {
  explicit FlashBench(bool dual = true) : flash(std::is_same_v<Driver, G4>, dual) {}
  FakeFlash flash;
  Driver driver{test::FlashRegisters{&flash}, test::FlashWords{&flash}, kFewReads};
  Granule read(std::size_t page, std::size_t granule) {
    Granule in{};
    EXPECT_TRUE(driver.read(page, granule, in));
    return in;
  }
  ~FlashBench() {
    EXPECT_EQ(flash.wrong, Steps{});
    EXPECT_NE(flash.control & 1U << 31, 0U) << "it is left open";
    EXPECT_EQ(flash.control & 7U, 0U) << "an operation is left chosen";
    EXPECT_EQ(flash.access, 1U << 10 | 1U << 9 | 3U);
  }
};
template <class Driver>
struct FlashStorageTest : testing::Test {};
using Drivers = testing::Types<F4, G4>;
TYPED_TEST_SUITE(FlashStorageTest, Drivers);

TYPED_TEST(FlashStorageTest, ReadsWhatItProgramsAndErases) {
  FlashBench<TypeParam> bench;
  constexpr std::size_t kLast = TypeParam::kPageBytes / 8 - 1;
  for (const std::size_t page : {0U, 1U})
    for (const std::size_t granule : {std::size_t{0}, kLast}) {
      EXPECT_EQ(bench.read(page, granule), kBlankGranule);
      EXPECT_TRUE(bench.driver.program(page, granule, kRecord));
      EXPECT_EQ(bench.read(page, granule), kRecord);
    }
  EXPECT_TRUE(bench.driver.erase(0));
  for (const std::size_t granule : {std::size_t{0}, kLast}) {
    EXPECT_EQ(bench.read(0, granule), kBlankGranule) << "old bytes from the cache, or half a page";
    EXPECT_EQ(bench.read(1, granule), kRecord) << "the other page";
  }
  EXPECT_TRUE(bench.driver.program(0, 0, kRecord));
}

TYPED_TEST(FlashStorageTest, TouchesNoGranuleThatIsNotBlank) {
  FlashBench<TypeParam> bench;
  EXPECT_TRUE(bench.driver.program(1, 5, kRecord));
  const auto before = bench.flash.done;
  EXPECT_FALSE(bench.driver.program(1, 5, kBlankGranule));
  EXPECT_FALSE(bench.driver.program(1, 5, {}));
  EXPECT_EQ(bench.flash.done, before);
  EXPECT_EQ(bench.read(1, 5), kRecord);
}

TYPED_TEST(FlashStorageTest, TellsEveryErrorAndWorksAfterIt) {
  const bool g4 = std::is_same_v<TypeParam, G4>;
  const std::vector<int> bits =
      g4 ? std::vector<int>{1, 3, 4, 5, 6, 7, 8, 9, 14, 15} : std::vector<int>{1, 4, 5, 6, 7, 8};
  for (const int bit : bits) {
    FlashBench<TypeParam> bench;
    bench.flash.errors_of_next = 1U << bit;
    EXPECT_FALSE(bench.driver.program(0, 1, kRecord)) << bit;
    bench.flash.errors_of_next = 1U << bit;
    EXPECT_FALSE(bench.driver.erase(0)) << bit;
    bench.flash.status |= 1U << bit;  // of somebody before
    EXPECT_TRUE(bench.driver.erase(0)) << bit;
    EXPECT_TRUE(bench.driver.program(0, 1, kRecord)) << bit;
  }
}

TYPED_TEST(FlashStorageTest, EndsWhereTheControllerIsShutForGoodOrHangs) {
  FlashBench<TypeParam> shut;
  shut.flash.shut_for_good = true;
  EXPECT_FALSE(shut.driver.program(0, 1, kRecord));
  EXPECT_FALSE(shut.driver.erase(0));
  FlashBench<TypeParam> hangs;
  hangs.flash.hangs = true;
  EXPECT_FALSE(hangs.driver.program(0, 1, kRecord));
  EXPECT_FALSE(hangs.driver.erase(0));
  EXPECT_EQ(hangs.flash.done, Steps{});
}

TEST(FlashStorageF4, ErasesTheLastTwoSectorsAndProgramsByWords) {
  FlashBench<F4> bench;
  EXPECT_TRUE(bench.driver.erase(0) && bench.driver.erase(1) && bench.driver.program(1, 0, kRecord));
  EXPECT_EQ(bench.flash.done, (Steps{"erase 10", "erase 11", "program", "program"}));
  EXPECT_EQ(bench.flash.words[0x8000], 0x04030201U);  // 0x080E0000
  EXPECT_EQ(bench.flash.words[0x8001], 0x08070605U);
}

TEST(FlashStorageG4, ErasesTheSamePlaceInOneBankAndInTwo) {
  FlashBench<G4> two, one(false);
  EXPECT_TRUE(two.driver.erase(0) && two.driver.erase(1) && one.driver.erase(0) && one.driver.erase(1));
  EXPECT_EQ(two.flash.done, (Steps{"erase 1:124", "erase 1:125", "erase 1:126", "erase 1:127"}));
  EXPECT_EQ(one.flash.done, (Steps{"erase 0:126", "erase 0:127"}));
}

TEST(FlashStorageG4, ADoubleWordThatTheCheckCodeRefusesIsNoContentAndNoEnd) {
  for (const bool dual : {true, false})
    for (const std::uint32_t damaged : {6U, 7U}) {
      FlashBench<G4> bench(dual);
      for (const std::size_t granule : {6U, 7U}) EXPECT_TRUE(bench.driver.program(0, granule, kRecord));
      bench.flash.damaged = {damaged};
      Granule in{};
      EXPECT_FALSE(bench.driver.read(0, damaged, in));
      EXPECT_FALSE(bench.driver.program(0, damaged, kRecord));
      EXPECT_EQ(bench.read(0, 13 - damaged), kRecord) << "its neighbour";
      EXPECT_TRUE(bench.driver.erase(0));
      EXPECT_EQ(bench.read(0, damaged), kBlankGranule);
    }
}

}  // namespace
}  // namespace tetap::hal::stm32
