// SPDX-License-Identifier: Apache-2.0
#include "sim_host/emulator/flash_f4.hpp"

#include "hal/chip/support/register_field.hpp"

#include <array>
#include <cstddef>

namespace tetap::board {

namespace {

using hal::Field;

// RM0402, "FLASH registers": offsets and fields, from the manual and not from the SVD file that the driver's come from.
constexpr std::uint32_t kBase = 0x4002'3C00, kAcr = 0x00, kKeyr = 0x04, kOptkeyr = 0x08, kSr = 0x0C, kCr = 0x10,
                        kOptcr = 0x14;
constexpr int kInterrupt = 4;  // table "Vector table"
constexpr std::uint32_t kAcrBits = 0x1F0F;
constexpr Field kEop{0}, kOperr{1}, kWrperr{4}, kPgaerr{5}, kPgperr{6}, kPgserr{7}, kBsy{16};
constexpr Field kPg{0}, kSer{1}, kMer{2}, kSnb{3, 4}, kPsize{8, 2}, kStrt{16}, kEopie{24}, kErrie{25}, kLock{31};
constexpr Field kOptlock{0}, kOptstrt{1}, kNwrp{16, 12};
constexpr std::uint32_t kCrBits =
    kPg.mask() | kSer.mask() | kMer.mask() | kSnb.mask() | kPsize.mask() | kEopie.mask() | kErrie.mask();
constexpr std::uint32_t kOptcrReset = 0x0FFF'AAED, kFlags = 0xF3;
constexpr std::uint32_t kRow = 16;  // bytes that one programming must not leave

// RM0402, table "Flash module organization".
constexpr std::uint32_t kKilobyte = 1024, kSectors = 12, kFlashSize = kKilobyte * kKilobyte;
constexpr std::uint32_t sector_size(std::uint32_t sector) {
  return kKilobyte * (sector < 4 ? 16U : sector == 4 ? 64U : 128U);
}
constexpr std::uint32_t sector_begin(std::uint32_t sector) {
  std::uint32_t begin = 0;
  for (std::uint32_t before = 0; before < sector; ++before) begin += sector_size(before);
  return begin;
}
constexpr std::uint32_t sector_of(std::uint32_t offset) {
  std::uint32_t sector = 0;
  while (sector + 1 < kSectors && sector_begin(sector + 1) <= offset) ++sector;
  return sector;
}
static_assert(sector_begin(kSectors) == kFlashSize);

// DS11139: by PSIZE of 8, 16 and 32 bits.
using Durations = std::array<FlashController::Duration, 3>;
constexpr FlashController::Duration ms(std::int64_t typical) {
  return {typical * kMillisecond, 2 * typical * kMillisecond};
}
constexpr Durations kErase16{ms(400), ms(300), ms(250)}, kErase64{ms(1'200), ms(700), ms(550)},
    kErase128{ms(2'000), ms(1'300), ms(1'000)}, kEraseAll{ms(16'000), ms(11'000), ms(8'000)};
constexpr FlashController::Duration kProgram{16 * kMicrosecond, 100 * kMicrosecond};

constexpr const Durations& erase_time(std::uint32_t size) {
  if (size == kFlashSize) return kEraseAll;
  return size == sector_size(0) ? kErase16 : size == sector_size(4) ? kErase64 : kErase128;
}

}  // namespace

FlashF4::FlashF4(Surroundings around, Memory& memory)
    : FlashController(around, kBase, memory, kFlashSize),
      optcr_(kOptcrReset),
      protection_(kNwrp.of(kOptcrReset)),
      options_done_(around.scheduler, [this] { protection_ = kNwrp.of(optcr_); }) {}

void FlashF4::reset_registers() {
  acr_ = sr_ = cr_ = 0;
  optcr_ = kNwrp.in(kOptcrReset, protection_);
  options_done_.clear();
  lock_.reset();
  option_lock_.reset();
  set_interrupt(kInterrupt, false);
}

std::uint32_t FlashF4::read(std::uint32_t offset) {
  const bool working = busy() || options_done_.pending();
  switch (offset) {
    case kAcr:
      return acr_;
    case kSr:
      return sr_ | kBsy(working ? 1 : 0);
    case kCr:
      return cr_ | kStrt(busy() && operation().erase ? 1 : 0) | kLock(lock_.locked() ? 1 : 0);
    case kOptcr:
      return (optcr_ & ~(kOptlock.mask() | kOptstrt.mask())) | kOptlock(option_lock_.locked() ? 1 : 0) |
             kOptstrt(options_done_.pending() ? 1 : 0);
    default:
      return 0;
  }
}

void FlashF4::write(std::uint32_t offset, std::uint32_t value, std::uint32_t mask) {
  switch (offset) {
    case kAcr:
      return write_acr(value, mask);
    case kKeyr:
      return take_key(lock_, value);
    case kOptkeyr:
      return take_key(option_lock_, value);
    case kSr:
      sr_ &= ~(value & mask & kFlags);
      return set_flags(0);
    case kCr:
      return write_cr(value, mask);
    case kOptcr:
      return write_optcr(value, mask);
    default:
      return complain("write at an offset that has no register");
  }
}

void FlashF4::write_acr(std::uint32_t value, std::uint32_t mask) {
  merge(acr_, value & kAcrBits, mask);
  if (on_change) on_change();
}

void FlashF4::write_cr(std::uint32_t value, std::uint32_t mask) {
  if (!opens_cr(value & mask, kLock.mask())) return;
  merge(cr_, value & kCrBits, mask);
  if ((value & mask & kLock.mask()) != 0) lock_.lock();
  set_flags(0);
  if ((value & mask & kStrt.mask()) != 0) start_erase();
}

void FlashF4::start_erase() {
  const bool sector = kSer.of(cr_) != 0, all = kMer.of(cr_) != 0;
  const std::uint32_t number = kSnb.of(cr_), parallelism = kPsize.of(cr_);
  if (sector == all) return complain("STRT with SER and MER both set, or none: nothing is erased");
  if (sector && number >= kSectors) return complain("SNB = " + std::to_string(number) + ": no such sector");
  if (parallelism == 3) return complain("PSIZE of 64 bits without an external Vpp");
  const std::uint32_t open = all ? (1U << kSectors) - 1 : 1U << number;
  if ((protection_ & open) != open) return set_flags(kWrperr.mask());
  Operation erase{.erase = true, .offset = 0, .size = kFlashSize};
  if (sector) erase.offset = sector_begin(number), erase.size = sector_size(number);
  begin(erase, erase_time(erase.size)[parallelism]);
}

void FlashF4::write_optcr(std::uint32_t value, std::uint32_t mask) {
  await_idle();
  if (off()) return;
  if (option_lock_.locked()) return complain("FLASH_OPTCR written while OPTLOCK = 1");
  const std::uint32_t kept = ~(kNwrp.mask() | kOptlock.mask() | kOptstrt.mask());
  if (((optcr_ ^ value) & mask & kept) != 0) complain("option bytes other than nWRP are not modelled");
  merge(optcr_, value & kNwrp.mask(), mask & kNwrp.mask());
  if ((value & mask & kOptlock.mask()) != 0) option_lock_.lock();
  if ((value & mask & kOptstrt.mask()) != 0) options_done_.set(now() + kErase16[0].typical);
}

void FlashF4::store(std::uint32_t address, unsigned size, std::uint32_t value) {
  if (off()) return;
  await_idle();
  const std::uint32_t offset = offset_of(address);
  if (kPg.of(cr_) == 0) return fail(kPgserr.mask(), "store into the flash while PG = 0");
  if (offset % kRow + size > kRow) return fail(kPgaerr.mask(), "store across a row of 16 bytes");
  if (size != 1U << kPsize.of(cr_)) return fail(kPgperr.mask(), "store of another size than PSIZE");
  if ((protection_ >> sector_of(offset) & 1) == 0) return set_flags(kWrperr.mask());
  begin({.erase = false, .offset = offset, .size = size, .value = value}, kProgram);
}

void FlashF4::fail(std::uint32_t flag, const std::string& why) {
  complain(why);
  set_flags(flag);
}

// EOP and OPERR are set only where their interrupts are enabled.
void FlashF4::set_flags(std::uint32_t flags) {
  sr_ |= flags;
  if ((flags & ~kEop.mask()) != 0 && kErrie.of(cr_) != 0) sr_ |= kOperr.mask();
  set_interrupt(kInterrupt, (kEop.of(sr_) & kEopie.of(cr_)) != 0 || (kOperr.of(sr_) & kErrie.of(cr_)) != 0);
}

void FlashF4::complete(const Operation& operation) {
  if (operation.erase) {
    fill_ones(operation);
  } else {
    set_content(operation.offset, operation.size, content(operation.offset, operation.size) & operation.value);
  }
  if (kEopie.of(cr_) != 0) set_flags(kEop.mask());
}

// An erase passes through programmed cells, so a word may be old, blank, between the two, or anything.
void FlashF4::tear(const Operation& operation, base::Random& random) {
  if (!operation.erase) {
    const std::uint64_t old = content(operation.offset, operation.size);
    return set_content(operation.offset, operation.size, old & (operation.value | random.next()));
  }
  for (std::uint32_t at = operation.offset; at < operation.offset + operation.size; at += 4) {
    const std::uint32_t kind = random.next() % 4;
    if (kind == 1) set_content(at, 4, 0xFFFF'FFFF);
    if (kind == 2) set_content(at, 4, content(at, 4) | random.next());
    if (kind == 3) set_content(at, 4, random.next());
  }
}

// RM0402, table "Number of wait states according to CPU clock frequency", 2.7 to 3.6 V. One per cent is left for an HSI
// at the end of its tolerance.
std::int64_t FlashF4::limit_hz() const {
  constexpr std::int64_t kLimits[] = {30'300'000, 64'640'000, 90'900'000, 101'000'000};
  return kLimits[acr_ % 16 > 3 ? 3 : acr_ % 16];
}

}  // namespace tetap::board
