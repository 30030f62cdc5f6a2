// SPDX-License-Identifier: Apache-2.0
#include "sim_host/emulator/usart.hpp"

#include "hal/chip/stm32/registers_stm32f412.hpp"

namespace tetap::board {

namespace reg = hal::stm32f412::usart;

namespace {
constexpr std::uint32_t kErrors =
    reg::sr::kPe.mask() | reg::sr::kFe.mask() | reg::sr::kNf.mask() | reg::sr::kOre.mask() | reg::sr::kIdle.mask();
}

Usart::Usart(Surroundings around, std::string name, std::uint32_t base, const Pins& pins, Wiring wiring,
             std::function<std::int64_t()> clock_hz, std::function<bool(DmaRequest)> dma)
    : Peripheral(around, std::move(name), base, kBytes),
      pins_(pins),
      wiring_(wiring),
      clock_hz_(std::move(clock_hz)),
      dma_(std::move(dma)),
      sent_(around.scheduler, [this] { sent(); }),
      received_(around.scheduler, [this] { received(); }),
      idle_(around.scheduler, [this] { idle(); }) {}

void Usart::reset() {
  sr_ = reg::sr::kTc.mask() | reg::sr::kTxe.mask();
  brr_ = cr1_ = cr2_ = cr3_ = 0;
  waiting_.reset();
  status_read_ = false;
  sent_.clear();
  idle_.clear();
  update();
}

bool Usart::on() const { return reg::cr1::kUe.of(cr1_) != 0; }

// RM0402, "Fractional baud rate generation": USARTDIV in sixteenths, or in eighths with OVER8 = 1 (three fraction
// bits).
std::int64_t Usart::baud() const {
  const bool over8 = reg::cr1::kOver8.of(cr1_) != 0;
  const std::int64_t divider = over8 ? (brr_ & 0xFFF0) / 2 + (brr_ & 7) : brr_;
  return divider == 0 ? 1 : clock_hz_() / divider;
}

std::uint32_t Usart::read(std::uint32_t offset) {
  switch (offset) {
    case reg::sr::kOffset:
      status_read_ = true;
      return sr_;
    case reg::dr::kOffset:
      return read_data();
    case reg::brr::kOffset:
      return brr_;
    case reg::cr1::kOffset:
      return cr1_;
    case reg::cr2::kOffset:
      return cr2_;
    case reg::cr3::kOffset:
      return cr3_;
    default:
      return 0;
  }
}

std::uint32_t Usart::read_data() {
  if (status_read_) sr_ &= ~kErrors;
  status_read_ = false;
  sr_ &= ~reg::sr::kRxne.mask();
  update();
  return data_;
}

void Usart::write(std::uint32_t offset, std::uint32_t value, std::uint32_t mask) {
  switch (offset) {
    case reg::sr::kOffset:  // rc_w0: RXNE and TC can be cleared by writing 0
      sr_ &= (value | ~mask) | ~(reg::sr::kRxne.mask() | reg::sr::kTc.mask());
      break;
    case reg::dr::kOffset:
      if (!on() || reg::cr1::kTe.of(cr1_) == 0) return complain("DR written with the transmitter off: lost");
      if (reg::sr::kTxe.of(sr_) == 0) complain("DR written before TXE: the waiting byte is lost");
      if (status_read_) sr_ &= ~reg::sr::kTc.mask();
      put_data(static_cast<std::uint8_t>(value));
      break;
    case reg::brr::kOffset:
      if (on() && (sent_.pending() || received_.pending())) complain("BRR written during a character");
      merge(brr_, value & 0xFFFF, mask);
      break;
    case reg::cr1::kOffset: {
      const bool was = on();
      merge(cr1_, value, mask);
      if (!on() && was && sent_.pending()) complain("switched off during a character");
      if (on() && !was && brr_ < 16) complain("switched on with BRR below 16");
      if (reg::cr1::kM.of(cr1_) != 0 || reg::cr1::kPce.of(cr1_) != 0) complain("9 bits and parity are not modelled");
      break;
    }
    case reg::cr2::kOffset:
      merge(cr2_, value, mask);
      break;
    case reg::cr3::kOffset:
      merge(cr3_, value, mask);
      raise_requests();
      break;
    default:
      break;
  }
  update();
}

void Usart::put_data(std::uint8_t byte) {
  waiting_ = byte;
  sr_ &= ~reg::sr::kTxe.mask();
  if (!sent_.pending()) start_sending();
}

void Usart::start_sending() {
  if (!pins_.carries(wiring_.tx_pin, wiring_.tx_signal)) {
    complain(std::string(name_of(wiring_.tx_signal)) + " sends, but " + pins_.describe(wiring_.tx_pin));
  }
  shift_ = *waiting_;
  waiting_.reset();
  sr_ = (sr_ | reg::sr::kTxe.mask()) & ~reg::sr::kTc.mask();
  sent_.set(now() + character());
  raise_requests();
}

void Usart::sent() {
  if (on_sent && pins_.carries(wiring_.tx_pin, wiring_.tx_signal)) on_sent(shift_, baud());
  if (waiting_) {
    start_sending();
  } else {
    sr_ |= reg::sr::kTc.mask();
  }
  update();
}

void Usart::arrive(std::uint8_t byte, std::int64_t baud) {
  arriving_ = byte;
  arriving_baud_ = baud;
  idle_.clear();
  received_.set(now() + periods(10, baud));
}

// The receiver samples a byte's ten bits, start and stop bit included, in the middle of its own bit times. The line is
// high behind the stop bit.
void Usart::received() {
  if (!on() || reg::cr1::kRe.of(cr1_) == 0) return;
  if (!pins_.carries(wiring_.rx_pin, wiring_.rx_signal)) {
    return complain(std::string(name_of(wiring_.rx_signal)) + " gets a byte, but " + pins_.describe(wiring_.rx_pin));
  }
  const std::int64_t own = baud();
  const std::uint32_t wave = std::uint32_t{arriving_} << 1 | 1U << 9;
  std::uint32_t byte = 0;
  bool stop = true;
  for (std::int64_t bit = 1; bit <= 9; ++bit) {
    const std::int64_t index = (2 * bit + 1) * arriving_baud_ / (2 * own);
    const bool high = index > 9 || (wave >> index & 1) != 0;
    if (bit <= 8) byte |= (high ? 1U : 0U) << (bit - 1);
    if (bit == 9) stop = high;
  }
  take(static_cast<std::uint8_t>(byte), stop ? 0 : reg::sr::kFe.mask());
  idle_.set(now() + character());
}

void Usart::take(std::uint8_t byte, std::uint32_t errors) {
  if (reg::sr::kRxne.of(sr_) != 0 && !overrun_off()) {
    sr_ |= reg::sr::kOre.mask();  // the byte before stays, this one is lost
  } else {
    data_ = byte;
    sr_ |= reg::sr::kRxne.mask() | errors;
    status_read_ = false;
  }
  update();
  raise_requests();
}

void Usart::idle() {
  sr_ |= reg::sr::kIdle.mask();
  update();
}

void Usart::raise_requests() {
  if (serving_) return;
  serving_ = true;
  if (reg::cr3::kDmar.of(cr3_) != 0 && reg::sr::kRxne.of(sr_) != 0) dma_(wiring_.rx_request);
  if (reg::cr3::kDmat.of(cr3_) != 0 && on()) {
    for (int i = 0; i < 2 && reg::sr::kTxe.of(sr_) != 0; ++i) {  // shift register, then data register
      if (!dma_(wiring_.tx_request)) break;
    }
  }
  serving_ = false;
}

void Usart::update() {
  const bool level = (reg::cr1::kRxneie.of(cr1_) != 0 && (sr_ & (reg::sr::kRxne.mask() | reg::sr::kOre.mask())) != 0) ||
                     (reg::cr1::kTxeie.of(cr1_) != 0 && reg::sr::kTxe.of(sr_) != 0) ||
                     (reg::cr1::kTcie.of(cr1_) != 0 && reg::sr::kTc.of(sr_) != 0) ||
                     (reg::cr1::kIdleie.of(cr1_) != 0 && reg::sr::kIdle.of(sr_) != 0) ||
                     (reg::cr3::kEie.of(cr3_) != 0 && reg::cr3::kDmar.of(cr3_) != 0 &&
                      (sr_ & (reg::sr::kFe.mask() | reg::sr::kOre.mask() | reg::sr::kNf.mask())) != 0);
  set_interrupt(wiring_.interrupt, on() && level);
}

}  // namespace tetap::board
