// SPDX-License-Identifier: Apache-2.0
// A small set of numbered values in two pages of flash. A save is a transaction: begin, records, commit, seal. Power
// may fail at any instant: what is read next is the set before that save or the set behind it.
//
// A granule that a power cut left half-programmed may read as blank, as refused, or as whole, and otherwise the next
// time. So what a start has read, it writes down before anyone sees it: a commit or an abort, then a seal. A seal is
// programmed behind a finished mark alone; so the last mark before it holds its charge.
#pragma once

#include "hal/storage.hpp"
#include "tetap/base/crc.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace tetap::firmware {

/// A value under its key; keys from Journal::kFirstMark on are the journal's own.
struct JournalEntry {
  std::uint16_t key = 0;
  std::uint32_t value = 0;
};

/// Entries to be saved, each key once.
template <class S>
concept JournalSet = requires(const S& set, std::uint16_t key) {
  set.each([](const JournalEntry&) {});
  { set.find(key) } -> std::same_as<std::optional<std::uint32_t>>;
};

enum class Saved : std::uint8_t {
  kDone,       ///< the set is stored
  kUnchanged,  ///< the set was stored already; nothing was programmed
  kTooLarge,   ///< a page has no room for it; the set before stands
  kFault,      ///< the memory failed; the set before stands
};

/// Record: value 32 | key 16 | CRC-16 over both and the page's generation, in the first 8 bytes of a granule, with
/// zeros behind. Granule 0: generation 32 | magic 16 | CRC-16. A page holds a set from its first commit on; of two such
/// pages the one with the later generation counts.
template <hal::Storage Storage>
class Journal {
 public:
  static constexpr std::uint16_t kFirstMark = 0xFFF0;
  static constexpr std::uint16_t kAbort = 0xFFFC;   ///< value: granule of the begin whose transaction is void
  static constexpr std::uint16_t kSeal = 0xFFFD;    ///< the mark before holds
  static constexpr std::uint16_t kBegin = 0xFFFE;   ///< value 1: the entries replace all others
  static constexpr std::uint16_t kCommit = 0xFFFF;  ///< value: granule of the begin 16 | number of entries since it 16

  /// Reads what is stored, and settles what a power cut left open.
  explicit Journal(Storage& storage) : storage_(storage) { mount(); }

  /// take(entry) for every stored entry, oldest first: of two with one key the later one counts.
  template <class Take>
  void load(Take&& take) const {
    for (std::size_t at = first_; at < next_;) {
      const Transaction t = transaction({page_, at, next_}, generation_, [](const JournalEntry&) {});
      if (t.committed) static_cast<void>(transaction({page_, at, next_}, generation_, take));
      at = t.end;
    }
  }
  [[nodiscard]] std::optional<std::uint32_t> find(std::uint16_t key) const {
    std::optional<std::uint32_t> found;
    for (std::size_t at = first_; at < next_;) {
      std::optional<std::uint32_t> candidate = found;
      const Transaction t = transaction({page_, at, next_}, generation_, [&](const JournalEntry& entry) {
        if (entry.key == key) candidate = entry.value;
      });
      if (t.committed) found = candidate;
      at = t.end;
    }
    return found;
  }
  /// Stores `set` and nothing else.
  template <JournalSet Set>
  Saved save(const Set& set);

  [[nodiscard]] bool empty() const { return empty_; }

 private:
  static constexpr std::size_t kGranules = Storage::kPageBytes / Storage::kGranuleBytes;
  static constexpr std::size_t kMarks = 3;          ///< begin, commit, seal
  static constexpr std::size_t kReserve = 16;       ///< granules for starts that a power cut ends, two each
  static constexpr std::uint16_t kInUse = 0x7E7A;   ///< key of granule 0 of a page with a set
  static constexpr std::uint16_t kErased = 0x7E7B;  ///< the same of a page whose erase has ended
  static_assert(kGranules > 4 * kReserve && kGranules <= 0x10000);

  struct Granule {
    bool blank = false;
    bool valid = false;
    JournalEntry entry;
  };
  struct Range {
    std::size_t page, begin, end;
  };
  struct Transaction {
    std::size_t begin = 0;  ///< granule of its begin; 0: none
    std::size_t end = 0;    ///< granule behind its last one
    std::uint32_t entries = 0;
    bool used = false;  ///< it has a granule that is not blank
    bool whole = false;
    bool committed = false;
    bool sealed = false;  ///< nothing is behind its seal
  };
  struct Page {
    std::optional<std::uint32_t> generation;
    bool closed = false;    ///< it holds a set
    bool erased = false;    ///< it holds nothing
    std::size_t first = 1;  ///< granule of the last transaction that replaces all before it
    std::size_t next = kGranules;
    Transaction last;
  };

  [[nodiscard]] static std::uint16_t check_of(const JournalEntry& entry, std::uint32_t generation) {
    base::Crc32 crc;
    for (int shift = 0; shift < 32; shift += 8) crc.add(static_cast<std::uint8_t>(entry.value >> shift));
    for (int shift = 0; shift < 16; shift += 8) crc.add(static_cast<std::uint8_t>(entry.key >> shift));
    for (int shift = 0; shift < 32; shift += 8) crc.add(static_cast<std::uint8_t>(generation >> shift));
    return static_cast<std::uint16_t>(crc.value());
  }
  [[nodiscard]] Granule read(std::size_t page, std::size_t at, std::uint32_t generation) const;
  template <class Take>
  [[nodiscard]] Transaction transaction(const Range& in, std::uint32_t generation, Take&& take) const;
  /// A mark names its begin: behind a begin that became unreadable it would be one of the transaction before.
  [[nodiscard]] static std::uint32_t mark(const Transaction& t) {
    return static_cast<std::uint32_t>(t.begin) << 16 | t.entries;
  }
  [[nodiscard]] Page scan(std::size_t page) const;
  void mount();
  void clear(std::size_t page) {
    if (storage_.erase(page)) static_cast<void>(write(page, 0, {kErased, 0}, 0));
  }

  [[nodiscard]] bool write(std::size_t page, std::size_t at, const JournalEntry& entry, std::uint32_t generation);
  /// At the next granule that takes it.
  [[nodiscard]] bool append(const JournalEntry& entry) {
    while (next_ < kGranules)
      if (write(page_, next_++, entry, generation_)) return true;
    return false;
  }
  template <class Each>
  [[nodiscard]] bool append_transaction(bool whole, Each&& each);
  template <JournalSet Set>
  [[nodiscard]] bool compact(const Set& set);

  Storage& storage_;
  std::size_t page_ = 0;
  std::size_t first_ = kGranules;  ///< where the stored set begins
  std::size_t next_ = kGranules;   ///< granule for the next record
  std::uint32_t generation_ = 0;
  bool empty_ = true;
};

template <hal::Storage Storage>
auto Journal<Storage>::read(std::size_t page, std::size_t at, std::uint32_t generation) const -> Granule {
  std::array<std::uint8_t, Storage::kGranuleBytes> bytes{};
  if (!storage_.read(page, at, bytes)) return {};
  std::uint64_t record = 0;
  bool ones = true, zeros = true;
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    if (i < 8) record |= std::uint64_t{bytes[i]} << (8 * i);
    ones = ones && bytes[i] == 0xFF;
    zeros = zeros && (i < 8 || bytes[i] == 0);
  }
  const JournalEntry entry{.key = static_cast<std::uint16_t>(record >> 32),
                           .value = static_cast<std::uint32_t>(record)};
  return {.blank = ones,
          .valid = !ones && zeros && static_cast<std::uint16_t>(record >> 48) == check_of(entry, generation),
          .entry = entry};
}

template <hal::Storage Storage>
bool Journal<Storage>::write(std::size_t page, std::size_t at, const JournalEntry& entry, std::uint32_t generation) {
  const std::uint64_t record =
      entry.value | std::uint64_t{entry.key} << 32 | std::uint64_t{check_of(entry, generation)} << 48;
  std::array<std::uint8_t, Storage::kGranuleBytes> bytes{};
  for (std::size_t i = 0; i < 8; ++i) bytes[i] = static_cast<std::uint8_t>(record >> (8 * i));
  if (!storage_.program(page, at, bytes)) return false;
  const Granule back = read(page, at, generation);
  return back.valid && back.entry.key == entry.key && back.entry.value == entry.value;
}

/// The first transaction of a range, up to the next begin or to the range's end. The last mark decides. Granules that
/// are no record are passed over: a commit that became unreadable has another one behind it.
template <hal::Storage Storage>
template <class Take>
auto Journal<Storage>::transaction(const Range& in, std::uint32_t generation, Take&& take) const -> Transaction {
  Transaction t{.end = in.begin};
  for (; t.end < in.end; ++t.end) {
    const Granule g = read(in.page, t.end, generation);
    if (g.blank) continue;
    const bool begins = g.valid && g.entry.key == kBegin;
    if (begins && t.used) break;
    t.used = true;
    t.sealed = g.valid && g.entry.key == kSeal;
    if (!g.valid) continue;
    if (begins) t.begin = t.end, t.whole = g.entry.value != 0;
    if (g.entry.key < kFirstMark) ++t.entries, take(g.entry);
    if (g.entry.key == kCommit && g.entry.value >> 16 == t.begin) t.committed = g.entry.value == mark(t);
    if (g.entry.key == kAbort && g.entry.value == t.begin) t.committed = false;
  }
  return t;
}

template <hal::Storage Storage>
auto Journal<Storage>::scan(std::size_t page) const -> Page {
  Page p;
  const Granule head = read(page, 0, 0);
  p.erased = head.valid && head.entry.key == kErased;
  if (!head.valid || head.entry.key != kInUse) return p;
  p.generation = head.entry.value;
  p.next = 1;
  for (std::size_t at = 1; at < kGranules; ++at)
    if (!read(page, at, *p.generation).blank) p.next = at + 1;
  for (std::size_t at = 1; at < p.next;) {
    const Transaction t = transaction({page, at, p.next}, *p.generation, [](const JournalEntry&) {});
    if (t.committed && (t.whole || !p.closed)) p.first = at;
    p.closed = p.closed || t.committed;
    p.last = t;
    at = t.end;
  }
  return p;
}

template <hal::Storage Storage>
void Journal<Storage>::mount() {
  const std::array pages{scan(0), scan(1)};
  const auto later = [&pages](std::size_t a, std::size_t b) {
    return pages[b].generation && static_cast<std::int32_t>(*pages[a].generation - *pages[b].generation) > 0;
  };
  empty_ = !pages[0].closed && !pages[1].closed;
  page_ = pages[1].closed && (!pages[0].closed || later(1, 0)) ? 1 : 0;
  // Neither current, nor older, nor erased to its end: a page of a cut may have a commit the next time, even a blank
  // one.
  for (std::size_t page = 0; page < pages.size(); ++page)
    if (!pages[page].erased && (empty_ || (page != page_ && !later(page_, page)))) clear(page);
  if (empty_) return;
  const Page& now = pages[page_];
  generation_ = *now.generation;
  first_ = now.first;
  next_ = now.next;
  if (now.last.sealed) return;
  const auto begin = static_cast<std::uint32_t>(now.last.begin);
  if (append(now.last.committed ? JournalEntry{kCommit, mark(now.last)} : JournalEntry{kAbort, begin}))
    static_cast<void>(append({kSeal, 0}));
}

template <hal::Storage Storage>
template <class Each>
bool Journal<Storage>::append_transaction(bool whole, Each&& each) {
  Transaction t;
  bool good = append({kBegin, whole ? 1U : 0U});
  t.begin = next_ - 1;
  each([&](const JournalEntry& entry) {
    good = good && append(entry);
    ++t.entries;
  });
  if (good && append({kCommit, mark(t)}) && append({kSeal, 0})) {
    if (whole) first_ = t.begin;
    return true;
  }
  if (append({kAbort, static_cast<std::uint32_t>(t.begin)})) static_cast<void>(append({kSeal, 0}));
  return false;
}

/// The other page gets the whole set; its commit makes it the one that counts.
template <hal::Storage Storage>
template <JournalSet Set>
bool Journal<Storage>::compact(const Set& set) {
  const Journal before = *this;
  page_ = empty_ ? 0 : 1 - page_;
  ++generation_;
  next_ = 1;
  const auto all = [&set](auto&& take) { set.each(take); };
  if (storage_.erase(page_) && write(page_, 0, {kInUse, generation_}, 0) && append_transaction(true, all)) {
    empty_ = false;
    return true;
  }
  clear(page_);
  page_ = before.page_;
  generation_ = before.generation_;
  next_ = before.next_;
  first_ = before.first_;
  return false;
}

template <hal::Storage Storage>
template <JournalSet Set>
Saved Journal<Storage>::save(const Set& set) {
  std::size_t all = 0, changed = 0;
  set.each([&](const JournalEntry& entry) {
    ++all;
    changed += find(entry.key) != entry.value ? 1U : 0U;
  });
  bool removes = false;
  load([&](const JournalEntry& entry) { removes = removes || !set.find(entry.key); });
  if (changed == 0 && !removes) return Saved::kUnchanged;
  if (1 + all + kMarks + kReserve > kGranules) return Saved::kTooLarge;
  if (!empty_ && next_ + (removes ? all : changed) + kMarks + kReserve <= kGranules) {
    const auto some = [&](auto&& take) {
      set.each([&](const JournalEntry& entry) {
        if (removes || find(entry.key) != entry.value) take(entry);
      });
    };
    if (append_transaction(removes, some)) return Saved::kDone;
  }
  return compact(set) ? Saved::kDone : Saved::kFault;
}

}  // namespace tetap::firmware
