// SPDX-License-Identifier: Apache-2.0
#include "sim_host/emulator/can_filters.hpp"

#include "hal/chip/stm32/registers_stm32f412.hpp"

namespace tetap::board {

namespace reg = hal::stm32f412::can;

std::uint32_t CanFilters::read(std::uint32_t offset) const {
  switch (offset) {
    case reg::fmr::kOffset:
      return (reg::fmr::kResetValue & ~1U) | (initialisation_ ? 1U : 0U);
    case reg::fm1r::kOffset:
      return list_;
    case reg::fs1r::kOffset:
      return wide_;
    case reg::ffa1r::kOffset:
      return second_fifo_;
    case reg::fa1r::kOffset:
      return active_;
    default:
      break;
  }
  const std::uint32_t index = (offset - reg::fxr1::kOffset) / reg::fxr1::kStride;
  if (offset < reg::fxr1::kOffset || index >= kBanks) return 0;
  return (offset & 4) == 0 ? banks_[index].r1 : banks_[index].r2;
}

const char* CanFilters::write(std::uint32_t offset, std::uint32_t value) {
  value &= offset < reg::fxr1::kOffset ? 0x0FFF'FFFF : ~0U;
  switch (offset) {
    case reg::fmr::kOffset:
      initialisation_ = reg::fmr::kFinit.of(value) != 0;
      return nullptr;
    case reg::fa1r::kOffset:
      active_ = value;
      return nullptr;
    case reg::fm1r::kOffset:
    case reg::fs1r::kOffset:
    case reg::ffa1r::kOffset:
      if (!initialisation_) return "filter mode, scale or FIFO written with FINIT = 0: ignored";
      (offset == reg::fm1r::kOffset ? list_ : offset == reg::fs1r::kOffset ? wide_ : second_fifo_) = value;
      return nullptr;
    default:
      break;
  }
  const std::uint32_t index = (offset - reg::fxr1::kOffset) / reg::fxr1::kStride;
  if (offset < reg::fxr1::kOffset || index >= kBanks) return nullptr;
  if (!initialisation_ && (active_ >> index & 1) != 0) return "filter bank written while it is active: ignored";
  ((offset & 4) == 0 ? banks_[index].r1 : banks_[index].r2) = value;
  return nullptr;
}

int CanFilters::size_of(std::uint32_t bank) const {
  const bool list = (list_ >> bank & 1) != 0, wide = (wide_ >> bank & 1) != 0;
  return (wide ? 1 : 2) * (list ? 2 : 1);
}

// Layouts of the manual's figure "Filter bank scale configuration".
int CanFilters::match_bank(std::uint32_t bank, const CanOffer& offered) const {
  const base::CanFrame& frame = offered.frame;
  const std::uint32_t standard = frame.extended ? frame.id >> 18 : frame.id;
  const std::uint32_t extended = frame.extended ? frame.id & 0x3FFFF : 0;
  const std::uint32_t ide = frame.extended ? 1 : 0, rtr = offered.remote ? 1 : 0;
  const Bank& at = banks_[bank];
  const bool list = (list_ >> bank & 1) != 0;
  if ((wide_ >> bank & 1) != 0) {
    const std::uint32_t id = standard << 21 | extended << 3 | ide << 2 | rtr << 1;
    if (list) return id == (at.r1 & ~1U) ? 0 : id == (at.r2 & ~1U) ? 1 : -1;
    return ((id ^ at.r1) & at.r2 & ~1U) == 0 ? 0 : -1;
  }
  const std::uint32_t id = standard << 5 | rtr << 4 | ide << 3 | extended >> 15;
  const std::uint32_t parts[] = {at.r1 & 0xFFFF, at.r1 >> 16, at.r2 & 0xFFFF, at.r2 >> 16};
  if (list) {
    for (int i = 0; i < 4; ++i) {
      if (id == parts[i]) return i;
    }
    return -1;
  }
  for (int i = 0; i < 2; ++i) {
    if (((id ^ parts[2 * i]) & parts[2 * i + 1]) == 0) return i;
  }
  return -1;
}

std::optional<CanFilters::Match> CanFilters::match(const CanOffer& frame) const {
  if (initialisation_) return std::nullopt;
  int number[2] = {0, 0};
  for (std::uint32_t bank = 0; bank < kOwnBanks; ++bank) {
    const int fifo = static_cast<int>(second_fifo_ >> bank & 1);
    if ((active_ >> bank & 1) != 0) {
      const int inside = match_bank(bank, frame);
      if (inside >= 0) return Match{fifo, number[fifo] + inside};
    }
    number[fifo] += size_of(bank);
  }
  return std::nullopt;
}

}  // namespace tetap::board
