// SPDX-License-Identifier: Apache-2.0
#include "sim_host/emulator/rcc.hpp"

#include "hal/chip/stm32/registers_stm32f412.hpp"
#include "sim_host/emulator/flash_f4.hpp"

#include <utility>

namespace tetap::board {

namespace reg = hal::stm32f412::rcc;

namespace {

constexpr Picoseconds kPllLock = 200 * kMicrosecond;  // data sheet: at most 200 us
constexpr Picoseconds kLsiStart = 40 * kMicrosecond;  // data sheet: at most 40 us
constexpr std::size_t kRccWords = 0x25;
constexpr std::uint32_t kHsi = 0, kHse = 1, kPll = 2;  // CFGR.SW

}  // namespace

Rcc::Rcc(Surroundings around, const Oscillators& oscillators, const Pwr& pwr, const FlashF4& flash)
    : ClockController(around, reg::kRcc, kRccWords),
      oscillators_(oscillators),
      pwr_(pwr),
      flash_(flash),
      hse_ready_(around.scheduler, [this] { word(reg::cr::kOffset) |= reg::cr::kHserdy.mask(); }),
      pll_ready_(around.scheduler, [this] { word(reg::cr::kOffset) |= reg::cr::kPllrdy.mask(); }),
      lsi_ready_(around.scheduler, [this] { word(reg::csr::kOffset) |= reg::csr::kLsirdy.mask(); }) {
  reset();
  word(reg::csr::kOffset) = reg::csr::kResetValue;
}

void Rcc::reset() {
  const std::uint32_t flags = word(reg::csr::kOffset) & 0xFF00'0000;
  words_.assign(kRccWords, 0);
  word(reg::cr::kOffset) = reg::cr::kResetValue;
  word(reg::pllcfgr::kOffset) = reg::pllcfgr::kResetValue;
  word(reg::ahb1enr::kOffset) = reg::ahb1enr::kResetValue;
  word(reg::csr::kOffset) = flags;
  hse_ready_.clear();
  pll_ready_.clear();
  lsi_ready_.clear();
  plan_buses();
}

// RM0402, RCC_CSR: every reset but power-on also pulls NRST low.
void Rcc::add_reset_flags(ResetCause cause) {
  std::uint32_t flags = reg::csr::kPadrstf.mask();
  if (cause == ResetCause::kPowerOn) word(reg::csr::kOffset) &= 0x00FF'FFFF;
  if (cause == ResetCause::kPowerOn) flags |= reg::csr::kPorrstf.mask() | reg::csr::kBorrstf.mask();
  if (cause == ResetCause::kSoftware) flags |= reg::csr::kSftrstf.mask();
  if (cause == ResetCause::kWatchdog) flags |= reg::csr::kWdgrstf.mask();
  word(reg::csr::kOffset) |= flags;
}

bool Rcc::pll_on() const { return reg::cr::kPllon.of(word(reg::cr::kOffset)) != 0; }

std::int64_t Rcc::pll_hz() const {
  const std::uint32_t configured = word(reg::pllcfgr::kOffset);
  const std::int64_t source = reg::pllcfgr::kPllsrc.of(configured) != 0 ? oscillators_.hse_hz : oscillators_.hsi_hz;
  const std::int64_t m = reg::pllcfgr::kPllm.of(configured);
  const std::int64_t p = 2 * (std::int64_t{reg::pllcfgr::kPllp.of(configured)} + 1);
  return m == 0 ? 0 : source * reg::pllcfgr::kPlln.of(configured) / m / p;
}

std::int64_t Rcc::sysclk_hz() const {
  switch (reg::cfgr::kSws.of(word(reg::cfgr::kOffset))) {
    case kHse:
      return oscillators_.hse_hz;
    case kPll:
      return pll_hz();
    default:
      return oscillators_.hsi_hz;
  }
}

void Rcc::check_pll() {
  const std::uint32_t configured = word(reg::pllcfgr::kOffset);
  const bool from_hse = reg::pllcfgr::kPllsrc.of(configured) != 0;
  if (from_hse && reg::cr::kHserdy.of(word(reg::cr::kOffset)) == 0) {
    complain("PLL switched on before its source HSE is ready");
  }
  const std::int64_t m = reg::pllcfgr::kPllm.of(configured), n = reg::pllcfgr::kPlln.of(configured);
  if (m < 2 || n < 50 || n > 432) return complain("PLLM or PLLN out of range");
  const std::int64_t input = (from_hse ? oscillators_.hse_hz : oscillators_.hsi_hz) / m;
  if (input < 950'000 || input > 2'100'000) complain("PLL input of " + khz(input) + ": 1 to 2 MHz are allowed");
  if (input * n < 100'000'000 || input * n > 440'000'000) {
    complain("PLL oscillator at " + khz(input * n) + ": 100 to 432 MHz are allowed");
  }
}

void Rcc::write_cr(std::uint32_t value) {
  const std::uint32_t before = word(reg::cr::kOffset);
  const std::uint32_t ready = reg::cr::kHserdy.mask() | reg::cr::kPllrdy.mask() | reg::cr::kHsirdy.mask();
  const std::uint32_t used = reg::cfgr::kSws.of(word(reg::cfgr::kOffset));
  word(reg::cr::kOffset) = (before & ready) | (value & ~ready);
  if (reg::cr::kHsion.of(value) == 0) {
    if (used == kHsi) {  // hardware keeps what drives the core
      complain("HSI switched off while it is the system clock: ignored");
      word(reg::cr::kOffset) |= reg::cr::kHsion.mask();
    } else {
      word(reg::cr::kOffset) &= ~reg::cr::kHsirdy.mask();
    }
  } else {
    word(reg::cr::kOffset) |= reg::cr::kHsirdy.mask();
  }
  const bool hse_on = reg::cr::kHseon.of(value) != 0, hse_was = reg::cr::kHseon.of(before) != 0;
  if (hse_on && !hse_was && oscillators_.crystal) hse_ready_.set(now() + oscillators_.hse_start);
  if (!hse_on) {
    if (used == kHse) complain("HSE switched off while it is the system clock");
    hse_ready_.clear();
    word(reg::cr::kOffset) &= ~reg::cr::kHserdy.mask();
  }
  const bool pll = reg::cr::kPllon.of(value) != 0, pll_was = reg::cr::kPllon.of(before) != 0;
  if (pll && !pll_was) {
    check_pll();
    const bool source =
        reg::pllcfgr::kPllsrc.of(word(reg::pllcfgr::kOffset)) == 0 || reg::cr::kHserdy.of(word(reg::cr::kOffset)) != 0;
    if (source) pll_ready_.set(now() + kPllLock);
  }
  if (!pll) {
    if (used == kPll) complain("PLL switched off while it is the system clock");
    pll_ready_.clear();
    word(reg::cr::kOffset) &= ~reg::cr::kPllrdy.mask();
  }
}

void Rcc::write_cfgr(std::uint32_t value) {
  const std::uint32_t wanted = reg::cfgr::kSw.of(value);
  const std::uint32_t cr = word(reg::cr::kOffset);
  const bool ready = wanted == kHsi   ? reg::cr::kHsirdy.of(cr) != 0
                     : wanted == kHse ? reg::cr::kHserdy.of(cr) != 0
                     : wanted == kPll ? reg::cr::kPllrdy.of(cr) != 0
                                      : false;
  std::uint32_t used = reg::cfgr::kSws.of(word(reg::cfgr::kOffset));
  if (ready) {
    used = wanted;
  } else if (wanted != used) {
    complain("CFGR.SW selects a clock that is not ready: not switched");
  }
  word(reg::cfgr::kOffset) = reg::cfgr::kSws.in(value, used);
  plan_buses();
}

void Rcc::plan_buses() {
  const std::uint32_t cfgr = word(reg::cfgr::kOffset);
  hclk_shift_ = ahb_shift(reg::cfgr::kHpre.of(cfgr));
  apb1_shift_ = apb_shift(reg::cfgr::kPpre1.of(cfgr));
  apb2_shift_ = apb_shift(reg::cfgr::kPpre2.of(cfgr));
  check_limits();
  if (on_change) on_change();
}

void Rcc::check_limits() {
  if (hclk_hz() > 101'000'000) complain("HCLK of " + khz(hclk_hz()) + ": 100 MHz is the limit");
  if (hclk_hz() > pwr_.limit_hz()) complain("HCLK of " + khz(hclk_hz()) + " is too fast for PWR_CR.VOS");
  if (hclk_hz() > flash_.limit_hz()) complain("HCLK of " + khz(hclk_hz()) + " with too few flash wait states");
  if (apb1_hz() > 50'500'000) complain("APB1 at " + khz(apb1_hz()) + ": 50 MHz is the limit");
  if (apb2_hz() > 101'000'000) complain("APB2 at " + khz(apb2_hz()) + ": 100 MHz is the limit");
}

std::uint32_t Rcc::read(std::uint32_t offset) { return offset / 4 < words_.size() ? word(offset) : 0; }

void Rcc::write(std::uint32_t offset, std::uint32_t value, std::uint32_t mask) {
  if (offset / 4 >= words_.size()) return;
  std::uint32_t merged = word(offset);
  merge(merged, value, mask);
  if (offset == reg::cr::kOffset) return write_cr(merged);
  if (offset == reg::cfgr::kOffset) return write_cfgr(merged);
  if (offset == reg::pllcfgr::kOffset && pll_on()) return complain("PLLCFGR written while the PLL is on: ignored");
  if (offset == reg::csr::kOffset) {
    const std::uint32_t kept = word(offset) & (0xFE00'0000 | reg::csr::kLsirdy.mask());
    const bool on = reg::csr::kLsion.of(merged) != 0;
    word(offset) = (reg::csr::kRmvf.of(merged) != 0 ? kept & ~0xFE00'0000U : kept) | reg::csr::kLsion(on ? 1 : 0);
    if (on && !lsi_ready_.pending()) lsi_ready_.set(now() + kLsiStart);
    if (!on) word(offset) &= ~reg::csr::kLsirdy.mask();
    return;
  }
  write_gate(offset, merged);
}

// RM0402, PWR_CR: reset value 0x0000 8000, so scale 2; the SVD has 0 there.
Pwr::Pwr(Surroundings around) : Peripheral(around, "PWR", hal::stm32f412::pwr::kPwr, kBytes) { reset(); }

void Pwr::reset() { cr_ = hal::stm32f412::pwr::cr::kVos(2); }

std::uint32_t Pwr::read(std::uint32_t offset) {
  if (offset == hal::stm32f412::pwr::cr::kOffset) return cr_;
  return hal::stm32f412::pwr::csr::kVosrdy.mask();
}

void Pwr::write(std::uint32_t offset, std::uint32_t value, std::uint32_t mask) {
  if (offset == hal::stm32f412::pwr::cr::kOffset) merge(cr_, value, mask);
}

std::int64_t Pwr::limit_hz() const {
  constexpr std::int64_t kLimits[] = {64'000'000, 64'000'000, 84'000'000, 101'000'000};
  return kLimits[hal::stm32f412::pwr::cr::kVos.of(cr_)];
}

}  // namespace tetap::board
