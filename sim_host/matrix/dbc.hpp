// SPDX-License-Identifier: Apache-2.0
// The signals of the bus as config/tetap.dbc states them, read at run time. Fields of a frame are read and written
// without the codec that the node uses.
#pragma once

#include "tetap/base/can_frame.hpp"

#include <cstdint>
#include <iosfwd>
#include <string>
#include <string_view>
#include <vector>

namespace tetap::sim {

/// One little-endian signal of a frame: physical value = factor * raw + offset.
struct DbcSignal {
  std::string name;
  unsigned start = 0;   ///< number of its lowest bit
  unsigned length = 0;  ///< bits
  bool is_signed = false;
  double factor = 1;
  double offset = 0;
  double least = 0;  ///< smallest and largest physical value that the DBC allows
  double most = 0;

  [[nodiscard]] std::int64_t raw(const base::CanFrame& frame) const;
  /// Writes the low `length` bits of `value`.
  void set_raw(base::CanFrame& frame, std::int64_t value) const;
  [[nodiscard]] double value(const base::CanFrame& frame) const;
  /// The raw number nearest to a physical value, kept within [least, most].
  [[nodiscard]] std::int64_t nearest(double value) const;
  /// The code outside of the range that means "not available"; false where every code is a value.
  [[nodiscard]] bool has_not_available() const;
  [[nodiscard]] std::int64_t not_available() const;
};

struct DbcMessage {
  std::string name;
  std::uint32_t offset = 0;  ///< place of its identifier within the node's block
  std::vector<DbcSignal> signals;

  /// Null where the message has no such signal.
  [[nodiscard]] const DbcSignal* find(std::string_view signal) const;
};

/// Messages of one node's block, whose first identifier in the file is 0x300.
class BusDatabase {
 public:
  /// Throws std::runtime_error with the line for a `BO_` or `SG_` line that cannot be read. Big-endian signals are
  /// refused; the bus has none.
  explicit BusDatabase(std::istream& dbc);
  /// Reads a file, as the constructor from a stream does.
  explicit BusDatabase(const std::string& path);

  /// Null where no message has that offset within the block.
  [[nodiscard]] const DbcMessage* at(std::uint32_t offset) const;
  /// Throws std::runtime_error where there is no such message.
  [[nodiscard]] const DbcMessage& message(std::string_view name) const;
  /// Throws std::runtime_error where there is no such signal.
  [[nodiscard]] const DbcSignal& signal(std::string_view message, std::string_view signal) const;

 private:
  void read(std::istream& dbc);

  std::vector<DbcMessage> messages_;
};

}  // namespace tetap::sim
