// SPDX-License-Identifier: Apache-2.0
#include "sim_host/play/out_file.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <stdexcept>

namespace tetap::sim {

namespace {

/// Path under which the text of `path` is written first. A link is refused: whoever planted it would choose the file.
std::string aside(const std::string& path) {
  std::error_code none;
  const auto status = std::filesystem::status(path, none);
  if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status)) return path;
  if (std::filesystem::is_symlink(path, none))
    throw std::runtime_error(path + ": cannot be written: it is a link; name the file itself");
  return path + ".part";
}

/// A file of one's own, whatever lay there; a device or pipe is opened as it is.
std::FILE* open_for_writing(const std::string& path, bool ordinary) {
  if (!ordinary) return std::fopen(path.c_str(), "wb");
  if (unlink(path.c_str()) != 0 && errno != ENOENT) return nullptr;
  const int file = open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666);
  return file < 0 ? nullptr : fdopen(file, "wb");
}

}  // namespace

OutFile::OutFile(const std::string& path)
    : path_(path), written_(aside(path)), file_(open_for_writing(written_, written_ != path)) {
  if (!file_) throw std::runtime_error(path + ": cannot be written: " + std::strerror(errno));
  std::setvbuf(file_.get(), nullptr, _IONBF, 0);
  buffer_.reserve(kBlock);
}

void OutFile::spill() {
  if (std::fwrite(buffer_.data(), 1, buffer_.size(), file_.get()) != buffer_.size())
    throw std::runtime_error(path_ + ": cannot be written: " + std::strerror(errno));
  buffer_.clear();
}

void OutFile::flush() { spill(); }

void OutFile::end() {
  spill();
  if (std::fclose(file_.release()) != 0)
    throw std::runtime_error(path_ + ": cannot be written: " + std::strerror(errno));
}

void OutFile::publish() {
  if (written_ != path_ && std::rename(written_.c_str(), path_.c_str()) != 0)
    throw std::runtime_error(path_ + ": cannot be written: " + std::strerror(errno));
}

void OutFile::discard() {
  file_.reset();
  std::error_code none;
  if (written_ != path_) std::filesystem::remove(written_, none);
}

void OutFile::withdraw() {
  discard();
  std::error_code none;
  if (written_ != path_) std::filesystem::remove(path_, none);
}

void OutFile::close() {
  end();
  publish();
}

void make_folder(const std::string& path) {
  std::error_code error;
  std::filesystem::create_directories(path, error);
  if (error || !std::filesystem::is_directory(path))
    throw std::runtime_error(path +
                             ": cannot be made: " + (error ? error.message() : "a file of that name is in the way"));
}

FolderLock::FolderLock(const std::string& path) {
  make_folder(path);
  folder_ = open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (folder_ >= 0 && flock(folder_, LOCK_EX | LOCK_NB) == 0) return;
  const int error = errno;
  const bool taken = folder_ >= 0 && error == EWOULDBLOCK;
  if (folder_ >= 0) close(folder_);
  throw std::runtime_error(path + (taken ? std::string(": another run writes here; give this one another folder")
                                         : std::string(": cannot be locked: ") + std::strerror(error)));
}

FolderLock::~FolderLock() { close(folder_); }

}  // namespace tetap::sim
