// SPDX-License-Identifier: Apache-2.0
// Parameters that a board keeps without power: a journal in its flash, read at power-on, written by a Save. While the
// flash works the core may stand still; so a Save acts only at rest, outside of lockstep, and once a minute.
#pragma once

#include "hal/board.hpp"
#include "tetap/bus/messages.hpp"
#include "tetap/bus/parameter_commands.hpp"
#include "tetap/firmware/journal.hpp"
#include "tetap/param/staged.hpp"

#include <cstddef>
#include <cstdint>
#include <optional>

namespace tetap::firmware {

/// Words that a save keeps, under keys of row and word.
class KeptSet {
 public:
  explicit KeptSet(const param::StagedParameters& sets) : sets_(sets) {}

  static constexpr std::uint16_t key(std::uint16_t row, std::size_t word) {
    return static_cast<std::uint16_t>(row * kWords + word);
  }
  static constexpr std::uint16_t row(std::uint16_t key) { return key / kWords; }
  static constexpr std::uint8_t word(std::uint16_t key) { return key % kWords; }

  template <class Take>
  void each(Take&& take) const {
    sets_.each_kept([&](std::uint16_t row, std::size_t word, std::uint32_t value) {
      take(JournalEntry{.key = key(row, word), .value = value});
    });
  }
  [[nodiscard]] std::optional<std::uint32_t> find(std::uint16_t key) const {
    std::optional<std::uint32_t> found;
    each([&](const JournalEntry& entry) {
      if (entry.key == key) found = entry.value;
    });
    return found;
  }

 private:
  static constexpr std::uint16_t kWords = 16;  ///< a row has fewer, as Cmd_Param counts them
  static_assert([] {
    bool fits = true;
    for (const param::StoredRow& row : param::kStoredRows)
      fits = fits && row.words <= kWords && row.index < 0xFFF0U / kWords;
    return fits;
  }());

  const param::StagedParameters& sets_;
};

template <class Board>
class KeptParameters {
 public:
  static_assert(hal::StorageBoard<Board>);
  static constexpr base::Micros kBetween{60'000'000};  ///< two saves that write

  /// Reads the flash, and may erase it: on a new board, or behind a power cut.
  explicit KeptParameters(Board& board) : board_(board) {}

  /// Makes what is kept the node's; each word that is not taken is a message, and so is a set that is not.
  template <class Node, class Tell>
  void load(Node& node, Tell&& tell) {
    if (journal_.empty()) return;
    auto& commands = node.parameter_commands();
    const auto each_word = [this](auto&& take) {
      journal_.load(
          [&](const JournalEntry& entry) { take(KeptSet::row(entry.key), KeptSet::word(entry.key), entry.value); });
    };
    const bool together = commands.load(each_word, [&](std::uint16_t row, std::size_t word, param::Answer why) {
      tell(bus::EstParamRow{.row_word = static_cast<std::uint8_t>(word),
                            .row_id = row,
                            .row_answer = static_cast<bus::ParamAnswer>(why),
                            .row_ctr = bus::EstParamRow::kRowCtrNotAvailable,
                            .row_value = commands.sets().value(param::Source::kCompiled, row, word)});
    });
    if (!together)
      tell(commands.answer_to({.counter = bus::EstParamSet::kSetCtrNotAvailable}, bus::ParamAnswer::kNotTogether));
    node.power_on({});
  }

  struct Outcome {
    bus::ParamAnswer answer = bus::ParamAnswer::kBusy;
    bool wrote = false;  ///< the flash was written: frames may be lost, and the board's clock may have stood
  };
  /// `may_stop`: the vehicle rests, and no player waits for the node.
  [[nodiscard]] [[gnu::cold]] Outcome save(const param::StagedParameters& sets, std::uint32_t before, bool may_stop) {
    if (((before ^ sets.active_crc()) & param::StagedParameters::kName) != 0) return {bus::ParamAnswer::kOtherActive};
    const KeptSet set(sets);
    if (holds(set)) return {bus::ParamAnswer::kDone};
    const base::Micros now = board_.now();
    if (!may_stop || (written_ && now - written_at_ < kBetween)) return {};
    board_.begin_storing();
    const Saved saved = journal_.save(set);
    board_.end_storing();
    written_ = true;
    written_at_ = board_.now();
    return {saved == Saved::kDone ? bus::ParamAnswer::kDone : bus::ParamAnswer::kNotKept, saved != Saved::kTooLarge};
  }

 private:
  [[nodiscard]] bool holds(const KeptSet& set) const {
    bool same = true;
    set.each([&](const JournalEntry& entry) { same = same && journal_.find(entry.key) == entry.value; });
    journal_.load([&](const JournalEntry& entry) { same = same && set.find(entry.key).has_value(); });
    return same;
  }

  Board& board_;
  typename Board::Storage storage_ = (board_.begin_storing(), Board::storage());
  Journal<typename Board::Storage> journal_{storage_};
  base::Micros written_at_;
  bool written_ = false;  ///< a save has written after power-on
};

}  // namespace tetap::firmware
