// SPDX-License-Identifier: Apache-2.0
// Rows that wait on disk for what is known at the end of a run alone. Their file has no name and goes with the program,
// however it ends.
#pragma once

#include <cstddef>
#include <cstdio>
#include <memory>
#include <string>
#include <type_traits>

namespace tetap::sim {

class SpoolFile {
 public:
  /// In this folder; throws std::runtime_error when it takes no file.
  explicit SpoolFile(const std::string& folder);

  /// All throw std::runtime_error when the file cannot be written or read.
  void add(const void* bytes, std::size_t size);
  /// Nothing is added from here on.
  void rewind();
  /// False: no more.
  [[nodiscard]] bool read(void* bytes, std::size_t size);

 private:
  struct Closer {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  std::string folder_;
  std::unique_ptr<std::FILE, Closer> file_;
};

template <class Row>
requires std::is_trivially_copyable_v<Row>
class Spool {
 public:
  explicit Spool(const std::string& folder) : file_(folder) {}

  void add(const Row& row) { file_.add(&row, sizeof row); }
  /// Hands out every row, in order, once.
  template <class Take>
  void each(Take&& take) {
    file_.rewind();
    for (Row row; file_.read(&row, sizeof row);) take(row);
  }

 private:
  SpoolFile file_;
};

}  // namespace tetap::sim
