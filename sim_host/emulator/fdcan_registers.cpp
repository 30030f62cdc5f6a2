// SPDX-License-Identifier: Apache-2.0
// Registers of FDCAN as the program reads and writes them. RM0440 chapter FDCAN, section "FDCAN registers".
#include "sim_host/emulator/fdcan.hpp"
#include "sim_host/emulator/registers_stm32g474.hpp"

namespace tetap::board {

namespace reg = hal::stm32g474_model::fdcan;
namespace cccr = reg::fdcan_cccr;
namespace ir = reg::fdcan_ir;

namespace {
constexpr std::uint32_t kNoChange = 7;  // PSR.LEC
constexpr std::uint32_t kBuffers = (1U << fdcan_ram::kDepth) - 1;
}  // namespace

std::uint32_t Fdcan::read(std::uint32_t offset) {
  switch (offset) {
    case reg::fdcan_crel::kOffset:
      return reg::fdcan_crel::kResetValue;
    case reg::fdcan_endn::kOffset:
      return reg::fdcan_endn::kResetValue;
    case reg::fdcan_dbtp::kOffset:
      return dbtp_;
    case cccr::kOffset:
      return cccr_;
    case reg::fdcan_nbtp::kOffset:
      return nbtp_;
    case reg::fdcan_tscc::kOffset:
      return tscc_;
    case reg::fdcan_tscv::kOffset:
      return timestamp(now());
    case reg::fdcan_ecr::kOffset: {
      const std::uint32_t value = ecr();
      errors_logged_ = 0;
      return value;
    }
    case reg::fdcan_psr::kOffset: {
      const std::uint32_t value = psr();
      lec_ = kNoChange;
      return value;
    }
    case ir::kOffset:
      return ir_;
    case reg::fdcan_ie::kOffset:
      return ie_;
    case reg::fdcan_ils::kOffset:
      return ils_;
    case reg::fdcan_ile::kOffset:
      return ile_;
    case reg::fdcan_rxgfc::kOffset:
      return rxgfc_;
    case reg::fdcan_xidam::kOffset:
      return xidam_;
    case reg::fdcan_hpms::kOffset:
      return hpms_;
    case reg::fdcan_ckdiv::kOffset:
      return ckdiv_;
    default:
      return read_traffic(offset);
  }
}

std::uint32_t Fdcan::read_traffic(std::uint32_t offset) const {
  switch (offset) {
    case reg::fdcan_rxf0s::kOffset:
      return status_of(rx_[0], ir::kRf0l.mask());
    case reg::fdcan_rxf1s::kOffset:
      return status_of(rx_[1], ir::kRf1l.mask());
    case reg::fdcan_txbc::kOffset:
      return txbc_;
    case reg::fdcan_txfqs::kOffset:
      return txfqs();
    case reg::fdcan_txbrp::kOffset:
      return txbrp_;
    case reg::fdcan_txbto::kOffset:
      return txbto_;
    case reg::fdcan_txbcf::kOffset:
      return txbcf_;
    case reg::fdcan_txbtie::kOffset:
      return txbtie_;
    case reg::fdcan_txbcie::kOffset:
      return txbcie_;
    case reg::fdcan_txefs::kOffset:
      return status_of(events_, ir::kTefl.mask());
    default:
      return 0;
  }
}

// Registers that need INIT and CCE; the result is whether `offset` is one.
bool Fdcan::write_protected(std::uint32_t offset, std::uint32_t value) {
  std::uint32_t* target = offset == reg::fdcan_nbtp::kOffset    ? &nbtp_
                          : offset == reg::fdcan_dbtp::kOffset  ? &dbtp_
                          : offset == reg::fdcan_rxgfc::kOffset ? &rxgfc_
                          : offset == reg::fdcan_xidam::kOffset ? &xidam_
                          : offset == reg::fdcan_tscc::kOffset  ? &tscc_
                          : offset == reg::fdcan_txbc::kOffset  ? &txbc_
                          : offset == reg::fdcan_ckdiv::kOffset ? &ckdiv_
                                                                : nullptr;
  const bool other = offset == reg::fdcan_test::kOffset || offset == reg::fdcan_rwd::kOffset ||
                     offset == reg::fdcan_tocc::kOffset || offset == reg::fdcan_tdcr::kOffset;
  if (target == nullptr && !other) return false;
  if (!configurable()) {
    complain("configuration written without INIT and CCE: ignored");
  } else if (other) {
    complain("test, RAM watchdog, time-out counter and delay compensation are not modelled");
  } else {
    *target = value;
    if (offset == reg::fdcan_tscc::kOffset && reg::fdcan_tscc::kTss.of(value) > 1)
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
    case reg::fdcan_tscv::kOffset:
      stamp_zero_ = now();
      break;
    case ir::kOffset:  // written with 1 to clear
      ir_ &= ~value;
      break;
    case reg::fdcan_ie::kOffset:
      ie_ = value;
      break;
    case reg::fdcan_ils::kOffset:
      ils_ = value;
      break;
    case reg::fdcan_ile::kOffset:
      ile_ = value;
      break;
    case reg::fdcan_rxf0a::kOffset:
      acknowledge(rx_[0], reg::fdcan_rxf0a::kF0ai.of(value), "receive FIFO 0");
      break;
    case reg::fdcan_rxf1a::kOffset:
      acknowledge(rx_[1], reg::fdcan_rxf0a::kF0ai.of(value), "receive FIFO 1");
      break;
    case reg::fdcan_txefa::kOffset:
      acknowledge(events_, reg::fdcan_txefa::kEfai.of(value), "event FIFO");
      break;
    case reg::fdcan_txbar::kOffset:
      request(value);
      break;
    case reg::fdcan_txbcr::kOffset:
      cancel(value);
      break;
    case reg::fdcan_txbtie::kOffset:
      txbtie_ = value & kBuffers;
      break;
    case reg::fdcan_txbcie::kOffset:
      txbcie_ = value & kBuffers;
      break;
    default:
      return complain("a read-only register was written");
  }
  update();
}

}  // namespace tetap::board
