// SPDX-License-Identifier: Apache-2.0
// Text output that keeps up with runs at hundreds of times real time. Lines are made by hand in a small buffer, files
// are written in blocks. A write that fails (disk full) is an error, not a short file. A file has its name once it is
// whole, and one program at a time writes into a folder.
#pragma once

#include "sim_host/play/sha256.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

namespace tetap::sim {

/// One line of text of bounded length; what does not fit is cut.
class Line {
 public:
  Line& text(std::string_view s) {
    for (const char c : s) put(c);
    return *this;
  }
  Line& put(char c) {
    if (size_ < bytes_.size()) bytes_[size_++] = c;
    return *this;
  }
  Line& integer(std::int64_t value, int width = 1);
  /// value / 10^decimals as a decimal number.
  Line& fixed(std::int64_t value, int decimals);
  /// Rounded to `decimals`; nothing at all for NaN and for numbers beyond 1e15.
  Line& real(double value, int decimals);
  Line& hex(std::uint32_t value, int digits);
  [[nodiscard]] std::string_view view() const { return {bytes_.data(), size_}; }
  void clear() { size_ = 0; }

 private:
  std::array<char, 512> bytes_{};
  std::size_t size_ = 0;
};

/// Written as PATH.part, which publish() renames. A device or pipe is written as it is.
class OutFile {
 public:
  enum class Hash : bool { kNo, kSha256 };

  /// Throws std::runtime_error when the file cannot be made.
  explicit OutFile(const std::string& path, Hash hash = Hash::kNo);

  void write(std::string_view text) {
    if (buffer_.size() + text.size() > kBlock) spill();
    buffer_.append(text);
  }
  /// Writes what is left; throws when anything could not be written. Returns the SHA-256 of all, if asked for.
  std::string end();
  /// Gives the file, which has ended, its name; throws when that is not possible.
  void publish();
  /// end() and publish().
  std::string close();
  void flush();
  /// Takes the file away that was written aside, before publish().
  void discard();

 private:
  static constexpr std::size_t kBlock = 1 << 18;
  struct Closer {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  void spill();

  std::string path_;
  std::string written_;  ///< path until publish()
  std::unique_ptr<std::FILE, Closer> file_;
  std::string buffer_;
  std::optional<Sha256> hash_;
};

/// Creates the folder and its parents; throws with the path and the reason.
void make_folder(const std::string& path);

/// Keeps other programs of this kind out of a folder, which it makes. The system takes the lock off when the program
/// ends, however it ends.
class FolderLock {
 public:
  /// Throws std::runtime_error when another program has the folder.
  explicit FolderLock(const std::string& path);
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;
  ~FolderLock();

 private:
  int folder_ = -1;
};

}  // namespace tetap::sim
