// SPDX-License-Identifier: Apache-2.0
#include "sim_host/play/out_file.hpp"

#include "sim_host/replay/line.hpp"
#include "sim_host/replay/sha256.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <random>
#include <stdexcept>
#include <string>

namespace tetap::sim {
namespace {

std::string sha(const std::string& text) {
  Sha256 hash;
  hash.add(text);
  return hash.hex();
}

TEST(Sha256, StandardVectors) {  // FIPS 180-4 examples, NIST CAVS
  EXPECT_EQ(sha(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(sha("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(sha("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"),
            "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
  EXPECT_EQ(sha(std::string(1'000'000, 'a')), "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

TEST(Sha256, TheCutsBetweenPiecesDoNotMatter) {
  std::mt19937_64 draw(3);
  for (std::size_t length = 0; length < 200; ++length) {
    const std::string text(length, 'x');
    Sha256 pieces;
    for (std::size_t at = 0; at < length;) {
      const std::size_t n = std::min<std::size_t>(draw() % 70, length - at);
      pieces.add(std::string_view(text).substr(at, n));
      at += n;
    }
    EXPECT_EQ(pieces.hex(), sha(text)) << length;
  }
}

TEST(Line, NumbersAreWhatPrintfWrites) {
  std::mt19937_64 draw(4);
  for (int i = 0; i < 20'000; ++i) {
    const int decimals = static_cast<int>(draw() % 5);
    const auto steps = static_cast<std::int64_t>(draw() % 2'000'000) - 1'000'000;
    const double value = static_cast<double>(steps) / std::pow(10.0, decimals);
    char expected[64];
    std::snprintf(expected, sizeof expected, "%.*f", decimals, value);
    Line line;
    line.real(value, decimals);
    EXPECT_EQ(line.view(), steps == 0 ? std::string(expected).substr(expected[0] == '-') : expected);
  }
}

TEST(Line, WhatIsNoNumberIsNothing) {
  Line line;
  line.real(std::nan(""), 3).real(std::numeric_limits<double>::infinity(), 3).real(-1e300, 3);
  EXPECT_EQ(line.view(), "");
  line.integer(std::numeric_limits<std::int64_t>::min()).put(' ').hex(0xAB, 4);
  EXPECT_EQ(line.view(), "-9223372036854775808 00AB");
}

TEST(Line, WhatDoesNotFitIsCut) {
  Line line;
  line.text(std::string(1000, 'a'));
  EXPECT_EQ(line.view().size(), 512U);
}

/// A folder of its own for each test.
class OutFileInAFolder : public testing::Test {
 protected:
  OutFileInAFolder() {
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  ~OutFileInAFolder() override { std::filesystem::remove_all(folder_); }

  [[nodiscard]] std::string path(const std::string& name) const { return (folder_ / name).string(); }
  void put(const std::string& name, const std::string& text) const { std::ofstream(path(name)) << text; }
  [[nodiscard]] std::string text_of(const std::string& name) const {
    std::ifstream file(path(name));
    return {std::istreambuf_iterator<char>(file), {}};
  }
  [[nodiscard]] std::size_t files() const {
    return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(folder_), {}));
  }

  std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() /
      ("tetap-" + std::to_string(getpid()) + "-" + testing::UnitTest::GetInstance()->current_test_info()->name());
};

TEST_F(OutFileInAFolder, HasItsNameOnceItIsWhole) {
  put("a.csv", "old");
  OutFile file(path("a.csv"));
  file.write("new");
  file.flush();
  EXPECT_EQ(text_of("a.csv"), "old");
  file.end();
  EXPECT_EQ(text_of("a.csv"), "old") << "others of the run may not be whole";
  file.publish();
  EXPECT_EQ(text_of("a.csv"), "new");
  EXPECT_EQ(files(), 1U) << "nothing is left aside";
}

TEST_F(OutFileInAFolder, ThatIsGivenUpLeavesTheOldOne) {
  put("a.csv", "old");
  { OutFile(path("a.csv")).write("half"); }
  EXPECT_EQ(text_of("a.csv"), "old");
}

TEST_F(OutFileInAFolder, ThatIsDiscardedLeavesNothingAside) {
  put("a.csv", "old");
  OutFile file(path("a.csv"));
  file.write("half");
  file.flush();
  file.discard();
  EXPECT_EQ(text_of("a.csv"), "old");
  EXPECT_EQ(files(), 1U);
}

TEST_F(OutFileInAFolder, NeverGoesThroughALink) {
  put("victim", "old");
  for (const char* planted : {"a.csv.part", "b.csv"}) {
    std::filesystem::create_symlink(path("victim"), path(planted));
    std::filesystem::create_hard_link(path("victim"), path("c.csv.part"));
    for (const char* name : {"a.csv", "c.csv"}) {
      OutFile file(path(name));
      file.write("new");
      file.close();
      EXPECT_EQ(text_of(name), "new");
      EXPECT_FALSE(std::filesystem::is_symlink(path(name)));
    }
    EXPECT_EQ(text_of("victim"), "old") << planted;
  }
  try {
    const OutFile file(path("b.csv"));
    FAIL() << "no error";
  } catch (const std::runtime_error& error) {
    EXPECT_EQ(error.what(), path("b.csv") + ": cannot be written: it is a link; name the file itself");
  }
  // Planted while the file is written: the link gives way to it.
  OutFile late(path("d.csv"));
  std::filesystem::create_symlink(path("victim"), path("d.csv"));
  late.write("new");
  late.close();
  EXPECT_FALSE(std::filesystem::is_symlink(path("d.csv")));
  EXPECT_EQ(text_of("victim"), "old");
}

TEST_F(OutFileInAFolder, HasAWriterAtATime) {
  {
    const FolderLock one(path("run"));
    try {
      const FolderLock other(path("run"));
      FAIL() << "two runs write into one folder";
    } catch (const std::runtime_error& error) {
      EXPECT_EQ(error.what(), path("run") + ": another run writes here; give this one another folder");
    }
    EXPECT_NO_THROW(FolderLock{path("run2")});
  }
  EXPECT_NO_THROW(FolderLock{path("run")});
}

TEST(OutFile, ThatIsADeviceIsWrittenAsItIs) {
  OutFile file("/dev/null");
  file.write("text");
  file.close();
  EXPECT_TRUE(std::filesystem::is_character_file("/dev/null"));
}

TEST(OutFile, AFullDiskIsAnError) {
  OutFile file("/dev/full");
  file.write("text");
  EXPECT_THROW(file.close(), std::runtime_error);
}

TEST(OutFile, AFolderThatCannotBeMadeIsNamed) {
  try {
    make_folder("/proc/nothing/here");
    FAIL() << "no error";
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("/proc/nothing/here: cannot be made"), std::string::npos);
  }
}

}  // namespace
}  // namespace tetap::sim
