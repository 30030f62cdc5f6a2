// SPDX-License-Identifier: Apache-2.0
// Text files written in blocks. A write that fails (disk full) is an error, not a short file. A file has its name once
// it is whole, and one program at a time writes into a folder.
#pragma once

#include <cstddef>
#include <cstdio>
#include <memory>
#include <string>
#include <string_view>

namespace tetap::sim {

/// Written as PATH.part, a new file that publish() renames; never through a link. A device or pipe is written as it is.
class OutFile {
 public:
  /// Throws std::runtime_error when the file cannot be made.
  explicit OutFile(const std::string& path);

  void write(std::string_view text) {
    if (buffer_.size() + text.size() > kBlock) spill();
    buffer_.append(text);
  }
  /// Writes what is left; throws when anything could not be written.
  void end();
  /// Gives the file, which has ended, its name; throws when that is not possible.
  void publish();
  /// end() and publish().
  void close();
  void flush();
  /// Takes the file away that was written aside, before publish().
  void discard();
  /// In place of publish(): takes away what was written aside, and what an earlier run left under the name.
  void withdraw();

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
