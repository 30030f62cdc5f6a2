// SPDX-License-Identifier: Apache-2.0
#include "sim_host/emulator/system_control.hpp"

#include "hal/chip/arm/cortex_m4.hpp"

namespace tetap::board {

namespace m4 = hal::cortex_m4;

SysTick::SysTick(Scheduler& scheduler, CoreClock& clock, Nvic& nvic)
    : scheduler_(scheduler), clock_(clock), nvic_(nvic), alarm_(scheduler, [this] { zero(); }) {}

void SysTick::reset() {
  control_ = reload_ = stopped_at_ = 0;
  count_flag_ = false;
  alarm_.clear();
}

std::int64_t SysTick::scale() const { return m4::systick::kClksource.of(control_) != 0 ? 1 : 8; }

std::uint32_t SysTick::read(std::uint32_t offset) {
  if (offset == m4::systick::kRvr) return reload_;
  if (offset == m4::systick::kCvr) {
    if (!alarm_.pending()) return stopped_at_;
    const std::int64_t left = (zero_cycle_ - cycle() + scale() - 1) / scale();
    return left > reload_ ? 0 : static_cast<std::uint32_t>(left);
  }
  const std::uint32_t value = control_ | m4::systick::kCountflag(count_flag_ ? 1 : 0);
  count_flag_ = false;
  return value;
}

void SysTick::write(std::uint32_t offset, std::uint32_t value) {
  if (offset == m4::systick::kRvr) {
    reload_ = value & 0xFF'FFFF;
    return;
  }
  if (offset == m4::systick::kCvr) {  // any write clears the counter and COUNTFLAG; the next clock loads it
    count_flag_ = false;
    stopped_at_ = 0;
  } else {
    if (alarm_.pending()) stopped_at_ = read(m4::systick::kCvr);
    control_ = value & 7;
  }
  if (m4::systick::kEnable.of(control_) == 0 || reload_ == 0) return alarm_.clear();
  zero_cycle_ = cycle() + (stopped_at_ != 0 ? std::int64_t{stopped_at_} : std::int64_t{reload_} + 1) * scale();
  alarm_.set(clock_.time_of(zero_cycle_));
}

void SysTick::replan() {
  if (alarm_.pending()) alarm_.set(clock_.time_of(zero_cycle_));
}

void SysTick::zero() {
  count_flag_ = true;
  if (m4::systick::kTickint.of(control_) != 0) nvic_.pend(exception::kSysTick);
  if (reload_ == 0) return;
  zero_cycle_ += (std::int64_t{reload_} + 1) * scale();
  alarm_.set(clock_.time_of(zero_cycle_));
}

SystemControl::SystemControl(Surroundings around, CoreClock& clock, Nvic& nvic)
    : Peripheral(around, "core", m4::kSystemControlSpace, kBytes),
      clock_(clock),
      nvic_(nvic),
      systick_(around.scheduler, clock, nvic) {}

void SystemControl::reset() {
  vtor_ = scr_ = prigroup_ = cfsr_ = hfsr_ = mmfar_ = bfar_ = cpacr_ = demcr_ = mpu_control_ = mpu_region_ = 0;
  ccr_ = 0x200;
  fpccr_ = 0xC000'0000;
  regions_.fill({});
  active_exception_ = 0;
  dwt_on_ = false;
  systick_.reset();
  nvic_.reset();
  if (on_mpu_change) on_mpu_change();
}

std::uint32_t SystemControl::bits(std::uint32_t offset, bool (Nvic::*get)(int) const) const {
  std::uint32_t word = 0;
  const int first = static_cast<int>(offset & 0x7F) * 8;
  for (int i = 0; i < 32 && first + i < Nvic::kInterrupts; ++i) {
    word |= ((nvic_.*get)(exception::kInterrupt0 + first + i) ? 1U : 0U) << i;
  }
  return word;
}

void SystemControl::write_bits(std::uint32_t offset, std::uint32_t value) {
  const int first = static_cast<int>(offset & 0x7F) * 8;
  const std::uint32_t group = offset & ~0x7FU;
  for (int i = 0; i < 32 && first + i < Nvic::kInterrupts; ++i) {
    const int number = exception::kInterrupt0 + first + i;
    if ((value >> i & 1) == 0) continue;
    if (group == m4::nvic::kIser || group == m4::nvic::kIcer) nvic_.enable(number, group == m4::nvic::kIser);
    if (group == m4::nvic::kIspr) nvic_.pend(number);
    if (group == m4::nvic::kIcpr) nvic_.unpend(number);
  }
}

std::uint32_t SystemControl::priorities(int first) const {
  std::uint32_t word = 0;
  for (int i = 0; i < 4; ++i) {
    const int number = first + i;
    if (number < Nvic::kExceptions && number > exception::kHardFault) {
      word |= static_cast<std::uint32_t>(nvic_.priority(number)) << 8 * i;
    }
  }
  return word;
}

void SystemControl::set_priorities(int first, std::uint32_t value, std::uint32_t mask) {
  for (int i = 0; i < 4; ++i) {
    const int number = first + i;
    if ((mask >> 8 * i & 0xFF) == 0 || number >= Nvic::kExceptions || number <= exception::kHardFault) continue;
    nvic_.set_priority(number, static_cast<int>(value >> 8 * i & 0xFF));
  }
}

std::uint32_t SystemControl::icsr() const {
  const int best = nvic_.best();
  std::uint32_t value = m4::scb::kVectactive(static_cast<std::uint32_t>(active_exception_)) |
                        m4::scb::kVectpending(static_cast<std::uint32_t>(best)) |
                        m4::scb::kRettobase(nvic_.active_count() == 1 ? 1 : 0);
  if (best >= exception::kInterrupt0) value |= m4::scb::kIsrpending.mask();
  if (nvic_.pending(exception::kSysTick)) value |= m4::scb::kPendstset.mask();
  if (nvic_.pending(exception::kPendSv)) value |= m4::scb::kPendsvset.mask();
  return value;
}

std::uint32_t SystemControl::read_scb(std::uint32_t offset) {
  switch (offset) {
    case m4::scb::kCpuid:
      return 0x410F'C241;  // Cortex-M4 r0p1, TRM table 4-1
    case m4::scb::kIcsr:
      return icsr();
    case m4::scb::kVtor:
      return vtor_;
    case m4::scb::kAircr:
      return 0xFA05'0000 | prigroup_ << 8;
    case m4::scb::kScr:
      return scr_;
    case m4::scb::kCcr:
      return ccr_;
    case m4::scb::kShcsr:
      return (nvic_.enabled(exception::kMemManage) ? m4::scb::kMemfaultena.mask() : 0) |
             (nvic_.enabled(exception::kBusFault) ? m4::scb::kBusfaultena.mask() : 0) |
             (nvic_.enabled(exception::kUsageFault) ? m4::scb::kUsgfaultena.mask() : 0);
    case m4::scb::kCfsr:
      return cfsr_;
    case m4::scb::kHfsr:
      return hfsr_;
    case m4::scb::kMmfar:
      return mmfar_;
    case m4::scb::kBfar:
      return bfar_;
    case m4::scb::kCpacr:
      return cpacr_;
    case m4::scb::kDemcr:
      return demcr_;
    case m4::mpu::kType:
      return 0x800;  // 8 regions
    case m4::mpu::kCtrl:
      return mpu_control_;
    case m4::mpu::kRnr:
      return mpu_region_;
    case m4::mpu::kRbar:
      return regions_[mpu_region_].rbar | mpu_region_;
    case m4::mpu::kRasr:
      return regions_[mpu_region_].rasr;
    case m4::fpu::kFpccr:
      return fpccr_;
    default:
      return 0;
  }
}

std::uint32_t SystemControl::read(std::uint32_t offset) {
  const std::uint32_t group = offset & ~0x7FU;
  if (offset >= m4::systick::kCsr && offset <= m4::systick::kCvr) return systick_.read(offset);
  if (group == m4::nvic::kIser || group == m4::nvic::kIcer) return bits(offset, &Nvic::enabled);
  if (group == m4::nvic::kIspr || group == m4::nvic::kIcpr) return bits(offset, &Nvic::pending);
  if (group == m4::nvic::kIabr) return bits(offset, &Nvic::active);
  if (offset >= m4::nvic::kIpr && offset < m4::nvic::kIpr + Nvic::kInterrupts) {
    return priorities(exception::kInterrupt0 + static_cast<int>(offset - m4::nvic::kIpr));
  }
  if (offset >= m4::scb::kShpr1 && offset <= m4::scb::kShpr3) {
    return priorities(4 + static_cast<int>(offset - m4::scb::kShpr1));
  }
  return read_scb(offset);
}

void SystemControl::write(std::uint32_t offset, std::uint32_t value, std::uint32_t mask) {
  const std::uint32_t group = offset & ~0x7FU;
  if (offset >= m4::systick::kCsr && offset <= m4::systick::kCvr) return systick_.write(offset, value);
  if (group >= m4::nvic::kIser && group < m4::nvic::kIabr) return write_bits(offset, value & mask);
  if (offset >= m4::nvic::kIpr && offset < m4::nvic::kIpr + Nvic::kInterrupts) {
    return set_priorities(exception::kInterrupt0 + static_cast<int>(offset - m4::nvic::kIpr), value, mask);
  }
  if (offset >= m4::scb::kShpr1 && offset <= m4::scb::kShpr3) {
    return set_priorities(4 + static_cast<int>(offset - m4::scb::kShpr1), value, mask);
  }
  if (offset == m4::nvic::kStir) return nvic_.pend(exception::kInterrupt0 + static_cast<int>(value & 0x1FF));
  write_scb(offset, value, mask);
}

void SystemControl::write_icsr(std::uint32_t value) {
  if (m4::scb::kPendstset.of(value) != 0) nvic_.pend(exception::kSysTick);
  if (m4::scb::kPendstclr.of(value) != 0) nvic_.unpend(exception::kSysTick);
  if (m4::scb::kPendsvset.of(value) != 0) nvic_.pend(exception::kPendSv);
  if (m4::scb::kPendsvclr.of(value) != 0) nvic_.unpend(exception::kPendSv);
  if (m4::scb::kNmipendset.of(value) != 0) nvic_.pend(exception::kNmi);
}

void SystemControl::write_aircr(std::uint32_t value) {
  if (m4::scb::kVectkey.of(value) != 0x05FA) return complain("AIRCR written without its key: ignored");
  prigroup_ = m4::scb::kPrigroup.of(value);
  nvic_.set_group(static_cast<int>(prigroup_));
  if (m4::scb::kSysresetreq.of(value) != 0 && on_reset_request) on_reset_request();
}

void SystemControl::write_mpu(std::uint32_t offset, std::uint32_t value) {
  if (offset == m4::mpu::kCtrl) mpu_control_ = value & 7;
  if (offset == m4::mpu::kRnr) mpu_region_ = value & 7;
  if (offset == m4::mpu::kRbar) {
    if (m4::mpu::kValid.of(value) != 0) mpu_region_ = m4::mpu::kRegion.of(value) & 7;
    regions_[mpu_region_].rbar = value & ~0x1FU;
  }
  if (offset == m4::mpu::kRasr) regions_[mpu_region_].rasr = value;
  if (on_mpu_change) on_mpu_change();
}

void SystemControl::write_scb(std::uint32_t offset, std::uint32_t value, std::uint32_t mask) {
  switch (offset) {
    case m4::scb::kIcsr:
      return write_icsr(value);
    case m4::scb::kVtor:
      if ((value & 0x1FF) != 0) complain("VTOR is not aligned to the 512 bytes of 113 vectors");
      vtor_ = value & 0x3FFF'FF80;
      return;
    case m4::scb::kAircr:
      return write_aircr(value);
    case m4::scb::kScr:
      scr_ = value;
      if (m4::scb::kSleepdeep.of(value) != 0) complain("SLEEPDEEP set: Stop and Standby are not modelled");
      return;
    case m4::scb::kCcr:
      if ((value & (m4::scb::kDiv0Trp.mask() | m4::scb::kUnalignTrp.mask())) != 0) {
        complain("CCR: traps of division by zero and of unaligned words are not modelled");
      }
      ccr_ = value;
      return;
    case m4::scb::kShcsr:
      nvic_.enable(exception::kMemManage, m4::scb::kMemfaultena.of(value) != 0);
      nvic_.enable(exception::kBusFault, m4::scb::kBusfaultena.of(value) != 0);
      nvic_.enable(exception::kUsageFault, m4::scb::kUsgfaultena.of(value) != 0);
      return;
    case m4::scb::kCfsr:
      cfsr_ &= ~(value & mask);
      return;
    case m4::scb::kHfsr:
      hfsr_ &= ~value;
      return;
    case m4::scb::kCpacr:
      cpacr_ = value & 0x00F0'0000;
      return;
    case m4::scb::kDemcr:
      demcr_ = value;
      return;
    case m4::mpu::kCtrl:
    case m4::mpu::kRnr:
    case m4::mpu::kRbar:
    case m4::mpu::kRasr:
      return write_mpu(offset, value);
    case m4::fpu::kFpccr:
      fpccr_ = value;
      return;
    default:
      return;
  }
}

void SystemControl::report_fault(std::uint32_t cfsr, bool with_address, std::uint32_t address) {
  cfsr_ |= cfsr;
  if (!with_address) return;
  const bool memory_management = (cfsr & 0xFF) != 0;
  (memory_management ? mmfar_ : bfar_) = address;
  cfsr_ |= memory_management ? m4::scb::kMmarvalid.mask() : m4::scb::kBfarvalid.mask();
}

std::uint32_t SystemControl::read_dwt(std::uint32_t offset) {
  if (offset == m4::dwt::kCtrl) return 0x4000'0000 | (dwt_on_ ? 1U : 0U);
  if (offset != m4::dwt::kCyccnt) return 0;
  if (!dwt_on_) return static_cast<std::uint32_t>(dwt_zero_cycle_);
  return static_cast<std::uint32_t>(clock_.cycle_at(now()) - dwt_zero_cycle_);
}

// While the counter is off, dwt_zero_cycle_ holds its value.
void SystemControl::write_dwt(std::uint32_t offset, std::uint32_t value) {
  if (m4::scb::kTrcena.of(demcr_) == 0) return complain("DWT written with DEMCR.TRCENA = 0: ignored");
  const std::int64_t cycle = clock_.cycle_at(now());
  if (offset == m4::dwt::kCyccnt) dwt_zero_cycle_ = dwt_on_ ? cycle - value : value;
  if (offset == m4::dwt::kCtrl) {
    const bool on = m4::dwt::kCyccntena.of(value) != 0;
    if (on != dwt_on_) dwt_zero_cycle_ = cycle - dwt_zero_cycle_;
    dwt_on_ = on;
  }
}

}  // namespace tetap::board
