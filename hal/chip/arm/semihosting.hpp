// SPDX-License-Identifier: Apache-2.0
// Exit status, arguments and files of the computer that runs the emulator. "Semihosting for AArch32 and AArch64" (ARM
// IHI 0092), chapter 6.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace tetap::hal::mps2::semihosting {

inline std::uint32_t call(std::uint32_t operation, const void* block) {
  register std::uint32_t r0 asm("r0") = operation;
  register const void* r1 asm("r1") = block;
  asm volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
  return r0;
}

/// Ends the emulator with this exit status (SYS_EXIT_EXTENDED, ADP_Stopped_ApplicationExit).
[[noreturn]] inline void exit(int status) {
  const std::uint32_t block[] = {0x20026, static_cast<std::uint32_t>(status)};
  for (;;) call(0x20, block);
}

inline constexpr std::uint32_t kNoFile = ~0U;
enum class Mode : std::uint32_t { kRead = 1, kWrite = 5 };  // binary, as fopen's "rb" and "wb"

[[nodiscard]] inline std::uint32_t open(const char* path, Mode mode) {
  std::uint32_t length = 0;
  while (path[length] != '\0') ++length;
  const std::uint32_t block[] = {reinterpret_cast<std::uintptr_t>(path), static_cast<std::uint32_t>(mode), length};
  return call(0x01, block);
}

/// Bytes read; 0 at the end of the file.
[[nodiscard]] inline std::size_t read(std::uint32_t file, void* into, std::size_t size) {
  const std::uint32_t block[] = {file, reinterpret_cast<std::uintptr_t>(into), size};
  const std::uint32_t missing = call(0x06, block);
  return missing <= size ? size - missing : 0;
}

[[nodiscard]] inline bool write(std::uint32_t file, const void* from, std::size_t size) {
  const std::uint32_t block[] = {file, reinterpret_cast<std::uintptr_t>(from), size};
  return call(0x05, block) == 0;
}

[[nodiscard]] inline bool close(std::uint32_t file) {
  const std::uint32_t block[] = {file};
  return call(0x02, block) == 0;
}

/// The words given to the emulator for the image, one space between them; empty when it gave none or they do not fit.
template <std::size_t N>
struct CommandLine {
  char text[N] = {};

  CommandLine() {
    std::uint32_t block[] = {reinterpret_cast<std::uintptr_t>(text), N};
    if (call(0x15, block) != 0) text[0] = '\0';
  }
  /// The first Count words (the image's path is one), null where there are fewer. Cuts `text` at the spaces.
  template <std::size_t Count>
  [[nodiscard]] std::array<const char*, Count> words() {
    std::array<const char*, Count> found{};
    for (std::size_t i = 0, n = 0; i < N && text[i] != '\0'; ++i) {
      const bool begins = text[i] != ' ' && (i == 0 || text[i - 1] == '\0');
      if (begins && n < Count) found[n++] = &text[i];
      if (text[i] == ' ') text[i] = '\0';
      if (text[i] == '\0' && i + 1 < N && text[i + 1] == '\0') break;
    }
    return found;
  }
};

}  // namespace tetap::hal::mps2::semihosting
