// SPDX-License-Identifier: Apache-2.0
#include "sim_host/emulator/usart_g4.hpp"

#include "hal/chip/stm32/registers_stm32f412.hpp"
#include "hal/chip/stm32/registers_stm32g474.hpp"

#include <algorithm>

namespace tetap::board {

namespace reg = hal::stm32g474::usart;
namespace older = hal::stm32f412::usart;

// The base works on flags and enable bits that lie at the same places in both ports.
static_assert(reg::isr::kRxne.lsb == older::sr::kRxne.lsb && reg::isr::kTxe.lsb == older::sr::kTxe.lsb &&
              reg::isr::kTc.lsb == older::sr::kTc.lsb && reg::isr::kOre.lsb == older::sr::kOre.lsb &&
              reg::isr::kIdle.lsb == older::sr::kIdle.lsb && reg::isr::kFe.lsb == older::sr::kFe.lsb &&
              reg::cr1::kRxneie.lsb == older::cr1::kRxneie.lsb && reg::cr1::kTxeie.lsb == older::cr1::kTxeie.lsb &&
              reg::cr1::kTcie.lsb == older::cr1::kTcie.lsb && reg::cr1::kIdleie.lsb == older::cr1::kIdleie.lsb &&
              reg::cr1::kRe.lsb == older::cr1::kRe.lsb && reg::cr1::kTe.lsb == older::cr1::kTe.lsb &&
              reg::cr1::kOver8.lsb == older::cr1::kOver8.lsb && reg::cr3::kDmar.lsb == older::cr3::kDmar.lsb &&
              reg::cr3::kDmat.lsb == older::cr3::kDmat.lsb && reg::cr3::kEie.lsb == older::cr3::kEie.lsb);

void UsartG4::reset() {
  presc_ = 0;
  Usart::reset();
}

bool UsartG4::on() const { return reg::cr1::kUe.of(cr1_) != 0; }

bool UsartG4::overrun_off() const { return reg::cr3::kOvrdis.of(cr3_) != 0; }

// RM0440, USART_PRESC: 1, 2, 4, 6, 8, 10, 12, 16, 32, 64, 128, 256.
std::int64_t UsartG4::baud() const {
  constexpr std::int64_t kDividers[] = {1, 2, 4, 6, 8, 10, 12, 16, 32, 64, 128, 256};
  return std::max<std::int64_t>(Usart::baud() / kDividers[std::min<std::uint32_t>(presc_, 11)], 1);
}

std::uint32_t UsartG4::read(std::uint32_t offset) {
  switch (offset) {
    case reg::cr1::kOffset:
      return cr1_;
    case reg::cr2::kOffset:
      return cr2_;
    case reg::cr3::kOffset:
      return cr3_;
    case reg::brr::kOffset:
      return brr_;
    case reg::isr::kOffset:
      return sr_ | reg::isr::kTeack(on() ? reg::cr1::kTe.of(cr1_) : 0) |
             reg::isr::kReack(on() ? reg::cr1::kRe.of(cr1_) : 0) | reg::isr::kBusy(received_.pending() ? 1 : 0);
    case reg::rdr::kOffset:  // the error flags stay: ICR clears them
      sr_ &= ~reg::isr::kRxne.mask();
      update();
      return data_;
    case reg::tdr::kOffset:
      return waiting_.value_or(0);
    case reg::presc::kOffset:
      return presc_;
    default:
      return 0;
  }
}

void UsartG4::write_cr1(std::uint32_t value) {
  const bool was = on();
  const std::uint32_t shape = reg::cr1::kM0.mask() | reg::cr1::kM1.mask() | reg::cr1::kPce.mask() |
                              reg::cr1::kOver8.mask() | reg::cr1::kFifoen.mask();
  if (was && ((cr1_ ^ value) & shape) != 0) complain("CR1: the frame's shape changed while UE = 1");
  cr1_ = value;
  if (!on() && was && sent_.pending()) complain("switched off during a character");
  if (on() && !was && brr_ < 16) complain("switched on with BRR below 16");
  if (on() && clock_hz_() == 0) complain("switched on, but the kernel clock that RCC_CCIPR selects does not run");
  const std::uint32_t known = shape | reg::cr1::kUe.mask() | reg::cr1::kTe.mask() | reg::cr1::kRe.mask() |
                              reg::cr1::kRxneie.mask() | reg::cr1::kTxeie.mask() | reg::cr1::kTcie.mask() |
                              reg::cr1::kIdleie.mask();
  const std::uint32_t other = (shape & ~reg::cr1::kOver8.mask()) | ~known;
  if ((cr1_ & other) != 0) complain("CR1: only 8 bits without parity, FIFO, time-out and wake-up are modelled");
}

void UsartG4::write_cr2(std::uint32_t value) {
  if (on() && value != cr2_) complain("CR2 changed while UE = 1");
  cr2_ = value;
  if (cr2_ != 0) complain("CR2: only one stop bit and straight lines are modelled");
}

void UsartG4::write_cr3(std::uint32_t value) {
  const std::uint32_t shape = reg::cr3::kOvrdis.mask() | reg::cr3::kOnebit.mask();
  if (on() && ((cr3_ ^ value) & shape) != 0) complain("CR3: OVRDIS or ONEBIT changed while UE = 1");
  cr3_ = value;
  const std::uint32_t known = shape | reg::cr3::kEie.mask() | reg::cr3::kDmar.mask() | reg::cr3::kDmat.mask();
  if ((cr3_ & ~known) != 0) complain("CR3: flow control, half duplex and FIFO thresholds are not modelled");
  raise_requests();
}

void UsartG4::send(std::uint32_t value) {
  if (!on() || reg::cr1::kTe.of(cr1_) == 0) return complain("TDR written with the transmitter off: lost");
  if (reg::isr::kTxe.of(sr_) == 0) complain("TDR written before TXE: the waiting byte is lost");
  sr_ &= ~reg::isr::kTc.mask();
  put_data(static_cast<std::uint8_t>(value));
}

void UsartG4::write(std::uint32_t offset, std::uint32_t value, std::uint32_t mask) {
  const auto merged = [&](std::uint32_t word) {
    merge(word, value, mask);
    return word;
  };
  switch (offset) {
    case reg::cr1::kOffset:
      write_cr1(merged(cr1_));
      break;
    case reg::cr2::kOffset:
      write_cr2(merged(cr2_));
      break;
    case reg::cr3::kOffset:
      write_cr3(merged(cr3_));
      break;
    case reg::brr::kOffset:
      if (on()) return complain("BRR written while UE = 1: ignored");
      merge(brr_, value & 0xFFFF, mask);
      break;
    case reg::presc::kOffset:
      if (on()) return complain("PRESC written while UE = 1: ignored");
      presc_ = reg::presc::kPrescaler.of(value);
      break;
    case reg::rqr::kOffset:
      if (reg::rqr::kRxfrq.of(value) != 0) sr_ &= ~reg::isr::kRxne.mask();
      break;
    case reg::icr::kOffset:  // flags of ISR at the same places, written with 1 to clear
      sr_ &= ~(value & mask &
               (reg::icr::kPecf.mask() | reg::icr::kFecf.mask() | reg::icr::kNcf.mask() | reg::icr::kOrecf.mask() |
                reg::icr::kIdlecf.mask() | reg::icr::kTccf.mask()));
      break;
    case reg::tdr::kOffset:
      send(value);
      break;
    case reg::isr::kOffset:
    case reg::rdr::kOffset:
      return complain("ISR or RDR written: it is read-only");
    default:
      break;
  }
  update();
}

}  // namespace tetap::board
