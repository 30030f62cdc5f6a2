// SPDX-License-Identifier: Apache-2.0
// A chip alone on an SPI bus, this side the master in mode 3, polled: a byte out, a byte in. RM0402 chapter "Serial
// peripheral interface / integrated interchip sound (SPI/I2S)".
#pragma once

#include "hal/chip/stm32/registers_stm32f412.hpp"
#include "hal/chip/stm32/registers_stm32g474.hpp"
#include "hal/spi_device.hpp"

#include <cstdint>
#include <span>

namespace tetap::hal::stm32 {

namespace spi = stm32f412::spi;

/// The data register of the F4: a frame is a word of it.
struct SpiDataOfF4 {
  static constexpr std::uint32_t kControl2 = 0;
  template <class Registers>
  static void put(Registers registers, std::uint8_t byte) {
    registers.write(spi::dr::kOffset, byte);
  }
  template <class Registers>
  [[nodiscard]] static std::uint32_t take(Registers registers) {
    return registers.read(spi::dr::kOffset);
  }
};

/// FIFOs of the G4: an access of one byte is one frame, a wider one two. RM0440, "Data packing", FRXTH, DS.
struct SpiDataOfG4 {
  static constexpr std::uint32_t kControl2 = stm32g474::spi::cr2::kFrxth.mask() | stm32g474::spi::cr2::kDs(8 - 1);
  template <class Registers>
  static void put(Registers registers, std::uint8_t byte) {
    registers.write_byte(stm32g474::spi::dr::kOffset, byte);
  }
  template <class Registers>
  [[nodiscard]] static std::uint32_t take(Registers registers) {
    return registers.read_byte(stm32g474::spi::dr::kOffset);
  }
};

/// `Select` has clear() and set(): the chip select, low when active.
template <class Registers, class Select, class Data = SpiDataOfF4>
class SpiMaster {
 public:
  constexpr SpiMaster(Registers registers, Select select) : registers_{registers}, select_{select} {}

  /// The fastest clock, by the powers of two that BR has, that is not above `most_hz`.
  void start(std::uint32_t clock_hz, std::uint32_t most_hz) {
    std::uint32_t divider = 0;
    while (divider < (1U << spi::cr1::kBr.width) - 1 && clock_hz >> (divider + 1) > most_hz) ++divider;
    registers_.write(spi::cr1::kOffset, 0);
    registers_.write(spi::cr2::kOffset, Data::kControl2);
    const std::uint32_t mode = spi::cr1::kMstr.mask() | spi::cr1::kCpol.mask() | spi::cr1::kCpha.mask() |
                               spi::cr1::kSsm.mask() | spi::cr1::kSsi.mask() | spi::cr1::kBr(divider);
    registers_.write(spi::cr1::kOffset, mode);
    registers_.write(spi::cr1::kOffset, mode | spi::cr1::kSpe.mask());
  }

  [[nodiscard]] bool transfer(std::span<const std::uint8_t> out, std::span<std::uint8_t> in) {
    discard_received();
    select_.clear();
    bool good = true;
    std::uint8_t ignored = 0;
    for (std::size_t i = 0; good && i < out.size(); ++i) good = exchange(out[i], ignored);
    for (std::size_t i = 0; good && i < in.size(); ++i) good = exchange(kIdle, in[i]);
    // "Procedure for disabling the SPI": the last clock edge is out when BSY is 0.
    good = waits_for(spi::sr::kBsy, 0) && good;
    select_.set();
    return good;
  }

 private:
  // One byte lasts 8 periods of SCK, at most 2048 clocks of the core; a pass is some 8 of these.
  static constexpr int kPatience = 1000;
  static constexpr std::uint8_t kIdle = 0xFF;

  [[nodiscard]] bool waits_for(Field field, std::uint32_t value) const {
    for (int i = 0; i < kPatience; ++i) {
      if (field.of(registers_.read(spi::sr::kOffset)) == value) return true;
    }
    return false;
  }

  /// One byte is on its way at a time, so an interrupt of any length cannot make the receiver overrun.
  [[nodiscard]] bool exchange(std::uint8_t out, std::uint8_t& in) const {
    if (!waits_for(spi::sr::kTxe, 1)) return false;
    Data::put(registers_, out);
    if (!waits_for(spi::sr::kRxne, 1)) return false;
    const std::uint32_t status = registers_.read(spi::sr::kOffset);
    in = static_cast<std::uint8_t>(Data::take(registers_));
    return (status & (spi::sr::kOvr.mask() | spi::sr::kModf.mask())) == 0;
  }

  /// After a transfer that failed: a byte that was left, and an overrun, which reading DR and then SR clears.
  void discard_received() const {
    if ((registers_.read(spi::sr::kOffset) & (spi::sr::kRxne.mask() | spi::sr::kOvr.mask())) == 0) return;
    static_cast<void>(Data::take(registers_));
    static_cast<void>(registers_.read(spi::sr::kOffset));
  }

  Registers registers_;
  Select select_;
};

}  // namespace tetap::hal::stm32
