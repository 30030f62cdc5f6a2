// SPDX-License-Identifier: Apache-2.0
#include "sim_host/emulator/chip.hpp"

#include "hal/chip/arm/cortex_m4.hpp"
#include "sim_host/emulator/flash_controller.hpp"

#include <algorithm>
#include <cstdio>

namespace tetap::board {

namespace m4 = hal::cortex_m4;

namespace {

std::string hex(std::uint32_t value) {
  char text[16];
  std::snprintf(text, sizeof text, "0x%08X", value);
  return text;
}

}  // namespace

Chip::Chip(const MemoryLayout& layout, std::span<const BusWindow> windows)
    : memory(layout), core(around_, clock, nvic), windows_(windows.begin(), windows.end()) {
  for (const BusWindow& one : windows_) map_.emplace_back(one.size / 0x400, nullptr);
}

void Chip::place(Peripheral& block, std::uint32_t size) {
  blocks_.push_back(&block);
  for (std::size_t i = 0; i < windows_.size(); ++i) {
    const std::uint32_t offset = block.base() - windows_[i].base;
    for (std::uint32_t at = 0; at < size && offset < windows_[i].size; at += 0x400)
      map_[i][(offset + at) / 0x400] = &block;
  }
}

void Chip::start() {
  clocks().on_change = [this] {
    if (clocks().hclk_hz() == clock.hz()) return;
    clock.change(scheduler.now(), clocks().hclk_hz());
    core.systick().replan();
  };
  core.on_reset_request = [this] { pending_reset = ResetCause::kSoftware; };
  clock.change(0, clocks().hclk_hz());
  clocks().add_reset_flags(ResetCause::kPowerOn);
}

Peripheral* Chip::find(std::uint32_t address) const {
  for (std::size_t i = 0; i < windows_.size(); ++i) {
    const std::uint32_t offset = address - windows_[i].base;
    if (offset < windows_[i].size) return map_[i][offset / 0x400];
  }
  return nullptr;
}

// Words are made for complaints alone: a polling loop comes here at each of its rounds.
bool Chip::check(const Peripheral& block, std::uint32_t address, int size, const char* verb) {
  const bool aligned = (address & static_cast<std::uint32_t>(size - 1)) == 0, takes = (block.widths() & size) != 0,
             clocked = clocks().clocked(block);
  if (aligned && takes && clocked) return true;
  const std::string where = std::string(verb) + " of " + std::to_string(size) + " bytes at " + hex(address);
  if (!aligned) {
    complaints.add(block.name(), "unaligned " + where);
    return false;
  }
  if (!takes) complaints.add(block.name(), where + ": the registers do not take this width");
  if (clocked) return true;
  complaints.add(block.name(), where + " without clock");
  return false;
}

bool Chip::read(std::uint32_t address, int size, std::uint32_t& value) {
  value = 0;
  const std::uint32_t inside = 8 * (address & 3);
  const std::uint32_t mask = size == 4 ? ~0U : (1U << 8 * size) - 1;
  if (address >= m4::kSystemControlSpace && address < m4::kSystemControlSpace + 0x1000) {
    value = core.read((address & ~3U) - m4::kSystemControlSpace) >> inside & mask;
    return true;
  }
  if (address >= m4::kDwt && address < m4::kDwt + 0x1000) {
    value = core.read_dwt((address & ~3U) - m4::kDwt) >> inside & mask;
    return true;
  }
  Peripheral* block = find(address);
  if (block == nullptr) {
    complaints.add("bus", "read at " + hex(address) + ": no modelled block is there");
    return false;
  }
  if (!check(*block, address, size, "read")) return true;
  value = block->read_part((address & ~3U) - block->base(), mask << inside) >> inside & mask;
  return true;
}

bool Chip::write(std::uint32_t address, int size, std::uint32_t value) {
  const std::uint32_t inside = 8 * (address & 3);
  const std::uint32_t mask = (size == 4 ? ~0U : (1U << 8 * size) - 1) << inside;
  value <<= inside;
  if (address >= m4::kSystemControlSpace && address < m4::kSystemControlSpace + 0x1000) {
    core.write((address & ~3U) - m4::kSystemControlSpace, value, mask);
    return true;
  }
  if (address >= m4::kDwt && address < m4::kDwt + 0x1000) {
    core.write_dwt((address & ~3U) - m4::kDwt, value);
    return true;
  }
  Peripheral* block = find(address);
  if (block == nullptr) {
    complaints.add("bus", "write at " + hex(address) + ": no modelled block is there");
    return false;
  }
  if (!check(*block, address, size, "write")) return true;
  block->write((address & ~3U) - block->base(), value, mask);
  return !block->take_bus_error();
}

void Chip::lose_power() {
  flash_controller().cut();
  pending_reset = ResetCause::kPowerOn;
}

void Chip::system_reset(ResetCause cause) {
  if (flash_controller().off()) cause = ResetCause::kPowerOn;  // whoever asked for a reset meanwhile
  if (cause == ResetCause::kPowerOn) {
    std::fill(memory.ram().begin(), memory.ram().end(), Memory::kAfterPowerOn);
    flash_controller().power_on();
  }
  for (Peripheral* block : blocks_) {
    if (block != &clocks()) block->reset();
  }
  core.reset();
  clocks().reset();
  clocks().add_reset_flags(cause);
  pending_reset.reset();
}

}  // namespace tetap::board
