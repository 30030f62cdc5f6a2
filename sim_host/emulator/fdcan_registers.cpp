// SPDX-License-Identifier: Apache-2.0
// Registers of FDCAN as the program reads and writes them. RM0440 chapter FDCAN, section "FDCAN registers".
#include "hal/chip/stm32/registers_stm32g474.hpp"
#include "sim_host/emulator/fdcan.hpp"

namespace tetap::board {

namespace reg = hal::stm32g474::fdcan;
namespace cccr = reg::cccr;
namespace ir = reg::ir;

namespace {
constexpr std::uint32_t kNoChange = 7;  // PSR.LEC
constexpr std::uint32_t kBuffers = (1U << fdcan_ram::kDepth) - 1;
}  // namespace

std::uint32_t Fdcan::read(std::uint32_t offset) {
  switch (offset) {
    case reg::crel::kOffset:
      return reg::crel::kResetValue;
    case reg::endn::kOffset:
      return reg::endn::kResetValue;
    case reg::dbtp::kOffset:
      return dbtp_;
    case cccr::kOffset:
      return cccr_;
    case reg::nbtp::kOffset:
      return nbtp_;
    case reg::tscc::kOffset:
      return tscc_;
    case reg::tscv::kOffset:
      return timestamp(now());
    case reg::ecr::kOffset: {
      const std::uint32_t value = ecr();
      errors_logged_ = 0;
      return value;
    }
    case reg::psr::kOffset: {
      const std::uint32_t value = psr();
      lec_ = kNoChange;
      return value;
    }
    case ir::kOffset:
      return ir_;
    case reg::ie::kOffset:
      return ie_;
    case reg::ils::kOffset:
      return ils_;
    case reg::ile::kOffset:
      return ile_;
    case reg::rxgfc::kOffset:
      return rxgfc_;
    case reg::xidam::kOffset:
      return xidam_;
    case reg::hpms::kOffset:
      return hpms_;
    case reg::ckdiv::kOffset:
      return ckdiv_;
    default:
      return read_traffic(offset);
  }
}

std::uint32_t Fdcan::read_traffic(std::uint32_t offset) const {
  switch (offset) {
    case reg::rxf0s::kOffset:
      return status_of(rx_[0], ir::kRf0l.mask());
    case reg::rxf1s::kOffset:
      return status_of(rx_[1], ir::kRf1l.mask());
    case reg::txbc::kOffset:
      return txbc_;
    case reg::txfqs::kOffset:
      return txfqs();
    case reg::txbrp::kOffset:
      return txbrp_;
    case reg::txbto::kOffset:
      return txbto_;
    case reg::txbcf::kOffset:
      return txbcf_;
    case reg::txbtie::kOffset:
      return txbtie_;
    case reg::txbcie::kOffset:
      return txbcie_;
    case reg::txefs::kOffset:
      return status_of(events_, ir::kTefl.mask());
    default:
      return 0;
  }
}

// Registers that need INIT and CCE; the result is whether `offset` is one.
bool Fdcan::write_protected(std::uint32_t offset, std::uint32_t value) {
  std::uint32_t* target = offset == reg::nbtp::kOffset    ? &nbtp_
                          : offset == reg::dbtp::kOffset  ? &dbtp_
                          : offset == reg::rxgfc::kOffset ? &rxgfc_
                          : offset == reg::xidam::kOffset ? &xidam_
                          : offset == reg::tscc::kOffset  ? &tscc_
                          : offset == reg::txbc::kOffset  ? &txbc_
                          : offset == reg::ckdiv::kOffset ? &ckdiv_
                                                          : nullptr;
  const bool other = offset == reg::test::kOffset || offset == reg::rwd::kOffset || offset == reg::tocc::kOffset ||
                     offset == reg::tdcr::kOffset;
  if (target == nullptr && !other) return false;
  if (!configurable()) {
    complain("configuration written without INIT and CCE: ignored");
  } else if (other) {
    complain("test, RAM watchdog, time-out counter and delay compensation are not modelled");
  } else {
    *target = value;
    if (offset == reg::tscc::kOffset && reg::tscc::kTss.of(value) > 1)
      complain("TSCC: the external time stamp counter is not modelled");
  }
  return true;
}

void Fdcan::write(std::uint32_t offset, std::uint32_t value, std::uint32_t mask) {
  value &= mask;
  if (write_protected(offset, value)) return;
  switch (offset) {
    case cccr::kOffset:
      write_cccr(value);
      break;
    case reg::tscv::kOffset:
      stamp_zero_ = now();
      break;
    case ir::kOffset:  // written with 1 to clear
      ir_ &= ~value;
      break;
    case reg::ie::kOffset:
      ie_ = value;
      break;
    case reg::ils::kOffset:
      ils_ = value;
      break;
    case reg::ile::kOffset:
      ile_ = value;
      break;
    case reg::rxf0a::kOffset:
      acknowledge(rx_[0], reg::rxf0a::kF0ai.of(value), "receive FIFO 0");
      break;
    case reg::rxf1a::kOffset:
      acknowledge(rx_[1], reg::rxf0a::kF0ai.of(value), "receive FIFO 1");
      break;
    case reg::txefa::kOffset:
      acknowledge(events_, reg::txefa::kEfai.of(value), "event FIFO");
      break;
    case reg::txbar::kOffset:
      request(value);
      break;
    case reg::txbcr::kOffset:
      cancel(value);
      break;
    case reg::txbtie::kOffset:
      txbtie_ = value & kBuffers;
      break;
    case reg::txbcie::kOffset:
      txbcie_ = value & kBuffers;
      break;
    default:
      return complain("a read-only register was written");
  }
  update();
}

}  // namespace tetap::board
