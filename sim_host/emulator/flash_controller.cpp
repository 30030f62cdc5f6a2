// SPDX-License-Identifier: Apache-2.0
#include "sim_host/emulator/flash_controller.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <vector>

namespace tetap::board {

namespace {
constexpr std::size_t kEntry = 5;  // bytes of a damaged double word in a file
}

bool KeyLock::write(std::uint32_t key) {
  if (state_ == State::kLocked && key == first_) {
    state_ = State::kHalf;
  } else if (state_ == State::kHalf && key == second_) {
    state_ = State::kOpen;
  } else {
    state_ = State::kStuck;
  }
  return state_ != State::kStuck;
}

FlashController::FlashController(Surroundings around, std::uint32_t base, Memory& memory, std::uint32_t bank_size)
    : Peripheral(around, "FLASH", base, kBytes),
      memory_(memory),
      bank_size_(bank_size),
      done_(around.scheduler, [this] { finish(); }) {}

std::uint32_t FlashController::offset_of(std::uint32_t address) const {
  return memory_.resolve(address) - Memory::kFlash;
}

std::uint64_t FlashController::content(std::uint32_t offset, unsigned size) const {
  std::uint64_t value = 0;
  const auto bytes = memory_.readable(Memory::kFlash + offset, size);
  if (!bytes.empty()) std::memcpy(&value, bytes.data(), size);
  return value;
}

void FlashController::set_content(std::uint32_t offset, unsigned size, std::uint64_t value) {
  std::memcpy(memory_.flash().data() + offset, &value, size);
}

void FlashController::fill_ones(const Operation& operation) {
  const auto bytes = memory_.flash().subspan(operation.offset, operation.size);
  std::fill(bytes.begin(), bytes.end(), std::byte{0xFF});
}

// RM0402: "Any wrong sequence will return a bus error and lock up the FLASH_CR register until the next reset." RM0440
// agrees.
void FlashController::take_key(KeyLock& lock, std::uint32_t key) {
  if (lock.write(key)) return;
  complain("wrong key: locked until the next reset");
  bus_error();
}

bool FlashController::opens_cr(std::uint32_t set, std::uint32_t locks) {
  await_idle();  // the bus stalls
  if (off()) return false;
  if (!lock_.locked()) return true;
  if ((set & ~locks) != 0) complain("FLASH_CR written while LOCK = 1");
  return false;
}

std::uint64_t FlashController::load(std::uint32_t address, unsigned size) {
  if (busy_until(address) != 0) await_idle();
  return content(offset_of(address), size);
}

std::pair<std::uint32_t, std::uint32_t> FlashController::busy_range() const {
  if (!busy()) return {0, 0};
  const std::uint32_t first = operation_.offset / bank_size_ * bank_size_;
  const std::uint32_t end = (operation_.offset + operation_.size - 1) / bank_size_ * bank_size_ + bank_size_;
  return {first, end - first};
}

Picoseconds FlashController::busy_until(std::uint32_t address) const {
  const auto [first, size] = busy_range();
  return offset_of(address) - first < size ? done_.at() : 0;
}

void FlashController::begin(const Operation& operation, const Duration& duration) {
  operation_ = operation;
  const bool fourfold = pace == Pace::kFourfold && operation.erase;
  const Picoseconds time = pace == Pace::kTypical ? duration.typical
                           : fourfold             ? 4 * duration.typical
                                                  : duration.maximum;
  done_.set(now() + time);
  if (on_range) on_range();
}

void FlashController::await_idle() {
  if (busy()) scheduler().advance(done_.at());
}

void FlashController::finish() {
  complete(operation_);
  if (on_range) on_range();
}

// Draws follow from the seed and the count of interrupted operations.
void FlashController::interrupt() {
  if (!busy()) return;
  done_.clear();
  base::Random random(seed, interrupted_++);
  tear(operation_, random);
  if (on_range) on_range();
}

void FlashController::reset() {
  interrupt();
  reset_registers();
}

void FlashController::cut() {
  interrupt();
  off_ = true;
}

void FlashController::written(std::uint32_t offset, std::uint32_t size) {
  if (size == 0) return;
  damaged_.erase(damaged_.lower_bound(offset / 8), damaged_.upper_bound((offset + size - 1) / 8));
  if (on_range) on_range();
}

std::string FlashController::save(const std::string& path) const {
  const std::string fresh = path + ".new";
  std::remove(fresh.c_str());
  std::FILE* const out = std::fopen(fresh.c_str(), "wbx");  // never through a link
  if (out == nullptr) return fresh + ": cannot be written";
  const auto bytes = memory_.readable(Memory::kFlash, memory_.flash_size());
  bool fine = std::fwrite(bytes.data(), 1, bytes.size(), out) == bytes.size();
  for (const auto& [index, check] : damaged_) {
    std::array<std::uint8_t, kEntry> entry{};
    std::memcpy(entry.data(), &index, 4);
    entry[4] = check;
    fine = fine && std::fwrite(entry.data(), 1, kEntry, out) == kEntry;
  }
  fine = std::fclose(out) == 0 && fine;
  std::error_code failed;
  if (fine) std::filesystem::rename(fresh, path, failed);
  return fine && !failed ? "" : path + ": cannot be written";
}

std::string FlashController::restore(const std::string& path) {
  std::FILE* const in = std::fopen(path.c_str(), "rb");
  if (in == nullptr) return path + ": cannot be opened";
  std::vector<std::byte> file(memory_.flash_size() + (kEntry * memory_.flash_size() / 8) + 1);
  file.resize(std::fread(file.data(), 1, file.size(), in));
  std::fclose(in);
  if (file.size() < memory_.flash_size() || (file.size() - memory_.flash_size()) % kEntry != 0)
    return path + ": " + std::to_string(file.size()) + " bytes are no flash of " +
           std::to_string(memory_.flash_size()) + " bytes";
  std::memcpy(memory_.flash().data(), file.data(), memory_.flash_size());
  damaged_.clear();
  for (std::size_t at = memory_.flash_size(); at < file.size(); at += kEntry) {
    std::uint32_t index = 0;
    std::memcpy(&index, file.data() + at, 4);
    if (index >= memory_.flash_size() / 8) return path + ": a damaged double word lies behind the flash";
    damaged_[index] = std::to_integer<std::uint8_t>(file[at + 4]);
  }
  if (on_range) on_range();
  return {};
}

}  // namespace tetap::board
