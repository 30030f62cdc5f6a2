// SPDX-License-Identifier: Apache-2.0
// What differs between the two generations of the USART. Fields of one name stand at the same bit in both, apart from
// UE; a test holds that. RM0402 and RM0440, chapter "Universal synchronous receiver transmitter (USART)".
#pragma once

#include "hal/chip/stm32/registers_stm32f412.hpp"
#include "hal/chip/stm32/registers_stm32g474.hpp"

#include <cstdint>

namespace tetap::hal::stm32 {

namespace usart = stm32f412::usart;

/// One data register; flags go by a sequence of accesses.
struct UsartOfF4 {
  static constexpr std::uint32_t kControl1 = usart::cr1::kOffset, kControl2 = usart::cr2::kOffset,
                                 kControl3 = usart::cr3::kOffset, kBaudRate = usart::brr::kOffset,
                                 kStatus = usart::sr::kOffset, kReceiveData = usart::dr::kOffset,
                                 kTransmitData = usart::dr::kOffset, kEnable = usart::cr1::kUe.mask();

  template <class Registers>
  static void clear_completed(Registers registers) {
    registers.write(kStatus, ~usart::sr::kTc.mask());
  }
  /// After the status was read.
  template <class Registers>
  static void clear_errors(Registers registers) {
    static_cast<void>(registers.read(kReceiveData));
  }
};

/// Two data registers; flags go by a register of their own.
struct UsartOfG4 {
  static constexpr std::uint32_t kControl1 = stm32g474::usart::cr1::kOffset, kControl2 = stm32g474::usart::cr2::kOffset,
                                 kControl3 = stm32g474::usart::cr3::kOffset, kBaudRate = stm32g474::usart::brr::kOffset,
                                 kStatus = stm32g474::usart::isr::kOffset,
                                 kReceiveData = stm32g474::usart::rdr::kOffset,
                                 kTransmitData = stm32g474::usart::tdr::kOffset,
                                 kEnable = stm32g474::usart::cr1::kUe.mask();

  template <class Registers>
  static void clear_completed(Registers registers) {
    registers.write(stm32g474::usart::icr::kOffset, stm32g474::usart::icr::kTccf.mask());
  }
  template <class Registers>
  static void clear_errors(Registers registers) {
    namespace icr = stm32g474::usart::icr;
    registers.write(icr::kOffset, icr::kPecf.mask() | icr::kFecf.mask() | icr::kNcf.mask() | icr::kOrecf.mask());
  }
};

}  // namespace tetap::hal::stm32
