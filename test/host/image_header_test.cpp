// SPDX-License-Identifier: Apache-2.0
// The header of a flash image: a whole one is read, and no damage to any byte goes by. The CRC-32 is a shift register
// of its own here.
#include "sim_host/control/image_header.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

namespace tetap::sim {
namespace {

using Bytes = std::vector<std::uint8_t>;

void put_word(Bytes& to, std::size_t at, std::uint32_t word) {
  for (int i = 0; i < 4; ++i) to[at + static_cast<std::size_t>(i)] = static_cast<std::uint8_t>(word >> 8 * i);
}

std::uint32_t shifted_crc(const Bytes& image) {
  std::uint32_t state = ~0U;
  for (std::size_t at = 0; at < image.size(); ++at) {
    state ^= at >= 0x208 && at < 0x20C ? 0xFFU : image[at];
    for (int bit = 0; bit < 8; ++bit) state = state >> 1 ^ ((state & 1) != 0 ? 0xEDB8'8320U : 0U);
  }
  return ~state;
}

void seal(Bytes& image) { put_word(image, 0x208, shifted_crc(image)); }

Bytes small_image() {
  Bytes image(700);
  for (std::size_t at = 0; at < image.size(); ++at) image[at] = static_cast<std::uint8_t>(at * 7);
  std::fill_n(image.begin() + 0x200, 92, std::uint8_t{0});
  const std::string magic = "tetapIMG", board = "ark_cannode", robot = "rover";
  std::copy(magic.begin(), magic.end(), image.begin() + 0x200);
  put_word(image, 0x20C, 0xABCD'EF11);
  put_word(image, 0x210, 1);
  put_word(image, 0x214, 700);
  put_word(image, 0x218, 0x0801'0000);
  std::copy(board.begin(), board.end(), image.begin() + 0x21C);
  std::copy(robot.begin(), robot.end(), image.begin() + 0x23C);
  seal(image);
  return image;
}

Bytes elf_of(const Bytes& image, std::uint32_t address) {
  Bytes elf(52 + 2 * 32 + image.size());
  const std::string magic = "\177ELF\1\1\1";
  std::copy(magic.begin(), magic.end(), elf.begin());
  put_word(elf, 16, 40U << 16 | 2);
  put_word(elf, 28, 52);
  put_word(elf, 40, 32U << 16 | 52);
  put_word(elf, 44, 2);
  const auto half = static_cast<std::uint32_t>(image.size() / 2);
  for (const std::uint32_t part : {0U, 1U}) {  // the second half stands first
    const std::size_t at = 52 + 32 * part;
    const std::uint32_t from = part == 0 ? half : 0;
    put_word(elf, at, 1);
    put_word(elf, at + 4, 116 + from);
    put_word(elf, at + 8, 0x2000'0000);
    put_word(elf, at + 12, address + from);
    put_word(elf, at + 16, half);
  }
  std::copy(image.begin(), image.end(), elf.begin() + 116);
  return elf;
}

std::string refusal(const Bytes& file) {
  try {
    (void)read_image(file);
    return {};
  } catch (const ImageRefused& refused) {
    return refused.what();
  }
}

TEST(ImageHeader, NamesWhatAWholeImageIsFor) {
  for (const Bytes& file : {small_image(), elf_of(small_image(), 0x0801'0000)}) {
    const ImageHeader header = read_image(file);
    EXPECT_EQ(header.board, "ark_cannode");
    EXPECT_EQ(header.robot, "rover");
    EXPECT_EQ(header.commit, 0xABCD'EF11U);
    EXPECT_EQ(header.length, 700U);
    EXPECT_EQ(header.address, 0x0801'0000U);
  }
}

TEST(ImageHeader, RefusesAFileThatIsCutAnywhere) {
  const Bytes image = small_image(), elf = elf_of(image, 0x0801'0000);
  for (const Bytes& whole : {image, elf}) {
    for (std::size_t length = 0; length < whole.size(); ++length)
      EXPECT_NE(refusal({whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(length)}), "") << length;
  }
  Bytes longer = image;
  longer.push_back(0);
  EXPECT_EQ(refusal(longer), "701 bytes, its header says 700: cut or joined");
  EXPECT_NE(refusal({image.begin(), image.begin() + 0x240}).find("cut inside the image header"), std::string::npos);
}

TEST(ImageHeader, RefusesAFlipOfAnyBit) {
  const Bytes whole = small_image();
  for (std::size_t bit = 0; bit < 8 * whole.size(); ++bit) {
    Bytes forged = whole;
    forged[bit / 8] = static_cast<std::uint8_t>(forged[bit / 8] ^ 1U << bit % 8);
    EXPECT_NE(refusal(forged), "") << bit;
  }
}

TEST(ImageHeader, RefusesEveryForgedFieldWithACrcThatFits) {
  struct Case {
    std::size_t at;
    std::uint32_t word;
    const char* says;
  };
  for (const Case& one :
       {Case{0x200, 0, "without an image header"}, Case{0x210, 2, "layout 2, known is 1"},
        Case{0x210, 0xFFFF'FFFF, "never filled"}, Case{0x214, 699, "its header says 699"},
        Case{0x21C, 0, "names no board"}, Case{0x21C, 0x2041'4242, "names no board"},
        Case{0x238, 0x7878'7878, "names no board"}, Case{0x23C, 0, "robot"}, Case{0x244, 0x6161'6161, "robot"}}) {
    Bytes forged = small_image();
    put_word(forged, one.at, one.word);
    seal(forged);
    EXPECT_NE(refusal(forged).find(one.says), std::string::npos) << one.at << ": " << refusal(forged);
  }
  Bytes forged = small_image();
  put_word(forged, 0x208, 0x1234'5678);
  EXPECT_NE(refusal(forged).find("its header says 0x12345678"), std::string::npos);
  EXPECT_NE(refusal(elf_of(small_image(), 0x0800'0000)).find("address"), std::string::npos);
}

TEST(ImageHeader, RefusesElfFilesThatAreNone) {
  const Bytes whole = elf_of(small_image(), 0x0801'0000);
  const auto forged = [&](std::size_t at, std::uint32_t word) {
    Bytes file = whole;
    put_word(file, at, word);
    return refusal(file);
  };
  EXPECT_EQ(forged(16, 62U << 16 | 2), "not an ELF file for ARM");
  EXPECT_EQ(forged(44, 0), "the ELF file stores nothing");
  EXPECT_EQ(forged(28, 0xFFFF'FFF0), "the ELF file is cut in its headers");
  EXPECT_EQ(forged(52 + 12, 0xFFFF'0000), "the ELF file stores more than 64 MB");
  EXPECT_NE(forged(52 + 4, 0xFFFF'FFF0).find("the ELF file is cut: "), std::string::npos);
}

}  // namespace
}  // namespace tetap::sim
