// SPDX-License-Identifier: Apache-2.0
// The objects of a node. A row of the table with index i is object 0x2000 + i as it is staged, 0x3000 + i as it is
// active, 0x4000 + i as it is compiled. A scalar is sub-index 0; element k of a vector is k + 1. The key is no object.
#pragma once

#include "tetap/bus/version.hpp"
#include "tetap/firmware/canopen/ids.hpp"
#include "tetap/firmware/canopen/parameter_writes.hpp"
#include "tetap/firmware/canopen/sdo_server.hpp"
#include "tetap/param/staged.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace tetap::firmware::canopen {

inline constexpr std::uint16_t kStagedRows = 0x2000, kActiveRows = 0x3000, kCompiledRows = 0x4000;
inline constexpr std::uint16_t kRowsEnd = 0x5000;
/// Sub-index 1 reads as the CRC of the staged set; that CRC written makes this set active. 2: CRC of the active set.
/// 3: rows that wait for a restart. 4: words that are not as compiled.
inline constexpr std::uint16_t kApply = 0x5F00;
inline constexpr std::uint32_t kSaveSignature = 0x65766173, kLoadSignature = 0x64616F6C;
inline constexpr std::uint16_t kHeartbeat_ms = 1000;

/// FNV-1a over index, length and type of every row: tables that agree in it have the same objects.
inline constexpr std::uint32_t kLayout = [] {
  std::uint32_t hash = 2'166'136'261U;
  for (const param::StoredRow& row : param::kStoredRows)
    for (const std::uint32_t part : std::array<std::uint32_t, 4>{row.index & 0xFFU, std::uint32_t{row.index} >> 8,
                                                                 row.words, static_cast<std::uint32_t>(row.kind)})
      hash = (hash ^ part) * 16'777'619U;
  return hash;
}();

/// Identity of a node on its bus.
struct Identity {
  std::uint32_t can_base = 0;
  std::uint8_t node_id = 0;
  bool keeps = false;  ///< a save outlives the power
  bus::Version version;
  const char* hardware = "";
};

class Objects {
 public:
  Objects(const Identity& identity, const param::StagedParameters& sets, ParameterWrites& writes)
      : identity_(identity), sets_(sets), writes_(writes) {}

  void note(std::uint8_t error_register, bool takes_commands) {
    error_register_ = error_register;
    takes_commands_ = takes_commands;
  }
  [[nodiscard]] const Identity& identity() const { return identity_; }

  /// A request takes a CRC over a set.
  [[nodiscard]] static constexpr bool is_long(std::uint16_t index) {
    return index == kApply || index == 0x1010 || index == 0x1011;
  }
  [[nodiscard]] [[gnu::cold]] Abort read(Object object, Content& content) const {
    if (object.index >= kStagedRows && object.index < kRowsEnd) return read_row(object, content);
    switch (object.index) {
      case 0x1000:
        return read_scalar(object, content, 0, 4);  // no device profile
      case 0x1001:
        return read_scalar(object, content, error_register_, 1);
      case 0x1008:
        return read_text(object, content, "tetap");
      case 0x1009:
        return read_text(object, content, identity_.hardware);
      case 0x100A:
        return read_version(object, content);
      case 0x1010:  // by command, where anything is kept
        return read_record(object, content, {identity_.keeps ? 1U : 0U});
      case 0x1011:
        return read_record(object, content, {1});
      case 0x1014:
        return read_scalar(object, content, kEmergencyIds + identity_.node_id, 4);
      case 0x1017:
        return read_scalar(object, content, kHeartbeat_ms, 2);
      case 0x1018:  // no vendor; layout, commit, no serial number
        return read_record(object, content, {0, kLayout, identity_.version.git, 0});
      case kApply:
        return read_sets(object, content);
      default:
        return Abort::kNoObject;
    }
  }
  [[nodiscard]] [[gnu::cold]] Abort write(Object object, std::span<const std::uint8_t> data) {
    const bool command =
        object.sub == 1 && (object.index == 0x1010 || object.index == 0x1011 || object.index == kApply);
    if (!command && (object.index < kStagedRows || object.index >= kActiveRows)) {
      Content ignored;
      const Abort why = read(object, ignored);
      return why == Abort::kNone ? Abort::kReadOnly : why;
    }
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < data.size() && i < 8; ++i) value |= std::uint64_t{data[i]} << (8 * i);
    if (!command) return write_row(object, value, data.size());
    if (data.size() != 4) return data.size() > 4 ? Abort::kTooLong : Abort::kTooShort;
    if (object.index == 0x1010 && value != kSaveSignature) return Abort::kNotStored;
    if (object.index == 0x1011 && value != kLoadSignature) return Abort::kNotStored;
    if (!takes_commands_) return Abort::kDeviceState;
    const std::uint32_t before = sets_.active_crc();
    if (object.index == 0x1010)
      writes_.save(before);
    else if (object.index == 0x1011)
      writes_.restore(before);
    else
      writes_.apply(before, static_cast<std::uint32_t>(value));
    return Abort::kPending;
  }

 private:
  struct Element {
    const param::StoredRow* row = nullptr;
    std::size_t word = 0, words = 0;
  };

  [[nodiscard]] static Abort read_scalar(Object object, Content& content, std::uint32_t value, std::size_t size) {
    if (object.sub != 0) return Abort::kNoSubindex;
    content.add(value, size);
    return Abort::kNone;
  }
  [[nodiscard]] static Abort read_text(Object object, Content& content, const char* text) {
    if (object.sub != 0) return Abort::kNoSubindex;
    content.add(text);
    return Abort::kNone;
  }
  template <std::size_t n>
  [[nodiscard]] static Abort read_record(Object object, Content& content, const std::uint32_t (&values)[n]) {
    if (object.sub > n) return Abort::kNoSubindex;
    if (object.sub == 0)
      content.add(n, 1);
    else
      content.add(values[object.sub - 1], 4);
    return Abort::kNone;
  }
  /// Only what is asked for is computed: a CRC is the longest work here.
  [[nodiscard]] Abort read_sets(Object object, Content& content) const {
    switch (object.sub) {
      case 0:
        return content.add(4, 1), Abort::kNone;
      case 1:
        return content.add(sets_.staged_crc(), 4), Abort::kNone;
      case 2:
        return content.add(sets_.active_crc(), 4), Abort::kNone;
      case 3:
        return content.add(sets_.pending(), 4), Abort::kNone;
      case 4:
        return content.add(sets_.changed(), 4), Abort::kNone;
      default:
        return Abort::kNoSubindex;
    }
  }
  /// "8a2d5ae", or "8a2d5ae-dirty" of a changed tree.
  [[nodiscard]] Abort read_version(Object object, Content& content) const {
    if (object.sub != 0) return Abort::kNoSubindex;
    for (int shift = 24; shift >= 0; shift -= 4) {
      const std::uint32_t digit = identity_.version.git >> static_cast<unsigned>(shift) & 0xFU;
      content.add(digit < 10 ? '0' + digit : 'a' + digit - 10, 1);
    }
    if (identity_.version.dirty) content.add("-dirty");
    return Abort::kNone;
  }

  /// The element of a row; its sub-index may be that of the number of elements, where `words` is 0.
  [[nodiscard]] static Abort find(Object object, Element& element) {
    const std::uint32_t index = object.index & 0xFFFU;
    for (const param::StoredRow& row : param::kStoredRows)
      if (row.index == index) element.row = &row;
    if (element.row == nullptr) return Abort::kNoObject;
    if (element.row->secret) return Abort::kNoAccess;
    const std::size_t each = element.row->kind == param::StoredRow::Kind::kLong ? 2 : 1;
    const bool scalar = element.row->words == each;
    if (scalar ? object.sub != 0 : object.sub * each > element.row->words) return Abort::kNoSubindex;
    if (!scalar && object.sub == 0) return Abort::kNone;
    element.word = scalar ? 0 : (object.sub - 1U) * each;
    element.words = each;
    return Abort::kNone;
  }
  [[nodiscard]] Abort read_row(Object object, Content& content) const {
    Element element;
    if (const Abort why = find(object, element); why != Abort::kNone) return why;
    if (element.words == 0) {
      const bool is_long = element.row->kind == param::StoredRow::Kind::kLong;
      content.add(element.row->words / (is_long ? 2U : 1U), 1);
      return Abort::kNone;
    }
    const param::Source source = object.index < kActiveRows     ? param::Source::kStaged
                                 : object.index < kCompiledRows ? param::Source::kActive
                                                                : param::Source::kCompiled;
    for (std::size_t word = 0; word < element.words; ++word)
      content.add(sets_.value(source, element.row->index, element.word + word), 4);
    return Abort::kNone;
  }
  [[nodiscard]] Abort write_row(Object object, std::uint64_t value, std::size_t size) {
    Element element;
    if (const Abort why = find(object, element); why != Abort::kNone) return why;
    if (element.words == 0 || element.row->access) return Abort::kReadOnly;
    if (size != 4 * element.words) return size > 4 * element.words ? Abort::kTooLong : Abort::kTooShort;
    if (!takes_commands_) return Abort::kDeviceState;
    for (std::size_t word = 0; word < element.words; ++word)
      writes_.set(*element.row, element.word + word, static_cast<std::uint32_t>(value >> (32 * word)));
    return Abort::kPending;
  }

  Identity identity_;
  const param::StagedParameters& sets_;
  ParameterWrites& writes_;
  std::uint8_t error_register_ = 0;
  bool takes_commands_ = false;
};

}  // namespace tetap::firmware::canopen
