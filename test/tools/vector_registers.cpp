// SPDX-License-Identifier: Apache-2.0
// Do vector registers stay what they are, while threads take turns and pages are touched for the first time? Status 0.
#include <immintrin.h>

#include <array>
#include <cstring>
#include <thread>
#include <vector>

namespace {

using Bytes = std::array<unsigned char, 64>;

/// Writes a page that was never touched, then reads the register back.
__attribute__((target("avx512f"), noinline)) Bytes held512(const Bytes& pattern, volatile char* page) {
  Bytes seen;
  __asm__ volatile(
      "vmovdqu64 %1, %%zmm20\n movb $1, %2\n mov $2000000, %%ecx\n 1: dec %%ecx\n jnz 1b\n vmovdqu64 %%zmm20, %0"
      : "=m"(seen)
      : "m"(pattern), "m"(*page)
      : "ecx", "xmm20", "memory");
  return seen;
}
__attribute__((target("avx"), noinline)) Bytes held256(const Bytes& pattern, volatile char* page) {
  Bytes seen = pattern;
  __asm__ volatile("vmovdqu %1, %%ymm7\n movb $1, %2\n mov $2000000, %%ecx\n 1: dec %%ecx\n jnz 1b\n vmovdqu %%ymm7, %0"
                   : "+m"(seen)
                   : "m"(pattern), "m"(*page)
                   : "ecx", "xmm7", "memory");
  return seen;
}

bool holds(unsigned char number) {
  Bytes pattern;
  pattern.fill(number);
  std::vector<char> pages;
  pages.reserve(200 * 4096);
  for (int i = 0; i < 200; ++i) {
    volatile char* page = pages.data() + 4096 * i;
    const Bytes seen = __builtin_cpu_supports("avx512f") ? held512(pattern, page) : held256(pattern, page);
    if (std::memcmp(seen.data(), pattern.data(), seen.size()) != 0) return false;
  }
  return true;
}

}  // namespace

int main() {
  if (!__builtin_cpu_supports("avx")) return 0;
  std::array<bool, 3> good{};
  std::vector<std::thread> threads;
  for (unsigned char i = 0; i < good.size(); ++i)
    threads.emplace_back([&good, i] { good[i] = holds(static_cast<unsigned char>(17 * i + 5)); });
  for (auto& thread : threads) thread.join();
  return good[0] && good[1] && good[2] ? 0 : 1;
}
