// SPDX-License-Identifier: Apache-2.0
#include "sim_host/play/spool.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <stdexcept>

namespace tetap::sim {

namespace {

[[noreturn]] void refuse(const std::string& folder, const char* what) {
  throw std::runtime_error(folder + ": rows that wait there cannot be " + what + ": " + std::strerror(errno));
}

/// Open for writing and reading. Some file systems have no O_TMPFILE.
int nameless_file(const std::string& folder) {
  const int file = open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);
  if (file >= 0) return file;
  std::string path = folder + "/rows.XXXXXX";
  const int named = mkostemp(path.data(), O_CLOEXEC);
  if (named >= 0) unlink(path.c_str());
  return named;
}

}  // namespace

SpoolFile::SpoolFile(const std::string& folder) : folder_(folder) {
  const int file = nameless_file(folder);
  if (file < 0) refuse(folder_, "written");
  file_.reset(fdopen(file, "w+b"));
  if (!file_) refuse(folder_, "written");
}

void SpoolFile::add(const void* bytes, std::size_t size) {
  if (std::fwrite(bytes, size, 1, file_.get()) != 1) refuse(folder_, "written");
}

void SpoolFile::rewind() {
  if (std::fseek(file_.get(), 0, SEEK_SET) != 0) refuse(folder_, "written");
}

bool SpoolFile::read(void* bytes, std::size_t size) {
  if (std::fread(bytes, size, 1, file_.get()) == 1) return true;
  if (std::ferror(file_.get()) != 0) refuse(folder_, "read");
  return false;
}

}  // namespace tetap::sim
