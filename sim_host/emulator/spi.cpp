// SPDX-License-Identifier: Apache-2.0
#include "sim_host/emulator/spi.hpp"

#include "hal/chip/stm32/registers_stm32f412.hpp"

namespace tetap::board {

namespace reg = hal::stm32f412::spi;

Spi::Spi(Surroundings around, std::string name, std::uint32_t base, const Pins& pins, Wiring wiring,
         std::function<std::int64_t()> clock_hz, std::function<bool(DmaRequest)> dma)
    : Peripheral(around, std::move(name), base, kBytes),
      pins_(pins),
      wiring_(wiring),
      clock_hz_(std::move(clock_hz)),
      dma_(std::move(dma)),
      finished_(around.scheduler, [this] { finished(); }) {}

void Spi::reset() {
  cr1_ = cr2_ = 0;
  sr_ = reg::sr::kTxe.mask();
  waiting_.reset();
  finished_.clear();
  data_read_ = false;
  update();
}

int Spi::bits() const { return reg::cr1::kDff.of(cr1_) != 0 ? 16 : 8; }

std::int64_t Spi::clock_rate_hz() const { return clock_hz_() >> (reg::cr1::kBr.of(cr1_) + 1); }

std::uint32_t Spi::status() const { return sr_ | reg::sr::kBsy(busy() ? 1 : 0); }

std::uint32_t Spi::read(std::uint32_t offset) {
  switch (offset) {
    case reg::cr1::kOffset:
      return cr1_;
    case reg::cr2::kOffset:
      return cr2_;
    case reg::sr::kOffset: {
      const std::uint32_t value = status();
      if (!data_read_) return value;
      sr_ &= ~reg::sr::kOvr.mask();  // RM0402: DR, then SR
      data_read_ = false;
      update();
      return value;
    }
    case reg::dr::kOffset:
      data_read_ = reg::sr::kOvr.of(sr_) != 0;
      sr_ &= ~reg::sr::kRxne.mask();
      update();
      return received_;
    default:
      return 0;
  }
}

void Spi::write_cr1(std::uint32_t value) {
  const std::uint32_t before = cr1_;
  cr1_ = value & 0xFFFF;
  const std::uint32_t shape = ~(reg::cr1::kSpe.mask() | reg::cr1::kSsi.mask());
  const bool was = reg::cr1::kSpe.of(before) != 0, is = reg::cr1::kSpe.of(cr1_) != 0;
  if (was && ((before ^ cr1_) & shape) != 0) complain("CR1 changed while SPE = 1");
  if (was && !is && busy()) complain("switched off while BSY");
  if (!is) return;
  if (reg::cr1::kMstr.of(cr1_) == 0) return complain("slave mode is not modelled");
  if (reg::cr1::kCrcen.of(cr1_) != 0 || reg::cr1::kBidimode.of(cr1_) != 0 || reg::cr1::kRxonly.of(cr1_) != 0) {
    complain("CRC, one data line and receive-only mode are not modelled");
  }
  check_shape();
  // RM0402, "Master mode fault": NSS low, by pin or by SSI = 0.
  if (reg::cr1::kSsm.of(cr1_) != 0 && reg::cr1::kSsi.of(cr1_) == 0) {
    complain("master with SSM = 1 and SSI = 0: mode fault");
    sr_ |= reg::sr::kModf.mask();
    cr1_ &= ~(reg::cr1::kSpe.mask() | reg::cr1::kMstr.mask());
  }
  if (reg::cr1::kSsm.of(cr1_) == 0 && reg::cr2::kSsoe.of(cr2_) == 0) {
    complain("master with SSM = 0 and SSOE = 0: the level of NSS decides");
  }
}

void Spi::check_shape() {}

void Spi::write(std::uint32_t offset, std::uint32_t value, std::uint32_t mask) {
  switch (offset) {
    case reg::cr1::kOffset: {
      std::uint32_t cr1 = cr1_;
      merge(cr1, value, mask);
      write_cr1(cr1);
      break;
    }
    case reg::cr2::kOffset:
      merge(cr2_, value & 0xF7, mask);
      raise_requests();
      break;
    case reg::dr::kOffset:
      if (reg::cr1::kSpe.of(cr1_) == 0) return complain("DR written with SPE = 0");
      if (reg::sr::kTxe.of(sr_) == 0) complain("DR written before TXE: the waiting item is lost");
      waiting_ = value & (bits() == 16 ? 0xFFFFU : 0xFFU);
      sr_ &= ~reg::sr::kTxe.mask();
      if (!finished_.pending()) start();
      break;
    default:
      break;
  }
  update();
}

void Spi::check_lines() {
  for (const auto& [signal, pin] :
       {std::pair{wiring_.sck_signal, wiring_.sck}, std::pair{wiring_.miso_signal, wiring_.miso},
        std::pair{wiring_.mosi_signal, wiring_.mosi}}) {
    if (!pins_.carries(pin, signal)) complain(std::string(name_of(signal)) + " clocks, but " + pins_.describe(pin));
  }
  int selected = 0;
  for (const Connected& one : devices_) {
    if (!one.selected) continue;
    ++selected;
    if (clock_rate_hz() > one.device->limit_hz())
      complain("clock of " + std::to_string(clock_rate_hz()) + " Hz is too fast for the chip");
    const unsigned mode = 2 * reg::cr1::kCpol.of(cr1_) + reg::cr1::kCpha.of(cr1_);
    if ((one.device->modes() >> mode & 1) == 0) complain("clock mode " + std::to_string(mode) + " is not the chip's");
  }
  if (selected > 1) complain("two chips are selected");
}

void Spi::start() {
  check_lines();
  shift_ = *waiting_;
  waiting_.reset();
  sr_ |= reg::sr::kTxe.mask();
  finished_.set(now() + periods(bits(), clock_rate_hz()));
  raise_requests();
}

std::uint8_t Spi::exchange_byte(std::uint8_t out) {
  const bool wired = pins_.carries(wiring_.sck, wiring_.sck_signal) && pins_.carries(wiring_.mosi, wiring_.mosi_signal);
  std::uint8_t in = 0xFF;  // nobody drives MISO: pulled up on the board
  for (const Connected& one : devices_) {
    if (one.selected && wired) in = one.device->exchange(out);
  }
  if (stuck_miso) in = *stuck_miso ? 0xFF : 0x00;
  return pins_.carries(wiring_.miso, wiring_.miso_signal) ? in : 0x00;
}

std::uint32_t Spi::exchange(std::uint32_t out) {
  if (reg::cr1::kLsbfirst.of(cr1_) != 0) complain("LSBFIRST is not modelled");
  if (bits() == 8) return exchange_byte(static_cast<std::uint8_t>(out));
  const std::uint32_t high = exchange_byte(static_cast<std::uint8_t>(out >> 8));
  return high << 8 | exchange_byte(static_cast<std::uint8_t>(out));
}

void Spi::finished() {
  const std::uint32_t in = exchange(shift_);
  if (reg::sr::kRxne.of(sr_) != 0) {
    sr_ |= reg::sr::kOvr.mask();  // RM0402, "Overrun condition": the new item is lost
  } else {
    received_ = in;
    sr_ |= reg::sr::kRxne.mask();
  }
  if (waiting_) start();
  raise_requests();
  update();
}

void Spi::raise_requests() {
  if (serving_) return;
  serving_ = true;
  if (reg::cr2::kRxdmaen.of(cr2_) != 0 && reg::sr::kRxne.of(sr_) != 0) dma_(wiring_.rx_request);
  if (reg::cr2::kTxdmaen.of(cr2_) != 0 && reg::cr1::kSpe.of(cr1_) != 0) {
    for (int i = 0; i < 2 && reg::sr::kTxe.of(sr_) != 0; ++i) {
      if (!dma_(wiring_.tx_request)) break;
    }
  }
  serving_ = false;
}

void Spi::connect(SpiDevice& device, Pin select, Pins& pins) {
  const std::size_t index = devices_.size();
  devices_.push_back({&device, select, false});
  pins.watch(select, [this, index](bool level) { select_changed(index, level); });
}

void Spi::select_changed(std::size_t index, bool level) {
  if (busy()) complain("select line changed while BSY");
  Connected& one = devices_[index];
  one.selected = !level;
  if (one.selected) {
    one.device->select();
  } else {
    one.device->deselect();
  }
}

void Spi::update() { update_line(sr_); }

void Spi::update_line(std::uint32_t status) {
  const bool level = (reg::cr2::kTxeie.of(cr2_) != 0 && reg::sr::kTxe.of(status) != 0) ||
                     (reg::cr2::kRxneie.of(cr2_) != 0 && reg::sr::kRxne.of(status) != 0) ||
                     (reg::cr2::kErrie.of(cr2_) != 0 && (status & (reg::sr::kOvr.mask() | reg::sr::kModf.mask())) != 0);
  set_interrupt(wiring_.interrupt, level);
}

}  // namespace tetap::board
