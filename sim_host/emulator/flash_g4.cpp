// SPDX-License-Identifier: Apache-2.0
#include "sim_host/emulator/flash_g4.hpp"

#include "hal/chip/support/register_field.hpp"
#include "sim_host/emulator/flash_ecc.hpp"
#include "sim_host/emulator/rcc_g4.hpp"

#include <algorithm>

namespace tetap::board {

namespace {

using hal::Field;

// RM0440, "FLASH registers": offsets and fields, from the manual and not from the SVD file that the driver's come from.
constexpr std::uint32_t kBase = 0x4002'2000, kAcr = 0x00, kKeyr = 0x08, kOptkeyr = 0x0C, kSr = 0x10, kCr = 0x14,
                        kEccr = 0x18, kOptr = 0x20, kWrp1ar = 0x2C, kWrp2ar = 0x4C;
constexpr int kInterrupt = 4;                     // table "Vector table"
constexpr std::uint32_t kAcrReset = 0x0004'0600,  // the SVD has one wait state there
    kOptrReset = 0xFFEF'F8AA;                     // factory: dual bank
constexpr Field kLatency{0, 4}, kIcen{9}, kDcen{10}, kIcrst{11}, kDcrst{12};
constexpr Field kEop{0}, kOperr{1}, kProgerr{3}, kWrperr{4}, kPgaerr{5}, kSizerr{6}, kPgserr{7}, kBsy{16};
constexpr Field kPg{0}, kPer{1}, kMer1{2}, kPnb{3, 7}, kBker{11}, kMer2{15}, kStrt{16}, kOptstrt{17}, kFstpg{18},
    kEopie{24}, kErrie{25}, kOblLaunch{27}, kOptlock{30}, kLock{31};
constexpr Field kAddrEcc{0, 19}, kBkEcc{21}, kEcccie{24}, kEccc{30}, kEccd{31};
constexpr Field kFirstPage{0, 7}, kLastPage{16, 7};
constexpr std::uint32_t kFlags = 0xC3FB, kErrors = 0xC3FA;  // FLASH_SR, cleared by writing 1
constexpr std::uint32_t kCrBits = kPg.mask() | kPer.mask() | kMer1.mask() | kPnb.mask() | kBker.mask() | kMer2.mask() |
                                  kFstpg.mask() | kEopie.mask() | kErrie.mask();

constexpr std::uint32_t kPage = 2048, kBank = 128 * kPage;
constexpr std::uint64_t kBlank = ~std::uint64_t{0};
constexpr std::uint8_t kBlankCheck = 0xFF;
static_assert(ecc::check_bits(kBlank) == kBlankCheck && ecc::check_bits(0) == 0);

// DS12288.
constexpr FlashController::Duration kProgram{81'700'000, 83'350'000},
    kErasePage{22'020 * kMicrosecond, 24'470 * kMicrosecond}, kEraseBank{22'130 * kMicrosecond, 24'600 * kMicrosecond};

}  // namespace

FlashG4::FlashG4(Surroundings around, Memory& memory, const PwrG4& pwr)
    : FlashController(around, kBase, memory, kBank), pwr_(pwr) {
  reset_registers();
}

void FlashG4::reset_registers() {
  acr_ = kAcrReset;
  sr_ = cr_ = eccr_ = 0;
  lock_.reset();
  option_lock_.reset();
  first_word_.reset();
  set_interrupt(kInterrupt, false);
}

std::uint32_t FlashG4::read(std::uint32_t offset) {
  switch (offset) {
    case kAcr:
      return acr_;
    case kSr:
      return sr_ | kBsy(busy() ? 1 : 0);
    case kCr:
      return cr_ | kStrt(busy() && operation().erase ? 1 : 0) | kOptlock(option_lock_.locked() ? 1 : 0) |
             kLock(lock_.locked() ? 1 : 0);
    case kEccr:
      return eccr_;
    case kOptr:
      return kOptrReset;
    case kWrp1ar:
      return protected_pages[0];
    case kWrp2ar:
      return protected_pages[1];
    default:
      return 0;
  }
}

void FlashG4::write(std::uint32_t offset, std::uint32_t value, std::uint32_t mask) {
  switch (offset) {
    case kAcr:
      return write_acr(value, mask);
    case kKeyr:
      return take_key(lock_, value);
    case kOptkeyr:
      if (lock_.locked()) return complain("FLASH_OPTKEYR written while LOCK = 1");
      return take_key(option_lock_, value);
    case kSr:
      sr_ &= ~(value & mask & kFlags);
      return set_flags(0);
    case kCr:
      return write_cr(value, mask);
    case kEccr:
      eccr_ &= ~(value & mask & (kEccc.mask() | kEccd.mask()));
      merge(eccr_, value & kEcccie.mask(), mask & kEcccie.mask());
      return set_flags(0);
    default:
      return complain("write at an offset that is not modelled");
  }
}

void FlashG4::write_acr(std::uint32_t value, std::uint32_t mask) {
  const std::uint32_t before = acr_;
  merge(acr_, value, mask);
  const bool caches_on = kIcen.of(before) != 0 || kDcen.of(before) != 0;
  if (caches_on && (acr_ & (kIcrst.mask() | kDcrst.mask())) != 0)
    complain("ICRST or DCRST set while the caches are on");
  if (on_change) on_change();
}

void FlashG4::write_cr(std::uint32_t value, std::uint32_t mask) {
  if (!opens_cr(value & mask, kLock.mask() | kOptlock.mask())) return;
  if ((value & mask & (kOptstrt.mask() | kFstpg.mask() | kOblLaunch.mask())) != 0)
    complain("option bytes and fast programming are not modelled");
  merge(cr_, value & kCrBits, mask);
  if (kPg.of(cr_) == 0) first_word_.reset();
  if ((value & mask & kOptlock.mask()) != 0) option_lock_.lock();
  if ((value & mask & kLock.mask()) != 0) lock_.lock(), option_lock_.lock();
  set_flags(0);
  if ((value & mask & kStrt.mask()) != 0) start_erase();
}

bool FlashG4::is_protected(std::uint32_t offset, std::uint32_t size) const {
  for (std::uint32_t at = offset; at < offset + size; at += kPage) {
    const std::uint32_t range = protected_pages[at / kBank], page = at % kBank / kPage;
    if (page >= kFirstPage.of(range) && page <= kLastPage.of(range)) return true;
  }
  return false;
}

void FlashG4::start_erase() {
  const bool page = kPer.of(cr_) != 0, first = kMer1.of(cr_) != 0, second = kMer2.of(cr_) != 0;
  if ((sr_ & kErrors) != 0) return fail(kPgserr.mask(), "STRT while error flags are set");
  if (kPg.of(cr_) != 0 || (page && (first || second))) return fail(kPgserr.mask(), "STRT with PG, or PER with MER");
  if (!page && !first && !second) return complain("STRT without PER, MER1 or MER2");
  Operation erase{.erase = true, .offset = first ? 0 : kBank, .size = first && second ? 2 * kBank : kBank};
  if (page) erase.offset = kBker.of(cr_) * kBank + kPnb.of(cr_) * kPage, erase.size = kPage;
  if (is_protected(erase.offset, erase.size)) return set_flags(kWrperr.mask());
  begin(erase, page ? kErasePage : kEraseBank);
}

void FlashG4::store(std::uint32_t address, unsigned size, std::uint32_t value) {
  if (off()) return;
  await_idle();
  const std::uint32_t offset = offset_of(address);
  if (kPg.of(cr_) == 0) return fail(kPgserr.mask(), "store into the flash while PG = 0");
  if ((sr_ & kErrors) != 0) return fail(kPgserr.mask(), "store while error flags are set");
  if (size != 4) return fail(kSizerr.mask(), "store of a byte or half-word");
  if (!first_word_) {
    if (offset % 8 != 0) return fail(kPgaerr.mask(), "the first word is not at a double word's address");
    first_word_ = {offset, value};
    return;
  }
  const FirstWord first = *first_word_;
  first_word_.reset();
  if (offset != first.offset + 4) return fail(kPgaerr.mask(), "the second word is not of the first one's double word");
  program(first.offset, std::uint64_t{value} << 32 | first.value);
}

// "PROGERR: ... a double-word address to be programmed contains a value different from 0xFFFF FFFF before programming,
// except if the data to write is 0x0000 0000."
void FlashG4::program(std::uint32_t offset, std::uint64_t value) {
  if (is_protected(offset, 8)) return set_flags(kWrperr.mask());
  const bool blank = content(offset, 8) == kBlank && check_of(offset) == kBlankCheck;
  if (!blank && value != 0) return set_flags(kProgerr.mask());
  begin({.erase = false, .offset = offset, .size = 8, .value = value}, kProgram);
}

void FlashG4::fail(std::uint32_t flag, const std::string& why) {
  complain(why);
  set_flags(flag);
}

// EOP and OPERR are set only where their interrupts are enabled.
void FlashG4::set_flags(std::uint32_t flags) {
  sr_ |= flags;
  if ((flags & kErrors) != 0 && kErrie.of(cr_) != 0) sr_ |= kOperr.mask();
  set_interrupt(kInterrupt, (kEop.of(sr_) & kEopie.of(cr_)) != 0 || (kOperr.of(sr_) & kErrie.of(cr_)) != 0 ||
                                (kEccc.of(eccr_) & kEcccie.of(eccr_)) != 0);
}

std::uint8_t FlashG4::check_of(std::uint32_t offset) const {
  const auto found = damaged_.find(offset / 8);
  return found == damaged_.end() ? ecc::check_bits(content(offset, 8)) : found->second;
}

void FlashG4::set_cells(std::uint32_t offset, std::uint64_t data, std::uint8_t check) {
  set_content(offset, 8, data);
  damaged_.erase(offset / 8);
  if (check != ecc::check_bits(data)) damaged_[offset / 8] = check;
}

void FlashG4::complete(const Operation& operation) {
  if (operation.erase) {
    fill_ones(operation);
    damaged_.erase(damaged_.lower_bound(operation.offset / 8),
                   damaged_.lower_bound((operation.offset + operation.size) / 8));
  } else {
    set_cells(operation.offset, operation.value, ecc::check_bits(operation.value));
  }
  if (kEopie.of(cr_) != 0) set_flags(kEop.mask());
}

// Each of the 72 cells on its own. An erase passes through programmed cells, so a double word may be old, blank,
// between the two, or anything.
void FlashG4::tear(const Operation& operation, base::Random& random) {
  const auto cells = [&] { return std::uint64_t{random.next()} << 32 | random.next(); };
  const auto byte = [&] { return static_cast<std::uint8_t>(random.next()); };
  if (!operation.erase) {
    const std::uint64_t data = content(operation.offset, 8) & (operation.value | cells());
    const auto left = static_cast<std::uint8_t>(ecc::check_bits(operation.value) | byte());
    return set_cells(operation.offset, data, check_of(operation.offset) & left);
  }
  for (std::uint32_t at = operation.offset; at < operation.offset + operation.size; at += 8) {
    const std::uint32_t kind = random.next() % 4;
    if (kind == 1) set_cells(at, kBlank, kBlankCheck);
    if (kind == 2) {
      const auto check = static_cast<std::uint8_t>(check_of(at) | byte());
      set_cells(at, content(at, 8) | cells(), check);
    }
    if (kind == 3) {
      const std::uint64_t data = cells();
      set_cells(at, data, byte());
    }
  }
}

// "When ECCC or ECCD is set, ADDR_ECC and BK_ECC are not updated if a new ECC error occurs."
std::uint64_t FlashG4::checked(std::uint32_t offset) {
  const auto found = damaged_.find(offset / 8);
  if (found == damaged_.end()) return content(offset, 8);
  const ecc::Read got = ecc::read(content(offset, 8), found->second);
  if ((eccr_ & (kEccc.mask() | kEccd.mask())) == 0)
    eccr_ = kBkEcc.in(kAddrEcc.in(eccr_, offset % kBank), offset / kBank);
  if (got.verdict == ecc::Verdict::kCorrected) eccr_ |= kEccc.mask();
  if (got.verdict == ecc::Verdict::kWrong) {
    eccr_ |= kEccd.mask();
    if (on_nmi) on_nmi();
  }
  set_flags(0);
  return got.data;
}

std::uint64_t FlashG4::load(std::uint32_t address, unsigned size) {
  if (busy_until(address) != 0) await_idle();
  const std::uint32_t offset = offset_of(address), first = offset / 8 * 8, inside = 8 * (offset - first);
  std::uint64_t value = checked(first) >> inside;
  if (offset + size > first + 8) value |= checked(first + 8) << (64 - inside);
  return size == 8 ? value : value & ((std::uint64_t{1} << 8 * size) - 1);
}

// RM0440, section "Read access latency", table 29: steps of HCLK per wait state in range 1 boost, range 1 normal,
// range 2. One per cent is left for an HSI at the end of its tolerance.
std::int64_t FlashG4::limit_hz() const {
  constexpr std::int64_t kStep_mhz[] = {34, 30, 12}, kLast_mhz[] = {170, 150, 26};
  const auto range = static_cast<std::size_t>(pwr_.range());
  const std::int64_t latency = kLatency.of(acr_);
  const std::int64_t hz = 1'000'000 * std::min((latency + 1) * kStep_mhz[range], kLast_mhz[range]);
  return hz + hz / 100;
}

}  // namespace tetap::board
