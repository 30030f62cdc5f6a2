// SPDX-License-Identifier: Apache-2.0
#include "sim_host/emulator/spi_g4.hpp"

#include "hal/chip/stm32/registers_stm32f412.hpp"
#include "hal/chip/stm32/registers_stm32g474.hpp"

#include <algorithm>

namespace tetap::board {

namespace reg = hal::stm32g474::spi;
namespace older = hal::stm32f412::spi;

// The base works on control bits and flags that lie at the same places in both.
static_assert(reg::cr1::kSpe.lsb == older::cr1::kSpe.lsb && reg::cr1::kBr.lsb == older::cr1::kBr.lsb &&
              reg::cr1::kMstr.lsb == older::cr1::kMstr.lsb && reg::cr1::kSsm.lsb == older::cr1::kSsm.lsb &&
              reg::cr1::kSsi.lsb == older::cr1::kSsi.lsb && reg::cr1::kCpol.lsb == older::cr1::kCpol.lsb &&
              reg::cr1::kCpha.lsb == older::cr1::kCpha.lsb && reg::cr2::kSsoe.lsb == older::cr2::kSsoe.lsb &&
              reg::cr2::kTxeie.lsb == older::cr2::kTxeie.lsb && reg::cr2::kRxneie.lsb == older::cr2::kRxneie.lsb &&
              reg::cr2::kErrie.lsb == older::cr2::kErrie.lsb && reg::sr::kRxne.lsb == older::sr::kRxne.lsb &&
              reg::sr::kTxe.lsb == older::sr::kTxe.lsb && reg::sr::kOvr.lsb == older::sr::kOvr.lsb &&
              reg::sr::kModf.lsb == older::sr::kModf.lsb);

void SpiG4::reset() {
  to_send_.clear();
  arrived_.clear();
  Spi::reset();
  cr2_ = reg::cr2::kResetValue;
}

// RM0440, SPIx_CR2.DS: 0111 is 8 bits, 1111 is 16; what is below 4 bits is taken as 8.
int SpiG4::bits() const {
  const std::uint32_t size = reg::cr2::kDs.of(cr2_);
  return size < 3 ? 8 : static_cast<int>(size) + 1;
}

void SpiG4::check_shape() {
  if (bits() != 8 && bits() != 16) complain("CR2.DS: frames of 8 and 16 bits are modelled");
  if (bits() == 16 && reg::cr2::kFrxth.of(cr2_) != 0) complain("CR2.FRXTH = 1 with frames of 16 bits");
  if ((cr2_ & (reg::cr2::kFrf.mask() | reg::cr2::kNssp.mask() | reg::cr2::kLdmaRx.mask() | reg::cr2::kLdmaTx.mask())) !=
      0)
    complain("CR2: TI frames, NSS pulses and odd packed transfers are not modelled");
}

// RM0440, "Status flags": RXNE from the threshold on, TXE while the transmit FIFO is at most half full, levels in
// quarters.
std::uint32_t SpiG4::flags() const {
  const std::size_t threshold = reg::cr2::kFrxth.of(cr2_) != 0 ? 1 : 2;
  std::uint32_t word = sr_ & (reg::sr::kOvr.mask() | reg::sr::kModf.mask());
  if (arrived_.size() >= threshold) word |= reg::sr::kRxne.mask();
  if (to_send_.size() <= kFifo / 2) word |= reg::sr::kTxe.mask();
  const auto level = [](std::size_t bytes) { return static_cast<std::uint32_t>(std::min<std::size_t>(bytes, 3)); };
  return word | reg::sr::kBsy(busy() ? 1 : 0) | reg::sr::kFrlvl(level(arrived_.size())) |
         reg::sr::kFtlvl(level(to_send_.size()));
}

std::uint32_t SpiG4::take(std::size_t bytes) {
  if (bytes == 1 && frame_bytes() == 2) complain("DR read by a byte with frames of 16 bits");
  if (arrived_.size() < bytes) {
    complain("DR read by " + std::to_string(8 * bytes) + " bits with " + std::to_string(8 * arrived_.size()) +
             " in the FIFO");
  }
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < bytes && !arrived_.empty(); ++i) {
    value |= std::uint32_t{arrived_.front()} << 8 * i;
    arrived_.pop_front();
  }
  data_read_ = reg::sr::kOvr.of(sr_) != 0;
  update();
  return value;
}

std::uint32_t SpiG4::read_part(std::uint32_t offset, std::uint32_t mask) {
  if (offset != reg::dr::kOffset) return read(offset);
  return take(mask == 0xFF ? 1 : 2);
}

std::uint32_t SpiG4::read(std::uint32_t offset) {
  switch (offset) {
    case reg::cr1::kOffset:
      return cr1_;
    case reg::cr2::kOffset:
      return cr2_;
    case reg::sr::kOffset: {
      const std::uint32_t value = flags();
      if (data_read_) sr_ &= ~reg::sr::kOvr.mask();  // DR, then SR
      data_read_ = false;
      update();
      return value;
    }
    case reg::dr::kOffset:
      return take(2);
    default:
      return 0;
  }
}

void SpiG4::put(std::uint32_t value, std::size_t bytes) {
  if (reg::cr1::kSpe.of(cr1_) == 0) return complain("DR written with SPE = 0");
  if (bytes == 1 && frame_bytes() == 2) complain("DR written by a byte with frames of 16 bits");
  if (to_send_.size() > kFifo / 2) complain("DR written before TXE");
  for (std::size_t i = 0; i < bytes && to_send_.size() < kFifo; ++i)
    to_send_.push_back(static_cast<std::uint8_t>(value >> 8 * i));
  if (!finished_.pending()) start();
}

void SpiG4::write(std::uint32_t offset, std::uint32_t value, std::uint32_t mask) {
  switch (offset) {
    case reg::cr1::kOffset: {
      std::uint32_t cr1 = cr1_;
      merge(cr1, value, mask);
      write_cr1(cr1);
      break;
    }
    case reg::cr2::kOffset: {
      const std::uint32_t before = cr2_;
      merge(cr2_, value & 0x7FFF, mask);
      const bool on = reg::cr1::kSpe.of(cr1_) != 0;
      if (on && reg::cr2::kDs.of(before) != reg::cr2::kDs.of(cr2_)) complain("CR2.DS changed while SPE = 1");
      raise_requests();
      break;
    }
    case reg::dr::kOffset:
      put(value & mask, mask == 0xFF ? 1 : 2);
      break;
    default:
      break;
  }
  update();
}

void SpiG4::start() {
  if (to_send_.size() < frame_bytes()) return;
  check_lines();
  shift_ = 0;
  for (std::size_t i = 0; i < frame_bytes(); ++i) {
    shift_ |= std::uint32_t{to_send_.front()} << 8 * i;
    to_send_.pop_front();
  }
  finished_.set(now() + periods(bits(), clock_rate_hz()));
  raise_requests();
}

void SpiG4::finished() {
  std::uint32_t in = 0;
  if (frame_bytes() == 1) {
    in = exchange_byte(static_cast<std::uint8_t>(shift_));
  } else {
    in = std::uint32_t{exchange_byte(static_cast<std::uint8_t>(shift_ >> 8))} << 8;
    in |= exchange_byte(static_cast<std::uint8_t>(shift_));
  }
  if (reg::cr1::kLsbfirst.of(cr1_) != 0) complain("LSBFIRST is not modelled");
  if (arrived_.size() + frame_bytes() > kFifo) {
    sr_ |= reg::sr::kOvr.mask();  // RM0440, "Overrun flag": the new frame is lost
  } else {
    for (std::size_t i = 0; i < frame_bytes(); ++i) arrived_.push_back(static_cast<std::uint8_t>(in >> 8 * i));
  }
  start();
  raise_requests();
  update();
}

void SpiG4::raise_requests() {
  if (serving_) return;
  serving_ = true;
  if (reg::cr2::kRxdmaen.of(cr2_) != 0) {
    while (reg::sr::kRxne.of(flags()) != 0 && dma_(wiring_.rx_request)) continue;
  }
  if (reg::cr2::kTxdmaen.of(cr2_) != 0 && reg::cr1::kSpe.of(cr1_) != 0) {
    while (reg::sr::kTxe.of(flags()) != 0 && dma_(wiring_.tx_request)) continue;
  }
  serving_ = false;
}

void SpiG4::update() { update_line(flags()); }

}  // namespace tetap::board
