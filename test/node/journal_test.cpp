// SPDX-License-Identifier: Apache-2.0
// Power cuts at every program and every erase of every save, also of the start behind a cut: what is read is the set
// before or the set behind, at every later start the same one, and the next save succeeds. TETAP_CUTS is their number.
#include "tetap/firmware/journal.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <iostream>
#include <map>
#include <random>
#include <set>
#include <vector>

namespace tetap::firmware {
namespace {

using Values = std::map<std::uint16_t, std::uint32_t>;

struct ValueSet {
  Values values;
  void each(auto&& take) const {
    for (const auto& [key, value] : values) take(JournalEntry{key, value});
  }
  [[nodiscard]] std::optional<std::uint32_t> find(std::uint16_t key) const {
    const auto at = values.find(key);
    return at == values.end() ? std::nullopt : std::optional(at->second);
  }
};

/// Two pages of which the power is cut at a step. A granule that is cut half-way shows another face at each start: the
/// old one, the new one, a mixture, or none (its check code refuses it).
template <std::size_t kPage, std::size_t kGranule>
class Flash {
 public:
  static constexpr std::size_t kPageBytes = kPage;
  static constexpr std::size_t kGranuleBytes = kGranule;
  using Bytes = std::array<std::uint8_t, kGranule>;

  Flash() {
    for (auto& page : cells_) page.resize(kPage / kGranule);
  }
  /// Steps from now to the cut; negative: none.
  void cut_after(long steps) { left_ = steps; }
  void power_on(std::mt19937_64& random) {
    random_ = &random;
    dead_ = false;
    left_ = -1;
    for (auto& page : cells_)
      for (Cell& cell : page) cell.face = cell.torn ? face(cell) : cell.bytes;
  }
  [[nodiscard]] bool dead() const { return dead_; }
  [[nodiscard]] long steps() const { return steps_; }
  [[nodiscard]] long erases() const { return erases_; }

  bool read(std::size_t page, std::size_t granule, std::span<std::uint8_t> in) const {
    const Cell& cell = cells_.at(page).at(granule);
    if (dead_ || !cell.face) return false;
    std::ranges::copy(*cell.face, in.begin());
    return true;
  }
  bool program(std::size_t page, std::size_t granule, std::span<const std::uint8_t> out) {
    Cell& cell = cells_.at(page).at(granule);
    if (!step()) return false;
    if (cell.torn || cell.bytes != kBlank) return false;
    Bytes wanted;
    std::ranges::copy(out, wanted.begin());
    if (!dead_) return cell = {wanted, wanted, wanted, false}, true;
    strike(cell, wanted);
    return false;
  }
  bool erase(std::size_t page) {
    if (!step()) return false;
    ++erases_;
    for (Cell& cell : cells_.at(page)) dead_ ? strike(cell, kBlank) : void(cell = {});
    return !dead_;
  }

 protected:
  static constexpr Bytes kBlank = [] {
    Bytes bytes{};
    bytes.fill(0xFF);
    return bytes;
  }();

 private:
  struct Cell {
    Bytes bytes = kBlank;
    Bytes other = kBlank;  ///< content that a cut operation was about to give it
    std::optional<Bytes> face = kBlank;
    bool torn = false;
  };
  /// False once the power is gone; dead at the step that it cuts.
  bool step() {
    if (dead_) return false;
    ++steps_;
    dead_ = left_ == 0;
    if (left_ > 0) --left_;
    return true;
  }
  void strike(Cell& cell, const Bytes& wanted) {
    const auto kind = (*random_)() % 4;
    if (kind == 0) return;
    if (kind == 1) return void(cell = {wanted, wanted, wanted, false});
    cell.other = wanted;
    cell.torn = cell.bytes != wanted;
  }
  std::optional<Bytes> face(const Cell& cell) {
    const auto kind = (*random_)() % 5;
    if (kind == 0) return std::nullopt;
    if (kind < 3) return kind == 1 ? cell.bytes : cell.other;
    Bytes mixed{};
    for (std::size_t i = 0; i < kGranule; ++i) {
      const auto take = static_cast<std::uint8_t>((*random_)());
      mixed[i] = static_cast<std::uint8_t>((cell.bytes[i] & take) | (cell.other[i] & ~take));
    }
    return mixed;
  }

  std::array<std::vector<Cell>, 2> cells_;
  std::mt19937_64* random_ = nullptr;
  long left_ = -1, steps_ = 0, erases_ = 0;
  bool dead_ = false;
};

/// Flash that takes records with one key for programmed, and does not program them.
template <class Of, std::uint16_t kKey>
class Without : public Of {
 public:
  bool read(std::size_t page, std::size_t granule, std::span<std::uint8_t> in) const {
    if (echo_.empty() || granule != echoed_) return Of::read(page, granule, in);
    std::ranges::copy(echo_, in.begin());
    return echo_.clear(), true;
  }
  bool program(std::size_t page, std::size_t granule, std::span<const std::uint8_t> out) {
    if ((out[4] | out[5] << 8) != kKey) return Of::program(page, granule, out);
    echo_.assign(out.begin(), out.end());
    echoed_ = granule;
    return !Of::dead();
  }

 private:
  mutable std::vector<std::uint8_t> echo_;
  std::size_t echoed_ = 0;
};

template <class Memory>
Values stored(Memory& memory, std::mt19937_64& random) {
  memory.power_on(random);
  const Journal journal(memory);
  Values values;
  journal.load([&](const JournalEntry& entry) { values[entry.key] = entry.value; });
  return values;
}

Values changed(Values values, std::mt19937_64& random) {
  for (auto n = random() % 12; n-- > 0;)
    values[static_cast<std::uint16_t>((random() % 60) << 4 | random() % 3)] = static_cast<std::uint32_t>(random());
  if (random() % 4 == 0 && !values.empty()) values.erase(values.begin());
  if (random() % 64 == 0) values.clear();
  return values;
}

struct Tally {
  long before = 0, behind = 0, wrong = 0, refused = 0;
  [[nodiscard]] long cuts() const { return before + behind + wrong; }
};

/// A save of `wanted` is cut at step `at`, the start behind it perhaps too; the set is read twice, and saved again.
template <class Memory>
void cut_once(Memory memory, long at, const Values& now, const Values& wanted, std::mt19937_64& random, Tally& tally) {
  memory.power_on(random);
  memory.cut_after(at);
  {
    Journal journal(memory);
    static_cast<void>(journal.save(ValueSet{wanted}));
  }
  while (random() % 4 == 0) {
    memory.power_on(random);
    memory.cut_after(static_cast<long>(random() % 3));
    const Journal ended(memory);
  }
  const Values first = stored(memory, random);
  bool good = first == now || first == wanted;
  first == wanted ? ++tally.behind : ++tally.before;
  good = good && stored(memory, random) == first;
  const Values next = random() % 2 != 0 ? wanted : changed(first, random);
  memory.power_on(random);
  Journal journal(memory);
  const Saved saved = journal.save(ValueSet{next});
  if (saved == Saved::kFault || saved == Saved::kTooLarge) ++tally.refused;
  for (int start = 0; start < 3; ++start) good = good && stored(memory, random) == next;
  if (good) return;
  first == wanted ? --tally.behind : --tally.before;
  ++tally.wrong;
}

/// Stops at the first wrong set.
template <class Memory>
Tally cut(long cuts) {
  std::mt19937_64 random(1);
  Tally tally;
  Memory memory;
  for (Values now; tally.cuts() < cuts && tally.wrong == 0;) {
    const Values wanted = changed(now, random);
    Memory whole = memory;
    whole.power_on(random);
    const long begin = whole.steps();
    Journal journal(whole);
    static_cast<void>(journal.save(ValueSet{wanted}));
    const long steps = whole.steps() - begin;
    for (long at = 0; at < steps && tally.cuts() < cuts; ++at) cut_once(memory, at, now, wanted, random, tally);
    memory.power_on(random);
    if (random() % 2 != 0) memory.cut_after(static_cast<long>(random() % static_cast<std::uint64_t>(steps + 1)));
    Journal life(memory);
    static_cast<void>(life.save(ValueSet{wanted}));
    now = stored(memory, random);
  }
  return tally;
}

using G4 = Flash<2048, 8>;

long cuts() {
  const char* const asked = std::getenv("TETAP_CUTS");
  return asked != nullptr ? std::atol(asked) : 2'000;
}

template <class Memory>
class JournalCuts : public testing::Test {};
using Memories = testing::Types<G4, Flash<16'384, 8>, Flash<16'384, 32>>;
TYPED_TEST_SUITE(JournalCuts, Memories);

TYPED_TEST(JournalCuts, GiveTheSetBeforeOrTheSetBehind) {
  const long wanted = std::max(100L, cuts() * 2048 / static_cast<long>(TypeParam::kPageBytes));
  const Tally tally = cut<TypeParam>(wanted);
  std::cout << tally.before << " before, " << tally.behind << " behind, " << tally.wrong << " wrong\n";
  EXPECT_EQ(tally.wrong, 0);
  EXPECT_EQ(tally.cuts(), wanted);
  EXPECT_EQ(tally.refused, 0);
  EXPECT_GT(tally.before, 0);
  EXPECT_GT(tally.behind, 0);
}

TEST(Journal, NeedsEachOfItsMarks) {
  using Writer = Journal<G4>;
  EXPECT_GT((cut<Without<G4, Writer::kBegin>>(2'000).wrong), 0);
  EXPECT_GT((cut<Without<G4, Writer::kAbort>>(2'000).wrong), 0);
  EXPECT_GT((cut<Without<G4, Writer::kCommit>>(2'000).wrong), 0);
}

TEST(Journal, KeepsKeysThatItsReaderDoesNotKnow) {
  std::mt19937_64 random(2);
  G4 memory;
  memory.power_on(random);
  Journal journal(memory);
  EXPECT_EQ(journal.save(ValueSet{{{7, 1}, {Journal<G4>::kFirstMark - 1, 2}}}), Saved::kDone);
  EXPECT_EQ(stored(memory, random), (Values{{7, 1}, {Journal<G4>::kFirstMark - 1, 2}}));
  EXPECT_EQ(journal.find(8), std::nullopt);
}

TEST(Journal, ProgramsNothingForASetThatIsStored) {
  std::mt19937_64 random(3);
  G4 memory;
  memory.power_on(random);
  Journal journal(memory);
  EXPECT_EQ(journal.save(ValueSet{}), Saved::kUnchanged);
  EXPECT_EQ(journal.save(ValueSet{{{1, 2}}}), Saved::kDone);
  const long steps = memory.steps();
  EXPECT_EQ(journal.save(ValueSet{{{1, 2}}}), Saved::kUnchanged);
  const Journal again(memory);
  EXPECT_EQ(memory.steps(), steps);
}

TEST(Journal, RefusesASetThatAPageDoesNotHold) {
  std::mt19937_64 random(4);
  G4 memory;
  memory.power_on(random);
  Journal journal(memory);
  Values most;
  for (std::uint16_t key = 0; most.size() < 2048 / 8 - 20; ++key) most[key] = key;
  EXPECT_EQ(journal.save(ValueSet{most}), Saved::kDone);
  Values more = most;
  more[0x1000] = 0;
  EXPECT_EQ(journal.save(ValueSet{more}), Saved::kTooLarge);
  EXPECT_EQ(stored(memory, random), most);
}

/// One of 80 values changes in each save: an erase every 59 saves by granules alone (2048 / 8 - 80 of them, three a
/// save), less the marks and the reserve.
TEST(Journal, ErasesAPageOnceInFortySaves) {
  std::mt19937_64 random(5);
  G4 memory;
  memory.power_on(random);
  Journal journal(memory);
  Values values;
  for (std::uint16_t key = 0; key < 80; ++key) values[key] = key;
  for (std::uint32_t i = 0; i < 400; ++i) {
    values[0] = i + 1;
    ASSERT_EQ(journal.save(ValueSet{values}), Saved::kDone);
  }
  EXPECT_GE(memory.erases(), 400 / 40);
  EXPECT_LE(memory.erases(), 400 / 30);
}

}  // namespace
}  // namespace tetap::firmware
