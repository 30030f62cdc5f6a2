// SPDX-License-Identifier: Apache-2.0
#include "sim_host/control/image_header.hpp"

#include "tetap/base/crc.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <optional>
#include <string_view>
#include <vector>

namespace tetap::sim {

namespace {

using Bytes = std::span<const std::uint8_t>;

constexpr std::size_t kOffset = 0x200, kSize = 92, kCrcAt = kOffset + 8, kName = 32;
constexpr std::uint32_t kLayout = 1, kMostBytes = 1U << 26, kUnfilled = 0xFFFF'FFFF;
constexpr std::string_view kMagic = "tetapIMG", kElf = "\177ELF";

std::uint32_t word(Bytes bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t i = 4; i-- > 0;) value = value << 8 | bytes[at + i];
  return value;
}

bool holds(Bytes bytes, std::size_t at, std::string_view text) {
  return bytes.size() >= at + text.size() &&
         std::equal(text.begin(), text.end(), bytes.begin() + static_cast<std::ptrdiff_t>(at),
                    [](char a, std::uint8_t b) { return static_cast<std::uint8_t>(a) == b; });
}

std::string hex(std::uint32_t value) {
  std::array<char, 16> text{};
  std::snprintf(text.data(), text.size(), "0x%08x", value);
  return text.data();
}

struct Image {
  std::optional<std::uint32_t> address;
  std::vector<std::uint8_t> bytes;
};

struct Segment {
  std::uint32_t address, offset, size;
};

std::vector<Segment> segments(Bytes elf) {
  constexpr std::size_t kHeader = 52, kEntry = 32;
  const ImageRefused cut("the ELF file is cut in its headers");
  if (elf.size() < kHeader) throw cut;
  if ((word(elf, 16) >> 16) != 40) throw ImageRefused("not an ELF file for ARM");
  const std::size_t start = word(elf, 28), size = word(elf, 40) >> 16, count = word(elf, 44) & 0xFFFF;
  std::vector<Segment> stored;
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t at = start + i * size;
    if (at + kEntry > elf.size()) throw cut;
    const Segment one{word(elf, at + 12), word(elf, at + 4), word(elf, at + 16)};
    if (word(elf, at) == 1 && one.size != 0) stored.push_back(one);
  }
  if (stored.empty()) throw ImageRefused("the ELF file stores nothing");
  return stored;
}

/// Bytes that an ELF file stores, as objcopy -O binary writes it.
Image flattened(Bytes elf) {
  const std::vector<Segment> all = segments(elf);
  std::uint64_t first = all.front().address, end = 0;
  for (const Segment& one : all) {
    first = std::min<std::uint64_t>(first, one.address);
    end = std::max(end, std::uint64_t{one.address} + one.size);
  }
  if (end - first > kMostBytes) throw ImageRefused("the ELF file stores more than 64 MB");
  Image image{static_cast<std::uint32_t>(first), std::vector<std::uint8_t>(end - first)};
  for (const Segment& one : all) {
    if (std::uint64_t{one.offset} + one.size > elf.size())
      throw ImageRefused("the ELF file is cut: " + std::to_string(elf.size()) + " bytes of at least " +
                         std::to_string(std::uint64_t{one.offset} + one.size));
    std::copy_n(elf.begin() + one.offset, one.size,
                image.bytes.begin() + static_cast<std::ptrdiff_t>(one.address - first));
  }
  return image;
}

std::uint32_t crc_of(Bytes image) {
  constexpr std::array<std::uint8_t, 4> kBlank{0xFF, 0xFF, 0xFF, 0xFF};
  base::Crc32 crc;
  crc.add(image.first(kCrcAt));
  crc.add(kBlank);
  crc.add(image.subspan(kCrcAt + kBlank.size()));
  return crc.value();
}

/// Empty: no name of a-z, 0-9 and _ with zeros behind it.
std::string name_at(Bytes image, std::size_t at) {
  const Bytes field = image.subspan(at, kName);
  const auto end = std::find(field.begin(), field.end(), 0);
  const std::string name(field.begin(), end);
  const bool plain = name.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789_") == std::string::npos;
  const bool ended = end != field.end() && std::all_of(end, field.end(), [](std::uint8_t byte) { return byte == 0; });
  return plain && ended ? name : "";
}

}  // namespace

ImageHeader read_image(Bytes file) {
  const Image found = holds(file, 0, kElf) ? flattened(file) : Image{std::nullopt, {file.begin(), file.end()}};
  const Bytes image = found.bytes;
  const std::string bytes = std::to_string(image.size()) + " bytes";
  if (!holds(image, kOffset, kMagic))
    throw ImageRefused(bytes + " without an image header: cut, or no image of this project");
  if (image.size() < kOffset + kSize) throw ImageRefused("cut inside the image header: " + bytes);
  if (word(image, kOffset + 16) == kUnfilled) throw ImageRefused("its image header was never filled: link it again");
  if (const std::uint32_t layout = word(image, kOffset + 16); layout != kLayout)
    throw ImageRefused("image header of layout " + std::to_string(layout) + ", known is " + std::to_string(kLayout));
  const ImageHeader header{.crc = word(image, kCrcAt),
                           .commit = word(image, kOffset + 12),
                           .length = word(image, kOffset + 20),
                           .address = word(image, kOffset + 24),
                           .board = name_at(image, kOffset + 28),
                           .robot = name_at(image, kOffset + 28 + kName)};
  if (header.length != image.size())
    throw ImageRefused(bytes + ", its header says " + std::to_string(header.length) + ": cut or joined");
  if (header.crc != crc_of(image))
    throw ImageRefused("damaged: CRC-32 " + hex(crc_of(image)) + ", its header says " + hex(header.crc));
  if (header.board.empty() || header.robot.empty() || found.address.value_or(header.address) != header.address)
    throw ImageRefused("its header names no board, robot or address");
  return header;
}

}  // namespace tetap::sim
