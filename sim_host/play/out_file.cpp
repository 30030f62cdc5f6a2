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

/// Path under which the text of `path` is written first.
std::string aside(const std::string& path) {
  std::error_code none;
  const auto status = std::filesystem::status(path, none);
  const bool ordinary = !std::filesystem::exists(status) || std::filesystem::is_regular_file(status);
  return ordinary ? path + ".part" : path;
}

/// The file that a link stands for: the link stays.
std::string behind_links(const std::string& path) {
  std::error_code error;
  if (!std::filesystem::is_symlink(path, error)) return path;
  const auto real = std::filesystem::canonical(path, error);
  return error ? path : real.string();
}

}  // namespace

OutFile::OutFile(const std::string& path)
    : path_(behind_links(path)), written_(aside(path_)), file_(std::fopen(written_.c_str(), "wb")) {
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
