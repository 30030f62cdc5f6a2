// SPDX-License-Identifier: Apache-2.0
// Staged parameters against the table that --set uses: the same values are accepted, and the same bits are active.
#include "tetap/param/staged.hpp"

#include "sim_host/parameter_word.hpp"
#include "tetap/base/siphash.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string_view>
#include <vector>

namespace tetap::param {
namespace {

constexpr Parameters kCompiled = checked({.wheels = {.drive = {0.1F, 0.1F, 0.5F, 1, 1e-3F, 1e-3F}}});

bool equal(const Parameters& a, const Parameters& b) {
  for (const Row& row : kTable)
    for (std::size_t word = 0; word < row.size / 4; ++word)
      if (sim::word_of(a, row, word) != sim::word_of(b, row, word)) return false;
  return true;
}
/// Result of --set for one element: another value within the limits that breaks no rule; else the parameters as given.
Parameters with_other(const Parameters& p, const Row& row, std::size_t element) {
  for (const double share : {0.5, 0.51, 0.49, 0.0, 1.0, 1e-3, 1e-6}) {
    Parameters q = p;
    row.set(q, element, row.minimum + share * (row.maximum - row.minimum));
    if (within(row, row.get(q, element)) && broken_rule(q) == nullptr && !equal(p, q)) return q;
  }
  return p;
}
void stage(StagedParameters& staged, const Parameters& wanted, const Row& row) {
  for (std::size_t word = 0; word < row.size / 4; ++word)
    EXPECT_EQ(staged.set(row.index, word, sim::word_of(wanted, row, word)), Answer::kDone) << row.path;
}
Answer apply_as(StagedParameters& staged, std::uint32_t before, std::uint32_t after) {
  const Answer is = staged.judge(before, after);
  if (is == Answer::kDone) staged.take_over();
  return is;
}
Answer apply(StagedParameters& staged) { return apply_as(staged, staged.active_crc(), staged.staged_crc()); }
bool is_access(const Row& row) {
  const std::string_view path(row.path);
  return path == "can_base" || path == "loop.lockstep" || path == "loop.period_us" || path.starts_with("bus.") ||
         path.starts_with("wired.");
}

TEST(StagedParameters, ActAtOnceWhereARowIsLiveAndElseAtARestart) {
  std::size_t live = 0, restart = 0, live_rows = 0;
  for (const Row& row : kTable) {
    live_rows += row.effect == Effect::kLive ? 1U : 0U;
    if (is_access(row)) continue;
    const Parameters wanted = with_other(kCompiled, row, 0);
    if (equal(wanted, kCompiled)) continue;
    StagedParameters staged(kCompiled);
    stage(staged, wanted, row);
    EXPECT_TRUE(equal(staged.active(), kCompiled)) << row.path;
    ASSERT_EQ(apply(staged), Answer::kDone) << row.path;
    const bool is_live = row.effect == Effect::kLive;
    EXPECT_TRUE(equal(staged.active(), is_live ? wanted : kCompiled)) << row.path;
    EXPECT_EQ(staged.pending(), is_live ? 0U : 1U) << row.path;
    staged.restart();
    EXPECT_TRUE(equal(staged.active(), wanted)) << row.path;
    EXPECT_EQ(staged.pending(), 0U);
    ++(is_live ? live : restart);
  }
  EXPECT_EQ(live, live_rows);
  EXPECT_GE(restart, 75U);  // some need a second row to change
}

TEST(StagedParameters, AcceptTheValuesThatTheTableAccepts) {
  for (const Row& row : kTable) {
    if (is_access(row) || row.size / row.elements != 4) continue;
    const auto judge = [&](std::uint32_t word, double value) {
      StagedParameters staged(kCompiled);
      EXPECT_EQ(staged.set(row.index, 0, word) == Answer::kDone, within(row, value)) << row.path << ' ' << value;
    };
    for (const double limit : {row.minimum, row.maximum}) {
      if (row.storage == Storage::kFloat) {
        for (float x = std::nextafter(std::nextafter(static_cast<float>(limit), -1e30F), -1e30F), n = 0; n < 5; ++n) {
          judge(std::bit_cast<std::uint32_t>(x), static_cast<double>(x));
          x = std::nextafter(x, 1e30F);
        }
      } else {
        for (std::int64_t x = static_cast<std::int64_t>(limit) - 1; x <= static_cast<std::int64_t>(limit) + 1; ++x)
          judge(static_cast<std::uint32_t>(x), static_cast<double>(static_cast<std::int32_t>(x)));
      }
    }
    if (row.storage == Storage::kFloat)
      for (const float x : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()})
        judge(std::bit_cast<std::uint32_t>(x), static_cast<double>(x));
  }
}

TEST(StagedParameters, AreAppliedAsAWholeOrNotAtAll) {
  StagedParameters staged(kCompiled);
  const Row& every = *row_of("publish.state_every");
  const Row& gate = *row_of("gnss.gate_scale");
  EXPECT_EQ(staged.set(gate.index, 0, std::bit_cast<std::uint32_t>(2.0F)), Answer::kDone);
  const std::uint32_t one = staged.staged_crc();
  EXPECT_EQ(staged.set(row_of("publish.std_every")->index, 0, 7), Answer::kDone);
  EXPECT_EQ(staged.set(every.index, 0, 10), Answer::kDone);
  EXPECT_EQ(apply(staged), Answer::kNotTogether);
  EXPECT_EQ(apply_as(staged, staged.active_crc(), one), Answer::kOtherStaged);
  EXPECT_EQ(apply_as(staged, one, staged.staged_crc()), Answer::kOtherActive);
  EXPECT_TRUE(equal(staged.active(), kCompiled));
}

TEST(StagedParameters, DoNotTakeAccessOrIdentityFromTheBus) {
  for (const Row& row : kTable) {
    StagedParameters staged(kCompiled);
    if (is_access(row)) {
      EXPECT_EQ(staged.set(row.index, 0, 0), Answer::kRefused) << row.path;
    }
    EXPECT_EQ(staged.set(row.index, row.size / 4, 0), Answer::kUnknown) << row.path;
  }
  StagedParameters staged(kCompiled);
  EXPECT_EQ(staged.set(0xFFF, 0, 0), Answer::kUnknown);
}

TEST(StagedParameters, KeepWhatIsActiveAndWhatWaits) {
  StagedParameters staged(kCompiled);
  Parameters wanted = kCompiled;
  wanted.wheels.drive.left_radius_m = 0.11F;
  wanted.gnss.gate_scale = 2;
  for (const char* const path : {"wheels.drive.left_radius_m", "gnss.gate_scale"}) stage(staged, wanted, *row_of(path));
  ASSERT_EQ(apply(staged), Answer::kDone);
  EXPECT_EQ(staged.set(row_of("baro.sigma_m")->index, 0, std::bit_cast<std::uint32_t>(3.0F)), Answer::kDone);
  Parameters kept = kCompiled;
  std::size_t words = 0;
  staged.each_kept([&](std::uint16_t index, std::size_t word, std::uint32_t value) {
    for (const Row& row : kTable)
      if (row.index == index) sim::put_word(kept, row, word, value);
    ++words;
  });
  EXPECT_EQ(words, 2U);
  EXPECT_TRUE(equal(kept, wanted));
  ASSERT_EQ(staged.restore(staged.active_crc()), Answer::kDone);
  staged.take_over();
  EXPECT_TRUE(equal(staged.active(), kCompiled));
}

TEST(StagedParameters, KeepAClaimedKeyAndNoOtherAccess) {
  Parameters open = kCompiled;
  open.loop.lockstep = Lockstep::kGuarded;
  StagedParameters owned(open);
  constexpr base::SipKey kKey{1, 0, 3, 4};
  for (std::size_t word = 0; word < kKey.size(); ++word) ASSERT_EQ(owned.claim(word, kKey[word]), Answer::kDone);
  owned.take_over();
  const auto loaded = [&](const Parameters& compiled, std::size_t& refused) {
    StagedParameters next(compiled);
    EXPECT_TRUE(next.load([&](auto&& take) { owned.each_kept(take); }, [&](auto...) { ++refused; }));
    return next.active();
  };
  std::size_t refused = 0;
  EXPECT_TRUE(equal(loaded(open, refused), owned.active()));
  EXPECT_EQ(refused, 0U);
  // A key that is compiled stays, whatever was kept.
  Parameters locked = open;
  locked.bus = {.commands = CommandAccess::kAuthenticated, .key = {9, 9, 9, 9}};
  locked.loop.lockstep = Lockstep::kAuthenticated;
  EXPECT_TRUE(equal(loaded(locked, refused), locked));
  EXPECT_GE(refused, 3U);
  // A rule that other rows break takes no key away.
  StagedParameters broken(open);
  std::size_t named_words = 0;
  const auto with_broken_rule = [&](auto&& take) {
    owned.each_kept(take);
    take(row_of("wheels.drive.track_m")->index, std::size_t{0}, 0U);
  };
  EXPECT_FALSE(broken.load(with_broken_rule, [&](auto...) { ++named_words; }));
  EXPECT_TRUE(equal(broken.active(), owned.active()));
  EXPECT_EQ(broken.staged_crc(), broken.active_crc());
  EXPECT_EQ(named_words, 0U);
  // Neither identity nor an open door comes out of a flash.
  open.loop.lockstep = Lockstep::kPlain;
  for (const Row& row : kTable) {
    if (!is_access(row) || row.path == std::string_view("bus.key")) continue;
    StagedParameters next(open);
    std::size_t named = 0;
    static_cast<void>(next.load([&](auto&& take) { take(row.index, std::size_t{0}, 0U); }, [&](auto...) { ++named; }));
    EXPECT_EQ(named, 1U) << row.path;
  }
}

}  // namespace
}  // namespace tetap::param
