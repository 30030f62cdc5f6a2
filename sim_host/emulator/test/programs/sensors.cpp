// SPDX-License-Identifier: Apache-2.0
// A node in small: 96 MHz, SysTick, IMU identity over SPI1, encoders, a serial ring by DMA, CAN frames by interrupt,
// and a watchdog. Each choice but 0 makes one mistake.
#include "choices.hpp"
#include "program.hpp"

using namespace program;
using namespace tetap::board;

namespace {

bool is(Mistake mistake) { return shared().choice == mistake; }

constexpr Mmio kSpi{reg::spi::kSpi1}, kCan{reg::can::kCan1}, kDma{reg::dma::kDma2}, kUsart1{reg::usart::kUsart1},
    kTim2{reg::tim::kTim2}, kTim3{reg::tim::kTim3}, kIwdg{reg::iwdg::kIwdg};
constexpr std::uint32_t kRing = 0x2000'4000, kRingSize = 64, kStream = 5 * reg::dma::sxcr::kStride;
volatile std::uint32_t ticks, sent, received;

void start_clock() {
  set(kRcc, reg::rcc::apb1enr::kOffset,
      reg::rcc::apb1enr::kPwren.mask() | reg::rcc::apb1enr::kCan1en.mask() | reg::rcc::apb1enr::kTim2en.mask() |
          reg::rcc::apb1enr::kTim3en.mask());
  set(kPwr, reg::pwr::cr::kOffset, reg::pwr::cr::kVos(3));
  set(kRcc, reg::rcc::cr::kOffset, reg::rcc::cr::kHseon.mask());
  wait(kRcc, reg::rcc::cr::kOffset, reg::rcc::cr::kHserdy.mask());
  kRcc.write(reg::rcc::pllcfgr::kOffset, reg::rcc::pllcfgr::kPllm(8) | reg::rcc::pllcfgr::kPlln(384) |
                                             reg::rcc::pllcfgr::kPllp(1) | reg::rcc::pllcfgr::kPllq(8) |
                                             reg::rcc::pllcfgr::kPllsrc(1));
  set(kRcc, reg::rcc::cr::kOffset, reg::rcc::cr::kPllon.mask());
  wait(kRcc, reg::rcc::cr::kOffset, reg::rcc::cr::kPllrdy.mask());
  kFlash.write(reg::flash::acr::kOffset, reg::flash::acr::kLatency(3));
  kRcc.write(reg::rcc::cfgr::kOffset, reg::rcc::cfgr::kPpre1(4) | reg::rcc::cfgr::kSw(2));
  set(kRcc, reg::rcc::ahb1enr::kOffset, 7 | reg::rcc::ahb1enr::kDma2en.mask());
  set(kRcc, reg::rcc::apb2enr::kOffset, reg::rcc::apb2enr::kSpi1en.mask() | reg::rcc::apb2enr::kUsart1en.mask());
}

std::uint32_t spi(std::uint32_t out) {
  wait(kSpi, reg::spi::sr::kOffset, reg::spi::sr::kTxe.mask(), 1000);
  kSpi.write(reg::spi::dr::kOffset, out);
  if (is(kDataBeforeEmpty)) kSpi.write(reg::spi::dr::kOffset, out), kSpi.write(reg::spi::dr::kOffset, out);
  wait(kSpi, reg::spi::sr::kOffset, reg::spi::sr::kRxne.mask(), 1000);
  return kSpi.read(reg::spi::dr::kOffset);
}

std::uint32_t identity() {
  kGpioA.write(reg::gpio::bsrr::kOffset, 1U << 20);
  spi(0xF5);
  const std::uint32_t value = spi(0);
  if (is(kSelectEarly)) kSpi.write(reg::spi::dr::kOffset, 0);
  kGpioA.write(reg::gpio::bsrr::kOffset, 1U << 4);
  return value;
}

void start_sensors() {
  kGpioA.write(reg::gpio::bsrr::kOffset, 1U << 4);
  output(kGpioA, 4);
  for (std::uint32_t pin = 5; pin <= 7; ++pin) alternate(kGpioA, pin, 5);
  kSpi.write(reg::spi::cr1::kOffset, reg::spi::cr1::kMstr(1) | reg::spi::cr1::kSsm(1) | reg::spi::cr1::kSsi(1) |
                                         reg::spi::cr1::kBr(3) | reg::spi::cr1::kCpol(1) | reg::spi::cr1::kCpha(1) |
                                         reg::spi::cr1::kSpe(1));
  alternate(kGpioA, 0, 1);
  alternate(kGpioA, 1, 1);
  alternate(kGpioB, 4, 2);
  alternate(kGpioB, 5, 2);
  for (const Mmio* timer = &kTim2;; timer = &kTim3) {
    if (is(kReloadTooSmall)) timer->write(reg::tim::arr::kOffset, 0xFFFE);
    timer->write(reg::tim::smcr::kOffset, reg::tim::smcr::kSms(3));
    timer->write(reg::tim::ccmr1_input::kOffset, reg::tim::ccmr1_input::kCc1s(1) | reg::tim::ccmr1_input::kCc2s(1));
    timer->write(reg::tim::cr1::kOffset, reg::tim::cr1::kCen(1));
    if (timer == &kTim3) break;
  }
}

void start_serial() {
  alternate(kGpioA, 15, 7);
  alternate(kGpioB, 3, 7);
  const std::uint32_t stream = is(kWrongStream) ? 4 * reg::dma::sxcr::kStride : kStream;
  kDma.write(reg::dma::sxpar::kOffset + stream, reg::usart::kUsart1 + reg::usart::dr::kOffset);
  kDma.write(reg::dma::sxm0ar::kOffset + stream, kRing);
  kDma.write(reg::dma::sxndtr::kOffset + stream, kRingSize);
  kDma.write(reg::dma::sxcr::kOffset + stream,
             reg::dma::sxcr::kChsel(4) | reg::dma::sxcr::kMinc(1) | reg::dma::sxcr::kCirc(1) | reg::dma::sxcr::kEn(1));
  kUsart1.write(reg::usart::brr::kOffset, 833);  // 96 MHz / 115 200
  kUsart1.write(reg::usart::cr3::kOffset, reg::usart::cr3::kDmar.mask());
  kUsart1.write(reg::usart::cr1::kOffset,
                reg::usart::cr1::kUe.mask() | reg::usart::cr1::kRe.mask() | reg::usart::cr1::kTe.mask());
}

void start_can() {
  alternate(kGpioA, 11, 9);
  alternate(kGpioA, 12, 9);
  const std::uint32_t mode = is(kPriorityById) ? 0 : reg::can::mcr::kTxfp.mask();
  kCan.write(reg::can::mcr::kOffset, mode | reg::can::mcr::kAbom.mask() | reg::can::mcr::kInrq.mask());
  wait(kCan, reg::can::msr::kOffset, reg::can::msr::kInak.mask());
  kCan.write(reg::can::btr::kOffset, reg::can::btr::kBrp(5) | reg::can::btr::kTs1(12) | reg::can::btr::kTs2(1));
  kCan.write(reg::can::fs1r::kOffset, 1);
  kCan.write(reg::can::fa1r::kOffset, 1);
  kCan.write(reg::can::fmr::kOffset, 0);
  kCan.write(reg::can::mcr::kOffset, mode | reg::can::mcr::kAbom.mask());
  for (int i = 0; i < 200'000 && (kCan.read(reg::can::msr::kOffset) & reg::can::msr::kInak.mask()) != 0; ++i) {
  }
  kCan.write(reg::can::ier::kOffset, reg::can::ier::kTmeie.mask() | reg::can::ier::kFmpie0.mask());
  kScs.write(m4::nvic::kIser, 1U << reg::interrupt::kCan1Tx | 1U << reg::interrupt::kCan1Rx0);
}

void request(std::uint32_t box, std::uint32_t id, std::uint32_t low, std::uint32_t high) {
  const std::uint32_t at = box * reg::can::tixr::kStride;
  kCan.write(reg::can::tdtxr::kOffset + at, 8);
  kCan.write(reg::can::tdlxr::kOffset + at, low);
  kCan.write(reg::can::tdhxr::kOffset + at, high);
  kCan.write(reg::can::tixr::kOffset + at, reg::can::tixr::kStid(id) | reg::can::tixr::kTxrq(1));
}

void start_watchdog() {  // 100 ms of 32 kHz
  kIwdg.write(reg::iwdg::kr::kOffset, 0x5555);
  kIwdg.write(reg::iwdg::pr::kOffset, 1);
  kIwdg.write(reg::iwdg::rlr::kOffset, 399);
  for (int i = 0; i < 200'000 && kIwdg.read(reg::iwdg::sr::kOffset) != 0; ++i) {
  }
  kIwdg.write(reg::iwdg::kr::kOffset, 0xCCCC);
  kIwdg.write(reg::iwdg::kr::kOffset, 0xAAAA);
}

void exercise() {
  for (std::uint32_t i = 0; i < 5'000'000; ++i) asm volatile("nop");
}

}  // namespace

void on_exception(std::uint32_t number, std::uint32_t*) {
  if (number == 15) {
    ticks = ticks + 1;
  } else if (number == 16 + reg::interrupt::kCan1Tx) {
    if (is(kRequestNotCleared)) return;
    const std::uint32_t done =
        reg::can::tsr::kRqcp0.mask() | reg::can::tsr::kRqcp1.mask() | reg::can::tsr::kRqcp2.mask();
    kCan.write(reg::can::tsr::kOffset, kCan.read(reg::can::tsr::kOffset) & done);
    sent = sent + 1;
  } else if (number == 16 + reg::interrupt::kCan1Rx0) {
    received = received + 1;
    if (!is(kFifoNotReleased)) kCan.write(reg::can::rf0r::kOffset, reg::can::rf0r::kRfom0.mask());
  } else {
    result(62) = number;
    stop();
  }
}

void program_main() {
  ticks = 0;
  sent = 0;
  received = 0;
  result(10) = result(10) + 1;
  result(11) = kRcc.read(reg::rcc::csr::kOffset);
  set(kRcc, reg::rcc::csr::kOffset, reg::rcc::csr::kRmvf.mask());
  start_clock();
  if (is(kWatchdogBeforeExercise)) start_watchdog();
  exercise();
  start_sensors();
  start_serial();
  start_can();
  kScs.write(m4::systick::kRvr, 959'999);  // 10 ms
  kScs.write(m4::systick::kCvr, 0);
  kScs.write(m4::systick::kCsr, 7);
  start_watchdog();
  for (std::uint32_t done = 0;;) {
    asm volatile("wfi");
    if (ticks == done) continue;
    done = ticks;
    if (is(kLoopStalled) && done == 20) {
      for (;;) asm volatile("nop");
    }
    kIwdg.write(reg::iwdg::kr::kOffset, 0xAAAA);
    result(0) = identity();
    result(1) = kTim2.read(reg::tim::cnt::kOffset);
    result(2) = kTim3.read(reg::tim::cnt::kOffset);
    result(3) = kDma.read(reg::dma::sxndtr::kOffset + kStream);
    result(4) = done;
    result(5) = sent;
    result(6) = received;
    request(2, 0x303, done, 3);
    request(1, 0x302, done, 2);
    request(0, 0x301, result(0), result(1));
  }
}
