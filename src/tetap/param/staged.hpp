// SPDX-License-Identifier: Apache-2.0
// Parameters of a running node: the active ones, and a staged copy that commands write. An Apply takes the staged copy
// as a whole or not at all. Live rows are active at once; the others wait for a restart.
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/param/crc.hpp"
#include "tetap/param/stored_row.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <utility>

namespace tetap::param {

/// Answer to a command; the numbers are those on the bus.
enum class Answer : std::uint8_t {
  kDone,
  kUnknown,      ///< no row of this index, or no such element
  kOutOfLimits,  ///< a value beyond its row
  kRefused,      ///< a row of access or identity
  kOtherActive,  ///< the active set is not the one that the command names
  kOtherStaged,  ///< the staged set is not the one that the command names
  kNotTogether,  ///< a rule between rows is broken, by the staged set or by its live rows alone
};

/// The sets that a row is read from; the numbers are those on the bus.
enum class Source : std::uint8_t { kActive, kStaged, kCompiled };

class StagedParameters {
 public:
  /// Bits of a CRC by which a command names a set.
  static constexpr std::uint32_t kName = 0xFFFFFF;

  /// The compiled parameters outlive it.
  explicit StagedParameters(const Parameters& compiled) : compiled_(compiled), active_(compiled), staged_(compiled) {}

  [[nodiscard]] const Parameters& active() const { return active_; }
  [[nodiscard]] std::uint32_t active_crc() const { return crc(active_); }
  [[nodiscard]] std::uint32_t staged_crc() const { return crc(staged_); }
  /// Whether there is such a row, with so many words.
  [[nodiscard]] static bool has(std::uint16_t index, std::size_t word) {
    const std::size_t at = find(index);
    return at < kStoredRows.size() && word < kStoredRows[at].words && !is_secret(at);
  }
  /// 0 where there is none, and of the key.
  [[nodiscard]] std::uint32_t value(Source source, std::uint16_t index, std::size_t word) const {
    if (!has(index, word)) return 0;
    const Parameters& of = source == Source::kActive ? active_ : source == Source::kStaged ? staged_ : compiled_;
    return get(of, kStoredRows[find(index)], word);
  }
  /// The word of the active set is not as compiled; `row` counts in kStoredRows.
  [[nodiscard]] bool is_changed(std::size_t row, std::size_t word) const {
    return !is_secret(row) && get(active_, kStoredRows[row], word) != get(compiled_, kStoredRows[row], word);
  }
  [[nodiscard]] std::size_t changed() const {
    std::size_t words = 0;
    for (std::size_t row = 0; row < kStoredRows.size(); ++row)
      for (std::size_t word = 0; word < kStoredRows[row].words; ++word) words += is_changed(row, word) ? 1U : 0U;
    return words;
  }
  /// Rows that wait for a restart.
  [[nodiscard]] std::size_t pending() const {
    std::size_t rows = 0;
    for (std::size_t row = 0; row < kStoredRows.size(); ++row) rows += is_pending(row) ? 1U : 0U;
    return rows;
  }

  static constexpr auto members(auto& self) {
    return base::members(base::reference(self.compiled_), base::unhashed(self.active_), base::unhashed(self.staged_),
                         base::unhashed(self.waits_));
  }
  /// For a copy that others get.
  void hide_secrets() { active_.bus.key = staged_.bus.key = {}; }
  /// All but the compiled set, from a state whose secrets may be hidden: the key is always the compiled one.
  void resume(const StagedParameters& other) {
    active_ = other.active_, staged_ = other.staged_, waits_ = other.waits_;
    active_.bus.key = staged_.bus.key = compiled_.bus.key;
  }

  /// One word of a row of the staged copy; a row that waited for a restart does not wait any more.
  Answer set(std::uint16_t index, std::size_t word, std::uint32_t value) { return stage(index, word, value, false); }
  [[nodiscard]] static bool is_key(std::uint16_t index) {
    const std::size_t at = find(index);
    return at < kStoredRows.size() && is_secret(at);
  }
  /// One word of the first key. From the Apply on, commands and lockstep need tags by it; a desk's lockstep stays open.
  Answer claim(std::size_t word, std::uint32_t value) {
    if (word >= staged_.bus.key.size()) return Answer::kUnknown;
    if (active_.bus.key != decltype(active_.bus.key){}) return Answer::kRefused;
    staged_.bus.key[word] = value;
    staged_.bus.commands = CommandAccess::kAuthenticated;
    if (active_.loop.lockstep == Lockstep::kGuarded) staged_.loop.lockstep = Lockstep::kAuthenticated;
    return Answer::kDone;
  }
  /// A key that is staged only is gone.
  void withdraw_claim() {
    if (claims()) copy_access(active_, staged_);
  }
  /// Whether take_over() may follow. `before` and `after`: names (kName) of the active set that the sender knows, and
  /// of the staged one that it means.
  [[nodiscard]] Answer judge(std::uint32_t before, std::uint32_t after) {
    const Answer named = compare(before, after);
    return named == Answer::kDone ? judge() : named;
  }
  /// The same for take_over_all().
  [[nodiscard]] Answer judge_all(std::uint32_t before, std::uint32_t after) const {
    const Answer named = compare(before, after);
    return named == Answer::kDone && !plausible_together(staged_) ? Answer::kNotTogether : named;
  }
  /// Stages the compiled parameters, but for rows of access, and judges them.
  [[nodiscard]] Answer restore(std::uint32_t before) {
    if (!is_active(before)) return Answer::kOtherActive;
    withdraw_claim();
    for (std::size_t row = 0; row < kStoredRows.size(); ++row)
      if (!kStoredRows[row].access) copy(compiled_, staged_, kStoredRows[row]);
    return judge();
  }
  /// Live rows and a claimed key are active, the others wait where they differ.
  void take_over() {
    if (claims()) copy_access(staged_, active_);
    for (std::size_t row = 0; row < kStoredRows.size(); ++row) {
      const bool live = kStoredRows[row].live;
      if (live) copy(staged_, active_, kStoredRows[row]);
      wait(row, !live && differ(active_, staged_, kStoredRows[row]));
    }
  }
  /// Every row is active: the estimators begin anew.
  void take_over_all() {
    active_ = staged_;
    waits_ = {};
  }
  /// At a restart: rows that wait are active. What is staged without an Apply is gone.
  void restart() {
    static_cast<void>(exchange([this](std::size_t row) { return is_pending(row); }));
    staged_ = active_;
    waits_ = {};
  }
  /// A kept set at power-on, a claimed key among it: each_word(take) with take(index, word, value). Unknown words are
  /// passed over; refused(index, word, answer) for others that are not taken. False: together they break a rule, and
  /// everything but a claim is as compiled.
  template <class Each, class Refused>
  [[nodiscard]] bool load(Each&& each_word, Refused&& refused) {
    active_ = staged_ = compiled_;
    waits_ = {};
    each_word([&](std::uint16_t index, std::size_t word, std::uint32_t value) {
      const Answer is = stage(index, word, value, true);
      if (is != Answer::kDone && is != Answer::kUnknown) refused(index, word, is);
    });
    const bool plausible = plausible_together(staged_);
    if (plausible) return active_ = staged_, true;
    copy_access(staged_, active_);
    if (!plausible_together(active_)) active_ = compiled_;
    staged_ = active_;
    return false;
  }
  /// take(index, word, value) for each word that a save keeps: of what is active or waits, where it is not as compiled.
  template <class Take>
  void each_kept(Take&& take) const {
    for (std::size_t at = 0; at < kStoredRows.size(); ++at) {
      const StoredRow& row = kStoredRows[at];
      const Parameters& from = is_pending(at) ? staged_ : active_;
      for (std::size_t word = 0; word < row.words; ++word)
        if (get(from, row, word) != get(compiled_, row, word)) take(row.index, word, get(from, row, word));
    }
  }

 private:
  static constexpr std::size_t kBits = 32;

  Answer stage(std::uint16_t index, std::size_t word, std::uint32_t value, bool kept) {
    const std::size_t at = find(index);
    if (at == kStoredRows.size() || word >= kStoredRows[at].words) return Answer::kUnknown;
    const StoredRow& row = kStoredRows[at];
    if (row.access && !(kept && is_of_claim(row, value))) return Answer::kRefused;
    if (!row.within(value)) return Answer::kOutOfLimits;
    put(staged_, row, word, value);
    wait(at, false);
    return Answer::kDone;
  }
  /// A word that claim() gives to a node that was compiled without a key.
  [[nodiscard]] bool is_of_claim(const StoredRow& row, std::uint32_t value) const {
    if (compiled_.bus.key != decltype(compiled_.bus.key){}) return false;
    const auto needs_tags = [&](std::size_t offset, auto authenticated) {
      return row.offset == offset && value == static_cast<std::uint32_t>(authenticated);
    };
    return row.secret || needs_tags(offsetof(Parameters, bus.commands), CommandAccess::kAuthenticated) ||
           (compiled_.loop.lockstep == Lockstep::kGuarded &&
            needs_tags(offsetof(Parameters, loop.lockstep), Lockstep::kAuthenticated));
  }

  [[nodiscard]] bool is_active(std::uint32_t name) const { return ((name ^ active_crc()) & kName) == 0; }
  [[nodiscard]] Answer compare(std::uint32_t before, std::uint32_t after) const {
    if (!is_active(before)) return Answer::kOtherActive;
    return ((after ^ staged_crc()) & kName) == 0 ? Answer::kDone : Answer::kOtherStaged;
  }
  [[nodiscard]] Answer judge() {
    const auto live = [](std::size_t row) { return kStoredRows[row].live; };
    if (!plausible_together(staged_) || !exchange(live)) return Answer::kNotTogether;
    static_cast<void>(exchange(live));
    return Answer::kDone;
  }
  static bool is_secret(std::size_t row) { return kStoredRows[row].secret; }
  [[nodiscard]] bool claims() const { return staged_.bus.commands != active_.bus.commands; }
  static void copy_access(const Parameters& from, Parameters& to) {
    to.bus.key = from.bus.key, to.bus.commands = from.bus.commands, to.loop.lockstep = from.loop.lockstep;
  }

  [[nodiscard]] static std::size_t find(std::uint16_t index) {
    std::size_t at = 0;
    while (at < kStoredRows.size() && kStoredRows[at].index != index) ++at;
    return at;
  }
  [[nodiscard]] static std::uint32_t get(const Parameters& p, const StoredRow& row, std::size_t word) {
    std::uint32_t value = 0;
    std::memcpy(&value, reinterpret_cast<const unsigned char*>(&p) + row.offset + 4 * word, sizeof value);
    return value;
  }
  static void put(Parameters& p, const StoredRow& row, std::size_t word, std::uint32_t value) {
    std::memcpy(reinterpret_cast<unsigned char*>(&p) + row.offset + 4 * word, &value, sizeof value);
  }
  static void copy(const Parameters& from, Parameters& to, const StoredRow& row) {
    for (std::size_t word = 0; word < row.words; ++word) put(to, row, word, get(from, row, word));
  }
  [[nodiscard]] static bool differ(const Parameters& a, const Parameters& b, const StoredRow& row) {
    bool differs = false;
    for (std::size_t word = 0; word < row.words; ++word) differs = differs || get(a, row, word) != get(b, row, word);
    return differs;
  }
  /// Exchanges rows of the active and of the staged set; not at all, where the active set then breaks a rule.
  template <class Chosen>
  [[nodiscard]] bool exchange(Chosen&& chosen) {
    const auto turn = [&] {
      for (std::size_t at = 0; at < kStoredRows.size(); ++at) {
        if (!chosen(at)) continue;
        const StoredRow& row = kStoredRows[at];
        for (std::size_t word = 0; word < row.words; ++word) {
          const std::uint32_t active = get(active_, row, word);
          put(active_, row, word, get(staged_, row, word));
          put(staged_, row, word, active);
        }
      }
    };
    turn();
    const bool plausible = plausible_together(active_);
    if (!plausible) turn();
    return plausible;
  }
  [[nodiscard]] bool is_pending(std::size_t row) const { return (waits_[row / kBits] >> row % kBits & 1U) != 0; }
  void wait(std::size_t row, bool waits) {
    const std::uint32_t bit = 1U << row % kBits;
    waits_[row / kBits] = waits ? waits_[row / kBits] | bit : waits_[row / kBits] & ~bit;
  }

  const Parameters& compiled_;
  Parameters active_, staged_;
  std::array<std::uint32_t, (kTable.size() + kBits - 1) / kBits>
      waits_{};  ///< bit of each row that waits for a restart
};

}  // namespace tetap::param
