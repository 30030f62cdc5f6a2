// SPDX-License-Identifier: Apache-2.0
// Clock to 96 MHz from the crystal, or from the HSI where there is none, and a line on the console. Each choice but 0
// makes one mistake.
#include "program.hpp"

using namespace program;

namespace {

enum Mistake : std::uint32_t {
  kNone,
  kAlternateFunction,
  kBlockClock,
  kWaitStates,
  kPllBeforeCrystal,
  kPinLeft,
  kDataBeforeEmpty,
  kBusTooFast,
  kVoltageScale,
  kSwitchBeforeLock,
  kByteAccess,
};

bool is(Mistake mistake) { return shared().choice == mistake; }

bool start_crystal() {
  set(kRcc, reg::rcc::cr::kOffset, reg::rcc::cr::kHseon.mask());
  if (is(kPllBeforeCrystal)) return true;
  return wait(kRcc, reg::rcc::cr::kOffset, reg::rcc::cr::kHserdy.mask(), 20'000);
}

void start_clock() {
  set(kRcc, reg::rcc::apb1enr::kOffset, reg::rcc::apb1enr::kPwren.mask() | reg::rcc::apb1enr::kUsart2en.mask());
  if (!is(kVoltageScale)) set(kPwr, reg::pwr::cr::kOffset, reg::pwr::cr::kVos(3));
  const bool crystal = start_crystal();
  result(0) = crystal;
  const std::uint32_t m = crystal ? 8 : 16;
  kRcc.write(reg::rcc::pllcfgr::kOffset, reg::rcc::pllcfgr::kPllm(m) | reg::rcc::pllcfgr::kPlln(384) |
                                             reg::rcc::pllcfgr::kPllp(1) | reg::rcc::pllcfgr::kPllq(8) |
                                             reg::rcc::pllcfgr::kPllr(2) | reg::rcc::pllcfgr::kPllsrc(crystal));
  set(kRcc, reg::rcc::cr::kOffset, reg::rcc::cr::kPllon.mask());
  if (!is(kSwitchBeforeLock)) wait(kRcc, reg::rcc::cr::kOffset, reg::rcc::cr::kPllrdy.mask());
  kFlash.write(reg::flash::acr::kOffset, reg::flash::acr::kLatency(is(kWaitStates) ? 1 : 3) |
                                             reg::flash::acr::kIcen(1) | reg::flash::acr::kDcen(1));
  kRcc.write(reg::rcc::cfgr::kOffset, reg::rcc::cfgr::kPpre1(is(kBusTooFast) ? 0 : 4));
  set(kRcc, reg::rcc::cfgr::kOffset, reg::rcc::cfgr::kSw(2));
  wait(kRcc, reg::rcc::cfgr::kOffset, reg::rcc::cfgr::kSws(2), 1000);
}

void start_console() {
  set(kRcc, reg::rcc::ahb1enr::kOffset, reg::rcc::ahb1enr::kGpioaen.mask());
  if (is(kBlockClock)) {
    kRcc.write(reg::rcc::apb1enr::kOffset,
               kRcc.read(reg::rcc::apb1enr::kOffset) & ~reg::rcc::apb1enr::kUsart2en.mask());
  }
  if (!is(kPinLeft)) alternate(kGpioA, 2, is(kAlternateFunction) ? 8 : 7);
  kUsart2.write(reg::usart::brr::kOffset, 417);  // 48 MHz / 115 200
  kUsart2.write(reg::usart::cr1::kOffset, reg::usart::cr1::kUe.mask() | reg::usart::cr1::kTe.mask());
}

}  // namespace

void on_exception(std::uint32_t number, std::uint32_t*) {
  result(62) = number;
  stop();
}

void program_main() {
  start_clock();
  start_console();
  if (is(kDataBeforeEmpty)) {
    for (std::uint32_t byte = 'a'; byte < 'd'; ++byte) kUsart2.write(reg::usart::dr::kOffset, byte);
  }
  if (is(kByteAccess)) *reinterpret_cast<volatile std::uint8_t*>(reg::exti::kExti + reg::exti::imr::kOffset) = 1;
  print("hello from 96 MHz\n");
  stop();
}
