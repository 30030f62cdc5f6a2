// SPDX-License-Identifier: Apache-2.0
// The header of a flash image, 92 bytes at 512: what it is for, and whether the file is whole. Its layout is in
// tools/python/tetap/image_header.py.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <string>

namespace tetap::sim {

/// One line: what is wrong with an image.
struct ImageRefused : std::runtime_error {
  using std::runtime_error::runtime_error;
};

struct ImageHeader {
  std::uint32_t crc = 0;      ///< CRC-32 of the image
  std::uint32_t commit = 0;   ///< first 28 bits of the commit, then 4: 1 where the tree differed from it
  std::uint32_t length = 0;   ///< bytes
  std::uint32_t address = 0;  ///< where the first byte belongs
  std::string board, robot;
};

/// The header of a whole image, the bytes of a .bin or .elf file; throws ImageRefused otherwise.
[[nodiscard]] ImageHeader read_image(std::span<const std::uint8_t> file);

}  // namespace tetap::sim
