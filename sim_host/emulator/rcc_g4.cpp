// SPDX-License-Identifier: Apache-2.0
#include "sim_host/emulator/rcc_g4.hpp"

#include "hal/chip/stm32/registers_stm32g474.hpp"
#include "sim_host/emulator/flash_g4.hpp"

#include <algorithm>

namespace tetap::board {

namespace reg = hal::stm32g474::rcc;
namespace pwr_reg = hal::stm32g474::pwr;

namespace {

constexpr std::size_t kRegisters = 0x28;               // RCC_CCIPR2 at 0x9C is the last one
constexpr Picoseconds kPllLock = 40 * kMicrosecond;    // DS12288, PLL characteristics: at most
constexpr Picoseconds kLsiStart = 130 * kMicrosecond;  // DS12288, LSI: at most
constexpr std::uint32_t kHsi = 1, kHse = 2, kPll = 3;  // CFGR.SW
constexpr std::uint32_t kFromHsi = 2, kFromHse = 3;    // PLLCFGR.PLLSRC
constexpr std::uint32_t kResetCr = 0x0000'0500;        // RM0440, RCC_CR; the SVD has 0x63
constexpr std::uint32_t kAllFlags = 0xFE00'0000;       // RCC_CSR
constexpr std::int64_t kFast = 80'000'000;             // above it HCLK is raised in two steps
constexpr Picoseconds kSettle = kMicrosecond;

/// One per cent for an HSI at the end of its tolerance.
constexpr std::int64_t with_tolerance(std::int64_t hz) { return hz + hz / 100; }

}  // namespace

PwrG4::PwrG4(Surroundings around) : Peripheral(around, "PWR", pwr_reg::kPwr, kBytes) { reset(); }

void PwrG4::reset() {
  cr1_ = pwr_reg::cr1::kResetValue;
  cr3_ = pwr_reg::cr3::kResetValue;
  cr5_ = pwr_reg::cr5::kResetValue;
}

std::uint32_t PwrG4::read(std::uint32_t offset) {
  switch (offset) {
    case pwr_reg::cr1::kOffset:
      return cr1_;
    case pwr_reg::cr3::kOffset:
      return cr3_;
    case pwr_reg::cr5::kOffset:
      return cr5_;
    default:
      return 0;  // SR2.VOSF = 0: the regulator has settled
  }
}

void PwrG4::write(std::uint32_t offset, std::uint32_t value, std::uint32_t mask) {
  if (offset == pwr_reg::cr1::kOffset) {
    merge(cr1_, value, mask);
    const std::uint32_t vos = pwr_reg::cr1::kVos.of(cr1_);
    if (vos != 1 && vos != 2) complain("CR1.VOS of 0 or 3 is not allowed");
    if (pwr_reg::cr1::kLpr.of(cr1_) != 0) complain("low-power run is not modelled");
  }
  if (offset == pwr_reg::cr3::kOffset) merge(cr3_, value, mask);
  if (offset == pwr_reg::cr5::kOffset) merge(cr5_, value & pwr_reg::cr5::kR1mode.mask(), mask);
  if (on_change) on_change();
}

PwrG4::Range PwrG4::range() const {
  if (pwr_reg::cr1::kVos.of(cr1_) != 1) return Range::kLow;
  return pwr_reg::cr5::kR1mode.of(cr5_) == 0 ? Range::kBoost : Range::kNormal;
}

std::int64_t PwrG4::limit_hz() const {
  constexpr std::int64_t kLimits[] = {170'000'000, 150'000'000, 26'000'000};
  return with_tolerance(kLimits[static_cast<std::size_t>(range())]);
}

bool PwrG4::dead_battery_pull_down() const { return pwr_reg::cr3::kUcpd1Dbdis.of(cr3_) == 0; }

RccG4::RccG4(Surroundings around, const Oscillators& oscillators, const PwrG4& pwr, const FlashG4& flash)
    : ClockController(around, reg::kRcc, kRegisters),
      oscillators_(oscillators),
      pwr_(pwr),
      flash_(flash),
      hse_ready_(around.scheduler, [this] { word(reg::cr::kOffset) |= reg::cr::kHserdy.mask(); }),
      pll_ready_(around.scheduler, [this] { word(reg::cr::kOffset) |= reg::cr::kPllrdy.mask(); }),
      lsi_ready_(around.scheduler, [this] { word(reg::csr::kOffset) |= reg::csr::kLsirdy.mask(); }) {
  reset();
}

void RccG4::reset() {
  const std::uint32_t flags = word(reg::csr::kOffset) & kAllFlags;
  words_.assign(kRegisters, 0);
  word(reg::cr::kOffset) = kResetCr;
  word(reg::cfgr::kOffset) = reg::cfgr::kResetValue;
  word(reg::pllcfgr::kOffset) = reg::pllcfgr::kResetValue;
  word(reg::ahb1enr::kOffset) = reg::ahb1enr::kResetValue;
  word(reg::apb1enr1::kOffset) = reg::apb1enr1::kResetValue;
  word(reg::csr::kOffset) = flags;
  hse_ready_.clear();
  pll_ready_.clear();
  lsi_ready_.clear();
  plan_buses();
}

// RM0440, "System reset": every reset pulls NRST low, too.
void RccG4::add_reset_flags(ResetCause cause) {
  std::uint32_t flags = reg::csr::kPinrstf.mask();
  if (cause == ResetCause::kPowerOn) word(reg::csr::kOffset) &= ~kAllFlags;
  if (cause == ResetCause::kPowerOn) flags |= reg::csr::kBorrstf.mask();
  if (cause == ResetCause::kSoftware) flags |= reg::csr::kSftrstf.mask();
  if (cause == ResetCause::kWatchdog) flags |= reg::csr::kIwdgrstf.mask();
  word(reg::csr::kOffset) |= flags;
}

bool RccG4::pll_on() const { return reg::cr::kPllon.of(word(reg::cr::kOffset)) != 0; }
bool RccG4::pll_ready() const { return reg::cr::kPllrdy.of(word(reg::cr::kOffset)) != 0; }
bool RccG4::hse_ready() const { return reg::cr::kHserdy.of(word(reg::cr::kOffset)) != 0; }

std::int64_t RccG4::vco_hz() const {
  const std::uint32_t configured = word(reg::pllcfgr::kOffset);
  const std::uint32_t source = reg::pllcfgr::kPllsrc.of(configured);
  const std::int64_t input = source == kFromHse ? oscillators_.hse_hz : source == kFromHsi ? oscillators_.hsi_hz : 0;
  return input * reg::pllcfgr::kPlln.of(configured) / (std::int64_t{reg::pllcfgr::kPllm.of(configured)} + 1);
}

std::int64_t RccG4::sysclk_hz() const {
  switch (reg::cfgr::kSws.of(word(reg::cfgr::kOffset))) {
    case kHse:
      return oscillators_.hse_hz;
    case kPll:  // PLLR: 2, 4, 6, 8
      return vco_hz() / (2 * (std::int64_t{reg::pllcfgr::kPllr.of(word(reg::pllcfgr::kOffset))} + 1));
    default:
      return oscillators_.hsi_hz;
  }
}

// RM0440, RCC_CCIPR.USARTxSEL: bus, SYSCLK, HSI16, LSE.
std::int64_t RccG4::usart_hz(std::uint32_t select, std::int64_t bus_hz) const {
  const std::int64_t hsi = reg::cr::kHsirdy.of(word(reg::cr::kOffset)) != 0 ? oscillators_.hsi_hz : 0;
  const std::int64_t sources[] = {bus_hz, sysclk_hz(), hsi, 0};
  return sources[select];
}

std::int64_t RccG4::usart1_hz() const {
  return usart_hz(reg::ccipr::kUsart1sel.of(word(reg::ccipr::kOffset)), apb2_hz());
}

std::int64_t RccG4::usart2_hz() const {
  return usart_hz(reg::ccipr::kUsart2sel.of(word(reg::ccipr::kOffset)), apb1_hz());
}

// RM0440, RCC_CCIPR.FDCANSEL: HSE, PLL "Q", PCLK1, reserved.
std::int64_t RccG4::fdcan_hz() const {
  const std::uint32_t configured = word(reg::pllcfgr::kOffset);
  switch (reg::ccipr::kFdcansel.of(word(reg::ccipr::kOffset))) {
    case 0:
      return hse_ready() ? oscillators_.hse_hz : 0;
    case 1:
      if (!pll_ready() || reg::pllcfgr::kPllqen.of(configured) == 0) return 0;
      return vco_hz() / (2 * (std::int64_t{reg::pllcfgr::kPllq.of(configured)} + 1));
    case 2:
      return apb1_hz();
    default:
      return 0;
  }
}

// DS12288, PLL characteristics: input 2.66 to 16 MHz, VCO 96 to 344 MHz.
void RccG4::check_pll() {
  const std::uint32_t configured = word(reg::pllcfgr::kOffset);
  const std::uint32_t source = reg::pllcfgr::kPllsrc.of(configured);
  if (source < kFromHsi) return complain("PLL switched on without a source");
  if (source == kFromHse && !hse_ready()) complain("PLL switched on before its source HSE is ready");
  const std::int64_t n = reg::pllcfgr::kPlln.of(configured);
  if (n < 8) return complain("PLLN below 8");
  const std::int64_t input = vco_hz() / n;
  if (input < 2'660'000 || input > 16'000'000) complain("PLL input of " + khz(input) + ": 2.66 to 16 MHz are allowed");
  if (vco_hz() < 95'000'000 || vco_hz() > with_tolerance(344'000'000)) {
    complain("PLL oscillator at " + khz(vco_hz()) + ": 96 to 344 MHz are allowed");
  }
}

void RccG4::write_hsi(std::uint32_t value) {
  std::uint32_t& cr = word(reg::cr::kOffset);
  if (reg::cr::kHsion.of(value) != 0) {
    cr |= reg::cr::kHsirdy.mask();
  } else if (reg::cfgr::kSws.of(word(reg::cfgr::kOffset)) == kHsi) {  // hardware keeps what drives the core
    complain("HSI16 switched off while it is the system clock: ignored");
    cr |= reg::cr::kHsion.mask();
  } else {
    cr &= ~reg::cr::kHsirdy.mask();
  }
}

void RccG4::write_cr(std::uint32_t value) {
  const std::uint32_t before = word(reg::cr::kOffset);
  const std::uint32_t ready = reg::cr::kHserdy.mask() | reg::cr::kPllrdy.mask() | reg::cr::kHsirdy.mask();
  const std::uint32_t used = reg::cfgr::kSws.of(word(reg::cfgr::kOffset));
  word(reg::cr::kOffset) = (before & ready) | (value & ~ready);
  write_hsi(value);
  if (reg::cr::kHsebyp.of(value) != 0 && oscillators_.crystal) complain("HSEBYP with a crystal: it does not start");
  // RM0440 section "Clock control register (RCC_CR)": a reset alone clears CSSON. A crystal here never stops once it
  // runs.
  word(reg::cr::kOffset) |= before & reg::cr::kCsson.mask();
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
    const std::uint32_t source = reg::pllcfgr::kPllsrc.of(word(reg::pllcfgr::kOffset));
    if (source == kFromHsi || (source == kFromHse && hse_ready())) pll_ready_.set(now() + kPllLock);
  }
  if (!pll) {
    if (used == kPll) complain("PLL switched off while it is the system clock");
    pll_ready_.clear();
    word(reg::cr::kOffset) &= ~reg::cr::kPllrdy.mask();
  }
}

void RccG4::write_cfgr(std::uint32_t value) {
  const std::uint32_t wanted = reg::cfgr::kSw.of(value), cr = word(reg::cr::kOffset);
  const bool output_r = reg::pllcfgr::kPllren.of(word(reg::pllcfgr::kOffset)) != 0;
  const bool ready = wanted == kHsi   ? reg::cr::kHsirdy.of(cr) != 0
                     : wanted == kHse ? hse_ready()
                     : wanted == kPll ? pll_ready() && output_r
                                      : false;
  const std::int64_t before = hclk_hz();
  const std::uint32_t used = reg::cfgr::kSws.of(word(reg::cfgr::kOffset));
  if (!ready && wanted != used) complain("CFGR.SW selects a clock that is not ready: not switched");
  word(reg::cfgr::kOffset) = reg::cfgr::kSws.in(value, ready ? wanted : used);
  plan_buses();
  check_step(before, ready && wanted != used);
}

// RM0440, 7.2.7 "System clock (SYSCLK) selection": from HSE or HSI16 to a HCLK above 80 MHz, the AHB is divided by two
// for at least 1 us behind the switch to the PLL. The manual recommends it; the way down is not looked at.
void RccG4::check_step(std::int64_t before, bool source_changed) {
  if (hclk_hz() > with_tolerance(kFast) && before <= kFast) {
    if (source_changed) complain("HCLK raised to " + khz(hclk_hz()) + " at once: divide the AHB by two for 1 us first");
    if (!source_changed && now() < switched_at_ + kSettle) complain("AHB divider removed within 1 us of the switch");
  }
  if (source_changed) switched_at_ = now();
}

// RM0440, RCC_PLLCFGR: only the outputs may be switched while the PLL is on.
void RccG4::write_pllcfgr(std::uint32_t value) {
  std::uint32_t& configured = word(reg::pllcfgr::kOffset);
  const std::uint32_t outputs =
      reg::pllcfgr::kPllpen.mask() | reg::pllcfgr::kPllqen.mask() | reg::pllcfgr::kPllren.mask();
  if (pll_on() && ((configured ^ value) & ~outputs) != 0)
    return complain("PLLCFGR changed while the PLL is on: ignored");
  const bool used = reg::cfgr::kSws.of(word(reg::cfgr::kOffset)) == kPll;
  if (used && reg::pllcfgr::kPllren.of(value) == 0) return complain("PLLREN cleared while it is the system clock");
  configured = value;
}

void RccG4::plan_buses() {
  const std::uint32_t cfgr = word(reg::cfgr::kOffset);
  hclk_shift_ = ahb_shift(reg::cfgr::kHpre.of(cfgr));
  apb1_shift_ = apb_shift(reg::cfgr::kPpre1.of(cfgr));
  apb2_shift_ = apb_shift(reg::cfgr::kPpre2.of(cfgr));
  check_limits();
  if (on_change) on_change();
}

void RccG4::check_limits() {
  if (hclk_hz() > pwr_.limit_hz())
    complain("HCLK of " + khz(hclk_hz()) + " is too fast for PWR_CR1.VOS and PWR_CR5.R1MODE");
  if (hclk_hz() > flash_.limit_hz()) complain("HCLK of " + khz(hclk_hz()) + " with too few flash wait states");
}

std::uint32_t RccG4::read(std::uint32_t offset) { return offset / 4 < words_.size() ? word(offset) : 0; }

void RccG4::write_csr(std::uint32_t value) {
  std::uint32_t& csr = word(reg::csr::kOffset);
  const std::uint32_t flags = reg::csr::kRmvf.of(value) != 0 ? 0 : csr & kAllFlags;
  const bool on = reg::csr::kLsion.of(value) != 0;
  csr = flags | (csr & reg::csr::kLsirdy.mask()) | reg::csr::kLsion(on ? 1 : 0);
  if (on && !lsi_ready_.pending()) lsi_ready_.set(now() + kLsiStart);
  if (!on) csr &= ~reg::csr::kLsirdy.mask();
}

void RccG4::write(std::uint32_t offset, std::uint32_t value, std::uint32_t mask) {
  if (offset / 4 >= words_.size()) return;
  std::uint32_t merged = word(offset);
  merge(merged, value, mask);
  switch (offset) {
    case reg::cr::kOffset:
      return write_cr(merged);
    case reg::cfgr::kOffset:
      return write_cfgr(merged);
    case reg::pllcfgr::kOffset:
      return write_pllcfgr(merged);
    case reg::csr::kOffset:
      return write_csr(merged);
    default:
      return write_gate(offset, merged);
  }
}

}  // namespace tetap::board
