// SPDX-License-Identifier: Apache-2.0
// One list of members: what is hashed and when, what a copy takes over, what power-on clears.
#include "tetap/base/members.hpp"
#include "tetap/base/state_words.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <map>
#include <optional>
#include <vector>

#include <gtest/gtest.h>

namespace tetap::base {
namespace {

struct Words {
  std::vector<std::uint32_t> all;
  void operator()(std::uint32_t word) { all.push_back(word); }
};
template <class T>
std::vector<std::uint32_t> words_of(const T& object) {
  Words words;
  each_word(object, words);
  return words.all;
}
template <class T>
std::vector<std::uint32_t> words_of(const T& object, unsigned turn) {
  Words words;
  each_word_in_turn(object, turn, words);
  return words.all;
}

struct Plain {
  std::uint8_t a = 1;
  bool b = true;
  std::uint16_t c = 3;
  std::uint8_t d = 4;
  std::int64_t e = 0x0000'0006'0000'0005;
  float f = 1.0F;
};

TEST(Members, AnAggregateHasItsFieldsAndSmallOnesShareAWord) {
  EXPECT_EQ(words_of(Plain{}), (std::vector<std::uint32_t>{0x0003'0101, 5, 6, 0x3F80'0000, 4}));
}

class Listed {
 public:
  explicit Listed(const int& given) : given_(given) {}
  static constexpr auto members(auto& self) {
    return base::members(reference(self.given_), self.every_, in_turns(self.first_), in_turns(self.second_),
                         in_turns(self.many_), ring(self.ring_, self.begin_, self.size_), count(self.begin_),
                         count(self.size_), kept(self.kept_), own(self.own_), unhashed(self.unhashed_));
  }
  void set(std::uint32_t to) {
    every_ = first_ = second_ = kept_ = own_ = unhashed_ = to;
    many_.fill(to);
    ring_.fill(to);
    begin_ = 18, size_ = 4;
  }
  [[nodiscard]] std::array<std::uint32_t, 4> shown() const { return {every_, kept_, own_, unhashed_}; }

 private:
  const int& given_;
  std::uint32_t every_ = 1, first_ = 2, second_ = 3;
  std::array<std::uint32_t, 20> many_{};
  std::array<std::uint32_t, 20> ring_{};
  std::size_t begin_ = 0, size_ = 0;
  std::uint32_t kept_ = 4, own_ = 5, unhashed_ = 6;
};
constexpr int kGiven = 0;

TEST(Members, EachTurnHasItsShareAndTenTurnsHaveAll) {
  Listed object(kGiven);
  object.set(0xABCD);
  std::map<std::uint32_t, std::size_t> seen;
  std::size_t most = 0;
  for (unsigned turn = 0; turn < kTurns; ++turn) {
    const auto words = words_of(object, turn);
    for (const std::uint32_t word : words) ++seen[word];
    most = std::max(most, words.size());
  }
  // In every turn: every_, kept_, begin_, size_. Once in ten: first_, second_, 20 of many_, 4 places of the ring.
  EXPECT_EQ(seen[0xABCD], 2 * kTurns + 2 + 20 + 4);
  EXPECT_EQ(seen[18], kTurns);
  EXPECT_LE(most, 4U + 2 + 1 + 2);
  EXPECT_EQ(words_of(object).size(), 4U + 2 + 20 + 4);
}

TEST(Members, PowerOnAndCopiesLeaveWhatIsTheObjectsOwn) {
  Listed object(kGiven), other(kGiven);
  other.set(9);
  resume(object, other);
  EXPECT_EQ(object.shown(), (std::array<std::uint32_t, 4>{9, 9, 5, 9}));
  object.set(7);
  clear(object);
  EXPECT_EQ(object.shown(), (std::array<std::uint32_t, 4>{0, 7, 7, 0})) << "a number has no initial value of its own";
}

struct Forgotten {
  static constexpr auto members(auto& self) { return base::members(self.a, self.c); }
  std::uint32_t a = 0, b = 0, c = 0;
};
static_assert(!detail::covers<Forgotten>() && detail::covers<Listed>());

struct Runs {
  std::vector<std::uint32_t> all;
  std::size_t in_runs = 0;
  void operator()(std::uint32_t word) { all.push_back(word); }
  void run(const void* from, std::size_t count) {
    in_runs += count;
    for (std::size_t i = 0; i < count; ++i) {
      std::uint32_t word = 0;
      std::memcpy(&word, static_cast<const char*>(from) + 4 * i, sizeof word);
      all.push_back(word);
    }
  }
};
class Mixed {
 public:
  static constexpr auto members(auto& self) {
    return base::members(self.matrix_, self.time_us_, self.scale_, self.on_, self.count_, self.far_us_, self.low_,
                         in_turns(self.many_), self.high_, self.pair_, self.last_);
  }

 private:
  std::array<float, 5> matrix_{1.0F, 2.0F, 3.0F};
  std::int64_t time_us_ = 0x0000'0006'0000'0005;  // padding before it
  std::array<float, 2> scale_{7.0F};
  bool on_ = true;
  std::uint32_t count_ = 8;
  std::int64_t far_us_ = -9;
  std::array<std::int32_t, 2> low_{-10};
  std::array<std::uint32_t, 20> many_{11, 12, 13};
  float high_ = 14.0F;
  std::array<std::int32_t, 2> pair_{15, 16};
  std::int32_t last_ = 17;
};

TEST(Members, RunsOfPlainMembersHaveTheirWordsOneByOne) {
  const Mixed object;
  Runs runs;
  each_word(object, runs);
  EXPECT_EQ(runs.all, words_of(object));
  EXPECT_EQ(runs.in_runs, 5U + 4 + 4 + 20 + 4)
      << "matrix_, time_us_ and scale_, far_us_ and low_, many_, high_ to last_";
  for (unsigned turn = 0; turn < kTurns; ++turn) {
    Runs in_turn;
    each_word_in_turn(object, turn, in_turn);
    EXPECT_EQ(in_turn.all, words_of(object, turn)) << turn;
    EXPECT_EQ(in_turn.in_runs, 0U) << "a loop costs an epoch time";
  }
}
static_assert(detail::plain_bytes<std::array<std::int64_t, 2>>() == 16 && detail::plain_bytes<bool>() == 0 &&
              detail::plain_bytes<Plain>() == 0 && detail::plain_bytes<std::optional<float>>() == 0);

TEST(Members, AnOptionalHasItsValueOnlyWhereThereIsOne) {
  EXPECT_EQ(words_of(std::optional<std::uint32_t>{}), (std::vector<std::uint32_t>{0}));
  EXPECT_EQ(words_of(std::optional<std::uint32_t>{7}), (std::vector<std::uint32_t>{1, 7}));
}

}  // namespace
}  // namespace tetap::base
