// SPDX-License-Identifier: Apache-2.0
#include "sim_host/emulator/machine.hpp"

#include "hal/chip/arm/cortex_m4.hpp"
#include "sim_host/emulator/thumb.hpp"

#include <unicorn/unicorn.h>

#include <algorithm>
#include <cstdio>
#include <cstring>

namespace tetap::board {

namespace m4 = hal::cortex_m4;

namespace {

constexpr std::uint32_t kNowhere = 0xFFFF'FFFE;                            // an address that execution never reaches
constexpr int kSupervisorCall = 2, kBreakpoint = 7, kExceptionReturn = 8;  // Unicorn 2.0.1: numbers of UC_HOOK_INTR
constexpr std::uint32_t kPage = 0x400;                                     // smallest page of the engine for this core
constexpr int kStorm = 1000;  // entries in a row that only an uncleared interrupt explains

constexpr std::uint32_t kCpacr = m4::kSystemControlSpace + m4::scb::kCpacr;

// Code of upsets lies at the end of the SRAM, which no image of this board reaches.
constexpr std::uint32_t kUpsetBytes = 16, kUpsetArea = 0x100;

// Thumb encodings: ARM DDI 0403E.e A7.7. 0x60000000 is the external memory of chips that have more pins.
std::vector<std::uint16_t> upset_code(Upset what) {
  constexpr std::uint16_t kForEver = 0xE7FE;                              // b .
  constexpr std::uint16_t kNowhereHigh = 0x2060, kNowhereShift = 0x0600;  // movs r0, #0x60; lsls r0, r0, #24
  switch (what) {
    case Upset::kStackOverflow:
      return {0xB4FF, 0xE7FD};  // 1: push {r0-r7}; b 1b
    case Upset::kBadRead:
      return {kNowhereHigh, kNowhereShift, 0x6801, kForEver};  // ldr r1, [r0]
    case Upset::kBadJump:
      return {kNowhereHigh, kNowhereShift, 0x3001, 0x4700};  // adds r0, #1; bx r0
    case Upset::kUndefinedInstruction:
      return {0xDE00, kForEver};  // udf #0
    case Upset::kUnalignedAccess:
      return {0xE9D0, 0x1200, kForEver};  // ldrd r1, r2, [r0]
    case Upset::kFloatingPointOff:
      return {0xEE30, 0x0A00, kForEver};  // vadd.f32 s0, s0, s0
    case Upset::kEndlessLoop:
      break;
  }
  return {kForEver};
}

std::string hex(std::uint32_t value) {
  char text[16];
  std::snprintf(text, sizeof text, "0x%08X", value);
  return text;
}

}  // namespace

/// The engine's call-backs.
struct Machine::Engine {
  static Machine& of(void* user) { return *static_cast<Machine*>(user); }
  static void block(uc_engine*, std::uint64_t address, std::uint32_t size, void* user) {
    of(user).on_block(static_cast<std::uint32_t>(address), size);
  }
  static void code(uc_engine*, std::uint64_t address, std::uint32_t size, void* user) {
    of(user).on_instruction(static_cast<std::uint32_t>(address), size);
  }
  static void interrupt(uc_engine* uc, std::uint32_t number, void* user) {
    of(user).engine_interrupt_ = static_cast<int>(number);
    uc_emu_stop(uc);
  }
  static bool invalid_memory(uc_engine*, uc_mem_type, std::uint64_t address, int, std::int64_t, void* user) {
    of(user).bad_address_ = static_cast<std::uint32_t>(address);
    return false;
  }
  static bool invalid_instruction(uc_engine*, void* user) {
    of(user).bad_instruction_ = true;
    return false;
  }
  template <std::uint32_t kBase>
  static std::uint64_t read(uc_engine*, std::uint64_t offset, unsigned size, void* user) {
    return of(user).on_read(kBase + static_cast<std::uint32_t>(offset), size);
  }
  template <std::uint32_t kBase>
  static void write(uc_engine*, std::uint64_t offset, unsigned size, std::uint64_t value, void* user) {
    of(user).on_write(kBase + static_cast<std::uint32_t>(offset), size, value);
  }
  static std::uint64_t guard_read(uc_engine*, std::uint64_t offset, unsigned size, void* user) {
    return of(user).on_guard_read(of(user).guard_pages_.front() + static_cast<std::uint32_t>(offset), size);
  }
  static bool flash_store(uc_engine*, uc_mem_type, std::uint64_t address, int size, std::int64_t value, void* user) {
    return of(user).on_flash_store(static_cast<std::uint32_t>(address), static_cast<unsigned>(size),
                                   static_cast<std::uint64_t>(value));
  }
  static std::uint64_t flash_read(uc_engine*, std::uint64_t offset, unsigned size, void* user) {
    const auto& window = *static_cast<FlashWindow*>(user);
    return window.machine->on_flash_read(window.base + static_cast<std::uint32_t>(offset), size);
  }
  static void flash_write(uc_engine*, std::uint64_t offset, unsigned size, std::uint64_t value, void* user) {
    const auto& window = *static_cast<FlashWindow*>(user);
    (void)window.machine->on_flash_store(window.base + static_cast<std::uint32_t>(offset), size, value);
    window.machine->stored_.clear();  // nothing was written but by the controller
  }
  static void guard_write(uc_engine*, std::uint64_t offset, unsigned size, std::uint64_t value, void* user) {
    of(user).on_guard_write(of(user).guard_pages_.front() + static_cast<std::uint32_t>(offset), size, value);
  }
};

Machine::Machine(Chip& chip, MachineOptions options)
    : chip_(chip),
      options_(options),
      flash_blocks_(chip.memory.flash_size() / 2),
      ram_blocks_(chip.memory.ram_size() / 2),
      flash_(chip.flash_controller()) {
  power_on();
}

Machine::~Machine() { uc_close(uc_); }

void Machine::power_on() {
  bool fine = uc_open(UC_ARCH_ARM, static_cast<uc_mode>(UC_MODE_THUMB | UC_MODE_MCLASS), &uc_) == UC_ERR_OK;
  fine = fine && uc_ctl_set_cpu_model(uc_, UC_CPU_ARM_CORTEX_M4) == UC_ERR_OK;
  const auto map = [&](std::uint32_t base, std::span<std::byte> bytes, std::uint32_t rights) {
    fine = fine && uc_mem_map_ptr(uc_, base, bytes.size(), rights, bytes.data()) == UC_ERR_OK;
  };
  map(0, chip_.memory.flash(), UC_PROT_READ | UC_PROT_EXEC);
  map(Memory::kFlash, chip_.memory.flash(), UC_PROT_READ | UC_PROT_EXEC);
  map(Memory::kRam, chip_.memory.ram(), UC_PROT_ALL);
  if (chip_.memory.layout().alias_size != 0) map(chip_.memory.layout().alias, chip_.memory.aliased(), UC_PROT_ALL);
  for (const BusWindow& window : chip_.windows()) {
    if (window.base == 0x4800'0000) {
      fine = fine && uc_mmio_map(uc_, window.base, window.size, Engine::read<0x4800'0000>, this,
                                 Engine::write<0x4800'0000>, this) == UC_ERR_OK;
    } else {
      fine = fine && window.base == 0x4000'0000 &&
             uc_mmio_map(uc_, window.base, window.size, Engine::read<0x4000'0000>, this, Engine::write<0x4000'0000>,
                         this) == UC_ERR_OK;
    }
  }
  fine = fine && uc_mmio_map(uc_, 0xE000'0000, 0x10'0000, Engine::read<0xE000'0000>, this, Engine::write<0xE000'0000>,
                             this) == UC_ERR_OK;
  const auto hook = [&](int type, auto* function) {
    uc_hook handle = 0;
    fine = fine && uc_hook_add(uc_, &handle, type, reinterpret_cast<void*>(function), this, 1, 0) == UC_ERR_OK;
  };
  hook(UC_HOOK_BLOCK, &Engine::block);
  if (options_.check_alignment) hook(UC_HOOK_CODE, &Engine::code);
  hook(UC_HOOK_INTR, &Engine::interrupt);
  hook(UC_HOOK_MEM_INVALID, &Engine::invalid_memory);
  hook(UC_HOOK_INSN_INVALID, &Engine::invalid_instruction);
  hook(UC_HOOK_MEM_WRITE_PROT, &Engine::flash_store);
  if (!fine) chip_.complaints.add("machine", "the engine cannot be set up");
  chip_.core.on_mpu_change = [this] { apply_mpu(); };
  flash_.on_range = [this] {
    flash_busy_ = flash_.busy();
    flash_changed_ = true;
  };
}

void Machine::load(std::uint32_t address, std::span<const std::byte> bytes) {
  copy(address, bytes);
  reset_core();
}

void Machine::copy(std::uint32_t address, std::span<const std::byte> bytes) {
  if (address < Memory::kFlash || address - Memory::kFlash + bytes.size() > chip_.memory.flash_size()) {
    return chip_.complaints.add("machine", "image does not fit into the flash at " + hex(address));
  }
  std::memcpy(chip_.memory.flash().data() + (address - Memory::kFlash), bytes.data(), bytes.size());
  flash_.written(address - Memory::kFlash, static_cast<std::uint32_t>(bytes.size()));
  image_ = std::min(image_, address);
}

std::string Machine::load_elf(const std::string& path) {
  std::vector<std::byte> file;
  std::FILE* in = std::fopen(path.c_str(), "rb");
  if (in == nullptr) return path + ": cannot be opened";
  std::byte buffer[1 << 14];
  for (std::size_t n; (n = std::fread(buffer, 1, sizeof buffer, in)) > 0;) file.insert(file.end(), buffer, buffer + n);
  std::fclose(in);
  const auto half = [&](std::size_t at) {
    return std::to_integer<std::uint32_t>(file[at]) | std::to_integer<std::uint32_t>(file[at + 1]) << 8;
  };
  const auto word = [&](std::size_t at) { return half(at) | half(at + 2) << 16; };
  if (file.size() < 52 || std::memcmp(file.data(), "\177ELF\1\1", 6) != 0 || half(18) != 40) {
    return path + ": not an ELF file for 32-bit ARM";
  }
  const std::size_t headers = word(28), entry_size = half(42), count = half(44);
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t at = headers + i * entry_size;
    if (at + 32 > file.size()) return path + ": program headers end behind the file";
    const std::size_t offset = word(at + 4), size = word(at + 16);
    if (word(at) != 1 || size == 0) continue;
    const std::uint32_t physical = word(at + 12);
    if (offset + size > file.size()) return path + ": a segment ends behind the file";
    if (physical < Memory::kFlash || physical - Memory::kFlash + size > chip_.memory.flash_size()) {
      return path + ": a segment at " + hex(physical) + " is not in the flash";
    }
    copy(physical, std::span(file).subspan(offset, size));
  }
  reset_core();
  return {};
}

std::uint32_t Machine::reg(int id) const {
  std::uint32_t value = 0;
  uc_reg_read(uc_, id, &value);
  return value;
}

void Machine::set_reg(int id, std::uint32_t value) { uc_reg_write(uc_, id, &value); }

std::uint32_t Machine::program_counter() const { return program_counter_; }

std::uint16_t Machine::half_word(std::uint32_t address) const {
  const auto bytes = chip_.memory.readable(chip_.memory.resolve(address), 2);
  std::uint16_t value = 0;
  if (!bytes.empty()) std::memcpy(&value, bytes.data(), 2);
  return value;
}

Masks Machine::masks() const {
  return {(reg(UC_ARM_REG_PRIMASK) & 1) != 0, (reg(UC_ARM_REG_FAULTMASK) & 1) != 0,
          static_cast<int>(reg(UC_ARM_REG_BASEPRI))};
}

// B1.5.5: main stack pointer and program counter from the vector table, thread mode, masks off. An image that lies
// behind a boot loader is entered as from one: VTOR is still 0 then, and the image has to set it.
void Machine::reset_core() {
  std::uint32_t stack = 0, start = 0;
  const std::uint32_t table = image_ == kNowhere ? Memory::kFlash : image_;
  (void)chip_.memory.read_word(table, stack);
  (void)chip_.memory.read_word(table + 4, start);
  set_reg(UC_ARM_REG_XPSR, 0x0100'0000);
  for (const int id : {UC_ARM_REG_PRIMASK, UC_ARM_REG_FAULTMASK, UC_ARM_REG_BASEPRI, UC_ARM_REG_CONTROL})
    set_reg(id, 0);
  for (int id = UC_ARM_REG_R0; id <= UC_ARM_REG_R12; ++id) set_reg(id, 0xDEAD'0000);
  set_reg(UC_ARM_REG_SP, stack);
  set_reg(UC_ARM_REG_LR, 0xFFFF'FFFF);
  program_counter_ = start & ~1U;
  sleeping_ = locked_up_ = false;
  pending_fault_ = {};
  active_.clear();
  storm_count_ = 0;
  if ((start & 1) == 0) fault(exception::kHardFault, m4::scb::kInvstate.mask(), false, 0);
}

const Machine::BlockInfo& Machine::block_info(std::uint32_t address, std::uint32_t size) {
  const std::uint32_t in_flash = address - Memory::kFlash;
  if (in_flash < chip_.memory.flash_size() && flash_blocks_[in_flash / 2].size == size)
    return flash_blocks_[in_flash / 2];
  const bool in_ram = chip_.memory.in_ram(address);
  const std::uint32_t offset = chip_.memory.resolve(address) - (in_ram ? Memory::kRam : Memory::kFlash);
  auto& blocks = in_ram ? ram_blocks_ : flash_blocks_;
  BlockInfo& info = blocks[std::min<std::size_t>(offset / 2, blocks.size() - 1)];
  if (info.size == size && !in_ram) return info;
  info = {static_cast<std::uint16_t>(size), 0, false};
  for (std::uint32_t at = address; at < address + size;) {
    const std::uint16_t first = half_word(at);
    if (thumb::wide(first))
      info.floating_point = info.floating_point || thumb::floating_point(first, half_word(at + 2));
    at += thumb::wide(first) ? 4 : 2;
    ++info.instructions;
  }
  return info;
}

// Alarms that are due run while the engine waits in its hook: most of them ask nothing of the core, and a stop of
// the engine is dear.
bool Machine::has_to_stop() {
  if (hundredths_ >= stop_hundredths_) {
    synchronise();
    chip_.clock.settle(cycles());
    plan_stop(until_);
  }
  return hundredths_ >= stop_hundredths_ || (chip_.nvic.waiting() && chip_.nvic.next(masks()) != 0) ||
         chip_.pending_reset.has_value() || pending_fault_.number != 0 || stalled_until_ > chip_.scheduler.now() ||
         upset_due();
}

void Machine::on_block(std::uint32_t address, std::uint32_t size) {
  undo_stores();
  if (!first_block_ && (has_to_stop() || flash_changed_ || fetch_stalls(address))) {
    uc_emu_stop(uc_);
    return;
  }
  const BlockInfo& info = block_info(address, size);
  if (info.floating_point && !chip_.core.floating_point_on()) {
    pending_fault_ = {exception::kUsageFault, m4::scb::kNocp.mask(), 0, false};
    chip_.complaints.add("core", "floating-point instruction near " + hex(address) + " with CPACR off");
    uc_emu_stop(uc_);
    return;
  }
  // The engine lets an unaligned LDRD pass.
  if (address >= upset_area() && !options_.check_alignment) {
    on_instruction(address, size);
    if (pending_fault_.number != 0) return;
  }
  first_block_ = false;
  block_end_ = address + size;
  instructions_ += info.instructions;
  hundredths_ += std::int64_t{info.instructions} * options_.cpi_percent;
}

void Machine::on_instruction(std::uint32_t address, std::uint32_t) {
  const std::uint16_t first = half_word(address);
  const std::uint16_t second = thumb::wide(first) ? half_word(address + 2) : std::uint16_t{0};
  const int base = thumb::aligned_base(first, second);
  if (base < 0 || base == 15) return;
  const int id = base == 13 ? UC_ARM_REG_SP : base == 14 ? UC_ARM_REG_LR : UC_ARM_REG_R0 + base;
  if ((reg(id) & 3) == 0) return;
  chip_.complaints.add("core", "unaligned access of several words at " + hex(address));
  pending_fault_ = {exception::kUsageFault, m4::scb::kUnaligned.mask(), 0, false};
  uc_emu_stop(uc_);
}

void Machine::synchronise() { chip_.scheduler.advance(chip_.clock.time_of(cycles())); }

void Machine::plan_stop(Picoseconds until) {
  const Picoseconds next = std::min(chip_.scheduler.next(), until);
  if (next == planned_for_ && chip_.clock.hz() == planned_hz_) return;
  planned_for_ = next;
  planned_hz_ = chip_.clock.hz();
  stop_hundredths_ = chip_.clock.cycle_at(planned_for_) * 100;
}

std::uint64_t Machine::on_read(std::uint32_t address, unsigned size) {
  undo_stores();
  synchronise();
  std::uint32_t value = 0;
  if (!chip_.read(address, static_cast<int>(size), value)) {
    pending_fault_ = {exception::kBusFault, m4::scb::kPreciserr.mask(), address, true};
  }
  plan_stop(until_);
  return value;
}

void Machine::on_write(std::uint32_t address, unsigned size, std::uint64_t value) {
  undo_stores();
  synchronise();
  if (!chip_.write(address, static_cast<int>(size), static_cast<std::uint32_t>(value))) {
    pending_fault_ = {exception::kBusFault, m4::scb::kImpreciserr.mask(), 0, false};
  }
  catch_up();
  plan_stop(until_);
}

// A block that stalled the bus has moved the time on.
void Machine::catch_up() {
  const Picoseconds now = chip_.scheduler.now();
  if (now > chip_.clock.time_of(cycles())) hundredths_ = chip_.clock.cycle_at(now) * 100;
}

// The engine itself stores after this call; undo_stores() takes that back, and the controller writes at its time.
bool Machine::on_flash_store(std::uint32_t address, unsigned size, std::uint64_t value) {
  const std::uint32_t offset = chip_.memory.resolve(address) - Memory::kFlash;
  if (offset >= chip_.memory.flash_size()) return false;
  undo_stores();
  synchronise();
  const unsigned once = std::min(size, 4U);  // the data bus has 32 bits
  for (unsigned at = 0; at < size; at += once)
    flash_.store(address + at, once, static_cast<std::uint32_t>(value >> 8 * at));
  const auto bytes =
      chip_.memory.flash().subspan(offset, std::min<std::size_t>(size, chip_.memory.flash_size() - offset));
  stored_.push_back({offset, {bytes.begin(), bytes.end()}});
  catch_up();
  plan_stop(until_);
  return true;
}

void Machine::undo_stores() {
  for (const Stored& one : stored_)
    std::memcpy(chip_.memory.flash().data() + one.offset, one.before.data(), one.before.size());
  stored_.clear();
}

std::uint64_t Machine::on_flash_read(std::uint32_t address, unsigned size) {
  undo_stores();
  synchronise();
  const std::uint64_t value = flash_.load(address, size);
  catch_up();
  plan_stop(until_);
  return value;
}

bool Machine::fetch_stalls(std::uint32_t address) const { return flash_busy_ && flash_.busy_until(address) != 0; }

// Both addresses of a part of the flash.
void Machine::read_directly(std::uint32_t offset, std::uint32_t size, bool direct) {
  for (const std::uint32_t base : {offset, Memory::kFlash + offset}) {
    uc_mem_unmap(uc_, base, size);
    if (direct) {
      uc_mem_map_ptr(uc_, base, size, UC_PROT_READ | UC_PROT_EXEC, chip_.memory.flash().data() + offset);
      continue;
    }
    FlashWindow* const window = windows_.emplace_back(std::make_unique<FlashWindow>(FlashWindow{this, base})).get();
    uc_mmio_map(uc_, base, size, Engine::flash_read, window, Engine::flash_write, window);
  }
}

// Banks that are busy, and pages with wrong check bits, are read through the controller. The engine stands meanwhile.
void Machine::apply_flash() {
  if (!flash_changed_) return;
  flash_changed_ = false;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> wanted;
  const auto [busy, size] = flash_.busy_range();
  if (size != 0) wanted.emplace_back(busy, size);
  for (const auto& [index, check] : flash_.damaged()) {
    const std::uint32_t page = index * 8 / kPage * kPage;
    if (page - busy < size || (!wanted.empty() && wanted.back().first == page)) continue;
    wanted.emplace_back(page, kPage);
  }
  if (wanted == watched_) return;
  for (const auto& [offset, bytes] : watched_) read_directly(offset, bytes, true);
  windows_.clear();
  for (const auto& [offset, bytes] : wanted) read_directly(offset, bytes, false);
  watched_ = std::move(wanted);
}

bool Machine::guarded(std::uint32_t address, std::uint32_t size) const {
  if (!chip_.core.mpu_in_faults() && chip_.nvic.execution_priority({}) < 0) return false;
  return std::any_of(guards_.begin(), guards_.end(),
                     [&](const auto& one) { return address + size > one.first && address <= one.second; });
}

std::uint64_t Machine::on_guard_read(std::uint32_t address, unsigned size) {
  std::uint64_t value = 0;
  if (guarded(address, size)) {
    pending_fault_ = {exception::kMemManage, m4::scb::kDaccviol.mask(), address, true};
  } else {
    const auto bytes = chip_.memory.readable(address, size);
    if (!bytes.empty()) std::memcpy(&value, bytes.data(), size);
  }
  return value;
}

void Machine::on_guard_write(std::uint32_t address, unsigned size, std::uint64_t value) {
  if (guarded(address, size)) {
    pending_fault_ = {exception::kMemManage, m4::scb::kDaccviol.mask(), address, true};
    return;
  }
  const auto bytes = chip_.memory.writable(address, size);
  if (!bytes.empty()) std::memcpy(bytes.data(), &value, size);
}

// Regions of the MPU without access (AP = 0) inside the SRAM: their pages become slow ones that are looked at.
void Machine::apply_mpu() {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> guards;
  for (const MpuRegion& region : chip_.core.mpu_regions()) {
    const bool on = chip_.core.mpu_on() && m4::mpu::kRegionEnable.of(region.rasr) != 0;
    if (!on || m4::mpu::kAp.of(region.rasr) != 0) continue;
    const std::uint64_t size = std::uint64_t{2} << m4::mpu::kSize.of(region.rasr);
    const bool small = size <= kPage && region.rbar % size == 0;
    if (!small || region.rbar < Memory::kRam || region.rbar >= Memory::kRam + chip_.memory.ram_size()) {
      chip_.complaints.add("core", "MPU region without access that is not up to 1 KiB of SRAM: not modelled");
      continue;
    }
    guards.emplace_back(region.rbar, region.rbar + static_cast<std::uint32_t>(size) - 1);
  }
  if (guards.size() > 1) chip_.complaints.add("core", "more than one MPU region without access: not modelled");
  if (guards == guards_) return;
  for (const std::uint32_t page : guard_pages_) {
    uc_mem_unmap(uc_, page, kPage);
    uc_mem_map_ptr(uc_, page, kPage, UC_PROT_ALL, chip_.memory.writable(page, kPage).data());
  }
  guard_pages_.clear();
  guards_ = guards;
  for (const auto& guard : guards_) {
    guard_pages_.push_back(guard.first & ~(kPage - 1));
    uc_mem_unmap(uc_, guard_pages_.back(), kPage);
    uc_mmio_map(uc_, guard_pages_.back(), kPage, Engine::guard_read, this, Engine::guard_write, this);
    break;
  }
}

void Machine::run(Picoseconds until) {
  until_ = until;
  while (chip_.scheduler.now() < until) {
    synchronise();
    chip_.clock.settle(cycles());
    if (chip_.pending_reset) {
      const bool supply_was_off = flash_.off();
      chip_.system_reset(*chip_.pending_reset);
      stalled_until_ = supply_was_off ? chip_.scheduler.now() + kSupplyOff : 0;
      reset_times_.push_back(chip_.scheduler.now());
      chip_.complaints.expect_from("");
      reset_core();
      if (stop_at_reset) return;
    }
    if (stalled_until_ > chip_.scheduler.now()) {
      pass(std::min(until, stalled_until_));
      continue;
    }
    const bool vector_stalls = chip_.nvic.waiting() && fetch_stalls(chip_.core.vector_table());
    if (!sleeping_ && !locked_up_ && (vector_stalls || fetch_stalls(program_counter_))) {
      pass(until);
      continue;
    }
    apply_flash();
    take_pending();
    if (chip_.scheduler.now() >= until) return;
    if (upset_due()) begin_upset();
    if (sleeping_ || locked_up_) {
      sleep(until);
    } else {
      execute(until);
    }
  }
}

// The code of an upset stands at the end of the SRAM.
std::uint32_t Machine::upset_area() const { return Memory::kRam + chip_.memory.ram_size() - kUpsetArea; }

bool Machine::upset_due() const {
  return upset_.has_value() && active_.empty() && !sleeping_ && (reg(UC_ARM_REG_PRIMASK) & 1) == 0;
}

void Machine::begin_upset() {
  const auto slot = static_cast<std::uint32_t>(*upset_);
  const std::vector<std::uint16_t> code = upset_code(*upset_);
  const std::uint32_t address = upset_area() + slot * kUpsetBytes;
  std::memcpy(chip_.memory.writable(address, kUpsetBytes).data(), code.data(), 2 * code.size());
  if (*upset_ == Upset::kFloatingPointOff) static_cast<void>(chip_.write(kCpacr, 4, 0));
  if (*upset_ == Upset::kUnalignedAccess) set_reg(UC_ARM_REG_R0, Memory::kRam + 2);
  chip_.complaints.expect_from("core");
  program_counter_ = address;
  upset_time_ = chip_.scheduler.now();
  upset_.reset();
}

// Time jumps to the next event.
void Machine::pass(Picoseconds until) {
  const Picoseconds next = std::min(chip_.scheduler.next(), until);
  hundredths_ = std::max(hundredths_, chip_.clock.cycle_at(next) * 100);
  chip_.scheduler.advance(next);
}

void Machine::sleep(Picoseconds until) {
  pass(until);
  if (!locked_up_ && chip_.nvic.wakes(masks())) sleeping_ = false;
}

void Machine::execute(Picoseconds until) {
  plan_stop(until);
  first_block_ = true;
  engine_interrupt_ = -1;
  bad_instruction_ = false;
  const uc_err error = uc_emu_start(uc_, program_counter_ | 1, kNowhere, 0, 0);
  program_counter_ = reg(UC_ARM_REG_PC);
  undo_stores();
  handle_stop(error);
}

void Machine::handle_stop(int error) {
  if (pending_fault_.number != 0) return;  // taken by take_pending()
  if (engine_interrupt_ >= 0) return handle_interrupt();
  switch (error) {
    case UC_ERR_OK: {
      const bool at_end = program_counter_ == block_end_;
      if (at_end && half_word(program_counter_ - 2) == thumb::kWfi && !first_block_) {
        synchronise();
        sleeping_ = !chip_.nvic.wakes(masks());
      }
      return;
    }
    case UC_ERR_INSN_INVALID: {
      const std::uint16_t before = half_word(program_counter_ - 2);
      if (program_counter_ == block_end_ && (before == thumb::kWfe || before == thumb::kYield)) return;
      const bool thumb_state = (reg(UC_ARM_REG_XPSR) & 0x0100'0000) != 0;
      const std::uint32_t why = thumb_state ? m4::scb::kUndefinstr.mask() : m4::scb::kInvstate.mask();
      set_reg(UC_ARM_REG_XPSR, reg(UC_ARM_REG_XPSR) | 0x0100'0000);
      chip_.complaints.add("core", "undefined instruction at " + hex(program_counter_));
      return fault(exception::kUsageFault, why, false, 0);
    }
    case UC_ERR_FETCH_UNMAPPED:
    case UC_ERR_FETCH_PROT:
      if (flash_changed_ || fetch_stalls(program_counter_)) return;  // run() tries again
      chip_.complaints.add("core", "instruction fetch at " + hex(program_counter_));
      return fault(exception::kBusFault, m4::scb::kIbuserr.mask(), false, 0);
    default:
      chip_.complaints.add("core", "access to " + hex(bad_address_) + " at " + hex(program_counter_) + ": " +
                                       uc_strerror(static_cast<uc_err>(error)));
      return fault(exception::kBusFault, m4::scb::kPreciserr.mask(), true, bad_address_);
  }
}

void Machine::handle_interrupt() {
  if (engine_interrupt_ == kExceptionReturn) return return_from_exception(program_counter_ | 1);
  if (engine_interrupt_ == kSupervisorCall) return chip_.nvic.pend(exception::kSvc);
  chip_.complaints.add(
      "core", (engine_interrupt_ == kBreakpoint ? "BKPT at " : "engine exception at ") + hex(program_counter_));
  fault(exception::kHardFault, 0, false, 0);
}

// B1.5.14: a fault whose handler is off or cannot pre-empt becomes a HardFault; a fault in that is lock-up.
void Machine::fault(int number, std::uint32_t cfsr, bool with_address, std::uint32_t address) {
  chip_.core.report_fault(cfsr, with_address, address);
  const int priority = chip_.nvic.execution_priority(masks());
  if (number != exception::kHardFault && (!chip_.nvic.enabled(number) || chip_.nvic.priority(number) >= priority)) {
    chip_.core.report_forced();
    number = exception::kHardFault;
  }
  if (number == exception::kHardFault && priority <= -1) {
    locked_up_ = true;
    chip_.complaints.add("core", "lock-up: a fault inside HardFault or NMI at " + hex(program_counter_));
    return;
  }
  enter_exception(number, program_counter_);
}

void Machine::take_pending() {
  if (pending_fault_.number != 0) {
    const Pending taken = pending_fault_;
    pending_fault_ = {};
    return fault(taken.number, taken.cfsr, taken.with_address, taken.address);
  }
  if (locked_up_ || !chip_.nvic.waiting()) return;
  const int number = chip_.nvic.next(masks());
  if (number == 0) return;
  sleeping_ = false;
  watch_for_storm(number);
  enter_exception(number, program_counter_);
}

// An interrupt whose handler leaves its cause enters again and again, and thread mode stands still.
void Machine::watch_for_storm(int number) {
  storm_count_ =
      number == storm_number_ && number >= exception::kInterrupt0 && chip_.nvic.level(number) ? storm_count_ + 1 : 0;
  storm_number_ = number;
  if (storm_count_ == kStorm) {
    chip_.complaints.add("core", "interrupt " + std::to_string(number - exception::kInterrupt0) +
                                     " is never cleared: its handler was entered 1000 times in a row");
  }
}

bool Machine::push_frame(std::uint32_t return_address, std::uint32_t& exc_return) {
  const bool floating = (reg(UC_ARM_REG_CONTROL) & 4) != 0;
  if ((reg(UC_ARM_REG_CONTROL) & 2) != 0) chip_.complaints.add("core", "process stack in use: not modelled");
  const std::uint32_t stack = reg(UC_ARM_REG_SP);
  const std::uint32_t padding = stack & 4;
  const std::uint32_t size = floating ? 0x68 : 0x20;
  const std::uint32_t frame = ((stack - size) & ~4U);
  std::uint32_t xpsr = reg(UC_ARM_REG_XPSR);
  xpsr = padding != 0 ? xpsr | 0x200 : xpsr & ~0x200U;
  const std::uint32_t words[8] = {reg(UC_ARM_REG_R0),  reg(UC_ARM_REG_R1), reg(UC_ARM_REG_R2), reg(UC_ARM_REG_R3),
                                  reg(UC_ARM_REG_R12), reg(UC_ARM_REG_LR), return_address,     xpsr};
  bool fine = true;
  const auto put = [&](std::uint32_t at, std::uint32_t word) {
    fine = fine && !guarded(at, 4) && chip_.memory.write_word(at, word);
  };
  for (std::uint32_t i = 0; i < 8; ++i) put(frame + 4 * i, words[i]);
  if (floating) {
    for (std::uint32_t i = 0; i < 16; ++i) put(frame + 0x20 + 4 * i, reg(UC_ARM_REG_S0 + static_cast<int>(i)));
    put(frame + 0x60, reg(UC_ARM_REG_FPSCR));
  }
  set_reg(UC_ARM_REG_SP, frame);
  lowest_stack_ = std::min(lowest_stack_, frame);
  exc_return = 0xFFFF'FFE1 | (floating ? 0U : 0x10U) | (active_.empty() ? 0x8U : 0U);
  return fine;
}

void Machine::enter_exception(int number, std::uint32_t return_address) {
  ++exceptions_;
  std::uint32_t exc_return = 0;
  const bool stacked = push_frame(return_address, exc_return);
  active_.push_back(number);
  chip_.nvic.activate(number);
  chip_.core.set_active_exception(number);
  std::uint32_t vector = 0;
  const bool there = chip_.memory.read_word(chip_.core.vector_table() + 4 * static_cast<std::uint32_t>(number), vector);
  set_reg(UC_ARM_REG_CONTROL, reg(UC_ARM_REG_CONTROL) & ~6U);
  set_reg(UC_ARM_REG_XPSR, 0x0100'0000 | static_cast<std::uint32_t>(number));
  set_reg(UC_ARM_REG_LR, exc_return);
  program_counter_ = vector & ~1U;
  hundredths_ += 1200;  // Cortex-M4 TRM 3.9.1: 12 cycles
  if (!there || (vector & 1) == 0) {
    chip_.core.report_vector_fault();
    chip_.complaints.add("core", "vector of exception " + std::to_string(number) + " is " + hex(vector));
    return fault(exception::kHardFault, 0, false, 0);
  }
  if (!stacked) {
    chip_.complaints.add("core", "exception frame does not fit at " + hex(reg(UC_ARM_REG_SP)));
    const bool by_mpu = guarded(reg(UC_ARM_REG_SP), 0x68);
    if (number != exception::kHardFault && number != exception::kMemManage) {
      fault(by_mpu ? exception::kMemManage : exception::kBusFault,
            by_mpu ? m4::scb::kMstkerr.mask() : m4::scb::kStkerr.mask(), false, 0);
    }
  }
}

void Machine::pop_frame(std::uint32_t exc_return) {
  const bool floating = (exc_return & 0x10) == 0;
  const std::uint32_t frame = reg(UC_ARM_REG_SP);
  const auto word = [&](std::uint32_t at) {
    std::uint32_t value = 0;
    if (!chip_.memory.read_word(at, value)) chip_.complaints.add("core", "exception return from no stack");
    return value;
  };
  const std::uint32_t xpsr = word(frame + 28);
  if (floating) {
    for (std::uint32_t i = 0; i < 16; ++i) set_reg(UC_ARM_REG_S0 + static_cast<int>(i), word(frame + 0x20 + 4 * i));
    set_reg(UC_ARM_REG_FPSCR, word(frame + 0x60));
  }
  set_reg(UC_ARM_REG_CONTROL, (reg(UC_ARM_REG_CONTROL) & ~4U) | (floating ? 4U : 0U));
  constexpr int kIds[] = {UC_ARM_REG_R0, UC_ARM_REG_R1, UC_ARM_REG_R2, UC_ARM_REG_R3, UC_ARM_REG_R12, UC_ARM_REG_LR};
  for (std::uint32_t i = 0; i < 6; ++i) set_reg(kIds[i], word(frame + 4 * i));
  program_counter_ = word(frame + 24) & ~1U;
  set_reg(UC_ARM_REG_XPSR, (xpsr & ~0x3FFU) | (active_.empty() ? 0U : static_cast<std::uint32_t>(active_.back())));
  set_reg(UC_ARM_REG_SP, frame + (floating ? 0x68U : 0x20U) + ((xpsr & 0x200) != 0 ? 4U : 0U));
}

// B1.5.8. Leaving an exception other than NMI clears FAULTMASK.
void Machine::return_from_exception(std::uint32_t exc_return) {
  const bool to_thread = (exc_return & 8) != 0;
  const bool form = (exc_return & 0xFFFF'FFEF) == 0xFFFF'FFE1 || (exc_return & 0xFFFF'FFEF) == 0xFFFF'FFE9;
  if (active_.empty() || !form || to_thread != (active_.size() == 1)) {
    chip_.complaints.add("core", "exception return with " + hex(exc_return) + " is not allowed here");
    if (active_.empty()) return fault(exception::kUsageFault, m4::scb::kInvpc.mask(), false, 0);
  }
  const int number = active_.back();
  active_.pop_back();
  chip_.nvic.deactivate(number);
  chip_.core.set_active_exception(active_.empty() ? 0 : active_.back());
  if (number != exception::kNmi) set_reg(UC_ARM_REG_FAULTMASK, 0);
  pop_frame(exc_return);
  hundredths_ += 1000;  // about 10 cycles to unstack
}

}  // namespace tetap::board
