// SPDX-License-Identifier: Apache-2.0
#include "sim_host/emulator/encoder_timer.hpp"

#include "hal/chip/stm32/registers_stm32f412.hpp"

#include <utility>

namespace tetap::board {

namespace reg = hal::stm32f412::tim;

EncoderTimer::EncoderTimer(Surroundings around, std::string name, std::uint32_t base, const Pins& pins, Wiring wiring,
                           std::function<std::int64_t()> clock_hz)
    : Peripheral(around, std::move(name), base, kHalfWords),
      pins_(pins),
      wiring_(wiring),
      clock_hz_(std::move(clock_hz)) {
  arr_ = full();
}

// RM0402, TIMx_ARR: the SVD has 0 as the reset value, the manual 0xFFFF (0xFFFF FFFF in TIM2 and TIM5).
void EncoderTimer::reset() {
  cr1_ = smcr_ = dier_ = sr_ = ccmr1_ = ccer_ = cnt_ = psc_ = prescaled_ = 0;
  arr_ = full();
  if (position) seen_ = position(now());
  set_interrupt(wiring_.interrupt, false);
}

std::uint32_t EncoderTimer::full() const { return wiring_.width == 32 ? 0xFFFF'FFFFU : 0xFFFFU; }

std::uint32_t EncoderTimer::sms() const { return reg::smcr::kSms.of(smcr_); }

// RM0402, TIMx_CCMR1.IC1F: samples needed at a rate of fDTS or a part of it.
Picoseconds EncoderTimer::filter_time() const {
  constexpr std::int64_t kSamples[] = {0, 2, 4, 8, 6, 8, 6, 8, 6, 8, 5, 6, 8, 5, 6, 8};
  constexpr std::int64_t kDivider[] = {1, 1, 1, 1, 2, 2, 4, 4, 8, 8, 16, 16, 16, 32, 32, 32};
  const std::uint32_t code = reg::ccmr1_input::kIc1f.of(ccmr1_);
  const std::int64_t internal = code <= 3 ? 1 : std::int64_t{1} << reg::cr1::kCkd.of(cr1_);
  return periods(kSamples[code] * kDivider[code] * internal, clock_hz_());
}

void EncoderTimer::check() {
  if (!encoder_mode()) return complain("counts without encoder mode are not modelled (SMS)");
  if (reg::ccmr1_input::kCc1s.of(ccmr1_) != 1 || reg::ccmr1_input::kCc2s.of(ccmr1_) != 1) {
    complain("encoder mode with CC1S or CC2S other than 01: the lines do not reach the counter");
  }
  if ((smcr_ >> 16) != 0) complain("SMCR above bit 15 selects modes that are not modelled");
  if (on_start) on_start();
  if (psc_ != 0) complain("encoder mode with PSC other than 0: edges are divided");
  if (arr_ != full()) complain("encoder mode with ARR below full width: the count jumps");
  if (sms() != 3) complain("encoder mode on one line only: half of the edges are lost");
  for (const auto& [signal, pin] :
       {std::pair{wiring_.ch1_signal, wiring_.ch1}, std::pair{wiring_.ch2_signal, wiring_.ch2}}) {
    if (!pins_.carries(pin, signal)) complain(std::string(name_of(signal)) + " counts, but " + pins_.describe(pin));
  }
}

void EncoderTimer::count(bool up) {
  if (prescaled_++ < psc_) return;
  prescaled_ = 0;
  cr1_ = reg::cr1::kDir.in(cr1_, up ? 0 : 1);
  if (up) {
    const bool wraps = cnt_ == arr_;
    cnt_ = wraps ? 0 : (cnt_ + 1) & full();
    if (wraps) sr_ |= reg::sr::kUif.mask();
  } else {
    const bool wraps = cnt_ == 0;
    cnt_ = wraps ? arr_ : cnt_ - 1;
    if (wraps) sr_ |= reg::sr::kUif.mask();
  }
}

// One edge. Phase counts quarters of a period: from an even phase to the next line A changes, from an odd one line B.
void EncoderTimer::step(bool forward, std::int64_t phase) {
  const bool line_a = forward ? (phase & 1) == 0 : (phase & 1) != 0;
  const bool wired_a = pins_.carries(wiring_.ch1, wiring_.ch1_signal) && reg::ccmr1_input::kCc1s.of(ccmr1_) == 1;
  const bool wired_b = pins_.carries(wiring_.ch2, wiring_.ch2_signal) && reg::ccmr1_input::kCc2s.of(ccmr1_) == 1;
  if (line_a ? !wired_a : !wired_b) return;
  if (line_a ? sms() == 1 : sms() == 2) return;  // SMS 1 counts edges of TI2, SMS 2 of TI1
  const bool inverted = (reg::ccer::kCc1p.of(ccer_) ^ reg::ccer::kCc2p.of(ccer_)) != 0;
  const bool one_line = wired_a != wired_b;  // the other line stands still: up and down by turns
  count(one_line ? (phase & 2) == 0 : forward != inverted);
}

void EncoderTimer::follow() {
  if (!position) return;
  const std::int64_t here = position(now());
  if (reg::cr1::kCen.of(cr1_) == 0 || !encoder_mode()) {
    seen_ = here;
    return;
  }
  while (seen_ < here) step(true, seen_++);
  while (seen_ > here) step(false, seen_--);
  set_interrupt(wiring_.interrupt, reg::dier::kUie.of(dier_) != 0 && reg::sr::kUif.of(sr_) != 0);
}

std::uint32_t EncoderTimer::read(std::uint32_t offset) {
  follow();
  switch (offset) {
    case reg::cr1::kOffset:
      return cr1_;
    case reg::smcr::kOffset:
      return smcr_;
    case reg::dier::kOffset:
      return dier_;
    case reg::sr::kOffset:
      return sr_;
    case reg::ccmr1_input::kOffset:
      return ccmr1_;
    case reg::ccer::kOffset:
      return ccer_;
    case reg::cnt::kOffset:
      return cnt_;
    case reg::psc::kOffset:
      return psc_;
    case reg::arr::kOffset:
      return arr_;
    default:
      return 0;
  }
}

void EncoderTimer::write(std::uint32_t offset, std::uint32_t value, std::uint32_t mask) {
  follow();
  switch (offset) {
    case reg::cr1::kOffset: {
      const bool was = reg::cr1::kCen.of(cr1_) != 0;
      if ((value & mask & ~0x3FFU) != 0) complain("CR1 above bit 9 selects modes that are not modelled");
      merge(cr1_, value & 0x3FF, mask);
      if (reg::cr1::kCen.of(cr1_) != 0 && !was) check();
      break;
    }
    case reg::smcr::kOffset:
      if (reg::cr1::kCen.of(cr1_) != 0) complain("SMS changed while CEN = 1");
      merge(smcr_, value, mask);
      break;
    case reg::dier::kOffset:
      merge(dier_, value, mask);
      break;
    case reg::sr::kOffset:
      sr_ &= value | ~mask;
      break;
    case reg::egr::kOffset:
      if (reg::egr::kUg.of(value) != 0) cnt_ = 0;
      break;
    case reg::ccmr1_input::kOffset:
      merge(ccmr1_, value, mask);
      break;
    case reg::ccer::kOffset:
      merge(ccer_, value, mask);
      break;
    case reg::cnt::kOffset:
      merge(cnt_, value & full(), mask);
      break;
    case reg::psc::kOffset:
      merge(psc_, value & 0xFFFF, mask);
      break;
    case reg::arr::kOffset:
      merge(arr_, value & full(), mask);
      break;
    default:
      break;
  }
  set_interrupt(wiring_.interrupt, reg::dier::kUie.of(dier_) != 0 && reg::sr::kUif.of(sr_) != 0);
}

}  // namespace tetap::board
