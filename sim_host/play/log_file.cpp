// SPDX-License-Identifier: Apache-2.0
#include "sim_host/play/log_file.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <string_view>
#include <vector>

namespace tetap::sim {

namespace {

/// A temporary file with the rest of `from`.
std::FILE* copy_of(std::FILE* from) {
  std::FILE* to = std::tmpfile();
  if (to == nullptr) return nullptr;
  constexpr std::size_t kBlock = LineBlocks::kBlock;
  std::vector<char> block(kBlock);
  std::size_t line = 0;  // its length so far: a pipe without line ends is copied until it is refused
  for (std::size_t got = kBlock; got == kBlock && line <= kLongestLine;) {
    got = std::fread(block.data(), 1, kBlock, from);
    const std::size_t last = std::string_view(block.data(), got).rfind('\n');
    line = last == std::string_view::npos ? line + got : got - last - 1;
    if (std::fwrite(block.data(), 1, got, to) == got) continue;
    std::fclose(to);
    return nullptr;
  }
  std::rewind(to);
  return to;
}

}  // namespace

LogFile::LogFile(const std::string& path, const LogOptions& options)
    : path_(path), options_(options), file_(std::fopen(path.c_str(), "rb"), &std::fclose), parser_(path, options) {
  if (!file_) refuse(std::string("cannot be read: ") + std::strerror(errno));
  if (std::fseek(file_.get(), 0, SEEK_SET) != 0) {
    std::FILE* copy = copy_of(file_.get());
    if (copy == nullptr) refuse(std::string("cannot be copied into a temporary file: ") + std::strerror(errno));
    file_.reset(copy);
  }
}

void LogFile::refuse(const std::string& reason) const { throw std::runtime_error(path_ + ": " + reason); }

std::size_t LogFile::read(char* to, std::size_t size) {
  if (report_) size = static_cast<std::size_t>(std::min<std::uint64_t>(size, length_ - bytes_));
  const std::size_t got = std::fread(to, 1, size, file_.get());
  if (std::ferror(file_.get()) != 0) refuse(std::string("cannot be read: ") + std::strerror(errno));
  bytes_ += got;
  return got;
}

bool LogFile::next(TimedFrame& frame) {
  TextLine line;
  while (lines_.next(line, [this](char* to, std::size_t size) { return read(to, size); })) {
    const auto found = parser_.add(line.text, line.ended);
    if (!found) throw std::runtime_error(found.failure().text);
    if (!*found) continue;
    frame = **found;
    return true;
  }
  if (!report_) {
    report_ = parser_.report();
    length_ = bytes_;
  }
  if (parser_.report().data != report_->data) refuse("has changed while it was played");
  return false;
}

void LogFile::rewind() {
  std::rewind(file_.get());
  parser_ = LogParser(path_, options_);
  lines_.clear();
  bytes_ = 0;
}

}  // namespace tetap::sim
